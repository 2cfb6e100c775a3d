//! The partitions of a specification: `+z4(practical=0.5,overlap=0.1)`, `+face(sides)`.

use super::{is_number, nearest, parse_count, split_once, split_options};
use anyhow::{Error, Result, anyhow, bail, ensure};
use std::fmt::{self, Display};
use std::str::FromStr;
use umbrage::{Faces, Partition, Splits};

/// A part behind a `+`.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Part {
    Slices(Slices),
    Faces(Faces),
}

/// Slices along the view.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slices {
    /// 1 ..= [`Partition::MAX_SLICES`].
    pub(crate) count: u32,
    /// In the order in which they were written, each kind at most once.
    pub(crate) options: Vec<SliceOption>,
}

/// An option in the parentheses behind `+zK`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SliceOption {
    /// `fitted`, `practical=BLEND`, `at=METRES/METRES`; self-similar has no word.
    Splits(Splits),
    /// `overlap=SHARE` of its own length that each slice reaches into the next.
    Overlap(f64),
}

/// How the options of `+zK` are written.
const SLICE_OPTIONS: [&str; 4] = ["fitted", "practical=BLEND", "at=METRES/METRES", "overlap=SHARE"];

/// For the planner.
pub(super) fn partition(slices: Option<&Slices>, faces: Faces) -> Partition {
    let mut partition = Partition { faces, ..Partition::default() };
    let Some(slices) = slices else { return partition };
    partition.slices = slices.count;
    for option in &slices.options {
        match *option {
            SliceOption::Splits(splits) => partition.splits = splits,
            SliceOption::Overlap(share) => partition.overlap = share,
        }
    }
    partition
}

impl FromStr for Part {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, options) = split_options(text)?;
        if let Some(count) = name.strip_prefix('z').filter(|k| is_number(k)) {
            let count = parse_count(count, "+z", 1..=Partition::MAX_SLICES as u32)?;
            return Slices::parse(count, options).map(Self::Slices);
        }
        match (name, options) {
            ("face", None) => Ok(Self::Faces(Faces::SidesAndNear)),
            ("face", Some("sides")) => Ok(Self::Faces(Faces::Sides)),
            ("face", Some(option)) => {
                bail!("unknown option `{option}` of `+face`: did you mean `+face(sides)`?")
            }
            _ => bail!(
                "unknown partition `+{text}`: did you mean `+{}`?",
                nearest(name, &["zK", "face"])
            ),
        }
    }
}

impl Slices {
    fn parse(count: u32, text: Option<&str>) -> Result<Self> {
        let mut options: Vec<SliceOption> = Vec::new();
        for part in text.into_iter().flat_map(|t| t.split(',')) {
            let option = SliceOption::parse(part, count)?;
            ensure!(
                options
                    .iter()
                    .all(|o| std::mem::discriminant(o) != std::mem::discriminant(&option)),
                match option {
                    SliceOption::Splits(_) =>
                        format!("`{part}`: where slices meet can be said once"),
                    SliceOption::Overlap(_) => format!("`{part}`: an option can be given once"),
                }
            );
            options.push(option);
        }
        Ok(Self { count, options })
    }
}

impl SliceOption {
    /// An option of `+z{slices}`.
    fn parse(text: &str, slices: u32) -> Result<Self> {
        let share = |name: &str, value: &str| match value.parse::<f64>() {
            Ok(x) if (0.0..=1.0).contains(&x) => Ok(x),
            _ => bail!("`{name}={value}` must be a number from 0 to 1"),
        };
        let splits = match split_once(text, '=') {
            ("fitted", None) => Splits::Fitted,
            ("practical", Some(blend)) => Splits::Practical(share("practical", blend)?),
            ("at", Some(distances)) => Splits::At(parse_distances(distances, slices)?),
            ("overlap", Some(value)) => return Ok(Self::Overlap(share("overlap", value)?)),
            (name, _) => {
                let names = SLICE_OPTIONS.map(|shape| split_once(shape, '=').0);
                let meant = nearest(name, &names);
                let shape =
                    names.iter().position(|n| *n == meant).map_or(meant, |i| SLICE_OPTIONS[i]);
                ensure!(name != meant, "`{text}` must be written `{shape}`");
                bail!("unknown option `{text}` of `+z{slices}`: did you mean `{shape}`?")
            }
        };
        Ok(Self::Splits(splits))
    }
}

/// Distances at which `slices` slices meet, metres, with a slash between them.
fn parse_distances(text: &str, slices: u32) -> Result<[f64; Partition::MAX_SLICES - 1]> {
    ensure!(slices > 1, "`at={text}`: one slice meets no other; `at` takes `+z2` or more");
    let wanted = slices as usize - 1;
    let parsed: Option<Vec<f64>> = text.split('/').map(|d| d.parse().ok()).collect();
    let good = |d: &Vec<f64>| {
        d.len() == wanted
            && d.iter().all(|&d| d > 0.0 && d.is_finite())
            && d.windows(2).all(|w| w[0] < w[1])
    };
    let parsed = parsed.filter(good).ok_or_else(|| {
        let example: Vec<String> = (1..slices).map(|i| (5 * i).to_string()).collect();
        anyhow!(
            "`at={text}` must have {wanted} ascending number{} of metres, where the {slices} slices meet, \
             as in `at={}`",
            if wanted == 1 { "" } else { "s" },
            example.join("/")
        )
    })?;
    let mut distances = [0.0; Partition::MAX_SLICES - 1];
    distances[..wanted].copy_from_slice(&parsed);
    Ok(distances)
}

impl Display for Slices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "+z{}", self.count)?;
        for (i, option) in self.options.iter().enumerate() {
            f.write_str(if i == 0 { "(" } else { "," })?;
            match option {
                SliceOption::Overlap(share) => write!(f, "overlap={share}")?,
                SliceOption::Splits(Splits::Fitted) => f.write_str("fitted")?,
                SliceOption::Splits(Splits::Practical(blend)) => write!(f, "practical={blend}")?,
                SliceOption::Splits(Splits::At(distances)) => {
                    f.write_str("at=")?;
                    for (i, distance) in distances[..self.count as usize - 1].iter().enumerate() {
                        write!(f, "{}{distance}", if i == 0 { "" } else { "/" })?;
                    }
                }
                // The planner may learn splits that this language has no name for yet.
                SliceOption::Splits(other) => write!(f, "{other:?}")?,
            }
        }
        if self.options.is_empty() { Ok(()) } else { f.write_str(")") }
    }
}

/// As written behind the slices.
pub(super) fn faces_text(faces: Faces) -> &'static str {
    match faces {
        Faces::Whole => "",
        Faces::SidesAndNear => "+face",
        Faces::Sides => "+face(sides)",
    }
}
