#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod cascades;
mod convert;
mod debug;
mod receivers;
mod shaders;
mod shadows;

pub use cascades::PlanCascades;
pub use debug::UmbrageDebug;
pub use shaders::{Lookup, UmbrageEnabled, UmbrageStatus};
pub use shadows::{Receivers, ShadowsError, UmbrageShadows};
pub use umbrage;

use bevy::prelude::*;

/// What an app needs: `use bevy_umbrage::prelude::*`.
pub mod prelude {
    pub use crate::{
        Lookup, Receivers, UmbrageDebug, UmbrageEnabled, UmbragePlugin, UmbrageShadows,
        UmbrageStatus,
    };
}

/// Betters all shadows of Bevy's directional, spot and point lights. The bias of each shadow test
/// follows from the shadow map's matrix and from the receiver's triangle; the biases that are set
/// on lights are not used.
///
/// A directional light with the component [`UmbrageShadows`] gets planned cascades too.
///
/// ```
/// # use bevy::prelude::*;
/// # let mut app = App::new();
/// # app.add_plugins(MinimalPlugins);
/// app.add_plugins(bevy_umbrage::UmbragePlugin);
/// ```
///
/// The order of this plugin and Bevy's own does not matter. In an app without Bevy's renderer it
/// does nothing.
pub struct UmbragePlugin;

impl Plugin for UmbragePlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<UmbrageShadows>()
            .register_type::<UmbrageDebug>()
            .register_type::<UmbrageEnabled>()
            .init_resource::<UmbrageDebug>()
            .init_resource::<UmbrageEnabled>()
            .init_resource::<UmbrageStatus>();
    }

    // Bevy's plugins have added their assets and systems by now, whatever the order of plugins.
    fn finish(&self, app: &mut App) {
        if app.world().contains_resource::<Assets<Shader>>() {
            shaders::add(app);
            cascades::add(app);
        }
    }
}
