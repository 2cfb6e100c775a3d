use super::noise::{noise, step};
use glam::Vec3;

/// Wavelength of the coarsest octave of erosion, metres.
const COARSEST: f32 = 1.3;

/// How far tools and weather have raised (or, if negative, lowered) the surface at `p`, metres.
/// `roughness` is 0 for polished skin and 1 for the raw block. Detail of wavelengths below
/// `finest`, metres, is left out.
pub(super) fn relief(p: Vec3, roughness: f32, finest: f32) -> f32 {
    grooves(p, roughness, finest) + erosion(p, roughness, finest)
}

/// Strokes of the point on the block and of the claw chisel on the figure. They hatch the stone in
/// patches, each of which has a direction of its own.
fn grooves(p: Vec3, roughness: f32, finest: f32) -> f32 {
    // Distance between the strokes, metres, and directions across them.
    const HATCHES: [(f32, Vec3); 4] = [
        (0.21, Vec3::new(0.58, 0.72, 0.38)),
        (0.17, Vec3::new(-0.64, 0.66, 0.40)),
        (0.052, Vec3::new(0.34, 0.86, -0.38)),
        (0.041, Vec3::new(-0.81, 0.44, 0.39)),
    ];
    let patch = noise(p * 0.9 + Vec3::new(4.0, 0.0, 9.0));
    let waver = noise(p * 1.7);
    let mut height = 0.0;
    for (k, (wavelength, across)) in HATCHES.into_iter().enumerate() {
        let is_point = k < 2;
        let tool = if is_point { roughness * roughness } else { 0.12 + 0.88 * roughness };
        let wanted = if k % 2 == 0 { patch } else { -patch };
        let share = step(-0.16, 0.12, wanted);
        if wavelength < 2.0 * finest || tool * share < 1e-3 {
            continue;
        }
        // A stroke is a round furrow between sharp ridges, and every one goes to another depth.
        let along = p.dot(across) / wavelength + 0.45 * waver;
        let stroke = along.floor();
        let t = along - stroke - 0.5;
        let depth = 0.55 + 0.45 * noise(Vec3::new(stroke * 0.71, p.y * 1.9, p.x * 1.9 + p.z));
        height += (t * t * 4.0 - 0.66) * depth * tool * share * wavelength * 0.13;
    }
    height
}

/// Weather: octaves of noise from metres down to millimetres, pits, and rills that rain washed out.
fn erosion(p: Vec3, roughness: f32, finest: f32) -> f32 {
    let strength = 0.10 + 0.90 * roughness;
    let (mut height, mut wavelength, mut q) = (0.0, COARSEST, p / COARSEST);
    let mut worn = 0.0;
    while wavelength > 2.0 * finest {
        let n = noise(q);
        // What stands out is worn smooth, and what lies deep stays sharp (Musgrave et al. 1989).
        let sharp = 0.55 + 0.45 * f32::clamp(0.5 - worn, 0.0, 1.0);
        let octave = if wavelength > 0.3 { 1.0 - 1.7 * n.abs() } else { n };
        worn += octave * 0.35;
        height += octave * sharp * wavelength * 0.021;
        (wavelength, q) = (wavelength * 0.49, q / 0.49 + Vec3::new(11.3, 5.7, 2.9));
    }
    let pit = noise(p * 9.0 + Vec3::splat(31.0));
    let pits = if finest < 0.05 { -0.02 * step(0.40, 0.75, pit) } else { 0.0 };
    // Rain has washed the block in streaks from top to bottom.
    let rills = 0.03 * noise(p * Vec3::new(4.6, 0.45, 4.6)) * roughness;
    height * strength + rills + pits * (0.3 + 0.7 * roughness)
}
