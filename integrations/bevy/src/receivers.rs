//! The boxes around the receivers that a camera sees, from Bevy's visible meshes.

use crate::convert::vector;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoCpuCulling, NoFrustumCulling, VisibleEntities};
use bevy::ecs::system::SystemParam;
use bevy::light::NotShadowReceiver;
use bevy::prelude::*;
use std::any::TypeId;
use umbrage::BoxTree;

type Mesh = (&'static Aabb, &'static GlobalTransform, Has<NoFrustumCulling>);

/// Access to the meshes of the scene.
#[derive(SystemParam)]
pub(crate) struct Meshes<'w, 's> {
    receivers: Query<'w, 's, Mesh, (With<Mesh3d>, Without<NotShadowReceiver>)>,
    others: Query<'w, 's, (), With<NotShadowReceiver>>,
    /// Meshes that are culled on the GPU alone, so that Bevy does not know whether they are seen.
    not_culled_here: Query<'w, 's, Entity, (With<Mesh3d>, With<NoCpuCulling>)>,
}

/// The boxes that a camera sees. The tree is built anew where they are not those of the last frame.
#[derive(Default)]
pub(crate) struct Boxes {
    boxes: Vec<umbrage::Aabb>,
    last: Vec<umbrage::Aabb>,
    tree: BoxTree,
    /// Whether they were looked for in this frame.
    is_found: bool,
    /// Whether all receivers have boxes, and there are some.
    is_known: bool,
}

impl Boxes {
    /// Begins a frame.
    pub(crate) fn forget(&mut self) {
        self.is_found = false;
    }

    /// A tree of the boxes around the receivers that a camera may see; `None` if a receiver has no
    /// box or if there are no receivers.
    pub(crate) fn tree(&mut self, meshes: &Meshes, visible: &VisibleEntities) -> Option<&BoxTree> {
        if !self.is_found {
            self.is_found = true;
            self.is_known = self.find(meshes, visible).is_some();
        }
        self.is_known.then_some(&self.tree)
    }

    fn find(&mut self, meshes: &Meshes, visible: &VisibleEntities) -> Option<()> {
        self.boxes.clear();
        let seen = visible.entities.get(&TypeId::of::<Mesh3d>()).map_or(&[][..], Vec::as_slice);
        for entity in seen.iter().copied().chain(&meshes.not_culled_here) {
            match meshes.receivers.get(entity) {
                Ok((aabb, transform, false)) => self.boxes.push(world_box(aabb, transform)),
                _ if meshes.others.contains(entity) => {}
                _ => return None,
            }
        }
        if self.boxes != self.last {
            // A tree that refuses boxes keeps those that it has.
            self.tree.set(&self.boxes).ok()?;
            self.last.clone_from(&self.boxes);
        }
        (!self.boxes.is_empty()).then_some(())
    }
}

fn world_box(aabb: &Aabb, transform: &GlobalTransform) -> umbrage::Aabb {
    let affine = transform.affine();
    let center = affine.transform_point3a(aabb.center);
    let axes = affine.matrix3;
    let half = axes.x_axis.abs() * aabb.half_extents.x
        + axes.y_axis.abs() * aabb.half_extents.y
        + axes.z_axis.abs() * aabb.half_extents.z;
    let [a, b] = [center - half, center + half].map(|corner| vector(corner.to_array()));
    umbrage::Aabb::new(a, b)
}
