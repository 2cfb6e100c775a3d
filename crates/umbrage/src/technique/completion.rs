//! Words that may follow in a technique's text, while it is written.

use super::Technique;
use super::edits::{Slot, check};
use super::language::{FILTERS, Word, WordOption, explain, nearest};
use super::{filters, layouts};
use std::ops::Range;

/// A word or option that may stand at the cursor of an unfinished text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// The whole text with the word. It is a technique: values that are still to be written are
    /// those of examples.
    pub text: String,
    /// The bytes of `text` to select: the value that the writer will want to change, or the place
    /// behind the word, which is empty, if it has none.
    pub selected: Range<usize>,
    /// The word as the language's tables show it, with its prefix: `+zK`, `blur=WIDTH`.
    pub shown: String,
    /// Its meaning in one sentence.
    pub meaning: &'static str,
}

/// The words and options that may stand at the cursor (a byte of the text), those that are begun
/// there and those that may follow what stands before it. All fit the rest of the text, which they
/// leave as it is. If nothing begins like what is written there, the nearest word that fits.
pub fn complete(text: &str, cursor: usize) -> Vec<Completion> {
    let typing = Typing::at(text, cursor);
    let (begun, other): (Vec<Offer>, Vec<Offer>) =
        typing.instead().into_iter().partition(|offer| offer.is_begun);
    let is_begun = !begun.is_empty();
    let mut fitting = typing.fitting(begun);
    fitting.extend(typing.fitting(typing.following()));
    if is_begun || !fitting.is_empty() {
        return fitting;
    }
    let Err(error) = text.parse::<Technique>() else { return fitting };
    // Some words at the beginning stand for a whole technique, such as `cascades`.
    let is_all = typing.word == 0 && typing.end == text.len();
    if let Some(meant) = error.suggestion.filter(|meant| is_all && check(meant).is_ok()) {
        let meaning = explain(&meant).last().map_or("", |(_, meaning)| meaning);
        let selected = meant.len()..meant.len();
        return vec![Completion { shown: meant.clone(), text: meant, selected, meaning }];
    }
    let other = other.into_iter().filter_map(|offer| {
        let name = offer.name;
        typing.fitting([offer]).pop().map(|completion| (name, completion))
    });
    let mut other: Vec<(&str, Completion)> = other.collect();
    let meant = nearest(typing.typed, other.iter().map(|(name, _)| *name));
    other.retain(|(name, _)| *name == meant);
    other.into_iter().map(|(_, completion)| completion).collect()
}

/// A text at a cursor.
struct Typing<'a> {
    text: &'a str,
    cursor: usize,
    /// The slots whose words may stand at the cursor.
    slots: &'static [Slot],
    /// Where the word at the cursor begins.
    word: usize,
    /// Where the word's open parenthesis is, if the cursor is among its options.
    open: Option<usize>,
    /// What is being written, up to the cursor: the word, or one of its options.
    typed: &'a str,
    /// Where what is being written ends, at the cursor or behind it.
    end: usize,
    /// Whether the open parenthesis is closed behind the cursor.
    is_closed: bool,
}

/// A word or option that may stand at the cursor, if it fits.
struct Offer {
    /// The name that may have been begun.
    name: &'static str,
    is_begun: bool,
    /// The changes that write it, of which the first that fits is taken.
    ways: Vec<Change>,
    shown: String,
    meaning: &'static str,
}

/// A text in place of some bytes of another.
struct Change {
    replaced: Range<usize>,
    text: String,
    /// The part of the new text to select.
    selected: Range<usize>,
}

impl<'a> Typing<'a> {
    fn at(text: &'a str, cursor: usize) -> Self {
        let is_between = |&i: &usize| text.is_char_boundary(i);
        let cursor = (0..=cursor.min(text.len())).rev().find(is_between).unwrap_or_default();
        let (before, after) = text.split_at(cursor);
        let mut slots = &Slot::ALL[..1];
        let (mut word, mut start, mut open) = (0, 0, None);
        for (i, c) in before.char_indices() {
            // A `+` within parentheses belongs to an exponent.
            let following = match c {
                '+' if open.is_none() => &Slot::ALL[1..3],
                ':' if open.is_none() => &Slot::ALL[3..4],
                '@' if open.is_none() => &Slot::ALL[4..],
                _ => &[],
            };
            match c {
                '(' => (open, start) = (Some(i), i + 1),
                ',' if open.is_some() => start = i + 1,
                ')' => (open, start) = (None, word),
                _ if following.is_empty() => {}
                _ => (slots, word, start) = (following, i + 1, i + 1),
            }
        }
        let parenthesis = after.find(['(', ')']).map_or("", |i| &after[i..]);
        let is_closed = open.is_some() && parenthesis.starts_with(')');
        let ends: &[char] = match open {
            Some(_) if is_closed => &[',', ')'],
            // Without its `)` the list of options goes on to the next word.
            Some(_) => &[',', '+', ':', '@'],
            None => &['(', '+', ':', '@'],
        };
        let end = cursor + after.find(ends).unwrap_or(after.len());
        Self { text, cursor, slots, word, open, typed: &before[start..], end, is_closed }
    }

    /// The words or options that may stand in the place of what is being written.
    fn instead(&self) -> Vec<Offer> {
        let start = self.cursor - self.typed.len();
        if self.open.is_some() {
            return self.options(start..self.end, "");
        }
        let rest = &self.text[self.end..];
        let options = rest.starts_with('(').then(|| rest.find(')')).flatten().map_or(0, |i| i + 1);
        let offers = self.slots.iter().flat_map(|slot| slot.words().iter().map(|w| (w, *slot)));
        let mut offers: Vec<Offer> = offers
            .map(|(word, slot)| {
                // The former word's options stay, if this word has them too.
                let ends = [self.end, self.end + options];
                self.word(word, slot.prefix(), "", &ends.map(|end| start..end))
            })
            .collect();
        if self.slots == [Slot::Warp] {
            let place = start..self.end;
            // Whoever begins with a filter means it behind the usual warp.
            offers.extend(FILTERS.iter().filter_map(|word| {
                let before = match word.name == filters::NONE {
                    true => String::new(),
                    false if self.typed.is_empty() => return None,
                    false => format!("{}:", layouts::DEFAULT_WARP),
                };
                Some(self.word(word, &before, &before, std::slice::from_ref(&place)))
            }));
        }
        offers
    }

    /// The words and options that may follow what stands before the cursor.
    fn following(&self) -> Vec<Offer> {
        let cursor = self.cursor..self.cursor;
        if self.end != self.cursor {
            return Vec::new();
        }
        if self.open.is_some() {
            return self.options(cursor, ",");
        }
        let mut offers = Vec::new();
        if !self.text[self.word..self.cursor].ends_with(')') {
            offers = self.options(cursor.clone(), "(");
        }
        for slot in &Slot::ALL[1..] {
            let words = slot.words().iter();
            let here = std::slice::from_ref(&cursor);
            offers.extend(words.map(|w| self.word(w, slot.prefix(), slot.prefix(), here)));
        }
        offers
    }

    /// Offers a word in any of these places. `shown` precedes it where it is shown, and `before` in
    /// the text.
    fn word(&self, word: &Word, shown: &str, before: &str, places: &[Range<usize>]) -> Offer {
        let value = match word.value {
            "" if word.scales.is_empty() => 0,
            // The name of a size is that of its value.
            "" => word.example.len(),
            value => word.example.len() - word.name.len() - usize::from(value.starts_with('=')),
        };
        let text = format!("{before}{}", word.example);
        let selected = text.len() - value..text.len();
        let change = |place: &Range<usize>| Change {
            replaced: place.clone(),
            text: text.clone(),
            selected: selected.clone(),
        };
        Offer {
            name: word.name,
            is_begun: self.begins(word.name) || self.begins(word.example),
            ways: places.iter().map(change).collect(),
            shown: format!("{shown}{word}"),
            meaning: word.meaning,
        }
    }

    /// Offers the options of the word at the cursor in this place, behind this text.
    fn options(&self, place: Range<usize>, before: &str) -> Vec<Offer> {
        let head = &self.text[self.word..self.open.unwrap_or(self.cursor)];
        let Some(written) = self.slots.iter().find_map(|slot| slot.read(head).ok()) else {
            return Vec::new();
        };
        let close = if self.is_closed { "" } else { ")" };
        let change = |option: &str, value: usize| {
            let end = before.len() + option.len();
            let text = format!("{before}{option}{close}");
            Change { replaced: place.clone(), text, selected: end - value..end }
        };
        let offer = |option: &'static WordOption| {
            let value = written.example_of(option);
            let ways = match option.value {
                // The example of an option without a value may have what the option needs.
                "" => vec![change(option.name, 0), change(option.example, 0)],
                _ => vec![change(&format!("{}={value}", option.name), value.len())],
            };
            Offer {
                name: option.name,
                is_begun: self.begins(option.name) || self.begins(option.example),
                ways,
                shown: option.to_string(),
                meaning: option.meaning,
            }
        };
        written.word.options.iter().map(offer).collect()
    }

    fn begins(&self, name: &str) -> bool {
        let start = name.get(..self.typed.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(self.typed))
    }

    /// The offers that make a technique of the text, other than the text itself.
    fn fitting(&self, offers: impl IntoIterator<Item = Offer>) -> Vec<Completion> {
        let fits = |offer: Offer| {
            let Offer { ways, shown, meaning, .. } = offer;
            ways.into_iter().find_map(|Change { replaced, text, selected }| {
                let start = replaced.start;
                let mut whole = self.text.to_owned();
                whole.replace_range(replaced, &text);
                (whole != self.text && check(&whole).is_ok()).then(|| Completion {
                    text: whole,
                    selected: start + selected.start..start + selected.end,
                    shown: shown.clone(),
                    meaning,
                })
            })
        };
        offers.into_iter().filter_map(fits).collect()
    }
}
