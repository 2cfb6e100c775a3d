//! The file of a sweep's views.

use crate::args::{LightArgs, ViewArgs};
use crate::values;
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// The longest name of a view.
const MAX_NAME: usize = 100;

/// One view: the options of `compare` by their names, with the same defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct View {
    /// Names the view's folder.
    pub(super) name: String,
    /// A file, relative to the scenes' folder, or a built-in scene.
    pub(super) scene: String,
    eye: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov: Option<f64>,
    near: Option<f64>,
    far: Option<f64>,
    size: Option<[u32; 2]>,
    camera: Option<String>,
    sun: Option<[f64; 3]>,
    light: Option<String>,
}

/// Reads the views, whose names fit for folders and differ. Their values are checked by
/// [`View::options`].
pub(super) fn read(path: &Path) -> Result<Vec<View>> {
    let file = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("VIEWS: {file}"))?;
    let views: Vec<View> = serde_json::from_str(&text)
        .with_context(|| format!("VIEWS: {file} is no list of views"))?;
    ensure!(!views.is_empty(), "VIEWS: {file} holds no view");
    let mut names = HashSet::new();
    for view in &views {
        let name = &view.name;
        check_name(name).with_context(|| format!("VIEWS: {file}: the name {name:?}"))?;
        // Some systems take folders of such names for the same one.
        let is_new = names.insert(name.to_ascii_lowercase());
        ensure!(is_new, "VIEWS: {file}: two views are named `{name}` (in capitals or not)");
    }
    Ok(views)
}

/// Whether every system has folders of this name.
fn check_name(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_alphanumeric() || " -_.,+=@()".contains(c);
    ensure!(name.len() <= MAX_NAME, "must have at most {MAX_NAME} characters");
    ensure!(
        name.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_')
            && !name.ends_with([' ', '.'])
            && name.chars().all(plain),
        "must name a folder: ASCII letters, digits, spaces and -_.,+=@(), the first a letter, a digit or _, \
         the last neither space nor point"
    );
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_ascii_uppercase();
    let is_device = ["CON", "PRN", "AUX", "NUL"].contains(&stem.as_str())
        || stem.strip_prefix("COM").or(stem.strip_prefix("LPT")).is_some_and(|n| n.len() == 1);
    if is_device {
        bail!("is that of a device on some systems");
    }
    Ok(())
}

impl View {
    /// The same as options of `compare`; `size` where the view has none of its own.
    pub(super) fn options(&self, size: [u32; 2]) -> Result<(ViewArgs, LightArgs)> {
        let size = self.size.map_or(Ok(size), values::pixels).context("size")?;
        let view = ViewArgs {
            eye: self.eye.map(values::position).transpose().context("eye")?,
            target: self.target.map(values::position).transpose().context("target")?,
            up: self.up.map(values::pointing).transpose().context("up")?,
            fov: self.fov.map(values::opening).transpose().context("fov")?,
            near: self.near.map(values::metres).transpose().context("near")?,
            far: self.far.map(values::metres).transpose().context("far")?,
            size,
            camera: self.camera.clone(),
        };
        let sun = self.sun.map(values::pointing).transpose().context("sun")?;
        let light = LightArgs { sun, light: self.light.clone() };
        view.check()?;
        light.check()?;
        Ok((view, light))
    }
}

/// An error about options in the words of the file: its fields have no dashes.
pub(super) fn in_words_of_the_file(error: &str) -> String {
    let fields = ["eye", "target", "up", "fov", "near", "far", "size", "camera", "sun", "light"];
    let error = error.replace("SCENE: ", "scene: ");
    fields.iter().fold(error, |text, field| text.replace(&format!("--{field}"), field))
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
