//! Which boxes of a tree of receivers stand for the receivers in a view.

use crate::bounds::{Aabb, Plane};
use crate::box_tree::{BoxNode, BoxTree};
use crate::camera::Camera;

/// The least emptiness for which a box is opened: the size of the empty space in it, as a share of
/// its distance from the viewer. Errors grow by about this share where a box stands for what it
/// contains.
const LEAST_EMPTINESS: f64 = 0.02;

/// The thickness that is added to all boxes, as a share of their distance from the viewer, so that
/// flat boxes can be empty too.
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
    /// The volume of the empty space in the box over the cube of its distance; 0 for single boxes.
    emptiness: f64,
}

impl Opening {
    /// Chooses at most `most` boxes that together hold every receiver inside all `planes` (local
    /// space) and inside `seen`, a box around these planes. The box with the most empty space, as
    /// the viewer sees it, is replaced by the two boxes that it consists of, again and again.
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
                let distance = aabb.least_along(camera.forward()).max(camera.near());
                let emptiness = match node.children {
                    Some(_) => (aabb.size() / distance + THICKNESS).element_product() * node.empty,
                    None => 0.0,
                };
                Chosen { node, emptiness }
            })
        };
        self.chosen.extend(tree.root().and_then(open));
        while self.chosen.len() < most {
            let emptiest = self.chosen.iter().enumerate();
            let emptiest = emptiest.max_by(|a, b| a.1.emptiness.total_cmp(&b.1.emptiness));
            let Some((i, &Chosen { node, emptiness, .. })) = emptiest else { break };
            let (true, Some(children)) = (emptiness > LEAST_EMPTINESS.powi(3), node.children)
            else {
                break;
            };
            self.chosen.swap_remove(i);
            self.chosen.extend(children.into_iter().filter_map(open));
        }
        self.boxes.clear();
        self.boxes.extend(self.chosen.iter().map(|chosen| chosen.node.aabb));
    }

    /// The boxes chosen, in world space.
    pub(super) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }
}
