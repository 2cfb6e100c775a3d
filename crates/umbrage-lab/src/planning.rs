//! Planning of shadow maps, and the time that it takes.

use crate::error::Error;
use crate::technique::{MAX_SIDE, NamedTechnique};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::time::Instant;
use umbrage::paged::AgingLights;
use umbrage::{Aabb, Bounds, Camera, Light, Limits, Plan, Planner};
use umbrage_trace::{Ray, Tracer};

/// The largest number of times that a plan is made to measure its time.
const RUNS: usize = 7;

/// Time after which a plan is not made again to measure its time, milliseconds.
const ENOUGH_MS: f64 = 50.0;

/// Returns a planner that allows maps as large as a technique may ask for.
pub fn planner() -> Planner {
    Planner::with_limits(Limits { max_side: MAX_SIDE, ..Limits::default() })
}

/// Plans a technique for one light.
///
/// # Errors
/// An error if the planner refuses the technique, the camera or the light. It names the part of the
/// technique's text that is to blame, if any.
pub fn plan(
    technique: &NamedTechnique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<Plan, Error> {
    plan_with(&mut planner(), technique, camera, light, bounds).cloned()
}

/// Plans a technique for one light, for a picture to look at: where receivers go on beyond the
/// camera's far distance, shadows fade out before it.
///
/// # Errors
/// As for [`plan`].
pub fn plan_fading(
    technique: &NamedTechnique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<Plan, Error> {
    let mut planner = planner();
    fade(&mut planner, camera, bounds)?;
    plan_with(&mut planner, technique, camera, light, bounds).cloned()
}

/// Makes a planner's shadows fade out before a camera's far distance if receivers go on beyond it,
/// and end there without a fade if not.
///
/// # Errors
/// None in practice: both settings are valid.
pub fn fade(planner: &mut Planner, camera: &Camera, bounds: &Bounds<'_>) -> Result<(), Error> {
    let receivers = bounds.receivers.unwrap_or(Aabb::EMPTY);
    let goes_on = receivers.corners().iter().any(|&corner| camera.depth(corner) > camera.far());
    planner.set_fade(if goes_on { Planner::FADE } else { 0.0 }).map_err(Error::Planning)
}

/// Plans a technique for one light with a planner, which keeps the plan.
///
/// # Errors
/// As for [`plan`].
pub fn plan_with<'a>(
    planner: &'a mut Planner,
    technique: &NamedTechnique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<&'a Plan, Error> {
    planner.plan(camera, &[*light], bounds, technique.technique()).map_err(|e| technique.blame(e))
}

/// Plans a technique for one light, and measures how long that takes, milliseconds. A plan that
/// takes little time is made several times, and the time is their median.
///
/// # Errors
/// As for [`plan`].
pub(crate) fn timed_plan(
    technique: &NamedTechnique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<(Plan, f64), Error> {
    let mut planner = planner();
    let mut plan = Plan::default();
    let ms = median_time(|| {
        planner.forget();
        let start = Instant::now();
        let planned = plan_with(&mut planner, technique, camera, light, bounds)?;
        let ms = milliseconds(start);
        plan.clone_from(planned);
        Ok(ms)
    })?;
    Ok((plan, ms))
}

/// Makes the pages of a plan as coarse as they must be to fit into their budget, for what the
/// plan's camera sees at its pixels' centres. Does nothing for plans without such a budget.
pub fn fit_pages(plan: &mut Plan, tracer: &Tracer<'_>) {
    let Some(camera) = plan.paging.as_ref().filter(|p| p.budget.is_some()).map(|p| p.camera) else {
        return;
    };
    let seen = seen_points(tracer, &camera);
    plan.fit_pages(&seen);
}

/// Returns the world positions that a camera sees at its pixels' centres, up to its far distance.
pub fn seen_points(tracer: &Tracer<'_>, camera: &Camera) -> Vec<DVec3> {
    let [width, height] = camera.image();
    let point = |x: u32, y: u32| {
        let ray = Ray::of_view(camera, DVec2::new(f64::from(x), f64::from(y)) + 0.5);
        // The ray's parameter t is the depth.
        let hit = tracer.closest(ray, [camera.near(), camera.far()])?;
        Some(tracer.position(&hit))
    };
    let rows = (0..height).into_par_iter();
    rows.flat_map_iter(|y| (0..width).filter_map(move |x| point(x, y))).collect()
}

/// Plans a technique for lights whose pages are renewed over several frames, with a planner, which
/// keeps the plan.
///
/// # Errors
/// As for [`plan`].
pub fn plan_aging<'a>(
    planner: &'a mut Planner,
    technique: &NamedTechnique,
    camera: &Camera,
    lights: &AgingLights,
    bounds: &Bounds<'_>,
) -> Result<&'a Plan, Error> {
    let planned = planner.plan_aging(camera, lights, bounds, technique.technique());
    planned.map_err(|e| technique.blame(e))
}

/// Runs a job that returns its time in milliseconds, again and again until enough is known.
/// Returns the median time.
fn median_time(mut job: impl FnMut() -> Result<f64, Error>) -> Result<f64, Error> {
    let mut times = vec![job()?];
    while times.len() < RUNS && times.iter().sum::<f64>() < ENOUGH_MS {
        times.push(job()?);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Returns the milliseconds since `start`.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::defaults::Defaults;
    use crate::view::{ViewOptions, choose_view};

    /// The median time of a job with these times, and how often the job runs.
    fn median(times: &[f64]) -> (f64, usize) {
        let mut runs = 0;
        let job = || {
            runs += 1;
            Ok(times[(runs - 1) % times.len()])
        };
        (median_time(job).unwrap(), runs)
    }

    #[test]
    fn only_short_plans_are_made_again() {
        assert_eq!(median(&[2000.0]), (2000.0, 1));
        assert_eq!(median(&[20.0]), (20.0, 3));
        // The first run is slower, because the planner's buffers grow.
        assert_eq!(median(&[9.0, 1.0, 1.5, 1.0, 1.0, 4.0, 1.0]), (1.0, RUNS));
    }

    #[test]
    fn shadows_fade_where_the_scene_goes_on() {
        let scene = Aabb::new(DVec3::new(-50.0, 0.0, -50.0), DVec3::new(50.0, 9.0, 50.0));
        let fades = |far| {
            let view = ViewOptions { far: Some(far), ..ViewOptions::default() };
            let camera = choose_view(&view, &Defaults::of(None)).unwrap().camera;
            let light = Light::Directional { direction: DVec3::NEG_Y };
            let technique = "uniform+z2".parse().unwrap();
            let plan = plan_fading(&technique, &camera, &light, &Bounds::of_scene(scene)).unwrap();
            plan.fade.is_some()
        };
        assert_eq!([20.0, 49.0, 51.0].map(fades), [true, true, false]);
    }

    #[test]
    fn a_refused_plan_is_an_error() {
        assert!(median_time(|| Err(Error::NoMaps)).is_err());
    }
}
