//! The true visibility of whole pixels, whose samples share their searches.

use crate::tracer::{Beam, CASTS, End, IS_SEEN};
use crate::{PrimitiveRef, Sample, View};
use glam::DVec3;

/// Surfaces count as one plane if the cosine of the angle between their normals is above this
/// value.
const SAME_PLANE: f64 = 0.99;

/// One sample of each square of this many by this many is in the first look at a pixel.
const FIRST_LOOK: u32 = 2;

/// Memory for the work on one pixel after another.
#[derive(Default)]
pub struct PixelMemory {
    seen: Vec<PrimitiveRef>,
    blockers: Vec<PrimitiveRef>,
    samples: Vec<Sample>,
}

impl View<'_> {
    /// The mean true visibility over the samples of the pixel at this column and row; `None` unless
    /// one plane surface whose shadows [count](Self::counts) fills the pixel. `middle` is the
    /// sample at the pixel's middle.
    ///
    /// This is the mean of [`truth`](Self::truth) in a small part of the time. Neighbouring rays
    /// meet the same triangles, so all samples of the pixel share one search for what they see, and
    /// one for what may lie between them and the light. A pixel counts as wholly lit or wholly dark
    /// if a quarter of its samples, spread evenly, all are. So what covers less than a few samples
    /// can be missed.
    pub fn truth_of_filled(
        &self,
        [x, y]: [u32; 2],
        middle: &Sample,
        memory: &mut PixelMemory,
    ) -> Option<f32> {
        let PixelMemory { seen, blockers, samples } = memory;
        let tracer = self.tracer();
        let fills = |s: &Sample| {
            let [this, middle] = [s, middle].map(|s| s.surface.geometric_normal);
            self.counts(s.is_facing, s.depth) && this.dot(middle) > SAME_PLANE
        };
        let (grid, count) = (self.grid(), self.grid().pow(2));
        // Most pixels that more than one surface fills show that at a corner.
        let corners = [0, grid - 1, count - 1, count - grid].map(|i| self.point(x, y, i));
        let mut outline = [*middle; 4];
        for (sample, corner) in outline.iter_mut().zip(corners) {
            *sample = self.sample(corner).filter(fills)?;
        }

        // No point of a plane surface between the corners is farther away than all of them, except
        // for rounding. Where a surface bends, rays that meet nothing so near search by themselves.
        let farthest = outline.iter().fold(0.0, |far: f64, s| far.max(s.depth)) * (1.0 + 1e-9);
        let range = [self.camera().near(), farthest];
        let [from, to] = range.map(|t| corners.map(|corner| self.ray(corner).at(t)));
        let are_few = tracer.search(&Beam::between(from, to), IS_SEEN, seen);
        if !are_few {
            seen.clear();
        }
        let own = outline[0].surface.primitive;
        // If a triangle without holes is alone in the beam, and all corners show it, so does all
        // that lies between them.
        let is_alone = *seen == [own]
            && tracer.is_solid(own)
            && outline.iter().all(|s| s.surface.primitive == own);
        let samples_into = |samples: &mut Vec<Sample>, is_first_look: bool| {
            samples.clear();
            for i in (0..count).filter(|&i| !is_first_look || is_in_first_look(i, grid)) {
                let ray = self.ray(self.point(x, y, i));
                let near = tracer.closest_among(seen, ray, range).filter(|_| are_few);
                let hit = near.or_else(|| tracer.closest(ray, [range[0], f64::INFINITY]))?;
                samples.push(Some(self.sample_at(&hit, ray)).filter(fills)?);
            }
            Some(())
        };

        let positions = outline.map(|s| s.surface.position);
        if is_alone {
            let to_light = self.beam_to_light(positions, positions.iter().copied());
            let are_few = tracer.search(&to_light, CASTS, blockers);
            blockers.retain(|&blocker| blocker != own);
            // What no triangle hides at all is lit everywhere. What a triangle without holes hides
            // at all corners is dark everywhere.
            let hides = |&blocker: &PrimitiveRef| {
                tracer.is_solid(blocker)
                    && outline.iter().all(|s| self.truth_among(Some(&[blocker]), s) == 0.0)
            };
            if are_few && blockers.is_empty() {
                return Some(1.0);
            }
            if are_few && blockers.iter().any(hides) {
                return Some(0.0);
            }
        }
        let mut mean = 0.0;
        for is_first_look in [true, false] {
            samples_into(samples, is_first_look)?;
            let points = samples.iter().map(|s| s.surface.position);
            let to_light = self.beam_to_light(positions, points);
            let are_few = tracer.search(&to_light, CASTS, blockers);
            let among = are_few.then_some(&blockers[..]);
            let sum: f32 = samples.iter().map(|s| self.truth_among(among, s)).sum();
            mean = sum / samples.len() as f32;
            if mean == 0.0 || mean == 1.0 {
                break;
            }
        }
        Some(mean)
    }

    /// The beam of rays to the light from points, given with the corners of their outline.
    fn beam_to_light(
        &self,
        outline: [DVec3; 4],
        points: impl Iterator<Item = DVec3> + Clone,
    ) -> Beam {
        let end = match self.light().position() {
            Some(lamp) => End::Point(lamp),
            None => End::Endless(self.light().direction_to_light(outline[0])),
        };
        Beam::of_points(outline, points, end)
    }
}

/// Whether the sample is in the first look at a pixel of `grid` × `grid` samples. The place of the
/// chosen one changes from square to square, so that thin things along rows and columns are seen.
fn is_in_first_look(index: u32, grid: u32) -> bool {
    let [i, j] = [index % grid, index / grid];
    let square = i / FIRST_LOOK + FIRST_LOOK * (j / FIRST_LOOK);
    (i % FIRST_LOOK + FIRST_LOOK * (j % FIRST_LOOK)) == square % (FIRST_LOOK * FIRST_LOOK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tracer;
    use umbrage::{Camera, Light, LookAt, PointLight};

    /// The scenes have plane and bent surfaces, cut-outs, lamps, and pixels that many triangles
    /// fill. Few pixels differ, which are nearly lit, nearly dark or nearly filled.
    #[test]
    fn filled_pixels_have_the_mean_of_their_samples() {
        let sun = Light::Directional { direction: DVec3::new(-0.58, -0.71, -0.41) };
        let lamp = PointLight { position: DVec3::new(-0.4, 2.1, 0.3), range: 4.0, near: 0.01 };
        let view = |eye, fov_y_rad| LookAt {
            eye,
            target: DVec3::new(0.0, 0.6, 0.0),
            up: DVec3::Y,
            fov_y_rad,
            near: 0.05,
            far: 200.0,
            image: [36, 24],
        };
        let wide = view(DVec3::new(9.0, 6.0, 14.0), 1.0);
        let close = view(DVec3::new(2.5, 3.0, 2.2), 0.7);
        let mut counts = [0; 3];
        for (name, light, view) in [
            ("town", sun, wide),
            ("grove", sun, wide),
            ("fence", sun, close),
            ("sphere", sun, close),
            ("lantern", Light::Point(lamp), close),
        ] {
            let scene = umbrage_scene::builtin(name, Some(30)).unwrap();
            for opaque in [false, true] {
                let tracer = Tracer::new(&scene).unwrap().opaque(opaque);
                let camera = Camera::look_at(view).unwrap();
                let [many, centers] =
                    [8, 1].map(|grid| View::new(&tracer, camera, light, grid).unwrap());
                check(name, &many, &centers, &mut counts);
            }
        }
        assert!(counts.iter().all(|&n| n > 100), "dark, partly lit, lit: {counts:?}");
    }

    /// Compares all pixels, and counts those in shadow, partly lit, and in light.
    fn check(name: &str, many: &View<'_>, centers: &View<'_>, counts: &mut [u32; 3]) {
        let [width, height] = many.camera().image();
        let [all, middles] = [many, centers].map(|view| view.band(0..height, &|_| {}));
        let truth = all.map(|s| many.truth(s), &|_| {});
        let mut memory = PixelMemory::default();
        let (mut missed, mut filled) = (0, 0);
        let pixels = all.samples().chunks(64).zip(truth.chunks(64)).zip(middles.samples());
        for (i, ((samples, truth), middle)) in (0..).zip(pixels) {
            let Some(middle) = middle.filter(|s| many.counts(s.is_facing, s.depth)) else {
                continue;
            };
            let normal = |s: &Sample| s.surface.geometric_normal;
            let is_filled = samples.iter().all(|s| {
                s.is_some_and(|s| {
                    many.counts(s.is_facing, s.depth) && normal(&s).dot(normal(&middle)) > 0.99
                })
            });
            let expected = is_filled.then(|| truth.iter().sum::<f32>() / 64.0);
            let pixel = [i % width, i / width];
            let mean = many.truth_of_filled(pixel, &middle, &mut memory);
            if mean != expected {
                missed += 1;
                let is_near = expected
                    .is_none_or(|expected| mean.is_some_and(|mean| (mean - expected).abs() <= 0.2));
                assert!(is_near, "{name}: {pixel:?}: {mean:?}, not {expected:?}");
            }
            if let Some(mean) = expected {
                filled += 1;
                counts[usize::from(mean > 0.0) + usize::from(mean == 1.0)] += 1;
            }
        }
        assert!(missed * 16 <= filled, "{name}: {missed} of {filled}");
    }
}
