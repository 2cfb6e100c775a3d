//! The nodes of a scene's file, the words that choose nodes, cameras and lights, and what nodes do.

use crate::types::{Notice, Scene};
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// A node of a scene's file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneNode {
    /// Name of the node; empty if it has none.
    pub name: String,
    /// Index into [`Scene::nodes`] of the node that this one is a child of.
    pub parent: Option<usize>,
    /// The instances that draw the node's own mesh: a range of [`Scene::instances`].
    pub instances: Range<usize>,
    /// Index into [`Scene::cameras`] of the camera that the node holds.
    pub camera: Option<usize>,
    /// Index into [`Scene::lights`] of the light that the node holds.
    pub light: Option<usize>,
}

/// What an instance does. By default it is seen and casts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role {
    /// Cameras see the instance, and shadows fall on it.
    pub is_seen: bool,
    /// The instance casts shadows.
    pub casts: bool,
    /// The instance surrounds all others as a sky does. Maps are not fitted to it, and it does not
    /// decide the size of the scene.
    pub is_sky: bool,
}

impl Default for Role {
    fn default() -> Self {
        Self { is_seen: true, casts: true, is_sky: false }
    }
}

impl Role {
    /// Whether maps are fitted to the instance, and views and sizes follow from it.
    pub fn is_receiver(self) -> bool {
        self.is_seen && !self.is_sky
    }
}

/// The roles of instances, of which most have the default one. An instance that the present
/// [pose](Scene::pose) flattens is absent: it is neither seen nor casts, whatever else its role.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Roles {
    /// In the order of the instances, as if none were absent; those beyond the end have the default
    /// role.
    first: Vec<Role>,
    absent: BTreeSet<usize>,
}

impl Roles {
    /// The role of the instance with this index.
    pub fn of(&self, instance: usize) -> Role {
        let role = self.first.get(instance).copied().unwrap_or_default();
        match self.absent.contains(&instance) {
            true => Role { is_seen: false, casts: false, ..role },
            false => role,
        }
    }

    /// Whether every instance has the default role.
    pub fn are_default(&self) -> bool {
        self.absent.is_empty() && self.first.iter().all(|&r| r == Role::default())
    }

    /// Sets whether an instance is absent.
    pub(crate) fn set_absent(&mut self, instance: usize, is_absent: bool) {
        if is_absent {
            self.absent.insert(instance);
        } else {
            self.absent.remove(&instance);
        }
    }

    /// Changes the roles of some instances.
    pub fn change(&mut self, instances: Range<usize>, change: impl Fn(&mut Role)) {
        if self.first.len() < instances.end {
            self.first.resize(instances.end, Role::default());
        }
        self.first[instances].iter_mut().for_each(change);
    }
}

/// What a node is left out of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LeftOut {
    /// The node casts no shadow, but is seen.
    Casting,
    /// The node is not seen, but casts shadows.
    Receiving,
    /// The node is not there.
    Both,
}

/// A list of cameras, lights or nodes, from which a word chooses one.
///
/// Such a word is a number (`#2` is the second of the list), the name of a node, or the camera's or
/// light's own name, where it has one. A name that several things have chooses none of them. The
/// names of nodes go before others.
#[derive(Clone, Debug, Default)]
pub struct Choices<'a> {
    /// The name of its node and its own name; empty if there is none.
    names: Vec<[&'a str; 2]>,
    /// For the names of nodes and for other names: how many have the name, and the first that has.
    by_name: [HashMap<&'a str, (usize, usize)>; 2],
}

impl<'a> Choices<'a> {
    fn new(names: Vec<[&'a str; 2]>) -> Self {
        let mut by_name = [HashMap::new(), HashMap::new()];
        for (i, names) in names.iter().enumerate() {
            for (&name, by_name) in names.iter().zip(&mut by_name) {
                if !name.is_empty() {
                    by_name.entry(name).or_insert((0, i)).0 += 1;
                }
            }
        }
        Self { names, by_name }
    }

    /// The number of things in the list.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The index of the thing that a word chooses; `None` if it chooses none.
    pub fn find(&self, word: &str) -> Option<usize> {
        if let Some(index) = self.numbered(word) {
            return Some(index);
        }
        match self.by_name.iter().find_map(|names| names.get(word)) {
            Some(&(1, index)) => Some(index),
            _ => None,
        }
    }

    /// How many things have this name, as far as the names of nodes go before others.
    pub fn bearers(&self, name: &str) -> usize {
        self.by_name.iter().find_map(|names| names.get(name)).map_or(0, |&(count, _)| count)
    }

    /// All words that choose the thing with this index, names first. There is at least its number.
    pub fn words(&self, index: usize) -> Vec<String> {
        let names = self.names.get(index).into_iter().flatten();
        let mut words: Vec<String> = Vec::new();
        for name in names.filter(|n| self.find(n) == Some(index)) {
            if words.iter().all(|w| w != name) {
                words.push((*name).to_owned());
            }
        }
        words.push(format!("#{}", index + 1));
        words
    }

    fn numbered(&self, word: &str) -> Option<usize> {
        let number: usize = word.strip_prefix('#')?.parse().ok()?;
        (1..=self.names.len()).contains(&number).then(|| number - 1)
    }
}

impl Scene {
    /// The words that choose the scene's cameras.
    pub fn camera_choices(&self) -> Choices<'_> {
        let own = self.cameras.iter().map(|c| c.name.as_str());
        self.choices(own.collect(), |node| node.camera)
    }

    /// The words that choose the scene's lights.
    pub fn light_choices(&self) -> Choices<'_> {
        let own = self.lights.iter().map(|l| l.name.as_str());
        self.choices(own.collect(), |node| node.light)
    }

    fn choices<'a>(
        &'a self,
        own: Vec<&'a str>,
        held: fn(&SceneNode) -> Option<usize>,
    ) -> Choices<'a> {
        let mut names: Vec<[&str; 2]> = own.into_iter().map(|name| ["", name]).collect();
        for node in &self.nodes {
            if let Some(names) = held(node).and_then(|i| names.get_mut(i)) {
                names[0] = &node.name;
            }
        }
        Choices::new(names)
    }

    /// The words that choose the scene's animations: the indices are those of
    /// [`Animations::clips`](crate::Animations::clips).
    pub fn animation_choices(&self) -> Choices<'_> {
        let clips = self.animations.clips().iter();
        Choices::new(clips.map(|clip| ["", clip.name.as_str()]).collect())
    }

    /// The words that choose the scene's nodes.
    pub fn node_choices(&self) -> Choices<'_> {
        Choices::new(self.nodes.iter().map(|n| [n.name.as_str(), ""]).collect())
    }

    /// The indices of the nodes that a word names: one by its number, or all that have the name.
    pub fn nodes_called(&self, word: &str) -> Vec<usize> {
        if let Some(index) = self.node_choices().numbered(word) {
            return vec![index];
        }
        let is_called = |&i: &usize| !word.is_empty() && self.nodes[i].name == word;
        (0..self.nodes.len()).filter(is_called).collect()
    }

    /// Leaves nodes out, with all nodes below them. Their cameras and lights stay.
    pub fn leave_out(&mut self, nodes: &[usize], what: LeftOut) {
        let mut is_left_out = vec![false; self.nodes.len()];
        for &node in nodes {
            is_left_out[node] = true;
        }
        // Parents come before their children.
        for (i, node) in self.nodes.iter().enumerate() {
            is_left_out[i] |= node.parent.is_some_and(|p| is_left_out[p]);
            if is_left_out[i] {
                self.roles.change(node.instances.clone(), |role| {
                    role.casts &= what == LeftOut::Receiving;
                    role.is_seen &= what == LeftOut::Casting;
                });
            }
        }
        // A sky that is not there surrounds nothing.
        self.sky = self.sky.filter(|&sky| what == LeftOut::Casting || !is_left_out[sky]);
    }

    /// Everything that a user should know of: what was repaired or left out on loading, and whether
    /// the scene has a sky.
    pub fn all_notices(&self) -> Vec<Notice> {
        let mut notices = self.notices.clone();
        notices.extend(self.sky.map(|sky| {
            let name = self.node_choices().words(sky).swap_remove(0);
            Notice(format!(
                "`{name}` surrounds everything else as a sky does: neither the scene's size nor \
                 views and maps follow from it. It casts shadows all the same, unless it is left \
                 out"
            ))
        }));
        notices
    }
}
