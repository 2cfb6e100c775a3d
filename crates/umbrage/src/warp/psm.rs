use super::LightSpace;
use crate::camera::Camera;
use glam::{DMat3, DVec3, DVec4, Vec4Swizzles};

/// The largest |C.w|/|C| with which the light's image C counts as lying at infinity.
const AT_INFINITY: f64 = 1e-8;

/// Perspective shadow maps (Stamminger and Drettakis 2002): the homography of the light plane that
/// shows the world from the light after the viewer's perspective, before it is scaled to [0, 1]².
/// `None` if no perspective from the light shows all of `vertices` (local space).
///
/// After the viewer's perspective P the light is the point C = P·light. It is finite, inverted
/// (C.w < 0) or still at infinity (C.w = 0). The coordinates of a perspective image taken from C
/// are functionals that vanish at C, e·(C.w q.xyz − q.w C.xyz) up to scale, which are continuous
/// through all three cases. They do not vary along a beam, so they are a homography of the light
/// plane.
pub(crate) fn psm(space: &LightSpace, camera: &Camera, vertices: &[DVec3]) -> Option<DMat3> {
    let (n, f) = (camera.near(), camera.far());
    let forward = camera.forward();
    let slope_y = camera.half_height();
    let [width, height] = camera.image().map(f64::from);
    let slope_x = slope_y * width / height;
    // q = (x, y, z, w), where x and y range over about ±1, z over 0 to 1, and w is the view depth.
    let rows = [
        (camera.right() / slope_x).extend(0.0),
        (camera.up() / slope_y).extend(0.0),
        (forward * (f / (f - n))).extend(-n * f / (f - n)),
        forward.extend(0.0),
    ];
    let perspective = |p: DVec4| DVec4::from(rows.map(|r| r.dot(p)));
    let to_light = match space.apex {
        None => space.y.truncate().extend(0.0),
        Some(apex) => apex.extend(1.0),
    };
    let c = perspective(to_light);
    let c = c / c.length();

    // Vector from the light's image to the image of a vertex.
    let direction = |v: DVec3| {
        let q = perspective(v.extend(1.0));
        q.xyz() * c.w - c.xyz() * q.w
    };
    let axis = middle_of_cone(vertices, |v| direction(v).normalize())?;
    // t follows depth after the perspective, as light space's z follows the view.
    let up = (DVec3::Z - axis * axis.z)
        .try_normalize()
        .filter(|_| axis.cross(DVec3::Z).length() > 1e-9)
        .unwrap_or_else(|| (DVec3::Y - axis * axis.y).normalize());
    let across = up.cross(axis);

    // A functional on the space after the perspective, as a combination of light space's rows.
    let on_light_plane = |covector: DVec4| {
        let local = rows[0] * covector.x
            + rows[1] * covector.y
            + rows[2] * covector.z
            + rows[3] * covector.w;
        let [x, z] = [space.x, space.z].map(|r| local.truncate().dot(r.truncate()));
        let w = match space.apex {
            None => local.w,
            Some(_) => local.truncate().dot(space.w.truncate()),
        };
        DVec3::new(x, z, w)
    };
    // The functionals of s and t are divided by C.w, so that they neither vanish nor change sign as
    // the light passes through infinity. At infinity C lies on the axis, and e·C is 0. Nearer to
    // infinity than this e·C is of the size of C.w too, and of its digits rounding leaves few. A
    // shift of s or t by a multiple of w, which is all that is missing then, makes no difference.
    let is_at_infinity = c.w.abs() <= AT_INFINITY;
    let sideways = |e: DVec3| {
        let shift = if is_at_infinity { 0.0 } else { -e.dot(c.xyz()) / c.w };
        on_light_plane(e.extend(shift))
    };
    let [s, t] = [across, up].map(sideways);
    let w = on_light_plane((axis * c.w).extend(-axis.dot(c.xyz())));
    let rows = DMat3::from_cols(s, t, w);
    let s = if rows.determinant() < 0.0 { -s } else { s };
    Some(DMat3::from_cols(s, t, w).transpose())
}

/// Axis of the narrowest cone around all directions, which are unit vectors. `None` if the cone is
/// not narrower than a half-space.
///
/// The cone is built one direction at a time, as Welzl (1991) builds smallest circles: a direction
/// outside the current cone lies on the border of the cone around it and all directions before it,
/// which is determined by it and one or two of these.
fn middle_of_cone(vertices: &[DVec3], direction: impl Fn(DVec3) -> DVec3) -> Option<DVec3> {
    let sticks_out =
        |d: DVec3, axis: DVec3, on_border: DVec3| d.dot(axis) < on_border.dot(axis) - 1e-14;
    let at = |i: usize| direction(vertices[i]);
    let (mut axis, mut border) = (direction(*vertices.first()?), direction(*vertices.first()?));
    for i in 1..vertices.len() {
        let a = at(i);
        if !sticks_out(a, axis, border) {
            continue;
        }
        (axis, border) = (a, a);
        for j in 0..i {
            let b = at(j);
            if !sticks_out(b, axis, border) {
                continue;
            }
            axis = (a + b).try_normalize()?;
            for k in 0..j {
                let c = at(k);
                if sticks_out(c, axis, border) {
                    let normal = (b - a).cross(c - a).try_normalize()?;
                    axis = if normal.dot(a) < 0.0 { -normal } else { normal };
                }
            }
        }
    }
    vertices.iter().all(|&v| direction(v).dot(axis) > 1e-9).then_some(axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// No axis of a fine grid gives a narrower cone.
        #[test]
        fn cones_are_narrowest(
            points in proptest::collection::vec([-1.0..1.0f64, -1.0..1.0, 0.001..1.0], 1..20),
        ) {
            let directions: Vec<DVec3> = points.into_iter().map(|p| DVec3::from(p).normalize()).collect();
            let narrowness = |axis: DVec3| {
                directions.iter().map(|d| d.dot(axis)).fold(f64::INFINITY, f64::min)
            };
            let axis = middle_of_cone(&directions, |d| d).unwrap();
            let found = narrowness(axis);
            for i in 0..4000 {
                // The axes tried lie on a spiral over the sphere.
                let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 4000.0;
                let (sin, cos) = (f64::from(i) * 2.399_963).sin_cos();
                let r = (1.0 - y * y).sqrt();
                prop_assert!(narrowness(DVec3::new(r * cos, y, r * sin)) <= found + 1e-9);
            }
        }
    }

    #[test]
    fn what_fills_a_half_space_has_no_cone() {
        let around = [DVec3::X, DVec3::NEG_X, DVec3::Y];
        assert_eq!(middle_of_cone(&around, |d| d), None);
    }
}
