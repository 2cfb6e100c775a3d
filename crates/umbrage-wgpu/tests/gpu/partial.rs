//! Where only parts of maps are drawn again, the maps are the same as if all of them were, bit by
//! bit.

use crate::cookbook::kitchen::box_at;
use crate::device::Bench;
use crate::{EYE, bench, camera, lights, plan, sun};
use bytemuck::cast_slice;
use glam::{DAffine3, DQuat, DVec3};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Plan, Technique};
use umbrage_testing::needs;
use umbrage_wgpu::{
    CasterInstance, Casters, Error, Frame, Layout, MeshCasters, MeshKind, Redraw, ShadowOptions,
    Shadows, Support, Timestamps,
};
use wgpu::BufferUsages;

/// Pseudorandom numbers in 0 .. 1.
pub(crate) struct Random(pub(crate) u32);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }

    pub(crate) fn within(&mut self, aabb: Aabb) -> DVec3 {
        aabb.min + aabb.size() * DVec3::from_array([(); 3].map(|()| self.next()))
    }

    pub(crate) fn placed(&mut self) -> DAffine3 {
        let axis = DVec3::new(self.next(), self.next() + 0.1, self.next()).normalize();
        let turn = DQuat::from_axis_angle(axis, 6.0 * self.next());
        let scale = DVec3::splat(0.2 + self.next());
        DAffine3::from_scale_rotation_translation(scale, turn, self.within(crate::scene()))
    }
}

/// Boxes as casters, in any orientation.
struct Boxes {
    positions: wgpu::Buffer,
    places: Vec<DAffine3>,
}

fn bounds(place: &DAffine3) -> Aabb {
    let corners = box_at(DVec3::ZERO);
    Aabb::around(corners.into_iter().map(|p| place.transform_point3(p.as_dvec3())))
}

impl Boxes {
    fn new(bench: &Bench, random: &mut Random) -> Self {
        let mesh = box_at(DVec3::ZERO);
        let positions = bench.buffer(cast_slice(&mesh), BufferUsages::VERTEX);
        Self { positions, places: (0..30).map(|_| random.placed()).collect() }
    }

    /// Draws what is stale, and returns the rectangles that were drawn, each with the number of
    /// casters in it.
    fn draw(
        &self,
        bench: &Bench,
        shadows: &mut Shadows,
        plan: &Plan,
        casters: Casters<'_>,
    ) -> Vec<(umbrage::Place, usize)> {
        const POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
            array_stride: 12,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3],
        };
        let layouts = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
        let pipeline = MeshCasters::new(&bench.device, shadows, MeshKind::Opaque, &layouts);
        let instances: Vec<CasterInstance> =
            self.places.iter().map(|m| CasterInstance::new(m, plan.origin)).collect();
        let instances = bench.buffer(cast_slice(&instances), BufferUsages::VERTEX);
        let frame = Frame { plan, render_origin: plan.origin, casters };
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        let told: Vec<_> = prepared.stale().map(|r: Redraw<'_>| (r.index, r.rectangle)).collect();
        let (mut drawn, mut rectangles) = (Vec::new(), Vec::new());
        let mut encoder = bench.encoder();
        prepared.encode(&mut encoder, &Timestamps::default(), |map| {
            map.pass.set_pipeline(pipeline.pipeline());
            map.pass.set_vertex_buffer(0, self.positions.slice(..));
            map.pass.set_vertex_buffer(1, instances.slice(..));
            let mut count = 0;
            for (place, i) in self.places.iter().zip(0..) {
                if map.may_cast(bounds(place)) {
                    map.pass.draw(0..36, i..i + 1);
                    count += 1;
                }
            }
            drawn.push((map.redraw.index, map.redraw.rectangle));
            rectangles.push((map.redraw.rectangle, count));
        });
        bench.finish(encoder);
        assert_eq!(drawn, told, "what is told ahead is what is drawn");
        rectangles
    }
}

/// All bits of the depth texture and of the prefiltered maps.
pub(crate) fn bits(bench: &Bench, shadows: &Shadows) -> Vec<u32> {
    let texture = shadows.depth_texture();
    let layers = texture.depth_or_array_layers();
    let depths = (0..layers).flat_map(|layer| bench.depths(shadows, layer).0);
    let mut bits: Vec<u32> = depths.map(f32::to_bits).collect();
    if let Filter::Prefiltered(prefilter) = shadows.options().filter {
        let textures = prefilter.statistic.channels().div_ceil(4) as u32;
        let first = prefilter.first_level();
        let mut texels: Vec<[u32; 4]> = Vec::new();
        for level in 0..prefilter.levels() {
            let size = [texture.width(), texture.height()].map(|n| n >> first >> level);
            for layer in 0..layers * textures {
                let row = |y| (0..size[0]).map(move |x| [x, y, layer, level]);
                texels.extend((0..size[1]).flat_map(row));
            }
        }
        let wgsl = "
            @group(1) @binding(0) var<storage, read> texels: array<vec4u>;
            @group(1) @binding(1) var<storage, read_write> out: array<vec4u>;
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) n: vec3u) {
                let i = id.x;
                if (i < arrayLength(&texels)) {
                    let t = texels[i];
                    out[i] = bitcast<vec4u>(textureLoad(shadow_statistics, t.xy, t.z, t.w));
                }
            }";
        for some in texels.chunks(1 << 20) {
            bits.extend(bench.compute::<_, [u32; 4]>(shadows, wgsl, some).into_iter().flatten());
        }
    }
    bits
}

fn check(technique: &str, layout: Layout, support: Support, seed: u32) {
    let bench = bench();
    let technique: Technique = technique.parse().unwrap();
    let options = ShadowOptions { filter: technique.filter, layout, ..ShadowOptions::default() };
    let [mut partly, mut wholly] =
        [(); 2].map(|()| Shadows::new(&bench.device, support, &options).unwrap());
    let mut random = Random(seed);
    let mut boxes = Boxes::new(&bench, &mut random);
    let mut eye = EYE;
    let mut current = plan(&camera(eye), &lights(), &technique);
    boxes.draw(&bench, &mut partly, &current, Casters::Unmoved);
    let (mut parts, mut fewer) = (0, 0);
    for frame in 0..9 {
        let mut moved = vec![Aabb::EMPTY];
        for _ in 0..[1, 0, 2, 12, 1][frame % 5] {
            let which = (random.next() * boxes.places.len() as f64) as usize;
            moved.push(bounds(&boxes.places[which]));
            let turn =
                DAffine3::from_translation(random.within(Aabb::new(-DVec3::ONE, DVec3::ONE)));
            boxes.places[which] =
                if frame == 2 { random.placed() } else { turn * boxes.places[which] };
            moved.push(bounds(&boxes.places[which]));
        }
        match frame {
            // Behind the spot light, far away, and around everything.
            1 => moved.push(Aabb::around([DVec3::new(1.0, 9.0, 2.0), DVec3::new(0.0, 12.0, 3.0)])),
            3 => moved.push(Aabb::around([DVec3::splat(-1e9)])),
            5 => moved.push(Aabb::new(DVec3::splat(-1e12), DVec3::splat(1e12))),
            // The camera moves, too.
            7 => {
                eye += DVec3::X * 0.3;
                current = plan(&camera(eye), &lights(), &technique);
            }
            _ => {}
        }
        let drawn = boxes.draw(&bench, &mut partly, &current, Casters::MovedIn(&moved));
        let all = boxes.draw(&bench, &mut wholly, &current, Casters::Moved);
        for (rectangle, count) in &drawn {
            parts += usize::from(!all.iter().any(|(whole, _)| whole == rectangle));
            let around = all.iter().find(|(whole, _)| {
                rectangle.layer == whole.layer
                    && (0..2).all(|i| {
                        let end = |p: &umbrage::Place| p.origin[i] + p.size[i];
                        whole.origin[i] <= rectangle.origin[i] && end(rectangle) <= end(whole)
                    })
            });
            fewer += usize::from(around.expect("a map around it").1 > *count);
        }
        let [a, b] = [&partly, &wholly].map(|shadows| bits(&bench, shadows));
        let differing = a.iter().zip(&b).filter(|(a, b)| a != b).count();
        assert_eq!((a.len(), differing), (b.len(), 0), "{technique} {layout:?}, frame {frame}");
    }
    assert!(parts >= 10 && fewer >= 10, "{technique} {layout:?}: {parts} parts, {fewer} culled");
}

#[needs(gpu)]
#[test]
fn depths_are_those_of_a_full_redraw() {
    let support = bench().support;
    let clamping = Support { depth_clip_control: false, ..support };
    for (seed, technique) in
        (1..).zip(["adaptive+z3:hard@200", "uniform:pcf5@150", "lispsm+z2@128"])
    {
        check(technique, Layout::Atlas, support, seed);
        check(technique, Layout::Layers, support, seed + 10);
        check(technique, Layout::Atlas, clamping, seed + 20);
    }
}

#[needs(gpu)]
#[test]
fn statistics_are_those_of_a_full_redraw() {
    let support = bench().support;
    let techniques = [
        "adaptive+z2:vsm(blur=1)@200",
        "uniform+z2:csm4(blur=9)@200",
        "lispsm:msm(blur=7,half)@300",
        "adaptive+z2:evsm(blur=0.1m)@300",
        "uniform:csm4(blur=2px,half)@300",
    ];
    for (seed, technique) in (40..).zip(techniques) {
        check(technique, Layout::Atlas, support, seed);
        check(technique, Layout::Layers, support, seed + 10);
    }
}

/// What was told while frames were not encoded is drawn with the next frame that is.
#[needs(gpu)]
#[test]
fn parts_of_frames_that_are_not_encoded_are_drawn_the_next_time() {
    let bench = bench();
    let technique: Technique = "adaptive+z2:hard@128".parse().unwrap();
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    let [mut partly, mut wholly] =
        [(); 2].map(|()| Shadows::new(&bench.device, bench.support, &options).unwrap());
    let mut boxes = Boxes::new(&bench, &mut Random(7));
    let plan = plan(&camera(EYE), &[sun()], &technique);
    boxes.draw(&bench, &mut partly, &plan, Casters::Unmoved);
    let seen: Vec<usize> = (0..boxes.places.len())
        .filter(|&i| plan.maps.iter().any(|m| m.may_cast(bounds(&boxes.places[i]))))
        .collect();
    for which in [seen[0], seen[1], seen[2]] {
        let old = bounds(&boxes.places[which]);
        boxes.places[which].translation += DVec3::new(0.3, 0.1, 0.0);
        let moved = [old, bounds(&boxes.places[which])];
        let casters = Casters::MovedIn(&moved);
        let frame = Frame { plan: &plan, render_origin: plan.origin, casters };
        drop(partly.prepare(&bench.device, &bench.queue, &frame).unwrap());
    }
    boxes.draw(&bench, &mut wholly, &plan, Casters::Moved);
    assert_ne!(bits(&bench, &partly), bits(&bench, &wholly));
    let drawn = boxes.draw(&bench, &mut partly, &plan, Casters::Unmoved);
    assert!(drawn.len() >= 2, "{drawn:?}");
    assert_eq!(bits(&bench, &partly), bits(&bench, &wholly));
}

#[needs(gpu)]
#[test]
fn boxes_that_are_nowhere_are_refused() {
    let bench = bench();
    let technique: Technique = "adaptive:hard@64".parse().unwrap();
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    let mut shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
    let plan = plan(&camera(EYE), &[sun()], &technique);
    for bad in [f64::NAN, f64::INFINITY, 1e13] {
        let boxes = [Aabb { min: DVec3::ZERO, max: DVec3::new(1.0, bad, 1.0) }];
        let casters = Casters::MovedIn(&boxes);
        let frame = Frame { plan: &plan, render_origin: plan.origin, casters };
        let error = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap_err();
        assert!(matches!(error, Error::Invalid { field: "frame.casters", .. }), "{error}");
    }
}
