//! [`View::sees`]: points that one view shows, as seen by another view.

mod common;

use common::{Random, all_hits, at, ground, nobody, scene, soup, sphere};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use umbrage::{Camera, Light, LookAt, SpotLight};
use umbrage_scene::Scene;
use umbrage_trace::{Ray, Sample, Surface, Tracer, View};

const IMAGE: [u32; 2] = [48, 36];
const FOV_Y_RAD: f64 = 1.0;

/// Spheres, some of which intersect, and loose triangles over a ground.
fn clutter() -> Scene {
    let mut random = Random(5);
    let mut leaf = || {
        let center = random.vector(6.0);
        [0; 3].map(|_| (center + random.vector(1.5)).as_vec3() + 3.0 * Vec3::Y)
    };
    let leaves = soup(&[0; 40].map(|_| leaf()));
    let meshes = vec![ground(15.0), sphere(Vec3::ZERO, 1.5, 10), leaves];
    let mut instances = vec![(0, DAffine3::IDENTITY), (2, DAffine3::IDENTITY)];
    instances.extend(
        [(-4.0, 1.0), (0.0, 2.0), (1.0, 2.5), (5.0, -3.0)].map(|(x, z)| (1, at(x, 1.0, z))),
    );
    scene(meshes, &instances)
}

fn look(eye: DVec3, target: DVec3, near: f64) -> LookAt {
    LookAt { eye, target, up: DVec3::Y, fov_y_rad: FOV_Y_RAD, near, far: 12.0, image: IMAGE }
}

fn samples(view: &View<'_>) -> Vec<Sample> {
    view.band(0..IMAGE[1], &nobody).samples().iter().flatten().copied().collect()
}

/// Why a view does not see a point.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Why {
    Behind,
    TooNear,
    Outside,
    TurnedAway,
    Hidden,
}

/// Whether a view sees a point of a surface that was seen from `first_eye`, found by brute force
/// over all triangles; `None` where rounding decides.
fn seen(
    scene: &Scene,
    look: &LookAt,
    surface: &Surface,
    first_eye: DVec3,
) -> Option<Result<f64, Why>> {
    let forward = (look.target - look.eye).normalize();
    let right = forward.cross(look.up).normalize();
    let up = right.cross(forward);
    let to = surface.position - look.eye;
    let depth = to.dot(forward);
    let half_height = depth * (FOV_Y_RAD / 2.0).tan();
    let half_width = half_height * f64::from(IMAGE[0]) / f64::from(IMAGE[1]);
    let inside = (half_width - to.dot(right).abs()).min(half_height - to.dot(up).abs());
    // The second eye sees the point only if both eyes are on the same side of the triangle's plane.
    let instance = &scene.instances[surface.primitive.instance as usize];
    let mesh = &scene.meshes[instance.mesh];
    let [a, b, c] = mesh.triangles[surface.primitive.triangle as usize]
        .map(|i| instance.world_from_mesh.transform_point3(mesh.positions[i as usize].as_dvec3()));
    let normal = (b - a).cross(c - a).normalize();
    let sides = [look.eye, first_eye].map(|eye| normal.dot(eye - a));
    let blockers = all_hits(scene, Ray { origin: look.eye, direction: to });
    let blockers = blockers.into_iter().filter(|(_, primitive, _)| *primitive != surface.primitive);
    let mut hides = false;
    for (t, _, margin) in blockers {
        let clear = (t * depth - look.near).abs().min((1.0 - t).abs() * depth).min(margin) > 1e-6;
        let is_between = t * depth > look.near - 1e-6 && t < 1.0 + 1e-6;
        if is_between && !clear {
            return None;
        }
        hides |= is_between && t < 1.0;
    }
    if [depth, depth - look.near, inside, sides[0]].iter().any(|m| m.abs() < 1e-6) {
        return None;
    }
    Some(match () {
        () if depth < 0.0 => Err(Why::Behind),
        () if depth < look.near => Err(Why::TooNear),
        () if inside < 0.0 => Err(Why::Outside),
        () if sides[0] * sides[1] < 0.0 => Err(Why::TurnedAway),
        () if hides => Err(Why::Hidden),
        () => Ok(depth),
    })
}

#[test]
fn agrees_with_brute_force_wherever_the_viewer_goes() {
    let scene = clutter();
    let tracer = Tracer::new(&scene).unwrap();
    let light = Light::Directional { direction: DVec3::new(0.4, -1.0, 0.3) };
    let mut random = Random(9);
    let mut counts = [0usize; 6];
    for _ in 0..24 {
        let mut eye = || random.vector(9.0).with_y(random.between(0.2, 6.0));
        let eyes = [eye(), eye()];
        let target = random.vector(2.0);
        let near = random.between(0.05, 4.0);
        let [first, second] = eyes.map(|eye| look(eye, target, near));
        let [first_view, second_view] = [first, second]
            .map(|look| View::new(&tracer, Camera::look_at(look).unwrap(), light, 1).unwrap());
        for sample in samples(&first_view) {
            let surface = &sample.surface;
            let Some(expected) = seen(&scene, &second, surface, first.eye) else { continue };
            let found = second_view.sees(surface);
            assert_eq!(found.is_some(), expected.is_ok(), "{expected:?}: {second:?} {surface:?}");
            counts[expected.map_or_else(|why| why as usize, |_| 5)] += 1;
            let (Some(found), Ok(depth)) = (found, expected) else { continue };
            assert!((found.depth - depth).abs() < 1e-9 * depth, "{} {depth}", found.depth);
            // The view returns the same point, which faces the sun as before.
            assert_eq!((found.surface, found.is_facing), (*surface, sample.is_facing));
            // The view's own sample at that pixel is the same point.
            let pixel = second_view.camera().pixel(surface.position).unwrap();
            let own = second_view.sample(pixel).unwrap();
            assert!(own.surface.position.distance(surface.position) < 1e-6, "{own:?} {surface:?}");
        }
    }
    // Each of the reasons, and no reason at all, occurs many times.
    assert!(counts.iter().all(|&n| n > 150), "{counts:?}");
}

/// The light of the view that is asked decides whether a point faces the light: the sun may have
/// moved, or a spot light's cone may point elsewhere.
#[test]
fn facing_is_by_the_light_of_the_view_that_is_asked() {
    let scene = clutter();
    let tracer = Tracer::new(&scene).unwrap();
    let camera = Camera::look_at(look(DVec3::new(0.0, 4.0, 8.0), DVec3::ZERO, 0.1)).unwrap();
    let [down, flat] = [DVec3::NEG_Y, DVec3::new(1.0, -0.05, 0.0)]
        .map(|direction| Light::Directional { direction });
    let torch = Light::Spot(SpotLight {
        position: DVec3::new(0.0, 9.0, 0.0),
        direction: DVec3::NEG_Y,
        half_angle_rad: 0.3,
        near: 0.1,
        range: 20.0,
    });
    let views = [down, flat, torch].map(|light| View::new(&tracer, camera, light, 1).unwrap());
    for (i, view) in views.iter().enumerate() {
        let others = views.iter().enumerate().filter(|(j, _)| *j != i);
        for (_, other) in others {
            let mut differ = 0;
            for (now, there) in samples(view).into_iter().zip(samples(other)) {
                let seen = view.sees(&there.surface).unwrap();
                assert_eq!((seen.surface, seen.is_facing), (now.surface, now.is_facing));
                differ += usize::from(now.is_facing != there.is_facing);
            }
            assert!(differ > 50, "{differ}");
        }
    }
}

/// A view sees all that it shows, up to the last pixel, and also what lies beyond its far distance.
#[test]
fn a_view_sees_what_it_shows() {
    let scene = clutter();
    let tracer = Tracer::new(&scene).unwrap();
    let light = Light::Directional { direction: DVec3::NEG_Y };
    let mut random = Random(3);
    let mut beyond = 0;
    for _ in 0..20 {
        let eye = random.vector(12.0).with_y(random.between(0.2, 6.0));
        let camera = Camera::look_at(look(eye, random.vector(2.0), random.between(0.05, 4.0)));
        let view = View::new(&tracer, camera.unwrap(), light, 1).unwrap();
        let [w, h] = IMAGE.map(f64::from);
        let points = [0; 500].map(|_| DVec2::new(w * random.unit(), h * random.unit()));
        for sample in points.into_iter().filter_map(|p| view.sample(p)) {
            let seen = view.sees(&sample.surface).unwrap_or_else(|| panic!("{sample:?}"));
            assert!((seen.depth - sample.depth).abs() < 1e-9 * sample.depth);
            beyond += usize::from(sample.depth > view.camera().far());
        }
    }
    assert!(beyond > 200, "{beyond}");
}
