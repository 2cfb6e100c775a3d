//! A courtyard at night under the moon, spot lights that sweep it, and lamps that wander.
//!
//! The plugin betters the lookup of all of them; `UmbrageShadows` plans the moon's maps.
//!
//!     cargo run --release --example many_lights
//!
//! `--help` lists the options.

mod common;
#[path = "common/fly.rs"]
mod fly;

use bevy::prelude::*;
use common::{Arguments, Builder, Example};
use std::f32::consts::{PI, TAU};

/// A spot light on a mast, which sweeps to and fro around the way to the middle of the courtyard.
#[derive(Component)]
struct Sweep {
    phase: f32,
}

/// A lamp that goes round in a circle.
#[derive(Component)]
struct Wander {
    centre: Vec3,
    radius: f32,
    rad_per_second: f32,
}

fn main() -> AppExit {
    let example = Example {
        name: "many_lights",
        options: &[],
        keys: &[fly::KEYS],
        shadows: &["default", "adaptive+z4", "none"],
    };
    example
        .app(Arguments::new())
        .insert_resource(ClearColor(Color::srgb(0.02, 0.03, 0.06)))
        .insert_resource(GlobalAmbientLight { brightness: 60.0, ..default() })
        .add_systems(Startup, (courtyard, lights, camera))
        .add_systems(Update, (fly::fly, sweep, wander))
        .run()
}

fn courtyard(mut builder: Builder) {
    let floor = builder.paint(0.55, 0.55, 0.55);
    let stone = builder.paint(0.75, 0.72, 0.68);
    let wood = builder.paint(0.60, 0.45, 0.32);

    builder.block(&floor, Vec3::Y * -0.5, Vec3::new(40.0, 0.5, 40.0));
    for [x, z, width, depth] in
        [[0.0, -16.0, 32.5, 0.5], [-16.0, 0.0, 0.5, 32.0], [16.0, 0.0, 0.5, 32.0]]
    {
        builder.block(&stone, Vec3::new(x, 0.0, z), Vec3::new(width, 4.0, depth));
    }
    for row in 0..5 {
        for column in 0..5 {
            let foot = Vec3::new(5.0 * (column as f32 - 2.0), 0.0, 5.0 * (row as f32 - 2.0));
            if (row + column) % 2 == 0 {
                builder.bar(&stone, foot, foot + Vec3::Y * 3.0, 0.25);
                builder.block(&stone, foot, Vec3::new(0.8, 0.3, 0.8));
                builder.block(&stone, foot + Vec3::Y * 3.0, Vec3::new(0.7, 0.2, 0.7));
            } else {
                for step in 0..4 {
                    let size = 1.6 - 0.4 * step as f32;
                    let bottom = foot + Vec3::Y * 0.25 * step as f32;
                    builder.block(&wood, bottom, Vec3::new(size, 0.25, size));
                }
                builder.ball(&stone, foot + Vec3::Y * 1.25, 0.25);
            }
        }
    }
    for picket in 0..80 {
        let x = 0.25 * (picket as f32 - 39.5);
        for z in [-7.5, 7.5] {
            builder.block(&wood, Vec3::new(x, 0.0, z), Vec3::new(0.06, 1.0, 0.03));
        }
    }
}

fn lights(mut builder: Builder) {
    let metal = builder.paint(0.25, 0.27, 0.30);
    builder.commands.spawn((
        DirectionalLight {
            color: Color::srgb(0.7, 0.8, 1.0),
            illuminance: 600.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(-0.4, 0.6, 0.5).looking_at(Vec3::ZERO, Vec3::Y),
    ));

    let colours = [
        Color::srgb(1.0, 0.55, 0.45),
        Color::srgb(0.55, 1.0, 0.55),
        Color::srgb(0.50, 0.65, 1.0),
        Color::srgb(1.0, 0.85, 0.50),
    ];
    for (mast, colour) in colours.into_iter().enumerate() {
        let angle = TAU * (mast as f32 + 0.5) / 4.0;
        let foot = Vec3::new(16.0 * angle.cos(), 0.0, 16.0 * angle.sin());
        // The mast ends below the light, which would stand in its own way otherwise.
        builder.bar(&metal, foot, foot + Vec3::Y * 5.8, 0.08);
        builder.commands.spawn((
            SpotLight {
                color: colour,
                intensity: 8_000_000.0,
                range: 40.0,
                outer_angle: 0.35,
                inner_angle: 0.25,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::from_translation(foot + Vec3::Y * 6.0),
            Sweep { phase: PI * mast as f32 / 4.0 },
        ));
    }

    for [x, z, radius, rad_per_second] in
        [[-5.0, 0.0, 2.5, 0.5], [5.0, 5.0, 2.0, -0.7], [2.5, -7.0, 3.5, 0.4]]
    {
        builder.commands.spawn((
            PointLight {
                color: Color::srgb(1.0, 0.8, 0.6),
                intensity: 250_000.0,
                range: 15.0,
                shadow_maps_enabled: true,
                ..default()
            },
            Wander { centre: Vec3::new(x, 1.6, z), radius, rad_per_second },
        ));
    }
}

fn camera(mut commands: Commands) {
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(1.0, 4.5, 17.0).looking_at(Vec3::new(0.0, 0.5, 0.0), Vec3::Y),
        fly::Fly,
    ));
}

fn sweep(time: Res<Time>, lights: Query<(&mut Transform, &Sweep)>) {
    for (mut transform, sweep) in lights {
        let angle = 0.5 * (0.6 * time.elapsed_secs() + sweep.phase).sin();
        let to_middle = -transform.translation.with_y(0.0);
        let target = transform.translation.with_y(0.0) + Quat::from_rotation_y(angle) * to_middle;
        transform.look_at(target, Vec3::Y);
    }
}

fn wander(time: Res<Time>, lamps: Query<(&mut Transform, &Wander)>) {
    for (mut transform, lamp) in lamps {
        let angle = lamp.rad_per_second * time.elapsed_secs();
        let arm = Vec3::new(angle.cos(), 0.0, angle.sin());
        transform.translation = lamp.centre + lamp.radius * arm;
    }
}
