//! The textures that frames are drawn into, shown from and read back from.

use crate::{Error, Gpu};
use umbrage_wgpu::DEPTH_FORMAT;
use wgpu::{
    BufferDescriptor, BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT, CommandEncoder, Extent3d,
    TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

/// Texture format of the frames to display.
pub const FRAME_FORMAT: TextureFormat = TextureFormat::Rgba8UnormSrgb;

/// The format in which a frame gives its sRGB values as they are stored.
const SHOWN_FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// The textures that frames are drawn into.
pub struct FrameTarget {
    color: Texture,
    pub(crate) color_view: TextureView,
    shown_view: TextureView,
    /// A copy of `color`, where the device cannot read a texture in two formats.
    copy: Option<Texture>,
    pub(crate) depth: TextureView,
}

impl FrameTarget {
    /// Makes a target of this width and height, pixels, each at least 1.
    ///
    /// # Errors
    /// A side is 0, or larger than the device's largest texture.
    pub fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Self, Error> {
        let max = gpu.device().limits().max_texture_dimension_2d;
        if width == 0 || height == 0 {
            return Err(Error::Invalid {
                field: "size",
                problem: format!("must be at least one pixel to each side, is {width}x{height}"),
            });
        }
        if width > max || height > max {
            return Err(Error::TooLarge {
                what: format!("a frame of {width}x{height} pixels"),
                problem: format!("at most {max} pixels in width and height"),
            });
        }
        let texture = |format, usage, view_formats: &[TextureFormat]| {
            gpu.device().create_texture(&TextureDescriptor {
                label: Some("frame"),
                size: Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage,
                view_formats,
            })
        };
        let is_drawn = TextureUsages::RENDER_ATTACHMENT;
        let is_read = TextureUsages::TEXTURE_BINDING;
        let is_copied = TextureUsages::COPY_SRC;
        let view_formats = &[SHOWN_FORMAT][..if gpu.has_view_formats { 1 } else { 0 }];
        let color = texture(FRAME_FORMAT, is_drawn | is_read | is_copied, view_formats);
        let copy = (!gpu.has_view_formats)
            .then(|| texture(SHOWN_FORMAT, is_read | TextureUsages::COPY_DST, &[]));
        let depth = texture(DEPTH_FORMAT, is_drawn | is_read, &[]);
        let view = |t: &Texture| t.create_view(&TextureViewDescriptor::default());
        let shown_view = copy.as_ref().unwrap_or(&color).create_view(&TextureViewDescriptor {
            format: Some(SHOWN_FORMAT),
            usage: Some(is_read),
            ..TextureViewDescriptor::default()
        });
        gpu.check()?;
        Ok(Self { color_view: view(&color), shown_view, copy, depth: view(&depth), color })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.color.width(), self.color.height()]
    }

    /// The picture, in sRGB with the format [`FRAME_FORMAT`].
    pub fn color(&self) -> &Texture {
        &self.color
    }

    /// The picture for shaders that read sRGB values as they are stored, as those of windows do.
    /// Its format is `Rgba8Unorm`.
    pub fn shown_view(&self) -> &TextureView {
        &self.shown_view
    }

    /// Brings what [`shown_view`](Self::shown_view) gives up to date, after the picture is drawn.
    pub(crate) fn encode_copy(&self, encoder: &mut CommandEncoder) {
        if let Some(copy) = &self.copy {
            let (from, to) = (self.color.as_image_copy(), copy.as_image_copy());
            encoder.copy_texture_to_texture(from, to, copy.size());
        }
    }

    /// Waits for the picture and returns its sRGB values, with alpha, row by row from the upper
    /// left corner.
    ///
    /// # Errors
    /// The device refused something or was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<[u8; 4]>, Error> {
        let [width, height] = self.size();
        let bytes_per_row = (4 * width).next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT);
        let readback = gpu.device().create_buffer(&BufferDescriptor {
            label: Some("frame"),
            size: u64::from(bytes_per_row) * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(bytes_per_row),
            rows_per_image: None,
        };
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let to = TexelCopyBufferInfo { buffer: &readback, layout };
        encoder.copy_texture_to_buffer(self.color.as_image_copy(), to, self.color.size());
        gpu.queue().submit([encoder.finish()]);
        let mut pixels: Vec<[u8; 4]> = gpu.read(&readback)?;
        // Rows are padded in the buffer.
        let [stored, shown] = [bytes_per_row as usize / 4, width as usize];
        for row in 1..height as usize {
            pixels.copy_within(row * stored..row * stored + shown, row * shown);
        }
        pixels.truncate(shown * height as usize);
        Ok(pixels)
    }
}
