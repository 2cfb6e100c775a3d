//! Clusters in files. `FORMAT.md` describes the format.

use crate::{Ball, Cluster, ClusterMesh, Flaw, Node};
use bytemuck::Zeroable;
use sha2::{Digest, Sha256};
use std::io::{self, Read, Write};

/// The version of the format that [`write()`] writes and [`read`] reads.
pub const FORMAT_VERSION: u32 = 1;

const MAGIC: [u8; 8] = *b"UMBCLUST";

/// Magic, version, number of meshes, fingerprint and checksum.
const HEADER: usize = 8 + 4 + 4 + 32 + 32;

/// The four counts of a mesh.
const COUNTS: usize = 4 * 8;

const BALL: usize = 16;
const CLUSTER: usize = 2 * BALL + 24;
const NODE: usize = BALL + 16;

/// Why a file of clusters was not written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The system failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Another kind of file.
    #[error("this is no file of clusters")]
    Foreign,
    /// Written by another version of this crate.
    #[error("the file has format {found}, not {FORMAT_VERSION}")]
    Version {
        /// The format's version in the file.
        found: u32,
    },
    /// Made of other meshes.
    #[error("the clusters belong to another scene")]
    OtherScene,
    /// Some bytes are missing, added or changed.
    #[error("the file is damaged")]
    Damaged,
    /// The bytes are those written, but what they say cannot be drawn.
    #[error("the clusters of mesh {mesh} are unsound: {flaw}")]
    Unsound {
        /// The place of the mesh.
        mesh: usize,
        /// What is wrong.
        flaw: Flaw,
    },
}

/// Writes the clusters of all meshes of a scene, which has this
/// [`fingerprint`](crate::fingerprint).
///
/// # Errors
///
/// When `to` does not take the bytes.
pub fn write(
    to: &mut impl Write,
    meshes: &[ClusterMesh],
    fingerprint: &[u8; 32],
) -> Result<(), FileError> {
    let count = u32::try_from(meshes.len())
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "more than 2³² meshes"))?;
    let mut header = Vec::with_capacity(HEADER);
    header.extend(MAGIC);
    header.extend(FORMAT_VERSION.to_le_bytes());
    header.extend(count.to_le_bytes());
    header.extend(fingerprint);
    // The checksum comes before what it is taken over, so everything is made twice. That is cheaper
    // than to hold the whole file.
    let mut hash = Sha256::new();
    hash.update(&header);
    for mesh in meshes {
        content(mesh, &mut |bytes| {
            hash.update(bytes);
            Ok(())
        })?;
    }
    to.write_all(&header)?;
    to.write_all(&hash.finalize())?;
    for mesh in meshes {
        content(mesh, &mut |bytes| to.write_all(bytes))?;
    }
    Ok(())
}

/// The bytes of a mesh, piece by piece.
fn content(mesh: &ClusterMesh, put: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
    let counts = [mesh.clusters.len(), mesh.nodes.len(), mesh.vertices.len(), mesh.triangles.len()];
    for count in counts {
        put(&(count as u64).to_le_bytes())?;
    }
    // Some thousand at a time, so that neither calls nor memory matter.
    let mut bytes = Vec::new();
    for clusters in mesh.clusters.chunks(1024) {
        bytes.clear();
        for cluster in clusters {
            let Cluster { bounds, error_bounds, error, level, .. } = cluster;
            put_ball(&mut bytes, bounds);
            put_ball(&mut bytes, error_bounds);
            bytes.extend(error.to_le_bytes());
            let (v, t) = (cluster.first_vertex, cluster.first_triangle);
            for number in [*level, v, cluster.vertex_count, t, cluster.triangle_count] {
                bytes.extend(number.to_le_bytes());
            }
        }
        put(&bytes)?;
    }
    for nodes in mesh.nodes.chunks(1024) {
        bytes.clear();
        for node in nodes {
            put_ball(&mut bytes, &node.bounds);
            bytes.extend(node.error.to_le_bytes());
            for number in [node.first, node.count, node.is_leaf] {
                bytes.extend(number.to_le_bytes());
            }
        }
        put(&bytes)?;
    }
    for vertices in mesh.vertices.chunks(16 * 1024) {
        bytes.clear();
        bytes.extend(vertices.iter().flat_map(|v| v.to_le_bytes()));
        put(&bytes)?;
    }
    put(mesh.triangles.as_flattened())
}

fn put_ball(bytes: &mut Vec<u8>, ball: &Ball) {
    for x in [ball.center.x, ball.center.y, ball.center.z, ball.radius] {
        bytes.extend(x.to_le_bytes());
    }
}

/// Reads what [`write()`] wrote. `length` is that of the whole file in bytes, `fingerprint` the
/// scene's, and `vertices` the number of vertices of each of its meshes.
///
/// Memory is only taken for what a file of this length can hold. The result passes
/// [`ClusterMesh::check`].
///
/// # Errors
///
/// When the bytes are not exactly those that were written, or were written for another scene.
pub fn read(
    from: &mut impl Read,
    length: u64,
    fingerprint: &[u8; 32],
    vertices: &[usize],
) -> Result<Vec<ClusterMesh>, FileError> {
    let mut hash = Sha256::new();
    let mut header = [0; HEADER];
    let (magic, rest) = header.split_at_mut(MAGIC.len());
    // What is too short to have the magic number is foreign; later ends are damage.
    from.read_exact(magic).map_err(|error| ended(error, FileError::Foreign))?;
    if magic != MAGIC {
        return Err(FileError::Foreign);
    }
    from.read_exact(rest).map_err(|error| ended(error, FileError::Damaged))?;
    let (said, checksum) = header.split_at(HEADER - 32);
    hash.update(said);
    let number = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| said[at + i]));
    if number(8) != FORMAT_VERSION {
        return Err(FileError::Version { found: number(8) });
    }
    if said[16..48] != *fingerprint {
        return Err(FileError::OtherScene);
    }
    let count = number(12) as usize;
    if count != vertices.len() {
        return Err(FileError::Damaged);
    }
    let mut source = Source { from, left: length.saturating_sub(HEADER as u64), hash };
    let mut meshes = Vec::with_capacity(count);
    for _ in 0..count {
        meshes.push(source.mesh()?);
    }
    if source.left > 0 || source.from.read(&mut [0])? > 0 {
        return Err(FileError::Damaged);
    }
    if source.hash.finalize()[..] != *checksum {
        return Err(FileError::Damaged);
    }
    for (i, (mesh, &vertices)) in meshes.iter().zip(vertices).enumerate() {
        mesh.check(vertices).map_err(|flaw| FileError::Unsound { mesh: i, flaw })?;
    }
    Ok(meshes)
}

fn ended(error: io::Error, otherwise: FileError) -> FileError {
    if error.kind() == io::ErrorKind::UnexpectedEof { otherwise } else { error.into() }
}

/// The rest of a file.
struct Source<'a, R> {
    from: &'a mut R,
    /// The bytes that should be left.
    left: u64,
    hash: Sha256,
}

impl<R: Read> Source<'_, R> {
    /// The next `count` pieces of `size` bytes.
    fn take(&mut self, count: u64, size: usize) -> Result<Vec<u8>, FileError> {
        let bytes = count.checked_mul(size as u64).filter(|&bytes| bytes <= self.left);
        let bytes = bytes.ok_or(FileError::Damaged)?;
        self.left -= bytes;
        // Grows with what there is, in case the stated length is wrong as well.
        let mut taken = Vec::new();
        self.from.take(bytes).read_to_end(&mut taken)?;
        if taken.len() as u64 != bytes {
            return Err(FileError::Damaged);
        }
        self.hash.update(&taken);
        Ok(taken)
    }

    fn mesh(&mut self) -> Result<ClusterMesh, FileError> {
        let counts = self.take(1, COUNTS)?;
        let count = |i: usize| u64::from_le_bytes(std::array::from_fn(|j| counts[8 * i + j]));
        let clusters = self.take(count(0), CLUSTER)?;
        let nodes = self.take(count(1), NODE)?;
        let vertices = self.take(count(2), 4)?;
        let triangles = self.take(count(3), 3)?;
        Ok(ClusterMesh {
            clusters: clusters.as_chunks::<CLUSTER>().0.iter().map(cluster).collect(),
            nodes: nodes.as_chunks::<NODE>().0.iter().map(node).collect(),
            vertices: vertices.as_chunks().0.iter().map(|&v| u32::from_le_bytes(v)).collect(),
            triangles: triangles.as_chunks().0.to_vec(),
        })
    }
}

/// The words of a record.
fn words(bytes: &[u8]) -> impl Iterator<Item = u32> + '_ {
    bytes.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word))
}

fn ball(words: &mut impl Iterator<Item = u32>) -> Ball {
    let mut ball = Ball::zeroed();
    for x in bytemuck::cast_slice_mut(std::slice::from_mut(&mut ball)) {
        *x = words.next().map_or(f32::NAN, f32::from_bits);
    }
    ball
}

fn cluster(bytes: &[u8; CLUSTER]) -> Cluster {
    let mut words = words(bytes);
    let (bounds, error_bounds) = (ball(&mut words), ball(&mut words));
    let mut next = || words.next().unwrap_or_default();
    Cluster {
        bounds,
        error_bounds,
        error: f32::from_bits(next()),
        level: next(),
        first_vertex: next(),
        vertex_count: next(),
        first_triangle: next(),
        triangle_count: next(),
    }
}

fn node(bytes: &[u8; NODE]) -> Node {
    let mut words = words(bytes);
    let bounds = ball(&mut words);
    let mut next = || words.next().unwrap_or_default();
    Node { bounds, error: f32::from_bits(next()), first: next(), count: next(), is_leaf: next() }
}
