use super::document::{Document, Notices};
use crate::error::SceneError;
use crate::types::{Alpha, Material, Texture, TextureId, Wrap};
use glam::{Affine2, Vec2, Vec4};
use gltf::json::material::AlphaMode;
use gltf::json::texture::{Info, WrappingMode};
use gltf::json::validation::Checked;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::collections::HashMap;
use std::io::Cursor;

/// Largest width and height of an image, pixels.
const MAX_IMAGE_SIDE: u32 = 16_384;
/// Largest number of pixels of all images of a scene together: 2 GiB once decoded.
const MAX_PIXELS: u64 = 1 << 29;

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
    /// Keyed by the image's index in the file and its addressing modes, because files list textures
    /// that differ only in properties which are not read. The value is `None` if the image could
    /// not be loaded.
    loaded_textures: HashMap<(usize, [Wrap; 2]), Option<TextureId>>,
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
            AlphaMode::Mask => Alpha::Mask { cutoff: cutoff.clamp(0.0, 1.0) },
            AlphaMode::Blend => {
                notices
                    .add(&place, "is translucent: solid where alpha is at least 0.5, else absent");
                Alpha::Mask { cutoff: 0.5 }
            }
        };
        let mut material = Material {
            alpha,
            double_sided: json.double_sided,
            ..plain(
                &json.name.clone().unwrap_or(place.clone()),
                factor.clamp(Vec4::ZERO, Vec4::ONE),
            )
        };
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
        let wrap = match json.sampler {
            None => [Wrap::Repeat; 2],
            Some(id) => {
                let sampler = document.get(id, &place)?;
                [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
                    Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                    Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                    Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
                })
            }
        };
        let key = (json.source.value(), wrap);
        if let Some(&found) = self.loaded_textures.get(&key) {
            return Ok(found);
        }
        let image = document.get(json.source, &place)?;
        let place = format!("images[{}]", json.source.value());
        let bytes = match (image.buffer_view, &image.uri) {
            (Some(view), _) => document.view(view, &place).map(<[u8]>::to_vec),
            (None, Some(uri)) => document.fetch(uri, &place),
            (None, None) => Err(document.invalid(&place, "has neither uri nor bufferView")),
        };
        let decoded_so_far: u64 = self.textures.iter().map(|t| t.rgba.len() as u64).sum();
        // A missing or invalid image only loses a colour, so the scene is loaded without it.
        let decoded = bytes.map_err(|e| e.to_string()).and_then(|bytes| {
            decode(&bytes, MAX_PIXELS - decoded_so_far).map_err(|e| format!("{place}: {e}"))
        });
        let id = match decoded {
            Ok(image) => {
                let rgba = image.into_rgba8();
                let size = rgba.dimensions().into();
                let rgba = rgba.pixels().map(|p| p.0).collect();
                self.textures.push(Texture { size, rgba, wrap });
                Some(TextureId(self.textures.len() - 1))
            }
            Err(problem) => {
                notices.add(&place, format!("left out, its materials are plain: {problem}"));
                None
            }
        };
        self.loaded_textures.insert(key, id);
        Ok(id)
    }
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

fn decode(bytes: &[u8], max_pixels: u64) -> Result<DynamicImage, String> {
    let open = || ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = open().map_err(|e| e.to_string())?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        return Err("is neither PNG nor JPEG".into());
    }
    let dimensions = open().map_err(|e| e.to_string())?.into_dimensions();
    let (width, height) = dimensions.map_err(|e| e.to_string())?;
    if u64::from(width) * u64::from(height) > max_pixels {
        return Err(format!("{width}x{height} pixels exceed {MAX_PIXELS} for all images together"));
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_IMAGE_SIDE);
    limits.max_image_height = Some(MAX_IMAGE_SIDE);
    reader.limits(limits);
    reader.decode().map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_have_a_budget() {
        let mut png = Cursor::new(Vec::new());
        DynamicImage::new_rgb8(7, 5).write_to(&mut png, ImageFormat::Png).unwrap();
        let png = png.into_inner();
        assert_eq!(decode(&png, 35).unwrap().width(), 7);
        assert!(decode(&png, 34).unwrap_err().starts_with("7x5 pixels exceed"));
    }
}
