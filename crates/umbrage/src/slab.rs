//! The slab that receivers lie in.

use crate::focus::Body;
use crate::math::range;
use crate::plan::{ShadowMap, Slab};
use crate::warp::LightSpace;
use glam::{DMat2, DVec2, DVec3, DVec4, Vec4Swizzles};

/// How many texels' widths, laid along the beam, lie between the slab's near side and the receivers: casters before it are taken to lie on it, and a receiver
/// is to tell them from itself.
const MARGIN_TEXELS: f64 = 4.0;

/// The same as a share of the slab.
const MARGIN_SHARE: f64 = 0.1;

/// Thinner ones have too few of a depth buffer's digits.
const LEAST_THICKNESS: f64 = 1.0 / 4096.0;

/// The slab is at most so much thicker than the thinnest one.
const TOLERANCE: f64 = 0.02;

/// Steeper slabs are not looked for.
const STEEPEST: f64 = 4.0;

/// Around corners of what a map serves, (s, t, depth), under parallel light, where planes are planes over (s, t) as well. `texel_depth`: the largest width of a
/// texel there, laid along the beam, in depth.
pub(crate) fn slab(corners: &[DVec3], texel_depth: f64) -> Slab {
    let slope = thinnest(corners);
    let (near, far) = range(corners.iter().map(|p| p.z - slope.dot(p.truncate())));
    let thickness = far - near;
    let margin = (MARGIN_TEXELS * texel_depth).max(MARGIN_SHARE * thickness).max(LEAST_THICKNESS);
    // Behind, nothing but rounding is to be allowed for.
    let whole = margin + thickness + 1e-3 * (margin + thickness);
    let slab = Slab::Leaning { slope, begin: near - margin, thickness: whole };
    let is_sound = slope.is_finite() && near.is_finite() && whole.is_finite();
    if is_sound { slab } else { Slab::default() }
}

/// Under a lamp: distances along its axis, before they are told ([`distances`], [`all_distances`]).
pub(crate) fn along_axis(space: &LightSpace) -> Slab {
    match space.apex {
        None => Slab::default(),
        Some(_) => {
            let axis = space.w.truncate().normalize_or(DVec3::NEG_Z);
            Slab::Distances { axis, near: 0.0, far: 1.0 }
        }
    }
}

/// Around what a map serves under a lamp at `apex`. `texel`: the largest width of a texel there, metres.
pub(crate) fn distances(map: &ShadowMap, apex: DVec3, body: &Body, texel: f64) -> Slab {
    let Slab::Distances { axis, .. } = map.slab else { return map.slab };
    let (near, far) = range(body.vertices().iter().map(|v| axis.dot(*v - apex)));
    let margin = (MARGIN_TEXELS * texel).max(MARGIN_SHARE * (far - near)).max(1e-3 * far);
    // Some way before the lamp itself, and a little behind everything.
    let slab = Slab::Distances { axis, near: (near - margin).max(0.0), far: far + 1e-3 * far };
    let is_sound = near.is_finite() && far > 0.0 && far.is_finite() && margin.is_finite();
    if is_sound { slab } else { all_distances(map, apex) }
}

/// All of the depths of a map under a lamp, as they are on the beam in its middle; a thousand times as far as they begin where they have no end.
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

/// The growth per s and t of the planes between which points (s, t, depth) lie closest together: the ellipsoid method in two dimensions, which converges on
/// any convex function from its subgradients alone.
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
        // By so much the thinnest one may be thinner.
        let gap = gradient.dot(along).max(0.0).sqrt();
        // NaN ends it as well.
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

/// Of the points' depths over a sloping plane the least and the greatest, and where they are.
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

/// The slope of the plane nearest to the points in the mean of squares, and how far from it that of the thinnest slab can be.
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
    // Tilted by so much, a slab is thicker by the points' width in that direction, which is two deviations at least, than twice what it was.
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
            // Halving steps in all directions, down to where nothing gets better.
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
            // Without any points the range is empty.
            let is_thin = points.is_empty() || far - near <= 0.01;
            assert!(slope.is_finite() && is_thin, "{points:?}: {slope}");
        }
    }
}
