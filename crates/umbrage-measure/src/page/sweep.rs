//! Fills the template of a sweep's page.

use super::command;
use super::finding::{self, Finding};
use super::numbers::{percent, significant};
use super::table::{self, Cell, Column};
use super::view::{code, meaning, plural, rays_a_pixel, techniques, url};
use crate::pictures::TRUTH_COLOR;
use crate::{Error, Mean, Measured, Sweep, SweptView, write_file};
use askama::Template;
use std::path::Path;

/// A sweep with all that its page shows.
#[derive(Clone, Copy, Debug)]
pub struct SweepPage<'a> {
    /// The sweep and its figures.
    pub sweep: &'a Sweep,
    /// The command line that produced this page; `None` leaves it out.
    pub command: Option<&'a str>,
}

/// Writes `results.csv`, `results.json` and then `index.html` into `folder`, which must exist and
/// contain the views' reports. The page opens offline.
///
/// # Errors
/// There are no specifications, the results of a view are not those of the sweep's specifications,
/// the report of a view is missing in `folder`, or a file cannot be written.
pub fn write_sweep(folder: impl AsRef<Path>, page: &SweepPage<'_>) -> Result<(), Error> {
    let folder = folder.as_ref();
    let sweep = page.sweep;
    sweep.check()?;
    for (view, _) in sweep.reports() {
        let file = view.file("index.html");
        if !folder.join(&file).is_file() {
            let problem = format!("{file} is not in {}", folder.display());
            return Err(Error::Report { field: "views", problem });
        }
    }
    let path = folder.join("index.html");
    let means = sweep.means();
    let html = Html::new(page, &means)
        .render()
        .map_err(|e| Error::Encode { path: path.clone(), reason: e.to_string() })?;
    write_file(folder.join("results.csv"), sweep.to_csv()?.as_bytes())?;
    write_file(folder.join("results.json"), sweep.to_json()?.as_bytes())?;
    write_file(path, html.as_bytes())
}

/// The template's fields. askama escapes text from users; the template marks only text of this
/// crate as `safe`.
#[derive(Template)]
#[template(path = "sweep.html")]
struct Html<'a> {
    css: &'static str,
    js: &'static str,
    version: &'static str,
    name: &'a str,
    facts: String,
    finding: Finding,
    means: Vec<ShownMean<'a>>,
    means_over: String,
    any_raised: bool,
    views: Vec<Shown<'a>>,
    columns: Vec<Column>,
    undefined: bool,
    techniques: Vec<(Vec<String>, &'static str)>,
    codes: Vec<Code<'a>>,
    setup: Vec<(&'static str, String)>,
    command: Option<&'a str>,
}

/// How a technique is made.
struct Code<'a> {
    shadows: &'a str,
    code: String,
    render: String,
}

struct ShownMean<'a> {
    mean: &'a Mean,
    best: bool,
    /// What the words of the specification mean, for a tooltip.
    meaning: String,
    light: Cell,
    wrong: Cell,
    error: Cell,
}

/// One view, as the page shows it.
struct Shown<'a> {
    view: &'a SweptView,
    page: String,
    thumbnail: String,
    /// One for each technique.
    wrong: Vec<Cell>,
    rows: Vec<Row<'a>>,
}

/// One technique in one view.
struct Row<'a> {
    shadows: &'a str,
    cells: Vec<Cell>,
}

impl<'a> Html<'a> {
    fn new(page: &SweepPage<'a>, means: &'a [Mean]) -> Self {
        let SweepPage { sweep, command } = *page;
        let results: Vec<&Measured> = sweep.reports().flat_map(|(_, r)| &r.results).collect();
        let columns = table::columns(&results);
        let settings = &sweep.settings;
        let wrong = means.iter().map(|m| m.wrong_fraction).collect::<Vec<_>>();
        let error = means.iter().map(|m| m.mean_abs_error).collect::<Vec<_>>();
        let light = means.iter().map(|m| m.light_error).collect::<Vec<_>>();
        let light = table::cells(&light, significant, true);
        let finding = finding::of_sweep(sweep, means);
        let cells = table::cells(&wrong, percent, true).into_iter().zip(table::cells(
            &error,
            significant,
            true,
        ));
        let shadows = settings.shadows.iter().map(String::as_str);
        // `max_error` holds for those specifications that do not state texels.
        let executed = settings.shadows.iter().map(|shadows| match settings.max_error {
            Some(pixels) if !shadows.contains('@') => format!("{shadows}@{pixels}px"),
            _ => shadows.clone(),
        });
        let scene = sweep.views.first().map_or("SCENE", |view| view.scene.as_str());
        let codes = shadows.clone().zip(executed).filter_map(|(shadows, executed)| {
            let render = command::render(scene, &executed);
            Some(Code { shadows, code: code(&executed)?, render })
        });
        Self {
            css: include_str!("../../assets/report.css"),
            js: include_str!("../../assets/table.js"),
            version: env!("CARGO_PKG_VERSION"),
            name: &sweep.name,
            facts: facts(sweep),
            means: means
                .iter()
                .zip(light)
                .zip(cells)
                .enumerate()
                .map(|(i, ((mean, light), (wrong, error)))| ShownMean {
                    mean,
                    best: finding.best == Some(i),
                    meaning: meaning(&mean.shadows),
                    light,
                    wrong,
                    error,
                })
                .collect(),
            finding,
            means_over: means_over(sweep, means),
            any_raised: means.iter().any(|m| {
                m.light_error_raised + m.wrong_fraction_raised + m.mean_abs_error_raised > 0
            }),
            views: sweep.views.iter().map(|v| Shown::new(v, &columns)).collect(),
            undefined: results.iter().any(|r| r.error_px.undefined > 0),
            columns,
            codes: codes.collect(),
            techniques: techniques(shadows),
            setup: setup(sweep),
            command,
        }
    }
}

impl<'a> Shown<'a> {
    fn new(view: &'a SweptView, columns: &[Column]) -> Self {
        let results: &[Measured] = view.outcome.as_ref().map_or(&[], |report| &report.results);
        let wrong: Vec<_> = results.iter().map(|r| r.metrics.wrong_fraction).collect();
        Self {
            view,
            page: view.file("index.html"),
            thumbnail: view.file(TRUTH_COLOR),
            wrong: table::cells(&wrong, percent, true),
            rows: results
                .iter()
                .zip(table::rows(columns, results))
                .map(|(r, cells)| Row { shadows: &r.shadows, cells })
                .collect(),
        }
    }
}

fn facts(sweep: &Sweep) -> String {
    let mut facts = vec![
        plural(sweep.views.len() as u64, "view"),
        plural(sweep.settings.shadows.len() as u64, "technique"),
    ];
    let failed = sweep.errors().count();
    if failed > 0 {
        facts.push(format!("{failed} failed"));
    }
    if let Some(share) = &sweep.share {
        facts.push(format!("share {share}"));
    }
    facts.join(" · ")
}

/// A sentence that says which views the means are over.
fn means_over(sweep: &Sweep, means: &[Mean]) -> String {
    let views = means.first().map_or(0, |m| m.views);
    let done = sweep.reports().count();
    let mut text = format!("Over {}", plural(views as u64, "view"));
    if views < done {
        text +=
            &format!("; in {} no surface faces the light, so nothing was counted", done - views);
    }
    let failed = sweep.errors().count();
    if failed > 0 {
        text += &format!("; {failed} failed, left out here");
    }
    text + "."
}

fn fitted_to(fit: &str) -> &'static str {
    if fit == "box" { "the box around the scene" } else { "the scene's surfaces" }
}

fn setup(sweep: &Sweep) -> Vec<(&'static str, String)> {
    let settings = &sweep.settings;
    let [w, h] = settings.size;
    let mut setup = vec![
        ("Pictures", format!("{w} × {h} pixels, unless a view states its size")),
        ("Truth", rays_a_pixel(settings.samples.pow(2))),
        ("Maps fitted to", fitted_to(&settings.fit).to_owned()),
        ("Executed by", settings.backend.clone()),
    ];
    if let Some(pixels) = settings.max_error {
        let few = format!(
            "the fewest for at most {pixels} px per texel, if a technique states no texels"
        );
        setup.push(("Texels", few));
    }
    if settings.opaque {
        setup.push(("Alpha masks", "ignored: masked materials show and cast as solid".to_owned()));
    }
    setup
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::tests::sweep;

    #[test]
    fn what_is_left_out_is_said() {
        let say = |views: &[Option<&[Option<f64>]>]| {
            let sweep = sweep(views);
            means_over(&sweep, &sweep.means())
        };
        assert_eq!(say(&[Some(&[Some(0.5)])]), "Over 1 view.");
        assert_eq!(
            say(&[Some(&[Some(0.5)]), Some(&[None]), None]),
            "Over 1 view; in 1 no surface faces the light, so nothing was counted; 1 failed, left out \
             here."
        );
    }

    #[test]
    fn pages_of_missing_reports_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let sweep = sweep(&[Some(&[Some(0.5)])]);
        let page = SweepPage { sweep: &sweep, command: None };
        let error = write_sweep(folder.path(), &page).unwrap_err().to_string();
        assert!(error.starts_with("views: views/view 0/index.html is not in "), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
