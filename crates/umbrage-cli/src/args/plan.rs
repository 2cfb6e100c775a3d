//! `umbrage plan`: its options.

use super::session::SessionArgs;
use super::technique::{Fit, TexelArgs};
use super::view::{LightsArgs, SceneChangeArgs, ViewArgs};
use anyhow::{Result, ensure};
use clap::Args;
use umbrage_lab::NamedTechnique;

/// `umbrage plan`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage plan town --shadows adaptive+z4@2048 --json
  umbrage plan town --shadows lispsm+z3 --max-error 1
  umbrage plan --eye 0,2,0 --target 0,2,-1 --fov 60 --near 0.1 --far 500 --size 1280x720 \\
      --sun 0.3,-1,0.2 --shadows lispsm@1024 --json")]
pub(crate) struct Plan {
    /// A .gltf or .glb file, or a built-in scene (`umbrage scenes` lists them). Without one, the
    /// whole view between --near and --far is served.
    #[arg(value_name = "SCENE", id = "name")]
    pub(crate) scene: Option<String>,
    #[command(flatten)]
    pub(crate) session: SessionArgs,
    #[command(flatten)]
    pub(crate) changes: SceneChangeArgs,
    /// How to make shadows, as in lispsm:pcf3@2048 (`umbrage help shadows` has all words).
    #[arg(long, value_name = "SPEC", default_value = "adaptive")]
    pub(crate) shadows: NamedTechnique,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What the maps are fitted to, and their errors the largest over. Other commands take surfaces
    /// by default; an engine may know no more than a box.
    #[arg(long, value_enum, default_value_t = Fit::Box)]
    pub(crate) fit: Fit,
    /// List the pages that the view needs, with their matrices.
    #[arg(long)]
    pub(crate) pages: bool,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) lights: LightsArgs,
}

impl Plan {
    /// Takes what is not asked for from the session, if there is one.
    pub(super) fn take_session(&mut self) -> Result<()> {
        let Some(session) = self.session.read()? else { return Ok(()) };
        let told = self.session.told;
        self.changes.take(&session);
        self.lights.take(session.light_options());
        self.view.take(session.view, told.size);
        self.scene = Some(session.scene);
        if !told.shadows
            && let Some(shown) = session.techniques.into_iter().next()
        {
            self.shadows = shown;
        }
        if !told.fit {
            self.fit = session.fit.into();
        }
        self.check()
    }

    pub(super) fn check(&mut self) -> Result<()> {
        self.texels.apply(std::slice::from_mut(&mut self.shadows))?;
        self.view.options().check()?;
        self.lights.check()?;
        ensure!(
            !self.pages || self.shadows.technique().paged_error().is_some(),
            "--pages: `{}` has no pages; take --shadows paged",
            self.shadows
        );
        if self.scene.is_some() || self.session.is_some() {
            return Ok(());
        }
        let view = &self.view;
        let given = [
            ("--eye", view.eye.is_some()),
            ("--target", view.target.is_some()),
            ("--near", view.near.is_some()),
            ("--far", view.far.is_some()),
        ];
        for (option, is_given) in given {
            ensure!(is_given, "{option} is needed where no SCENE is given");
        }
        for (option, is_given) in
            [("--camera", view.camera.is_some()), ("--light", self.lights.names_any())]
        {
            ensure!(!is_given, "{option} names something of a scene, but no SCENE is given");
        }
        let SceneChangeArgs { opaque, animation, time: _, without, ground } = &self.changes;
        let changes = [
            ("--opaque", *opaque),
            ("--animation", animation.is_some()),
            ("--without", !without.is_empty()),
            ("--ground", *ground),
        ];
        for (option, is_given) in changes {
            ensure!(!is_given, "{option} changes a scene, but no SCENE is given");
        }
        ensure!(!self.pages, "--pages: what is seen of a SCENE decides which there are; give one");
        ensure!(self.fit == Fit::Box, "--fit: `surfaces` and `seen` need a SCENE, which has them");
        Ok(())
    }
}
