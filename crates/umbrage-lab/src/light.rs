//! Lights: the options that a user may give, and the light that follows from them.

use crate::defaults::Defaults;
use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::Light;
use umbrage_measure::LightInfo;

/// Direction of afternoon light: 45° high, from the side and a little from behind a viewer who
/// looks along −z.
const AFTERNOON_SUN: DVec3 = DVec3::new(-0.6, -1.0, -0.8);

/// The light that a user asks for. Without one,
/// [`Scene::default_light`](umbrage_scene::Scene::default_light) or, without a scene, an
/// afternoon sun at 45°.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightOptions {
    /// Direction in which parallel light travels, of any length; cannot be combined with `light`.
    pub sun: Option<DVec3>,
    /// A light of the scene, by a word that [chooses](umbrage_scene::Choices) it.
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

/// A light, and the word that chooses it if it comes from the scene.
#[derive(Clone, Debug)]
pub struct ChosenLight {
    /// The word that chooses the light, if it comes from the scene.
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
/// An error if the scene has no such light.
pub fn choose_light(options: &LightOptions, defaults: &Defaults<'_>) -> Result<ChosenLight, Error> {
    if let Some(direction) = options.sun {
        return Ok(ChosenLight { name: None, light: Light::Directional { direction } });
    }
    let Some(scene) = defaults.scene() else {
        let light = Light::Directional { direction: AFTERNOON_SUN };
        return Ok(ChosenLight { name: None, light });
    };
    let choices = scene.light_choices();
    let index = match &options.light {
        Some(word) => Some(find(Field::Light, word, &choices)?),
        None => scene.lights.iter().position(|l| l.intensity > 0.0),
    };
    Ok(match index {
        Some(index) => ChosenLight {
            name: choices.words(index).into_iter().next(),
            light: scene.lights[index].light,
        },
        None => ChosenLight { name: None, light: defaults.light(scene).light },
    })
}
