//! The region from which casters can cast into a map.

use crate::bounds::{Aabb, Plane};
use crate::focus::Body;
use crate::warp::{LightSpace, Seen};
use glam::{DVec2, DVec3};

/// The largest distance between a plane and the body it bounds, as a share of the body's size.
const TOUCH: f64 = 1e-6;

/// The largest angle, radians, by which rounding turns a plane through a lamp away from a body that
/// it bounds.
const ASKEW: f64 = 1e-6;

/// Appends planes around all that can cast onto `body`, which is the body swept towards the light:
/// those planes of `around` that touch the body and whose inside lies towards the light, and one
/// plane through every edge of the body's outline as the light sees it. `bounds` is the body's
/// bounding box, and `outline` holds the indices of the outline's vertices.
pub(crate) fn caster_planes(
    planes: &mut Vec<Plane>,
    around: impl Iterator<Item = Plane>,
    body: &Body,
    bounds: Aabb,
    space: &LightSpace,
    outline: &[u32],
) {
    let size = body.size();
    // The planes are moved outwards so that rounding never culls a caster.
    let slack = 1e-9 * size;
    let sweeps_inwards = |plane: &Plane| match space.apex {
        None => plane.normal.dot(space.y.truncate()) >= 0.0,
        Some(apex) => plane.distance(apex) >= 0.0,
    };
    let widen = |p: Plane| Plane { offset: p.offset + slack, ..p };
    let touches = |p: &Plane| {
        let is_near = |distance: f64| distance <= TOUCH * size;
        is_near(p.offset + bounds.least_along(p.normal))
            && body.vertices().iter().any(|&v| is_near(p.distance(v)))
    };
    planes.extend(around.filter(sweeps_inwards).filter(touches).map(widen));
    let corner = |i: usize| body.vertices()[outline[i % outline.len()] as usize];
    let mut a = outline.first().map_or(DVec2::ZERO, |_| space.project(corner(0)).0);
    for i in 0..outline.len() {
        let b = space.project(corner(i + 1)).0;
        // The line through a and b in the light plane, as a covector over light space's (x, z, w).
        // It is positive on the left of a → b, which is the inside.
        let line = DVec3::new(a.y - b.y, b.x - a.x, a.x * b.y - b.x * a.y);
        a = b;
        let plane = space.x * line.x + space.z * line.y + space.w * line.z;
        let length = plane.truncate().length();
        if length > 0.0 {
            let plane = plane / length;
            let plane = Plane { normal: plane.truncate(), offset: plane.w };
            // The direction of an edge as short as rounding is arbitrary. No plane is better than a
            // wrong one. Corners near a lamp tell as much about a direction as those far from it.
            let allowed =
                |p: DVec3| space.apex.map_or(slack, |apex| slack.min(ASKEW * p.distance(apex)));
            let is_right = |p: DVec3| plane.distance(p) >= -allowed(p);
            if (0..outline.len()).map(corner).all(is_right) {
                planes.push(widen(plane));
            }
        }
    }
}

/// Number of points above which those inside of an octagon are left out first.
const MANY: usize = 24;

/// Sets `outer` to the indices of the points on the light plane that may lie on the convex hull of
/// all: those that are not inside the octagon of the points farthest in eight directions (Akl and
/// Toussaint 1978).
pub(crate) fn outer_points(outer: &mut Vec<u32>, points: &[Seen]) {
    outer.clear();
    if points.len() <= MANY {
        outer.extend(0..points.len() as u32);
        return;
    }
    // The loops over all eight directions have no branches, so that they become vector code.
    let mut farthest = [f64::NEG_INFINITY; 8];
    let mut corners = [DVec2::ZERO; 8];
    for p in points {
        let DVec2 { x, y: z } = p.xz;
        // Counter-clockwise.
        let along = [x, x + z, z, z - x, -x, -x - z, -z, x - z];
        let is_farther: [bool; 8] = std::array::from_fn(|i| along[i] > farthest[i]);
        if is_farther.iter().fold(false, |any, &is| any | is) {
            for i in (0..8).filter(|&i| is_farther[i]) {
                (farthest[i], corners[i]) = (along[i], p.xz);
            }
        }
    }
    // Each side by its inward normal and the normal's product with a point on the side. A side
    // without length has nothing outside.
    let next = |i: usize| corners[(i + 1) % 8] - corners[i];
    let normals: [DVec2; 8] = std::array::from_fn(|i| next(i).perp());
    let (nx, nz) = (normals.map(|n| n.x), normals.map(|n| n.y));
    let least: [f64; 8] =
        std::array::from_fn(
            |i| {
                if next(i) == DVec2::ZERO { -1.0 } else { normals[i].dot(corners[i]) }
            },
        );
    let is_inside = |p: DVec2| {
        let inside: [bool; 8] = std::array::from_fn(|i| nx[i] * p.x + nz[i] * p.y > least[i]);
        inside.iter().fold(true, |all, &is| all & is)
    };
    outer.extend((0u32..).zip(points).filter(|(_, p)| !is_inside(p.xz)).map(|(i, _)| i));
}

/// Sets the convex hull of points on the light plane, as their indices, counter-clockwise (Andrew's
/// monotone chain).
pub(crate) fn convex_outline(hull: &mut Vec<u32>, points: &[Seen]) {
    let at = |i: u32| points[i as usize].xz;
    outer_points(hull, points);
    let order = |a: DVec2, b: DVec2| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y));
    hull.sort_unstable_by(|&a, &b| order(at(a), at(b)));
    hull.dedup_by(|a, b| at(*a) == at(*b));
    if hull.len() < 3 {
        return;
    }
    // The chain is appended to the sorted points, which are removed afterwards.
    let n = hull.len();
    let mut chain = |indices: &mut dyn Iterator<Item = usize>| {
        let start = hull.len();
        for i in indices {
            let p = at(hull[i]);
            while hull.len() >= start + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]].map(at);
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(hull[i]);
        }
        hull.pop();
    };
    chain(&mut (0..n));
    chain(&mut (0..n).rev());
    hull.drain(..n);
}
