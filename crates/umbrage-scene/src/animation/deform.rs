//! Meshes that morph targets and skins deform.

use crate::normals;
use crate::types::Mesh;
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// For each vertex, four of the joints that move it, and their weights.
#[derive(Clone, Debug)]
pub(crate) struct Influences {
    pub(crate) joints: Vec<[u32; 4]>,
    pub(crate) weights: Vec<[f32; 4]>,
}

impl Influences {
    /// The joints that move a vertex, with their weights.
    pub(crate) fn of_vertex(&self, i: usize) -> impl Iterator<Item = (u32, f32)> {
        self.joints[i].into_iter().zip(self.weights[i]).filter(|(_, weight)| *weight != 0.0)
    }
}

/// How a morph target displaces vertices.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    /// One for each vertex; empty if positions stay.
    pub(crate) positions: Vec<Vec3>,
    /// One for each vertex; empty if normals stay.
    pub(crate) normals: Vec<Vec3>,
}

/// What a mesh is deformed from.
#[derive(Clone, Debug)]
pub(crate) struct Deformer {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    targets: Vec<Target>,
    /// Whether normals are those of the triangles, each of which has corners of its own.
    is_flat: bool,
    /// Sets of influences, all in range of the joints; empty without a skin.
    influences: Vec<Influences>,
}

impl Deformer {
    /// Deforms the mesh, as it is now, by these targets and joints.
    pub(crate) fn new(
        mesh: &Mesh,
        targets: Vec<Target>,
        is_flat: bool,
        influences: Vec<Influences>,
    ) -> Self {
        let (positions, normals) = (mesh.positions.clone(), mesh.normals.clone());
        Self { positions, normals, targets, is_flat, influences }
    }

    /// Memory of a deformer of this many vertices, bytes.
    pub(crate) fn bytes(vertices: usize, targets: &[Target], sets: usize) -> usize {
        let of_target = |t: &Target| size_of_val(&*t.positions) + size_of_val(&*t.normals);
        vertices * (2 * size_of::<Vec3>() + sets * size_of::<([u32; 4], [f32; 4])>())
            + targets.iter().map(of_target).sum::<usize>()
    }

    /// Deforms the mesh that this is the deformer of. Weights that are missing count as 0, and
    /// joints move nothing without a skin. Returns the translation from the mesh's space to that of
    /// the joints, which is zero without a skin; `None` if a vertex leaves the range of single
    /// precision. Then the mesh is as it was before any deformation.
    pub(crate) fn deform(
        &self,
        mesh: &mut Mesh,
        weights: &[f32],
        joints: &[DAffine3],
    ) -> Option<DVec3> {
        mesh.positions.clone_from(&self.positions);
        mesh.normals.clone_from(&self.normals);
        if !self.targets.is_empty() {
            for (target, &weight) in self.targets.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                displace(&mut mesh.positions, &target.positions, weight);
                displace(&mut mesh.normals, &target.normals, weight);
            }
            if self.is_flat {
                normals::flatten(mesh);
            } else {
                normals::repair(mesh);
            }
        }
        let origin = match self.influences.is_empty() {
            true => mesh.positions.iter().all(|p| p.is_finite()).then_some(DVec3::ZERO),
            false => skin(mesh, &self.influences, joints),
        };
        if origin.is_none() {
            mesh.positions.clone_from(&self.positions);
            mesh.normals.clone_from(&self.normals);
        }
        origin
    }
}

/// Adds the displacements of a morph target.
pub(crate) fn displace(values: &mut [Vec3], steps: &[Vec3], weight: f32) {
    for (value, step) in values.iter_mut().zip(steps) {
        *value = (value.as_dvec3() + step.as_dvec3() * f64::from(weight)).as_vec3();
    }
}

/// The joints' blended transform for a vertex, and the sum of their weights; `None` if that is 0.
fn blend(influences: &[Influences], joints: &[DAffine3], i: usize) -> Option<(DAffine3, f64)> {
    let mut blend = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
    let mut sum = 0.0;
    for (index, weight) in influences.iter().flat_map(|set| set.of_vertex(i)) {
        let (joint, weight) = (&joints[index as usize], f64::from(weight));
        blend.matrix3 += joint.matrix3 * weight;
        blend.translation += joint.translation * weight;
        sum += weight;
    }
    (sum.abs() >= 1e-6).then_some((blend, sum))
}

/// Deforms a mesh to the pose of its joints, which must be in range. The returned translation takes
/// the mesh's new space to that of the joints. The new space has its origin at a joint, so that
/// single precision keeps the shape of meshes far from the world's origin. `None` if a vertex
/// leaves the range of single precision.
pub(crate) fn skin(
    mesh: &mut Mesh,
    influences: &[Influences],
    joints: &[DAffine3],
) -> Option<DVec3> {
    let first = joints.first().copied().unwrap_or(DAffine3::IDENTITY);
    let origin = first.translation;
    let mut is_finite = true;
    for (i, (position, normal)) in mesh.positions.iter_mut().zip(&mut mesh.normals).enumerate() {
        let (blend, sum) = blend(influences, joints, i).unwrap_or((first, 1.0));
        let posed = blend.transform_point3(position.as_dvec3()) / sum;
        *position = (posed - origin).as_vec3();
        is_finite &= position.is_finite();
        // Normals transform by the cofactor matrix. Where the pose flattens the surface, the old
        // normal is kept, because no direction is better than another.
        let m = blend.matrix3;
        let cofactor = DMat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        ) * m.determinant().signum();
        let old = normal.as_dvec3();
        *normal = (cofactor * old).normalize_or(old).as_vec3();
    }
    is_finite.then_some(origin)
}
