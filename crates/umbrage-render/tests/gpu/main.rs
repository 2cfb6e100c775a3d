//! Tests on a real device, or on lavapipe if there is no other. Without any device they fail;
//! `tools/setup` installs lavapipe.

mod parity;
mod pictures;
mod trouble;

use std::path::PathBuf;
use std::sync::LazyLock;
use umbrage::{Aabb, Bounds, Camera, Light, Limits, Plan, Planner, Technique};
use umbrage_render::Gpu;
use umbrage_scene::Scene;
use umbrage_trace::Tracer;

/// The device that all tests share.
pub(crate) static GPU: LazyLock<Gpu> =
    LazyLock::new(|| Gpu::open().expect("a GPU, or a driver in software: run tools/setup"));

/// A scene by name: a file of the shared scenes, or a built-in scene.
pub(crate) fn scene(name: &str) -> Scene {
    if !name.ends_with(".glb") {
        let (name, size) = name.split_once(':').unwrap_or((name, ""));
        return umbrage_scene::builtin(name, size.parse().ok()).unwrap();
    }
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes");
    let folder = std::env::var_os("UMBRAGE_SCENES").map_or(PathBuf::from(default), PathBuf::from);
    let path = folder.join(name);
    assert!(
        path.is_file(),
        "{} is missing: these tests need the shared scenes; set UMBRAGE_SCENES to their folder",
        path.display()
    );
    umbrage_scene::load(&path).unwrap()
}

/// A scene with its default view, prepared for ray tracing.
pub(crate) struct Set<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: Tracer<'a>,
    pub(crate) camera: Camera,
    boxes: Vec<Aabb>,
}

impl<'a> Set<'a> {
    pub(crate) fn new(scene: &'a Scene, image: [u32; 2]) -> Self {
        let tracer = Tracer::new(scene).unwrap();
        let v = scene.default_view();
        let look = v.look_at(image);
        let boxes = tracer.boxes(64);
        Self { scene, tracer, camera: Camera::look_at(look).unwrap(), boxes }
    }

    pub(crate) fn light(&self) -> Light {
        self.scene.default_light().light
    }

    pub(crate) fn plan(&self, lights: &[Light], technique: &Technique) -> Plan {
        let bounds =
            Bounds { receiver_parts: &self.boxes, ..Bounds::of_scene(self.scene.bounds()) };
        let mut planner = Planner::with_limits(Limits { max_side: 65536, ..Limits::default() });
        planner.plan(&self.camera, lights, &bounds, technique).unwrap().clone()
    }
}
