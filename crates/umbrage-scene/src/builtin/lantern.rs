//! A hall that is lit by a lantern alone. Every side of the cube around the light shows surfaces.

use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Paint, Stage, Variation, standing};
use crate::types::Scene;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use umbrage::PointLight;

/// Distance between columns, metres.
const SPACING: f32 = 3.6;
/// Height of the ceiling, metres.
const CEILING: f32 = 4.9;
/// Height of the beams' lower edge, metres, which is the height of the columns.
const BEAMS: f32 = 4.45;
/// Position of the flame, metres.
const FLAME: Vec3 = Vec3::new(0.0, 2.35, 0.0);
/// Radius of the lantern's belly, and half its height, metres.
const CAGE: [f32; 2] = [0.27, 0.36];

/// A hall of 2 `size` + 1 columns along each side. The lantern hangs in place of the middle column.
pub(super) fn lantern(size: u32) -> Scene {
    let mut stage = Stage::new("lantern");
    let half = (size as f32 + 0.75) * SPACING;
    hall(&mut stage, size, half);

    let sandstone = stage.paint("sandstone", [0.58, 0.46, 0.31]);
    let column = stage.shape(column(), sandstone);
    let rows = -i64::from(size)..=i64::from(size);
    for (i, k) in rows.clone().flat_map(|i| rows.clone().map(move |k| (i, k))) {
        if (i, k) != (0, 0) {
            let foot = DVec3::new(i as f64, 0.0, k as f64) * f64::from(SPACING);
            stage.place(column, standing(foot, 0.0, 1.0));
        }
    }
    let eye = DVec3::new(-0.62, 0.0, 2.28_f64.min(f64::from(size) + 0.5)) * f64::from(SPACING);
    furnish(&mut stage, size, eye);

    let iron = stage.paint("iron", [0.07, 0.06, 0.05]);
    stage.set(cage(), iron);
    let wax = stage.paint("wax", [0.70, 0.62, 0.46]);
    stage.set(candle(), wax);

    let corner = f64::from(half).hypot(f64::from(half)).hypot(f64::from(CEILING));
    let lens = Lens { fov_y_deg: 56.0, near: 0.15, far: 2.0 * corner };
    stage.camera("aisle", eye + DVec3::Y * 1.6, DVec3::new(0.3, 1.75, 0.0), lens);
    let position = FLAME.as_dvec3();
    stage.flame("flame", PointLight { position, near: 0.05, range: 1.1 * corner });
    stage.finish()
}

/// Floor, walls, and a ceiling with beams from column to column.
fn hall(stage: &mut Stage, size: u32, half: f32) {
    let flags = stage.paint("flags", [0.50, 0.42, 0.32]);
    stage.ground(Vec3::ZERO, half, 1, flags);
    let plaster = stage.paint("plaster", [0.66, 0.57, 0.44]);
    let (x, y, z) = (Vec3::X * 2.0 * half, Vec3::Y * CEILING, Vec3::Z * 2.0 * half);
    let corner = Vec3::new(-half, 0.0, -half);
    let mut walls = MeshBuilder::new();
    walls
        .sheet(corner, x, y, 1)
        .sheet(corner + x, z, y, 1)
        .sheet(corner + x + z, -x, y, 1)
        .sheet(corner + z, -z, y, 1)
        .sheet(corner + y, x, z, 1);
    stage.set(walls, plaster);

    let oak = stage.paint("oak", [0.24, 0.14, 0.07]);
    let mut beams = MeshBuilder::new();
    for row in -i64::from(size)..=i64::from(size) {
        let at = row as f32 * SPACING;
        for (across, along) in [(Vec3::X, Vec3::Z), (Vec3::Z, Vec3::X)] {
            let (side, end) = (across * 0.16, along * half);
            let (low, high) = (Vec3::Y * BEAMS, Vec3::Y * CEILING);
            beams.cuboid(across * at - side - end + low, across * at + side + end + high, 1);
        }
    }
    stage.set(beams, oak);
}

/// A turned column with a square foot and cap.
fn column() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    b.cuboid(Vec3::new(-0.36, 0.0, -0.36), Vec3::new(0.36, 0.14, 0.36), 1);
    b.cuboid(Vec3::new(-0.36, BEAMS - 0.14, -0.36), Vec3::new(0.36, BEAMS, 0.36), 1);
    let profile = [
        (0.32, 0.14),
        (0.34, 0.20),
        (0.32, 0.27),
        (0.26, 0.30),
        (0.27, 0.36),
        (0.23, 0.42),
        (0.22, 1.60),
        (0.19, 3.82),
        (0.23, 3.86),
        (0.23, 3.92),
        (0.20, 3.96),
        (0.24, 4.12),
        (0.33, 4.31),
    ];
    b.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 40);
    b
}

/// Jars, bowls and stools between the columns, except near `eye`, where they would hide all else.
fn furnish(stage: &mut Stage, size: u32, eye: DVec3) {
    let clay = stage.paint("clay", [0.46, 0.20, 0.10]);
    let glaze = stage.paint("glaze", [0.10, 0.27, 0.30]);
    let wood = stage.paint("wood", [0.36, 0.22, 0.11]);
    let turned = |stage: &mut Stage, profile: &[(f32, f32)], paint: Paint| {
        let mut b = MeshBuilder::new();
        let profile: Vec<Vec2> = profile.iter().map(|&(r, y)| Vec2::new(r, y)).collect();
        b.lathe(&profile, 36);
        stage.shape(b, paint)
    };
    let mut jar: Vec<(f32, f32)> = (0..=20)
        .map(|i| {
            let v = i as f32 / 20.0;
            (0.17 + 0.23 * (PI * v.powf(0.85)).sin(), v)
        })
        .collect();
    jar.extend([(0.25, 1.09), (0.22, 1.09), (0.14, 1.0), (0.0, 0.98)]);
    let bowl = [
        (0.0, 0.0),
        (0.18, 0.0),
        (0.10, 0.08),
        (0.09, 0.40),
        (0.30, 0.50),
        (0.46, 0.68),
        (0.43, 0.68),
        (0.27, 0.54),
        (0.0, 0.50),
    ];
    let shapes =
        [turned(stage, &jar, clay), turned(stage, &bowl, glaze), stage.shape(stool(), wood)];
    let mut vary = Variation::new(17);
    let cells = -i64::from(size)..i64::from(size);
    for (i, k) in cells.clone().flat_map(|i| cells.clone().map(move |k| (i, k))) {
        let shift = [0, 1].map(|_| f64::from(vary.range(-0.25, 0.25)));
        let cell = DVec3::new(i as f64 + 0.5 + shift[0], 0.0, k as f64 + 0.5 + shift[1]);
        let place = standing(cell * f64::from(SPACING), f64::from(vary.unit() * TAU), 1.0);
        let shape = shapes[vary.pick(shapes.len())];
        if vary.unit() < 0.75 && place.translation.distance(eye) > f64::from(SPACING) {
            stage.place(shape, place);
        }
    }
}

/// Four legs, rails, and slats with gaps through which light falls.
fn stool() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let foot = Vec3::new(0.27 * x, 0.0, 0.20 * z);
        b.bar(foot, Vec3::new(0.23 * x, 0.45, 0.16 * z), 0.022, 8);
    }
    for z in [-0.185, 0.185] {
        b.bar(Vec3::new(-0.25, 0.18, z), Vec3::new(0.25, 0.18, z), 0.014, 8);
    }
    for k in 0..6 {
        let x = (k as f32 - 2.5) * 0.1;
        b.cuboid(Vec3::new(x - 0.035, 0.44, -0.22), Vec3::new(x + 0.035, 0.47, 0.22), 1);
    }
    b
}

/// Wire wound in both directions around the flame, rings, a foot for the candle, and a chain up to
/// the beams.
fn cage() -> MeshBuilder {
    const STRANDS: u32 = 13;
    let [belly, reach] = CAGE;
    // The wire runs from pole to pole, except for the openings at the bottom and the top.
    let shape = |v: f32| {
        let a = PI * (0.09 + 0.82 * v);
        (belly * a.sin(), FLAME.y - reach * a.cos())
    };
    let mut b = MeshBuilder::new();
    for k in 0..STRANDS {
        for hand in [1.0, -1.0] {
            let path: Vec<Vec3> = (0..=48)
                .map(|i| {
                    let v = i as f32 / 48.0;
                    let (sin, cos) = (TAU * (k as f32 / STRANDS as f32 + 0.3 * hand * v)).sin_cos();
                    let (r, y) = shape(v);
                    Vec3::new(r * cos, y, r * sin)
                })
                .collect();
            b.tube(&path, &[0.0028; 49], 6);
        }
    }
    for v in [0.0, 0.5, 1.0] {
        let (r, y) = shape(v);
        b.torus(Vec3::Y * y, Vec3::Y, r, 0.004, [64, 8]);
    }
    let (foot, foot_y) = shape(0.0);
    for k in 0..3 {
        let (sin, cos) = (PI * k as f32 / 3.0).sin_cos();
        let spoke = Vec3::new(foot * cos, 0.0, foot * sin);
        b.bar(Vec3::Y * foot_y - spoke, Vec3::Y * foot_y + spoke, 0.004, 6);
    }
    let (neck, top) = shape(1.0);
    for k in 0..4 {
        let (sin, cos) = (TAU * k as f32 / 4.0).sin_cos();
        b.bar(Vec3::new(neck * cos, top, neck * sin), Vec3::Y * (top + 0.12), 0.004, 6);
    }
    // Neighbouring links are perpendicular and pass through each other.
    let links = ((BEAMS - top - 0.10) / 0.07) as u32;
    for k in 0..=links {
        let normal = if k % 2 == 0 { Vec3::X } else { Vec3::Z };
        let y = top + 0.14 + 0.07 * k as f32;
        b.torus(Vec3::Y * y, normal, 0.042, 0.007, [20, 6]);
    }
    b
}

/// A candle whose top is below the flame.
fn candle() -> MeshBuilder {
    let foot = FLAME.y - CAGE[1] * (PI * 0.09).cos();
    let mut b = MeshBuilder::new();
    let profile = [(0.0, foot), (0.05, foot), (0.05, foot + 0.02), (0.018, foot + 0.03)];
    let tip = [(0.018, FLAME.y - 0.08), (0.0, FLAME.y - 0.07)];
    let profile: Vec<Vec2> = profile.into_iter().chain(tip).map(|(r, y)| Vec2::new(r, y)).collect();
    b.lathe(&profile, 20);
    b
}
