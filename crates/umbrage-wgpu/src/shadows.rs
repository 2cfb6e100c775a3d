use crate::data::{CasterMap, Lookup, Placed, clip_from_render};
use crate::passes::{Clear, Prepared};
use crate::prefilter::Prefiltering;
use crate::slots::Slots;
use crate::wgsl::{self, MAX_LIGHTS, MAX_MAPS, MAX_PLANES};
use crate::{Error, Support, data};
use glam::{DMat4, DVec3};
use std::mem::size_of;
use std::num::NonZeroU64;
use umbrage::visibility::{Filter, Prefilter};
use umbrage::{Aabb, Place, Plan, Plane, Rows, ShadowMap, Slab};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, CompareFunction, DepthStencilState, Device, Extent3d,
    FilterMode, FragmentState, PipelineCompilationOptions, PrimitiveState, Queue,
    SamplerBindingType, SamplerDescriptor, ShaderModule, ShaderStages, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension,
};

/// Format of the depth texture.
pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// How shadow maps are held and looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadowOptions {
    /// How the texels around a point are looked up.
    pub filter: Filter,
    /// Who compares depths.
    pub comparison: Comparison,
    /// How maps share a texture.
    pub layout: Layout,
}

/// Who compares a receiver's depth with those of the texels around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Comparison {
    /// The shader: each texel is compared with the depth of the receiver's plane there, as
    /// [`umbrage::visibility`] has it. Exact.
    #[default]
    PerTexel,
    /// The texture unit: four texels at a time are compared with the least depth of the receiver's plane among them, and
    /// weighted bilinearly. Shadows of steep receivers begin up to a texel's slope late. What devices that cannot
    /// fetch depths take in any case.
    Hardware,
}

/// How maps share the depth texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Side by side in one layer, drawn in one pass: the fewest texels.
    #[default]
    Atlas,
    /// Each in a layer of its own, with a pass of its own. Layers are as large as the largest map.
    Layers,
}

/// What to allow for beyond what the texels themselves ask for. Zero is right where what is drawn into the maps
/// is what receives; more where it is coarser (another level of detail, say).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bias {
    /// In widths of the texel at the receiver, laid along the beam; may be negative, down to −½.
    pub texels: f32,
    /// In metres along the beam.
    pub metres: f32,
}

/// What is to be drawn and looked up in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The maps.
    pub plan: &'a Plan,
    /// World position of render space's origin, metres.
    pub render_origin: DVec3,
    /// What has happened to the casters since the last frame.
    pub casters: Casters<'a>,
}

/// What has happened to the casters since the last frame that was prepared: which maps must be drawn again although
/// they themselves are as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Casters<'a> {
    /// Anything: draw all maps.
    Moved,
    /// What changed lies in these boxes (world space), before and after. Draw the maps into which they cast.
    MovedIn(&'a [Aabb]),
    /// Nothing.
    Unmoved,
}

/// The shadow maps of one view: their depths, and what shaders look them up by.
#[derive(Debug)]
pub struct Shadows {
    options: ShadowOptions,
    support: Support,
    bias: Bias,
    slots: Slots,
    lookup: Lookup,
    uploaded: Lookup,
    buffers: Buffers,
    pub(crate) casters: CasterBuffer,
    pub(crate) texture: DepthTexture,
    sampler: wgpu::Sampler,
    lookup_layout: BindGroupLayout,
    lookup_bind_group: BindGroup,
    pub(crate) clear: Clear,
    /// If the filter is applied ahead of lookup.
    pub(crate) prefiltering: Option<Prefiltering>,
    /// One a map of the plan.
    pub(crate) records: Vec<Record>,
}

/// The depths of all maps.
#[derive(Debug)]
pub(crate) struct DepthTexture {
    texture: Texture,
    all: TextureView,
    /// One a layer.
    pub(crate) layers: Vec<TextureView>,
    /// Nothing was ever drawn into it.
    pub(crate) is_fresh: bool,
}

/// What lookup reads.
#[derive(Debug)]
struct Buffers {
    settings: Buffer,
    lights: Buffer,
    maps: Buffer,
    planes: Buffer,
}

/// The maps' matrices for casters, at a distance of `stride` bytes, and the bind group that shows one of them.
#[derive(Debug)]
pub(crate) struct CasterBuffer {
    pub(crate) layout: BindGroupLayout,
    buffer: Buffer,
    pub(crate) bind_group: BindGroup,
    pub(crate) stride: u32,
    bytes: Vec<u8>,
}

/// What a map was when it was drawn.
#[derive(Debug, Default)]
pub(crate) struct Record {
    pub(crate) place: Option<Place>,
    pub(crate) is_drawn: bool,
    pub(crate) clip_from_render: DMat4,
    shadow_from_local: DMat4,
    origin: DVec3,
    slab: Slab,
    caster_planes: Vec<Plane>,
}

impl Record {
    /// Whether the map is drawn as it is now.
    fn is_of(&self, map: &ShadowMap, place: Option<Place>) -> bool {
        self.is_drawn
            && self.place == place
            && self.shadow_from_local == map.shadow_from_local
            && self.origin == map.origin
            && self.slab == map.slab
            && self.caster_planes == map.caster_planes
    }

    /// The map's place, if it has one and is to be drawn there.
    pub(crate) fn stale_place(&self) -> Option<Place> {
        self.place.filter(|_| !self.is_drawn)
    }

    fn set(&mut self, map: &ShadowMap, place: Option<Place>) {
        self.is_drawn = false;
        self.place = place;
        self.shadow_from_local = map.shadow_from_local;
        self.origin = map.origin;
        self.slab = map.slab;
        self.caster_planes.clear();
        self.caster_planes.extend_from_slice(&map.caster_planes);
    }
}

impl Shadows {
    /// Shadows without any maps, until they are [prepared](Self::prepare).
    ///
    /// # Errors
    /// A filter that is out of its range.
    pub fn new(device: &Device, support: Support, options: &ShadowOptions) -> Result<Self, Error> {
        options
            .filter
            .check()
            .map_err(|e| Error::Invalid { field: "options.filter", problem: e.to_string() })?;
        let is_spread = match options.filter {
            Filter::Spread { .. } | Filter::Pcss { .. } => true,
            Filter::Hard | Filter::Pcf { .. } | Filter::Prefiltered(_) => false,
        };
        if is_spread && !support.depth_fetch {
            return Err(Error::Unsupported {
                what: "fetching of depths",
                why: "by which this filter compares them: take pcf without a width",
            });
        }
        let comparison = match options.comparison {
            // Its places are single texels.
            _ if is_spread => Comparison::PerTexel,
            _ if !support.depth_fetch => Comparison::Hardware,
            comparison => comparison,
        };
        let options = ShadowOptions { comparison, ..*options };
        let filter_mode = match options.filter {
            Filter::Prefiltered(_) => FilterMode::Linear,
            Filter::Pcf { .. } if comparison == Comparison::Hardware => FilterMode::Linear,
            Filter::Hard | Filter::Pcf { .. } | Filter::Spread { .. } | Filter::Pcss { .. } => {
                FilterMode::Nearest
            }
        };
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("shadow sampler"),
            mag_filter: filter_mode,
            min_filter: filter_mode,
            // Lit is what is not nearer to the light than the limit.
            compare: compares(&options).then_some(CompareFunction::LessEqual),
            ..SamplerDescriptor::default()
        });
        let lookup_layout = lookup_layout(device, &support, &options);
        let buffers = Buffers::new(device, &support);
        let texture = DepthTexture::new(device, &support, options.layout, [1, 1], 1);
        let prefiltering = match prefilter(&options.filter) {
            Some(prefilter) => Some(Prefiltering::new(device, &support, prefilter, &texture)?),
            None => None,
        };
        let view = looked_up(&texture, prefiltering.as_ref());
        let lookup_bind_group = buffers.bind(device, &lookup_layout, view, &sampler);
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
            clear: Clear::new(device),
            prefiltering,
            records: Vec::new(),
        })
    }

    /// The options, with what the device made of them.
    pub fn options(&self) -> &ShadowOptions {
        &self.options
    }

    /// What the device can do.
    pub fn support(&self) -> &Support {
        &self.support
    }

    /// What is allowed for beyond what the texels ask for.
    pub fn bias(&self) -> Bias {
        self.bias
    }

    /// Sets [`bias`](Self::bias), from the next frame that is prepared.
    ///
    /// # Errors
    /// Numbers that are not finite, texels less than −½.
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

    /// WGSL to put before the text of a shader that looks shadows up; `group` is the bind group that
    /// it takes. All names in it begin with `shadow`, `Shadow` or `SHADOW`. Call
    ///
    /// ```wgsl
    /// fn shadow_visibility(light: u32, position: vec3f, normal: vec3f) -> f32
    /// ```
    ///
    /// with a light's index in the plan, a position in render space and the triangle's normal, which
    /// need not have unit length; in fragment shaders `shadow_normal(position)` makes one. It gives
    /// the share of the light, 0 to 1, that reaches the point by the maps alone; 1 where no map
    /// serves it. That a surface facing away from the light is dark is for your shading to say.
    /// Textures of other filters may take more bindings in the same group.
    ///
    /// # WESL
    /// The text is a module of [WESL](https://wesl-lang.dev) too. Give it a path of its own and
    /// import from it:
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
    /// It cannot come as a package that is known at build time: its bindings depend on the device
    /// ([`Support`]), and its constants on the filter.
    pub fn lookup_wgsl(&self, group: u32) -> String {
        wgsl::lookup(group, &self.options, self.support.storage_buffers)
    }

    /// Layout of the bind group that [`lookup_wgsl`](Self::lookup_wgsl) takes, for fragment shaders and, on devices with
    /// storage buffers, compute shaders.
    pub fn lookup_layout(&self) -> &BindGroupLayout {
        &self.lookup_layout
    }

    /// The bind group that [`lookup_wgsl`](Self::lookup_wgsl) takes. Ask for it each frame: it changes where the texture does.
    pub fn lookup_bind_group(&self) -> &BindGroup {
        &self.lookup_bind_group
    }

    /// WGSL to put before the text of a shader that draws casters; `group` is the bind group that
    /// holds the map's matrix, of which [`Prepared::encode`] sets group 0. It declares the same on
    /// every device, so a shader that is written once is right on all of them:
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
    /// Name your own entry points in pipelines, since the text has some too.
    ///
    /// Casters without holes need a vertex stage alone, which returns `shadow_caster` of a position
    /// in render space. Give their pipeline the fragment stage that
    /// [`caster_fragment`](Self::caster_fragment) says:
    ///
    /// ```wgsl
    /// @vertex fn vertex(@location(0) position: vec3f) -> ShadowCaster {
    ///     return shadow_caster(position);
    /// }
    /// ```
    ///
    /// Casters with a fragment stage of their own, say to discard holes, hand both `clip` and
    /// `depth` on in a struct of their own, and write `shadow_fragment_depth` of `depth` as
    /// `@builtin(frag_depth)`. That is right on every device. Where
    /// [`caster_needs_fragment`](Self::caster_needs_fragment) is `false` another entry point that
    /// does not write depth is as right, and faster: devices test depth early then.
    pub fn caster_wgsl(&self, group: u32) -> String {
        wgsl::caster(group, &self.support)
    }

    /// Whether pipelines that draw casters need a fragment stage that writes depth: `true` on
    /// devices that do not clamp depths (see [`Support::depth_clip_control`]).
    pub fn caster_needs_fragment(&self) -> bool {
        !self.support.depth_clip_control
    }

    /// The fragment stage of a pipeline that draws casters without holes, from a module that begins
    /// with [`caster_wgsl`](Self::caster_wgsl): the text's own `shadow_caster_fragment`, or `None`
    /// where the device needs no such stage.
    ///
    /// A vertex stage that gives out the clip position without the depth, and so would be wrong on
    /// some devices, fails wgpu's validation. In builds with debug assertions it does so on every
    /// device: those that need no fragment stage get one that does nothing.
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

    /// Layout of the bind group that [`caster_wgsl`](Self::caster_wgsl) takes: one uniform with a dynamic offset.
    pub fn caster_layout(&self) -> &BindGroupLayout {
        &self.casters.layout
    }

    /// Depth state for pipelines that draw casters. There is no depth bias in it: the lookup has all
    /// of it.
    pub fn depth_stencil_state(&self) -> DepthStencilState {
        depth_state(CompareFunction::Less)
    }

    /// Primitive state for pipelines that draw casters: triangles, both sides, depth clamped if the
    /// device does so. What it leaves to the fragment stage elsewhere,
    /// [`caster_wgsl`](Self::caster_wgsl) tells.
    pub fn primitive_state(&self) -> PrimitiveState {
        PrimitiveState {
            unclipped_depth: self.support.depth_clip_control,
            ..PrimitiveState::default()
        }
    }

    /// The depths of all maps: a texture of [`DEPTH_FORMAT`], with layers where the layout says so, in which [`place`](Self::place) says where they lie.
    pub fn depth_texture(&self) -> &Texture {
        &self.texture.texture
    }

    /// Where a map of the plan lies in the texture; `None` for empty ones.
    pub fn place(&self, map: usize) -> Option<Place> {
        self.slots.places().get(map).copied().flatten()
    }

    /// Memory of what lookup samples, bytes: of depths, or of a filter's numbers in their place.
    pub fn lookup_bytes(&self) -> u64 {
        self.prefiltering.as_ref().map_or_else(|| self.texture_bytes(), Prefiltering::bytes)
    }

    /// Memory of the depth texture, bytes.
    pub fn texture_bytes(&self) -> u64 {
        let Extent3d { width, height, depth_or_array_layers } = self.texture.texture.size();
        4 * u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers)
    }

    /// Finds a place for each of a plan's maps, uploads what shaders need, and tells which maps are to be drawn.
    /// Drop the result and nothing is drawn now, but next time.
    ///
    /// # Errors
    /// A plan for another filter, maps that a GPU cannot draw, or that do not fit into the device's
    /// textures; then nothing has changed.
    pub fn prepare<'a>(
        &'a mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame<'a>,
    ) -> Result<Prepared<'a>, Error> {
        let Frame { plan, render_origin, casters } = *frame;
        if plan.filter != self.options.filter {
            return Err(Error::OtherFilter {
                planned: plan.filter,
                looked_up: self.options.filter,
            });
        }
        if !render_origin.is_finite() {
            return Err(Error::Invalid {
                field: "frame.render_origin",
                problem: format!("must be finite, is {render_origin}"),
            });
        }
        if let Some(map) = plan.maps.iter().position(|m| m.rows != Rows::Even && !m.is_empty()) {
            return Err(Error::LogarithmicRows { map });
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
            },
        );
        self.lookup.check(&self.support)?;
        let mut rebind = false;
        if !self.texture.holds(size, layers) {
            self.texture =
                DepthTexture::new(device, &self.support, self.options.layout, size, layers);
            if let Some(prefiltering) = &mut self.prefiltering {
                prefiltering.resize(device, &self.support, &self.texture);
            }
            rebind = true;
        }
        rebind |= self.buffers.hold(device, &self.support, &self.lookup);
        if rebind {
            let view = looked_up(&self.texture, self.prefiltering.as_ref());
            self.lookup_bind_group =
                self.buffers.bind(device, &self.lookup_layout, view, &self.sampler);
        }
        if rebind || self.lookup != self.uploaded {
            self.buffers.upload(queue, &self.lookup);
            std::mem::swap(&mut self.lookup, &mut self.uploaded);
        }

        self.records.resize_with(plan.maps.len(), Record::default);
        let mut any_stale = false;
        for ((map, place), record) in
            plan.maps.iter().zip(self.slots.places()).zip(&mut self.records)
        {
            let changed = match casters {
                Casters::Moved => true,
                Casters::MovedIn(boxes) => boxes.iter().any(|&b| map.may_cast(b)),
                Casters::Unmoved => false,
            };
            if changed || self.texture.is_fresh || !record.is_of(map, *place) {
                record.set(map, *place);
            }
            if record.stale_place().is_some() {
                any_stale = true;
                record.clip_from_render = clip_from_render(map, &filter, render_origin);
            }
        }
        if any_stale {
            self.casters.upload(device, queue, &self.records);
            let Self { records, texture, prefiltering, .. } = &mut *self;
            if let Some(prefiltering) = prefiltering {
                prefiltering.upload(device, queue, plan, records, texture);
            }
        }
        Ok(Prepared { shadows: self, plan, render_origin })
    }
}

impl DepthTexture {
    fn new(
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

    /// Texels, width and height.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }

    /// Whether maps that need this much fit, and do not leave most of it unused.
    fn holds(&self, size: [u32; 2], layers: u32) -> bool {
        let Extent3d { width, height, depth_or_array_layers } = self.texture.size();
        let texels =
            |[w, h]: [u32; 2], layers: u32| u64::from(w) * u64::from(h) * u64::from(layers);
        let has = texels([width, height], depth_or_array_layers);
        size[0] <= width
            && size[1] <= height
            && layers <= depth_or_array_layers
            && has <= 4 * texels(size, layers).max(1)
    }

    /// Size of the texture that will hold maps which need this much.
    fn size_for(&self, size: [u32; 2], layers: u32) -> [u32; 2] {
        let Extent3d { width, height, .. } = self.texture.size();
        if self.holds(size, layers) { [width, height] } else { size }
    }
}

impl Buffers {
    fn new(device: &Device, support: &Support) -> Self {
        // Uniform arrays have one size for all.
        let [lights, maps, planes] =
            if support.storage_buffers { [1; 3] } else { [MAX_LIGHTS, MAX_MAPS, MAX_PLANES] };
        Self {
            settings: buffer(device, size_of::<data::Settings>(), BufferUsages::UNIFORM),
            lights: array::<data::Light>(device, support, lights),
            maps: array::<data::Map>(device, support, maps),
            planes: array::<[f32; 4]>(device, support, planes),
        }
    }

    /// Grows what is too small for `lookup`; `true` if anything was.
    fn hold(&mut self, device: &Device, support: &Support, lookup: &Lookup) -> bool {
        let mut has_grown = false;
        let mut hold = |buffer: &mut Buffer, bytes: usize| {
            if buffer.size() < bytes as u64 {
                *buffer = array::<u8>(device, support, bytes.next_power_of_two());
                has_grown = true;
            }
        };
        hold(&mut self.lights, size_of_val(lookup.lights.as_slice()));
        hold(&mut self.maps, size_of_val(lookup.maps.as_slice()));
        hold(&mut self.planes, size_of_val(lookup.planes.as_slice()));
        has_grown
    }

    fn upload(&self, queue: &Queue, lookup: &Lookup) {
        queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&lookup.settings));
        queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&lookup.lights));
        queue.write_buffer(&self.maps, 0, bytemuck::cast_slice(&lookup.maps));
        queue.write_buffer(&self.planes, 0, bytemuck::cast_slice(&lookup.planes));
    }

    fn bind(
        &self,
        device: &Device,
        layout: &BindGroupLayout,
        texture: &TextureView,
        sampler: &wgpu::Sampler,
    ) -> BindGroup {
        let resources = [
            self.settings.as_entire_binding(),
            self.lights.as_entire_binding(),
            self.maps.as_entire_binding(),
            self.planes.as_entire_binding(),
            BindingResource::TextureView(texture),
            BindingResource::Sampler(sampler),
        ];
        let entries = (0..).zip(resources);
        let entries: Vec<_> =
            entries.map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow lookup"),
            layout,
            entries: &entries,
        })
    }
}

impl CasterBuffer {
    fn new(device: &Device, support: &Support) -> Self {
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

    fn upload(&mut self, device: &Device, queue: &Queue, records: &[Record]) {
        let stride = self.stride as usize;
        self.bytes.clear();
        self.bytes.resize(stride * records.len(), 0);
        for (record, bytes) in records.iter().zip(self.bytes.chunks_exact_mut(stride)) {
            let map = CasterMap { clip_from_render: record.clip_from_render.as_mat4() };
            bytes[..size_of::<CasterMap>()].copy_from_slice(bytemuck::bytes_of(&map));
        }
        if self.buffer.size() < self.bytes.len() as u64 {
            let bytes = stride * records.len().next_power_of_two();
            self.buffer = buffer(device, bytes, BufferUsages::UNIFORM);
            self.bind_group = Self::bind(device, &self.layout, &self.buffer);
        }
        queue.write_buffer(&self.buffer, 0, &self.bytes);
    }
}

/// The filter that is applied ahead of lookup, if it is one.
fn prefilter(filter: &Filter) -> Option<&Prefilter> {
    match filter {
        Filter::Prefiltered(prefilter) => Some(prefilter),
        Filter::Hard | Filter::Pcf { .. } | Filter::Spread { .. } | Filter::Pcss { .. } => None,
    }
}

/// Whether the texture unit compares depths.
fn compares(options: &ShadowOptions) -> bool {
    options.comparison == Comparison::Hardware && prefilter(&options.filter).is_none()
}

/// What lookup samples.
fn looked_up<'a>(
    depths: &'a DepthTexture,
    prefiltering: Option<&'a Prefiltering>,
) -> &'a TextureView {
    prefiltering.map_or(&depths.all, Prefiltering::view)
}

fn view_dimension(layout: Layout) -> TextureViewDimension {
    match layout {
        Layout::Atlas => TextureViewDimension::D2,
        Layout::Layers => TextureViewDimension::D2Array,
    }
}

/// Depth state with this comparison.
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
    let array = if support.storage_buffers {
        BufferBindingType::Storage { read_only: true }
    } else {
        BufferBindingType::Uniform
    };
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let types = [
        buffer(BufferBindingType::Uniform),
        buffer(array),
        buffer(array),
        buffer(array),
        match prefilter(&options.filter) {
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
        BindingType::Sampler(match prefilter(&options.filter) {
            Some(_) => SamplerBindingType::Filtering,
            None if compares(options) => SamplerBindingType::Comparison,
            None => SamplerBindingType::NonFiltering,
        }),
    ];
    let entries = (0..).zip(types);
    let entries: Vec<_> = entries
        .map(|(binding, ty)| BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow lookup"),
        entries: &entries,
    })
}

/// A buffer of `bytes` that is written from the CPU.
fn buffer(device: &Device, bytes: usize, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("shadows"),
        size: bytes as u64,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Room for `n` elements that lookup reads.
fn array<T>(device: &Device, support: &Support, n: usize) -> Buffer {
    let usage = if support.storage_buffers { BufferUsages::STORAGE } else { BufferUsages::UNIFORM };
    buffer(device, size_of::<T>() * n, usage)
}
