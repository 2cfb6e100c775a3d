//! Values that people give, each for itself: what is wrong with it, if anything, and what would be
//! right.

use glam::DVec3;

/// The longest side of a picture, pixels.
const MAX_PICTURE_SIDE: u32 = 16384;
/// The most pixels of a picture: 8192², with which five techniques take some 8 GB to compare.
const MAX_PICTURE_PIXELS: u64 = 1 << 26;

/// A place in a world, metres.
///
/// # Errors
/// One that is not finite, or beyond 10¹² metres from the origin.
pub fn position(v: DVec3) -> Result<DVec3, String> {
    let is_near = v.is_finite() && v.abs().max_element() <= 1e12;
    if is_near { Ok(v) } else { Err("must be within 1e12 of the origin".to_owned()) }
}

/// A direction, of any length.
///
/// # Errors
/// One of no length, or that is no [`position`].
pub fn pointing(v: DVec3) -> Result<DVec3, String> {
    match position(v)? {
        DVec3::ZERO => Err("must point somewhere, as in -0.5,-1,-0.3".to_owned()),
        v => Ok(v),
    }
}

/// A distance, metres.
///
/// # Errors
/// One that is not above 0 and at most 10¹².
pub fn metres(d: f64) -> Result<f64, String> {
    if d > 0.0 && d <= 1e12 {
        Ok(d)
    } else {
        Err("must be a positive number of metres, at most 1e12, as in 0.1".to_owned())
    }
}

/// A picture's angle, degrees.
///
/// # Errors
/// One that is not 0.01 to 179.
pub fn opening(degrees: f64) -> Result<f64, String> {
    if (0.01..=179.0).contains(&degrees) {
        Ok(degrees)
    } else {
        Err("must be an angle of 0.01 to 179 degrees, as in 60".to_owned())
    }
}

/// A picture's width and height, pixels.
///
/// # Errors
/// A side that is not 1 to 16384, or more than 2²⁶ pixels.
pub fn pixels(size: [u32; 2]) -> Result<[u32; 2], String> {
    if !size.iter().all(|n| (1..=MAX_PICTURE_SIDE).contains(n)) {
        return Err(format!(
            "must be WIDTHxHEIGHT of 1 to {MAX_PICTURE_SIDE} pixels each, as in 960x540"
        ));
    }
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    if pixels > MAX_PICTURE_PIXELS {
        return Err(format!("must be at most {MAX_PICTURE_PIXELS} pixels, is {pixels}"));
    }
    Ok(size)
}
