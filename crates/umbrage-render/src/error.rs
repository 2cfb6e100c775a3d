/// Why a picture could not be rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No adapter was found, or none with the requested name. Holds the reason.
    #[error("no GPU answers: {0}")]
    NoAdapter(String),
    /// The adapter cannot provide a suitable device.
    #[error("{adapter}: {problem}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What is missing, or the adapter's message.
        problem: String,
    },
    /// The device was lost during work. Holds the device's message.
    #[error("the GPU was lost: {0}")]
    Lost(String),
    /// The device refused a request, for example for memory. Holds the device's message.
    #[error("the GPU refused: {0}")]
    Refused(String),
    /// A part of the scene or the picture is too large for the device.
    #[error("{what} is too large for this GPU: {problem}")]
    TooLarge {
        /// The part that is too large.
        what: String,
        /// The limit that it exceeds.
        problem: String,
    },
    /// An argument has a value that it cannot have.
    #[error("{field} {problem}")]
    Invalid {
        /// The argument, or its field.
        field: &'static str,
        /// What it must be, and what it is.
        problem: String,
    },
    /// A pose is that of another scene than the one that was uploaded.
    #[error("the scene that was posed is not the one that was uploaded")]
    OtherScene,
    /// An error of [`umbrage_wgpu`].
    #[error(transparent)]
    Shadows(#[from] umbrage_wgpu::Error),
}
