//! The papers' closed forms for the aliasing error of a shadow map over a square view frustum,
//! which need no plan.
//!
//! For one parallel light in the plane of the view's y axis and direction, all errors follow from
//! five numbers: n, f, φ ([`View`]), θ ([`Tilted`]) and λ ([`Warped`]). V is the view frustum
//! and W the warp's frustum around it. [`Overhead`] is the simple case of θ = 90°.
//! [`storage_factor`] gives the texels that partitions need, [`Tilted::lambda`] the techniques'
//! rules for λ, and [`FourierStep`] the shadow test of convolution shadow maps.
//!
//! The formulas are those of Wimmer, Scherzer and Purgathofer 2004 (LiSPSM), Lloyd, Tuft, Yoon and
//! Manocha 2006 (W&P), Zhang, Zhao and Sun 2009 (Theory) and Annen, Mertens, Bekaert, Seidel and
//! Kautz 2007 (CSM). Where a paper has a misprint, the item that implements the formula describes
//! it.
//!
//! # Two units
//!
//! W&P's error m is in pixels per texel. Theory's error E is the derivative of the image's
//! coordinates, each from −1 to 1, with respect to the map's, each from 0 to 1. So m = E ·
//! (res_i/2)/res_map, and a storage factor S̄ is M_q·M_p/4.
//!
//! # Other lights
//!
//! There are no closed forms for spot and point lights, for parallel light from any other side, for
//! bounded receivers or for maps of whole texels. [`aliasing`](crate::aliasing) gives the same
//! errors for any planned map at any point:
//! [`ShadowMap::perspective_error`](crate::ShadowMap::perspective_error) is the perspective error
//! m, and [`ShadowMap::surface_error`](crate::ShadowMap::surface_error) includes the projection
//! error.

mod lambda;
mod overhead;
mod step;
mod storage;
mod tilted;

pub use lambda::Rule;
pub use overhead::{Overhead, budget_split};
pub use step::{FourierStep, StepAt};
pub use storage::{LightFrom, storage_factor};
pub use tilted::{Errors, Extrema, Extreme, Extremum, Tilted, Warped};

use crate::error::{Error, check};

/// A square view frustum V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    near: f64,
    far: f64,
    half_fov_rad: f64,
}

impl View {
    /// A view frustum from its near and far distance n and f, metres, 1e-12 ≤ n < f ≤ 1e12, and
    /// half its field of view φ, radians, 1e-6 ..= π/2 − 1e-6.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.near`, `theory.far` or `theory.half_fov_rad`.
    pub fn new(near: f64, far: f64, half_fov_rad: f64) -> Result<Self, Error> {
        check(near >= 1e-12 && near.is_finite(), "theory.near", || {
            format!("must be finite and at least 1e-12 metres, is {near:?}")
        })?;
        check(far > near && far <= 1e12, "theory.far", || {
            format!("must exceed the near distance ({near}) and be at most 1e12 metres, is {far}")
        })?;
        let largest = std::f64::consts::FRAC_PI_2 - 1e-6;
        check((1e-6..=largest).contains(&half_fov_rad), "theory.half_fov_rad", || {
            format!("must lie between 0 and π/2 (90°), is {half_fov_rad}")
        })?;
        Ok(Self { near, far, half_fov_rad })
    }

    /// Near distance n, metres.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Far distance f, metres.
    pub fn far(&self) -> f64 {
        self.far
    }

    /// Half the field of view φ, radians.
    pub fn half_fov_rad(&self) -> f64 {
        self.half_fov_rad
    }

    /// tan φ.
    pub fn tan_phi(&self) -> f64 {
        self.half_fov_rad.tan()
    }

    /// Slice i of k self-similar slices along the view, counted from 0: n (f/n)^(i/k) to n
    /// (f/n)^((i+1)/k) (W&P Eqs. 15, 16).
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the field `theory.slices` unless i < k, or if f and n are so close
    /// that a slice has no depth.
    pub fn slice(&self, i: u32, k: u32) -> Result<Self, Error> {
        check(i < k, "theory.slices", || format!("there is no slice {i} of {k}"))?;
        let end = |i: u32| match i {
            _ if i == 0 => self.near,
            _ if i == k => self.far,
            _ => self.near * (self.far / self.near).powf(f64::from(i) / f64::from(k)),
        };
        let [near, far] = [end(i), end(i + 1)];
        check(near < far, "theory.slices", || {
            format!("{} to {} metres cannot be cut into {k} slices", self.near, self.far)
        })?;
        Ok(Self { near, far, ..*self })
    }
}

/// Checks that results are finite, which they are not where the numbers of `field` are so extreme
/// that the results exceed the largest numbers there are.
fn check_finite<const N: usize>(results: [f64; N], field: &'static str) -> Result<(), Error> {
    check(results.iter().all(|x| x.is_finite()), field, || {
        "must be finite and not so extreme that the result exceeds the largest number".into()
    })
}

/// Checks a warp's λ, metres, at least 1e-12, or infinite for no warp.
fn check_lambda(lambda: f64) -> Result<(), Error> {
    check(lambda >= 1e-12, "theory.lambda", || {
        format!(
            "must be a distance of at least 1e-12 metres, or infinite for no warp, is {lambda:?}"
        )
    })
}
