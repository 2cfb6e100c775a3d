//! Lights that are no points: the share of a sun's disc or of a lamp's sphere that reaches a point.

use crate::samples::{Sample, View};
use crate::{Error, Surface};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use umbrage::visibility::LightSize;

/// Rays along the rim of the light in the first look. An edge that hides 0.4% of the light or more
/// crosses an arc of the rim as long as the distance between two of them.
const RIM: u32 = 12;

/// Cells along each side of the grid of the first look, with two rays in each.
const FIRST: u32 = 4;

/// Cells along each side of the grids that follow. One of them suffices where a single edge crosses
/// the light.
const CELLS: u32 = 20;

/// Cells along each side of the grid of a glance.
const GLANCE: u32 = 8;

/// The largest number of grids. Fewer than that suffice for any light, since the standard error of
/// random rays is at most 0.5 divided by the square root of their number.
const MOST_GRIDS: u32 = 24;

/// The light of a view with a size: a sun is a disc in the sky, and a lamp is a sphere around its
/// position.
///
/// [`visibility`](Self::visibility) is found by many rays. A first look at the rim and at some
/// points within decides whether the light is wholly visible or wholly hidden, in which case no
/// further rays are cast. What hides less than about a twentieth of the light can escape the first
/// look if it is thin, such as a wire.
///
/// Otherwise two points are chosen at random in each cell of a grid over the light, and the
/// differences between the two tell the standard error. Further grids follow until that of their
/// mean is at most [`STANDARD_ERROR`](Self::STANDARD_ERROR). The same point of a surface always
/// gets the same rays, and different points get different ones.
pub struct AreaLight<'v, 'a> {
    view: &'v View<'a>,
    /// A lamp's radius in metres; the tangent of half the angle that a sun subtends.
    radius: f64,
}

/// The share of an area light that reaches a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaVisibility {
    /// From 0, in the umbra, to 1, in full light.
    pub visibility: f32,
    /// Estimate of the standard error of `visibility`.
    pub standard_error: f32,
    /// The number of rays.
    pub rays: u32,
}

/// The visible side of a light, seen from a point: a disc.
struct Disc {
    /// Relative to the point, metres. A sun's disc is at a distance of one metre.
    center: DVec3,
    /// Two radii at right angles, metres.
    radii: [DVec3; 2],
    /// Where the light ends in lengths of the vector to the disc.
    end: f64,
}

impl<'v, 'a> AreaLight<'v, 'a> {
    /// The largest standard error of a visibility, less than a step of an 8-bit grey.
    pub const STANDARD_ERROR: f64 = 1.0 / 256.0;

    /// Gives the view's light a size.
    ///
    /// # Errors
    /// [`Error::LightSize`] if the size is out of range or not in the unit of this kind of light.
    pub fn new(view: &'v View<'a>, size: LightSize) -> Result<Self, Error> {
        size.check_for(view.light()).map_err(|problem| Error::LightSize { problem })?;
        Ok(Self { view, radius: 0.5 * f64::from(size.diameter()) })
    }

    /// The share of the light that reaches a sample. It is 0 if the middle of the light is behind
    /// the surface or out of reach ([`Sample::is_facing`]), and 1 nearer to a lamp than its `near`
    /// distance, as it is for a light without a size ([`View::truth`]).
    pub fn visibility(&self, sample: &Sample) -> AreaVisibility {
        self.by_grids(sample, CELLS, MOST_GRIDS)
    }

    /// The same by few rays, for who cannot wait: where an edge crosses the light, the standard
    /// error is some hundredths.
    pub fn glance(&self, sample: &Sample) -> AreaVisibility {
        self.by_grids(sample, GLANCE, 1)
    }

    /// The visibility by at most so many grids of so many cells along each side.
    fn by_grids(&self, sample: &Sample, cells: u32, most_grids: u32) -> AreaVisibility {
        let surface = &sample.surface;
        let known = |visibility| AreaVisibility { visibility, ..AreaVisibility::default() };
        if !sample.is_facing {
            return known(0.0);
        }
        let casts = self.view.light().casts_at(surface.position);
        let Some(disc) = self.disc(surface).filter(|_| casts) else {
            return known(1.0);
        };
        let mut random = Random::at(surface.position);
        let mut look = |place| f64::from(u8::from(self.reaches(surface, &disc, place)));
        let turn = random.unit();
        let rim = (0..RIM).map(|i| DVec2::from_angle((f64::from(i) + turn) / f64::from(RIM) * TAU));
        let rim: f64 = rim.map(&mut look).sum();
        let within = Grid::sample(FIRST, &mut random, &mut look);
        let mut rays = RIM + Grid::rays(FIRST);
        if within.mean == 0.0 && rim == 0.0 || within.mean == 1.0 && rim == f64::from(RIM) {
            return AreaVisibility { rays, ..known(within.mean as f32) };
        }
        let (mut sum, mut variances, mut grids) = (0.0, 0.0f64, 0);
        let standard_error = loop {
            let Grid { mean, variance } = Grid::sample(cells, &mut random, &mut look);
            sum += mean;
            variances += variance;
            grids += 1;
            rays += Grid::rays(cells);
            let standard_error = variances.sqrt() / f64::from(grids);
            if standard_error <= Self::STANDARD_ERROR || grids == most_grids {
                break standard_error;
            }
        };
        let visibility = (sum / f64::from(grids)) as f32;
        AreaVisibility { visibility, standard_error: standard_error as f32, rays }
    }

    /// The light's disc; `None` inside a lamp.
    fn disc(&self, surface: &Surface) -> Option<Disc> {
        let light = self.view.light();
        let to_light = light.direction_to_light(surface.position);
        let (distance, radius, end) = match light.position() {
            None => (1.0, self.radius, f64::INFINITY),
            Some(lamp) => {
                // The cone that touches the sphere does so along a circle before its middle.
                let distance = lamp.distance(surface.position);
                let touching = (1.0 - (self.radius / distance).powi(2)).max(0.0);
                (distance * touching, self.radius * touching.sqrt(), 1.0)
            }
        };
        let (u, v) = to_light.any_orthonormal_pair();
        let disc = Disc { center: to_light * distance, radii: [u * radius, v * radius], end };
        (distance > 0.0).then_some(disc)
    }

    /// Whether light reaches a surface from a place in the unit disc.
    fn reaches(&self, surface: &Surface, disc: &Disc, place: DVec2) -> bool {
        let to_place = disc.center + disc.radii[0] * place.x + disc.radii[1] * place.y;
        surface.geometric_normal.dot(to_place) > 0.0
            && !self.view.tracer().occluded_from(surface, to_place, disc.end)
    }
}

/// What rays through a grid of cells found.
struct Grid {
    mean: f64,
    /// Estimate of the variance of `mean`.
    variance: f64,
}

impl Grid {
    /// The number of rays for `cells` cells along each side.
    fn rays(cells: u32) -> u32 {
        2 * cells * cells
    }

    /// Looks at two random places in each of `cells` × `cells` cells, which divide the disc into
    /// equal areas.
    ///
    /// The variance of the mean of a cell's two values a and b is estimated without bias by
    /// (a − b)²/4, and that of the mean over n cells by the sum of these over n².
    fn sample(cells: u32, random: &mut Random, mut look: impl FnMut(DVec2) -> f64) -> Self {
        let (mut sum, mut squares) = (0.0, 0.0);
        for (i, j) in (0..cells * cells).map(|k| (k % cells, k / cells)) {
            let [a, b] = [0; 2].map(|_| {
                let within = DVec2::new(random.unit(), random.unit());
                let place = DVec2::new(f64::from(i), f64::from(j)) + within;
                look(in_disc(place / f64::from(cells)))
            });
            sum += a + b;
            squares += (a - b) * (a - b);
        }
        let n = f64::from(cells * cells);
        Self { mean: sum / (2.0 * n), variance: 0.25 * squares / (n * n) }
    }
}

/// Takes the unit square to the unit disc, equal areas to equal areas and neighbours to neighbours
/// (Shirley and Chiu 1997).
fn in_disc(square: DVec2) -> DVec2 {
    let at = square * 2.0 - 1.0;
    if at == DVec2::ZERO {
        return at;
    }
    let (radius, angle) = if at.x.abs() > at.y.abs() {
        (at.x, FRAC_PI_4 * (at.y / at.x))
    } else {
        (at.y, FRAC_PI_2 - FRAC_PI_4 * (at.x / at.y))
    };
    radius * DVec2::from_angle(angle)
}

/// Numbers that look random, the same for the same point.
struct Random(u64);

impl Random {
    fn at(point: DVec3) -> Self {
        let mut all = Self(0);
        for coordinate in point.to_array() {
            all.0 ^= coordinate.to_bits();
            all.0 = all.next();
        }
        all
    }

    /// SplitMix64 (Steele, Lea and Flood 2014).
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 2f64.powi(-53)
    }
}
