use crate::{Error, ErrorPx, Metrics};
use serde::{Deserialize, Serialize};

/// The content of `report.json`: what was compared, and how far each technique is from the truth.
///
/// Figures that may be unknown are `Option`s. `None` and figures that are not finite become JSON
/// `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the scene.
    pub scene: String,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// The camera.
    pub view: View,
    /// The light.
    pub light: LightInfo,
    /// How the truth was computed.
    pub truth: Truth,
    /// The motion in which [`Measured::flicker`] and [`Measured::noise`] were measured; `None` if
    /// the view did not move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// The results, one for each shadow specification, in the order in which these were requested.
    pub results: Vec<Measured>,
}

/// The camera of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Name of the camera in the scene's file; `None` if the camera is not from there.
    #[serde(default)]
    pub name: Option<String>,
    /// Position of the eye in world space, metres.
    pub eye: [f64; 3],
    /// The world point in the middle of the picture, metres.
    pub target: [f64; 3],
    /// The direction that is up in the picture.
    pub up: [f64; 3],
    /// Vertical field of view, degrees; `None` for an orthographic view.
    pub fov: Option<f64>,
    /// Height of what an orthographic view shows, metres; `None` for a perspective view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho: Option<f64>,
    /// Near distance along the view direction, metres.
    pub near: f64,
    /// Far distance along the view direction, metres.
    pub far: f64,
}

/// The light of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum LightInfo {
    /// A directional light.
    Directional {
        /// Name of the light in the scene's file; `None` if the light is not from there.
        #[serde(default)]
        name: Option<String>,
        /// The direction in which the light travels, unit length.
        direction: [f64; 3],
    },
    /// A spot light.
    Spot {
        /// Name of the light in the scene's file; `None` if the light is not from there.
        #[serde(default)]
        name: Option<String>,
        /// Position in world space, metres.
        position: [f64; 3],
        /// Axis of the cone in the direction in which the light travels, unit length.
        direction: [f64; 3],
        /// Half the cone's opening angle, degrees.
        half_angle: f64,
        /// Distance along the axis at which the light ends, metres.
        range: f64,
    },
    /// A point light.
    Point {
        /// Name of the light in the scene's file; `None` if the light is not from there.
        #[serde(default)]
        name: Option<String>,
        /// Position in world space, metres.
        position: [f64; 3],
        /// Distance at which the light ends, metres.
        range: f64,
    },
}

/// How the truth was computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Number of primary rays per pixel; each has one shadow ray to the light itself.
    pub rays_per_pixel: u32,
    /// Wall-clock time of tracing all rays, seconds.
    pub seconds: Option<f64>,
    /// The second truth, of a light with a size; `None` if there is only that of the point light.
    /// In the JSON, its fields stand beside the others.
    #[serde(default, flatten)]
    pub area: Option<AreaTruth>,
}

/// How the truth of a light with a size was computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaTruth {
    /// The size, as in `0.53deg` or `0.2m`.
    pub light_size: String,
    /// The largest standard error of the visibility of any pixel, as estimated from its rays.
    pub standard_error: f64,
    /// The mean number of shadow rays per pixel.
    pub shadow_rays_per_pixel: f64,
}

/// Which of two truths a technique is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TruthKind {
    /// That of the light as a point, or as a direction: sharp shadows.
    Point,
    /// That of the light with its size: soft shadows.
    Area,
}

impl TruthKind {
    /// `point` or `area`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Area => "area",
        }
    }
}

/// A motion: a sequence of frames.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Motion {
    /// What moves: `dolly`, `orbit` or `sun`.
    pub kind: String,
    /// Number of frames. The first one is the report's own view.
    pub frames: u32,
}

/// The figures of one technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The shadow specification in the words of the request, such as `lispsm@1024`.
    pub shadows: String,
    /// The technique that was executed, as `umbrage::Technique` prints it: with the texels that an
    /// option requested, and without defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub technique: Option<String>,
    /// The executor of the plan: `reference` or `gpu`.
    pub backend: String,
    /// Name of the GPU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// Number of shadow maps, or of pages.
    pub maps: u32,
    /// Number of texels of all maps or pages together.
    pub texels: u64,
    /// Number of pages in use; `None` for techniques without pages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pages: Option<u64>,
    /// Texels of the pages in use over the pixels counted; `None` for techniques without pages, or
    /// if no pixel was counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texels_per_pixel: Option<f64>,
    /// The greatest width of a texel across the light that the pages allowed, pixels: what was asked
    /// for, or more if that many pages did not fit. `None` for techniques without pages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound_px: Option<f64>,
    /// Memory that lookups read, bytes: depths or, with a prefilter, the statistics in prefiltered
    /// maps; gutters and mip levels included.
    #[serde(default)]
    pub bytes: Option<u64>,
    /// The truth that the technique is measured against; `None` if there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthKind>,
    /// Distance from the truth. In the JSON, these fields stand beside the others.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Pixels per texel on the visible surfaces.
    pub error_px: ErrorPx,
    /// Pixels per texel at the visible surfaces, without their slope towards the light.
    #[serde(default)]
    pub perspective_px: ErrorPx,
    /// Texels needed per pixel of the picture for an error of 1 (Lloyd et al. 2006, Eq. 12). `None`
    /// for pages.
    pub storage_factor: Option<f64>,
    /// Share of the triangles that need not be drawn into a map, as the mean over the maps that
    /// serve any receivers.
    #[serde(default)]
    pub casters_culled: Option<f64>,
    /// Mean change of visibility from one frame to the next, over the points that count in both
    /// frames and where the truth does not change. For hard shadows this is the share of points
    /// that change. `None` if the view did not move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flicker: Option<f64>,
    /// Mean change, from one frame to the next, of a pixel's error against the mean of many true
    /// values spread over the pixel. 0 if no pixel sparkles. `None` if noise was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Wall-clock times of the stages.
    pub ms: Times,
}

/// Wall-clock times of a technique's stages, milliseconds. `None` for a stage that the technique
/// does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Time to plan the maps.
    pub plan: Option<f64>,
    /// Time to render the maps.
    pub depth: Option<f64>,
    /// Time to filter the maps ahead of lookup.
    pub filter: Option<f64>,
    /// Time to look the maps up for the picture.
    pub shade: Option<f64>,
}

impl Times {
    /// Time of all stages together, milliseconds; `None` if no time is known.
    pub fn total(&self) -> Option<f64> {
        let known = [self.plan, self.depth, self.filter, self.shade].into_iter().flatten();
        known.reduce(|a, b| a + b)
    }
}

impl Report {
    /// The text of `report.json`. Floats are written with full precision.
    ///
    /// # Errors
    /// None for reports that this crate's types can hold.
    pub fn to_json(&self) -> Result<String, Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Reads the text of a `report.json`.
    ///
    /// # Errors
    /// The text is not JSON or lacks a field. The message names the field and its place.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Ok(serde_json::from_str(text)?)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// A report with one result for each given share of wrong pixels; `None` for a result without
    /// counted pixels.
    pub(crate) fn report(wrong: &[Option<f64>]) -> Report {
        let result = |(i, &wrong): (usize, &Option<f64>)| Measured {
            shadows: format!("lambda={i}@1024"),
            technique: None,
            backend: "reference".to_owned(),
            device: None,
            maps: 1,
            texels: 1 << 40,
            pages: None,
            texels_per_pixel: None,
            bound_px: None,
            bytes: Some(1 << 42),
            metrics: Metrics {
                counted: if wrong.is_some() { 1000 } else { 0 },
                wrong_fraction: wrong,
                false_light: wrong,
                false_shadow: wrong.map(|_| 0.0),
                mean_abs_error: wrong,
                light_error: wrong,
                flip: wrong,
            },
            truth: None,
            perspective_px: ErrorPx {
                p50: Some(0.3),
                p95: Some(1.0),
                max: Some(1.5),
                undefined: 7,
            },
            error_px: ErrorPx {
                p50: Some(0.1 + 0.2),
                p95: Some(2.0),
                max: Some(3.5),
                undefined: 7,
            },
            storage_factor: Some(865.16),
            casters_culled: Some(0.25),
            flicker: None,
            noise: None,
            ms: Times { plan: Some(0.004), depth: Some(812.5), filter: None, shade: Some(95.25) },
        };
        Report {
            scene: "pole".to_owned(),
            size: [64, 48],
            view: View {
                name: None,
                eye: [0.0, 2.0, 0.0],
                target: [0.0, 2.0, -1.0],
                up: [0.0, 1.0, 0.0],
                fov: Some(60.0),
                ortho: None,
                near: 0.1,
                far: 500.0,
            },
            light: LightInfo::Directional { name: None, direction: [0.0, -1.0, 0.0] },
            truth: Truth { rays_per_pixel: 16, seconds: Some(1.25), area: None },
            motion: None,
            results: wrong.iter().enumerate().map(result).collect(),
        }
    }

    #[test]
    fn json_has_the_promised_shape() {
        let text = report(&[Some(0.25)]).to_json().unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["scene"], "pole");
        assert_eq!(json["size"], json!([64, 48]));
        assert_eq!(
            json["light"],
            json!({"kind": "directional", "name": null, "direction": [0.0, -1.0, 0.0]})
        );
        assert_eq!(json["truth"], json!({"rays_per_pixel": 16, "seconds": 1.25}));
        assert_eq!(json["view"]["fov"], 60.0);
        let expected = json!({
            "shadows": "lambda=0@1024", "backend": "reference", "maps": 1, "texels": 1_u64 << 40, "bytes": 1_u64 << 42,
            "counted_pixels": 1000, "wrong_fraction": 0.25, "false_light": 0.25, "false_shadow": 0.0,
            "mean_abs_error": 0.25, "light_error": 0.25, "flip": 0.25,
            "error_px": {"p50": 0.1 + 0.2, "p95": 2.0, "max": 3.5, "undefined": 7},
            "perspective_px": {"p50": 0.3, "p95": 1.0, "max": 1.5, "undefined": 7},
            "storage_factor": 865.16,
            "casters_culled": 0.25,
            "ms": {"plan": 0.004, "depth": 812.5, "filter": null, "shade": 95.25},
        });
        assert_eq!(json["results"], json!([expected]));
    }

    /// Reports without motion, and reports from versions before there was motion, have no field for
    /// it.
    #[test]
    fn motion_is_told_where_there_was_one() {
        let mut report = report(&[Some(0.25)]);
        let still = report.to_json().unwrap();
        assert!(!still.contains("motion") && !still.contains("flicker"), "{still}");
        assert_eq!(Report::from_json(&still).unwrap(), report);
        report.motion = Some(Motion { kind: "orbit".to_owned(), frames: 6 });
        report.results[0].flicker = Some(0.086);
        let text = report.to_json().unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["motion"], json!({"kind": "orbit", "frames": 6}));
        assert_eq!(json["results"][0]["flicker"], 0.086);
        assert_eq!(Report::from_json(&text).unwrap(), report);
    }

    /// Reports with one truth have no field that tells two apart.
    #[test]
    fn a_second_truth_is_told_where_there_is_one() {
        let mut report = report(&[Some(0.25)]);
        assert!(!report.to_json().unwrap().contains("light_size"));
        let light_size = "0.53deg".to_owned();
        report.truth.area =
            Some(AreaTruth { light_size, standard_error: 0.0037, shadow_rays_per_pixel: 123.5 });
        report.results[0].truth = Some(TruthKind::Area);
        let text = report.to_json().unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        let expected = json!({
            "rays_per_pixel": 16, "seconds": 1.25,
            "light_size": "0.53deg", "standard_error": 0.0037, "shadow_rays_per_pixel": 123.5,
        });
        assert_eq!(json["truth"], expected);
        assert_eq!(json["results"][0]["truth"], "area");
        assert_eq!(Report::from_json(&text).unwrap(), report);
    }

    #[test]
    fn json_comes_back_to_the_bit() {
        let mut original = report(&[Some(1.0 / 3.0), None, Some(f64::MIN_POSITIVE)]);
        let spot = LightInfo::Spot {
            name: Some("lamp \"1\"".to_owned()),
            position: [1e5, 0.1, -0.3],
            direction: [0.6, -0.8, 0.0],
            half_angle: 30.0,
            range: 12.0,
        };
        let point = LightInfo::Point { name: None, position: [-0.1, 2.5, 1e-9], range: 1.0 / 3.0 };
        let kind = |light| serde_json::to_value(light).unwrap()["kind"].clone();
        assert_eq!([kind(&spot), kind(&point)], ["spot", "point"]);
        for light in [spot, point] {
            original.light = light;
            assert_eq!(Report::from_json(&original.to_json().unwrap()).unwrap(), original);
        }
    }

    #[test]
    fn figures_that_are_not_finite_become_null() {
        let mut odd = report(&[Some(f64::NAN)]);
        odd.results[0].storage_factor = Some(f64::INFINITY);
        odd.results[0].error_px.max = Some(f64::NEG_INFINITY);
        let read = Report::from_json(&odd.to_json().unwrap()).unwrap();
        assert_eq!(read.results[0].metrics.wrong_fraction, None);
        assert_eq!(read.results[0].storage_factor, None);
        assert_eq!(read.results[0].error_px.max, None);
    }

    #[test]
    fn broken_json_is_told_apart() {
        let text = report(&[]).to_json().unwrap().replace("\"rays_per_pixel\"", "\"rays\"");
        let error = Report::from_json(&text).unwrap_err().to_string();
        assert!(error.contains("rays_per_pixel") && error.contains("line"), "{error}");
        assert!(Report::from_json("").is_err());
    }
}
