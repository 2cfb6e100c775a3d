//! Tests of casters' boxes against planes, four planes at a time.

use glam::{DVec3, Vec3, Vec4};
use umbrage::{Aabb, Plane};

/// Four half-spaces in local space, in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FourPlanes {
    /// The four normals' coordinates.
    normals: [Vec4; 3],
    offsets: Vec4,
}

/// A box in local space, in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalBox {
    center: Vec3,
    half: Vec3,
}

/// The share by which sizes are enlarged, so that rounding never culls a caster: more than the
/// rounding errors of all steps of a test together, in single precision.
const SLACK: f32 = 2e-6;

impl LocalBox {
    /// `aabb` in world space, relative to `origin`.
    pub(crate) fn new(aabb: Aabb, origin: DVec3) -> Self {
        let [min, max] = [aabb.min - origin, aabb.max - origin];
        let center = (0.5 * (min + max)).as_vec3();
        let half = (0.5 * (max - min)).as_vec3();
        Self { center, half: half + SLACK * (half + center.abs()) }
    }

    /// Whether the box contains no point.
    pub(crate) fn is_empty(&self) -> bool {
        self.half.cmplt(Vec3::ZERO).any()
    }
}

impl FourPlanes {
    /// The first four of `planes`. If there are fewer, all of space counts as the others.
    pub(crate) fn new(planes: &[Plane]) -> Self {
        let mut four = Self { normals: [Vec4::ZERO; 3], offsets: Vec4::ZERO };
        for (i, plane) in planes.iter().take(4).enumerate() {
            let offset = plane.offset as f32;
            four.offsets[i] = offset + SLACK * offset.abs();
            for (axis, normal) in four.normals.iter_mut().enumerate() {
                normal[i] = plane.normal[axis] as f32;
            }
        }
        four
    }

    /// The half-spaces, but for those that are all of space.
    pub(crate) fn planes(&self) -> impl Iterator<Item = Vec4> + '_ {
        let plane = |i: usize| Vec3::from(self.normals.map(|n| n[i])).extend(self.offsets[i]);
        (0..4).map(plane).filter(|plane| plane.truncate() != Vec3::ZERO)
    }

    /// Whether any point of the box may lie inside all four half-spaces.
    pub(crate) fn may_touch(&self, aabb: &LocalBox) -> bool {
        let farthest = |axis: usize| {
            let normal = self.normals[axis];
            normal * aabb.center[axis] + normal.abs() * aabb.half[axis]
        };
        let distances = farthest(0) + farthest(1) + farthest(2) + self.offsets;
        !distances.cmplt(Vec4::ZERO).any()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Single precision may keep a box too many, of those that all but touch, and never one too
    /// few.
    #[test]
    fn no_box_is_culled_that_double_precision_keeps() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24) - 0.5
        };
        let mut counts = [[0; 2]; 2];
        for _ in 0..100_000 {
            let mut vector = |size: f64| DVec3::new(random(), random(), random()) * size;
            let origin = vector(1e4);
            let local = vector(100.0);
            let aabb = Aabb::new(origin + local, origin + local + vector(10.0));
            let relative = Aabb { min: aabb.min - origin, max: aabb.max - origin };
            let plane = Plane::through(vector(100.0), vector(1.0).normalize());
            // Some planes touch a corner.
            let touching = if local.x > 25.0 {
                let farthest =
                    DVec3::select(plane.normal.cmpge(DVec3::ZERO), relative.max, relative.min);
                Plane { offset: -plane.normal.dot(farthest) + 1e-12, ..plane }
            } else {
                plane
            };
            let exact = touching.may_touch(relative);
            let fast = FourPlanes::new(&[touching]).may_touch(&LocalBox::new(aabb, origin));
            counts[usize::from(exact)][usize::from(fast)] += 1;
        }
        let [[culled, kept_too_many], [too_few, kept]] = counts;
        assert_eq!(too_few, 0);
        assert!(culled > 10_000 && kept > 10_000 && kept_too_many < 20, "{counts:?}");
    }
}
