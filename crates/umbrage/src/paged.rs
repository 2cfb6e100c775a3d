//! Paged maps: of even maps with texels a power of two wide, only the pages that the camera sees.
//!
//! # Addresses
//! Every projector of a light (a parallel beam, a cone, or one side of the cube around a point
//! light) has a *grid*: a plane across its axis, with fixed axes and a fixed origin. Under parallel
//! light the plane's origin is that of the world and its unit is the metre; under a lamp it lies at
//! distance 1, and its unit is the tangent of an angle. On *level* l texels are τ = 2^l wide, and a
//! [`Page`] of 64² texels covers [64 τ i, 64 τ (i + 1)) × [64 τ j, 64 τ (j + 1)). A page's matrix
//! follows from its address alone ([`Plan::page_map`]), to the bit, wherever the camera is.
//!
//! # Depths
//! Under parallel light depths count in *slabs* of [`SLAB_TEXELS`] texels of the page's level, and
//! a page belongs to the slab of its receivers. Depth runs from 0, [`AHEAD_TEXELS`] before the slab,
//! to 1 at its end. So single precision resolves 1/200 of a texel wherever the page is; casters
//! nearer to the light are clamped to 0. A lamp's light has two slabs, on all levels the same: one
//! from its near distance to the geometric mean of that and its range, and one from there on.
//! Depths of the second begin at an eighth of that distance, so that a caster that is a thousand
//! times as near as the farthest receivers does not cost these their precision.
//!
//! # Levels
//! A receiver is looked up on the largest level whose texels are no wider across the light than
//! `error` pixels there: with a pixel's width w in metres, and the distance d from the lamp along
//! the grid's axis (1 under parallel light), the largest l with 2^l d ≤ `error` 2^[`bias`] w.
//! Slopes of surfaces do not count, as in [`MapError`].
//!
//! [`bias`]: Paging::bias
//!
//! Where a page is missing because there are more wanted than there is room for, the next coarser
//! one is looked up. With every page that is wanted comes one that is [`FALLBACK_LEVELS`] coarser,
//! so that there always is one.
//!
//! # Tables
//! All receivers of a level lie near the viewer. With the sine of half a pixel's angle neglected, a
//! pixel is z/f metres wide at the distance z along the view, where f is the focal length in
//! pixels. Receivers of level l have z < 2 τ f/`error`, so they lie within R = 2 τ f c/`error` of
//! the eye, where 1/c is the cosine of the angle between the view's axis and its corners. A window
//! of R/32 τ + 2 pages across, around the eye and rounded up to a power of two, holds them all,
//! however the camera turns: 2 f c/(32 `error`) + 2 pages, on every level alike. It becomes one of
//! the plan's [maps](Plan::maps), with all of its pages in place. At 1920×1080 pixels and a field
//! of view of 60° this gives 128 pages.
//!
//! Under a lamp the distance from the lamp changes along with the place. Let ρ = 2 τ f c/`error`,
//! so that receivers of the level lie within ρ d of the eye. If ρ < ½, their places on the plane
//! lie within ρ (1 + (t + ρ)/(1 − ρ)) of the eye's, where t is the tangent of half the opening
//! angle, and the window is that wide. Otherwise it covers the whole plane.

mod aging;
mod fit;
mod grid;
#[cfg(test)]
mod tests;

use crate::camera::Camera;
use crate::error::{Error, check};
use crate::light::Light;
use crate::plan::{CubeSide, MapError, Part, Plan, PlannedLight, Receiver, ShadowMap};
use crate::technique::{Cover, Size, Technique};
use crate::warp::theta;
pub use aging::{AgingLights, LightAge};
use glam::{DVec2, DVec3};
use grid::Projection;
use std::ops::Range;

/// Texels across a page.
pub const PAGE_TEXELS: u32 = 64;

/// Texels of a page.
pub const PAGE_AREA: u64 = PAGE_TEXELS as u64 * PAGE_TEXELS as u64;

/// The thickness of a slab under parallel light, texels of the page's level.
pub const SLAB_TEXELS: f64 = 65536.0;

/// How far ahead of a slab the depths of its maps begin, texels of the page's level. Casters nearer
/// to the light have depth 0, whatever their distance: single precision then tells as small steps
/// apart as possible, and no filter's gutter holds the penumbra of a caster so far away.
pub const AHEAD_TEXELS: f64 = 8192.0;

/// The least error that can be asked for, pixels.
pub const LEAST_ERROR: f64 = 0.25;

/// The largest error that can be asked for, pixels.
pub const MOST_ERROR: f64 = 8.0;

/// The least number of texels that pages can share.
pub const LEAST_BUDGET: u64 = 512 * 512;

/// The largest bias of levels. With it texels are 64 times as wide as asked for.
pub const MOST_BIAS: f64 = 6.0;

/// The levels by which the page that stands in for a missing one is coarser.
pub const FALLBACK_LEVELS: i32 = 4;

/// The most pages across a window.
const MOST_SIDE: f64 = 1024.0;

/// What a plan with pages has beside its maps. Each of its maps is the window of a [`Level`] around
/// the viewer, with places for all pages; which of them exist follows from what is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Paging {
    /// The camera of the plan.
    pub camera: Camera,
    /// The greatest width of a texel that was asked for, pixels.
    pub error: f64,
    /// By how many levels, 0 ..= [`MOST_BIAS`], receivers are looked up in coarser maps than the
    /// error asks for, because the pages would not fit otherwise. It is no whole number: where a
    /// level begins moves smoothly with it.
    pub bias: f64,
    /// The most pages that there may be; `None` for as many as are wanted.
    pub budget: Option<u32>,
    /// The grids of all lights.
    pub grids: Vec<Grid>,
    /// One level, with its slab, for each map of the plan.
    pub levels: Vec<Level>,
    /// The lights whose pages can wait; `None` if all are looked up in this frame.
    pub coming: Option<ComingLights>,
}

/// The lights of a plan whose pages are drawn ahead of the frame in which they are looked up: see
/// [`AgingLights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComingLights {
    /// The index of the first one in the plan. The others follow it.
    pub first: usize,
    /// The frames, this one among them, in which their pages are drawn; at least 1.
    pub frames: u32,
}

/// The grid of one projector of a light.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Index of the light.
    pub light: usize,
    /// Side of the cube around a point light or a wide spot light.
    pub side: Option<CubeSide>,
    /// Indices of the grid's maps in [`Plan::maps`]: [`slabs`](Self::slabs) for each level, from
    /// the finest level on.
    pub maps: Range<usize>,
    /// The finest level.
    pub first_level: i32,
    /// Neighbouring slabs that receivers of a level may lie in: 2.
    pub slabs: usize,
    projection: Projection,
}

/// The level of a map of a plan with pages, and where its window is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Index in [`Paging::grids`].
    pub grid: usize,
    /// The base-two logarithm of a texel's width.
    pub level: i32,
    /// The slab of the map's receivers; 0 under a lamp.
    pub slab: i64,
    /// The first page of the window.
    pub first_page: [i64; 2],
    /// Pages across the window, a power of two. A table of pages can therefore be addressed modulo
    /// its side.
    pub side: u32,
}

/// The address of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Page {
    /// Index in [`Paging::grids`].
    pub grid: usize,
    /// The base-two logarithm of a texel's width, in metres or as the tangent of an angle.
    pub level: i32,
    /// The slab of the page's receivers; 0 under a lamp.
    pub slab: i64,
    /// Index along the grid's first axis.
    pub i: i64,
    /// Index along the grid's second axis.
    pub j: i64,
}

/// Where a plan with pages looks a point up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PagePlace {
    /// Index in [`Plan::maps`].
    pub map: usize,
    /// The page.
    pub page: Page,
    /// The point's place in the page, texels, 0 ..= [`PAGE_TEXELS`].
    pub texel: DVec2,
}

/// The largest whole l with 2^l ≤ `x`, which must be positive and normal.
fn floor_log2(x: f64) -> i32 {
    (x.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

/// The width of a texel of a level: metres under parallel light, and metres at a distance of one
/// metre along the axis of a lamp's map.
pub fn texel_width(level: i32) -> f64 {
    f64::from(level).exp2()
}

/// The width of a page of a level.
fn page_width(level: i32) -> f64 {
    f64::from(PAGE_TEXELS) * texel_width(level)
}

impl Technique {
    /// The error of the technique's pages, pixels; `None` if it has none.
    pub fn paged_error(&self) -> Option<f64> {
        match self.cover {
            Cover::Paged { error } => Some(error),
            _ => None,
        }
    }
}

impl Paging {
    /// The greatest width of a texel across the light, pixels, that a receiver has.
    pub fn bound(&self) -> f64 {
        self.error * self.bias.exp2()
    }

    /// Plans the windows of all levels for one view, as the plan's maps. The light's directions must
    /// have been checked.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a view whose levels have windows of more than 1024 pages.
    pub(crate) fn plan(
        plan: &mut Plan,
        camera: &Camera,
        lights: &[Light],
        technique: &Technique,
        error: f64,
    ) -> Result<(), Error> {
        let budget = match technique.size {
            Size::Budget(texels) => Some(texels / u64::from(PAGE_TEXELS).pow(2)),
            _ => None,
        };
        let budget = budget.map(|pages| u32::try_from(pages).unwrap_or(u32::MAX));
        // The memory of the last plan's lists is used again.
        let (mut grids, mut levels) = match plan.paging.take() {
            Some(Self { grids, levels, .. }) => (grids, levels),
            None => (Vec::new(), Vec::new()),
        };
        grids.clear();
        levels.clear();
        plan.lights.clear();
        for (light, of_light) in lights.iter().enumerate() {
            let first = levels.len();
            for &side in of_light.sides().iter().filter(|_| technique.filter.has_maps()) {
                let projection = Projection::new(&of_light.projector(side));
                let views = projection.views(camera, error);
                let maps = levels.len()..levels.len() + views.levels.len() * views.slabs;
                for level in views.levels.clone() {
                    let window = projection.window(camera, error, level);
                    check(window.side <= MOST_SIDE, "technique.cover", || {
                        format!(
                            "pages with an error of {error} pixels need tables of {} pages across in \
                             this view, of which {MOST_SIDE} are possible: take a larger error, or \
                             a camera with fewer pixels or a nearer far plane",
                            window.side
                        )
                    })?;
                    levels.extend((0..views.slabs as i64).map(|slab| Level {
                        grid: grids.len(),
                        level,
                        slab: window.slab + slab,
                        first_page: window.first_page,
                        side: window.side as u32,
                    }));
                }
                let first_level = views.levels.start;
                grids.push(Grid { light, side, maps, first_level, slabs: views.slabs, projection });
            }
            let middle = camera.forward() * camera.near().midpoint(camera.far());
            let theta_rad = theta(of_light, camera, middle);
            plan.lights.push(PlannedLight { maps: first..levels.len(), theta_rad });
        }
        plan.maps.resize_with(levels.len(), ShadowMap::default);
        let reach = technique.filter.reach_texels();
        for (index, (map, level)) in plan.maps.iter_mut().zip(&levels).enumerate() {
            let grid: &Grid = &grids[level.grid];
            grid.projection.set_map(map, camera.eye(), level, reach);
            grid.projection.set_cell(map, camera);
            map.part = grid.part(level.level);
            map.split = grid.projection.split(camera, error, level.level);
            map.error = MapError::new([error; 2], error);
            map.check_finite(index)?;
        }
        let coming = None;
        plan.paging =
            Some(Self { camera: *camera, error, bias: 0.0, budget, grids, levels, coming });
        Ok(())
    }
}

impl Grid {
    /// The coarsest level.
    pub fn last_level(&self) -> i32 {
        self.first_level + (self.maps.len() / self.slabs) as i32 - 1
    }

    /// Whether an address stands for the same page in both grids, whichever levels they have and
    /// whichever light of its plan theirs is: what was drawn for one plan then serves the other.
    pub fn has_pages_of(&self, other: &Self) -> bool {
        (self.slabs, &self.projection) == (other.slabs, &other.projection)
    }

    /// The slab of a level `levels_coarser` levels coarser that holds a slab.
    pub fn coarser_slab(&self, slab: i64, levels_coarser: i32) -> i64 {
        self.projection.coarser_slab(slab, levels_coarser)
    }

    /// Which part of the view a level serves.
    fn part(&self, level: i32) -> Part {
        let slice = (level - self.first_level) as usize;
        Part { light: self.light, side: self.side, slice, ..Part::default() }
    }
}

impl Page {
    /// The page as the only one of a level's window.
    fn as_level(&self) -> Level {
        let Self { grid, level, slab, i, j } = *self;
        Level { grid, level, slab, first_page: [i, j], side: 1 }
    }
}

impl Plan {
    /// The page at which a world point is looked up under one of the lights; `None` if the plan has
    /// no pages, or serves no receivers there.
    pub fn page_place(&self, light: usize, world_position: DVec3) -> Option<PagePlace> {
        let paging = self.paging.as_ref()?;
        let local = (world_position - self.origin).extend(1.0);
        if paging.camera.depth(world_position) > paging.camera.far() * (1.0 + 1e-9) {
            return None;
        }
        let allowed = paging.bound() * self.pixel_gradient.dot(local);
        let mut grids = paging.grids.iter().enumerate().filter(|(_, grid)| grid.light == light);
        let (index, grid, seen) = grids.find_map(|(index, grid)| {
            Some((index, grid, grid.projection.project(world_position)?))
        })?;
        let ratio = allowed / seen.w;
        let finest = if ratio > 0.0 { floor_log2(ratio) } else { grid.first_level };
        let level = finest.clamp(grid.first_level, grid.last_level());
        let map = grid.maps.start + (level - grid.first_level) as usize * grid.slabs;
        let width = page_width(level);
        let [i, j] = [seen.plane.x, seen.plane.y].map(|x| (x / width).floor());
        let slab = grid.projection.slab(world_position, level);
        let page = Page { grid: index, level, slab, i: i as i64, j: j as i64 };
        let window = &paging.levels[map];
        let slab_offset = usize::try_from(slab - window.slab).ok().filter(|&s| s < grid.slabs)?;
        let is_inside = [page.i, page.j]
            .into_iter()
            .zip(window.first_page)
            .all(|(page, first)| (0..i64::from(window.side)).contains(&(page - first)));
        let texel = (seen.plane / width - DVec2::new(i, j)) * f64::from(PAGE_TEXELS);
        is_inside.then_some(PagePlace { map: map + slab_offset, page, texel })
    }

    /// The page that is looked up where the one at a place is missing, [`FALLBACK_LEVELS`] coarser
    /// or on the coarsest level. It holds all of that page, and belongs to the slab of the world
    /// position.
    pub fn fallback_page(&self, place: &PagePlace, world_position: DVec3) -> Option<Page> {
        let grid = self.paging.as_ref()?.grids.get(place.page.grid)?;
        let level = (place.page.level + FALLBACK_LEVELS).min(grid.last_level());
        let coarser = level - place.page.level;
        let slab = grid.projection.slab(world_position, level);
        let [i, j] = [place.page.i, place.page.j].map(|index| index >> coarser);
        Some(Page { level, slab, i, j, ..place.page })
    }

    /// The map of one page, whose matrix follows from the page's address and the light alone. Its
    /// [`origin`](ShadowMap::origin) is not the plan's. `None` if the plan has no such grid.
    pub fn page_map(&self, page: &Page) -> Option<ShadowMap> {
        let paging = self.paging.as_ref()?;
        let grid = paging.grids.get(page.grid)?;
        let mut map = ShadowMap::default();
        let origin = grid.projection.page_origin(page);
        grid.projection.set_map(&mut map, origin, &page.as_level(), self.filter.reach_texels());
        map.part = grid.part(page.level);
        map.split = grid.projection.split(&paging.camera, paging.error, page.level);
        map.error = MapError::new([paging.bound(); 2], paging.bound());
        Some(map)
    }

    /// A surface point at its place, in the coordinates of the page's own map. For the rest as
    /// [`receiver`](Self::receiver).
    pub fn page_receiver(
        &self,
        place: &PagePlace,
        world_position: DVec3,
        world_normal: DVec3,
    ) -> Option<Receiver> {
        let side = f64::from(self.paging.as_ref()?.levels.get(place.map)?.side);
        let receiver = self.receiver(place.map, world_position, world_normal)?;
        Some(Receiver {
            st: place.texel / f64::from(PAGE_TEXELS),
            slope: receiver.slope / side,
            level_slope: receiver.level_slope / side,
            ..receiver
        })
    }
}
