//! A market hall at night under many lamps, for lights that share a plan.

use super::mesh_builder::MeshBuilder;
use super::stage::{Lens, Shape, Stage, Variation, standing};
use crate::types::Scene;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::TAU;
use umbrage::{PointLight, SpotLight};

/// Length of a bay along the hall, metres.
const BAY: f64 = 6.0;
/// Half the width of the hall, metres.
const HALF: f64 = 8.0;
/// Height of the lamps' rims, metres.
const RIMS: f64 = 3.6;
/// Height of the beams from which everything hangs, metres.
const BEAMS: f64 = 5.0;
/// Height of the lanterns' flames, metres.
const FLAMES: f64 = 2.9;

/// A hall of `size` bays. In each bay eight lamps, which are spot lights, hang over stalls, and a
/// lantern, a point light, hangs over the aisle.
pub(super) fn lamps(size: u32) -> Scene {
    let mut stage = Stage::new("lamps");
    let length = f64::from(size) * BAY;
    hall(&mut stage, length as f32);
    let furniture = Furniture::new(&mut stage);
    let mut vary = Variation::new(5);
    for bay in 0..size {
        furniture.place(&mut stage, bay, &mut vary);
    }
    let far = length + 2.0 * BAY;
    let lens = Lens { fov_y_deg: 52.0, near: 0.2, far };
    stage.camera("aisle", DVec3::new(0.7, 1.9, 1.5), DVec3::new(-0.5, 1.2, -6.0), lens);
    stage.finish()
}

/// Floor, side walls, and beams across.
fn hall(stage: &mut Stage, length: f32) {
    let (half, end) = (HALF as f32, 3.0);
    let flags = stage.paint("flags", [0.46, 0.42, 0.36]);
    let mut floor = MeshBuilder::new();
    floor.sheet(
        Vec3::new(-half, 0.0, -length - end),
        Vec3::Z * (length + 2.0 * end),
        Vec3::X * 2.0 * half,
        1,
    );
    stage.set(floor, flags);
    let plaster = stage.paint("plaster", [0.60, 0.55, 0.47]);
    let mut walls = MeshBuilder::new();
    for x in [-half, half - 0.2] {
        let high = Vec3::new(x + 0.2, BEAMS as f32, end);
        walls.cuboid(Vec3::new(x, 0.0, -length - end), high, 1);
    }
    stage.set(walls, plaster);
}

/// What stands and hangs in each bay.
struct Furniture {
    beam: Shape,
    column: Shape,
    stall: Shape,
    goods: [Shape; 3],
    lamp: Shape,
    lantern: Shape,
}

impl Furniture {
    fn new(stage: &mut Stage) -> Self {
        let oak = stage.paint("oak", [0.22, 0.13, 0.07]);
        let pine = stage.paint("pine", [0.44, 0.31, 0.17]);
        let stone = stage.paint("stone", [0.52, 0.48, 0.42]);
        let clay = stage.paint("clay", [0.46, 0.20, 0.10]);
        let glaze = stage.paint("glaze", [0.10, 0.27, 0.30]);
        let iron = stage.paint("iron", [0.09, 0.09, 0.10]);
        let mut beam = MeshBuilder::new();
        let (half, top) = (HALF as f32, BEAMS as f32);
        beam.cuboid(Vec3::new(-half, top, -0.12), Vec3::new(half, top + 0.3, 0.12), 1);
        Self {
            beam: stage.shape(beam, oak),
            column: stage.shape(column(), stone),
            stall: stage.shape(stall(), pine),
            goods: [
                stage.shape(jar(), clay),
                stage.shape(bowl(), glaze),
                stage.shape(crate_of_slats(), pine),
            ],
            lamp: stage.shape(lamp(), iron),
            lantern: stage.shape(lantern(), iron),
        }
    }

    fn place(&self, stage: &mut Stage, bay: u32, vary: &mut Variation) {
        let begin = -f64::from(bay) * BAY;
        let middle = begin - 0.5 * BAY;
        stage.place(self.beam, standing(DVec3::Z * middle, 0.0, 1.0));
        for side in [-1.0, 1.0] {
            stage.place(self.column, standing(DVec3::new(side * 4.4, 0.0, middle), 0.0, 1.0));
            for (row, along) in [(0u32, 0.25), (1, 0.75)] {
                let z = begin - along * BAY;
                for (column, x) in [(0u32, 2.6), (1, 6.2)] {
                    let foot = DVec3::new(side * x, 0.0, z);
                    stage.place(self.stall, standing(foot, 0.0, 1.0));
                    for k in 0..4 {
                        let shape = self.goods[vary.pick(self.goods.len())];
                        let on = DVec3::new(
                            f64::from(vary.range(-0.35, 0.35)),
                            0.86,
                            f64::from(k) * 0.5 - 0.75 + f64::from(vary.range(-0.05, 0.05)),
                        );
                        let yaw = f64::from(vary.unit() * TAU);
                        stage.place(shape, standing(foot + on, yaw, 0.7));
                    }
                    let rim = DVec3::new(side * x, RIMS, z);
                    stage.place(self.lamp, standing(rim, 0.0, 1.0));
                    let index = 8 * bay + 4 * row + 2 * column + u32::from(side > 0.0);
                    let lean = f64::from(vary.range(-0.25, 0.25));
                    stage.lamp(
                        &format!("lamp{index}"),
                        SpotLight {
                            position: rim - DVec3::Y * 0.03,
                            direction: DVec3::new(-0.3 * side, -1.0, lean),
                            half_angle_rad: 0.75,
                            near: 0.1,
                            range: 6.5,
                        },
                    );
                }
            }
        }
        let flame = DVec3::new(0.0, FLAMES, middle);
        stage.place(self.lantern, standing(flame, 0.0, 1.0));
        let light = PointLight { position: flame, near: 0.05, range: 8.0 };
        stage.flame(&format!("lantern{bay}"), light);
    }
}

fn lathe(profile: &[(f32, f32)], sides: u32) -> MeshBuilder {
    let mut b = MeshBuilder::new();
    b.lathe(&profile.iter().map(|&(r, y)| Vec2::new(r, y)).collect::<Vec<_>>(), sides);
    b
}

fn column() -> MeshBuilder {
    let top = BEAMS as f32;
    let mut b = lathe(&[(0.24, 0.16), (0.19, 0.3), (0.17, top - 0.4), (0.24, top - 0.16)], 24);
    b.cuboid(Vec3::new(-0.26, 0.0, -0.26), Vec3::new(0.26, 0.16, 0.26), 1);
    b.cuboid(Vec3::new(-0.26, top - 0.16, -0.26), Vec3::new(0.26, top, 0.26), 1);
    b
}

/// A table of boards with gaps, on four legs.
fn stall() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    for k in 0..5 {
        let x = -0.5 + 0.2 * k as f32;
        b.cuboid(Vec3::new(x, 0.82, -1.1), Vec3::new(x + 0.17, 0.86, 1.1), 1);
    }
    for (x, z) in [(-0.45, -1.0), (0.45, -1.0), (-0.45, 1.0), (0.45, 1.0)] {
        b.bar(Vec3::new(x, 0.0, z), Vec3::new(x, 0.82, z), 0.035, 8);
    }
    b
}

fn jar() -> MeshBuilder {
    lathe(&[(0.0, 0.0), (0.12, 0.0), (0.22, 0.2), (0.19, 0.36), (0.1, 0.46), (0.13, 0.5)], 20)
}

fn bowl() -> MeshBuilder {
    lathe(&[(0.0, 0.0), (0.1, 0.0), (0.08, 0.04), (0.24, 0.16), (0.21, 0.16), (0.0, 0.05)], 20)
}

fn crate_of_slats() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    for k in 0..3 {
        let y = 0.02 + 0.11 * k as f32;
        b.cuboid(Vec3::new(-0.24, y, -0.17), Vec3::new(0.24, y + 0.08, -0.15), 1);
        b.cuboid(Vec3::new(-0.24, y, 0.15), Vec3::new(0.24, y + 0.08, 0.17), 1);
        b.cuboid(Vec3::new(-0.24, y, -0.15), Vec3::new(-0.22, y + 0.08, 0.15), 1);
        b.cuboid(Vec3::new(0.22, y, -0.15), Vec3::new(0.24, y + 0.08, 0.15), 1);
    }
    b
}

/// A shade around the origin's upper side, on a cord.
fn lamp() -> MeshBuilder {
    let mut b = lathe(&[(0.26, 0.0), (0.24, 0.08), (0.08, 0.22), (0.03, 0.28)], 20);
    b.bar(Vec3::Y * 0.26, Vec3::Y * (BEAMS - RIMS) as f32, 0.01, 6);
    b
}

/// A cage of bars around the origin, on a chain.
fn lantern() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    for k in 0..6 {
        let (sin, cos) = (TAU * k as f32 / 6.0).sin_cos();
        let at = |r: f32, y: f32| Vec3::new(r * cos, y, r * sin);
        b.bar(at(0.12, -0.18), at(0.16, 0.16), 0.007, 6);
        b.bar(at(0.16, 0.16), Vec3::Y * 0.3, 0.007, 6);
    }
    b.torus(Vec3::Y * -0.18, Vec3::Y, 0.12, 0.009, [24, 6]);
    b.torus(Vec3::Y * 0.16, Vec3::Y, 0.16, 0.009, [24, 6]);
    b.bar(Vec3::Y * 0.3, Vec3::Y * (BEAMS - FLAMES) as f32, 0.008, 6);
    b
}
