//! Measures the visibility that a technique gives against the truth, draws where it is wrong, and
//! writes the report.
//!
//! ```text
//! truth ──────┐
//! visibility ─┼─► measure ──► Metrics ─────────┐
//! counted ────┘                                ├─► Report ─► write_report ─► report.json,
//! error_px ─────► measure_error_px ─► ErrorPx ─┘                ▲            index.html
//! all of them ──► write_pictures ──► Pictures ──────────────────┘
//! ```
//!
//! *Counted* pixels are those that show a surface facing the light; all figures are over these
//! pixels. A visibility is 0 in shadow and 1 in light. Errors are in pixels per texel: how many
//! pixels wide a texel of the shadow map appears on the visible surface (from perspective and
//! projection; above 1, edges look jagged). Images are stored row by row from the upper left
//! corner.

mod color;
mod error;
mod files;
mod image;
mod legend;
mod maps;
mod metrics;
mod page;
mod pictures;
mod report;
mod sweep;
mod temporary;
mod verdict;

pub use color::{
    ErrorScale, FALSE_LIGHT, FALSE_SHADOW, LEVEL_COLORS, LEVELS, PARTITIONS, cluster_color,
    level_scale,
};
pub use error::Error;
pub use files::{ExrPixel, PngPixel, png, write_exr, write_file, write_file_with, write_png};
pub use image::{Image, Rgb};
pub use legend::{with_legend, with_level_legend};
pub use maps::{
    cluster_map, difference_map, error_map, grey, noise_map, page_map, partition_map, texel_map,
};
pub use metrics::{ErrorPx, Metrics, Spots, Tally, measure, measure_error_px};
pub use page::{
    FigureFile, FigureShown, FiguresPage, Page, SweepPage, comma_separated, quoted, quoted_option,
    write_figures, write_report, write_sweep,
};
pub use pictures::{Pictures, Seen, SeenTruth, write_pictures, write_truth_pictures};
pub use report::{AreaTruth, LightInfo, Measured, Motion, Report, Times, Truth, TruthKind, View};
pub use sweep::{Mean, Sweep, SweepSettings, SweptView};
pub use temporary::{TEMPORARY, TemporaryFolder, exit_without_traces, remove_abandoned};
