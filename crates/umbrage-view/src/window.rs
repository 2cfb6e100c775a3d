//! Opens the window, and opens it again if its device is lost.

use crate::Outcome;
use crate::app::{App, Driver, Kept, Message, Shown};
use crate::script;
use crate::session::to_open;
use crate::settings::Settings;
use eframe::{NativeOptions, Renderer};
use egui::ViewportBuilder;
use egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use umbrage_render::Gpu;

/// What a window begins with.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// A built-in scene, or the path of a scene or of a session.
    pub scene: String,
    /// A script that drives the window, and the folder for its pictures.
    pub script: Option<(PathBuf, PathBuf)>,
}

/// Why there is no window, or why it ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system opens no window.
    #[error("no window: {0}")]
    NoWindow(String),
    /// A script cannot be read.
    #[error("{path}: {problem}")]
    Script {
        /// The script's file.
        path: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A script's step failed.
    #[error("{path}: {problem}")]
    Failed {
        /// The script's file.
        path: String,
        /// The line, and what happened.
        problem: String,
    },
}

/// The number of times that a lost device is replaced.
const MOST_LOSSES: u32 = 5;

/// Opens a window and returns when it is closed.
///
/// # Errors
/// The system opens no window, there is no suitable GPU, or the script is wrong or fails.
pub fn run(options: &Options) -> Result<(), Error> {
    let script = match &options.script {
        None => None,
        Some((path, folder)) => {
            let wrong =
                |problem: String| Error::Script { path: path.display().to_string(), problem };
            let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
            let steps = script::parse(&text).map_err(wrong)?;
            std::fs::create_dir_all(folder).map_err(|e| wrong(e.to_string()))?;
            Some(Driver::new(steps, folder.clone()))
        }
    };
    let settings = Settings::new(&options.scene);
    let (to_open, message) = match to_open(Path::new(&options.scene), &settings) {
        Ok(to_open) => (Some(to_open), None),
        Err(problem) => (None, Some(Message::new(problem, true))),
    };
    let mut kept = Kept {
        settings,
        shown: Shown::default(),
        message,
        driver: script,
        outcome: Outcome::Closed,
        began: Some(Instant::now()),
        to_open,
    };
    for _ in 0..=MOST_LOSSES {
        kept.outcome = Outcome::Closed;
        open(&mut kept)?;
        match &kept.outcome {
            Outcome::DeviceLost => {}
            Outcome::Closed => return Ok(()),
            Outcome::Failed(problem) => {
                let path = options.script.as_ref().map(|(path, _)| path.display().to_string());
                return Err(Error::Failed {
                    path: path.unwrap_or_default(),
                    problem: problem.clone(),
                });
            }
        }
    }
    Err(Error::NoWindow("the GPU is lost again and again".into()))
}

fn open(kept: &mut Kept) -> Result<(), Error> {
    let viewport = ViewportBuilder::default()
        .with_title("Umbrage")
        .with_app_id("umbrage")
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([300.0, 300.0])
        .with_drag_and_drop(true);
    let setup = WgpuSetupCreateNew {
        native_adapter_selector: Some(Arc::new(|adapters, surface| {
            let fits = |a: &wgpu::Adapter| surface.is_none_or(|s| a.is_surface_supported(s));
            let choices = Gpu::choices(adapters).map_err(|e| e.to_string())?;
            let none = "no GPU can show a window".to_owned();
            choices.into_iter().find(fits).ok_or(none)
        })),
        device_descriptor: Arc::new(Gpu::wanted),
        ..WgpuSetupCreateNew::without_display_handle()
    };
    let options = NativeOptions {
        viewport,
        renderer: Renderer::Wgpu,
        run_and_return: true,
        wgpu_options: WgpuConfiguration {
            wgpu_setup: WgpuSetup::CreateNew(setup),
            ..WgpuConfiguration::default()
        },
        ..NativeOptions::default()
    };
    let made: eframe::AppCreator<'_> = Box::new(move |context| {
        let state = context.wgpu_render_state.clone().ok_or("no device for the window")?;
        let app = App::new(kept, &context.egui_ctx, state)?;
        Ok(Box::new(app) as Box<dyn eframe::App + '_>)
    });
    eframe::run_native("Umbrage", options, made).map_err(|e| Error::NoWindow(e.to_string()))
}
