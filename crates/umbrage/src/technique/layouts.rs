//! The language's words for warps, partitions and numbers of texels.

use super::language::{
    FILTERS, Kind, ParseError, Short, Word, WordOption, Written, count, split_once, split_options,
    write_word,
};
use super::scale::Scale;
use super::{Cover, Faces, MAX_SIDE, Objective, Partition, Size, Splits, Warp};
use crate::paged::{LEAST_ERROR, MOST_ERROR};
use std::fmt::{self, Write};
use std::str::FromStr;

const METRES: Scale = Scale::ratios("", 0.01, 1000.0);
const SIDE: Scale = Scale { step: 1.0, ..Scale::ratios("", 64.0, 8192.0) };

pub(super) const WARPS: &[Word] = &[
    Word {
        name: "unfocused",
        value: "",
        scales: &[],
        example: "unfocused",
        options: &[],
        meaning: "An even map over the whole scene, whatever the camera sees.",
    },
    Word {
        name: "uniform",
        value: "",
        scales: &[],
        example: "uniform",
        options: &[WordOption {
            name: "stable",
            value: "",
            scales: &[],
            example: "stable",
            meaning: "Covers all that the camera may turn to, so that texels keep their places in the \
                      world and shadows do not shimmer.",
        }],
        meaning: "An even map, focused on the receivers that the camera sees.",
    },
    Word {
        name: "psm",
        value: "",
        scales: &[],
        example: "psm",
        options: &[],
        meaning: "A perspective shadow map: drawn in the viewer's own perspective (Stamminger and \
                  Drettakis 2002).",
    },
    Word {
        name: "lispsm",
        value: "",
        scales: &[],
        example: "lispsm",
        options: &[],
        meaning: "A light space perspective shadow map: a perspective warp along the view, whose \
                  strength balances near and far (Wimmer et al. 2004).",
    },
    Word {
        name: "tsm",
        value: "",
        scales: &[],
        example: "tsm",
        options: &[WordOption {
            name: "focus",
            value: "METRES",
            scales: &[METRES],
            example: "focus=5",
            meaning: "The focus distance along the view; without it √(n f) of the receivers seen.",
        }],
        meaning: "A trapezoidal shadow map: a perspective warp that gives 80% of the rows to what is \
                  nearer than the focus distance (Martin and Tan 2004).",
    },
    Word {
        name: "adaptive",
        value: "",
        scales: &[],
        example: "adaptive",
        options: &[WordOption {
            name: "area",
            value: "",
            scales: &[],
            example: "area",
            meaning: "Makes the largest texel on screen smallest instead.",
        }],
        meaning: "The perspective warp that needs the fewest texels for a guaranteed error in this \
                  view and light; never more than `uniform`.",
    },
    Word {
        name: "log",
        value: "",
        scales: &[],
        example: "log",
        options: &[],
        meaning: "Logarithmic rows of texels: the ideal that no GPU rasterises, for comparison on the \
                  CPU (Wimmer et al. 2004).",
    },
    Word {
        name: "lambda",
        value: "=NUMBER",
        scales: &[METRES],
        example: "lambda=12.5",
        options: &[],
        meaning: "A perspective warp with this distance λ, metres, from its centre of projection to \
                  its near plane.",
    },
    Word {
        name: PAGED,
        value: "",
        scales: &[],
        example: PAGED,
        options: &[WordOption {
            name: "error",
            value: "PIXELS",
            scales: &[Scale::ratios("", LEAST_ERROR, MOST_ERROR)],
            example: "error=0.5",
            meaning: "The greatest width of a texel, pixels, before any surface's slope; 1 if none is \
                      given.",
        }],
        meaning: "Pages of even maps, whose texels are nowhere wider than asked and keep their places \
                  in the world, so that shadows do not shimmer. Without @TEXELS there are as many \
                  as the view needs.",
    },
];

/// The word of paged maps.
const PAGED: &str = "paged";

/// Whether a word, with its options, is that of paged maps.
pub(super) fn is_paged(text: &str) -> bool {
    split_options(text).is_ok_and(|(head, _)| head == PAGED)
}

/// The error of paged maps that need not be written, pixels.
const PAGED_ERROR: f64 = 1.0;

pub(super) const PARTITIONS: &[Word] = &[
    Word {
        name: "z",
        value: "K",
        scales: &[Scale::whole(1.0, Partition::MAX_SLICES as f64)],
        example: "z4",
        options: &[
            WordOption {
                name: "fitted",
                value: "",
                scales: &[],
                example: "fitted",
                meaning: "Slices that all need as many texels for the same error.",
            },
            WordOption {
                name: "practical",
                value: "BLEND",
                scales: &[Scale::even(0.0, 1.0)],
                example: "practical=0.5",
                meaning: "Slices between even ones (0) and self-similar ones (1).",
            },
            WordOption {
                name: "at",
                value: "METRES/METRES",
                scales: &[METRES],
                example: "at=5/20/60",
                meaning: "Slices that meet at these distances along the view.",
            },
            WordOption {
                name: "overlap",
                value: "SHARE",
                scales: &[Scale::even(0.0, 1.0)],
                example: "overlap=0.1",
                meaning: "Each slice fades into the next one over this share of its length.",
            },
        ],
        meaning: "1 to 16 slices along the view, also called cascades, with a map each; self-similar \
                  unless told otherwise.",
    },
    Word {
        name: "face",
        value: "",
        scales: &[],
        example: "face",
        options: &[WordOption {
            name: "sides",
            value: "",
            scales: &[],
            example: "sides",
            meaning: "Maps for the four sides alone.",
        }],
        meaning: "Maps for the four sides of the view and for its near face (Lloyd et al. 2006).",
    },
];

pub(super) static SIZES: [Word; 4] = [
    Word {
        name: "TEXELS",
        value: "",
        scales: &[SIDE],
        example: "2048",
        options: &[],
        meaning: "A budget of TEXELS² texels for all maps, shared among them and between their sides \
                  where the errors are; 1024 if none is given.",
    },
    Word {
        name: "WxH",
        value: "",
        scales: &[SIDE],
        example: "800x600",
        options: &[],
        meaning: "Every map has exactly this width and height, texels.",
    },
    Word {
        name: "PIXELSpx",
        value: "",
        scales: &[Scale::ratios("px", 0.1, 16.0)],
        example: "1px",
        options: &[],
        meaning: "The fewest texels with which none gets wider than this many pixels, before any \
                  surface's slope.",
    },
    Word {
        name: "NUMBERtexels",
        value: "",
        scales: &[Scale { step: 1.0, ..Scale::ratios("texels", 4096.0, 67_108_864.0) }],
        example: "3000000texels",
        options: &[],
        meaning: "A budget that is not the square of a whole number.",
    },
];

/// The warp of a text that is only a filter.
pub(super) const DEFAULT_WARP: &str = "adaptive";

pub(super) fn read_warp(text: &str) -> Result<(Warp, Cover), ParseError> {
    if text.is_empty() {
        return Err(ParseError::new(
            "the warp is missing: it comes first, as in `uniform:pcf3@1024`",
        ));
    }
    let written = Written::read(text, Kind::Warp).map_err(|e| misplaced(text).unwrap_or(e))?;
    let seen = |warp| Ok((warp, Cover::Seen));
    match written.word.name {
        "unfocused" => Ok((Warp::Uniform, Cover::Scene)),
        "uniform" if written.has("stable") => Ok((Warp::Uniform, Cover::Stable)),
        "psm" => seen(Warp::Psm),
        "lispsm" => seen(Warp::Lispsm),
        "tsm" => {
            let metres = "a positive, finite number of metres, as in `focus=12.5`";
            let is_good = |&d: &f64| d > 0.0 && d.is_finite();
            seen(Warp::Tsm { focus: written.number("focus", is_good, metres)? })
        }
        "adaptive" if written.has("area") => seen(Warp::Adaptive(Objective::Area)),
        "adaptive" => seen(Warp::Adaptive(Objective::Storage)),
        "log" => seen(Warp::Log),
        PAGED => {
            let pixels =
                format!("a number of {LEAST_ERROR} to {MOST_ERROR} pixels, as in `error=0.5`");
            let is_good = |e: &f64| (LEAST_ERROR..=MOST_ERROR).contains(e);
            let error = written.number("error", is_good, pixels)?.unwrap_or(PAGED_ERROR);
            Ok((Warp::Uniform, Cover::Paged { error }))
        }
        "lambda" => match written.value.parse() {
            Ok(lambda) if lambda > 0.0 => seen(Warp::Lambda(lambda)),
            _ => Err(ParseError::new(format!(
                "`{text}` must have a positive number of metres, as in `lambda=12.5`"
            ))),
        },
        _ => seen(Warp::Uniform),
    }
}

/// Parses a warp alone, without what it covers.
impl FromStr for Warp {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        match read_warp(text)? {
            (warp, Cover::Seen) => Ok(warp),
            _ => Err(ParseError::new(format!(
                "`{text}` says what a map covers, not how it is warped; the warp is `uniform`"
            ))),
        }
    }
}

/// An error with a suggestion for a text that has some other word in the place of the warp.
fn misplaced(text: &str) -> Option<ParseError> {
    let stem = text.trim_end_matches(|c: char| c.is_ascii_digit());
    // `csm` also abbreviates cascaded shadow maps.
    if ["cascade", "cascades", "cascaded", "csm"].contains(&stem.to_lowercase().as_str()) {
        let count = match &text[stem.len()..] {
            "" => "4",
            count => count,
        };
        let cascades = format!("uniform+z{count}");
        if stem != "csm" || text == "csm" {
            let problem = format!("`{text}`: cascades are slices along the view, `+zK`");
            return Some(ParseError::new(problem).suggest(cascades));
        }
        let problem = format!(
            "`{text}` is a filter (convolution shadow maps), which goes behind a warp; cascades are \
             written `{cascades}`"
        );
        return Some(ParseError::new(problem).suggest(format!("{DEFAULT_WARP}:{text}")));
    }
    let name = text.split('(').next().unwrap_or_default();
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let word = FILTERS.iter().find(|w| w.name == name || w.name == stem)?;
    let filter = if word.value.is_empty() || name != stem { text } else { word.example };
    let problem = format!("`{text}` is a filter, which goes behind a warp");
    Some(ParseError::new(problem).suggest(format!("{DEFAULT_WARP}:{filter}")))
}

pub(super) fn write_warp(f: &mut impl Write, warp: Warp, cover: Cover) -> fmt::Result {
    let option = match warp {
        Warp::Tsm { focus: Some(metres) } => Some(format!("focus={}", Short(metres))),
        Warp::Adaptive(Objective::Area) => Some("area".to_owned()),
        _ => None,
    };
    let head = match warp {
        Warp::Uniform if cover == Cover::Scene => "unfocused".to_owned(),
        Warp::Uniform if matches!(cover, Cover::Paged { .. }) => PAGED.to_owned(),
        Warp::Uniform => "uniform".to_owned(),
        Warp::Psm => "psm".to_owned(),
        Warp::Lispsm => "lispsm".to_owned(),
        Warp::Tsm { .. } => "tsm".to_owned(),
        Warp::Adaptive(_) => "adaptive".to_owned(),
        Warp::Log => "log".to_owned(),
        Warp::Lambda(metres) => format!("lambda={}", Short(metres)),
    };
    // The language has no words for warped maps that cover the whole scene or have pages, and the
    // planner rejects them.
    let cover = match cover {
        Cover::Stable => Some("stable".to_owned()),
        Cover::Paged { .. } if warp != Warp::Uniform => Some(PAGED.to_owned()),
        Cover::Paged { error } => (error != PAGED_ERROR).then(|| format!("error={}", Short(error))),
        Cover::Scene if warp != Warp::Uniform => Some("unfocused".to_owned()),
        Cover::Scene | Cover::Seen => None,
    };
    write_word(f, head, [option, cover])
}

pub(super) fn read_partition(parts: &[&str]) -> Result<Partition, ParseError> {
    let mut partition = Partition::default();
    let [mut has_slices, mut has_faces] = [false; 2];
    for part in parts {
        let written = Written::read(part, Kind::Partition)?;
        let twice = if written.word.name == "z" {
            let faces = partition.faces;
            partition = Partition { faces, ..read_slices(&written)? };
            std::mem::replace(&mut has_slices, true)
        } else {
            partition.faces = if written.has("sides") { Faces::Sides } else { Faces::SidesAndNear };
            std::mem::replace(&mut has_faces, true)
        };
        if twice {
            let problem = format!("`+{part}`: a kind of partition can be given once");
            return Err(ParseError::new(problem));
        }
    }
    Ok(partition)
}

fn read_slices(written: &Written<'_>) -> Result<Partition, ParseError> {
    let slices = written.count("+", 1..=Partition::MAX_SLICES as u32)?;
    let share =
        |name| written.number(name, |x: &f64| (0.0..=1.0).contains(x), "a number from 0 to 1");
    let mut splits = [
        written.has("fitted").then_some(Splits::Fitted),
        share("practical")?.map(Splits::Practical),
        written.value_of("at").map(|text| read_distances(text, slices)).transpose()?,
    ]
    .into_iter()
    .flatten();
    let first = splits.next();
    if splits.next().is_some() {
        let problem = format!("`+{}`: where slices meet can be said once", written.text);
        return Err(ParseError::new(problem));
    }
    Ok(Partition {
        slices,
        splits: first.unwrap_or(Splits::SelfSimilar),
        overlap: share("overlap")?.unwrap_or(0.0),
        faces: Faces::Whole,
    })
}

/// Valid distances at which `slices` slices meet, for messages and controls.
pub(super) fn example_distances(slices: u32) -> String {
    let distances: Vec<String> = (1..slices).map(|i| (5 * i).to_string()).collect();
    distances.join("/")
}

/// Parses the distances at which `slices` slices meet, metres, separated by slashes.
fn read_distances(text: &str, slices: u32) -> Result<Splits, ParseError> {
    let wanted = slices as usize - 1;
    if wanted == 0 {
        let problem = format!("`at={text}`: one slice meets no other; `at` takes `+z2` or more");
        return Err(ParseError::new(problem));
    }
    let parsed: Option<Vec<f64>> = text.split('/').map(|d| d.parse().ok()).collect();
    let is_good = |d: &Vec<f64>| {
        d.len() == wanted
            && d.iter().all(|&d| d > 0.0 && d.is_finite())
            && d.windows(2).all(|w| w[0] < w[1])
    };
    let parsed = parsed.filter(is_good).ok_or_else(|| {
        let plural = if wanted == 1 { "" } else { "s" };
        ParseError::new(format!(
            "`at={text}` must have {wanted} ascending number{plural} of metres, where the {slices} \
             slices meet, as in `at={}`",
            example_distances(slices)
        ))
    })?;
    let mut distances = [0.0; Partition::MAX_SLICES - 1];
    distances[..wanted].copy_from_slice(&parsed);
    Ok(Splits::At(distances))
}

pub(super) fn write_partition(f: &mut impl Write, partition: &Partition) -> fmt::Result {
    if (Partition { faces: Faces::Whole, ..*partition }) != Partition::default() {
        write_slices(f, partition)?;
    }
    write_faces(f, partition.faces)
}

pub(super) fn write_slices(f: &mut impl Write, partition: &Partition) -> fmt::Result {
    let Partition { slices, splits, overlap, .. } = *partition;
    let splits = match splits {
        Splits::SelfSimilar => None,
        Splits::Fitted => Some("fitted".to_owned()),
        Splits::Practical(blend) => Some(format!("practical={}", Short(blend))),
        Splits::At(distances) => {
            let used = &distances[..(slices as usize).saturating_sub(1).min(distances.len())];
            let used: Vec<String> = used.iter().map(|&d| Short(d).to_string()).collect();
            Some(format!("at={}", used.join("/")))
        }
    };
    let overlap = (overlap != 0.0).then(|| format!("overlap={}", Short(overlap)));
    write_word(f, format_args!("+z{slices}"), [splits, overlap])
}

pub(super) fn write_faces(f: &mut impl Write, faces: Faces) -> fmt::Result {
    f.write_str(match faces {
        Faces::Whole => "",
        Faces::SidesAndNear => "+face",
        Faces::Sides => "+face(sides)",
    })
}

/// The kind of size that a text has the form of.
pub(super) fn size_word(text: &str) -> &'static Word {
    let [budget, exact, error, texels] = &SIZES;
    if text.ends_with("px") {
        error
    } else if text.ends_with("texels") {
        texels
    } else if text.contains('x') {
        exact
    } else {
        budget
    }
}

pub(super) fn read_size(text: &str) -> Result<Size, ParseError> {
    let must = |what: &str| ParseError::new(format!("`@{text}` must have {what}"));
    if let Some(pixels) = text.strip_suffix("px") {
        let pixels = pixels.parse().ok().filter(|p: &f64| *p > 0.0 && p.is_finite());
        return pixels.map(Size::MaxError).ok_or_else(|| must("a positive number of pixels"));
    }
    if let Some(texels) = text.strip_suffix("texels") {
        let is_good = |n: &u64| (1..=1 << 32).contains(n);
        let texels = texels.parse().ok().filter(is_good);
        return texels.map(Size::Budget).ok_or_else(|| must("a whole number from 1 to 2^32"));
    }
    match split_once(text, 'x') {
        (side, None) => Ok(Size::Budget(u64::from(count(side, "@", 1..=MAX_SIDE)?).pow(2))),
        (w, Some(h)) => {
            Ok(Size::Exact([count(w, "@", 1..=MAX_SIDE)?, count(h, "x", 1..=MAX_SIDE)?]))
        }
    }
}
