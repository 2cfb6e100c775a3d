use std::path::PathBuf;

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file could not be read.
    #[error("{}: {source}", .path.display())]
    Read {
        /// The scene, or the buffer or image it refers to.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file breaks a rule of glTF 2.0 that has no safe repair.
    #[error("{}: {place}: {problem}", .path.display())]
    Invalid {
        /// The scene file.
        path: PathBuf,
        /// Where in it, as a JSON path such as `meshes[3].primitives[0].indices`.
        place: String,
        /// What is wrong there, and what would be right.
        problem: String,
    },
    /// No built-in scene has this name.
    #[error("no built-in scene is called {name:?}; did you mean {nearest:?}?")]
    UnknownBuiltin {
        /// As asked for.
        name: String,
        /// The name most like it.
        nearest: &'static str,
    },
    /// A built-in scene of this size would be empty or too large.
    #[error("size: {name:?} comes in sizes 1 to {max}, not {size}")]
    BuiltinSize {
        /// The scene.
        name: &'static str,
        /// As asked for.
        size: u32,
        /// The largest that can be built.
        max: u32,
    },
}
