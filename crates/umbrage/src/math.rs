//! Small functions that several modules share.

use glam::DVec3;
use std::cmp::Ordering;

/// The smallest and the largest of the values; (∞, −∞) if there are none.
pub(crate) fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    // Comparisons are faster than `f64::min` and `f64::max`, and skip NaN as these do.
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| {
        (if v < lo { v } else { lo }, if v > hi { v } else { hi })
    })
}

/// A value in a heap that is ordered by a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keyed<T> {
    pub key: f64,
    pub value: T,
}

impl<T> Ord for Keyed<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key)
    }
}

impl<T> PartialOrd for Keyed<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> PartialEq for Keyed<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T> Eq for Keyed<T> {}

/// Larger singular value of the matrix with two columns, from their squared lengths and their dot
/// product.
pub(crate) fn largest_stretch(a_squared: f64, b_squared: f64, dot: f64) -> f64 {
    let half_difference = (a_squared - b_squared) / 2.0;
    (a_squared.midpoint(b_squared) + (half_difference * half_difference + dot * dot).sqrt()).sqrt()
}

/// Two unit vectors perpendicular to a unit vector and to each other: the images of the x and z
/// axes under the rotation that takes −y to `axis`. They depend smoothly on `axis` everywhere but
/// at +y (Frisvad 2012).
pub(crate) fn perpendicular_pair(axis: DVec3) -> [DVec3; 2] {
    let denominator = 1.0 - axis.y;
    if denominator < 1e-12 {
        return [DVec3::X, DVec3::NEG_Z];
    }
    [DVec3::X, DVec3::Z].map(|v| v - (axis - DVec3::Y) * (axis.dot(v) / denominator))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_perpendicular_and_follow_their_axis() {
        let mut last: Option<[DVec3; 2]> = None;
        for i in 0..2000 {
            let a = f64::from(i) * 0.01;
            let axis = DVec3::new(a.sin(), (0.37 * a).cos() - 0.5, a.cos()).normalize();
            let [x, z] = perpendicular_pair(axis);
            for v in [x.length() - 1.0, z.length() - 1.0, x.dot(z), x.dot(axis), z.dot(axis)] {
                assert!(v.abs() < 1e-9, "{axis}");
            }
            if let Some([last_x, last_z]) = last {
                assert!(last_x.distance(x) < 0.1 && last_z.distance(z) < 0.1, "{axis}");
            }
            last = Some([x, z]);
        }
        let [x, z] = perpendicular_pair(DVec3::Y);
        assert_eq!([x.dot(z), x.y, z.y], [0.0; 3]);
    }
}
