//! A hierarchy of boxes, which a planner opens only as far as a view needs it.

use crate::bounds::Aabb;
use crate::error::Error;

/// Boxes that together contain all receivers, as a tree. Any number of boxes can be planned for,
/// because a planner opens a box of boxes only where this makes maps finer.
///
/// Build the tree once for what stands still. [`set`](Self::set) builds it again where boxes have
/// moved, and reuses its memory; this takes 0.1 to 0.3 µs per box.
///
/// ```
/// # use umbrage::*;
/// # use glam::dvec3;
/// let floor = Aabb::new(dvec3(-9.0, 0.0, -9.0), dvec3(9.0, 0.0, 9.0));
/// let tree = Aabb::new(dvec3(1.0, 0.0, 1.0), dvec3(2.0, 5.0, 2.0));
/// let receivers = BoxTree::new(&[floor, tree])?;
/// let bounds = Bounds { receiver_parts: Some(&receivers), ..Bounds::default() };
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoxTree {
    /// In preorder: a node's first child follows the node.
    nodes: Vec<Node>,
    /// The boxes while the tree is built.
    boxes: Vec<Aabb>,
    /// A hash of all boxes.
    fingerprint: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    aabb: Aabb,
    /// The share of the box's volume that the boxes below it fill, 0 to 1, where all boxes count as
    /// thicker by [`BoxTree::THICKNESS`].
    filled: f64,
    /// Index of the second child; 0 for a single box.
    second: u32,
}

/// A node of a [`BoxTree`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxNode {
    pub(crate) aabb: Aabb,
    /// The share of the box's volume that contains no box.
    pub(crate) empty: f64,
    /// The indices of the two nodes that it consists of; `None` for a single box.
    pub(crate) children: Option<[u32; 2]>,
}

impl BoxTree {
    /// The thickness that is added to all boxes where volumes are compared, as a share of the size
    /// of the whole, so that flat boxes have a volume too.
    const THICKNESS: f64 = 1e-3;

    /// A tree of these boxes (world space, metres), in any order. They may overlap; empty ones are
    /// left out. Without boxes there are no receivers.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a coordinate is not finite, or too large.
    pub fn new(boxes: &[Aabb]) -> Result<Self, Error> {
        let mut tree = Self::default();
        tree.set(boxes)?;
        Ok(tree)
    }

    /// Replaces all boxes. It allocates memory only where there are more boxes than ever before.
    ///
    /// # Errors
    /// As those of [`new`](Self::new). The tree is then as it was before.
    pub fn set(&mut self, boxes: &[Aabb]) -> Result<(), Error> {
        boxes.iter().try_for_each(|b| b.check("boxes"))?;
        self.nodes.clear();
        self.boxes.clear();
        self.boxes.extend(boxes.iter().filter(|b| !b.is_empty()));
        self.fingerprint = fingerprint(&self.boxes);
        let all = self.boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        if !all.is_empty() {
            let thickness = Self::THICKNESS * all.size().max_element();
            build(&mut self.nodes, &mut self.boxes, thickness);
        }
        Ok(())
    }

    /// A box around all boxes; [`Aabb::EMPTY`] if there are none.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.aabb)
    }

    /// A number that tells whether two trees hold the same boxes in the same order.
    pub(crate) fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Index of the node that holds all boxes; `None` if there are no boxes.
    pub(crate) fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    pub(crate) fn node(&self, index: u32) -> BoxNode {
        let Node { aabb, filled, second } = self.nodes[index as usize];
        let children = (second != 0).then_some([index + 1, second]);
        BoxNode { aabb, empty: 1.0 - filled, children }
    }
}

/// A hash of boxes, by multiplication and rotation of the bits of their coordinates.
fn fingerprint(boxes: &[Aabb]) -> u64 {
    let coordinates =
        boxes.iter().flat_map(|b| b.min.to_array().into_iter().chain(b.max.to_array()));
    coordinates.fold(boxes.len() as u64, |hash, x| {
        (hash ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
    })
}

/// Appends the nodes of some boxes. Returns the boxes' total volume.
fn build(nodes: &mut Vec<Node>, boxes: &mut [Aabb], thickness: f64) -> f64 {
    let volume = |aabb: Aabb| (aabb.size() + thickness).element_product();
    let index = nodes.len();
    let aabb = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
    nodes.push(Node { aabb, filled: 1.0, second: 0 });
    if boxes.len() < 2 {
        return volume(aabb);
    }
    // The boxes are halved at the median of their middles, along the axis in which the middles lie
    // farthest apart. So the tree is no deeper than its number of boxes has binary digits.
    let middles = Aabb::around(boxes.iter().map(|b| b.center())).size();
    let axis = (0..3).max_by(|&a, &b| middles[a].total_cmp(&middles[b])).unwrap_or(0);
    let key = |b: &Aabb| b.min[axis] + b.max[axis];
    let half = boxes.len() / 2;
    boxes.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
    let (first, second) = boxes.split_at_mut(half);
    let in_first = build(nodes, first, thickness);
    nodes[index].second = nodes.len() as u32;
    let whole = in_first + build(nodes, second, thickness);
    let share = whole / volume(aabb);
    // Where boxes overlap, their volumes add up to more than is filled.
    nodes[index].filled = if share.is_finite() { share.min(1.0) } else { 1.0 };
    whole
}
