//! Loads glTF 2.0 files.

mod accessor;
mod cameras_and_lights;
mod document;
mod hierarchy;
mod material;
mod primitive;
mod skin;
mod uri;

use crate::error::SceneError;
use crate::types::{Instance, Mesh, Scene};
use document::{Document, Notices};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf::json::{Index, Node};
use hierarchy::{Hierarchy, LARGEST};
use material::Materials;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage::Aabb;

/// Largest distance of a position from the origin, metres. The planner has the same limit.
const WORLD_END: f64 = 1e12;

/// Reads a scene from a `.gltf` or `.glb` file; the content tells which of the two it is.
///
/// The file's default scene is loaded in the pose that its nodes have: skins are applied,
/// animations are not played. It consists of triangles with base colour, `MASK` alpha and normals,
/// of cameras, and of the lights of `KHR_lights_punctual`. Each primitive is stored once and drawn
/// by instances, including those of `EXT_mesh_gpu_instancing`. Buffers and images are read from the
/// file itself, from data URIs, and from files below the scene's folder.
///
/// The following repairs are made, each with a notice in [`Scene::notices`]:
///
/// - Points and lines are left out.
/// - Missing normals are computed.
/// - Nodes whose transforms flatten their meshes are left out.
/// - Materials whose image is missing or invalid are plain.
/// - Translucent (`BLEND`) materials are solid where alpha is at least one half and absent
///   elsewhere.
/// - Spot light cones with half angles beyond 85° are narrowed to 85°.
///
/// Vertex colours and morph targets are not supported and are left out, also with a notice.
///
/// # Errors
/// The file cannot be read, is cut off, refers to files outside its folder, has indices out of
/// range, positions that are not finite, nodes that do not form trees, extensions that change its
/// geometry in unknown ways, or nothing to draw. The error names the place in the file.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    let bytes = document::read_file(path)?;
    let document = Document::parse(path, &bytes)?;
    let hierarchy = Hierarchy::of(&document)?;
    let mut loader = Loader {
        document: &document,
        hierarchy: &hierarchy,
        materials: Materials::default(),
        loaded: HashMap::new(),
        scene: Scene {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            ..Scene::default()
        },
        notices: Notices::default(),
    };
    for &node in &hierarchy.shown {
        loader.load_mesh(node)?;
    }
    let bounds = loader.check_drawn()?;
    for &node in &hierarchy.shown {
        loader.load_camera_and_light(node, bounds)?;
    }
    Ok(loader.finish())
}

/// The files that [`load`] reads for a scene: first the scene file, then the files that it refers
/// to, in a fixed order. Files that do not exist are left out.
///
/// # Errors
/// The scene file cannot be read or is not glTF 2.0.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let bytes = document::read_file(path)?;
    let mut files = vec![path.to_owned()];
    files.extend(Document::parse(path, &bytes)?.referred_files());
    Ok(files)
}

struct Loader<'a> {
    document: &'a Document<'a>,
    hierarchy: &'a Hierarchy,
    materials: Materials,
    /// For each glTF mesh that has been loaded, the indices of the scene meshes made from it.
    loaded: HashMap<usize, Vec<usize>>,
    scene: Scene,
    notices: Notices,
}

impl Loader<'_> {
    fn load_mesh(&mut self, index: usize) -> Result<(), SceneError> {
        let node = &self.document.root.nodes[index];
        let Some(mesh) = node.mesh else { return Ok(()) };
        let place = format!("nodes[{index}]");
        let morphs = node.weights.iter().flatten();
        if morphs
            .chain(self.document.get(mesh, &place)?.weights.iter().flatten())
            .any(|&w| w != 0.0)
        {
            self.notices.add(&place, "morph targets are not applied");
        }
        if let Some(skin) = node.skin {
            let joints = skin::joint_matrices(self.document, skin, self.hierarchy)?;
            return self.load_skinned(mesh, &joints);
        }
        let meshes = match self.loaded.get(&mesh.value()) {
            Some(found) => found.clone(),
            None => {
                let made = self.load_primitives(mesh, |_, _, _| Ok(()))?;
                self.loaded.insert(mesh.value(), made.clone());
                made
            }
        };
        let world_from_node = self.hierarchy.world_from_node[index];
        for node_from_copy in self.copies(node, &place)? {
            let world_from_mesh = world_from_node * node_from_copy;
            if is_flat(world_from_mesh.matrix3) {
                self.notices.add(&place, "its transform flattens its mesh, left out");
                continue;
            }
            let place = |&mesh: &usize| Instance { mesh, world_from_mesh };
            self.scene.instances.extend(meshes.iter().map(place));
        }
        Ok(())
    }

    /// Loads a skinned mesh. Each node that draws it gets a mesh of its own, because its shape
    /// depends on the node's pose.
    fn load_skinned(
        &mut self,
        mesh: Index<gltf::json::Mesh>,
        joints: &[DAffine3],
    ) -> Result<(), SceneError> {
        let mut origins = Vec::new();
        let document = self.document;
        let made = self.load_primitives(mesh, |this, mesh, (json, place)| {
            let world_from_mesh = match primitive::load_binding(document, json, place)? {
                Some(b) => skin::pose(document, mesh, &b, joints, place, &mut this.notices)?,
                None => {
                    this.notices
                        .add(place, "has a skin but no joints or weights, shown without the skin");
                    DAffine3::IDENTITY
                }
            };
            origins.push(world_from_mesh);
            Ok(())
        })?;
        let place = |(mesh, world_from_mesh)| Instance { mesh, world_from_mesh };
        self.scene.instances.extend(made.into_iter().zip(origins).map(place));
        Ok(())
    }

    /// Adds the primitives of a mesh to the scene, after `finish` was applied to each. Returns
    /// their indices.
    fn load_primitives(
        &mut self,
        mesh: Index<gltf::json::Mesh>,
        mut finish: impl FnMut(
            &mut Self,
            &mut Mesh,
            (&gltf::json::mesh::Primitive, &str),
        ) -> Result<(), SceneError>,
    ) -> Result<Vec<usize>, SceneError> {
        let document = self.document;
        let json = document.get(mesh, "nodes")?;
        let mut made = Vec::with_capacity(json.primitives.len());
        for (i, primitive) in json.primitives.iter().enumerate() {
            let place = format!("meshes[{}].primitives[{i}]", mesh.value());
            let (material, coords) =
                self.materials.load(document, primitive.material, &place, &mut self.notices)?;
            let loaded =
                primitive::load(document, primitive, &place, material, coords, &mut self.notices)?;
            if let Some(mut loaded) = loaded {
                finish(self, &mut loaded, (primitive, &place))?;
                primitive::drop_unused_vertices(&mut loaded);
                made.push(self.scene.meshes.len());
                self.scene.meshes.push(loaded);
            }
        }
        Ok(made)
    }

    /// The transforms at which a node draws its mesh, in the node's space: the identity alone, or
    /// those of `EXT_mesh_gpu_instancing`.
    fn copies(&self, node: &Node, place: &str) -> Result<Vec<DAffine3>, SceneError> {
        let extension =
            node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
        let Some(attributes) = extension.map(|e| &e["attributes"]) else {
            return Ok(vec![DAffine3::IDENTITY]);
        };
        let place = format!("{place}.extensions.EXT_mesh_gpu_instancing");
        let id = |name: &str| {
            let value = &attributes[name];
            let index = value.as_u64().and_then(|i| u32::try_from(i).ok()).map(Index::new);
            match index {
                None if !value.is_null() => Err(self
                    .document
                    .invalid(&place, format!("{name} must be an accessor's index"))),
                index => Ok(index),
            }
        };
        let vectors =
            |name: &str| id(name)?.map(|i| self.document.floats::<3>(i, &place)).transpose();
        let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
        let rotations =
            id("ROTATION")?.map(|i| self.document.floats::<4>(i, &place)).transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
        ];
        let Some(n) = counts.into_iter().flatten().next() else {
            // The extension has only custom attributes, so all of its copies coincide with the
            // node.
            return Ok(vec![DAffine3::IDENTITY]);
        };
        if counts.into_iter().flatten().any(|other| other != n) {
            return Err(self
                .document
                .invalid(&place, "its attributes have different numbers of elements"));
        }
        let vector = |values: &Option<Vec<[f32; 3]>>, i: usize, default| {
            values.as_ref().map_or(default, |v| DVec3::from(v[i].map(f64::from)))
        };
        let copy = |i: usize| {
            let rotation = rotations
                .as_ref()
                .map_or(DQuat::IDENTITY, |v| DQuat::from_array(v[i].map(f64::from)));
            let t = DAffine3::from_scale_rotation_translation(
                vector(&scales, i, DVec3::ONE),
                // A quaternion of zero length becomes non-finite here, and the transform is then
                // refused.
                rotation * (1.0 / rotation.length()),
                vector(&translations, i, DVec3::ZERO),
            );
            match t.is_finite() {
                true => Ok(t),
                false => Err(self
                    .document
                    .invalid(&place, format!("the transform of instance {i} is not finite"))),
            }
        };
        (0..n).map(copy).collect()
    }

    /// The box around the scene.
    ///
    /// # Errors
    /// The scene draws nothing, or extends beyond [`WORLD_END`].
    fn check_drawn(&self) -> Result<Aabb, SceneError> {
        let bounds = self.scene.bounds();
        if self.scene.drawn_triangles() == 0 {
            return Err(self.document.invalid("scene", "there are no triangles to draw"));
        }
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        if reach > WORLD_END {
            let problem = format!("reaches {reach:e} m from the origin, the world ends at 1e12 m");
            return Err(self.document.invalid("scene", problem));
        }
        Ok(bounds)
    }

    fn load_camera_and_light(&mut self, index: usize, bounds: Aabb) -> Result<(), SceneError> {
        let node = &self.document.root.nodes[index];
        let world = &self.hierarchy.world_from_node[index];
        let name = node.name.as_deref();
        if let Some(camera) = node.camera {
            let notices = &mut self.notices;
            let camera = cameras_and_lights::load_camera(
                self.document,
                camera,
                name,
                world,
                bounds,
                notices,
            )?;
            self.scene.cameras.extend(camera);
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            let (index, notices) = (light.light.value(), &mut self.notices);
            let light =
                cameras_and_lights::load_light(self.document, index, name, world, bounds, notices)?;
            self.scene.lights.extend(light);
        }
        Ok(())
    }

    fn finish(self) -> Scene {
        let mut scene = Scene {
            materials: self.materials.materials,
            textures: self.materials.textures,
            notices: self.notices.finish(),
            ..self.scene
        };
        for (i, camera) in scene.cameras.iter_mut().enumerate() {
            name_if_empty(&mut camera.name, "camera", i);
        }
        for (i, light) in scene.lights.iter_mut().enumerate() {
            name_if_empty(&mut light.name, "light", i);
        }
        scene
    }
}

fn name_if_empty(name: &mut String, kind: &str, index: usize) {
    if name.is_empty() {
        *name = format!("{kind}{index}");
    }
}

/// Whether a transform is singular, exactly or as far as rounding can tell.
fn is_flat(m: DMat3) -> bool {
    let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let is_usable = |inverse: DMat3| inverse.to_cols_array().iter().all(|c| c.abs() <= LARGEST);
    m.determinant().abs() <= 1e-9 * lengths || !is_usable(m.inverse())
}
