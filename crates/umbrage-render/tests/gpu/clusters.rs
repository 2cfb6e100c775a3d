//! Scenes drawn from clusters in levels of detail against the same scenes drawn whole.

use crate::pictures::read;
use crate::{GPU, Set, mesh_inputs, scene};
use glam::{DAffine3, DMat3, DVec3};
use umbrage::{Camera, Light, LookAt, PointLight, Technique};
use umbrage_clusters::{ClusterMesh, build_all};
use umbrage_render::{EdgeOn, Error, FrameTarget, Renderer, Sample, SceneBuffers, Shading};
use umbrage_scene::{Moved, Scene};
use umbrage_testing::needs;
use umbrage_trace::View;
use umbrage_wgpu::{Casters, ShadowOptions};

const IMAGE: [u32; 2] = [240, 135];

fn clusters(scene: &Scene) -> Vec<ClusterMesh> {
    build_all(&mesh_inputs(scene), &|_| {}).unwrap()
}

fn clustered(scene: &Scene) -> SceneBuffers {
    let buffers = SceneBuffers::with_clusters(&GPU, scene, false, Some(&clusters(scene))).unwrap();
    assert!(buffers.has_clusters());
    buffers
}

/// The samples of a scene in one light, from clusters and from all triangles.
fn both(set: &Set<'_>, light: &Light, technique: &Technique) -> [Vec<Sample>; 2] {
    let plan = set.plan(&[*light], technique);
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    let shading = Shading { camera: &set.camera, light, light_index: 0 };
    [clustered(set.scene), SceneBuffers::new(&GPU, set.scene, false).unwrap()].map(|buffers| {
        let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        renderer.samples(&shading, 0..IMAGE[1], 1, true).unwrap()
    })
}

/// Levels of detail change hardly anything of a picture, and are no farther from the truth than all
/// triangles are.
fn agrees(name: &str, set: &Set<'_>, light: &Light, technique: &str) {
    let technique: Technique = technique.parse().unwrap();
    let [found, whole] = both(set, light, &technique);
    let view = View::new(&set.tracer, set.camera, *light, 1).unwrap();
    let band = view.band(0..IMAGE[1], &|_| {});
    // The sky has no truth, nor has what faces away.
    let of_pixels: Vec<Option<f32>> = band
        .samples()
        .iter()
        .map(|sample| sample.as_ref().filter(|s| s.is_facing).map(|s| view.truth(s)))
        .collect();
    let wrong = |samples: &[Sample]| {
        let pairs = of_pixels.iter().zip(samples);
        pairs.filter(|(t, s)| t.is_some_and(|t| (t - s.visibility).abs() > 0.5)).count()
    };
    let counted = of_pixels.iter().flatten().count();
    let surfaces = found
        .iter()
        .zip(&whole)
        .filter(|(a, b)| {
            let is_sky = |s: &Sample| !s.depth.is_finite();
            is_sky(a) != is_sky(b) || (a.depth / b.depth - 1.0).abs() > 0.02
        })
        .count();
    let maps = found.iter().zip(&whole).filter(|(a, b)| a.map != b.map).count();
    let wrong = [wrong(&found), wrong(&whole)];
    let told =
        format!("{name}, {technique}: {wrong:?} of {counted} wrong, {surfaces} surfaces differ");
    assert!(counted > 1000, "{told}");
    assert!(maps * 100 < found.len(), "{told}, {maps} maps differ");
    // A sixteenth of a pixel of error moves edges over that share of pixels' centres.
    assert!(surfaces * 100 < found.len(), "{told}");
    assert!(wrong[0] * 10 <= wrong[1] * 11 + counted / 100, "{told}");
}

#[needs(gpu)]
#[test]
fn levels_of_detail_cast_and_show_what_the_mesh_does() {
    for (name, technique) in
        [("town:20", "adaptive+z2@768"), ("fence", "lispsm@512"), ("statues:2", "uniform+z4@768")]
    {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        agrees(name, &set, &set.light(), technique);
    }
    // A bulb, whose map has six sides.
    let scene = scene("lantern");
    let set = Set::new(&scene, IMAGE);
    agrees("lantern", &set, &set.light(), "uniform@768");
}

#[needs(gpu, scenes)]
#[test]
fn leaves_with_holes_keep_them() {
    let scene = scene("trees/forest_eztree.glb");
    let set = Set::new(&scene, IMAGE);
    agrees("forest", &set, &set.light(), "adaptive+z2:pcf3@1024");
}

/// Instances that are mirrored, stretched, and far from the world's origin.
#[needs(gpu)]
#[test]
fn odd_instances_are_where_they_should_be() {
    let mut scene = scene("town:20");
    let offset = DVec3::new(1e6, -3e5, 2e6);
    let view = scene.default_view();
    let light = scene.light_for_view(&view).light;
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.3, 1.0));
    for instance in &mut scene.instances {
        let turned = DAffine3 { matrix3: mirror, translation: offset };
        instance.world_from_mesh = turned * instance.world_from_mesh;
    }
    let mut set = Set::new(&scene, IMAGE);
    let place = |p: DVec3| offset + mirror * p;
    set.camera = Camera::look_at(LookAt {
        eye: place(view.eye),
        target: place(view.target),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 400.0,
        image: IMAGE,
    })
    .unwrap();
    agrees("mirrored town", &set, &light, "adaptive+z2@768");
}

/// What is hidden is left out of frames that follow one another, and none of them shows it.
#[needs(gpu)]
#[test]
fn nothing_hidden_shows() {
    let scene = scene("town:60");
    let set = Set::new(&scene, [480, 270]);
    let light = set.light();
    let plan = set.plan(&[light], &"uniform@256".parse().unwrap());
    let buffers = clustered(&scene);
    let target = FrameTarget::new(&GPU, set.camera.image()).unwrap();
    let options = ShadowOptions::default();
    let mut walking = Renderer::new(&GPU, &buffers, &options).unwrap();
    let view = scene.default_view();
    let ahead = (view.target - view.eye).normalize();
    let mut left_out = 0;
    for step in 0..6 {
        // Forward, then around the corner, with a jump in between.
        let eye = view.eye + ahead * [0.0, 0.3, 0.6, 15.0, 15.0, 15.2][step];
        let turn = DMat3::from_rotation_y([0.0, 0.02, 0.05, 0.4, 1.4, 1.45][step]);
        let camera = Camera::look_at(LookAt {
            eye,
            target: eye + turn * ahead,
            up: DVec3::Y,
            fov_y_rad: 1.0,
            near: 0.1,
            far: 2000.0,
            image: [480, 270],
        })
        .unwrap();
        let shading = Shading { camera: &camera, light: &light, light_index: 0 };
        let mut fresh = Renderer::new(&GPU, &buffers, &options).unwrap();
        let pictures = [&mut walking, &mut fresh].map(|renderer| {
            renderer.draw_maps_seen_from(eye, &plan, Casters::Unmoved, None).unwrap();
            let drawn = renderer.frame(&shading, &target, None).unwrap();
            (read(&target), drawn.triangles)
        });
        let [(found, fewer), (expected, all)] = pictures;
        assert!(fewer <= all, "step {step}: {fewer} of {all} triangles");
        left_out += all - fewer;
        let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert!(differing * 10_000 <= found.len(), "step {step}: {differing} pixels differ");
    }
    assert!(left_out > 10_000, "{left_out} triangles were left out");
}

/// A lamp in the plane of a caster, whose maps leave out the triangle: all others still cast.
#[needs(gpu)]
#[test]
fn triangles_that_a_lamp_lies_in_are_left_out() {
    let scene = scene("town:10");
    let set = Set::new(&scene, IMAGE);
    let light = Light::Point(PointLight { position: set.camera.eye(), near: 0.05, range: 200.0 });
    let technique: Technique = "uniform@512".parse().unwrap();
    let plan = set.plan(&[light], &technique);
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let edge_on = vec![EdgeOn { light: 0, instance: 0, triangle: 0 }];
    let [a, b] =
        [clustered(&scene), SceneBuffers::new(&GPU, &scene, false).unwrap()].map(|buffers| {
            let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
            renderer.leave_out(edge_on.clone());
            renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
            renderer.samples(&shading, 0..IMAGE[1], 1, false).unwrap()
        });
    let differs = |(a, b): &(&Sample, &Sample)| (a.visibility - b.visibility).abs() > 0.5;
    let differing = a.iter().zip(&b).filter(differs).count();
    assert!(differing * 100 < a.len(), "{differing}");
}

#[needs(gpu)]
#[test]
fn what_does_not_fit_is_refused() {
    let scene = scene("town:4");
    let field = |error: Error| match error {
        Error::Invalid { field, .. } => field,
        other => panic!("{other}"),
    };
    let mut own = clusters(&scene);
    own.pop();
    let error = SceneBuffers::with_clusters(&GPU, &scene, false, Some(&own)).err().unwrap();
    assert_eq!(field(error), "clusters");
    let buffers = clustered(&scene);
    let still = Moved::default();
    assert!(buffers.pose(&GPU, &scene, &still).is_ok());
    let moved = Moved { instances: vec![0], ..Moved::default() };
    assert_eq!(field(buffers.pose(&GPU, &scene, &moved).unwrap_err()), "clusters");
}
