//! The reduction of depth buffers to what is seen, held against the one on the CPU.

use crate::bench;
use crate::device::Bench;
use bytemuck::cast_slice;
use glam::{DVec2, DVec3};
use umbrage::{Camera, LookAt, Orthographic, SeenTiles};
use umbrage_testing::needs;
use umbrage_wgpu::{DepthProjection, Error, SeenReadback, Support};
use wgpu::{
    BufferUsages, CompareFunction, Extent3d, LoadOp, Operations, StoreOp, Texture, TextureAspect,
    TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

fn camera(eye: DVec3, image: [u32; 2]) -> Camera {
    Camera::look_at(LookAt {
        eye,
        target: eye + DVec3::new(0.3, -0.25, -1.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 40.0,
        image,
    })
    .unwrap()
}

/// The same view in orthographic projection.
fn orthographic(eye: DVec3, image: [u32; 2]) -> Camera {
    let target = eye + DVec3::new(0.3, -0.25, -1.0);
    let (up, height, near, far) = (DVec3::Y, 9.0, -2.0, 40.0);
    Camera::orthographic(Orthographic { eye, target, up, height, near, far, image }).unwrap()
}

/// Distance along the view direction to a floor with pillars; infinite in the sky.
fn distance(camera: &Camera, pixel: DVec2) -> f64 {
    let sight = camera.ray(pixel);
    let (eye, ray) = (camera.eye() + sight.start, sight.direction);
    let floor = if ray.y < 0.0 { -eye.y / ray.y } else { f64::INFINITY };
    let pillars = (0..12).map(|i| {
        let center = DVec3::new(f64::from(i % 4) * 3.0 - 4.0, 1.5, -f64::from(i / 4) * 4.0 - 1.0);
        let half = DVec3::new(0.3, 1.5, 0.3);
        let (a, b) = ((center - half - eye) / ray, (center + half - eye) / ray);
        let (start, end) = (a.min(b).max_element(), a.max(b).min_element());
        if start <= end { start } else { f64::INFINITY }
    });
    let is_seen = |depth: &f64| *depth >= camera.near();
    pillars.chain([floor]).filter(is_seen).fold(f64::INFINITY, f64::min)
}

fn depth_texture(
    bench: &Bench,
    [width, height]: [u32; 2],
    format: TextureFormat,
    samples: u32,
) -> Texture {
    bench.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

fn depth_view(texture: &Texture) -> TextureView {
    let aspect = TextureAspect::DepthOnly;
    texture.create_view(&TextureViewDescriptor { aspect, ..Default::default() })
}

/// Draws these depths, row by row, into all samples of a texture.
fn draw(bench: &Bench, texture: &Texture, depths: &[f32], encoder: &mut wgpu::CommandEncoder) {
    let device = &bench.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(
            "@group(0) @binding(0) var<storage, read> depths: array<f32>;
            @group(0) @binding(1) var<uniform> width: vec4u;
            @vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
                return vec4f(f32((i << 1u) & 2u) * 2.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, 0.5, 1.0);
            }
            @fragment fn fragment(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {
                return depths[u32(at.y) * width.x + u32(at.x)];
            }"
            .into(),
        ),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: texture.format(),
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: texture.sample_count(), ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    });
    let buffer = bench.buffer(cast_slice(depths), BufferUsages::STORAGE);
    let width = bench.buffer(cast_slice(&[texture.width(), 0, 0, 0]), BufferUsages::UNIFORM);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: width.as_entire_binding() },
        ],
    });
    let view = texture.create_view(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &[],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &view,
            depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
            stencil_ops: texture
                .format()
                .has_stencil_aspect()
                .then_some(Operations { load: LoadOp::Clear(0), store: StoreOp::Store }),
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
}

/// The depths that a depth buffer has of a camera's picture.
fn depths(camera: &Camera, projection: DepthProjection) -> Vec<f32> {
    let [width, height] = camera.image();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let distance = distance(camera, DVec2::new(f64::from(x), f64::from(y)) + 0.5);
            // Far planes clip what lies beyond.
            let nearness = if camera.is_orthographic() { -distance } else { distance.recip() };
            (projection.base + projection.per_nearness * nearness).clamp(0.0, 1.0) as f32
        })
        .collect()
}

/// Tiles of the GPU hold the same receivers as those of the CPU, and are hardly thicker.
#[needs(gpu)]
#[test]
fn tiles_are_those_of_the_cpu() {
    let bench = bench();
    let plain = TextureFormat::Depth32Float;
    for (format, samples, image, [near, far], is_reversed, is_orthographic) in [
        (plain, 1, [640, 360], [0.1, f64::INFINITY], true, false),
        (plain, 4, [640, 360], [0.1, f64::INFINITY], true, false),
        (plain, 1, [333, 97], [0.05, 200.0], false, false),
        (plain, 1, [20, 7], [0.05, 200.0], true, false),
        (TextureFormat::Depth24Plus, 1, [640, 360], [0.1, 100.0], false, false),
        (TextureFormat::Depth24PlusStencil8, 4, [640, 360], [0.1, 100.0], false, false),
        (TextureFormat::Depth16Unorm, 1, [640, 360], [0.5, 100.0], true, false),
        (plain, 1, [333, 97], [-2.0, 100.0], true, true),
        (TextureFormat::Depth24Plus, 1, [640, 360], [-2.0, 100.0], false, true),
    ] {
        let kind = if is_orthographic { "orthographic" } else { "perspective" };
        let case = format!("{format:?} {samples} {image:?} {near} {far} {is_reversed} {kind}");
        let eye = DVec3::new(-1.0, 1.8, 6.0);
        let (camera, projection) = if is_orthographic {
            let depths = DepthProjection::orthographic(near, far, is_reversed);
            (orthographic(eye, image), depths.unwrap())
        } else {
            let depths = DepthProjection::of_range(near, far, is_reversed);
            (camera(eye, image), depths.unwrap())
        };
        let texture = depth_texture(&bench, image, format, samples);
        let mut readback = SeenReadback::new(&bench.device, &bench.support).unwrap();
        assert!(readback.latest(&bench.device).is_none());
        let mut encoder = bench.encoder();
        draw(&bench, &texture, &depths(&camera, projection), &mut encoder);
        let (device, queue, view) = (&bench.device, &bench.queue, depth_view(&texture));
        readback.encode(device, queue, &mut encoder, &view, projection, &camera).unwrap();
        bench.finish(encoder);
        let seen = readback.latest(&bench.device).expect("tiles have come back");
        assert_eq!(seen.camera(), &camera);
        // The sky has the depth of the far plane, which is beyond all that counts.
        let receiver = |x: u32, y: u32| {
            distance(&camera, DVec2::new(f64::from(x), f64::from(y)) + 0.5).min(far)
        };
        let expected = SeenTiles::of_depths(&camera, receiver).unwrap();
        // The steps of the format, as nearness.
        let step = match format {
            TextureFormat::Depth16Unorm => 2f64.powi(-16),
            TextureFormat::Depth32Float => 2f64.powi(-23),
            _ => 2f64.powi(-24),
        } / projection.per_nearness.abs();
        for (index, (found, expected)) in seen.tiles().iter().zip(expected.tiles()).enumerate() {
            let (Some(found), Some(expected)) = (found, expected) else {
                assert_eq!(found.is_some(), expected.is_some(), "{case}: tile {index}");
                continue;
            };
            let thickness = |t: &umbrage::SeenTile| t.nearness[1] - t.nearness[0];
            let thicker = thickness(found) - 1.02 * thickness(expected);
            // Whether planes lean as surfaces do may depend on a coarse format's steps.
            let most = if format == TextureFormat::Depth16Unorm { 128.0 } else { 16.0 };
            assert!(thicker < most * step, "{case}: {index} {found:?} {expected:?}");
            assert!((found.jump - expected.jump).abs() < 8.0 * step, "{case}: {index}");
            assert_eq!(found.pixels, expected.pixels, "{case}: {index}");
            let [left, top, right, bottom] = SeenTiles::tile_pixels(image, index);
            let [x0, y0, x1, y1] = found.pixels;
            let middle = DVec2::new(x0 + x1, y0 + y1) / 2.0;
            for (x, y) in (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))) {
                let depth = receiver(x, y);
                let nearness = if is_orthographic { -depth } else { depth.recip() };
                let p = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                let above = nearness - found.slope.dot(p - middle);
                let is_seen = depth <= camera.far();
                let is_held = found.nearness[0] <= above && above <= found.nearness[1];
                assert!(!is_seen || is_held, "{case}: {index} {x} {y} {above} {found:?}");
            }
        }
    }
}

/// Frames come back in their order; frames that are never submitted do not come back, and do not
/// block those that are.
#[needs(gpu)]
#[test]
fn the_newest_frame_wins() {
    let bench = bench();
    let (device, queue) = (&bench.device, &bench.queue);
    let projection = DepthProjection::of_range(0.1, f64::INFINITY, true).unwrap();
    let texture = depth_texture(&bench, [64, 36], TextureFormat::Depth32Float, 1);
    let view = depth_view(&texture);
    let mut readback = SeenReadback::new(device, &bench.support).unwrap();
    let eye = |i: u32| DVec3::new(f64::from(i), 2.0, 5.0);
    for i in 0..20 {
        let camera = camera(eye(i), [64, 36]);
        let mut encoder = bench.encoder();
        draw(&bench, &texture, &depths(&camera, projection), &mut encoder);
        readback.encode(device, queue, &mut encoder, &view, projection, &camera).unwrap();
        if i % 3 == 2 {
            drop(encoder);
        } else {
            queue.submit([encoder.finish()]);
        }
        if i % 5 == 4 {
            device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            let newest = if i % 3 == 2 { i - 1 } else { i };
            let seen = readback.latest(device).expect("tiles have come back");
            // Where three frames were on their way, newer ones were left out.
            assert!((newest - 2..=newest).map(eye).any(|e| e == seen.camera().eye()), "{i}");
        }
    }
    let seen = readback.latest(device).unwrap();
    assert!(seen.tiles().iter().any(Option::is_some));
}

#[needs(gpu)]
#[test]
fn bad_depths_are_named() {
    let bench = bench();
    let (device, queue) = (&bench.device, &bench.queue);
    let projection = DepthProjection::of_range(0.1, 10.0, false).unwrap();
    let view = depth_view(&depth_texture(&bench, [64, 36], TextureFormat::Depth32Float, 1));
    let mut readback = SeenReadback::new(device, &bench.support).unwrap();
    let mut try_out = |projection, image| {
        let mut encoder = bench.encoder();
        readback.encode(device, queue, &mut encoder, &view, projection, &camera(DVec3::Y, image))
    };
    assert_eq!(try_out(projection, [64, 36]), Ok(()));
    let too_large = try_out(projection, [65, 36]).unwrap_err();
    assert!(too_large.to_string().contains("65x36"), "{too_large}");
    let orthographic = DepthProjection::orthographic(0.1, 10.0, false).unwrap();
    let wrong = [0.0, f64::NAN].map(|per_nearness| DepthProjection { per_nearness, ..projection });
    for projection in wrong.into_iter().chain([orthographic]) {
        let error = try_out(projection, [64, 36]);
        assert!(matches!(error, Err(Error::Invalid { field: "depth", .. })), "{error:?}");
    }
    for support in [
        Support { compute: false, ..bench.support },
        Support { depth_fetch: false, ..bench.support },
    ] {
        let error = SeenReadback::new(device, &support).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    }
}

/// What was seen before the device was lost stays, and nothing panics.
#[needs(gpu)]
#[test]
fn a_lost_device_is_harmless() {
    let bench = bench();
    let (device, queue) = (&bench.device, &bench.queue);
    let projection = DepthProjection::of_range(0.1, f64::INFINITY, true).unwrap();
    let camera = camera(DVec3::new(0.0, 2.0, 5.0), [64, 36]);
    let texture = depth_texture(&bench, [64, 36], TextureFormat::Depth32Float, 1);
    let view = depth_view(&texture);
    let mut readback = SeenReadback::new(device, &bench.support).unwrap();
    let mut encoder = bench.encoder();
    draw(&bench, &texture, &depths(&camera, projection), &mut encoder);
    readback.encode(device, queue, &mut encoder, &view, projection, &camera).unwrap();
    bench.finish(encoder);
    let seen = readback.latest(device).cloned();
    device.destroy();
    for _ in 0..5 {
        let mut encoder = bench.encoder();
        readback.encode(device, queue, &mut encoder, &view, projection, &camera).unwrap();
        queue.submit([encoder.finish()]);
        assert_eq!(readback.latest(device).cloned(), seen);
    }
    SeenReadback::new(device, &bench.support).unwrap();
}
