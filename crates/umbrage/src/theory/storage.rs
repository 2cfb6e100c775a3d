use super::{Overhead, Rule, Tilted, View, Warped};
use crate::error::{Error, check};
use crate::technique::{Faces, Partition};

/// Direction of parallel light, as in W&P §5.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightFrom {
    /// Light at right angles to the view, θ = 90°.
    Overhead,
    /// Light from behind the viewer along the view direction, θ = 0.
    Behind,
    /// Light at this angle θ to the view, radians, 0 ..= π, in the plane of the view's y axis and
    /// direction.
    Angle(f64),
}

/// The storage factor S̄ of a view cut into self-similar slices and faces: the number of texels
/// that all maps together need for an error of at most one pixel per texel, per pixel of the image.
///
/// - With light overhead S̄ is the sum of W&P's Eq. 12 over the slices, which gives Eqs. 17 and
///   18. Faces change nothing, because the light sees only one of them (Eq. 19).
/// - With light from behind and no faces S̄ is Eq. 20. With faces, each of the four side faces is
///   a view of φ = 45° under light overhead, and the near face needs one texel per pixel (Eq.
///   21).
/// - With light at other angles each slice needs M_q·M_p/4 with its own λ, from the
///   [extrema](Warped::extrema) of Theory's errors.
///
/// [`Rule::Log`] reaches the optimum ln(f/n)/(2 tan φ) with light overhead (W&P Appendix C) for
/// any number of slices. The focus of a [`Rule::Tsm`] applies to each slice; for faces with light
/// from behind it is a distance along the face. The λ of a [`Rule::Lambda`] is the same for all
/// maps.
///
/// # Errors
///
/// [`Error::Invalid`] with the field
///
/// - `theory.slices` unless 1 ≤ `slices` ≤ [`Partition::MAX_SLICES`], or if V is too short for
///   them;
/// - `theory.faces` where there is no closed form: for faces with light neither overhead nor from
///   behind, and for faces without the near face with light from behind;
/// - `theory.theta_rad`, `theory.lambda` or `theory.focus` for invalid numbers of the light or the
///   rule.
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

/// A side face of V as seen by light from behind: a frustum of φ = 45°, whose view depth is the
/// distance from V's axis.
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
    // E_q and the logarithmic error are both proportional to z_w/z, so both are largest at the same
    // point.
    let worst = extrema.q.largest;
    Ok(worst.value * warped.log_error(worst.y, worst.z)? / 4.0)
}
