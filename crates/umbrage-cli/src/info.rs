//! `umbrage info` tells what is in a scene.

use crate::args;
use crate::output::{print, six_digits};
use crate::progress::Bar;
use crate::setup::{Chosen, choose, light_words, open_scene, view_words};
use anyhow::Result;
use serde::Serialize;
use std::fmt::Write;
use umbrage::Aabb;
use umbrage_lab::{ChosenLight, ChosenView};
use umbrage_measure::{LightInfo, View};
use umbrage_scene::{Choices, Scene};

/// Largest number of nodes that the text lists. JSON has all that draw anything.
const MOST_NODES: usize = 12;

#[derive(Serialize)]
struct InfoJson {
    scene: String,
    cameras: Vec<CameraJson>,
    lights: Vec<LightJson>,
    animations: Vec<AnimationJson>,
    /// Nodes that draw a mesh of their own, or of which a node below does.
    nodes: Vec<NodeJson>,
    /// Edge lengths of the box around the scene, metres.
    size: [f64; 3],
    bounds: BoxJson,
    triangles: TrianglesJson,
    meshes: usize,
    instances: usize,
    materials: usize,
    textures: usize,
    view: View,
    light: LightInfo,
    notices: Vec<String>,
}

#[derive(Serialize)]
struct CameraJson {
    /// The words that choose it, names first and its number last.
    words: Vec<String>,
    #[serde(flatten)]
    view: View,
}

#[derive(Serialize)]
struct LightJson {
    /// The words that choose it, names first and its number last.
    words: Vec<String>,
    #[serde(flatten)]
    light: LightInfo,
    intensity: f32,
}

#[derive(Serialize)]
struct AnimationJson {
    /// The words that choose it, names first and its number last.
    words: Vec<String>,
    /// Time of its last key, seconds.
    duration: f64,
}

#[derive(Serialize)]
struct NodeJson {
    /// The words that choose it, names first and its number last.
    words: Vec<String>,
    name: Option<String>,
    /// Instances of the node itself and of all nodes below it.
    instances: usize,
    triangles: u64,
}

#[derive(Serialize)]
struct BoxJson {
    min: [f64; 3],
    max: [f64; 3],
}

#[derive(Serialize)]
struct TrianglesJson {
    /// As drawn: each instance counts those of its mesh.
    drawn: u64,
    stored: u64,
}

/// Prints what is in the scene, as text or JSON.
pub(crate) fn run(args: &args::Info, quiet: bool) -> Result<()> {
    let bar = Bar::of_parts(quiet);
    let scene = open_scene(&args.scene, &bar)?;
    let Chosen { view, lights } = choose(&args.view, &[args.light.options()], Some(&scene), &bar)?;
    drop(bar);
    let info = InfoJson::of(&scene, &view, &lights[0]);
    match args.json {
        true => print(&format!("{}\n", serde_json::to_string_pretty(&info)?)),
        false => print(&text(&info, &scene, &view, &lights[0])),
    }
}

impl InfoJson {
    fn of(scene: &Scene, view: &ChosenView, light: &ChosenLight) -> Self {
        let Aabb { min, max } = scene.bounds();
        let (cameras, lights) = (scene.camera_choices(), scene.light_choices());
        let animations = scene.animation_choices();
        let notices = scene.all_notices().into_iter().map(|n| n.0);
        Self {
            scene: scene.name.clone(),
            cameras: scene
                .cameras
                .iter()
                .enumerate()
                .map(|(i, camera)| CameraJson {
                    words: cameras.words(i),
                    view: ChosenView::info_of(None, camera),
                })
                .collect(),
            lights: scene
                .lights
                .iter()
                .enumerate()
                .map(|(i, light)| LightJson {
                    words: lights.words(i),
                    light: ChosenLight { name: None, light: light.light }.info(),
                    intensity: light.intensity,
                })
                .collect(),
            animations: scene
                .animations
                .clips()
                .iter()
                .enumerate()
                .map(|(i, clip)| AnimationJson {
                    words: animations.words(i),
                    duration: clip.duration_s,
                })
                .collect(),
            nodes: nodes(scene, &scene.node_choices()),
            size: (max - min).to_array(),
            bounds: BoxJson { min: min.to_array(), max: max.to_array() },
            triangles: TrianglesJson {
                drawn: scene.drawn_triangles(),
                stored: scene.stored_triangles(),
            },
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            view: view.info(),
            light: light.info(),
            notices: notices.chain(view.notices.iter().cloned()).collect(),
        }
    }
}

/// The nodes that draw anything, in their order.
fn nodes(scene: &Scene, choices: &Choices<'_>) -> Vec<NodeJson> {
    let own = |node: &umbrage_scene::SceneNode| {
        let drawn = scene.instances[node.instances.clone()].iter();
        let triangles = drawn.map(|i| scene.meshes[i.mesh].triangles.len() as u64);
        (node.instances.len(), triangles.sum::<u64>())
    };
    let mut sums: Vec<(usize, u64)> = scene.nodes.iter().map(own).collect();
    // Children come after their parents.
    for i in (0..sums.len()).rev() {
        if let Some(parent) = scene.nodes[i].parent {
            let (instances, triangles) = sums[i];
            sums[parent].0 += instances;
            sums[parent].1 += triangles;
        }
    }
    let drawing = sums.into_iter().enumerate().filter(|(_, (instances, _))| *instances > 0);
    drawing
        .map(|(i, (instances, triangles))| NodeJson {
            words: choices.words(i),
            name: Some(scene.nodes[i].name.clone()).filter(|n| !n.is_empty()),
            instances,
            triangles,
        })
        .collect()
}

fn text(info: &InfoJson, scene: &Scene, view: &ChosenView, light: &ChosenLight) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |head: &str, rest: String| {
        let _ = writeln!(text, "{head:<11} {rest}");
    };
    let [x, y, z] = info.size.map(six_digits);
    line("scene", info.scene.clone());
    line("size", format!("{x} x {y} x {z} m"));
    line("triangles", format!("{} drawn, {} stored", info.triangles.drawn, info.triangles.stored));
    line("instances", format!("{} of {} meshes", info.instances, info.meshes));
    line("materials", format!("{}, {} textures", info.materials, info.textures));
    for (i, camera) in info.cameras.iter().enumerate() {
        let view = ChosenView { view: scene.cameras[i].clone(), name: None, ..view.clone() };
        line("camera", format!("{}: {}", words(&camera.words), view_words(&view)));
    }
    for (i, of) in info.lights.iter().enumerate() {
        let light = ChosenLight { name: None, light: scene.lights[i].light };
        let dark = if of.intensity > 0.0 { "" } else { ", dark" };
        line("light", format!("{}: {}{dark}", words(&of.words), light_words(&light)));
    }
    for of in &info.animations {
        line("animation", format!("{}: {} s", words(&of.words), six_digits(of.duration)));
    }
    for node in info.nodes.iter().take(MOST_NODES) {
        let of = format!("{} instances, {} triangles", node.instances, node.triangles);
        let name = node.name.as_ref().filter(|name| !node.words.contains(name));
        let shared = name.map_or(String::new(), |name| format!("{name} or "));
        line("node", format!("{shared}{}: {of}", words(&node.words)));
    }
    if info.nodes.len() > MOST_NODES {
        line("", format!("and {} more nodes (--json lists all)", info.nodes.len() - MOST_NODES));
    }
    line("takes view", view_words(view));
    line("takes light", light_words(light));
    for notice in &info.notices {
        line("notice", notice.clone());
    }
    text
}

fn words(words: &[String]) -> String {
    words.join(" or ")
}
