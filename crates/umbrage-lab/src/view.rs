//! Views: the options that a user may give, and the view that follows from them.

use crate::defaults::Defaults;
use crate::error::{Error, Field};
use crate::scene::find;
use crate::values;
use glam::DVec3;
use umbrage::Camera;
use umbrage_scene::{Lens, Scene, SceneCamera};

/// Largest ratio of far to near distance that is chosen. Depths beyond it have hardly any digits
/// left near the viewer.
const MAX_DEPTH_RATIO: f64 = 1e6;
/// The near distance that is chosen, as a share of the least depth of any surface, so that rounding
/// cuts nothing away.
const BEFORE_THE_NEAREST: f64 = 0.99;

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
    /// A camera of the scene, by a word that [chooses](umbrage_scene::Choices) it.
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
    /// The word that chooses the scene's camera, if the view is that of a camera and was not
    /// changed.
    pub name: Option<String>,
    /// The view's eye, target, lens and depth range.
    pub view: SceneCamera,
    /// The same view in the form that the planner takes, with the picture's size.
    pub camera: Camera,
    /// What the user should know of the view: what its near plane cuts away.
    pub notices: Vec<String>,
}

impl ChosenView {
    /// Returns the view in the form that reports show.
    pub fn info(&self) -> umbrage_measure::View {
        Self::info_of(self.name.clone(), &self.view)
    }

    /// Returns any view in the form that reports show.
    pub fn info_of(name: Option<String>, view: &SceneCamera) -> umbrage_measure::View {
        let &SceneCamera { eye, target, up, lens, near, far, .. } = view;
        let (fov, ortho) = match lens {
            Lens::Perspective { fov_y_rad } => (Some(fov_y_rad.to_degrees()), None),
            Lens::Orthographic { height } => (None, Some(height)),
        };
        umbrage_measure::View {
            name,
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
/// both the eye and the target are given, only the depth range comes from the scene. A near
/// distance that neither the user nor the scene's file gives is less than the depth of whatever
/// lies before the eye.
///
/// # Errors
/// An error if the scene has no such camera, or if the view is not one that a camera can have.
pub fn choose_view(options: &ViewOptions, defaults: &Defaults<'_>) -> Result<ChosenView, Error> {
    let scene = defaults.scene();
    let own = match (scene, options.eye, options.target) {
        (None, ..) | (_, Some(_), Some(_)) => None,
        (Some(scene), ..) => Some(own_camera(options, scene, defaults)?),
    };
    let base = own.as_ref().map_or(DEFAULT_VIEW, |own| own.camera.clone());
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
    let mut notices = Vec::new();
    let is_from_file = own.as_ref().is_some_and(|own| own.word.is_some()) && !moved;
    if let Some(scene) = scene {
        let end = || view.end_of(scene.bounds());
        let far = match options.far {
            None if moved => Some(end()),
            // A camera of the file may reach as far as the sky, on which no map is spent.
            None if scene.sky.is_some() && is_from_file => Some(end().min(view.far)),
            _ => None,
        };
        if let Some(far) = far {
            view.far = far.max(options.near.unwrap_or(0.0) * 2.0);
        }
        if options.near.is_none() {
            // What is nearer is found below; this only has to be a valid view.
            view.near = view.near.min(view.far / 2.0);
        }
        let nearest = scene.nearest_depth(&view.camera(options.size).map_err(Error::Planning)?);
        let least = view.far / MAX_DEPTH_RATIO;
        let before_all = |nearest: f64| (nearest * BEFORE_THE_NEAREST).max(least);
        if options.near.is_none() && !is_from_file {
            let near = match lens {
                Lens::Perspective { .. } => nearest.map_or(view.far / 1000.0, before_all),
                // Depths are spread evenly, so nothing is gained by a later beginning.
                Lens::Orthographic { .. } => 0.0,
            };
            // Where the program composed the view, it begins well before the nearest surface.
            let is_cut = nearest.is_some_and(|nearest| nearest < view.near);
            if moved || is_cut {
                view.near = near.min(view.far / 2.0);
            }
        }
        let round = |metres: f64| format!("{metres:.2e}").parse().unwrap_or(metres);
        notices.extend(nearest.filter(|&nearest| nearest < view.near).map(|nearest| {
            let [near, nearest] = [view.near, nearest].map(round);
            format!("the near plane at {near} m cuts surfaces away, which begin at {nearest} m")
        }));
    }
    let camera = view.camera(options.size).map_err(Error::Planning)?;
    let numbers = [options.near, options.far, options.fov_deg, options.ortho];
    let changed = numbers.iter().any(Option::is_some) || options.up.is_some();
    let name = own.and_then(|own| own.word).filter(|_| !moved && !changed);
    Ok(ChosenView { name, view, camera, notices })
}

/// A camera of the scene or, without a word, the view that was composed for it.
struct OwnCamera {
    camera: SceneCamera,
    word: Option<String>,
}

fn own_camera(
    options: &ViewOptions,
    scene: &Scene,
    defaults: &Defaults<'_>,
) -> Result<OwnCamera, Error> {
    let choices = scene.camera_choices();
    let index = match &options.camera {
        Some(word) => Some(find(Field::Camera, word, &choices)?),
        None => (!choices.is_empty()).then_some(0),
    };
    Ok(match index {
        Some(index) => OwnCamera {
            camera: scene.cameras[index].clone(),
            word: choices.words(index).into_iter().next(),
        },
        None => OwnCamera { camera: defaults.view(scene).clone(), word: None },
    })
}
