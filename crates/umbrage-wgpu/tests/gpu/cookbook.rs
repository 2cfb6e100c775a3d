//! The cookbook's recipes, run in a scene with known shadows: boxes on a plain.
#![expect(unreachable_pub, reason = "recipes are written as a module of a user's own")]

#[path = "../../cookbook/custom_casters.rs"]
mod custom_casters;
#[path = "../../cookbook/deferred.rs"]
mod deferred;
#[path = "../../cookbook/filter_at_run_time.rs"]
mod filter_at_run_time;
#[path = "../../cookbook/filters_per_light.rs"]
mod filters_per_light;
#[path = "../../cookbook/fit_to_seen.rs"]
mod fit_to_seen;
#[path = "../../cookbook/huge_models.rs"]
mod huge_models;
pub(crate) mod kitchen;
#[path = "../../cookbook/pages.rs"]
mod pages;
#[path = "../../cookbook/resizing.rs"]
mod resizing;
#[path = "../../cookbook/shadow_distance.rs"]
mod shadow_distance;
#[path = "../../cookbook/show_a_map.rs"]
mod show_a_map;
#[path = "../../cookbook/smooth_normals.rs"]
mod smooth_normals;
#[path = "../../cookbook/two_cameras.rs"]
mod two_cameras;

use crate::device::Bench;
use bytemuck::cast_slice;
use filter_at_run_time::change_technique;
use fit_to_seen::SeenShadows;
use glam::{DAffine3, DVec2, DVec3, Mat4, Vec3, camera::rh};
use kitchen::{FORMAT, Kitchen, SIZE, box_at, camera, plain};
use two_cameras::ViewShadows;
use umbrage::{Aabb, Bounds, BoxTree, Camera, Light, PointLight, Technique};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, Frame, ShadowOptions, Shadows, Timestamps};
use wgpu::BufferUsages;

const SUN: Light = Light::Directional { direction: DVec3::new(0.5, -1.0, 0.25) };

fn technique(text: &str) -> Technique {
    text.parse().unwrap()
}

fn shadows(bench: &Bench, technique: &Technique) -> Shadows {
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    Shadows::new(&bench.device, bench.support, &options).unwrap()
}

/// A box that a joint lifts aside casts its shadow from the place to which the joint moves it, not
/// from the place of its mesh.
#[needs(gpu)]
#[test]
fn skinned_casters_cast_where_they_are_posed() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let technique = technique("adaptive:pcf2@1024");
    let mut shadows = shadows(bench, &technique);
    let moved = DVec3::new(2.5, 0.5, -1.0);
    let joints = [Mat4::IDENTITY, Mat4::from_translation(moved.as_vec3())];
    let (layout, group) = kitchen.uniform(cast_slice(&joints));
    let pipeline = custom_casters::skinned_casters(&bench.device, &shadows, &layout);
    // The plain has joint 0, and the box has joint 1.
    let vertices: Vec<(Vec3, u32)> = [(plain(), 0), (box_at(DVec3::ZERO), 1)]
        .into_iter()
        .flat_map(|(mesh, joint)| mesh.into_iter().map(move |position| (position, joint)))
        .collect();
    let bytes: Vec<u8> = vertices
        .iter()
        .flat_map(|(p, joint)| [cast_slice(&p.to_array()), &joint.to_le_bytes()].concat())
        .collect();
    let buffer = bench.buffer(&bytes, BufferUsages::VERTEX);
    let plan = kitchen.plan(&[SUN], &technique);
    let mut encoder = bench.encoder();
    let frame = Frame { plan: &plan, render_origin: DVec3::ZERO, casters: Casters::Moved };
    shadows.prepare(&bench.device, &bench.queue, &frame).unwrap().encode(
        &mut encoder,
        &Timestamps::default(),
        |map| {
            map.pass.set_pipeline(&pipeline);
            map.pass.set_bind_group(1, &group, &[]);
            map.pass.set_vertex_buffer(0, buffer.slice(..));
            map.pass.draw(0..vertices.len() as u32, 0..1);
        },
    );
    bench.finish(encoder);
    let picture = kitchen.forward(&shadows, &kitchen::shader("shadow_visibility"), &camera());
    kitchen.check(&picture, &camera(), |p| kitchen::box_hides(moved, p, -sun_direction()));
}

fn sun_direction() -> DVec3 {
    let Light::Directional { direction } = SUN else { unreachable!("the sun") };
    direction
}

#[needs(gpu)]
#[test]
fn deferred_shading_gives_the_same_shadows() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let technique = technique("adaptive+z2:pcf3@1024");
    let mut shadows = shadows(bench, &technique);
    kitchen.draw_maps(&mut shadows, &kitchen.plan(&[SUN], &technique));
    let layout = deferred::gbuffer_layout(&bench.device);
    let pipeline = deferred::deferred_shading(&bench.device, &shadows, &layout, FORMAT);
    let picture = kitchen.deferred(&shadows, &layout, &pipeline, &camera());
    kitchen.check(&picture, &camera(), |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
}

/// A dome of flat triangles with the smooth normals of a sphere. With these normals, the facets of
/// the dome shadow themselves. The triangles' own normals prevent this, and so does a lookup that
/// allows for the difference. Neither method lights the points that the box shadows.
#[needs(gpu)]
#[test]
fn smooth_normals_are_cured() {
    let kitchen = Kitchen::new(&[plain(), kitchen::dome(), box_at(DVec3::new(-3.0, 0.0, 1.0))]);
    let technique = technique("adaptive:pcf7@2048");
    let mut shadows = shadows(&kitchen.bench, &technique);
    kitchen.draw_maps(&mut shadows, &kitchen.plan(&[SUN], &technique));
    let dark = |expression: &str| {
        let shader = kitchen::dome_shader(smooth_normals::SMOOTH_LOOKUP, expression);
        let picture = kitchen.forward(&shadows, &shader, &camera());
        kitchen.check(&picture, &camera(), |p| {
            kitchen::box_hides(DVec3::new(-3.0, 0.0, 1.0), p, -sun_direction())
                || kitchen::dome_hides(p, -sun_direction())
        });
        kitchen::dark_on_dome(&picture, &camera(), -sun_direction())
    };
    let smooth = dark("shadow_visibility(0u, position, smooth_normal)");
    let own = dark("shadow_visibility(0u, position, shadow_normal(position))");
    let tolerant = dark("light_on_smooth_surface(0u, position, smooth_normal)");
    assert!(smooth > 0.01, "smooth normals darken {smooth} of the dome");
    assert!(own < 0.002 && tolerant < 0.002, "own {own}, tolerant {tolerant}");
}

/// Clusters cast the shadow of the box that they are of, also once it is drawn again.
#[needs(gpu)]
#[test]
fn huge_models_cast_in_levels_of_detail() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let technique = technique("adaptive:pcf2@1024");
    let mut shadows = shadows(bench, &technique);
    let place = DVec3::new(1.0, 0.0, -0.5);
    let model = |positions: Vec<Vec3>, place| huge_models::Model {
        triangles: (0..positions.len() as u32 / 3).map(|i| [0, 1, 2].map(|k| 3 * i + k)).collect(),
        positions,
        world_from_mesh: vec![DAffine3::from_translation(place)],
    };
    let models = [model(plain(), DVec3::ZERO), model(box_at(-place), place)];
    let vertices = models.iter().flat_map(|model| model.positions.iter().copied());
    let usage = BufferUsages::VERTEX | BufferUsages::STORAGE;
    let positions = bench.buffer(cast_slice(&vertices.collect::<Vec<_>>()), usage);
    let (device, support) = (&bench.device, &bench.support);
    let mut huge =
        huge_models::HugeModels::new(device, support, &mut shadows, &models, &positions).unwrap();
    let plan = kitchen.plan(&[SUN], &technique);
    for casters in [Casters::Unmoved, Casters::Moved] {
        let frame = Frame { plan: &plan, render_origin: DVec3::ZERO, casters };
        let mut encoder = bench.encoder();
        huge.draw(device, &bench.queue, &mut encoder, &mut shadows, &frame).unwrap();
        bench.finish(encoder);
        let picture = kitchen.forward(&shadows, &kitchen::shader("shadow_visibility"), &camera());
        kitchen
            .check(&picture, &camera(), |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
    }
}

/// Whole meshes cast into pages. One box stands, another walks, and the sun turns; what is shown is
/// the sun of a while ago, and no page is drawn again that nothing moved in.
#[needs(gpu)]
#[test]
fn pages_of_whole_meshes() {
    let walker = |frame: u32| DVec3::new(0.05 * f64::from(frame) - 2.5, 0.0, 2.0);
    let pillar = DVec3::new(0.5, 0.0, -1.0);
    let kitchen = Kitchen::new(&[plain(), box_at(pillar), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let (device, queue) = (&bench.device, &bench.queue);
    let corners = [plain(), box_at(pillar), box_at(DVec3::ZERO)].map(|mesh| mesh.len() as u32);
    let indices: Vec<u32> = (0..corners.iter().sum()).collect();
    let indices = bench.buffer(cast_slice(&indices), BufferUsages::INDEX);
    let model = |part: usize, at: DVec3, mesh: Vec<Vec3>| {
        let first: u32 = corners[..part].iter().sum();
        pages::Model {
            indices: first..first + corners[part],
            world_from_mesh: DAffine3::from_translation(at),
            bounds: Aabb::around(mesh.into_iter().map(|p| p.as_dvec3() + at)),
        }
    };
    let still = [model(0, DVec3::ZERO, plain()), model(1, DVec3::ZERO, box_at(pillar))];
    let technique = technique("paged:pcf2");
    let layout = kitchen::POSITIONS;
    let mut paged =
        pages::PagedShadows::new(device, bench.support, technique, layout, &still).unwrap();
    let shader = kitchen::shader("shadow_visibility");
    let pipeline = kitchen.pipeline(&paged.shadows, &shader);
    let projection = kitchen::clip_from_view().as_dmat4();
    let projection = umbrage_wgpu::DepthProjection::of_matrix(projection).unwrap();
    let direction =
        |frame: u32| glam::DQuat::from_rotation_y(2e-3 * f64::from(frame)) * sun_direction();
    let mut all = Vec::new();
    for frame in 0..70 {
        let sun = Light::Directional { direction: direction(frame) };
        // The walker stops at last, and so does the sun.
        let at = walker(frame.min(50));
        let moving = [model(2, at, box_at(DVec3::ZERO))];
        let (_, depths) = kitchen.shade_and_keep_depths(&paged.shadows, &pipeline, &camera());
        let mut encoder = bench.encoder();
        let seen = (&depths, projection);
        let scene = (&camera(), &[sun][..], &moving[..]);
        let buffers = (kitchen.vertices(), &indices);
        paged.draw((device, queue), &mut encoder, scene, seen, buffers).unwrap();
        bench.finish(encoder);
        let counts = paged.shadows.page_counts(device).unwrap();
        all.push(counts);
        if frame % 17 == 3 {
            // The sun begins to turn in frame 1, and its pages are renewed over 30 frames.
            let renewals = frame.saturating_sub(1) / 30;
            let shown = if renewals == 0 { 0 } else { 30 * (renewals - 1) + 1 };
            let picture = kitchen.shade(&paged.shadows, &pipeline, &camera());
            kitchen.check(&picture, &camera(), |p| {
                let towards = -direction(shown);
                kitchen::box_hides(pillar, p, towards) || kitchen::box_hides(at, p, towards)
            });
        }
    }
    // What is nowhere is refused.
    let mut nowhere = model(2, DVec3::ZERO, box_at(DVec3::ZERO));
    nowhere.world_from_mesh.translation.x = f64::NAN;
    let seen = kitchen.shade_and_keep_depths(&paged.shadows, &pipeline, &camera()).1;
    let refused = paged.draw(
        (device, queue),
        &mut bench.encoder(),
        (&camera(), &[SUN], &[nowhere]),
        (&seen, projection),
        (kitchen.vertices(), &indices),
    );
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("parts.meshes"), "{refused}");
    // Once the pool is as large as it must be, few pages are drawn in a frame.
    assert!(all[0].drawn == all[0].wanted, "{:?}", all[0]);
    assert!(all[10..].iter().all(|c| c.missing == 0 && c.drawn * 2 < c.wanted), "{all:?}");
    assert!(all[10..50].iter().all(|c| c.apart > 0), "{all:?}");
}

#[needs(gpu)]
#[test]
fn two_cameras_have_shadows_of_their_own() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let other = kitchen::camera_from(DVec3::new(-6.0, 3.0, 7.0));
    let technique = technique("adaptive:pcf2@1024");
    let bounds = kitchen.bounds();
    let views = [camera(), other].map(|camera| {
        let mut view = ViewShadows::new(&bench.device, bench.support, technique).unwrap();
        let mut encoder = bench.encoder();
        let casters = kitchen.casters(&view.shadows);
        view.draw((&bench.device, &bench.queue), &mut encoder, (&camera, &[SUN], &bounds), |map| {
            kitchen.draw(casters.pipeline(), map);
        })
        .unwrap();
        bench.finish(encoder);
        (camera, view)
    });
    // One pipeline looks up the maps of both views.
    let shader = kitchen::shader("shadow_visibility");
    let pipeline = kitchen.pipeline(&views[0].1.shadows, &shader);
    for (camera, view) in &views {
        let picture = kitchen.shade(&view.shadows, &pipeline, camera);
        kitchen.check(&picture, camera, |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
    }
}

/// A camera that goes around a box sees the right shadows in every frame. Its receivers are given
/// with much air above them, which costs no texels where the camera has stopped.
#[needs(gpu)]
#[test]
fn maps_follow_what_is_seen() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let (device, queue) = (&bench.device, &bench.queue);
    let technique = technique("uniform:pcf2@1.5px");
    let mut view = SeenShadows::new(device, bench.support, technique).unwrap();
    let shader = kitchen::shader("shadow_visibility");
    let pipeline = kitchen.pipeline(&view.shadows, &shader);
    let casters = kitchen.casters(&view.shadows);
    let around = kitchen.bounds().receivers.unwrap();
    let around = Aabb { max: around.max + DVec3::Y * 2.0, ..around };
    let receivers = BoxTree::new(&[around]).unwrap();
    let mut texels = Vec::new();
    for i in 0..6 {
        let turn = glam::DQuat::from_rotation_y(0.03 * f64::from(i.min(4)));
        let camera = kitchen::camera_from(turn * DVec3::new(2.0, 9.0, 3.0));
        let mut encoder = bench.encoder();
        view.draw((device, queue), &mut encoder, (&camera, &[SUN]), (&receivers, &[]), |map| {
            texels.push(map.redraw.shadow_map.resolution.iter().product::<u32>());
            kitchen.draw(casters.pipeline(), map);
        })
        .unwrap();
        bench.finish(encoder);
        let (picture, depths) = kitchen.shade_and_keep_depths(&view.shadows, &pipeline, &camera);
        let mut encoder = bench.encoder();
        let projection = kitchen::clip_from_view().as_dmat4();
        view.look((device, queue), &mut encoder, &depths, (&camera, projection)).unwrap();
        bench.finish(encoder);
        kitchen.check(&picture, &camera, |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
    }
    let [boxes, seen] = [texels[0], texels[5]];
    assert!(seen * 2 < boxes, "{texels:?}");
}

#[needs(gpu)]
#[test]
fn filters_change_at_run_time() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let device = &kitchen.bench.device;
    let shader = kitchen::shader("shadow_visibility");
    let first = technique("adaptive@1024");
    let mut shadows = shadows(&kitchen.bench, &first);
    let mut pipeline = kitchen.pipeline(&shadows, &shader);
    for (text, changes) in [
        ("adaptive+z2@1024", false),
        ("uniform:pcf5@1024", true),
        ("lispsm:vsm(blur=3)@1024", true),
    ] {
        let technique = technique(text);
        let make = |shadows: &Shadows| kitchen.pipeline(shadows, &shader);
        let made = change_technique(device, &mut shadows, &technique, make).unwrap();
        assert_eq!(made.is_some(), changes, "{text}");
        pipeline = made.unwrap_or(pipeline);
        kitchen.draw_maps(&mut shadows, &kitchen.plan(&[SUN], &technique));
        let picture = kitchen.shade(&shadows, &pipeline, &camera());
        kitchen
            .check(&picture, &camera(), |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
    }
}

/// Each slice has a tint of its own, and the overlay shows depths that are not all 1.
#[needs(gpu)]
#[test]
fn maps_are_shown() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let technique = technique("uniform+z3@512");
    let mut shadows = shadows(bench, &technique);
    let plan = kitchen.plan(&[SUN], &technique);
    kitchen.draw_maps(&mut shadows, &plan);
    let tinted = format!(
        "{}{}",
        include_str!("../../cookbook/show_a_map.wgsl"),
        kitchen::shader_of_color("vec4f(map_tint(0u, position), 1.0)")
    );
    let picture = kitchen.forward(&shadows, &tinted, &camera());
    let mut tints: Vec<Vec<[u8; 4]>> = vec![Vec::new(); plan.maps.len()];
    for (pixel, p) in kitchen::ground_pixels(&camera()) {
        let color = picture[(pixel.y as u32 * SIZE[0] + pixel.x as u32) as usize];
        if let Some((map, _)) = plan.lookup(0, p).next() {
            tints[map].push(color);
        }
    }
    let seen: Vec<_> = tints.iter().filter(|t| t.len() > 200).collect();
    assert!(seen.len() >= 2, "several slices are seen");
    let brightest = |tints: &&Vec<[u8; 4]>| *tints.iter().max().unwrap();
    let all: std::collections::BTreeSet<_> = seen.iter().map(brightest).collect();
    assert_eq!(all.len(), seen.len(), "{all:?}");
    let overlay = show_a_map::map_overlay(&bench.device, &shadows, FORMAT);
    let picture = kitchen.overlay(&shadows, &overlay);
    let shown = |&[r, g, b, _]: &[u8; 4]| r == g && g == b;
    let corner = |x: u32, y: u32| picture[(y * SIZE[0] + x) as usize];
    let in_corner: Vec<_> = (SIZE[1] / 2..SIZE[1])
        .flat_map(|y| (0..SIZE[0] / 2).map(move |x| (x, y)))
        .map(|(x, y)| corner(x, y))
        .collect();
    assert!(in_corner.iter().all(shown) && in_corner.iter().any(|c| c[0] < 200));
    assert_eq!(corner(SIZE[0] - 1, 0), [0, 0, 255, 255], "the rest of the picture is left alone");
}

#[needs(gpu)]
#[test]
fn lights_have_filters_of_their_own() {
    let kitchen = Kitchen::new(&[plain(), box_at(DVec3::ZERO)]);
    let bench = &kitchen.bench;
    let position = DVec3::new(-3.0, 4.0, 2.0);
    let lamp = Light::Point(PointLight { position, near: 0.1, range: 40.0 });
    let [sharp, soft] = ["adaptive@1024", "uniform:pcf5@1024"].map(technique);
    let mut sun_shadows = shadows(bench, &sharp);
    let mut lamp_shadows = shadows(bench, &soft);
    kitchen.draw_maps(&mut sun_shadows, &kitchen.plan(&[SUN], &sharp));
    kitchen.draw_maps(&mut lamp_shadows, &kitchen.plan(&[lamp], &soft));
    let text = filters_per_light::two_filters(&sun_shadows, &lamp_shadows).unwrap();
    let picture = kitchen.with_two(&text, [&sun_shadows, &lamp_shadows], &camera());
    let channel = |c: usize| picture.iter().map(|p| [p[c], 0, 0, 255]).collect::<Vec<_>>();
    kitchen.check(&channel(0), &camera(), |p| kitchen::box_hides(DVec3::ZERO, p, -sun_direction()));
    kitchen.check(&channel(1), &camera(), |p| kitchen::box_hides(DVec3::ZERO, p, position - p));
}

#[test]
fn shadows_fade_out_at_their_distance() {
    let [eye, target] = [DVec3::Y, DVec3::Y + DVec3::NEG_Z];
    let (fov_y_rad, near, far, image) = (1.0, 0.1, 1000.0, [640, 360]);
    let view = umbrage::LookAt { eye, target, up: DVec3::Y, fov_y_rad, near, far, image };
    let mut planner = umbrage::Planner::new();
    let given = (&[SUN][..], &Bounds::default());
    let technique = technique("uniform(stable)+z4");
    let plan =
        shadow_distance::shadows_up_to(&mut planner, (view, 80.0), given, &technique).unwrap();
    let served = |depth: f64| plan.lookup(0, eye + DVec3::NEG_Z * depth).next().is_some();
    let faded = |depth: f64| plan.faded(eye + DVec3::NEG_Z * depth, 0.0);
    assert!(served(79.9) && !served(80.1));
    assert_eq!([faded(71.9), faded(80.1)], [0.0, 1.0]);
    assert!((faded(76.0) - 0.5).abs() < 1e-9);
}

#[test]
fn a_resized_picture_has_its_own_errors() {
    let world_from_view = rh::view::look_at_mat4(Vec3::new(5.0, 4.0, 9.0), Vec3::ZERO, Vec3::Y);
    let world_from_view = world_from_view.as_dmat4().inverse();
    let projection = |aspect: f32| rh::proj::directx::perspective(0.9, aspect, 0.1, 60.0);
    let sized = |size| resizing::resized(world_from_view, projection, size);
    assert!(sized([0, 720]).is_none());
    let [small, large] = [[640, 360], [1280, 720]].map(|size| sized(size).unwrap().unwrap());
    let mut planner = umbrage::Planner::new();
    let technique = technique("adaptive@16px");
    let mut texels = |camera: &Camera| {
        planner.plan(camera, &[SUN], &Bounds::default(), &technique).unwrap().texels() as f64
    };
    // A picture with twice as many pixels in each direction needs twice as many texels in each
    // direction.
    let ratio = texels(&large) / texels(&small);
    assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
    assert_eq!(large.pixel(DVec3::ZERO).map(DVec2::round), Some(DVec2::new(640.0, 360.0)));
}
