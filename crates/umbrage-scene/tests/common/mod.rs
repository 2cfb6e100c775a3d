//! Small glTF files made by hand.
#![allow(dead_code, reason = "each test binary uses its share")]

use glam::Vec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use umbrage_scene::{Scene, SceneError, load, load_within};

/// Sine and cosine of 45°, which quaternions of a quarter turn consist of.
pub(crate) const QUARTER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A file under construction: JSON, and one buffer beside it.
pub(crate) struct File {
    pub(crate) json: Value,
    pub(crate) buffer: Vec<u8>,
}

impl File {
    /// One triangle with corners (0,0,0), (1,0,0) and (0,1,0), normals +z and texture coordinates
    /// equal to x and y, on one node.
    pub(crate) fn triangle() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3
            }]}],
            "accessors": [],
            "bufferViews": [],
        });
        let mut file = Self { json, buffer: Vec::new() };
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        file.floats("VEC3", &corners.concat());
        file.floats("VEC3", &[[0.0, 0.0, 1.0]; 3].concat());
        file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        file.u16s("SCALAR", &[0, 1, 2]);
        file
    }

    /// Adds an accessor; returns its index.
    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        self.accessor(kind, 5126, values.len(), &bytes)
    }

    pub(crate) fn u16s(&mut self, kind: &str, values: &[u16]) -> usize {
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        self.accessor(kind, 5123, values.len(), &bytes)
    }

    pub(crate) fn accessor(&mut self, kind: &str, component: u32, n: usize, bytes: &[u8]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({
                "bufferView": view, "componentType": component, "count": n / width, "type": kind
            }),
        )
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.buffer.len();
        self.buffer.extend(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.push(
            "bufferViews",
            json!({
                "buffer": 0, "byteOffset": offset, "byteLength": bytes.len()
            }),
        )
    }

    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Sets the value at a JSON pointer whose parent exists.
    pub(crate) fn set(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = self.json.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer}"));
        match parent.as_array_mut() {
            Some(list) => list[key.parse::<usize>().unwrap()] = value,
            None => parent[key] = value,
        }
        self
    }

    pub(crate) fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    pub(crate) fn with_buffer(mut self, uri: Option<&str>, length: usize) -> Self {
        self.json["buffers"] = json!([{"byteLength": length}]);
        if let Some(uri) = uri {
            self.json["buffers"][0]["uri"] = json!(uri);
        }
        self
    }

    /// Writes the file as `.gltf` with its buffer beside it.
    pub(crate) fn write(self, folder: &Path) -> PathBuf {
        let length = self.buffer.len();
        std::fs::write(folder.join("a buffer.bin"), &self.buffer).unwrap();
        let path = folder.join("scene.gltf");
        let json = self.with_buffer(Some("a%20buffer.bin"), length).json;
        std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        path
    }

    pub(crate) fn glb(self) -> Vec<u8> {
        let buffer = self.buffer.clone();
        let mut json = serde_json::to_vec(&self.with_buffer(None, buffer.len()).json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        glb
    }

    pub(crate) fn load(self) -> Result<Scene, SceneError> {
        let folder = TempDir::new().unwrap();
        load(&self.write(folder.path()))
    }

    /// Loads the file with at most `limit` bytes of memory.
    pub(crate) fn load_within(self, limit: u64) -> Result<Scene, SceneError> {
        let folder = TempDir::new().unwrap();
        load_within(&self.write(folder.path()), limit)
    }

    /// The message of the error that loading gives, after the file's name.
    pub(crate) fn error(self) -> String {
        let folder = TempDir::new().unwrap();
        let path = self.write(folder.path());
        let error = load(&path).expect_err("must not load").to_string();
        let rest = error.strip_prefix(&format!("{}: ", path.display()));
        rest.unwrap_or_else(|| panic!("{error}: does not begin with the file")).to_owned()
    }
}

pub(crate) fn notices(scene: &Scene) -> Vec<&str> {
    scene.notices.iter().map(|n| n.0.as_str()).collect()
}

pub(crate) fn png(pixels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let height = pixels.len() as u32 / width;
    let image = image::RgbaImage::from_raw(width, height, pixels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The triangle with a texture whose left half is transparent and whose right half is red.
pub(crate) fn masked() -> File {
    let mut file = File::triangle();
    let view = file.view(&png(&[[255, 0, 0, 0], [255, 0, 0, 255]], 2));
    file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    file.push("samplers", json!({"wrapS": 33071, "wrapT": 33648}));
    file.push("textures", json!({"source": 0, "sampler": 0}));
    file.push(
        "materials",
        json!({
            "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": {"index": 0}
            }
        }),
    );
    file.primitive()["material"] = json!(0);
    file
}

/// The triangle at the origin, and twice as large 5 m beside it, by the instancing extension.
pub(crate) fn instanced() -> File {
    let mut file = File::triangle();
    let at = file.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    let scale = file.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {
        "attributes": {"TRANSLATION": at, "SCALE": scale}
    }});
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file
}

/// A triangle, and a node 10 m above it that has each of `lights`.
pub(crate) fn lit_by(lights: &Value) -> File {
    let nodes: Vec<usize> = (0..=lights.as_array().unwrap().len()).collect();
    let mut file = File::triangle().set("/scenes/0/nodes", json!(nodes));
    for light in &nodes[1..] {
        file.push(
            "nodes",
            json!({
                "extensions": {"KHR_lights_punctual": {"light": light - 1}},
                "translation": [0, 10, 0]
            }),
        );
    }
    file.set("/extensions", json!({"KHR_lights_punctual": {"lights": lights}}))
}

/// The triangle between two joints, a million metres away.
pub(crate) fn skinned() -> File {
    let mut file = File::triangle();
    let joints = file.u16s("VEC4", &[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0]);
    let weights =
        file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let identity = glam::Mat4::IDENTITY.to_cols_array();
    let lowered = glam::Mat4::from_translation(-Vec3::Y).to_cols_array();
    let binds = file.floats("MAT4", &[identity, lowered].concat());
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    file.push("skins", json!({"joints": [1, 2], "inverseBindMatrices": binds}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    // The transform of the skinned node itself must be ignored.
    file.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [1000000, 0, 0], "children": [2]},
        {"translation": [0, 1, 0], "rotation": [0, 0, QUARTER, QUARTER]},
    ]);
    file
}
