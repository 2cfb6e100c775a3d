//! The window.

mod pose;
mod stage;
mod sun;
