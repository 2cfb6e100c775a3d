//! Where a sun stands: by azimuth and elevation, or by the time of day.

use glam::DVec3;
use umbrage_lab::values::sun_direction;

/// A sun by where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sun {
    /// Clockwise from north (−z; east is +x), degrees, −360 to 360.
    pub(crate) azimuth_deg: f64,
    /// Above the horizon, degrees, −90 to 90.
    pub(crate) elevation_deg: f64,
}

impl Sun {
    /// The sun whose light travels in this direction, of any length but 0.
    pub(crate) fn from_direction(direction: DVec3) -> Self {
        let to_sun = -direction.normalize_or(DVec3::NEG_Y);
        Self {
            azimuth_deg: to_sun.x.atan2(-to_sun.z).to_degrees().rem_euclid(360.0),
            elevation_deg: to_sun.y.clamp(-1.0, 1.0).asin().to_degrees(),
        }
    }

    /// The direction in which the light travels, a unit vector.
    pub(crate) fn direction(self) -> DVec3 {
        let angles = [self.azimuth_deg % 360.0, self.elevation_deg.clamp(-90.0, 90.0)];
        sun_direction(angles).unwrap_or(DVec3::NEG_Y)
    }

    /// The sun at this time of the sun itself, hours (12 is noon), on the longest day at a latitude
    /// of 45° north: from east over south to west, at most 68.4° high. It is below the horizon
    /// before 4:16 and after 19:44.
    pub(crate) fn at_hour(hour: f64) -> Self {
        const LATITUDE_DEG: f64 = 45.0;
        const DECLINATION_DEG: f64 = 23.44;
        let (sin_lat, cos_lat) = LATITUDE_DEG.to_radians().sin_cos();
        let (sin_dec, cos_dec) = DECLINATION_DEG.to_radians().sin_cos();
        let (sin_hour, cos_hour) = ((hour - 12.0) * 15.0).to_radians().sin_cos();
        // In the frame of the horizon: up, south and west.
        let up = sin_lat * sin_dec + cos_lat * cos_dec * cos_hour;
        let south = sin_lat * cos_dec * cos_hour - cos_lat * sin_dec;
        let west = cos_dec * sin_hour;
        Self::from_direction(-DVec3::new(-west, up, south))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_directions_are_inverse() {
        for (azimuth_deg, elevation_deg) in
            [(0.0, 5.0), (90.0, 45.0), (225.0, 80.0), (359.0, -10.0)]
        {
            let sun = Sun { azimuth_deg, elevation_deg };
            let again = Sun::from_direction(sun.direction());
            assert!((again.azimuth_deg - azimuth_deg).abs() < 1e-9, "{again:?}");
            assert!((again.elevation_deg - elevation_deg).abs() < 1e-9, "{again:?}");
        }
        assert!(Sun::from_direction(DVec3::ZERO).direction().is_finite());
    }

    #[test]
    fn the_sun_rises_in_the_east_and_culminates_in_the_south() {
        let noon = Sun::at_hour(12.0);
        assert!((noon.azimuth_deg - 180.0).abs() < 1e-9);
        // 90° less the latitude, plus the declination.
        assert!((noon.elevation_deg - 68.44).abs() < 1e-9);
        let morning = Sun::at_hour(7.0);
        assert!((60.0..90.0).contains(&morning.azimuth_deg), "{morning:?}");
        let evening = Sun::at_hour(17.0);
        assert!((morning.elevation_deg - evening.elevation_deg).abs() < 1e-9);
        assert!((morning.azimuth_deg + evening.azimuth_deg - 360.0).abs() < 1e-9);
        assert!(Sun::at_hour(4.2).elevation_deg < 0.0 && Sun::at_hour(4.3).elevation_deg > 0.0);
        assert!(Sun::at_hour(19.7).elevation_deg > 0.0 && Sun::at_hour(19.8).elevation_deg < 0.0);
    }
}
