//! Finds scenes, cameras and lights by their names.

use crate::error::{About, Error, Field};
use std::path::{Path, PathBuf};
use umbrage_scene::{Scene, SceneError, builtins};

/// Opens the scene of this name: a file, relative to `folder`, or else a built-in scene, whose name
/// is written `name` or `name:size`.
///
/// # Errors
/// An error if there is neither a file nor a built-in scene of this name, if the file cannot be
/// read, or if the scene has no triangles to draw.
pub fn open_scene(folder: &Path, name: &str) -> Result<Scene, Error> {
    let scene = match scene_file(folder, name) {
        Some(path) => umbrage_scene::load(&path)?,
        None => built_in(folder, name)?,
    };
    match scene.drawn_triangles() {
        0 => Err(Error::field(Field::Scene, format!("{name} has no triangles to draw"))),
        _ => Ok(scene),
    }
}

/// Returns the file of a scene; `None` if there is no file, so that the scene may be built in.
pub(crate) fn scene_file(folder: &Path, name: &str) -> Option<PathBuf> {
    Some(folder.join(name)).filter(|path| path.exists() && !path.is_dir())
}

/// Opens a built-in scene.
fn built_in(folder: &Path, name: &str) -> Result<Scene, Error> {
    let wrong = |problem: String| Err(Error::field(Field::Scene, problem));
    let (builtin, size) = match name.split_once(':') {
        None => (name, None),
        Some((builtin, size)) => (builtin, Some(size)),
    };
    let names: Vec<&str> = builtins().iter().map(|b| b.name).collect();
    if !names.contains(&builtin) {
        let path = folder.join(name);
        let shown = path.display();
        if path.is_dir() {
            return wrong(format!("{shown} is a folder, must be a .gltf or .glb file"));
        }
        if name.contains(['/', '\\', '.']) {
            return wrong(format!("there is no file {shown}"));
        }
        return wrong(format!(
            "there is neither a file nor a built-in scene `{name}`; did you mean `{}`? (built in are {})",
            umbrage::language::nearest(builtin, names.iter().copied()),
            names.join(", ")
        ));
    }
    let Ok(size) = size.map(str::parse).transpose() else {
        return wrong(format!("the size in `{name}` must be a whole number, as in {builtin}:10"));
    };
    umbrage_scene::builtin(builtin, size).about(Field::Scene)
}

/// Returns the SHA-256 of the scene's files, one after the other, as hexadecimal digits; `None` if
/// there is no file or if a file cannot be read.
pub(crate) fn digest(folder: &Path, name: &str) -> Option<String> {
    use sha2::{Digest, Sha256};

    let file = scene_file(folder, name)?;
    // If the scene is broken, only the named file itself is hashed.
    let files = umbrage_scene::files(&file).unwrap_or_else(|_: SceneError| vec![file]);
    let mut sha = Sha256::new();
    for file in files {
        sha.update(std::fs::read(file).ok()?);
    }
    Some(sha.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// Returns the index of `name` among the names of a scene's cameras or lights.
///
/// # Errors
/// An error that lists all names, if `name` is not among them.
pub(crate) fn find<'a>(
    field: Field,
    name: &str,
    names: impl Iterator<Item = &'a str>,
) -> Result<usize, Error> {
    let names: Vec<&str> = names.collect();
    let none = || match names.join(", ") {
        all if all.is_empty() => format!("the scene has no {field} `{name}`, nor any other"),
        all => format!("the scene has no {field} `{name}`; there are {all}"),
    };
    names.iter().position(|n| *n == name).ok_or_else(|| Error::field(field, none()))
}
