//! Combinations of a partition with a warp, and the storage factors that they need.

use crate::measured::{from_behind, plan};
use anyhow::Result;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use umbrage::theory::{LightFrom, Rule, View, storage_factor};
use umbrage::{Faces, Objective, Warp};

/// A combination of a partition with a warp (Lloyd et al. 2006).
pub(crate) struct Scheme {
    /// Name in charts and tables, which begins with the paper's abbreviation if it has one.
    pub(crate) name: &'static str,
    rule: Rule,
    warp: Warp,
    slices: u32,
    /// Whether maps serve faces of the view or the whole view.
    pub(crate) faces: Faces,
}

impl Scheme {
    /// Creates a scheme with LiSPSM's warp or none, and with maps for faces or for the whole view.
    pub(crate) fn new(name: &'static str, slices: u32, is_warped: bool, has_faces: bool) -> Self {
        let (rule, warp) = if is_warped {
            (Rule::LispsmInRange, Warp::Lispsm)
        } else {
            (Rule::Uniform, Warp::Uniform)
        };
        let faces = if has_faces { Faces::SidesAndNear } else { Faces::Whole };
        Self { name, rule, warp, slices, faces }
    }

    /// Creates a scheme with one map and the adaptive warp for least storage, which the paper does
    /// not have.
    pub(crate) fn adaptive(name: &'static str) -> Self {
        let objective = Objective::Storage;
        let (rule, warp) = (Rule::Adaptive(objective), Warp::Adaptive(objective));
        Self { name, rule, warp, slices: 1, faces: Faces::Whole }
    }

    /// Whether there is a closed form for the maps that the planner makes.
    pub(crate) fn has_formula(&self, view: View, light: LightFrom) -> bool {
        match (self.faces, light) {
            (Faces::Whole, LightFrom::Angle(theta)) => {
                // At smaller angles to the view's axis the planner fades the adaptive warp out.
                !matches!(self.rule, Rule::Adaptive(_))
                    || theta.sin() >= view.half_fov_rad().sin() / 4.0
            }
            (_, light) => !matches!(light, LightFrom::Angle(_)),
        }
    }

    /// The closed form of the storage factor, texels per pixel.
    pub(crate) fn formula(&self, view: View, light: LightFrom) -> Result<f64> {
        Ok(storage_factor(view, self.rule, self.slices, self.faces, light)?)
    }

    /// The storage factor of planned maps in parallel light of this direction, texels per pixel.
    pub(crate) fn measured(&self, view: View, direction: DVec3) -> Result<f64> {
        Ok(plan(view, direction, self.warp, self.slices, self.faces)?.storage_factor())
    }

    /// The closed form and the planned maps' storage factor, under a light that has a closed form.
    pub(crate) fn both(&self, view: View, light: LightFrom) -> Result<[f64; 2]> {
        let theta = match light {
            LightFrom::Overhead => FRAC_PI_2,
            LightFrom::Behind => 0.0,
            LightFrom::Angle(theta) => theta,
        };
        Ok([self.formula(view, light)?, self.measured(view, from_behind(theta))?])
    }
}

/// A view with φ = 30° and its near plane at 1 m, as in the paper's figures.
pub(crate) fn paper_view(far: f64) -> Result<View> {
    Ok(View::new(1.0, far, 30_f64.to_radians())?)
}
