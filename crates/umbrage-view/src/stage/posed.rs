//! A scene in motion.

use std::sync::Arc;
use umbrage::Aabb;
use umbrage_lab::Receivers;
use umbrage_render::{Gpu, SceneBuffers};
use umbrage_scene::Scene;

/// A copy of a scene that its animations pose. The scene that was opened stays at rest.
pub(super) struct Posed {
    scene: Scene,
    moment: Option<(usize, f64)>,
    receivers: Receivers,
}

impl Posed {
    pub(super) fn new(rest: &Scene) -> Self {
        let receivers = Receivers::around_instances(rest);
        Self { scene: rest.clone(), moment: None, receivers }
    }

    /// Whether the scene is at rest, as it was opened.
    pub(super) fn is_at_rest(&self) -> bool {
        self.moment.is_none()
    }

    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene in this pose, for a thread of its own.
    pub(super) fn shared(&self) -> Option<Arc<Scene>> {
        (!self.is_at_rest()).then(|| Arc::new(self.scene.clone()))
    }

    pub(super) fn receivers(&self) -> &Receivers {
        &self.receivers
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
        self.receivers = Receivers::around_instances(&self.scene);
        buffers.pose(gpu, &self.scene, &moved).map_err(|e| e.to_string())
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
    let mut posed = scene.clone();
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
