//! Random valid views, lights and bounds, and brute-force geometry to check plans against.
#![allow(dead_code, reason = "each test file uses its own share of this module")]

use glam::DVec3;
use proptest::prelude::*;
use umbrage::{
    Aabb, Bounds, Camera, Cover, Faces, Light, Limits, LookAt, MapError, Objective, Orthographic,
    Partition, Plan, Plane, Planner, PointLight, Slab, Splits, SpotLight, Technique, Warp,
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

/// The largest ratio of the storage that `adaptive` reports to that which `uniform` does, but for
/// rounding.
pub(crate) const ADAPTIVE_OVER_UNIFORM: f64 = 1.0 + 1e-9;

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
    camera_with(1.0, 10.0..120.0, 1e4)
}

/// Views whose positions and distances are `scale` times as large as usual, with a field of view in
/// degrees and a ratio of far to near distance of up to `most_ratio`.
fn camera_with(
    scale: f64,
    fov_y_deg: std::ops::Range<f64>,
    most_ratio: f64,
) -> impl Strategy<Value = Camera> {
    let eye = prop_oneof![
        3 => Just(1.0),
        2 => Just(100.0),
        1 => Just(1e5),
    ]
    .prop_flat_map(move |r| [-r..r, -r..r, -r..r].prop_map(move |eye| DVec3::from(eye) * scale));
    (
        eye,
        direction(),
        direction(),
        fov_y_deg,
        log_range(0.01, 10.0),
        log_range(1.001, most_ratio),
        prop_oneof![Just([1280, 720]), Just([512, 512]), Just([300, 900])],
    )
        .prop_map(move |(eye, forward, up, fov, near, ratio, image)| {
            let (target, near) = (eye + forward * scale, near * scale);
            let far = (near * ratio).min(1e9);
            let camera = match orthographic(fov) {
                None => {
                    let fov_y_rad = fov.to_radians();
                    Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image })
                }
                // The near plane of some views lies at the eye or behind it.
                Some((height, before_eye)) => {
                    let length = far - near;
                    let near = near.min(length) * before_eye;
                    let (height, far) = ((height * length).max(1e-9), near + length);
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

/// Views as [`camera`] gives, and odd ones: of micrometres and of a hundred thousand kilometres, as
/// narrow as a telescope's and as wide as 179.9°.
fn odd_camera() -> impl Strategy<Value = Camera> {
    let scaled = (log_range(1e-6, 1e4), prop_oneof![Just(1e2), Just(1e4), Just(1e7)])
        .prop_flat_map(|(scale, most_ratio)| {
            prop_oneof![
                4 => camera_with(scale, 10.0..120.0, most_ratio).boxed(),
                1 => camera_with(scale, 0.01..10.0, most_ratio).boxed(),
                1 => camera_with(scale, 120.0..179.9, most_ratio).boxed(),
            ]
        });
    prop_oneof![1 => camera().boxed(), 2 => scaled.boxed()]
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
    let has_cube = match light {
        Light::Directional { .. } => false,
        Light::Spot(spot) => spot.half_angle_rad > 75f64.to_radians(),
        Light::Point(_) => true,
    };
    if has_cube { 6 * maps } else { maps }
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
                near: (distance * 0.01).max(1e-12),
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
                near: (distance * 0.01).max(1e-12),
                range: distance * 3.0,
            })
        },
    )
}

/// A spot light of any width, of which some have six maps.
fn wide_spot(camera: Camera) -> impl Strategy<Value = Light> {
    let half_deg = prop_oneof![60.0..90.0f64, 89.0..90.0, Just(90.0)];
    (spot(camera), half_deg).prop_map(|(light, half_deg)| match light {
        Light::Spot(spot) => {
            Light::Spot(SpotLight { half_angle_rad: half_deg.to_radians(), ..spot })
        }
        other => other,
    })
}

/// Lights where formulas have their limits: suns almost or exactly across or along the view or
/// along an axis, lamps at the eye, beside it, and in the planes of the view's frustum, lamps that
/// begin at once or reach to the end of the world.
fn odd_light(camera: Camera) -> impl Strategy<Value = Light> {
    let axis = || {
        (0usize..3, any::<bool>()).prop_map(
            |(i, back)| {
                if back { -DVec3::AXES[i] } else { DVec3::AXES[i] }
            },
        )
    };
    let tiny = || (0.0..300.0f64).prop_map(|digits| 10f64.powf(-digits));
    let across =
        (direction(), tiny(), -1i8..=1).prop_filter_map("a direction", move |(d, tiny, sign)| {
            let across = d.reject_from_normalized(camera.forward()).try_normalize()?;
            Some(across + camera.forward() * (tiny * f64::from(sign)))
        });
    let along = (direction(), tiny()).prop_map(move |(d, tiny)| camera.forward() + d * tiny);
    let suns = prop_oneof![2 => across.boxed(), 1 => along.boxed(), 1 => axis().boxed()]
        .prop_map(|direction| Light::Directional { direction });
    let beside_eye = (direction(), 0.0..20.0f64)
        .prop_map(move |(d, digits)| camera.eye() + d * (size(&camera) * 10f64.powf(-digits)));
    let in_plane = ([0.0..1.0f64, 0.0..1.0], 0usize..6).prop_map(move |([u, v], plane)| {
        let [w, h] = camera.image().map(f64::from);
        let [left, right, top, bottom] = [[0.0, u], [1.0, u], [u, 0.0], [u, 1.0]];
        let ray = |[x, y]: [f64; 2]| camera.ray(glam::DVec2::new(x * w, y * h));
        let depth = camera.near() + (camera.far() - camera.near()) * v;
        camera.eye()
            + match plane {
                0 => ray(left).at(depth),
                1 => ray(right).at(depth),
                2 => ray(top).at(depth),
                3 => ray(bottom).at(depth),
                4 => ray([u, v]).at(camera.near()),
                _ => ray([u, v]).at(camera.far()),
            }
    });
    let place = prop_oneof![Just(camera.eye()), beside_eye, in_plane];
    let ends = prop_oneof![
        2 => (log_range(1e-6, 0.1), log_range(0.2, 10.0))
            .prop_map(move |(near, range)| [near, range].map(|share| share * size(&camera))),
        1 => Just([1e-12, 1e12]),
    ];
    let half_deg = prop_oneof![1.0..90.0f64, Just(90.0)];
    let lamps = (place, ends, direction(), half_deg, any::<bool>()).prop_map(
        |(position, [near, range], direction, half_deg, is_spot)| {
            // At the eye of a tiny view the nearest end may be nearer than lamps allow.
            let near = near.max(1e-12);
            if is_spot {
                let half_angle_rad = half_deg.to_radians();
                Light::Spot(SpotLight { position, direction, half_angle_rad, near, range })
            } else {
                Light::Point(PointLight { position, near, range })
            }
        },
    );
    prop_oneof![1 => suns.boxed(), 2 => lamps.boxed(), 1 => wide_spot(camera).boxed()]
}

/// Boxes around receivers amid the view, some of them flat, or none.
fn receivers(camera: Camera) -> impl Strategy<Value = Option<Aabb>> {
    let unit = || [0.0..1.0f64, 0.0..1.0, 0.0..1.0];
    proptest::option::of((unit(), unit(), 0usize..4).prop_map(move |(a, b, flat)| {
        let mut b = point_in_view(&camera, b);
        let a = point_in_view(&camera, a);
        // Some worlds are a flat floor.
        if flat < 3 {
            b[flat] = a[flat];
        }
        Aabb::new(a, b)
    }))
}

fn bounds(receivers: Option<Aabb>) -> Bounds<'static> {
    Bounds { receivers, casters: receivers, ..Bounds::default() }
}

pub(crate) fn config() -> impl Strategy<Value = Config> {
    camera().prop_flat_map(|camera| {
        let light = prop_oneof![
            3 => sun(camera).boxed(),
            1 => spot(camera).boxed(),
            1 => point(camera).boxed(),
        ];
        (Just(camera), light, receivers(camera)).prop_map(|(camera, light, receivers)| Config {
            camera,
            light,
            bounds: bounds(receivers),
        })
    })
}

/// Configurations as [`config`] gives, and with odd views and lights. Some lamps lie in the plane
/// of a side of the receivers' box.
pub(crate) fn odd_config() -> impl Strategy<Value = Config> {
    odd_camera().prop_flat_map(|camera| {
        let light = prop_oneof![
            2 => sun(camera).boxed(),
            1 => spot(camera).boxed(),
            1 => point(camera).boxed(),
            3 => odd_light(camera).boxed(),
        ];
        (Just(camera), light, receivers(camera), 0usize..12).prop_map(
            |(camera, mut light, receivers, flush)| {
                if let (Some(position), Some(b)) = (position_mut(&mut light), receivers) {
                    if flush < 3 {
                        position[flush] = b.min[flush];
                    }
                }
                Config { camera, light, bounds: bounds(receivers) }
            },
        )
    })
}

fn position_mut(light: &mut Light) -> Option<&mut DVec3> {
    match light {
        Light::Directional { .. } => None,
        Light::Spot(spot) => Some(&mut spot.position),
        Light::Point(point) => Some(&mut point.position),
    }
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
        match self.light {
            Light::Spot(spot) if !spot.is_wide() => {
                let apex = spot.position - camera.eye();
                let axis = spot.direction.normalize();
                planes.push(Plane::through(apex + axis * spot.near, axis));
                planes.push(Plane::through(apex + axis * spot.range, -axis));
            }
            _ => {}
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
                let is_within = !spot.is_wide()
                    || (r.length() <= spot.range && r.abs().max_element() >= spot.near);
                let cos = spot.half_angle_rad.cos();
                is_within && r.dot(spot.direction) > r.length() * spot.direction.length() * cos
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

/// Boxes among a configuration's receivers, or in its view if it has none. Some are flat, some
/// empty, some repeated and some out of sight. They are described by numbers that apply to any
/// configuration.
pub(crate) fn boxes() -> impl Strategy<Value = Vec<PartialBox>> {
    let unit = || prop::array::uniform3(0.0..=1.0f64);
    let within = (unit(), unit(), 0.0..=1.0f64, 0usize..6)
        .prop_map(|(a, b, size, flat)| PartialBox::Within { a, b, size, flat });
    let some = prop_oneof![
        8 => within,
        1 => Just(PartialBox::Empty),
        1 => Just(PartialBox::SameAsLast),
        1 => Just(PartialBox::OutOfSight),
    ];
    // Of the longer lists, some boxes are served in groups.
    prop_oneof![
        9 => prop::collection::vec(some.clone(), 1..12),
        1 => prop::collection::vec(some, 40..160),
    ]
}

#[derive(Clone, Debug)]
pub(crate) enum PartialBox {
    /// From a towards b, by the share `size` of the way; flat along the axis that `flat` names, if
    /// any.
    Within {
        a: [f64; 3],
        b: [f64; 3],
        size: f64,
        flat: usize,
    },
    Empty,
    SameAsLast,
    OutOfSight,
}

/// The boxes in world space.
pub(crate) fn parts(config: &Config, boxes: &[PartialBox]) -> Vec<Aabb> {
    let Config { camera, bounds, .. } = config;
    let place = |n: [f64; 3]| match bounds.receivers {
        Some(all) => all.min + all.size() * DVec3::from(n),
        None => point_in_view(camera, n),
    };
    let mut parts: Vec<Aabb> = Vec::new();
    for partial in boxes {
        parts.push(match *partial {
            PartialBox::Within { a, b, size, flat } => {
                let a = place(a);
                let mut b = a.lerp(place(b), size);
                if flat < 3 {
                    b[flat] = a[flat];
                }
                Aabb::new(a, b)
            }
            PartialBox::Empty => Aabb::EMPTY,
            PartialBox::SameAsLast => parts.last().copied().unwrap_or(Aabb::EMPTY),
            PartialBox::OutOfSight => {
                let behind = camera.eye() - camera.forward() * 3.0 * size(camera);
                Aabb::new(behind, behind + size(camera) * 0.1)
            }
        });
    }
    parts
}

/// What is wrong with a plan: the kind, and a description.
#[derive(Debug)]
pub(crate) struct Fault {
    pub kind: &'static str,
    pub what: String,
}

/// Checks that points which the camera sees in the light are served: each lands in its maps, its
/// casters share its texel, lie nearer the light and are not culled, and its errors are at most the
/// reported ones.
pub(crate) fn check_served(config: &Config, plan: &Plan, points: &[DVec3]) -> Result<(), Fault> {
    let check = |is_right: bool, kind: &'static str, what: &dyn Fn() -> String| {
        if is_right { Ok(()) } else { Err(Fault { kind, what: what() }) }
    };
    // The rounding of world coordinates, as a share of the scene's size.
    let rounding = config.camera.eye().abs().max_element() * 1e-15;
    for &p in points {
        let shares: f64 = plan.lookup(0, p).map(|(_, share)| share).sum();
        check((shares - 1.0).abs() < 1e-9, "shares", &|| format!("of {shares} at {p}"))?;
        for (index, _) in plan.lookup(0, p) {
            let map = &plan.maps[index];
            let [res_s, res_t] = map.resolution.map(f64::from);
            // Depth is inversely proportional to the distance from a lamp. It has no digits left at
            // distances that are so many times as large as the one where it begins.
            let has_depth = match config.light {
                Light::Directional { .. } => true,
                Light::Spot(SpotLight { near, range, .. })
                | Light::Point(PointLight { near, range, .. }) => range < 1e8 * near,
            };
            let nothing = |kind, at: DVec3| Fault { kind, what: format!("at {at}, {map:?}") };
            let shadow = map.project(p).ok_or_else(|| nothing("behind the map", p))?;
            let error =
                map.perspective_error(&config.camera, p).ok_or_else(|| nothing("no error", p))?;
            let pixel = config.camera.pixel_width(config.camera.depth(p));
            // Rounding in texels: its size in metres over a texel's width.
            let slack_s = 1e-7 + rounding / (error.s * pixel * res_s);
            let slack_t = 1e-7 + rounding / (error.t * pixel * res_t);
            let is_within = |x: f64, slack: f64| (-slack..=1.0 + slack).contains(&x);
            check(is_within(shadow.x, slack_s), "s", &|| format!("is {} at {p}", shadow.x))?;
            check(is_within(shadow.y, slack_t), "t", &|| format!("is {} at {p}", shadow.y))?;
            check(is_within(shadow.z, 1e-6), "depth", &|| format!("is {} at {p}", shadow.z))?;
            let in_slab = map.slab_depth(shadow.truncate(), shadow.z);
            let is_in_slab = !has_depth || is_within(in_slab, 1e-6);
            check(is_in_slab, "depth in slab", &|| format!("is {in_slab} at {p}"))?;
            let reported = map.error;
            for (kind, error, largest) in [
                ("error in s", error.s, reported.max_s),
                ("error in t", error.t, reported.max_t),
                ("largest error", error.worst, reported.max),
            ] {
                let is_most = error <= largest * (1.0 + 1e-6);
                check(is_most, kind, &|| format!("{error} > {largest} at {p}"))?;
            }
            let reach = match config.light {
                Light::Directional { .. } => 10.0 * size(&config.camera),
                Light::Spot(spot) => 0.9 * p.distance(spot.position),
                Light::Point(point) => 0.9 * p.distance(point.position),
            };
            let caster = p + config.light.direction_to_light(p) * reach;
            let casts = map.project(caster).ok_or_else(|| nothing("no caster", caster))?;
            // Under a spot light, texels are up to ten times narrower at the caster.
            let metres = 1e-13 * (config.camera.eye().length() + reach);
            let texels = [error.s, error.t].map(|e| 1e-3 + metres / (e * pixel));
            let off = [(casts - shadow).x * res_s, (casts - shadow).y * res_t];
            let is_same = (0..2).all(|i| off[i].abs() < texels[i]);
            check(is_same, "caster's texel", &|| format!("{casts} from {shadow} at {p}"))?;
            let is_nearer = !has_depth || casts.z < shadow.z;
            check(is_nearer, "caster's depth", &|| format!("{} over {}", casts.z, shadow.z))?;
            let is_kept = map.may_cast(Aabb::new(caster, caster));
            check(is_kept, "caster culled", &|| format!("at {caster}, {map:?}"))?;
            if !has_depth {
                continue;
            }
            let beam = map.beam(shadow.truncate()).ok_or_else(|| nothing("no beam", shadow))?;
            let off = (p - beam.origin).reject_from_normalized(beam.direction).length();
            // A lamp's beam is directed from the lamp to a point at its near distance. The rounding
            // of that point's coordinates turns the beam.
            let from_lamp = config.light.position().map_or(0.0, |lamp| {
                let size = (lamp - config.camera.eye()).abs().max_element();
                size * 1e-15 * p.distance(lamp) / beam.reach_back
            });
            let most = 1e-5 * pixel + 1e-3 * error.worst * pixel + 10.0 * rounding + from_lamp;
            check(off <= most, "beam", &|| format!("misses by {off} of {most}"))?;
        }
    }
    Ok(())
}

/// Checks that all numbers of a plan are finite, that directions are of unit length, and that each
/// map's largest error is at least its errors in s and in t.
pub(crate) fn check_numbers(plan: &Plan) -> Result<(), Fault> {
    for map in &plan.maps {
        let check = |is_right: bool, kind| {
            if is_right { Ok(()) } else { Err(Fault { kind, what: format!("{map:?}") }) }
        };
        let matrices = [map.shadow_from_local, map.local_from_shadow];
        check(matrices.iter().all(glam::DMat4::is_finite), "matrices not finite")?;
        check(map.shadow_from_local_f32().is_finite(), "matrix not finite in single precision")?;
        check(map.lambda.is_none_or(|l| l > 0.0 && l.is_finite()), "lambda")?;
        check(map.split.iter().all(|d| d.is_finite()), "split")?;
        let mut planes = map.cell.iter().chain(&map.caster_planes).chain(&map.fade_from);
        check(planes.all(|p| p.normal.is_normalized() && p.offset.is_finite()), "planes")?;
        let MapError { max_s, max_t, max } = map.error;
        check([max_s, max_t, max].iter().all(|e| e.is_finite()), "errors not finite")?;
        check(max >= max_s && max >= max_t, "largest error below those in s and t")?;
        check(map.storage_factor.is_finite(), "storage factor")?;
        let slab = match map.slab {
            Slab::Leaning { slope, begin, thickness } => [slope.x, slope.y, begin, thickness, 1.0],
            Slab::Distances { axis, near, far } => [axis.length(), near, far, far - near, 1.0],
        };
        check(slab.iter().all(|x| x.is_finite()) && slab[3] > 0.0, "slab")?;
    }
    Ok(())
}
