//! Scenes and backends by what the arguments say, and what is told of them.

use crate::output::note;
use anyhow::Result;
use std::path::Path;
use umbrage_lab::Executors;
use umbrage_scene::Scene;

/// The scene of this name.
pub(crate) fn open_scene(name: &str) -> Result<Scene> {
    let scene = umbrage_lab::open_scene(Path::new(""), name)?;
    log_size(name, &scene);
    Ok(scene)
}

/// Logs how large a scene is.
pub(crate) fn log_size(name: &str, scene: &Scene) {
    log::info!(
        "{name}: {} triangles drawn, {} stored, {} cameras, {} lights",
        scene.drawn_triangles(),
        scene.stored_triangles(),
        scene.cameras.len(),
        scene.lights.len(),
    );
}

/// Says what was repaired on loading.
pub(crate) fn tell_notices(scene: &Scene) {
    for notice in &scene.notices {
        log::warn!("{}: {}", scene.name, notice.0);
    }
}

/// Says what renders, if the choice was ours.
pub(crate) fn announce(executors: &Executors) {
    if let Some(choice) = executors.choice() {
        tell_backend(choice);
    }
}

/// Says what was taken to render with.
pub(crate) fn tell_backend(choice: &str) {
    note(&format!("backend: {choice}"));
}
