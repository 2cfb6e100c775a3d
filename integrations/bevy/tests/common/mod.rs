//! Apps without a device.

use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::window::ExitCondition;
use bevy_umbrage::prelude::*;

/// Bevy's plugins without a device and without a window, and this one.
fn app() -> App {
    let mut app = App::new();
    app.add_plugins((
        // The order must not matter, so this plugin comes first.
        UmbragePlugin,
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .set(RenderPlugin {
                render_creation: WgpuSettings { backends: None, ..default() }.into(),
                ..default()
            })
            .disable::<bevy::winit::WinitPlugin>()
            .disable::<bevy::log::LogPlugin>(),
    ));
    app.finish();
    app.cleanup();
    app
}

/// Updates until Bevy has loaded its shaders.
pub fn loaded() -> App {
    let mut app = app();
    for _ in 0..2000 {
        app.update();
        if *lookup(&app) != Lookup::Waiting {
            return app;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("Bevy did not load the shaders that are changed");
}

pub fn lookup(app: &App) -> &Lookup {
    &app.world().resource::<UmbrageStatus>().lookup
}
