use crate::Ray;
use glam::{DVec3, Vec3A};
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ray::RayHit;
use obvhs::{BvhBuildParams, fast_stack};
use std::time::Duration;
use umbrage::Aabb;

/// A bounding volume hierarchy that finds every primitive that a ray may meet.
///
/// The hierarchy stores its boxes in single precision, relative to a centre in double precision,
/// and each ray's origin is first moved to where the ray enters the outermost box. With D the
/// diagonal of that box, all coordinates are then below D/2 and all distances below D. The errors
/// of the box test are then at most ½·2⁻²⁴ D for the ray's origin, 2⁻²³ D for directions near an
/// axis (obvhs bounds 1/d by 2²³), and 4·2⁻²⁴ D for the roundings of 1/d, d, difference and
/// product. Every box is padded by 2⁻²¹ D, which is more than the sum of these errors, so no box
/// that the ray meets is missed.
pub(crate) struct Boxes {
    center: DVec3,
    outermost: Aabb,
    tree: Bvh2,
}

/// Index of a node of the hierarchy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node(usize);

impl Boxes {
    /// Builds the hierarchy for primitives, given by their indices and their boxes, none of which
    /// is empty. `slack` widens all boxes further, by the error of the caller's own computations.
    pub(crate) fn build(primitives: &[(u32, Aabb)], slack: f64) -> Self {
        let all = primitives.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(*b));
        if all.is_empty() {
            return Self { center: DVec3::ZERO, outermost: all, tree: Bvh2::default() };
        }
        let center = all.center();
        let pad = all.size().length() * 2f64.powi(-21) + slack;
        let padded: Vec<_> = primitives
            .iter()
            .map(|(_, b)| {
                let min = (b.min - center - pad).as_vec3();
                let max = (b.max - center + pad).as_vec3();
                let down = min.to_array().map(f32::next_down);
                let up = max.to_array().map(f32::next_up);
                obvhs::aabb::Aabb { min: Vec3A::from(down), max: Vec3A::from(up) }
            })
            .collect();
        // Leaves are small because a triangle test in double precision costs more than a box test.
        let parameters = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        let mut tree = build_bvh2(&padded, parameters, &mut Duration::default());
        tree.max_depth = depth(&tree);
        for slot in &mut tree.primitive_indices {
            *slot = primitives[*slot as usize].0;
        }
        let outermost = Aabb { min: all.min - 2.0 * pad, max: all.max + 2.0 * pad };
        Self { center, outermost, tree }
    }

    /// The root, whose box holds all primitives; `None` if there are no primitives.
    pub(crate) fn root(&self) -> Option<Node> {
        (!self.tree.nodes.is_empty()).then_some(Node(0))
    }

    /// The box of a node, padding included.
    pub(crate) fn aabb(&self, node: Node) -> Aabb {
        let aabb = self.tree.nodes[node.0].aabb();
        let corner = |p: Vec3A| p.as_dvec3() + self.center;
        Aabb { min: corner(aabb.min), max: corner(aabb.max) }
    }

    /// The contents of a node: `Ok` with its two children, or `Err` with the primitives of a leaf.
    pub(crate) fn open(&self, node: Node) -> Result<[Node; 2], &[u32]> {
        let node = &self.tree.nodes[node.0];
        let first = node.first_index as usize;
        if node.is_leaf() {
            Err(&self.tree.primitive_indices[first..first + node.prim_count as usize])
        } else {
            Ok([Node(first), Node(first + 1)])
        }
    }

    /// The primitives whose boxes are within `reach` of a point along every axis, and some more.
    pub(crate) fn around(&self, point: DVec3, reach: f64) -> Vec<u32> {
        let mut open: Vec<Node> = self.root().into_iter().collect();
        let mut found = Vec::new();
        while let Some(node) = open.pop() {
            let Aabb { min, max } = self.aabb(node);
            if point.clamp(min, max).abs_diff_eq(point, reach) {
                match self.open(node) {
                    Ok(nodes) => open.extend(nodes),
                    Err(leaf) => found.extend(leaf),
                }
            }
        }
        found
    }

    /// Calls `visit` with the index of each primitive whose box the ray may meet in `range`,
    /// roughly nearest first. `visit` returns the new end of the range, or `None` to stop the
    /// search.
    pub(crate) fn visit(
        &self,
        ray: Ray,
        range: [f64; 2],
        mut visit: impl FnMut(u32) -> Option<f64>,
    ) {
        let Some([start, end]) = clip(self.outermost, ray, range) else {
            return;
        };
        // The direction is divided by its longest coordinate and not by its length, because the
        // length underflows to zero for the shortest directions. No coordinate then exceeds 1, and
        // all distances still stay below D.
        let longest = ray.direction.abs().max_element();
        let entry = ray.origin + ray.direction * start - self.center;
        // Rounding to nearest may round a distance down. The next float is never below the
        // distance, so the search never ends too early.
        let distance = |t: f64| (((t - start) * longest) as f32).next_up();
        let single = obvhs::ray::Ray::new(
            entry.as_vec3a(),
            (ray.direction / longest).as_vec3a(),
            0.0,
            distance(end),
        );
        let leaf = |node: &Bvh2Node, single: &mut obvhs::ray::Ray, _: &mut RayHit| {
            let slots = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            for &primitive in &self.tree.primitive_indices[slots] {
                match visit(primitive) {
                    Some(end) => single.tmax = single.tmax.min(distance(end)),
                    None => return false,
                }
            }
            true
        };
        fast_stack!(u32, (48, 192), self.tree.max_depth, stack, {
            self.tree.ray_traverse_dynamic(&mut stack, single, &mut RayHit::none(), leaf);
        });
    }
}

/// The part of `range` in which the ray is inside the box; `None` if the ray misses the box.
fn clip(aabb: Aabb, ray: Ray, range: [f64; 2]) -> Option<[f64; 2]> {
    let [mut start, mut end] = range;
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        let (min, max) = (aabb.min[axis], aabb.max[axis]);
        if d == 0.0 {
            if !(min..=max).contains(&o) {
                return None;
            }
        } else {
            let (a, b) = ((min - o) / d, (max - o) / d);
            start = start.max(a.min(b));
            end = end.min(a.max(b));
        }
    }
    (start <= end && start.is_finite()).then_some([start, end])
}

/// The number of levels of the hierarchy. A traversal's stack never holds more nodes than that.
fn depth(tree: &Bvh2) -> usize {
    let mut deepest = 1;
    let mut open = vec![(0usize, 1usize)];
    while let Some((index, depth)) = open.pop() {
        let node = &tree.nodes[index];
        if !node.is_leaf() {
            deepest = deepest.max(depth + 1);
            let first = node.first_index as usize;
            open.extend([(first, depth + 1), (first + 1, depth + 1)]);
        }
    }
    deepest
}
