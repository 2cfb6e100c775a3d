//! Stable maps: whatever the camera does, every point of the world keeps its position within the
//! grid of texels; the map moves by whole texels only.

mod common;

use common::{STABLE, direction, planner, point_in_view, technique};
use glam::DVec3;
use proptest::prelude::*;
use umbrage::{
    Aabb, Bounds, Camera, Light, LookAt, Partition, PointLight, ShadowMap, Size, Splits, SpotLight,
    Technique,
};

/// A camera without its pose.
#[derive(Clone, Copy, Debug)]
struct Lens {
    fov_y_rad: f64,
    near: f64,
    far: f64,
    image: [u32; 2],
}

impl Lens {
    fn at(self, Pose { eye, forward, up }: Pose) -> Camera {
        let Self { fov_y_rad, near, far, image } = self;
        let target = eye + forward;
        Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image }).unwrap()
    }
}

#[derive(Clone, Copy, Debug)]
struct Pose {
    eye: DVec3,
    forward: DVec3,
    up: DVec3,
}

/// Fields of view and depth ranges of all kinds. Round numbers give bounding spheres of round
/// radii, which rounding could change in either direction.
fn lens() -> impl Strategy<Value = Lens> {
    let images = || prop_oneof![Just([640, 480]), Just([1280, 720]), Just([512, 512])];
    let any = (20.0..110.0f64, 0.05..2.0f64, 5.0..2000.0f64, images());
    let round = (
        prop_oneof![Just(90.0f64), Just(2.0 * 0.75f64.atan().to_degrees()), Just(60.0)],
        prop_oneof![Just(0.1), Just(0.5), Just(1.0)],
        prop_oneof![Just(60.0), Just(96.0), Just(100.0), Just(300.0)],
        images(),
    )
        .prop_map(|(fov, near, far, image)| (fov, near, far / near, image));
    prop_oneof![any, round].prop_map(|(fov, near, ratio, image)| Lens {
        fov_y_rad: fov.to_radians(),
        near,
        far: near * ratio,
        image,
    })
}

/// Poses within `reach` of a place on the earth or far above it.
fn poses(reach: f64) -> impl Strategy<Value = (DVec3, Vec<Pose>)> {
    let home = prop_oneof![
        2 => Just(DVec3::ZERO),
        1 => direction().prop_map(|d| d * 1e5),
        1 => direction().prop_map(|d| d * 1e6),
    ];
    let unit = || [-1.0..1.0f64, -1.0..1.0, -1.0..1.0];
    let moves = proptest::collection::vec((unit(), direction(), direction()), 12);
    (home, moves).prop_map(move |(home, moves)| {
        let pose = |(m, forward, up)| Pose { eye: home + DVec3::from(m) * reach, forward, up };
        (home, moves.into_iter().map(pose).collect())
    })
}

fn partition() -> impl Strategy<Value = Partition> {
    let splits = prop_oneof![
        Just(Splits::SelfSimilar),
        (0.0..=1.0f64).prop_map(Splits::Practical),
        // Some slices lie beyond the far distance.
        (0.2..50.0f64)
            .prop_map(|first| Splits::At(std::array::from_fn(|i| first * 3f64.powi(i as i32)))),
    ];
    (prop_oneof![Just(1u32), Just(4)], splits, prop_oneof![Just(0.0), Just(0.2)]).prop_map(
        |(slices, splits, overlap)| Partition { slices, splits, overlap, ..Partition::default() },
    )
}

fn size() -> impl Strategy<Value = Size> {
    prop_oneof![
        Just(Size::Budget(1 << 20)),
        Just(Size::Budget(5000)),
        Just(Size::Exact([1024, 512])),
        Just(Size::Exact([2, 2])),
    ]
}

/// Columns of the matrix that do not depend on the position of the world's origin.
fn linear_part(map: &ShadowMap) -> [u64; 12] {
    let columns = [0, 1, 2].map(|i| map.shadow_from_local.col(i).to_array());
    std::array::from_fn(|i| columns.as_flattened()[i].to_bits())
}

/// A map as planned in the first frame in which it is not empty, with the positions of world points
/// in it: texels in s and t, and depth.
struct Reference {
    linear: [u64; 12],
    resolution: [u32; 2],
    places: Vec<Option<DVec3>>,
}

fn places(map: &ShadowMap, landmarks: &[DVec3]) -> Vec<Option<DVec3>> {
    let [s, t] = map.resolution.map(f64::from);
    landmarks.iter().map(|&p| Some(map.project(p)? * DVec3::new(s, t, 1.0))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Under parallel light, positions change by whole texels. The remaining difference is the
    /// rounding of world coordinates: 1e-10 metres a thousand kilometres from the origin.
    #[test]
    fn points_move_by_whole_texels_under_the_sun(
        lens in lens(),
        (home, poses) in poses(300.0),
        sun in prop_oneof![3 => direction(), 1 => Just(DVec3::NEG_Y), 1 => Just(DVec3::Y)],
        partition in partition(),
        size in prop_oneof![4 => size(), 1 => Just(Size::MaxError(80.0))],
        floor: bool,
        numbers in proptest::collection::vec([0.0..1.0f64, 0.0..1.0, 0.0..1.0], 6),
    ) {
        let technique = Technique { partition, size, ..technique(STABLE) };
        let light = Light::Directional { direction: sun };
        let ground = Aabb::new(home + DVec3::new(-200.0, -1.0, -200.0), home + DVec3::new(200.0, 3.0, 200.0));
        let bounds = if floor { Bounds::of_scene(ground) } else { Bounds::default() };
        let landmarks: Vec<DVec3> =
            numbers.iter().map(|&n| home + (DVec3::from(n) - 0.5) * lens.far).collect();
        let rounding = 4.0 * f64::EPSILON * (home.abs().max_element() + 300.0 + lens.far);
        let mut planner = planner();
        let mut references: Vec<Option<Reference>> = Vec::new();
        for pose in poses {
            let camera = lens.at(pose);
            let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
            references.resize_with(plan.maps.len(), || None);
            for (map, reference) in plan.maps.iter().zip(&mut references) {
                if map.is_empty() {
                    continue;
                }
                let here = places(map, &landmarks);
                let Some(known) = reference else {
                    let (linear, resolution) = (linear_part(map), map.resolution);
                    *reference = Some(Reference { linear, resolution, places: here });
                    continue;
                };
                prop_assert_eq!(map.resolution, known.resolution);
                prop_assert_eq!(linear_part(map), known.linear);
                let metres = [0, 1, 2].map(|i| map.shadow_from_local.row(i).truncate().length().recip());
                let texel = [0, 1].map(|i| metres[i] / f64::from(map.resolution[i]));
                // Depth, too, moves by whole texel widths.
                let depth_step = texel[0] / metres[2];
                for (a, b) in here.iter().zip(&known.places) {
                    let moved = a.unwrap() - b.unwrap();
                    let steps = moved / DVec3::new(1.0, 1.0, depth_step);
                    let off = (steps - steps.round()).abs();
                    let slack = 1e-6 + rounding / DVec3::new(texel[0], texel[1], texel[0]);
                    prop_assert!(off.cmple(slack).all(), "{steps}: off by {off}, not {slack}");
                }
            }
            for &n in &numbers {
                let p = point_in_view(&camera, n);
                for (index, _) in plan.lookup(0, p) {
                    let map = &plan.maps[index];
                    let shadow = map.project(p).unwrap();
                    let slack = 1e-9 + rounding * map.shadow_from_local.row(0).truncate().length();
                    let inside = shadow.clamp(DVec3::ZERO, DVec3::ONE);
                    prop_assert!(inside.distance(shadow) <= slack, "{shadow}");
                }
            }
        }
    }

    /// Under lamps no position changes, but for the rounding of world coordinates.
    #[test]
    fn nothing_moves_under_lamps(
        lens in lens(),
        (home, poses) in poses(30.0),
        at in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0],
        towards in direction(),
        is_spot: bool,
        partition in partition(),
        size in size(),
        numbers in proptest::collection::vec([0.0..1.0f64, 0.0..1.0, 0.0..1.0], 6),
    ) {
        // The budget is shared among six sides and their slices.
        let size = if size == Size::Budget(5000) { Size::Budget(50_000) } else { size };
        let technique = Technique { partition, size, ..technique(STABLE) };
        let (position, near, range) = (home + DVec3::from(at) * 30.0, 0.1, 100.0);
        let light = if is_spot {
            Light::Spot(SpotLight { position, direction: towards, half_angle_rad: 0.6, near, range })
        } else {
            Light::Point(PointLight { position, near, range })
        };
        let landmarks: Vec<DVec3> =
            numbers.iter().map(|&n| position + (DVec3::from(n) - 0.5) * 60.0).collect();
        let rounding = 8.0 * f64::EPSILON * (home.abs().max_element() + 100.0);
        let mut planner = planner();
        let mut references: Vec<Option<Reference>> = Vec::new();
        for pose in poses {
            let camera = lens.at(pose);
            let plan = planner.plan(&camera, &[light], &Bounds::default(), &technique).unwrap();
            references.resize_with(plan.maps.len(), || None);
            for (map, reference) in plan.maps.iter().zip(&mut references) {
                if map.is_empty() {
                    continue;
                }
                let here = places(map, &landmarks);
                let Some(known) = reference else {
                    let (linear, resolution) = (linear_part(map), map.resolution);
                    *reference = Some(Reference { linear, resolution, places: here });
                    continue;
                };
                prop_assert_eq!(map.resolution, known.resolution);
                prop_assert_eq!(linear_part(map), known.linear);
                for ((a, b), &p) in here.iter().zip(&known.places).zip(&landmarks) {
                    let (&Some(a), &Some(b)) = (a, b) else { continue };
                    // Near the plane of the lamp itself images tend to infinity.
                    let along = (p - position).dot(map.beam(glam::DVec2::splat(0.5)).unwrap().direction);
                    if along > near {
                        let slack = 1e-9 + rounding / along;
                        let (a, b) = (a / f64::from(map.resolution[0]), b / f64::from(map.resolution[0]));
                        prop_assert!(a.distance(b) <= slack * (1.0 + a.length()) * 100.0, "{a} {b} {slack}");
                    }
                }
            }
        }
    }
}

/// Slices beyond the view need no texels; slices within it keep their texels even if they see no
/// receivers.
#[test]
fn slices_beyond_the_view_cost_nothing() {
    let lens = Lens { fov_y_rad: 1.0, near: 1.0, far: 100.0, image: [640, 480] };
    let camera = lens.at(Pose { eye: DVec3::ZERO, forward: DVec3::NEG_Z, up: DVec3::Y });
    let light = Light::Directional { direction: DVec3::NEG_Y };
    let texels = |splits: &[f64], bounds: &Bounds| {
        let mut at = [1e9; Partition::MAX_SLICES - 1];
        at[..splits.len()].copy_from_slice(splits);
        let partition =
            Partition { splits: Splits::At(at), ..Partition::slices(splits.len() as u32 + 1) };
        let technique = Technique { partition, ..technique(STABLE) };
        let plan = planner().plan(&camera, &[light], bounds, &technique).unwrap().clone();
        plan.maps.iter().map(ShadowMap::texels).collect::<Vec<_>>()
    };
    let all = Bounds::default();
    let one = texels(&[], &all)[0];
    assert_eq!(texels(&[0.5, 200.0], &all), [0, one, 0]);
    let far_away = Aabb::new(DVec3::new(-9.0, -9.0, -60.0), DVec3::new(9.0, 9.0, -50.0));
    let [_, beyond] = texels(&[20.0], &all)[..] else { panic!("two maps") };
    assert_eq!(texels(&[20.0], &Bounds::of_scene(far_away)), [0, beyond]);
}
