//! `umbrage prepare` makes the levels of detail of a scene ahead.

use crate::args;
use crate::output::print;
use crate::progress::Bar;
use crate::setup::{open_scene, tell_notices};
use anyhow::Result;
use serde::Serialize;
use std::time::Instant;
use umbrage_lab::{Detail, check_file};

#[derive(Serialize)]
struct PreparedJson {
    scene: String,
    /// Stored triangles of the scene.
    triangles: u64,
    /// Triangles of all levels together.
    level_triangles: u64,
    clusters: u64,
    levels: u32,
    seconds: f64,
    /// Size of the file.
    bytes: u64,
}

/// Makes the levels of detail and writes them.
pub(crate) fn run(args: &args::Prepare, quiet: bool) -> Result<()> {
    check_file(&args.output)?;
    let bar = Bar::of_parts(quiet);
    let scene = open_scene(&args.scene, &bar)?;
    bar.aside(|| tell_notices(&scene));
    let start = Instant::now();
    let detail = Detail::levels(&scene, &bar)?;
    let seconds = start.elapsed().as_secs_f64();
    detail.write(&scene, &args.output)?;
    drop(bar);
    let meshes = detail.clusters().unwrap_or(&[]);
    let clusters = || meshes.iter().flat_map(|mesh| &mesh.clusters);
    let prepared = PreparedJson {
        scene: args.scene.name.clone(),
        triangles: scene.stored_triangles(),
        level_triangles: clusters().map(|c| u64::from(c.triangle_count)).sum(),
        clusters: clusters().count() as u64,
        levels: clusters().map(|c| c.level + 1).max().unwrap_or(0),
        seconds,
        bytes: std::fs::metadata(&args.output).map_or(0, |m| m.len()),
    };
    if args.json {
        return print(&(serde_json::to_string_pretty(&prepared)? + "\n"));
    }
    let PreparedJson { triangles, level_triangles, clusters, levels, bytes, .. } = prepared;
    print(&format!(
        "{triangles} triangles, {level_triangles} in {clusters} clusters of {levels} levels\n\
         made in {seconds:.1} s\nwrote: {} ({:.1} MB)\n",
        args.output.display(),
        bytes as f64 / 1e6
    ))
}
