//! Planning of shadow maps, and the time that it takes.

use crate::error::Error;
use crate::technique::{MAX_SIDE, NamedTechnique};
use std::time::Instant;
use umbrage::{Bounds, Camera, Light, Limits, Plan, Planner};

/// Returns a planner that allows maps as large as a technique may ask for.
pub fn planner() -> Planner {
    Planner::with_limits(Limits { max_side: MAX_SIDE, ..Limits::default() })
}

/// Plans a technique for one light. Returns the plan and the time that planning takes,
/// milliseconds, once the planner's buffers have grown.
///
/// # Errors
/// An error if the planner refuses the technique, the camera or the light. It names the part of the
/// technique's text that is to blame, if any.
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

/// Returns the milliseconds since `start`.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
