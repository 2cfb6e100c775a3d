//! A place to run the program in: an empty folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use umbrage_testing::third_party_scenes;

/// An empty folder, the program's working directory.
pub(crate) struct Desk {
    folder: tempfile::TempDir,
}

/// What a run of the program left behind.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_umbrage"));
        command.args(args).current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    pub(crate) fn run(&self, args: &[&str]) -> Run {
        let Output { status, stdout, stderr } = self.command(args).output().unwrap();
        Run {
            code: status.code().expect("ends by itself, not by a signal"),
            stdout: String::from_utf8(stdout).unwrap(),
            stderr: String::from_utf8(stderr).unwrap(),
        }
    }

    /// Runs what must succeed, and gives standard output.
    pub(crate) fn succeed(&self, args: &[&str]) -> String {
        let run = self.run(args);
        assert_eq!(run.code, 0, "{args:?}: {}", run.stderr);
        run.stdout
    }

    /// As [`succeed`](Self::succeed), with JSON on standard output and nothing else.
    pub(crate) fn json(&self, args: &[&str]) -> serde_json::Value {
        let text = self.succeed(args);
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{args:?}: {e}: {text}"))
    }

    /// Names of all files and folders, hidden ones too.
    pub(crate) fn listing(&self) -> Vec<String> {
        listing(self.folder.path())
    }
}

/// Names of all that is in a folder, sorted.
pub(crate) fn listing(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A file of the third-party scenes.
pub(crate) fn shared_scene(name: &str) -> String {
    let path = Path::new(third_party_scenes!()).join(name);
    let path = path.canonicalize().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    path.into_os_string().into_string().unwrap()
}

/// The keys of a JSON object, sorted.
pub(crate) fn keys(value: &serde_json::Value) -> Vec<&str> {
    let object = value.as_object().unwrap_or_else(|| panic!("an object, not {value}"));
    let mut keys: Vec<&str> = object.keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

/// A file with one large triangle on the ground, two cameras (`front`, `above`) and three lights
/// (`noon`, `torch`, `bulb`).
pub(crate) const STAGE_GLTF: &str = r#"{
  "asset": {"version": "2.0"},
  "extensionsUsed": ["KHR_lights_punctual"],
  "extensions": {"KHR_lights_punctual": {"lights": [
    {"type": "directional", "name": "noon", "intensity": 1000},
    {"type": "spot", "name": "torch", "intensity": 500, "range": 40, "spot": {"outerConeAngle": 0.6}},
    {"type": "point", "name": "bulb", "intensity": 500}
  ]}},
  "scene": 0,
  "scenes": [{"nodes": [0, 1, 2, 3, 4, 5]}],
  "nodes": [
    {"mesh": 0},
    {"name": "front", "camera": 0, "translation": [0, 2, 8]},
    {"name": "above", "camera": 0, "translation": [0, 9, 0], "rotation": [-0.70710678, 0, 0, 0.70710678]},
    {"rotation": [-0.70710678, 0, 0, 0.70710678], "extensions": {"KHR_lights_punctual": {"light": 0}}},
    {"translation": [0, 6, 0], "rotation": [-0.70710678, 0, 0, 0.70710678],
     "extensions": {"KHR_lights_punctual": {"light": 1}}},
    {"translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 2}}}
  ],
  "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1, "zfar": 50}}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [-8, 0, -8], "max": [8, 0, 8]}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "buffers": [{"byteLength": 36, "uri":
    "data:application/octet-stream;base64,AAAAwQAAAAAAAABBAAAAQQAAAAAAAABBAAAAAAAAAAAAAADB"}]
}"#;
