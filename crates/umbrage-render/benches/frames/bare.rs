//! Depth passes over the maps of a plan, written in plain wgpu without any library.

use bytemuck::{bytes_of, cast_slice};
use glam::{DMat4, Mat4, Vec3, Vec4};
use std::ops::Range;
use umbrage::Plan;
use umbrage_render::{Gpu, Stage, Timer};
use umbrage_scene::Scene;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu_profiler::GpuProfilerQuery;

const SHADER: &str = "
    @group(0) @binding(0) var<uniform> clip_from_local: mat4x4f;

    @vertex
    fn vertex(
        @location(0) position: vec3f,
        @location(1) x: vec4f,
        @location(2) y: vec4f,
        @location(3) z: vec4f,
    ) -> @builtin(position) vec4f {
        let point = vec4f(position, 1.0);
        return clip_from_local * vec4f(dot(x, point), dot(y, point), dot(z, point), 1.0);
    }";

/// Everything that the depth passes need.
pub(crate) struct BareDepth<'a> {
    scene: &'a Scene,
    pipeline: wgpu::RenderPipeline,
    maps: Vec<BareMap>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    instances: wgpu::Buffer,
    /// Range of indices and first vertex of each mesh.
    meshes: Vec<(Range<u32>, i32)>,
    boxes: Vec<umbrage::Aabb>,
    by_mesh: Vec<usize>,
}

/// A map with a texture of its own.
struct BareMap {
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
    matrix: wgpu::Buffer,
}

impl BareMap {
    fn new(gpu: &Gpu, pipeline: &wgpu::RenderPipeline, resolution: [u32; 2]) -> Self {
        let device = gpu.device();
        let matrix = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: bytes_of(&Mat4::IDENTITY),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() }],
        });
        let [width, height] = resolution;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Self { view: texture.create_view(&Default::default()), group, matrix }
    }
}

impl<'a> BareDepth<'a> {
    pub(crate) fn new(gpu: &Gpu, scene: &'a Scene, plan: &Plan) -> Self {
        let device = gpu.device();
        let positions: Vec<Vec3> =
            scene.meshes.iter().flat_map(|m| m.positions.iter().copied()).collect();
        let indices: Vec<[u32; 3]> =
            scene.meshes.iter().flat_map(|m| m.triangles.iter().copied()).collect();
        let (mut index, mut vertex) = (0, 0);
        let meshes = scene.meshes.iter().map(|m| {
            let range = index..index + 3 * m.triangles.len() as u32;
            index = range.end;
            vertex += m.positions.len() as i32;
            (range, vertex - m.positions.len() as i32)
        });
        let meshes = meshes.collect();
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let instances = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 48 * (scene.instances.len() * plan.maps.len()) as u64,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let pipeline = depth_pipeline(gpu);
        let full = plan.maps.iter().filter(|m| !m.is_empty());
        let maps = full.map(|m| BareMap::new(gpu, &pipeline, m.resolution)).collect();
        let mut by_mesh: Vec<usize> = (0..scene.instances.len()).collect();
        by_mesh.sort_by_key(|&i| scene.instances[i].mesh);
        Self {
            scene,
            pipeline,
            maps,
            vertices: buffer(cast_slice(&positions), wgpu::BufferUsages::VERTEX),
            indices: buffer(cast_slice(&indices), wgpu::BufferUsages::INDEX),
            instances,
            meshes,
            boxes: scene.instance_boxes(),
            by_mesh,
        }
    }

    /// Draws and submits the same triangles as the library, culled in the same way.
    pub(crate) fn draw(&mut self, gpu: &Gpu, plan: &Plan, timer: Option<&mut Timer>) {
        let ndc = DMat4::from_cols_array_2d(&[
            [2.0, 0.0, 0.0, 0.0],
            [0.0, -2.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0, 1.0],
        ]);
        let mut rows: Vec<[Vec4; 3]> = Vec::new();
        let mut draws: Vec<Vec<(usize, Range<u32>)>> = Vec::new();
        for (map, bare) in plan.maps.iter().filter(|m| !m.is_empty()).zip(&self.maps) {
            let clip_from_local = (ndc * map.shadow_from_local).as_mat4();
            gpu.queue().write_buffer(&bare.matrix, 0, bytes_of(&clip_from_local));
            let mut of_map: Vec<(usize, Range<u32>)> = Vec::new();
            for &i in self.by_mesh.iter().filter(|&&i| map.may_cast(self.boxes[i])) {
                let instance = &self.scene.instances[i];
                let m = instance.world_from_mesh;
                let t = m.translation - plan.origin;
                let at = rows.len() as u32;
                rows.push([0, 1, 2].map(|r| m.matrix3.row(r).extend(t[r]).as_vec4()));
                match of_map.last_mut() {
                    Some((mesh, range)) if *mesh == instance.mesh => range.end = at + 1,
                    _ => of_map.push((instance.mesh, at..at + 1)),
                }
            }
            draws.push(of_map);
        }
        gpu.queue().write_buffer(&self.instances, 0, cast_slice(&rows));
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        // The time of all passes is that of one picture.
        let query = timer.as_ref().map(|t| t.begin(Stage::Picture, &mut encoder));
        for (i, (bare, draws)) in self.maps.iter().zip(draws).enumerate() {
            let all = query.as_ref().and_then(GpuProfilerQuery::render_pass_timestamp_writes);
            let timestamp_writes = all.map(|all| {
                let begins = all.beginning_of_pass_write_index.filter(|_| i == 0);
                let ends = all.end_of_pass_write_index.filter(|_| i + 1 == self.maps.len());
                wgpu::RenderPassTimestampWrites {
                    beginning_of_pass_write_index: begins,
                    end_of_pass_write_index: ends,
                    ..all
                }
            });
            let is_timed = |t: &wgpu::RenderPassTimestampWrites<'_>| {
                t.beginning_of_pass_write_index.or(t.end_of_pass_write_index).is_some()
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &bare.view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: timestamp_writes.filter(is_timed),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bare.group, &[]);
            pass.set_vertex_buffer(0, self.vertices.slice(..));
            pass.set_vertex_buffer(1, self.instances.slice(..));
            pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (mesh, instances) in draws {
                let (indices, first) = self.meshes[mesh].clone();
                pass.draw_indexed(indices, first, instances);
            }
        }
        if let Some(timer) = timer {
            timer.end(&mut encoder, query);
        }
        gpu.queue().submit([encoder.finish()]);
    }
}

/// The pipeline of the depth pass, with positions and the rows of instance matrices as vertices.
fn depth_pipeline(gpu: &Gpu) -> wgpu::RenderPipeline {
    let device = gpu.device();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[
                Some(wgpu::VertexBufferLayout {
                    array_stride: 12,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3],
                }),
                Some(wgpu::VertexBufferLayout {
                    array_stride: 48,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![
                        1 => Float32x4, 2 => Float32x4, 3 => Float32x4
                    ],
                }),
            ],
        },
        primitive: wgpu::PrimitiveState {
            unclipped_depth: gpu.support().depth_clip_control,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}
