//! What a window shows: the scene, the view, the light, the techniques and how they are compared.

use crate::pose::Pose;
use crate::stage::{Overlay, Request, SceneInfo, Shining};
use crate::sun::Sun;
use umbrage::visibility::LightSize;
use umbrage::{Aabb, Camera, Light};
use umbrage_lab::{Fit, NamedTechnique, SceneOptions};
use umbrage_scene::{Lens, SceneCamera, side_planes};

/// The state of a window. A session keeps what is seen: not whether dragging flies, errors are
/// counted or fewer pixels are drawn, and the time of day as the sun that stands there.
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
    Texels,
    Partition,
    Difference,
    Clusters,
    Pages,
}

impl OverlayKind {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 7] = [
        (Self::None, "none", "Show the plain pictures."),
        (Self::Error, "error", "Show how many pixels wide a texel is: above 1, edges are jagged."),
        (Self::Texels, "texels", "Show every fifth line of the texels' grid on the surfaces."),
        (Self::Partition, "partition", "Tint each surface by the map that serves it."),
        (Self::Difference, "difference", "Show false light and false shadow, once the view rests."),
        (Self::Clusters, "clusters", "Tint the clusters of triangles by their level of detail."),
        (
            Self::Pages,
            "pages",
            "Tint the pages of paged maps by their level; new ones are lighter.",
        ),
    ];

    /// Why a scene cannot be shown so, if it cannot.
    pub(crate) fn refusal(self, info: &SceneInfo) -> Option<&'static str> {
        (self == Self::Clusters && !info.has_clusters).then_some(
            "the scene is not drawn as clusters: those are of scenes of a million triangles or \
             more, without animations",
        )
    }

    fn on_gpu(self) -> Option<Overlay> {
        match self {
            Self::None | Self::Difference => None,
            Self::Error => Some(Overlay::Error),
            Self::Texels => Some(Overlay::Texels),
            Self::Partition => Some(Overlay::Partition),
            Self::Clusters => Some(Overlay::Clusters),
            Self::Pages => Some(Overlay::Pages),
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
    fn shine(&mut self, info: &SceneInfo) {
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
    pub(crate) fn look_from(&mut self, name: Option<String>, view: &SceneCamera, info: &SceneInfo) {
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

    /// Notes that the view moved: it is no longer that of the scene's camera, and where it begins
    /// and ends follows from the scene again.
    pub(crate) fn moved(&mut self) {
        self.camera = None;
        self.near = None;
        self.far = None;
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
        // Any range will do to find where the surfaces begin and end.
        let (name, near, far) = (String::new(), 1e-3, 1e3);
        let mut view = SceneCamera { name, eye, target, up, lens: self.lens, near, far };
        let end = view.end_of(info.bounds);
        let near = near_end(&view.camera(image)?, end, pose.distance(), info);
        view.far = self.far.unwrap_or(end);
        view.near = self.near.unwrap_or(near).min(view.far * 0.5);
        view.camera(image)
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
            // The light of a view that is kept stays with it.
            (None, _) => sun(self.frozen.map_or(self.pose.forward(), |camera| camera.forward())),
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

    /// Whether the light is parallel.
    fn is_sun(&self, info: &SceneInfo) -> bool {
        match self.light(info) {
            Shining::Light(light) => light.position().is_none(),
            Shining::OfScene(index) => info.lights[index].1.position().is_none(),
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
        wants_body: bool,
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
            light_size: self.light_size.filter(|size| {
                // A size in the other unit is left over from a light of the other kind.
                matches!(size, LightSize::Degrees(_)) == self.is_sun(info)
            }),
            wants_body,
        })
    }
}

/// Where a view of a scene that ends at `far` begins, metres: before the nearest of the boxes around
/// the surfaces that it sees. The plan gains little from a later beginning, because it is fitted to
/// the boxes anyway.
fn near_end(camera: &Camera, far: f64, to_target: f64, info: &SceneInfo) -> f64 {
    /// Where the viewer is amid the surfaces, the view begins at this share of its far distance or
    /// of the distance to the target, whichever is less.
    const SHARES: [f64; 2] = [1.0 / 2000.0, 1.0 / 50.0];
    if camera.is_orthographic() {
        return 0.0;
    }
    let depths = |aabb: &Aabb| aabb.corners().map(|corner| camera.depth(corner));
    let sides = side_planes(camera);
    let seen =
        info.boxes.iter().filter(|b| !b.is_empty() && sides.iter().all(|p| p.may_touch(**b)));
    let nearest = seen.flat_map(depths).fold(f64::INFINITY, f64::min);
    let least = (far * SHARES[0]).min(to_target * SHARES[1]).max(far * 1e-6);
    nearest.clamp(least, far / 2.0) * 0.99
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use glam::DVec3;

    /// A scene of one box, with a camera and two lights.
    pub(crate) fn info() -> SceneInfo {
        let bounds = Aabb::new(DVec3::new(-10.0, 0.0, -10.0), DVec3::new(10.0, 5.0, 10.0));
        let view = SceneCamera {
            name: "gate".into(),
            eye: DVec3::new(0.0, 2.0, 40.0),
            target: DVec3::new(0.0, 2.0, 0.0),
            up: DVec3::Y,
            lens: Lens::Perspective { fov_y_rad: 0.8 },
            near: 0.5,
            far: 90.0,
        };
        let lamp = umbrage::PointLight { position: DVec3::Y, range: 9.0, near: 0.01 };
        let sun = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.2) };
        SceneInfo {
            name: "box".into(),
            cameras: vec![("gate".into(), view.clone())],
            lights: vec![("sun".into(), sun), ("lamp".into(), Light::Point(lamp))],
            clips: vec![("walk".into(), 2.0)],
            notices: Vec::new(),
            bounds,
            boxes: vec![bounds],
            view,
            view_name: Some("gate".into()),
            light: sun,
            light_name: Some("sun".into()),
            clip: None,
            triangles: 12,
            has_clusters: false,
        }
    }

    fn settings() -> Settings {
        let mut settings = Settings::new("box");
        settings.begin_with(&info());
        settings
    }

    #[test]
    fn a_view_begins_before_its_surfaces_and_ends_behind_them() {
        let (info, mut settings) = (info(), settings());
        let range = |settings: &Settings| {
            let camera = settings.camera(&info, [64, 64]).unwrap();
            [camera.near(), camera.far()]
        };
        assert_eq!(range(&settings), [0.5, 90.0], "that of the file's camera");
        settings.moved();
        let [near, far] = range(&settings);
        assert!((24.0..30.0).contains(&near) && (50.0..51.0).contains(&far), "{near} {far}");
        // Amid the surfaces, the view begins near the eye, and nearer if the target is near.
        settings.pose.eye = DVec3::new(0.0, 2.0, 5.0);
        let [amid, _] = range(&settings);
        assert!(amid < 0.02, "{amid}");
        settings.pose.target = DVec3::new(0.0, 2.0, 4.9);
        assert!(range(&settings)[0] < amid);
        // Where nothing is seen there still is a view.
        settings.pose = Pose::new(DVec3::Y * 900.0, DVec3::Y * 1000.0, DVec3::Z);
        let [near, far] = range(&settings);
        assert!(0.0 < near && near < far && far.is_finite());
    }

    #[test]
    fn sizes_of_the_other_kind_of_light_are_left_out() {
        let (info, mut settings) = (info(), settings());
        let size = |settings: &Settings| {
            settings.request(&info, [64, 64], None, false).unwrap().light_size
        };
        settings.light_size = Some(LightSize::Degrees(0.5));
        assert!(size(&settings).is_some());
        settings.light = LightSetting::Named("lamp".into());
        assert_eq!(size(&settings), None);
        settings.light_size = Some(LightSize::Metres(0.2));
        assert!(size(&settings).is_some());
    }

    #[test]
    fn a_frozen_headlight_stays() {
        let (info, mut settings) = (info(), settings());
        settings.light = LightSetting::Headlight;
        let before = settings.light(&info);
        settings.frozen = Some(settings.camera(&info, [64, 64]).unwrap());
        settings.pose.orbit(1.0, 0.2);
        assert_eq!(settings.light(&info), before);
        settings.frozen = None;
        assert_ne!(settings.light(&info), before);
    }

    #[test]
    fn clusters_are_only_shown_where_there_are_any() {
        let mut info = info();
        let refused = |info: &SceneInfo| {
            let kinds = OverlayKind::ALL.iter().map(|(kind, ..)| *kind);
            kinds.filter(|kind| kind.refusal(info).is_some()).collect::<Vec<_>>()
        };
        assert_eq!(refused(&info), [OverlayKind::Clusters]);
        info.has_clusters = true;
        assert_eq!(refused(&info), []);
    }

    #[test]
    fn a_wrong_text_is_told() {
        let (info, mut settings) = (info(), settings());
        settings.techniques[0] = "lispm".into();
        let problem = settings.request(&info, [64, 64], None, false).unwrap_err();
        assert!(problem.contains("lispsm"), "{problem}");
    }
}
