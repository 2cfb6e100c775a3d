//! The command line: what may be asked for, parsed and checked, before any work begins.

pub(crate) mod bench;
mod compare;
mod info;
mod picture;
mod plan;
mod prepare;
mod session;
mod technique;
pub(crate) mod theory;
mod view;
mod window;

pub(crate) use compare::{Compare, Sweep};
pub(crate) use info::Info;
pub(crate) use picture::{Aov, PictureArgs, PictureKind, Render};
pub(crate) use plan::Plan;
pub(crate) use prepare::Prepare;
pub(crate) use view::{SceneArgs, SceneChangeArgs, ViewArgs};
pub(crate) use window::Window;

use crate::output;
use clap::builder::PossibleValuesParser;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use session::Told;
use std::ffi::OsString;
use std::path::PathBuf;

/// How wrong is which shadow mapping technique, where, and at what price, against ray-traced truth.
///
/// Without a command it compares seven techniques on a built-in scene and writes the folder
/// `report`.
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
    /// Open a window in which techniques are tried and compared, moving.
    View(Window),
    /// Print the matrices, resolutions and errors that an engine needs.
    Plan(Plan),
    /// Make the levels of detail of a scene ahead, for huge ones.
    Prepare(Prepare),
    /// Tell what is in a scene: cameras, lights, sizes, and the view and light that would be taken.
    Info(Info),
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
    /// Print a script by which a shell completes this program's command lines.
    Completions(Completions),
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

/// `umbrage completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage completions bash > ~/.local/share/bash-completion/completions/umbrage
  umbrage completions fish > ~/.config/fish/completions/umbrage.fish")]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

/// `umbrage figures`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  umbrage figures -o figures
  umbrage figures -o figures --only lispsm-fig6")]
pub(crate) struct Figures {
    /// Folder for pictures, tables and their page; former figures there are replaced.
    #[arg(short, long, value_name = "DIR", default_value = "figures")]
    pub(crate) output: PathBuf,
    /// Make this figure alone; once for each.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(umbrage_figures::names()))]
    pub(crate) only: Vec<String>,
}

/// What is done if no command is given.
const MAIN_JOB: [&str; 3] = ["umbrage", "compare", "town"];

/// Parses and checks a command line; its first word is the program's name. Gives the command and
/// how verbose to be.
///
/// Clap's own errors come out, those for `--help` and `--version` among them.
pub(crate) fn parse(
    words: impl IntoIterator<Item = OsString>,
) -> Result<(Command, u8), clap::Error> {
    let matches = Cli::command().try_get_matches_from(words)?;
    let parsed = Cli::from_arg_matches(&matches);
    let Cli { verbose, command } = parsed.map_err(|e| e.format(&mut Cli::command()))?;
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
    if let Some((_, own)) = matches.subcommand() {
        match &mut command {
            Command::Render(render) => render.scene.session.told = Told::of(own),
            Command::Compare(compare) => compare.scene.session.told = Told::of(own),
            Command::Plan(plan) => plan.session.told = Told::of(own),
            _ => {}
        }
    }
    let checked = match &mut command {
        Command::Render(render) => render.check(),
        Command::Compare(compare) => compare.check(),
        Command::Sweep(sweep) => sweep.comparison.techniques.check(),
        Command::Plan(plan) => plan.check(),
        Command::Info(info) => info.check(),
        Command::Prepare(_)
        | Command::Scenes(_)
        | Command::Figures(_)
        | Command::View(_)
        | Command::Devices(_)
        | Command::Completions(_)
        | Command::Help(_) => Ok(()),
        Command::Bench(bench) => bench.check(),
        Command::Theory(theory) => theory.check(),
    };
    checked.map_err(|e| {
        clap::Error::raw(clap::error::ErrorKind::ValueValidation, output::one_line(&e))
    })?;
    Ok((command, verbose))
}

impl Command {
    /// Takes up the session that the command line names, if it does.
    pub(crate) fn take_session(&mut self) -> anyhow::Result<()> {
        match self {
            Self::Render(render) => render.take_session(),
            Self::Compare(compare) => compare.take_session(),
            Self::Plan(plan) => plan.take_session(),
            _ => Ok(()),
        }
    }
}

impl Help {
    fn is_language(&self) -> bool {
        self.topic == [LANGUAGE]
    }
}

/// The script that completes command lines in a shell.
pub(crate) fn completions(shell: clap_complete::Shell) -> Vec<u8> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "umbrage", &mut script);
    script
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
