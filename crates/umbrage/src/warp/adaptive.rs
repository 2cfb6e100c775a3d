use super::{OnePoint, Seen, View};
use crate::technique::Objective;

/// The largest number of points that a search looks at one by one.
const FEW: usize = 40;

/// Number of ranges of view depth that stand for more points than [`FEW`].
const RANGES: usize = 32;

/// The largest number of steps after the coarse scan.
const MOST_STEPS: usize = 40;

/// How precisely a strength is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// As precisely as matters to the errors of a map.
    Final,
    /// Only to compare the storage of slices.
    Trial,
}

impl Precision {
    /// The search ends where ω is known to this.
    fn tolerance(self) -> f64 {
        match self {
            Self::Final => 1e-7,
            Self::Trial => 1e-3,
        }
    }

    /// The search also ends where the logarithm of the cost varies by this alone.
    fn flatness(self) -> f64 {
        match self {
            Self::Final => 1e-13,
            Self::Trial => 1e-4,
        }
    }
}

/// Finds the strength of least error. The buffer is kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    front: Vec<Front>,
}

/// A point where errors may be largest, or several at once: the largest values of each.
#[derive(Clone, Copy, Debug)]
struct Front {
    z: f64,
    base: f64,
    height: f64,
}

impl Front {
    const NOTHING: Self = Self { z: f64::NEG_INFINITY, base: 0.0, height: 0.0 };

    fn of(p: &Seen) -> Self {
        Self { z: p.xz.y, base: p.base, height: p.height }
    }

    /// Whether no strength has a larger error at `other` than here.
    fn dominates(&self, other: &Self) -> bool {
        self.z >= other.z && self.base >= other.base && self.height >= other.height
    }
}

impl Search {
    /// The strength ν = μ/λ of least error over the points seen, times `fade`, or 0 if the error is
    /// no larger without a warp.
    ///
    /// Let w_j = 1 + ν ζ_j at vertex j, where ζ_j ∈ [0, 1] is its position between near and far
    /// plane and d_j its view distance. The largest errors over the body are those at its vertices:
    /// m_s is a ratio of linear functions, and m_t a square of a linear function over another,
    /// which is convex. In ω = ln(1 + ν) the logarithm of the largest m_t is convex too (each ln
    /// w_j is a log-sum-exp), and m_s adds little that is not. For a view as a whole the sum has
    /// one minimum, but for thin strips it can have two. A coarse scan brackets the lowest one, and
    /// golden section search refines it.
    pub(crate) fn least_error(
        &mut self,
        family: &OnePoint,
        view: &View<'_>,
        objective: Objective,
        precision: Precision,
        fade: f64,
    ) -> f64 {
        let (tolerance, flatness) = (precision.tolerance(), precision.flatness());
        self.set_front(family, view.seen);
        let front = &self.front;
        let cost = |omega: f64| {
            let nu = omega.exp_m1();
            Cost::of(family, nu, view, objective, front.iter().copied())
        };
        // For warps stronger than the view's own perspective every error grows.
        let end = (family.farthest / family.nearest).ln() + 1.0;
        const STEPS: usize = 8;
        let scan: [Cost; STEPS + 1] =
            std::array::from_fn(|i| cost(end * (i as f64) / STEPS as f64));
        let best = scan.iter().enumerate().min_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let best = best.map_or(0, |(i, _)| i);
        let [mut lo, mut hi] = [best.saturating_sub(1), (best + 1).min(STEPS)]
            .map(|i| (end * (i as f64) / STEPS as f64, scan[i].value.ln(), scan[i].slope));
        // The middle of the bracket is known.
        let mut at = end * (best as f64) / STEPS as f64;
        let mut found = scan[best];
        let jump = hi.2 - lo.2;
        let mut last_was_low = None;
        let mut reach = 0.5 * tolerance;
        for _ in 0..MOST_STEPS {
            let is_low = found.slope < 0.0;
            let end = if is_low { &mut lo } else { &mut hi };
            *end = (at, found.value.ln(), found.slope);
            let width = hi.0 - lo.0;
            let steepest = hi.2.abs().max(lo.2.abs());
            if width <= tolerance || steepest * width <= flatness {
                break;
            }
            // The minimum of a convex function lies near the point where the tangents at both ends
            // of the bracket meet: at it, if the function has a kink there. If the same end has
            // moved twice, the other's tangent is not to be trusted, so the next point is a little
            // farther from the end that moved, and farther each time.
            let meet = (hi.1 - lo.1 + lo.2 * lo.0 - hi.2 * hi.0) / (lo.2 - hi.2);
            let is_again = last_was_low == Some(is_low);
            last_was_low = Some(is_low);
            reach = if is_again { 8.0 * reach } else { 0.5 * tolerance };
            let further = if is_again { 4.0 } else { 1.0 };
            // Where the slopes approach each other there is no kink, and the minimum is a root of
            // the slope.
            let is_smooth = hi.2 - lo.2 < 0.25 * jump;
            let meet = if is_smooth { lo.0 - lo.2 * width / (hi.2 - lo.2) } else { meet };
            let next = match is_low {
                true => lo.0 + (further * (meet - lo.0)).max(reach),
                false => hi.0 - (further * (hi.0 - meet)).max(reach),
            };
            let is_inside = next > lo.0 && next < hi.0;
            at = if is_inside { next } else { lo.0.midpoint(hi.0) };
            found = cost(at);
        }
        let omega = if lo.1 <= hi.1 { lo.0 } else { hi.0 };
        let nu = omega.exp_m1() * fade;
        // The minimum may be at the bracket's lower end: no warp. The front may stand for points
        // that do not exist, and between no warp and the best strength errors can be larger than
        // at both. So the points themselves decide.
        let exact =
            |nu: f64| Cost::of(family, nu, view, objective, view.seen.iter().map(Front::of)).value;
        if exact(0.0) <= exact(nu) { 0.0 } else { nu }
    }

    /// Sets the points where errors may be largest. Of many points, those of a similar scale
    /// of the view, hence of similar view depth, count as one.
    fn set_front(&mut self, family: &OnePoint, seen: &[Seen]) {
        self.front.clear();
        if seen.len() <= FEW {
            seen.iter().for_each(|p| self.add(Front::of(p)));
            return;
        }
        let mut ranges = [Front::NOTHING; RANGES];
        // The bits of a positive number grow with its logarithm, near enough.
        let [first, last] = [family.nearest, family.farthest].map(f64::to_bits);
        let per_bit = (RANGES as f64 - 0.5) / (last - first).max(1) as f64;
        for p in seen {
            let index = (p.scale.to_bits() - first) as f64 * per_bit;
            let range = &mut ranges[(index as usize).min(RANGES - 1)];
            range.z = range.z.max(p.xz.y);
            range.base = range.base.max(p.base);
            range.height = range.height.max(p.height);
        }
        ranges.into_iter().filter(|r| r.base > 0.0).for_each(|r| self.add(r));
    }

    fn add(&mut self, point: Front) {
        if !self.front.iter().any(|p| p.dominates(&point)) {
            self.front.retain(|p| !point.dominates(p));
            self.front.push(point);
        }
    }
}

/// The quantity to minimise, and the derivative of its logarithm with respect to ω = ln(1 + ν).
#[derive(Clone, Copy, Debug)]
struct Cost {
    value: f64,
    slope: f64,
}

impl Cost {
    fn of(
        family: &OnePoint,
        nu: f64,
        view: &View<'_>,
        objective: Objective,
        points: impl Iterator<Item = Front>,
    ) -> Self {
        // Each largest or least value comes with d ln w/dω = (1 + ν) ζ/w where it is found.
        let growth = |z: f64, w: f64| (1.0 + nu) * (z - family.z0) / (family.mu * w);
        let (mut lo, mut hi) = ((f64::INFINITY, 0.0), (f64::NEG_INFINITY, 0.0));
        for p in view.outline {
            let w = family.w(nu, p.y);
            let x = (p.x - family.center_x) / w;
            if x < lo.0 {
                lo = (x, growth(p.y, w));
            }
            if x > hi.0 {
                hi = (x, growth(p.y, w));
            }
        }
        let (mut s, mut t, mut area) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
        for p in points {
            let w = family.w(nu, p.z);
            let (at_s, at_t) = (p.base * w, p.height * w * w);
            if at_s > s.0 {
                s = (at_s, growth(p.z, w));
            }
            if at_t > t.0 {
                t = (at_t, growth(p.z, w));
            }
            if at_s * at_t > area.0 {
                area = (at_s * at_t, growth(p.z, w));
            }
        }
        let width = hi.0 - lo.0;
        let per_row = 1.0 / (1.0 + nu);
        let of_width = (lo.0 * lo.1 - hi.0 * hi.1) / width;
        match objective {
            // With light overhead every λ from n to n + √(n f) needs the same storage. Of these the
            // one with the least largest m_t is best, and preferring it also prevents jumps of λ. t
            // is divided by its value at the view's nearest point, where it is largest without a
            // warp.
            Objective::Storage => {
                let preference = 1e-6 * t.0 * per_row * family.nearest;
                Self {
                    value: width * per_row * s.0 * t.0 * (1.0 + preference),
                    slope: of_width - 1.0
                        + s.1
                        + 2.0 * t.1
                        + preference / (1.0 + preference) * (2.0 * t.1 - 1.0),
                }
            }
            Objective::Area => {
                Self { value: width * per_row * area.0, slope: of_width - 1.0 + 3.0 * area.1 }
            }
        }
    }
}
