//! Frames and samples belong to the same picture, whatever the tiles.

use crate::{GPU, Set, scene};
use umbrage::{Partition, Technique};
use umbrage_render::{FrameTarget, Renderer, SceneBuffers, Shading, StageTimes, Timer};
use umbrage_scene::{Alpha, Scene};
use umbrage_testing::needs;
use umbrage_trace::shade;
use umbrage_wgpu::{Casters, ShadowOptions};

/// The sRGB colours of a frame.
pub(crate) fn read(target: &FrameTarget) -> Vec<[u8; 3]> {
    target.read(&GPU).unwrap().into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

/// The shader's tone mapping and the texture's encoding agree with those of the reference's
/// pictures.
#[needs(gpu)]
#[test]
fn a_frame_looks_as_its_samples_do() {
    let scene = scene("town:20");
    let set = Set::new(&scene, [301, 170]);
    let light = set.light();
    let plan = set.plan(&[light], &Technique::default());
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let mut timer = Timer::new(&GPU).expect("timestamps");
    let drawn = renderer.draw_maps(&plan, Casters::Unmoved, Some(&mut timer)).unwrap();
    assert!(drawn[0].1.triangles > 1000 && drawn[0].1.draws > 0, "{drawn:?}");
    let target = FrameTarget::new(&GPU, set.camera.image()).unwrap();
    renderer.frame(&shading, &target, Some(&mut timer)).unwrap();
    let StageTimes { depth_ms, filter_ms, picture_ms, .. } = timer.read(&GPU).unwrap();
    assert!(depth_ms > 0.0 && picture_ms > 0.0 && depth_ms + picture_ms < 60e3);
    assert_eq!(filter_ms, 0.0, "nothing is prefiltered");
    let samples = renderer.samples(&shading, 0..170, 1, false).unwrap();
    let radiance: Vec<_> = samples.iter().map(|s| s.radiance).collect();
    let far = |(a, b): &([u8; 3], [u8; 3])| (0..3).any(|i| a[i].abs_diff(b[i]) > 1);
    let pairs = read(&target).into_iter().zip(shade::pixels(&radiance, 1));
    assert_eq!(pairs.filter(far).count(), 0);
    assert!(samples.iter().all(|s| s.map.is_none() && s.error.is_nan()), "not asked for");
}

/// Meshes without holes are drawn without `discard`, and instances in another order than the
/// scene's. Neither shows.
#[needs(gpu)]
#[test]
fn order_and_pipelines_do_not_show() {
    let original = scene("airfield:6");
    let set = Set::new(&original, [320, 180]);
    let light = set.light();
    let plan = set.plan(&[light], &Technique::default());
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let picture = |scene: &Scene| {
        let buffers = SceneBuffers::new(&GPU, scene, false).unwrap();
        let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        let target = FrameTarget::new(&GPU, set.camera.image()).unwrap();
        let drawn = renderer.frame(&shading, &target, None).unwrap();
        (read(&target), drawn.triangles)
    };
    let expected = picture(&original);
    let [mut reversed, mut masked] = [original.clone(), original.clone()];
    reversed.instances.reverse();
    assert_eq!(picture(&reversed), expected);
    // Masks without holes.
    masked.materials.iter_mut().for_each(|m| m.alpha = Alpha::Mask { cutoff: 0.0 });
    assert_eq!(picture(&masked), expected);
    // The comparison sees holes.
    masked.materials.iter_mut().for_each(|m| m.alpha = Alpha::Mask { cutoff: 1.5 });
    assert_ne!(picture(&masked).0, expected.0);
}

/// Tiles, rows and grids only select samples.
#[needs(gpu)]
#[test]
fn samples_are_those_of_a_larger_picture() {
    let scene = scene("sphere");
    let light = Set::new(&scene, [8, 8]).light();
    let technique = Technique { partition: Partition::slices(2), ..Technique::default() };
    let coarse = Set::new(&scene, [700, 96]);
    let plan = coarse.plan(&[light], &technique);
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    let shading = Shading { camera: &coarse.camera, light: &light, light_index: 0 };
    // Two times 700 samples do not fit into one tile.
    let samples = renderer.samples(&shading, 40..70, 2, true).unwrap();
    assert_eq!(samples.len(), 700 * 30 * 4);
    let fine = Set::new(&scene, [1400, 192]);
    let shading = Shading { camera: &fine.camera, light: &light, light_index: 0 };
    let all = renderer.samples(&shading, 0..192, 1, true).unwrap();
    let mut differing = 0;
    for (i, sample) in samples.iter().enumerate() {
        let (pixel, within) = (i / 4, i % 4);
        let [x, y] = [pixel % 700 * 2 + within % 2, (pixel / 700 + 40) * 2 + within / 2];
        let other = all[y * 1400 + x];
        differing += usize::from(
            (sample.radiance - other.radiance).abs().max_element() > 2e-3
                || sample.map != other.map,
        );
    }
    assert!(differing * 500 < samples.len(), "{differing} of {}", samples.len());
}

/// Maps that do not change are not drawn again by the renderer.
#[needs(gpu)]
#[test]
fn still_maps_are_drawn_once() {
    let scene = scene("fence");
    let set = Set::new(&scene, [64, 36]);
    let light = set.light();
    let technique = Technique { partition: Partition::slices(3), ..Technique::default() };
    let plan = set.plan(&[light], &technique);
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let mut drawn = |casters| renderer.draw_maps(&plan, casters, None).unwrap().len();
    assert_eq!(
        [drawn(Casters::Unmoved), drawn(Casters::Unmoved), drawn(Casters::Moved)],
        [3, 0, 3]
    );
}
