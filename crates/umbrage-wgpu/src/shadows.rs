mod resources;

use crate::culling::FourPlanes;
use crate::data::{Lookup, Placed, clip_from_render};
use crate::pages::Pages;
use crate::passes::{Clear, Prepared};
use crate::prefilter::Prefiltering;
use crate::redraw::{Stale, Texels};
use crate::slots::Slots;
use crate::{Error, Support, wgsl};
use glam::{DMat4, DVec3};
use resources::{Buffers, CasterBuffer, view_dimension};
pub(crate) use resources::{DepthTexture, LookupParts};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Faces, Place, Plan, Plane, Rows, ShadowMap, Slab, Technique};
use wgpu::{
    BindGroup, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType,
    BufferBindingType, CompareFunction, DepthStencilState, Device, Extent3d, FilterMode,
    FragmentState, PipelineCompilationOptions, PrimitiveState, Queue, SamplerBindingType,
    SamplerDescriptor, ShaderModule, ShaderStages, Texture, TextureFormat, TextureSampleType,
    TextureView, TextureViewDimension,
};

/// Format of the texture that holds the depths of all maps.
pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// How shadow maps are stored in textures and looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadowOptions {
    /// How lookup combines the texels around a point. A plan must be made for the same filter.
    pub filter: Filter,
    /// Whether the shader or the texture unit compares depths. [`Shadows::options`] gives the
    /// choice that the device and the filter allowed.
    pub comparison: Comparison,
    /// Whether maps share one layer of the depth texture or have a layer each.
    pub layout: Layout,
    /// The kind of the buffers from which lookups read what they need to know of the maps.
    /// [`Shadows::options`] gives the choice that the device allowed.
    pub buffers: LookupBuffers,
    /// Whether lookups fade shadows out where the [plan](umbrage::Plan::fade) does. Without it they
    /// refuse such plans, and have no instruction for it; with it they serve plans without a fade
    /// too.
    pub fades: bool,
    /// Whether plans have [pages](umbrage::paged). They then lie in one layer
    /// ([`Layout::Atlas`]), and lookups read [`LookupBuffers::Storage`], whatever else was asked
    /// for. [`Shadows::prepare_pages`] takes such plans, and [`Shadows::prepare`] all others.
    pub pages: bool,
    /// Whether pages keep casters that stand still apart from those that move
    /// ([`PageParts::moving`](crate::PageParts::moving)), in a second texture as large as the first.
    /// Where something moves, what stands still is then copied in place of being drawn again.
    pub pages_apart: bool,
}

/// The kind of the buffers from which lookups read lights, maps and planes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LookupBuffers {
    /// Uniform buffers, which many devices read faster than storage buffers. They hold at most 16
    /// lights, 64 maps and 512 planes around what maps serve; [`Shadows::prepare`] returns
    /// [`Error::TooMany`] for larger plans. That is room for one light of almost any technique;
    /// [`for_technique`](Self::for_technique) tells.
    #[default]
    Uniform,
    /// Storage buffers, which hold any number. Devices that have none take uniform buffers in their
    /// place.
    Storage,
}

impl LookupBuffers {
    /// Uniform buffers if they hold the maps that a technique makes for this many lights, even if
    /// all of them are point lights or wide spot lights; otherwise storage buffers.
    pub fn for_technique(technique: &Technique, lights: usize) -> Self {
        const CUBE_SIDES: usize = 6;
        let [faces, face_planes] = match technique.partition.faces {
            Faces::Whole => [1, 0],
            Faces::Sides => [4, 3],
            Faces::SidesAndNear => [5, 4],
        };
        // A pyramid of light has up to six planes, and the cone of a wide spot light has four. A
        // slice has two ends, and the view has one.
        let planes = 6 + 4 + 2 + 1 + face_planes;
        let of_light = CUBE_SIDES * faces * technique.partition.slices as usize;
        let maps = lights.saturating_mul(of_light);
        let fits = lights <= wgsl::MAX_LIGHTS
            && maps <= wgsl::MAX_MAPS
            && maps.saturating_mul(planes) <= wgsl::MAX_PLANES;
        if fits { Self::Uniform } else { Self::Storage }
    }
}

/// What compares a receiver's depth with the depths of the texels around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Comparison {
    /// The shader compares each texel's depth with the depth of the receiver's plane at that texel,
    /// exactly as [`umbrage::visibility`] does. The `spread` and `pcss` filters always compare this
    /// way.
    #[default]
    PerTexel,
    /// The texture unit compares four texels at a time with the least depth that the receiver's
    /// plane has among them, and weights the results bilinearly. On receivers that are steep to the
    /// light, shadows therefore begin late, by up to the depth by which the receiver's plane rises
    /// over a texel. Devices that cannot fetch depths always compare this way.
    Hardware,
}

/// How maps share the depth texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// All maps lie side by side in one layer and are drawn in one pass. This takes the fewest
    /// texels.
    #[default]
    Atlas,
    /// Each map has a layer of its own and is drawn in a pass of its own. All layers are as large
    /// as the largest map.
    Layers,
}

/// A margin on every depth comparison, added to the bias that the lookup derives from the texels
/// themselves. Zero is right where receivers and casters are the same geometry. Where the geometry
/// that is drawn into the maps is coarser (another level of detail, for example), set a positive
/// margin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bias {
    /// Margin in widths of the texel at the receiver, measured along the beam. It may be negative,
    /// down to −½.
    pub texels: f32,
    /// Margin in metres along the beam.
    pub metres: f32,
}

/// The input of [`Shadows::prepare`]: the maps to draw and look up in one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The plan of the maps. Its filter must be that of the [`ShadowOptions`].
    pub plan: &'a Plan,
    /// World position of render space's origin, metres. All three coordinates must be finite.
    pub render_origin: DVec3,
    /// How the casters differ from those of the last prepared frame.
    pub casters: Casters<'a>,
}

/// How the casters differ from those of the last prepared frame. This decides which maps are drawn
/// again although their own matrix and size have not changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Casters<'a> {
    /// Any caster may have moved, so all maps are drawn again.
    Moved,
    /// All casters that changed lie within these boxes (world space), which must contain both their
    /// old and their new positions; two boxes for one caster are as good as one around both. Of
    /// maps that are otherwise unchanged, only the texels that something in the boxes can cast a
    /// shadow into are drawn again, part by part (see [`Redraw`](crate::Redraw)).
    MovedIn(&'a [Aabb]),
    /// No caster has moved.
    Unmoved,
}

/// The shadow maps of one view on the GPU: the depth texture, and the buffers, the bind group and
/// the shader text with which shaders look the maps up.
#[derive(Debug)]
pub struct Shadows {
    pub(crate) options: ShadowOptions,
    pub(crate) support: Support,
    pub(crate) bias: Bias,
    slots: Slots,
    pub(crate) lookup: Lookup,
    pub(crate) uploaded: Lookup,
    pub(crate) buffers: Buffers,
    pub(crate) casters: CasterBuffer,
    pub(crate) texture: DepthTexture,
    pub(crate) sampler: wgpu::Sampler,
    pub(crate) lookup_layout: BindGroupLayout,
    pub(crate) lookup_bind_group: BindGroup,
    /// `Some` if plans have pages.
    pub(crate) pages: Option<Pages>,
    pub(crate) clear: Clear,
    /// `Some` if the filter is a prefilter.
    pub(crate) prefiltering: Option<Prefiltering>,
    /// One for each map of the plan.
    pub(crate) records: Vec<Record>,
}

/// The state with which a map was drawn or is to be drawn. Comparing it with the plan shows whether
/// the map must be drawn again.
#[derive(Debug, Default)]
pub(crate) struct Record {
    pub(crate) place: Option<Place>,
    /// What must still be drawn.
    pub(crate) stale: Stale,
    /// If anything must be drawn, the index of the map among all such maps.
    pub(crate) stale_index: u32,
    pub(crate) clip_from_render: DMat4,
    shadow_from_local: DMat4,
    origin: DVec3,
    slab: Slab,
    caster_planes: Vec<Plane>,
    /// The same, to cull by.
    pub(crate) four_planes: Vec<FourPlanes>,
}

impl Record {
    /// Whether the texture holds `map` at `place` as it is planned now, but for what is stale.
    fn is_of(&self, map: &ShadowMap, place: Option<Place>) -> bool {
        self.place == place
            && self.shadow_from_local == map.shadow_from_local
            && self.origin == map.origin
            && self.slab == map.slab
            && self.caster_planes == map.caster_planes
    }

    /// The map's place if it has one and something must still be drawn there.
    pub(crate) fn stale_place(&self) -> Option<Place> {
        self.place.filter(|_| !self.stale.is_empty())
    }

    /// Whether the map must be drawn as a whole.
    pub(crate) fn is_wholly_stale(&self, filter: &Filter) -> bool {
        let is_whole = |place| self.stale.parts().eq([Texels::whole(filter, &place)]);
        self.place.is_some_and(is_whole)
    }

    /// Notes that all of `map` must be drawn.
    fn set(&mut self, map: &ShadowMap, place: Option<Place>, filter: &Filter) {
        self.stale =
            place.map_or(Stale::default(), |place| Stale::only(Texels::whole(filter, &place)));
        self.place = place;
        self.shadow_from_local = map.shadow_from_local;
        self.origin = map.origin;
        self.slab = map.slab;
        self.caster_planes.clear();
        self.caster_planes.extend_from_slice(&map.caster_planes);
        self.four_planes.clear();
        self.four_planes.extend(map.caster_planes.chunks(4).map(FourPlanes::new));
    }
}

impl Shadows {
    /// Creates shadows without any maps; [`prepare`](Self::prepare) adds the maps.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a filter with values out of range, and [`Error::Unsupported`] for a
    /// filter that the device cannot compute (see [`Support`]).
    pub fn new(device: &Device, support: Support, options: &ShadowOptions) -> Result<Self, Error> {
        options
            .filter
            .check()
            .map_err(|e| Error::Invalid { field: "options.filter", problem: e.to_string() })?;
        let is_spread = match options.filter {
            Filter::Spread { .. } | Filter::Pcss { .. } => true,
            Filter::None | Filter::Hard | Filter::Pcf { .. } | Filter::Prefiltered(_) => false,
        };
        if is_spread && !support.depth_fetch {
            return Err(Error::Unsupported {
                what: "fetching of depths",
                why: "by which this filter compares them: take pcf without a width",
            });
        }
        let comparison = match options.comparison {
            // The places of these filters are single texels, which a bilinear comparison would
            // blur.
            _ if is_spread => Comparison::PerTexel,
            _ if !support.depth_fetch => Comparison::Hardware,
            comparison => comparison,
        };
        if options.pages && !support.pages {
            return Err(Error::Unsupported {
                what: "eleven storage buffers in compute shaders",
                why: "by which pages are found and drawn: take slices, as uniform(stable)+z4",
            });
        }
        if options.pages && options.filter.prefilter().is_some() {
            return Err(Error::Invalid {
                field: "options.filter",
                problem: "must be no prefilter with pages: take hard, pcfN or pcss".into(),
            });
        }
        let buffers = match options.buffers {
            _ if options.pages => LookupBuffers::Storage,
            _ if !support.storage_buffers => LookupBuffers::Uniform,
            buffers => buffers,
        };
        let layout = if options.pages { Layout::Atlas } else { options.layout };
        let options = ShadowOptions { comparison, buffers, layout, ..*options };
        let filter_mode = match options.filter {
            Filter::Prefiltered(_) => FilterMode::Linear,
            Filter::Pcf { .. } if comparison == Comparison::Hardware => FilterMode::Linear,
            Filter::None
            | Filter::Hard
            | Filter::Pcf { .. }
            | Filter::Spread { .. }
            | Filter::Pcss { .. } => FilterMode::Nearest,
        };
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("shadow sampler"),
            mag_filter: filter_mode,
            min_filter: filter_mode,
            // A point is lit if the limit is not farther from the light than the texel.
            compare: compares(&options).then_some(CompareFunction::LessEqual),
            ..SamplerDescriptor::default()
        });
        let lookup_layout = lookup_layout(device, &support, &options);
        let buffers = Buffers::new(device, options.buffers);
        let texture = DepthTexture::new(device, &support, options.layout, [1, 1], 1);
        let prefiltering = match options.filter.prefilter() {
            Some(prefilter) => Some(Prefiltering::new(device, &support, prefilter, &texture)?),
            None => None,
        };
        let pages = options.pages.then(|| Pages::new(device, &support, &options, &lookup_layout));
        let unbound = pages.as_ref().map(|_| Buffers::stand_ins(device));
        let parts = LookupParts {
            view: looked_up(&texture, prefiltering.as_ref()),
            pages: unbound.as_ref().map(<[wgpu::Buffer; 2]>::each_ref),
        };
        let lookup_bind_group = buffers.bind(device, &lookup_layout, &parts, &sampler);
        Ok(Self {
            options,
            support,
            bias: Bias::default(),
            slots: Slots::default(),
            lookup: Lookup::default(),
            uploaded: Lookup::default(),
            buffers,
            casters: CasterBuffer::new(device, &support),
            texture,
            sampler,
            lookup_layout,
            lookup_bind_group,
            pages,
            clear: Clear::new(device),
            prefiltering,
            records: Vec::new(),
        })
    }

    /// The options. The comparison is the one in use, which may differ from the requested one (see
    /// [`Comparison`]).
    pub fn options(&self) -> &ShadowOptions {
        &self.options
    }

    /// What the device can do.
    pub fn support(&self) -> &Support {
        &self.support
    }

    /// The margin on every comparison beyond the lookup's own bias.
    pub fn bias(&self) -> Bias {
        self.bias
    }

    /// Sets the [`bias`](Self::bias). The change takes effect with the next frame that is prepared.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a value is not finite, or if `bias.texels` is less than −½.
    pub fn set_bias(&mut self, bias: Bias) -> Result<(), Error> {
        if !(bias.texels >= -0.5 && bias.texels.is_finite() && bias.metres.is_finite()) {
            return Err(Error::Invalid {
                field: "bias",
                problem: format!("must be finite, and texels at least -0.5, is {bias:?}"),
            });
        }
        self.bias = bias;
        Ok(())
    }

    /// WGSL text to put before a shader that looks shadows up. `group` is the index of the bind
    /// group that the text uses. All names in the text begin with `shadow`, `Shadow` or `SHADOW`.
    /// Call
    ///
    /// ```wgsl
    /// fn shadow_visibility(light: u32, position: vec3f, normal: vec3f) -> f32
    /// ```
    ///
    /// with the light's index in the plan, the receiver's position in render space, and the normal
    /// of its triangle, which need not have unit length. In fragment shaders,
    /// `shadow_normal(position)` computes this normal. The result is the visibility, from 0 in
    /// shadow to 1 in full light, as the maps alone give it; it is 1 where no map serves the point.
    /// Your shading must itself darken surfaces that face away from the light. Filters may use
    /// further bindings of the same group, so add none of your own to it.
    ///
    /// # WESL
    /// The text is also a module of [WESL](https://wesl-lang.dev). Add it under a path of your
    /// choice and import from it:
    ///
    /// ```
    /// # fn main_wgsl(shadows: &umbrage_wgpu::Shadows) -> Result<String, Box<dyn std::error::Error>> {
    /// let main = "
    ///     import package::shadows::{shadow_normal, shadow_visibility};
    ///
    ///     @fragment
    ///     fn main(@location(0) position: vec3f) -> @location(0) vec4f {
    ///         return vec4f(shadow_visibility(0u, position, shadow_normal(position)));
    ///     }";
    /// let mut modules = wesl::VirtualResolver::new();
    /// modules.add_module("package::shadows".parse()?, shadows.lookup_wgsl(1).into());
    /// modules.add_module("package::main".parse()?, main.into());
    /// let compiler = wesl::Wesl::new("").set_custom_resolver(modules);
    /// let wgsl = compiler.compile(&"package::main".parse()?)?.to_string();
    /// # Ok(wgsl) }
    /// ```
    ///
    /// The text cannot be a package that is known at build time, because its bindings depend on the
    /// device ([`Support`]) and its constants on the filter.
    pub fn lookup_wgsl(&self, group: u32) -> String {
        wgsl::lookup(group, &self.options)
    }

    /// The text of [`lookup_wgsl`](Self::lookup_wgsl) for shaders that look several [`Shadows`] up,
    /// for example with one filter for the sun and another for lamps. `name` and an underscore
    /// stand before all names, as in `sun_shadow_visibility`, `SunShadowMap` and `SUN_SHADOW_NONE`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `name` begins with a lower-case letter and has only lower-case
    /// letters, digits and underscores.
    pub fn lookup_wgsl_named(&self, group: u32, name: &str) -> Result<String, Error> {
        let is_letter = |c: char| c.is_ascii_lowercase();
        let is_good = |c: char| is_letter(c) || c.is_ascii_digit() || c == '_';
        if !name.starts_with(is_letter) || !name.chars().all(is_good) {
            return Err(Error::Invalid {
                field: "name",
                problem: format!("must be lower-case letters and digits, as in sun, is {name:?}"),
            });
        }
        Ok(wgsl::named(&self.lookup_wgsl(group), name))
    }

    /// Layout of the bind group that [`lookup_wgsl`](Self::lookup_wgsl) uses. It is visible to
    /// fragment shaders and, on devices with storage buffers, to compute shaders.
    pub fn lookup_layout(&self) -> &BindGroupLayout {
        &self.lookup_layout
    }

    /// The bind group that [`lookup_wgsl`](Self::lookup_wgsl) uses. Get it anew each frame after
    /// [`prepare`](Self::prepare), which replaces it when the texture or a buffer has been
    /// replaced.
    pub fn lookup_bind_group(&self) -> &BindGroup {
        &self.lookup_bind_group
    }

    /// WGSL text to put before a shader that draws casters. `group` is the index of the bind group
    /// that holds the map's matrix; [`Prepared::encode`] sets group 0. The text declares the same
    /// names on every device, so one shader is correct on all devices:
    ///
    /// ```wgsl
    /// struct ShadowCaster {
    ///     @builtin(position) clip: vec4f,
    ///     @location(0) depth: vec2f,
    /// }
    /// fn shadow_caster(render_position: vec3f) -> ShadowCaster
    /// fn shadow_fragment_depth(depth: vec2f) -> f32
    /// @fragment fn shadow_caster_fragment(caster: ShadowCaster) -> @builtin(frag_depth) f32
    /// ```
    ///
    /// Name your entry point when you create a pipeline, because the text has entry points too.
    ///
    /// Casters without holes need only a vertex stage, which returns `shadow_caster` of a position
    /// in render space. Give their pipeline the fragment stage that
    /// [`caster_fragment`](Self::caster_fragment) returns:
    ///
    /// ```wgsl
    /// @vertex fn vertex(@location(0) position: vec3f) -> ShadowCaster {
    ///     return shadow_caster(position);
    /// }
    /// ```
    ///
    /// Casters with a fragment stage of their own, which discards holes for example, must pass both
    /// `clip` and `depth` on in a struct of their own, and must write `shadow_fragment_depth` of
    /// `depth` as `@builtin(frag_depth)`. Such a stage is correct on every device. Where
    /// [`caster_needs_fragment`](Self::caster_needs_fragment) is `false`, an entry point that does
    /// not write depth is also correct, and it is faster because the device can then test depth
    /// early.
    pub fn caster_wgsl(&self, group: u32) -> String {
        wgsl::caster(group, &self.support)
    }

    /// Whether pipelines that draw casters need a fragment stage that writes depth. This is `true`
    /// on devices that do not clamp depths (see [`Support::depth_clip_control`]).
    pub fn caster_needs_fragment(&self) -> bool {
        !self.support.depth_clip_control
    }

    /// The fragment stage of a pipeline that draws casters without holes. `module` must begin with
    /// [`caster_wgsl`](Self::caster_wgsl). The stage is that text's `shadow_caster_fragment`, or
    /// `None` where the device needs no fragment stage.
    ///
    /// A vertex stage that outputs the clip position without `depth` would be wrong on some
    /// devices, and there it fails wgpu's validation. In builds with debug assertions it fails on
    /// every device, because devices that need no fragment stage then get one that does nothing.
    pub fn caster_fragment<'a>(&self, module: &'a ShaderModule) -> Option<FragmentState<'a>> {
        let entry_point = if self.caster_needs_fragment() {
            "shadow_caster_fragment"
        } else if cfg!(debug_assertions) {
            "shadow_caster_unused_fragment"
        } else {
            return None;
        };
        Some(FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &[],
        })
    }

    /// Layout of the bind group that [`caster_wgsl`](Self::caster_wgsl) uses: one uniform buffer
    /// with a dynamic offset.
    pub fn caster_layout(&self) -> &BindGroupLayout {
        &self.casters.layout
    }

    /// Depth state for pipelines that draw casters. It has no depth bias, because the lookup
    /// applies the whole bias.
    pub fn depth_stencil_state(&self) -> DepthStencilState {
        depth_state(CompareFunction::Less)
    }

    /// Primitive state for pipelines that draw casters: triangle lists without culling of faces,
    /// with depth clamped if the device can clamp it. On other devices the fragment stage clamps
    /// depth (see [`caster_wgsl`](Self::caster_wgsl)).
    pub fn primitive_state(&self) -> PrimitiveState {
        PrimitiveState {
            unclipped_depth: self.support.depth_clip_control,
            ..PrimitiveState::default()
        }
    }

    /// The texture that holds the depths of all maps, in the format [`DEPTH_FORMAT`]. It has
    /// several layers with [`Layout::Layers`]. [`place`](Self::place) gives the place of each map
    /// in it.
    pub fn depth_texture(&self) -> &Texture {
        &self.texture.texture
    }

    /// The place in the texture of the map with this index in the plan; `None` for an empty map.
    pub fn place(&self, map: usize) -> Option<Place> {
        self.slots.places().get(map).copied().flatten()
    }

    /// Memory of the textures that lookup samples, bytes: the depth texture or, with a prefilter,
    /// the prefiltered maps. 0 with [`Filter::None`].
    pub fn lookup_bytes(&self) -> u64 {
        if !self.options.filter.has_maps() {
            return 0;
        }
        let of_pages = self.pages.as_ref().map_or(0, Pages::bytes);
        of_pages
            + self.prefiltering.as_ref().map_or_else(|| self.texture_bytes(), Prefiltering::bytes)
    }

    /// Memory of the depth texture, bytes.
    pub fn texture_bytes(&self) -> u64 {
        let Extent3d { width, height, depth_or_array_layers } = self.texture.texture.size();
        4 * u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers)
    }

    /// Finds a place for each map of a plan, uploads the data that shaders need, and determines
    /// which maps must be drawn. If the result is dropped without being encoded, nothing is drawn
    /// now, and these maps remain to be drawn in the next frame.
    ///
    /// # Errors
    /// - [`Error::OtherFilter`] if the plan is for another filter.
    /// - [`Error::LogarithmicRows`] if a GPU cannot draw a map.
    /// - [`Error::NoRoom`], or [`Error::Invalid`] with [`Layout::Layers`], if the maps do not fit
    ///   into the device's textures.
    /// - [`Error::TooMany`] if there are more lights, maps or planes than uniform buffers hold, and
    ///   lookups read these (see [`LookupBuffers`]).
    /// - [`Error::Invalid`] if the plan's shadows fade out and those of the options do not, if
    ///   `frame.render_origin` is not finite, or a box of `frame.casters` is
    ///   not within 1e12 metres of the world's origin.
    ///
    /// After an error, the maps that are drawn and the data that shaders read are as before.
    pub fn prepare<'a>(
        &'a mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame<'a>,
    ) -> Result<Prepared<'a>, Error> {
        let Frame { plan, render_origin, casters } = *frame;
        self.check(plan, render_origin, casters)?;
        if plan.paging.is_some() || self.options.pages {
            return Err(Error::Invalid {
                field: "frame.plan",
                problem: "has pages, or the options ask for them: take `Shadows::prepare_pages`"
                    .into(),
            });
        }
        let filter = self.options.filter;
        self.slots.place(plan, self.options.layout, &filter, &self.support)?;
        let (size, layers) = self.slots.size();
        self.lookup.fill(
            plan,
            &Placed {
                places: self.slots.places(),
                texture_size: self.texture.size_for(size, layers),
                render_origin,
                bias: self.bias,
                pages_across: 0,
            },
        );
        self.lookup.check(self.options.buffers)?;
        let mut rebind = false;
        if !self.texture.holds(size, layers) {
            self.texture =
                DepthTexture::new(device, &self.support, self.options.layout, size, layers);
            if let Some(prefiltering) = &mut self.prefiltering {
                prefiltering.resize(device, &self.support, &self.texture);
            }
            rebind = true;
        }
        rebind |= self.buffers.hold(device, self.options.buffers, &self.lookup);
        if rebind {
            let view = looked_up(&self.texture, self.prefiltering.as_ref());
            let parts = LookupParts { view, pages: None };
            self.lookup_bind_group =
                self.buffers.bind(device, &self.lookup_layout, &parts, &self.sampler);
        }
        if rebind || self.lookup != self.uploaded {
            self.buffers.upload(queue, &self.lookup);
            std::mem::swap(&mut self.lookup, &mut self.uploaded);
        }

        self.records.resize_with(plan.maps.len(), Record::default);
        let mut stale_maps = 0;
        for ((map, place), record) in
            plan.maps.iter().zip(self.slots.places()).zip(&mut self.records)
        {
            if self.texture.is_fresh || casters == Casters::Moved || !record.is_of(map, *place) {
                record.set(map, *place, &filter);
            } else if let Casters::MovedIn(boxes) = casters {
                let shadowed = boxes.iter().filter_map(|&b| Texels::shadowed_by(map, &filter, b));
                shadowed.for_each(|texels| record.stale.add(texels));
            }
            if record.stale_place().is_some() {
                record.stale_index = stale_maps;
                record.clip_from_render = clip_from_render(map, &filter, render_origin);
                stale_maps += 1;
            }
        }
        if stale_maps > 0 {
            self.casters.upload(device, queue, &self.records);
            let Self { records, texture, prefiltering, .. } = &mut *self;
            if let Some(prefiltering) = prefiltering {
                prefiltering.upload(device, queue, plan, records, texture);
            }
        }
        Ok(Prepared { shadows: self, plan, render_origin })
    }
}

impl Shadows {
    /// Checks what all frames have.
    pub(crate) fn check(
        &self,
        plan: &Plan,
        render_origin: DVec3,
        casters: Casters<'_>,
    ) -> Result<(), Error> {
        if plan.filter != self.options.filter {
            return Err(Error::OtherFilter {
                planned: plan.filter,
                looked_up: self.options.filter,
            });
        }
        if plan.fade.is_some() && !self.options.fades {
            return Err(Error::Invalid {
                field: "options.fades",
                problem: "must be true for a plan whose shadows fade out, is false".into(),
            });
        }
        if !render_origin.is_finite() {
            return Err(Error::Invalid {
                field: "frame.render_origin",
                problem: format!("must be finite, is {render_origin}"),
            });
        }
        check_casters(casters, "frame.casters")?;
        if let Some(map) = plan.maps.iter().position(|m| m.rows != Rows::Even && !m.is_empty()) {
            return Err(Error::LogarithmicRows { map });
        }
        Ok(())
    }
}

/// Checks the boxes around casters that moved.
pub(crate) fn check_casters(casters: Casters<'_>, field: &'static str) -> Result<(), Error> {
    let Casters::MovedIn(boxes) = casters else { return Ok(()) };
    let is_sound = |b: &&Aabb| b.is_empty() || is_position(b.min) && is_position(b.max);
    match boxes.iter().find(|b| !is_sound(b)) {
        Some(bad) => Err(Error::Invalid {
            field,
            problem: format!("must lie within 1e12 metres of the origin, is {bad:?}"),
        }),
        None => Ok(()),
    }
}

/// Whether squares and products of a few of these coordinates stay finite, as the planner demands
/// of positions, too.
fn is_position(v: DVec3) -> bool {
    v.is_finite() && v.abs().max_element() <= 1e12
}

/// Whether the texture unit compares depths.
fn compares(options: &ShadowOptions) -> bool {
    options.comparison == Comparison::Hardware && options.filter.prefilter().is_none()
}

/// The texture that lookup samples.
fn looked_up<'a>(
    depths: &'a DepthTexture,
    prefiltering: Option<&'a Prefiltering>,
) -> &'a TextureView {
    prefiltering.map_or(&depths.all, Prefiltering::view)
}

/// Depth state with this comparison, without bias.
pub(crate) fn depth_state(compare: CompareFunction) -> DepthStencilState {
    DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

fn lookup_layout(device: &Device, support: &Support, options: &ShadowOptions) -> BindGroupLayout {
    let visibility = if support.storage_buffers {
        ShaderStages::FRAGMENT | ShaderStages::COMPUTE
    } else {
        ShaderStages::FRAGMENT
    };
    let array = match options.buffers {
        LookupBuffers::Uniform => BufferBindingType::Uniform,
        LookupBuffers::Storage => BufferBindingType::Storage { read_only: true },
    };
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let of_pages = options.pages.then(|| [array, array].map(buffer));
    let types = [
        buffer(BufferBindingType::Uniform),
        buffer(array),
        buffer(array),
        buffer(array),
        match options.filter.prefilter() {
            Some(_) => BindingType::Texture {
                sample_type: TextureSampleType::Float { filterable: true },
                view_dimension: TextureViewDimension::D2Array,
                multisampled: false,
            },
            None => BindingType::Texture {
                sample_type: TextureSampleType::Depth,
                view_dimension: view_dimension(options.layout),
                multisampled: false,
            },
        },
        BindingType::Sampler(match options.filter.prefilter() {
            Some(_) => SamplerBindingType::Filtering,
            None if compares(options) => SamplerBindingType::Comparison,
            None => SamplerBindingType::NonFiltering,
        }),
    ];
    let entries = (0..).zip(types.into_iter().chain(of_pages.into_iter().flatten()));
    let entries: Vec<_> = entries
        .map(|(binding, ty)| BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow lookup"),
        entries: &entries,
    })
}
