//! Scripts that drive a window, for tests and documentation.

use crate::action::Action;
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
    /// Until the window has drawn so many more frames, turning around the target meanwhile.
    Frames(u64),
    /// Until no scene is being opened and the picture shows what is asked for.
    Ready,
    /// Until the truth is traced and errors are counted.
    Truth,
    /// Until no long job runs.
    Jobs,
}

/// Parses a script: an action or command a line; what follows a `#` is a comment.
///
/// # Errors
/// Names the first line that is wrong.
pub(crate) fn parse(text: &str) -> Result<Vec<Step>, String> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    lines
        .filter(|(_, text)| !text.is_empty() && !text.starts_with('#'))
        .map(|(line, text)| {
            let text = text.split(" #").next().unwrap_or_default().trim();
            let command = Command::parse(text).map_err(|e| format!("line {line}: {e}"))?;
            Ok(Step { line, command })
        })
        .collect()
}

impl Command {
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
                let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
                if rest.is_empty() || !rest.chars().all(is_plain) {
                    return Err("`shoot` needs a name of letters, digits, - and _".into());
                }
                Self::Shoot(rest.into())
            }
            "size" => {
                let numbers = numbers(2)?;
                if numbers.iter().any(|n| !(1.0..=16384.0).contains(n)) {
                    return Err("`size` needs sides of 1 to 16384 points".into());
                }
                Self::Size([numbers[0], numbers[1]])
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
        let wrong = || format!("`wait` takes ready, truth, jobs, 40 frames or 1.5 s, not `{text}`");
        Ok(match text {
            "ready" => Self::Ready,
            "truth" => Self::Truth,
            "jobs" => Self::Jobs,
            _ => {
                let (number, unit) = text.split_once(' ').ok_or_else(wrong)?;
                let number: f64 = number.parse().map_err(|_| wrong())?;
                match unit {
                    "frames" if (1.0..=1e6).contains(&number) => Self::Frames(number as u64),
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
    fn a_script_is_parsed_line_by_line() {
        let script = "# a comment\nopen town\n\nwait ready # until it is there\nshoot first\n\
                      size 390x844\nwait 2000 frames\npress ctrl+S\ncheck-memory 5%\ndrag 1 2 3 4";
        let steps = parse(script).unwrap();
        let expected = [
            (2, Command::Do(Action::Open("town".into()))),
            (4, Command::Wait(Wait::Ready)),
            (5, Command::Shoot("first".into())),
            (6, Command::Size([390.0, 844.0])),
            (7, Command::Wait(Wait::Frames(2000))),
            (8, Command::Press(egui::Modifiers::COMMAND | egui::Modifiers::CTRL, egui::Key::S)),
            (9, Command::Memory(Some(0.05))),
            (10, Command::Drag([1.0, 2.0, 3.0, 4.0])),
        ];
        let expected = expected.map(|(line, command)| Step { line, command });
        assert_eq!(steps, expected);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, expected) in [
            ("reset\njump", "line 2: there is no action `jump`"),
            ("wait", "line 1: `wait` takes"),
            ("wait 3 days", "line 1: `wait` takes"),
            ("shoot ../x", "line 1: `shoot` needs a name"),
            ("press hyper+A", "knows ctrl, shift and alt"),
            ("press NoKey", "there is no key `NoKey`"),
            ("size 0x5", "1 to 16384"),
            ("click 1", "needs 2 numbers"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
