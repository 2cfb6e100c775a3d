//! The largest errors of a map over a body, to a known tolerance.
//!
//! Let A be the footprint (metres per texel), w the projection's fourth coordinate and z the scale
//! of the view, which is its depth, or constant in orthographic views. Then A = w·B. Under parallel
//! light B is affine in the point; under a spot light B = (r × K)/|r|, where r is the vector from
//! the light to the point and r × K is affine. On a simplex, therefore,
//!
//! - w/z, and under spot lights w/(r·m) with a fixed unit vector m, are ratios of linear functions
//!   and largest at corners;
//! - ‖B‖ under parallel light and ‖r × K‖/z under spot lights are convex or quasi-convex
//!   and largest at corners;
//!
//! and products of maxima over the corners bound the error. A simplex whose bound exceeds the
//! largest error found by more than the tolerance is halved.
//!
//! The largest error lies on a face of the body, because along a beam errors are proportional to
//! 1/z or to |r|/z. For parallel light and a one-point perspective it lies on an edge: within a
//! plane of constant w the error is quasi-convex, so it is largest at the border.

use crate::aliasing::Local;
use crate::camera::Camera;
use crate::focus::Body;
use crate::math::Keyed;
use crate::plan::{MapError, Rows, ShadowMap, Slab};
use crate::warp::{Seen, Shape};
use glam::DVec3;
use std::collections::BinaryHeap;
use std::ops::Range;

/// The share by which the reported maximum may exceed the true one.
const TOLERANCE: f64 = 0.01;
/// Number of halvings after which the remaining bounds are reported as they are, if they are
/// finite. Parallel light needs dozens. Half of all maps under lamps reach this number, and ten
/// times as many halvings would lower the bounds by some per cent.
const MAX_SPLITS: usize = 100;
/// Number of halvings after which bounds are reported even if they are infinite. A simplex has no
/// bound where the light sees its corners in opposite directions, which few halvings end.
const MAX_UNBOUNDED_SPLITS: usize = 200 * MAX_SPLITS;

/// The errors and their factors at a corner of a simplex.
#[derive(Clone, Copy, Debug)]
struct Corner {
    p: DVec3,
    /// Errors in s, in t and in the worst direction, metres per texel over the scale of the view.
    errors: [f64; 3],
    /// Distance from the light; 1 for parallel light.
    r: f64,
    w: f64,
    z: f64,
    /// Direction in which a texel's height is measured, of any length.
    normal_t: DVec3,
    /// Factor by which logarithmic rows change a texel's size in t here; 1 for even rows.
    row_scale: f64,
}

#[derive(Clone, Copy, Debug)]
struct Simplex {
    /// Indices of corners. On an edge the third one repeats the second.
    corners: [u32; 3],
    /// Upper bounds of the errors.
    bound: [f64; 3],
}

/// Buffers kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buffers {
    corners: Vec<Corner>,
    /// Simplices whose bound exceeds the largest error found by more than the tolerance.
    /// Their keys are the largest ratios of a bound to the largest error found when the bounds were
    /// computed.
    open: BinaryHeap<Keyed<Simplex>>,
    points: Vec<Point>,
    /// Parts of a cell's edges that may hold the largest error.
    segments: Vec<[Point; 2]>,
}

/// A point of a body as a one-point map under parallel light sees it.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// Distance of light-space x from the axis of the perspective.
    off_axis: f64,
    w: f64,
    z: f64,
    w_over_z: f64,
    /// Error in the worst direction, metres per texel over the scale of the view.
    error: f64,
}

/// The largest errors in s and in t of `map` over `body` (local space), pixels per texel: never
/// less than the true maxima, at most one per cent more under parallel light, and some per cent
/// more under lamps.
pub(crate) fn worst_in_s_and_t(
    map: &ShadowMap,
    body: &Body,
    camera: &Camera,
    buffers: &mut Buffers,
) -> [f64; 2] {
    let [s, t, _] = search(&Probe { map, camera, of: 0..2 }, body, buffers);
    [s, t]
}

/// The largest error in the worst direction, as [`worst_in_s_and_t`].
pub(crate) fn worst_direction(
    map: &ShadowMap,
    body: &Body,
    camera: &Camera,
    buffers: &mut Buffers,
) -> f64 {
    search(&Probe { map, camera, of: 2..3 }, body, buffers)[2]
}

/// Upper bounds of the errors that the probe is for; the others are not defined.
fn search(probe: &Probe<'_>, body: &Body, buffers: &mut Buffers) -> [f64; 3] {
    let Buffers { corners, open, .. } = buffers;
    corners.clear();
    corners.extend(body.vertices().iter().filter_map(|&v| probe.corner(v)));
    open.clear();
    let best = corners.iter().fold([0f64; 3], |best, c| larger(best, c.errors));
    let mut search = Search { probe, corners, open, best, settled: best };
    // If a body is smaller than the rounding of its position, the map may not apply at its corners.
    if search.corners.len() == body.vertices().len() {
        let edges_suffice = probe.edges_suffice();
        for cell in body.cells() {
            // The bounds hold for the convex hull of any number of corners.
            let whole = probe.bound(&search.corners[cell.vertices()]);
            if (0..3).all(|i| whole[i] <= search.best[i]) {
                continue;
            }
            if edges_suffice {
                cell.edges().for_each(|[a, b]| search.add([a, b, b].map(|i| i as u32)));
            } else {
                cell.triangles().for_each(|t| search.add(t.map(|i| i as u32)));
            }
        }
        for splits in 0..MAX_UNBOUNDED_SPLITS {
            let Some(Keyed { key, value: most_urgent }) = search.open.pop() else { break };
            if splits >= MAX_SPLITS && key.is_finite() {
                search.settled = larger(search.settled, most_urgent.bound);
                break;
            }
            // `best` may have increased since the simplex was pushed.
            if !search.settle(most_urgent.bound) {
                search.split(&most_urgent);
            }
        }
    }
    // Simplices that are still open count with their bounds.
    let bounds = search.open.iter().fold(search.settled, |bounds, s| larger(bounds, s.value.bound));
    let pixel = probe.camera.pixel_width_per_scale();
    larger(search.best, bounds).map(|e| e / pixel)
}

/// The largest errors of a one-point map under parallel light, given by its shape, over a body
/// whose vertices are at `seen` in light space. As those of [`worst_in_s_and_t`] and
/// [`worst_direction`], which take longer.
///
/// m_s = w/z and m_t = w²/z, up to factors, are largest at vertices. The error in the worst
/// direction is w/z times the norm of a matrix that is affine in x and z. Both factors are largest
/// at vertices, and their product on an edge.
pub(crate) fn worst_of_shape(
    shape: &Shape,
    resolution: [u32; 2],
    body: &Body,
    seen: &[Seen],
    camera: &Camera,
    buffers: &mut Buffers,
) -> MapError {
    let resolution = resolution.map(f64::from);
    let Buffers { points, segments, .. } = buffers;
    let mut most = [0f64; 2];
    points.clear();
    points.extend(seen.iter().map(|p| {
        let w = shape.w(p.xz.y);
        let w_over_z = w / p.scale;
        most = [most[0].max(w_over_z), most[1].max(w_over_z * w)];
        Point { off_axis: shape.off_axis(p.xz.x), w, z: p.scale, w_over_z, error: 0.0 }
    }));
    let norm = |w: f64, off_axis: f64| shape.texel_over_w(w, off_axis, resolution).longest();
    let texel = shape.texel_over_w(1.0, 0.0, resolution);
    let pixel = camera.pixel_width_per_scale();
    let [max_s, max_t] = [most[0] * texel.base / pixel, most[1] * texel.height / pixel];
    let error = |max: f64| MapError::new([max_s, max_t], max / pixel);
    if shape.is_even() {
        return error(most[0] * norm(1.0, 0.0));
    }
    let mut best = 0f64;
    for p in &mut *points {
        p.error = p.w_over_z * norm(p.w, p.off_axis);
        best = best.max(p.error);
    }
    let mut settled = best;
    let mut splits = MAX_SPLITS;
    for cell in body.cells() {
        let corners = &points[cell.vertices()];
        let most = |of: &dyn Fn(&Point) -> f64| corners.iter().map(of).fold(0.0, f64::max);
        let bound = most(&|p| p.w_over_z) * norm(most(&|p| p.w), most(&|p| p.off_axis.abs()));
        if bound <= best {
            continue;
        }
        segments.clear();
        segments.extend(cell.edges().map(|ends| ends.map(|i| points[i])));
        while let Some([a, b]) = segments.pop() {
            let bound = edge_bound(&a, &b);
            if bound <= best * (1.0 + TOLERANCE) || splits == 0 {
                settled = settled.max(bound);
                continue;
            }
            splits -= 1;
            // Halving at the middle of 1/z gives both halves similar ranges of z.
            let [of_a, of_b] = [b.z, a.z].map(|z| z / (a.z + b.z));
            let [off_axis, w, z] = [(a.off_axis, b.off_axis), (a.w, b.w), (a.z, b.z)]
                .map(|(a, b)| a * of_a + b * of_b);
            let mut middle = Point { off_axis, w, z, w_over_z: w / z, error: 0.0 };
            middle.error = middle.w_over_z * norm(w, off_axis);
            best = best.max(middle.error);
            segments.extend([[a, middle], [middle, b]]);
        }
    }
    error(settled.max(best))
}

/// Upper bound of the error in the worst direction between two points.
///
/// The error is w g/z, where w and z are linear from one point to the other, and the norm g is
/// convex. So g is at most what is linear between its values at the ends, and the bound is the
/// maximum of a quadratic function over a linear one.
fn edge_bound(a: &Point, b: &Point) -> f64 {
    let [g_a, g_b] = [a, b].map(|p| p.error / p.w_over_z);
    let ends = a.error.max(b.error);
    let (dw, dg, dz) = (b.w - a.w, g_b - g_a, b.z - a.z);
    let numerator = [a.w * g_a, a.w * dg + dw * g_a, dw * dg];
    // The sign of the second derivative is the same everywhere.
    let curvature = numerator[2] * a.z * a.z - numerator[1] * a.z * dz + numerator[0] * dz * dz;
    if curvature >= 0.0 {
        return ends;
    }
    // The numerator of the derivative is c + 2 h x + k x², where x is the share of the way.
    let c = numerator[1] * a.z - numerator[0] * dz;
    let [h, k] = [numerator[2] * a.z, numerator[2] * dz];
    let root = (h * h - k * c).max(0.0).sqrt();
    // Both forms of the solutions, of which one is exact where the other divides by almost 0.
    let solutions = [(-h + root) / k, (-h - root) / k, c / (-h + root), c / (-h - root)];
    let at = |x: f64| {
        let value = (a.w + dw * x) * (g_a + dg * x) / (a.z + dz * x);
        if (0.0..=1.0).contains(&x) { value } else { 0.0 }
    };
    solutions.into_iter().map(at).fold(ends, f64::max)
}

fn larger(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i].max(b[i]))
}

struct Search<'a> {
    probe: &'a Probe<'a>,
    corners: &'a mut Vec<Corner>,
    open: &'a mut BinaryHeap<Keyed<Simplex>>,
    /// The largest errors found.
    best: [f64; 3],
    /// Bounds of the simplices put aside, which exceed `best` by the tolerance at most.
    settled: [f64; 3],
}

impl Search<'_> {
    fn add(&mut self, corners: [u32; 3]) {
        let is_edge = corners[1] == corners[2];
        let [a, b, c] = corners.map(|i| self.corners[i as usize]);
        let mut bound = self.probe.bound(&[a, b, c]);
        if is_edge {
            // B's first column is constant and w²/z is convex, so m_s and m_t are largest at the
            // corners. With logarithmic rows A itself is affine, and all errors are largest at the
            // corners.
            let exact = if self.probe.map.rows == Rows::Even { 2 } else { 3 };
            let ends = larger(a.errors, b.errors);
            self.probe.of.clone().filter(|&i| i < exact).for_each(|i| bound[i] = ends[i]);
        }
        if !self.settle(bound) {
            let urgency =
                [0, 1, 2].map(|i| bound[i] / self.best[i]).into_iter().fold(0.0, f64::max);
            self.open.push(Keyed { key: urgency, value: Simplex { corners, bound } });
        }
    }

    /// Puts a simplex aside if its bounds are within the tolerance.
    fn settle(&mut self, bound: [f64; 3]) -> bool {
        let settles = (0..3).all(|i| bound[i] <= self.best[i] * (1.0 + TOLERANCE));
        if settles {
            self.settled = larger(self.settled, bound);
        }
        settles
    }

    /// Halves a simplex across its longest side.
    fn split(&mut self, simplex: &Simplex) {
        let [a, b, c] = simplex.corners;
        let is_edge = b == c;
        // Lengths count relative to view depth, because distant parts matter less.
        let length = |&(u, v, _): &(u32, u32, u32)| {
            let [u, v] = [u, v].map(|i| &self.corners[i as usize]);
            u.p.distance_squared(v.p) / (u.z * v.z)
        };
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let longest = sides.into_iter().max_by(|p, q| length(p).total_cmp(&length(q)));
        let (u, v, rest) = if is_edge { sides[0] } else { longest.unwrap_or(sides[0]) };
        // Halving at the middle of 1/z gives both halves similar ranges of z.
        let [p, q] = [u, v].map(|i| &self.corners[i as usize]);
        let Some(middle) = self.probe.corner(p.p.lerp(q.p, p.z / (p.z + q.z))) else { return };
        self.best = larger(self.best, middle.errors);
        let m = self.corners.len() as u32;
        self.corners.push(middle);
        for (p, q) in [(u, m), (m, v)] {
            self.add([p, q, if is_edge { q } else { rest }]);
        }
    }
}

/// Computes errors at points and their bounds over simplices.
struct Probe<'a> {
    map: &'a ShadowMap,
    camera: &'a Camera,
    /// Of the errors in s, in t and in the worst direction, those that are bounded.
    of: Range<usize>,
}

impl Probe<'_> {
    fn corner(&self, p: DVec3) -> Option<Corner> {
        let local = Local::at(self.map, p)?;
        let footprint = local.footprint();
        let z = self.camera.scale_of(p);
        Some(Corner {
            p,
            errors: [footprint.base(), footprint.height(), footprint.longest()].map(|e| e / z),
            r: self.map.apex.map_or(1.0, |apex| p.distance(apex)),
            w: local.w,
            z,
            normal_t: local.grad_t * local.w,
            row_scale: local.row_derivative.recip(),
        })
    }

    /// Whether the largest errors lie on edges, which is so for parallel light and a warp along one
    /// axis.
    fn edges_suffice(&self) -> bool {
        let [t, w] = [1, 3].map(|i| self.map.shadow_from_local.row(i).truncate());
        self.map.apex.is_none() && t.cross(w).length() <= 1e-9 * t.length() * w.length()
    }

    /// The axis of the map's light, if it is a lamp.
    fn axis(&self) -> Option<DVec3> {
        match self.map.slab {
            Slab::Distances { axis, .. } => Some(axis),
            Slab::Leaning { .. } => None,
        }
    }

    /// `mean`, if its dot product with the corners' vectors is positive at all corners, or else
    /// `other`, which is less close to them.
    fn towards_all(
        mean: DVec3,
        corners: &[Corner],
        vector: &dyn Fn(&Corner) -> DVec3,
        other: impl FnOnce() -> DVec3,
    ) -> DVec3 {
        let is_good = corners.iter().all(|c| vector(c).dot(mean) > 0.0);
        if is_good { mean } else { other() }
    }

    /// Upper bounds over the convex hull of some corners of the errors in s, in t and in the worst
    /// direction; 0 for those that are not asked for.
    fn bound(&self, corners: &[Corner]) -> [f64; 3] {
        let max = |f: &dyn Fn(&Corner) -> f64| corners.iter().map(f).fold(0.0, f64::max);
        let w_over_z = max(&|c| c.w / c.z);
        // m_t = w²/|N|, where N = w² ∇t is affine. |N| is at least its component along any
        // fixed direction, and the ratio of w to that component is again largest at a corner. (With
        // logarithmic rows this ratio has light space's own w as a further factor.)
        let mean = corners.iter().map(|c| c.normal_t).sum::<DVec3>().normalize_or_zero();
        let normal = Self::towards_all(mean, corners, &|c| c.normal_t, || {
            // N = w ∇T − T ∇w, where t = T/w. So N · n = w |∇T × ∇w|²/|∇w|² > 0 for the part n of
            // ∇T across ∇w.
            let [t, w] = [1, 3].map(|i| self.map.shadow_from_local.row(i).truncate());
            let w = w.normalize_or_zero();
            (t - w * w.dot(t)).normalize_or_zero()
        });
        let t = || {
            w_over_z
                * max(&|c| {
                    let cos = c.normal_t.dot(normal) / c.normal_t.length();
                    if cos > 0.0 { c.errors[1] * c.z / c.w / cos } else { f64::INFINITY }
                })
        };
        // Logarithmic rows scale B's second column. Within the simplex the scale varies by this
        // factor at most.
        let spread = || max(&|c| c.row_scale) * max(&|c| c.row_scale.recip());
        let norm = |i: usize| match self.map.apex {
            None => {
                let affine = max(&|c| c.errors[i] * c.z / c.w);
                let over_z = max(&|c| c.errors[i] / c.w);
                (w_over_z * affine).min(max(&|c| c.w) * over_z)
            }
            Some(apex) => {
                // ‖A‖/z = w ‖r × K‖/(|r| z), and |r| is at least its component along a
                // fixed direction. The bound may combine that component with w or with ‖r ×
                // K‖.
                let mean = corners.iter().map(|c| c.p - apex).sum::<DVec3>().normalize_or_zero();
                let middle = Self::towards_all(mean, corners, &|c| c.p - apex, || {
                    self.axis().unwrap_or(mean)
                });
                let per_share = |value: &dyn Fn(&Corner) -> f64| {
                    max(&|c| {
                        let share = (c.p - apex).dot(middle);
                        if share > 0.0 { value(c) / share } else { f64::INFINITY }
                    })
                };
                let with_w = per_share(&|c| c.w) * max(&|c| c.errors[i] * c.r / c.w);
                let with_norm = w_over_z * per_share(&|c| c.errors[i] * c.z * c.r / c.w);
                with_w.min(with_norm)
            }
        };
        [0, 1, 2].map(|i| match i {
            _ if !self.of.contains(&i) => 0.0,
            0 => norm(0),
            1 => t(),
            _ => norm(2) * spread(),
        })
    }
}
