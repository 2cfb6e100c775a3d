//! Plans of several maps: slices, faces, sides of a cube, lights; sizes by error; one texture for
//! all.

use crate::desk::{Desk, STAGE_GLTF, keys};
use glam::{DMat4, DVec3, Vec4Swizzles};
use serde_json::{Value, json};

const NEAR: f64 = 0.1;
const FAR: f64 = 500.0;

/// A plan of a view from 2 m above the world's origin along −z, 60° high and 16:9 wide, with no
/// scene.
fn plan(shadows: &str, options: &str) -> Value {
    let view =
        "plan --eye 0,2,0 --target 0,2,-1 --fov 60 --near 0.1 --far 500 --size 1280x720 --json";
    let mut words: Vec<&str> = view.split(' ').chain(["--shadows", shadows]).collect();
    words.extend(options.split_whitespace());
    if !options.contains("--sun") {
        words.extend(["--sun", "0.3,-1,0.2"]);
    }
    Desk::new().json(&words)
}

fn maps(plan: &Value) -> &Vec<Value> {
    plan["maps"].as_array().unwrap()
}

fn full(plan: &Value) -> impl Iterator<Item = &Value> {
    maps(plan).iter().filter(|m| m["empty"] == false)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

fn split(map: &Value) -> [f64; 2] {
    [number(&map["split"][0]), number(&map["split"][1])]
}

fn size(value: &Value) -> [u64; 2] {
    serde_json::from_value(value.clone()).unwrap()
}

/// (s, t, depth) of a world point; `None` behind the map.
fn project(map: &Value, p: DVec3) -> Option<DVec3> {
    let columns: [[f64; 4]; 4] = serde_json::from_value(map["world_to_shadow"].clone()).unwrap();
    let h = DMat4::from_cols_array_2d(&columns) * p.extend(1.0);
    (h.w > 0.0).then(|| h.xyz() / h.w)
}

fn is_in(map: &Value, p: DVec3) -> bool {
    let [low, high] = [-1e-6, 1.0 + 1e-6].map(DVec3::splat);
    project(map, p).is_some_and(|q| q.cmpge(low).all() && q.cmple(high).all())
}

/// What holds of every plan: whole numbers of texels, finite figures, rectangles apart and inside.
fn check(plan: &Value) {
    let mut texels = 0;
    let mut rects: Vec<[u64; 4]> = Vec::new();
    for map in maps(plan) {
        let [w, h] = size(&map["resolution"]);
        texels += w * h;
        assert_eq!(map["empty"], w * h == 0);
        assert_eq!(map["rect"].is_null(), w * h == 0 || plan["atlas"].is_null());
        if !map["rect"].is_null() {
            let [x, y, width, height] = serde_json::from_value(map["rect"].clone()).unwrap();
            assert_eq!([width, height], [w, h]);
            rects.push([x, y, w, h]);
        }
        for entry in map["world_to_shadow"].as_array().unwrap() {
            assert!(entry.as_array().unwrap().iter().all(Value::is_f64), "{map}");
        }
        for error in ["max_s", "max_t", "max"] {
            let error = number(&map["error"][error]);
            assert!(error >= 0.0 && (w * h == 0) == (error == 0.0), "{map}");
        }
        let [near, far] = split(map);
        assert!(near <= far && near >= 0.0, "{map}");
    }
    assert_eq!(plan["texels"], texels);
    if plan["atlas"].is_null() {
        return;
    }
    let [width, height] = size(&plan["atlas"]["size"]);
    let gutter = plan["atlas"]["gutter"].as_u64().unwrap();
    for (i, [x, y, w, h]) in rects.iter().enumerate() {
        assert!(*x >= gutter && x + w + gutter <= width, "{rects:?} in {width}x{height}");
        assert!(*y >= gutter && y + h + gutter <= height, "{rects:?} in {width}x{height}");
        for [x2, y2, w2, h2] in &rects[..i] {
            let gap = 2 * gutter;
            let apart = x + w + gap <= *x2 || x2 + w2 + gap <= *x;
            assert!(apart || y + h + gap <= *y2 || y2 + h2 + gap <= *y, "{rects:?}");
        }
    }
}

#[test]
fn slices_are_self_similar_unless_told() {
    let ends = |shadows: &str| -> Vec<f64> {
        let plan = plan(shadows, "");
        check(&plan);
        let maps = maps(&plan);
        for (i, map) in maps.iter().enumerate() {
            assert_eq!((&map["slice"], &map["face"]), (&json!(i), &Value::Null));
        }
        let begins = maps.iter().map(|m| split(m)[0]);
        let ends = maps.iter().map(|m| split(m)[1]);
        assert!(begins.clone().skip(1).eq(ends.clone().take(maps.len() - 1)), "{shadows}: gaps");
        begins.take(1).chain(ends).collect()
    };
    let similar = |i: f64| NEAR * (FAR / NEAR).powf(i / 4.0);
    let even = |i: f64| NEAR + (FAR - NEAR) * i / 4.0;
    let all = [0.0, 1.0, 2.0, 3.0, 4.0];
    for (shadows, expected) in [
        ("lispsm+z1", vec![NEAR, FAR]),
        ("lispsm+z4", all.map(similar).to_vec()),
        ("uniform+z4(overlap=0.1)", all.map(similar).to_vec()),
        ("uniform(stable)+z4", all.map(similar).to_vec()),
        ("psm+z4(practical=0)", all.map(even).to_vec()),
        ("tsm+z4(practical=0.25)", all.map(|i| 0.25 * similar(i) + 0.75 * even(i)).to_vec()),
        ("adaptive+z4(at=5/20/60,overlap=0.5)", vec![NEAR, 5.0, 20.0, 60.0, FAR]),
        // Slices of one view under one light are alike: fitting them changes nothing.
        ("lispsm+z4(fitted)", all.map(similar).to_vec()),
    ] {
        let ends = ends(shadows);
        let tolerance = if shadows.contains("fitted") { 0.05 } else { 1e-9 };
        assert_eq!(ends.len(), expected.len(), "{shadows}");
        let close = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < tolerance;
        assert!(ends.iter().zip(&expected).all(close), "{shadows}: {ends:?}, not {expected:?}");
    }
}

/// All maps share one budget so that all have the same error; exact sizes are each map's own.
#[test]
fn maps_share_the_texels() {
    for shadows in ["uniform+z4", "lispsm+z3+face", "adaptive+z4@512"] {
        let plan = plan(shadows, "");
        check(&plan);
        let budget = if shadows.ends_with("@512") { 512 * 512 } else { 1024 * 1024 };
        let texels = plan["texels"].as_u64().unwrap();
        assert!(texels <= budget && texels > budget * 97 / 100, "{shadows}: {texels}");
        let errors: Vec<f64> = full(&plan).map(|m| number(&m["error"]["max_s"])).collect();
        let most = errors.iter().copied().fold(0.0, f64::max);
        assert!(errors.iter().all(|e| *e > 0.9 * most), "{shadows}: {errors:?}");
    }
    let plan = plan("lispsm+z3@300x200", "");
    assert!(maps(&plan).iter().all(|m| m["resolution"] == json!([300, 200])));
    assert_eq!(plan["texels"], 3 * 300 * 200);
    assert_eq!(plan["layers"], json!({"size": [300, 200], "count": 3}));
}

#[test]
fn faces_have_maps_of_their_own() {
    let faces = |shadows: &str, sun: &str| -> Vec<(String, u64)> {
        let plan = plan(shadows, sun);
        check(&plan);
        let name = |m: &Value| m["face"].as_str().unwrap().to_owned();
        maps(&plan).iter().map(|m| (name(m), m["slice"].as_u64().unwrap())).collect()
    };
    let names = ["bottom", "right", "top", "left", "near"].map(|f| (f.to_owned(), 0));
    // Their number and order are the same wherever the light is.
    for sun in
        ["--sun 0.3,-1,0.2", "--sun 0,-0.1,1", "--sun 0,-0.1,-1", "--sun 0,0,-1", "--sun 0,0,1"]
    {
        assert_eq!(faces("lispsm+face", sun), names);
        assert_eq!(faces("lispsm+face(sides)", sun), names[..4]);
        let sliced: Vec<_> =
            names[..4].iter().flat_map(|(f, _)| [0, 1].map(|s| (f.clone(), s))).collect();
        assert_eq!(faces("lispsm+z2+face", sun), [&sliced[..], &names[4..]].concat());
    }
}

/// Every point of the view lands in a map that is for it.
#[test]
fn maps_leave_no_hole() {
    for shadows in [
        "uniform+z4",
        "uniform(stable)+z3(overlap=0.2)",
        "lispsm+face",
        "adaptive+z3+face(sides)",
        "psm+z2(at=40)+face",
    ] {
        for sun in ["--sun 0.3,-1,0.2", "--sun 0.1,-0.3,1", "--sun -0.2,-0.1,-1"] {
            let plan = plan(shadows, sun);
            check(&plan);
            let tan = 30f64.to_radians().tan();
            for i in 0..=8u32 {
                let depth = NEAR * (FAR / NEAR).powf(f64::from(i) / 8.0);
                for (x, y) in [(0.0, 0.0), (0.9, 0.4), (-0.5, 0.8), (-0.8, -0.9), (0.2, -0.99)] {
                    let right = x * tan * depth * 16.0 / 9.0;
                    let p = DVec3::new(right, 2.0 + y * tan * depth, -depth * (1.0 - 1e-9));
                    let serves = |m: &&Value| {
                        let [near, far] = split(m);
                        let by_depth = (near * (1.0 - 1e-6)..=far * (1.0 + 1e-6)).contains(&depth);
                        // A face's range runs along the face.
                        is_in(m, p) && (by_depth || !m["face"].is_null())
                    };
                    assert!(full(&plan).any(|m| serves(&m)), "{shadows} {sun}: {p}");
                }
            }
        }
    }
}

#[test]
fn odd_requests_give_sound_plans() {
    let z1 = plan("lispsm+z1", "");
    assert_eq!(z1, plan("lispsm", ""));
    for shadows in ["uniform", "lispsm", "psm", "tsm", "adaptive", "log"] {
        for (partition, count) in [("", 1), ("+z16", 16), ("+face", 5), ("+z16+face", 65)] {
            let shadows = format!("{shadows}{partition}");
            for options in [
                // Light along the view, from behind and from ahead, and straight down.
                "--sun 0,0,-1",
                "--sun 0,0,1",
                "--sun 0,-1,0",
                // A view that has hardly any depth.
                "--near 499.95",
                // A picture of one pixel; a very narrow one; almost all that can be seen.
                "--size 1x1",
                "--size 1x16384",
                "--fov 179",
            ] {
                let base = "plan --eye 0,2,0 --target 0,2,-1 --far 500 --json --shadows";
                let near = if options.contains("--near") { "" } else { "--near 0.1" };
                let words: Vec<&str> = base
                    .split(' ')
                    .chain([shadows.as_str()])
                    .chain(options.split(' '))
                    .chain(near.split_whitespace())
                    .collect();
                let plan = Desk::new().json(&words);
                check(&plan);
                assert_eq!(maps(&plan).len(), count, "{shadows} {options}");
            }
        }
    }
    // As few texels as there can be.
    let tiny = plan("lispsm@1", "");
    assert_eq!((&tiny["texels"], &tiny["atlas"]["size"]), (&json!(1), &json!([1, 1])));
    let each = plan("lispsm+z16@4", "");
    check(&each);
    assert_eq!(each["texels"], 16);
}

#[test]
fn gutters_are_as_wide_as_the_filter_reaches() {
    for (filter, gutter) in [("", 0), (":hard", 0), (":pcf1", 1), (":pcf3", 2), (":pcf15", 8)] {
        let plan = plan(&format!("lispsm+z2+face{filter}"), "");
        check(&plan);
        assert_eq!(plan["atlas"]["gutter"], gutter);
        let largest = [0, 1].map(|side| {
            full(&plan).map(|m| size(&m["resolution"])[side]).max().unwrap() + 2 * gutter
        });
        assert_eq!(plan["layers"], json!({"size": largest, "count": 9}));
        let [w, h] = size(&plan["atlas"]["size"]);
        let texels = plan["texels"].as_u64().unwrap();
        assert!(w * h < texels * 13 / 10, "{filter}: {w}x{h} for {texels}");
    }
}

/// What no device can hold in one texture is told apart from the plan, which is fine.
#[test]
fn atlases_can_be_too_large() {
    let huge = plan("uniform+z2@16384x16384", "");
    check(&huge);
    assert_eq!(huge["atlas"], Value::Null);
    assert_eq!(huge["layers"], json!({"size": [16384, 16384], "count": 2}));
    let filtered = plan("uniform:pcf3@16384x16384", "");
    assert_eq!((&filtered["atlas"], &filtered["layers"]), (&Value::Null, &Value::Null));
    assert_eq!(filtered["texels"], 16384u64 * 16384);
}

#[test]
fn the_largest_error_decides_the_size() {
    let texels = |shadows: &str, pixels: f64| {
        let plan = plan(shadows, &format!("--max-error {pixels}"));
        check(&plan);
        for map in full(&plan) {
            let error = number(&map["error"]["max"]);
            assert!(error <= pixels && error > 0.9 * pixels, "{shadows} {pixels}: {error}");
        }
        number(&plan["texels"])
    };
    for shadows in ["adaptive", "lispsm+z4", "uniform+z8", "lispsm+z2+face", "uniform(stable)+z8"] {
        let ratio = texels(shadows, 20.0) / texels(shadows, 40.0);
        assert!((3.6..4.4).contains(&ratio), "{shadows}: {ratio}");
    }
    // More slices, fewer texels.
    assert!(texels("lispsm+z4", 40.0) < 0.1 * texels("lispsm", 40.0));

    let desk = Desk::new();
    let table = desk.succeed(&["plan", "pole", "--shadows", "lispsm+z2", "--max-error", "1.5"]);
    assert!(table.contains("for at most 1.5 px a texel"), "{table}");
}

#[test]
fn lights_share_a_plan() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let stage = |options: &str| {
        let words = format!("plan stage.gltf --json --size 320x180 --shadows uniform+z2 {options}");
        let plan = desk.json(&words.split_whitespace().collect::<Vec<_>>());
        check(&plan);
        plan
    };
    let plan = stage("--light torch --light noon --light bulb");
    let lights = plan["lights"].as_array().unwrap();
    for (light, (name, range)) in
        lights.iter().zip([("torch", [0, 2]), ("noon", [2, 4]), ("bulb", [4, 16])])
    {
        assert_eq!(keys(light), ["light", "maps", "name", "theta_deg"]);
        assert_eq!((&light["name"], &light["maps"]), (&json!(name), &json!(range)));
        // Alone, a light has the same angle.
        assert_eq!(light["theta_deg"], stage(&format!("--light {name}"))["theta_deg"]);
    }
    assert_eq!(plan["theta_deg"], lights[0]["theta_deg"]);
    let of = |key: &str| maps(&plan).iter().map(|m| m[key].clone()).collect::<Vec<_>>();
    let expected: Vec<Value> =
        [0, 1, 2].iter().flat_map(|&l| vec![json!(l); if l == 2 { 12 } else { 2 }]).collect();
    assert_eq!(of("light"), expected);
    let sides = ["+x", "-x", "+y", "-y", "+z", "-z"].iter().flat_map(|s| [json!(s), json!(s)]);
    assert_eq!(of("side"), vec![Value::Null; 4].into_iter().chain(sides).collect::<Vec<_>>());
    let texels = plan["texels"].as_u64().unwrap();
    assert!(texels <= 1 << 20 && texels > 1_000_000, "{texels}");

    let table = desk.succeed(&["plan", "stage.gltf", "--light", "torch", "--light", "noon"]);
    for part in ["view and torch", "view and noon", "map 0: torch: ", "map 1: noon: ", "layers of"]
    {
        assert!(table.contains(part), "{part}: {table}");
    }
}

/// Two triangles, one before the camera and one far off to the side: one of them need not be drawn.
#[test]
fn casters_that_cannot_cast_are_counted() {
    let desk = Desk::new();
    let second = r#"{"mesh": 0, "translation": [1000, 0, 0]},"#;
    let stage = STAGE_GLTF
        .replace(r#""nodes": [0, "#, r#""nodes": [6, 0, "#)
        .replace(
            r#"    {"translation": [0, 3, 0]"#,
            &format!("    {second}\n    {{\"translation\": [0, 3, 0]"),
        )
        .replace(r#"[6, 0, 1, 2, 3, 4, 5]"#, r#"[0, 1, 2, 3, 4, 5, 6]"#);
    assert!(stage.contains(second));
    desk.write("stage.gltf", &stage);
    let words = "plan stage.gltf --camera front --light noon --shadows uniform+z2 --json";
    let plan = desk.json(&words.split(' ').collect::<Vec<_>>());
    check(&plan);
    for map in full(&plan) {
        assert_eq!(map["casters"], json!({"drawn": 1, "culled": 1}));
    }
    assert_eq!(plan["casters_culled"], 0.5);

    let town = desk.json(&["plan", "town", "--shadows", "adaptive+z4", "--json"]);
    let sums: Vec<[u64; 2]> = maps(&town)
        .iter()
        .map(|m| ["drawn", "culled"].map(|k| m["casters"][k].as_u64().unwrap()))
        .collect();
    let [drawn, culled] =
        sums.iter().fold([0, 0], |[d, c], [drawn, culled]| [d + drawn, c + culled]);
    assert!(sums.iter().all(|[d, c]| d + c == sums[0][0] + sums[0][1]), "{sums:?}");
    assert!(sums[0][0] < sums[3][0], "the first slice is the smallest: {sums:?}");
    let share = number(&town["casters_culled"]);
    assert!(
        (share - culled as f64 / (drawn + culled) as f64).abs() < 1e-12 && share > 0.5,
        "{share}"
    );
}
