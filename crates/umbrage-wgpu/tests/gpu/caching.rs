//! Which maps are drawn again in a new frame, and which are not.

use crate::device::Bench;
use crate::{EYE, bench, camera, lights, plan, sun};
use glam::DVec3;
use umbrage::{
    Aabb, Light, Partition, Plan, Planner, PointLight, ShadowMap, Size, SpotLight, Technique, Warp,
};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, Frame, Layout, LookupBuffers, ShadowOptions, Shadows, Timestamps};

fn shadows(bench: &Bench, layout: Layout) -> Shadows {
    shadows_with(bench, layout, LookupBuffers::default())
}

fn shadows_with(bench: &Bench, layout: Layout, buffers: LookupBuffers) -> Shadows {
    let options = ShadowOptions { layout, buffers, ..ShadowOptions::default() };
    Shadows::new(&bench.device, bench.support, &options).unwrap()
}

fn technique() -> Technique {
    let size = Size::Budget(128 * 128);
    Technique { partition: Partition::slices(3), size, ..Technique::default() }
}

/// The indices of the maps that a frame draws.
fn drawn(bench: &Bench, shadows: &mut Shadows, plan: &Plan, casters: Casters<'_>) -> Vec<usize> {
    let frame = Frame { plan, render_origin: plan.origin, casters };
    let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
    let stale: Vec<usize> = prepared.stale().map(|r| r.index).collect();
    let mut encoder = bench.encoder();
    let mut drawn = Vec::new();
    let count =
        prepared.encode(&mut encoder, &Timestamps::default(), |map| drawn.push(map.redraw.index));
    assert_eq!((count, &stale), (drawn.len(), &drawn));
    bench.finish(encoder);
    drawn
}

#[needs(gpu)]
#[test]
fn what_stands_still_is_drawn_once() {
    let bench = bench();
    for layout in [Layout::Atlas, Layout::Layers] {
        let mut shadows = shadows(&bench, layout);
        let plan = plan(&camera(EYE), &[sun()], &technique());
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0, 1, 2]);
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0; 0]);
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Moved), [0, 1, 2]);
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0; 0]);
        let moved = self::plan(&camera(EYE + DVec3::X * 0.1), &[sun()], &technique());
        assert_eq!(drawn(&bench, &mut shadows, &moved, Casters::Unmoved), [0, 1, 2]);
    }
}

#[needs(gpu)]
#[test]
fn what_moves_is_drawn_into_the_maps_it_casts_into() {
    let bench = bench();
    for layout in [Layout::Atlas, Layout::Layers] {
        let mut shadows = shadows(&bench, layout);
        let plan = plan(&camera(EYE), &[sun()], &technique());
        drawn(&bench, &mut shadows, &plan, Casters::Unmoved);
        let around = |p: DVec3| Aabb::around([p - DVec3::splat(0.01), p + DVec3::splat(0.01)]);
        // The box at `far` lies in front of the ground of the last slice. The box `away` lies out
        // of the way of all maps.
        let far = EYE + camera(EYE).ray(glam::DVec2::new(320.0, 100.0)).at(30.0);
        let into: Vec<usize> = (0..3).filter(|&i| plan.maps[i].may_cast(around(far))).collect();
        assert!(!into.is_empty() && into.len() < 3, "{into:?}");
        let boxes = [around(far)];
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::MovedIn(&boxes)), into);
        let away = [around(DVec3::new(0.0, -500.0, 0.0))];
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::MovedIn(&away)), [0; 0]);
    }
}

#[needs(gpu)]
#[test]
fn a_frame_that_is_not_encoded_is_drawn_the_next_time() {
    let bench = bench();
    let mut shadows = shadows(&bench, Layout::Atlas);
    let plan = plan(&camera(EYE), &[sun()], &technique());
    let frame = Frame { plan: &plan, render_origin: plan.origin, casters: Casters::Moved };
    drop(shadows.prepare(&bench.device, &bench.queue, &frame).unwrap());
    assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0, 1, 2]);
}

/// Redrawing a part of one map of an atlas clears that part and keeps everything else.
#[needs(gpu)]
#[test]
fn a_map_that_is_redrawn_leaves_its_neighbours() {
    let bench = bench();
    let mut shadows = shadows(&bench, Layout::Atlas);
    let plan = plan(&camera(EYE), &[sun()], &technique());
    let own = bench.own_casters(
        &shadows,
        "@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
            let unused = shadow_caster(vec3f(0.0)).clip * 0.0;
            return vec4f(f32((i << 1u) & 2u) * 2.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, 0.25, 1.0) + unused;
        }
        @fragment fn fragment() {}",
        Some("fragment"),
    );
    let mut frame = |casters, draws: bool| {
        let frame = Frame { plan: &plan, render_origin: plan.origin, casters };
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        let mut encoder = bench.encoder();
        prepared.encode(&mut encoder, &Timestamps::default(), |map| {
            map.pass.set_pipeline(&own);
            if draws {
                map.pass.draw(0..3, 0..1);
            }
        });
        bench.finish(encoder);
        let (depths, width) = bench.depths(&shadows, 0);
        [0, 1, 2].map(|i| {
            let place = shadows.place(i).unwrap();
            let rows = place.origin[1]..place.origin[1] + place.size[1];
            let texels = rows.flat_map(|y| {
                let row = y as usize * width;
                let columns = place.origin[0]..place.origin[0] + place.size[0];
                columns.map(move |x| row + x as usize)
            });
            let values: Vec<f32> = texels.map(|t| depths[t]).collect();
            assert!(values.iter().all(|v| [0.25, 1.0].contains(v)), "map {i} has two depths");
            values.iter().filter(|&&v| v == 1.0).count()
        })
    };
    assert_eq!(frame(Casters::Unmoved, true), [0; 3]);
    let far = EYE + camera(EYE).ray(glam::DVec2::new(320.0, 100.0)).at(30.0);
    let boxes = [Aabb::around([far])];
    let cleared = frame(Casters::MovedIn(&boxes), false);
    for (map, cleared) in plan.maps.iter().zip(cleared) {
        // A point, with a texel for rounding to each side.
        assert_eq!((4..=9).contains(&cleared), map.may_cast(boxes[0]), "{cleared} texels");
        assert!(cleared <= 9);
    }
    assert!(cleared.contains(&0) && cleared != [0; 3], "{cleared:?}");
    assert_eq!(frame(Casters::Unmoved, false), cleared);
}

/// When the camera moves all the time, the sizes of the maps change all the time. Few new textures
/// must suffice, and the maps must be drawn anew in each.
#[needs(gpu)]
#[test]
fn a_camera_that_wanders_needs_few_textures() {
    let bench = bench();
    let mut shadows = shadows(&bench, Layout::Atlas);
    let mut planner = Planner::new();
    let mut textures: Vec<wgpu::Texture> = Vec::new();
    for i in 0..120 {
        let angle = f64::from(i) * 0.05;
        let eye = EYE + DVec3::new(angle.sin() * 6.0, 1.0 + angle.cos(), angle * 0.5);
        let bounds = umbrage::Bounds::of_scene(crate::scene());
        let technique = Technique { warp: Warp::Lispsm, ..technique() };
        let plan = planner.plan(&camera(eye), &lights()[..2], &bounds, &technique).unwrap();
        let frame = Frame { plan, render_origin: plan.origin, casters: Casters::Unmoved };
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        let mut encoder = bench.encoder();
        prepared.encode(&mut encoder, &Timestamps::default(), |_| {});
        bench.finish(encoder);
        for (i, map) in plan.maps.iter().enumerate() {
            assert_eq!(
                shadows.place(i).map(|p| p.size),
                (!map.is_empty()).then_some(map.resolution)
            );
        }
        if textures.last() != Some(shadows.depth_texture()) {
            textures.push(shadows.depth_texture().clone());
        }
    }
    assert!(textures.len() < 20, "{}", textures.len());
    assert!(shadows.texture_bytes() < 4 * 4 * 128 * 128 * 2, "{}", shadows.texture_bytes());
}

/// A camera that sees nothing gets no maps and no pass. When it sees something again, its maps are
/// drawn.
#[needs(gpu)]
#[test]
fn empty_maps_cost_nothing() {
    let bench = bench();
    let mut shadows = shadows(&bench, Layout::Atlas);
    let up = umbrage::Camera::look_at(umbrage::LookAt {
        eye: EYE + DVec3::Y * 20.0,
        target: EYE + DVec3::Y * 40.0,
        up: DVec3::X,
        fov_y_rad: 0.5,
        near: 0.1,
        far: 60.0,
        image: [64, 64],
    })
    .unwrap();
    let nothing = plan(&up, &[sun()], &technique());
    assert!(nothing.maps.iter().all(umbrage::ShadowMap::is_empty));
    assert_eq!(drawn(&bench, &mut shadows, &nothing, Casters::Moved), [0; 0]);
    assert_eq!(shadows.texture_bytes(), 4);
    let plan = plan(&camera(EYE), &[sun()], &technique());
    assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0, 1, 2]);
    assert_eq!(drawn(&bench, &mut shadows, &nothing, Casters::Unmoved), [0; 0]);
}

/// Of many lights, those that nothing seen is in have no texels and no pass, and those that do not
/// change are not drawn again.
#[needs(gpu)]
#[test]
fn of_many_lights_only_those_are_drawn_that_are_seen_and_change() {
    let bench = bench();
    let lamp = |i: u32| {
        let at =
            |k: u32| f64::from((i * 2 + k).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        // Half of them behind the camera, where none of what it sees is.
        let z = if i.is_multiple_of(2) { EYE.z + 12.0 } else { -18.0 * at(1) };
        DVec3::new(16.0 * at(0) - 8.0, 3.0, z)
    };
    let spot = |i: u32| {
        Light::Spot(SpotLight {
            position: lamp(i),
            direction: -DVec3::Y,
            half_angle_rad: 0.6,
            near: 0.1,
            range: 5.0,
        })
    };
    let point = |i: u32| Light::Point(PointLight { position: lamp(i), near: 0.1, range: 5.0 });
    let mut lights: Vec<Light> = (0..64).map(spot).chain((64..72).map(point)).collect();
    // Sizes that follow from an error do not depend on the other lights.
    let technique = Technique { size: Size::MaxError(8.0), ..Technique::default() };
    for layout in [Layout::Atlas, Layout::Layers] {
        let mut shadows = shadows_with(&bench, layout, LookupBuffers::Storage);
        let plan = self::plan(&camera(EYE), &lights, &technique);
        assert_eq!(plan.maps.len(), 64 + 8 * 6);
        let seen: Vec<usize> = (0..plan.maps.len()).filter(|&i| !plan.maps[i].is_empty()).collect();
        let hidden = plan
            .lights
            .iter()
            .filter(|l| plan.maps[l.maps.clone()].iter().all(ShadowMap::is_empty));
        assert!(hidden.count() >= 36 && seen.len() >= 20, "{} maps", seen.len());
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Moved), seen);
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [0; 0]);
        let changing = plan.lights.iter().position(|l| l.maps.start == seen[0]).unwrap();
        let Light::Spot(old) = lights[changing] else { panic!("spot lights come first") };
        let direction = DVec3::new(0.05, -1.0, 0.0);
        lights[changing] = Light::Spot(SpotLight { direction, ..old });
        let plan = self::plan(&camera(EYE), &lights, &technique);
        // A map that outgrows its slot can make all maps move.
        let redrawn = drawn(&bench, &mut shadows, &plan, Casters::Unmoved);
        assert!(redrawn == [seen[0]] || redrawn == seen, "{redrawn:?}");
        lights[changing] = Light::Spot(SpotLight { direction: DVec3::new(0.04, -1.0, 0.0), ..old });
        let plan = self::plan(&camera(EYE), &lights, &technique);
        assert_eq!(drawn(&bench, &mut shadows, &plan, Casters::Unmoved), [seen[0]], "{layout:?}");
    }
}
