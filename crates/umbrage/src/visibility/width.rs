use crate::error::{Error, check};
use crate::plan::Receiver;
use std::fmt;

/// How wide a filter is across the light, whatever the warp and the resolution: as wide near as far, and in every partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Width {
    /// As wide as so many pixels of the picture at the receiver's distance: for smooth edges.
    Pixels(f32),
    /// So many metres: for soft shadows.
    Metres(f32),
}

impl Width {
    /// Metres at a receiver.
    pub fn metres(self, receiver: &Receiver) -> f64 {
        match self {
            Self::Pixels(pixels) => f64::from(pixels) * receiver.pixel_metres,
            Self::Metres(metres) => f64::from(metres),
        }
    }

    pub(crate) fn check(self) -> Result<(), Error> {
        let (Self::Pixels(width) | Self::Metres(width)) = self;
        check(width > 0.0 && width <= 1e6, "filter.width", || {
            format!("must be above 0 and at most 1e6, is {width}")
        })
    }
}

/// As in a shadow specification: `1.5px`, `0.2m`.
impl fmt::Display for Width {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pixels(width) => write!(f, "{width}px"),
            Self::Metres(width) => write!(f, "{width}m"),
        }
    }
}
