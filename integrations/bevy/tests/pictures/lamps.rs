//! Shadows of spot and point lights, against rays.

use crate::boxes::{BLOCKS, FILTERS, add, errors, setup, truth};
use crate::harness::{Harness, Setup, Umbrage};
use bevy::light::PointLightShadowMap;
use bevy::prelude::*;
use umbrage_testing::needs;

const LAMP: Vec3 = Vec3::new(2.2, 3.2, 1.7);
const POWER: f32 = 3e4;

/// The errors under one lamp in place of the sun.
fn lamp_errors(
    setup: &Setup,
    lamp: impl Bundle,
    cone: Option<(Vec3, f32)>,
    turn_on: impl Fn(&mut World, bool),
) -> [f32; 2] {
    let mut harness = Harness::new(setup).expect("a device");
    add(&mut harness, &BLOCKS);
    let sun = harness.light();
    let world = harness.app().world_mut();
    world.despawn(sun);
    world.insert_resource(PointLightShadowMap { size: 512 });
    world.spawn(lamp);
    let mut picture = |on| {
        turn_on(harness.app().world_mut(), on);
        harness.settle().expect("pipelines");
        harness.brightness().expect("a picture")
    };
    let (shadowed, unshadowed) = (picture(true), picture(false));
    let visible: Vec<f32> =
        shadowed.iter().zip(&unshadowed).map(|(s, u)| (s / u.max(1e-6)).min(1.0)).collect();
    let lit = truth(setup.size, |point| {
        let towards = LAMP - point;
        let is_lit = cone.is_none_or(|(axis, angle)| {
            (-towards).angle_between(axis) < angle && towards.length() < 15.0
        });
        if is_lit { towards } else { Vec3::ZERO }
    });
    errors(&visible, &unshadowed, &lit)
}

fn spot(setup: &Setup, soft: bool) -> [f32; 2] {
    let axis = (Vec3::new(-0.3, 0.0, -1.5) - LAMP).normalize();
    let light = SpotLight {
        intensity: POWER,
        range: 30.0,
        outer_angle: 0.9,
        inner_angle: 0.85,
        radius: 0.1,
        soft_shadows_enabled: soft,
        ..default()
    };
    let place = Transform::from_translation(LAMP).looking_to(axis, Vec3::Y);
    lamp_errors(setup, (light, place), Some((axis, 0.8)), |world, on| {
        for mut light in world.query::<&mut SpotLight>().iter_mut(world) {
            light.shadow_maps_enabled = on;
        }
    })
}

fn point(setup: &Setup, soft: bool) -> [f32; 2] {
    let light = PointLight {
        intensity: POWER,
        range: 30.0,
        radius: 0.1,
        soft_shadows_enabled: soft,
        ..default()
    };
    lamp_errors(setup, (light, Transform::from_translation(LAMP)), None, |world, on| {
        for mut light in world.query::<&mut PointLight>().iter_mut(world) {
            light.shadow_maps_enabled = on;
        }
    })
}

#[needs(gpu)]
#[test]
fn lamps_are_better_than_bevys() {
    for filter in FILTERS {
        for soft in [false, true] {
            for (kind, lamp) in [("spot", spot as fn(&Setup, bool) -> _), ("point", point)] {
                let with = |umbrage| lamp(&Setup { filter, ..setup(umbrage) }, soft);
                let [bevy, ours] = [Umbrage::Off, Umbrage::Lookup].map(with);
                println!("{kind} {filter:?} soft {soft}: {ours:.4?}, Bevy {bevy:.4?}");
                assert!(ours[0] < bevy[0], "{kind} {filter:?} soft {soft}");
                assert!(ours[1] < bevy[1], "{kind} {filter:?} soft {soft}");
            }
        }
    }
}
