use crate::Error;
use umbrage::{Cover, Partition, Size, Technique};
use wgpu::{
    Adapter, Backend, Device, DownlevelFlags, Features, Limits, TextureFormat,
    TextureFormatFeatureFlags, TextureUsages,
};

/// The capabilities of a device that shadows depend on. All decisions about fallbacks are made
/// here. Without
///
/// - [`Features::DEPTH_CLIP_CONTROL`], the fragment shader clamps the depths of casters in front of
///   a map's depth range and writes them: the same picture, but slower;
/// - [`Features::CLIP_DISTANCES`], [pages](umbrage::paged) are drawn by discarding what lies beside
///   them, which takes many times as long where triangles are large;
/// - storage buffers in fragment shaders (WebGL2), lookups always read uniform buffers (see
///   [`LookupBuffers`](crate::LookupBuffers));
/// - fetching depths (OpenGL, WebGL2), `hard` and `pcf` compare by
///   [`Comparison::Hardware`](crate::Comparison::Hardware) in place of `PerTexel`, and all other
///   filters are [`Error::Unsupported`];
/// - array textures with any number of layers (OpenGL), there is one more layer where 1 or a
///   multiple of 6 are needed;
/// - interpolation of 32-bit floats, 16-bit normalised or signed 8-bit textures, the prefilters
///   that store their statistics in such textures are [`Error::Unsupported`];
/// - storage buffers in vertex shaders, indirect draws, or ten storage buffers in compute shaders,
///   there are no [clusters](crate::ClusterGeometry) but [`MeshCasters`](crate::MeshCasters) alone,
///   whose time grows with the number of triangles;
/// - what clusters need, and twelve storage buffers in compute shaders, plans with
///   [pages](umbrage::paged) are [`Error::Unsupported`]: take what
///   [`instead_of_pages`](Self::instead_of_pages) gives;
/// - compute shaders, or fetching depths, [`SeenReadback`](crate::SeenReadback) is
///   [`Error::Unsupported`];
/// - comparison samplers and fetching depths both, everything is [`Error::Unsupported`].
///
/// Fields are public so that you can force a fallback by setting a field to `false`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Support {
    /// Whether the device can clamp depths to the depth range instead of clipping triangles.
    pub depth_clip_control: bool,
    /// Whether the device can clip triangles at planes of a shader's choice.
    pub clip_distances: bool,
    /// Whether fragment shaders can read storage buffers.
    pub storage_buffers: bool,
    /// Whether shaders can fetch single depths.
    pub depth_fetch: bool,
    /// Whether there are compute shaders, with which [`SeenReadback`](crate::SeenReadback) reduces
    /// depths.
    pub compute: bool,
    /// Whether shaders can choose clusters of triangles, and draw what they chose.
    pub clusters: bool,
    /// Whether shaders can place and draw the pages of plans that have some.
    pub pages: bool,
    /// Whether textures of 32-bit floats can be interpolated, as `vsm`, `esm` and `evsm` need.
    pub float32: bool,
    /// Whether 16-bit normalised textures can be drawn into and interpolated, as `msm` and the
    /// 16-bit `csm` need.
    pub norm16: bool,
    /// Whether signed 8-bit textures can be drawn into and interpolated, as `csm` in 8 bits needs.
    pub snorm8: bool,
    /// The greatest number of colour attachments of a pass.
    pub max_attachments: u32,
    /// The greatest number of bytes per texel that all colour attachments of a pass can have
    /// together.
    pub max_attachment_bytes: u32,
    /// The longest side of a texture, texels.
    pub max_side: u32,
    /// The greatest number of layers of a texture.
    pub max_layers: u32,
    /// Whether an array texture can have any number of layers. Under OpenGL, wgpu treats a texture
    /// with one layer as a plain texture, and one with a multiple of six layers as a cube. Such
    /// arrays therefore get one more layer.
    pub any_layers: bool,
    /// The number that offsets into uniform buffers must be multiples of, bytes.
    pub uniform_alignment: u32,
}

/// The number of storage buffers that lookup uses.
const STORAGE_BUFFERS: u32 = 3;

/// The number of storage buffers that the choice of clusters uses at once.
const CLUSTER_BUFFERS: u32 = 10;

/// The number of storage buffers that the choice of clusters for pages uses at once.
const PAGE_BUFFERS: u32 = 12;

impl Support {
    /// Features that make shadows faster or allow more filters. Request those that the adapter has
    /// when you create your device. None is required.
    pub const WANTED_FEATURES: Features = Features::DEPTH_CLIP_CONTROL
        .union(Features::CLIP_DISTANCES)
        .union(Features::FLOAT32_FILTERABLE)
        .union(Features::TEXTURE_FORMAT_16BIT_NORM)
        .union(Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

    /// The capabilities of `device`, which must have been created from `adapter`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the device cannot compute shadows at all.
    pub fn new(adapter: &Adapter, device: &Device) -> Result<Self, Error> {
        let flags = adapter.get_downlevel_capabilities().flags;
        let features = device.features();
        let mut support = Self::of(features, &device.limits(), flags, adapter.get_info().backend)?;
        // The format features of the adapter apply only if the device was created with this
        // feature.
        let is_heeded = features.contains(Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);
        let can_filter = |format| {
            let can = adapter.get_texture_format_features(format);
            is_heeded
                && can.allowed_usages.contains(TextureUsages::RENDER_ATTACHMENT)
                && can.flags.contains(TextureFormatFeatureFlags::FILTERABLE)
        };
        support.snorm8 = can_filter(TextureFormat::Rgba8Snorm);
        support.norm16 &=
            can_filter(TextureFormat::Rgba16Unorm) && can_filter(TextureFormat::Rgba16Snorm);
        Ok(support)
    }

    /// The capabilities that follow from the properties which [`new`](Self::new) queries, except
    /// those of texture formats, which only an adapter knows. `snorm8` is therefore `false`.
    ///
    /// # Errors
    /// [`Error::Unsupported`], as for [`new`](Self::new).
    pub fn of(
        features: Features,
        limits: &Limits,
        flags: DownlevelFlags,
        backend: Backend,
    ) -> Result<Self, Error> {
        // GLSL cannot fetch depths from a texture that it also compares depths with.
        let depth_fetch = backend != Backend::Gl;
        if !depth_fetch && !flags.contains(DownlevelFlags::COMPARISON_SAMPLERS) {
            return Err(Error::Unsupported {
                what: "comparison samplers",
                why: "without which depths cannot be compared: take another backend or device",
            });
        }
        if limits.max_texture_dimension_2d < 2 || limits.max_uniform_buffer_binding_size < 16 << 10
        {
            return Err(Error::Unsupported {
                what: "16 KiB of uniforms and textures of 2x2 texels",
                why: "without which there is no room for a shadow map: raise the limits that you ask for",
            });
        }
        let storage_buffers = flags.contains(DownlevelFlags::FRAGMENT_STORAGE)
            && limits.max_storage_buffers_per_shader_stage >= STORAGE_BUFFERS;
        let compute = flags.contains(DownlevelFlags::COMPUTE_SHADERS)
            && limits.max_compute_invocations_per_workgroup >= 64
            && limits.max_storage_buffers_per_shader_stage >= 1;
        let clusters = compute
            && depth_fetch
            && backend != Backend::Gl
            && flags.contains(DownlevelFlags::VERTEX_STORAGE | DownlevelFlags::INDIRECT_EXECUTION)
            && limits.max_compute_invocations_per_workgroup >= 256
            && limits.max_storage_buffers_per_shader_stage >= CLUSTER_BUFFERS;
        Ok(Self {
            depth_clip_control: features.contains(Features::DEPTH_CLIP_CONTROL),
            clip_distances: features.contains(Features::CLIP_DISTANCES),
            storage_buffers,
            depth_fetch,
            compute,
            clusters,
            pages: clusters
                && storage_buffers
                && limits.max_storage_buffers_per_shader_stage >= PAGE_BUFFERS,
            float32: features.contains(Features::FLOAT32_FILTERABLE),
            norm16: features.contains(Features::TEXTURE_FORMAT_16BIT_NORM),
            // Drawing into this format is not guaranteed on every device; only an adapter can tell.
            snorm8: false,
            max_attachments: limits.max_color_attachments.max(1),
            max_attachment_bytes: limits.max_color_attachment_bytes_per_sample,
            max_side: limits.max_texture_dimension_2d,
            max_layers: limits.max_texture_array_layers,
            any_layers: backend != Backend::Gl,
            uniform_alignment: limits.min_uniform_buffer_offset_alignment.max(1),
        })
    }

    /// A technique that the device can draw in place of one with pages: four stable slices with the
    /// same filter, whose texels stand still too, and as many texels as the pages share, or 2048².
    /// `None` for techniques without pages, and if the device has them.
    pub fn instead_of_pages(&self, technique: &Technique) -> Option<Technique> {
        if self.pages || technique.paged_error().is_none() {
            return None;
        }
        let size = match technique.size {
            Size::Needed => Size::Budget(2048 * 2048),
            size => size,
        };
        let (cover, partition) = (Cover::Stable, Partition::slices(4));
        Some(Technique { cover, partition, size, ..*technique })
    }

    /// The limits that a [`Planner`](umbrage::Planner) must know of the device.
    pub fn limits(&self) -> umbrage::Limits {
        umbrage::Limits { max_side: self.max_side, ..umbrage::Limits::default() }
    }

    /// A device with all capabilities, for tests.
    #[cfg(test)]
    pub(crate) const FULL: Self = Self {
        depth_clip_control: true,
        clip_distances: true,
        storage_buffers: true,
        depth_fetch: true,
        compute: true,
        clusters: true,
        pages: true,
        float32: true,
        norm16: true,
        snorm8: true,
        max_attachments: 8,
        max_attachment_bytes: 32,
        max_side: 8192,
        max_layers: 256,
        any_layers: true,
        uniform_alignment: 256,
    };

    /// The number of layers of an array texture in which `needed` layers are used.
    pub(crate) fn array_layers(&self, needed: u32) -> u32 {
        let needed = needed.max(1);
        let is_odd = needed == 1 || needed.is_multiple_of(6);
        needed + u32::from(is_odd && !self.any_layers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn webgl2() -> DownlevelFlags {
        DownlevelFlags::COMPARISON_SAMPLERS
    }

    #[test]
    fn a_webgpu_device_needs_no_fallback_but_for_clamping() {
        let flags = DownlevelFlags::compliant();
        let of = |features| Support::of(features, &Limits::default(), flags, Backend::Vulkan);
        let plain = of(Features::empty()).unwrap();
        assert!(plain.storage_buffers && plain.depth_fetch && plain.compute);
        assert!(!plain.depth_clip_control);
        assert!(of(Support::WANTED_FEATURES).unwrap().depth_clip_control);
        assert_eq!([plain.max_side, plain.max_layers], [8192, 256]);
    }

    #[test]
    fn a_webgl2_class_device_falls_back() {
        let limits = Limits::downlevel_webgl2_defaults();
        let support = Support::of(Features::empty(), &limits, webgl2(), Backend::Gl).unwrap();
        assert!(!support.storage_buffers && !support.depth_fetch && !support.compute);
        assert_eq!(support.max_side, 2048);
        assert_eq!([0, 1, 2, 5, 6, 12].map(|n| support.array_layers(n)), [2, 2, 2, 5, 7, 13]);
    }

    #[test]
    fn slices_that_stand_still_replace_pages() {
        let technique = |text: &str| text.parse::<Technique>().unwrap();
        let support = Support { pages: false, ..Support::FULL };
        let instead = |text| support.instead_of_pages(&technique(text)).map(|t| t.to_string());
        assert_eq!(instead("paged:pcf3").unwrap(), "uniform(stable)+z4:pcf3@2048");
        assert_eq!(instead("paged(error=0.5)@1024").unwrap(), "uniform(stable)+z4");
        assert_eq!(instead("adaptive"), None);
        assert_eq!(Support::FULL.instead_of_pages(&technique("paged")), None);
    }

    #[test]
    fn what_cannot_be_done_without_is_named() {
        let limits = Limits::downlevel_webgl2_defaults();
        let none = DownlevelFlags::empty();
        let error = Support::of(Features::empty(), &limits, none, Backend::Gl).unwrap_err();
        assert!(error.to_string().contains("comparison samplers"), "{error}");
        let tiny = Limits { max_texture_dimension_2d: 1, ..limits };
        let error = Support::of(Features::empty(), &tiny, webgl2(), Backend::Gl).unwrap_err();
        assert!(error.to_string().contains("textures of 2x2"), "{error}");
    }
}
