/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No adapter answers, or none of that name.
    #[error("no GPU answers: {0}")]
    NoAdapter(String),
    /// The adapter gives no device.
    #[error("{adapter}: {problem}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What it says.
        problem: String,
    },
    /// The device was lost at work.
    #[error("the GPU was lost: {0}")]
    Lost(String),
    /// The device refused something, such as memory.
    #[error("the GPU refused: {0}")]
    Refused(String),
    /// Something of the scene or picture is too large for the device.
    #[error("{what} is too large for this GPU: {problem}")]
    TooLarge {
        /// What it is.
        what: String,
        /// What is possible.
        problem: String,
    },
    /// There are no shadows.
    #[error(transparent)]
    Shadows(#[from] umbrage_wgpu::Error),
}
