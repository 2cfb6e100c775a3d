//! Combinations of partitions and warps, and the texels that they need.

use crate::measured::{from_behind, plan};
use anyhow::Result;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use umbrage::theory::{LightFrom, Rule, View, storage_factor};
use umbrage::{Faces, Objective, Warp};

/// A way to make maps, as the paper names them.
pub(crate) struct Scheme {
    /// What the paper calls it.
    pub(crate) name: &'static str,
    rule: Rule,
    warp: Warp,
    slices: u32,
    /// Whether it has maps for faces of the view.
    pub(crate) faces: Faces,
}

impl Scheme {
    /// With LiSPSM's warp or none, and with maps for faces or for the whole view.
    pub(crate) fn new(name: &'static str, slices: u32, is_warped: bool, has_faces: bool) -> Self {
        let (rule, warp) = if is_warped {
            (Rule::LispsmInRange, Warp::Lispsm)
        } else {
            (Rule::Uniform, Warp::Uniform)
        };
        let faces = if has_faces { Faces::SidesAndNear } else { Faces::Whole };
        Self { name, rule, warp, slices, faces }
    }

    /// The warp that needs the fewest texels, not the paper's.
    pub(crate) fn adaptive(name: &'static str) -> Self {
        let objective = Objective::Storage;
        let (rule, warp) = (Rule::Adaptive(objective), Warp::Adaptive(objective));
        Self { name, rule, warp, slices: 1, faces: Faces::Whole }
    }

    /// Whether there is a closed form of what the planner does.
    pub(crate) fn has_formula(&self, view: View, light: LightFrom) -> bool {
        match (self.faces, light) {
            (Faces::Whole, LightFrom::Angle(theta)) => {
                // Nearer the view's axis the planner fades the warp out.
                !matches!(self.rule, Rule::Adaptive(_))
                    || theta.sin() >= view.half_fov_rad().sin() / 4.0
            }
            (_, light) => !matches!(light, LightFrom::Angle(_)),
        }
    }

    /// Texels per pixel by the closed form.
    pub(crate) fn formula(&self, view: View, light: LightFrom) -> Result<f64> {
        Ok(storage_factor(view, self.rule, self.slices, self.faces, light)?)
    }

    /// Texels per pixel of maps that are planned, in parallel light of this direction.
    pub(crate) fn measured(&self, view: View, direction: DVec3) -> Result<f64> {
        Ok(plan(view, direction, self.warp, self.slices, self.faces)?.storage_factor())
    }

    /// Both under a light that the paper has formulas for.
    pub(crate) fn both(&self, view: View, light: LightFrom) -> Result<[f64; 2]> {
        let theta = match light {
            LightFrom::Overhead => FRAC_PI_2,
            LightFrom::Behind => 0.0,
            LightFrom::Angle(theta) => theta,
        };
        Ok([self.formula(view, light)?, self.measured(view, from_behind(theta))?])
    }
}

/// A view of φ = 30° that begins at 1.
pub(crate) fn paper_view(far: f64) -> Result<View> {
    Ok(View::new(1.0, far, 30_f64.to_radians())?)
}
