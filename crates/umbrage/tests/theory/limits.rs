//! What makes no sense, and what is at the limits of what does.

use crate::{RULES, STORAGE, paper_view, thetas};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use umbrage::theory::{
    Errors, FourierStep, LightFrom, Overhead, Rule, StepAt, Tilted, View, Warped, budget_split,
    storage_factor,
};
use umbrage::{Error, Faces};

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
