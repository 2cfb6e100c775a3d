use super::mesh_builder::MeshBuilder;
use super::plants::{BIRCH, OAK, Tree, leaf_texture};
use super::stage::{Lens, Paint, Shape, Stage, Variation, standing};
use crate::types::Scene;
use glam::{Affine3A, DVec3, Quat, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::f64::consts::FRAC_PI_2;

/// Average length of street front per house, metres.
const FRONT: f64 = 11.0;
/// Half the width of the carriageway, metres.
const KERB: f32 = 4.2;
/// Distance of the facades from the middle of the street, metres.
const FACADE: f64 = 7.4;

/// The largest number of pairs of houses along one street. More of them stand along streets side by
/// side, because meshes that extend over more than some thirty kilometres lose precision.
const IN_STREET: u32 = 3000;
/// Distance between neighbouring streets, metres.
const BLOCK: f64 = 110.0;

/// A street of `size` pairs of houses, of some 33,000 triangles each with what stands around, some
/// hundred metres deep, after the town of Wimmer et al.
/// 2004 (LiSPSM). Lamps, trees and wires are near, roofs and a church far away.
pub(super) fn town(size: u32) -> Scene {
    let mut stage = Stage::new("town");
    let streets = size.div_ceil(IN_STREET);
    let length = f64::from(size.div_ceil(streets)) * FRONT;
    let meadow = meadow(&mut stage, length as f32);
    street(&mut stage, length as f32);
    let kinds = houses(&mut stage);
    let mut vary = Variation::new(11);
    // Houses of a second row stand behind gardens, and their gables show between the houses of the
    // first.
    for (offset, is_first) in [(FACADE, true), (FACADE + 26.0, false)] {
        for side in [-1.0, 1.0] {
            let mut z = if is_first { 6.0 } else { 1.0 };
            while -z < length {
                let kind = &kinds[vary.pick(kinds.len())];
                let gap = if vary.unit() < 0.25 { f64::from(vary.range(1.5, 5.0)) } else { 0.0 };
                let width = f64::from(kind.width);
                let back = offset + f64::from(kind.depth) / 2.0 + f64::from(vary.range(0.0, 0.6));
                let foot = DVec3::new(side * back, 0.0, z - width / 2.0);
                for &part in &kind.parts {
                    stage.place(part, standing(foot, -side * FRAC_PI_2, 1.0));
                }
                z -= width + gap;
            }
        }
    }
    furniture(&mut stage, length, &mut vary);
    church(&mut stage, Vec3::new(0.0, 0.0, -length as f32 - 32.0));
    // All streets lie in the one meadow.
    stage.repeat(meadow, streets, DVec3::X * BLOCK);
    let lens = Lens { fov_y_deg: 48.0, near: 0.3, far: length + 130.0 };
    stage.camera("pavement", DVec3::new(-3.1, 2.3, 9.0), DVec3::new(0.9, 2.7, -14.0), lens);
    stage.sun(DVec3::new(-0.42, -0.66, 0.50));
    stage.finish()
}

/// The ground; returns the number of instances that it consists of.
fn meadow(stage: &mut Stage, length: f32) -> usize {
    let meadow = stage.paint("meadow", [0.19, 0.22, 0.08]);
    let reach = length / 2.0 + 90.0;
    stage.ground(Vec3::new(0.0, -0.02, -length / 2.0), reach, 1, meadow);
    stage.placed()
}

/// Carriageway, kerbs and markings.
fn street(stage: &mut Stage, length: f32) {
    let asphalt = stage.paint("cobbles", [0.20, 0.19, 0.185]);
    let slabs = stage.paint("slabs", [0.44, 0.42, 0.38]);
    let white = stage.paint("markings", [0.75, 0.75, 0.72]);
    let ends = (-length - 60.0, 50.0);
    let mut b = MeshBuilder::new();
    b.cuboid(Vec3::new(-KERB, -0.2, ends.0), Vec3::new(KERB, 0.0, ends.1), 1);
    stage.set(b, asphalt);
    let mut b = MeshBuilder::new();
    let outer = FACADE as f32 + 1.0;
    b.cuboid(Vec3::new(-outer, -0.2, ends.0), Vec3::new(-KERB, 0.14, ends.1), 1);
    b.cuboid(Vec3::new(KERB, -0.2, ends.0), Vec3::new(outer, 0.14, ends.1), 1);
    stage.set(b, slabs);
    let mut b = MeshBuilder::new();
    for k in 0..(length / 6.0) as u32 + 8 {
        let z = 30.0 - 6.0 * k as f32;
        b.sheet(Vec3::new(-0.07, 0.004, z - 3.0), Vec3::Z * 3.0, Vec3::X * 0.14, 1);
    }
    stage.set(b, white);
}

/// A kind of house; its front faces −z at half its depth.
struct House {
    width: f32,
    depth: f32,
    parts: Vec<Shape>,
}

fn houses(stage: &mut Stage) -> Vec<House> {
    let tiles = stage.paint("tiles", [0.38, 0.11, 0.055]);
    let slate = stage.paint("slate", [0.11, 0.12, 0.14]);
    let trim = stage.paint("trim", [0.66, 0.62, 0.54]);
    let glass = stage.paint("panes", [0.04, 0.06, 0.08]);
    let plans = [
        ("ochre", [0.60, 0.40, 0.16], 10.0, 9.0, 2, 1.0, tiles),
        ("rose", [0.58, 0.31, 0.23], 8.0, 10.0, 3, 1.2, slate),
        ("white", [0.70, 0.67, 0.60], 12.0, 9.5, 2, 0.8, tiles),
        ("brick", [0.34, 0.12, 0.07], 9.0, 10.0, 3, 0.9, slate),
        ("sage", [0.33, 0.38, 0.25], 7.0, 9.0, 2, 1.35, tiles),
        ("sand", [0.62, 0.52, 0.36], 13.0, 10.5, 4, 0.75, tiles),
    ];
    let build =
        |(name, rgb, width, depth, storeys, pitch, roof): (&str, _, f32, f32, u32, f32, Paint)| {
            let walls = stage.paint(name, rgb);
            let plan = Plan { width, depth, storeys, pitch };
            let parts = vec![
                stage.shape(plan.walls(), walls),
                stage.shape(plan.roof(), roof),
                stage.shape(plan.trim(), trim),
                stage.shape(plan.panes(), glass),
            ];
            House { width, depth, parts }
        };
    plans.map(build).into()
}

#[derive(Clone, Copy)]
struct Plan {
    width: f32,
    depth: f32,
    storeys: u32,
    /// Slope of the roof: its rise over its run.
    pitch: f32,
}

impl Plan {
    const STOREY: f32 = 3.0;

    fn eaves(self) -> f32 {
        self.storeys as f32 * Self::STOREY + 0.4
    }

    fn ridge(self) -> f32 {
        self.eaves() + self.pitch * self.depth / 2.0
    }

    /// Walls with gables, chimneys.
    fn walls(self) -> MeshBuilder {
        let (w, d) = (self.width / 2.0, self.depth / 2.0);
        let mut b = MeshBuilder::new();
        b.cuboid(Vec3::new(-w, 0.0, -d), Vec3::new(w, self.eaves(), d), 1);
        let gable = [
            Vec2::new(-d, self.eaves()),
            Vec2::new(d, self.eaves()),
            Vec2::new(0.0, self.ridge() - 0.05),
        ];
        for x in [-w + 0.1, w - 0.1] {
            // The rotation takes the plate's x axis to the depth of the house.
            let turned = Quat::from_rotation_y(FRAC_PI_2 as f32);
            b.plate(&gable, 0.1, Affine3A::from_rotation_translation(turned, Vec3::X * x));
        }
        for (x, z) in [(-w + 1.0, 0.9), (w - 1.3, -0.8)] {
            let bottom = self.eaves();
            let size = Vec3::new(0.7, self.ridge() - bottom + 0.9, 0.55);
            b.block(size, Affine3A::from_translation(Vec3::new(x, bottom, z)));
        }
        b
    }

    /// Two slopes with an overhang, a ridge, dormers, gutters, and chimney pots.
    fn roof(self) -> MeshBuilder {
        let (w, d) = (self.width / 2.0 + 0.25, self.depth / 2.0);
        let mut b = MeshBuilder::new();
        let run = d + 0.45;
        let slope = Vec2::new(d, self.pitch * d).normalize();
        let length = run / slope.x;
        for side in [-1.0_f32, 1.0] {
            // A slab that slopes down from the ridge; its local y axis points up the slope.
            let lean = Quat::from_rotation_x(-side * (FRAC_PI_2 as f32 - slope.y.atan2(slope.x)));
            let foot = Vec3::new(0.0, self.ridge() - self.pitch * run, side * run);
            b.block(
                Vec3::new(2.0 * w, length, 0.16),
                Affine3A::from_rotation_translation(lean, foot + Vec3::Y * 0.06),
            );
            let gutter = foot + Vec3::new(0.0, -0.02, side * 0.06);
            b.bar(gutter - Vec3::X * w, gutter + Vec3::X * w, 0.06, 8);
        }
        b.bar(
            Vec3::new(-w, self.ridge() + 0.1, 0.0),
            Vec3::new(w, self.ridge() + 0.1, 0.0),
            0.11,
            8,
        );
        for (x, z) in [(-w + 1.25, 0.9), (w - 1.55, -0.8)] {
            for dx in [-0.18, 0.18] {
                let mut pot = MeshBuilder::new();
                let profile = [(0.12, 0.0), (0.09, 0.35), (0.12, 0.4), (0.0, 0.4)];
                pot.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 10);
                let top = Vec3::new(x + dx, self.ridge() + 0.9, z);
                b.add(&pot, Affine3A::from_translation(top));
            }
        }
        for x in self.dormers() {
            let y = self.eaves() + self.pitch * 1.0;
            let front = -d + 0.55;
            let outline = [Vec2::new(-0.85, 1.15), Vec2::new(0.85, 1.15), Vec2::new(0.0, 1.75)];
            let back = 1.75 / self.pitch;
            let middle = Vec3::new(x, y - 0.3, front + back / 2.0 - 0.15);
            b.plate(&outline, back / 2.0, Affine3A::from_translation(middle));
        }
        b
    }

    fn dormers(self) -> impl Iterator<Item = f32> {
        let n = if self.pitch >= 0.9 { (self.width / 4.0) as u32 } else { 0 };
        (0..n).map(move |k| ((k as f32 + 0.5) / n as f32 - 0.5) * self.width)
    }

    /// Centres and sizes of the windows of the front (z < 0) and the back, and of the door.
    fn openings(self) -> Vec<(Vec3, Vec2)> {
        let columns = (self.width / 2.3) as u32;
        let door = columns / 2;
        let mut found = Vec::new();
        for side in [-1.0, 1.0] {
            for storey in 0..self.storeys {
                for k in 0..columns {
                    let x = ((k as f32 + 0.5) / columns as f32 - 0.5) * (self.width - 0.6);
                    let is_door = storey == 0 && k == door && side < 0.0;
                    let (y, size) = match is_door {
                        true => (1.2, Vec2::new(1.0, 2.3)),
                        false => (storey as f32 * Self::STOREY + 1.75, Vec2::new(0.95, 1.45)),
                    };
                    found.push((Vec3::new(x, y, side * self.depth / 2.0), size));
                }
            }
        }
        found
    }

    /// Frames, sills and string courses, and the cheeks of dormers.
    fn trim(self) -> MeshBuilder {
        let mut b = MeshBuilder::new();
        let mut block = |center: Vec3, size: Vec3| {
            b.cuboid(center - size / 2.0, center + size / 2.0, 1);
        };
        for (p, size) in self.openings() {
            let out = Vec3::Z * p.z.signum() * 0.06;
            for side in [-1.0, 1.0] {
                let beside = Vec3::X * side * (size.x / 2.0 + 0.05);
                block(p + out + beside, Vec3::new(0.10, size.y, 0.14));
                let above = Vec3::Y * side * (size.y / 2.0 + 0.05);
                block(p + out + above, Vec3::new(size.x + 0.2, 0.10, 0.16));
            }
            block(p + out * 0.7, Vec3::new(0.05, size.y, 0.06));
            let sill = p + out * 2.0 - Vec3::Y * (size.y / 2.0 + 0.13);
            block(sill, Vec3::new(size.x + 0.3, 0.07, 0.26));
        }
        let front = Vec3::new(self.width, 0.16, 0.14);
        for storey in 1..=self.storeys {
            let y = storey as f32 * Self::STOREY + 0.12;
            block(Vec3::new(0.0, y, -self.depth / 2.0 - 0.05), front);
        }
        for x in self.dormers() {
            let (y, z) = (self.eaves() + self.pitch * 0.9, -self.depth / 2.0 + 0.75);
            block(Vec3::new(x, y + 0.25, z + 0.6), Vec3::new(1.4, 1.4, 1.6));
        }
        b
    }

    fn panes(self) -> MeshBuilder {
        let mut b = MeshBuilder::new();
        for (p, size) in self.openings() {
            let across = Vec3::X * size.x * -p.z.signum();
            let corner = p + Vec3::Z * p.z.signum() * 0.012 - Vec3::Y * size.y / 2.0 - across / 2.0;
            b.sheet(corner, Vec3::Y * size.y, across, 1);
        }
        for x in self.dormers() {
            let (y, z) = (self.eaves() + self.pitch * 0.9, -self.depth / 2.0 - 0.06);
            b.sheet(Vec3::new(x + 0.45, y - 0.2, z), -Vec3::X * 0.9, Vec3::Y * 0.95, 1);
        }
        b
    }
}

/// Lamps, wires across the street, trees, bollards.
fn furniture(stage: &mut Stage, length: f64, vary: &mut Variation) {
    let iron = stage.paint("iron", [0.035, 0.04, 0.04]);
    let lamp = stage.shape(lamp(), iron);
    let wire = stage.shape(wire(), iron);
    let bollard = {
        let mut b = MeshBuilder::new();
        let profile = [
            (0.09, 0.0),
            (0.09, 0.1),
            (0.06, 0.14),
            (0.055, 0.8),
            (0.08, 0.84),
            (0.06, 0.95),
            (0.0, 1.0),
        ];
        b.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 14);
        stage.shape(b, iron)
    };
    let bark = stage.paint("bark", [0.14, 0.10, 0.06]);
    let green = stage.cut_out("lime leaves", leaf_texture(Vec3::new(0.40, 0.52, 0.18)));
    let pale = stage.cut_out("birch leaves", leaf_texture(Vec3::new(0.58, 0.60, 0.22)));
    let trees = [Tree::grow(stage, OAK, 21, bark, green), Tree::grow(stage, BIRCH, 22, bark, pale)];
    let kerb = f64::from(KERB);
    let mut z = 2.0;
    let mut k = 0;
    while -z < length {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let yaw = if side > 0.0 { 0.0 } else { std::f64::consts::PI };
        stage.place(lamp, standing(DVec3::new(side * (kerb + 0.5), 0.14, z), yaw, 1.0));
        let tree = DVec3::new(-side * (kerb + 0.9), 0.14, z - 5.0);
        let size = f64::from(vary.range(0.62, 0.85));
        trees[usize::from(vary.unit() < 0.35)].place(
            stage,
            tree,
            f64::from(vary.unit() * TAU),
            size,
        );
        if k % 3 == 1 {
            stage.place(wire, standing(DVec3::new(0.0, 6.2, z - 2.0), 0.0, 1.0));
        }
        for j in 0..6 {
            let foot = DVec3::new(side * (kerb + 0.25), 0.14, z - 3.0 - 1.6 * f64::from(j));
            stage.place(bollard, standing(foot, 0.0, 1.0));
        }
        for far_side in [-1.0, 1.0] {
            let x = far_side * (FACADE + f64::from(vary.range(14.0, 22.0)));
            let yaw = f64::from(vary.unit() * TAU);
            trees[vary.pick(2)].place(stage, DVec3::new(x, -0.02, z), yaw, 0.9);
        }
        z -= 15.0;
        k += 1;
    }
}

/// A cast-iron post with an arm towards −x and a glazed lantern.
fn lamp() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let profile = [
        (0.16, 0.0),
        (0.16, 0.2),
        (0.10, 0.3),
        (0.07, 0.8),
        (0.05, 0.9),
        (0.04, 4.6),
        (0.06, 4.65),
        (0.0, 4.75),
    ];
    b.lathe(&profile.map(|(r, y)| Vec2::new(r, y)), 16);
    let path: Vec<Vec3> = (0..=16)
        .map(|i| {
            let t = i as f32 / 16.0;
            Vec3::new(-1.1 * t, 4.5 + 0.35 * (t * PI).sin(), 0.0)
        })
        .collect();
    b.tube(&path, &[0.025; 17], 8);
    b.torus(Vec3::new(-0.35, 4.42, 0.0), Vec3::Z, 0.16, 0.012, [28, 6]);
    let mut lantern = MeshBuilder::new();
    let cage =
        [(0.0, -0.62), (0.10, -0.60), (0.17, -0.18), (0.24, -0.16), (0.06, 0.0), (0.0, 0.05)];
    lantern.lathe(&cage.map(|(r, y)| Vec2::new(r, y)), 6);
    b.add(&lantern, Affine3A::from_translation(Vec3::new(-1.1, 4.45, 0.0)));
    b
}

/// Bunting: a wire that sags across the street, with pennants.
fn wire() -> MeshBuilder {
    let mut b = MeshBuilder::new();
    let half = FACADE as f32 + 0.2;
    let at = |t: f32| Vec3::new((2.0 * t - 1.0) * half, 3.0 * (t - 0.5).powi(2) - 0.75, 0.0);
    let path: Vec<Vec3> = (0..=40).map(|i| at(i as f32 / 40.0)).collect();
    b.tube(&path, &[0.008; 41], 5);
    for k in 1..24 {
        let p = at(k as f32 / 24.0);
        let flag = [Vec2::new(-0.16, 0.0), Vec2::new(0.0, -0.42), Vec2::new(0.16, 0.0)];
        b.plate(&flag, 0.004, Affine3A::from_translation(p));
    }
    b
}

/// Nave, tower and spire at the end of the street.
fn church(stage: &mut Stage, foot: Vec3) {
    let stone = stage.paint("church stone", [0.46, 0.42, 0.35]);
    let copper = stage.paint("copper", [0.16, 0.34, 0.27]);
    let gold = stage.paint("gold", [0.65, 0.45, 0.10]);
    let at = |x: f32, y: f32, z: f32| Affine3A::from_translation(foot + Vec3::new(x, y, z));
    let mut b = MeshBuilder::new();
    b.block(Vec3::new(14.0, 11.0, 26.0), at(0.0, 0.0, -16.0));
    b.block(Vec3::new(7.0, 24.0, 7.0), at(0.0, 0.0, 0.0));
    b.block(Vec3::new(7.8, 0.5, 7.8), at(0.0, 24.0, 0.0));
    for x in [-1.0, 1.0] {
        for k in 0..5 {
            b.block(Vec3::new(1.2, 9.0, 1.0), at(x * 7.4, 0.0, -6.0 - 5.0 * k as f32));
        }
    }
    let gable = [Vec2::new(-7.0, 0.0), Vec2::new(7.0, 0.0), Vec2::new(0.0, 7.5)];
    b.plate(&gable, 12.9, at(0.0, 11.0, -16.0));
    stage.set(b, stone);
    let mut b = MeshBuilder::new();
    let mut spire = MeshBuilder::new();
    spire.lathe(&[(4.6, 0.0), (3.2, 2.5), (0.0, 18.0)].map(|(r, y)| Vec2::new(r, y)), 8);
    b.add(&spire, at(0.0, 24.5, 0.0));
    stage.set(b, copper);
    let mut b = MeshBuilder::new();
    let tip = foot + Vec3::Y * 42.3;
    b.bar(tip, tip + Vec3::Y * 2.6, 0.06, 8);
    b.bar(tip + Vec3::new(-0.7, 1.7, 0.0), tip + Vec3::new(0.7, 1.7, 0.0), 0.05, 8);
    b.ball(tip + Vec3::Y * 0.3, 0.3, 12);
    stage.set(b, gold);
}
