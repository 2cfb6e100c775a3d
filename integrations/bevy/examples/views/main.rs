//! Measures Bevy's shadows and Umbrage's against ray-traced truth in many views, and prints tables.

#[path = "../harness/mod.rs"]
mod harness;
mod truth;
mod view;

use bevy::light::ShadowFilteringMethod;
use bevy::prelude::Msaa;
use bevy_umbrage::umbrage::Camera;
use harness::glb::add_glb;
use harness::options::{Options, Problem, end, wrong};
use harness::{BEVYS_OVERLAP, Harness, MAX_SIDE, Setup, Umbrage, median};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use truth::Pixel;
use view::View;

const USAGE: &str = "\
views [options] WHAT…
WHAT is off (Bevy as it comes), lookup (its cascades, Umbrage's lookup), or a technique such as
adaptive+z4@2048, whose maps have 2048² texels in all; without @ each has --map-size.
  --views FILE         the project's ../shared/peers/views.json
  --view NAME          only this view; may be repeated
  --scenes DIR         $UMBRAGE_SCENES, or the project's ../shared/scenes
  --filter NAME        hardware2x2 (default) | gaussian | temporal
  --cascades K         4 (1 to 4), for off and lookup
  --map-size N         1024: each cascade's map is N x N; a power of two
  --method NAME        forward (default) | deferred
  --msaa N             1 (default) | 2 | 4 | 8
  --frames N           8: frames timed with shadows, and as many without
  --turn DEG           also draws N frames in which the camera turns by DEG about the vertical in
                       all. Errors are then means over these frames, planning is timed in them, and
                       flicker is measured: how much the shadow on a point changes from one frame's
                       maps to the next frame's, where the truth does not, in the same slice
Truths are kept in target/truth. Without --turn, planning is timed in a still view, where plans find
all as in the frame before.";

const KNOWN: &[&str] = &[
    "views", "view", "scenes", "filter", "cascades", "map-size", "method", "msaa", "frames", "turn",
];

/// The pictures' size, pixels.
const SIZE: [u32; 2] = [960, 540];

/// Shares of pixels below this count as this in geometric means, where zero would count alone.
const LEAST_SHARE: f64 = 1e-6;

/// What a run measures, apart from the views.
struct Run {
    variants: Vec<Variant>,
    scenes: PathBuf,
    filter: ShadowFilteringMethod,
    cascades: usize,
    map_size: u32,
    deferred: bool,
    msaa: Msaa,
    frames: usize,
    turn_rad: Option<f64>,
}

/// A way to make shadows.
struct Variant {
    text: String,
    umbrage: Umbrage,
    map_size: u32,
}

/// What was found of a view and a variant.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Share of pixels whose visibility is wrong by more than 1/2.
    wrong: f64,
    /// Mean error of visibility.
    mean: f64,
    /// Mean change of visibility where the truth does not change; `None` without motion.
    flicker: Option<f64>,
    /// Share of pixels in which rays and Bevy agree whether a surface that faces the sun is seen.
    agreement: f64,
    on_ms: f64,
    off_ms: f64,
    /// `None` if nothing is planned.
    planning_ms: Option<f64>,
}

fn main() -> ExitCode {
    end(run())
}

fn run() -> Result<(), Problem> {
    let options = Options::of_command_line(KNOWN, USAGE)?;
    let run = Run::of(&options)?;
    let views = views(&options)?;
    let mut found = Vec::new();
    for view in &views {
        let failed = |e: String| Problem::Failure(format!("{}: {e}", view.name));
        let steps = if run.turn_rad.is_some() { run.frames } else { 1 };
        let angle = |i: usize| run.turn_rad.unwrap_or(0.0) * i as f64 / (steps.max(2) - 1) as f64;
        let frames: Vec<View> = (0..steps).map(|i| view.turned(angle(i))).collect();
        let cameras: Vec<Camera> =
            frames.iter().map(|f| f.camera(SIZE)).collect::<Result<_, _>>().map_err(failed)?;
        eprintln!("{}: truth", view.name);
        let scene = run.scenes.join(&view.scene);
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/truth");
        let truth = truth::truth(view, &cameras, &scene, &folder).map_err(failed)?;
        let mut row = Vec::new();
        for variant in &run.variants {
            eprintln!("{}: {}", view.name, variant.text);
            let failed = |e: String| failed(format!("{}: {e}", variant.text));
            row.push(run.measure(&frames, &truth, &scene, variant).map_err(failed)?);
        }
        found.push((view.name.as_str(), row));
    }
    run.print(&found);
    Ok(())
}

/// Returns the views that are asked for.
fn views(options: &Options) -> Result<Vec<View>, Problem> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/peers/views.json");
    let file = options.text("views").map_or(shared, PathBuf::from);
    let all = View::all(&file).map_err(Problem::Failure)?;
    let wanted: Vec<&str> = options.all("view").collect();
    if let Some(name) = wanted.iter().find(|name| !all.iter().any(|v| v.name == **name)) {
        let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
        return Err(wrong("view", &format!("there is no {name:?}, but {}", names.join(", "))));
    }
    Ok(all.into_iter().filter(|v| wanted.is_empty() || wanted.contains(&v.name.as_str())).collect())
}

impl Run {
    fn of(options: &Options) -> Result<Self, Problem> {
        let map_size = options.whole("map-size", 1, MAX_SIDE as usize)?.unwrap_or(1024) as u32;
        if !map_size.is_power_of_two() {
            return Err(wrong("map-size", &format!("must be a power of two, is {map_size}")));
        }
        let variant = |text: &String| {
            let (umbrage, side) = harness::umbrage(text).map_err(Problem::Usage)?;
            Ok(Variant { text: text.clone(), umbrage, map_size: side.unwrap_or(map_size) })
        };
        let variants = options.words.iter().map(variant).collect::<Result<Vec<_>, Problem>>()?;
        if variants.is_empty() {
            return Err(Problem::Usage(
                "nothing to measure: give off, lookup or techniques".into(),
            ));
        }
        let scenes = options.text("scenes").map(PathBuf::from);
        let scenes = scenes.or_else(|| std::env::var_os("UMBRAGE_SCENES").map(PathBuf::from));
        let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
        let deferred = match options.text("method").unwrap_or("forward") {
            "forward" => false,
            "deferred" => true,
            other => {
                let problem = format!("must be forward or deferred, is {other:?}");
                return Err(wrong("method", &problem));
            }
        };
        let msaa = match options.text("msaa").unwrap_or("1") {
            "1" => Msaa::Off,
            "2" => Msaa::Sample2,
            "4" => Msaa::Sample4,
            "8" => Msaa::Sample8,
            other => return Err(wrong("msaa", &format!("must be 1, 2, 4 or 8, is {other:?}"))),
        };
        let turn = options.number("turn")?;
        if turn.is_some_and(|turn| turn.abs() > 360.0) {
            return Err(wrong("turn", "must be 360 degrees at most"));
        }
        if deferred && msaa != Msaa::Off {
            return Err(wrong("msaa", "must be 1 with --method deferred"));
        }
        let least = if turn.is_some() { 2 } else { 1 };
        let filter = options.text("filter").unwrap_or("hardware2x2");
        Ok(Self {
            variants,
            scenes: scenes.unwrap_or(shared),
            filter: harness::filter(filter).map_err(|e| wrong("filter", &e))?,
            cascades: options.whole("cascades", 1, 4)?.unwrap_or(4),
            map_size,
            deferred,
            msaa,
            frames: options.whole("frames", least, 10_000)?.unwrap_or(8),
            turn_rad: turn.map(|degrees| f64::from(degrees).to_radians()),
        })
    }

    /// Draws the frames, and compares them with their truth.
    fn measure(
        &self,
        frames: &[View],
        truth: &[Vec<Pixel>],
        scene: &Path,
        variant: &Variant,
    ) -> Result<Found, String> {
        let view = frames[0].view_point();
        let mut setup = Setup::new(view, frames[0].sun())?;
        setup.size = SIZE;
        setup.cascades =
            harness::cascades(self.cascades, [view.near, view.far], None, BEVYS_OVERLAP)?;
        setup.map_size = variant.map_size;
        setup.filter = self.filter;
        setup.msaa = self.msaa;
        setup.deferred = self.deferred;
        setup.umbrage = variant.umbrage.clone();
        let mut harness = Harness::new(&setup)?;
        add_glb(&mut harness, scene, 1.0)?;
        let still = harness.measure(self.frames, 2)?;
        let mut planning_ms = still.planning_ms;
        let mut pairs = vec![Drawn::of(&still.shadowed, None, &still.unshadowed)];
        if self.turn_rad.is_some() {
            (pairs, planning_ms) = turn(&mut harness, frames)?;
        }
        harness.check()?;

        let mut sums = Sums::default();
        for (drawn, truth) in pairs.iter().zip(truth) {
            sums.add(drawn, truth);
        }
        let found = sums.found(self.turn_rad.is_some())?;
        Ok(Found {
            on_ms: median(&still.on_ms).unwrap_or_default(),
            off_ms: median(&still.off_ms).unwrap_or_default(),
            planning_ms: median(&planning_ms),
            ..found
        })
    }

    /// Prints the tables.
    fn print(&self, found: &[(&str, Vec<Found>)]) {
        let off = self.variants.iter().position(|v| matches!(v.umbrage, Umbrage::Off));
        println!(
            "{} x {}, {:?}, {:?}{}; `off` and `lookup`: {} cascades of {}²",
            SIZE[0],
            SIZE[1],
            self.filter,
            self.msaa,
            if self.deferred { ", deferred" } else { "" },
            self.cascades,
            self.map_size,
        );
        self.table(
            "Wrong pixels / mean error of visibility, %",
            found,
            off,
            &[|f| Some(f.wrong), |f| Some(f.mean)],
        );
        if self.turn_rad.is_some() {
            let title = "Flicker: mean change of visibility from frame to frame, %";
            self.table(title, found, off, &[|f| f.flicker]);
        }

        println!(
            "\nms a frame with / without shadows; of it planning; agreement of rays and Bevy\n"
        );
        self.head();
        for (view, row) in found {
            let cell = |f: &Found| {
                let planning = f.planning_ms.map_or("–".into(), |ms| format!("{ms:.3}"));
                let agreement = 100.0 * f.agreement;
                format!("{:.1} / {:.1}; {planning}; {agreement:.2}%", f.on_ms, f.off_ms)
            };
            println!("| {view} | {} |", row.iter().map(cell).collect::<Vec<_>>().join(" | "));
        }
        let cell = |v: usize| {
            let mean = |of: fn(&Found) -> Option<f64>| mean(found.iter().map(|(_, r)| of(&r[v])));
            let ratio = mean(|f| Some(f.on_ms / f.off_ms)).unwrap_or_default();
            let planning = mean(|f| f.planning_ms).map_or("–".into(), |ms| format!("{ms:.3}"));
            format!("{ratio:.2} times; {planning}")
        };
        let cells: Vec<String> = (0..self.variants.len()).map(cell).collect();
        println!("| geometric mean | {} |", cells.join(" | "));
    }

    fn head(&self) {
        let names: Vec<String> = self.variants.iter().map(|v| format!("`{}`", v.text)).collect();
        println!("| view | {} |", names.join(" | "));
        println!("| --- |{}", " --- |".repeat(names.len()));
    }

    /// Prints a table of shares, with their geometric means and the ratios of these to those of the
    /// variant `off`.
    fn table(
        &self,
        title: &str,
        found: &[(&str, Vec<Found>)],
        off: Option<usize>,
        columns: &[Column],
    ) {
        println!("\n{title}\n");
        self.head();
        let percent =
            |share: Option<f64>| share.map_or("–".into(), |s| format!("{:.3}", 100.0 * s));
        let join = |cells: Vec<String>, by: &str| cells.join(by);
        for (view, row) in found {
            let cell = |f: &Found| join(columns.iter().map(|c| percent(c(f))).collect(), " / ");
            println!("| {view} | {} |", join(row.iter().map(cell).collect(), " | "));
        }
        let mean_of = |column: Column, variant: usize| {
            mean(found.iter().map(|(_, row)| column(&row[variant]).map(|s| s.max(LEAST_SHARE))))
        };
        let line = |name: &str, value: &dyn Fn(Column, usize) -> String| {
            let cell = |v| join(columns.iter().map(|&c| value(c, v)).collect(), " / ");
            let cells = (0..self.variants.len()).map(cell).collect();
            println!("| {name} | {} |", join(cells, " | "));
        };
        line("geometric mean", &|column, v| percent(mean_of(column, v)));
        if let Some(off) = off {
            line("ratio to `off`", &|column, v| {
                // Of what does not flicker at all, nothing is a multiple.
                let off = mean_of(column, off).filter(|share| *share > LEAST_SHARE);
                let ratio = mean_of(column, v).zip(off).map(|(a, b)| a / b);
                ratio.map_or("–".into(), |ratio| format!("{ratio:.3}"))
            });
        }
    }
}

/// A share that a table shows of what was found.
type Column = fn(&Found) -> Option<f64>;

/// The geometric mean of values above 0; `None` if any is missing.
fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let logarithms: Vec<f64> = values.map(|v| v.map(f64::ln)).collect::<Option<_>>()?;
    Some((logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp())
}

/// What was drawn of a frame.
struct Drawn {
    /// Visibility by the frame's own maps.
    visibility: Vec<f32>,
    /// Visibility by the maps of the frame before, if there is one.
    before: Option<Vec<f32>>,
    /// Whether Bevy's picture tells the visibility.
    counts: Vec<bool>,
}

impl Drawn {
    fn of(shadowed: &[f32], before: Option<&[f32]>, unshadowed: &[f32]) -> Self {
        Self {
            visibility: harness::visibility(shadowed, unshadowed),
            before: before.map(|before| harness::visibility(before, unshadowed)),
            counts: unshadowed.iter().map(|&u| harness::counts(u)).collect(),
        }
    }
}

/// Draws the frames of a motion, and returns the times of their plans with them. Where the program
/// `umbrage` follows a point back to the frame before, this draws the new frame with the maps of the
/// frame before. Both look the same point up in both frames' maps. But Bevy chooses the slice by the
/// new frame's depth here, so what changes because a point passes from slice to slice is not found.
fn turn(harness: &mut Harness, frames: &[View]) -> Result<(Vec<Drawn>, Vec<f64>), String> {
    let pose = |frame: &View| {
        let point = frame.view_point();
        harness::looking(point.eye, point.target)
    };
    // The pictures without shadows come first, because a change of shadows changes pipelines.
    harness.set_shadows(false);
    harness.settle()?;
    let mut unshadowed = Vec::new();
    for frame in frames {
        harness.set_camera(pose(frame));
        harness.frame();
        unshadowed.push(harness.brightness()?);
    }
    harness.set_camera(pose(&frames[0]));
    harness.set_shadows(true);
    harness.settle()?;
    let (mut drawn, mut planning_ms) = (Vec::new(), Vec::new());
    for (i, (frame, unshadowed)) in frames.iter().zip(&unshadowed).enumerate() {
        harness.set_camera(pose(frame));
        let before = if i == 0 {
            None
        } else {
            harness.hold_maps(true);
            harness.frame();
            // The plan of this frame is made anew here, but not again below.
            planning_ms.extend(harness.planning_ms());
            harness.hold_maps(false);
            Some(harness.brightness()?)
        };
        harness.frame();
        drawn.push(Drawn::of(&harness.brightness()?, before.as_deref(), unshadowed));
    }
    Ok((drawn, planning_ms))
}

/// Sums over pixels.
#[derive(Default)]
struct Sums {
    pixels: u64,
    agree: u64,
    counted: u64,
    wrong: u64,
    error: f64,
    steady: u64,
    change: f64,
}

impl Sums {
    fn add(&mut self, drawn: &Drawn, truth: &[Pixel]) {
        for (i, truth) in truth.iter().enumerate() {
            self.pixels += 1;
            self.agree += u64::from(truth.is_bright() == drawn.counts[i]);
            if !(truth.counts() && drawn.counts[i]) {
                continue;
            }
            let error = f64::from((drawn.visibility[i] - truth.visibility()).abs());
            self.counted += 1;
            self.wrong += u64::from(error > 0.5);
            self.error += error;
            if let Some(before) = drawn.before.as_ref().filter(|_| truth.is_steady()) {
                self.steady += 1;
                self.change += f64::from((drawn.visibility[i] - before[i]).abs());
            }
        }
    }

    fn found(&self, is_in_motion: bool) -> Result<Found, String> {
        if self.counted == 0 {
            return Err("no pixel shows a surface that faces the sun".into());
        }
        let counted = self.counted as f64;
        Ok(Found {
            wrong: self.wrong as f64 / counted,
            mean: self.error / counted,
            flicker: is_in_motion.then(|| self.change / self.steady.max(1) as f64),
            agreement: self.agree as f64 / self.pixels as f64,
            ..Found::default()
        })
    }
}
