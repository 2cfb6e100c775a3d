//! What hides clusters from a picture: distances of what is already drawn.

use super::data::{self, Occluders};
use super::geometry::{ClusterGeometry, buffer};
use super::view::ClusterView;
use crate::seen::{check_depths, depth_step};
use crate::{DepthProjection, Error};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferUsages, CommandEncoder, ComputePassDescriptor, Device, Extent3d, Queue,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
    TextureViewDescriptor,
};

/// Distances of what a picture already shows, at all scales, for
/// [`ClusterSelection::encode`](super::ClusterSelection::encode) to leave out what lies behind.
///
/// Draw what the last picture showed as seen by the new camera
/// ([`draw_again`](super::ClusterSelection::draw_again)), reduce these depths, and choose anew:
/// then nothing is missing, whatever moved, and all that is hidden is left out.
#[derive(Debug)]
pub struct ClusterOccluders {
    picture: Buffer,
    occluders: Buffer,
    levels: Option<Levels>,
}

/// The levels for a picture of one size.
#[derive(Debug)]
struct Levels {
    size: [u32; 2],
    depth: TextureView,
    first: BindGroup,
    next: Vec<BindGroup>,
    /// With which clusters are chosen.
    group: BindGroup,
    /// Width and height of the first level, texels.
    texels: [u32; 2],
}

impl ClusterOccluders {
    /// Makes the buffers.
    pub fn new(device: &Device) -> Self {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        Self {
            picture: buffer(device, &[data::Picture::default()], usage),
            occluders: buffer(device, &[Occluders::default()], usage),
            levels: None,
        }
    }

    /// Encodes the reduction of a depth buffer, whose upper left part shows the picture `view` as
    /// far as it is drawn. `depth` is a view of the depth aspect alone, with one sample, whose
    /// texture has the usage `TEXTURE_BINDING`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the texture cannot be read or is smaller than the picture, or if the
    /// projection or the view is not of a picture.
    #[expect(clippy::too_many_arguments, reason = "device, queue and encoder are one in spirit")]
    pub fn encode(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        geometry: &ClusterGeometry,
        depth: &TextureView,
        projection: DepthProjection,
        view: &ClusterView,
    ) -> Result<(), Error> {
        let invalid = |field, problem: &str| Err(Error::Invalid { field, problem: problem.into() });
        if !view.is_picture {
            return invalid("view", "must be a picture, is a map");
        }
        projection.check_finite()?;
        let size = view.size.as_uvec2().to_array();
        check_depths(depth, size)?;
        if depth.texture().sample_count() > 1 {
            return invalid("depth", "must have one sample, has several");
        }
        let Some(distance) = view.distance(projection) else {
            return invalid("depth", "must have the view's kind of projection, and has another");
        };
        let holds = |levels: &Levels| levels.size == size && levels.depth == *depth;
        if !self.levels.as_ref().is_some_and(holds) {
            self.levels = Some(self.make(device, geometry, depth, size));
        }
        let Some(levels) = &self.levels else { return Ok(()) };
        let picture = data::Picture {
            size,
            base: projection.base as f32,
            per_nearness: projection.per_nearness as f32,
            is_orthographic: projection.is_orthographic.into(),
            step: depth_step(depth.texture().format()) as f32,
        };
        let occluders = Occluders {
            distance: distance.as_vec4(),
            size: view.size.as_vec2(),
            levels: levels.next.len() as u32 + 1,
            padding: 0,
        };
        queue.write_buffer(&self.picture, 0, bytemuck::bytes_of(&picture));
        queue.write_buffer(&self.occluders, 0, bytemuck::bytes_of(&occluders));
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("cluster occluders"),
            timestamp_writes: None,
        });
        let groups = |texels: u32| texels.div_ceil(8);
        let [mut width, mut height] = levels.texels;
        pass.set_pipeline(&geometry.pipelines.occluders);
        pass.set_bind_group(0, &levels.first, &[]);
        pass.dispatch_workgroups(groups(width), groups(height), 1);
        pass.set_pipeline(&geometry.pipelines.farther);
        for group in &levels.next {
            [width, height] = [width, height].map(|n| (n / 2).max(1));
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups(width), groups(height), 1);
        }
        Ok(())
    }

    /// The bind group with which clusters are chosen; `None` before depths are reduced.
    pub(crate) fn group(&self) -> Option<&BindGroup> {
        self.levels.as_ref().map(|levels| &levels.group)
    }

    fn make(
        &self,
        device: &Device,
        geometry: &ClusterGeometry,
        depth: &TextureView,
        size: [u32; 2],
    ) -> Levels {
        // With powers of two, each texel has exactly four finer ones.
        let texels = size.map(|n| n.next_power_of_two().div_ceil(2));
        let count = texels[0].max(texels[1]).ilog2() + 1;
        let texture = pyramid(device, texels, count);
        let of_level = |base_mip_level| {
            texture.create_view(&TextureViewDescriptor {
                base_mip_level,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let views: Vec<TextureView> = (0..count).map(of_level).collect();
        let pipelines = &geometry.pipelines;
        let group = |layout: &BindGroupLayout, resources: &[BindingResource<'_>]| {
            let entries = (0..)
                .zip(resources)
                .map(|(binding, resource)| BindGroupEntry { binding, resource: resource.clone() });
            device.create_bind_group(&BindGroupDescriptor {
                label: Some("cluster occluders"),
                layout,
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let view = BindingResource::TextureView;
        let next = views.windows(2);
        Levels {
            size,
            depth: depth.clone(),
            first: group(
                &pipelines.occluders_layout,
                &[view(depth), self.picture.as_entire_binding(), view(&views[0])],
            ),
            next: next
                .map(|pair| group(&pipelines.farther_layout, &[view(&pair[0]), view(&pair[1])]))
                .collect(),
            group: group(
                &pipelines.hidden_layout,
                &[
                    self.occluders.as_entire_binding(),
                    view(&texture.create_view(&TextureViewDescriptor::default())),
                ],
            ),
            texels,
        }
    }
}

/// A texture for distances, metres.
pub(crate) fn pyramid(device: &Device, [width, height]: [u32; 2], levels: u32) -> wgpu::Texture {
    device.create_texture(&TextureDescriptor {
        label: Some("cluster occluders"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::R32Float,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}
