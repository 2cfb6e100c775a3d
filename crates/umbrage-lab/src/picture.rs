//! Pictures that grow strip by strip, from the top: a value a pixel.

use crate::strip::Strip;
use glam::Vec3;
use umbrage_measure::Rgb;
use umbrage_trace::shade;

/// What shadows look like, whoever made them.
#[derive(Clone, Debug, Default)]
pub struct Shadowed {
    /// The shaded picture.
    pub color: Vec<Rgb>,
    /// 0 (in shadow) ..= 1 (lit). Over the samples that count, if there are any in a pixel; else
    /// over all, the sky being lit.
    pub visibility: Vec<f32>,
}

impl Shadowed {
    /// Adds a strip.
    pub fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        self.color.extend(shade::pixels(&strip.radiance, n));
        let of_all = strip.visibility.chunks(n).map(|v| v.iter().sum::<f32>() / n as f32);
        let counted = strip.means(|i| strip.visibility[i]);
        self.visibility.extend(counted.zip(of_all).map(|(counted, all)| counted.unwrap_or(all)));
    }
}

/// Where a map's texels lie on what is seen.
#[derive(Clone, Debug, Default)]
pub struct Texels {
    /// Pixels per texel in the worst direction, the mean over the samples that count; NaN where
    /// none does or no map serves it.
    pub error: Vec<f32>,
    /// Texel coordinates s and t in the middle of the pixel; NaN where no map serves it.
    pub texel: Vec<[f32; 2]>,
    /// Index of the map that serves the middle of the pixel.
    pub map: Vec<Option<u16>>,
}

impl Texels {
    /// Adds a strip.
    pub fn push(&mut self, strip: &Strip) {
        let means = strip.means(|i| strip.lookups[i].error);
        self.error.extend(means.map(|m| m.unwrap_or(f32::NAN)));
        for middle in strip.middles(&strip.lookups) {
            self.texel.push(middle.texel);
            self.map.push(middle.map);
        }
    }
}

/// What is seen, apart from its shadows.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Linear colour of each pixel: red, green, blue.
    pub radiance: Vec<[f32; 3]>,
    /// In the middle of each pixel, metres; infinite in the sky.
    pub depth: Vec<f32>,
    /// In the middle of each pixel, world space; zero in the sky.
    pub normal: Vec<Vec3>,
}

impl Shape {
    /// Adds a strip.
    pub fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        let pixels = strip.radiance.chunks(n);
        self.radiance.extend(pixels.map(|p| (p.iter().sum::<Vec3>() / n as f32).to_array()));
        self.depth.extend(strip.middles(&strip.depth));
        self.normal.extend(strip.middles(&strip.normal));
    }
}
