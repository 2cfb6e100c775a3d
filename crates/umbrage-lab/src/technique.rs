//! Techniques, and the texts that users write for them.

use crate::error::{Error, Field};
use std::fmt::{self, Display};
use std::str::FromStr;
use umbrage::language::ParseError;
use umbrage::visibility::{Blur, Filter, Prefilter, Width};
use umbrage::{Error as PlanError, Size, Technique};

/// Largest side of a shadow map, texels, which is the limit of today's GPUs.
pub(crate) const MAX_SIDE: u32 = 16384;

/// A technique, and the text that describes it. Reports show this text, so that users find the
/// results by what they asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedTechnique {
    text: String,
    technique: Technique,
}

/// The reason why a text does not describe a technique that can be run here.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TechniqueError {
    /// The text does not describe a technique.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// The text asks for a map that no GPU can hold.
    #[error("`@{0}` must have a whole number from 1 to {MAX_SIDE}")]
    TooLarge(Size),
}

impl NamedTechnique {
    /// Returns the technique that the text describes.
    pub fn technique(&self) -> &Technique {
        &self.technique
    }

    /// Returns whether the text gives a size: a number of texels or a largest error.
    pub fn is_sized(&self) -> bool {
        self.text.contains('@')
    }

    /// Returns whether the technique means to show soft shadows as a light with a size throws them.
    /// A blur of a width in metres does so, too, though its width is the same everywhere.
    pub fn is_soft(&self) -> bool {
        match self.technique.filter {
            Filter::None | Filter::Hard | Filter::Pcf { .. } => false,
            Filter::Spread { width, .. } => matches!(width, Width::Metres(_)),
            Filter::Pcss { .. } => true,
            Filter::Prefiltered(Prefilter { blur, .. }) => {
                matches!(blur, Blur::Width(Width::Metres(_)))
            }
        }
    }

    /// Makes the planner take the fewest texels with which errors are at most this many pixels per
    /// texel. Does nothing if the text gives a size, or if the technique has pages, which have an
    /// error of their own.
    pub fn limit_error(&mut self, pixels: f64) {
        if !self.is_sized() && self.technique.paged_error().is_none() {
            self.technique.size = Size::MaxError(pixels);
        }
    }

    /// Converts the planner's error into one that names the part of the text that is to blame.
    pub fn blame(&self, error: PlanError) -> Error {
        let PlanError::Invalid { field, problem } = &error else {
            return Error::Planning(error);
        };
        let Some(part) = self.technique.part(field) else {
            return Error::Planning(error);
        };
        let (shadows, problem) = (self.text.clone(), problem.to_string());
        match self.technique.size {
            Size::MaxError(pixels) if *field == "technique.size" && !self.is_sized() => {
                Error::LargestError { shadows, pixels, problem }
            }
            _ => Error::Field {
                field: Field::Shadows,
                value: Some(shadows),
                problem: format!("`{part}`: {problem}"),
            },
        }
    }
}

impl FromStr for NamedTechnique {
    type Err = TechniqueError;

    fn from_str(text: &str) -> Result<Self, TechniqueError> {
        let technique: Technique = text.parse()?;
        let side = match technique.size {
            Size::Budget(texels) => texels.isqrt(),
            Size::Exact([width, height]) => width.max(height).into(),
            Size::MaxError(_) | Size::Needed => 0,
        };
        match side <= MAX_SIDE.into() {
            true => Ok(Self { text: text.to_owned(), technique }),
            false => Err(TechniqueError::TooLarge(technique.size)),
        }
    }
}

/// Shows the text as it was written.
impl Display for NamedTechnique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::planner;
    use umbrage::{Camera, Light};

    fn complaint(technique: &NamedTechnique) -> String {
        let camera = Camera::look_at(umbrage::LookAt {
            eye: glam::DVec3::ZERO,
            target: glam::DVec3::NEG_Z,
            up: glam::DVec3::Y,
            fov_y_rad: 1.0,
            near: 1.0,
            far: 100.0,
            image: [640, 480],
        });
        let sun = Light::Directional { direction: glam::DVec3::NEG_Y };
        let bounds = umbrage::Bounds::default();
        let mut planner = planner();
        let plan = planner.plan(&camera.unwrap(), &[sun], &bounds, technique.technique());
        technique.blame(plan.unwrap_err()).to_string()
    }

    /// The planner's errors name the part of the text that is to blame.
    #[test]
    fn the_planners_complaints_name_the_part() {
        for (text, expected) in [
            (
                "uniform(stable)+face",
                "shadows uniform(stable)+face: `+face`: stable maps do not turn",
            ),
            ("uniform(stable)+z2(fitted)", "`+z2(fitted)`: stable maps cannot be fitted"),
            ("uniform(stable)@1x1", "`@1x1`: a stable map needs at least 2 texels"),
            ("uniform+z16@3", "`@3`: a budget of 9 texels is too small for 16 maps"),
            ("uniform+z2(at=1e-13)", "`+z2(at=1e-13)`: must be 1 ascending distances"),
            ("uniform:pcss(light=0.2m)", "`:pcss(light=0.2m)`: a sun's size is an angle"),
            ("uniform@0.000000001px", "`@1e-9px`: so small an error"),
        ] {
            let error = complaint(&text.parse().unwrap());
            assert!(error.contains(expected), "{text}: {error}");
        }
        let mut greedy: NamedTechnique = "uniform".parse().unwrap();
        greedy.limit_error(1e-9);
        let error = complaint(&greedy);
        assert!(error.contains("uniform: `max-error 0.000000001`: so small an error"), "{error}");
    }

    #[test]
    fn a_largest_error_yields_to_texels() {
        let with = |text: &str| {
            let mut technique: NamedTechnique = text.parse().unwrap();
            technique.limit_error(0.5);
            technique.technique().size
        };
        assert_eq!(with("lispsm+z4"), Size::MaxError(0.5));
        assert_eq!(with("lispsm@512"), Size::Budget(512 * 512));
        assert_eq!(with("lispsm@64x32"), Size::Exact([64, 32]));
    }

    #[test]
    fn softness_is_a_penumbra_in_metres_or_degrees() {
        let is_soft = |text: &str| text.parse::<NamedTechnique>().unwrap().is_soft();
        for text in ["uniform:pcss", "psm:pcf5(blur=0.2m)", "tsm:vsm(blur=0.1m)"] {
            assert!(is_soft(text), "{text}");
        }
        for text in ["none", "uniform", "psm:pcf5", "psm:pcf5(blur=2px)", "tsm:vsm(blur=7)"] {
            assert!(!is_soft(text), "{text}");
        }
    }

    #[test]
    fn techniques_print_as_they_were_written() {
        for text in ["adaptive@1024", "uniform:hard", "tsm+z2(overlap=0.1,fitted):csm8(scale)"] {
            assert_eq!(text.parse::<NamedTechnique>().unwrap().to_string(), text);
        }
        for text in ["uniform@16385", "uniform@64x16385"] {
            let error = text.parse::<NamedTechnique>().unwrap_err().to_string();
            assert!(error.contains("from 1 to 16384"), "{error}");
        }
    }
}
