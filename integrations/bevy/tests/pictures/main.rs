//! Pictures that Bevy draws with the plugin, against rays.

#[path = "../../examples/harness/mod.rs"]
mod harness;

mod boxes;
mod features;
mod lamps;
mod scenes;
