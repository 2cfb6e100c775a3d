//! A street of 100 m with what shadow maps find hard: thin poles, fences, steps, and long walls
//! that the light grazes.

use crate::common::{Builder, Paint};
use bevy::prelude::*;

/// The height of the pavements above the road, metres.
const KERB: f32 = 0.15;
/// Where pavements begin and houses stand, metres from the middle of the road.
const ROADSIDE: f32 = 4.0;
const HOUSES: f32 = 8.0;

/// Builds the street along z, from z = 20 m to z = -80 m.
pub(crate) fn street(mut builder: Builder) {
    let earth = builder.paint(0.42, 0.44, 0.34);
    let road = builder.paint(0.36, 0.36, 0.38);
    let stone = builder.paint(0.62, 0.60, 0.57);
    let metal = builder.paint(0.25, 0.27, 0.30);
    let wood = builder.paint(0.55, 0.42, 0.30);
    let leaves = builder.paint(0.35, 0.50, 0.25);
    let walls = [
        builder.paint(0.80, 0.74, 0.64),
        builder.paint(0.72, 0.52, 0.44),
        builder.paint(0.78, 0.78, 0.76),
        builder.paint(0.62, 0.68, 0.72),
    ];

    builder.block(&earth, Vec3::new(0.0, -1.1, -30.0), Vec3::new(300.0, 1.0, 300.0));
    builder.block(&road, Vec3::new(0.0, -0.5, -30.0), Vec3::new(2.0 * ROADSIDE, 0.5, 100.0));
    for side in [-1.0, 1.0] {
        let width = HOUSES - ROADSIDE;
        builder.block(
            &stone,
            Vec3::new(side * (ROADSIDE + width / 2.0), KERB - 0.5, -30.0),
            Vec3::new(width, 0.5, 100.0),
        );
        for place in 0..8 {
            // The two sides are not mirror images, as their shadows fall differently anyway.
            let z = 14.0 - 12.0 * place as f32 - if side > 0.0 { 3.0 } else { 0.0 };
            let wall = &walls[(place + (side > 0.0) as usize) % walls.len()];
            let height = 5.0 + (place * 5 % 4) as f32 * 2.2;
            house(&mut builder, wall, &stone, side, z, height);
            fence(&mut builder, &wood, side, z - 5.6, z - 1.2);
            lamp(&mut builder, &metal, side, z + 1.0);
            if place % 2 == 0 {
                tree(&mut builder, &wood, &leaves, Vec3::new(side * 5.2, KERB, z - 3.0));
            } else {
                bench(&mut builder, &wood, &metal, Vec3::new(side * 6.2, KERB, z - 3.4));
            }
        }
    }
    // Wires are thinner than the texels of any map but the first.
    for z in [8.0, -16.0, -40.0] {
        let height = Vec3::Y * 5.5;
        let [left, right] = [Vec3::new(-ROADSIDE, 0.0, z), Vec3::new(ROADSIDE, 0.0, z - 4.0)];
        for foot in [left, right] {
            builder.bar(&metal, foot, foot + height, 0.05);
        }
        builder.bar(&metal, left + height, right + height, 0.012);
    }
}

/// A house 8 m wide with window sills, a flat roof that juts out, and steps to its door.
fn house(builder: &mut Builder, wall: &Paint, stone: &Paint, side: f32, z: f32, height: f32) {
    let depth = 8.0;
    let middle = side * (HOUSES + 1.5 + depth / 2.0);
    let front = side * (HOUSES + 1.5);
    builder.block(wall, Vec3::new(middle, -0.1, z), Vec3::new(depth, height, 8.0));
    builder.block(stone, Vec3::new(middle, height - 0.1, z), Vec3::new(depth + 0.8, 0.25, 8.8));
    let storeys = (height / 2.4) as usize;
    for storey in 0..storeys {
        for window in [-2.6, 0.0, 2.6] {
            let sill = Vec3::new(front - side * 0.1, 1.0 + 2.4 * storey as f32, z + window);
            builder.block(stone, sill, Vec3::new(0.35, 0.08, 1.3));
            builder.block(stone, sill + Vec3::Y * 1.25, Vec3::new(0.25, 0.06, 1.3));
        }
    }
    for step in 0..4 {
        let rise = 0.16 * (4 - step) as f32;
        let tread = 0.3;
        builder.block(
            stone,
            Vec3::new(front - side * tread * (step as f32 + 0.5), -0.1, z + 1.3),
            Vec3::new(tread, rise + 0.1, 1.4),
        );
    }
}

/// Pickets 4 cm wide on two rails, along the back of the pavement.
fn fence(builder: &mut Builder, wood: &Paint, side: f32, from: f32, to: f32) {
    let x = side * (HOUSES - 0.1);
    let middle = (from + to) / 2.0;
    for height in [0.35, 0.8] {
        builder.block(wood, Vec3::new(x, KERB + height, middle), Vec3::new(0.03, 0.06, to - from));
    }
    let pickets = ((to - from) / 0.13) as usize;
    for picket in 0..=pickets {
        let z = from + (to - from) * picket as f32 / pickets as f32;
        builder.block(wood, Vec3::new(x - side * 0.03, KERB, z), Vec3::new(0.02, 1.1, 0.04));
    }
}

fn lamp(builder: &mut Builder, metal: &Paint, side: f32, z: f32) {
    let foot = Vec3::new(side * (ROADSIDE + 0.4), KERB, z);
    let top = foot + Vec3::Y * 4.2;
    let arm = top - Vec3::X * side * 0.9;
    builder.bar(metal, foot, top, 0.045);
    builder.bar(metal, top, arm, 0.025);
    builder.block(metal, arm - Vec3::Y * 0.12, Vec3::new(0.4, 0.1, 0.2));
}

fn tree(builder: &mut Builder, wood: &Paint, leaves: &Paint, foot: Vec3) {
    builder.bar(wood, foot, foot + Vec3::Y * 2.4, 0.11);
    // A golden angle between the balls keeps the crown irregular.
    for ball in 0..14 {
        let turn = 2.4 * ball as f32;
        let height = 2.2 + 0.14 * ball as f32;
        let reach = 0.9 - 0.05 * ball as f32;
        let centre = foot + Vec3::new(reach * turn.cos(), height, reach * turn.sin());
        builder.bar(wood, foot + Vec3::Y * (height - 0.5), centre, 0.02);
        builder.ball(leaves, centre, 0.34);
    }
}

fn bench(builder: &mut Builder, wood: &Paint, metal: &Paint, place: Vec3) {
    for slat in 0..4 {
        let x = 0.12 * (slat as f32 - 1.5);
        builder.block(wood, place + Vec3::new(x, 0.42, 0.0), Vec3::new(0.08, 0.03, 1.6));
    }
    for end in [-0.65, 0.65] {
        builder.block(metal, place + Vec3::Z * end, Vec3::new(0.4, 0.42, 0.04));
    }
}
