use super::document::{Document, Notices};
use crate::error::SceneError;
use crate::types::{Alpha, Material, Sampling, Texture, TextureId, Wrap};
use glam::{Affine2, Vec2, Vec4};
use gltf::json::material::AlphaMode;
use gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Cursor;

/// Largest width and height of an image, pixels.
const MAX_IMAGE_SIDE: u32 = 16_384;

/// The texture coordinates of a primitive that a material uses, and the transform that it applies
/// to them.
#[derive(Clone, Copy)]
pub(super) struct TexCoords {
    /// The n of `TEXCOORD_n`.
    pub(super) set: u32,
    /// The transform of `KHR_texture_transform`.
    pub(super) transform: Affine2,
}

/// The file's materials, each loaded when a primitive first uses it.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    /// Keyed by index in the file; `None` is glTF's default material.
    loaded: HashMap<Option<usize>, (usize, Option<TexCoords>)>,
    /// Keyed by the image's index in the file, its addressing modes and its sampling, because files
    /// list textures that differ only in properties which are not read. The value is `None` if the
    /// image could not be loaded.
    loaded_textures: HashMap<(usize, [Wrap; 2], Sampling), Option<TextureId>>,
}

impl Materials {
    /// Loads a material unless that is done already. Returns its index, and the texture coordinates
    /// that its texture uses.
    pub(super) fn load(
        &mut self,
        document: &Document,
        index: Option<gltf::json::Index<gltf::json::Material>>,
        place: &str,
        notices: &mut Notices,
    ) -> Result<(usize, Option<TexCoords>), SceneError> {
        let key = index.map(|i| i.value());
        if let Some(&found) = self.loaded.get(&key) {
            return Ok(found);
        }
        let (material, coords) = match index {
            None => (plain("default", Vec4::ONE), None),
            Some(index) => {
                let json = document.get(index, place)?;
                self.material(document, json, index.value(), notices)?
            }
        };
        self.materials.push(material);
        self.loaded.insert(key, (self.materials.len() - 1, coords));
        Ok((self.materials.len() - 1, coords))
    }

    fn material(
        &mut self,
        document: &Document,
        json: &gltf::json::Material,
        index: usize,
        notices: &mut Notices,
    ) -> Result<(Material, Option<TexCoords>), SceneError> {
        let place = format!("materials[{index}]");
        let Checked::Valid(mode) = json.alpha_mode else {
            return Err(document.invalid(&place, "alphaMode must be OPAQUE, MASK or BLEND"));
        };
        let pbr = &json.pbr_metallic_roughness;
        let factor = Vec4::from(pbr.base_color_factor.0);
        let cutoff = json.alpha_cutoff.map_or(0.5, |c| c.0);
        if !factor.is_finite() || !cutoff.is_finite() {
            return Err(document.invalid(&place, "colour or alpha cutoff is not finite"));
        }
        let alpha = match mode {
            AlphaMode::Opaque => Alpha::Opaque,
            AlphaMode::Mask => Alpha::Mask { cutoff: cutoff.max(0.0) },
            AlphaMode::Blend => {
                notices
                    .add(&place, "is translucent: solid where alpha is at least 0.5, else absent");
                Alpha::Mask { cutoff: 0.5 }
            }
        };
        let base_color = factor.clamp(Vec4::ZERO, Vec4::ONE);
        if base_color != factor {
            notices
                .add(&place, "baseColorFactor is not within 0 and 1, the nearest colour instead");
        }
        let mut material = Material {
            alpha,
            double_sided: json.double_sided,
            ..plain(&json.name.clone().unwrap_or(place.clone()), base_color)
        };
        let others = [
            json.normal_texture.is_some(),
            json.occlusion_texture.is_some(),
            json.emissive_texture.is_some(),
            pbr.metallic_roughness_texture.is_some(),
        ];
        if others.contains(&true) {
            notices.add(&place, "textures other than that of the base colour are not drawn");
        }
        if json.emissive_factor.0 != [0.0; 3] {
            notices.add(&place, "the light that it emits is not drawn");
        }
        let mut coords = None;
        if let Some(info) = &pbr.base_color_texture {
            material.base_color_texture = self.texture(document, info, &place, notices)?;
            coords = material.base_color_texture.map(|_| tex_coords(info));
        }
        Ok((material, coords))
    }

    fn texture(
        &mut self,
        document: &Document,
        info: &Info,
        place: &str,
        notices: &mut Notices,
    ) -> Result<Option<TextureId>, SceneError> {
        let json = document.get(info.index, place)?;
        let place = format!("textures[{}]", info.index.value());
        // That is how the crate tells that there is no image.
        if json.source.value() == u32::MAX as usize {
            notices.add(&place, "has no PNG or JPEG image, left out, its materials are plain");
            return Ok(None);
        }
        let (wrap, sampling) = match json.sampler {
            None => ([Wrap::Repeat; 2], Sampling::Linear),
            Some(id) => {
                let sampler = document.get(id, &place)?;
                let place = format!("samplers[{}]", id.value());
                ([sampler.wrap_s, sampler.wrap_t].map(wrap), sampling(sampler, &place, notices))
            }
        };
        let key = (json.source.value(), wrap, sampling);
        if let Some(&found) = self.loaded_textures.get(&key) {
            return Ok(found);
        }
        let image = document.get(json.source, &place)?;
        let place = format!("images[{}]", json.source.value());
        let taken = document.budget.taken();
        // A missing or invalid image only loses a colour, so the scene is loaded without it.
        let id = match load_image(document, image, &place) {
            Ok((size, rgba)) => {
                document.budget.give_back_to(taken);
                document.budget.take(&place, rgba.len() as u64, "pixels", size_of::<[u8; 4]>())?;
                self.textures.push(Texture { size, rgba, wrap, sampling });
                Some(TextureId(self.textures.len() - 1))
            }
            Err(problem) => {
                document.budget.give_back_to(taken);
                notices.add_because(&place, "left out, its materials are plain", &problem);
                None
            }
        };
        self.loaded_textures.insert(key, id);
        Ok(id)
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

/// How a texture is sampled. Images have no mip levels here, so `magFilter` alone counts; without
/// it, what `minFilter` says.
fn sampling(sampler: &Sampler, place: &str, notices: &mut Notices) -> Sampling {
    let magnified = sampler.mag_filter.map(|filter| match filter {
        Checked::Valid(MagFilter::Nearest) => Sampling::Nearest,
        Checked::Valid(MagFilter::Linear) | Checked::Invalid => Sampling::Linear,
    });
    let minified = sampler.min_filter.map(|filter| match filter {
        Checked::Valid(
            MinFilter::Nearest | MinFilter::NearestMipmapNearest | MinFilter::NearestMipmapLinear,
        ) => Sampling::Nearest,
        Checked::Valid(
            MinFilter::Linear | MinFilter::LinearMipmapNearest | MinFilter::LinearMipmapLinear,
        )
        | Checked::Invalid => Sampling::Linear,
    });
    let unknown = [
        sampler.mag_filter == Some(Checked::Invalid),
        sampler.min_filter == Some(Checked::Invalid),
        sampler.wrap_s == Checked::Invalid,
        sampler.wrap_t == Checked::Invalid,
    ];
    if unknown.contains(&true) {
        notices.add(place, "has an unknown filter or wrapping mode, linear and repeated instead");
    }
    if magnified.zip(minified).is_some_and(|(a, b)| a != b) {
        notices.add(place, "minFilter is not used, magFilter counts at every distance");
    }
    magnified.or(minified).unwrap_or_default()
}

fn plain(name: &str, base_color: Vec4) -> Material {
    Material {
        name: name.into(),
        base_color,
        base_color_texture: None,
        alpha: Alpha::Opaque,
        double_sided: false,
    }
}

fn tex_coords(info: &Info) -> TexCoords {
    let extension = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    let Some(t) = extension else {
        return TexCoords { set: info.tex_coord, transform: Affine2::IDENTITY };
    };
    // The rotation is counter-clockwise in a picture in which v increases downwards.
    let [scale, offset] = [t.scale.0, t.offset.0].map(Vec2::from);
    TexCoords {
        set: t.tex_coord.unwrap_or(info.tex_coord),
        transform: Affine2::from_scale_angle_translation(scale, -t.rotation.0, offset),
    }
}

type Pixels = Vec<[u8; 4]>;

/// Width and height of an image, and its pixels as red, green, blue and straight alpha.
fn load_image(
    document: &Document,
    image: &gltf::json::Image,
    place: &str,
) -> Result<([u32; 2], Pixels), String> {
    let bytes = match (image.buffer_view, &image.uri) {
        (Some(view), _) => document.view(view, place).map(Cow::Borrowed),
        (None, Some(uri)) => document.fetch(uri, place).map(Cow::Owned),
        (None, None) => Err(document.invalid(place, "has neither uri nor bufferView")),
    };
    let bytes = bytes.map_err(|e| e.to_string())?;
    let take = |bytes| document.budget.take(place, bytes, "bytes of pixels", 1);
    decode(&bytes, |bytes| take(bytes).map_err(|e| e.to_string()))
}

/// Decodes an image, after `take` was told how many bytes that takes.
fn decode(
    bytes: &[u8],
    take: impl Fn(u64) -> Result<(), String>,
) -> Result<([u32; 2], Pixels), String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|e| e.to_string())?;
    let format = reader.format();
    if !matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err("is neither PNG nor JPEG".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_IMAGE_SIDE);
    limits.max_image_height = Some(MAX_IMAGE_SIDE);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let (color, decoded) = (decoder.color_type(), decoder.total_bytes());
    // A progressive JPEG is decoded by way of 16-bit coefficients.
    let coefficients = if format == Some(ImageFormat::Jpeg) { 2 * decoded } else { 0 };
    let size = [width, height];
    let rgba_bytes = size_of::<[u8; 4]>() as u64 * pixels;
    if decoded > rgba_bytes || color.bytes_per_pixel() != color.channel_count() {
        // Sixteen bits for each channel are decoded beside the result.
        take(rgba_bytes + decoded.max(rgba_bytes) + coefficients)?;
        let image = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
        let rgba = image.into_rgba8().into_raw();
        return Ok((size, rgba.as_chunks().0.to_vec()));
    }
    take(rgba_bytes + coefficients)?;
    let mut rgba = vec![[0; 4]; pixels as usize];
    let decoded = decoded as usize;
    decoder.read_image(&mut rgba.as_flattened_mut()[..decoded]).map_err(|e| e.to_string())?;
    widen(rgba.as_flattened_mut(), color.channel_count().into());
    Ok((size, rgba))
}

/// Turns pixels of `channels` bytes each, which fill the beginning of `bytes`, into pixels of four
/// bytes. The last pixel comes first, so that none is overwritten before it is read.
fn widen(bytes: &mut [u8], channels: usize) {
    if channels == 4 {
        return;
    }
    for i in (0..bytes.len() / 4).rev() {
        let from = &bytes[channels * i..channels * (i + 1)];
        let pixel = match *from {
            [gray] => [gray, gray, gray, 255],
            [gray, alpha] => [gray, gray, gray, alpha],
            [r, g, b] => [r, g, b, 255],
            _ => unreachable!("images of one to four channels"),
        };
        bytes[4 * i..4 * (i + 1)].copy_from_slice(&pixel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(image: &DynamicImage) -> Vec<u8> {
        let mut png = Cursor::new(Vec::new());
        image.write_to(&mut png, ImageFormat::Png).unwrap();
        png.into_inner()
    }

    #[test]
    fn images_are_taken_from_the_budget_before_they_are_decoded() {
        let png = png(&DynamicImage::new_rgb8(7, 5));
        let within = |limit| {
            move |bytes| if bytes <= limit { Ok(()) } else { Err(format!("{bytes} bytes")) }
        };
        let (size, rgba) = decode(&png, within(4 * 35)).unwrap();
        assert_eq!((size, rgba.len()), ([7, 5], 35));
        assert_eq!(decode(&png, within(4 * 35 - 1)).unwrap_err(), "140 bytes");
    }

    /// Whatever channels an image has, its pixels are those that the crate's own conversion gives.
    #[test]
    fn every_kind_of_image_becomes_rgba() {
        let noise = image::Rgba32FImage::from_fn(13, 6, |x, y| {
            let value = |k: u32| ((x * 7 + y * 31 + k * 17) % 23) as f32 / 22.0;
            image::Rgba([value(0), value(1), value(2), value(3)])
        });
        let noise = DynamicImage::from(noise);
        for image in [
            DynamicImage::from(noise.to_luma8()),
            noise.to_luma_alpha8().into(),
            noise.to_rgb8().into(),
            noise.to_rgba8().into(),
            noise.to_luma16().into(),
            noise.to_luma_alpha16().into(),
            noise.to_rgb16().into(),
            noise.to_rgba16().into(),
        ] {
            let (size, rgba) = decode(&png(&image), |_| Ok(())).unwrap();
            assert_eq!(size, [13, 6]);
            assert_eq!(rgba.as_flattened(), image.to_rgba8().as_raw(), "{:?}", image.color());
        }
    }
}
