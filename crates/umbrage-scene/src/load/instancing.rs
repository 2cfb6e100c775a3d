//! The copies of a mesh that `EXT_mesh_gpu_instancing` draws.

use super::document::Document;
use crate::error::SceneError;
use crate::types::Instance;
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Value;
use gltf::json::{Accessor, Index, Node};

/// Where the copies of a node's mesh are.
pub(super) struct Copies {
    /// Place of the extension, for errors.
    place: String,
    len: usize,
    /// Each has `len` elements.
    translations: Option<Vec<[f32; 3]>>,
    rotations: Option<Vec<[f32; 4]>>,
    scales: Option<Vec<[f32; 3]>>,
}

impl Copies {
    /// The copies of a node's mesh; `None` if it is drawn once. The memory of `instances` instances
    /// for each copy is taken from the budget before anything is read.
    ///
    /// # Errors
    /// An attribute is no accessor's index, or the accessor is invalid, or there are too many
    /// instances.
    pub(super) fn of(
        document: &Document,
        node: &Node,
        place: &str,
        instances: usize,
    ) -> Result<Option<Self>, SceneError> {
        const NAME: &str = "EXT_mesh_gpu_instancing";
        let extension = node.extensions.as_ref().and_then(|e| e.others.get(NAME));
        let Some(attributes) = extension.map(|e| &e["attributes"]) else { return Ok(None) };
        let place = format!("{place}.extensions.{NAME}");
        let id = |name: &str| accessor(document, attributes, name, &place);
        let [translation, rotation, scale] = [id("TRANSLATION")?, id("ROTATION")?, id("SCALE")?];
        let Some(any) = translation.or(rotation).or(scale) else {
            // The extension has only custom attributes, so all of its copies coincide with the
            // node.
            return Ok(None);
        };
        let len = document.get(any, &place)?.count.0;
        let count = len.saturating_mul(instances as u64);
        document.budget.take(&place, count, "instances", size_of::<Instance>())?;
        let vectors = |id: Option<_>| id.map(|i| document.floats::<3>(i, &place)).transpose();
        let copies = Self {
            len: len as usize,
            translations: vectors(translation)?,
            rotations: rotation.map(|i| document.floats::<4>(i, &place)).transpose()?,
            scales: vectors(scale)?,
            place,
        };
        let lengths = [
            copies.translations.as_ref().map(Vec::len),
            copies.rotations.as_ref().map(Vec::len),
            copies.scales.as_ref().map(Vec::len),
        ];
        if lengths.into_iter().flatten().any(|other| other != copies.len) {
            let problem = "its attributes have different numbers of elements";
            return Err(document.invalid(&copies.place, problem));
        }
        Ok(Some(copies))
    }

    pub(super) fn len(&self) -> usize {
        self.len
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

/// The accessor of an attribute; `None` if there is no such attribute.
fn accessor(
    document: &Document,
    attributes: &Value,
    name: &str,
    place: &str,
) -> Result<Option<Index<Accessor>>, SceneError> {
    let value = &attributes[name];
    let index = value.as_u64().and_then(|i| u32::try_from(i).ok()).map(Index::new);
    if index.is_none() && !value.is_null() {
        return Err(document.invalid(place, format!("{name} must be an accessor's index")));
    }
    Ok(index)
}
