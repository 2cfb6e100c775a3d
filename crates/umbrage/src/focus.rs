//! The body B of the receivers that the camera sees (Wimmer et al. 2004, §3.3), in local space.

use crate::bounds::{Aabb, Plane};
use crate::camera::Camera;
use crate::math::range;
use glam::DVec3;

/// Convex polyhedra, called cells: one around everything seen, or one for each box of receivers.
/// Their surfaces are known by their edges. The buffers are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Body {
    parts: Parts,
    /// An upper bound of the largest coordinate, metres, which determines the rounding of
    /// positions.
    size: f64,
    clipping: Clipping,
}

/// Vertices and edges of all cells, one cell after the other.
#[derive(Clone, Debug, Default)]
struct Parts {
    vertices: Vec<DVec3>,
    edges: Vec<Edge>,
    cells: Vec<Cell>,
}

/// An edge of a cell.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Indices of the vertices at its ends among the cell's vertices.
    ends: [u8; 2],
    /// Numbers of the two faces that meet in the edge, unique within the cell.
    faces: [u8; 2],
}

/// Where the vertices and edges of a cell lie.
#[derive(Clone, Copy, Debug)]
struct Cell {
    first_vertex: u32,
    first_edge: u32,
    vertices: u8,
    edges: u8,
    /// All numbers of the cell's faces are less than this.
    faces: u8,
}

#[derive(Clone, Debug, Default)]
struct Clipping {
    /// What clipping in place leaves.
    kept: Parts,
    /// The cell that is being cut, and the result of a cut.
    cell: Polyhedron,
    cut: Polyhedron,
    distances: Vec<f64>,
}

/// A single cell.
#[derive(Clone, Debug, Default)]
struct Polyhedron {
    vertices: Vec<DVec3>,
    edges: Vec<Edge>,
    faces: u8,
}

/// The edges of a hexahedron whose corners are numbered as those of [`Aabb::corners`]. Face 2 i + s
/// holds the corners whose bit i is s.
const HEXAHEDRON: [Edge; 12] = {
    let mut edges = [Edge { ends: [0; 2], faces: [0; 2] }; 12];
    let mut axis = 0;
    while axis < 3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut i = 0;
        while i < 4 {
            let [at_u, at_v] = [i & 1, i >> 1];
            let from = at_u << u | at_v << v;
            edges[4 * axis + i as usize] = Edge {
                ends: [from, from | 1 << axis],
                faces: [2 * u as u8 + at_u, 2 * v as u8 + at_v],
            };
            i += 1;
        }
        axis += 1;
    }
    edges
};

/// Stands for no vertex.
const NONE: u8 = u8::MAX;

impl Body {
    /// Replaces the body by the camera's frustum, relative to the eye.
    pub(crate) fn set_frustum(&mut self, camera: &Camera) {
        let corners = |depth: f64| camera.edges().map(|edge| edge.at(depth));
        let [near, far] = [camera.near(), camera.far()].map(corners);
        // The camera counts corners around the image, hexahedra by rows.
        let by_rows = |[a, b, c, d]: [DVec3; 4]| [a, b, d, c];
        let [[a, b, c, d], [e, f, g, h]] = [near, far].map(by_rows);
        self.clear();
        self.push_hexahedron([a, b, c, d, e, f, g, h]);
    }

    /// Appends a box (local space).
    pub(crate) fn push_box(&mut self, aabb: Aabb) {
        self.push_hexahedron(aabb.corners());
    }

    /// Appends a convex hexahedron, whose corners (local space) are numbered as those of
    /// [`Aabb::corners`].
    pub(crate) fn push_hexahedron(&mut self, corners: [DVec3; 8]) {
        self.size = self.size.max(range(corners.iter().map(|v| v.abs().max_element())).1);
        self.parts.push(&corners, &HEXAHEDRON, 6);
    }

    pub(crate) fn clear(&mut self) {
        self.parts.clear();
        self.size = 0.0;
    }

    pub(crate) fn vertices(&self) -> &[DVec3] {
        &self.parts.vertices
    }

    /// An upper bound of the largest coordinate of any vertex, metres, which determines the
    /// rounding of positions.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// The body's bounding box.
    pub(crate) fn bounds(&self) -> Aabb {
        Aabb::around(self.parts.vertices.iter().copied())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.parts.vertices.is_empty()
    }

    /// The cells, each by its vertices, its edges and its triangles.
    pub(crate) fn cells(&self) -> impl Iterator<Item = CellView<'_>> {
        self.parts.cells.iter().map(|cell| {
            let (first_vertex, first_edge) = (cell.first_vertex as usize, cell.first_edge as usize);
            CellView {
                first_vertex,
                vertices: usize::from(cell.vertices),
                edges: &self.parts.edges[first_edge..first_edge + usize::from(cell.edges)],
                faces: cell.faces,
            }
        })
    }

    /// The planes around a box, thick enough to clip this body.
    pub(crate) fn sides(&self, aabb: Aabb) -> [Plane; 6] {
        planes_around(thickened(aabb, self.size))
    }

    /// Removes what lies outside any of the planes.
    pub(crate) fn clip(&mut self, planes: &[Plane]) {
        let Self { parts, size, clipping } = self;
        let mut kept = std::mem::take(&mut clipping.kept);
        kept.clear();
        clipping.clip(parts, *size, planes, &mut kept);
        clipping.kept = std::mem::replace(parts, kept);
    }

    /// Replaces the body by the part of another that lies inside all planes.
    pub(crate) fn set_clipped(&mut self, other: &Self, planes: &[Plane]) {
        self.clear();
        self.append_clipped(other, planes);
    }

    /// Appends the part of another body that lies inside all planes.
    pub(crate) fn append_clipped(&mut self, other: &Self, planes: &[Plane]) {
        self.size = self.size.max(other.size);
        self.clipping.clip(&other.parts, other.size, planes, &mut self.parts);
    }
}

/// A cell of a [`Body`]. Vertices are given by their indices among those of the whole body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellView<'a> {
    first_vertex: usize,
    vertices: usize,
    edges: &'a [Edge],
    faces: u8,
}

impl<'a> CellView<'a> {
    /// Indices of the cell's vertices.
    pub(crate) fn vertices(&self) -> std::ops::Range<usize> {
        self.first_vertex..self.first_vertex + self.vertices
    }

    fn index(&self, vertex: u8) -> usize {
        self.first_vertex + usize::from(vertex)
    }

    /// Every edge once, as vertex indices.
    pub(crate) fn edges(self) -> impl Iterator<Item = [usize; 2]> + 'a {
        self.edges.iter().map(move |e| e.ends.map(|v| self.index(v)))
    }

    /// Triangles that make up the surface, as vertex indices.
    pub(crate) fn triangles(self) -> impl Iterator<Item = [usize; 3]> + 'a {
        // Each face is a fan of triangles around one of its vertices, with its other edges.
        (0..self.faces).flat_map(move |face| {
            let edges = self.edges.iter().filter(move |e| e.faces.contains(&face));
            let tip = edges.clone().next().map_or(NONE, |e| e.ends[0]);
            edges
                .filter(move |e| !e.ends.contains(&tip))
                .map(move |e| [tip, e.ends[0], e.ends[1]].map(|v| self.index(v)))
        })
    }
}

impl Parts {
    fn clear(&mut self) {
        self.vertices.clear();
        self.edges.clear();
        self.cells.clear();
    }

    fn push(&mut self, vertices: &[DVec3], edges: &[Edge], faces: u8) {
        self.cells.push(Cell {
            first_vertex: self.vertices.len() as u32,
            first_edge: self.edges.len() as u32,
            vertices: vertices.len() as u8,
            edges: edges.len() as u8,
            faces,
        });
        self.vertices.extend_from_slice(vertices);
        self.edges.extend_from_slice(edges);
    }

    fn of(&self, cell: &Cell) -> (&[DVec3], &[Edge]) {
        let (vertex, edge) = (cell.first_vertex as usize, cell.first_edge as usize);
        (
            &self.vertices[vertex..vertex + usize::from(cell.vertices)],
            &self.edges[edge..edge + usize::from(cell.edges)],
        )
    }
}

impl Clipping {
    /// Appends what lies inside all planes to `kept`.
    fn clip(&mut self, parts: &Parts, size: f64, planes: &[Plane], kept: &mut Parts) {
        for cell in &parts.cells {
            let (vertices, edges) = parts.of(cell);
            // A cell is copied when a plane cuts it for the first time.
            let mut is_cut = false;
            let is_kept = planes.iter().all(|&plane| {
                let whole = if is_cut { &self.cell.vertices[..] } else { vertices };
                let sides = set_distances(&mut self.distances, whole, plane, size);
                if sides.has_outside && sides.has_inside {
                    if is_cut {
                        let Polyhedron { vertices, edges, faces } = &self.cell;
                        self.cut.set_cut(vertices, edges, *faces, &self.distances);
                    } else {
                        self.cut.set_cut(vertices, edges, cell.faces, &self.distances);
                    }
                    std::mem::swap(&mut self.cell, &mut self.cut);
                    is_cut = true;
                }
                // A cell that only touches the plane from outside is gone.
                sides.has_inside || !sides.has_outside
            });
            if is_kept && is_cut {
                let Polyhedron { vertices, edges, faces } = &self.cell;
                kept.push(vertices, edges, *faces);
            } else if is_kept {
                kept.push(vertices, edges, cell.faces);
            }
        }
    }
}

/// On which sides of a plane vertices lie, apart from those on the plane.
struct SidesOf {
    has_inside: bool,
    has_outside: bool,
}

/// Sets the distances of all vertices from a plane.
fn set_distances(distances: &mut Vec<f64>, vertices: &[DVec3], plane: Plane, size: f64) -> SidesOf {
    // Vertices this close to the plane count as on it, so that no slivers arise from rounding.
    let tolerance = 1e-13 * size.max(plane.offset.abs());
    let (mut has_inside, mut has_outside) = (false, false);
    distances.clear();
    distances.extend(vertices.iter().map(|&v| {
        let d = plane.distance(v);
        has_inside |= d > tolerance;
        has_outside |= d < -tolerance;
        if d.abs() <= tolerance { 0.0 } else { d }
    }));
    SidesOf { has_inside, has_outside }
}

impl Polyhedron {
    /// Sets the part of a cell where the vertices' distances are not negative.
    ///
    /// A vertex is either inside or outside, and vertices on the plane count as inside. So three
    /// edges meet in every vertex of the result, as they do before, and every face that is cut is
    /// cut in two edges. Where the plane passes through a vertex, some vertices have the same
    /// position.
    fn set_cut(&mut self, vertices: &[DVec3], edges: &[Edge], faces: u8, distances: &[f64]) {
        self.vertices.clear();
        self.edges.clear();
        self.faces = faces + 1;
        let cap = faces;
        let mut moved = [NONE; 256];
        for (i, (&v, &d)) in vertices.iter().zip(distances).enumerate() {
            if d >= 0.0 {
                moved[i] = self.vertices.len() as u8;
                self.vertices.push(v);
            }
        }
        // The new vertex on the first edge of each face that was cut.
        let mut cut_first = [NONE; 256];
        for edge in edges {
            let [a, b] = edge.ends.map(usize::from);
            let (d_a, d_b) = (distances[a], distances[b]);
            if d_a >= 0.0 && d_b >= 0.0 {
                self.edges.push(Edge { ends: [moved[a], moved[b]], ..*edge });
            } else if d_a >= 0.0 || d_b >= 0.0 {
                let new = self.vertices.len() as u8;
                self.vertices.push(vertices[a].lerp(vertices[b], d_a / (d_a - d_b)));
                let kept = if d_a >= 0.0 { moved[a] } else { moved[b] };
                self.edges.push(Edge { ends: [kept, new], ..*edge });
                for face in edge.faces {
                    let first = &mut cut_first[usize::from(face)];
                    if *first == NONE {
                        *first = new;
                    } else {
                        self.edges.push(Edge { ends: [*first, new], faces: [face, cap] });
                    }
                }
            }
        }
    }
}

/// A box (local space), thick enough to clip a body of this size, metres.
pub(crate) fn thickened(aabb: Aabb, size: f64) -> Aabb {
    // A flat box, such as a ground plane, gets a thickness far below the resolution of single
    // precision at its distance, so that the clipped body has an inside.
    let farthest = aabb.min.abs().max(aabb.max.abs()).max_element();
    let pad = 1e-7 * farthest.min(size);
    Aabb { min: aabb.min - pad, max: aabb.max + pad }
}

/// The planes around a box, with their insides towards it.
fn planes_around(aabb: Aabb) -> [Plane; 6] {
    std::array::from_fn(|i| {
        let axis = DVec3::AXES[i / 2];
        if i % 2 == 0 {
            Plane { normal: axis, offset: -axis.dot(aabb.min) }
        } else {
            Plane { normal: -axis, offset: axis.dot(aabb.max) }
        }
    })
}

/// The planes of the camera's frustum, relative to the eye, with their insides towards it.
pub(crate) fn frustum_planes(camera: &Camera) -> [Plane; 6] {
    let forward = camera.forward();
    let edges = camera.edges();
    // The side planes of perspective views pass through the eye exactly.
    let side = |i: usize| {
        let [a, b] = [edges[i], edges[(i + 1) % 4]];
        let across = b.at(1.0) - a.at(1.0);
        Plane::through(a.start, across.cross(a.direction).normalize())
    };
    [
        Plane { normal: forward, offset: -camera.near() },
        Plane { normal: -forward, offset: camera.far() },
        side(0),
        side(1),
        side(2),
        side(3),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::LookAt;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera::look_at(LookAt {
            eye: DVec3::ZERO,
            target: DVec3::new(1.0, -0.3, -2.0),
            up: DVec3::Y,
            fov_y_rad: 1.0,
            near: 0.1,
            far: 20.0,
            image: [640, 480],
        })
        .unwrap()
    }

    fn plane() -> impl Strategy<Value = Plane> {
        ([-1.0..1.0f64, -1.0..1.0, -1.0..1.0], 0.0..12.0f64).prop_filter_map(
            "a direction",
            |(n, offset)| {
                let normal = DVec3::from(n).try_normalize()?;
                Some(Plane { normal, offset })
            },
        )
    }

    /// All intersections of three planes that lie inside the others.
    fn corners(planes: &[Plane]) -> Vec<DVec3> {
        let mut corners = Vec::new();
        for (i, a) in planes.iter().enumerate() {
            for (j, b) in planes[..i].iter().enumerate() {
                for c in &planes[..j] {
                    let det = a.normal.dot(b.normal.cross(c.normal));
                    let p = -(b.normal.cross(c.normal) * a.offset
                        + c.normal.cross(a.normal) * b.offset
                        + a.normal.cross(b.normal) * c.offset)
                        / det;
                    if det.abs() > 1e-6 && planes.iter().all(|q| q.distance(p) > -1e-9) {
                        corners.push(p);
                    }
                }
            }
        }
        corners
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Clipping finds the same corners as brute force. The faces are closed: every edge belongs
        /// to two of them (Euler: V − E + F = 2).
        #[test]
        fn clipping_agrees_with_brute_force(
            cuts in proptest::collection::vec(plane(), 0..8),
            floor in proptest::option::of(-2.0..2.0f64),
        ) {
            let mut body = Body::default();
            body.set_frustum(&camera());
            let mut planes = Vec::from(frustum_planes(&camera()));
            // Some bodies are clipped to a floor of hardly any thickness.
            let slab = floor.map(|y| [(DVec3::Y, 1e-6 - y), (DVec3::NEG_Y, 1e-6 + y)]);
            let slab = slab.into_iter().flatten().map(|(normal, offset)| Plane { normal, offset });
            for cut in slab.chain(cuts) {
                body.clip(&[cut]);
                planes.push(cut);
            }
            let expected = corners(&planes);
            for p in &expected {
                let nearest = body.vertices().iter().map(|v| v.distance(*p)).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < 1e-7, "{p} is missing by {nearest}");
            }
            for v in body.vertices() {
                prop_assert!(planes.iter().all(|q| q.distance(*v) > -1e-9));
            }
            prop_assert_eq!(closed_surfaces(&body)?, usize::from(!body.is_empty()));
        }
    }

    /// A box at any position, or on a lattice, where boxes touch each other and the planes that
    /// clip them. Some boxes are flat.
    fn some_box() -> impl Strategy<Value = Aabb> {
        let anywhere = prop::array::uniform2(prop::array::uniform3(-9.0..9.0f64));
        let lattice = prop::array::uniform2(prop::array::uniform3(-3i32..=3))
            .prop_map(|corners| corners.map(|corner| corner.map(f64::from)));
        prop_oneof![anywhere, lattice].prop_map(|[a, b]| Aabb::new(a.into(), b.into()))
    }

    /// A plane of any direction, or one of the lattice.
    fn cut() -> impl Strategy<Value = Plane> {
        let lattice = (0usize..6, -3i32..=3).prop_map(|(side, offset)| {
            let normal = DVec3::AXES[side / 2] * [1.0, -1.0][side % 2];
            Plane { normal, offset: offset.into() }
        });
        prop_oneof![plane(), lattice]
    }

    /// The number of cells. Checks that each cell's surface is closed: three edges meet in every
    /// vertex, every face is one loop of edges, and Euler's formula holds, V − E + F = 2.
    fn closed_surfaces(body: &Body) -> Result<usize, TestCaseError> {
        for cell in body.cells() {
            let v = cell.vertices().len();
            for vertex in cell.vertices() {
                prop_assert_eq!(cell.edges().filter(|e| e.contains(&vertex)).count(), 3);
            }
            let mut faces = 0;
            for face in 0..cell.faces {
                let of_face: Vec<[u8; 2]> =
                    cell.edges.iter().filter(|e| e.faces.contains(&face)).map(|e| e.ends).collect();
                let Some(&[first, mut at]) = of_face.first() else { continue };
                faces += 1;
                let mut last = 0;
                for _ in 1..of_face.len() {
                    let next = (0..of_face.len()).find(|&i| i != last && of_face[i].contains(&at));
                    last = next.ok_or_else(|| TestCaseError::fail("a face is open"))?;
                    at = of_face[last][usize::from(of_face[last][0] == at)];
                }
                prop_assert_eq!(at, first);
            }
            prop_assert_eq!(v + faces, cell.edges().count() + 2);
            prop_assert_eq!(cell.triangles().count(), 2 * v - 4);
        }
        Ok(body.cells().count())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 5000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Boxes clipped together are the same as boxes clipped one by one.
        #[test]
        fn many_boxes_are_cut_as_each_alone(
            boxes in proptest::collection::vec(some_box(), 1..8),
            cuts in proptest::collection::vec(cut(), 0..6),
        ) {
            let mut view = Body::default();
            view.set_frustum(&camera());
            let mut together = Body::default();
            let mut alone = Vec::new();
            for &aabb in &boxes {
                // Without padding, boxes of the lattice touch its planes.
                let is_flat = aabb.size().min_element() == 0.0;
                let aabb = if is_flat { thickened(aabb, view.size()) } else { aabb };
                together.push_box(aabb);
                let mut part = Body::default();
                part.push_box(aabb);
                prop_assert_eq!(closed_surfaces(&part)?, 1);
                cuts.iter().for_each(|&cut| part.clip(&[cut]));
                closed_surfaces(&part)?;
                if !part.is_empty() {
                    alone.push(part);
                }
            }
            let mut copied = Body::default();
            copied.set_clipped(&together, &cuts);
            together.clip(&cuts);
            prop_assert_eq!(copied.vertices(), together.vertices());
            let nearest = |p: DVec3, among: &[DVec3]| {
                among.iter().map(|v| v.distance(p)).fold(f64::INFINITY, f64::min)
            };
            let expected: Vec<DVec3> = alone.iter().flat_map(Body::vertices).copied().collect();
            for &v in &expected {
                prop_assert!(nearest(v, together.vertices()) < 1e-9, "{v} is missing");
            }
            for &v in together.vertices() {
                prop_assert!(nearest(v, &expected) < 1e-9, "{v} is too much");
            }
            prop_assert_eq!(closed_surfaces(&together)?, alone.len());
        }
    }

    #[test]
    fn a_flat_box_keeps_its_floor() {
        let mut body = Body::default();
        body.set_frustum(&camera());
        let floor = Aabb::new(DVec3::new(-50.0, -1.0, -50.0), DVec3::new(50.0, -1.0, 50.0));
        body.clip(&body.sides(floor));
        assert!(body.vertices().len() >= 6);
        assert!(body.vertices().iter().all(|v| (v.y + 1.0).abs() < 1e-5));
    }

    #[test]
    fn a_box_out_of_sight_leaves_nothing() {
        let mut body = Body::default();
        body.set_frustum(&camera());
        body.clip(&body.sides(Aabb::new(DVec3::splat(30.0), DVec3::splat(31.0))));
        assert!(body.is_empty());
        assert_eq!(body.cells().count(), 0);
    }
}
