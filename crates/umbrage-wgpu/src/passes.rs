//! The passes that draw casters into maps.

use crate::redraw::{Redraw, Stale, Texels};
use crate::shadows::{Record, Shadows, depth_state};
use glam::{DVec3, Mat4};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Place, Plan};
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

/// One map's part of a depth pass, or a part of that. The map's matrix is already bound in bind
/// group 0, as [`Shadows::caster_wgsl`] uses it. Viewport and scissor rectangle are already set; do
/// not change them.
#[derive(Debug)]
pub struct MapPass<'p, 'e> {
    /// The render pass into which you draw the casters.
    pub pass: &'p mut RenderPass<'e>,
    /// The map, and what of it is drawn.
    pub redraw: Redraw<'p>,
    /// The matrix from render space to the pass's clip space, for pipelines that do not read it
    /// from bind group 0.
    pub clip_from_render: Mat4,
    /// World position of render space's origin, metres.
    pub render_origin: DVec3,
}

impl MapPass<'_, '_> {
    /// Whether anything in `aabb` (world space) can cast a shadow into what is drawn: see
    /// [`Redraw::may_cast`].
    pub fn may_cast(&self, aabb: Aabb) -> bool {
        self.redraw.may_cast(aabb)
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
    /// What [`encode`](Self::encode) will draw, in the same order, for renderers that cull ahead of
    /// the pass. All other maps and parts of maps are empty or already drawn.
    pub fn stale(&self) -> impl Iterator<Item = Redraw<'_>> {
        let filter = self.shadows.options().filter;
        self.shadows.records.iter().enumerate().flat_map(move |(index, record)| {
            let place = record.stale_place();
            let redraw = move |place| {
                let map = &self.plan.maps[index];
                let parts = record.stale.parts();
                parts.map(move |texels| Redraw::new(map, index, record, place, &filter, texels))
            };
            place.into_iter().flat_map(redraw)
        })
    }

    /// Encodes the passes that draw the maps. `draw` is called once for each map, or for each part
    /// of a map in which casters have moved, and must draw all casters that may cast into it. Maps
    /// that have not changed and empty maps are left out. If no map is left, no pass is encoded and
    /// no timestamp is written.
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
            let is_whole = records.iter().filter(in_layer).all(|r| r.is_wholly_stale(&filter));
            let load = if is_whole { LoadOp::Clear(1.0) } else { LoadOp::Load };
            let [is_first, is_last] = [Some(layer) == first, Some(layer) == last];
            let writes = part(timestamps.depth.as_ref(), is_first, is_last);
            let mut pass = depth_pass(encoder, &texture.layers[layer], load, writes);
            for (index, record, place) in stale_in(layer) {
                let aim = Aim::new(&place, &filter, 0, [0; 2]);
                aim.set_viewport(&mut pass);
                for texels in record.stale.parts() {
                    aim.set_scissor(&mut pass, texels, [0; 2]);
                    if !is_whole {
                        pass.set_pipeline(&clear.pipeline);
                        pass.draw(0..3, 0..1);
                    }
                    let offset = record.stale_index * casters.stride;
                    pass.set_bind_group(0, &casters.bind_group, &[offset]);
                    draw(&mut MapPass {
                        pass: &mut pass,
                        redraw: Redraw::new(
                            &plan.maps[index],
                            index,
                            record,
                            place,
                            &filter,
                            texels,
                        ),
                        clip_from_render: record.clip_from_render.as_mat4(),
                        render_origin,
                    });
                }
                drawn += 1;
            }
            drop(pass);
            if let Some(prefiltering) = prefiltering {
                let stale = stale_in(layer).map(|(_, record, place)| (record, place));
                let writes = part(timestamps.filter.as_ref(), is_first, is_last);
                prefiltering.encode(encoder, layer, &stale, &filter, writes.as_ref());
            }
        }
        records.iter_mut().for_each(|record| record.stale = Stale::default());
        texture.is_fresh &= drawn == 0;
        drawn
    }
}

pub(crate) fn depth_pass<'e>(
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

/// Where a mip level of a map lies in its texture.
pub(crate) struct Aim {
    level: u32,
    /// The first texel of the drawn rectangle.
    origin: [u32; 2],
    /// The texels that are drawn if all of the map is, counted from `origin`.
    drawn: Texels,
}

impl Aim {
    /// Mip level `level` of the texels that are drawn for a map, without `inset` texels of that
    /// level at each side.
    pub(crate) fn new(place: &Place, filter: &Filter, level: u32, inset: [u32; 2]) -> Self {
        let gutter = filter.reach_texels();
        let size = filter.drawn_texels(place.size);
        Self {
            level,
            origin: place.origin.map(|n| (n - gutter) >> level),
            drawn: Texels { first: inset, end: [0, 1].map(|i| (size[i] >> level) - inset[i]) },
        }
    }

    pub(crate) fn set_viewport(&self, pass: &mut RenderPass<'_>) {
        let [x, y] = [0, 1].map(|i| (self.origin[i] + self.drawn.first[i]) as f32);
        let [width, height] = self.drawn.size().map(|n| n as f32);
        pass.set_viewport(x, y, width, height, 0.0, 1.0);
    }

    /// Sets the scissor rectangle to what depends on `texels` of the map itself, and `reach` texels
    /// of this level beside it. Returns `false` if nothing of that is drawn.
    pub(crate) fn set_scissor(
        &self,
        pass: &mut RenderPass<'_>,
        texels: Texels,
        reach: [u32; 2],
    ) -> bool {
        let drawn = texels.at_level(self.level, reach).within(self.drawn);
        if let Some(drawn) = drawn {
            let [x, y] = [0, 1].map(|i| self.origin[i] + drawn.first[i]);
            let [width, height] = drawn.size();
            pass.set_scissor_rect(x, y, width, height);
        }
        drawn.is_some()
    }
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
