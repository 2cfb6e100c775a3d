//! What a camera saw, from its depth buffer, as receivers for a later frame.
//!
//! Lauritzen, Salvi and Lefohn 2010 ("Sample distribution shadow maps") fit maps to the bounds of
//! the samples in the depth buffer. Here the samples of each tile of the picture lie between two
//! parallel planes of nearness: of inverse depth, or in orthographic views of depth with a minus
//! sign. A plane in space is also a plane over the picture when its nearness is plotted, so a
//! floor, a wall or a roof takes no more room than it has.

use crate::bounds::Aabb;
use crate::camera::Camera;
use crate::error::{Error, check};
use crate::math::range;
use glam::DVec2;

pub(crate) mod cells;
mod motion;
#[cfg(test)]
mod tests;

/// What a tile of the picture shows: all its receivers lie between two parallel planes of nearness.
///
/// At a pixel position p, in pixels as for [`Camera::ray`], the nearness is at least `nearness[0] +
/// slope · (p − middle)` and at most `nearness[1] + slope · (p − middle)`, where `middle` is the
/// middle of `pixels`. Nearness is 1/depth, 1/m. For orthographic cameras it is −depth, m, and
/// units are metres where they are 1/m below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenTile {
    /// Left, upper, right and lower edge of the part of the picture that holds the receivers,
    /// pixels.
    pub pixels: [f64; 4],
    /// Change of nearness to the right and downwards, 1/m per pixel.
    pub slope: DVec2,
    /// Least and greatest nearness in the middle, 1/m.
    pub nearness: [f64; 2],
    /// The largest change of slope from pixel to pixel, along rows and columns: |w₋ − 2w + w₊|,
    /// where w is the nearness, in the sky that of what is infinitely far; 1/m. Within a plane it
    /// is 0, and at a silhouette it is the jump in nearness, which tells how much may appear there
    /// when the camera moves.
    pub jump: f64,
}

/// What a camera saw in one frame, in [`ACROSS`](Self::ACROSS) by [`DOWN`](Self::DOWN) tiles.
///
/// Given as [`Bounds::seen`](crate::Bounds::seen) for the same or a later frame, it makes the
/// planner fit its maps to what is seen, and not to what `receivers` and `receiver_parts` hold
/// behind walls.
///
/// # What is guaranteed
/// For the same camera, every receiver of the depth buffer is served. What lies between four
/// neighbouring pixels is taken to lie between their depths; a curved surface may bulge out by a
/// small part of a pixel.
///
/// For a camera that has moved or turned since, or has another projection, every receiver that it
/// sees is served, provided that `receivers` and `receiver_parts` hold all receivers and that
/// [`Seen::moving`] holds what has moved. Whatever the new camera may see and the old one did not
/// is taken from the boxes: what lies outside the old picture, and what lies behind tiles that are
/// near enough to a silhouette to be uncovered by the motion. Only gaps that open by less than
/// [`LEAST_GAP`](Self::LEAST_GAP) pixels are not counted.
///
/// Where the camera has moved along the view direction by more than half the distance of the
/// nearest surface seen, the boxes alone serve the frame. So they do where an orthographic camera
/// has turned, or its near plane has come to what it saw. In any other motion it uncovers nothing
/// but at the edges of the picture.
///
/// # What it costs
/// Nothing where the camera stands still. In motion, tiles with silhouettes reach back to the
/// farthest box behind them, and at the edges of the picture boxes count from
/// [`Seen::clearance`] or the near plane on. Where boxes reach up to the camera, maps are then no
/// finer than with boxes alone.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenTiles {
    camera: Camera,
    /// Row by row from the top; `None` where only the sky shows.
    tiles: Vec<Option<SeenTile>>,
}

/// Receivers as a camera saw them, and what has moved since.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen<'a> {
    /// What the camera saw.
    pub tiles: &'a SeenTiles,
    /// Boxes around everything that may have moved since, at its old and at its new place. All of
    /// these boxes count as receivers, and so does what they may have hidden.
    pub moving: &'a [Aabb],
    /// Depth up to which no receiver comes into view unseen, metres; 0 if nothing is known. Where a
    /// game keeps its camera away from walls, half of that distance is a good value. In motion it
    /// saves many texels if boxes reach up to the camera.
    pub clearance: f64,
}

impl SeenTiles {
    /// Tiles from left to right.
    pub const ACROSS: u32 = 32;
    /// Tiles from top to bottom.
    pub const DOWN: u32 = 18;
    /// Gaps that a motion opens at a silhouette, and that are narrower than this, do not count;
    /// pixels.
    pub const LEAST_GAP: f64 = 0.25;

    /// The tiles of a picture that shows nothing but sky.
    pub fn new(camera: &Camera) -> Self {
        Self { camera: *camera, tiles: vec![None; (Self::ACROSS * Self::DOWN) as usize] }
    }

    /// The tiles of a picture, from the depth in each pixel. `depth` takes a column and a row,
    /// counted from the upper left, and returns the distance along the view direction at the
    /// pixel's centre, metres; infinite in the sky.
    ///
    /// # Errors
    /// If a depth is not a number, or of a perspective camera not positive.
    pub fn of_depths(camera: &Camera, depth: impl Fn(u32, u32) -> f64) -> Result<Self, Error> {
        let mut seen = Self::new(camera);
        let [width, height] = camera.image();
        for y in 0..height {
            for x in 0..width {
                let depth = depth(x, y);
                let least = if camera.is_orthographic() { f64::NEG_INFINITY } else { 0.0 };
                check(depth > least, "seen.depth", || {
                    format!("must be a number above {least}, is {depth} at pixel {x}, {y}")
                })?;
            }
        }
        let farthest = nearness(camera, beyond(camera, BEYOND));
        let reduction = Reduction {
            image: camera.image(),
            nearness: |x, y| nearness(camera, depth(x, y)),
            is_receiver: |nearness| nearness >= farthest,
        };
        for (index, tile) in seen.tiles.iter_mut().enumerate() {
            *tile = reduction.tile(Self::tile_pixels(camera.image(), index));
        }
        Ok(seen)
    }

    /// Replaces the tiles by those that `tile` returns, row by row from the top; `None` where only
    /// the sky shows. The buffer is kept.
    ///
    /// Receivers a little beyond the camera's far distance, up to [`farthest`](Self::farthest),
    /// should be among them: they may come nearer when the camera turns.
    ///
    /// # Errors
    /// If a number of a tile is not finite, or its limits are not in order. The tiles are then as
    /// [`new`](Self::new) makes them.
    pub fn set(
        &mut self,
        camera: &Camera,
        mut tile: impl FnMut(usize) -> Option<SeenTile>,
    ) -> Result<(), Error> {
        self.camera = *camera;
        for index in 0..self.tiles.len() {
            let tile = tile(index);
            if let Some(t) = tile
                && let Err(error) = t.check()
            {
                self.tiles.fill(None);
                return Err(error);
            }
            self.tiles[index] = tile;
        }
        Ok(())
    }

    /// Receivers are counted up to this many times the camera's far distance, or an orthographic
    /// camera's range of depths.
    pub const BEYOND: f64 = BEYOND;

    /// The depth up to which receivers of a camera are counted, metres.
    pub fn farthest(camera: &Camera) -> f64 {
        beyond(camera, BEYOND)
    }

    /// The camera that saw the tiles.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The tiles, row by row from the top; `None` where only the sky shows.
    pub fn tiles(&self) -> &[Option<SeenTile>] {
        &self.tiles
    }

    /// The pixels of a tile: left, upper, right and lower edge. Pictures with fewer pixels than
    /// tiles have empty tiles.
    pub fn tile_pixels(image: [u32; 2], index: usize) -> [u32; 4] {
        tile_pixels(image, [Self::ACROSS, Self::DOWN], index)
    }
}

const BEYOND: f64 = 2.0;

/// A depth that is so many times a camera's far distance, or an orthographic camera's range of
/// depths.
fn beyond(camera: &Camera, times: f64) -> f64 {
    if camera.is_orthographic() {
        camera.near() + (camera.far() - camera.near()) * times
    } else {
        camera.far() * times
    }
}

/// The nearness of a depth, which in all planes is a linear function over the picture: 1/depth, or
/// in orthographic views −depth, and then not infinite.
fn nearness(camera: &Camera, depth: f64) -> f64 {
    if camera.is_orthographic() { -depth.clamp(-FARTHEST, FARTHEST) } else { depth.recip() }
}

/// The depth of a nearness.
fn depth(camera: &Camera, nearness: f64) -> f64 {
    if camera.is_orthographic() { -nearness } else { nearness.recip() }
}

/// What is farther than this in an orthographic view counts as at this depth, metres. It is farther
/// than any camera's receivers.
const FARTHEST: f64 = 1e13;

/// How far leaning planes may leave the points' range of nearness, as a share of the range.
/// Half a pixel beyond the outermost pixel centres needs a little.
const MOST_OVERSHOOT: f64 = 0.05;

/// The pixels of a tile of a grid: left, upper, right and lower edge.
fn tile_pixels([width, height]: [u32; 2], [across, down]: [u32; 2], index: usize) -> [u32; 4] {
    let [x, y] = [index as u64 % u64::from(across), index as u64 / u64::from(across)];
    let edge = |i: u64, size: u32, count: u32| (i * u64::from(size) / u64::from(count)) as u32;
    [
        edge(x, width, across),
        edge(y, height, down),
        edge(x + 1, width, across),
        edge(y + 1, height, down),
    ]
}

/// The tiles of a picture whose nearness is known in each pixel.
struct Reduction<I, R> {
    image: [u32; 2],
    nearness: I,
    is_receiver: R,
}

impl<I: Fn(u32, u32) -> f64, R: Fn(f64) -> bool> Reduction<I, R> {
    /// What a tile shows. Receivers of the neighbouring pixels count too, so that surfaces between
    /// two tiles' pixels lie in a tile.
    fn tile(&self, [left, top, right, bottom]: [u32; 4]) -> Option<SeenTile> {
        if left == right || top == bottom {
            return None;
        }
        let [width, height] = self.image;
        let columns = left.saturating_sub(1)..width.min(right + 1);
        let rows = top.saturating_sub(1)..height.min(bottom + 1);
        let receivers = || {
            let pixels = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
            pixels.filter_map(|(x, y)| {
                let nearness = (self.nearness)(x, y);
                (self.is_receiver)(nearness).then(|| Point {
                    at: DVec2::new(f64::from(x), f64::from(y)) + 0.5,
                    nearness: [nearness; 2],
                })
            })
        };
        // A surface may go on to the centre of the next pixel.
        let min = receivers().map(|p| p.at).reduce(DVec2::min)? - 1.0;
        let max = receivers().map(|p| p.at).reduce(DVec2::max)? + 1.0;
        let pixels = [
            min.x.max(left.into()),
            min.y.max(top.into()),
            max.x.min(right.into()),
            max.y.min(bottom.into()),
        ];
        Some(SeenTile {
            jump: self.jump([left, top, right, bottom]),
            ..SeenTile::around(pixels, receivers)
        })
    }

    fn jump(&self, [left, top, right, bottom]: [u32; 4]) -> f64 {
        let [width, height] = self.image;
        let w = &self.nearness;
        let mut jump = 0.0f64;
        for (x, y) in (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))) {
            if x > 0 && x + 1 < width {
                jump = jump.max((w(x - 1, y) - 2.0 * w(x, y) + w(x + 1, y)).abs());
            }
            if y > 0 && y + 1 < height {
                jump = jump.max((w(x, y - 1) - 2.0 * w(x, y) + w(x, y + 1)).abs());
            }
        }
        jump
    }
}

/// A position in the picture, pixels, and the range of nearness there.
#[derive(Clone, Copy)]
struct Point {
    at: DVec2,
    nearness: [f64; 2],
}

impl SeenTile {
    /// A tile around the points, between planes that lean as the points do on the whole, or half as
    /// much, or that face the viewer.
    fn around<P: Iterator<Item = Point>>(pixels: [f64; 4], points: impl Fn() -> P) -> Self {
        let flat = Self { pixels, slope: DVec2::ZERO, nearness: [0.0; 2], jump: 0.0 };
        let middle = flat.middle();
        let between = |slope: DVec2| {
            let above = |p: &Point| slope.dot(p.at - middle);
            let (lo, _) = range(points().map(|p| p.nearness[0] - above(&p)));
            let (_, hi) = range(points().map(|p| p.nearness[1] - above(&p)));
            Self { slope, nearness: [lo, hi], ..flat }
        };
        let slope = least_squares(middle, points());
        let flat = between(DVec2::ZERO);
        // Where leaning planes leave the range of the points by much, they do not describe them,
        // and a corner close to the viewer would cost more texels than the planes save.
        let [lo, hi] = flat.nearness;
        let slack = MOST_OVERSHOOT * flat.thickness();
        [slope, slope / 2.0]
            .map(between)
            .into_iter()
            .find(|t| {
                let [farthest, nearest] = t.ends();
                t.thickness() < flat.thickness() && farthest >= lo - slack && nearest <= hi + slack
            })
            .unwrap_or(flat)
    }

    /// A tile that holds all of these tiles.
    fn merged<T: Iterator<Item = Self>>(tiles: impl Fn() -> T) -> Option<Self> {
        let pixels = tiles()
            .map(|t| t.pixels)
            .reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])?;
        let jump = tiles().map(|t| t.jump).fold(0.0, f64::max);
        Some(Self { jump, ..Self::around(pixels, || tiles().flat_map(|t| t.corners())) })
    }

    fn middle(&self) -> DVec2 {
        let [left, top, right, bottom] = self.pixels;
        DVec2::new(left.midpoint(right), top.midpoint(bottom))
    }

    /// Size in pixels.
    fn size(&self) -> DVec2 {
        let [left, top, right, bottom] = self.pixels;
        DVec2::new(right - left, bottom - top)
    }

    fn thickness(&self) -> f64 {
        self.nearness[1] - self.nearness[0]
    }

    /// Lower left, lower right, upper left and upper right corner, with the nearness there.
    fn corners(&self) -> [Point; 4] {
        let [left, top, right, bottom] = self.pixels;
        let middle = self.middle();
        [[left, bottom], [right, bottom], [left, top], [right, top]].map(|at| {
            let at = DVec2::from(at);
            Point { at, nearness: self.nearness.map(|w| w + self.slope.dot(at - middle)) }
        })
    }

    /// The least and the greatest nearness, 1/m.
    fn ends(&self) -> [f64; 2] {
        let rise = (self.slope * self.size() / 2.0).abs().element_sum();
        [self.nearness[0] - rise, self.nearness[1] + rise]
    }

    /// The greatest nearness, 1/m.
    fn nearest(&self) -> f64 {
        self.ends()[1]
    }

    fn check(&self) -> Result<(), Error> {
        let Self { pixels: [left, top, right, bottom], slope, nearness: [lo, hi], jump } = *self;
        let is_finite = [left, top, right, bottom, lo, hi, jump].iter().all(|n| n.is_finite());
        let is_in_order = left <= right && top <= bottom && lo <= hi && jump >= 0.0;
        check(is_finite && slope.is_finite() && is_in_order, "seen.tiles", || {
            format!("must be finite numbers, the lesser limits first, are {self:?}")
        })
    }
}

/// The slope of the plane that is closest to the points, by the squares of its distances from the
/// middles of their ranges.
fn least_squares(middle: DVec2, points: impl Iterator<Item = Point>) -> DVec2 {
    let (mut count, mut at_sum, mut sum) = (0.0, DVec2::ZERO, 0.0);
    let (mut squares, mut product, mut moments) = (DVec2::ZERO, 0.0, DVec2::ZERO);
    for p in points {
        let at = p.at - middle;
        let nearness = p.nearness[0].midpoint(p.nearness[1]);
        count += 1.0;
        at_sum += at;
        sum += nearness;
        squares += at * at;
        product += at.x * at.y;
        moments += at * nearness;
    }
    // Covariances, times the number of points.
    let squares = squares - at_sum * at_sum / count;
    let product = product - at_sum.x * at_sum.y / count;
    let moments = moments - at_sum * sum / count;
    let determinant = squares.x * squares.y - product * product;
    if determinant <= 1e-9 * squares.x * squares.y {
        // All points lie on one line.
        return DVec2::ZERO;
    }
    DVec2::new(
        moments.x * squares.y - moments.y * product,
        moments.y * squares.x - moments.x * product,
    ) / determinant
}
