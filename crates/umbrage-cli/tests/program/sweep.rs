use crate::bad_input::refuses;
use crate::desk::{Desk, STAGE_GLTF, listing};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;

/// What makes a sweep small.
const SMALL: [&str; 6] = ["--size", "48x27", "--shadows", "uniform@32", "--shadows", "lispsm@64"];

/// A name and built-in scene's view.
fn view(name: &str, scene: &str, sun: [f64; 3]) -> Value {
    json!({"name": name, "scene": scene, "sun": sun})
}

fn write_views(desk: &Desk, file: &str, views: &[Value]) {
    desk.write(file, &Value::from(views).to_string());
}

/// The arguments of a small sweep over `views.json` into `output`.
fn small<'a>(output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["sweep", "views.json", "-o", output], &SMALL[..], more].concat()
}

fn text(desk: &Desk, file: &str) -> String {
    std::fs::read_to_string(desk.path(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn json_of(desk: &Desk, file: &str) -> Value {
    serde_json::from_str(&text(desk, file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// Five good views of two scenes.
fn five() -> Vec<Value> {
    vec![
        view("a", "pole", [1.0, -1.0, 0.2]),
        view("b", "pole", [-1.0, -1.0, 0.2]),
        view("c", "sphere:24", [1.0, -1.0, 0.2]),
        view("d", "sphere:24", [-1.0, -2.0, 0.2]),
        view("e", "pole", [0.3, -1.0, -0.2]),
    ]
}

/// Results without wall-clock times.
fn untimed(report: &Value) -> Vec<Value> {
    let mut results = report["results"].as_array().unwrap().clone();
    for result in &mut results {
        result.as_object_mut().unwrap().remove("ms").expect("times");
    }
    results
}

#[test]
fn every_view_is_compared_as_by_compare() {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.path("scenes/deep")).unwrap();
    desk.write("scenes/deep/stage.gltf", STAGE_GLTF);
    let views = [
        json!({"name": "plain", "scene": "pole"}),
        json!({"name": "own", "scene": "pole", "eye": [0, 2, 6], "target": [0.5, 0, 0], "up": [0.1, 1, 0],
               "fov": 50, "near": 0.25, "far": 40, "sun": [-0.5, -1, 0.25], "size": [40, 30]}),
        json!({"name": "named", "scene": "deep/stage.gltf", "camera": "front", "light": "torch"}),
    ];
    write_views(&desk, "views.json", &views);
    let own = "--eye 0,2,6 --target 0.5,0,0 --up 0.1,1,0 --fov 50 --near 0.25 --far 40 --sun -0.5,-1,0.25";
    let own: Vec<&str> = own.split(' ').collect();
    let named = ["--camera", "front", "--light", "torch"];

    let printed = desk.json(&small("out", &["--scenes", "scenes", "--samples", "2", "--json"]));
    let results = json_of(&desk, "out/results.json");
    assert_eq!(printed, results);
    assert_eq!(results["errors"], json!([]));
    let csv = text(&desk, "out/results.csv");
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 3 * 2);
    let page = text(&desk, "out/index.html");
    for (i, (scene, options)) in
        [("pole", &[][..]), ("pole", &own[..]), ("scenes/deep/stage.gltf", &named[..])]
            .iter()
            .enumerate()
    {
        let name = views[i]["name"].as_str().unwrap();
        let mut args = vec!["compare", scene, "-o", "single", "--json", "--samples", "2"];
        args.extend(if name == "own" { ["--size", "40x30"] } else { ["--size", "48x27"] });
        args.extend(SMALL[2..].iter().chain(*options));
        let single = desk.json(&args);
        let report = json_of(&desk, &format!("out/views/{name}/report.json"));
        for key in ["size", "view", "light"] {
            assert_eq!(report[key], single[key], "{name}: {key}");
            assert_eq!(results["views"][i][key], single[key], "{name}: {key}");
        }
        assert_eq!(untimed(&report), untimed(&single), "{name}");
        assert_eq!(results["views"][i]["results"], Value::from(untimed(&single)), "{name}");
        assert_eq!(results["views"][i]["report"], format!("views/{name}/report.json"));
        for (row, result) in rows[1 + 2 * i..].iter().zip(single["results"].as_array().unwrap()) {
            assert_eq!(row[0], name);
            assert_eq!(row[4], result["shadows"]);
            for (column, figure) in [(9, "wrong_fraction"), (12, "mean_abs_error")] {
                assert_eq!(rows[0][column], figure);
                assert_eq!(row[column].parse::<f64>().unwrap(), result[figure].as_f64().unwrap());
            }
        }
        assert!(page.contains(&format!("href=\"views/{name}/index.html\"")), "{name}");
        assert!(desk.path(&format!("out/views/{name}/index.html")).is_file());
    }
    // By their definition, from the single figures.
    for (i, mean) in results["means"].as_array().unwrap().iter().enumerate() {
        let product: f64 = (0..3)
            .map(|v| &results["views"][v]["results"][i])
            .map(|r| {
                r["wrong_fraction"]
                    .as_f64()
                    .unwrap()
                    .max(1.0 / r["counted_pixels"].as_f64().unwrap())
            })
            .product();
        let ratio = mean["wrong_fraction"].as_f64().unwrap() / product.cbrt();
        assert!((ratio - 1.0).abs() < 1e-12, "{mean}");
        assert_eq!(mean["views"], 3);
    }
    for loads in ["src=\"http", "href=\"http", "url(http", "@import"] {
        assert!(!page.contains(loads), "the page must open offline, not load {loads}");
    }
    assert_eq!(
        listing(&desk.path("out")),
        [".lock", "index.html", "results.csv", "results.json", "sweep.json", "views"]
    );
}

#[test]
fn a_finished_sweep_prints_its_means_again() {
    let desk = Desk::new();
    write_views(&desk, "views.json", &five()[..1]);
    let first = desk.succeed(&small("out", &[]));
    assert!(first.lines().any(|l| l.starts_with("lispsm@64 ")), "{first}");
    assert!(first.ends_with("report: out/index.html\n"), "{first}");
    assert_eq!(desk.succeed(&small("out", &[])), first);
}

/// The views that are there, each whole, by the text of their reports, whose times tell one run
/// from another.
fn whole_views(output: &Path) -> BTreeMap<String, String> {
    let views = output.join("views");
    let names = if views.is_dir() { listing(&views) } else { Vec::new() };
    let names = names.into_iter().filter(|n| !n.starts_with('.'));
    let report = |name: String| {
        let folder = views.join(&name);
        for png in listing(&folder).iter().filter(|n| n.ends_with(".png")) {
            image::open(folder.join(png)).unwrap();
        }
        for file in ["index.html", "view.json", "truth-color.png", "02-lispsm-64-texels.png"] {
            assert!(folder.join(file).is_file(), "{name}: {file}");
        }
        let text = std::fs::read_to_string(folder.join("report.json")).unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["results"].as_array().unwrap().len(), 2);
        (name, text)
    };
    names.map(report).collect()
}

#[test]
fn killed_at_any_moment_it_goes_on_where_it_was() {
    let desk = Desk::new();
    let views: Vec<Value> =
        (0..8).map(|i| view(&format!("v{i}"), "pole", [1.0, -1.0, 0.1 * f64::from(i)])).collect();
    write_views(&desk, "views.json", &views);
    let size = ["sweep", "views.json", "--size", "160x90"];
    let sweep = |output| [&size[..], &SMALL[2..], &["-o", output]].concat();
    desk.succeed(&sweep("whole"));

    let output = desk.path("out");
    let mut known = BTreeMap::new();
    let mut kills = 0;
    let is_unfinished = |folder: &Path| {
        folder.is_dir() && listing(folder).iter().any(|n| n.starts_with(".umbrage-"))
    };
    // Killed in turns: as soon as there is a folder, while something is unfinished, when a view is
    // done.
    for moment in (0..3).cycle().take(9) {
        let mut command = desk.command(&sweep("out"));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let is_due = || match moment {
            0 => output.join(".lock").exists(),
            1 => is_unfinished(&output.join("views")),
            _ => whole_views(&output).len() > known.len(),
        };
        while !is_due() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        kills += u32::from(!child.wait().unwrap().success());
        let now = whole_views(&output);
        for (name, report) in &known {
            assert_eq!(now.get(name), Some(report), "{name} was lost or done again");
        }
        known = now;
    }
    assert!(kills >= 3, "killed {kills} times");
    desk.succeed(&sweep("out"));
    let now = whole_views(&output);
    for (name, report) in &known {
        assert_eq!(now.get(name), Some(report), "{name} was lost or done again");
    }
    for table in ["results.csv", "results.json"] {
        assert_eq!(text(&desk, &format!("out/{table}")), text(&desk, &format!("whole/{table}")));
    }
    assert_eq!(listing(&output), listing(&desk.path("whole")), "nothing unfinished is left");
    assert_eq!(listing(&output.join("views")), listing(&desk.path("whole/views")));
}

#[test]
fn what_changed_is_done_again_and_nothing_else() {
    let desk = Desk::new();
    // A scene whose points lie in a file of their own.
    let (head, rest) = STAGE_GLTF.split_once("\"data:").unwrap();
    let (_, tail) = rest.split_once('"').unwrap();
    desk.write("stage.gltf", &format!("{head}\"points.bin\"{tail}"));
    let points = |far: f32| -> Vec<u8> {
        [-8.0, 0.0, 8.0, 8.0, 0.0, 8.0, 0.0, 0.0, far]
            .iter()
            .flat_map(|x: &f32| x.to_le_bytes())
            .collect()
    };
    std::fs::write(desk.path("points.bin"), points(-8.0)).unwrap();
    let stage =
        json!({"name": "stage", "scene": "stage.gltf", "camera": "above", "sun": [0.1, -1, 0]});
    let mut views =
        vec![view("a", "pole", [1.0, -1.0, 0.2]), view("b", "pole", [-1.0, -1.0, 0.2]), stage];
    let redone = |views: &[Value]| {
        write_views(&desk, "views.json", views);
        let before = whole_views(&desk.path("out"));
        desk.succeed(&small("out", &[]));
        let after = whole_views(&desk.path("out"));
        after
            .into_iter()
            .filter(|(n, r)| before.get(n) != Some(r))
            .map(|(n, _)| n)
            .collect::<Vec<_>>()
    };
    assert_eq!(redone(&views[..2]), ["a", "b"]);
    assert_eq!(redone(&views), ["stage"]);
    assert_eq!(redone(&views), [""; 0]);
    views[1]["fov"] = json!(45);
    assert_eq!(redone(&views), ["b"]);
    std::fs::write(desk.path("points.bin"), points(-7.0)).unwrap();
    assert_eq!(redone(&views), ["stage"]);
    // A report without one of its pictures is not whole.
    std::fs::remove_file(desk.path("out/views/b/01-uniform-32-visibility.png")).unwrap();
    assert_eq!(redone(&views), ["b"]);
    // What an older program made is no result of this one.
    let mut record = json_of(&desk, "out/views/a/view.json");
    record["inputs"]["version"] = json!("0.0.1");
    desk.write("out/views/a/view.json", &record.to_string());
    assert_eq!(redone(&views), ["a"]);
    // What is no longer asked for stays, and counts no more.
    write_views(&desk, "views.json", &views[..2]);
    let run = desk.run(&small("out", &[]));
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(
        run.stderr.contains("has a view `stage`, which is not in views.json"),
        "{}",
        run.stderr
    );
    assert_eq!(json_of(&desk, "out/results.json")["views"].as_array().unwrap().len(), 2);
    assert!(desk.path("out/views/stage/report.json").is_file());
}

#[test]
fn shares_join_to_the_very_same_tables() {
    let desk = Desk::new();
    let mut views = five();
    views.insert(2, json!({"name": "broken", "scene": "broken.glb"}));
    views.push(json!({"name": "flat", "scene": "pole", "near": 5, "far": 1}));
    desk.write("broken.glb", "glTF but not really");
    write_views(&desk, "views.json", &views);
    assert_eq!(desk.run(&small("whole", &[])).code, 1);

    // More shares than views: some are empty.
    let shares: Vec<String> = (1..=9).map(|i| format!("{i}/9")).collect();
    let folders: Vec<String> = (1..=9).map(|i| format!("share{i}")).collect();
    let mut done = Vec::new();
    for (share, folder) in shares.iter().zip(&folders) {
        desk.run(&small(folder, &["--shard", share]));
        let results = json_of(&desk, &format!("{folder}/results.json"));
        assert_eq!(results["share"], share.as_str());
        for view in
            [&results["views"], &results["errors"]].iter().flat_map(|v| v.as_array().unwrap())
        {
            done.push(view["name"].as_str().unwrap().to_owned());
        }
    }
    let names: Vec<&str> = views.iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(done, names, "each view in one share, in order");

    let folders: Vec<&str> = folders.iter().map(String::as_str).collect();
    let joined = desk.run(&small("joined", &[&["--merge"], &folders[..]].concat()));
    assert_eq!(joined.code, 1);
    assert!(joined.stderr.contains("view `flat`: far: must exceed near (5)"), "{}", joined.stderr);
    assert!(joined.stderr.contains("2 of 7 views failed: broken, flat"), "{}", joined.stderr);
    for table in ["results.csv", "results.json"] {
        let [joined, whole] = ["joined", "whole"].map(|f| text(&desk, &format!("{f}/{table}")));
        assert_eq!(joined, whole, "{table}");
    }
    assert_eq!(listing(&desk.path("joined/views/a")), listing(&desk.path("whole/views/a")));

    // Shares may also be done in one folder, one after the other; the whole then has nothing left
    // to do.
    for share in ["1/2", "2/2"] {
        desk.run(&small("turns", &["--shard", share]));
    }
    let before = text(&desk, "turns/views/a/report.json");
    desk.run(&small("turns", &[]));
    assert_eq!(text(&desk, "turns/views/a/report.json"), before);
    assert_eq!(text(&desk, "turns/results.json"), text(&desk, "whole/results.json"));
}

#[test]
fn shares_that_do_not_fit_are_refused() {
    let desk = Desk::new();
    let views = &five()[..4];
    write_views(&desk, "views.json", views);
    desk.succeed(&small("one", &["--shard", "1/2"]));
    desk.succeed(&small("other", &["--shard", "2/2"]));
    let merge = |folders: &[&'static str]| small("out", &[&["--merge"], folders].concat());
    refuses(&desk, &merge(&["one"]), "--merge: 2 of 4 views are missing: `c`, `d`");
    refuses(&desk, &merge(&["one", "nowhere"]), "nowhere is not the folder of a sweep");
    desk.succeed(&["sweep", "views.json", "-o", "coarse", "--size", "16x9", "--shadows", "psm@16"]);
    refuses(
        &desk,
        &merge(&["one", "other", "coarse"]),
        "coarse holds another sweep: --shadows was `psm@16`, is `uniform@32 lispsm@64`, --size was `16x9`",
    );

    // The same view twice is welcome, as long as both agree.
    desk.succeed(&small("twice", &["--shard", "1/2"]));
    desk.succeed(&merge(&["one", "twice", "other"]));
    std::fs::remove_dir_all(desk.path("out")).unwrap();
    let mut report = json_of(&desk, "twice/views/b/report.json");
    report["results"][1]["wrong_fraction"] = json!(0.125);
    desk.write("twice/views/b/report.json", &report.to_string());
    let contradiction = "`b` has other figures in one than in twice";
    refuses(&desk, &merge(&["one", "twice", "other"]), contradiction);
    let mut record = json_of(&desk, "other/views/c/view.json");
    record["inputs"]["version"] = json!("0.0.1");
    desk.write("other/views/c/view.json", &record.to_string());
    let run = desk.run(&merge(&["one", "other"]));
    assert!(run.stderr.contains("`c` of other was made by umbrage 0.0.1, not "), "{}", run.stderr);
    assert!(run.stderr.contains("1 of 4 views are missing: `c`"), "{}", run.stderr);

    let mut views = views.to_vec();
    views[3]["fov"] = json!(30);
    write_views(&desk, "views.json", &views);
    refuses(&desk, &merge(&["one", "other"]), "`d` of other is another view of that name");
}

#[test]
fn a_scene_that_differs_between_shares_is_refused() {
    let desk = Desk::new();
    let views = [1.0, -1.0]
        .map(|x| json!({"name": format!("v{x}"), "scene": "stage.gltf", "sun": [x, -1, 0]}));
    write_views(&desk, "views.json", &views);
    desk.write("stage.gltf", STAGE_GLTF);
    desk.succeed(&small("one", &["--shard", "1/2"]));
    desk.write("stage.gltf", &STAGE_GLTF.replace("0.9", "0.8"));
    desk.succeed(&small("other", &["--shard", "2/2"]));
    let expected = "the scene stage.gltf is not the same file in one and other";
    refuses(&desk, &small("out", &["--merge", "one", "other"]), expected);
}

#[test]
fn a_report_goes_before_a_failure_and_joining_needs_no_scenes() {
    let desk = Desk::new();
    write_views(&desk, "views.json", &[json!({"name": "late", "scene": "stage.gltf"})]);
    assert_eq!(desk.run(&small("early", &[])).code, 1);
    desk.write("stage.gltf", STAGE_GLTF);
    desk.succeed(&small("late", &[]));
    std::fs::remove_file(desk.path("stage.gltf")).unwrap();
    for order in [["early", "late"], ["late", "early"]] {
        // Twice into the same folder, where the first has left the report.
        desk.succeed(&small("joined", &["--merge", order[0], order[1]]));
        assert_eq!(text(&desk, "joined/results.json"), text(&desk, "late/results.json"));
    }
}

#[test]
fn what_fails_is_told_and_the_rest_done() {
    let desk = Desk::new();
    desk.write("broken.glb", "glTF but not really");
    let views = [
        json!({"name": "missing", "scene": "no/such.glb"}),
        json!({"name": "good", "scene": "pole"}),
        json!({"name": "broken", "scene": "broken.glb"}),
        json!({"name": "unbuilt", "scene": "plole"}),
        json!({"name": "wide", "scene": "pole", "fov": 200}),
        json!({"name": "blind", "scene": "pole", "eye": [1, 1, 1], "target": [1, 1, 1]}),
        json!({"name": "two-lights", "scene": "pole", "sun": [0, -1, 0], "light": "lamp"}),
        json!({"name": "two-cameras", "scene": "pole", "camera": "c", "eye": [0, 1, 0]}),
        json!({"name": "tiny", "scene": "pole", "size": [0, 9]}),
        json!({"name": "dark", "scene": "pole", "sun": [0, 0, 0]}),
        json!({"name": "unlit", "scene": "pole", "light": "moon"}),
    ];
    write_views(&desk, "views.json", &views);
    let run = desk.run(&small("out", &["--json"]));
    assert_eq!(run.code, 1);
    let results: Value = serde_json::from_str(&run.stdout).unwrap();
    let expected = [
        ("missing", "scene: there is no file no/such.glb"),
        ("broken", "broken.glb"),
        ("unbuilt", "did you mean `pole`?"),
        ("wide", "fov: must be an angle of 0.01 to 179 degrees"),
        ("blind", "target: must differ from eye"),
        ("two-lights", "light: cannot be used with sun"),
        ("two-cameras", "camera: cannot be used with eye"),
        ("tiny", "size: must be"),
        ("dark", "sun: must point somewhere"),
        ("unlit", "light: the scene has no light `moon`"),
    ];
    let errors = results["errors"].as_array().unwrap();
    let csv = text(&desk, "out/results.csv");
    let page = text(&desk, "out/index.html");
    assert_eq!(errors.len(), expected.len());
    for (error, (name, what)) in errors.iter().zip(expected) {
        assert_eq!(error["name"], name);
        let told = error["error"].as_str().unwrap();
        assert!(told.contains(what), "{name}: {told}");
        assert!(
            run.stderr.contains(&format!("umbrage: view `{name}`: {told}\n")),
            "{}",
            run.stderr
        );
        assert!(csv.lines().any(|l| l.starts_with(&format!("{name},"))), "{csv}");
        assert!(page.contains(&format!("<span>{name} <small>")), "{name}");
    }
    assert!(run.stderr.contains("10 of 11 views failed: missing, broken,"), "{}", run.stderr);
    assert_eq!(results["views"].as_array().unwrap().len(), 1);
    assert_eq!(results["means"][0]["views"], 1);
    assert!(csv.lines().filter(|l| l.starts_with("good,")).count() == 2, "{csv}");

    // What failed is tried again, what was done is not.
    let before = text(&desk, "out/views/good/report.json");
    std::fs::create_dir(desk.path("no")).unwrap();
    desk.write("no/such.glb", STAGE_GLTF);
    assert_eq!(desk.run(&small("out", &[])).code, 1);
    let results = json_of(&desk, "out/results.json");
    assert_eq!(results["views"][0]["name"], "missing");
    assert_eq!(results["errors"].as_array().unwrap().len(), 9);
    assert_eq!(text(&desk, "out/views/good/report.json"), before);
}

#[test]
fn views_without_light_are_left_out_of_the_means() {
    let desk = Desk::new();
    let from_below = view("below", "pole", [0.0, 1.0, 0.0]);
    write_views(&desk, "views.json", &[five()[0].clone(), from_below]);
    let results = desk.json(&small("out", &["--json"]));
    assert_eq!(results["views"][1]["results"][0]["counted_pixels"], 0);
    assert_eq!(results["views"][1]["results"][0]["wrong_fraction"], Value::Null);
    assert_eq!(results["means"][0]["views"], 1);
    assert!(text(&desk, "out/index.html").contains("in 1 no surface faces the light"));
}

#[test]
fn files_of_views_that_are_none() {
    let desk = Desk::new();
    for (views, expected) in [
        ("", "VIEWS: views.json is no list of views"),
        ("{}", "VIEWS: views.json is no list of views"),
        ("[]", "VIEWS: views.json holds no view"),
        ("[{\"name\": \"a\"}]", "missing field `scene`"),
        ("[{\"scene\": \"pole\"}]", "missing field `name`"),
        ("[{\"name\": \"a\", \"scene\": \"pole\", \"aye\": [0, 0, 0]}]", "unknown field `aye`"),
        ("[{\"name\": \"a\", \"scene\": \"pole\",\n \"eye\": [0, 0]}]", "at line 2 column"),
        ("[{\"name\": \"a\", \"scene\": \"pole\", \"far\": \"9\"}]", "invalid type: string \"9\""),
        ("[{\"name\": \"a\", \"scene\": \"pole\", \"far\": 1e999}]", "number out of range"),
        (
            "[{\"name\": \"a\", \"scene\": \"pole\"}, {\"name\": \"A\", \"scene\": \"pole\"}]",
            "named `A`",
        ),
        ("[{\"name\": \"../a\", \"scene\": \"pole\"}]", "the name \"../a\": must name a folder"),
        ("[{\"name\": \"\", \"scene\": \"pole\"}]", "the name \"\": must name a folder"),
        ("[{\"name\": \"nul\", \"scene\": \"pole\"}]", "is that of a device"),
    ] {
        desk.write("views.json", views);
        refuses(&desk, &small("out", &[]), expected);
    }
}

#[test]
fn options_and_places_that_do_not_fit() {
    let desk = Desk::new();
    write_views(&desk, "views.json", &five()[..1]);
    desk.write("file", "");
    std::fs::create_dir(desk.path("full")).unwrap();
    desk.write("full/thesis.tex", "precious");
    for (options, expected) in [
        (&["--shard", "0/2"][..], "must be I/N with 1 ≤ I ≤ N"),
        (&["--shard", "3/2"], "must be I/N"),
        (&["--shard", "1/2", "--merge", "x"], "cannot be used with"),
        (&["--scenes", "missing"], "--scenes: missing is not a folder"),
        (&["--scenes", "file"], "--scenes: file is not a folder"),
        (&["--shadows", "lispsm@64"], "`lispsm@64` is given twice"),
        (
            &["--backend", "gpu", "--shadows", "log"],
            "--backend: `log`: no GPU rasterises bent rows",
        ),
    ] {
        refuses(&desk, &small("out", options), expected);
    }
    for (output, expected) in [
        ("missing/out", "the folder missing must exist"),
        ("file", "file is there and is not a folder"),
        ("full", "full holds something other than a sweep"),
    ] {
        refuses(&desk, &small(output, &[]), expected);
    }
    assert_eq!(listing(&desk.path("full")), ["thesis.tex"]);
    refuses(&desk, &["sweep", "nowhere.json", "-o", "out"], "VIEWS: nowhere.json");
}

#[test]
fn a_sweep_of_other_settings_or_views_is_not_mixed_in() {
    let desk = Desk::new();
    write_views(&desk, "views.json", &five()[..1]);
    desk.succeed(&small("out", &[]));
    let before = text(&desk, "out/results.json");
    for (options, expected) in [
        (&["--samples", "2"][..], "--samples was `1`, is `2`"),
        (&["--opaque"], "--opaque was `off`, is `on`"),
        (&["--shadows", "psm", "--max-error", "9"], "--max-error was `off`, is `9`"),
        (
            &["--shadows", "psm"],
            "--shadows was `uniform@32 lispsm@64`, is `uniform@32 lispsm@64 psm`",
        ),
    ] {
        refuses(&desk, &small("out", options), expected);
    }
    write_views(&desk, "views.json", &five()[1..]);
    refuses(
        &desk,
        &small("out", &[]),
        "out holds another sweep: none of its views is in views.json",
    );
    assert_eq!(text(&desk, "out/results.json"), before);
}

#[test]
fn two_at_once_are_refused_and_the_dead_cleared_away() {
    let desk = Desk::new();
    write_views(&desk, "views.json", &five()[..1]);
    std::fs::create_dir(desk.path("out")).unwrap();
    let lock = std::fs::File::create(desk.path("out/.lock")).unwrap();
    lock.lock().unwrap();
    refuses(&desk, &small("out", &[]), "another sweep is at work in out");
    drop(lock);
    // As a killed process leaves it.
    std::fs::create_dir_all(desk.path("out/views/.umbrage-99-0/new")).unwrap();
    desk.write("out/views/.umbrage-99-0/new/report.json", "{");
    desk.write("out/.umbrage-x", "{");
    std::fs::write(desk.path("out/sweep.json"), "").unwrap();
    refuses(&desk, &small("out", &[]), "out/sweep.json is not the settings of a sweep");
    std::fs::remove_file(desk.path("out/sweep.json")).unwrap();
    let refused = desk.run(&small("out", &[]));
    assert!(
        refused.stderr.contains("holds something other than a sweep"),
        "views without settings"
    );
    std::fs::rename(desk.path("out/views"), desk.path("views")).unwrap();
    desk.succeed(&small("out", &[]));
    std::fs::rename(desk.path("views/.umbrage-99-0"), desk.path("out/views/.umbrage-99-0"))
        .unwrap();
    desk.succeed(&small("out", &[]));
    assert_eq!(listing(&desk.path("out/views")), ["a"]);
    assert!(!desk.path("out/.umbrage-x").exists());
}

/// Whoever works in a folder removes what killed processes left there, and nothing else.
#[test]
fn what_the_killed_left_beside_the_output_is_removed() {
    let desk = Desk::new();
    for path in [".umbrage-dead/new/index.html", ".umbrage-half"] {
        std::fs::create_dir_all(desk.path(path).parent().unwrap()).unwrap();
        desk.write(path, "half");
    }
    desk.write(".umbrage-alive", "half");
    let alive = std::fs::File::open(desk.path(".umbrage-alive")).unwrap();
    alive.lock().unwrap();
    desk.succeed(&["render", "pole", "-o", "a.png", "--size", "8x8", "--shadows", "uniform@32"]);
    assert_eq!(desk.listing(), [".umbrage-alive", "a.png"]);
}

#[cfg(unix)]
#[test]
fn whoever_is_told_to_stop_leaves_nothing_unfinished() {
    let desk = Desk::new();
    let views: Vec<Value> =
        (0..8).map(|i| view(&format!("v{i}"), "pole", [1.0, -1.0, 0.1 * f64::from(i)])).collect();
    write_views(&desk, "views.json", &views);
    let hidden = |folder: &Path| -> Vec<String> {
        let names = if folder.is_dir() { listing(folder) } else { Vec::new() };
        names.into_iter().filter(|name| name.starts_with(".umbrage-")).collect()
    };
    let (out, folder) = (desk.path("out"), desk.path("out/views"));
    for signal in ["INT", "TERM"] {
        let size = ["sweep", "views.json", "-o", "out", "--size", "160x90"];
        let mut command = desk.command(&[&size[..], &SMALL[2..]].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while hidden(&folder).is_empty() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let kill = ["-s", signal, &child.id().to_string()];
        assert!(std::process::Command::new("kill").args(kill).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
        assert_eq!([hidden(&out), hidden(&folder)], [Vec::<String>::new(), vec![]], "{signal}");
    }
}

/// Any values in any place are answered, never with a panic.
#[test]
fn no_view_panics() {
    let desk = Desk::new();
    let odd =
        [json!(null), json!(-1), json!(1e308), json!([1e308, 0, 0]), json!("x"), json!([0, 1])];
    for field in ["eye", "target", "up", "fov", "near", "far", "size", "camera", "sun", "light"] {
        let views: Vec<Value> = odd
            .iter()
            .enumerate()
            .map(|(i, value)| json!({"name": format!("v{i}"), "scene": "pole", field: value}))
            .collect();
        for (i, view) in views.iter().enumerate() {
            write_views(&desk, "views.json", std::slice::from_ref(view));
            let output = format!("{field}{i}");
            let run = desk.run(&small(&output, &[]));
            assert!([0, 1].contains(&run.code), "{view}: {}", run.stderr);
            assert!(!run.stderr.contains("panicked"), "{view}: {}", run.stderr);
        }
    }
}
