use super::document::{Document, Notices};
use super::material::TexCoords;
use crate::animation::{Influences, Target, displace};
use crate::error::SceneError;
use crate::normals;
use crate::types::Mesh;
use glam::{Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
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
    /// Whether morph targets are kept, because their weights change. The mesh is then not morphed.
    pub(super) keeps_targets: bool,
    pub(super) is_skinned: bool,
}

/// The triangles of a primitive, and what deforms them.
pub(super) struct Loaded {
    pub(super) mesh: Mesh,
    /// One for each of the sets `JOINTS_0`, `JOINTS_1`, …; empty if the mesh is not skinned.
    pub(super) influences: Vec<Influences>,
    /// The morph targets that are kept.
    pub(super) targets: Vec<Target>,
    /// Whether each triangle has corners of its own, with its own normal.
    pub(super) is_flat: bool,
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
    if !wanted.keeps_targets {
        morph(document, primitive, place, wanted, Moved::Positions, &mut positions)?;
    }
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
    if !(normals.is_empty() || wanted.keeps_targets) {
        morph(document, primitive, place, wanted, Moved::Normals, &mut normals)?;
    }
    let targets = match wanted.keeps_targets {
        true => load_targets(document, primitive, place, positions.len(), !normals.is_empty())?,
        false => Vec::new(),
    };
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
    let is_flat = mesh.normals.is_empty();
    let mut loaded = Loaded { mesh, influences, targets, is_flat };
    drop_unused_vertices(&mut loaded, place, notices);
    let mesh = &mut loaded.mesh;
    if is_flat {
        notices.add(place, "has no normals, shaded flat");
        let corners = 3 * mesh.triangles.len() as u64;
        let bytes = BYTES_PER_CORNER + loaded.targets.len() * size_of::<Vec3>();
        document.budget.take(place, corners, "corners", bytes)?;
        shade_flat(&mut loaded);
    } else {
        let repaired = normals::repair(mesh);
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
        let taken = document.budget.taken();
        let steps = load_steps(document, target, place, k, moved, values.len())?;
        displace(values, &steps, weight);
        document.budget.give_back_to(taken);
    }
    Ok(())
}

/// The displacements of morph target `k`, one for each of `vertices`; none if it moves nothing.
fn load_steps(
    document: &Document,
    target: &MorphTarget,
    place: &str,
    k: usize,
    moved: Moved,
    vertices: usize,
) -> Result<Vec<Vec3>, SceneError> {
    let (id, name) = match moved {
        Moved::Positions => (target.positions, "POSITION"),
        Moved::Normals => (target.normals, "NORMAL"),
    };
    let Some(id) = id else { return Ok(Vec::new()) };
    let place = format!("{place}.targets[{k}].{name}");
    let found = document.get(id, &place)?.count.0;
    if found != vertices as u64 {
        let problem = format!("has {found} elements for {vertices} vertices");
        return Err(document.invalid(&place, problem));
    }
    vectors(document, id, &place)
}

/// All morph targets of a primitive.
fn load_targets(
    document: &Document,
    primitive: &Primitive,
    place: &str,
    vertices: usize,
    has_normals: bool,
) -> Result<Vec<Target>, SceneError> {
    let target = |(k, target)| {
        let steps = |moved| load_steps(document, target, place, k, moved, vertices);
        let normals = if has_normals { steps(Moved::Normals)? } else { Vec::new() };
        Ok(Target { positions: steps(Moved::Positions)?, normals })
    };
    primitive.targets.iter().flatten().enumerate().map(target).collect()
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

/// Gives every triangle corners of its own, which have the triangle's normal.
fn shade_flat(loaded: &mut Loaded) {
    let corners = loaded.mesh.triangles.iter().flatten().map(|&i| i as usize);
    let corners: Vec<usize> = corners.collect();
    loaded.take_vertices(&corners);
    let mesh = &mut loaded.mesh;
    for (k, t) in mesh.triangles.iter_mut().enumerate() {
        *t = [0, 1, 2].map(|c| 3 * k as u32 + c);
    }
    mesh.normals = vec![Vec3::ZERO; corners.len()];
    normals::flatten(mesh);
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
        let Self { mesh, influences, targets, .. } = self;
        take(&mut mesh.positions, indices);
        take(&mut mesh.normals, indices);
        take(&mut mesh.uvs, indices);
        take(&mut mesh.alphas, indices);
        for set in influences {
            take(&mut set.joints, indices);
            take(&mut set.weights, indices);
        }
        for target in targets {
            take(&mut target.positions, indices);
            take(&mut target.normals, indices);
        }
    }
}

/// Replaces values by those with the given indices; leaves an empty list empty.
fn take<T: Copy>(values: &mut Vec<T>, indices: &[usize]) {
    if !values.is_empty() {
        *values = indices.iter().map(|&i| values[i]).collect();
    }
}
