//! The region from which casters can cast into a map.

use crate::bounds::Plane;
use crate::focus::Body;
use crate::warp::LightSpace;
use glam::{DVec2, DVec3};

/// The largest distance between a plane and the body it bounds, as a share of the body's size.
const TOUCH: f64 = 1e-6;

/// Appends planes around all that can cast onto `body`, which is the body swept towards the light:
/// those planes of `around` that touch the body and whose inside lies towards the light, and one
/// plane through every edge of the body's outline as the light sees it.
pub(crate) fn caster_planes(
    planes: &mut Vec<Plane>,
    around: impl Iterator<Item = Plane>,
    body: &Body,
    space: &LightSpace,
    outline: &mut Vec<DVec2>,
) {
    let size = body.size();
    // The planes are moved outwards so that rounding never culls a caster.
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
        // The line through a and b in the light plane, as a covector over light space's (x, z, w).
        // It is positive on the left of a → b, which is the inside.
        let line = DVec3::new(a.y - b.y, b.x - a.x, a.x * b.y - b.x * a.y);
        let plane = space.x * line.x + space.z * line.y + space.w * line.z;
        let length = plane.truncate().length();
        if length > 0.0 {
            let plane = plane / length;
            let plane = widen(Plane { normal: plane.truncate(), offset: plane.w });
            // The direction of an edge as short as rounding is arbitrary. No plane is better than a
            // wrong one.
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
    // The chain is appended to the sorted points, which are removed afterwards.
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
