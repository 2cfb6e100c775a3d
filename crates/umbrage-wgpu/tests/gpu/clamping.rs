//! Casters in front of a map's depth range, on devices that clamp depths and on devices that do
//! not.

use crate::{EYE, bench, camera, plan, sun};
use bytemuck::cast_slice;
use glam::{DAffine3, DVec3, Vec3};
use umbrage::{Partition, Size, Technique, Warp};
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

/// The pipeline that draws the casters.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drawn {
    Meshes,
    /// A vertex stage of the user's own.
    OwnVertex,
    /// A vertex stage and a fragment stage of the user's own.
    OwnFragment,
}

/// Casters of the user's own without a fragment stage, with one text for all devices. [`corner`]
/// adds the function `corner`.
const OWN_VERTEX: &str = "
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> ShadowCaster {
    return shadow_caster(corner(index));
}
";

/// The same casters with a fragment stage.
const OWN_FRAGMENT: &str = "
struct Own {
    @builtin(position) clip: vec4f,
    @location(3) shade: f32,
    @location(7) depth: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Own {
    let caster = shadow_caster(corner(index));
    return Own(caster.clip, 1.0, caster.depth);
}

@fragment
fn fragment(in: Own) -> @builtin(frag_depth) f32 {
    if (in.shade < 0.5) {
        discard;
    }
    return shadow_fragment_depth(in.depth);
}
";

/// The text of a WGSL function that returns the corners of these triangles in render space.
fn corner(triangles: &[Vec3], origin: DVec3) -> String {
    let corners = triangles.iter().map(|p| {
        let p = (p.as_dvec3() - origin).as_vec3();
        format!("vec3f({:?}, {:?}, {:?})", p.x, p.y, p.z)
    });
    let corners = corners.collect::<Vec<_>>().join(", ");
    let count = triangles.len();
    format!(
        "fn corner(index: u32) -> vec3f {{
            var corners = array<vec3f, {count}>({corners});
            return corners[index];
        }}"
    )
}

/// The depths of all maps over a plain with a slanted sheet that reaches from the ground to far
/// above everything else.
fn depths(emulated: bool, warp: Warp, drawn: Drawn) -> Vec<f32> {
    let bench = bench();
    assert!(bench.support.depth_clip_control, "the device can do both");
    let support = Support { depth_clip_control: !emulated, ..bench.support };
    let mut shadows = Shadows::new(&bench.device, support, &ShadowOptions::default()).unwrap();
    assert_eq!(shadows.caster_needs_fragment(), emulated);
    let layouts = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
    let meshes = MeshCasters::new(&bench.device, &shadows, MeshKind::Opaque, &layouts);
    let triangles: [Vec3; 6] = [
        Vec3::new(-40.0, 0.0, -60.0),
        Vec3::new(40.0, 0.0, -60.0),
        Vec3::new(0.0, 0.0, 60.0),
        Vec3::new(-6.0, 0.5, -3.0),
        Vec3::new(-2.0, 0.5, -9.0),
        Vec3::new(-70.0, 150.0, -25.0),
    ];
    let vertices = bench.buffer(cast_slice(&triangles), BufferUsages::VERTEX);
    let technique = Technique {
        warp,
        partition: Partition::slices(2),
        size: Size::Budget(256 * 256),
        ..Technique::default()
    };
    let plan = plan(&camera(EYE), &[sun()], &technique);
    let instance = bench.instance(CasterInstance::new(&DAffine3::IDENTITY, plan.origin));
    let corner = corner(&triangles, plan.origin);
    let own = |text: &str, fragment| bench.own_casters(&shadows, &(corner + text), fragment);
    let own = match drawn {
        Drawn::Meshes => None,
        Drawn::OwnVertex => Some(own(OWN_VERTEX, None)),
        Drawn::OwnFragment => Some(own(OWN_FRAGMENT, Some("fragment"))),
    };
    let frame = Frame { plan: &plan, render_origin: plan.origin, casters: Casters::Moved };
    let mut encoder = bench.encoder();
    let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
    let maps = prepared.encode(&mut encoder, &Timestamps::default(), |map| {
        map.pass.set_pipeline(own.as_ref().unwrap_or(meshes.pipeline()));
        map.pass.set_vertex_buffer(0, vertices.slice(..));
        map.pass.set_vertex_buffer(1, instance.slice(..));
        map.pass.draw(0..6, 0..1);
    });
    assert_eq!(maps, 2);
    bench.finish(encoder);
    // The depths must also be those that rays find.
    let (depths, width) = bench.depths(&shadows, 0);
    let [a, b, c] = [3, 4, 5].map(|i| triangles[i].as_dvec3());
    let normal = (b - a).cross(c - a);
    let mut hidden = 0;
    for (index, map) in plan.maps.iter().enumerate() {
        let place = shadows.place(index).unwrap();
        for j in (0..place.size[1]).step_by(7) {
            for i in (0..place.size[0]).step_by(7) {
                let size = glam::UVec2::from(place.size).as_dvec2();
                let texel = glam::DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
                // How far inside of the sheet a beam passes, metres, and the nearest depth on it.
                let nearest = |texel: glam::DVec2| {
                    let beam = map.beam(texel / size).unwrap();
                    let t = normal.dot(a - beam.origin) / normal.dot(beam.direction);
                    let hit = beam.origin + beam.direction * t;
                    let inside = [(a, b), (b, c), (c, a)]
                        .map(|(p, q)| normal.dot((q - p).cross(hit - p)) / normal.length())
                        .into_iter()
                        .fold(f64::INFINITY, f64::min);
                    let depth = |p: DVec3| map.project(p).unwrap().z;
                    let sheet = depth(hit).clamp(0.0, 1.0);
                    (inside, sheet.min(ground(&beam).map_or(1.0, depth)).clamp(0.0, 1.0))
                };
                let (inside, expected) = nearest(texel);
                if inside > 1.0 {
                    hidden += 1;
                    let at =
                        (place.origin[1] + j) as usize * width + (place.origin[0] + i) as usize;
                    let depth = f64::from(depths[at]);
                    // Devices round corners to a grid of 256 places a texel, so a sheet may lie
                    // that much beside its place.
                    let moved = [glam::DVec2::X, glam::DVec2::Y]
                        .map(|step| (nearest(texel + step / 256.0).1 - expected).abs());
                    let tolerance = 1e-5 + moved[0] + moved[1];
                    assert!((depth - expected).abs() < tolerance, "{depth} {expected} {tolerance}");
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

/// Depths that the device clamps and depths that the fragment stage clamps are equal up to the
/// rounding of interpolation in single precision.
fn agree(warp: Warp, drawn: Drawn) {
    let [native, emulated] = [false, true].map(|emulated| depths(emulated, warp, drawn));
    assert_eq!(native.len(), emulated.len());
    let clamped = native.iter().filter(|d| **d == 0.0).count();
    assert!(clamped > 50, "{warp:?} {drawn:?}: something is clamped: {clamped}");
    // Software interpolates in single precision. Hardware rounds the places at which it does.
    let tolerance = if bench().is_software { 2e-6 } else { 5e-5 };
    let differences: Vec<f32> = native.iter().zip(&emulated).map(|(a, b)| (a - b).abs()).collect();
    let far = differences.iter().filter(|d| **d > tolerance).count();
    let most = differences.iter().fold(0.0, |most: f32, d| most.max(*d));
    let text = format!("{warp:?} {drawn:?}: {far} of {}, up to {most}", native.len());
    assert!(far * 1000 <= native.len(), "{text}");
}

#[needs(gpu)]
#[test]
fn emulated_clamping_gives_the_same_depths() {
    for warp in [Warp::Uniform, Warp::Lispsm, Warp::Psm] {
        agree(warp, Drawn::Meshes);
    }
}

#[needs(gpu)]
#[test]
fn one_shader_of_the_users_own_is_right_on_all_devices() {
    for drawn in [Drawn::OwnVertex, Drawn::OwnFragment] {
        agree(Warp::Lispsm, drawn);
    }
}

/// A vertex stage that does not output the caster's depth is refused by devices that need the
/// depth, and by all devices in builds with debug assertions.
#[needs(gpu)]
#[test]
fn a_caster_without_its_depth_is_an_error() {
    let bench = bench();
    for depth_clip_control in [false, true] {
        let support = Support { depth_clip_control, ..bench.support };
        let shadows = Shadows::new(&bench.device, support, &ShadowOptions::default()).unwrap();
        let text = "@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
            return shadow_caster(vec3f(f32(i))).clip;
        }";
        let scope = bench.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let _pipeline = bench.own_casters(&shadows, text, None);
        let error = pollster::block_on(scope.pop()).map(|e| e.to_string());
        let is_refused = error.is_some_and(|e| e.contains("is not provided by the previous stage"));
        assert_eq!(is_refused, !depth_clip_control || cfg!(debug_assertions));
    }
}
