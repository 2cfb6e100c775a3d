//! On a real device, lavapipe where there is no other.

mod clusters;
mod overlays;
mod pages;
mod parity;
mod pictures;
mod poses;
mod trouble;
mod window;

use std::path::Path;
use std::sync::LazyLock;
use umbrage::{Bounds, BoxTree, Camera, Light, Limits, Plan, Planner, Technique};
use umbrage_clusters::MeshInput;
use umbrage_render::Gpu;
use umbrage_scene::{Alpha, Scene};
use umbrage_testing::third_party_scenes;
use umbrage_trace::Tracer;

/// The device that all tests share.
pub(crate) static GPU: LazyLock<Gpu> =
    LazyLock::new(|| Gpu::open().expect("a GPU, or a driver in software: run tools/setup"));

/// A scene by name: a file of the third-party scenes, or built in.
pub(crate) fn scene(name: &str) -> Scene {
    if !name.ends_with(".glb") {
        let (name, size) = name.split_once(':').unwrap_or((name, ""));
        return umbrage_scene::builtin(name, size.parse().ok()).unwrap();
    }
    let path = Path::new(third_party_scenes!()).join(name);
    umbrage_scene::load(&path).unwrap_or_else(|e| panic!("{e}"))
}

/// The meshes of a scene, as clusters are made of them.
pub(crate) fn mesh_inputs<'a>(scene: &'a Scene) -> Vec<MeshInput<'a>> {
    let input = |mesh: &'a umbrage_scene::Mesh| {
        let umbrage_scene::Mesh { positions, normals, uvs, triangles, material, .. } = mesh;
        let is_masked = matches!(scene.materials[*material].alpha, Alpha::Mask { .. });
        MeshInput { positions, normals, uvs, triangles, is_masked }
    };
    scene.meshes.iter().map(input).collect()
}

/// A scene with its default view, prepared for ray tracing.
pub(crate) struct Set<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: Tracer<'a>,
    pub(crate) camera: Camera,
    boxes: BoxTree,
    light: Light,
}

impl<'a> Set<'a> {
    pub(crate) fn new(scene: &'a Scene, image: [u32; 2]) -> Self {
        let tracer = Tracer::new(scene).unwrap();
        let v = scene.default_view();
        let boxes = BoxTree::new(&tracer.boxes(64)).unwrap();
        // Choosing view and light takes seconds in a large scene that brings none.
        let light = scene.light_for_view(&v).light;
        Self { scene, tracer, camera: v.camera(image).unwrap(), boxes, light }
    }

    pub(crate) fn light(&self) -> Light {
        self.light
    }

    pub(crate) fn plan(&self, lights: &[Light], technique: &Technique) -> Plan {
        let bounds =
            Bounds { receiver_parts: Some(&self.boxes), ..Bounds::of_scene(self.scene.bounds()) };
        let mut planner = Planner::with_limits(Limits { max_side: 65536, ..Limits::default() });
        planner.plan(&self.camera, lights, &bounds, technique).unwrap().clone()
    }
}
