//! A character who walks a street among moving casters, with the camera circling around.
//!
//! The camera's turning is what makes shadows shimmer where maps follow the view: their texels
//! change places from frame to frame, and edges crawl. Stable maps keep their texels in place.
//! P switches between the two; debug mode `grid` (D) shows the texels themselves.
//!
//!     cargo run --release --example third_person
//!
//! `--help` lists the options.

mod common;
#[path = "common/street.rs"]
mod street;

use bevy::prelude::*;
use common::{Arguments, Builder, Example};
use std::f32::consts::{PI, TAU};

/// Where the character walks when nobody steers.
const WAYPOINTS: [Vec3; 4] = [
    Vec3::new(-0.7, 0.0, 8.0),
    Vec3::new(0.7, 0.0, 6.0),
    Vec3::new(0.7, 0.0, -14.0),
    Vec3::new(-0.7, 0.0, -12.0),
];
const WALK_METRES_PER_SECOND: f32 = 1.5;
const TURN_RAD_PER_SECOND: f32 = 2.0;
const CAMERA_RAD_PER_SECOND: f32 = 0.2;

#[derive(Component, Default)]
struct Character {
    waypoint: usize,
    metres_walked: f32,
}

/// An arm or a leg, which swings against its neighbour.
#[derive(Component)]
struct Limb {
    swing_rad: f32,
}

/// A car, which drives up and down the street.
#[derive(Component)]
struct Car {
    x: f32,
    phase: f32,
}

#[derive(Component)]
struct Wheel;

fn main() -> AppExit {
    let example = Example {
        name: "third_person",
        options: &[],
        keys: &["\n  arrows     walk and turn; without them the character finds its own way"],
        shadows: &["default", "adaptive+z4", "none"],
    };
    example
        .app(Arguments::new())
        .insert_resource(ClearColor(Color::srgb(0.62, 0.75, 0.90)))
        .insert_resource(GlobalAmbientLight { brightness: 600.0, ..default() })
        .add_systems(Startup, (street::street, light_and_camera, character, casters))
        .add_systems(Update, ((walk, (swing, follow)).chain(), drive, spin))
        .run()
}

fn light_and_camera(mut commands: Commands) {
    commands.spawn((
        DirectionalLight { shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(0.5, 0.9, 0.35).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn(Camera3d::default());
}

fn character(mut builder: Builder) {
    let skin = builder.paint(0.75, 0.58, 0.48);
    let shirt = builder.paint(0.70, 0.25, 0.22);
    let trousers = builder.paint(0.24, 0.28, 0.42);

    let mut parts = vec![
        builder.block(&shirt, Vec3::Y * 0.85, Vec3::new(0.42, 0.55, 0.24)),
        builder.block(&skin, Vec3::Y * 1.44, Vec3::new(0.22, 0.26, 0.22)),
    ];
    for side in [-1.0, 1.0] {
        let arm = builder.block(&shirt, Vec3::Y * -0.6, Vec3::new(0.11, 0.6, 0.13));
        let leg = builder.block(&trousers, Vec3::Y * -0.85, Vec3::new(0.16, 0.85, 0.18));
        for (limb, joint, swing_rad) in [
            (arm, Vec3::new(side * 0.27, 1.38, 0.0), side * 0.5),
            (leg, Vec3::new(side * 0.11, 0.85, 0.0), side * -0.6),
        ] {
            let joint = (Transform::from_translation(joint), Visibility::default());
            parts.push(builder.commands.spawn((joint, Limb { swing_rad })).add_child(limb).id());
        }
    }
    builder
        .commands
        .spawn((
            Character::default(),
            Transform::from_translation(WAYPOINTS[0]),
            Visibility::default(),
        ))
        .add_children(&parts);
}

fn casters(mut builder: Builder) {
    let metal = builder.paint(0.25, 0.27, 0.30);
    let paints = [builder.paint(0.25, 0.40, 0.65), builder.paint(0.80, 0.70, 0.30)];
    for (paint, (x, phase)) in paints.iter().zip([(-3.0, 2.5), (3.0, 1.0)]) {
        let mut parts = vec![
            builder.block(paint, Vec3::Y * 0.3, Vec3::new(1.7, 0.6, 4.0)),
            builder.block(paint, Vec3::Y * 0.9, Vec3::new(1.5, 0.55, 2.0)),
        ];
        for [side, end] in [[-0.8, -1.3], [-0.8, 1.3], [0.8, -1.3], [0.8, 1.3]] {
            let hub = Vec3::new(side, 0.3, end);
            parts.push(builder.bar(&metal, hub - Vec3::X * 0.1, hub + Vec3::X * 0.1, 0.3));
        }
        let car = (Car { x, phase }, Transform::default(), Visibility::default());
        builder.commands.spawn(car).add_children(&parts);
    }

    // A wheel of thin spokes over the pavement, whose shadow sweeps over road and walls.
    let hub = Vec3::new(5.4, 3.4, -4.0);
    builder.bar(&metal, hub.with_y(0.0), hub, 0.06);
    let mut spokes = Vec::new();
    for spoke in 0..8 {
        let angle = TAU * spoke as f32 / 8.0;
        let rim = |angle: f32| Vec3::new(1.6 * angle.cos(), 1.6 * angle.sin(), 0.0);
        spokes.push(builder.bar(&metal, Vec3::ZERO, rim(angle), 0.03));
        spokes.push(builder.bar(&metal, rim(angle), rim(angle + TAU / 8.0), 0.02));
    }
    let wheel = (Wheel, Transform::from_translation(hub), Visibility::default());
    builder.commands.spawn(wheel).add_children(&spokes);
}

fn walk(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    character: Single<(&mut Transform, &mut Character)>,
) {
    let (mut transform, mut character) = character.into_inner();
    let axis = |plus, minus| keys.pressed(plus) as i8 as f32 - keys.pressed(minus) as i8 as f32;
    let mut pace = axis(KeyCode::ArrowUp, KeyCode::ArrowDown);
    let mut turn = axis(KeyCode::ArrowLeft, KeyCode::ArrowRight);
    if pace == 0.0 && turn == 0.0 {
        let way = WAYPOINTS[character.waypoint] - transform.translation;
        if way.length() < 1.0 {
            character.waypoint = (character.waypoint + 1) % WAYPOINTS.len();
        }
        // The character looks along -z. How far the waypoint lies to its left is the way to turn.
        let ahead = transform.forward().dot(way);
        turn = (-transform.right().dot(way)).atan2(ahead).clamp(-1.0, 1.0);
        pace = 1.0;
    }
    transform.rotate_y(turn * TURN_RAD_PER_SECOND * time.delta_secs());
    let metres = pace * WALK_METRES_PER_SECOND * time.delta_secs();
    let forward = transform.forward();
    transform.translation += forward * metres;
    character.metres_walked += metres;
}

fn swing(character: Single<&Character>, limbs: Query<(&mut Transform, &Limb)>) {
    // A step is 0.7 m long.
    let phase = (PI * character.metres_walked / 0.7).sin();
    for (mut transform, limb) in limbs {
        transform.rotation = Quat::from_rotation_x(limb.swing_rad * phase);
    }
}

fn follow(
    time: Res<Time>,
    character: Single<&Transform, With<Character>>,
    mut camera: Single<&mut Transform, (With<Camera3d>, Without<Character>)>,
) {
    let turn = Quat::from_rotation_y(CAMERA_RAD_PER_SECOND * time.elapsed_secs());
    camera.translation = character.translation + turn * Vec3::new(0.0, 2.4, 5.0);
    camera.look_at(character.translation + Vec3::Y * 1.1, Vec3::Y);
}

fn drive(time: Res<Time>, cars: Query<(&mut Transform, &Car)>) {
    for (mut transform, car) in cars {
        let angle = 0.35 * time.elapsed_secs() + car.phase;
        transform.translation = Vec3::new(car.x, 0.0, -6.0 + 14.0 * angle.cos());
    }
}

fn spin(time: Res<Time>, mut wheel: Single<&mut Transform, With<Wheel>>) {
    wheel.rotation = Quat::from_rotation_z(0.8 * time.elapsed_secs());
}
