use super::document::{Document, Notices};
use super::hierarchy::Hierarchy;
use super::primitive::Binding;
use crate::error::SceneError;
use crate::types::Mesh;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::{Index, Skin};

/// For each joint, the transform from its bind space to the world, in the pose that the nodes have.
pub(super) fn joint_matrices(
    document: &Document,
    skin: Index<Skin>,
    hierarchy: &Hierarchy,
) -> Result<Vec<DAffine3>, SceneError> {
    let place = format!("skins[{}]", skin.value());
    let json = document.get(skin, &place)?;
    let inverse_binds = match json.inverse_bind_matrices {
        Some(id) => document.floats::<16>(id, &format!("{place}.inverseBindMatrices"))?,
        None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); json.joints.len()],
    };
    if inverse_binds.len() < json.joints.len() {
        let (m, j) = (inverse_binds.len(), json.joints.len());
        return Err(
            document.invalid(&place, format!("has {m} inverse bind matrices for {j} joints"))
        );
    }
    let joint = |(joint, inverse_bind): (&Index<_>, [f32; 16])| {
        let world = hierarchy.world_from_node.get(joint.value()).ok_or_else(|| {
            document.invalid(&place, format!("there is no nodes[{}]", joint.value()))
        })?;
        let inverse_bind = DMat4::from_cols_array(&inverse_bind.map(f64::from));
        let matrix = *world * DAffine3::from_mat4(inverse_bind);
        match matrix.is_finite() {
            true => Ok(matrix),
            false => Err(document.invalid(&place, "its inverse bind matrices are not finite")),
        }
    };
    json.joints.iter().zip(inverse_binds).map(joint).collect()
}

/// Deforms a mesh to the pose of its joints. The returned translation takes the mesh's new space to
/// the world. The new space has its origin at a joint, so that single precision keeps the shape of
/// meshes far from the world's origin.
pub(super) fn pose(
    document: &Document,
    mesh: &mut Mesh,
    binding: &Binding,
    joints: &[DAffine3],
    place: &str,
    notices: &mut Notices,
) -> Result<DAffine3, SceneError> {
    let n = mesh.positions.len();
    if binding.joints.len() != n || binding.weights.len() != n {
        return Err(document.invalid(place, "must have one set of joints and weights per position"));
    }
    let origin = joints.first().map_or(DVec3::ZERO, |j| j.translation);
    let mut unbound = 0;
    for (i, (indices, weights)) in binding.joints.iter().zip(&binding.weights).enumerate() {
        let mut blend = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
        let mut sum = 0.0;
        for (&index, &weight) in indices.iter().zip(weights) {
            if weight == 0.0 {
                continue;
            }
            let joint = joints.get(index as usize).ok_or_else(|| {
                let problem =
                    format!("vertex {i} uses joint {index}, the skin has {}", joints.len());
                document.invalid(place, problem)
            })?;
            let weight = f64::from(weight);
            blend.matrix3 += joint.matrix3 * weight;
            blend.translation += joint.translation * weight;
            sum += weight;
        }
        if !sum.is_finite() {
            return Err(document.invalid(place, format!("weights of vertex {i} are not finite")));
        }
        if sum.abs() < 1e-6 {
            unbound += 1;
            blend = joints.first().copied().unwrap_or(DAffine3::IDENTITY);
            sum = 1.0;
        }
        let position = blend.transform_point3(mesh.positions[i].as_dvec3()) / sum;
        mesh.positions[i] = (position - origin).as_vec3();
        if !mesh.positions[i].is_finite() {
            return Err(document.invalid(place, format!("the pose moves vertex {i} out of range")));
        }
        // Normals transform by the cofactor matrix. Where the pose flattens the surface, the old
        // normal is kept, because no direction is better than another.
        let m = blend.matrix3;
        let cofactor = DMat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        ) * m.determinant().signum();
        let normal = mesh.normals[i].as_dvec3();
        mesh.normals[i] = (cofactor * normal).normalize_or(normal).as_vec3();
    }
    notices.add_some(place, unbound, "vertices have no joint weights, moved with the first joint");
    Ok(DAffine3::from_translation(origin))
}
