use super::document::{Document, Notices};
use super::material::TexCoords;
use crate::error::SceneError;
use crate::types::Mesh;
use glam::{Vec2, Vec3};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

/// For each vertex, four joints and their weights.
pub(super) struct Binding {
    pub(super) joints: Vec<[u32; 4]>,
    pub(super) weights: Vec<[f32; 4]>,
}

pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

/// The triangles of a primitive in its mesh's space; `None` if it has none.
///
/// Data that glTF leaves to the reader, or that exporters often get wrong, is repaired with a
/// notice: points and lines are left out, strips and fans become triangles, missing normals are
/// those of the triangles (as glTF demands), and normals of zero length become the mean of the
/// surrounding triangles' normals.
///
/// # Errors
/// A position is not finite or an index is out of range, which cannot be repaired.
pub(super) fn load(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    material: usize,
    tex_coords: Option<TexCoords>,
    notices: &mut Notices,
) -> Result<Option<Mesh>, SceneError> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err(document.invalid(place, "mode is unknown, should be 0 to 6"));
    };
    if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        notices.add(place, "points and lines are left out");
        return Ok(None);
    }
    let Some(positions) = attribute(primitive, Semantic::Positions) else {
        notices.add(place, "has no positions, left out");
        return Ok(None);
    };
    let positions = vectors(document, positions, &format!("{place}.attributes.POSITION"))?;
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        let problem = format!("position {i} is {}, must be finite", positions[i]);
        return Err(document.invalid(place, problem));
    }
    let indices = match primitive.indices {
        Some(id) => document
            .integers::<1>(id, &format!("{place}.indices"))?
            .into_iter()
            .map(|[i]| i)
            .collect(),
        None => (0..positions.len() as u32).collect::<Vec<_>>(),
    };
    let triangles = triangles(mode, &indices);
    if mode == Mode::Triangles && indices.len() % 3 != 0 {
        notices.add(place, "the last triangle has fewer than three corners, left out");
    }
    if let Some(k) = indices.iter().position(|&i| i as usize >= positions.len()) {
        let (i, n) = (indices[k], positions.len());
        let problem = format!("index {k} is {i}, there are {n} positions");
        return Err(document.invalid(&format!("{place}.indices"), problem));
    }
    if triangles.is_empty() {
        notices.add(place, "has no triangles, left out");
        return Ok(None);
    }
    let normals = match attribute(primitive, Semantic::Normals) {
        Some(id) => vectors(document, id, &format!("{place}.attributes.NORMAL"))?,
        None => Vec::new(),
    };
    let uvs = match tex_coords {
        Some(coords) => load_uvs(document, primitive, place, coords, notices)?,
        None => Vec::new(),
    };
    let n = positions.len();
    for (what, found) in [("normals", normals.len()), ("texture coordinates", uvs.len())] {
        if found != n && found != 0 {
            return Err(document.invalid(place, format!("has {n} positions but {found} {what}")));
        }
    }
    if attribute(primitive, Semantic::Colors(0)).is_some() {
        notices.add(place, "vertex colours are not shown");
    }

    let mut mesh = Mesh { positions, normals, uvs, triangles, material };
    if mesh.normals.is_empty() {
        notices.add(place, "has no normals, shaded flat");
        shade_flat(&mut mesh);
    } else {
        let repaired = repair_normals(&mut mesh);
        notices.add_some(
            place,
            repaired,
            "normals without a direction, computed from the triangles around",
        );
    }
    Ok(Some(mesh))
}

/// Texture coordinates of a primitive, transformed for its material; empty if it has none.
fn load_uvs(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    coords: TexCoords,
    notices: &mut Notices,
) -> Result<Vec<Vec2>, SceneError> {
    let Some(id) = attribute(primitive, Semantic::TexCoords(coords.set)) else {
        notices.add(place, "has a texture but no coordinates for it, shown without");
        return Ok(Vec::new());
    };
    let place = format!("{place}.attributes.TEXCOORD_{}", coords.set);
    let mut broken = 0;
    let uvs = document.floats::<2>(id, &place)?.into_iter().map(|uv| {
        let uv = coords.transform.transform_point2(uv.into());
        broken += usize::from(!uv.is_finite());
        if uv.is_finite() { uv } else { Vec2::ZERO }
    });
    let uvs = uvs.collect();
    notices.add_some(place, broken, "texture coordinates are not finite, 0 instead");
    Ok(uvs)
}

/// The joints and weights of a primitive's vertices; `None` if the primitive lacks either.
pub(super) fn load_binding(
    document: &Document,
    primitive: &Primitive,
    place: &str,
) -> Result<Option<Binding>, SceneError> {
    let joints = attribute(primitive, Semantic::Joints(0));
    let weights = attribute(primitive, Semantic::Weights(0));
    let Some((joints, weights)) = joints.zip(weights) else {
        return Ok(None);
    };
    let joints = document.integers::<4>(joints, &format!("{place}.attributes.JOINTS_0"))?;
    let weights = document.floats::<4>(weights, &format!("{place}.attributes.WEIGHTS_0"))?;
    Ok(Some(Binding { joints, weights }))
}

fn vectors(document: &Document, id: Index<Accessor>, place: &str) -> Result<Vec<Vec3>, SceneError> {
    Ok(document.floats::<3>(id, place)?.into_iter().map(Vec3::from).collect())
}

/// Corners of each triangle, all with the same winding.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            // Every second triangle of a strip has the opposite winding.
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => indices.windows(2).skip(1).map(|w| [indices[0], w[0], w[1]]).collect(),
        _ => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// The triangle's normal with twice its area as length, in double precision so that it is zero only
/// for triangles without area.
fn area_normal(positions: &[Vec3], triangle: [u32; 3]) -> glam::DVec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// Gives every triangle corners of its own, which have the triangle's normal.
pub(super) fn shade_flat(mesh: &mut Mesh) {
    let corners = || mesh.triangles.iter().flatten().map(|&i| i as usize);
    let normals = mesh.triangles.iter().flat_map(|&t| {
        let n = area_normal(&mesh.positions, t).normalize_or(glam::DVec3::Y);
        [n.as_vec3(); 3]
    });
    let normals = normals.collect();
    let positions = corners().map(|i| mesh.positions[i]).collect();
    if !mesh.uvs.is_empty() {
        mesh.uvs = corners().map(|i| mesh.uvs[i]).collect();
    }
    mesh.positions = positions;
    mesh.normals = normals;
    for (k, t) in mesh.triangles.iter_mut().enumerate() {
        *t = [0, 1, 2].map(|c| 3 * k as u32 + c);
    }
}

/// Removes the vertices that no triangle uses, because files may let all primitives share one large
/// array.
pub(super) fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for &i in mesh.triangles.iter().flatten() {
        used[i as usize] = true;
    }
    if used.iter().all(|&u| u) {
        return;
    }
    let mut kept = 0;
    let new_index: Vec<u32> = used
        .iter()
        .map(|&used| {
            kept += u32::from(used);
            kept - u32::from(used)
        })
        .collect();
    for i in mesh.triangles.iter_mut().flatten() {
        *i = new_index[*i as usize];
    }
    mesh.positions = keep(&mesh.positions, &used);
    mesh.normals = keep(&mesh.normals, &used);
    mesh.uvs = keep(&mesh.uvs, &used);
}

/// The values of the used vertices; empty for an empty list.
fn keep<T: Copy>(values: &[T], used: &[bool]) -> Vec<T> {
    values.iter().zip(used).filter(|(_, used)| **used).map(|(value, _)| *value).collect()
}

/// Makes all normals unit vectors. Returns how many of them had no direction and were computed from
/// the triangles.
fn repair_normals(mesh: &mut Mesh) -> usize {
    let mut missing = vec![false; mesh.normals.len()];
    for (normal, missing) in mesh.normals.iter_mut().zip(&mut missing) {
        match normal.as_dvec3().try_normalize() {
            Some(n) => *normal = n.as_vec3(),
            None => *missing = true,
        }
    }
    let count = missing.iter().filter(|&&m| m).count();
    if count > 0 {
        let mut sums = vec![glam::DVec3::ZERO; missing.len()];
        for &t in &mesh.triangles {
            let normal = area_normal(&mesh.positions, t);
            for i in t {
                sums[i as usize] += normal;
            }
        }
        for (i, _) in missing.iter().enumerate().filter(|(_, m)| **m) {
            mesh.normals[i] = sums[i].normalize_or(glam::DVec3::Y).as_vec3();
        }
    }
    count
}
