//! The textures and buffers in which the maps, and what lookups and casters need of them, lie.

use super::{DEPTH_FORMAT, Layout, LookupBuffers, Record};
use crate::Support;
use crate::data::{self, CasterMap, Lookup};
use crate::wgsl::{MAX_LIGHTS, MAX_MAPS, MAX_PLANES};
use std::mem::size_of;
use std::num::NonZeroU64;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, Device, Extent3d, Queue, ShaderStages, Texture,
    TextureDescriptor, TextureDimension, TextureUsages, TextureView, TextureViewDescriptor,
    TextureViewDimension,
};

/// The texture that holds the depths of all maps.
#[derive(Debug)]
pub(crate) struct DepthTexture {
    pub(super) texture: Texture,
    pub(crate) all: TextureView,
    /// One view for each layer.
    pub(crate) layers: Vec<TextureView>,
    /// Whether nothing has been drawn into the texture yet.
    pub(crate) is_fresh: bool,
}

/// The buffers that lookup reads.
#[derive(Debug)]
pub(crate) struct Buffers {
    settings: Buffer,
    lights: Buffer,
    maps: Buffer,
    planes: Buffer,
}

/// What lookups read beside the buffers that the CPU writes.
pub(crate) struct LookupParts<'a> {
    pub(crate) view: &'a TextureView,
    /// Levels and table of pages.
    pub(crate) pages: Option<[&'a Buffer; 2]>,
}

/// The matrices with which casters are drawn into the stale maps, one every `stride` bytes, and the
/// bind group that shows one of them.
#[derive(Debug)]
pub(crate) struct CasterBuffer {
    pub(crate) layout: BindGroupLayout,
    buffer: Buffer,
    pub(crate) bind_group: BindGroup,
    pub(crate) stride: u32,
    bytes: Vec<u8>,
}

impl DepthTexture {
    pub(crate) fn new(
        device: &Device,
        support: &Support,
        layout: Layout,
        size: [u32; 2],
        layers: u32,
    ) -> Self {
        let layers = if layout == Layout::Layers { support.array_layers(layers) } else { 1 };
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("shadow depths"),
            size: Extent3d {
                width: size[0].max(1),
                height: size[1].max(1),
                depth_or_array_layers: layers,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT
                | TextureUsages::TEXTURE_BINDING
                | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = |dimension, layer, count| {
            texture.create_view(&TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer: layer,
                array_layer_count: count,
                ..TextureViewDescriptor::default()
            })
        };
        let all = view(view_dimension(layout), 0, None);
        let layers = (0..layers).map(|i| view(TextureViewDimension::D2, i, Some(1)));
        Self { all, layers: layers.collect(), texture, is_fresh: true }
    }

    /// Width and height, texels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }

    /// Whether maps that need this much fit, without leaving more than three quarters of the
    /// texture unused.
    pub(super) fn holds(&self, size: [u32; 2], layers: u32) -> bool {
        let Extent3d { width, height, depth_or_array_layers } = self.texture.size();
        let texels =
            |[w, h]: [u32; 2], layers: u32| u64::from(w) * u64::from(h) * u64::from(layers);
        let has = texels([width, height], depth_or_array_layers);
        size[0] <= width
            && size[1] <= height
            && layers <= depth_or_array_layers
            && has <= 4 * texels(size, layers).max(1)
    }

    /// Width and height, texels, of the texture that will hold maps which need this much.
    pub(super) fn size_for(&self, size: [u32; 2], layers: u32) -> [u32; 2] {
        let Extent3d { width, height, .. } = self.texture.size();
        if self.holds(size, layers) { [width, height] } else { size }
    }
}

impl Buffers {
    pub(super) fn new(device: &Device, kind: LookupBuffers) -> Self {
        // The arrays in uniform buffers have a fixed length.
        let [lights, maps, planes] = match kind {
            LookupBuffers::Uniform => [MAX_LIGHTS, MAX_MAPS, MAX_PLANES],
            LookupBuffers::Storage => [1; 3],
        };
        Self {
            settings: buffer(device, size_of::<data::Settings>(), BufferUsages::UNIFORM),
            lights: array::<data::Light>(device, kind, lights),
            maps: array::<data::Map>(device, kind, maps),
            planes: array::<[f32; 4]>(device, kind, planes),
        }
    }

    /// Replaces the buffers that are too small for `lookup`; `true` if any was replaced.
    pub(crate) fn hold(&mut self, device: &Device, kind: LookupBuffers, lookup: &Lookup) -> bool {
        let mut has_grown = false;
        let mut hold = |buffer: &mut Buffer, bytes: usize| {
            if buffer.size() < bytes as u64 {
                *buffer = array::<u8>(device, kind, bytes.next_power_of_two());
                has_grown = true;
            }
        };
        hold(&mut self.lights, size_of_val(lookup.lights.as_slice()));
        hold(&mut self.maps, size_of_val(lookup.maps.as_slice()));
        hold(&mut self.planes, size_of_val(lookup.planes.as_slice()));
        has_grown
    }

    pub(crate) fn upload(&self, queue: &Queue, lookup: &Lookup) {
        queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&lookup.settings));
        queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&lookup.lights));
        queue.write_buffer(&self.maps, 0, bytemuck::cast_slice(&lookup.maps));
        queue.write_buffer(&self.planes, 0, bytemuck::cast_slice(&lookup.planes));
    }

    pub(crate) fn bind(
        &self,
        device: &Device,
        layout: &BindGroupLayout,
        parts: &LookupParts<'_>,
        sampler: &wgpu::Sampler,
    ) -> BindGroup {
        let resources = [
            self.settings.as_entire_binding(),
            self.lights.as_entire_binding(),
            self.maps.as_entire_binding(),
            self.planes.as_entire_binding(),
            BindingResource::TextureView(parts.view),
            BindingResource::Sampler(sampler),
        ];
        let of_pages = parts.pages.into_iter().flatten().map(|b| b.as_entire_binding());
        let entries = (0..).zip(resources.into_iter().chain(of_pages));
        let entries: Vec<_> =
            entries.map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow lookup"),
            layout,
            entries: &entries,
        })
    }
}

impl Buffers {
    /// Buffers in place of those of pages while there are none.
    pub(crate) fn stand_ins(device: &Device) -> [Buffer; 2] {
        [(); 2].map(|()| buffer(device, 64, BufferUsages::STORAGE))
    }

    /// The buffer of the maps.
    pub(crate) fn maps(&self) -> &Buffer {
        &self.maps
    }
}

impl CasterBuffer {
    pub(super) fn new(device: &Device, support: &Support) -> Self {
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("shadow casters"),
            entries: &[BindGroupLayoutEntry {
                binding: 0,
                visibility: ShaderStages::VERTEX,
                ty: BindingType::Buffer {
                    ty: BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: NonZeroU64::new(size_of::<CasterMap>() as u64),
                },
                count: None,
            }],
        });
        let stride = (size_of::<CasterMap>() as u32).next_multiple_of(support.uniform_alignment);
        let buffer = buffer(device, stride as usize, BufferUsages::UNIFORM);
        let bind_group = Self::bind(device, &layout, &buffer);
        Self { layout, buffer, bind_group, stride, bytes: Vec::new() }
    }

    fn bind(device: &Device, layout: &BindGroupLayout, buffer: &Buffer) -> BindGroup {
        device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow casters"),
            layout,
            entries: &[BindGroupEntry {
                binding: 0,
                resource: BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset: 0,
                    size: NonZeroU64::new(size_of::<CasterMap>() as u64),
                }),
            }],
        })
    }

    pub(super) fn upload(&mut self, device: &Device, queue: &Queue, records: &[Record]) {
        let stride = self.stride as usize;
        self.bytes.clear();
        for record in records.iter().filter(|r| r.stale_place().is_some()) {
            let map = CasterMap { clip_from_render: record.clip_from_render.as_mat4() };
            self.bytes.extend_from_slice(bytemuck::bytes_of(&map));
            self.bytes.resize(self.bytes.len().next_multiple_of(stride), 0);
        }
        if self.buffer.size() < self.bytes.len() as u64 {
            let bytes = self.bytes.len().next_power_of_two();
            self.buffer = buffer(device, bytes, BufferUsages::UNIFORM);
            self.bind_group = Self::bind(device, &self.layout, &self.buffer);
        }
        queue.write_buffer(&self.buffer, 0, &self.bytes);
    }
}

pub(super) fn view_dimension(layout: Layout) -> TextureViewDimension {
    match layout {
        Layout::Atlas => TextureViewDimension::D2,
        Layout::Layers => TextureViewDimension::D2Array,
    }
}

/// A buffer of this many bytes that the CPU writes.
fn buffer(device: &Device, bytes: usize, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("shadows"),
        size: bytes as u64,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A buffer for `n` elements that lookup reads.
fn array<T>(device: &Device, kind: LookupBuffers, n: usize) -> Buffer {
    let usage = match kind {
        LookupBuffers::Uniform => BufferUsages::UNIFORM,
        LookupBuffers::Storage => BufferUsages::STORAGE,
    };
    buffer(device, size_of::<T>() * n, usage)
}
