//! Trees of round branches and leaf cards.

use super::mesh_builder::MeshBuilder;
use super::stage::{Paint, Shape, Stage, Variation, standing};
use crate::types::{Texture, Wrap};
use glam::{DVec3, Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// How a kind of tree grows. Lengths are in metres.
#[derive(Clone, Copy)]
pub(super) struct Habit {
    pub(super) trunk: f32,
    pub(super) radius: f32,
    /// Number of children of the trunk, of a limb, and of a branch.
    pub(super) children: [u32; 3],
    /// Angle between a child and its parent, radians.
    pub(super) spread: f32,
    /// Ratio of a child's length to its parent's.
    pub(super) shrink: f32,
    /// Number of leaf cards on a twig; 0 for winter trees.
    pub(super) leaves: u32,
    /// Width of a leaf card, metres.
    pub(super) leaf: f32,
}

/// An oak, with a spreading crown.
pub(super) const OAK: Habit = Habit {
    trunk: 3.4,
    radius: 0.26,
    children: [9, 6, 5],
    spread: 0.95,
    shrink: 0.66,
    leaves: 5,
    leaf: 0.46,
};

/// A birch, tall and slender.
pub(super) const BIRCH: Habit = Habit {
    trunk: 6.4,
    radius: 0.15,
    children: [14, 5, 4],
    spread: 0.70,
    shrink: 0.42,
    leaves: 4,
    leaf: 0.34,
};

/// A leafless tree with many thin branches.
pub(super) const WINTER: Habit =
    Habit { children: [9, 7, 6], leaves: 0, trunk: 3.0, radius: 0.22, ..OAK };

/// A kind of tree, as shapes that a stage can place.
#[derive(Clone, Copy)]
pub(super) struct Tree {
    wood: Shape,
    leaves: Option<Shape>,
}

impl Tree {
    pub(super) fn grow(
        stage: &mut Stage,
        habit: Habit,
        seed: u64,
        bark: Paint,
        leaf: Paint,
    ) -> Self {
        let mut wood = MeshBuilder::new();
        let mut leaves = MeshBuilder::new();
        let mut grower =
            Grower { habit, vary: Variation::new(seed), wood: &mut wood, leaves: &mut leaves };
        grower.branch(Vec3::new(0.0, -0.1, 0.0), Vec3::Y, habit.trunk, habit.radius, 0);
        let wood = stage.shape(wood, bark);
        let leaves = (habit.leaves > 0).then(|| stage.shape(leaves, leaf));
        Self { wood, leaves }
    }

    pub(super) fn place(self, stage: &mut Stage, at: DVec3, yaw_rad: f64, scale: f64) {
        for shape in [Some(self.wood), self.leaves].into_iter().flatten() {
            stage.place(shape, standing(at, yaw_rad, scale));
        }
    }
}

struct Grower<'a> {
    habit: Habit,
    vary: Variation,
    wood: &'a mut MeshBuilder,
    leaves: &'a mut MeshBuilder,
}

impl Grower<'_> {
    fn branch(&mut self, from: Vec3, along: Vec3, length: f32, radius: f32, depth: usize) {
        const SIDES: [u32; 4] = [10, 7, 5, 3];
        let joints = [7, 5, 4, 3][depth];
        let mut direction = along;
        let mut path = vec![from];
        for _ in 0..joints {
            let wander = Vec3::new(self.wiggle(), self.wiggle() + 0.10, self.wiggle());
            direction = (direction + wander * if depth == 0 { 0.5 } else { 1.3 }).normalize();
            path.push(path[path.len() - 1] + direction * (length / joints as f32));
        }
        let taper = |t: f32| radius * (1.0 - 0.75 * t);
        let radii: Vec<f32> = (0..=joints).map(|i| taper(i as f32 / joints as f32)).collect();
        self.wood.tube(&path, &radii, SIDES[depth]);
        let at = |t: f32| {
            let x = t * joints as f32;
            let i = (x as usize).min(joints - 1);
            (path[i].lerp(path[i + 1], x - i as f32), (path[i + 1] - path[i]).normalize())
        };
        if depth == 3 {
            for k in 0..self.habit.leaves {
                let (place, along) = at((k as f32 + 0.5) / self.habit.leaves as f32);
                self.leaf(place, along);
            }
            return;
        }
        let n = self.habit.children[depth];
        let first = if depth == 0 { 0.38 } else { 0.2 };
        let turn = self.vary.unit() * TAU;
        for k in 0..n {
            let t = first + (1.0 - first) * (k as f32 + self.vary.range(0.3, 0.9)) / n as f32;
            let (place, forward) = at(t.min(0.99));
            // Children surround the parent by steps of the golden angle, and lean less towards the
            // parent's tip.
            let around = Quat::from_axis_angle(forward, turn + 2.399_963 * k as f32);
            let lean = self.habit.spread * self.vary.range(0.8, 1.2) * (1.25 - 0.6 * t);
            let side = around * forward.any_orthonormal_vector();
            let direction = (forward * lean.cos() + side * lean.sin()).normalize();
            let reach = length * self.habit.shrink * self.vary.range(0.75, 1.15) * (1.2 - 0.5 * t);
            self.branch(place, direction, reach, taper(t) * 0.62, depth + 1);
        }
    }

    fn leaf(&mut self, at: Vec3, along: Vec3) {
        let size = self.habit.leaf * self.vary.range(0.75, 1.2);
        let droop = Vec3::new(self.wiggle(), self.wiggle() - 0.12, self.wiggle()) * 3.0;
        let stem = (along + droop).normalize();
        let roll = Quat::from_axis_angle(stem, self.vary.unit() * TAU);
        let across = roll * stem.any_orthonormal_vector();
        self.leaves.sheet(at - across * size / 2.0 + stem * size, across * size, -stem * size, 1);
    }

    fn wiggle(&mut self) -> f32 {
        self.vary.range(-0.16, 0.16)
    }
}

/// A sprig of pointed leaves on a transparent background. Its stem rises from v = 1.
pub(super) fn leaf_texture(tint: Vec3) -> Texture {
    const N: u32 = 192;
    let leaf = |p: Vec2, base: Vec2, angle: f32, length: f32| {
        let q = Vec2::from_angle(-angle).rotate(p - base) / length;
        // Half the width of a leaf of unit length at q.x.
        let half = 0.30 * (q.x * (1.0 - q.x)).max(0.0).powf(0.72) * (1.35 - 0.7 * q.x);
        ((half - q.y.abs()) * length, q)
    };
    let pixel = |i: u32| {
        let p = Vec2::new((i % N) as f32 + 0.5, N as f32 - (i / N) as f32 - 0.5) / N as f32;
        let mut inside = 0.012 - (p.x - 0.5).abs().max(p.y - 0.8);
        let mut shade = 0.75;
        let pairs = (0..4).flat_map(|k| [(k, 1.0), (k, -1.0)]);
        for (k, side) in pairs.chain([(4, 0.0)]) {
            let base = Vec2::new(0.5, 0.08 + 0.17 * k as f32);
            let angle = TAU / 4.0 - side * (0.95 - 0.08 * k as f32);
            let (distance, q) = leaf(p, base, angle, 0.42 - 0.03 * k as f32);
            if distance > inside {
                inside = distance;
                let vein = (q.y.abs() < 0.012) as u8 as f32 * 0.25;
                shade = 0.8 + 0.3 * q.x + vein + 0.05 * (k % 2) as f32;
            }
        }
        let color = (tint * shade).clamp(Vec3::ZERO, Vec3::ONE) * 255.0;
        // Alpha ramps over one pixel and is one half at the outline of the leaf, where the mask
        // cuts.
        let alpha = (inside * N as f32 + 0.5).clamp(0.0, 1.0) * 255.0;
        [color.x as u8, color.y as u8, color.z as u8, alpha as u8]
    };
    let rgba = (0..N * N).map(pixel).collect();
    Texture { size: [N, N], rgba, wrap: [Wrap::Clamp; 2], ..Texture::default() }
}
