//! Views: the options that a user may give, and the view that follows from them.

use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::{Aabb, Camera};
use umbrage_scene::{Lens, Scene, SceneCamera};

/// Default values of a view, for what neither the user nor the scene gives.
const DEFAULT_VIEW: SceneCamera = SceneCamera {
    name: String::new(),
    eye: DVec3::ZERO,
    target: DVec3::NEG_Z,
    up: DVec3::Y,
    lens: Lens::Perspective { fov_y_rad: std::f64::consts::FRAC_PI_3 },
    near: 0.1,
    far: 100.0,
};

/// Width and height of pictures where none are given, pixels.
const DEFAULT_SIZE: [u32; 2] = [960, 540];

/// The view that a user asks for. Values that are left out come from the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewOptions {
    /// Position of the viewer, metres; cannot be combined with `camera`.
    pub eye: Option<DVec3>,
    /// Point in the middle of the picture, metres; cannot be combined with `camera`.
    pub target: Option<DVec3>,
    /// Upward direction in the picture, of any length; cannot be combined with `camera`.
    pub up: Option<DVec3>,
    /// Vertical field of view of a perspective view, degrees, 0.01 to 179.
    pub fov_deg: Option<f64>,
    /// Height of what an orthographic view shows, metres; cannot be combined with `fov_deg`.
    pub ortho: Option<f64>,
    /// Near distance of the view, metres, above 0.
    pub near: Option<f64>,
    /// Far distance of the view, metres, above `near`.
    pub far: Option<f64>,
    /// Width and height of the picture, pixels; 1 to 16384 each, at most 2²⁶ pixels in all.
    pub size: [u32; 2],
    /// Name of a camera of the scene.
    pub camera: Option<String>,
}

impl Default for ViewOptions {
    /// The scene's own view, with 960 × 540 pixels.
    fn default() -> Self {
        Self {
            eye: None,
            target: None,
            up: None,
            fov_deg: None,
            ortho: None,
            near: None,
            far: None,
            size: DEFAULT_SIZE,
            camera: None,
        }
    }
}

impl ViewOptions {
    /// Checks each value and their combination.
    ///
    /// # Errors
    /// An error about the first value that is invalid or cannot be combined with another one.
    pub fn check(&self) -> Result<(), Error> {
        fn each<T: Copy>(
            field: Field,
            value: Option<T>,
            check: fn(T) -> Result<T, String>,
        ) -> Result<(), Error> {
            value.map_or(Ok(()), |v| check(v).map(drop)).map_err(|p| Error::field(field, p))
        }
        each(Field::Size, Some(self.size), values::pixels)?;
        each(Field::Eye, self.eye, values::position)?;
        each(Field::Target, self.target, values::position)?;
        each(Field::Up, self.up, values::pointing)?;
        each(Field::Fov, self.fov_deg, values::opening)?;
        each(Field::Ortho, self.ortho, values::metres)?;
        each(Field::Near, self.near, values::metres)?;
        each(Field::Far, self.far, values::metres)?;
        let own = [(Field::Eye, self.eye), (Field::Target, self.target), (Field::Up, self.up)];
        if let Some(&(by, _)) = own.iter().find(|(_, v)| self.camera.is_some() && v.is_some()) {
            return Err(Error::Excluded { field: Field::Camera, by });
        }
        if self.fov_deg.is_some() && self.ortho.is_some() {
            return Err(Error::Excluded { field: Field::Fov, by: Field::Ortho });
        }
        match (self.near, self.far) {
            (Some(near), Some(far)) if near >= far => return Err(Error::Ends { near, far }),
            _ => {}
        }
        match (self.eye, self.target) {
            (Some(eye), Some(target)) if eye == target => Err(Error::LooksAtEye { eye }),
            _ => Ok(()),
        }
    }
}

/// A view, and the camera of the scene that it comes from, if any.
#[derive(Clone, Debug)]
pub struct ChosenView {
    /// Name of the scene's camera, if the view is that of a camera and was not changed.
    pub name: Option<String>,
    /// The view's eye, target, lens and depth range.
    pub view: SceneCamera,
    /// The same view in the form that the planner takes, with the picture's size.
    pub camera: Camera,
}

impl ChosenView {
    /// Returns the view in the form that reports show.
    pub fn info(&self) -> umbrage_measure::View {
        let SceneCamera { eye, target, up, lens, near, far, .. } = self.view;
        let (fov, ortho) = match lens {
            Lens::Perspective { fov_y_rad } => (Some(fov_y_rad.to_degrees()), None),
            Lens::Orthographic { height } => (None, Some(height)),
        };
        umbrage_measure::View {
            name: self.name.clone(),
            eye: eye.to_array(),
            target: target.to_array(),
            up: up.to_array(),
            fov,
            ortho,
            near,
            far,
        }
    }
}

/// Returns the view that is asked for. Values that are left out come from the scene's camera. If
/// both the eye and the target are given, only the depth range comes from the scene.
///
/// # Errors
/// An error if the scene has no camera of that name, or if the view is not one that a camera can
/// have.
pub fn choose_view(options: &ViewOptions, scene: Option<&Scene>) -> Result<ChosenView, Error> {
    let own = match (scene, options.eye, options.target) {
        (None, ..) | (_, Some(_), Some(_)) => None,
        (Some(scene), ..) => Some(scene_camera(options, scene)?),
    };
    let base = own.clone().unwrap_or(DEFAULT_VIEW);
    let lens = match (options.fov_deg, options.ortho) {
        (Some(deg), _) => Lens::Perspective { fov_y_rad: deg.to_radians() },
        (None, Some(height)) => Lens::Orthographic { height },
        (None, None) => base.lens,
    };
    let mut view = SceneCamera {
        eye: options.eye.unwrap_or(base.eye),
        target: options.target.unwrap_or(base.target),
        up: options.up.unwrap_or(base.up),
        lens,
        near: options.near.unwrap_or(base.near),
        far: options.far.unwrap_or(base.far),
        name: base.name,
    };
    let moved = options.eye.is_some() || options.target.is_some();
    if let Some(scene) = scene
        && moved
    {
        let [near, far] = depth_range(&view, options.size, scene.bounds());
        view.far = options.far.unwrap_or(far.max(options.near.unwrap_or(0.0) * 2.0));
        view.near = options.near.unwrap_or(near.min(view.far / 2.0));
    }
    let camera = view.camera(options.size).map_err(Error::Planning)?;
    let numbers = [options.near, options.far, options.fov_deg, options.ortho];
    let changed = numbers.iter().any(Option::is_some) || options.up.is_some();
    let name = own.map(|c| c.name).filter(|name| {
        !moved && !changed && scene.is_some_and(|s| s.cameras.iter().any(|c| c.name == *name))
    });
    Ok(ChosenView { name, view, camera })
}

fn scene_camera(options: &ViewOptions, scene: &Scene) -> Result<SceneCamera, Error> {
    let Some(name) = &options.camera else { return Ok(scene.default_view()) };
    let index = find(Field::Camera, name, scene.cameras.iter().map(|c| c.name.as_str()))?;
    Ok(scene.cameras[index].clone())
}

/// Returns near and far distances for a view from any position. The far distance is where the scene
/// ends. The near distance is where it begins, but at least a thousandth of the far distance; in
/// orthographic views it is 0.
fn depth_range(view: &SceneCamera, size: [u32; 2], bounds: Aabb) -> [f64; 2] {
    let &SceneCamera { eye, target, lens, .. } = view;
    let forward = (target - eye).normalize_or(DVec3::NEG_Z);
    let far = bounds.corners().iter().map(|&c| forward.dot(c - eye)).fold(0.0, f64::max);
    let far = if far > 0.0 { far * 1.01 } else { 100.0 };
    let Lens::Perspective { fov_y_rad } = lens else { return [0.0, far] };
    let distance = eye.distance(eye.clamp(bounds.min, bounds.max));
    // The scene's nearest point may lie in a corner of the picture, where the depth is less than
    // the distance.
    let corner = {
        let tan_y = (fov_y_rad / 2.0).tan();
        let tan_x = tan_y * f64::from(size[0]) / f64::from(size[1]);
        (1.0 + tan_x * tan_x + tan_y * tan_y).sqrt()
    };
    [(distance / corner).max(far / 1000.0), far]
}
