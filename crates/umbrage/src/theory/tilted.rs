use super::{View, check_lambda};
use crate::error::{Error, check};

/// A view and parallel light at any angle to it, in the plane of the view's y axis and direction (Theory §2.4).
///
/// Points are (x, y, z) in the viewer's eye: x to the right, z along the view, and y to the side to which the
/// light leans forwards: beams run along (0, sin θ, cos θ), one way or the other. V's lower side, y = −z tan φ, is where
/// errors are large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilted {
    pub(super) view: View,
    theta_rad: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
    pub(super) tan_phi: f64,
    /// View depth of the edge of V's upper side that touches W's near plane: n, for θ < φ f.
    pub(super) first: f64,
}

impl Tilted {
    /// With the angle θ between view and light in radians, 0 ..= π. Angles θ and π − θ have the same beams and
    /// are one; what is kept is the smaller.
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
        // Right angles are common, and so are those who compare with the forms for light overhead.
        let (sin, cos) = if theta == FRAC_PI_2 { (1.0, 0.0) } else { theta.sin_cos() };
        let tan_phi = view.tan_phi();
        let first = if theta >= view.half_fov_rad { view.near } else { view.far };
        Ok(Self { view, theta_rad: theta, sin, cos, tan_phi, first })
    }

    /// The view.
    pub fn view(&self) -> View {
        self.view
    }

    /// θ in radians, 0 ..= π/2.
    pub fn theta_rad(&self) -> f64 {
        self.theta_rad
    }

    /// Distance of (y, z) from W's near plane, metres: z_w − λ.
    pub(super) fn behind_near_plane(&self, y: f64, z: f64) -> f64 {
        (z - self.first) * self.sin + (self.first * self.tan_phi - y) * self.cos
    }

    /// How much z_w grows along V's upper side per metre of z, negative for θ < φ: sin θ − tan φ cos θ.
    pub(super) fn upper_slope(&self) -> f64 {
        self.sin - self.tan_phi * self.cos
    }

    /// μ, the depth range of W, metres (Theory, appendix): how deep V is along W's axis.
    pub fn mu(&self) -> f64 {
        let f = self.view.far;
        self.behind_near_plane(-f * self.tan_phi, f)
    }

    /// The warp whose centre of projection lies λ before W's near plane, metres, at least 1e-12, or infinite for
    /// no warp.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.lambda`.
    pub fn warped(&self, lambda: f64) -> Result<Warped, Error> {
        check_lambda(lambda)?;
        Ok(Warped { tilted: *self, lambda, per_lambda: 1.0 / lambda })
    }
}

/// A warp of a view under tilted light, and its errors: the papers' closed forms for any point, any θ and
/// any λ (Theory Eqs. 12 to 14 and appendix).
///
/// The appendix prints three factors wrong: tan φ_w for θ > φ, right at 90° only, and F_p on both sides of φ
/// (see [`tan_phi_w`](Self::tan_phi_w) and [`f_p`](Self::f_p)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warped {
    tilted: Tilted,
    lambda: f64,
    /// 1/λ: 0 without a warp, where λ itself makes ∞/∞ of most formulas.
    per_lambda: f64,
}

/// Perspective or projection errors across and along the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// E_q: by the image's horizontal coordinate, across the map.
    pub q: f64,
    /// E_p: by the image's vertical coordinate, along the map.
    pub p: f64,
}

impl Errors {
    /// E_pq = E_q·E_p.
    pub fn product(&self) -> f64 {
        self.q * self.p
    }
}

/// Where over V an error is how large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum {
    /// The error.
    pub value: f64,
    /// Where, metres: the same for all x.
    pub y: f64,
    /// View depth, metres.
    pub z: f64,
}

/// The ends of an error's range over V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// The smallest.
    pub least: Extremum,
    /// The largest.
    pub largest: Extremum,
}

/// The ranges over V of all three errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrema {
    /// Of E_q.
    pub q: Extreme,
    /// Of E_p.
    pub p: Extreme,
    /// Of E_pq.
    pub product: Extreme,
}

impl Extrema {
    /// Storage factor S̄ = M_q·M_p/4: texels needed for an error of at most one pixel per texel, per pixel
    /// of the image.
    pub fn storage_factor(&self) -> f64 {
        self.q.largest.value * self.p.largest.value / 4.0
    }
}

impl Warped {
    /// What is warped.
    pub fn tilted(&self) -> Tilted {
        self.tilted
    }

    /// λ, metres.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// z_w/λ: how much wider W is than at its near plane.
    fn widening(&self, y: f64, z: f64) -> f64 {
        1.0 + self.tilted.behind_near_plane(y, z) * self.per_lambda
    }

    /// λ tan φ_w, metres: half the width of W's near plane, which stays finite without a warp.
    ///
    /// W must hold the corners of V's upper side: the far ones, and for λ < n (sin θ − tan φ cos θ) the near
    /// ones.
    fn half_width(&self) -> f64 {
        let Tilted { view: View { near, far, .. }, tan_phi, .. } = self.tilted;
        let corner = |z: f64| z * tan_phi / self.widening(z * tan_phi, z);
        corner(far).max(corner(near))
    }

    /// tan φ_w, of half W's field of view in x; 0 without a warp (Theory, appendix).
    ///
    /// For θ > φ the paper prints f tan φ/(μ + λ), with which W would cut off V's far upper corners unless
    /// θ = 90°: they lie not at W's far plane but at z_w = λ + (f − n)(1 − tan φ/tan θ) sin θ. It does not say
    /// that for short λ the near corners stick out.
    pub fn tan_phi_w(&self) -> f64 {
        self.half_width() * self.per_lambda
    }

    /// z_w of a point, metres: its distance from W's centre of projection along W's axis; infinite without a
    /// warp (Theory, appendix). Positive wherever the map applies.
    pub fn z_w(&self, y: f64, z: f64) -> f64 {
        self.tilted.behind_near_plane(y, z) + self.lambda
    }

    /// G(y) of Theory's Eqs. 13 and 14, metres, with which z_w = sin θ (z + G). Infinite without a warp and for
    /// θ = 0, where z_w does not depend on z.
    pub fn g(&self, y: f64) -> f64 {
        if self.tilted.sin == 0.0 {
            return f64::INFINITY;
        }
        self.z_w(y, 0.0) / self.tilted.sin
    }

    /// F_q of Theory's Eq. 13, with which E_q = F_q (z + G)/z; 0 without a warp and for θ = 0.
    pub fn f_q(&self) -> f64 {
        2.0 * self.tan_phi_w() / self.tilted.tan_phi * self.tilted.sin
    }

    /// F_p of Theory's Eq. 14, 1/m, with which E_p = F_p (z + G)²/z; 0 without a warp and for θ = 0.
    ///
    /// The appendix prints it too large by 1/sin θ for θ > φ, by 1/(tan φ cos θ) for θ < φ.
    pub fn f_p(&self) -> f64 {
        let mu = self.tilted.mu();
        let per_range = self.per_lambda / (1.0 + mu * self.per_lambda);
        mu / self.tilted.tan_phi * self.per_lambda * per_range * self.tilted.sin.powi(2)
    }

    /// E_q and E_p at (y, z), metres, without regard to the slope of any surface (Theory Eqs. 13, 14, the
    /// same for all x). They hold wherever z and z_w are positive, within V and around it.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.point`.
    pub fn errors(&self, y: f64, z: f64) -> Result<Errors, Error> {
        self.check_point(y, z)?;
        Ok(self.errors_inside(y, z))
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

    /// What the errors at (x, y, z), metres, are multiplied with on a surface of slopes k_x = dx/dz and
    /// k_y = dy/dz: E = E^pers·E^proj is the exact |dq/ds| and |dp/dt| along that slope (Theory Eqs. 11 and
    /// 12, appendix). Infinite where the slope runs along the light, 0 where it runs along the line of sight.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.point`, or with `theory.slope` where the slope is not finite or
    /// a factor is 0/0.
    pub fn projection(&self, [x, y, z]: [f64; 3], slope: [f64; 2]) -> Result<Errors, Error> {
        self.check_point(y, z)?;
        check(x.is_finite(), "theory.point", || format!("must be finite, is at x = {x}"))?;
        let Tilted { sin, cos, .. } = self.tilted;
        let [k_x, k_y] = slope;
        // How fast z_w changes along the slope.
        let along_w = sin - cos * k_y;
        // On the plane of symmetry it is 1 for every k_x, so that it is for 0/0 too.
        let q = if x == 0.0 { 1.0 } else { (k_x - x / z) / (k_x - x / self.z_w(y, z) * along_w) };
        let q = q.abs();
        let p = ((k_y - y / z) / along_w).abs();
        let is_good = k_x.is_finite() && k_y.is_finite() && !q.is_nan() && !p.is_nan();
        check(is_good, "theory.slope", || {
            format!(
                "must be finite and not along both the light and the line of sight, is {k_x}, {k_y}"
            )
        })?;
        Ok(Errors { q, p })
    }

    /// The error along a map with logarithmic rows, t = ln(z_w/λ)/ln(1 + μ/λ), at (y, z), in place of E_p:
    /// z_w ln(1 + μ/λ)/(z tan φ). At θ = 90° and λ = n it is twice [`View::log_error`] everywhere, the optimum
    /// of W&P's Appendix C.
    ///
    /// # Errors
    ///
    /// As [`errors`](Self::errors).
    pub fn log_error(&self, y: f64, z: f64) -> Result<f64, Error> {
        self.check_point(y, z)?;
        let mu = self.tilted.mu();
        let nu = mu * self.per_lambda;
        // λ ln(1 + μ/λ), which is μ without a warp.
        let range = if nu == 0.0 { mu } else { mu * nu.ln_1p() / nu };
        Ok(range * self.widening(y, z) / (z * self.tilted.tan_phi))
    }

    /// The smallest and largest errors over V, and where they are (Theory §3.1).
    ///
    /// z_w falls with y, so for any z all errors are smallest on V's upper side, y = z tan φ, and largest on
    /// its lower side, y = −z tan φ. Along y = τ z, z_w = α z + c with one c for all τ. So
    ///
    /// - E_q ∝ z_w/z = α + c/z falls with z if c > 0, that is λ > n (sin θ − tan φ cos θ), else it grows;
    /// - E_p ∝ z_w²/z is convex in z: largest at n or f, smallest at z = c/α between them;
    /// - E_pq ∝ z_w³/z² falls up to z = 2c/α and grows from there: the same.
    ///
    /// The paper has all minima at z = f. That is so for E_q; E_p and E_pq have theirs before f if λ is short
    /// (at θ = 90° E_p at z = λ − n).
    pub fn extrema(&self) -> Extrema {
        let View { near, far, .. } = self.tilted.view;
        let slope = self.tilted.upper_slope();
        // View depth at which c/α falls; beyond f where α ≤ 0, as z_w then falls with z and E_p too.
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
        // E_q turns nowhere: its minimum is at one end, by the sign of c.
        let end = if turn > 0.0 { far } else { near };
        Extrema {
            q: extreme(end, |e| e.q),
            p: extreme(turn, |e| e.p),
            product: extreme(2.0 * turn, |e| e.product()),
        }
    }
}
