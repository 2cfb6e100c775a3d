//! The planner's own matrices against the closed forms.

use crate::{AREA, RULES, STORAGE, close, paper_view};
use glam::DVec3;
use umbrage::theory::{LightFrom, Rule, Tilted, View, storage_factor};
use umbrage::{Bounds, Camera, Faces, Light, Limits, LookAt, Plan, Planner, Size, Technique, Warp};

/// A square view along −z with y up, as the planner sees it.
fn camera(view: View) -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::ZERO,
        target: DVec3::NEG_Z,
        up: DVec3::Y,
        fov_y_rad: 2.0 * view.half_fov_rad(),
        near: view.near(),
        far: view.far(),
        image: [1000; 2],
    })
    .unwrap()
}

/// Light whose beams run along (0, sin θ, cos θ) in the eye's coordinates, downwards.
fn sun(theta: f64) -> Light {
    Light::Directional { direction: DVec3::new(0.0, -theta.sin(), theta.cos()) }
}

fn plan(camera: &Camera, theta: f64, technique: &Technique) -> Plan {
    let mut planner = Planner::with_limits(Limits { max_side: 65536, ..Limits::default() });
    planner.plan(camera, &[sun(theta)], &Bounds::default(), technique).unwrap().clone()
}

/// The planner's name for a rule; `None` for rules that the planner does not have.
fn planners(rule: Rule) -> Option<Warp> {
    Some(match rule {
        Rule::Uniform => Warp::Uniform,
        Rule::Psm => Warp::Psm,
        Rule::LispsmInRange => Warp::Lispsm,
        Rule::Tsm { focus } => Warp::Tsm { focus },
        Rule::Adaptive(objective) => Warp::Adaptive(objective),
        Rule::Log => Warp::Log,
        Rule::Lambda(lambda) => Warp::Lambda(lambda),
        _ => return None,
    })
}

/// Theory's errors equal those of the planner's finished matrices, for every warp and at every
/// degree.
#[test]
fn planned_maps_have_the_errors_of_the_theory() {
    let res = [700, 900];
    let to_m = res.map(|r| 500.0 / f64::from(r));
    for view in
        [paper_view(), View::new(0.2, 1.1, 0.7).unwrap(), View::new(3.0, 4000.0, 0.4).unwrap()]
    {
        let camera = camera(view);
        for (degrees, rule) in (1..=90).flat_map(|d| RULES.map(|r| (d, r))) {
            let Some(warp) = planners(rule) else { continue };
            let theta = f64::from(degrees).to_radians();
            let technique = Technique { warp, size: Size::Exact(res), ..Technique::default() };
            let plan = plan(&camera, theta, &technique);
            let map = &plan.maps[0];
            let tilted = Tilted::new(view, theta).unwrap();
            let warped = tilted.warped(map.lambda.unwrap_or(f64::INFINITY)).unwrap();
            let what = format!("{rule:?} at {degrees}° with {view:?}");
            for i in 0..=4 {
                let z = view.near() * (view.far() / view.near()).powf(f64::from(i) / 4.0);
                for side in [-1.0, -0.4, 0.0, 0.8, 1.0] {
                    let y = side * z * view.tan_phi();
                    let point = DVec3::new(0.3 * side * z, y, -z);
                    let m = map.perspective_error(&camera, point).unwrap();
                    let e = warped.errors(y, z).unwrap();
                    let p = if rule == Rule::Log { warped.log_error(y, z).unwrap() } else { e.p };
                    close(m.s, e.q * to_m[0], 1e-6, &format!("E_q of {what}, z = {z}, y = {y}"));
                    close(m.t, p * to_m[1], 1e-6, &format!("E_p of {what}, z = {z}, y = {y}"));
                }
            }
            if rule != Rule::Log {
                let extrema = warped.extrema();
                close(
                    map.error.max_s,
                    extrema.q.largest.value * to_m[0],
                    1e-6,
                    &format!("M_q of {what}"),
                );
                close(
                    map.error.max_t,
                    extrema.p.largest.value * to_m[1],
                    1e-6,
                    &format!("M_p of {what}"),
                );
                close(
                    plan.storage_factor(),
                    extrema.storage_factor(),
                    1e-6,
                    &format!("S̄ of {what}"),
                );
            }
        }
    }
}

/// The planner's λ, found by a search over matrices and corners, equals the closed form.
#[test]
fn planned_maps_have_the_lambda_of_the_theory() {
    for view in
        [paper_view(), View::new(0.2, 1.1, 0.7).unwrap(), View::new(3.0, 4000.0, 0.4).unwrap()]
    {
        let camera = camera(view);
        for (degrees, rule) in (1..=179).flat_map(|d| RULES.map(|r| (d, r))) {
            let theta = f64::from(degrees).to_radians();
            let Some(warp) = planners(rule) else { continue };
            let tilted = Tilted::new(view, theta).unwrap();
            let expected = tilted.lambda(rule).unwrap();
            // The planner limits warps that would jump, and fades them out as the view direction
            // approaches the light direction.
            let strongest = view.near() / theta.sin();
            let sides = view.half_fov_rad().sin();
            let is_the_rule = match rule {
                Rule::Tsm { .. } => theta.sin() >= sides && (strongest..1e9).contains(&expected),
                Rule::Adaptive(_) => theta.sin() >= sides / 4.0,
                _ => true,
            };
            if !is_the_rule {
                continue;
            }
            let plan = plan(&camera, theta, &Technique { warp, ..Technique::default() });
            // The comparison is in 1/λ, in which no warp is an ordinary value.
            let found = plan.maps[0].lambda.map_or(0.0, |l| tilted.mu() / l);
            let expected = tilted.mu() / expected;
            // A search finds a minimum to half the available digits only, and the planner's cost
            // slightly prefers a smaller error along the map.
            let tolerance = if matches!(rule, Rule::Adaptive(_)) { 1e-5 } else { 1e-6 };
            assert!(
                (found - expected).abs() <= tolerance * (0.1 + expected),
                "{rule:?} at {degrees}° with {view:?}: μ/λ = {found}, not {expected}"
            );
        }
    }
}

/// Storage of all kinds of partitions against W&P's Eqs. 17 to 21 and against the planner.
#[test]
fn storage_of_partitions() {
    for view in [paper_view(), View::new(0.3, 700.0, 0.9).unwrap()] {
        let camera = camera(view);
        let tan = view.tan_phi();
        let of = |rule, k, faces, light| storage_factor(view, rule, k, faces, light).unwrap();
        for k in [1, 2, 3, 5, 16] {
            let slices = f64::from(k);
            let a = (view.far() / view.near()).powf(1.0 / slices);
            let check = |found: f64, expected: f64, equation: u32| {
                close(found, expected, 1e-9, &format!("Eq. {equation}, k = {k}, {view:?}"));
            };
            for faces in [Faces::Whole, Faces::Sides, Faces::SidesAndNear] {
                let overhead = |rule| of(rule, k, faces, LightFrom::Overhead);
                check(overhead(Rule::Uniform), slices * a * (a - 1.0) / (2.0 * tan), 17);
                for rule in [Rule::Psm, Rule::Lispsm, Rule::LispsmInRange, STORAGE, AREA] {
                    check(overhead(rule), slices * (a - 1.0) / (2.0 * tan), 18);
                }
            }
            // There is nothing to warp, whatever the rule.
            for rule in
                RULES.into_iter().filter(|r| !matches!(r, Rule::Tsm { .. } | Rule::Lambda(_)))
            {
                check(of(rule, k, Faces::Whole, LightFrom::Behind), slices * a * a, 20);
            }
            let behind = |rule| of(rule, k, Faces::SidesAndNear, LightFrom::Behind);
            check(behind(Rule::Lispsm), 4.0 * slices * (a - 1.0) / 2.0 + 1.0, 21);
            check(behind(Rule::Uniform), 4.0 * slices * a * (a - 1.0) / 2.0 + 1.0, 21);

            // The planner cuts, warps, searches and measures.
            for (degrees, rule) in [0, 7, 29, 30, 44, 63, 90, 118].into_iter().flat_map(|d| {
                [Rule::Uniform, Rule::LispsmInRange, STORAGE, Rule::Lambda(3.0)].map(|r| (d, r))
            }) {
                let theta = f64::from(degrees).to_radians();
                if rule == STORAGE && theta.sin() < view.half_fov_rad().sin() / 4.0 {
                    // The planner fades out the warp at this angle.
                    continue;
                }
                let warp = planners(rule).unwrap();
                let partition = umbrage::Partition::slices(k);
                // So many texels that rounding to whole ones does not matter.
                let size = Size::Budget(1 << 32);
                let technique = Technique { warp, partition, size, ..Technique::default() };
                let planned = plan(&camera, theta, &technique).storage_factor();
                let found = of(rule, k, Faces::Whole, LightFrom::Angle(theta));
                close(found, planned, 1e-5, &format!("{rule:?} at {degrees}°, k = {k}, {view:?}"));
            }
        }
    }
}
