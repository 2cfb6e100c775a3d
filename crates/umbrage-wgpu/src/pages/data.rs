//! The data of pages that shaders read. Each struct has the layout of the struct in `wgsl/` that
//! its comment names.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use umbrage::paged::{FALLBACK_LEVELS, Grid, PAGE_TEXELS, Paging};
use umbrage::{Aabb, Camera, ShadowMap, ViewRay};

/// `ShadowPageLevel`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) first: [i32; 2],
    pub(crate) side: u32,
    pub(crate) table: u32,
    pub(crate) level: i32,
    pub(crate) levels: u32,
    pub(crate) slabs: u32,
    pub(crate) slab: i32,
    pub(crate) coarser: u32,
    pub(crate) coarser_by: u32,
    pub(crate) to_coarser: [i32; 2],
}

/// `ShadowPlacedPage`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PlacedPage {
    pub(crate) map: u32,
    pub(crate) slab: i32,
    pub(crate) index: [i32; 2],
    pub(crate) slot: u32,
    pub(crate) wanted: u32,
    pub(crate) stale: u32,
    pub(crate) padding: u32,
}

/// `SHADOW_PAGE_STALE`, `SHADOW_PAGE_MOVED` and `SHADOW_PAGE_SHOWN` of `wgsl/page_types.wesl`.
pub(crate) const STALE: u32 = 1;
pub(crate) const MOVED: u32 = 2;
pub(crate) const SHOWN: u32 = 8;

/// `SHADOW_PAGE_STILL` of `wgsl/page_types.wesl`.
pub(crate) const STILL: u32 = 1 << 31;

/// `ShadowPageMeshing`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Meshing {
    pub(crate) meshes: u32,
    pub(crate) draws: u32,
    pub(crate) maps: u32,
    pub(crate) room: u32,
    pub(crate) reach: f32,
    pub(crate) is_still: u32,
    pub(crate) stride: u32,
}

/// `ShadowPageMesh`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PageMesh {
    pub(crate) render_from_mesh: [Vec4; 3],
    pub(crate) low: Vec3,
    pub(crate) draw: u32,
    pub(crate) high: Vec3,
    pub(crate) padding: u32,
}

/// `ShadowPageMeshDraw`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MeshDraw {
    pub(crate) first_index: u32,
    pub(crate) index_count: u32,
    pub(crate) base_vertex: i32,
    pub(crate) first_map: u32,
    pub(crate) end_map: u32,
}

/// `SHADOW_PAGE_EMPTY` of `wgsl/page_types.wesl`.
pub(crate) const EMPTY: u32 = u32::MAX;

/// `ShadowFreshPage`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FreshPage {
    pub(crate) place: u32,
    pub(crate) map: u32,
    pub(crate) page: u32,
    pub(crate) slot: u32,
    pub(crate) is_still: u32,
}

/// `ShadowPageFrame`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Frame {
    pub(crate) frame: u32,
    pub(crate) places: u32,
    pub(crate) room: u32,
    pub(crate) boxes: u32,
    pub(crate) still_boxes: u32,
    pub(crate) error: f32,
    pub(crate) least_bias: f32,
    pub(crate) all_stale: u32,
    pub(crate) groups: [u32; 2],
    pub(crate) maps: u32,
    pub(crate) stamp: u32,
    pub(crate) births: u32,
    pub(crate) first_coming: u32,
    pub(crate) frames_left: u32,
    pub(crate) padding: u32,
}

/// `ShadowPageView`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct View {
    pub(crate) start: Vec3,
    pub(crate) base: f32,
    pub(crate) start_x: Vec3,
    pub(crate) per_nearness: f32,
    pub(crate) start_y: Vec3,
    pub(crate) is_orthographic: u32,
    pub(crate) way: Vec3,
    pub(crate) background: f32,
    pub(crate) way_x: Vec3,
    pub(crate) frame: u32,
    pub(crate) way_y: Vec3,
    pub(crate) room: u32,
    pub(crate) size: [u32; 2],
    pub(crate) padding: [u32; 2],
}

/// `ShadowPagePool`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Pool {
    pub(crate) size: Vec2,
    pub(crate) across: u32,
    pub(crate) padding: u32,
}

/// Words of the state of all pages, and the places in it: see `wgsl/page_types.wesl`.
pub(crate) const STATE_WORDS: usize = 9;
pub(crate) const BIAS: usize = 3;
pub(crate) const MISSING: usize = 4;
pub(crate) const FRESH: usize = 5;
pub(crate) const USED: usize = 6;
pub(crate) const WAITING: usize = 7;
pub(crate) const APART: usize = 8;

/// Words of the table's head.
pub(crate) const TABLE_HEAD: u32 = 8;

/// The levels of a plan's maps, and the number of the table's words.
pub(crate) fn levels(paging: &Paging) -> (Vec<Level>, u32) {
    let mut table = TABLE_HEAD;
    let mut levels = Vec::with_capacity(paging.levels.len());
    for grid in &paging.grids {
        for (offset, map) in grid.maps.clone().enumerate() {
            let own = &paging.levels[map];
            let slabs = grid.slabs as i64;
            let slab_of_level = offset as i64 % slabs;
            let words = own.side * own.side;
            let by = FALLBACK_LEVELS.min(grid.last_level() - own.level);
            let coarser_first = map - slab_of_level as usize + by as usize * grid.slabs;
            let is_behind = grid.coarser_slab(own.slab, by) > paging.levels[coarser_first].slab;
            let coarser = (coarser_first + usize::from(is_behind)) as u32;
            // The windows of neighbouring slabs take turns, so that a slab keeps its place in the
            // table when it becomes the first one.
            let turn = own.slab.rem_euclid(slabs) as u32;
            levels.push(Level {
                first: own.first_page.map(|i| i as i32),
                side: own.side,
                table: table + turn * words,
                level: own.level,
                levels: (grid.last_level() - own.level + 1) as u32,
                slabs: slabs as u32,
                slab: own.slab as i32,
                coarser: if by == 0 { EMPTY } else { coarser },
                coarser_by: by as u32,
                to_coarser: std::array::from_fn(|axis| {
                    let first = |map: usize| paging.levels[map].first_page[axis];
                    (first(map) - (first(coarser as usize) << by)) as i32
                }),
            });
            if slab_of_level == slabs - 1 {
                table += slabs as u32 * words;
            }
        }
    }
    (levels, table)
}

/// For each map of a plan the first map of the same level in the next plan, in the grid that has the
/// same pages; `EMPTY` if there is none.
pub(crate) fn levels_now(before: &[Grid], now: &[Grid]) -> Vec<u32> {
    let mut maps = Vec::new();
    let mut is_taken = vec![false; now.len()];
    for grid in before {
        // Lights that are alike have a grid each.
        let is_next = |&i: &usize| !is_taken[i] && now[i].has_pages_of(grid);
        let next = (0..now.len()).find(is_next);
        if let Some(next) = next {
            is_taken[next] = true;
        }
        for offset in 0..grid.maps.len() {
            let level = grid.first_level + (offset / grid.slabs) as i32;
            let first = next.map(|next| &now[next]).and_then(|now| {
                let is_there = (now.first_level..=now.last_level()).contains(&level);
                let offset = (level - now.first_level) * now.slabs as i32;
                is_there.then_some((now.maps.start as i32 + offset) as u32)
            });
            maps.push(first.unwrap_or(EMPTY));
        }
    }
    maps
}

/// The pages of a map that the shadow of a box (world space) may touch: first column and row, and
/// the last ones, which are less than the first if it touches none. `reach` texels beyond a page
/// belong to it.
pub(crate) fn touched(map: &ShadowMap, level: &Level, aabb: Aabb, reach: u32) -> [i32; 4] {
    const NOTHING: [i32; 4] = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
    const ALL: [i32; 4] = [i32::MIN, i32::MIN, i32::MAX, i32::MAX];
    if aabb.is_empty() || !map.may_cast(aabb) {
        return NOTHING;
    }
    let [mut low, mut high] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for corner in aabb.corners() {
        let Some(at) = map.project(corner) else { return ALL };
        let texel = at.truncate() * f64::from(map.resolution[0]);
        low = low.min(texel);
        high = high.max(texel);
    }
    let side = f64::from(level.side);
    let page = |texel: DVec2| {
        (texel / f64::from(PAGE_TEXELS)).floor().clamp(DVec2::splat(-1.0), DVec2::splat(side))
    };
    let margin = f64::from(reach) + 1.0;
    let [low, high] = [page(low - margin), page(high + margin)];
    let index = |page: f64, axis: usize| level.first[axis].wrapping_add(page as i32);
    [index(low.x, 0), index(low.y, 1), index(high.x, 0), index(high.y, 1)]
}

impl View {
    /// The points that a camera sees at pixels and distances, relative to `render_origin`.
    pub(crate) fn new(camera: &Camera, render_origin: DVec3) -> Self {
        let rays = [DVec2::ZERO, DVec2::X, DVec2::Y].map(|pixel| camera.ray(pixel));
        // A whole picture apart, so that no digits are lost between pixels.
        let [width, height] = camera.image().map(f64::from);
        let [right, below] = [DVec2::new(width, 0.0), DVec2::new(0.0, height)];
        let step = |end: DVec2, length: f64, part: fn(&ViewRay) -> DVec3| {
            (part(&camera.ray(end)) - part(&rays[0])) / length
        };
        let [start, way] = [|ray: &ViewRay| ray.start, |ray: &ViewRay| ray.direction];
        Self {
            start: (rays[0].start + camera.eye() - render_origin).as_vec3(),
            start_x: step(right, width, start).as_vec3(),
            start_y: step(below, height, start).as_vec3(),
            way: rays[0].direction.as_vec3(),
            way_x: step(right, width, way).as_vec3(),
            way_y: step(below, height, way).as_vec3(),
            is_orthographic: camera.is_orthographic().into(),
            size: camera.image(),
            ..Self::default()
        }
    }
}
