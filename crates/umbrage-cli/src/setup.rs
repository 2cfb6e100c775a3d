//! Opens scenes, and prints or logs messages about scenes and backends.

use crate::output::note;
use anyhow::Result;
use std::path::Path;
use umbrage_lab::Executors;
use umbrage_scene::Scene;

/// Opens the scene with this name, and logs its size.
pub(crate) fn open_scene(name: &str) -> Result<Scene> {
    let scene = umbrage_lab::open_scene(Path::new(""), name)?;
    log_size(name, &scene);
    Ok(scene)
}

/// Logs the numbers of triangles, cameras and lights of a scene.
pub(crate) fn log_size(name: &str, scene: &Scene) {
    log::info!(
        "{name}: {} triangles drawn, {} stored, {} cameras, {} lights",
        scene.drawn_triangles(),
        scene.stored_triangles(),
        scene.cameras.len(),
        scene.lights.len(),
    );
}

/// Warns of everything that was repaired when the scene was loaded.
pub(crate) fn tell_notices(scene: &Scene) {
    for notice in &scene.notices {
        log::warn!("{}: {}", scene.name, notice.0);
    }
}

/// Prints which backend renders, if the program chose it and not the user.
pub(crate) fn announce(executors: &Executors) {
    if let Some(choice) = executors.choice() {
        tell_backend(choice);
    }
}

/// Prints which backend was chosen.
pub(crate) fn tell_backend(choice: &str) {
    note(&format!("backend: {choice}"));
}
