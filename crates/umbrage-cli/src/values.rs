//! Values that users give: checked numbers, vectors, sizes, from the command line as text.

use crate::args::Share;
use anyhow::{Result, anyhow, bail, ensure};
use glam::DVec3;

/// The longest side of a picture, pixels.
const MAX_PICTURE_SIDE: u32 = 16384;
/// The most pixels of a picture: 8192², with which five techniques take some 8 GB to compare.
const MAX_PICTURE_PIXELS: u64 = 1 << 26;

/// Three numbers with commas between them.
pub(crate) fn vector(text: &str) -> Result<DVec3> {
    let numbers: Vec<f64> = text.split(',').map_while(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.matches(',').count() == 2 && !text.to_lowercase().contains("nan") => {
            position([x, y, z])
        }
        _ => bail!("must be three finite numbers x,y,z without spaces, as in 0,1.5,-4"),
    }
}

/// A vector with a length, from three numbers with commas between them.
pub(crate) fn direction(text: &str) -> Result<DVec3> {
    pointing(vector(text)?.to_array())
}

/// A number above zero.
pub(crate) fn distance(text: &str) -> Result<f64> {
    metres(text.parse().unwrap_or(f64::NAN))
}

/// An error in pixels per texel.
pub(crate) fn pixels_per_texel(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(p) if p > 0.0 && p <= 1e12 => Ok(p),
        _ => bail!("must be a positive number of pixels per texel, as in 1"),
    }
}

/// An angle in degrees that a picture can have.
pub(crate) fn field_of_view(text: &str) -> Result<f64> {
    opening(text.parse().unwrap_or(f64::NAN))
}

/// Width and height of a picture, pixels.
pub(crate) fn picture_size(text: &str) -> Result<[u32; 2]> {
    // A side that is no number is as wrong as one of no pixels.
    let side = |n: &str| n.parse().unwrap_or(0);
    pixels(text.split_once('x').map_or([0; 2], |(w, h)| [side(w), side(h)]))
}

/// Which of how many equal shares.
pub(crate) fn share(text: &str) -> Result<Share> {
    let share = text.split_once('/').and_then(|(index, count)| {
        Some(Share { index: index.parse().ok()?, count: count.parse().ok()? })
    });
    share
        .filter(|s| (1..=s.count).contains(&s.index))
        .ok_or_else(|| anyhow!("must be I/N with 1 ≤ I ≤ N, as in 2/8"))
}

/// A place in a world, metres.
pub(crate) fn position(v: [f64; 3]) -> Result<DVec3> {
    let v = DVec3::from(v);
    ensure!(v.is_finite() && v.abs().max_element() <= 1e12, "must be within 1e12 of the origin");
    Ok(v)
}

/// A direction, of any length.
pub(crate) fn pointing(v: [f64; 3]) -> Result<DVec3> {
    let v = position(v)?;
    ensure!(v != DVec3::ZERO, "must point somewhere, as in -0.5,-1,-0.3");
    Ok(v)
}

/// A distance, metres.
pub(crate) fn metres(d: f64) -> Result<f64> {
    ensure!(d > 0.0 && d <= 1e12, "must be a positive number of metres, at most 1e12, as in 0.1");
    Ok(d)
}

/// A picture's angle, degrees.
pub(crate) fn opening(degrees: f64) -> Result<f64> {
    ensure!((0.01..=179.0).contains(&degrees), "must be an angle of 0.01 to 179 degrees, as in 60");
    Ok(degrees)
}

/// A picture's width and height, pixels.
pub(crate) fn pixels(size: [u32; 2]) -> Result<[u32; 2]> {
    ensure!(
        size.iter().all(|n| (1..=MAX_PICTURE_SIDE).contains(n)),
        "must be WIDTHxHEIGHT of 1 to {MAX_PICTURE_SIDE} pixels each, as in 960x540"
    );
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    ensure!(
        pixels <= MAX_PICTURE_PIXELS,
        "must be at most {MAX_PICTURE_PIXELS} pixels, is {pixels}"
    );
    Ok(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_values() {
        assert_eq!(vector("-1,2.5,1e3").unwrap(), DVec3::new(-1.0, 2.5, 1e3));
        assert_eq!(distance("0.25").unwrap(), 0.25);
        assert_eq!(pixels_per_texel("1.5").unwrap(), 1.5);
        assert_eq!(field_of_view("60").unwrap(), 60.0);
        assert_eq!(picture_size("960x540").unwrap(), [960, 540]);
        assert_eq!(share("8/8").unwrap(), Share { index: 8, count: 8 });
    }

    #[test]
    fn bad_values() {
        for text in [
            "", "1", "1,2", "1,2,3,4", "1,2,x", "1,,2", "nan,0,0", "inf,0,0", "1e13,0,0", "a,1,2,3",
        ] {
            assert!(vector(text).is_err(), "{text}");
        }
        assert!(direction("0,0,0").is_err());
        for text in ["", "0", "-1", "nan", "inf", "1e13", "1m"] {
            assert!(distance(text).is_err(), "{text}");
            assert!(pixels_per_texel(text).is_err(), "{text}");
        }
        for text in ["", "0", "180", "-60", "nan"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        for text in
            ["", "x", "100", "0x100", "100x0", "16385x1", "16384x8192", "-1x5", "1x2x3", "1.5x2"]
        {
            assert!(picture_size(text).is_err(), "{text}");
        }
        for text in ["", "/", "1", "0/1", "2/1", "1/0", "-1/2", "1/2/3", "a/b", "1/99999999999"] {
            assert!(share(text).is_err(), "{text}");
        }
    }
}
