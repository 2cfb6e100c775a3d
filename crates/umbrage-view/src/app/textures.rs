//! What egui shows of textures that the stage draws.

use crate::stage::Frame;
use egui::TextureId;
use std::sync::Arc;
use umbrage_render::FrameTarget;

/// The textures of the newest frame, as egui knows them.
pub(super) struct Textures {
    state: egui_wgpu::RenderState,
    pictures: Vec<Shown>,
    map: Option<Shown>,
}

/// A target that egui shows. Holding it keeps the stage from drawing into it.
#[derive(Clone)]
pub(super) struct Shown {
    pub(super) id: TextureId,
    target: Arc<FrameTarget>,
}

impl Shown {
    /// Width and height, pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.target.size()
    }
}

impl Textures {
    pub(super) fn new(state: egui_wgpu::RenderState) -> Self {
        Self { state, pictures: Vec::new(), map: None }
    }

    /// Shows a frame from now on. A picture that could not be drawn stays as it was.
    pub(super) fn show(&mut self, frame: &Frame) {
        for (i, picture) in frame.pictures.iter().enumerate() {
            let Ok(drawn) = &picture.drawn else { continue };
            let known = self.pictures.get(i).map(|shown| shown.id);
            let shown = self.shown(&drawn.target, known, wgpu::FilterMode::Linear);
            match self.pictures.get_mut(i) {
                Some(place) => *place = shown,
                None => self.pictures.push(shown),
            }
        }
        if let Some(target) = &frame.map {
            let known = self.map.as_ref().map(|shown| shown.id);
            self.map = Some(self.shown(target, known, wgpu::FilterMode::Nearest));
        }
    }

    fn shown(
        &self,
        target: &Arc<FrameTarget>,
        known: Option<TextureId>,
        filter: wgpu::FilterMode,
    ) -> Shown {
        let (device, view) = (&self.state.device, target.shown_view());
        let mut renderer = self.state.renderer.write();
        let id = match known {
            Some(id) => {
                renderer.update_egui_texture_from_wgpu_texture(device, view, filter, id);
                id
            }
            None => renderer.register_native_texture(device, view, filter),
        };
        Shown { id, target: Arc::clone(target) }
    }

    /// The picture of the first (0) or second (1) technique.
    pub(super) fn picture(&self, index: usize) -> Option<&Shown> {
        self.pictures.get(index)
    }

    /// The picture of a map.
    pub(super) fn map(&self) -> Option<&Shown> {
        self.map.as_ref()
    }
}

impl Drop for Textures {
    fn drop(&mut self) {
        let mut renderer = self.state.renderer.write();
        self.pictures.iter().chain(&self.map).for_each(|shown| renderer.free_texture(&shown.id));
    }
}
