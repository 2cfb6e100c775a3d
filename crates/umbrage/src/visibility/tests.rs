use super::*;
use crate::plan::Rows;
use proptest::prelude::*;
use std::cell::RefCell;

/// A map whose shadow space is local space.
fn map(resolution: [u32; 2], rows: Rows) -> ShadowMap {
    ShadowMap { rows, resolution, ..ShadowMap::default() }
}

fn flat(s: f64, t: f64, depth: f64) -> Receiver {
    Receiver { st: DVec2::new(s, t), depth, ..Receiver::default() }
}

/// Filters that compare depths.
fn comparing() -> impl Iterator<Item = Filter> {
    let boxes = (1..=Filter::MAX_PCF).map(|n| Filter::pcf(n).unwrap());
    let widths = [Width::Metres(0.3), Width::Pixels(1e6)];
    let spread = widths.into_iter().flat_map(|width| {
        [Pattern::Grid, Pattern::Poisson].map(|pattern| Filter::Spread { n: 3, width, pattern })
    });
    let soft = [LightSize::Degrees(0.53), LightSize::Metres(1e6)]
        .map(|light| Filter::Pcss { n: 3, light });
    std::iter::once(Filter::Hard).chain(boxes).chain(spread).chain(soft)
}

/// Filters of every kind.
fn filters() -> impl Iterator<Item = Filter> {
    use statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
    let statistics = [
        Statistic::Vsm(Vsm::default()),
        Statistic::Esm(Esm::default()),
        Statistic::Evsm(Evsm::default()),
        Statistic::Msm(Msm::default()),
        Statistic::Csm(Csm::new(3, 0.0, false, true).unwrap()),
    ];
    let prefiltered = statistics.into_iter().enumerate().map(|(i, statistic)| {
        let (blur, half) = (Blur::Texels([3, 1][i % 2]), i % 3 == 1);
        Filter::Prefiltered(Prefilter { statistic, blur, half })
    });
    comparing().chain(prefiltered)
}

#[test]
fn widths_out_of_range_are_named() {
    for n in [0, 16, u32::MAX] {
        assert!(Filter::pcf(n).unwrap_err().to_string().starts_with("filter.n"));
    }
    assert_eq!(Filter::pcf(5).unwrap().to_string(), "pcf5");
    assert_eq!(Filter::default().to_string(), "hard");
}

#[test]
fn the_nearest_texel_decides() {
    let map = map([4, 8], Rows::Even);
    let only = |i, j| if (i, j) == (2, 5) { 0.25 } else { 1.0 };
    let at = |s, t, depth| visibility(&map, Filter::Hard, &flat(s, t, depth), only);
    assert_eq!(at(0.51, 0.63, 0.5), 0.0);
    assert_eq!(at(0.74, 0.74, 0.5), 0.0);
    assert_eq!(at(0.76, 0.74, 0.5), 1.0);
    assert_eq!(at(0.51, 0.62, 0.5), 1.0);
    assert_eq!(at(0.51, 0.63, 0.25), 1.0, "what is stored does not hide itself");
    // The map's far border belongs to its last texel.
    let last = |i, j| if (i, j) == (3, 7) { 0.25 } else { 1.0 };
    assert_eq!(visibility(&map, Filter::Hard, &flat(1.0, 1.0, 0.5), last), 0.0);
}

#[test]
fn boxes_count_by_area() {
    let map = map([64, 64], Rows::Even);
    // Texel columns left of 30 are dark, so the lit share of the box is linear in the receiver's
    // position.
    let depth = |i: i32, _| if i < 30 { 0.1 } else { 1.0 };
    for n in 1..=Filter::MAX_PCF {
        for step in 0..200 {
            let x = 20.0 + f64::from(step) * 0.1 + 0.037;
            let lit = ((x + f64::from(n) / 2.0 - 30.0) / f64::from(n)).clamp(0.0, 1.0);
            let receiver = flat(x / 64.0, 0.5003, 0.5);
            let found = visibility(&map, Filter::Pcf { n }, &receiver, depth);
            assert!((f64::from(found) - lit).abs() < 1e-6, "{n} at {x}: {found}, not {lit}");
        }
    }
}

proptest! {
    #[test]
    fn lookups_stay_within_reach(s in 0.0..=1.0, t in 0.0..=1.0, w in 1u32..40, h in 1u32..40) {
        for filter in filters() {
            let map = map([w, h], Rows::Even);
            let reach = filter.reach_texels() as i32;
            let fetched = RefCell::new(Vec::new());
            visibility(&map, filter, &flat(s, t, 0.5), |i, j| {
                fetched.borrow_mut().push((i, j));
                1.0
            });
            for (i, j) in fetched.into_inner() {
                prop_assert!((-reach..w as i32 + reach).contains(&i), "{filter}: {i} of {w}");
                prop_assert!((-reach..h as i32 + reach).contains(&j), "{filter}: {j} of {h}");
            }
        }
    }

    #[test]
    fn planes_do_not_hide_themselves(
        s in 0.0..=1.0, t in 0.0..=1.0, elevation in 0.001f64..1.5, azimuth in 0.0..6.3,
        ratio in 1.001f64..1e4,
    ) {
        // Texels store what a map would: the plane's depth at each texel's centre, in single
        // precision. A map that serves a plane leaves a margin of depth in front of it.
        let slope = DVec2::from_angle(azimuth) / elevation.tan();
        for rows in [Rows::Even, Rows::Logarithmic { ratio }] {
            let map = map([37, 23], rows);
            let receiver = Receiver { st: DVec2::new(s, t), depth: 0.4, slope, ..Receiver::default() };
            let stored = |i: i32, j: i32| {
                let row = (f64::from(j) + 0.5) / 23.0;
                let center = DVec2::new((f64::from(i) + 0.5) / 37.0, rows.t_from_row(row));
                (0.4 + slope.dot(center - receiver.st)).clamp(1e-7, 1.0) as f32
            };
            for filter in comparing() {
                prop_assert_eq!(visibility(&map, filter, &receiver, stored), 1.0);
            }
        }
    }

    #[test]
    fn no_input_makes_a_nan(
        s: f64, t: f64, depth: f64, ds: f64, dt: f64, half_texel: f64, stored in 0.0f32..=1.0,
    ) {
        for (st, slope) in [
            (DVec2::new(s, t), DVec2::new(ds, dt)),
            (DVec2::splat(0.5), DVec2::new(ds, dt)),
            (DVec2::splat(0.5), DVec2::INFINITY),
            (DVec2::splat(0.5), DVec2::new(f64::INFINITY, f64::NEG_INFINITY)),
            (DVec2::NAN, DVec2::NAN),
        ] {
            for filter in filters() {
                let receiver = Receiver {
                    st,
                    depth,
                    slope,
                    half_texel,
                    level_slope: slope,
                    depth_per_metre: ds,
                    texel_metric: [s, t, dt],
                    pixel_metric: [ds * ds, dt * dt, ds * dt],
                };
                let v = visibility(&map([3, 3], Rows::Even), filter, &receiver, |_, _| stored);
                prop_assert!((0.0..=1.0).contains(&v), "{v}");
            }
        }
    }
}

#[test]
fn no_width_makes_a_nan() {
    let statistic = statistic::Statistic::Vsm(statistic::Vsm::default());
    let blur = Blur::Width(Width::Metres(1.0));
    let filter = Filter::Prefiltered(Prefilter { statistic, blur, half: true });
    for texel_metric in [
        [0.0; 3],
        [1e300, 1e300, 0.0],
        [1e300, 1e-300, 1.0],
        [f64::NAN, 1.0, 0.0],
        [1.0, f64::INFINITY, f64::NEG_INFINITY],
    ] {
        let receiver = Receiver { texel_metric, ..flat(0.5, 0.5, 0.5) };
        let v = visibility(&map([3, 3], Rows::Even), filter, &receiver, |_, _| 0.4);
        assert!((0.0..=1.0).contains(&v), "{texel_metric:?}: {v}");
    }
}

#[test]
fn outside_the_map_or_its_depths_there_is_light() {
    let all_dark = |_, _| 0.0;
    for filter in comparing() {
        for (s, t) in [(-1e-5, 0.5), (1.0 + 1e-5, 0.5), (0.5, -3.0), (0.5, 1.1)] {
            assert_eq!(
                visibility(&map([8, 8], Rows::Even), filter, &flat(s, t, 0.5), all_dark),
                1.0
            );
        }
        let empty = map([0, 0], Rows::Even);
        assert_eq!(visibility(&empty, filter, &flat(0.5, 0.5, 0.5), all_dark), 1.0);
        let map = map([8, 8], Rows::Even);
        assert_eq!(visibility(&map, filter, &flat(0.5, 0.5, 0.5), all_dark), 0.0);
        // A clamped caster hides a receiver whose slack exceeds its depth.
        let coarse = Receiver { half_texel: 0.2, ..flat(0.5, 0.5, 0.1) };
        assert_eq!(visibility(&map, filter, &coarse, all_dark), 0.0);
        // Receivers before depth 0 are lit, and so are those behind the map's far end if no caster
        // was drawn.
        assert_eq!(visibility(&map, filter, &flat(0.5, 0.5, -0.1), all_dark), 1.0);
        assert_eq!(visibility(&map, filter, &flat(0.5, 0.5, 1.5), |_, _| 1.0), 1.0);
        assert_eq!(visibility(&map, filter, &flat(0.5, 0.5, 1.5), |_, _| 0.9), 0.0);
    }
}

#[test]
fn texel_coordinates_follow_the_rows() {
    let rows = Rows::Logarithmic { ratio: 100.0 };
    let map = map([10, 20], rows);
    for row in [0.0, 0.25, 0.5, 1.0] {
        let st = DVec2::new(0.3, rows.t_from_row(row));
        let texel = texel_coordinates(&map, st);
        assert!((texel - DVec2::new(3.0, 20.0 * row)).length() < 1e-9, "{texel}");
    }
}

/// Lookup of convolution maps in mip levels agrees with comparisons of all texels, each with its
/// weight in the footprint, but for the terms that the series leaves out. The occluder is slanted
/// and the footprint longer along than across.
#[test]
fn smaller_copies_of_a_slanted_plane_are_comparisons_over_the_same_footprint() {
    use statistic::{Csm, MAX_CHANNELS, Statistic};
    let map = map([512, 512], Rows::Even);
    let slope = 0.008;
    let depth =
        |i: i32, _: i32| (0.5 + slope * (f64::from(i) + 0.5 - 256.0)).clamp(0.0, 1.0) as f32;
    for (order, deviation_texels, shear, allowed) in
        [(16, 6.0, 0.0, 0.04), (16, 14.0, 0.8, 0.015), (8, 20.0, 0.5, 0.02), (4, 30.0, 0.0, 0.015)]
    {
        let statistic = Statistic::Csm(Csm::new(order, 0.0, false, false).unwrap());
        let blur = Blur::Width(Width::Metres(1.0));
        let prefilter = Prefilter { statistic, blur, half: false };
        let filter = Filter::Prefiltered(prefilter);
        // The footprint is longer along t, and sheared.
        let side = deviation_texels / Prefilter::DEVIATION;
        let texel_metric = [1.0, 6.0, shear].map(|m| m * side * side);
        let (mut worst, mut least, mut most) = (0.0f32, 1.0f32, 0.0f32);
        for step in -20..=20 {
            let beyond = f64::from(step) * 0.1 * slope * deviation_texels;
            let receiver = Receiver { texel_metric, ..flat(0.5003, 0.4998, 0.5 + beyond) };
            let footprint = prefilter.footprint(&receiver);
            assert!(footprint.level > 1 && footprint.samples[0] > footprint.samples[1]);
            let is_lit = |i, j| f64::from(u8::from(f64::from(depth(i, j)) >= receiver.depth));
            // The lit share, bilinearly interpolated between the boxes of a mip level's texels.
            let sample = |texel: DVec2, level: u32| {
                let size = 1 << level;
                let corner = texel / f64::from(size) - 0.5;
                let (first, fraction) = (corner.floor(), corner - corner.floor());
                let lit = |x: i32, y: i32| {
                    let [i, j] = [first.x as i32 + x, first.y as i32 + y].map(|k| k * size);
                    let all = (0..size * size).map(|k| is_lit(i + k % size, j + k / size));
                    all.sum::<f64>() / f64::from(size * size)
                };
                let row = |y| lit(0, y) * (1.0 - fraction.x) + lit(1, y) * fraction.x;
                let mut share = [0.0; MAX_CHANNELS];
                share[0] = (row(0) * (1.0 - fraction.y) + row(1) * fraction.y) as f32;
                share
            };
            let at = texel_coordinates(&map, receiver.st);
            let [expected, ..] = footprint.gather(at, drawn(&map, filter), sample);
            let found = visibility(&map, filter, &receiver, depth);
            worst = worst.max((found - expected).abs());
            (least, most) = (least.min(found), most.max(found));
        }
        // The wider the footprint is in depth, the smaller is the part of the step that the missing
        // terms make up.
        assert!(worst < allowed, "M = {order}, {deviation_texels} texels: {worst}");
        assert!(least < 0.1 && most > 0.9, "nothing passes from light to dark");
    }
}
