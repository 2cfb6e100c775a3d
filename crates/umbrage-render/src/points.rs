//! Looks up visibility at arbitrary points, without drawing a picture.

use crate::renderer::Renderer;
use crate::{Error, Gpu};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use umbrage_wgpu::Shadows;
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, BufferBindingType, BufferDescriptor, BufferUsages,
    ComputePassDescriptor, ComputePipeline, ComputePipelineDescriptor, PipelineCompilationOptions,
    PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
};

/// The struct `Point` of `wgsl/points.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Point {
    position: Vec3,
    light: u32,
    normal: Vec3,
    padding: u32,
}

/// Number of points per dispatch: as many as a dispatch of guaranteed size can have.
const BATCH: usize = 64 * 65535;

/// The compute pipeline that looks up visibility at points.
pub(crate) struct Points {
    pipeline: ComputePipeline,
    layout: BindGroupLayout,
}

impl Points {
    fn new(gpu: &Gpu, shadows: &Shadows) -> Self {
        let device = gpu.device();
        let text = shadows.lookup_wgsl(0) + "\n" + include_str!("wgsl/points.wgsl");
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("points"),
            source: ShaderSource::Wgsl(text.into()),
        });
        let entry = |binding, read_only| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("points"),
            entries: &[entry(0, true), entry(1, false)],
        });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("points"),
            bind_group_layouts: &[Some(shadows.lookup_layout()), Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&ComputePipelineDescriptor {
            label: Some("points"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("look_up"),
            compilation_options: PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { pipeline, layout }
    }
}

impl Renderer<'_> {
    /// Visibility, in [0, 1], of surface points under one of the plan's lights, as its maps have
    /// it. Each point is a position and the normal of its triangle, both in world space. The maps
    /// must have been drawn: without any, all points are lit.
    ///
    /// # Errors
    /// The device refused something or was lost.
    pub fn visibility(&mut self, light: u32, points: &[[DVec3; 2]]) -> Result<Vec<f32>, Error> {
        if self.points.is_none() {
            self.points = Some(Points::new(self.gpu, &self.shadows));
        }
        let eye = self.eye.unwrap_or(DVec3::ZERO);
        let mut visibility = Vec::with_capacity(points.len());
        for points in points.chunks(BATCH) {
            let points: Vec<Point> = points
                .iter()
                .map(|&[position, normal]| Point {
                    position: (position - eye).as_vec3(),
                    light,
                    normal: normal.as_vec3(),
                    padding: 0,
                })
                .collect();
            visibility.extend(self.look_up(&points)?);
        }
        Ok(visibility)
    }

    fn look_up(&self, points: &[Point]) -> Result<Vec<f32>, Error> {
        let device = self.gpu.device();
        let Some(Points { pipeline, layout }) = &self.points else { return Ok(Vec::new()) };
        let contents = bytemuck::cast_slice(points);
        let input = self.gpu.buffer("points", contents, BufferUsages::STORAGE);
        let buffer = |usage| {
            device.create_buffer(&BufferDescriptor {
                label: Some("visibility"),
                size: size_of_val(points) as u64 / (size_of::<Point>() / size_of::<f32>()) as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let output = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let readback = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
        let group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("points"),
            layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
                BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
            ],
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, self.shadows.lookup_bind_group(), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.dispatch_workgroups((points.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, output.size());
        self.gpu.queue().submit([encoder.finish()]);
        self.gpu.read(&readback)
    }
}
