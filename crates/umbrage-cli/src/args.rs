//! The command line: what may be asked for, parsed and checked, before any work begins.

pub(crate) mod bench;
pub(crate) mod theory;

use crate::figures;
use crate::motion::Motion;
use crate::spec::Spec;
use crate::values;
use anyhow::{Result, bail, ensure};
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use std::ffi::OsString;
use std::path::PathBuf;

/// How wrong is which shadow mapping technique, where, and at what price, against ray-traced truth.
///
/// Without a command it compares five techniques on a built-in scene and writes the folder `report`.
#[derive(Debug, Parser)]
#[command(
    name = "umbrage",
    version,
    disable_help_subcommand = true,
    after_help = "\
Examples:
  umbrage
  umbrage compare town -o report --shadows uniform --shadows lispsm:pcf3@2048
  umbrage COMMAND --help
  umbrage help shadows"
)]
pub(crate) struct Cli {
    /// Log what happens to standard error; twice for more.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render one picture with shadows.
    Render(Render),
    /// Compare techniques with ray-traced truth, in a report that opens offline.
    Compare(Compare),
    /// Compare techniques in many views, with means over all.
    Sweep(Sweep),
    /// Print the matrices, resolutions and errors that an engine needs.
    Plan(Plan),
    /// List the built-in scenes.
    Scenes(Scenes),
    /// Compute the papers' figures again, from closed forms, planned maps and renders.
    Figures(Figures),
    /// Compute the papers' closed forms: errors, storage, warps, the Fourier step.
    Theory(theory::Theory),
    /// Measure what techniques cost: planning, maps, pictures.
    Bench(bench::Bench),
    /// List the GPUs there are, and what they can do.
    Devices(bench::Devices),
    /// Explain a command, or how techniques are written: `umbrage help shadows`.
    Help(Help),
}

/// `umbrage help`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage help shadows
  umbrage help theory step")]
pub(crate) struct Help {
    /// `shadows`, or a command's words.
    #[arg(value_name = "TOPIC")]
    pub(crate) topic: Vec<OsString>,
}

/// The topic of `umbrage help` that is no command: the language of techniques.
const LANGUAGE: &str = "shadows";

/// `umbrage render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage render town -o town.png --shadows lispsm:pcf3@2048
  umbrage render model.glb -o error.exr --shadows uniform@512 --aov error \\
      --eye 0,2,5 --target 0,0,0 --sun=-0.5,-1,-0.3")]
pub(crate) struct Render {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Picture to write: .png, or .exr for raw floats.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// How to make shadows, as in lispsm:pcf3@2048 (`umbrage help shadows` has all words).
    #[arg(long, value_name = "SPEC", default_value = "adaptive")]
    pub(crate) shadows: Spec,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What to write.
    #[arg(long, value_enum, default_value_t = Aov::Color)]
    pub(crate) aov: Aov,
    /// Rays along each side of a pixel: K×K samples.
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) samples: u32,
    /// What the map is fitted to.
    #[arg(long, value_enum, default_value_t = Fit::Surfaces)]
    pub(crate) fit: Fit,
    #[command(flatten)]
    pub(crate) execution: ExecutionArgs,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

/// What a rendered picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Aov {
    /// The shaded scene.
    Color,
    /// What the shadow map says: 255 lit, 0 in shadow.
    Visibility,
    /// What ray tracing says: 255 lit, 0 in shadow.
    Truth,
    /// Where the shadow map is lighter or darker than the truth. EXR: visibility minus truth.
    Difference,
    /// Pixels per texel on the surface, in the worst direction.
    Error,
    /// Distance along the view. PNG: by its logarithm, the nearest white. EXR: metres.
    Depth,
    /// World-space surface normal. PNG: −1 … 1 as 0 … 255.
    Normal,
    /// The shadow map's texels as they lie on the surfaces. EXR: texel coordinates s and t.
    Texels,
    /// Which map of the plan serves each pixel. EXR: its index, −1 for none.
    Partition,
    /// How much pixels sparkle while the viewer moves away (8 frames of `compare --motion away`), against supersampled truth. EXR: the mean change of a
    /// pixel's error from frame to frame, NaN where pixels show more than one surface.
    Minification,
}

/// `umbrage compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage compare town -o report --shadows uniform --shadows psm --shadows adaptive
  umbrage compare level.glb -o report --shadows lispsm@2048 --shadows tsm:pcf3@2048 \\
      --eye 0,6,30 --target=-15,0,0 --near 0.25 --far 125 --sun=-0.58,-0.71,-0.41 --json")]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Folder for the report; a former report there is replaced.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) comparison: ComparisonArgs,
    /// Measure flicker too: how often shadows change in a motion where the truth does not; and with `away` noise: how much pixels sparkle.
    #[arg(long, value_enum)]
    pub(crate) motion: Option<Motion>,
    /// Frames of the motion.
    #[arg(
        long, value_name = "N", default_value_t = 8, requires = "motion",
        value_parser = clap::value_parser!(u32).range(2..=1000)
    )]
    pub(crate) frames: u32,
    /// Print report.json to standard output.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
}

/// `umbrage sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
VIEWS is a JSON list of objects. Each needs `name` and `scene`; what `compare` takes as options may
follow, with the same defaults: `eye`, `target`, `up` (three numbers), `fov`, `near`, `far`, `size` (two),
`camera`, `sun` (three) and `light`. For example
  [{\"name\": \"noon\", \"scene\": \"town\", \"sun\": [0.1, -1, 0.2]},
   {\"name\": \"gate\", \"scene\": \"city/level.glb\", \"eye\": [0, 2, 9], \"target\": [0, 1, 0], \"far\": 80}]
A sweep that was stopped goes on where it was if the same command is given again. What failed is tried
again.

Examples:
  umbrage sweep views.json -o sweep --shadows uniform --shadows lispsm:pcf3@2048
  umbrage sweep views.json -o share2 --shard 2/8
  umbrage sweep views.json -o sweep --merge share1 share2 share3 share4 share5 share6 share7 share8")]
pub(crate) struct Sweep {
    /// A JSON list of views (the end of this help shows one).
    #[arg(value_name = "VIEWS")]
    pub(crate) views: PathBuf,
    /// Folder for the results; a sweep that was begun there goes on.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Folder that the scenes' paths start from; without it, the folder of VIEWS.
    #[arg(long, value_name = "DIR")]
    pub(crate) scenes: Option<PathBuf>,
    /// Do the I-th of N equal shares of the views, in their order, into a folder of its own.
    #[arg(long, value_name = "I/N", value_parser = values::share)]
    pub(crate) shard: Option<Share>,
    /// Take what there is from these folders of other shares of this sweep, and compute nothing.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "shard")]
    pub(crate) merge: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) comparison: ComparisonArgs,
    /// Alpha-masked materials cast and show as solid.
    #[arg(long)]
    pub(crate) opaque: bool,
    /// Size of the pictures, pixels, where a view has none of its own.
    #[arg(
        long, value_name = "WxH", value_parser = values::picture_size, allow_hyphen_values = true,
        default_value = DEFAULT_SIZE
    )]
    pub(crate) size: [u32; 2],
    /// Print results.json to standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// One of equal shares of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Share {
    /// Which one, from 1.
    pub(crate) index: u32,
    /// Of how many.
    pub(crate) count: u32,
}

/// `umbrage plan`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage plan town --shadows adaptive+z4@2048 --json
  umbrage plan town --shadows lispsm+z3 --max-error 1
  umbrage plan --eye 0,2,0 --target 0,2,-1 --fov 60 --near 0.1 --far 500 --size 1280x720 \\
      --sun 0.3,-1,0.2 --shadows lispsm@1024 --json")]
pub(crate) struct Plan {
    /// A .gltf or .glb file, or a built-in scene (`umbrage scenes` lists them). Without one, the whole
    /// view between --near and --far is served.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: Option<String>,
    /// How to make shadows, as in lispsm:pcf3@2048 (`umbrage help shadows` has all words).
    #[arg(long, value_name = "SPEC", default_value = "adaptive")]
    pub(crate) shadows: Spec,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What the maps are fitted to, and their errors the largest over.
    #[arg(long, value_enum, default_value_t = Fit::Box)]
    pub(crate) fit: Fit,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) lights: LightsArgs,
}

/// `umbrage scenes`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage scenes
  umbrage scenes --json")]
pub(crate) struct Scenes {
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `umbrage figures`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage figures -o figures
  umbrage figures -o figures --only lispsm-fig6")]
pub(crate) struct Figures {
    /// Folder for pictures, tables and their page; former figures there are replaced.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Make this figure alone; once for each.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(figures::names()))]
    pub(crate) only: Vec<String>,
}

/// Which scene.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// A .gltf or .glb file, or a built-in scene (`umbrage scenes` lists them), with a size if you
    /// like: town:200.
    #[arg(value_name = "SCENE")]
    pub(crate) name: String,
    /// Alpha-masked materials cast and show as solid.
    #[arg(long)]
    pub(crate) opaque: bool,
}

/// Techniques that compete.
#[derive(Clone, Debug, Args)]
pub(crate) struct TechniqueArgs {
    /// How to make shadows, as in lispsm:pcf3@2048; once for each technique (`umbrage help shadows`
    /// has all words).
    #[arg(long, value_name = "SPEC", default_values = DEFAULT_TECHNIQUES)]
    pub(crate) shadows: Vec<Spec>,
    #[command(flatten)]
    pub(crate) texels: TexelArgs,
    /// What the maps are fitted to.
    #[arg(long, value_enum, default_value_t = Fit::Surfaces)]
    pub(crate) fit: Fit,
    #[command(flatten)]
    pub(crate) execution: ExecutionArgs,
}

impl TechniqueArgs {
    fn check(&mut self) -> Result<()> {
        self.texels.apply(&mut self.shadows)?;
        check_distinct(&self.shadows)
    }
}

/// What to compare with the truth, and how finely.
#[derive(Clone, Debug, Args)]
pub(crate) struct ComparisonArgs {
    #[command(flatten)]
    pub(crate) techniques: TechniqueArgs,
    /// Rays along each side of a pixel: K×K samples. Renderers shade at pixel centres only, so
    /// comparisons use 1.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) samples: u32,
}

/// What shadow maps are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fit {
    /// The box around the scene, air and all.
    Box,
    /// Some hundred boxes around its surfaces.
    Surfaces,
}

impl Fit {
    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Surfaces => "surfaces",
        }
    }
}

/// Who looks on. What is left out comes from the scene.
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
    /// A camera of the scene, by name.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
}

/// What shines. Left out: the scene's first light, else a 45° afternoon sun.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightArgs {
    /// Parallel light: the way it travels.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub(crate) sun: Option<DVec3>,
    /// A light of the scene, by name.
    #[arg(long, value_name = "NAME")]
    pub(crate) light: Option<String>,
}

/// What shines, one light or more. Left out: as for one.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightsArgs {
    /// Parallel light: the way it travels.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    sun: Option<DVec3>,
    /// A light of the scene, by name; once for each.
    #[arg(long, value_name = "NAME")]
    light: Vec<String>,
}

/// How many texels there are where specifications do not say.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TexelArgs {
    /// Take the fewest texels with which none gets wider than PX pixels, before any surface's slope, in
    /// place of @TEXELS.
    #[arg(long, value_name = "PX", value_parser = values::pixels_per_texel, allow_hyphen_values = true)]
    pub(crate) max_error: Option<f64>,
}

/// What does the work.
#[derive(Clone, Debug, Args)]
pub(crate) struct ExecutionArgs {
    /// What renders the shadow maps.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub(crate) backend: Backend,
}

/// What renders shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    /// The GPU if there is one, else the reference.
    Auto,
    /// A GPU.
    Gpu,
    /// Rays on the CPU.
    Reference,
}

/// Size of pictures where none is given.
const DEFAULT_SIZE: &str = "960x540";

/// What `compare` compares if not told.
pub(crate) const DEFAULT_TECHNIQUES: [&str; 5] = ["uniform", "psm", "lispsm", "tsm", "adaptive"];

/// What is done if no command is given.
const MAIN_JOB: [&str; 5] = ["umbrage", "compare", "town", "--output", "report"];

/// Parses and checks a command line; its first word is the program's name. Gives the command and how
/// verbose to be.
///
/// Clap's own errors come out, those for `--help` and `--version` among them.
pub(crate) fn parse(
    words: impl IntoIterator<Item = OsString>,
) -> Result<(Command, u8), clap::Error> {
    let Cli { verbose, command } = Cli::try_parse_from(words)?;
    let Some(mut command) = command else {
        let main_job = MAIN_JOB.map(OsString::from);
        return parse(main_job).map(|(command, _)| (command, verbose));
    };
    if let Command::Help(help) = &command
        && !help.is_language()
    {
        // A command's own help, or its complaint about words that are none.
        let topic = help.topic.iter().cloned();
        let words = ["umbrage".into()].into_iter().chain(topic).chain(["--help".into()]);
        return parse(words.collect::<Vec<OsString>>());
    }
    let checked = match &mut command {
        Command::Render(render) => render.check(),
        Command::Compare(compare) => compare.check(),
        Command::Sweep(sweep) => sweep.comparison.techniques.check(),
        Command::Plan(plan) => plan.check(),
        Command::Scenes(_) | Command::Figures(_) | Command::Devices(_) | Command::Help(_) => Ok(()),
        Command::Bench(bench) => bench.check(),
        Command::Theory(theory) => theory.check(),
    };
    checked.map_err(|e| clap::Error::raw(clap::error::ErrorKind::ValueValidation, e))?;
    Ok((command, verbose))
}

impl Help {
    fn is_language(&self) -> bool {
        self.topic == [LANGUAGE]
    }
}

/// Clap's message on one line, without usage and pointers to `--help`.
pub(crate) fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let lines = text.lines().map(str::trim).take_while(|l| !l.starts_with("Usage:"));
    let words: Vec<&str> =
        lines.filter(|l| !l.is_empty() && !l.starts_with("For more information")).collect();
    let line = words.join(" ");
    line.strip_prefix("error: ").unwrap_or(&line).to_owned()
}

impl Render {
    fn check(&mut self) -> Result<()> {
        self.texels.apply(std::slice::from_mut(&mut self.shadows))?;
        self.view.check()?;
        self.light.check()?;
        self.picture_kind().map(drop)
    }

    /// Which kind of file to write, by the output's extension.
    pub(crate) fn picture_kind(&self) -> Result<PictureKind> {
        let extension = self.output.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(PictureKind::Png),
            Some("exr") => Ok(PictureKind::Exr),
            _ => bail!("--output: {} must end in .png or .exr", self.output.display()),
        }
    }
}

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureKind {
    /// 8-bit colours, for looking at.
    Png,
    /// Raw floats.
    Exr,
}

impl Compare {
    fn check(&mut self) -> Result<()> {
        self.view.check()?;
        self.light.check()?;
        self.comparison.techniques.check()
    }
}

/// That no technique is given twice.
fn check_distinct(techniques: &[Spec]) -> Result<()> {
    for (i, spec) in techniques.iter().enumerate() {
        let is_new = !techniques[..i].contains(spec);
        ensure!(is_new, "--shadows: `{}` is given twice", spec);
    }
    Ok(())
}

impl Plan {
    fn check(&mut self) -> Result<()> {
        self.texels.apply(std::slice::from_mut(&mut self.shadows))?;
        self.view.check()?;
        self.lights.check()?;
        if self.scene.is_some() {
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
            [("--camera", view.camera.is_some()), ("--light", !self.lights.light.is_empty())]
        {
            ensure!(!is_given, "{option} names something of a scene, but no SCENE is given");
        }
        ensure!(self.fit == Fit::Box, "--fit surfaces needs a SCENE, whose surfaces they are");
        Ok(())
    }
}

impl TexelArgs {
    /// Gives the error to the techniques that do not say how many texels they have.
    fn apply(self, techniques: &mut [Spec]) -> Result<()> {
        let Some(pixels) = self.max_error else { return Ok(()) };
        if let Some(told) = techniques.iter().find(|t| t.is_sized())
            && techniques.iter().all(|t| t.is_sized())
        {
            bail!(
                "--max-error: `{}` says how many texels there are; leave out either of them",
                told
            );
        }
        for spec in techniques {
            spec.limit_error(pixels);
        }
        Ok(())
    }
}

impl LightsArgs {
    /// Each light for itself; one that says nothing if none was named.
    pub(crate) fn each(&self) -> Vec<LightArgs> {
        let one = |light| LightArgs { sun: self.sun, light };
        if self.light.is_empty() {
            vec![one(None)]
        } else {
            self.light.iter().cloned().map(Some).map(one).collect()
        }
    }

    fn check(&self) -> Result<()> {
        for (i, name) in self.light.iter().enumerate() {
            ensure!(!self.light[..i].contains(name), "--light: `{name}` is given twice");
        }
        self.each().iter().try_for_each(LightArgs::check)
    }
}

impl ViewArgs {
    /// Whether the values, each right by itself, go together.
    pub(crate) fn check(&self) -> Result<()> {
        let own = [("eye", self.eye), ("target", self.target), ("up", self.up)];
        if let Some((option, _)) = own.iter().find(|(_, v)| self.camera.is_some() && v.is_some()) {
            bail!("--camera: cannot be used with --{option}");
        }
        if let (Some(near), Some(far)) = (self.near, self.far) {
            ensure!(near < far, "--far: must exceed --near ({near}), is {far}");
        }
        if let (Some(eye), Some(target)) = (self.eye, self.target) {
            ensure!(eye != target, "--target: must differ from --eye, both are {eye}");
        }
        Ok(())
    }
}

impl LightArgs {
    /// Whether the values, each right by itself, go together.
    pub(crate) fn check(&self) -> Result<()> {
        ensure!(self.sun.is_none() || self.light.is_none(), "--light: cannot be used with --sun");
        Ok(())
    }
}
