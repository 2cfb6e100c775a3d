//! Prefilters: the functions of the shaders are compared with those in Rust on tables of inputs,
//! and whole maps are compared with the visibility that follows from their definition.

use crate::{EYE, bench, camera, plan, sun};
use bytemuck::{Pod, Zeroable};
use umbrage::visibility::statistic::{Channels, Csm, Esm, Evsm, MAX_CHANNELS, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, Prefilter};
use umbrage::{Size, Technique, Warp};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, Frame, ShadowOptions, Shadows};

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Input {
    depths: [f32; 3],
    receiver: f32,
}

fn statistics() -> Vec<Statistic> {
    let csm = |m, a| Statistic::Csm(Csm::new(m, a, false, true).unwrap());
    vec![
        Statistic::Vsm(Vsm { leak: 0.1 }),
        Statistic::Esm(Esm::default()),
        Statistic::Evsm(Evsm { exponent: 20.0, ..Evsm::default() }),
        Statistic::Evsm(Evsm { components: 2, exponent: 20.0, leak: 0.0 }),
        Statistic::Msm(Msm::default()),
        csm(1, 0.0),
        csm(5, 1.0),
        Statistic::Csm(Csm::new(16, 0.0, true, false).unwrap()),
        csm(16, 0.5),
    ]
}

/// The mean of the statistics of three texels, as a filter computes it.
fn mean(statistic: &Statistic, depths: [f32; 3]) -> Channels {
    let mut mean = [0.0; MAX_CHANNELS];
    for depth in depths {
        mean.iter_mut().zip(statistic.encode(depth)).for_each(|(m, c)| *m += c / 3.0);
    }
    mean
}

#[needs(gpu)]
#[test]
fn every_statistic_is_that_of_rust() {
    let bench = bench();
    let noise = |i: u32| f64::from((i.wrapping_mul(2_654_435_761)) >> 8) / f64::from(1 << 24);
    let inputs: Vec<Input> = (0..4000)
        .map(|i| {
            let at = |k: u32| noise(i * 5 + k) as f32;
            // Receivers lie anywhere, including just in front of and just behind the casters.
            let depths = [at(0), at(1), 0.5 * at(0) + 0.5 * at(2)];
            let receiver = if i % 3 == 0 { depths[0] + 0.02 * (at(3) - 0.5) } else { at(3) };
            Input { depths, receiver }
        })
        .collect();
    for statistic in statistics() {
        let filter =
            Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(3), half: false });
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        let shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
        let textures = statistic.channels().div_ceil(4);
        let wgsl = format!(
            "struct Input {{ depths: vec3f, receiver: f32 }}
            @group(1) @binding(0) var<storage, read> inputs: array<Input>;
            @group(1) @binding(1) var<storage, read_write> out: array<f32>;
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3u) {{
                if (id.x < arrayLength(&inputs)) {{
                    let i = inputs[id.x];
                    let a = shadow_encode(i.depths.x);
                    let b = shadow_encode(i.depths.y);
                    let c = shadow_encode(i.depths.z);
                    var mean: array<vec4f, {textures}>;
                    for (var t = 0; t < {textures}; t++) {{
                        mean[t] = (a[t] + b[t] + c[t]) / 3.0;
                    }}
                    out[id.x] = clamp(shadow_reconstruct(mean, i.receiver), 0.0, 1.0);
                }}
            }}"
        );
        let outputs: Vec<f32> = bench.compute(&shadows, &wgsl, &inputs);
        // Values that are ill-conditioned in single precision depend on the last digits of their
        // inputs, so few differences are allowed. For four moments of only three depths, which are
        // nearly ill-conditioned, more are allowed.
        let mut far = 0;
        for (input, out) in inputs.iter().zip(outputs) {
            let channels = mean(&statistic, input.depths);
            let expected = statistic.visibility(&channels, input.receiver);
            far += usize::from((out - expected).abs() > 1e-4);
            assert!(
                (out - expected).abs() < 0.05,
                "{statistic}: {out} {expected} {:?}",
                input.depths
            );
        }
        let allowed = if matches!(statistic, Statistic::Msm(_)) {
            inputs.len() / 10
        } else {
            inputs.len() / 100
        };
        assert!(far <= allowed, "{statistic}: {far} of {}", inputs.len());
    }
}

/// Each map has one depth everywhere, drawn by the user's own pipeline, beside maps with another
/// depth. Whatever is encoded, blurred and interpolated, visibility must then be a step function of
/// depth in every texel, also at the borders of the map.
#[needs(gpu)]
#[test]
fn maps_of_one_depth_do_not_mix_with_their_neighbours() {
    let bench = bench();
    for (i, statistic) in statistics().into_iter().enumerate() {
        let half = i % 2 == 1;
        let filter = Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(9), half });
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        let mut shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
        let own = ["0.1", "0.9"].map(|depth| {
            bench.own_casters(
                &shadows,
                &format!(
                    "@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
                        let unused = shadow_caster(vec3f(0.0)).clip * 0.0;
                        return vec4f(f32((i << 1u) & 2u) * 2.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, {depth}, 1.0) + unused;
                    }}
                    @fragment fn fragment() {{}}"
                ),
                Some("fragment"),
            )
        });
        let partition = umbrage::Partition::slices(4);
        let technique = Technique {
            warp: Warp::Uniform,
            partition,
            size: Size::Budget(96 * 96),
            filter,
            ..Technique::default()
        };
        let mut plan = plan(&camera(EYE), &[sun()], &technique);
        // The statistics must cover the whole depth range of the maps, not only the range of
        // receivers.
        plan.maps.iter_mut().for_each(|m| m.slab = umbrage::Slab::default());
        let frame = Frame { plan: &plan, render_origin: plan.origin, casters: Casters::Moved };
        let mut encoder = bench.encoder();
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        prepared.encode(&mut encoder, &Default::default(), |map| {
            map.pass.set_pipeline(&own[map.redraw.index % 2]);
            map.pass.draw(0..3, 0..1);
        });
        bench.finish(encoder);
        #[derive(Clone, Copy, Pod, Zeroable)]
        #[repr(C)]
        struct At {
            texel: [f32; 2],
            map: u32,
            padding: u32,
        }
        let mut inputs = Vec::new();
        for (map, m) in plan.maps.iter().enumerate().filter(|(_, m)| !m.is_empty()) {
            let [w, h] = m.resolution.map(|n| n as f32);
            for u in [0.0, 0.01, 0.5, 0.99, 1.0] {
                for v in [0.0, 0.01, 0.5, 0.99, 1.0] {
                    inputs.push(At { texel: [u * w, v * h], map: map as u32, padding: 0 });
                }
            }
        }
        assert!(inputs.len() >= 50, "{}", inputs.len());
        let wgsl = "struct At { texel: vec2f, map: u32, padding: u32 }
            @group(1) @binding(0) var<storage, read> inputs: array<At>;
            @group(1) @binding(1) var<storage, read_write> out: array<vec2f>;
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3u) {
                if (id.x < arrayLength(&inputs)) {
                    let i = inputs[id.x];
                    let near = ShadowReceiver(i.texel, 0.05, vec2f(0.0), 0.0, vec3f(0.0), vec3f(0.0));
                    let middle = ShadowReceiver(i.texel, 0.5, vec2f(0.0), 0.0, vec3f(0.0), vec3f(0.0));
                    out[id.x] = vec2f(shadow_filtered(i.map, near), shadow_filtered(i.map, middle));
                }
            }";
        let outputs: Vec<[f32; 2]> = bench.compute(&shadows, wgsl, &inputs);
        let is_ramp = matches!(statistic, Statistic::Csm(csm) if csm.order() == 1);
        for (at, [near, middle]) in inputs.iter().zip(outputs) {
            assert!(near > 0.85, "{statistic} map {}, {:?}: {near}", at.map, at.texel);
            let dark = at.map % 2 == 0;
            let is_right = if dark { middle < 0.15 } else { middle > 0.85 };
            assert!(is_right || is_ramp, "{statistic} map {}, {:?}: {middle}", at.map, at.texel);
        }
    }
}
