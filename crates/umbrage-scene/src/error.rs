use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;

/// Why a scene could not be loaded or built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file could not be read.
    #[error("{}: {problem}", .path.display())]
    Read {
        /// Path of the scene, or of the buffer or image that the scene refers to.
        path: PathBuf,
        /// The error of the operating system. It is part of the message and therefore no source,
        /// which would repeat it.
        problem: std::io::Error,
    },
    /// The file breaks a rule of glTF 2.0 that has no safe repair.
    #[error("{}: {place}: {problem}", .path.display())]
    Invalid {
        /// Path of the scene file.
        path: PathBuf,
        /// Place in the file, as a JSON path such as `meshes[3].primitives[0].indices`.
        place: String,
        /// What is wrong there, and what would be right.
        problem: String,
    },
    /// Loading the scene would take more memory than it may.
    #[error(
        "{}: {place}: with {what} the scene would take {}, it may take at most {}",
        .path.display(), Mebibytes(*.needs), Mebibytes(*.limit)
    )]
    TooLarge {
        /// Path of the scene file.
        path: PathBuf,
        /// Place in the file, as a JSON path such as `nodes[3]`.
        place: String,
        /// What there is too much of, with its number, such as `67108864 instances`.
        what: String,
        /// The memory that all of the scene up to there would take, bytes.
        needs: u64,
        /// The memory that the scene may take, bytes.
        limit: u64,
    },
    /// No built-in scene has this name.
    #[error("no built-in scene is called {name:?}; did you mean {nearest:?}?")]
    UnknownBuiltin {
        /// The requested name.
        name: String,
        /// The valid name that is most similar to it.
        nearest: &'static str,
    },
    /// The requested size of a built-in scene is out of range.
    #[error("size: {name:?} comes in sizes 1 to {max}, not {size}")]
    BuiltinSize {
        /// Name of the scene.
        name: &'static str,
        /// The requested size.
        size: u32,
        /// The largest valid size; the smallest is 1.
        max: u32,
    },
}

/// Bytes for people to read.
struct Mebibytes(u64);

impl Display for Mebibytes {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} MiB", self.0.div_ceil(1 << 20))
    }
}
