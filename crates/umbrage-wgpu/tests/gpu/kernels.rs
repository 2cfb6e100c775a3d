//! Compares the functions of the shaders with those in Rust on tables of inputs.

use crate::device::Bench;
use crate::{EYE, bench, camera, lights, plan, scene};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};
use umbrage::visibility::statistic::{Csm, Statistic, Vsm};
use umbrage::visibility::{
    Blur, Filter, LightSize, Pattern, Prefilter, Width, slack, texel_coordinates, visibility,
};
use umbrage::{Bounds, Faces, Plan, Planner, Technique};
use umbrage_testing::needs;
use umbrage_wgpu::{
    Bias, Casters, Comparison, Frame, Layout, LookupBuffers, ShadowOptions, Shadows, Timestamps,
};

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Point {
    position: Vec3,
    light: u32,
    normal: Vec3,
    map: u32,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Receiver {
    texel: Vec2,
    slope: Vec2,
    depth: f32,
    slack: f32,
    weight: f32,
    padding: f32,
}

const POINT: &str = "
struct Point { position: vec3f, light: u32, normal: vec3f, map: u32 }
@group(1) @binding(0) var<storage, read> points: array<Point>;
";

/// Pseudo-random numbers: the hash of O'Neill's PCG output (Jarzynski and Olano 2020), which WGSL
/// computes too. [`unit`] scales it to 0 to 1.
fn hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn unit(x: u32) -> f64 {
    f64::from(hash(x) >> 8) / f64::from(1 << 24)
}

const HASH: &str = "
fn pcg(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
";

/// Points at which receivers may lie, inside and outside the view, with normals in all directions.
fn points(plan: &Plan, count: usize) -> Vec<(DVec3, DVec3)> {
    let camera = camera(EYE);
    let is_receiver = |p: DVec3| p.clamp(scene().min, scene().max) == p;
    (0..)
        .map(|i| {
            let at = |k: u32| unit(i * 8 + k);
            let pixel = glam::DVec2::new(at(0) * 700.0 - 30.0, at(1) * 420.0 - 30.0);
            let depth = 0.1 * (at(2) * (700f64).ln()).exp();
            let normal = DVec3::new(at(3) - 0.5, at(4) - 0.5, at(5) - 0.5);
            (plan.origin + camera.ray(pixel).at(depth), normal)
        })
        .filter(|&(p, _)| is_receiver(p))
        .take(count)
        .collect()
}

fn technique(text: &str) -> Technique {
    text.parse().unwrap()
}

const TECHNIQUES: [&str; 9] = [
    "unfocused@256",
    "uniform+z7@256",
    "uniform+z4@256",
    "uniform(stable)+z2@256",
    "psm@256",
    "lispsm+face@256",
    "tsm+z3(fitted,overlap=0.3)@256",
    "adaptive(area)+z2@256",
    "lambda=3@256",
];

/// Shadows whose texels hold pseudo-random depths, in the gutters too.
fn random_depths(
    bench: &Bench,
    shadow_options: &ShadowOptions,
    plan: &Plan,
    origin: DVec3,
) -> Shadows {
    let mut shadows = Shadows::new(&bench.device, bench.support, shadow_options).unwrap();
    let pipeline = bench.own_casters(
        &shadows,
        &format!(
            "{HASH}
            @vertex
            fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
                // The map's matrix is not needed, but is there.
                let unused = shadow_caster(vec3f(0.0)).clip * 0.0;
                return vec4f(f32((i << 1u) & 2u) * 2.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, 0.0, 1.0) + unused;
            }}
            @fragment
            fn fragment(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {{
                return f32(pcg(u32(at.x) + 16384u * u32(at.y)) >> 8u) / 16777216.0;
            }}"
        ),
        Some("fragment"),
    );
    let frame = Frame { plan, render_origin: origin, casters: Casters::Moved };
    let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
    let mut encoder = bench.encoder();
    prepared.encode(&mut encoder, &Timestamps::default(), |map| {
        map.pass.set_pipeline(&pipeline);
        map.pass.draw(0..3, 0..1);
    });
    bench.finish(encoder);
    shadows
}

/// The visibility that the Rust functions find from the same depths.
fn expected(shadows: &Shadows, plan: &Plan, light: usize, p: DVec3, n: DVec3) -> f64 {
    let filter = shadows.options().filter;
    let (mut sum, mut shares) = (0.0, 0.0);
    for (index, share) in plan.lookup(light, p) {
        let map = &plan.maps[index];
        let place = shadows.place(index).unwrap();
        let value = plan.receiver(index, p, n).map_or(1.0, |r| {
            visibility(map, filter, &r, |i, j| {
                let [x, y] = [(place.origin[0], i), (place.origin[1], j)]
                    .map(|(o, i)| o.checked_add_signed(i).unwrap());
                unit(x + 16384 * y) as f32
            })
        });
        sum += share * f64::from(value);
        shares += share;
    }
    plan.faded(p, if shares > 0.0 { sum / shares } else { 1.0 })
}

const VISIBILITY: &str = "
@group(1) @binding(1) var<storage, read_write> out: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&points)) {
        let p = points[id.x];
        out[id.x] = shadow_visibility(p.light, p.position, p.normal);
    }
}";

/// Pseudo-random depths make every texel count, so a lookup that reads a neighbouring texel or
/// confuses rows, layers, gutters or weights fails. The only differences allowed are at points that
/// lie on the border of a texel up to single precision.
fn agrees(shadow_options: &ShadowOptions, technique: &Technique, origin: Option<DVec3>) {
    agrees_to(2e-3, 500, shadow_options, technique, origin);
}

/// Requires the visibility of the shader and that of Rust to agree to a `tolerance`, except at one
/// point in `one_in`.
fn agrees_to(
    tolerance: f64,
    one_in: usize,
    shadow_options: &ShadowOptions,
    technique: &Technique,
    origin: Option<DVec3>,
) {
    let technique = &Technique { filter: shadow_options.filter, ..*technique };
    let bench = bench();
    let lights = lights();
    let lights = match technique.filter {
        // The size of a sun is an angle, and that of a lamp is a length.
        Filter::Pcss { light: LightSize::Degrees(_), .. } => &lights[..1],
        Filter::Pcss { light: LightSize::Metres(_), .. } => &lights[1..],
        _ if technique.partition.faces == Faces::Whole => &lights[..],
        _ => &lights[..1],
    };
    let mut planner = Planner::new();
    planner.set_fade(if shadow_options.fades { 0.9 } else { 0.0 }).unwrap();
    let bounds = Bounds::of_scene(scene());
    let plan = planner.plan(&camera(EYE), lights, &bounds, technique).unwrap();
    let origin = origin.unwrap_or(plan.origin);
    let shadows = random_depths(&bench, shadow_options, plan, origin);
    let table = points(plan, 3000);
    let mut served = 0;
    let mut wrong = 0;
    for light in 0..lights.len() {
        let inputs: Vec<Point> = table
            .iter()
            .map(|&(p, n)| Point {
                position: (p - origin).as_vec3(),
                light: light as u32,
                normal: n.as_vec3(),
                map: 0,
            })
            .collect();
        let outputs: Vec<f32> = bench.compute(&shadows, &format!("{POINT}{VISIBILITY}"), &inputs);
        for (&(p, n), out) in table.iter().zip(outputs) {
            served += usize::from(plan.lookup(light, p).next().is_some());
            let expected = expected(&shadows, plan, light, p, n);
            assert!((0.0..=1.0).contains(&out), "{p}: {out}");
            wrong += usize::from((f64::from(out) - expected).abs() > tolerance);
        }
    }
    assert!(served > 800, "{technique}: {served}");
    assert!(wrong * one_in <= served, "{shadow_options:?} {technique}: {wrong} of {served}");
}

#[needs(gpu)]
#[test]
fn every_technique_is_looked_up_as_in_rust() {
    for text in TECHNIQUES {
        agrees(&ShadowOptions::default(), &technique(text), None);
    }
}

#[needs(gpu)]
#[test]
fn every_filter_and_layout_is_looked_up_as_in_rust() {
    let technique = technique("lispsm+z2@256");
    for layout in [Layout::Atlas, Layout::Layers] {
        for n in [1, 2, 3, 5, 8, 15] {
            let filter = Filter::pcf(n).unwrap();
            agrees(&ShadowOptions { filter, layout, ..Default::default() }, &technique, None);
        }
        let hard = ShadowOptions { layout, ..Default::default() };
        agrees(&ShadowOptions { buffers: LookupBuffers::Storage, ..hard }, &technique, None);
        agrees(&hard, &technique, None);
        agrees(&ShadowOptions { fades: true, ..hard }, &technique, None);
        // A single texel has one depth to compare with, so both kinds of comparison must agree.
        agrees(&ShadowOptions { comparison: Comparison::Hardware, ..hard }, &technique, None);
    }
}

/// Filters with widths in pixels and metres, and soft shadows. Of the many texels that a point is
/// compared with, one may lie on a border.
#[needs(gpu)]
#[test]
fn comparisons_over_a_width_are_those_of_rust() {
    let technique = technique("lispsm+z2@256");
    let widths = [Width::Pixels(20.0), Width::Metres(0.7)];
    let spread = widths.into_iter().flat_map(|width| {
        [Pattern::Grid, Pattern::Poisson].map(|pattern| Filter::Spread { n: 4, width, pattern })
    });
    let soft = [LightSize::Degrees(2.9), LightSize::Metres(0.05)];
    let soft = soft.map(|light| Filter::Pcss { n: 4, light });
    for filter in spread.chain(soft) {
        let shadow_options = ShadowOptions { filter, ..Default::default() };
        agrees_to(1.5 / 16.0, 200, &shadow_options, &technique, None);
    }
}

/// Statistics in several mip levels, sampled at several places. The tolerance is that of single
/// precision, or for 8 bits, of what is stored or of a texture unit's weights, that of their
/// resolution.
#[needs(gpu)]
#[test]
fn statistics_over_a_width_are_those_of_rust() {
    let technique = technique("lispsm+z2@256");
    let csm = Statistic::Csm(Csm::new(8, 0.0, false, true).unwrap());
    let of_weights = if bench().is_software { 1e-3 } else { 2e-2 };
    for (statistic, tolerance) in [(Statistic::Vsm(Vsm::default()), of_weights), (csm, 1e-2)] {
        for width in [Width::Pixels(12.0), Width::Metres(0.7)] {
            for half in [false, true] {
                let blur = Blur::Width(width);
                let filter = Filter::Prefiltered(Prefilter { statistic, blur, half });
                let shadow_options = ShadowOptions { filter, ..Default::default() };
                agrees_to(tolerance, 200, &shadow_options, &technique, None);
            }
        }
    }
}

#[needs(gpu)]
#[test]
fn render_space_may_begin_anywhere_near() {
    let technique = technique("lispsm+z2@256");
    agrees(&ShadowOptions::default(), &technique, Some(DVec3::ZERO));
    agrees(&ShadowOptions::default(), &technique, Some(EYE + DVec3::new(-20.0, 3.0, 11.0)));
}

/// On receivers that face the light, all texels are compared with one depth. Bilinear comparisons
/// must then give the same visibility as single ones, up to the precision of about eight bits that
/// texture units have for weights.
#[needs(gpu)]
#[test]
fn hardware_comparisons_weigh_as_single_ones_do() {
    let bench = bench();
    let towards = -DVec3::new(0.5, -1.0, 0.25);
    for n in [1, 2, 3, 4, 7] {
        let filter = Filter::pcf(n).unwrap();
        let technique = Technique { filter, ..technique("uniform@256") };
        let plan = plan(&camera(EYE), &lights()[..1], &technique);
        let shadow_options =
            ShadowOptions { filter, comparison: Comparison::Hardware, ..Default::default() };
        let shadows = random_depths(&bench, &shadow_options, &plan, plan.origin);
        let table = points(&plan, 2000);
        let inputs: Vec<Point> = table
            .iter()
            .map(|&(p, _)| Point {
                position: (p - plan.origin).as_vec3(),
                light: 0,
                normal: towards.as_vec3(),
                map: 0,
            })
            .collect();
        let outputs: Vec<f32> = bench.compute(&shadows, &format!("{POINT}{VISIBILITY}"), &inputs);
        let mut wrong = 0;
        for (&(p, _), out) in table.iter().zip(outputs) {
            let expected = expected(&shadows, &plan, 0, p, towards);
            wrong += usize::from((f64::from(out) - expected).abs() > 0.02);
        }
        assert!(wrong <= 4, "pcf{n}: {wrong}");
    }
}

const RECEIVER: &str = "
struct Out { texel: vec2f, slope: vec2f, depth: f32, slack: f32, weight: f32, padding: f32 }
@group(1) @binding(1) var<storage, read_write> out: array<Out>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&points)) {
        let p = points[id.x];
        let r = shadow_receiver(p.map, p.position, p.normal);
        out[id.x] = Out(r.texel, r.slope, r.depth, r.slack, shadow_weight(p.map, p.position), 0.0);
    }
}";

#[needs(gpu)]
#[test]
fn receivers_and_weights_are_those_of_rust() {
    let bench = bench();
    let extra = Bias { texels: 0.25, metres: 0.01 };
    for text in TECHNIQUES {
        let plan = plan(&camera(EYE), &lights()[..2], &technique(text));
        let mut shadows =
            Shadows::new(&bench.device, bench.support, &ShadowOptions::default()).unwrap();
        let mut compared = 0;
        for bias in [Bias::default(), extra] {
            shadows.set_bias(bias).unwrap();
            let frame =
                Frame { plan: &plan, render_origin: plan.origin, casters: Casters::Unmoved };
            drop(shadows.prepare(&bench.device, &bench.queue, &frame).unwrap());
            // Shaders do not see empty maps.
            let full = plan.maps.iter().enumerate().filter(|(_, m)| !m.is_empty());
            for (index, (place, map)) in full.enumerate() {
                let table = points(&plan, 400);
                let inputs: Vec<Point> = table
                    .iter()
                    .map(|&(p, n)| Point {
                        position: (p - plan.origin).as_vec3(),
                        light: 0,
                        normal: n.as_vec3(),
                        map: index as u32,
                    })
                    .collect();
                let outputs: Vec<Receiver> =
                    bench.compute(&shadows, &format!("{POINT}{RECEIVER}"), &inputs);
                for (&(p, n), out) in table.iter().zip(outputs) {
                    let weight = map.weight(p);
                    let r = plan.receiver(place, p, n).filter(|_| weight > 0.0);
                    let Some(r) = r else { continue };
                    compared += 1;
                    let size = glam::UVec2::from(map.resolution).as_dvec2();
                    let texel = texel_coordinates(map, r.st);
                    assert!((out.texel.as_dvec2() - texel).length() < 2e-3, "{out:?} {texel}");
                    assert!((f64::from(out.depth) - r.depth).abs() < 2e-6, "{out:?} {r:?}");
                    assert!((f64::from(out.weight) - weight).abs() < 2e-3, "{out:?} {weight}");
                    let slope =
                        (r.slope / size).clamp(glam::DVec2::splat(-8.0), glam::DVec2::splat(8.0));
                    let error = (out.slope.as_dvec2() - slope).length();
                    assert!(error < 2e-3 * slope.length() + 1e-5, "{out:?} {slope}");
                    let metre = 1e-2 * depth_per_metre(map, p);
                    let more = if bias == extra { 0.5 * r.half_texel + metre } else { 0.0 };
                    let slack = slack(map, &r) + more;
                    let error = (f64::from(out.slack) - slack).abs();
                    assert!(error < 1e-3 * slack + 1e-6, "{out:?} {slack}");
                }
            }
        }
        assert!(compared > 300, "{text}: {compared}");
    }
}

/// The growth of depth per metre along the beam, by finite differences.
fn depth_per_metre(map: &umbrage::ShadowMap, p: DVec3) -> f64 {
    let st = map.project(p).unwrap().truncate();
    let direction = map.beam(st).unwrap().direction;
    let depth = |t: f64| map.project(p + direction * t).unwrap().z;
    (depth(1e-4) - depth(-1e-4)) / 2e-4
}
