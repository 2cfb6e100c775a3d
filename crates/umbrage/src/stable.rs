//! Stable maps: their texels keep their places in the world.

use crate::camera::Camera;
use crate::light::Lamp;
use crate::matrices::{DepthRange, MARGIN_TEXELS, matrices};
use crate::plan::ShadowMap;
use crate::slab::along_axis;
use crate::warp::LightSpace;
use glam::{DMat3, DVec3, DVec4};

/// Where a stable map lies: its texels keep their places and their size, whatever the camera does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stable {
    space: LightSpace,
    covers: Covers,
    unit_error: f64,
}

#[derive(Clone, Copy, Debug)]
enum Covers {
    /// A sphere, on a grid of texels that is fixed in the world. Middle in world space, metres.
    Sphere { center: DVec3, radius: f64 },
    /// All that a lamp shines on, from 1/far to 1/near in 1/metres.
    Pyramid { slope: f64, inverse_depths: [f64; 2] },
}

impl Stable {
    /// Around the part of the view frustum from `near` to `far`; under a lamp around all it shines on.
    pub(crate) fn around(lamp: &Lamp, camera: &Camera, [near, far]: [f64; 2]) -> Self {
        let space = LightSpace::fixed(lamp, camera);
        let pixel = camera.pixel_width_per_depth();
        if let Lamp::Pyramid { slope, near, range, .. } = *lamp {
            let covers = Covers::Pyramid { slope, inverse_depths: [range, near].map(f64::recip) };
            // As if what it shines on were seen from as far away as the lamp is.
            return Self { space, covers, unit_error: 2.0 * slope / pixel };
        }
        let (center, radius) = bounding_sphere(camera, [near, far]);
        let covers = Covers::Sphere { center: camera.eye() + center, radius };
        Self { space, covers, unit_error: 2.0 * radius / (near * pixel) }
    }

    /// The map's largest errors in s and t at one texel, pixels per texel, whatever receivers there are: the
    /// same in every frame.
    pub(crate) fn unit_errors(&self) -> [f64; 2] {
        [self.unit_error; 2]
    }

    /// Sets a map's matrices, for the resolution it has. Gives how far before depth 0 the map has to
    /// begin, as a share of its range of depths.
    pub(crate) fn place(&self, map: &mut ShadowMap) -> f64 {
        let (middle, width, depth) = match self.covers {
            Covers::Pyramid { slope, inverse_depths: [far, near] } => {
                let depth = DepthRange::around(far.midpoint(near), (near - far) / 2.0);
                ([0.0; 2], [2.0 * slope; 2], depth)
            }
            Covers::Sphere { center, radius } => {
                // A texel more than the sphere takes leaves room to move by up to half a texel each way.
                let texel = map.resolution.map(|n| 2.0 * radius / f64::from(n - 1));
                let width = [0, 1].map(|i| texel[i] * f64::from(map.resolution[i]));
                // The origin of the grid is the world's. What is measured from the eye is small: no digits
                // are lost far from the world's origin but those that world positions have lost.
                let snapped = |axis: DVec4, step: f64| {
                    let axis = axis.truncate();
                    (axis.dot(center) / step).round() * step - axis.dot(map.origin)
                };
                let middle = [snapped(self.space.x, texel[0]), snapped(self.space.z, texel[1])];
                // Depth moves in steps as well, so that what is stored does not change in between.
                let margin = (1.0 + MARGIN_TEXELS) * texel[0].max(texel[1]);
                let depth = DepthRange::around(snapped(self.space.y, texel[0]), radius + margin);
                (middle, width, depth)
            }
        };
        let s = DVec3::new(1.0, 0.0, width[0] / 2.0 - middle[0]) / width[0];
        let t = DVec3::new(0.0, 1.0, width[1] / 2.0 - middle[1]) / width[1];
        let homography = DMat3::from_cols(s, t, DVec3::Z).transpose();
        [map.shadow_from_local, map.local_from_shadow] = matrices(homography, depth, &self.space);
        map.apex = self.space.apex;
        map.slab = along_axis(&self.space);
        match self.covers {
            // A sphere's depths have their margin already.
            Covers::Sphere { .. } => 0.0,
            Covers::Pyramid { slope, inverse_depths: [far, near] } => {
                // A texel there is 2 slope/res of the way to the lamp wide, and 1/depth grows by as much.
                let shortest = map.resolution[0].min(map.resolution[1]);
                let texel = 2.0 * slope / f64::from(shortest) * near;
                MARGIN_TEXELS * texel / (near - far)
            }
        }
    }
}

/// The sphere around the part of the view frustum from `near` to `far`: middle (local space) and radius,
/// metres. Found among the view's own axes: wherever the camera is and however it is turned, the radius
/// is the same to the last digit.
pub(crate) fn bounding_sphere(camera: &Camera, [near, far]: [f64; 2]) -> (DVec3, f64) {
    let corners = camera.corner_slopes().map(|slope| slope.extend(1.0));
    // On the axis of the frustum, where near and far corners are equally far, or at the far plane.
    let axis = corners.iter().sum::<DVec3>() / 4.0;
    let depth =
        ((near + far) * corners[0].length_squared() / (2.0 * corners[0].dot(axis))).min(far);
    let center = axis * depth;
    let distances = corners.iter().flat_map(|&c| [near, far].map(|d| (c * d).distance(center)));
    let radius = distances.fold(0.0, f64::max);
    (camera.right() * center.x + camera.up() * center.y + camera.forward() * center.z, radius)
}
