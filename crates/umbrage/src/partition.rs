//! Which part of the view each map serves (Lloyd et al. 2006, §5).

use crate::bounds::Plane;
use crate::camera::Camera;
use crate::light::Projector;
use crate::math::range;
use crate::plan::Face;
use crate::technique::{Partition, Splits};
use glam::{DVec3, DVec4};

/// The ends of slices; entries after the last slice's end are not used.
pub(crate) type Ends = [f64; Partition::MAX_SLICES + 1];

/// The faces of a perspective view's frustum as seen from a light, in local space. A partition uses
/// those faces that together cover what the light sees of the frustum exactly once: its front faces
/// if the light comes from behind the viewer, otherwise its back faces (W&P §5.1). The near face is
/// among them in both cases.
///
/// A face serves a wedge around the line from the eye to the light, between the two planes through
/// that line and the face's side edges. Wedges extend to infinity, so that rounding at the
/// frustum's outline excludes no receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitFaces {
    /// Vectors from the eye through the frustum's corners, of depth 1: lower left, lower right,
    /// upper right, upper left. Face i lies between corners i and i + 1.
    rays: [DVec3; 4],
    light: DVec4,
    is_used: [bool; 4],
    /// Distance of the near face, if it has a map of its own.
    near: Option<f64>,
}

/// Sine of the angle between a face and the light below which the face is edge-on and serves
/// nothing.
const EDGE_ON: f64 = 1e-12;

/// The distance between eye and lamp, as a share of the near distance, below which the lamp counts
/// as being at the eye.
const AT_EYE: f64 = 1e-3;

impl LitFaces {
    pub(crate) fn new(camera: &Camera, projector: &Projector, with_near: bool) -> Self {
        let light = homogeneous(projector, camera);
        let rays = camera.edges().map(|edge| edge.direction);
        let towards = light.truncate();
        let along_view = camera.forward().dot(towards);
        let is_behind = along_view <= 0.0;
        let is_used = std::array::from_fn(|i| {
            let inwards = rays[(i + 1) % 4].cross(rays[i]).normalize();
            let inside = inwards.dot(towards) / towards.length();
            if is_behind { inside < -EDGE_ON } else { inside > EDGE_ON }
        });
        // The near face is used unless it is edge-on or a lamp stands in front of it.
        let over_near = along_view - camera.near() * light.w;
        let sees_near =
            if is_behind { over_near } else { -over_near } < -EDGE_ON * towards.length();
        let near = (with_near && sees_near).then(|| camera.near());
        Self { rays, light, is_used, near }
    }

    /// Appends the planes around the space that a face serves; `false` if the face serves nothing.
    pub(crate) fn cell(&self, face: Face, planes: &mut Vec<Plane>) -> bool {
        let Some(side) = self.side(face) else {
            // The near face serves the space in front of the near edges of all other faces used.
            let ends =
                self.used().filter_map(|i| self.near.and_then(|n| self.sides(i).plane_at(n)));
            planes.extend(ends.map(Plane::flipped));
            return self.near.is_some();
        };
        let i = face as usize;
        if !self.is_used[i] {
            return false;
        }
        let middle = side.middle();
        for (neighbour, ray) in [((i + 3) % 4, side.a), ((i + 1) % 4, side.b)] {
            // Where the neighbouring face serves nothing, this one extends to the outline and
            // beyond.
            let normal = ray.cross(self.light.truncate()).try_normalize();
            if let Some(normal) = normal.filter(|_| self.is_used[neighbour]) {
                let sign = normal.dot(middle).signum();
                planes.push(Plane { normal: normal * sign, offset: 0.0 });
            }
        }
        planes.extend(self.near.and_then(|n| side.plane_at(n)));
        true
    }

    /// The geometry of a side face; `None` for the near face.
    pub(crate) fn side(&self, face: Face) -> Option<Side> {
        (face != Face::Near).then(|| self.sides(face as usize))
    }

    fn sides(&self, i: usize) -> Side {
        Side { a: self.rays[i], b: self.rays[(i + 1) % 4], light: self.light }
    }

    fn used(&self) -> impl Iterator<Item = usize> + '_ {
        (0..4).filter(|&i| self.is_used[i])
    }
}

/// The light as a homogeneous local point. A lamp at the eye has no direction, and sees all faces
/// edge-on. It counts as a lamp behind the eye, which divides the view as well as any other.
fn homogeneous(projector: &Projector, camera: &Camera) -> DVec4 {
    let near = camera.near();
    match projector.direction_and_apex(camera.eye()) {
        (direction, None) => -direction.extend(0.0),
        (_, Some(apex)) if apex.length() < AT_EYE * near => (camera.forward() * -near).extend(1.0),
        (_, Some(apex)) => apex.extend(1.0),
    }
}

/// A side face of the view frustum, with the light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    /// Vectors from the eye along the face's two side edges, of depth 1.
    a: DVec3,
    b: DVec3,
    light: DVec4,
}

impl Side {
    /// Vector from the eye along the middle of the face, of depth 1.
    fn middle(&self) -> DVec3 {
        self.a.midpoint(self.b)
    }

    /// Vectors from the eye along the face's two side edges, of depth 1.
    pub(crate) fn edges(&self) -> [DVec3; 2] {
        [self.a, self.b]
    }

    /// The half-space beyond `depth` on the face, whose plane contains the face's line at this
    /// depth and the light. `None` if the light lies on that line.
    fn plane_at(&self, depth: f64) -> Option<Plane> {
        let on_line = self.a * depth;
        let to_light = self.light.truncate() - on_line * self.light.w;
        let normal = (self.b - self.a).cross(to_light).try_normalize()?;
        let sign = normal.dot(self.middle()).signum();
        Some(Plane::through(on_line, normal * sign))
    }

    /// View depth at which the beam through `p` meets the face; infinite if it does not.
    fn depth_of(&self, p: DVec3, camera: &Camera) -> f64 {
        let normal = self.a.cross(self.b);
        let towards = self.light.truncate() - p * self.light.w;
        let meets = p - towards * (normal.dot(p) / normal.dot(towards));
        let depth = camera.forward().dot(meets);
        // Beams that cross the line from the eye to the light meet the face at the eye.
        let is_before = depth > -1e-9 * p.length();
        if depth.is_finite() && is_before { depth.max(0.0) } else { f64::INFINITY }
    }
}

/// The direction along which slices follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Along {
    /// Slices along the view, between planes of constant view depth.
    View,
    /// Slices along a side face of the view frustum. A slice consists of the beams through its part
    /// of the face, and not of what lies between two view depths, so that no map needs to cover
    /// what lies behind another's part.
    Side(Side),
}

impl Along {
    /// The half-space beyond `depth`.
    pub(crate) fn plane_at(&self, depth: f64, camera: &Camera) -> Option<Plane> {
        match self {
            Self::View => Some(Plane { normal: camera.forward(), offset: -depth }),
            Self::Side(side) => side.plane_at(depth),
        }
    }

    /// The depth by which a local point is assigned to a slice, metres along the view.
    pub(crate) fn depth_of(&self, p: DVec3, camera: &Camera) -> f64 {
        match self {
            Self::View => camera.forward().dot(p),
            Self::Side(side) => side.depth_of(p, camera),
        }
    }
}

/// The ends of slices between `n` and `f`. `storage` gives the number of texels that a slice needs,
/// or any measure of it that grows with the slice.
pub(crate) fn split(
    partition: &Partition,
    [n, f]: [f64; 2],
    camera: &Camera,
    storage: impl FnMut(f64, f64) -> f64,
) -> Ends {
    let k = partition.slices as usize;
    let scale = Scale::of(camera);
    let even = |i: usize| n + (f - n) * (i as f64 / k as f64);
    let self_similar = |i: usize| match scale {
        Scale::Logarithmic => n * (f / n).powf(i as f64 / k as f64),
        Scale::Even => even(i),
    };
    let mut ends = [f; Partition::MAX_SLICES + 1];
    ends[0] = n;
    if partition.splits == Splits::Fitted {
        equalize(&mut ends[..=k], scale, storage);
        return ends;
    }
    for (i, end) in ends.iter_mut().enumerate().take(k).skip(1) {
        *end = match partition.splits {
            Splits::SelfSimilar | Splits::Fitted => self_similar(i),
            Splits::Practical(blend) => even(i) + (self_similar(i) - even(i)) * blend,
            Splits::At(distances) => distances[i - 1],
        };
    }
    ends
}

/// The scale on which slices of equal length have the same shape, and so need equally many texels
/// where receivers fill the view.
#[derive(Clone, Copy, Debug)]
enum Scale {
    /// That of perspective views: the picture grows with depth.
    Logarithmic,
    /// That of orthographic views.
    Even,
}

impl Scale {
    fn of(camera: &Camera) -> Self {
        if camera.is_orthographic() { Self::Even } else { Self::Logarithmic }
    }

    fn position(self, depth: f64) -> f64 {
        match self {
            Self::Logarithmic => depth.ln(),
            Self::Even => depth,
        }
    }

    fn depth(self, position: f64) -> f64 {
        match self {
            Self::Logarithmic => position.exp(),
            Self::Even => position,
        }
    }
}

/// The ratio of the largest storage of a fitted slice to the least from which one more step makes
/// them alike.
const NEARLY_ALIKE: f64 = 1.03;

/// The share of the best ratio so far that a useful round attains at most. The search ends after
/// three rounds that are of no use.
const USEFUL: f64 = 0.97;

/// The largest number of times that all slices are tried.
const MOST_ROUNDS: usize = 16;

/// The largest number of ends between slices.
const MOST_ENDS: usize = Partition::MAX_SLICES - 1;

/// Moves all but the first and the last end so that all slices need similar storage.
///
/// The unknowns are the positions of the ends on the scale, and what shall vanish are the
/// differences between the logarithms of neighbouring storages. They are found by Broyden's method
/// (1965). Storage can jump where a slice reaches a receiver, and then no ends may be right; of all
/// ends tried, those whose storages differ least are taken.
fn equalize(ends: &mut [f64], scale: Scale, mut storage: impl FnMut(f64, f64) -> f64) {
    let k = ends.len() - 1;
    let [n, f] = [ends[0], ends[k]];
    if k == 1 || f <= n {
        return;
    }
    let unknowns = k - 1;
    let first = scale.position(n);
    let whole = scale.position(f) - first;
    let mut at: [f64; MOST_ENDS] =
        std::array::from_fn(|i| first + whole * (i + 1) as f64 / k as f64);
    let mut jacobian = model(scale, whole / k as f64, unknowns);
    let mut best = (f64::INFINITY, at);
    let mut useless = 0;
    let mut last: Option<[[f64; MOST_ENDS]; 2]> = None;
    for _ in 0..MOST_ROUNDS {
        set_ends(ends, scale, &at);
        let mut needed = [0.0; Partition::MAX_SLICES];
        for (i, needed) in needed.iter_mut().enumerate().take(k) {
            *needed = storage(ends[i], ends[i + 1]);
        }
        let (least, most) = range(needed[..k].iter().copied());
        let ratio = most / least;
        useless = if ratio < USEFUL * best.0 { 0 } else { useless + 1 };
        if ratio < best.0 || best.0.is_infinite() {
            best = (ratio, at);
        }
        if most == 0.0 || useless == 3 {
            break;
        }
        // An empty slice counts as one that needs next to nothing.
        let logarithm = |i: usize| needed[i].max(1e-2 * most).ln();
        let difference: [f64; MOST_ENDS] =
            std::array::from_fn(
                |i| {
                    if i < unknowns { logarithm(i) - logarithm(i + 1) } else { 0.0 }
                },
            );
        if let Some([last_at, last_difference]) = last {
            // The Jacobian is changed along the last step alone, so that it explains this step.
            let step: [f64; MOST_ENDS] = std::array::from_fn(|j| at[j] - last_at[j]);
            let length: f64 = step[..unknowns].iter().map(|s| s * s).sum();
            for (i, row) in jacobian.iter_mut().enumerate().take(unknowns) {
                let explained: f64 = (0..unknowns).map(|j| row[j] * step[j]).sum();
                let rest = (difference[i] - last_difference[i] - explained) / length;
                (0..unknowns).for_each(|j| row[j] += rest * step[j]);
            }
        }
        last = Some([at, difference]);
        let step = solve(jacobian, difference, unknowns);
        // No slice gives more than half of its length away in one step.
        let mut share = 1f64;
        for i in 0..k {
            let moves = |j: usize| if (1..k).contains(&j) { step[j - 1] } else { 0.0 };
            let shorter = moves(i) - moves(i + 1);
            let length = scale.position(ends[i + 1]) - scale.position(ends[i]);
            if -shorter > 0.5 * length {
                share = share.min(0.5 * length / -shorter);
            }
        }
        (0..unknowns).for_each(|i| at[i] -= share * step[i]);
        if ratio <= NEARLY_ALIKE || !at.iter().all(|x| x.is_finite()) {
            break;
        }
    }
    // The last step, from slices that are nearly alike, is not tried. It also keeps slices from
    // jumping where the number of rounds changes.
    let is_sound = best.0 <= NEARLY_ALIKE && at.iter().all(|x| x.is_finite());
    set_ends(ends, scale, if is_sound { &at } else { &best.1 });
}

/// Sets all but the first and the last end from their positions on the scale.
fn set_ends(ends: &mut [f64], scale: Scale, positions: &[f64]) {
    let k = ends.len() - 1;
    for i in 1..k {
        ends[i] = scale.depth(positions[i - 1]).clamp(ends[i - 1], ends[k]);
    }
}

/// The derivatives of the differences between the logarithms of neighbouring storages, with respect
/// to the positions of the ends. They are those of slices of length x on the scale: where receivers
/// fill a perspective view, the storage of an even map grows as e²ˣ − eˣ, and that of a warped one
/// more slowly. In an orthographic view it grows as x.
fn model(scale: Scale, x: f64, unknowns: usize) -> [[f64; MOST_ENDS]; MOST_ENDS] {
    let growth = match scale {
        Scale::Logarithmic => 0.5 * (2.0 + 1.0 / x.exp_m1() + 1.0 / x),
        Scale::Even => 1.0 / x,
    };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match i.abs_diff(j) {
            0 => 2.0 * growth,
            1 if i.max(j) < unknowns => -growth,
            _ => 0.0,
        })
    })
}

/// The solution of a system of linear equations, by elimination with pivots.
fn solve(
    mut matrix: [[f64; MOST_ENDS]; MOST_ENDS],
    mut right: [f64; MOST_ENDS],
    unknowns: usize,
) -> [f64; MOST_ENDS] {
    for column in 0..unknowns {
        let largest =
            |&i: &usize, &j: &usize| matrix[i][column].abs().total_cmp(&matrix[j][column].abs());
        let pivot = (column..unknowns).max_by(largest).unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let pivot = matrix[column];
        for row in column + 1..unknowns {
            let factor = matrix[row][column] / pivot[column];
            matrix[row].iter_mut().zip(pivot).for_each(|(to, from)| *to -= factor * from);
            right[row] -= factor * right[column];
        }
    }
    for row in (0..unknowns).rev() {
        let known: f64 = (row + 1..unknowns).map(|j| matrix[row][j] * right[j]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}
