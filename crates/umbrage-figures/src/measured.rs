//! Plans views with the library's planner, so that figures can compare its errors with the closed
//! forms.

use anyhow::Result;
use glam::DVec3;
use umbrage::aliasing::PointError;
use umbrage::theory::View;
use umbrage::{
    Bounds, Camera, Faces, Light, LookAt, Partition, Plan, Planner, Size, Technique, Warp,
};

/// A camera with a square image of one pixel that looks along −z with y up. With a map of one texel
/// its errors equal those of formulas that leave out the resolutions.
pub(crate) fn camera(view: View) -> Result<Camera> {
    camera_of(view, 1)
}

/// The same camera with an image of `side` × `side` pixels.
pub(crate) fn camera_of(view: View, side: u32) -> Result<Camera> {
    Ok(Camera::look_at(LookAt {
        eye: DVec3::ZERO,
        target: DVec3::NEG_Z,
        up: DVec3::Y,
        fov_y_rad: 2.0 * view.half_fov_rad(),
        near: view.near(),
        far: view.far(),
        image: [side; 2],
    })?)
}

/// The direction of light that comes from above and behind the viewer, at an angle θ to the view
/// direction.
pub(crate) fn from_behind(theta_rad: f64) -> DVec3 {
    // In floating point, the cosine of 90° is not exactly 0.
    let (sin, cos) =
        if theta_rad == std::f64::consts::FRAC_PI_2 { (1.0, 0.0) } else { theta_rad.sin_cos() };
    DVec3::new(0.0, -sin, -cos)
}

/// Plans maps of one texel for a whole view in parallel light of this direction. The view is cut
/// into self-similar slices and, if `faces` asks for it, into faces.
pub(crate) fn plan(
    view: View,
    direction: DVec3,
    warp: Warp,
    slices: u32,
    faces: Faces,
) -> Result<Plan> {
    let technique = Technique {
        warp,
        partition: Partition { faces, ..Partition::slices(slices) },
        size: Size::Exact([1; 2]),
        ..Technique::default()
    };
    let light = Light::Directional { direction };
    Ok(Planner::new().plan(&camera(view)?, &[light], &Bounds::default(), &technique)?.clone())
}

/// The perspective error of a plan's first map in the centre of the view at distance `z`, pixels
/// per texel.
pub(crate) fn error_at(plan: &Plan, view: View, z: f64) -> Result<PointError> {
    plan.maps[0]
        .perspective_error(&camera(view)?, DVec3::NEG_Z * z)
        .ok_or_else(|| anyhow::anyhow!("the map does not serve the view {z} m away"))
}
