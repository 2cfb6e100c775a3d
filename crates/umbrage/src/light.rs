use crate::bounds::Plane;
use crate::error::{Error, check, check_position, unit};
use crate::math::perpendicular_pair;
use crate::plan::CubeSide;
use glam::DVec3;

/// A light that casts shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light, such as sunlight.
    Directional {
        /// Direction in which the light travels, of any non-zero length.
        direction: DVec3,
    },
    /// A cone of light from one point.
    Spot(SpotLight),
    /// Light from one point in all directions.
    Point(PointLight),
}

/// Light from one point in all directions. Its maps are those of six spot lights, one through each
/// side of a cube aligned with the world's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Position in world space, metres.
    pub position: DVec3,
    /// Distance from the light, along the nearest world axis, at which shadows begin, metres, ≥
    /// 1e-12. Receivers nearer than this get no shadow; casters nearer than this cast shadows onto
    /// receivers beyond.
    pub near: f64,
    /// Distance along the nearest world axis at which the light ends, metres, > `near`.
    pub range: f64,
}

/// A cone of light from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// Position in world space, metres.
    pub position: DVec3,
    /// Axis of the cone: the direction in which the light travels, of any non-zero length.
    pub direction: DVec3,
    /// Half the cone's opening angle, radians, in (0, 85°]. Points outside the cone are not lit.
    pub half_angle_rad: f64,
    /// Distance from the light along the axis at which shadows begin, metres, ≥ 1e-12. Receivers
    /// nearer than this get no shadow; casters nearer than this cast shadows onto receivers beyond.
    pub near: f64,
    /// Distance along the axis at which the light ends, metres, > `near`.
    pub range: f64,
}

impl Light {
    /// Unit vector from a world point towards the light. At the position of a spot light it is
    /// opposite to the axis, at that of a point light +y.
    pub fn direction_to_light(&self, world_position: DVec3) -> DVec3 {
        match self {
            Self::Directional { direction } => -direction.normalize_or_zero(),
            Self::Spot(spot) => (spot.position - world_position)
                .try_normalize()
                .unwrap_or_else(|| -spot.direction.normalize_or_zero()),
            Self::Point(point) => {
                (point.position - world_position).try_normalize().unwrap_or(DVec3::Y)
            }
        }
    }

    /// Position of a spot or point light in world space, metres; `None` for a directional light.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Directional { .. } => None,
            Self::Spot(spot) => Some(spot.position),
            Self::Point(point) => Some(point.position),
        }
    }

    /// The projections that make up the light, each with its own maps: six pyramids for a point
    /// light, one projector for any other light. The light must have been [checked](Self::checked).
    pub(crate) fn projectors(self) -> impl Iterator<Item = (Option<CubeSide>, Projector)> {
        let is_point = matches!(self, Self::Point(_));
        (0..if is_point { 6 } else { 1 }).map(move |i| {
            let side = is_point.then(|| CubeSide::ALL[i]);
            let projector = match self {
                Self::Directional { direction } => Projector::Directional { direction },
                Self::Spot(SpotLight { position, direction, half_angle_rad, near, range }) => {
                    Projector::Pyramid {
                        position,
                        direction,
                        slope: half_angle_rad.tan(),
                        near,
                        range,
                    }
                }
                Self::Point(PointLight { position, near, range }) => {
                    let direction = side.map_or(DVec3::Y, CubeSide::direction);
                    Projector::Pyramid { position, direction, slope: 1.0, near, range }
                }
            };
            (side, projector)
        })
    }

    /// The same light with unit directions, or an error that names the field at fault.
    pub(crate) fn checked(&self) -> Result<Self, Error> {
        let check_point = |position: DVec3, near: f64, range: f64| {
            check_position(position, "light.position")?;
            check(near >= 1e-12 && near.is_finite(), "light.near", || {
                format!("must be finite and at least 1e-12, is {near}")
            })?;
            check(range > near && range <= 1e12, "light.range", || {
                format!("must exceed light.near ({near}) and be at most 1e12, is {range}")
            })
        };
        match *self {
            Self::Directional { direction } => {
                Ok(Self::Directional { direction: unit(direction, "light.direction")? })
            }
            Self::Spot(spot) => {
                check_point(spot.position, spot.near, spot.range)?;
                let max = 85f64.to_radians();
                check(
                    spot.half_angle_rad > 0.0 && spot.half_angle_rad <= max,
                    "light.half_angle_rad",
                    || format!("must lie in (0, {max:.4}] (85°), is {}", spot.half_angle_rad),
                )?;
                let direction = unit(spot.direction, "light.direction")?;
                Ok(Self::Spot(SpotLight { direction, ..spot }))
            }
            Self::Point(point) => {
                check_point(point.position, point.near, point.range).map(|()| *self)
            }
        }
    }
}

impl CubeSide {
    /// All six sides.
    pub const ALL: [Self; 6] =
        [Self::PosX, Self::NegX, Self::PosY, Self::NegY, Self::PosZ, Self::NegZ];

    /// Unit vector from the light through the middle of the side.
    pub fn direction(self) -> DVec3 {
        match self {
            Self::PosX => DVec3::X,
            Self::NegX => DVec3::NEG_X,
            Self::PosY => DVec3::Y,
            Self::NegY => DVec3::NEG_Y,
            Self::PosZ => DVec3::Z,
            Self::NegZ => DVec3::NEG_Z,
        }
    }
}

/// Light that one projection covers: a parallel beam or a pyramid, with a unit direction.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Projector {
    Directional {
        direction: DVec3,
    },
    /// Light from one point into a pyramid with a square base. `slope` is half the width of the
    /// base over the height.
    Pyramid {
        position: DVec3,
        direction: DVec3,
        slope: f64,
        near: f64,
        range: f64,
    },
}

/// A pyramid's near distance, increased where it would vanish by rounding among coordinates as
/// large as `size`, metres: no map is defined at the apex itself.
fn near_end(near: f64, apex: DVec3, size: f64) -> f64 {
    near.max(1e-11 * apex.length().max(size))
}

impl Projector {
    /// Direction in which the light travels, and for a pyramid the position of its apex relative to
    /// `origin` (world space).
    pub(crate) fn direction_and_apex(&self, origin: DVec3) -> (DVec3, Option<DVec3>) {
        match *self {
            Self::Directional { direction } => (direction, None),
            Self::Pyramid { position, direction, .. } => (direction, Some(position - origin)),
        }
    }

    /// A pyramid's four side planes, then its near and its far plane, relative to `origin` (world
    /// space); `None` for parallel light. `size` is the largest coordinate of what the planes are
    /// to clip, metres.
    pub(crate) fn frustum(&self, origin: DVec3, size: f64) -> Option<[Plane; 6]> {
        let Self::Pyramid { position, direction: axis, slope, near, range } = *self else {
            return None;
        };
        let apex = position - origin;
        let (a, b) = perpendicular_pair(axis).into();
        let side = |d: DVec3| Plane::through(apex, (axis * slope + d).normalize());
        Some([
            side(a),
            side(-a),
            side(b),
            side(-b),
            Plane::through(apex + axis * near_end(near, apex, size), axis),
            Plane::through(apex + axis * range, -axis),
        ])
    }

    /// Corners of a pyramid at its near and its far plane, relative to `origin` (world space);
    /// `None` for parallel light.
    pub(crate) fn corners(&self, origin: DVec3) -> Option<[DVec3; 8]> {
        let Self::Pyramid { position, direction, slope, near, range } = *self else {
            return None;
        };
        let apex = position - origin;
        let (a, b) = perpendicular_pair(direction).into();
        Some(std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { slope } else { -slope };
            let depth = if i >> 2 & 1 == 1 { range } else { near_end(near, apex, 0.0) };
            apex + (direction + a * sign(0) + b * sign(1)) * depth
        }))
    }
}
