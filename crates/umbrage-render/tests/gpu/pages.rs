//! Plans with pages: the GPU against the reference, and pages that are kept against new ones.

use crate::parity::{agrees_with, agrees_with_lights, four_lights};
use crate::{GPU, Set, mesh_inputs, scene};
use glam::{DQuat, DVec3};
use umbrage::paged::AgingLights;
use umbrage::{Aabb, Bounds, Camera, Light, Plan, Planner, Technique};
use umbrage_clusters::{build_all, build_finest};
use umbrage_measure::PARTITIONS;
use umbrage_render::{EdgeOn, FrameTarget, Overlay, Renderer, SceneBuffers, Shading};
use umbrage_scene::{Lens, Scene};
use umbrage_testing::needs;
use umbrage_trace::View;
use umbrage_wgpu::{Casters, PageCounts, ShadowOptions, Support};

const IMAGE: [u32; 2] = [240, 135];

fn agrees(name: &str, techniques: &[&str]) {
    let scene = scene(name);
    let set = Set::new(&scene, IMAGE);
    for text in techniques {
        let technique: Technique = text.parse().unwrap();
        agrees_with(name, &set, &technique);
    }
}

#[needs(gpu)]
#[test]
fn built_in_scenes_have_the_pages_of_the_reference() {
    agrees("town", &["paged", "paged(error=0.5):pcf3"]);
    agrees("fence", &["paged(error=2)"]);
}

/// A sun, a cone, a wide cone and a bulb in one plan.
#[needs(gpu)]
#[test]
fn lamps_have_pages() {
    let scene = scene("lantern");
    let mut set = Set::new(&scene, IMAGE);
    let lights = four_lights(&set);
    let technique: Technique = "paged:pcf2".parse().unwrap();
    agrees_with_lights("lantern", &set, &lights, &technique);
    let mut view = scene.default_view();
    view.eye += (view.target - view.eye) * 0.5;
    view.lens = Lens::Orthographic { height: view.eye.distance(view.target) };
    view.near = -0.1 * view.eye.distance(view.target);
    set.camera = view.camera(IMAGE).unwrap();
    agrees_with_lights("lantern", &set, &lights, &technique);
}

/// Under a sun, a cone, a wide cone and the scene's own light or a second sun.
fn agrees_under_four_lights(names: &[&str]) {
    let technique: Technique = "paged".parse().unwrap();
    for name in names {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        agrees_with_lights(name, &set, &four_lights(&set), &technique);
    }
}

#[needs(gpu)]
#[test]
fn all_built_in_scenes_have_pages_under_four_lights() {
    agrees_under_four_lights(&[
        "town:4",
        "airfield:4",
        "statues:2",
        "colossus:1",
        "grove:12",
        "fence:2",
        "lamps:2",
        "contacts",
        "pole",
        "slit",
        "sphere",
    ]);
}

#[needs(gpu, scenes)]
#[test]
fn third_party_scenes_have_pages_under_several_lights() {
    // A lamp at the eye lights some thousand pixels of the first two, most of them edges, on which
    // rays and rasterisers do not agree under any technique.
    for name in ["lattice/fence_rows.glb", "trees/forest_eztree.glb"] {
        let scene = scene(name);
        let set = Set::new(&scene, IMAGE);
        for direction in [DVec3::new(0.4, -1.0, -0.3), DVec3::new(-0.8, -0.3, 0.5)] {
            let sun = Light::Directional { direction };
            agrees_with_lights(name, &set, &[sun], &"paged".parse().unwrap());
        }
    }
    agrees_under_four_lights(&["atrium/sponza_atrium_reduced.glb", "city/delft_city.glb"]);
}

#[needs(gpu)]
#[test]
fn penumbrae_have_pages() {
    agrees("town", &["paged:pcss", "paged(error=2):pcf3(blur=2px)"]);
}

/// Pages that share too few texels are coarser, on the GPU as in the plan.
#[needs(gpu)]
#[test]
fn a_full_pool_is_as_coarse_as_planned() {
    let scene = scene("town");
    let set = Set::new(&scene, IMAGE);
    let light = set.light();
    let technique: Technique = "paged(error=0.25)@640".parse().unwrap();
    let mut plan = set.plan(&[light], &technique);
    let view = View::new(&set.tracer, set.camera, light, 1).unwrap();
    let band = view.band(0..IMAGE[1], &|_| {});
    let seen = band.samples().iter().flatten().map(|s| s.surface.position);
    plan.fit_pages(&seen.collect::<Vec<_>>());
    let (drawn, counts) = Drawn::of(&set, &plan, &technique);
    let bias = plan.paging.as_ref().unwrap().bias;
    assert!(bias > 1.0 && (f64::from(counts.bias) - bias).abs() < 0.1, "{bias} {counts:?}");
    assert_eq!((counts.missing, counts.room), (0, 100));
    // Without the plan's help, the device finds out how coarse levels must be.
    plan.set_page_bias(0.0);
    let (alone, counts) = Drawn::of(&set, &plan, &technique);
    assert!(f64::from(counts.bias) > bias - 0.1 && counts.missing == 0, "{bias} {counts:?}");
    let differ = drawn.differ(&alone);
    assert!(differ * 20 < drawn.visibility.len(), "{differ} of {}", drawn.visibility.len());
}

/// The visibility in each pixel.
struct Drawn {
    visibility: Vec<f32>,
}

impl Drawn {
    fn of(set: &Set<'_>, plan: &Plan, technique: &Technique) -> (Self, PageCounts) {
        let buffers = buffers(set.scene);
        let mut renderer = Renderer::new(&GPU, &buffers, &options(technique)).unwrap();
        renderer.draw_maps(plan, Casters::Unmoved, None).unwrap();
        let drawn = Self::by(&mut renderer, &set.camera, &set.light());
        (drawn, renderer.page_counts().unwrap())
    }

    fn by(renderer: &mut Renderer<'_>, camera: &Camera, light: &Light) -> Self {
        let shading = Shading { camera, light, light_index: 0 };
        let samples = renderer.samples(&shading, 0..IMAGE[1], 1, false).unwrap();
        Self { visibility: samples.iter().map(|s| s.visibility).collect() }
    }

    fn differ(&self, other: &Self) -> usize {
        let pairs = self.visibility.iter().zip(&other.visibility);
        pairs.filter(|(a, b)| (*a - *b).abs() > 0.5).count()
    }
}

pub(crate) fn buffers(scene: &Scene) -> SceneBuffers {
    let buffers = SceneBuffers::new(&GPU, scene, false).unwrap();
    let finest = || build_finest(&mesh_inputs(scene));
    buffers.make_pages(&GPU, scene, finest).unwrap();
    buffers
}

fn options(technique: &Technique) -> ShadowOptions {
    ShadowOptions { filter: technique.filter, pages: true, ..ShadowOptions::default() }
}

/// Cameras that walk and turn, at 1.4 m/s and 60 frames a second.
fn walk(scene: &Scene, steps: u32) -> impl Iterator<Item = Camera> + use<> {
    let mut view = scene.default_view();
    (0..steps).map(move |_| {
        let way = (view.target - view.eye).normalize();
        let side = DVec3::Y.cross(way).normalize_or_zero();
        let step = way * (1.4 / 60.0);
        view.eye += step;
        view.target += step + side * 0.01;
        view.camera(IMAGE).unwrap()
    })
}

/// Pages that were kept show what new ones do, and few are drawn while the camera walks; none where
/// it stands still.
#[needs(gpu)]
#[test]
fn pages_are_kept() {
    for (name, text) in [("town", "paged"), ("grove:40", "paged:pcf3")] {
        let scene = scene(name);
        let mut set = Set::new(&scene, IMAGE);
        let light = set.light();
        let technique: Technique = text.parse().unwrap();
        let buffers = buffers(&scene);
        let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
        let mut shares = Vec::new();
        for camera in walk(&scene, 40) {
            set.camera = camera;
            let plan = set.plan(&[light], &technique);
            renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
            let counts = renderer.page_counts().unwrap();
            assert_eq!((counts.missing, counts.bias), (0, 0.0), "{name}");
            shares.push(f64::from(counts.drawn) / f64::from(counts.wanted));
        }
        let after_first = &shares[1..];
        let mean = after_first.iter().sum::<f64>() / after_first.len() as f64;
        assert!(shares[0] == 1.0 && mean < 0.1, "{name}: {shares:?}");
        let plan = set.plan(&[light], &technique);
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        assert_eq!(renderer.page_counts().unwrap().drawn, 0, "{name}");
        let kept = Drawn::by(&mut renderer, &set.camera, &light);
        let (fresh, _) = Drawn::of(&set, &plan, &technique);
        // Rounding relative to another eye, or in another place of the texture, may move an edge
        // over a texel's centre.
        let is_same = |drawn: &Drawn, when: &str| {
            let differ = drawn.differ(&fresh);
            assert!(differ * 2000 <= fresh.visibility.len(), "{name}, {when}: {differ} differ");
        };
        is_same(&kept, "kept");
        // Casters that moved dirty the pages that they cast into, and no others.
        let here = set.camera.eye() + set.camera.forward() * 3.0;
        let moved = [Aabb::new(here - 0.2, here + 0.2)];
        renderer.draw_maps(&plan, Casters::MovedIn(&moved), None).unwrap();
        let counts = renderer.page_counts().unwrap();
        assert!((1..counts.wanted / 2).contains(&counts.drawn), "{name}: {counts:?}");
        let again = Drawn::by(&mut renderer, &set.camera, &light);
        is_same(&again, "casters moved");
        renderer.draw_maps(&plan, Casters::Moved, None).unwrap();
        let counts = renderer.page_counts().unwrap();
        assert_eq!(counts.drawn, counts.wanted, "{name}");
        let all = Drawn::by(&mut renderer, &set.camera, &light);
        is_same(&all, "all drawn again");
    }
}

/// Pages serve on when the camera's range of distances, its field of view or its picture change,
/// though levels and windows are others.
#[needs(gpu)]
#[test]
fn pages_outlive_the_levels_of_a_plan() {
    let scene = scene("town:4");
    let mut set = Set::new(&scene, IMAGE);
    let light = set.light();
    let technique: Technique = "paged@1024".parse().unwrap();
    let buffers = buffers(&scene);
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    let mut view = scene.default_view();
    let first_level = |plan: &Plan| plan.paging.as_ref().unwrap().grids[0].first_level;
    let mut levels = Vec::new();
    for (near, far, fov) in [(1.0, 1.0, 1.0), (0.1, 1.0, 1.0), (9.0, 0.5, 1.0), (1.0, 2.0, 0.97)] {
        let default = scene.default_view();
        view.near = default.near * near;
        view.far = default.far * far;
        if let (Lens::Perspective { fov_y_rad }, Lens::Perspective { fov_y_rad: whole }) =
            (&mut view.lens, default.lens)
        {
            *fov_y_rad = whole * fov;
        }
        set.camera = view.camera(IMAGE).unwrap();
        let plan = set.plan(&[light], &technique);
        levels.push(first_level(&plan));
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        let counts = renderer.page_counts().unwrap();
        let is_first = levels.len() == 1;
        assert!(is_first || counts.drawn * 4 < counts.wanted, "{levels:?}: {counts:?}");
        let kept = Drawn::by(&mut renderer, &set.camera, &light);
        let (fresh, _) = Drawn::of(&set, &plan, &technique);
        let differ = kept.differ(&fresh);
        assert!(differ * 1000 <= fresh.visibility.len(), "{levels:?}: {differ} differ");
    }
    assert!(levels[1] < levels[0] && levels[2] > levels[0], "{levels:?}");
}

/// After a thousand frames, pages that were kept, given up and drawn again show what new ones do.
#[needs(gpu)]
#[test]
fn a_long_walk_keeps_pages_right() {
    let scene = scene("contacts");
    let mut set = Set::new(&scene, IMAGE);
    let light = set.light();
    // Fewer texels than the walk wants in all, so that places are given to other pages.
    let technique: Technique = "paged@704".parse().unwrap();
    let buffers = buffers(&scene);
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    let mut drawn = 0;
    for (frame, camera) in walk(&scene, 1000).enumerate() {
        set.camera = camera;
        let plan = set.plan(&[light], &technique);
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
        let counts = renderer.page_counts().unwrap();
        assert_eq!(counts.missing, 0, "{frame}");
        drawn += counts.drawn;
        if frame % 200 == 199 {
            let mut fresh_plan = plan.clone();
            fresh_plan.set_page_bias(f64::from(counts.bias));
            let kept = Drawn::by(&mut renderer, &set.camera, &light);
            let (fresh, _) = Drawn::of(&set, &fresh_plan, &technique);
            let differ = kept.differ(&fresh);
            assert!(differ * 1000 <= fresh.visibility.len(), "{frame}: {differ} differ");
        }
    }
    let room = renderer.page_counts().unwrap().room;
    assert!(drawn > 2 * room, "{drawn} pages drawn in {room} places");
}

/// The pages of a sun that turns are drawn over several frames, of which each draws a part, and what
/// is looked up is the sun of a while ago, whole. So it is while the camera walks and a caster moves.
#[needs(gpu)]
#[test]
fn a_turning_sun_has_its_pages_renewed_over_frames() {
    const FRAMES: u32 = 8;
    let scene = scene("town:4");
    let mut set = Set::new(&scene, IMAGE);
    let Light::Directional { direction } = set.light() else { panic!("a sun") };
    let technique: Technique = "paged".parse().unwrap();
    let buffers = buffers(&scene);
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    let mut aging = AgingLights::new(FRAMES);
    let mut planner = Planner::new();
    let mut shares = Vec::new();
    for (frame, camera) in walk(&scene, 4 * FRAMES).enumerate() {
        set.camera = camera;
        let turn = DQuat::from_rotation_y(1e-3 * frame as f64);
        let sun = Light::Directional { direction: turn * direction };
        aging.advance(&[sun]).unwrap();
        let bounds = Bounds::default();
        let plan = planner.plan_aging(&camera, &aging, &bounds, &technique).unwrap();
        let here = camera.eye() + camera.forward() * 3.0;
        let moved = [Aabb::new(here - 0.1, here + 0.1)];
        let moves = (FRAMES as usize..2 * FRAMES as usize).contains(&frame);
        let casters = if moves { Casters::MovedIn(&moved) } else { Casters::Unmoved };
        renderer.draw_maps(plan, casters, None).unwrap();
        let counts = renderer.page_counts().unwrap();
        assert_eq!((counts.missing, counts.bias), (0, 0.0), "{frame}");
        let is_last = (frame as u32).is_multiple_of(FRAMES);
        assert!(is_last == (counts.waiting == 0) || frame == 0, "{frame}: {counts:?}");
        shares.push(f64::from(counts.drawn) / f64::from(counts.wanted));
        let age = aging.age(0).unwrap();
        assert!(age.frames < 2 * FRAMES && (age.angle_rad > 0.0) == (frame > 0), "{age:?}");
        if frame as u32 % (FRAMES - 3) == 4 {
            let seen = Drawn::by(&mut renderer, &set.camera, &sun);
            let (fresh, _) =
                Drawn::of(&set, &set.plan(&aging.planned()[..1], &technique), &technique);
            let differ = seen.differ(&fresh);
            assert!(differ * 1000 <= fresh.visibility.len(), "{frame}: {differ} differ");
        }
    }
    // The pool grows in the first frames that want the pages of two suns.
    let most = shares[2..].iter().copied().fold(0.0, f64::max);
    assert!(most < 1.5 / f64::from(FRAMES), "{shares:?}");
}

/// Whole meshes cast into pages what clusters do, where these cannot be told which instances to leave
/// out. There are more meshes in pages than there is room for at first.
#[needs(gpu)]
#[test]
fn whole_meshes_are_drawn_in_place_of_clusters() {
    let scene = scene("town:4");
    let set = Set::new(&scene, IMAGE);
    let technique: Technique = "paged(error=0.25):pcf3".parse().unwrap();
    let plan = set.plan(&[set.light()], &technique);
    let clusters = build_all(&mesh_inputs(&scene), &|_| {}).unwrap();
    let buffers = SceneBuffers::with_clusters(&GPU, &scene, false, Some(&clusters)).unwrap();
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    renderer.draw_full_detail().unwrap();
    // A triangle of a light that the plan does not have.
    renderer.leave_out(vec![EdgeOn { light: 1, instance: 0, triangle: 0 }]);
    let drawn = renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    let instances = scene.instances.len() as u32;
    let triangles: usize =
        scene.instances.iter().map(|i| scene.meshes[i.mesh].triangles.len()).sum();
    assert!(drawn[0].1.draws < instances, "{drawn:?} of {instances} instances");
    assert!(drawn[0].1.triangles > 2 * triangles as u64, "{drawn:?} of {triangles} triangles");
    let whole = Drawn::by(&mut renderer, &set.camera, &set.light());
    let (expected, _) = Drawn::of(&set, &plan, &technique);
    let differ = whole.differ(&expected);
    assert!(differ * 1000 <= expected.visibility.len(), "{differ} differ");
}

/// The overlay shows levels and borders, and for a while which pages are new; the pool's picture has
/// a square for each page.
#[needs(gpu)]
#[test]
fn pages_are_shown() {
    let scene = scene("town:4");
    let set = Set::new(&scene, IMAGE);
    let light = set.light();
    let technique: Technique = "paged@1024".parse().unwrap();
    let plan = set.plan(&[light], &technique);
    let buffers = buffers(&scene);
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    let grid = &plan.paging.as_ref().unwrap().grids[0];
    let pool = FrameTarget::new(&GPU, [512; 2]).unwrap();
    assert!(renderer.show_pool(grid, &PARTITIONS, &pool).is_err(), "nothing was drawn");
    renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    let target = FrameTarget::new(&GPU, IMAGE).unwrap();
    let overlay = Overlay::Pages { colors: &PARTITIONS };
    let shown = |renderer: &mut Renderer<'_>| {
        renderer.frame_with(&overlay, &shading, &target, None).unwrap();
        renderer.show_pool(grid, &PARTITIONS, &pool).unwrap();
        [target.read(&GPU).unwrap(), pool.read(&GPU).unwrap()]
    };
    let lightness = |picture: &[[u8; 4]]| {
        picture.iter().flatten().map(|&v| u64::from(v)).sum::<u64>() / picture.len() as u64
    };
    let new = shown(&mut renderer);
    for _ in 0..30 {
        renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap();
    }
    let old = shown(&mut renderer);
    for (new, old) in new.iter().zip(&old) {
        assert!(lightness(new) > lightness(old) + 10, "new pages are lighter");
    }
    // As many squares as there are places are empty as pages are missing to that.
    let counts = renderer.page_counts().unwrap();
    let empty = [18, 26, 51, 255];
    let middle = |i: u32| (32 * (i / 16) + 16) * 512 + 32 * (i % 16) + 16;
    let free = (0..256).filter(|&i| old[1][middle(i) as usize] == empty).count();
    assert_eq!(free as u32, counts.room - counts.wanted);
    // Each surface has the tint of its level, whatever the shading.
    let band = View::new(&set.tracer, set.camera, light, 1).unwrap();
    let band = band.band(0..IMAGE[1], &|_| {});
    let mut wrong = 0;
    let mut told = 0;
    for (pixel, sample) in old[0].iter().zip(band.samples()) {
        let Some(sample) = sample else { continue };
        let Some(place) = plan.page_place(0, sample.surface.position) else { continue };
        let [r, g, b] = PARTITIONS[place.page.level.rem_euclid(7) as usize].map(f64::from);
        let [x, y, z] = [pixel[0], pixel[1], pixel[2]].map(f64::from);
        told += 1;
        // Black lines and shading scale all three.
        let off = (x * g - y * r).abs() + (y * b - z * g).abs();
        wrong += u32::from(off > 0.05 * (r + g + b) * (x + y + z).max(30.0));
    }
    assert!(told > 10_000 && wrong * 50 < told, "{wrong} of {told} tints");
}

#[needs(gpu)]
#[test]
fn pages_without_what_they_need_are_refused() {
    let scene = scene("pole");
    let set = Set::new(&scene, IMAGE);
    let technique: Technique = "paged".parse().unwrap();
    let plan = set.plan(&[set.light()], &technique);
    let bare = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let error = Renderer::new(&GPU, &bare, &options(&technique)).err().unwrap().to_string();
    assert!(error.contains("options.pages"), "{error}");
    let buffers = buffers(&scene);
    let mut renderer = Renderer::new(&GPU, &buffers, &ShadowOptions::default()).unwrap();
    let error = renderer.draw_maps(&plan, Casters::Unmoved, None).unwrap_err().to_string();
    assert!(error.contains("options.pages"), "{error}");
    let maps = set.plan(&[set.light()], &"lispsm@256".parse().unwrap());
    let mut renderer = Renderer::new(&GPU, &buffers, &options(&technique)).unwrap();
    let error = renderer.draw_maps(&maps, Casters::Unmoved, None).unwrap_err().to_string();
    assert!(error.contains("frame.plan"), "{error}");
    let support = Support { pages: false, ..GPU.support() };
    let error = Renderer::with_support(&GPU, &buffers, &options(&technique), support);
    assert!(error.err().unwrap().to_string().contains("uniform(stable)"));
}
