//! Casters before a map's depths, with and without the device's help.

use crate::{EYE, bench, camera, plan, sun};
use bytemuck::cast_slice;
use glam::{DAffine3, DVec3, Vec3};
use umbrage::{Options, Partition, Size, Warp};
use umbrage_testing::needs;
use umbrage_wgpu::{
    CasterInstance, Casters, Frame, MeshCasters, MeshKind, ShadowOptions, Shadows, Support,
    Timestamps,
};
use wgpu::BufferUsages;

const POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: 12,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3],
};

/// The depths of all maps over a plain, with a slanted sheet that reaches from the ground far above everything.
fn depths(emulated: bool, warp: Warp) -> Vec<f32> {
    let bench = bench();
    assert!(bench.support.depth_clip_control, "the device can do both");
    let support = Support { depth_clip_control: !emulated, ..bench.support };
    let mut shadows = Shadows::new(&bench.device, support, &ShadowOptions::default()).unwrap();
    let layouts = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
    let casters = MeshCasters::new(&bench.device, &shadows, MeshKind::Opaque, &layouts);
    let triangles: [Vec3; 6] = [
        Vec3::new(-40.0, 0.0, -60.0),
        Vec3::new(40.0, 0.0, -60.0),
        Vec3::new(0.0, 0.0, 60.0),
        Vec3::new(-6.0, 0.5, -3.0),
        Vec3::new(-2.0, 0.5, -9.0),
        Vec3::new(-70.0, 150.0, -25.0),
    ];
    let vertices = bench.buffer(cast_slice(&triangles), BufferUsages::VERTEX);
    let options = Options {
        warp,
        partition: Partition::slices(2),
        size: Size::Budget(256 * 256),
        ..Options::default()
    };
    let plan = plan(&camera(EYE), &[sun()], &options);
    let instance = bench.instance(CasterInstance::new(&DAffine3::IDENTITY, plan.origin));
    let frame = Frame { plan: &plan, render_origin: plan.origin, casters: Casters::Moved };
    let mut encoder = bench.encoder();
    let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
    let drawn = prepared.encode(&mut encoder, &Timestamps::default(), |map| {
        map.pass.set_pipeline(casters.pipeline());
        map.pass.set_vertex_buffer(0, vertices.slice(..));
        map.pass.set_vertex_buffer(1, instance.slice(..));
        map.pass.draw(0..6, 0..1);
    });
    assert_eq!(drawn, 2);
    bench.finish(encoder);
    // And they are where rays find them.
    let (depths, width) = bench.depths(&shadows, 0);
    let [a, b, c] = [3, 4, 5].map(|i| triangles[i].as_dvec3());
    let normal = (b - a).cross(c - a);
    let mut hidden = 0;
    for (index, map) in plan.maps.iter().enumerate() {
        let place = shadows.place(index).unwrap();
        for j in (0..place.size[1]).step_by(7) {
            for i in (0..place.size[0]).step_by(7) {
                let st = glam::DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5)
                    / glam::UVec2::from(place.size).as_dvec2();
                let beam = map.beam(st).unwrap();
                let t = normal.dot(a - beam.origin) / normal.dot(beam.direction);
                let hit = beam.origin + beam.direction * t;
                let inside = [(a, b), (b, c), (c, a)]
                    .map(|(p, q)| normal.dot((q - p).cross(hit - p)) / normal.length())
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                let texel = (place.origin[1] + j) as usize * width + (place.origin[0] + i) as usize;
                if inside > 1.0 {
                    let expected = map.project(hit).unwrap().z.clamp(0.0, 1.0);
                    let depth = f64::from(depths[texel]);
                    hidden += 1;
                    let plain = ground(&beam);
                    let nearest = expected.min(plain.map_or(1.0, |p| map.project(p).unwrap().z));
                    assert!((depth - nearest.clamp(0.0, 1.0)).abs() < 1e-4, "{depth} {nearest}");
                }
            }
        }
    }
    assert!(hidden > 30, "{hidden}");
    depths
}

fn ground(beam: &umbrage::Beam) -> Option<DVec3> {
    let t = -beam.origin.y / beam.direction.y;
    Some(beam.origin + beam.direction * t).filter(|p| p.x.abs() < 10.0)
}

#[needs(gpu)]
#[test]
fn emulated_clamping_gives_the_same_depths() {
    for warp in [Warp::Uniform, Warp::Lispsm, Warp::Psm] {
        let [native, emulated] = [false, true].map(|emulated| depths(emulated, warp));
        assert_eq!(native.len(), emulated.len());
        let clamped = native.iter().filter(|d| **d == 0.0).count();
        assert!(clamped > 50, "{warp:?}: something is clamped: {clamped}");
        let far = native.iter().zip(&emulated).filter(|(a, b)| (**a - **b).abs() > 2e-6).count();
        assert!(far * 1000 <= native.len(), "{warp:?}: {far} of {}", native.len());
    }
}
