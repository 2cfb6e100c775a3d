use crate::types::{Instance, Mesh, Scene};
use glam::DVec3;
use umbrage::{Aabb, Camera, Plane};

/// A surface counts as seen edge-on if the eye is nearer to its plane than this share of the
/// distance to its farthest corner, or under parallel rays if this is the sine of their angle to
/// the plane. It hides nothing then.
const EDGE_ON: f64 = 1e-9;

impl Scene {
    /// The least depth of any surface before a camera, inside the sides of its picture, metres.
    /// `None` if there is none. The camera's own depth range does not matter.
    ///
    /// Nothing hides the nearest surface, so this is where what the camera sees begins. Parts of
    /// surfaces that an alpha mask removes count as if they were there. Surfaces that the camera
    /// sees exactly edge-on do not count.
    pub fn nearest_depth(&self, camera: &Camera) -> Option<f64> {
        let sides = side_planes(camera);
        let in_view = |aabb: Aabb| !aabb.is_empty() && sides.iter().all(|p| p.may_touch(aabb));
        let least_depth = |aabb: Aabb| {
            let depths = aabb.corners().map(|corner| camera.depth(corner));
            depths.into_iter().fold(f64::INFINITY, f64::min)
        };
        let boxes = self.instance_boxes();
        let seen =
            boxes.iter().enumerate().filter(|&(i, &b)| self.roles.of(i).is_seen && in_view(b));
        let mut candidates: Vec<(f64, usize)> = seen.map(|(i, &b)| (least_depth(b), i)).collect();
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut nearest = f64::INFINITY;
        for (depth, i) in candidates {
            if depth >= nearest {
                break;
            }
            let instance = &self.instances[i];
            nearest =
                nearest.min(nearest_of(instance, &self.meshes[instance.mesh], camera, &sides));
        }
        nearest.is_finite().then_some(nearest)
    }
}

/// The planes of the four sides of a camera's picture, which point inwards.
pub fn side_planes(camera: &Camera) -> [Plane; 4] {
    let [width, height] = camera.image().map(f64::from);
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
    let ray = |x: f64, y: f64| camera.ray(glam::DVec2::new(x, y));
    let rays = corners.map(|(x, y)| ray(x, y));
    let middle = ray(width / 2.0, height / 2.0).at(1.0);
    std::array::from_fn(|i| {
        let corner = rays[i].at(1.0);
        let along = corner - rays[i].at(0.0);
        let normal = along.cross(rays[(i + 1) % 4].at(1.0) - corner).normalize_or_zero();
        let inward = if normal.dot(middle - corner) < 0.0 { -normal } else { normal };
        Plane::through(camera.eye() + rays[i].at(0.0), inward)
    })
}

/// The least depth of an instance between the sides of the picture; infinite if none of it is
/// there.
fn nearest_of(instance: &Instance, mesh: &Mesh, camera: &Camera, sides: &[Plane; 4]) -> f64 {
    let mut nearest = f64::INFINITY;
    let mut polygon: Vec<DVec3> = Vec::with_capacity(7);
    let mut clipped: Vec<DVec3> = Vec::with_capacity(7);
    for triangle in &mesh.triangles {
        let corners = triangle.map(|i| {
            instance.world_from_mesh.transform_point3(mesh.positions[i as usize].as_dvec3())
        });
        let depths = corners.map(|p| camera.depth(p));
        if depths.iter().all(|&d| d >= nearest) || depths.iter().all(|&d| d < 0.0) {
            continue;
        }
        if sides.iter().any(|side| corners.iter().all(|&p| side.distance(p) < 0.0)) {
            continue;
        }
        let [a, b, c] = corners.map(|p| p - camera.eye());
        let normal = (b - a).cross(c - a);
        let farthest = a.length_squared().max(b.length_squared()).max(c.length_squared()).sqrt();
        let (ray, length) = match camera.is_orthographic() {
            true => (camera.forward(), 1.0),
            false => (a, farthest),
        };
        if normal.dot(ray).abs() <= EDGE_ON * length * normal.length() {
            continue;
        }
        polygon.clear();
        polygon.extend(corners);
        for side in sides {
            clip(&polygon, *side, &mut clipped);
            std::mem::swap(&mut polygon, &mut clipped);
        }
        let least = polygon.iter().map(|&p| camera.depth(p)).fold(f64::INFINITY, f64::min);
        nearest = nearest.min(least.max(0.0));
    }
    nearest
}

/// The part of a polygon inside a plane (Sutherland and Hodgman 1974).
fn clip(polygon: &[DVec3], plane: Plane, inside: &mut Vec<DVec3>) {
    inside.clear();
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (dp, dq) = (plane.distance(p), plane.distance(q));
        if dp >= 0.0 {
            inside.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            inside.push(p.lerp(q, dp / (dp - dq)));
        }
    }
}
