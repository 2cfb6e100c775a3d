//! Scripts that drive a window, for tests and documentation.

use crate::action::{Action, chosen};
use crate::settings::{Compare, OverlayKind};
use crate::sun::Sun;
use glam::DVec3;
use serde::Deserialize;
use std::path::PathBuf;
use std::time::Duration;

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Step {
    /// Number of the line, from 1.
    pub(crate) line: usize,
    pub(crate) command: Command,
}

/// What a line of a script asks for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// Does something that a user can do.
    Do(Action),
    /// Opens a scene or session, and whether that must succeed or fail.
    Load(PathBuf, bool),
    Quit,
    /// Waits for something.
    Wait(Wait),
    /// Keeps a picture of the whole window under this name.
    Shoot(String),
    /// Changes the size of the window, in points.
    Size([f32; 2]),
    Minimise,
    Restore,
    /// Presses a key, with what is held down.
    Press(egui::Modifiers, egui::Key),
    /// Clicks at a place, points from the upper left corner.
    Click([f32; 2]),
    /// Drags from one place to another, points.
    Drag([f32; 4]),
    /// Types a text.
    Type(String),
    /// Notes how much memory is in use, or fails if it has grown by more than this share since the
    /// last note.
    Memory(Option<f64>),
    /// Fails if a control has no tooltip.
    CheckTooltips,
    /// Fails if the message that is shown does not contain this.
    Expect(String),
    /// Loses the device.
    LoseDevice,
}

/// What a script waits for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wait {
    Time(Duration),
    /// Until the window has shown so many more frames, and the picture is what is asked for.
    Frames(u64),
    /// Until so many more pictures are drawn, turning around the target meanwhile.
    Turns(u64),
    /// Until no scene is being opened and the picture shows what is asked for.
    Ready,
    /// Until the truth is traced and errors are counted.
    Truth,
    /// Until no long job runs.
    Jobs,
}

/// A line of a script as it is written: a JSON object with one key.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum Line {
    /// A scene or session to open. The step is done when it is open.
    Load(PathBuf),
    /// The same for one that cannot be opened, as the step expects.
    LoadFails(PathBuf),
    /// The first technique.
    Shadows(String),
    /// The second technique, or `truth`, beside the first; null for none.
    Compare(Option<String>),
    Camera(CameraLine),
    /// The direction in which a sun's light travels.
    Sun([f64; 3]),
    /// An overlay's name, or null for none.
    Overlay(Option<String>),
    /// Width and height of the window, points.
    Size([f32; 2]),
    /// A number of frames of the window.
    Wait(u32),
    /// The name of a picture of the window.
    Screenshot(String),
    /// Whether to close the window, which also happens at the end.
    Quit(bool),
    /// Anything else, in words.
    Do(String),
}

/// Position of the viewer, and the point in the middle of the picture, metres.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraLine {
    eye: [f64; 3],
    target: [f64; 3],
}

/// Parses a script: a JSON object with one key on each line.
///
/// # Errors
/// Names the first line that is wrong.
pub(crate) fn parse(text: &str) -> Result<Vec<Step>, String> {
    let mut steps = Vec::new();
    for (i, text) in text.lines().enumerate().filter(|(_, text)| !text.trim().is_empty()) {
        let line = i + 1;
        let wrong = |problem: String| format!("line {line}: {problem}");
        let read: Line = serde_json::from_str(text).map_err(|e| {
            // The place of the error counts within the line.
            let problem = e.to_string();
            wrong(problem.split(" at line ").next().unwrap_or(&problem).to_owned())
        })?;
        let commands = Command::of(read).map_err(wrong)?;
        steps.extend(commands.into_iter().map(|command| Step { line, command }));
    }
    Ok(steps)
}

impl Command {
    /// The commands of a line.
    fn of(line: Line) -> Result<Vec<Self>, String> {
        let act = |action| Ok(vec![Self::Do(action)]);
        match line {
            Line::Load(path) => Ok(vec![Self::Load(path, true)]),
            Line::LoadFails(path) => Ok(vec![Self::Load(path, false)]),
            Line::Shadows(text) => act(Action::Technique(0, text)),
            Line::Compare(None) => act(Action::Compare(Compare::Alone)),
            Line::Compare(Some(text)) => Ok(vec![
                Self::Do(Action::Technique(1, text)),
                Self::Do(Action::Compare(Compare::Beside)),
            ]),
            Line::Camera(CameraLine { eye, target }) => {
                act(Action::Stand([eye, target].map(DVec3::from)))
            }
            Line::Sun(direction) => {
                let direction = umbrage_lab::values::pointing(direction.into())?;
                let Sun { azimuth_deg, elevation_deg } = Sun::from_direction(direction);
                act(Action::Sun { azimuth_deg, elevation_deg })
            }
            Line::Overlay(None) => act(Action::Overlay(OverlayKind::None)),
            Line::Overlay(Some(name)) => {
                act(Action::Overlay(chosen("overlay", &name, &OverlayKind::ALL)?))
            }
            Line::Size([width, height]) => {
                match [width, height].map(|n| (1.0..=16384.0).contains(&n)) {
                    [true, true] => Ok(vec![Self::Size([width, height])]),
                    _ => Err("size: must be two numbers of 1 to 16384 points".into()),
                }
            }
            Line::Wait(frames) => Ok(vec![Self::Wait(Wait::Frames(frames.into()))]),
            Line::Screenshot(name) => Ok(vec![Self::parse(&format!("shoot {name}"))?]),
            Line::Quit(true) => Ok(vec![Self::Quit]),
            Line::Quit(false) => Ok(Vec::new()),
            Line::Do(words) => Ok(vec![Self::parse(&words)?]),
        }
    }

    fn parse(text: &str) -> Result<Self, String> {
        let (verb, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let numbers = |count: usize| -> Result<Vec<f32>, String> {
            let numbers: Option<Vec<f32>> = rest
                .split([' ', ',', 'x'])
                .filter(|word| !word.is_empty())
                .map(|word| word.parse().ok().filter(|n: &f32| n.is_finite()))
                .collect();
            numbers
                .filter(|numbers| numbers.len() == count)
                .ok_or_else(|| format!("`{verb}` needs {count} numbers, not `{rest}`"))
        };
        Ok(match verb {
            "wait" => Self::Wait(Wait::parse(rest)?),
            "shoot" => {
                let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
                if rest.is_empty() || rest.starts_with('.') || !rest.chars().all(is_plain) {
                    return Err("`shoot` needs a name of letters, digits, -, _ and .".into());
                }
                Self::Shoot(rest.into())
            }
            "minimise" => Self::Minimise,
            "restore" => Self::Restore,
            "press" => {
                let (modifiers, key) = key(rest)?;
                Self::Press(modifiers, key)
            }
            "click" => {
                let numbers = numbers(2)?;
                Self::Click([numbers[0], numbers[1]])
            }
            "drag" => {
                let numbers = numbers(4)?;
                Self::Drag([numbers[0], numbers[1], numbers[2], numbers[3]])
            }
            "type" => Self::Type(rest.into()),
            "note-memory" => Self::Memory(None),
            "check-memory" => {
                let percent = rest.strip_suffix('%').and_then(|n| n.parse::<f64>().ok());
                let percent = percent.filter(|p| (0.0..=1000.0).contains(p));
                let percent = percent.ok_or("`check-memory` needs a share, as in 5%")?;
                Self::Memory(Some(percent / 100.0))
            }
            "check-tooltips" => Self::CheckTooltips,
            "expect" => Self::Expect(rest.into()),
            "lose-device" => Self::LoseDevice,
            _ => Self::Do(Action::parse(text)?),
        })
    }
}

impl Wait {
    fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`wait` takes ready, truth, jobs, 40 frames, 40 turns or 1.5 s, not `{text}`")
        };
        Ok(match text {
            "ready" => Self::Ready,
            "truth" => Self::Truth,
            "jobs" => Self::Jobs,
            _ => {
                let (number, unit) = text.split_once(' ').ok_or_else(wrong)?;
                let number: f64 = number.parse().map_err(|_| wrong())?;
                match unit {
                    "frames" if (1.0..=1e6).contains(&number) => Self::Frames(number as u64),
                    "turns" if (1.0..=1e6).contains(&number) => Self::Turns(number as u64),
                    "s" if (0.0..=3600.0).contains(&number) => {
                        Self::Time(Duration::from_secs_f64(number))
                    }
                    _ => return Err(wrong()),
                }
            }
        })
    }
}

/// A key with what is held down, as in `ctrl+shift+S`.
fn key(text: &str) -> Result<(egui::Modifiers, egui::Key), String> {
    let mut modifiers = egui::Modifiers::NONE;
    let mut parts = text.split('+').collect::<Vec<_>>();
    let name = parts.pop().unwrap_or_default();
    for part in parts {
        modifiers |= match part {
            "ctrl" => egui::Modifiers::COMMAND | egui::Modifiers::CTRL,
            "shift" => egui::Modifiers::SHIFT,
            "alt" => egui::Modifiers::ALT,
            _ => return Err(format!("`press` knows ctrl, shift and alt, not `{part}`")),
        };
    }
    let key = egui::Key::from_name(name).ok_or_else(|| format!("there is no key `{name}`"))?;
    Ok((modifiers, key))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_has_an_object_a_line() {
        let script = r#"{"load": "town"}

{"shadows": "lispsm+z2:pcf3"}
{"compare": "uniform"}
{"camera": {"eye": [1, 2, 3], "target": [0, 0, -1.5]}}
{"sun": [0, -2, 0]}
{"overlay": "error"}
{"overlay": null}
{"size": [390, 844]}
{"wait": 20}
{"screenshot": "first"}
{"do": "wait truth"}
{"do": "press ctrl+S"}
{"do": "check-memory 5%"}
{"quit": true}"#;
        let command = |modifiers| Command::Press(modifiers, egui::Key::S);
        let expected = [
            (1, Command::Load("town".into(), true)),
            (3, Command::Do(Action::Technique(0, "lispsm+z2:pcf3".into()))),
            (4, Command::Do(Action::Technique(1, "uniform".into()))),
            (4, Command::Do(Action::Compare(Compare::Beside))),
            (
                5,
                Command::Do(Action::Stand([DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.0, -1.5)])),
            ),
            (6, Command::Do(Action::Sun { azimuth_deg: 0.0, elevation_deg: 90.0 })),
            (7, Command::Do(Action::Overlay(OverlayKind::Error))),
            (8, Command::Do(Action::Overlay(OverlayKind::None))),
            (9, Command::Size([390.0, 844.0])),
            (10, Command::Wait(Wait::Frames(20))),
            (11, Command::Shoot("first".into())),
            (12, Command::Wait(Wait::Truth)),
            (13, command(egui::Modifiers::COMMAND | egui::Modifiers::CTRL)),
            (14, Command::Memory(Some(0.05))),
            (15, Command::Quit),
        ];
        let expected = expected.map(|(line, command)| Step { line, command });
        assert_eq!(parse(script).unwrap(), expected);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, expected) in [
            ("{\"quit\": true}\n{\"jump\": 1}", "line 2: unknown variant `jump`"),
            ("open town", "line 1: expected value"),
            (r#"{"load": 5}"#, "line 1: invalid type"),
            (r#"{"wait": -1}"#, "line 1: invalid value"),
            (r#"{"screenshot": "../x"}"#, "line 1: `shoot` needs a name"),
            (r#"{"size": [0, 5]}"#, "size: must be two numbers"),
            (r#"{"sun": [0, 0, 0]}"#, "line 1: "),
            (r#"{"overlay": "rainbow"}"#, "none, error, texels, partition, difference, clusters"),
            (r#"{"camera": {"eye": [1, 2, 3]}}"#, "missing field `target`"),
            (r#"{"do": "jump"}"#, "there is no action `jump`"),
            (r#"{"do": "wait 3 days"}"#, "`wait` takes"),
            (r#"{"do": "press hyper+A"}"#, "knows ctrl, shift and alt"),
            (r#"{"do": "press NoKey"}"#, "there is no key `NoKey`"),
            (r#"{"do": "click 1"}"#, "needs 2 numbers"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
