//! The shadow specification language: `WARP[+zK][+face][:FILTER][@TEXELS]`.

use anyhow::{Error, Result, anyhow, bail, ensure};
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

/// How a shadow map is looked up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Filter {
    /// One comparison with the nearest texel.
    Hard,
    /// The mean of N×N comparisons.
    Pcf(u32),
    /// Variance, exponential, exponential variance and moment shadow maps.
    Blurred(BlurredKind, Vec<FilterOption>),
    /// Convolution shadow maps with M terms.
    Csm(u32, Vec<FilterOption>),
    /// Percentage-closer soft shadows.
    Pcss,
}

/// Which statistics of depth a blurred map stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BlurredKind {
    /// Variance.
    Vsm,
    /// Exponential.
    Esm,
    /// Exponential variance.
    Evsm,
    /// Four moments.
    Msm,
}

/// An option in the parentheses behind a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FilterOption {
    /// `blur=N`: width of the filter, texels.
    Blur(u32),
    /// `attenuation=A` of the higher terms.
    Attenuation(f64),
    /// `offset`: look up a little nearer, so that lit surfaces are bright.
    Offset,
    /// `scale`: double the sum instead.
    Scale,
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
const FILTERS: &[&str] = &["hard", "pcf", "vsm", "esm", "evsm", "msm", "csm", "pcss"];

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
        let options = Options { warp: spec.warp, size, max_side: MAX_SIDE };
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

impl FromStr for Filter {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, options) = split_options(text)?;
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = &name[stem.len()..];
        let numbered = |range| {
            ensure!(!number.is_empty(), "`{text}` needs a number, as in `{stem}5`");
            parse_count(number, stem, range)
        };
        let plain = |filter| {
            ensure!(number.is_empty(), "`{text}`: `{stem}` takes no number");
            Ok(filter)
        };
        let no_options = || match options {
            None => Ok(()),
            Some(_) => bail!("`{text}`: `{stem}` takes no options"),
        };
        let blurred = |kind| plain(Self::Blurred(kind, parse_options(options, stem, &["blur=N"])?));
        match stem {
            "hard" => no_options().and_then(|()| plain(Self::Hard)),
            "pcf" => no_options().and_then(|()| Ok(Self::Pcf(numbered(1..=15)?))),
            "pcss" => no_options().and_then(|()| plain(Self::Pcss)),
            "vsm" => blurred(BlurredKind::Vsm),
            "esm" => blurred(BlurredKind::Esm),
            "evsm" => blurred(BlurredKind::Evsm),
            "msm" => blurred(BlurredKind::Msm),
            "csm" => {
                let known = ["blur=N", "attenuation=A", "offset", "scale"];
                Ok(Self::Csm(numbered(1..=16)?, parse_options(options, stem, &known)?))
            }
            _ => bail!(
                "unknown filter `{text}`: did you mean `{}`? (there are hard, pcfN, vsm, esm, evsm, msm, \
                 csmM, pcss)",
                match nearest(stem, FILTERS) {
                    "pcf" => "pcfN",
                    "csm" => "csmM",
                    other => other,
                }
            ),
        }
    }
}

impl Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let options = match self {
            Self::Hard => return f.write_str("hard"),
            Self::Pcf(n) => return write!(f, "pcf{n}"),
            Self::Pcss => return f.write_str("pcss"),
            Self::Blurred(kind, options) => {
                f.write_str(match kind {
                    BlurredKind::Vsm => "vsm",
                    BlurredKind::Esm => "esm",
                    BlurredKind::Evsm => "evsm",
                    BlurredKind::Msm => "msm",
                })?;
                options
            }
            Self::Csm(m, options) => {
                write!(f, "csm{m}")?;
                options
            }
        };
        for (i, option) in options.iter().enumerate() {
            f.write_str(if i == 0 { "(" } else { "," })?;
            match option {
                FilterOption::Blur(texels) => write!(f, "blur={texels}")?,
                FilterOption::Attenuation(a) => write!(f, "attenuation={a}")?,
                FilterOption::Offset => f.write_str("offset")?,
                FilterOption::Scale => f.write_str("scale")?,
            }
        }
        if options.is_empty() { Ok(()) } else { f.write_str(")") }
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

/// The options in a filter's parentheses; `known` shows those that the filter has.
fn parse_options(text: Option<&str>, filter: &str, known: &[&str]) -> Result<Vec<FilterOption>> {
    let mut options: Vec<FilterOption> = Vec::new();
    for part in text.into_iter().flat_map(|t| t.split(',')) {
        let (name, value) = split_once(part, '=');
        let shape = known.iter().find(|k| split_once(k, '=').0 == name);
        let option = match (name, value) {
            _ if shape.is_none() => bail!(
                "unknown option `{part}` of `{filter}`: did you mean `{}`?",
                nearest(part, known)
            ),
            ("blur", Some(n)) => FilterOption::Blur(parse_count(n, "blur=", 1..=63)?),
            ("attenuation", Some(a)) => match a.parse::<f64>() {
                Ok(a) if a >= 0.0 && a.is_finite() => FilterOption::Attenuation(a),
                _ => bail!("`attenuation={a}` must be a number of at least 0"),
            },
            ("offset", None) => FilterOption::Offset,
            ("scale", None) => FilterOption::Scale,
            _ => bail!("`{part}` must be written `{}`", shape.unwrap_or(&name)),
        };
        ensure!(
            options.iter().all(|o| std::mem::discriminant(o) != std::mem::discriminant(&option)),
            "`{part}`: an option can be given once"
        );
        options.push(option);
    }
    Ok(options)
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
mod tests {
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
                    vec![
                        FilterOption::Blur(7),
                        FilterOption::Attenuation(1.0),
                        FilterOption::Offset
                    ],
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
}
