//! A scene in motion.

use std::cell::OnceCell;
use std::sync::Arc;
use umbrage::Aabb;
use umbrage_lab::{Fit, Receivers};
use umbrage_render::{Gpu, SceneBuffers};
use umbrage_scene::Scene;

/// A copy of a scene that its animations pose. The scene that was opened stays at rest.
pub(super) struct Posed {
    scene: Scene,
    moment: Option<(usize, f64)>,
    /// Found when a picture of this pose first needs them.
    around_instances: OnceCell<Receivers>,
    in_box: OnceCell<Receivers>,
}

impl Posed {
    pub(super) fn new(rest: &Scene) -> Self {
        let (around_instances, in_box) = (OnceCell::new(), OnceCell::new());
        Self { scene: without_textures(rest), moment: None, around_instances, in_box }
    }

    /// Whether the scene is at rest, as it was opened.
    pub(super) fn is_at_rest(&self) -> bool {
        self.moment.is_none()
    }

    /// The scene in this pose, without its textures.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene in this pose with the textures of `rest`, for a thread of its own; `None` if it is
    /// at rest.
    pub(super) fn shared(&self, rest: &Scene) -> Option<Arc<Scene>> {
        let whole = || Scene { textures: rest.textures.clone(), ..self.scene.clone() };
        (!self.is_at_rest()).then(|| Arc::new(whole()))
    }

    /// What maps are fitted to. Boxes around surfaces are those around instances.
    pub(super) fn receivers(&self, fit: Fit) -> &Receivers {
        match fit {
            Fit::Box => self.in_box.get_or_init(|| Receivers::in_box(&self.scene)),
            Fit::Surfaces | Fit::Seen => {
                self.around_instances.get_or_init(|| Receivers::around_instances(&self.scene))
            }
        }
    }

    /// Poses the scene, and moves what the device has of it. Gives the boxes around casters that
    /// changed.
    pub(super) fn set(
        &mut self,
        moment: Option<(usize, f64)>,
        gpu: &Gpu,
        buffers: &SceneBuffers,
    ) -> Result<Vec<Aabb>, String> {
        if self.moment == moment {
            return Ok(Vec::new());
        }
        self.moment = moment;
        let (clip, seconds) = moment.map_or((None, 0.0), |(clip, seconds)| (Some(clip), seconds));
        let moved = self.scene.pose(clip, seconds);
        self.around_instances.take();
        self.in_box.take();
        buffers.pose(gpu, &self.scene, &moved).map_err(|e| e.to_string())
    }
}

/// A copy of a scene for its shape alone: textures are the largest part of many.
fn without_textures(scene: &Scene) -> Scene {
    Scene {
        name: scene.name.clone(),
        meshes: scene.meshes.clone(),
        instances: scene.instances.clone(),
        materials: scene.materials.clone(),
        cameras: scene.cameras.clone(),
        lights: scene.lights.clone(),
        nodes: scene.nodes.clone(),
        roles: scene.roles.clone(),
        sky: scene.sky,
        animations: scene.animations.clone(),
        ..Scene::default()
    }
}

/// Number of moments at which a clip is looked at to learn where it goes.
const MOMENTS: u32 = 8;

/// The number of moments of all clips together.
const MOST_MOMENTS: u32 = 64;

/// The boxes around the instances that the scene's clips move, wherever they go.
pub(super) fn boxes_in_motion(scene: &Scene) -> Vec<Aabb> {
    let clips = scene.animations.clips();
    if clips.is_empty() {
        return Vec::new();
    }
    let moments = (MOST_MOMENTS / clips.len() as u32).clamp(1, MOMENTS);
    let mut posed = without_textures(scene);
    let mut boxes = vec![Aabb::EMPTY; scene.instances.len()];
    for (clip, length) in clips.iter().map(|clip| clip.duration_s).enumerate() {
        for i in 0..moments {
            let moved = posed.pose(Some(clip), length * f64::from(i) / f64::from(moments));
            let now = posed.instance_boxes();
            for instance in moved.instances.into_iter().filter(|&i| posed.roles.of(i).is_seen) {
                boxes[instance] = boxes[instance].union(now[instance]);
            }
        }
    }
    boxes.retain(|aabb| !aabb.is_empty());
    boxes
}
