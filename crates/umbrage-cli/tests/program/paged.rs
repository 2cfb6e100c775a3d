//! Paged maps through the real program.

use crate::desk::{Desk, keys};
use serde_json::Value;
use umbrage_testing::needs;

const BY_RAYS: [&str; 4] = ["--backend", "reference", "--size", "160x90"];

fn results(desk: &Desk, shadows: &[&str]) -> Value {
    let mut args = vec!["compare", "pole", "-o", "report", "--json"];
    args.extend(BY_RAYS);
    args.extend(shadows.iter().flat_map(|s| ["--shadows", s]));
    desk.json(&args)["results"].clone()
}

#[test]
fn reports_count_pages() {
    let desk = Desk::new();
    let shadows = ["paged", "paged(error=0.25):pcf3@512", "adaptive@256"];
    let results = results(&desk, &shadows);
    for result in &results.as_array().unwrap()[..2] {
        let number = |name: &str| result[name].as_f64().unwrap_or_else(|| panic!("{name}"));
        assert!(number("pages") > 0.0);
        assert_eq!(result["maps"], result["pages"]);
        assert_eq!(number("texels"), number("pages") * 4096.0);
        let per_pixel = number("texels") / number("counted_pixels");
        assert!((number("texels_per_pixel") / per_pixel - 1.0).abs() < 1e-12);
        let largest = result["perspective_px"]["max"].as_f64().unwrap();
        assert!(largest <= number("bound_px") * 1.001, "{largest}: {result}");
        assert_eq!(result["perspective_px"]["undefined"], 0);
        for absent in ["storage_factor", "casters_culled"] {
            assert!(result[absent].is_null(), "{absent}");
        }
    }
    assert_eq!(results[0]["bound_px"], 1.0);
    assert!(results[1]["pages"].as_u64().unwrap() <= 64);
    assert!(results[1]["bound_px"].as_f64().unwrap() >= 0.25);
    for field in ["pages", "texels_per_pixel", "bound_px"] {
        assert!(results[2].get(field).is_none(), "{field} of maps");
    }
    let page = std::fs::read_to_string(desk.path("report/index.html")).unwrap();
    for shown in ["Pages", "Texels a pixel", "Bound, px/texel", "Texels used"] {
        assert!(page.contains(shown), "{shown}");
    }
}

#[test]
fn tables_of_sweeps_count_pages() {
    let desk = Desk::new();
    desk.write("views.json", r#"[{"name": "pole", "scene": "pole"}]"#);
    let mut args = vec!["sweep", "views.json", "-o", "out", "--shadows", "paged"];
    args.extend(BY_RAYS);
    args.extend(["--shadows", "uniform@64"]);
    desk.succeed(&args);
    let json = std::fs::read_to_string(desk.path("out/results.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    let results = &json["views"][0]["results"];
    let csv = std::fs::read_to_string(desk.path("out/results.csv")).unwrap();
    let mut rows = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let headings = rows.next().unwrap();
    let rows: Vec<_> = rows.collect();
    for field in ["pages", "texels_per_pixel", "bound_px"] {
        let column = headings.iter().position(|heading| *heading == field).unwrap();
        assert_eq!(rows[0][column].parse::<f64>().ok(), results[0][field].as_f64(), "{field}");
        assert!(results[0][field].as_f64().unwrap() > 0.0);
        assert_eq!((rows[1][column], results[1].get(field)), ("", None), "{field}");
    }
}

#[test]
fn plans_list_levels_and_pages() {
    let desk = Desk::new();
    let json = desk.json(&["plan", "pole", "--size", "160x90", "--shadows", "paged", "--json"]);
    let levels = json["levels"].as_array().unwrap();
    let counts = |levels: &[Value]| -> u64 {
        levels.iter().map(|level| level["pages"].as_u64().unwrap()).sum()
    };
    assert_eq!(Some(counts(levels)), json["pages"].as_u64());
    assert_eq!(json["texels"].as_u64(), json["pages"].as_u64().map(|pages| pages * 4096));
    assert_eq!((&json["bound_px"], &json["budget"]), (&1.0.into(), &Value::Null));
    for level in levels {
        let width = f64::powi(2.0, level["level"].as_i64().unwrap() as i32);
        assert_eq!(level["texel_m"].as_f64(), Some(width));
        assert!(level["window"].as_u64().unwrap().is_power_of_two());
    }
    assert!(json.get("addresses").is_none());
    let listed = ["plan", "pole", "--size", "160x90", "--shadows", "paged", "--json", "--pages"];
    let listed = desk.json(&listed);
    let pages = listed["addresses"].as_array().unwrap();
    assert_eq!(Some(pages.len() as u64), json["pages"].as_u64());
    for page in pages {
        // The matrix takes the page, in units of its texels, to [0, 1].
        let matrix: [[f64; 4]; 4] =
            serde_json::from_value(page["world_to_shadow"].clone()).unwrap();
        let width = 64.0 * f64::powi(2.0, page["level"].as_i64().unwrap() as i32);
        let s = [0, 1, 2].map(|column| matrix[column][0] * width);
        assert!((s.iter().map(|s| s * s).sum::<f64>() - 1.0).abs() < 1e-9, "{page}");
        assert!((matrix[3][0] + page["i"].as_f64().unwrap()).abs() < 1e-6, "{page}");
    }
    // A lamp's texels are angles.
    let lamp = desk.json(&["plan", "lantern", "--size", "160x90", "--shadows", "paged", "--json"]);
    let level = &lamp["levels"][0];
    assert!(level["texel_tangent"].is_f64() && level["side"].is_string(), "{level}");
    // Without a scene nothing is seen.
    let view = "plan --eye 0,2,0 --target 0,2,-1 --near 0.1 --far 500 --shadows paged@1024 --json";
    let bare = desk.json(&view.split(' ').collect::<Vec<_>>());
    assert!(!keys(&bare).contains(&"pages") && !keys(&bare["levels"][0]).contains(&"pages"));
    assert_eq!(bare["budget"], 256);
    // The table has the levels that are used.
    let table = desk.succeed(&["plan", "pole", "--size", "160x90", "--shadows", "paged"]);
    let used = levels.iter().filter(|level| level["pages"] != 0).count();
    let rows = table.lines().skip_while(|line| !line.starts_with("level")).skip(1);
    assert_eq!(rows.filter(|row| !row.trim().is_empty()).count(), used, "{table}");
}

#[test]
fn pages_are_shown() {
    let desk = Desk::new();
    let mut args = vec!["render", "pole", "-o", "p.png", "--samples", "1"];
    args.extend(BY_RAYS);
    args.extend(["--shadows", "paged", "--aov", "pages,partition,texels,visibility"]);
    desk.succeed(&args);
    let colors = |name: &str| {
        let picture = image::open(desk.path(name)).unwrap().to_rgb8();
        let colors = picture.pixels().copied().collect::<std::collections::HashSet<_>>();
        (picture, colors.len())
    };
    let (partition, _) = colors("p-partition.png");
    let (pages, _) = colors("p-pages.png");
    // But for borders, pages have the tints of their levels.
    let same = partition.pixels().zip(pages.pixels()).filter(|(a, b)| a == b).count();
    let share = same as f64 / f64::from(160 * 90);
    assert!((0.5..0.999).contains(&share), "{share}");
    assert!(colors("p-texels.png").1 > 10);
    args[3] = "p.exr";
    desk.succeed(&args);
}

/// A GPU finds the pages of the reference, and keeps them while the camera walks.
#[needs(gpu)]
#[test]
fn gpus_draw_pages() {
    let desk = Desk::new();
    let by = |backend: &str| {
        let mut args = vec!["compare", "town:20", "--size", "240x135", "-o", backend, "--json"];
        args.extend(["--shadows", "paged", "--backend", backend]);
        let result = desk.json(&args)["results"][0].clone();
        assert_eq!((&result["backend"], &result["bound_px"]), (&backend.into(), &1.0.into()));
        ["wrong_fraction", "pages"].map(|name| result[name].as_f64().unwrap())
    };
    let [gpu, reference] = ["gpu", "reference"].map(by);
    assert!((gpu[0] - reference[0]).abs() < 0.002, "{gpu:?} {reference:?}");
    // The GPU's have those that stand in for others too.
    assert!((1.0..1.3).contains(&(gpu[1] / reference[1])), "{gpu:?} {reference:?}");
    let mut args = vec!["bench", "town:20", "--size", "240x135", "--walk", "1.4", "--json"];
    args.extend(["--backend", "gpu", "--shadows", "paged", "--shadows", "adaptive"]);
    let bench = desk.json(&args);
    let share = |i: usize| bench["results"][i]["drawn_share"].as_f64().unwrap();
    assert!(share(0) < 0.1 && share(1) == 1.0, "{} {}", share(0), share(1));
    assert_eq!(bench["walk"], 1.4);
    for stage in ["prepass", "pages", "depth", "shade"] {
        let median = bench["results"][0]["ms"][stage]["median"].as_f64();
        assert!(median.is_some_and(|ms| ms > 0.0), "{stage}: {}", bench["results"][0]["ms"]);
    }
    for speed in ["0", "-1", "nan", "fast"] {
        let run = desk.run(&["bench", "pole", &format!("--walk={speed}")]);
        assert!(run.code != 0 && run.stderr.contains("--walk"), "{}", run.stderr);
    }
}

/// Pages of a sun that turns are renewed over several frames, and how far behind it is, is told.
#[needs(gpu)]
#[test]
fn pages_of_a_turning_sun_are_renewed() {
    let desk = Desk::new();
    let mut args = vec!["bench", "town:20", "--size", "240x135", "--turn", "0.25", "--json"];
    args.extend(["--backend", "gpu", "--shadows", "paged", "--shadows", "adaptive"]);
    let at_once = desk.json(&args);
    args.extend(["--renew", "10"]);
    let renewed = desk.json(&args);
    let share = |bench: &Value| bench["results"][0]["drawn_share"].as_f64().unwrap();
    let shares = [&at_once, &renewed].map(share);
    assert!(shares[0] > 0.99 && (0.02..0.1).contains(&shares[1]), "{shares:?}");
    let turn = |bench: &Value| [bench["turn"].as_f64(), bench["renew"].as_f64()];
    assert_eq!(turn(&at_once), [Some(0.25), Some(0.0)]);
    assert_eq!(turn(&renewed), [Some(0.25), Some(10.0)]);
    assert!(at_once["results"][0]["age_deg"].is_null());
    assert!(renewed["results"][1]["age_deg"].is_null());
    let age = renewed["results"][0]["age_deg"]["max"].as_f64().unwrap();
    // Nineteen frames, about the vertical.
    assert!(age > 0.0 && age < 19.0 * 0.25 / 60.0, "{age}");
    for (option, value) in [("--turn", "0"), ("--turn", "400"), ("--renew", "5000")] {
        let run = desk.run(&["bench", "pole", "--turn=1", &format!("{option}={value}")]);
        assert!(run.code != 0 && run.stderr.contains(option), "{}", run.stderr);
    }
}

#[test]
fn what_pages_cannot_do_is_said() {
    let desk = Desk::new();
    for (args, expected) in [
        ("render pole -o p.png --aov pages", "--aov: `adaptive` has no pages"),
        ("plan pole --pages", "--pages: `adaptive` has no pages"),
        (
            "plan --eye 0,2,0 --target 0,2,-1 --near 0.1 --far 500 --shadows paged --pages",
            "--pages: what is seen of a SCENE",
        ),
        ("plan pole --shadows paged@64", "at least 262144 texels"),
        ("plan pole --shadows paged(error=9)", "0.25 to 8 pixels"),
        ("plan pole --shadows paged+z4", "no slices and no faces"),
        ("render pole -o p.png --shadows paged:vsm", "no prefilters"),
    ] {
        let run = desk.run(&args.split(' ').collect::<Vec<_>>());
        assert_ne!(run.code, 0, "{args}");
        assert!(run.stderr.contains(expected), "{args}: {}", run.stderr);
    }
    assert!(desk.listing().is_empty());
}
