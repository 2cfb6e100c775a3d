/// What can keep rays from being traced or a map from being rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene that refers to what it does not have, or has values no ray can deal with.
    #[error("{place}: {problem}")]
    Scene {
        /// Path of the field, such as `meshes[3].triangles[17]`.
        place: String,
        /// What is wrong with it and what would be right.
        problem: String,
    },
    /// A depth map too large for this machine.
    #[error("a depth map of {}x{} texels does not fit into memory", resolution[0], resolution[1])]
    Memory {
        /// Texels in s and t.
        resolution: [u32; 2],
    },
    /// A number of samples out of range.
    #[error("samples per pixel and axis must be 1 to {max}, are {given}")]
    Samples {
        /// The number asked for.
        given: u32,
        /// The largest that works.
        max: u32,
    },
}

impl Error {
    pub(crate) fn scene(place: String, problem: impl Into<String>) -> Self {
        Self::Scene { place, problem: problem.into() }
    }
}
