//! The slab of depths that holds a map's receivers.

use crate::focus::Body;
use crate::math::range;
use crate::plan::{ShadowMap, Slab};
use crate::warp::LightSpace;
use glam::{DMat2, DVec2, DVec3, DVec4, Vec4Swizzles};

/// Distance between the slab's near side and the receivers, in texel widths measured as depth along
/// the beam. Casters in front of the slab are clamped to its near side, and a receiver must still
/// be distinguished from them.
const MARGIN_TEXELS: f64 = 4.0;

/// The least distance between the slab's near side and the receivers, as a share of the receivers'
/// thickness.
const MARGIN_SHARE: f64 = 0.1;

/// The least thickness of a slab. Within a thinner one a depth buffer would resolve too few depths.
const LEAST_THICKNESS: f64 = 1.0 / 4096.0;

/// The share by which the slab found may be thicker than the thinnest one.
const TOLERANCE: f64 = 0.02;

/// The largest distance of slopes from that of the least-squares plane that are searched.
const STEEPEST: f64 = 4.0;

/// The slab under parallel light around the corners (s, t, depth) of the receivers that a map
/// serves. Under parallel light planes are planes over (s, t), too. `texel_depth` is the largest
/// width of a texel there, measured as depth along the beam.
pub(crate) fn slab(corners: &[DVec3], texel_depth: f64) -> Slab {
    let slope = thinnest(corners);
    let (near, far) = range(corners.iter().map(|p| p.z - slope.dot(p.truncate())));
    let thickness = far - near;
    let margin = (MARGIN_TEXELS * texel_depth).max(MARGIN_SHARE * thickness).max(LEAST_THICKNESS);
    // On its far side the slab need only allow for rounding.
    let whole = margin + thickness + 1e-3 * (margin + thickness);
    let slab = Slab::Leaning { slope, begin: near - margin, thickness: whole };
    let is_sound = slope.is_finite() && near.is_finite() && whole.is_finite();
    if is_sound { slab } else { Slab::default() }
}

/// The slab of a map under a lamp before its distances are known; they are set by [`distances`] or
/// [`all_distances`].
pub(crate) fn along_axis(space: &LightSpace) -> Slab {
    match space.apex {
        None => Slab::default(),
        Some(_) => {
            let axis = space.w.truncate().normalize_or(DVec3::NEG_Z);
            Slab::Distances { axis, near: 0.0, far: 1.0 }
        }
    }
}

/// The slab around the receivers that a map serves under a lamp at `apex`. `texel` is the largest
/// width of a texel there, metres.
pub(crate) fn distances(map: &ShadowMap, apex: DVec3, body: &Body, texel: f64) -> Slab {
    let Slab::Distances { axis, .. } = map.slab else { return map.slab };
    let (near, far) = range(body.vertices().iter().map(|v| axis.dot(*v - apex)));
    let margin = (MARGIN_TEXELS * texel).max(MARGIN_SHARE * (far - near)).max(1e-3 * far);
    // The slab keeps in front of the lamp, and ends a little behind all receivers.
    let slab = Slab::Distances { axis, near: (near - margin).max(0.0), far: far + 1e-3 * far };
    let is_sound = near.is_finite() && far > 0.0 && far.is_finite() && margin.is_finite();
    if is_sound { slab } else { all_distances(map, apex) }
}

/// The slab of all depths of a map under a lamp, taken from the beam through the map's middle.
/// Where depths reach infinity, the slab ends at a thousand times the distance of its near side.
pub(crate) fn all_distances(map: &ShadowMap, apex: DVec3) -> Slab {
    let Slab::Distances { axis, .. } = map.slab else { return map.slab };
    let at = |depth: f64| {
        let h = map.local_from_shadow * DVec4::new(0.5, 0.5, depth, 1.0);
        if h.w > 0.0 { axis.dot(h.xyz() / h.w - apex) } else { f64::INFINITY }
    };
    let near = at(0.0);
    let near = if near > 0.0 && near.is_finite() { near } else { 1e-3 };
    let far = at(1.0);
    let far = if far > near && far.is_finite() { far } else { 1000.0 * near };
    Slab::Distances { axis, near, far }
}

/// The slope, depth per s and t, of the thinnest slab around points (s, t, depth). It is found by
/// the ellipsoid method in two dimensions, which converges for any convex function from its
/// subgradients alone.
fn thinnest(points: &[DVec3]) -> DVec2 {
    let (mut slope, reach) = least_squares(points);
    let mut ellipse = DMat2::from_diagonal(DVec2::splat(reach * reach));
    let mut best = (f64::INFINITY, slope);
    for _ in 0..64 {
        let [near, far] = extremes(points, slope);
        let thickness = far.0 - near.0;
        if thickness < best.0 {
            best = (thickness, slope);
        }
        let gradient = near.1 - far.1;
        let along = ellipse * gradient;
        // The thinnest slab is thinner than the current one by at most this.
        let gap = gradient.dot(along).max(0.0).sqrt();
        // The search also ends if the gap is NaN.
        let goes_on = gap > TOLERANCE * best.0 && gap > 0.1 * LEAST_THICKNESS;
        if !goes_on {
            break;
        }
        let along = along / gap;
        slope -= along / 3.0;
        let outer = DMat2::from_cols(along * along.x, along * along.y);
        ellipse = (ellipse - outer * (2.0 / 3.0)) * (4.0 / 3.0);
    }
    best.1
}

/// The least and the greatest depth of the points relative to a sloping plane, each with the (s, t)
/// of its point.
fn extremes(points: &[DVec3], slope: DVec2) -> [(f64, DVec2); 2] {
    let mut near = (f64::INFINITY, DVec2::ZERO);
    let mut far = (f64::NEG_INFINITY, DVec2::ZERO);
    for p in points {
        let st = p.truncate();
        let depth = p.z - slope.dot(st);
        if depth < near.0 {
            near = (depth, st);
        }
        if depth > far.0 {
            far = (depth, st);
        }
    }
    [near, far]
}

/// The slope of the least-squares plane through the points, and a bound on its distance from the
/// slope of the thinnest slab.
fn least_squares(points: &[DVec3]) -> (DVec2, f64) {
    let n = points.len().max(1) as f64;
    let mean = points.iter().sum::<DVec3>() / n;
    let mut covariance = DMat2::ZERO;
    let mut with_depth = DVec2::ZERO;
    for p in points {
        let d = *p - mean;
        let st = d.truncate();
        covariance += DMat2::from_cols(st * st.x, st * st.y);
        with_depth += st * d.z;
    }
    let (covariance, with_depth) = (covariance * n.recip(), with_depth / n);
    let half_difference = 0.5 * (covariance.x_axis.x - covariance.y_axis.y);
    let least = 0.5 * (covariance.x_axis.x + covariance.y_axis.y)
        - half_difference.hypot(covariance.x_axis.y);
    if least.is_nan() || least < 1e-6 {
        return (DVec2::ZERO, STEEPEST);
    }
    let slope = covariance.inverse() * with_depth;
    let [near, far] = extremes(points, slope);
    // Let T be the thickness of the slab around this plane and σ the least standard deviation of
    // the points' (s, t). Along any direction the points extend over 2σ at least. So a slab whose
    // slope differs by more than T/σ is thicker than 2T − T = T, and not the thinnest.
    (slope, ((far.0 - near.0) / least.sqrt()).min(STEEPEST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thinnest_slab_is_found() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24)
        };
        for _ in 0..200 {
            let lean = DVec2::new(random() - 0.5, random() - 0.5) * 2.0;
            let thick = random().powi(3);
            let points: Vec<DVec3> = (0..40)
                .map(|_| {
                    let st = DVec2::new(random(), random());
                    st.extend(lean.dot(st) + thick * random())
                })
                .collect();
            let thickness = |slope: DVec2| {
                let (near, far) = range(points.iter().map(|p| p.z - slope.dot(p.truncate())));
                far - near
            };
            let found = thickness(thinnest(&points));
            // An independent search by steps in all directions, which are halved until nothing
            // improves.
            let (mut slope, mut step) = (lean, 0.5);
            while step > 1e-5 {
                let around =
                    (0..16).map(|i| DVec2::from_angle(f64::from(i) * 0.393) * step + slope);
                match around.min_by(|&a, &b| thickness(a).total_cmp(&thickness(b))) {
                    Some(better) if thickness(better) < thickness(slope) => slope = better,
                    _ => step *= 0.5,
                }
            }
            let best = thickness(slope);
            assert!(found <= best * (1.0 + TOLERANCE) + LEAST_THICKNESS, "{found} {best}");
        }
    }

    #[test]
    fn points_that_are_none_or_one_or_a_line_are_no_trouble() {
        for points in [vec![], vec![DVec3::ONE], vec![DVec3::ZERO, DVec3::ONE, DVec3::splat(0.5)]] {
            let slope = thinnest(&points);
            let (near, far) = range(points.iter().map(|p| p.z - slope.dot(p.truncate())));
            // Without points the range is empty.
            let is_thin = points.is_empty() || far - near <= 0.01;
            assert!(slope.is_finite() && is_thin, "{points:?}: {slope}");
        }
    }
}
