//! Writing techniques with help: completion, and a panel whose controls change the text.

use crate::random::technique;
use proptest::prelude::*;
use umbrage::Technique;
use umbrage::language::{
    Completion, FILTERS, SIZES, Slot, WARPS, Word, complete, with_option, with_word, written,
};

/// The cursor is where the bar is.
fn at(text: &str) -> Vec<Completion> {
    let cursor = text.find('|').unwrap();
    complete(&text.replace('|', ""), cursor)
}

fn texts(text: &str) -> Vec<String> {
    at(text).into_iter().map(|c| c.text).collect()
}

fn is_planned(text: &str) -> bool {
    text.parse::<Technique>().is_ok_and(|technique| technique.check().is_ok())
}

#[test]
fn what_is_begun_is_completed() {
    for (text, expected) in [
        ("ad|", &["adaptive"][..]),
        ("Ad|", &["adaptive"]),
        ("ad|+z4@512", &["adaptive+z4@512"]),
        ("un|", &["unfocused", "uniform"]),
        ("lam|", &["lambda=12.5"]),
        ("pag|", &["paged"]),
        ("paged(|", &["paged(error=0.5)"]),
        ("paged+z|", &[]),
        ("paged:v|", &[]),
        ("paged:pcf3@2|", &["paged:pcf3@2048"]),
        ("lambda=|", &["lambda=12.5"]),
        ("no|", &["none"]),
        ("adaptive+|", &["adaptive+z4", "adaptive+face"]),
        ("adaptive+|@512", &["adaptive+z4@512", "adaptive+face@512"]),
        ("adaptive+face+|", &["adaptive+face+z4"]),
        ("adaptive:pc|", &["adaptive:pcf3", "adaptive:pcss"]),
        ("adaptive:m|@2048", &["adaptive:msm@2048"]),
        ("adaptive:v|(leak=0.2)", &["adaptive:vsm(leak=0.2)"]),
        ("adaptive:p|(leak=0.2)", &["adaptive:pcf3", "adaptive:pcss"]),
        ("adaptive@8|", &["adaptive@800x600"]),
        ("tsm(|", &["tsm(focus=5)"]),
        ("tsm(fo|)", &["tsm(focus=5)"]),
        ("tsm(focus=|)+z2", &["tsm(focus=5)+z2"]),
        ("tsm(fo|+z2(fitted)", &["tsm(focus=5)+z2(fitted)"]),
        ("adaptive+z3(a|", &["adaptive+z3(at=5/10)"]),
        ("adaptive+z3(fitted,|)", &["adaptive+z3(fitted,overlap=0.1)"]),
        ("adaptive:pcf3(po|", &["adaptive:pcf3(blur=2px,poisson)"]),
        ("adaptive:pcf3(blur=1px,po|)", &["adaptive:pcf3(blur=1px,poisson)"]),
        ("adaptive:csm4(raw,of|)", &[]),
        ("uniform(stable)+z4(f|)", &[]),
        ("uniform(stable)+f|", &[]),
        // A filter is meant behind the usual warp.
        ("vs|", &["adaptive:vsm"]),
        ("pcf|", &["adaptive:pcf3"]),
        ("cascades|", &["uniform+z4"]),
        // Nothing begins like this.
        ("lipsm|", &["lispsm"]),
        ("lipsm|+z4", &["lispsm+z4"]),
        ("adaptive:pfc|@64", &["adaptive:pcf3@64"]),
        ("adaptive+z4(fited|)", &["adaptive+z4(fitted)"]),
        // What is wrong elsewhere stays wrong.
        ("lipsm+z4:v|", &[]),
    ] {
        assert_eq!(texts(text), expected, "{text}");
    }
}

/// What is complete can go on, with whatever has not been said.
#[test]
fn what_is_complete_goes_on() {
    let shown = |text: &str| at(text).into_iter().map(|c| c.shown).collect::<Vec<_>>();
    let filters = FILTERS.iter().map(|word| format!(":{word}"));
    let sizes = SIZES.iter().map(|word| format!("@{word}"));
    let rest: Vec<String> = filters.chain(sizes).collect();
    let with_rest = |first: &[&str]| {
        first.iter().map(|&word| word.to_owned()).chain(rest.clone()).collect::<Vec<_>>()
    };
    assert_eq!(shown("adaptive|"), with_rest(&["area", "+zK", "+face"]));
    assert_eq!(shown("adaptive(area)|"), with_rest(&["+zK", "+face"]));
    assert_eq!(shown("uniform(stable)|"), with_rest(&["+zK"]));
    assert_eq!(
        shown("lispsm+face+z2|"),
        with_rest(&["fitted", "practical=BLEND", "at=METRES/METRES", "overlap=SHARE"])
    );
    assert_eq!(shown("lispsm+z2(at=9|)"), ["overlap=SHARE"]);
    assert_eq!(shown("psm|:pcf3@64"), ["+zK", "+face"]);
    assert_eq!(
        shown("adaptive:evsm|@64"),
        [":evsm2", "blur=WIDTH", "leak=SHARE", "exponent=NUMBER", "half"]
    );
    // A technique without maps has nothing more, nor has one with everything.
    assert_eq!(shown("none|"), [""; 0]);
    assert_eq!(shown("adaptive(area)+z2(fitted,overlap=0.1)+face(sides):hard@64|"), [""; 0]);
    // At an empty text there are all warps.
    let warps = WARPS.iter().map(Word::to_string).chain(["none".to_owned()]);
    assert_eq!(shown("|"), warps.collect::<Vec<_>>());
}

#[test]
fn examples_values_are_selected() {
    for (text, accepted, selected) in [
        ("adaptive+|", "adaptive+z4", "4"),
        ("lam|", "lambda=12.5", "12.5"),
        ("psm@|:", "", ""),
        ("psm@|", "psm@2048", "2048"),
        ("tsm|:pcf3", "tsm(focus=5):pcf3", "5"),
        ("psm:esm(|", "psm:esm(blur=7)", "7"),
        ("psm:pcs|", "psm:pcss", ""),
    ] {
        let first = at(text).into_iter().next();
        let shown = first.as_ref().map(|c| (c.text.as_str(), &c.text[c.selected.clone()]));
        assert_eq!(shown.unwrap_or_default(), (accepted, selected), "{text}");
    }
}

/// What a panel shows is what the text says.
#[test]
fn slots_are_read() {
    let text = "lispsm+face(sides)+z4(practical=0.7,overlap=0.1):csm8(blur=2px,offset)@800x600";
    let read = Slot::ALL.map(|slot| {
        let word = written(text, slot).unwrap();
        let options = word.options.iter().map(|(option, value)| (option.name, *value));
        (word.word.name, word.value, options.collect::<Vec<_>>())
    });
    assert_eq!(
        read,
        [
            ("lispsm", "", vec![]),
            ("z", "4", vec![("practical", "0.7"), ("overlap", "0.1")]),
            ("face", "", vec![("sides", "")]),
            ("csm", "8", vec![("blur", "2px"), ("offset", "")]),
            ("WxH", "800x600", vec![]),
        ]
    );
    // What is not written has its default meaning.
    let read = |text, slot| written(text, slot).map(|word| word.text);
    for (text, expected) in [
        ("psm", [Some("psm"), None, None, Some("hard"), Some("1024")]),
        ("none", [Some("adaptive"), None, None, Some("none"), Some("1024")]),
        ("paged", [Some("paged"), None, None, Some("hard"), None]),
        ("none@2", [None; 5]),
    ] {
        assert_eq!(Slot::ALL.map(|slot| read(text, slot)), expected, "{text}");
    }
}

#[test]
fn words_change() {
    for (text, slot, word, expected) in [
        ("psm+z2:vsm(blur=7)@64", Slot::Warp, Some("tsm"), "tsm+z2:vsm(blur=7)@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Slices, Some("z3"), "psm+z3:vsm(blur=7)@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Slices, None, "psm:vsm(blur=7)@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Faces, Some("face"), "psm+z2+face:vsm(blur=7)@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Filter, Some("csm4"), "psm+z2:csm4(blur=7)@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Filter, Some("pcss"), "psm+z2:pcss@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Filter, None, "psm+z2@64"),
        ("psm+z2:vsm(blur=7)@64", Slot::Size, Some("1px"), "psm+z2:vsm(blur=7)@1px"),
        ("psm", Slot::Filter, Some("pcf3(blur=2px)"), "psm:pcf3(blur=2px)"),
        ("psm:pcf3(blur=9px,poisson)", Slot::Filter, Some("pcf5"), "psm:pcf5(blur=9px,poisson)"),
        // Options that do not go with the new word are taken away.
        ("psm:pcf3(blur=9px,poisson)", Slot::Filter, Some("pcf9"), "psm:pcf9(blur=9px)"),
        ("psm+z3(at=5/9,overlap=0.1)", Slot::Slices, Some("z2"), "psm+z2(overlap=0.1)"),
        ("adaptive(area)", Slot::Warp, Some("lambda=2"), "lambda=2"),
        ("none", Slot::Slices, Some("z4"), "adaptive+z4:none"),
        ("none", Slot::Filter, Some("hard"), "adaptive:hard"),
        ("psm", Slot::Warp, None, "adaptive"),
        ("psm:pcf3@2048", Slot::Warp, Some("paged"), "paged:pcf3@2048"),
        ("paged(error=0.5):pcf3", Slot::Warp, Some("psm"), "psm:pcf3"),
        ("paged(error=0.5)", Slot::Size, Some("2048"), "paged(error=0.5)@2048"),
        ("paged@2048", Slot::Size, None, "paged"),
    ] {
        assert_eq!(with_word(text, slot, word).as_deref(), Ok(expected), "{text} {word:?}");
    }
    for (text, slot, word, expected) in [
        ("psm", Slot::Warp, "pms", "did you mean `psm`?"),
        ("psm", Slot::Slices, "z99", "from 1 to 16"),
        ("uniform(stable)", Slot::Faces, "face", "`+face`: stable maps do not turn"),
        ("no technique", Slot::Size, "64", "unknown warp"),
        ("psm", Slot::Warp, "psm:pcf3", "unknown warp `psm:pcf3`"),
        ("psm+z4", Slot::Warp, "paged", "no slices and no faces"),
        ("psm:vsm", Slot::Warp, "paged", "`:vsm`: pages have no prefilters"),
        ("paged", Slot::Filter, "msm", "`:msm`: pages have no prefilters"),
        ("paged", Slot::Size, "64", "`@64`: pages share a budget of at least"),
        ("paged", Slot::Size, "1px", "`@1px`: pages share a budget"),
        ("psm", Slot::Faces, "z2", "`z2` does not belong there"),
    ] {
        let error = with_word(text, slot, Some(word)).unwrap_err().to_string();
        assert!(error.contains(expected), "{text} {word}: {error}");
    }
}

#[test]
fn options_change() {
    for (text, slot, option, value, expected) in [
        ("psm:vsm", Slot::Filter, "blur", Some("2px"), "psm:vsm(blur=2px)"),
        ("psm:vsm(blur=7,half)", Slot::Filter, "blur", Some("9"), "psm:vsm(blur=9,half)"),
        ("psm:vsm(blur=7,half)", Slot::Filter, "blur", None, "psm:vsm(half)"),
        ("psm:vsm(half)", Slot::Filter, "half", None, "psm:vsm"),
        ("psm:vsm", Slot::Filter, "half", None, "psm:vsm"),
        ("uniform", Slot::Warp, "stable", Some(""), "uniform(stable)"),
        ("paged", Slot::Warp, "error", Some("0.5"), "paged(error=0.5)"),
        ("paged(error=2):pcf3@2048", Slot::Warp, "error", None, "paged:pcf3@2048"),
        // What excludes the new option goes, and what it needs comes.
        (
            "psm+z4(fitted,overlap=0.1)",
            Slot::Slices,
            "practical",
            Some("0.5"),
            "psm+z4(overlap=0.1,practical=0.5)",
        ),
        ("psm:csm4(offset,scale,half)", Slot::Filter, "raw", Some(""), "psm:csm4(half,raw)"),
        ("psm:pcf3", Slot::Filter, "poisson", Some(""), "psm:pcf3(blur=2px,poisson)"),
        ("psm:pcf3(blur=1m)", Slot::Filter, "poisson", Some(""), "psm:pcf3(blur=1m,poisson)"),
        ("psm:pcf3(blur=1m,poisson)", Slot::Filter, "blur", None, "psm:pcf3"),
    ] {
        let result = with_option(text, slot, option, value);
        assert_eq!(result.as_deref(), Ok(expected), "{text} {option} {value:?}");
    }
    for (text, slot, option, value, expected) in [
        ("psm:vsm", Slot::Filter, "blurr", "7", "did you mean `vsm(blur=WIDTH)`?"),
        ("psm:vsm", Slot::Filter, "blur", "8", "odd number"),
        ("psm:vsm", Slot::Filter, "blur", "", "must be written `blur=WIDTH`"),
        ("psm", Slot::Slices, "fitted", "", "`psm` has no `+zK`"),
        ("uniform+face", Slot::Warp, "stable", "", "`+face`: stable maps do not turn"),
        ("uniform(stable)+z2", Slot::Slices, "fitted", "", "stable maps cannot be fitted"),
        ("psm+z1", Slot::Slices, "at", "5", "`+z2` or more"),
        ("paged", Slot::Warp, "error", "9", "0.25 to 8 pixels"),
        ("paged", Slot::Warp, "stable", "", "did you mean `paged(error=PIXELS)`?"),
    ] {
        let error = with_option(text, slot, option, Some(value)).unwrap_err().to_string();
        assert!(error.contains(expected), "{text} {option} {value}: {error}");
    }
}

/// Every word can be chosen from every other one of its slot, and every option begins with a valid
/// value and has valid values all along its scales.
#[test]
fn scales_hold_valid_values() {
    let ways = [0.0, 0.3, 1.0];
    for slot in Slot::ALL {
        for word in slot.words() {
            let text = with_word("uniform", slot, Some(word.example)).unwrap();
            for other in slot.words() {
                assert!(with_word(&text, slot, Some(other.example)).is_ok(), "{text} {other}");
            }
            let is_size = slot == Slot::Size;
            assert_eq!(word.scales.is_empty(), word.value.is_empty() && !is_size, "{word}");
            for scale in word.scales {
                for way in ways {
                    let value = scale.text(scale.min + way * (scale.max - scale.min));
                    assert!(scale.number(&value).is_some(), "{value}");
                    let written = match (word.name, word.value) {
                        ("WxH", _) => format!("{value}x{value}"),
                        _ if is_size => value,
                        (name, value_form) if value_form.starts_with('=') => {
                            format!("{name}={value}")
                        }
                        (name, _) => format!("{name}{value}"),
                    };
                    let changed = with_word(&text, slot, Some(&written));
                    assert!(changed.is_ok(), "{written}: {changed:?}");
                }
            }
            for option in word.options {
                let start = written(&text, slot).unwrap().example_of(option);
                let with = with_option(&text, slot, option.name, Some(&start)).unwrap();
                let shown = written(&with, slot).unwrap();
                assert_eq!(shown.value_of(option.name), Some(start.as_str()), "{with}");
                assert_eq!(option.scales.is_empty(), option.value.is_empty(), "{option}");
                // The example of a value has one of its units.
                let number = start.split('/').next().unwrap_or_default();
                let is_known = option.scales.iter().any(|s| s.number(number).is_some());
                assert!(is_known || option.scales.is_empty(), "{option} {number}");
                for scale in option.scales.iter().filter(|_| option.name != "at") {
                    for way in ways {
                        let value = scale.text(scale.min + way * (scale.max - scale.min));
                        let changed = with_option(&text, slot, option.name, Some(&value));
                        assert!(changed.is_ok(), "{option} {value}: {changed:?}");
                    }
                }
            }
        }
    }
}

proptest! {
    /// Writing what the controls show gives the same technique again.
    #[test]
    fn controls_and_text_are_in_step(technique in technique()) {
        prop_assume!(technique.check().is_ok());
        let text = technique.to_string();
        for slot in Slot::ALL {
            let Some(shown) = written(&text, slot) else { continue };
            let again = with_word(&text, slot, Some(shown.text)).unwrap();
            prop_assert_eq!(again.parse::<Technique>().unwrap(), technique, "{}", again);
            for (option, value) in shown.options {
                let again = with_option(&text, slot, option.name, Some(value)).unwrap();
                prop_assert_eq!(&again, &text);
            }
        }
    }

    /// Whatever is changed, the text stays one that a planner takes, and the change is in it.
    #[test]
    fn changes_make_techniques(technique in technique(), picks in any::<[usize; 4]>()) {
        prop_assume!(technique.check().is_ok());
        let text = technique.to_string();
        let slot = Slot::ALL[picks[0] % 5];
        let word = &slot.words()[picks[1] % slot.words().len()];
        let Ok(changed) = with_word(&text, slot, Some(word.example)) else { return Ok(()) };
        prop_assert!(is_planned(&changed), "{changed}");
        prop_assert_eq!(written(&changed, slot).unwrap().word, word);
        if word.options.is_empty() {
            return Ok(());
        }
        let option = &word.options[picks[2] % word.options.len()];
        let value = written(&changed, slot).unwrap().example_of(option);
        let Ok(on) = with_option(&changed, slot, option.name, Some(&value)) else { return Ok(()) };
        prop_assert!(is_planned(&on), "{on}");
        prop_assert_eq!(written(&on, slot).unwrap().value_of(option.name), Some(value.as_str()));
        let off = with_option(&on, slot, option.name, None).unwrap();
        prop_assert!(is_planned(&off), "{off}");
        prop_assert_eq!(written(&off, slot).unwrap().value_of(option.name), None);
    }

    /// Every completion is a technique, wherever the cursor is in a text that is half written.
    #[test]
    fn completions_are_techniques(technique in technique(), cut in 0usize..60, cursor in 0usize..60) {
        let mut text = technique.to_string();
        text.truncate(cut);
        for completion in complete(&text, cursor) {
            prop_assert!(is_planned(&completion.text), "{text} {cursor}: {}", completion.text);
            prop_assert!(completion.text.get(completion.selected).is_some());
            prop_assert!(!completion.meaning.is_empty());
        }
    }

    #[test]
    fn no_writing_panics(text in "\\PC*", parts in "[a-z0-9()=,.+:@x/-]{0,30}", cursor in 0usize..40) {
        for text in [text, parts] {
            complete(&text, cursor);
            for slot in Slot::ALL {
                let _ = (with_word(&text, slot, Some(&text)), written(&text, slot));
                let _ = with_option("psm:vsm+z2", slot, &text, Some(&text));
            }
        }
    }
}
