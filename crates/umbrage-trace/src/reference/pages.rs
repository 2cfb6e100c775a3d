//! Pages of paged maps, traced when they are first looked up.

use super::DepthMap;
use crate::Tracer;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::collections::hash_map::RandomState;
use std::fmt::{self, Debug};
use std::hash::BuildHasher;
use std::sync::{Arc, OnceLock, PoisonError, RwLock};
use umbrage::paged::{PAGE_TEXELS, Page, PagePlace};
use umbrage::visibility::visibility;
use umbrage::{Plan, ShadowMap};

/// Parts of the table of pages, each with a lock of its own, so that threads seldom wait.
const SHARDS: usize = 64;

/// A page that is traced once, by the thread that needs it first.
type Entry = Arc<OnceLock<Option<Traced>>>;

/// The pages of a plan that have been looked up so far.
pub(super) struct Pages<'a> {
    tracer: &'a Tracer<'a>,
    shards: Box<[RwLock<HashMap<Page, Entry>>]>,
    hasher: RandomState,
}

/// A page's own map and its depths.
struct Traced {
    map: ShadowMap,
    depths: DepthMap,
}

impl Debug for Pages<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pages").field("len", &self.len()).finish_non_exhaustive()
    }
}

impl<'a> Pages<'a> {
    pub(super) fn new(tracer: &'a Tracer<'a>) -> Self {
        Self {
            tracer,
            shards: (0..SHARDS).map(|_| RwLock::default()).collect(),
            hasher: RandomState::new(),
        }
    }

    /// Visibility of a surface point at its place.
    pub(super) fn visibility(
        &self,
        plan: &Plan,
        place: &PagePlace,
        position: DVec3,
        normal: DVec3,
    ) -> Option<f32> {
        let receiver = plan.page_receiver(place, position, normal)?;
        let entry = self.entry(place.page);
        // The tracing must not wait for other jobs of the thread pool: its thread could take one
        // that needs this very page.
        let traced = entry.get_or_init(|| {
            let map = plan.page_map(&place.page)?;
            let depths = DepthMap::of_page(self.tracer, &map, plan.filter.reach_texels());
            Some(Traced { map, depths })
        });
        let Traced { map, depths } = traced.as_ref()?;
        Some(visibility(map, plan.filter, &receiver, |i, j| depths.texel(i, j)))
    }

    fn entry(&self, page: Page) -> Entry {
        let shard = &self.shards[self.hasher.hash_one(page) as usize % SHARDS];
        let known = shard.read().unwrap_or_else(PoisonError::into_inner).get(&page).cloned();
        known.unwrap_or_else(|| {
            let mut pages = shard.write().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(pages.entry(page).or_default())
        })
    }

    /// Number of pages.
    pub(super) fn len(&self) -> usize {
        let pages = self.shards.iter().map(|s| s.read().unwrap_or_else(PoisonError::into_inner));
        pages.map(|pages| pages.len()).sum()
    }

    /// Number of texels that are traced, with the gutters.
    pub(super) fn drawn_texels(&self, plan: &Plan) -> u64 {
        let drawn = plan.filter.drawn_texels([PAGE_TEXELS; 2]).map(u64::from);
        self.len() as u64 * drawn[0] * drawn[1]
    }
}

/// Texel coordinates of a place in its level's window.
pub(super) fn texel_in_window(plan: &Plan, place: &PagePlace) -> Option<DVec2> {
    let first = plan.paging.as_ref()?.levels.get(place.map)?.first_page;
    let page = DVec2::new((place.page.i - first[0]) as f64, (place.page.j - first[1]) as f64);
    Some(page * f64::from(PAGE_TEXELS) + place.texel)
}
