use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Stage, Variation, standing};
use crate::types::Scene;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::TAU;

/// Distance between the frames, and along the fence, metres.
const SPACING: f64 = 3.4;

/// An iron fence before `size` rows of climbing frames, ladders and wire globes, after Fig. 9 of
/// Lloyd et al. 2006 (CSM theory). From the light, dozens of surfaces lie behind each other.
pub(super) fn fence(size: u32) -> Scene {
    let mut stage = Stage::new("fence");
    let columns = size.max(8);
    let (wide, deep) = (f64::from(columns) * SPACING / 2.0, f64::from(size) * SPACING);
    let gravel = stage.paint("gravel", [0.44, 0.41, 0.37]);
    let middle = Vec3::new(0.0, 0.0, -deep as f32 / 2.0);
    stage.ground(middle, wide.max(deep / 2.0) as f32 + 14.0, 1, gravel);

    let iron = stage.paint("iron", [0.045, 0.05, 0.055]);
    let panel = stage.shape(panel(SPACING as f32), iron);
    for k in 0..columns {
        let x = (f64::from(k) + 0.5) * SPACING - wide;
        stage.place(panel, standing(DVec3::new(x, 0.0, 0.0), 0.0, 1.0));
    }
    let paints = [
        stage.paint("red", [0.50, 0.06, 0.04]),
        stage.paint("blue", [0.05, 0.16, 0.42]),
        stage.paint("yellow", [0.66, 0.42, 0.04]),
        stage.paint("green", [0.06, 0.30, 0.12]),
    ];
    let shapes = [
        stage.shape(climbing_frame(), paints[0]),
        stage.shape(globe(), paints[1]),
        stage.shape(climbing_frame(), paints[2]),
        stage.shape(arch_ladder(), paints[3]),
    ];
    let mut vary = Variation::new(9);
    for row in 0..size {
        for column in 0..columns {
            let x = (f64::from(column) + 0.5) * SPACING - wide;
            let foot = DVec3::new(x, 0.0, -(f64::from(row) + 0.75) * SPACING);
            let shape = shapes[vary.pick(shapes.len())];
            stage.place(shape, standing(foot, f64::from(vary.range(-0.3, 0.3)), 1.0));
        }
    }
    let lens = Lens { fov_y_deg: 48.0, near: 0.25, far: deep + wide.min(12.0) + 40.0 };
    let eye = DVec3::new(-0.32 * wide.min(14.0), 1.75, 4.6);
    stage.camera("before the fence", eye, DVec3::new(0.05 * wide.min(14.0), 0.75, -1.5), lens);
    stage.sun(DVec3::new(-0.42, -0.62, 0.75));
    stage.finish()
}

/// Spears between two rails, with a post at the left end.
fn panel(width: f32) -> MeshBuilder {
    const SPEARS: u32 = 20;
    let mut b = MeshBuilder::new();
    let half = width / 2.0;
    for y in [0.18, 1.30] {
        b.cuboid(Vec3::new(-half, y - 0.02, -0.018), Vec3::new(half, y + 0.02, 0.018), 1);
    }
    b.cuboid(Vec3::new(-half - 0.05, 0.0, -0.05), Vec3::new(-half + 0.05, 1.72, 0.05), 1);
    b.ball(Vec3::new(-half, 1.80, 0.0), 0.09, 14);
    for k in 0..SPEARS {
        let x = ((k as f32 + 0.75) / SPEARS as f32 - 0.5) * width;
        b.bar(Vec3::new(x, 0.04, 0.0), Vec3::new(x, 1.48, 0.0), 0.011, 6);
        let mut tip = MeshBuilder::new();
        let profile = [(0.0, -0.06), (0.03, 0.0), (0.0, 0.13)].map(|(r, y)| Vec2::new(r, y));
        tip.lathe(&profile, 6);
        b.add(&tip, glam::Affine3A::from_translation(Vec3::new(x, 1.50, 0.0)));
        if k % 2 == 0 && k + 1 < SPEARS {
            let between = x + width / SPEARS as f32 / 2.0;
            b.torus(Vec3::new(between, 1.18, 0.0), Vec3::Z, 0.055, 0.008, [20, 6]);
        }
    }
    b
}

/// A lattice of tubes, three by four by three cells.
fn climbing_frame() -> MeshBuilder {
    const CELL: f32 = 0.66;
    let size = [3, 4, 3];
    let mut b = MeshBuilder::new();
    let at = |x: u32, y: u32, z: u32| {
        Vec3::new(x as f32 - 1.5, y as f32, z as f32 - 1.5) * CELL + Vec3::Y * 0.02
    };
    for i in 0..=size[0] {
        for k in 0..=size[2] {
            b.bar(at(i, 0, k), at(i, size[1], k), 0.022, 8);
            for j in 1..=size[1] {
                if i < size[0] {
                    b.bar(at(i, j, k), at(i + 1, j, k), 0.018, 8);
                }
                if k < size[2] {
                    b.bar(at(i, j, k), at(i, j, k + 1), 0.018, 8);
                }
            }
        }
    }
    b
}

/// A globe of meridians and parallels.
fn globe() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let center = Vec3::new(0.0, 1.3, 0.0);
    for k in 0..9 {
        let a = TAU / 2.0 * k as f32 / 9.0;
        b.torus(center, Vec3::new(a.cos(), 0.0, a.sin()), 1.2, 0.014, [72, 6]);
    }
    for latitude in [-0.9_f32, -0.45, 0.0, 0.45, 0.9] {
        let (sin, cos) = latitude.sin_cos();
        b.torus(center + Vec3::Y * 1.2 * sin, Vec3::Y, 1.2 * cos, 0.014, [72, 6]);
    }
    b.lathe(
        &[(0.3, 0.0), (0.3, 0.08), (0.05, 0.12), (0.05, 0.16)].map(|(r, y)| Vec2::new(r, y)),
        24,
    );
    b
}

/// Two ladders bent into arches, with rungs.
fn arch_ladder() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let arch = |t: f32, z: f32| {
        let a = t * TAU / 2.0;
        Vec3::new(-1.25 * a.cos(), 2.3 * a.sin(), z)
    };
    for z in [-0.9, -0.3, 0.3, 0.9] {
        let path: Vec<Vec3> = (0..=32).map(|i| arch(i as f32 / 32.0, z)).collect();
        b.tube(&path, &[0.024; 33], 8);
    }
    for i in 1..18 {
        let t = i as f32 / 18.0;
        b.bar(arch(t, -0.9), arch(t, -0.3), 0.015, 6);
        b.bar(arch(t, 0.3), arch(t, 0.9), 0.015, 6);
    }
    b
}
