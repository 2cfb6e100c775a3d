//! No receiver is lost, in random scenes under random motions.

use super::cells::Cells;
use super::{Seen, SeenTiles};
use crate::bounds::{Aabb, Plane};
use crate::camera::{Camera, LookAt, Orthographic};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

const IMAGE: [u32; 2] = [160, 90];

/// Boxes and balls on a floor. Each is given by the box around it.
#[derive(Clone, Debug)]
struct Scene {
    things: Vec<(Aabb, bool)>,
}

impl Scene {
    /// Depth and index of what a pixel shows; an infinite depth in the sky.
    fn hit(&self, camera: &Camera, pixel: DVec2) -> (f64, usize) {
        let ray = camera.ray(pixel);
        let mut nearest = (f64::INFINITY, usize::MAX);
        for (index, &(aabb, is_ball)) in self.things.iter().enumerate() {
            let around = aabb.relative_to(camera.eye() + ray.start);
            let depth = match is_ball {
                true => ball(around, ray.direction),
                false => entry(around, ray.direction),
            };
            if let Some(depth) = depth
                && depth >= camera.near()
                && depth < nearest.0
            {
                nearest = (depth, index);
            }
        }
        nearest
    }

    fn seen(&self, camera: &Camera) -> SeenTiles {
        let depth = |x: u32, y: u32| self.hit(camera, center(x, y)).0;
        SeenTiles::of_depths(camera, depth).unwrap()
    }

    fn boxes(&self) -> Vec<Aabb> {
        self.things.iter().map(|t| t.0).collect()
    }
}

fn center(x: u32, y: u32) -> DVec2 {
    DVec2::new(f64::from(x), f64::from(y)) + 0.5
}

/// Where the line through the origin enters a box.
fn entry(aabb: Aabb, ray: DVec3) -> Option<f64> {
    let (a, b) = (aabb.min / ray, aabb.max / ray);
    let (start, end) = (a.min(b).max_element(), a.max(b).min_element());
    (start <= end).then_some(start)
}

/// Where the line through the origin enters the ball within a cube.
fn ball(aabb: Aabb, ray: DVec3) -> Option<f64> {
    let (center, radius) = (aabb.center(), aabb.size().x / 2.0);
    let (a, b, c) =
        (ray.length_squared(), ray.dot(center), center.length_squared() - radius * radius);
    let root = b * b - a * c;
    (root >= 0.0).then(|| (b - root.sqrt()) / a)
}

fn scene() -> impl Strategy<Value = Scene> {
    let thing = (-12.0..12.0f64, -25.0..0.0f64, 0.4..3.0f64, 0.4..5.0f64, any::<bool>());
    prop::collection::vec(thing, 1..14).prop_map(|things| {
        let mut scene = Scene {
            things: vec![(
                Aabb::new(DVec3::new(-60.0, -0.2, -60.0), DVec3::new(60.0, 0.0, 60.0)),
                false,
            )],
        };
        scene.things.extend(things.into_iter().map(|(x, z, width, height, is_ball)| {
            let height = if is_ball { width } else { height };
            let half = DVec3::new(width, height, width) / 2.0;
            let middle = DVec3::new(x, half.y, z);
            (Aabb::new(middle - half, middle + half), is_ball)
        }));
        scene
    })
}

fn camera(eye: DVec3, turn: DVec2) -> Camera {
    camera_with(eye, turn, Lens::Perspective(1.0), IMAGE)
}

/// A field of view in radians, or a height in metres.
#[derive(Clone, Copy, Debug)]
enum Lens {
    Perspective(f64),
    Orthographic(f64),
}

/// How many of the pixels may show the edges of things, which lie between two pixels of the earlier
/// picture. The near plane of orthographic views cuts the floor in a long edge.
fn most_lost(camera: &Camera, count: usize) -> usize {
    let long_edge = if camera.is_orthographic() { camera.image()[0] as usize } else { 0 };
    count / 100 + long_edge
}

fn lens() -> impl Strategy<Value = Lens> {
    prop_oneof![Just(Lens::Perspective(1.0)), (2.0..20.0f64).prop_map(Lens::Orthographic)]
}

impl Lens {
    fn zoomed(self, factor: f64) -> Self {
        match self {
            Self::Perspective(fov_y_rad) => Self::Perspective(fov_y_rad * factor),
            Self::Orthographic(height) => Self::Orthographic(height * factor),
        }
    }
}

fn camera_with(eye: DVec3, turn: DVec2, lens: Lens, image: [u32; 2]) -> Camera {
    let target = eye + DVec3::new(turn.x, turn.y - 0.2, -1.0);
    let (up, near, far) = (DVec3::Y, 0.1, 50.0);
    let camera = match lens {
        Lens::Perspective(fov_y_rad) => {
            Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image })
        }
        Lens::Orthographic(height) => {
            // Some things lie behind the eye.
            Camera::orthographic(Orthographic { eye, target, up, height, near: -5.0, far, image })
        }
    };
    camera.unwrap()
}

/// The planes around every cell, and around the moving boxes, relative to the eye; `None` where
/// boxes must serve.
fn cells(seen: Seen<'_>, camera: &Camera, boxes: &[Aabb]) -> Option<Vec<Vec<Plane>>> {
    let mut cells = Cells::default();
    let found: Vec<_> = cells.find(seen, camera, boxes)?.collect();
    assert!(found.len() <= 128, "{} cells", found.len());
    let moving = seen.moving.iter().map(|aabb| aabb.relative_to(camera.eye()).corners());
    Some(found.into_iter().chain(moving).map(planes_around).collect())
}

/// The planes through the faces of a hexahedron whose corners are numbered as those of a box.
fn planes_around(corners: [DVec3; 8]) -> Vec<Plane> {
    let middle = corners.iter().sum::<DVec3>() / 8.0;
    let face = |(axis, side): (usize, usize)| {
        let [u, v] = [1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3)];
        let first = side << axis;
        let [a, b, c, d] = [first, first | u, first | u | v, first | v].map(|i| corners[i]);
        let normal = (c - a).cross(d - b).normalize_or_zero();
        let outwards = normal.dot(a - middle) > 0.0;
        Plane::through(a, if outwards { -normal } else { normal })
    };
    [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0), (axis, 1)]).map(face).collect()
}

fn holds(cells: &[Vec<Plane>], p: DVec3) -> bool {
    // A hundredth of a pixel, by which a ball bulges out between pixels.
    let slack = 1e-4 * p.length();
    cells.iter().any(|planes| planes.iter().all(|plane| plane.distance(p) >= -slack))
}

/// The pixels whose receivers no cell holds.
fn lost(scene: &Scene, camera: &Camera, cells: &[Vec<Plane>]) -> (Vec<[u32; 2]>, usize) {
    let mut lost = Vec::new();
    let mut count = 0;
    for (x, y) in (0..camera.image()[1])
        .flat_map(|y| (y % 2..camera.image()[0]).step_by(2).map(move |x| (x, y)))
    {
        let (depth, _) = scene.hit(camera, center(x, y));
        if depth <= camera.far() {
            count += 1;
            if !holds(cells, camera.ray(center(x, y)).at(depth)) {
                lost.push([x, y]);
            }
        }
    }
    (lost, count)
}

/// Whether different things, or different sides of one, show within a pixel of this one in either
/// camera's picture.
fn is_at_silhouette(scene: &Scene, before: &Camera, camera: &Camera, [x, y]: [u32; 2]) -> bool {
    let reach = (before.pixel_width(1.0) / camera.pixel_width(1.0)).max(1.0);
    let nearness = |dx: f64, dy: f64| {
        let (depth, thing) = scene.hit(camera, center(x, y) + DVec2::new(dx, dy) * reach);
        (depth.recip(), thing)
    };
    let (middle, thing) = nearness(0.0, 0.0);
    [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]].into_iter().any(|[dx, dy]| {
        let [a, b] = [nearness(dx, dy), nearness(-dx, -dy)];
        a.1 != thing || b.1 != thing || (a.0 - 2.0 * middle + b.0).abs() > 1e-3 * middle
    })
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn a_still_camera_loses_nothing(
        scene in scene(),
        [x, y, z] in [-10.0..10.0f64, 0.3..6.0, 1.0..12.0],
        turn in [-1.0..1.0f64, -0.6..0.4],
        lens in lens(),
    ) {
        let camera = camera_with(DVec3::new(x, y, z), turn.into(), lens, IMAGE);
        let seen = scene.seen(&camera);
        let seen = Seen { tiles: &seen, moving: &[], clearance: 0.0 };
        let cells = cells(seen, &camera, &[]).expect("a camera that stands still");
        let (lost, count) = lost(&scene, &camera, &cells);
        let shows_much = camera.is_orthographic() || count > 0;
        prop_assert!(shows_much && lost.is_empty(), "{lost:?} of {count}");
    }

    #[test]
    fn a_moving_camera_loses_nothing(
        scene in scene(),
        [x, y, z] in [-10.0..10.0f64, 0.3..6.0, 1.0..12.0],
        turn in [-1.0..1.0f64, -0.6..0.4],
        step in prop::array::uniform3(-1.0..1.0f64),
        stride in 0.0..1.0f64,
        turning in prop_oneof![Just([0.0, 0.0]), [-0.3..0.3f64, -0.2..0.2]],
        lens in lens(),
        (zoom, image) in prop_oneof![
            3 => Just((1.0, IMAGE)),
            1 => (0.6..1.3f64).prop_map(|zoom| (zoom, [150, 110])),
        ],
    ) {
        let eye = DVec3::new(x, y, z);
        let before = camera_with(eye, turn.into(), lens, IMAGE);
        let turn = DVec2::from(turn) + DVec2::from(turning);
        let after = camera_with(eye + DVec3::from(step) * stride, turn, lens.zoomed(zoom), image);
        let seen = scene.seen(&before);
        let boxes = scene.boxes();
        let seen = Seen { tiles: &seen, moving: &[], clearance: 0.0 };
        let Some(cells) = cells(seen, &after, &boxes) else { return Ok(()) };
        let (lost, count) = lost(&scene, &after, &cells);
        // Between two pixels the earlier picture shows nothing, so the edge of a thing may be lost.
        let inner = lost.iter().filter(|&&p| !is_at_silhouette(&scene, &before, &after, p)).count();
        prop_assert!(inner == 0 && lost.len() <= most_lost(&after, count), "{lost:?} of {count}, {inner} inner");
    }

    /// A thing moves, and what it hid comes into view.
    #[test]
    fn what_moves_and_what_it_hid_are_served(
        scene in scene(),
        [x, y, z] in [-10.0..10.0f64, 0.3..6.0, 1.0..12.0],
        turn in [-1.0..1.0f64, -0.6..0.4],
        shift in [-3.0..3.0f64, 0.0..2.0, -3.0..3.0],
        step in prop_oneof![Just([0.0; 3]), prop::array::uniform3(-0.2..0.2f64)],
        lens in lens(),
    ) {
        let eye = DVec3::new(x, y, z);
        let before = camera_with(eye, turn.into(), lens, IMAGE);
        let after = camera_with(eye + DVec3::from(step), turn.into(), lens, IMAGE);
        let seen = scene.seen(&before);
        let mut later = scene.clone();
        let thing = &mut later.things[1].0;
        let old = *thing;
        *thing = Aabb { min: old.min + DVec3::from(shift), max: old.max + DVec3::from(shift) };
        let moving = [old.union(*thing)];
        let boxes = later.boxes();
        let seen = Seen { tiles: &seen, moving: &moving, clearance: 0.0 };
        let Some(cells) = cells(seen, &after, &boxes) else { return Ok(()) };
        let (lost, count) = lost(&later, &after, &cells);
        let inner = lost.iter().filter(|&&p| !is_at_silhouette(&later, &before, &after, p)).count();
        prop_assert!(inner == 0 && lost.len() <= most_lost(&after, count), "{lost:?} of {count}, {inner} inner");
    }
}

/// A camera that may have come through what it saw is not served by it.
#[test]
fn a_camera_that_went_too_far_is_served_by_boxes() {
    let scene =
        Scene { things: vec![(Aabb::new(DVec3::splat(-1.0), DVec3::new(1.0, 3.0, 1.0)), false)] };
    let before = camera(DVec3::new(0.0, 1.0, 5.0), DVec2::ZERO);
    let seen = scene.seen(&before);
    let seen = Seen { tiles: &seen, moving: &[], clearance: 0.0 };
    let boxes = scene.boxes();
    let at = |z: f64| cells(seen, &camera(DVec3::new(0.0, 1.0, z), DVec2::ZERO), &boxes);
    assert!(at(4.0).is_some() && at(2.0).is_none());
}

#[test]
fn bad_tiles_and_depths_are_named() {
    let camera = camera(DVec3::Y, DVec2::ZERO);
    let good = super::SeenTile {
        pixels: [0.0, 0.0, 5.0, 5.0],
        slope: DVec2::ZERO,
        nearness: [0.1, 0.2],
        jump: 0.0,
    };
    let mut seen = SeenTiles::new(&camera);
    assert_eq!(seen.set(&camera, |_| Some(good)), Ok(()));
    for bad in [
        super::SeenTile { nearness: [0.2, 0.1], ..good },
        super::SeenTile { nearness: [0.1, f64::INFINITY], ..good },
        super::SeenTile { slope: DVec2::NAN, ..good },
        super::SeenTile { pixels: [5.0, 0.0, 0.0, 5.0], ..good },
        super::SeenTile { jump: f64::NAN, ..good },
    ] {
        let error = seen.set(&camera, |index| (index > 9).then_some(bad)).unwrap_err();
        assert!(error.to_string().starts_with("seen.tiles: "), "{error}");
        assert!(seen.tiles().iter().all(Option::is_none));
    }
    for depth in [0.0, -1.0, f64::NAN] {
        let error = SeenTiles::of_depths(&camera, |_, _| depth).unwrap_err();
        assert!(error.to_string().starts_with("seen.depth: "), "{error}");
    }
}
