//! Ornate objects, evenly spaced on a plane, after the 25 dragons of Lloyd et al. 2006 (CSM
//! theory).

use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Shape, Stage, Variation, standing};
use crate::types::Scene;
use glam::{Affine3A, DVec3, Mat3, Quat, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Distance between neighbours, metres.
const SPACING: f64 = 3.2;
const PLINTH_HEIGHT: f32 = 0.9;

/// `size` × `size` statues of four kinds, of some 26,000 triangles each with its plinth.
pub(super) fn statues(size: u32) -> Scene {
    let mut stage = Stage::new("statues");
    let half = f64::from(size) * SPACING / 2.0;
    let paving = stage.paint("paving", [0.46, 0.42, 0.36]);
    stage.ground(Vec3::ZERO, half as f32 + 6.0, 1, paving);

    let stone = stage.paint("sandstone", [0.50, 0.40, 0.28]);
    let plinth = stage.shape(plinth(), stone);
    let marble = stage.paint("marble", [0.74, 0.71, 0.65]);
    let verdigris = stage.paint("verdigris", [0.13, 0.30, 0.24]);
    let terracotta = stage.paint("terracotta", [0.50, 0.17, 0.08]);
    let gilt = stage.paint("gilt", [0.62, 0.43, 0.12]);
    let kinds: [Shape; 4] = [
        stage.shape(rope_knot(), terracotta),
        stage.shape(woven_vase(), marble),
        stage.shape(flame(), verdigris),
        stage.shape(armillary(), gilt),
    ];
    let mut vary = Variation::new(25);
    for row in 0..size {
        for column in 0..size {
            let at = |i: u32| (f64::from(i) + 0.5) * SPACING - half;
            let foot = DVec3::new(at(column), 0.0, at(row));
            let quarter = f64::from(vary.unit() * TAU);
            stage.place(plinth, standing(foot, 0.0, 1.0));
            // Statues of one kind stand along diagonals, so that no two neighbours are alike.
            let kind = kinds[((column + 2 * row) % 4) as usize];
            let top = foot + DVec3::Y * f64::from(PLINTH_HEIGHT);
            stage.place(kind, standing(top, quarter, 1.0));
        }
    }
    let lens = Lens { fov_y_deg: 38.0, near: 0.3, far: 2.2 * half + 30.0 };
    let span = half.min(8.0);
    let eye = DVec3::new(-0.62 * span, 3.0, half + 2.9);
    stage.camera("among", eye, DVec3::new(0.10 * span, 0.75, half - span), lens);
    stage.sun(DVec3::new(0.82, -0.62, 0.30));
    stage.finish()
}

/// A square foot, a turned shaft with mouldings, and a round cap.
fn plinth() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    b.cuboid(Vec3::new(-0.52, 0.0, -0.52), Vec3::new(0.52, 0.12, 0.52), 1);
    let profile = [
        (0.46, 0.12),
        (0.48, 0.17),
        (0.44, 0.23),
        (0.36, 0.26),
        (0.33, 0.32),
        (0.31, 0.60),
        (0.33, 0.66),
        (0.40, 0.70),
        (0.46, 0.73),
        (0.46, 0.80),
        (0.42, 0.84),
        (0.42, 0.90),
        (0.0, 0.90),
    ];
    b.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 48);
    b
}

/// A trefoil knot of three-stranded rope, standing on its edge.
fn rope_knot() -> MeshBuilder {
    // At this height, the outer one of its three lobes touches the plinth.
    const CENTER: Vec3 = Vec3::new(0.0, 0.80, 0.0);
    let middle = |v: f32| {
        let a = (v + 0.25) * TAU;
        let ring = 0.46 - 0.22 * (3.0 * a).sin();
        CENTER + Vec3::new(ring * (2.0 * a).sin(), ring * (2.0 * a).cos(), 0.26 * (3.0 * a).cos())
    };
    let mut b = MeshBuilder::new();
    b.surface([36, 420], |u, v| {
        let forward = (middle(v + 1e-3) - middle(v - 1e-3)).normalize();
        let outward = (middle(v) - CENTER).normalize();
        let side = forward.cross(outward).normalize();
        let outward = side.cross(forward);
        let a = u * TAU;
        // The strands wind 20 times around the rope before it closes.
        let radius = 0.105 * (1.0 + 0.22 * (3.0 * a + 20.0 * TAU * v).cos());
        middle(v) + (outward * a.cos() - side * a.sin()) * radius
    });
    b
}

/// Strands that cross each other in the shape of a vase, with more holes than wall.
fn woven_vase() -> MeshBuilder {
    const STRANDS: u32 = 6;
    let profile = |v: f32| {
        0.16 + 0.34 * (PI * v.powf(0.8)).sin().powi(2) + 0.12 * ((v - 0.8) * 5.0).clamp(0.0, 1.0)
    };
    let mut b = MeshBuilder::new();
    for k in 0..STRANDS {
        for hand in [1.0, -1.0] {
            let path: Vec<Vec3> = (0..=90)
                .map(|i| {
                    let v = i as f32 / 90.0;
                    let a = TAU * (k as f32 / STRANDS as f32 + 0.55 * hand * v);
                    // Where strands meet, one passes over the other.
                    let weave = 0.022 * hand * (TAU * STRANDS as f32 * 1.1 * v).cos();
                    let r = profile(v) + weave;
                    Vec3::new(r * a.cos(), 0.03 + 1.45 * v, r * a.sin())
                })
                .collect();
            let radii: Vec<f32> = (0..=90).map(|i| 0.034 - 0.012 * i as f32 / 90.0).collect();
            b.tube(&path, &radii, 10);
        }
    }
    b.torus(Vec3::new(0.0, 0.04, 0.0), Vec3::Y, profile(0.0), 0.05, [96, 14]);
    b.torus(Vec3::new(0.0, 1.48, 0.0), Vec3::Y, profile(1.0), 0.045, [96, 14]);
    b
}

/// A tapering, twisted body with thin fins, ending in a curl.
fn flame() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    b.surface([112, 130], |u, v| {
        let v = v.clamp(0.0, 1.0);
        let a = u * TAU;
        let body = 0.30 * (1.0 - v).powf(0.8) * (1.0 + 0.45 * (2.5 * TAU * v).sin() * (1.0 - v));
        let fin = (0.5 + 0.5 * (7.0 * a).cos()).powi(3);
        let ripple = 0.10 * (22.0 * TAU * v + 7.0 * a).sin();
        let r = body * (0.62 + 0.75 * fin + ripple * fin) + 0.004 * (1.0 - v);
        let turn = -a + 2.2 * TAU * v * v;
        let bend = 0.16 * v * v;
        Vec3::new(
            r * turn.cos() + bend * (5.0 * v).cos(),
            1.8 * v,
            r * turn.sin() + bend * (5.0 * v).sin(),
        )
    });
    b
}

/// An armillary sphere: thin rings about a thin axis.
fn armillary() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let center = Vec3::new(0.0, 0.86, 0.0);
    b.lathe(
        &[(0.24, 0.0), (0.24, 0.04), (0.07, 0.08), (0.05, 0.2), (0.08, 0.25), (0.0, 0.27)]
            .map(|(r, y)| Vec2::new(r, y)),
        36,
    );
    let axis = Quat::from_rotation_z(0.41) * Vec3::Y;
    for (normal, radius) in [
        (Vec3::X, 0.60),
        (axis, 0.56),
        (axis.any_orthonormal_vector(), 0.53),
        (axis.cross(axis.any_orthonormal_vector()), 0.53),
        (Quat::from_axis_angle(Vec3::X, 0.41) * axis, 0.50),
    ] {
        b.torus(center, normal, radius, 0.014, [120, 8]);
    }
    for share in [-0.4_f32, 0.4] {
        let radius = 0.56 * (1.0 - share * share).sqrt();
        b.torus(center + axis * 0.56 * share, axis, radius, 0.010, [96, 8]);
    }
    b.ball(center, 0.10, 24);
    b.bar(center - axis * 0.74, center + axis * 0.74, 0.011, 8);
    let mut point = MeshBuilder::new();
    point.lathe(&[(0.0, -0.02), (0.05, 0.0), (0.0, 0.14)].map(|(r, y)| Vec2::new(r, y)), 16);
    let tip = Mat3::from_quat(Quat::from_rotation_arc(Vec3::Y, axis));
    b.add(&point, Affine3A::from_mat3_translation(tip, center + axis * 0.74));
    b
}
