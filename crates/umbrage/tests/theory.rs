//! The closed forms against independent computations: definitions differentiated numerically, dense
//! sampling, rays of parameters searched by brute force, and the planner's own matrices.

use glam::DVec3;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};
use umbrage::theory::{
    Errors, FourierStep, LightFrom, Overhead, Rule, StepAt, Tilted, View, Warped, budget_split,
    storage_factor,
};
use umbrage::{
    Bounds, Camera, Error, Faces, Light, Limits, LookAt, Objective, Plan, Planner, Size, Technique,
    Warp,
};

const STORAGE: Rule = Rule::Adaptive(Objective::Storage);
const AREA: Rule = Rule::Adaptive(Objective::Area);
const RULES: [Rule; 10] = [
    Rule::Uniform,
    Rule::Psm,
    Rule::Lispsm,
    Rule::LispsmInRange,
    Rule::Tsm { focus: None },
    Rule::Tsm { focus: Some(2.5) },
    STORAGE,
    AREA,
    Rule::Log,
    Rule::Lambda(0.7),
];

/// The view of the papers' figures.
fn paper_view() -> View {
    View::new(1.0, 100.0, FRAC_PI_6).unwrap()
}

fn warped(view: View, theta: f64, rule: Rule) -> Warped {
    let tilted = Tilted::new(view, theta).unwrap();
    tilted.warped(tilted.lambda(rule).unwrap()).unwrap()
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        found == expected || (found / expected - 1.0).abs() < tolerance,
        "{what}: {found}, not {expected}"
    );
}

/// Finite numbers of any size and sign, down to the least one that is not 0.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        2 => -10.0..10.0f64,
        1 => prop::sample::select(&[f64::MIN_POSITIVE, 1e-308, 1e-12, 1e12, f64::MAX, -f64::MAX][..]),
    ]
}

/// Views and warps at the limits of what is valid.
fn extreme_warped() -> impl Strategy<Value = Warped> {
    let end = || prop_oneof![Just(1e-12), Just(1e12), (-27.0..27.0f64).prop_map(f64::exp)];
    let phi = prop_oneof![Just(1e-6), Just(FRAC_PI_2 - 1e-6), 0.01..1.5f64];
    let lambda = prop_oneof![Just(1e-12), Just(f64::MAX), Just(f64::INFINITY), 1e-6..1e6f64];
    (end(), end(), phi, thetas(), lambda).prop_filter_map("a view", |(n, f, phi, theta, lambda)| {
        Tilted::new(View::new(n, f, phi).ok()?, theta).ok()?.warped(lambda).ok()
    })
}

/// Near planes, depth ratios from 1.001 to 1e4 and half fields of view from 2° to 80°.
fn views() -> impl Strategy<Value = View> {
    (-4.6..2.3f64, 1e-3..9.2f64, 2.0..80.0f64).prop_map(|(n, ratio, phi)| {
        View::new(n.exp(), (n + ratio).exp(), phi.to_radians()).unwrap()
    })
}

/// Angles over the whole range, including right angles and the angles of the view's own sides.
fn thetas() -> impl Strategy<Value = f64> {
    prop_oneof![6 => 0.0..=PI, 1 => Just(FRAC_PI_2), 1 => Just(0.0), 1 => 0.0..0.01f64]
}

/// Warps from far too strong to far too weak, and no warp.
fn lambdas(view: View) -> impl Strategy<Value = f64> {
    let (n, f) = (view.near(), view.far());
    prop_oneof![
        8 => ((n * 0.01).ln()..(f * 100.0).ln()).prop_map(f64::exp),
        1 => Just(f64::INFINITY),
    ]
}

fn any_warped() -> impl Strategy<Value = Warped> {
    (views(), thetas()).prop_flat_map(|(view, theta)| {
        lambdas(view)
            .prop_map(move |lambda| Tilted::new(view, theta).unwrap().warped(lambda).unwrap())
    })
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config(1000))]

    /// Theory §3.1 against dense sampling of V: no error is outside the range, and both ends are
    /// reached.
    #[test]
    fn extrema_are_those_of_a_dense_sampling(warped in any_warped()) {
        let view = warped.tilted().view();
        let extrema = warped.extrema();
        let kinds: [fn(Errors) -> f64; 3] = [|e| e.q, |e| e.p, |e| e.product()];
        let found = [extrema.q, extrema.p, extrema.product];
        const STEPS: u32 = 60;
        for (extreme, error) in found.into_iter().zip(kinds) {
            let (mut least, mut largest) = (f64::INFINITY, 0f64);
            for i in 0..=STEPS {
                let z = view.near() * (view.far() / view.near()).powf(f64::from(i) / f64::from(STEPS));
                let z = z.clamp(view.near(), view.far());
                for j in 0..=16 {
                    let y = z * view.tan_phi() * (f64::from(j) / 8.0 - 1.0);
                    let value = error(warped.errors(y, z).unwrap());
                    least = least.min(value);
                    largest = largest.max(value);
                }
            }
            let (lo, hi) = (extreme.least.value, extreme.largest.value);
            prop_assert!(lo <= least * (1.0 + 1e-9) && hi >= largest * (1.0 - 1e-9), "{lo} {least} {largest} {hi}");
            // The largest errors are at sampled corners. The smallest may lie between samples,
            // whose steps in z are 17% at most, over which a flat minimum changes by less than 3%.
            prop_assert!(hi <= largest * (1.0 + 1e-9) && lo >= least * 0.97, "{lo} {least} {largest} {hi}");
            for end in [extreme.least, extreme.largest] {
                let there = error(warped.errors(end.y, end.z).unwrap());
                prop_assert!((there / end.value - 1.0).abs() < 1e-12);
                prop_assert!(end.z >= view.near() && end.z <= view.far());
                prop_assert!(end.y.abs() <= end.z * view.tan_phi() * (1.0 + 1e-12));
            }
        }
    }

    /// No λ of a fine grid costs less than the adaptive one, at any θ.
    #[test]
    fn adaptive_is_optimal(view in views(), theta in thetas()) {
        let tilted = Tilted::new(view, theta).unwrap();
        let costs: [fn(Warped) -> f64; 2] =
            [|w| w.extrema().storage_factor(), |w| w.extrema().product.largest.value];
        for (rule, cost) in [STORAGE, AREA].into_iter().zip(costs) {
            let lambda = tilted.lambda(rule).unwrap();
            let least = cost(tilted.warped(lambda).unwrap());
            for i in 0..=600 {
                let other = view.near() * (view.far() / view.near() * 1e6).powf(f64::from(i) / 600.0) * 1e-2;
                let other = if i == 600 { f64::INFINITY } else { other };
                let found = cost(tilted.warped(other).unwrap());
                prop_assert!(least <= found * (1.0 + 1e-9), "{rule:?}: λ = {lambda}: {least}, λ = {other}: {found}");
            }
        }
    }
}

#[test]
fn storage_of_the_reference_table() {
    let view = View::new(1.0, 1000.0, FRAC_PI_6).unwrap();
    let columns = [
        ("ZP overhead", Rule::Uniform, Faces::Whole, LightFrom::Overhead),
        ("ZP+W overhead", Rule::Lispsm, Faces::Whole, LightFrom::Overhead),
        ("ZP behind", Rule::Uniform, Faces::Whole, LightFrom::Behind),
        ("FP+ZP+W behind", Rule::Lispsm, Faces::SidesAndNear, LightFrom::Behind),
    ];
    for (k, expected) in [
        (1, [865_159.0, 865.16, 1_000_000.0, 1999.0]),
        (2, [1677.3, 53.04, 2000.0, 123.49]),
        (4, [90.06, 16.02, 126.49, 37.99]),
        (8, [22.53, 9.50, 44.99, 22.94]),
        (16, [11.52, 7.48, 37.94, 18.28]),
    ] {
        for ((name, rule, faces, light), expected) in columns.into_iter().zip(expected) {
            let found = storage_factor(view, rule, k, faces, light).unwrap();
            close(found, expected, 5e-4, &format!("{name}, k = {k}"));
        }
        let log = storage_factor(view, Rule::Log, k, Faces::Whole, LightFrom::Overhead).unwrap();
        close(log, 5.982, 1e-4, "the logarithmic optimum");
    }
}

#[test]
fn optima_of_the_reference_table() {
    for (degrees, uniform, lispsm, storage, lambda, area) in [
        (90.0, 34_300.0, [343.0, 343.0], 343.0, 11.0, [343.0, 74.4]),
        (75.0, 38_400.0, [522.0, 477.0], 520.0, 12.0, [548.0, 118.0]),
        (60.0, 39_800.0, [824.0, 823.0], 764.0, 12.1, [856.0, 185.0]),
        (45.0, 38_500.0, [1_900.0, 1_900.0], 1_230.0, 11.5, [1_540.0, 332.0]),
        (31.0, 35_000.0, [6_400.0, 6_400.0], 3_520.0, 10.1, [7_800.0, 1_690.0]),
    ] {
        let costs = |rule| {
            let extrema = warped(paper_view(), f64::to_radians(degrees), rule).extrema();
            [4.0 * extrema.storage_factor(), extrema.product.largest.value]
        };
        let what = |name| format!("{name} at {degrees}°");
        for cost in costs(Rule::Uniform) {
            close(cost, uniform, 5e-3, &what("uniform"));
        }
        for (cost, expected) in costs(Rule::Lispsm).into_iter().zip(lispsm) {
            close(cost, expected, 6e-3, &what("LiSPSM as published"));
        }
        for cost in costs(STORAGE) {
            close(cost, storage, 6e-3, &what("adaptive"));
        }
        let tilted = Tilted::new(paper_view(), f64::to_radians(degrees)).unwrap();
        close(tilted.lambda(STORAGE).unwrap(), lambda, 5e-3, &what("λ*"));
        let gain = tilted.adaptive_gain(Rule::Lispsm).unwrap();
        close(gain, lispsm[0] / storage, 1e-2, &what("the gain over LiSPSM"));
        for (cost, expected) in costs(AREA).into_iter().zip(area) {
            // The reference λ came from a coarser search.
            close(cost, expected, 1.2e-2, &what("adaptive(area)"));
        }
    }
}

/// Theory's W, constructed from only the frustum's corners and the light, and its map (Eq. 12).
struct Measured {
    sin: f64,
    cos: f64,
    /// Position along W's axis of V's nearest point.
    nearest: f64,
    lambda: f64,
    mu: f64,
    tan_phi_w: f64,
    tan_phi: f64,
}

impl Measured {
    fn new(view: View, theta: f64, lambda: f64) -> Self {
        // W's axis is perpendicular to the light and on the view's forward side.
        let theta = theta.min(PI - theta);
        let (sin, cos) = theta.sin_cos();
        let along = |y: f64, z: f64| z * sin - y * cos;
        let k = view.tan_phi();
        let corners: Vec<[f64; 2]> = [view.near(), view.far()]
            .into_iter()
            .flat_map(|z| [-1.0, 1.0].map(|side| [side * z * k, z]))
            .collect();
        let depths = corners.iter().map(|&[y, z]| along(y, z));
        let nearest = depths.clone().fold(f64::INFINITY, f64::min);
        let mu = depths.fold(f64::NEG_INFINITY, f64::max) - nearest;
        let slopes = corners.iter().map(|&[y, z]| z * k / (along(y, z) - nearest + lambda));
        let tan_phi_w = slopes.fold(0.0, f64::max);
        Self { sin, cos, nearest, lambda, mu, tan_phi_w, tan_phi: k }
    }

    fn z_w(&self, y: f64, z: f64) -> f64 {
        z * self.sin - y * self.cos - self.nearest + self.lambda
    }

    /// The map's coordinates across and along its axis, without the constants 1/2 and (λ + μ)/μ,
    /// which would cost numerical differences their digits.
    fn map(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let z_w = self.z_w(y, z);
        let along = -(self.lambda + self.mu) / self.mu * (self.lambda / z_w);
        [x / (2.0 * z_w * self.tan_phi_w), along]
    }

    /// The image's coordinates (q, p).
    fn image(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        [x / (z * self.tan_phi), y / (z * self.tan_phi)]
    }
}

proptest! {
    #![proptest_config(config(4000))]

    /// E^pers·E^proj against numerical derivatives of (q, p) and Eq. 12 along a random slope, at a
    /// random point of V.
    #[test]
    fn errors_are_the_derivatives_of_the_map(
        view in views(),
        theta in 0.0..=PI,
        strength in -2.0..4.0f64,
        [x, y, z] in [-1.0..1.0f64, -1.0..1.0, 0.0..1.0],
        slope in [-2.0..2.0f64, -2.0..2.0],
    ) {
        let tilted = Tilted::new(view, theta).unwrap();
        let warped = tilted.warped(tilted.mu() * 10f64.powf(-strength)).unwrap();
        let w = Measured::new(view, theta, warped.lambda());
        prop_assert!((tilted.mu() / w.mu - 1.0).abs() < 1e-9);
        prop_assert!((warped.tan_phi_w() / w.tan_phi_w - 1.0).abs() < 1e-6);

        let z = view.near() * (view.far() / view.near()).powf(z);
        let [x, y] = [x, y].map(|u| u * z * view.tan_phi());
        let found = w.z_w(y, z);
        prop_assert!((warped.z_w(y, z) / found - 1.0).abs() < 1e-6);
        let errors = warped.errors(y, z).unwrap();
        let projection = warped.projection([x, y, z], slope).unwrap();
        // E = F (z + G)^i/z, with i = 1 for q and 2 for p.
        let from_g = z + warped.g(y);
        prop_assert!((warped.f_q() * from_g / z / errors.q - 1.0).abs() < 1e-6);
        prop_assert!((warped.f_p() * from_g * from_g / z / errors.p - 1.0).abs() < 1e-6);

        // Central differences at two steps, for Richardson's extrapolation.
        let derivative = |step: f64, of: &dyn Fn([f64; 3]) -> [f64; 2]| {
            let at = |h: f64| of([x + slope[0] * h, y + slope[1] * h, z + h]);
            let [a, b] = [at(step), at(-step)];
            [0, 1].map(|i| (a[i] - b[i]) / (2.0 * step))
        };
        let extrapolated = |of: &dyn Fn([f64; 3]) -> [f64; 2]| {
            let step = 1e-2 * z.min(found);
            let [coarse, fine] = [derivative(step, of), derivative(step / 2.0, of)];
            [0, 1].map(|i| (4.0 * fine[i] - coarse[i]) / 3.0)
        };
        let image = extrapolated(&|p| w.image(p));
        let map = extrapolated(&|p| w.map(p));
        for (i, (pers, proj)) in
            [(errors.q, projection.q), (errors.p, projection.p)].into_iter().enumerate()
        {
            let expected = (image[i] / map[i]).abs();
            // Where the slope almost runs along a beam, differences lose their digits.
            let is_blunt = (1e-2..1e2).contains(&proj);
            prop_assert!(
                !is_blunt || (pers * proj / expected - 1.0).abs() < 1e-5,
                "{i}: {pers} · {proj}, not {expected}"
            );
        }
    }

    /// At right angles Theory's E equals W&P's m in other units, for logarithmic rows too.
    #[test]
    fn overhead_is_a_right_angle(view in views(), strength in -3.0..4.0f64, z in 0.0..=1.0f64) {
        let lambda = (view.far() - view.near()) * 10f64.powf(-strength);
        for lambda in [lambda, f64::INFINITY] {
            let overhead = Overhead::new(view, lambda).unwrap();
            let warped = Tilted::new(view, FRAC_PI_2).unwrap().warped(lambda).unwrap();
            let z = (view.near() * (view.far() / view.near()).powf(z)).clamp(view.near(), view.far());
            let errors = warped.errors(0.1 * z, z).unwrap();
            let extrema = warped.extrema();
            for (m, e) in [
                (overhead.m_s(z).unwrap(), errors.q),
                (overhead.m_t(z).unwrap(), errors.p),
                (overhead.max_s(), extrema.q.largest.value),
                (overhead.max_t(), extrema.p.largest.value),
            ] {
                prop_assert!((m * 2.0 / e - 1.0).abs() < 1e-9, "{m} {e}");
            }
            prop_assert!((overhead.storage_factor() / extrema.storage_factor() - 1.0).abs() < 1e-9);
            prop_assert!((overhead.best_depth() / extrema.p.least.z - 1.0).abs() < 1e-9);
        }
        let log = Tilted::new(view, FRAC_PI_2).unwrap().warped(view.near()).unwrap();
        let z = view.near().midpoint(view.far());
        prop_assert!((log.log_error(0.3 * z, z).unwrap() / view.log_error() / 2.0 - 1.0).abs() < 1e-9);
    }

    /// W&P Eqs. 7 and 8 against numerical derivatives of their parameterization (Eqs. 5, 6), and,
    /// in the papers' range of λ, against their printed forms 10 and 12.
    #[test]
    fn overhead_errors_are_the_derivatives_of_the_map(view in views(), z in 0.0..1.0f64, eta in -0.98..1.0f64) {
        let (n, f, k) = (view.near(), view.far(), view.tan_phi());
        let lambda = view.lambda_from_eta(eta).unwrap();
        let overhead = Overhead::new(view, lambda).unwrap();
        let z = (n * (f / n).powf(z)).clamp(n, f);
        let f_w = lambda + f - n;
        let z_w = |z: f64| lambda + z - n;
        let t = |z: f64| f_w / (f_w - lambda) * (1.0 - lambda / z_w(z));
        let s = |x: f64| x / (2.0 * z_w(z) * (f / f_w) * k);
        let pixel = 2.0 * z * k;
        let step = 3e-4 * z;
        let (dx_ds, dz_dt) = (2.0 * step / (s(step) - s(-step)), 2.0 * step / (t(z + step) - t(z - step)));
        prop_assert!((overhead.m_s(z).unwrap() * pixel / dx_ds - 1.0).abs() < 1e-6);
        prop_assert!((overhead.m_t(z).unwrap() * pixel / dz_dt - 1.0).abs() < 1e-6);

        let is_strong = lambda <= view.lambda_l();
        let range = (f - n) / (2.0 * k);
        let max_t = range * if is_strong { f_w / (lambda * f) } else { lambda / (n * f_w) };
        let storage = range / n * if is_strong { 1.0 } else { lambda * lambda * f / (n * f_w * f_w) };
        prop_assert!((overhead.max_t() / max_t - 1.0).abs() < 1e-9);
        prop_assert!((overhead.storage_factor() / storage - 1.0).abs() < 1e-9);
        prop_assert!((overhead.max_s() / (f * lambda / (n * f_w)) - 1.0).abs() < 1e-9);

        // On either side of 0, η is linear in M_t between its least and its largest value
        // (Appendix B).
        let max_t = |lambda| Overhead::new(view, lambda).unwrap().max_t();
        let least = max_t(view.lambda_l());
        let end = if eta < 0.0 { f64::INFINITY } else { n };
        let share = (max_t(lambda) - least) / (max_t(end) - least);
        // If f/n is about 1, hardly anything changes between η = 0 and ±1.
        let digits = 1e-9 / (max_t(end) / least - 1.0);
        prop_assert!((share - eta.abs()).abs() < 1e-9 + digits, "{share} {eta}");
        prop_assert!((view.eta_from_lambda(lambda).unwrap() - eta).abs() < 1e-9 + digits);
    }
}

/// The papers' misprints as printed: each differs by what the formula's documentation says.
#[test]
fn printed_forms_fail() {
    let (f, phi) = (100.0, FRAC_PI_6);
    let lambda = 11.0;
    let at = |degrees: f64| Tilted::new(paper_view(), degrees.to_radians()).unwrap();
    for (degrees, q_off, p_off) in
        [(90.0, 1.0, 1.0), (60.0, 0.54, 1.155), (30.0, 1.0, 2.0), (20.0, 1.0, 1.84)]
    {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let tilted = at(degrees);
        let warped = tilted.warped(lambda).unwrap();
        let (mu, k) = (tilted.mu(), f64::tan(phi));
        // Zhang et al., appendix. At θ = φ both branches of tan φ_w apply; of F_p the second
        // branch is evaluated as printed.
        let (tan_phi_w, f_p) = if degrees > 30.0 {
            (f * k / (mu + lambda), sin * sin * (mu / sin) / (k * lambda * (lambda + mu)))
        } else {
            (f * k / lambda, 2.0 * f * sin * sin / (k * lambda * (lambda + 2.0 * f * k * cos)))
        };
        close(tan_phi_w / warped.tan_phi_w(), q_off, 1e-2, &format!("tan φ_w at {degrees}°"));
        close(f_p / warped.f_p(), p_off, 2e-3, &format!("F_p at {degrees}°"));
        // With the printed form, V's far upper corner lies outside the map.
        let corner = f * k / (warped.z_w(f * k, f) * tan_phi_w);
        assert_eq!(corner > 1.0 + 1e-9, degrees == 60.0, "{degrees}°: {corner}");
    }
    // §3.1 places all minima at z = f.
    for (degrees, depth) in [(90.0, 10.0), (60.0, 18.05)] {
        let least = at(degrees).warped(lambda).unwrap().extrema().p.least;
        close(least.z, depth, 1e-3, &format!("least E_p at {degrees}°"));
        let far = at(degrees).warped(lambda).unwrap().errors(f * phi.tan(), f).unwrap();
        assert!(far.p > 1.9 * least.value, "{degrees}°: {} {}", far.p, least.value);
    }
    // Lloyd et al. Eq. 9 lacks a factor 1/n.
    let view = View::new(2.0, 200.0, phi).unwrap();
    let printed = 200.0 * 30.0 / (30.0 + 200.0 - 2.0);
    close(printed / Overhead::new(view, 30.0).unwrap().max_s(), 2.0, 1e-9, "M_s as printed");
    // Annen et al. Eq. 11 expands the step of d − z, which is 1 in the shadow.
    let step = FourierStep::new(8, 0.0).unwrap();
    let lit = step.visibility(0.2, 0.6, StepAt::default()).unwrap();
    assert!(lit > 0.9 && step.series(0.2 - 0.6) < 0.1);
}

/// λ smaller than n: V's near corners lie outside the W of the papers' tan φ_w, and errors across
/// the map are largest at the far plane.
#[test]
fn short_lambdas_keep_the_near_corners() {
    let (n, f) = (1.0, 100.0);
    for lambda in [0.05, 0.3, 0.99] {
        let overhead = Overhead::new(paper_view(), lambda).unwrap();
        let far_corners_only = f / (lambda + f - n);
        assert!(n / lambda > far_corners_only);
        close(overhead.max_s(), overhead.m_s(f).unwrap(), 1e-12, "M_s is at z = f");
        let warped = warped(paper_view(), FRAC_PI_2, Rule::Lambda(lambda));
        assert_eq!(warped.extrema().q.largest.z, f);
        assert_eq!(warped.extrema().q.least.z, n);
        close(warped.tan_phi_w(), n * FRAC_PI_6.tan() / lambda, 1e-12, "tan φ_w");
    }
}

#[test]
fn lambdas_by_technique() {
    let tilted = |degrees: f64| Tilted::new(paper_view(), degrees.to_radians()).unwrap();
    let lambda = |degrees, rule| tilted(degrees).lambda(rule).unwrap();
    for (rule, overhead) in [
        (Rule::Uniform, f64::INFINITY),
        (Rule::Psm, 1.0),
        (Rule::Lispsm, 11.0),
        (Rule::LispsmInRange, 11.0),
        // δ = √(n f) − n of μ = f − n, and δ = 19 − n.
        (Rule::Tsm { focus: None }, 99.0 * 9.0 * 0.2 / (0.8 * 99.0 - 9.0)),
        (Rule::Tsm { focus: Some(19.0) }, 99.0 * 18.0 * 0.2 / (0.8 * 99.0 - 18.0)),
        // A focus in front of the view, and a focus beyond 80% of it.
        (Rule::Tsm { focus: Some(0.5) }, f64::INFINITY),
        (Rule::Tsm { focus: Some(80.2) }, f64::INFINITY),
        (STORAGE, 11.0),
        (Rule::Log, 1.0),
        (Rule::Lambda(7.0), 7.0),
        (Rule::Lambda(f64::INFINITY), f64::INFINITY),
    ] {
        close(lambda(90.0, rule), overhead, 1e-9, &format!("{rule:?} overhead"));
    }
    close(lambda(60.0, Rule::Lispsm), 11.0 / 60f64.to_radians().sin(), 1e-12, "LiSPSM at 60°");
    close(lambda(60.0, Rule::LispsmInRange), lambda(60.0, Rule::Lispsm), 1e-12, "in range at 60°");
    // At 20° μ sin θ is 37.1 of the view's 99 metres.
    let sin = 20f64.to_radians().sin();
    let range = 2.0 * 100.0 * FRAC_PI_6.tan() * 20f64.to_radians().cos() * sin;
    close(lambda(20.0, Rule::LispsmInRange), (1.0 + (1.0 + range).sqrt()) / sin, 1e-12, "at 20°");
    assert!(range < 40.0);
    for rule in [Rule::Psm, Rule::Lispsm, Rule::LispsmInRange, STORAGE, AREA, Rule::Log] {
        assert_eq!(lambda(0.0, rule), f64::INFINITY, "{rule:?}: light along the view");
        // The beams are the same in both directions of the light.
        close(lambda(140.0, rule), lambda(40.0, rule), 1e-12, &format!("{rule:?} at 140°"));
    }
    // λ_L gives equal errors along the map at both ends, and no other λ has a smaller M_t.
    let max_t = |lambda| Overhead::new(paper_view(), lambda).unwrap().max_t();
    let at_l = Overhead::new(paper_view(), paper_view().lambda_l()).unwrap();
    close(at_l.m_t(1.0).unwrap(), at_l.m_t(100.0).unwrap(), 1e-12, "λ_L");
    assert!((1..4000).all(|i| max_t(f64::from(i) * 0.05) >= at_l.max_t() * (1.0 - 1e-12)));
}

proptest! {
    #![proptest_config(config(2000))]

    /// By Eq. 12 the focus lies at 80% of the map.
    #[test]
    fn tsm_gives_the_focus_its_rows(view in views(), theta in thetas(), z in 0.0..1.0f64) {
        let focus = view.near() * (view.far() / view.near()).powf(z);
        let tilted = Tilted::new(view, theta).unwrap();
        let lambda = tilted.lambda(Rule::Tsm { focus: Some(focus) }).unwrap();
        let w = Measured::new(view, theta, lambda);
        let delta = w.z_w(0.0, focus) - lambda;
        if lambda.is_finite() {
            let row = w.map([0.0, 0.0, focus])[1] + (lambda + w.mu) / w.mu;
            prop_assert!((row - 0.8).abs() < 1e-6, "{row}");
        } else {
            let delta = if delta.is_nan() { Measured::new(view, theta, 1.0).z_w(0.0, focus) - 1.0 } else { delta };
            prop_assert!(delta < 1e-9 * w.mu || delta > (0.8 - 1e-9) * w.mu, "{delta} of {}", w.mu);
        }
    }

    /// λ* for views deeper than 9 : 1 and light outside the view's own sides gives equal errors at
    /// both corners.
    #[test]
    fn storage_of_deep_views(view in views(), theta in 0.0..=1.0f64) {
        let (n, f, phi) = (view.near(), view.far(), view.half_fov_rad());
        prop_assume!(f > 9.0 * n);
        let theta = phi + (FRAC_PI_2 - phi) * theta;
        let tilted = Tilted::new(view, theta).unwrap();
        let lambda = tilted.lambda(STORAGE).unwrap();
        let root = (n * f).sqrt();
        let expected = (tilted.mu() - 2.0 * root * phi.tan() * theta.cos()) / ((f / n).sqrt() - 1.0);
        prop_assert!((lambda / expected - 1.0).abs() < 1e-9, "{lambda} {expected}");
        let lower = |z: f64| tilted.warped(lambda).unwrap().errors(-z * phi.tan(), z).unwrap().p;
        prop_assert!((lower(n) / lower(f) - 1.0).abs() < 1e-9);
    }

    /// The adaptive warp never needs more texels than another one, and changes smoothly with θ,
    /// also at θ = φ.
    #[test]
    fn adaptive_gains_everywhere(view in views(), theta in thetas()) {
        let tilted = Tilted::new(view, theta).unwrap();
        for rule in RULES.into_iter().filter(|r| *r != Rule::Log) {
            let gain = tilted.adaptive_gain(rule).unwrap();
            prop_assert!(gain >= 1.0 - 1e-9 && gain.is_finite(), "{rule:?}: {gain}");
        }
        let phi = view.half_fov_rad();
        let strength = |theta| {
            let tilted = Tilted::new(view, theta).unwrap();
            tilted.mu() / tilted.lambda(STORAGE).unwrap()
        };
        let [below, above] = [phi - 1e-12, phi].map(strength);
        prop_assert!((below - above).abs() <= 1e-6 * (1.0 + above), "{below} {above}");
    }
}

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

#[test]
fn budgets_are_split_for_equal_errors() {
    let overhead = Overhead::new(paper_view(), 20.0).unwrap();
    let critical = overhead.critical_resolution(1000.0);
    let [s, t] = budget_split(critical, 1e6).unwrap();
    close(s * t, 1e6, 1e-12, "the budget");
    let scale = [1000.0 / s * overhead.max_s(), 1000.0 / t * overhead.max_t()];
    close(scale[0], scale[1], 1e-12, "the largest errors");
    close(critical[0] * critical[1], 1e6 * overhead.storage_factor(), 1e-12, "S̄ res_i²");
}

/// Coefficients of the series by quadrature of the step of period 2, which is 1 (lit) for 0 < z −
/// d < 1 and otherwise 0.
#[test]
fn the_step_is_a_fourier_series() {
    let step = FourierStep::new(16, 0.7).unwrap();
    const POINTS: u32 = 20_000;
    let samples: Vec<[f64; 3]> = (0..POINTS)
        .map(|i| 2.0 * (f64::from(i) + 0.5) / f64::from(POINTS) - 1.0)
        .map(|x| [x, step.series(x), f64::from(u8::from(x > 0.0))])
        .collect();
    // Integrals over one period of the series and of the step, each times a wave.
    let integrals = |wave: &dyn Fn(f64) -> f64| {
        [1, 2].map(|i| {
            samples.iter().map(|s| s[i] * wave(s[0])).sum::<f64>() * 2.0 / f64::from(POINTS)
        })
    };
    let [mean, expected] = integrals(&|_| 0.5);
    close(mean, expected, 1e-9, "mean");
    for j in 1..=40 {
        let wave = PI * f64::from(j);
        let [cosine, _] = integrals(&|x| (wave * x).cos());
        let [sine, of_step] = integrals(&|x| (wave * x).sin());
        let k = f64::from(j + 1) / 2.0;
        let is_kept = j % 2 == 1 && k <= 16.0;
        let expected = if is_kept { of_step * (-0.7 * (k / 16.0).powi(2)).exp() } else { 0.0 };
        // The midpoint rule across a step is accurate to (wave/points)².
        assert!((sine - expected).abs() < 1e-5, "sine {j}: {sine}, not {expected}");
        assert!(cosine.abs() < 1e-9, "cosine {j}: {cosine}");
    }
}

#[test]
fn steps_of_the_reference_table() {
    let at = StepAt::default();
    for (order, values, offset, peak) in [
        (1, None, 0.2876, 1.137),
        (2, None, 0.1507, 1.100),
        (4, Some([0.9895, 0.8670, 0.5797, 0.5]), 0.0764, 1.092),
        (8, None, 0.0383, 1.090),
        (16, Some([0.9941, 0.9916, 0.8026, 0.5]), 0.0192, 1.0897),
    ] {
        let step = FourierStep::new(order, 0.0).unwrap();
        for (d, expected) in [0.3, 0.45, 0.49, 0.5].into_iter().zip(values.into_iter().flatten()) {
            let found = step.visibility(d, 0.5, at).unwrap();
            assert!((found - expected).abs() < 6e-5, "M = {order}, d = {d}: {found}");
        }
        // The reference's fourth digit came from samples.
        assert!((step.offset() - offset).abs() < 1e-4, "o_{order} = {}", step.offset());
        close(step.series(0.5 / f64::from(order)), peak, 5e-4, "the first peak");
    }
}

#[test]
fn offsets_light_what_is_lit() {
    for (order, attenuation) in [
        (1, 0.0),
        (4, 0.0),
        (16, 0.0),
        (64, 0.0),
        (1, 0.2),
        (4, 0.5),
        (8, 1.0),
        (16, 1.0),
        (256, 0.1),
    ] {
        let step = FourierStep::new(order, attenuation).unwrap();
        let offset = step.offset();
        assert!((0.0..=0.5).contains(&offset), "o_{order} = {offset}");
        // The series does not reach 1 before the offset.
        let before = (0..2000).map(|i| step.series(offset * f64::from(i) / 2000.0));
        assert!(before.fold(0.0, f64::max) < 1.0, "M = {order}, α = {attenuation}");
        let surface = |at| step.visibility(0.4, 0.4, at).unwrap();
        close(
            surface(StepAt { offset: true, scale: false }),
            1.0,
            1e-9,
            &format!("o_{order}, α = {attenuation}"),
        );
        close(surface(StepAt { offset: false, scale: true }), 1.0, 1e-12, "a lit surface, scaled");
        close(surface(StepAt::default()), 0.5, 1e-12, "a lit surface");
    }
    // With too much attenuation, the offset is near the contact, and the series there is as light
    // as it gets up to an invisible difference.
    for (order, attenuation) in [(1, 1.0), (2, 3.0), (8, 30.0), (16, 2.0)] {
        let step = FourierStep::new(order, attenuation).unwrap();
        let offset = step.offset();
        let highest = (0..=4000).map(|i| step.series(f64::from(i) / 8000.0)).fold(0.0, f64::max);
        assert!(highest < 1.0);
        assert!(
            (step.series(offset) - (highest - 1.0 / 510.0)).abs() < 1e-6,
            "o_{order} = {offset}"
        );
        let before = (0..2000).map(|i| step.series(offset * f64::from(i) / 2000.0));
        assert!(before.fold(0.0, f64::max) < step.series(offset));
    }
}

#[test]
fn what_makes_no_sense_is_refused_by_name() {
    let field = |result: Result<(), Error>| match result.unwrap_err() {
        Error::Invalid { field, .. } => field,
        other => panic!("{other}"),
    };
    let view = |n, f, phi| field(View::new(n, f, phi).map(drop));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(view(bad, 100.0, 0.5), "theory.near", "{bad}");
    }
    for bad in [1.0, 0.5, f64::NAN, f64::INFINITY, 1e13] {
        assert_eq!(view(1.0, bad, 0.5), "theory.far", "{bad}");
    }
    for bad in [0.0, -0.5, FRAC_PI_2, 30.0, f64::NAN] {
        assert_eq!(view(1.0, 100.0, bad), "theory.half_fov_rad", "{bad}");
    }
    let view = paper_view();
    let tilted = Tilted::new(view, 1.0).unwrap();
    for bad in [-0.1, PI + 1e-9, f64::NAN, f64::INFINITY] {
        assert_eq!(field(Tilted::new(view, bad).map(drop)), "theory.theta_rad", "{bad}");
    }
    for bad in [0.0, -3.0, 1e-13, f64::NAN, f64::NEG_INFINITY] {
        assert_eq!(field(tilted.warped(bad).map(drop)), "theory.lambda", "{bad}");
        assert_eq!(field(Overhead::new(view, bad).map(drop)), "theory.lambda", "{bad}");
        assert_eq!(field(tilted.lambda(Rule::Lambda(bad)).map(drop)), "theory.lambda", "{bad}");
    }
    for bad in [0.0, -3.0, f64::NAN, f64::INFINITY] {
        let rule = Rule::Tsm { focus: Some(bad) };
        assert_eq!(field(tilted.lambda(rule).map(drop)), "theory.focus", "{bad}");
    }
    let warped = tilted.warped(2.0).unwrap();
    // Points behind the eye, and behind W's centre of projection.
    for [y, z] in [[0.0, 0.0], [0.0, -1.0], [f64::NAN, 5.0], [0.0, f64::INFINITY], [30.0, 5.0]] {
        assert_eq!(field(warped.errors(y, z).map(drop)), "theory.point", "{y} {z}");
        assert_eq!(field(warped.log_error(y, z).map(drop)), "theory.point", "{y} {z}");
        assert_eq!(field(warped.projection([0.0, y, z], [0.0; 2]).map(drop)), "theory.point");
    }
    let point = [0.0, 0.0, 5.0];
    let nan_x = warped.projection([f64::NAN, 0.0, 5.0], [0.0; 2]);
    assert_eq!(field(nan_x.map(drop)), "theory.point");
    for slope in [[f64::NAN, 0.0], [0.0, f64::INFINITY]] {
        assert_eq!(field(warped.projection(point, slope).map(drop)), "theory.slope", "{slope:?}");
    }
    // On the axis and along it neither the image nor the map moves sideways, but E_q has a limit.
    // Beside the axis only the map does not move.
    let unwarped = Tilted::new(view, 0.0).unwrap().warped(f64::INFINITY).unwrap();
    assert_eq!(unwarped.projection(point, [0.0, 0.5]).unwrap().q, 1.0);
    assert_eq!(unwarped.projection([1.0, 0.0, 5.0], [0.0, 0.5]).unwrap().q, f64::INFINITY);
    let along_both = unwarped.projection([0.0, 0.0, 5.0], [0.0, 0.0]);
    assert_eq!(field(along_both.map(drop)), "theory.slope");
    // Along the light alone the error is unbounded, but not NaN.
    let along_light = 1.0 / f64::tan(PI / 4.0);
    let edge_on = Tilted::new(view, PI / 4.0).unwrap().warped(2.0).unwrap();
    assert!(edge_on.projection([0.1, -1.0, 5.0], [0.3, along_light]).unwrap().p > 1e12);

    let overhead = Overhead::new(view, 5.0).unwrap();
    for bad in [0.5, 101.0, f64::NAN] {
        assert_eq!(field(overhead.m_s(bad).map(drop)), "theory.z", "{bad}");
        assert_eq!(field(overhead.m_t(bad).map(drop)), "theory.z", "{bad}");
    }
    for bad in [-1.1, 1.1, f64::NAN] {
        assert_eq!(field(view.lambda_from_eta(bad).map(drop)), "theory.eta", "{bad}");
    }
    for bad in [0.9, -2.0, f64::NAN] {
        assert_eq!(field(view.eta_from_lambda(bad).map(drop)), "theory.lambda", "{bad}");
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(field(budget_split([bad, 1.0], 1.0).map(drop)), "theory.critical_resolution");
        assert_eq!(field(budget_split([1.0, 1.0], bad).map(drop)), "theory.texels");
    }
    let storage = |k, faces, light| field(storage_factor(view, STORAGE, k, faces, light).map(drop));
    assert_eq!(storage(0, Faces::Whole, LightFrom::Overhead), "theory.slices");
    assert_eq!(storage(17, Faces::Whole, LightFrom::Overhead), "theory.slices");
    assert_eq!(storage(1, Faces::Sides, LightFrom::Behind), "theory.faces");
    assert_eq!(storage(1, Faces::SidesAndNear, LightFrom::Angle(1.0)), "theory.faces");
    assert_eq!(storage(1, Faces::Whole, LightFrom::Angle(4.0)), "theory.theta_rad");
    // Slices without depth are errors.
    let thin = View::new(1.0, 1.0 + 4e-16, 0.5).unwrap();
    let cut = storage_factor(thin, Rule::Uniform, 16, Faces::Whole, LightFrom::Overhead);
    assert_eq!(field(cut.map(drop)), "theory.slices");
    assert_eq!(field(tilted.adaptive_gain(Rule::Log).map(drop)), "theory.rule");

    for (order, attenuation, name) in [
        (0, 0.0, "theory.order"),
        (1025, 0.0, "theory.order"),
        (4, -0.1, "theory.attenuation"),
        (4, f64::NAN, "theory.attenuation"),
        (4, f64::INFINITY, "theory.attenuation"),
    ] {
        assert_eq!(field(FourierStep::new(order, attenuation).map(drop)), name);
    }
    let step = FourierStep::new(4, 0.0).unwrap();
    for ([d, z], name) in [
        ([-0.1, 0.5], "theory.receiver"),
        ([f64::NAN, 0.5], "theory.receiver"),
        ([0.5, 1.1], "theory.occluder"),
        ([1.0, 0.0], "theory.receiver"),
        ([0.0, 1.0], "theory.receiver"),
    ] {
        assert_eq!(field(step.visibility(d, z, StepAt::default()).map(drop)), name, "{d} {z}");
    }
}

/// At the ends of the valid ranges no result is NaN, and errors stay positive.
#[test]
fn extreme_situations_stay_numbers() {
    let ends = [[1e-12, 1e12], [1e-12, 2e-12], [1e11, 1e12], [1.0, 1.0 + 1e-15]];
    for ([near, far], phi) in
        ends.into_iter().flat_map(|e| [1e-6, 0.5, FRAC_PI_2 - 1e-6].map(|p| (e, p)))
    {
        let view = View::new(near, far, phi).unwrap();
        for theta in [0.0, 1e-300, 1e-9, phi, FRAC_PI_2 - 1e-12, FRAC_PI_2, PI] {
            let tilted = Tilted::new(view, theta).unwrap();
            let what = format!("{view:?}, θ = {theta}");
            assert!(tilted.mu() > 0.0, "{what}");
            for rule in RULES {
                // A focus or a λ in metres may be disproportionate to the view.
                let lambda = tilted.lambda(rule).unwrap();
                assert!(lambda > 0.0, "{what}, {rule:?}: λ = {lambda}");
                let Ok(warped) = tilted.warped(lambda) else {
                    assert!(lambda < 1e-12, "{what}, {rule:?}: λ = {lambda}");
                    continue;
                };
                let extrema = warped.extrema();
                for e in [extrema.q, extrema.p, extrema.product] {
                    assert!(e.least.value > 0.0, "{what}, {rule:?}: {e:?}");
                    assert!(e.largest.value.is_finite(), "{what}, {rule:?}: {e:?}");
                    // At 1e12 about this many of 16 digits remain.
                    assert!(
                        e.least.value <= e.largest.value * (1.0 + 1e-3),
                        "{what}, {rule:?}: {e:?}"
                    );
                }
                let numbers = [warped.tan_phi_w(), warped.f_q(), warped.f_p(), warped.g(0.0)];
                assert!(numbers.iter().all(|x| *x >= 0.0 || x.is_finite()), "{what}: {numbers:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// What is `Ok` is finite, however extreme the numbers are. (No warp is an infinite λ, and a
    /// surface along the light has an infinite projection error.)
    #[test]
    fn results_are_finite_or_errors(
        warped in extreme_warped(),
        numbers in prop::array::uniform5(any_number()),
        rule in prop::sample::select(&RULES[..]),
        slices in 1u32..=16,
    ) {
        let [a, b, c, d, e] = numbers;
        let tilted = warped.tilted();
        let view = tilted.view();
        let finite = |what: &str, result: Result<Vec<f64>, Error>| match result {
            Ok(values) if values.iter().all(|x| x.is_finite()) => Ok(()),
            Ok(values) => Err(TestCaseError::fail(format!("{what}: {values:?}"))),
            Err(Error::Invalid { field, .. }) if field.starts_with("theory.") => Ok(()),
            Err(error) => Err(TestCaseError::fail(format!("{what}: {error}"))),
        };
        let not_nan = |what: &str, result: Result<Vec<f64>, Error>| {
            let infinite_counts = result.map(|r| r.into_iter().map(|x| if x == f64::INFINITY { 1.0 } else { x }).collect());
            finite(what, infinite_counts)
        };
        let both = |e: Errors| vec![e.q, e.p];
        for z in [b.abs(), view.near(), view.far()] {
            finite("errors", warped.errors(a, z).map(both))?;
            finite("log_error", warped.log_error(a, z).map(|x| vec![x]))?;
            not_nan("projection", warped.projection([c, a, z], [d, e]).map(both))?;
            let overhead = Overhead::new(view, warped.lambda()).unwrap();
            finite("m_s", overhead.m_s(z).map(|x| vec![x]))?;
            finite("m_t", overhead.m_t(z).map(|x| vec![x]))?;
            finite("storage", Ok(vec![overhead.storage_factor()]))?;
        }
        let extrema = warped.extrema();
        for range in [extrema.q, extrema.p, extrema.product] {
            finite("extrema", Ok(vec![range.least.value, range.largest.value]))?;
        }
        for rule in [rule, Rule::Tsm { focus: Some(a.abs()) }, Rule::Lambda(b.abs())] {
            not_nan("lambda", tilted.lambda(rule).map(|x| vec![x]))?;
            finite("gain", tilted.adaptive_gain(rule).map(|x| vec![x]))?;
            for (faces, light) in [
                (Faces::Whole, LightFrom::Overhead),
                (Faces::Whole, LightFrom::Angle(tilted.theta_rad())),
                (Faces::SidesAndNear, LightFrom::Behind),
            ] {
                let storage = storage_factor(view, rule, slices, faces, light);
                finite("storage_factor", storage.map(|x| vec![x]))?;
            }
        }
        finite("slice", view.slice(slices / 2, slices).map(|v| vec![v.near(), v.far()]))?;
        not_nan("lambda_from_eta", view.lambda_from_eta(c).map(|x| vec![x]))?;
        finite("eta_from_lambda", view.eta_from_lambda(d).map(|x| vec![x]))?;
        let split = budget_split([a.abs(), b.abs()], c.abs());
        finite("budget_split", split.map(|sides| sides.to_vec()))?;
    }

    /// The same for the series of convolution shadow maps, which takes longer.
    #[test]
    fn steps_are_finite_or_errors(
        order in 1u32..=8,
        numbers in prop::array::uniform3(any_number()),
        depths in prop::array::uniform2(0.0..=1.0f64),
        offset: bool,
        scale: bool,
    ) {
        let Ok(step) = FourierStep::new(order, numbers[0]) else { return Ok(()) };
        for [receiver, occluder] in [depths, [numbers[1], numbers[2]], [depths[0], numbers[1]]] {
            if let Ok(v) = step.visibility(receiver, occluder, StepAt { offset, scale }) {
                prop_assert!((0.0..=1.0).contains(&v), "{}", v);
            }
        }
        prop_assert!(step.offset().is_finite());
    }
}
