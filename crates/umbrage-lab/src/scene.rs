//! Opens scenes, and finds cameras and lights by the words that choose them.

use crate::error::{About, Error, Field};
use crate::values;
use std::path::{Path, PathBuf};
use umbrage_scene::{Choices, LeftOut, Scene, SceneError, builtins};

/// How a scene is changed once it is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneOptions {
    /// The animation that poses the scene: its name, or its number in the scene, such as `#2`.
    /// `None` leaves the scene in the pose of its file.
    pub animation: Option<String>,
    /// Time in the animation, seconds, finite and at least 0. Times after its end are its end.
    pub time_s: f64,
    /// Nodes that are left out, in the words `NAME`, `NAME:casting` or `NAME:receiving`. A name is
    /// that of a node, or its number in the scene, such as `#2`. It stands for all nodes of that
    /// name, with all nodes below them.
    pub without: Vec<String>,
    /// Whether ground is put under the scene.
    pub ground: bool,
}

impl SceneOptions {
    /// Changes a scene.
    ///
    /// # Errors
    /// An error if the scene has no such animation or node, or if nothing is left of it.
    pub fn apply(&self, scene: &mut Scene) -> Result<(), Error> {
        if let Some(word) = &self.animation {
            let time_s = values::seconds(self.time_s)
                .map_err(|problem| Error::field(Field::Time, problem))?;
            let clip = find(Field::Animation, word, &scene.animation_choices())?;
            scene.pose(Some(clip), time_s);
            if scene.bounds().is_empty() {
                let problem = format!("at {time_s} s of `{word}` there is nothing to see");
                return Err(Error::field(Field::Time, problem));
            }
        }
        for text in &self.without {
            let (name, what) = match text.rsplit_once(':') {
                Some((name, "casting")) => (name, LeftOut::Casting),
                Some((name, "receiving")) => (name, LeftOut::Receiving),
                _ => (text.as_str(), LeftOut::Both),
            };
            let nodes = scene.nodes_called(name);
            if nodes.is_empty() {
                let choices = scene.node_choices();
                let problem = match choices.is_empty() {
                    true => format!("the scene has no node `{name}`, nor any other"),
                    false => {
                        format!("the scene has no node `{name}`; there are {}", listed(&choices))
                    }
                };
                return Err(Error::field(Field::Without, problem));
            }
            scene.leave_out(&nodes, what);
        }
        if scene.bounds().is_empty() {
            return Err(Error::field(Field::Without, "nothing is left to see"));
        }
        if self.ground {
            scene.add_ground();
        }
        Ok(())
    }
}

/// Opens the scene of this name: a file, relative to `folder`, or else a built-in scene, whose name
/// is written `name` or `name:size`. Then changes it as `options` say.
///
/// # Errors
/// An error if there is neither a file nor a built-in scene of this name, if the file cannot be
/// read, if the scene has no triangles to draw, or if it has nothing that is to be left out.
pub fn open_scene(folder: &Path, name: &str, options: &SceneOptions) -> Result<Scene, Error> {
    let mut scene = match scene_file(folder, name) {
        Some(path) => umbrage_scene::load(&path)?,
        None => built_in(folder, name)?,
    };
    match scene.drawn_triangles() {
        0 => Err(Error::field(Field::Scene, format!("{name} has no triangles to draw"))),
        _ => {
            options.apply(&mut scene)?;
            Ok(scene)
        }
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

/// Returns the index of the camera, light or animation that a word chooses.
///
/// # Errors
/// An error that lists the words that choose one.
pub(crate) fn find(field: Field, word: &str, choices: &Choices<'_>) -> Result<usize, Error> {
    choices.find(word).ok_or_else(|| {
        let problem = match (choices.len(), choices.bearers(word)) {
            (0, _) => format!("the scene has no {field} `{word}`, nor any other"),
            (_, 0) => format!("the scene has no {field} `{word}`; there are {}", listed(choices)),
            (_, n) => format!(
                "the scene has {n} of the name `{word}`, which chooses none; there are {}",
                listed(choices)
            ),
        };
        Error::field(field, problem)
    })
}

/// The words that choose each of a list, for an error.
fn listed(choices: &Choices<'_>) -> String {
    const MOST: usize = 20;
    let words = |i: usize| choices.words(i).join(" or ");
    let mut listed: Vec<String> = (0..choices.len().min(MOST)).map(words).collect();
    if choices.len() > MOST {
        listed.push(format!("{} more, up to #{}", choices.len() - MOST, choices.len()));
    }
    listed.join(", ")
}
