//! Small pictures that must not change unnoticed.
//!
//! A picture without a golden fails. `UMBRAGE_BLESS=1` makes what is rendered the golden: look at
//! it before you commit it. A failure leaves `expected.png`, `actual.png`, `difference.png` and
//! `figures.json` in `target/tmp/goldens/<name>`.

use crate::desk::Desk;
use image::RgbImage;
use std::path::{Path, PathBuf};

/// Other machines round the last bit of a sine otherwise, and a pixel on an edge may fall to the
/// other side; 2‰ of a picture is more than that and less than any mistake.
const MAX_CHANGED_SHARE: f64 = 0.002;
/// Levels of 255 by which a pixel may differ and count as unchanged.
const MAX_LEVELS: u8 = 2;

const POLE: &str =
    "pole --eye 0.4,1.6,2.2 --target -0.5,0.3,0 --near 0.5 --far 30 --sun -0.6,-1,0.3";
const SPHERE: &str =
    "sphere:48 --eye 2,1.8,3.2 --target 0,0.6,0 --near 0.5 --far 30 --sun 0.8,-1,-0.5";

#[test]
fn pictures_are_as_blessed() {
    let failures: Vec<String> = [
        ("pole-uniform-visibility", POLE, "--shadows uniform@64 --aov visibility"),
        ("pole-psm-visibility", POLE, "--shadows psm@64 --aov visibility"),
        ("pole-lispsm-visibility", POLE, "--shadows lispsm@64 --aov visibility"),
        ("pole-adaptive-pcf-visibility", POLE, "--shadows adaptive:pcf5@64 --aov visibility"),
        ("pole-log-visibility", POLE, "--shadows log@64 --aov visibility"),
        ("pole-truth", POLE, "--aov truth"),
        ("pole-difference", POLE, "--shadows uniform@64 --aov difference"),
        ("sphere-color", SPHERE, "--shadows lispsm:pcf3@256"),
        ("sphere-error", SPHERE, "--shadows tsm@128 --aov error"),
        ("sphere-texels", SPHERE, "--shadows lispsm@128 --aov texels"),
        ("sphere-depth", SPHERE, "--aov depth"),
        ("sphere-normal", SPHERE, "--aov normal"),
    ]
    .iter()
    .filter_map(|(name, scene, options)| check(name, scene, options).err())
    .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn check(name: &str, scene: &str, options: &str) -> Result<(), String> {
    let desk = Desk::new();
    let words = format!("render {scene} {options} -o actual.png --size 96x64 --samples 2");
    desk.succeed(&words.split_whitespace().collect::<Vec<_>>());
    let golden =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens").join(format!("{name}.png"));
    if std::env::var_os("UMBRAGE_BLESS").is_some_and(|v| v == "1") {
        std::fs::copy(desk.path("actual.png"), &golden).map_err(|e| e.to_string())?;
        return Ok(());
    }
    let actual = image::open(desk.path("actual.png")).unwrap().to_rgb8();
    let remains = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("goldens").join(name);
    if !golden.is_file() {
        keep(&remains, &[("actual", &actual)]);
        return Err(format!(
            "{name}: {} is missing; look at {} and bless it with UMBRAGE_BLESS=1",
            golden.display(),
            remains.display()
        ));
    }
    let expected = image::open(&golden).unwrap().to_rgb8();
    if expected.dimensions() != actual.dimensions() {
        keep(&remains, &[("actual", &actual), ("expected", &expected)]);
        return Err(format!("{name}: the size changed; see {}", remains.display()));
    }
    let mut difference = expected.clone();
    let (mut changed, mut largest) = (0_u32, 0_u8);
    for (d, a) in difference.pixels_mut().zip(actual.pixels()) {
        let levels = [0, 1, 2].map(|c| d.0[c].abs_diff(a.0[c]));
        let most = levels.into_iter().max().unwrap_or(0);
        changed += u32::from(most > MAX_LEVELS);
        largest = largest.max(most);
        d.0 = levels.map(|l| l.saturating_mul(4));
    }
    let share = f64::from(changed) / f64::from(expected.width() * expected.height());
    if share <= MAX_CHANGED_SHARE {
        return Ok(());
    }
    keep(&remains, &[("actual", &actual), ("expected", &expected), ("difference", &difference)]);
    let figures = serde_json::json!({"changed_share": share, "largest_levels": largest});
    std::fs::write(remains.join("figures.json"), figures.to_string()).unwrap();
    Err(format!("{name}: {:.2}% of the pixels changed; see {}", share * 100.0, remains.display()))
}

fn keep(folder: &Path, pictures: &[(&str, &RgbImage)]) {
    std::fs::create_dir_all(folder).unwrap();
    for (name, picture) in pictures {
        picture.save(folder.join(format!("{name}.png"))).unwrap();
    }
}
