use crate::camera::Camera;
use crate::light::{Lamp, Light};
use crate::math::perpendicular_pair;
use crate::partition::Side;
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Light space (Wimmer et al. 2004, §3.4) over local space: for spot lights after the light's own
/// perspective, so that every light's beams are parallel to y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSpace {
    /// Rows of the projective transform from local space: x, y, z and the common divisor. y grows
    /// towards the light.
    pub x: DVec4,
    pub y: DVec4,
    pub z: DVec4,
    pub w: DVec4,
    /// Local position of a spot light.
    pub apex: Option<DVec3>,
    /// Sine of the angle by which the view falls off the way of the light, as rules for λ understand it; for
    /// faces of the frustum 1.
    pub sin_theta: f64,
    /// Light-space z per metre along the view, at the middle of what is seen. For directional lights
    /// sin θ.
    pub z_per_view_metre: f64,
}

impl LightSpace {
    /// Light space for a view, with z following the view direction. `middle` is a local point
    /// amid what is seen.
    pub(crate) fn following_view(lamp: &Lamp, camera: &Camera, middle: DVec3) -> Self {
        let (direction, apex) = lamp.direction_and_apex(camera.eye());
        let beam = apex.map_or(direction, |apex| (middle - apex).normalize());
        let sin_theta = beam.cross(camera.forward()).length();
        Self { sin_theta, ..Self::following(lamp, camera, [camera.forward(); 2], middle) }
    }

    /// Light space for a side face of the view frustum, with z along the bisector of the face's side edges
    /// (Lloyd et al. 2006, §5.1). On the face pixels grow along z as they do along the view under an
    /// overhead light, whatever the light's direction.
    pub(crate) fn following_face(lamp: &Lamp, camera: &Camera, side: &Side, middle: DVec3) -> Self {
        Self::following(lamp, camera, side.edges(), middle)
    }

    /// With z along the bisector of two ways from the eye, of unit depth, as the light sees them.
    fn following(lamp: &Lamp, camera: &Camera, ways: [DVec3; 2], middle: DVec3) -> Self {
        let (direction, apex) = lamp.direction_and_apex(camera.eye());
        let beam = apex.map_or(direction, |apex| (middle - apex).normalize());
        let slopes = ways.map(|way| {
            let slope = apex.map_or(way, |apex| {
                let r = middle - apex;
                let depth = direction.dot(r);
                // Derivative of the light's image of `middle` as it moves along.
                (way - r * (direction.dot(way) / depth)) / depth
            });
            // A way exactly along the light has no direction.
            let is_visible = beam.cross(way).length() > 1e-12;
            if is_visible { slope - direction * direction.dot(slope) } else { DVec3::ZERO }
        });
        let bisector = slopes.map(DVec3::normalize_or_zero).iter().sum::<DVec3>().try_normalize();
        let z_per_view_metre = bisector.map_or(0.0, |z| slopes[0].midpoint(slopes[1]).dot(z));
        // Looking exactly along the light any z will do. Up in the picture is one that keeps
        // still while the viewer moves.
        let z = bisector.unwrap_or_else(|| {
            let up = camera.up();
            (up - direction * direction.dot(up))
                .try_normalize()
                .unwrap_or_else(|| direction.any_orthonormal_vector())
        });
        Self::new(direction, apex, z, 1.0, z_per_view_metre)
    }

    /// Light space with an orientation that depends on the light alone.
    pub(crate) fn fixed(lamp: &Lamp, camera: &Camera) -> Self {
        let (direction, apex) = lamp.direction_and_apex(camera.eye());
        let [_, z] = perpendicular_pair(direction);
        Self::new(direction, apex, z, 0.0, 0.0)
    }

    fn new(
        direction: DVec3,
        apex: Option<DVec3>,
        z: DVec3,
        sin_theta: f64,
        z_per_view_metre: f64,
    ) -> Self {
        // z came out of a difference that cancels as the view turns into the light.
        let z = (z - direction * direction.dot(z)).normalize();
        // To the viewer's right: seen from the light the map is not mirrored.
        let x = direction.cross(z);
        let row = |axis: DVec3| axis.extend(-axis.dot(apex.unwrap_or(DVec3::ZERO)));
        let (y, w) = match apex {
            None => (row(-direction), DVec4::W),
            Some(_) => (DVec4::W, row(direction)),
        };
        Self { x: row(x), y, z: row(z), w, apex, sin_theta, z_per_view_metre }
    }

    /// (x, z) and y of a local point; the divisor must be positive there.
    pub(crate) fn project(&self, p: DVec3) -> (DVec2, f64) {
        let p = p.extend(1.0);
        let w = self.w.dot(p);
        (DVec2::new(self.x.dot(p), self.z.dot(p)) / w, self.y.dot(p) / w)
    }

    /// Inverse of [`light_from_local`](Self::light_from_local).
    pub(crate) fn local_from_light(&self) -> DMat4 {
        let [x, y, z, w] = [self.x, self.y, self.z, self.w].map(DVec4::truncate);
        match self.apex {
            None => DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), DVec4::W),
            Some(apex) => {
                DMat4::from_cols(x.extend(0.0), apex.extend(1.0), z.extend(0.0), w.extend(0.0))
            }
        }
    }

    /// The rows x, y, z, w as a matrix.
    pub(crate) fn light_from_local(&self) -> DMat4 {
        DMat4::from_cols(self.x, self.y, self.z, self.w).transpose()
    }
}

/// Angle θ between view direction and the way of the light at a local point, radians, 0 ..= π.
pub(crate) fn theta(light: &Light, camera: &Camera, p: DVec3) -> f64 {
    let beam = -light.direction_to_light(camera.eye() + p);
    beam.cross(camera.forward()).length().atan2(beam.dot(camera.forward()))
}
