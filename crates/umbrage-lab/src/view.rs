//! Views: what may be asked for, and what is taken.

use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::{Aabb, Camera, LookAt};
use umbrage_scene::{Scene, SceneCamera};

/// What a view has of itself where neither user nor scene says more.
const DEFAULT_VIEW: LookAt = LookAt {
    eye: DVec3::ZERO,
    target: DVec3::NEG_Z,
    up: DVec3::Y,
    fov_y_rad: std::f64::consts::FRAC_PI_3,
    near: 0.1,
    far: 100.0,
    image: [960, 540],
};

/// The view that somebody asks for. What is left out comes from the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewOptions {
    /// Position of the viewer, metres; not with a camera.
    pub eye: Option<DVec3>,
    /// Point in the middle of the picture, metres; not with a camera.
    pub target: Option<DVec3>,
    /// Direction that is up in the picture, of any length; not with a camera.
    pub up: Option<DVec3>,
    /// Vertical field of view, degrees, 0.01 to 179.
    pub fov_deg: Option<f64>,
    /// Distance at which the view begins, metres, above 0.
    pub near: Option<f64>,
    /// Distance at which it ends, metres, above `near`.
    pub far: Option<f64>,
    /// Size of the picture, pixels; 1 to 16384 each way, at most 2²⁶ in all.
    pub size: [u32; 2],
    /// A camera of the scene, by name.
    pub camera: Option<String>,
}

impl Default for ViewOptions {
    /// The scene's own view in 960 × 540 pixels.
    fn default() -> Self {
        Self {
            eye: None,
            target: None,
            up: None,
            fov_deg: None,
            near: None,
            far: None,
            size: DEFAULT_VIEW.image,
            camera: None,
        }
    }
}

impl ViewOptions {
    /// That each value makes sense, and that they go together.
    ///
    /// # Errors
    /// The first that does not.
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
        each(Field::Near, self.near, values::metres)?;
        each(Field::Far, self.far, values::metres)?;
        let own = [(Field::Eye, self.eye), (Field::Target, self.target), (Field::Up, self.up)];
        if let Some(&(by, _)) = own.iter().find(|(_, v)| self.camera.is_some() && v.is_some()) {
            return Err(Error::Excluded { field: Field::Camera, by });
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

/// A view, and where it came from.
#[derive(Clone, Debug)]
pub struct ChosenView {
    /// The camera's name in the scene, if it is from there and was not changed.
    pub name: Option<String>,
    /// As described.
    pub look_at: LookAt,
    /// As planned with.
    pub camera: Camera,
}

impl ChosenView {
    /// As reports tell it.
    pub fn info(&self) -> umbrage_measure::View {
        let look_at = &self.look_at;
        umbrage_measure::View {
            name: self.name.clone(),
            eye: look_at.eye.to_array(),
            target: look_at.target.to_array(),
            up: look_at.up.to_array(),
            fov: look_at.fov_y_rad.to_degrees(),
            near: look_at.near,
            far: look_at.far,
        }
    }
}

/// The view that is asked for. What is left open comes from the scene's camera; a view with an eye
/// and a target of its own owes the scene only the depth range.
///
/// # Errors
/// A camera that the scene does not have, or a view that no camera can have.
pub fn choose_view(options: &ViewOptions, scene: Option<&Scene>) -> Result<ChosenView, Error> {
    let own = match (scene, options.eye, options.target) {
        (None, ..) | (_, Some(_), Some(_)) => None,
        (Some(scene), ..) => Some(scene_camera(options, scene)?),
    };
    let base = own.as_ref().map_or(DEFAULT_VIEW, |c| c.look_at(options.size));
    let mut look_at = LookAt {
        eye: options.eye.unwrap_or(base.eye),
        target: options.target.unwrap_or(base.target),
        up: options.up.unwrap_or(base.up),
        fov_y_rad: options.fov_deg.map_or(base.fov_y_rad, f64::to_radians),
        near: options.near.unwrap_or(base.near),
        far: options.far.unwrap_or(base.far),
        image: options.size,
    };
    let moved = options.eye.is_some() || options.target.is_some();
    if let Some(scene) = scene
        && moved
    {
        let [near, far] = depth_range(&look_at, scene.bounds());
        look_at.far = options.far.unwrap_or(far.max(options.near.unwrap_or(0.0) * 2.0));
        look_at.near = options.near.unwrap_or(near.min(look_at.far / 2.0));
    }
    let camera = Camera::look_at(look_at).map_err(Error::Planning)?;
    let numbers = [options.near, options.far, options.fov_deg];
    let changed = numbers.iter().any(Option::is_some) || options.up.is_some();
    let name = own.map(|c| c.name).filter(|name| {
        !moved && !changed && scene.is_some_and(|s| s.cameras.iter().any(|c| c.name == *name))
    });
    Ok(ChosenView { name, look_at, camera })
}

fn scene_camera(options: &ViewOptions, scene: &Scene) -> Result<SceneCamera, Error> {
    let Some(name) = &options.camera else { return Ok(scene.default_view()) };
    let index = find(Field::Camera, name, scene.cameras.iter().map(|c| c.name.as_str()))?;
    Ok(scene.cameras[index].clone())
}

/// A depth range for a view from anywhere: up to the end of the scene, from a thousandth of that or
/// from where the scene begins.
fn depth_range(look_at: &LookAt, bounds: Aabb) -> [f64; 2] {
    let forward = (look_at.target - look_at.eye).normalize_or(DVec3::NEG_Z);
    let far = bounds.corners().iter().map(|&c| forward.dot(c - look_at.eye)).fold(0.0, f64::max);
    let far = if far > 0.0 { far * 1.01 } else { 100.0 };
    let distance = look_at.eye.distance(look_at.eye.clamp(bounds.min, bounds.max));
    // The scene's nearest point may appear in the picture's corner, where depth is less than
    // distance.
    let corner = {
        let tan_y = (look_at.fov_y_rad / 2.0).tan();
        let tan_x = tan_y * f64::from(look_at.image[0]) / f64::from(look_at.image[1]);
        (1.0 + tan_x * tan_x + tan_y * tan_y).sqrt()
    };
    [(distance / corner).max(far / 1000.0), far]
}
