use crate::error::{Error, check};
use crate::light::Light;
use crate::plan::Receiver;
use std::fmt;

/// Width of a filter that does not depend on warp or resolution, so that it is the same near and
/// far and under every partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Width {
    /// Width in pixels of the image, at any orientation of the surface; gives smooth edges.
    Pixels(f32),
    /// Width in metres across the light; gives soft shadows.
    Metres(f32),
}

impl Width {
    /// The largest width, pixels or metres.
    pub const MAX: f32 = 1e6;

    /// [`Receiver::texel_metric`] or [`Receiver::pixel_metric`] times the square of this width:
    /// squared extents of the width in s and t, and their product, texels².
    pub(crate) fn metric(self, receiver: &Receiver) -> [f64; 3] {
        let (width, metric) = match self {
            Self::Pixels(pixels) => (f64::from(pixels), receiver.pixel_metric),
            Self::Metres(metres) => (f64::from(metres), receiver.texel_metric),
        };
        metric.map(|m| m * width * width)
    }

    pub(crate) fn check(self) -> Result<(), Error> {
        let (Self::Pixels(width) | Self::Metres(width)) = self;
        check(width > 0.0 && width <= Self::MAX, "filter.width", || {
            format!("must be above 0 and at most {}, is {width}", Self::MAX)
        })
    }
}

/// The form of a technique's text: `1.5px`, `0.2m`.
impl fmt::Display for Width {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pixels(width) => write!(f, "{width}px"),
            Self::Metres(width) => write!(f, "{width}m"),
        }
    }
}

/// Size of a light, which determines the width of penumbrae.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightSize {
    /// The angle that a directional light subtends, degrees, > 0 and at most
    /// [`MAX_DEGREES`](Self::MAX_DEGREES). The sun subtends 0.53 degrees.
    Degrees(f32),
    /// The diameter of a spot or point light, metres, > 0 and at most
    /// [`MAX_METRES`](Self::MAX_METRES).
    Metres(f32),
}

/// The size of our sun.
impl Default for LightSize {
    fn default() -> Self {
        Self::Degrees(0.53)
    }
}

impl LightSize {
    /// The largest angle of a directional light, degrees.
    pub const MAX_DEGREES: f32 = 90.0;

    /// The largest diameter of a lamp, metres.
    pub const MAX_METRES: f32 = 1e6;

    /// The light's diameter: for a lamp in metres; for a sun in metres per metre of distance, twice
    /// the tangent of half its angle.
    pub fn diameter(self) -> f32 {
        match self {
            Self::Degrees(angle) => 2.0 * (0.5 * angle).to_radians().tan(),
            Self::Metres(diameter) => diameter,
        }
    }

    /// Checks that the size is in range and in the unit of this kind of light.
    ///
    /// # Errors
    /// A text that says what is wrong with the size and what would be right.
    pub fn check_for(self, light: &Light) -> Result<(), String> {
        let problem = match (light, self) {
            (Light::Directional { .. }, Self::Metres(_)) => {
                "a sun's size is an angle, as in 0.53deg"
            }
            (Light::Spot(_) | Light::Point(_), Self::Degrees(_)) => {
                "a lamp's size is a length, as in 0.2m"
            }
            _ => return self.check_range(),
        };
        Err(problem.to_owned())
    }

    fn check_range(self) -> Result<(), String> {
        let (size, max, unit) = match self {
            Self::Degrees(size) => (size, Self::MAX_DEGREES, "degrees"),
            Self::Metres(size) => (size, Self::MAX_METRES, "metres"),
        };
        let is_valid = size > 0.0 && size <= max;
        let problem = || format!("must be above 0 and at most {max} {unit}, is {size}");
        is_valid.then_some(()).ok_or_else(problem)
    }

    pub(crate) fn check(self) -> Result<(), Error> {
        self.check_range().map_err(|problem| Error::invalid("filter.light", problem))
    }
}

/// The form of a technique's text: `0.53deg`, `0.2m`.
impl fmt::Display for LightSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Degrees(size) => write!(f, "{size}deg"),
            Self::Metres(size) => write!(f, "{size}m"),
        }
    }
}
