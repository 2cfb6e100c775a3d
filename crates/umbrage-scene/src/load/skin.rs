use super::document::{Document, Notices};
use super::hierarchy;
use super::rigging::Rigging;
use crate::animation::{Influences, Joint};
use crate::error::SceneError;
use glam::Mat4;
use gltf::json::{Index, Skin};

/// The joints of a skin.
pub(super) fn joints(
    document: &Document,
    skin: Index<Skin>,
    rigging: &Rigging<'_>,
    notices: &mut Notices,
) -> Result<Vec<Joint>, SceneError> {
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
    document.budget.take(&place, json.joints.len() as u64, "joints", size_of::<Joint>())?;
    let joint = |(joint, inverse_bind): (&Index<_>, [f32; 16])| {
        let anchor = rigging.anchor(joint.value()).ok_or_else(|| {
            document.invalid(&place, format!("there is no nodes[{}]", joint.value()))
        })?;
        let place = format!("{place}.inverseBindMatrices");
        let inverse_bind = hierarchy::affine(document, inverse_bind, &place, notices)?;
        Ok(Joint { anchor, inverse_bind })
    };
    json.joints.iter().zip(inverse_binds).map(joint).collect()
}

/// Checks the influences of `vertices` by a skin of `joints` joints.
///
/// # Errors
/// A joint does not exist, or weights are not finite.
pub(super) fn check(
    document: &Document,
    influences: &[Influences],
    vertices: usize,
    joints: usize,
    place: &str,
    notices: &mut Notices,
) -> Result<(), SceneError> {
    let (mut unbound, mut scaled) = (0, 0);
    for i in 0..vertices {
        let mut sum = 0.0;
        for (joint, weight) in influences.iter().flat_map(|set| set.of_vertex(i)) {
            if joint as usize >= joints {
                let problem = format!("a vertex uses joint {joint}, the skin has {joints}");
                return Err(document.invalid(place, problem));
            }
            sum += f64::from(weight);
        }
        if !sum.is_finite() {
            return Err(document.invalid(place, "the weights of a vertex are not finite"));
        }
        if sum.abs() < 1e-6 {
            unbound += 1;
        } else {
            // Weights of 8 bits add up to 1 but for some 255ths.
            scaled += usize::from((sum - 1.0).abs() > 0.05);
        }
    }
    notices.add_some(place, scaled, "vertices have joint weights that do not sum to 1, scaled");
    notices.add_some(place, unbound, "vertices have no joint weights, moved with the first joint");
    Ok(())
}
