//! Loads cameras and lights.

use super::document::{Document, Notices};
use crate::animation::{Optics, Shine};
use crate::error::SceneError;
use crate::types::{Lens, SceneCamera, SceneLight};
use glam::{DAffine3, Vec3};
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;
use gltf::json::{Index, camera};
use umbrage::Aabb;

/// Largest half angle of a spot light's cone, radians: that of glTF and of
/// [`SpotLight::half_angle_rad`](umbrage::SpotLight::half_angle_rad).
const MAX_HALF_ANGLE_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// The camera of a node with its optics, or `None` with a notice if it is not a supported camera.
/// `bounds` are those of the scene; they end the view of a camera without a far distance.
pub(super) fn load_camera(
    document: &Document,
    index: Index<camera::Camera>,
    node_name: Option<&str>,
    world_from_node: &DAffine3,
    bounds: Aabb,
    notices: &mut Notices,
) -> Result<Option<(SceneCamera, Optics)>, SceneError> {
    let place = format!("cameras[{}]", index.value());
    let json = document.get(index, &place)?;
    let optics = match (&json.perspective, &json.orthographic) {
        (Some(perspective), _) => {
            let fov_y_rad = f64::from(perspective.yfov);
            let (near, far) = (f64::from(perspective.znear), perspective.zfar.map(f64::from));
            let valid = fov_y_rad > 0.0 && fov_y_rad < std::f64::consts::PI - 1e-6 && near > 0.0;
            if !(valid && near.is_finite() && far.is_none_or(|far| far > near && far.is_finite())) {
                notices.add(&place, "needs 0 < yfov < π and 0 < znear < zfar, left out");
                return Ok(None);
            }
            Optics { lens: Lens::Perspective { fov_y_rad }, near, far }
        }
        // The picture's size decides the aspect ratio, as for perspective cameras.
        (None, Some(orthographic)) => {
            let height = 2.0 * f64::from(orthographic.ymag);
            let (near, far) = (f64::from(orthographic.znear), f64::from(orthographic.zfar));
            if !(height >= 1e-9 && near >= 0.0 && far > near && height.max(far).is_finite()) {
                notices.add(&place, "needs 0 < ymag and 0 ≤ znear < zfar, left out");
                return Ok(None);
            }
            Optics { lens: Lens::Orthographic { height }, near, far: Some(far) }
        }
        (None, None) => {
            notices.add(&place, "is neither a perspective nor an orthographic camera, left out");
            return Ok(None);
        }
    };
    let Some(mut camera) = optics.camera(world_from_node, bounds) else {
        notices.add(&place, NO_DIRECTION);
        return Ok(None);
    };
    camera.name = json.name.as_deref().or(node_name).unwrap_or_default().into();
    Ok(Some((camera, optics)))
}

const NO_DIRECTION: &str = "its node has no direction (scale 0), left out";

/// The light of a node and how it shines, or `None` with a notice if it has no direction.
pub(super) fn load_light(
    document: &Document,
    index: usize,
    node_name: Option<&str>,
    world_from_node: &DAffine3,
    bounds: Aabb,
    notices: &mut Notices,
) -> Result<Option<(SceneLight, Shine)>, SceneError> {
    let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let lights = document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let Some(json) = lights.and_then(|l| l.lights.get(index)) else {
        return Err(document.invalid(&place, "does not exist, but a node refers to it"));
    };
    let Checked::Valid(kind) = json.type_ else {
        return Err(document.invalid(&place, "type must be directional, point or spot"));
    };
    let color = Vec3::from(json.color);
    if !color.is_finite() || !json.intensity.is_finite() || json.range.is_some_and(f32::is_nan) {
        return Err(document.invalid(&place, "colour, intensity or range is not finite"));
    }
    let range = json.range.map(f64::from).filter(|&range| range > 0.0);
    let shine = match kind {
        Type::Point => Shine::Point { range },
        Type::Directional => Shine::Directional,
        Type::Spot => {
            let Some(cone) = &json.spot else {
                return Err(document.invalid(&place, "is a spot light without a cone"));
            };
            let outer = f64::from(cone.outer_cone_angle);
            // In single precision 90° is a little more than in double precision.
            if !(outer > 0.0 && outer <= MAX_HALF_ANGLE_RAD + 1e-6) {
                notices.add(&place, "outerConeAngle must be above 0° and at most 90°, clamped");
            }
            Shine::Spot { half_angle_rad: outer.clamp(1e-3, MAX_HALF_ANGLE_RAD), range }
        }
    };
    let Some(light) = shine.light(world_from_node, bounds) else {
        notices.add(&place, NO_DIRECTION);
        return Ok(None);
    };
    let color = color.max(Vec3::ZERO);
    let brightest = color.max_element();
    let light = SceneLight {
        name: json.name.as_deref().or(node_name).unwrap_or_default().into(),
        light,
        color: if brightest > 0.0 { color / brightest } else { Vec3::ONE },
        intensity: (json.intensity * brightest).max(0.0),
    };
    Ok(Some((light, shine)))
}
