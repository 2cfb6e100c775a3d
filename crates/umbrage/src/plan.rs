use crate::aliasing::Local;
use crate::bounds::{Aabb, Plane};
use crate::visibility::Filter;
use glam::{DMat4, DVec2, DVec3, Mat4, Vec4Swizzles};
use std::ops::Range;

/// What to render and how to look it up: the result of planning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// World position of local space's origin, metres: the viewer's position.
    pub origin: DVec3,
    /// The maps, light by light. Their number depends on the options and the lights' kinds alone, never
    /// on where camera and lights are.
    pub maps: Vec<ShadowMap>,
    /// What there is for each light, in their order.
    pub lights: Vec<PlannedLight>,
    /// The filter that the maps are planned for: how far it reads beyond a map, and whether it asks
    /// how far casters lie, decides which casters are drawn and where depths begin.
    pub filter: Filter,
    /// How wide a pixel of the viewer's picture is at a local point, metres: this times the point.
    pub pixel_gradient: DVec3,
}

/// One light's share of a [`Plan`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedLight {
    /// Its maps' indices in [`Plan::maps`].
    pub maps: Range<usize>,
    /// Angle θ between view and light direction, radians, 0 ..= π. For spot and point lights at the
    /// middle of what the camera sees in its light.
    pub theta_rad: f64,
}

/// Which part of what the camera sees a map is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Index of the light.
    pub light: usize,
    /// Side of the cube around a point light; `None` for other lights.
    pub side: Option<CubeSide>,
    /// Face of the view frustum; `None`: all of it.
    pub face: Option<Face>,
    /// Slice along the view, from the viewer.
    pub slice: usize,
}

/// A face of the view frustum, as in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Below the picture.
    Bottom,
    /// Right of the picture.
    Right,
    /// Above the picture.
    Top,
    /// Left of the picture.
    Left,
    /// Before the picture.
    Near,
}

/// A side of the cube around a point light: the direction in world space in which it looks.
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
    /// Texels of all maps together.
    pub fn texels(&self) -> u64 {
        self.maps.iter().map(ShadowMap::texels).sum()
    }

    /// Storage factor S̄: texels that all maps need, in units of the image's height squared, for an
    /// error of 1 pixel per texel in s and in t (Lloyd et al. 2006, Eq. 12, whose images are square).
    pub fn storage_factor(&self) -> f64 {
        self.maps.iter().map(|m| m.storage_factor).sum()
    }

    /// A surface point with its plane, as one of the maps sees it. `world_normal` need not have unit
    /// length and may point to either side. `None` as for [`ShadowMap::project`], on empty maps and
    /// those that the plan does not have, and without a normal.
    pub fn receiver(
        &self,
        map: usize,
        world_position: DVec3,
        world_normal: DVec3,
    ) -> Option<Receiver> {
        self.maps.get(map)?.receiver(world_position, world_normal, self.pixel_gradient)
    }

    /// The maps that answer for a world point under a light, and the share of each. There is one, two
    /// where slices overlap, and none where nothing is served. Shares add up to 1.
    pub fn lookup(
        &self,
        light: usize,
        world_position: DVec3,
    ) -> impl Iterator<Item = (usize, f64)> + '_ {
        let maps = self.lights.get(light).map_or(0..0, |l| l.maps.clone());
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

/// The largest errors over the receivers that a map serves, pixels per texel. Upper bounds: under parallel
/// light at most one per cent above the errors reached, under spot lights usually so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapError {
    /// Largest m_s: across the warp.
    pub max_s: f64,
    /// Largest m_t: along the warp.
    pub max_t: f64,
    /// Largest error in the worst direction, σ_max of a texel's footprint over a pixel's width.
    pub max: f64,
}

/// How rows of texels are spread over t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rows {
    /// Evenly: the matrix says it all, any GPU can render the map.
    Even,
    /// By the logarithm of the warp's depth, the optimum of Wimmer et al. 2004, §4.2. No GPU
    /// rasterises this; the CPU reference casts it.
    Logarithmic {
        /// Far over near distance of the warp frustum, (λ + μ)/λ, > 1.
        ratio: f64,
    },
}

impl Rows {
    /// The t at which the warped row coordinate `row` in [0, 1] lies.
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

    /// d row / d t.
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
    /// World position of local space's origin, metres; the same for all maps of a plan, repeated here
    /// so that a map is complete in itself.
    pub origin: DVec3,
    /// Takes a homogeneous local point to (s, t, depth) after the divide. Receivers land in
    /// [0, 1]³; casters between them and the light get depths below 0 and are clamped to 0. The
    /// fourth coordinate is positive wherever the map applies.
    pub shadow_from_local: DMat4,
    /// Inverse of `shadow_from_local`.
    pub local_from_shadow: DMat4,
    /// How rows of texels are spread over t; even for all warps but `log`.
    pub rows: Rows,
    /// Texels in s and t. Both 0 if the map sees nothing ([`is_empty`](Self::is_empty)).
    pub resolution: [u32; 2],
    /// Which part of what the camera sees the map is for.
    pub part: Part,
    /// The range along the view direction that the map is for, metres. For maps of the frustum's side
    /// faces the range on the face.
    pub split: [f64; 2],
    /// The map serves what lies inside all of these half-spaces, in local space. Where there is a next
    /// slice, the first of them ends this one.
    pub cell: Vec<Plane>,
    /// Where slices overlap, the half-space before the next slice: from its border to the first plane
    /// of `cell` the map fades into the next one.
    pub fade_from: Option<Plane>,
    /// Distance λ from the warp's centre of projection to its near plane, in light-space metres (for
    /// spot lights: in units of the light's image plane at unit distance). `None`: no warp.
    pub lambda: Option<f64>,
    /// Largest errors over the receivers served.
    pub error: MapError,
    /// This map's share of [`Plan::storage_factor`].
    pub storage_factor: f64,
    /// What can cast into this map lies inside all of these half-spaces, in local space.
    pub caster_planes: Vec<Plane>,
    /// Local position of a spot light, from which the map's beams come; `None`: beams are parallel.
    pub apex: Option<DVec3>,
    /// Where the receivers served lie along the beams: [`Distances`](Slab::Distances) under lamps, else [`Leaning`](Slab::Leaning).
    pub slab: Slab,
}

/// A range of depths that holds a map's receivers, as tight as it easily gets: many times smaller than the map's own where light falls at a slant. What filters
/// store in place of depth counts from here ([`ShadowMap::slab_depth`]), so that they spend their digits and their terms where shadows fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slab {
    /// Under parallel light, what lies between two parallel planes over (s, t), which follow the ground.
    Leaning {
        /// Growth of depth at its near side per unit of s and t.
        slope: DVec2,
        /// Depth of its near side at s = t = 0.
        begin: f64,
        /// Depth from its near to its far side, > 0.
        thickness: f64,
    },
    /// Under a lamp, distances from it along an axis.
    Distances {
        /// Unit vector, local space.
        axis: DVec3,
        /// Metres.
        near: f64,
        /// Metres, more than `near`.
        far: f64,
    },
}

/// All of a map's depths.
impl Default for Slab {
    fn default() -> Self {
        Self::Leaning { slope: DVec2::ZERO, begin: 0.0, thickness: 1.0 }
    }
}

/// The line of points that one (s, t) stands for, in world space, running away from the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// World position where the receivers' depth range begins.
    pub origin: DVec3,
    /// Unit vector away from the light.
    pub direction: DVec3,
    /// How far back from `origin` casters may lie, metres, ≥ 0; infinite for parallel light.
    pub reach_back: f64,
}

/// A surface point as a shadow map sees it: all that a shadow test needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Receiver {
    /// Shadow coordinates (s, t) of the point, by the matrix alone (before [`Rows`]).
    pub st: DVec2,
    /// Depth of the point.
    pub depth: f64,
    /// Slope of the surface's plane in shadow space, ∂depth/∂(s, t). Perspective maps take planes to
    /// planes, so this holds on the whole plane. Infinite where the surface is edge-on to the light.
    pub slope: DVec2,
    /// The same of the plane across the beam through the point: not zero where a warp tilts depth.
    pub level_slope: DVec2,
    /// What half a texel is worth in depth: half of the longest way across its
    /// [footprint](crate::aliasing::Footprint), laid along the beam.
    pub half_texel: f64,
    /// Growth of depth along the beam, 1/m.
    pub depth_per_metre: f64,
    /// How texels lie across the light: squares of the texels to a metre in s and in t, and the product of the two
    /// directions (0 where they are perpendicular). A disc of radius r metres has r² times this for its covariance, but for a factor.
    pub texel_metric: [f64; 3],
    /// The same of texels to a pixel of the viewer's picture, on the surface's plane: more where it is seen at a slant, up to 16 times.
    pub pixel_metric: [f64; 3],
}

/// What is seen at a slant of less than this (the sine of it) counts as if at this one.
const LEAST_SLANT: f64 = 1.0 / 16.0;

/// Squares of two gradients, and their product.
fn metric(s: DVec3, t: DVec3) -> [f64; 3] {
    [s.length_squared(), t.length_squared(), s.dot(t)]
}

impl ShadowMap {
    /// Whether the map serves no receivers; then it has no texels and costs nothing.
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

    /// Takes a homogeneous world point to (s, t, depth) after the divide. Far from the world's
    /// origin use [`shadow_from_local`](Self::shadow_from_local) instead.
    pub fn shadow_from_world(&self) -> DMat4 {
        self.shadow_from_local * DMat4::from_translation(-self.origin)
    }

    /// (s, t, depth) of a world point; `None` where the map does not apply (behind the warp's
    /// centre of projection or a spot light).
    pub fn project(&self, world_position: DVec3) -> Option<DVec3> {
        let h = self.shadow_from_local * (world_position - self.origin).extend(1.0);
        (h.w > 0.0).then(|| h.xyz() / h.w)
    }

    /// Where a depth lies in the [slab](Self::slab) of the receivers: 0 at its near side and 1 at its far side; linear along the beam.
    pub fn slab_depth(&self, st: DVec2, depth: f64) -> f64 {
        match self.slab {
            Slab::Leaning { slope, begin, thickness } => {
                (depth - begin - slope.dot(st)) / thickness
            }
            Slab::Distances { axis, near, far } => {
                let h = self.local_from_shadow * st.extend(depth).extend(1.0);
                let apex = self.apex.unwrap_or(DVec3::ZERO);
                // What is beyond infinity is behind everything.
                if h.w > 0.0 { (axis.dot(h.xyz() / h.w - apex) - near) / (far - near) } else { 1.0 }
            }
        }
    }

    /// How wide the penumbra is of what lies at `depth` on the beam through `st`, for a light of diameter 1: metres across the receiver's beam, for the sun per
    /// metre of distance from it (Fernando 2005).
    pub(crate) fn penumbra(&self, receiver: &Receiver, st: DVec2, depth: f64) -> f64 {
        let [[here, step], [there, _]] = [receiver.st, st].map(|st| self.beam_scale(st));
        let level = receiver.depth + receiver.level_slope.dot(st - receiver.st);
        if step == 0.0 {
            return ((level - depth) / (receiver.depth_per_metre * there / here)).max(0.0);
        }
        // Distances from a lamp go with one over the fourth coordinate.
        let [at, level] = [depth, level].map(|d| there + step * d);
        if level > 0.0 { (at / level - 1.0).clamp(0.0, 1e6) } else { 0.0 }
    }

    /// The fourth coordinate of the points of a beam: where depth is 0, and its growth to where depth is 1.
    pub(crate) fn beam_scale(&self, st: DVec2) -> [f64; 2] {
        let w = self.local_from_shadow.row(3);
        [w.x * st.x + w.y * st.y + w.w, w.z]
    }

    /// The beam through (s, t). Slightly outside [0, 1]² is fine; `None` where no point has these
    /// coordinates (beyond the warp's horizon).
    pub fn beam(&self, st: DVec2) -> Option<Beam> {
        // Depth 0 exists on every beam; a spot light's may reach infinity before depth 1.
        let h = self.local_from_shadow * st.extend(0.0).extend(1.0);
        let near = (h.w > 0.0).then(|| h.xyz() / h.w)?;
        let direction = self.beam_direction(near)?;
        let reach_back = self.apex.map_or(f64::INFINITY, |apex| near.distance(apex));
        Some(Beam { origin: near + self.origin, direction, reach_back })
    }

    /// See [`Plan::receiver`], and [`Plan::pixel_gradient`].
    fn receiver(
        &self,
        world_position: DVec3,
        world_normal: DVec3,
        pixel_gradient: DVec3,
    ) -> Option<Receiver> {
        let local = world_position - self.origin;
        let here = (!self.is_empty()).then(|| Local::at(self, local))??;
        let world_normal = world_normal.try_normalize()?;
        // In shadow space a plane's covector is the world's times the inverse matrix.
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
                // Along the surface's plane a step across the view goes on along it.
                let view = local.normalize_or_zero();
                let slant = world_normal.dot(view);
                let slant = slant.signum() * slant.abs().max(LEAST_SLANT);
                let on_plane =
                    |gradient: DVec3| gradient - world_normal * (gradient.dot(view) / slant);
                let pixel_metres = pixel_gradient.dot(local).max(0.0);
                let across = |gradient| {
                    let gradient = on_plane(gradient);
                    (gradient - view * gradient.dot(view)) * pixel_metres
                };
                metric(across(here.grad_s), across(here.grad_t))
            },
        })
    }

    /// Whether anything in `aabb` (world space) can cast a shadow into this map. Never `false` for
    /// one that does; `true` for some that do not.
    pub fn may_cast(&self, aabb: Aabb) -> bool {
        let local = aabb.relative_to(self.origin);
        !self.is_empty() && self.caster_planes.iter().all(|p| p.may_touch(local))
    }

    /// How far the map answers for a point, 0 ..= 1: 0 outside what it serves, 1 inside, falling
    /// where it fades into the next slice's map.
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
