//! Requests that cannot be met give errors that name the reason, and nothing panics.

use crate::device::Bench;
use crate::{EYE, bench, camera, lights, plan, scene, sun};
use glam::DVec3;
use umbrage::visibility::statistic::{Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, Pattern, Prefilter, Width};
use umbrage::{Bounds, Faces, Partition, Planner, Size, Technique, Warp};
use umbrage_testing::needs;
use umbrage_wgpu::{
    Bias, Casters, Error, Frame, Layout, LookupBuffers, ShadowOptions, Shadows, Support, Timestamps,
};

fn prepare(
    bench: &Bench,
    shadows: &mut Shadows,
    technique: &Technique,
    origin: DVec3,
) -> Result<(), Error> {
    let plan = plan(&camera(EYE), &lights(), technique);
    let frame = Frame { plan: &plan, render_origin: origin, casters: Casters::Unmoved };
    shadows.prepare(&bench.device, &bench.queue, &frame).map(drop)
}

#[needs(gpu)]
#[test]
fn input_that_makes_no_sense_is_named() {
    let bench = bench();
    let new = |options: &ShadowOptions| Shadows::new(&bench.device, bench.support, options);
    let error = new(&ShadowOptions { filter: Filter::Pcf { n: 99 }, ..Default::default() });
    assert!(error.unwrap_err().to_string().starts_with("options.filter"));
    let width = Width::Metres(f32::NAN);
    let spread = new(&ShadowOptions {
        filter: Filter::Spread { n: 3, width, pattern: Pattern::Grid },
        ..Default::default()
    });
    assert!(spread.unwrap_err().to_string().starts_with("options.filter: filter.width"));
    let statistic = Statistic::Vsm(Vsm { leak: 2.0 });
    let filter = Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(3), half: false });
    let leaky = new(&ShadowOptions { filter, ..Default::default() });
    assert!(leaky.unwrap_err().to_string().starts_with("options.filter: filter.leak"));
    let mut shadows = new(&ShadowOptions::default()).unwrap();
    for bias in [
        Bias { texels: f32::NAN, metres: 0.0 },
        Bias { texels: -0.6, metres: 0.0 },
        Bias { texels: 0.0, metres: f32::INFINITY },
    ] {
        assert!(shadows.set_bias(bias).unwrap_err().to_string().starts_with("bias"));
    }
    let small = Technique { size: Size::Budget(64 * 64), ..Technique::default() };
    let error = prepare(&bench, &mut shadows, &small, DVec3::NAN).unwrap_err();
    assert!(error.to_string().starts_with("frame.render_origin"), "{error}");
    let log = Technique { warp: Warp::Log, ..small };
    let error = prepare(&bench, &mut shadows, &log, DVec3::ZERO).unwrap_err();
    assert_eq!(error, Error::LogarithmicRows { map: 0 });
    // After the errors, the shadows work as before.
    prepare(&bench, &mut shadows, &small, DVec3::ZERO).unwrap();
}

/// Plans for different filters have different casters at the borders of their maps, and different
/// depths.
#[needs(gpu)]
#[test]
fn a_plan_for_another_filter_is_refused() {
    let bench = bench();
    let [pcf3, hard, pcss]: [Technique; 3] =
        ["adaptive+z4:pcf3@256", "adaptive+z4@256", "adaptive+z4:pcss@256"]
            .map(|t| t.parse().unwrap());
    let options = ShadowOptions { filter: pcf3.filter, ..Default::default() };
    let mut shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
    let mut prepare = |technique: &Technique| {
        let plan = plan(&camera(EYE), &[sun()], technique);
        let frame = Frame { plan: &plan, render_origin: EYE, casters: Casters::Unmoved };
        shadows.prepare(&bench.device, &bench.queue, &frame).map(drop)
    };
    for other in [hard, pcss] {
        let error = prepare(&other).unwrap_err();
        let expected = Error::OtherFilter { planned: other.filter, looked_up: pcf3.filter };
        assert_eq!(error, expected);
        assert!(error.to_string().contains("`pcf3`"), "{error}");
    }
    prepare(&pcf3).unwrap();
}

/// A lookup without the fade would show shadows that end at a line.
#[needs(gpu)]
#[test]
fn a_plan_that_fades_is_refused_without_the_option() {
    let bench = bench();
    let mut planner = Planner::new();
    planner.set_fade(Planner::FADE).unwrap();
    let bounds = Bounds::of_scene(scene());
    let plan = planner.plan(&camera(EYE), &[sun()], &bounds, &Technique::default()).unwrap();
    let frame = Frame { plan, render_origin: EYE, casters: Casters::Unmoved };
    for fades in [false, true] {
        let options = ShadowOptions { fades, ..ShadowOptions::default() };
        let mut shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).map(drop);
        let error = prepared.map_err(|e| e.to_string());
        let is_right = if fades {
            error.is_ok()
        } else {
            error.clone().unwrap_err().starts_with("options.fades")
        };
        assert!(is_right, "{fades}: {error:?}");
    }
}

#[needs(gpu)]
#[test]
fn filters_that_a_device_cannot_have_are_named() {
    let bench = bench();
    let lacking = [
        (Support { depth_fetch: false, ..bench.support }, spread(), "fetching of depths"),
        (Support { float32: false, ..bench.support }, vsm(), "filtering of 32-bit floats"),
    ];
    for (support, filter, expected) in lacking {
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        let error = Shadows::new(&bench.device, support, &options).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
}

fn spread() -> Filter {
    Filter::Spread { n: 3, width: Width::Pixels(2.0), pattern: Pattern::Poisson }
}

fn vsm() -> Filter {
    let statistic = Statistic::Vsm(Vsm::default());
    Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(3), half: false })
}

#[needs(gpu)]
#[test]
fn what_a_small_device_cannot_hold_is_said_before_anything_is_drawn() {
    let bench = bench();
    let small = Support { storage_buffers: false, max_side: 512, max_layers: 4, ..bench.support };
    let options = ShadowOptions { buffers: LookupBuffers::Storage, ..ShadowOptions::default() };
    let mut shadows = Shadows::new(&bench.device, small, &options).unwrap();
    assert_eq!(shadows.options().buffers, LookupBuffers::Uniform);
    let faces = Partition { faces: Faces::SidesAndNear, ..Partition::slices(16) };
    let many = Technique { partition: faces, size: Size::Exact([2, 2]), ..Technique::default() };
    let error = prepare(&bench, &mut shadows, &many, DVec3::ZERO).unwrap_err();
    assert!(matches!(error, Error::TooMany { .. }), "{error}");
    // Storage buffers hold as many, where the device has them.
    let able = Support { storage_buffers: true, ..small };
    let mut with_storage = Shadows::new(&bench.device, able, &options).unwrap();
    prepare(&bench, &mut with_storage, &many, DVec3::ZERO).unwrap();
    assert_eq!(LookupBuffers::for_technique(&many, 1), LookupBuffers::Storage);
    let large = Technique { size: Size::Exact([600, 2]), ..Technique::default() };
    let error = prepare(&bench, &mut shadows, &large, DVec3::ZERO).unwrap_err();
    assert!(matches!(error, Error::NoRoom(_)), "{error}");
    let layers = ShadowOptions { layout: Layout::Layers, ..ShadowOptions::default() };
    let mut shadows = Shadows::new(&bench.device, small, &layers).unwrap();
    let six = Technique { size: Size::Exact([8, 8]), ..Technique::default() };
    let error = prepare(&bench, &mut shadows, &six, DVec3::ZERO).unwrap_err();
    assert!(error.to_string().contains("do not fit into 4 layers"), "{error}");
}

/// On a lost device nothing is drawn, and nothing panics.
#[needs(gpu)]
#[test]
fn a_lost_device_does_not_panic() {
    let bench = bench();
    let mut shadows =
        Shadows::new(&bench.device, bench.support, &ShadowOptions::default()).unwrap();
    let plan = plan(&camera(EYE), &[sun()], &Technique::default());
    bench.device.destroy();
    for _ in 0..2 {
        let frame = Frame { plan: &plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        let mut encoder = bench.encoder();
        prepared.encode(&mut encoder, &Timestamps::default(), |_| {});
        bench.queue.submit([encoder.finish()]);
    }
    Shadows::new(&bench.device, bench.support, &ShadowOptions::default()).unwrap();
}
