//! A camera that flies: arrow keys and dragging with the mouse.

use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::prelude::*;
use std::f32::consts::FRAC_PI_2;

pub(crate) const KEYS: &str = "
  arrows     fly; page up and down: rise and sink; shift: faster
  mouse      drag to look around";

/// Marks the camera that flies.
#[derive(Component)]
pub(crate) struct Fly;

pub(crate) fn fly(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    mut camera: Single<&mut Transform, With<Fly>>,
) {
    if buttons.any_pressed([MouseButton::Left, MouseButton::Right]) && motion.delta != Vec2::ZERO {
        let (yaw, pitch, _) = camera.rotation.to_euler(EulerRot::YXZ);
        let yaw = yaw - motion.delta.x * 0.003;
        let pitch = (pitch - motion.delta.y * 0.003).clamp(-FRAC_PI_2, FRAC_PI_2);
        camera.rotation = Quat::from_euler(EulerRot::YXZ, yaw, pitch, 0.0);
    }

    let axis = |plus, minus| keys.pressed(plus) as i8 as f32 - keys.pressed(minus) as i8 as f32;
    let direction = camera.forward() * axis(KeyCode::ArrowUp, KeyCode::ArrowDown)
        + camera.right() * axis(KeyCode::ArrowRight, KeyCode::ArrowLeft)
        + Vec3::Y * axis(KeyCode::PageUp, KeyCode::PageDown);
    if direction != Vec3::ZERO {
        let fast = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
        let metres_per_second = if fast { 20.0 } else { 5.0 };
        camera.translation += direction.normalize() * metres_per_second * time.delta_secs();
    }
}
