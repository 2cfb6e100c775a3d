// Moment shadow maps with Hamburger's four moments, quantised for 16 bits (Peters and Klein 2015).
const SHADOW_MSM_OFFSET: f32 = 0.035955884;

fn shadow_encode(depth: f32) -> array<vec4f, 1> {
    let square = depth * depth;
    let moments = vec4f(depth, square, square * depth, square * square);
    return array<vec4f, 1>(vec4f(
        dot(vec4f(-2.0722465, 32.237038, -68.57107, 39.370327), moments) + SHADOW_MSM_OFFSET,
        dot(vec4f(13.794886, -59.4684, 82.03597, -35.364902), moments),
        dot(vec4f(0.105877705, -1.9077466, 9.349656, -6.654349), moments),
        dot(vec4f(9.792406, -33.76521, 47.94561, -23.972805), moments),
    ));
}

fn shadow_reconstruct(numbers: array<vec4f, 1>, depth: f32) -> f32 {
    let stored = numbers[0] - vec4f(SHADOW_MSM_OFFSET, 0.0, 0.0, 0.0);
    let moments = vec4f(
        dot(vec4f(0.22277441, 0.077197286, 0.79269866, 0.031941755), stored),
        dot(vec4f(0.15496793, 0.13946294, 0.7963416, -0.17228232), stored),
        dot(vec4f(0.1451989, 0.21202022, 0.72586945, -0.27580148), stored),
        dot(vec4f(0.16312745, 0.25914323, 0.65390925, -0.33761317), stored),
    );
    return shadow_without_leak(1.0 - shadow_hamburger(moments, depth), {LEAK});
}

// The least share of depths less than `depth` that these moments allow (Algorithm 3).
fn shadow_hamburger(moments: vec4f, depth: f32) -> f32 {
    let b = moments + (0.5 - moments) * 6e-5;
    let l32_d22 = b.z - b.x * b.y;
    let d22 = b.y - b.x * b.x;
    let variance_of_square = b.w - b.y * b.y;
    let d33_d22 = variance_of_square * d22 - l32_d22 * l32_d22;
    let l32 = l32_d22 / d22;
    var c = vec3f(1.0, depth - b.x, depth * depth - b.y);
    c.z -= l32 * c.y;
    c.y /= d22;
    c.z *= d22 / d33_d22;
    c.y -= l32 * c.z;
    c.x -= c.y * b.x + c.z * b.y;
    let p = c.y / c.z;
    let q = c.x / c.z;
    let r = sqrt(max(0.25 * p * p - q, 0.0));
    let z1 = -0.5 * p - r;
    let z2 = -0.5 * p + r;
    if (z2 < depth) {
        return 1.0 - (z1 * z2 - b.x * (z1 + z2) + b.y) / ((depth - z1) * (depth - z2));
    }
    if (z1 < depth) {
        return (depth * z2 - b.x * (depth + z2) + b.y) / ((z1 - depth) * (z1 - z2));
    }
    return 0.0;
}
