//! `umbrage view`: real windows, driven by scripts.

use crate::screen::Windows;
use std::fmt::Write;
use umbrage::Technique;
use umbrage::language::{FILTERS, PARTITIONS, WARPS, Word};
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
    let mut script = format!("{SMALL}technique uniform:hard@256\nwait ready\nshoot first\n");
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
        all(WARPS, "", "@256"),
        all(PARTITIONS, "adaptive+", "@256"),
        all(FILTERS, "uniform:", "@256"),
    ];
    all.concat()
}
