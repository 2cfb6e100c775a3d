use crate::bounds::Plane;
use crate::error::{Error, check, check_position, unit};
use crate::math::perpendicular_pair;
use glam::DVec3;

/// A light that casts shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light, such as the sun's.
    Directional {
        /// The way the light travels; any non-zero length.
        direction: DVec3,
    },
    /// A cone of light from one point.
    Spot(SpotLight),
}

/// A cone of light from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// World space, metres.
    pub position: DVec3,
    /// Axis of the cone, the way the light travels; any non-zero length.
    pub direction: DVec3,
    /// Half the cone's opening angle, radians, in (0, 85°]. Nothing outside is lit.
    pub half_angle_rad: f64,
    /// Distance from the light, measured along the axis, at which shadows begin, metres, ≥ 1e-12.
    /// Receivers nearer than this get no shadow; casters nearer than this cast onto those beyond.
    pub near: f64,
    /// Distance along the axis at which light ends, metres, > `near`.
    pub range: f64,
}

impl SpotLight {
    /// Corners of the pyramid frustum around the cone, relative to `origin` (world space). The
    /// light's direction must have unit length.
    pub(crate) fn corners(&self, origin: DVec3) -> [DVec3; 8] {
        let apex = self.position - origin;
        let (a, b) = perpendicular_pair(self.direction).into();
        let slope = self.half_angle_rad.tan();
        std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { slope } else { -slope };
            let depth = if i >> 2 & 1 == 1 { self.range } else { self.near };
            apex + (self.direction + a * sign(0) + b * sign(1)) * depth
        })
    }
}

impl Light {
    /// Unit vector from a world point towards the light. At a spot light's own position the
    /// direction against its axis.
    pub fn direction_to_light(&self, world_position: DVec3) -> DVec3 {
        match self {
            Self::Directional { direction } => -direction.normalize_or_zero(),
            Self::Spot(spot) => (spot.position - world_position)
                .try_normalize()
                .unwrap_or_else(|| -spot.direction.normalize_or_zero()),
        }
    }

    /// Planes around all that a spot light can shine on, relative to `origin` (world space); none for
    /// directional lights. The light's direction must have unit length.
    pub(crate) fn frustum(&self, origin: DVec3) -> Option<[Plane; 6]> {
        let Self::Spot(spot) = self else { return None };
        let apex = spot.position - origin;
        let axis = spot.direction;
        let (sin, cos) = spot.half_angle_rad.sin_cos();
        let (a, b) = perpendicular_pair(axis).into();
        let side = |d: DVec3| Plane::through(apex, axis * sin + d * cos);
        Some([
            side(a),
            side(-a),
            side(b),
            side(-b),
            Plane::through(apex + axis * spot.near, axis),
            Plane::through(apex + axis * spot.range, -axis),
        ])
    }

    /// The same light with unit directions, or what is wrong with it.
    pub(crate) fn checked(&self) -> Result<Self, Error> {
        match *self {
            Self::Directional { direction } => {
                Ok(Self::Directional { direction: unit(direction, "light.direction")? })
            }
            Self::Spot(spot) => {
                check_position(spot.position, "light.position")?;
                let max = 85f64.to_radians();
                check(
                    spot.half_angle_rad > 0.0 && spot.half_angle_rad <= max,
                    "light.half_angle_rad",
                    || format!("must lie in (0, {max:.4}] (85°), is {}", spot.half_angle_rad),
                )?;
                check(spot.near >= 1e-12 && spot.near.is_finite(), "light.near", || {
                    format!("must be finite and at least 1e-12, is {}", spot.near)
                })?;
                check(spot.range > spot.near && spot.range <= 1e12, "light.range", || {
                    format!(
                        "must exceed light.near ({}) and be at most 1e12, is {}",
                        spot.near, spot.range
                    )
                })?;
                Ok(Self::Spot(SpotLight {
                    direction: unit(spot.direction, "light.direction")?,
                    ..spot
                }))
            }
        }
    }
}
