//! The filter of a specification: `hard`, `pcf5`, `csm8(blur=7,attenuation=1,offset)`.

use super::{nearest, parse_count, split_once, split_options};
use anyhow::{Error, Result, bail, ensure};
use std::fmt::{self, Display};
use std::str::FromStr;

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

const FILTERS: &[&str] = &["hard", "pcf", "vsm", "esm", "evsm", "msm", "csm", "pcss"];

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
