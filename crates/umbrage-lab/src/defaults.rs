//! What a scene offers where a user leaves the view or the light open.

use std::sync::OnceLock;
use umbrage_scene::{Scene, SceneCamera, SceneLight};

/// A scene's default view and light, composed when they are first needed and no more than once.
#[derive(Debug)]
pub struct Defaults<'a> {
    scene: Option<&'a Scene>,
    composed: OnceLock<(SceneCamera, SceneLight)>,
}

impl<'a> Defaults<'a> {
    /// The defaults of a scene, or those of a view without a scene.
    pub fn of(scene: Option<&'a Scene>) -> Self {
        Self { scene, composed: OnceLock::new() }
    }

    pub(crate) fn scene(&self) -> Option<&'a Scene> {
        self.scene
    }

    /// The default view of the scene, which must be the one that these defaults are of.
    pub(crate) fn view(&self, scene: &Scene) -> &SceneCamera {
        &self.composed(scene).0
    }

    /// The default light of the scene, as [`view`](Self::view) is its default view.
    pub(crate) fn light(&self, scene: &Scene) -> &SceneLight {
        &self.composed(scene).1
    }

    fn composed(&self, scene: &Scene) -> &(SceneCamera, SceneLight) {
        self.composed.get_or_init(|| scene.default_view_and_light())
    }
}
