use crate::nodes::Role;
use crate::types::{Mesh, Scene};
use glam::{DAffine3, DVec3, IVec3, USizeVec3, Vec3};
use umbrage::Aabb;

/// Number of cells along the longest edge of the scene's box.
const CELLS: f64 = 160.0;
/// Least number of cells along the other edges, so that flat scenes keep their relief.
const MIN_CELLS: f64 = 24.0;
/// Number of triangles to enter. Of larger scenes, only every n-th triangle of fine meshes is, and
/// instances no wider than a cell fill their boxes.
const MAX_TRIANGLES: u64 = 4_000_000;
/// Number of triangles from which a mesh counts as fine.
const FINE: usize = 1000;

/// Directions that the surfaces in a cell face, one bit each: −x, −y, −z, +x, +y, +z.
pub(super) type Facing = u8;
/// The bit of surfaces that face up.
pub(super) const UP: Facing = 1 << 4;

/// A grid of cells in a scene's box that tells which cells hold surfaces. It is quick to build and
/// quick to cast rays in.
pub(super) struct Occupancy {
    bounds: Aabb,
    size: USizeVec3,
    /// Width, height and depth of a cell, metres.
    pub(super) cell: DVec3,
    cells: Vec<Facing>,
    /// Lowest occupied layer of each column; `None` for an empty column.
    floor: Vec<Option<usize>>,
}

/// An instance of a mesh.
#[derive(Clone, Copy)]
struct Placed<'a> {
    mesh: &'a Mesh,
    world_from_mesh: DAffine3,
    double_sided: bool,
}

impl Placed<'_> {
    /// The corners of a triangle in world space.
    fn corners(self, triangle: &[u32; 3]) -> [DVec3; 3] {
        let corner = |i: u32| self.mesh.positions[i as usize].as_dvec3();
        triangle.map(|i| self.world_from_mesh.transform_point3(corner(i)))
    }

    fn facing_of(self, [a, b, c]: [DVec3; 3]) -> Facing {
        let mirrored = self.world_from_mesh.matrix3.determinant() < 0.0;
        let normal = (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
        let back = if self.double_sided { faced(-normal) } else { 0 };
        faced(normal) | back
    }

    /// Where every `step`-th triangle from the one at `begin` on faces, or at least one.
    fn facing(self, begin: usize, step: usize) -> Facing {
        let triangles = &self.mesh.triangles;
        let begin = begin.min(triangles.len() - 1);
        let some = triangles[begin..].iter().step_by(step);
        some.fold(0, |all, t| all | self.facing_of(self.corners(t)))
    }
}

/// The cell where a ray ends.
pub(super) struct Sight {
    /// Distance along the ray, in lengths of its direction.
    pub(super) distance: f64,
    /// Index of the cell.
    pub(super) cell: usize,
    pub(super) facing: Facing,
}

impl Occupancy {
    /// Builds the grid. `bounds` must be the scene's bounds and not empty.
    pub(super) fn of(scene: &Scene, bounds: Aabb) -> Self {
        let extent = bounds.size();
        let longest = extent.max_element().max(1e-9);
        let size = (extent * (CELLS / longest)).ceil().max(DVec3::splat(MIN_CELLS));
        // The cells of a box without thickness still need a thickness.
        let cell = extent.max(DVec3::splat(longest * 1e-6)) / size;
        let size = size.as_usizevec3();
        let mut grid = Self {
            bounds,
            size,
            cell,
            cells: vec![0; size.x * size.y * size.z],
            floor: vec![None; size.x * size.z],
        };
        let step = scene.drawn_triangles().div_ceil(MAX_TRIANGLES).max(1) as usize;
        let boxes: Vec<Aabb> = scene.meshes.iter().map(Mesh::bounds).collect();
        let mut begin = 0;
        for instance in scene.instances_that(Role::is_receiver) {
            let mesh = &scene.meshes[instance.mesh];
            let double_sided = scene.materials.get(mesh.material).is_some_and(|m| m.double_sided);
            let placed = Placed { mesh, world_from_mesh: instance.world_from_mesh, double_sided };
            let count = mesh.triangles.len();
            if step == 1 || count == 0 {
                grid.add(placed, 1);
                continue;
            }
            let to_grid = |p| (instance.world_from_mesh.transform_point3(p) - bounds.min) / cell;
            let cells = Aabb::around(boxes[instance.mesh].corners().map(to_grid));
            let [width, _, depth] = cells.size().to_array();
            if width.max(depth) <= 1.0 {
                // Which triangles are entered goes around, because neighbours share cells.
                grid.fill_box(cells, placed.facing(begin, step));
                begin = (begin + step - count % step) % step;
            } else {
                grid.add(placed, if count < FINE { 1 } else { step });
            }
        }
        for z in 0..size.z {
            for x in 0..size.x {
                let column = (0..size.y).find(|&y| grid.cells[grid.index(x, y, z)] != 0);
                grid.floor[z * size.x + x] = column;
            }
        }
        grid
    }

    /// Enters every `step`-th triangle of an instance.
    fn add(&mut self, placed: Placed<'_>, step: usize) {
        for t in placed.mesh.triangles.iter().step_by(step) {
            let corners = placed.corners(t);
            let in_cells = |p: DVec3| ((p - self.bounds.min) / self.cell).as_vec3();
            self.fill(corners.map(in_cells), placed.facing_of(corners));
        }
    }

    /// Marks the cells of a box, which is in units of cells.
    fn fill_box(&mut self, cells: Aabb, facing: Facing) {
        let last = self.size - USizeVec3::ONE;
        let [from, to] =
            [cells.min, cells.max].map(|p| p.max(DVec3::ZERO).as_usizevec3().min(last));
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let k = self.index(x, y, z);
                    self.cells[k] |= facing;
                }
            }
        }
    }

    /// Marks the cells that a triangle lies in, by points on it less than a cell apart. The corners
    /// are in units of cells.
    fn fill(&mut self, [a, b, c]: [Vec3; 3], facing: Facing) {
        let edges = [b - a, c - b, a - c].map(|e| e.abs().max_element());
        let n = (edges.into_iter().fold(0.0, f32::max) * 1.5).ceil().clamp(1.0, 400.0) as u32;
        let last = self.size - USizeVec3::ONE;
        for i in 0..=n {
            for j in 0..=n - i {
                let p = a + (b - a) * (i as f32 / n as f32) + (c - a) * (j as f32 / n as f32);
                let p = p.max(Vec3::ZERO).as_usizevec3().min(last);
                let k = self.index(p.x, p.y, p.z);
                self.cells[k] |= facing;
            }
        }
    }

    fn index(&self, x: usize, y: usize, z: usize) -> usize {
        (z * self.size.y + y) * self.size.x + x
    }

    /// The cell that contains a point, if the point is inside the box.
    fn cell_of(&self, p: DVec3) -> Option<USizeVec3> {
        let c = (p - self.bounds.min) / self.cell;
        let inside = c.cmpge(DVec3::ZERO).all() && c.cmplt(self.size.as_dvec3()).all();
        inside.then(|| c.as_usizevec3())
    }

    /// The longest edge of the box, metres.
    pub(super) fn longest(&self) -> f64 {
        (self.size.as_dvec3() * self.cell).max_element()
    }

    /// Whether a point's cell and its neighbours along x and z are empty.
    pub(super) fn is_free(&self, p: DVec3) -> bool {
        let sides = [DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z];
        sides.iter().all(|d| {
            let cell = self.cell_of(p + *d * self.cell);
            cell.is_none_or(|c| self.cells[self.index(c.x, c.y, c.z)] == 0)
        })
    }

    /// Height of the ground in a point's column, metres; the bottom of the box in an empty column.
    pub(super) fn floor_at(&self, p: DVec3) -> f64 {
        let cell = self.cell_of(p.with_y(self.bounds.min.y));
        let layer = cell.and_then(|c| self.floor[c.z * self.size.x + c.x]);
        self.bounds.min.y + layer.map_or(0.0, |l| (l as f64 + 1.0) * self.cell.y)
    }

    /// The share of columns that are not empty.
    pub(super) fn floor_share(&self) -> f64 {
        self.floor.iter().flatten().count() as f64 / self.floor.len() as f64
    }

    /// Whether a cell lies clearly above the lowest surface of its column.
    pub(super) fn stands_out(&self, cell: usize) -> bool {
        let x = cell % self.size.x;
        let y = cell / self.size.x % self.size.y;
        let z = cell / (self.size.x * self.size.y);
        self.floor[z * self.size.x + x].is_some_and(|floor| y > floor + 1)
    }

    /// The box around the cells that stand out from the ground, and their typical height above it,
    /// metres: three quarters of the columns stay below. `None` if no cell stands out.
    pub(super) fn content(&self) -> Option<(Aabb, f64)> {
        let mut around = Aabb::EMPTY;
        let mut heights = Vec::new();
        for z in 0..self.size.z {
            for x in 0..self.size.x {
                let Some(floor) = self.floor[z * self.size.x + x] else {
                    continue;
                };
                let occupied = |&y: &usize| self.cells[self.index(x, y, z)] != 0;
                let Some(top) = (floor + 2..self.size.y).rev().find(occupied) else {
                    continue;
                };
                heights.push((top - floor) as f64 * self.cell.y);
                let at = |x: usize, y: usize, z: usize| {
                    self.bounds.min + USizeVec3::new(x, y, z).as_dvec3() * self.cell
                };
                around =
                    around.union(Aabb { min: at(x, floor, z), max: at(x + 1, top + 1, z + 1) });
            }
        }
        heights.sort_by(f64::total_cmp);
        let typical = heights.get(heights.len() * 3 / 4)?;
        Some((around, *typical))
    }

    /// Centres of the occupied cells in a box that have an empty neighbour along some axis, or the
    /// centre of the box if there are none.
    pub(super) fn points_in(&self, within: Aabb) -> Vec<DVec3> {
        let USizeVec3 { x: nx, y: ny, z: nz } = self.size;
        let is_free = |x: usize, y: usize, z: usize| {
            x >= nx || y >= ny || z >= nz || self.cells[self.index(x, y, z)] == 0
        };
        let mut points = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    // The subtraction wraps at the faces of the box, and neighbours beyond the box
                    // count as empty.
                    let [x0, y0, z0] = [x, y, z].map(|i| i.wrapping_sub(1));
                    let outermost = is_free(x0, y, z)
                        || is_free(x + 1, y, z)
                        || is_free(x, y0, z)
                        || is_free(x, y + 1, z)
                        || is_free(x, y, z0)
                        || is_free(x, y, z + 1);
                    if is_free(x, y, z) || !outermost {
                        continue;
                    }
                    let p = USizeVec3::new(x, y, z).as_dvec3() + 0.5;
                    let p = self.bounds.min + p * self.cell;
                    if p.cmpge(within.min).all() && p.cmple(within.max).all() {
                        points.push(p);
                    }
                }
            }
        }
        if points.is_empty() {
            points.push(within.center());
        }
        points
    }

    /// The first occupied cell along a ray from `eye`, apart from the cell that contains the eye.
    pub(super) fn look(&self, eye: DVec3, direction: DVec3) -> Option<Sight> {
        let origin = (eye - self.bounds.min) / self.cell;
        let direction = direction / self.cell;
        let end = self.size.as_dvec3();
        // First the interval in which the ray is inside the box (slab test), then a traversal from
        // cell to cell (Amanatides and Woo 1987).
        let inverse = direction.recip();
        let (a, b) = (-origin * inverse, (end - origin) * inverse);
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        if enter.is_nan() || leave.is_nan() || enter >= leave {
            return None;
        }
        let start = origin + direction * (enter + (leave - enter) * 1e-9);
        let mut at = start.floor().clamp(DVec3::ZERO, end - 1.0).as_ivec3();
        let step = direction.signum().as_ivec3();
        let ahead = at.as_dvec3() + direction.signum().max(DVec3::ZERO);
        // A ray along a face of a cell never leaves through it. 0·∞ would give NaN of either sign.
        let along_face = direction.cmpeq(DVec3::ZERO);
        let mut next = DVec3::select(along_face, DVec3::INFINITY, (ahead - origin) * inverse);
        let per_cell = inverse.abs();
        let mut distance = enter;
        let mut is_own = self.cell_of(eye).is_some();
        let size = self.size.as_ivec3();
        loop {
            if at.cmplt(IVec3::ZERO).any() || at.cmpge(size).any() {
                return None;
            }
            let cell = self.index(at.x as usize, at.y as usize, at.z as usize);
            let facing = self.cells[cell];
            if facing != 0 && !is_own {
                return Some(Sight { distance, cell, facing });
            }
            is_own = false;
            let axis = (0..3).min_by(|&i, &j| next[i].total_cmp(&next[j])).unwrap_or(0);
            distance = next[axis];
            if !distance.is_finite() {
                return None;
            }
            next[axis] += per_cell[axis];
            at[axis] += step[axis];
        }
    }
}

/// The bits of the axis that a direction is closest to, and of those that are nearly as close.
fn faced(direction: DVec3) -> Facing {
    let longest = direction.abs().max_element();
    let bit = |i: usize| {
        let c = direction[i];
        if c.abs() < 0.6 * longest || longest == 0.0 {
            0
        } else {
            1 << (if c < 0.0 { i } else { i + 3 })
        }
    };
    bit(0) | bit(1) | bit(2)
}

/// Whether a ray along `direction` sees the front of a surface that faces in one of these
/// directions.
pub(super) fn is_seen(facing: Facing, direction: DVec3) -> bool {
    facing & faced(-direction) != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_along_the_faces_of_cells_see_what_others_see() {
        let scene = crate::builtin("pole", None).unwrap();
        let grid = Occupancy::of(&scene, scene.bounds());
        let eye = DVec3::new(5.0, 3.0, 5.0);
        let on_face = (eye - grid.bounds.min) / grid.cell;
        assert_eq!((on_face.x.fract(), on_face.z.fract()), (0.0, 0.0));
        for zero in [0.0, -0.0] {
            let sight = grid.look(eye, DVec3::new(zero, -1.0, zero)).unwrap();
            assert!((sight.distance - 3.0).abs() < 2.0 * grid.cell.y, "{}", sight.distance);
        }
    }
}
