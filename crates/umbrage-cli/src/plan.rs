//! `umbrage plan`: the matrices, resolutions and errors that an engine needs.

use crate::args;
use crate::output::print;
use crate::setup::{Onlooker, lamp, onlooker, open_scene, option_error, tell_notices};
use anyhow::Result;
use serde::Serialize;
use std::fmt::Write;
use umbrage::{Bounds, MapError, Planner, ShadowMap, Warp};

#[derive(Serialize)]
struct PlanJson {
    maps: Vec<MapJson>,
    storage_factor: f64,
    texels: u64,
    theta_deg: f64,
}

#[derive(Serialize)]
struct MapJson {
    /// Four columns.
    world_to_shadow: [[f64; 4]; 4],
    resolution: [u32; 2],
    /// Metres along the view.
    split: [f64; 2],
    /// `null`: the map serves the whole view.
    face: Option<&'static str>,
    /// `null`: no warp.
    lambda: Option<f64>,
    error: ErrorJson,
}

/// Pixels per texel.
#[derive(Serialize)]
struct ErrorJson {
    max_s: f64,
    max_t: f64,
    max: f64,
}

/// Plans, and prints the plan.
pub(crate) fn run(args: &args::Plan) -> Result<()> {
    let scene = args.scene.as_deref().map(open_scene).transpose()?;
    let onlooker = onlooker(&args.view, scene.as_ref())?;
    let lamp = lamp(&args.light, scene.as_ref())?;
    if let Some(scene) = &scene {
        tell_notices(scene);
    }
    let bounds = scene.map_or_else(Bounds::default, |s| Bounds::of_scene(s.bounds()));
    let mut planner = Planner::new();
    let plan = planner
        .plan(&onlooker.camera, &[lamp.light], &bounds, &args.shadows.options)
        .map_err(|e| option_error(&e))?;
    if args.json {
        if plan.maps.iter().all(ShadowMap::is_empty) {
            log::warn!("{}", nothing_served(&onlooker));
        }
        print(&format!("{}\n", serde_json::to_string_pretty(&PlanJson::from(plan))?))
    } else {
        print(&table(plan, &onlooker, args))
    }
}

impl From<&umbrage::Plan> for PlanJson {
    fn from(plan: &umbrage::Plan) -> Self {
        let maps = plan.maps.iter().map(|m| MapJson {
            world_to_shadow: m.shadow_from_world().to_cols_array_2d(),
            resolution: m.resolution,
            split: m.split,
            face: None,
            lambda: m.lambda,
            error: m.error.into(),
        });
        Self {
            maps: maps.collect(),
            storage_factor: plan.storage_factor(),
            texels: plan.texels(),
            theta_deg: plan.lights[0].theta_rad.to_degrees(),
        }
    }
}

impl From<MapError> for ErrorJson {
    fn from(e: MapError) -> Self {
        Self { max_s: e.max_s, max_t: e.max_t, max: e.max }
    }
}

/// Why a map is empty.
fn nothing_served(onlooker: &Onlooker) -> String {
    let [near, far] = [onlooker.look.near, onlooker.look.far].map(six_digits);
    format!("nothing lit between {near} and {far} metres of the view receives shadows")
}

/// As many as there is any use in reading.
fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

fn table(plan: &umbrage::Plan, onlooker: &Onlooker, args: &args::Plan) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |l: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "{l}");
    };
    line(format_args!("shadows         {}", args.shadows.spec));
    line(format_args!("view and light  {:.2}° apart", plan.lights[0].theta_rad.to_degrees()));
    line(format_args!("texels          {}", plan.texels()));
    line(format_args!("storage factor  {:.6}", plan.storage_factor()));
    for (i, map) in plan.maps.iter().enumerate() {
        line(format_args!(""));
        if map.is_empty() {
            line(format_args!("map {i}: empty: {}", nothing_served(onlooker)));
            continue;
        }
        let [w, h] = map.resolution;
        let [near, far] = map.split.map(six_digits);
        line(format_args!("map {i}: {w}x{h} texels, {near} to {far} metres"));
        let warp = match (map.lambda, args.shadows.options.warp) {
            (Some(lambda), _) => format!("λ = {lambda:.6} m"),
            (None, Warp::Psm) => "the viewer's own perspective".into(),
            (None, _) => "none".into(),
        };
        line(format_args!("  warp            {warp}"));
        let e = map.error;
        line(format_args!(
            "  pixels a texel  {:.4} across, {:.4} along, {:.4} in the worst direction, at most",
            e.max_s, e.max_t, e.max
        ));
        line(format_args!("  shadow_from_world (rows)"));
        let matrix = map.shadow_from_world();
        for row in 0..4 {
            let [a, b, c, d] = matrix.row(row).to_array();
            line(format_args!("    {a:>16.9} {b:>16.9} {c:>16.9} {d:>16.9}"));
        }
    }
    text
}
