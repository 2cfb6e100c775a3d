//! Samples of a picture, read back from the GPU to be measured.

use crate::renderer::{Drawn, Pipelines, Renderer, Shading, Target};
use crate::view::Tile;
use crate::{Error, Gpu};
use glam::{Vec2, Vec3, Vec4};
use std::ops::Range;
use umbrage_wgpu::DEPTH_FORMAT;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT, CommandEncoder, Extent3d,
    StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages, TextureViewDescriptor,
};

/// The values of the GPU at a point of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Linear colour.
    pub radiance: Vec3,
    /// Visibility by the shadow maps, from 0 to 1: 0 where the surface faces away from the light, 1
    /// in the sky.
    pub visibility: f32,
    /// Whether the sample shows a surface that faces the light and is within the light's reach.
    pub is_facing: bool,
    /// Distance along the view direction, metres; infinite in the sky.
    pub depth: f32,
    /// Shading normal in world space; zero in the sky.
    pub normal: Vec3,
    /// Index in the plan of the map that serves the point; `None` if no map does.
    pub map: Option<u32>,
    /// Texel coordinates in that map; NaN without a map.
    pub texel: Vec2,
    /// Pixels per texel on the surface, in the worst direction; NaN without a map.
    pub error: f32,
}

/// Texture format of the samples that are read back.
pub(crate) const SAMPLE_FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// Largest width and height of a tile, samples: each of its three layers takes up to 16 MiB.
const TILE: u32 = 1024;

impl Renderer<'_> {
    /// Samples of some of a picture's rows, row by row and pixel by pixel from the left. Each pixel
    /// has a regular grid of `grid` × `grid` samples, also row by row. The maps must have been
    /// drawn. Maps, texels and errors are only computed if `wants_texels` is true.
    ///
    /// # Errors
    /// The device refused something or was lost.
    pub fn samples(
        &mut self,
        shading: &Shading<'_>,
        rows: Range<u32>,
        grid: u32,
        wants_texels: bool,
    ) -> Result<Vec<Sample>, Error> {
        let width = shading.camera.image()[0] * grid;
        let [first, end] = [rows.start * grid, rows.end * grid];
        let nothing = Sample::new(Vec4::ZERO, Vec4::ZERO, Vec4::new(0.0, 0.0, -1.0, 0.0));
        let mut samples = vec![nothing; (width as usize) * (end - first) as usize];
        let side = TILE.min(self.gpu.device().limits().max_texture_dimension_2d);
        let picture = self.pipelines("picture", &[SAMPLE_FORMAT, SAMPLE_FORMAT]);
        let texels = wants_texels.then(|| self.pipelines("texels", &[SAMPLE_FORMAT]));
        let size = [side.min(width), side.min(end - first)];
        let layers = Layers::new(self.gpu, size);
        for top in (first..end).step_by(side as usize) {
            for left in (0..width).step_by(side as usize) {
                let size = [side.min(width - left), side.min(end - top)];
                let tile = Tile { origin: [left, top], size, grid };
                let data = layers.draw(self, shading, &tile, &picture, texels.as_ref())?;
                for (i, sample) in data.into_iter().enumerate() {
                    let [x, y] = [i as u32 % size[0] + left, i as u32 / size[0] + top - first];
                    let pixel = (y / grid) * (width / grid) + x / grid;
                    let within = (y % grid) * grid + x % grid;
                    samples[(pixel * grid * grid + within) as usize] = sample;
                }
            }
        }
        Ok(samples)
    }
}

impl Sample {
    fn new(radiance_visibility: Vec4, normal_depth: Vec4, texel: Vec4) -> Self {
        let visibility = radiance_visibility.w;
        let is_sky = normal_depth == Vec4::ZERO;
        let map = (texel.z >= 0.0).then_some(texel.z as u32);
        Self {
            radiance: radiance_visibility.truncate(),
            visibility: visibility.max(0.0),
            is_facing: visibility >= 0.0 && !is_sky,
            depth: if is_sky { f32::INFINITY } else { normal_depth.w },
            normal: normal_depth.truncate(),
            map,
            texel: if map.is_some() { Vec2::new(texel.x, texel.y) } else { Vec2::NAN },
            error: if map.is_some() { texel.w } else { f32::NAN },
        }
    }
}

/// The textures that a tile is drawn into, and a buffer through which all are read back.
struct Layers {
    color: [Texture; 2],
    depth: Texture,
    readback: Buffer,
    bytes_per_row: u32,
    bytes: u64,
}

impl Layers {
    fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Self {
        let texture = |format| {
            gpu.device().create_texture(&TextureDescriptor {
                label: Some("samples"),
                size: Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let bytes_per_row = (16 * width).next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(bytes_per_row) * u64::from(height);
        let readback = gpu.device().create_buffer(&BufferDescriptor {
            label: Some("samples"),
            size: 3 * bytes,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self {
            color: [texture(SAMPLE_FORMAT), texture(SAMPLE_FORMAT)],
            depth: texture(DEPTH_FORMAT),
            readback,
            bytes_per_row,
            bytes,
        }
    }

    fn draw(
        &self,
        renderer: &mut Renderer<'_>,
        shading: &Shading<'_>,
        tile: &Tile,
        picture: &Pipelines,
        texels: Option<&Pipelines>,
    ) -> Result<Vec<Sample>, Error> {
        let view = |t: &Texture| t.create_view(&TextureViewDescriptor::default());
        let [first, second, depth] = [&self.color[0], &self.color[1], &self.depth].map(view);
        // A tile at the edge of the picture is drawn into a corner of the textures.
        let device = renderer.gpu.device();
        let full = Tile { size: [self.color[0].width(), self.color[0].height()], ..*tile };
        let (depth_store, is_frame) = (StoreOp::Discard, false);
        loop {
            let mut encoder = device.create_command_encoder(&Default::default());
            let (color, pipelines) = (&[&first, &second][..], picture);
            let target = Target { color, depth: &depth, depth_store, is_frame, pipelines };
            renderer.encode_picture(&mut encoder, shading, &full, &target, None)?;
            self.copy(&mut encoder, 0, 0);
            self.copy(&mut encoder, 1, 1);
            if let Some(pipelines) = texels {
                let target =
                    Target { color: &[&first], depth: &depth, depth_store, is_frame, pipelines };
                renderer.encode_picture(&mut encoder, shading, &full, &target, None)?;
                self.copy(&mut encoder, 0, 2);
            }
            renderer.gpu.queue().submit([encoder.finish()]);
            if renderer.is_whole(&mut Drawn::default())? {
                break;
            }
        }
        let data: Vec<Vec4> = renderer.gpu.read(&self.readback)?;
        let layer = self.bytes as usize / size_of::<Vec4>();
        let row = self.bytes_per_row as usize / size_of::<Vec4>();
        let none = Vec4::new(0.0, 0.0, -1.0, 0.0);
        let mut samples = Vec::with_capacity((tile.size[0] * tile.size[1]) as usize);
        for y in 0..tile.size[1] as usize {
            for i in (0..tile.size[0] as usize).map(|x| y * row + x) {
                let texel = if texels.is_some() { data[2 * layer + i] } else { none };
                samples.push(Sample::new(data[i], data[layer + i], texel));
            }
        }
        Ok(samples)
    }

    /// Copies a texture into a third of the buffer.
    fn copy(&self, encoder: &mut CommandEncoder, texture: usize, third: u64) {
        let texture = &self.color[texture];
        let layout = TexelCopyBufferLayout {
            offset: third * self.bytes,
            bytes_per_row: Some(self.bytes_per_row),
            rows_per_image: None,
        };
        let buffer = TexelCopyBufferInfo { buffer: &self.readback, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), buffer, texture.size());
    }
}
