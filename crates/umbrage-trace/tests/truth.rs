//! The truth against closed forms, and its robustness: no surface shadows itself.

mod common;

use common::{
    Random, at, below, camera, false_shadows, ground, nobody, scene, sheet, soup, towards,
};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use umbrage::{Light, PointLight, SpotLight};
use umbrage_scene::closed_form::{
    POLE_HEIGHT, SPHERE_CENTER, SPHERE_RADIUS, pole_shadows, slit_shadows, sphere_shadows,
};
use umbrage_scene::{Mesh, Scene, builtin};
use umbrage_trace::{Band, Ray, Sample, Surface, Tracer, View};

fn sun_is_hidden(tracer: &Tracer<'_>, surface: &Surface, travel: DVec3) -> bool {
    tracer.occluded_from(surface, -travel, f64::INFINITY)
}

/// Calls `check` with random points of the ground and with light from all over the sky, down to 2°
/// above the horizon.
fn for_ground_points(
    scene: &Scene,
    count: usize,
    mut check: impl FnMut(&Tracer<'_>, &Surface, DVec3),
) {
    let tracer = Tracer::new(scene).unwrap();
    let mut random = Random(11);
    for _ in 0..count {
        let elevation = random.between(2f64.to_radians(), 1.57);
        let azimuth = random.between(0.0, std::f64::consts::TAU);
        let (sin, cos) = elevation.sin_cos();
        let travel = DVec3::new(cos * azimuth.cos(), -sin, cos * azimuth.sin());
        // The points lie near the shadow: up to the caster's size from the shadow of its middle.
        let middle = DVec2::new(travel.x, travel.z) * (2.0 / sin * random.unit());
        let at = (middle + random.in_square(2.0)).clamp(DVec2::splat(-19.9), DVec2::splat(19.9));
        // The ground is found from below, where nothing hides it.
        let surface = towards(&tracer, DVec3::new(at.x, -1.0, at.y), DVec3::Y);
        assert_eq!(surface.position.y, 0.0);
        check(&tracer, &surface, travel);
    }
}

#[test]
fn the_shadow_of_a_pole_ends_where_it_should() {
    let mut dark = 0;
    let scene = builtin("pole", None).unwrap();
    for_ground_points(&scene, 20_000, |tracer, surface, travel| {
        let expected = pole_shadows(surface.position, travel);
        dark += usize::from(expected);
        assert_eq!(sun_is_hidden(tracer, surface, travel), expected, "{surface:?} {travel}");
    });
    assert!(dark > 500, "only {dark} points in the shadow");
}

#[test]
fn the_outline_of_a_shadow_is_sharp_to_the_last_bits() {
    // The last bits of a ground point decide: the points lie 10⁻¹³ m to either side of the outline
    // of the pole's shadow.
    let scene = builtin("pole", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let travel = DVec3::new(1.0, -0.5, 0.0);
    let on_ground = |x: f64, z: f64| {
        let surface = towards(&tracer, DVec3::new(x, -1.0, z), DVec3::Y);
        assert!((surface.position.x - x).abs() < 1e-14);
        sun_is_hidden(&tracer, &surface, travel)
    };
    // The scene stores the half-width in single precision, where it is not quite 0.1.
    let half = f64::from(0.1f32);
    for sign in [-1.0, 1.0] {
        assert!(on_ground(1.0, sign * (half - 1e-13)));
        assert!(!on_ground(1.0, sign * (half + 1e-13)));
    }
    // The tip of the shadow: the pole is 4 m high and the light falls with a slope of ½, so the tip
    // lies 8 m behind the far upper edge.
    assert!(on_ground(8.0 + half - 1e-12, 0.01));
    assert!(!on_ground(8.0 + half + 1e-12, 0.01));
}

#[test]
fn light_falls_through_a_slit() {
    let mut counts = [0, 0];
    let scene = builtin("slit", None).unwrap();
    for_ground_points(&scene, 20_000, |tracer, surface, travel| {
        let expected = slit_shadows(surface.position, travel);
        counts[usize::from(expected)] += 1;
        assert_eq!(sun_is_hidden(tracer, surface, travel), expected, "{surface:?} {travel}");
    });
    assert!(counts.iter().all(|&n| n > 1000), "{counts:?}");
}

#[test]
fn the_shadow_of_a_sphere_is_an_ellipse() {
    let rings = 200;
    let scene = builtin("sphere", Some(rings)).unwrap();
    // The tessellated sphere is inscribed in the ideal one. Across the light, its shadow is smaller
    // by up to this length.
    let sagitta = SPHERE_RADIUS * (std::f64::consts::FRAC_PI_2 / f64::from(rings)).powi(2);
    let [mut dark, mut between] = [0, 0];
    for_ground_points(&scene, 20_000, |tracer, surface, travel| {
        let is_hidden = sun_is_hidden(tracer, surface, travel);
        dark += usize::from(is_hidden);
        let ideal = sphere_shadows(surface.position, travel);
        // The same test for a sphere that is smaller by the sagitta, around the same centre.
        let smaller = (SPHERE_CENTER - surface.position).cross(travel.normalize()).length()
            <= SPHERE_RADIUS - 1.1 * sagitta;
        between += usize::from(ideal != smaller);
        assert!(!smaller || is_hidden, "{surface:?} {travel}");
        assert!(ideal || !is_hidden, "{surface:?} {travel}");
    });
    assert!(dark > 1000 && between < 100, "{dark} {between}");
}

#[test]
fn planes_do_not_shadow_themselves() {
    // Tilted, finely divided planes from 1 mm to 100 km wide, near the origin and up to 100 km from
    // it, at light angles down to 0.01°.
    let mut random = Random(5);
    for round in 0..16 {
        let scale = 10f64.powf(random.between(-3.0, 5.0));
        let axis = DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0));
        let offset = if round % 2 == 0 { DVec3::ZERO } else { random.direction() * 1e5 };
        let n = 24;
        let mut mesh = Mesh::default();
        for j in 0..=n {
            mesh.positions.extend((0..=n).map(|i| {
                let p = DVec3::new(f64::from(i), 0.0, f64::from(j)) / f64::from(n) - 0.5;
                (axis * DVec3::new(p.x, 0.0, p.z) * scale).as_vec3()
            }));
        }
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let a = j * (n + 1) + i;
            mesh.triangles.extend([[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]);
        }
        let scene = scene(vec![mesh], &[(0, DAffine3::from_translation(offset))]);
        let normal = axis * DVec3::Y;
        let along = normal.any_orthonormal_vector();
        let eye = offset + (normal * 0.6 + along * 0.3) * scale;
        for elevation_deg in [90.0f64, 30.0, 5.0, 1.0] {
            let (sin, cos) = elevation_deg.to_radians().sin_cos();
            let direction = -(normal * sin + along * cos);
            let light = Light::Directional { direction };
            // Rounding the corners to single precision makes the plane uneven by 2⁻²⁴, which does
            // not show at 1°.
            let (wrong, all) = false_shadows(&scene, eye, offset, light);
            assert!(
                all > 3000 && wrong == 0,
                "{wrong} of {all} at {elevation_deg}°, scale {scale}"
            );
        }
    }
}

#[test]
fn copies_and_decals_do_not_shadow_what_they_lie_on() {
    let tilt = DMat3::from_axis_angle(DVec3::new(1.0, 0.3, -0.2).normalize(), 0.7);
    let tilted = |p: Vec3| (tilt * p.as_dvec3()).as_vec3();
    let turned = |mesh: &Mesh| Mesh {
        positions: mesh.positions.iter().copied().map(tilted).collect(),
        ..mesh.clone()
    };
    let floor = turned(&ground(3.0));
    // The same plane made of other triangles, whose corners round differently.
    let decal = turned(&sheet(Vec3::new(-1.3, 0.0, -0.9), Vec3::Z * 2.1, Vec3::X * 1.7));
    let mut backwards = floor.clone();
    backwards.triangles.iter_mut().for_each(|t| t.reverse());
    let everywhere = at(123.4, -56.7, 8.9);
    let scene = scene(
        vec![floor.clone(), floor, decal, backwards],
        &[(0, everywhere), (1, everywhere), (2, everywhere), (3, everywhere)],
    );
    let normal = tilt * DVec3::Y;
    let center = everywhere.translation;
    for elevation_deg in [80.0f64, 10.0, 1.0] {
        let (sin, cos) = elevation_deg.to_radians().sin_cos();
        let direction = -(normal * sin + normal.any_orthonormal_vector() * cos);
        let light = Light::Directional { direction };
        let (wrong, all) = false_shadows(&scene, center + normal * 2.0, center, light);
        assert!(all > 5000 && wrong == 0, "{wrong} of {all} at {elevation_deg}°");
    }
}

#[test]
fn what_is_near_but_apart_casts() {
    // A sheet a tenth of a millimetre above the ground, 100 km from the origin.
    let far_off = at(1e5, 0.0, -1e5);
    let scene = scene(
        vec![ground(1.0), sheet(Vec3::new(-0.5, 1e-4, -0.5), Vec3::Z, Vec3::X)],
        &[(0, far_off), (1, far_off)],
    );
    let tracer = Tracer::new(&scene).unwrap();
    for (x, is_dark) in [(0.0, true), (0.4999, true), (0.5002, false), (0.9, false)] {
        let point = far_off.translation + DVec3::new(x, -1.0, 0.0);
        let surface = towards(&tracer, point, DVec3::Y);
        assert_eq!(sun_is_hidden(&tracer, &surface, -DVec3::Y), is_dark, "at {x}");
    }
}

#[test]
fn a_box_shadows_up_to_its_very_foot() {
    // A wall meets the floor, as one mesh and as two. No light may leak in where they meet.
    let wall = |x: f32| sheet(Vec3::new(x, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y * 2.0);
    let scene =
        scene(vec![ground(3.0), wall(0.3)], &[(0, at(7.1, 0.2, 0.0)), (1, at(7.1, 0.2, 0.0))]);
    let tracer = Tracer::new(&scene).unwrap();
    let travel = DVec3::new(1.0, -1.0, 0.1);
    let foot = 7.1 + f64::from(0.3f32);
    for distance in [1e-6, 1e-4, 0.1] {
        let surface = below(&tracer, DVec3::new(foot + distance, 5.0, 0.5));
        assert!(sun_is_hidden(&tracer, &surface, travel), "{distance} behind the wall");
        let surface = below(&tracer, DVec3::new(foot - distance, 5.0, 0.5));
        assert!(!sun_is_hidden(&tracer, &surface, travel), "{distance} before the wall");
    }
}

#[test]
fn curved_shells_do_not_leak() {
    // No light arrives inside a closed sphere, wherever on its triangles the point lies.
    let scene =
        scene(vec![common::sphere(Vec3::new(3.0, 1.0, 2.0), 1.0, 24)], &[(0, DAffine3::IDENTITY)]);
    let tracer = Tracer::new(&scene).unwrap();
    let mut random = Random(23);
    for _ in 0..20_000 {
        let center = DVec3::new(3.0, 1.0, 2.0);
        let surface = towards(&tracer, center, random.direction());
        let to_light = random.direction();
        // Seen from inside, the normal turns inwards, so a facing point is one that light could
        // only reach through the shell.
        if surface.geometric_normal.dot(to_light) > 1e-3 {
            assert!(
                tracer.occluded_from(&surface, to_light, f64::INFINITY),
                "{surface:?} {to_light}"
            );
        }
    }
}

/// Whether the ground right above or below an eye faces a light, and whether light reaches it.
fn seen(tracer: &Tracer<'_>, light: Light, eye: DVec3) -> (bool, f32) {
    let view = View::new(tracer, camera(eye, eye.with_y(0.0), [1, 1]), light, 1).unwrap();
    let sample = view.sample(DVec2::splat(0.5)).unwrap();
    assert_eq!(sample.surface.position.y, 0.0);
    (sample.is_facing, view.truth(&sample))
}

#[test]
fn spot_lights_end_at_cone_and_range_and_begin_at_near() {
    let shade = |half: f32, y: f32| {
        sheet(Vec3::new(-half, y, -half), Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half)
    };
    let scene = scene(
        vec![ground(20.0), shade(0.5, 5.0)],
        &[(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)],
    );
    let tracer = Tracer::new(&scene).unwrap();
    let spot = |near: f64, range: f64| {
        Light::Spot(SpotLight {
            position: DVec3::new(0.0, 10.0, 0.0),
            direction: DVec3::new(0.0, -2.0, 0.0),
            half_angle_rad: 45f64.to_radians(),
            near,
            range,
        })
    };
    // Seen from below, the lower side of the ground faces away from a light above it.
    assert_eq!(seen(&tracer, spot(0.1, 50.0), DVec3::new(5.0, -3.0, 0.0)), (false, 0.0));
    let above = |light, x| seen(&tracer, light, DVec3::new(x, 3.0, 0.0));
    assert_eq!(above(spot(0.1, 50.0), 5.0), (true, 1.0));
    assert_eq!(above(spot(0.1, 50.0), 0.99), (true, 0.0), "under the sheet at half height");
    assert_eq!(above(spot(0.1, 50.0), 1.01), (true, 1.0), "beside it");
    assert_eq!(above(spot(0.1, 50.0), 9.99), (true, 1.0));
    assert!(!above(spot(0.1, 50.0), 10.01).0, "outside the cone");
    assert!(!above(spot(0.1, 9.99), 5.0).0, "beyond the range");
    assert_eq!(above(spot(6.0, 50.0), 0.5), (true, 0.0), "a caster nearer than near");
    assert_eq!(above(spot(10.01, 50.0), 0.5), (true, 1.0), "a receiver nearer than near");
}

#[test]
fn point_lights_end_at_a_sphere_and_begin_at_a_cube() {
    let sheet_at = |y: f32| sheet(Vec3::new(-0.5, y, -0.5), Vec3::Z, Vec3::X);
    let scene = scene(
        vec![ground(20.0), sheet_at(5.0), sheet_at(15.0), ground(20.0)],
        &[
            (0, DAffine3::IDENTITY),
            (1, DAffine3::IDENTITY),
            (2, DAffine3::IDENTITY),
            (3, at(0.0, 20.0, 0.0)),
        ],
    );
    let tracer = Tracer::new(&scene).unwrap();
    let point = |near: f64, range: f64| {
        Light::Point(PointLight { position: DVec3::new(0.0, 10.0, 0.0), near, range })
    };
    let lit = |light, x: f64, z: f64| seen(&tracer, light, DVec3::new(x, 3.0, z));
    assert_eq!(lit(point(0.1, 50.0), 15.0, -15.0), (true, 1.0));
    assert_eq!(lit(point(0.1, 50.0), 0.99, 0.99), (true, 0.0), "under the sheet at half height");
    assert_eq!(lit(point(0.1, 50.0), 1.01, 0.0), (true, 1.0), "beside it");
    let below = seen(&tracer, point(0.1, 50.0), DVec3::new(5.0, -3.0, 0.0));
    assert_eq!(below, (false, 0.0), "the ground's other side");
    // The distance is 15 m, because 10² + 10² + 5² = 15².
    assert!(lit(point(0.1, 15.0 + 1e-9), 10.0, 5.0).0);
    assert!(!lit(point(0.1, 15.0 - 1e-9), 10.0, 5.0).0, "beyond the range");
    assert_eq!(lit(point(6.0, 50.0), 0.5, 0.0), (true, 0.0), "a caster nearer than near");
    assert_eq!(lit(point(10.01, 50.0), 0.5, 0.0), (true, 1.0), "a receiver nearer than near");
    // `near` counts along the axis nearest to the direction of the point. This point is farther
    // than 12 m from the light, but only 11.99 m along that axis.
    assert_eq!(lit(point(12.0, 50.0), 0.5, 11.99), (true, 1.0));
    let above = |x: f64| {
        let eye = DVec3::new(x, 16.0, 0.0);
        let camera = camera(eye, eye.with_y(20.0), [1, 1]);
        let view = View::new(&tracer, camera, point(0.1, 50.0), 1).unwrap();
        let sample = view.sample(DVec2::splat(0.5)).unwrap();
        assert_eq!(sample.surface.position.y, 20.0);
        (sample.is_facing, view.truth(&sample))
    };
    assert_eq!([above(0.99), above(1.01)], [(true, 0.0), (true, 1.0)], "upwards, too");
}

/// Whether a ground point is in the shadow of a point light. The point's facing is not tested, nor
/// the light's range.
fn lamp_is_hidden(tracer: &Tracer<'_>, at: DVec2, position: DVec3) -> bool {
    let light = Light::Point(PointLight { position, near: 1e-9, range: 1e9 });
    let view = View::new(tracer, camera(DVec3::Y, DVec3::ZERO, [1, 1]), light, 1).unwrap();
    // The ground is found from below, where nothing hides it.
    let surface = towards(tracer, DVec3::new(at.x, -1.0, at.y), DVec3::Y);
    assert_eq!(surface.position.y, 0.0);
    view.truth(&Sample { surface, depth: 1.0, is_facing: true }) == 0.0
}

#[test]
fn the_shadow_of_a_pole_widens_away_from_a_lamp() {
    let scene = builtin("pole", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let half = f64::from(0.1f32);
    // The light lies on each of the four sides of the pole, and the ground on each side of the
    // light's cube.
    for quarter in 0..4 {
        let turned = DMat3::from_rotation_y(f64::from(quarter) * std::f64::consts::FRAC_PI_2);
        // Single precision suffices for the rotation, because the points lie farther than its error
        // from the outline.
        let is_hidden = |x: f64, z: f64, lamp: DVec3| {
            let p = turned * DVec3::new(x, 0.0, z);
            lamp_is_hidden(&tracer, DVec2::new(p.x, p.z), turned * lamp)
        };
        for lamp in [DVec3::new(-3.0, 6.0, 0.0), DVec3::new(-3.0, 4.5, 0.0)] {
            // The light that passes over the far upper edge falls by 1 m over (3 + half) / (height
            // − 4).
            let tip = half + POLE_HEIGHT * (half - lamp.x) / (lamp.y - POLE_HEIGHT);
            if tip < 19.0 {
                assert!(is_hidden(tip - 1e-11, 0.01, lamp));
                assert!(!is_hidden(tip + 1e-11, 0.01, lamp));
            }
            // Light passes the pole's sides at the two near edges, x = −half and z = ±half.
            for x in [0.5, 2.0, 5.0] {
                let side = half * (x - lamp.x) / (-half - lamp.x);
                for sign in [-1.0, 1.0] {
                    assert!(is_hidden(x, sign * (side - 1e-12), lamp), "{quarter} {lamp} {x}");
                    assert!(!is_hidden(x, sign * (side + 1e-12), lamp), "{quarter} {lamp} {x}");
                }
            }
        }
    }
}

#[test]
fn the_shadow_of_a_sphere_is_what_lies_in_the_cone_behind_it() {
    let rings = 200;
    let scene = builtin("sphere", Some(rings)).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let sagitta = SPHERE_RADIUS * (std::f64::consts::FRAC_PI_2 / f64::from(rings)).powi(2);
    let mut random = Random(12);
    let [mut dark, mut between, mut low] = [0, 0, 0];
    while dark < 3000 {
        let lamp = DVec3::new(0.0, 5.0, 0.0) + random.vector(5.0);
        if lamp.y < 0.05 || lamp.distance(SPHERE_CENTER) < 1.05 * SPHERE_RADIUS {
            continue;
        }
        let half = if random.unit() < 0.5 { 4.0 } else { 19.9 };
        let at = random.in_square(half);
        let point = DVec3::new(at.x, 0.0, at.y);
        // The distance at which the light passes the sphere's centre.
        let to_lamp = lamp - point;
        let along = (SPHERE_CENTER - point).dot(to_lamp) / to_lamp.length_squared();
        let miss = (point + to_lamp * along.clamp(0.0, 1.0)).distance(SPHERE_CENTER);
        let is_hidden = lamp_is_hidden(&tracer, at, lamp);
        assert!(miss <= SPHERE_RADIUS || !is_hidden, "{point} {lamp}");
        assert!(miss > SPHERE_RADIUS - 1.1 * sagitta || is_hidden, "{point} {lamp}");
        dark += usize::from(is_hidden);
        low += usize::from(is_hidden && lamp.y < SPHERE_CENTER.y);
        between += usize::from((miss - SPHERE_RADIUS).abs() <= 1.1 * sagitta);
    }
    assert!(low > 100 && between < 100, "{low} {between}");
}

#[test]
fn pictures_come_in_bands_and_the_same_on_any_number_of_threads() {
    let scene = builtin("sphere", Some(32)).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let light = Light::Directional { direction: DVec3::new(1.0, -1.25, 0.4) };
    let camera = camera(DVec3::new(-2.5, 3.4, 7.5), DVec3::Y, [60, 40]);
    let view = View::new(&tracer, camera, light, 3).unwrap();
    let whole = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let rows = std::sync::atomic::AtomicU64::new(0);
            let count = |n| {
                rows.fetch_add(n, std::sync::atomic::Ordering::Relaxed);
            };
            let band = view.band(0..40, &count);
            let truth = band.map(|s| view.truth(s), &count);
            assert_eq!(rows.into_inner(), 80);
            (band.samples().to_vec(), truth)
        })
    };
    let (samples, truth) = whole(1);
    assert_eq!((samples.clone(), truth.clone()), whole(3));
    assert_eq!(samples.len(), 60 * 40 * 9);
    // The same samples in bands, of which the last extends beyond the picture's end.
    let pieces = [0..7, 7..33, 33..99].map(|rows| view.band(rows, &nobody));
    assert_eq!(pieces.iter().flat_map(Band::samples).copied().collect::<Vec<_>>(), samples);
    // Bands cover every row once, however large the picture is.
    let wide = common::camera(DVec3::Z, DVec3::ZERO, [65536, 999]);
    let view = View::new(&tracer, wide, light, 64).unwrap();
    let rows: Vec<u32> = view.bands().flatten().collect();
    assert_eq!(rows, (0..999).collect::<Vec<_>>());
    assert!(View::new(&tracer, wide, light, 0).is_err());
    assert!(View::new(&tracer, wide, light, 65).is_err());
}

#[test]
fn a_soup_of_slivers_is_survived() {
    // Needles a micrometre wide, one of them so flat that its normal is mostly rounding error.
    let needles: Vec<_> = (0..100)
        .map(|i| {
            let x = i as f32 * 0.01;
            [Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1e-6, 1.0, 0.0), Vec3::new(x, 1.0, 1.0)]
        })
        .chain([[Vec3::ZERO, Vec3::ONE, Vec3::new(0.5, 0.500_000_06, 0.5)]])
        .collect();
    let scene = scene(vec![soup(&needles)], &[(0, DAffine3::IDENTITY)]);
    let tracer = Tracer::new(&scene).unwrap();
    let mut random = Random(2);
    for _ in 0..5000 {
        let origin = random.vector(3.0);
        let ray = Ray { origin, direction: random.vector(0.5) + 0.5 - origin };
        if let Some(hit) = tracer.closest(ray, [0.0, f64::INFINITY]) {
            let surface = tracer.surface(&hit, ray.direction);
            assert!(surface.position.is_finite() && surface.geometric_normal.is_normalized());
            assert!(surface.shading_normal.is_normalized() && surface.position_error < 1e-5);
            tracer.occluded_from(&surface, DVec3::Y, f64::INFINITY);
        }
    }
}
