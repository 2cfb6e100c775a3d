//! The passes that draw casters into maps.

use crate::shadows::{Record, Shadows, depth_state};
use glam::{DVec3, Mat4};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Place, Plan, ShadowMap};
use wgpu::{
    CommandEncoder, CompareFunction, Device, LoadOp, Operations, PipelineCompilationOptions,
    PipelineLayoutDescriptor, PrimitiveState, RenderPass, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, RenderPassTimestampWrites, RenderPipeline, RenderPipelineDescriptor,
    ShaderModuleDescriptor, ShaderSource, StoreOp, TextureView, VertexState,
};

/// A frame that is prepared: its maps can now be drawn with [`encode`](Self::encode).
#[derive(Debug)]
#[must_use = "maps are drawn only if their passes are encoded"]
pub struct Prepared<'a> {
    pub(crate) shadows: &'a mut Shadows,
    pub(crate) plan: &'a Plan,
    pub(crate) render_origin: DVec3,
}

/// One map's part of a depth pass. The map's matrix is already bound in bind group 0, as
/// [`Shadows::caster_wgsl`] uses it. Viewport and scissor rectangle are already set; do not change
/// them.
#[derive(Debug)]
pub struct MapPass<'p, 'e> {
    /// The render pass into which you draw the casters.
    pub pass: &'p mut RenderPass<'e>,
    /// The planned map. Its caster planes tell which casters can be culled;
    /// [`may_cast`](Self::may_cast) tests boxes against them.
    pub shadow_map: &'p ShadowMap,
    /// The index of the map in the plan.
    pub index: usize,
    /// The matrix from render space to the pass's clip space, for pipelines that do not read it
    /// from bind group 0.
    pub clip_from_render: Mat4,
    /// World position of render space's origin, metres.
    pub render_origin: DVec3,
}

impl MapPass<'_, '_> {
    /// Whether anything in `aabb` (world space) can cast a shadow into the map. The result is
    /// conservative: it is never `false` for a box that can cast into the map, but may be `true`
    /// for one that cannot.
    pub fn may_cast(&self, aabb: Aabb) -> bool {
        self.shadow_map.may_cast(aabb)
    }
}

/// The timestamps that passes write when they begin and end.
#[derive(Clone, Debug, Default)]
pub struct Timestamps<'a> {
    /// Timestamps of all passes that draw casters: the first pass writes the beginning, the last
    /// one the end.
    pub depth: Option<RenderPassTimestampWrites<'a>>,
    /// Timestamps of all passes of the prefilter, in the same way.
    pub filter: Option<RenderPassTimestampWrites<'a>>,
}

/// The timestamps that one pass of many writes: the beginning if it is the first, the end if it is
/// the last.
pub(crate) fn part<'a>(
    all: Option<&RenderPassTimestampWrites<'a>>,
    is_first: bool,
    is_last: bool,
) -> Option<RenderPassTimestampWrites<'a>> {
    let all = all?;
    let begin = all.beginning_of_pass_write_index.filter(|_| is_first);
    let end = all.end_of_pass_write_index.filter(|_| is_last);
    (begin.is_some() || end.is_some()).then_some(RenderPassTimestampWrites {
        query_set: all.query_set,
        beginning_of_pass_write_index: begin,
        end_of_pass_write_index: end,
    })
}

impl Prepared<'_> {
    /// Indices in the plan of the maps that [`encode`](Self::encode) will draw. All other maps are
    /// empty or already drawn.
    pub fn stale(&self) -> impl Iterator<Item = usize> + '_ {
        let records = self.shadows.records.iter().enumerate();
        records.filter(|(_, r)| r.stale_place().is_some()).map(|(index, _)| index)
    }

    /// Encodes the passes that draw the maps. `draw` is called once for each map and must draw all
    /// casters of that map. Maps that have not changed and empty maps are left out. If no map is
    /// left, no pass is encoded and no timestamp is written.
    ///
    /// Returns the number of maps drawn. Submit these passes in the same encoder as the passes that
    /// look the maps up, ahead of those, or in an earlier submission.
    pub fn encode(
        self,
        encoder: &mut CommandEncoder,
        timestamps: &Timestamps<'_>,
        mut draw: impl FnMut(&mut MapPass<'_, '_>),
    ) -> usize {
        let Self { shadows, plan, render_origin } = self;
        let filter = shadows.options().filter;
        let Shadows { records, texture, clear, casters, prefiltering, .. } = shadows;
        let stale_in = |layer: usize| {
            records.iter().enumerate().filter_map(move |(index, record)| {
                let place = record.stale_place().filter(|p| p.layer as usize == layer)?;
                Some((index, record, place))
            })
        };
        let is_stale = |&layer: &usize| stale_in(layer).next().is_some();
        let stale_layers = || (0..texture.layers.len()).filter(is_stale);
        let [first, last] = [stale_layers().next(), stale_layers().next_back()];
        let mut drawn = 0;
        for layer in stale_layers() {
            // If all maps of a layer are drawn, clearing the whole layer costs least.
            let in_layer = |r: &&Record| r.place.is_some_and(|p| p.layer as usize == layer);
            let is_whole = records.iter().filter(in_layer).all(|r| r.stale_place().is_some());
            let load = if is_whole { LoadOp::Clear(1.0) } else { LoadOp::Load };
            let [is_first, is_last] = [Some(layer) == first, Some(layer) == last];
            let writes = part(timestamps.depth.as_ref(), is_first, is_last);
            let mut pass = begin(encoder, &texture.layers[layer], load, writes);
            for (index, record, place) in stale_in(layer) {
                aim(&mut pass, &place, &filter);
                if !is_whole {
                    pass.set_pipeline(&clear.pipeline);
                    pass.draw(0..3, 0..1);
                }
                pass.set_bind_group(0, &casters.bind_group, &[index as u32 * casters.stride]);
                draw(&mut MapPass {
                    pass: &mut pass,
                    shadow_map: &plan.maps[index],
                    index,
                    clip_from_render: record.clip_from_render.as_mat4(),
                    render_origin,
                });
                drawn += 1;
            }
            drop(pass);
            if let Some(prefiltering) = prefiltering {
                let stale = stale_in(layer).map(|(index, _, place)| (index, place));
                let writes = part(timestamps.filter.as_ref(), is_first, is_last);
                prefiltering.encode(encoder, layer, &stale, &filter, writes.as_ref());
            }
        }
        for record in records.iter_mut() {
            record.is_drawn = record.place.is_some();
        }
        texture.is_fresh &= drawn == 0;
        drawn
    }
}

fn begin<'e>(
    encoder: &'e mut CommandEncoder,
    view: &TextureView,
    load: LoadOp<f32>,
    timestamp_writes: Option<RenderPassTimestampWrites<'_>>,
) -> RenderPass<'e> {
    encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some("shadow maps"),
        color_attachments: &[],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(Operations { load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

/// Sets viewport and scissor rectangle to the texels that are drawn for a map, its gutter included.
fn aim(pass: &mut RenderPass<'_>, place: &Place, filter: &Filter) {
    aim_level(pass, place, filter, 0, [0; 2]);
}

/// Sets viewport and scissor rectangle in mip level `level`, and leaves out `inset` texels of that
/// level at each side.
pub(crate) fn aim_level(
    pass: &mut RenderPass<'_>,
    place: &Place,
    filter: &Filter,
    level: u32,
    inset: [u32; 2],
) {
    let gutter = filter.reach_texels();
    let drawn = filter.drawn_texels(place.size);
    let [x, y] = [0, 1].map(|i| ((place.origin[i] - gutter) >> level) + inset[i]);
    let [w, h] = [0, 1].map(|i| (drawn[i] >> level) - 2 * inset[i]);
    pass.set_viewport(x as f32, y as f32, w as f32, h as f32, 0.0, 1.0);
    pass.set_scissor_rect(x, y, w, h);
}

/// The pipeline that clears one map in a layer whose other maps stay.
#[derive(Debug)]
pub(crate) struct Clear {
    pipeline: RenderPipeline,
}

impl Clear {
    pub(crate) fn new(device: &Device) -> Self {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("shadow clear"),
            source: ShaderSource::Wgsl(include_str!("wgsl/clear.wesl").into()),
        });
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("shadow clear"),
            bind_group_layouts: &[],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("shadow clear"),
            layout: Some(&layout),
            vertex: VertexState {
                module: &module,
                entry_point: None,
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: PrimitiveState::default(),
            depth_stencil: Some(depth_state(CompareFunction::Always)),
            multisample: wgpu::MultisampleState::default(),
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline }
    }
}
