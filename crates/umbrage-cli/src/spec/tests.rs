use super::filter::{BlurredKind, FilterOption};
use super::*;
use proptest::prelude::*;

#[test]
fn every_part_is_understood() {
    let spec: Spec =
        "adaptive(area)+z2+face:csm16(blur=7,attenuation=1,offset)@640x480".parse().unwrap();
    assert_eq!(
        spec,
        Spec {
            warp: Warp::Adaptive(Objective::Area),
            z_partitions: Some(2),
            face: true,
            filter: Some(Filter::Csm(
                16,
                vec![FilterOption::Blur(7), FilterOption::Attenuation(1.0), FilterOption::Offset],
            )),
            size: Some(TexelSize::Exact([640, 480])),
        }
    );
    assert_eq!("tsm(focus=2.5)".parse::<Spec>().unwrap().warp, Warp::Tsm { focus: Some(2.5) });
    assert_eq!("lambda=11".parse::<Spec>().unwrap().warp, Warp::Lambda(11.0));
}

#[test]
fn defaults_are_one_hard_map_of_a_million_texels() {
    let technique: Technique = "uniform".parse().unwrap();
    assert_eq!(technique.options.size, Size::Budget(1024 * 1024));
    assert_eq!(technique.filter, visibility::Filter::Hard);
    let technique: Technique = "uniform:pcf5@64x32".parse().unwrap();
    assert_eq!(technique.options.size, Size::Exact([64, 32]));
    assert_eq!(technique.filter, visibility::Filter::Pcf { n: 5 });
}

#[test]
fn bad_specifications_say_what_would_be_right() {
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
        ("uniform(area)", "`uniform` takes no options"),
        ("tsm(fokus=3)", "did you mean `focus=METRES`?"),
        ("tsm(focus=0)", "positive"),
        ("tsm(focus=inf)", "finite"),
        ("tsm(focus=3", "`)`"),
        ("tsm)", "`(`"),
        ("uniform+", "unknown partition `+`"),
        ("uniform+faces", "did you mean `+face`?"),
        ("uniform+z", "did you mean `+zK`?"),
        ("uniform+z0", "from 1 to 16"),
        ("uniform+z17", "from 1 to 16"),
        ("uniform+z99999999999999", "from 1 to 16"),
        ("uniform+z2+z3", "given once"),
        ("uniform:", "unknown filter ``"),
        ("uniform:pfc3", "did you mean `pcfN`?"),
        ("uniform:pcf", "needs a number"),
        ("uniform:pcf0", "from 1 to 15"),
        ("uniform:pcf16", "from 1 to 15"),
        ("uniform:hard3", "takes no number"),
        ("uniform:hard(blur=3)", "takes no options"),
        ("uniform:csm17", "from 1 to 16"),
        ("uniform:csm8(blurr=7)", "did you mean `blur=N`?"),
        ("uniform:csm8(blur)", "must be written `blur=N`"),
        ("uniform:csm8(blur=7,blur=9)", "given once"),
        ("uniform:csm8(attenuation=-1)", "at least 0"),
        ("uniform:vsm(offset)", "unknown option `offset` of `vsm`"),
        ("uniform@0", "from 1 to 16384"),
        ("uniform@-1", "from 1 to 16384"),
        ("uniform@16385", "from 1 to 16384"),
        ("uniform@1e3", "from 1 to 16384"),
        ("uniform@", "from 1 to 16384"),
        ("uniform@64x", "from 1 to 16384"),
        ("uniform@64x64x64", "from 1 to 16384"),
        ("uniform@1024:pcf3", "comes last"),
        ("uniform@1024+z2", "comes last"),
    ] {
        let error = text.parse::<Spec>().unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?}: {error}");
        assert!(!error.contains('\n'), "{text:?}: {error}");
    }
}

#[test]
fn what_is_not_built_yet_says_so() {
    for text in [
        "lispsm+z4",
        "uniform+face",
        "uniform:vsm",
        "uniform:csm8",
        "uniform:pcss",
        "uniform:evsm(blur=5)",
    ] {
        let error = text.parse::<Technique>().unwrap_err().to_string();
        assert!(error.contains("not available in this version"), "{text}: {error}");
    }
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-300..1e300, 0.01..100.0, Just(f64::MIN_POSITIVE), Just(f64::MAX)]
}

fn warp() -> impl Strategy<Value = Warp> {
    prop_oneof![
        Just(Warp::Unfocused),
        Just(Warp::Uniform),
        Just(Warp::Psm),
        Just(Warp::Lispsm),
        Just(Warp::Log),
        Just(Warp::Adaptive(Objective::Storage)),
        Just(Warp::Adaptive(Objective::Area)),
        proptest::option::of(positive()).prop_map(|focus| Warp::Tsm { focus }),
        positive().prop_map(Warp::Lambda),
    ]
}

fn filter() -> impl Strategy<Value = Filter> {
    let blurred = |kind| {
        proptest::collection::vec((1u32..64).prop_map(FilterOption::Blur), 0..=1)
            .prop_map(move |o| Filter::Blurred(kind, o))
    };
    let csm_options = (
        proptest::option::of((1u32..64).prop_map(FilterOption::Blur)),
        proptest::option::of((0.0..1e3).prop_map(FilterOption::Attenuation)),
        proptest::option::of(Just(FilterOption::Offset)),
        proptest::option::of(Just(FilterOption::Scale)),
    );
    prop_oneof![
        Just(Filter::Hard),
        (1u32..=15).prop_map(Filter::Pcf),
        Just(Filter::Pcss),
        blurred(BlurredKind::Vsm),
        blurred(BlurredKind::Esm),
        blurred(BlurredKind::Evsm),
        blurred(BlurredKind::Msm),
        (1u32..=16, csm_options).prop_map(|(m, (blur, attenuation, offset, scale))| {
            Filter::Csm(m, [scale, blur, attenuation, offset].into_iter().flatten().collect())
        }),
    ]
}

fn size() -> impl Strategy<Value = TexelSize> {
    let side = 1..=MAX_SIDE;
    prop_oneof![
        side.clone().prop_map(TexelSize::Side),
        [side.clone(), side].prop_map(TexelSize::Exact),
    ]
}

prop_compose! {
    fn spec()(
        warp in warp(),
        z_partitions in proptest::option::of(1u32..=16),
        face in any::<bool>(),
        filter in proptest::option::of(filter()),
        size in proptest::option::of(size()),
    ) -> Spec {
        Spec { warp, z_partitions, face, filter, size }
    }
}

proptest! {
    #[test]
    fn printing_and_parsing_round_trip(spec in spec()) {
        let text = spec.to_string();
        let parsed: Spec = text.parse().map_err(|e| TestCaseError::fail(format!("{text}: {e}")))?;
        prop_assert_eq!(&parsed, &spec);
        prop_assert_eq!(parsed.to_string(), text);
    }

    #[test]
    fn no_text_panics(text in "\\PC*", parts in "[a-z0-9()=,.+:@x-]{0,30}") {
        for text in [text, parts] {
            if let Ok(spec) = text.parse::<Spec>() {
                prop_assert_eq!(spec.to_string().parse::<Spec>().unwrap(), spec);
            }
        }
    }
}
