use crate::error::{Error, check, check_position, unit};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// A perspective view: its position and direction, field of view, depth range and size in pixels.
///
/// Shadows are planned for points whose distance along the view direction lies between
/// [`near`](Self::near) and [`far`](Self::far). Cameras are made by [`Camera::look_at`] or, from an
/// engine's matrices, by [`Camera::from_matrices`]; both check their input, so a `Camera` is always
/// valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Slopes of the side planes: x/z at the left and right edge, y/z at the bottom and top edge.
    slope_min: DVec2,
    slope_max: DVec2,
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
        check_position(l.eye, "camera.eye")?;
        check_position(l.target, "camera.target")?;
        let forward = unit(l.target - l.eye, "camera.target").map_err(|_| {
            Error::invalid(
                "camera.target",
                format!("must differ from camera.eye, both are {}", l.eye),
            )
        })?;
        let up = unit(l.up, "camera.up")?;
        check(
            l.fov_y_rad > 0.0 && l.fov_y_rad < std::f64::consts::PI - 1e-6,
            "camera.fov_y_rad",
            || format!("must lie between 0 and π (180°), is {}", l.fov_y_rad),
        )?;
        check_image(l.image)?;
        let tan_y = (l.fov_y_rad / 2.0).tan();
        let slope = DVec2::new(tan_y * f64::from(l.image[0]) / f64::from(l.image[1]), tan_y);
        let right = forward
            .cross(up)
            .try_normalize()
            .filter(|_| forward.cross(up).length() > 1e-9)
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        Self {
            eye: l.eye,
            right,
            up: right.cross(forward),
            forward,
            slope_min: -slope,
            slope_max: slope,
            near: l.near,
            far: l.far,
            image: l.image,
        }
        .checked()
    }

    /// The view of an engine's own matrices. They may have either handedness, depths from 0 to 1 or
    /// from −1 to 1, also reversed, an infinite far plane, and an off-centre frustum.
    ///
    /// `world_from_view` is the camera's rigid pose, `clip_from_view` its perspective projection.
    /// `shadow_distance` (metres along the view) replaces the far plane's distance if it is
    /// smaller; it is required if the far plane is infinite. `image` is the size in pixels.
    ///
    /// # Errors
    /// If the pose scales, shears or mirrors, if the projection is not a perspective one or flips x
    /// or y, or if the required shadow distance is missing.
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

        let [x, y, z, w] = [0, 1, 2, 3].map(|i| clip_from_view.row(i));
        // The sign of w's z entry gives the handedness: −1 looks along −z, +1 along +z.
        let sign = w.z.signum();
        let scale = w.z.abs();
        let is_perspective = scale > 0.0
            && w.x.abs().max(w.y.abs()).max(w.w.abs()) <= 1e-9 * scale
            && x.y.abs().max(x.w.abs()) <= 1e-9 * x.x.abs()
            && y.x.abs().max(y.w.abs()) <= 1e-9 * y.y.abs()
            && z.x.abs().max(z.y.abs()) <= 1e-9 * z.z.abs().max(z.w.abs())
            && z.w != 0.0;
        check(is_perspective, PROJECTION, || {
            "must be a perspective projection (w = ±z, no shear, depth a function of z)".into()
        })?;
        check(x.x > 0.0 && y.y > 0.0, PROJECTION, || {
            "must keep x to the right and y up: flip the picture elsewhere".into()
        })?;
        let [near, far] = depth_range(z, w, clip_depth, shadow_distance)?;
        let slope = |ndc: DVec2| {
            DVec2::new((ndc.x * scale - x.z * sign) / x.x, (ndc.y * scale - y.z * sign) / y.y)
        };
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
            slope_min: slope(DVec2::NEG_ONE),
            slope_max: slope(DVec2::ONE),
            near,
            far,
            image,
        }
        .checked()
    }

    fn checked(self) -> Result<Self, Error> {
        check(self.near >= 1e-12 && self.near.is_finite(), "camera.near", || {
            format!("must be finite and at least 1e-12, is {}", self.near)
        })?;
        check(self.far > self.near && self.far <= 1e12, "camera.far", || {
            format!("must exceed camera.near ({}) and be at most 1e12, is {}", self.near, self.far)
        })?;
        let span = self.slope_max - self.slope_min;
        check(
            span.min_element() > 1e-9
                && self.slope_min.abs().max(self.slope_max.abs()).max_element() < 1e6,
            "camera.fov_y_rad",
            || {
                format!(
                    "gives a view of slopes {} to {}, too narrow or too wide",
                    self.slope_min, self.slope_max
                )
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

    /// Tangent of half the vertical field of view. For off-centre frusta it is half the image's
    /// height at a distance of one metre, in metres.
    pub fn tan_half_fov_y(&self) -> f64 {
        (self.slope_max.y - self.slope_min.y) / 2.0
    }

    /// Width of one pixel (of its image beam) at a distance of one metre, metres, from the vertical
    /// field of view. w_i(z) of Lloyd et al. 2006, Eq. 2, without the misprinted 1/n, is this value
    /// times z.
    pub fn pixel_width_per_depth(&self) -> f64 {
        2.0 * self.tan_half_fov_y() / f64::from(self.image[1])
    }

    /// The vector from the eye through a point of the image, whose *depth* is 1 (not its length).
    /// `pixel` is (0, 0) at the upper left corner and `image()` at the lower right one.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let x = pixel.x / f64::from(self.image[0]);
        let y = 1.0 - pixel.y / f64::from(self.image[1]);
        let slope = self.slope_min + (self.slope_max - self.slope_min) * DVec2::new(x, y);
        self.right * slope.x + self.up * slope.y + self.forward
    }

    /// Position of a world point in the image, in pixels as for [`ray`](Self::ray); `None` for
    /// points that are not in front of the eye.
    pub fn pixel(&self, world_position: DVec3) -> Option<DVec2> {
        let v = world_position - self.eye;
        let z = self.forward.dot(v);
        (z > 0.0).then(|| {
            let slope = DVec2::new(self.right.dot(v), self.up.dot(v)) / z;
            let unit = (slope - self.slope_min) / (self.slope_max - self.slope_min);
            DVec2::new(unit.x * f64::from(self.image[0]), (1.0 - unit.y) * f64::from(self.image[1]))
        })
    }

    /// Gradients of both coordinates of [`pixel`](Self::pixel), pixels per metre; `None` for points
    /// that are not in front of the eye.
    pub(crate) fn pixel_gradients(&self, world_position: DVec3) -> Option<[DVec3; 2]> {
        let v = world_position - self.eye;
        let z = self.forward.dot(v);
        let span = self.slope_max - self.slope_min;
        let [width, height] = self.image.map(f64::from);
        let gradient = |axis: DVec3| (axis - self.forward * (axis.dot(v) / z)) / z;
        (z > 0.0).then(|| {
            [gradient(self.right) * (width / span.x), gradient(self.up) * (-height / span.y)]
        })
    }

    /// Slopes to the right and upwards of the frustum's edges: lower left, lower right, upper
    /// right, upper left.
    pub(crate) fn corner_slopes(&self) -> [DVec2; 4] {
        let (lo, hi) = (self.slope_min, self.slope_max);
        [lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y)]
    }

    /// The frustum's corners at `depth`, relative to the eye, in the order of
    /// [`corner_slopes`](Self::corner_slopes).
    pub(crate) fn corners_at(&self, depth: f64) -> [DVec3; 4] {
        self.corner_slopes()
            .map(|slope| (self.right * slope.x + self.up * slope.y + self.forward) * depth)
    }
}

fn check_image(image: [u32; 2]) -> Result<(), Error> {
    check(image.iter().all(|&n| (1..=65536).contains(&n)), "camera.image", || {
        format!("must be 1 to 65536 pixels each way, is {}x{}", image[0], image[1])
    })
}

/// The near and far distance of a projection with the rows `z` and `w`, metres.
fn depth_range(
    z: DVec4,
    w: DVec4,
    clip_depth: ClipDepth,
    shadow_distance: Option<f64>,
) -> Result<[f64; 2], Error> {
    let (sign, scale) = (w.z.signum(), w.z.abs());
    // Clip depth at distance d is (z.z·sign·d + z.w)/(scale·d). Solved for d, it gives both ends
    // of the depth range.
    let distance_of = |ndc: f64| z.w / (ndc * scale - z.z * sign);
    let low = match clip_depth {
        ClipDepth::ZeroToOne => 0.0,
        ClipDepth::MinusOneToOne => -1.0,
    };
    let [a, b] = [distance_of(low), distance_of(1.0)];
    // Because of rounding, an infinite far plane comes out either as ±∞ or as a huge distance of
    // either sign.
    let huge = 1e9 * a.abs().min(b.abs());
    check([a, b].iter().all(|&d| d > 0.0 || d < -huge), PROJECTION, || {
        format!("has its near and far plane at {a} and {b}, not both before the viewer")
    })?;
    let finite = |d: f64| d > 0.0 && d < huge.min(1e12);
    let (near, far) = match (finite(a), finite(b)) {
        (true, true) => (a.min(b), a.max(b)),
        (true, false) => (a, f64::INFINITY),
        (false, true) => (b, f64::INFINITY),
        (false, false) => {
            return Err(Error::invalid(PROJECTION, "has no near plane in front of the viewer"));
        }
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
