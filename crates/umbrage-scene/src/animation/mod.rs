//! Animations: clips that move a scene's nodes, deform its meshes, and the poses that they give.

mod curve;
mod deform;
mod held;

pub(crate) use curve::{Curve, Interpolation};
pub(crate) use deform::{Deformer, Influences, Target, displace, skin};
pub(crate) use held::{HeldCamera, HeldLight, Optics, Shine};

use crate::types::{Mesh, Scene};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use umbrage::Aabb;

/// Largest magnitude of an entry of a transform. Larger entries count as overflow, although
/// products with positions overflow only much later.
pub(crate) const LARGEST: f64 = 1e100;

/// Largest distance of a position from the origin, metres. The planner has the same limit.
pub(crate) const WORLD_END: f64 = 1e12;

/// The clips of a scene's file, and what they move. Built-in scenes have none.
#[derive(Clone, Debug, Default)]
pub struct Animations {
    pub(crate) clips: Vec<Clip>,
    /// What each clip changes.
    pub(crate) channels: Vec<Vec<Channel>>,
    /// Nodes that some clip moves, directly or with a node above them. Parents come before their
    /// children.
    pub(crate) nodes: Vec<Node>,
    pub(crate) morphs: Vec<Morph>,
    pub(crate) skins: Vec<Skin>,
    pub(crate) deformed: Vec<Deformed>,
    pub(crate) carried: Vec<Carried>,
    pub(crate) cameras: Vec<HeldCamera>,
    pub(crate) lights: Vec<HeldLight>,
    /// The box around the scene at rest. Cameras and lights without an end reach to its end.
    pub(crate) bounds: Aabb,
}

/// An animation that a scene can be posed by.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The file's name of the animation, or `animation0`, `animation1`, …
    pub name: String,
    /// Time of the last key, seconds; finite and at least 0. A clip begins at 0.
    pub duration_s: f64,
}

/// The transform of an instance that is not there: small, so that its box neither widens a scene
/// nor reaches beyond the world's end, whatever its mesh.
pub(crate) const ABSENT: DAffine3 =
    DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(1e-30)), translation: DVec3::ZERO };

/// What a pose changed against the pose before it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Indices into [`Scene::instances`] of those that look or stand otherwise, each once: their
    /// transforms, their meshes or their [roles](Scene::roles) changed.
    pub instances: Vec<usize>,
    /// Indices into [`Scene::meshes`] of those that were deformed, ascending. The numbers of their
    /// vertices and their triangles never change.
    pub meshes: Vec<usize>,
    /// Indices into [`Scene::cameras`] of those that moved, ascending.
    pub cameras: Vec<usize>,
    /// Indices into [`Scene::lights`] of those that moved, ascending.
    pub lights: Vec<usize>,
}

/// Changes one property of one node over time.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    /// Index of the [`Node`], or of the [`Morph`] for weights.
    pub(crate) target: usize,
    pub(crate) property: Property,
    pub(crate) curve: Curve,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// A node's transform in its parent's space.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Local {
    Matrix(DAffine3),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Local {
    pub(crate) fn affine(&self) -> DAffine3 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Parts { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }

    fn change(&mut self, property: Property, curve: &Curve, seconds: f64) {
        // Channels of nodes with a matrix are left out on loading.
        if let Self::Parts { translation, rotation, scale } = self {
            match property {
                Property::Translation => *translation = curve.vector(seconds),
                Property::Rotation => *rotation = curve.rotation(seconds),
                Property::Scale => *scale = curve.vector(seconds),
                Property::Weights => {}
            }
        }
    }
}

/// A node that some clip moves.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) parent: Anchor,
    pub(crate) rest: Local,
    /// In the present pose.
    pub(crate) local: Local,
    /// In the present pose. May overflow.
    pub(crate) world_from_node: DAffine3,
    /// Whether the last pose moved it.
    pub(crate) is_moved: bool,
}

/// What something hangs on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Anchor {
    /// A node that no clip moves: its transform to the world.
    Fixed(DAffine3),
    /// Index of a [`Node`].
    Moving(usize),
}

impl Anchor {
    pub(crate) fn world(&self, nodes: &[Node]) -> DAffine3 {
        match *self {
            Self::Fixed(world) => world,
            Self::Moving(node) => nodes[node].world_from_node,
        }
    }

    fn is_moved(&self, nodes: &[Node]) -> bool {
        matches!(*self, Self::Moving(node) if nodes[node].is_moved)
    }
}

/// The weights of a node's morph targets, which some clip changes.
#[derive(Clone, Debug)]
pub(crate) struct Morph {
    pub(crate) rest: Vec<f32>,
    /// In the present pose.
    pub(crate) weights: Vec<f32>,
    /// Whether the last pose changed them.
    pub(crate) is_moved: bool,
}

/// A skin of which some clip moves a joint, or whose meshes are morphed too.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    pub(crate) joints: Vec<Joint>,
    /// In the present pose: from the bind space of each joint to the world.
    pub(crate) world_from_bind: Vec<DAffine3>,
    /// Whether the last pose moved a joint.
    pub(crate) is_moved: bool,
}

/// A joint of a skin.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) anchor: Anchor,
    pub(crate) inverse_bind: DAffine3,
}

impl Joint {
    pub(crate) fn world_from_bind(&self, nodes: &[Node]) -> DAffine3 {
        self.anchor.world(nodes) * self.inverse_bind
    }
}

/// A mesh that some clip deforms.
#[derive(Clone, Debug)]
pub(crate) struct Deformed {
    /// Index into [`Scene::meshes`].
    pub(crate) mesh: usize,
    pub(crate) deformer: Deformer,
    pub(crate) morph: Option<usize>,
    pub(crate) skin: Option<usize>,
    /// In the present pose: as [`Deformer::deform`] returns it.
    pub(crate) origin: Option<DVec3>,
    /// In the present pose: the largest coordinate of the mesh, metres.
    pub(crate) reach: f64,
    /// Whether the last pose changed it.
    pub(crate) is_moved: bool,
}

/// An instance that some clip moves or deforms.
#[derive(Clone, Debug)]
pub(crate) struct Carried {
    /// Index into [`Scene::instances`].
    pub(crate) instance: usize,
    /// `None` if the skin of its mesh places it.
    pub(crate) place: Option<Place>,
    pub(crate) shape: Shape,
}

/// The node where an instance stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) anchor: Anchor,
    /// If the node draws copies, where this one is.
    pub(crate) node_from_copy: Option<DAffine3>,
}

impl Place {
    pub(crate) fn world(&self, nodes: &[Node]) -> DAffine3 {
        let world = self.anchor.world(nodes);
        self.node_from_copy.map_or(world, |copy| world * copy)
    }
}

/// The mesh of a carried instance.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// The largest coordinate of a mesh that keeps its shape, metres.
    Rigid { reach: f64 },
    /// Index of a [`Deformed`].
    Deformed(usize),
}

impl Animations {
    /// The clips, in the order of the file. Animations of which nothing can be played are not among
    /// them.
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// Moves nodes and weights to a pose.
    fn set(&mut self, clip: Option<usize>, seconds: f64) {
        for node in &mut self.nodes {
            node.local = node.rest;
        }
        let before: Vec<Vec<f32>> = self.morphs.iter().map(|m| m.weights.clone()).collect();
        for morph in &mut self.morphs {
            morph.weights.clone_from(&morph.rest);
        }
        if let Some((clip, channels)) =
            clip.and_then(|i| self.clips.get(i).zip(self.channels.get(i)))
        {
            // A time that is not a number becomes 0.
            let seconds = seconds.max(0.0).min(clip.duration_s);
            for Channel { target, property, curve } in channels {
                match property {
                    Property::Weights => {
                        curve.numbers(seconds, &mut self.morphs[*target].weights);
                    }
                    _ => self.nodes[*target].local.change(*property, curve, seconds),
                }
            }
        }
        for (morph, before) in self.morphs.iter_mut().zip(before) {
            morph.is_moved = morph.weights != before;
        }
        for i in 0..self.nodes.len() {
            let (above, rest) = self.nodes.split_at_mut(i);
            let node = &mut rest[0];
            let world = node.parent.world(above) * node.local.affine();
            node.is_moved = !is_same(&world, &node.world_from_node);
            node.world_from_node = world;
        }
        for skin in &mut self.skins {
            skin.is_moved = skin.joints.iter().any(|j| j.anchor.is_moved(&self.nodes));
            if skin.is_moved {
                let joints = skin.joints.iter().map(|j| j.world_from_bind(&self.nodes));
                skin.world_from_bind.clear();
                skin.world_from_bind.extend(joints);
            }
        }
    }

    /// Deforms the meshes whose weights or joints moved.
    fn deform(&mut self, meshes: &mut [Mesh]) {
        for deformed in &mut self.deformed {
            let morph = deformed.morph.map(|i| &self.morphs[i]);
            let skin = deformed.skin.map(|i| &self.skins[i]);
            deformed.is_moved =
                morph.is_some_and(|m| m.is_moved) || skin.is_some_and(|s| s.is_moved);
            if !deformed.is_moved {
                continue;
            }
            let Some(mesh) = meshes.get_mut(deformed.mesh) else { continue };
            let weights = morph.map_or(&[][..], |m| &m.weights);
            let joints = skin.map_or(&[][..], |s| &s.world_from_bind);
            deformed.origin = deformed.deformer.deform(mesh, weights, joints);
            deformed.reach = mesh.reach();
        }
    }

    /// Whether the last pose may have changed a carried instance.
    fn is_moved(&self, carried: &Carried) -> bool {
        carried.place.is_some_and(|place| place.anchor.is_moved(&self.nodes))
            || matches!(carried.shape, Shape::Deformed(i) if self.deformed[i].is_moved)
    }

    /// The transform of a carried instance in the present pose; `None` if the instance cannot be
    /// drawn, because it is flat or reaches beyond the world's end.
    pub(crate) fn world_from_mesh(&self, carried: &Carried) -> Option<DAffine3> {
        let (origin, reach) = match carried.shape {
            Shape::Rigid { reach } => (DVec3::ZERO, reach),
            Shape::Deformed(i) => (self.deformed[i].origin?, self.deformed[i].reach),
        };
        let posed = || DAffine3::from_translation(origin);
        let world = carried.place.map_or_else(posed, |place| place.world(&self.nodes));
        let m = world.matrix3;
        let columns = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs();
        let farthest = (world.translation.abs() + columns * reach).max_element();
        (farthest <= WORLD_END && !is_flat(m)).then_some(world)
    }
}

impl Scene {
    /// Moves the scene to the pose that a clip has at a time, seconds, or to the pose of its file
    /// if `clip` is `None` or no clip's index. The time counts from the clip's beginning; times
    /// outside the clip are those of its nearer end, and a time that is not a number is 0. The pose
    /// depends on nothing else, so the file's pose is restored exactly.
    ///
    /// Instances at the clip's nodes move, meshes with skins or morph targets are deformed, and
    /// cameras and lights move with the nodes that hold them. An instance that the pose flattens,
    /// or that would reach beyond 10¹² m from the origin, is neither seen nor casts in that pose
    /// (see [`Roles`](crate::Roles)); its transform is then of no meaning, but finite and
    /// invertible. A camera or light whose node has no direction stands as in the file.
    ///
    /// What others derived from the scene before, such as boxes, stays as it was.
    pub fn pose(&mut self, clip: Option<usize>, seconds: f64) -> Moved {
        let Self { animations, meshes, instances, roles, .. } = self;
        animations.set(clip, seconds);
        animations.deform(meshes);
        let mut moved = Moved::default();
        for carried in animations.carried.iter().filter(|c| animations.is_moved(c)) {
            let Some(instance) = instances.get_mut(carried.instance) else { continue };
            let world = animations.world_from_mesh(carried);
            instance.world_from_mesh = world.unwrap_or(ABSENT);
            roles.set_absent(carried.instance, world.is_none());
            moved.instances.push(carried.instance);
        }
        let deformed = animations.deformed.iter().filter(|d| d.is_moved);
        moved.meshes.extend(deformed.map(|d| d.mesh));
        for held in &animations.cameras {
            if animations.nodes[held.node].is_moved
                && let Some(camera) = self.cameras.get_mut(held.camera)
            {
                let world = &animations.nodes[held.node].world_from_node;
                held.place(world, animations.bounds, camera);
                moved.cameras.push(held.camera);
            }
        }
        for held in &animations.lights {
            if animations.nodes[held.node].is_moved
                && let Some(light) = self.lights.get_mut(held.light)
            {
                let world = &animations.nodes[held.node].world_from_node;
                held.place(world, animations.bounds, light);
                moved.lights.push(held.light);
            }
        }
        moved
    }
}

impl Moved {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        let Self { instances, meshes, cameras, lights } = self;
        [instances, meshes, cameras, lights].iter().all(|list| list.is_empty())
    }
}

/// Whether two transforms have the same bits, so that the file's pose is restored to the bit.
fn is_same(a: &DAffine3, b: &DAffine3) -> bool {
    a.to_cols_array().map(f64::to_bits) == b.to_cols_array().map(f64::to_bits)
}

/// Whether a transform is singular, exactly or as far as rounding can tell.
pub(crate) fn is_flat(m: DMat3) -> bool {
    let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let is_usable = |inverse: DMat3| inverse.to_cols_array().iter().all(|c| c.abs() <= LARGEST);
    m.determinant().abs() <= 1e-9 * lengths || !is_usable(m.inverse())
}
