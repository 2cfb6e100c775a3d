use crate::aliasing::Local;
use crate::bounds::{Aabb, Plane};
use crate::error::Error;
use crate::paged::Paging;
use crate::visibility::Filter;
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec4Swizzles};
use std::ops::Range;

/// The result of planning: which shadow maps to render and how to look them up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// World position of local space's origin, metres: the camera's eye.
    pub origin: DVec3,
    /// The maps, light by light. Their number depends on the technique and on the number and kinds
    /// of the lights alone (a [wide](crate::SpotLight::is_wide) spot light is a kind of its own),
    /// never on where the camera and the lights are.
    pub maps: Vec<ShadowMap>,
    /// The plan of each light, in the order of the lights.
    pub lights: Vec<PlannedLight>,
    /// The filter that the maps are planned for. Its reach beyond a map's border decides which
    /// casters are drawn; whether it needs the depths of distant casters decides where depths
    /// begin.
    pub filter: Filter,
    /// The dot product of this vector with a homogeneous local point is the width of a pixel of the
    /// viewer's image at that point, in metres.
    pub pixel_gradient: DVec4,
    /// The viewer's position as a homogeneous local point: (0, 0, 0, 1), or in orthographic views a
    /// point at infinity, whose fourth coordinate is 0. The line of sight at a local point p runs
    /// along p `viewer.w` − `viewer.xyz`.
    pub viewer: DVec4,
    /// Where shadows fade out before the view ends; `None` if they end there without a fade. See
    /// [`Planner::set_fade`](crate::Planner::set_fade).
    pub fade: Option<Fade>,
    /// How the maps are divided into pages; `None` if they have none.
    pub paging: Option<Paging>,
}

/// The fade of all shadows before the far plane of the view, beyond which no map serves any point.
/// Without it, shadows on surfaces that go on beyond the far plane end at a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fade {
    /// The half-space in front of the far plane, in local space.
    pub end: Plane,
    /// Distance from the far plane over which shadows fade, metres, > 0.
    pub length: f64,
}

impl Fade {
    /// The share that is left of shadows at a local point: 1 until the fade begins, then linearly
    /// less, and 0 from the far plane on.
    pub fn share_left(self, local_position: DVec3) -> f64 {
        (self.end.distance(local_position) / self.length).clamp(0.0, 1.0)
    }
}

/// The part of a [`Plan`] that belongs to one light.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedLight {
    /// Indices of the light's maps in [`Plan::maps`].
    pub maps: Range<usize>,
    /// Angle θ between the view direction and the light direction, radians, 0 ..= π. For spot and
    /// point lights the light direction is taken at the middle of what the camera sees in that
    /// light.
    pub theta_rad: f64,
}

/// Which part of the view a map serves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Index of the light.
    pub light: usize,
    /// Side of the cube around a point light or a [wide](crate::SpotLight::is_wide) spot light;
    /// `None` for other lights.
    pub side: Option<CubeSide>,
    /// Face of the view frustum; `None` stands for the whole frustum.
    pub face: Option<Face>,
    /// Index of the slice along the view, counted from the viewer.
    pub slice: usize,
}

/// A face of the view frustum, named by its place in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// The face through the image's lower edge.
    Bottom,
    /// The face through the image's right edge.
    Right,
    /// The face through the image's upper edge.
    Top,
    /// The face through the image's left edge.
    Left,
    /// The near plane's face.
    Near,
}

/// A side of the cube around a point light or a wide spot light, named by the world axis that
/// points through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "they say it all")]
pub enum CubeSide {
    PosX,
    NegX,
    PosY,
    NegY,
    PosZ,
    NegZ,
}

impl Plan {
    /// Number of texels of all maps together.
    pub fn texels(&self) -> u64 {
        self.maps.iter().map(ShadowMap::texels).sum()
    }

    /// Storage factor S̄: the number of texels that all maps together need for an error of 1 pixel
    /// per texel in s and in t, in units of the image's height squared (Lloyd et al. 2006, Eq. 12,
    /// where images are square).
    pub fn storage_factor(&self) -> f64 {
        // The sum of no numbers is −0, which would print with its sign.
        self.maps.iter().map(|m| m.storage_factor).sum::<f64>() + 0.0
    }

    /// A surface point with its tangent plane, as the map of index `map` sees it. `world_normal`
    /// may have any non-zero length and point to either side of the surface. `None` where
    /// [`ShadowMap::project`] gives `None`, if the map is empty or does not exist, and if the
    /// normal has no direction.
    pub fn receiver(
        &self,
        map: usize,
        world_position: DVec3,
        world_normal: DVec3,
    ) -> Option<Receiver> {
        self.maps.get(map)?.receiver(world_position, world_normal, self)
    }

    /// The visibility to show at a world point where the maps give `visibility`: a lookup's last
    /// step, in which shadows [fade out](Self::fade).
    pub fn faded(&self, world_position: DVec3, visibility: f64) -> f64 {
        let left = self.fade.map_or(1.0, |fade| fade.share_left(world_position - self.origin));
        visibility + (1.0 - left) * (1.0 - visibility)
    }

    /// Indices of the maps that serve a world point under a light, each with its share of the
    /// result. There is one map, there are two where slices overlap, and none where the plan serves
    /// no receivers. The shares add up to 1.
    pub fn lookup(
        &self,
        light: usize,
        world_position: DVec3,
    ) -> impl Iterator<Item = (usize, f64)> + '_ {
        let maps = if self.paging.is_some() {
            let place = self.page_place(light, world_position);
            place.map_or(0..0, |place| place.map..place.map + 1)
        } else {
            self.lights.get(light).map_or(0..0, |l| l.maps.clone())
        };
        let mut left = 1.0;
        maps.map_while(move |i| {
            (left > 0.0).then(|| {
                let share = self.maps[i].weight(world_position).min(left);
                left -= share;
                (i, share)
            })
        })
        .filter(|&(_, share)| share > 0.0)
    }
}

/// The largest errors over the receivers that a map serves, pixels per texel. Boxes that are served
/// in [groups](crate::Planner::MOST_PARTS) count with the space between them. The errors are upper
/// bounds: under parallel light they are at most one per cent larger than the true maxima, and
/// under spot lights by some per cent, or more where receivers come close to the lamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapError {
    /// Largest m_s: the error across the warp's axis.
    pub max_s: f64,
    /// Largest m_t: the error along the warp's axis.
    pub max_t: f64,
    /// Largest error in the worst direction: the larger singular value of a texel's footprint over
    /// a pixel's width.
    pub max: f64,
}

impl MapError {
    /// Errors from upper bounds of those in s and in t and of the largest one. The latter may have
    /// been found apart and more closely; it is never less than the former.
    pub(crate) fn new([max_s, max_t]: [f64; 2], max: f64) -> Self {
        Self { max_s, max_t, max: max.max(max_s).max(max_t) }
    }
}

/// How the rows of texels are spread over t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rows {
    /// Evenly. The matrix alone describes the map, and any GPU can render it.
    Even,
    /// By the logarithm of the warp's depth, the optimum of Wimmer et al. 2004, §4.2. No GPU
    /// rasterises such maps; the CPU reference traces them.
    Logarithmic {
        /// Ratio of the warp frustum's far distance to its near distance, (λ + μ)/λ, > 1.
        ratio: f64,
    },
}

impl Rows {
    /// The t of a row coordinate in [0, 1], which counts rows as a share of all rows.
    pub fn t_from_row(self, row: f64) -> f64 {
        match self {
            Self::Even => row,
            Self::Logarithmic { ratio } => -(-row * ratio.ln()).exp_m1() * ratio / (ratio - 1.0),
        }
    }

    /// The row coordinate in [0, 1] of `t`: the inverse of [`t_from_row`](Self::t_from_row).
    pub fn row_from_t(self, t: f64) -> f64 {
        match self {
            Self::Even => t,
            Self::Logarithmic { ratio } => {
                -(-t * (ratio - 1.0) / ratio).max(-1.0).ln_1p() / ratio.ln()
            }
        }
    }

    /// Derivative of the row coordinate with respect to t.
    pub fn row_derivative(self, t: f64) -> f64 {
        match self {
            Self::Even => 1.0,
            Self::Logarithmic { ratio } => {
                let k = (ratio - 1.0) / ratio;
                k / (1.0 - t * k) / ratio.ln()
            }
        }
    }
}

/// One shadow map of a [`Plan`].
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowMap {
    /// World position of local space's origin, metres. It is the same for all maps of a plan, and
    /// repeated here so that each map is complete.
    pub origin: DVec3,
    /// The matrix that takes a homogeneous local point to (s, t, depth) after the division by the
    /// fourth coordinate. Receivers land in [0, 1]³; casters between them and the light get depths
    /// below 0, which are clamped to 0. The fourth coordinate is positive wherever the map applies.
    pub shadow_from_local: DMat4,
    /// Inverse of `shadow_from_local`.
    pub local_from_shadow: DMat4,
    /// How the rows of texels are spread over t; even for all warps but `log`.
    pub rows: Rows,
    /// Number of texels in s and t; both 0 if the map [is empty](Self::is_empty).
    pub resolution: [u32; 2],
    /// Which part of the view the map serves.
    pub part: Part,
    /// The range of distances along the view that the map serves, metres. For maps of a side face
    /// of the frustum it is the range along the face.
    pub split: [f64; 2],
    /// The map serves the intersection of these half-spaces, given in local space. If there is a
    /// next slice, the first half-space ends this one.
    pub cell: Vec<Plane>,
    /// Where slices overlap, the half-space in front of the next slice. The map fades into the next
    /// one from the border of this half-space to that of the first half-space of `cell`.
    pub fade_from: Option<Plane>,
    /// Distance λ from the warp's centre of projection to its near plane, in light-space metres
    /// (under spot lights in units of the light's image plane at distance 1). `None` if there is no
    /// warp.
    pub lambda: Option<f64>,
    /// Largest errors over the receivers that the map serves.
    pub error: MapError,
    /// This map's summand of [`Plan::storage_factor`].
    pub storage_factor: f64,
    /// Everything that can cast into this map meets the intersection of these half-spaces, given in
    /// local space.
    pub caster_planes: Vec<Plane>,
    /// Local position of a spot or point light, at which the map's beams begin; `None` if the beams
    /// are parallel.
    pub apex: Option<DVec3>,
    /// The slab that holds the receivers which the map serves: [`Distances`](Slab::Distances) under
    /// spot and point lights, otherwise [`Leaning`](Slab::Leaning).
    pub slab: Slab,
}

/// A range of depths that holds a map's receivers closely. Where light falls at a slant it is many
/// times smaller than the map's own range of depths. Prefilters count depth within the slab
/// ([`ShadowMap::slab_depth`]), so that the digits of their statistics and the terms of their
/// series resolve the depths at which shadows fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slab {
    /// Under parallel light: the space between two parallel planes, at which depth is a linear
    /// function of (s, t) that follows the ground.
    Leaning {
        /// Growth of the near plane's depth per unit of s and of t.
        slope: DVec2,
        /// Depth of the near plane at s = t = 0.
        begin: f64,
        /// Difference in depth between the two planes, > 0.
        thickness: f64,
    },
    /// Under a spot or point light: a range of distances from the light along an axis.
    Distances {
        /// Unit vector in local space.
        axis: DVec3,
        /// Smallest distance, metres.
        near: f64,
        /// Largest distance, metres, > `near`.
        far: f64,
    },
}

/// A slab that holds all of a map's depths.
impl Default for Slab {
    fn default() -> Self {
        Self::Leaning { slope: DVec2::ZERO, begin: 0.0, thickness: 1.0 }
    }
}

/// The beam of light that one (s, t) stands for, as a line in world space that runs away from the
/// light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// World position on the beam at depth 0, where the receivers' range of depths begins.
    pub origin: DVec3,
    /// Unit vector away from the light.
    pub direction: DVec3,
    /// Distance from `origin` back to the light, metres, ≥ 0, over which casters may lie;
    /// infinite for parallel light.
    pub reach_back: f64,
}

/// A surface point in the coordinates of one shadow map, with everything that a shadow test needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Receiver {
    /// Shadow coordinates (s, t) of the point, by the matrix alone (before [`Rows`]).
    pub st: DVec2,
    /// Depth of the point.
    pub depth: f64,
    /// Slope of the surface's tangent plane in shadow space, ∂depth/∂(s, t). Since projective
    /// maps take planes to planes, it is the same all over the plane. Infinite where the surface is
    /// edge-on to the light.
    pub slope: DVec2,
    /// The same slope for the plane through the point perpendicular to the beam. It is not zero
    /// where a warp tilts depth.
    pub level_slope: DVec2,
    /// Half the width of a texel, measured as depth along the beam. The texel's width is the
    /// [longest](crate::aliasing::Footprint::longest) one of its footprint.
    pub half_texel: f64,
    /// Growth of depth along the beam, 1/m.
    pub depth_per_metre: f64,
    /// Texels per metre on the plane perpendicular to the light, squared: |∇s|², |∇t|² and
    /// ∇s·∇t of the texel coordinates, texels²/m² (the last is 0 where the two gradients are
    /// perpendicular). A Gaussian of standard deviation σ metres has σ² times these values as
    /// its variances and covariance in texels, a disc of radius r metres r²/4 times.
    pub texel_metric: [f64; 3],
    /// The same for a pixel of the viewer's image in place of a metre, on the surface's tangent
    /// plane, texels²/pixel². A surface seen at a slant has larger values, by a factor of up to
    /// 16 in texels per pixel.
    pub pixel_metric: [f64; 3],
}

/// Least sine of the angle between the line of sight and a surface. Surfaces seen at a smaller
/// angle count as if seen at this one, or a pixel on them could be infinitely long.
const LEAST_SLANT: f64 = 1.0 / 16.0;

/// The squares of two gradients' lengths, and their dot product.
fn metric(s: DVec3, t: DVec3) -> [f64; 3] {
    [s.length_squared(), t.length_squared(), s.dot(t)]
}

impl ShadowMap {
    /// Whether all numbers of the map are finite, or an error about the map of index `index`.
    pub(crate) fn check_finite(&self, index: usize) -> Result<(), Error> {
        let Self { cell, fade_from, caster_planes, error, slab, .. } = self;
        let mut planes = cell.iter().chain(fade_from).chain(caster_planes);
        let slab = match *slab {
            Slab::Leaning { slope, begin, thickness } => {
                slope.is_finite() && (begin + thickness).is_finite()
            }
            Slab::Distances { axis, near, far } => axis.is_finite() && (near + far).is_finite(),
        };
        let rows = match self.rows {
            Rows::Even => true,
            Rows::Logarithmic { ratio } => ratio.is_finite(),
        };
        let parts = [
            ("matrix", self.shadow_from_local.is_finite() && self.local_from_shadow.is_finite()),
            ("spacing of rows", rows && self.lambda.is_none_or(f64::is_finite)),
            ("range of distances", self.split.iter().all(|d| d.is_finite())),
            ("planes", planes.all(|p| p.normal.is_finite() && p.offset.is_finite())),
            ("largest error", (error.max_s + error.max_t + error.max).is_finite()),
            ("storage factor", self.storage_factor.is_finite()),
            ("slab", slab),
        ];
        match parts.into_iter().find(|(_, is_finite)| !is_finite) {
            Some((what, _)) => Err(Error::NotFinite { map: index, what }),
            None => Ok(()),
        }
    }

    /// Whether the map serves no receivers. An empty map has no texels.
    pub fn is_empty(&self) -> bool {
        self.resolution.contains(&0)
    }

    /// Number of texels.
    pub fn texels(&self) -> u64 {
        u64::from(self.resolution[0]) * u64::from(self.resolution[1])
    }

    /// [`shadow_from_local`](Self::shadow_from_local) in single precision, for a GPU.
    pub fn shadow_from_local_f32(&self) -> Mat4 {
        self.shadow_from_local.as_mat4()
    }

    /// The matrix that takes a homogeneous world point to (s, t, depth) after the division. Far
    /// from the world's origin use [`shadow_from_local`](Self::shadow_from_local) instead, which
    /// does not lose digits.
    pub fn shadow_from_world(&self) -> DMat4 {
        self.shadow_from_local * DMat4::from_translation(-self.origin)
    }

    /// Shadow coordinates (s, t, depth) of a world point; `None` where the map does not apply,
    /// behind the warp's centre of projection or behind a spot light.
    pub fn project(&self, world_position: DVec3) -> Option<DVec3> {
        let h = self.shadow_from_local * (world_position - self.origin).extend(1.0);
        (h.w > 0.0).then(|| h.xyz() / h.w)
    }

    /// Position of a depth within the receivers' [slab](Self::slab): 0 at its near side, 1 at its
    /// far side, and linear along the beam.
    pub fn slab_depth(&self, st: DVec2, depth: f64) -> f64 {
        match self.slab {
            Slab::Leaning { slope, begin, thickness } => {
                (depth - begin - slope.dot(st)) / thickness
            }
            Slab::Distances { axis, near, far } => {
                let h = self.local_from_shadow * st.extend(depth).extend(1.0);
                let apex = self.apex.unwrap_or(DVec3::ZERO);
                // Depths beyond the image of infinity lie behind all receivers.
                if h.w > 0.0 { (axis.dot(h.xyz() / h.w - apex) - near) / (far - near) } else { 1.0 }
            }
        }
    }

    /// Width of the penumbra that an occluder at `depth` on the beam through `st` casts onto the
    /// receiver, for a light of [diameter](crate::visibility::LightSize::diameter) 1 (Fernando
    /// 2005): metres across the receiver's beam, per metre of a lamp's diameter or per unit of the
    /// sun's.
    ///
    /// Under a lamp, distances count along the axis of its light, as if the lamp were a disc across
    /// that axis. In planes across the axis texels are in proportion, so an occluder hides some of
    /// the light if it lies less than half this width from the receiver's beam, however far away
    /// that is. (In the plane across the receiver's own beam, texels towards its horizon are far
    /// away, and their penumbrae would be as wide as that.)
    pub(crate) fn penumbra(&self, receiver: &Receiver, st: DVec2, depth: f64) -> f64 {
        let [[here, step], [there, _]] = [receiver.st, st].map(|st| self.beam_scale(st));
        if step == 0.0 {
            let level = receiver.depth + receiver.level_slope.dot(st - receiver.st);
            return ((level - depth) / (receiver.depth_per_metre * there / here)).max(0.0);
        }
        // Distance from a lamp along a beam is inversely proportional to the fourth coordinate.
        let inverse = |st, w| w / self.axial_distance(st).unwrap_or(1.0);
        let caster = inverse(st, there + step * depth);
        let level = inverse(receiver.st, here + step * receiver.depth);
        if level > 0.0 { (caster / level - 1.0).clamp(0.0, 1e6) } else { 0.0 }
    }

    /// Under a lamp, the distance from it along the axis of its light, metres, times the fourth
    /// coordinate, of the points of the beam through `st`. It does not depend on depth, because the
    /// lamp is the point at which depth is infinite. `None` under parallel light.
    fn axial_distance(&self, st: DVec2) -> Option<f64> {
        let (Some(apex), Slab::Distances { axis, .. }) = (self.apex, self.slab) else {
            return None;
        };
        let h = self.local_from_shadow * st.extend(0.0).extend(1.0);
        Some(axis.dot(h.xyz() - apex * h.w))
    }

    /// The fourth coordinate along a beam, from shadow space to local space: its value at depth 0,
    /// and its change from there to depth 1.
    pub(crate) fn beam_scale(&self, st: DVec2) -> [f64; 2] {
        let w = self.local_from_shadow.row(3);
        [w.x * st.x + w.y * st.y + w.w, w.z]
    }

    /// The beam through (s, t), which may lie slightly outside [0, 1]². `None` where no point has
    /// these coordinates, beyond the warp's horizon.
    pub fn beam(&self, st: DVec2) -> Option<Beam> {
        // Every beam has a point of depth 0; a spot light's beam may reach infinity before depth 1.
        let h = self.local_from_shadow * st.extend(0.0).extend(1.0);
        let near = (h.w > 0.0).then(|| h.xyz() / h.w)?;
        let direction = self.beam_direction(near)?;
        let reach_back = self.apex.map_or(f64::INFINITY, |apex| near.distance(apex));
        Some(Beam { origin: near + self.origin, direction, reach_back })
    }

    /// The receiver of [`Plan::receiver`].
    fn receiver(
        &self,
        world_position: DVec3,
        world_normal: DVec3,
        plan: &Plan,
    ) -> Option<Receiver> {
        let local = world_position - self.origin;
        let here = (!self.is_empty()).then(|| Local::at(self, local))??;
        let world_normal = world_normal.try_normalize()?;
        // Covectors of planes transform from local to shadow space by the transposed inverse
        // matrix.
        let slope = |normal: DVec3| {
            let plane = normal.extend(-normal.dot(local));
            let shadow_plane = self.local_from_shadow.transpose() * plane;
            let slope = -shadow_plane.xy() / shadow_plane.z;
            if slope.is_finite() { slope } else { DVec2::INFINITY }
        };
        Some(Receiver {
            st: here.shadow.truncate(),
            depth: here.shadow.z,
            slope: slope(world_normal),
            level_slope: slope(here.beam),
            depth_per_metre: here.depth_per_metre,
            half_texel: 0.5 * here.footprint().longest() * here.depth_per_metre,
            texel_metric: metric(here.grad_s, here.grad_t),
            pixel_metric: {
                // A step across the line of sight is continued along that line until it meets the
                // surface's tangent plane.
                let view = local * plan.viewer.w - plan.viewer.truncate();
                let view = view.normalize_or_zero();
                let slant = world_normal.dot(view);
                let slant = slant.signum() * slant.abs().max(LEAST_SLANT);
                let on_plane =
                    |gradient: DVec3| gradient - world_normal * (gradient.dot(view) / slant);
                let pixel_metres = plan.pixel_gradient.dot(local.extend(1.0)).max(0.0);
                let across = |gradient| {
                    let gradient = on_plane(gradient);
                    (gradient - view * gradient.dot(view)) * pixel_metres
                };
                metric(across(here.grad_s), across(here.grad_t))
            },
        })
    }

    /// Whether anything in `aabb` (world space) can cast a shadow into this map. The test is
    /// conservative: it is never `false` for a box that holds a caster, and sometimes `true` for
    /// one that holds none.
    pub fn may_cast(&self, aabb: Aabb) -> bool {
        let local = aabb.relative_to(self.origin);
        !self.is_empty() && self.caster_planes.iter().all(|p| p.may_touch(local))
    }

    /// How much the map contributes at a world point, 0 ..= 1: 0 outside what the map serves, 1
    /// inside, and in between where the map fades into that of the next slice.
    pub fn weight(&self, world_position: DVec3) -> f64 {
        let local = world_position - self.origin;
        if self.is_empty() || self.cell.iter().any(|p| p.distance(local) < 0.0) {
            return 0.0;
        }
        let (Some(end), Some(start)) = (self.cell.first(), self.fade_from) else { return 1.0 };
        let [left, gone] = [end.distance(local), -start.distance(local)];
        if gone <= 0.0 { 1.0 } else { left / (left + gone) }
    }
}
