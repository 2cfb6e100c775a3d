//! What the window asks the stage for, and what it gets.

use glam::DVec3;
use std::sync::{Arc, LazyLock};
use umbrage::visibility::LightSize;
use umbrage::{Aabb, Camera, Light, Plan};
use umbrage_lab::{Fit, NamedTechnique};
use umbrage_measure::{ErrorScale, FALSE_LIGHT, LEVEL_COLORS, PARTITIONS, Rgb};
use umbrage_render::{FrameTarget, SCALE_COLORS};
use umbrage_scene::SceneCamera;

/// A frame that the window wants. Requests that are equal give equal frames.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Request {
    /// The camera that looks.
    pub(crate) camera: Camera,
    /// The camera that the maps are planned for, if it is another one.
    pub(crate) planned_for: Option<Camera>,
    /// The light.
    pub(crate) light: Shining,
    /// What maps are fitted to.
    pub(crate) fit: Fit,
    /// The techniques, each of which gets a picture.
    pub(crate) techniques: Vec<NamedTechnique>,
    /// What is drawn over the pictures.
    pub(crate) overlay: Option<Overlay>,
    /// A clip of the scene's animations by its index, and the time in it, seconds.
    pub(crate) moment: Option<(usize, f64)>,
    /// Index of the map of the first technique that is shown as a picture of its own.
    pub(crate) map: Option<usize>,
    /// Whether the truth is traced when the view rests.
    pub(crate) wants_truth: bool,
    /// The size of the light for the truth of soft techniques.
    pub(crate) light_size: Option<LightSize>,
    /// Whether the edges of body B are wanted.
    pub(crate) wants_body: bool,
}

/// A light by its value, or by its index in the scene, where an animation may move it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shining {
    Light(Light),
    OfScene(usize),
}

/// What a GPU draws over the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlay {
    /// Pixels per texel, in colours.
    Error,
    /// The texels' grid.
    Texels,
    /// A tint for each map.
    Partition,
    /// A tint for each level of detail.
    Clusters,
    /// A tint for each level of pages.
    Pages,
}

impl Overlay {
    /// The overlay with the colours that reports use.
    pub(super) fn colors(self) -> umbrage_render::Overlay<'static> {
        static ERRORS: LazyLock<[Rgb; SCALE_COLORS]> = LazyLock::new(|| {
            let scale = ErrorScale::default();
            let last = (SCALE_COLORS - 1) as f32;
            std::array::from_fn(|i| {
                let error = scale.max().powf(2.0 * i as f32 / last - 1.0);
                scale.color(error).unwrap_or_default()
            })
        });
        match self {
            Self::Error => {
                let max = ErrorScale::default().max();
                umbrage_render::Overlay::Error { colors: &ERRORS, max }
            }
            Self::Texels => umbrage_render::Overlay::Grid { color: FALSE_LIGHT },
            Self::Partition => umbrage_render::Overlay::Partition { colors: &PARTITIONS },
            Self::Clusters => umbrage_render::Overlay::Clusters { colors: &LEVEL_COLORS },
            Self::Pages => umbrage_render::Overlay::Pages { colors: &PARTITIONS },
        }
    }
}

/// What was drawn for a request.
pub(crate) struct Frame {
    pub(crate) request: Request,
    /// Counts the frames of a window.
    pub(crate) number: u64,
    /// The light as it was at that moment.
    pub(crate) light: Light,
    /// One for each technique.
    pub(crate) pictures: Vec<Picture>,
    /// The map that was asked for.
    pub(crate) map: Option<Arc<FrameTarget>>,
    /// The edges of body B: what the planned view sees of the receivers, world space, metres. Empty
    /// unless they were wanted.
    pub(crate) body: Vec<[DVec3; 2]>,
}

/// A technique's picture.
pub(crate) struct Picture {
    pub(crate) technique: NamedTechnique,
    pub(crate) drawn: Result<DrawnPicture, String>,
}

/// A picture that was drawn.
pub(crate) struct DrawnPicture {
    pub(crate) target: Arc<FrameTarget>,
    pub(crate) plan: Arc<Plan>,
    pub(crate) costs: Costs,
}

/// What a picture costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Costs {
    /// Time on the CPU that planning took, milliseconds.
    pub(crate) plan_ms: f64,
    /// Times on the GPU, milliseconds; `None` if the device cannot measure them or has not yet.
    pub(crate) prepass_ms: Option<f64>,
    pub(crate) pages_ms: Option<f64>,
    pub(crate) depth_ms: Option<f64>,
    pub(crate) filter_ms: Option<f64>,
    pub(crate) picture_ms: Option<f64>,
    /// How much longer the picture takes with lookups than without.
    pub(crate) lookup_ms: Option<f64>,
    /// Number of texels of all maps.
    pub(crate) texels: u64,
    /// Memory that lookups read, bytes.
    pub(crate) bytes: u64,
    /// Number of draw calls into the maps, and of triangles, counted once for each instance.
    pub(crate) map_draws: u32,
    pub(crate) map_triangles: u64,
    /// The same for the picture.
    pub(crate) picture_draws: u32,
    pub(crate) picture_triangles: u64,
}

/// What the window has to know of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SceneInfo {
    pub(crate) name: String,
    /// The words that choose the cameras, and the cameras.
    pub(crate) cameras: Vec<(String, SceneCamera)>,
    /// The words that choose the lights, and the lights.
    pub(crate) lights: Vec<(String, Light)>,
    /// The words that choose the animations' clips, and their durations, seconds.
    pub(crate) clips: Vec<(String, f64)>,
    /// What was repaired or left out on loading.
    pub(crate) notices: Vec<String>,
    /// Around all that is seen, world space, metres.
    pub(crate) bounds: Aabb,
    /// Boxes around the surfaces, world space, metres.
    pub(crate) boxes: Vec<Aabb>,
    /// The view to begin with, and the word of the scene's camera if it is one.
    pub(crate) view: SceneCamera,
    pub(crate) view_name: Option<String>,
    /// The light to begin with, and the word of the scene's light if it is one.
    pub(crate) light: Light,
    pub(crate) light_name: Option<String>,
    /// The clip to begin with, by its place among the clips.
    pub(crate) clip: Option<usize>,
    /// Number of triangles as drawn.
    pub(crate) triangles: u64,
    /// Whether it is drawn as clusters of triangles.
    pub(crate) has_clusters: bool,
}

impl SceneInfo {
    /// The words for the cameras or lights of a scene: for each the shortest that chooses it.
    pub(crate) fn words(choices: &umbrage_scene::Choices<'_>) -> Vec<String> {
        let word = |i| choices.words(i).into_iter().next().unwrap_or_else(|| format!("#{}", i + 1));
        (0..choices.len()).map(word).collect()
    }

    /// Where a ray enters the nearest box around surfaces, in lengths of the direction; `None` if
    /// there is none before it.
    pub(crate) fn first_box(&self, start: DVec3, direction: DVec3) -> Option<f64> {
        let enters = |aabb: &Aabb| {
            let a = (aabb.min - start) / direction;
            let b = (aabb.max - start) / direction;
            let [enter, leave] = [a.min(b).max_element(), a.max(b).min_element()];
            (enter <= leave && enter > 0.0).then_some(enter)
        };
        self.boxes.iter().filter_map(enters).min_by(f64::total_cmp)
    }
}
