//! Scenes for shadow experiments, from glTF files or built in: triangles, materials, cameras and
//! lights.
//!
//! World space is right-handed, +y up, in metres. Each mesh is stored once, in single precision and
//! in its own space. [`Instance`]s draw it with transforms in double precision.

mod animation;
mod builtin;
pub mod daylight;
mod error;
mod ground;
mod load;
mod nodes;
mod normals;
mod sky;
mod texture;
mod types;
mod view;

pub use animation::{Animations, Clip, Moved};
pub use builtin::{BuiltinInfo, builtin, builtins, closed_form};
pub use error::SceneError;
pub use load::{SCENE_BYTES, files, load, load_within};
pub use nodes::{Choices, LeftOut, Role, Roles, SceneNode};
pub use types::{
    Alpha, Instance, Lens, Material, Mesh, Notice, Sampling, Scene, SceneCamera, SceneLight,
    Texture, TextureId, Wrap,
};
pub use view::side_planes;
