//! A street before and after: SPACE switches between Bevy's own shadows and Umbrage's.
//!
//!     cargo run --release --example simple
//!
//! `--help` lists the options.

mod common;
#[path = "common/fly.rs"]
mod fly;
#[path = "common/street.rs"]
mod street;

use bevy::prelude::*;
use common::{Arguments, Example};

fn main() -> AppExit {
    let example = Example {
        name: "simple",
        options: &[],
        keys: &[fly::KEYS],
        shadows: &["default", "adaptive+z4", "none"],
    };
    example
        .app(Arguments::new())
        .insert_resource(ClearColor(Color::srgb(0.62, 0.75, 0.90)))
        .insert_resource(GlobalAmbientLight { brightness: 600.0, ..default() })
        .add_systems(Startup, (street::street, light_and_camera))
        .add_systems(Update, fly::fly)
        .run()
}

fn light_and_camera(mut commands: Commands) {
    commands.spawn((
        DirectionalLight { shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(0.7, 0.55, 0.45).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(-3.6, 1.9, 7.5).looking_at(Vec3::new(-6.6, 0.6, -2.0), Vec3::Y),
        fly::Fly,
    ));
}
