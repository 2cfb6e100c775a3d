//! `umbrage plan` prints the matrices, resolutions and errors that an engine needs.

mod paged;

use crate::args;
use crate::output::{print, six_digits};
use crate::progress::Bar;
use crate::setup::{Chosen, choose, open_changed, tell_chosen, tell_notices};
use anyhow::{Error, Result};
use paged::Paged;
use serde::Serialize;
use std::fmt::Write;
use umbrage::{
    Atlas, Bounds, CubeSide, Face, Light, MapError, Part, Plan, ShadowMap, Size, Slab, Warp,
};
use umbrage_lab::{
    ChosenLight, ChosenView, Fit, MapCasters, NamedTechnique, Progress, Receivers, casters,
    casters_culled, planner, seen_points,
};
use umbrage_measure::{LightInfo, View};
use umbrage_scene::Scene;
use umbrage_trace::Tracer;

#[derive(Serialize)]
struct PlanJson {
    maps: Vec<MapJson>,
    storage_factor: f64,
    texels: u64,
    /// Angle θ of the first light.
    theta_deg: f64,
    lights: Vec<LightJson>,
    /// All maps side by side in one texture; `null` if it would be too large for a device.
    atlas: Option<AtlasJson>,
    /// Each map with its gutter in a layer of its own; `null` if a layer would be too large.
    layers: Option<LayersJson>,
    /// Mean over maps of the share of casters that are culled; `null` without a scene.
    casters_culled: Option<f64>,
    /// What the maps are fitted to; `null` without a scene.
    fit: Option<&'static str>,
    view: View,
}

#[derive(Serialize)]
struct LightJson {
    /// `null` if the light has no name.
    name: Option<String>,
    light: LightInfo,
    theta_deg: f64,
    /// Indices of the light's first map and of the map after its last.
    maps: [usize; 2],
}

/// The fields of a [`Slab`].
#[derive(Serialize)]
#[serde(untagged)]
enum SlabJson {
    Leaning { slope: [f64; 2], begin: f64, thickness: f64 },
    Distances { axis: [f64; 3], near: f64, far: f64 },
}

impl From<Slab> for SlabJson {
    fn from(slab: Slab) -> Self {
        match slab {
            Slab::Leaning { slope, begin, thickness } => {
                Self::Leaning { slope: slope.to_array(), begin, thickness }
            }
            Slab::Distances { axis, near, far } => {
                Self::Distances { axis: axis.to_array(), near, far }
            }
        }
    }
}

#[derive(Serialize)]
struct MapJson {
    /// The four columns of the matrix.
    world_to_shadow: [[f64; 4]; 4],
    resolution: [u32; 2],
    /// Range of distances that the map serves, metres along the view, or along the face for maps of
    /// side faces.
    split: [f64; 2],
    /// Face of the view frustum; `null` if the map is not for one face.
    face: Option<&'static str>,
    /// `null` if there is no warp.
    lambda: Option<f64>,
    error: ErrorJson,
    /// Range of depths that holds the receivers, for prefilters.
    slab: SlabJson,
    /// Index of the slice, counted from the viewer.
    slice: usize,
    /// Index of the light.
    light: usize,
    /// Side of the cube around a point light; `null` for other lights.
    side: Option<&'static str>,
    /// Whether the map has no receivers to serve, and so no texels.
    empty: bool,
    /// x, y, width and height in the atlas, texels; `null` for empty maps and without an atlas.
    rect: Option<[u32; 4]>,
    /// Numbers of drawn and culled triangles; `null` without a scene.
    casters: Option<MapCasters>,
}

/// Largest errors of a map, pixels per texel.
#[derive(Serialize)]
struct ErrorJson {
    max_s: f64,
    max_t: f64,
    max: f64,
}

#[derive(Serialize)]
struct AtlasJson {
    size: [u32; 2],
    /// Width of the gutter around each map, texels.
    gutter: u32,
}

#[derive(Serialize)]
struct LayersJson {
    size: [u32; 2],
    count: u32,
}

/// A plan with its inputs, its atlas, its layers and its casters.
struct Planned<'a> {
    technique: &'a NamedTechnique,
    view: &'a ChosenView,
    chosen_lights: &'a [ChosenLight],
    plan: &'a Plan,
    atlas: Option<Atlas>,
    layers: Option<Atlas>,
    /// Casters of each map; `None` without a scene.
    casters: Option<Vec<MapCasters>>,
    /// Mean over maps of the share of casters that are culled.
    culled: Option<f64>,
    /// What the maps are fitted to; `None` without a scene.
    fit: Option<Fit>,
}

/// Computes the plan, and prints it.
pub(crate) fn run(args: &args::Plan, quiet: bool) -> Result<()> {
    let bar = Bar::of_parts(quiet);
    let scene = args.scene.as_deref().map(|name| open_changed(name, &args.changes, &bar));
    let scene = scene.transpose()?;
    let Chosen { view, lights: chosen } =
        choose(&args.view, &args.lights.each(), scene.as_ref(), &bar)?;
    bar.stage("planning");
    let fit = Fit::from(args.fit);
    let receivers = scene.as_ref().map(|scene| match fit {
        // This is the only command that can work without a ray tracer.
        Fit::Box => Ok((Receivers::in_box(scene), None)),
        fit => {
            let tracer = Tracer::new(scene)?.opaque(args.changes.opaque);
            let receivers = Receivers::new(scene, &tracer, fit);
            let seen = receivers.seen(&tracer, &view.camera)?;
            Ok::<_, Error>((receivers, seen))
        }
    });
    let receivers = receivers.transpose()?;
    let bounds = receivers
        .as_ref()
        .map_or_else(Bounds::default, |(receivers, seen)| receivers.bounds(seen.as_ref()));
    let technique = &args.shadows;
    let lights: Vec<Light> = chosen.iter().map(|l| l.light).collect();
    let mut planner = planner();
    let max_side = planner.limits().max_side;
    let plan = planner
        .plan(&view.camera, &lights, &bounds, technique.technique())
        .map_err(|e| technique.blame(e))?;
    if plan.paging.is_some() {
        let seen = scene.as_ref().map(|scene| {
            let tracer = Tracer::new(scene)?.opaque(args.changes.opaque);
            Ok::<_, Error>(seen_points(&tracer, &view.camera))
        });
        let seen = seen.transpose()?;
        let mut plan = plan.clone();
        plan.fit_pages(seen.as_deref().unwrap_or_default());
        drop(bar);
        if let Some(scene) = &scene {
            tell_notices(scene);
        }
        tell_chosen(&view, &chosen);
        let Some(paging) = &plan.paging else { return Ok(()) };
        let (technique, chosen_lights) = (&args.shadows, &chosen[..]);
        let seen = seen.as_deref();
        let paged = Paged { technique, view: &view, chosen_lights, plan: &plan, paging, seen };
        return paged.print(args.json, args.pages);
    }
    drop(bar);
    if let Some(scene) = &scene {
        tell_notices(scene);
    }
    tell_chosen(&view, &chosen);
    let fit = scene.is_some().then_some(fit);
    let planned = Planned::new(plan, max_side, technique, &view, &chosen, scene.as_ref(), fit);
    if args.json {
        if !plan.maps.is_empty() && plan.maps.iter().all(ShadowMap::is_empty) {
            log::warn!("{}", nothing_served(&view));
        }
        print(&format!("{}\n", serde_json::to_string_pretty(&planned.json())?))
    } else {
        print(&planned.table())
    }
}

impl<'a> Planned<'a> {
    fn new(
        plan: &'a Plan,
        max_side: u32,
        technique: &'a NamedTechnique,
        view: &'a ChosenView,
        chosen_lights: &'a [ChosenLight],
        scene: Option<&Scene>,
        fit: Option<Fit>,
    ) -> Self {
        let [atlas, layers] = [Atlas::packed, Atlas::layered].map(|lay_out| {
            lay_out(plan, max_side).inspect_err(|e| log::info!("no atlas: {e}")).ok()
        });
        let casters = scene.map(|s| casters(plan, s));
        let culled = casters.as_ref().and_then(|c| casters_culled(plan, c));
        Self { technique, view, chosen_lights, plan, atlas, layers, casters, culled, fit }
    }

    /// x, y, width and height of a map in the atlas, texels; `None` if it has no place there.
    fn rect(&self, map: usize) -> Option<[u32; 4]> {
        let place = self.atlas.as_ref()?.places[map]?;
        let [width, height] = self.plan.maps[map].resolution;
        Some([place.origin[0], place.origin[1], width, height])
    }

    fn json(&self) -> PlanJson {
        let plan = self.plan;
        let maps = plan.maps.iter().enumerate().map(|(i, m)| MapJson {
            world_to_shadow: m.shadow_from_world().to_cols_array_2d(),
            resolution: m.resolution,
            split: m.split,
            face: m.part.face.map(face_name),
            lambda: m.lambda,
            error: m.error.into(),
            slab: m.slab.into(),
            slice: m.part.slice,
            light: m.part.light,
            side: m.part.side.map(side_name),
            empty: m.is_empty(),
            rect: self.rect(i),
            casters: self.casters.as_ref().map(|c| c[i]),
        });
        let atlas = self.atlas.as_ref();
        let layers = self.layers.as_ref();
        PlanJson {
            maps: maps.collect(),
            storage_factor: plan.storage_factor(),
            texels: plan.texels(),
            theta_deg: plan.lights[0].theta_rad.to_degrees(),
            lights: lights(plan, self.chosen_lights),
            atlas: atlas.map(|a| AtlasJson { size: a.size, gutter: a.gutter_texels }),
            layers: layers.map(|l| LayersJson { size: l.size, count: l.layers }),
            casters_culled: self.culled,
            fit: self.fit.map(Fit::name),
            view: self.view.info(),
        }
    }

    fn table(&self) -> String {
        let plan = self.plan;
        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut line = |l: std::fmt::Arguments<'_>| {
            let _ = writeln!(text, "{l}");
        };
        line(format_args!("shadows         {}", self.technique));
        match self.fit {
            None => {}
            Some(Fit::Box) => line(format_args!(
                "fitted to       the box around the scene (--fit surfaces fits closer)"
            )),
            Some(fit) => line(format_args!("fitted to       {}", fit.name())),
        }
        for (light, chosen) in plan.lights.iter().zip(self.chosen_lights) {
            let name = name_among(chosen, self.chosen_lights);
            line(format_args!("view and {name:<6} {:.2}° apart", light.theta_rad.to_degrees()));
        }
        let limit = match self.technique.technique().size {
            Size::MaxError(pixels) => format!(", for at most {pixels} px a texel"),
            _ => String::new(),
        };
        line(format_args!("texels          {}{limit}", plan.texels()));
        line(format_args!("storage factor  {:.6}", plan.storage_factor()));
        if plan.maps.len() > 1 {
            let atlas = match &self.atlas {
                None => "too large for one texture".into(),
                Some(a) => format!("{}, gutters of {}", sides(a.size), a.gutter_texels),
            };
            let layers = match &self.layers {
                None => String::new(),
                Some(l) => format!("; or {} layers of {}", l.layers, sides(l.size)),
            };
            line(format_args!("atlas           {atlas}{layers}"));
        }
        if let Some(share) = self.culled {
            line(format_args!("culled          {}", percent(share)));
        }
        for (i, map) in plan.maps.iter().enumerate() {
            line(format_args!(""));
            let part = self.part(map.part);
            if map.is_empty() {
                let nothing = match plan.maps.len() {
                    1 => nothing_served(self.view),
                    _ => "nothing lit there receives shadows".into(),
                };
                line(format_args!("map {i}: {part}empty: {nothing}"));
                continue;
            }
            let size = sides(map.resolution);
            let place = match self.rect(i) {
                Some([x, y, ..]) if plan.maps.len() > 1 => format!(" at {x},{y}"),
                _ => String::new(),
            };
            let [near, far] = map.split.map(six_digits);
            line(format_args!("map {i}: {part}{size} texels{place}, {near} to {far} metres"));
            let warp = match (map.lambda, self.technique.technique().warp) {
                // Under spot and point lights λ is not a length in the world, so it has no unit.
                (Some(lambda), _) if map.apex.is_some() => format!("λ = {lambda:.6}"),
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
            if let Some(MapCasters { drawn, culled }) = self.casters.as_ref().map(|c| c[i]) {
                let share = percent(culled as f64 / (drawn + culled) as f64);
                line(format_args!("  casters         {drawn} triangles, {share} culled"));
            }
            line(format_args!("  shadow_from_world (rows)"));
            write_rows(map, &mut line);
        }
        text
    }

    /// Names the light, side, face and slice of a map, as far as these tell it from other maps.
    fn part(&self, part: Part) -> String {
        let name = || self.chosen_lights[part.light].name.clone().unwrap_or_default();
        let slices = self.technique.technique().partition.slices;
        let words = [
            (self.chosen_lights.len() > 1).then(name),
            part.side.map(|s| format!("side {}", side_name(s))),
            part.face.map(|f| format!("{} face", face_name(f))),
            (slices > 1 && part.face != Some(Face::Near)).then(|| format!("slice {}", part.slice)),
        ];
        words.into_iter().flatten().fold(String::new(), |text, word| text + &word + ": ")
    }
}

fn lights(plan: &Plan, chosen: &[ChosenLight]) -> Vec<LightJson> {
    let lights = plan.lights.iter().zip(chosen).map(|(light, chosen)| LightJson {
        name: chosen.name.clone(),
        light: chosen.info(),
        theta_deg: light.theta_rad.to_degrees(),
        maps: [light.maps.start, light.maps.end],
    });
    lights.collect()
}

/// The name of a light, if there are several.
fn name_among<'a>(light: &'a ChosenLight, all: &[ChosenLight]) -> &'a str {
    light.name.as_deref().filter(|_| all.len() > 1).unwrap_or("light")
}

/// Writes the rows of a map's matrix.
fn write_rows(map: &ShadowMap, line: &mut impl FnMut(std::fmt::Arguments<'_>)) {
    let matrix = map.shadow_from_world();
    for row in 0..4 {
        let [a, b, c, d] = matrix.row(row).to_array();
        line(format_args!("    {a:>16.9} {b:>16.9} {c:>16.9} {d:>16.9}"));
    }
}

impl From<MapError> for ErrorJson {
    fn from(e: MapError) -> Self {
        Self { max_s: e.max_s, max_t: e.max_t, max: e.max }
    }
}

fn face_name(face: Face) -> &'static str {
    match face {
        Face::Bottom => "bottom",
        Face::Right => "right",
        Face::Top => "top",
        Face::Left => "left",
        Face::Near => "near",
    }
}

fn side_name(side: CubeSide) -> &'static str {
    match side {
        CubeSide::PosX => "+x",
        CubeSide::NegX => "-x",
        CubeSide::PosY => "+y",
        CubeSide::NegY => "-y",
        CubeSide::PosZ => "+z",
        CubeSide::NegZ => "-z",
    }
}

/// The message for a plan in which all maps are empty.
fn nothing_served(view: &ChosenView) -> String {
    let [near, far] = [view.camera.near(), view.camera.far()].map(six_digits);
    format!("nothing lit between {near} and {far} metres of the view receives shadows")
}

fn sides([w, h]: [u32; 2]) -> String {
    format!("{w}x{h}")
}

fn percent(share: f64) -> String {
    format!("{:.1}%", share * 100.0)
}
