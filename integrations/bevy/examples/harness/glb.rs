//! Binary glTF files as entities of Bevy, read by the crate `gltf`.
//!
//! `umbrage-scene` has a loader of its own. Pictures that agree with a truth traced in what that
//! one loads are a check of both.

use super::{Harness, triangles};
use bevy::prelude::*;
use gltf::accessor::{DataType, Dimensions};
use gltf::json::validation::{Error as Flaw, Validate};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// What was added to the app.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Added {
    /// Meshes with a place.
    pub(crate) instances: usize,
    /// Triangles of all instances.
    pub(crate) triangles: usize,
}

/// Adds the default scene of a .glb file, all in white, as a hierarchy like the file's. Only
/// triangles are read: no images, and skins, morphs and animations stay at rest.
///
/// # Errors
/// If the file cannot be read, is broken, or has no triangles.
pub(crate) fn add_glb(harness: &mut Harness, path: &Path, scale: f32) -> Result<Added, String> {
    let in_file = |problem: &dyn std::fmt::Display| format!("{}: {problem}", path.display());
    let bytes = std::fs::read(path).map_err(|e| in_file(&e))?;
    add(harness, &bytes, scale).map_err(|e| in_file(&e))
}

fn add(harness: &mut Harness, bytes: &[u8], scale: f32) -> Result<Added, String> {
    let file = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| e.to_string())?;
    validate(file.as_json())?;
    let blob = file.blob.as_deref().ok_or("has no binary chunk, must be a .glb file")?;
    let scene = file.default_scene().or_else(|| file.scenes().next());
    let scene = scene.ok_or("has no scene")?;

    let world = harness.app().world_mut();
    let root = world.spawn((Transform::from_scale(Vec3::splat(scale)), Visibility::default())).id();
    let mut added = Added::default();
    let mut meshes: HashMap<usize, Vec<(Handle<Mesh>, usize)>> = HashMap::new();
    let mut was_visited = vec![false; file.nodes().len()];
    let mut open: Vec<(gltf::Node, Entity)> = scene.nodes().map(|n| (n, root)).collect();
    while let Some((node, parent)) = open.pop() {
        if std::mem::replace(&mut was_visited[node.index()], true) {
            return Err(format!("nodes[{}] is in the scene twice", node.index()));
        }
        let world = harness.app().world_mut();
        let place = place(&node)?;
        let entity = world.spawn((place, Visibility::default(), ChildOf(parent))).id();
        if let Some(mesh) = node.mesh() {
            let known = match meshes.entry(mesh.index()) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => {
                    let mut assets = harness.app().world_mut().resource_mut::<Assets<Mesh>>();
                    let parts = parts(&mesh, blob)?.into_iter();
                    new.insert(parts.map(|(part, count)| (assets.add(part), count)).collect())
                }
            };
            for (part, count) in known {
                harness.add_instance(part.clone(), Transform::IDENTITY, Some(entity));
                added.instances += 1;
                added.triangles += *count;
            }
        }
        open.extend(node.children().map(|child| (child, entity)));
    }
    match added.triangles {
        0 => Err("the scene has no triangles".into()),
        _ => Ok(added),
    }
}

/// Checks what the crate's readers take for granted. Extensions that it does not know change
/// nothing that is read here, or leave the data missing, which is found later.
fn validate(root: &gltf::json::Root) -> Result<(), String> {
    let mut first = None;
    root.validate(root, gltf::json::Path::new, &mut |path, flaw| {
        if flaw != Flaw::Unsupported {
            first.get_or_insert_with(|| format!("{}: {flaw}", path()));
        }
    });
    first.map_or(Ok(()), Err)
}

fn place(node: &gltf::Node) -> Result<Transform, String> {
    let place = match node.transform() {
        gltf::scene::Transform::Matrix { matrix } => {
            Transform::from_matrix(Mat4::from_cols_array_2d(&matrix))
        }
        gltf::scene::Transform::Decomposed { translation, rotation, scale } => Transform {
            translation: translation.into(),
            rotation: Quat::from_array(rotation).normalize(),
            scale: scale.into(),
        },
    };
    match place.is_finite() {
        true => Ok(place),
        false => Err(format!("nodes[{}] has a transform that is not finite", node.index())),
    }
}

/// The triangles of a mesh's primitives, with their numbers.
fn parts(mesh: &gltf::Mesh, blob: &[u8]) -> Result<Vec<(Mesh, usize)>, String> {
    let mut parts = Vec::new();
    for primitive in mesh.primitives() {
        if primitive.mode() != gltf::mesh::Mode::Triangles {
            continue;
        }
        let place = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
        let part = part(&primitive, blob).map_err(|e| format!("{place}: {e}"))?;
        parts.extend(part);
    }
    Ok(parts)
}

/// The triangles of a primitive; `None` if it has no positions.
fn part(primitive: &gltf::Primitive, blob: &[u8]) -> Result<Option<(Mesh, usize)>, String> {
    let reader = primitive
        .reader(|buffer| matches!(buffer.source(), gltf::buffer::Source::Bin).then_some(blob));
    let vectors =
        |semantic: gltf::Semantic, name: &str| -> Result<Option<gltf::Accessor>, String> {
            let Some(accessor) = primitive.get(&semantic) else { return Ok(None) };
            match (accessor.dimensions(), accessor.data_type()) {
                (Dimensions::Vec3, DataType::F32) => {}
                _ => return Err(format!("{name} must be three floats each")),
            }
            check_count(&accessor, name, blob)?;
            Ok(Some(accessor))
        };
    if vectors(gltf::Semantic::Positions, "positions")?.is_none() {
        return Ok(None);
    }
    let outside = |name: &str| format!("{name} are not in the file's binary chunk");
    let positions: Vec<[f32; 3]> =
        reader.read_positions().ok_or_else(|| outside("positions"))?.collect();
    if positions.iter().flatten().any(|x| !x.is_finite()) {
        return Err("a position is not finite".into());
    }
    let normals: Option<Vec<[f32; 3]>> = match vectors(gltf::Semantic::Normals, "normals")? {
        Some(_) => Some(reader.read_normals().ok_or_else(|| outside("normals"))?.collect()),
        None => None,
    };
    if normals.as_ref().is_some_and(|n| n.len() != positions.len()) {
        return Err("there must be one normal for each position".into());
    }
    let mut indices: Vec<u32> = match primitive.indices() {
        Some(accessor) => {
            let is_index = accessor.dimensions() == Dimensions::Scalar
                && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
            if !is_index {
                return Err("indices must be unsigned whole numbers".into());
            }
            check_count(&accessor, "indices", blob)?;
            reader.read_indices().ok_or_else(|| outside("indices"))?.into_u32().collect()
        }
        None => (0..positions.len() as u32).collect(),
    };
    if let Some(index) = indices.iter().find(|i| **i as usize >= positions.len()) {
        return Err(format!("index {index} is beyond the {} positions", positions.len()));
    }
    indices.truncate(indices.len() / 3 * 3);
    let count = indices.len() / 3;
    Ok((count > 0).then(|| (triangles(positions, normals, indices), count)))
}

/// Each item takes bytes, so there cannot be more of them than bytes. The crate's readers multiply
/// the count without a check. Sparse accessors without data of their own may count anything.
fn check_count(accessor: &gltf::Accessor, name: &str, blob: &[u8]) -> Result<(), String> {
    match accessor.count() {
        0 => Err(format!("there are no {name}")),
        count if count > blob.len() => Err(format!("{count} {name} are more than the file holds")),
        _ => Ok(()),
    }
}
