//! The file that lists the views of a sweep.

use crate::error::{About, Error, Field};
use crate::light::LightOptions;
use crate::values;
use crate::view::ViewOptions;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// Largest number of characters in a view's name.
const MAX_NAME: usize = 100;

/// A view in the file. The JSON keys are the [names](Field::name) of the fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepView {
    /// Name of the view, and of the folder for its report.
    pub(super) name: String,
    /// Path of a file, relative to the folder of scenes, or the name of a built-in scene.
    pub(super) scene: String,
    eye: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov: Option<f64>,
    ortho: Option<f64>,
    near: Option<f64>,
    far: Option<f64>,
    size: Option<[u32; 2]>,
    camera: Option<String>,
    sun: Option<[f64; 3]>,
    #[serde(default, rename = "sun-angles", skip_serializing_if = "Option::is_none")]
    sun_angles: Option<[f64; 2]>,
    light: Option<String>,
}

/// Reads the views, and checks that their names all differ and are valid for folders.
/// [`SweepView::options`] checks the other values.
///
/// # Errors
/// An error if the file cannot be read, or if it is not a list of views with such names.
pub(super) fn read(path: &Path) -> Result<Vec<SweepView>, Error> {
    let wrong = |problem: String| Err(Error::field(Field::Views, problem));
    let file = path.display();
    let text = std::fs::read_to_string(path).about_trying(Field::Views, || file.to_string())?;
    let views: Vec<SweepView> = serde_json::from_str(&text)
        .about_trying(Field::Views, || format!("{file} is no list of views"))?;
    if views.is_empty() {
        return wrong(format!("{file} holds no view"));
    }
    let mut names = HashSet::new();
    for view in &views {
        let name = &view.name;
        if let Err(problem) = check_name(name) {
            return wrong(format!("{file}: the name {name:?}: {problem}"));
        }
        // Some systems treat folders as the same if their names differ only in capitals.
        if !names.insert(name.to_ascii_lowercase()) {
            return wrong(format!("{file}: two views are named `{name}` (in capitals or not)"));
        }
    }
    Ok(views)
}

/// Checks that every system can have a folder of this name. The error says what the name must be.
fn check_name(name: &str) -> Result<(), String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || " -_.,+=@()".contains(c);
    if name.len() > MAX_NAME {
        return Err(format!("must have at most {MAX_NAME} characters"));
    }
    let is_folder = name.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_')
        && !name.ends_with([' ', '.'])
        && name.chars().all(is_plain);
    if !is_folder {
        let problem = "must name a folder: ASCII letters, digits, spaces and -_.,+=@(), the first a \
                       letter, a digit or _, the last neither space nor point";
        return Err(problem.to_owned());
    }
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_ascii_uppercase();
    let is_device = ["CON", "PRN", "AUX", "NUL"].contains(&stem.as_str())
        || stem.strip_prefix("COM").or(stem.strip_prefix("LPT")).is_some_and(|n| n.len() == 1);
    if is_device { Err("is that of a device on some systems".to_owned()) } else { Ok(()) }
}

impl SweepView {
    /// Checks and returns the options of the view and the light. A view without a size gets `size`.
    ///
    /// # Errors
    /// An error if a value is invalid, or if values cannot be combined.
    pub(super) fn options(&self, size: [u32; 2]) -> Result<(ViewOptions, LightOptions), Error> {
        let view = ViewOptions {
            eye: self.eye.map(DVec3::from),
            target: self.target.map(DVec3::from),
            up: self.up.map(DVec3::from),
            fov_deg: self.fov,
            ortho: self.ortho,
            near: self.near,
            far: self.far,
            size: self.size.unwrap_or(size),
            camera: self.camera.clone(),
        };
        let sun = match (self.sun, self.sun_angles) {
            (Some(_), Some(_)) => {
                return Err(Error::Excluded { field: Field::SunAngles, by: Field::Sun });
            }
            (sun, None) => sun.map(DVec3::from),
            (None, Some(angles)) => Some(
                values::sun_direction(angles)
                    .map_err(|problem| Error::field(Field::SunAngles, problem))?,
            ),
        };
        let light = LightOptions { sun, light: self.light.clone() };
        view.check()?;
        light.check()?;
        Ok((view, light))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_folders_everywhere() {
        for good in
            ["a", "_", "fence_rows-sun45", "Gate (noon), 2.5 m", "con-1", "COM10", "x=1+y@2"]
        {
            assert!(check_name(good).is_ok(), "{good}");
        }
        let long = "x".repeat(MAX_NAME + 1);
        for bad in [
            "", ".", "..", ".hidden", "a/b", "a\\b", "a:b", " a", "a ", "a.", "ü", "a\n", "a\"b",
            "a*", "-o", "con", "Nul.txt", "com1", "LPT9.x", "aux .y", &long,
        ] {
            assert!(check_name(bad).is_err(), "{bad:?}");
        }
    }
}
