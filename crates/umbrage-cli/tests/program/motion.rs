//! `compare --motion`: shadows that change from frame to frame where the truth does not.

use crate::bad_input::refuses;
use crate::desk::{Desk, STAGE_GLTF, shared_scene};
use serde_json::{Value, json};
use umbrage_testing::needs;

const TECHNIQUES: [&str; 8] = [
    "--shadows",
    "uniform@256",
    "--shadows",
    "adaptive@256",
    "--shadows",
    "uniform(stable)@256",
    "--shadows",
    "uniform(stable)+z3@256",
];

/// A report on a street, small enough to be quick.
fn compare(desk: &Desk, more: &[&str]) -> Value {
    let street = ["compare", "town", "-o", "report", "--json", "--size", "96x54"];
    desk.json(&[&street[..], &TECHNIQUES, more].concat())
}

fn flicker(report: &Value) -> Vec<f64> {
    let results = report["results"].as_array().unwrap();
    results.iter().map(|r| r["flicker"].as_f64().unwrap_or_else(|| panic!("{r}"))).collect()
}

#[test]
fn stable_maps_hardly_flicker_while_the_viewer_moves() {
    let desk = Desk::new();
    for motion in ["dolly", "orbit"] {
        let report = compare(&desk, &["--motion", motion, "--frames", "4"]);
        assert_eq!(report["motion"], json!({"kind": motion, "frames": 4}));
        let [uniform, adaptive, stable, slices] = flicker(&report)[..] else { panic!("{report}") };
        assert!(uniform > 0.02 && adaptive > 0.02, "{motion}: {uniform}, {adaptive}");
        assert!(stable < 0.002 && slices < 0.002, "{motion}: {stable}, {slices}");
    }
}

/// Under a light that turns, maps of every kind turn: then even what stands still in the world
/// flickers.
#[test]
fn a_sun_that_moves_makes_stable_slices_flicker() {
    let desk = Desk::new();
    let report = compare(&desk, &["--motion", "sun", "--frames", "3"]);
    assert_eq!(report["motion"], json!({"kind": "sun", "frames": 3}));
    let flicker = flicker(&report);
    assert!(flicker.iter().all(|f| (0.0..0.2).contains(f)), "{flicker:?}");
    assert!(flicker[0] > 0.01 && flicker[3] > 0.01, "{flicker:?}");
}

#[test]
fn flicker_is_told_where_something_moves() {
    let desk = Desk::new();
    let untimed = |mut report: Value| {
        report.as_object_mut().unwrap().remove("motion");
        report.as_object_mut().unwrap().remove("truth");
        for result in report["results"].as_array_mut().unwrap() {
            result.as_object_mut().unwrap().remove("ms");
            result.as_object_mut().unwrap().remove("flicker");
        }
        report
    };
    let page = || std::fs::read_to_string(desk.path("report/index.html")).unwrap();
    let still = compare(&desk, &[]);
    assert!(still["motion"].is_null());
    assert!(still["results"].as_array().unwrap().iter().all(|r| r["flicker"].is_null()), "{still}");
    assert!(!page().contains("Flicker") && !page().contains("<dt>Motion</dt>"));

    let moving = compare(&desk, &["--motion", "orbit", "--frames", "2"]);
    assert_eq!(flicker(&moving).len(), 4);
    assert!(page().contains("<dt>Flicker</dt>"));
    assert!(page().contains("<dt>Motion</dt><dd>orbit, 2 frames</dd>"));
    // All else is the first frame's, which is the view as told.
    assert_eq!(untimed(still), untimed(moving));
}

/// Where nothing that is seen faces the light, nothing flickers and nothing does not.
#[test]
fn nothing_to_compare_is_no_figure() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let up = ["compare", "stage.gltf", "-o", "report", "--json", "--sun", "0,1,0"];
    let small =
        ["--size", "32x18", "--shadows", "uniform@32", "--motion", "orbit", "--frames", "2"];
    let report = desk.json(&[&up[..], &small].concat());
    assert!(report["results"][0]["flicker"].is_null());
    assert_eq!(report["motion"]["frames"], 2);
}

#[test]
fn motions_that_cannot_be() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let small =
        ["compare", "stage.gltf", "-o", "report", "--size", "16x9", "--shadows", "uniform@16"];
    for (options, expected) in [
        (&["--frames", "3"][..], "--motion"),
        (&["--motion", "orbit", "--frames", "1"], "--frames <N>': 1 is not in 2..=1000"),
        (&["--motion", "orbit", "--frames", "1001"], "2..=1000"),
        (&["--motion", "orbit", "--frames", "many"], "--frames"),
        (&["--motion", "spin"], "[possible values: dolly, orbit, sun, away]"),
        (&["--motion"], "--motion"),
    ] {
        refuses(&desk, &[&small[..], options].concat(), expected);
    }
    let lit = [&small[..], &["--light", "bulb", "--motion", "sun"]].concat();
    refuses(&desk, &lit, "--motion: a point light has no direction to turn");
    // What does not move at all may be asked for: this torch points straight down.
    let torch = [&small[..], &["--json", "--light", "torch", "--motion", "sun"]].concat();
    assert_eq!(desk.json(&torch)["results"][0]["flicker"], 0.0);
}

/// A forest far away, where many texels fall into a pixel (Annen et al. 2007, Fig. 10): numbers
/// filtered as wide as the pixel sparkle a third of what bilinear comparisons do at most.
#[needs(scenes)]
#[test]
fn filtered_numbers_do_not_sparkle_where_comparisons_do() {
    let desk = Desk::new();
    let forest = shared_scene("trees/forest_eztree.glb");
    let report = desk.json(&[
        "compare",
        &forest,
        "-o",
        "report",
        "--json",
        "--size",
        "120x68",
        "--eye",
        "-178,178,400",
        "--target",
        "0,16,-4",
        "--near",
        "50",
        "--far",
        "900",
        "--motion",
        "away",
        "--frames",
        "4",
        "--shadows",
        "uniform:pcf2@2048",
        "--shadows",
        "uniform:csm8(blur=1.5px)@2048",
    ]);
    let noise = |i: usize| report["results"][i]["noise"].as_f64().unwrap();
    assert!(noise(0) > 0.02 && noise(1) < noise(0) / 3.0, "{} {}", noise(0), noise(1));
}

#[test]
fn noise_has_a_picture() {
    let desk = Desk::new();
    let render = |technique: &str| {
        let said = desk.run(&[
            "render",
            "grove",
            "-o",
            "noise.exr",
            "--aov",
            "minification",
            "--size",
            "48x27",
            "--shadows",
            technique,
        ]);
        let text = said.stderr;
        let line =
            text.lines().find(|l| l.starts_with("noise: ")).unwrap_or_else(|| panic!("{text}"));
        line.split(' ').nth(1).unwrap().parse::<f64>().unwrap()
    };
    let [hard, soft] = [render("uniform@512"), render("uniform:csm8(blur=2px)@512")];
    assert!(soft < hard, "{soft} {hard}");
    assert!(desk.path("noise.exr").exists());
}
