//! Comparisons in many views, as tables and means.

use crate::{Error, ErrorPx, LightInfo, Measured, Metrics, Report, View};
use serde::{Deserialize, Serialize};

/// The same techniques compared in many views.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// What it is called on the page.
    pub name: String,
    /// Which part of the views this is, as `2/8`; `None`: all.
    pub share: Option<String>,
    /// What was asked for in every view.
    pub settings: SweepSettings,
    /// In the order they were asked for.
    pub views: Vec<SweptView>,
}

/// What all views of a sweep have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepSettings {
    /// The shadow specifications.
    pub shadows: Vec<String>,
    /// Pixels per texel at most, where a specification says nothing of texels; `None`: the default budget.
    pub max_error: Option<f64>,
    /// Width and height of the pictures, pixels, where a view has none of its own.
    pub size: [u32; 2],
    /// Rays along each side of a pixel.
    pub samples: u32,
    /// Whether alpha-masked materials cast and show as solid.
    pub opaque: bool,
    /// What the maps are fitted to: `box` or `surfaces`.
    pub fit: String,
    /// What renders the shadow maps.
    pub backend: String,
}

/// One view of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptView {
    /// Its name, which no other view of the sweep has.
    pub name: String,
    /// The scene as it was asked for.
    pub scene: String,
    /// Where its report lies, relative to the sweep's folder, with `/` between names.
    pub folder: String,
    /// Its report, with one result for each of the sweep's specifications in their order, or why there is
    /// none.
    pub outcome: Result<Report, String>,
}

/// What one specification comes to over all views in which anything was counted.
///
/// A geometric mean weighs each view alike, however hard it is, and has the same ratios whatever is
/// compared with whatever. It knows no zero: a view with no wrong pixel would outweigh all the others.
/// So a figure counts as no less than one wrong pixel of the view, 1 / counted pixels, which is what the
/// view can resolve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The shadow specification.
    pub shadows: String,
    /// How many views were counted.
    pub views: usize,
    /// Geometric mean of [`Metrics::wrong_fraction`]; `None` if no view was counted.
    pub wrong_fraction: Option<f64>,
    /// How many views entered that mean as one wrong pixel, being less.
    pub wrong_fraction_raised: usize,
    /// Geometric mean of [`Metrics::mean_abs_error`]; `None` if no view was counted.
    pub mean_abs_error: Option<f64>,
    /// How many views entered that mean as one wrong pixel, being less.
    pub mean_abs_error_raised: usize,
}

impl Report {
    /// The same without its wall-clock times, which differ from run to run.
    pub fn without_times(mut self) -> Self {
        self.truth.seconds = None;
        self.results.iter_mut().for_each(|r| r.ms = crate::Times::default());
        self
    }
}

impl SweptView {
    /// Address of its report's page, relative to the sweep's folder.
    pub(crate) fn file(&self, name: &str) -> String {
        format!("{}/{name}", self.folder)
    }
}

impl Sweep {
    /// Checks that the views' results belong to the sweep's specifications.
    pub(crate) fn check(&self) -> Result<(), Error> {
        for view in &self.views {
            let Ok(report) = &view.outcome else { continue };
            if !report.results.iter().map(|r| &r.shadows).eq(&self.settings.shadows) {
                return Err(Error::Report {
                    field: "views",
                    problem: format!("results of `{}` must be those of the sweep", view.name),
                });
            }
        }
        Ok(())
    }

    /// Views that have a report, with it.
    pub(crate) fn reports(&self) -> impl Iterator<Item = (&SweptView, &Report)> {
        self.views.iter().filter_map(|v| Some((v, v.outcome.as_ref().ok()?)))
    }

    /// Views that have none, and why.
    pub(crate) fn errors(&self) -> impl Iterator<Item = (&SweptView, &str)> {
        self.views.iter().filter_map(|v| Some((v, v.outcome.as_ref().err()?.as_str())))
    }

    /// One a specification, in the sweep's order.
    pub fn means(&self) -> Vec<Mean> {
        let shadows = self.settings.shadows.iter().enumerate();
        let mean = |(i, shadows): (usize, &String)| {
            let metrics = self.reports().filter_map(|(_, r)| Some(&r.results.get(i)?.metrics));
            let counted: Vec<&Metrics> = metrics.filter(|m| m.counted > 0).collect();
            let (wrong_fraction, wrong_fraction_raised) =
                geometric_mean(&counted, |m| m.wrong_fraction);
            let (mean_abs_error, mean_abs_error_raised) =
                geometric_mean(&counted, |m| m.mean_abs_error);
            Mean {
                shadows: shadows.clone(),
                views: counted.len(),
                wrong_fraction,
                wrong_fraction_raised,
                mean_abs_error,
                mean_abs_error_raised,
            }
        };
        shadows.map(mean).collect()
    }

    /// The text of `results.json`: all figures but wall-clock times.
    ///
    /// # Errors
    /// None for sweeps that this crate's types can hold.
    pub fn to_json(&self) -> Result<String, Error> {
        let json = SweepJson {
            version: env!("CARGO_PKG_VERSION"),
            share: self.share.as_deref(),
            settings: &self.settings,
            means: self.means(),
            views: self
                .reports()
                .map(|(view, report)| ViewJson {
                    name: &view.name,
                    scene: &view.scene,
                    report: view.file("report.json"),
                    size: report.size,
                    view: &report.view,
                    light: &report.light,
                    results: report.results.iter().map(ResultJson::from).collect(),
                })
                .collect(),
            errors: self
                .errors()
                .map(|(view, error)| ErrorJson { name: &view.name, scene: &view.scene, error })
                .collect(),
        };
        Ok(serde_json::to_string_pretty(&json)? + "\n")
    }

    /// The text of `results.csv`: a row for each view and specification; a view that failed has one row
    /// with its error.
    ///
    /// # Errors
    /// None for sweeps that this crate's types can hold.
    pub fn to_csv(&self) -> Result<String, Error> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        let figures = CSV.map(|(heading, _)| heading);
        csv.write_record(["view", "scene", "width", "height"].iter().chain(&figures))?;
        for view in &self.views {
            let names = [&view.name, &view.scene].map(String::as_str);
            match &view.outcome {
                Ok(report) => {
                    let size = report.size.map(|n| n.to_string());
                    for result in &report.results {
                        let figures = CSV.map(|(_, figure)| figure(result));
                        let size = size.iter().map(String::as_str);
                        let figures = figures.iter().map(String::as_str);
                        csv.write_record(names.into_iter().chain(size).chain(figures))?;
                    }
                }
                Err(error) => {
                    let figures =
                        CSV.map(|(heading, _)| if heading == "error" { error } else { "" });
                    csv.write_record(names.into_iter().chain(["", ""]).chain(figures))?;
                }
            }
        }
        let bytes = csv.into_inner().map_err(|e| Error::Table(e.into_error().into()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// The columns of `results.csv` behind the view's own.
type CsvColumn = (&'static str, fn(&Measured) -> String);
const CSV: [CsvColumn; 18] = [
    ("shadows", |r| r.shadows.clone()),
    ("backend", |r| r.backend.clone()),
    ("maps", |r| r.maps.to_string()),
    ("texels", |r| r.texels.to_string()),
    ("counted_pixels", |r| r.metrics.counted.to_string()),
    ("wrong_fraction", |r| number(r.metrics.wrong_fraction)),
    ("false_light", |r| number(r.metrics.false_light)),
    ("false_shadow", |r| number(r.metrics.false_shadow)),
    ("mean_abs_error", |r| number(r.metrics.mean_abs_error)),
    ("flip", |r| number(r.metrics.flip)),
    ("error_px_p50", |r| number(r.error_px.p50)),
    ("error_px_p95", |r| number(r.error_px.p95)),
    ("error_px_max", |r| number(r.error_px.max)),
    ("error_px_undefined", |r| r.error_px.undefined.to_string()),
    ("storage_factor", |r| number(r.storage_factor)),
    ("casters_culled", |r| number(r.casters_culled)),
    ("bytes", |r| r.bytes.map(|b| b.to_string()).unwrap_or_default()),
    ("error", |_| String::new()),
];

/// The shortest text that reads back as the same number; nothing where there is none.
fn number(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map(|v| v.to_string()).unwrap_or_default()
}

#[derive(Serialize)]
struct SweepJson<'a> {
    version: &'static str,
    share: Option<&'a str>,
    settings: &'a SweepSettings,
    means: Vec<Mean>,
    views: Vec<ViewJson<'a>>,
    errors: Vec<ErrorJson<'a>>,
}

#[derive(Serialize)]
struct ViewJson<'a> {
    name: &'a str,
    scene: &'a str,
    report: String,
    size: [u32; 2],
    view: &'a View,
    light: &'a LightInfo,
    results: Vec<ResultJson<'a>>,
}

#[derive(Serialize)]
struct ErrorJson<'a> {
    name: &'a str,
    scene: &'a str,
    error: &'a str,
}

/// [`Measured`] without times.
#[derive(Serialize)]
struct ResultJson<'a> {
    shadows: &'a str,
    backend: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    device: Option<&'a str>,
    maps: u32,
    texels: u64,
    bytes: Option<u64>,
    #[serde(flatten)]
    metrics: &'a Metrics,
    error_px: &'a ErrorPx,
    storage_factor: Option<f64>,
    casters_culled: Option<f64>,
}

impl<'a> From<&'a Measured> for ResultJson<'a> {
    fn from(measured: &'a Measured) -> Self {
        // Sweeps stand still, and their tables tell no times.
        let Measured {
            shadows,
            technique: _,
            backend,
            device,
            maps,
            texels,
            bytes,
            metrics,
            error_px,
            storage_factor,
            casters_culled,
            flicker: _,
            noise: _,
            ms: _,
        } = measured;
        Self {
            shadows,
            backend,
            device: device.as_deref(),
            maps: *maps,
            texels: *texels,
            bytes: *bytes,
            metrics,
            error_px,
            storage_factor: *storage_factor,
            casters_culled: *casters_culled,
        }
    }
}

/// Geometric mean of a figure over views, and how many of them had to be raised to one wrong pixel.
fn geometric_mean(
    counted: &[&Metrics],
    figure: impl Fn(&Metrics) -> Option<f64>,
) -> (Option<f64>, usize) {
    let values: Vec<(f64, f64)> =
        counted.iter().filter_map(|m| Some((figure(m)?, 1.0 / m.counted as f64))).collect();
    if values.is_empty() {
        return (None, 0);
    }
    let logarithms: f64 = values.iter().map(|&(value, least)| value.max(least).ln()).sum();
    let raised = values.iter().filter(|(value, least)| value < least).count();
    (Some((logarithms / values.len() as f64).exp()), raised)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::report::tests::report;
    use serde_json::{Value, json};

    /// A sweep whose views have results of the given shares of wrong pixels; `None`: a view that failed.
    pub(crate) fn sweep(views: &[Option<&[Option<f64>]>]) -> Sweep {
        let n = views.iter().flatten().map(|v| v.len()).max().unwrap_or(0);
        let view = |(i, wrong): (usize, &Option<&[Option<f64>]>)| SweptView {
            name: format!("view {i}"),
            scene: "yard/pole.glb".to_owned(),
            folder: format!("views/view {i}"),
            outcome: wrong.map(report).ok_or_else(|| "no file, \"sorry\"".to_owned()),
        };
        Sweep {
            name: "demo".to_owned(),
            share: None,
            settings: SweepSettings {
                shadows: (0..n).map(|i| format!("lambda={i}@1024")).collect(),
                max_error: None,
                size: [64, 48],
                samples: 4,
                opaque: true,
                fit: "surfaces".to_owned(),
                backend: "reference".to_owned(),
            },
            views: views.iter().enumerate().map(view).collect(),
        }
    }

    #[test]
    fn means_are_geometric_over_the_counted_views() {
        let sweep = sweep(&[
            Some(&[Some(0.1), Some(0.02)]),
            None,
            Some(&[Some(0.4), Some(0.0)]),
            Some(&[None, None]),
        ]);
        let means = sweep.means();
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() / b - 1.0).abs() < 1e-12, "{a:?}");
        assert_eq!(means[0].shadows, "lambda=0@1024");
        assert_eq!([means[0].views, means[1].views], [2, 2]);
        near(means[0].wrong_fraction, 0.2);
        near(means[0].mean_abs_error, 0.2);
        assert_eq!(means[0].wrong_fraction_raised, 0);
        // Nothing wrong counts as one wrong pixel of the thousand that were counted.
        near(means[1].wrong_fraction, (0.02_f64 * 0.001).sqrt());
        assert_eq!(means[1].wrong_fraction_raised, 1);
        assert_eq!(means[1].mean_abs_error_raised, 1);
    }

    #[test]
    fn without_a_counted_view_there_is_no_mean() {
        let mut sweep = sweep(&[None, Some(&[None])]);
        assert_eq!(sweep.means()[0].wrong_fraction, None);
        assert_eq!(sweep.means()[0].views, 0);
        sweep.views.clear();
        assert_eq!(sweep.means()[0].mean_abs_error, None);
    }

    #[test]
    fn json_has_all_figures_but_times() {
        let sweep = sweep(&[Some(&[Some(0.25)]), None]);
        let json: Value = serde_json::from_str(&sweep.to_json().unwrap()).unwrap();
        let mut expected = serde_json::to_value(&report(&[Some(0.25)]).results[0]).unwrap();
        expected.as_object_mut().unwrap().remove("ms");
        assert_eq!(json["views"][0]["results"], json!([expected]));
        assert_eq!(json["views"][0]["report"], "views/view 0/report.json");
        assert_eq!(json["views"][0]["view"]["fov"], 60.0);
        assert_eq!(json["settings"]["samples"], 4);
        assert_eq!(json["means"][0]["wrong_fraction"], 0.25);
        let error =
            json!({"name": "view 1", "scene": "yard/pole.glb", "error": "no file, \"sorry\""});
        assert_eq!(json["errors"], json!([error]));
    }

    #[test]
    fn csv_reads_back() {
        let sweep = sweep(&[Some(&[Some(1.0 / 3.0), None]), None]);
        let text = sweep.to_csv().unwrap();
        let mut csv = csv::Reader::from_reader(text.as_bytes());
        let headings = csv.headers().unwrap().clone();
        let rows: Vec<_> = csv.records().map(Result::unwrap).collect();
        let cell = |row: usize, heading: &str| {
            &rows[row][headings.iter().position(|h| h == heading).unwrap()]
        };
        assert_eq!(rows.len(), 3);
        assert_eq!(cell(0, "wrong_fraction").parse(), Ok(1.0 / 3.0));
        assert_eq!([cell(1, "wrong_fraction"), cell(1, "counted_pixels")], ["", "0"]);
        assert_eq!([cell(0, "error"), cell(1, "shadows")], ["", "lambda=1@1024"]);
        assert_eq!(cell(2, "view"), "view 1");
        assert_eq!(cell(2, "error"), "no file, \"sorry\"");
        assert_eq!([cell(2, "shadows"), cell(2, "width")], ["", ""]);
    }

    #[test]
    fn results_of_others_are_refused() {
        let mut sweep = sweep(&[Some(&[Some(0.5)])]);
        sweep.check().unwrap();
        sweep.settings.shadows.push("psm".to_owned());
        let error = sweep.check().unwrap_err().to_string();
        assert_eq!(error, "views: results of `view 0` must be those of the sweep");
    }
}
