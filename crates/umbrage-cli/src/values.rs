//! Values on the command line: text to checked numbers, vectors, sizes.

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
        [x, y, z] if text.matches(',').count() == 2 => {
            let v = DVec3::new(x, y, z);
            ensure!(
                v.is_finite() && v.abs().max_element() <= 1e12,
                "must be within 1e12 of the origin"
            );
            Ok(v)
        }
        _ => bail!("must be three numbers x,y,z without spaces, as in 0,1.5,-4"),
    }
}

/// A vector with a length.
pub(crate) fn direction(text: &str) -> Result<DVec3> {
    let v = vector(text)?;
    ensure!(v != DVec3::ZERO, "must point somewhere, as in -0.5,-1,-0.3");
    Ok(v)
}

/// A number above zero.
pub(crate) fn distance(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(d) if d > 0.0 && d <= 1e12 => Ok(d),
        _ => bail!("must be a positive number of metres, at most 1e12, as in 0.1"),
    }
}

/// An angle in degrees that a picture can have.
pub(crate) fn field_of_view(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(degrees) if (0.01..=179.0).contains(&degrees) => Ok(degrees),
        _ => bail!("must be an angle of 0.01 to 179 degrees, as in 60"),
    }
}

/// Width and height of a picture, pixels.
pub(crate) fn picture_size(text: &str) -> Result<[u32; 2]> {
    let side = |n: &str| n.parse().ok().filter(|n| (1..=MAX_PICTURE_SIDE).contains(n));
    let size = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    let size = size.ok_or_else(|| {
        anyhow!("must be WIDTHxHEIGHT of 1 to {MAX_PICTURE_SIDE} pixels each, as in 960x540")
    })?;
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
        assert_eq!(field_of_view("60").unwrap(), 60.0);
        assert_eq!(picture_size("960x540").unwrap(), [960, 540]);
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
        }
        for text in ["", "0", "180", "-60", "nan"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        for text in
            ["", "x", "100", "0x100", "100x0", "16385x1", "16384x8192", "-1x5", "1x2x3", "1.5x2"]
        {
            assert!(picture_size(text).is_err(), "{text}");
        }
    }
}
