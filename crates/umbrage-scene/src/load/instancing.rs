//! The copies of a mesh that `EXT_mesh_gpu_instancing` draws.

use super::document::Document;
use crate::error::SceneError;
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Value;
use gltf::json::{Accessor, Index, Node};

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Where the copies of a node's mesh are.
pub(super) struct Copies {
    /// Place of the extension, for errors.
    place: String,
    /// All that there are have the same number of elements.
    translations: Option<Vec<[f32; 3]>>,
    rotations: Option<Vec<[f32; 4]>>,
    scales: Option<Vec<[f32; 3]>>,
}

/// The accessors of a node's copies.
struct Accessors {
    translation: Option<Index<Accessor>>,
    rotation: Option<Index<Accessor>>,
    scale: Option<Index<Accessor>>,
}

impl Copies {
    /// How many copies a node draws; `None` if it draws its mesh once, where it is. That is also
    /// the case if the extension has only custom attributes, so that all copies coincide.
    ///
    /// # Errors
    /// An attribute is no accessor's index.
    pub(super) fn count(
        document: &Document,
        node: &Node,
        place: &str,
    ) -> Result<Option<u64>, SceneError> {
        let Accessors { translation, rotation, scale } = accessors(document, node, place)?;
        let any = translation.or(rotation).or(scale);
        any.map(|id| Ok(document.get(id, place)?.count.0)).transpose()
    }

    /// The copies of a node, of which there are `len`.
    ///
    /// # Errors
    /// An accessor is invalid, has another length or is too large.
    pub(super) fn load(
        document: &Document,
        node: &Node,
        place: &str,
        len: usize,
    ) -> Result<Self, SceneError> {
        let Accessors { translation, rotation, scale } = accessors(document, node, place)?;
        let place = format!("{place}.extensions.{NAME}");
        for id in [translation, rotation, scale].into_iter().flatten() {
            if document.get(id, &place)?.count.0 != len as u64 {
                let problem = "its attributes have different numbers of elements";
                return Err(document.invalid(&place, problem));
            }
        }
        let vectors = |id: Option<_>| id.map(|i| document.floats::<3>(i, &place)).transpose();
        let translations = vectors(translation)?;
        let rotations = rotation.map(|i| document.floats::<4>(i, &place)).transpose()?;
        let scales = vectors(scale)?;
        Ok(Self { place, translations, rotations, scales })
    }

    /// The transform of copy `i` to the node's space.
    ///
    /// # Errors
    /// It is not finite.
    pub(super) fn node_from_copy(
        &self,
        document: &Document,
        i: usize,
    ) -> Result<DAffine3, SceneError> {
        let vector = |values: &Option<Vec<[f32; 3]>>, default| {
            values.as_ref().map_or(default, |v| DVec3::from(v[i].map(f64::from)))
        };
        let rotations = self.rotations.as_ref();
        let rotation =
            rotations.map_or(DQuat::IDENTITY, |v| DQuat::from_array(v[i].map(f64::from)));
        let t = DAffine3::from_scale_rotation_translation(
            vector(&self.scales, DVec3::ONE),
            // A quaternion of zero length becomes non-finite here, and the transform is then
            // refused.
            rotation * (1.0 / rotation.length()),
            vector(&self.translations, DVec3::ZERO),
        );
        if !t.is_finite() {
            let problem = format!("the transform of instance {i} is not finite");
            return Err(document.invalid(&self.place, problem));
        }
        Ok(t)
    }
}

fn accessors(document: &Document, node: &Node, place: &str) -> Result<Accessors, SceneError> {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get(NAME));
    let id = |name: &str| {
        let value = extension.map_or(&Value::Null, |e| &e["attributes"][name]);
        let index = value.as_u64().and_then(|i| u32::try_from(i).ok()).map(Index::new);
        if index.is_none() && !value.is_null() {
            let place = format!("{place}.extensions.{NAME}");
            return Err(document.invalid(&place, format!("{name} must be an accessor's index")));
        }
        Ok(index)
    };
    Ok(Accessors {
        translation: id("TRANSLATION")?,
        rotation: id("ROTATION")?,
        scale: id("SCALE")?,
    })
}
