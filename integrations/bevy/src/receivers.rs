//! The boxes around the receivers that a camera sees, from Bevy's visible meshes.

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoCpuCulling, NoFrustumCulling, VisibleEntities};
use bevy::ecs::system::SystemParam;
use bevy::light::NotShadowReceiver;
use bevy::math::Vec3A;
use bevy::prelude::*;
use std::any::TypeId;
use umbrage::BoxTree;
use umbrage::glam::DVec3;

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
    is_known: bool,
}

impl Boxes {
    /// The boxes that a camera sees first.
    pub(crate) fn of(meshes: &Meshes, visible: &VisibleEntities) -> Self {
        let mut boxes = Self::default();
        boxes.find(meshes, visible);
        boxes
    }

    /// Finds the boxes around the receivers that a camera may see.
    pub(crate) fn find(&mut self, meshes: &Meshes, visible: &VisibleEntities) {
        self.boxes.clear();
        let seen = visible.entities.get(&TypeId::of::<Mesh3d>()).map_or(&[][..], Vec::as_slice);
        for entity in seen.iter().copied().chain(&meshes.not_culled_here) {
            match meshes.receivers.get(entity) {
                Ok((aabb, transform, false)) => self.boxes.push(world_box(aabb, transform)),
                _ if meshes.others.contains(entity) => {}
                _ => {
                    self.is_known = false;
                    return;
                }
            }
        }
        self.is_known = !self.boxes.is_empty();
        if self.is_known && self.boxes != self.last {
            self.is_known = self.tree.set(&self.boxes).is_ok();
            self.last.clone_from(&self.boxes);
        }
    }

    /// A tree of the boxes found; `None` if a receiver has no box or if there are no receivers.
    pub(crate) fn tree(&self) -> Option<&BoxTree> {
        self.is_known.then_some(&self.tree)
    }
}

fn world_box(aabb: &Aabb, transform: &GlobalTransform) -> umbrage::Aabb {
    let affine = transform.affine();
    let center = affine.transform_point3a(aabb.center);
    let axes = affine.matrix3;
    let half = axes.x_axis.abs() * aabb.half_extents.x
        + axes.y_axis.abs() * aabb.half_extents.y
        + axes.z_axis.abs() * aabb.half_extents.z;
    let point = |p: Vec3A| DVec3::from_array(p.to_array().map(f64::from));
    umbrage::Aabb::new(point(center - half), point(center + half))
}
