use super::LightSpace;
use crate::camera::Camera;
use glam::{DMat3, DVec3, DVec4, Vec4Swizzles};

/// Perspective shadow maps (Stamminger and Drettakis 2002): the homography of the light plane by
/// which a map sees the world from the light after the viewer's own perspective. Not yet fitted to
/// [0, 1]². `None` where no perspective from the light can see all of `vertices` (local space).
///
/// After the viewer's perspective P the light is the point C = P·light: finite, inverted (C.w < 0) or
/// still at infinity (C.w = 0). A picture taken from C is given by functionals that vanish at C,
/// e·(C.w q.xyz − q.w C.xyz) up to scale, and these pass through all three cases without a seam.
/// They do not vary along a beam, so on the light plane they are a homography.
pub(crate) fn psm(space: &LightSpace, camera: &Camera, vertices: &[DVec3]) -> Option<DMat3> {
    let (n, f) = (camera.near(), camera.far());
    let forward = camera.forward();
    let slope_y = camera.tan_half_fov_y();
    let [width, height] = camera.image().map(f64::from);
    let slope_x = slope_y * width / height;
    // q = (x, y, z, w) with x, y in about ±1, z in 0..1 and w the view depth.
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

    // From the light's image towards each vertex's.
    let direction = |v: DVec3| {
        let q = perspective(v.extend(1.0));
        q.xyz() * c.w - c.xyz() * q.w
    };
    let axis = middle_of_cone(vertices, |v| direction(v).normalize())?;
    // t follows the image's depth, as light space's z follows the view.
    let up = (DVec3::Z - axis * axis.z)
        .try_normalize()
        .filter(|_| axis.cross(DVec3::Z).length() > 1e-9)
        .unwrap_or_else(|| (DVec3::Y - axis * axis.y).normalize());
    let across = up.cross(axis);

    // A functional over the perspective space as a combination of light space's rows.
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
    // Divided by C.w, so that neither vanishes nor changes sides where the light is at infinity. There
    // C lies on the axis, and e·C is 0.
    let sideways = |e: DVec3| {
        let shift = if c.w == 0.0 { 0.0 } else { -e.dot(c.xyz()) / c.w };
        on_light_plane(e.extend(shift))
    };
    let [s, t] = [across, up].map(sideways);
    let w = on_light_plane((axis * c.w).extend(-axis.dot(c.xyz())));
    let rows = DMat3::from_cols(s, t, w);
    let s = if rows.determinant() < 0.0 { -s } else { s };
    Some(DMat3::from_cols(s, t, w).transpose())
}

/// The direction that has all directions well in front of it: along the point nearest to the
/// origin of their convex hull (Gilbert's algorithm). `None` if they do not fit into a half-space.
fn middle_of_cone(vertices: &[DVec3], direction: impl Fn(DVec3) -> DVec3) -> Option<DVec3> {
    let mut x = direction(*vertices.first()?);
    for _ in 0..200 {
        let (support, least) = vertices
            .iter()
            .map(|&v| direction(v))
            .map(|d| (d, d.dot(x)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let gap = x.length_squared() - least;
        if gap <= 1e-12 * x.length_squared() {
            break;
        }
        let step = x - support;
        x -= step * (gap / step.length_squared()).min(1.0);
    }
    let axis = x.try_normalize()?;
    vertices.iter().all(|&v| direction(v).dot(axis) > 1e-6).then_some(axis)
}
