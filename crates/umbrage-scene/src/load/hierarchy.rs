use super::document::{Document, Notices};
use crate::animation::{LARGEST, Local};
use crate::error::SceneError;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::Index;

/// Largest distance of a matrix's last row from 0, 0, 0, 1. Exporters that multiply matrices in
/// single precision leave such dust.
const DUST: f64 = 1e-4;

/// The world transforms of a file's nodes, and which nodes show.
pub(super) struct Hierarchy {
    /// Indexed by node; all finite.
    pub(super) world_from_node: Vec<DAffine3>,
    /// Indexed by node: whether `KHR_node_visibility` hides the node, directly or with a node above
    /// it. Hidden nodes have neither meshes nor lights, but they have cameras.
    pub(super) is_hidden: Vec<bool>,
    /// Indices of the nodes in the shown scene, each once, with parents before their children.
    pub(super) shown: Vec<usize>,
    /// Indices of all nodes, with parents before their children.
    pub(super) order: Vec<usize>,
    /// The parent of each node, indexed by node.
    pub(super) parent: Vec<Option<usize>>,
}

impl Hierarchy {
    /// Computes the transforms of all nodes.
    ///
    /// # Errors
    /// A node has two parents or is its own ancestor, or its transform or visibility is invalid.
    pub(super) fn of(document: &Document, notices: &mut Notices) -> Result<Self, SceneError> {
        let nodes = &document.root.nodes;
        document.budget.take("nodes", nodes.len() as u64, "nodes", size_of::<DAffine3>())?;
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
        let mut is_hidden = vec![false; nodes.len()];
        let mut order = Vec::with_capacity(nodes.len());
        let roots = || (0..nodes.len()).filter(|&i| parent[i].is_none());
        let mut open: Vec<usize> = roots().collect();
        while let Some(i) = open.pop() {
            order.push(i);
            let above = parent[i].map_or(DAffine3::IDENTITY, |p| world_from_node[p]);
            let world = above * local(document, i, notices)?.affine();
            if world.to_cols_array().iter().any(|c| !c.is_finite() || c.abs() > LARGEST) {
                return Err(document.invalid(&format!("nodes[{i}]"), "its transform overflows"));
            }
            world_from_node[i] = world;
            is_hidden[i] = hides_itself(document, i)? || parent[i].is_some_and(|p| is_hidden[p]);
            open.extend(children(i));
        }
        if order.len() < nodes.len() {
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
        Ok(Self { world_from_node, is_hidden, shown, order, parent })
    }
}

/// Whether a node is hidden by its own `KHR_node_visibility`.
fn hides_itself(document: &Document, i: usize) -> Result<bool, SceneError> {
    let extensions = document.root.nodes[i].extensions.as_ref();
    let visible = extensions.and_then(|e| e.others.get("KHR_node_visibility")?.get("visible"));
    let Some(visible) = visible else { return Ok(false) };
    let place = || format!("nodes[{i}].extensions.KHR_node_visibility.visible");
    let invalid = || document.invalid(&place(), "must be true or false");
    visible.as_bool().map(|visible| !visible).ok_or_else(invalid)
}

/// The affine transform that a file's matrix stands for.
///
/// # Errors
/// An entry is not finite, or the last row is not 0, 0, 0, 1 up to rounding.
pub(super) fn affine(
    document: &Document,
    matrix: [f32; 16],
    place: &str,
    notices: &mut Notices,
) -> Result<DAffine3, SceneError> {
    let m = DMat4::from_cols_array(&matrix.map(f64::from));
    if !m.is_finite() {
        return Err(document.invalid(place, "has entries that are not finite"));
    }
    let dust = m.row(3).distance(glam::DVec4::W);
    if dust > DUST {
        return Err(document.invalid(place, "is not affine: its last row must be 0, 0, 0, 1"));
    }
    if dust > 0.0 {
        notices.add(place, "its last row is off by rounding, 0, 0, 0, 1 instead");
    }
    Ok(DAffine3::from_mat4(m))
}

/// A node's transform in its parent's space.
///
/// # Errors
/// It is not finite, or its rotation is none.
pub(super) fn local(
    document: &Document,
    i: usize,
    notices: &mut Notices,
) -> Result<Local, SceneError> {
    let node = &document.root.nodes[i];
    let fail =
        |field: &str, problem: &str| Err(document.invalid(&format!("nodes[{i}].{field}"), problem));
    if let Some(m) = node.matrix {
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            let told = "has a matrix beside translation, rotation or scale, the matrix counts";
            notices.add(format!("nodes[{i}]"), told);
        }
        let matrix = affine(document, m, &format!("nodes[{i}].matrix"), notices)?;
        return Ok(Local::Matrix(matrix));
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
    if (rotation.length() - 1.0).abs() > DUST {
        let place = format!("nodes[{i}].rotation");
        notices.add(place, "is no unit quaternion, its direction counts");
    }
    Ok(Local::Parts { translation, rotation: rotation.normalize(), scale })
}
