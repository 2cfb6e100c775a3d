use super::document::{Document, Notices};
use super::material::TexCoords;
use crate::error::SceneError;
use crate::types::Mesh;
use glam::{DVec3, Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

/// What of a primitive is needed, which depends on its material and on the node that draws it.
pub(super) struct Wanted<'a> {
    /// Index of the material in the scene.
    pub(super) material: usize,
    pub(super) tex_coords: Option<TexCoords>,
    /// Whether the vertices' alpha matters.
    pub(super) is_masked: bool,
    /// Weights of the morph targets; those that are missing count as 0.
    pub(super) morph_weights: &'a [f32],
    pub(super) is_skinned: bool,
}

/// The triangles of a primitive, and the joints that move them.
pub(super) struct Loaded {
    pub(super) mesh: Mesh,
    /// One for each of the sets `JOINTS_0`, `JOINTS_1`, …; empty if the mesh is not skinned.
    pub(super) influences: Vec<Influences>,
}

/// For each vertex, four of the joints that move it, and their weights.
pub(super) struct Influences {
    joints: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Influences {
    /// The joints that move a vertex, with their weights.
    pub(super) fn of_vertex(&self, i: usize) -> impl Iterator<Item = (u32, f32)> {
        self.joints[i].into_iter().zip(self.weights[i]).filter(|(_, weight)| *weight != 0.0)
    }
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

/// The triangles of a primitive in its mesh's space, morphed but not yet in the pose of its skin,
/// with those vertices alone that triangles use; `None` if it has no triangles.
///
/// Data that glTF leaves to the reader, or that exporters often get wrong, is repaired with a
/// notice: points and lines are left out, strips and fans become triangles, missing normals are
/// those of the triangles (as glTF demands), and normals of zero length become the mean of the
/// surrounding triangles' normals.
///
/// # Errors
/// A position that triangles use is not finite or an index is out of range, which cannot be
/// repaired, or the mesh is too large.
pub(super) fn load(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    wanted: &Wanted<'_>,
    notices: &mut Notices,
) -> Result<Option<Loaded>, SceneError> {
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
    note_unread(primitive, place, wanted, notices);
    check_counts(document, primitive, place, wanted, positions)?;
    let mut positions = vectors(document, positions, &format!("{place}.attributes.POSITION"))?;
    morph(document, primitive, place, wanted, Moved::Positions, &mut positions)?;
    let triangles = load_triangles(document, primitive, mode, place, &positions, notices)?;
    if triangles.is_empty() {
        notices.add(place, "has no triangles, left out");
        return Ok(None);
    }
    if let Some(&i) = triangles.iter().flatten().find(|&&i| !positions[i as usize].is_finite()) {
        let problem = format!("position {i} is {}, must be finite", positions[i as usize]);
        return Err(document.invalid(place, problem));
    }
    let mut normals = match attribute(primitive, Semantic::Normals) {
        Some(id) => vectors(document, id, &format!("{place}.attributes.NORMAL"))?,
        None => Vec::new(),
    };
    if !normals.is_empty() {
        morph(document, primitive, place, wanted, Moved::Normals, &mut normals)?;
    }
    let uvs = match wanted.tex_coords {
        Some(coords) => load_uvs(document, primitive, place, coords, notices)?,
        None => Vec::new(),
    };
    let alphas = load_alphas(document, primitive, place, wanted, notices)?;
    let influences = match wanted.is_skinned {
        true => load_influences(document, primitive, place, notices)?,
        false => Vec::new(),
    };

    let count = positions.len() as u64;
    document.budget.take(place, count, "vertices", size_of::<u32>() + size_of::<usize>())?;
    let material = wanted.material;
    let mesh = Mesh { positions, normals, uvs, alphas, triangles, material };
    let mut loaded = Loaded { mesh, influences };
    drop_unused_vertices(&mut loaded, place, notices);
    let mesh = &mut loaded.mesh;
    if mesh.normals.is_empty() {
        notices.add(place, "has no normals, shaded flat");
        let corners = 3 * mesh.triangles.len() as u64;
        document.budget.take(place, corners, "corners", BYTES_PER_CORNER)?;
        shade_flat(&mut loaded);
    } else {
        let repaired = repair_normals(mesh);
        notices.add_some(
            place,
            repaired,
            "normals without a direction, computed from the triangles around",
        );
    }
    Ok(Some(loaded))
}

/// Largest memory that a corner of a flat triangle takes, bytes: position, normal, texture
/// coordinates and alpha, and joints with their weights.
const BYTES_PER_CORNER: usize = 2 * size_of::<Vec3>()
    + size_of::<Vec2>()
    + size_of::<f32>()
    + size_of::<[u32; 4]>()
    + size_of::<[f32; 4]>();

/// Notes attributes that are not used.
fn note_unread(primitive: &Primitive, place: &str, wanted: &Wanted<'_>, notices: &mut Notices) {
    let has = |test: fn(&Checked<Semantic>) -> bool| primitive.attributes.keys().any(test);
    if has(|key| matches!(key, Checked::Valid(Semantic::Colors(set)) if *set > 0)) {
        notices.add(place, "has several sets of vertex colours, only the first counts");
    }
    if has(|key| matches!(key, Checked::Invalid)) {
        notices.add(place, "has attributes of its application's own, which are not used");
    }
    if !wanted.is_skinned && has(|key| matches!(key, Checked::Valid(Semantic::Joints(_)))) {
        notices.add(place, "has joints, but its node has no skin, shown as it is");
    }
    let targets = primitive.targets.as_ref().map_or(0, Vec::len);
    if targets != wanted.morph_weights.len() && !wanted.morph_weights.is_empty() {
        notices.add(place, "has not one weight for each morph target, missing ones count as 0");
    }
}

/// Checks that the attributes to read have as many elements as there are positions, before they are
/// read: without data they could have any number.
fn check_counts(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    wanted: &Wanted<'_>,
    positions: Index<Accessor>,
) -> Result<(), SceneError> {
    // An index that points nowhere is told when it is read.
    let count = |id: &Index<Accessor>| document.root.accessors.get(id.value()).map(|a| a.count.0);
    for (semantic, id) in &primitive.attributes {
        let what = match semantic {
            Checked::Valid(Semantic::Normals) => "normals",
            Checked::Valid(Semantic::TexCoords(set))
                if wanted.tex_coords.is_some_and(|coords| coords.set == *set) =>
            {
                "texture coordinates"
            }
            Checked::Valid(Semantic::Colors(0)) if wanted.is_masked => "colours",
            Checked::Valid(Semantic::Joints(_)) if wanted.is_skinned => "joints",
            Checked::Valid(Semantic::Weights(_)) if wanted.is_skinned => "joint weights",
            _ => continue,
        };
        if let (Some(n), Some(found)) = (count(&positions), count(id))
            && found != n
        {
            return Err(document.invalid(place, format!("has {n} positions but {found} {what}")));
        }
    }
    Ok(())
}

/// The triangles of a primitive, all with the same winding, and all indices in range.
fn load_triangles(
    document: &Document,
    primitive: &Primitive,
    mode: Mode,
    place: &str,
    positions: &[Vec3],
    notices: &mut Notices,
) -> Result<Vec<[u32; 3]>, SceneError> {
    let count = positions.len();
    let place_of_indices = format!("{place}.indices");
    let indices = match primitive.indices {
        Some(id) => document.integers::<1>(id, &place_of_indices)?,
        None => {
            document.budget.take(place, count as u64, "indices", size_of::<u32>())?;
            (0..count as u32).map(|i| [i]).collect()
        }
    };
    let indices = indices.as_flattened();
    if mode == Mode::Triangles && indices.len() % 3 != 0 {
        notices.add(place, "the last triangle has fewer than three corners, left out");
    }
    if let Some(k) = indices.iter().position(|&i| i as usize >= count) {
        let problem = format!("index {k} is {}, there are {count} positions", indices[k]);
        return Err(document.invalid(&place_of_indices, problem));
    }
    let most = if mode == Mode::Triangles { indices.len() / 3 } else { indices.len() };
    document.budget.take(place, most as u64, "triangles", size_of::<[u32; 3]>())?;
    let mut triangles = triangles(mode, indices);
    // Triangles that use a vertex twice link strips and draw nothing, so their positions may be
    // anything.
    let is_finite = |&i: &u32| positions[i as usize].is_finite();
    triangles.retain(|t| {
        let [a, b, c] = *t;
        (a != b && b != c && c != a) || t.iter().all(is_finite)
    });
    Ok(triangles)
}

/// What a morph target moves.
#[derive(Clone, Copy)]
enum Moved {
    Positions,
    Normals,
}

/// Adds the displacements of a primitive's morph targets, by their weights.
fn morph(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    wanted: &Wanted<'_>,
    moved: Moved,
    values: &mut [Vec3],
) -> Result<(), SceneError> {
    let targets = primitive.targets.iter().flatten().zip(wanted.morph_weights).enumerate();
    for (k, (target, &weight)) in targets.filter(|(_, (_, weight))| **weight != 0.0) {
        let (id, name) = match moved {
            Moved::Positions => (target.positions, "POSITION"),
            Moved::Normals => (target.normals, "NORMAL"),
        };
        let Some(id) = id else { continue };
        let place = format!("{place}.targets[{k}].{name}");
        let (n, found) = (values.len(), document.get(id, &place)?.count.0);
        if found != n as u64 {
            let problem = format!("has {found} elements for {n} vertices");
            return Err(document.invalid(&place, problem));
        }
        let taken = document.budget.taken();
        let steps = vectors(document, id, &place)?;
        for (value, step) in values.iter_mut().zip(steps) {
            *value = (value.as_dvec3() + step.as_dvec3() * f64::from(weight)).as_vec3();
        }
        document.budget.give_back_to(taken);
    }
    Ok(())
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

/// The alpha of a primitive's vertices; empty if it does not matter or is 1 everywhere. The colours
/// themselves are not read.
fn load_alphas(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    wanted: &Wanted<'_>,
    notices: &mut Notices,
) -> Result<Vec<f32>, SceneError> {
    let Some(id) = attribute(primitive, Semantic::Colors(0)) else { return Ok(Vec::new()) };
    let place_of_colors = format!("{place}.attributes.COLOR_0");
    let has_alpha = document.get(id, &place_of_colors)?.type_ == Checked::Valid(Type::Vec4);
    if !(wanted.is_masked && has_alpha) {
        notices.add(place, "vertex colours are not shown");
        return Ok(Vec::new());
    }
    let colors = document.floats::<4>(id, &place_of_colors)?;
    if colors.iter().any(|[r, g, b, _]| [r, g, b].iter().any(|c| **c != 1.0)) {
        notices.add(place, "vertex colours are not shown, only their alpha is used");
    }
    let is_valid = |alpha: &f32| (0.0..=1.0).contains(alpha);
    let broken = colors.iter().filter(|[.., alpha]| !is_valid(alpha)).count();
    let told = "alphas of vertices are not within 0 and 1, the nearest value or 1 instead";
    notices.add_some(place_of_colors, broken, told);
    let alpha = |&[.., alpha]: &[f32; 4]| if alpha.is_nan() { 1.0 } else { alpha.clamp(0.0, 1.0) };
    let alphas: Vec<f32> = colors.iter().map(alpha).collect();
    Ok(if alphas.iter().all(|&a| a == 1.0) { Vec::new() } else { alphas })
}

/// The joints and weights of a primitive's vertices, set by set.
fn load_influences(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    notices: &mut Notices,
) -> Result<Vec<Influences>, SceneError> {
    let mut sets = Vec::new();
    for set in 0.. {
        let joints = attribute(primitive, Semantic::Joints(set));
        let weights = attribute(primitive, Semantic::Weights(set));
        match (joints, weights) {
            (Some(joints), Some(weights)) => {
                let place = |name: &str| format!("{place}.attributes.{name}_{set}");
                sets.push(Influences {
                    joints: document.integers::<4>(joints, &place("JOINTS"))?,
                    weights: document.floats::<4>(weights, &place("WEIGHTS"))?,
                });
            }
            (None, None) => break,
            _ => {
                let told = "has joints without weights or weights without joints, left out";
                notices.add(place, told);
            }
        }
    }
    Ok(sets)
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
fn area_normal(positions: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// Gives every triangle corners of its own, which have the triangle's normal.
fn shade_flat(loaded: &mut Loaded) {
    let mesh = &loaded.mesh;
    let normals = mesh.triangles.iter().flat_map(|&t| {
        let n = area_normal(&mesh.positions, t).normalize_or(DVec3::Y);
        [n.as_vec3(); 3]
    });
    let normals = normals.collect();
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|&i| i as usize).collect();
    loaded.take_vertices(&corners);
    let mesh = &mut loaded.mesh;
    mesh.normals = normals;
    for (k, t) in mesh.triangles.iter_mut().enumerate() {
        *t = [0, 1, 2].map(|c| 3 * k as u32 + c);
    }
}

/// Removes the vertices that no triangle uses, because files may let all primitives share one large
/// array, and because nothing need be right about them.
fn drop_unused_vertices(loaded: &mut Loaded, place: &str, notices: &mut Notices) {
    let mesh = &mut loaded.mesh;
    let mut new_index = vec![u32::MAX; mesh.positions.len()];
    for &i in mesh.triangles.iter().flatten() {
        new_index[i as usize] = 0;
    }
    let mut kept = Vec::new();
    let mut broken = 0;
    for (i, new_index) in new_index.iter_mut().enumerate() {
        if *new_index == 0 {
            *new_index = kept.len() as u32;
            kept.push(i);
        } else {
            broken += usize::from(!mesh.positions[i].is_finite());
        }
    }
    notices.add_some(place, broken, "positions that no triangle uses are not finite, left out");
    if kept.len() == mesh.positions.len() {
        return;
    }
    for i in mesh.triangles.iter_mut().flatten() {
        *i = new_index[*i as usize];
    }
    loaded.take_vertices(&kept);
}

impl Loaded {
    /// Replaces the vertices by those with the given indices, in that order. The triangles' indices
    /// are left alone.
    fn take_vertices(&mut self, indices: &[usize]) {
        let Self { mesh, influences } = self;
        take(&mut mesh.positions, indices);
        take(&mut mesh.normals, indices);
        take(&mut mesh.uvs, indices);
        take(&mut mesh.alphas, indices);
        for set in influences {
            take(&mut set.joints, indices);
            take(&mut set.weights, indices);
        }
    }
}

/// Replaces values by those with the given indices; leaves an empty list empty.
fn take<T: Copy>(values: &mut Vec<T>, indices: &[usize]) {
    if !values.is_empty() {
        *values = indices.iter().map(|&i| values[i]).collect();
    }
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
        let mut sums = vec![DVec3::ZERO; missing.len()];
        for &t in &mesh.triangles {
            let normal = area_normal(&mesh.positions, t);
            for i in t {
                sums[i as usize] += normal;
            }
        }
        for (i, _) in missing.iter().enumerate().filter(|(_, m)| **m) {
            mesh.normals[i] = sums[i].normalize_or(DVec3::Y).as_vec3();
        }
    }
    count
}
