use crate::camera::Camera;
use crate::light::{Light, Projector};
use crate::math::perpendicular_pair;
use crate::partition::Side;
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Light space (Wimmer et al. 2004, §3.4) over local space. Under spot lights it comes after the
/// light's own perspective, so that all beams of every light are parallel to y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSpace {
    /// Rows of the projective transform from local space: x, y, z and the common divisor. y grows
    /// towards the light.
    pub x: DVec4,
    pub y: DVec4,
    pub z: DVec4,
    pub w: DVec4,
    /// Local position of the apex of a pyramid of light.
    pub apex: Option<DVec3>,
    /// Sine of the angle between the view and the light direction, which the rules for λ depend
    /// on; 1 for faces of the frustum.
    pub sin_theta: f64,
    /// Light-space z per metre along the view, at the middle of the receivers seen. For parallel
    /// light it is sin θ.
    pub z_per_view_metre: f64,
}

impl LightSpace {
    /// Light space of a whole view, with z along the view direction. `middle` is a local point amid
    /// the receivers seen.
    pub(crate) fn following_view(projector: &Projector, camera: &Camera, middle: DVec3) -> Self {
        let (direction, apex) = projector.direction_and_apex(camera.eye());
        let beam = apex.map_or(direction, |apex| (middle - apex).normalize());
        let sin_theta = beam.cross(camera.forward()).length();
        Self { sin_theta, ..Self::following(projector, camera, [camera.forward(); 2], middle) }
    }

    /// Light space of a side face of the view frustum, with z along the bisector of the face's side
    /// edges (Lloyd et al. 2006, §5.1). Whatever the light's direction, the width of a pixel on
    /// the face grows along z as it grows along the view under overhead light.
    pub(crate) fn following_face(
        projector: &Projector,
        camera: &Camera,
        side: &Side,
        middle: DVec3,
    ) -> Self {
        Self::following(projector, camera, side.edges(), middle)
    }

    /// Light space with z along the bisector of two vectors from the eye, of depth 1, as seen from
    /// the light.
    fn following(projector: &Projector, camera: &Camera, ways: [DVec3; 2], middle: DVec3) -> Self {
        let (direction, apex) = projector.direction_and_apex(camera.eye());
        let beam = apex.map_or(direction, |apex| (middle - apex).normalize());
        let slopes = ways.map(|way| {
            let slope = apex.map_or(way, |apex| {
                let r = middle - apex;
                let depth = direction.dot(r);
                // Derivative of the light's image of `middle` while it moves along the vector.
                (way - r * (direction.dot(way) / depth)) / depth
            });
            // A vector exactly along the light has no direction in the light's image.
            let is_visible = beam.cross(way).length() > 1e-12;
            if is_visible { slope - direction * direction.dot(slope) } else { DVec3::ZERO }
        });
        let bisector = slopes.map(DVec3::normalize_or_zero).iter().sum::<DVec3>().try_normalize();
        let z_per_view_metre = bisector.map_or(0.0, |z| slopes[0].midpoint(slopes[1]).dot(z));
        // If the view runs exactly along the light, any z will do. The image's upward direction is
        // one that does not change while the viewer moves.
        let z = bisector.unwrap_or_else(|| {
            let up = camera.up();
            (up - direction * direction.dot(up))
                .try_normalize()
                .unwrap_or_else(|| direction.any_orthonormal_vector())
        });
        Self::new(direction, apex, z, 1.0, z_per_view_metre)
    }

    /// Light space whose orientation depends on the light alone.
    pub(crate) fn fixed(projector: &Projector, camera: &Camera) -> Self {
        let (direction, apex) = projector.direction_and_apex(camera.eye());
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
        // z comes from a difference that loses digits as the view direction approaches the light
        // direction.
        let z = (z - direction * direction.dot(z)).normalize();
        // x points to the viewer's right, so that the light's view of the map is not mirrored.
        let x = direction.cross(z);
        let row = |axis: DVec3| axis.extend(-axis.dot(apex.unwrap_or(DVec3::ZERO)));
        let (y, w) = match apex {
            None => (row(-direction), DVec4::W),
            Some(_) => (DVec4::W, row(direction)),
        };
        Self { x: row(x), y, z: row(z), w, apex, sin_theta, z_per_view_metre }
    }

    /// (x, z) and y of a local point, at which the divisor must be positive.
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

    /// The matrix of the rows x, y, z and w.
    pub(crate) fn light_from_local(&self) -> DMat4 {
        DMat4::from_cols(self.x, self.y, self.z, self.w).transpose()
    }
}

/// Angle θ between the view direction and the light direction at a local point, radians, 0 ..= π.
pub(crate) fn theta(light: &Light, camera: &Camera, p: DVec3) -> f64 {
    let beam = -light.direction_to_light(camera.eye() + p);
    beam.cross(camera.forward()).length().atan2(beam.dot(camera.forward()))
}
