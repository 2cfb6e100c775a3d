//! Random techniques of the language.

use proptest::prelude::*;
use umbrage::paged::{LEAST_BUDGET, LEAST_ERROR, MOST_ERROR};
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};
use umbrage::{Cover, Faces, Objective, Partition, Size, Splits, Technique, Warp};

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-300..1e300, 0.01..100.0, Just(f64::MIN_POSITIVE), Just(f64::MAX)]
}

fn spread() -> impl Strategy<Value = (Warp, Cover)> {
    let warps = prop_oneof![
        Just(Warp::Uniform),
        Just(Warp::Psm),
        Just(Warp::Lispsm),
        Just(Warp::Log),
        Just(Warp::Adaptive(Objective::Storage)),
        Just(Warp::Adaptive(Objective::Area)),
        proptest::option::of(positive()).prop_map(|focus| Warp::Tsm { focus }),
        positive().prop_map(Warp::Lambda),
    ];
    prop_oneof![
        4 => warps.prop_map(|warp| (warp, Cover::Seen)),
        1 => Just((Warp::Uniform, Cover::Scene)),
        1 => Just((Warp::Uniform, Cover::Stable)),
    ]
}

fn width() -> impl Strategy<Value = Width> {
    prop_oneof![(1e-3f32..1e6).prop_map(Width::Pixels), (1e-3f32..1e6).prop_map(Width::Metres),]
}

fn statistic() -> impl Strategy<Value = Statistic> {
    let leak = || prop_oneof![Just(0.0f32), 0.0f32..1.0];
    let csm = (1u32..=16, 0f32..10.0, any::<[bool; 3]>(), leak()).prop_map(
        |(order, attenuation, [offset, scale, wide], leak)| {
            let csm = Csm::new(order, attenuation, offset, scale).unwrap().with_leak(leak);
            Statistic::Csm(if wide { csm.in_16_bits() } else { csm })
        },
    );
    prop_oneof![
        leak().prop_map(|leak| Statistic::Vsm(Vsm { leak })),
        leak().prop_map(|leak| Statistic::Msm(Msm { leak })),
        (1e-3f32..80.0).prop_map(|exponent| Statistic::Esm(Esm { exponent })),
        (prop_oneof![Just(2u32), Just(4)], 1e-3f32..42.0, leak()).prop_map(
            |(components, exponent, leak)| Statistic::Evsm(Evsm { components, exponent, leak })
        ),
        csm,
    ]
}

fn filter() -> impl Strategy<Value = Filter> {
    let blur = prop_oneof![
        (0u32..32).prop_map(|n| Blur::Texels(2 * n + 1)),
        width().prop_map(Blur::Width)
    ];
    let pattern = prop_oneof![Just((15u32, Pattern::Grid)), Just((8, Pattern::Poisson))];
    let light = prop_oneof![
        Just(LightSize::default()),
        (0.001f32..90.0).prop_map(LightSize::Degrees),
        (0.001f32..1e6).prop_map(LightSize::Metres)
    ];
    prop_oneof![
        Just(Filter::None),
        Just(Filter::Hard),
        (1u32..=15).prop_map(|n| Filter::Pcf { n }),
        (1u32..=15, width(), pattern).prop_map(|(n, width, (most, pattern))| Filter::Spread {
            n: n.min(most),
            width,
            pattern
        }),
        (1u32..=8, light).prop_map(|(n, light)| Filter::Pcss { n, light }),
        (statistic(), blur, any::<bool>()).prop_map(|(statistic, blur, half)| {
            Filter::Prefiltered(Prefilter { statistic, blur, half })
        }),
    ]
}

fn partition() -> impl Strategy<Value = Partition> {
    let share = prop_oneof![0.0..=1.0f64, Just(0.0), Just(1.0), Just(1e-300)];
    let faces = prop_oneof![Just(Faces::Whole), Just(Faces::SidesAndNear), Just(Faces::Sides)];
    (1u32..=16, share.clone(), share, 0..4, faces, proptest::collection::vec(positive(), 15))
        .prop_map(|(slices, blend, overlap, splits, faces, mut distances)| {
            distances.sort_by(f64::total_cmp);
            distances.dedup();
            let used = slices as usize - 1;
            let splits = match splits {
                0 => Splits::Fitted,
                1 if (1..=distances.len()).contains(&used) => {
                    distances.truncate(used);
                    distances.resize(15, 0.0);
                    Splits::At(distances.try_into().unwrap())
                }
                2 => Splits::SelfSimilar,
                _ => Splits::Practical(blend),
            };
            Partition { slices, splits, overlap, faces }
        })
}

fn size() -> impl Strategy<Value = Size> {
    let side = 1..=65536u32;
    prop_oneof![
        side.clone().prop_map(|n| Size::Budget(u64::from(n).pow(2))),
        (1..=1u64 << 32).prop_map(Size::Budget),
        [side.clone(), side].prop_map(Size::Exact),
        positive().prop_map(Size::MaxError),
    ]
}

prop_compose! {
    fn of_maps()(
        (warp, cover) in spread(),
        partition in partition(),
        filter in filter(),
        size in size(),
    ) -> Technique {
        Technique { warp, cover, partition, filter, size }
    }
}

prop_compose! {
    fn of_pages()(
        error in prop_oneof![Just(1.0), LEAST_ERROR..=MOST_ERROR],
        filter in filter().prop_filter("pages have no prefilters", |f| f.prefilter().is_none()),
        size in prop_oneof![
            Just(Size::Needed),
            (512..=65536u64).prop_map(|side| Size::Budget(side * side)),
            (LEAST_BUDGET..=1 << 32).prop_map(Size::Budget),
        ],
    ) -> Technique {
        let cover = Cover::Paged { error };
        Technique { warp: Warp::Uniform, cover, filter, size, ..Technique::default() }
    }
}

pub(crate) fn technique() -> impl Strategy<Value = Technique> {
    prop_oneof![4 => of_maps(), 1 => of_pages()]
}
