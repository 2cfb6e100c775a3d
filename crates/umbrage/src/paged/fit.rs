//! The bias with which pages fit.

use super::{MOST_BIAS, Page};
use crate::plan::{MapError, Plan};
use glam::DVec3;
use std::collections::BTreeSet;

/// The steps in which the bias is sought, levels.
const STEP: f64 = 1.0 / 64.0;

impl Plan {
    /// The pages that receivers at these world positions want under a light, and those that stand
    /// in for them ([`fallback_page`](Self::fallback_page)).
    pub fn wanted_pages<'a>(
        &self,
        light: usize,
        world_positions: impl IntoIterator<Item = &'a DVec3>,
    ) -> BTreeSet<Page> {
        let mut pages = BTreeSet::new();
        for &position in world_positions {
            if let Some(place) = self.page_place(light, position) {
                if pages.insert(place.page) {
                    pages.extend(self.fallback_page(&place, position));
                }
            }
        }
        pages
    }

    /// Sets the [bias](super::Paging::bias) to the least multiple of 1/64 with which all lights'
    /// pages at these world positions fit into the budget, or to [`MOST_BIAS`] if they never do.
    /// Does nothing in plans without pages or without a budget.
    pub fn fit_pages(&mut self, world_positions: &[DVec3]) {
        let Some(budget) = self.paging.as_ref().and_then(|paging| paging.budget) else { return };
        let lights = self.lights.len();
        let mut fits = |step: u32| {
            self.set_page_bias(f64::from(step) * STEP);
            let wanted = (0..lights).map(|light| self.wanted_pages(light, world_positions).len());
            wanted.sum::<usize>() <= budget as usize
        };
        // The number of pages falls with the bias, but for some pages.
        let [mut too_small, mut enough] = [0, (MOST_BIAS / STEP) as u32];
        if fits(0) {
            return;
        }
        while enough - too_small > 1 {
            let middle = u32::midpoint(too_small, enough);
            if fits(middle) { enough = middle } else { too_small = middle }
        }
        fits(enough);
    }

    /// Sets the [bias](super::Paging::bias) of levels, which is at least 0 and at most
    /// [`MOST_BIAS`].
    pub fn set_page_bias(&mut self, bias: f64) {
        let Some(paging) = &mut self.paging else { return };
        paging.bias = bias.clamp(0.0, MOST_BIAS);
        let bound = paging.bound();
        for map in &mut self.maps {
            map.error = MapError::new([bound; 2], bound);
        }
    }
}
