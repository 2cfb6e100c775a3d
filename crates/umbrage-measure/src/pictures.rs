//! Writes the pictures of a comparison as files beside its report.

use crate::maps::luma;
use crate::{
    Error, ErrorScale, Image, Rgb, Spots, difference_map, error_map, grey, with_legend, write_png,
};
use std::path::Path;

/// Name of the file with the truth's shaded picture.
pub(crate) const TRUTH_COLOR: &str = "truth-color.png";

/// The images of one technique, all of the same size.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// The shaded picture.
    pub color: &'a Image<Rgb>,
    /// Visibility from 0 (in shadow) to 1 (lit).
    pub visibility: &'a Image<f32>,
    /// Pixels per texel on the surface; NaN where no map serves it.
    pub error_px: &'a Image<f32>,
    /// The picture by [`partition_map`](crate::partition_map), if wanted.
    pub partition: Option<&'a Image<Rgb>>,
    /// The picture by [`texel_map`](crate::texel_map), if wanted.
    pub texels: Option<&'a Image<Rgb>>,
}

/// The images of the ray-traced truth, all of the same size.
#[derive(Clone, Copy, Debug)]
pub struct SeenTruth<'a> {
    /// The shaded picture.
    pub color: &'a Image<Rgb>,
    /// Visibility from 0 (in shadow) to 1 (lit).
    pub visibility: &'a Image<f32>,
    /// Which pixels show a surface facing the light.
    pub counted: &'a Image<bool>,
}

/// Names of the PNG files of one technique (or of the truth), relative to the report's folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// The shaded picture.
    pub color: String,
    /// The visibility as 8-bit grey: 255 lit, 0 in shadow.
    pub visibility: String,
    /// The [`difference_map`]; `None` for the truth.
    pub difference: Option<String>,
    /// The [`error_map`]; `None` for the truth.
    pub error: Option<String>,
    /// The [`partition_map`](crate::partition_map), if there is one.
    pub partition: Option<String>,
    /// The [`texel_map`](crate::texel_map), if there is one.
    pub texels: Option<String>,
    /// Where the picture is wrong, by its brightness; `None` for the truth. Visibility would not
    /// do, because a wrong visibility hardly shows where light grazes a surface.
    pub spots: Option<Spots>,
}

/// Writes the truth's pictures into `folder`: `truth-color.png` and `truth-visibility.png`.
///
/// # Errors
/// The sizes differ, or a file cannot be written.
pub fn write_truth_pictures(
    folder: impl AsRef<Path>,
    truth: &SeenTruth<'_>,
) -> Result<Pictures, Error> {
    truth.color.check_like(truth.visibility, "picture")?;
    let folder = folder.as_ref();
    let pictures = Pictures {
        color: TRUTH_COLOR.to_owned(),
        visibility: "truth-visibility.png".to_owned(),
        ..Pictures::default()
    };
    write_png(folder.join(&pictures.color), truth.color)?;
    write_png(folder.join(&pictures.visibility), &truth.visibility.map(|&v| grey(v)))?;
    Ok(pictures)
}

/// Makes a technique's maps and writes all its pictures into `folder`, as
/// `<index>-<shadows>-<kind>.png` with an index from 1.
///
/// # Errors
/// The sizes differ, a visibility at a counted pixel is not finite, or a file cannot be written.
pub fn write_pictures(
    folder: impl AsRef<Path>,
    index: usize,
    shadows: &str,
    seen: &Seen<'_>,
    truth: &SeenTruth<'_>,
    scale: ErrorScale,
) -> Result<Pictures, Error> {
    let &Seen { color, visibility, error_px, .. } = seen;
    let counted = truth.counted;
    error_px.check_like(truth.visibility, "error")?;
    let difference = difference_map(truth.visibility, visibility, counted, truth.color)?;
    let error = with_legend(error_map(error_px, counted, truth.color, scale)?, scale);
    let others = [seen.partition, seen.texels].into_iter().flatten();
    others.chain([color]).try_for_each(|p| p.check_like(truth.visibility, "picture"))?;
    let brightness = |picture: &Image<Rgb>| picture.map(|&c| luma(c) / 255.0);
    let spots = Spots::measure(&brightness(truth.color), &brightness(color), counted)?;

    let name = |kind: &str| format!("{index:02}-{}-{kind}.png", file_stem(shadows));
    let write = |kind, image: &Image<Rgb>| {
        let name = name(kind);
        write_png(folder.as_ref().join(&name), image).map(|()| name)
    };
    let grey_name = name("visibility");
    write_png(folder.as_ref().join(&grey_name), &visibility.map(|&v| grey(v)))?;
    Ok(Pictures {
        color: write("color", color)?,
        visibility: grey_name,
        difference: Some(write("difference", &difference)?),
        error: Some(write("error", &error)?),
        partition: seen.partition.map(|p| write("partition", p)).transpose()?,
        texels: seen.texels.map(|t| write("texels", t)).transpose()?,
        spots: Some(spots),
    })
}

/// A shadow specification as a part of a file name that is valid on every system and in every URL.
fn file_stem(shadows: &str) -> String {
    let safe = |c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_';
    let dashed: String = shadows.chars().map(|c| if safe(c) { c } else { '-' }).collect();
    let parts: Vec<&str> = dashed.split('-').filter(|p| !p.is_empty()).collect();
    parts.join("-").chars().take(80).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_safe() {
        assert_eq!(file_stem("lispsm+z4:pcf5@2048"), "lispsm-z4-pcf5-2048");
        assert_eq!(file_stem("lambda=0.5:csm8(blur=7)"), "lambda-0.5-csm8-blur-7");
        assert_eq!(file_stem("../\"<x>é"), "..-x");
        assert_eq!(file_stem(&"x".repeat(300)).len(), 80);
    }
}
