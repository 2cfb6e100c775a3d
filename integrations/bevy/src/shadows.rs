//! The component that asks for planned cascades.

use bevy::pbr::MAX_CASCADES_PER_LIGHT;
use bevy::prelude::*;
use bevy::shape::Aabb3d;
use std::str::FromStr;
use umbrage::language::ParseError;
use umbrage::visibility::Filter;
use umbrage::{Cover, Faces, Partition, Splits, Technique, Warp};

/// Asks for planned cascades for a directional light, in place of Bevy's own.
///
/// The default, `uniform(stable)+z4(practical=0.65)`, does not shimmer however the camera moves and
/// turns. More of the error goes with a technique that is fitted to what the camera sees, such as
/// `adaptive+z4`; its shadows shimmer while the camera moves. A technique is written as text, or is a value of
/// [`umbrage::Technique`]:
///
/// ```
/// # use bevy_umbrage::{Receivers, UmbrageShadows};
/// let shadows: UmbrageShadows = "adaptive+z4".parse()?;
/// let shadows = shadows.with_distance(80.0).with_receivers(Receivers::Meshes);
/// # Ok::<(), bevy_umbrage::ShadowsError>(())
/// ```
///
/// Three things stay Bevy's own settings: the resource
/// [`DirectionalLightShadowMap`](bevy::light::DirectionalLightShadowMap) has the number of texels of
/// each map, the camera's component
/// [`ShadowFilteringMethod`](bevy::light::ShadowFilteringMethod) is the filter, and
/// [`DirectionalLight::shadow_maps_enabled`] turns shadows on.
///
/// While a light has this component, the plan writes its
/// [`CascadeShadowConfig`](bevy::light::CascadeShadowConfig). The light gets its own one back when
/// the component is removed.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(opaque)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct UmbrageShadows {
    technique: Technique,
    distance: Option<f32>,
    receivers: Receivers,
}

/// What is known about the surfaces that receive shadows. Techniques with
/// [`Cover::Stable`] do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Receivers {
    /// Nothing: the maps cover all that the camera may see.
    View,
    /// Everything that receives shadows lies in this box of world space, metres. What lies outside
    /// is lit.
    Box(Aabb3d),
    /// The bounding boxes of the meshes that Bevy finds visible from the camera. If one of them has
    /// no bounding box or is never culled, or if the camera sees volumetric fog, it is as
    /// [`View`](Self::View).
    #[default]
    Meshes,
}

/// Why there are no planned cascades as asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShadowsError {
    /// The text is not a technique.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// A value of the technique is out of its range.
    #[error(transparent)]
    Technique(#[from] umbrage::Error),
    /// The text has a size.
    #[error(
        "the technique's size (@…) is not its own in Bevy: remove it, and set the resource \
         DirectionalLightShadowMap, which is the size of each map"
    )]
    Size,
    /// The technique has a filter.
    #[error(
        "the technique's filter is not its own in Bevy: remove it, and set the camera's component \
         ShadowFilteringMethod"
    )]
    Filter,
    /// The technique is `none`.
    #[error("`none` is no shadows: set DirectionalLight::shadow_maps_enabled to false")]
    None,
    /// The technique has maps for the faces of the view.
    #[error("maps for the faces of the view do not fit in Bevy, whose cascades are slices")]
    Faces,
    /// Rows are spread by a logarithm.
    #[error("no GPU draws the rows of `log`")]
    Logarithmic,
    /// There are more slices than Bevy has cascades.
    #[error("{slices} slices are more than Bevy's {MAX_CASCADES_PER_LIGHT} cascades of a light")]
    Slices {
        /// The number of slices asked for.
        slices: u32,
    },
}

/// The share of its length by which a slice fades into the next one, unless told otherwise.
const OVERLAP: f64 = 0.1;

/// Slices between even and self-similar ones. Stable maps do not know what is seen. Self-similar
/// slices from Bevy's near plane, 0.1 m by default, would spend most of the maps on the first metres,
/// where there is seldom anything to see.
const BLEND: f64 = 0.65;

impl Default for UmbrageShadows {
    fn default() -> Self {
        let slices = MAX_CASCADES_PER_LIGHT as u32;
        Self {
            technique: Technique {
                warp: Warp::Uniform,
                cover: Cover::Stable,
                partition: Partition {
                    splits: Splits::Practical(BLEND),
                    overlap: OVERLAP,
                    ..Partition::slices(slices)
                },
                ..Technique::default()
            },
            distance: None,
            receivers: Receivers::default(),
        }
    }
}

impl UmbrageShadows {
    /// Cascades by a technique. Its [size](Technique::size) is not used: each map has as many texels
    /// as [`DirectionalLightShadowMap`](bevy::light::DirectionalLightShadowMap) says. Slices fade
    /// into each other over a tenth of their length unless the technique says otherwise.
    ///
    /// # Errors
    /// If Bevy has no place for the technique, or if a value of it is out of its range.
    pub fn new(mut technique: Technique) -> Result<Self, ShadowsError> {
        match technique.filter {
            Filter::Hard => {}
            Filter::None => return Err(ShadowsError::None),
            _ => return Err(ShadowsError::Filter),
        }
        if technique.warp == Warp::Log {
            return Err(ShadowsError::Logarithmic);
        }
        let Partition { slices, faces, overlap, .. } = technique.partition;
        if faces != Faces::Whole {
            return Err(ShadowsError::Faces);
        }
        if slices as usize > MAX_CASCADES_PER_LIGHT {
            return Err(ShadowsError::Slices { slices });
        }
        if overlap == 0.0 {
            technique.partition.overlap = OVERLAP;
        }
        technique.check()?;
        Ok(Self { technique, ..Self::default() })
    }

    /// The technique, with Bevy's settings for filter and size in place of its own.
    pub fn technique(&self) -> &Technique {
        &self.technique
    }

    /// Ends shadows at this distance along the view, metres. Without it they end where the light's
    /// [`CascadeShadowConfig`](bevy::light::CascadeShadowConfig) ends them, at 150 m if that was
    /// not set either.
    #[must_use]
    pub fn with_distance(mut self, metres: f32) -> Self {
        self.distance = Some(metres);
        self
    }

    /// Tells where the receivers are: see [`Receivers`].
    #[must_use]
    pub fn with_receivers(mut self, receivers: Receivers) -> Self {
        self.receivers = receivers;
        self
    }

    /// Lets each slice fade into the next one over this share of its length, 0 ..= 1.
    ///
    /// # Errors
    /// If the share is out of that range.
    pub fn with_overlap(mut self, share: f32) -> Result<Self, ShadowsError> {
        self.technique.partition.overlap = f64::from(share);
        self.technique.check()?;
        Ok(self)
    }

    /// The distance at which shadows end, if it was given.
    pub fn distance(&self) -> Option<f32> {
        self.distance
    }

    /// What is known about the receivers.
    pub fn receivers(&self) -> Receivers {
        self.receivers
    }
}

/// A technique as text, without a filter and without a size: `adaptive+z4`.
impl FromStr for UmbrageShadows {
    type Err = ShadowsError;

    fn from_str(text: &str) -> Result<Self, ShadowsError> {
        let technique = text.parse()?;
        if text.contains('@') {
            return Err(ShadowsError::Size);
        }
        Self::new(technique)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn techniques_that_bevy_has_a_place_for() {
        for text in ["adaptive+z4", "uniform(stable)+z2", "lispsm", "psm", "uniform+z4(fitted)"] {
            let shadows: UmbrageShadows = text.parse().unwrap();
            let asked: Technique = text.parse().unwrap();
            assert_eq!(shadows.technique().warp, asked.warp);
            assert_eq!(shadows.technique().partition.slices, asked.partition.slices);
            assert_eq!(shadows.technique().partition.overlap, OVERLAP);
        }
        let shadows: UmbrageShadows = "adaptive+z4(overlap=0.3)".parse().unwrap();
        assert_eq!(shadows.technique().partition.overlap, 0.3);
        assert_eq!("uniform(stable)+z4(practical=0.65)".parse(), Ok(UmbrageShadows::default()));
    }

    #[test]
    fn techniques_that_bevy_has_no_place_for() {
        let error = |text: &str| text.parse::<UmbrageShadows>().unwrap_err();
        assert_eq!(error("adaptive+z4@2048"), ShadowsError::Size);
        assert_eq!(error("adaptive+z4:pcf3"), ShadowsError::Filter);
        assert_eq!(error("none"), ShadowsError::None);
        assert_eq!(error("adaptive+face"), ShadowsError::Faces);
        assert_eq!(error("log"), ShadowsError::Logarithmic);
        assert_eq!(error("adaptive+z5"), ShadowsError::Slices { slices: 5 });
        assert!(matches!(error("adaptiv"), ShadowsError::Parse(_)));
        let technique = Technique {
            partition: Partition { overlap: f64::NAN, ..Partition::default() },
            ..Technique::default()
        };
        assert!(matches!(UmbrageShadows::new(technique), Err(ShadowsError::Technique(_))));
        assert!(UmbrageShadows::default().with_overlap(1.5).is_err());
    }
}
