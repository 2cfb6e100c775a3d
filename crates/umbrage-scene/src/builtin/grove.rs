use super::mesh_builder::MeshBuilder;
use super::plants::{BIRCH, OAK, Tree, WINTER, leaf_texture};
use super::stage::{Lens, Stage, Variation, standing};
use crate::types::Scene;
use glam::{DVec3, Vec3};
use std::f32::consts::TAU;

/// Distance between the trees before each is displaced at random, metres.
const SPACING: f64 = 5.6;

/// `size` trees of five kinds, of some 10,000 triangles each, along a winding path.
pub(super) fn grove(size: u32) -> Scene {
    let mut stage = Stage::new("grove");
    let columns = f64::from(size).sqrt().ceil();
    let half = columns * SPACING / 2.0;
    let grass = stage.paint("grass", [0.16, 0.22, 0.06]);
    let mut land = MeshBuilder::new();
    let reach = half as f32 + 25.0;
    // Of large groves, the quads of the ground stay as large as in those of 4000 trees, so that
    // trees stand on it.
    let cells = |least: u32, length: f32| least.max((2.0 * reach / length).ceil() as u32);
    land.surface([cells(160, 2.56); 2], |u, v| {
        ground(Vec3::new(v - 0.5, 0.0, u - 0.5) * 2.0 * reach)
    });
    stage.set(land, grass);
    let earth = stage.paint("trodden earth", [0.30, 0.21, 0.13]);
    let mut trail = MeshBuilder::new();
    trail.surface([12, cells(240, 1.71)], |u, v| {
        let z = (0.5 - v) * 2.0 * reach;
        let x = path(f64::from(z)) as f32 + (u - 0.5) * 2.4;
        // The edges of the trail are sunk into the grass.
        ground(Vec3::new(x, 0.0, z)) + Vec3::Y * (0.03 - 0.16 * (u - 0.5).powi(2))
    });
    stage.set(trail, earth);

    let bark = stage.paint("bark", [0.14, 0.09, 0.055]);
    let pale = stage.paint("birch bark", [0.50, 0.47, 0.42]);
    let leaf = |rgb: [f32; 3]| leaf_texture(Vec3::from(rgb));
    let oak = stage.cut_out("oak leaves", leaf([0.34, 0.46, 0.16]));
    let birch = stage.cut_out("birch leaves", leaf([0.62, 0.60, 0.20]));
    let maple = stage.cut_out("maple leaves", leaf([0.70, 0.36, 0.14]));
    let kinds = [
        Tree::grow(&mut stage, OAK, 1, bark, oak),
        Tree::grow(&mut stage, BIRCH, 2, pale, birch),
        Tree::grow(&mut stage, WINTER, 3, bark, oak),
        Tree::grow(&mut stage, OAK, 4, bark, maple),
        Tree::grow(&mut stage, BIRCH, 5, pale, birch),
    ];
    let mut vary = Variation::new(7);
    let at = |i: f64| (i + 0.5) * SPACING - half;
    for k in 0..size {
        let (column, row) = (f64::from(k) % columns, (f64::from(k) / columns).floor());
        let moved = |vary: &mut Variation| f64::from(vary.range(-0.33, 0.33)) * SPACING;
        let mut foot = DVec3::new(at(column) + moved(&mut vary), 0.0, at(row) + moved(&mut vary));
        // Trees keep clear of the path.
        let from_path = foot.x - path(foot.z);
        if from_path.abs() < 2.6 {
            foot.x += 2.6_f64.copysign(from_path) - from_path;
        }
        foot.y = f64::from(ground(foot.as_vec3()).y);
        let (yaw, scale) = (f64::from(vary.unit() * TAU), f64::from(vary.range(0.8, 1.2)));
        kinds[vary.pick(kinds.len())].place(&mut stage, foot, yaw, scale);
    }
    let stone = stage.paint("stone", [0.30, 0.29, 0.27]);
    let mut rock = MeshBuilder::new();
    rock.surface([20, 12], |u, v| {
        let (sin_v, cos_v) = (v.clamp(0.0, 1.0) * TAU / 2.0).sin_cos();
        let (sin_u, cos_u) = (-u * TAU).sin_cos();
        let bumps = 1.0 + 0.12 * (3.0 * u * TAU).sin() * sin_v + 0.08 * (9.0 * v).sin();
        Vec3::new(sin_v * cos_u, -0.6 * cos_v, 0.8 * sin_v * sin_u) * bumps
    });
    let rock = stage.shape(rock, stone);
    for _ in 0..size / 3 + 4 {
        let place = |vary: &mut Variation| f64::from(vary.range(-1.0, 1.0)) * half;
        let mut foot = DVec3::new(place(&mut vary), 0.0, place(&mut vary));
        foot.y = f64::from(ground(foot.as_vec3()).y);
        let yaw = f64::from(vary.unit() * TAU);
        stage.place(rock, standing(foot, yaw, f64::from(vary.range(0.12, 0.45))));
    }
    let eye_z = half - 2.0;
    let above_path = |z: f64, height: f64| {
        let p = DVec3::new(path(z), 0.0, z);
        p.with_y(f64::from(ground(p.as_vec3()).y) + height)
    };
    let lens = Lens { fov_y_deg: 50.0, near: 0.3, far: 2.2 * half + 45.0 };
    stage.camera("on the path", above_path(eye_z, 1.9), above_path(eye_z - 12.0, 1.9), lens);
    stage.sun(DVec3::new(0.85, -0.68, 0.35));
    stage.finish()
}

/// The x coordinate of the middle of the path.
fn path(z: f64) -> f64 {
    2.2 * (z / 11.0).sin()
}

/// The point of the rolling ground that lies above or below `p`.
fn ground(p: Vec3) -> Vec3 {
    let roll = 0.45 * (p.x / 9.0).sin() * (p.z / 12.0).cos() + 0.12 * (p.x / 3.1 + p.z / 4.3).sin();
    // The ground is flat along the path.
    let trodden = 1.0 - (-((p.x - path(f64::from(p.z)) as f32) / 2.0).powi(2)).exp();
    p.with_y(roll * (0.3 + 0.7 * trodden) - 0.12 * (1.0 - trodden))
}
