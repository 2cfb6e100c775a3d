//! Stable maps, whose texels keep their positions in the world.

use crate::camera::Camera;
use crate::light::Projector;
use crate::matrices::{DepthRange, MARGIN_TEXELS, matrices};
use crate::plan::ShadowMap;
use crate::slab::along_axis;
use crate::warp::{LightSpace, Shape};
use glam::{DMat3, DVec2, DVec3, DVec4};

/// The placement of a stable map. Its texels keep their positions and their size in the world,
/// whatever the camera does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stable {
    space: LightSpace,
    region: Region,
    unit_error: f64,
}

#[derive(Clone, Copy, Debug)]
enum Region {
    /// A sphere, covered by a grid of texels that is fixed in the world. The centre is in world
    /// space, metres.
    Sphere { center: DVec3, radius: f64 },
    /// All that a pyramid of light reaches, from 1/far to 1/near in 1/metres.
    Pyramid { slope: f64, inverse_depths: [f64; 2] },
}

impl Stable {
    /// Covers the bounding sphere of the part of the view frustum from `near` to `far`, or, in a
    /// pyramid of light, all that the light reaches.
    pub(crate) fn around(projector: &Projector, camera: &Camera, [near, far]: [f64; 2]) -> Self {
        let space = LightSpace::fixed(projector, camera);
        if let Projector::Pyramid { slope, near, range, .. } = *projector {
            let region = Region::Pyramid { slope, inverse_depths: [range, near].map(f64::recip) };
            // The error of a receiver that the camera sees from the same distance as the lamp. An
            // orthographic view has no such distance; the picture's height replaces it.
            return Self {
                space,
                region,
                unit_error: 2.0 * slope / camera.pixel_width_per_scale(),
            };
        }
        let (center, radius) = bounding_sphere(camera, [near, far]);
        let region = Region::Sphere { center: camera.eye() + center, radius };
        Self { space, region, unit_error: 2.0 * radius / camera.pixel_width(near) }
    }

    /// The map's largest errors in s and t with one texel, pixels per texel, whatever receivers
    /// there are. They are the same in every frame.
    pub(crate) fn unit_errors(&self) -> [f64; 2] {
        [self.unit_error; 2]
    }

    /// The shape of a map of this resolution; `None` in a pyramid of light.
    pub(crate) fn shape(&self, resolution: [u32; 2]) -> Option<Shape> {
        let Region::Sphere { radius, .. } = self.region else { return None };
        let texel = texels(radius, resolution);
        Some(Shape::even([0, 1].map(|i| texel[i] * f64::from(resolution[i]))))
    }

    /// Sets a map's matrices for the resolution that it has. Returns the distance by which the map
    /// has to begin before depth 0, as a share of its range of depths.
    pub(crate) fn place(&self, map: &mut ShadowMap) -> f64 {
        let (middle, width, depth) = match self.region {
            Region::Pyramid { slope, inverse_depths: [far, near] } => {
                let depth = DepthRange::around(far.midpoint(near), (near - far) / 2.0);
                ([0.0; 2], [2.0 * slope; 2], depth)
            }
            Region::Sphere { center, radius } => {
                let texel = texels(radius, map.resolution);
                let width = [0, 1].map(|i| texel[i] * f64::from(map.resolution[i]));
                // The grid's origin is the world's origin, but positions are relative to the eye
                // and small, so that far from the world's origin no digits are lost beyond those
                // that world positions have lost.
                let snapped = |axis: DVec4, step: f64| {
                    let axis = axis.truncate();
                    (axis.dot(center) / step).round() * step - axis.dot(map.origin)
                };
                let middle = [snapped(self.space.x, texel[0]), snapped(self.space.z, texel[1])];
                // Depth moves in steps, too, so that stored depths stay the same between steps.
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
        match self.region {
            // The sphere's range of depths already includes the margin.
            Region::Sphere { .. } => 0.0,
            Region::Pyramid { slope, inverse_depths: [far, near] } => {
                // At the near end a texel's width is 2 slope/res times the distance from the lamp,
                // and 1/distance changes by the same share along that width.
                let shortest = map.resolution[0].min(map.resolution[1]);
                let texel = 2.0 * slope / f64::from(shortest) * near;
                MARGIN_TEXELS * texel / (near - far)
            }
        }
    }
}

/// Widths in s and t of the texels around a sphere. The map is one texel wider than the sphere, and
/// so can move by up to half a texel each way.
fn texels(radius: f64, resolution: [u32; 2]) -> [f64; 2] {
    resolution.map(|n| 2.0 * radius / f64::from(n - 1))
}

/// The bounding sphere of the part of the view frustum from `near` to `far`: centre (local space)
/// and radius, metres. It is computed in the view's own axes, so that the radius is the same to the
/// last digit wherever the camera is and however it is turned.
pub(crate) fn bounding_sphere(camera: &Camera, [near, far]: [f64; 2]) -> (DVec3, f64) {
    let slopes = camera.corner_slopes();
    let middle = slopes.iter().sum::<DVec2>() / 4.0;
    // The centre lies on the frustum's axis, where near and far corners are equally distant, or at
    // the far plane if that is nearer.
    let at = |slope: DVec2, depth: f64| (slope * camera.scale_at(depth)).extend(depth);
    let depth = if camera.is_orthographic() {
        near.midpoint(far)
    } else {
        let [corner, axis] = [slopes[0], middle].map(|slope| slope.extend(1.0));
        ((near + far) * corner.length_squared() / (2.0 * corner.dot(axis))).min(far)
    };
    let center = at(middle, depth);
    let distances = slopes.iter().flat_map(|&s| [near, far].map(|d| at(s, d).distance(center)));
    let radius = distances.fold(0.0, f64::max);
    (camera.right() * center.x + camera.up() * center.y + camera.forward() * center.z, radius)
}
