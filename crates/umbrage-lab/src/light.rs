//! Lights: the options that a user may give, and the light that follows from them.

use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::Light;
use umbrage_measure::LightInfo;
use umbrage_scene::Scene;

/// Direction of afternoon light: 45° high, from the side and a little from behind a viewer who
/// looks along −z.
const AFTERNOON_SUN: DVec3 = DVec3::new(-0.6, -1.0, -0.8);

/// The light that a user asks for. Without one, [`Scene::default_light`] or, without a scene, an
/// afternoon sun at 45°.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightOptions {
    /// Direction in which parallel light travels, of any length; cannot be combined with `light`.
    pub sun: Option<DVec3>,
    /// Name of a light of the scene.
    pub light: Option<String>,
}

impl LightOptions {
    /// Checks each value and their combination.
    ///
    /// # Errors
    /// An error if `sun` is not a valid direction, or if both `sun` and `light` are given.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(sun) = self.sun {
            values::pointing(sun).map_err(|p| Error::field(Field::Sun, p))?;
        }
        match (self.sun, &self.light) {
            (Some(_), Some(_)) => Err(Error::Excluded { field: Field::Light, by: Field::Sun }),
            _ => Ok(()),
        }
    }
}

/// A light, and its name in the scene if it comes from there.
#[derive(Clone, Debug)]
pub struct ChosenLight {
    /// Name of the light in the scene, if it comes from there.
    pub name: Option<String>,
    /// The light itself.
    pub light: Light,
}

impl ChosenLight {
    /// Returns the light in the form that reports show.
    pub fn info(&self) -> LightInfo {
        let name = self.name.clone();
        match self.light {
            Light::Directional { direction } => {
                LightInfo::Directional { name, direction: direction.normalize_or_zero().to_array() }
            }
            Light::Spot(spot) => LightInfo::Spot {
                name,
                position: spot.position.to_array(),
                direction: spot.direction.normalize_or_zero().to_array(),
                half_angle: spot.half_angle_rad.to_degrees(),
                range: spot.range,
            },
            Light::Point(point) => {
                LightInfo::Point { name, position: point.position.to_array(), range: point.range }
            }
        }
    }
}

/// Returns the light that is asked for or, if there is none, the scene's default light.
///
/// # Errors
/// An error if the scene has no light of that name.
pub fn choose_light(options: &LightOptions, scene: Option<&Scene>) -> Result<ChosenLight, Error> {
    if let Some(direction) = options.sun {
        return Ok(ChosenLight { name: None, light: Light::Directional { direction } });
    }
    let Some(scene) = scene else {
        let light = Light::Directional { direction: AFTERNOON_SUN };
        return Ok(ChosenLight { name: None, light });
    };
    let Some(name) = &options.light else {
        let found = scene.default_light();
        let name = scene.lights.contains(&found).then_some(found.name);
        return Ok(ChosenLight { name, light: found.light });
    };
    let index = find(Field::Light, name, scene.lights.iter().map(|l| l.name.as_str()))?;
    Ok(ChosenLight { name: Some(name.clone()), light: scene.lights[index].light })
}
