//! `--fit`: maps for the box around a scene, for its surfaces, or for what is seen.

use crate::bad_input::refuses;
use crate::desk::{Desk, STAGE_GLTF};
use serde_json::{Value, json};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

#[test]
fn surfaces_take_fewer_texels_than_a_box_of_air() {
    let desk = Desk::new();
    let storage = |scene: &str, shadows: &str, fit: &[&str]| {
        let plan = ["plan", scene, "--shadows", shadows, "--json"];
        number(&desk.json(&[&plan[..], fit].concat())["storage_factor"])
    };
    for (scene, shadows, times) in [
        ("town", "adaptive", 4.0),
        ("lantern", "uniform", 4.0),
        ("statues", "adaptive+z4", 2.0),
        ("grove", "lispsm+face", 1.5),
    ] {
        let [air, surfaces] =
            ["box", "surfaces"].map(|fit| storage(scene, shadows, &["--fit", fit]));
        assert!(surfaces * times < air, "{scene}, {shadows}: {surfaces}, {air}");
        // What an engine gets that knows no more than its scene's box.
        assert_eq!(storage(scene, shadows, &[]), air);
    }
}

#[test]
fn maps_of_surfaces_are_less_wrong_and_know_their_casters() {
    let desk = Desk::new();
    let compare = |fit: &[&str]| {
        let town = ["compare", "town", "-o", "report", "--json", "--size", "96x54"];
        let shadows = ["--shadows", "uniform@256", "--shadows", "adaptive+z2@256"];
        let report = desk.json(&[&town[..], &shadows, fit].concat());
        [0, 1].map(|i| {
            let result = &report["results"][i];
            let culled = number(&result["casters_culled"]);
            assert!((0.0..=1.0).contains(&culled), "{result}");
            [number(&result["wrong_fraction"]), culled]
        })
    };
    let [air, surfaces] = [compare(&["--fit", "box"]), compare(&["--fit", "surfaces"])];
    assert_eq!(compare(&[]), surfaces);
    // An even map hardly gains: its width is that of the view's far end.
    let [[_, [wrong_air, _]], [[_, culled], [wrong, culled_of_slices]]] = [air, surfaces];
    assert!(wrong * 1.25 < wrong_air, "{air:?}, {surfaces:?}");
    // Each half of a street takes fewer houses than the whole.
    assert!(0.0 < culled && 2.0 * culled < culled_of_slices, "{surfaces:?}");

    // One triangle that casts into all there is.
    desk.write("stage.gltf", STAGE_GLTF);
    let stage = ["compare", "stage.gltf", "-o", "report", "--json", "--size", "32x18"];
    let report = desk.json(&[&stage[..], &["--shadows", "uniform@32"]].concat());
    assert_eq!(report["results"][0]["casters_culled"], 0.0);
}

#[test]
fn what_is_seen_takes_fewer_texels_than_what_is_there() {
    let desk = Desk::new();
    for (scene, shadows) in [("town", "adaptive"), ("lantern", "uniform")] {
        let storage = |fit: &str| {
            let plan = ["plan", scene, "--shadows", shadows, "--json", "--fit", fit];
            number(&desk.json(&plan)["storage_factor"])
        };
        let [surfaces, seen] = ["surfaces", "seen"].map(storage);
        assert!(seen < surfaces, "{scene}, {shadows}: {seen}, {surfaces}");
    }
    let town = ["compare", "town", "-o", "report", "--json", "--size", "96x54", "--fit", "seen"];
    for backend in ["reference", "auto"] {
        let shadows = ["--shadows", "adaptive@512", "--backend", backend];
        let report = desk.json(&[&town[..], &shadows].concat());
        let wrong = number(&report["results"][0]["wrong_fraction"]);
        assert!(wrong < 0.1, "{backend}: {wrong}");
    }
}

#[test]
fn a_sweep_goes_on_with_the_fit_it_began_with() {
    let desk = Desk::new();
    desk.write("views.json", &json!([{"name": "pole", "scene": "pole"}]).to_string());
    let sweep = ["sweep", "views.json", "-o", "out", "--size", "32x18", "--shadows", "uniform@32"];
    let with = |fit: &'static str| [&sweep[..], &["--fit", fit]].concat();
    desk.succeed(&sweep);
    refuses(&desk, &with("box"), "out holds another sweep: --fit was `surfaces`, is `box`");
    let first = std::fs::read(desk.path("out/results.json")).unwrap();
    desk.succeed(&with("surfaces"));
    assert_eq!(std::fs::read(desk.path("out/results.json")).unwrap(), first);
}

#[test]
fn fits_that_cannot_be() {
    let desk = Desk::new();
    refuses(&desk, &["plan", "pole", "--fit", "air"], "[possible values: box, surfaces, seen]");
    let view = ["plan", "--eye", "0,2,0", "--target", "0,2,-1", "--near", "1", "--far", "9"];
    for fit in ["surfaces", "seen"] {
        let fitted = [&view[..], &["--fit", fit]].concat();
        refuses(&desk, &fitted, "--fit: `surfaces` and `seen` need a SCENE");
    }
    desk.succeed(&[&view[..], &["--fit", "box"]].concat());
}
