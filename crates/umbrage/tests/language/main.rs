//! The language of techniques: which texts parse, how techniques print, and the errors of invalid
//! texts.

mod random;
mod writing;

use proptest::prelude::*;
use random::technique;
use umbrage::language::{self, FILTERS, PARTITIONS, SIZES, WARPS, Word};
use umbrage::visibility::statistic::{Csm, Evsm, Statistic};
use umbrage::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};
use umbrage::{Cover, Faces, Objective, Partition, Size, Splits, Technique, Warp};

fn parsed(text: &str) -> Technique {
    text.parse().unwrap_or_else(|e| panic!("{text}: {e}"))
}

#[test]
fn every_part_is_understood() {
    let text = "adaptive(area)+z2(overlap=0.1,fitted)+face(sides)\
                :csm16(blur=7,attenuation=1,offset)@640x480";
    let csm = Csm::new(16, 1.0, true, false).unwrap().with_leak(0.05);
    assert_eq!(
        parsed(text),
        Technique {
            warp: Warp::Adaptive(Objective::Area),
            cover: Cover::Seen,
            partition: Partition {
                slices: 2,
                splits: Splits::Fitted,
                overlap: 0.1,
                faces: Faces::Sides,
            },
            filter: Filter::Prefiltered(Prefilter {
                statistic: Statistic::Csm(csm),
                blur: Blur::Texels(7),
                half: false,
            }),
            size: Size::Exact([640, 480]),
        }
    );
    assert_eq!(parsed("tsm(focus=2.5)").warp, Warp::Tsm { focus: Some(2.5) });
    assert_eq!(parsed("tsm(focus=1e+3)+z2").warp, Warp::Tsm { focus: Some(1000.0) });
    assert_eq!(parsed("lambda=11").warp, Warp::Lambda(11.0));
    let [stable, unfocused] = ["uniform(stable)", "unfocused"].map(parsed);
    assert_eq!((stable.warp, stable.cover), (Warp::Uniform, Cover::Stable));
    assert_eq!((unfocused.warp, unfocused.cover), (Warp::Uniform, Cover::Scene));
    let Splits::At(distances) = parsed("uniform+z4(at=5/20/60.5)").partition.splits else {
        panic!("told distances")
    };
    assert_eq!(distances[..3], [5.0, 20.0, 60.5]);
    assert_eq!(parsed("adaptive@1.5px").size, Size::MaxError(1.5));
    assert_eq!(parsed("adaptive@3000000texels").size, Size::Budget(3_000_000));
}

#[test]
fn defaults_are_one_adaptive_hard_map_of_a_million_texels() {
    assert_eq!(parsed("adaptive"), Technique::default());
    assert_eq!(Technique::default().to_string(), "adaptive");
    assert_eq!(parsed("adaptive:hard@1024").to_string(), "adaptive");
    assert_eq!(parsed("uniform").size, Size::Budget(1024 * 1024));
    assert_eq!(parsed("uniform:vsm").filter.to_string(), "vsm");
    let Filter::Pcss { n: 6, light: LightSize::Degrees(0.53) } = parsed("uniform:pcss").filter
    else {
        panic!("our sun")
    };
    // By default a leak threshold hides the series' ringing.
    for (text, leak) in [("csm4", 0.1), ("csm4(offset)", 0.05), ("csm4(leak=0)", 0.0)] {
        let Filter::Prefiltered(Prefilter { statistic: Statistic::Csm(csm), .. }) =
            text.parse().unwrap()
        else {
            panic!("{text}")
        };
        assert_eq!(csm.leak(), leak, "{text}");
    }
}

/// `none` is a filter of any technique, and a technique by itself.
#[test]
fn none_needs_no_warp() {
    let none = Technique { filter: Filter::None, ..Technique::default() };
    assert_eq!((parsed("none"), none.to_string()), (none, "none".to_owned()));
    assert_eq!((parsed("adaptive:none"), parsed("adaptive:none@1024")), (none, none));
    let sliced = parsed("lispsm+z4:none@2048");
    assert_eq!((sliced.filter, sliced.partition.slices), (Filter::None, 4));
    assert_eq!(sliced.to_string(), "lispsm+z4:none@2048");
    let explained = language::explain("none");
    assert_eq!(explained.len(), 1, "{explained:?}");
    assert_eq!(explained[0].0, "none");
}

/// Every word of the tables, with each of its options, parses, prints as it was written, is
/// explained and is part of the help.
#[test]
fn the_tables_are_what_is_parsed_and_printed() {
    let help = language::help();
    let around: [(&[Word], &str, &str); 4] = [
        (WARPS, "", ""),
        (PARTITIONS, "uniform+", ""),
        (FILTERS, "uniform:", ""),
        (SIZES, "uniform@", ""),
    ];
    for (words, before, after) in around {
        for word in words {
            assert!(help.contains(&word.to_string()), "{word}");
            let of_word = [word.example.to_owned()];
            let with_options =
                word.options.iter().map(|o| format!("{}({})", word.example, o.example));
            for example in of_word.into_iter().chain(with_options) {
                let text = format!("{before}{example}{after}");
                let technique = parsed(&text);
                let printed = technique.to_string();
                assert_eq!(parsed(&printed), technique, "{text}: {printed}");
                // Default values are not printed.
                let is_default = ["uniform:hard", "uniform:csm4(scale)"].contains(&text.as_str());
                assert!(printed == text || is_default, "{text}: {printed}");
                let explained = language::explain(&text);
                assert!(explained.iter().any(|(_, e)| *e == word.meaning), "{text}: {explained:?}");
            }
            for option in word.options {
                assert!(help.contains(&format!("({option})")), "{word} {option}");
                let text = format!("{before}{}({})", word.example, option.example);
                let explained = language::explain(&text);
                assert!(explained.iter().any(|(_, e)| *e == option.meaning), "{text}");
            }
        }
    }
    assert!(help.lines().all(|l| l.chars().count() <= 80), "{help}");
    assert!(language::explain("no technique").is_empty());
}

#[test]
fn bad_techniques_say_what_would_be_right() {
    for (text, expected) in [
        ("", "the warp is missing"),
        ("@512", "the warp is missing"),
        ("lipsm", "did you mean `lispsm`?"),
        ("Uniform", "did you mean `uniform`?"),
        ("adaptiv", "did you mean `adaptive`?"),
        ("lamda=3", "did you mean `lambda=NUMBER`?"),
        ("lambda", "did you mean `lambda=NUMBER`?"),
        ("lambda=", "as in `lambda=12.5`"),
        ("lambda=-1", "positive"),
        ("lambda=NaN", "positive"),
        ("adaptive(volume)", "did you mean `adaptive(area)`?"),
        ("psm(area)", "`psm` takes no options"),
        ("uniform(area)", "did you mean `uniform(stable)`?"),
        ("uniform(stabel)", "did you mean `uniform(stable)`?"),
        ("tsm(fokus=3)", "did you mean `tsm(focus=METRES)`?"),
        ("tsm(focus=0)", "positive"),
        ("tsm(focus=inf)", "finite"),
        ("tsm(focus=3", "`)`"),
        ("tsm)", "`(`"),
        ("page", "did you mean `paged`?"),
        ("paged(eror=1)", "did you mean `paged(error=PIXELS)`?"),
        ("paged(error)", "must be written `error=PIXELS`"),
        ("paged(error=0.2)", "0.25 to 8 pixels"),
        ("paged(error=9)", "0.25 to 8 pixels"),
        ("paged(error=NaN)", "0.25 to 8 pixels"),
        ("uniform+", "unknown partition `+`"),
        ("uniform+faces", "did you mean `+face`?"),
        ("uniform+z", "did you mean `+zK`?"),
        ("uniform+z0", "from 1 to 16"),
        ("uniform+z17", "from 1 to 16"),
        ("uniform+z99999999999999", "from 1 to 16"),
        ("uniform+z2+z3", "given once"),
        ("uniform+face+face(sides)", "given once"),
        ("uniform+face(near)", "did you mean `+face(sides)`?"),
        ("uniform+face()", "did you mean `+face(sides)`?"),
        ("uniform+face(sides", "`)`"),
        ("uniform+z4()", "unknown option `` of `+z4`"),
        ("uniform+z4(fited)", "did you mean `+z4(fitted)`?"),
        ("uniform+z4(fitted=1)", "must be written `fitted`"),
        ("uniform+z4(practicle=1)", "did you mean `+z4(practical=BLEND)`?"),
        ("uniform+z4(practical)", "must be written `practical=BLEND`"),
        ("uniform+z4(practical=2)", "from 0 to 1"),
        ("uniform+z4(practical=x)", "from 0 to 1"),
        ("uniform+z4(overlap=-0.1)", "from 0 to 1"),
        ("uniform+z4(overlap=NaN)", "from 0 to 1"),
        ("uniform+z4(overlap=0,overlap=1)", "given once"),
        ("uniform+z4(fitted,practical=1)", "can be said once"),
        ("uniform+z4(at=5/20)", "3 ascending numbers of metres"),
        ("uniform+z4(at=5/20/60/90)", "as in `at=5/10/15`"),
        ("uniform+z4(at=5/60/20)", "ascending"),
        ("uniform+z4(at=5/5/20)", "ascending"),
        ("uniform+z4(at=0/5/20)", "ascending"),
        ("uniform+z4(at=5//20)", "ascending"),
        ("uniform+z4(at=5/20/inf)", "ascending"),
        ("uniform+z2(at=NaN)", "1 ascending number of metres"),
        ("uniform+z2(at)", "must be written `at=METRES/METRES`"),
        ("uniform+z4(at=5,20,60)", "unknown option `20` of `+z4`"),
        ("uniform+z1(at=5)", "`+z2` or more"),
        ("uniform+z4(stable)", "unknown option `stable` of `+z4`"),
        ("uniform:", "unknown filter ``"),
        ("uniform:pfc3", "did you mean `pcfN`?"),
        ("uniform:pcf", "needs a number"),
        ("uniform:pcf0", "from 1 to 15"),
        ("uniform:pcf16", "from 1 to 15"),
        ("uniform:hard3", "takes no number"),
        ("uniform:hard(blur=3)", "takes no options"),
        ("uniform:csm17", "from 1 to 16"),
        ("uniform:csm8(blurr=7)", "did you mean `csm8(blur=WIDTH)`?"),
        ("uniform:csm8(blur)", "must be written `blur=WIDTH`"),
        ("uniform:csm8(blur=7,blur=9)", "given once"),
        ("uniform:csm8(attenuation=-1)", "at least 0"),
        ("uniform:vsm(offset)", "unknown option `offset` of `vsm`"),
        ("uniform@0", "from 1 to 65536"),
        ("uniform@-1", "from 1 to 65536"),
        ("uniform@65537", "from 1 to 65536"),
        ("uniform@1e3", "from 1 to 65536"),
        ("uniform@", "from 1 to 65536"),
        ("uniform@64x", "from 1 to 65536"),
        ("uniform@64x64x64", "from 1 to 65536"),
        ("uniform@1024:pcf3", "comes last"),
        ("uniform@1024+z2", "comes last"),
        ("none@2048", "did you mean `none`?"),
        ("none+z4", "`none` has no maps"),
        ("none:pcf3", "`none` has no maps"),
        ("nonne", "did you mean"),
        ("uniform:non", "did you mean `none`?"),
    ] {
        let error = text.parse::<Technique>().unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?}: {error}");
        assert!(!error.contains('\n'), "{text:?}: {error}");
    }
}

/// A filter in the place of the warp, and cascades under other common names.
#[test]
fn words_in_the_wrong_place_are_understood() {
    for (text, meant) in [
        ("pcf3", "adaptive:pcf3"),
        ("pcf", "adaptive:pcf3"),
        ("csm4", "adaptive:csm4"),
        ("csm8(blur=7)", "adaptive:csm8(blur=7)"),
        ("pcss(light=2deg)@2048", "adaptive:pcss(light=2deg)"),
        ("vsm(blur=7)+z4", "adaptive:vsm(blur=7)"),
        ("hard", "adaptive:hard"),
        ("csm", "uniform+z4"),
        ("CSM", "uniform+z4"),
        ("cascades4", "uniform+z4"),
        ("cascades3:pcf3", "uniform+z3"),
        ("cascaded", "uniform+z4"),
    ] {
        let error = text.parse::<Technique>().unwrap_err();
        assert_eq!(error.suggestion.as_deref(), Some(meant), "{text}: {error}");
        parsed(meant);
    }
    let of = |text: &str| text.parse::<Technique>().unwrap_err().to_string();
    assert!(of("csm4").contains("cascades are written `uniform+z4`"), "{}", of("csm4"));
    assert!(of("uniform:csm").contains("`uniform+z4`"), "{}", of("uniform:csm"));
}

/// An error of the planner names the part of the text that causes it.
#[test]
fn complaints_are_about_a_part_of_the_text() {
    let technique = parsed("tsm(focus=3)+z4(fitted)+face:pcf3@64x32");
    for (field, part) in [
        ("technique.warp.focus", "tsm(focus=3)"),
        ("technique.cover", "tsm(focus=3)"),
        ("technique.partition.slices", "+z4(fitted)"),
        ("technique.partition.faces", "+face"),
        ("filter.n", ":pcf3"),
        ("technique.filter.light", ":pcf3"),
        ("technique.size", "@64x32"),
    ] {
        assert_eq!(technique.part(field).as_deref(), Some(part), "{field}");
    }
    let paged = parsed("paged(error=0.5)");
    assert_eq!(paged.part("technique.cover").as_deref(), Some("paged(error=0.5)"));
    for field in ["camera.near", "limits.max_side", "", "bounds.receivers"] {
        assert_eq!(technique.part(field), None, "{field}");
    }
}

/// The code that reports show is valid: each of these expressions compiles, equals what the text
/// parses to, and is what `rust_code` writes.
#[test]
fn rust_code_makes_the_technique() -> Result<(), umbrage::Error> {
    let squeezed = |code: &str| code.split_whitespace().collect::<String>();
    macro_rules! check {
        ($text:literal, $($code:tt)*) => {
            let technique = $($code)*;
            assert_eq!(parsed($text), technique, $text);
            let code = parsed($text).rust_code();
            let value = code.split_once("let technique = ").unwrap().1.trim_end();
            // Trailing commas depend on the layout only.
            let plain = |code: &str| squeezed(code).replace(",}", "}").replace(",)", ")");
            assert_eq!(plain(value), plain(concat!(stringify!($($code)*), ";")), "{code}");
            let uses = code.lines().filter(|l| l.starts_with("use umbrage")).count();
            assert!(uses > 0 && code.is_ascii(), "{code}");
        };
    }
    check!("adaptive", Technique::default());
    check!("none", Technique { filter: Filter::None, ..Technique::default() });
    check!(
        "adaptive+z4:pcf3@2048",
        Technique {
            partition: Partition::slices(4),
            filter: Filter::Pcf { n: 3 },
            size: Size::Budget(2048 * 2048),
            ..Technique::default()
        }
    );
    check!(
        "uniform(stable)+z4(practical=0.5,overlap=0.1)",
        Technique {
            warp: Warp::Uniform,
            cover: Cover::Stable,
            partition: Partition {
                splits: Splits::Practical(0.5),
                overlap: 0.1,
                ..Partition::slices(4)
            },
            ..Technique::default()
        }
    );
    check!(
        "unfocused:pcss(light=0.2m,samples=4)@800x600",
        Technique {
            warp: Warp::Uniform,
            cover: Cover::Scene,
            filter: Filter::Pcss { n: 4, light: LightSize::Metres(0.2) },
            size: Size::Exact([800, 600]),
            ..Technique::default()
        }
    );
    check!(
        "tsm(focus=2.5)+z2(fitted)+face(sides):pcf5(blur=2px,poisson)",
        Technique {
            warp: Warp::Tsm { focus: Some(2.5) },
            partition: Partition {
                splits: Splits::Fitted,
                faces: Faces::Sides,
                ..Partition::slices(2)
            },
            filter: Filter::Spread { n: 5, width: Width::Pixels(2.0), pattern: Pattern::Poisson },
            ..Technique::default()
        }
    );
    check!(
        "lambda=inf:evsm2(blur=0.3m,leak=0.2,half)@1.5px",
        Technique {
            warp: Warp::Lambda(f64::INFINITY),
            filter: Filter::Prefiltered(Prefilter {
                statistic: Statistic::Evsm(Evsm { components: 2, exponent: 42.0, leak: 0.2 }),
                blur: Blur::Width(Width::Metres(0.3)),
                half: true
            }),
            size: Size::MaxError(1.5),
            ..Technique::default()
        }
    );
    check!(
        "adaptive(area):csm8(offset,leak=0.15,bits=16)@3000000texels",
        Technique {
            warp: Warp::Adaptive(Objective::Area),
            filter: Filter::Prefiltered(Prefilter {
                statistic: Statistic::Csm(
                    Csm::new(8, 0.0, true, false)?.with_leak(0.15).in_16_bits()
                ),
                blur: Blur::Texels(1),
                half: false
            }),
            size: Size::Budget(3000000),
            ..Technique::default()
        }
    );
    check!(
        "paged",
        Technique {
            warp: Warp::Uniform,
            cover: Cover::Paged { error: 1.0 },
            size: Size::Needed,
            ..Technique::default()
        }
    );
    check!(
        "paged(error=0.25):pcf3@2048",
        Technique {
            warp: Warp::Uniform,
            cover: Cover::Paged { error: 0.25 },
            filter: Filter::Pcf { n: 3 },
            size: Size::Budget(2048 * 2048),
            ..Technique::default()
        }
    );
    Ok(())
}

/// Pages are as many as the view needs, unless a text limits them.
#[test]
fn pages_need_no_size() {
    let paged = parsed("paged");
    assert_eq!((paged.warp, paged.cover), (Warp::Uniform, Cover::Paged { error: 1.0 }));
    assert_eq!((paged.size, paged.to_string()), (Size::Needed, "paged".to_owned()));
    assert_eq!(parsed("paged@1024").size, Size::Budget(1024 * 1024));
    assert_eq!(parsed("paged@1024").to_string(), "paged@1024");
    assert_eq!(parsed("paged(error=1)"), paged);
    let told = language::explain("paged(error=0.5):pcf3@2048");
    assert_eq!(
        told.iter().map(|(word, _)| word.as_str()).collect::<Vec<_>>(),
        ["paged", "error=0.5", "pcf3", "@2048"]
    );
}

proptest! {
    #[test]
    fn printing_and_parsing_round_trip(technique in technique()) {
        let text = technique.to_string();
        let parsed: Technique =
            text.parse().map_err(|e| TestCaseError::fail(format!("{text}: {e}")))?;
        prop_assert_eq!(&parsed, &technique);
        prop_assert_eq!(parsed.to_string(), text);
        prop_assert!(technique.rust_code().contains("let technique = Technique"));
    }

    #[test]
    fn no_text_panics(text in "\\PC*", parts in "[a-z0-9()=,.+:@x/-]{0,30}") {
        for text in [text, parts] {
            if let Ok(technique) = text.parse::<Technique>() {
                prop_assert_eq!(technique.to_string().parse::<Technique>().unwrap(), technique);
            }
            language::explain(&text);
        }
    }
}
