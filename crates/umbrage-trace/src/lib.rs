//! Ray-traced shadow truth, and a reference executor for shadow map plans, on the CPU.
//!
//! - [`Tracer`] makes a scene ready for rays.
//! - [`View`] finds the surfaces that a camera sees, and whether light reaches them: the *truth*. It
//!   shoots rays at the light itself and knows nothing of plans.
//! - [`Reference`] executes a [`Plan`](umbrage::Plan) as it would be with no error but the plan's own:
//!   each texel is a ray ([`DepthMap`]), lookups are those of [`umbrage::visibility`].
//! - [`shade`] turns samples and their visibility into pictures.
//!
//! ```
//! use umbrage::{Bounds, Camera, Light, LookAt, Options, Planner, visibility::Filter};
//! use umbrage_trace::{Reference, Tracer, View, shade};
//!
//! let scene = umbrage_scene::builtin("pole", None)?;
//! let tracer = Tracer::new(&scene)?;
//! let camera = Camera::look_at(LookAt {
//!     eye: glam::dvec3(-3.0, 3.2, 8.5),
//!     target: glam::dvec3(1.3, 0.9, 0.0),
//!     up: glam::DVec3::Y,
//!     fov_y_rad: 0.8,
//!     near: 0.5,
//!     far: 60.0,
//!     image: [64, 48],
//! })?;
//! let light = Light::Directional { direction: glam::dvec3(1.0, -1.0, 0.5) };
//! let mut planner = Planner::new();
//! let bounds = Bounds::of_scene(scene.bounds());
//! let plan = planner.plan(&camera, &[light], &bounds, &Options::default())?;
//!
//! let quietly = |_rows: u64| {};
//! let reference = Reference::render(&tracer, plan, Filter::pcf(3)?, &quietly)?;
//! let view = View::new(&tracer, camera, light, 1)?;
//! let mut pixels = Vec::new();
//! for rows in view.bands() {
//!     let band = view.band(rows, &quietly);
//!     let truth = band.map(|sample| view.truth(sample), &quietly);
//!     let visibility = band.map(|sample| reference.visibility(0, sample), &quietly);
//!     assert_eq!(truth.len(), visibility.len());
//!     pixels.extend(shade::picture(&view, &band, &visibility));
//! }
//! assert_eq!(pixels.len(), 64 * 48);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Everything runs on all of rayon's threads, and gives the same result on any number of them.

mod boxes;
mod check;
mod error;
mod placement;
mod reference;
mod samples;
pub mod shade;
mod statistics;
mod tracer;
mod triangle;

pub use error::Error;
pub use reference::{DepthMap, MapTexel, Reference};
pub use samples::{Band, Sample, View};
pub use tracer::{Hit, PrimitiveRef, Surface, Tracer};

use glam::DVec3;

/// A half-line, or a line if its range begins before zero: the points `origin + t direction`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// World space, metres.
    pub origin: DVec3,
    /// World space; any length but zero, and t counts in it.
    pub direction: DVec3,
}

/// Is told, on any thread, how many more rows are done.
pub type Progress<'a> = &'a (dyn Fn(u64) + Sync);
