use crate::Ray;
use glam::DVec3;

/// Where a ray's line meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    pub(crate) t: f64,
    /// Weights of the three corners; they sum to 1.
    pub(crate) weights: [f64; 3],
}

/// A ray prepared for the watertight triangle test of Woop, Benthin and Wald (Watertight
/// Ray/Triangle Intersection, JCGT 2013). The test shears space so that the ray runs along an axis,
/// and the signs of three 2D edge functions then tell whether the ray passes inside the triangle.
///
/// All of it is in double precision. No ray passes between triangles that share an edge or a
/// corner: neighbours have the same sheared corners, and an edge function of swapped corners is
/// exactly the negative. Because rounding is monotonic, fl(ab) − fl(cd) never has the wrong sign.
/// At worst it is zero, which counts as inside for both triangles.
pub(crate) struct ShearedRay {
    origin: DVec3,
    /// Indices of the axes: two of the plane that corners are projected to, then the one with the
    /// ray's largest component.
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

    /// The hit, anywhere along the ray's line and from either side of the triangle; `None` without
    /// one.
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
            // The triangle is seen edge-on. Its neighbours, which are not, are hit instead.
            return None;
        }
        let weights = [u, v, w].map(|e| e / determinant);
        let t = (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) * sz;
        t.is_finite().then_some(TriangleHit { t, weights })
    }
}
