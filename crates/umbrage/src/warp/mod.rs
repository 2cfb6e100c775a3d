//! Warps: homographies of the light plane (x, z of light space), which determine how texels are
//! spread over it.

mod adaptive;
mod light_space;
mod psm;

pub(crate) use adaptive::{Precision, Search};
pub(crate) use light_space::{LightSpace, theta};
pub(crate) use psm::psm;

use crate::camera::Camera;
use crate::math::{largest_stretch, range};
use crate::technique::Warp;
use glam::{DMat3, DVec2, DVec3};

/// The largest strength of a warp; stronger ones would lose all digits.
const MAX_STRENGTH: f64 = 1e9;

/// A point of the body, in light space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Light-space x and z.
    pub xz: DVec2,
    /// Light-space y.
    pub y: f64,
    /// The [scale](Camera::scale_at) of the view, metres, > 0: the distance along the view, or in
    /// orthographic views a constant.
    pub scale: f64,
    /// Length perpendicular to the beam of a unit of light-space x, metres, over `scale`.
    pub base: f64,
    /// The same for a unit of light-space z, measured perpendicular to that length.
    pub height: f64,
}

impl Seen {
    pub(crate) fn new(p: DVec3, space: &LightSpace, camera: &Camera) -> Self {
        let (xz, y) = space.project(p);
        let scale = camera.scale_of(p);
        let (base, height) = match space.apex {
            None => (1.0, 1.0),
            Some(apex) => {
                let r = p - apex;
                let beam = r.normalize();
                let axis_depth = space.w.dot(p.extend(1.0));
                let along = |axis: DVec3| (axis - beam * beam.dot(axis)) * axis_depth;
                let [u, v] = [along(space.x.truncate()), along(space.z.truncate())];
                let base = u.length();
                (base, u.cross(v).length() / base)
            }
        };
        Self { xz, y, scale, base: base / scale, height: height / scale }
    }
}

/// The points of a body in light space, with their outline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    pub seen: &'a [Seen],
    /// Light-space x and z of the corners of the points' convex hull on the light plane. Ratios of
    /// linear functions of x and z are largest and least there.
    pub outline: &'a [DVec2],
}

/// A one-point map of the light plane: w = 1 + `per_z` (z − z₀), s = ((x − center_x)/w −
/// `low`)/`width` and t = `t_per_z` (z − z₀)/w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    center_x: f64,
    z0: f64,
    per_z: f64,
    low: f64,
    width: f64,
    t_per_z: f64,
}

/// A texel's footprint on the light plane: a step in s is (`base`, 0), a step in t (`shear`,
/// `height`), in units of light space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texel {
    pub base: f64,
    pub shear: f64,
    pub height: f64,
}

impl Texel {
    /// Width in the worst direction.
    pub(crate) fn longest(&self) -> f64 {
        largest_stretch(
            self.base * self.base,
            self.shear * self.shear + self.height * self.height,
            self.base * self.shear,
        )
    }
}

impl Shape {
    /// An even map with texels of these widths in x and z.
    pub(crate) fn even([width, height]: [f64; 2]) -> Self {
        Self { center_x: 0.0, z0: 0.0, per_z: 0.0, low: 0.0, width, t_per_z: height.recip() }
    }

    /// Whether all texels have the same shape and size.
    pub(crate) fn is_even(&self) -> bool {
        self.per_z == 0.0
    }

    /// w at light-space z.
    pub(crate) fn w(&self, z: f64) -> f64 {
        1.0 + self.per_z * (z - self.z0)
    }

    /// Distance of a light-space x from the axis of the perspective.
    pub(crate) fn off_axis(&self, x: f64) -> f64 {
        x - self.center_x
    }

    /// The texel, over w, of a map of `resolution` texels where the fourth coordinate is w, at this
    /// distance from the axis. All its lengths are the longest where both arguments are largest.
    pub(crate) fn texel_over_w(&self, w: f64, off_axis: f64, [s, t]: [f64; 2]) -> Texel {
        let per_t = (self.t_per_z * t).recip();
        Texel { base: self.width / s, shear: off_axis * self.per_z * per_t, height: w * per_t }
    }

    /// The homography from (x, z) to (s, t).
    pub(crate) fn homography(&self) -> DMat3 {
        let w = DVec3::new(0.0, self.per_z, 1.0 - self.per_z * self.z0);
        let x = DVec3::new(1.0, 0.0, -self.center_x);
        let s = (x - w * self.low) / self.width;
        let t = DVec3::new(0.0, 1.0, -self.z0) * self.t_per_z;
        DMat3::from_cols(s, t, w).transpose()
    }
}

/// A family of one-point perspectives along z, which divide x by w(z) = 1 + ν (z − z₀)/μ. w
/// grows from 1 at the near plane to 1 + ν at the far plane. ν = μ/λ is the warp's strength; ν
/// = 0 is no warp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OnePoint {
    /// Light-space x of the centre of projection.
    center_x: f64,
    /// Light-space z of the near plane.
    z0: f64,
    /// Depth range μ, light-space units, > 0.
    mu: f64,
    /// The view's least and greatest scale over the points seen, metres: the distances of the
    /// nearest and the farthest of them, or a constant.
    nearest: f64,
    farthest: f64,
}

impl OnePoint {
    /// The family whose near and far plane enclose the points seen.
    pub(crate) fn around(view: &View<'_>, space: &LightSpace) -> Self {
        let (x0, x1) = range(view.outline.iter().map(|p| p.x));
        let (z0, z1) = range(view.outline.iter().map(|p| p.y));
        let (nearest, farthest) = range(view.seen.iter().map(|p| p.scale));
        // The viewer is local space's origin. After a spot light's perspective the viewer's image
        // may lie at or beyond infinity; the middle of the points seen replaces it there.
        let center_x = if space.apex.is_some() { x0.midpoint(x1) } else { 0.0 };
        // A body that is flat and parallel to the light has no depth range.
        let mu = (z1 - z0).max(1e-9 * (x1 - x0)).max(f64::MIN_POSITIVE.sqrt());
        Self { center_x, z0, mu, nearest, farthest }
    }

    /// w at light-space z; it is 1 at the near plane.
    fn w(&self, nu: f64, z: f64) -> f64 {
        1.0 + nu / self.mu * (z - self.z0)
    }

    /// Range of x/w over the outline of the points seen.
    fn extent(&self, nu: f64, outline: &[DVec2]) -> (f64, f64) {
        range(outline.iter().map(|p| (p.x - self.center_x) / self.w(nu, p.y)))
    }

    /// The map of strength ν, scaled so that the points seen fill [0, 1]².
    pub(crate) fn shape(&self, nu: f64, outline: &[DVec2]) -> Shape {
        let (low, high) = self.extent(nu, outline);
        let width = (high - low).max(1e-9 * self.mu);
        let (per_z, t_per_z) = (nu / self.mu, (1.0 + nu) / self.mu);
        Shape { center_x: self.center_x, z0: self.z0, per_z, low, width, t_per_z }
    }

    /// Strength ν of a warp.
    pub(crate) fn strength(
        &self,
        warp: Warp,
        view: &View<'_>,
        space: &LightSpace,
        camera: &Camera,
        (search, precision): (&mut Search, Precision),
    ) -> f64 {
        let strength = match warp {
            Warp::Uniform | Warp::Psm => 0.0,
            Warp::Lambda(lambda) => self.mu / lambda,
            Warp::Adaptive(objective) => {
                // As the view direction passes the light direction, z turns to its opposite, and
                // the best strength for one z is not the best for the other. So the strength fades
                // out before.
                let phi = camera.half_height().atan();
                let fade = (4.0 * space.sin_theta / phi.sin()).min(1.0);
                search.least_error(self, view, objective, precision, fade)
            }
            Warp::Lispsm => self.along_view(space, |view| {
                let f = view.n + (view.f - view.n).min(view.mu_metres * view.sin_theta);
                view.strength(view.n + (view.n * f).sqrt())
            }),
            Warp::Log => self.along_view(space, |view| view.strength(view.n)),
            Warp::Tsm { focus } => self.along_view(space, |view| {
                let focus = camera.forward() * focus.unwrap_or((view.n * view.f).sqrt());
                let delta = space.project(focus).0.y - self.z0;
                let is_before_light = space.w.dot(focus.extend(1.0)) > 0.0;
                if !is_before_light || delta >= 0.8 * self.mu {
                    return 0.0;
                }
                // t(δ) = 0.8 requires λ = 0.2 μ δ/(0.8 μ − δ).
                let nu = (0.8 * self.mu - delta) / (0.2 * delta.max(0.0));
                // The published rule does not fade out as the view direction approaches the light
                // direction, where z is undefined. Here the strength fades out for θ < φ.
                let phi = camera.half_height().atan();
                nu.min(view.strength(view.n)) * (view.sin_theta / phi.sin()).min(1.0)
            }),
        };
        strength.min(MAX_STRENGTH)
    }

    /// The strength that a rule gives from the view's distances; 0 if the view runs along the
    /// light, where z is undefined.
    fn along_view(&self, space: &LightSpace, strength: impl FnOnce(AlongView) -> f64) -> f64 {
        let sin_theta = space.sin_theta;
        if sin_theta <= 1e-12 || space.z_per_view_metre <= 0.0 {
            return 0.0;
        }
        // Metres of the light plane per unit of light-space z, which is 1 under parallel light.
        let metres = sin_theta / space.z_per_view_metre;
        strength(AlongView {
            sin_theta,
            n: self.nearest,
            f: self.farthest,
            mu_metres: self.mu * metres,
        })
    }
}

/// The quantities that the papers' rules for λ depend on.
struct AlongView {
    sin_theta: f64,
    /// View distances of the nearest and the farthest point seen, metres.
    n: f64,
    f: f64,
    /// The warp's depth range μ, metres.
    mu_metres: f64,
}

impl AlongView {
    /// Strength of the warp with λ = `overhead`/sin θ, metres.
    fn strength(&self, overhead: f64) -> f64 {
        self.sin_theta * self.mu_metres / overhead
    }
}
