//! Errors that show in motion: shadows that change from frame to frame where the truth does not,
//! and pixels that sparkle as a scene gets smaller in the picture.

mod flicker;
mod frames;
mod noise;

pub use flicker::flicker;
pub use frames::{Motion, MovingView, turned};
pub use noise::{Noise, noise};
