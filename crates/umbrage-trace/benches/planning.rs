//! Time to plan the maps of one light, by the boxes around receivers and by technique. The boxes
//! are those around the surfaces of third-party scenes, and boxes scattered at random.
//!
//! ```sh
//! cargo bench -p umbrage-trace --bench planning           # all
//! cargo bench -p umbrage-trace --bench planning -- forest # one scene
//! ```

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;
use umbrage::{Aabb, Bounds, BoxTree, Camera, Light, LookAt, Planner, Technique};
use umbrage_testing::third_party_scenes;
use umbrage_trace::Tracer;

/// Largest number of boxes around surfaces, as in the laboratory.
const SURFACE_BOXES: usize = 256;

/// A view of receivers.
struct Case {
    name: String,
    eye: DVec3,
    target: DVec3,
    /// Near and far distance, metres.
    range: [f64; 2],
    all: Aabb,
    parts: Vec<Aabb>,
}

/// A file, the position and the target of the eye, and the near and far distance in metres.
type ThirdParty = (&'static str, [f64; 3], [f64; 3], [f64; 2]);

const THIRD_PARTY: [ThirdParty; 3] = [
    ("vehicles/kenney_racing_level.glb", [0.0, 6.0, 30.0], [-15.0, 0.0, 0.0], [0.25, 125.0]),
    ("dragon/dragons25_res3.glb", [2.0, 1.2, 7.5], [-1.0, 0.3, 0.0], [0.05, 25.0]),
    ("trees/forest_eztree.glb", [-30.0, 12.0, 80.0], [0.0, 4.0, 0.0], [0.6, 300.0]),
];

/// The boxes around the surfaces of a scene; `None` if the scene is missing.
fn third_party((file, eye, target, range): ThirdParty) -> Option<Case> {
    let path = Path::new(third_party_scenes!()).join(file);
    let scene = umbrage_scene::load(&path).inspect_err(|e| println!("left out: {e}")).ok()?;
    let parts = Tracer::new(&scene).expect("a sound scene").boxes(SURFACE_BOXES);
    let [eye, target] = [eye, target].map(DVec3::from);
    let name = format!("{}, {} boxes", scene.name, parts.len());
    Some(Case { name, eye, target, range, all: scene.bounds(), parts })
}

/// Boxes that stand at random on a square ground of this side, metres.
fn scattered(count: usize, side: f64) -> Case {
    // The splitmix64 generator (Steele et al. 2014): the same boxes in every run.
    let mut state = count as u64;
    let mut random = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    };
    let mut part = || {
        let corner = DVec3::new(random() - 0.5, 0.0, random() - 0.5) * side;
        Aabb::new(corner, corner + DVec3::new(random(), random(), random()) * 0.05 * side)
    };
    let parts: Vec<Aabb> = (0..count).map(|_| part()).collect();
    Case {
        name: format!("scattered, {count} boxes"),
        eye: DVec3::new(0.0, 0.06, 0.45) * side,
        target: DVec3::new(-0.2, 0.0, 0.0) * side,
        range: [2e-3 * side, 2.0 * side],
        all: parts.iter().fold(Aabb::EMPTY, |all, part| all.union(*part)),
        parts,
    }
}

fn one_box() -> Case {
    Case { name: "one box".to_owned(), parts: Vec::new(), ..scattered(96, 100.0) }
}

fn planning(criterion: &mut Criterion) {
    let light = Light::Directional { direction: DVec3::new(-0.579, -0.707, -0.406) };
    let mut cases: Vec<Case> = THIRD_PARTY.into_iter().filter_map(third_party).collect();
    cases.push(one_box());
    cases.extend([16, 48, 96].map(|count| scattered(count, 100.0)));
    cases.push(scattered(100_000, 1000.0));
    for case in &cases {
        let camera = Camera::look_at(LookAt {
            eye: case.eye,
            target: case.target,
            up: DVec3::Y,
            fov_y_rad: 60f64.to_radians(),
            near: case.range[0],
            far: case.range[1],
            image: [960, 540],
        });
        let camera = camera.expect("a valid camera");
        let parts =
            (!case.parts.is_empty()).then(|| BoxTree::new(&case.parts).expect("sound boxes"));
        let bounds = Bounds { receiver_parts: parts.as_ref(), ..Bounds::of_scene(case.all) };
        let mut group = criterion.benchmark_group(&case.name);
        group.sample_size(10).warm_up_time(Duration::from_millis(500));
        group.measurement_time(Duration::from_secs(2));
        for text in [
            "adaptive",
            "adaptive+z4",
            "adaptive+z2(fitted)",
            "adaptive+z4(fitted)",
            "adaptive+face",
        ] {
            let technique: Technique = text.parse().expect("a technique");
            let mut planner = Planner::new();
            group.bench_function(text, |b| {
                b.iter(|| {
                    planner.forget();
                    let plan = planner.plan(black_box(&camera), &[light], &bounds, &technique);
                    plan.expect("a plan").maps.len()
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, planning);
criterion_main!(benches);
