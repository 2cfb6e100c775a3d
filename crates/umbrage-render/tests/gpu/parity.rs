//! The pictures of the GPU against those of the reference, which casts a ray through every texel.

use crate::pages::buffers as page_buffers;
use crate::{GPU, Set, mesh_inputs, scene};
use glam::{DAffine3, DVec3, Quat, Vec2, Vec3, Vec4};
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};
use umbrage::{Camera, Light, LookAt, Plan, PointLight, Size, SpotLight, Technique};
use umbrage_clusters::build_finest;
use umbrage_render::{EdgeOn, Renderer, Sample, SceneBuffers, Shading};
use umbrage_scene::{
    Alpha, Instance, Lens, Material, Mesh, Sampling, Scene, Texture, TextureId, Wrap,
};
use umbrage_testing::needs;
use umbrage_trace::{Reference, View};
use umbrage_wgpu::{Casters, Comparison, Layout, LookupBuffers, ShadowOptions, Support};

const IMAGE: [u32; 2] = [240, 135];

/// Every warp that a GPU can draw and every partition, each at least once.
const TECHNIQUES: [&str; 10] = [
    "unfocused@512",
    "uniform+z4@512",
    "uniform(stable)+z4(practical=0.5)@512",
    "psm@512",
    "lispsm@512",
    "lispsm+face@512",
    "tsm+z2+face(sides)@512",
    "adaptive+z3(fitted,overlap=0.2)@512",
    "adaptive(area)@512",
    "lambda=5@512",
];

/// A technique of the list with another filter.
fn technique(text: &str, filter: Filter) -> Technique {
    Technique { filter, ..text.parse().unwrap() }
}

/// One of the techniques with about half of the texels, for tests of many filters.
fn small(index: usize, filter: Filter) -> Technique {
    Technique { size: Size::Budget(384 * 384), ..technique(TECHNIQUES[index], filter) }
}

/// Numbers of counted samples in which the pictures of the GPU and the reference differ.
struct Difference {
    counted: usize,
    /// Visibility differs by more than 1/2.
    visibility: usize,
    /// The surface differs: edges by the rasteriser and by rays differ by some 512th of a pixel.
    surface: usize,
    /// The map or the texel differs.
    place: usize,
    /// Pixels per texel differ by more than 2%.
    error: usize,
    /// The colour differs although visibility is the same.
    color: usize,
}

fn compare(
    set: &Set<'_>,
    plan: &Plan,
    light: (usize, &Light),
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
        if !view.counts(sample.is_facing, sample.depth) {
            continue;
        }
        d.counted += 1;
        let differs = (gpu.visibility - expected).abs() > 0.5;
        d.visibility += usize::from(differs);
        let place = reference.texel(light.0, sample.surface.position);
        let map = place.map(|p| p.map as u32);
        let texel = place.map_or(0.0, |p| (p.texel - gpu.texel.as_dvec2()).length());
        // A texel may be several pixels wide, or a pixel several texels.
        d.place +=
            usize::from(map != gpu.map || (map.is_some() && (texel.is_nan() || texel >= 0.1)));
        let error = place.and_then(|p| {
            let surface = &sample.surface;
            plan.maps[p.map].surface_error(&set.camera, surface.position, surface.geometric_normal)
        });
        // Where the light grazes a surface, rounding decides how many pixels a texel is wide.
        let error = error.filter(|e| e.worst < 1e4);
        let error = error.map_or(0.0, |e| f64::from(gpu.error) / e.worst - 1.0);
        d.error += usize::from(error.abs() > 0.02);
        let color = umbrage_trace::shade::radiance(light.1, sample, expected);
        let is_same = (gpu.visibility - expected).abs() < 1e-3;
        d.color += usize::from(is_same && (color - gpu.radiance).abs().max_element() > 0.02);
    }
    assert!(d.counted > 200, "{}: {} samples count", plan.filter, d.counted);
    d
}

fn draw(
    set: &Set<'_>,
    plan: &Plan,
    shading: &Shading<'_>,
    options: &ShadowOptions,
    support: Support,
) -> Vec<Sample> {
    let buffers = SceneBuffers::new(&GPU, set.scene, false).unwrap();
    if plan.paging.is_some() {
        let finest = || build_finest(&mesh_inputs(set.scene));
        buffers.make_pages(&GPU, set.scene, finest).unwrap();
    }
    let mut renderer = Renderer::with_support(&GPU, &buffers, options, support).unwrap();
    renderer.draw_maps(plan, Casters::Unmoved, None).unwrap();
    renderer.samples(shading, 0..set.camera.image()[1], 1, true).unwrap()
}

/// Checks the shares of counted samples that may differ.
fn check(name: &str, technique: &Technique, d: &Difference) {
    let share = |n: usize| n as f64 / d.counted as f64;
    let text = format!(
        "{name}, {technique}: visibility {:.4}, surface {:.4}, place {:.4}, error {:.4}, color {:.4} of {}",
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

/// Compares several techniques in a scene's default view and light.
///
/// The indices refer to [`TECHNIQUES`]. Every scene gets some of them, and every technique at least
/// two scenes.
fn agrees(name: &str, indices: impl IntoIterator<Item = usize>) {
    let scene = scene(name);
    let set = Set::new(&scene, IMAGE);
    for (i, index) in indices.into_iter().enumerate() {
        let filter = if i % 2 == 0 { Filter::Hard } else { Filter::Pcf { n: 3 } };
        agrees_with(name, &set, &technique(TECHNIQUES[index], filter));
    }
}

/// Compares one technique in a scene's default light.
pub(crate) fn agrees_with(name: &str, set: &Set<'_>, technique: &Technique) {
    agrees_under(name, set, set.light(), technique);
}

fn options_for(technique: &Technique) -> ShadowOptions {
    let pages = technique.paged_error().is_some();
    ShadowOptions { filter: technique.filter, pages, ..ShadowOptions::default() }
}

/// Compares one technique in a light.
fn agrees_under(name: &str, set: &Set<'_>, light: Light, technique: &Technique) {
    let plan = set.plan(&[light], technique);
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let options = options_for(technique);
    let samples = draw(set, &plan, &shading, &options, GPU.support());
    let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
    let difference = compare(set, &plan, (0, &light), &samples, &reference);
    check(name, technique, &difference);
}

#[needs(gpu)]
#[test]
fn in_a_town() {
    agrees("town:40", 0..TECHNIQUES.len());
}

#[needs(gpu)]
#[test]
fn on_an_airfield() {
    agrees("airfield", [1, 3, 5, 7]);
}

#[needs(gpu)]
#[test]
fn among_statues() {
    agrees("statues", [0, 4, 8]);
}

#[needs(gpu)]
#[test]
fn in_a_grove() {
    agrees("grove", [2, 6, 9]);
}

#[needs(gpu)]
#[test]
fn at_a_fence() {
    agrees("fence", [1, 4, 7]);
}

/// Where the light grazes the ground, all depths of the ground lie within less than a texel of a
/// map, and the rasteriser may draw it beside its place. The ground does not shadow itself there.
#[needs(gpu)]
#[test]
fn under_suns_at_the_horizon() {
    let scene = scene("airfield");
    let set = Set::new(&scene, IMAGE);
    for elevation_deg in [0.1f64, 0.05, 0.01, 0.001, -0.1] {
        let down = elevation_deg.to_radians().tan();
        let light = Light::Directional { direction: DVec3::new(0.8, -down, -0.6) };
        let technique = technique("uniform@512", Filter::Hard);
        let plan = set.plan(&[light], &technique);
        let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
        let drawn = draw(&set, &plan, &shading, &ShadowOptions::default(), GPU.support());
        let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
        let view = View::new(&set.tracer, set.camera, light, 1).unwrap();
        let band = view.band(0..IMAGE[1], &|_| {});
        let wrong = |visibility: &dyn Fn(usize, &umbrage_trace::Sample) -> f32| {
            let samples = band.samples().iter().enumerate();
            let seen = samples.filter_map(|(i, s)| Some((i, s.as_ref()?)));
            let counted = seen.filter(|(_, s)| view.counts(s.is_facing, s.depth));
            counted.filter(|(i, s)| (view.truth(s) - visibility(*i, s)).abs() > 0.5).count()
        };
        let by_rays = wrong(&|_, sample| reference.visibility(0, sample));
        let by_gpu = wrong(&|i, _| drawn[i].visibility);
        // The share is of all pixels, many of which face away from the sun.
        let most = by_rays + drawn.len() / 500;
        assert!(by_gpu <= most, "{elevation_deg}°: {by_gpu} pixels, by rays {by_rays}");
    }
}

/// A point light, which has six or more maps.
/// A ground, and three sheets with holes that stand on it: cut by the pixels of a texture that is
/// sampled to the nearest, by the alpha of the vertices, and by both.
fn cut_out() -> Scene {
    let material = |texture, cutoff| Material {
        name: "cut out".into(),
        base_color: Vec4::new(0.8, 0.6, 0.5, 1.0),
        base_color_texture: texture,
        alpha: Alpha::Mask { cutoff },
        double_sided: true,
    };
    let sheet = |corner: Vec3, u: Vec3, v: Vec3, alphas: &[f32], material| Mesh {
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        normals: vec![u.cross(v).normalize(); 4],
        uvs: vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
        alphas: alphas.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
    };
    let standing = |x: f32, alphas: &[f32], material| {
        sheet(Vec3::new(x, 0.1, 0.0), Vec3::X * 1.8, Vec3::Y * 2.0, alphas, material)
    };
    let ground = Vec3::new(-5.0, 0.0, 4.0);
    let ramp = [1.0, 0.0, 0.3, 1.0];
    Scene {
        meshes: vec![
            // An alpha that equals the cutoff leaves no hole.
            sheet(ground, Vec3::X * 10.0, Vec3::Z * -8.0, &[0.3; 4], 2),
            standing(-3.0, &[], 0),
            standing(-0.9, &ramp, 1),
            standing(1.2, &ramp, 0),
        ],
        instances: (0..4)
            .map(|mesh| Instance { mesh, world_from_mesh: DAffine3::IDENTITY })
            .collect(),
        materials: vec![
            material(Some(TextureId(0)), 0.5),
            material(None, 0.5),
            material(None, 0.3),
        ],
        textures: vec![Texture {
            size: [4, 4],
            rgba: (0..16u32).map(|i| [90, 200, 120, [255, 0, 150][i as usize * 5 % 3]]).collect(),
            wrap: [Wrap::Clamp; 2],
            sampling: Sampling::Nearest,
        }],
        ..Scene::default()
    }
}

#[needs(gpu)]
#[test]
fn behind_sheets_with_holes() {
    let scene = cut_out();
    let set = Set::new(&scene, IMAGE);
    agrees_with("cut out", &set, &technique(TECHNIQUES[1], Filter::Hard));
    agrees_with("cut out", &set, &technique(TECHNIQUES[7], Filter::Pcf { n: 3 }));
}

#[needs(gpu)]
#[test]
fn around_a_lantern() {
    agrees("lantern", [1, 4, 7, 9]);
}

#[needs(gpu, scenes)]
#[test]
fn on_a_race_track() {
    agrees("vehicles/kenney_racing_level.glb", [2, 3, 5, 8]);
}

/// Casters with alpha masks.
#[needs(gpu, scenes)]
#[test]
fn in_a_forest() {
    agrees("trees/forest_eztree.glb", [0, 6, 7]);
}

#[needs(gpu, scenes)]
#[test]
fn in_an_atrium() {
    agrees("atrium/sponza_atrium_reduced.glb", [1, 5, 9]);
}

#[needs(gpu, scenes)]
#[test]
fn over_kilometres_of_terrain() {
    agrees("terrain/jacksboro_dem_terrain.glb", [3, 4, 8]);
}

#[needs(gpu, scenes)]
#[test]
fn in_a_house_of_centimetres() {
    agrees("house/house.glb", [2, 4, 6]);
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
        for index in [2, 4, 8] {
            let technique = technique(TECHNIQUES[index], Filter::Hard);
            agrees_with(&format!("statues x {scale}"), &set, &technique);
        }
    }
}

/// Whatever features a device lacks, the picture is the same, except for the accuracy that
/// comparisons by the texture unit cost.
#[needs(gpu)]
#[test]
fn every_fallback_draws_the_same_picture() {
    let scene = scene("town:20");
    let set = Set::new(&scene, IMAGE);
    let light = set.light();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let all = GPU.support();
    for filter in [Filter::Hard, Filter::Pcf { n: 3 }] {
        let technique = technique(TECHNIQUES[7], filter);
        let plan = set.plan(&[light], &technique);
        let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
        let difference = |options: ShadowOptions, support| {
            let samples = draw(&set, &plan, &shading, &options, support);
            compare(&set, &plan, (0, &light), &samples, &reference)
        };
        let base = ShadowOptions { filter, ..ShadowOptions::default() };
        for (lacking, options, support) in [
            ("clamping", base, Support { depth_clip_control: false, ..all }),
            ("storage", base, Support { storage_buffers: false, ..all }),
            ("uniforms", ShadowOptions { buffers: LookupBuffers::Storage, ..base }, all),
            ("layers", ShadowOptions { layout: Layout::Layers, ..base }, all),
        ] {
            let name = format!("town without {lacking}");
            check(&name, &technique, &difference(options, support));
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

/// Without shadows nothing is drawn into maps, and every counted sample is lit, on every device and
/// by the reference.
#[needs(gpu)]
#[test]
fn no_shadows() {
    let scene = scene("lantern");
    let set = Set::new(&scene, IMAGE);
    let light = set.light();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let technique = technique("none", Filter::None);
    let plan = set.plan(&[light], &technique);
    let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
    let all = GPU.support();
    let base = ShadowOptions { filter: Filter::None, ..ShadowOptions::default() };
    for (options, support) in [
        (base, all),
        (base, Support { storage_buffers: false, ..all }),
        (base, Support { depth_fetch: false, ..all }),
        (ShadowOptions { layout: Layout::Layers, ..base }, all),
        (ShadowOptions { comparison: Comparison::Hardware, ..base }, all),
    ] {
        let buffers = SceneBuffers::new(&GPU, set.scene, false).unwrap();
        let mut renderer = Renderer::with_support(&GPU, &buffers, &options, support).unwrap();
        assert_eq!(renderer.draw_maps(&plan, Casters::Moved, None).unwrap(), []);
        assert_eq!(renderer.shadows().lookup_bytes(), 0);
        let samples = renderer.samples(&shading, 0..IMAGE[1], 1, true).unwrap();
        let difference = compare(&set, &plan, (0, &light), &samples, &reference);
        check("lantern", &technique, &difference);
        assert!(samples.iter().all(|s| !s.is_facing || s.visibility == 1.0));
        assert!(samples.iter().all(|s| s.map.is_none() && s.error.is_nan()));
    }
}

/// A lamp in the very plane of a roof, which is edge-on to it and hides nothing.
#[needs(gpu)]
#[test]
fn a_lamp_lies_in_a_roof() {
    for (tilt, turn) in [(0.0, 0.0), (0.3, 0.4), (-0.25, 1.1), (0.2, -2.3), (-0.1, 2.9)] {
        let mut scene = scene("pole");
        let lamp = Vec3::new(1.5, 5.5, 1.0);
        let rotation = Quat::from_rotation_y(turn) * Quat::from_rotation_x(tilt);
        // The lamp's foot lies amid one of the two triangles. The corners are rounded.
        let corners = [[-5.0, -4.0], [3.0, -4.0], [3.0, 6.0], [-5.0, 6.0]];
        let corner = |[x, z]: [f32; 2]| lamp + rotation * Vec3::new(x, 0.0, z);
        let roof = Mesh {
            positions: corners.map(corner).to_vec(),
            normals: vec![rotation * Vec3::NEG_Y; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        scene.meshes.push(roof);
        let mesh = scene.meshes.len() - 1;
        scene.instances.push(Instance { mesh, world_from_mesh: DAffine3::IDENTITY });
        let mut set = Set::new(&scene, IMAGE);
        set.camera = Camera::look_at(LookAt {
            eye: DVec3::new(-4.0, 2.5, 8.0),
            target: DVec3::new(0.5, 0.5, 0.0),
            up: DVec3::Y,
            fov_y_rad: 0.8,
            near: 0.1,
            far: 60.0,
            image: IMAGE,
        })
        .unwrap();
        let position = lamp.as_dvec3();
        let light = Light::Point(PointLight { position, near: 0.01, range: 60.0 });
        let edge_on = set.tracer.edge_on_at(position).into_iter().map(|p| EdgeOn {
            light: 0,
            instance: p.instance as usize,
            triangle: p.triangle,
        });
        let edge_on: Vec<EdgeOn> = edge_on.collect();
        assert!(!edge_on.is_empty(), "tilted by {tilt}, turned by {turn}");
        for text in ["uniform@512", "paged"] {
            let technique: Technique = text.parse().unwrap();
            let plan = set.plan(&[light], &technique);
            let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
            let buffers = page_buffers(set.scene);
            let pages = plan.paging.is_some();
            let options = ShadowOptions { pages, ..ShadowOptions::default() };
            let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
            renderer.leave_out(edge_on.clone());
            renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
            let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
            let samples = renderer.samples(&shading, 0..IMAGE[1], 1, true).unwrap();
            let difference = compare(&set, &plan, (0, &light), &samples, &reference);
            let what = format!("roof tilted by {tilt}, turned by {turn}");
            check(&what, &technique, &difference);
            let view = View::new(&set.tracer, set.camera, light, 1).unwrap();
            let band = view.band(0..IMAGE[1], &|_| {});
            let truth = band.map(|s| s.is_facing.then(|| view.truth(s)), &|_| {});
            let pairs = truth.iter().zip(&samples).filter_map(|(t, s)| Some((t.as_ref()?, s)));
            let wrong = pairs.filter(|(t, s)| (**t - s.visibility).abs() > 0.5).count();
            let counted = difference.counted;
            assert!(wrong * 100 < counted, "{what}, {text}: {wrong} of {counted} wrong");
        }
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

/// Every prefilter, under a uniform map, a warp and slices.
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
            let half = i % 2 == 1;
            let filter = Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(5), half });
            agrees_with(name, &set, &small([1, 4, 7][i % 3], filter));
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

/// Widths in pixels and in metres, which use mip levels and several samples along a footprint.
fn every_width(scenes: &[&str]) {
    let csm = Statistic::Csm(Csm::new(8, 0.0, false, true).unwrap());
    let prefilter = |statistic, width| {
        let half = width == Width::Metres(0.6);
        Filter::Prefiltered(Prefilter { statistic, blur: Blur::Width(width), half })
    };
    for name in scenes {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        // A diameter of 0.3: per metre of distance for a sun, in metres for a spot or point light.
        let is_sun = matches!(set.light(), Light::Directional { .. });
        let light = if is_sun { LightSize::Degrees(17.1) } else { LightSize::Metres(0.3) };
        let filters = [
            Filter::Spread { n: 5, width: Width::Pixels(3.0), pattern: Pattern::Grid },
            Filter::Spread { n: 4, width: Width::Metres(0.5), pattern: Pattern::Grid },
            Filter::Spread { n: 6, width: Width::Metres(0.4), pattern: Pattern::Poisson },
            Filter::Pcss { n: 6, light },
            prefilter(Statistic::Vsm(Vsm::default()), Width::Pixels(4.0)),
            prefilter(csm, Width::Pixels(2.0)),
            prefilter(csm, Width::Metres(0.6)),
            prefilter(Statistic::Msm(Msm::default()), Width::Metres(3.0)),
        ];
        for (i, filter) in filters.into_iter().enumerate() {
            agrees_with(name, &set, &small([1, 4, 7][i % 3], filter));
        }
    }
}

/// A sun, a spot light at the viewer, a wide one there, and the scene's own bulb.
pub(crate) fn four_lights(set: &Set<'_>) -> [Light; 4] {
    let bulb = set.light();
    let spot = SpotLight {
        position: set.camera.eye() + DVec3::Y,
        direction: set.camera.forward(),
        half_angle_rad: 0.5,
        near: 0.1,
        range: 60.0,
    };
    let wide = SpotLight { half_angle_rad: std::f64::consts::FRAC_PI_2, ..spot };
    let sun = Light::Directional { direction: DVec3::new(0.4, -1.0, -0.3) };
    [sun, Light::Spot(spot), Light::Spot(wide), bulb]
}

/// Checks each of several lights of one plan.
pub(crate) fn agrees_with_lights(
    name: &str,
    set: &Set<'_>,
    lights: &[Light],
    technique: &Technique,
) {
    let plan = set.plan(lights, technique);
    let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
    for (index, light) in lights.iter().enumerate() {
        let shading = Shading { camera: &set.camera, light, light_index: index as u32 };
        let options = ShadowOptions {
            buffers: LookupBuffers::for_technique(technique, lights.len()),
            ..options_for(technique)
        };
        let samples = draw(set, &plan, &shading, &options, GPU.support());
        let difference = compare(set, &plan, (index, light), &samples, &reference);
        check(&format!("{name}, light {index}"), technique, &difference);
    }
}

/// A directional, a spot, a wide spot and a point light in one plan, each looked up separately.
#[needs(gpu)]
#[test]
fn several_lights_share_a_plan() {
    let scene = scene("lantern");
    let set = Set::new(&scene, IMAGE);
    let technique = technique("adaptive+z2@768", Filter::Pcf { n: 2 });
    agrees_with_lights("lantern", &set, &four_lights(&set), &technique);
}

/// An orthographic camera whose near plane lies behind the eye, with every kind of light, map and
/// width.
#[needs(gpu)]
#[test]
fn through_an_orthographic_camera() {
    let scene = scene("lantern");
    let mut set = Set::new(&scene, IMAGE);
    let lights = four_lights(&set);
    let mut view = scene.default_view();
    view.eye += (view.target - view.eye) * 0.5;
    view.lens = Lens::Orthographic { height: view.eye.distance(view.target) };
    view.near = -0.1 * view.eye.distance(view.target);
    set.camera = view.camera(IMAGE).unwrap();
    let blur = Prefilter {
        statistic: Statistic::Vsm(Vsm::default()),
        blur: Blur::Width(Width::Pixels(3.0)),
        half: false,
    };
    let spread = Filter::Spread { n: 5, width: Width::Pixels(3.0), pattern: Pattern::Grid };
    for (index, filter) in [
        (1, Filter::Hard),
        (2, Filter::Pcf { n: 2 }),
        (3, Filter::Hard),
        (5, spread),
        (7, Filter::Prefiltered(blur)),
    ] {
        agrees_with_lights("lantern", &set, &lights, &small(index, filter));
    }
}

/// Far from the world's origin, the matrices of the camera, the maps and the instances keep their
/// precision.
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
    let mut look = near.default_view();
    look.eye += offset;
    look.target += offset;
    set.camera = look.camera(IMAGE).unwrap();
    let light = near.default_light().light;
    for text in &TECHNIQUES[3..5] {
        agrees_under("pole", &set, light, &technique(text, Filter::Hard));
    }
}

/// A mesh whose own positions are far from its origin, as in map coordinates, is drawn where it is,
/// also for a viewer between the numbers that single precision has there.
#[needs(gpu)]
#[test]
fn a_mesh_far_from_its_own_origin() {
    let near = scene("pole");
    let mut scene = near.clone();
    let offset = Vec3::new(1_048_576.0, 0.0, -524_288.0);
    for position in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
        *position = (*position * 8.0).round() / 8.0 + offset;
    }
    let mut set = Set::new(&scene, IMAGE);
    let mut look = near.default_view();
    look.eye += offset.as_dvec3() + DVec3::new(0.031, 0.0, -0.027);
    look.target += offset.as_dvec3();
    set.camera = look.camera(IMAGE).unwrap();
    let light = near.default_light().light;
    agrees_under("pole", &set, light, &technique(TECHNIQUES[4], Filter::Hard));
}

/// Maps stay where they are when the camera moves away from that of their plan, and surfaces that
/// they do not hold are lit.
#[needs(gpu)]
#[test]
fn another_camera_sees_a_plan() {
    let scene = scene("town:20");
    let set = Set::new(&scene, IMAGE);
    let mut moved = Set::new(&scene, IMAGE);
    let eye = set.camera.eye() + DVec3::new(7.0, 3.0, -5.0);
    moved.camera = Camera::look_at(LookAt {
        eye,
        target: eye + set.camera.forward() + DVec3::new(0.3, -0.1, 0.2),
        up: DVec3::Y,
        fov_y_rad: 0.9,
        near: set.camera.near(),
        far: set.camera.far(),
        image: IMAGE,
    })
    .unwrap();
    let light = set.light();
    let shading = Shading { camera: &moved.camera, light: &light, light_index: 0 };
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    for (index, filter) in [(1, Filter::Hard), (4, Filter::Pcf { n: 3 }), (6, Filter::Hard)] {
        let technique = technique(TECHNIQUES[index], filter);
        let plan = set.plan(&[light], &technique);
        let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
        let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
        let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        let again = renderer.draw_maps_seen_from(eye, &plan, Casters::Unmoved, None).unwrap();
        assert_eq!(again, [], "drawn again for another eye");
        let samples = renderer.samples(&shading, 0..IMAGE[1], 1, true).unwrap();
        check("moved", &technique, &compare(&moved, &plan, (0, &light), &samples, &reference));
    }
}
