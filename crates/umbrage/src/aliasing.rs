//! The exact aliasing error of a map at any point, from the Jacobian of the map's own matrix.
//!
//! A texel stands for a beam of light. This beam meets the plane through a point perpendicular to
//! the light in a parallelogram, the texel's [`Footprint`]. The footprint's size over the width of
//! a pixel's image beam at that point, w_i = 2 z tan φ/res_i, is the *perspective* error: pixels
//! per texel without regard to the surface's orientation (Lloyd et al. 2006, Eq. 1, first factor).
//! In orthographic views w_i is the same everywhere, the picture's height over res_i.
//! [`ShadowMap::surface_error`] also includes the exact second factor, the *projection* error.

use crate::camera::Camera;
use crate::math::largest_stretch;
use crate::plan::ShadowMap;
use glam::{DMat2, DVec2, DVec3, DVec4, Vec4Swizzles};

/// The parallelogram that one texel covers on the plane through a point perpendicular to the light,
/// spanned by two vectors in world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Step from one texel to the next in s.
    pub per_s: DVec3,
    /// Step from one texel to the next in t.
    pub per_t: DVec3,
}

impl Footprint {
    /// Length of the parallelogram's base: the texel's width across the warp's axis, metres.
    pub fn base(&self) -> f64 {
        self.per_s.length()
    }

    /// Height of the parallelogram over its base: the texel's width along the warp's axis, metres.
    pub fn height(&self) -> f64 {
        self.per_s.cross(self.per_t).length() / self.per_s.length()
    }

    /// Larger singular value of the map from texel coordinates to the plane: the texel's width in
    /// the worst direction, metres.
    pub fn longest(&self) -> f64 {
        largest_stretch(
            self.per_s.length_squared(),
            self.per_t.length_squared(),
            self.per_s.dot(self.per_t),
        )
    }
}

/// Perspective error at a point, pixels per texel. Above 1, shadow edges show jagged texels; below
/// 1, texels are wasted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointError {
    /// m_s: base of the texel's footprint over a pixel's width.
    pub s: f64,
    /// m_t: height of the texel's footprint over a pixel's width.
    pub t: f64,
    /// Error in the worst direction: the footprint's longest width over a pixel's width.
    pub worst: f64,
}

/// Error on a surface, the product of perspective and projection error, pixels per texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceError {
    /// Error in the worst direction: the larger singular value of the map from texels to pixels.
    /// Infinite where the surface is edge-on to the light.
    pub worst: f64,
    /// Error in the best direction: the smaller singular value.
    pub best: f64,
}

/// A map's projection of one point, with its derivatives.
pub(crate) struct Local {
    /// Shadow coordinates (s, t, depth).
    pub shadow: DVec3,
    /// Fourth coordinate of the projection.
    pub w: f64,
    /// Unit vector along the beam, away from the light.
    pub beam: DVec3,
    /// Gradients of the texel coordinates in s and t, texels per metre.
    pub grad_s: DVec3,
    pub grad_t: DVec3,
    /// Derivative of the map's row coordinate with respect to t.
    pub row_derivative: f64,
    /// Growth of depth along the beam, 1/m.
    pub depth_per_metre: f64,
}

impl Local {
    /// The projection of `p`, in local space; `None` where the map does not apply.
    pub(crate) fn at(map: &ShadowMap, p: DVec3) -> Option<Self> {
        let m = map.shadow_from_local;
        let [s, t, depth, w] = [0, 1, 2, 3].map(|i| m.row(i));
        let h = p.extend(1.0);
        let h_w = w.dot(h);
        if h_w <= 0.0 {
            return None;
        }
        let shadow = DVec3::new(s.dot(h), t.dot(h), depth.dot(h)) / h_w;
        let gradient = |row: DVec4, value: f64| (row.xyz() - w.xyz() * value) / h_w;
        let row_derivative = map.rows.row_derivative(shadow.y);
        let beam = map.beam_direction(p)?;
        Some(Self {
            shadow,
            w: h_w,
            beam,
            grad_s: gradient(s, shadow.x) * f64::from(map.resolution[0]),
            grad_t: gradient(t, shadow.y) * (f64::from(map.resolution[1]) * row_derivative),
            row_derivative,
            depth_per_metre: gradient(depth, shadow.z).dot(beam),
        })
    }

    pub(crate) fn footprint(&self) -> Footprint {
        let det = self.beam.dot(self.grad_s.cross(self.grad_t));
        Footprint {
            per_s: self.grad_t.cross(self.beam) / det,
            per_t: self.beam.cross(self.grad_s) / det,
        }
    }
}

impl ShadowMap {
    /// Unit vector along the beam through a local point, away from the light; `None` at the
    /// position of a spot light.
    pub(crate) fn beam_direction(&self, local: DVec3) -> Option<DVec3> {
        match self.apex {
            Some(apex) => (local - apex).try_normalize(),
            // Parallel beams meet at infinite depth, which is the image of shadow space's depth
            // axis.
            None => self.local_from_shadow.z_axis.truncate().try_normalize(),
        }
    }

    /// Footprint of a texel at a world point; `None` where the map does not apply.
    pub fn footprint(&self, world_position: DVec3) -> Option<Footprint> {
        (!self.is_empty())
            .then(|| Local::at(self, world_position - self.origin))?
            .map(|l| l.footprint())
    }

    /// Perspective error at a world point seen by `camera`; `None` where the map does not apply or
    /// the point lies behind the eye of a perspective view.
    pub fn perspective_error(&self, camera: &Camera, world_position: DVec3) -> Option<PointError> {
        let pixel = camera.pixel_width(camera.depth(world_position));
        let footprint = self.footprint(world_position).filter(|_| pixel > 0.0)?;
        Some(PointError {
            s: footprint.base() / pixel,
            t: footprint.height() / pixel,
            worst: footprint.longest() / pixel,
        })
    }

    /// Error on a surface with the given normal (of any length, to either side) at a world point
    /// seen by `camera`. `None` where the map does not apply, the point lies behind the eye of a
    /// perspective view, or the normal has no direction.
    pub fn surface_error(
        &self,
        camera: &Camera,
        world_position: DVec3,
        world_normal: DVec3,
    ) -> Option<SurfaceError> {
        let local = (!self.is_empty()).then(|| Local::at(self, world_position - self.origin))??;
        let normal = world_normal.try_normalize()?;
        let (e1, e2) = normal.any_orthonormal_pair();
        let [pixel_x, pixel_y] = camera.pixel_gradients(world_position)?;
        let on_surface = |a: DVec3, b: DVec3| {
            DMat2::from_cols(DVec2::new(a.dot(e1), b.dot(e1)), DVec2::new(a.dot(e2), b.dot(e2)))
        };
        let texels = on_surface(local.grad_s, local.grad_t);
        let pixels = on_surface(pixel_x, pixel_y);
        let det = texels.determinant();
        if det == 0.0 {
            return Some(SurfaceError { worst: f64::INFINITY, best: 0.0 });
        }
        // The adjugate divided by the determinant gives infinity for edge-on surfaces where an
        // inverse would give NaN.
        let adjugate = DMat2::from_cols(
            DVec2::new(texels.y_axis.y, -texels.x_axis.y),
            DVec2::new(-texels.y_axis.x, texels.x_axis.x),
        );
        let m = pixels * adjugate;
        let larger = largest_stretch(
            m.x_axis.length_squared(),
            m.y_axis.length_squared(),
            m.x_axis.dot(m.y_axis),
        );
        let smaller = if larger > 0.0 { m.determinant().abs() / larger } else { 0.0 };
        Some(SurfaceError { worst: larger / det.abs(), best: smaller / det.abs() })
    }
}
