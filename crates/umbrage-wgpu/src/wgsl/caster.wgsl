// Umbrage: where casters lie in the shadow map that is being drawn.

struct ShadowCasterMap {
    clip_from_render: mat4x4f,
}

@group({GROUP}) @binding(0) var<uniform> shadow_caster_map: ShadowCasterMap;
