use crate::box_tree::BoxTree;
use crate::error::{Error, check, check_position};
use crate::seen::Seen;
use glam::DVec3;

/// An axis-aligned box in world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner with the smallest coordinates.
    pub min: DVec3,
    /// Corner with the largest coordinates. The box may be flat (`min == max` along an axis).
    pub max: DVec3,
}

impl Aabb {
    /// The box that contains no point, which is the neutral element of [`union`](Self::union).
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// A box from two opposite corners.
    pub fn new(a: DVec3, b: DVec3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// The smallest box around `points`; [`EMPTY`](Self::EMPTY) if there are none.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        // Comparisons are faster than `DVec3::min` and `DVec3::max`.
        points.into_iter().fold(Self::EMPTY, |b, p| Self {
            min: DVec3::select(p.cmplt(b.min), p, b.min),
            max: DVec3::select(p.cmpgt(b.max), p, b.max),
        })
    }

    /// The smallest box around both boxes.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The intersection of both boxes; it is [empty](Self::is_empty) if they do not meet.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no point.
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

    /// The least dot product of `direction` with a point of the box.
    pub(crate) fn least_along(self, direction: DVec3) -> f64 {
        direction.dot(DVec3::select(direction.cmpge(DVec3::ZERO), self.min, self.max))
    }

    /// The same box in coordinates relative to `origin`.
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

/// Where casters and receivers lie. Tighter bounds give finer shadows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds<'a> {
    /// A box around everything that receives shadows. `None` if unknown; then the whole view
    /// frustum is served.
    pub receivers: Option<Aabb>,
    /// Boxes that together contain all receivers, for closer bounds than one box. If `None`, all of
    /// `receivers` counts. Where one box would contain mostly air, some dozens of boxes, one for
    /// each object say, save the texels of that air. Planning time hardly depends on the number of
    /// boxes: of those that the camera sees, it serves
    /// [at most 32 groups](crate::Planner::MOST_PARTS) apart.
    pub receiver_parts: Option<&'a BoxTree>,
    /// What the camera saw in this frame or a frame or two before. Maps are then fitted to that in
    /// place of the boxes, which are still needed for what has come into view since.
    pub seen: Option<Seen<'a>>,
    /// A box around everything that casts shadows. `None` if unknown; then casters may lie anywhere
    /// towards the light. Only maps with [`Cover::Scene`](crate::Cover::Scene) and maps that [keep
    /// their casters' depths](crate::visibility::Filter::keeps_casters) have to include the casters
    /// in their range of depths. All other maps clamp the depths of casters between the receivers
    /// and the light to 0.
    pub casters: Option<Aabb>,
}

impl Bounds<'_> {
    /// Bounds of one box that contains both receivers and casters.
    pub fn of_scene(scene: Aabb) -> Self {
        Self { receivers: Some(scene), receiver_parts: None, seen: None, casters: Some(scene) }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        self.receivers.map_or(Ok(()), |b| b.check("bounds.receivers"))?;
        let moving = self.seen.map_or(&[][..], |seen| seen.moving);
        moving.iter().try_for_each(|b| b.check("bounds.seen.moving"))?;
        let clearance = self.seen.map_or(0.0, |seen| seen.clearance);
        check(clearance >= 0.0 && clearance.is_finite(), "bounds.seen.clearance", || {
            format!("must be a finite depth of 0 or more, is {clearance}")
        })?;
        self.casters.map_or(Ok(()), |b| b.check("bounds.casters"))
    }
}

/// The box that contains no point.
impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

/// A half-space: all points p with `normal · p + offset ≥ 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit vector that points into the half-space.
    pub normal: DVec3,
    /// Signed distance of the origin from the bounding plane, metres; positive if the origin is
    /// inside.
    pub offset: f64,
}

impl Plane {
    /// The half-space whose bounding plane passes through `point` and whose inside `normal` (a unit
    /// vector) points to.
    pub fn through(point: DVec3, normal: DVec3) -> Self {
        Self { normal, offset: -normal.dot(point) }
    }

    /// Signed distance of `p` from the bounding plane, metres; positive inside.
    pub fn distance(self, p: DVec3) -> f64 {
        self.normal.dot(p) + self.offset
    }

    /// Whether all of `aabb` lies inside the half-space.
    pub(crate) fn contains(self, aabb: Aabb) -> bool {
        self.offset + aabb.least_along(self.normal) >= 0.0
    }

    /// The complementary half-space.
    pub(crate) fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }

    /// Whether any point of `aabb` may lie inside the half-space.
    pub fn may_touch(self, aabb: Aabb) -> bool {
        self.offset - aabb.least_along(-self.normal) >= 0.0
    }
}
