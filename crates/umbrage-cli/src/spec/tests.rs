use super::filter::{BlurWidth, BlurredKind, FilterOption};
use super::partition::SliceOption;
use super::*;
use proptest::prelude::*;
use umbrage::{Partition, Splits};

#[test]
fn every_part_is_understood() {
    let spec: Spec =
        "adaptive(area)+z2(overlap=0.1,fitted)+face(sides):csm16(blur=7,attenuation=1,offset)@640x480".parse().unwrap();
    assert_eq!(
        spec,
        Spec {
            warp: Warp::Adaptive(Objective::Area),
            slices: Some(Slices {
                count: 2,
                options: vec![SliceOption::Overlap(0.1), SliceOption::Splits(Splits::Fitted)],
            }),
            faces: Faces::Sides,
            filter: Some(Filter::Csm(
                16,
                vec![
                    FilterOption::Blur(BlurWidth::Texels(7)),
                    FilterOption::Attenuation(1.0),
                    FilterOption::Offset
                ],
            )),
            size: Some(TexelSize::Exact([640, 480])),
        }
    );
    assert_eq!("tsm(focus=2.5)".parse::<Spec>().unwrap().warp, Warp::Tsm { focus: Some(2.5) });
    assert_eq!("lambda=11".parse::<Spec>().unwrap().warp, Warp::Lambda(11.0));
    assert_eq!("uniform(stable)".parse::<Spec>().unwrap().warp, Warp::Stable);
}

#[test]
fn partitions_reach_the_planner() {
    let partition = |text: &str| text.parse::<Technique>().unwrap().options.partition;
    assert_eq!(partition("uniform"), Partition::default());
    assert_eq!(partition("uniform+z4"), Partition::slices(4));
    assert_eq!(
        partition("uniform+face+z2"),
        Partition { faces: Faces::SidesAndNear, ..Partition::slices(2) }
    );
    assert_eq!(
        partition("uniform+z4(practical=0.5,overlap=0.25)+face(sides)"),
        Partition { slices: 4, splits: Splits::Practical(0.5), overlap: 0.25, faces: Faces::Sides }
    );
    assert_eq!(partition("uniform+z3(fitted)").splits, Splits::Fitted);
    let Splits::At(distances) = partition("uniform+z4(at=5/20/60.5)").splits else {
        panic!("told distances")
    };
    assert_eq!(distances[..3], [5.0, 20.0, 60.5]);
}

/// What the planner refuses names the part of the specification that is to blame.
#[test]
fn the_planners_complaints_name_the_part() {
    let camera = umbrage::Camera::look_at(umbrage::LookAt {
        eye: glam::DVec3::ZERO,
        target: glam::DVec3::NEG_Z,
        up: glam::DVec3::Y,
        fov_y_rad: 1.0,
        near: 1.0,
        far: 100.0,
        image: [640, 480],
    });
    let sun = umbrage::Light::Directional { direction: glam::DVec3::NEG_Y };
    let mut planner = umbrage::Planner::new();
    let mut complaint = |technique: &Technique| {
        let bounds = umbrage::Bounds::default();
        let plan = planner.plan(camera.as_ref().unwrap(), &[sun], &bounds, &technique.options);
        technique.error(&plan.unwrap_err()).to_string()
    };
    for (text, expected) in [
        (
            "uniform(stable)+face",
            "--shadows uniform(stable)+face: `+face`: stable maps do not turn",
        ),
        ("uniform(stable)+z2(fitted)", "`+z2(fitted)`: stable maps cannot be fitted"),
        ("uniform(stable)@1x1", "`@1x1`: a stable map needs at least 2 texels"),
        ("uniform+z16@3", "`@3`: a budget of 9 texels is too small for 16 maps"),
        ("uniform+z2(at=1e-13)", "`+z2(at=0.0000000000001)`: must be 1 ascending distances"),
    ] {
        let error = complaint(&text.parse().unwrap());
        assert!(error.contains(expected), "{text}: {error}");
    }
    let mut greedy: Technique = "uniform".parse().unwrap();
    greedy.limit_error(1e-9);
    let error = complaint(&greedy);
    assert!(error.contains("uniform: `--max-error 0.000000001`: so small an error"), "{error}");
}

#[test]
fn a_largest_error_yields_to_texels() {
    let with = |text: &str| {
        let mut technique: Technique = text.parse().unwrap();
        technique.limit_error(0.5);
        technique.options.size
    };
    assert_eq!(with("lispsm+z4"), Size::MaxError(0.5));
    assert_eq!(with("lispsm@512"), Size::Budget(512 * 512));
    assert_eq!(with("lispsm@64x32"), Size::Exact([64, 32]));
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
        ("psm(area)", "`psm` takes no options"),
        ("uniform(area)", "did you mean `uniform(stable)`?"),
        ("uniform(stabel)", "did you mean `uniform(stable)`?"),
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
        ("uniform+face+face(sides)", "given once"),
        ("uniform+face(near)", "did you mean `+face(sides)`?"),
        ("uniform+face()", "did you mean `+face(sides)`?"),
        ("uniform+face(sides", "`)`"),
        ("uniform+z4()", "unknown option `` of `+z4`"),
        ("uniform+z4(fited)", "did you mean `fitted`?"),
        ("uniform+z4(fitted=1)", "must be written `fitted`"),
        ("uniform+z4(practicle=1)", "did you mean `practical=BLEND`?"),
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
        ("uniform+z4(at=5,20,60)", "3 ascending"),
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
fn every_filter_that_is_built_can_be_executed() {
    for (text, expected) in [
        ("uniform:vsm", "vsm"),
        ("uniform:esm(blur=5,exponent=40)", "esm"),
        ("uniform:evsm(blur=1.5px)", "evsm"),
        ("uniform:evsm2(blur=0.2m,leak=0.1)", "evsm2"),
        ("uniform:msm(leak=0.2,half)", "msm"),
        ("uniform:pcss", "pcss"),
        ("uniform:pcss(light=2deg,samples=8)", "pcss"),
        ("uniform:pcss(light=0.2m)", "pcss"),
        ("uniform:pcf5(blur=2px,poisson)", "pcf5(blur=2px,poisson)"),
        ("uniform:csm8(blur=7,attenuation=1,offset,bits=16)", "csm8"),
        ("uniform:pcf5(blur=2px)", "pcf5(blur=2px)"),
    ] {
        let technique: Technique = text.parse().unwrap();
        assert_eq!(technique.filter.to_string(), expected);
        assert_eq!(technique.spec.to_string(), text);
    }
    for (text, expected) in [
        ("uniform:pcf5(blur=7)", "pcf is N texels wide unless told in px or m"),
        ("uniform:vsm(blur=0m)", "positive number"),
        ("uniform:vsm(blur=-1px)", "positive number"),
        ("uniform:csm4(blur=8)", "odd number of texels"),
    ] {
        let error = text.parse::<Technique>().unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-300..1e300, 0.01..100.0, Just(f64::MIN_POSITIVE), Just(f64::MAX)]
}

fn warp() -> impl Strategy<Value = Warp> {
    prop_oneof![
        Just(Warp::Unfocused),
        Just(Warp::Stable),
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
    let width = || {
        prop_oneof![
            (1e-3f32..1e6).prop_map(BlurWidth::Pixels),
            (1e-3f32..1e6).prop_map(BlurWidth::Metres),
        ]
        .prop_map(FilterOption::Blur)
    };
    let texels = (0u32..32).prop_map(|n| FilterOption::Blur(BlurWidth::Texels(2 * n + 1)));
    let blur = move || prop_oneof![texels.clone(), width()];
    let blurred = |kind| {
        let leak = (0.0..1.0).prop_map(FilterOption::Leak);
        let exponent = (1e-3..80.0).prop_map(FilterOption::Exponent);
        let own = match kind {
            BlurredKind::Esm => exponent.boxed(),
            _ => leak.boxed(),
        };
        let options = (proptest::option::of(blur()), proptest::option::of(own));
        options.prop_map(move |(blur, own)| {
            Filter::Blurred(kind, [own, blur].into_iter().flatten().collect())
        })
    };
    let csm_options = (
        proptest::option::of(blur()),
        proptest::option::of((0.0..1e3).prop_map(FilterOption::Attenuation)),
        proptest::option::of(Just(FilterOption::Offset)),
        proptest::option::of(Just(FilterOption::Scale)),
        proptest::option::of(Just(FilterOption::Bits(16))),
        proptest::option::of(Just(FilterOption::Half)),
    );
    prop_oneof![
        Just(Filter::Hard),
        (1u32..=15, proptest::option::of(width()), any::<bool>()).prop_map(
            |(n, width, poisson)| {
                let poisson = poisson.then_some(FilterOption::Poisson);
                Filter::Pcf(n, poisson.into_iter().chain(width).collect())
            }
        ),
        (proptest::option::of(light_size()), proptest::option::of(1u32..=8)).prop_map(
            |(light, samples)| {
                let light = light.map(FilterOption::Light);
                let samples = samples.map(FilterOption::Samples);
                Filter::Pcss([samples, light].into_iter().flatten().collect())
            }
        ),
        blurred(BlurredKind::Vsm),
        blurred(BlurredKind::Esm),
        blurred(BlurredKind::Evsm),
        blurred(BlurredKind::Evsm2),
        blurred(BlurredKind::Msm),
        (1u32..=16, csm_options).prop_map(|(m, (blur, attenuation, offset, scale, bits, half))| {
            let options = [scale, blur, half, attenuation, bits, offset];
            Filter::Csm(m, options.into_iter().flatten().collect())
        }),
    ]
}

fn light_size() -> impl Strategy<Value = LightSize> {
    prop_oneof![
        (0.001f32..90.0).prop_map(LightSize::Degrees),
        (0.001f32..1e6).prop_map(LightSize::Metres)
    ]
}

fn slices() -> impl Strategy<Value = Slices> {
    let share = prop_oneof![0.0..=1.0f64, Just(0.0), Just(1.0), Just(1e-300)];
    (
        1u32..=16,
        share.clone(),
        share,
        0..3,
        any::<bool>(),
        proptest::collection::vec(positive(), 15),
    )
        .prop_map(|(count, blend, overlap, splits, first, mut distances)| {
            distances.sort_by(f64::total_cmp);
            distances.dedup();
            let used = count as usize - 1;
            let splits = match splits {
                0 => Splits::Fitted,
                1 if (1..=distances.len()).contains(&used) => {
                    distances.truncate(used);
                    distances.resize(15, 0.0);
                    Splits::At(distances.try_into().unwrap())
                }
                _ => Splits::Practical(blend),
            };
            let mut options = vec![SliceOption::Splits(splits), SliceOption::Overlap(overlap)];
            if first {
                options.reverse();
            }
            options.truncate((blend * 4.0) as usize);
            Slices { count, options }
        })
}

fn faces() -> impl Strategy<Value = Faces> {
    prop_oneof![Just(Faces::Whole), Just(Faces::SidesAndNear), Just(Faces::Sides)]
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
        slices in proptest::option::of(slices()),
        faces in faces(),
        filter in proptest::option::of(filter()),
        size in proptest::option::of(size()),
    ) -> Spec {
        Spec { warp, slices, faces, filter, size }
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
    fn no_text_panics(text in "\\PC*", parts in "[a-z0-9()=,.+:@x/-]{0,30}") {
        for text in [text, parts] {
            if let Ok(spec) = text.parse::<Spec>() {
                prop_assert_eq!(spec.to_string().parse::<Spec>().unwrap(), spec);
            }
        }
    }
}
