//! What a camera may see that an earlier one did not.
//!
//! All vectors are in the earlier camera's frame: x right, y up, z along its view. Let the camera
//! move by t, and let the new camera see a point P that was hidden. The segment from P to the new
//! eye is free. In the earlier picture it is a straight line on which the nearness w grows,
//! from P, which lies behind the surface that hides it, to points before everything seen. So the
//! line either leaves the picture or crosses a silhouette, at a point X of the segment. With the
//! slopes m = (x/z, y/z),
//!
//! m(X) − m(P) = (t_xy − m(X) t_z) (w(X) − w(P)) / (1 − t_z w(X)),
//!
//! as follows from X = t + u (P − t). Hence P lies no farther from the silhouette than this with
//! w(X) − w(P) replaced by the nearness of the silhouette's near side, and the gap opens by
//! no more than this with the silhouette's jump of nearness.
//!
//! An orthographic picture only shifts where the camera moves without turning, so nothing comes
//! into view but at its edges. Where the camera turns, gaps open as for an eye infinitely far away.

use super::{BEYOND, SeenTile, SeenTiles, beyond, depth, nearness, tile_pixels};
use crate::bounds::{Aabb, Plane};
use crate::camera::{Camera, ViewRay};
use crate::focus::frustum_planes;
use crate::math::range;
use glam::{DVec2, DVec3};

/// Tiles across and down in which the boxes' ranges of depth are found.
pub(super) const EDGE_TILES: [u32; 2] = [SeenTiles::ACROSS / 2, SeenTiles::DOWN / 2];

/// A motion of the camera that is small enough for what was seen to be of use.
pub(super) struct Motion {
    /// How far the camera has moved to the right and upwards, metres.
    sideways: DVec2,
    /// How far it has moved along the view direction, metres.
    forward: f64,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Buffers {
    /// For each tile of the earlier picture, what may have come into view there.
    pub(super) uncovered: Vec<Option<SeenTile>>,
    /// For each edge tile of the new picture, what may be in view there that lay outside the
    /// earlier picture.
    pub(super) edges: Vec<Option<SeenTile>>,
    /// Ranges of the depths of boxes in each edge tile, metres; the first greater where none is.
    boxes: Vec<[f64; 2]>,
    /// Those of the boxes that have moved.
    moving: Vec<[f64; 2]>,
    is_uncovered: Vec<bool>,
}

impl Motion {
    /// `None` if the camera has moved too far.
    pub(super) fn new(seen: &SeenTiles, camera: &Camera) -> Option<Self> {
        let before = seen.camera();
        let t = camera.eye() - before.eye();
        if before.is_orthographic() || camera.is_orthographic() {
            let shifts = before.is_orthographic() == camera.is_orthographic()
                && before.forward() == camera.forward();
            // The near plane must not have come to what was seen, or what lies behind shows.
            let near = camera.near() + before.forward().dot(t);
            let is_whole =
                seen.tiles().iter().flatten().all(|t| depth(before, t.nearest()) >= near);
            // In the earlier picture nothing moves.
            let motion = Self { sideways: DVec2::ZERO, forward: 0.0 };
            return (shifts && is_whole).then_some(motion);
        }
        let sideways = DVec2::new(before.right().dot(t), before.up().dot(t));
        let forward = before.forward().dot(t);
        let nearest = seen.tiles().iter().flatten().fold(0.0, |n: f64, t| n.max(t.nearest()));
        (forward.abs() * nearest <= 0.5).then_some(Self { sideways, forward })
    }

    /// The direction in which what was hidden moves out of hiding, at a slope of the view, and how
    /// far for each 1/m of nearness.
    fn parallax(&self, slope: DVec2) -> DVec2 {
        self.sideways - slope * self.forward
    }
}

/// Slope of the view at a pixel position.
fn slope(camera: &Camera, at: DVec2) -> DVec2 {
    let direction = camera.ray(at).direction;
    DVec2::new(camera.right().dot(direction), camera.up().dot(direction))
}

impl Buffers {
    /// Finds what may have come into view within the earlier picture.
    pub(super) fn uncover(
        &mut self,
        seen: &SeenTiles,
        motion: &Motion,
        boxes: &[Aabb],
        moving: &[Aabb],
    ) {
        let camera = seen.camera();
        let limits = [camera.near(), beyond(camera, BEYOND)];
        box_depths(camera, limits, boxes, &mut self.boxes);
        box_depths(camera, limits, moving, &mut self.moving);
        let grid = [SeenTiles::ACROSS, SeenTiles::DOWN];
        let coarse = |[x, y]: [u32; 2]| (y / 2 * EDGE_TILES[0] + x / 2) as usize;
        self.is_uncovered.clear();
        self.is_uncovered.resize(seen.tiles().len(), false);
        for (index, tile) in seen.tiles().iter().enumerate() {
            let Some(tile) = tile else { continue };
            let place = [index as u32 % grid[0], index as u32 / grid[0]];
            self.is_uncovered[index] |=
                self.moving[coarse(place)][0] <= self.moving[coarse(place)][1];
            let Some(reach) = reach(camera, motion, tile, place) else { continue };
            // Every tile that comes within reach of this one.
            let [width, height] = camera.image().map(f64::from);
            let count = |pixels: f64, size: f64, tiles: u32| {
                let tiles = f64::from(tiles);
                (pixels * tiles / size).clamp(0.0, tiles) as u32
            };
            let first = [
                count(tile.pixels[0] - reach, width, grid[0]),
                count(tile.pixels[1] - reach, height, grid[1]),
            ];
            let last = [
                count(tile.pixels[2] + reach, width, grid[0]).min(grid[0] - 1),
                count(tile.pixels[3] + reach, height, grid[1]).min(grid[1] - 1),
            ];
            for y in first[1]..=last[1] {
                let row = (y * grid[0]) as usize;
                self.is_uncovered[row + first[0] as usize..=row + last[0] as usize].fill(true);
            }
        }
        self.uncovered.clear();
        let Self { uncovered, boxes, is_uncovered, .. } = self;
        uncovered.extend(seen.tiles().iter().zip(&*is_uncovered).enumerate().map(
            |(index, (tile, is_uncovered))| {
                // What was hidden lies behind what hid it.
                let tile = tile.filter(|_| *is_uncovered)?;
                let place = [index as u32 % grid[0], index as u32 / grid[0]];
                let [nearest, farthest] = boxes[coarse(place)];
                let nearest = nearest.max(depth(camera, tile.nearest()));
                facing(camera, tile.pixels, [nearest, farthest])
            },
        ));
    }

    /// Finds what the new camera may see outside the earlier picture.
    pub(super) fn find_edges(
        &mut self,
        seen: &SeenTiles,
        camera: &Camera,
        boxes: &[Aabb],
        clearance: f64,
    ) {
        // Orthographic views may begin behind the eye, where a clearance of 0 says nothing.
        let near = camera.near();
        let nearest = if clearance > 0.0 { near.max(clearance) } else { near };
        box_depths(camera, [nearest, camera.far()], boxes, &mut self.boxes);
        let before = seen.camera();
        let t = camera.eye() - before.eye();
        // Half-spaces, relative to the earlier eye, around everything that the earlier camera could
        // see.
        let [near, far, sides @ ..] = frustum_planes(before);
        let far = Plane { offset: beyond(before, BEYOND), ..far };
        self.edges.clear();
        self.edges.extend(self.boxes.iter().enumerate().map(|(index, &[nearest, farthest])| {
            let pixels = tile_pixels(camera.image(), EDGE_TILES, index).map(f64::from);
            // The range of new depths in which all of the tile lay within the earlier view.
            let mut inside = [f64::NEG_INFINITY, f64::INFINITY];
            for at in corners(pixels) {
                let ray = camera.ray(at);
                for plane in [near, far].iter().chain(&sides) {
                    // Rounding must not make anything of a view that has not changed.
                    let start = plane.distance(ray.at(0.0) + t) + 1e-9 * ray.start.length();
                    let rise = plane.normal.dot(ray.direction) + 1e-9;
                    if rise > 0.0 {
                        inside[0] = inside[0].max(-start / rise);
                    } else {
                        inside[1] = inside[1].min(if rise < 0.0 { start / -rise } else { start });
                    }
                }
            }
            let [from, to] = if inside[0] >= inside[1] { [f64::INFINITY, 0.0] } else { inside };
            let before = [nearest, farthest.min(from)];
            let beyond = [nearest.max(to), farthest];
            // Rounding must not make a range of what ends where it begins.
            let ranges = [before, beyond].into_iter().filter(|[near, far]| near * 1.000_001 < *far);
            let (near, far) = range(ranges.flatten());
            facing(camera, pixels, [near, far])
        }));
    }
}

/// How far from a tile points may have come into view because of its silhouettes, or because of
/// what lies outside the picture beside it, pixels; `None` if nothing of account has.
fn reach(camera: &Camera, motion: &Motion, tile: &SeenTile, place: [u32; 2]) -> Option<f64> {
    let slopes = tile.corners().map(|c| slope(camera, c.at));
    let nearest = tile.nearest();
    let pixels_per_slope = {
        let [lo, _, hi, _] = camera.corner_slopes();
        let [width, height] = camera.image().map(f64::from);
        DVec2::new(width, height) / (hi - lo)
    };
    let parallax = slopes.iter().fold(DVec2::ZERO, |p, s| p.max(motion.parallax(*s).abs()));
    let pixels = (parallax * pixels_per_slope).length() / (1.0 - motion.forward.max(0.0) * nearest);
    // Beyond the edges of the picture anything may have hidden what now moves into it from there.
    let is_at_edge = {
        let (lo, hi) =
            slopes.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), &s| {
                (lo.min(motion.parallax(s)), hi.max(motion.parallax(s)))
            });
        (place[0] == 0 && lo.x < 0.0)
            || (place[0] + 1 == SeenTiles::ACROSS && hi.x > 0.0)
            || (place[1] == 0 && hi.y > 0.0)
            || (place[1] + 1 == SeenTiles::DOWN && lo.y < 0.0)
    };
    let gap = if is_at_edge { nearest } else { tile.jump };
    // Silhouettes are known to a pixel.
    (pixels * gap >= SeenTiles::LEAST_GAP).then_some(pixels * nearest + 1.0)
}

/// A tile between two depths, metres; `None` if the first is not the lesser.
fn facing(camera: &Camera, pixels: [f64; 4], [near, far]: [f64; 2]) -> Option<SeenTile> {
    (near <= far).then(|| SeenTile {
        pixels,
        slope: DVec2::ZERO,
        nearness: [far, near].map(|depth| nearness(camera, depth)),
        jump: 0.0,
    })
}

fn corners([left, top, right, bottom]: [f64; 4]) -> [DVec2; 4] {
    [[left, bottom], [right, bottom], [left, top], [right, top]].map(DVec2::from)
}

/// Finds the range of depths, within limits, in which boxes may be seen, for each edge tile of a
/// camera's picture.
fn box_depths(camera: &Camera, limits: [f64; 2], boxes: &[Aabb], depths: &mut Vec<[f64; 2]>) {
    let [across, down] = EDGE_TILES;
    depths.clear();
    depths.resize((across * down) as usize, [f64::INFINITY, f64::NEG_INFINITY]);
    let [width, height] = camera.image().map(f64::from);
    for aabb in boxes.iter().filter(|b| !b.is_empty()) {
        // The tiles that the box's picture may touch: all, if it reaches behind the eye.
        let picture = aabb
            .corners()
            .into_iter()
            .try_fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), corner| {
                camera.pixel(corner).map(|p| (lo.min(p), hi.max(p)))
            });
        let (lo, hi) = picture.unwrap_or((DVec2::ZERO, DVec2::new(width, height)));
        if hi.x < 0.0 || hi.y < 0.0 || lo.x > width || lo.y > height {
            continue;
        }
        let count = |pixels: f64, size: f64, tiles: u32| {
            (pixels * f64::from(tiles) / size).clamp(0.0, f64::from(tiles - 1)) as u32
        };
        let local = aabb.relative_to(camera.eye());
        // A pixel of slack, because tiles begin at whole pixels.
        for y in count(lo.y - 1.0, height, down)..=count(hi.y + 1.0, height, down) {
            for x in count(lo.x - 1.0, width, across)..=count(hi.x + 1.0, width, across) {
                let index = (y * across + x) as usize;
                let pixels = tile_pixels(camera.image(), EDGE_TILES, index).map(f64::from);
                if let Some([near, far]) = depths_within(camera, pixels, local, limits) {
                    let depths = &mut depths[index];
                    *depths = [depths[0].min(near), depths[1].max(far)];
                }
            }
        }
    }
}

/// A range of depths, within limits, that holds what a tile shows of a box (relative to the eye),
/// metres.
fn depths_within(
    camera: &Camera,
    pixels: [f64; 4],
    aabb: Aabb,
    [mut near, mut far]: [f64; 2],
) -> Option<[f64; 2]> {
    let rays = corners(pixels).map(|at| camera.ray(at));
    let bounds = |vector: fn(&ViewRay) -> DVec3| Aabb::around(rays.iter().map(vector));
    let [start, rate] = [bounds(|ray| ray.start), bounds(|ray| ray.direction)];
    // Along each axis, a point at depth z lies between start.min + z·rate.min and start.max +
    // z·rate.max. (In perspective views start is 0, in orthographic ones rate is the same for all.)
    for axis in 0..3 {
        let above = (rate.min[axis], aabb.max[axis] - start.min[axis]);
        let below = (-rate.max[axis], start.max[axis] - aabb.min[axis]);
        for (rate, limit) in [above, below] {
            // z · rate ≤ limit.
            if rate > 0.0 {
                far = far.min(limit / rate);
            } else if rate < 0.0 {
                near = near.max(limit / rate);
            } else if limit < 0.0 {
                return None;
            }
        }
    }
    // Rounding must not lose a flat box.
    let pad = |depth: f64| 1e-9 * (depth.abs() + camera.scale_at(0.0));
    let [near, far] = [near - pad(near), far + pad(far)];
    (near <= far).then_some([near, far])
}
