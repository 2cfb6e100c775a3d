//! Plans shadow maps and states their errors E in the units and axes of Theory (Zhang et al. 2009).
//! The light direction lies in the plane of the view's y axis and direction.

use crate::measured;
use anyhow::{Result, ensure};
use glam::DVec3;
use std::f64::consts::PI;
use umbrage::theory::{Errors, Rule, View};
use umbrage::{Camera, Faces, Plan, ShadowMap, Warp};

/// The direction of light that comes from above and, for θ < 90°, from in front of the viewer. In
/// this case errors are large at the lower side of V.
pub(crate) fn from_before(theta_rad: f64) -> DVec3 {
    measured::from_behind(PI - theta_rad)
}

/// The planner's warp for a rule. Rules that the planner has no warp for become [`Warp::Lambda`].
pub(crate) fn warp(rule: Rule, lambda: f64) -> Warp {
    match rule {
        Rule::Uniform => Warp::Uniform,
        Rule::Psm => Warp::Psm,
        Rule::LispsmInRange => Warp::Lispsm,
        Rule::Tsm { focus } => Warp::Tsm { focus },
        Rule::Adaptive(objective) => Warp::Adaptive(objective),
        Rule::Log => Warp::Log,
        _ => Warp::Lambda(lambda),
    }
}

/// The plan with one map for one view and one light.
pub(crate) struct Planned {
    camera: Camera,
    plan: Plan,
}

impl Planned {
    pub(crate) fn new(view: View, theta_rad: f64, warp: Warp) -> Result<Self> {
        let plan = measured::plan(view, from_before(theta_rad), warp, 1, Faces::Whole)?;
        ensure!(!plan.maps[0].is_empty(), "the planner found nothing in the view");
        Ok(Self { camera: measured::camera(view)?, plan })
    }

    fn map(&self) -> &ShadowMap {
        &self.plan.maps[0]
    }

    /// λ, metres; infinite if the map has no warp.
    pub(crate) fn lambda(&self) -> f64 {
        self.map().lambda.unwrap_or(f64::INFINITY)
    }

    /// The errors E_q and E_p at (y, z) in the plane x = 0, from the Jacobian of the map's matrix.
    /// They are NaN where the map does not apply.
    pub(crate) fn errors(&self, y: f64, z: f64) -> Errors {
        let m = self.map().perspective_error(&self.camera, DVec3::new(0.0, y, -z));
        // For an image of one pixel and a map of one texel, E is twice the error m.
        m.map_or(Errors { q: f64::NAN, p: f64::NAN }, |m| Errors { q: 2.0 * m.s, p: 2.0 * m.t })
    }

    /// The largest errors over V, M_q and M_p, as the plan states them.
    pub(crate) fn largest(&self) -> Errors {
        let error = self.map().error;
        Errors { q: 2.0 * error.max_s, p: 2.0 * error.max_t }
    }

    /// The largest E_q·E_p at any one point of V, which lies at a corner of V (Theory §3.1).
    pub(crate) fn largest_product(&self, view: View) -> f64 {
        let corners =
            [view.near(), view.far()].into_iter().flat_map(|z| [-z, z].map(|side| (side, z)));
        corners.map(|(y, z)| self.errors(y * view.tan_phi(), z).product()).fold(0.0, f64::max)
    }
}
