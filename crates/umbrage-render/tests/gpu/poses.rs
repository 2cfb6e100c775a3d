//! Poses that reach scenes on the GPU, against the same scenes uploaded afresh.

use crate::pages::buffers as page_buffers;
use crate::parity::agrees_with;
use crate::pictures::read;
use crate::{GPU, Set};
use glam::Vec3;
use serde_json::{Value, json};
use umbrage::visibility::Filter;
use umbrage::{Plan, Technique};
use umbrage_render::{Error, FrameTarget, Renderer, SceneBuffers, Shading};
use umbrage_scene::{Moved, Scene};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, ShadowOptions};

/// A binary glTF file under construction.
struct File {
    json: Value,
    bytes: Vec<u8>,
}

impl File {
    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Adds an accessor of numbers, `width` for each element.
    fn numbers(&mut self, kind: &str, width: usize, component: u32, bytes: &[u8]) -> usize {
        let view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()
        });
        self.bytes.extend(bytes);
        let view = self.push("bufferViews", view);
        let count = bytes.len() / 4 / width;
        let accessor = json!({
            "bufferView": view, "componentType": component, "count": count, "type": kind
        });
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, width: usize, values: &[f32]) -> usize {
        self.numbers(kind, width, 5126, bytemuck::cast_slice(values))
    }

    /// Adds a pyramid, 1 m high, of which a morph target moves the top.
    fn pyramid(&mut self) -> usize {
        let corners = [[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.5, 0.0, 0.5], [-0.5, 0.0, 0.5]];
        let [a, b, c, d] = corners;
        let top = [0.0, 1.0, 0.0];
        let sides = [[a, top, b], [b, top, c], [c, top, d], [d, top, a]].concat();
        let moved = sides.iter().map(|p| if *p == top { [0.4, 0.8, 0.2] } else { [0.0; 3] });
        let moved: Vec<[f32; 3]> = moved.collect();
        let positions = self.floats("VEC3", 3, sides.as_flattened());
        let target = self.floats("VEC3", 3, moved.as_flattened());
        let targets = json!([{"POSITION": target}]);
        let primitive = json!({"attributes": {"POSITION": positions}, "targets": targets});
        self.push("meshes", json!({"primitives": [primitive], "weights": [0]}))
    }

    /// Adds a flag, 2 m high, which hangs on two joints.
    fn flag(&mut self) -> usize {
        let corners: Vec<[f32; 3]> =
            (0..10).map(|i| [(i % 2) as f32 * 0.8, (i / 2) as f32 * 0.5, 0.0]).collect();
        let triangles: Vec<u32> = (0..8).flat_map(|i| [i, i + 1, i + 2]).collect();
        let normals = [[0.0f32, 0.0, 1.0]; 10];
        let share = |i: usize| (i / 2) as f32 / 4.0;
        let weights: Vec<[f32; 4]> =
            (0..10).map(|i| [1.0 - share(i), share(i), 0.0, 0.0]).collect();
        let joints = [[0u16, 1, 0, 0]; 10];
        let attributes = json!({
            "POSITION": self.floats("VEC3", 3, corners.as_flattened()),
            "NORMAL": self.floats("VEC3", 3, normals.as_flattened()),
            // Two numbers of 16 bits take four bytes.
            "JOINTS_0": self.numbers("VEC4", 2, 5123, bytemuck::cast_slice(&joints)),
            "WEIGHTS_0": self.floats("VEC4", 4, weights.as_flattened()),
        });
        let indices = self.numbers("SCALAR", 1, 5125, bytemuck::cast_slice(&triangles));
        let primitive = json!({"attributes": attributes, "indices": indices});
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    fn ground(&mut self) -> usize {
        let corners = [[-6.0, 0.0, -6.0], [-6.0, 0.0, 6.0], [6.0, 0.0, 6.0], [6.0, 0.0, -6.0]];
        let corners: [[f32; 3]; 4] = corners;
        let positions = self.floats("VEC3", 3, corners.as_flattened());
        let indices = self.numbers("SCALAR", 1, 5125, bytemuck::cast_slice(&[0u32, 1, 2, 0, 2, 3]));
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// A channel and its sampler, with keys at 0 s and 1 s.
    fn animate(&mut self, node: usize, path: &str, kind: &str, width: usize, values: &[f32]) {
        let times = self.floats("SCALAR", 1, &[0.0, 1.0]);
        let output = self.floats(kind, width, values);
        let animation = &mut self.json["animations"][0];
        let samplers = animation["samplers"].as_array_mut().unwrap();
        samplers.push(json!({"input": times, "output": output}));
        let sampler = samplers.len() - 1;
        let channel = json!({"sampler": sampler, "target": {"node": node, "path": path}});
        animation["channels"].as_array_mut().unwrap().push(channel);
    }

    fn load(mut self) -> Scene {
        self.json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut json = serde_json::to_vec(&self.json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((28 + json.len() as u32 + self.bytes.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("puppets.glb");
        std::fs::write(&path, glb).unwrap();
        umbrage_scene::load(&path).unwrap()
    }
}

/// On ground: a pyramid that flies and turns, one that shrinks to nothing at the end, one that a
/// morph target bends, and a flag of two joints.
fn puppets() -> Scene {
    let json = json!({
        "asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "meshes": [], "nodes": [],
        "animations": [{"channels": [], "samplers": []}]
    });
    let mut file = File { json, bytes: Vec::new() };
    let (pyramid, flag, ground) = (file.pyramid(), file.flag(), file.ground());
    file.push("nodes", json!({"mesh": ground}));
    let flying = file.push("nodes", json!({"mesh": pyramid, "translation": [-2, 0.5, 0]}));
    let shrinking = file.push("nodes", json!({"mesh": pyramid, "translation": [2, 0, 0]}));
    let bent = file.push("nodes", json!({"mesh": pyramid, "translation": [0, 0, -2]}));
    file.push("nodes", json!({"mesh": flag, "skin": 0}));
    let foot = file.push("nodes", json!({"translation": [0, 0.5, 1], "children": [6]}));
    let top = file.push("nodes", json!({"translation": [0, 1, 0]}));
    file.json["skins"] = json!([{"joints": [foot, top]}]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    file.animate(flying, "translation", "VEC3", 3, &[-2.0, 0.5, 0.0, -1.0, 1.5, 2.0]);
    file.animate(flying, "rotation", "VEC4", 4, &[0.0, 0.0, 0.0, 1.0, half, 0.0, 0.0, half]);
    file.animate(shrinking, "scale", "VEC3", 3, &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    file.animate(bent, "weights", "SCALAR", 1, &[0.0, 1.0]);
    file.animate(top, "rotation", "VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]);
    file.load()
}

/// A renderer's frame, and what of the maps was drawn for it: maps and triangles.
fn frame(
    renderer: &mut Renderer<'_>,
    set: &Set<'_>,
    plan: &Plan,
    casters: Casters<'_>,
) -> (Vec<[u8; 3]>, [u64; 2]) {
    let light = set.light();
    let drawn = renderer.draw_maps(plan, casters, None).unwrap();
    let triangles = drawn.iter().map(|(_, drawn)| drawn.triangles).sum();
    let target = FrameTarget::new(&GPU, set.camera.image()).unwrap();
    let shading = Shading { camera: &set.camera, light: &light, light_index: 0 };
    renderer.frame(&shading, &target, None).unwrap();
    (read(&target), [drawn.len() as u64, triangles])
}

#[needs(gpu)]
#[test]
fn a_posed_scene_is_drawn_as_if_it_were_uploaded_so() {
    let rest = puppets();
    let set = Set::new(&rest, [320, 180]);
    for technique in ["uniform@512", "lispsm+z2:pcf3@512", "uniform:vsm(blur=5)@512"] {
        let technique: Technique = technique.parse().unwrap();
        let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
        let plan = set.plan(&[set.light()], &technique);
        let mut posed = rest.clone();
        let buffers = SceneBuffers::new(&GPU, &posed, false).unwrap();
        let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
        let (still, _) = frame(&mut renderer, &set, &plan, Casters::Moved);
        for seconds in [0.3, 1.0, 0.9, 0.0] {
            let moved = posed.pose(Some(0), seconds);
            let boxes = buffers.pose(&GPU, &posed, &moved).unwrap();
            let what = format!("{technique} at {seconds} s");
            let (picture, partly) = frame(&mut renderer, &set, &plan, Casters::MovedIn(&boxes));
            let (whole, all) = frame(&mut renderer, &set, &plan, Casters::Moved);
            assert!(picture == whole, "{what}: parts and whole differ");
            assert!(partly[1] > 0 && partly[0] <= all[0], "{what}: {partly:?} of {all:?}");
            let afresh = SceneBuffers::new(&GPU, &posed, false).unwrap();
            let mut other = Renderer::new(&GPU, &afresh, &options).unwrap();
            let (expected, _) = frame(&mut other, &set, &plan, Casters::Moved);
            assert!(picture == expected, "{what}: differs from the scene uploaded afresh");
            assert_eq!(picture == still, seconds == 0.0, "{what}");
        }
        assert!(buffers.pose(&GPU, &posed, &posed.clone().pose(None, 0.0)).unwrap().is_empty());
    }
}

/// Pages follow poses without being told. Where what moves is kept apart, what stands still is drawn
/// once.
#[needs(gpu)]
#[test]
fn pages_follow_poses() {
    let rest = puppets();
    let set = Set::new(&rest, [320, 180]);
    for (text, pages_apart) in [("paged", false), ("paged", true), ("paged:pcf3", true)] {
        let technique: Technique = text.parse().unwrap();
        let filter = technique.filter;
        let options =
            ShadowOptions { filter, pages: true, pages_apart, ..ShadowOptions::default() };
        let plan = set.plan(&[set.light()], &technique);
        let mut posed = rest.clone();
        let buffers = page_buffers(&posed);
        let mut renderer = Renderer::new(&GPU, &buffers, &options).unwrap();
        let (still, _) = frame(&mut renderer, &set, &plan, Casters::Moved);
        for (k, seconds) in [0.3, 1.0, 0.9, 0.0].into_iter().enumerate() {
            let moved = posed.pose(Some(0), seconds);
            buffers.pose(&GPU, &posed, &moved).unwrap();
            let what = format!("{technique} at {seconds} s, apart: {pages_apart}");
            let (picture, _) = frame(&mut renderer, &set, &plan, Casters::Unmoved);
            let counts = renderer.page_counts().unwrap();
            assert!(0 < counts.drawn && counts.drawn < counts.wanted, "{what}: {counts:?}");
            // Where something moves for the first time, it was among what stands still. And pages
            // are new that only what moved is seen in.
            assert!(
                if pages_apart && k > 0 {
                    counts.apart * 4 > counts.drawn * 3
                } else {
                    counts.apart * 4 < counts.drawn
                },
                "{what}: {counts:?}"
            );
            let (again, _) = frame(&mut renderer, &set, &plan, Casters::Unmoved);
            assert_eq!(renderer.page_counts().unwrap().drawn, 0, "{what}");
            assert!(again == picture, "{what}: changes by itself");
            let (whole, _) = frame(&mut renderer, &set, &plan, Casters::Moved);
            assert!(picture == whole, "{what}: parts and whole differ");
            let afresh = page_buffers(&posed);
            let mut other = Renderer::new(&GPU, &afresh, &options).unwrap();
            let (expected, _) = frame(&mut other, &set, &plan, Casters::Moved);
            // Clusters and whole meshes round differently.
            let pairs = picture.iter().zip(&expected);
            let differ = pairs.filter(|(a, b)| a != b).count();
            assert!(differ * 1000 <= picture.len(), "{what}: {differ} pixels differ");
            let pairs = picture.iter().zip(&still);
            let moved = pairs.filter(|(a, b)| a != b).count();
            assert_eq!(moved * 1000 <= picture.len(), seconds == 0.0, "{what}: {moved} pixels");
        }
    }
}

/// Rays see the same pose.
#[needs(gpu)]
#[test]
fn a_posed_scene_has_the_shadows_of_the_reference() {
    let mut scene = puppets();
    for seconds in [0.4, 1.0] {
        scene.pose(Some(0), seconds);
        let set = Set::new(&scene, [240, 135]);
        for (text, filter) in [
            ("uniform@512", Filter::Hard),
            ("lispsm@512", Filter::Pcf { n: 3 }),
            ("paged", Filter::Hard),
        ] {
            let technique = Technique { filter, ..text.parse().unwrap() };
            agrees_with(&format!("puppets at {seconds} s"), &set, &technique);
        }
    }
}

#[needs(gpu)]
#[test]
fn poses_of_other_scenes_are_refused() {
    let scene = puppets();
    let buffers = SceneBuffers::new(&GPU, &scene, false).unwrap();
    let (mut more, mut other) = (scene.clone(), scene.clone());
    more.add_ground();
    other.meshes[0].positions.push(Vec3::ZERO);
    let moved = |instance, mesh| Moved {
        instances: vec![instance],
        meshes: vec![mesh],
        ..Moved::default()
    };
    for (scene, moved) in [
        (&more, moved(0, 0)),
        (&other, moved(0, 0)),
        (&scene, moved(99, 0)),
        (&scene, moved(0, 99)),
    ] {
        assert_eq!(buffers.pose(&GPU, scene, &moved), Err(Error::OtherScene));
    }
}
