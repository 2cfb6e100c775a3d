//! Turns samples into pictures, lit by a sun and a sky, and into colours that show data.

use crate::{Band, Sample, Surface, View};
use glam::{DVec2, DVec3, Vec3};
use umbrage::{Camera, Light};
use umbrage_scene::daylight::{GLOW, GROUND_LIGHT, HORIZON, NADIR, SKY_LIGHT, SUN, ZENITH};

/// The picture of a band, one sRGB colour per pixel. `visibility` has one value per sample, as
/// [`Band::map`] makes it with [`View::truth`] or
/// [`Reference::visibility`](crate::Reference::visibility).
///
/// # Panics
/// If `visibility` does not have one value per sample.
pub fn picture(view: &View<'_>, band: &Band, visibility: &[f32]) -> Vec<[u8; 3]> {
    pixels(&radiances(view, band, visibility), band.samples_per_pixel())
}

/// Linear colours of a band's samples, those of the sky included. `visibility` is as for
/// [`picture`].
///
/// # Panics
/// If `visibility` does not have one value per sample.
pub fn radiances(view: &View<'_>, band: &Band, visibility: &[f32]) -> Vec<Vec3> {
    assert_eq!(visibility.len(), band.samples().len(), "one value a sample");
    let per_pixel = band.samples_per_pixel();
    let width = view.camera().image()[0] as usize;
    let first_row = f64::from(band.rows().start);
    let samples = band.samples().iter().zip(visibility).enumerate();
    samples
        .map(|(i, (sample, &visibility))| match sample {
            Some(s) => radiance(view.light(), s, visibility),
            None => {
                let pixel = i / per_pixel;
                let corner = DVec2::new((pixel % width) as f64, (pixel / width) as f64 + first_row);
                sky(view.light(), view.camera(), corner + 0.5)
            }
        })
        .collect()
}

/// The sRGB colours of pixels from the linear colours of their samples, which are given pixel by
/// pixel.
pub fn pixels(radiances: &[Vec3], samples_per_pixel: usize) -> Vec<[u8; 3]> {
    let pixels = radiances.chunks(samples_per_pixel.max(1));
    // Tone mapping each sample before averaging keeps edges against a bright sky smooth.
    pixels.map(|p| encode(p.iter().copied().map(compress).sum::<Vec3>() / p.len() as f32)).collect()
}

/// Linear colour of a diffuse surface, lit by the light (as far as it is visible), the sky and the
/// ground.
pub fn radiance(light: &Light, sample: &Sample, visibility: f32) -> Vec3 {
    let surface = &sample.surface;
    let normal = surface.shading_normal;
    let to_light = light.direction_to_light(surface.position);
    let direct =
        SUN * (incidence(light, surface) * visibility * attenuation(light, surface.position));
    // Sky and ground are brighter on the light's side, so the ambient light is too. Shapes can then
    // be told apart in the shade as well.
    let side = DVec3::new(to_light.x, 0.0, to_light.z);
    let up = (0.5 + 0.5 * normal.y) as f32;
    let ambient = GROUND_LIGHT.lerp(SKY_LIGHT, up) * (1.0 + 0.3 * normal.dot(side) as f32);
    surface.base_color * (direct + ambient)
}

/// The cosine between a surface's shading normal and the direction to the light, 0 or above: the
/// factor by which a diffuse surface shows how much light reaches it.
pub fn incidence(light: &Light, surface: &Surface) -> f32 {
    surface.shading_normal.dot(light.direction_to_light(surface.position)).max(0.0) as f32
}

/// The factor by which a spot or point light fades smoothly to nothing at the end of its range: the
/// window of Karis, Real Shading in Unreal Engine 4, 2013, Eq. 9, without the inverse square.
fn attenuation(light: &Light, position: DVec3) -> f32 {
    window(light.share_of_range(position))
}

/// 1 at the light, 0 where its range ends.
fn window(relative_distance: f64) -> f32 {
    (1.0 - relative_distance.powi(4)).max(0.0).powi(2) as f32
}

/// Linear colour of the sky at a point of the picture, which is given in pixels.
pub fn sky(light: &Light, camera: &Camera, pixel: DVec2) -> Vec3 {
    let direction = camera.ray(pixel).direction.normalize();
    let height = direction.y as f32;
    let gradient = if height >= 0.0 {
        HORIZON.lerp(ZENITH, 1.0 - (1.0 - height).powi(3))
    } else {
        HORIZON.lerp(NADIR, 1.0 - (1.0 + height).powi(12))
    };
    let glow = match light {
        Light::Directional { direction: travel } => {
            (-travel.normalize_or_zero().dot(direction)).max(0.0) as f32
        }
        Light::Spot(_) | Light::Point(_) => 0.0,
    };
    gradient + GLOW * glow.powi(6)
}

/// The PBR Neutral tone mapper (Khronos Group, 2024). It compresses highlights. Colours below 0.8
/// keep their values, less the 0.04 that a dielectric's reflection would have added.
fn compress(color: Vec3) -> Vec3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let color = color.max(Vec3::ZERO);
    let low = color.min_element();
    let offset = if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let color = color - offset;
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), gray)
}

/// 8-bit sRGB (IEC 61966-2-1) of a linear colour.
fn encode(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|c| {
        let c = c.clamp(0.0, 1.0);
        let srgb = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (srgb * 255.0).round() as u8
    })
}

/// A unit vector as a colour: each coordinate from −1 to 1 becomes 0 to 255.
pub fn normal_color(normal: DVec3) -> [u8; 3] {
    (normal * 0.5 + 0.5).to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// Depth (metres) as grey, from white at the camera's near distance to black at its far distance,
/// on a logarithmic scale: equal ratios of depth are equal steps of grey. In orthographic views
/// equal differences are.
pub fn depth_color(camera: &Camera, depth: f64) -> [u8; 3] {
    let (near, far) = (camera.near(), camera.far());
    let relative = match camera.is_orthographic() {
        true => (depth - near) / (far - near),
        false => (depth / near).ln() / (far / near).ln(),
    };
    [((1.0 - relative.clamp(0.0, 1.0)) * 255.0).round() as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbrage::LookAt;

    #[test]
    fn compression_keeps_order_hue_and_range() {
        let mut last = -1.0;
        for i in 0..2000 {
            let gray = compress(Vec3::splat(i as f32 * 0.01));
            assert!(gray.x > last && gray.x < 1.0, "{i}: {gray}");
            last = gray.x;
            let warm = compress(Vec3::new(1.0, 0.8, 0.5) * (i as f32 * 0.01));
            assert!(warm.x >= warm.y && warm.y >= warm.z && warm.max_element() < 1.0, "{warm}");
        }
        assert_eq!(compress(Vec3::splat(-1.0)), Vec3::ZERO);
    }

    #[test]
    fn srgb_is_as_the_standard_has_it() {
        assert_eq!(encode(Vec3::new(0.0, 1.0, 7.0)), [0, 255, 255]);
        assert_eq!(encode(Vec3::new(0.214, 0.001, f32::NAN)), [127, 3, 0]);
    }

    #[test]
    fn data_has_its_colours() {
        assert_eq!(normal_color(DVec3::new(0.0, 1.0, -1.0)), [128, 255, 0]);
        let camera = Camera::look_at(LookAt {
            eye: DVec3::ZERO,
            target: DVec3::Z,
            up: DVec3::Y,
            fov_y_rad: 1.0,
            near: 0.1,
            far: 1000.0,
            image: [4, 4],
        })
        .unwrap();
        let grays = [0.01, 0.1, 10.0, 1000.0, 1e9].map(|d| depth_color(&camera, d)[0]);
        assert_eq!(grays, [255, 255, 128, 0, 0]);
        for y in 0..4 {
            let light = Light::Directional { direction: -DVec3::Y };
            let color = sky(&light, &camera, DVec2::new(2.0, f64::from(y)));
            assert!(color.is_finite() && color.min_element() > 0.0);
        }
    }
}
