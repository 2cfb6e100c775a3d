//! The convex cells that the planner takes as receivers.

use super::motion::{self, Motion};
use super::{BEYOND, Seen, SeenTile, SeenTiles, beyond, depth, nearness};
use crate::bounds::Aabb;
use crate::camera::Camera;
use crate::math::Keyed;
use glam::DVec3;
use std::collections::BinaryHeap;

/// Largest number of cells around what was seen, and around what may have come into view at the
/// edges of the picture.
const MAX_CELLS: [usize; 2] = [48, 16];

/// Cells of receivers, in buffers that are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    pyramid: Pyramid,
    motion: motion::Buffers,
    cells: Vec<[DVec3; 8]>,
}

impl Cells {
    /// Finds cells that together hold every receiver that `camera` sees, relative to its eye,
    /// except those in `moving`. `boxes` hold all receivers that were not seen. `None` if the
    /// camera has moved too far.
    ///
    /// The corners of a cell have the order of [`Aabb::corners`]: bit 0 of the index picks the
    /// right, bit 1 the upper and bit 2 the nearer side.
    pub(crate) fn find(
        &mut self,
        Seen { tiles: seen, moving, clearance }: Seen<'_>,
        camera: &Camera,
        boxes: &[Aabb],
    ) -> Option<impl Iterator<Item = [DVec3; 8]> + use<'_>> {
        let Self { pyramid, motion, cells } = self;
        cells.clear();
        let grid = [SeenTiles::ACROSS, SeenTiles::DOWN];
        if seen.camera == *camera && moving.is_empty() {
            pyramid.build(grid, seen.tiles.iter().copied());
        } else {
            let step = Motion::new(seen, camera)?;
            motion.uncover(seen, &step, boxes, moving);
            pyramid.build(
                grid,
                seen.tiles.iter().zip(&motion.uncovered).map(|(tile, uncovered)| {
                    SeenTile::merged(|| [*tile, *uncovered].into_iter().flatten())
                }),
            );
        }
        let [most_seen, most_at_edges] = MAX_CELLS;
        // Cells are relative to the camera that saw them.
        let shift = seen.camera.eye() - camera.eye();
        pyramid.open(most_seen, &seen.camera, |tile| {
            cells.push(tile.cell(&seen.camera).map(|p| p + shift));
        });
        if seen.camera != *camera {
            motion.find_edges(seen, camera, boxes, clearance);
            pyramid.build(motion::EDGE_TILES, motion.edges.iter().copied());
            pyramid.open(most_at_edges, camera, |tile| cells.push(tile.cell(camera)));
        }
        Some(cells.iter().copied())
    }
}

impl SeenTile {
    /// The cell's corners relative to the camera's eye.
    fn cell(&self, camera: &Camera) -> [DVec3; 8] {
        let corners = self.corners();
        let floor = nearness(camera, beyond(camera, 2.0 * BEYOND));
        let mut nearnesses = corners.map(|c| c.nearness);
        // Where a face would come near the horizon, both are turned towards the viewer: limiting
        // single corners would bend the face and leave receivers outside.
        if nearnesses.iter().any(|[lo, _]| *lo < floor) {
            let nearest = nearnesses.iter().fold(floor, |n, [_, hi]| n.max(*hi));
            nearnesses = [[floor, nearest]; 4];
        }
        // Flat cells get a thickness far below the resolution of single precision, so that they
        // have an inside.
        let farthest = nearnesses.iter().flatten().fold(0.0, |most: f64, w| most.max(w.abs()));
        let pad = 1e-7 * (camera.scale_at(0.0) + farthest);
        std::array::from_fn(|i| {
            let [lo, hi] = match camera.is_orthographic() {
                true => [nearnesses[i % 4][0] - pad, nearnesses[i % 4][1] + pad],
                false => [nearnesses[i % 4][0] * (1.0 - 1e-7), nearnesses[i % 4][1] * (1.0 + 1e-7)],
            };
            let nearness = if i < 4 { lo } else { hi };
            camera.ray(corners[i % 4].at).at(depth(camera, nearness))
        })
    }

    /// How much a cell is worth opening: its part of the picture, times the logarithm of the factor
    /// by which depth varies, times its nearness, because near receivers set how many texels a map
    /// needs. In orthographic views it is the cell's volume.
    fn looseness(&self, camera: &Camera) -> f64 {
        if camera.is_orthographic() {
            return self.size().element_product() * self.thickness();
        }
        let floor = 1e-12;
        let ratio = self.corners().iter().fold(1.0, |product, c| {
            let [lo, hi] = c.nearness.map(|w| w.max(floor));
            product * (hi / lo)
        });
        self.size().element_product() * ratio.ln() * self.nearest()
    }
}

/// Tiles and, above them, tiles that hold up to four of the level below each.
#[derive(Clone, Debug, Default)]
struct Pyramid {
    /// All levels, the finest first.
    tiles: Vec<Option<SeenTile>>,
    /// Where each level begins in `tiles`, and its number of tiles across and down.
    levels: Vec<(usize, [u32; 2])>,
    /// By looseness.
    open: BinaryHeap<Keyed<Candidate>>,
}

/// A tile that may be opened.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    level: usize,
    place: [u32; 2],
}

impl Pyramid {
    fn build(&mut self, mut size: [u32; 2], finest: impl Iterator<Item = Option<SeenTile>>) {
        let Self { tiles, levels, .. } = self;
        tiles.clear();
        levels.clear();
        tiles.extend(finest);
        let mut start = 0;
        loop {
            levels.push((start, size));
            if size == [1, 1] {
                return;
            }
            let above = size.map(|n| n.div_ceil(2));
            let below = start;
            start = tiles.len();
            for y in 0..above[1] {
                for x in 0..above[0] {
                    let children = children([x, y], size);
                    let index = |[x, y]: [u32; 2]| below + (y * size[0] + x) as usize;
                    let tile = SeenTile::merged(|| {
                        children.clone().filter_map(|place| tiles[index(place)])
                    });
                    tiles.push(tile);
                }
            }
            size = above;
        }
    }

    fn tile(&self, level: usize, [x, y]: [u32; 2]) -> Option<SeenTile> {
        let (start, size) = self.levels[level];
        self.tiles[start + (y * size[0] + x) as usize]
    }

    /// Opens the loosest tiles of a camera's picture until there are at most `most`, and gives what
    /// is left to `give`.
    fn open(&mut self, most: usize, camera: &Camera, mut give: impl FnMut(SeenTile)) {
        let top = self.levels.len() - 1;
        self.open.clear();
        let candidate = |this: &Self, level: usize, place: [u32; 2]| {
            let key = this.tile(level, place)?.looseness(camera);
            Some(Keyed { key, value: Candidate { level, place } })
        };
        self.open.extend(candidate(self, top, [0, 0]));
        let mut given = 0;
        while let Some(Keyed { value: Candidate { level, place }, .. }) = self.open.pop() {
            // A tile is replaced by four others at most.
            if level == 0 || given + self.open.len() + 4 > most {
                self.tile(level, place).into_iter().for_each(&mut give);
                given += 1;
                continue;
            }
            for child in children(place, self.levels[level - 1].1) {
                let candidate = candidate(self, level - 1, child);
                self.open.extend(candidate);
            }
        }
    }
}

/// The places of the up to four tiles that a tile is merged from, on a level of `size`.
fn children([x, y]: [u32; 2], size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> + Clone {
    let rows = 2 * y..(2 * y + 2).min(size[1]);
    rows.flat_map(move |y| (2 * x..(2 * x + 2).min(size[0])).map(move |x| [x, y]))
}
