//! `umbrage theory` evaluates the papers' closed forms.

use crate::args::theory::{Aliasing, Form, FrustumArgs, Lambda, Step, Storage, Theory};
use crate::output::{aligned, print, six_digits};
use anyhow::{Result, anyhow, bail};
use serde::Serialize;
use umbrage::theory::{
    Errors, Extrema, Extremum, FourierStep, Rule, StepAt, Tilted, View, Warped, storage_factor,
};
use umbrage::{Error, Faces};

/// The errors E at a point, in the units of equations 13 and 14 of Zhang, Zhao and Sun 2009.
/// Infinite values are `null`.
#[derive(Serialize)]
struct AliasingJson {
    lambda: Option<f64>,
    mu: f64,
    tan_phi_w: f64,
    z_w: Option<f64>,
    #[serde(rename = "G")]
    g: Option<f64>,
    #[serde(rename = "F_q")]
    f_q: f64,
    #[serde(rename = "F_p")]
    f_p: f64,
    #[serde(flatten)]
    errors: ErrorsJson<f64>,
    /// Smallest errors over the view.
    least: ErrorsJson<ExtremumJson>,
    /// Largest errors over the view.
    largest: ErrorsJson<ExtremumJson>,
    /// Factors of the projection error, for the slope of `--slope`.
    #[serde(skip_serializing_if = "Option::is_none")]
    projection: Option<ProjectionJson>,
}

#[derive(Serialize)]
struct ErrorsJson<T> {
    #[serde(rename = "E_q")]
    q: T,
    #[serde(rename = "E_p")]
    p: T,
    #[serde(rename = "E_pq")]
    product: T,
}

#[derive(Serialize)]
struct ExtremumJson {
    value: f64,
    y: f64,
    z: f64,
}

/// Factors of the projection error. A factor is infinite, so `null`, where the slope runs along the
/// light.
#[derive(Serialize)]
struct ProjectionJson {
    #[serde(rename = "E_q")]
    q: Option<f64>,
    #[serde(rename = "E_p")]
    p: Option<f64>,
}

#[derive(Serialize)]
struct StorageJson {
    storage_factor: f64,
}

#[derive(Serialize)]
struct LambdaJson {
    /// `null` if there is no warp.
    lambda: Option<f64>,
}

#[derive(Serialize)]
struct StepJson {
    visibility: f64,
}

/// Evaluates the chosen closed form, and prints the results.
pub(crate) fn run(args: &Theory) -> Result<()> {
    match &args.form {
        Form::Aliasing(args) => aliasing(args),
        Form::Storage(args) => storage(args),
        Form::Lambda(args) => lambda(args),
        Form::Step(args) => step(args),
    }
}

fn aliasing(args: &Aliasing) -> Result<()> {
    let rule = match (args.lambda, args.warp) {
        (Some(metres), _) => Rule::Lambda(metres),
        (None, Some(Rule::Log)) => bail!(
            "--warp: the rows of log do not follow from λ, nor does E_p; `umbrage theory storage` has \
             the texels it needs"
        ),
        (None, rule) => rule.unwrap_or(Rule::Uniform),
    };
    let tilted = tilted(args.view, args.theta.degrees)?;
    let warped =
        tilted.lambda(rule).and_then(|l| tilted.warped(l)).map_err(|e| option_error(&e))?;
    let [x, y, z] = args.point.to_array();
    let errors = warped.errors(y, z).map_err(|e| option_error(&e))?;
    let projection = args.slope.map(|slope| warped.projection([x, y, z], slope)).transpose();
    let projection = projection.map_err(|e| option_error(&e))?;
    let (near, far) = (args.view.near, args.view.far);
    let edge = z * tilted.view().tan_phi() * (1.0 + 1e-9);
    if !(near..=far).contains(&z) || x.abs() > edge || y.abs() > edge {
        log::warn!("--point: {x},{y},{z} lies outside the view, which the map need not cover");
    }
    if args.json {
        json(&AliasingJson::new(&warped, y, z, errors, projection))
    } else {
        print(&aliasing_table(&warped, y, z, errors, projection))
    }
}

impl AliasingJson {
    fn new(warped: &Warped, y: f64, z: f64, e: Errors, projection: Option<Errors>) -> Self {
        let Extrema { q, p, product } = warped.extrema();
        Self {
            lambda: finite(warped.lambda()),
            mu: warped.tilted().mu(),
            tan_phi_w: warped.tan_phi_w(),
            z_w: finite(warped.z_w(y, z)),
            g: finite(warped.g(y)),
            f_q: warped.f_q(),
            f_p: warped.f_p(),
            errors: ErrorsJson { q: e.q, p: e.p, product: e.product() },
            least: ErrorsJson {
                q: q.least.into(),
                p: p.least.into(),
                product: product.least.into(),
            },
            largest: ErrorsJson {
                q: q.largest.into(),
                p: p.largest.into(),
                product: product.largest.into(),
            },
            projection: projection.map(|e| ProjectionJson { q: finite(e.q), p: finite(e.p) }),
        }
    }
}

impl From<Extremum> for ExtremumJson {
    fn from(e: Extremum) -> Self {
        Self { value: e.value, y: e.y, z: e.z }
    }
}

fn aliasing_table(
    warped: &Warped,
    y: f64,
    z: f64,
    e: Errors,
    projection: Option<Errors>,
) -> String {
    let row = |name: &str, value: f64| [name.to_owned(), digits(value)];
    let mut text = aligned(&[
        row("λ", warped.lambda()),
        row("μ", warped.tilted().mu()),
        row("tan φ_w", warped.tan_phi_w()),
        row("z_w", warped.z_w(y, z)),
        row("G", warped.g(y)),
        row("F_q", warped.f_q()),
        row("F_p", warped.f_p()),
    ]);
    let heads = ["", "here", "least", "y", "z", "largest", "y", "z"];
    let mut rows = vec![heads.map(str::to_owned)];
    let extrema = warped.extrema();
    for (name, here, extreme) in
        [("E_q", e.q, extrema.q), ("E_p", e.p, extrema.p), ("E_pq", e.product(), extrema.product)]
    {
        let (a, b) = (extreme.least, extreme.largest);
        let [here, v, y, z, w, y2, z2] = [here, a.value, a.y, a.z, b.value, b.y, b.z].map(digits);
        rows.push([name.to_owned(), here, v, y, z, w, y2, z2]);
    }
    text += "\n";
    text += &aligned(&rows);
    if let Some(factors) = projection {
        text += "\n";
        text += &aligned(&[row("E_q^proj", factors.q), row("E_p^proj", factors.p)]);
    }
    text
}

fn storage(args: &Storage) -> Result<()> {
    let view = view(args.view)?;
    let faces = if args.face { Faces::SidesAndNear } else { Faces::Whole };
    let factor = storage_factor(view, args.warp, args.slices, faces, args.light)
        .map_err(|e| option_error(&e))?;
    if args.json {
        return json(&StorageJson { storage_factor: factor });
    }
    print(&format!("{} texels a pixel\n", digits(factor)))
}

fn lambda(args: &Lambda) -> Result<()> {
    let lambda =
        tilted(args.view, args.theta.degrees)?.lambda(args.warp).map_err(|e| option_error(&e))?;
    if args.json {
        return json(&LambdaJson { lambda: finite(lambda) });
    }
    print(&match finite(lambda) {
        Some(metres) => format!("{} m\n", digits(metres)),
        None => "no warp\n".to_owned(),
    })
}

fn step(args: &Step) -> Result<()> {
    let at = StepAt { offset: args.offset, scale: args.scale };
    let visibility = FourierStep::new(args.order, args.attenuation)
        .and_then(|step| step.visibility(args.receiver, args.occluder, at))
        .map_err(|e| option_error(&e))?;
    if args.json {
        return json(&StepJson { visibility });
    }
    print(&format!("{} lit\n", digits(visibility)))
}

fn view(args: FrustumArgs) -> Result<View> {
    View::new(args.near, args.far, args.half_fov.to_radians()).map_err(|e| option_error(&e))
}

fn tilted(args: FrustumArgs, theta_degrees: f64) -> Result<Tilted> {
    Tilted::new(view(args)?, theta_degrees.to_radians()).map_err(|e| option_error(&e))
}

/// Turns an error of the library into one that names the command-line option at fault.
fn option_error(error: &Error) -> anyhow::Error {
    let Error::Invalid { field, problem } = error else {
        return anyhow!("{error}");
    };
    let name = field.strip_prefix("theory.").unwrap_or(field);
    let option = match name {
        "half_fov_rad" => "half-fov",
        "theta_rad" => "theta",
        "slices" => "z",
        "faces" => "face",
        other => other,
    };
    anyhow!("--{option}: {problem}")
}

fn json(value: &impl Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

fn finite(x: f64) -> Option<f64> {
    Some(x).filter(|x| x.is_finite())
}

/// Formats a number with six digits, and with an exponent if it is very large or very small.
fn digits(x: f64) -> String {
    format!("{:?}", six_digits(x))
}
