//! The large form as distances along rays, sampled once and interpolated for every vertex.

use super::form::{Form, HALF_HEIGHT, form};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_PI_4;

/// Samples across a side; upright sides are twice as high as wide. They are 5 cm apart.
const SAMPLES: usize = 96;

/// Heights of the ends of the axis that the rays begin on, metres: in the head, and just above the
/// ground.
const AXIS: [f32; 2] = [-HALF_HEIGHT + 0.15, HALF_HEIGHT - 1.35];

/// Length of the rays where they meet the form from outside, metres. All of it is nearer.
const OUTSIDE: f32 = 5.2;

/// The shortest rays, metres. The form contains the axis with that much around it.
const INSIDE: f32 = 0.3;

/// How fast rays may become shorter from one to the next, metres per metre between them.
const STEEPEST: f32 = 3.0;

/// Up to which distance from what stands out the stone falls off no faster, metres. Farther away
/// the form's distances are too rough bounds for this.
const BESIDE: f32 = 0.6;

/// A side of the box that surrounds the form. The boundaries between sides are edges of the grid,
/// and no corner of it is a pole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// An upright one: the front, and from there counter-clockwise as seen from above.
    Upright(u8),
    Top,
    Bottom,
}

impl Side {
    const ALL: [Self; 6] = [
        Self::Upright(0),
        Self::Upright(1),
        Self::Upright(2),
        Self::Upright(3),
        Self::Top,
        Self::Bottom,
    ];

    fn index(self) -> usize {
        match self {
            Self::Upright(k) => k as usize,
            Self::Top => 4,
            Self::Bottom => 5,
        }
    }

    /// The point of the cube [−1, 1]³ at (u, v) of [0, 1]² on this side. Seen from outside, u leads
    /// to the right and v up.
    fn point(self, at: Vec2) -> Vec3 {
        let Vec2 { x: u, y: v } = at * 2.0 - Vec2::ONE;
        match self {
            Self::Upright(0) => Vec3::new(u, v, 1.0),
            Self::Upright(1) => Vec3::new(1.0, v, -u),
            Self::Upright(2) => Vec3::new(-u, v, -1.0),
            Self::Upright(_) => Vec3::new(-1.0, v, u),
            Self::Top => Vec3::new(u, 1.0, -v),
            Self::Bottom => Vec3::new(u, -1.0, v),
        }
    }

    fn samples(self) -> [usize; 2] {
        match self {
            Self::Upright(_) => [SAMPLES, 2 * SAMPLES],
            Self::Top | Self::Bottom => [SAMPLES; 2],
        }
    }
}

/// A ray from the axis outwards. The rays of all points of the box fill space without crossing,
/// because the higher one begins, the more steeply it rises. So whatever lengths a surface has
/// along them, it does not meet itself.
#[derive(Clone, Copy)]
pub(super) struct Ray {
    from: Vec3,
    direction: Vec3,
}

impl Ray {
    pub(super) fn through(side: Side, at: Vec2) -> Self {
        // Equal steps are equal angles along the middle of each side.
        let direction = (side.point(at) * FRAC_PI_4).to_array().map(f32::tan);
        let q = Vec3::from(direction).normalize();
        let height = 0.5 * (AXIS[0] + AXIS[1] + (AXIS[1] - AXIS[0]) * q.y);
        // Only the rays near the ends are steep, so that most look straight at the figure.
        Self { from: Vec3::Y * height, direction: q.with_y(q.y.powi(5)).normalize() }
    }

    pub(super) fn at(self, length: f32) -> Vec3 {
        self.from + self.direction * length
    }
}

/// The form along the rays of all sides.
pub(super) struct Clay {
    /// Of each side, row by row from the bottom, length and roughness. One more sample than needed
    /// surrounds each side, for the interpolation.
    sides: Vec<Vec<Vec2>>,
}

impl Clay {
    pub(super) fn model() -> Self {
        let side = |side: Side| {
            let [columns, rows] = side.samples();
            let at = |i, n| (i as f32 - 1.0) / n as f32;
            let row = |j| (0..columns + 3).map(move |i| Vec2::new(at(i, columns), at(j, rows)));
            (0..rows + 3).flat_map(row).map(|at| meet(Ray::through(side, at))).collect()
        };
        Self { sides: Side::ALL.map(side).into() }
    }

    /// Length and roughness at (u, v) of [0, 1]² on a side, by the cubics of Catmull and Rom 1974.
    pub(super) fn sample(&self, side: Side, at: Vec2) -> (f32, f32) {
        let [columns, rows] = side.samples();
        let place = |x: f32, n: usize| {
            let x = x * n as f32;
            let i = (x as usize).min(n - 1);
            (i, weights(x - i as f32))
        };
        let ((i, wx), (j, wy)) = (place(at.x, columns), place(at.y, rows));
        let samples = &self.sides[side.index()];
        let mut sum = Vec2::ZERO;
        for (row, w) in wy.into_iter().enumerate() {
            let begin = (j + row) * (columns + 3) + i;
            let near = &samples[begin..begin + 4];
            sum += w * (near[0] * wx[0] + near[1] * wx[1] + near[2] * wx[2] + near[3] * wx[3]);
        }
        (sum.x, sum.y.clamp(0.0, 1.0))
    }
}

fn weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

/// Where a ray, followed inwards, meets the form (sphere tracing; Hart 1996), and how rough that
/// is. Beside what stands out, the stone falls off at most [`STEEPEST`]: no chisel reaches behind
/// it, and steeper walls would be stretched over few triangles.
fn meet(ray: Ray) -> Vec2 {
    let (mut length, mut found) = (OUTSIDE, Vec2::new(INSIDE, 0.0));
    // The last millimetres are less than what erosion adds.
    while length > found.x + 3e-3 {
        let Form { distance, roughness } = form(ray.at(length));
        let left = length - STEEPEST * distance.max(0.0);
        if distance < BESIDE && left > found.x {
            found = Vec2::new(left, roughness);
        }
        // The field is steeper than a distance where cloth folds, so steps are shorter.
        length -= (0.7 * distance).max(4e-3);
    }
    found
}
