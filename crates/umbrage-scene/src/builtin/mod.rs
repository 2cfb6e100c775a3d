//! Built-in scenes, generated procedurally.

mod airfield;
pub mod closed_form;
mod colossus;
mod contacts;
mod fence;
mod grove;
mod lamps;
mod lantern;
mod mesh_builder;
mod plants;
mod stage;
mod statues;
mod town;

use crate::error::SceneError;
use crate::types::Scene;

/// A description of a built-in scene, for lists.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct BuiltinInfo {
    /// The name that selects the scene.
    pub name: &'static str,
    /// What the scene shows, in one sentence.
    pub about: &'static str,
    /// What the size of the scene counts.
    pub size_means: &'static str,
    /// The size by default, quick to build and rich enough to look at.
    pub default_size: u32,
    /// The largest valid size, which draws many millions of triangles. Only `colossus` stores that
    /// many, with 24 bytes each.
    pub max_size: u32,
    build: fn(u32) -> Scene,
}

const BUILTINS: &[BuiltinInfo] = &[
    BuiltinInfo {
        name: "town",
        about: "A street of houses, lamps and trees, hundreds of metres deep, seen from its pavement",
        size_means: "pairs of houses along the street",
        default_size: 28,
        max_size: 12_000,
        build: town::town,
    },
    BuiltinInfo {
        name: "airfield",
        about: "Planes with struts, wires and propellers before hangars and a runway",
        size_means: "planes",
        default_size: 15,
        max_size: 40_000,
        build: airfield::airfield,
    },
    BuiltinInfo {
        name: "statues",
        about: "Ornate statues, evenly spaced on a plane",
        size_means: "statues along each side of their square",
        default_size: 5,
        max_size: 120,
        build: statues::statues,
    },
    BuiltinInfo {
        name: "colossus",
        about: "An unfinished statue ten metres high, a single mesh that nowhere repeats itself",
        size_means: "hundred thousands of triangles of its stone",
        default_size: 2,
        max_size: 4000,
        build: colossus::colossus,
    },
    BuiltinInfo {
        name: "grove",
        about: "Trees with thin branches and cut-out leaves along a path",
        size_means: "trees",
        default_size: 40,
        max_size: 40_000,
        build: grove::grove,
    },
    BuiltinInfo {
        name: "fence",
        about: "An iron fence before frames, ladders and globes of great depth complexity",
        size_means: "rows behind the fence",
        default_size: 6,
        max_size: 100,
        build: fence::fence,
    },
    BuiltinInfo {
        name: "lantern",
        about: "A hall of columns around a lantern of iron wire, lit by its flame, a point light",
        size_means: "rows of columns on each side of the lantern",
        default_size: 2,
        max_size: 200,
        build: lantern::lantern,
    },
    BuiltinInfo {
        name: "lamps",
        about: "A market hall at night under 64 spot lights and 8 point lights, for lights that share a plan",
        size_means: "bays of the hall, with nine lights each",
        default_size: 8,
        max_size: 2000,
        build: lamps::lamps,
    },
    BuiltinInfo {
        name: "contacts",
        about: "Two squares and a slanted board that touches the ground: how near an occluder may be",
        size_means: "quads along each edge",
        default_size: 1,
        max_size: 1000,
        build: contacts::contacts,
    },
    BuiltinInfo {
        name: "pole",
        about: "A square pole on a plane; its shadow has a closed form",
        size_means: "quads along each edge of ground and pole",
        default_size: 1,
        max_size: 1000,
        build: closed_form::pole,
    },
    BuiltinInfo {
        name: "slit",
        about: "A horizontal screen with a slit over a plane; its shadow has a closed form",
        size_means: "quads along each edge of ground and screen",
        default_size: 1,
        max_size: 1000,
        build: closed_form::slit,
    },
    BuiltinInfo {
        name: "sphere",
        about: "A sphere over a plane; its shadow is an ellipse",
        size_means: "rings of the sphere from pole to pole",
        default_size: 128,
        max_size: 2000,
        build: closed_form::sphere,
    },
];

/// All built-in scenes.
pub fn builtins() -> &'static [BuiltinInfo] {
    BUILTINS
}

/// A built-in scene with its own camera and light. The same arguments always give the same scene.
/// `size` is 1 to [`BuiltinInfo::max_size`] and counts what [`BuiltinInfo::size_means`] says;
/// `None` stands for [`BuiltinInfo::default_size`].
///
/// # Errors
/// The name is unknown (the error gives the most similar valid one), or the size is out of range.
pub fn builtin(name: &str, size: Option<u32>) -> Result<Scene, SceneError> {
    let Some(info) = BUILTINS.iter().find(|b| b.name == name) else {
        let nearest = umbrage::language::nearest(name, BUILTINS.iter().map(|b| b.name));
        return Err(SceneError::UnknownBuiltin { name: name.into(), nearest });
    };
    let size = size.unwrap_or(info.default_size);
    if !(1..=info.max_size).contains(&size) {
        return Err(SceneError::BuiltinSize { name: info.name, size, max: info.max_size });
    }
    Ok((info.build)(size))
}
