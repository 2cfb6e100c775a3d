//! Some rows of a picture with values for each sample, computed by a GPU or the CPU.

use crate::error::{About, Error, Field};
use glam::Vec3;
use std::cell::OnceCell;
use std::ops::Range;
use umbrage::visibility::LightSize;
use umbrage::{Camera, Plan};
use umbrage_measure::AreaTruth;
use umbrage_trace::{AreaLight, AreaVisibility, Band, Progress, Reference, Sample, View, shade};

/// Message about a picture without counted pixels.
pub const NOTHING_TO_SHADOW: &str = "no pixel shows a surface that faces the light within \
     the view's range: there are no shadows to see";

/// Some rows of a picture, and the surfaces that the CPU sees there. Their rays are only traced
/// when the surfaces are first needed.
pub struct Rows<'a> {
    view: &'a View<'a>,
    range: Range<u32>,
    progress: Progress<'a>,
    band: OnceCell<Band>,
}

impl<'a> Rows<'a> {
    /// Selects rows of a view's picture, counted from the top. `progress` is told of rows of rays.
    pub fn new(view: &'a View<'a>, range: Range<u32>, progress: Progress<'a>) -> Self {
        Self { view, range, progress, band: OnceCell::new() }
    }

    /// Returns the view that the rows belong to.
    pub(crate) fn view(&self) -> &'a View<'a> {
        self.view
    }

    /// Returns the indices of the rows.
    pub(crate) fn range(&self) -> Range<u32> {
        self.range.clone()
    }

    /// Returns the surfaces that rays hit, tracing the rays at the first call.
    fn band(&self) -> &Band {
        self.band.get_or_init(|| self.view.band(self.range.clone(), self.progress))
    }

    /// Returns the rows with ray-traced shadows, which are the truth.
    pub fn truth(&self) -> Strip {
        let band = self.band();
        Strip::new(self.view, band, band.map(|s| self.view.truth(s), self.progress))
    }

    /// Returns the rows with the ray-traced soft shadows of a light of this size, and how certain
    /// they are.
    ///
    /// # Errors
    /// An error if the light cannot have this size.
    pub fn area_truth(&self, size: LightSize) -> Result<(Strip, Certainty), Error> {
        let area = AreaLight::new(self.view, size).about(Field::LightSize)?;
        let band = self.band();
        let seen = band.map(|s| area.visibility(s), self.progress);
        let strip = Strip::new(self.view, band, seen.iter().map(|v| v.visibility).collect());
        let certainty = Certainty::of_pixels(&seen, band.samples_per_pixel());
        Ok((strip, certainty))
    }

    /// Returns the mean cosine between surface and light of each pixel of `truth`, which must be
    /// that of these rows, over the samples that count; 0 without any.
    pub(crate) fn cosines(&self, truth: &Strip) -> impl Iterator<Item = f32> {
        let cosine = |s: &Sample| shade::incidence(self.view.light(), &s.surface);
        let cosines = self.band().map(cosine, &|_| {});
        truth.means(move |i| cosines[i]).map(|mean| mean.unwrap_or(0.0))
    }

    /// Returns the mean perspective error of each pixel of `truth`, which must be that of these
    /// rows, over the samples that count, pixels per texel; NaN if none counts or if no map of the
    /// plan serves one that counts.
    pub(crate) fn perspective_errors(
        &self,
        truth: &Strip,
        plan: &Plan,
    ) -> impl Iterator<Item = f32> {
        let error = |s: &Sample| {
            let position = s.surface.position;
            let (map, _) = plan.lookup(0, position).max_by(|a, b| a.1.total_cmp(&b.1))?;
            plan.maps[map].perspective_error(self.view.camera(), position)
        };
        let errors = self.band().map(|s| error(s).map(|e| e.worst as f32), &|_| {});
        truth.means(move |i| errors[i].unwrap_or(f32::NAN)).map(|mean| mean.unwrap_or(f32::NAN))
    }

    /// Returns the rows without shadows, as if nothing cast any.
    pub fn in_full_light(&self) -> Strip {
        let band = self.band();
        Strip::new(self.view, band, vec![1.0; band.samples().len()])
    }

    /// Returns the rows with the shadows of a plan's maps, rendered by the CPU reference.
    pub fn by_reference(&self, plan: &Plan, reference: &Reference<'_>) -> Strip {
        let band = self.band();
        let visibility = band.map(|s| reference.visibility(0, s), self.progress);
        let lookup = |s: &Sample| Lookup::of(plan, reference, self.view.camera(), s);
        Strip { lookups: band.map(lookup, &|_| {}), ..Strip::new(self.view, band, visibility) }
    }
}

/// How certain the truth of an area light is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Certainty {
    /// Number of pixels.
    pub pixels: u64,
    /// Number of shadow rays.
    pub rays: u64,
    /// The largest standard error of a pixel's visibility.
    pub standard_error: f64,
}

impl Certainty {
    /// The certainty of pixels with `n` samples each.
    fn of_pixels(seen: &[AreaVisibility], n: usize) -> Self {
        let standard_error = |pixel: &[AreaVisibility]| {
            let variances = pixel.iter().map(|v| f64::from(v.standard_error).powi(2));
            variances.sum::<f64>().sqrt() / n as f64
        };
        Self {
            pixels: (seen.len() / n) as u64,
            rays: seen.iter().map(|v| u64::from(v.rays)).sum(),
            standard_error: seen.chunks(n).map(standard_error).fold(0.0, f64::max),
        }
    }

    /// Returns the certainty in the form that reports show, for a light of this size.
    pub(crate) fn of_light(self, size: LightSize) -> AreaTruth {
        AreaTruth {
            light_size: size.to_string(),
            standard_error: self.standard_error,
            shadow_rays_per_pixel: self.rays as f64 / self.pixels as f64,
        }
    }

    /// Adds the certainty of other pixels.
    pub fn add(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.rays += other.rays;
        self.standard_error = self.standard_error.max(other.standard_error);
    }
}

/// Some rows of a picture with values for each sample, pixel after pixel, from a GPU or the CPU.
pub struct Strip {
    pub(crate) samples_per_pixel: usize,
    /// Linear colour.
    pub(crate) radiance: Vec<Vec3>,
    /// Visibility, 0 (in shadow) to 1 (lit); 1 in the sky.
    pub(crate) visibility: Vec<f32>,
    /// Whether the sample shows a surface whose shadow [counts](View::counts).
    counts: Vec<bool>,
    /// Depth, metres; infinite in the sky.
    pub(crate) depth: Vec<f32>,
    /// Shading normal in world space; zero in the sky.
    pub(crate) normal: Vec<Vec3>,
    /// Lookups in shadow maps; empty if the CPU computed the strip without maps.
    pub(crate) lookups: Vec<Lookup>,
}

/// The shadow map and the texel that serve a sample.
#[derive(Clone, Copy)]
pub(crate) struct Lookup {
    /// Pixels per texel on the surface in the worst direction; NaN without a map.
    pub(crate) error: f32,
    /// Texel coordinates in the map; NaN without a map.
    pub(crate) texel: [f32; 2],
    /// Index in the plan of the map that serves the sample.
    pub(crate) map: Option<u16>,
}

impl Default for Lookup {
    fn default() -> Self {
        Self { error: f32::NAN, texel: [f32::NAN; 2], map: None }
    }
}

impl Lookup {
    fn of(plan: &Plan, reference: &Reference<'_>, camera: &Camera, sample: &Sample) -> Self {
        let surface = &sample.surface;
        let Some(place) = reference.texel(0, surface.position) else {
            return Self::default();
        };
        let error =
            plan.maps[place.map].surface_error(camera, surface.position, surface.geometric_normal);
        Self {
            error: error.map_or(f32::NAN, |e| e.worst as f32),
            texel: place.texel.as_vec2().to_array(),
            map: u16::try_from(place.map).ok(),
        }
    }
}

impl Strip {
    fn new(view: &View<'_>, band: &Band, visibility: Vec<f32>) -> Self {
        let samples = || band.samples().iter().map(Option::as_ref);
        let counts = |s: &Sample| view.counts(s.is_facing, s.depth);
        Self {
            samples_per_pixel: band.samples_per_pixel(),
            radiance: shade::radiances(view, band, &visibility),
            counts: samples().map(|s| s.is_some_and(counts)).collect(),
            depth: samples().map(|s| s.map_or(f32::INFINITY, |s| s.depth as f32)).collect(),
            normal: samples()
                .map(|s| s.map_or(Vec3::ZERO, |s| s.surface.shading_normal.as_vec3()))
                .collect(),
            visibility: samples().zip(visibility).map(|(s, v)| s.map_or(1.0, |_| v)).collect(),
            lookups: Vec::new(),
        }
    }

    /// Makes a strip of samples that a GPU has drawn.
    pub(crate) fn of_gpu(samples: &[umbrage_render::Sample], view: &View<'_>) -> Self {
        type Drawn = umbrage_render::Sample;
        let counts = |s: &Drawn| view.counts(s.is_facing, s.depth.into());
        let lookup = |s: &Drawn| Lookup {
            error: s.error,
            texel: s.texel.to_array(),
            map: s.map.and_then(|m| u16::try_from(m).ok()),
        };
        Self {
            samples_per_pixel: view.grid().pow(2) as usize,
            radiance: samples.iter().map(|s| s.radiance).collect(),
            visibility: samples.iter().map(|s| s.visibility).collect(),
            counts: samples.iter().map(counts).collect(),
            depth: samples.iter().map(|s| s.depth).collect(),
            normal: samples.iter().map(|s| s.normal).collect(),
            lookups: samples.iter().map(lookup).collect(),
        }
    }

    /// Returns the visibility of each sample, 0 (in shadow) to 1 (lit); 1 in the sky.
    pub fn visibility(&self) -> &[f32] {
        &self.visibility
    }

    /// Returns each pixel's mean of a value over the samples that count; `None` if none does.
    pub(crate) fn means(&self, value: impl Fn(usize) -> f32) -> impl Iterator<Item = Option<f32>> {
        let n = self.samples_per_pixel;
        self.counts.chunks(n).enumerate().map(move |(pixel, counts)| {
            let counted = counts.iter().enumerate().filter(|(_, counts)| **counts);
            let values = counted.map(|(i, _)| value(pixel * n + i));
            let (sum, count) = values.fold((0.0, 0u32), |(sum, n), v| (sum + v, n + 1));
            (count > 0).then(|| sum / count as f32)
        })
    }

    /// Returns whether each pixel counts, which it does if any of its samples counts.
    pub fn counted(&self) -> impl Iterator<Item = bool> {
        self.counts.chunks(self.samples_per_pixel).map(|counts| counts.contains(&true))
    }

    /// Returns a value for each pixel, that of the sample in its middle or next to the middle.
    pub(crate) fn middles<'a, T>(&self, values: &'a [T]) -> impl Iterator<Item = &'a T> {
        let grid = self.samples_per_pixel.isqrt();
        let middle = grid / 2 * grid + grid / 2;
        values.iter().skip(middle).step_by(self.samples_per_pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use umbrage::{Light, LookAt};
    use umbrage_trace::Tracer;

    #[test]
    fn perspective_errors_are_widths_of_texels_over_those_of_pixels() {
        let scene = umbrage_scene::builtin("pole", None).unwrap();
        let tracer = Tracer::new(&scene).unwrap();
        let travel = DVec3::new(0.3, -1.0, 0.5);
        let light = Light::Directional { direction: travel };
        let (fov_y_rad, image) = (1.0, [48, 32]);
        let look_at = LookAt {
            eye: DVec3::new(-2.5, 3.4, 7.5),
            target: DVec3::Y,
            up: DVec3::Y,
            fov_y_rad,
            near: 0.1,
            far: 100.0,
            image,
        };
        let camera = Camera::look_at(look_at).unwrap();
        let view = View::new(&tracer, camera, light, 1).unwrap();
        let bounds = umbrage::Bounds::of_scene(scene.bounds());
        let technique = umbrage::Technique::default();
        let mut planner = umbrage::Planner::new();
        let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
        let rows = Rows::new(&view, 0..image[1], &|_| {});
        let truth = rows.truth();
        let found: Vec<f32> = rows.perspective_errors(&truth, plan).collect();
        assert_eq!(found.len(), (image[0] * image[1]) as usize);
        let map = &plan.maps[0];
        let texel =
            |p| map.project(p).unwrap().truncate() * glam::UVec2::from(map.resolution).as_dvec2();
        let mut counted = 0;
        for (y, x) in (0..image[1]).flat_map(|y| (0..image[0]).map(move |x| (y, x))) {
            let Some(sample) = view.sample(glam::dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5))
            else {
                continue;
            };
            let found = f64::from(found[(y * image[0] + x) as usize]);
            if !view.counts(sample.is_facing, sample.depth) {
                assert!(found.is_nan());
                continue;
            }
            // The most metres that a texel spans in any direction across the light.
            let (u, v) = travel.normalize().any_orthonormal_pair();
            let at = sample.surface.position;
            let step = 1e-4;
            let per_metre =
                |way: DVec3| (texel(at + way * step) - texel(at - way * step)) / (2.0 * step);
            let [a, b] = [per_metre(u), per_metre(v)];
            let least = (0..3600)
                .map(|i| glam::DVec2::from_angle(f64::from(i) * std::f64::consts::PI / 3600.0))
                .map(|way| (a * way.x + b * way.y).length())
                .fold(f64::INFINITY, f64::min);
            let pixel = sample.depth * 2.0 * (fov_y_rad / 2.0).tan() / f64::from(image[1]);
            let expected = 1.0 / least / pixel;
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
            counted += 1;
        }
        assert!(counted > 300, "{counted} pixels count");
    }

    #[test]
    fn pixels_average_their_counted_samples() {
        let scene = umbrage_scene::builtin("sphere", Some(32)).unwrap();
        let tracer = Tracer::new(&scene).unwrap();
        let light = Light::Directional { direction: DVec3::new(1.0, -1.25, 0.4) };
        let means = |far| {
            let look_at = LookAt {
                eye: DVec3::new(-2.5, 3.4, 7.5),
                target: DVec3::Y,
                up: DVec3::Y,
                fov_y_rad: std::f64::consts::FRAC_PI_3,
                near: 1e-5,
                far,
                image: [90, 60],
            };
            let view = View::new(&tracer, Camera::look_at(look_at).unwrap(), light, 4).unwrap();
            let strip = Rows::new(&view, 0..60, &|_| {}).truth();
            strip.means(|i| strip.visibility[i]).collect::<Vec<_>>()
        };
        let all = means(1e4);
        assert_eq!(all.len(), 90 * 60);
        assert!(all.iter().any(Option::is_none), "sky");
        let partial = all.iter().flatten().filter(|&&v| v > 0.0 && v < 1.0).count();
        assert!((20..500).contains(&partial), "{partial} pixels on the outline");
        assert!(means(0.1).iter().all(Option::is_none), "all beyond 10 cm");
    }
}
