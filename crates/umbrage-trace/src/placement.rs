use crate::plane::COMPUTED;
use crate::{Error, Ray};
use glam::{DAffine3, DMat3, DVec3};
use umbrage::Aabb;
use umbrage_scene::{Role, Scene};

/// Largest magnitude that an entry of a transform, or of its inverse, may have. The squares of
/// larger entries would overflow.
const LARGEST: f64 = 1e150;

/// An instance's transform, in the forms that ray tracing needs.
pub(crate) struct Placement {
    pub(crate) mesh: usize,
    pub(crate) role: Role,
    pub(crate) world_from_mesh: DAffine3,
    /// Takes directions to mesh space, and also positions relative to the instance's origin.
    pub(crate) mesh_from_world: DMat3,
    /// Upper bound of the factor by which the transform lengthens any vector.
    pub(crate) stretch: f64,
}

impl Placement {
    pub(crate) fn new(scene: &Scene, index: usize) -> Result<Self, Error> {
        let instance = &scene.instances[index];
        let wrong = |field: &str, problem: &str| {
            Err(Error::scene(format!("instances[{index}].{field}"), problem))
        };
        if instance.mesh >= scene.meshes.len() {
            return wrong("mesh", "names a mesh that does not exist");
        }
        let world_from_mesh = instance.world_from_mesh;
        let mesh_from_world = world_from_mesh.matrix3.inverse();
        let is_usable = |m: DMat3| m.to_cols_array().iter().all(|c| c.abs() <= LARGEST);
        if !(world_from_mesh.translation.is_finite()
            && is_usable(world_from_mesh.matrix3)
            && is_usable(mesh_from_world))
        {
            return wrong("world_from_mesh", "must be finite and invertible");
        }
        let stretch = stretch(world_from_mesh.matrix3);
        let role = scene.roles.of(index);
        Ok(Self { mesh: instance.mesh, role, world_from_mesh, mesh_from_world, stretch })
    }

    /// A ray of world space in mesh space, with the same parameter along it.
    pub(crate) fn ray_in_mesh(&self, ray: Ray) -> Ray {
        Ray {
            origin: self.mesh_from_world * (ray.origin - self.world_from_mesh.translation),
            direction: self.mesh_from_world * ray.direction,
        }
    }

    pub(crate) fn bounds(&self, mesh_bounds: Aabb) -> Aabb {
        if mesh_bounds.is_empty() {
            return Aabb::EMPTY;
        }
        Aabb::around(mesh_bounds.corners().map(|c| self.world_from_mesh.transform_point3(c)))
    }

    /// Upper bound of the error of `position`, computed in double precision on the triangle with
    /// these corners, metres. Interpolation, transform and back are some ten roundings of the
    /// mesh's and the world's coordinates.
    pub(crate) fn position_error(&self, corners: [DVec3; 3], position: DVec3) -> f64 {
        let largest = corners.iter().fold(DVec3::ZERO, |m, c| m.max(c.abs())).max_element();
        let world =
            position.abs().max_element() + self.world_from_mesh.translation.abs().max_element();
        COMPUTED * (largest * self.stretch + world)
    }
}

/// Upper bound of the factor by which a matrix lengthens any vector, exact for a matrix without
/// shear. The square of the largest singular value is the largest eigenvalue of MᵀM, and the
/// largest row sum of |MᵀM| is never below that eigenvalue.
pub(crate) fn stretch(m: DMat3) -> f64 {
    let square = m.transpose() * m;
    let row_sums = square.x_axis.abs() + square.y_axis.abs() + square.z_axis.abs();
    row_sums.max_element().sqrt()
}
