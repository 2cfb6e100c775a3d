//! The language in which techniques are written: `WARP[+zK][+face][:FILTER][@TEXELS]`, or `none`.
//!
//! [`Technique`] parses and prints this language. Each word stands in one of four tables, with its
//! options and a sentence about each. The parser, the printer's tests, [`help`] and the
//! explanations in reports all use these tables.
//!
//! Two things help to write it, from the same tables. [`complete`] says what may stand at the
//! cursor of a text field. A panel of controls needs no state beside the text: [`written`] tells
//! what the text has in each [`Slot`], and [`with_word`] and [`with_option`] change it there. The
//! parser decides which changes are possible, so a panel can try them to know what to grey out.
//!
//! ```
//! use umbrage::language::{Slot, complete, with_option, with_word, written};
//!
//! assert_eq!(complete("adaptive:ms", 11)[0].text, "adaptive:msm");
//! let text = with_word("adaptive:vsm(blur=7)", Slot::Filter, Some("msm"))?;
//! let text = with_option(&text, Slot::Filter, "blur", Some("2px"))?;
//! assert_eq!(text, "adaptive:msm(blur=2px)");
//! assert_eq!(written(&text, Slot::Filter).unwrap().value_of("blur"), Some("2px"));
//! assert!(with_word("uniform(stable)", Slot::Faces, Some("face")).is_err());
//! # Ok::<(), umbrage::language::ParseError>(())
//! ```

pub use super::completion::{Completion, complete};
pub use super::edits::{Slot, with_option, with_word, written};
pub use super::scale::Scale;
use super::{Cover, Size, Technique, filters, layouts};
use crate::visibility::Filter;
use std::fmt::{self, Display, LowerExp, Write};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// The words of a technique's first part: how texels are spread and what they cover.
pub static WARPS: &[Word] = layouts::WARPS;
/// The words after a `+`: how the view is divided among maps.
pub static PARTITIONS: &[Word] = layouts::PARTITIONS;
/// The words after the `:`: how maps are looked up.
pub static FILTERS: &[Word] = filters::WORDS;
/// The forms after the `@`: how many texels there are.
pub static SIZES: &[Word] = &layouts::SIZES;

/// A word of the language, with its value and options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The word without its value: `pcf`.
    pub name: &'static str,
    /// Placeholder of the value that follows the name without a space: `N` in `pcfN`, `=NUMBER` in
    /// `lambda=NUMBER`. Empty for words without a value.
    pub value: &'static str,
    /// Numbers that a control offers for the value, one scale for each unit that it may have. Empty
    /// for words without one. Where the value is a pair or a list, they are for each of its
    /// numbers.
    pub scales: &'static [Scale],
    /// The word with a valid value: `pcf3`.
    pub example: &'static str,
    /// The options that may follow the word in parentheses, separated by commas.
    pub options: &'static [WordOption],
    /// The word's meaning in one sentence.
    pub meaning: &'static str,
}

/// An option of a [`Word`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WordOption {
    /// The option's name: `blur`.
    pub name: &'static str,
    /// Placeholder of the option's value: `WIDTH` in `blur=WIDTH`. Empty for options without a
    /// value.
    pub value: &'static str,
    /// Numbers that a control offers for the value, as for a [`Word`].
    pub scales: &'static [Scale],
    /// The option with a valid value: `blur=2px`.
    pub example: &'static str,
    /// The option's meaning in one sentence.
    pub meaning: &'static str,
}

/// The form in the language's tables: `pcfN`.
impl Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.name, self.value)
    }
}

/// The form in the language's tables: `blur=WIDTH`.
impl Display for WordOption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            "" => f.write_str(self.name),
            value => write!(f, "{}={value}", self.name),
        }
    }
}

/// Why a text is not a [`Technique`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}{}", did_you_mean(.suggestion.as_deref()))]
#[non_exhaustive]
pub struct ParseError {
    /// Which part of the text is wrong and why, on one line.
    pub problem: String,
    /// A correction: the nearest word of the language, or the given words in the right places.
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

/// The name among `names` that is most similar to `text`; empty if there are no names.
pub fn nearest<'a>(text: &str, names: impl IntoIterator<Item = &'a str>) -> &'a str {
    let text = text.to_lowercase();
    let distance = |name: &&str| strsim::damerau_levenshtein(name, &text);
    names.into_iter().min_by_key(distance).unwrap_or_default()
}

/// The whole language on one page of plain text, about 80 columns wide.
pub fn help() -> String {
    let mut page = String::from(
        "A technique is written WARP[+zK][+face][:FILTER][@TEXELS], as in\n\
         adaptive+z4:pcf3@2048, or is none.\n",
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
                let is_same = |known: &WordOption| {
                    (known.name, known.meaning) == (option.name, option.meaning)
                };
                let first = told.iter().find(|(known, _)| is_same(known)).map(|(_, word)| word);
                let meaning = first.map(|word| format!("As for {prefix}{word}."));
                let meaning = meaning.as_deref().unwrap_or(option.meaning);
                paragraph(&mut page, 6, &format!("({option})"), meaning);
                told.push((option, word));
            }
        }
    }
    page
}

/// Appends a term and its explanation, which begins at column 26 and is wrapped before column 80.
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

/// The meanings of the words in a technique's text: each word and option as written, with a
/// sentence about it. Empty if the text is not a technique.
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
    if let Some(warp) = parts.warp {
        add(Kind::Warp, warp);
    }
    parts.partitions.iter().for_each(|part| add(Kind::Partition, part));
    if let Some(filter) = parts.filter {
        add(Kind::Filter, filter);
    }
    if let Some(size) = parts.size {
        explained.push((format!("@{size}"), layouts::size_word(size).meaning));
    }
    explained
}

/// A technique's text, split into its parts.
pub(super) struct Parts<'a> {
    /// `None` if the text is the filter `none` alone.
    pub(super) warp: Option<&'a str>,
    pub(super) partitions: Vec<&'a str>,
    pub(super) filter: Option<&'a str>,
    pub(super) size: Option<&'a str>,
}

impl<'a> Parts<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        if text == filters::NONE {
            return Self { warp: None, partitions: Vec::new(), filter: Some(text), size: None };
        }
        let (head, size) = split_once(text, '@');
        let (layout, filter) = split_once(head, ':');
        let mut depth = 0;
        // A `+` within parentheses belongs to an exponent, as in `tsm(focus=1e+3)`.
        let mut parts = layout.split(move |c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            c == '+' && depth <= 0
        });
        let warp = Some(parts.next().unwrap_or_default());
        Self { warp, partitions: parts.collect(), filter, size }
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
        if warp == Some(filters::NONE) {
            let problem = format!("`{text}`: `none` has no maps, so nothing follows it");
            return Err(ParseError::new(problem).suggest(filters::NONE));
        }
        let default = Self::default();
        let (warp, cover) = warp.map_or(Ok((default.warp, default.cover)), layouts::read_warp)?;
        let default_size = Size::default_for(cover);
        Ok(Self {
            warp,
            cover,
            partition: layouts::read_partition(&partitions)?,
            filter: filter.map_or(Ok(default.filter), filters::read)?,
            size: size.map_or(Ok(default_size), layouts::read_size)?,
        })
    }
}

/// The text that parses to the same technique, without default values.
impl Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let default = Self::default();
        if *self == (Self { filter: Filter::None, ..default }) {
            return f.write_str(filters::NONE);
        }
        layouts::write_warp(f, self.warp, self.cover)?;
        layouts::write_partition(f, &self.partition)?;
        if self.filter != default.filter {
            write!(f, ":{}", self.filter)?;
        }
        if self.size != Size::default_for(self.cover) {
            write!(f, "@{}", self.size)?;
        }
        Ok(())
    }
}

impl Size {
    /// The size that need not be written.
    fn default_for(cover: Cover) -> Self {
        if matches!(cover, Cover::Paged { .. }) { Self::Needed } else { Technique::default().size }
    }
}

impl Technique {
    /// The part of the technique's text that an error is about, given the field that
    /// [`Error::Invalid`](crate::Error::Invalid) names; `None` for fields outside the technique.
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

/// A part of a technique's text, which selects a table of words.
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

    /// The prefix of the words in error messages.
    fn prefix(self) -> &'static str {
        if self == Self::Partition { "+" } else { "" }
    }
}

/// A word as written in a text, with its value and options, all found in the tables.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Written<'a> {
    /// The whole word, including its options.
    pub text: &'a str,
    /// The word in its table.
    pub word: &'static Word,
    /// The word's own value, without an `=`. A size is its own value.
    pub value: &'a str,
    /// The options with their values, which are empty for options without a value.
    pub options: Vec<(&'static WordOption, &'a str)>,
}

impl<'a> Written<'a> {
    /// Looks up a word of this kind and its options.
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
            // Some names end in a number, such as `evsm2`.
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

    /// A size, which has no options.
    pub(super) fn size(text: &'a str) -> Self {
        Self { text, word: layouts::size_word(text), value: text, options: Vec::new() }
    }

    /// Whether the option is given.
    pub(super) fn has(&self, name: &str) -> bool {
        self.value_of(name).is_some()
    }

    /// The value of the option of this name, if it is given; empty for options without a value.
    pub fn value_of(&self, name: &str) -> Option<&'a str> {
        self.options.iter().find(|(option, _)| option.name == name).map(|(_, value)| *value)
    }

    /// The option's value as a number, if the option is given. `must` describes valid values.
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

    /// The word's own value as a whole number.
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

/// Splits `name(options)` into both parts.
pub(super) fn split_options(text: &str) -> Result<(&str, Option<&str>), ParseError> {
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

/// Parses a whole number in a range. `prefix` is the text before it, for the error message.
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

/// Writes a word and its options.
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

/// A number that is printed with the fewest digits that identify it.
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
            // No text has it: it is what is meant where there is none.
            Self::Needed => f.write_str("needed"),
        }
    }
}
