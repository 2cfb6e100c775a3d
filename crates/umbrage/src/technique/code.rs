//! Techniques as Rust code, for reports whose readers copy it.

use super::{Cover, Faces, Objective, Partition, Size, Splits, Technique, Warp};
use crate::visibility::statistic::{Statistic, Storage};
use crate::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};

impl Technique {
    /// Rust code that constructs this technique: the necessary `use` lines and
    /// `let technique = …;`. Fields with default values are left out.
    pub fn rust_code(&self) -> String {
        let default = Self::default();
        let Self { warp, cover, partition, filter, size } = *self;
        let fields = [
            (warp != default.warp).then(|| format!("warp: {}", warp_code(warp))),
            (cover != default.cover).then(|| format!("cover: {}", cover_code(cover))),
            (partition != default.partition)
                .then(|| format!("partition: {}", partition_code(&partition))),
            (filter != default.filter).then(|| format!("filter: {}", filter_code(&filter))),
            (size != default.size).then(|| format!("size: {}", size_code(size))),
        ];
        let told: Vec<String> = fields.into_iter().flatten().collect();
        let value = match told.len() {
            0 => "Technique::default()".to_owned(),
            n => {
                let rest = if n < 5 { "    ..Technique::default()\n" } else { "" };
                let lines: String = told.iter().map(|field| format!("    {field},\n")).collect();
                format!("Technique {{\n{lines}{rest}}}")
            }
        };
        let names = |module: &str, names: &[&str]| {
            let is_used = |name: &&&str| {
                let uses = [format!("{name}::"), format!("{name} {{")];
                uses.iter().any(|u| {
                    value.match_indices(u.as_str()).any(|(i, _)| {
                        !value[..i].ends_with(|c: char| c.is_alphanumeric() || c == ':')
                    })
                })
            };
            let used: Vec<&str> = names.iter().filter(is_used).copied().collect();
            match used[..] {
                [] => String::new(),
                [one] => format!("use {module}::{one};\n"),
                _ => format!("use {module}::{{{}}};\n", used.join(", ")),
            }
        };
        let planned =
            ["Cover", "Faces", "Objective", "Partition", "Size", "Splits", "Technique", "Warp"];
        let looked_up = ["Blur", "Filter", "LightSize", "Pattern", "Prefilter", "Width"];
        let stored = ["Csm", "Esm", "Evsm", "Msm", "Statistic", "Vsm"];
        names("umbrage", &planned)
            + &names("umbrage::visibility", &looked_up)
            + &names("umbrage::visibility::statistic", &stored)
            + &format!("\nlet technique = {value};\n")
    }
}

fn warp_code(warp: Warp) -> String {
    match warp {
        Warp::Uniform | Warp::Psm | Warp::Lispsm | Warp::Log => format!("Warp::{warp:?}"),
        Warp::Tsm { focus } => format!("Warp::Tsm {{ focus: {focus:?} }}"),
        Warp::Adaptive(Objective::Storage) => "Warp::Adaptive(Objective::Storage)".to_owned(),
        Warp::Adaptive(Objective::Area) => "Warp::Adaptive(Objective::Area)".to_owned(),
        Warp::Lambda(lambda) if lambda.is_infinite() => "Warp::Lambda(f64::INFINITY)".to_owned(),
        Warp::Lambda(lambda) => format!("Warp::Lambda({lambda:?})"),
    }
}

fn cover_code(cover: Cover) -> &'static str {
    match cover {
        Cover::Seen => "Cover::Seen",
        Cover::Scene => "Cover::Scene",
        Cover::Stable => "Cover::Stable",
    }
}

fn partition_code(partition: &Partition) -> String {
    let Partition { slices, splits, overlap, faces } = *partition;
    let splits = match splits {
        Splits::SelfSimilar => None,
        Splits::Practical(blend) => Some(format!("Splits::Practical({blend:?})")),
        Splits::At(distances) => Some(format!("Splits::At({distances:?})")),
        Splits::Fitted => Some("Splits::Fitted".to_owned()),
    };
    let told = [
        splits.map(|splits| format!("splits: {splits}")),
        (overlap != 0.0).then(|| format!("overlap: {overlap:?}")),
        (faces != Faces::Whole).then(|| format!("faces: Faces::{faces:?}")),
    ];
    let told: Vec<String> = told.into_iter().flatten().collect();
    let base = format!("Partition::slices({slices})");
    if told.is_empty() { base } else { format!("Partition {{ {}, ..{base} }}", told.join(", ")) }
}

fn size_code(size: Size) -> String {
    match size {
        Size::Budget(texels) => match texels.isqrt() {
            side if side * side == texels => format!("Size::Budget({side} * {side})"),
            _ => format!("Size::Budget({texels})"),
        },
        Size::Exact(size) => format!("Size::Exact({size:?})"),
        Size::MaxError(pixels) => format!("Size::MaxError({pixels:?})"),
    }
}

fn filter_code(filter: &Filter) -> String {
    match filter {
        Filter::Hard => "Filter::Hard".to_owned(),
        Filter::Pcf { n } => format!("Filter::Pcf {{ n: {n} }}"),
        Filter::Spread { n, width, pattern } => {
            let pattern = match pattern {
                Pattern::Grid => "Pattern::Grid",
                Pattern::Poisson => "Pattern::Poisson",
            };
            let width = width_code(*width);
            format!("Filter::Spread {{ n: {n}, width: {width}, pattern: {pattern} }}")
        }
        Filter::Pcss { n, light } => {
            let light = match light {
                LightSize::Degrees(size) => format!("LightSize::Degrees({size:?})"),
                LightSize::Metres(size) => format!("LightSize::Metres({size:?})"),
            };
            format!("Filter::Pcss {{ n: {n}, light: {light} }}")
        }
        Filter::Prefiltered(Prefilter { statistic, blur, half }) => {
            let blur = match blur {
                Blur::Texels(n) => format!("Blur::Texels({n})"),
                Blur::Width(width) => format!("Blur::Width({})", width_code(*width)),
            };
            let statistic = statistic_code(statistic);
            format!(
                "Filter::Prefiltered(Prefilter {{ statistic: {statistic}, blur: {blur}, half: {half} }})"
            )
        }
    }
}

fn width_code(width: Width) -> String {
    match width {
        Width::Pixels(width) => format!("Width::Pixels({width:?})"),
        Width::Metres(width) => format!("Width::Metres({width:?})"),
    }
}

fn statistic_code(statistic: &Statistic) -> String {
    match statistic {
        Statistic::Vsm(s) => format!("Statistic::Vsm({s:?})"),
        Statistic::Esm(s) => format!("Statistic::Esm({s:?})"),
        Statistic::Evsm(s) => format!("Statistic::Evsm({s:?})"),
        Statistic::Msm(s) => format!("Statistic::Msm({s:?})"),
        Statistic::Csm(s) => {
            let [offset, scale] = s.brightening();
            let bits = if statistic.storage() == Storage::Snorm16 { ".in_16_bits()" } else { "" };
            format!(
                "Statistic::Csm(Csm::new({}, {:?}, {offset}, {scale})?.with_leak({:?}){bits})",
                s.order(),
                s.attenuation(),
                s.leak()
            )
        }
    }
}
