use glam::DVec3;
use std::fmt::{self, Display};
use std::path::PathBuf;
use umbrage::Error as PlanError;
use umbrage_scene::SceneError;

/// An input that a user can give. Errors name the field that they are about. A program may have its
/// own words for the fields: options of a command line, keys of a file, or fields of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Field {
    /// The scene: a file or a built-in scene.
    Scene,
    /// Position of the viewer.
    Eye,
    /// Point in the middle of the picture.
    Target,
    /// Upward direction in the picture.
    Up,
    /// Vertical field of view.
    Fov,
    /// The height of what an orthographic view shows.
    Ortho,
    /// Near distance of the view.
    Near,
    /// Far distance of the view.
    Far,
    /// Size of the picture.
    Size,
    /// A camera of the scene.
    Camera,
    /// Direction in which parallel light travels.
    Sun,
    /// Azimuth and elevation of the sun.
    SunAngles,
    /// A light of the scene.
    Light,
    /// Whether a sun shines from the viewer.
    Headlight,
    /// A technique.
    Shadows,
    /// Largest error of the techniques whose text gives no size.
    MaxError,
    /// Number of rays along each side of a pixel.
    Samples,
    /// Size of the light in the truth.
    LightSize,
    /// What shadow maps are fitted to.
    Fit,
    /// Whether alpha-masked materials are treated as solid.
    Opaque,
    /// The animation that poses the scene.
    Animation,
    /// Time in the animation.
    Time,
    /// Whether all triangles are drawn.
    FullDetail,
    /// The file with levels of detail.
    Clusters,
    /// Nodes of the scene that are left out.
    Without,
    /// Whether ground is put under the scene.
    Ground,
    /// The backend that renders.
    Backend,
    /// The motion of the viewer or the light.
    Motion,
    /// The file or folder to be written.
    Output,
    /// The file that lists the views of a sweep.
    Views,
    /// The folder that the paths of a sweep's scenes are relative to.
    Scenes,
    /// The folders of a sweep's shares, which are to be joined.
    Merge,
    /// The file of a session.
    Session,
}

impl Field {
    /// Returns the name of the field, one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Eye => "eye",
            Self::Target => "target",
            Self::Up => "up",
            Self::Fov => "fov",
            Self::Ortho => "ortho",
            Self::Near => "near",
            Self::Far => "far",
            Self::Size => "size",
            Self::Camera => "camera",
            Self::Sun => "sun",
            Self::SunAngles => "sun-angles",
            Self::Light => "light",
            Self::Headlight => "headlight",
            Self::Shadows => "shadows",
            Self::MaxError => "max-error",
            Self::Samples => "samples",
            Self::LightSize => "light-size",
            Self::Fit => "fit",
            Self::Opaque => "opaque",
            Self::Animation => "animation",
            Self::Time => "time",
            Self::FullDetail => "full-detail",
            Self::Clusters => "clusters",
            Self::Without => "without",
            Self::Ground => "ground",
            Self::Backend => "backend",
            Self::Motion => "motion",
            Self::Output => "output",
            Self::Views => "views",
            Self::Scenes => "scenes",
            Self::Merge => "merge",
            Self::Session => "session",
        }
    }

    /// Returns whether the views in a sweep's file have this field, with its name as the key.
    pub(crate) fn is_of_view(self) -> bool {
        use Field::{
            Camera, Eye, Far, Fov, Light, Near, Ortho, Scene, Size, Sun, SunAngles, Target, Up,
        };
        [Scene, Eye, Target, Up, Fov, Ortho, Near, Far, Size, Camera, Sun, SunAngles, Light]
            .contains(&self)
    }
}

/// Shows the name of the field.
impl Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Names of a camera's and a light's values in a [`PlanError`], and the fields that give them.
const PLANNED: [(&str, Field); 9] = [
    ("camera.fov_y_rad", Field::Fov),
    ("camera.height", Field::Ortho),
    ("camera.image", Field::Size),
    ("camera.eye", Field::Eye),
    ("camera.target", Field::Target),
    ("camera.up", Field::Up),
    ("camera.near", Field::Near),
    ("camera.far", Field::Far),
    ("light.direction", Field::Sun),
];

/// The reason why something cannot be done.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The value of a field is invalid, or what it names is not available.
    Field {
        /// The field.
        field: Field,
        /// The value, if the message has to say which of several values is meant.
        value: Option<String>,
        /// What is wrong with the value, and what would be valid.
        problem: String,
    },
    /// Two fields cannot be used together.
    Excluded {
        /// The field that is refused.
        field: Field,
        /// The field that excludes it.
        by: Field,
    },
    /// The far distance of a view does not exceed its near distance.
    Ends {
        /// Near distance, metres.
        near: f64,
        /// Far distance, metres.
        far: f64,
    },
    /// The eye and the target of a view are the same point.
    LooksAtEye {
        /// This point, metres.
        eye: DVec3,
    },
    /// The planner refuses the camera or the light.
    Planning(PlanError),
    /// A technique cannot reach the largest error that was asked for.
    LargestError {
        /// Text of the technique.
        shadows: String,
        /// Largest error that was asked for, pixels per texel.
        pixels: f64,
        /// The planner's reason, which says what would be needed.
        problem: String,
    },
    /// A folder holds a sweep with other settings.
    OtherSweep {
        /// The field that gave the folder.
        field: Field,
        /// The folder.
        folder: PathBuf,
        /// The settings that differ.
        differences: Vec<Difference>,
    },
    /// Shadow maps were looked up before any were rendered.
    NoMaps,
    /// A scene cannot be read.
    Scene(SceneError),
    /// Rays cannot be traced, or the CPU reference cannot render the maps.
    Rays(umbrage_trace::Error),
    /// A GPU failed.
    Gpu(umbrage_render::Error),
    /// A result cannot be measured or written.
    Measure(umbrage_measure::Error),
}

/// A setting that differs between a stored sweep and the one that was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The field that differs.
    pub field: Field,
    /// Its value in the folder.
    pub was: String,
    /// The value that was asked for.
    pub is: String,
}

impl Error {
    /// Makes an error about an invalid value of a field.
    pub(crate) fn field(field: Field, problem: impl Display) -> Self {
        Self::Field { field, value: None, problem: problem.to_string() }
    }

    /// Returns the error and its causes on one line. `word` returns the caller's word for a field.
    pub fn in_words(&self, word: &dyn Fn(Field) -> String) -> String {
        let text = match self {
            Self::Field { field, value: None, problem } => format!("{}: {problem}", word(*field)),
            Self::Field { field, value: Some(value), problem } => {
                format!("{} {value}: {problem}", word(*field))
            }
            Self::Excluded { field, by } => {
                format!("{}: cannot be used with {}", word(*field), word(*by))
            }
            Self::Ends { near, far } => {
                let [begin, end] = [Field::Near, Field::Far].map(word);
                format!("{end}: must exceed {begin} ({near}), is {far}")
            }
            Self::LooksAtEye { eye } => {
                let [place, target] = [Field::Eye, Field::Target].map(word);
                format!("{target}: must differ from {place}, both are {eye}")
            }
            Self::Planning(error) => PLANNED
                .iter()
                .fold(error.to_string(), |text, (path, field)| text.replace(path, &word(*field))),
            Self::LargestError { shadows, pixels, problem } => {
                let [technique, limit] = [Field::Shadows, Field::MaxError].map(word);
                format!("{technique} {shadows}: `{limit} {pixels}`: {problem}")
            }
            Self::OtherSweep { field, folder, differences } => {
                let differences: Vec<String> = differences
                    .iter()
                    .map(|d| format!("{} was `{}`, is `{}`", word(d.field), d.was, d.is))
                    .collect();
                let [field_word, folder] = [word(*field), folder.display().to_string()];
                let differences = differences.join(", ");
                let way_out = match field {
                    Field::Output => "; take another folder",
                    _ => "",
                };
                format!("{field_word}: {folder} holds another sweep: {differences}{way_out}")
            }
            Self::NoMaps => "shadow maps are rendered before they are looked up".to_owned(),
            Self::Scene(error) => with_causes(error),
            Self::Rays(error) => with_causes(error),
            Self::Gpu(error) => with_causes(error),
            Self::Measure(error) => with_causes(error),
        };
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

/// Shows the error with the fields by their names.
impl Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words(&|field| field.name().to_owned()))
    }
}

// The message already contains the causes, so `source` returns none.
impl std::error::Error for Error {}

impl From<SceneError> for Error {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<umbrage_trace::Error> for Error {
    fn from(error: umbrage_trace::Error) -> Self {
        Self::Rays(error)
    }
}

impl From<umbrage_render::Error> for Error {
    fn from(error: umbrage_render::Error) -> Self {
        Self::Gpu(error)
    }
}

impl From<umbrage_measure::Error> for Error {
    fn from(error: umbrage_measure::Error) -> Self {
        Self::Measure(error)
    }
}

/// Returns the message of an error, followed by those of its causes.
pub(crate) fn with_causes(error: &dyn std::error::Error) -> String {
    let chain = std::iter::successors(Some(error), |e| e.source());
    joined(chain.map(ToString::to_string))
}

/// Joins the messages of an error and its causes. Some errors tell their cause themselves, which is
/// then not told again.
pub fn joined(messages: impl IntoIterator<Item = String>) -> String {
    messages.into_iter().fold(String::new(), |text, message| match text.is_empty() {
        true => message,
        false if text.ends_with(&message) => text,
        false => format!("{text}: {message}"),
    })
}

/// Converts errors of other crates into errors about a field.
pub(crate) trait About<T> {
    /// Converts the error into one that says that the field's value does not work.
    fn about(self, field: Field) -> Result<T, Error>;

    /// Does the same as [`about`](Self::about), but first says what was tried.
    fn about_trying(self, field: Field, what: impl FnOnce() -> String) -> Result<T, Error>;

    /// Converts the error into one that says that the GPU does not work.
    fn on_gpu(self) -> Result<T, Error>;
}

impl<T, E: std::error::Error> About<T> for Result<T, E> {
    fn about(self, field: Field) -> Result<T, Error> {
        self.map_err(|e| Error::field(field, with_causes(&e)))
    }

    fn about_trying(self, field: Field, what: impl FnOnce() -> String) -> Result<T, Error> {
        self.map_err(|e| Error::field(field, format!("{}: {}", what(), with_causes(&e))))
    }

    fn on_gpu(self) -> Result<T, Error> {
        self.map_err(|e| Error::Field {
            field: Field::Backend,
            value: Some("gpu".to_owned()),
            problem: with_causes(&e),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some errors of these kinds tell their cause, and some leave it to whoever shows them.
    #[test]
    fn causes_are_told_once() {
        let cause = || std::io::Error::other("disk full");
        let measure = umbrage_measure::Error::Write { path: "a.png".into(), source: cause() };
        assert_eq!(Error::from(measure).to_string(), "cannot write a.png: disk full");
        let scene = SceneError::Read { path: "a.glb".into(), problem: cause() };
        assert_eq!(Error::from(scene).to_string(), "a.glb: disk full");
        let messages = ["top", "why: root", "root"].map(str::to_owned);
        assert_eq!(joined(messages), "top: why: root");
    }

    #[test]
    fn whoever_asks_has_his_own_words() {
        let option = |field: Field| match field {
            Field::Scene => "SCENE".to_owned(),
            field => format!("--{field}"),
        };
        let unplanned = umbrage::Error::Invalid {
            field: "camera.far",
            problem: "must exceed camera.near (9), is 5".into(),
        };
        let difference = Difference { field: Field::Fit, was: "box".into(), is: "seen".into() };
        let other = |field| Error::OtherSweep {
            field,
            folder: "out".into(),
            differences: vec![difference.clone()],
        };
        for (error, named, asked) in [
            (Error::field(Field::Scene, "is\nnot"), "scene: is not", "SCENE: is not"),
            (
                Error::Ends { near: 2.0, far: 1.0 },
                "far: must exceed near (2), is 1",
                "--far: must exceed --near (2), is 1",
            ),
            (
                Error::Planning(unplanned),
                "far: must exceed near (9), is 5",
                "--far: must exceed --near (9), is 5",
            ),
            (
                other(Field::Merge),
                "merge: out holds another sweep: fit was `box`, is `seen`",
                "--merge: out holds another sweep: --fit was `box`, is `seen`",
            ),
            (
                other(Field::Output),
                "output: out holds another sweep: fit was `box`, is `seen`; take another folder",
                "--output: out holds another sweep: --fit was `box`, is `seen`; take another folder",
            ),
        ] {
            assert_eq!(error.to_string(), named);
            assert_eq!(error.in_words(&option), asked);
        }
    }
}
