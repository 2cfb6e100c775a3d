//! The legends inside pictures of errors and of clusters, for whoever sees the picture alone.

use crate::color::{LEVELS, color_at, level_scale, mix};
use crate::page::ticks;
use crate::{ErrorScale, Image, Rgb};
use font8x8::UnicodeFonts;

/// Size of a letter, and the unit of the legend's measures, before enlargement.
const LETTER: u32 = 8;
/// Length of the scale.
const SCALE: u32 = 240;
/// Size of the whole legend.
const SIZE: [u32; 2] = [SCALE + 2 * LETTER, 44];

/// A scale of colours with its meaning.
struct Legend {
    title: &'static str,
    /// The colour at a share of the scale's length.
    color: fn(f32) -> Rgb,
    /// Labels, each with its distance from the left end, percent of the scale.
    labels: Vec<(f32, String)>,
}

/// Draws the colours of `scale` with their meaning into the upper left corner of an error map.
/// Pictures that are smaller than two legends each way have no room, and stay as they are.
pub fn with_legend(picture: Image<Rgb>, scale: ErrorScale) -> Image<Rgb> {
    let labels = ticks(scale).into_iter().map(|tick| (tick.at, tick.label)).collect();
    let color = |share| color_at(share * 2.0 - 1.0);
    Legend { title: "pixels per texel", color, labels }.draw(picture)
}

/// Draws the colours of levels of detail into the upper left corner of a map of clusters, if there
/// is room for it as for [`with_legend`].
pub fn with_level_legend(picture: Image<Rgb>) -> Image<Rgb> {
    let label = |level: usize| ((level as f32 + 0.5) / LEVELS as f32 * 100.0, level.to_string());
    let labels = (0..LEVELS).step_by(3).map(label).collect();
    Legend { title: "level of detail, 0 the finest", color: level_scale, labels }.draw(picture)
}

impl Legend {
    fn draw(&self, mut picture: Image<Rgb>) -> Image<Rgb> {
        let size = picture.size();
        // The larger the picture, the smaller it is shown.
        let enlargement =
            (size[0] / 1000 + 1).min(size[0] / (2 * SIZE[0])).min(size[1] / (2 * SIZE[1]));
        if enlargement == 0 {
            return picture;
        }
        for y in 0..SIZE[1] * enlargement {
            for x in 0..SIZE[0] * enlargement {
                let below = picture.at_mut(x, y);
                *below = self.at([x / enlargement, y / enlargement], *below);
            }
        }
        picture
    }

    /// The colour of a point of the legend over what was there.
    fn at(&self, [x, y]: [u32; 2], below: Rgb) -> Rgb {
        const PAPER: Rgb = [16, 17, 20];
        const INK: Rgb = [255; 3];
        let along = x as i32 - LETTER as i32;
        let is_within = (0..SCALE as i32).contains(&along);
        let mut labels = self.labels.iter();
        let is_ink = match y {
            4..12 => is_lettered(self.title, along, y - 4),
            16..26 if is_within => return (self.color)(along as f32 / (SCALE - 1) as f32),
            26..29 => labels.any(|(at, _)| position(*at) == along),
            31..39 => labels.any(|(at, label)| {
                let width = label.len() as i32 * LETTER as i32;
                // Labels at the ends stay within the scale.
                let start = (position(*at) - width / 2).clamp(0, SCALE as i32 - width);
                is_lettered(label, along - start, y - 31)
            }),
            _ => false,
        };
        if is_ink { INK } else { mix(below, PAPER, 0.8) }
    }
}

/// Column of the scale, given in percent from its left end.
fn position(percent: f32) -> i32 {
    (percent / 100.0 * (SCALE - 1) as f32).round() as i32
}

/// Whether a text has ink in a column and a row of its letters.
fn is_lettered(text: &str, column: i32, row: u32) -> bool {
    let Ok(column) = usize::try_from(column) else { return false };
    let letter = text.chars().nth(column / LETTER as usize);
    let rows = letter.and_then(|letter| font8x8::BASIC_FONTS.get(letter));
    rows.is_some_and(|rows| rows[row as usize] >> (column % LETTER as usize) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LEVEL_COLORS;

    #[test]
    fn the_scale_lies_in_the_corner_and_nowhere_else() {
        let scale = ErrorScale::default();
        let grey = |size| Image::from_fn(size, |_, _| [90; 3]).unwrap();
        for (size, enlargement) in [([600, 100], 1), ([1920, 1080], 2)] {
            let picture = with_legend(grey(size), scale);
            let at = |x: u32, y: u32| *picture.at(x * enlargement, y * enlargement);
            assert_eq!(at(LETTER, 20), scale.color(1.0 / 32.0).unwrap());
            assert_eq!(at(LETTER + SCALE - 1, 20), scale.color(32.0).unwrap());
            let ink = (0..SIZE[0]).filter(|&x| (31..39).any(|y| at(x, y) == [255; 3])).count();
            assert!(ink > 40, "{ink} columns of labels");
            let outside = |i: &usize| {
                let [x, y] = picture.position(*i);
                x >= SIZE[0] * enlargement || y >= SIZE[1] * enlargement
            };
            let all = (0..picture.pixels().len()).filter(outside);
            assert!(all.map(|i| picture.pixels()[i]).all(|c| c == [90; 3]), "{size:?}");
        }
        let levels = with_level_legend(grey([600, 100]));
        for (level, color) in (0..).zip(LEVEL_COLORS.iter()) {
            assert_eq!(levels.at(LETTER + 15 * level + 7, 20), color, "level {level}");
        }
        // There is no room.
        for size in [[511, 400], [600, 87]] {
            assert_eq!(with_legend(grey(size), scale), grey(size));
        }
    }
}
