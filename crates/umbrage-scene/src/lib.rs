//! Scenes for shadow experiments: glTF files and built-in procedural worlds, as triangles,
//! materials, cameras and lights.
//!
//! World space is right-handed, +y up, metres. Meshes are stored once, in single precision and
//! their own space, and drawn by [`Instance`]s with double-precision transforms.

mod builtin;
pub mod daylight;
mod error;
mod load;
mod texture;
mod types;
mod view;

pub use builtin::{BuiltinInfo, builtin, builtins, closed_form};
pub use error::SceneError;
pub use load::{files, load};
pub use types::{
    Alpha, Instance, Material, Mesh, Notice, Scene, SceneCamera, SceneLight, Texture, TextureId,
    Wrap,
};
