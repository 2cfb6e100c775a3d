//! `--session`: scene, view, light and techniques from a file, and what replaces them.

use crate::bad_input::refuses;
use crate::desk::{Desk, STAGE_GLTF};
use serde_json::{Value, json};

/// A session of the desk's scene.
fn session() -> Value {
    json!({
        "version": 1,
        "scene": "../scenes/stage.gltf",
        "eye": [1, 3, 6],
        "target": [0, 0, 0],
        "fov": 50,
        "near": 0.5,
        "far": 40,
        "size": [48, 32],
        "sun": [0.25, -1, 0.5],
        "shadows": ["lispsm@64", "uniform@64"],
        "fit": "box"
    })
}

fn desk() -> Desk {
    let desk = Desk::new();
    for folder in ["scenes", "sessions"] {
        std::fs::create_dir(desk.path(folder)).unwrap();
    }
    desk.write("scenes/stage.gltf", STAGE_GLTF);
    desk.write("sessions/a.json", &session().to_string());
    desk
}

const SESSION: [&str; 4] = ["--session", "sessions/a.json", "--backend", "reference"];

/// A session gives the same picture as its values on the command line.
#[test]
fn sessions_stand_for_their_options() {
    let desk = desk();
    let pictures = ["told.png", "taken.png"];
    let told = "render scenes/stage.gltf --eye 1,3,6 --target 0,0,0 --fov 50 --near 0.5 --far 40 \
                --size 48x32 --sun 0.25,-1,0.5 --shadows lispsm@64 --fit box --backend reference \
                -o told.png";
    desk.succeed(&told.split_whitespace().collect::<Vec<_>>());
    desk.succeed(&[&["render", "-o", "taken.png"][..], &SESSION].concat());
    let [told, taken] = pictures.map(|name| std::fs::read(desk.path(name)).unwrap());
    assert_eq!(told, taken);

    let report = desk.json(&[&["compare", "--json"][..], &SESSION].concat());
    let shadows = report["results"].as_array().unwrap().iter().map(|r| &r["shadows"]);
    assert_eq!(shadows.collect::<Vec<_>>(), ["lispsm@64", "uniform@64"]);
    assert_eq!(
        (&report["size"], &report["view"]["eye"]),
        (&json!([48, 32]), &json!([1.0, 3.0, 6.0]))
    );

    let plan = desk.json(&["plan", "--json", "--session", "sessions/a.json"]);
    assert_eq!((&plan["fit"], &plan["view"]["far"]), (&json!("box"), &json!(40.0)));
}

/// Options replace what the session says, and a camera of the scene its whole view.
#[test]
fn options_come_first() {
    let desk = desk();
    let plan = |more: &[&str]| {
        desk.json(&[&["plan", "--json", "--session", "sessions/a.json"], more].concat())
    };
    let own = plan(&[]);
    let view = plan(&["--near", "0.25", "--far=90", "--eye", "0,3,6"])["view"].clone();
    assert_eq!((&view["near"], &view["far"]), (&json!(0.25), &json!(90.0)));
    assert_eq!(view["fov"], own["view"]["fov"]);
    assert_eq!((&view["eye"], &view["target"]), (&json!([0.0, 3.0, 6.0]), &own["view"]["target"]));
    let view = plan(&["--ortho", "9"])["view"].clone();
    assert_eq!((&view["ortho"], &view["fov"]), (&json!(9.0), &Value::Null));
    let view = plan(&["--camera", "front"])["view"].clone();
    assert_eq!((&view["name"], &view["far"]), (&json!("front"), &json!(50.0)));
    let light = |more: &[&str]| plan(more)["lights"][0]["name"].clone();
    assert_eq!((light(&[]), light(&["--light", "torch"])), (Value::Null, json!("torch")));
    assert_ne!(plan(&["--sun-angles", "0,45"])["theta_deg"], own["theta_deg"]);
    assert_eq!(plan(&["--shadows", "uniform+z4"])["maps"].as_array().unwrap().len(), 4);
    assert_eq!(plan(&["--fit", "surfaces"])["fit"], "surfaces");
    // A default value that is told is one, too.
    assert_eq!(
        plan(&["--shadows", "adaptive"])["texels"].as_u64().map(|t| t > 1 << 19),
        Some(true)
    );
}

#[test]
fn sessions_that_are_none() {
    let desk = desk();
    let with = |key: &str, value: Value| {
        let mut session = session();
        session[key] = value;
        session.to_string()
    };
    for (text, expected) in [
        (String::new(), "--session: s.json: is no session"),
        ("[]".to_owned(), "--session: s.json: is no session"),
        (with("aye", json!([0, 0, 0])), "--session: s.json: unknown field `aye`"),
        (with("version", json!(2)), "--session: s.json: version: must be 1, is 2"),
        (with("far", json!(0.1)), "--session: s.json: far: must exceed near (0.5), is 0.1"),
        (with("shadows", json!(["lipsm"])), "did you mean `lispsm`?"),
        (with("scene", json!("nowhere.gltf")), "there is no file nowhere.gltf"),
        (with("time", json!(-1)), "--session: s.json: time: must"),
        (with("scene", json!("twon")), "did you mean `town`?"),
    ] {
        desk.write("s.json", &text);
        refuses(&desk, &["plan", "--session", "s.json"], expected);
        assert_eq!(desk.run(&["plan", "--session", "s.json"]).code, 1, "{text}");
    }
    refuses(&desk, &["render", "--session", "none.json"], "--session: none.json: No such file");
    refuses(&desk, &["compare", "--session", "scenes"], "--session: scenes: ");
    refuses(&desk, &["compare", "town", "--session", "s.json"], "cannot be used with");
    refuses(&desk, &["compare"], "<SCENE>");
    desk.write("sessions/a.json", &with("animation", json!("walk")));
    let of_scene = ["plan", "--session", "sessions/a.json"];
    refuses(&desk, &of_scene, "--animation: the scene has no animation `walk`");
    desk.write("s.json", &with("shadows", json!(["psm", "psm"])));
    refuses(&desk, &["compare", "--session", "s.json"], "`psm` is given twice");
}
