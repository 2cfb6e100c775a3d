//! Samples of a picture, read back from the GPU to be measured.

use crate::clusters::{FRAME_SHARE_PX, SAMPLE_SHARE_PX};
use crate::pipelines::Pipelines;
use crate::renderer::{Drawn, Renderer, Shading, Target};
use crate::timer::Stage;
use crate::view::Tile;
use crate::{Error, Gpu};
use glam::{Vec2, Vec3, Vec4};
use std::ops::Range;
use umbrage_wgpu::DEPTH_FORMAT;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT, CommandEncoder, Extent3d,
    StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

/// The values of the GPU at a point of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

/// A cluster of triangles that is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenCluster {
    /// A number for the cluster, the same in every picture of the scene.
    pub number: u32,
    /// Its level of detail: how often its triangles were simplified.
    pub level: u32,
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
        let mut passes = vec![self.pass("picture", 2, SAMPLE_SHARE_PX)];
        if wants_texels {
            passes.push(self.pass("texels", 1, SAMPLE_SHARE_PX));
        }
        let no_texel = Vec4::new(0.0, 0.0, -1.0, 0.0);
        let sample = |layers: &[Vec4]| {
            Sample::new(layers[0], layers[1], layers.get(2).copied().unwrap_or(no_texel))
        };
        self.sampled(shading, rows, grid, &passes, sample)
    }

    /// The cluster in the middle of each pixel of some of a picture's rows, row by row from the
    /// left; `None` in the sky. These are the clusters that [frames](Self::frame) are drawn of;
    /// [`samples`](Self::samples) may be of finer ones. Where
    /// [no clusters are drawn](Self::draws_clusters), all surfaces are one of level 0.
    ///
    /// # Errors
    /// The device refused something or was lost.
    pub fn seen_clusters(
        &mut self,
        shading: &Shading<'_>,
        rows: Range<u32>,
    ) -> Result<Vec<Option<SeenCluster>>, Error> {
        let passes = [self.pass("clusters", 1, FRAME_SHARE_PX)];
        let seen = |layers: &[Vec4]| {
            let [number, level] = [layers[0].x, layers[0].y];
            (level >= 0.0).then_some(SeenCluster { number: number as u32, level: level as u32 })
        };
        self.sampled(shading, rows, 1, &passes, seen)
    }

    /// The pass with the fragment shaders of this name, which write so many textures.
    fn pass(&mut self, name: &'static str, textures: usize, share_px: f32) -> Pass {
        let pipelines = self.pipelines(name, &vec![SAMPLE_FORMAT; textures]);
        Pass { pipelines, textures, share_px }
    }

    /// Draws passes of samples, and makes a value of what they write for each.
    fn sampled<T: Clone + Default>(
        &mut self,
        shading: &Shading<'_>,
        rows: Range<u32>,
        grid: u32,
        passes: &[Pass],
        value: impl Fn(&[Vec4]) -> T,
    ) -> Result<Vec<T>, Error> {
        let width = shading.camera.image()[0] * grid;
        let [first, end] = [rows.start * grid, rows.end * grid];
        let mut values = vec![T::default(); (width as usize) * (end - first) as usize];
        let side = TILE.min(self.gpu.device().limits().max_texture_dimension_2d);
        let size = [side.min(width), side.min(end - first)];
        let layers = Layers::new(self.gpu, size, passes);
        for top in (first..end).step_by(side as usize) {
            for left in (0..width).step_by(side as usize) {
                let size = [side.min(width - left), side.min(end - top)];
                let tile = Tile { origin: [left, top], size, grid };
                let data = layers.draw(self, shading, &tile, passes)?;
                for (i, written) in data.chunks(layers.count).enumerate() {
                    let [x, y] = [i as u32 % size[0] + left, i as u32 / size[0] + top - first];
                    let pixel = (y / grid) * (width / grid) + x / grid;
                    let within = (y % grid) * grid + x % grid;
                    values[(pixel * grid * grid + within) as usize] = value(written);
                }
            }
        }
        Ok(values)
    }
}

/// Something to draw of each tile.
struct Pass {
    pipelines: Pipelines,
    /// The number of textures that it writes.
    textures: usize,
    /// How far clusters may be off, pixels.
    share_px: f32,
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

/// The textures that the passes of a tile are drawn into, one after the other, and a buffer through
/// which all that they write is read back.
struct Layers {
    color: Vec<Texture>,
    depth: Texture,
    readback: Buffer,
    /// The number of textures that the passes write, all together.
    count: usize,
    bytes_per_row: u32,
    /// What a texture takes in the buffer.
    bytes: u64,
}

impl Layers {
    fn new(gpu: &Gpu, [width, height]: [u32; 2], passes: &[Pass]) -> Self {
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
        let textures = || passes.iter().map(|pass| pass.textures);
        let count = textures().sum();
        let bytes_per_row = (16 * width).next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(bytes_per_row) * u64::from(height);
        let readback = gpu.device().create_buffer(&BufferDescriptor {
            label: Some("samples"),
            size: count as u64 * bytes,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let most = textures().max().unwrap_or(0);
        Self {
            color: (0..most).map(|_| texture(SAMPLE_FORMAT)).collect(),
            depth: texture(DEPTH_FORMAT),
            readback,
            count,
            bytes_per_row,
            bytes,
        }
    }

    /// What the passes write for each sample of a tile, sample after sample.
    fn draw(
        &self,
        renderer: &mut Renderer<'_>,
        shading: &Shading<'_>,
        tile: &Tile,
        passes: &[Pass],
    ) -> Result<Vec<Vec4>, Error> {
        let view = |t: &Texture| t.create_view(&TextureViewDescriptor::default());
        let color: Vec<TextureView> = self.color.iter().map(view).collect();
        let color: Vec<&TextureView> = color.iter().collect();
        let depth = view(&self.depth);
        // A tile at the edge of the picture is drawn into a corner of the textures.
        let device = renderer.gpu.device();
        let full = Tile { size: [self.depth.width(), self.depth.height()], ..*tile };
        let depth_store = StoreOp::Discard;
        let mut first_layer = 0;
        for &Pass { ref pipelines, textures, share_px } in passes {
            let color = &color[..textures];
            let (depth, is_frame, stage) = (&depth, false, Stage::Picture);
            let target = Target { color, depth, depth_store, share_px, is_frame, pipelines, stage };
            loop {
                let mut encoder = device.create_command_encoder(&Default::default());
                renderer.encode_picture(&mut encoder, shading, &full, &target, None)?;
                for (texture, layer) in self.color[..textures].iter().zip(first_layer..) {
                    self.copy(&mut encoder, texture, layer);
                }
                renderer.gpu.queue().submit([encoder.finish()]);
                if renderer.is_whole(&mut Drawn::default())? {
                    break;
                }
            }
            first_layer += textures as u64;
        }
        let data: Vec<Vec4> = renderer.gpu.read(&self.readback)?;
        let layer = self.bytes as usize / size_of::<Vec4>();
        let row = self.bytes_per_row as usize / size_of::<Vec4>();
        let [width, height] = tile.size.map(|side| side as usize);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| y * row + x));
        Ok(places
            .flat_map(|i| (0..self.count).map(move |n| n * layer + i))
            .map(|i| data[i])
            .collect())
    }

    /// Copies a texture into the buffer, as its layer of this index.
    fn copy(&self, encoder: &mut CommandEncoder, texture: &Texture, index: u64) {
        let layout = TexelCopyBufferLayout {
            offset: index * self.bytes,
            bytes_per_row: Some(self.bytes_per_row),
            rows_per_image: None,
        };
        let buffer = TexelCopyBufferInfo { buffer: &self.readback, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), buffer, texture.size());
    }
}
