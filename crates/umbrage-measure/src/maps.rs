//! Pictures made of measurements: where visibility is wrong, how large the error is, which map
//! serves a pixel, where texels lie, and which clusters of triangles are drawn.

use crate::color::{FALSE_LIGHT, FALSE_SHADOW, PARTITIONS, cluster_color, mix};
use crate::metrics::check_visibilities;
use crate::{Error, ErrorScale, Image, Rgb};

/// 8-bit grey for a visibility from 0 (in shadow, black) to 1 (lit, white). Values outside are
/// clamped, and NaN is black.
pub fn grey(visibility: f32) -> u8 {
    (visibility.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// The difference between truth and technique, over the dimmed `picture`: [`FALSE_LIGHT`] where the
/// technique is lighter than the truth, [`FALSE_SHADOW`] where it is darker. The opacity is the
/// difference. Pixels that are not counted are dimmed further.
///
/// # Errors
/// The sizes differ, or a visibility at a counted pixel is not finite.
pub fn difference_map(
    truth: &Image<f32>,
    technique: &Image<f32>,
    counted: &Image<bool>,
    picture: &Image<Rgb>,
) -> Result<Image<Rgb>, Error> {
    check_visibilities(truth, technique, counted)?;
    picture.check_like(truth, "picture")?;
    Image::from_fn(truth.size(), |x, y| {
        let below = dimmed(*picture.at(x, y), *counted.at(x, y));
        if !counted.at(x, y) {
            return below;
        }
        let difference = technique.at(x, y).clamp(0.0, 1.0) - truth.at(x, y).clamp(0.0, 1.0);
        mix(below, if difference > 0.0 { FALSE_LIGHT } else { FALSE_SHADOW }, difference.abs())
    })
}

/// Errors in pixels per texel, in the colours of `scale`. Pixels that are not counted show the
/// dimmed `picture`. Counted pixels whose error is NaN, because no map serves them, are hatched.
///
/// # Errors
/// The sizes differ.
pub fn error_map(
    error_px: &Image<f32>,
    counted: &Image<bool>,
    picture: &Image<Rgb>,
    scale: ErrorScale,
) -> Result<Image<Rgb>, Error> {
    counted.check_like(error_px, "mask of counted pixels")?;
    picture.check_like(error_px, "picture")?;
    Image::from_fn(error_px.size(), |x, y| {
        if !counted.at(x, y) {
            return dimmed(*picture.at(x, y), false);
        }
        let hatch = if (x + y) / 3 % 2 == 0 { [90; 3] } else { [160; 3] };
        scale.color(*error_px.at(x, y)).unwrap_or(hatch)
    })
}

/// The noise of each pixel, over the dimmed `picture`: [`FALSE_LIGHT`] with an opacity of four
/// times the noise, so that a pixel which changes by a quarter from frame to frame is opaque.
/// Pixels whose noise is NaN are dimmed further.
///
/// # Errors
/// The sizes differ.
pub fn noise_map(noise: &Image<f32>, picture: &Image<Rgb>) -> Result<Image<Rgb>, Error> {
    picture.check_like(noise, "picture")?;
    Image::from_fn(noise.size(), |x, y| {
        let noise = *noise.at(x, y);
        let below = dimmed(*picture.at(x, y), !noise.is_nan());
        if noise.is_nan() { below } else { mix(below, FALSE_LIGHT, 4.0 * noise) }
    })
}

/// The map that serves each pixel: the dimmed `picture`, tinted by the colour in [`PARTITIONS`] of
/// the map's index in its plan. The colours repeat. Pixels with `None`, which no map serves, are
/// only dimmed.
///
/// # Errors
/// The sizes differ.
pub fn partition_map(
    map_index: &Image<Option<u16>>,
    picture: &Image<Rgb>,
) -> Result<Image<Rgb>, Error> {
    picture.check_like(map_index, "picture")?;
    Image::from_fn(map_index.size(), |x, y| {
        let color = map_index.at(x, y).map(|i| PARTITIONS[usize::from(i) % PARTITIONS.len()]);
        tinted(*picture.at(x, y), color)
    })
}

/// The page that serves each pixel: the dimmed `picture`, tinted by the colour in [`PARTITIONS`] of
/// the page's level, with dark borders of pages. A pixel has the number of its level and something
/// that tells its page from others; pixels with `None`, which no page serves, are only dimmed.
///
/// # Errors
/// The sizes differ.
pub fn page_map<P: PartialEq>(
    pages: &Image<Option<(u16, P)>>,
    picture: &Image<Rgb>,
) -> Result<Image<Rgb>, Error> {
    picture.check_like(pages, "picture")?;
    let [width, height] = pages.size();
    Image::from_fn(pages.size(), |x, y| {
        let page = pages.at(x, y);
        let color = page.as_ref().map(|(i, _)| PARTITIONS[usize::from(*i) % PARTITIONS.len()]);
        let tint = tinted(*picture.at(x, y), color);
        // Where the sky begins is no border of a page.
        let differs = |x: u32, y: u32| {
            let other = (x < width && y < height).then(|| pages.at(x, y));
            other.is_some_and(|other| other.is_some() && other != page)
        };
        let is_border = page.is_some() && (differs(x + 1, y) || differs(x, y + 1));
        if is_border { mix(tint, [0; 3], 0.75) } else { tint }
    })
}

/// The cluster of triangles that each pixel shows, by its number and its level of detail: the
/// `picture`, tinted by [`cluster_color`]. Pixels with `None`, which show the sky, are only dimmed.
///
/// # Errors
/// The sizes differ.
pub fn cluster_map(
    clusters: &Image<Option<[u32; 2]>>,
    picture: &Image<Rgb>,
) -> Result<Image<Rgb>, Error> {
    picture.check_like(clusters, "picture")?;
    Image::from_fn(clusters.size(), |x, y| {
        let color = clusters.at(x, y).map(|[number, level]| cluster_color(number, level));
        tinted(*picture.at(x, y), color)
    })
}

/// A tint with the lightness of the picture below, so that the shading stays visible; without a
/// tint the picture is dimmed.
fn tinted(below: Rgb, tint: Option<Rgb>) -> Rgb {
    match tint {
        Some(tint) => mix([0; 3], tint, 0.25 + 0.75 * luma(below) / 255.0),
        None => dimmed(below, false),
    }
}

/// The texels of a map as they lie on the surfaces: a line every 5 texels over the `picture` (Lloyd
/// et al. 2006, Fig. 15). `texel` is the (s, t) of each pixel times the resolution of the map, or
/// NaN where no map serves the pixel. Lines that would be too dense to see fade into a uniform
/// tint.
///
/// # Errors
/// The sizes differ.
pub fn texel_map(texel: &Image<[f32; 2]>, picture: &Image<Rgb>) -> Result<Image<Rgb>, Error> {
    const PERIOD: f32 = 5.0;
    const LINE: Rgb = FALSE_LIGHT;
    /// Width of a line, pixels.
    const WIDTH: f32 = 1.2;
    /// Density in lines per pixel at which lines begin to fade, and at which they have vanished.
    const FADE: [f32; 2] = [1.0 / 6.0, 1.0 / 3.0];
    /// Opacity of the tint that replaces them.
    const TINT: f32 = 0.3;
    picture.check_like(texel, "picture")?;
    Image::from_fn(texel.size(), |x, y| {
        let here = *texel.at(x, y);
        if here.iter().any(|c| !c.is_finite()) {
            return dimmed(*picture.at(x, y), false);
        }
        let below = mix([0; 3], *picture.at(x, y), 0.6);
        let cover = (0..2).map(|axis| {
            let per_pixel = gradient(texel, x, y, axis) / PERIOD;
            let phase = here[axis] / PERIOD;
            let from_line_px = (phase - phase.round()).abs() / per_pixel.max(1e-6);
            let line = (WIDTH / 2.0 + 0.5 - from_line_px).clamp(0.0, 1.0);
            let fade = ((per_pixel - FADE[0]) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
            line + (TINT - line) * fade
        });
        mix(below, LINE, cover.fold(0.0, f32::max))
    })
}

/// Change of coordinate `axis` from pixel to pixel. Of the two neighbours on either side, the one
/// that differs less counts, because the other may lie on another surface.
fn gradient(texel: &Image<[f32; 2]>, x: u32, y: u32, axis: usize) -> f32 {
    let [w, h] = texel.size();
    let here = texel.at(x, y)[axis];
    let step = |x: Option<u32>, y: Option<u32>| match (x, y) {
        (Some(x), Some(y)) if x < w && y < h => (texel.at(x, y)[axis] - here).abs(),
        _ => f32::NAN,
    };
    // `min` ignores NaN.
    let dx = step(x.checked_sub(1), Some(y)).min(step(Some(x + 1), Some(y)));
    let dy = step(Some(x), y.checked_sub(1)).min(step(Some(x), Some(y + 1)));
    let known = |d: f32| if d.is_nan() { 0.0 } else { d };
    known(dx).hypot(known(dy))
}

/// A darker grey, on which colours stand out.
fn dimmed(color: Rgb, counted: bool) -> Rgb {
    let strength = if counted { 0.4 } else { 0.2 };
    [(luma(color) * strength + 14.0) as u8; 3]
}

/// Rec. 709 luma of sRGB values, 0 ..= 255.
pub(crate) fn luma([r, g, b]: Rgb) -> f32 {
    0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LEVEL_COLORS;

    fn image<T: Clone>(size: [u32; 2], pixels: &[T]) -> Image<T> {
        Image::new(size, pixels.to_vec()).unwrap()
    }

    #[test]
    fn difference_tells_light_from_shadow() {
        let truth = image([4, 1], &[0.0, 1.0, 1.0, 0.0]);
        let technique = image([4, 1], &[1.0, 0.0, 1.0, f32::NAN]);
        let counted = image([4, 1], &[true, true, true, false]);
        let picture = image([4, 1], &[[200; 3]; 4]);
        let map = difference_map(&truth, &technique, &counted, &picture).unwrap();
        assert_eq!(map.pixels(), [FALSE_LIGHT, FALSE_SHADOW, [94; 3], [54; 3]]);
    }

    #[test]
    fn error_map_keeps_what_is_not_measured_apart() {
        let error = image([4, 1], &[1.0, 8.0, f32::NAN, 8.0]);
        let counted = image([4, 1], &[true, true, true, false]);
        let picture = image([4, 1], &[[200; 3]; 4]);
        let scale = ErrorScale::default();
        let map = error_map(&error, &counted, &picture, scale).unwrap();
        let expected = [scale.color(1.0).unwrap(), scale.color(8.0).unwrap(), [90; 3], [54; 3]];
        assert_eq!(map.pixels(), expected);
        assert!(error_map(&error, &image([1, 1], &[true]), &picture, scale).is_err());
    }

    #[test]
    fn partitions_repeat_and_gaps_stay_grey() {
        let index = image([3, 1], &[Some(0), Some(PARTITIONS.len() as u16), None]);
        let map = partition_map(&index, &image([3, 1], &[[255; 3]; 3])).unwrap();
        assert_eq!(map.pixels(), [PARTITIONS[0], PARTITIONS[0], [65; 3]]);
    }

    #[test]
    fn pages_have_borders_and_the_colours_of_their_levels() {
        let pages = [Some((0, 'a')), Some((0, 'a')), Some((0, 'b')), Some((1, 'b')), None];
        let map = page_map(&image([5, 1], &pages), &image([5, 1], &[[255; 3]; 5])).unwrap();
        let dark = |color: Rgb| mix(color, [0; 3], 0.75);
        let [first, second] = [PARTITIONS[0], PARTITIONS[1]];
        assert_eq!(map.pixels(), [first, dark(first), dark(first), second, [65; 3]]);
    }

    #[test]
    fn clusters_have_the_colours_of_their_levels() {
        let clusters = image([3, 1], &[Some([0, 2]), Some([7, 2]), None]);
        let map = cluster_map(&clusters, &image([3, 1], &[[255; 3]; 3])).unwrap();
        assert_eq!(map.pixels(), [LEVEL_COLORS[2], cluster_color(7, 2), [65; 3]]);
    }

    #[test]
    fn texel_lines_come_every_five() {
        // A column of pixels is a tenth of a texel wide: there is a line every 50 columns, and none
        // along t.
        let texel = Image::from_fn([200, 8], |x, _| [x as f32 * 0.1, 2.5]).unwrap();
        let picture = texel.map(|_| [0, 0, 0]);
        let map = texel_map(&texel, &picture).unwrap();
        let lines: Vec<u32> = (0..200).filter(|&x| *map.at(x, 4) == FALSE_LIGHT).collect();
        assert_eq!(lines, [0, 50, 100, 150]);
        // With 20 texels per pixel no lines can be seen, and the tint is uniform.
        let dense = Image::from_fn([50, 8], |x, _| [x as f32 * 20.3, 2.5]).unwrap();
        let map = texel_map(&dense, &dense.map(|_| [0, 0, 0])).unwrap();
        assert!(map.pixels().iter().all(|c| c == map.at(0, 0)));
        // Where no map serves a pixel, the picture is only dimmed.
        let none = image([2, 2], &[[f32::NAN; 2]; 4]);
        let map = texel_map(&none, &none.map(|_| [255; 3])).unwrap();
        assert_eq!(map.pixels(), [[65; 3]; 4]);
    }
}
