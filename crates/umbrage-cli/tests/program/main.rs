//! The real binary, end to end.

mod bad_input;
mod bench;
mod clusters;
mod compare;
mod desk;
mod figures;
mod fit;
mod goldens;
mod help;
mod motion;
mod none;
mod paged;
mod partitions;
mod plan;
mod render;
mod scene_options;
mod scenes;
mod screen;
mod session;
mod sweep;
mod theory;
mod window;
