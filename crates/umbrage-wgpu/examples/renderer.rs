//! The smallest complete renderer with Umbrage's shadows. It draws boxes on a plain, without a
//! window.
//!
//! ```sh
//! cargo run --release -p umbrage-wgpu --example renderer -- shadows.png
//! ```
//!
//! The steps that concern shadows are numbered. All other code is what any wgpu renderer has.

mod headless;

use bytemuck::{bytes_of, cast_slice};
use glam::{DAffine3, DVec3, Vec3, camera::rh};
use std::error::Error;
use umbrage::{Aabb, Bounds, BoxTree, Camera, ClipDepth, Light, Planner, Technique};
use umbrage_wgpu::{
    CasterInstance, Casters, Frame, MeshCasters, MeshKind, ShadowOptions, Shadows, Support,
    Timestamps,
};
use wgpu::BufferUsages;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

const SIZE: [u32; 2] = [1280, 720];

#[rustfmt::skip]
const CUBE: [u16; 36] = [
    0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5,
];

/// The matrices that place and scale a cube as the plain and as the boxes on it.
fn models() -> impl Iterator<Item = DAffine3> {
    let place = |at: [f64; 3], size: [f64; 3]| {
        DAffine3::from_translation(at.into()) * DAffine3::from_scale(size.into())
    };
    let boxes = (0..400).map(move |i| {
        let [x, z] = [f64::from(i % 20) * 9.0 - 90.0, f64::from(i / 20) * 9.0 - 150.0];
        place([x, 0.0, z], [2.0, 1.0 + f64::from(i * 7 % 5) * 1.5, 2.0])
            * DAffine3::from_rotation_y(f64::from(i))
    });
    [place([0.0, -1.0, 0.0], [400.0, 1.0, 400.0])].into_iter().chain(boxes)
}

fn main() -> Result<(), Box<dyn Error>> {
    // 1. Request those features that make shadows faster, if the adapter has them.
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: adapter.features() & Support::WANTED_FEATURES,
        ..Default::default()
    }))?;
    let support = Support::new(&adapter, &device)?;

    let corners: [Vec3; 8] = std::array::from_fn(|i| {
        Vec3::new((i & 1) as f32 - 0.5, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32 - 0.5)
    });
    let buffer = |contents: &[u8], usage| {
        device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    };
    let vertices = buffer(cast_slice(&corners), BufferUsages::VERTEX);
    let indices = buffer(cast_slice(&CUBE), BufferUsages::INDEX);
    let instances: Vec<_> = models().map(|m| CasterInstance::new(&m, DVec3::ZERO)).collect();
    let instances = buffer(cast_slice(&instances), BufferUsages::VERTEX);
    let draw = |pass: &mut wgpu::RenderPass<'_>, instance: u32| {
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_vertex_buffer(1, instances.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint16);
        pass.draw_indexed(0..36, 0, instance..instance + 1);
    };

    // 2. In each frame, plan the maps with a planner that you keep from frame to frame. A plan
    //    follows from your camera's matrices, the lights, boxes around all models, and a technique.
    let eye = Vec3::new(4.0, 5.0, 30.0);
    let view_from_world = rh::view::look_at_mat4(eye, Vec3::new(-6.0, 1.0, 0.0), Vec3::Y);
    let clip_from_view = rh::proj::directx::perspective(0.9, 16.0 / 9.0, 0.1, 300.0);
    let camera = Camera::from_matrices(
        view_from_world.as_dmat4().inverse(),
        clip_from_view.as_dmat4(),
        ClipDepth::ZeroToOne,
        None,
        SIZE,
    )?;
    let direction = DVec3::new(-0.7, -0.6, -0.3);
    let around =
        |m: DAffine3| Aabb::around(corners.map(|corner| m.transform_point3(corner.as_dvec3())));
    let boxes: Vec<Aabb> = models().map(around).collect();
    let receivers = BoxTree::new(&boxes)?;
    let bounds = Bounds { receiver_parts: Some(&receivers), ..Bounds::default() };
    let technique: Technique = "adaptive+z2:pcf3".parse()?;
    let mut planner = Planner::with_limits(support.limits());
    let plan = planner.plan(&camera, &[Light::Directional { direction }], &bounds, &technique)?;

    // 3. Create the shadows once, with the technique's filter, and a pipeline that draws casters.
    //    For a pipeline of your own, use `Shadows::caster_wgsl`, `caster_fragment`,
    //    `depth_stencil_state` and `primitive_state`.
    let shadow_options = ShadowOptions { filter: technique.filter, ..Default::default() };
    let mut shadows = Shadows::new(&device, support, &shadow_options)?;
    let positions = wgpu::VertexBufferLayout {
        array_stride: 12,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3],
    };
    let layouts = [Some(positions), Some(CasterInstance::LAYOUT)];
    let casters = MeshCasters::new(&device, &shadows, MeshKind::Opaque, &layouts);

    // 4. Create your pipeline. Umbrage's text, for the bind group whose index you give, stands
    //    before your shader's text, and the pipeline layout has Umbrage's layout at that index.
    let text = shadows.lookup_wgsl(1) + include_str!("shader.wgsl");
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let to_sun = -direction.normalize().as_vec3().extend(0.0);
    let view = [bytes_of(&(clip_from_view * view_from_world)), bytes_of(&to_sun)].concat();
    let (view_layout, view_group) = headless::uniform(&device, &view);
    let pipeline = headless::pipeline(
        &device,
        &module,
        &[Some(&view_layout), Some(shadows.lookup_layout())],
        &layouts,
    );

    // 5. In each frame, prepare the shadows and draw casters into the maps that need it. The
    //    shaders here work in world space, so the render origin is zero. A renderer that works
    //    relative to the camera would give the eye.
    let mut encoder = device.create_command_encoder(&Default::default());
    let frame = Frame { plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
    shadows.prepare(&device, &queue, &frame)?.encode(&mut encoder, &Timestamps::default(), |map| {
        map.pass.set_pipeline(casters.pipeline());
        for (i, aabb) in (0..).zip(&boxes) {
            if map.may_cast(*aabb) {
                draw(map.pass, i);
            }
        }
    });

    // 6. Shade, with Umbrage's bind group at the index that you gave in step 4.
    let target = headless::Target::new(&device, SIZE);
    let mut pass = target.begin(&mut encoder);
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &view_group, &[]);
    pass.set_bind_group(1, shadows.lookup_bind_group(), &[]);
    (0..boxes.len() as u32).for_each(|i| draw(&mut pass, i));
    drop(pass);

    let path = std::env::args().nth(1).unwrap_or_else(|| "shadows.png".to_owned());
    target.finish(&device, &queue, encoder, &path)?;
    println!("{path}: {} maps, {} texels", plan.maps.len(), plan.texels());
    Ok(())
}
