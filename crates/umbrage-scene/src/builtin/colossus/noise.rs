use glam::Vec3;

/// Gradient noise (Perlin 2002) over a lattice without end: smooth, within about [−1, 1], zero at
/// the points of the lattice. Its gradients come from a hash instead of a table, so that it never
/// repeats.
pub(super) fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let [x, y, z] = [cell.x as i32 as u32, cell.y as i32 as u32, cell.z as i32 as u32];
    let fade = f * f * f * (f * (f * 6.0 - Vec3::splat(15.0)) + Vec3::splat(10.0));
    let [x0, x1] = [x, x.wrapping_add(1)].map(|x| x.wrapping_mul(0x8DA6_B343));
    let [y0, y1] = [y, y.wrapping_add(1)].map(|y| y.wrapping_mul(0xD816_3841));
    let [z0, z1] = [z, z.wrapping_add(1)].map(|z| z.wrapping_mul(0xCB1A_B31F));
    let at = |x: u32, y: u32, z: u32, dx: f32, dy: f32, dz: f32| {
        slope(x ^ y ^ z, Vec3::new(f.x - dx, f.y - dy, f.z - dz))
    };
    let row = |y: u32, z: u32, dy: f32, dz: f32| {
        let (a, b) = (at(x0, y, z, 0.0, dy, dz), at(x1, y, z, 1.0, dy, dz));
        a + (b - a) * fade.x
    };
    let sheet = |z: u32, dz: f32| {
        let (a, b) = (row(y0, z, 0.0, dz), row(y1, z, 1.0, dz));
        a + (b - a) * fade.y
    };
    let (a, b) = (sheet(z0, 0.0), sheet(z1, 1.0));
    a + (b - a) * fade.z
}

/// The value at `d` of a linear function whose gradient is one of twelve, chosen by `key`.
fn slope(key: u32, d: Vec3) -> f32 {
    // The finalizer of MurmurHash3 (Appleby 2011), shortened to what its upper bits need.
    let h = (key ^ key >> 16).wrapping_mul(0x85EB_CA6B);
    let h = (h ^ h >> 13).wrapping_mul(0xC2B2_AE35) >> 28;
    let u = if h < 8 { d.x } else { d.y };
    let v = if h < 4 {
        d.y
    } else if h == 12 || h == 14 {
        d.x
    } else {
        d.z
    };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// A smooth step from 0 at `lo` to 1 at `hi`.
pub(super) fn step(lo: f32, hi: f32, x: f32) -> f32 {
    let t = ((x - lo) / (hi - lo)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_everywhere_and_never_large() {
        let mut most = 0.0_f32;
        for k in 0..40_000 {
            let p = Vec3::new(0.371, -0.513, 0.217) * k as f32 * 0.01 - Vec3::splat(30.0);
            let here = noise(p);
            most = most.max(here.abs());
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                assert!((noise(p + axis * 1e-3) - here).abs() < 5e-3, "{p}");
            }
        }
        assert!((0.5..1.1).contains(&most), "{most}");
    }
}
