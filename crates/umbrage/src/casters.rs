//! What can cast into a map.

use crate::bounds::Plane;
use crate::focus::Body;
use crate::warp::LightSpace;
use glam::{DVec2, DVec3};

/// How near a plane must come to a body to bound it, as a share of the body's size.
const TOUCH: f64 = 1e-6;

/// Planes around all that can cast onto `body`: the body swept towards the light. Those of the planes
/// `around` it that look away from the light and touch it, and one through every edge of its outline seen
/// from the light.
pub(crate) fn caster_planes(
    planes: &mut Vec<Plane>,
    around: impl Iterator<Item = Plane>,
    body: &Body,
    space: &LightSpace,
    outline: &mut Vec<DVec2>,
) {
    let size = body.size();
    // Rounding must never lose a caster.
    let slack = 1e-9 * size;
    let sweeps_inwards = |plane: &Plane| match space.apex {
        None => plane.normal.dot(space.y.truncate()) >= 0.0,
        Some(apex) => plane.distance(apex) >= 0.0,
    };
    let widen = |p: Plane| Plane { offset: p.offset + slack, ..p };
    let touches = |p: &Plane| body.vertices().iter().any(|&v| p.distance(v) <= TOUCH * size);
    planes.extend(around.filter(sweeps_inwards).filter(touches).map(widen));
    convex_outline(outline, body.vertices().iter().map(|&v| space.project(v).0));
    for (i, &a) in outline.iter().enumerate() {
        let b = outline[(i + 1) % outline.len()];
        // The line through a and b in the light plane, as a covector over (x, z, w) of light space,
        // positive to the left of a → b: inside.
        let line = DVec3::new(a.y - b.y, b.x - a.x, a.x * b.y - b.x * a.y);
        let plane = space.x * line.x + space.z * line.y + space.w * line.z;
        let length = plane.truncate().length();
        if length > 0.0 {
            let plane = plane / length;
            let plane = widen(Plane { normal: plane.truncate(), offset: plane.w });
            // An edge as short as rounding may point anywhere: better no plane than a wrong one.
            if body.vertices().iter().all(|&v| plane.distance(v) >= 0.0) {
                planes.push(plane);
            }
        }
    }
}

/// The convex hull of points in the plane, counter-clockwise (Andrew's monotone chain).
fn convex_outline(hull: &mut Vec<DVec2>, points: impl Iterator<Item = DVec2>) {
    hull.clear();
    hull.extend(points);
    hull.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    hull.dedup();
    if hull.len() < 3 {
        return;
    }
    // The chain is built behind the sorted points, which then go.
    let n = hull.len();
    let mut chain = |indices: &mut dyn Iterator<Item = usize>| {
        let start = hull.len();
        for i in indices {
            let p = hull[i];
            while hull.len() >= start + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    chain(&mut (0..n));
    chain(&mut (0..n).rev());
    hull.drain(..n);
}
