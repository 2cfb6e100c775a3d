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
}

/// How the truth was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Primary rays a pixel, each with a shadow ray at the light.
    pub rays_per_pixel: u32,
    /// Wall-clock time to trace it all, seconds.
    pub seconds: Option<f64>,
}

/// One technique's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The shadow specification, e.g. `lispsm@1024`.
    pub shadows: String,
    /// What executed the plan: `reference` or a GPU's name.
    pub backend: String,
    /// Number of shadow maps.
    pub maps: u32,
    /// Texels of all maps together.
    pub texels: u64,
    /// Distance from the truth; its fields stand beside these in the JSON.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Pixels per texel on the surfaces seen.
    pub error_px: ErrorPx,
    /// Texels needed per pixel of the picture for an error of 1 (Lloyd et al. 2006, Eq. 12).
    pub storage_factor: Option<f64>,
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
