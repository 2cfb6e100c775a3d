use glam::DVec3;
use std::error::Error;
use umbrage::{Bounds, Camera, Light, Planner, Technique};
use umbrage_wgpu::{Casters, Frame, MapPass, ShadowOptions, Shadows, Support, Timestamps};

/// One view's shadows: split screens, mirrors and minimaps have one of these each. Pipelines that
/// are made for one look maps of the other up as well, since both have the same filter.
pub struct ViewShadows {
    technique: Technique,
    planner: Planner,
    pub shadows: Shadows,
}

impl ViewShadows {
    pub fn new(
        device: &wgpu::Device,
        support: Support,
        technique: Technique,
    ) -> Result<Self, umbrage_wgpu::Error> {
        let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
        let shadows = Shadows::new(device, support, &options)?;
        Ok(Self { technique, planner: Planner::with_limits(support.limits()), shadows })
    }

    /// Plans the view's maps and encodes the passes that draw them. `draw` is called for each map.
    pub fn draw(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        (camera, lights, bounds): (&Camera, &[Light], &Bounds<'_>),
        draw: impl FnMut(&mut MapPass<'_, '_>),
    ) -> Result<(), Box<dyn Error>> {
        let plan = self.planner.plan(camera, lights, bounds, &self.technique)?;
        let frame = Frame { plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
        let prepared = self.shadows.prepare(device, queue, &frame)?;
        prepared.encode(encoder, &Timestamps::default(), draw);
        Ok(())
    }
}
