//! The shadow specification language: `WARP[+zK][+face][:FILTER][@TEXELS]`.

mod filter;

use anyhow::{Error, Result, anyhow, bail, ensure};
pub(crate) use filter::Filter;
use std::fmt::{self, Display};
use std::str::FromStr;
use umbrage::{Objective, Options, Size, Warp, visibility};

/// The longest side of a shadow map, texels; what today's GPUs allow.
pub(crate) const MAX_SIDE: u32 = 16384;

/// Texels on a side of the budget where none is given.
const DEFAULT_SIDE: u32 = 1024;

/// One way to make shadows: how to lay out the maps and how to look them up.
///
/// Printing gives the text that parses to the same value. What was left out stays `None`, so that a
/// specification prints as the user wrote it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spec {
    /// How texels are spread over what the camera sees.
    pub(crate) warp: Warp,
    /// Number of z-partitions; `None`: one map.
    pub(crate) z_partitions: Option<u32>,
    /// Whether each side face of the view gets maps of its own.
    pub(crate) face: bool,
    /// How maps are looked up; `None`: `hard`.
    pub(crate) filter: Option<Filter>,
    /// How many texels; `None`: a budget of 1024².
    pub(crate) size: Option<TexelSize>,
}

/// The number of texels, as written behind the `@`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TexelSize {
    /// All maps together have the square of this.
    Side(u32),
    /// Every map has exactly this width and height.
    Exact([u32; 2]),
}

const WARPS: &[&str] = &[
    "unfocused",
    "uniform",
    "psm",
    "lispsm",
    "tsm",
    "adaptive",
    "adaptive(area)",
    "log",
    "lambda=",
];
/// A specification that this version can execute, and what that takes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Technique {
    /// As the user wrote it.
    pub(crate) spec: Spec,
    /// For the planner.
    pub(crate) options: Options,
    /// For the lookup.
    pub(crate) filter: visibility::Filter,
}

impl Technique {
    /// What executes `spec`, or why this version cannot.
    pub(crate) fn new(spec: Spec) -> Result<Self> {
        let missing = |what: String| {
            Err(anyhow!(
                "{what} are not available in this version; one map with `hard` or `pcfN` is"
            ))
        };
        if let Some(k) = spec.z_partitions {
            return missing(format!("z-partitions (`+z{k}`)"));
        }
        if spec.face {
            return missing("face partitions (`+face`)".into());
        }
        let filter = match &spec.filter {
            None | Some(Filter::Hard) => visibility::Filter::Hard,
            Some(Filter::Pcf(n)) => visibility::Filter::pcf(*n)?,
            Some(other) => return missing(format!("`{other}` filters")),
        };
        let size = match spec.size.unwrap_or(TexelSize::Side(DEFAULT_SIDE)) {
            TexelSize::Side(n) => Size::Budget(u64::from(n).pow(2)),
            TexelSize::Exact(size) => Size::Exact(size),
        };
        let options = Options { warp: spec.warp, size, max_side: MAX_SIDE, ..Options::default() };
        Ok(Self { spec, options, filter })
    }
}

impl FromStr for Technique {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::new(text.parse()?)
    }
}

impl FromStr for Spec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (head, size) = split_once(text, '@');
        let (layout, filter) = split_once(head, ':');
        if let Some(size) = size
            && size.contains([':', '+'])
        {
            bail!("`@{size}`: `@TEXELS` comes last, as in `uniform:pcf3@1024`");
        }
        let mut parts = layout.split('+');
        let mut spec = Self {
            warp: parse_warp(parts.next().unwrap_or_default())?,
            z_partitions: None,
            face: false,
            filter: filter.map(Filter::from_str).transpose()?,
            size: size.map(TexelSize::from_str).transpose()?,
        };
        for part in parts {
            let twice = if part == "face" {
                std::mem::replace(&mut spec.face, true)
            } else if let Some(k) = part.strip_prefix('z').filter(|k| is_number(k)) {
                spec.z_partitions.replace(parse_count(k, "+z", 1..=16)?).is_some()
            } else {
                bail!(
                    "unknown partition `+{part}`: did you mean `+{}`?",
                    nearest(part, &["zK", "face"])
                );
            };
            ensure!(!twice, "`+{part}`: a kind of partition can be given once");
        }
        Ok(spec)
    }
}

impl Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.warp {
            Warp::Unfocused => f.write_str("unfocused")?,
            Warp::Uniform => f.write_str("uniform")?,
            Warp::Psm => f.write_str("psm")?,
            Warp::Lispsm => f.write_str("lispsm")?,
            Warp::Tsm { focus: None } => f.write_str("tsm")?,
            Warp::Tsm { focus: Some(metres) } => write!(f, "tsm(focus={metres})")?,
            Warp::Adaptive(Objective::Storage) => f.write_str("adaptive")?,
            Warp::Adaptive(Objective::Area) => f.write_str("adaptive(area)")?,
            Warp::Log => f.write_str("log")?,
            Warp::Lambda(metres) => write!(f, "lambda={metres}")?,
            // The planner may learn warps that this language has no name for yet.
            other => write!(f, "{other:?}")?,
        }
        if let Some(k) = self.z_partitions {
            write!(f, "+z{k}")?;
        }
        if self.face {
            f.write_str("+face")?;
        }
        if let Some(filter) = &self.filter {
            write!(f, ":{filter}")?;
        }
        match self.size {
            None => Ok(()),
            Some(TexelSize::Side(n)) => write!(f, "@{n}"),
            Some(TexelSize::Exact([w, h])) => write!(f, "@{w}x{h}"),
        }
    }
}

fn parse_warp(text: &str) -> Result<Warp> {
    let (name, options) = split_options(text)?;
    if let Some(number) = name.strip_prefix("lambda=") {
        ensure!(options.is_none(), "`{text}`: `lambda=NUMBER` takes no options");
        return Ok(Warp::Lambda(parse_positive(number, "lambda=")?));
    }
    match (name, options) {
        ("unfocused", None) => Ok(Warp::Unfocused),
        ("uniform", None) => Ok(Warp::Uniform),
        ("psm", None) => Ok(Warp::Psm),
        ("lispsm", None) => Ok(Warp::Lispsm),
        ("tsm", None) => Ok(Warp::Tsm { focus: None }),
        ("tsm", Some(option)) => {
            let metres = option.strip_prefix("focus=").ok_or_else(|| {
                anyhow!("unknown option `{option}` of `tsm`: did you mean `focus=METRES`?")
            })?;
            let metres = parse_positive(metres, "focus=")?;
            ensure!(metres.is_finite(), "`focus={metres}` must be a finite number of metres");
            Ok(Warp::Tsm { focus: Some(metres) })
        }
        ("adaptive", None) => Ok(Warp::Adaptive(Objective::Storage)),
        ("adaptive", Some("area")) => Ok(Warp::Adaptive(Objective::Area)),
        ("adaptive", Some(option)) => {
            bail!("unknown option `{option}` of `adaptive`: did you mean `adaptive(area)`?")
        }
        ("log", None) => Ok(Warp::Log),
        ("", None) => bail!("the warp is missing: it comes first, as in `uniform:pcf3@1024`"),
        (known, Some(_)) if WARPS.contains(&known) => bail!("`{text}`: `{known}` takes no options"),
        _ => bail!(
            "unknown warp `{text}`: did you mean `{}`? (there are unfocused, uniform, psm, lispsm, tsm, \
             adaptive, adaptive(area), log, lambda=NUMBER)",
            match nearest(name, WARPS) {
                "lambda=" => "lambda=NUMBER",
                other => other,
            }
        ),
    }
}

impl FromStr for TexelSize {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match split_once(text, 'x') {
            (side, None) => Ok(Self::Side(parse_count(side, "@", 1..=MAX_SIDE)?)),
            (w, Some(h)) => Ok(Self::Exact([
                parse_count(w, "@", 1..=MAX_SIDE)?,
                parse_count(h, "x", 1..=MAX_SIDE)?,
            ])),
        }
    }
}

/// Splits `name(options)`.
fn split_options(text: &str) -> Result<(&str, Option<&str>)> {
    match split_once(text, '(') {
        (name, None) => {
            ensure!(!name.contains(')'), "`{text}` has a `)` without its `(`");
            Ok((name, None))
        }
        (name, Some(rest)) => {
            let options = rest
                .strip_suffix(')')
                .ok_or_else(|| anyhow!("`{text}`: the `)` that ends the options is missing"))?;
            Ok((name, Some(options)))
        }
    }
}

fn split_once(text: &str, at: char) -> (&str, Option<&str>) {
    text.split_once(at).map_or((text, None), |(a, b)| (a, Some(b)))
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

fn parse_count(text: &str, prefix: &str, range: std::ops::RangeInclusive<u32>) -> Result<u32> {
    let in_range = text.parse().ok().filter(|n| is_number(text) && range.contains(n));
    in_range.ok_or_else(|| {
        anyhow!(
            "`{prefix}{text}` must have a whole number from {} to {}",
            range.start(),
            range.end()
        )
    })
}

fn parse_positive(text: &str, prefix: &str) -> Result<f64> {
    match text.parse() {
        Ok(x) if x > 0.0 => Ok(x),
        _ => bail!("`{prefix}{text}` must have a positive number of metres, as in `{prefix}12.5`"),
    }
}

/// The name in `names` most like `text`.
pub(crate) fn nearest<'a>(text: &str, names: &[&'a str]) -> &'a str {
    let text = text.to_lowercase();
    let distance = |name: &&&str| strsim::damerau_levenshtein(name, &text);
    names.iter().min_by_key(distance).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests;
