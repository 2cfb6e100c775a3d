//! The error that clusters state is never exceeded.

mod common;
#[path = "common/distance.rs"]
mod distance;

use common::{Random, all, corners, cut};
use distance::Surface;
use umbrage_clusters::build;

/// Run with `--nocapture` for the table of true and stated errors, and with
/// `UMBRAGE_POINTS=1000000` to compare at more points.
#[test]
fn no_point_of_a_cut_or_of_the_mesh_is_farther_from_the_other_than_stated() {
    let points = std::env::var("UMBRAGE_POINTS").map_or(6_000, |n| n.parse().unwrap());
    let mut exceeded = Vec::new();
    for (name, shape) in all() {
        let mesh = build(&shape.input()).unwrap();
        let original = Surface::new(&shape, &shape.triangles);
        let mut errors: Vec<f32> = mesh.clusters.iter().map(|cluster| cluster.error).collect();
        errors.retain(|&error| error > 0.0);
        errors.sort_by(f32::total_cmp);
        let size = shape.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        for share in [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0] {
            let Some(&threshold) = errors.get(((errors.len() - 1) as f64 * share) as usize) else {
                continue;
            };
            let drawn = cut(&mesh, |_, error| error <= threshold);
            let stated = drawn.iter().map(|cluster| cluster.error).fold(0.0, f32::max);
            let triangles: Vec<_> = drawn.iter().flat_map(|c| corners(&mesh, c)).collect();
            let surface = Surface::new(&shape, &triangles);
            let mut random = Random(3);
            let there = original.farthest(&surface, points, &mut random);
            let back = surface.farthest(&original, points, &mut random);
            let truth = there.max(back);
            let ratio = truth / f64::from(stated);
            println!(
                "{name:>20} {:>6} of {:>6} triangles: stated {stated:.3e}, true {there:.3e} there \
                 {back:.3e} back, ratio {ratio:.3}",
                triangles.len(),
                shape.triangles.len(),
            );
            // The points of the test are rounded as well.
            if truth > f64::from(stated) + 2e-7 * f64::from(size) {
                exceeded.push(format!("{name} at {stated}: {truth}"));
            }
        }
    }
    assert!(exceeded.is_empty(), "{exceeded:#?}");
}
