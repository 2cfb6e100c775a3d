//! A small forward renderer for Umbrage's scenes: textures, sun or lamp, sky, tone mapping, and shadows by
//! [`umbrage_wgpu`], whose public API is all that it knows of them.
//!
//! - [`Gpu`] is a device without a window; [`devices`] tells of all there are.
//! - [`SceneBuffers`] are a scene's meshes and materials on it.
//! - [`Renderer`] draws a plan's maps, then [frames](Renderer::frame) to look at or [samples](Renderer::samples) to measure.

mod error;
mod gpu;
mod points;
mod renderer;
mod samples;
mod scene;
mod timer;
mod view;

pub use error::Error;
pub use gpu::{AdapterReport, Gpu, devices};
pub use renderer::{Drawn, FRAME_FORMAT, FrameTarget, Renderer, Shading};
pub use samples::Sample;
pub use scene::SceneBuffers;
pub use timer::Timer;
