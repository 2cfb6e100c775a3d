use crate::desk::{Desk, STAGE_GLTF};
use image::{ColorType, GenericImageView};
use umbrage_testing::needs;

const AOVS: [&str; 9] = [
    "color",
    "visibility",
    "truth",
    "difference",
    "error",
    "depth",
    "normal",
    "texels",
    "partition",
];

#[test]
fn every_aov_is_written_as_png_and_exr() {
    let desk = Desk::new();
    let common = ["--size", "48x27", "--samples", "2", "--shadows", "lispsm:pcf3@128"];
    for aov in AOVS {
        let [png, exr] = [format!("{aov}.png"), format!("{aov}.exr")];
        desk.succeed(&[&["render", "pole", "-o", &png, "--aov", aov], &common[..]].concat());
        desk.succeed(&[&["render", "pole", "-o", &exr, "--aov", aov], &common[..]].concat());
        let picture = image::open(desk.path(&png)).unwrap();
        assert_eq!(picture.dimensions(), (48, 27), "{aov}");
        let is_gray = ["visibility", "truth"].contains(&aov);
        assert_eq!(picture.color(), if is_gray { ColorType::L8 } else { ColorType::Rgb8 }, "{aov}");
        assert!(
            std::fs::read(desk.path(&exr)).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]),
            "{aov}"
        );
        let first = picture.pixels().next().unwrap().2;
        let is_flat = picture.pixels().all(|(_, _, p)| p == first);
        assert!(!is_flat, "{aov} shows nothing");
    }
    assert_eq!(desk.listing().len(), 2 * AOVS.len());
}

#[test]
fn visibility_is_white_in_light_and_black_in_shadow() {
    // Straight from above onto a triangle in the sun: all of it is lit. With the light from below
    // all of it faces away.
    let desk = Desk::new();
    desk.write("stage.gltf", STAGE_GLTF);
    let common = [
        "render",
        "stage.gltf",
        "--eye",
        "0,6,1",
        "--target",
        "0,0,1",
        "--up",
        "0,0,-1",
        "--fov",
        "30",
        "--size",
        "16x16",
    ];
    for (sun, expected) in [("0.1,-1,0", 255), ("0.1,1,0", 0)] {
        for aov in ["visibility", "truth"] {
            desk.succeed(&[&common[..], &["--sun", sun, "--aov", aov, "-o", "v.png"]].concat());
            let picture = image::open(desk.path("v.png")).unwrap().to_luma8();
            assert!(picture.pixels().all(|p| p.0 == [expected]), "{aov}, sun {sun}");
        }
    }
}

#[test]
fn a_point_light_shines_on_a_disc() {
    // A bulb 3 m above the ground that reaches 5 m, seen from 8 m above: it lights a disc of 4 m.
    let desk = Desk::new();
    let bulb = r#""bulb", "intensity": 500"#;
    assert!(STAGE_GLTF.contains(bulb));
    desk.write("stage.gltf", &STAGE_GLTF.replace(bulb, &format!(r#"{bulb}, "range": 5"#)));
    let view = "render stage.gltf --light bulb --eye 0,8,0 --target 0,0,0 --up 0,0,-1 --fov 60 \
                --size 48x48 --samples 1 --shadows uniform@256 -o v.png";
    let mut counts = [0; 2];
    for aov in ["truth", "visibility"] {
        let words = format!("{view} --aov {aov}");
        desk.succeed(&words.split_whitespace().collect::<Vec<_>>());
        let picture = image::open(desk.path("v.png")).unwrap().to_luma8();
        for (column, row, pixel) in picture.enumerate_pixels() {
            let meters = 16.0 * 30f64.to_radians().tan() / 48.0;
            let [x, z] = [column, row].map(|i| (f64::from(i) + 0.5 - 24.0) * meters);
            // The triangle is 8 m wide to both sides at z = 8 and ends in a point at z = −8.
            if x.abs() < (z + 8.0) / 2.0 - 0.1 {
                let is_lit = x.hypot(z) < 4.0;
                assert_eq!(pixel.0, [if is_lit { 255 } else { 0 }], "{aov} at {x}, {z}");
                counts[usize::from(is_lit)] += 1;
            }
        }
    }
    assert!(counts[0] > 500 && counts[1] > 2000, "{counts:?}");
}

#[test]
fn masks_are_ignored_only_if_told() {
    let desk = Desk::new();
    let common = ["render", "grove", "--aov", "truth", "--size", "64x36", "--samples", "1"];
    desk.succeed(&[&common[..], &["-o", "masked.png"]].concat());
    desk.succeed(&[&common[..], &["-o", "solid.png", "--opaque"]].concat());
    let [masked, solid] =
        ["masked.png", "solid.png"].map(|n| image::open(desk.path(n)).unwrap().to_luma8());
    assert_ne!(masked, solid);
}

#[test]
fn more_samples_smooth_edges() {
    let desk = Desk::new();
    for samples in ["1", "4"] {
        let file = format!("{samples}.png");
        desk.succeed(&[
            "render",
            "pole",
            "--aov",
            "truth",
            "--size",
            "64x36",
            "--samples",
            samples,
            "-o",
            &file,
        ]);
    }
    let grays = |file: &str| {
        let picture = image::open(desk.path(file)).unwrap().to_luma8();
        picture.pixels().filter(|p| !matches!(p.0[0], 0 | 255)).count()
    };
    assert_eq!(grays("1.png"), 0);
    assert!(grays("4.png") > 5);
}

#[test]
fn an_existing_picture_is_replaced_and_nothing_is_left_beside_it() {
    let desk = Desk::new();
    desk.write("p.png", "old");
    desk.succeed(&["render", "pole", "--size", "8x8", "-o", "p.png"]);
    assert_eq!(image::open(desk.path("p.png")).unwrap().dimensions(), (8, 8));
    assert_eq!(desk.listing(), ["p.png"]);
}

#[needs(gpu)]
#[test]
fn what_renders_is_told() {
    let desk = Desk::new();
    let run = |options: &[&str]| {
        let common = ["render", "pole", "--size", "8x8", "-o", "p.png"];
        let run = desk.run(&[&common[..], options].concat());
        assert_eq!(run.code, 0, "{options:?}: {}", run.stderr);
        let told = run.stderr.lines().find(|l| l.starts_with("backend: "));
        told.unwrap_or_else(|| panic!("{options:?}: {}", run.stderr)).to_owned()
    };
    assert!(run(&["--backend", "auto"]).starts_with("backend: gpu, "));
    let log = run(&["--shadows", "log"]);
    assert_eq!(log, "backend: reference, on the CPU (no GPU rasterises bent rows)");
    assert!(run(&["--backend", "gpu"]).starts_with("backend: gpu, "));
    assert_eq!(run(&["--backend", "reference"]), "backend: reference, on the CPU");
}

/// Every kind of picture, from both.
#[needs(gpu)]
#[test]
fn backends_agree() {
    let desk = Desk::new();
    let common = "render town:20 --size 160x90 --samples 2 --shadows lispsm+z2:pcf3@256";
    for aov in AOVS {
        let [gpu, reference] = ["gpu", "reference"].map(|backend| {
            let words = format!("{common} --aov {aov} --backend {backend} -o p.png");
            desk.succeed(&words.split_whitespace().collect::<Vec<_>>());
            image::open(desk.path("p.png")).unwrap().to_rgb8()
        });
        let far =
            |a: &image::Rgb<u8>, b: &image::Rgb<u8>| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 24);
        let differing = gpu.pixels().zip(reference.pixels()).filter(|(a, b)| far(a, b)).count();
        assert!(differing <= 160 * 90 / 100, "{aov}: {differing}");
    }
}

#[test]
fn a_picture_without_anything_to_shadow_says_so() {
    let desk = Desk::new();
    let away = ["--eye", "0,5,50", "--target", "0,8,100", "--size", "16x9"];
    let says = |args: &[&str]| {
        let run = desk.run(&[args, &away[..]].concat());
        assert_eq!(run.code, 0, "{args:?}: {}", run.stderr);
        run.stderr.contains("no pixel shows a surface that faces the light")
    };
    assert!(says(&["render", "pole", "-o", "sky.png"]));
    assert!(says(&["compare", "pole", "-o", "report", "--shadows", "uniform@16"]));
    // A picture of no light has nothing to complain about.
    assert!(!says(&["render", "pole", "-o", "sky.png", "--aov", "depth"]));
}

#[test]
fn the_texels_that_an_error_takes_are_told() {
    let desk = Desk::new();
    let words = "render pole -o p.png --size 96x54 --shadows uniform+z2 --max-error 2";
    let run = desk.run(&words.split(' ').collect::<Vec<_>>());
    assert_eq!((run.code, run.stdout.as_str()), (0, ""), "{}", run.stderr);
    let told = run.stderr.lines().find_map(|l| l.strip_prefix("texels: ")).unwrap();
    assert!(told.ends_with(" for at most 2 px a texel"), "{told}");
    let plan = "plan pole --fit surfaces --json --size 96x54 --shadows uniform+z2 --max-error 2";
    let plan = desk.json(&plan.split(' ').collect::<Vec<_>>());
    assert_eq!(told.split(' ').next().unwrap(), plan["texels"].to_string());
}
