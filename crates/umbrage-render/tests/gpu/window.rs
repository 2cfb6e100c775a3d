//! What a window needs of the renderer.

use crate::{GPU, Set, scene};
use glam::DVec3;
use umbrage::Technique;
use umbrage_render::{Error, FrameTarget, Gpu, Renderer, SceneBuffers, Shading, Timer};
use umbrage_scene::closed_form::POLE_HEIGHT;
use umbrage_testing::needs;
use umbrage_trace::{DepthMap, Reference};
use umbrage_wgpu::{Casters, Layout, ShadowOptions};
use wgpu::{BufferUsages, Instance, InstanceDescriptor, MapMode, PollType};

/// A device that was opened elsewhere is as good as our own.
#[needs(gpu)]
#[test]
fn a_window_brings_its_device() {
    let instance = Instance::new(InstanceDescriptor::new_without_display_handle_from_env());
    let all = pollster::block_on(instance.enumerate_adapters(GPU.info().backend.into()));
    let choices = Gpu::choices(&all).unwrap();
    let adapter = choices.iter().find(|a| a.get_info() == *GPU.info()).expect("the same adapter");
    let request = adapter.request_device(&Gpu::wanted(adapter));
    let (device, queue) = pollster::block_on(request).unwrap();
    let gpu = Gpu::from_device(adapter, device, queue).unwrap();
    assert_eq!(gpu.support(), GPU.support());
    assert_eq!(gpu.lost(), None);
    gpu.device().destroy();
    gpu.wait().unwrap_err();
    assert!(gpu.lost().is_some());
}

/// Shaders that load from the view for windows get the sRGB values that are read back.
#[needs(gpu)]
#[test]
fn a_window_shows_the_bytes_of_the_frame() {
    let scene = scene("pole");
    let set = Set::new(&scene, [75, 40]);
    let light = set.light();
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let plan = set.plan(&[light], &Technique::default());
    renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    let target = FrameTarget::new(&GPU, [75, 40]).unwrap();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    renderer.frame(&shading, &target, None).unwrap();
    let read = target.read(&GPU).unwrap();
    assert_eq!(read.len(), 75 * 40);
    assert!(read.iter().all(|c| c[3] == 255), "opaque");
    assert_eq!(loaded(&target), read);
}

/// A window reads times without waiting, whenever a frame is done.
#[needs(gpu)]
#[test]
fn times_come_when_frames_are_done() {
    let scene = scene("pole");
    let set = Set::new(&scene, [75, 40]);
    let light = set.light();
    let technique: Technique = "uniform:vsm@64".parse().unwrap();
    let plan = set.plan(&[light], &technique);
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
    let target = FrameTarget::new(&GPU, [75, 40]).unwrap();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let mut timer = Timer::new(&GPU).expect("timestamps");
    assert_eq!(timer.try_read(&GPU).unwrap(), None, "no frame");
    // More frames than wait for their times.
    let mut done = 0;
    for _ in 0..10 {
        renderer.draw_maps(&plan, Casters::Moved, Some(&mut timer)).unwrap();
        renderer.frame(&shading, &target, Some(&mut timer)).unwrap();
        done += usize::from(timer.try_read(&GPU).unwrap().is_some());
    }
    GPU.wait().unwrap();
    let last = timer.try_read(&GPU).unwrap();
    assert!(done > 0 || last.is_some(), "some frame is done");
    renderer.draw_maps(&plan, Casters::Moved, Some(&mut timer)).unwrap();
    let maps = timer.read(&GPU).unwrap();
    assert!(maps.depth_ms > 0.0 && maps.filter_ms > 0.0, "{maps:?}");
    assert_eq!(maps.picture_ms, 0.0, "none was drawn since");
    renderer.draw_maps(&plan, Casters::Unmoved, Some(&mut timer)).unwrap();
    renderer.frame(&shading, &target, Some(&mut timer)).unwrap();
    let still = timer.read(&GPU).unwrap();
    assert_eq!([still.depth_ms, still.filter_ms], [0.0; 2], "the maps are as they were");
    assert!(still.picture_ms > 0.0);
}

/// The picture of a map shows the depths that rays find, with any filter and layout.
#[needs(gpu)]
#[test]
fn a_map_shows_its_casters() {
    let scene = scene("pole");
    let set = Set::new(&scene, [64, 36]);
    let light = set.light();
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut shown_poles = 0;
    for (text, layout) in [
        ("uniform@128", Layout::Atlas),
        ("uniform+z2@128", Layout::Layers),
        ("lispsm:vsm(blur=7)@128", Layout::Atlas),
    ] {
        let technique: Technique = text.parse().unwrap();
        let plan = set.plan(&[light], &technique);
        let filter = technique.filter;
        let options = ShadowOptions { filter, layout, ..ShadowOptions::default() };
        let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
        let small = FrameTarget::new(&GPU, [16, 16]).unwrap();
        let invalid = |e: Error| assert!(matches!(e, Error::Invalid { field: "map", .. }), "{e}");
        invalid(renderer.show_map(0, &small).unwrap_err());
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        invalid(renderer.show_map(plan.maps.len(), &small).unwrap_err());
        let reference = Reference::render(&set.tracer, &plan, &|_| {}).unwrap();
        for (index, map) in plan.maps.iter().enumerate() {
            let target = FrameTarget::new(&GPU, map.resolution).unwrap();
            renderer.show_map(index, &target).unwrap();
            let expected = expected_picture(&reference.depth_maps()[index], map.resolution);
            let pairs = target.read(&GPU).unwrap().into_iter().zip(&expected);
            let far = pairs.filter(|(a, b)| a[0].abs_diff(b[0]) > 3).count();
            assert!(far * 100 < expected.len(), "{text}: {far} of {} differ", expected.len());

            // In a smaller picture the nearest texel counts, so the pole stays bright.
            renderer.show_map(index, &small).unwrap();
            let picture = small.read(&GPU).unwrap();
            assert_eq!(picture.iter().map(|c| c[0]).max(), Some(247), "{text}");
            let top = map.project(DVec3::new(0.0, POLE_HEIGHT, 0.0)).unwrap();
            let at = |[width, height]: [u32; 2]| {
                let [x, y] = [top.x * f64::from(width), top.y * f64::from(height)];
                y as usize * width as usize + x as usize
            };
            if (0.0..1.0).contains(&top.x) && (0.0..1.0).contains(&top.y) {
                let [shown, least] = [picture[at([16; 2])][0], expected[at(map.resolution)][0]];
                assert!(shown + 3 >= least, "{text}: {shown} at the pole's top, not {least}");
                shown_poles += 1;
            }
        }
    }
    assert!(shown_poles >= 3, "{shown_poles}");
}

/// The colours of a map in which rays found these depths.
fn expected_picture(depths: &DepthMap, [width, height]: [u32; 2]) -> Vec<[u8; 3]> {
    let texels = (0..height as i32).flat_map(|j| (0..width as i32).map(move |i| (i, j)));
    let depths: Vec<f32> = texels.map(|(i, j)| depths.texel(i, j)).collect();
    let drawn = || depths.iter().copied().filter(|&d| d < 1.0);
    let [least, greatest] = [drawn().fold(1.0, f32::min), drawn().fold(0.0, f32::max)];
    let grey = |d: f32| 0.97 + (0.2 - 0.97) * (d - least) / (greatest - least);
    let color = |d: &f32| if *d < 1.0 { [grey(*d); 3] } else { [0.07, 0.1, 0.2] };
    depths.iter().map(|d| color(d).map(|v| (255.0 * v).round() as u8)).collect()
}

/// The texels of the view for windows, as a shader loads them.
fn loaded(target: &FrameTarget) -> Vec<[u8; 4]> {
    const SHADER: &str = "
        @group(0) @binding(0) var shown: texture_2d<f32>;
        @group(0) @binding(1) var<storage, read_write> texels: array<u32>;
        @compute @workgroup_size(1) fn load(@builtin(global_invocation_id) id: vec3u) {
            let at = id.y * textureDimensions(shown).x + id.x;
            texels[at] = pack4x8unorm(textureLoad(shown, id.xy, 0));
        }";
    let device = GPU.device();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let [width, height] = target.size();
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage,
            mapped_at_creation: false,
        })
    };
    let texels = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let readback = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
    let shown = wgpu::BindingResource::TextureView(target.shown_view());
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: shown },
            wgpu::BindGroupEntry { binding: 1, resource: texels.as_entire_binding() },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(width, height, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&texels, 0, &readback, 0, readback.size());
    GPU.queue().submit([encoder.finish()]);
    readback.map_async(MapMode::Read, .., |_| {});
    device.poll(PollType::wait_indefinitely()).unwrap();
    bytemuck::pod_collect_to_vec(&readback.get_mapped_range(..).unwrap())
}
