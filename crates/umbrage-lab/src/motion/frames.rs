//! The frames of a motion.

use crate::error::{About, Error, Field};
use crate::executor::{Executor, RenderScene};
use crate::planning;
use crate::receivers::Receivers;
use crate::technique::NamedTechnique;
use crate::view::ChosenView;
use glam::{DQuat, DVec3};
use umbrage::{Camera, Light, Plan, SpotLight};
use umbrage_trace::View;

/// A motion of the viewer or the light, in steps as small as between the frames of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// The viewer and the target move forward, by a hundredth of the distance between them per
    /// frame.
    Dolly,
    /// The viewer circles the target, by half a degree per frame.
    Orbit,
    /// The light turns about the vertical, by a tenth of a degree per frame.
    Sun,
    /// The viewer moves away from the target, by a two-hundredth of the first distance per frame,
    /// so that more and more texels fall into a pixel.
    Away,
}

/// A view and a light in a scene, one of which moves.
#[derive(Clone, Copy)]
pub struct MovingView<'a> {
    /// The scene that is rendered.
    pub scene: &'a RenderScene<'a>,
    /// The scene's receivers, which tell the planner where shadows fall.
    pub receivers: &'a Receivers,
    /// The view of the first frame.
    pub chosen_view: &'a ChosenView,
    /// The light of the first frame.
    pub light: Light,
    /// Rays along each side of a pixel, 1 to 64.
    pub samples: u32,
}

impl Motion {
    /// Returns `dolly`, `orbit`, `sun` or `away`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dolly => "dolly",
            Self::Orbit => "orbit",
            Self::Sun => "sun",
            Self::Away => "away",
        }
    }

    /// Checks that every frame of the motion has a valid view and light.
    ///
    /// # Errors
    /// An error if a frame's view is not one that a camera can have, or if the light cannot turn.
    pub fn check(self, frames: u32, first: &ChosenView, light: Light) -> Result<(), Error> {
        (0..frames).try_for_each(|i| self.frame(first, light, i).map(drop))
    }

    /// Returns the view and the light of a frame. The first frame has `first` and `light`.
    fn frame(self, first: &ChosenView, light: Light, index: u32) -> Result<(Camera, Light), Error> {
        let index = f64::from(index);
        let look_at = &first.view;
        let mut frame = (look_at.clone(), light);
        match self {
            Self::Dolly => {
                let step = (look_at.target - look_at.eye) * (0.01 * index);
                frame.0.eye += step;
                frame.0.target += step;
            }
            Self::Orbit => {
                let axis = look_at.up.normalize_or(DVec3::Y);
                let turn = DQuat::from_axis_angle(axis, (0.5 * index).to_radians());
                frame.0.eye = look_at.target + turn * (look_at.eye - look_at.target);
            }
            Self::Away => frame.0.eye += (look_at.eye - look_at.target) * (0.005 * index),
            Self::Sun => {
                frame.1 = turned(&light, 0.1 * index).ok_or_else(|| {
                    let problem =
                        "a point light has no direction to turn: take dolly, orbit or away";
                    Error::field(Field::Motion, problem)
                })?;
            }
        }
        let camera = frame.0.camera(first.camera.image()).about(Field::Motion)?;
        Ok((camera, frame.1))
    }
}

/// Returns a light that has turned by so many degrees about the vertical; `None` for a point light,
/// which has no direction.
pub fn turned(light: &Light, degrees: f64) -> Option<Light> {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    match *light {
        Light::Directional { direction } => {
            Some(Light::Directional { direction: turn * direction })
        }
        Light::Spot(spot) => {
            Some(Light::Spot(SpotLight { direction: turn * spot.direction, ..spot }))
        }
        Light::Point(_) => None,
    }
}

/// The view of a frame, and every technique's plan for it.
pub(super) struct Frame<'a> {
    pub(super) view: View<'a>,
    pub(super) plans: Vec<Plan>,
}

impl<'a> Frame<'a> {
    /// Returns all frames of a motion, with `samples` rays along each side of a pixel.
    pub(super) fn all(
        motion: Motion,
        frames: u32,
        moving: &MovingView<'a>,
        samples: u32,
        techniques: &[NamedTechnique],
    ) -> Result<Vec<Self>, Error> {
        let MovingView { scene, receivers, chosen_view, light, .. } = *moving;
        // What was seen in the frame before serves a frame, as where depths are read back from a
        // GPU.
        let mut before = None;
        let frame = |i| {
            let (camera, light) = motion.frame(chosen_view, light, i)?;
            let view = View::new(scene.tracer(), camera, light, samples).about(Field::Samples)?;
            let seen = scene.seen(receivers, &camera)?;
            let bounds = receivers.bounds(before.as_ref().or(seen.as_ref()));
            let plan = |t| {
                let mut plan = planning::plan(t, &camera, &light, &bounds)?;
                planning::fit_pages(&mut plan, scene.tracer());
                Ok(plan)
            };
            let plans = techniques.iter().map(plan).collect::<Result<_, Error>>()?;
            before = seen;
            Ok(Self { view, plans })
        };
        (0..frames).map(frame).collect()
    }
}

/// Returns the executors that render the techniques.
pub(super) fn executors<'a>(
    scene: &'a RenderScene<'_>,
    techniques: &[NamedTechnique],
) -> Result<Vec<Executor<'a>>, Error> {
    techniques.iter().map(|t| scene.executor(t.technique(), false)).collect()
}
