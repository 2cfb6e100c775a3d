//! Comparisons over many views, with their tables and means.

use crate::{Error, ErrorPx, LightInfo, Measured, Metrics, Report, TruthKind, View};
use serde::{Deserialize, Serialize};

/// A comparison of the same techniques in many views.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Name of the sweep, the page's title.
    pub name: String,
    /// The share of the views that this sweep has, such as `2/8`; `None` if it has all views.
    pub share: Option<String>,
    /// The settings that all views have in common.
    pub settings: SweepSettings,
    /// The views, in the order in which they were requested.
    pub views: Vec<SweptView>,
}

/// The settings that all views of a sweep have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepSettings {
    /// The shadow specifications.
    pub shadows: Vec<String>,
    /// Largest number of pixels per texel, for specifications that do not state texels. `None`:
    /// those have the default budget.
    pub max_error: Option<f64>,
    /// Width and height of the pictures, pixels, for views that do not state a size.
    pub size: [u32; 2],
    /// Number of rays along each side of a pixel.
    pub samples: u32,
    /// Size of the lights, as in `0.53deg`, for the truth that soft techniques are measured
    /// against; `None` if all are measured against that of the point light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_size: Option<String>,
    /// Whether alpha-masked materials cast and show as solid.
    pub opaque: bool,
    /// Whether a GPU drew all triangles of all scenes.
    #[serde(default)]
    pub full_detail: bool,
    /// The animation that poses the scenes; `None` if they have the poses of their files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// Time in the animation, seconds; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// The nodes of the scenes that are left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Whether ground is put under the scenes.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ground: bool,
    /// Which receivers the maps are fitted to: those in one `box`, or the `surfaces`.
    pub fit: String,
    /// The executor that renders the shadow maps.
    pub backend: String,
}

/// One view of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptView {
    /// Name of the view, different for each view of the sweep.
    pub name: String,
    /// The scene, in the words of the request.
    pub scene: String,
    /// The folder of the view's report, relative to the sweep's folder, with `/` between names.
    pub folder: String,
    /// The view's report, with one result for each of the sweep's specifications in their order, or
    /// the reason why there is none.
    pub outcome: Result<Report, String>,
}

/// The means of one specification's figures, over all views that have counted pixels.
///
/// A geometric mean weighs all views alike, however hard they are, and the ratio of two means does
/// not depend on which techniques are compared. It cannot contain a zero: a view without a wrong
/// pixel would outweigh all others. Each figure is therefore raised to at least one wrong pixel of
/// its view, 1 / counted pixels, which is the least difference that the view can resolve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The shadow specification.
    pub shadows: String,
    /// Number of views that the means are over.
    pub views: usize,
    /// Geometric mean of [`Metrics::wrong_fraction`]; `None` if no view was counted.
    pub wrong_fraction: Option<f64>,
    /// Number of views whose figure was smaller than one wrong pixel and was raised to it in this
    /// mean.
    pub wrong_fraction_raised: usize,
    /// Geometric mean of [`Metrics::light_error`]; `None` if no view was counted.
    pub light_error: Option<f64>,
    /// Number of views whose figure was smaller than one wrong pixel and was raised to it in this
    /// mean.
    pub light_error_raised: usize,
    /// Geometric mean of [`Measured::bytes`]; `None` if it is not known in all views.
    pub bytes: Option<f64>,
    /// Geometric mean of [`Metrics::mean_abs_error`]; `None` if no view was counted.
    pub mean_abs_error: Option<f64>,
    /// Number of views whose figure was smaller than one wrong pixel and was raised to it in this
    /// mean.
    pub mean_abs_error_raised: usize,
}

impl Report {
    /// The report without wall-clock times, which differ from run to run.
    pub fn without_times(mut self) -> Self {
        self.truth.seconds = None;
        self.results.iter_mut().for_each(|r| r.ms = crate::Times::default());
        self
    }
}

impl SweptView {
    /// Path of a file of the view's report, relative to the sweep's folder.
    pub(crate) fn file(&self, name: &str) -> String {
        format!("{}/{name}", self.folder)
    }
}

impl Sweep {
    /// Checks that the results of each view are those of the sweep's specifications.
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

    /// The views that have a report, with their reports.
    pub(crate) fn reports(&self) -> impl Iterator<Item = (&SweptView, &Report)> {
        self.views.iter().filter_map(|v| Some((v, v.outcome.as_ref().ok()?)))
    }

    /// The views that have no report, with the reasons.
    pub(crate) fn errors(&self) -> impl Iterator<Item = (&SweptView, &str)> {
        self.views.iter().filter_map(|v| Some((v, v.outcome.as_ref().err()?.as_str())))
    }

    /// The means of each specification, in the order of the sweep's specifications.
    pub fn means(&self) -> Vec<Mean> {
        let shadows = self.settings.shadows.iter().enumerate();
        let mean = |(i, shadows): (usize, &String)| {
            let results = self.reports().filter_map(|(_, r)| r.results.get(i));
            let results: Vec<&Measured> = results.filter(|r| r.metrics.counted > 0).collect();
            let counted: Vec<&Metrics> = results.iter().map(|r| &r.metrics).collect();
            let (light_error, light_error_raised) = geometric_mean(&counted, |m| m.light_error);
            let logarithms = results.iter().map(|r| Some((r.bytes? as f64).ln()));
            let logarithms: Option<f64> = logarithms.sum();
            let bytes = logarithms.map(|sum| (sum / results.len() as f64).exp());
            let (wrong_fraction, wrong_fraction_raised) =
                geometric_mean(&counted, |m| m.wrong_fraction);
            let (mean_abs_error, mean_abs_error_raised) =
                geometric_mean(&counted, |m| m.mean_abs_error);
            Mean {
                shadows: shadows.clone(),
                views: counted.len(),
                wrong_fraction,
                wrong_fraction_raised,
                light_error,
                light_error_raised,
                bytes: bytes.filter(|b| b.is_finite()),
                mean_abs_error,
                mean_abs_error_raised,
            }
        };
        shadows.map(mean).collect()
    }

    /// The text of `results.json`: all figures except wall-clock times.
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

    /// The text of `results.csv`, with a row for each view and specification. A view that failed
    /// has a single row with its error.
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

/// The columns of `results.csv` that follow the columns of the view.
type CsvColumn = (&'static str, fn(&Measured) -> String);
const CSV: [CsvColumn; 27] = [
    ("shadows", |r| r.shadows.clone()),
    ("backend", |r| r.backend.clone()),
    ("maps", |r| r.maps.to_string()),
    ("texels", |r| r.texels.to_string()),
    ("counted_pixels", |r| r.metrics.counted.to_string()),
    ("wrong_fraction", |r| number(r.metrics.wrong_fraction)),
    ("false_light", |r| number(r.metrics.false_light)),
    ("false_shadow", |r| number(r.metrics.false_shadow)),
    ("mean_abs_error", |r| number(r.metrics.mean_abs_error)),
    ("light_error", |r| number(r.metrics.light_error)),
    ("flip", |r| number(r.metrics.flip)),
    ("error_px_p50", |r| number(r.error_px.p50)),
    ("error_px_p95", |r| number(r.error_px.p95)),
    ("error_px_max", |r| number(r.error_px.max)),
    ("error_px_undefined", |r| r.error_px.undefined.to_string()),
    ("perspective_px_p50", |r| number(r.perspective_px.p50)),
    ("perspective_px_p95", |r| number(r.perspective_px.p95)),
    ("perspective_px_max", |r| number(r.perspective_px.max)),
    ("perspective_px_undefined", |r| r.perspective_px.undefined.to_string()),
    ("storage_factor", |r| number(r.storage_factor)),
    ("casters_culled", |r| number(r.casters_culled)),
    ("bytes", |r| r.bytes.map(|b| b.to_string()).unwrap_or_default()),
    ("pages", |r| r.pages.map(|n| n.to_string()).unwrap_or_default()),
    ("texels_per_pixel", |r| number(r.texels_per_pixel)),
    ("bound_px", |r| number(r.bound_px)),
    ("truth", |r| r.truth.map_or("", TruthKind::name).to_owned()),
    ("error", |_| String::new()),
];

/// The shortest text that is read as the same number; empty for `None`.
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

/// [`Measured`] without its times.
#[derive(Serialize)]
struct ResultJson<'a> {
    shadows: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    technique: Option<&'a str>,
    backend: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    device: Option<&'a str>,
    maps: u32,
    texels: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pages: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texels_per_pixel: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bound_px: Option<f64>,
    bytes: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    truth: Option<TruthKind>,
    #[serde(flatten)]
    metrics: &'a Metrics,
    error_px: &'a ErrorPx,
    perspective_px: &'a ErrorPx,
    storage_factor: Option<f64>,
    casters_culled: Option<f64>,
}

impl<'a> From<&'a Measured> for ResultJson<'a> {
    fn from(measured: &'a Measured) -> Self {
        // The views of a sweep do not move, so there is neither flicker nor noise, and times are
        // left out.
        let Measured {
            shadows,
            technique,
            backend,
            device,
            maps,
            texels,
            pages,
            texels_per_pixel,
            bound_px,
            bytes,
            truth,
            metrics,
            error_px,
            perspective_px,
            storage_factor,
            casters_culled,
            flicker: _,
            noise: _,
            ms: _,
        } = measured;
        Self {
            shadows,
            technique: technique.as_deref(),
            backend,
            device: device.as_deref(),
            maps: *maps,
            texels: *texels,
            pages: *pages,
            texels_per_pixel: *texels_per_pixel,
            bound_px: *bound_px,
            bytes: *bytes,
            truth: *truth,
            metrics,
            error_px,
            perspective_px,
            storage_factor: *storage_factor,
            casters_culled: *casters_culled,
        }
    }
}

/// Geometric mean of a figure over views, and the number of views whose figure was raised to one
/// wrong pixel.
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

    /// A sweep over one view for each item: the shares of wrong pixels of its results, or `None`
    /// for a view that failed.
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
                light_size: None,
                opaque: true,
                full_detail: false,
                animation: None,
                time_s: None,
                without: Vec::new(),
                ground: false,
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
        // No wrong pixel counts as one wrong pixel of the thousand counted pixels.
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
