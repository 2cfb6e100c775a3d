//! Loads glTF 2.0 files.

mod accessor;
mod budget;
mod cameras_and_lights;
mod document;
mod extensions;
mod hierarchy;
mod instancing;
mod material;
mod meshes;
mod primitive;
mod rigging;
mod skin;
mod uri;

use crate::animation::{HeldCamera, HeldLight, WORLD_END};
use crate::error::SceneError;
use crate::nodes::SceneNode;
use crate::sky;
use crate::types::Scene;
use budget::Budget;
use document::{Document, Notices};
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;
use hierarchy::Hierarchy;
use material::Materials;
use meshes::Made;
use rigging::Rigging;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The memory that [`load`] lets a scene take, bytes: 2 GiB. That is enough for four million
/// instances, some twenty million triangles, or an image of 16 384 × 16 384 pixels and as much
/// again.
pub const SCENE_BYTES: u64 = 2 << 30;

/// Reads a scene from a `.gltf` or `.glb` file; the content tells which of the two it is.
///
/// The file's default scene is loaded in the pose that its nodes have: skins and the default
/// weights of morph targets are applied. [`Scene::pose`] plays its animations, of which what moves
/// nodes and changes weights is read. The scene consists of triangles with base colour, `MASK`
/// alpha (of factor, texture and vertices) and normals, of cameras, and of the lights of
/// `KHR_lights_punctual`. Each primitive is stored once and drawn by instances, including
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
/// - Nodes whose transforms flatten their meshes are left out, unless an animation moves them.
/// - Channels of animations are left out if their keys are damaged, or if they change the rotation
///   and the like of a node that has a matrix.
/// - Materials whose image is missing, invalid, too large, or of an unknown format are plain.
/// - Translucent (`BLEND`) materials are solid where alpha is at least one half and absent
///   elsewhere. Those that transmit light are solid.
/// - Positions that are not finite are left out if no triangle uses them.
/// - Matrices whose last row is off by rounding, and a byte order mark, are put right.
/// - Spot light cones with half angles beyond 90°, which glTF does not allow, are narrowed to 90°.
///
/// Vertex colours, emission, textures other than that of the base colour, scenes other than the
/// default one and other extensions are not supported and are left out, also with a notice. Both
/// sides of every surface show, whatever `doubleSided` says.
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
/// triangles, instances, pixels and animations. What cannot become large without these is not
/// counted.
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
        rigging: Rigging::read(&document, &hierarchy, &mut notices)?,
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
    loader.rigging.animations.bounds = loader.scene.bounds();
    for (place, &node) in hierarchy.shown.iter().enumerate() {
        loader.load_camera_and_light(place, node)?;
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
    rigging: Rigging<'a>,
    materials: Materials,
    /// For each glTF mesh that has been loaded, and the bits of the weights that it was morphed by,
    /// the scene's meshes made from it.
    loaded: HashMap<(usize, Vec<u32>), Vec<Made>>,
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
    fn load_camera_and_light(&mut self, place: usize, index: usize) -> Result<(), SceneError> {
        let (document, notices) = (self.document, &mut self.notices);
        let node = &document.root.nodes[index];
        let world = &self.hierarchy.world_from_node[index];
        let moving = self.rigging.moving(index);
        let animations = &mut self.rigging.animations;
        let (name, bounds) = (node.name.as_deref(), animations.bounds);
        if let Some(camera) = node.camera
            && let Some((rest, optics)) =
                cameras_and_lights::load_camera(document, camera, name, world, bounds, notices)?
        {
            let camera = self.scene.cameras.len();
            self.scene.nodes[place].camera = Some(camera);
            self.scene.cameras.push(rest.clone());
            let held = |node| HeldCamera { camera, node, optics, rest };
            animations.cameras.extend(moving.map(held));
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light.filter(|_| !self.hierarchy.is_hidden[index])
            && let Some((loaded, shine)) = cameras_and_lights::load_light(
                document,
                light.light.value(),
                name,
                world,
                bounds,
                notices,
            )?
        {
            let light = self.scene.lights.len();
            self.scene.nodes[place].light = Some(light);
            let held = |node| HeldLight { light, node, shine, rest: loaded.light };
            animations.lights.extend(moving.map(held));
            self.scene.lights.push(loaded);
        }
        Ok(())
    }

    fn finish(self) -> Scene {
        let mut scene = Scene {
            materials: self.materials.materials,
            textures: self.materials.textures,
            notices: self.notices.finish(),
            animations: self.rigging.animations,
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
