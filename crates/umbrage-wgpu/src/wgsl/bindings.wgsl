@group({GROUP}) @binding(0) var<uniform> shadow_settings: ShadowSettings;
@group({GROUP}) @binding(1) var<{SPACE}> shadow_lights: array<ShadowLight{LIGHTS}>;
@group({GROUP}) @binding(2) var<{SPACE}> shadow_maps: array<ShadowMap{MAPS}>;
@group({GROUP}) @binding(3) var<{SPACE}> shadow_planes: array<vec4f{PLANES}>;
@group({GROUP}) @binding(4) var shadow_depths: {TEXTURE};
@group({GROUP}) @binding(5) var shadow_sampler: {SAMPLER};
