use std::io;
use std::path::PathBuf;

/// What can go wrong in measuring and writing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An image without pixels, or too large to address.
    #[error("{what}: size must be 1 to 65536 pixels each way, is {}x{}", size[0], size[1])]
    Size {
        /// Which image.
        what: &'static str,
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// Not one value a pixel.
    #[error("{}x{} pixels need {} values, got {values}", size[0], size[1], u64::from(size[0]) * u64::from(size[1]))]
    Values {
        /// Width and height, pixels.
        size: [u32; 2],
        /// How many came.
        values: usize,
    },
    /// Two images that belong together differ in size.
    #[error("{what} must be {}x{} pixels like the truth, is {}x{}", expected[0], expected[1], size[0], size[1])]
    Mismatch {
        /// Which image.
        what: &'static str,
        /// Width and height that it should have, pixels.
        expected: [u32; 2],
        /// Width and height that it has, pixels.
        size: [u32; 2],
    },
    /// A visibility that is not a number, at a counted pixel.
    #[error("{what}: pixel ({}, {}) is {value}, must be finite", pixel[0], pixel[1])]
    NotFinite {
        /// Which image.
        what: &'static str,
        /// Column and row, from the upper left.
        pixel: [u32; 2],
        /// The value found.
        value: f32,
    },
    /// A scale of pixels per texel that has no length.
    #[error("error scale: largest error must lie in (1, 1000000] pixels per texel, is {max}")]
    Scale {
        /// Upper end, pixels per texel.
        max: f32,
    },
    /// A report whose parts do not belong together.
    #[error("{field}: {problem}")]
    Report {
        /// Which field.
        field: &'static str,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Pixels could not be encoded.
    #[error("cannot encode {}: {reason}", path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// Why, in the encoder's words.
        reason: String,
    },
    /// A table could not be put into text.
    #[error("cannot write a table: {0}")]
    Table(#[from] csv::Error),
    /// Text that is no `report.json`.
    #[error("not a report: {0}")]
    Json(#[from] serde_json::Error),
}
