//! A day in a street, with the long shadows of its morning and evening.
//!
//!     cargo run --release --example sun_cycle
//!
//! `--help` lists the options.

mod common;
#[path = "common/fly.rs"]
mod fly;
#[path = "common/street.rs"]
mod street;

use bevy::prelude::*;
use common::{Arguments, Example, fail};
use std::f32::consts::PI;

/// When the sun stands 2° above the horizon.
const MORNING: f32 = 6.15;
const EVENING: f32 = 17.85;
/// How high the sun stands at noon.
const NOON_RAD: f32 = 60.0 * PI / 180.0;
const HOURS_PER_SECOND: f32 = 0.4;

/// The time of the day.
#[derive(Resource)]
struct Day {
    hour: f32,
    paused: bool,
}

fn main() -> AppExit {
    let mut arguments = Arguments::new();
    let hour = arguments.value("--hour").unwrap_or(7.0);
    if !(MORNING..=EVENING).contains(&hour) {
        fail(format!("--hour {hour}: the sun is up from {MORNING} to {EVENING}"));
    }
    let paused = arguments.flag("--paused");
    let example = Example {
        name: "sun_cycle",
        options: &[
            "\n  --hour H                start at this hour of the day; 7 if not told",
            "\n  --paused                start with the sun standing still",
        ],
        keys: &[fly::KEYS, "\n  ENTER      the sun moves or stands still"],
        shadows: &["default", "none", "uniform+z4", "adaptive+z4"],
    };
    example
        .app(arguments)
        .insert_resource(ClearColor(Color::srgb(0.62, 0.75, 0.90)))
        .insert_resource(GlobalAmbientLight { brightness: 500.0, ..default() })
        .insert_resource(Day { hour, paused })
        .add_systems(Startup, (street::street, light_and_camera))
        .add_systems(Update, (fly::fly, (pass_time, move_sun).chain()))
        .run()
}

fn light_and_camera(mut commands: Commands) {
    commands.spawn(DirectionalLight { shadow_maps_enabled: true, ..default() });
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(-1.0, 2.2, 17.0).looking_at(Vec3::new(0.4, 1.0, 0.0), Vec3::Y),
        fly::Fly,
    ));
}

fn pass_time(time: Res<Time>, keys: Res<ButtonInput<KeyCode>>, mut day: ResMut<Day>) {
    if keys.just_pressed(KeyCode::Enter) {
        day.paused = !day.paused;
    }
    if !day.paused {
        day.hour += HOURS_PER_SECOND * time.delta_secs();
        if day.hour > EVENING {
            day.hour = MORNING;
        }
    }
}

fn move_sun(day: Res<Day>, sun: Single<(&mut Transform, &mut DirectionalLight)>) {
    let turn = PI * (day.hour - 6.0) / 12.0;
    let height = turn.sin() * NOON_RAD.sin();
    // The sun rises and sets almost along the street, where no house keeps low light out.
    let towards_sun =
        Quat::from_rotation_y(1.6) * Vec3::new(turn.cos(), height, turn.sin() * NOON_RAD.cos());

    let (mut transform, mut light) = sun.into_inner();
    *transform = Transform::default().looking_to(-towards_sun, Vec3::Y);
    let warm = (1.0 - height).powi(4);
    light.color = Color::srgb(1.0, 1.0 - 0.35 * warm, 1.0 - 0.65 * warm);
    light.illuminance = 4_000.0 + 8_000.0 * height;
}
