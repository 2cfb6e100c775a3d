//! `umbrage scenes` lists the built-in scenes.

use crate::args;
use crate::output::print;
use anyhow::Result;
use serde::Serialize;
use std::fmt::Write;
use umbrage_scene::builtins;

#[derive(Serialize)]
struct SceneJson {
    name: &'static str,
    about: &'static str,
    size_means: &'static str,
    default_size: u32,
    max_size: u32,
}

/// Prints the list of built-in scenes, as text or JSON.
pub(crate) fn run(args: &args::Scenes) -> Result<()> {
    if args.json {
        let scenes: Vec<SceneJson> = builtins()
            .iter()
            .map(|b| SceneJson {
                name: b.name,
                about: b.about,
                size_means: b.size_means,
                default_size: b.default_size,
                max_size: b.max_size,
            })
            .collect();
        return print(&format!("{}\n", serde_json::to_string_pretty(&scenes)?));
    }
    let mut text = String::new();
    let width = builtins().iter().map(|b| b.name.len()).max().unwrap_or(0);
    for b in builtins() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:width$}  {}", b.name, b.about);
        let _ = writeln!(
            text,
            "{:width$}  {}:N, 1 to {}: {} (default {})",
            "", b.name, b.max_size, b.size_means, b.default_size
        );
    }
    print(&text)
}
