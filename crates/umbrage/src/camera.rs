use crate::error::{Error, check, check_position, unit};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// A perspective view: where from, where to, how wide, how far, onto how many pixels.
///
/// Shadows are planned for the points between [`near`](Self::near) and [`far`](Self::far), measured
/// along the view direction. Create one with [`Camera::look_at`] or from an engine's matrices with
/// [`Camera::from_matrices`]; both check their input, so a `Camera` is always valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Slopes of the side planes: x/z at the left and right, y/z at the bottom and top edge.
    slope_min: DVec2,
    slope_max: DVec2,
    near: f64,
    far: f64,
    image: [u32; 2],
}

/// Input to [`Camera::look_at`]. All lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// Position of the viewer.
    pub eye: DVec3,
    /// The point in the middle of the picture.
    pub target: DVec3,
    /// Direction that is up in the picture. If it is parallel to the view, an axis that is not
    /// takes its place.
    pub up: DVec3,
    /// Vertical field of view, radians, in (0, π).
    pub fov_y_rad: f64,
    /// Distance at which the view begins, ≥ 1e-12.
    pub near: f64,
    /// Distance at which shadows end, > `near`.
    pub far: f64,
    /// Pixels, width and height, 1 ..= 65536 each. Their ratio is the aspect ratio.
    pub image: [u32; 2],
}

/// Which depth range a clip space has. Reversed depth needs no telling: it shows in the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipDepth {
    /// WebGPU, Direct3D, Metal, Vulkan.
    ZeroToOne,
    /// OpenGL.
    MinusOneToOne,
}

impl Camera {
    /// A symmetrical view from `eye` towards `target`.
    ///
    /// # Errors
    /// Names the field that is not finite, has no length, or is out of its range.
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

    /// The view of an engine's own matrices: any handedness, depth 0 to 1, −1 to 1, reversed, or
    /// infinitely far, off-centre frusta included.
    ///
    /// `world_from_view` is the camera's rigid pose, `clip_from_view` its perspective projection.
    /// `shadow_distance` (metres, along the view) replaces the far plane where it is nearer; an
    /// infinite projection needs it.
    ///
    /// # Errors
    /// A pose that scales, shears or mirrors, a projection that is not a perspective one or turns
    /// x or y upside down, a missing shadow distance.
    pub fn from_matrices(
        world_from_view: DMat4,
        clip_from_view: DMat4,
        clip_depth: ClipDepth,
        shadow_distance: Option<f64>,
        image: [u32; 2],
    ) -> Result<Self, Error> {
        const POSE: &str = "camera.world_from_view";
        const PROJECTION: &str = "camera.clip_from_view";
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
        // The sign of w's z entry is the handedness: −1 looks along −z, +1 along +z.
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
        // Clip depth at distance d is (z.z·sign·d + z.w)/(scale·d): solve for the two ends.
        let distance_of = |ndc: f64| z.w / (ndc * scale - z.z * sign);
        let low = match clip_depth {
            ClipDepth::ZeroToOne => 0.0,
            ClipDepth::MinusOneToOne => -1.0,
        };
        let [a, b] = [distance_of(low), distance_of(1.0)];
        // An infinite far plane comes out as ±∞, or as a huge distance of either sign by rounding.
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
        let slope = |ndc: DVec2| {
            DVec2::new((ndc.x * scale - x.z * sign) / x.x, (ndc.y * scale - y.z * sign) / y.y)
        };
        let forward = (axes[2] * sign).normalize();
        // In a left-handed view space the x axis still points right in the picture.
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

    /// Unit vector to the right in the picture.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Unit vector up in the picture.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Unit vector of the view direction.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Distance at which the view begins, metres.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Distance at which shadows end, metres.
    pub fn far(&self) -> f64 {
        self.far
    }

    /// Pixels, width and height.
    pub fn image(&self) -> [u32; 2] {
        self.image
    }

    /// The same view with another depth range, metres.
    ///
    /// # Errors
    /// Unless 0 < near < far.
    pub fn with_depth_range(self, near: f64, far: f64) -> Result<Self, Error> {
        Self { near, far, ..self }.checked()
    }

    /// Distance of a world point along the view direction, metres; negative behind the viewer.
    pub fn depth(&self, world_position: DVec3) -> f64 {
        self.forward.dot(world_position - self.eye)
    }

    /// Tangent of half the vertical field of view (of the whole one's half, if off-centre).
    pub fn tan_half_fov_y(&self) -> f64 {
        (self.slope_max.y - self.slope_min.y) / 2.0
    }

    /// Width of an image beam (one pixel) at a distance of one metre, metres: w_i(z) is this times z
    /// (Lloyd et al. 2006, Eq. 2, without the misprinted 1/n), from the vertical field of view.
    pub fn pixel_width_per_depth(&self) -> f64 {
        2.0 * self.tan_half_fov_y() / f64::from(self.image[1])
    }

    /// The vector from the eye through a point of the picture, of unit *depth* (not unit length).
    /// `pixel` is (0, 0) at the upper left corner and `image()` at the lower right.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let x = pixel.x / f64::from(self.image[0]);
        let y = 1.0 - pixel.y / f64::from(self.image[1]);
        let slope = self.slope_min + (self.slope_max - self.slope_min) * DVec2::new(x, y);
        self.right * slope.x + self.up * slope.y + self.forward
    }

    /// Where a world point appears in the picture, in pixels as for [`ray`](Self::ray); `None`
    /// for points not in front of the eye.
    pub fn pixel(&self, world_position: DVec3) -> Option<DVec2> {
        let v = world_position - self.eye;
        let z = self.forward.dot(v);
        (z > 0.0).then(|| {
            let slope = DVec2::new(self.right.dot(v), self.up.dot(v)) / z;
            let unit = (slope - self.slope_min) / (self.slope_max - self.slope_min);
            DVec2::new(unit.x * f64::from(self.image[0]), (1.0 - unit.y) * f64::from(self.image[1]))
        })
    }

    /// Gradients of [`pixel`](Self::pixel)'s two coordinates, pixels per metre; `None` for points not
    /// in front of the eye.
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

    /// Slopes, right and up, of the frustum's edges: lower left, lower right, upper right, upper left.
    pub(crate) fn corner_slopes(&self) -> [DVec2; 4] {
        let (lo, hi) = (self.slope_min, self.slope_max);
        [lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y)]
    }

    /// The frustum's corners at `depth`, relative to the eye, in the order of their slopes.
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
