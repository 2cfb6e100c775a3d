//! A scene that is ready for comparisons.

use crate::defaults::Defaults;
use crate::detail::Detail;
use crate::error::Error;
use crate::executor::RenderScene;
use crate::executors::Executors;
use crate::receivers::{Fit, Receivers};
use umbrage_scene::Scene;

/// A scene that is ready for comparisons in many views.
pub struct PreparedScene<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) executors: &'a Executors,
    pub(crate) render: RenderScene<'a>,
    pub(crate) receivers: Receivers,
    pub(crate) defaults: Defaults<'a>,
    opaque: bool,
}

impl<'a> PreparedScene<'a> {
    /// Prepares the scene. If `opaque` is true, alpha masks are ignored, so that masked materials
    /// show and cast as solid. `detail` is what a GPU draws of it.
    ///
    /// # Errors
    /// An error if the scene refers to something that it does not contain, or if a GPU cannot hold
    /// it.
    pub fn new(
        scene: &'a Scene,
        executors: &'a Executors,
        opaque: bool,
        fit: Fit,
        detail: &Detail,
    ) -> Result<Self, Error> {
        let render = RenderScene::new(scene, executors, opaque, detail)?;
        let receivers = Receivers::new(scene, render.tracer(), fit);
        let defaults = Defaults::of(Some(scene));
        Ok(Self { scene, executors, render, receivers, defaults, opaque })
    }

    /// Returns the scene as it is rendered.
    pub fn render(&self) -> &RenderScene<'a> {
        &self.render
    }

    /// Returns the receivers of the scene's maps.
    pub fn receivers(&self) -> &Receivers {
        &self.receivers
    }

    /// Returns what the scene offers where a user leaves the view or the light open.
    pub fn defaults(&self) -> &Defaults<'a> {
        &self.defaults
    }

    /// Returns the notices for readers of a report.
    pub(crate) fn notices(&self) -> Vec<String> {
        let mut notices: Vec<String> = self.scene.all_notices().into_iter().map(|n| n.0).collect();
        if self.opaque {
            notices
                .push("Alpha masks are ignored: masked materials show and cast as solid.".into());
        }
        notices.extend(self.render.notice().map(String::from));
        notices
    }
}
