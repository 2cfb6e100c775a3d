//! Views that are listed in a file.

use crate::harness::ViewPoint;
use bevy::math::Vec3;
use bevy_umbrage::umbrage::glam::{DQuat, DVec3};
use bevy_umbrage::umbrage::{Camera, Light, LookAt};
use serde_json::Value;
use std::path::Path;

/// A view of a scene under a sun. Lengths are in metres.
#[derive(Clone, Debug)]
pub(crate) struct View {
    pub(crate) name: String,
    /// The scene's file, relative to the folder of scenes.
    pub(crate) scene: String,
    eye: DVec3,
    target: DVec3,
    fov_y_rad: f64,
    near: f64,
    far: f64,
    /// The direction in which light travels.
    sun: DVec3,
}

impl View {
    /// Reads a file of views.
    ///
    /// # Errors
    /// If the file cannot be read, or has no views.
    pub(crate) fn all(path: &Path) -> Result<Vec<Self>, String> {
        let at = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = std::fs::read_to_string(path).map_err(|e| at(&e))?;
        let json: Value = serde_json::from_str(&text).map_err(|e| at(&e))?;
        let views = json.as_array().filter(|views| !views.is_empty());
        let views = views.ok_or_else(|| at(&"must be a list of views"))?.iter().enumerate();
        views.map(|(i, v)| Self::of(v).map_err(|e| at(&format!("view {i}: {e}")))).collect()
    }

    fn of(json: &Value) -> Result<Self, String> {
        let text = |name: &str| {
            let text = json[name].as_str().map(str::to_owned);
            text.ok_or_else(|| format!("`{name}` must be a text"))
        };
        let number =
            |name: &str| json[name].as_f64().ok_or_else(|| format!("`{name}` must be a number"));
        let vector = |name: &str| {
            let numbers: Vec<f64> =
                json[name].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
            let array: Result<[f64; 3], _> = numbers.try_into();
            array.map(DVec3::from_array).map_err(|_| format!("`{name}` must be three numbers"))
        };
        let view = Self {
            name: text("name")?,
            scene: text("scene")?,
            eye: vector("eye")?,
            target: vector("target")?,
            fov_y_rad: number("fov")?.to_radians(),
            near: number("near")?,
            far: number("far")?,
            sun: vector("sun")?,
        };
        if view.name.contains(['/', '\\']) {
            return Err(format!("the name {:?} must be good for a file", view.name));
        }
        Ok(view)
    }

    /// The view after a turn about the vertical, radians.
    pub(crate) fn turned(&self, angle: f64) -> Self {
        let turn = DQuat::from_rotation_y(angle);
        Self { target: self.eye + turn * (self.target - self.eye), ..self.clone() }
    }

    /// What the harness draws.
    pub(crate) fn view_point(&self) -> ViewPoint {
        ViewPoint {
            eye: single(self.eye),
            target: single(self.target),
            fov_y_rad: self.fov_y_rad as f32,
            near: self.near as f32,
            far: self.far as f32,
        }
    }

    pub(crate) fn sun(&self) -> Vec3 {
        single(self.sun)
    }

    /// The camera of the same picture, for rays.
    ///
    /// # Errors
    /// Names the value that no camera can have.
    pub(crate) fn camera(&self, image: [u32; 2]) -> Result<Camera, String> {
        let Self { eye, target, fov_y_rad, near, far, .. } = *self;
        Camera::look_at(LookAt { eye, target, up: DVec3::Y, fov_y_rad, near, far, image })
            .map_err(|e| e.to_string())
    }

    pub(crate) fn light(&self) -> Light {
        Light::Directional { direction: self.sun }
    }
}

fn single(v: DVec3) -> Vec3 {
    Vec3::from_array(v.as_vec3().to_array())
}
