//! `umbrage theory`: the contract of its JSON, its numbers by other ways, and what it refuses.

use crate::bad_input::refuses;
use crate::desk::{Desk, keys};
use serde_json::Value;

const VIEW: &str = "--near 1 --far 100 --half-fov 30";

/// Runs `umbrage theory` with these words and `--json`.
fn theory(words: &str) -> Value {
    let line = format!("theory {words} --json");
    Desk::new().json(&line.split_whitespace().collect::<Vec<_>>())
}

fn close(found: &Value, expected: f64, what: &str) {
    let found = found.as_f64().unwrap_or_else(|| panic!("{what}: {found} is no number"));
    assert!((found / expected - 1.0).abs() < 1e-9, "{what}: {found}, not {expected}");
}

#[test]
fn aliasing_has_the_documented_shape_and_numbers() {
    let e = theory(&format!("aliasing {VIEW} --theta 60 --lambda 11 --point 2,-3,20"));
    assert_eq!(
        keys(&e),
        [
            "E_p",
            "E_pq",
            "E_q",
            "F_p",
            "F_q",
            "G",
            "lambda",
            "largest",
            "least",
            "mu",
            "tan_phi_w",
            "z_w"
        ]
    );
    for range in [&e["least"], &e["largest"]] {
        assert_eq!(keys(range), ["E_p", "E_pq", "E_q"]);
        assert_eq!(keys(&range["E_q"]), ["value", "y", "z"]);
    }
    // Zhang, Zhao and Sun's appendix for φ ≤ θ, corrected.
    let (k, sin) = (30f64.to_radians().tan(), 60f64.to_radians().sin());
    let ratio = k / 60f64.to_radians().tan();
    let mu = (99.0 + 101.0 * ratio) * sin;
    let z_w = (19.0 + ratio + 3.0 / 60f64.to_radians().tan()) * sin + 11.0;
    let tan_phi_w = 100.0 * k / (11.0 + 99.0 * (1.0 - ratio) * sin);
    let e_q = 2.0 * tan_phi_w / k * z_w / 20.0;
    let e_p = mu / (k * (11.0 + mu) * 11.0) * z_w * z_w / 20.0;
    for (name, expected) in [
        ("lambda", 11.0),
        ("mu", mu),
        ("tan_phi_w", tan_phi_w),
        ("z_w", z_w),
        ("G", z_w / sin - 20.0),
        ("F_q", 2.0 * tan_phi_w / k * sin),
        ("F_p", mu * sin * sin / (k * (11.0 + mu) * 11.0)),
        ("E_q", e_q),
        ("E_p", e_p),
        ("E_pq", e_q * e_p),
    ] {
        close(&e[name], expected, name);
    }
    close(&e["largest"]["E_q"]["z"], 1.0, "the largest E_q is at the near plane");
    close(&e["largest"]["E_q"]["y"], -k, "of the lower side");
    // The same beams, the other way.
    let mirrored = theory(&format!("aliasing {VIEW} --theta 120 --lambda 11 --point 2,-3,20"));
    close(&mirrored["E_pq"], e_q * e_p, "θ = 120°");
}

#[test]
fn without_a_warp_what_is_infinite_is_null() {
    let point = "--theta 60 --point 2,-3,20";
    let by_name = theory(&format!("aliasing {VIEW} {point} --warp uniform"));
    let by_number = theory(&format!("aliasing {VIEW} {point} --lambda inf"));
    assert_eq!(by_name, by_number);
    for name in ["lambda", "z_w", "G"] {
        assert_eq!(by_name[name], Value::Null, "{name}");
    }
    close(&by_name["E_q"], 2.0 * 100.0 / 20.0, "E_q = 2 f/z");
    // Light along the view: z_w is the same for all z.
    let along = theory(&format!("aliasing {VIEW} --theta 0 --point 2,-3,20 --lambda 5"));
    assert_eq!(along["G"], Value::Null);
    assert!(along["E_p"].as_f64().unwrap() > 0.0);
}

#[test]
fn slopes_add_projection() {
    let point = format!("aliasing {VIEW} --theta 60 --lambda 11 --point 2,-3,20");
    let e = theory(&format!("{point} --slope 0.5,-2"));
    let (sin, cos) = 60f64.to_radians().sin_cos();
    let along = sin + 2.0 * cos;
    let z_w = e["z_w"].as_f64().unwrap();
    close(&e["projection"]["E_q"], (0.5 - 0.1) / (0.5 - 2.0 / z_w * along), "E_q^proj");
    close(&e["projection"]["E_p"], (2.0 - 0.15) / along, "E_p^proj");
    assert_eq!(theory(&point)["projection"], Value::Null);
}

#[test]
fn storage_of_the_reference_table() {
    let view = "--near 1 --far 1000 --half-fov 30";
    for (words, expected) in [
        ("--warp uniform --light overhead", 865_159.0),
        ("--warp lispsm --z 4 --light overhead", 16.02),
        ("--warp lispsm --z 4 --light 90 --face", 16.02),
        ("--warp uniform --z 8 --light behind", 44.99),
        ("--warp lispsm --z 16 --face --light behind", 18.28),
        ("--warp lispsm --z 16 --face --light 0", 18.28),
        ("--warp log --light overhead", 5.982),
    ] {
        let storage = theory(&format!("storage {view} {words}"));
        assert_eq!(keys(&storage), ["storage_factor"]);
        let found = storage["storage_factor"].as_f64().unwrap();
        assert!((found / expected - 1.0).abs() < 5e-4, "{words}: {found}");
    }
    // M_q·M_p/4 of the tables of optima.
    for (warp, expected) in [("uniform", 39_800.0), ("lispsm", 824.0), ("adaptive", 764.0)] {
        let found = theory(&format!("storage {VIEW} --warp {warp} --light 60"));
        let found = 4.0 * found["storage_factor"].as_f64().unwrap();
        assert!((found / expected - 1.0).abs() < 6e-3, "{warp}: {found}");
    }
}

#[test]
fn lambdas_by_technique() {
    let lambda = |words: &str| {
        let found = theory(&format!("lambda {VIEW} {words}"));
        assert_eq!(keys(&found), ["lambda"]);
        found["lambda"].clone()
    };
    for (warp, expected) in [
        ("psm", 1.0),
        ("lispsm", 11.0),
        ("lispsm(range)", 11.0),
        ("adaptive", 11.0),
        ("log", 1.0),
        ("lambda=7.5", 7.5),
        ("tsm --focus 10", 99.0 * 9.0 * 0.2 / (0.8 * 99.0 - 9.0)),
        ("tsm(focus=10)", 99.0 * 9.0 * 0.2 / (0.8 * 99.0 - 9.0)),
    ] {
        close(&lambda(&format!("--theta 90 --warp {warp}")), expected, warp);
    }
    let (sin, cos) = 45f64.to_radians().sin_cos();
    let k = 30f64.to_radians().tan();
    close(&lambda("--theta 45 --warp lispsm"), 11.0 / sin, "LiSPSM as published");
    let mu = 99.0 * sin + 101.0 * k * cos;
    let in_range = (1.0 + (1.0 + mu * sin).sqrt()) / sin;
    close(&lambda("--theta 45 --warp lispsm(range)"), in_range, "LiSPSM in range");
    close(&lambda("--theta 45 --warp adaptive"), (mu - 20.0 * k * cos) / 9.0, "λ*");
    assert_eq!(lambda("--theta 45 --warp uniform"), Value::Null);
    assert_eq!(lambda("--theta 0 --warp lispsm"), Value::Null);
}

#[test]
fn steps_of_the_reference_table() {
    let step = |words: &str| {
        let found = theory(&format!("step {words}"));
        assert_eq!(keys(&found), ["visibility"]);
        found["visibility"].as_f64().unwrap()
    };
    for (words, expected) in [
        ("--order 4 --receiver 0.3 --occluder 0.5", 0.9895),
        ("--order 4 --receiver 0.45 --occluder 0.5", 0.8670),
        ("--order 16 --receiver 0.49 --occluder 0.5", 0.8026),
        ("--order 16 --receiver 0.5 --occluder 0.5", 0.5),
        ("--order 16 --receiver 0.5 --occluder 0.5 --scale", 1.0),
        ("--order 16 --receiver 0.5 --occluder 0.5 --offset", 1.0),
        ("--order 8 --receiver 0.5 --occluder 0.5 --offset --attenuation 0.5", 1.0),
        // 1/2 + 2/π e^(−1/2) sin(π/10).
        ("--order 1 --receiver 0.4 --occluder 0.5 --attenuation 0.5", 0.61932),
        // Ringing below 0 is cut off: 1/2 − 2/π.
        ("--order 1 --receiver 1 --occluder 0.5", 0.0),
    ] {
        let found = step(words);
        assert!((found - expected).abs() < 6e-5, "{words}: {found}");
    }
}

#[test]
fn people_get_tables() {
    let desk = Desk::new();
    let say = |words: &str| desk.succeed(&words.split_whitespace().collect::<Vec<_>>());
    let table = say(&format!("theory aliasing {VIEW} --theta 60 --lambda 11 --point 2,-3,20"));
    for part in ["λ            11.0", "z_w       29.2432", "E_q   4.29052", "largest"] {
        assert!(table.contains(part), "{part}: {table}");
    }
    assert_eq!(say(&format!("theory lambda {VIEW} --theta 90 --warp lispsm")), "11.0 m\n");
    assert_eq!(say(&format!("theory lambda {VIEW} --theta 0 --warp lispsm")), "no warp\n");
    let storage = say(&format!("theory storage {VIEW} --warp uniform --light behind"));
    assert_eq!(storage, "10000.0 texels a pixel\n");
    let step = say("theory step --order 2 --receiver 0.5 --occluder 0.5");
    assert_eq!(step, "0.5 lit\n");
}

#[test]
fn points_outside_the_view_are_told_of() {
    let desk = Desk::new();
    let run = |point: &str| {
        let line = format!("theory aliasing {VIEW} --theta 60 --lambda 11 --json --point {point}");
        desk.run(&line.split_whitespace().collect::<Vec<_>>())
    };
    // On the view's very corner, by the digits of its tangent, and outside in x, y and z.
    assert_eq!(run("57.7350269189626,-57.7350269189626,100").stderr, "");
    for point in ["0,0,100.1", "0,0,0.9", "12,0,20", "0,-12,20"] {
        let run = run(point);
        assert_eq!(run.code, 0, "{point}");
        assert!(
            run.stderr.contains("--point: ") && run.stderr.contains("outside the view"),
            "{point}"
        );
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let desk = Desk::new();
    let point = "--theta 60 --lambda 11 --point 2,-3,20";
    for (words, expected) in [
        (String::new(), "requires a subcommand"),
        ("alias".into(), "'aliasing'"),
        (format!("aliasing {VIEW} --theta 60 --point 2,-3,20"), "--lambda or --warp is needed"),
        (format!("aliasing {VIEW} {point} --warp psm"), "--lambda"),
        (format!("aliasing {VIEW} {point} --focus 3"), "--focus"),
        (format!("aliasing {VIEW} --theta 60 --lambda 0 --point 2,-3,20"), "--lambda"),
        (format!("aliasing {VIEW} --theta 60 --lambda -3 --point 2,-3,20"), "1e-12 metres"),
        (format!("aliasing {VIEW} --theta 60 --warp log --point 2,-3,20"), "rows of log"),
        (format!("aliasing {VIEW} --theta 60 --warp stable --point 2,-3,20"), "--warp"),
        (
            format!("aliasing {VIEW} --theta 60 --lambda 1 --point 0,0,-1"),
            "--point: must lie before the eye",
        ),
        (format!("aliasing {VIEW} --theta 45 --lambda 1 --point 0,90,20"), "centre of projection"),
        (format!("aliasing {VIEW} --theta 60 --lambda 1 --point 0,0"), "three finite numbers"),
        (format!("aliasing {VIEW} {point} --slope 1"), "two numbers"),
        (format!("aliasing {VIEW} {point} --slope nan,1"), "--slope"),
        (format!("aliasing {VIEW} {point} --slope inf,0"), "--slope"),
        (format!("lambda {VIEW} --theta 181 --warp psm"), "0 to 180 degrees"),
        (format!("lambda {VIEW} --theta -1 --warp psm"), "--theta"),
        (format!("lambda {VIEW} --theta x --warp psm"), "--theta"),
        (format!("lambda {VIEW} --theta 60"), "--warp"),
        (format!("lambda {VIEW} --theta 60 --warp lipsm"), "did you mean `lispsm`?"),
        (format!("lambda {VIEW} --theta 60 --warp unfocused"), "says what a map covers"),
        (format!("lambda {VIEW} --theta 60 --warp uniform(stable)"), "says what a map covers"),
        (format!("lambda {VIEW} --theta 60 --warp lambda=1e-300"), "1e-12 metres"),
        (
            format!("lambda {VIEW} --theta 60 --warp psm --focus 3"),
            "--focus: is an option of --warp tsm",
        ),
        (format!("lambda {VIEW} --theta 60 --warp tsm(focus=2) --focus 3"), "has one already"),
        (format!("lambda {VIEW} --theta 60 --warp tsm --focus 0"), "--focus"),
        (
            "lambda --near 5 --far 5 --half-fov 30 --theta 60 --warp psm".into(),
            "--far: must exceed --near (5)",
        ),
        ("lambda --near 1e-13 --far 5 --half-fov 30 --theta 60 --warp psm".into(), "--near"),
        ("lambda --near 0 --far 5 --half-fov 30 --theta 60 --warp psm".into(), "--near"),
        (
            "lambda --near 1 --far 5 --half-fov 90 --theta 60 --warp psm".into(),
            "0.005 to 89.5 degrees",
        ),
        (format!("storage {VIEW} --warp psm --light above"), "did you mean"),
        (format!("storage {VIEW} --warp psm --light 200"), "0 to 180 degrees"),
        (format!("storage {VIEW} --warp psm"), "--light"),
        (format!("storage {VIEW} --warp psm --light 45 --face"), "--face: there are closed forms"),
        (format!("storage {VIEW} --warp psm --light 45 --z 17"), "--z"),
        (format!("storage {VIEW} --warp psm --light 45 --z 0"), "--z"),
        ("step --order 0 --receiver 0.5 --occluder 0.5".into(), "--order"),
        ("step --order 2 --receiver 1.5 --occluder 0.5".into(), "--receiver"),
        ("step --order 2 --receiver 0.5 --occluder nan".into(), "depth of 0 to 1"),
        ("step --order 2 --receiver 0 --occluder 1".into(), "--receiver: must be less than 1"),
        ("step --order 2 --receiver 0.5 --occluder 0.5 --attenuation -1".into(), "--attenuation"),
    ] {
        let words: Vec<&str> = ["theory"].into_iter().chain(words.split_whitespace()).collect();
        refuses(&desk, &words, expected);
    }
}

#[test]
fn every_form_has_help_with_examples_that_run() {
    let desk = Desk::new();
    for form in ["aliasing", "storage", "lambda", "step"] {
        let help = desk.succeed(&["theory", form, "--help"]);
        let examples = help.split("Examples:").nth(1).unwrap().replace("\\\n", " ");
        let examples = examples.lines().map(str::trim).filter(|l| !l.is_empty());
        let mut count = 0;
        for example in examples {
            let words: Vec<&str> = example.split_whitespace().collect();
            assert_eq!(words[..3], ["umbrage", "theory", form], "{example}");
            desk.succeed(&words[1..]);
            count += 1;
        }
        assert!(count >= 2, "{form}: {help}");
    }
}
