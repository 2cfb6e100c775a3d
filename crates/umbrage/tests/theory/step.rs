//! The Fourier series of a step, by which convolution shadow maps compare.

use crate::close;
use std::f64::consts::PI;
use umbrage::theory::{FourierStep, StepAt};

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
