//! Windows and session files.

use crate::action::chosen;
use crate::settings::{Compare, LightSetting, OverlayKind, Settings, TRUTH};
use crate::stage::SceneInfo;
use crate::sun::Sun;
use std::path::Path;
use umbrage_lab::{LightOptions, SceneOptions, Session, ViewOptions};
use umbrage_scene::Lens;

/// How a session's `compare` ends where the second picture is the truth.
const WITH_TRUTH: &str = " with truth";

/// What a window opens: its settings, and the view and the light to choose once the scene is there.
#[derive(Clone, Debug)]
pub(crate) struct ToOpen {
    pub(crate) settings: Settings,
    pub(crate) view: ViewOptions,
    pub(crate) light: LightOptions,
    /// The word of an animation, and the time in it, seconds.
    pub(crate) clip: Option<(String, f64)>,
    /// What of the settings is kept.
    pub(crate) kind: Kind,
}

/// What is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A scene, in its own view and light. Whatever else is set when it is there stays.
    Scene,
    /// A session, which sets everything.
    Session,
    /// The window as it was before its device was lost.
    Again,
}

impl ToOpen {
    /// A scene in its own view and light, with whatever else is set.
    pub(crate) fn scene(name: &str, settings: &Settings) -> Self {
        let settings = Settings {
            scene: name.to_owned(),
            changes: Default::default(),
            opaque: false,
            near: None,
            far: None,
            camera: None,
            ..settings.clone()
        };
        let (view, light) = (ViewOptions::default(), LightOptions::default());
        Self { settings, view, light, clip: None, kind: Kind::Scene }
    }

    /// A session that was read.
    ///
    /// # Errors
    /// Names the word that this program does not know.
    pub(crate) fn session(session: &Session, settings: &Settings) -> Result<Self, String> {
        let compare = session.compare.as_deref().unwrap_or(Compare::ALL[0].1);
        let (compare, with_truth) = match compare.strip_suffix(WITH_TRUTH) {
            Some(compare) => (compare, true),
            None => (compare, false),
        };
        let overlay = session.overlay.as_deref().unwrap_or(OverlayKind::ALL[0].1);
        let mut techniques = Settings::new("").techniques;
        for (place, technique) in techniques.iter_mut().zip(&session.techniques) {
            *place = technique.to_string();
        }
        if with_truth {
            techniques[1] = TRUTH.to_owned();
        }
        let mut to_open = Self::scene(&session.scene, settings);
        to_open.kind = Kind::Session;
        to_open.settings = Settings {
            // The window poses the scene itself.
            changes: SceneOptions { animation: None, time_s: 0.0, ..session.changes.clone() },
            opaque: session.opaque,
            techniques,
            compare: chosen("compare", compare, &Compare::ALL)?,
            overlay: chosen("overlay", overlay, &OverlayKind::ALL)?,
            fit: session.fit,
            light_size: session.light_size,
            ..to_open.settings
        };
        if session.headlight {
            to_open.settings.light = LightSetting::Headlight;
        }
        to_open.clip = session.changes.animation.clone().map(|word| (word, session.changes.time_s));
        to_open.view = session.view.clone();
        to_open.light = session.light_options();
        Ok(to_open)
    }
}

impl Settings {
    /// The settings as a session, with pictures of this size.
    ///
    /// # Errors
    /// Tells which value is not possible.
    pub(crate) fn session(&self, info: &SceneInfo, size: [u32; 2]) -> Result<Session, String> {
        let camera = self.camera(info, size).map_err(|e| e.to_string())?;
        let (fov_deg, ortho) = match self.lens {
            Lens::Perspective { fov_y_rad } => (Some(fov_y_rad.to_degrees()), None),
            Lens::Orthographic { height } => (None, Some(height)),
        };
        // A headlight needs to know the view, and an animation may move the camera.
        let is_still = self.light != LightSetting::Headlight && self.clip.is_none();
        let view = match &self.camera {
            Some(name) if is_still => {
                ViewOptions { camera: Some(name.clone()), size, ..ViewOptions::default() }
            }
            _ => ViewOptions {
                eye: Some(self.pose.eye),
                target: Some(self.pose.target),
                up: (self.pose.up != glam::DVec3::Y).then_some(self.pose.up),
                fov_deg,
                ortho,
                near: Some(camera.near()).filter(|_| ortho.is_none()),
                far: Some(camera.far()),
                size,
                camera: None,
            },
        };
        let light = match &self.light {
            LightSetting::Sun(_) | LightSetting::Hour(_) => {
                LightOptions { sun: self.sun().map(Sun::direction), light: None }
            }
            LightSetting::Headlight => LightOptions::default(),
            LightSetting::Named(name) => LightOptions { sun: None, light: Some(name.clone()) },
        };
        let with_truth = self.compares_with_truth();
        let count = if self.compare.is_of_two() && !with_truth { 2 } else { 1 };
        let techniques = self.techniques[..count].iter().map(|text| text.parse());
        let clip = self.clip.and_then(|clip| info.clips.get(clip));
        let animation = clip.map(|(word, _)| word.clone());
        let time_s = if clip.is_some() { self.time_s } else { 0.0 };
        let compare =
            Compare::ALL.iter().find(|(c, ..)| *c == self.compare).map(|(_, name, _)| *name);
        let overlay = OverlayKind::ALL.iter().find(|(o, ..)| *o == self.overlay);
        Ok(Session {
            scene: self.scene.clone(),
            changes: SceneOptions { animation, time_s, ..self.changes.clone() },
            opaque: self.opaque,
            view,
            light,
            headlight: self.light == LightSetting::Headlight,
            light_size: self.light_size,
            techniques: techniques.collect::<Result<_, _>>().map_err(|e| format!("{e}"))?,
            fit: self.fit,
            overlay: overlay.map(|(_, name, _)| (*name).to_owned()),
            compare: compare
                .map(|name| format!("{name}{}", if with_truth { WITH_TRUTH } else { "" })),
        })
    }
}

/// What a path or name stands for.
///
/// # Errors
/// The session cannot be read, or is wrong.
pub(crate) fn to_open(path: &Path, settings: &Settings) -> Result<ToOpen, String> {
    let is_session = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    match is_session {
        true => {
            let session = Session::read(path).map_err(|e| e.to_string())?;
            ToOpen::session(&session, settings)
                .map_err(|problem| format!("{}: {problem}", path.display()))
        }
        false => Ok(ToOpen::scene(&path.to_string_lossy(), settings)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::info;
    use umbrage::visibility::LightSize;
    use umbrage_lab::{Defaults, choose_view};

    /// What a window has after it opened a session that another one saved.
    fn again(settings: &Settings) -> (Settings, LightOptions) {
        let session = settings.session(&info(), [640, 360]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.json");
        session.write(&path).unwrap();
        let opened = to_open(&path, &Settings::new("other")).unwrap();
        assert_eq!(opened.kind, Kind::Session);
        // As the thread of a scene and the window do.
        let view = match &opened.view.camera {
            Some(_) => info().view,
            None => choose_view(&opened.view, &Defaults::of(None)).unwrap().view,
        };
        let (mut settings, name) = (opened.settings, opened.view.camera.clone());
        settings.look_from(name, &view, &info());
        settings.near = opened.view.near.or(settings.near);
        settings.far = opened.view.far.or(settings.far);
        (settings, opened.light)
    }

    fn begun() -> Settings {
        let mut settings = Settings::new("box");
        settings.begin_with(&info());
        settings
    }

    #[test]
    fn sessions_keep_what_is_seen() {
        let mut settings = begun();
        settings.compare = Compare::Wipe;
        settings.overlay = OverlayKind::Partition;
        settings.techniques = ["lispsm+z2:pcf3@512".into(), "uniform:vsm".into()];
        settings.light_size = Some(LightSize::Degrees(0.5));
        settings.changes.ground = true;
        settings.opaque = true;
        let (opened, light) = again(&settings);
        assert_eq!(opened.camera.as_deref(), Some("gate"));
        assert_eq!(light.light.as_deref(), Some("sun"));
        assert_eq!(opened.techniques, settings.techniques);
        assert_eq!([opened.near, opened.far], [settings.near, settings.far]);
        let of = |s: &Settings| {
            (s.scene.clone(), s.compare, s.overlay, s.light_size, s.changes.ground, s.opaque, s.fit)
        };
        assert_eq!(of(&opened), of(&settings));
    }

    #[test]
    fn sessions_keep_views_and_lights_of_all_kinds() {
        let mut settings = begun();
        settings.pose.orbit(0.4, 0.1);
        settings.moved();
        for lens in [Lens::Perspective { fov_y_rad: 0.7 }, Lens::Orthographic { height: 12.0 }] {
            settings.lens = lens;
            let hour = LightSetting::Hour(15.0);
            let sun = settings.clone().light;
            for light in [sun, hour, LightSetting::Headlight, LightSetting::Named("lamp".into())] {
                settings.light = light;
                let (opened, options) = again(&settings);
                assert!(opened.pose.eye.distance(settings.pose.eye) < 1e-12);
                assert!(opened.pose.target.distance(settings.pose.target) < 1e-12);
                let [before, after] =
                    [&settings, &opened].map(|s| s.camera(&info(), [640, 360]).unwrap());
                assert!((before.far() - after.far()).abs() < 1e-9);
                assert!((before.pixel_width(5.0) - after.pixel_width(5.0)).abs() < 1e-12);
                match &settings.light {
                    LightSetting::Named(name) => assert_eq!(options.light.as_ref(), Some(name)),
                    LightSetting::Headlight => assert_eq!(opened.light, LightSetting::Headlight),
                    _ => {
                        let sun = settings.sun().unwrap().direction();
                        assert!(options.sun.unwrap().distance(sun) < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn comparisons_with_the_truth_come_back() {
        let mut settings = begun();
        settings.compare = Compare::Beside;
        settings.techniques[1] = TRUTH.into();
        let (opened, _) = again(&settings);
        assert!(opened.compares_with_truth() && opened.compare == Compare::Beside);
        settings.compare = Compare::Alone;
        assert!(!again(&settings).0.compares_with_truth());
    }

    #[test]
    fn animated_views_are_written_in_numbers() {
        let mut settings = begun();
        (settings.clip, settings.time_s) = (Some(0), 1.5);
        let session = settings.session(&info(), [64, 64]).unwrap();
        assert_eq!(session.changes.animation.as_deref(), Some("walk"));
        assert_eq!(session.changes.time_s, 1.5);
        assert!(session.view.camera.is_none() && session.view.eye.is_some());
    }

    #[test]
    fn unknown_words_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.json");
        let text = r#"{"version": 1, "scene": "pole", "shadows": ["uniform"], "overlay": "heat"}"#;
        std::fs::write(&path, text).unwrap();
        let problem = to_open(&path, &Settings::new("pole")).unwrap_err();
        assert!(problem.contains("session.json") && problem.contains("heat"), "{problem}");
    }
}
