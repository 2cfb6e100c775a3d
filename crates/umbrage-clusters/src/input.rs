//! What clusters are made of, and whether it is fit for that.

use glam::{Vec2, Vec3};
use sha2::{Digest, Sha256};

/// The triangles of a mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshInput<'a> {
    /// Metres, in mesh space. Vertices at equal positions count as one point of the surface.
    pub positions: &'a [Vec3],
    /// One a vertex, or empty. Those that are not finite count as 0.
    pub normals: &'a [Vec3],
    /// Texture coordinates, one a vertex, or empty. Those that are not finite count as 0.
    pub uvs: &'a [Vec2],
    /// Corners as indices into the vertices. Triangles that have two corners at one position cover
    /// nothing; they get into no cluster.
    pub triangles: &'a [[u32; 3]],
    /// Whether a texture cuts holes into the triangles. If so, the error of clusters also counts
    /// how far a point of the texture is moved over the surface.
    pub is_masked: bool,
}

/// Why no clusters can be made of a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A corner names no vertex.
    #[error("triangle {triangle} names vertex {index}, but there are {vertices}")]
    Index {
        /// The place of the triangle.
        triangle: usize,
        /// The index in question.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A coordinate is no number, infinite, or beyond what can be computed with.
    #[error("vertex {vertex} lies at {position}, which is not within {} m", MAX_COORDINATE)]
    Position {
        /// The place of the vertex.
        vertex: usize,
        /// Its position.
        position: Vec3,
    },
    /// There are normals, but not one a vertex.
    #[error("{normals} normals for {vertices} vertices")]
    Normals {
        /// The number of normals.
        normals: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// There are texture coordinates, but not one pair a vertex.
    #[error("{uvs} texture coordinates for {vertices} vertices")]
    Uvs {
        /// The number of texture coordinates.
        uvs: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// There are more vertices or triangles than clusters can name.
    #[error("{count} vertices or triangles are more than {}", MAX_COUNT)]
    TooMany {
        /// The number of the one or the other.
        count: usize,
    },
    /// One of several meshes is unfit.
    #[error("mesh {mesh}: {error}")]
    Mesh {
        /// The place of the mesh.
        mesh: usize,
        /// What is wrong with it.
        error: Box<Error>,
    },
}

/// Squares of larger coordinates would leave the range of `f32` where areas are compared.
const MAX_COORDINATE: f32 = 1e8;

/// All levels together have about twice the triangles of the mesh, three corners each, and all
/// these are counted in 32 bits.
const MAX_COUNT: usize = 500_000_000;

impl MeshInput<'_> {
    /// Refuses what meshoptimizer, which trusts its caller, must not see.
    #[cfg_attr(not(feature = "build"), expect(dead_code, reason = "nothing is built"))]
    pub(crate) fn check(&self) -> Result<(), Error> {
        let vertices = self.positions.len();
        let count = vertices.max(self.triangles.len());
        if count > MAX_COUNT {
            return Err(Error::TooMany { count });
        }
        if !self.normals.is_empty() && self.normals.len() != vertices {
            return Err(Error::Normals { normals: self.normals.len(), vertices });
        }
        if !self.uvs.is_empty() && self.uvs.len() != vertices {
            return Err(Error::Uvs { uvs: self.uvs.len(), vertices });
        }
        for (vertex, &position) in self.positions.iter().enumerate() {
            // Written so that a NaN fails as well.
            if !position.to_array().iter().all(|x| x.abs() <= MAX_COORDINATE) {
                return Err(Error::Position { vertex, position });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(Error::Index { triangle, index, vertices });
            }
        }
        Ok(())
    }
}

/// A hash over everything in `meshes` that their clusters depend on.
#[must_use]
pub fn fingerprint(meshes: &[MeshInput]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update((meshes.len() as u64).to_le_bytes());
    for mesh in meshes {
        // The counts keep apart what would be equal in a row.
        let counts =
            [mesh.positions.len(), mesh.normals.len(), mesh.uvs.len(), mesh.triangles.len()];
        for count in counts {
            hash.update((count as u64).to_le_bytes());
        }
        hash.update([u8::from(mesh.is_masked)]);
        hash.update(bytemuck::cast_slice(mesh.positions));
        hash.update(bytemuck::cast_slice(mesh.normals));
        hash.update(bytemuck::cast_slice(mesh.uvs));
        hash.update(bytemuck::cast_slice(mesh.triangles));
    }
    hash.finalize().into()
}
