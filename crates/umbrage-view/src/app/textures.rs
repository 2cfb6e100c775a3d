//! What egui shows of textures that the stage draws.

use crate::stage::Frame;
use egui::TextureId;
use std::sync::Arc;
use umbrage_render::FrameTarget;

/// The textures of the newest frame, as egui knows them.
pub(super) struct Textures {
    state: egui_wgpu::RenderState,
    pictures: [Option<Shown>; 2],
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
        Self { state, pictures: [None, None], map: None }
    }

    /// Shows a frame from now on. A picture that could not be drawn stays as it was.
    pub(super) fn show(&mut self, frame: &Frame) {
        for (i, place) in self.pictures.iter_mut().enumerate() {
            let drawn = frame.pictures.get(i).and_then(|picture| picture.drawn.as_ref().ok());
            let target = drawn.map(|drawn| &drawn.target);
            replace(&self.state, place, target, wgpu::FilterMode::Linear);
        }
        replace(&self.state, &mut self.map, frame.map.as_ref(), wgpu::FilterMode::Nearest);
    }

    /// Shows nothing from now on.
    pub(super) fn clear(&mut self) {
        for place in self.pictures.iter_mut().chain([&mut self.map]) {
            replace(&self.state, place, None, wgpu::FilterMode::Linear);
        }
    }

    /// The picture of the first (0) or second (1) technique.
    pub(super) fn picture(&self, index: usize) -> Option<&Shown> {
        self.pictures.get(index)?.as_ref()
    }

    /// The picture of a map.
    pub(super) fn map(&self) -> Option<&Shown> {
        self.map.as_ref()
    }
}

impl Drop for Textures {
    fn drop(&mut self) {
        self.clear();
    }
}

/// Shows another target, or none.
fn replace(
    state: &egui_wgpu::RenderState,
    place: &mut Option<Shown>,
    target: Option<&Arc<FrameTarget>>,
    filter: wgpu::FilterMode,
) {
    let mut renderer = state.renderer.write();
    let known = place.take().map(|shown| shown.id);
    let Some(target) = target else {
        known.iter().for_each(|id| renderer.free_texture(id));
        return;
    };
    let (device, view) = (&state.device, target.shown_view());
    let id = match known {
        Some(id) => {
            renderer.update_egui_texture_from_wgpu_texture(device, view, filter, id);
            id
        }
        None => renderer.register_native_texture(device, view, filter),
    };
    *place = Some(Shown { id, target: Arc::clone(target) });
}
