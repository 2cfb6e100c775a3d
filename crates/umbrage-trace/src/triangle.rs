use crate::Ray;
use glam::DVec3;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    pub(crate) t: f64,
    /// Weights of the three corners; they sum to 1.
    pub(crate) weights: [f64; 3],
}

/// A ray prepared for the watertight triangle test of Woop, Benthin and Wald (Watertight Ray/Triangle
/// Intersection, JCGT 2013): space is sheared so that the ray runs along an axis, and the signs of
/// three 2D edge functions tell in or out.
///
/// In f64 throughout. Neighbours see the same sheared corners, an edge function of swapped corners
/// is exactly the negative, and fl(ab) − fl(cd) never has the wrong sign (rounding is monotonic), at
/// worst it is zero, which counts as in for both. So no ray passes between triangles that share an
/// edge or a corner.
pub(crate) struct ShearedRay {
    origin: DVec3,
    /// Axes of the plane that corners are projected to, and the axis the ray mostly runs along.
    axes: [usize; 3],
    shear: [f64; 3],
}

impl ShearedRay {
    pub(crate) fn new(ray: Ray) -> Self {
        let d = ray.direction.abs();
        let axes = if d.x >= d.y && d.x >= d.z {
            [1, 2, 0]
        } else if d.y >= d.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let along = ray.direction[axes[2]];
        let shear = [ray.direction[axes[0]] / along, ray.direction[axes[1]] / along, 1.0 / along];
        Self { origin: ray.origin, axes, shear }
    }

    /// The hit, anywhere along the line and from either side.
    pub(crate) fn intersect(&self, corners: [DVec3; 3]) -> Option<TriangleHit> {
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = corners.map(|corner| {
            let v = (corner - self.origin).to_array();
            let [x, y, z] = self.axes.map(|i| v[i]);
            [x - sx * z, y - sy * z, z]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0 {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None; // edge-on: the neighbours, which are not, catch the ray
        }
        let weights = [u, v, w].map(|e| e / determinant);
        let t = (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) * sz;
        t.is_finite().then_some(TriangleHit { t, weights })
    }
}
