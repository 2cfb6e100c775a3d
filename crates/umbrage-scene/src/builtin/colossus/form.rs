//! The large form of the statue as a field of distances: a bearded figure in a mantle that holds a
//! book and sets one foot on a rock, half freed from its block.

use super::noise::{noise, step};
use glam::{Quat, Vec3};

/// Half the height of the block, metres. The origin is in its middle, and +z is the front.
pub(super) const HALF_HEIGHT: f32 = 5.0;

/// What the form is at a point.
#[derive(Clone, Copy)]
pub(super) struct Form {
    /// A lower bound of the distance to the surface, up to a factor; negative inside. Metres.
    pub(super) distance: f32,
    /// How roughly the nearest surface is worked: 0 is polished skin, 1 is the raw block.
    pub(super) roughness: f32,
}

/// The union of two distances with a fillet about as wide as `k`, metres (Quílez's polynomial
/// smooth minimum).
fn blend(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// What is left of `a` after `b` is carved out of it.
fn carve(a: f32, b: f32, k: f32) -> f32 {
    -blend(-a, b, k)
}

/// A limb of the radius `ra` at `a` and `rb` at `b`.
fn limb(p: Vec3, a: Vec3, b: Vec3, ra: f32, rb: f32) -> f32 {
    let (pa, ba) = (p - a, b - a);
    let t = (pa.dot(ba) / ba.length_squared()).clamp(0.0, 1.0);
    (pa - ba * t).length() - (ra + (rb - ra) * t)
}

fn ellipsoid(p: Vec3, center: Vec3, radii: Vec3) -> f32 {
    let q = p - center;
    let (near, slope) = ((q / radii).length(), (q / (radii * radii)).length());
    if slope < 1e-6 { -radii.min_element() } else { near * (near - 1.0) / slope }
}

fn cuboid(p: Vec3, center: Vec3, half: Vec3, round: f32) -> f32 {
    let q = (p - center).abs() - half + Vec3::splat(round);
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - round
}

/// The form at `p`, metres.
pub(super) fn form(p: Vec3) -> Form {
    let stone = block(p);
    let cloth = mantle(p);
    let skin = blend(head(p), limbs(p), 0.12);
    let figure = blend(cloth, skin, 0.12);
    // Skin is smoothest, cloth shows the claw chisel, and the block the point.
    let worked = 0.08 + 0.22 * step(-0.15, 0.15, skin - cloth);
    let roughness = worked + (1.0 - worked) * step(-0.12, 0.30, figure - stone);
    Form { distance: blend(figure, stone, 0.16), roughness }
}

/// The rough block behind the figure and at its feet. It ends in broken edges.
fn block(p: Vec3) -> f32 {
    // Far away a box around all of it will do.
    let around = cuboid(p, Vec3::new(0.0, 0.0, -0.4), Vec3::new(2.9, 5.0, 2.6), 0.0);
    if around > 1.5 {
        return around - 0.4;
    }
    let broken = 0.34 * noise(p * 0.55) + 0.15 * noise(p * 1.4 + Vec3::splat(7.3));
    let slab = cuboid(p, Vec3::new(-0.1, -0.35, -1.15), Vec3::new(2.15, 4.9, 1.15), 0.12);
    // The upper corner on the right has split off.
    let split = (p - Vec3::new(1.75, 3.3, 0.0)).dot(Vec3::new(0.62, 0.75, 0.22));
    let slab = carve(slab, -split, 0.1);
    let flank = cuboid(p, Vec3::new(1.75, -2.4, -0.2), Vec3::new(0.62, 2.7, 0.75), 0.1);
    let heel = cuboid(p, Vec3::new(-1.75, -3.6, -0.2), Vec3::new(0.55, 1.5, 0.8), 0.1);
    let foot = cuboid(p, Vec3::new(0.0, -4.85, 0.35), Vec3::new(2.3, 0.42, 1.65), 0.08);
    let rock = cuboid(p, Vec3::new(0.95, -4.35, 0.95), Vec3::new(0.62, 0.5, 0.75), 0.12);
    let rough = slab.min(flank).min(heel).min(rock) + broken;
    // The foot is cut flat, so that it stands.
    let floor = -HALF_HEIGHT - p.y;
    blend(rough, foot + 0.3 * broken, 0.1).max(floor)
}

/// Folds that hang from `top` and widen downwards, as a height above the cloth.
fn folds(p: Vec3, top: f32, count: f32) -> f32 {
    let angle = p.x.atan2(p.z + 0.4);
    let sway = 1.1 * noise(p * Vec3::new(0.5, 0.35, 0.5) + Vec3::splat(3.1));
    let wave = (count * angle + 0.8 * (top - p.y).max(0.0).sqrt() + 2.0 * sway).sin();
    // Ridges are narrower than the valleys between them.
    let ridge = (0.5 + 0.5 * wave).powf(1.6) - 0.35;
    ridge * 0.24 * step(0.0, 2.0, top - p.y)
}

/// The tunic, and the mantle that is thrown over a shoulder and gathered at the hip.
fn mantle(p: Vec3) -> f32 {
    let around = ellipsoid(p, Vec3::new(0.0, -0.7, 0.3), Vec3::new(2.4, 5.2, 2.3));
    if around > 1.2 {
        return around;
    }
    let chest = ellipsoid(p, Vec3::new(-0.05, 1.85, 0.42), Vec3::new(1.02, 1.30, 0.74));
    let waist = ellipsoid(p, Vec3::new(0.05, 0.45, 0.45), Vec3::new(0.82, 1.2, 0.66));
    let shoulders = limb(p, Vec3::new(-0.85, 2.68, 0.35), Vec3::new(0.85, 2.58, 0.45), 0.44, 0.46);
    // The cloth of the tunic is drawn in small folds towards the belt.
    let small = 0.045 * (9.0 * p.x + 2.2 * (p.y - 0.4) + 3.0 * noise(p * 0.9)).sin();
    let tunic = blend(blend(chest, waist, 0.45), shoulders, 0.3) - small * step(2.7, 1.2, p.y);
    let belt = ellipsoid(p, Vec3::new(0.05, 0.02, 0.47), Vec3::new(0.88, 0.17, 0.74));
    let skirt = limb(p, Vec3::new(0.0, -0.45, 0.35), Vec3::new(-0.05, -3.9, 0.25), 0.86, 1.12);
    let thigh = limb(p, Vec3::new(0.45, -0.7, 0.55), Vec3::new(0.78, -2.0, 1.42), 0.56, 0.42);
    let shin = limb(p, Vec3::new(0.78, -2.0, 1.42), Vec3::new(0.85, -3.45, 1.05), 0.40, 0.36);
    let still = limb(p, Vec3::new(-0.48, -0.8, 0.55), Vec3::new(-0.62, -2.6, 0.95), 0.56, 0.44);
    let skirt = skirt - folds(p, -0.3, 17.0);
    let legs = blend(blend(thigh, shin, 0.2), still, 0.2) - 0.3 * folds(p, -0.6, 23.0);
    let skirt = blend(skirt, legs, 0.34).max(-4.35 - p.y);
    // A thick roll of cloth runs from the hip on the left over the shoulder on the right.
    let twist = 0.05 * (7.0 * p.y - 6.0 * p.x + 4.0 * p.z).sin();
    let (hip, breast) = (Vec3::new(-0.95, -0.35, 0.75), Vec3::new(0.0, 1.0, 1.05));
    let roll = limb(p, hip, breast, 0.27, 0.22);
    let roll = roll.min(limb(p, breast, Vec3::new(0.78, 2.75, 0.72), 0.22, 0.26));
    // From there it falls down along the back on the right.
    let fall = limb(p, Vec3::new(1.05, 2.6, 0.05), Vec3::new(1.55, -3.4, 0.1), 0.42, 0.62);
    let fall = fall - 0.09 * (11.0 * p.x + 6.0 * p.z + 2.5 * noise(p * 0.5)).sin();
    let cloth = blend(tunic, skirt, 0.22).min(blend(roll - twist, belt, 0.1));
    blend(cloth, fall, 0.12)
}

/// Arms, hands, feet and the book.
fn limbs(p: Vec3) -> f32 {
    let (shoulder, elbow) = (Vec3::new(-1.12, 2.58, 0.4), Vec3::new(-1.62, 0.85, 0.55));
    let wrist = Vec3::new(-1.2, -0.52, 1.02);
    let upper = limb(p, shoulder, elbow, 0.45, 0.31);
    let muscle =
        ellipsoid(p, shoulder.lerp(elbow, 0.45) + Vec3::Z * 0.1, Vec3::new(0.37, 0.62, 0.38));
    let right = blend(upper, muscle, 0.15);
    let right = blend(right, limb(p, elbow, wrist, 0.31, 0.19), 0.14);
    let palm = wrist + Vec3::new(0.1, -0.3, 0.1);
    let mut hand = ellipsoid(p, palm, Vec3::new(0.2, 0.3, 0.15));
    for k in 0..4 {
        let side = 0.11 * k as f32 - 0.17;
        let knuckle = palm + Vec3::new(side, -0.18, 0.06);
        let tip = knuckle + Vec3::new(0.09 + 0.2 * side, -0.34, 0.07);
        hand = blend(hand, limb(p, knuckle, tip, 0.085, 0.06), 0.05);
    }
    let right = blend(right, hand, 0.1);

    let (shoulder, elbow) = (Vec3::new(1.1, 2.5, 0.5), Vec3::new(1.68, 0.75, 0.95));
    let wrist = Vec3::new(0.98, 1.1, 1.62);
    let left = limb(p, shoulder, elbow, 0.46, 0.35);
    let left = blend(left, limb(p, elbow, wrist, 0.34, 0.19), 0.14);
    let mut grip = ellipsoid(p, wrist + Vec3::new(-0.2, 0.1, 0.08), Vec3::new(0.26, 0.22, 0.16));
    for k in 0..4 {
        let knuckle = wrist + Vec3::new(-0.24, 0.26 - 0.12 * k as f32, 0.16);
        let tip = knuckle + Vec3::new(-0.34, 0.05, -0.02);
        grip = blend(grip, limb(p, knuckle, tip, 0.085, 0.065), 0.05);
    }
    let lean = Quat::from_rotation_z(-0.28) * Quat::from_rotation_y(-0.35);
    let q = lean.inverse() * (p - Vec3::new(0.62, 1.32, 1.33));
    let cover = cuboid(q, Vec3::ZERO, Vec3::new(0.46, 0.66, 0.19), 0.03);
    // The pages are set back from the covers.
    let pages = cuboid(q, Vec3::new(-0.1, 0.0, 0.0), Vec3::new(0.42, 0.72, 0.12), 0.01);
    let book =
        carve(cover, pages, 0.02).min(cuboid(q, Vec3::ZERO, Vec3::new(0.43, 0.6, 0.13), 0.0));
    let left = blend(left, grip, 0.1).min(book);

    let foot = |heel: Vec3, toes: Vec3| {
        let sole = limb(p, heel, toes, 0.26, 0.19);
        let instep = limb(p, heel + Vec3::Y * 0.5, heel.lerp(toes, 0.7), 0.22, 0.16);
        let mut foot = blend(sole, instep, 0.15);
        for k in 0..5 {
            let across = 0.115 * (k as f32 - 2.0);
            let toe = toes + Vec3::new(across, -0.04, 0.16 - 0.3 * across.abs());
            foot = blend(foot, (p - toe).length() - 0.095, 0.06);
        }
        foot
    };
    let standing = foot(Vec3::new(-0.62, -4.2, 0.9), Vec3::new(-0.78, -4.3, 1.62));
    let raised = foot(Vec3::new(0.9, -3.62, 1.1), Vec3::new(1.0, -3.74, 1.8));
    right.min(left).min(standing.min(raised))
}

/// The head with hair and beard, turned towards its right and bent a little.
fn head(p: Vec3) -> f32 {
    const MIDDLE: Vec3 = Vec3::new(0.08, 3.72, 0.62);
    let away = (p - MIDDLE).length();
    if away > 2.4 {
        return away - 1.3;
    }
    let turned = Quat::from_rotation_y(-0.42) * Quat::from_rotation_x(0.08);
    // In this frame, y leads to the crown and z to the tip of the nose.
    let q = turned.inverse() * (p - MIDDLE);
    let at = Vec3::new;
    // The two sides of the face are alike.
    let m = at(q.x.abs(), q.y, q.z);
    let skull = ellipsoid(q, at(0.0, 0.12, -0.06), at(0.50, 0.62, 0.60));
    let jaw = ellipsoid(q, at(0.0, -0.30, 0.14), at(0.38, 0.46, 0.42));
    let mut face = blend(skull, jaw, 0.2);
    face = blend(face, limb(m, at(0.30, -0.12, 0.36), at(0.2, -0.2, 0.46), 0.12, 0.08), 0.14);
    face = blend(face, limb(m, at(0.06, 0.15, 0.55), at(0.33, 0.13, 0.40), 0.075, 0.06), 0.08);
    face = carve(face, ellipsoid(m, at(0.20, 0.0, 0.58), at(0.135, 0.085, 0.13)), 0.10);
    let eye = (m - at(0.195, 0.0, 0.42)).length() - 0.105;
    let lid = limb(m, at(0.10, 0.045, 0.50), at(0.29, 0.04, 0.46), 0.035, 0.03);
    face = blend(face.min(eye), lid, 0.03);
    let bridge = limb(q, at(0.0, 0.12, 0.54), at(0.0, -0.17, 0.74), 0.055, 0.085);
    let nostril = (m - at(0.075, -0.19, 0.64)).length() - 0.07;
    face = blend(face, blend(bridge, nostril, 0.05), 0.07);
    let lips = ellipsoid(q, at(0.0, -0.37, 0.55), at(0.17, 0.045, 0.08));
    let lower = ellipsoid(q, at(0.0, -0.455, 0.53), at(0.13, 0.045, 0.08));
    face = blend(face, lips.min(lower), 0.04);
    face = blend(face, ellipsoid(m, at(0.51, -0.05, -0.04), at(0.06, 0.17, 0.1)), 0.03);

    // Locks of hair and beard are waves that noise bends.
    let bent = 2.2 * noise(q * 2.4);
    let lock = 0.04 * (18.0 * q.x + 4.0 * q.y + 2.0 * bent).sin()
        + 0.035 * (15.0 * q.z - 6.0 * q.y + 2.4 * bent).sin();
    let mut hair = ellipsoid(q, at(0.0, 0.24, -0.16), at(0.60, 0.62, 0.64));
    hair = blend(hair, limb(m, at(0.50, 0.2, -0.05), at(0.48, -0.62, -0.2), 0.17, 0.2), 0.15);
    hair = carve(hair, ellipsoid(q, at(0.0, -0.16, 0.68), at(0.42, 0.56, 0.5)), 0.08);
    let beard = ellipsoid(q, at(0.0, -0.72, 0.40), at(0.36, 0.56, 0.27));
    let beard = blend(beard, limb(m, at(0.40, -0.2, 0.16), at(0.2, -0.62, 0.42), 0.1, 0.15), 0.1);
    let moustache = limb(m, at(0.05, -0.29, 0.60), at(0.27, -0.42, 0.47), 0.06, 0.05);
    let beard = carve(beard, lips.min(lower) - 0.03, 0.04).min(moustache);
    let hairy = blend(hair, beard, 0.08) - lock;
    let neck = limb(p, at(0.0, 2.6, 0.4), at(0.08, 3.45, 0.52), 0.42, 0.36);
    blend(face, hairy, 0.04).min(neck)
}
