use super::{Tilted, View, check_lambda};
use crate::error::{Error, check};
use crate::technique::Objective;

/// A technique's rule for λ, for a view under light at any angle θ.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Rule {
    /// No warp: λ = ∞.
    Uniform,
    /// Perspective shadow maps (Stamminger and Drettakis 2002). With light in the view's plane of
    /// symmetry they are one-point perspectives too, with λ = n at θ = 90°. As in
    /// [`Warp::Psm`](crate::Warp::Psm), the map looks along the axis of the narrowest cone around V
    /// after the viewer's perspective.
    Psm,
    /// Light space perspective shadow maps as published: λ = (n + √(n f))/sin θ (Wimmer et al.
    /// 2004, §4.4).
    Lispsm,
    /// The same rule with the paper's advice for views tilted to the light, which replaces f by n +
    /// μ sin θ where that is smaller. [`Warp::Lispsm`](crate::Warp::Lispsm) follows this rule.
    LispsmInRange,
    /// Trapezoidal shadow maps (Martin and Tan 2004, as Lloyd et al. 2006 describe them): receivers
    /// nearer than the focus distance get 80% of the rows. There is no warp if the focus lies in
    /// front of W or beyond 80% of its depth range. [`Warp::Tsm`](crate::Warp::Tsm) limits the warp
    /// further.
    Tsm {
        /// Focus distance along the view, metres, > 0; `None` stands for √(n f).
        focus: Option<f64>,
    },
    /// The λ with the least [storage](Objective::Storage), M_q·M_p, or the smallest worst
    /// [area](Objective::Area), max E_q·E_p.
    Adaptive(Objective),
    /// Logarithmic rows after the warp with λ = n/sin θ. Their error along the warp's axis is
    /// [`Warped::log_error`](super::Warped::log_error), not E_p.
    Log,
    /// A given λ, metres, at least 1e-12, or infinite for no warp.
    Lambda(f64),
}

impl Tilted {
    /// λ of a technique, metres; infinite for no warp.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.lambda` or `theory.focus` for an invalid number of
    /// the rule.
    pub fn lambda(&self, rule: Rule) -> Result<f64, Error> {
        let View { near: n, far: f, .. } = self.view;
        Ok(match rule {
            Rule::Uniform => f64::INFINITY,
            Rule::Psm => self.psm(),
            Rule::Lispsm => self.view.lambda_l() / self.sin,
            Rule::LispsmInRange => {
                let range = (f - n).min(self.mu() * self.sin);
                (n + (n * (n + range)).sqrt()) / self.sin
            }
            Rule::Tsm { focus } => {
                let focus = focus.unwrap_or((n * f).sqrt());
                check(focus > 0.0 && focus.is_finite(), "theory.focus", || {
                    format!("must be a positive, finite distance, is {focus}")
                })?;
                self.tsm(focus)
            }
            Rule::Adaptive(objective) => self.adaptive(objective),
            Rule::Log => n / self.sin,
            Rule::Lambda(lambda) => {
                check_lambda(lambda)?;
                lambda
            }
        })
    }

    /// The ratio of the texels that another rule needs to those that the
    /// [least-storage](Objective::Storage) warp needs for the same guaranteed error: the ratio of
    /// their M_q·M_p, at least 1. For [`Rule::Lispsm`] it is 1 with light overhead and grows as
    /// the light approaches the view direction (n = 1, f = 100, φ = 30°: 1.08 at θ = 60°, 1.8
    /// at 31°).
    ///
    /// # Errors
    ///
    /// As for [`lambda`](Self::lambda) and [`warped`](Self::warped), and with the field
    /// `theory.rule` for [`Rule::Log`], whose rows no λ gives.
    pub fn adaptive_gain(&self, over: Rule) -> Result<f64, Error> {
        check(over != Rule::Log, "theory.rule", || {
            "logarithmic rows cannot be compared by λ alone".into()
        })?;
        let storage = |rule| Ok(self.warped(self.lambda(rule)?)?.extrema().storage_factor());
        Ok(storage(over)? / storage(Rule::Adaptive(Objective::Storage))?)
    }

    /// The λ with t(δ) = 0.8, where δ is the distance of the focus from W's near plane.
    fn tsm(&self, focus: f64) -> f64 {
        let delta = self.behind_near_plane(0.0, focus);
        let mu = self.mu();
        let lambda = 0.2 * mu * delta / (0.8 * mu - delta);
        // If the focus lies on W's near plane, rounding could give too small a λ.
        if delta < 0.8 * mu && check_lambda(lambda).is_ok() { lambda } else { f64::INFINITY }
    }

    /// The λ of least M_q·M_p or least max E_q·E_p (the direction-adaptive optimum that Theory's
    /// conclusion asks for).
    ///
    /// Let u = 1/λ and z_w = λ (1 + d u), where d is a for V's lower near corner, μ for its
    /// lower far corner and b for its upper far corner. Up to a factor, the cost at the near corner
    /// is g = (1 + a u)³/((1 + b u)(1 + μ u)). The cost at the far corner grows with u, because
    /// μ ≥ b. The largest error passes from the near to the far corner where (1 + a u)/(1 + μ
    /// u) = ρ = (n/f)^e, with e = 1/2 for storage and 2/3 for area. So the cost is least either
    /// there or at the minimum of g, whichever has the smaller u.
    ///
    /// For storage, f/n > 9 and θ ≥ φ it is least at the change of corners: λ* = (μ −
    /// 2√(n f) tan φ cos θ)/(√(f/n) − 1) = (n + √(n f)) sin θ + (√(n f) − n) tan φ
    /// cos θ. With light overhead every λ from n to λ_L needs the same storage, and λ* = λ_L.
    fn adaptive(&self, objective: Objective) -> f64 {
        let View { near: n, far: f, .. } = self.view;
        let t = self.tan_phi * self.cos;
        let sin = self.sin;
        let is_steep = self.first == n;
        // λ at which the errors at the near and the far corner are equal: (μ − a/ρ)/(1/ρ −
        // 1), with the common factor f − n cancelled. It is not positive if the near corner is
        // worse with any warp.
        let equal = match objective {
            Objective::Storage => {
                let g = (f / n).sqrt();
                if is_steep {
                    n * ((g + 1.0) * sin + (g - 1.0) * t)
                } else {
                    n * g * ((g + 1.0) * sin - (g - 1.0) * t)
                }
            }
            Objective::Area => {
                let g = (f / n).cbrt();
                let (plus, minus) = (g * g + g + 1.0, g * g + g - 1.0);
                if is_steep {
                    n * (plus * sin + (minus - 2.0 * g) * t) / (g + 1.0)
                } else {
                    n * g * g * (plus * sin - minus * t) / (g + 1.0)
                }
            }
        };
        // Lengths are divided by μ, because f may have any magnitude.
        let mu = self.mu();
        let a = self.behind_near_plane(-n * self.tan_phi, n) / mu;
        let b = self.behind_near_plane(f * self.tan_phi, f) / mu;
        // g falls where A u² + 2 B u + C < 0. If C ≥ 0 then B ≥ 0, and g grows from u = 0 on.
        let (qa, qb, qc) = (a * b, a * (b + 1.0) - b, 3.0 * a - b - 1.0);
        if qc >= 0.0 {
            return f64::INFINITY;
        }
        let root = (qb * qb - qa * qc).sqrt();
        // 1/u of the positive root, in the form without cancellation for either sign of B.
        let lowest = if qb >= 0.0 { (qb + root) / -qc } else { qa / (root - qb) };
        (lowest * mu).max(equal)
    }

    /// λ of the exact perspective shadow map.
    ///
    /// After the viewer's perspective V is the box |x|, |y| ≤ 1, 0 ≤ z ≤ 1, and the light is
    /// a point. The narrowest cone with its apex there around the box's corners has its axis A in
    /// the plane of symmetry. A points along the shortest vector among the convex combinations of
    /// the unit vectors to the corners. Distance along A is proportional to z sin θ − y cos θ +
    /// c in V, with c = (A_z/A_y) tan φ cos θ n f/(f − n).
    fn psm(&self) -> f64 {
        let View { near: n, far: f, .. } = self.view;
        // The light is at depth f/(f − n) of the box, which is n/(f − n) beyond the box's far
        // side.
        let [to_near, to_far] = [f, n].map(|d| d / (f - n));
        let corner = |y: f64, before: f64| {
            let [y, z] = [y * self.cos - self.sin / self.tan_phi, -before * self.cos];
            let length = (self.cos * self.cos + y * y + z * z).sqrt();
            [y / length, z / length]
        };
        let corners = [
            corner(-1.0, to_near),
            corner(1.0, to_near),
            corner(-1.0, to_far),
            corner(1.0, to_far),
        ];
        let pairs = corners.iter().flat_map(|a| corners.iter().map(move |b| nearest(*a, *b)));
        let squared = |[y, z]: &[f64; 2]| y * y + z * z;
        let [y, z] = pairs.min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap_or(corners[0]);
        // There is no warp if the light shines along the view, where the light and A lie on the
        // axis of symmetry, or if the cone, whose half-angle has the cosine √(y² + z²), opens
        // to a half-space, where no perspective shows all of V.
        if y >= 0.0 || squared(&[y, z]) <= 1e-18 {
            return f64::INFINITY;
        }
        self.first * self.upper_slope() + z / y * self.tan_phi * self.cos * n * to_near
    }
}

/// The point nearest to the origin on the line segment from `a` to `b`.
fn nearest(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let [dy, dz] = [b[0] - a[0], b[1] - a[1]];
    let squared = dy * dy + dz * dz;
    let share = if squared > 0.0 { -(a[0] * dy + a[1] * dz) / squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    // This form is exact at both ends, which matters if one end is much shorter than the other.
    [0, 1].map(|i| (1.0 - share) * a[i] + share * b[i])
}
