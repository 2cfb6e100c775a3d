//! The editor of a technique: its text, and controls that change the text.

use super::controls::Tip;
use egui::text::{CCursor, CCursorRange};
use egui::{Align, ComboBox, Key, Modifiers, RichText, Slider, TextEdit, Ui};
use umbrage::language::{Completion, Scale, Slot, complete, with_option, with_word, written};
use umbrage_lab::NamedTechnique;

/// The text of a technique as it is being edited. The controls have no state of their own: they
/// show what the text says, and change it.
pub(super) struct Draft {
    pub(super) text: String,
    /// The last text that was a technique, which the controls show while the text is none.
    valid: String,
    /// The completion that is chosen in the list, if the list is shown.
    chosen: Option<usize>,
}

impl Draft {
    pub(super) fn new(text: &str) -> Self {
        Self { text: text.to_owned(), valid: text.to_owned(), chosen: None }
    }

    /// Shows the editor. Gives the text of a technique if it changed to one.
    pub(super) fn show(&mut self, ui: &mut Ui, id: &str) -> Option<String> {
        let before = self.text.clone();
        ui.push_id(id, |ui| {
            self.text_field(ui);
            let problem = self.text.parse::<NamedTechnique>().err();
            match &problem {
                Some(problem) => {
                    let color = ui.visuals().error_fg_color;
                    ui.label(RichText::new(problem.to_string()).color(color));
                }
                None => self.valid.clone_from(&self.text),
            }
            ui.add_enabled_ui(problem.is_none(), |ui| self.controls(ui));
        });
        let is_technique = self.text.parse::<NamedTechnique>().is_ok();
        (self.text != before && is_technique).then(|| self.text.clone())
    }

    fn text_field(&mut self, ui: &mut Ui) {
        let id = ui.scope_id().with("text");
        // While the list is open, these keys belong to it and not to the field.
        let mut step = 0;
        let mut is_accepted = false;
        if let Some(chosen) = self.chosen.filter(|_| ui.memory(|m| m.has_focus(id))) {
            ui.input_mut(|input| {
                if input.consume_key(Modifiers::NONE, Key::ArrowDown) {
                    step = 1;
                }
                if input.consume_key(Modifiers::NONE, Key::ArrowUp) && chosen > 0 {
                    step = -1;
                }
                is_accepted = input.consume_key(Modifiers::NONE, Key::Enter)
                    || input.consume_key(Modifiers::CTRL, Key::Space);
            });
        }
        let field = TextEdit::singleline(&mut self.text)
            .id(id)
            .font(egui::TextStyle::Monospace)
            .desired_width(f32::INFINITY)
            .hint_text("WARP[+zK][+face][:FILTER][@TEXELS]");
        let output = field.show(ui);
        let response = output.response.response.clone().tip(
            "The technique as a text, as the command line takes it; type to see what may follow.",
        );
        if response.changed() {
            self.chosen = Some(0);
        }
        if !response.has_focus() && !ui.memory(|m| m.had_focus_last_frame(id)) {
            self.chosen = None;
        }
        let Some(chosen) = self.chosen else { return };
        let cursor = output.cursor_range.map_or(self.text.len(), |range| {
            let chars = range.primary.index;
            self.text.char_indices().nth(chars.into()).map_or(self.text.len(), |(i, _)| i)
        });
        let offers = complete(&self.text, cursor);
        if offers.is_empty() {
            return;
        }
        let chosen = chosen.saturating_add_signed(step).min(offers.len() - 1);
        self.chosen = Some(chosen);
        let mut accepted = is_accepted.then_some(chosen);
        egui::Popup::from_response(&response)
            .open(true)
            .width(response.rect.width().max(280.0))
            .show(|ui| {
                egui::ScrollArea::vertical().max_height(220.0).show(ui, |ui| {
                    for (i, offer) in offers.iter().enumerate() {
                        let text = RichText::new(&offer.shown).monospace();
                        let row = ui.selectable_label(i == chosen, text).tip(offer.meaning);
                        if i == chosen {
                            ui.label(RichText::new(offer.meaning).small().weak());
                            if step != 0 {
                                row.scroll_to_me(Some(Align::Center));
                            }
                        }
                        if row.clicked() {
                            accepted = Some(i);
                        }
                    }
                });
            });
        if let Some(offer) = accepted.and_then(|i| offers.get(i)) {
            self.accept(ui, id, offer);
        }
        if ui.input(|i| i.key_pressed(Key::Escape)) {
            self.chosen = None;
        }
    }

    /// Takes a completion, and selects the value in it that is to be written.
    fn accept(&mut self, ui: &Ui, id: egui::Id, offer: &Completion) {
        let chars = |byte: usize| CCursor::new(offer.text[..byte].chars().count());
        let range = CCursorRange::two(chars(offer.selected.start), chars(offer.selected.end));
        self.text.clone_from(&offer.text);
        self.chosen = None;
        if let Some(mut state) = TextEdit::load_state(ui.ctx(), id) {
            state.cursor.set_char_range(Some(range));
            state.store(ui.ctx(), id);
        }
        ui.memory_mut(|memory| memory.request_focus(id));
    }

    /// A box or slider for each word of the text, and for its options.
    fn controls(&mut self, ui: &mut Ui) {
        for (slot, name) in [
            (Slot::Warp, "warp"),
            (Slot::Slices, "slices"),
            (Slot::Faces, "faces"),
            (Slot::Filter, "filter"),
            (Slot::Size, "size"),
        ] {
            ui.push_id(name, |ui| self.slot(ui, slot, name));
        }
    }

    fn slot(&mut self, ui: &mut Ui, slot: Slot, name: &str) {
        let text = self.valid.clone();
        let current = written(&text, slot);
        let (nothing, no_meaning, no_tip) = match slot {
            Slot::Size => ("as needed", "As many pages as the view needs.", "No limit."),
            _ => ("one map", "No maps for parts of the view.", "No such parts."),
        };
        let shown = current.as_ref().map_or(nothing.to_owned(), |w| w.word.to_string());
        ui.horizontal(|ui| {
            ui.label(name);
            let meaning = current.as_ref().map_or(no_meaning, |w| w.word.meaning);
            ComboBox::from_id_salt(name)
                .selected_text(RichText::new(shown).monospace())
                .width(120.0)
                .show_ui(ui, |ui| {
                    let without = with_word(&text, slot, None);
                    let may_be_left_out = match slot {
                        Slot::Slices | Slot::Faces => true,
                        // Other maps than pages then have the size that need not be written.
                        Slot::Size => {
                            without.as_ref().is_ok_and(|text| written(text, slot).is_none())
                        }
                        Slot::Warp | Slot::Filter => false,
                    };
                    if may_be_left_out
                        && ui.selectable_label(current.is_none(), nothing).tip(no_tip).clicked()
                    {
                        self.try_change(without);
                    }
                    for word in slot.words() {
                        let is_current = current.as_ref().is_some_and(|w| w.word.name == word.name);
                        let changed = with_word(&text, slot, Some(word.example));
                        let button = egui::Button::selectable(
                            is_current,
                            RichText::new(word.to_string()).monospace(),
                        );
                        let reason = changed.as_ref().err().map(ToString::to_string);
                        let row = ui.add_enabled(changed.is_ok(), button);
                        let row = match reason {
                            Some(reason) => row.on_disabled_hover_text(reason),
                            None => row,
                        };
                        if row.tip(word.meaning).clicked() && !is_current {
                            self.try_change(changed);
                        }
                    }
                })
                .response
                .tip(meaning);
        });
        let Some(current) = current else { return };
        ui.indent("options", |ui| {
            if let Some(scale) = scale_of(current.word.scales, current.value) {
                let label = current.word.value.trim_matches(['=', '@']).to_lowercase();
                let value = number(ui, &label, scale, current.value, current.word.meaning);
                if let Some(value) = value {
                    let word = match (slot, current.word.value.starts_with('=')) {
                        (Slot::Size, _) => value,
                        (_, true) => format!("{}={value}", current.word.name),
                        (_, false) => format!("{}{value}", current.word.name),
                    };
                    self.try_change(with_word(&text, slot, Some(&word)));
                }
            }
            for option in current.word.options {
                let given = current.value_of(option.name);
                let mut is_on = given.is_some();
                let example = current.example_of(option);
                let with = |value: Option<&str>| with_option(&text, slot, option.name, value);
                let turned = with(if is_on { None } else { Some(&example) });
                ui.horizontal(|ui| {
                    let check = egui::Checkbox::new(&mut is_on, option.name);
                    let row = ui.add_enabled(turned.is_ok(), check);
                    let row = match &turned {
                        Err(reason) => row.on_disabled_hover_text(reason.to_string()),
                        Ok(_) => row,
                    };
                    if row.tip(option.meaning).changed() {
                        self.try_change(turned);
                    }
                    let Some(value) = given.filter(|value| !value.is_empty()) else { return };
                    if let Some(scale) = scale_of(option.scales, value) {
                        if let Some(new) = number(ui, "", scale, value, option.meaning) {
                            self.try_change(with(Some(&new)));
                        }
                    } else {
                        ui.monospace(value);
                    }
                });
            }
        });
    }

    fn try_change(&mut self, changed: Result<String, umbrage::language::ParseError>) {
        if let Ok(text) = changed {
            self.text = text;
        }
    }
}

/// The scale whose unit a value has.
fn scale_of<'s>(scales: &'s [Scale], value: &str) -> Option<&'s Scale> {
    // Every number has the unit that is empty, so a scale with a unit goes first.
    let mut fitting: Vec<&Scale> = scales.iter().filter(|s| s.number(value).is_some()).collect();
    fitting.sort_by_key(|s| std::cmp::Reverse(s.unit.len()));
    fitting.first().copied()
}

/// A slider for a value. Gives the new value as a text if it changed.
fn number(ui: &mut Ui, label: &str, scale: &Scale, value: &str, tip: &str) -> Option<String> {
    let mut number = scale.number(value)?;
    let is_whole = scale.step >= 1.0;
    let slider = Slider::new(&mut number, scale.min..=scale.max)
        .logarithmic(scale.is_logarithmic)
        .clamping(egui::SliderClamping::Never)
        .step_by(if is_whole { 1.0 } else { 0.0 })
        .max_decimals(if is_whole { 0 } else { 3 })
        .suffix(scale.unit)
        .text(label);
    let is_changed = ui.add(slider).tip(tip).changed();
    is_changed.then(|| scale.text(number)).filter(|new| new != value)
}
