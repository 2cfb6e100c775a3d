//! Soft shadows against the truth under lights with an extent.

mod common;

use common::{nobody, scene, sheet};
use glam::{DAffine3, DVec3, Vec3};
use umbrage::{Bounds, BoxTree, Camera, Light, LookAt, Planner, PointLight, Technique};
use umbrage_scene::{Mesh, Scene};
use umbrage_trace::{Reference, Sample, Tracer, View};

const DIAMETER: f64 = 0.1;
const LAMP: DVec3 = DVec3::new(2.6, 3.4, -1.7);

fn light() -> Light {
    Light::Point(PointLight { position: LAMP, near: 0.003, range: 30.0 })
}

/// The six sides of a box.
fn cuboid(min: Vec3, max: Vec3) -> Vec<Mesh> {
    let size = max - min;
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    [(min, x, y), (min, y, z), (min, z, x), (max, -x, -y), (max, -y, -z), (max, -z, -x)]
        .map(|(corner, a, b)| sheet(corner, a, b))
        .into()
}

/// A room of 8 × 4 × 8 metres, with or without its ceiling, with cubes that hang in the air, and
/// with something else.
fn room(has_ceiling: bool, more: Vec<Mesh>) -> Scene {
    let mut meshes = cuboid(Vec3::new(-4.0, 0.0, -4.0), Vec3::new(4.0, 4.0, 4.0));
    let is_ceiling = |mesh: &Mesh| mesh.positions.iter().all(|p| p.y == 4.0);
    meshes.retain(|mesh| has_ceiling || !is_ceiling(mesh));
    let cubes = [[1.0, 1.0, 1.0], [-1.2, 0.4, 0.9], [0.0, 3.0, -1.5], [-2.0, 2.0, -2.0]];
    for center in cubes.map(Vec3::from) {
        meshes.extend(cuboid(center - 0.15, center + 0.15));
    }
    meshes.extend(more);
    let instances: Vec<_> = (0..meshes.len()).map(|i| (i, DAffine3::IDENTITY)).collect();
    scene(meshes, &instances)
}

/// A view into the corner of the room that the lamp is far from.
fn camera() -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::new(3.5, 3.2, 3.5),
        target: DVec3::new(-1.0, 1.2, -1.0),
        up: DVec3::Y,
        fov_y_rad: 0.9,
        near: 0.05,
        far: 30.0,
        image: [80, 45],
    })
    .unwrap()
}

/// The share of a disc of light, turned towards a sample, that reaches the sample.
fn area_truth(tracer: &Tracer<'_>, sample: &Sample) -> f64 {
    const RAYS: u32 = 64;
    let position = sample.surface.position;
    let [a, b]: [DVec3; 2] = (LAMP - position).normalize().any_orthonormal_pair().into();
    let lit = (0..RAYS).filter(|&k| {
        // A sunflower's seeds are spread evenly over a disc.
        let (sin, cos) = (f64::from(k) * 2.399_963).sin_cos();
        let radius = 0.5 * DIAMETER * ((f64::from(k) + 0.5) / f64::from(RAYS)).sqrt();
        let to_light = LAMP + (a * cos + b * sin) * radius - position;
        !tracer.occluded_from(&sample.surface, to_light, 1.0)
    });
    lit.count() as f64 / f64::from(RAYS)
}

/// The visibility of what counts in the picture, by a filter and, as `None` tells, in truth.
fn seen(scene: &Scene, filter: Option<&str>) -> Vec<f64> {
    let tracer = Tracer::new(scene).unwrap();
    let view = View::new(&tracer, camera(), light(), 1).unwrap();
    let band = view.band(0..45, &nobody);
    let counted = |value: &(dyn Fn(&Sample) -> f64 + Sync)| {
        let values = band.map(|s| view.counts(s.is_facing, s.depth).then(|| value(s)), &nobody);
        values.into_iter().flatten().collect()
    };
    let Some(filter) = filter else { return counted(&|s| area_truth(&tracer, s)) };
    let technique: Technique = format!("uniform:{filter}@1024").parse().unwrap();
    let boxes = BoxTree::new(&tracer.boxes(64)).unwrap();
    let bounds = Bounds { receiver_parts: Some(&boxes), ..Bounds::of_scene(tracer.bounds()) };
    let mut planner = Planner::new();
    let plan = planner.plan(&camera(), &[light()], &bounds, &technique).unwrap();
    let reference = Reference::render(&tracer, plan, &nobody).unwrap();
    counted(&|s| f64::from(reference.visibility(0, s)))
}

fn mean_difference(a: &[f64], b: &[f64]) -> f64 {
    assert!(a.len() == b.len() && a.len() > 1000, "{} and {} samples", a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64
}

/// A lamp hangs in the box around all casters, so something could hang right at it as far as the
/// plan knows. The search for casters is nevertheless only as wide as what it finds asks for.
#[test]
fn a_lamp_in_a_room_throws_shadows_as_soft_as_its_size() {
    for has_ceiling in [true, false] {
        let room = room(has_ceiling, Vec::new());
        let truth = seen(&room, None);
        let [soft, hard, wide] = ["pcss(light=0.1m)", "hard", "pcf7"]
            .map(|filter| mean_difference(&seen(&room, Some(filter)), &truth));
        assert!(soft < 0.001 && soft < hard && soft < 0.5 * wide, "{soft}, {hard}, {wide}");
    }
}

/// A shade nearer to the bulb than the lamp's radius still casts.
#[test]
fn a_shade_at_the_bulb_casts() {
    let at = LAMP.as_vec3() + Vec3::new(-0.02, -0.004, -0.02);
    let shade = sheet(at, Vec3::X * 0.04, Vec3::Z * 0.04);
    let [with, without] =
        [vec![shade], Vec::new()].map(|more| seen(&room(true, more), Some("pcss(light=0.1m)")));
    let mean = |seen: &[f64]| seen.iter().sum::<f64>() / seen.len() as f64;
    assert!(mean(&with) < 0.7 * mean(&without));
}
