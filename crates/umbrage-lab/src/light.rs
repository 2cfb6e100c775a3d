//! Lights: what may be asked for, and what is taken.

use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::Light;
use umbrage_measure::LightInfo;
use umbrage_scene::Scene;

/// Light of an afternoon: 45° high, from the side and a little from behind a viewer who looks along
/// −z.
const AFTERNOON_SUN: DVec3 = DVec3::new(-0.6, -1.0, -0.8);

/// The light that somebody asks for. Left out: the scene's first, else a 45° afternoon sun.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightOptions {
    /// Parallel light: the way it travels, of any length; not with a light of the scene.
    pub sun: Option<DVec3>,
    /// A light of the scene, by name.
    pub light: Option<String>,
}

impl LightOptions {
    /// That each value makes sense, and that they go together.
    ///
    /// # Errors
    /// The first that does not.
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

/// A light, and where it came from.
#[derive(Clone, Debug)]
pub struct ChosenLight {
    /// Its name in the scene, if it is from there.
    pub name: Option<String>,
    /// The light itself.
    pub light: Light,
}

impl ChosenLight {
    /// As reports tell it.
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

/// The light that is asked for, else the scene's own.
///
/// # Errors
/// A light that the scene does not have.
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
