//! The closed forms against independent computations: definitions differentiated numerically, dense
//! sampling, rays of parameters searched by brute force, and the planner's own matrices.

mod limits;
mod planned;
mod step;

use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};
use umbrage::theory::{
    Errors, FourierStep, LightFrom, Overhead, Rule, StepAt, Tilted, View, Warped, budget_split,
    storage_factor,
};
use umbrage::{Faces, Objective};

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
