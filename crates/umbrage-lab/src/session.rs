//! Sessions: all that a user has chosen to look at, as a file that any command can take up.

use crate::error::{About, Error, Field, with_causes};
use crate::light::LightOptions;
use crate::receivers::Fit;
use crate::scene::{SceneOptions, scene_file};
use crate::technique::NamedTechnique;
use crate::values;
use crate::view::ViewOptions;
use glam::DVec3;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::path::{Component, Path, PathBuf};
use std::str::FromStr;
use umbrage::visibility::LightSize;
use umbrage_measure::{comma_separated, quoted, quoted_option};

/// The version of the file's format.
const VERSION: u64 = 1;

/// A scene, a view, a light, and the techniques that are looked at.
///
/// The file is a JSON object. Its keys are the [names](Field::name) of the fields, as in a sweep's
/// list of views, and a `version`. `scene` is a path relative to the file's folder, or a built-in
/// scene. `shadows` is a list of techniques. What is left out has its default.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The scene: a path, relative to the process's folder, or a built-in scene.
    pub scene: String,
    /// How the scene is changed.
    pub changes: SceneOptions,
    /// Whether alpha-masked materials are treated as solid.
    pub opaque: bool,
    /// The view, with the size of the picture.
    pub view: ViewOptions,
    /// The light; without one, the scene's own.
    pub light: LightOptions,
    /// Whether a sun shines from the viewer's eye to the target, in place of another light. The
    /// view then has both.
    pub headlight: bool,
    /// The size of the light.
    pub light_size: Option<LightSize>,
    /// The techniques, at least one. The first is shown, and the others are compared with it.
    pub techniques: Vec<NamedTechnique>,
    /// What the maps are fitted to.
    pub fit: Fit,
    /// What lies over the picture, in the window's words.
    pub overlay: Option<String>,
    /// How techniques are compared, in the window's words.
    pub compare: Option<String>,
}

impl Session {
    /// Reads a session.
    ///
    /// # Errors
    /// An error about [`Field::Session`] that names the file and the key, if the file cannot be
    /// read, has an unknown key or another version, or has a value that is invalid or cannot be
    /// combined with another one.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file = path.display();
        let text =
            std::fs::read_to_string(path).about_trying(Field::Session, || file.to_string())?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::parse(&text, folder)
            .map_err(|problem| Error::field(Field::Session, format!("{file}: {problem}")))
    }

    /// Writes the session to a file, which is never seen incomplete.
    ///
    /// # Errors
    /// An error if a value is invalid, or if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        self.check()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Ok(umbrage_measure::write_file(path, self.to_json(folder).as_bytes())?)
    }

    /// Checks each value and their combination.
    ///
    /// # Errors
    /// An error about the first value that is invalid or cannot be combined with another one.
    pub fn check(&self) -> Result<(), Error> {
        self.view.check()?;
        self.light.check()?;
        values::seconds(self.changes.time_s).map_err(|p| Error::field(Field::Time, p))?;
        if self.techniques.is_empty() {
            return Err(Error::field(Field::Shadows, "must have at least one technique"));
        }
        if !self.headlight {
            return Ok(());
        }
        let other =
            [(Field::Sun, self.light.sun.is_some()), (Field::Light, self.light.light.is_some())];
        if let Some(&(by, _)) = other.iter().find(|(_, is_given)| *is_given) {
            return Err(Error::Excluded { field: Field::Headlight, by });
        }
        if self.view.eye.is_none() || self.view.target.is_none() {
            return Err(Error::field(
                Field::Headlight,
                "needs eye and target, between which it shines",
            ));
        }
        Ok(())
    }

    /// Returns the light that is asked for. The headlight is a sun of the view's direction.
    pub fn light_options(&self) -> LightOptions {
        match (self.headlight, self.view.eye, self.view.target) {
            (true, Some(eye), Some(target)) => {
                LightOptions { sun: Some(target - eye), light: None }
            }
            _ => self.light.clone(),
        }
    }

    /// Returns the command that renders the picture of the first technique, for a shell.
    pub fn render_command(&self) -> String {
        self.command("render", &self.techniques[..self.techniques.len().min(1)], None)
    }

    /// Returns the command that compares the techniques with the truth, for a shell.
    pub fn compare_command(&self) -> String {
        // What is shown twice is compared once.
        let mut techniques: Vec<NamedTechnique> = Vec::new();
        for technique in &self.techniques {
            if !techniques.contains(technique) {
                techniques.push(technique.clone());
            }
        }
        self.command("compare", &techniques, self.light_size)
    }

    fn command(
        &self,
        command: &str,
        techniques: &[NamedTechnique],
        light_size: Option<LightSize>,
    ) -> String {
        // Only an option begins with a hyphen.
        let at = if self.scene.starts_with('-') { "./" } else { "" };
        let mut words = vec!["umbrage".to_owned(), command.to_owned()];
        words.push(quoted(&format!("{at}{}", self.scene)));
        let mut add = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| quoted_option(name, &value)));
        };
        let numbers = |v: Option<DVec3>| v.map(|v| comma_separated(v.to_array()));
        let number = |n: Option<f64>| n.map(|n| n.to_string());
        let LightOptions { sun, light } = self.light_options();
        techniques.iter().for_each(|technique| add("shadows", Some(technique.to_string())));
        self.changes.without.iter().for_each(|name| add("without", Some(name.clone())));
        let view = &self.view;
        add("camera", view.camera.clone());
        add("eye", numbers(view.eye));
        add("target", numbers(view.target));
        add("up", numbers(view.up));
        add("fov", number(view.fov_deg));
        add("ortho", number(view.ortho));
        add("near", number(view.near));
        add("far", number(view.far));
        add("size", Some(format!("{}x{}", view.size[0], view.size[1])));
        add("sun", numbers(sun));
        add("light", light);
        add("light-size", light_size.map(|size| size.to_string()));
        add("animation", self.changes.animation.clone());
        let time_s = self.changes.animation.as_ref().map(|_| self.changes.time_s);
        add("time", number(time_s));
        add("fit", (self.fit != Fit::default()).then(|| self.fit.name().to_owned()));
        let flags = [("--ground", self.changes.ground), ("--opaque", self.opaque)];
        words
            .extend(flags.into_iter().filter(|(_, is_on)| *is_on).map(|(flag, _)| flag.to_owned()));
        words.join(" ")
    }

    fn parse(text: &str, folder: &Path) -> Result<Self, String> {
        let object: Map<String, Value> =
            serde_json::from_str(text).map_err(|e| format!("is no session: {e}"))?;
        let mut keys = Keys(object);
        match keys.take("version")? {
            Some(VERSION) => {}
            Some(version) => return Err(format!("version: must be {VERSION}, is {version}")),
            None => return Err(format!("version: is missing, must be {VERSION}")),
        }
        let vector = |v: [f64; 3]| DVec3::from(v);
        let name: String = keys.take("scene")?.ok_or("scene: is missing")?;
        let angles = keys.take("sun-angles")?.map(values::sun_direction).transpose();
        let sun_angles = angles.map_err(|problem| format!("sun-angles: {problem}"))?;
        let sun: Option<[f64; 3]> = keys.take("sun")?;
        if sun.is_some() && sun_angles.is_some() {
            return Err("sun-angles: cannot be used with sun".to_owned());
        }
        let techniques: Vec<String> = keys.take("shadows")?.ok_or("shadows: is missing")?;
        let view = ViewOptions {
            eye: keys.take("eye")?.map(vector),
            target: keys.take("target")?.map(vector),
            up: keys.take("up")?.map(vector),
            fov_deg: keys.take("fov")?,
            ortho: keys.take("ortho")?,
            near: keys.take("near")?,
            far: keys.take("far")?,
            size: keys.take("size")?.unwrap_or(ViewOptions::default().size),
            camera: keys.take("camera")?,
        };
        let session = Self {
            scene: from_folder(folder, name),
            changes: SceneOptions {
                without: keys.take("without")?.unwrap_or_default(),
                ground: keys.take("ground")?.unwrap_or_default(),
                animation: keys.take("animation")?,
                time_s: keys.take("time")?.unwrap_or_default(),
            },
            opaque: keys.take("opaque")?.unwrap_or_default(),
            view,
            light: LightOptions { sun: sun.map(vector).or(sun_angles), light: keys.take("light")? },
            headlight: keys.take("headlight")?.unwrap_or_default(),
            light_size: keys
                .take("light-size")?
                .map(|t: String| read("light-size", &t))
                .transpose()?,
            techniques: techniques.iter().map(|t| read("shadows", t)).collect::<Result<_, _>>()?,
            fit: keys.take("fit")?.map(|t: String| read_fit(&t)).transpose()?.unwrap_or_default(),
            overlay: keys.take("overlay")?,
            compare: keys.take("compare")?,
        };
        if let Some(key) = keys.0.keys().next() {
            return Err(format!("unknown field `{key}`"));
        }
        session.check().map_err(|e| e.to_string()).map(|()| session)
    }

    /// The file's text, a key a line, for a file in this folder.
    fn to_json(&self, folder: &Path) -> String {
        let vector = |v: Option<DVec3>| v.map(|v| json!(v.to_array()));
        let text = |t: &Option<String>| t.as_ref().map(|t| json!(t));
        let number = |n: Option<f64>| n.map(|n| json!(n));
        let flag = |is_on: bool| is_on.then_some(Value::Bool(true));
        let Self { changes, view, light, .. } = self;
        let techniques: Vec<String> = self.techniques.iter().map(ToString::to_string).collect();
        let keys = [
            ("version", Some(json!(VERSION))),
            ("scene", Some(json!(to_folder(folder, &self.scene)))),
            ("without", (!changes.without.is_empty()).then(|| json!(changes.without))),
            ("ground", flag(changes.ground)),
            ("opaque", flag(self.opaque)),
            ("animation", text(&changes.animation)),
            ("time", number((changes.time_s != 0.0).then_some(changes.time_s))),
            ("camera", text(&view.camera)),
            ("eye", vector(view.eye)),
            ("target", vector(view.target)),
            ("up", vector(view.up)),
            ("fov", number(view.fov_deg)),
            ("ortho", number(view.ortho)),
            ("near", number(view.near)),
            ("far", number(view.far)),
            ("size", Some(json!(view.size))),
            ("sun", vector(light.sun)),
            ("light", text(&light.light)),
            ("headlight", flag(self.headlight)),
            ("light-size", self.light_size.map(|size| json!(size.to_string()))),
            ("shadows", Some(json!(techniques))),
            ("fit", Some(json!(self.fit.name()))),
            ("overlay", text(&self.overlay)),
            ("compare", text(&self.compare)),
        ];
        let lines = keys
            .into_iter()
            .filter_map(|(key, value)| Some(format!("  {}: {}", json!(key), value?)));
        format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"))
    }
}

/// The keys of a session's file that are not yet read.
struct Keys(Map<String, Value>);

impl Keys {
    fn take<T: DeserializeOwned>(&mut self, key: &str) -> Result<Option<T>, String> {
        let value = self.0.remove(key).unwrap_or_default();
        serde_json::from_value(value).map_err(|e| format!("{key}: {e}"))
    }
}

fn read<T: FromStr<Err: std::error::Error>>(key: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|e: T::Err| format!("{key}: {text}: {}", with_causes(&e)))
}

fn read_fit(text: &str) -> Result<Fit, String> {
    let all = Fit::ALL;
    let names = all.map(Fit::name).join(", ");
    let fit = all.into_iter().find(|fit| fit.name() == text);
    fit.ok_or_else(|| format!("fit: must be one of {names}, is {text}"))
}

/// The name of a scene for this process, from its name in a file in this folder.
fn from_folder(folder: &Path, name: String) -> String {
    // A name without a file is that of a built-in scene, unless it can only be a path.
    let is_path = scene_file(folder, &name).is_some() || name.contains(['/', '\\', '.']);
    if is_path { folder.join(&name).to_string_lossy().into_owned() } else { name }
}

/// The name of a scene for a file in this folder, from its name for this process.
fn to_folder(folder: &Path, name: &str) -> String {
    let Some(file) = scene_file(Path::new(""), name) else { return name.to_owned() };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (Ok(file), Ok(folder)) = (file.canonicalize(), folder.canonicalize()) else {
        return name.to_owned();
    };
    let shared = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        // On another drive.
        return file.to_string_lossy().into_owned();
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(file.components().skip(shared)).collect();
    // Forward slashes are understood everywhere.
    path.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::open_scene;

    fn parsed(text: &str) -> Result<Session, String> {
        Session::parse(text, Path::new("saved"))
    }

    fn full() -> Session {
        Session {
            scene: "town:20".to_owned(),
            changes: SceneOptions {
                without: vec!["a lamp".to_owned()],
                ground: true,
                animation: Some("walk".to_owned()),
                time_s: 1.25,
            },
            opaque: true,
            view: ViewOptions {
                eye: Some(DVec3::new(0.1, 2.0, -1e6)),
                target: Some(DVec3::new(0.0, 1.0, 0.0)),
                up: Some(DVec3::Z),
                fov_deg: Some(47.5),
                ortho: None,
                near: Some(0.25),
                far: Some(125.0),
                size: [640, 360],
                camera: None,
            },
            light: LightOptions { sun: Some(DVec3::new(-0.3, -1.0, 0.1)), light: None },
            headlight: false,
            light_size: Some(LightSize::Degrees(0.53)),
            techniques: ["adaptive+z4:pcss@2048", "uniform(stable)+z4:pcf3"]
                .map(|t| t.parse().unwrap())
                .to_vec(),
            fit: Fit::Seen,
            overlay: Some("texels".to_owned()),
            compare: Some("wipe".to_owned()),
        }
    }

    fn least() -> Session {
        parsed(r#"{"version": 1, "scene": "town", "shadows": ["adaptive"]}"#).unwrap()
    }

    #[test]
    fn sessions_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a session.json");
        let of_camera = Session {
            view: ViewOptions { camera: Some("gate".to_owned()), ..ViewOptions::default() },
            light: LightOptions { sun: None, light: Some("lamp".to_owned()) },
            ..least()
        };
        let headlight = Session { headlight: true, light: LightOptions::default(), ..full() };
        let from_above = ViewOptions { fov_deg: None, ortho: Some(30.0), ..full().view };
        let ortho = Session { view: from_above, ..full() };
        for session in [full(), least(), of_camera, headlight, ortho] {
            session.write(&path).unwrap();
            assert_eq!(Session::read(&path).unwrap(), session);
        }
    }

    /// A session and its scene move together.
    #[test]
    fn scenes_lie_beside_their_session() {
        let home = tempfile::tempdir().unwrap();
        let folder = |name: &str| {
            let folder = home.path().join(name);
            std::fs::create_dir_all(&folder).unwrap();
            folder
        };
        let (here, scenes) = (folder("desk/sessions"), folder("desk/scenes"));
        let file = scenes.join("a.gltf");
        std::fs::write(&file, "{}").unwrap();
        let scene = file.to_string_lossy().into_owned();
        let path = here.join("a.json");
        Session { scene, ..least() }.write(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(r#""scene": "../scenes/a.gltf""#), "{text}");
        let moved = home.path().join("elsewhere");
        std::fs::rename(home.path().join("desk"), &moved).unwrap();
        let session = Session::read(&moved.join("sessions/a.json")).unwrap();
        assert!(Path::new(&session.scene).exists(), "{}", session.scene);
        // A file that is missing is looked for there too.
        std::fs::remove_file(&session.scene).unwrap();
        let session = Session::read(&moved.join("sessions/a.json")).unwrap();
        let error = open_scene(Path::new(""), &session.scene, &session.changes).unwrap_err();
        assert!(error.to_string().contains("elsewhere"), "{error}");
    }

    #[test]
    fn bad_sessions_name_their_key() {
        for (text, expected) in [
            ("", "is no session"),
            ("[]", "is no session"),
            ("{\n\"version\": 1,,}", "line 2"),
            ("{}", "version: is missing"),
            (r#"{"version": 2, "news": 1}"#, "version: must be 1, is 2"),
            (r#"{"version": "1"}"#, "version: invalid type: string"),
            (r#"{"version": 1}"#, "scene: is missing"),
            (r#"{"version": 1, "scene": "town"}"#, "shadows: is missing"),
            (
                r#"{"version": 1, "scene": "town", "shadows": []}"#,
                "shadows: must have at least one",
            ),
            (r#"{"version": 1, "scene": "town", "shadows": ["lipsm"]}"#, "did you mean `lispsm`?"),
            (r#"{"version": 1, "scene": "town", "shadows": ["psm@20000"]}"#, "from 1 to 16384"),
        ] {
            let error = parsed(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
        for (more, expected) in [
            (r#""aye": [0, 0, 0]"#, "unknown field `aye`"),
            (r#""eye": [0, 0]"#, "eye: invalid length 2"),
            (r#""eye": [0, 0, 1e13]"#, "eye: must be within"),
            (r#""eye": [0, 1, 0], "target": [0, 1, 0]"#, "target: must differ from eye"),
            (r#""fov": "60""#, "fov: invalid type: string"),
            (r#""fov": 180"#, "fov: must be an angle"),
            (r#""fov": 60, "ortho": 3"#, "fov: cannot be used with ortho"),
            (r#""near": 9, "far": 5"#, "far: must exceed near (9), is 5"),
            (r#""size": [0, 5]"#, "size: must be WIDTHxHEIGHT"),
            (r#""size": [-1, 5]"#, "size: invalid value"),
            (r#""camera": "a", "eye": [0, 0, 1]"#, "camera: cannot be used with eye"),
            (r#""sun": [0, 0, 0]"#, "sun: must point somewhere"),
            (r#""sun": [0, -1, 0], "light": "a""#, "light: cannot be used with sun"),
            (r#""sun": [0, -1, 0], "sun-angles": [0, 45]"#, "sun-angles: cannot be used with sun"),
            (r#""sun-angles": [0, 91]"#, "sun-angles: must be an azimuth"),
            (r#""headlight": true"#, "headlight: needs eye and target"),
            (r#""headlight": true, "light": "a""#, "headlight: cannot be used with light"),
            (r#""light-size": "2""#, "light-size: 2: must have a unit"),
            (r#""fit": "tight""#, "fit: must be one of box, surfaces, seen, is tight"),
            (r#""time": -1"#, "time: must be"),
            (r#""without": "a""#, "without: invalid type"),
            (r#""ground": 1"#, "ground: invalid type"),
        ] {
            let text = format!(r#"{{"version": 1, "scene": "town", "shadows": ["psm"], {more}}}"#);
            let error = parsed(&text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
            assert!(!error.contains('\n'), "{error}");
        }
        let error = Session::read(Path::new("no/such.json")).unwrap_err().to_string();
        assert!(error.starts_with("session: no/such.json: "), "{error}");
    }

    #[test]
    fn lights_are_what_shines() {
        let angles =
            r#"{"version": 1, "scene": "town", "shadows": ["psm"], "sun-angles": [0, 90]}"#;
        let sun = parsed(angles).unwrap().light_options().sun.unwrap();
        assert!(sun.distance(DVec3::NEG_Y) < 1e-12, "{sun}");
        let headlight = Session { headlight: true, light: LightOptions::default(), ..full() };
        let along = headlight.view.target.unwrap() - headlight.view.eye.unwrap();
        assert_eq!(headlight.light_options().sun, Some(along));
    }

    #[test]
    fn commands_tell_what_differs_from_the_defaults() {
        let techniques = vec!["adaptive".parse().unwrap(); 2];
        let least = Session { techniques, ..least() };
        assert_eq!(least.render_command(), "umbrage render town --shadows=adaptive --size=960x540");
        assert_eq!(
            least.compare_command(),
            "umbrage compare town --shadows=adaptive --size=960x540"
        );
        assert_eq!(
            full().compare_command(),
            "umbrage compare town:20 --shadows=adaptive+z4:pcss@2048 \
             --shadows='uniform(stable)+z4:pcf3' --without='a lamp' --eye=0.1,2,-1000000 \
             --target=0,1,0 --up=0,0,1 --fov=47.5 --near=0.25 --far=125 --size=640x360 \
             --sun=-0.3,-1,0.1 --light-size=0.53deg --animation=walk --time=1.25 \
             --fit=seen --ground --opaque"
        );
    }
}
