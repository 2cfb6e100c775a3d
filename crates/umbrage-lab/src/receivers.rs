//! Receivers: the places where shadows can fall.

use umbrage::{Aabb, Bounds, BoxTree};
use umbrage_scene::Scene;
use umbrage_trace::Tracer;

/// What shadow maps are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// The bounding box of the scene, empty space included.
    Box,
    /// Up to some hundred boxes around the scene's surfaces.
    Surfaces,
}

impl Fit {
    /// Returns `box` or `surfaces`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Surfaces => "surfaces",
        }
    }
}

/// The receivers of a scene, as the planner gets them.
pub struct Receivers {
    all: Aabb,
    parts: Option<BoxTree>,
}

/// Largest number of boxes around surfaces. More make planning slower and the maps hardly finer.
const SURFACE_BOXES: usize = 256;

impl Receivers {
    /// Returns the receivers that `fit` selects. Boxes around surfaces come from the tracer's tree.
    pub fn new(scene: &Scene, tracer: &Tracer<'_>, fit: Fit) -> Self {
        match fit {
            Fit::Box => Self::in_box(scene),
            Fit::Surfaces => {
                let parts = BoxTree::new(&tracer.boxes(SURFACE_BOXES)).ok();
                Self { parts, ..Self::in_box(scene) }
            }
        }
    }

    /// Returns the bounding box of the scene as the only receiver. This needs no tracer.
    pub fn in_box(scene: &Scene) -> Self {
        Self { all: scene.bounds(), parts: None }
    }

    /// Returns the receivers as bounds for the planner.
    pub fn bounds(&self) -> Bounds<'_> {
        Bounds { receiver_parts: self.parts.as_ref(), ..Bounds::of_scene(self.all) }
    }
}
