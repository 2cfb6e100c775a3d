//! The window of Umbrage's program: shadows that move, compared with ray-traced truth.
//!
//! [`run`] opens the window. Its own thread shows pictures and takes input (`app`); threads of each
//! scene load and draw it, and trace its truth (`stage`). What a user can do is an action, which
//! scripts have, too (`action`, `script`).

mod action;
mod app;
mod pose;
mod script;
mod session;
mod settings;
mod stage;
mod sun;
mod window;

pub use window::{Error, Options, run};

/// What the life of a window came to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The user or a script closed it.
    Closed,
    /// The device was lost, so that the window must be opened again.
    DeviceLost,
    /// A script failed.
    Failed(String),
}
