//! Random valid views, lights and bounds, and brute-force geometry to check plans against.
#![allow(dead_code, reason = "each test file uses its own share of this module")]

use glam::DVec3;
use proptest::prelude::*;
use umbrage::{
    Aabb, Bounds, Camera, Cover, Faces, Light, Limits, LookAt, Objective, Orthographic, Partition,
    Plane, Planner, PointLight, Splits, SpotLight, Technique, Warp,
};

/// How a map's texels are spread, and what the map covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub warp: Warp,
    pub cover: Cover,
}

impl From<Warp> for Spread {
    fn from(warp: Warp) -> Self {
        seen(warp)
    }
}

const fn seen(warp: Warp) -> Spread {
    Spread { warp, cover: Cover::Seen }
}

pub(crate) const SCENE: Spread = Spread { warp: Warp::Uniform, cover: Cover::Scene };
pub(crate) const STABLE: Spread = Spread { warp: Warp::Uniform, cover: Cover::Stable };

/// Every warp and every cover, by name.
pub(crate) const WARPS: [(&str, Spread); 11] = [
    ("unfocused", SCENE),
    ("stable", STABLE),
    ("uniform", seen(Warp::Uniform)),
    ("psm", seen(Warp::Psm)),
    ("lispsm", seen(Warp::Lispsm)),
    ("tsm", seen(Warp::Tsm { focus: None })),
    ("tsm(focus)", seen(Warp::Tsm { focus: Some(3.0) })),
    ("adaptive", seen(Warp::Adaptive(Objective::Storage))),
    ("adaptive(area)", seen(Warp::Adaptive(Objective::Area))),
    ("log", seen(Warp::Log)),
    ("lambda=7", seen(Warp::Lambda(7.0))),
];

#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub camera: Camera,
    pub light: Light,
    pub bounds: Bounds<'static>,
}

/// One map of 1024² texels.
pub(crate) fn technique(spread: impl Into<Spread>) -> Technique {
    let Spread { warp, cover } = spread.into();
    Technique { warp, cover, ..Technique::default() }
}

/// A planner for devices that allow long sides.
pub(crate) fn planner() -> Planner {
    Planner::with_limits(Limits { max_side: 1 << 16, ..Limits::default() })
}

pub(crate) fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(y, a)| {
        let r = (1.0 - y * y).sqrt();
        DVec3::new(r * a.cos(), y, r * a.sin())
    })
}

fn log_range(lo: f64, hi: f64) -> impl Strategy<Value = f64> {
    (lo.ln()..hi.ln()).prop_map(f64::exp)
}

/// Perspective and orthographic views.
pub(crate) fn camera() -> impl Strategy<Value = Camera> {
    let eye = prop_oneof![
        3 => Just(1.0),
        2 => Just(100.0),
        1 => Just(1e5),
    ]
    .prop_flat_map(|r| [-r..r, -r..r, -r..r].prop_map(DVec3::from));
    (
        eye,
        direction(),
        direction(),
        10.0..120.0f64,
        log_range(0.01, 10.0),
        log_range(1.001, 1e4),
        prop_oneof![Just([1280, 720]), Just([512, 512]), Just([300, 900])],
    )
        .prop_map(|(eye, forward, up, fov, near, ratio, image)| {
            let (target, far) = (eye + forward, near * ratio);
            let camera = match orthographic(fov) {
                None => {
                    let fov_y_rad = fov.to_radians();
                    Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image })
                }
                // The near plane of some views lies at the eye or behind it.
                Some((height, before_eye)) => {
                    let length = far - near;
                    let near = near.min(length) * before_eye;
                    let (height, far) = (height * length, near + length);
                    Camera::orthographic(Orthographic { eye, target, up, height, near, far, image })
                }
            };
            camera.expect("a valid camera")
        })
}

/// The height of an orthographic view over its range of depths, and where it begins in units of its
/// near distance; `None` for perspective views. Both follow from the digits of a random number, so
/// that the numbers drawn are the same for both kinds.
fn orthographic(random: f64) -> Option<(f64, f64)> {
    let share = |from: u32| (random.to_bits() >> from & 0xfff) as f64 / 4096.0;
    let height = 0.01 * 1e4f64.powf(share(12));
    let begin = match share(24) {
        half if half < 0.5 => 1.0,
        quarter if quarter < 0.75 => 0.0,
        rest => 12.0 * rest - 11.0,
    };
    (share(0) < 0.4).then_some((height, begin))
}

/// Partitions of every kind; one in three is a single map.
pub(crate) fn partition() -> impl Strategy<Value = Partition> {
    let splits = prop_oneof![
        3 => Just(Splits::SelfSimilar),
        1 => (0.0..=1.0f64).prop_map(Splits::Practical),
        1 => Just(Splits::Fitted),
        1 => (log_range(0.01, 10.0), 1.01..3.0f64).prop_map(|(first, ratio)| {
            Splits::At(std::array::from_fn(|i| first * ratio.powi(i as i32)))
        }),
    ];
    let overlap = prop_oneof![2 => Just(0.0), 1 => 0.0..=1.0f64];
    let faces = prop_oneof![
        2 => Just(Faces::Whole),
        1 => Just(Faces::Sides),
        1 => Just(Faces::SidesAndNear),
    ];
    let slices = prop_oneof![4 => 1u32..=4, 1 => 5u32..=16];
    let some = (slices, splits, overlap, faces)
        .prop_map(|(slices, splits, overlap, faces)| Partition { slices, splits, overlap, faces });
    prop_oneof![1 => Just(Partition::default()), 2 => some]
}

/// `partition`, restricted to what this cover allows.
pub(crate) fn possible(partition: Partition, spread: Spread) -> Partition {
    if spread != STABLE {
        return partition;
    }
    let is_fitted = partition.splits == Splits::Fitted;
    let splits = if is_fitted { Splits::SelfSimilar } else { partition.splits };
    Partition { splits, faces: Faces::Whole, ..partition }
}

/// The number of maps that a light must have.
pub(crate) fn map_count(partition: &Partition, light: &Light) -> usize {
    let slices = partition.slices as usize;
    let maps = match partition.faces {
        Faces::Whole => slices,
        Faces::Sides => 4 * slices,
        Faces::SidesAndNear => 4 * slices + 1,
    };
    if matches!(light, Light::Point(_)) { 6 * maps } else { maps }
}

/// Any direction, or one very close to the view direction or its opposite.
fn sun(camera: Camera) -> impl Strategy<Value = Light> {
    prop_oneof![
        4 => direction(),
        1 => (direction(), log_range(1e-9, 0.3), any::<bool>()).prop_map(move |(d, r, back)| {
            let view = if back { -camera.forward() } else { camera.forward() };
            view + d * r
        }),
    ]
    .prop_map(|direction| Light::Directional { direction })
}

/// A spot light that shines at a point amid the view.
fn spot(camera: Camera) -> impl Strategy<Value = Light> {
    ([0.1..0.9f64, 0.1..0.9, 0.0..1.0], direction(), 2.0..70.0f64, log_range(0.2, 3.0)).prop_map(
        move |([x, y, z], from, half, distance)| {
            let seen = point_in_view(&camera, [x, y, z]);
            let distance = distance * size(&camera);
            Light::Spot(SpotLight {
                position: seen - from * distance,
                direction: from,
                half_angle_rad: half.to_radians(),
                near: distance * 0.01,
                range: distance * 2.0,
            })
        },
    )
}

/// A point light amid the view or outside it.
fn point(camera: Camera) -> impl Strategy<Value = Light> {
    ([0.0..1.0f64, 0.0..1.0, 0.0..1.0], direction(), log_range(1e-3, 3.0)).prop_map(
        move |(place, away, distance)| {
            let distance = distance * size(&camera);
            Light::Point(PointLight {
                position: point_in_view(&camera, place) + away * distance,
                near: distance * 0.01,
                range: distance * 3.0,
            })
        },
    )
}

pub(crate) fn config() -> impl Strategy<Value = Config> {
    camera().prop_flat_map(|camera| {
        let light = prop_oneof![
            3 => sun(camera).boxed(),
            1 => spot(camera).boxed(),
            1 => point(camera).boxed(),
        ];
        let unit = || [0.0..1.0f64, 0.0..1.0, 0.0..1.0];
        let receivers =
            proptest::option::of((unit(), unit(), 0usize..4).prop_map(move |(a, b, flat)| {
                let mut b = point_in_view(&camera, b);
                let a = point_in_view(&camera, a);
                // Some worlds are a flat floor.
                if flat < 3 {
                    b[flat] = a[flat];
                }
                Aabb::new(a, b)
            }));
        (Just(camera), light, receivers).prop_map(|(camera, light, receivers)| Config {
            camera,
            light,
            bounds: Bounds { receivers, casters: receivers, ..Bounds::default() },
        })
    })
}

/// A point of the view frustum: x and y across the image, z from near to far, in perspective views
/// denser near the viewer.
pub(crate) fn point_in_view(camera: &Camera, [x, y, z]: [f64; 3]) -> DVec3 {
    let [w, h] = camera.image().map(f64::from);
    let (near, far) = (camera.near(), camera.far());
    let is_orthographic = camera.is_orthographic();
    let depth = if is_orthographic { near + (far - near) * z } else { near * (far / near).powf(z) };
    camera.eye() + camera.ray(glam::DVec2::new(x * w, y * h)).at(depth)
}

/// The smallest length that matters to a camera's maps, metres.
pub(crate) fn detail(camera: &Camera) -> f64 {
    let height = camera.pixel_width(camera.near()) * f64::from(camera.image()[1]);
    if camera.is_orthographic() { height.min(camera.far() - camera.near()) } else { camera.near() }
}

/// The largest length that matters to a camera's maps, metres.
pub(crate) fn size(camera: &Camera) -> f64 {
    if camera.is_orthographic() { reach(camera) } else { camera.far() }
}

/// The largest distance from the eye at which a camera sees anything, metres.
pub(crate) fn reach(camera: &Camera) -> f64 {
    let [w, h] = camera.image().map(f64::from);
    [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)]
        .into_iter()
        .flat_map(|(x, y)| [camera.near(), camera.far()].map(|z| (x, y, z)))
        .map(|(x, y, z)| camera.ray(glam::DVec2::new(x, y)).at(z).length())
        .fold(0.0, f64::max)
}

impl Config {
    /// Half-spaces whose intersection is the body that the camera sees in the light, relative to
    /// the eye; derived independently of the library's own code.
    pub(crate) fn half_spaces(&self) -> Vec<Plane> {
        let camera = &self.camera;
        let [w, h] = camera.image().map(f64::from);
        let corner = |x, y| camera.ray(glam::DVec2::new(x, y));
        let rays = [corner(0.0, 0.0), corner(w, 0.0), corner(w, h), corner(0.0, h)];
        let middle = corner(w / 2.0, h / 2.0).at(camera.far());
        let mut planes: Vec<Plane> = (0..4)
            .map(|i| {
                let [a, b] = [rays[i], rays[(i + 1) % 4]];
                let across = b.at(1.0) - a.at(1.0);
                let plane = Plane::through(a.start, a.direction.cross(across).normalize());
                let is_inside = plane.distance(middle) >= 0.0;
                let sign = if is_inside { 1.0 } else { -1.0 };
                Plane { normal: plane.normal * sign, offset: plane.offset * sign }
            })
            .collect();
        planes.push(Plane { normal: camera.forward(), offset: -camera.near() });
        planes.push(Plane { normal: -camera.forward(), offset: camera.far() });
        if let Some(b) = self.bounds.receivers {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                planes.push(Plane::through(b.min - camera.eye(), axis));
                planes.push(Plane::through(b.max - camera.eye(), -axis));
            }
        }
        if let Light::Spot(spot) = self.light {
            let apex = spot.position - camera.eye();
            let axis = spot.direction.normalize();
            planes.push(Plane::through(apex + axis * spot.near, axis));
            planes.push(Plane::through(apex + axis * spot.range, -axis));
        }
        planes
    }

    /// Corners of the body seen, relative to the eye: all intersections of three planes that lie
    /// inside the others.
    pub(crate) fn corners(&self) -> Vec<DVec3> {
        let planes = self.half_spaces();
        let slack = 1e-9 * reach(&self.camera);
        let mut corners = Vec::new();
        for (i, a) in planes.iter().enumerate() {
            for (j, b) in planes[..i].iter().enumerate() {
                for c in &planes[..j] {
                    let det = a.normal.dot(b.normal.cross(c.normal));
                    let p = -(b.normal.cross(c.normal) * a.offset
                        + c.normal.cross(a.normal) * b.offset
                        + a.normal.cross(b.normal) * c.offset)
                        / det;
                    if det.abs() > 1e-9 && planes.iter().all(|q| q.distance(p) >= -slack) {
                        corners.push(p);
                    }
                }
            }
        }
        corners
    }

    /// Whether the camera sees `world` in the light and within the bounds.
    pub(crate) fn sees(&self, world: DVec3) -> bool {
        let local = world - self.camera.eye();
        let slack = 1e-12 * reach(&self.camera);
        self.half_spaces().iter().all(|p| p.distance(local) >= -slack) && self.lights(world)
    }

    fn lights(&self, world: DVec3) -> bool {
        match self.light {
            Light::Directional { .. } => true,
            Light::Spot(spot) => {
                let r = world - spot.position;
                r.dot(spot.direction)
                    > r.length() * spot.direction.length() * spot.half_angle_rad.cos()
            }
            Light::Point(point) => {
                let r = world - point.position;
                r.length() <= point.range && r.abs().max_element() >= point.near
            }
        }
    }

    /// Random points that the camera sees in the light, from numbers in [0, 1].
    pub(crate) fn seen_points(&self, numbers: &[[f64; 3]]) -> Vec<DVec3> {
        let in_box = |[x, y, z]: [f64; 3]| {
            self.bounds.receivers.map(|b| b.min + b.size() * DVec3::new(x, y, z))
        };
        numbers
            .iter()
            .flat_map(|&n| [Some(point_in_view(&self.camera, n)), in_box(n)])
            .flatten()
            .filter(|&p| self.sees(p))
            .collect()
    }
}
