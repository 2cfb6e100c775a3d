use super::{OnePoint, Seen};
use crate::technique::Objective;

/// The strength ν = μ/λ of least error over the points seen.
///
/// With w_j = 1 + ν ζ_j at vertex j, ζ ∈ [0, 1] its place between near and far plane and d_j its view
/// distance, the largest errors over the body are those at its vertices: m_s is a ratio of linear
/// functions, m_t a square of one over another, which is convex. In ω = ln(1 + ν) the logarithm of
/// m_t is convex too (each ln w_j is a log-sum-exp), and m_s adds little that is not: the sum has
/// one valley for a view as a whole, and two at times for thin strips. A coarse scan brackets the lowest
/// and a golden section narrows it down.
pub(crate) fn least_error(family: &OnePoint, seen: &[Seen], objective: Objective) -> f64 {
    let cost = |omega: f64| cost(family, seen, objective, omega.exp_m1());
    // Beyond the view's own perspective every error grows.
    let end = (family.farthest / family.nearest).ln() + 1.0;
    const STEPS: usize = 8;
    let at = |i: usize| end * (i as f64) / STEPS as f64;
    let best = (0..=STEPS).map(|i| (cost(at(i)), i)).min_by(|a, b| a.0.total_cmp(&b.0));
    let best = best.map_or(0, |(_, i)| i);
    let (mut lo, mut hi) = (at(best.saturating_sub(1)), at((best + 1).min(STEPS)));
    // Golden section; 34 steps shrink the bracket to 8e-8 of its width.
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (hi - RATIO * (hi - lo), lo + RATIO * (hi - lo));
    let (mut cost_a, mut cost_b) = (cost(a), cost(b));
    for _ in 0..34 {
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
    let omega = lo.midpoint(hi);
    // The bracket's lower end may be the minimum itself: no warp at all.
    if cost(0.0) <= cost(omega) { 0.0 } else { omega.exp_m1() }
}

/// The quantity to make small.
fn cost(family: &OnePoint, seen: &[Seen], objective: Objective, nu: f64) -> f64 {
    // One pass for the extent and the errors: planning spends its time here.
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut s, mut t, mut area) = (0f64, 0f64, 0f64);
    for p in seen {
        let w = family.w(nu, p.xz.y);
        let x = (p.xz.x - family.center_x) / w;
        (lo, hi) = (lo.min(x), hi.max(x));
        let (at_s, at_t) = (p.base * w, p.height * w * w);
        s = s.max(at_s);
        t = t.max(at_t);
        area = area.max(at_s * at_t);
    }
    let per_row = 1.0 / (1.0 + nu);
    match objective {
        // Overhead, every λ from n to n + √(n f) needs the same storage. Of equals, the least
        // max m_t is the best; it also keeps λ from jumping. t is in units of its own size
        // at the view's nearest point, where it is largest without a warp.
        Objective::Storage => {
            (hi - lo) * per_row * s * t * (1.0 + 1e-6 * t * per_row * family.nearest)
        }
        Objective::Area => (hi - lo) * per_row * area,
    }
}
