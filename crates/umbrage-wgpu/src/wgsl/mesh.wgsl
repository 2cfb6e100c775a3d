// Plain meshes into a shadow map.

struct ShadowMeshVertex {
    @location(0) position: vec3f,
    // Rows of the instance's matrix.
    @location(1) render_from_mesh_x: vec4f,
    @location(2) render_from_mesh_y: vec4f,
    @location(3) render_from_mesh_z: vec4f,
    //IF MASK
    @location(4) uv: vec2f,
    //END
}

struct ShadowMeshFragment {
    @builtin(position) clip: vec4f,
    //IF MASK
    @location(0) uv: vec2f,
    //END
    //IF EMULATED
    @location(1) depth: vec2f,
    //END
}

@vertex
fn shadow_mesh_vertex(vertex: ShadowMeshVertex) -> ShadowMeshFragment {
    let point = vec4f(vertex.position, 1.0);
    let position = vec3f(
        dot(vertex.render_from_mesh_x, point),
        dot(vertex.render_from_mesh_y, point),
        dot(vertex.render_from_mesh_z, point),
    );
    var out: ShadowMeshFragment;
    out.clip = shadow_caster_clip(position);
    //IF MASK
    out.uv = vertex.uv;
    //END
    //IF EMULATED
    out.depth = shadow_caster_depth(position);
    //END
    return out;
}

//IF MASK
struct ShadowMask {
    // Alpha is the texture's times `factor`; below `cutoff` there is no surface.
    factor: f32,
    cutoff: f32,
}

@group(1) @binding(0) var<uniform> shadow_mask: ShadowMask;
@group(1) @binding(1) var shadow_mask_texture: texture_2d<f32>;
@group(1) @binding(2) var shadow_mask_sampler: sampler;

fn shadow_mask_hides(uv: vec2f) -> bool {
    let alpha = textureSampleLevel(shadow_mask_texture, shadow_mask_sampler, uv, 0.0).a;
    return shadow_mask.factor * alpha < shadow_mask.cutoff;
}
//END

//IF EMULATED
@fragment
fn shadow_mesh_fragment(in: ShadowMeshFragment) -> @builtin(frag_depth) f32 {
    //IF MASK
    if (shadow_mask_hides(in.uv)) {
        discard;
    }
    //END
    return shadow_fragment_depth(in.depth);
}
//ELSE
//IF MASK
@fragment
fn shadow_mesh_fragment(in: ShadowMeshFragment) {
    if (shadow_mask_hides(in.uv)) {
        discard;
    }
}
//END
//END
