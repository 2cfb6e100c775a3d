//! Techniques as Rust code, for reports whose readers copy it.

use super::{Faces, Partition, Size, Splits, Technique, Warp};
use crate::visibility::statistic::{Statistic, Storage};
use crate::visibility::{Blur, Filter, Prefilter};

// The derived `Debug` of a variant whose fields are numbers is its Rust code, without the type's
// name.
impl Technique {
    /// Rust code that constructs this technique: the necessary `use` lines and
    /// `let technique = …;`. Fields with default values are left out.
    pub fn rust_code(&self) -> String {
        let default = Self::default();
        let Self { warp, cover, partition, filter, size } = *self;
        let fields = [
            (warp != default.warp).then(|| format!("warp: {}", warp_code(warp))),
            (cover != default.cover).then(|| format!("cover: Cover::{cover:?}")),
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
        Warp::Adaptive(objective) => format!("Warp::Adaptive(Objective::{objective:?})"),
        Warp::Lambda(lambda) if lambda.is_infinite() => "Warp::Lambda(f64::INFINITY)".to_owned(),
        Warp::Uniform
        | Warp::Psm
        | Warp::Lispsm
        | Warp::Tsm { .. }
        | Warp::Log
        | Warp::Lambda(_) => format!("Warp::{warp:?}"),
    }
}

fn partition_code(partition: &Partition) -> String {
    let Partition { slices, splits, overlap, faces } = *partition;
    let told = [
        (splits != Splits::SelfSimilar).then(|| format!("splits: Splits::{splits:?}")),
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
        Size::Exact(_) | Size::MaxError(_) | Size::Needed => format!("Size::{size:?}"),
    }
}

fn filter_code(filter: &Filter) -> String {
    match filter {
        Filter::None | Filter::Hard | Filter::Pcf { .. } => format!("Filter::{filter:?}"),
        Filter::Spread { n, width, pattern } => format!(
            "Filter::Spread {{ n: {n}, width: Width::{width:?}, pattern: Pattern::{pattern:?} }}"
        ),
        Filter::Pcss { n, light } => {
            format!("Filter::Pcss {{ n: {n}, light: LightSize::{light:?} }}")
        }
        Filter::Prefiltered(Prefilter { statistic, blur, half }) => {
            let blur = match blur {
                Blur::Texels(_) => format!("Blur::{blur:?}"),
                Blur::Width(width) => format!("Blur::Width(Width::{width:?})"),
            };
            let statistic = statistic_code(statistic);
            format!(
                "Filter::Prefiltered(Prefilter {{ statistic: {statistic}, blur: {blur}, half: {half} }})"
            )
        }
    }
}

fn statistic_code(statistic: &Statistic) -> String {
    match statistic {
        Statistic::Vsm(_) | Statistic::Esm(_) | Statistic::Evsm(_) | Statistic::Msm(_) => {
            format!("Statistic::{statistic:?}")
        }
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
