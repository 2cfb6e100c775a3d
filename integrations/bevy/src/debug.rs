//! Pictures that show how shadow maps lie on the scene.

use bevy::prelude::*;

/// Shows how the maps of directional lights lie on what they light, in place of the light's own
/// colour. A change compiles Bevy's shaders anew, which takes a moment.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Clone, Debug, Default, PartialEq)]
pub enum UmbrageDebug {
    /// Nothing is shown.
    #[default]
    Off,
    /// Each cascade has a tint.
    Cascades,
    /// How many pixels wide a texel appears, by colour: blue up to 1, green up to 2, yellow up to 4,
    /// red above, without the slope of the surface.
    TexelDensity,
    /// The texels as a chequered pattern, tinted by cascade.
    TexelGrid,
}

impl UmbrageDebug {
    /// The function of `wesl/debug.wesl` that shows it.
    pub(crate) fn function(self) -> Option<&'static str> {
        match self {
            Self::Off => None,
            Self::Cascades => Some("cascades"),
            Self::TexelDensity => Some("texel_density"),
            Self::TexelGrid => Some("texel_grid"),
        }
    }
}
