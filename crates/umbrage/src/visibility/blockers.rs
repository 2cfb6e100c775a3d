//! The search of percentage-closer soft shadows for casters.

use super::{Filter, Square, Test, Texels, across, nearest};
use glam::DVec2;

/// Where casters are searched that hide some of the light from a receiver.
pub(super) struct Blockers<'a, T> {
    pub(super) test: &'a Test<'a>,
    pub(super) texels: &'a T,
    /// The receiver in texel coordinates.
    pub(super) texel: DVec2,
    /// The lowest and the highest texel coordinates that are drawn.
    pub(super) ends: [DVec2; 2],
    /// Each step of the search looks at n² texels.
    pub(super) n: u32,
    /// Diameter of the light.
    pub(super) diameter: f64,
}

/// A disc in which casters are searched, lengths in metres across the receiver's beam.
struct Disc {
    square: Square,
    /// Its diameter.
    width: f64,
    /// The share of a texel's distance from the receiver that its penumbra must reach.
    near_enough: f64,
    /// The distance up to which a texel counts whatever its penumbra.
    slack: f64,
}

impl<T: Texels> Blockers<'_, T> {
    /// Mean width of the penumbrae that casters throw onto the receiver, metres; `None` if no
    /// caster hides any of the light.
    ///
    /// A texel hides some of the light if it lies within its own penumbra around the receiver's
    /// beam. All such texels lie within the penumbra of a caster at depth 0. Where a lamp hangs
    /// among the casters, however, this penumbra may be as wide as the map, and far wider than what
    /// is to be found. The first step therefore looks along a logarithmic spiral, which has as many
    /// places near the receiver as far from it on every scale, and finds the widest penumbra. If
    /// there is one, the second step looks at places that are evenly spread over it.
    pub(super) fn mean_width(&self) -> Option<f64> {
        let Test { map, receiver, .. } = *self.test;
        let farthest = self.diameter * map.penumbra(receiver, receiver.st, 0.0);
        let first = self.disc(farthest, f64::from(Filter::NEAR_ENOUGH), 0.0);
        let count = self.n * self.n;
        // The spiral ends at half a texel.
        let ratio = first.square.texel().powf(1.0 / f64::from(count));
        let places = Filter::spiral_directions(count).scan(0.5, |radius, direction| {
            let place = DVec2::from(direction.map(f64::from)) * *radius;
            *radius *= ratio;
            Some(place)
        });
        let widths = places.filter_map(|place| self.width(&first, place));
        let widest = widths.fold(0.0, f64::max).min(farthest);
        if widest <= 0.0 {
            return None;
        }
        let second = self.disc(widest, 1.0, widest / f64::from(self.n));
        let places = Filter::disc_places(count).iter().map(|p| DVec2::from(p.map(f64::from)));
        let widths = places.filter_map(|place| self.width(&second, place));
        let (sum, count) = widths.fold((0.0, 0u32), |(sum, n), width| (sum + width, n + 1));
        (count > 0).then(|| sum / f64::from(count))
    }

    fn disc(&self, width: f64, near_enough: f64, between: f64) -> Disc {
        let square = Square::new(across(self.test.receiver, width));
        let slack = between.max(width * square.texel());
        Disc { square, width, near_enough, slack }
    }

    /// The width of the penumbra of the texel at a place in the disc of diameter 1 around 0,
    /// metres; `None` if the texel hides nothing of the light.
    fn width(&self, disc: &Disc, place: DVec2) -> Option<f64> {
        let Test { map, receiver, .. } = *self.test;
        let [i, j] = nearest(self.texel + disc.square.offset(place.into()), self.ends);
        let depth = f64::from(self.texels.depth(i, j));
        let width = self.diameter * map.penumbra(receiver, self.test.center(i, j), depth);
        let radius = 2.0 * place.length() * disc.width;
        let is_near = disc.near_enough * radius <= width + disc.slack;
        (is_near && depth < self.test.nearest_lit(i, j)).then_some(width)
    }
}
