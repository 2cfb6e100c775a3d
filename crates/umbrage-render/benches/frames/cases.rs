//! The scenes and views that are measured.

use crate::{Args, Failure};
use glam::DVec3;
use serde::Deserialize;
use std::path::PathBuf;
use umbrage::{Camera, Light};
use umbrage_scene::{Lens, Scene, SceneCamera};

/// The scenes whose default views are measured: three built-in ones, and four third-party ones with
/// a built-in one in place of each that is missing.
const BUILT_IN: [&str; 3] = ["town", "airfield", "statues"];
const THIRD_PARTY: [(&str, &str); 4] = [
    ("vehicles/kenney_racing_level.glb", "grove"),
    ("city/kenney_city_40x40.glb", "fence"),
    ("terrain/jacksboro_dem_terrain.glb", "contacts"),
    ("trees/forest_eztree.glb", "sphere"),
];

/// A view of a file of views.
#[derive(Clone, Debug, Deserialize)]
struct View {
    name: String,
    scene: String,
    eye: [f64; 3],
    target: [f64; 3],
    /// Vertical, degrees.
    fov: f64,
    near: f64,
    far: f64,
    /// Direction of travel.
    sun: [f64; 3],
}

/// A scene that is not loaded yet, and a view of it if it is not the default one.
#[derive(Debug)]
pub(crate) struct Listed {
    /// A built-in scene, or a file.
    scene: String,
    folder: PathBuf,
    view: Option<View>,
}

/// A scene with a view and a light.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    view: SceneCamera,
    pub(crate) light: Light,
}

/// Lists what the arguments ask for.
pub(crate) fn list(args: &Args) -> Result<Vec<Listed>, Failure> {
    let listed = |scene: &str, view| {
        let folder = args.folder.clone();
        Listed { scene: scene.to_owned(), folder, view }
    };
    if let Some(file) = &args.views {
        let text = std::fs::read_to_string(file);
        let text = text.map_err(|e| format!("{}: {e}", file.display()))?;
        let views: Vec<View> = serde_json::from_str(&text)?;
        let is_asked = |view: &View| {
            args.scenes.is_empty() || args.scenes.iter().any(|part| view.name.contains(part))
        };
        let views = views.into_iter().filter(is_asked);
        return Ok(views.map(|view| listed(&view.scene.clone(), Some(view))).collect());
    }
    if !args.scenes.is_empty() {
        return Ok(args.scenes.iter().map(|scene| listed(scene, None)).collect());
    }
    let third_party = THIRD_PARTY.map(|(file, fallback)| {
        let is_there = args.folder.join(file).exists();
        if is_there { file } else { fallback }
    });
    Ok(BUILT_IN.into_iter().chain(third_party).map(|scene| listed(scene, None)).collect())
}

impl Listed {
    /// Loads the scene.
    pub(crate) fn load(self) -> Result<Case, Failure> {
        let Self { scene: name, folder, view } = self;
        let scene = if name.ends_with(".glb") || name.ends_with(".gltf") {
            umbrage_scene::load(&folder.join(name))?
        } else {
            let (name, size) = name.split_once(':').unwrap_or((&name, ""));
            let size = if size.is_empty() { None } else { Some(size.parse()?) };
            umbrage_scene::builtin(name, size)?
        };
        let (name, view, light) = match view {
            Some(view) => {
                let camera = SceneCamera {
                    name: view.name.clone(),
                    eye: view.eye.into(),
                    target: view.target.into(),
                    up: DVec3::Y,
                    lens: Lens::Perspective { fov_y_rad: view.fov.to_radians() },
                    near: view.near,
                    far: view.far,
                };
                (view.name, camera, Light::Directional { direction: view.sun.into() })
            }
            None => (scene.name.clone(), scene.default_view(), scene.default_light().light),
        };
        Ok(Case { name, scene, view, light })
    }
}

impl Case {
    /// The view, with a picture of this size, pixels.
    pub(crate) fn camera(&self, image: [u32; 2]) -> Result<Camera, umbrage::Error> {
        self.view.camera(image)
    }

    /// Number of triangles, counted once for each instance.
    pub(crate) fn triangles(&self) -> usize {
        self.scene.instances.iter().map(|i| self.scene.meshes[i.mesh].triangles.len()).sum()
    }
}
