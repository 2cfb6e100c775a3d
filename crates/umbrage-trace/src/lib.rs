//! Ray-traced shadow truth, and a reference executor for shadow map plans, on the CPU.
//!
//! - [`Tracer`] makes a scene ready for rays.
//! - [`View`] finds the surfaces that a camera sees, and whether light reaches them: the *truth*. It
//!   shoots rays at the light itself and knows nothing of plans.
//! - [`Reference`] executes a [`Plan`](umbrage::Plan) as it would be with no error but the plan's own:
//!   each texel is a ray ([`DepthMap`]), lookups are those of [`umbrage::visibility`].
//! - [`shade`] turns samples and their visibility into pictures.
//!
//! Everything runs on all of rayon's threads, and gives the same result on any number of them.

mod boxes;
mod error;
mod reference;
mod samples;
pub mod shade;
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
