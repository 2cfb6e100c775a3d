//! Fills the template of a report's page.

use super::Page;
use super::chart::{self, Line, Tick};
use super::command;
use super::finding::{self, Finding};
use super::numbers::{count, duration_ms, percent, plain, significant, vector};
use super::table::{self, Cell, Column};
use crate::{AreaTruth, Error, LightInfo, Measured, Pictures, Report, Spots, Truth};
use askama::Template;
use serde::Serialize;

/// The template's fields. askama escapes text from users; the template marks as `safe` only text of
/// this crate and text that is escaped here.
#[derive(Template)]
#[template(path = "report.html")]
pub(super) struct Html<'a> {
    css: &'static str,
    js: &'static str,
    /// JSON for the script, escaped for use inside HTML.
    data: String,
    version: &'static str,
    scene: &'a str,
    size: [u32; 2],
    /// Whether the pictures are so small that they are enlarged without smoothing.
    small: bool,
    facts: String,
    finding: Finding,
    kinds: Vec<Kind>,
    truth: &'a Pictures,
    truth_how: String,
    results: Vec<Shown<'a>>,
    columns: Vec<Column>,
    ticks: Vec<Tick>,
    gradient: String,
    scale_max: String,
    counted: String,
    undefined: bool,
    flicker: bool,
    noise: bool,
    timed: String,
    setup: Vec<(&'static str, String)>,
    techniques: Vec<(Vec<String>, &'static str)>,
    notices: &'a [String],
    command: Option<&'a str>,
}

/// A kind of picture that the viewer can show.
#[derive(Serialize)]
struct Kind {
    id: &'static str,
    label: &'static str,
}

/// One result, as the page shows it.
struct Shown<'a> {
    result: &'a Measured,
    pictures: &'a Pictures,
    cells: Vec<Cell>,
    line: Line,
    wrong: Option<String>,
    best: bool,
    /// What the words of the result's specification mean, for a tooltip.
    meaning: String,
    /// The Rust code that makes the technique; empty if the specification is not a technique.
    code: String,
    /// The command that renders the technique in this view.
    render: String,
    /// The figures below the name on the result's card.
    figures: Vec<(&'static str, String)>,
    /// Links to the pictures that the card does not show: label and file.
    more: Vec<(&'static str, &'a str)>,
}

impl Pictures {
    /// Where the picture is most visibly wrong, column and row.
    pub(super) fn worst_spot(&self) -> Option<[u32; 2]> {
        self.spots.as_ref()?.worst()
    }

    /// The kind and the name of each file.
    pub(super) fn files(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let always = [("color", &self.color), ("visibility", &self.visibility)];
        let some = [
            ("difference", &self.difference),
            ("error", &self.error),
            ("partition", &self.partition),
            ("texels", &self.texels),
        ];
        let some = some.into_iter().filter_map(|(kind, file)| Some((kind, file.as_ref()?)));
        always.into_iter().chain(some).map(|(kind, file)| (kind, file.as_str()))
    }
}

/// The technique that was executed, as text.
fn executed(result: &Measured) -> &str {
    result.technique.as_deref().unwrap_or(&result.shadows)
}

/// What executed a technique, with the name of the GPU.
fn executor(result: &Measured) -> String {
    match &result.device {
        Some(device) => format!("{} ({device})", result.backend),
        None => result.backend.clone(),
    }
}

/// A sentence that says what the times were measured on.
fn timed(report: &Report) -> String {
    let mut executors: Vec<String> = report.results.iter().map(executor).collect();
    executors.sort();
    executors.dedup();
    let on = match &executors[..] {
        [one] if one == "reference" => {
            "rays on the CPU, which are no measure of what a renderer takes".to_owned()
        }
        all => all.join(", "),
    };
    format!("Times are wall-clock times of single frames on this machine, drawn by {on}.")
}

impl<'a> Html<'a> {
    pub(super) fn new(page: &Page<'a>) -> Result<Self, Error> {
        let Page { report, truth, pictures, scale, notices, command } = *page;
        let columns = table::columns(&report.results.iter().collect::<Vec<_>>());
        let rows = table::rows(&columns, &report.results);
        let finding = finding::of_report(report);
        let results: Vec<Shown<'a>> = report
            .results
            .iter()
            .zip(pictures)
            .zip(rows)
            .zip(chart::lines(report, scale))
            .enumerate()
            .map(|(i, (((result, pictures), cells), line))| Shown {
                result,
                pictures,
                cells,
                line,
                wrong: result.metrics.wrong_fraction.map(percent),
                best: finding.best == Some(i),
                meaning: meaning(&result.shadows),
                code: code(executed(result)).unwrap_or_default(),
                render: command::render_as(report, executed(result)),
                figures: figures(result),
                more: pictures
                    .files()
                    .filter(|(kind, _)| ["visibility", "partition", "texels"].contains(kind))
                    .map(|(kind, file)| (label(kind), file))
                    .collect(),
            })
            .collect();
        let kinds = kinds(pictures);
        let [w, h] = report.size;
        let n = results.len() as u64;
        Ok(Self {
            css: include_str!("../../assets/report.css"),
            js: concat!(
                include_str!("../../assets/report.js"),
                include_str!("../../assets/table.js")
            ),
            data: data(page, &kinds)?,
            version: env!("CARGO_PKG_VERSION"),
            scene: &report.scene,
            size: report.size,
            small: w < 480,
            facts: format!("{w} × {h} pixels · {}", plural(n, "technique")),
            finding,
            kinds,
            truth,
            truth_how: truth_how(report),
            results,
            columns,
            ticks: chart::ticks(scale),
            gradient: chart::gradient(),
            scale_max: significant(f64::from(scale.max())),
            counted: counted(report),
            undefined: report.results.iter().any(|r| r.error_px.undefined > 0),
            flicker: report.results.iter().any(|r| r.flicker.is_some()),
            noise: report.results.iter().any(|r| r.noise.is_some()),
            setup: setup(report),
            techniques: techniques(report.results.iter().map(|r| r.shadows.as_str())),
            timed: timed(report),
            notices,
            command,
        })
    }
}

fn counted(report: &Report) -> String {
    let pixels = u64::from(report.size[0]) * u64::from(report.size[1]);
    let counted = report.results[0].metrics.counted;
    let share = percent(counted as f64 / pixels as f64);
    format!("{} of the {} pixels here, {share} %", count(counted), count(pixels))
}

fn truth_how(report: &Report) -> String {
    let Truth { rays_per_pixel, seconds, area } = &report.truth;
    let mut how = rays_a_pixel(*rays_per_pixel);
    if let Some(AreaTruth { light_size, standard_error, shadow_rays_per_pixel }) = area {
        how += &format!(
            "; for soft techniques a light of {light_size}, {shadow_rays_per_pixel:.0} shadow rays \
             per pixel, standard error at most {standard_error:.4}"
        );
    }
    if let Some(seconds) = seconds {
        how += &format!(", in {}", duration_ms(seconds * 1e3));
    }
    how
}

pub(super) fn rays_a_pixel(n: u32) -> String {
    match n {
        1 => "one ray per pixel".to_owned(),
        n => format!("{n} rays per pixel"),
    }
}

/// A number of things, as in `1 view` and `1 200 views`.
pub(super) fn plural(n: u64, thing: &str) -> String {
    format!("{} {thing}{}", count(n), if n == 1 { "" } else { "s" })
}

fn label(kind: &str) -> &'static str {
    match kind {
        "color" => "Picture",
        "visibility" => "Visibility",
        "difference" => "Difference",
        "error" => "Error map",
        "partition" => "Maps",
        _ => "Texels",
    }
}

fn kinds(pictures: &[Pictures]) -> Vec<Kind> {
    let ids = ["color", "visibility", "difference", "error", "partition", "texels"];
    let shown = |id: &&str| pictures.iter().flat_map(Pictures::files).any(|(kind, _)| kind == *id);
    ids.into_iter().filter(shown).map(|id| Kind { id, label: label(id) }).collect()
}

fn figures(r: &Measured) -> Vec<(&'static str, String)> {
    let known = |v: Option<f64>| v.filter(|v| v.is_finite()).map(significant);
    let e = &r.error_px;
    let times = r.ms.total().map(duration_ms);
    [
        ("Light error", known(r.metrics.light_error)),
        ("Mean error", known(r.metrics.mean_abs_error)),
        ("ꟻLIP", known(r.metrics.flip)),
        ("px/texel, p50", known(e.p50)),
        ("px/texel, p95", known(e.p95)),
        ("px/texel, max", known(e.max)),
        ("p95 without slope", known(r.perspective_px.p95)),
        ("Storage factor", known(r.storage_factor)),
        (
            "Casters culled",
            r.casters_culled.map(|share| format!("{} %", significant(share * 100.0))),
        ),
        ("Flicker", r.flicker.map(|share| format!("{} %", significant(share * 100.0)))),
        ("Noise", known(r.noise)),
        (if r.pages.is_some() { "Pages" } else { "Maps" }, Some(count(u64::from(r.maps)))),
        ("Texels", Some(count(r.texels))),
        ("Texels a pixel", known(r.texels_per_pixel)),
        ("Bound, px/texel", known(r.bound_px)),
        ("Memory", r.bytes.map(|b| format!("{} KiB", count(b.div_ceil(1024))))),
        ("Time", times),
        ("Executed by", Some(executor(r))),
    ]
    .into_iter()
    .filter_map(|(name, figure)| Some((name, figure?)))
    .collect()
}

fn setup(report: &Report) -> Vec<(&'static str, String)> {
    let view = &report.view;
    let named =
        |name: &Option<String>| name.as_ref().map(|n| format!("“{n}”, ")).unwrap_or_default();
    let mut setup = vec![
        ("Camera", format!("{}at {} m", named(&view.name), vector(view.eye))),
        ("looks at", format!("{} m", vector(view.target))),
        ("up", vector(view.up)),
        match (view.fov, view.ortho) {
            (_, Some(height)) => ("shows", format!("{} m vertically", significant(height))),
            (fov, None) => (
                "field of view",
                fov.map_or_else(|| "unknown".to_owned(), |f| format!("{}° vertically", plain(f))),
            ),
        },
        ("range", format!("{} to {} m", significant(view.near), significant(view.far))),
    ];
    match &report.light {
        LightInfo::Directional { name, direction } => {
            setup.push((
                "Light",
                format!("{}directional, travels {}", named(name), vector(*direction)),
            ));
        }
        LightInfo::Spot { name, position, direction, half_angle, range } => setup.extend([
            ("Light", format!("{}spot at {} m", named(name), vector(*position))),
            ("shines", format!("{}, {}° to each side", vector(*direction), plain(*half_angle))),
            ("reaches", format!("{} m", significant(*range))),
        ]),
        LightInfo::Point { name, position, range } => setup.extend([
            ("Light", format!("{}point at {} m", named(name), vector(*position))),
            ("reaches", format!("{} m", significant(*range))),
        ]),
    }
    setup.push(("Truth", truth_how(report)));
    if let Some(motion) = &report.motion {
        let frames = plural(motion.frames.into(), "frame");
        setup.push(("Motion", format!("{}, {frames}", motion.kind)));
    }
    setup
}

/// The words of these specifications, each with a sentence that explains it. Words that mean the
/// same, such as `@1024` and `@2048`, stand together.
pub(super) fn techniques<'a>(
    specifications: impl Iterator<Item = &'a str>,
) -> Vec<(Vec<String>, &'static str)> {
    let mut techniques: Vec<(Vec<String>, &'static str)> = Vec::new();
    for (word, text) in specifications.flat_map(umbrage::language::explain) {
        match techniques.iter_mut().find(|(_, known)| *known == text) {
            None => techniques.push((vec![word], text)),
            Some((words, _)) if !words.contains(&word) => words.push(word),
            Some(_) => {}
        }
    }
    techniques
}

/// What the words of a specification mean, one a line.
pub(super) fn meaning(shadows: &str) -> String {
    let words = umbrage::language::explain(shadows);
    let lines: Vec<String> = words.iter().map(|(word, text)| format!("{word}: {text}")).collect();
    lines.join("\n")
}

/// The Rust code that constructs a technique; `None` if the text is not one.
pub(super) fn code(technique: &str) -> Option<String> {
    Some(technique.parse::<umbrage::Technique>().ok()?.rust_code())
}

/// The data that the script needs, as JSON that is safe inside an HTML `script` element.
fn data(page: &Page<'_>, kinds: &[Kind]) -> Result<String, Error> {
    #[derive(Serialize)]
    struct Data<'a> {
        size: [u32; 2],
        kinds: &'a [Kind],
        /// Where the magnifier opens.
        spot: Option<[u32; 2]>,
        /// The truth, followed by the results.
        items: Vec<Item<'a>>,
    }
    #[derive(Serialize)]
    struct Item<'a> {
        name: &'a str,
        wrong: Option<String>,
        spot: Option<[u32; 2]>,
        files: std::collections::BTreeMap<&'static str, String>,
    }
    let item = |name, wrong: Option<f64>, pictures: &Pictures| Item {
        name,
        wrong: wrong.map(percent),
        spot: pictures.worst_spot(),
        files: pictures.files().map(|(kind, file)| (kind, url(file))).collect(),
    };
    let results = page.report.results.iter().zip(page.pictures);
    let items = std::iter::once(item("Truth", None, page.truth))
        .chain(results.map(|(r, p)| item(&r.shadows, r.metrics.wrong_fraction, p)));
    let spots: Vec<&Spots> = page.pictures.iter().filter_map(|p| p.spots.as_ref()).collect();
    let worst = || page.pictures.iter().find_map(Pictures::worst_spot);
    let spot = Spots::most_different(&spots).or_else(worst);
    let data = Data { size: page.report.size, kinds, spot, items: items.collect() };
    // A `<` in a string could close the element or open a comment.
    Ok(serde_json::to_string(&data)?.replace('<', "\\u003c"))
}

/// The relative URL of a file.
pub(super) fn url(file: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._~/".contains(&b);
    let escape = |b: u8| {
        if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }
    };
    file.bytes().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    #[test]
    fn setup_tells_where_light_comes_from() {
        let mut report = report(&[Some(0.5)]);
        let mut say = |light: LightInfo| {
            report.light = light;
            let lines = setup(&report).into_iter().map(|(what, how)| format!("{what}: {how}"));
            let lines: Vec<String> = lines
                .skip_while(|l| !l.starts_with("Light"))
                .take_while(|l| !l.starts_with("Truth"))
                .collect();
            lines.join("; ")
        };
        let name = Some("flame".to_owned());
        let (position, direction) = ([0.0, 2.35, -1.0], [0.0, -1.0, 0.0]);
        let sun = LightInfo::Directional { name: None, direction };
        assert_eq!(say(sun), "Light: directional, travels (0, −1, 0)");
        let point = LightInfo::Point { name: name.clone(), position, range: 12.5 };
        assert_eq!(say(point), "Light: “flame”, point at (0, 2.35, −1) m; reaches: 12.5 m");
        let spot = LightInfo::Spot { name, position, direction, half_angle: 30.0, range: 12.5 };
        assert_eq!(
            say(spot),
            "Light: “flame”, spot at (0, 2.35, −1) m; shines: (0, −1, 0), 30° to each side; \
             reaches: 12.5 m"
        );
    }

    #[test]
    fn a_second_truth_is_told_of() {
        let mut report = report(&[Some(0.5)]);
        assert_eq!(truth_how(&report), "16 rays per pixel, in 1.25 s");
        let light_size = "0.53deg".to_owned();
        report.truth.area =
            Some(AreaTruth { light_size, standard_error: 0.0037, shadow_rays_per_pixel: 123.5 });
        let how = truth_how(&report);
        assert!(how.contains("; for soft techniques a light of 0.53deg, 124 shadow rays"), "{how}");
        assert!(how.ends_with("standard error at most 0.0037, in 1.25 s"), "{how}");
    }

    #[test]
    fn motion_is_shown_where_there_was_one() {
        let mut report = report(&[Some(0.5), Some(0.25)]);
        let pictures = [Pictures::default(), Pictures::default()];
        let shows = |report: &Report| {
            let page = Page {
                report,
                truth: &Pictures::default(),
                pictures: &pictures,
                scale: crate::ErrorScale::default(),
                notices: &[],
                command: None,
            };
            let html = Html::new(&page).unwrap().render().unwrap();
            [
                "<dt>Motion</dt><dd>orbit, 6 frames</dd>",
                "<dt>Flicker</dt><dd>The mean change",
                "<dt>Noise</dt><dd>How much a pixel",
            ]
            .map(|text| html.contains(text))
        };
        assert_eq!(shows(&report), [false; 3]);
        report.motion = Some(crate::Motion { kind: "orbit".to_owned(), frames: 6 });
        // No flicker was measured, because no point that faces the light is shown in both frames.
        assert_eq!(shows(&report), [true, false, false]);
        report.results[1].flicker = Some(0.0);
        assert_eq!(shows(&report), [true, true, false]);
        report.results[1].noise = Some(0.0);
        assert_eq!(shows(&report), [true; 3]);
    }

    #[test]
    fn data_cannot_leave_its_element() {
        let mut report = report(&[Some(0.5)]);
        report.results[0].shadows = "</script><!--".to_owned();
        let pictures = [Pictures { color: "a b:c?.png".to_owned(), ..Pictures::default() }];
        let truth = Pictures::default();
        let scale = crate::ErrorScale::default();
        let page = Page {
            report: &report,
            truth: &truth,
            pictures: &pictures,
            scale,
            notices: &[],
            command: None,
        };
        let data = data(&page, &kinds(&pictures)).unwrap();
        assert!(!data.contains('<'), "{data}");
        let json: serde_json::Value = serde_json::from_str(&data).unwrap();
        assert_eq!(json["items"][1]["name"], "</script><!--");
        assert_eq!(json["items"][1]["files"]["color"], "a%20b%3Ac%3F.png");
    }
}
