//! From samples to pixels: pictures that grow strip by strip, from the top.

use crate::spec::{Spec, planner};
use anyhow::Result;
use glam::Vec3;
use serde::Serialize;
use std::cell::OnceCell;
use std::ops::Range;
use std::time::Instant;
use umbrage::{Aabb, Bounds, Camera, Light, Plan, ShadowMap};
use umbrage_measure::Rgb;
use umbrage_scene::Scene;
use umbrage_trace::{Band, Progress, Reference, Sample, View, shade};

/// What to say of a picture none of whose pixels counts.
pub(crate) const NOTHING_TO_SHADOW: &str = "no pixel shows a surface that faces the light within \
     the view's range: there are no shadows to see";

/// Some of a picture's rows, and what the CPU sees there, which is found when it is first asked for.
pub(crate) struct Rows<'a> {
    pub(crate) view: &'a View<'a>,
    pub(crate) range: Range<u32>,
    progress: Progress<'a>,
    band: OnceCell<Band>,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(view: &'a View<'a>, range: Range<u32>, progress: Progress<'a>) -> Self {
        Self { view, range, progress, band: OnceCell::new() }
    }

    /// The surfaces that rays find.
    pub(crate) fn band(&self) -> &Band {
        self.band.get_or_init(|| self.view.band(self.range.clone(), self.progress))
    }

    /// The truth.
    pub(crate) fn truth(&self) -> Strip {
        let band = self.band();
        Strip::new(self.view, band, band.map(|s| self.view.truth(s), self.progress))
    }

    /// Nothing casts.
    pub(crate) fn in_full_light(&self) -> Strip {
        let band = self.band();
        Strip::new(self.view, band, vec![1.0; band.samples().len()])
    }

    /// What the reference's maps let through.
    pub(crate) fn by_reference(&self, plan: &Plan, reference: &Reference<'_>) -> Strip {
        let band = self.band();
        let visibility = band.map(|s| reference.visibility(0, s), self.progress);
        let lookup = |s: &Sample| Lookup::of(plan, reference, self.view.camera(), s);
        Strip { lookups: band.map(lookup, &|_| {}), ..Strip::new(self.view, band, visibility) }
    }
}

/// What some rows of a picture show, a value a sample, whoever found it: pixel after pixel.
pub(crate) struct Strip {
    samples_per_pixel: usize,
    radiance: Vec<Vec3>,
    /// 1 in the sky.
    visibility: Vec<f32>,
    /// Whether a surface is seen that faces the light, within the view's range.
    counts: Vec<bool>,
    /// Metres; infinite in the sky.
    depth: Vec<f32>,
    /// World space; zero in the sky.
    normal: Vec<Vec3>,
    /// Empty for the truth, which has no maps.
    lookups: Vec<Lookup>,
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

    /// What a GPU drew.
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

    /// For each pixel the mean of a value over the samples that count; `None` where none does.
    fn means(&self, value: impl Fn(usize) -> f32) -> impl Iterator<Item = Option<f32>> {
        let n = self.samples_per_pixel;
        self.counts.chunks(n).enumerate().map(move |(pixel, counts)| {
            let counted = counts.iter().enumerate().filter(|(_, counts)| **counts);
            let values = counted.map(|(i, _)| value(pixel * n + i));
            let (sum, count) = values.fold((0.0, 0u32), |(sum, n), v| (sum + v, n + 1));
            (count > 0).then(|| sum / count as f32)
        })
    }

    /// Whether each pixel counts: any of its samples does.
    pub(crate) fn counted(&self) -> impl Iterator<Item = bool> {
        self.counts.chunks(self.samples_per_pixel).map(|counts| counts.contains(&true))
    }

    /// A value of the sample in the middle of each pixel, or next to it.
    fn middles<'a, T>(&self, values: &'a [T]) -> impl Iterator<Item = &'a T> {
        let grid = self.samples_per_pixel.isqrt();
        let middle = grid / 2 * grid + grid / 2;
        values.iter().skip(middle).step_by(self.samples_per_pixel)
    }
}

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
    /// Adds a strip.
    pub(crate) fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        self.color.extend(shade::pixels(&strip.radiance, n));
        let of_all = strip.visibility.chunks(n).map(|v| v.iter().sum::<f32>() / n as f32);
        let counted = strip.means(|i| strip.visibility[i]);
        self.visibility.extend(counted.zip(of_all).map(|(counted, all)| counted.unwrap_or(all)));
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

impl Texels {
    /// Adds a strip.
    pub(crate) fn push(&mut self, strip: &Strip) {
        let means = strip.means(|i| strip.lookups[i].error);
        self.error.extend(means.map(|m| m.unwrap_or(f32::NAN)));
        for middle in strip.middles(&strip.lookups) {
            self.texel.push(middle.texel);
            self.map.push(middle.map);
        }
    }
}

/// What is seen, apart from its shadows.
#[derive(Default)]
pub(crate) struct Shape {
    /// Linear colour of each pixel: red, green, blue.
    pub(crate) radiance: Vec<[f32; 3]>,
    /// In the middle of each pixel, metres; infinite in the sky.
    pub(crate) depth: Vec<f32>,
    /// In the middle of each pixel, world space; zero in the sky.
    pub(crate) normal: Vec<Vec3>,
}

impl Shape {
    /// Adds a strip.
    pub(crate) fn push(&mut self, strip: &Strip) {
        let n = strip.samples_per_pixel;
        let pixels = strip.radiance.chunks(n);
        self.radiance.extend(pixels.map(|p| (p.iter().sum::<Vec3>() / n as f32).to_array()));
        self.depth.extend(strip.middles(&strip.depth));
        self.normal.extend(strip.middles(&strip.normal));
    }
}

/// A technique's plan, and how long planning takes, milliseconds, once buffers have grown.
pub(crate) fn plan(
    spec: &Spec,
    camera: &Camera,
    light: &Light,
    bounds: &Bounds<'_>,
) -> Result<(Plan, f64)> {
    let mut planner = planner();
    let mut plan = || {
        let start = Instant::now();
        let plan = planner.plan(camera, &[*light], bounds, spec.technique());
        let ms = milliseconds(start);
        plan.map(|p| (p.clone(), ms)).map_err(|e| spec.error(&e))
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
