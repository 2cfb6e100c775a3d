//! Changes to a technique's text, for a panel whose controls are always in step with the text:
//! each control shows what the text says, and changes the text.

use super::language::{
    FILTERS, Kind, PARTITIONS, ParseError, Parts, SIZES, WARPS, Word, WordOption, Written,
    split_options,
};
use super::{Technique, layouts};

/// A place of a technique's text that one word fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    /// How texels are spread and what they cover.
    Warp,
    /// Slices along the view: `+zK`.
    Slices,
    /// Maps for the view's faces: `+face`.
    Faces,
    /// How maps are looked up.
    Filter,
    /// How many texels there are.
    Size,
}

impl Slot {
    /// All slots, in the order in which their words are written.
    pub const ALL: [Self; 5] = [Self::Warp, Self::Slices, Self::Faces, Self::Filter, Self::Size];

    /// The words that can fill the slot.
    pub fn words(self) -> &'static [Word] {
        let (slices, faces) = PARTITIONS.split_at(1);
        match self {
            Self::Warp => WARPS,
            Self::Slices => slices,
            Self::Faces => faces,
            Self::Filter => FILTERS,
            Self::Size => SIZES,
        }
    }

    /// What precedes the slot's word in a text.
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Warp => "",
            Self::Slices | Self::Faces => "+",
            Self::Filter => ":",
            Self::Size => "@",
        }
    }

    /// What a text without a word here means; `None` for no partition.
    fn default_text(self) -> Option<&'static str> {
        match self {
            Self::Warp => Some(layouts::DEFAULT_WARP),
            Self::Slices | Self::Faces => None,
            Self::Filter => Some("hard"),
            Self::Size => Some("1024"),
        }
    }

    pub(super) fn read(self, text: &str) -> Result<Written<'_>, ParseError> {
        let kind = match self {
            Self::Warp => Kind::Warp,
            Self::Slices | Self::Faces => Kind::Partition,
            Self::Filter => Kind::Filter,
            Self::Size => return Ok(Written::size(text)),
        };
        Written::read(text, kind)
    }
}

/// The word that fills a slot of a technique's text, or whose meaning the text has without it: no
/// filter is `hard`, and no size is `1024`. `None` if the text is no technique, or if it means no
/// word: no such partition, or the size of paged maps, which have what the view needs.
pub fn written(text: &str, slot: Slot) -> Option<Written<'_>> {
    slot.read(Texts::of(text).ok()?.word(slot)?).ok()
}

/// The text with another word in a slot, as in `with_word("lispsm:vsm", Slot::Filter,
/// Some("msm"))`; `None` takes the word away. The word has its value and may have options. Options
/// that the former word has are kept if they go with the new one.
///
/// # Errors
/// An error if `text` is not a technique, if the word is not one of the slot's, or if it cannot be
/// combined with the others.
pub fn with_word(text: &str, slot: Slot, word: Option<&str>) -> Result<String, ParseError> {
    let mut texts = Texts::of(text)?;
    let former = texts.0[slot as usize];
    texts.0[slot as usize] = None;
    let Some(word) = word else { return texts.with(slot, None) };
    if !slot.words().contains(slot.read(word)?.word) {
        return Err(ParseError::new(format!("`{word}` does not belong there")));
    }
    let (head, options) = split_options(word)?;
    let told = options.into_iter().flat_map(|options| options.split(','));
    let kept = former.and_then(|text| split_options(text).ok()?.1);
    let kept = kept.into_iter().flat_map(|options| options.split(','));
    let options = told.map(|o| (o, true)).chain(kept.map(|o| (o, false)));
    texts.with_options(slot, head, &options.collect::<Vec<_>>())
}

/// The text with an option of the word in a slot, as in `with_option("lispsm:vsm", Slot::Filter,
/// "blur", Some("2px"))`; `None` takes the option away. The value is empty for options without one.
/// Other options that exclude the new one are taken away, and what it needs is added.
///
/// # Errors
/// An error if `text` is not a technique or has no word in the slot, if the word has no such
/// option, or if the value is invalid or cannot be combined with the other words.
pub fn with_option(
    text: &str,
    slot: Slot,
    name: &str,
    value: Option<&str>,
) -> Result<String, ParseError> {
    let texts = Texts::of(text)?;
    let Some(word) = texts.word(slot) else {
        let problem = format!("`{text}` has no `{}{}`", slot.prefix(), slot.words()[0]);
        return Err(ParseError::new(problem));
    };
    let (head, options) = split_options(word)?;
    let new = value.map(|value| match value {
        "" => name.to_owned(),
        value => format!("{name}={value}"),
    });
    let is_it = |option: &str| option.split('=').next() == Some(name);
    let with = |new: Option<&str>| {
        let mut new = new;
        let mut all = Vec::new();
        for option in options.into_iter().flat_map(|options| options.split(',')) {
            match is_it(option) {
                // The new value stands where the former one did.
                true => all.extend(new.take().map(|new| (new, true))),
                false => all.push((option, false)),
            }
        }
        all.extend(new.map(|new| (new, true)));
        texts.with_options(slot, head, &all)
    };
    let result = with(new.as_deref());
    // Some options need another one, which the example has.
    let known = slot.read(word)?.word.options.iter().find(|o| o.name == name);
    match known.filter(|o| value == Some("") && o.value.is_empty() && o.example != name) {
        Some(option) => result.or_else(|error| with(Some(option.example)).map_err(|_| error)),
        None => result,
    }
}

impl Written<'_> {
    /// A valid value of one of the word's options, from which a control can start; empty for
    /// options without a value.
    pub fn example_of(&self, option: &WordOption) -> String {
        match self.value.parse() {
            Ok(slices) if option.name == "at" => layouts::example_distances(slices),
            _ if option.value.is_empty() => String::new(),
            _ => option.example.split_once('=').map_or("", |(_, value)| value).to_owned(),
        }
    }
}

/// The words of a technique's text with their options, by slot, without their prefixes.
#[derive(Clone, Copy)]
struct Texts<'a>([Option<&'a str>; 5]);

impl<'a> Texts<'a> {
    fn of(text: &'a str) -> Result<Self, ParseError> {
        text.parse::<Technique>()?;
        let parts = Parts::of(text);
        let is_slices = |part: &&str| part.starts_with(Slot::Slices.words()[0].name);
        let slices = parts.partitions.iter().copied().find(is_slices);
        let faces = parts.partitions.iter().copied().find(|part| !is_slices(part));
        Ok(Self([parts.warp, slices, faces, parts.filter, parts.size]))
    }

    /// The word in a slot, or the one that is meant where there is none.
    fn word(&self, slot: Slot) -> Option<&'a str> {
        let is_paged = self.0[Slot::Warp as usize].is_some_and(layouts::is_paged);
        let default = slot.default_text().filter(|_| slot != Slot::Size || !is_paged);
        self.0[slot as usize].or(default)
    }

    /// The text with this word in a slot, if that is a technique.
    fn with(&self, slot: Slot, word: Option<&str>) -> Result<String, ParseError> {
        let mut words = self.0;
        words[slot as usize] = word;
        let mut text = String::new();
        for slot in Slot::ALL {
            if let Some(word) = words[slot as usize] {
                text = text + slot.prefix() + word;
            } else if slot == Slot::Warp {
                text += layouts::DEFAULT_WARP;
            }
        }
        check(&text).map(|()| text)
    }

    /// The text with this word in a slot and those options that are required, and then of the
    /// others all that go with them.
    fn with_options(
        &self,
        slot: Slot,
        head: &str,
        options: &[(&str, bool)],
    ) -> Result<String, ParseError> {
        let mut taken: Vec<bool> = options.iter().map(|(_, is_required)| *is_required).collect();
        let joined = |taken: &[bool]| {
            let options = options.iter().zip(taken).filter(|(_, is_taken)| **is_taken);
            let options: Vec<&str> = options.map(|((option, _), _)| *option).collect();
            match options[..] {
                [] => self.with(slot, Some(head)),
                _ => self.with(slot, Some(&format!("{head}({})", options.join(",")))),
            }
        };
        if let Ok(text) = joined(&vec![true; options.len()]) {
            return Ok(text);
        }
        let mut text = joined(&taken)?;
        for i in 0..options.len() {
            if !std::mem::replace(&mut taken[i], true) {
                match joined(&taken) {
                    Ok(longer) => text = longer,
                    Err(_) => taken[i] = false,
                }
            }
        }
        Ok(text)
    }
}

/// Checks that a text is a technique that a planner takes.
pub(super) fn check(text: &str) -> Result<(), ParseError> {
    let technique: Technique = text.parse()?;
    technique.check().map_err(|error| {
        let crate::Error::Invalid { field, problem } = &error else {
            return ParseError::new(error.to_string());
        };
        match technique.part(field) {
            Some(part) => ParseError::new(format!("`{part}`: {problem}")),
            None => ParseError::new(error.to_string()),
        }
    })
}
