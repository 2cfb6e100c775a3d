//! `umbrage theory`: its options.

use crate::values;
use anyhow::{Result, anyhow, bail, ensure};
use clap::{Args, Subcommand};
use glam::DVec3;
use umbrage::language::nearest;
use umbrage::theory::{LightFrom, Rule};
use umbrage::{Partition, Warp};

/// `umbrage theory`.
#[derive(Debug, Args)]
#[command(
    arg_required_else_help = false,
    after_help = "\
Examples:
  umbrage theory aliasing --near 1 --far 100 --half-fov 30 --theta 60 --lambda 11 \\
      --point 2,-3,20 --json
  umbrage theory storage --near 1 --far 1000 --half-fov 30 --warp lispsm --z 4 --light overhead
  umbrage theory lambda --near 1 --far 100 --half-fov 30 --theta 60 --warp adaptive
  umbrage theory step --order 4 --receiver 0.45 --occluder 0.5"
)]
pub(crate) struct Theory {
    /// What to compute.
    #[command(subcommand)]
    pub(crate) form: Form,
}

/// The papers' closed forms, for a square view and light in the plane of its y axis and direction.
#[derive(Debug, Subcommand)]
pub(crate) enum Form {
    /// Errors of a warped map at a point and over the view, under light at any angle.
    Aliasing(Aliasing),
    /// Texels that partitions and warps need for an error of one pixel per texel.
    Storage(Storage),
    /// How far from its map a technique puts the warp's centre of projection.
    Lambda(Lambda),
    /// The shadow test of convolution shadow maps.
    Step(Step),
}

/// `umbrage theory aliasing`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints Zhang, Zhao and Sun's E (2009): how fast the image's coordinates, each from -1 to 1, move
with the map's, each from 0 to 1. Pixels per texel are E times half the image's resolution over
the map's. In JSON, what is infinite is null.

Examples:
  umbrage theory aliasing --near 1 --far 100 --half-fov 30 --theta 60 --lambda 11 \\
      --point 2,-3,20
  umbrage theory aliasing --near 1 --far 100 --half-fov 30 --theta 60 --warp lispsm \\
      --point 2,-3,20 --slope 0.5,-2 --json")]
pub(crate) struct Aliasing {
    #[command(flatten)]
    pub(crate) view: FrustumArgs,
    #[command(flatten)]
    pub(crate) theta: ThetaArgs,
    /// Distance from the warp's centre of projection to its near plane, metres; inf for no warp.
    #[arg(
        long, value_name = "L", value_parser = lambda, allow_hyphen_values = true,
        conflicts_with_all = ["warp", "focus"]
    )]
    pub(crate) lambda: Option<f64>,
    /// The technique that chooses it.
    #[arg(long_help = WARP_HELP, long, value_name = "WARP", value_parser = rule)]
    pub(crate) warp: Option<Rule>,
    #[command(flatten)]
    pub(crate) tsm: FocusArgs,
    /// Where, metres in the viewer's eye: x to the right, z along the view, y to the side to which
    /// the light leans forwards. Errors are largest on the other side.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub(crate) point: DVec3,
    /// A surface there, by its slopes dx/dz and dy/dz: tells what errors are multiplied with on it.
    #[arg(long, value_name = "KX,KY", value_parser = slope, allow_hyphen_values = true)]
    pub(crate) slope: Option<[f64; 2]>,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `umbrage theory storage`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints the storage factor of Lloyd, Tuft, Yoon and Manocha (2006): texels per pixel of the image.

Examples:
  umbrage theory storage --near 1 --far 1000 --half-fov 30 --warp lispsm --z 4 --light overhead
  umbrage theory storage --near 1 --far 1000 --half-fov 30 --warp lispsm --z 4 \\
      --face --light behind --json
  umbrage theory storage --near 1 --far 1000 --half-fov 30 --warp adaptive --z 2 --light 45")]
pub(crate) struct Storage {
    #[command(flatten)]
    pub(crate) view: FrustumArgs,
    /// How each map is warped.
    #[arg(long_help = WARP_HELP, long, value_name = "WARP", value_parser = rule)]
    pub(crate) warp: Rule,
    #[command(flatten)]
    pub(crate) tsm: FocusArgs,
    /// Self-similar slices along the view, with a map each.
    #[arg(
        long = "z", value_name = "K", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=Partition::MAX_SLICES as i64)
    )]
    pub(crate) slices: u32,
    /// Maps for the four sides of the view, sliced each, and one for its near face. Has closed
    /// forms for light overhead and behind.
    #[arg(long)]
    pub(crate) face: bool,
    /// overhead, behind, or the angle between view and light, 0 to 180 degrees.
    #[arg(
        long, value_name = "overhead|behind|DEG", value_parser = light, allow_hyphen_values = true
    )]
    pub(crate) light: LightFrom,
    /// Print JSON instead of a line.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `umbrage theory lambda`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints metres; in JSON, no warp is null.

Examples:
  umbrage theory lambda --near 1 --far 100 --half-fov 30 --theta 60 --warp adaptive
  umbrage theory lambda --near 1 --far 100 --half-fov 30 --theta 90 --warp tsm --focus 10 --json")]
pub(crate) struct Lambda {
    #[command(flatten)]
    pub(crate) view: FrustumArgs,
    #[command(flatten)]
    pub(crate) theta: ThetaArgs,
    /// The technique that chooses it.
    #[arg(long_help = WARP_HELP, long, value_name = "WARP", value_parser = rule)]
    pub(crate) warp: Rule,
    #[command(flatten)]
    pub(crate) tsm: FocusArgs,
    /// Print JSON instead of a line.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `umbrage theory step`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints how much light comes through, 0 to 1, by Annen et al. (2007).

Examples:
  umbrage theory step --order 4 --receiver 0.45 --occluder 0.5
  umbrage theory step --order 16 --receiver 0.5 --occluder 0.5 --attenuation 0.5 --offset --json")]
pub(crate) struct Step {
    /// Terms of the series.
    #[arg(
        long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=1024),
        allow_hyphen_values = true
    )]
    pub(crate) order: u32,
    /// Depth of what may be in shadow, 0 to 1.
    #[arg(long, value_name = "D", value_parser = depth, allow_hyphen_values = true)]
    pub(crate) receiver: f64,
    /// Depth of what the light meets first, 0 to 1.
    #[arg(long, value_name = "Z", value_parser = depth, allow_hyphen_values = true)]
    pub(crate) occluder: f64,
    /// Weaken term k by exp(-A (k/M)^2) against ringing.
    #[arg(
        long, value_name = "A", default_value_t = 0.0, value_parser = attenuation,
        allow_hyphen_values = true
    )]
    pub(crate) attenuation: f64,
    /// Move the receiver towards the light, so far that what is lit is wholly lit.
    #[arg(long)]
    pub(crate) offset: bool,
    /// Double the sum, to the same end.
    #[arg(long)]
    pub(crate) scale: bool,
    /// Print JSON instead of a line.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A square view frustum.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FrustumArgs {
    /// Distance at which the view begins, metres.
    #[arg(long, value_name = "N", value_parser = values::distance, allow_hyphen_values = true)]
    pub(crate) near: f64,
    /// Distance at which it ends, metres.
    #[arg(long, value_name = "F", value_parser = values::distance, allow_hyphen_values = true)]
    pub(crate) far: f64,
    /// Half its field of view, degrees.
    #[arg(long, value_name = "DEG", value_parser = half_fov, allow_hyphen_values = true)]
    pub(crate) half_fov: f64,
}

/// How light lies to the view.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ThetaArgs {
    /// Angle between view and light, 0 to 180 degrees.
    #[arg(long = "theta", value_name = "DEG", value_parser = theta, allow_hyphen_values = true)]
    pub(crate) degrees: f64,
}

/// An option of one technique.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FocusArgs {
    /// For tsm: what is nearer than D metres gets 80% of the rows. Without it, √(near·far).
    #[arg(long, value_name = "D", value_parser = values::distance, allow_hyphen_values = true)]
    pub(crate) focus: Option<f64>,
}

/// What the papers call λ, by name.
const WARP_HELP: &str = "\
How texels are spread: uniform, psm, lispsm, lispsm(range), tsm,
tsm(focus=METRES), adaptive, adaptive(area), log, lambda=METRES.
lispsm is as published, (n + √(n f))/sin θ. lispsm(range) takes no more of
the view for f than the tilted warp's range, as its authors advise; so does
the planner's lispsm.";

/// LiSPSM with its authors' advice for tilted views, which the language of --shadows has no word
/// for.
const IN_RANGE: &str = "lispsm(range)";

impl Theory {
    /// Whether the values, each right by itself, go together.
    pub(super) fn check(&mut self) -> Result<()> {
        let (view, rule, tsm) = match &mut self.form {
            Form::Step(_) => return Ok(()),
            Form::Aliasing(a) => {
                let is_warped = a.lambda.is_some() || a.warp.is_some();
                ensure!(is_warped, "--lambda or --warp is needed: how the map is warped");
                (a.view, a.warp.as_mut(), a.tsm)
            }
            Form::Storage(s) => (s.view, Some(&mut s.warp), s.tsm),
            Form::Lambda(l) => (l.view, Some(&mut l.warp), l.tsm),
        };
        let FrustumArgs { near, far, .. } = view;
        ensure!(near < far, "--far: must exceed --near ({near}), is {far}");
        let Some(metres) = tsm.focus else { return Ok(()) };
        match rule {
            Some(Rule::Tsm { focus: own @ None }) => *own = Some(metres),
            Some(Rule::Tsm { focus: Some(own) }) => {
                bail!("--focus: --warp tsm(focus={own}) has one already; leave out either of them")
            }
            _ => bail!("--focus: is an option of --warp tsm alone"),
        }
        Ok(())
    }
}

/// A rule for λ, in the words of the shadow specification.
fn rule(text: &str) -> Result<Rule> {
    if text == IN_RANGE {
        return Ok(Rule::LispsmInRange);
    }
    match text.parse()? {
        Warp::Uniform => Ok(Rule::Uniform),
        Warp::Psm => Ok(Rule::Psm),
        Warp::Lispsm => Ok(Rule::Lispsm),
        Warp::Tsm { focus } => Ok(Rule::Tsm { focus }),
        Warp::Adaptive(objective) => Ok(Rule::Adaptive(objective)),
        Warp::Log => Ok(Rule::Log),
        Warp::Lambda(metres) if metres >= 1e-12 => Ok(Rule::Lambda(metres)),
        Warp::Lambda(_) => bail!("`{text}` must have at least 1e-12 metres"),
        _ => bail!("`{text}` maps are not fitted to the view, so there is no closed form for them"),
    }
}

/// Metres, or infinitely many.
fn lambda(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(x) if x >= 1e-12 => Ok(x),
        _ => bail!("must be at least 1e-12 metres, as in 11, or inf for no warp"),
    }
}

fn light(text: &str) -> Result<LightFrom> {
    match (text, text.parse::<f64>()) {
        ("overhead", _) => Ok(LightFrom::Overhead),
        ("behind", _) => Ok(LightFrom::Behind),
        // What has a name of its own has closed forms of its own.
        (_, Ok(90.0)) => Ok(LightFrom::Overhead),
        (_, Ok(0.0)) => Ok(LightFrom::Behind),
        (_, Ok(degrees)) if (0.0..=180.0).contains(&degrees) => {
            Ok(LightFrom::Angle(degrees.to_radians()))
        }
        (_, Ok(_)) => bail!("must be an angle of 0 to 180 degrees, or overhead, or behind"),
        (_, Err(_)) => bail!(
            "must be overhead, behind or an angle of 0 to 180 degrees: did you mean {}?",
            nearest(text, ["overhead", "behind"])
        ),
    }
}

fn slope(text: &str) -> Result<[f64; 2]> {
    text.split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse::<f64>().ok()?, y.trim().parse().ok()?]))
        .filter(|k| k.iter().all(|x| x.is_finite()))
        .ok_or_else(|| anyhow!("must be two numbers kx,ky without spaces, as in 0.5,-2"))
}

fn half_fov(text: &str) -> Result<f64> {
    number(text, |degrees| (0.005..=89.5).contains(&degrees))
        .ok_or_else(|| anyhow!("must be an angle of 0.005 to 89.5 degrees, as in 30"))
}

fn theta(text: &str) -> Result<f64> {
    number(text, |degrees| (0.0..=180.0).contains(&degrees))
        .ok_or_else(|| anyhow!("must be an angle of 0 to 180 degrees, as in 60"))
}

fn depth(text: &str) -> Result<f64> {
    number(text, |depth| (0.0..=1.0).contains(&depth))
        .ok_or_else(|| anyhow!("must be a depth of 0 to 1, as in 0.5"))
}

fn attenuation(text: &str) -> Result<f64> {
    number(text, |a| (0.0..=1e6).contains(&a))
        .ok_or_else(|| anyhow!("must be a number from 0 to 1e6, as in 0.5"))
}

fn number(text: &str, is_good: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse().ok().filter(|&x| is_good(x))
}
