use crate::desk::{Desk, keys, listing, shared_scene};
use serde_json::Value;
use umbrage_testing::needs;

const SMALL: [&str; 2] = ["--size", "96x54"];

#[needs(gpu)]
#[test]
fn the_report_has_all_that_is_documented() {
    let desk = Desk::new();
    let json = desk.json(
        &[
            &[
                "compare",
                "pole",
                "-o",
                "report",
                "--json",
                "--shadows",
                "uniform@64",
                "--shadows",
                "lispsm:pcf3@64x32",
            ],
            &SMALL[..],
        ]
        .concat(),
    );
    let file: Value =
        serde_json::from_str(&std::fs::read_to_string(desk.path("report/report.json")).unwrap())
            .unwrap();
    assert_eq!(json, file);
    assert_eq!(keys(&json), ["light", "results", "scene", "size", "truth", "view"]);
    assert_eq!(json["scene"], "pole");
    assert_eq!(json["size"], serde_json::json!([96, 54]));
    assert_eq!(json["truth"]["rays_per_pixel"], 1);
    assert!(json["truth"]["seconds"].as_f64().unwrap() > 0.0);
    let results = json["results"].as_array().unwrap();
    assert_eq!(results.len(), 2);
    assert_eq!(results[0]["shadows"], "uniform@64");
    assert_eq!(results[1]["shadows"], "lispsm:pcf3@64x32");
    assert_eq!(results[1]["texels"], 64 * 32);
    for result in results {
        assert_eq!(result["backend"], "gpu");
        assert!(!result["device"].as_str().unwrap().is_empty());
        assert_eq!(result["maps"], 1);
        for figure in ["wrong_fraction", "mean_abs_error", "light_error", "flip", "storage_factor"]
        {
            assert!(result[figure].as_f64().unwrap() >= 0.0, "{figure}");
        }
        assert!(result.get("truth").is_none(), "there is only one truth");
        for error in ["error_px", "perspective_px"] {
            let [p50, p95, max] = ["p50", "p95", "max"].map(|p| result[error][p].as_f64().unwrap());
            assert!(0.0 < p50 && p50 <= p95 && p95 <= max, "{error}: {result}");
        }
        assert_eq!(keys(&result["ms"]), ["depth", "filter", "plan", "shade"]);
        for stage in ["plan", "depth", "shade"] {
            assert!(result["ms"][stage].as_f64().unwrap() > 0.0, "{stage}");
        }
    }
    // 64² texels are too few for this view, but not for anyone to call it wrong everywhere.
    let wrong = results[0]["wrong_fraction"].as_f64().unwrap();
    assert!((1e-4..0.3).contains(&wrong), "{wrong}");

    let names = listing(&desk.path("report"));
    let pngs: Vec<&String> = names.iter().filter(|n| n.ends_with(".png")).collect();
    assert!(names.iter().any(|n| n == "index.html"));
    let page = std::fs::read_to_string(desk.path("report/index.html")).unwrap();
    for png in &pngs {
        let picture = image::open(desk.path("report").join(png)).unwrap();
        assert_eq!((picture.width(), picture.height()), (96, 54), "{png}");
        assert!(page.contains(png.as_str()), "{png}");
    }
    for shown in ["truth-color", "uniform-64-difference", "lispsm-pcf3-64x32-error"] {
        assert!(pngs.iter().any(|n| n.contains(shown)), "{shown}: {pngs:?}");
    }
    for loads in ["src=\"http", "href=\"http", "url(http", "@import"] {
        assert!(!page.contains(loads), "the page must open offline, not load {loads}");
    }
    assert_eq!(desk.listing(), ["report"]);
}

#[test]
fn the_figures_are_those_of_the_pictures() {
    let desk = Desk::new();
    let view = ["pole", "--size", "160x90", "--shadows", "uniform@48"];
    let json = desk.json(&[&["compare", "-o", "report", "--json"], &view[..]].concat());
    let luma = |path: &str| image::open(desk.path(path)).unwrap().to_luma8();
    let (truth, map) =
        (luma("report/truth-visibility.png"), luma("report/01-uniform-48-visibility.png"));
    let wrong =
        truth.pixels().zip(map.pixels()).filter(|(t, m)| t.0[0].abs_diff(m.0[0]) > 127).count();
    let result = &json["results"][0];
    let counted = result["counted_pixels"].as_f64().unwrap();
    assert!(wrong > 0);
    assert_eq!(result["wrong_fraction"].as_f64().unwrap(), wrong as f64 / counted);
    // Another command, the same picture.
    let render = ["render", "-o", "v.png", "--aov", "visibility", "--samples", "1"];
    desk.succeed(&[&render[..], &view[..]].concat());
    assert_eq!(luma("v.png"), map);
    desk.succeed(
        &[&["render", "-o", "t.png", "--aov", "truth", "--samples", "1"], &view[..]].concat(),
    );
    assert_eq!(luma("t.png"), truth);
}

#[test]
fn soft_techniques_are_measured_against_a_light_with_a_size() {
    let desk = Desk::new();
    let view = ["pole", "--size", "96x54", "--backend", "reference", "--json"];
    let techniques = ["--shadows", "adaptive@512", "--shadows", "adaptive:pcss(light=6deg)@512"];
    let compare = |folder: &str, more: &[&str]| {
        desk.json(&[&["compare", "-o", folder], &view[..], &techniques, more].concat())
    };
    let hard = compare("hard", &[]);
    let soft = compare("soft", &["--light-size", "6deg"]);
    let truth = &soft["truth"];
    assert_eq!(truth["light_size"], "6deg");
    let error = truth["standard_error"].as_f64().unwrap();
    assert!(0.0 < error && error < 1.0 / 255.0, "{error}");
    assert!(truth["shadow_rays_per_pixel"].as_f64().unwrap() > 10.0);
    assert_eq!([&soft["results"][0]["truth"], &soft["results"][1]["truth"]], ["point", "area"]);
    let mean = |json: &Value, i: usize| json["results"][i]["light_error"].as_f64().unwrap();
    assert_eq!(mean(&hard, 0), mean(&soft, 0), "a hard technique has the same truth as ever");
    // Softness is no error any more.
    assert!(mean(&soft, 1) < 0.5 * mean(&hard, 1), "{} {}", mean(&soft, 1), mean(&hard, 1));
    // The page shows the soft truth, which is that of `render`.
    let render = ["render", "pole", "-o", "t.png", "--aov", "truth", "--samples", "1"];
    desk.succeed(&[&render[..], &["--size", "96x54", "--light-size", "6deg"]].concat());
    let luma = |path: &str| image::open(desk.path(path)).unwrap().to_luma8();
    let truth = luma("soft/truth-visibility.png");
    assert_eq!(luma("t.png"), truth);
    let between = truth.pixels().filter(|p| (20..236).contains(&p.0[0])).count();
    assert!(between > 20, "{between} pixels in the penumbra");
}

#[test]
fn more_texels_are_less_wrong() {
    let desk = Desk::new();
    let json = desk.json(
        &[
            &[
                "compare",
                "pole",
                "-o",
                "r",
                "--json",
                "--shadows",
                "uniform@32",
                "--shadows",
                "uniform@256",
                "--shadows",
                "uniform@2048",
            ],
            &SMALL[..],
        ]
        .concat(),
    );
    let wrong: Vec<f64> = json["results"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["wrong_fraction"].as_f64().unwrap())
        .collect();
    assert!(wrong[0] > wrong[1] && wrong[1] >= wrong[2], "{wrong:?}");
    assert!(wrong[2] < 0.01, "{wrong:?}");
}

/// What is compared if not told.
const DEFAULT: [&str; 7] =
    ["uniform", "psm", "lispsm", "tsm", "adaptive", "uniform(stable)+z4:pcf3", "adaptive:pcf3"];

#[test]
fn the_table_lists_every_technique_and_the_report() {
    let desk = Desk::new();
    let table = desk.succeed(&["compare", "pole", "-o", "report", "--size", "32x18"]);
    for technique in DEFAULT {
        assert!(table.lines().any(|l| l.starts_with(technique)), "{table}");
    }
    assert!(table.contains("comes out best: a light error of "), "{table}");
    assert!(table.contains("Judged by the light error"), "{table}");
    assert!(table.ends_with("report: report/index.html\n"), "{table}");
}

#[test]
fn a_former_report_is_replaced_and_nothing_else() {
    let desk = Desk::new();
    let run = |shadows| {
        desk.run(&["compare", "pole", "-o", "report", "--size", "16x9", "--shadows", shadows])
    };
    assert_eq!(run("psm@16").code, 0);
    assert_eq!(run("uniform@16").code, 0);
    let names = listing(&desk.path("report"));
    assert!(
        names.iter().any(|n| n.contains("uniform")) && !names.iter().any(|n| n.contains("psm")),
        "{names:?}"
    );

    desk.write("report/thesis.tex", "precious");
    let refused = run("lispsm@16");
    assert_ne!(refused.code, 0);
    assert!(refused.stderr.contains("thesis.tex"), "{}", refused.stderr);
    assert_eq!(std::fs::read_to_string(desk.path("report/thesis.tex")).unwrap(), "precious");
    assert_eq!(listing(&desk.path("report")).len(), names.len() + 1);
    assert_eq!(desk.listing(), ["report"]);
}

#[test]
fn an_empty_folder_is_taken() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("report")).unwrap();
    desk.succeed(&[
        "compare",
        "pole",
        "-o",
        "report/",
        "--size",
        "16x9",
        "--shadows",
        "uniform@16",
    ]);
    assert!(desk.path("report/index.html").is_file());
}

/// Specifications that say how many texels they have keep them; the others take what the error
/// needs.
#[test]
fn a_largest_error_decides_the_texels() {
    let desk = Desk::new();
    let compare = "compare pole -o report --shadows uniform@64 --shadows lispsm+z2 --size 96x54 \
                   --max-error";
    let texels = |pixels: &str| {
        let words: Vec<&str> = compare.split_whitespace().chain([pixels, "--json"]).collect();
        let json = desk.json(&words);
        let [told, sized] = [0, 1].map(|i| json["results"][i]["texels"].as_u64().unwrap());
        assert!((4000..=64 * 64).contains(&told), "{told}");
        assert_eq!(json["results"][1]["maps"], 2);
        sized
    };
    let ratio = texels("2") as f64 / texels("4") as f64;
    assert!((3.5..4.5).contains(&ratio), "{ratio}");
    let words: Vec<&str> = compare.split_whitespace().chain(["4"]).collect();
    let table = desk.succeed(&words);
    assert!(
        table.lines().any(|l| l.starts_with("lispsm+z2 ") && l.contains(&texels("4").to_string()))
    );
}

#[test]
fn a_scene_lit_by_a_point_light_compares() {
    let desk = Desk::new();
    let shadows = ["--shadows", "uniform@48x48", "--shadows", "uniform@384x384"];
    let compare = ["compare", "lantern", "-o", "report", "--json", "--size", "192x108"];
    let json = desk.json(&[&compare[..], &shadows].concat());
    assert_eq!(keys(&json["light"]), ["kind", "name", "position", "range"]);
    assert_eq!(
        (&json["light"]["kind"], &json["light"]["name"]),
        (&"point".into(), &"flame".into())
    );
    let wrong = [0, 1].map(|i| {
        assert_eq!(json["results"][i]["maps"], 6);
        json["results"][i]["wrong_fraction"].as_f64().unwrap()
    });
    assert!(wrong[0] < 0.2 && wrong[1] < 0.03 && wrong[1] < 0.4 * wrong[0], "{wrong:?}");
    let page = std::fs::read_to_string(desk.path("report/index.html")).unwrap();
    assert!(page.contains("“flame”, point at (0, 2.35, 0) m"));
}

#[needs(scenes)]
#[test]
fn real_scenes_compare() {
    // Of each kind one: cards with holes, instances, a room, a city, thirty kilometres of land.
    for scene in [
        "vehicles/kenney_racing_level.glb",
        "dragon/dragons25_res3.glb",
        "trees/forest_eztree.glb",
        "city/delft_city.glb",
        "terrain/jacksboro_dem_terrain.glb",
        "atrium/sponza_atrium_reduced.glb",
    ] {
        compares(&shared_scene(scene));
    }
}

#[test]
fn built_in_worlds_compare() {
    for scene in ["town", "airfield", "statues", "grove"] {
        compares(scene);
    }
}

fn compares(scene: &str) {
    let desk = Desk::new();
    let json = desk.json(
        &[
            &[
                "compare",
                scene,
                "-o",
                "report",
                "--json",
                "--shadows",
                "unfocused@256",
                "--shadows",
                "adaptive@1024",
            ],
            &SMALL[..],
        ]
        .concat(),
    );
    let figure = |i: usize, name: &str| json["results"][i][name].as_f64().unwrap();
    assert!(figure(0, "counted_pixels") > 200.0, "{scene}: the sun must reach what is seen");
    let [poor, good] = [0, 1].map(|i| figure(i, "wrong_fraction"));
    assert!(good < poor && good < 0.2, "{scene}: {good} against {poor}");
}

#[test]
fn without_arguments_five_techniques_are_compared() {
    let desk = Desk::new();
    let table = desk.succeed(&[]);
    let json: Value =
        serde_json::from_str(&std::fs::read_to_string(desk.path("report/report.json")).unwrap())
            .unwrap();
    let techniques: Vec<&str> = json["results"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["shadows"].as_str().unwrap())
        .collect();
    assert_eq!(techniques, DEFAULT);
    assert!(table.contains("report: report/index.html"), "{table}");
}
