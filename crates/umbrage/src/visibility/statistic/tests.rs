use super::*;
use crate::theory::FourierStep;

fn all() -> Vec<Statistic> {
    let csm = |m| Statistic::Csm(Csm::new(m, 0.0, true, false).unwrap());
    vec![
        Statistic::Vsm(Vsm::default()),
        Statistic::Esm(Esm::default()),
        Statistic::Evsm(Evsm::default()),
        Statistic::Evsm(Evsm { components: 2, ..Evsm::default() }),
        Statistic::Msm(Msm::default()),
        csm(1),
        csm(4),
        csm(7),
        csm(16),
        Statistic::Csm(Csm::new(8, 1.0, false, true).unwrap().in_16_bits()),
    ]
}

/// The mean channels of several depths, each rounded to the format it is stored in.
fn mean(statistic: &Statistic, depths: &[f32]) -> Channels {
    let mut mean = [0f64; MAX_CHANNELS];
    for &depth in depths {
        let stored = statistic.encode(depth).map(|c| statistic.storage().stored(c));
        mean.iter_mut().zip(stored).for_each(|(m, c)| *m += f64::from(c) / depths.len() as f64);
    }
    mean.map(|m| m as f32)
}

/// Pseudo-random numbers in 0 ..= 1.
fn noise(i: u32) -> f32 {
    let x = (f64::from(i) * 12.9898).sin() * 43758.5453;
    (x - x.floor()) as f32
}

#[test]
fn one_depth_is_a_step() {
    for statistic in all() {
        // Series of low order have a wide step.
        let width = match statistic {
            Statistic::Csm(csm) => 0.5 / csm.shrink() / csm.order() as f32,
            _ => 0.1,
        };
        for i in 0..=20 {
            let z = i as f32 / 20.0;
            let channels = mean(&statistic, &[z]);
            for j in 0..=40 {
                let d = j as f32 / 40.0;
                let lit = statistic.visibility(&channels, d);
                assert!((0.0..=1.0).contains(&lit), "{statistic} {z} {d}: {lit}");
                // A Fourier series rings by a tenth at most (Annen et al. 2007, Fig. 4); rounding
                // to 8 bits adds two steps for each term.
                if d <= z {
                    assert!(lit > 0.89, "{statistic}: {d} before {z}: {lit}");
                } else if d > z + width {
                    assert!(lit < 0.14, "{statistic}: {d} behind {z}: {lit}");
                }
            }
        }
    }
}

#[test]
fn means_of_two_depths_are_between() {
    for statistic in all() {
        for share in 0..=8 {
            let depths: Vec<f32> = (0..8).map(|i| if i < share { 0.2 } else { 0.8 }).collect();
            let channels = mean(&statistic, &depths);
            let lit = statistic.visibility(&channels, 0.75);
            let expected = 1.0 - share as f32 / 8.0;
            match statistic {
                // These are upper bounds, which are tight if the receiver lies at one of both
                // depths.
                Statistic::Vsm(_) | Statistic::Evsm(Evsm { components: 2, .. }) => {
                    assert!(lit >= expected - 1e-3, "{statistic} {share}: {lit}");
                }
                Statistic::Esm(_) => assert!(lit >= expected, "{statistic} {share}: {lit}"),
                // A series of one term is a ramp over all depths.
                Statistic::Csm(csm) if csm.order() == 1 => {}
                // The series is doubled, so that half shadow is fully lit.
                Statistic::Csm(csm) if csm.gain() == 2.0 => {
                    let doubled = (2.0 * expected).min(1.0);
                    assert!((lit - doubled).abs() < 0.2, "{statistic} {share}: {lit}");
                }
                _ => {
                    assert!((lit - expected).abs() < 0.11, "{statistic} {share}: {lit} {expected}");
                }
            }
        }
    }
}

/// Chebyshev's and Hamburger's bounds are upper bounds of the lit share for any distribution of
/// depths.
#[test]
fn bounds_hold_for_any_depths() {
    for statistic in all() {
        let slack = match statistic {
            Statistic::Vsm(_) | Statistic::Evsm(_) => 1e-3,
            // Moment shadow maps lose this much by their bias and by 16 bits.
            Statistic::Msm(_) => 0.03,
            _ => continue,
        };
        for i in 0..400 {
            let count = 2 + i as usize % 40;
            let depths: Vec<f32> = (0..count as u32)
                .map(|k| {
                    let [a, b] = [noise(97 * i + k), noise(31 * i)];
                    // Depths are spread out, clustered, or nearly equal.
                    match i % 3 {
                        0 => a,
                        1 => 0.5 * b + 0.5 * (3.0 * a).floor() / 3.0,
                        _ => (b + 0.02 * a).min(1.0),
                    }
                })
                .collect();
            let channels = mean(&statistic, &depths);
            for j in 0..=50 {
                let d = j as f32 / 50.0;
                let lit = depths.iter().filter(|&&z| z >= d).count() as f32 / count as f32;
                let bound = statistic.visibility(&channels, d);
                assert!(bound >= lit - slack, "{statistic} {i}: {bound} < {lit} at {d}");
            }
        }
    }
}

#[test]
fn encodings_are_linear_in_the_filter() {
    for statistic in all() {
        let parts = [0.1, 0.35, 0.9];
        let weights = [0.5, 0.2, 0.3];
        let mut sum = [0.0; MAX_CHANNELS];
        for (z, w) in parts.into_iter().zip(weights) {
            sum.iter_mut().zip(statistic.encode(z)).for_each(|(s, c)| *s += w * c);
        }
        let each = |d: f32| -> f32 {
            let lit = |z: f32| statistic.encoding().visibility(&statistic.encode(z), d);
            parts.into_iter().zip(weights).map(|(z, w)| w * lit(z)).sum()
        };
        // For exponentials and series alone, visibility is linear in the channels too.
        if matches!(statistic, Statistic::Esm(_) | Statistic::Csm(_)) {
            for d in [0.05, 0.3, 0.5, 0.95] {
                let [whole, parts] = [statistic.encoding().visibility(&sum, d), each(d)];
                assert!(
                    (whole - parts).abs() <= 1e-4 * parts.abs().max(1.0),
                    "{statistic} {d}: {whole} {parts}"
                );
            }
        }
    }
}

/// The stored sines and cosines add up to the series itself, over depths multiplied by the factor.
#[test]
fn convolution_maps_are_the_fourier_step() {
    for (order, attenuation) in [(1, 0.0), (4, 0.0), (4, 1.5), (16, 0.0)] {
        let csm = Csm::new(order, attenuation, false, false).unwrap();
        let step = FourierStep::new(order, f64::from(attenuation)).unwrap();
        for z in [0.0, 0.3, 0.5, 1.0] {
            let mut channels = [0.0; MAX_CHANNELS];
            csm.encode(z, &mut channels);
            for j in 0..=100 {
                let d = j as f32 / 100.0;
                let expected = step.series(f64::from((z - d) * csm.shrink()));
                let sum = f64::from(csm.visibility(&channels, d));
                assert!((sum - expected).abs() < 1e-4, "M = {order}: {z} {d}: {sum} {expected}");
            }
        }
    }
}

/// Each term reduces the mean square difference from the step over all pairs of depths.
#[test]
fn every_term_brings_the_step_nearer() {
    let mut last = f64::INFINITY;
    for order in 1..=Csm::MAX_ORDER {
        let csm = Csm::new(order, 0.0, false, false).unwrap();
        let mut sum = 0.0;
        for i in 0..200 {
            let z = (i as f32 + 0.5) / 200.0;
            let mut channels = [0.0; MAX_CHANNELS];
            csm.encode(z, &mut channels);
            for j in 0..200 {
                let d = (j as f32 + 0.25) / 200.0;
                let step = if d <= z { 1.0 } else { 0.0 };
                sum += f64::from(csm.visibility(&channels, d) - step).powi(2);
            }
        }
        assert!(sum < last, "M = {order}: {sum} {last}");
        last = sum;
    }
}

/// With receiver and occluder as far apart as possible, the next period of the step has no effect
/// for any order, attenuation or offset.
#[test]
fn the_period_does_not_show() {
    for order in 1..=Csm::MAX_ORDER {
        // Strongly damped series of low order hardly approximate a step.
        for attenuation in [0.0, 0.5, 2.0].into_iter().filter(|a| a * 4.0 <= order as f32) {
            for (offset, scale) in [(true, false), (false, true)] {
                let csm = Csm::new(order, attenuation, offset, scale).unwrap();
                let csm = Statistic::Csm(csm);
                let lit = csm.visibility(&csm.encode(1.0), 0.0);
                let dark = csm.visibility(&csm.encode(0.0), 1.0);
                let darkest = if order == 1 { 0.35 } else { 0.2 };
                let brightest = if attenuation > 0.0 { 0.85 } else { 0.95 };
                assert!(lit > brightest && dark < darkest, "{csm}, {attenuation}: {lit} {dark}");
            }
        }
    }
}

#[test]
fn what_is_stored_fits() {
    for statistic in all() {
        for i in 0..=1000 {
            let channels = statistic.encode(i as f32 / 1000.0);
            assert!(channels.iter().all(|c| c.is_finite()), "{statistic}");
            let storage = statistic.storage();
            for &c in &channels[..statistic.channels()] {
                let step = match storage {
                    Storage::Float32 => 0.0,
                    Storage::Unorm16 => 1.0 / 65535.0,
                    Storage::Snorm16 => 1.0 / 32767.0,
                    Storage::Snorm8 => 1.0 / 127.0,
                };
                assert!((storage.stored(c) - c).abs() <= 0.51 * step, "{statistic}: {c}");
            }
            assert!(channels[statistic.channels()..].iter().all(|&c| c == 0.0), "{statistic}");
        }
    }
}

#[test]
fn leaks_are_cut_off() {
    for leak in [0.0, 0.2, 0.5] {
        for statistic in [
            Statistic::Vsm(Vsm { leak }),
            Statistic::Evsm(Evsm { leak, ..Evsm::default() }),
            Statistic::Msm(Msm { leak }),
        ] {
            let channels = mean(&statistic, &[0.3, 0.3, 0.3, 0.9]);
            assert_eq!(statistic.visibility(&channels, 0.1), 1.0);
            let before = statistic.visibility(&channels, 0.85);
            assert!(
                before <= 0.36 && (leak < 0.4 || before == 0.0),
                "{statistic} {leak}: {before}"
            );
        }
    }
}

#[test]
fn parameters_that_make_no_sense_are_named() {
    for (statistic, field) in [
        (Statistic::Vsm(Vsm { leak: 1.0 }), "filter.leak"),
        (Statistic::Msm(Msm { leak: f32::NAN }), "filter.leak"),
        (Statistic::Esm(Esm { exponent: 0.0 }), "filter.exponent"),
        (Statistic::Esm(Esm { exponent: 99.0 }), "filter.exponent"),
        (Statistic::Evsm(Evsm { exponent: f32::INFINITY, ..Evsm::default() }), "filter.exponent"),
        (Statistic::Evsm(Evsm { components: 3, ..Evsm::default() }), "filter.components"),
    ] {
        let error = statistic.check().unwrap_err().to_string();
        assert!(error.starts_with(field), "{error}");
    }
    assert!(Csm::new(0, 0.0, true, false).unwrap_err().to_string().starts_with("filter.order"));
    assert!(Csm::new(17, 0.0, true, false).is_err());
    let error = Csm::new(4, -1.0, true, false).unwrap_err().to_string();
    assert!(error.starts_with("filter.attenuation"), "{error}");
}
