//! Measures shadow images against truth, draws where they are wrong, and writes the report.
//!
//! ```text
//! truth ──────┐
//! visibility ─┼─► measure ──► Metrics ─────────┐
//! counted ────┘                                ├─► Report ─► write_report ─► report.json, index.html
//! error_px ─────► measure_error_px ─► ErrorPx ─┘                ▲
//! all of them ──► write_pictures ──► Pictures ──────────────────┘
//! ```
//!
//! *Counted* are the pixels that show a surface facing the light; all figures are over these. A
//! visibility is 0 in shadow and 1 in light. Errors are pixels per texel: how many pixels wide a texel
//! of the shadow map shows on the surface seen (perspective and projection; above 1 it looks jagged).
//! Images run row by row from the upper left.

mod color;
mod error;
mod files;
mod image;
mod maps;
mod metrics;
mod page;
mod pictures;
mod report;
mod sweep;

pub use color::{ErrorScale, FALSE_LIGHT, FALSE_SHADOW, PARTITIONS};
pub use error::Error;
pub use files::{ExrPixel, PngPixel, png, write_exr, write_file, write_png};
pub use image::{Image, Rgb};
pub use maps::{difference_map, error_map, grey, noise_map, partition_map, texel_map};
pub use metrics::{ErrorPx, Metrics, measure, measure_error_px, worst_spot};
pub use page::{
    FigureFile, FigureShown, FiguresPage, Page, SweepPage, write_figures, write_report, write_sweep,
};
pub use pictures::{Pictures, Seen, SeenTruth, write_pictures, write_truth_pictures};
pub use report::{LightInfo, Measured, Motion, Report, Times, Truth, View};
pub use sweep::{Mean, Sweep, SweepSettings, SweptView};
