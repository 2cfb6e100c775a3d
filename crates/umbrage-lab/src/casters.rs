//! Culling of casters: which triangles need not be drawn into a shadow map.

use serde::Serialize;
use umbrage::{Aabb, Plan, ShadowMap};
use umbrage_scene::Scene;

/// Numbers of triangles for one shadow map, by whether the box of their instance may cast into it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MapCasters {
    /// Triangles of instances that may cast into the map.
    pub drawn: u64,
    /// Triangles of instances that cannot.
    pub culled: u64,
}

/// Counts the triangles that may cast into each of the plan's maps, and those that cannot. Plans
/// with pages have no maps that anything is drawn into, and so no counts.
pub fn casters(plan: &Plan, scene: &Scene) -> Vec<MapCasters> {
    if plan.paging.is_some() {
        return Vec::new();
    }
    let triangles = scene.instances.iter().map(|i| scene.meshes[i.mesh].triangles.len() as u64);
    let boxes = scene.instance_boxes().into_iter().zip(triangles).enumerate();
    let casting = boxes.filter(|&(i, _)| scene.roles.of(i).casts);
    let instances: Vec<(Aabb, u64)> = casting.map(|(_, instance)| instance).collect();
    let of_map = |map: &ShadowMap| {
        instances.iter().fold(MapCasters::default(), |mut sum, &(aabb, triangles)| {
            *(if map.may_cast(aabb) { &mut sum.drawn } else { &mut sum.culled }) += triangles;
            sum
        })
    };
    plan.maps.iter().map(of_map).collect()
}

/// Fraction of all triangles that are culled, 0 to 1, the mean over the maps that are not empty;
/// `None` if all maps are empty. `casters` has an entry for each map.
pub fn casters_culled(plan: &Plan, casters: &[MapCasters]) -> Option<f64> {
    let casters = plan.maps.iter().zip(casters);
    let of_full = casters.filter(|(map, _)| !map.is_empty()).map(|(_, casters)| casters);
    let [drawn, culled] =
        of_full.fold([0, 0], |[d, c], casters| [d + casters.drawn, c + casters.culled]);
    (drawn + culled > 0).then(|| culled as f64 / (drawn + culled) as f64)
}
