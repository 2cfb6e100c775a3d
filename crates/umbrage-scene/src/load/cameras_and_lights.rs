//! Loads cameras and lights.

use super::document::{Document, Notices};
use crate::error::SceneError;
use crate::types::{Lens, SceneCamera, SceneLight};
use glam::{DAffine3, DVec3, Vec3};
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;
use gltf::json::{Index, camera};
use umbrage::{Aabb, Light, PointLight, SpotLight};

/// Largest half angle of a spot light's cone, radians: that of glTF and of
/// [`SpotLight::half_angle_rad`].
const MAX_HALF_ANGLE_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// Ratio of the near distance, where the shadows of a spot or point light begin, to its range: a
/// centimetre for a range of 10 m.
const NEAR_SHARE: f64 = 1e-3;

/// Smallest and largest range of a spot or point light, metres. The planner accepts the near
/// distances of these ranges, and the largest range is the end of its world.
const RANGES: [f64; 2] = [1e-9, 1e12];

/// The camera of a node, or `None` with a notice if it is not a supported camera. `bounds` are
/// those of the scene; they end the view of a camera without a far distance.
pub(super) fn load_camera(
    document: &Document,
    index: Index<camera::Camera>,
    node_name: Option<&str>,
    world_from_node: &DAffine3,
    bounds: Aabb,
    notices: &mut Notices,
) -> Result<Option<SceneCamera>, SceneError> {
    let place = format!("cameras[{}]", index.value());
    let json = document.get(index, &place)?;
    let m = world_from_node.matrix3;
    let (Some(forward), Some(up)) = ((-m.z_axis).try_normalize(), m.y_axis.try_normalize()) else {
        notices.add(&place, "its node has no direction (scale 0), left out");
        return Ok(None);
    };
    let eye = world_from_node.translation;
    let (lens, near, far) = match (&json.perspective, &json.orthographic) {
        (Some(perspective), _) => {
            let (fov_y_rad, near) = (f64::from(perspective.yfov), f64::from(perspective.znear));
            let far = match perspective.zfar {
                Some(far) => f64::from(far),
                None => farthest(bounds, |p| forward.dot(p - eye)).max(2.0 * near),
            };
            let valid = fov_y_rad > 0.0 && fov_y_rad < std::f64::consts::PI - 1e-6 && near > 0.0;
            if !(valid && far > near && far.is_finite()) {
                notices.add(&place, "needs 0 < yfov < π and 0 < znear < zfar, left out");
                return Ok(None);
            }
            (Lens::Perspective { fov_y_rad }, near, far)
        }
        // The picture's size decides the aspect ratio, as for perspective cameras.
        (None, Some(orthographic)) => {
            let height = 2.0 * f64::from(orthographic.ymag);
            let (near, far) = (f64::from(orthographic.znear), f64::from(orthographic.zfar));
            if !(height >= 1e-9 && near >= 0.0 && far > near && height.max(far).is_finite()) {
                notices.add(&place, "needs 0 < ymag and 0 ≤ znear < zfar, left out");
                return Ok(None);
            }
            (Lens::Orthographic { height }, near, far)
        }
        (None, None) => {
            notices.add(&place, "is neither a perspective nor an orthographic camera, left out");
            return Ok(None);
        }
    };
    Ok(Some(SceneCamera {
        name: json.name.as_deref().or(node_name).unwrap_or_default().into(),
        eye,
        // The target is as far away as the far distance, so that the direction survives rounding
        // anywhere.
        target: eye + forward * far,
        up,
        lens,
        near,
        far,
    }))
}

/// The light of a node, or `None` with a notice if it has no direction.
pub(super) fn load_light(
    document: &Document,
    index: usize,
    node_name: Option<&str>,
    world_from_node: &DAffine3,
    bounds: Aabb,
    notices: &mut Notices,
) -> Result<Option<SceneLight>, SceneError> {
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
    let direction = (-world_from_node.matrix3.z_axis).try_normalize();
    let position = world_from_node.translation;
    let [near, range] = near_and_range(json.range, farthest(bounds, |p| p.distance(position)));
    let light = match (kind, direction) {
        (Type::Point, _) => Light::Point(PointLight { position, near, range }),
        (_, None) => {
            notices.add(&place, "its node has no direction (scale 0), left out");
            return Ok(None);
        }
        (Type::Directional, Some(direction)) => Light::Directional { direction },
        (Type::Spot, Some(direction)) => {
            let Some(cone) = &json.spot else {
                return Err(document.invalid(&place, "is a spot light without a cone"));
            };
            let outer = f64::from(cone.outer_cone_angle);
            // In single precision 90° is a little more than in double precision.
            if !(outer > 0.0 && outer <= MAX_HALF_ANGLE_RAD + 1e-6) {
                notices.add(&place, "outerConeAngle must be above 0° and at most 90°, clamped");
            }
            let half_angle_rad = outer.clamp(1e-3, MAX_HALF_ANGLE_RAD);
            Light::Spot(SpotLight { position, direction, half_angle_rad, near, range })
        }
    };
    let color = color.max(Vec3::ZERO);
    let brightest = color.max_element();
    Ok(Some(SceneLight {
        name: json.name.as_deref().or(node_name).unwrap_or_default().into(),
        light,
        color: if brightest > 0.0 { color / brightest } else { Vec3::ONE },
        intensity: (json.intensity * brightest).max(0.0),
    }))
}

/// The near distance, where the shadows of a spot or point light begin, and the distance where its
/// light ends, metres. A light without a range reaches all of the scene, which extends to `reach`
/// metres from the light. A range beyond `reach` does not make shadows begin any later.
fn near_and_range(range: Option<f32>, reach: f64) -> [f64; 2] {
    let [least, most] = RANGES;
    let reach = reach.clamp(1e-3, most);
    let range = match range.map(f64::from) {
        Some(range) if range > 0.0 => range.clamp(least, most),
        _ => reach,
    };
    [range.min(reach) * NEAR_SHARE, range]
}

/// The largest value that `distance` has in a box, increased by 1%.
fn farthest(bounds: Aabb, distance: impl Fn(DVec3) -> f64) -> f64 {
    bounds.corners().into_iter().map(distance).fold(0.0, f64::max) * 1.01
}
