/// Why a scene cannot be traced, a map cannot be rendered or a view cannot be sampled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene refers to something that it does not contain, or holds a value that rays cannot be
    /// traced with.
    #[error("{place}: {problem}")]
    Scene {
        /// Path of the field, such as `meshes[3].triangles[17]`.
        place: String,
        /// What is wrong with it and what would be right.
        problem: String,
    },
    /// A depth map is too large for this machine's memory.
    #[error("a depth map of {}x{} texels does not fit into memory", resolution[0], resolution[1])]
    Memory {
        /// Resolution of the map in s and t, texels.
        resolution: [u32; 2],
    },
    /// The number of samples per pixel is out of range.
    #[error("samples along each side of a pixel must be 1 to {max}, not {given}")]
    Samples {
        /// The requested number of samples along each side of a pixel.
        given: u32,
        /// The largest valid number.
        max: u32,
    },
    /// The size of an area light is not one that this kind of light can have.
    #[error("light size: {problem}")]
    LightSize {
        /// What is wrong and what would be right.
        problem: String,
    },
}

impl Error {
    pub(crate) fn scene(place: String, problem: impl Into<String>) -> Self {
        Self::Scene { place, problem: problem.into() }
    }
}
