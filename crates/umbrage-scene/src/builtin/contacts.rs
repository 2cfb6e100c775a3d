use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Stage};
use crate::types::Scene;
use glam::{DVec3, Vec3};

/// Half the width of the ground, metres.
const HALF: f32 = 6.0;
/// Height of the low square, metres.
const LOW: f32 = 0.45;
/// Height of the high square, metres.
const HIGH: f32 = 1.35;
/// Height of the raised end of the board, metres.
const SLANT: f32 = 1.5;

/// Two squares over a plane, one high and one low, and a board that rises from the plane, which it
/// touches. After Fig. 6 of Annen et al. 2007, which shows how near an occluder may be to a
/// receiver and still cast a full shadow.
pub(super) fn contacts(size: u32) -> Scene {
    let mut stage = Stage::new("contacts");
    let ground = stage.paint("ground", [0.62, 0.60, 0.55]);
    stage.ground(Vec3::ZERO, HALF, size, ground);
    let mut sheet = |name: &str, rgb: [f32; 3], corner: Vec3, u: Vec3, v: Vec3| {
        let paint = stage.paint(name, rgb);
        let mut b = MeshBuilder::new();
        b.sheet(corner, u, v, size);
        stage.set(b, paint);
    };
    let (deep, wide) = (Vec3::Z * 1.2, Vec3::X * 1.2);
    sheet("high square", [0.08, 0.20, 0.42], Vec3::new(-2.6, HIGH, -2.2), deep, wide);
    sheet("low square", [0.10, 0.34, 0.16], Vec3::new(-2.6, LOW, 0.4), deep, wide);
    let board = Vec3::new(0.0, -SLANT, 3.4);
    sheet("board", [0.48, 0.16, 0.06], Vec3::new(-0.2, SLANT, -1.8), board, wide);
    let lens = Lens { fov_y_deg: 40.0, near: 0.5, far: 30.0 };
    stage.camera("above", DVec3::new(3.6, 6.6, 4.6), DVec3::new(0.1, 0.1, -0.1), lens);
    stage.sun(DVec3::new(0.75, -1.0, 0.0));
    stage.finish()
}
