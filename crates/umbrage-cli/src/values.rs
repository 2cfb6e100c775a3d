//! Parses and checks values from the command line: numbers, vectors, sizes and shares.

use anyhow::{Error, Result, anyhow, bail};
use glam::DVec3;
use umbrage::language::ParseError;
use umbrage::visibility::LightSize;
use umbrage_lab::{Share, values};

/// Parses three finite numbers with commas between them.
pub(crate) fn vector(text: &str) -> Result<DVec3> {
    let numbers: Vec<f64> = text.split(',').map_while(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.matches(',').count() == 2 && !text.to_lowercase().contains("nan") => {
            values::position(DVec3::new(x, y, z)).map_err(Error::msg)
        }
        _ => bail!("must be three finite numbers x,y,z without spaces, as in 0,1.5,-4"),
    }
}

/// Parses a vector that is not zero, from three numbers with commas between them.
pub(crate) fn direction(text: &str) -> Result<DVec3> {
    values::pointing(vector(text)?).map_err(Error::msg)
}

/// Parses the azimuth and the elevation of a sun, degrees, and gives the direction in which its
/// light travels.
pub(crate) fn sun_angles(text: &str) -> Result<DVec3> {
    let number = |n: &str| n.trim().parse().unwrap_or(f64::NAN);
    let angles = text.split_once(',').map_or([f64::NAN; 2], |(a, e)| [number(a), number(e)]);
    values::sun_direction(angles).map_err(Error::msg)
}

/// Parses a positive distance in metres.
pub(crate) fn distance(text: &str) -> Result<f64> {
    values::metres(text.parse().unwrap_or(f64::NAN)).map_err(Error::msg)
}

/// Parses a time in seconds, at least 0.
pub(crate) fn seconds(text: &str) -> Result<f64> {
    values::seconds(text.parse().unwrap_or(f64::NAN)).map_err(Error::msg)
}

/// Parses an error in pixels per texel, > 0 and at most 10¹².
pub(crate) fn pixels_per_texel(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(p) if p > 0.0 && p <= 1e12 => Ok(p),
        _ => bail!("must be a positive number of pixels per texel, as in 1"),
    }
}

/// Parses a field of view, 0.01 to 179 degrees.
pub(crate) fn field_of_view(text: &str) -> Result<f64> {
    values::opening(text.parse().unwrap_or(f64::NAN)).map_err(Error::msg)
}

/// Parses the size of a light: an angle in degrees or a length in metres.
pub(crate) fn light_size(text: &str) -> Result<LightSize> {
    text.parse().map_err(|e: ParseError| anyhow!("{}", e.problem))
}

/// Parses the width and height of a picture, pixels.
pub(crate) fn picture_size(text: &str) -> Result<[u32; 2]> {
    // A side that is not a number counts as 0 pixels, which the check below rejects.
    let side = |n: &str| n.parse().unwrap_or(0);
    let size = text.split_once('x').map_or([0; 2], |(w, h)| [side(w), side(h)]);
    values::pixels(size).map_err(Error::msg)
}

/// Parses a share I/N: the I-th of N equal shares.
pub(crate) fn share(text: &str) -> Result<Share> {
    let share = text.split_once('/').and_then(|(index, count)| {
        Some(Share { index: index.parse().ok()?, count: count.parse().ok()? })
    });
    share
        .filter(|s| (1..=s.count).contains(&s.index))
        .ok_or_else(|| anyhow!("must be I/N with 1 ≤ I ≤ N, as in 2/8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_values() {
        assert_eq!(vector("-1,2.5,1e3").unwrap(), DVec3::new(-1.0, 2.5, 1e3));
        // In the evening the sun is in the west, and its light travels east.
        let evening = sun_angles("270,30").unwrap();
        let expected = DVec3::new(3f64.sqrt() / 2.0, -0.5, 0.0);
        assert!(evening.distance(expected) < 1e-12, "{evening}");
        assert!(sun_angles("0,0").unwrap().distance(DVec3::Z) < 1e-12, "from the north");
        assert_eq!(distance("0.25").unwrap(), 0.25);
        assert_eq!(pixels_per_texel("1.5").unwrap(), 1.5);
        assert_eq!(field_of_view("60").unwrap(), 60.0);
        assert_eq!(picture_size("960x540").unwrap(), [960, 540]);
        assert_eq!(light_size("0.53deg").unwrap(), LightSize::Degrees(0.53));
        assert_eq!(light_size("2m").unwrap(), LightSize::Metres(2.0));
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
        for text in ["", "1", "1,2,3", "a,2", "1,nan", "inf,1", "0,91", "361,0"] {
            assert!(sun_angles(text).is_err(), "{text}");
        }
        for text in ["", "0", "180", "-60", "nan"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        for text in
            ["", "x", "100", "0x100", "100x0", "16385x1", "16384x8192", "-1x5", "1x2x3", "1.5x2"]
        {
            assert!(picture_size(text).is_err(), "{text}");
        }
        for text in ["", "1", "0m", "-1deg", "nanm", "infdeg", "91deg", "2e6m", "1cm", "m"] {
            assert!(light_size(text).is_err(), "{text}");
        }
        for text in ["", "/", "1", "0/1", "2/1", "1/0", "-1/2", "1/2/3", "a/b", "1/99999999999"] {
            assert!(share(text).is_err(), "{text}");
        }
    }
}
