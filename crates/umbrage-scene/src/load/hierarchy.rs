use super::document::Document;
use crate::error::SceneError;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::Index;

/// Largest magnitude of an entry of a transform. Larger entries count as overflow, although
/// products with positions overflow only much later.
pub(super) const LARGEST: f64 = 1e100;

/// The world transforms of a file's nodes.
pub(super) struct Hierarchy {
    /// Indexed by node; all finite.
    pub(super) world_from_node: Vec<DAffine3>,
    /// Indices of the nodes in the shown scene, each once, with parents before their children.
    pub(super) shown: Vec<usize>,
    /// The parent of each node, indexed by node.
    pub(super) parent: Vec<Option<usize>>,
}

impl Hierarchy {
    /// Computes the transforms of all nodes.
    ///
    /// # Errors
    /// A node has two parents or is its own ancestor, or its transform is invalid.
    pub(super) fn of(document: &Document) -> Result<Self, SceneError> {
        let nodes = &document.root.nodes;
        let children = |i: usize| nodes[i].children.iter().flatten().map(Index::value);
        let mut parent = vec![None; nodes.len()];
        for i in 0..nodes.len() {
            for child in children(i) {
                let place = || format!("nodes[{i}].children");
                let slot = parent.get_mut(child).ok_or_else(|| {
                    document.invalid(&place(), format!("there is no nodes[{child}]"))
                })?;
                if let Some(other) = slot.replace(i) {
                    let problem = format!("nodes[{child}] already is a child of nodes[{other}]");
                    return Err(document.invalid(&place(), problem));
                }
            }
        }
        let mut world_from_node = vec![DAffine3::IDENTITY; nodes.len()];
        let mut reached = 0;
        let roots = || (0..nodes.len()).filter(|&i| parent[i].is_none());
        let mut open: Vec<usize> = roots().collect();
        while let Some(i) = open.pop() {
            reached += 1;
            let above = parent[i].map_or(DAffine3::IDENTITY, |p| world_from_node[p]);
            let world = above * local(document, i)?;
            if world.to_cols_array().iter().any(|c| !c.is_finite() || c.abs() > LARGEST) {
                return Err(document.invalid(&format!("nodes[{i}]"), "its transform overflows"));
            }
            world_from_node[i] = world;
            open.extend(children(i));
        }
        if reached < nodes.len() {
            return Err(document.invalid("nodes", "some are among their own ancestors"));
        }

        let scene = match document.root.scene {
            Some(index) => Some(document.get(index, "scene")?),
            None => document.root.scenes.first(),
        };
        let mut open: Vec<usize> = match scene {
            None => roots().collect(),
            Some(scene) => scene.nodes.iter().map(Index::value).collect(),
        };
        open.reverse();
        let mut seen = vec![false; nodes.len()];
        let mut shown = Vec::new();
        while let Some(i) = open.pop() {
            let slot = seen
                .get_mut(i)
                .ok_or_else(|| document.invalid("scenes", format!("there is no nodes[{i}]")))?;
            if !std::mem::replace(slot, true) {
                shown.push(i);
                let first = open.len();
                open.extend(children(i));
                open[first..].reverse();
            }
        }
        Ok(Self { world_from_node, shown, parent })
    }
}

fn local(document: &Document, i: usize) -> Result<DAffine3, SceneError> {
    let node = &document.root.nodes[i];
    let fail =
        |field: &str, problem: &str| Err(document.invalid(&format!("nodes[{i}].{field}"), problem));
    if let Some(m) = node.matrix {
        let m = DMat4::from_cols_array(&m.map(f64::from));
        if !m.is_finite() {
            return fail("matrix", "has entries that are not finite");
        }
        if m.row(3).distance(glam::DVec4::W) > 1e-6 {
            return fail("matrix", "is not affine: its last row must be 0, 0, 0, 1");
        }
        return Ok(DAffine3::from_mat4(m));
    }
    let vector =
        |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
    let translation = vector(node.translation, DVec3::ZERO);
    let scale = vector(node.scale, DVec3::ONE);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(f64::from)));
    if !translation.is_finite() {
        return fail("translation", "is not finite");
    }
    if !scale.is_finite() {
        return fail("scale", "is not finite");
    }
    if !(rotation.is_finite() && rotation.length() > 1e-6) {
        return fail("rotation", "is no rotation: it must be a unit quaternion");
    }
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}
