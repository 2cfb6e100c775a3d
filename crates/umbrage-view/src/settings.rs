//! What a window shows: the scene, the view, the light, the techniques and how they are compared.

use crate::pose::Pose;
use crate::stage::{Overlay, Request, SceneInfo, Shining};
use crate::sun::Sun;
use umbrage::visibility::LightSize;
use umbrage::{Aabb, Camera, Light, LookAt, Orthographic};
use umbrage_lab::{Fit, NamedTechnique, SceneOptions};
use umbrage_scene::Lens;

/// The state of a window that a session can keep.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    /// A path, or the name of a built-in scene.
    pub(crate) scene: String,
    pub(crate) changes: SceneOptions,
    /// Whether alpha masks are ignored.
    pub(crate) opaque: bool,
    pub(crate) pose: Pose,
    /// The word of the scene's camera that the view is of, as long as it is not moved.
    pub(crate) camera: Option<String>,
    pub(crate) lens: Lens,
    /// Distances at which the view begins and ends, metres; `None`: they follow from the scene.
    pub(crate) near: Option<f64>,
    pub(crate) far: Option<f64>,
    pub(crate) light: LightSetting,
    /// The size of the light that soft techniques are measured by.
    pub(crate) light_size: Option<LightSize>,
    /// The texts of the technique shown, and of the one that it is compared with.
    pub(crate) techniques: [String; 2],
    pub(crate) compare: Compare,
    pub(crate) overlay: OverlayKind,
    pub(crate) fit: Fit,
    /// A clip of the scene's animations, and the time in it, seconds.
    pub(crate) clip: Option<usize>,
    pub(crate) time_s: f64,
    pub(crate) is_playing: bool,
    /// The camera whose plan is kept while the view goes elsewhere.
    pub(crate) frozen: Option<Camera>,
    /// Whether wrong pixels are counted while the view rests.
    pub(crate) counts_errors: bool,
    /// Whether dragging turns the head; else it moves the eye around the target.
    pub(crate) is_flying: bool,
    /// Share of the window's pixels to each side that are drawn.
    pub(crate) resolution: f32,
}

/// Where the light comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LightSetting {
    /// A sun.
    Sun(Sun),
    /// A sun by the time of day, hours.
    Hour(f64),
    /// Parallel light along the view.
    Headlight,
    /// A light of the scene, by the word that chooses it.
    Named(String),
}

/// How two pictures are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Compare {
    /// Only one is shown.
    #[default]
    Alone,
    /// One beside the other.
    Beside,
    /// One to each side of a line that can be dragged.
    Wipe,
    /// In turn.
    Flip,
}

impl Compare {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 4] = [
        (Self::Alone, "alone", "Show the first technique alone."),
        (Self::Beside, "side by side", "Show both techniques beside each other."),
        (Self::Wipe, "wipe", "Show one technique to each side of a line that you can drag."),
        (Self::Flip, "flip", "Show both techniques in turn, once a second; hold B for the second."),
    ];

    /// Whether a second picture is needed.
    pub(crate) fn is_of_two(self) -> bool {
        self != Self::Alone
    }
}

/// What is shown over or in place of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum OverlayKind {
    #[default]
    None,
    Error,
    Grid,
    Maps,
    Difference,
}

impl OverlayKind {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::None, "none", "Show the plain pictures."),
        (Self::Error, "error", "Show how many pixels wide a texel is: above 1, edges are jagged."),
        (Self::Grid, "grid", "Show every fifth line of the texels' grid on the surfaces."),
        (Self::Maps, "maps", "Tint each surface by the map that serves it."),
        (Self::Difference, "difference", "Show false light and false shadow, once the view rests."),
    ];

    fn on_gpu(self) -> Option<Overlay> {
        match self {
            Self::None | Self::Difference => None,
            Self::Error => Some(Overlay::Error),
            Self::Grid => Some(Overlay::Grid),
            Self::Maps => Some(Overlay::Maps),
        }
    }
}

/// The word that stands for ray-traced truth where a second technique is asked for.
pub(crate) const TRUTH: &str = "truth";

impl Settings {
    /// The settings of a scene that is about to be opened.
    pub(crate) fn new(scene: &str) -> Self {
        Self {
            scene: scene.to_owned(),
            changes: SceneOptions::default(),
            opaque: false,
            pose: Pose::new(glam::DVec3::ZERO, glam::DVec3::NEG_Z, glam::DVec3::Y),
            camera: None,
            lens: Lens::Perspective { fov_y_rad: std::f64::consts::FRAC_PI_3 },
            near: None,
            far: None,
            light: LightSetting::Sun(Sun { azimuth_deg: 135.0, elevation_deg: 45.0 }),
            light_size: None,
            techniques: ["adaptive:pcf3@1024".into(), "uniform:pcf3@1024".into()],
            compare: Compare::default(),
            overlay: OverlayKind::default(),
            fit: Fit::Surfaces,
            clip: None,
            time_s: 0.0,
            is_playing: false,
            frozen: None,
            counts_errors: true,
            is_flying: false,
            resolution: 1.0,
        }
    }

    /// Takes the view and the light that a scene begins with.
    pub(crate) fn begin_with(&mut self, info: &SceneInfo) {
        self.look_from(info.view_name.clone(), &info.view, info);
        self.shine(info);
        self.frozen = None;
        self.clip = None;
        self.is_playing = false;
    }

    /// Takes the light that a scene begins with.
    pub(crate) fn shine(&mut self, info: &SceneInfo) {
        self.light = match (&info.light_name, info.light) {
            (Some(name), _) => LightSetting::Named(name.clone()),
            (None, Light::Directional { direction }) => {
                LightSetting::Sun(Sun::from_direction(direction))
            }
            // A lamp of the scene has a name.
            (None, _) => LightSetting::Headlight,
        };
    }

    /// Takes a view, which is that of the scene's camera of this name, if there is a name.
    pub(crate) fn look_from(
        &mut self,
        name: Option<String>,
        view: &umbrage_scene::SceneCamera,
        info: &SceneInfo,
    ) {
        self.pose = Pose::new(view.eye, view.target, view.up);
        if self.pose.distance() > 0.999 * view.far {
            // Cameras of files have no target, and get one at the far distance. The view shall turn
            // around what it shows, and go as fast as its distance suggests.
            let shown = info.first_box(view.eye, self.pose.forward());
            if let Some(distance) = shown.filter(|d| (view.near..view.far).contains(d)) {
                self.pose.target = view.eye + self.pose.forward() * distance;
            }
        }
        self.lens = view.lens;
        self.camera = name;
        let is_of_file = self.camera.is_some();
        self.near = is_of_file.then_some(view.near);
        self.far = is_of_file.then_some(view.far);
    }

    /// Notes that the view moved, so that it is no longer that of the scene's camera.
    pub(crate) fn moved(&mut self) {
        if self.camera.take().is_some() {
            self.near = None;
            self.far = None;
        }
    }

    /// The camera of a picture of this size.
    ///
    /// # Errors
    /// Names the value that no camera can have.
    pub(crate) fn camera(
        &self,
        info: &SceneInfo,
        image: [u32; 2],
    ) -> Result<Camera, umbrage::Error> {
        self.camera_at(&self.pose, info, image)
    }

    /// The camera of another pose.
    ///
    /// # Errors
    /// As for [`camera`](Self::camera).
    pub(crate) fn camera_at(
        &self,
        pose: &Pose,
        info: &SceneInfo,
        image: [u32; 2],
    ) -> Result<Camera, umbrage::Error> {
        let &Pose { eye, target, up } = pose;
        let wide = |near, far| match self.lens {
            Lens::Perspective { fov_y_rad } => {
                Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image })
            }
            Lens::Orthographic { height } => {
                Camera::orthographic(Orthographic { eye, target, up, height, near, far, image })
            }
        };
        // Any range will do to find where the surfaces begin and end.
        let [near, far] = depth_range(&wide(1e-3, 1e3)?, info);
        let far = self.far.unwrap_or(far);
        let near = self.near.unwrap_or(near).min(far * 0.5);
        wide(near, self.far.unwrap_or(far.max(2.0 * near)))
    }

    /// The light of a frame.
    pub(crate) fn light(&self, info: &SceneInfo) -> Shining {
        let sun = |direction| Shining::Light(Light::Directional { direction });
        match (self.sun(), &self.light) {
            (Some(at), _) => sun(at.direction()),
            (None, LightSetting::Named(word)) => {
                let index = info.lights.iter().position(|(name, _)| name == word);
                index.map_or(Shining::Light(info.light), Shining::OfScene)
            }
            (None, _) => sun(self.pose.forward()),
        }
    }

    /// The sun, if one shines.
    pub(crate) fn sun(&self) -> Option<Sun> {
        match self.light {
            LightSetting::Sun(sun) => Some(sun),
            LightSetting::Hour(hour) => Some(Sun::at_hour(hour)),
            LightSetting::Headlight | LightSetting::Named(_) => None,
        }
    }

    /// Whether the second picture is the ray-traced truth.
    pub(crate) fn compares_with_truth(&self) -> bool {
        self.compare.is_of_two() && self.techniques[1] == TRUTH
    }

    /// The techniques that are drawn.
    ///
    /// # Errors
    /// Tells what is wrong with the text of one of them.
    pub(crate) fn drawn(&self) -> Result<Vec<NamedTechnique>, String> {
        let second = self.compare.is_of_two() && !self.compares_with_truth();
        let texts = self.techniques.iter().take(if second { 2 } else { 1 });
        texts.map(|text| text.parse().map_err(|e| format!("{e}"))).collect()
    }

    /// The frame to ask for.
    ///
    /// # Errors
    /// Tells which value is not possible.
    pub(crate) fn request(
        &self,
        info: &SceneInfo,
        image: [u32; 2],
        map: Option<usize>,
    ) -> Result<Request, String> {
        Ok(Request {
            camera: self.camera(info, image).map_err(|e| e.to_string())?,
            planned_for: self.frozen,
            light: self.light(info),
            fit: self.fit,
            techniques: self.drawn()?,
            overlay: self.overlay.on_gpu(),
            moment: self.clip.map(|clip| (clip, self.time_s)),
            map,
            wants_truth: self.counts_errors
                || self.compares_with_truth()
                || self.overlay == OverlayKind::Difference,
            light_size: self.light_size,
        })
    }
}

/// Where a view of a scene begins and ends, metres: before the nearest of the boxes around the
/// surfaces that it sees, and behind the last one. The plan gains little from a nearer beginning,
/// because it is fitted to the boxes anyway.
fn depth_range(camera: &Camera, info: &SceneInfo) -> [f64; 2] {
    /// Largest ratio of far to near distance where the viewer is amid the surfaces.
    const RATIO: f64 = 2000.0;
    let depths = |aabb: &Aabb| aabb.corners().map(|corner| camera.depth(corner));
    let farthest = depths(&info.bounds).into_iter().fold(0.0, f64::max);
    let far = if farthest > 0.0 { farthest * 1.01 } else { 100.0 };
    if camera.is_orthographic() {
        return [0.0, far];
    }
    let sides = side_planes(camera);
    let seen =
        info.boxes.iter().filter(|b| !b.is_empty() && sides.iter().all(|p| p.may_touch(**b)));
    let nearest = seen.flat_map(depths).fold(f64::INFINITY, f64::min);
    [nearest.clamp(far / RATIO, far / 4.0) * 0.99, far]
}

/// The planes of the picture's sides, which point inwards.
fn side_planes(camera: &Camera) -> [umbrage::Plane; 4] {
    let [width, height] = camera.image().map(f64::from);
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
    let rays = corners.map(|corner| camera.ray(corner.into()).direction);
    std::array::from_fn(|i| {
        let normal = rays[i].cross(rays[(i + 1) % 4]).normalize_or_zero();
        let inward = if normal.dot(camera.forward()) < 0.0 { -normal } else { normal };
        umbrage::Plane::through(camera.eye(), inward)
    })
}
