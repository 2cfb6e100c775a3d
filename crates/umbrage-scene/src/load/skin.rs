use super::document::{Document, Notices};
use super::hierarchy::{self, Hierarchy};
use super::primitive::Influences;
use crate::error::SceneError;
use crate::types::Mesh;
use glam::{DAffine3, DMat3, DVec3, Mat4};
use gltf::json::{Index, Skin};

/// For each joint, the transform from its bind space to the world, in the pose that the nodes have.
pub(super) fn joint_matrices(
    document: &Document,
    skin: Index<Skin>,
    hierarchy: &Hierarchy,
    notices: &mut Notices,
) -> Result<Vec<DAffine3>, SceneError> {
    let place = format!("skins[{}]", skin.value());
    let json = document.get(skin, &place)?;
    let inverse_binds = match json.inverse_bind_matrices {
        Some(id) => document.floats::<16>(id, &format!("{place}.inverseBindMatrices"))?,
        None => vec![Mat4::IDENTITY.to_cols_array(); json.joints.len()],
    };
    if inverse_binds.len() < json.joints.len() {
        let (m, j) = (inverse_binds.len(), json.joints.len());
        return Err(
            document.invalid(&place, format!("has {m} inverse bind matrices for {j} joints"))
        );
    }
    document.budget.take(&place, json.joints.len() as u64, "joints", size_of::<DAffine3>())?;
    let joint = |(joint, inverse_bind): (&Index<_>, [f32; 16])| {
        let world = hierarchy.world_from_node.get(joint.value()).ok_or_else(|| {
            document.invalid(&place, format!("there is no nodes[{}]", joint.value()))
        })?;
        let place = format!("{place}.inverseBindMatrices");
        Ok(*world * hierarchy::affine(document, inverse_bind, &place, notices)?)
    };
    json.joints.iter().zip(inverse_binds).map(joint).collect()
}

/// Deforms a mesh to the pose of its joints. The returned translation takes the mesh's new space to
/// the world. The new space has its origin at a joint, so that single precision keeps the shape of
/// meshes far from the world's origin.
pub(super) fn pose(
    document: &Document,
    mesh: &mut Mesh,
    influences: &[Influences],
    joints: &[DAffine3],
    place: &str,
    notices: &mut Notices,
) -> Result<DAffine3, SceneError> {
    let origin = joints.first().map_or(DVec3::ZERO, |j| j.translation);
    let (mut unbound, mut scaled) = (0, 0);
    for i in 0..mesh.positions.len() {
        let mut blend = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
        let mut sum = 0.0;
        for (index, weight) in influences.iter().flat_map(|set| set.of_vertex(i)) {
            let joint = joints.get(index as usize).ok_or_else(|| {
                let problem = format!("a vertex uses joint {index}, the skin has {}", joints.len());
                document.invalid(place, problem)
            })?;
            let weight = f64::from(weight);
            blend.matrix3 += joint.matrix3 * weight;
            blend.translation += joint.translation * weight;
            sum += weight;
        }
        if !sum.is_finite() {
            return Err(document.invalid(place, "the weights of a vertex are not finite"));
        }
        if sum.abs() < 1e-6 {
            unbound += 1;
            blend = joints.first().copied().unwrap_or(DAffine3::IDENTITY);
            sum = 1.0;
        }
        // Weights of 8 bits add up to 1 but for some 255ths.
        scaled += usize::from((sum - 1.0).abs() > 0.05);
        let position = blend.transform_point3(mesh.positions[i].as_dvec3()) / sum;
        mesh.positions[i] = (position - origin).as_vec3();
        if !mesh.positions[i].is_finite() {
            return Err(document.invalid(place, "the pose moves a vertex out of range"));
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
    notices.add_some(place, scaled, "vertices have joint weights that do not sum to 1, scaled");
    notices.add_some(place, unbound, "vertices have no joint weights, moved with the first joint");
    Ok(DAffine3::from_translation(origin))
}
