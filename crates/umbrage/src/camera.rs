use crate::error::{Error, check, check_position, unit};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// A perspective or orthographic view: its position and direction, field of view, depth range and
/// size in pixels.
///
/// Shadows are planned for points whose distance along the view direction lies between
/// [`near`](Self::near) and [`far`](Self::far). Cameras are made by [`Camera::look_at`],
/// [`Camera::orthographic`] or, from an engine's matrices, by [`Camera::from_matrices`]. All check
/// their input, so a `Camera` is always valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// The picture's left and lower, and its right and upper edge: a point at a distance (x, y) to
    /// the right of the eye and above it is shown at (x, y)/scale. In perspective views these are
    /// the slopes of the side planes.
    slope_min: DVec2,
    slope_max: DVec2,
    /// The scale at depth 0, metres, and its growth per metre of depth: (0, 1) in perspective
    /// views, where it is the depth, and (the picture's height, 0) in orthographic views.
    scale: [f64; 2],
    near: f64,
    far: f64,
    image: [u32; 2],
}

/// Input to [`Camera::look_at`]. All lengths are in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// Position of the viewer.
    pub eye: DVec3,
    /// The point in the middle of the image.
    pub target: DVec3,
    /// Direction that points up in the image. If it is parallel to the view direction, some
    /// perpendicular direction replaces it.
    pub up: DVec3,
    /// Vertical field of view, radians, in (0, π).
    pub fov_y_rad: f64,
    /// Distance of the near plane, ≥ 1e-12.
    pub near: f64,
    /// Distance beyond which no shadows are needed, > `near`.
    pub far: f64,
    /// Width and height of the image in pixels, 1 ..= 65536 each. Their ratio is the aspect ratio.
    pub image: [u32; 2],
}

/// Input to [`Camera::orthographic`]. All lengths are in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthographic {
    /// The point from which distances along the view count. Lines of sight run beside it, parallel
    /// to each other.
    pub eye: DVec3,
    /// The point in the middle of the image.
    pub target: DVec3,
    /// Direction that points up in the image. If it is parallel to the view direction, some
    /// perpendicular direction replaces it.
    pub up: DVec3,
    /// Height of the part of the world that the image shows, 1e-9 ..= 1e12.
    pub height: f64,
    /// Distance of the near plane, which may lie at the eye or behind it, ≥ −1e12.
    pub near: f64,
    /// Distance beyond which no shadows are needed, > `near`.
    pub far: f64,
    /// Width and height of the image in pixels, 1 ..= 65536 each. Their ratio is the aspect ratio.
    pub image: [u32; 2],
}

/// A line of sight: all points that are shown at one point of the image. Points and vectors are in
/// world axes, relative to the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRay {
    /// The line's point of depth 0, metres: the eye itself in perspective views.
    pub start: DVec3,
    /// Vector along the line whose *depth* is 1 (not its length).
    pub direction: DVec3,
}

impl ViewRay {
    /// The line's point of this depth, relative to the eye, metres.
    pub fn at(&self, depth: f64) -> DVec3 {
        self.start + self.direction * depth
    }
}

/// The depth range of a clip space. Reversed depth is recognised from the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipDepth {
    /// Depths from 0 to 1: WebGPU, Direct3D, Metal, Vulkan.
    ZeroToOne,
    /// Depths from −1 to 1: OpenGL.
    MinusOneToOne,
}

/// Fields of the input to [`Camera::from_matrices`], for its errors.
const POSE: &str = "camera.world_from_view";
const PROJECTION: &str = "camera.clip_from_view";

impl Camera {
    /// A symmetrical view from `eye` towards `target`.
    ///
    /// # Errors
    /// Names the field that is not finite, is a direction of length 0, or is out of its range.
    pub fn look_at(l: LookAt) -> Result<Self, Error> {
        let axes = axes(l.eye, l.target, l.up)?;
        check(
            l.fov_y_rad > 0.0 && l.fov_y_rad < std::f64::consts::PI - 1e-6,
            "camera.fov_y_rad",
            || format!("must lie between 0 and π (180°), is {}", l.fov_y_rad),
        )?;
        let tan_y = (l.fov_y_rad / 2.0).tan();
        Self::symmetrical(l.eye, axes, tan_y, [0.0, 1.0], [l.near, l.far], l.image)
    }

    /// A symmetrical orthographic view from `eye` towards `target`, in which distance makes nothing
    /// smaller.
    ///
    /// # Errors
    /// Names the field that is not finite, is a direction of length 0, or is out of its range.
    pub fn orthographic(o: Orthographic) -> Result<Self, Error> {
        let axes = axes(o.eye, o.target, o.up)?;
        check_height(o.height, "camera.height")?;
        Self::symmetrical(o.eye, axes, 0.5, [o.height, 0.0], [o.near, o.far], o.image)
    }

    /// A view whose upper edge has the slope `slope_y`.
    fn symmetrical(
        eye: DVec3,
        [right, up, forward]: [DVec3; 3],
        slope_y: f64,
        scale: [f64; 2],
        [near, far]: [f64; 2],
        image: [u32; 2],
    ) -> Result<Self, Error> {
        check_image(image)?;
        let slope = DVec2::new(slope_y * f64::from(image[0]) / f64::from(image[1]), slope_y);
        let (slope_min, slope_max) = (-slope, slope);
        Self { eye, right, up, forward, slope_min, slope_max, scale, near, far, image }.checked()
    }

    /// The view of an engine's own matrices. They may have either handedness, depths from 0 to 1 or
    /// from −1 to 1, also reversed, an infinite far plane, and an off-centre frustum.
    ///
    /// `world_from_view` is the camera's rigid pose, `clip_from_view` its perspective or
    /// orthographic projection. An orthographic projection does not tell where the viewer looks.
    /// The pose tells it: one that mirrors belongs to a left-handed view space, which looks along
    /// +z. `shadow_distance` (metres along the view) replaces the far plane's distance if it is
    /// smaller; it is required if the far plane is infinite. `image` is the size in pixels.
    ///
    /// # Errors
    /// If the pose scales, shears or mirrors, if the projection is neither a perspective nor an
    /// orthographic one or flips x or y, or if the required shadow distance is missing.
    pub fn from_matrices(
        world_from_view: DMat4,
        clip_from_view: DMat4,
        clip_depth: ClipDepth,
        shadow_distance: Option<f64>,
        image: [u32; 2],
    ) -> Result<Self, Error> {
        check_image(image)?;
        check(world_from_view.is_finite(), POSE, || "has entries that are not finite".into())?;
        check(clip_from_view.is_finite(), PROJECTION, || "has entries that are not finite".into())?;
        let axes = [0, 1, 2].map(|i| world_from_view.col(i).truncate());
        let is_rigid = axes.iter().all(|a| (a.length() - 1.0).abs() < 1e-3)
            && axes[0].dot(axes[1]).abs() < 1e-3
            && axes[1].dot(axes[2]).abs() < 1e-3
            && axes[2].dot(axes[0]).abs() < 1e-3
            && world_from_view.row(3) == DVec4::W;
        check(is_rigid, POSE, || {
            "must be a rotation and a translation, without scale or shear".into()
        })?;
        check_position(world_from_view.col(3).truncate(), POSE)?;

        let projection = Projection::of(clip_from_view, axes)?;
        let sign = projection.sign;
        let [near, far] = projection.depth_range(clip_depth, shadow_distance)?;
        let forward = (axes[2] * sign).normalize();
        // In a left-handed view space, too, the x axis points right in the image.
        let up = (axes[1] - forward * axes[1].dot(forward)).normalize();
        let right = forward.cross(up);
        check(right.dot(axes[0]) > 0.0, POSE, || {
            "mirrors: handedness of the pose and of the projection disagree".into()
        })?;
        Self {
            eye: world_from_view.col(3).truncate(),
            right,
            up,
            forward,
            slope_min: projection.slope(DVec2::NEG_ONE),
            slope_max: projection.slope(DVec2::ONE),
            scale: projection.scale(),
            near,
            far,
            image,
        }
        .checked()
    }

    fn checked(self) -> Result<Self, Error> {
        // Parallel lines of sight begin anywhere.
        let least = if self.is_orthographic() { -1e12 } else { 1e-12 };
        check(self.near >= least && self.near.is_finite(), "camera.near", || {
            format!("must be finite and at least {least:e}, is {}", self.near)
        })?;
        check(self.far > self.near && self.far <= 1e12, "camera.far", || {
            format!("must exceed camera.near ({}) and be at most 1e12, is {}", self.near, self.far)
        })?;
        let span = self.slope_max - self.slope_min;
        let field = if self.is_orthographic() { "camera.height" } else { "camera.fov_y_rad" };
        check(
            span.min_element() > 1e-9
                && self.slope_min.abs().max(self.slope_max.abs()).max_element() < 1e6,
            field,
            || {
                let [min, max] = [self.slope_min, self.slope_max];
                format!("gives a view of slopes {min} to {max}, too narrow or too wide")
            },
        )?;
        Ok(self)
    }

    /// Position of the viewer, world space, metres.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit vector that points right in the image.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Unit vector that points up in the image.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Unit vector along the view direction.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Distance of the near plane, metres.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Distance beyond which no shadows are needed, metres.
    pub fn far(&self) -> f64 {
        self.far
    }

    /// Width and height of the image in pixels.
    pub fn image(&self) -> [u32; 2] {
        self.image
    }

    /// The same view with another depth range, metres.
    ///
    /// # Errors
    /// Unless 1e-12 ≤ near < far ≤ 1e12.
    pub fn with_depth_range(self, near: f64, far: f64) -> Result<Self, Error> {
        Self { near, far, ..self }.checked()
    }

    /// Distance of a world point along the view direction, metres; negative behind the viewer.
    pub fn depth(&self, world_position: DVec3) -> f64 {
        self.forward.dot(world_position - self.eye)
    }

    /// Whether lines of sight are parallel, so that distance makes nothing smaller.
    pub fn is_orthographic(&self) -> bool {
        self.scale[1] == 0.0
    }

    /// The scale of the picture at a depth, metres: a length across the view that is as large as
    /// the scale takes as many pixels at every depth. In perspective views it is the depth itself.
    pub(crate) fn scale_at(&self, depth: f64) -> f64 {
        self.scale[0] + self.scale[1] * depth
    }

    /// The scale at a point relative to the eye.
    pub(crate) fn scale_of(&self, local: DVec3) -> f64 {
        self.scale_at(self.forward.dot(local))
    }

    /// Half the image's height over its scale. In perspective views it is the tangent of half the
    /// vertical field of view, or in off-centre ones half the image's height at a distance of one
    /// metre, in metres.
    pub(crate) fn half_height(&self) -> f64 {
        (self.slope_max.y - self.slope_min.y) / 2.0
    }

    /// Width of one pixel over the scale, from the height of the image.
    pub(crate) fn pixel_width_per_scale(&self) -> f64 {
        2.0 * self.half_height() / f64::from(self.image[1])
    }

    /// Width of one pixel (of its image beam) at a distance along the view, metres, from the height
    /// of the image. In perspective views it is w_i(z) of Lloyd et al. 2006, Eq. 2, without the
    /// misprinted 1/n. In orthographic views it is the same everywhere.
    pub fn pixel_width(&self, depth: f64) -> f64 {
        self.pixel_width_per_scale() * self.scale_at(depth)
    }

    /// The dot product of this vector and a homogeneous point relative to the eye is the width of a
    /// pixel there, metres.
    pub(crate) fn pixel_gradient(&self) -> DVec4 {
        let [begin, growth] = self.scale.map(|s| s * self.pixel_width_per_scale());
        (self.forward * growth).extend(begin)
    }

    /// The homogeneous position of the viewer relative to the eye. Orthographic views are seen from
    /// infinitely far away.
    pub(crate) fn viewer(&self) -> DVec4 {
        if self.is_orthographic() { -self.forward.extend(0.0) } else { DVec4::W }
    }

    /// The line of sight through a point of the image. `pixel` is (0, 0) at the upper left corner
    /// and `image()` at the lower right one.
    pub fn ray(&self, pixel: DVec2) -> ViewRay {
        let x = pixel.x / f64::from(self.image[0]);
        let y = 1.0 - pixel.y / f64::from(self.image[1]);
        self.ray_of(self.slope_min + (self.slope_max - self.slope_min) * DVec2::new(x, y))
    }

    fn ray_of(&self, slope: DVec2) -> ViewRay {
        let aside = self.right * slope.x + self.up * slope.y;
        let [begin, growth] = self.scale;
        ViewRay { start: aside * begin, direction: aside * growth + self.forward }
    }

    /// Position of a world point in the image, in pixels as for [`ray`](Self::ray); `None` for
    /// points of perspective views that are not in front of the eye.
    pub fn pixel(&self, world_position: DVec3) -> Option<DVec2> {
        let v = world_position - self.eye;
        let scale = self.scale_of(v);
        (scale > 0.0).then(|| {
            let slope = DVec2::new(self.right.dot(v), self.up.dot(v)) / scale;
            let unit = (slope - self.slope_min) / (self.slope_max - self.slope_min);
            DVec2::new(unit.x * f64::from(self.image[0]), (1.0 - unit.y) * f64::from(self.image[1]))
        })
    }

    /// Gradients of both coordinates of [`pixel`](Self::pixel), pixels per metre; `None` for points
    /// of perspective views that are not in front of the eye.
    pub(crate) fn pixel_gradients(&self, world_position: DVec3) -> Option<[DVec3; 2]> {
        let v = world_position - self.eye;
        let scale = self.scale_of(v);
        let span = self.slope_max - self.slope_min;
        let [width, height] = self.image.map(f64::from);
        let gradient =
            |axis: DVec3| (axis - self.forward * (self.scale[1] * axis.dot(v) / scale)) / scale;
        (scale > 0.0).then(|| {
            [gradient(self.right) * (width / span.x), gradient(self.up) * (-height / span.y)]
        })
    }

    /// Slopes to the right and upwards of the frustum's edges: lower left, lower right, upper
    /// right, upper left.
    pub(crate) fn corner_slopes(&self) -> [DVec2; 4] {
        let (lo, hi) = (self.slope_min, self.slope_max);
        [lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y)]
    }

    /// The frustum's edges, in the order of [`corner_slopes`](Self::corner_slopes).
    pub(crate) fn edges(&self) -> [ViewRay; 4] {
        self.corner_slopes().map(|slope| self.ray_of(slope))
    }
}

/// Vectors to the right, upwards and forward of a view from `eye` towards `target`.
fn axes(eye: DVec3, target: DVec3, up: DVec3) -> Result<[DVec3; 3], Error> {
    check_position(eye, "camera.eye")?;
    check_position(target, "camera.target")?;
    let forward = unit(target - eye, "camera.target").map_err(|_| {
        Error::invalid("camera.target", format!("must differ from camera.eye, both are {eye}"))
    })?;
    let up = unit(up, "camera.up")?;
    let right = forward
        .cross(up)
        .try_normalize()
        .filter(|_| forward.cross(up).length() > 1e-9)
        .unwrap_or_else(|| forward.any_orthonormal_vector());
    Ok([right, right.cross(forward), forward])
}

fn check_height(height: f64, field: &'static str) -> Result<(), Error> {
    check((1e-9..=1e12).contains(&height), field, || {
        format!("must lie between 1e-9 and 1e12, is {height}")
    })
}

fn check_image(image: [u32; 2]) -> Result<(), Error> {
    check(image.iter().all(|&n| (1..=65536).contains(&n)), "camera.image", || {
        format!("must be 1 to 65536 pixels each way, is {}x{}", image[0], image[1])
    })
}

/// A projection matrix that has been checked.
struct Projection {
    /// Rows of the matrix.
    rows: [DVec4; 4],
    /// The direction of the view along the z axis of view space.
    sign: f64,
    /// The fourth coordinate's growth per metre along the view in perspective views, its value in
    /// orthographic ones.
    w: f64,
    is_orthographic: bool,
}

impl Projection {
    /// Checks a finite matrix. `axes` are those of view space.
    fn of(clip_from_view: DMat4, axes: [DVec3; 3]) -> Result<Self, Error> {
        let rows @ [x, y, z, w] = [0, 1, 2, 3].map(|i| clip_from_view.row(i));
        let [constant, growth] = [w.w, w.z.abs()];
        let is_orthographic = constant > growth;
        // The sign of w's z entry gives the handedness: −1 looks along −z, +1 along +z.
        let is_left_handed = axes[0].cross(axes[1]).dot(axes[2]) < 0.0;
        let sign = match is_orthographic {
            true if is_left_handed => 1.0,
            true => -1.0,
            false => w.z.signum(),
        };
        // Beside its factor each coordinate has one more entry, for pictures whose middle lies
        // aside: a slope in perspective views, a distance in orthographic ones.
        let (scale, others) = match is_orthographic {
            true => (constant, [x.z, y.z, w.z]),
            false => (growth, [x.w, y.w, w.w]),
        };
        let is_projection = scale > 0.0
            && w.x.abs().max(w.y.abs()).max(others[2].abs()) <= 1e-9 * scale
            && x.y.abs().max(others[0].abs()) <= 1e-9 * x.x.abs()
            && y.x.abs().max(others[1].abs()) <= 1e-9 * y.y.abs()
            && z.x.abs().max(z.y.abs()) <= 1e-9 * z.z.abs().max(z.w.abs())
            && if is_orthographic { z.z != 0.0 } else { z.w != 0.0 };
        check(is_projection, PROJECTION, || {
            "must be a perspective projection (w = ±z) or an orthographic one (w constant), \
             without shear, depth a function of z"
                .into()
        })?;
        check(x.x > 0.0 && y.y > 0.0, PROJECTION, || {
            "must keep x to the right and y up: flip the picture elsewhere".into()
        })?;
        let projection = Self { rows, sign, w: scale, is_orthographic };
        if is_orthographic {
            check_height(projection.scale()[0], PROJECTION)?;
        }
        Ok(projection)
    }

    /// The picture's scale, as [`Camera`] has it.
    fn scale(&self) -> [f64; 2] {
        if self.is_orthographic { [2.0 * self.w / self.rows[1].y, 0.0] } else { [0.0, 1.0] }
    }

    /// The slopes of a point of the picture, from −1 to 1.
    fn slope(&self, ndc: DVec2) -> DVec2 {
        let Self { rows: [x, y, ..], sign, w, is_orthographic } = *self;
        let factors = DVec2::new(x.x, y.y);
        if is_orthographic {
            return (ndc * w - DVec2::new(x.w, y.w)) / factors / self.scale()[0];
        }
        (ndc * w - DVec2::new(x.z, y.z) * sign) / factors
    }

    /// The near and far distance, metres.
    fn depth_range(
        &self,
        clip_depth: ClipDepth,
        shadow_distance: Option<f64>,
    ) -> Result<[f64; 2], Error> {
        let low = match clip_depth {
            ClipDepth::ZeroToOne => 0.0,
            ClipDepth::MinusOneToOne => -1.0,
        };
        let Self { rows: [_, _, z, _], sign, w, is_orthographic } = *self;
        let [near, far] = if is_orthographic {
            // Clip depth at distance d is (z.z·sign·d + z.w)/w.
            let [a, b] = [low, 1.0].map(|ndc| (ndc * w - z.w) / (z.z * sign));
            [a.min(b), a.max(b)]
        } else {
            // Clip depth at distance d is (z.z·sign·d + z.w)/(w·d).
            perspective_range([low, 1.0].map(|ndc| z.w / (ndc * w - z.z * sign)))?
        };
        let far = match shadow_distance {
            None if far == f64::INFINITY => {
                return Err(Error::invalid(
                    "camera.shadow_distance",
                    "is needed, because the projection has no far plane",
                ));
            }
            None => far,
            Some(d) => {
                check(d > near, "camera.shadow_distance", || {
                    format!("must exceed the near distance {near}, is {d}")
                })?;
                far.min(d)
            }
        };
        Ok([near, far])
    }
}

/// The near and far distance of a perspective projection, from the distances at both ends of its
/// depths, metres.
fn perspective_range([a, b]: [f64; 2]) -> Result<[f64; 2], Error> {
    // Because of rounding, an infinite far plane comes out either as ±∞ or as a huge distance of
    // either sign.
    let huge = 1e9 * a.abs().min(b.abs());
    check([a, b].iter().all(|&d| d > 0.0 || d < -huge), PROJECTION, || {
        format!("has its near and far plane at {a} and {b}, not both before the viewer")
    })?;
    let finite = |d: f64| d > 0.0 && d < huge.min(1e12);
    match (finite(a), finite(b)) {
        (true, true) => Ok([a.min(b), a.max(b)]),
        (true, false) => Ok([a, f64::INFINITY]),
        (false, true) => Ok([b, f64::INFINITY]),
        (false, false) => {
            Err(Error::invalid(PROJECTION, "has no near plane in front of the viewer"))
        }
    }
}
