//! Cameras and lights at the nodes that hold them.

use crate::types::{Lens, SceneCamera, SceneLight};
use glam::{DAffine3, DVec3};
use umbrage::{Aabb, Light, PointLight, SpotLight};

/// Ratio of the near distance, where the shadows of a spot or point light begin, to its range: a
/// centimetre for a range of 10 m.
const NEAR_SHARE: f64 = 1e-3;

/// Smallest and largest range of a spot or point light, metres. The planner accepts the near
/// distances of these ranges, and the largest range is the end of its world.
const RANGES: [f64; 2] = [1e-9, 1e12];

/// What a camera is without its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Optics {
    pub(crate) lens: Lens,
    /// Metres.
    pub(crate) near: f64,
    /// Metres; `None` if the view ends where the scene does.
    pub(crate) far: Option<f64>,
}

/// What a light is without its place. Ranges are in metres; a light without one reaches to the end
/// of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shine {
    Directional,
    Point { range: Option<f64> },
    Spot { half_angle_rad: f64, range: Option<f64> },
}

/// A camera at a node that some clip moves.
#[derive(Clone, Debug)]
pub(crate) struct HeldCamera {
    /// Index into [`Scene::cameras`](crate::Scene::cameras).
    pub(crate) camera: usize,
    /// Index of the node that holds it.
    pub(crate) node: usize,
    pub(crate) optics: Optics,
    /// The camera at rest.
    pub(crate) rest: SceneCamera,
}

/// A light at a node that some clip moves.
#[derive(Clone, Debug)]
pub(crate) struct HeldLight {
    /// Index into [`Scene::lights`](crate::Scene::lights).
    pub(crate) light: usize,
    /// Index of the node that holds it.
    pub(crate) node: usize,
    pub(crate) shine: Shine,
    /// The light at rest.
    pub(crate) rest: Light,
}

impl Optics {
    /// The camera, without a name, at a node in a scene that ends at `bounds`; `None` if the node
    /// has no direction.
    pub(crate) fn camera(&self, world_from_node: &DAffine3, bounds: Aabb) -> Option<SceneCamera> {
        let m = world_from_node.matrix3;
        let (forward, up) = ((-m.z_axis).try_normalize()?, m.y_axis.try_normalize()?);
        let eye = world_from_node.translation;
        let Self { lens, near, far } = *self;
        let far = far.unwrap_or_else(|| farthest(bounds, |p| forward.dot(p - eye)).max(2.0 * near));
        // The target is as far away as the far distance, so that the direction survives rounding
        // anywhere.
        let target = eye + forward * far;
        let name = String::new();
        let is_finite = target.is_finite() && far.is_finite();
        is_finite.then_some(SceneCamera { name, eye, target, up, lens, near, far })
    }
}

impl Shine {
    /// The light at a node in a scene that ends at `bounds`; `None` if the node has no direction,
    /// but the light has.
    pub(crate) fn light(&self, world_from_node: &DAffine3, bounds: Aabb) -> Option<Light> {
        let direction = (-world_from_node.matrix3.z_axis).try_normalize();
        let position = world_from_node.translation;
        if !position.is_finite() {
            return None;
        }
        let reach = || farthest(bounds, |p| p.distance(position));
        Some(match *self {
            Self::Directional => Light::Directional { direction: direction? },
            Self::Point { range } => {
                let [near, range] = near_and_range(range, reach());
                Light::Point(PointLight { position, near, range })
            }
            Self::Spot { half_angle_rad, range } => {
                let [near, range] = near_and_range(range, reach());
                let direction = direction?;
                Light::Spot(SpotLight { position, direction, half_angle_rad, near, range })
            }
        })
    }
}

impl HeldCamera {
    /// Moves the camera to where its node is.
    pub(crate) fn place(&self, world: &DAffine3, bounds: Aabb, camera: &mut SceneCamera) {
        let placed = self.optics.camera(world, bounds).unwrap_or_else(|| self.rest.clone());
        *camera = SceneCamera { name: std::mem::take(&mut camera.name), ..placed };
    }
}

impl HeldLight {
    /// Moves the light to where its node is.
    pub(crate) fn place(&self, world: &DAffine3, bounds: Aabb, light: &mut SceneLight) {
        light.light = self.shine.light(world, bounds).unwrap_or(self.rest);
    }
}

/// The near distance, where the shadows of a spot or point light begin, and the distance where its
/// light ends, metres. A light without a range reaches all of the scene, which extends to `reach`
/// metres from the light. A range beyond `reach` does not make shadows begin any later.
fn near_and_range(range: Option<f64>, reach: f64) -> [f64; 2] {
    let [least, most] = RANGES;
    let reach = reach.clamp(1e-3, most);
    let range = range.map_or(reach, |range| range.clamp(least, most));
    [range.min(reach) * NEAR_SHARE, range]
}

/// The largest value that `distance` has in a box, increased by 1%.
fn farthest(bounds: Aabb, distance: impl Fn(DVec3) -> f64) -> f64 {
    bounds.corners().into_iter().map(distance).fold(0.0, f64::max) * 1.01
}
