use crate::{Error, Gpu};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use umbrage::Aabb;
use umbrage_scene::{Alpha, Instance, Material, Mesh, Scene, Texture, Wrap};
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{
    AddressMode, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout,
    BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingResource, BindingType, Buffer,
    BufferBindingType, BufferUsages, Extent3d, FilterMode, Sampler, SamplerBindingType,
    SamplerDescriptor, ShaderStages, TextureDescriptor, TextureDimension, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
};

/// The meshes and materials of a scene on a GPU.
pub struct SceneBuffers<'a> {
    scene: &'a Scene,
    pub(crate) positions: Buffer,
    pub(crate) attributes: Buffer,
    pub(crate) indices: Buffer,
    /// One for each mesh.
    pub(crate) meshes: Vec<MeshRange>,
    pub(crate) materials: Vec<GpuMaterial>,
    pub(crate) material_layout: BindGroupLayout,
    /// The instances that have triangles, those of one mesh next to each other.
    pub(crate) instances: Vec<Drawable>,
}

/// An instance of a mesh.
pub(crate) struct Drawable {
    /// Index in [`Scene::instances`].
    pub(crate) instance: usize,
    /// Index of the mesh.
    pub(crate) mesh: usize,
    pub(crate) world_from_mesh: DAffine3,
    /// World space, metres.
    pub(crate) bounds: Aabb,
}

/// The range of a mesh in the buffers.
#[derive(Clone, Debug)]
pub(crate) struct MeshRange {
    pub(crate) indices: std::ops::Range<u32>,
    pub(crate) first_vertex: i32,
    pub(crate) material: usize,
}

impl MeshRange {
    /// Number of triangles.
    pub(crate) fn triangles(&self) -> u32 {
        self.indices.len() as u32 / 3
    }
}

/// A material, for meshes with or for meshes without texture coordinates.
pub(crate) struct GpuMaterial {
    pub(crate) bind_group: BindGroup,
    pub(crate) mask: Option<GpuMask>,
}

/// The alpha mask of a material.
pub(crate) struct GpuMask {
    pub(crate) texture: TextureView,
    pub(crate) sampler: Sampler,
    pub(crate) factor: f32,
    pub(crate) cutoff: f32,
}

/// The attributes of a vertex without its position, which has a buffer of its own because opaque
/// casters need nothing else.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Attributes {
    pub(crate) normal: Vec3,
    pub(crate) uv: Vec2,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct MaterialUniform {
    base_color: Vec4,
    cutoff: f32,
    padding: [f32; 3],
}

impl<'a> SceneBuffers<'a> {
    /// Uploads a scene. If `opaque` is true, alpha masks are ignored.
    ///
    /// # Errors
    /// The scene or a texture is too large for the device.
    pub fn new(gpu: &Gpu, scene: &'a Scene, opaque: bool) -> Result<Self, Error> {
        let device = gpu.device();
        let limits = device.limits();
        let largest = limits.max_buffer_size.min(u64::from(u32::MAX));
        let vertices: usize = scene.meshes.iter().map(|m| m.positions.len()).sum();
        let indices: usize = scene.meshes.iter().map(|m| 3 * m.triangles.len()).sum();
        let bytes = (vertices * size_of::<Attributes>()).max(4 * indices) as u64;
        if bytes > largest {
            return Err(Error::TooLarge {
                what: "the scene".into(),
                problem: format!("{bytes} bytes, but a buffer holds at most {largest}"),
            });
        }
        for (i, texture) in scene.textures.iter().enumerate() {
            let max = limits.max_texture_dimension_2d;
            if texture.size.iter().any(|&n| n > max) {
                return Err(Error::TooLarge {
                    what: format!("texture {i} of {}x{} pixels", texture.size[0], texture.size[1]),
                    problem: format!("at most {max} pixels in width and height"),
                });
            }
        }
        let all_positions: Vec<Vec3> =
            scene.meshes.iter().flat_map(|m| m.positions.iter().copied()).collect();
        let attributes: Vec<Attributes> = scene.meshes.iter().flat_map(attributes).collect();
        let all_indices: Vec<[u32; 3]> =
            scene.meshes.iter().flat_map(|m| m.triangles.iter().copied()).collect();
        let material_layout = material_layout(gpu);
        let mut materials = Materials::new(gpu, scene, &material_layout, opaque);
        let (mut first_vertex, mut first_index) = (0, 0);
        let meshes = scene.meshes.iter().map(|mesh| {
            let end = first_index + 3 * mesh.triangles.len() as u32;
            let range = MeshRange {
                indices: first_index..end,
                first_vertex,
                material: materials.index(mesh.material, !mesh.uvs.is_empty()),
            };
            first_vertex += mesh.positions.len() as i32;
            first_index = end;
            range
        });
        let meshes: Vec<MeshRange> = meshes.collect();
        let boxes = scene.instance_boxes();
        let drawable =
            scene.instances.iter().zip(boxes).enumerate().map(|(i, (placed, bounds))| {
                let Instance { mesh, world_from_mesh } = *placed;
                Drawable { instance: i, mesh, world_from_mesh, bounds }
            });
        let mut instances: Vec<Drawable> = drawable.filter(|i| !i.bounds.is_empty()).collect();
        instances.sort_by_key(|i| i.mesh);
        let buffers = Self {
            scene,
            positions: gpu.buffer(
                "positions",
                bytemuck::cast_slice(&all_positions),
                BufferUsages::VERTEX,
            ),
            attributes: gpu.buffer(
                "attributes",
                bytemuck::cast_slice(&attributes),
                BufferUsages::VERTEX,
            ),
            indices: gpu.buffer("indices", bytemuck::cast_slice(&all_indices), BufferUsages::INDEX),
            meshes,
            materials: materials.list,
            material_layout,
            instances,
        };
        gpu.check()?;
        Ok(buffers)
    }

    /// The scene that was uploaded.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Whether a mesh has holes where its material's alpha is low.
    pub(crate) fn is_masked(&self, mesh: usize) -> bool {
        self.materials[self.meshes[mesh].material].mask.is_some()
    }

    /// Memory of vertices and indices, bytes.
    pub fn bytes(&self) -> u64 {
        self.positions.size() + self.attributes.size() + self.indices.size()
    }
}

fn attributes(mesh: &Mesh) -> impl Iterator<Item = Attributes> {
    (0..mesh.positions.len()).map(|i| Attributes {
        normal: mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO),
        uv: mesh.uvs.get(i).copied().unwrap_or(Vec2::ZERO),
    })
}

/// Collects the materials in the order in which meshes use them.
struct Materials<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    layout: &'a BindGroupLayout,
    opaque: bool,
    textures: Vec<TextureView>,
    white: TextureView,
    list: Vec<GpuMaterial>,
    known: HashMap<(usize, bool), usize>,
}

impl<'a> Materials<'a> {
    fn new(gpu: &'a Gpu, scene: &'a Scene, layout: &'a BindGroupLayout, opaque: bool) -> Self {
        let textures = scene.textures.iter().map(|t| upload(gpu, t)).collect();
        let white = upload(gpu, &Texture::default());
        Self {
            gpu,
            scene,
            layout,
            opaque,
            textures,
            white,
            list: Vec::new(),
            known: HashMap::new(),
        }
    }

    fn index(&mut self, material: usize, has_uvs: bool) -> usize {
        if let Some(&index) = self.known.get(&(material, has_uvs)) {
            return index;
        }
        let made = self.make(&self.scene.materials[material], has_uvs);
        self.list.push(made);
        self.known.insert((material, has_uvs), self.list.len() - 1);
        self.list.len() - 1
    }

    fn make(&self, material: &Material, has_uvs: bool) -> GpuMaterial {
        let device = self.gpu.device();
        let texture = material.base_color_texture.filter(|_| has_uvs);
        let view = texture.map_or(&self.white, |id| &self.textures[id.0]);
        let wrap = texture.map_or([Wrap::default(); 2], |id| self.scene.textures[id.0].wrap);
        let [address_mode_u, address_mode_v] = wrap.map(|w| match w {
            Wrap::Repeat => AddressMode::Repeat,
            Wrap::Mirror => AddressMode::MirrorRepeat,
            Wrap::Clamp => AddressMode::ClampToEdge,
        });
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("material"),
            address_mode_u,
            address_mode_v,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..SamplerDescriptor::default()
        });
        let cutoff = match material.alpha {
            Alpha::Mask { cutoff } if !self.opaque => Some(cutoff),
            _ => None,
        };
        let uniform = MaterialUniform {
            base_color: material.base_color,
            cutoff: cutoff.unwrap_or(f32::MIN),
            padding: [0.0; 3],
        };
        let contents = bytemuck::bytes_of(&uniform);
        let uniform = self.gpu.buffer("material", contents, BufferUsages::UNIFORM);
        let entry = |binding, resource| BindGroupEntry { binding, resource };
        let bind_group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("material"),
            layout: self.layout,
            entries: &[
                entry(0, uniform.as_entire_binding()),
                entry(1, BindingResource::TextureView(view)),
                entry(2, BindingResource::Sampler(&sampler)),
            ],
        });
        let factor = material.base_color.w;
        let mask = cutoff.map(|cutoff| GpuMask { texture: view.clone(), sampler, factor, cutoff });
        GpuMaterial { bind_group, mask }
    }
}

/// Uploads a texture. A texture without pixels becomes opaque white.
fn upload(gpu: &Gpu, texture: &Texture) -> TextureView {
    let is_whole = texture.rgba.len() as u64
        == u64::from(texture.size[0]) * u64::from(texture.size[1])
        && !texture.rgba.is_empty();
    let white = [[255; 4]];
    let (size, rgba) =
        if is_whole { (texture.size, texture.rgba.as_slice()) } else { ([1, 1], &white[..]) };
    let descriptor = TextureDescriptor {
        label: Some("base color"),
        size: Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let data = bytemuck::cast_slice(rgba);
    let order = TextureDataOrder::LayerMajor;
    let texture = gpu.device().create_texture_with_data(gpu.queue(), &descriptor, order, data);
    texture.create_view(&TextureViewDescriptor::default())
}

fn material_layout(gpu: &Gpu) -> BindGroupLayout {
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let uniform = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device().create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("material"),
        entries: &[
            entry(0, uniform),
            entry(1, texture),
            entry(2, BindingType::Sampler(SamplerBindingType::Filtering)),
        ],
    })
}
