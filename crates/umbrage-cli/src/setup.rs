//! Opens scenes, chooses views and lights, and prints or logs messages about all of them.

use crate::args::{SceneArgs, SceneChangeArgs, ViewArgs};
use crate::output::{note, six_digits};
use crate::progress::Bar;
use anyhow::Result;
use glam::DVec3;
use std::path::Path;
use umbrage::Light;
use umbrage_lab::{
    ChosenLight, ChosenView, Defaults, Executors, LightOptions, Progress, RenderScene,
    choose_light, choose_view,
};
use umbrage_scene::{Lens, Scene, SceneCamera};

/// Opens a scene, changes it as asked for, and logs its size.
pub(crate) fn open_scene(args: &SceneArgs, bar: &Bar) -> Result<Scene> {
    open_changed(&args.name, &args.changes, bar)
}

/// Does the same as [`open_scene`] where a scene may be left out.
pub(crate) fn open_changed(name: &str, changes: &SceneChangeArgs, bar: &Bar) -> Result<Scene> {
    bar.stage(&format!("opening {name}"));
    let scene = umbrage_lab::open_scene(Path::new(""), name, &changes.options())?;
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

/// A view and the lights in it.
pub(crate) struct Chosen {
    pub(crate) view: ChosenView,
    /// As many as were asked for.
    pub(crate) lights: Vec<ChosenLight>,
}

/// Chooses the view and the lights that are asked for.
pub(crate) fn choose(
    view: &ViewArgs,
    lights: &[LightOptions],
    scene: Option<&Scene>,
    bar: &Bar,
) -> Result<Chosen> {
    bar.stage("choosing view and light");
    let defaults = Defaults::of(scene);
    let view = choose_view(&view.options(), &defaults)?;
    let lights = lights.iter().map(|light| choose_light(light, &defaults));
    Ok(Chosen { view, lights: lights.collect::<Result<_, _>>()? })
}

/// Warns of everything that was repaired when the scene was loaded, or that the scene's size does
/// not follow from.
pub(crate) fn tell_notices(scene: &Scene) {
    for notice in scene.all_notices() {
        log::warn!("{}: {}", scene.name, notice.0);
    }
}

/// Warns of what users should know of how the scene is drawn.
pub(crate) fn tell_detail(scene: &RenderScene<'_>) {
    if let Some(notice) = scene.notice() {
        log::warn!("{notice}");
    }
}

/// Prints which view and which lights were taken, and warns of what the view cuts away.
pub(crate) fn tell_chosen(view: &ChosenView, lights: &[ChosenLight]) {
    for notice in &view.notices {
        log::warn!("{notice}");
    }
    note(&format!("view: {}", view_words(view)));
    for light in lights {
        note(&format!("light: {}", light_words(light)));
    }
}

/// A view in the words of the command line.
pub(crate) fn view_words(view: &ChosenView) -> String {
    let SceneCamera { eye, target, up, lens, near, far, .. } = view.view;
    let [width, height] = view.camera.image();
    let lens = match lens {
        Lens::Perspective { fov_y_rad } => format!("--fov {}", six_digits(fov_y_rad.to_degrees())),
        Lens::Orthographic { height } => format!("--ortho {}", six_digits(height)),
    };
    let camera = view.name.as_ref().map_or(String::new(), |name| format!("camera `{name}`, "));
    format!(
        "{camera}--eye={} --target={} --up={} {lens} --near {} --far {} --size {width}x{height}",
        point(eye),
        point(target),
        point(up),
        six_digits(near),
        six_digits(far)
    )
}

/// A light in words: its name, if it has one, and where it shines from.
pub(crate) fn light_words(light: &ChosenLight) -> String {
    let name = light.name.as_ref().map_or(String::new(), |name| format!("`{name}`, "));
    let shines = match light.light {
        Light::Directional { direction } => {
            format!("--sun={}", point(direction.normalize_or_zero()))
        }
        Light::Spot(spot) => {
            format!("a spot light at {} towards {}", point(spot.position), point(spot.direction))
        }
        Light::Point(lamp) => format!("a point light at {}", point(lamp.position)),
    };
    name + &shines
}

fn point(p: DVec3) -> String {
    let [x, y, z] = p.to_array().map(six_digits);
    format!("{x},{y},{z}")
}

/// Prints which backend renders.
pub(crate) fn announce(executors: &Executors) {
    tell_backend(executors.choice());
}

/// Prints which backend was chosen.
pub(crate) fn tell_backend(choice: &str) {
    note(&format!("backend: {choice}"));
}
