use crate::desk::{Desk, STAGE_GLTF, keys};
use glam::{DMat4, DVec3, DVec4, Vec4Swizzles};
use serde_json::{Value, json};

const VIEW: [&str; 15] = [
    "plan",
    "--eye",
    "0,2,0",
    "--target",
    "0,2,-1",
    "--fov",
    "60",
    "--near",
    "0.1",
    "--far",
    "500",
    "--size",
    "1280x720",
    "--sun",
    "0.3,-1,0.2",
];

fn plan(shadows: &str) -> Value {
    Desk::new().json(&[&VIEW[..], &["--shadows", shadows, "--json"]].concat())
}

fn matrix(map: &Value) -> DMat4 {
    let columns: [[f64; 4]; 4] = serde_json::from_value(map["world_to_shadow"].clone()).unwrap();
    DMat4::from_cols_array_2d(&columns)
}

#[test]
fn json_has_the_documented_shape() {
    let plan = plan("lispsm@1024");
    assert_eq!(
        keys(&plan),
        [
            "atlas",
            "casters_culled",
            "fit",
            "layers",
            "lights",
            "maps",
            "storage_factor",
            "texels",
            "theta_deg",
            "view"
        ]
    );
    let map = &plan["maps"][0];
    assert_eq!(
        keys(map),
        [
            "casters",
            "empty",
            "error",
            "face",
            "lambda",
            "light",
            "rect",
            "resolution",
            "side",
            "slab",
            "slice",
            "split",
            "world_to_shadow"
        ]
    );
    assert_eq!(keys(&map["error"]), ["max", "max_s", "max_t"]);
    assert_eq!(map["face"], Value::Null);
    assert_eq!(map["split"], json!([0.1, 500.0]));
    let [w, h]: [u64; 2] = serde_json::from_value(map["resolution"].clone()).unwrap();
    assert_eq!(plan["texels"], w * h);
    assert!((1024 * 1000..=1024 * 1024).contains(&(w * h)), "{w}x{h}");
    assert!(map["lambda"].as_f64().unwrap() > 0.0);
    // View along −z, light (0.3, −1, 0.2): the angle between them.
    let expected = (-0.2 / DVec3::new(0.3, -1.0, 0.2).length()).acos().to_degrees();
    assert!((plan["theta_deg"].as_f64().unwrap() - expected).abs() < 1e-9);
    // What there is for one map without a scene.
    let theta = &plan["theta_deg"];
    let light = &plan["lights"][0];
    assert_eq!(keys(light), ["light", "maps", "name", "theta_deg"]);
    assert_eq!((&light["theta_deg"], &light["maps"]), (theta, &json!([0, 1])));
    assert_eq!((&light["light"]["kind"], &light["name"]), (&json!("directional"), &Value::Null));
    assert_eq!((&plan["view"]["far"], &plan["fit"]), (&json!(500.0), &Value::Null));
    assert_eq!(plan["atlas"], json!({"size": [w, h], "gutter": 0}));
    assert_eq!(plan["layers"], json!({"size": [w, h], "count": 1}));
    assert_eq!(map["rect"], json!([0, 0, w, h]));
    assert_eq!(
        (&map["slice"], &map["light"], &map["empty"]),
        (&json!(0), &json!(0), &json!(false))
    );
    for nothing in [&map["side"], &map["casters"], &plan["casters_culled"]] {
        assert_eq!(*nothing, Value::Null);
    }
}

#[test]
fn matrices_take_columns_and_beams_to_points() {
    let toward_light = -DVec3::new(0.3, -1.0, 0.2).normalize();
    for shadows in
        ["unfocused", "uniform", "psm", "lispsm", "tsm", "adaptive", "adaptive(area)", "lambda=20"]
    {
        let plan = plan(shadows);
        let matrix = matrix(&plan["maps"][0]);
        let project = |p: DVec3| -> DVec3 {
            let h: DVec4 = matrix * p.extend(1.0);
            h.xyz() / h.w
        };
        for seen in [
            DVec3::new(0.0, 2.0, -0.2),
            DVec3::new(3.0, 1.0, -20.0),
            DVec3::new(-90.0, 60.0, -450.0),
        ] {
            let p = project(seen);
            let inside =
                p.cmpge(DVec3::splat(-1e-6)).all() && p.cmple(DVec3::splat(1.0 + 1e-6)).all();
            assert!(inside, "{shadows}: {seen} lands at {p}");
            let caster = project(seen + toward_light * 0.05);
            assert!((caster - p).truncate().length() < 1e-6, "{shadows}: {p} {caster}");
            assert!(caster.z < p.z, "{shadows}: {p} {caster}");
        }
    }
}

#[test]
fn lambda_is_null_without_a_warp_and_kept_as_told() {
    assert_eq!(plan("uniform")["maps"][0]["lambda"], Value::Null);
    let told = plan("lambda=20")["maps"][0]["lambda"].as_f64().unwrap();
    assert!((told - 20.0).abs() < 1e-9, "{told}");
}

#[test]
fn exact_sizes_are_kept() {
    let plan = plan("tsm@640x480");
    assert_eq!(plan["maps"][0]["resolution"], json!([640, 480]));
    assert_eq!(plan["texels"], 640 * 480);
}

#[test]
fn the_table_tells_the_same() {
    let text = Desk::new().succeed(&[&VIEW[..], &["--shadows", "lispsm@640x480"]].concat());
    for part in
        ["lispsm@640x480", "307200", "640x480 texels", "0.1 to 500 metres", "λ =", "100.84°"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_scene_tightens_the_plan() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let camera = ["--size", "320x180", "--json", "--shadows", "uniform"];
    let front = desk.json(&[&["plan", "stage.gltf"], &camera[..]].concat());
    let named = desk.json(
        &[&["plan", "stage.gltf", "--camera", "front", "--light", "noon"], &camera[..]].concat(),
    );
    assert_eq!(front, named, "the first camera and the first light are the defaults");
    let above = desk.json(&[&["plan", "stage.gltf", "--camera", "above"], &camera[..]].concat());
    assert_ne!(front["theta_deg"], above["theta_deg"]);
    assert!(above["theta_deg"].as_f64().unwrap() < 1e-3, "camera and light both look down");
    let narrow = desk
        .json(&[&["plan", "stage.gltf", "--camera", "front", "--fov", "20"], &camera[..]].concat());
    assert!(
        narrow["maps"][0]["error"]["max"].as_f64() != front["maps"][0]["error"]["max"].as_f64()
    );
    let spot = desk.json(&[&["plan", "stage.gltf", "--light", "torch"], &camera[..]].concat());
    assert!(spot["texels"].as_u64().unwrap() > 0);
}

#[test]
fn a_point_light_gets_a_map_for_each_side_of_a_cube() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let view = "plan stage.gltf --light bulb --eye 0,4,15 --target 0,0,0 --shadows uniform@32x32";
    let plan = desk.json(&[&view.split(' ').collect::<Vec<_>>()[..], &["--json"]].concat());
    let maps = plan["maps"].as_array().unwrap();
    assert_eq!(maps.len(), 6);
    // The bulb hangs at (0, 3, 0); ground below it, before and behind it, and to its sides.
    let bulb = DVec3::Y * 3.0;
    let mut servants = Vec::new();
    for ground in [
        DVec3::new(0.5, 0.0, -1.0),
        DVec3::new(0.2, 0.0, 4.0),
        DVec3::new(-0.2, 0.0, -6.0),
        DVec3::new(4.0, 0.0, 1.0),
        DVec3::new(-4.0, 0.0, 1.0),
    ] {
        let serves = |map: &&Value| {
            let h = matrix(map) * ground.extend(1.0);
            let p = h.xyz() / h.w;
            h.w > 0.0 && p.cmpge(DVec3::splat(0.0)).all() && p.cmple(DVec3::splat(1.0)).all()
        };
        let of: Vec<usize> = (0..6).filter(|&i| serves(&&maps[i])).collect();
        let [map] = of[..] else { panic!("{ground} is in the maps {of:?}") };
        servants.push(map);
        // What lies between falls on the same texel, nearer the light.
        let project = |p: DVec3| {
            let h = matrix(&maps[map]) * p.extend(1.0);
            h.xyz() / h.w
        };
        let (receiver, caster) = (project(ground), project(ground.lerp(bulb, 0.6)));
        assert!((caster - receiver).truncate().length() < 1e-9, "{receiver} {caster}");
        assert!(caster.z < receiver.z, "{receiver} {caster}");
    }
    servants.sort_unstable();
    servants.dedup();
    assert_eq!(servants.len(), 5, "{servants:?}");
}

#[test]
fn parts_of_a_view_can_be_replaced() {
    let desk = Desk::new();
    let split = |options: &[&str]| -> [f64; 2] {
        let plan = desk.json(&[&["plan", "town", "--json"], options].concat());
        serde_json::from_value(plan["maps"][0]["split"].clone()).unwrap()
    };
    let [near, far] = split(&[]);
    let check = |options: &[&str], expected: [f64; 2]| {
        let [a, b] = split(options);
        let is_close = |x: f64, y: f64| (x - y).abs() < 1e-9 * y;
        assert!(is_close(a, expected[0]) && is_close(b, expected[1]), "{options:?}: {a} {b}");
    };
    check(&["--near", "1.5"], [1.5, far]);
    check(&["--far", "20"], [near, 20.0]);
    // Another eye sees the scene end elsewhere.
    let [far_near, far_far] = split(&["--eye", "0,2,5000", "--target", "0,2,0"]);
    assert!(far_far > 4500.0 && far_near > 100.0, "{far_near} {far_far}");
}

#[test]
fn looking_away_from_everything_gives_an_empty_map() {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let away = [
        "plan",
        "stage.gltf",
        "--eye",
        "0,50,0",
        "--target",
        "0,90,0.1",
        "--near",
        "1",
        "--far",
        "100",
    ];
    let plan = desk.json(&[&away[..], &["--json"]].concat());
    assert_eq!(plan["texels"], 0);
    assert_eq!(plan["maps"][0]["resolution"], json!([0, 0]));
    assert!(desk.succeed(&away).contains("empty: nothing lit between 1 and 100 metres"));
    let json = desk.run(&[&away[..], &["--json"]].concat());
    assert!(json.stderr.contains("nothing lit between 1 and 100 metres"), "{}", json.stderr);
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    use std::process::Stdio;
    let desk = Desk::new();
    for args in [&[&VIEW[..], &["--json"]].concat()[..], &["scenes"], &["--help"]] {
        let mut command = desk.command(args);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(!told.contains("umbrage: "), "{args:?}: {told}");
    }
}
