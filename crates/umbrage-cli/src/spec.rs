//! The shadow specification language: `WARP[+zK][+face][:FILTER][@TEXELS]`.

mod filter;
mod partition;

use anyhow::{Error, Result, anyhow, bail, ensure};
pub(crate) use filter::Filter;
use filter::LightSize;
use partition::{Part, Slices};
use std::fmt::{self, Display};
use std::str::FromStr;
use umbrage::{Faces, Light, Objective, Options, Size, Warp, visibility};

/// The longest side of a shadow map, texels; what today's GPUs allow.
pub(crate) const MAX_SIDE: u32 = 16384;

/// The budget where none is given.
const DEFAULT_SIZE: TexelSize = TexelSize::Side(1024);

/// One way to make shadows: how to lay out the maps and how to look them up.
///
/// Printing gives the text that parses to the same value. What was left out stays `None`, so that a
/// specification prints as the user wrote it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spec {
    /// How texels are spread over what the camera sees.
    pub(crate) warp: Warp,
    /// Slices along the view; `None`: one.
    pub(crate) slices: Option<Slices>,
    /// Which faces of the view get maps of their own.
    pub(crate) faces: Faces,
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
    "uniform(stable)",
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
        let filter =
            spec.filter.as_ref().map_or(Ok(visibility::Filter::Hard), Filter::executable)?;
        let size = match spec.size.unwrap_or(DEFAULT_SIZE) {
            TexelSize::Side(n) => Size::Budget(u64::from(n).pow(2)),
            TexelSize::Exact(size) => Size::Exact(size),
        };
        let partition = partition::partition(spec.slices.as_ref(), spec.faces);
        // Penumbrae depend on how far casters lie.
        let keeps_casters = matches!(filter, visibility::Filter::Pcss { .. });
        let warp = spec.warp;
        let options = Options {
            warp,
            partition,
            size,
            max_side: MAX_SIDE,
            keeps_casters,
            reach_texels: filter.reach_texels(),
            ..Options::default()
        };
        Ok(Self { spec, options, filter })
    }

    /// Takes the fewest texels for errors of at most this many pixels per texel, unless the
    /// specification says how many texels there are.
    pub(crate) fn limit_error(&mut self, pixels: f64) {
        if self.spec.size.is_none() {
            self.options.size = Size::MaxError(pixels);
        }
    }

    /// That the filter's light is of the kind that shines.
    pub(crate) fn check_light(&self, light: &Light) -> Result<()> {
        let size = self.spec.filter.as_ref().and_then(Filter::light_size);
        match (light, size) {
            (Light::Directional { .. }, Some(LightSize::Metres(_))) => {
                bail!("--shadows {}: a sun's size is an angle, as in light=0.53deg", self.spec)
            }
            (Light::Spot(_) | Light::Point(_), Some(LightSize::Degrees(_))) => {
                bail!("--shadows {}: a lamp's size is a length, as in light=0.2m", self.spec)
            }
            _ => Ok(()),
        }
    }

    /// A planner's complaint, naming what of the specification it is about.
    pub(crate) fn error(&self, error: &umbrage::Error) -> Error {
        let umbrage::Error::Invalid { field, problem } = error else {
            return crate::setup::option_error(error);
        };
        let Spec { warp, slices, faces, size, .. } = &self.spec;
        let part = match (field.strip_prefix("options."), self.options.size) {
            (Some("warp.lambda" | "warp.focus"), _) => warp_text(*warp),
            (Some("partition.faces"), _) => partition::faces_text(*faces).to_owned(),
            (Some("partition.slices" | "partition.splits" | "partition.overlap"), _) => {
                slices.as_ref().map(Slices::to_string).unwrap_or_default()
            }
            (Some("size"), Size::MaxError(pixels)) => format!("--max-error {pixels}"),
            (Some("size"), _) => size.unwrap_or(DEFAULT_SIZE).to_string(),
            _ => return crate::setup::option_error(error),
        };
        anyhow!("--shadows {}: `{part}`: {problem}", self.spec)
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
            slices: None,
            faces: Faces::Whole,
            filter: filter.map(Filter::from_str).transpose()?,
            size: size.map(TexelSize::from_str).transpose()?,
        };
        for part in parts {
            let twice = match part.parse()? {
                Part::Slices(slices) => spec.slices.replace(slices).is_some(),
                Part::Faces(faces) => std::mem::replace(&mut spec.faces, faces) != Faces::Whole,
            };
            ensure!(!twice, "`+{part}`: a kind of partition can be given once");
        }
        Ok(spec)
    }
}

impl Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&warp_text(self.warp))?;
        if let Some(slices) = &self.slices {
            write!(f, "{slices}")?;
        }
        f.write_str(partition::faces_text(self.faces))?;
        if let Some(filter) = &self.filter {
            write!(f, ":{filter}")?;
        }
        self.size.map_or(Ok(()), |size| write!(f, "{size}"))
    }
}

impl Display for TexelSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Side(n) => write!(f, "@{n}"),
            Self::Exact([w, h]) => write!(f, "@{w}x{h}"),
        }
    }
}

fn warp_text(warp: Warp) -> String {
    match warp {
        Warp::Unfocused => "unfocused".into(),
        Warp::Stable => "uniform(stable)".into(),
        Warp::Uniform => "uniform".into(),
        Warp::Psm => "psm".into(),
        Warp::Lispsm => "lispsm".into(),
        Warp::Tsm { focus: None } => "tsm".into(),
        Warp::Tsm { focus: Some(metres) } => format!("tsm(focus={})", Short(metres)),
        Warp::Adaptive(Objective::Storage) => "adaptive".into(),
        Warp::Adaptive(Objective::Area) => "adaptive(area)".into(),
        Warp::Log => "log".into(),
        Warp::Lambda(metres) => format!("lambda={}", Short(metres)),
        // The planner may learn warps that this language has no name for yet.
        other => format!("{other:?}"),
    }
}

/// The part before everything else.
pub(crate) fn parse_warp(text: &str) -> Result<Warp> {
    let (name, options) = split_options(text)?;
    if let Some(number) = name.strip_prefix("lambda=") {
        ensure!(options.is_none(), "`{text}`: `lambda=NUMBER` takes no options");
        return Ok(Warp::Lambda(parse_positive(number, "lambda=")?));
    }
    match (name, options) {
        ("unfocused", None) => Ok(Warp::Unfocused),
        ("uniform", None) => Ok(Warp::Uniform),
        ("uniform", Some("stable")) => Ok(Warp::Stable),
        ("uniform", Some(option)) => {
            bail!("unknown option `{option}` of `uniform`: did you mean `uniform(stable)`?")
        }
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
            "unknown warp `{text}`: did you mean `{}`? (there are unfocused, uniform, uniform(stable), \
             psm, lispsm, tsm, adaptive, adaptive(area), log, lambda=NUMBER)",
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

/// A number in as few digits as tell it.
struct Short(f64);

impl Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_handy = self.0.is_infinite() || (1e-4..1e7).contains(&self.0);
        if is_handy { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
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
