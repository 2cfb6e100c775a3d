//! `umbrage compare`: techniques against ray-traced truth, as a report.

use crate::args;
use crate::output::{ReportFolder, note, print};
use crate::pixels::{self, NOTHING_TO_SHADOW, Shadowed, Texels, counted, milliseconds};
use crate::progress::Progress;
use crate::setup::{Lamp, Onlooker, lamp, onlooker, open_scene, tell_notices};
use crate::spec::Technique;
use anyhow::{Context, Result};
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;
use umbrage::{Bounds, Light, Plan};
use umbrage_measure::{
    ErrorScale, Image, LightInfo, Measured, Page, Pictures, Report, Rgb, Seen, SeenTruth, Times,
    Truth, measure, measure_error_px, texel_map, write_pictures, write_report,
    write_truth_pictures,
};
use umbrage_trace::{Reference, Tracer, View};

/// A technique at work: its maps, and the picture so far.
struct Contender<'a> {
    technique: &'a Technique,
    plan: &'a Plan,
    reference: Reference<'a>,
    ms: Times,
    shadowed: Shadowed,
    texels: Texels,
}

/// The truth's picture so far.
#[derive(Default)]
struct TruthSoFar {
    shadowed: Shadowed,
    counted: Vec<bool>,
    seconds: f64,
}

/// What shadows look like, done.
struct Picture {
    color: Image<Rgb>,
    visibility: Image<f32>,
}

/// Compares, writes the report, and prints a table or the report's JSON.
pub(crate) fn run(args: &args::Compare, quiet: bool) -> Result<()> {
    let folder = ReportFolder::check(&args.output)?;
    let scene = open_scene(&args.scene.name)?;
    let onlooker = onlooker(&args.view, Some(&scene))?;
    let lamp = lamp(&args.light, Some(&scene))?;
    let tracer = Tracer::new(&scene)?.opaque(args.scene.opaque);
    let view =
        View::new(&tracer, onlooker.camera, lamp.light, args.samples).context("--samples")?;
    let bounds = Bounds::of_scene(scene.bounds());
    let plans = args
        .shadows
        .iter()
        .map(|t| pixels::plan(t, &onlooker.camera, &lamp.light, &bounds))
        .collect::<Result<Vec<_>>>()?;

    let rows_of_maps: u64 =
        plans.iter().zip(&args.shadows).map(|((plan, _), t)| Reference::rows(plan, t.filter)).sum();
    let height = u64::from(onlooker.camera.image()[1]);
    tell_notices(&scene);
    args.execution.announce();
    // Of the picture: what is seen, the truth; each technique's lookups and measuring.
    let progress = Progress::new(rows_of_maps + height * (2 + 2 * plans.len() as u64), quiet);
    let mut contenders = Vec::new();
    for (technique, (plan, ms)) in args.shadows.iter().zip(&plans) {
        contenders.push(Contender::new(technique, plan, *ms, &tracer, &progress)?);
    }
    let truth = trace(&view, &mut contenders, &progress);
    progress.stage("measuring");

    let size = onlooker.camera.image();
    let seconds = Some(truth.seconds);
    let has_shadows = truth.counted.contains(&true);
    let counted = Image::new(size, truth.counted)?;
    let truth = Picture::new(size, truth.shadowed)?;
    let mut notices: Vec<String> = scene.notices.iter().map(|n| n.0.clone()).collect();
    if args.scene.opaque {
        notices.push("Alpha masks are ignored: masked materials show and cast as solid.".into());
    }
    let mut report = Report {
        scene: scene.name.clone(),
        size,
        view: view_info(&onlooker),
        light: light_info(&lamp),
        truth: Truth { rays_per_pixel: args.samples.pow(2), seconds },
        results: Vec::new(),
    };
    folder.replace(|path| {
        let seen =
            SeenTruth { color: &truth.color, visibility: &truth.visibility, counted: &counted };
        let truth_pictures = write_truth_pictures(path, &seen)?;
        let finished = contenders.into_par_iter().enumerate().map(|(i, contender)| {
            let finished = contender.finish(i + 1, path, &seen);
            progress.advance(height);
            finished
        });
        let (results, pictures): (_, Vec<Pictures>) =
            finished.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        report.results = results;
        write_report(
            path,
            &Page {
                report: &report,
                truth: &truth_pictures,
                pictures: &pictures,
                scale: ErrorScale::default(),
                notices: &notices,
                command: Some(&command_line()),
            },
        )?;
        Ok(())
    })?;
    drop(progress);
    if !has_shadows {
        log::warn!("{NOTHING_TO_SHADOW}");
    }

    let page = args.output.join("index.html");
    if args.json {
        note(&format!("report: {}", page.display()));
        print(&report.to_json()?)
    } else {
        print(&format!("{}\nreport: {}\n", table(&report), page.display()))
    }
}

/// Traces the truth and looks every technique's maps up, a band of the picture at a time, so that all
/// share what the camera sees.
fn trace(view: &View<'_>, contenders: &mut [Contender<'_>], progress: &Progress) -> TruthSoFar {
    let advance = |rows| progress.advance(rows);
    let mut truth = TruthSoFar::default();
    for rows in view.bands() {
        progress.stage("ray-traced truth");
        let start = Instant::now();
        let band = view.band(rows, &advance);
        let visibility = band.map(|s| view.truth(s), &advance);
        truth.seconds += start.elapsed().as_secs_f64();
        truth.counted.extend(counted(view, &band));
        truth.shadowed.push(view, &band, &visibility);
        for contender in contenders.iter_mut() {
            progress.stage(format!("{}: picture", contender.technique.spec));
            let start = Instant::now();
            let visibility = band.map(|s| contender.reference.visibility(0, s), &advance);
            *contender.ms.shade.get_or_insert(0.0) += milliseconds(start);
            contender.shadowed.push(view, &band, &visibility);
            contender.texels.push(view, &band, contender.plan, &contender.reference);
        }
    }
    truth
}

impl<'a> Contender<'a> {
    /// Renders the technique's maps.
    fn new(
        technique: &'a Technique,
        plan: &'a Plan,
        plan_ms: f64,
        tracer: &Tracer<'_>,
        progress: &Progress,
    ) -> Result<Self> {
        progress.stage(format!("{}: shadow map", technique.spec));
        let start = Instant::now();
        let reference = Reference::render(tracer, plan, technique.filter, &|rows| {
            progress.advance(rows);
        })?;
        let depth = Some(milliseconds(start));
        Ok(Self {
            technique,
            plan,
            reference,
            ms: Times { plan: Some(plan_ms), depth, ..Times::default() },
            shadowed: Shadowed::default(),
            texels: Texels::default(),
        })
    }

    /// Measures the technique and writes its pictures into `folder`.
    fn finish(
        self,
        index: usize,
        folder: &Path,
        truth: &SeenTruth<'_>,
    ) -> Result<(Measured, Pictures)> {
        let size = truth.visibility.size();
        let picture = Picture::new(size, self.shadowed)?;
        let error_px = Image::new(size, self.texels.error)?;
        let texels = texel_map(&Image::new(size, self.texels.texel)?, &picture.color)?;
        let shadows = self.technique.spec.to_string();
        let seen = Seen {
            color: &picture.color,
            visibility: &picture.visibility,
            error_px: &error_px,
            // One map serves all: there is nothing to tell apart.
            partition: None,
            texels: Some(&texels),
        };
        let pictures =
            write_pictures(folder, index, &shadows, &seen, truth, ErrorScale::default())?;
        let measured = Measured {
            shadows,
            backend: "reference".into(),
            maps: self.plan.maps.len() as u32,
            texels: self.plan.texels(),
            metrics: measure(truth.visibility, &picture.visibility, truth.counted)?,
            error_px: measure_error_px(&error_px, truth.counted)?,
            storage_factor: Some(self.plan.storage_factor()),
            ms: self.ms,
        };
        Ok((measured, pictures))
    }
}

impl Picture {
    fn new(size: [u32; 2], pixels: Shadowed) -> Result<Self> {
        Ok(Self {
            color: Image::new(size, pixels.color)?,
            visibility: Image::new(size, pixels.visibility)?,
        })
    }
}

fn view_info(onlooker: &Onlooker) -> umbrage_measure::View {
    let look = &onlooker.look;
    umbrage_measure::View {
        name: onlooker.name.clone(),
        eye: look.eye.to_array(),
        target: look.target.to_array(),
        up: look.up.to_array(),
        fov: look.fov_y_rad.to_degrees(),
        near: look.near,
        far: look.far,
    }
}

fn light_info(lamp: &Lamp) -> LightInfo {
    let name = lamp.name.clone();
    match lamp.light {
        Light::Directional { direction } => {
            LightInfo::Directional { name, direction: direction.normalize_or_zero().to_array() }
        }
        Light::Spot(spot) => LightInfo::Spot {
            name,
            position: spot.position.to_array(),
            direction: spot.direction.normalize_or_zero().to_array(),
            half_angle: spot.half_angle_rad.to_degrees(),
            range: spot.range,
        },
        Light::Point(point) => {
            LightInfo::Point { name, position: point.position.to_array(), range: point.range }
        }
    }
}

/// The command line of this process, to be pasted into a shell.
fn command_line() -> String {
    let mut words = vec!["umbrage".to_owned()];
    words.extend(std::env::args_os().skip(1).map(|w| quoted(&w.to_string_lossy())));
    words.join(" ")
}

fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=+,./:@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

fn table(report: &Report) -> String {
    let head = [
        "shadows",
        "wrong",
        "false light",
        "mean error",
        "FLIP",
        "px/texel 50%",
        "95%",
        "max",
        "plan ms",
        "depth ms",
        "shade ms",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    rows.extend(report.results.iter().map(|r| {
        let (m, e) = (&r.metrics, &r.error_px);
        [
            r.shadows.clone(),
            percent(m.wrong_fraction),
            percent(m.false_light),
            number(m.mean_abs_error, 4),
            number(m.flip, 4),
            number(e.p50, 2),
            number(e.p95, 2),
            number(e.max, 1),
            number(r.ms.plan, 3),
            number(r.ms.depth, 0),
            number(r.ms.shade, 0),
        ]
    }));
    let widths: Vec<usize> = (0..head.len())
        .map(|c| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in &rows {
        let [name, figures @ ..] = row;
        // Writing to a string cannot fail.
        let _ = write!(text, "{name:<width$}", width = widths[0]);
        for (figure, width) in figures.iter().zip(&widths[1..]) {
            let _ = write!(text, "  {figure:>width$}");
        }
        text.push('\n');
    }
    text
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |s| format!("{:.2}%", s * 100.0))
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.digits$}"))
}
