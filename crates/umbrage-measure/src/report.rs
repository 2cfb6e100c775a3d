use crate::{Error, ErrorPx, Metrics};
use serde::{Deserialize, Serialize};

/// `report.json`: what was compared and how far each technique is from the truth.
///
/// Figures that may be unknown are `Option`; they and figures that are not finite become JSON
/// `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The scene's name.
    pub scene: String,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Who looks on.
    pub view: View,
    /// What shines.
    pub light: LightInfo,
    /// How the truth was made.
    pub truth: Truth,
    /// What [`Measured::flicker`] was measured in; `None` if nothing moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// One a shadow specification, in the order they were asked for.
    pub results: Vec<Measured>,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The camera's name in the scene's file, if it is from there.
    #[serde(default)]
    pub name: Option<String>,
    /// World position, metres.
    pub eye: [f64; 3],
    /// A world point in the middle of the picture, metres.
    pub target: [f64; 3],
    /// Up in the picture.
    pub up: [f64; 3],
    /// Vertical field of view, degrees.
    pub fov: f64,
    /// Nearest and farthest distance along the view direction that are drawn, metres.
    pub near: f64,
    /// See `near`.
    pub far: f64,
}

/// The light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum LightInfo {
    /// Parallel light.
    Directional {
        /// The light's name in the scene's file, if it is from there.
        #[serde(default)]
        name: Option<String>,
        /// The way it travels, unit length.
        direction: [f64; 3],
    },
    /// A cone of light from one point.
    Spot {
        /// The light's name in the scene's file, if it is from there.
        #[serde(default)]
        name: Option<String>,
        /// World position, metres.
        position: [f64; 3],
        /// Axis of the cone, the way it travels, unit length.
        direction: [f64; 3],
        /// Half the cone's opening angle, degrees.
        half_angle: f64,
        /// Distance along the axis where light ends, metres.
        range: f64,
    },
    /// Light from one point in all directions.
    Point {
        /// The light's name in the scene's file, if it is from there.
        #[serde(default)]
        name: Option<String>,
        /// World position, metres.
        position: [f64; 3],
        /// Distance where light ends, metres.
        range: f64,
    },
}

/// How the truth was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Primary rays a pixel, each with a shadow ray at the light.
    pub rays_per_pixel: u32,
    /// Wall-clock time to trace it all, seconds.
    pub seconds: Option<f64>,
}

/// Frames that follow one another.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Motion {
    /// What moves and how, in a word: `dolly`, `orbit`, `sun`.
    pub kind: String,
    /// How many frames there are, the first of them the report's own view.
    pub frames: u32,
}

/// One technique's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The shadow specification as it was asked for, e.g. `lispsm@1024`.
    pub shadows: String,
    /// The technique that was executed, as `umbrage::Technique` prints it: with the texels that an
    /// option asked for, without what is so by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub technique: Option<String>,
    /// What executed the plan: `reference` or `gpu`.
    pub backend: String,
    /// The GPU's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// Number of shadow maps.
    pub maps: u32,
    /// Texels of all maps together.
    pub texels: u64,
    /// Memory of what lookup reads, bytes: depths, or the numbers that a filter stores in their place, gutters and smaller copies included.
    #[serde(default)]
    pub bytes: Option<u64>,
    /// Distance from the truth; its fields stand beside these in the JSON.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Pixels per texel on the surfaces seen.
    pub error_px: ErrorPx,
    /// Texels needed per pixel of the picture for an error of 1 (Lloyd et al. 2006, Eq. 12).
    pub storage_factor: Option<f64>,
    /// Share of the triangles that need not be drawn into a map, the mean over maps that serve anything.
    #[serde(default)]
    pub casters_culled: Option<f64>,
    /// Mean change of visibility from one frame to the next, of what counts in both and where the truth does
    /// not change; for hard shadows the share that changes. `None` if nothing moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flicker: Option<f64>,
    /// Mean change, from one frame to the next, of a pixel's error against the mean of many true values all over it: 0 where pixels do not sparkle. `None` if
    /// it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Wall-clock times.
    pub ms: Times,
}

/// Wall-clock times of a technique's stages, milliseconds; `None` for a stage it does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Planning the maps.
    pub plan: Option<f64>,
    /// Rendering the maps.
    pub depth: Option<f64>,
    /// Filtering them ahead of lookup.
    pub filter: Option<f64>,
    /// Looking them up for the picture.
    pub shade: Option<f64>,
}

impl Times {
    /// All stages together, milliseconds; `None` if none is known.
    pub fn total(&self) -> Option<f64> {
        let known = [self.plan, self.depth, self.filter, self.shade].into_iter().flatten();
        known.reduce(|a, b| a + b)
    }
}

impl Report {
    /// The text of `report.json`. Floats keep every bit.
    ///
    /// # Errors
    /// None for reports that this crate's types can hold.
    pub fn to_json(&self) -> Result<String, Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Reads the text of a `report.json`.
    ///
    /// # Errors
    /// Text that is not JSON, or lacks a field; the message names it and the place.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Ok(serde_json::from_str(text)?)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// A report with a result of each given share of wrong pixels; `None`: nothing counted.
    pub(crate) fn report(wrong: &[Option<f64>]) -> Report {
        let result = |(i, &wrong): (usize, &Option<f64>)| Measured {
            shadows: format!("lambda={i}@1024"),
            technique: None,
            backend: "reference".to_owned(),
            device: None,
            maps: 1,
            texels: 1 << 40,
            bytes: Some(1 << 42),
            metrics: Metrics {
                counted: if wrong.is_some() { 1000 } else { 0 },
                wrong_fraction: wrong,
                false_light: wrong,
                false_shadow: wrong.map(|_| 0.0),
                mean_abs_error: wrong,
                flip: wrong,
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
                fov: 60.0,
                near: 0.1,
                far: 500.0,
            },
            light: LightInfo::Directional { name: None, direction: [0.0, -1.0, 0.0] },
            truth: Truth { rays_per_pixel: 16, seconds: Some(1.25) },
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
            "mean_abs_error": 0.25, "flip": 0.25,
            "error_px": {"p50": 0.1 + 0.2, "p95": 2.0, "max": 3.5, "undefined": 7},
            "storage_factor": 865.16,
            "casters_culled": 0.25,
            "ms": {"plan": 0.004, "depth": 812.5, "filter": null, "shade": 95.25},
        });
        assert_eq!(json["results"], json!([expected]));
    }

    /// Reports of views that stand still, and those from before there were motions, say nothing of one.
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
