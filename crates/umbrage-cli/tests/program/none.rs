//! The technique `none`: the same frames without shadows.

use crate::desk::Desk;
use umbrage_testing::needs;

#[test]
fn its_plan_has_no_maps() {
    let desk = Desk::new();
    let run = desk.run(&["plan", "pole", "--shadows", "none", "--json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let plan: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(plan["maps"].as_array().unwrap().is_empty());
    assert_eq!((&plan["texels"], &plan["lights"][0]["maps"]), (&0.into(), &[0, 0].into()));
    let uniform = desk.json(&["plan", "pole", "--shadows", "uniform", "--json"]);
    assert_eq!(plan["theta_deg"], uniform["theta_deg"]);
    let table = desk.succeed(&["plan", "pole", "--shadows", "none"]);
    assert!(table.contains("texels          0\nstorage factor  0.000000\n"), "{table}");
}

/// Every surface that faces the light is lit, and wrong are exactly the pixels that the truth has
/// in shadow.
#[needs(gpu)]
#[test]
fn its_wrong_pixels_are_those_in_shadow() {
    let desk = Desk::new();
    let common = ["--size", "96x54", "--samples", "1", "--shadows", "none"];
    let picture = |backend: &str, aov: &str| {
        let name = format!("{backend}-{aov}.png");
        let args = ["render", "fence", "-o", &name, "--aov", aov, "--backend", backend];
        desk.succeed(&[&args[..], &common].concat());
        image::open(desk.path(&name)).unwrap().to_luma8()
    };
    for backend in ["gpu", "reference"] {
        let [none, truth] = ["visibility", "truth"].map(|aov| picture(backend, aov));
        assert!(none.pixels().all(|p| [0, 255].contains(&p.0[0])));
        let dark = none.pixels().zip(truth.pixels()).filter(|(n, t)| n.0[0] > t.0[0]).count();
        assert!(dark > 20, "{dark} pixels in shadow");
        let folder = format!("report-{backend}");
        let args = ["compare", "fence", "-o", &folder, "--json", "--backend", backend];
        let report = desk.json(&[&args[..], &common].concat());
        let result = &report["results"][0];
        assert_eq!(result["shadows"], "none");
        assert_eq!([&result["maps"], &result["texels"], &result["bytes"]], [0, 0, 0]);
        assert!(result["error_px"]["max"].is_null(), "{result}");
        let counted = result["counted_pixels"].as_f64().unwrap();
        let wrong = result["wrong_fraction"].as_f64().unwrap() * counted;
        // The rasteriser's surfaces differ from those of rays in some pixels at edges.
        let slack = if backend == "gpu" { 0.03 * dark as f64 } else { 1e-6 };
        assert!((wrong - dark as f64).abs() <= slack, "{backend}: {wrong} of {dark}");
        let false_shadow = result["false_shadow"].as_f64().unwrap() * counted;
        assert!(false_shadow <= slack, "{backend}: {false_shadow} of {dark}");
    }
}
