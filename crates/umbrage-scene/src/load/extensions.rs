//! Which extensions of glTF are read, and what becomes of the others.

use super::document::{Document, Notices};

/// Extensions that are read.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Extensions of materials through which light passes.
const TRANSLUCENT: &[&str] = &[
    "KHR_materials_diffuse_transmission",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
];

/// Extensions of materials that take the place of the base colour and its alpha.
const OTHER_COLOR: &[&str] = &["KHR_materials_pbrSpecularGlossiness", "KHR_materials_variants"];

/// Whether a file that requires the extension can be loaded. Most extensions of materials change a
/// surface's look only, but neither its shape nor its base colour.
pub(super) fn can_load(extension: &str) -> bool {
    READ.contains(&extension) || extension.starts_with("KHR_materials_")
}

/// Notes the extensions that are not read.
pub(super) fn note_unread(document: &Document, notices: &mut Notices) {
    type Kind = fn(&str) -> bool;
    let is_look = |e: &str| e.starts_with("KHR_materials_");
    let kinds: [(Kind, &str); 4] = [
        (|e| TRANSLUCENT.contains(&e), "let light through, which is not supported: all is solid"),
        (|e| OTHER_COLOR.contains(&e), "not supported: the base colour and its alpha are used"),
        (is_look, "not supported: surfaces are drawn without what they describe"),
        (|_| true, "not supported: what they describe is left out"),
    ];
    let mut unread: Vec<&str> = document.root.extensions_used.iter().map(String::as_str).collect();
    unread.retain(|e| !READ.contains(e));
    for (is_kind, what) in kinds {
        let of_kind: Vec<&str> = unread.extract_if(.., |e| is_kind(e)).collect();
        if !of_kind.is_empty() {
            notices.add("extensionsUsed", format!("{}: {what}", of_kind.join(", ")));
        }
    }
}
