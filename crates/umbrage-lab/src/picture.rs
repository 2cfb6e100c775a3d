//! Pictures that grow strip by strip, from the top, with one value for each pixel.

use crate::strip::Strip;
use glam::Vec3;
use umbrage::Plan;
use umbrage::paged::PAGE_TEXELS;
use umbrage_measure::{PARTITIONS, Rgb};
use umbrage_trace::shade;

/// A picture with shadows, whether traced or rendered with shadow maps.
#[derive(Clone, Debug, Default)]
pub struct Shadowed {
    /// Colours of the shaded picture.
    pub color: Vec<Rgb>,
    /// Visibility, 0 (in shadow) to 1 (lit): the mean over the pixel's counted samples or, without
    /// any, over all its samples, where the sky is lit.
    pub visibility: Vec<f32>,
}

impl Shadowed {
    /// Appends a strip.
    pub fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        self.color.extend(shade::pixels(&strip.radiance, n));
        let of_all = strip.visibility.chunks(n).map(|v| v.iter().sum::<f32>() / n as f32);
        let counted = strip.means(|i| strip.visibility[i]);
        self.visibility.extend(counted.zip(of_all).map(|(counted, all)| counted.unwrap_or(all)));
    }
}

/// Positions and sizes of shadow-map texels in the picture.
#[derive(Clone, Debug, Default)]
pub struct Texels {
    /// Pixels per texel in the worst direction, the mean over the counted samples; NaN if no sample
    /// counts or if no map serves one that counts.
    pub error: Vec<f32>,
    /// Texel coordinates s and t in the middle of the pixel; NaN if no map serves it.
    pub texel: Vec<[f32; 2]>,
    /// Index in the plan of the map that serves the middle of the pixel.
    pub map: Vec<Option<u16>>,
}

/// A page that serves a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenPage {
    /// Index in the plan of the map that is the window of the page's level.
    pub map: u16,
    /// The page's place in the window, pages.
    pub place: [u32; 2],
}

impl Texels {
    /// Returns the number of each pixel's tint: the index of the map that serves it or, in plans
    /// with pages, that of the page's level, which is the same in all views.
    pub fn tints(&self, plan: &Plan) -> Vec<Option<u16>> {
        let levels = plan.paging.as_ref().map(|paging| &paging.levels);
        let tint = |map: u16| match levels.and_then(|levels| levels.get(usize::from(map))) {
            Some(window) => window.level.rem_euclid(PARTITIONS.len() as i32) as u16,
            None => map,
        };
        self.map.iter().map(|map| map.map(tint)).collect()
    }

    /// Returns the page that serves the middle of each pixel. The plan must have pages.
    pub fn pages(&self) -> Vec<Option<SeenPage>> {
        let page = |(map, texel): (&Option<u16>, &[f32; 2])| {
            Some(SeenPage { map: (*map)?, place: texel.map(|t| t as u32 / PAGE_TEXELS) })
        };
        self.map.iter().zip(&self.texel).map(page).collect()
    }

    /// Appends a strip.
    pub fn push(&mut self, strip: &Strip) {
        let means = strip.means(|i| strip.lookups[i].error);
        self.error.extend(means.map(|m| m.unwrap_or(f32::NAN)));
        for middle in strip.middles(&strip.lookups) {
            self.texel.push(middle.texel);
            self.map.push(middle.map);
        }
    }
}

/// The visible surfaces, apart from their shadows.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Linear colour of each pixel: red, green, blue.
    pub radiance: Vec<[f32; 3]>,
    /// Depth in the middle of each pixel, metres; infinite in the sky.
    pub depth: Vec<f32>,
    /// Shading normal in the middle of each pixel, world space; zero in the sky.
    pub normal: Vec<Vec3>,
}

impl Shape {
    /// Appends a strip.
    pub fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        let pixels = strip.radiance.chunks(n);
        self.radiance.extend(pixels.map(|p| (p.iter().sum::<Vec3>() / n as f32).to_array()));
        self.depth.extend(strip.middles(&strip.depth));
        self.normal.extend(strip.middles(&strip.normal));
    }
}
