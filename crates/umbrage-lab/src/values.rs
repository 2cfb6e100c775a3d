//! Checks of single values that users give. Each error is a message that says what is valid.

use glam::DVec3;

/// Largest width and height of a picture, pixels.
const MAX_PICTURE_SIDE: u32 = 16384;
/// Largest number of pixels in a picture: 8192². Comparing five techniques takes some 8 GB then.
const MAX_PICTURE_PIXELS: u64 = 1 << 26;

/// Checks a position in world space, metres.
///
/// # Errors
/// An error if a coordinate is not finite, or is more than 10¹² metres from the origin.
pub fn position(v: DVec3) -> Result<DVec3, String> {
    let is_near = v.is_finite() && v.abs().max_element() <= 1e12;
    if is_near { Ok(v) } else { Err("must be within 1e12 of the origin".to_owned()) }
}

/// Checks a direction, which may have any length above 0.
///
/// # Errors
/// An error if the direction has no length, or is not a valid [`position`].
pub fn pointing(v: DVec3) -> Result<DVec3, String> {
    match position(v)? {
        DVec3::ZERO => Err("must point somewhere, as in -0.5,-1,-0.3".to_owned()),
        v => Ok(v),
    }
}

/// Checks a distance, metres.
///
/// # Errors
/// An error if the distance is not above 0 and at most 10¹².
pub fn metres(d: f64) -> Result<f64, String> {
    if d > 0.0 && d <= 1e12 {
        Ok(d)
    } else {
        Err("must be a positive number of metres, at most 1e12, as in 0.1".to_owned())
    }
}

/// Checks a field of view, degrees.
///
/// # Errors
/// An error if the angle is not from 0.01 to 179.
pub fn opening(degrees: f64) -> Result<f64, String> {
    if (0.01..=179.0).contains(&degrees) {
        Ok(degrees)
    } else {
        Err("must be an angle of 0.01 to 179 degrees, as in 60".to_owned())
    }
}

/// Checks a time in an animation, seconds.
///
/// # Errors
/// An error if the time is not finite or below 0.
pub fn seconds(time: f64) -> Result<f64, String> {
    if time.is_finite() && time >= 0.0 {
        Ok(time)
    } else {
        Err("must be a number of seconds, at least 0, as in 1.5".to_owned())
    }
}

/// Returns the direction in which the light of a sun travels, a unit vector, from where the sun
/// stands: its azimuth, clockwise from north as seen from above, and its elevation above the
/// horizon, degrees. North is −z and east is +x.
///
/// # Errors
/// An error if the azimuth is not from −360 to 360, or the elevation not from −90 to 90.
pub fn sun_direction([azimuth_deg, elevation_deg]: [f64; 2]) -> Result<DVec3, String> {
    if !(azimuth_deg.abs() <= 360.0 && elevation_deg.abs() <= 90.0) {
        return Err(
            "must be an azimuth of -360 to 360 degrees, clockwise from north (-z), and an \
                    elevation of -90 to 90 degrees above the horizon, as in 225,40"
                .to_owned(),
        );
    }
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let (height, reach) = elevation_deg.to_radians().sin_cos();
    Ok(DVec3::new(-sin * reach, -height, cos * reach))
}

/// Checks the width and height of a picture, pixels.
///
/// # Errors
/// An error if a side is not from 1 to 16384, or if there are more than 2²⁶ pixels in all.
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
