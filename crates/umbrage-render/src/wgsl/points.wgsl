// Visibility at a list of points. Umbrage's lookup module in bind group 0 must precede this text.

struct Point {
    position: vec3f,
    light: u32,
    normal: vec3f,
    padding: u32,
}

@group(1) @binding(0) var<storage, read> points: array<Point>;
@group(1) @binding(1) var<storage, read_write> visibility: array<f32>;

@compute @workgroup_size(64)
fn look_up(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&points)) {
        let point = points[id.x];
        visibility[id.x] = shadow_visibility(point.light, point.position, point.normal);
    }
}
