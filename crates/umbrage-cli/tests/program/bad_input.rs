//! Whatever is wrong: one line that says what, a failing exit code, nothing on standard output, and
//! no file left behind.

use crate::desk::{Desk, STAGE_GLTF};

/// A desk with things to trip over.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    desk.write("broken.glb", "glTF but not really");
    desk.write("empty.gltf", r#"{"asset": {"version": "2.0"}}"#);
    desk.write("file", "");
    desk.write("prose.glb", "Call me Ishmael.");
    std::fs::create_dir(desk.path("full")).unwrap();
    desk.write("full/thesis.tex", "precious");
    std::fs::create_dir(desk.path("folder.png")).unwrap();
    desk
}

pub(crate) fn refuses(desk: &Desk, args: &[&str], expected: &str) {
    let before = desk.listing();
    let run = desk.run(args);
    assert!(run.code == 1 || run.code == 2, "{args:?}: exit code {}", run.code);
    assert_eq!(run.stdout, "", "{args:?}");
    assert!(run.stderr.contains(expected), "{args:?}: {expected:?} is not in {}", run.stderr);
    assert_eq!(run.stderr.trim_end().lines().count(), 1, "{args:?}: {}", run.stderr);
    assert!(run.stderr.starts_with("umbrage: "), "{args:?}: {}", run.stderr);
    assert_eq!(desk.listing(), before, "{args:?}");
}

/// Commands that work, for options that do not.
const RENDER: [&str; 4] = ["render", "pole", "-o", "p.png"];
const COMPARE: [&str; 4] = ["compare", "pole", "-o", "report"];
const PLAN: [&str; 2] = ["plan", "pole"];

#[test]
fn shared_options() {
    let desk = desk();
    for (options, expected) in [
        (&["--eye", "1,2"][..], "--eye"),
        (&["--eye", "1,2"], "three finite numbers"),
        (&["--eye", "1,2,NaN"], "three finite numbers"),
        (&["--eye", "0,0,1e300"], "within 1e12"),
        (&["--eye"], "--eye"),
        (&["--eye", "--target", "0,0,0"], "0,0,0"),
        (&["--target", "a,b,c"], "--target"),
        (&["--eye", "1,2,3", "--target", "1,2,3"], "--target: must differ from --eye"),
        (&["--up", "0,0,0"], "--up"),
        (&["--up", "0,0,0"], "must point somewhere"),
        (&["--fov", "0"], "--fov"),
        (&["--fov", "180"], "0.01 to 179 degrees"),
        (&["--fov", "-60"], "0.01 to 179 degrees"),
        (&["--fov", "wide"], "0.01 to 179 degrees"),
        (&["--near", "0"], "--near"),
        (&["--near", "-1"], "positive number of metres"),
        (&["--near", "inf"], "positive number of metres"),
        (&["--far", "nan"], "--far"),
        (&["--near", "5", "--far", "5"], "--far: must exceed --near (5)"),
        (&["--near", "1e9"], "--far: must exceed --near"),
        (&["--size", "0x10"], "--size"),
        (&["--size", "100"], "WIDTHxHEIGHT"),
        (&["--size", "99999x99999"], "1 to 16384 pixels"),
        (&["--size", "-5x5"], "1 to 16384 pixels"),
        (&["--camera", "front"], "--camera: the scene has no camera `front`"),
        (&["--camera", "front", "--eye", "0,0,0"], "cannot be used with"),
        (&["--sun", "0,0,0"], "--sun"),
        (&["--sun", "0,0,0"], "must point somewhere"),
        (&["--sun", "down"], "three finite numbers"),
        (&["--light", "moon"], "--light: the scene has no light `moon`"),
        (&["--light", "moon", "--sun", "0,-1,0"], "cannot be used with"),
        (&["--shadows", ""], "--shadows"),
        (&["--shadows", "lipsm"], "did you mean `lispsm`?"),
        (&["--shadows", "uniform:pfc3"], "did you mean `pcfN`?"),
        (&["--shadows", "uniform+fase"], "did you mean `+face`?"),
        (&["--shadows", "uniform@0"], "from 1 to 65536"),
        (&["--shadows", "uniform@16385"], "from 1 to 16384"),
        (&["--shadows", "uniform:pcf99"], "from 1 to 15"),
        (&["--shadows", "lambda=-2"], "positive"),
        (&["--shadows", "lispsm+z17"], "from 1 to 16"),
        (&["--shadows", "lispsm+z4(fited)"], "did you mean `+z4(fitted)`?"),
        (&["--shadows", "lispsm+z4(at=5/20)"], "3 ascending numbers of metres"),
        (&["--shadows", "lispsm+face(top)"], "did you mean `+face(sides)`?"),
        (&["--shadows", "uniform(stable)+face"], "`+face`: stable maps do not turn with the view"),
        (
            &["--shadows", "uniform(stable)+z3(fitted)"],
            "`+z3(fitted)`: stable maps cannot be fitted",
        ),
        (&["--shadows", "uniform+z4@1"], "`@1`: a budget of 1 texels is too small for 4 maps"),
        (&["--max-error", "0"], "positive number of pixels per texel"),
        (&["--max-error", "-1"], "positive number of pixels per texel"),
        (&["--max-error", "NaN"], "positive number of pixels per texel"),
        (&["--max-error", "1e-9", "--shadows", "psm"], "psm: `--max-error 0.000000001`: so small"),
        (
            &["--max-error", "1", "--shadows", "psm@512"],
            "--max-error: `psm@512` says how many texels",
        ),
        (
            &["--shadows", "lispsm:pcss(light=3)"],
            "`light=3` must have a unit, as in `0.53deg` or `0.2m`",
        ),
        (&["--shadows", "lispsm:pcss(light=-1m)"], "`light=-1m` must be above 0 and at most"),
        (&["--shadows", "lispsm:pcss(samples=9)"], "from 1 to 8"),
        (&["--shadows", "lispsm:pcf5(poisson)"], "needs a width, as in `pcf5(blur=2px,poisson)`"),
        (
            &["--shadows", "lispsm:pcf9(blur=2px,poisson)"],
            "must be 1 to 8 where comparisons lie in a disc",
        ),
        (&["--shadows", "lispsm:pcf3(half)"], "unknown option `half` of `pcf3`"),
        (&["--shadows", "lispsm:vsm(blur=8)"], "`blur=8` must be an odd number of texels"),
        (&["--shadows", "lispsm:vsm(blur=65)"], "from 1 to 63"),
        (&["--shadows", "lispsm:vsm(leak=1)"], "`leak=1` must be a number of 0 to less than 1"),
        (&["--shadows", "lispsm:esm(exponent=99)"], "`exponent=99` must be a number above 0"),
        (&["--shadows", "lispsm:csm8(bits=12)"], "`bits=12` must be 16"),
        (&["--shadows", "lispsm:csm17"], "from 1 to 16"),
        (&["--shadows", "lispsm:evsm3"], "`evsm` takes no number"),
        (&["--shadows", "lispsm:msm(exponent=3)"], "unknown option `exponent=3` of `msm`"),
        (&["--shadwos", "uniform"], "'--shadwos'"),
    ] {
        for command in [&RENDER[..], &COMPARE, &PLAN] {
            refuses(&desk, &[command, options].concat(), expected);
        }
    }
}

#[test]
fn options_of_some_commands() {
    let desk = desk();
    for (args, expected) in [
        (&["render"][..], "<SCENE>"),
        (
            &["render", "pole", "-o", "a.png", "--light-size", "1deg"],
            "--light-size: only --aov truth and --aov difference show the truth",
        ),
        (
            &["render", "pole", "-o", "a.png", "--aov", "truth", "--light-size", "0.2m"],
            "--light-size: a sun's size is an angle, as in 0.53deg",
        ),
        (
            &["compare", "lantern", "-o", "out", "--light-size", "1deg"],
            "--light-size: a lamp's size is a length, as in 0.2m",
        ),
        (&["compare", "pole", "-o", "out", "--light-size", "3"], "must have a unit"),
        (&["rendr", "pole"], "'rendr'"),
        (&["scenes", "pole"], "'pole'"),
        (&["render", "pole", "-o", "p.png", "--samples", "0"], "1..=16"),
        (&["compare", "pole", "-o", "r", "--samples", "17"], "1..=16"),
        (&["render", "pole", "-o", "p.png", "--aov", "colour"], "color"),
        (
            &["render", "pole", "-o", "p.png", "--backend", "gpu", "--shadows", "log@64"],
            "--backend: `log@64`: no GPU rasterises bent rows; take reference or auto",
        ),
        (
            &["compare", "pole", "-o", "r", "--backend", "gpu", "--shadows", "log"],
            "--backend: `log`: no GPU rasterises bent rows",
        ),
        (&["bench", "pole", "--frames", "5"], "20..=10000"),
        (&["bench", "pole", "--shadows", "psm", "--shadows", "psm"], "`psm` is given twice"),
        (&["bench"], "<SCENE>"),
        (&["devices", "pole"], "'pole'"),
        (
            &["compare", "pole", "-o", "r", "--backend", "cuda"],
            "[possible values: auto, gpu, reference]",
        ),
        (
            &["compare", "pole", "-o", "r", "--shadows", "psm", "--shadows", "psm"],
            "`psm` is given twice",
        ),
        (
            &["render", "pole", "-o", "p.png", "--shadows", "psm", "--shadows", "tsm"],
            "cannot be used multiple times",
        ),
        (
            &["render", "stage.gltf", "-o", "p.png", "--light", "noon", "--light", "torch"],
            "cannot be used multiple times",
        ),
        (
            &["compare", "stage.gltf", "-o", "r", "--light", "noon", "--light", "torch"],
            "cannot be used multiple times",
        ),
        (
            &["plan", "stage.gltf", "--light", "noon", "--light", "noon"],
            "--light: `noon` is given twice",
        ),
        (
            &["plan", "stage.gltf", "--light", "noon", "--light", "moon"],
            "the scene has no light `moon`",
        ),
        (&["plan", "stage.gltf", "--light", "noon", "--sun", "0,-1,0"], "cannot be used with"),
        (&["plan"], "--eye is needed"),
        (&["plan", "--eye", "0,0,0"], "--target is needed"),
        (&["plan", "--eye", "0,0,0", "--target", "0,0,1", "--far", "9"], "--near is needed"),
        (&["plan", "--eye", "0,0,0", "--target", "0,0,1", "--near", "1"], "--far is needed"),
        (
            &[
                "plan", "--eye", "0,0,0", "--target", "0,0,1", "--near", "1", "--far", "9",
                "--light", "x",
            ],
            "--light names something of a scene",
        ),
    ] {
        refuses(&desk, args, expected);
    }
}

#[test]
fn scenes() {
    let desk = desk();
    for (scene, expected) in [
        ("", "SCENE"),
        ("plole", "did you mean `pole`?"),
        ("pole:", "whole number, as in pole:10"),
        ("pole:many", "whole number, as in pole:10"),
        ("pole:0", "sizes 1 to"),
        ("pole:-1", "whole number"),
        ("pole:99999999999999", "whole number"),
        ("missing.glb", "there is no file missing.glb"),
        ("no/such.gltf", "there is no file no/such.gltf"),
        ("broken.glb", "broken.glb"),
        ("empty.gltf", "empty.gltf"),
        ("file", "file: header: is neither binary glTF 2.0 nor JSON"),
        ("prose.glb", "prose.glb: header: is neither binary glTF 2.0 nor JSON"),
        ("full", "full is a folder"),
    ] {
        for command in [
            &["render", scene, "-o", "p.png"][..],
            &["compare", scene, "-o", "r"],
            &["plan", scene],
        ] {
            refuses(&desk, command, expected);
        }
    }
}

#[test]
fn names_of_a_scenes_cameras_and_lights() {
    let desk = desk();
    for (option, name, expected) in [
        (
            "--camera",
            "back",
            "--camera: the scene has no camera `back`; there are front or #1, above or #2",
        ),
        (
            "--light",
            "moon",
            "--light: the scene has no light `moon`; there are noon or #1, torch or #2, bulb or #3",
        ),
    ] {
        for command in [
            &["render", "stage.gltf", "-o", "p.png"][..],
            &["compare", "stage.gltf", "-o", "r"],
            &["plan", "stage.gltf"],
        ] {
            refuses(&desk, &[command, &[option, name]].concat(), expected);
        }
    }
}

#[test]
fn places_to_write_to() {
    let desk = desk();
    for (output, expected) in [
        ("p.jpg", "must end in .png or .exr"),
        ("p", "must end in .png or .exr"),
        ("missing/p.png", "the folder missing must exist"),
        ("file/p.png", "file is not a folder"),
        ("folder.png", "folder.png is a folder"),
    ] {
        refuses(&desk, &["render", "pole", "-o", output], expected);
    }
    for (output, expected) in [
        ("missing/report", "the folder missing must exist"),
        ("file", "file is there and is not a folder"),
        ("file/report", "file is not a folder"),
        ("full", "full holds something other than a report"),
        (".", "has no name of its own"),
        ("..", "has no name of its own"),
    ] {
        refuses(&desk, &["compare", "pole", "-o", output], expected);
    }
    assert_eq!(std::fs::read_to_string(desk.path("full/thesis.tex")).unwrap(), "precious");
}

/// Where not even the superuser can write.
#[cfg(target_os = "linux")]
#[test]
fn places_that_cannot_be_written() {
    let desk = desk();
    refuses(&desk, &["render", "pole", "-o", "/proc/p.png"], "--output: cannot write in /proc");
    refuses(&desk, &["compare", "pole", "-o", "/proc/report"], "--output: cannot write in /proc");
}

/// Any text in any place is answered, never with a panic.
#[test]
fn no_argument_panics() {
    let desk = desk();
    let odd = [
        "",
        "-",
        "--",
        "\u{1F333}",
        "0",
        "-0",
        "1e999",
        "NaN,NaN,NaN",
        ",,,",
        "a=b",
        "@@@",
        "((((",
        "\t\n",
    ];
    for option in [
        "--eye",
        "--up",
        "--fov",
        "--near",
        "--size",
        "--sun",
        "--light",
        "--camera",
        "--shadows",
        "--max-error",
    ] {
        for value in odd {
            let run = desk.run(&["plan", "pole", option, value]);
            assert!([0, 1, 2].contains(&run.code), "{option} {value:?}: {}", run.stderr);
            assert!(!run.stderr.contains("panicked"), "{option} {value:?}: {}", run.stderr);
        }
    }
}
