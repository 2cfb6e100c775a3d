//! What scenes have and what is taken of them: `info`, the words that choose cameras, lights and
//! nodes, near planes, skies, and ground.

use crate::bad_input::refuses;
use crate::desk::{Desk, keys};
use image::GrayImage;
use serde_json::{Value, json};
use umbrage_testing::needs;

/// A node that draws a box: its name, its middle, and half its edges.
pub(crate) type Block<'a> = (&'a str, [f64; 3], [f64; 3]);

const GROUND: Block<'_> = ("Ground", [0.0, -0.5, 0.0], [4000.0, 0.5, 4000.0]);
const TOWER: Block<'_> = ("Tower", [0.0, 1.0, 0.0], [0.4, 1.0, 0.4]);
const NEAR_POST: Block<'_> = ("Post", [1.2, 0.6, 2.8], [0.05, 0.6, 0.05]);
const SKY: Block<'_> = ("Sky", [0.0, 0.0, 0.0], [9000.0, 9000.0, 9000.0]);

/// Before them, a little above the ground.
const VIEW: [&str; 10] = [
    "--eye",
    "2,1.7,5",
    "--target",
    "0,0.5,0",
    "--sun=-0.5,-1,-0.35",
    "--size",
    "96x54",
    "--backend",
    "reference",
    "--shadows=uniform@64",
];

/// Writes a scene of blocks. `more` are further nodes, and the parts of the file that they need.
pub(crate) fn write(desk: &Desk, name: &str, blocks: &[Block<'_>], more: &Value) {
    let mut corners: Vec<u8> = Vec::new();
    for i in 0..8 {
        for bit in 0..3 {
            let side = if i >> bit & 1 == 1 { 1.0f32 } else { -1.0 };
            corners.extend(side.to_le_bytes());
        }
    }
    let faces = [
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6u16],
    ];
    corners.extend(faces.iter().flatten().flat_map(|i| i.to_le_bytes()));
    std::fs::write(desk.path("box.bin"), corners).unwrap();
    let mut nodes: Vec<Value> = blocks
        .iter()
        .map(|(name, middle, half)| {
            json!({"name": name, "mesh": 0, "translation": middle, "scale": half})
        })
        .collect();
    let mut gltf = json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
             "min": [-1, -1, -1], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [{"byteLength": 168, "uri": "box.bin"}],
    });
    for (key, value) in more.as_object().unwrap() {
        match key.as_str() {
            "nodes" => nodes.extend(value.as_array().unwrap().iter().cloned()),
            _ => gltf[key] = value.clone(),
        }
    }
    gltf["scenes"] = json!([{"nodes": (0..nodes.len()).collect::<Vec<_>>()}]);
    gltf["nodes"] = json!(nodes);
    desk.write(name, &gltf.to_string());
}

/// A picture of a scene, 8-bit grey.
fn picture(desk: &Desk, scene: &str, aov: &str, options: &[&str]) -> GrayImage {
    let args = ["render", scene, "-o", "p.png", "--samples", "1", "--aov", aov];
    desk.succeed(&[&args[..], &VIEW, options].concat());
    image::open(desk.path("p.png")).unwrap().to_luma8()
}

fn info(desk: &Desk, scene: &str, options: &[&str]) -> Value {
    desk.json(&[&["info", scene, "--json"], options].concat())
}

#[test]
fn nothing_before_the_eye_is_cut_away() {
    let desk = Desk::new();
    let blocks = [GROUND, TOWER, NEAR_POST];
    write(&desk, "vast.gltf", &blocks, &json!({}));
    write(&desk, "sky.gltf", &[&blocks[..], &[SKY]].concat(), &json!({}));
    let view = &VIEW[..4];
    for scene in ["vast.gltf", "sky.gltf"] {
        let found = info(&desk, scene, view);
        let near = found["view"]["near"].as_f64().unwrap();
        // The post's nearest edge in the picture, and what is left of it without rounding.
        assert!((0.5..2.6).contains(&near), "{scene}: {near}");
        let own = picture(&desk, scene, "normal", &[]);
        let near = picture(&desk, scene, "normal", &["--near", "0.05"]);
        assert_eq!(own, near, "{scene}");
        // A plane that cuts is told of, once.
        let args = ["plan", scene, "--near", "4"];
        let told = desk.run(&[&args[..], view].concat()).stderr;
        let cuts = told.lines().filter(|l| l.contains("the near plane") && l.contains("cuts"));
        assert_eq!(cuts.count(), 1, "{told}");
        assert_ne!(picture(&desk, scene, "normal", &["--near", "4"]), own, "{scene}");
        let fine = desk.run(&[&["plan", scene][..], view].concat()).stderr;
        assert!(!fine.contains("the near plane"), "{fine}");
    }
}

#[test]
fn a_sky_decides_neither_size_nor_view_and_can_be_left_out() {
    let desk = Desk::new();
    let blocks = [("Ground", [0.0, -0.5, 0.0], [40.0, 0.5, 40.0]), TOWER, NEAR_POST];
    write(&desk, "bare.gltf", &blocks, &json!({}));
    write(&desk, "sky.gltf", &[&[SKY], &blocks[..]].concat(), &json!({}));
    let [bare, sky] = ["bare.gltf", "sky.gltf"].map(|scene| info(&desk, scene, &[]));
    for field in ["size", "view", "light"] {
        assert_eq!(bare[field], sky[field], "{field}");
    }
    let notices = |info: &Value| info["notices"].to_string();
    assert!(notices(&sky).contains("`Sky` surrounds everything else"), "{sky}");
    assert!(!notices(&bare).contains("surrounds"), "{bare}");
    let plan = |scene: &str| {
        let args = ["plan", scene, "--shadows", "uniform+z2@256", "--json"];
        desk.json(&[&args[..], &VIEW[..4]].concat())["maps"].clone()
    };
    let casters = |maps: Value| {
        let mut maps = maps;
        for map in maps.as_array_mut().unwrap() {
            map["casters"] = Value::Null;
        }
        maps
    };
    assert_eq!(casters(plan("bare.gltf")), casters(plan("sky.gltf")));
    // It hides the sun, as the file says, until it is left out.
    assert!(
        picture(&desk, "sky.gltf", "truth", &[]).pixels().all(|p| p.0[0] == 0 || p.0[0] == 255)
    );
    let lit = |scene: &str, options: &[&str]| picture(&desk, scene, "truth", options);
    assert_ne!(lit("bare.gltf", &[]), lit("sky.gltf", &[]));
    for without in ["Sky", "#1"] {
        assert_eq!(lit("bare.gltf", &[]), lit("sky.gltf", &["--without", without]), "{without}");
        let told = info(&desk, "sky.gltf", &["--without", without]);
        assert!(!notices(&told).contains("surrounds"), "{told}");
    }
    let shown = lit("sky.gltf", &["--without", "Sky:casting"]);
    let alike = shown.pixels().zip(lit("bare.gltf", &[]).pixels()).filter(|(a, b)| a == b).count();
    assert!(alike > 96 * 54 / 2, "{alike} pixels of the ground are as without a sky");
}

/// What casts, what is seen, and both together, on one backend.
fn nodes_are_left_out(backend: &str) {
    let desk = Desk::new();
    let ground = ("Ground", [0.0, -0.5, 0.0], [40.0, 0.5, 40.0]);
    write(&desk, "all.gltf", &[ground, TOWER], &json!({}));
    write(&desk, "ground.gltf", &[ground], &json!({}));
    let of = |scene: &str, aov: &str, without: &[&str]| {
        let options = ["--backend", backend, "--shadows=uniform@512"];
        let args = ["render", scene, "-o", "p.png", "--samples", "1", "--aov", aov];
        desk.succeed(&[&args[..], &VIEW[..7], &options, without].concat());
        image::open(desk.path("p.png")).unwrap().to_luma8()
    };
    let dark = |p: &GrayImage| p.pixels().filter(|p| p.0[0] < 128).count();
    for aov in ["visibility", "truth"] {
        let all = of("all.gltf", aov, &[]);
        let none = of("ground.gltf", aov, &[]);
        assert_eq!(of("all.gltf", aov, &["--without", "Tower"]), none, "{aov}");
        assert_eq!(dark(&none), 0, "{aov}");
        // It stands there, with its lit sides before the eye, but its shadow on the ground is gone.
        assert_eq!(dark(&of("all.gltf", aov, &["--without", "Tower:casting"])), 0, "{aov}");
        assert!(dark(&all) > 4, "{aov}");
        // All of its shadow is there, also what the tower hides from the eye.
        let unseen = of("all.gltf", aov, &["--without", "Tower:receiving"]);
        assert!(dark(&unseen) > 2 * dark(&all), "{aov}");
    }
    let depth = |without: &[&str]| of("all.gltf", "normal", without);
    let none = of("ground.gltf", "normal", &[]);
    assert_eq!(depth(&["--without", "Tower:casting"]), depth(&[]));
    assert_eq!(depth(&["--without", "Tower:receiving"]), none);
    assert_eq!(depth(&["--without", "Tower:casting", "--without", "Tower:receiving"]), none);
}

#[test]
fn nodes_are_left_out_by_rays() {
    nodes_are_left_out("reference");
}

#[needs(gpu)]
#[test]
fn nodes_are_left_out_by_a_gpu() {
    nodes_are_left_out("gpu");
}

#[test]
fn nodes_that_are_not_there_and_scenes_without_anything_are_refused() {
    let desk = Desk::new();
    write(&desk, "all.gltf", &[GROUND, TOWER], &json!({}));
    for (without, expected) in [
        ("Towr", "--without: the scene has no node `Towr`; there are Ground or #1, Tower or #2"),
        ("#3", "--without: the scene has no node `#3`"),
        ("Tower:cast", "no node `Tower:cast`"),
        ("", "no node ``"),
    ] {
        refuses(&desk, &["plan", "all.gltf", "--without", without], expected);
    }
    let nothing = ["plan", "all.gltf", "--without", "Ground", "--without", "Tower:receiving"];
    refuses(&desk, &nothing, "--without: nothing is left to see");
    refuses(&desk, &["plan", "pole", "--without", "x"], "the scene has no node `x`, nor any other");
    let without_scene =
        ["plan", "--eye", "0,0,0", "--target", "0,0,1", "--near", "1", "--far", "9", "--ground"];
    refuses(&desk, &without_scene, "--ground changes a scene");
}

#[test]
fn names_that_several_have_choose_none_and_numbers_always_do() {
    let desk = Desk::new();
    let lights = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "name": "Bulb"}, {"type": "point", "name": "Left"},
    ]}});
    let lamp = |name: &str, light: usize, x: f64| {
        json!({"name": name, "translation": [x, 3, 0],
               "extensions": {"KHR_lights_punctual": {"light": light}}})
    };
    let lens = |name: &str, x: f64| json!({"name": name, "camera": 0, "translation": [x, 2, 9]});
    let nodes = json!([
        lamp("Left", 0, -2.0),
        lamp("Right", 0, 2.0),
        lamp("#1", 1, 4.0),
        lens("Twin", -1.0),
        lens("Twin", 1.0),
        lens("Odd", 3.0),
    ]);
    let cameras = json!([{"type": "perspective", "name": "Lens",
        "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 50}}]);
    let more = json!({"extensions": lights, "extensionsUsed": ["KHR_lights_punctual"],
        "cameras": cameras, "nodes": nodes});
    write(&desk, "shared.gltf", &[TOWER], &more);
    let found = info(&desk, "shared.gltf", &[]);
    let words = |kind: &str| -> Vec<Value> {
        found[kind].as_array().unwrap().iter().map(|of| of["words"].clone()).collect()
    };
    // The third light's own name is the first one's node, and its node is called as the first's
    // number.
    assert_eq!(words("lights"), [json!(["Left", "#1"]), json!(["Right", "#2"]), json!(["#3"])]);
    assert_eq!(words("cameras"), [json!(["#1"]), json!(["#2"]), json!(["Odd", "#3"])]);
    for (kind, option) in [("lights", "--light"), ("cameras", "--camera")] {
        for (i, words) in words(kind).iter().enumerate() {
            for word in words.as_array().unwrap() {
                let taken = info(&desk, "shared.gltf", &[option, word.as_str().unwrap()]);
                let (taken, key) = match kind {
                    "lights" => (&taken["light"], "position"),
                    _ => (&taken["view"], "eye"),
                };
                assert_eq!(taken[key], found[kind][i][key], "{option} {word}");
                assert_eq!(taken["name"], words[0], "{option} {word}");
            }
        }
    }
    for (option, word, expected) in [
        (
            "--light",
            "Bulb",
            "2 of the name `Bulb`, which chooses none; there are Left or #1, Right or #2, #3",
        ),
        ("--light", "#4", "--light: the scene has no light `#4`; there are"),
        ("--camera", "Twin", "2 of the name `Twin`"),
        ("--camera", "Lens", "3 of the name `Lens`"),
        ("--camera", "#0", "--camera: the scene has no camera `#0`"),
    ] {
        refuses(&desk, &["info", "shared.gltf", option, word], expected);
    }
}

#[test]
fn info_tells_what_is_there() {
    let desk = Desk::new();
    let found = info(&desk, "lamps:3", &[]);
    let expected = [
        "animations",
        "bounds",
        "cameras",
        "instances",
        "light",
        "lights",
        "materials",
        "meshes",
        "nodes",
        "notices",
        "scene",
        "size",
        "textures",
        "triangles",
        "view",
    ];
    assert_eq!(keys(&found), expected);
    assert_eq!(found["lights"].as_array().unwrap().len(), 27);
    let text = desk.succeed(&["info", "lamps:3"]);
    for light in found["lights"].as_array().unwrap() {
        assert!(text.contains(light["words"][0].as_str().unwrap()), "{text}");
    }
    // The view and light that it names are those that are taken.
    let plan = desk.json(&["plan", "lamps:3", "--json"]);
    assert_eq!((&plan["view"], &plan["lights"][0]["light"]), (&found["view"], &found["light"]));
    let told = text.lines().find_map(|l| l.strip_prefix("takes view")).unwrap();
    let options = told.trim().split(", ").last().unwrap();
    let again = [vec!["plan", "lamps:3", "--json"], options.split(' ').collect()].concat();
    let far = desk.json(&again)["view"]["far"].as_f64().unwrap();
    assert!((far / found["view"]["far"].as_f64().unwrap() - 1.0).abs() < 1e-5, "{options}");
}

#[test]
fn the_sun_stands_where_its_angles_say() {
    let desk = Desk::new();
    write(&desk, "all.gltf", &[GROUND, TOWER], &json!({}));
    for (angles, sun) in [("90,45", "-1,-1,0"), ("180,0", "0,0,-1"), ("-45,35.26438968", "1,-1,1")]
    {
        let [by_angles, by_sun] = [format!("--sun-angles={angles}"), format!("--sun={sun}")]
            .map(|option| info(&desk, "all.gltf", &[&option])["light"]["direction"].clone());
        for axis in 0..3 {
            let [a, b] = [&by_angles, &by_sun].map(|d| d[axis].as_f64().unwrap());
            assert!((a - b).abs() < 1e-9, "{angles}: {by_angles} {by_sun}");
        }
    }
    for (options, expected) in [
        (&["--sun-angles", "90"][..], "--sun-angles"),
        (&["--sun-angles", "90,95"], "-90 to 90 degrees above the horizon"),
        (&["--sun-angles", "90,45", "--sun", "0,-1,0"], "cannot be used with"),
        (&["--sun-angles", "90,45", "--light", "x"], "cannot be used with"),
    ] {
        refuses(&desk, &[&["plan", "all.gltf"], options].concat(), expected);
    }
}

#[test]
fn ground_lies_under_a_model() {
    let desk = Desk::new();
    write(&desk, "model.gltf", &[("Model", [5.0, 1.0, 0.0], [1.0, 1.0, 1.0])], &json!({}));
    let found = info(&desk, "model.gltf", &["--ground"]);
    assert_eq!(found["bounds"]["min"][1], 0.0);
    assert_eq!(found["size"][1], 2.0);
    assert!(found["size"][0].as_f64().unwrap() > 10.0, "{found}");
    assert_eq!(found["triangles"]["drawn"], 14);
    let shadows = |options: &[&str]| {
        let args = ["render", "model.gltf", "-o", "p.png", "--aov", "truth", "--size", "96x54"];
        let view = ["--eye=-2,6,9", "--target=5,0,0", "--sun-angles=60,40", "--backend=reference"];
        desk.succeed(&[&args[..], &view, options].concat());
        let image = image::open(desk.path("p.png")).unwrap().to_luma8();
        image.pixels().filter(|p| p.0[0] == 0).count()
    };
    assert!(shadows(&["--ground"]) > shadows(&[]) + 50);
}

/// A still of an animation is planned, rendered and told of as a scene that stands so.
#[test]
fn animations_pose_scenes() {
    let desk = Desk::new();
    let floor = ("Floor", [0.0, -3.0, 0.0], [20.0, 1.0, 20.0]);
    let at = |x: f64| [floor, ("Model", [x, -1.0, -1.0], [1.0, 1.0, 1.0])];
    // The keys are numbers of the corners: at -1 s and 1 s, from (-1, -1, -1) to (1, -1, -1).
    let accessor = |offset: u64, kind: &str, count: u64| {
        json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": count,
               "type": kind})
    };
    let indices = json!({"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"});
    let more = json!({
        "accessors": [accessor(0, "VEC3", 8), indices, accessor(8, "SCALAR", 2),
                      accessor(0, "VEC3", 2)],
        "animations": [{
            "name": "Slide", "samplers": [{"input": 2, "output": 3}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
        }],
    });
    write(&desk, "moving.gltf", &at(9.0), &more);
    write(&desk, "rest.gltf", &at(9.0), &json!({}));
    write(&desk, "half.gltf", &at(0.5), &json!({}));
    let found = info(&desk, "moving.gltf", &[]);
    assert_eq!(found["animations"], json!([{"words": ["Slide", "#1"], "duration": 1.0}]));
    assert!(desk.run(&["info", "moving.gltf"]).stdout.contains("animation   Slide or #1: 1 s"));
    assert_eq!(info(&desk, "rest.gltf", &[])["animations"], json!([]));
    let half = ["--animation", "Slide", "--time", "0.5"];
    for aov in ["normal", "truth", "visibility"] {
        let of = |scene: &str, options: &[&str]| picture(&desk, scene, aov, options);
        assert_eq!(of("moving.gltf", &half), of("half.gltf", &[]), "{aov}");
        assert_eq!(of("moving.gltf", &[]), of("rest.gltf", &[]), "{aov}");
        assert_ne!(of("moving.gltf", &["--animation=#1"]), of("half.gltf", &[]), "{aov}");
    }
    for (options, expected) in [
        (
            ["--animation", "Slyde", ""],
            "--animation: the scene has no animation `Slyde`; there are Slide or #1",
        ),
        (["--animation", "#2", ""], "--animation: the scene has no animation `#2`"),
        (["--animation", "Slide", "--time=-1"], "must be a number of seconds, at least 0"),
        (["--animation", "Slide", "--time=nan"], "must be a number of seconds, at least 0"),
        (["--time", "1", ""], "--animation"),
    ] {
        let options = options.into_iter().filter(|o| !o.is_empty());
        let args: Vec<&str> = ["plan", "moving.gltf"].into_iter().chain(options).collect();
        refuses(&desk, &args, expected);
    }
    refuses(&desk, &["info", "pole", "--animation", "x"], "no animation `x`, nor any other");
}

#[test]
fn several_pictures_come_of_one_run_and_names_are_made_for_new_ones() {
    let desk = Desk::new();
    let common = ["--size", "32x18", "--samples", "1", "--backend", "reference"];
    let run = |args: &[&str]| {
        let run = desk.run(&[&["render", "pole"], args, &common].concat());
        assert_eq!((run.code, run.stdout.as_str()), (0, ""), "{args:?}: {}", run.stderr);
        run.stderr.lines().filter(|l| l.starts_with("wrote: ")).map(str::to_owned).collect()
    };
    let told: Vec<String> = run(&["-o", "a.b.png", "--aov", "color,truth", "--aov", "depth"]);
    assert_eq!(told, ["wrote: a.b-color.png", "wrote: a.b-truth.png", "wrote: a.b-depth.png"]);
    // Each is what a run of its own makes.
    for aov in ["color", "truth", "depth"] {
        run(&["-o", "own.png", "--aov", aov]);
        let [one, of_many] = ["own.png".to_owned(), format!("a.b-{aov}.png")]
            .map(|name| image::open(desk.path(&name)).unwrap().to_rgb8());
        assert_eq!(one, of_many, "{aov}");
    }
    // Nothing that is there is replaced by a name that nobody gave.
    desk.write("pole.png", "precious");
    let told: Vec<String> = run(&[]);
    assert_eq!(told, ["wrote: pole-2.png"]);
    assert_eq!(std::fs::read_to_string(desk.path("pole.png")).unwrap(), "precious");
    let told: Vec<String> = run(&["--aov", "visibility,error"]);
    assert_eq!(told, ["wrote: pole-visibility.png", "wrote: pole-error.png"]);
    let told: Vec<String> = run(&["--aov", "visibility"]);
    assert_eq!(told, ["wrote: pole-2-visibility.png"]);
    refuses(&desk, &["render", "pole", "--aov", "truth,truth"], "--aov: `truth` is given twice");
}

#[test]
fn reports_go_to_a_folder_of_their_own_unless_told() {
    let desk = Desk::new();
    let args = ["compare", "pole", "--shadows", "uniform@16", "--size", "16x9"];
    for _ in 0..2 {
        desk.succeed(&args);
        assert_eq!(desk.listing(), ["report"]);
    }
    desk.write("report/thesis.tex", "precious");
    refuses(&desk, &args, "--output: report holds thesis.tex");
}

#[test]
fn commands_tell_what_they_take() {
    let desk = Desk::new();
    let size = ["--size", "16x9"];
    for args in [
        &["render", "pole", "-o", "p.png"][..],
        &["compare", "pole", "-o", "report", "--shadows", "uniform@16"],
        &["plan", "pole"],
        &["bench", "pole", "--shadows", "uniform@16", "--json"],
    ] {
        let is_plan = args[0] == "plan";
        let backend = if is_plan { &[][..] } else { &["--backend", "reference"] };
        let told = desk.run(&[args, &size, backend].concat()).stderr;
        let mut heads = vec!["view: camera `", "light: `sun`, --sun="];
        if !is_plan {
            heads.push("backend: reference");
        }
        for head in heads {
            let lines = told.lines().filter(|l| l.starts_with(head)).count();
            assert_eq!(lines, 1, "{args:?}: {head}: {told}");
        }
    }
    let plan = desk.succeed(&["plan", "pole"]);
    assert!(plan.contains("fitted to       the box around the scene"), "{plan}");
    assert_eq!(desk.json(&["plan", "pole", "--json"])["fit"], "box");
    assert_eq!(desk.json(&["plan", "pole", "--json", "--fit", "seen"])["fit"], "seen");
}

#[test]
fn shells_complete_command_lines() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = desk.succeed(&["completions", shell]);
        for word in ["umbrage", "sun-angles", "compare"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    refuses(&desk, &["completions", "basic"], "bash");
}

/// A sweep's views take the same words, and its scenes are changed alike.
#[test]
fn sweeps_take_the_same_options() {
    let desk = Desk::new();
    write(&desk, "all.gltf", &[GROUND, TOWER], &json!({}));
    desk.write(
        "views.json",
        r##"[{"name": "a", "scene": "all.gltf", "sun-angles": [90, 45], "size": [16, 9]},
             {"name": "b", "scene": "all.gltf", "sun-angles": [90, 95], "size": [16, 9]}]"##,
    );
    let args = ["sweep", "views.json", "--shadows", "uniform@16", "--backend", "reference"];
    let run = desk.run(&[&args[..], &["--without", "Tower"]].concat());
    assert!(run.stderr.contains("view `b`: sun-angles: must be an azimuth"), "{}", run.stderr);
    assert!(run.stderr.contains("light: --sun=-0.707107,-0.707107"), "{}", run.stderr);
    refuses(&desk, &args, "--without was `Tower`, is ``");
}
