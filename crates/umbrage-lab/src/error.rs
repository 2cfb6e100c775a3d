use glam::DVec3;
use std::fmt::{self, Display};
use std::path::PathBuf;
use umbrage::Error as PlanError;
use umbrage_scene::SceneError;

/// What may be asked for. Errors name the one that they are about, and whoever asks may have other
/// words for it: options of a command line, keys of a file, fields of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Field {
    /// A file, or a built-in scene.
    Scene,
    /// Where the viewer is.
    Eye,
    /// What is in the middle of the picture.
    Target,
    /// What is up in the picture.
    Up,
    /// The picture's vertical angle.
    Fov,
    /// Where the view begins.
    Near,
    /// Where it ends.
    Far,
    /// The picture's size.
    Size,
    /// A camera of the scene.
    Camera,
    /// The way that parallel light travels.
    Sun,
    /// A light of the scene.
    Light,
    /// A technique.
    Shadows,
    /// The largest error of techniques that do not say how many texels there are.
    MaxError,
    /// Rays along each side of a pixel.
    Samples,
    /// What shadow maps are fitted to.
    Fit,
    /// Whether masked materials are solid.
    Opaque,
    /// What renders.
    Backend,
    /// What moves.
    Motion,
    /// The file or folder to be written.
    Output,
    /// The file of a sweep's views.
    Views,
    /// The folder that paths of scenes start from.
    Scenes,
    /// Folders of a sweep's shares.
    Merge,
}

impl Field {
    /// Its name, one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Eye => "eye",
            Self::Target => "target",
            Self::Up => "up",
            Self::Fov => "fov",
            Self::Near => "near",
            Self::Far => "far",
            Self::Size => "size",
            Self::Camera => "camera",
            Self::Sun => "sun",
            Self::Light => "light",
            Self::Shadows => "shadows",
            Self::MaxError => "max-error",
            Self::Samples => "samples",
            Self::Fit => "fit",
            Self::Opaque => "opaque",
            Self::Backend => "backend",
            Self::Motion => "motion",
            Self::Output => "output",
            Self::Views => "views",
            Self::Scenes => "scenes",
            Self::Merge => "merge",
        }
    }

    /// Whether a view of a sweep's file has it, so that it is called by its name there.
    pub(crate) fn is_of_view(self) -> bool {
        use Field::{Camera, Eye, Far, Fov, Light, Near, Scene, Size, Sun, Target, Up};
        [Scene, Eye, Target, Up, Fov, Near, Far, Size, Camera, Sun, Light].contains(&self)
    }
}

/// By its name.
impl Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What [`PlanError`] calls a camera's and a light's fields, and who asks.
const PLANNED: [(&str, Field); 8] = [
    ("camera.fov_y_rad", Field::Fov),
    ("camera.image", Field::Size),
    ("camera.eye", Field::Eye),
    ("camera.target", Field::Target),
    ("camera.up", Field::Up),
    ("camera.near", Field::Near),
    ("camera.far", Field::Far),
    ("light.direction", Field::Sun),
];

/// Why something cannot be done.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A field's value makes no sense, or what it names cannot be had.
    Field {
        /// Which one.
        field: Field,
        /// Which of the values that it may have, where that needs to be told.
        value: Option<String>,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
    /// A field that another one excludes.
    Excluded {
        /// Which one.
        field: Field,
        /// The other one.
        by: Field,
    },
    /// A view that ends before it begins; metres.
    Ends {
        /// Where it begins.
        near: f64,
        /// Where it ends.
        far: f64,
    },
    /// A viewer who looks at where he is.
    LooksAtEye {
        /// Where that is, metres.
        eye: DVec3,
    },
    /// The planner cannot do with a camera or light.
    Planning(PlanError),
    /// A technique cannot have as small an error as was asked for.
    LargestError {
        /// The text of the technique.
        shadows: String,
        /// What was asked for, pixels per texel.
        pixels: f64,
        /// What would be needed.
        problem: String,
    },
    /// A folder that holds a sweep with other settings.
    OtherSweep {
        /// Who names the folder.
        field: Field,
        /// The folder.
        folder: PathBuf,
        /// In what the sweeps differ.
        differences: Vec<Difference>,
    },
    /// Shadow maps were to be looked up before any were rendered.
    NoMaps,
    /// A scene's file cannot be read.
    Scene(SceneError),
    /// Rays cannot be traced, or the reference's maps not be rendered.
    Rays(umbrage_trace::Error),
    /// A GPU fails.
    Gpu(umbrage_render::Error),
    /// Something cannot be measured or written.
    Measure(umbrage_measure::Error),
}

/// A setting that is not what it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Which one.
    pub field: Field,
    /// Its value there.
    pub was: String,
    /// The value asked for.
    pub is: String,
}

impl Error {
    /// A field's value makes no sense.
    pub(crate) fn field(field: Field, problem: impl Display) -> Self {
        Self::Field { field, value: None, problem: problem.to_string() }
    }

    /// The error and what caused it on one line, with somebody's own words for the fields.
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

/// The fields by their names.
impl Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words(&|field| field.name().to_owned()))
    }
}

// What caused it is part of its words.
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

/// An error and what caused it.
pub(crate) fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |e| e.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// Tells which field an error of others is about.
pub(crate) trait About<T> {
    /// The field's value does not work.
    fn about(self, field: Field) -> Result<T, Error>;

    /// The same, saying first what was tried.
    fn about_trying(self, field: Field, what: impl FnOnce() -> String) -> Result<T, Error>;

    /// The GPU that was asked for, or taken, does not work.
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
