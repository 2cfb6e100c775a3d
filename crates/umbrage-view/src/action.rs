//! What a user can do, in words that scripts also have.

use crate::settings::{Compare, OverlayKind};
use glam::DVec3;
use std::path::PathBuf;
use umbrage::visibility::LightSize;
use umbrage_lab::Fit;

/// Something to do with the window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    /// Opens a scene or a session.
    Open(PathBuf),
    /// Sets the text of the first (0) or second (1) technique.
    Technique(usize, String),
    Compare(Compare),
    /// Where the line of a wipe is, as a share of the picture's width.
    Wipe(f32),
    Overlay(OverlayKind),
    Fit(Fit),
    Sun {
        azimuth_deg: f64,
        elevation_deg: f64,
    },
    Hour(f64),
    Headlight,
    /// A light of the scene, by the word that chooses it.
    Light(String),
    LightSize(Option<LightSize>),
    /// A camera of the scene, by the word that chooses it.
    Camera(String),
    /// The eye, and the point that it looks at, metres.
    Stand([DVec3; 2]),
    /// Vertical field of view, degrees.
    Fov(f64),
    /// Orthographic view of this height, metres.
    Ortho(f64),
    /// The view and light that the scene began with.
    Reset,
    /// Turns the eye around the target: to the right and upwards, degrees.
    Orbit([f64; 2]),
    /// Turns the head: to the right and upwards, degrees.
    Look([f64; 2]),
    /// Moves the viewer to the right, upwards and forward, metres.
    Walk(DVec3),
    /// Goes nearer to the target, to this share of its distance.
    Approach(f64),
    /// Whether dragging turns the head.
    Fly(bool),
    /// Keeps the plan of this view, or plans each view again.
    Freeze(bool),
    CountErrors(bool),
    Panel(Panel, bool),
    /// A clip of the scene's animations by its place (from 1); 0 for none.
    Clip(usize),
    Play(bool),
    /// The time in the clip, seconds.
    Seek(f64),
    /// Measures the presets in the present view.
    TryThese,
    /// Takes a preset by its name.
    Preset(String),
    Theme(Theme),
    /// Factor by which all controls are larger than usual.
    Scale(f32),
    /// Share of the window's pixels to each side that are drawn.
    Resolution(f32),
    Save(PathBuf),
    /// The number of pictures, and the folder that they are saved in.
    Turntable(u32, PathBuf),
    SaveSession(PathBuf),
    Copy(Copied),
}

/// A part of the window that can be shown or hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Panel {
    Controls,
    Theory,
    LightSpace,
    Map,
    TryThese,
    Times,
    Help,
}

impl Panel {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 7] = [
        (Self::Controls, "controls", "Show the controls at the left."),
        (Self::Times, "times", "Plot what each frame costs, stage by stage."),
        (Self::TryThese, "try these", "Measure six ready techniques in the present view."),
        (Self::Theory, "theory", "Plot the error along the view, with the point at the mouse."),
        (Self::Map, "shadow map", "Show a map itself, with the view that is projected into it."),
        (Self::LightSpace, "light space", "Show view, receivers and warp as the light sees them."),
        (Self::Help, "keys", "List the keys and what the mouse does."),
    ];
}

/// Which colours the window has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Theme {
    Dark,
    Light,
    System,
}

/// What can be copied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Copied {
    /// The technique's text.
    Specification,
    /// The command that renders the view.
    Command,
    /// The technique as Rust code.
    Code,
}

impl Action {
    /// Parses an action's words.
    ///
    /// # Errors
    /// Tells what is wrong with them.
    pub(crate) fn parse(words: &str) -> Result<Self, String> {
        let (verb, rest) =
            words.trim().split_once(char::is_whitespace).unwrap_or((words.trim(), ""));
        let rest = rest.trim();
        let text = || match rest {
            "" => Err(format!("`{verb}` needs a value")),
            _ => Ok(rest.to_owned()),
        };
        Ok(match verb {
            "open" => Self::Open(text()?.into()),
            "technique" => Self::Technique(0, text()?),
            "second" => Self::Technique(1, text()?),
            "compare" => Self::Compare(chosen(verb, rest, &Compare::ALL)?),
            "wipe" => Self::Wipe(numbers::<1>(verb, rest)?[0] as f32),
            "overlay" => Self::Overlay(chosen(verb, rest, &OverlayKind::ALL)?),
            "fit" => {
                let fits = Fit::ALL.map(|fit| (fit, fit.name(), ""));
                Self::Fit(chosen(verb, rest, &fits)?)
            }
            "sun" => {
                let [azimuth_deg, elevation_deg] = numbers(verb, rest)?;
                Self::Sun { azimuth_deg, elevation_deg }
            }
            "hour" => Self::Hour(numbers::<1>(verb, rest)?[0]),
            "headlight" => Self::Headlight,
            "light" => Self::Light(text()?),
            "light-size" if rest == "none" => Self::LightSize(None),
            "light-size" => {
                let size = rest.parse().map_err(|e| format!("`light-size`: {e}"))?;
                Self::LightSize(Some(size))
            }
            "camera" => Self::Camera(text()?),
            "stand" => {
                let [x, y, z, to_x, to_y, to_z] = numbers(verb, rest)?;
                Self::Stand([DVec3::new(x, y, z), DVec3::new(to_x, to_y, to_z)])
            }
            "fov" => Self::Fov(numbers::<1>(verb, rest)?[0]),
            "ortho" => Self::Ortho(numbers::<1>(verb, rest)?[0]),
            "reset" => Self::Reset,
            "orbit" => Self::Orbit(numbers(verb, rest)?),
            "look" => Self::Look(numbers(verb, rest)?),
            "walk" => Self::Walk(numbers(verb, rest)?.into()),
            "approach" => Self::Approach(numbers::<1>(verb, rest)?[0]),
            "fly" => Self::Fly(switch(verb, rest)?),
            "freeze" => Self::Freeze(switch(verb, rest)?),
            "count-errors" => Self::CountErrors(switch(verb, rest)?),
            "panel" => {
                let is_state = |(_, state): &(&str, &str)| matches!(*state, "on" | "off");
                let told = rest.rsplit_once(char::is_whitespace).filter(is_state);
                let (name, state) = told.unwrap_or((rest, "on"));
                Self::Panel(chosen(verb, name.trim(), &Panel::ALL)?, switch(verb, state)?)
            }
            "clip" => Self::Clip(numbers::<1>(verb, rest)?[0] as usize),
            "play" => Self::Play(switch(verb, rest)?),
            "seek" => Self::Seek(numbers::<1>(verb, rest)?[0]),
            "try-these" => Self::TryThese,
            "preset" => Self::Preset(text()?),
            "theme" => {
                let themes = [
                    (Theme::Dark, "dark", ""),
                    (Theme::Light, "light", ""),
                    (Theme::System, "system", ""),
                ];
                Self::Theme(chosen(verb, rest, &themes)?)
            }
            "scale" => Self::Scale(numbers::<1>(verb, rest)?[0] as f32),
            "resolution" => Self::Resolution(numbers::<1>(verb, rest)?[0] as f32),
            "save" => Self::Save(text()?.into()),
            "turntable" => {
                let (count, folder) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                let count = count.parse().ok().filter(|n| (1..=3600).contains(n));
                let count = count.ok_or("`turntable` needs a number of pictures, 1 to 3600")?;
                if folder.trim().is_empty() {
                    return Err("`turntable` needs a folder, as in turntable 36 turn".into());
                }
                Self::Turntable(count, folder.trim().into())
            }
            "save-session" => Self::SaveSession(text()?.into()),
            "copy" => {
                let all = [
                    (Copied::Specification, "specification", ""),
                    (Copied::Command, "command", ""),
                    (Copied::Code, "code", ""),
                ];
                Self::Copy(chosen(verb, rest, &all)?)
            }
            _ => return Err(format!("there is no action `{verb}`")),
        })
    }
}

/// The value that a word chooses.
pub(crate) fn chosen<T: Copy>(
    verb: &str,
    word: &str,
    all: &[(T, &str, &str)],
) -> Result<T, String> {
    let found = all.iter().find(|(_, name, _)| *name == word);
    found.map(|(value, ..)| *value).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|(_, name, _)| *name).collect();
        format!("`{verb}` takes one of {}, not `{word}`", names.join(", "))
    })
}

/// `on` or `off`.
fn switch(verb: &str, word: &str) -> Result<bool, String> {
    chosen(verb, word, &[(true, "on", ""), (false, "off", "")])
}

/// As many finite numbers as asked for, with spaces or commas between them.
fn numbers<const N: usize>(verb: &str, text: &str) -> Result<[f64; N], String> {
    let words = text.split([' ', ',']).filter(|word| !word.is_empty());
    let numbers: Option<Vec<f64>> =
        words.map(|word| word.parse().ok().filter(|n: &f64| n.is_finite())).collect();
    let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
    let s = if N == 1 { "" } else { "s" };
    numbers.ok_or_else(|| format!("`{verb}` needs {N} number{s}, not `{text}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actions_are_parsed() {
        let parse = |words| Action::parse(words).unwrap();
        assert_eq!(
            parse("technique lispsm+z2 :pcf3"),
            Action::Technique(0, "lispsm+z2 :pcf3".into())
        );
        assert_eq!(parse("compare side by side"), Action::Compare(Compare::Beside));
        assert_eq!(parse("panel shadow map off"), Action::Panel(Panel::Map, false));
        assert_eq!(parse("panel theory on"), Action::Panel(Panel::Theory, true));
        assert_eq!(parse("panel light space"), Action::Panel(Panel::LightSpace, true));
        let eye = DVec3::new(1.0, 2.0, -300.0);
        assert_eq!(parse(" stand 1, 2,-3e2 0 0 0 "), Action::Stand([eye, DVec3::ZERO]));
        assert_eq!(parse("turntable 36 my turn"), Action::Turntable(36, "my turn".into()));
        assert_eq!(parse("light-size 0.5deg"), Action::LightSize(Some(LightSize::Degrees(0.5))));
        assert_eq!(parse("reset"), Action::Reset);
    }

    #[test]
    fn errors_say_what_is_missing() {
        let error = |words| Action::parse(words).unwrap_err();
        assert_eq!(error("jump"), "there is no action `jump`");
        assert_eq!(error("open"), "`open` needs a value");
        assert_eq!(error("sun 1"), "`sun` needs 2 numbers, not `1`");
        assert_eq!(error("hour nan"), "`hour` needs 1 number, not `nan`");
        assert!(error("overlay rainbow").contains("error, texels, partition"));
        assert!(error("freeze maybe").contains("on, off"));
        assert!(error("turntable 0 x").contains("1 to 3600"));
    }
}
