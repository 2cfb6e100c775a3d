use super::{View, check_finite, check_lambda};
use crate::error::{Error, check};

/// A view and parallel light at any angle to it, in the plane of the view's y axis and direction
/// (Theory §2.4).
///
/// Points are (x, y, z) in the viewer's coordinates: x points to the right, z along the view, and y
/// to the side to which the light is tilted, so that beams run along (0, sin θ, cos θ) in either
/// direction. Errors are largest on V's lower side, y = −z tan φ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilted {
    pub(super) view: View,
    theta_rad: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
    pub(super) tan_phi: f64,
    /// View depth at which V's upper side touches W's near plane: n for θ ≥ φ, otherwise f.
    pub(super) first: f64,
}

impl Tilted {
    /// A view under light at the angle θ to it, radians, 0 ..= π. Angles θ and π − θ have
    /// the same beams and are equivalent; the smaller one is stored.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.theta_rad`.
    pub fn new(view: View, theta_rad: f64) -> Result<Self, Error> {
        use std::f64::consts::{FRAC_PI_2, PI};
        check((0.0..=PI).contains(&theta_rad), "theory.theta_rad", || {
            format!("must lie between 0 and π (180°), is {theta_rad}")
        })?;
        let theta = theta_rad.min(PI - theta_rad);
        // Exact values for right angles make the results comparable with those of
        // [`Overhead`](super::Overhead).
        let (sin, cos) = if theta == FRAC_PI_2 { (1.0, 0.0) } else { theta.sin_cos() };
        let tan_phi = view.tan_phi();
        let first = if theta >= view.half_fov_rad { view.near } else { view.far };
        Ok(Self { view, theta_rad: theta, sin, cos, tan_phi, first })
    }

    /// The view.
    pub fn view(&self) -> View {
        self.view
    }

    /// Angle θ, radians, 0 ..= π/2.
    pub fn theta_rad(&self) -> f64 {
        self.theta_rad
    }

    /// Distance of (y, z) from W's near plane, metres: z_w − λ.
    pub(super) fn behind_near_plane(&self, y: f64, z: f64) -> f64 {
        (z - self.first) * self.sin + (self.first * self.tan_phi - y) * self.cos
    }

    /// Growth of z_w along V's upper side per metre of z, negative for θ < φ: sin θ − tan φ
    /// cos θ.
    pub(super) fn upper_slope(&self) -> f64 {
        self.sin - self.tan_phi * self.cos
    }

    /// Depth range μ of W, metres (Theory, appendix): the extent of V along W's axis.
    pub fn mu(&self) -> f64 {
        let f = self.view.far;
        self.behind_near_plane(-f * self.tan_phi, f)
    }

    /// The warp whose centre of projection lies λ in front of W's near plane, metres, at least
    /// 1e-12, or infinite for no warp.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.lambda`.
    pub fn warped(&self, lambda: f64) -> Result<Warped, Error> {
        check_lambda(lambda)?;
        Ok(Warped { tilted: *self, lambda, per_lambda: 1.0 / lambda })
    }
}

/// A warp of a view under tilted light, with the papers' closed forms of its errors at any point,
/// for any θ and any λ (Theory Eqs. 12 to 14 and appendix).
///
/// The appendix has three misprinted factors: tan φ_w for θ > φ, which is right at 90° only,
/// and F_p for θ > φ and for θ < φ (see [`tan_phi_w`](Self::tan_phi_w) and [`f_p`](Self::f_p)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warped {
    tilted: Tilted,
    lambda: f64,
    /// 1/λ, which is 0 without a warp. With λ itself most formulas would give ∞/∞.
    per_lambda: f64,
}

/// Perspective or projection errors across and along the warp's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// E_q: the error in the image's horizontal coordinate, across the warp's axis.
    pub q: f64,
    /// E_p: the error in the image's vertical coordinate, along the warp's axis.
    pub p: f64,
}

impl Errors {
    /// The product E_pq = E_q·E_p.
    pub fn product(&self) -> f64 {
        self.q * self.p
    }
}

/// An extreme value of an error over V, and where it is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum {
    /// The error.
    pub value: f64,
    /// The y at which it is reached, metres; it is reached at all x.
    pub y: f64,
    /// The view depth at which it is reached, metres.
    pub z: f64,
}

/// The range of an error over V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// The smallest error.
    pub least: Extremum,
    /// The largest error.
    pub largest: Extremum,
}

/// The ranges of all three errors over V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrema {
    /// Range of E_q.
    pub q: Extreme,
    /// Range of E_p.
    pub p: Extreme,
    /// Range of E_pq.
    pub product: Extreme,
}

impl Extrema {
    /// Storage factor S̄ = M_q·M_p/4: the number of texels for an error of at most one pixel per
    /// texel, per pixel of the image.
    pub fn storage_factor(&self) -> f64 {
        self.q.largest.value * self.p.largest.value / 4.0
    }
}

impl Warped {
    /// The view and the light.
    pub fn tilted(&self) -> Tilted {
        self.tilted
    }

    /// λ, metres.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// z_w/λ: W's width at a point over its width at its near plane.
    fn widening(&self, y: f64, z: f64) -> f64 {
        1.0 + self.tilted.behind_near_plane(y, z) * self.per_lambda
    }

    /// λ tan φ_w, metres: half the width of W's near plane, which is finite without a warp.
    ///
    /// W must contain the corners of V's upper side: the far ones, and for λ < n (sin θ − tan
    /// φ cos θ) the near ones.
    fn half_width(&self) -> f64 {
        let Tilted { view: View { near, far, .. }, tan_phi, .. } = self.tilted;
        let corner = |z: f64| z * tan_phi / self.widening(z * tan_phi, z);
        corner(far).max(corner(near))
    }

    /// tan φ_w, where φ_w is half of W's field of view in x; 0 without a warp (Theory, appendix).
    ///
    /// For θ > φ the paper prints f tan φ/(μ + λ), with which W would cut off V's far upper
    /// corners unless θ = 90°: they lie not on W's far plane but at z_w = λ + (f − n)(1 −
    /// tan φ/tan θ) sin θ. The paper also does not mention that for small λ the near corners
    /// determine W's width.
    pub fn tan_phi_w(&self) -> f64 {
        self.half_width() * self.per_lambda
    }

    /// z_w of a point, metres: its distance from W's centre of projection along W's axis; infinite
    /// without a warp (Theory, appendix). It is positive wherever the map applies.
    pub fn z_w(&self, y: f64, z: f64) -> f64 {
        self.tilted.behind_near_plane(y, z) + self.lambda
    }

    /// G(y) of Theory's Eqs. 13 and 14, metres, defined by z_w = sin θ (z + G). It is infinite
    /// without a warp, and for θ = 0, where z_w does not depend on z.
    pub fn g(&self, y: f64) -> f64 {
        if self.tilted.sin == 0.0 {
            return f64::INFINITY;
        }
        self.z_w(y, 0.0) / self.tilted.sin
    }

    /// F_q of Theory's Eq. 13, defined by E_q = F_q (z + G)/z; 0 without a warp and for θ = 0.
    pub fn f_q(&self) -> f64 {
        2.0 * self.tan_phi_w() / self.tilted.tan_phi * self.tilted.sin
    }

    /// F_p of Theory's Eq. 14, 1/m, defined by E_p = F_p (z + G)²/z; 0 without a warp and for θ =
    /// 0.
    ///
    /// As printed in the appendix, F_p is too large by a factor of 1/sin θ for θ > φ, and of
    /// 1/(tan φ cos θ) for θ < φ.
    pub fn f_p(&self) -> f64 {
        let mu = self.tilted.mu();
        let per_range = self.per_lambda / (1.0 + mu * self.per_lambda);
        mu / self.tilted.tan_phi * self.per_lambda * per_range * self.tilted.sin.powi(2)
    }

    /// Perspective errors E_q and E_p at (y, z), metres, without regard to the slope of any surface
    /// (Theory Eqs. 13, 14; they are the same for all x). The formulas hold wherever z and z_w are
    /// positive, within V and around it.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.point`.
    pub fn errors(&self, y: f64, z: f64) -> Result<Errors, Error> {
        self.check_point(y, z)?;
        let errors = self.errors_inside(y, z);
        check_finite([errors.q, errors.p], "theory.point")?;
        Ok(errors)
    }

    fn errors_inside(&self, y: f64, z: f64) -> Errors {
        let Tilted { tan_phi, .. } = self.tilted;
        let mu = self.tilted.mu();
        let w = self.widening(y, z);
        Errors {
            q: 2.0 * self.half_width() / tan_phi * w / z,
            p: mu / (tan_phi * (1.0 + mu * self.per_lambda)) * w * w / z,
        }
    }

    fn check_point(&self, y: f64, z: f64) -> Result<(), Error> {
        check(z > 0.0 && z.is_finite() && y.is_finite(), "theory.point", || {
            format!("must lie before the eye: z > 0, is at y = {y}, z = {z}")
        })?;
        check(self.widening(y, z) > 0.0, "theory.point", || {
            format!("must lie before the warp's centre of projection, has z_w = {}", self.z_w(y, z))
        })
    }

    /// The factors from perspective errors to errors on a surface at (x, y, z), metres, whose
    /// slopes are k_x = dx/dz and k_y = dy/dz: the products E = E^pers·E^proj are the exact
    /// |dq/ds| and |dp/dt| along that slope (Theory Eqs. 11 and 12, appendix). A factor is infinite
    /// where the slope runs along the light, and 0 where it runs along the line of sight.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.point`, or with `theory.slope` if the slope is not
    /// finite or a factor is 0/0 or exceeds the largest number.
    pub fn projection(&self, [x, y, z]: [f64; 3], slope: [f64; 2]) -> Result<Errors, Error> {
        self.check_point(y, z)?;
        check(x.is_finite(), "theory.point", || format!("must be finite, is at x = {x}"))?;
        let Tilted { sin, cos, .. } = self.tilted;
        let [k_x, k_y] = slope;
        check_finite(slope, "theory.slope")?;
        // Derivative of z_w along the slope.
        let along_w = sin - cos * k_y;
        // On the plane of symmetry the factor is 1 for every k_x, also in the limit of 0/0.
        let across_w = k_x - x / self.z_w(y, z) * along_w;
        check_finite([x / z, y / z, across_w, along_w], "theory.point")?;
        let q = if x == 0.0 { 1.0 } else { (k_x - x / z) / across_w };
        let q = q.abs();
        let p = ((k_y - y / z) / along_w).abs();
        let is_good =
            |factor: f64, divisor: f64| factor.is_finite() || divisor == 0.0 && !factor.is_nan();
        check(is_good(q, across_w) && is_good(p, along_w), "theory.slope", || {
            format!("must not be along both the light and the line of sight, is {k_x}, {k_y}")
        })?;
        Ok(Errors { q, p })
    }

    /// The error along the warp's axis of a map with logarithmic rows, t = ln(z_w/λ)/ln(1 +
    /// μ/λ), which replaces E_p at (y, z): z_w ln(1 + μ/λ)/(z tan φ). At θ = 90° and λ = n
    /// it is twice [`View::log_error`] everywhere, which is the optimum of W&P's Appendix C.
    ///
    /// # Errors
    ///
    /// As for [`errors`](Self::errors).
    pub fn log_error(&self, y: f64, z: f64) -> Result<f64, Error> {
        self.check_point(y, z)?;
        let mu = self.tilted.mu();
        let nu = mu * self.per_lambda;
        // λ ln(1 + μ/λ), whose limit without a warp is μ.
        let range = if nu == 0.0 { mu } else { mu * nu.ln_1p() / nu };
        let error = range * self.widening(y, z) / (z * self.tilted.tan_phi);
        check_finite([error], "theory.point")?;
        Ok(error)
    }

    /// The smallest and the largest errors over V, and where they are reached (Theory §3.1).
    ///
    /// z_w decreases with y, so at every z all errors are smallest on V's upper side, y = z tan φ,
    /// and largest on its lower side, y = −z tan φ. On a line y = τ z, z_w = α z + c, where c
    /// does not depend on τ. Therefore
    ///
    /// - E_q ∝ z_w/z = α + c/z decreases with z if c > 0, that is λ > n (sin θ − tan φ cos
    ///   θ), and otherwise increases;
    /// - E_p ∝ z_w²/z is convex in z: it is largest at n or f and smallest at z = c/α, clamped
    ///   to n ..= f;
    /// - E_pq ∝ z_w³/z² decreases up to z = 2c/α and increases from there, with its extrema
    ///   likewise.
    ///
    /// The paper places all minima at z = f. This is right for E_q if c > 0; for small λ the
    /// minima of E_p and E_pq lie before f (at θ = 90° that of E_p at z = λ − n).
    pub fn extrema(&self) -> Extrema {
        let View { near, far, .. } = self.tilted.view;
        let slope = self.tilted.upper_slope();
        // The view depth c/α at which E_p is smallest. If α ≤ 0, z_w decreases with z and so
        // does E_p, whose minimum is then at f.
        let turn = if slope > 0.0 { self.lambda / slope - near } else { f64::INFINITY };
        let extreme = |turn: f64, error: fn(Errors) -> f64| {
            let at = |tau: f64, z: f64| {
                let y = tau * z;
                Extremum { value: error(self.errors_inside(y, z)), y, z }
            };
            let tan_phi = self.tilted.tan_phi;
            let [from_near, from_far] = [near, far].map(|z| at(-tan_phi, z));
            let largest = if from_near.value >= from_far.value { from_near } else { from_far };
            Extreme { least: at(tan_phi, turn.clamp(near, far)), largest }
        };
        // E_q is monotonic: its minimum is at one end, which the sign of c selects.
        let end = if turn > 0.0 { far } else { near };
        Extrema {
            q: extreme(end, |e| e.q),
            p: extreme(turn, |e| e.p),
            product: extreme(2.0 * turn, |e| e.product()),
        }
    }
}
