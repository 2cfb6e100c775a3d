//! The GPU's pictures against the reference's, which casts a ray through every texel.

use crate::{GPU, Set, scene};
use glam::{DAffine3, DVec3};
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, Pattern, Prefilter, Width};
use umbrage::{
    Camera, Faces, Light, Objective, Options, Partition, Plan, Size, Splits, SpotLight, Warp,
};
use umbrage_render::{Look, Renderer, Sample, SceneBuffers};
use umbrage_testing::needs;
use umbrage_trace::{Reference, View};
use umbrage_wgpu::{Casters, Comparison, Layout, ShadowOptions, Support};

const IMAGE: [u32; 2] = [240, 135];

/// Every warp that a GPU can draw, and every partition, each at least once.
fn techniques() -> Vec<(&'static str, Options)> {
    let whole = Partition::default();
    let faces = Partition { faces: Faces::SidesAndNear, ..whole };
    let sides = Partition { faces: Faces::Sides, ..Partition::slices(2) };
    let fitted = Partition { splits: Splits::Fitted, overlap: 0.2, ..Partition::slices(3) };
    let practical = Partition { splits: Splits::Practical(0.5), ..Partition::slices(4) };
    let options = |warp, partition| Options {
        warp,
        partition,
        size: Size::Budget(512 * 512),
        ..Options::default()
    };
    vec![
        ("unfocused", options(Warp::Unfocused, whole)),
        ("uniform+z4", options(Warp::Uniform, Partition::slices(4))),
        ("uniform(stable)+z4(practical)", options(Warp::Stable, practical)),
        ("psm", options(Warp::Psm, whole)),
        ("lispsm", options(Warp::Lispsm, whole)),
        ("lispsm+face", options(Warp::Lispsm, faces)),
        ("tsm+z2+face(sides)", options(Warp::Tsm { focus: None }, sides)),
        ("adaptive+z3(fitted,overlap)", options(Warp::Adaptive(Objective::Storage), fitted)),
        ("adaptive(area)", options(Warp::Adaptive(Objective::Area), whole)),
        ("lambda=5", options(Warp::Lambda(5.0), whole)),
    ]
}

/// How the GPU's picture and the reference's differ, of the samples that count.
struct Difference {
    counted: usize,
    /// Visibility by more than 1/2.
    visibility: usize,
    /// Not the same surface: the rasteriser's and the ray's edges differ by a 512th of a pixel or so.
    surface: usize,
    /// Not the same map, or another texel.
    place: usize,
    /// Pixels per texel by more than 2%.
    error: usize,
    /// Colour where visibility is the same.
    color: usize,
}

fn compare(
    set: &Set<'_>,
    plan: &Plan,
    light: (usize, &Light),
    filter: Filter,
    samples: &[Sample],
    reference: &Reference<'_>,
) -> Difference {
    let quietly = |_: u64| {};
    let view = View::new(&set.tracer, set.camera, *light.1, 1).unwrap();
    let mut d = Difference { counted: 0, visibility: 0, surface: 0, place: 0, error: 0, color: 0 };
    let rows = 0..set.camera.image()[1];
    let band = view.band(rows, &quietly);
    let visibility = band.map(|s| reference.visibility(light.0, s), &quietly);
    for ((sample, expected), gpu) in band.samples().iter().zip(visibility).zip(samples) {
        let Some(sample) = sample else {
            d.surface += usize::from(gpu.depth.is_finite());
            continue;
        };
        let depth = (f64::from(gpu.depth) / sample.depth - 1.0).abs();
        let normal = gpu.normal.as_dvec3().dot(sample.surface.shading_normal);
        d.surface +=
            usize::from(depth > 1e-3 || normal < 0.999 || gpu.is_facing != sample.is_facing);
        if !sample.is_facing || sample.depth > set.camera.far() {
            continue;
        }
        d.counted += 1;
        let differs = (gpu.visibility - expected).abs() > 0.5;
        d.visibility += usize::from(differs);
        let place = reference.texel(light.0, sample.surface.position);
        let map = place.map(|p| p.map as u32);
        let texel = place.map_or(0.0, |p| (p.texel - gpu.texel.as_dvec2()).length());
        // A texel is as wide as several pixels, or a pixel as several texels.
        d.place +=
            usize::from(map != gpu.map || (map.is_some() && (texel.is_nan() || texel >= 0.1)));
        let error = place.and_then(|p| {
            let surface = &sample.surface;
            plan.maps[p.map].surface_error(&set.camera, surface.position, surface.geometric_normal)
        });
        let error = error.map_or(0.0, |e| f64::from(gpu.error) / e.worst - 1.0);
        d.error += usize::from(error.abs() > 0.02);
        let color = umbrage_trace::shade::radiance(light.1, sample, expected);
        let is_same = (gpu.visibility - expected).abs() < 1e-3;
        d.color += usize::from(is_same && (color - gpu.radiance).abs().max_element() > 0.02);
    }
    assert!(d.counted > 200, "{filter}: {} samples count", d.counted);
    d
}

fn draw(
    set: &Set<'_>,
    plan: &Plan,
    look: &Look<'_>,
    options: &ShadowOptions,
    support: Support,
) -> Vec<Sample> {
    let buffers = SceneBuffers::new(&GPU, set.scene, false).unwrap();
    let mut renderer = Renderer::with_support(&GPU, &buffers, options, support).unwrap();
    renderer.draw_maps(plan, Casters::Still, None).unwrap();
    renderer.samples(look, 0..set.camera.image()[1], 1, true).unwrap()
}

/// The shares that may differ, of the samples that count.
fn check(name: &str, technique: &str, filter: Filter, d: &Difference) {
    let share = |n: usize| n as f64 / d.counted as f64;
    let text = format!(
        "{name}, {technique}:{filter}: visibility {:.4}, surface {:.4}, place {:.4}, error {:.4}, color {:.4} of {}",
        share(d.visibility),
        share(d.surface),
        share(d.place),
        share(d.error),
        share(d.color),
        d.counted
    );
    assert!(share(d.visibility) <= 0.002, "{text}");
    assert!(share(d.surface) <= 0.004, "{text}");
    assert!(share(d.place) <= 0.01, "{text}");
    assert!(share(d.error) <= 0.01, "{text}");
    assert!(share(d.color) <= 0.01, "{text}");
}

/// Some techniques in a scene's own view and light.
fn agrees(name: &str, techniques: &[(&str, Options)]) {
    let scene = scene(name);
    let set = Set::new(&scene, IMAGE);
    for (i, (technique, options)) in techniques.iter().enumerate() {
        let filter = if i % 2 == 0 { Filter::Hard } else { Filter::Pcf { n: 3 } };
        agrees_with(name, &set, technique, options, filter);
    }
}

/// One technique and filter in a scene's own light.
fn agrees_with(name: &str, set: &Set<'_>, technique: &str, options: &Options, filter: Filter) {
    let light = set.light();
    let plan = set.plan(&[light], options);
    let look = Look { camera: &set.camera, light: &light, light_index: 0 };
    let shadow_options = ShadowOptions { filter, ..ShadowOptions::default() };
    let samples = draw(set, &plan, &look, &shadow_options, GPU.support());
    let reference = Reference::render(&set.tracer, &plan, filter, &|_| {}).unwrap();
    let difference = compare(set, &plan, (0, &light), filter, &samples, &reference);
    check(name, technique, filter, &difference);
}

/// Those of [`techniques`] with these indices: every scene has some, every technique two scenes at least.
fn some(indices: &[usize]) -> Vec<(&'static str, Options)> {
    let all = techniques();
    indices.iter().map(|&i| all[i]).collect()
}

/// One of [`techniques`] with about half of the texels, for tests of many filters.
fn small(index: usize) -> (&'static str, Options) {
    let (technique, options) = techniques()[index];
    (technique, Options { size: Size::Budget(384 * 384), ..options })
}

#[needs(gpu)]
#[test]
fn in_a_town() {
    agrees("town:40", &techniques());
}

#[needs(gpu)]
#[test]
fn on_an_airfield() {
    agrees("airfield", &some(&[1, 3, 5, 7]));
}

#[needs(gpu)]
#[test]
fn among_statues() {
    agrees("statues", &some(&[0, 4, 8]));
}

#[needs(gpu)]
#[test]
fn in_a_grove() {
    agrees("grove", &some(&[2, 6, 9]));
}

#[needs(gpu)]
#[test]
fn at_a_fence() {
    agrees("fence", &some(&[1, 4, 7]));
}

/// A point light: six maps, or more.
#[needs(gpu)]
#[test]
fn around_a_lantern() {
    agrees("lantern", &some(&[1, 4, 7, 9]));
}

#[needs(gpu, scenes)]
#[test]
fn on_a_race_track() {
    agrees("vehicles/kenney_racing_level.glb", &some(&[2, 3, 5, 8]));
}

/// Alpha masks.
#[needs(gpu, scenes)]
#[test]
fn in_a_forest() {
    agrees("trees/forest_eztree.glb", &some(&[0, 6, 7]));
}

#[needs(gpu, scenes)]
#[test]
fn in_an_atrium() {
    agrees("atrium/sponza_atrium_reduced.glb", &some(&[1, 5, 9]));
}

#[needs(gpu, scenes)]
#[test]
fn over_kilometres_of_terrain() {
    agrees("terrain/jacksboro_dem_terrain.glb", &some(&[3, 4, 8]));
}

#[needs(gpu, scenes)]
#[test]
fn in_a_house_of_centimetres() {
    agrees("house/house.glb", &some(&[2, 4, 6]));
}

/// A world of centimetres and one of kilometres.
#[needs(gpu)]
#[test]
fn at_any_scale() {
    for scale in [0.01, 1000.0] {
        let mut scene = scene("statues");
        for instance in &mut scene.instances {
            let scaled = DAffine3::from_scale(DVec3::splat(scale));
            instance.world_from_mesh = scaled * instance.world_from_mesh;
        }
        for camera in &mut scene.cameras {
            [camera.eye, camera.target] = [camera.eye, camera.target].map(|p| p * scale);
            [camera.near, camera.far] = [camera.near, camera.far].map(|d| d * scale);
        }
        let set = Set::new(&scene, IMAGE);
        for (technique, options) in some(&[2, 4, 8]) {
            agrees_with(&format!("statues x {scale}"), &set, technique, &options, Filter::Hard);
        }
    }
}

/// Whatever a device lacks, the picture is the same, but for what comparisons by the texture unit cost.
#[needs(gpu)]
#[test]
fn every_fallback_draws_the_same_picture() {
    let scene = scene("town:20");
    let set = Set::new(&scene, IMAGE);
    let light = set.light();
    let (technique, options) = techniques()[7];
    let plan = set.plan(&[light], &options);
    let look = Look { camera: &set.camera, light: &light, light_index: 0 };
    let all = GPU.support();
    for filter in [Filter::Hard, Filter::Pcf { n: 3 }] {
        let reference = Reference::render(&set.tracer, &plan, filter, &|_| {}).unwrap();
        let difference = |options: ShadowOptions, support| {
            let samples = draw(&set, &plan, &look, &options, support);
            compare(&set, &plan, (0, &light), filter, &samples, &reference)
        };
        let base = ShadowOptions { filter, ..ShadowOptions::default() };
        for (lacking, options, support) in [
            ("clamping", base, Support { depth_clip_control: false, ..all }),
            ("storage", base, Support { storage_buffers: false, ..all }),
            ("layers", ShadowOptions { layout: Layout::Layers, ..base }, all),
        ] {
            let name = format!("town without {lacking}");
            check(&name, technique, filter, &difference(options, support));
        }
        let hardware = ShadowOptions { comparison: Comparison::Hardware, ..base };
        let by_option = difference(hardware, all);
        let by_need = difference(base, Support { depth_fetch: false, ..all });
        assert_eq!(by_option.visibility, by_need.visibility);
        assert!(
            by_option.visibility * 50 <= by_option.counted,
            "{filter}: {}",
            by_option.visibility
        );
    }
}

#[needs(gpu)]
#[test]
fn every_prefilter_in_three_scenes() {
    every_prefilter(&["town:20", "fence", "lantern"]);
}

#[needs(gpu, scenes)]
#[test]
fn every_prefilter_in_a_forest() {
    every_prefilter(&["trees/forest_eztree.glb"]);
}

/// What is filtered ahead of lookup, under an even map, a warp and slices.
fn every_prefilter(scenes: &[&str]) {
    let csm = |m| Statistic::Csm(Csm::new(m, 0.0, false, true).unwrap());
    let statistics = [
        Statistic::Vsm(Vsm::default()),
        Statistic::Esm(Esm::default()),
        Statistic::Evsm(Evsm::default()),
        Statistic::Evsm(Evsm { components: 2, ..Evsm::default() }),
        Statistic::Msm(Msm::default()),
        csm(4),
        csm(16),
    ];
    for name in scenes {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        for (i, statistic) in statistics.into_iter().enumerate() {
            let (technique, options) = small([1, 4, 7][i % 3]);
            let half = i % 2 == 1;
            let filter = Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(5), half });
            agrees_with(name, &set, technique, &options, filter);
        }
    }
}

#[needs(gpu)]
#[test]
fn every_width_in_three_scenes() {
    every_width(&["town:20", "fence", "lantern"]);
}

#[needs(gpu, scenes)]
#[test]
fn every_width_in_a_forest() {
    every_width(&["trees/forest_eztree.glb"]);
}

/// Widths in pixels and metres: smaller copies of maps, and several samples along a footprint.
fn every_width(scenes: &[&str]) {
    let csm = Statistic::Csm(Csm::new(8, 0.0, false, true).unwrap());
    let prefilter = |statistic, width| {
        let half = width == Width::Metres(0.6);
        Filter::Prefiltered(Prefilter { statistic, blur: Blur::Width(width), half })
    };
    for name in scenes {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        let filters = [
            Filter::Spread { n: 5, width: Width::Pixels(3.0), pattern: Pattern::Grid },
            Filter::Spread { n: 4, width: Width::Metres(0.5), pattern: Pattern::Grid },
            Filter::Spread { n: 6, width: Width::Metres(0.4), pattern: Pattern::Poisson },
            Filter::Pcss { n: 6, source: 0.3 },
            prefilter(Statistic::Vsm(Vsm::default()), Width::Pixels(4.0)),
            prefilter(csm, Width::Pixels(2.0)),
            prefilter(csm, Width::Metres(0.6)),
            prefilter(Statistic::Msm(Msm::default()), Width::Metres(3.0)),
        ];
        for (i, filter) in filters.into_iter().enumerate() {
            let (technique, mut options) = small([1, 4, 7][i % 3]);
            options.keeps_casters = matches!(filter, Filter::Pcss { .. });
            agrees_with(name, &set, technique, &options, filter);
        }
    }
}

/// A sun, a spot light and a point light in one plan, each looked up for itself.
#[needs(gpu)]
#[test]
fn several_lights_share_a_plan() {
    let scene = scene("lantern");
    let set = Set::new(&scene, IMAGE);
    let bulb = set.light();
    let spot = SpotLight {
        position: set.camera.eye() + DVec3::Y,
        direction: set.camera.forward(),
        half_angle_rad: 0.5,
        near: 0.1,
        range: 60.0,
    };
    let lights =
        [Light::Directional { direction: DVec3::new(0.4, -1.0, -0.3) }, Light::Spot(spot), bulb];
    let options = Options {
        partition: Partition::slices(2),
        size: Size::Budget(768 * 768),
        ..Options::default()
    };
    let plan = set.plan(&lights, &options);
    let filter = Filter::Pcf { n: 2 };
    let reference = Reference::render(&set.tracer, &plan, filter, &|_| {}).unwrap();
    for (index, light) in lights.iter().enumerate() {
        let look = Look { camera: &set.camera, light, light_index: index as u32 };
        let shadow_options = ShadowOptions { filter, ..ShadowOptions::default() };
        let samples = draw(&set, &plan, &look, &shadow_options, GPU.support());
        let difference = compare(&set, &plan, (index, light), filter, &samples, &reference);
        check("lantern", &format!("light {index}"), filter, &difference);
    }
}

/// The world's origin is far away: the camera's matrices, the maps' and the instances' keep their digits.
#[needs(gpu)]
#[test]
fn a_million_metres_from_the_origin() {
    let mut scene = scene("pole");
    let offset = DVec3::new(1e6, -3e5, 2e6);
    for instance in &mut scene.instances {
        instance.world_from_mesh.translation += offset;
    }
    let near = crate::scene("pole");
    let mut set = Set::new(&scene, IMAGE);
    let look = near.default_view();
    set.camera = Camera::look_at(umbrage::LookAt {
        eye: look.eye + offset,
        target: look.target + offset,
        up: look.up,
        fov_y_rad: look.fov_y_rad,
        near: look.near,
        far: look.far,
        image: IMAGE,
    })
    .unwrap();
    let light = near.default_light().light;
    for (technique, options) in &techniques()[3..5] {
        let plan = set.plan(&[light], options);
        let look = Look { camera: &set.camera, light: &light, light_index: 0 };
        let samples = draw(&set, &plan, &look, &ShadowOptions::default(), GPU.support());
        let reference = Reference::render(&set.tracer, &plan, Filter::Hard, &|_| {}).unwrap();
        let difference = compare(&set, &plan, (0, &light), Filter::Hard, &samples, &reference);
        check("pole", technique, Filter::Hard, &difference);
    }
}
