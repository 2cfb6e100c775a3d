//! Whoever waits is told how far a job is, and which field is to blame.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use umbrage_lab::{
    Backend, Comparison, ComparisonOptions, Detail, DetailOptions, Executors, Fit, LightOptions,
    Motion, PreparedScene, Progress, SceneOptions, SweepOptions, ViewOptions, open_scene, sweep,
};

/// Remembers what it is told.
#[derive(Default)]
struct Memory {
    rows: AtomicU64,
    told: Mutex<Vec<String>>,
}

impl Memory {
    fn keep(&self, words: String) {
        self.told.lock().unwrap().push(words);
    }
}

impl Progress for Memory {
    fn parts(&self, count: u64) {
        self.keep(format!("{count} parts"));
    }

    fn part(&self, name: &str) {
        self.keep(name.to_owned());
    }

    fn advance(&self, rows: u64) {
        self.rows.fetch_add(rows, Ordering::Relaxed);
    }

    fn failed(&self, view: &str, error: &str) {
        self.keep(format!("{view}: {error}"));
    }
}

fn options() -> ComparisonOptions {
    let techniques = ["uniform@32", "log@32"].map(|text| text.parse().unwrap());
    ComparisonOptions { techniques: techniques.to_vec(), samples: 2, light_size: None }
}

#[test]
fn every_row_that_is_announced_is_told() {
    let options = options();
    let scene = open_scene(Path::new(""), "pole", &SceneOptions::default()).unwrap();
    let executors = Executors::open(Backend::Reference, &options.techniques).unwrap();
    let prepared = PreparedScene::new(&scene, &executors, false, Fit::Box, &Detail::FULL).unwrap();
    let view = ViewOptions { size: [32, 18], ..ViewOptions::default() };
    let comparison = Comparison::new(&prepared, &view, &LightOptions::default(), &options).unwrap();
    let memory = Memory::default();
    let mut compared = comparison.trace(&memory).unwrap();
    compared.move_on(Motion::Away, 2, &memory).unwrap();
    let folder = tempfile::tempdir().unwrap();
    compared.write(folder.path(), "a test", &memory).unwrap();
    let announced = comparison.rows() + comparison.rows_of_motion(Motion::Away, 2);
    assert_eq!(memory.rows.into_inner(), announced);
}

#[test]
fn a_sweep_names_its_parts_and_what_failed() {
    let folder = tempfile::tempdir().unwrap();
    let views = folder.path().join("views.json");
    let text = r#"[{"name": "a", "scene": "pole", "size": [16, 9]},
        {"name": "b", "scene": "pole", "near": 5, "far": 4},
        {"name": "c", "scene": "pole", "light": "moon"},
        {"name": "d", "scene": "pole"}]"#;
    std::fs::write(&views, text).unwrap();
    let options = SweepOptions {
        views,
        output: folder.path().join("out"),
        scenes: None,
        comparison: options(),
        max_error: None,
        fit: Fit::Box,
        backend: Backend::Reference,
        detail: DetailOptions::default(),
        opaque: false,
        scene: SceneOptions::default(),
        size: [32, 18],
        command: "a test".to_owned(),
        words: |field| field.to_string(),
    };
    let memory = Memory::default();
    let swept = sweep(&options, None, &memory).unwrap();
    assert!(swept.views[0].outcome.is_ok());
    assert_eq!(
        memory.told.into_inner().unwrap(),
        [
            "4 parts",
            "1/4 a",
            "2/4 b",
            "b: far: must exceed near (5), is 4",
            "3/4 c",
            "c: light: the scene has no light `moon`; there are sun or #1",
            "4/4 d",
        ]
    );
}
