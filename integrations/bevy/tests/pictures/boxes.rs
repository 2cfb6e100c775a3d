//! A scene of boxes, whose shadows are known in closed form.

use crate::harness::{Harness, Setup, Umbrage, ViewPoint};
use bevy::light::ShadowFilteringMethod;
use bevy::prelude::*;

/// A box, by its middle and half its sides.
#[derive(Clone, Copy)]
pub struct Block {
    pub center: Vec3,
    pub half: Vec3,
}

impl Block {
    pub const fn new(center: [f32; 3], half: [f32; 3]) -> Self {
        Self { center: Vec3::from_array(center), half: Vec3::from_array(half) }
    }

    /// Where a ray enters the box, and the normal there. Rays do not begin inside.
    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        let to = self.center - origin;
        let sides = [to - self.half, to + self.half].map(|side| side / direction);
        let (near, far) = (sides[0].min(sides[1]), sides[0].max(sides[1]));
        let enter = near.max_element();
        (enter <= far.min_element() && enter > 0.0).then(|| {
            let axis = [Vec3::X, Vec3::Y, Vec3::Z][near.max_position()];
            (enter, -axis * direction.dot(axis).signum())
        })
    }
}

/// Ground, a wall, a tall thin post, a step and a plate that hovers.
pub const BLOCKS: [Block; 6] = [
    Block::new([0.0, -0.5, 0.0], [30.0, 0.5, 30.0]),
    Block::new([-3.0, 1.0, -3.0], [0.2, 1.0, 3.0]),
    Block::new([1.0, 1.5, 0.0], [0.06, 1.5, 0.06]),
    Block::new([3.0, 0.1, -1.5], [1.0, 0.1, 1.5]),
    Block::new([0.5, 0.9, -4.0], [1.0, 0.05, 0.7]),
    Block::new([-0.6, 0.4, 1.5], [0.4, 0.4, 0.4]),
];

pub const VIEW: ViewPoint = ViewPoint {
    eye: Vec3::new(1.5, 3.0, 8.0),
    target: Vec3::new(0.0, 0.3, -1.0),
    fov_y_rad: 0.9,
    near: 0.1,
    far: 60.0,
};

pub const SUN: Vec3 = Vec3::new(-0.55, -0.7, -0.35);

/// Bevy's filters.
pub const FILTERS: [ShadowFilteringMethod; 3] = [
    ShadowFilteringMethod::Hardware2x2,
    ShadowFilteringMethod::Gaussian,
    ShadowFilteringMethod::Temporal,
];

/// A small picture, because drivers in software draw it.
pub fn setup(umbrage: Umbrage) -> Setup {
    let mut setup = Setup::new(VIEW, SUN).expect("a view");
    setup.size = [384, 216];
    setup.map_size = 1024;
    setup.filter = ShadowFilteringMethod::Hardware2x2;
    setup.umbrage = umbrage;
    setup
}

pub fn planned(text: &str) -> Umbrage {
    Umbrage::Planned(Box::new(text.parse().expect("a technique")))
}

/// Adds boxes in white.
pub fn add(harness: &mut Harness, blocks: &[Block]) {
    for block in blocks {
        let mesh = Cuboid { half_size: block.half }.mesh().build();
        harness.add_mesh(mesh, Transform::from_translation(block.center), None);
    }
}

/// The nearest box on a ray.
fn nearest(origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let hits = BLOCKS.iter().filter_map(|block| block.hit(origin, direction));
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The visibility of a light at each pixel that it lights well enough to tell. `towards` is the
/// vector from a point to the light, and 0 where the light does not shine.
pub fn truth(size: [u32; 2], towards: impl Fn(Vec3) -> Vec3) -> Vec<Option<f32>> {
    let pose = crate::harness::looking(VIEW.eye, VIEW.target);
    let up = (0.5 * VIEW.fov_y_rad).tan();
    let right = up * size[0] as f32 / size[1] as f32;
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let seen = |(x, y): (u32, u32)| {
        let at = |i: u32, n: u32| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
        let ray = Vec3::new(right * at(x, size[0]), -up * at(y, size[1]), -1.0);
        let direction = (pose.rotation * ray).normalize();
        let (distance, normal) = nearest(VIEW.eye, direction)?;
        let point = VIEW.eye + direction * distance;
        let to_light = towards(point);
        (normal.dot(to_light.normalize_or_zero()) > 0.1).then(|| {
            let hidden = nearest(point + normal * 1e-4, to_light);
            f32::from(u8::from(hidden.is_none_or(|(at, _)| at > 1.0)))
        })
    };
    pixels.map(seen).collect()
}

/// The share of wrong pixels and the mean error, among the pixels whose truth is known and which
/// are bright enough without shadows.
pub fn errors(visible: &[f32], unshadowed: &[f32], truth: &[Option<f32>]) -> [f32; 2] {
    let pixels = visible.iter().zip(unshadowed).zip(truth);
    let known = pixels.filter_map(|((v, u), t)| Some((v - (*t)?).abs()).filter(|_| *u > 1e-4));
    let errors: Vec<f32> = known.collect();
    assert!(errors.len() > 10_000, "the light shines on {} pixels", errors.len());
    let count = errors.len() as f32;
    let wrong = errors.iter().filter(|e| **e > 0.5).count() as f32;
    [wrong / count, errors.iter().sum::<f32>() / count]
}

/// Draws the harness's picture with and without shadows, and returns visibility and brightness.
pub fn draw(harness: &mut Harness) -> (Vec<f32>, Vec<f32>) {
    let measured = harness.measure(1, 1).expect("a picture");
    let visible = measured.shadowed.iter().zip(&measured.unshadowed);
    let visible = visible.map(|(s, u)| if *u > 1e-4 { (s / u).clamp(0.0, 1.0) } else { 0.0 });
    (visible.collect(), measured.unshadowed)
}
