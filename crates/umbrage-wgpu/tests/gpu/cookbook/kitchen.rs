//! A small renderer for the recipes' tests, and the true shadows of its scene.

use crate::device::Bench;
use bytemuck::{bytes_of, cast_slice};
use glam::{DAffine3, DVec2, DVec3, Mat4, Vec3, camera::rh};
use umbrage::{Aabb, Bounds, Camera, Light, Plan, Planner, Technique};
use umbrage_wgpu::{
    CasterInstance, Casters, Frame, MapPass, MeshCasters, MeshKind, Shadows, Timestamps,
};
use wgpu::{BindGroup, BindGroupLayout, BufferUsages, RenderPipeline, TextureUsages, TextureView};

pub(crate) const SIZE: [u32; 2] = [320, 192];
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const NORMAL_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A device and the scene's triangles, in world space.
pub(crate) struct Kitchen {
    pub(crate) bench: Bench,
    triangles: Vec<Vec3>,
    /// Around all meshes but the first, the plain.
    boxes: Vec<Aabb>,
    vertices: wgpu::Buffer,
    instance: wgpu::Buffer,
}

/// The ground y = 0, 60 metres wide.
pub(crate) fn plain() -> Vec<Vec3> {
    let corner = |x: f32, z: f32| Vec3::new(x * 30.0, 0.0, z * 30.0);
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    vec![a, b, c, a, c, d]
}

const HALF: DVec3 = DVec3::new(0.75, 0.9, 0.6);

/// A box that stands on the ground at a place.
pub(crate) fn box_at(at: DVec3) -> Vec<Vec3> {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        (at + DVec3::Y * HALF.y + HALF * DVec3::new(sign(0), sign(1), sign(2))).as_vec3()
    };
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d].map(corner)).collect()
}

/// Whether the box at a place hides what lies from `p` in a direction, up to its length for lamps.
pub(crate) fn box_hides(at: DVec3, p: DVec3, towards: DVec3) -> bool {
    hit(Aabb::new(at - HALF + DVec3::Y * HALF.y, at + HALF + DVec3::Y * HALF.y), p, towards)
        .is_some()
}

fn hit(aabb: Aabb, p: DVec3, towards: DVec3) -> Option<f64> {
    let [a, b] = [(aabb.min - p) / towards, (aabb.max - p) / towards];
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    (leave > enter.max(1e-9)).then_some(enter.max(0.0))
}

/// Middle and radius of the sphere of which the dome is the upper part.
const DOME: (DVec3, f64) = (DVec3::new(1.6, -0.4, 1.2), 1.6);
const DOME_STEPS: u32 = 5;

/// A dome of flat triangles whose corners lie on a sphere.
pub(crate) fn dome() -> Vec<Vec3> {
    let corner = |i: u32, j: u32| {
        let polar = f64::from(i) / f64::from(DOME_STEPS) * 1.5;
        let azimuth = f64::from(j) / f64::from(2 * DOME_STEPS) * std::f64::consts::TAU;
        let (sin, cos) = polar.sin_cos();
        let direction = DVec3::new(sin * azimuth.cos(), cos, sin * azimuth.sin());
        (DOME.0 + direction * DOME.1).as_vec3()
    };
    let cells = (0..DOME_STEPS).flat_map(|i| (0..2 * DOME_STEPS).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
            [a, b, c, a, c, d].map(|(i, j)| corner(i, j))
        })
        .collect()
}

/// Whether the whole sphere of the dome hides what lies from `p` in a direction.
pub(crate) fn dome_hides(p: DVec3, towards: DVec3) -> bool {
    on_sphere(p, towards).is_some()
}

fn on_sphere(p: DVec3, towards: DVec3) -> Option<f64> {
    let (from, direction) = (p - DOME.0, towards.normalize());
    let b = from.dot(direction);
    let root = b * b - from.length_squared() + DOME.1 * DOME.1;
    (root > 0.0).then(|| -b - root.sqrt()).filter(|&t| t > 1e-9)
}

/// The share of the dome's pixels in full light (away from its rim and its terminator, unshadowed)
/// that a picture has darker than three quarters.
pub(crate) fn dark_on_dome(picture: &[[u8; 4]], camera: &Camera, to_sun: DVec3) -> f64 {
    let (mut dark, mut all) = (0, 0);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let sight = camera.ray(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            let ray = sight.direction.normalize();
            let Some(t) = on_sphere(camera.eye(), ray) else { continue };
            let p = camera.eye() + ray * t;
            let normal = (p - DOME.0) / DOME.1;
            let is_clear = p.y > 0.15 && normal.dot(to_sun.normalize()) > 0.25;
            if is_clear && normal.dot(-ray) > 0.3 {
                all += 1;
                dark += usize::from(picture[(y * SIZE[0] + x) as usize][0] < 191);
            }
        }
    }
    assert!(all > 500, "{all} pixels show the dome in light");
    f64::from(u32::try_from(dark).unwrap()) / f64::from(all)
}

pub(crate) fn camera() -> Camera {
    camera_from(DVec3::new(5.0, 4.0, 9.0))
}

pub(crate) fn camera_from(eye: DVec3) -> Camera {
    Camera::look_at(umbrage::LookAt {
        eye,
        target: DVec3::new(0.5, 0.3, 0.0),
        up: DVec3::Y,
        fov_y_rad: 0.9,
        near: 0.1,
        far: 60.0,
        image: SIZE,
    })
    .unwrap()
}

fn clip_from_world(camera: &Camera) -> Mat4 {
    let eye = camera.eye().as_vec3();
    let view = rh::view::look_at_mat4(eye, eye + camera.forward().as_vec3(), camera.up().as_vec3());
    clip_from_view() * view
}

/// The projection of every camera.
pub(crate) fn clip_from_view() -> Mat4 {
    rh::proj::directx::perspective(0.9, SIZE[0] as f32 / SIZE[1] as f32, 0.1, 60.0)
}

/// Pixels that show the ground within 15 metres, and where they do.
pub(crate) fn ground_pixels(camera: &Camera) -> impl Iterator<Item = (DVec2, DVec3)> {
    let camera = *camera;
    (0..SIZE[1]).flat_map(move |y| {
        (0..SIZE[0]).filter_map(move |x| {
            let pixel = DVec2::new(f64::from(x), f64::from(y));
            let ray = camera.ray(pixel + 0.5).direction;
            let t = -camera.eye().y / ray.y;
            let p = camera.eye() + ray * t;
            (t > 0.0 && p.length() < 15.0).then_some((pixel, p))
        })
    })
}

/// A shader that shows how much light a function of the lookup's signature lets through.
pub(crate) fn shader(function: &str) -> String {
    shader_of_color(&format!("vec4f({function}(0u, position, shadow_normal(position)))"))
}

/// A shader of this colour, an expression of `position` in world space.
pub(crate) fn shader_of_color(color: &str) -> String {
    format!(
        "
        @group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
        struct Seen {{ @builtin(position) clip: vec4f, @location(0) position: vec3f }}
        struct GBuffer {{ @location(0) color: vec4f, @location(1) normal: vec4f }}
        @vertex fn vertex(@location(0) position: vec3f) -> Seen {{
            return Seen(clip_from_world * vec4f(position, 1.0), position);
        }}
        @fragment fn fragment(in: Seen) -> GBuffer {{
            let position = in.position;
            let own_normal = cross(dpdy(position), dpdx(position));
            return GBuffer({color}, vec4f(normalize(own_normal), 0.0));
        }}"
    )
}

/// The same with the dome's smooth normal as `smooth_normal`, on other surfaces the triangles' own.
pub(crate) fn dome_shader(functions: &str, expression: &str) -> String {
    let (middle, radius) = (DOME.0.as_vec3(), DOME.1 as f32);
    let normal = format!(
        "fn smooth_normal_at(position: vec3f, own: vec3f) -> vec3f {{
            let out = position - vec3f({:?}, {:?}, {:?});
            let is_dome = length(out) < {:?} && length(out) > {:?} && position.y > 0.001;
            return select(own, normalize(out), is_dome);
        }}",
        middle.x,
        middle.y,
        middle.z,
        radius * 1.001,
        radius * 0.9,
    );
    format!(
        "{functions}{normal}
        fn lit(position: vec3f, own_normal: vec3f) -> vec4f {{
            let smooth_normal = smooth_normal_at(position, own_normal);
            return vec4f({expression});
        }}{}",
        shader_of_color("lit(position, own_normal)")
    )
}

impl Kitchen {
    pub(crate) fn new(meshes: &[Vec<Vec3>]) -> Self {
        let bench = Bench::open();
        let triangles = meshes.concat();
        let vertices = bench.buffer(cast_slice(&triangles), BufferUsages::VERTEX);
        let instance = bench.instance(CasterInstance::new(&DAffine3::IDENTITY, DVec3::ZERO));
        let around = |mesh: &Vec<Vec3>| Aabb::around(mesh.iter().map(|p| p.as_dvec3()));
        let boxes = meshes.iter().skip(1).map(around).collect();
        Self { bench, triangles, boxes, vertices, instance }
    }

    pub(crate) fn bounds(&self) -> Bounds<'static> {
        let around = Aabb::around(self.triangles.iter().map(|p| p.as_dvec3()));
        // What is posed or hung above the meshes casts too.
        Bounds::of_scene(around.union(Aabb::new(around.min, around.max + DVec3::Y * 3.0)))
    }

    pub(crate) fn plan(&self, lights: &[Light], technique: &Technique) -> Plan {
        let mut planner = Planner::with_limits(self.bench.support.limits());
        planner.plan(&camera(), lights, &self.bounds(), technique).unwrap().clone()
    }

    pub(crate) fn vertices(&self) -> &wgpu::Buffer {
        &self.vertices
    }

    pub(crate) fn casters(&self, shadows: &Shadows) -> MeshCasters {
        let layouts = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
        MeshCasters::new(&self.bench.device, shadows, MeshKind::Opaque, &layouts)
    }

    pub(crate) fn draw(&self, casters: &RenderPipeline, map: &mut MapPass<'_, '_>) {
        map.pass.set_pipeline(casters);
        map.pass.set_vertex_buffer(0, self.vertices.slice(..));
        map.pass.set_vertex_buffer(1, self.instance.slice(..));
        map.pass.draw(0..self.triangles.len() as u32, 0..1);
    }

    pub(crate) fn draw_maps(&self, shadows: &mut Shadows, plan: &Plan) {
        let casters = self.casters(shadows);
        let mut encoder = self.bench.encoder();
        let frame = Frame { plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
        let prepared = shadows.prepare(&self.bench.device, &self.bench.queue, &frame).unwrap();
        prepared.encode(&mut encoder, &Timestamps::default(), |map| {
            self.draw(casters.pipeline(), map);
        });
        self.bench.finish(encoder);
    }

    pub(crate) fn uniform(&self, contents: &[u8]) -> (BindGroupLayout, BindGroup) {
        let device = &self.bench.device;
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let buffer = self.bench.buffer(contents, BufferUsages::UNIFORM);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        (layout, group)
    }

    /// A forward pipeline with the lookup in group 1.
    pub(crate) fn pipeline(&self, shadows: &Shadows, shader: &str) -> RenderPipeline {
        let text = shadows.lookup_wgsl(1) + shader;
        self.pipeline_of(&text, &[shadows.lookup_layout()])
    }

    fn pipeline_of(&self, text: &str, lookups: &[&BindGroupLayout]) -> RenderPipeline {
        let device = &self.bench.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let (view, _) = self.uniform(bytes_of(&Mat4::IDENTITY));
        let groups: Vec<_> = [&view].into_iter().chain(lookups.iter().copied()).map(Some).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[Some(POSITIONS)],
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(FORMAT.into()), Some(NORMAL_FORMAT.into())],
            }),
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            multiview_mask: None,
            cache: None,
        })
    }

    /// The picture that a shader makes.
    pub(crate) fn forward(&self, shadows: &Shadows, shader: &str, camera: &Camera) -> Vec<[u8; 4]> {
        self.shade(shadows, &self.pipeline(shadows, shader), camera)
    }

    /// The picture that a pipeline makes.
    pub(crate) fn shade(
        &self,
        shadows: &Shadows,
        pipeline: &RenderPipeline,
        camera: &Camera,
    ) -> Vec<[u8; 4]> {
        self.shade_with(&[shadows], pipeline, camera)
    }

    /// The picture that a pipeline makes, and its depths.
    pub(crate) fn shade_and_keep_depths(
        &self,
        shadows: &Shadows,
        pipeline: &RenderPipeline,
        camera: &Camera,
    ) -> (Vec<[u8; 4]>, TextureView) {
        let [color, normal, depth] = self.targets();
        let mut encoder = self.bench.encoder();
        self.encode(&mut encoder, (&[shadows], pipeline), camera, [&color, &normal, &depth]);
        (self.read(encoder, &color), depth.create_view(&Default::default()))
    }

    /// The picture of a shader that looks two kinds of shadows up.
    pub(crate) fn with_two(
        &self,
        lookups: &str,
        shadows: [&Shadows; 2],
        camera: &Camera,
    ) -> Vec<[u8; 4]> {
        let color = "vec4f(light_at(position, own_normal), 0.0, 1.0)";
        let text = lookups.to_owned() + &shader_of_color(color);
        let pipeline = self.pipeline_of(&text, &shadows.map(Shadows::lookup_layout));
        self.shade_with(&shadows, &pipeline, camera)
    }

    fn shade_with(
        &self,
        shadows: &[&Shadows],
        pipeline: &RenderPipeline,
        camera: &Camera,
    ) -> Vec<[u8; 4]> {
        let [color, normal, depth] = self.targets();
        let mut encoder = self.bench.encoder();
        self.encode(&mut encoder, (shadows, pipeline), camera, [&color, &normal, &depth]);
        self.read(encoder, &color)
    }

    fn targets(&self) -> [wgpu::Texture; 3] {
        [FORMAT, NORMAL_FORMAT, DEPTH_FORMAT].map(|format| {
            self.bench.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT
                    | TextureUsages::COPY_SRC
                    | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        })
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (shadows, pipeline): (&[&Shadows], &RenderPipeline),
        camera: &Camera,
        targets: [&wgpu::Texture; 3],
    ) {
        let [color, normal, depth] = targets.map(|t| t.create_view(&Default::default()));
        let (_, view) = self.uniform(bytes_of(&clip_from_world(camera)));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[cleared(&color), cleared(&normal)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &view, &[]);
        for (group, shadows) in (1..).zip(shadows) {
            pass.set_bind_group(group, shadows.lookup_bind_group(), &[]);
        }
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.draw(0..self.triangles.len() as u32, 0..1);
    }

    /// The picture that deferred shading makes of a G-buffer.
    pub(crate) fn deferred(
        &self,
        shadows: &Shadows,
        layout: &BindGroupLayout,
        pipeline: &RenderPipeline,
        camera: &Camera,
    ) -> Vec<[u8; 4]> {
        let [unused, normal, depth] = self.targets();
        let mut encoder = self.bench.encoder();
        let fill = self.pipeline(shadows, &shader_of_color("vec4f(1.0)"));
        self.encode(&mut encoder, (&[shadows], &fill), camera, [&unused, &normal, &depth]);
        let inverse = self.bench.buffer(
            bytes_of(&clip_from_world(camera).as_dmat4().inverse().as_mat4()),
            BufferUsages::UNIFORM,
        );
        let [normals, depths] = [normal, depth].map(|t| t.create_view(&Default::default()));
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = self.bench.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &[
                entry(0, inverse.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&depths)),
                entry(2, wgpu::BindingResource::TextureView(&normals)),
            ],
        });
        let [color, ..] = self.targets();
        let view = color.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[cleared(&view)],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, shadows.lookup_bind_group(), &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.read(encoder, &color)
    }

    /// A blue picture with an overlay drawn into it.
    pub(crate) fn overlay(&self, shadows: &Shadows, pipeline: &RenderPipeline) -> Vec<[u8; 4]> {
        let [color, ..] = self.targets();
        let view = color.create_view(&Default::default());
        let mut encoder = self.bench.encoder();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[cleared(&view)],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, shadows.lookup_bind_group(), &[]);
        pass.draw(0..4, 0..1);
        drop(pass);
        self.read(encoder, &color)
    }

    fn read(&self, mut encoder: wgpu::CommandEncoder, picture: &wgpu::Texture) -> Vec<[u8; 4]> {
        // Rows are multiples of 256 bytes.
        let buffer = self.bench.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIZE[0] * SIZE[1]),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * SIZE[0]),
            rows_per_image: None,
        };
        let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(picture.as_image_copy(), to, extent());
        self.bench.finish(encoder);
        self.bench.read(&buffer)
    }

    /// That a picture's red is the light on the ground, but for pixels at the shadow's edge.
    pub(crate) fn check(
        &self,
        picture: &[[u8; 4]],
        camera: &Camera,
        is_hidden: impl Fn(DVec3) -> bool,
    ) {
        let (mut wrong, mut hidden, mut all) = (0, 0, 0);
        for (pixel, p) in ground_pixels(camera) {
            // Meshes stand before some of the ground.
            let to_ground = p - camera.eye();
            let is_before =
                |&b: &Aabb| hit(b, camera.eye(), to_ground).is_some_and(|enters| enters < 1.0);
            if self.boxes.iter().any(is_before) {
                continue;
            }
            let lit = picture[(pixel.y as u32 * SIZE[0] + pixel.x as u32) as usize][0];
            let is_hidden = is_hidden(p);
            hidden += usize::from(is_hidden);
            wrong += usize::from((lit < 128) != is_hidden);
            all += 1;
        }
        assert!(hidden > 150 && all > 10_000, "{hidden} of {all} pixels are in shadow");
        assert!(wrong * 150 < all, "{wrong} of {all} pixels are wrong");
    }
}

pub(crate) const POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: 12,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3],
};

fn extent() -> wgpu::Extent3d {
    wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 }
}

fn cleared(view: &TextureView) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::BLUE),
            store: wgpu::StoreOp::Store,
        },
    })
}
