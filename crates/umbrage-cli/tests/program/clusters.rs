//! Levels of detail: made ahead, read from a file, drawn, shown, and left out.

use crate::bad_input::refuses;
use crate::desk::{Desk, keys};
use umbrage_measure::LEVEL_COLORS;
use umbrage_testing::needs;

const FILE: &str = "town.clusters";

/// A desk with the file of a small town's levels of detail.
fn prepared() -> Desk {
    let desk = Desk::new();
    desk.succeed(&["prepare", "town:20", "-o", FILE]);
    desk
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

#[test]
fn levels_of_detail_are_made_ahead() {
    let desk = Desk::new();
    let text = desk.succeed(&["prepare", "town:20", "-o", FILE]);
    let json = desk.json(&["prepare", "town:20", "-o", "again.clusters", "--json"]);
    let all = ["bytes", "clusters", "level_triangles", "levels", "scene", "seconds", "triangles"];
    assert_eq!(keys(&json), all);
    assert_eq!(json["scene"], "town:20");
    let number = |key: &str| json[key].as_u64().unwrap();
    assert_eq!(number("bytes"), std::fs::metadata(desk.path("again.clusters")).unwrap().len());
    let [triangles, of_levels] = ["triangles", "level_triangles"].map(number);
    assert!((triangles + 1..3 * triangles).contains(&of_levels), "{json}");
    assert!(number("levels") > 2 && number("clusters") >= of_levels / 128, "{json}");
    let holds = format!(
        "{triangles} triangles, {of_levels} in {} clusters of {} levels\n",
        number("clusters"),
        number("levels")
    );
    assert!(text.starts_with(&holds), "{text}");
    assert!(text.contains(&format!("wrote: {FILE} (")), "{text}");
    let [first, again] =
        [FILE, "again.clusters"].map(|name| std::fs::read(desk.path(name)).unwrap());
    assert!(first == again, "the same scene gives the same file");
    assert_eq!(desk.listing(), ["again.clusters", FILE]);
}

#[test]
fn levels_of_detail_are_written_whole_or_not_at_all() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("folder")).unwrap();
    for (output, expected) in [
        ("missing/town.clusters", "--output: the folder missing must exist"),
        ("folder", "--output: folder is a folder"),
    ] {
        refuses(&desk, &["prepare", "town:20", "-o", output], expected);
    }
    refuses(&desk, &["prepare", "twon", "-o", FILE], "did you mean `town`?");
    refuses(&desk, &["prepare", "town:20"], "--output <FILE>");
    // Where not even the superuser can write.
    if cfg!(target_os = "linux") {
        let args = ["prepare", "town:20", "-o", "/proc/town.clusters"];
        refuses(&desk, &args, "--output: cannot write in /proc");
    }
    assert_eq!(desk.listing(), ["folder"]);
}

#[needs(gpu)]
#[test]
fn a_prepared_scene_gives_the_same_picture() {
    let desk = prepared();
    let render = |options: &str| {
        let common = "render town:20 -o p.png --size 160x90 --samples 1";
        desk.succeed(&words(&format!("{common} {options}")));
        image::open(desk.path("p.png")).unwrap().to_rgb8()
    };
    let [all, prepared] = ["--full-detail", "--clusters town.clusters"].map(render);
    let far = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 24)
    };
    let differing = all.pixels().zip(prepared.pixels()).filter(|&pair| far(pair)).count();
    assert!(differing <= 160 * 90 / 100, "{differing} pixels differ");
    // The very same levels are drawn as without the file.
    let [made, read] =
        ["", "--clusters town.clusters"].map(|o| render(&format!("{o} --aov clusters")));
    assert!(made == read, "the clusters differ");
}

#[needs(gpu)]
#[test]
fn files_of_something_else_are_refused() {
    let desk = prepared();
    let bytes = std::fs::read(desk.path(FILE)).unwrap();
    let render = |file: &str, expected: &str| {
        let args = ["render", "town:20", "-o", "p.png", "--clusters", file];
        refuses(&desk, &args, &format!("--clusters: {file}: {expected}"));
    };
    let changed = |name: &str, at: usize| {
        let mut bytes = bytes.clone();
        bytes[at] ^= 1;
        std::fs::write(desk.path(name), bytes).unwrap();
    };
    for length in [8, 70, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(desk.path("short"), &bytes[..length]).unwrap();
        render("short", "the file is damaged; write it again with `umbrage prepare`");
    }
    std::fs::write(desk.path("long"), [&bytes[..], b"0"].concat()).unwrap();
    render("long", "the file is damaged");
    for at in [90, bytes.len() / 2, bytes.len() - 1] {
        changed("flipped", at);
        render("flipped", "the file is damaged");
    }
    changed("version", 8);
    render("version", "the file has format 0, not 1");
    changed("magic", 0);
    render("magic", "this is no file of clusters");
    desk.write("empty", "");
    render("empty", "this is no file of clusters");
    render("missing", "No such file");
    std::fs::create_dir(desk.path("folder")).unwrap();
    render("folder", "");
    let args = ["render", "town:20", "-o", "p.png", "--backend", "reference", "--clusters", FILE];
    refuses(&desk, &args, "--clusters: town.clusters: needs a GPU");
    for other in ["town:21", "pole"] {
        let args = ["compare", other, "-o", "r", "--clusters", FILE];
        refuses(&desk, &args, "--clusters: town.clusters: the clusters belong to another scene");
    }
}

/// The farther away, the coarser.
#[needs(gpu)]
#[test]
fn levels_follow_the_distance() {
    let desk = Desk::new();
    desk.succeed(&["prepare", "colossus:1", "-o", "colossus.clusters"]);
    let common = "render colossus:1 --clusters colossus.clusters --samples 1 --target 0,5,0";
    let coarsest = [12, 200].map(|distance| {
        let view = format!("--eye 0,6,{distance} --size 160x90 --aov clusters -o p.exr");
        desk.succeed(&words(&format!("{common} {view}")));
        let seen = image::open(desk.path("p.exr")).unwrap().to_rgb32f();
        let levels = seen.pixels().map(|pixel| {
            let [level, number, _] = pixel.0;
            let is_sky = pixel.0 == [-1.0; 3];
            assert!(is_sky || level >= 0.0 && number >= 0.0, "{pixel:?}");
            assert_eq!(level.fract() + number.fract(), 0.0);
            level
        });
        levels.fold(0.0, f32::max)
    });
    assert!(coarsest[0] + 2.0 <= coarsest[1], "at most level {coarsest:?}");
    let png = "--eye 0,6,20 --size 600x300 --aov clusters -o p.png";
    desk.succeed(&words(&format!("{common} {png}")));
    let picture = image::open(desk.path("p.png")).unwrap().to_rgb8();
    for (level, color) in (0..).zip(LEVEL_COLORS.iter()) {
        assert_eq!(picture.get_pixel(15 + 15 * level, 20).0, *color, "the legend of level {level}");
    }
}

#[test]
fn clusters_are_shown_where_they_are_drawn() {
    let desk = Desk::new();
    for (options, expected) in [
        ("--full-detail", "--full-detail: leave it out for --aov clusters"),
        ("--backend reference", "--backend: --aov clusters shows what a GPU draws; take gpu"),
        ("--shadows log", "--aov: only a GPU with compute shaders"),
    ] {
        let args = format!("render pole -o p.png --aov color,clusters {options}");
        refuses(&desk, &words(&args), expected);
    }
    let args = words("compare pole -o r --full-detail --clusters pole.clusters");
    refuses(&desk, &args, "cannot be used with");
}

#[needs(gpu)]
#[test]
fn comparisons_take_all_triangles_or_levels_of_detail() {
    let desk = prepared();
    let wrong = |options: &str| {
        let args = format!(
            "compare town:20 -o report --json --size 160x90 --shadows uniform:pcf3@1024 {options}"
        );
        let report = desk.json(&words(&args));
        report["results"][0]["wrong_fraction"].as_f64().unwrap()
    };
    let [all, levels] = ["--full-detail", "--clusters town.clusters"].map(wrong);
    assert!((all - levels).abs() < 0.01, "{all} of all triangles, {levels} of levels of detail");
}
