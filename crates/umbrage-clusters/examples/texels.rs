//! How many triangles are drawn of meshes whose diameter covers so many texels of a shadow map,
//! when half a texel is allowed as an error, and which share of the stated error is true.
//!
//! `cargo run --release -p umbrage-clusters --example texels [words]` takes the meshes of some
//! built-in scenes, and of glTF files in the folder `UMBRAGE_SCENES`; words choose those whose
//! names contain one of them.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/distance.rs"]
mod distance;

use common::{Random, Shape, corners, cut};
use distance::Surface;
use std::path::PathBuf;
use std::time::Instant;
use umbrage_clusters::{Ball, build};
use umbrage_scene::{Alpha, Scene, builtin, load};

const TEXELS: [u32; 6] = [12, 25, 50, 100, 200, 400];

/// The largest meshes of each scene that are looked at.
const MESHES: usize = 4;

/// Meshes below this many triangles are cheap anyway.
const FEWEST: usize = 400;

/// The points at which a cut and its mesh are compared, each way.
const POINTS: usize = 20_000;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let is_asked = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    print!("{:<32} {:>9} {:>6}", "mesh", "triangles", "s");
    TEXELS.iter().for_each(|texels| print!(" {texels:>7} true"));
    println!();
    let mut totals = [0; TEXELS.len()];
    let mut seconds = 0.0;
    for scene in scenes() {
        for (name, shape) in shapes(&scene) {
            if is_asked(&name) {
                seconds += row(&name, &shape, &mut totals);
            }
        }
    }
    print!("{:<32} {:>9} {seconds:>6.2}", "all", "");
    totals.iter().for_each(|total| print!(" {total:>12}"));
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find(|line| line.starts_with("VmHWM"));
    println!("\n{}", peak.unwrap_or("peak memory unknown"));
}

fn scenes() -> Vec<Scene> {
    let sizes = [("town", None), ("grove", None), ("statues", None), ("colossus", Some(10))];
    let built = sizes.map(|(name, size)| builtin(name, size).expect("a built-in scene"));
    let folder = std::env::var("UMBRAGE_SCENES").unwrap_or_default();
    let files = [
        "atrium/sponza_atrium_reduced.glb",
        "city/delft_city.glb",
        "city/kenney_city_40x40.glb",
        "dragon/dragon_res2.glb",
        "house/house.glb",
        "lattice/lattice_ball.glb",
        "trees/forest_eztree.glb",
        "vehicles/retroufo.glb",
    ];
    let loaded = files.iter().filter_map(|file| load(&PathBuf::from(&folder).join(file)).ok());
    built.into_iter().chain(loaded).collect()
}

/// The largest meshes of a scene.
fn shapes(scene: &Scene) -> Vec<(String, Shape)> {
    let mut order: Vec<usize> = (0..scene.meshes.len()).collect();
    order.retain(|&i| scene.meshes[i].triangles.len() >= FEWEST);
    order.sort_by_key(|&i| std::cmp::Reverse(scene.meshes[i].triangles.len()));
    // Scenes have the same mesh more than once, in other colours.
    order.dedup_by_key(|&mut i| scene.meshes[i].triangles.len());
    let shape = |&i: &usize| {
        let mesh = &scene.meshes[i];
        let is_masked = matches!(scene.materials[mesh.material].alpha, Alpha::Mask { .. });
        let shape = Shape {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            uvs: mesh.uvs.clone(),
            triangles: mesh.triangles.clone(),
            is_masked,
        };
        let mask = if is_masked { " mask" } else { "" };
        let stem: String = scene.name.chars().take(20).collect();
        (format!("{stem} {i}{mask}"), shape)
    };
    order.iter().take(MESHES).map(shape).collect()
}

/// Prints one mesh's row, and returns the seconds that its clusters took.
fn row(name: &str, shape: &Shape, totals: &mut [u32; TEXELS.len()]) -> f64 {
    let start = Instant::now();
    let mesh = build(&shape.input()).expect("a sound mesh");
    let seconds = start.elapsed().as_secs_f64();
    print!("{name:<32} {:>9} {seconds:>6.2}", shape.triangles.len());
    // Triangles without area are no part of it.
    let finest = mesh.clusters.iter().filter(|cluster| cluster.level == 0);
    let finest: Vec<_> = finest.flat_map(|cluster| corners(&mesh, cluster)).collect();
    let original = Surface::new(shape, &finest);
    let points = shape.triangles.iter().flatten().map(|&i| shape.positions[i as usize]);
    let low = points.clone().fold(glam::Vec3::INFINITY, glam::Vec3::min);
    let high = points.fold(glam::Vec3::NEG_INFINITY, glam::Vec3::max);
    for (texels, total) in TEXELS.into_iter().zip(totals) {
        let allowed = 0.5 * low.distance(high) / texels as f32;
        let drawn = cut(&mesh, |_: &Ball, error| error <= allowed);
        let stated = drawn.iter().map(|cluster| cluster.error).fold(0.0, f32::max);
        let triangles: Vec<_> = drawn.iter().flat_map(|c| corners(&mesh, c)).collect();
        *total += triangles.len() as u32;
        print!(" {:>7}", triangles.len());
        if stated > 0.0 {
            let surface = Surface::new(shape, &triangles);
            let mut random = Random(3);
            let truth = original.farthest(&surface, POINTS, &mut random).max(surface.farthest(
                &original,
                POINTS,
                &mut random,
            ));
            print!(" {:.2}", truth / f64::from(stated));
        } else {
            print!("    -");
        }
    }
    println!();
    seconds
}
