use super::{OnePoint, Seen, View};
use crate::technique::Objective;

/// The largest number of points that a search looks at one by one.
const FEW: usize = 40;

/// Number of ranges of view depth that stand for more points than [`FEW`].
const RANGES: usize = 32;

/// Steps of golden section search, which shrink the bracket to 1e-6 of its width.
const GOLDEN_STEPS: usize = 28;

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
    /// The strength ν = μ/λ of least error over the points seen.
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
    ) -> f64 {
        self.set_front(family, view.seen);
        let cost = |omega: f64| cost(family, &self.front, view, objective, omega.exp_m1());
        // For warps stronger than the view's own perspective every error grows.
        let end = (family.farthest / family.nearest).ln() + 1.0;
        const STEPS: usize = 8;
        let at = |i: usize| end * (i as f64) / STEPS as f64;
        let best = (0..=STEPS).map(|i| (cost(at(i)), i)).min_by(|a, b| a.0.total_cmp(&b.0));
        let best = best.map_or(0, |(_, i)| i);
        let (mut lo, mut hi) = (at(best.saturating_sub(1)), at((best + 1).min(STEPS)));
        const RATIO: f64 = 0.618_033_988_749_894_9;
        let (mut a, mut b) = (hi - RATIO * (hi - lo), lo + RATIO * (hi - lo));
        let (mut cost_a, mut cost_b) = (cost(a), cost(b));
        for _ in 0..GOLDEN_STEPS {
            if cost_a <= cost_b {
                (hi, b, cost_b) = (b, a, cost_a);
                a = hi - RATIO * (hi - lo);
                cost_a = cost(a);
            } else {
                (lo, a, cost_a) = (a, b, cost_b);
                b = lo + RATIO * (hi - lo);
                cost_b = cost(b);
            }
        }
        let nu = lo.midpoint(hi).exp_m1();
        // The minimum may be at the bracket's lower end: no warp. The front may stand for points
        // that do not exist, so the points themselves decide.
        let exact = |nu: f64| objective_of(family, nu, view, objective, view.seen.iter().map(Front::of));
        if exact(0.0) <= exact(nu) { 0.0 } else { nu }
    }

    /// Sets the points where errors may be largest. Of many points, those of similar view depth
    /// count as one.
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
            let index = (p.depth.to_bits() - first) as f64 * per_bit;
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

/// The quantity to minimise.
fn cost(
    family: &OnePoint,
    front: &[Front],
    view: &View<'_>,
    objective: Objective,
    nu: f64,
) -> f64 {
    objective_of(family, nu, view, objective, front.iter().copied())
}

fn objective_of(
    family: &OnePoint,
    nu: f64,
    view: &View<'_>,
    objective: Objective,
    points: impl Iterator<Item = Front>,
) -> f64 {
    let (lo, hi) = family.extent(nu, view.outline);
    let (mut s, mut t, mut area) = (0f64, 0f64, 0f64);
    for p in points {
        let w = family.w(nu, p.z);
        let (at_s, at_t) = (p.base * w, p.height * w * w);
        s = s.max(at_s);
        t = t.max(at_t);
        area = area.max(at_s * at_t);
    }
    let per_row = 1.0 / (1.0 + nu);
    match objective {
        // With light overhead every λ from n to n + √(n f) needs the same storage. Of these the
        // one with the least largest m_t is best, and preferring it also prevents jumps of λ. t is
        // divided by its value at the view's nearest point, where it is largest without a warp.
        Objective::Storage => {
            (hi - lo) * per_row * s * t * (1.0 + 1e-6 * t * per_row * family.nearest)
        }
        Objective::Area => (hi - lo) * per_row * area,
    }
}
