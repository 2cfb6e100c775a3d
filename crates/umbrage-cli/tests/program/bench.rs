//! `umbrage bench` and `umbrage devices`.

use crate::desk::{Desk, keys};
use umbrage_testing::needs;

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

#[needs(gpu)]
#[test]
fn every_stage_has_its_times() {
    let desk = Desk::new();
    for backend in ["gpu", "reference"] {
        let command = format!(
            "bench pole --size 48x27 --json --backend {backend} --shadows uniform@64 --shadows lispsm+z3:pcf3@64"
        );
        let json = desk.json(&words(&command));
        assert_eq!(json["frames"], 20);
        let results = json["results"].as_array().unwrap();
        assert_eq!(results.len(), 2);
        for (result, maps) in results.iter().zip([1, 3]) {
            assert_eq!(result["backend"], backend);
            assert_eq!(result["maps"], maps);
            assert_eq!(result["map_draws"].as_array().unwrap().len(), maps);
            assert!(result["map_draws"][0]["triangles"].as_u64().unwrap() > 0);
            assert!(result["bytes"].as_u64().unwrap() >= 4 * result["texels"].as_u64().unwrap());
            let stages = [
                "cpu",
                "depth",
                "filter",
                "frame",
                "pages",
                "plan",
                "prepass",
                "seen",
                "shade",
                "shade_none",
            ];
            assert_eq!(keys(&result["ms"]), stages);
            assert!(result["ms"]["pages"].is_null() && result["ms"]["prepass"].is_null());
            for stage in ["plan", "depth", "shade", "shade_none", "frame"] {
                let spread = &result["ms"][stage];
                let [min, median, max] =
                    ["min", "median", "max"].map(|f| spread[f].as_f64().unwrap());
                assert!(0.0 < min && min <= median && median <= max, "{stage}: {spread}");
            }
            assert!(result["ms"]["filter"].is_null());
        }
        assert_eq!(results[1]["shadows"], "lispsm+z3:pcf3@64");
    }
}

fn median(spread: &serde_json::Value) -> f64 {
    spread["median"].as_f64().unwrap()
}

/// The cost is a difference to frames without shadows, which are drawn whether they are asked for
/// or not, by the same backend as the technique.
#[needs(gpu)]
#[test]
fn costs_are_differences_to_frames_without_shadows() {
    let desk = Desk::new();
    let command = "bench pole --size 48x27 --shadows lispsm@64 --shadows log@64";
    let table = desk.succeed(&words(command));
    let rows: Vec<&str> = table.lines().map(|l| l.split_whitespace().next().unwrap()).collect();
    assert_eq!(rows, ["median", "lispsm@64", "log@64", "none", "log:none"], "{table}");
    let json = desk.json(&[&words(command)[..], &["--json"]].concat());
    assert_eq!(json["results"].as_array().unwrap().len(), 2);
    let backends = [0, 1].map(|i| json["results"][i]["backend"].as_str().unwrap().to_owned());
    assert_eq!(backends, ["gpu", "reference"]);
    for result in json["results"].as_array().unwrap() {
        let ms = &result["ms"];
        // The bounds of a sum lie within the sums of its terms' bounds.
        let sum = |least: &str, most: &str| {
            let of = |stage: &str| ms[stage][least].as_f64().unwrap();
            of("plan") + of("depth") + of("shade") - ms["shade_none"][most].as_f64().unwrap()
        };
        let cost = median(&result["cost"]);
        let [least, most] = [sum("min", "max"), sum("max", "min")];
        assert!((least..=most).contains(&cost), "{result}");
    }
    let command = "bench pole --size 48x27 --json --shadows none --shadows lispsm@64";
    let json = desk.json(&words(command));
    let none = &json["results"][0];
    assert_eq!(json["results"].as_array().unwrap().len(), 2);
    assert_eq!(none["cost"], none["ms"]["plan"]);
    assert_eq!([&none["maps"], &none["texels"], &none["bytes"]], [0, 0, 0]);
    assert_eq!(none["ms"]["shade"], json["results"][1]["ms"]["shade_none"]);
}

#[needs(gpu)]
#[test]
fn what_stands_still_has_no_depth_pass() {
    let desk = Desk::new();
    let command = "bench pole --size 48x27 --still --backend gpu --shadows adaptive+z2@64";
    let json = desk.json(&[&words(command)[..], &["--json"]].concat());
    let result = &json["results"][0];
    assert_eq!(result["ms"]["depth"]["max"], 0.0);
    assert!(result["first_ms"]["depth"].as_f64().unwrap() > 0.0);
    let table = desk.succeed(&words(command));
    assert!(table.starts_with("median ms of") && table.contains("adaptive+z2@64"), "{table}");
}

#[needs(gpu)]
#[test]
fn devices_say_what_they_can_do() {
    let desk = Desk::new();
    let json = desk.json(&["devices", "--json"]);
    let first = &json.as_array().unwrap()[0];
    assert!(first["problem"].is_null(), "{first}");
    assert!(first["max_side"].as_u64().unwrap() >= 8192);
    let table = desk.succeed(&["devices"]);
    assert!(table.contains(first["name"].as_str().unwrap()), "{table}");
    // Another backend has none.
    let none = desk.command(&["devices"]).env("WGPU_BACKEND", "metal").output().unwrap();
    assert!(String::from_utf8(none.stdout).unwrap().starts_with("no GPU answers"));
}

/// Without a GPU `auto` goes on by itself, and `gpu` says what is missing.
#[test]
fn without_a_gpu_there_is_the_reference() {
    let desk = Desk::new();
    let run = |backend| {
        let command = ["render", "pole", "--size", "8x8", "-o", "p.png", "--backend", backend];
        desk.command(&command).env("WGPU_BACKEND", "metal").output().unwrap()
    };
    let auto = run("auto");
    assert!(auto.status.success());
    let told = String::from_utf8(auto.stderr).unwrap();
    assert!(told.contains("\nbackend: reference, on the CPU (no GPU answers"), "{told}");
    std::fs::remove_file(desk.path("p.png")).unwrap();
    let gpu = run("gpu");
    assert_eq!(gpu.status.code(), Some(1));
    let told = String::from_utf8(gpu.stderr).unwrap();
    assert!(told.starts_with("umbrage: --backend: no GPU answers"), "{told}");
    assert!(desk.listing().is_empty());
}
