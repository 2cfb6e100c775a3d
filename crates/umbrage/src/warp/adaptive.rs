use super::{OnePoint, Seen};
use crate::technique::Objective;

/// The strength ν = μ/λ of least error over the points seen.
///
/// Let w_j = 1 + ν ζ_j at vertex j, where ζ_j ∈ [0, 1] is its position between near and far
/// plane and d_j its view distance. The largest errors over the body are those at its vertices: m_s
/// is a ratio of linear functions, and m_t a square of a linear function over another, which is
/// convex. In ω = ln(1 + ν) the logarithm of the largest m_t is convex too (each ln w_j is a
/// log-sum-exp), and m_s adds little that is not. For a view as a whole the sum has one minimum,
/// but for thin strips it can have two. A coarse scan brackets the lowest one, and golden section
/// search refines it.
pub(crate) fn least_error(family: &OnePoint, seen: &[Seen], objective: Objective) -> f64 {
    let cost = |omega: f64| cost(family, seen, objective, omega.exp_m1());
    // For warps stronger than the view's own perspective every error grows.
    let end = (family.farthest / family.nearest).ln() + 1.0;
    const STEPS: usize = 8;
    let at = |i: usize| end * (i as f64) / STEPS as f64;
    let best = (0..=STEPS).map(|i| (cost(at(i)), i)).min_by(|a, b| a.0.total_cmp(&b.0));
    let best = best.map_or(0, |(_, i)| i);
    let (mut lo, mut hi) = (at(best.saturating_sub(1)), at((best + 1).min(STEPS)));
    // 34 steps of golden section search shrink the bracket to 8e-8 of its width.
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
    // The minimum may be at the bracket's lower end: no warp.
    if cost(0.0) <= cost(omega) { 0.0 } else { omega.exp_m1() }
}

/// The quantity to minimise.
fn cost(family: &OnePoint, seen: &[Seen], objective: Objective, nu: f64) -> f64 {
    // The extent and the errors are computed in one pass, because planning spends most of its time
    // here.
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
        // With light overhead every λ from n to n + √(n f) needs the same storage. Of these the
        // one with the least largest m_t is best, and preferring it also prevents jumps of λ. t is
        // divided by its value at the view's nearest point, where it is largest without a warp.
        Objective::Storage => {
            (hi - lo) * per_row * s * t * (1.0 + 1e-6 * t * per_row * family.nearest)
        }
        Objective::Area => (hi - lo) * per_row * area,
    }
}
