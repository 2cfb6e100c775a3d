use glam::{DMat4, DVec3};
use std::error::Error;
use umbrage::{Aabb, Bounds, BoxTree, Camera, Light, Planner, Seen, Technique};
use umbrage_wgpu::{
    Casters, DepthProjection, Frame, MapPass, SeenReadback, ShadowOptions, Shadows, Support,
    Timestamps,
};

/// Shadows whose maps are fitted to what the camera saw a frame or two before.
pub struct SeenShadows {
    technique: Technique,
    planner: Planner,
    /// `None` on devices without compute shaders, where boxes serve alone.
    readback: Option<SeenReadback>,
    pub shadows: Shadows,
}

impl SeenShadows {
    pub fn new(
        device: &wgpu::Device,
        support: Support,
        technique: Technique,
    ) -> Result<Self, umbrage_wgpu::Error> {
        let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
        let shadows = Shadows::new(device, support, &options)?;
        let planner = Planner::with_limits(support.limits());
        let readback = SeenReadback::new(device, &support).ok();
        Ok(Self { technique, planner, readback, shadows })
    }

    /// Before the picture: plans the maps and encodes the passes that draw them. `receivers` hold
    /// all models, because the camera may come to see what it did not see before. `moving` holds
    /// the models that move, at the places that they have had in the last few frames. Nothing comes
    /// nearer to this camera than 10 cm.
    pub fn draw(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        (camera, lights): (&Camera, &[Light]),
        (receivers, moving): (&BoxTree, &[Aabb]),
        draw: impl FnMut(&mut MapPass<'_, '_>),
    ) -> Result<(), Box<dyn Error>> {
        let tiles = self.readback.as_mut().and_then(|readback| readback.latest(device));
        let seen = tiles.map(|tiles| Seen { tiles, moving, clearance: 0.1 });
        let bounds = Bounds { receiver_parts: Some(receivers), seen, ..Bounds::default() };
        let plan = self.planner.plan(camera, lights, &bounds, &self.technique)?;
        let frame = Frame { plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
        let prepared = self.shadows.prepare(device, queue, &frame)?;
        prepared.encode(encoder, &Timestamps::default(), draw);
        Ok(())
    }

    /// After the picture: encodes the reduction of its depths, which come back on their own.
    pub fn look(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        (camera, clip_from_view): (&Camera, DMat4),
    ) -> Result<(), umbrage_wgpu::Error> {
        let Some(readback) = &mut self.readback else { return Ok(()) };
        let projection = DepthProjection::of_matrix(clip_from_view)?;
        readback.encode(device, queue, encoder, depth, projection, camera)
    }
}
