//! The system that plans cascades and writes them in place of Bevy's.

use crate::convert::{double, single, vector};
use crate::receivers::{Boxes, Meshes};
use crate::shaders::{Lookup, UmbrageEnabled, UmbrageStatus};
use crate::shadows::{Receivers, UmbrageShadows};
use bevy::camera::visibility::{VisibilitySystems, VisibleEntities};
use bevy::ecs::entity::EntityHashMap;
use bevy::ecs::system::SystemParam;
use bevy::light::cascade::{Cascade, Cascades};
use bevy::light::{
    CascadeShadowConfig, DirectionalLightShadowMap, ShadowFilteringMethod, SimulationLightSystems,
    VolumetricFog,
};
use bevy::platform::collections::HashSet;
use bevy::platform::time::Instant;
use bevy::prelude::*;
use bevy::render::occlusion_culling::OcclusionCulling;
use bevy::render::render_resource::WgpuFeatures;
use bevy::render::renderer::RenderDevice;
use std::time::Duration;
use umbrage::glam::{DMat4, DVec2, DVec3};
use umbrage::visibility::Filter;
use umbrage::{
    Bounds, BoxTree, Camera as UmbrageCamera, ClipDepth, Cover, Light, Partition, Plan, Planner,
    ShadowMap, Size, Splits, Technique, Warp,
};

/// The set of the system that plans cascades, in [`PostUpdate`]. It follows Bevy's
/// [`UpdateDirectionalLightCascades`](SimulationLightSystems::UpdateDirectionalLightCascades) and
/// precedes [`UpdateLightFrusta`](SimulationLightSystems::UpdateLightFrusta).
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct PlanCascades;

pub(crate) fn add(app: &mut App) {
    app.add_systems(
        PostUpdate,
        (restore_configs, plan_cascades)
            .chain()
            .in_set(PlanCascades)
            .after(SimulationLightSystems::UpdateDirectionalLightCascades)
            .after(VisibilitySystems::CheckVisibility)
            .before(SimulationLightSystems::UpdateLightFrusta),
    );
}

/// The configuration that a light had before plans wrote it, and the one last written.
#[derive(Component)]
struct OwnConfig {
    config: CascadeShadowConfig,
    written: CascadeShadowConfig,
}

fn restore_configs(
    mut commands: Commands,
    mut lights: Query<(Entity, &OwnConfig, &mut CascadeShadowConfig, Has<UmbrageShadows>)>,
    enabled: Res<UmbrageEnabled>,
    status: Res<UmbrageStatus>,
) {
    let is_planning = enabled.0 && status.lookup == Lookup::Umbrage;
    for (light, own, mut config, has_shadows) in &mut lights {
        if !(has_shadows && is_planning) {
            if is_same(&config, &own.written) {
                config.clone_from(&own.config);
            }
            commands.entity(light).remove::<OwnConfig>();
        }
    }
}

fn is_same(a: &CascadeShadowConfig, b: &CascadeShadowConfig) -> bool {
    a.bounds == b.bounds
        && a.overlap_proportion == b.overlap_proportion
        && a.minimum_distance == b.minimum_distance
}

type PlannedLight = (
    Entity,
    &'static GlobalTransform,
    &'static DirectionalLight,
    &'static UmbrageShadows,
    &'static mut CascadeShadowConfig,
    &'static mut Cascades,
    Option<&'static mut OwnConfig>,
    Has<OcclusionCulling>,
);

type View = (
    &'static GlobalTransform,
    &'static Projection,
    &'static Camera,
    &'static VisibleEntities,
    Option<&'static ShadowFilteringMethod>,
    Has<VolumetricFog>,
);

/// What is kept from frame to frame.
#[derive(Default)]
struct Kept {
    /// One for each light and view: a planner keeps maps that are as in its last plan.
    planners: EntityHashMap<EntityHashMap<Planner>>,
    boxes: EntityHashMap<Boxes>,
    /// Messages are given once.
    told: HashSet<String>,
}

impl Kept {
    fn warn_once(&mut self, message: String) {
        if !self.told.contains(&message) {
            warn!("bevy_umbrage: {message}");
            self.told.insert(message);
        }
    }
}

/// What plans follow from, apart from the lights.
#[derive(SystemParam)]
struct Input<'w, 's> {
    views: Query<'w, 's, View>,
    meshes: Meshes<'w, 's>,
    lamps: Query<'w, 's, Entity, (Added<UmbrageShadows>, Without<DirectionalLight>)>,
    size: Res<'w, DirectionalLightShadowMap>,
    device: Option<Res<'w, RenderDevice>>,
    enabled: Res<'w, UmbrageEnabled>,
}

fn plan_cascades(
    mut commands: Commands,
    mut kept: Local<Kept>,
    mut lights: Query<PlannedLight>,
    input: Input,
    mut status: ResMut<UmbrageStatus>,
) {
    let kept = &mut *kept;
    for lamp in &input.lamps {
        kept.warn_once(format!(
            "{lamp} has UmbrageShadows but no DirectionalLight, so nothing is planned for it; \
             the lookups of spot and point lights are bettered without it"
        ));
    }
    status.planning = Duration::ZERO;
    status.problem = None;
    // With Bevy's own lookup planned cascades gain little, and warps nothing.
    if !input.enabled.0 || status.lookup != Lookup::Umbrage {
        return;
    }
    let begin = Instant::now();
    // Bevy's own clamping of depths, on devices that cannot clamp, does not know warps.
    let has_clamp =
        |device: &RenderDevice| device.features().contains(WgpuFeatures::DEPTH_CLIP_CONTROL);
    let can_warp = status.clamps_warped_depths || input.device.as_deref().is_some_and(has_clamp);
    kept.planners.retain(|light, _| lights.contains(*light));
    kept.boxes.retain(|view, _| input.views.contains(*view));
    kept.boxes.values_mut().for_each(Boxes::forget);

    for (light, transform, source, shadows, mut config, mut cascades, own, is_culled) in &mut lights
    {
        if !source.shadow_maps_enabled || cascades.cascades.is_empty() {
            continue;
        }
        // What the user has set, now or before the last plan.
        let user = match &own {
            Some(own) if is_same(&own.written, &config) => own.config.clone(),
            _ => config.clone(),
        };
        let mut technique = *shadows.technique();
        technique.size = Size::Exact([input.size.size as u32; 2]);
        if (is_culled || !can_warp) && technique.warp != Warp::Uniform {
            technique.warp = Warp::Uniform;
            let why = match is_culled {
                true => "Bevy's occlusion culling of shadow maps does not know warps",
                false => "the device cannot clamp depths",
            };
            kept.warn_once(format!("planned maps of {light} have no warp, because {why}"));
        }
        let distance = shadows.distance().or(user.bounds.last().copied()).unwrap_or_default();
        if cascades.cascades.len() > 1 {
            share_splits(&mut technique, &user, distance);
        }
        let asked = Asked {
            sun: Light::Directional { direction: vector(transform.forward().to_array()) },
            technique,
            distance,
            receivers: shadows.receivers(),
        };
        let planners = kept.planners.entry(light).or_default();
        planners.retain(|view, _| cascades.cascades.contains_key(view));

        let mut written = None;
        for (&view, cascades) in &mut cascades.cascades {
            let planner = planners.entry(view).or_insert_with(planner);
            let boxes = kept.boxes.entry(view).or_default();
            match asked.plan(view, planner, boxes, &input) {
                None => {}
                Some(Ok(plan)) => {
                    write(cascades, &plan.maps);
                    written = Some(config_of(&plan.maps, &technique, &user, distance));
                }
                Some(Err(error)) => {
                    status.problem =
                        Some(format!("the cascades of {light} stay Bevy's own: {error}"));
                }
            }
        }
        if let Some(problem) = &status.problem {
            kept.warn_once(problem.clone());
        }
        let Some(written) = written else { continue };
        if !is_same(&config, &written) {
            config.clone_from(&written);
        }
        match own {
            Some(mut own) => (own.config, own.written) = (user, written),
            None => {
                commands.entity(light).insert(OwnConfig { config: user, written });
            }
        }
    }
    status.planning = begin.elapsed();
}

/// The number of parts that receivers are divided into. It halves the time of plans; what it costs
/// in error is in docs/measured.md.
const PARTS: usize = 12;

fn planner() -> Planner {
    let mut planner = Planner::new();
    planner.set_most_parts(PARTS).expect("fewer than the most");
    planner
}

/// What a light asks for.
struct Asked {
    sun: Light,
    technique: Technique,
    distance: f32,
    receivers: Receivers,
}

impl Asked {
    /// The plan for one view; `None` if nothing is drawn for it.
    fn plan<'a>(
        &self,
        view: Entity,
        planner: &'a mut Planner,
        boxes: &mut Boxes,
        input: &Input,
    ) -> Option<Result<&'a Plan, umbrage::Error>> {
        let (pose, projection, camera, visible, filter, sees_fog) = input.views.get(view).ok()?;
        let image = camera.physical_target_size()?.to_array();
        let technique = Technique { filter: filter_of(filter), ..self.technique };
        let mut bounds = Bounds::default();
        match self.receivers {
            // Fog is lit in all the air that the camera sees.
            _ if sees_fog || technique.cover == Cover::Stable => {}
            Receivers::View => {}
            Receivers::Box(aabb) => {
                let [min, max] = [aabb.min, aabb.max].map(|corner| vector(corner.to_array()));
                bounds.receivers = Some(umbrage::Aabb { min, max });
            }
            Receivers::Meshes => {
                bounds.receiver_parts = boxes.tree(&input.meshes, visible);
                bounds.receivers = bounds.receiver_parts.map(BoxTree::bounds);
            }
        }
        let camera = UmbrageCamera::from_matrices(
            double(pose.to_matrix()),
            double(projection.get_clip_from_view()),
            ClipDepth::ZeroToOne,
            Some(f64::from(self.distance)),
            image,
        );
        Some(camera.and_then(|camera| planner.plan(&camera, &[self.sun], &bounds, &technique)))
    }
}

/// A filter that reads as far as Bevy's.
fn filter_of(filter: Option<&ShadowFilteringMethod>) -> Filter {
    match filter.copied().unwrap_or_default() {
        ShadowFilteringMethod::Hardware2x2 => Filter::Pcf { n: 1 },
        ShadowFilteringMethod::Gaussian | ShadowFilteringMethod::Temporal => Filter::Pcf { n: 4 },
    }
}

/// All views of a light share the ends of its cascades. Slices that follow from what one view sees
/// do not fit the others, so all take slices as Bevy divides them. `CascadeShadowConfigBuilder` has
/// the same formula, but panics at a bad distance.
fn share_splits(technique: &mut Technique, user: &CascadeShadowConfig, distance: f32) {
    let slices = technique.partition.slices as usize;
    let first = user.bounds.first().copied().filter(|first| *first < distance);
    // Bevy's first cascade ends at a fifteenth of its distance.
    let first = first.unwrap_or(distance / 15.0);
    let ratio = (distance / first).powf(1.0 / (slices.max(2) - 1) as f32);
    let mut ends = [0.0; Partition::MAX_SLICES - 1];
    for (i, end) in ends.iter_mut().take(slices - 1).enumerate() {
        *end = f64::from(first * ratio.powi(i as i32));
    }
    technique.partition.splits = Splits::At(ends);
}

/// The configuration by which Bevy chooses and blends these cascades. Bevy blends over a share of
/// each cascade's end distance, which is the same for all.
fn config_of(
    maps: &[ShadowMap],
    technique: &Technique,
    user: &CascadeShadowConfig,
    distance: f32,
) -> CascadeShadowConfig {
    let last = maps.len() - 1;
    let overlap = technique.partition.overlap;
    let ends = |i: usize| {
        let [start, end] = maps[i].split;
        (end, end + overlap * (end - start))
    };
    let mut bounds: Vec<f32> = (0..last).map(|i| ends(i).1 as f32).collect();
    bounds.push(distance);
    let blend = (0..last).map(ends).map(|(end, faded)| 1.0 - end / faded).reduce(f64::min);
    CascadeShadowConfig {
        bounds,
        overlap_proportion: blend.unwrap_or_default().max(0.0) as f32,
        minimum_distance: user.minimum_distance,
    }
}

/// Writes planned maps as Bevy's cascades. Maps without receivers leave Bevy's cascade.
fn write(cascades: &mut Vec<Cascade>, maps: &[ShadowMap]) {
    let Some(last) = cascades.last().cloned() else { return };
    cascades.resize(maps.len(), last);
    for (map, cascade) in maps.iter().zip(cascades) {
        if map.is_empty() {
            continue;
        }
        let mut clip_from_world = CLIP_FROM_SHADOW * map.shadow_from_world();
        // Bevy leaves out the back faces of casters, and must find those that it found in its own
        // cascade.
        let is_mirrored = |determinant: f64| determinant.is_sign_negative();
        let bevys = double(cascade.clip_from_world).determinant();
        if is_mirrored(clip_from_world.determinant()) != is_mirrored(bevys) {
            clip_from_world = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * clip_from_world;
        }
        // Bevy's depth passes use `clip_from_world`; the other two agree with it.
        cascade.clip_from_cascade = single(clip_from_world * double(cascade.world_from_cascade));
        cascade.clip_from_world = single(clip_from_world);
        cascade.texel_size = largest_texel(map) as f32;
    }
}

/// Shadow space has t downwards and depth away from the light, both from 0 to 1; Bevy's clip space
/// has y upwards and depth towards the light.
const CLIP_FROM_SHADOW: DMat4 = DMat4::from_cols_array(&[
    2.0, 0.0, 0.0, 0.0, //
    0.0, -2.0, 0.0, 0.0, //
    0.0, 0.0, -1.0, 0.0, //
    -1.0, 1.0, 1.0, 1.0,
]);

/// The longest side of a texel across the light's beam, metres, at the corners of the map. Other
/// plugins may read it of the cascade.
fn largest_texel(map: &ShadowMap) -> f64 {
    let [step_s, step_t] = map.resolution.map(|n| 1.0 / f64::from(n));
    let side = |at: DVec2, step: DVec2| {
        let (Some(from), Some(to)) = (map.beam(at), map.beam(at + step)) else { return 0.0 };
        (to.origin - from.origin).reject_from(from.direction).length()
    };
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
        .map(DVec2::from)
        .iter()
        .flat_map(|&at| [side(at, DVec2::X * step_s), side(at, DVec2::Y * step_t)])
        .fold(0.0, f64::max)
}
