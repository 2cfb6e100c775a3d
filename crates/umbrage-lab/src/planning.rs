//! Plans, and how long planning takes.

use crate::error::Error;
use crate::technique::{MAX_SIDE, NamedTechnique};
use std::time::Instant;
use umbrage::{Bounds, Camera, Light, Limits, Plan, Planner};

/// A planner for whatever a technique may ask for.
pub fn planner() -> Planner {
    Planner::with_limits(Limits { max_side: MAX_SIDE, ..Limits::default() })
}

/// A technique's plan for one light, and how long planning takes, milliseconds, once buffers have
/// grown.
///
/// # Errors
/// What the planner refuses, naming the part of the technique's text that is to blame.
pub fn plan(
    technique: &NamedTechnique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<(Plan, f64), Error> {
    let mut planner = planner();
    let mut plan = || {
        let start = Instant::now();
        let plan = planner.plan(camera, &[*light], bounds, technique.technique());
        let ms = milliseconds(start);
        plan.map(|p| (p.clone(), ms)).map_err(|e| technique.blame(e))
    };
    plan()?;
    plan()
}

/// Since `start`.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
