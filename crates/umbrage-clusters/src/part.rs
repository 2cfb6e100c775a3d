//! A part of a mesh with vertices of its own, so that work on it costs nothing for the rest.

use crate::MeshInput;
use crate::deviation::deviation;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::collections::HashMap;

/// A mesh that is known to be sound, and what all its parts need to know.
pub(crate) struct Source<'a> {
    pub(crate) mesh: &'a MeshInput<'a>,
    /// The first vertex at each vertex's position.
    pub(crate) places: Vec<u32>,
    /// The first vertex that has each vertex's position, normal and texture coordinates.
    twins: Vec<u32>,
    /// The step of the grid that positions are rounded to before they are compared, metres.
    step: f32,
    /// Metres per unit of texture coordinates; 0 without them.
    pub(crate) metres_per_uv: f32,
    /// The triangles that cover anything.
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl<'a> Source<'a> {
    pub(crate) fn new(mesh: &'a MeshInput<'a>) -> Self {
        // Close to 0, numbers are much finer than elsewhere. There a sphere's pole is a ring of
        // points, each 10⁻¹⁷ m from the next, and triangles that thin would hold up simplification.
        let largest = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let step = (largest.next_up() - largest).max(f32::MIN_POSITIVE);
        let snapped: Vec<Vec3> = mesh.positions.iter().map(|&p| snapped(p, step)).collect();
        let places = places(&snapped);
        let triangles: Vec<_> = mesh
            .triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.map(|i| places[i as usize]);
                a != b && b != c && c != a
            })
            .copied()
            .collect();
        let metres_per_uv = if mesh.uvs.is_empty() { 0.0 } else { metres_per_uv(mesh, &triangles) };
        let mut source = Self { mesh, places, twins: Vec::new(), step, metres_per_uv, triangles };
        source.twins = source.find_twins();
        source
    }

    fn find_twins(&self) -> Vec<u32> {
        let mut twins: Vec<u32> = (0..self.places.len() as u32).collect();
        let mut firsts = HashMap::new();
        // Nearly all vertices are the first at their positions. They need no look-up, only those
        // that follow at the same position do, and what these are compared with.
        let followers = twins.iter().filter(|&&v| self.places[v as usize] != v);
        let followers: Vec<u32> = followers.copied().collect();
        for &vertex in &followers {
            let first = self.places[vertex as usize];
            firsts.entry(self.look(first)).or_insert(first);
        }
        for vertex in followers {
            twins[vertex as usize] = *firsts.entry(self.look(vertex)).or_insert(vertex);
        }
        twins
    }

    /// All that is known of a vertex, as bits.
    fn look(&self, vertex: u32) -> (u32, [u32; 3], [u32; 2]) {
        let has = |count: usize| count > 0;
        let normal = if has(self.mesh.normals.len()) { self.normal(vertex) } else { Vec3::ZERO };
        let uv = if has(self.mesh.uvs.len()) { self.uv(vertex) } else { Vec2::ZERO };
        (
            self.places[vertex as usize],
            normal.to_array().map(f32::to_bits),
            uv.to_array().map(f32::to_bits),
        )
    }

    pub(crate) fn uv(&self, vertex: u32) -> Vec2 {
        // Far beyond any texture, differences would be lost in rounding anyway.
        let sound = |x: f32| if x.is_finite() { x.clamp(-1e5, 1e5) } else { 0.0 };
        let uv = self.mesh.uvs[vertex as usize];
        Vec2::new(sound(uv.x), sound(uv.y))
    }

    pub(crate) fn normal(&self, vertex: u32) -> Vec3 {
        let normal = self.mesh.normals[vertex as usize];
        if normal.is_finite() { normal.clamp_length_max(1.0) } else { Vec3::ZERO }
    }
}

fn snapped(position: Vec3, step: f32) -> Vec3 {
    // The step is a power of two, so nothing but this rounding changes the position.
    (position / step).round() * step
}

fn places(positions: &[Vec3]) -> Vec<u32> {
    if positions.is_empty() {
        return Vec::new();
    }
    meshopt::generate_position_remap(
        &meshopt::VertexDataAdapter::new(bytemuck::cast_slice(positions), size_of::<Vec3>(), 0)
            .expect("positions have room for three coordinates each"),
    )
}

/// The root of the ratio of the areas of all triangles in space and in the texture.
fn metres_per_uv(mesh: &MeshInput, triangles: &[[u32; 3]]) -> f32 {
    let (mut space, mut texture) = (0.0, 0.0);
    for corners in triangles {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize].as_dvec3());
        let [p, q, r] = corners.map(|i| mesh.uvs[i as usize].as_dvec2());
        let area = (q - p).perp_dot(r - p).abs();
        if area.is_finite() && area > 0.0 {
            space += (b - a).cross(c - a).length();
            texture += area;
        }
    }
    let ratio = (space / texture).sqrt() as f32;
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// Some triangles of a mesh.
pub(crate) struct Part {
    /// The mesh's vertices that the part has, in ascending order.
    pub(crate) vertices: Vec<u32>,
    /// Their positions.
    pub(crate) positions: Vec<Vec3>,
    /// Their positions, equal where they count as equal.
    pub(crate) snapped: Vec<Vec3>,
    /// Corners as indices into `vertices`.
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Part {
    /// `corners` are indices of the mesh's vertices. Of vertices that look alike, the part has but
    /// one: simplification would take them for a seam.
    pub(crate) fn new(source: &Source, corners: &[[u32; 3]]) -> Self {
        let corners: Vec<_> = corners.iter().map(|t| t.map(|i| source.twins[i as usize])).collect();
        Self::exact(source, &corners)
    }

    /// `corners` are indices of the mesh's vertices, and stay what they are.
    pub(crate) fn exact(source: &Source, corners: &[[u32; 3]]) -> Self {
        let mut vertices = corners.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |v: u32| vertices.partition_point(|&other| other < v) as u32;
        let triangles = corners.iter().map(|t| t.map(place)).collect();
        let positions: Vec<Vec3> =
            vertices.iter().map(|&v| source.mesh.positions[v as usize]).collect();
        let snapped = vertices.iter().map(|&v| {
            let first = source.places[v as usize];
            snapped(source.mesh.positions[first as usize], source.step)
        });
        let snapped = snapped.collect();
        Self { vertices, positions, snapped, triangles }
    }

    /// The first vertex of the part at each vertex's position, as indices into `vertices`.
    pub(crate) fn firsts(&self, source: &Source) -> Vec<usize> {
        let mut others = HashMap::new();
        let first = |(i, &vertex): (usize, &u32)| {
            let place = source.places[vertex as usize];
            // Most vertices are alone at their position, which is then their own.
            if place == vertex {
                return i;
            }
            let first = self.vertices.binary_search(&place);
            first.unwrap_or_else(|_| *others.entry(place).or_insert(i))
        };
        self.vertices.iter().enumerate().map(first).collect()
    }

    /// Triangles with this part's vertices as triangles with those of a part that contains it.
    pub(crate) fn triangles_in(&self, other: &Part, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let place = |i: u32| {
            let vertex = self.vertices[i as usize];
            other.vertices.partition_point(|&other| other < vertex) as u32
        };
        triangles.iter().map(|t| t.map(place)).collect()
    }

    /// The center and half the largest extent.
    pub(crate) fn extent(&self) -> (DVec3, f64) {
        let low = self.positions.iter().fold(Vec3::INFINITY, |a, &b| a.min(b)).as_dvec3();
        let high = self.positions.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b)).as_dvec3();
        (0.5 * (low + high), 0.5 * (high - low).max_element())
    }

    /// How far the part's triangles and `coarse`, which has the part's vertices, lie from each
    /// other, metres.
    pub(crate) fn deviation(&self, source: &Source, coarse: &[[u32; 3]]) -> f32 {
        let (_, radius) = self.extent();
        if radius <= 0.0 {
            return 0.0;
        }
        let points = self.points(source);
        let deviation = if source.mesh.is_masked && source.metres_per_uv > 0.0 {
            deviation(&points, &self.triangles, coarse)
        } else {
            let points: Vec<[f32; 3]> = points.iter().map(|&[x, y, z, ..]| [x, y, z]).collect();
            deviation(&points, &self.triangles, coarse)
        };
        ((f64::from(deviation) * radius) as f32).next_up()
    }

    /// The vertices as points from -1 to 1, in space and, if that decides where the surface is, in
    /// the texture.
    pub(crate) fn points(&self, source: &Source) -> Vec<[f32; 5]> {
        let (center, radius) = self.extent();
        let has_texture = source.mesh.is_masked && source.metres_per_uv > 0.0;
        let scale = f64::from(source.metres_per_uv) / radius;
        let uv = |i: usize| source.uv(self.vertices[i]).as_dvec2();
        let point = |i: usize| {
            let [x, y, z] = ((self.positions[i].as_dvec3() - center) / radius).as_vec3().to_array();
            let uv = if has_texture { (uv(i) - uv(0)) * scale } else { DVec2::ZERO };
            [x, y, z, uv.x as f32, uv.y as f32]
        };
        (0..self.positions.len()).map(point).collect()
    }
}
