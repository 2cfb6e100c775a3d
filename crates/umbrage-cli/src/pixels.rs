//! From samples to pixels: pictures that grow band by band, from the top.

use crate::spec::Technique;
use anyhow::Result;
use glam::Vec3;
use serde::Serialize;
use std::time::Instant;
use umbrage::{Aabb, Bounds, Camera, Light, Plan, Planner, ShadowMap};
use umbrage_measure::Rgb;
use umbrage_scene::Scene;
use umbrage_trace::{Band, Reference, Sample, View, shade};

/// What to say of a picture none of whose pixels [count](counted).
pub(crate) const NOTHING_TO_SHADOW: &str = "no pixel shows a surface that faces the light within \
     the view's range: there are no shadows to see";

/// What shadows look like, whoever made them.
#[derive(Default)]
pub(crate) struct Shadowed {
    /// The shaded picture.
    pub(crate) color: Vec<Rgb>,
    /// 0 (in shadow) ..= 1 (lit). Over the samples that count, if there are any in a pixel; else over
    /// all, the sky being lit.
    pub(crate) visibility: Vec<f32>,
}

impl Shadowed {
    /// Adds a band, with one visibility a sample.
    pub(crate) fn push(&mut self, view: &View<'_>, band: &Band, visibility: &[f32]) {
        self.color.extend(shade::picture(view, band, visibility));
        let counted = band.means_facing(visibility, view.camera().far());
        let pixels = per_pixel(band, visibility).zip(counted);
        self.visibility.extend(pixels.map(|((samples, values), counted)| {
            counted.unwrap_or_else(|| {
                let value = |(s, v): (&Option<Sample>, &f32)| s.map_or(1.0, |_| *v);
                samples.iter().zip(values).map(value).sum::<f32>() / values.len() as f32
            })
        }));
    }
}

/// Where a map's texels lie on what is seen.
#[derive(Default)]
pub(crate) struct Texels {
    /// Pixels per texel in the worst direction, the mean over the samples that count; NaN where none
    /// does or no map serves it.
    pub(crate) error: Vec<f32>,
    /// Texel coordinates s and t in the middle of the pixel; NaN where no map serves it.
    pub(crate) texel: Vec<[f32; 2]>,
    /// Index of the map that serves the middle of the pixel.
    pub(crate) map: Vec<Option<u16>>,
}

/// What a plan has for a sample.
#[derive(Clone, Copy)]
struct Lookup {
    error: f32,
    texel: [f32; 2],
    map: Option<u16>,
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

impl Texels {
    /// Adds a band as seen through `plan`'s maps.
    pub(crate) fn push(
        &mut self,
        view: &View<'_>,
        band: &Band,
        plan: &Plan,
        reference: &Reference<'_>,
    ) {
        let lookups = band.map(|s| Lookup::of(plan, reference, view.camera(), s), &|_| {});
        let errors: Vec<f32> = lookups.iter().map(|l| l.error).collect();
        let means = band.means_facing(&errors, view.camera().far());
        self.error.extend(means.into_iter().map(|m| m.unwrap_or(f32::NAN)));
        for (_, lookups) in per_pixel(band, &lookups) {
            let middle = lookups[middle(band)];
            self.texel.push(middle.texel);
            self.map.push(middle.map);
        }
    }
}

/// Whether each pixel of the band shows a surface that faces the light, within the view's range.
pub(crate) fn counted(view: &View<'_>, band: &Band) -> impl Iterator<Item = bool> {
    let zeros = vec![0.0; band.samples().len()];
    band.means_facing(&zeros, view.camera().far()).into_iter().map(|m| m.is_some())
}

/// The sample in the middle of each pixel.
pub(crate) fn middles(band: &Band) -> impl Iterator<Item = Option<&Sample>> {
    band.samples().chunks(band.samples_per_pixel()).map(|samples| samples[middle(band)].as_ref())
}

/// Linear colour of each pixel: red, green, blue.
pub(crate) fn linear_color(view: &View<'_>, band: &Band, visibility: &[f32]) -> Vec<[f32; 3]> {
    let width = view.camera().image()[0] as usize;
    let pixels = per_pixel(band, visibility).enumerate();
    let colors = pixels.map(|(i, (samples, values))| {
        let row = f64::from(band.rows().start) + (i / width) as f64;
        let center = glam::DVec2::new((i % width) as f64, row) + 0.5;
        let radiance = samples.iter().zip(values).map(|(sample, &visibility)| match sample {
            Some(s) => shade::radiance(view.light(), s, visibility),
            None => shade::sky(view.light(), view.camera(), center),
        });
        (radiance.sum::<Vec3>() / values.len() as f32).to_array()
    });
    colors.collect()
}

/// Samples and their values, pixel by pixel.
fn per_pixel<'a, T>(
    band: &'a Band,
    values: &'a [T],
) -> impl Iterator<Item = (&'a [Option<Sample>], &'a [T])> {
    let n = band.samples_per_pixel();
    band.samples().chunks(n).zip(values.chunks(n))
}

/// Index of the sample in the middle of a pixel, or next to it.
fn middle(band: &Band) -> usize {
    let n = band.samples_per_pixel();
    let grid = n.isqrt();
    grid / 2 * grid + grid / 2
}

/// A technique's plan, and how long planning takes, milliseconds, once buffers have grown.
pub(crate) fn plan(
    technique: &Technique,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<(Plan, f64)> {
    let mut planner = Planner::new();
    let mut plan = || {
        let start = Instant::now();
        let plan = planner.plan(camera, &[*light], bounds, &technique.options);
        let ms = milliseconds(start);
        plan.map(|p| (p.clone(), ms)).map_err(|e| technique.error(&e))
    };
    plan()?;
    plan()
}

/// Triangles of instances whose boxes may cast into a map, and of the others.
#[derive(Clone, Copy, Default, Serialize)]
pub(crate) struct Casters {
    pub(crate) drawn: u64,
    pub(crate) culled: u64,
}

/// For each map, the triangles of the instances whose boxes may cast into it, and of the others.
pub(crate) fn casters(plan: &Plan, scene: &Scene) -> Vec<Casters> {
    let triangles = scene.instances.iter().map(|i| scene.meshes[i.mesh].triangles.len() as u64);
    let instances: Vec<(Aabb, u64)> = scene.instance_boxes().into_iter().zip(triangles).collect();
    let of_map = |map: &ShadowMap| {
        instances.iter().fold(Casters::default(), |mut sum, &(aabb, triangles)| {
            *(if map.may_cast(aabb) { &mut sum.drawn } else { &mut sum.culled }) += triangles;
            sum
        })
    };
    plan.maps.iter().map(of_map).collect()
}

/// Share of all triangles that are culled, the mean over maps that are not empty.
pub(crate) fn casters_culled(plan: &Plan, casters: &[Casters]) -> Option<f64> {
    let casters = plan.maps.iter().zip(casters);
    let of_full = casters.filter(|(map, _)| !map.is_empty()).map(|(_, casters)| casters);
    let [drawn, culled] =
        of_full.fold([0, 0], |[d, c], casters| [d + casters.drawn, c + casters.culled]);
    (drawn + culled > 0).then(|| culled as f64 / (drawn + culled) as f64)
}

/// Since `start`.
pub(crate) fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
