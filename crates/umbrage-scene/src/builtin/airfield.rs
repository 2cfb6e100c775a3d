use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Paint, Shape, Stage, Variation, standing};
use crate::types::Scene;
use glam::{Affine3A, DVec3, Mat3A, Quat, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Distance between the planes of a line, metres.
const SPACING: f64 = 13.5;
/// Distance between lines, metres.
const LINES: f64 = 26.0;
/// Planes in a line, as far as [`SHORT_LINES`] do for all of them.
const PLANES_IN_LINE: u32 = 8;
/// The largest number of planes that stand in short lines. More of them form a square, because the
/// lines would extend over a hundred kilometres.
const SHORT_LINES: u32 = 4000;

/// `size` planes, of some 9000 triangles each, in lines before hangars, a tower and a runway, after
/// the airplanes of Lloyd et al. 2006: thin wings, struts, wires and propellers over long
/// flat ground.
pub(super) fn airfield(size: u32) -> Scene {
    let mut stage = Stage::new("airfield");
    let in_line = if size <= SHORT_LINES {
        PLANES_IN_LINE
    } else {
        (f64::from(size) * LINES / SPACING).sqrt().ceil() as u32
    };
    let lines = size.div_ceil(in_line);
    let length = f64::from(in_line) * SPACING;
    let width = f64::from(lines) * LINES;
    let reach = (length.max(width) + 130.0) as f32;
    let grass = stage.paint("grass", [0.21, 0.24, 0.09]);
    let center = Vec3::new(width as f32 / 2.0, 0.0, -length as f32 / 2.0);
    stage.ground(center, reach, 1, grass);
    pavement(&mut stage, length as f32, width as f32, reach);

    let kinds = planes(&mut stage);
    let mut vary = Variation::new(15);
    for k in 0..size {
        let (line, place) = (k / in_line, k % in_line);
        let x = (f64::from(line) + 0.5) * LINES + f64::from(vary.range(-0.6, 0.6));
        let z = -(f64::from(place) + 0.5) * SPACING + f64::from(vary.range(-0.5, 0.5));
        // Lines face each other across the taxiway between them.
        let facing = if line % 2 == 0 { -0.5 } else { 0.5 } * std::f64::consts::PI;
        let yaw = facing + f64::from(vary.range(-0.12, 0.12)) - 0.3;
        let kind = &kinds[(k as usize * 2 + 1) % kinds.len()];
        for &part in kind {
            stage.place(part, standing(DVec3::new(x, 0.03, z), yaw, 1.0));
        }
    }

    let tin = stage.paint("tin", [0.42, 0.44, 0.45]);
    let rust = stage.paint("rust", [0.36, 0.17, 0.09]);
    let hangar = [stage.shape(hangar(), tin), stage.shape(hangar_ends(), rust)];
    for k in 0..(length / 28.0) as u32 {
        let foot = DVec3::new(width + 26.0, 0.0, -(f64::from(k) + 0.6) * 28.0);
        for part in hangar {
            stage.place(part, standing(foot, -std::f64::consts::FRAC_PI_2, 1.0));
        }
    }
    tower(&mut stage, Vec3::new(width as f32 + 12.0, 0.0, -length as f32 - 16.0));
    let lens = Lens { fov_y_deg: 45.0, near: 0.4, far: f64::from(reach) * 1.6 };
    // The camera stands beside the noses of the first line.
    let eye = DVec3::new(LINES - 5.6, 2.5, 2.6);
    stage.camera("noses", eye, DVec3::new(LINES - 8.2, 1.1, -16.0), lens);
    stage.sun(DVec3::new(0.74, -0.52, 0.42));
    stage.finish()
}

/// Apron, taxiway and runway with their markings, each a little above the surface below it.
fn pavement(stage: &mut Stage, length: f32, width: f32, reach: f32) {
    let flat = |b: &mut MeshBuilder, x: [f32; 2], z: [f32; 2], y: f32| {
        let corner = Vec3::new(x[0], y, z[0]);
        b.sheet(corner, Vec3::Z * (z[1] - z[0]), Vec3::X * (x[1] - x[0]), 1);
    };
    let concrete = stage.paint("concrete", [0.47, 0.46, 0.43]);
    let asphalt = stage.paint("asphalt", [0.13, 0.13, 0.14]);
    let white = stage.paint("markings", [0.78, 0.78, 0.75]);
    let yellow = stage.paint("yellow lines", [0.72, 0.50, 0.07]);
    let mut b = MeshBuilder::new();
    flat(&mut b, [-6.0, width + 42.0], [-length - 30.0, 22.0], 0.02);
    stage.set(b, concrete);
    let (left, right) = (-52.0, -22.0);
    let ends = [-length / 2.0 - reach + 20.0, -length / 2.0 + reach - 20.0];
    let mut b = MeshBuilder::new();
    flat(&mut b, [left, right], ends, 0.02);
    flat(&mut b, [right, -6.0], [-length / 2.0 - 9.0, -length / 2.0 + 9.0], 0.015);
    stage.set(b, asphalt);
    let mut b = MeshBuilder::new();
    let middle = (left + right) / 2.0;
    for k in 0..((ends[1] - ends[0]) / 24.0) as u32 {
        let z = ends[0] + 24.0 * k as f32 + 6.0;
        flat(&mut b, [middle - 0.45, middle + 0.45], [z, z + 12.0], 0.024);
    }
    for x in [left + 1.0, right - 1.9] {
        flat(&mut b, [x, x + 0.9], ends, 0.024);
    }
    for (z, k) in ends.iter().flat_map(|&z| (0..6).map(move |k| (z, k))) {
        let z = if z == ends[0] { z + 4.0 } else { z - 34.0 };
        let x = left + 3.6 + 4.1 * k as f32;
        flat(&mut b, [x, x + 2.0], [z, z + 30.0], 0.024);
    }
    stage.set(b, white);
    let mut b = MeshBuilder::new();
    let mut x = 0.0;
    while x < width + 1.0 {
        flat(&mut b, [x - 0.1, x + 0.1], [-length - 12.0, 14.0], 0.024);
        x += LINES as f32;
    }
    stage.set(b, yellow);
}

/// The parts of each kind of plane, with wheels at y = 0 and the nose towards −z.
fn planes(stage: &mut Stage) -> Vec<Vec<Shape>> {
    let dark = stage.paint("rubber and iron", [0.03, 0.03, 0.035]);
    let glass = stage.paint("canopy", [0.04, 0.07, 0.10]);
    let wood = stage.paint("propeller", [0.30, 0.16, 0.06]);
    let parts = stage.shape(propeller(Vec3::new(0.0, 1.62, -3.66)), wood);
    let (gear, canopy) = (stage.shape(gear(), dark), stage.shape(canopy(), glass));
    let wires = stage.shape(biplane_wires(), dark);
    let mut kind = |name, rgb, is_biplane: bool| {
        let paint: Paint = stage.paint(name, rgb);
        let body = stage.shape(airframe(is_biplane), paint);
        let extra = if is_biplane { wires } else { canopy };
        vec![body, gear, parts, extra]
    };
    vec![
        kind("silver", [0.58, 0.60, 0.62], false),
        kind("scarlet", [0.52, 0.05, 0.03], true),
        kind("olive", [0.15, 0.18, 0.07], false),
        kind("cream", [0.68, 0.58, 0.38], true),
        kind("sky", [0.12, 0.28, 0.44], false),
    ]
}

/// Fuselage, wings and tail.
fn airframe(is_biplane: bool) -> MeshBuilder {
    let mut b = MeshBuilder::new();
    b.surface([28, 40], |u, v| {
        let v = v.clamp(0.0, 1.0);
        let (sin, cos) = (u * TAU).sin_cos();
        // The nose is blunt and the tail slender.
        let girth = (v * 9.0).min(1.0).sqrt()
            * (1.0 - 0.80 * ((v - 0.22) / 0.78).clamp(0.0, 1.0).powf(1.4));
        let end = ((1.0 - v) * 40.0).min(1.0).sqrt();
        let (half_width, half_height) = (0.52 * girth * end, 0.62 * girth * end);
        let middle = 1.62 + 0.28 * v * v;
        Vec3::new(half_width * cos, middle + half_height * sin, -3.5 + 7.6 * v)
    });
    let mut both = |root: Vec3, span: f32, chord: [f32; 2], rise: f32| {
        let mut right = MeshBuilder::new();
        right.wing(span, chord, rise);
        b.add(&right, Affine3A::from_translation(root));
        let mirror = Mat3A::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        b.add(&right, Affine3A { matrix3: mirror, translation: root.into() });
    };
    both(Vec3::new(0.0, 1.32, -1.55), 5.4, [1.75, 1.15], 0.10);
    if is_biplane {
        both(Vec3::new(0.0, 2.85, -2.0), 5.4, [1.6, 1.3], 0.03);
    }
    both(Vec3::new(0.0, 1.98, 3.0), 1.75, [1.0, 0.6], 0.0);
    let mut fin = MeshBuilder::new();
    fin.wing(1.45, [1.25, 0.65], 0.0);
    let upright = Mat3A::from_quat(Quat::from_rotation_z(PI / 2.0));
    b.add(&fin, Affine3A { matrix3: upright, translation: Vec3::new(0.0, 1.9, 2.9).into() });
    b
}

/// Legs, wheels, tail wheel, exhausts, an aerial and its wire.
fn gear() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let sideways = Mat3A::from_quat(Quat::from_rotation_z(PI / 2.0));
    for side in [-1.0, 1.0] {
        let hub = Vec3::new(1.15 * side, 0.36, -1.75);
        b.bar(Vec3::new(0.55 * side, 1.25, -1.4), hub, 0.05, 8);
        b.bar(Vec3::new(0.45 * side, 1.20, -0.7), hub, 0.025, 6);
        let mut wheel = MeshBuilder::new();
        let profile = [
            (0.0, -0.07),
            (0.24, -0.08),
            (0.33, -0.06),
            (0.36, 0.0),
            (0.33, 0.06),
            (0.24, 0.08),
            (0.0, 0.07),
        ];
        wheel.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 28);
        b.add(&wheel, Affine3A { matrix3: sideways, translation: hub.into() });
        for k in 0..3 {
            let z = -3.0 + 0.28 * k as f32;
            b.bar(
                Vec3::new(0.40 * side, 1.75, z),
                Vec3::new(0.62 * side, 1.70, z + 0.16),
                0.035,
                8,
            );
        }
    }
    b.bar(Vec3::new(-1.15, 0.36, -1.75), Vec3::new(1.15, 0.36, -1.75), 0.02, 6);
    b.bar(Vec3::new(0.0, 1.75, 3.3), Vec3::new(0.0, 1.20, 3.75), 0.03, 6);
    b.torus(Vec3::new(0.0, 1.15, 3.8), Vec3::X, 0.10, 0.04, [20, 8]);
    let mast = Vec3::new(0.0, 2.95, 0.35);
    b.bar(mast.with_y(2.1), mast, 0.014, 6);
    b.bar(mast, Vec3::new(0.0, 3.25, 3.95), 0.004, 4);
    b.bar(Vec3::new(4.6, 1.78, -1.4), Vec3::new(4.6, 1.78, -2.3), 0.012, 6);
    b
}

/// Three twisted blades and a spinner.
fn propeller(hub: Vec3) -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let mut spinner = MeshBuilder::new();
    let profile = [(0.24, 0.0), (0.22, 0.14), (0.14, 0.30), (0.0, 0.40)];
    spinner.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 24);
    let forward = Mat3A::from_quat(Quat::from_rotation_x(-PI / 2.0));
    b.add(&spinner, Affine3A { matrix3: forward, translation: (hub + Vec3::Z * 0.2).into() });
    for k in 0..3 {
        let turn = Quat::from_rotation_z(TAU * k as f32 / 3.0 + 0.35);
        let mut blade = MeshBuilder::new();
        let outline = [
            (0.05, -0.05),
            (0.5, -0.13),
            (1.0, -0.11),
            (1.22, -0.03),
            (1.22, 0.03),
            (1.0, 0.10),
            (0.5, 0.10),
            (0.05, 0.05),
        ];
        blade.plate(&outline.map(|(x, y)| Vec2::new(x, y)), 0.012, Affine3A::IDENTITY);
        let pitch = Quat::from_rotation_x(0.5);
        b.add(
            &blade,
            Affine3A { matrix3: Mat3A::from_quat(turn * pitch), translation: hub.into() },
        );
    }
    b
}

fn canopy() -> MeshBuilder {
    let mut unit = MeshBuilder::new();
    unit.ball(Vec3::ZERO, 1.0, 18);
    let mut b = MeshBuilder::new();
    let stretched = Mat3A::from_diagonal(Vec3::new(0.36, 0.52, 1.05));
    b.add(&unit, Affine3A { matrix3: stretched, translation: Vec3::new(0.0, 2.0, -0.35).into() });
    b
}

/// Struts and crossed wires between the wings of a biplane, and the frame of its windscreen.
fn biplane_wires() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    for side in [-1.0, 1.0] {
        let low = |x: f32, z: f32| Vec3::new(x * side, 1.38 + 0.10 * x, z);
        let high = |x: f32, z: f32| Vec3::new(x * side, 2.86 + 0.03 * x, z - 0.4);
        for x in [2.0, 4.3] {
            for z in [-1.2, -0.4] {
                b.bar(low(x, z), high(x, z), 0.028, 6);
            }
        }
        for (from, to) in [(0.5, 2.0), (2.0, 4.3)] {
            b.bar(low(from, -1.2), high(to, -1.2), 0.006, 4);
            b.bar(low(to, -1.2), high(from, -1.2), 0.006, 4);
        }
        for z in [-1.5, -0.9] {
            b.bar(Vec3::new(0.35 * side, 2.0, z), Vec3::new(0.6 * side, 2.86, z - 0.3), 0.025, 6);
        }
        b.bar(Vec3::new(0.3 * side, 2.05, 0.0), Vec3::new(0.22 * side, 2.42, 0.12), 0.012, 6);
    }
    b.bar(Vec3::new(-0.22, 2.42, 0.12), Vec3::new(0.22, 2.42, 0.12), 0.012, 6);
    b
}

/// A vault open to −z with ribs outside, 22 m wide and long.
fn hangar() -> MeshBuilder {
    const HALF: f32 = 11.0;
    const HEIGHT: f32 = 8.0;
    let mut b = MeshBuilder::new();
    let arc = |a: f32, grow: f32| {
        let (sin, cos) = (a * PI).sin_cos();
        Vec3::new((HALF + grow) * cos, (HEIGHT + grow) * sin, 0.0)
    };
    // The outer and the inner surface.
    b.surface([32, 8], |u, v| arc(u, 0.15) + Vec3::Z * (22.0 * v - 11.0));
    b.surface([32, 8], |u, v| arc(1.0 - u, 0.0) + Vec3::Z * (22.0 * v - 11.0));
    for k in 0..8 {
        let z = -10.8 + 3.0857 * k as f32;
        let path: Vec<Vec3> = (0..=24).map(|i| arc(i as f32 / 24.0, 0.2) + Vec3::Z * z).collect();
        b.tube(&path, &[0.12; 25], 6);
    }
    b
}

/// The hangar's back wall, the lintel and half-open doors of its front.
fn hangar_ends() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let at = |i: u32, z: f32| {
        let (sin, cos) = (PI * i as f32 / 24.0).sin_cos();
        Vec3::new(11.0 * cos, 8.0 * sin, z)
    };
    let front: Vec<Vec3> = (0..=24).map(|i| at(i, 10.6)).collect();
    let back: Vec<Vec3> = (0..=24).rev().map(|i| at(i, 10.5)).collect();
    b.polygon(&front).polygon(&back);
    let lintel: Vec<Vec2> = (5..=19).map(|i| at(i, 0.0).truncate()).collect();
    b.plate(&lintel, 0.08, Affine3A::from_translation(Vec3::Z * -10.7));
    for side in [-1.0_f32, 1.0] {
        for k in 0..2 {
            let x = side * (6.3 + 2.3 * k as f32);
            let size = Vec3::new(2.5, 4.9, 0.08);
            b.block(size, Affine3A::from_translation(Vec3::new(x, 0.03, -10.9 - 0.12 * k as f32)));
        }
    }
    b
}

/// A control tower with a railed gallery and a mast, and a windsock.
fn tower(stage: &mut Stage, foot: Vec3) {
    let render = stage.paint("render", [0.62, 0.58, 0.50]);
    let glass = stage.paint("tower glass", [0.05, 0.09, 0.12]);
    let iron = stage.paint("tower iron", [0.20, 0.20, 0.21]);
    let orange = stage.paint("windsock", [0.80, 0.25, 0.04]);
    let at = |x: f32, y: f32, z: f32| Affine3A::from_translation(foot + Vec3::new(x, y, z));
    let mut b = MeshBuilder::new();
    b.block(Vec3::new(9.0, 4.0, 7.0), at(0.0, 0.0, 0.0));
    b.block(Vec3::new(4.6, 6.0, 4.6), at(0.0, 4.0, 0.0));
    b.block(Vec3::new(6.4, 0.25, 6.4), at(0.0, 10.0, 0.0));
    b.block(Vec3::new(6.0, 0.3, 6.0), at(0.0, 12.9, 0.0));
    stage.set(b, render);
    let mut b = MeshBuilder::new();
    b.block(Vec3::new(4.4, 2.65, 4.4), at(0.0, 10.25, 0.0));
    stage.set(b, glass);
    let mut b = MeshBuilder::new();
    let corners = [(-3.1, -3.1), (3.1, -3.1), (3.1, 3.1), (-3.1, 3.1)];
    for i in 0..4 {
        let point = |k: usize, y: f32| foot + Vec3::new(corners[k % 4].0, y, corners[k % 4].1);
        for y in [10.75, 11.25] {
            b.bar(point(i, y), point(i + 1, y), 0.025, 6);
        }
        for k in 0..8 {
            let low = point(i, 10.25).lerp(point(i + 1, 10.25), k as f32 / 8.0);
            b.bar(low, low + Vec3::Y, 0.02, 6);
        }
    }
    b.bar(foot + Vec3::Y * 13.2, foot + Vec3::Y * 19.5, 0.05, 8);
    for k in 0..4 {
        let y = 14.5 + 1.3 * k as f32;
        let arm = Vec3::X * (0.9 - 0.15 * k as f32);
        b.bar(foot + Vec3::Y * y - arm, foot + Vec3::Y * y + arm, 0.015, 6);
    }
    let sock = Vec3::new(-14.0, 0.0, 4.0 - foot.z.abs() * 0.2);
    let pole = foot + sock;
    b.bar(pole, pole + Vec3::Y * 6.0, 0.06, 8);
    stage.set(b, iron);
    let mut b = MeshBuilder::new();
    let path: Vec<Vec3> = (0..=8)
        .map(|i| pole + Vec3::new(0.1 + 0.3 * i as f32, 5.8 - 0.006 * (i * i) as f32, 0.0))
        .collect();
    let radii: Vec<f32> = (0..=8).map(|i| 0.36 - 0.025 * i as f32).collect();
    b.tube(&path, &radii, 14);
    stage.set(b, orange);
}
