//! Impossible requests give errors, and nothing panics.

use crate::{GPU, Set, scene};
use umbrage::{Size, Technique, Warp};
use umbrage_render::{Error, FrameTarget, Gpu, Renderer, SceneBuffers, Shading, Timer, devices};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, ShadowOptions};

#[needs(gpu)]
#[test]
fn devices_are_listed_the_best_first() {
    let devices = devices();
    let first = devices.first().expect("a device");
    assert_eq!(first.info.name, GPU.info().name);
    assert_eq!(first.support, Ok(GPU.support()));
}

#[needs(gpu)]
#[test]
fn a_lost_device_is_reported() {
    let gpu = Gpu::open().unwrap();
    let scene = scene("pole");
    let set = Set::new(&scene, [32, 18]);
    let light = set.light();
    let plan = set.plan(&[light], &Technique::default());
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let buffers = SceneBuffers::new(&gpu, &scene, false).unwrap();
    let mut renderer = Renderer::new(&gpu, &buffers, &ShadowOptions::default()).unwrap();
    let mut timer = Timer::new(&gpu).expect("timestamps");
    let target = FrameTarget::new(&gpu, [32, 18]).unwrap();
    renderer.draw_maps(&plan, Casters::Unmoved, Some(&mut timer)).unwrap();
    gpu.device().destroy();
    let lost = |e: Error| assert!(matches!(e, Error::Lost(_)), "{e}");
    lost(renderer.samples(&shading, 0..18, 1, true).unwrap_err());
    lost(renderer.visibility(0, &[[set.camera.eye(); 2]]).unwrap_err());
    renderer.draw_maps(&plan, Casters::Moved, Some(&mut timer)).map_or_else(lost, drop);
    renderer.frame(&shading, &target, Some(&mut timer)).map_or_else(lost, drop);
    lost(timer.try_read(&gpu).unwrap_err());
    lost(timer.read(&gpu).unwrap_err());
    lost(target.read(&gpu).unwrap_err());
}

#[needs(gpu)]
#[test]
fn what_is_too_large_is_named() {
    let scene = scene("pole");
    let set = Set::new(&scene, [32, 18]);
    let light = set.light();
    let max = GPU.device().limits().max_texture_dimension_2d;
    let error = FrameTarget::new(&GPU, [max + 1, 4]).err().unwrap();
    assert!(error.to_string().contains("is too large for this GPU"), "{error}");
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let technique = Technique { size: Size::Exact([max, 1]), ..Technique::default() };
    renderer.draw_maps(&set.plan(&[light], &technique), Casters::Unmoved, None).unwrap();
    let technique = Technique { size: Size::Exact([max + 1, 1]), ..technique };
    let plan = set.plan(&[light], &technique);
    let error = renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap_err();
    assert!(error.to_string().contains("no room for 1 shadow maps"), "{error}");
    let log = Technique { warp: Warp::Log, ..Technique::default() };
    let error = renderer.draw_maps(&set.plan(&[light], &log), Casters::Unmoved, None).unwrap_err();
    assert!(error.to_string().contains("no GPU rasterises"), "{error}");
}
