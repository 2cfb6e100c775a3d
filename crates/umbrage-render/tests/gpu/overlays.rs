//! Overlays are the pictures of reports, drawn by a GPU.

use crate::{GPU, Set, scene};
use glam::DVec3;
use umbrage::{Camera, LookAt, Partition, Size, Technique};
use umbrage_measure::{
    ErrorScale, FALSE_LIGHT, Image, LEVEL_COLORS, PARTITIONS, Rgb, cluster_map, error_map,
    partition_map, texel_map,
};
use umbrage_render::{Error, FrameTarget, Overlay, Renderer, SCALE_COLORS, SceneBuffers, Shading};
use umbrage_testing::needs;
use umbrage_trace::shade;
use umbrage_wgpu::{Casters, ShadowOptions};

const SIZE: [u32; 2] = [320, 180];

fn scale_colors(scale: ErrorScale) -> [Rgb; SCALE_COLORS] {
    let position = |i: usize| i as f32 / (SCALE_COLORS / 2) as f32 - 1.0;
    std::array::from_fn(|i| scale.color(scale.max().powf(position(i))).unwrap())
}

/// The share of pixels that differ by more than `most` of 255 in a channel.
fn differing(a: &[[u8; 4]], b: &Image<Rgb>, most: u8) -> f64 {
    let is_far = |(a, b): (&[u8; 4], &Rgb)| (0..3).any(|i| a[i].abs_diff(b[i]) > most);
    let count = a.iter().zip(b.pixels()).filter(|&pair| is_far(pair)).count();
    count as f64 / a.len() as f64
}

#[needs(gpu)]
#[test]
fn overlays_are_the_pictures_of_reports() {
    let scene = scene("town:20");
    let set = Set::new(&scene, SIZE);
    let light = set.light();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let target = FrameTarget::new(&GPU, SIZE).unwrap();
    let technique = Technique {
        partition: Partition::slices(3),
        size: Size::Budget(300 * 300),
        ..Technique::default()
    };
    let plan = set.plan(&[light], &technique);
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    let samples = renderer.samples(&shading, 0..SIZE[1], 1, true).unwrap();
    let radiance: Vec<_> = samples.iter().map(|s| s.radiance).collect();
    let picture = Image::new(SIZE, shade::pixels(&radiance, 1)).unwrap();
    let far = set.camera.far() as f32;
    let counted = samples.iter().map(|s| s.is_facing && s.depth <= far);
    let counted = Image::new(SIZE, counted.collect()).unwrap();
    let error = Image::new(SIZE, samples.iter().map(|s| s.error).collect()).unwrap();
    let map = samples.iter().map(|s| s.map.map(|m| m as u16));
    let map = Image::new(SIZE, map.collect()).unwrap();
    let texel = samples.iter().map(|s| s.texel.to_array());
    let texel = Image::new(SIZE, texel.collect()).unwrap();
    // Without levels of detail, all surfaces are of the finest.
    let clusters = renderer.seen_clusters(&shading, 0..SIZE[1]).unwrap();
    let clusters = clusters.iter().map(|seen| seen.map(|c| [c.number, c.level]));
    let clusters = Image::new(SIZE, clusters.collect()).unwrap();
    assert!(clusters.pixels().iter().all(|seen| matches!(seen, None | Some([0, 0]))));

    let mut drawn = |overlay: Overlay<'_>| {
        renderer.frame_with(&overlay, &shading, &target, None).unwrap();
        target.read(&GPU).unwrap()
    };
    let scale = ErrorScale::new(16.0).unwrap();
    let colors = scale_colors(scale);
    let errors = drawn(Overlay::Error { colors: &colors, max: 16.0 });
    let expected = error_map(&error, &counted, &picture, scale).unwrap();
    let share = differing(&errors, &expected, 3);
    assert!(share < 0.002, "{share} of the errors differ");
    let maps = drawn(Overlay::Partition { colors: &PARTITIONS });
    let expected = partition_map(&map, &picture).unwrap();
    let share = differing(&maps, &expected, 3);
    assert!(share < 0.002, "{share} of the maps differ");
    let levels = drawn(Overlay::Clusters { colors: &LEVEL_COLORS });
    let expected = cluster_map(&clusters, &picture).unwrap();
    let share = differing(&levels, &expected, 3);
    assert!(share < 0.002, "{share} of the clusters differ");
    // The report's lines are as wide as neighbouring pixels tell, which differs at edges.
    let grid = drawn(Overlay::Grid { color: FALSE_LIGHT });
    let expected = texel_map(&texel, &picture).unwrap();
    let share = differing(&grid, &expected, 40);
    assert!(share < 0.1, "{share} of the lines differ");
}

/// What a turned camera sees lies beside the maps, although it may be no farther away than the
/// slice ends.
#[needs(gpu)]
#[test]
fn what_no_map_holds_is_hatched() {
    let scene = scene("pole");
    let set = Set::new(&scene, SIZE);
    let light = set.light();
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let target = FrameTarget::new(&GPU, SIZE).unwrap();
    let plan = set.plan(&[light], &Technique::default());
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let colors = scale_colors(ErrorScale::default());
    let forward = set.camera.forward() * DVec3::new(1.0, 0.0, 1.0) + DVec3::NEG_Y;
    let [ahead, behind] = [1.0, -1.0].map(|side| {
        let eye = set.camera.eye() + DVec3::Y;
        let camera = Camera::look_at(LookAt {
            eye,
            target: eye + forward * DVec3::new(side, 1.0, side),
            up: DVec3::Y,
            fov_y_rad: 0.5,
            near: set.camera.near(),
            far: set.camera.far(),
            image: SIZE,
        })
        .unwrap();
        let shading = Shading { camera: &camera, light: &light, light_index: 0 };
        renderer.draw_maps_seen_from(eye, &plan, Casters::Unmoved, None).unwrap();
        let overlay = Overlay::Error { colors: &colors, max: 32.0 };
        renderer.frame_with(&overlay, &shading, &target, None).unwrap();
        let pixels = target.read(&GPU).unwrap();
        pixels.iter().filter(|c| is_hatch(c)).count() as f64 / pixels.len() as f64
    });
    assert!(ahead < 0.5 && behind > 0.9, "{ahead} ahead and {behind} behind are hatched");
}

fn is_hatch(c: &[u8; 4]) -> bool {
    *c == [90, 90, 90, 255] || *c == [160, 160, 160, 255]
}

#[needs(gpu)]
#[test]
fn without_maps_errors_are_hatched() {
    let scene = scene("pole");
    let set = Set::new(&scene, SIZE);
    let light = set.light();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let target = FrameTarget::new(&GPU, SIZE).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let colors = scale_colors(ErrorScale::default());
    let mut draw = |max| {
        let overlay = Overlay::Error { colors: &colors, max };
        renderer.frame_with(&overlay, &shading, &target, None)
    };
    draw(32.0).unwrap();
    let hatched = target.read(&GPU).unwrap().iter().filter(|c| is_hatch(c)).count();
    assert!(hatched > 1000, "{hatched}");
    for max in [1.0, -3.0, f32::NAN, f32::INFINITY] {
        let error = draw(max).unwrap_err();
        assert!(matches!(error, Error::Invalid { field: "overlay.max", .. }), "{error}");
    }
}
