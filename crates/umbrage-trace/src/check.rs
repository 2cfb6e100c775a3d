use crate::Error;
use umbrage_scene::{Mesh, Scene};

/// Checks that rays can be traced against a mesh: its coordinates are finite and at most 10¹², its
/// lists have matching lengths, and its indices exist.
pub(crate) fn check_mesh(mesh: &Mesh, index: usize, scene: &Scene) -> Result<(), Error> {
    let wrong = |field: String, problem: String| {
        Err(Error::scene(format!("meshes[{index}].{field}"), problem))
    };
    let count = mesh.positions.len();
    if let Some(i) =
        mesh.positions.iter().position(|p| !p.is_finite() || p.abs().max_element() > 1e12)
    {
        return wrong(format!("positions[{i}]"), "must be finite and at most 1e12".into());
    }
    let lists =
        [("normals", mesh.normals.len()), ("uvs", mesh.uvs.len()), ("alphas", mesh.alphas.len())];
    for (field, length) in lists {
        if length != 0 && length != count {
            let problem = format!("has {length} entries for {count} positions");
            return wrong(field.into(), problem);
        }
    }
    if u32::try_from(mesh.triangles.len()).is_err() {
        return wrong("triangles".into(), "must be fewer than 2^32".into());
    }
    let out_of_range = |t: &[u32; 3]| t.iter().any(|&i| i as usize >= count);
    if let Some(i) = mesh.triangles.iter().position(out_of_range) {
        return wrong(format!("triangles[{i}]"), format!("must index {count} positions"));
    }
    let Some(material) = scene.materials.get(mesh.material) else {
        return wrong("material".into(), "names a material that does not exist".into());
    };
    if material.base_color_texture.is_some_and(|t| t.0 >= scene.textures.len()) {
        let place = format!("materials[{}].base_color_texture", mesh.material);
        return Err(Error::scene(place, "names a texture that does not exist"));
    }
    Ok(())
}
