//! Finds the sky among a scene's nodes: a dome or a box around all else.

use crate::types::Scene;
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;
use std::ops::Range;
use umbrage::Aabb;

/// How many times as far as the scene a sky is, at least, in each direction from its middle.
const FAR: f64 = 3.0;
/// The same where lamps shine. What they light up is not sky but a room, unless it is so far away
/// that hardly any of their light arrives there.
const FAR_FROM_LAMPS: f64 = 16.0;
/// A scene counts as at least this high, as a share of its width. The sky above flat ground is as
/// far as the ground is wide.
const LEAST_HEIGHT: f64 = 0.01;
/// Number of directions, from just above the horizon to the zenith, in which a sky must be seen.
const DIRECTIONS: u32 = 128;
/// Sine of the elevation of the lowest of them.
const LOWEST: f64 = 0.1;

/// Finds the node, if any, that surrounds all others as a sky does, and gives its instances and
/// those of the nodes below it that role.
///
/// A sky is closed: seen from the middle of all else, it is there in every direction above the
/// horizon, far away. Nothing stands on it. So a room, whose floor carries what is in it, is none,
/// and neither is vast ground, nor a valley.
pub(crate) fn find(scene: &mut Scene, has_lamps: bool) {
    let families = families(scene);
    let is_part = |&n: &usize| !families[n].is_empty() && families[n].len() < scene.instances.len();
    if !(0..families.len()).any(|n| is_part(&n)) {
        return;
    }
    let boxes = scene.instance_boxes();
    let far = if has_lamps { FAR_FROM_LAMPS } else { FAR };
    // The boxes around all instances before and after each place in the list.
    let before = unions(boxes.iter());
    let after = unions(boxes.iter().rev());
    let whole = before[boxes.len()];
    let is_sky = |&node: &usize| {
        let family = families[node].clone();
        let all = boxes[family.clone()].iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        let rest = before[family.start].union(after[boxes.len() - family.end]);
        let middle = rest.center();
        // The boxes tell of most nodes that they are no sky, before any ray does.
        !rest.is_empty()
            && all.max.y == whole.max.y
            && all.max.cmpgt(middle).all()
            && all.min.x < middle.x
            && all.min.z < middle.z
            && surrounds(scene, family, rest, far)
    };
    // Of nodes that draw the same, the topmost is the sky, whose name says most.
    let sky = (0..families.len()).filter(is_part).find(is_sky);
    scene.sky = sky;
    if let Some(sky) = sky {
        let instances = families[sky].clone();
        scene.roles.change(instances, |role| role.is_sky = true);
    }
}

/// The instances of each node and of those below it. Nodes come in the order of their tree, so they
/// are a range.
fn families(scene: &Scene) -> Vec<Range<usize>> {
    let mut families: Vec<Range<usize>> = scene.nodes.iter().map(|n| n.instances.clone()).collect();
    for (i, node) in scene.nodes.iter().enumerate().rev() {
        if let Some(parent) = node.parent {
            let end = families[i].end;
            families[parent].end = families[parent].end.max(end);
        }
    }
    families
}

/// The boxes around the first 0, 1, 2, … of some boxes.
fn unions<'a>(boxes: impl Iterator<Item = &'a Aabb>) -> Vec<Aabb> {
    let mut all = vec![Aabb::EMPTY];
    for aabb in boxes {
        all.push(all[all.len() - 1].union(*aabb));
    }
    all
}

/// Whether instances surround the box of all else, `rest`, as a sky does: `far` away on all sides
/// above the horizon, and without carrying it.
fn surrounds(scene: &Scene, instances: Range<usize>, rest: Aabb, far: f64) -> bool {
    let size = rest.size();
    let height = size.y.max(LEAST_HEIGHT * size.x.max(size.z));
    let half = size.with_y(height) / 2.0;
    let middle = rest.center();
    let is_far = |k: u32| {
        // Points evenly over the part of the sphere above the lowest elevation (Fibonacci).
        let y = LOWEST + (1.0 - LOWEST) * (f64::from(k) + 0.5) / f64::from(DIRECTIONS);
        let (sin, cos) = (f64::from(k) * 0.618_033_988_749_895 * TAU).sin_cos();
        let direction = DVec3::new(cos * (1.0 - y * y).sqrt(), y, sin * (1.0 - y * y).sqrt());
        let end = (half / direction.abs()).min_element();
        nearest_hit(scene, instances.clone(), middle, direction).is_some_and(|t| t >= far * end)
    };
    let corners = [(0.0, 0.0), (0.9, 0.9), (-0.9, 0.9), (0.9, -0.9), (-0.9, -0.9)];
    let is_carried = || {
        corners.iter().any(|&(x, z)| {
            // From a little above the lowest point, because what carries it may be level with it.
            let from = middle + DVec3::new(x * half.x, -size.y / 2.0 + 0.01 * height, z * half.z);
            nearest_hit(scene, instances.clone(), from, DVec3::NEG_Y)
                .is_some_and(|t| t < 0.05 * height)
        })
    };
    (0..DIRECTIONS).all(is_far) && !is_carried()
}

/// The distance at which a ray from `origin` meets the nearest triangle of some instances, in
/// lengths of `direction`.
fn nearest_hit(
    scene: &Scene,
    instances: Range<usize>,
    origin: DVec3,
    direction: DVec3,
) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for instance in &scene.instances[instances] {
        let mesh_from_world: DAffine3 = instance.world_from_mesh.inverse();
        let origin = mesh_from_world.transform_point3(origin);
        let direction = mesh_from_world.transform_vector3(direction);
        let mesh = &scene.meshes[instance.mesh];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3() - origin);
            // Möller and Trumbore (1997), with a small margin so that no ray slips between
            // neighbours.
            let (ab, ac) = (b - a, c - a);
            let p = direction.cross(ac);
            let determinant = ab.dot(p);
            let u = -a.dot(p) / determinant;
            let q = ab.cross(a);
            let v = direction.dot(q) / determinant;
            let t = ac.dot(q) / determinant;
            let is_hit = u >= -1e-6 && v >= -1e-6 && u + v <= 1.0 + 2e-6 && t > 0.0;
            if is_hit && nearest.is_none_or(|n| t < n) {
                nearest = Some(t);
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::SceneNode;
    use crate::types::{Instance, Mesh};
    use glam::Vec3;

    /// A scene with a node for each of these meshes. Their parents come first.
    fn scene_of(parts: Vec<(&str, Option<usize>, Mesh)>) -> Scene {
        let mut scene = Scene::default();
        for (name, parent, mesh) in parts {
            let begin = scene.instances.len();
            if !mesh.triangles.is_empty() {
                let world_from_mesh = DAffine3::IDENTITY;
                scene.instances.push(Instance { mesh: scene.meshes.len(), world_from_mesh });
            }
            scene.meshes.push(mesh);
            let instances = begin..scene.instances.len();
            scene.nodes.push(SceneNode {
                name: name.into(),
                parent,
                instances,
                ..SceneNode::default()
            });
        }
        scene
    }

    /// Some sides of a box: 0 and 1 are those at −x and +x, 2 and 3 bottom and top, then −z and +z.
    fn sides(min: Vec3, max: Vec3, which: &[usize]) -> Mesh {
        let mut mesh = Mesh::default();
        for &side in which {
            let (axis, is_high) = (side / 2, side % 2 == 1);
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let first = mesh.positions.len() as u32;
            for (i, j) in [(false, false), (true, false), (true, true), (false, true)] {
                let mut corner = min;
                for (axis, is_high) in [(axis, is_high), (u, i), (v, j)] {
                    corner[axis] = if is_high { max[axis] } else { min[axis] };
                }
                mesh.positions.push(corner);
            }
            mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
        }
        mesh
    }

    const ALL: [usize; 6] = [0, 1, 2, 3, 4, 5];

    fn block(center: Vec3, half: Vec3) -> Mesh {
        sides(center - half, center + half, &ALL)
    }

    fn ground(half: f32) -> Mesh {
        sides(Vec3::new(-half, 0.0, -half), Vec3::new(half, 0.0, half), &[2])
    }

    /// A sphere's part above a height, in units of its radius.
    fn dome(radius: f32, lowest: f32) -> Mesh {
        const AROUND: u32 = 24;
        const UP: u32 = 12;
        let mut mesh = Mesh::default();
        for i in 0..=UP {
            let low = lowest.asin();
            let up = low + (std::f32::consts::FRAC_PI_2 - low) * i as f32 / UP as f32;
            for k in 0..AROUND {
                let (sin, cos) = (k as f32 / AROUND as f32 * std::f32::consts::TAU).sin_cos();
                mesh.positions.push(Vec3::new(cos * up.cos(), up.sin(), sin * up.cos()) * radius);
                if i < UP {
                    let [a, b] = [k, (k + 1) % AROUND].map(|k| i * AROUND + k);
                    mesh.triangles.extend([[a, b, b + AROUND], [a, b + AROUND, a + AROUND]]);
                }
            }
        }
        mesh
    }

    fn statues() -> Mesh {
        block(Vec3::new(3.0, 1.0, -2.0), Vec3::new(0.5, 1.0, 0.5))
    }

    /// The name of the node that is taken for the sky.
    fn sky_of(mut scene: Scene, has_lamps: bool, scale: f64) -> Option<String> {
        for instance in &mut scene.instances {
            instance.world_from_mesh = DAffine3::from_scale(DVec3::splat(scale));
        }
        let all = scene.bounds();
        find(&mut scene, has_lamps);
        let sky = scene.sky?;
        // What is taken for sky no longer decides the size, and nothing else is.
        let rest = scene.bounds();
        assert!(rest.size().y < 0.5 * all.size().y, "{rest:?} {all:?}");
        Some(scene.nodes[sky].name.clone())
    }

    #[test]
    fn domes_and_boxes_around_all_else_are_skies() {
        for scale in [1e-6, 1.0, 1e5] {
            for sky in [
                vec![("sky", None, dome(300.0, -1.0))],
                vec![("sky", None, dome(300.0, 0.0))],
                vec![("sky", None, block(Vec3::ZERO, Vec3::splat(300.0)))],
                std::iter::once(("sky", None, Mesh::default()))
                    .chain(ALL.map(|side| {
                        let half = Vec3::splat(300.0);
                        ("side", Some(2), sides(-half, half, &[side]))
                    }))
                    .collect(),
            ] {
                let content = vec![("ground", None, ground(20.0)), ("statues", None, statues())];
                let scene = scene_of([content, sky].concat());
                assert_eq!(sky_of(scene, false, scale).as_deref(), Some("sky"), "{scale}");
            }
        }
    }

    #[test]
    fn ground_may_reach_to_the_foot_of_the_sky() {
        for half in [50.0, 290.0, 1000.0] {
            let parts = vec![
                ("sky", None, dome(300.0, -0.1)),
                ("ground", None, ground(half)),
                ("statues", None, statues()),
            ];
            assert_eq!(sky_of(scene_of(parts), false, 1.0).as_deref(), Some("sky"), "{half}");
        }
    }

    #[test]
    fn rooms_valleys_and_covers_are_no_skies() {
        let table = || block(Vec3::new(0.5, 0.4, 0.0), Vec3::new(0.6, 0.4, 0.4));
        let (low, high) = (Vec3::new(-4.0, 0.0, -4.0), Vec3::new(4.0, 3.0, 4.0));
        let hanging = || block(Vec3::new(0.0, 1.5, 0.0), Vec3::splat(0.2));
        let floor = || sides(low, high, &[2]);
        for (what, parts) in [
            ("a room", vec![("room", None, sides(low, high, &ALL)), ("table", None, table())]),
            (
                "a lamp in it",
                vec![("room", None, sides(low, high, &ALL)), ("lamp", None, hanging())],
            ),
            (
                "walls and ceiling",
                vec![("walls", None, sides(low, high, &[0, 1, 3, 4, 5])), ("floor", None, floor())],
            ),
            (
                "a court",
                vec![
                    ("walls", None, sides(low * 30.0, high * 30.0, &[0, 1, 4, 5])),
                    ("t", None, table()),
                ],
            ),
            ("a bell jar", vec![("jar", None, dome(1.6, 0.0)), ("table", None, table())]),
            (
                "a ceiling",
                vec![("ceiling", None, sides(low * 9.0, high * 9.0, &[3])), ("t", None, table())],
            ),
            ("one thing", vec![("table", None, table())]),
            ("ground", vec![("ground", None, ground(5000.0)), ("table", None, table())]),
        ] {
            assert_eq!(sky_of(scene_of(parts), true, 1.0), None, "{what}");
        }
        // Without lamps a room carries what stands in it all the same.
        let room = vec![("room", None, sides(low, high, &ALL)), ("table", None, table())];
        assert_eq!(sky_of(scene_of(room), false, 1.0), None);
    }
}
