use crate::error::{Error, check, check_position};
use glam::DVec3;

/// An axis-aligned box in world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner with the smallest coordinates.
    pub min: DVec3,
    /// Corner with the largest coordinates. A flat box (`min == max` along an axis) is fine.
    pub max: DVec3,
}

impl Aabb {
    /// The box that holds nothing; the neutral element of [`union`](Self::union).
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// A box from two opposite corners.
    pub fn new(a: DVec3, b: DVec3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// The smallest box around `points`; [`EMPTY`](Self::EMPTY) without any.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.union(Self { min: p, max: p }))
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box of what lies in both; holds no point if they do not meet.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box holds no point at all.
    pub fn is_empty(self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// The middle of the box, metres.
    pub fn center(self) -> DVec3 {
        self.min.midpoint(self.max)
    }

    /// Edge lengths, metres.
    pub fn size(self) -> DVec3 {
        self.max - self.min
    }

    /// The eight corners; bit 0 of the index picks max x, bit 1 max y, bit 2 max z.
    pub fn corners(self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 1 { hi } else { lo };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// The same box as seen from `origin`.
    pub(crate) fn relative_to(self, origin: DVec3) -> Self {
        Self { min: self.min - origin, max: self.max - origin }
    }

    pub(crate) fn check(self, field: &'static str) -> Result<(), Error> {
        if self == Self::EMPTY {
            return Ok(());
        }
        check_position(self.min, field)?;
        check_position(self.max, field)?;
        check(!self.is_empty(), field, || {
            format!("min {} must not exceed max {} (Aabb::EMPTY holds nothing)", self.min, self.max)
        })
    }
}

/// Where shadows are cast from and received. Tighter bounds give finer shadows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds<'a> {
    /// Everything that receives shadows; `None` if unknown: the whole view frustum is served.
    pub receivers: Option<Aabb>,
    /// Boxes that hold all of the receivers between them, if more is known than one box around all; they may
    /// overlap. Empty: all of `receivers`. Where one box would be full of air, some dozens of boxes
    /// spare the maps what nobody sees: one for each object, say. Planning takes time in proportion.
    pub receiver_parts: &'a [Aabb],
    /// Everything that casts shadows; `None` if unknown: casters may lie anywhere towards the light.
    /// Only [`Cover::Scene`](crate::Cover::Scene) and maps that [keep their casters' depths](crate::visibility::Filter::keeps_casters)
    /// have to cover it. Others need not: what lies between the receivers and the light is clamped to depth 0.
    pub casters: Option<Aabb>,
}

impl Bounds<'_> {
    /// One box that holds both receivers and casters.
    pub fn of_scene(scene: Aabb) -> Self {
        Self { receivers: Some(scene), receiver_parts: &[], casters: Some(scene) }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        self.receivers.map_or(Ok(()), |b| b.check("bounds.receivers"))?;
        self.receiver_parts.iter().try_for_each(|b| b.check("bounds.receiver_parts"))?;
        self.casters.map_or(Ok(()), |b| b.check("bounds.casters"))
    }
}

/// A half-space: the points p with `normal · p + offset ≥ 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Points into the half-space. Unit length.
    pub normal: DVec3,
    /// Metres.
    pub offset: f64,
}

impl Plane {
    /// The half-space through `point` on the side that `normal` (unit) points to.
    pub fn through(point: DVec3, normal: DVec3) -> Self {
        Self { normal, offset: -normal.dot(point) }
    }

    /// Signed distance of `p`, metres; positive inside.
    pub fn distance(self, p: DVec3) -> f64 {
        self.normal.dot(p) + self.offset
    }

    /// The half-space on the other side.
    pub(crate) fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }

    /// Whether any point of `aabb` may lie inside.
    pub fn may_touch(self, aabb: Aabb) -> bool {
        let farthest = DVec3::select(self.normal.cmpge(DVec3::ZERO), aabb.max, aabb.min);
        self.distance(farthest) >= 0.0
    }
}
