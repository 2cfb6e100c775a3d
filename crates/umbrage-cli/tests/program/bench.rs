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
            assert_eq!(keys(&result["ms"]), ["depth", "filter", "frame", "plan", "seen", "shade"]);
            for stage in ["plan", "depth", "shade", "frame"] {
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
    assert!(told.starts_with("backend: reference, on the CPU (no GPU answers"), "{told}");
    std::fs::remove_file(desk.path("p.png")).unwrap();
    let gpu = run("gpu");
    assert_eq!(gpu.status.code(), Some(1));
    let told = String::from_utf8(gpu.stderr).unwrap();
    assert!(told.starts_with("umbrage: --backend: no GPU answers"), "{told}");
    assert!(desk.listing().is_empty());
}
