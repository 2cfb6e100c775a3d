//! Where shadows fall.

use umbrage::{Aabb, Bounds};
use umbrage_scene::Scene;
use umbrage_trace::Tracer;

/// What shadow maps are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// The box around the scene, air and all.
    Box,
    /// Some hundred boxes around its surfaces.
    Surfaces,
}

impl Fit {
    /// One word: `box` or `surfaces`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Surfaces => "surfaces",
        }
    }
}

/// Where a scene's shadows fall, as far as the planner is told.
pub struct Receivers {
    all: Aabb,
    parts: Vec<Aabb>,
}

/// Boxes around a scene's surfaces. More make planning slower and the maps hardly finer.
const SURFACE_BOXES: usize = 256;

impl Receivers {
    /// As `fit` has it, from the tree that the scene's rays are traced with.
    pub fn new(scene: &Scene, tracer: &Tracer<'_>, fit: Fit) -> Self {
        match fit {
            Fit::Box => Self::in_box(scene),
            Fit::Surfaces => Self { parts: tracer.boxes(SURFACE_BOXES), ..Self::in_box(scene) },
        }
    }

    /// Anywhere in the box around the scene: needs no rays.
    pub fn in_box(scene: &Scene) -> Self {
        Self { all: scene.bounds(), parts: Vec::new() }
    }

    /// What the planner is told.
    pub fn bounds(&self) -> Bounds<'_> {
        Bounds { receiver_parts: &self.parts, ..Bounds::of_scene(self.all) }
    }
}
