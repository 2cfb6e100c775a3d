use super::{Overhead, Rule, Tilted, View, Warped};
use crate::error::{Error, check};
use crate::technique::{Faces, Partition};

/// Where parallel light comes from, as W&P §5.3 has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightFrom {
    /// At right angles to the view, θ = 90°.
    Overhead,
    /// From behind the viewer, along the view: θ = 0.
    Behind,
    /// At this angle θ to the view, radians, 0 ..= π, in the plane of the view's y axis and direction.
    Angle(f64),
}

/// The storage factor S̄ of a view cut into self-similar slices and faces: texels that all maps together need for
/// an error of at most one pixel per texel, per pixel of the image.
///
/// Overhead it is the sum over slices of W&P's Eq. 12, that is Eqs. 17 and 18, and faces change nothing, as the light
/// sees one of them only (Eq. 19). From behind it is Eq. 20 without faces; with faces, each of the four sides
/// is a view of φ = 45° under light overhead, and the near face needs one texel a pixel (Eq. 21). At other
/// angles each slice needs M_q·M_p/4 with its own λ, by the [extrema](Warped::extrema) of Theory's errors.
/// [`Rule::Log`] reaches the optimum ln(f/n)/(2 tan φ) overhead (W&P Appendix C), with any number of slices.
///
/// A [`Rule::Tsm`]'s focus counts in each slice, and for faces from behind along the face; a [`Rule::Lambda`]
/// is the same in all.
///
/// # Errors
///
/// [`Error::Invalid`] with the field
///
/// - `theory.slices` unless 1 ≤ `slices` ≤ [`Partition::MAX_SLICES`], or where V is too short for them;
/// - `theory.faces` where there is no closed form: for faces with light neither overhead nor behind, and
///   without the near face with light behind;
/// - `theory.theta_rad`, `theory.lambda` or `theory.focus` for the numbers of light and rule.
pub fn storage_factor(
    view: View,
    rule: Rule,
    slices: u32,
    faces: Faces,
    light: LightFrom,
) -> Result<f64, Error> {
    check((1..=Partition::MAX_SLICES as u32).contains(&slices), "theory.slices", || {
        format!("must be 1 to {}, is {slices}", Partition::MAX_SLICES)
    })?;
    let sum = |view: View, slice: &dyn Fn(View) -> Result<f64, Error>| {
        (0..slices).try_fold(0.0, |sum, i| Ok(sum + slice(view.slice(i, slices)?)?))
    };
    match (faces, light) {
        (_, LightFrom::Overhead) => sum(view, &|slice| overhead(slice, rule)),
        (Faces::Whole, LightFrom::Behind) => sum(view, &|slice| tilted(slice, rule, 0.0)),
        (Faces::Whole, LightFrom::Angle(theta)) => sum(view, &|slice| tilted(slice, rule, theta)),
        (Faces::SidesAndNear, LightFrom::Behind) => {
            Ok(4.0 * sum(side_from_behind(view), &|slice| overhead(slice, rule))? + 1.0)
        }
        (Faces::Sides, LightFrom::Behind) => Err(Error::invalid(
            "theory.faces",
            "without the near face there is no closed form for light from behind; with it there is",
        )),
        (Faces::Sides | Faces::SidesAndNear, LightFrom::Angle(_)) => Err(Error::invalid(
            "theory.faces",
            "there are closed forms with faces for light overhead and behind only",
        )),
    }
}

/// A side face of V as light from behind sees it: a frustum of φ = 45°, whose depth is the distance from V's axis.
fn side_from_behind(view: View) -> View {
    let tan_phi = view.tan_phi();
    View {
        near: view.near * tan_phi,
        far: view.far * tan_phi,
        half_fov_rad: std::f64::consts::FRAC_PI_4,
    }
}

fn overhead(view: View, rule: Rule) -> Result<f64, Error> {
    if rule == Rule::Log {
        return Ok(view.log_error());
    }
    let tilted = Tilted::new(view, std::f64::consts::FRAC_PI_2)?;
    Ok(Overhead::new(view, tilted.lambda(rule)?)?.storage_factor())
}

fn tilted(view: View, rule: Rule, theta_rad: f64) -> Result<f64, Error> {
    let tilted = Tilted::new(view, theta_rad)?;
    let warped: Warped = tilted.warped(tilted.lambda(rule)?)?;
    let extrema = warped.extrema();
    if rule != Rule::Log {
        return Ok(extrema.storage_factor());
    }
    // Both are proportional to z_w/z, so both are largest at the same place.
    let worst = extrema.q.largest;
    Ok(worst.value * warped.log_error(worst.y, worst.z)? / 4.0)
}
