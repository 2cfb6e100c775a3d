//! `umbrage view`: real windows, driven by scripts.

use crate::scene_options::{Block, write};
use crate::screen::{Scripted, Shot, Windows};
use serde_json::json;
use std::fmt::Write;
use umbrage::Technique;
use umbrage::language::{FILTERS, PARTITIONS, WARPS, Word};
use umbrage_measure::{
    ErrorScale, FALSE_LIGHT, FALSE_SHADOW, LEVEL_COLORS, PARTITIONS as MAP_COLORS,
};
use umbrage_testing::needs;

/// A small window whose picture lies between two bars: quick to draw without a GPU.
const SMALL: &str = "size 640 480\npanel controls off\nresolution 0.5\ncount-errors off\n";

#[needs(gpu, window)]
#[test]
fn a_window_shows_a_scene() {
    let mut windows = Windows::new("a_window_shows_a_scene");
    let run = windows.script("pole", "size 640 480\nwait ready\nwait truth\nshoot window\n");
    let shot = run.shot("window");
    assert_eq!(shot.is_fine().size(), [640, 480]);
}

/// Each word and option of the language draws nearly the same picture; `log` tells why it cannot.
#[needs(gpu, window)]
#[test]
fn every_word_of_the_language_is_shown() {
    let mut script = format!("{SMALL}technique uniform:hard@512\nwait ready\nshoot first\n");
    let techniques = techniques();
    for (i, technique) in techniques.iter().enumerate() {
        let _ = writeln!(script, "technique {technique}\nwait ready\nshoot t{i}");
    }
    let run = Windows::new("every_word_of_the_language_is_shown").script("contacts", &script);
    let first = run.shot("first");
    for (i, technique) in techniques.iter().enumerate() {
        let shot = run.shot(&format!("t{i}"));
        println!("t{i}: {technique}");
        shot.is_fine();
        // Without shadows, with a message, and half as bright.
        if ["none", "log", "raw"].iter().any(|word| technique.contains(word)) {
            shot.is_unlike(&first, 1.0);
        } else {
            shot.is_like(&first, 3.0);
        }
    }
}

/// The examples of all words, each also with each of its options that needs no other one.
fn techniques() -> Vec<String> {
    let all = |words: &[Word], before: &str, after: &str| -> Vec<String> {
        let text = |part: &str| format!("{before}{part}{after}");
        let is_technique = |text: &String| text.parse::<Technique>().is_ok();
        words
            .iter()
            .flat_map(|word| {
                let alone = text(word.example);
                assert!(is_technique(&alone), "{alone}");
                let options =
                    word.options.iter().map(|o| format!("{}({})", word.example, o.example));
                let options: Vec<String> = options.map(|o| text(&o)).filter(is_technique).collect();
                [vec![alone], options].concat()
            })
            .collect()
    };
    let all = [
        all(WARPS, "", "@512"),
        all(PARTITIONS, "adaptive+", "@512"),
        all(FILTERS, "uniform:", "@512"),
    ];
    all.concat()
}

/// Writes `stage.gltf`: a box that slides over a floor within a second and rests there for a minute,
/// two cameras and three lights. So a playing clip is not back at its begin when frames come late.
fn write_stage(windows: &Windows) {
    let blocks: [Block<'_>; 2] =
        [("Floor", [0.0, -0.5, 0.0], [5.0, 0.5, 5.0]), ("Box", [-2.0, 1.0, 0.0], [0.5, 1.0, 0.5])];
    let floats = |count: u64, kind: &str, offset: u64| {
        json!({"bufferView": 2, "byteOffset": offset, "componentType": 5126, "count": count,
               "type": kind})
    };
    let times = [0.0, 1.0, 60.0f32];
    let places = [[-2.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.0, 0.0f32]];
    let keys = times.into_iter().chain(places.into_iter().flatten());
    let keys: Vec<u8> = keys.flat_map(f32::to_le_bytes).collect();
    std::fs::write(windows.desk.path("keys.bin"), keys).unwrap();
    let corners = json!({"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
                         "min": [-1, -1, -1], "max": [1, 1, 1]});
    let indices = json!({"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"});
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let down = [-half, 0.0, 0.0, half];
    let light = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    let more = json!({
        "accessors": [corners, indices, floats(3, "SCALAR", 0), floats(3, "VEC3", 12)],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
            {"buffer": 1, "byteLength": 48},
        ],
        "buffers": [
            {"byteLength": 168, "uri": "box.bin"},
            {"byteLength": 48, "uri": "keys.bin"},
        ],
        "animations": [{
            "name": "Slide", "samplers": [{"input": 2, "output": 3}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
        }],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1, "zfar": 50}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "directional", "name": "noon", "intensity": 1000},
            {"type": "spot", "name": "torch", "intensity": 500, "range": 40,
             "spot": {"outerConeAngle": 0.6}},
            {"type": "point", "name": "bulb", "intensity": 500},
        ]}},
        "nodes": [
            {"name": "front", "camera": 0, "translation": [0, 3, 10],
             "rotation": [-0.13, 0.0, 0.0, 0.9915]},
            {"name": "above", "camera": 0, "translation": [0, 12, 0], "rotation": down},
            {"rotation": [-0.5, 0.5, 0.5, 0.5], "extensions": light(0)},
            {"translation": [0, 6, 0], "rotation": down, "extensions": light(1)},
            {"translation": [0.5, 4, 2], "extensions": light(2)},
        ],
    });
    write(&windows.desk, "stage.gltf", &blocks, &more);
}

/// Lines of a script which does something, waits, and takes a picture.
fn shoot(actions: &str, wait: &str, name: &str) -> String {
    format!("{}\nwait {wait}\nshoot {name}\n", actions.replace("; ", "\n"))
}

#[needs(gpu, window)]
#[test]
fn overlays_have_legends() {
    let mut script = format!("{SMALL}technique uniform+z2:hard@64\n");
    let overlays = ["none", "error", "texels", "partition", "difference"];
    for overlay in overlays {
        let wait = if overlay == "difference" { "truth" } else { "ready" };
        script += &shoot(&format!("overlay {overlay}"), wait, overlay);
    }
    let run = Windows::new("overlays_have_legends").script("contacts", &script);
    let shots = overlays.map(|overlay| run.shot(overlay));
    for shot in &shots {
        shot.is_fine();
    }
    let [plain, error, grid, maps, difference] = &shots;
    [error, grid, maps, difference].iter().for_each(|shot| shot.is_unlike(plain, 2.0));
    let scale = ErrorScale::default();
    error.has_legend(&[1.0 / scale.max(), 1.0, scale.max()].map(|e| scale.color(e).unwrap()));
    grid.has_legend(&[FALSE_LIGHT]);
    maps.has_legend(&MAP_COLORS[..2]);
    difference.has_legend(&[FALSE_LIGHT, FALSE_SHADOW]);
    let is_false_light = |rgb: &[u8; 3]| *rgb == FALSE_LIGHT;
    let wrong = difference.picture([0.0, 1.0], [0.2, 0.7]).filter(is_false_light).count();
    assert!(wrong > 20, "{wrong} pixels of false light");
}

/// Only scenes that are drawn as clusters show their levels of detail.
#[needs(gpu, window)]
#[test]
fn clusters_are_shown_where_there_are_any() {
    let mut windows = Windows::new("clusters_are_shown_where_there_are_any");
    let mut script = format!("{SMALL}technique uniform@64\n");
    script += &shoot("overlay none", "ready", "plain");
    script += &shoot("overlay clusters", "ready", "clusters");
    // The overlay does not come along into a scene that has none.
    script += &shoot("open pole", "ready", "small");
    script += &shoot("press 6\nexpect not drawn as clusters", "ready", "refused");
    // 49 statues have more than a million triangles.
    let run = windows.script("statues:7", &script);
    let [plain, clusters, small, refused] =
        ["plain", "clusters", "small", "refused"].map(|name| run.shot(name));
    clusters.is_fine().is_unlike(&plain, 2.0);
    clusters.has_legend(&*LEVEL_COLORS);
    small.is_fine();
    assert!(refused.has_error());
    let run = windows.try_script("pole", &format!("{SMALL}wait ready\noverlay clusters\n"));
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("the scene is not drawn as clusters"), "{}", run.stderr);
}

/// Two techniques that differ, and a technique and the truth, which hardly do.
#[needs(gpu, window)]
#[test]
fn techniques_are_compared() {
    let mut script = format!("{SMALL}technique adaptive:pcf3@1024\nsecond uniform:hard@32\n");
    script += &shoot("compare alone", "ready", "alone");
    script += &shoot("compare side by side", "ready", "beside");
    script += &shoot("compare wipe; wipe 0.3", "ready", "wipe");
    script += &shoot("wipe 0", "ready", "second");
    script += "compare flip\n";
    // Uneven times, so that not all of them fall on the same picture.
    let moments = ["0.3 s", "0.5 s", "0.7 s", "0.9 s", "1.1 s"];
    for (i, moment) in moments.iter().enumerate() {
        script += &shoot(&format!("wait {moment}"), "ready", &format!("flip{i}"));
    }
    script += &shoot("second truth; compare wipe; wipe 0", "truth", "truth");
    script += &shoot("compare side by side", "truth", "truth-beside");
    script += &shoot("compare flip", "truth", "truth-flip");
    script += &shoot("compare alone", "ready", "again");
    let run = Windows::new("techniques_are_compared").script("contacts", &script);
    let shot = |name: &str| run.shot(name);
    let [alone, second, truth] = ["alone", "second", "truth"].map(shot);
    for shot in [&alone, &second, &truth, &shot("beside"), &shot("truth-beside")] {
        shot.is_fine();
    }
    second.is_unlike(&alone, 1.5);
    truth.is_like(&alone, 1.5);
    shot("again").is_like(&alone, 0.01);
    let wipe = shot("wipe");
    let sides = [[0.0, 0.29], [0.31, 1.0]];
    for (whole, side) in [&alone, &second].into_iter().zip(sides) {
        let difference = wipe.difference(whole, side, [0.2, 1.0]);
        assert!(difference < 0.01, "{side:?}: {difference}");
    }
    // Pictures that are shown in turn are one or the other.
    let is = |shot: &Shot, other| shot.difference(other, [0.02, 1.0], [0.2, 1.0]) < 0.01;
    let mut seen = [false; 2];
    for i in 0..moments.len() {
        let flip = shot(&format!("flip{i}"));
        let which = [&alone, &second].map(|whole| is(&flip, whole));
        assert!(which[0] != which[1], "flip{i}");
        seen = [seen[0] || which[0], seen[1] || which[1]];
    }
    assert_eq!(seen, [true; 2]);
    let beside = shot("truth-beside");
    let [left, right] = [[0.0, 0.49], [0.5, 0.99]];
    let [technique, truth] = [left, right].map(|x| beside.picture(x, [0.2, 1.0]));
    let differing =
        technique.zip(truth).filter(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 24));
    let (differing, all) = (differing.count(), beside.picture(left, [0.2, 1.0]).count());
    assert!(differing * 50 < all, "{differing} of {all} pixels differ");
}

/// Each step changes the picture of the one before.
#[needs(gpu, window)]
#[test]
fn lights_and_views_are_chosen() {
    let mut windows = Windows::new("lights_and_views_are_chosen");
    write_stage(&windows);
    let steps = [
        "camera front",
        "sun 200 30",
        "light noon",
        "sun 90 10",
        "hour 9",
        "headlight",
        "light torch",
        "light bulb",
        "technique adaptive:pcss(light=0.2m)@512; light-size 1m",
        "hour 15; technique adaptive:pcss(light=20deg)@512; light-size none",
        "camera above",
        "fov 30",
        "ortho 14",
        "reset",
        "orbit 30 10",
        "look 4 0",
        "walk 1 0 1",
        "fly on; approach 0.7",
        "stand 4 6 8 0 0 0",
        "overlay texels; fit box",
        "fit seen",
        "overlay none; technique lispsm@512; freeze on; orbit 40 20; approach 2",
        "freeze off",
    ];
    let mut script = format!("{SMALL}technique adaptive:pcf3@512\n");
    for (i, step) in steps.iter().enumerate() {
        script += &shoot(step, "ready", &format!("s{i}"));
    }
    let run = windows.script("stage.gltf", &script);
    let shots: Vec<Shot> = (0..steps.len()).map(|i| run.shot(&format!("s{i}"))).collect();
    // The view turns around what it shows, though the camera of the file has no target.
    let orbited = steps.iter().position(|step| step.starts_with("orbit")).unwrap();
    let is_floor = |rgb: &[u8; 3]| rgb.iter().all(|&c| c > 235);
    let floor = shots[orbited].picture([0.3, 0.7], [0.3, 0.9]).filter(is_floor).count();
    assert!(floor > 5000, "{floor} pixels of the floor");
    for ((before, shot), step) in shots.iter().zip(&shots[1..]).zip(&steps[1..]) {
        println!("{step}");
        shot.is_fine();
        shot.is_unlike(before, 0.2);
    }
}

/// A scene that cannot be read leaves the one that is shown; a session brings back what it kept.
#[needs(gpu, window)]
#[test]
fn scenes_and_sessions_are_opened() {
    let mut windows = Windows::new("scenes_and_sessions_are_opened");
    write_stage(&windows);
    windows.desk.write("broken.glb", "glTF, but no more than that");
    windows.desk.write("broken.json", "{}");
    let mut script = SMALL.to_owned();
    for name in ["sphere", "fence", "slit"] {
        script += &shoot(&format!("open {name}"), "ready", name);
    }
    script += "technique lispsm+z2:pcf3@256\nsecond psm@64\ncompare wipe\noverlay partition\norbit 20 5\n";
    script += &shoot("sun 100 40; fit seen", "ready", "saved");
    script += "save-session kept.json\nexpect saved kept.json\n";
    for (i, wrong) in ["broken.glb", "nowhere.glb", "broken.json", "twon"].iter().enumerate() {
        script +=
            &shoot(&format!("fail-to-open {wrong}\nexpect {wrong}"), "ready", &format!("wrong{i}"));
    }
    script += &shoot("open stage.gltf; compare alone", "ready", "stage");
    script += &shoot("clip 1; seek 0.5", "ready", "posed");
    script += "save-session posed.json\n";
    script += &shoot("open kept.json", "ready", "opened");
    let run = windows.script("pole", &script);
    for name in ["sphere", "fence", "slit", "saved", "stage"] {
        run.shot(name).is_fine();
    }
    let saved = run.shot("saved");
    for i in 0..4 {
        let wrong = run.shot(&format!("wrong{i}"));
        assert!(wrong.has_error());
        // A message of two lines leaves the picture less room.
        if i < 3 {
            wrong.is_like(&saved, 0.01);
        }
    }
    run.shot("opened").is_like(&saved, 0.5);
    run.shot("posed").is_unlike(&run.shot("stage"), 1.0);

    let posed = run.shot("posed");
    let script = format!("{SMALL}wait ready\nshoot from-file\n");
    let run = windows.script("posed.json", &script);
    run.shot("from-file").is_like(&posed, 0.5);
    // Other commands take the same session.
    let options = ["--session", "kept.json", "--size", "64x48", "--json", "--backend", "reference"];
    let report = windows.desk.json(&[&["compare"], &options[..]].concat());
    let results = report["results"].as_array().unwrap().iter().map(|r| &r["shadows"]);
    assert_eq!(results.collect::<Vec<_>>(), ["lispsm+z2:pcf3@256", "psm@64"]);
}

/// Playing moves the picture, and the truth moves with it.
#[needs(gpu, window)]
#[test]
fn animations_play() {
    let mut windows = Windows::new("animations_play");
    write_stage(&windows);
    let mut script = format!("{SMALL}technique adaptive:pcf3@1024\nsecond truth\n");
    script += &shoot("camera front; sun 200 40", "ready", "rest");
    script += &shoot("clip 1; seek 0", "ready", "begin");
    script += &shoot("seek 1", "ready", "end");
    script += &shoot("seek 0.5", "ready", "half");
    script += &shoot("compare wipe; wipe 0", "truth", "truth");
    script += &shoot("compare alone; seek 0; play on", "2 s", "playing");
    script += &shoot("play off; clip 0", "ready", "again");
    let run = windows.script("stage.gltf", &script);
    let names = ["rest", "begin", "end", "half", "truth", "playing", "again"];
    let [rest, begin, end, half, truth, playing, again] = names.map(|name| run.shot(name));
    begin.is_fine().is_like(&rest, 0.1);
    again.is_like(&rest, 0.01);
    end.is_unlike(&begin, 1.0);
    half.is_unlike(&begin, 1.0);
    half.is_unlike(&end, 1.0);
    truth.is_like(&half, 1.0);
    playing.is_unlike(&begin, 0.5);
}

/// Two thousand frames later as much memory is in use as before. What the allocator keeps for a thread
/// may come on top once, on a busy machine 14 MB of 174; kilobytes a frame would be more.
#[needs(gpu, window)]
#[test]
fn memory_stays_flat() {
    let script = "size 300 300\npanel controls off\nresolution 0.2\ncount-errors off\n\
                  technique lispsm+z2:pcf3@128\nwait 200 turns\nnote-memory\n\
                  wait 2000 turns\ncheck-memory 10%\nshoot window\n";
    let run = Windows::new("memory_stays_flat").script("pole", script);
    let noted: Vec<&str> = run.stderr.lines().filter(|l| l.contains("Memory {")).collect();
    assert_eq!(noted.len(), 2, "{}", run.stderr);
    // Where nothing is counted, nothing grows.
    for line in noted {
        let digits = |c: char| !c.is_ascii_digit();
        let numbers: Vec<u64> = line.split(digits).filter_map(|n| n.parse().ok()).collect();
        assert!(numbers.len() == 4 && numbers.iter().all(|&n| n > 0), "{line}");
    }
    run.shot("window").is_fine();
}

/// A device that is lost is opened again, with all that was set.
#[needs(gpu, window)]
#[test]
fn a_lost_device_is_opened_again() {
    let mut script = SMALL.to_owned();
    script += "technique lispsm+z2:pcf3@256\nsun 200 40\norbit 20 5\noverlay partition\n";
    script += &shoot("panel theory on; panel theory off", "ready", "before");
    script += "lose-device\nexpect the GPU was lost\n";
    script += &shoot("size 640 480", "ready", "after");
    script += &shoot("press Escape; orbit 10 0", "ready", "on");
    let run = Windows::new("a_lost_device_is_opened_again").script("contacts", &script);
    let [before, after, on] = ["before", "after", "on"].map(|name| run.shot(name));
    before.is_fine();
    assert!(after.has_error() && !on.has_error());
    after.is_like(&before, 0.1);
    on.is_fine().is_unlike(&after, 1.0);
}

/// Small, large, bright, enlarged and minimised windows.
#[needs(gpu, window)]
#[test]
fn windows_have_any_size_and_look() {
    let mut windows = Windows::on_screen("windows_have_any_size_and_look", [3840, 2160]);
    let mut script = "count-errors off\nresolution 0.5\n".to_owned();
    script += &shoot("size 390 844", "ready", "phone");
    script += &shoot("theme light", "ready", "light");
    script += &shoot("theme dark; scale 2", "ready", "scaled");
    script += &shoot("scale 1; size 640 480", "ready", "before");
    script += &shoot("minimise; wait 0.5 s; restore", "ready", "after");
    script += &shoot("resolution 0.25; size 3840 2160", "ready", "large");
    let run = windows.script("pole", &script);
    let names = ["phone", "light", "scaled", "before", "after", "large"];
    let [phone, light, scaled, before, after, large] = names.map(|name| run.shot(name));
    for shot in [&phone, &light, &scaled, &before, &after, &large] {
        shot.is_fine();
    }
    assert_eq!([&phone, &before, &large].map(Shot::size), [[390, 844], [640, 480], [3840, 2160]]);
    light.is_unlike(&phone, 20.0);
    scaled.is_unlike(&phone, 2.0);
    after.is_like(&before, 0.01);
}

/// Each shortcut changes the picture of the one before.
#[needs(gpu, window)]
#[test]
fn keys_reach_everything() {
    let mut windows = Windows::new("keys_reach_everything");
    write_stage(&windows);
    let steps = [
        "press 2",
        "press 3",
        "press 4",
        "press 5",
        "press 1",
        "press O",
        "press 1",
        "press C",
        "press X",
        "press C; press C; press C",
        "press Escape; press T",
        "press Escape",
        "press F1",
        "press F1",
        "press H",
        "press R",
        "press F; press E; orbit 30 0; approach 2",
        "press F",
        "press P",
    ];
    let mut script =
        format!("{SMALL}technique uniform:hard@256\nsecond uniform:hard@32\nwait ready\n");
    script += "shoot begin\n";
    for (i, step) in steps.iter().enumerate() {
        script += &shoot(step, "ready", &format!("k{i}"));
    }
    script += "wait jobs\npress Escape\npress Escape\npress ctrl+S\n\
               expect umbrage-session.json\npress ctrl+P\nwait jobs\nexpect umbrage-view.png\n";
    let run = windows.script("stage.gltf", &script);
    let mut before = run.shot("begin");
    for (i, step) in steps.iter().enumerate() {
        println!("k{i}: {step}");
        let shot = run.shot(&format!("k{i}"));
        shot.is_fine();
        shot.is_unlike(&before, 0.3);
        before = shot;
    }
    let kept = windows.desk.listing();
    for name in ["umbrage-session.json", "umbrage-view.png"] {
        assert!(kept.iter().any(|kept| kept == name), "{name} is not among {kept:?}");
    }
}

/// Tab goes through all controls, which Space and Enter press, and to the picture, which arrows
/// turn.
#[needs(gpu, window)]
#[test]
fn the_keyboard_is_enough() {
    let mut script = SMALL.replace("panel controls off\n", "");
    script += &shoot("wait ready", "ready", "begin");
    script += &shoot("press Tab; press Space", "ready", "no-controls");
    script += &shoot("press Tab; press Enter", "ready", "times");
    script += &shoot("press Space", "ready", "no-times");
    script += &shoot("click 320 300; press ArrowRight; press ArrowRight", "ready", "turned");
    script += &shoot("press shift+ArrowRight", "ready", "sun");
    let run = Windows::new("the_keyboard_is_enough").script("contacts", &script);
    let names = ["begin", "no-controls", "times", "no-times", "turned", "sun"];
    let [begin, no_controls, times, no_times, turned, sun] = names.map(|name| run.shot(name));
    no_controls.is_fine().is_unlike(&begin, 5.0);
    times.is_fine().is_unlike(&no_controls, 5.0);
    no_times.is_like(&no_controls, 0.5);
    turned.is_fine().is_unlike(&no_times, 0.1);
    sun.is_fine().is_unlike(&turned, 0.1);
}

/// All panels can be open at once, and each control in them has a tooltip.
#[needs(gpu, window)]
#[test]
fn every_control_has_a_tooltip() {
    let mut windows = Windows::new("every_control_has_a_tooltip");
    write_stage(&windows);
    let panels = ["times", "try these", "theory", "shadow map", "light space", "keys"];
    let mut script = format!("{SMALL}technique adaptive+z2:pcf3@256\nwait ready\nshoot plain\n");
    for panel in panels {
        let name = panel.replace(' ', "-");
        script += &shoot(&format!("panel {panel} on"), "ready", &name);
        script += &format!("check-tooltips\npanel {panel} off\n");
    }
    script += "size 1280 800\npanel controls on\nclip 1\nsecond uniform:vsm\ncompare wipe\nlight-size 1deg\n";
    panels.iter().for_each(|panel| script += &format!("panel {panel} on\n"));
    script += &shoot("resolution 0.5", "ready", "all");
    script += "check-tooltips\n";
    let run = windows.script("stage.gltf", &script);
    let plain = run.shot("plain");
    for panel in panels {
        run.shot(&panel.replace(' ', "-")).is_fine().is_unlike(&plain, 3.0);
    }
    run.shot("all").is_fine();
}

/// What a script asks for in vain ends the program, and tells the line.
#[needs(gpu, window)]
#[test]
fn scripts_that_fail_name_the_line() {
    let mut windows = Windows::new("scripts_that_fail_name_the_line");
    for (script, expected) in [
        ("wait ready\njump", "line 2: there is no action `jump`"),
        ("wait ready\n\ncamera nowhere", "line 3: the scene has no camera `nowhere`"),
        ("technique lipsm", "line 1: "),
        ("clip 3", "line 1: "),
    ] {
        let Scripted { code, stderr, .. } = windows.try_script("pole", script);
        assert_eq!(code, 1, "{stderr}");
        assert!(stderr.contains(expected), "{script}: {stderr}");
    }
}

/// Without a screen there is one line that says so.
#[test]
fn without_a_screen_there_is_a_message() {
    let desk = crate::desk::Desk::new();
    let mut command = desk.command(&["view", "pole"]);
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    let run = command.output().unwrap();
    let told = String::from_utf8(run.stderr).unwrap();
    if cfg!(target_os = "linux") {
        assert_eq!(run.status.code(), Some(1), "{told}");
        assert!(told.starts_with("umbrage: no window: ") && told.lines().count() == 1, "{told}");
    }
    desk.write("s.txt", "wait ready");
    for args in [["--script", "s.txt"], ["--screenshot", "pictures"]] {
        let run = desk.run(&[&["view", "pole"], &args[..]].concat());
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains("required"), "{}", run.stderr);
    }
}
