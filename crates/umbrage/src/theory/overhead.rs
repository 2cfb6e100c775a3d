use super::{View, check_finite, check_lambda};
use crate::error::{Error, check};

/// Light at right angles to the view (θ = 90°), and a one-point perspective along the view, whose
/// centre of projection lies λ in front of V's near plane (W&P §4.1, LiSPSM §4.2).
///
/// Errors are m, in pixels per texel, for an image of one pixel and a map of one texel: multiply
/// them by res_i/res_s or res_i/res_t. In the papers λ ranges from n, where the map is as wide as
/// V at every depth, to ∞. For λ < n, W's width is determined by V's near corners, and the
/// errors across the map are larger than in the papers' formulas. The functions here are correct
/// for such λ too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overhead {
    view: View,
    lambda: f64,
    /// 1/λ, which is 0 without a warp. With λ itself most formulas would give ∞/∞.
    per_lambda: f64,
}

impl Overhead {
    /// Light overhead with a warp of this λ, metres, at least 1e-12, or infinite for no warp.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.lambda`.
    pub fn new(view: View, lambda: f64) -> Result<Self, Error> {
        check_lambda(lambda)?;
        Ok(Self { view, lambda, per_lambda: 1.0 / lambda })
    }

    /// λ, metres.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// z′/λ at view depth z: W's width there over its width at its near plane.
    fn widening(&self, z: f64) -> f64 {
        1.0 + (z - self.view.near) * self.per_lambda
    }

    fn check_depth(&self, z: f64) -> Result<(), Error> {
        let View { near, far, .. } = self.view;
        check((near..=far).contains(&z), "theory.z", || {
            format!("must lie between the near and the far plane ({near} and {far} metres), is {z}")
        })
    }

    /// m_s at view depth z, metres, n ..= f: the error across the warp's axis (W&P Eq. 7).
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.z`.
    pub fn m_s(&self, z: f64) -> Result<f64, Error> {
        self.check_depth(z)?;
        Ok(self.m_s_inside(z))
    }

    fn m_s_inside(&self, z: f64) -> f64 {
        let View { near, far, .. } = self.view;
        // W's width at its near plane, from those corners of V that W must contain.
        let width = (far / self.widening(far)).max(near);
        width * self.widening(z) / z
    }

    /// m_t at view depth z, metres, n ..= f: the error along the warp's axis (W&P Eq. 8; LiSPSM Eq.
    /// 3 without its factor 2 tan φ; Theory Eq. 9 in units of E).
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.z`.
    pub fn m_t(&self, z: f64) -> Result<f64, Error> {
        self.check_depth(z)?;
        Ok(self.m_t_inside(z))
    }

    fn m_t_inside(&self, z: f64) -> f64 {
        let View { near, far, .. } = self.view;
        let range = (far - near) / (2.0 * self.view.tan_phi());
        range * self.widening(z).powi(2) / (z * self.widening(far))
    }

    /// M_s, the largest m_s, which is reached at z = n for λ ≥ n, and otherwise at z = f. (W&P
    /// Eq. 9 as printed is n times too large, because Eq. 2 divides a pixel's width by n.)
    pub fn max_s(&self) -> f64 {
        self.m_s_inside(self.view.near).max(self.m_s_inside(self.view.far))
    }

    /// M_t, the largest m_t, which is reached at z = f for λ ≤ λ_L, and otherwise at z = n (W&P
    /// Eq. 10).
    pub fn max_t(&self) -> f64 {
        // m_t is convex in z, so its maximum is at an end.
        self.m_t_inside(self.view.near).max(self.m_t_inside(self.view.far))
    }

    /// View depth at which m_t is smallest, metres: λ − n, clamped to n ..= f.
    pub fn best_depth(&self) -> f64 {
        let View { near, far, .. } = self.view;
        (self.lambda - near).clamp(near, far)
    }

    /// The storage factor S̄ = M_s·M_t: the number of texels for an error of at most 1, per pixel
    /// of the image (W&P Eq. 12). It is the same for all λ from n to λ_L.
    pub fn storage_factor(&self) -> f64 {
        self.max_s() * self.max_t()
    }

    /// The critical resolution, texels in s and t: the smallest with which no error exceeds 1 in an
    /// image of `image_side`² pixels (W&P §4.2).
    pub fn critical_resolution(&self, image_side: f64) -> [f64; 2] {
        [image_side * self.max_s(), image_side * self.max_t()]
    }
}

/// Resolution, texels in s and t, of a map that has `texels` texels and the same largest error in
/// both directions: its sides have the ratio of the critical resolution (W&P Eqs. 13, 14). Not
/// rounded to whole texels.
///
/// # Errors
///
/// [`Error::Invalid`] with the field `theory.critical_resolution` or `theory.texels` unless all
/// values are positive and finite, or if they are so extreme that a side is not.
pub fn budget_split(critical_resolution: [f64; 2], texels: f64) -> Result<[f64; 2], Error> {
    let is_good = |x: f64| x > 0.0 && x.is_finite();
    let [s, t] = critical_resolution;
    check(is_good(s) && is_good(t), "theory.critical_resolution", || {
        format!("must be positive and finite, is {s} x {t}")
    })?;
    check(is_good(texels), "theory.texels", || {
        format!("must be positive and finite, is {texels}")
    })?;
    let shape = s.sqrt() / t.sqrt();
    let sides = [texels.sqrt() * shape, texels.sqrt() / shape];
    check_finite(sides, "theory.critical_resolution")?;
    Ok(sides)
}

impl View {
    /// λ_L = n + √(n f), metres. With light overhead, this λ gives equal m_t at the near and
    /// the far plane, and the smallest M_t (LiSPSM §4.2).
    pub fn lambda_l(&self) -> f64 {
        self.near + (self.near * self.far).sqrt()
    }

    /// λ in metres for W&P's parameter η (Eq. 11), −1 ..= 1: η = −1 is no warp (λ = ∞),
    /// η = 0 is λ_L, and η = 1 is n. With light overhead, M_t is linear in η on each side of 0
    /// (their Appendix B).
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.eta`.
    pub fn lambda_from_eta(&self, eta: f64) -> Result<f64, Error> {
        check((-1.0..=1.0).contains(&eta), "theory.eta", || {
            format!("must lie between -1 and 1, is {eta}")
        })?;
        let alpha = self.far / self.near;
        let root = alpha.sqrt();
        Ok(self.near
            * if eta <= 0.0 {
                (root + 1.0 - eta * (alpha - 1.0)) / (eta + 1.0)
            } else {
                (root + 1.0) / (1.0 + eta * root)
            })
    }

    /// η of a λ of at least n, metres, or infinite: the inverse of
    /// [`lambda_from_eta`](Self::lambda_from_eta).
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.lambda` for λ < n, which has no η.
    pub fn eta_from_lambda(&self, lambda: f64) -> Result<f64, Error> {
        let near = self.near;
        check(lambda >= near, "theory.lambda", || {
            format!("must be at least the near distance ({near} metres) to have an η, is {lambda}")
        })?;
        let alpha = self.far / near;
        let root = alpha.sqrt();
        // n/λ, which is 0 without a warp.
        let l = near / lambda;
        Ok(if lambda >= self.lambda_l() {
            ((root + 1.0) * l - 1.0) / (1.0 + (alpha - 1.0) * l)
        } else {
            ((root + 1.0) * l - 1.0) / root
        })
    }

    /// Error along the warp's axis of the logarithmic parameterization with light overhead, which
    /// is the same everywhere: m_t = ln(f/n)/(2 tan φ). The error across the axis is 1 everywhere
    /// (W&P Appendix C, LiSPSM §4.2).
    pub fn log_error(&self) -> f64 {
        (self.far / self.near).ln() / (2.0 * self.tan_phi())
    }
}
