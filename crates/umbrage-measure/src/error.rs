use std::io;
use std::path::PathBuf;

/// Why something could not be measured or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An image has no pixels, or is too large to address.
    #[error("{what}: size must be 1 to 65536 pixels in width and height, is {}x{}", size[0], size[1])]
    Size {
        /// Which image it is.
        what: &'static str,
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// An image's number of values is not its number of pixels.
    #[error("{}x{} pixels need {} values, got {values}", size[0], size[1], u64::from(size[0]) * u64::from(size[1]))]
    Values {
        /// Width and height, pixels.
        size: [u32; 2],
        /// Number of values.
        values: usize,
    },
    /// An image differs in size from the truth.
    #[error("{what} must be {}x{} pixels like the truth, is {}x{}", expected[0], expected[1], size[0], size[1])]
    Mismatch {
        /// Which image it is.
        what: &'static str,
        /// Width and height that it should have, pixels.
        expected: [u32; 2],
        /// Width and height that it has, pixels.
        size: [u32; 2],
    },
    /// A visibility at a counted pixel is not finite.
    #[error("{what}: pixel ({}, {}) is {value}, must be finite", pixel[0], pixel[1])]
    NotFinite {
        /// Which image it is.
        what: &'static str,
        /// Column and row of the pixel, from the upper left corner.
        pixel: [u32; 2],
        /// The visibility found there.
        value: f32,
    },
    /// The end of a scale of pixels per texel is out of range.
    #[error("error scale: largest error must lie in (1, 1000000] pixels per texel, is {max}")]
    Scale {
        /// Upper end, pixels per texel.
        max: f32,
    },
    /// The parts of a report do not match.
    #[error("{field}: {problem}")]
    Report {
        /// The field that is wrong.
        field: &'static str,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A file's content could not be encoded.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// Path of the file that was to be written.
        path: PathBuf,
        /// The encoder's message.
        reason: String,
    },
    /// A table could not be written as CSV.
    #[error("cannot write a table: {0}")]
    Table(#[from] csv::Error),
    /// A text is not a `report.json`.
    #[error("not a report: {0}")]
    Json(#[from] serde_json::Error),
}
