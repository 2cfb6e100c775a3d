//! Maps drawn from clusters against maps drawn from all triangles.

use crate::device::Bench;
use crate::partial::{Random, bits};
use crate::{EYE, bench, camera, lights, sun};
use bytemuck::cast_slice;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use umbrage::{Aabb, Light, Plan, Technique};
use umbrage_clusters::{ClusterMesh, MeshInput, build};
use umbrage_testing::needs;
use umbrage_wgpu::{
    Bias, CasterInstance, Casters, ClusterCasters, ClusterCounts, ClusterGeometry, ClusterInstance,
    ClusterSource, ClusterVertices, Error, Frame, MeshCasters, MeshKind, ShadowOptions, Shadows,
    Timestamps,
};
use wgpu::{BufferUsages, IndexFormat};

/// A mesh, and clusters of it.
struct Model {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    clusters: ClusterMesh,
}

impl Model {
    fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let mesh = MeshInput {
            positions: &positions,
            normals: &[],
            uvs: &[],
            triangles: &triangles,
            is_masked: false,
        };
        let clusters = build(&mesh).unwrap();
        Self { positions, triangles, clusters }
    }

    /// A closed surface about a metre across, with dents. It has 12 · `n`² triangles.
    fn stone(n: u32) -> Self {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        for (face, sign) in (0..3).flat_map(|face| [(face, 1.0), (face, -1.0)]) {
            let first = positions.len() as u32;
            let [a, b, c] = [0, 1, 2].map(|k| axes[(face + k) % 3]);
            for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
                let [s, t] = [i, j].map(|k| 2.0 * k as f32 / n as f32 - 1.0);
                let p = (sign * a + s * b + t * c).normalize();
                let dents = (9.0 * p.x).sin() * (7.0 * p.y + 2.0).sin() * (8.0 * p.z).cos();
                positions.push(p * (0.5 + 0.06 * dents));
            }
            for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
                let p = first + j * (n + 1) + i;
                triangles.extend([[p, p + 1, p + n + 2], [p, p + n + 2, p + n + 1]]);
            }
        }
        Self::new(positions, triangles)
    }

    /// A box of unit size.
    fn block() -> Self {
        let mut block = Self::stone(1);
        for p in &mut block.positions {
            *p = p.signum() * 0.5;
        }
        Self::new(block.positions, block.triangles)
    }
}

/// Instances of one model, as triangles and as clusters.
struct Crowd {
    model: Model,
    places: Vec<DAffine3>,
    positions: wgpu::Buffer,
    indices: wgpu::Buffer,
}

impl Crowd {
    fn new(bench: &Bench, model: Model, places: Vec<DAffine3>) -> Self {
        let usage = BufferUsages::VERTEX | BufferUsages::STORAGE;
        let positions = bench.buffer(cast_slice(&model.positions), usage);
        let indices = bench.buffer(cast_slice(&model.triangles), BufferUsages::INDEX);
        Self { model, places, positions, indices }
    }

    fn instances(&self) -> Vec<ClusterInstance> {
        let instance = |&world_from_mesh: &DAffine3| ClusterInstance {
            mesh: 0,
            world_from_mesh,
            caster_batch: Some(0),
            seen_batch: None,
        };
        self.places.iter().map(instance).collect()
    }

    fn geometry(&self, bench: &Bench) -> Result<ClusterGeometry, Error> {
        let source = ClusterSource { clusters: &self.model.clusters, first_vertex: 0 };
        let vertices = ClusterVertices { positions: &self.positions, attributes: None };
        let instances = self.instances();
        ClusterGeometry::new(&bench.device, &bench.support, &[source], &instances, &vertices)
    }

    /// Draws all triangles of all instances.
    fn draw_all(&self, bench: &Bench, shadows: &mut Shadows, plan: &Plan) {
        const POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
            array_stride: 12,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3],
        };
        let layouts = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
        let casters = MeshCasters::new(&bench.device, shadows, MeshKind::Opaque, &layouts);
        let instances = self.places.iter().map(|m| CasterInstance::new(m, plan.origin));
        let instances: Vec<CasterInstance> = instances.collect();
        let placed = bench.buffer(cast_slice(&instances), BufferUsages::VERTEX);
        let frame = Frame { plan, render_origin: plan.origin, casters: Casters::Moved };
        let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
        let mut encoder = bench.encoder();
        prepared.encode(&mut encoder, &Timestamps::default(), |map| {
            if self.model.triangles.is_empty() {
                return;
            }
            map.pass.set_pipeline(casters.pipeline());
            map.pass.set_vertex_buffer(0, self.positions.slice(..));
            map.pass.set_vertex_buffer(1, placed.slice(..));
            map.pass.set_index_buffer(self.indices.slice(..), IndexFormat::Uint32);
            let corners = 3 * self.model.triangles.len() as u32;
            map.pass.draw_indexed(0..corners, 0, 0..instances.len() as u32);
        });
        bench.finish(encoder);
    }
}

/// Draws clusters into the maps that are stale, and returns what was chosen and how many maps, or
/// parts of maps, were drawn.
fn draw_clusters(
    bench: &Bench,
    geometry: &ClusterGeometry,
    casters: &mut ClusterCasters,
    shadows: &mut Shadows,
    plan: &Plan,
    moved: Casters<'_>,
) -> (ClusterCounts, usize) {
    let frame = Frame { plan, render_origin: plan.origin, casters: moved };
    let prepared = shadows.prepare(&bench.device, &bench.queue, &frame).unwrap();
    let mut encoder = bench.encoder();
    casters.choose(&bench.device, &bench.queue, &mut encoder, geometry, &prepared, None).unwrap();
    let mut parts = 0;
    prepared.encode(&mut encoder, &Timestamps::default(), |map| {
        casters.draw(map, |_| None);
        parts += 1;
    });
    bench.finish(encoder);
    (casters.counts(&bench.device).expect("the device was waited for"), parts)
}

/// A plan whose maps take all casters, also those that no receiver needs, so that maps can be
/// compared texel by texel.
fn whole_plan(lights: &[Light], technique: &Technique) -> Plan {
    let mut plan = crate::plan(&camera(EYE), lights, technique);
    plan.maps.iter_mut().for_each(|map| map.caster_planes.clear());
    plan
}

/// Draws clusters until there is room for all, and returns what was chosen at last.
fn draw_whole(
    bench: &Bench,
    geometry: &ClusterGeometry,
    casters: &mut ClusterCasters,
    shadows: &mut Shadows,
    plan: &Plan,
) -> ClusterCounts {
    for _ in 0..8 {
        let moved = Casters::Moved;
        let (counts, _) = draw_clusters(bench, geometry, casters, shadows, plan, moved);
        if counts.is_complete {
            return counts;
        }
    }
    panic!("there is never room");
}

fn shadows(bench: &Bench, technique: &Technique) -> Shadows {
    let options = ShadowOptions { filter: technique.filter, ..ShadowOptions::default() };
    let mut shadows = Shadows::new(&bench.device, bench.support, &options).unwrap();
    shadows.set_bias(ClusterCasters::bias(ClusterCasters::SHARE)).unwrap();
    shadows
}

/// Stones of all sizes and orientations, some of them mirrored, some stretched, on the plain.
fn stones(random: &mut Random, count: usize) -> Vec<DAffine3> {
    let mut places: Vec<DAffine3> = (0..count).map(|_| random.placed()).collect();
    for (i, place) in places.iter_mut().enumerate() {
        let stretch = DVec3::new([1.0, -1.0][i % 2], [1.0, 2.5][i % 3 / 2], 1.0);
        place.matrix3 *= DMat3::from_diagonal(stretch) * 2.0;
    }
    places
}

/// Texels that differ from all triangles by more than those within one texel of the same place do,
/// and texels in which something was drawn.
fn astray(expected: &[f32], found: &[f32], width: usize) -> (usize, usize) {
    let height = expected.len() / width;
    let (mut astray, mut covered) = (0, 0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let depth = found[y * width + x];
            let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
            for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
                let depth = expected[(y + j - 1) * width + x + i - 1];
                (low, high) = (low.min(depth), high.max(depth));
            }
            covered += usize::from(low < 1.0);
            // Half a texel of error may also lie in the depth of a surface that faces the light.
            astray += usize::from(depth < low - 2e-3 || depth > high + 2e-3);
        }
    }
    (astray, covered)
}

/// All detail is the same picture as all triangles, and with levels of detail no surface is off by
/// more than half a texel, under each kind of light and map.
#[needs(gpu)]
#[test]
fn maps_are_those_of_all_triangles() {
    let bench = bench();
    let mut random = Random(3);
    let crowd = Crowd::new(&bench, Model::stone(32), stones(&mut random, 20));
    let geometry = crowd.geometry(&bench).unwrap();
    for technique in ["uniform@400", "lispsm@400", "adaptive+z2@400", "lispsm+face@400"] {
        let technique: Technique = technique.parse().unwrap();
        let plan = whole_plan(&lights(), &technique);
        let [mut all, mut exact, mut coarse] = [(); 3].map(|()| shadows(&bench, &technique));
        crowd.draw_all(&bench, &mut all, &plan);
        let mut drawn = [0; 2];
        for (i, (share, shadows)) in [(0.0, &mut exact), (0.5, &mut coarse)].into_iter().enumerate()
        {
            let mut casters =
                ClusterCasters::new(&bench.device, shadows, &geometry, share).unwrap();
            let counts = draw_whole(&bench, &geometry, &mut casters, shadows, &plan);
            assert_eq!(counts.relief, 1.0);
            drawn[i] = counts.triangles;
        }
        assert!(drawn[1] * 3 < drawn[0] * 2, "{technique}: {drawn:?}");
        for layer in 0..all.depth_texture().depth_or_array_layers() {
            let [(all, width), (exact, _), (coarse, _)] =
                [&all, &exact, &coarse].map(|shadows| bench.depths(shadows, layer));
            let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4;
            let differing = all.iter().zip(&exact).filter(differs).count();
            let (astray, covered) = astray(&all, &coarse, width);
            let told = format!("{technique}, layer {layer}: {covered} texels are covered");
            assert!(differing * 1000 < covered, "{told}, {differing} differ");
            assert!(astray * 500 < covered, "{told}, {astray} are astray");
        }
    }
}

/// Where only parts of maps are drawn again, because instances moved, the maps are the same, bit by
/// bit, as if all of them were.
#[needs(gpu)]
#[test]
fn parts_are_those_of_a_full_redraw() {
    let bench = bench();
    let mut random = Random(11);
    let mut crowd = Crowd::new(&bench, Model::stone(24), stones(&mut random, 40));
    let technique: Technique = "adaptive+z2@300".parse().unwrap();
    let plan = whole_plan(&lights(), &technique);
    let mut geometry = crowd.geometry(&bench).unwrap();
    let [mut partly, mut wholly] = [(); 2].map(|()| shadows(&bench, &technique));
    let [mut some, mut all] = [&partly, &wholly]
        .map(|shadows| ClusterCasters::new(&bench.device, shadows, &geometry, 0.5).unwrap());
    draw_whole(&bench, &geometry, &mut some, &mut partly, &plan);
    draw_whole(&bench, &geometry, &mut all, &mut wholly, &plan);
    let mut parts_of_maps = 0;
    for frame in 0..5 {
        let around = |place: &DAffine3| {
            let extent = place.matrix3.abs() * DVec3::splat(0.6);
            Aabb::new(place.translation - extent, place.translation + extent)
        };
        let mut moved = Vec::new();
        for i in [frame, 7 * frame + 1] {
            let place = &mut crowd.places[i];
            moved.push(around(place));
            place.translation += DVec3::new(random.next() - 0.5, 0.2, random.next() - 0.5);
            moved.push(around(place));
        }
        geometry.place(&bench.queue, &crowd.instances()).unwrap();
        let casters = Casters::MovedIn(&moved);
        let (counts, parts) =
            draw_clusters(&bench, &geometry, &mut some, &mut partly, &plan, casters);
        assert!(counts.is_complete);
        parts_of_maps += parts;
        draw_whole(&bench, &geometry, &mut all, &mut wholly, &plan);
        let differing = bits(&bench, &partly)
            .iter()
            .zip(&bits(&bench, &wholly))
            .filter(|(a, b)| a != b)
            .count();
        assert_eq!(differing, 0, "frame {frame}");
    }
    assert!(parts_of_maps > 5, "{parts_of_maps}");
}

/// More instances than the first buffers have room for: what is missing is told, and the next choice
/// has room for it. Their clusters would need indices beyond 24 bits, which some devices lack, if
/// each had as many as the largest.
#[needs(gpu)]
#[test]
fn room_grows() {
    let bench = bench();
    let mut random = Random(5);
    let scene = crate::scene();
    let places = (0..300_000).map(|_| {
        let scale = DVec3::splat(0.3);
        DAffine3::from_translation(random.within(scene)) * DAffine3::from_scale(scale)
    });
    let crowd = Crowd::new(&bench, Model::block(), places.collect());
    let geometry = crowd.geometry(&bench).unwrap();
    let technique: Technique = "unfocused@512".parse().unwrap();
    let plan = whole_plan(&[sun()], &technique);
    let [mut all, mut some] = [(); 2].map(|()| shadows(&bench, &technique));
    crowd.draw_all(&bench, &mut all, &plan);
    let mut casters = ClusterCasters::new(&bench.device, &some, &geometry, 0.0).unwrap();
    let mut told = Vec::new();
    for _ in 0..4 {
        let drawn =
            draw_clusters(&bench, &geometry, &mut casters, &mut some, &plan, Casters::Moved);
        told.push(drawn.0);
        if drawn.0.is_complete {
            break;
        }
    }
    assert!(told.len() > 1 && told[told.len() - 1].is_complete, "{told:?}");
    assert_eq!(told[told.len() - 1].relief, 1.0);
    let [(all, _), (some, _)] = [&all, &some].map(|shadows| bench.depths(shadows, 0));
    let differing = all.iter().zip(&some).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
    assert!(differing * 1000 < all.len(), "{differing}");
}

/// A device with little room draws everything all the same, with more error.
#[needs(gpu)]
#[test]
fn little_room_is_shared_evenly() {
    let bench = Bench::with_limits(|limits| limits.max_storage_buffer_binding_size = 4 << 20);
    let mut random = Random(9);
    let crowd = Crowd::new(&bench, Model::stone(48), stones(&mut random, 300));
    let geometry = crowd.geometry(&bench).unwrap();
    let technique: Technique = "uniform@2048".parse().unwrap();
    let plan = whole_plan(&[sun()], &technique);
    let [mut all, mut some] = [(); 2].map(|()| shadows(&bench, &technique));
    crowd.draw_all(&bench, &mut all, &plan);
    let mut casters = ClusterCasters::new(&bench.device, &some, &geometry, 0.01).unwrap();
    let mut counts = None;
    for _ in 0..30 {
        let drawn =
            draw_clusters(&bench, &geometry, &mut casters, &mut some, &plan, Casters::Moved);
        counts = Some(drawn.0);
        if drawn.0.is_complete {
            break;
        }
    }
    let counts = counts.unwrap();
    assert!(counts.is_complete && counts.relief > 1.0, "{counts:?}");
    let [all, some] = [&all, &some].map(|shadows| {
        let depths = bench.depths(shadows, 0).0;
        depths.into_iter().filter(|&depth| depth < 1.0).count() as f64
    });
    assert!((some / all - 1.0).abs() < 0.02, "{some} texels are covered, not {all}, {counts:?}");
}

/// Far from the world's origin, maps keep their precision.
#[needs(gpu)]
#[test]
fn a_million_metres_from_the_origin() {
    let bench = bench();
    let mut random = Random(21);
    let technique: Technique = "lispsm@400".parse().unwrap();
    let near = whole_plan(&[sun()], &technique);
    let offset = DVec3::new(1_048_576.0, -262_144.0, 2_097_152.0);
    let mut far = near.clone();
    far.origin += offset;
    for map in &mut far.maps {
        map.origin += offset;
    }
    let places = stones(&mut random, 40);
    let moved = |m: &DAffine3| DAffine3::from_translation(offset) * *m;
    let maps = [(near, places.clone()), (far, places.iter().map(moved).collect())];
    let [near, far] = maps.map(|(plan, places)| {
        let crowd = Crowd::new(&bench, Model::stone(24), places);
        let geometry = crowd.geometry(&bench).unwrap();
        let mut shadows = shadows(&bench, &technique);
        let mut casters = ClusterCasters::new(&bench.device, &shadows, &geometry, 0.5).unwrap();
        draw_whole(&bench, &geometry, &mut casters, &mut shadows, &plan);
        bench.depths(&shadows, 0).0
    });
    let differing = near.iter().zip(&far).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
    assert!(differing * 1000 < near.len(), "{differing}");
}

/// One triangle, triangles without area, triangles that many share an edge of, and nothing at all.
#[needs(gpu)]
#[test]
fn odd_meshes_cast() {
    let bench = bench();
    let technique: Technique = "uniform@256".parse().unwrap();
    let plan = whole_plan(&[sun()], &technique);
    let fan = |n: u32| -> Vec<[u32; 3]> { (0..n).map(|i| [0, 1, 2 + i]).collect() };
    let around = |i: u32| {
        let turn = i as f32;
        Vec3::new(turn.cos(), 0.5, turn.sin())
    };
    let mut edge = vec![Vec3::ZERO, Vec3::Y];
    edge.extend((0..40).map(around));
    let odd = [
        (vec![Vec3::ZERO, Vec3::X, Vec3::ONE], vec![[0, 1, 2]]),
        (vec![Vec3::ZERO, Vec3::X, Vec3::ONE], vec![[0, 1, 2], [1, 1, 2], [0, 0, 0]]),
        (edge, fan(40)),
        (Vec::new(), Vec::new()),
    ];
    let mut random = Random(1);
    for (i, (positions, triangles)) in odd.into_iter().enumerate() {
        let model = Model::new(positions, triangles);
        let is_empty = model.triangles.is_empty();
        let crowd = Crowd::new(&bench, model, stones(&mut random, 12));
        let geometry = crowd.geometry(&bench).unwrap();
        let [mut all, mut some] = [(); 2].map(|()| shadows(&bench, &technique));
        crowd.draw_all(&bench, &mut all, &plan);
        let mut casters = ClusterCasters::new(&bench.device, &some, &geometry, 0.0).unwrap();
        draw_whole(&bench, &geometry, &mut casters, &mut some, &plan);
        let [(all, _), (some, _)] = [&all, &some].map(|shadows| bench.depths(shadows, 0));
        let covered = all.iter().filter(|&&depth| depth < 1.0).count();
        let differing = all.iter().zip(&some).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
        assert_eq!(covered == 0, is_empty, "mesh {i}");
        assert!(differing * 200 <= covered, "mesh {i}: {differing} of {covered} differ");
    }
}

#[needs(gpu)]
#[test]
fn what_cannot_be_is_refused() {
    let bench = bench();
    let places = vec![DAffine3::IDENTITY; 3];
    let mut crowd = Crowd::new(&bench, Model::block(), places);
    let mut geometry = crowd.geometry(&bench).unwrap();
    let field = |error: Error| match error {
        Error::Invalid { field, .. } => field,
        other => panic!("{other}"),
    };
    let technique: Technique = "uniform@64".parse().unwrap();
    let mut shadows = shadows(&bench, &technique);
    for share in [f32::NAN, -0.1, f32::INFINITY] {
        let error = ClusterCasters::new(&bench.device, &shadows, &geometry, share).unwrap_err();
        assert_eq!(field(error), "share");
    }
    // Less bias than coarser casters need.
    shadows.set_bias(Bias::default()).unwrap();
    let error = ClusterCasters::new(&bench.device, &shadows, &geometry, 0.5).unwrap_err();
    assert_eq!(field(error), "bias");
    assert!(ClusterCasters::new(&bench.device, &shadows, &geometry, 0.0).is_ok());
    let mut other = crowd.instances();
    other[1].mesh = 7;
    assert_eq!(field(geometry.place(&bench.queue, &other).unwrap_err()), "instances");
    let fewer = &crowd.instances()[..2];
    assert_eq!(field(geometry.place(&bench.queue, fewer).unwrap_err()), "instances");
    crowd.places[2].translation.x = f64::NAN;
    assert_eq!(field(crowd.geometry(&bench).unwrap_err()), "instances");
}
