//! `--session`: scene, view, light and techniques from a file.

use super::view::{LightArgs, SceneChangeArgs, ViewArgs};
use anyhow::Result;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args};
use std::path::PathBuf;
use umbrage_lab::Session;

/// Which scene, or a session that has one.
#[derive(Debug, Args)]
pub(crate) struct SessionSceneArgs {
    /// A .gltf or .glb file, or a built-in scene (`umbrage scenes` lists them), with a size if you
    /// like: town:200.
    #[arg(value_name = "SCENE", required_unless_present = "session")]
    name: Option<String>,
    #[command(flatten)]
    pub(crate) session: SessionArgs,
    #[command(flatten)]
    pub(crate) changes: SceneChangeArgs,
}

/// A session to take up.
#[derive(Debug, Args)]
pub(crate) struct SessionArgs {
    /// Take scene, view, light and techniques from a session, a file that `umbrage view` saves,
    /// in place of SCENE. Other options replace what it says.
    #[arg(long, value_name = "FILE", conflicts_with = "name")]
    session: Option<PathBuf>,
    #[arg(skip)]
    pub(super) told: Told,
}

/// Which options with default values are given on the command line.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    pub(super) size: bool,
    pub(super) shadows: bool,
    pub(super) fit: bool,
}

impl Told {
    /// What the command line of a command has, all of whose options there are.
    pub(super) fn of(matches: &ArgMatches) -> Self {
        let is_told = |name| matches.value_source(name) == Some(ValueSource::CommandLine);
        Self { size: is_told("size"), shadows: is_told("shadows"), fit: is_told("fit") }
    }
}

impl SessionArgs {
    /// Whether there is a session.
    pub(super) fn is_some(&self) -> bool {
        self.session.is_some()
    }

    /// Reads the session, if there is one.
    pub(super) fn read(&self) -> Result<Option<Session>> {
        Ok(self.session.as_deref().map(Session::read).transpose()?)
    }
}

impl SessionSceneArgs {
    /// The scene's name, which is known once the session is read.
    pub(crate) fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_default()
    }

    /// Takes what is not asked for of the scene, the view and the light from the session, and
    /// returns the session for the rest; `None` if there is none.
    pub(super) fn take_session(
        &mut self,
        view: &mut ViewArgs,
        light: &mut LightArgs,
    ) -> Result<Option<Session>> {
        let Some(session) = self.session.read()? else { return Ok(None) };
        self.name = Some(session.scene.clone());
        self.changes.take(&session);
        light.take(session.light_options());
        view.take(session.view.clone(), self.session.told.size);
        Ok(Some(session))
    }
}

#[cfg(test)]
mod tests {
    use crate::args::{Command, parse};
    use glam::DVec3;
    use umbrage::visibility::LightSize;
    use umbrage_lab::{Fit, LightOptions, SceneOptions, Session, ViewOptions};

    fn session() -> Session {
        Session {
            scene: "-it's a $(scene).glb".to_owned(),
            changes: SceneOptions {
                without: vec!["*".to_owned(), "a\\b".to_owned()],
                ground: true,
                animation: Some("#2".to_owned()),
                time_s: 0.75,
            },
            opaque: true,
            view: ViewOptions {
                eye: Some(DVec3::new(-0.1, 1.0 / 3.0, 1e-9)),
                target: Some(DVec3::new(-1e6, 0.0, 2.0)),
                up: Some(DVec3::NEG_Z),
                fov_deg: Some(47.3),
                ortho: None,
                near: Some(0.01),
                far: Some(1e4),
                size: [320, 200],
                camera: None,
            },
            light: LightOptions { sun: Some(DVec3::new(-0.3, -1.0, 0.1)), light: None },
            headlight: false,
            light_size: Some(LightSize::Degrees(0.53)),
            techniques: ["uniform(stable)+z4:pcf3", "adaptive:pcss(light=2deg)@2048"]
                .map(|t| t.parse().unwrap())
                .to_vec(),
            fit: Fit::Seen,
            overlay: None,
            compare: None,
        }
    }

    /// What this program makes of a line that was given to a shell.
    fn understood(line: &str) -> Command {
        let script = format!("set -- {line}; printf '%s\\n' \"$@\"");
        let words = std::process::Command::new("sh").args(["-c", &script]).output().unwrap().stdout;
        let words = String::from_utf8(words).unwrap();
        parse(words.lines().map(Into::into)).unwrap_or_else(|e| panic!("{line}: {e}")).0
    }

    /// The commands that a session prints give its view, light and techniques again.
    #[cfg(unix)]
    #[test]
    fn commands_are_understood() {
        let told = session();
        let named = ViewOptions { camera: Some("the gate's".to_owned()), ..ViewOptions::default() };
        let lamp = LightOptions { sun: None, light: Some("#2".to_owned()) };
        let from_above = ViewOptions { fov_deg: None, ortho: Some(12.5), ..told.view.clone() };
        let sessions = [
            told.clone(),
            Session { view: from_above, fit: Fit::Surfaces, ..told.clone() },
            Session { headlight: true, light: LightOptions::default(), ..told.clone() },
            Session { view: named, light: lamp, light_size: None, scene: "town".into(), ..told },
        ];
        for session in sessions {
            let Command::Render(render) = understood(&session.render_command()) else {
                panic!("renders")
            };
            assert_eq!(render.view.options(), session.view);
            assert_eq!(render.light.options(), session.light_options());
            assert_eq!(render.shadows, session.techniques[0]);
            assert_eq!(render.scene.changes.options(), session.changes);
            assert_eq!((render.fit.into(), render.scene.changes.opaque), (session.fit, true));
            assert_eq!(render.scene.name().trim_start_matches("./"), session.scene);
            let Command::Compare(compare) = understood(&session.compare_command()) else {
                panic!("compares")
            };
            assert_eq!(compare.view.options(), session.view);
            assert_eq!(compare.light.options(), session.light_options());
            let comparison = compare.comparison.options();
            assert_eq!(comparison.techniques, session.techniques);
            assert_eq!(comparison.light_size, session.light_size);
        }
    }
}
