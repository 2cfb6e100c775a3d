//! The language in which techniques are written: `WARP[+zK][+face][:FILTER][@TEXELS]`.
//!
//! [`Technique`] parses and prints it. Every word stands in one of four tables with its options and
//! a sentence about each; the parser, the printer's tests, [`help`] and the reports' explanations
//! are all made from these.

use super::{Size, Technique, filters, layouts};
use std::fmt::{self, Display, LowerExp, Write};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// The words of a technique's first part: how texels are spread, and over what.
pub static WARPS: &[Word] = layouts::WARPS;
/// The words behind a `+`: which maps there are.
pub static PARTITIONS: &[Word] = layouts::PARTITIONS;
/// The words behind the `:`: how maps are looked up.
pub static FILTERS: &[Word] = filters::WORDS;
/// What can stand behind the `@`: how many texels there are.
pub static SIZES: &[Word] = &layouts::SIZES;

/// A word of the language, and what can follow it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// How the word begins: `pcf`.
    pub name: &'static str,
    /// What stands for the value that follows the name at once: `N` in `pcfN`, `=NUMBER` in
    /// `lambda=NUMBER`. Empty for words without a value.
    pub value: &'static str,
    /// The word with a value that makes sense: `pcf3`.
    pub example: &'static str,
    /// The options that may stand in parentheses behind the word, with commas between them.
    pub options: &'static [WordOption],
    /// What the word means, in one sentence.
    pub meaning: &'static str,
}

/// An option of a [`Word`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordOption {
    /// The option's name: `blur`.
    pub name: &'static str,
    /// What stands for the option's value: `WIDTH` in `blur=WIDTH`. Empty for options without one.
    pub value: &'static str,
    /// The option with a value that makes sense: `blur=2px`.
    pub example: &'static str,
    /// What the option means, in one sentence.
    pub meaning: &'static str,
}

/// As the language's tables show it: `pcfN`.
impl Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.name, self.value)
    }
}

/// As the language's tables show it: `blur=WIDTH`.
impl Display for WordOption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            "" => f.write_str(self.name),
            value => write!(f, "{}={value}", self.name),
        }
    }
}

/// Why a text is no [`Technique`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}{}", did_you_mean(.suggestion.as_deref()))]
#[non_exhaustive]
pub struct ParseError {
    /// Which part of the text is wrong, and why, on one line.
    pub problem: String,
    /// What may have been meant: the nearest word of the language, or the same words in their places.
    pub suggestion: Option<String>,
}

fn did_you_mean(suggestion: Option<&str>) -> String {
    suggestion.map_or_else(String::new, |s| format!(": did you mean `{s}`?"))
}

impl ParseError {
    pub(super) fn new(problem: impl Into<String>) -> Self {
        Self { problem: problem.into(), suggestion: None }
    }

    pub(super) fn suggest(self, suggestion: impl Into<String>) -> Self {
        Self { suggestion: Some(suggestion.into()), ..self }
    }
}

/// The name among `names` that is most like `text`; empty if there are none.
pub fn nearest<'a>(text: &str, names: impl IntoIterator<Item = &'a str>) -> &'a str {
    let text = text.to_lowercase();
    let distance = |name: &&str| strsim::damerau_levenshtein(name, &text);
    names.into_iter().min_by_key(distance).unwrap_or_default()
}

/// The whole language on one page of plain text, some 80 columns wide.
pub fn help() -> String {
    let mut page = String::from(
        "A technique is written WARP[+zK][+face][:FILTER][@TEXELS], as in\n\
         adaptive+z4:pcf3@2048.\n",
    );
    let tables = [
        ("WARP: how texels are spread", "", WARPS),
        ("Partitions: which maps there are", "+", PARTITIONS),
        ("FILTER: how maps are looked up", ":", FILTERS),
        ("TEXELS: how many there are", "@", SIZES),
    ];
    for (title, prefix, words) in tables {
        let _ = writeln!(page, "\n{title}");
        let mut told: Vec<(&WordOption, &Word)> = Vec::new();
        for word in words {
            paragraph(&mut page, 2, &format!("{prefix}{word}"), word.meaning);
            for option in word.options {
                let first = told.iter().find(|(known, _)| *known == option).map(|(_, word)| word);
                let meaning = first.map(|word| format!("As for {prefix}{word}."));
                let meaning = meaning.as_deref().unwrap_or(option.meaning);
                paragraph(&mut page, 6, &format!("({option})"), meaning);
                told.push((option, word));
            }
        }
    }
    page
}

/// A term and its explanation, which begins at column 26 and is broken before column 80.
fn paragraph(page: &mut String, indent: usize, term: &str, text: &str) {
    const TEXT: usize = 26;
    const END: usize = 80;
    let mut line = format!("{:indent$}{term}", "");
    if line.chars().count() + 2 > TEXT {
        let _ = writeln!(page, "{line}");
        line.clear();
    }
    for word in text.split_whitespace() {
        let column = line.chars().count().max(TEXT);
        if column > TEXT && column + 1 + word.chars().count() > END {
            let _ = writeln!(page, "{line}");
            line.clear();
        }
        let column = line.chars().count();
        let gap = if column > TEXT { 1 } else { TEXT - column };
        let _ = write!(line, "{:gap$}{word}", "");
    }
    let _ = writeln!(page, "{line}");
}

/// What the words of a technique's text mean: each word or option as it is written there, and a
/// sentence about it. Empty for a text that is no technique.
pub fn explain(text: &str) -> Vec<(String, &'static str)> {
    let mut explained = Vec::new();
    if text.parse::<Technique>().is_err() {
        return explained;
    }
    let parts = Parts::of(text);
    let mut add = |kind: Kind, text: &str| {
        if let Ok(written) = Written::read(text, kind) {
            let head = text.split('(').next().unwrap_or_default();
            explained.push((format!("{}{head}", kind.prefix()), written.word.meaning));
            for (option, value) in written.options {
                let equals = if value.is_empty() { "" } else { "=" };
                explained.push((format!("{}{equals}{value}", option.name), option.meaning));
            }
        }
    };
    add(Kind::Warp, parts.warp);
    parts.partitions.iter().for_each(|part| add(Kind::Partition, part));
    if let Some(filter) = parts.filter {
        add(Kind::Filter, filter);
    }
    if let Some(size) = parts.size {
        explained.push((format!("@{size}"), layouts::size_word(size).meaning));
    }
    explained
}

/// A technique's text, cut where its parts meet.
struct Parts<'a> {
    warp: &'a str,
    partitions: Vec<&'a str>,
    filter: Option<&'a str>,
    size: Option<&'a str>,
}

impl<'a> Parts<'a> {
    fn of(text: &'a str) -> Self {
        let (head, size) = split_once(text, '@');
        let (layout, filter) = split_once(head, ':');
        let mut depth = 0;
        // An exponent, as in `tsm(focus=1e+3)`, begins no partition.
        let mut parts = layout.split(move |c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            c == '+' && depth <= 0
        });
        Self { warp: parts.next().unwrap_or_default(), partitions: parts.collect(), filter, size }
    }
}

impl FromStr for Technique {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let Parts { warp, partitions, filter, size } = Parts::of(text);
        if let Some(size) = size.filter(|size| size.contains([':', '+'])) {
            return Err(ParseError::new(format!(
                "`@{size}`: `@TEXELS` comes last, as in `uniform:pcf3@1024`"
            )));
        }
        let (warp, cover) = layouts::read_warp(warp)?;
        let default = Self::default();
        Ok(Self {
            warp,
            cover,
            partition: layouts::read_partition(&partitions)?,
            filter: filter.map_or(Ok(default.filter), filters::read)?,
            size: size.map_or(Ok(default.size), layouts::read_size)?,
        })
    }
}

/// The text that parses to the same technique, without what is so by default.
impl Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let default = Self::default();
        layouts::write_warp(f, self.warp, self.cover)?;
        layouts::write_partition(f, &self.partition)?;
        if self.filter != default.filter {
            write!(f, ":{}", self.filter)?;
        }
        if self.size != default.size {
            write!(f, "@{}", self.size)?;
        }
        Ok(())
    }
}

impl Technique {
    /// The part of the technique's text that a planner's complaint is about, by the field that
    /// [`Error::Invalid`](crate::Error::Invalid) names; `None` for fields of anything else.
    pub fn part(&self, field: &str) -> Option<String> {
        let field = field.strip_prefix("technique.").unwrap_or(field);
        let mut part = String::new();
        // Writing to a string cannot fail.
        let _ = match field.split('.').next()? {
            "warp" | "cover" => layouts::write_warp(&mut part, self.warp, self.cover),
            "partition" if field.ends_with("faces") => {
                layouts::write_faces(&mut part, self.partition.faces)
            }
            "partition" => layouts::write_slices(&mut part, &self.partition),
            "filter" => write!(part, ":{}", self.filter),
            "size" => write!(part, "@{}", self.size),
            _ => return None,
        };
        Some(part)
    }
}

/// A place in a technique's text, and so a table of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Warp,
    Partition,
    Filter,
}

impl Kind {
    fn words(self) -> &'static [Word] {
        match self {
            Self::Warp => WARPS,
            Self::Partition => PARTITIONS,
            Self::Filter => FILTERS,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Warp => "warp",
            Self::Partition => "partition",
            Self::Filter => "filter",
        }
    }

    /// What stands before the words where complaints show them.
    fn prefix(self) -> &'static str {
        if self == Self::Partition { "+" } else { "" }
    }
}

/// A word as somebody wrote it, with its value and options, all of them known.
pub(super) struct Written<'a> {
    /// All of it.
    pub(super) text: &'a str,
    pub(super) word: &'static Word,
    /// The word's own value, without an `=`.
    pub(super) value: &'a str,
    /// With their values; empty where there is none.
    options: Vec<(&'static WordOption, &'a str)>,
}

impl<'a> Written<'a> {
    /// Finds a word of this kind, and its options.
    pub(super) fn read(text: &'a str, kind: Kind) -> Result<Self, ParseError> {
        let (words, prefix) = (kind.words(), kind.prefix());
        let (head, options) = split_options(text)?;
        let stem = head.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = &head[stem.len()..];
        let named = |name: &str| words.iter().find(|w| w.name == name);
        let with_equals = head.split_once('=').and_then(|(name, value)| {
            Some((named(name).filter(|w| w.value.starts_with('='))?, value))
        });
        let (word, value) = if let Some(found) = with_equals {
            found
        } else if let Some(word) = named(head).filter(|w| w.value.is_empty()) {
            // A number may be part of a name.
            (word, "")
        } else if let Some(word) = named(stem).filter(|w| !w.value.starts_with('=')) {
            let shown = format!("{prefix}{text}");
            if word.value.is_empty() {
                return Err(ParseError::new(format!("`{shown}`: `{stem}` takes no number")));
            }
            if number.is_empty() {
                let problem = format!("`{shown}` needs a number, as in `{prefix}{}`", word.example);
                return Err(ParseError::new(problem).suggest(format!("{prefix}{word}")));
            }
            (word, number)
        } else {
            return Err(unknown(text, head, kind));
        };
        let options = read_options(options, word, &format!("{prefix}{head}"))?;
        Ok(Self { text, word, value, options })
    }

    /// Whether an option is there.
    pub(super) fn has(&self, name: &str) -> bool {
        self.value_of(name).is_some()
    }

    /// An option's value, if the option is there.
    pub(super) fn value_of(&self, name: &str) -> Option<&'a str> {
        debug_assert!(self.word.options.iter().any(|o| o.name == name), "{name}");
        self.options.iter().find(|(option, _)| option.name == name).map(|(_, value)| *value)
    }

    /// An option's number, if the option is there. `must` says what it must be.
    pub(super) fn number<T: FromStr>(
        &self,
        name: &str,
        is_good: impl Fn(&T) -> bool,
        must: impl Display,
    ) -> Result<Option<T>, ParseError> {
        let Some(value) = self.value_of(name) else { return Ok(None) };
        let number = value.parse().ok().filter(is_good);
        let problem = || ParseError::new(format!("`{name}={value}` must be {must}"));
        number.map(Some).ok_or_else(problem)
    }

    /// The word's own whole number.
    pub(super) fn count(
        &self,
        prefix: &str,
        range: RangeInclusive<u32>,
    ) -> Result<u32, ParseError> {
        count(self.value, &format!("{prefix}{}", self.word.name), range)
    }
}

fn unknown(text: &str, head: &str, kind: Kind) -> ParseError {
    let (words, prefix) = (kind.words(), kind.prefix());
    let meant = nearest(head, words.iter().map(|w| w.name));
    let shapes = words.iter().map(|w| format!("{prefix}{w}"));
    let all = shapes.collect::<Vec<_>>().join(", ");
    let problem = format!("unknown {} `{prefix}{text}` (there are {all})", kind.name());
    let shape = words.iter().find(|w| w.name == meant).map(Word::to_string).unwrap_or_default();
    ParseError::new(problem).suggest(format!("{prefix}{shape}"))
}

fn read_options<'a>(
    text: Option<&'a str>,
    word: &'static Word,
    head: &str,
) -> Result<Vec<(&'static WordOption, &'a str)>, ParseError> {
    let mut options: Vec<(&WordOption, &str)> = Vec::new();
    let Some(text) = text else { return Ok(options) };
    if word.options.is_empty() {
        return Err(ParseError::new(format!("`{head}({text})`: `{}` takes no options", word.name)));
    }
    for part in text.split(',') {
        let (name, value) = split_once(part, '=');
        let Some(option) = word.options.iter().find(|o| o.name == name) else {
            let nearest = nearest(name, word.options.iter().map(|o| o.name));
            let meant = word.options.iter().find(|o| o.name == nearest);
            let shape = meant.map(WordOption::to_string).unwrap_or_default();
            return Err(ParseError::new(format!("unknown option `{part}` of `{head}`"))
                .suggest(format!("{head}({shape})")));
        };
        if value.is_some() == option.value.is_empty() {
            return Err(ParseError::new(format!("`{part}` must be written `{option}`")));
        }
        if options.iter().any(|(o, _)| o.name == name) {
            return Err(ParseError::new(format!("`{part}`: an option can be given once")));
        }
        options.push((option, value.unwrap_or_default()));
    }
    Ok(options)
}

/// Splits `name(options)`.
fn split_options(text: &str) -> Result<(&str, Option<&str>), ParseError> {
    match split_once(text, '(') {
        (name, None) if name.contains(')') => {
            Err(ParseError::new(format!("`{text}` has a `)` without its `(`")))
        }
        (name, None) => Ok((name, None)),
        (name, Some(rest)) => {
            let missing =
                || ParseError::new(format!("`{text}`: the `)` that ends the options is missing"));
            Ok((name, Some(rest.strip_suffix(')').ok_or_else(missing)?)))
        }
    }
}

pub(super) fn split_once(text: &str, at: char) -> (&str, Option<&str>) {
    text.split_once(at).map_or((text, None), |(a, b)| (a, Some(b)))
}

/// A whole number in a range; `prefix` is what stands before it.
pub(super) fn count(
    text: &str,
    prefix: &str,
    range: RangeInclusive<u32>,
) -> Result<u32, ParseError> {
    let is_number = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    text.parse().ok().filter(|n| is_number && range.contains(n)).ok_or_else(|| {
        let [start, end] = [range.start(), range.end()];
        ParseError::new(format!("`{prefix}{text}` must have a whole number from {start} to {end}"))
    })
}

/// Writes a word with its options.
pub(super) fn write_word(
    f: &mut impl Write,
    head: impl Display,
    options: impl IntoIterator<Item = Option<String>>,
) -> fmt::Result {
    write!(f, "{head}")?;
    let mut separator = '(';
    for option in options.into_iter().flatten() {
        write!(f, "{separator}{option}")?;
        separator = ',';
    }
    f.write_str(if separator == ',' { ")" } else { "" })
}

/// A number in as few digits as tell it.
pub(super) struct Short<T>(pub(super) T);

impl<T: Copy + Display + LowerExp + Into<f64>> Display for Short<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value: f64 = self.0.into();
        let is_handy = value.is_infinite() || value == 0.0 || (1e-4..1e7).contains(&value);
        if is_handy { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

impl Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Budget(texels) => match texels.isqrt() {
                side if side * side == texels => write!(f, "{side}"),
                _ => write!(f, "{texels}texels"),
            },
            Self::Exact([width, height]) => write!(f, "{width}x{height}"),
            Self::MaxError(pixels) => write!(f, "{}px", Short(pixels)),
        }
    }
}
