//! One huge mesh without repetition: an unfinished statue, after Michelangelo's St. Matthew, a scan
//! of 350 million triangles, in Lloyd et al. 2006 (W&P).

mod chisel;
mod clay;
mod form;
mod noise;
mod stone;

use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Stage};
use crate::types::Scene;
use glam::{DAffine3, DVec3, Vec3};

/// Height of the steps that the block stands on, metres.
const PLINTH: f32 = 1.2;

/// A statue whose stone has about `size` × 100 000 triangles: exactly 20 n², where n is the square
/// root of 5000 × `size`, rounded. A million of them takes 24 MB.
pub(super) fn colossus(size: u32) -> Scene {
    let mut stage = Stage::new("colossus");
    let paving = stage.paint("paving", [0.40, 0.37, 0.32]);
    stage.ground(Vec3::ZERO, 60.0, 1, paving);
    let granite = stage.paint("granite", [0.33, 0.31, 0.30]);
    let mut steps = MeshBuilder::new();
    for k in 0..3 {
        let (half, rise) = (4.6 - 0.6 * k as f32, PLINTH / 3.0);
        let low = Vec3::new(-half, rise * k as f32, -half - 0.4);
        steps.cuboid(low, Vec3::new(half, rise * (k + 1) as f32, half), 1);
    }
    stage.set(steps, granite);
    let marble = stage.paint("marble", [0.70, 0.66, 0.58]);
    let quads = f64::from(size) * 5000.0;
    let stone = stage.mesh(|material| stone::stone(quads.sqrt().round() as u32, material), marble);
    // Erosion lifts the block's underside here and there, so it is set a little into the plinth.
    let middle = f64::from(PLINTH + form::HALF_HEIGHT) - 0.06;
    stage.place(stone, DAffine3::from_translation(DVec3::Y * middle));

    let lens = Lens { fov_y_deg: 42.0, near: 0.5, far: 140.0 };
    let eye = DVec3::new(-3.6, 3.4, 14.2);
    stage.camera("before the plinth", eye, DVec3::new(0.1, 5.7, 0.0), lens);
    // Low and from the side, so that the sun rakes over the front.
    stage.sun(DVec3::new(0.84, -0.46, -0.20));
    stage.finish()
}
