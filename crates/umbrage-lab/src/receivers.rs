//! Receivers: the places where shadows can fall.

use crate::error::Error;
use glam::DVec2;
use rayon::prelude::*;
use umbrage::{Aabb, Bounds, BoxTree, Camera, Seen, SeenTiles};
use umbrage_scene::Scene;
use umbrage_trace::{Ray, Tracer};

/// What shadow maps are fitted to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// The bounding box of the scene, empty space included.
    Box,
    /// Up to some hundred boxes around the scene's surfaces.
    #[default]
    Surfaces,
    /// What each pixel of the picture shows.
    Seen,
}

impl Fit {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Box, Self::Surfaces, Self::Seen];

    /// Returns `box`, `surfaces` or `seen`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Surfaces => "surfaces",
            Self::Seen => "seen",
        }
    }
}

/// The receivers of a scene, as the planner gets them.
pub struct Receivers {
    all: Aabb,
    casters: Aabb,
    parts: Option<BoxTree>,
    fit: Fit,
}

/// Largest number of boxes around surfaces. More make planning slower and the maps hardly finer.
pub const SURFACE_BOXES: usize = 256;

impl Receivers {
    /// Returns the receivers that `fit` selects. Boxes around surfaces come from the tracer's tree.
    pub fn new(scene: &Scene, tracer: &Tracer<'_>, fit: Fit) -> Self {
        let parts = match fit {
            Fit::Box => None,
            Fit::Surfaces | Fit::Seen => BoxTree::new(&tracer.boxes(SURFACE_BOXES)).ok(),
        };
        Self { parts, fit, ..Self::in_box(scene) }
    }

    /// Returns the bounding box of the scene as the only receiver. This needs no tracer.
    pub fn in_box(scene: &Scene) -> Self {
        let all = scene.bounds();
        let is_all = scene.roles.are_default();
        let casters = if is_all { all } else { scene.caster_bounds() };
        Self { all, casters, parts: None, fit: Fit::Box }
    }

    /// Returns the boxes around the scene's instances as receivers. They are quickly found, which
    /// serves scenes that move, and looser than those around surfaces.
    pub fn around_instances(scene: &Scene) -> Self {
        let boxes = scene.instance_boxes().into_iter().enumerate();
        let seen = boxes.filter(|(i, aabb)| scene.roles.of(*i).is_receiver() && !aabb.is_empty());
        let parts = BoxTree::new(&seen.map(|(_, aabb)| aabb).collect::<Vec<_>>()).ok();
        Self { parts, fit: Fit::Surfaces, ..Self::in_box(scene) }
    }

    /// Returns whether the maps are fitted to what is seen.
    pub(crate) fn are_seen(&self) -> bool {
        self.fit == Fit::Seen
    }

    /// Returns what a camera sees at its pixels' centres, found by rays, if the maps are fitted to
    /// that.
    ///
    /// # Errors
    /// None in practice: rays find no depths that are not positive.
    pub fn seen(&self, tracer: &Tracer<'_>, camera: &Camera) -> Result<Option<SeenTiles>, Error> {
        if !self.are_seen() {
            return Ok(None);
        }
        let [width, height] = camera.image();
        let depth = |x: u32, y: u32| {
            let ray = Ray::of_view(camera, DVec2::new(f64::from(x), f64::from(y)) + 0.5);
            // The ray's parameter t is the depth.
            tracer.closest(ray, [camera.near(), f64::INFINITY]).map_or(f64::INFINITY, |hit| hit.t)
        };
        let depths: Vec<f64> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| (0..width).map(move |x| depth(x, y)))
            .collect();
        let depth = |x, y| depths[(y * width + x) as usize];
        SeenTiles::of_depths(camera, depth).map(Some).map_err(Error::Planning)
    }

    /// Returns the receivers as bounds for the planner, together with what was
    /// [seen](Self::seen).
    pub fn bounds<'a>(&'a self, seen: Option<&'a SeenTiles>) -> Bounds<'a> {
        let seen = seen.map(|tiles| Seen { tiles, moving: &[], clearance: 0.0 });
        Bounds {
            receivers: Some(self.all),
            receiver_parts: self.parts.as_ref(),
            seen,
            casters: Some(self.casters),
        }
    }
}
