use crate::{Error, Hit, PrimitiveRef, Progress, Ray, Surface, Tracer};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;
use umbrage::{Camera, Light};

/// Approximate number of samples held in memory at a time, which take some 100 MB.
const BAND_SAMPLES: u64 = 1 << 19;

/// A picture to be sampled: the scene, the camera, the light, and the number of rays per pixel.
#[derive(Clone, Copy)]
pub struct View<'a> {
    tracer: &'a Tracer<'a>,
    camera: Camera,
    light: Light,
    grid: u32,
}

/// The surfaces seen in a band of a picture's rows.
#[derive(Clone, Debug)]
pub struct Band {
    rows: Range<u32>,
    width: u32,
    grid: u32,
    samples: Vec<Option<Sample>>,
}

/// A point of a surface that the camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The surface at the point: position, normals and colour.
    pub surface: Surface,
    /// Distance along the view direction, metres.
    pub depth: f64,
    /// Whether the visible side of the triangle faces the light and lies within the light's reach
    /// (a spot or point light's range, a spot light's cone). If not, the sample is dark whatever
    /// any shadow map says. The geometric normal decides, because triangles are what casts and
    /// receives shadows. A triangle [edge-on](Tracer::is_edge_on) to a lamp faces it, as if the
    /// lamp were a little on the visible side.
    pub is_facing: bool,
}

impl<'a> View<'a> {
    /// Each pixel is sampled on a regular grid of `grid` × `grid` points. With an odd `grid`, one
    /// of them is the pixel's centre.
    ///
    /// # Errors
    /// [`Error::Samples`] if `grid` is not 1 to 64.
    pub fn new(
        tracer: &'a Tracer<'a>,
        camera: Camera,
        light: Light,
        grid: u32,
    ) -> Result<Self, Error> {
        if !(1..=64).contains(&grid) {
            return Err(Error::Samples { given: grid, max: 64 });
        }
        Ok(Self { tracer, camera, light, grid })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The light.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// Samples along each side of a pixel.
    pub fn grid(&self) -> u32 {
        self.grid
    }

    /// The scene, as it is traced.
    pub fn tracer(&self) -> &'a Tracer<'a> {
        self.tracer
    }

    /// Splits the picture's rows into bands, from top to bottom. Each band has about half a million
    /// samples (some 100 MB) whatever the picture's size, but at least one row.
    pub fn bands(&self) -> impl Iterator<Item = Range<u32>> + use<> {
        let [width, height] = self.camera.image();
        let samples_per_row = u64::from(width) * u64::from(self.grid).pow(2);
        let rows = (BAND_SAMPLES / samples_per_row).clamp(1, u64::from(height)) as u32;
        (0..height).step_by(rows as usize).map(move |first| first..height.min(first + rows))
    }

    /// Samples the surfaces seen in these rows. Rows beyond the picture are ignored.
    pub fn band(&self, rows: Range<u32>, progress: Progress<'_>) -> Band {
        let [width, height] = self.camera.image();
        let rows = rows.start.min(height)..rows.end.min(height);
        let samples = rows
            .clone()
            .into_par_iter()
            .flat_map_iter(|y| {
                let row: Vec<_> = (0..width).flat_map(|x| self.pixel(x, y)).collect();
                progress(1);
                row
            })
            .collect();
        Band { rows, width, grid: self.grid, samples }
    }

    fn pixel(&self, x: u32, y: u32) -> impl Iterator<Item = Option<Sample>> {
        let grid = self.grid;
        (0..grid * grid).map(move |i| self.sample(self.point(x, y, i)))
    }

    /// The point of the picture, in pixels, at which the sample of this index in a pixel is taken.
    pub(crate) fn point(&self, x: u32, y: u32, index: u32) -> DVec2 {
        let grid = self.grid;
        let within = DVec2::new(f64::from(index % grid) + 0.5, f64::from(index / grid) + 0.5);
        DVec2::new(f64::from(x), f64::from(y)) + within / f64::from(grid)
    }

    /// The surface seen at a point of the picture, given in pixels as for [`Camera::ray`]; `None`
    /// where the sky shows. Surfaces nearer than the camera's near distance are not seen. Surfaces
    /// beyond its far distance are seen, but no shadow map serves them.
    pub fn sample(&self, pixel: DVec2) -> Option<Sample> {
        let ray = self.ray(pixel);
        let hit = self.tracer.closest(ray, [self.camera.near(), f64::INFINITY])?;
        Some(self.sample_at(&hit, ray))
    }

    /// The ray through a point of the picture. Its parameter t is the depth.
    pub(crate) fn ray(&self, pixel: DVec2) -> Ray {
        Ray::of_view(&self.camera, pixel)
    }

    /// The sample where a ray of the picture hits.
    pub(crate) fn sample_at(&self, hit: &Hit, ray: Ray) -> Sample {
        let surface = self.tracer.surface(hit, ray.direction);
        let is_facing = self.is_facing(&surface);
        // The ray's parameter t is the depth.
        Sample { surface, depth: hit.t, is_facing }
    }

    /// The sample that this view has at a point which another view saw. `None` if the point lies
    /// outside the picture or nearer than the camera's near distance, is hidden, or its visible
    /// side faces away.
    pub fn sees(&self, surface: &Surface) -> Option<Sample> {
        let depth = self.camera.depth(surface.position);
        let pixel = self.camera.pixel(surface.position)?;
        // Towards the eye, with the share of the way to the near plane, which nothing nearer hides.
        let (to_eye, end) = if self.camera.is_orthographic() {
            (-self.camera.forward(), depth - self.camera.near())
        } else {
            (self.camera.eye() - surface.position, 1.0 - self.camera.near() / depth)
        };
        let size = glam::UVec2::from(self.camera.image()).as_dvec2();
        let is_inside = pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all();
        let is_towards = surface.geometric_normal.dot(to_eye) > 0.0;
        let is_seen =
            is_inside && is_towards && end >= 0.0 && !self.tracer.hidden_from(surface, to_eye, end);
        is_seen.then(|| Sample { surface: *surface, depth, is_facing: self.is_facing(surface) })
    }

    fn is_facing(&self, surface: &Surface) -> bool {
        let Surface { position, geometric_normal: normal, primitive, .. } = *surface;
        let to_light = self.light.direction_to_light(position);
        // Whether a plane that holds the lamp faces it would depend on the last bit of each point.
        let is_edge_on = |lamp| self.tracer.is_edge_on(primitive, lamp);
        let is_towards =
            normal.dot(to_light) > 0.0 || self.light.position().is_some_and(is_edge_on);
        is_towards && self.light.reaches(position)
    }

    /// Whether the shadow on a surface counts where pictures are compared: it [faces the
    /// light](Sample::is_facing), and its depth, metres, is within the camera's far distance,
    /// beyond which no map serves. Whoever found the surface, this decides.
    pub fn counts(&self, is_facing: bool, depth: f64) -> bool {
        is_facing && depth <= self.camera.far()
    }

    /// The true visibility of the sample, 1 or 0, found by one ray to the light itself.
    ///
    /// Every surface between a spot or point light and the sample casts, the light's own housing
    /// included. Samples nearer to the light than its `near` distance are never in shadow, as
    /// documented at [`SpotLight`](umbrage::SpotLight) and [`PointLight`](umbrage::PointLight).
    pub fn truth(&self, sample: &Sample) -> f32 {
        self.truth_among(None, sample)
    }

    /// [`truth`](Self::truth), if nothing but some triangles can be between the sample and the
    /// light.
    pub(crate) fn truth_among(&self, among: Option<&[PrimitiveRef]>, sample: &Sample) -> f32 {
        if !sample.is_facing {
            return 0.0;
        }
        if !self.light.casts_at(sample.surface.position) {
            return 1.0;
        }
        let is_dark = match self.light.position() {
            Some(lamp) => self.tracer.hidden_among(among, &sample.surface, lamp),
            None => {
                let to_sun = self.light.direction_to_light(sample.surface.position);
                self.tracer.occluded_among(among, &sample.surface, to_sun, f64::INFINITY)
            }
        };
        f32::from(u8::from(!is_dark))
    }
}

impl Band {
    /// The rows of the picture.
    pub fn rows(&self) -> Range<u32> {
        self.rows.clone()
    }

    /// All samples, row by row and pixel by pixel from the left. Each pixel has grid × grid of
    /// them, also row by row. `None` where the sky shows.
    pub fn samples(&self) -> &[Option<Sample>] {
        &self.samples
    }

    /// Samples per pixel.
    pub fn samples_per_pixel(&self) -> usize {
        (self.grid * self.grid) as usize
    }

    /// Computes a value for each sample on all threads, and returns them in the order of
    /// [`samples`](Self::samples). Samples of the sky get `Default`.
    pub fn map<T: Default + Send>(
        &self,
        value: impl Fn(&Sample) -> T + Sync,
        progress: Progress<'_>,
    ) -> Vec<T> {
        let row = self.width as usize * self.samples_per_pixel();
        self.samples
            .par_chunks(row)
            .flat_map_iter(|samples| {
                let row: Vec<T> =
                    samples.iter().map(|s| s.as_ref().map_or_else(T::default, &value)).collect();
                progress(1);
                row
            })
            .collect()
    }
}
