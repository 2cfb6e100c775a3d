//! Cuts have no gaps, and the tree is a tree.

mod common;

use common::{Random, Shape, all, corners, cut, edges, sphere};
use proptest::prelude::*;
use std::sync::LazyLock;
use umbrage_clusters::{Ball, Cluster, ClusterMesh, Node, build};

fn built(shape: &Shape) -> ClusterMesh {
    build(&shape.input()).unwrap()
}

/// All shapes, built once for all tests.
static BUILT: LazyLock<Vec<(&str, Shape, ClusterMesh)>> = LazyLock::new(|| {
    let with_mesh = |(name, shape)| {
        let mesh = built(&shape);
        (name, shape, mesh)
    };
    all().into_iter().map(with_mesh).collect()
});

/// What an eye allows that sees `share` of a metre at one metre's distance.
fn seen_from(eye: glam::Vec3, share: f32) -> impl Fn(&Ball, f32) -> bool {
    move |ball, error| error <= share * (ball.center.distance(eye) - ball.radius).max(0.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn every_edge_of_a_closed_surface_has_two_triangles(
        rows in 3u32..40,
        bump in 0.0f32..0.3,
        is_flat: bool,
        seed: u64,
    ) {
        let mut shape = sphere(rows, bump);
        if is_flat {
            shape = shape.flat_shaded();
        }
        let mesh = built(&shape);
        let mut random = Random(seed);
        for _ in 0..8 {
            let eye = random.point() * 6.0 - 3.0;
            let share = 0.3 * random.next().powi(4);
            let drawn = cut(&mesh, seen_from(eye, share));
            prop_assert!(!drawn.is_empty());
            let triangles: Vec<_> = drawn.iter().flat_map(|c| corners(&mesh, c)).collect();
            let edges = edges(&shape, &triangles);
            // An even number: where a fold collapsed, two sheets may share an edge.
            let odd = edges.values().filter(|&&count| count % 2 == 1).count();
            prop_assert_eq!(odd, 0, "of {} edges", edges.len());
        }
    }
}

#[test]
fn edges_of_a_smooth_closed_surface_have_exactly_two_triangles() {
    let shape = sphere(50, 0.05);
    let mesh = built(&shape);
    for share in [0.0, 0.001, 0.003, 0.01, 0.03] {
        let drawn = cut(&mesh, seen_from(glam::Vec3::new(1.5, 0.3, 0.2), share));
        let triangles: Vec<_> = drawn.iter().flat_map(|c| corners(&mesh, c)).collect();
        assert!(edges(&shape, &triangles).values().all(|&count| count == 2), "{share}");
    }
}

/// Pieces may open where they become single triangles, but only as a whole: never between what
/// comes of one group and of another.
#[test]
fn closed_pieces_in_several_groups_stay_closed() {
    let shape = common::balls(8);
    let mesh = built(&shape);
    let own = shape.positions.len() / 8;
    let mut shared = 0;
    for seed in 0..40 {
        let mut random = Random(seed);
        let eye = random.point() * 8.0 - 2.0;
        let drawn = cut(&mesh, seen_from(eye, 0.1 * random.next().powi(3)));
        for ball in 0..8 {
            let mut sources = std::collections::HashSet::new();
            let mut triangles = Vec::new();
            for cluster in &drawn {
                let all = corners(&mesh, cluster);
                let of_ball = all.iter().filter(|t| t[0] as usize / own == ball);
                let before = triangles.len();
                triangles.extend(of_ball.copied());
                if triangles.len() > before {
                    sources.insert(cluster.error.to_bits());
                }
            }
            if sources.len() > 1 {
                shared += 1;
                let odd = edges(&shape, &triangles).values().filter(|&&n| n % 2 == 1).count();
                assert_eq!(odd, 0, "ball {ball} from {eye}");
            }
        }
    }
    assert!(shared > 20, "only {shared} balls in several groups");
}

/// Thin pieces cost what they look like: a twig is a triangle long before its bend is lost.
#[test]
fn twigs_become_few_triangles_within_a_small_error() {
    let shape = common::twigs(300);
    let mesh = built(&shape);
    let drawn = cut(&mesh, |_, error| error <= 0.1);
    let triangles: u32 = drawn.iter().map(|cluster| cluster.triangle_count).sum();
    assert!(triangles < 900, "{triangles} of {}", shape.triangles.len());
}

/// Without allowance the mesh itself is drawn: as many triangles of the same corners, up to the
/// order of corners around each.
#[test]
fn the_finest_level_has_the_triangles_of_the_mesh() {
    let turned = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    for (name, shape, mesh) in BUILT.iter() {
        let finest = mesh.clusters.iter().filter(|cluster| cluster.level == 0);
        let mut own: Vec<_> = finest.flat_map(|c| corners(mesh, c)).map(turned).collect();
        // The tiny and the huge shape have no triangles that count as nothing either.
        let mut asked: Vec<_> = shape.triangles.iter().copied().map(turned).collect();
        own.sort_unstable();
        asked.sort_unstable();
        assert!(own == asked, "{name}: {} of {} triangles", own.len(), asked.len());
    }
}

#[test]
fn the_tree_bounds_what_is_below() {
    for (name, shape, mesh) in BUILT.iter() {
        mesh.check(shape.positions.len()).unwrap_or_else(|flaw| panic!("{name}: {flaw}"));
        for node in mesh.nodes.iter().filter(|node| node.is_leaf == 0) {
            let below = &mesh.nodes[node.first as usize..(node.first + node.count) as usize];
            assert!(below.iter().all(|child| node.bounds.contains(&child.bounds)), "{name}");
            let error = below.iter().map(|child| child.error).fold(0.0, f32::max);
            assert_eq!(node.error, error, "{name}");
        }
    }
}

#[test]
fn groups_and_their_replacements_agree_to_the_bit() {
    for (name, shape, mesh) in BUILT.iter() {
        let leaves: Vec<&Node> = mesh.nodes.iter().filter(|node| node.is_leaf == 1).collect();
        for leaf in &leaves {
            let own = &mesh.clusters[leaf.first as usize..(leaf.first + leaf.count) as usize];
            for cluster in own {
                // Coarser is never better, and counts in a ball that is not smaller.
                assert!(leaf.error > cluster.error, "{name}");
                assert!(leaf.bounds.contains(&cluster.error_bounds), "{name}");
                for vertex in corners(mesh, cluster).as_flattened() {
                    let center = shape.positions[*vertex as usize];
                    let point = Ball { center, radius: 0.0 };
                    assert!(cluster.bounds.contains(&point), "{name}");
                    assert!(leaf.bounds.contains(&point), "{name}");
                }
            }
        }
        for cluster in &mesh.clusters {
            let is_replacement = |leaf: &&&Node| {
                leaf.bounds == cluster.error_bounds
                    && leaf.error.to_bits() == cluster.error.to_bits()
            };
            if cluster.level == 0 {
                assert_eq!((cluster.error, cluster.error_bounds), (0.0, cluster.bounds), "{name}");
            } else {
                assert!(leaves.iter().any(|leaf| is_replacement(&leaf)), "{name}");
            }
        }
    }
}

#[test]
fn meshes_end_in_few_triangles() {
    for (name, _, mesh) in BUILT.iter() {
        let last = cut(mesh, |_, error| error < f32::INFINITY);
        let triangles: u32 = last.iter().map(|cluster| cluster.triangle_count).sum();
        println!("{name}: {triangles} triangles at last");
        assert!((1..=8).contains(&triangles), "{name}: {triangles}");
    }
}

#[test]
fn building_again_makes_the_same() {
    let shape = common::terrain(50, true);
    assert_eq!(built(&shape), built(&shape));
    let meshes = [shape.input(), sphere(8, 0.1).input(), shape.input()].map(|m| built_alone(&m));
    assert_eq!(meshes[0], meshes[2]);
    assert!(meshes.iter().flat_map(|mesh| &mesh.clusters).all(fits));
}

fn built_alone(mesh: &umbrage_clusters::MeshInput) -> ClusterMesh {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| build(mesh)).unwrap()
}

fn fits(cluster: &Cluster) -> bool {
    cluster.triangle_count as usize <= Cluster::MAX_TRIANGLES
        && cluster.vertex_count as usize <= Cluster::MAX_VERTICES
}
