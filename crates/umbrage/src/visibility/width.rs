use crate::error::{Error, check};
use crate::plan::Receiver;
use std::fmt;

/// How wide a filter is, whatever the warp and the resolution: as wide near as far, and in every partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Width {
    /// So many pixels of the picture, whichever way the surface lies in it: for smooth edges.
    Pixels(f32),
    /// So many metres across the light: for soft shadows.
    Metres(f32),
}

impl Width {
    /// Squares of the texels that a line of this width covers in s and in t, and the product of the two, as in [`Receiver::texel_metric`].
    pub(crate) fn metric(self, receiver: &Receiver) -> [f64; 3] {
        let (width, metric) = match self {
            Self::Pixels(pixels) => (f64::from(pixels), receiver.pixel_metric),
            Self::Metres(metres) => (f64::from(metres), receiver.texel_metric),
        };
        metric.map(|m| m * width * width)
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
