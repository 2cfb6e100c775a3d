//! Ray-traced shadow truth, and a reference executor for shadow map plans, on the CPU.
//!
//! - [`Tracer`] prepares a scene for ray tracing.
//! - [`View`] finds the surfaces that a camera sees, and whether light reaches them: the *truth*.
//!   It traces rays to the light itself and does not use plans.
//! - [`AreaLight`] is the same for a light with a size, whose shadows are soft.
//! - [`Reference`] executes a [`Plan`](umbrage::Plan) without adding errors to the plan's own: each
//!   texel's depth comes from a ray ([`DepthMap`]), and [`umbrage::visibility`] does the lookups.
//! - [`shade`] turns samples and their visibility into pictures.
//!
//! ```
//! use umbrage::{Bounds, Camera, Light, LookAt, Planner, Technique, visibility::Filter};
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
//! let technique = Technique { filter: Filter::pcf(3)?, ..Technique::default() };
//! let plan = planner.plan(&camera, &[light], &bounds, &technique)?;
//!
//! let quietly = |_rows: u64| {};
//! let reference = Reference::render(&tracer, plan, &quietly)?;
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
//! All work is shared by the threads of rayon's current pool. The results do not depend on how many
//! threads there are.

mod area;
mod boxes;
mod check;
mod error;
mod filled;
mod placement;
mod plane;
mod reference;
mod samples;
pub mod shade;
mod statistics;
mod tracer;
mod triangle;

pub use area::{AreaLight, AreaVisibility};
pub use error::Error;
pub use filled::PixelMemory;
pub use reference::{DepthMap, MapTexel, Reference};
pub use samples::{Band, Sample, View};
pub use tracer::{Hit, PrimitiveRef, Surface, Tracer};

use glam::{DVec2, DVec3};
use umbrage::Camera;

/// A ray: the points `origin + t direction` for all t in a range that each query states. A range
/// that begins below zero extends the ray behind its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin in world space, metres.
    pub origin: DVec3,
    /// Direction in world space, of any length but zero. The parameter t counts lengths of
    /// `direction`.
    pub direction: DVec3,
}

impl Ray {
    /// The line of sight through a point of the picture, given in pixels as for [`Camera::ray`].
    /// The parameter t is the depth.
    pub fn of_view(camera: &Camera, pixel: DVec2) -> Self {
        let sight = camera.ray(pixel);
        Self { origin: camera.eye() + sight.start, direction: sight.direction }
    }

    /// The point at a parameter, world space.
    pub(crate) fn at(self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

/// A callback that is told how many more rows are done. Any thread may call it.
pub type Progress<'a> = &'a (dyn Fn(u64) + Sync);
