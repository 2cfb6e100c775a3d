//! Runs shadow techniques on scenes and compares them with ray-traced truth: in one view, in a
//! motion or in many views. A program describes in plain structs what it wants, is told of the
//! [`Progress`], and gets figures, pictures and reports.
//!
//! ```text
//! open_scene ──────► PreparedScene ──► Comparison ──► Compared ──► report's folder
//! Executors ───────►                       ▲
//! choose_view, choose_light ───────────────┘
//! NamedTechnique ──► plan ──► Executor ──► Strip ──► Shadowed, Texels, Shape
//! sweep, join_shares: a Comparison for each view of a file
//! ```
//!
//! - [`ViewOptions`] and [`LightOptions`] describe the view and the light that a user asks for.
//!   [`choose_view`] and [`choose_light`] take what is left out from the scene.
//! - A [`NamedTechnique`] is a technique with the text that describes it. Reports name the
//!   technique by this text.
//! - [`Executors`] are what renders: the CPU reference and, if there is one, a GPU. A
//!   [`RenderScene`] is a scene prepared for them.
//! - A [`Session`] is all that is chosen, in a file.
//! - [`PreparedScene`], [`Comparison`] and [`Compared`] compare techniques in one view; [`sweep()`]
//!   compares them in many.
//!
//! This crate does not print, parse command lines or query its process. An [`Error`] about a value
//! names the [`Field`] that it belongs to. A program that calls the fields differently passes its
//! own words to [`Error::in_words`].
//!
//! ```
//! use std::path::Path;
//! use umbrage_lab::{
//!     Backend, Comparison, ComparisonOptions, Detail, Executors, Fit, LightOptions, PreparedScene,
//!     SceneOptions, ViewOptions, open_scene,
//! };
//!
//! let options = ComparisonOptions {
//!     techniques: vec!["uniform@64".parse()?, "lispsm@64".parse()?],
//!     samples: 1,
//!     light_size: None,
//! };
//! let view = ViewOptions { size: [48, 27], ..ViewOptions::default() };
//! let scene = open_scene(Path::new(""), "pole", &SceneOptions::default())?;
//! let executors = Executors::open(Backend::Reference, &options.techniques)?;
//! let prepared = PreparedScene::new(&scene, &executors, false, Fit::Surfaces, &Detail::FULL)?;
//! let comparison = Comparison::new(&prepared, &view, &LightOptions::default(), &options)?;
//! let folder = tempfile::tempdir()?;
//! // `()` ignores the progress.
//! let report = comparison.trace(&())?.write(folder.path(), "an example", &())?;
//! assert_eq!(report.results[1].shadows, "lispsm@64");
//! assert!(report.results[0].metrics.wrong_fraction < Some(0.2));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bencher;
mod casters;
mod comparison;
mod defaults;
mod detail;
mod error;
mod executor;
mod executors;
mod folder;
mod light;
mod motion;
mod picture;
mod planning;
mod prepared;
mod presets;
mod progress;
mod receivers;
mod scene;
mod session;
mod strip;
mod sweep;
mod technique;
pub mod values;
mod view;

pub use bencher::{Bencher, Costs};
pub use casters::{MapCasters, casters, casters_culled};
pub use comparison::{Compared, Comparison, ComparisonOptions};
pub use defaults::Defaults;
pub use detail::{Detail, DetailOptions};
pub use error::{Difference, Error, Field, joined};
pub use executor::{Executor, RenderScene, Scout, edge_on, make_pages, shadow_options};
pub use executors::{Backend, Executors, unfit_for_gpu};
pub use folder::{Contents, ReportFolder, check_file};
pub use light::{ChosenLight, LightOptions, choose_light};
pub use motion::{Motion, MovingView, Noise, flicker, noise, turned};
pub use picture::{SeenPage, Shadowed, Shape, Texels};
pub use planning::{
    fade, fit_pages, milliseconds, plan, plan_aging, plan_fading, plan_with, planner, seen_points,
};
pub use prepared::PreparedScene;
pub use presets::{PRESETS, Preset};
pub use progress::Progress;
pub use receivers::{Fit, Receivers, SURFACE_BOXES};
pub use scene::{SceneOptions, open_scene};
pub use session::Session;
pub use strip::{Certainty, NOTHING_TO_SHADOW, Rows, Strip};
pub use sweep::{Share, SweepOptions, join_shares, sweep};
pub use technique::{NamedTechnique, TechniqueError};
pub use view::{ChosenView, ViewOptions, choose_view};
