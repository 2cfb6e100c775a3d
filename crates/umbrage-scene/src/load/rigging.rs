//! Reads animations, and notes what they move while the rest of a scene is loaded.

use super::document::{Document, Notices};
use super::hierarchy::{self, Hierarchy};
use crate::animation::{
    Anchor, Animations, Channel, Clip, Curve, Interpolation, Joint, Local, Morph, Node, Property,
    Skin,
};
use crate::error::SceneError;
use glam::DAffine3;
use gltf::json::animation::{self, Animation};
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// The animations of a scene that is being loaded, by the indices that the file has.
pub(super) struct Rigging<'a> {
    hierarchy: &'a Hierarchy,
    pub(super) animations: Animations,
    /// For each node of the file, its index in [`Animations::nodes`] if some clip moves it.
    moving: Vec<Option<usize>>,
    /// Indices in [`Animations::morphs`], for the nodes whose weights some clip changes.
    morphs: HashMap<usize, usize>,
    /// Indices in [`Animations::skins`], for skins of the file.
    skins: HashMap<usize, usize>,
}

impl<'a> Rigging<'a> {
    /// Reads the file's animations. Channels that cannot be played are left out, with a notice.
    ///
    /// # Errors
    /// An index is out of range, or an accessor is invalid or too large.
    pub(super) fn read(
        document: &Document,
        hierarchy: &'a Hierarchy,
        notices: &mut Notices,
    ) -> Result<Self, SceneError> {
        let mut rigging = Self {
            hierarchy,
            animations: Animations::default(),
            moving: Vec::new(),
            morphs: HashMap::new(),
            skins: HashMap::new(),
        };
        for (i, json) in document.root.animations.iter().enumerate() {
            let mut channels = Vec::new();
            for k in 0..json.channels.len() {
                let place = format!("animations[{i}].channels[{k}]");
                channels.extend(rigging.read_channel(document, json, k, &place, notices)?);
            }
            if channels.is_empty() {
                notices.add(format!("animations[{i}]"), "nothing of it can be played, left out");
                continue;
            }
            let duration_s = channels.iter().map(|c: &Channel| c.curve.end_s()).fold(0.0, f64::max);
            let name = json.name.clone().filter(|name| !name.is_empty());
            let name = name.unwrap_or_else(|| format!("animation{i}"));
            rigging.animations.clips.push(Clip { name, duration_s });
            rigging.animations.channels.push(channels);
        }
        rigging.find_moving(document)?;
        Ok(rigging)
    }

    /// A channel, whose target is an index among the file's nodes until all are known; `None` with
    /// a notice if it cannot be played.
    fn read_channel(
        &mut self,
        document: &Document,
        animation: &Animation,
        channel: usize,
        place: &str,
        notices: &mut Notices,
    ) -> Result<Option<Channel>, SceneError> {
        let json = &animation.channels[channel];
        let target = json.target.node.value();
        let Some(node) = document.root.nodes.get(target) else {
            return Err(document.invalid(place, format!("there is no nodes[{target}]")));
        };
        let Some(sampler) = animation.samplers.get(json.sampler.value()) else {
            let problem = format!("there is no sampler {}", json.sampler.value());
            return Err(document.invalid(place, problem));
        };
        let mut leave_out = |why: &str| {
            notices.add_because(place, "cannot be played, left out", why);
            Ok(None)
        };
        let (Checked::Valid(path), Checked::Valid(interpolation)) =
            (json.target.path, sampler.interpolation)
        else {
            return leave_out("its path or interpolation is unknown");
        };
        let interpolation = match interpolation {
            animation::Interpolation::Step => Interpolation::Step,
            animation::Interpolation::Linear => Interpolation::Linear,
            animation::Interpolation::CubicSpline => Interpolation::Cubic,
        };
        let times = document.floats::<1>(sampler.input, place)?.into_flattened();
        let output = sampler.output;
        let (property, values, width) = match path {
            animation::Property::Translation => {
                (Property::Translation, document.floats::<3>(output, place)?.into_flattened(), 3)
            }
            animation::Property::Rotation => {
                (Property::Rotation, document.floats::<4>(output, place)?.into_flattened(), 4)
            }
            animation::Property::Scale => {
                (Property::Scale, document.floats::<3>(output, place)?.into_flattened(), 3)
            }
            animation::Property::MorphTargetWeights => {
                let values = document.floats::<1>(output, place)?.into_flattened();
                (Property::Weights, values, rest_weights(document, target)?.len())
            }
        };
        if property == Property::Weights && width == 0 {
            return leave_out("its node has no morph targets");
        }
        if property != Property::Weights && node.matrix.is_some() {
            return leave_out("its node has a matrix");
        }
        let curve = match Curve::new(times, values, width, interpolation) {
            Ok(curve) => curve,
            Err(why) => return leave_out(why),
        };
        if property == Property::Rotation && !curve.has_rotations() {
            return leave_out("has rotations that are none");
        }
        Ok(Some(Channel { target, property, curve }))
    }

    /// Finds the nodes and weights that channels change, and lets the channels refer to them.
    fn find_moving(&mut self, document: &Document) -> Result<(), SceneError> {
        let hierarchy = self.hierarchy;
        let mut is_target = vec![false; hierarchy.order.len()];
        for channel in self.animations.channels.iter().flatten() {
            is_target[channel.target] |= channel.property != Property::Weights;
        }
        self.moving = vec![None; is_target.len()];
        for &i in &hierarchy.order {
            let parent = match hierarchy.parent[i] {
                None => Anchor::Fixed(DAffine3::IDENTITY),
                Some(parent) => self.anchor_of(parent),
            };
            if !is_target[i] && matches!(parent, Anchor::Fixed(_)) {
                continue;
            }
            let nodes = &mut self.animations.nodes;
            let place = format!("nodes[{i}]");
            document.budget.grow(&place, nodes, 1, "moving nodes", size_of::<Node>())?;
            // What there is to tell of its transform was told when it was first read.
            let rest: Local = hierarchy::local(document, i, &mut Notices::default())?;
            self.moving[i] = Some(nodes.len());
            let world_from_node = hierarchy.world_from_node[i];
            nodes.push(Node { parent, rest, local: rest, world_from_node, is_moved: false });
        }
        let Self { animations, moving, morphs, .. } = self;
        for channel in animations.channels.iter_mut().flatten() {
            if channel.property != Property::Weights {
                // Every target of such a channel moves.
                channel.target = moving[channel.target].unwrap_or_default();
                continue;
            }
            channel.target = match morphs.get(&channel.target) {
                Some(&morph) => morph,
                None => {
                    let rest = rest_weights(document, channel.target)?;
                    let place = format!("nodes[{}]", channel.target);
                    document.budget.take(
                        &place,
                        rest.len() as u64,
                        "weights",
                        size_of::<[f32; 2]>(),
                    )?;
                    morphs.insert(channel.target, animations.morphs.len());
                    animations.morphs.push(Morph { weights: rest.clone(), rest, is_moved: false });
                    animations.morphs.len() - 1
                }
            };
        }
        Ok(())
    }

    /// What something at a node of the file hangs on; `None` if there is no such node.
    pub(super) fn anchor(&self, node: usize) -> Option<Anchor> {
        (node < self.moving.len()).then(|| self.anchor_of(node))
    }

    /// The same for a node that there is.
    pub(super) fn anchor_of(&self, node: usize) -> Anchor {
        match self.moving[node] {
            Some(moving) => Anchor::Moving(moving),
            None => Anchor::Fixed(self.hierarchy.world_from_node[node]),
        }
    }

    /// The index in [`Animations::nodes`] of a node of the file, if some clip moves it.
    pub(super) fn moving(&self, node: usize) -> Option<usize> {
        self.moving[node]
    }

    /// The index in [`Animations::morphs`] of a node of the file, if some clip changes its weights.
    pub(super) fn morph(&self, node: usize) -> Option<usize> {
        self.morphs.get(&node).copied()
    }

    /// The transforms of a skin's joints at rest.
    pub(super) fn world_from_bind(&self, joints: &[Joint]) -> Vec<DAffine3> {
        joints.iter().map(|joint| joint.world_from_bind(&self.animations.nodes)).collect()
    }

    /// The index in [`Animations::skins`] of a skin of the file, which is kept if it is new.
    pub(super) fn keep_skin(
        &mut self,
        document: &Document,
        skin: usize,
        joints: &[Joint],
        place: &str,
    ) -> Result<usize, SceneError> {
        if let Some(&kept) = self.skins.get(&skin) {
            return Ok(kept);
        }
        let bytes = size_of::<Joint>() + size_of::<DAffine3>();
        document.budget.take(place, joints.len() as u64, "moving joints", bytes)?;
        let world_from_bind = self.world_from_bind(joints);
        let kept = Skin { joints: joints.to_vec(), world_from_bind, is_moved: false };
        self.animations.skins.push(kept);
        self.skins.insert(skin, self.animations.skins.len() - 1);
        Ok(self.animations.skins.len() - 1)
    }
}

/// The weights of a node's morph targets at rest, one for each target; none if its mesh has no
/// targets, or if it has no mesh.
pub(super) fn rest_weights(document: &Document, node: usize) -> Result<Vec<f32>, SceneError> {
    let json = &document.root.nodes[node];
    let Some(mesh) = json.mesh else { return Ok(Vec::new()) };
    let mesh = document.get(mesh, &format!("nodes[{node}]"))?;
    // All primitives of a mesh have the same targets.
    let targets = mesh.primitives.first().and_then(|p| p.targets.as_ref()).map_or(0, Vec::len);
    let mut weights = json.weights.as_ref().or(mesh.weights.as_ref()).cloned().unwrap_or_default();
    weights.resize(targets, 0.0);
    Ok(weights)
}
