//! Which boxes of a tree of receivers stand for the receivers in a view.

use crate::bounds::{Aabb, Plane};
use crate::box_tree::{BoxNode, BoxTree};
use crate::camera::Camera;
use glam::DVec3;

/// The least emptiness for which a box is opened: the size of the empty space in it, as a share of
/// its distance from the viewer, or of an orthographic picture's height. Errors grow by about this
/// share where a box stands for what it contains.
const LEAST_EMPTINESS: f64 = 0.02;

/// One part of this many of all boxes is opened for nearness.
const NEAR_SHARE: usize = 4;

/// The thickness that is added to all boxes, as a share of the same length, so that flat boxes can
/// be empty too.
const THICKNESS: f64 = 0.01;

/// The boxes chosen. The buffer is kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Opening {
    chosen: Vec<Chosen>,
    /// The boxes chosen, in world space.
    boxes: Vec<Aabb>,
}

#[derive(Clone, Copy, Debug)]
struct Chosen {
    node: BoxNode,
    /// A lower bound of the view depth of what is seen of the box, metres.
    distance: f64,
    /// The volume of the empty space in the box over the cube of the picture's scale at its
    /// distance; 0 for single boxes.
    emptiness: f64,
}

/// The least dot product of `direction` with a point of a box inside the half-space; infinite if
/// there is no such point.
fn nearest_inside(aabb: Aabb, direction: DVec3, plane: Plane) -> f64 {
    let rises = direction.cmpge(DVec3::ZERO);
    let nearest = DVec3::select(rises, aabb.min, aabb.max);
    let mut missing = -plane.distance(nearest);
    let mut along = direction.dot(nearest);
    if missing <= 0.0 {
        return along;
    }
    // From the nearest corner the point moves along the axis that leads inside for the least rise,
    // then along the next.
    let gain = DVec3::select(rises, plane.normal, -plane.normal);
    let (cost, size) = (direction.abs(), aabb.size());
    let price = |i: usize| if gain[i] > 0.0 { cost[i] / gain[i] } else { f64::INFINITY };
    let mut axes = [0, 1, 2];
    axes.sort_unstable_by(|&i, &j| price(i).total_cmp(&price(j)));
    for i in axes.into_iter().filter(|&i| gain[i] > 0.0) {
        let step = (missing / gain[i]).min(size[i]);
        missing -= step * gain[i];
        along += step * cost[i];
    }
    // Rounding may leave a little missing where a corner alone is inside.
    if missing <= 1e-9 * plane.offset.abs().max(aabb.max.abs().max_element()) {
        along
    } else {
        f64::INFINITY
    }
}

impl Opening {
    /// Chooses at most `most` boxes that together hold every receiver inside all `planes` (local
    /// space) and inside `seen`, a box around these planes. A box is replaced by the two boxes that
    /// it consists of, again and again: first the box with the most empty space, as the viewer sees
    /// it, which decides how far maps extend; then the nearest box, which decides the largest
    /// errors.
    pub(super) fn choose(
        &mut self,
        tree: &BoxTree,
        camera: &Camera,
        planes: &[Plane],
        seen: Aabb,
        most: usize,
    ) {
        self.chosen.clear();
        let open = |index: u32| {
            let node = tree.node(index);
            // Vertices cut out of a vast box would lose as many digits as the box's size takes up,
            // so the box is first intersected with what is seen.
            let aabb = node.aabb.relative_to(camera.eye()).intersection(seen);
            let is_seen = !aabb.is_empty() && planes.iter().all(|plane| plane.may_touch(aabb));
            is_seen.then(|| {
                // What lies beside the viewer is seen farther away, if at all.
                let seen_from = planes.iter().map(|&p| nearest_inside(aabb, camera.forward(), p));
                let distance = seen_from.fold(camera.near(), f64::max);
                let emptiness = match node.children {
                    Some(_) => {
                        (aabb.size() / camera.scale_at(distance) + THICKNESS).element_product()
                            * node.empty
                    }
                    None => 0.0,
                };
                Chosen { node, distance, emptiness }
            })
        };
        self.chosen.extend(tree.root().and_then(open));
        let by_emptiness = |chosen: &[Chosen]| {
            let emptiest = (0..chosen.len())
                .max_by(|&a, &b| chosen[a].emptiness.total_cmp(&chosen[b].emptiness))?;
            let is_empty = chosen[emptiest].emptiness > LEAST_EMPTINESS.powi(3);
            is_empty.then_some(emptiest)
        };
        let by_nearness = |chosen: &[Chosen]| {
            (0..chosen.len()).min_by(|&a, &b| chosen[a].distance.total_cmp(&chosen[b].distance))
        };
        let most_empty = most - most / NEAR_SHARE;
        self.replace(by_emptiness, open, most_empty);
        // Errors do not depend on distance in orthographic views.
        if !camera.is_orthographic() {
            self.replace(by_nearness, open, most);
        }
        self.replace(by_emptiness, open, most);
        self.boxes.clear();
        self.boxes.extend(self.chosen.iter().map(|chosen| chosen.node.aabb));
    }

    /// Replaces the box that `pick` picks by the boxes that it consists of, until there are `most`
    /// or the box picked is a single one.
    fn replace(
        &mut self,
        pick: impl Fn(&[Chosen]) -> Option<usize>,
        open: impl Fn(u32) -> Option<Chosen>,
        most: usize,
    ) {
        while self.chosen.len() < most {
            let Some(i) = pick(&self.chosen) else { break };
            let Some(children) = self.chosen[i].node.children else { break };
            self.chosen.swap_remove(i);
            self.chosen.extend(children.into_iter().filter_map(&open));
        }
    }

    /// The boxes chosen, in world space.
    pub(super) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Dense samples of the box find no nearer point inside, and one almost as near.
        #[test]
        fn the_nearest_point_inside_is_found(
            a in prop::array::uniform3(-1.0..1.0f64),
            b in prop::array::uniform3(-1.0..1.0f64),
            direction in prop::array::uniform3(-1.0..1.0f64),
            normal in prop::array::uniform3(-1.0..1.0f64),
            offset in -1.0..1.0f64,
        ) {
            let aabb = Aabb::new(a.into(), b.into());
            let [direction, normal] = [direction, normal].map(|v| DVec3::from(v).normalize());
            let plane = Plane { normal, offset };
            let found = nearest_inside(aabb, direction, plane);
            const STEPS: u32 = 24;
            let steps = || (0..=STEPS).map(|i| f64::from(i) / f64::from(STEPS));
            let mut nearest = f64::INFINITY;
            for (x, y, z) in steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| (x, y, z)))) {
                let p = aabb.min + aabb.size() * DVec3::new(x, y, z);
                if plane.distance(p) >= 0.0 {
                    nearest = nearest.min(direction.dot(p));
                }
            }
            prop_assert!(found <= nearest + 1e-9, "{} {}", found, nearest);
            let cell = aabb.size().length() * 2.0 / f64::from(STEPS);
            prop_assert!(nearest.is_infinite() || found >= nearest - cell, "{} {}", found, nearest);
        }
    }
}
