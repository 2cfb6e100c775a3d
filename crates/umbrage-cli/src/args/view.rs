//! Scene, view and light: options that many commands share.

use crate::values;
use anyhow::{Result, ensure};
use clap::Args;
use glam::DVec3;
use umbrage_lab::{LightOptions, SceneOptions, Session, ViewOptions};

/// Size of pictures where none is given.
pub(super) const DEFAULT_SIZE: &str = "960x540";

/// Which scene.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// A .gltf or .glb file, or a built-in scene (`umbrage scenes` lists them), with a size if you
    /// like: town:200.
    #[arg(value_name = "SCENE")]
    pub(crate) name: String,
    #[command(flatten)]
    pub(crate) changes: SceneChangeArgs,
}

/// How scenes are changed.
#[derive(Clone, Debug, Args)]
pub(crate) struct SceneChangeArgs {
    /// Alpha-masked materials cast and show as solid.
    #[arg(long)]
    pub(crate) opaque: bool,
    /// Pose the scene by an animation, by name or number (`umbrage info` lists them).
    #[arg(long, value_name = "NAME")]
    pub(crate) animation: Option<String>,
    /// Time in the animation, seconds.
    #[arg(
        long, value_name = "SECONDS", value_parser = values::seconds, allow_hyphen_values = true,
        default_value = "0", requires = "animation"
    )]
    pub(crate) time: f64,
    /// Leave nodes out, with all below them, by name or number (`umbrage info` lists them); once
    /// for each. NAME:casting casts no shadow but is seen, NAME:receiving casts but is not seen.
    #[arg(long, value_name = "NAME")]
    pub(crate) without: Vec<String>,
    /// Put ground under the scene, such as a single model.
    #[arg(long)]
    pub(crate) ground: bool,
}

impl SceneChangeArgs {
    /// How the scene is changed when it is opened.
    pub(crate) fn options(&self) -> SceneOptions {
        let Self { animation, time, without, ground, .. } = self.clone();
        SceneOptions { animation, time_s: time, without, ground }
    }

    /// Adds the changes of a session.
    pub(super) fn take(&mut self, session: &Session) {
        self.opaque |= session.opaque;
        self.ground |= session.changes.ground;
        self.without.extend_from_slice(&session.changes.without);
        if self.animation.is_none() {
            self.animation.clone_from(&session.changes.animation);
            self.time = session.changes.time_s;
        }
    }
}

/// The view. What is left out comes from the scene.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "View")]
pub(crate) struct ViewArgs {
    /// Position of the viewer, metres.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,
    /// Point in the middle of the picture, metres.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub(crate) target: Option<DVec3>,
    /// Direction that is up in the picture.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub(crate) up: Option<DVec3>,
    /// Vertical field of view, degrees.
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, allow_hyphen_values = true)]
    pub(crate) fov: Option<f64>,
    /// Orthographic view: the height of what the picture shows, metres.
    #[arg(
        long, value_name = "HEIGHT", value_parser = values::distance, allow_hyphen_values = true,
        conflicts_with = "fov"
    )]
    pub(crate) ortho: Option<f64>,
    /// Distance at which the view begins, metres.
    #[arg(long, value_name = "N", value_parser = values::distance, allow_hyphen_values = true)]
    pub(crate) near: Option<f64>,
    /// Distance at which it ends, metres.
    #[arg(long, value_name = "F", value_parser = values::distance, allow_hyphen_values = true)]
    pub(crate) far: Option<f64>,
    /// Size of the picture, pixels.
    #[arg(
        long, value_name = "WxH", value_parser = values::picture_size, allow_hyphen_values = true,
        default_value = DEFAULT_SIZE
    )]
    pub(crate) size: [u32; 2],
    /// A camera of the scene, by the name of its node, its own name or its number, such as #2.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
}

/// What shines. Left out: the scene's first light, else a 45° afternoon sun.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightArgs {
    /// Parallel light: the way it travels.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    sun: Option<DVec3>,
    /// Parallel light from where the sun stands, degrees: azimuth, clockwise from north (-z; east
    /// is +x), and elevation above the horizon.
    #[arg(
        long, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun_angles,
        allow_hyphen_values = true, conflicts_with_all = ["sun", "light"]
    )]
    sun_angles: Option<DVec3>,
    /// A light of the scene, by the name of its node, its own name or its number, such as #2.
    #[arg(long, value_name = "NAME")]
    light: Option<String>,
}

/// What shines, one light or more. Left out: as for one.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightsArgs {
    /// Parallel light: the way it travels.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    sun: Option<DVec3>,
    /// Parallel light from where the sun stands, degrees: azimuth, clockwise from north (-z; east
    /// is +x), and elevation above the horizon.
    #[arg(
        long, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun_angles,
        allow_hyphen_values = true, conflicts_with_all = ["sun", "light"]
    )]
    sun_angles: Option<DVec3>,
    /// A light of the scene, by the name of its node, its own name or its number, such as #2; once
    /// for each.
    #[arg(long, value_name = "NAME")]
    light: Vec<String>,
}

impl ViewArgs {
    /// The view that is asked for.
    pub(crate) fn options(&self) -> ViewOptions {
        let Self { eye, target, up, fov, ortho, near, far, size, ref camera } = *self;
        ViewOptions {
            eye,
            target,
            up,
            fov_deg: fov,
            ortho,
            near,
            far,
            size,
            camera: camera.clone(),
        }
    }
}

impl ViewArgs {
    /// Takes from a session's view what is not asked for.
    pub(super) fn take(&mut self, view: ViewOptions, is_size_told: bool) {
        if !is_size_told {
            self.size = view.size;
        }
        // A camera of the scene has a whole view.
        if self.camera.is_some() {
            return;
        }
        if self.eye.or(self.target).or(self.up).is_none() {
            self.camera = view.camera;
        }
        if self.fov.or(self.ortho).is_none() {
            (self.fov, self.ortho) = (view.fov_deg, view.ortho);
        }
        self.eye = self.eye.or(view.eye);
        self.target = self.target.or(view.target);
        self.up = self.up.or(view.up);
        self.near = self.near.or(view.near);
        self.far = self.far.or(view.far);
    }
}

impl LightArgs {
    /// The light that is asked for.
    pub(crate) fn options(&self) -> LightOptions {
        LightOptions { sun: self.sun.or(self.sun_angles), light: self.light.clone() }
    }

    /// Takes a session's light if none is asked for.
    pub(super) fn take(&mut self, session: LightOptions) {
        if self.options() == LightOptions::default() {
            (self.sun, self.light) = (session.sun, session.light);
        }
    }
}

impl LightsArgs {
    /// Whether a light of the scene is named.
    pub(super) fn names_any(&self) -> bool {
        !self.light.is_empty()
    }

    /// Each light for itself; one that says nothing if none was named.
    pub(crate) fn each(&self) -> Vec<LightOptions> {
        let one = |light| LightOptions { sun: self.sun.or(self.sun_angles), light };
        if self.light.is_empty() {
            vec![one(None)]
        } else {
            self.light.iter().cloned().map(Some).map(one).collect()
        }
    }

    /// Takes a session's light if none is asked for.
    pub(super) fn take(&mut self, session: LightOptions) {
        if self.each() == [LightOptions::default()] {
            (self.sun, self.light) = (session.sun, session.light.into_iter().collect());
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        for (i, name) in self.light.iter().enumerate() {
            ensure!(!self.light[..i].contains(name), "--light: `{name}` is given twice");
        }
        Ok(self.each().iter().try_for_each(LightOptions::check)?)
    }
}
