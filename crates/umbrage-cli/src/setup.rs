//! Construction of what the arguments name: scene, view, light.

use crate::args::{Fit, LightArgs, ViewArgs};
use anyhow::{Context, Result, anyhow, bail, ensure};
use glam::DVec3;
use std::path::{Path, PathBuf};
use umbrage::{Aabb, Bounds, Camera, Light, LookAt};
use umbrage_scene::{Scene, SceneCamera, builtins};
use umbrage_trace::Tracer;

/// Light of an afternoon: 45° high, from the side and a little from behind a viewer who looks along −z.
const AFTERNOON_SUN: DVec3 = DVec3::new(-0.6, -1.0, -0.8);

/// What a view has of itself where neither user nor scene says more.
const DEFAULT_VIEW: LookAt = LookAt {
    eye: DVec3::ZERO,
    target: DVec3::NEG_Z,
    up: DVec3::Y,
    fov_y_rad: std::f64::consts::FRAC_PI_3,
    near: 0.1,
    far: 100.0,
    image: [960, 540],
};

/// A camera, and where it came from.
pub(crate) struct Onlooker {
    /// Its name in the scene, if it is from there and was not changed.
    pub(crate) name: Option<String>,
    /// As described.
    pub(crate) look: LookAt,
    /// As planned with.
    pub(crate) camera: Camera,
}

/// A light, and where it came from.
pub(crate) struct Lamp {
    /// Its name in the scene, if it is from there.
    pub(crate) name: Option<String>,
    /// The light itself.
    pub(crate) light: Light,
}

/// The scene of this name: a file if there is one, else a built-in scene, `name` or `name:size`.
pub(crate) fn open_scene(name: &str) -> Result<Scene> {
    open_scene_in(Path::new(""), name)
}

/// As [`open_scene`], files being looked for from `folder`.
pub(crate) fn open_scene_in(folder: &Path, name: &str) -> Result<Scene> {
    let scene = read_scene(folder, name)?;
    ensure!(scene.drawn_triangles() > 0, "SCENE: {name} has no triangles to draw");
    log::info!(
        "{name}: {} triangles drawn, {} stored, {} cameras, {} lights",
        scene.drawn_triangles(),
        scene.stored_triangles(),
        scene.cameras.len(),
        scene.lights.len(),
    );
    Ok(scene)
}

/// Says what was repaired on loading.
pub(crate) fn tell_notices(scene: &Scene) {
    for notice in &scene.notices {
        log::warn!("{}: {}", scene.name, notice.0);
    }
}

/// The file of a scene; `None` if it is not there, then the scene may be built in.
pub(crate) fn scene_file(folder: &Path, name: &str) -> Option<PathBuf> {
    Some(folder.join(name)).filter(|path| path.exists() && !path.is_dir())
}

fn read_scene(folder: &Path, name: &str) -> Result<Scene> {
    if let Some(path) = scene_file(folder, name) {
        return Ok(umbrage_scene::load(&path)?);
    }
    let path = folder.join(name);
    let (builtin, size) = match name.split_once(':') {
        None => (name, None),
        Some((builtin, size)) => (builtin, Some(size)),
    };
    let names: Vec<&str> = builtins().iter().map(|b| b.name).collect();
    if !names.contains(&builtin) {
        let shown = path.display();
        ensure!(!path.is_dir(), "SCENE: {shown} is a folder, must be a .gltf or .glb file");
        let is_path = name.contains(['/', '\\', '.']);
        ensure!(!is_path, "SCENE: there is no file {shown}");
        bail!(
            "SCENE: there is neither a file nor a built-in scene `{name}`; did you mean `{}`? (built in are {})",
            umbrage::language::nearest(builtin, names.iter().copied()),
            names.join(", ")
        );
    }
    let size = size
        .map(|s| {
            s.parse().map_err(|_| {
                anyhow!("SCENE: the size in `{name}` must be a whole number, as in {builtin}:10")
            })
        })
        .transpose()?;
    umbrage_scene::builtin(builtin, size).context("SCENE")
}

/// The view that the arguments ask for. What they leave open comes from the scene's camera; a view
/// with an eye and a target of its own owes the scene only the depth range.
pub(crate) fn onlooker(args: &ViewArgs, scene: Option<&Scene>) -> Result<Onlooker> {
    let own = match (scene, args.eye, args.target) {
        (None, ..) | (_, Some(_), Some(_)) => None,
        (Some(scene), ..) => Some(scene_camera(args, scene)?),
    };
    let base = own.as_ref().map_or(DEFAULT_VIEW, |c| c.look_at(args.size));
    let mut look = LookAt {
        eye: args.eye.unwrap_or(base.eye),
        target: args.target.unwrap_or(base.target),
        up: args.up.unwrap_or(base.up),
        fov_y_rad: args.fov.map_or(base.fov_y_rad, f64::to_radians),
        near: args.near.unwrap_or(base.near),
        far: args.far.unwrap_or(base.far),
        image: args.size,
    };
    let moved = args.eye.is_some() || args.target.is_some();
    if let Some(scene) = scene
        && moved
    {
        let [near, far] = depth_range(&look, scene.bounds());
        look.far = args.far.unwrap_or(far.max(args.near.unwrap_or(0.0) * 2.0));
        look.near = args.near.unwrap_or(near.min(look.far / 2.0));
    }
    let camera = Camera::look_at(look).map_err(|e| option_error(&e))?;
    let changed = [args.near, args.far, args.fov].iter().any(Option::is_some) || args.up.is_some();
    let name = own.map(|c| c.name).filter(|name| {
        !moved && !changed && scene.is_some_and(|s| s.cameras.iter().any(|c| c.name == *name))
    });
    Ok(Onlooker { name, look, camera })
}

fn scene_camera(args: &ViewArgs, scene: &Scene) -> Result<SceneCamera> {
    match &args.camera {
        None => Ok(scene.default_view()),
        Some(name) => {
            let names = scene.cameras.iter().map(|c| c.name.as_str());
            let index = find("--camera", "camera", name, names)?;
            Ok(scene.cameras[index].clone())
        }
    }
}

/// A depth range for a view from anywhere: up to the end of the scene, from a thousandth of that or
/// from where the scene begins.
fn depth_range(look: &LookAt, bounds: Aabb) -> [f64; 2] {
    let forward = (look.target - look.eye).normalize_or(DVec3::NEG_Z);
    let far = bounds.corners().iter().map(|&c| forward.dot(c - look.eye)).fold(0.0, f64::max);
    let far = if far > 0.0 { far * 1.01 } else { 100.0 };
    let distance = look.eye.distance(look.eye.clamp(bounds.min, bounds.max));
    // The scene's nearest point may appear in the picture's corner, where depth is less than distance.
    let corner = {
        let tan_y = (look.fov_y_rad / 2.0).tan();
        let tan_x = tan_y * f64::from(look.image[0]) / f64::from(look.image[1]);
        (1.0 + tan_x * tan_x + tan_y * tan_y).sqrt()
    };
    [(distance / corner).max(far / 1000.0), far]
}

/// Where a scene's shadows fall, as far as the planner is told.
pub(crate) struct Receivers {
    all: Aabb,
    parts: Vec<Aabb>,
}

/// Boxes around a scene's surfaces. More make planning slower and the maps hardly finer.
const SURFACE_BOXES: usize = 256;

impl Receivers {
    pub(crate) fn new(scene: &Scene, tracer: &Tracer<'_>, fit: Fit) -> Self {
        match fit {
            Fit::Box => Self::in_box(scene),
            Fit::Surfaces => Self { parts: tracer.boxes(SURFACE_BOXES), ..Self::in_box(scene) },
        }
    }

    /// Anywhere in the box around the scene.
    pub(crate) fn in_box(scene: &Scene) -> Self {
        Self { all: scene.bounds(), parts: Vec::new() }
    }

    pub(crate) fn bounds(&self) -> Bounds<'_> {
        Bounds { receiver_parts: &self.parts, ..Bounds::of_scene(self.all) }
    }
}

/// The light that the arguments ask for, else the scene's own.
pub(crate) fn lamp(args: &LightArgs, scene: Option<&Scene>) -> Result<Lamp> {
    if let Some(direction) = args.sun {
        return Ok(Lamp { name: None, light: Light::Directional { direction } });
    }
    let Some(scene) = scene else {
        return Ok(Lamp { name: None, light: Light::Directional { direction: AFTERNOON_SUN } });
    };
    let Some(name) = &args.light else {
        let found = scene.default_light();
        let name = scene.lights.contains(&found).then_some(found.name);
        return Ok(Lamp { name, light: found.light });
    };
    let index = find("--light", "light", name, scene.lights.iter().map(|l| l.name.as_str()))?;
    Ok(Lamp { name: Some(name.clone()), light: scene.lights[index].light })
}

/// Index of `name` among `names`, or an error that lists them.
fn find<'a>(
    option: &str,
    what: &str,
    name: &str,
    names: impl Iterator<Item = &'a str>,
) -> Result<usize> {
    let names: Vec<&str> = names.collect();
    names.iter().position(|n| *n == name).ok_or_else(|| {
        if names.is_empty() {
            anyhow!("{option}: the scene has no {what} `{name}`, nor any other")
        } else {
            anyhow!("{option}: the scene has no {what} `{name}`; there are {}", names.join(", "))
        }
    })
}

/// A planner's complaint in the words of the command line.
pub(crate) fn option_error(error: &umbrage::Error) -> anyhow::Error {
    let text = error.to_string();
    anyhow!(
        text.replace("camera.fov_y_rad", "--fov")
            .replace("camera.image", "--size")
            .replace("camera.", "--")
            .replace("light.direction", "--sun")
    )
}
