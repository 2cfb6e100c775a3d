//! Loads glTF 2.0 files.

mod accessor;
mod budget;
mod cameras_and_lights;
mod document;
mod extensions;
mod hierarchy;
mod instancing;
mod material;
mod primitive;
mod skin;
mod uri;

use crate::error::SceneError;
use crate::nodes::SceneNode;
use crate::sky;
use crate::types::{Alpha, Instance, Mesh, Scene};
use budget::Budget;
use document::{Document, Notices};
use glam::{DAffine3, DMat3};
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;
use hierarchy::{Hierarchy, LARGEST};
use instancing::Copies;
use material::Materials;
use primitive::Wanted;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use umbrage::Aabb;

/// Largest distance of a position from the origin, metres. The planner has the same limit.
const WORLD_END: f64 = 1e12;

/// The memory that [`load`] lets a scene take, bytes: 2 GiB. That is enough for four million
/// instances, some twenty million triangles, or an image of 16 384 × 16 384 pixels and as much
/// again.
pub const SCENE_BYTES: u64 = 2 << 30;

/// What an instance counts, bytes. It takes a fifth of that itself. A few bytes of a file can make
/// any number of instances, and whoever draws or traces them keeps more for each, so what these
/// need counts too.
const INSTANCE_BYTES: usize = 512;

/// Reads a scene from a `.gltf` or `.glb` file; the content tells which of the two it is.
///
/// The file's default scene is loaded in the pose that its nodes have: skins and the default
/// weights of morph targets are applied, animations are not played. It consists of triangles with
/// base colour, `MASK` alpha (of factor, texture and vertices) and normals, of cameras, and of the
/// lights of `KHR_lights_punctual`. Each primitive is stored once and drawn by instances, including
/// those of `EXT_mesh_gpu_instancing`. Nodes that `KHR_node_visibility` hides are left out, with
/// all below them but their cameras. Textures are PNG or JPEG images with the transform of
/// `KHR_texture_transform`; they are interpolated as their sampler's `magFilter` says, without mip
/// levels. Buffers and images are read from the file itself, from data URIs, and from regular files
/// below the scene's folder.
///
/// The following repairs are made, each kind with a notice in [`Scene::notices`]:
///
/// - Points and lines are left out.
/// - Missing normals are computed.
/// - Nodes whose transforms flatten their meshes are left out.
/// - Materials whose image is missing, invalid, too large, or of an unknown format are plain.
/// - Translucent (`BLEND`) materials are solid where alpha is at least one half and absent
///   elsewhere. Those that transmit light are solid.
/// - Positions that are not finite are left out if no triangle uses them.
/// - Matrices whose last row is off by rounding, and a byte order mark, are put right.
/// - Spot light cones with half angles beyond 90°, which glTF does not allow, are narrowed to 90°.
///
/// Vertex colours, emission, textures other than that of the base colour, animations, scenes other
/// than the default one and other extensions are not supported and are left out, also with a
/// notice. Both sides of every surface show, whatever `doubleSided` says.
///
/// # Errors
/// The file cannot be read, is cut off, refers to files outside its folder or to pipes or devices,
/// has indices out of range, positions that are not finite, nodes that do not form trees, requires
/// extensions that change its geometry in unknown ways, or has nothing to draw. The error names the
/// place in the file. [`SceneError::TooLarge`] if it would take more than [`SCENE_BYTES`].
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_within(path, SCENE_BYTES)
}

/// Like [`load`], with another limit of the memory that the scene may take, bytes. All count
/// together: the files, their JSON, what is read from them for a while, and the scene's vertices,
/// triangles, instances and pixels. What cannot become large without these is not counted.
///
/// # Errors
/// As for [`load`].
pub fn load_within(path: &Path, limit: u64) -> Result<Scene, SceneError> {
    let budget = Budget::new(path, limit);
    let bytes = document::read_file(path, &budget, "file")?;
    let document = Document::parse(path, &bytes, budget)?;
    let mut notices = Notices::default();
    if document.has_byte_order_mark {
        notices.add("JSON", "begins with a byte order mark, which is skipped");
    }
    note_unread(&document, &mut notices);
    let hierarchy = Hierarchy::of(&document, &mut notices)?;
    let mut loader = Loader {
        document: &document,
        hierarchy: &hierarchy,
        materials: Materials::default(),
        loaded: HashMap::new(),
        scene: Scene {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            ..Scene::default()
        },
        notices,
    };
    let mut place_of = vec![None; document.root.nodes.len()];
    for (place, &node) in hierarchy.shown.iter().enumerate() {
        place_of[node] = Some(place);
        loader.load_node(node, hierarchy.parent[node].and_then(|parent| place_of[parent]))?;
    }
    loader.check_drawn()?;
    sky::find(&mut loader.scene, has_lamps(&document, &hierarchy));
    let bounds = loader.scene.bounds();
    for (place, &node) in hierarchy.shown.iter().enumerate() {
        loader.load_camera_and_light(place, node, bounds)?;
    }
    Ok(loader.finish())
}

/// The files that [`load`] reads for a scene: first the scene file, then the files that it refers
/// to, in a fixed order. Files that do not exist are left out.
///
/// # Errors
/// The scene file cannot be read or is not glTF 2.0.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let budget = Budget::new(path, SCENE_BYTES);
    let bytes = document::read_file(path, &budget, "file")?;
    let mut files = vec![path.to_owned()];
    files.extend(Document::parse(path, &bytes, budget)?.referred_files());
    Ok(files)
}

/// Notes what of a file is never read.
fn note_unread(document: &Document, notices: &mut Notices) {
    extensions::note_unread(document, notices);
    for i in 0..document.root.animations.len() {
        notices.add(format!("animations[{i}]"), "not played, nodes stay in the pose they have");
    }
    for (i, camera) in document.root.cameras.iter().enumerate() {
        if camera.perspective.as_ref().is_some_and(|p| p.aspect_ratio.is_some()) {
            notices.add(
                format!("cameras[{i}]"),
                "aspectRatio is not used, the picture's size decides",
            );
        }
    }
    let shown = document.root.scene.map_or(0, |scene| scene.value());
    for i in (0..document.root.scenes.len()).filter(|&i| i != shown) {
        notices.add(format!("scenes[{i}]"), "left out, only the default scene is shown");
    }
}

struct Loader<'a> {
    document: &'a Document<'a>,
    hierarchy: &'a Hierarchy,
    materials: Materials,
    /// For each glTF mesh that has been loaded, and the bits of the weights that it was morphed by,
    /// the indices of the scene meshes made from it.
    loaded: HashMap<(usize, Vec<u32>), Vec<usize>>,
    scene: Scene,
    notices: Notices,
}

/// Whether a shown node holds a spot or point light.
fn has_lamps(document: &Document, hierarchy: &Hierarchy) -> bool {
    let lights = document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let is_lamp = |node: usize| {
        let held = document.root.nodes[node].extensions.as_ref()?.khr_lights_punctual.as_ref()?;
        let light = lights?.lights.get(held.light.value())?;
        Some(!matches!(light.type_, Checked::Valid(Type::Directional)))
    };
    hierarchy.shown.iter().any(|&node| !hierarchy.is_hidden[node] && is_lamp(node) == Some(true))
}

impl Loader<'_> {
    /// Loads a node's mesh, and notes the node. `parent` is the place of its parent among the
    /// nodes.
    fn load_node(&mut self, index: usize, parent: Option<usize>) -> Result<(), SceneError> {
        let begin = self.scene.instances.len();
        self.load_mesh(index)?;
        self.scene.nodes.push(SceneNode {
            name: self.document.root.nodes[index].name.clone().unwrap_or_default(),
            parent,
            instances: begin..self.scene.instances.len(),
            ..SceneNode::default()
        });
        Ok(())
    }

    fn load_mesh(&mut self, index: usize) -> Result<(), SceneError> {
        let (document, hierarchy) = (self.document, self.hierarchy);
        let node = &document.root.nodes[index];
        let Some(mesh) = node.mesh.filter(|_| !hierarchy.is_hidden[index]) else { return Ok(()) };
        let place = format!("nodes[{index}]");
        let json = document.get(mesh, &place)?;
        let weights = node.weights.as_ref().or(json.weights.as_ref());
        let weights = weights.map_or(&[][..], Vec::as_slice);
        if let Some(skin) = node.skin {
            let taken = document.budget.taken();
            let joints = skin::joint_matrices(document, skin, hierarchy, &mut self.notices)?;
            document.budget.give_back_to(taken);
            if Copies::count(document, node, &place)?.is_some() {
                self.notices
                    .add(&place, "instances of a skinned mesh are not supported, drawn once");
            }
            let posed = self.load_primitives(mesh, weights, Some(&joints))?;
            let instances =
                posed.into_iter().map(|(mesh, world_from_mesh)| Instance { mesh, world_from_mesh });
            let list = &mut self.scene.instances;
            let count = instances.len() as u64;
            document.budget.grow(&place, list, count, "instances", INSTANCE_BYTES)?;
            list.extend(instances);
            return Ok(());
        }
        let key = (mesh.value(), weights.iter().map(|w| w.to_bits()).collect());
        let meshes = match self.loaded.get(&key) {
            Some(found) => found.clone(),
            None => {
                let made = self.load_primitives(mesh, weights, None)?;
                let made: Vec<usize> = made.into_iter().map(|(mesh, _)| mesh).collect();
                self.loaded.insert(key, made.clone());
                made
            }
        };
        let world_from_node = hierarchy.world_from_node[index];
        let count = Copies::count(document, node, &place)?;
        let instances = count.unwrap_or(1).saturating_mul(meshes.len() as u64);
        let list = &mut self.scene.instances;
        document.budget.grow(&place, list, instances, "instances", INSTANCE_BYTES)?;
        let taken = document.budget.taken();
        let load = |count| Copies::load(document, node, &place, count as usize);
        let copies = count.map(load).transpose()?;
        for i in 0..count.unwrap_or(1) as usize {
            let world_from_mesh = match &copies {
                Some(copies) => world_from_node * copies.node_from_copy(document, i)?,
                None => world_from_node,
            };
            if is_flat(world_from_mesh.matrix3) {
                self.notices.add(&place, "its transform flattens its mesh, left out");
                continue;
            }
            let place = |&mesh: &usize| Instance { mesh, world_from_mesh };
            self.scene.instances.extend(meshes.iter().map(place));
        }
        document.budget.give_back_to(taken);
        Ok(())
    }

    /// Adds the primitives of a mesh to the scene, in the pose of the joints if there are any.
    /// Returns their indices, and the transform to the world that the pose gives them: a mesh is
    /// loaded for each node that draws it with a skin, because its shape depends on the pose.
    fn load_primitives(
        &mut self,
        mesh: Index<gltf::json::Mesh>,
        morph_weights: &[f32],
        joints: Option<&[DAffine3]>,
    ) -> Result<Vec<(usize, DAffine3)>, SceneError> {
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
                morph_weights,
                is_skinned: joints.is_some(),
            };
            let taken = document.budget.taken();
            let loaded = primitive::load(document, primitive, &place, &wanted, &mut self.notices)?;
            document.budget.give_back_to(taken);
            let Some(mut loaded) = loaded else { continue };
            let mesh = &mut loaded.mesh;
            document.budget.take(&place, 1, "mesh", mesh.bytes())?;
            let list = &mut self.scene.meshes;
            document.budget.grow(&place, list, 1, "meshes", size_of::<Mesh>())?;
            let world_from_mesh = match joints {
                Some(joints) if !loaded.influences.is_empty() => {
                    let influences = &loaded.influences;
                    skin::pose(document, mesh, influences, joints, &place, &mut self.notices)?
                }
                Some(_) => {
                    self.notices
                        .add(&place, "has a skin but no joints or weights, shown without the skin");
                    DAffine3::IDENTITY
                }
                None => DAffine3::IDENTITY,
            };
            made.push((self.scene.meshes.len(), world_from_mesh));
            self.scene.meshes.push(loaded.mesh);
        }
        Ok(made)
    }

    /// Checks what is drawn.
    ///
    /// # Errors
    /// The scene draws nothing, or extends beyond [`WORLD_END`].
    fn check_drawn(&self) -> Result<(), SceneError> {
        let bounds = self.scene.bounds();
        if self.scene.drawn_triangles() == 0 {
            return Err(self.document.invalid("scene", "there are no triangles to draw"));
        }
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        if reach > WORLD_END {
            let problem = format!("reaches {reach:e} m from the origin, the world ends at 1e12 m");
            return Err(self.document.invalid("scene", problem));
        }
        Ok(())
    }

    /// Loads the camera and the light of the node with this index, whose place among the scene's
    /// nodes is `place`.
    fn load_camera_and_light(
        &mut self,
        place: usize,
        index: usize,
        bounds: Aabb,
    ) -> Result<(), SceneError> {
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
            self.scene.nodes[place].camera = camera.is_some().then_some(self.scene.cameras.len());
            self.scene.cameras.extend(camera);
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light.filter(|_| !self.hierarchy.is_hidden[index]) {
            let (index, notices) = (light.light.value(), &mut self.notices);
            let light =
                cameras_and_lights::load_light(self.document, index, name, world, bounds, notices)?;
            self.scene.nodes[place].light = light.is_some().then_some(self.scene.lights.len());
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
