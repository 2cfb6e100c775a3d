//! Which part of the view each map serves (Lloyd et al. 2006, §5).

use crate::bounds::Plane;
use crate::camera::Camera;
use crate::light::Projector;
use crate::plan::Face;
use crate::technique::{Partition, Splits};
use glam::{DVec3, DVec4};

/// The ends of slices; entries after the last slice's end are not used.
pub(crate) type Ends = [f64; Partition::MAX_SLICES + 1];

/// The view frustum's faces as seen from a light, in local space. A partition uses those faces that
/// together cover what the light sees of the frustum exactly once: its front faces if the light
/// comes from behind the viewer, otherwise its back faces (W&P §5.1). The near face is among them
/// in both cases.
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

impl LitFaces {
    pub(crate) fn new(camera: &Camera, projector: &Projector, with_near: bool) -> Self {
        let light = homogeneous(projector, camera);
        let rays = camera.corners_at(1.0);
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

/// The light as a homogeneous local point.
fn homogeneous(projector: &Projector, camera: &Camera) -> DVec4 {
    match projector.direction_and_apex(camera.eye()) {
        (direction, None) => -direction.extend(0.0),
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
    storage: impl FnMut(f64, f64) -> f64,
) -> Ends {
    let k = partition.slices as usize;
    let self_similar = |i: usize| n * (f / n).powf(i as f64 / k as f64);
    let even = |i: usize| n + (f - n) * (i as f64 / k as f64);
    let mut ends = [f; Partition::MAX_SLICES + 1];
    ends[0] = n;
    if partition.splits == Splits::Fitted {
        equalize(&mut ends[..=k], storage);
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

/// The ratio of the largest storage of a fitted slice to the least with which the search ends.
const ALIKE: f64 = 1.09;

/// The share of the best ratio so far that a useful round attains at most. The search ends after two
/// rounds that are of no use.
const USEFUL: f64 = 0.95;

/// The largest number of times that all slices are tried.
const MOST_ROUNDS: usize = 6;

/// Moves all but the first and the last end so that all slices need similar storage.
///
/// Let x be the logarithm of a slice's range, its far end over its near end. Where receivers fill
/// the view, the storage of an even map grows as e²ˣ − eˣ, and that of others more slowly. In each
/// round every slice's ln x is a secant away from the storage that all would share. Storage can jump
/// where a slice reaches a receiver, and then no ends may be right; of all ends tried, those whose
/// storages differ least are taken.
fn equalize(ends: &mut [f64], mut storage: impl FnMut(f64, f64) -> f64) {
    let k = ends.len() - 1;
    let [n, f] = [ends[0], ends[k]];
    if k == 1 || f <= n {
        return;
    }
    let whole = (f / n).ln();
    let mut lengths = [whole / k as f64; Partition::MAX_SLICES];
    let mut best = (f64::INFINITY, Ends::default());
    let mut useless = 0;
    // Lengths and storages of the last round, as logarithms.
    let mut last: Option<[[f64; 2]; Partition::MAX_SLICES]> = None;
    for _ in 0..MOST_ROUNDS {
        for i in 1..k {
            ends[i] = (ends[i - 1] * lengths[i - 1].exp()).min(f);
        }
        let mut tried = [[0.0; 2]; Partition::MAX_SLICES];
        let mut extremes = (f64::INFINITY, 0f64);
        for (i, slice) in tried.iter_mut().enumerate().take(k) {
            let needed = storage(ends[i], ends[i + 1]);
            extremes = (extremes.0.min(needed), extremes.1.max(needed));
            *slice = [lengths[i].ln(), needed];
        }
        let ratio = extremes.1 / extremes.0;
        useless = if ratio < USEFUL * best.0 { 0 } else { useless + 1 };
        if ratio < best.0 || best.0.is_infinite() {
            best.0 = ratio;
            best.1[..=k].copy_from_slice(ends);
        }
        if ratio <= ALIKE || extremes.1 == 0.0 || useless == 2 {
            break;
        }
        // An empty slice counts as one that needs next to nothing.
        let least = 1e-2 * extremes.1;
        tried.iter_mut().take(k).for_each(|slice| slice[1] = slice[1].max(least).ln());
        // d ln(storage)/d ln(length) of each slice.
        let mut growth = [0.0; Partition::MAX_SLICES];
        for i in 0..k {
            let even = lengths[i] * (2.0 + 1.0 / lengths[i].exp_m1());
            growth[i] = 0.5 * (1.0 + even);
            if let Some(last) = last {
                let [dx, ds] = [0, 1].map(|j| tried[i][j] - last[i][j]);
                if dx.abs() > 1e-3 {
                    growth[i] = (ds / dx).clamp(0.5, 2.0 * even);
                }
            }
        }
        // The shared storage is the one at which the lengths add up.
        let total = |level: f64| -> f64 {
            (0..k).map(|i| (tried[i][0] + step(level - tried[i][1], growth[i])).exp()).sum()
        };
        let (mut lo, mut hi) = (least.ln(), extremes.1.ln());
        for _ in 0..30 {
            let middle = lo.midpoint(hi);
            if total(middle) < whole { lo = middle } else { hi = middle }
        }
        let level = lo.midpoint(hi);
        for i in 0..k {
            lengths[i] = (tried[i][0] + step(level - tried[i][1], growth[i])).exp();
        }
        last = Some(tried);
    }
    ends[..k].copy_from_slice(&best.1[..k]);
}

/// The change of a slice's ln length for a change of its ln storage.
fn step(change: f64, growth: f64) -> f64 {
    (change / growth).clamp(-1.5, 1.5)
}
