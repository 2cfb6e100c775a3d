//! The body B of the receivers that the camera sees (Wimmer et al. 2004, §3.3), in local space.

use crate::bounds::{Aabb, Plane};
use crate::camera::Camera;
use crate::math::range;
use glam::DVec3;

/// Convex polyhedra as vertices and faces, all clipped by the same planes: one polyhedron around
/// everything seen, or one for each box of receivers. The buffers are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Body {
    vertices: Vec<DVec3>,
    faces: Vec<Face>,
    /// Vertex indices of all faces, one loop after the other, counter-clockwise as seen from
    /// outside.
    loops: Vec<u32>,
    buffers: Buffers,
}

/// The face with the corners `loops[start..start + len]`, and its plane, whose inside contains the
/// body.
#[derive(Clone, Copy, Debug)]
struct Face {
    plane: Plane,
    start: usize,
    len: usize,
}

#[derive(Clone, Debug, Default)]
struct Buffers {
    distances: Vec<f64>,
    /// The new index of each vertex that is kept; `u32::MAX` for vertices of no face that is kept.
    moved: Vec<u32>,
    /// Edges cut by the plane (smaller and larger old index) and the new vertex on each.
    cuts: Vec<(u32, u32, u32)>,
    /// Edges of the new face, in its own orientation.
    rim: Vec<(u32, u32)>,
    on_plane: Vec<bool>,
    vertices: Vec<DVec3>,
    faces: Vec<Face>,
    loops: Vec<u32>,
}

/// Corners of a box's faces, counter-clockwise as seen from outside.
const BOX_FACES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

impl Body {
    /// Replaces the body by the camera's frustum, relative to the eye.
    pub(crate) fn set_frustum(&mut self, camera: &Camera) {
        self.clear();
        self.vertices.extend(camera.corners_at(camera.near()));
        self.vertices.extend(camera.corners_at(camera.far()));
        // Near corners are 0–3, far corners 4–7, in the order lower left, lower right, upper
        // right, upper left.
        let faces =
            [[0, 1, 2, 3], [5, 4, 7, 6], [1, 0, 4, 5], [2, 1, 5, 6], [3, 2, 6, 7], [0, 3, 7, 4]];
        for (i, face) in faces.into_iter().enumerate() {
            let [a, b, c] = [face[0], face[1], face[2]].map(|i: u32| self.vertices[i as usize]);
            let normal = (c - b).cross(b - a).normalize();
            // The side planes pass through the eye exactly.
            let through = if i < 2 { a } else { DVec3::ZERO };
            self.push_face(Plane::through(through, normal), &face);
        }
    }

    /// Replaces the body by a copy of another. (`Clone::clone_from` would not keep the buffers.)
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.vertices.clone_from(&other.vertices);
        self.faces.clone_from(&other.faces);
        self.loops.clone_from(&other.loops);
    }

    /// Appends all polyhedra of another body.
    pub(crate) fn append(&mut self, other: &Self) {
        let (vertices, start) = (self.vertices.len() as u32, self.loops.len());
        self.vertices.extend_from_slice(&other.vertices);
        self.loops.extend(other.loops.iter().map(|i| i + vertices));
        self.faces.extend(other.faces.iter().map(|f| Face { start: f.start + start, ..*f }));
    }

    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
        self.loops.clear();
    }

    /// Replaces the body by a box (local space), given by its [`sides`](Self::sides).
    pub(crate) fn set_box(&mut self, sides: [Plane; 6]) {
        self.clear();
        let min = DVec3::from([0, 2, 4].map(|i| -sides[i].offset));
        let max = DVec3::from([1, 3, 5].map(|i| sides[i].offset));
        self.vertices.extend(Aabb { min, max }.corners());
        for (plane, face) in sides.into_iter().zip(BOX_FACES) {
            self.push_face(plane, &face);
        }
    }

    /// Replaces the body by a convex body with the topology of a box, whose faces are plane, given
    /// by its corners (local space) in the order of [`Aabb::corners`].
    pub(crate) fn set_hexahedron(&mut self, corners: [DVec3; 8]) {
        self.clear();
        self.vertices.extend(corners);
        for face in BOX_FACES {
            let [a, b, c, d] = face.map(|i| corners[i as usize]);
            let normal = (d - b).cross(c - a).normalize_or_zero();
            self.push_face(Plane::through(a, normal), &face);
        }
    }

    fn push_face(&mut self, plane: Plane, indices: &[u32]) {
        self.faces.push(Face { plane, start: self.loops.len(), len: indices.len() });
        self.loops.extend_from_slice(indices);
    }

    pub(crate) fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Largest coordinate of any vertex, metres, which determines the rounding of positions.
    pub(crate) fn size(&self) -> f64 {
        range(self.vertices.iter().map(|v| v.abs().max_element())).1.max(0.0)
    }

    /// The centre of the body's bounding box; `None` if the body is empty.
    pub(crate) fn middle(&self) -> Option<DVec3> {
        (!self.is_empty()).then(|| Aabb::around(self.vertices.iter().copied()).center())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// Planes of all faces, with their insides towards the body.
    pub(crate) fn planes(&self) -> impl Iterator<Item = Plane> {
        self.faces.iter().map(|f| f.plane)
    }

    /// Every edge once, as vertex indices.
    pub(crate) fn edges(&self) -> impl Iterator<Item = [usize; 2]> {
        // Neighbouring faces traverse their common edge in opposite directions, so each edge is
        // counted in one of them.
        self.faces.iter().flat_map(|f| {
            let corners = self.corners(f);
            (0..f.len)
                .map(move |i| [corners[i], corners[(i + 1) % corners.len()]])
                .filter(|[a, b]| a < b)
                .map(|e| e.map(|i| i as usize))
        })
    }

    /// Triangles that make up the surface, as vertex indices.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [usize; 3]> {
        self.faces.iter().flat_map(|f| {
            let corners = self.corners(f);
            (1..f.len - 1)
                .map(move |i| [corners[0], corners[i], corners[i + 1]])
                .map(|t| t.map(|i| i as usize))
        })
    }

    fn corners(&self, face: &Face) -> &[u32] {
        &self.loops[face.start..face.start + face.len]
    }

    /// Removes what lies outside `aabb` (local space).
    pub(crate) fn clip_aabb(&mut self, aabb: Aabb) {
        if aabb.is_empty() {
            self.clear();
            return;
        }
        self.sides(aabb).into_iter().for_each(|side| self.clip(side));
    }

    /// The planes around a box, thick enough to clip this body.
    pub(crate) fn sides(&self, aabb: Aabb) -> [Plane; 6] {
        // A flat box, such as a ground plane, gets a thickness far below the resolution of single
        // precision at its distance, so that the clipped body has an inside.
        let farthest = aabb.min.abs().max(aabb.max.abs()).max_element();
        let pad = 1e-7 * farthest.min(self.size());
        std::array::from_fn(|i| {
            let axis = DVec3::AXES[i / 2];
            if i % 2 == 0 {
                Plane { normal: axis, offset: pad - axis.dot(aabb.min) }
            } else {
                Plane { normal: -axis, offset: pad + axis.dot(aabb.max) }
            }
        })
    }

    /// Removes what lies outside `plane`.
    pub(crate) fn clip(&mut self, plane: Plane) {
        let scale = self.size();
        // Vertices this close to the plane count as on it, so that no slivers arise from rounding.
        let tolerance = 1e-13 * scale.max(plane.offset.abs());
        let distances = &mut self.buffers.distances;
        distances.clear();
        distances.extend(self.vertices.iter().map(|&v| {
            let d = plane.distance(v);
            if d.abs() <= tolerance { 0.0 } else { d }
        }));
        if distances.iter().all(|&d| d >= 0.0) {
            return;
        }
        if distances.iter().all(|&d| d <= 0.0) {
            self.clear();
            return;
        }
        self.cut_faces();
        self.buffers.close_cuts(plane);
        let Buffers { vertices, faces, loops, .. } = &mut self.buffers;
        std::mem::swap(&mut self.vertices, vertices);
        std::mem::swap(&mut self.faces, faces);
        std::mem::swap(&mut self.loops, loops);
    }

    /// Copies the inside parts of all faces to the buffers, and collects the edges along the cuts.
    fn cut_faces(&mut self) {
        let Buffers { distances, moved, cuts, rim, on_plane, vertices, faces, loops } =
            &mut self.buffers;
        vertices.clear();
        faces.clear();
        loops.clear();
        moved.clear();
        cuts.clear();
        rim.clear();
        on_plane.clear();
        moved.resize(self.vertices.len(), u32::MAX);
        for face in &self.faces {
            let corners = &self.loops[face.start..face.start + face.len];
            if corners.iter().all(|&i| distances[i as usize] <= 0.0) {
                // The face is cut off, or lies entirely on the plane. In the latter case a new face
                // replaces it if part of its polyhedron is inside.
                continue;
            }
            let start = loops.len();
            for (i, &a) in corners.iter().enumerate() {
                let b = corners[(i + 1) % corners.len()];
                let (to, d) = (&mut moved[a as usize], distances[a as usize]);
                if d >= 0.0 {
                    if *to == u32::MAX {
                        *to = vertices.len() as u32;
                        vertices.push(self.vertices[a as usize]);
                        on_plane.push(d == 0.0);
                    }
                    loops.push(*to);
                }
                let (lo, hi) = (a.min(b), a.max(b));
                let (d_lo, d_hi) = (distances[lo as usize], distances[hi as usize]);
                if d_lo * d_hi < 0.0 {
                    // The neighbouring face that cut the same edge belongs to the same polyhedron,
                    // so it was visited recently.
                    let known = cuts.iter().rev().find(|c| (c.0, c.1) == (lo, hi)).map(|c| c.2);
                    loops.push(known.unwrap_or_else(|| {
                        let index = vertices.len() as u32;
                        let [p, q] = [lo, hi].map(|i| self.vertices[i as usize]);
                        vertices.push(p.lerp(q, d_lo / (d_lo - d_hi)));
                        cuts.push((lo, hi, index));
                        on_plane.push(true);
                        index
                    }));
                }
            }
            let len = loops.len() - start;
            faces.push(Face { plane: face.plane, start, len });
            for i in start..start + len {
                let (a, b) = (loops[i], loops[start + (i + 1 - start) % len]);
                if on_plane[a as usize] && on_plane[b as usize] {
                    rim.push((b, a));
                }
            }
        }
    }
}

impl Buffers {
    /// Closes the polyhedra that `plane` cut, each with one new face.
    fn close_cuts(&mut self, plane: Plane) {
        let Self { rim, faces, loops, .. } = self;
        while let Some((first, mut at)) = rim.pop() {
            let start = loops.len();
            loops.push(first);
            while at != first {
                loops.push(at);
                match rim.iter().rposition(|edge| edge.0 == at) {
                    Some(next) => at = rim.swap_remove(next).1,
                    None => break,
                }
            }
            let len = loops.len() - start;
            if at == first && len >= 3 {
                faces.push(Face { plane, start, len });
            } else {
                loops.truncate(start);
            }
        }
    }
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
            let mut planes: Vec<Plane> = body.planes().collect();
            // Some bodies are clipped to a floor of hardly any thickness.
            let slab = floor.map(|y| [(DVec3::Y, 1e-6 - y), (DVec3::NEG_Y, 1e-6 + y)]);
            let slab = slab.into_iter().flatten().map(|(normal, offset)| Plane { normal, offset });
            for cut in slab.chain(cuts) {
                body.clip(cut);
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
            if !body.is_empty() {
                let (v, e, f) = (body.vertices().len(), body.edges().count(), body.planes().count());
                prop_assert_eq!(v + f, e + 2);
                prop_assert_eq!(body.triangles().count(), 2 * v - 4);
            }
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

    /// The number of separate closed surfaces that the faces make up. Checks that every edge
    /// belongs to two faces, once in each direction, and every vertex to three or more.
    fn closed_surfaces(body: &Body) -> Result<usize, TestCaseError> {
        let mut ways = std::collections::HashMap::new();
        let mut root: Vec<usize> = (0..body.vertices().len()).collect();
        let find = |root: &[usize], mut i: usize| {
            while root[i] != i {
                i = root[i];
            }
            i
        };
        let mut faces_at = vec![0; body.vertices().len()];
        for face in &body.faces {
            let corners = body.corners(face);
            for (i, &a) in corners.iter().enumerate() {
                let b = corners[(i + 1) % corners.len()];
                *ways.entry((a, b)).or_insert(0) += 1;
                faces_at[a as usize] += 1;
                let [a, b] = [a, b].map(|v| find(&root, v as usize));
                root[a] = b;
            }
        }
        for (&(a, b), &count) in &ways {
            prop_assert_eq!((count, ways.get(&(b, a))), (1, Some(&1)), "edge {} {}", a, b);
        }
        prop_assert!(faces_at.iter().all(|&n| n >= 3), "{faces_at:?}");
        Ok((0..root.len()).filter(|&i| root[i] == i).count())
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
            let mut part = Body::default();
            for &aabb in &boxes {
                // Without padding, boxes of the lattice touch its planes.
                let is_flat = aabb.size().min_element() == 0.0;
                part.set_box(if is_flat { view.sides(aabb) } else { Body::default().sides(aabb) });
                prop_assert_eq!(closed_surfaces(&part)?, 1);
                together.append(&part);
                cuts.iter().for_each(|&cut| part.clip(cut));
                if !part.is_empty() {
                    alone.push(part.clone());
                }
            }
            for &cut in &cuts {
                together.clip(cut);
                closed_surfaces(&together)?;
            }
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
            // Euler's formula holds for each polyhedron.
            let (v, e, f) = (expected.len(), together.edges().count(), together.planes().count());
            prop_assert_eq!(together.vertices().len(), v);
            prop_assert_eq!(closed_surfaces(&together)?, alone.len());
            prop_assert_eq!(v + f, e + 2 * alone.len());
            prop_assert_eq!(f, alone.iter().map(|b| b.planes().count()).sum::<usize>());
            prop_assert_eq!(together.triangles().count(), 2 * v - 4 * alone.len());
        }
    }

    #[test]
    fn a_flat_box_keeps_its_floor() {
        let mut body = Body::default();
        body.set_frustum(&camera());
        body.clip_aabb(Aabb::new(DVec3::new(-50.0, -1.0, -50.0), DVec3::new(50.0, -1.0, 50.0)));
        assert!(body.vertices().len() >= 6);
        assert!(body.vertices().iter().all(|v| (v.y + 1.0).abs() < 1e-5));
    }

    #[test]
    fn a_box_out_of_sight_leaves_nothing() {
        let mut body = Body::default();
        for aabb in [Aabb::new(DVec3::splat(30.0), DVec3::splat(31.0)), Aabb::EMPTY] {
            body.set_frustum(&camera());
            body.clip_aabb(aabb);
            assert!(body.is_empty());
            assert_eq!(body.edges().count() + body.triangles().count(), 0);
        }
    }
}
