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

/// A cone of light from one point. A [wide](Self::is_wide) one is a part of a [`PointLight`]: it
/// has the six maps of one, and its distances count as those of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// Position in world space, metres.
    pub position: DVec3,
    /// Axis of the cone: the direction in which the light travels, of any non-zero length.
    pub direction: DVec3,
    /// Half the cone's opening angle, radians, in (0, 90°]. Points outside the cone are not lit.
    pub half_angle_rad: f64,
    /// Distance from the light along the axis at which shadows begin, metres, ≥ 1e-12. Receivers
    /// nearer than this get no shadow; casters nearer than this cast shadows onto receivers beyond.
    /// For a wide light it is the distance along the nearest world axis.
    pub near: f64,
    /// Distance along the axis at which the light ends, metres, > `near`. For a wide light it is
    /// the distance from the light.
    pub range: f64,
}

impl SpotLight {
    /// The largest half angle of a spot light with one map, radians: 75°. One map of a wider cone
    /// would need six times the texels of six maps for the same error at the cone's axis: their
    /// number grows as the square of the half angle's tangent, without end at 90°.
    pub const LARGEST_OF_ONE_MAP_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;

    /// Whether the cone is too wide for one map, so that the light has six, as a point light.
    pub fn is_wide(&self) -> bool {
        self.half_angle_rad > Self::LARGEST_OF_ONE_MAP_RAD
    }

    /// Distance of a world point along the axis, metres.
    fn depth(&self, world_position: DVec3) -> f64 {
        self.direction.normalize_or_zero().dot(world_position - self.position)
    }
}

impl Light {
    /// Whether shadows fall at a world point: whether the point lies no nearer to the light than
    /// the light's `near` distance.
    pub fn casts_at(&self, world_position: DVec3) -> bool {
        match (self.as_point(), self) {
            (Some(point), _) => (world_position - point.position).abs().max_element() >= point.near,
            (None, Self::Spot(spot)) => spot.depth(world_position) >= spot.near,
            (None, _) => true,
        }
    }

    /// Distance of a world point from the light as a share of the light's `range`: the light ends
    /// at 1. It is 0 under parallel light.
    pub fn share_of_range(&self, world_position: DVec3) -> f64 {
        match (self.as_point(), self) {
            (Some(point), _) => world_position.distance(point.position) / point.range,
            (None, Self::Spot(spot)) => spot.depth(world_position) / spot.range,
            (None, _) => 0.0,
        }
    }

    /// The point light whose maps and distances the light has: itself, or the one that a
    /// [wide](SpotLight::is_wide) spot light is a part of.
    fn as_point(&self) -> Option<PointLight> {
        match *self {
            Self::Spot(spot) if spot.is_wide() => {
                let SpotLight { position, near, range, .. } = spot;
                Some(PointLight { position, near, range })
            }
            Self::Point(point) => Some(point),
            _ => None,
        }
    }

    /// Whether the light reaches a world point where nothing lies between them: whether the point
    /// lies within the light's range and, under a spot light, within its cone.
    pub fn reaches(&self, world_position: DVec3) -> bool {
        let is_in_cone = match self {
            Self::Spot(spot) => {
                let axis = spot.direction.normalize_or_zero();
                -axis.dot(self.direction_to_light(world_position)) >= spot.half_angle_rad.cos()
            }
            _ => true,
        };
        is_in_cone && self.share_of_range(world_position) <= 1.0
    }

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

    /// The sides of the cube through which the light's maps look, one for each projector; `None`
    /// for the projector of a light without a cube.
    pub(crate) fn sides(&self) -> &'static [Option<CubeSide>] {
        const OF_CUBE: [Option<CubeSide>; 6] = {
            let [a, b, c, d, e, f] = CubeSide::ALL;
            [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)]
        };
        if self.as_point().is_some() { &OF_CUBE } else { &[None] }
    }

    /// The projection through one of the light's [sides](Self::sides). The light must have been
    /// [checked](Self::checked).
    pub(crate) fn projector(&self, side: Option<CubeSide>) -> Projector {
        match *self {
            Self::Directional { direction } => Projector::Directional { direction },
            Self::Spot(SpotLight { position, direction, half_angle_rad, near, range }) => {
                let slope = half_angle_rad.tan();
                match side.map(CubeSide::direction) {
                    None => {
                        Projector::Pyramid { position, direction, slope, near, range, cone: None }
                    }
                    Some(through) => Projector::Pyramid {
                        position,
                        direction: through,
                        slope: 1.0,
                        near,
                        range,
                        cone: Some(Cone { axis: direction, slope }),
                    },
                }
            }
            Self::Point(PointLight { position, near, range }) => {
                let direction = side.map_or(DVec3::Y, CubeSide::direction);
                Projector::Pyramid { position, direction, slope: 1.0, near, range, cone: None }
            }
        }
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
                let max = std::f64::consts::FRAC_PI_2;
                check(
                    spot.half_angle_rad > 0.0 && spot.half_angle_rad <= max,
                    "light.half_angle_rad",
                    || format!("must lie in (0, π/2] (90°), is {}", spot.half_angle_rad),
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
    /// base over the height. Only what lies within the cone, if there is one, is lit.
    Pyramid {
        position: DVec3,
        direction: DVec3,
        slope: f64,
        near: f64,
        range: f64,
        cone: Option<Cone>,
    },
}

/// A cone of light around an axis of unit length, with the tangent of its half angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    axis: DVec3,
    slope: f64,
}

/// The half-spaces of a pyramid around an axis, whose sides rise by `slope` from the axis.
fn side_planes(apex: DVec3, axis: DVec3, slope: f64) -> [Plane; 4] {
    let [a, b] = perpendicular_pair(axis);
    [a, -a, b, -b].map(|d| Plane::through(apex, (axis * slope + d).normalize()))
}

/// A pyramid's near distance, increased where too few of its digits would be left among coordinates
/// as large as `size`, metres: nearer to the apex, corners have no certain direction from it.
fn near_end(near: f64, apex: DVec3, size: f64) -> f64 {
    near.max(1e-9 * apex.length().max(size))
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

    /// Sets the planes around a pyramid, relative to `origin` (world space); none for parallel
    /// light. `size` is the largest coordinate of what the planes are to clip, metres.
    pub(crate) fn frustum(&self, planes: &mut Vec<Plane>, origin: DVec3, size: f64) {
        planes.clear();
        let Self::Pyramid { position, direction, slope, near, range, cone } = *self else { return };
        let apex = position - origin;
        let near = near_end(near, apex, size);
        planes.extend(side_planes(apex, direction, slope));
        planes.push(Plane::through(apex + direction * near, direction));
        planes.push(Plane::through(apex + direction * range, -direction));
        if let Some(Cone { axis, slope }) = cone {
            // What the cone's border just touches must not be lost by rounding. The planes are
            // moved by less than the near distance, so that no side behind the light is lit.
            let widen = |p: Plane| Plane { offset: p.offset + 0.5 * near, ..p };
            planes.extend(side_planes(apex, axis, slope).map(widen));
        }
    }

    /// Corners of a pyramid at its near and its far plane, relative to `origin` (world space);
    /// `None` for parallel light.
    pub(crate) fn corners(&self, origin: DVec3) -> Option<[DVec3; 8]> {
        let Self::Pyramid { position, direction, slope, near, range, .. } = *self else {
            return None;
        };
        let apex = position - origin;
        let [a, b] = perpendicular_pair(direction);
        Some(std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { slope } else { -slope };
            let depth = if i >> 2 & 1 == 1 { range } else { near_end(near, apex, 0.0) };
            apex + (direction + a * sign(0) + b * sign(1)) * depth
        }))
    }
}
