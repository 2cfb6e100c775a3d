//! Loads the meshes that nodes draw, and places them.

use super::Loader;
use super::instancing::Copies;
use super::primitive::{self, Loaded, Wanted};
use super::skin;
use crate::animation::{self, ABSENT, Anchor, Carried, Deformed, Deformer, Joint, Place, Shape};
use crate::error::SceneError;
use crate::types::{Alpha, Instance, Mesh};
use glam::{DAffine3, DVec3};
use gltf::json::Index;

/// What an instance counts, bytes. It takes a fifth of that itself, and twice as much more if an
/// animation moves it. A few bytes of a file can make any number of instances, and whoever draws or
/// traces them keeps more for each, so what these need counts too.
const INSTANCE_BYTES: usize = 512;

/// What deforms the primitives of a mesh where a node draws it.
struct Deforming<'a> {
    /// Weights of the morph targets at rest; those that are missing count as 0.
    weights: &'a [f32],
    /// Index in the animations' morphs, if a clip changes the weights.
    morph: Option<usize>,
    /// The skin's joints, if the node has a skin.
    joints: Option<&'a [Joint]>,
    /// The skin's index in the file.
    skin: usize,
}

/// A primitive of a mesh where a node draws it.
#[derive(Clone, Copy)]
pub(super) struct Made {
    /// Index of the scene's mesh.
    mesh: usize,
    /// The mesh's largest coordinate, metres.
    reach: f64,
    /// The translation from the mesh's space to the world, if a skin places the mesh.
    posed: Option<DVec3>,
    /// Index of what deforms the mesh, if a clip does.
    deformed: Option<usize>,
}

impl Loader<'_> {
    /// Loads a node's mesh.
    pub(super) fn load_mesh(&mut self, index: usize) -> Result<(), SceneError> {
        let document = self.document;
        let node = &document.root.nodes[index];
        let Some(mesh) = node.mesh.filter(|_| !self.hierarchy.is_hidden[index]) else {
            return Ok(());
        };
        let place = format!("nodes[{index}]");
        let json = document.get(mesh, &place)?;
        let weights = node.weights.as_ref().or(json.weights.as_ref());
        let weights = weights.map_or(&[][..], Vec::as_slice);
        let morph = self.rigging.morph(index);
        if let Some(skin) = node.skin {
            let taken = document.budget.taken();
            let joints = skin::joints(document, skin, &self.rigging, &mut self.notices)?;
            document.budget.give_back_to(taken);
            if Copies::count(document, node, &place)?.is_some() {
                self.notices
                    .add(&place, "instances of a skinned mesh are not supported, drawn once");
            }
            let deforming = Deforming { weights, morph, joints: Some(&joints), skin: skin.value() };
            let made = self.load_primitives(mesh, &deforming)?;
            self.grow_instances(&place, made.len() as u64)?;
            for made in made {
                // Without joints of its own, a primitive stays where it is.
                let unmoved =
                    Place { anchor: Anchor::Fixed(DAffine3::IDENTITY), node_from_copy: None };
                let stands = made.posed.is_none().then_some(unmoved);
                let origin = made.posed.unwrap_or(DVec3::ZERO);
                self.add_instance(made, DAffine3::from_translation(origin), stands, &place);
            }
            return Ok(());
        }
        let deforming = Deforming { weights, morph, joints: None, skin: 0 };
        let key = (mesh.value(), weights.iter().map(|w| w.to_bits()).collect());
        let made = match self.loaded.get(&key) {
            // Weights that change are the node's own.
            Some(found) if morph.is_none() => found.clone(),
            _ => {
                let made = self.load_primitives(mesh, &deforming)?;
                if morph.is_none() {
                    self.loaded.insert(key, made.clone());
                }
                made
            }
        };
        let count = Copies::count(document, node, &place)?;
        self.grow_instances(&place, count.unwrap_or(1).saturating_mul(made.len() as u64))?;
        let taken = document.budget.taken();
        let load = |count| Copies::load(document, node, &place, count as usize);
        let copies = count.map(load).transpose()?;
        let anchor = self.rigging.anchor_of(index);
        for i in 0..count.unwrap_or(1) as usize {
            let copies = copies.as_ref();
            let node_from_copy = copies.map(|c| c.node_from_copy(document, i)).transpose()?;
            let stands = Place { anchor, node_from_copy };
            let world_from_mesh = stands.world(&self.rigging.animations.nodes);
            for &made in &made {
                self.add_instance(made, world_from_mesh, Some(stands), &place);
            }
        }
        document.budget.give_back_to(taken);
        Ok(())
    }

    fn grow_instances(&mut self, place: &str, more: u64) -> Result<(), SceneError> {
        let list = &mut self.scene.instances;
        self.document.budget.grow(place, list, more, "instances", INSTANCE_BYTES)
    }

    /// Adds an instance. If its transform is flat, it is left out, or absent if a clip moves it.
    fn add_instance(
        &mut self,
        made: Made,
        world_from_mesh: DAffine3,
        stands: Option<Place>,
        place: &str,
    ) {
        let Made { mesh, reach, deformed, .. } = made;
        let instance = self.scene.instances.len();
        let is_carried =
            deformed.is_some() || stands.is_some_and(|s| matches!(s.anchor, Anchor::Moving(_)));
        if !is_carried {
            if animation::is_flat(world_from_mesh.matrix3) {
                self.notices.add(place, "its transform flattens its mesh, left out");
                return;
            }
            self.scene.instances.push(Instance { mesh, world_from_mesh });
            return;
        }
        let shape = deformed.map_or(Shape::Rigid { reach }, Shape::Deformed);
        let carried = Carried { instance, place: stands, shape };
        let world = self.rigging.animations.world_from_mesh(&carried);
        let world_from_mesh = world.unwrap_or(ABSENT);
        self.scene.instances.push(Instance { mesh, world_from_mesh });
        self.scene.roles.set_absent(instance, world.is_none());
        self.rigging.animations.carried.push(carried);
    }

    /// Adds the primitives of a mesh to the scene, deformed as they are at rest. A mesh is loaded
    /// for each node that draws it with a skin, because its shape depends on the pose.
    fn load_primitives(
        &mut self,
        mesh: Index<gltf::json::Mesh>,
        deforming: &Deforming<'_>,
    ) -> Result<Vec<Made>, SceneError> {
        let document = self.document;
        let json = document.get(mesh, "nodes")?;
        let mut made = Vec::with_capacity(json.primitives.len());
        for (i, primitive) in json.primitives.iter().enumerate() {
            let place = format!("meshes[{}].primitives[{i}]", mesh.value());
            let (material, tex_coords) =
                self.materials.load(document, primitive.material, &place, &mut self.notices)?;
            let wanted = Wanted {
                material,
                tex_coords,
                is_masked: self.materials.materials[material].alpha != Alpha::Opaque,
                morph_weights: deforming.weights,
                keeps_targets: deforming.morph.is_some(),
                is_skinned: deforming.joints.is_some(),
            };
            let taken = document.budget.taken();
            let loaded = primitive::load(document, primitive, &place, &wanted, &mut self.notices)?;
            document.budget.give_back_to(taken);
            let Some(loaded) = loaded else { continue };
            document.budget.take(&place, 1, "mesh", loaded.mesh.bytes())?;
            let list = &mut self.scene.meshes;
            document.budget.grow(&place, list, 1, "meshes", size_of::<Mesh>())?;
            made.push(self.deform(loaded, deforming, &place)?);
        }
        Ok(made)
    }

    /// Adds a primitive to the scene's meshes, deformed as it is at rest.
    fn deform(
        &mut self,
        loaded: Loaded,
        deforming: &Deforming<'_>,
        place: &str,
    ) -> Result<Made, SceneError> {
        let document = self.document;
        let Loaded { mut mesh, influences, targets, is_flat } = loaded;
        let joints = match deforming.joints {
            Some(joints) if !influences.is_empty() => {
                let (vertices, count) = (mesh.positions.len(), joints.len());
                skin::check(document, &influences, vertices, count, place, &mut self.notices)?;
                Some(joints)
            }
            Some(_) => {
                self.notices
                    .add(place, "has a skin but no joints or weights, shown without the skin");
                None
            }
            None => None,
        };
        let index = self.scene.meshes.len();
        let is_moved = |joint: &Joint| matches!(joint.anchor, Anchor::Moving(_));
        let is_deformed = !targets.is_empty() || joints.is_some_and(|j| j.iter().any(is_moved));
        let world_from_bind = joints.map(|joints| self.rigging.world_from_bind(joints));
        let world_from_bind = world_from_bind.unwrap_or_default();
        let out_of_range = || document.invalid(place, "the pose moves a vertex out of range");
        let mut made = Made { mesh: index, reach: 0.0, posed: None, deformed: None };
        if is_deformed {
            let vertices = mesh.positions.len();
            let bytes = Deformer::bytes(vertices, &targets, influences.len());
            document.budget.take(place, 1, "deformed mesh", bytes + size_of::<Deformed>())?;
            let keep = |joints| self.rigging.keep_skin(document, deforming.skin, joints, place);
            let skin = joints.map(keep).transpose()?;
            let deformer = Deformer::new(&mesh, targets, is_flat, influences);
            let origin = deformer.deform(&mut mesh, deforming.weights, &world_from_bind);
            let origin = Some(origin.ok_or_else(out_of_range)?);
            let (morph, reach) = (deforming.morph, mesh.reach());
            let deformed =
                Deformed { mesh: index, deformer, morph, skin, origin, reach, is_moved: false };
            made.deformed = Some(self.rigging.animations.deformed.len());
            made.posed = origin.filter(|_| joints.is_some());
            self.rigging.animations.deformed.push(deformed);
        } else if joints.is_some() {
            let origin = animation::skin(&mut mesh, &influences, &world_from_bind);
            made.posed = Some(origin.ok_or_else(out_of_range)?);
        }
        made.reach = mesh.reach();
        self.scene.meshes.push(mesh);
        Ok(made)
    }
}
