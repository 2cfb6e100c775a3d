//! The filter of a specification: `hard`, `pcf5`, `csm8(blur=7,attenuation=1,offset)`.

use super::{nearest, parse_count, split_once, split_options};
use anyhow::{Error, Result, anyhow, bail, ensure};
use std::fmt::{self, Display};
use std::str::FromStr;
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{self, Blur, Prefilter, Width};

/// How a shadow map is looked up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Filter {
    /// One comparison with the nearest texel.
    Hard,
    /// The mean of N×N comparisons.
    Pcf(u32, Vec<FilterOption>),
    /// Variance, exponential, exponential variance and moment shadow maps.
    Blurred(BlurredKind, Vec<FilterOption>),
    /// Convolution shadow maps with M terms.
    Csm(u32, Vec<FilterOption>),
    /// Percentage-closer soft shadows.
    Pcss(Vec<FilterOption>),
}

/// Which statistics of depth a blurred map stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BlurredKind {
    /// Variance.
    Vsm,
    /// Exponential.
    Esm,
    /// Exponential variance, four numbers.
    Evsm,
    /// The same with two.
    Evsm2,
    /// Four moments.
    Msm,
}

/// How wide a filter is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BlurWidth {
    Texels(u32),
    Pixels(f32),
    Metres(f32),
}

impl FromStr for BlurWidth {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = |digits: &str| match digits.parse::<f32>() {
            Ok(w) if w > 0.0 && w <= 1e6 => Ok(w),
            _ => bail!(
                "`blur={text}` must be a positive number, at most 1e6, as in blur=1.5px or blur=0.2m"
            ),
        };
        if let Some(pixels) = text.strip_suffix("px") {
            return number(pixels).map(Self::Pixels);
        }
        if let Some(metres) = text.strip_suffix('m') {
            return number(metres).map(Self::Metres);
        }
        let n = parse_count(text, "blur=", 1..=Prefilter::MAX_BLUR)?;
        ensure!(n % 2 == 1, "`blur={n}` must be an odd number of texels");
        Ok(Self::Texels(n))
    }
}

impl Display for BlurWidth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Texels(n) => write!(f, "{n}"),
            Self::Pixels(w) => write!(f, "{w}px"),
            Self::Metres(w) => write!(f, "{w}m"),
        }
    }
}

/// An option in the parentheses behind a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FilterOption {
    /// `blur=N`, `blur=Xpx`, `blur=Xm`: width of the filter in texels, pixels or metres.
    Blur(BlurWidth),
    /// `leak=L`: what visibility is taken for shadow.
    Leak(f64),
    /// `exponent=C`: how steep an exponential is.
    Exponent(f64),
    /// `bits=N` of each stored number.
    Bits(u32),
    /// `attenuation=A` of the higher terms.
    Attenuation(f64),
    /// `offset`: look up a little nearer, so that lit surfaces are bright.
    Offset,
    /// `scale`: double the sum instead.
    Scale,
    /// `half`: stored at half the map's resolution.
    Half,
    /// `poisson`: comparisons without an order.
    Poisson,
    /// `light=Xdeg`, `light=Xm`: how large the light is.
    Light(LightSize),
    /// `samples=N`: N × N of them.
    Samples(u32),
}

/// How large a light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LightSize {
    /// The sun's diameter, as seen from here.
    Degrees(f32),
    /// A lamp's diameter.
    Metres(f32),
}

impl LightSize {
    /// As [`visibility::Filter::Pcss`] has it.
    fn diameter(self) -> f32 {
        match self {
            Self::Degrees(angle) => 2.0 * (0.5 * angle).to_radians().tan(),
            Self::Metres(diameter) => diameter,
        }
    }
}

/// Our sun.
impl Default for LightSize {
    fn default() -> Self {
        Self::Degrees(0.53)
    }
}

impl FromStr for LightSize {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = |digits: &str, most: f32| match digits.parse::<f32>() {
            Ok(size) if size > 0.0 && size <= most => Ok(size),
            _ => bail!("`light={text}` must be above 0 and at most {most}"),
        };
        match (text.strip_suffix("deg"), text.strip_suffix('m')) {
            (Some(degrees), _) => number(degrees, 90.0).map(Self::Degrees),
            (_, Some(metres)) => number(metres, 1e6).map(Self::Metres),
            _ => bail!("`light={text}` must have a unit, as in light=0.53deg or light=0.2m"),
        }
    }
}

impl Display for LightSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Degrees(size) => write!(f, "{size}deg"),
            Self::Metres(size) => write!(f, "{size}m"),
        }
    }
}

/// Of `pcss`, to each side.
const DEFAULT_SAMPLES: u32 = 6;

const FILTERS: &[&str] = &["hard", "pcf", "vsm", "esm", "evsm", "evsm2", "msm", "csm", "pcss"];

impl Filter {
    /// How large the light is, for those that ask.
    pub(super) fn light_size(&self) -> Option<LightSize> {
        let Self::Pcss(options) = self else { return None };
        let told = options.iter().find_map(|o| match o {
            FilterOption::Light(size) => Some(*size),
            _ => None,
        });
        Some(told.unwrap_or_default())
    }

    /// What executes it, or why this version cannot.
    pub(super) fn executable(&self) -> Result<visibility::Filter> {
        let (statistic, options) = match self {
            Self::Hard => return Ok(visibility::Filter::Hard),
            Self::Pcf(n, options) => {
                let is_poisson = options.contains(&FilterOption::Poisson);
                let width = match blur(options) {
                    None if is_poisson => {
                        bail!("`{self}` needs a width, as in pcf{n}(blur=2px,poisson)")
                    }
                    None => return Ok(visibility::Filter::pcf(*n)?),
                    Some(BlurWidth::Pixels(w)) => Width::Pixels(w),
                    Some(BlurWidth::Metres(w)) => Width::Metres(w),
                    Some(BlurWidth::Texels(_)) => {
                        bail!("`{self}`: pcf is N texels wide unless told in px or m")
                    }
                };
                let pattern = if is_poisson {
                    visibility::Pattern::Poisson
                } else {
                    visibility::Pattern::Grid
                };
                let filter = visibility::Filter::Spread { n: *n, width, pattern };
                filter.check().map_err(|e| anyhow!("`{self}`: {e}"))?;
                return Ok(filter);
            }
            Self::Pcss(options) => {
                let n = options.iter().find_map(|o| match o {
                    FilterOption::Samples(n) => Some(*n),
                    _ => None,
                });
                let source = self.light_size().unwrap_or_default().diameter();
                let filter = visibility::Filter::Pcss { n: n.unwrap_or(DEFAULT_SAMPLES), source };
                filter.check().map_err(|e| anyhow!("`{self}`: {e}"))?;
                return Ok(filter);
            }
            Self::Blurred(kind, options) => (kind.statistic(options), options),
            Self::Csm(order, options) => (csm(*order, options)?, options),
        };
        let blur = match blur(options) {
            None => Blur::Texels(1),
            Some(BlurWidth::Texels(n)) => Blur::Texels(n),
            Some(BlurWidth::Pixels(w)) => Blur::Width(Width::Pixels(w)),
            Some(BlurWidth::Metres(w)) => Blur::Width(Width::Metres(w)),
        };
        let half = options.contains(&FilterOption::Half);
        let prefilter = Prefilter { statistic, blur, half };
        prefilter.check().map_err(|e| anyhow!("`{self}`: {e}"))?;
        Ok(visibility::Filter::Prefiltered(prefilter))
    }
}

fn blur(options: &[FilterOption]) -> Option<BlurWidth> {
    options.iter().find_map(|o| match o {
        FilterOption::Blur(width) => Some(*width),
        _ => None,
    })
}

impl BlurredKind {
    /// Options that it does not have are not there.
    fn statistic(self, options: &[FilterOption]) -> Statistic {
        let exponent = options.iter().find_map(|o| match o {
            FilterOption::Exponent(c) => Some(*c as f32),
            _ => None,
        });
        let leak = leak(options).unwrap_or(0.0);
        let evsm = |components| {
            let exponent = exponent.unwrap_or(Evsm::MAX_EXPONENT);
            Statistic::Evsm(Evsm { components, exponent, leak })
        };
        match self {
            Self::Vsm => Statistic::Vsm(Vsm { leak }),
            Self::Esm => {
                Statistic::Esm(exponent.map_or_else(Esm::default, |exponent| Esm { exponent }))
            }
            Self::Evsm => evsm(4),
            Self::Evsm2 => evsm(2),
            Self::Msm => Statistic::Msm(Msm { leak }),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Vsm => "vsm",
            Self::Esm => "esm",
            Self::Evsm => "evsm",
            Self::Evsm2 => "evsm2",
            Self::Msm => "msm",
        }
    }

    /// Options that go in its parentheses.
    fn known(self) -> &'static [&'static str] {
        match self {
            Self::Vsm | Self::Msm => &["blur=N", "leak=L", "half"],
            Self::Esm => &["blur=N", "exponent=C", "half"],
            Self::Evsm | Self::Evsm2 => &["blur=N", "leak=L", "exponent=C", "half"],
        }
    }
}

fn leak(options: &[FilterOption]) -> Option<f32> {
    options.iter().find_map(|o| match o {
        FilterOption::Leak(leak) => Some(*leak as f32),
        _ => None,
    })
}

fn csm(order: u32, options: &[FilterOption]) -> Result<Statistic> {
    let has = |option: &FilterOption| options.contains(option);
    let attenuation = options.iter().find_map(|o| match o {
        FilterOption::Attenuation(a) => Some(*a as f32),
        _ => None,
    });
    // Lit surfaces half dark are of no use; of the two cures doubling is wrong in fewer pixels.
    let [offset, scale] = [has(&FilterOption::Offset), has(&FilterOption::Scale)];
    let csm = Csm::new(order, attenuation.unwrap_or(0.0), offset, scale || !offset)?;
    // The second swing of the series about 0, the first one above it, is 0.049 high before it is doubled.
    let ringing = 0.05 * csm.gain();
    let csm = csm.with_leak(leak(options).unwrap_or(ringing));
    Ok(Statistic::Csm(if has(&FilterOption::Bits(16)) { csm.in_16_bits() } else { csm }))
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
        let blurred = |kind: BlurredKind| {
            plain(Self::Blurred(kind, parse_options(options, stem, kind.known())?))
        };
        match stem {
            // Its number is part of its name.
            "evsm" if number == "2" => {
                let options = parse_options(options, name, BlurredKind::Evsm2.known())?;
                Ok(Self::Blurred(BlurredKind::Evsm2, options))
            }
            "hard" => no_options().and_then(|()| plain(Self::Hard)),
            "pcf" => Ok(Self::Pcf(
                numbered(1..=15)?,
                parse_options(options, stem, &["blur=Wpx", "poisson"])?,
            )),
            "pcss" => {
                plain(Self::Pcss(parse_options(options, stem, &["light=Xdeg", "samples=N"])?))
            }
            "vsm" => blurred(BlurredKind::Vsm),
            "esm" => blurred(BlurredKind::Esm),
            "evsm" => blurred(BlurredKind::Evsm),
            "msm" => blurred(BlurredKind::Msm),
            "csm" => {
                let known =
                    ["blur=N", "leak=L", "attenuation=A", "offset", "scale", "bits=16", "half"];
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
            Self::Pcf(n, options) => {
                write!(f, "pcf{n}")?;
                options
            }
            Self::Pcss(options) => {
                f.write_str("pcss")?;
                options
            }
            Self::Blurred(kind, options) => {
                f.write_str(kind.name())?;
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
                FilterOption::Leak(leak) => write!(f, "leak={leak}")?,
                FilterOption::Exponent(c) => write!(f, "exponent={c}")?,
                FilterOption::Bits(n) => write!(f, "bits={n}")?,
                FilterOption::Attenuation(a) => write!(f, "attenuation={a}")?,
                FilterOption::Offset => f.write_str("offset")?,
                FilterOption::Scale => f.write_str("scale")?,
                FilterOption::Half => f.write_str("half")?,
                FilterOption::Poisson => f.write_str("poisson")?,
                FilterOption::Light(size) => write!(f, "light={size}")?,
                FilterOption::Samples(n) => write!(f, "samples={n}")?,
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
            ("blur", Some(width)) => FilterOption::Blur(width.parse()?),
            ("leak", Some(leak)) => match leak.parse::<f64>() {
                Ok(l) if (0.0..1.0).contains(&l) => FilterOption::Leak(l),
                _ => bail!("`leak={leak}` must be a number of 0 to less than 1"),
            },
            ("exponent", Some(c)) => match c.parse::<f64>() {
                Ok(c) if c > 0.0 && c <= f64::from(Esm::MAX_EXPONENT) => FilterOption::Exponent(c),
                _ => {
                    bail!("`exponent={c}` must be a number above 0, at most {}", Esm::MAX_EXPONENT)
                }
            },
            ("bits", Some(n)) => {
                ensure!(n == "16", "`bits={n}` must be 16; 8 are the default");
                FilterOption::Bits(16)
            }
            ("attenuation", Some(a)) => match a.parse::<f64>() {
                Ok(a) if a >= 0.0 && a.is_finite() => FilterOption::Attenuation(a),
                _ => bail!("`attenuation={a}` must be a number of at least 0"),
            },
            ("offset", None) => FilterOption::Offset,
            ("scale", None) => FilterOption::Scale,
            ("half", None) => FilterOption::Half,
            ("poisson", None) => FilterOption::Poisson,
            ("light", Some(size)) => FilterOption::Light(size.parse()?),
            ("samples", Some(n)) => {
                FilterOption::Samples(parse_count(n, "samples=", 1..=visibility::Filter::MAX_DISC)?)
            }
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
