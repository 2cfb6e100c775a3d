//! The language's words for filters.

use super::language::{Kind, ParseError, Short, Word, WordOption, Written, count, write_word};
use super::scale::Scale;
use crate::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Storage, Vsm};
use crate::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};
use std::fmt;
use std::str::FromStr;

const ODD_TEXELS: Scale = Scale { step: 2.0, ..Scale::whole(1.0, Prefilter::MAX_BLUR as f64) };
const PIXELS: Scale = Scale::ratios("px", 0.25, 32.0);
const ACROSS: Scale = Scale::ratios("m", 0.005, 5.0);

const WIDTH: WordOption = WordOption {
    name: "blur",
    value: "WIDTH",
    scales: &[PIXELS, ACROSS],
    example: "blur=2px",
    meaning: "N×N comparisons over this width, in pixels of the picture (2px) or in metres across the \
              light (0.3m): the same near and far, under any warp and in every slice.",
};
const BLUR: WordOption = WordOption {
    name: "blur",
    value: "WIDTH",
    scales: &[ODD_TEXELS, PIXELS, ACROSS],
    example: "blur=7",
    meaning: "A Gaussian this wide: an odd number of texels (7), blurred ahead of lookup; or pixels of \
              the picture (2px) or metres across the light (0.3m), the same near and far.",
};
const HALF: WordOption = WordOption {
    name: "half",
    value: "",
    scales: &[],
    example: "half",
    meaning: "Stored at half the map's resolution: a quarter of the memory, and of the blur's work.",
};
const LEAK: WordOption = WordOption {
    name: "leak",
    value: "SHARE",
    scales: &[Scale::even(0.0, 0.99)],
    example: "leak=0.2",
    meaning: "Takes visibilities below this for shadow and stretches the rest, against light that \
              leaks.",
};
const EXPONENT: WordOption = WordOption {
    name: "exponent",
    value: "NUMBER",
    scales: &[Scale::ratios("", 1.0, Evsm::MAX_EXPONENT as f64)],
    example: "exponent=30",
    meaning: "How steep the exponentials are.",
};

/// The filter's word that is also a technique by itself.
pub(super) const NONE: &str = "none";

pub(super) const WORDS: &[Word] = &[
    Word {
        name: NONE,
        value: "",
        scales: &[],
        example: NONE,
        options: &[],
        meaning: "No shadows and no maps: the frame to which a technique's cost is the difference. \
                  `none` is a whole technique.",
    },
    Word {
        name: "hard",
        value: "",
        scales: &[],
        example: "hard",
        options: &[],
        meaning: "One comparison with the nearest texel.",
    },
    Word {
        name: "pcf",
        value: "N",
        scales: &[Scale::whole(1.0, Filter::MAX_PCF as f64)],
        example: "pcf3",
        options: &[
            WIDTH,
            WordOption {
                name: "poisson",
                value: "",
                scales: &[],
                example: "blur=2px,poisson",
                meaning: "The comparisons of a `blur` at scattered places in a disc, not on a grid.",
            },
        ],
        meaning: "Percentage-closer filtering: the lit share of N×N texels (Reeves et al. 1987).",
    },
    Word {
        name: "pcss",
        value: "",
        scales: &[],
        example: "pcss",
        options: &[
            WordOption {
                name: "light",
                value: "SIZE",
                scales: &[Scale::ratios("deg", 0.05, 20.0), Scale::ratios("m", 0.005, 10.0)],
                example: "light=2deg",
                meaning: "How large the light is: the angle of a sun (0.53deg, ours) or the diameter of \
                          a lamp (0.2m).",
            },
            WordOption {
                name: "samples",
                value: "N",
                scales: &[Scale::whole(1.0, Filter::MAX_DISC as f64)],
                example: "samples=4",
                meaning: "N×N comparisons for the blockers, and as many for the penumbra; 6 if not told.",
            },
        ],
        meaning: "Percentage-closer soft shadows: penumbrae as wide as the distance of what casts them \
                  asks for (Fernando 2005).",
    },
    Word {
        name: "vsm",
        value: "",
        scales: &[],
        example: "vsm",
        options: &[BLUR, LEAK, HALF],
        meaning: "Variance shadow maps: mean and mean square of depth, blurred ahead of lookup \
                  (Donnelly and Lauritzen 2006).",
    },
    Word {
        name: "esm",
        value: "",
        scales: &[],
        example: "esm",
        options: &[
            BLUR,
            WordOption { scales: &[Scale::ratios("", 1.0, Esm::MAX_EXPONENT as f64)], ..EXPONENT },
            HALF,
        ],
        meaning: "Exponential shadow maps: an exponential of depth, blurred ahead of lookup (Annen et \
                  al. 2008).",
    },
    Word {
        name: "evsm",
        value: "",
        scales: &[],
        example: "evsm",
        options: &[BLUR, LEAK, EXPONENT, HALF],
        meaning: "Exponential variance shadow maps: moments of two exponentials of depth, blurred ahead of \
                  lookup (Lauritzen and McCool 2008).",
    },
    Word {
        name: "evsm2",
        value: "",
        scales: &[],
        example: "evsm2",
        options: &[BLUR, LEAK, EXPONENT, HALF],
        meaning: "Exponential variance shadow maps with one exponential: half the memory, more light leaks.",
    },
    Word {
        name: "msm",
        value: "",
        scales: &[],
        example: "msm",
        options: &[BLUR, LEAK, HALF],
        meaning: "Moment shadow maps: four moments of depth, blurred ahead of lookup (Peters and Klein \
                  2015).",
    },
    Word {
        name: "csm",
        value: "M",
        scales: &[Scale::whole(1.0, Csm::MAX_ORDER as f64)],
        example: "csm4",
        options: &[
            BLUR,
            WordOption {
                meaning: "Takes visibilities below this for shadow, which hides the series' ringing; \
                          0.1 if not told, 0.05 with `offset` alone.",
                ..LEAK
            },
            WordOption {
                name: "attenuation",
                value: "NUMBER",
                scales: &[Scale::even(0.0, 10.0)],
                example: "attenuation=1",
                meaning: "Damps the higher terms of the series, against ringing.",
            },
            WordOption {
                name: "offset",
                value: "",
                scales: &[],
                example: "offset",
                meaning: "Looks up a little nearer the light, so that lit surfaces are bright.",
            },
            WordOption {
                name: "scale",
                value: "",
                scales: &[],
                example: "offset,scale",
                meaning: "Doubles the series, so that lit surfaces are bright: what is done if neither \
                          is told.",
            },
            WordOption {
                name: "raw",
                value: "",
                scales: &[],
                example: "raw",
                meaning: "Neither: lit surfaces come out half as bright.",
            },
            WordOption {
                name: "bits",
                value: "16",
                scales: &[Scale::whole(16.0, 16.0)],
                example: "bits=16",
                meaning: "Stores each statistic in 16 bits in place of 8.",
            },
            HALF,
        ],
        meaning: "Convolution shadow maps with M = 1 to 16 terms of the shadow test's Fourier series, \
                  blurred ahead of lookup (Annen et al. 2007).",
    },
];

/// The default n of `pcss`.
const DEFAULT_SAMPLES: u32 = 6;

/// The height of the first swing above 0 by which a Fourier series rings in shadow.
const RINGING: f32 = 0.05;

impl FromStr for Filter {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        read(text)
    }
}

pub(super) fn read(text: &str) -> Result<Filter, ParseError> {
    let written = Written::read(text, Kind::Filter).map_err(|e| {
        let is_short_for_cascades = text == "csm";
        let cascades = "; cascades are slices along the view, written `uniform+z4`";
        ParseError { problem: e.problem + if is_short_for_cascades { cascades } else { "" }, ..e }
    })?;
    let filter = match written.word.name {
        "pcf" => read_pcf(&written)?,
        "pcss" => {
            let light = written.value_of("light").map(read_light).transpose()?;
            let n = written.value_of("samples").map(|n| count(n, "samples=", 1..=Filter::MAX_DISC));
            Filter::Pcss {
                n: n.transpose()?.unwrap_or(DEFAULT_SAMPLES),
                light: light.unwrap_or_default(),
            }
        }
        "vsm" => prefiltered(
            &written,
            Statistic::Vsm(Vsm { leak: read_leak(&written)?.unwrap_or(0.0) }),
        )?,
        "msm" => prefiltered(
            &written,
            Statistic::Msm(Msm { leak: read_leak(&written)?.unwrap_or(0.0) }),
        )?,
        "esm" => {
            let exponent = read_exponent(&written, Esm::MAX_EXPONENT)?;
            prefiltered(&written, Statistic::Esm(Esm { exponent }))?
        }
        name @ ("evsm" | "evsm2") => {
            let components = if name == "evsm2" { 2 } else { 4 };
            let exponent = read_exponent(&written, Evsm::MAX_EXPONENT)?;
            let leak = read_leak(&written)?.unwrap_or(0.0);
            prefiltered(&written, Statistic::Evsm(Evsm { components, exponent, leak }))?
        }
        "csm" => prefiltered(&written, Statistic::Csm(read_csm(&written)?))?,
        NONE => Filter::None,
        _ => Filter::Hard,
    };
    filter.check().map_err(|e| ParseError::new(format!("`{text}`: {e}")))?;
    Ok(filter)
}

fn read_pcf(written: &Written<'_>) -> Result<Filter, ParseError> {
    let n = written.count("", 1..=Filter::MAX_PCF)?;
    let text = written.text;
    let pattern = if written.has("poisson") { Pattern::Poisson } else { Pattern::Grid };
    match read_blur(written)? {
        None if pattern == Pattern::Poisson => Err(ParseError::new(format!(
            "`{text}` needs a width, as in `pcf{n}(blur=2px,poisson)`"
        ))),
        None => Ok(Filter::Pcf { n }),
        Some(Blur::Width(width)) => Ok(Filter::Spread { n, width, pattern }),
        Some(Blur::Texels(_)) => {
            Err(ParseError::new(format!("`{text}`: pcf is N texels wide unless told in px or m")))
        }
    }
}

fn prefiltered(written: &Written<'_>, statistic: Statistic) -> Result<Filter, ParseError> {
    let blur = read_blur(written)?.unwrap_or(Blur::Texels(1));
    Ok(Filter::Prefiltered(Prefilter { statistic, blur, half: written.has("half") }))
}

fn read_csm(written: &Written<'_>) -> Result<Csm, ParseError> {
    let order = written.count("", 1..=Csm::MAX_ORDER)?;
    let [offset, scale, raw] = ["offset", "scale", "raw"].map(|name| written.has(name));
    if raw && (offset || scale) {
        let problem = format!("`{}`: `raw` is neither `offset` nor `scale`", written.text);
        return Err(ParseError::new(problem));
    }
    let is_good = |a: &f32| *a >= 0.0 && a.is_finite();
    let attenuation = written.number("attenuation", is_good, "a number of at least 0")?;
    // Lit surfaces at half brightness are of no use. Of the two remedies, doubling gives fewer
    // wrong pixels than the offset.
    let scale = scale || !(offset || raw);
    let csm = Csm::new(order, attenuation.unwrap_or(0.0), offset, scale)
        .map_err(|e| ParseError::new(format!("`{}`: {e}", written.text)))?;
    let csm = csm.with_leak(read_leak(written)?.unwrap_or(RINGING * csm.gain()));
    match written.value_of("bits") {
        None => Ok(csm),
        Some("16") => Ok(csm.in_16_bits()),
        Some(n) => Err(ParseError::new(format!("`bits={n}` must be 16; 8 are the default"))),
    }
}

fn read_leak(written: &Written<'_>) -> Result<Option<f32>, ParseError> {
    written.number("leak", |l| (0.0..1.0).contains(l), "a number of 0 to less than 1")
}

fn read_exponent(written: &Written<'_>, max: f32) -> Result<f32, ParseError> {
    let must = format!("a number above 0, at most {max}");
    Ok(written.number("exponent", |c| *c > 0.0 && *c <= max, must)?.unwrap_or(max))
}

fn read_blur(written: &Written<'_>) -> Result<Option<Blur>, ParseError> {
    let Some(text) = written.value_of("blur") else { return Ok(None) };
    let number = |digits: &str| {
        let width = digits.parse().ok().filter(|w: &f32| *w > 0.0 && *w <= Width::MAX);
        width.ok_or_else(|| {
            let max = Width::MAX;
            ParseError::new(format!(
                "`blur={text}` must be a positive number, at most {max}, as in `blur=1.5px` or `blur=0.2m`"
            ))
        })
    };
    if let Some(pixels) = text.strip_suffix("px") {
        return Ok(Some(Blur::Width(Width::Pixels(number(pixels)?))));
    }
    if let Some(metres) = text.strip_suffix('m') {
        return Ok(Some(Blur::Width(Width::Metres(number(metres)?))));
    }
    let n = count(text, "blur=", 1..=Prefilter::MAX_BLUR)?;
    if n % 2 == 0 {
        return Err(ParseError::new(format!("`blur={n}` must be an odd number of texels")));
    }
    Ok(Some(Blur::Texels(n)))
}

fn read_light(text: &str) -> Result<LightSize, ParseError> {
    text.parse().map_err(|e: ParseError| ParseError::new(format!("`light={text}` {}", e.problem)))
}

/// Reads the form that it is printed in: `0.53deg`, `0.2m`.
impl FromStr for LightSize {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let number = |digits: &str, most: f32| {
            let size = digits.parse().ok().filter(|size: &f32| *size > 0.0 && *size <= most);
            size.ok_or_else(|| ParseError::new(format!("must be above 0 and at most {most}")))
        };
        match (text.strip_suffix("deg"), text.strip_suffix('m')) {
            (Some(degrees), _) => number(degrees, Self::MAX_DEGREES).map(Self::Degrees),
            (_, Some(metres)) => number(metres, Self::MAX_METRES).map(Self::Metres),
            _ => Err(ParseError::new("must have a unit, as in `0.53deg` or `0.2m`")),
        }
    }
}

/// The form of a technique's text: `pcf3`, `csm8(blur=7,offset)`.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str(NONE),
            Self::Hard => f.write_str("hard"),
            Self::Pcf { n } => write!(f, "pcf{n}"),
            Self::Spread { n, width, pattern } => {
                let poisson = (*pattern == Pattern::Poisson).then(|| "poisson".to_owned());
                write_word(f, format_args!("pcf{n}"), [Some(format!("blur={width}")), poisson])
            }
            Self::Pcss { n, light } => {
                let told = (*light != LightSize::default()).then(|| format!("light={light}"));
                let samples = (*n != DEFAULT_SAMPLES).then(|| format!("samples={n}"));
                write_word(f, "pcss", [told, samples])
            }
            Self::Prefiltered(prefilter) => write_prefilter(f, prefilter),
        }
    }
}

fn write_prefilter(f: &mut fmt::Formatter<'_>, prefilter: &Prefilter) -> fmt::Result {
    let Prefilter { statistic, blur, half } = prefilter;
    let blur = match blur {
        Blur::Texels(1) => None,
        Blur::Texels(n) => Some(format!("blur={n}")),
        Blur::Width(width) => Some(format!("blur={width}")),
    };
    let half = half.then(|| "half".to_owned());
    let unless = |name: &str, value: f32, default: f32| {
        (value != default).then(|| format!("{name}={}", Short(value)))
    };
    let options = match statistic {
        Statistic::Vsm(s) => vec![unless("leak", s.leak, 0.0)],
        Statistic::Msm(s) => vec![unless("leak", s.leak, 0.0)],
        Statistic::Esm(s) => vec![unless("exponent", s.exponent, Esm::MAX_EXPONENT)],
        Statistic::Evsm(s) => {
            vec![unless("leak", s.leak, 0.0), unless("exponent", s.exponent, Evsm::MAX_EXPONENT)]
        }
        Statistic::Csm(s) => {
            let bright = match s.brightening() {
                [true, true] => Some("offset,scale"),
                [true, false] => Some("offset"),
                [false, true] => None,
                [false, false] => Some("raw"),
            };
            let is_wide = statistic.storage() == Storage::Snorm16;
            vec![
                unless("leak", s.leak(), RINGING * s.gain()),
                unless("attenuation", s.attenuation(), 0.0),
                bright.map(str::to_owned),
                is_wide.then(|| "bits=16".to_owned()),
            ]
        }
    };
    write_word(f, statistic, [blur].into_iter().chain(options).chain([half]))
}
