//! Lights that move, whose pages are renewed over several frames.

use super::ComingLights;
use crate::error::Error;
use crate::light::Light;
use crate::plan::Plan;
use glam::DVec3;

/// Lights that move, whose pages are renewed over several frames.
///
/// All pages of a light depend on where it is, so if it moves in every frame, every page is drawn
/// in every frame. Here a light that moves is looked up where it was a while ago, and the pages of
/// where it has come to since are drawn meanwhile, an equal part of them in each frame. When these
/// are complete they are looked up all at once, so that no picture shows two positions of a light.
/// The pages of both must fit into the pool.
///
/// A light that moves steadily is therefore between N and 2N − 1 frames behind, if pages are
/// renewed over N frames. [`age`](Self::age) gives the error that this makes.
///
/// ```
/// # use glam::DVec3;
/// # use umbrage::{Bounds, Camera, Light, LookAt, Planner, Technique, paged::AgingLights};
/// # fn main() -> Result<(), umbrage::Error> {
/// # let camera = Camera::look_at(LookAt {
/// #     eye: DVec3::new(0.0, 2.0, 8.0), target: DVec3::ZERO, up: DVec3::Y, fov_y_rad: 0.9,
/// #     near: 0.1, far: 200.0, image: [960, 540],
/// # })?;
/// # let technique: Technique = "paged(error=1):pcf3".parse()?;
/// let mut planner = Planner::new();
/// let mut aging = AgingLights::new(30);
/// for frame in 0..100 {
///     let angle = 1e-4 * f64::from(frame);
///     let sun = Light::Directional { direction: DVec3::new(angle.sin(), -1.0, angle.cos()) };
///     let lights = aging.advance(&[sun])?;
///     let mut plan = planner.plan(&camera, lights, &Bounds::default(), &technique)?.clone();
///     aging.mark(&mut plan);
///     // Draw the plan's pages and look up its light 0.
/// }
/// # Ok(()) }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgingLights {
    frames: u32,
    /// The lights that are looked up, and behind them the next positions of those that have moved.
    planned: Vec<Light>,
    /// One for each light that is looked up.
    clocks: Vec<Clock>,
    /// The lights whose next positions are planned.
    coming: Vec<Coming>,
    /// Frames until these are looked up.
    left: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Clock {
    now: Light,
    /// For how many frames the light has not been where it is looked up.
    frames: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Coming {
    /// Index of the light.
    light: usize,
    /// For how many frames the light has not been at its next position any more.
    frames: u32,
}

/// How far a light that is looked up is behind the light itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightAge {
    /// For how many frames the light has not been where it is looked up.
    pub frames: u32,
    /// The angle between the two directions, radians; 0 for point lights. Under parallel light, the
    /// shadow of what is D metres before a surface, along the light, lies D times the angle's
    /// tangent beside its place, measured across the light.
    pub angle_rad: f64,
    /// The distance between the two positions, metres; 0 under parallel light.
    pub distance: f64,
}

impl AgingLights {
    /// Renews pages over so many frames. With 0, lights are looked up where they are.
    pub fn new(frames: u32) -> Self {
        Self { frames, ..Self::default() }
    }

    /// The frames over which pages are renewed.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Changes the number of [frames](Self::frames). Those of a renewal that is under way end with
    /// the new number at the latest.
    pub fn set_frames(&mut self, frames: u32) {
        self.frames = frames;
        self.left = self.left.min(frames.max(1));
    }

    /// Begins a frame in which these are the lights. Returns those to plan for: first as many as
    /// there are `lights`, in their order and as they are to be looked up, and behind them the next
    /// positions of some. If there are other lights than before, or lights of another kind, all are
    /// looked up where they are.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first light that has a field out of its range. Nothing has changed
    /// then.
    pub fn advance(&mut self, lights: &[Light]) -> Result<&[Light], Error> {
        for light in lights {
            light.checked()?;
        }
        let is_same_kind = |(clock, light): (&Clock, Light)| {
            std::mem::discriminant(&clock.now) == std::mem::discriminant(&light)
        };
        let is_same = self.clocks.len() == lights.len()
            && self.clocks.iter().zip(lights.iter().copied()).all(is_same_kind);
        // Directions have unit length from here on.
        let lights = lights.iter().map_while(|light| light.checked().ok());
        if !is_same || self.frames == 0 {
            self.restart(lights);
            return Ok(&self.planned);
        }
        let later = |frames: u32, is_there: bool| if is_there { 0 } else { frames + 1 };
        for ((clock, now), looked_up) in self.clocks.iter_mut().zip(lights).zip(&self.planned) {
            *clock = Clock { now, frames: later(clock.frames, *looked_up == now) };
        }
        let next = &self.planned[self.clocks.len()..];
        for (coming, next) in self.coming.iter_mut().zip(next) {
            let is_there = *next == self.clocks[coming.light].now;
            coming.frames = later(coming.frames, is_there);
        }
        if !self.coming.is_empty() {
            self.left -= 1;
            if self.left == 0 {
                self.look_coming_up();
            }
        }
        if self.coming.is_empty() {
            let lights = 0..self.clocks.len();
            let moved = lights.filter(|&i| self.planned[i] != self.clocks[i].now);
            self.coming.extend(moved.map(|light| Coming { light, frames: 0 }));
            self.planned.extend(self.coming.iter().map(|c| self.clocks[c.light].now));
            self.left = self.frames;
        }
        Ok(&self.planned)
    }

    /// Looks all lights up where they are.
    fn restart(&mut self, lights: impl Iterator<Item = Light>) {
        self.clocks.clear();
        self.clocks.extend(lights.map(|now| Clock { now, frames: 0 }));
        self.planned.clear();
        self.planned.extend(self.clocks.iter().map(|clock| clock.now));
        self.coming.clear();
    }

    fn look_coming_up(&mut self) {
        let count = self.clocks.len();
        for (k, &Coming { light, frames }) in self.coming.iter().enumerate() {
            self.planned[light] = self.planned[count + k];
            self.clocks[light].frames = frames;
        }
        self.planned.truncate(count);
        self.coming.clear();
    }

    /// Looks lights up where they are from the next frame on, whatever they were before. Use it
    /// where a light jumps, and after a cut: all pages are then drawn at once.
    pub fn forget(&mut self) {
        self.clocks.clear();
    }

    /// Notes in a plan for the lights of this frame which of them are coming, and how soon. A plan
    /// without this note has all pages of all lights drawn at once.
    pub fn mark(&self, plan: &mut Plan) {
        let coming = ComingLights { first: self.clocks.len(), frames: self.left };
        if let Some(paging) = &mut plan.paging {
            paging.coming = Some(coming).filter(|_| !self.coming.is_empty());
        }
    }

    /// How far a light, as it is looked up in this frame, is behind; `None` if there is no such
    /// light.
    pub fn age(&self, light: usize) -> Option<LightAge> {
        let clock = self.clocks.get(light)?;
        let looked_up = self.planned.get(light)?;
        let [now, then] = [&clock.now, looked_up].map(position_and_direction);
        let distance = now.0.distance(then.0);
        let angle_rad = match (now.1, then.1) {
            // Unlike the arc cosine, this is precise for small angles too.
            (Some(now), Some(then)) => now.cross(then).length().atan2(now.dot(then)),
            _ => 0.0,
        };
        Some(LightAge { frames: clock.frames, angle_rad, distance })
    }
}

/// The position, which is the origin under parallel light, and the direction of a light that has
/// one.
fn position_and_direction(light: &Light) -> (DVec3, Option<DVec3>) {
    match light {
        Light::Directional { direction } => (DVec3::ZERO, Some(*direction)),
        Light::Spot(spot) => (spot.position, Some(spot.direction)),
        Light::Point(point) => (point.position, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::PointLight;
    use proptest::prelude::*;

    fn sun(angle_rad: f64) -> Light {
        Light::Directional { direction: DVec3::new(angle_rad.sin(), 0.0, angle_rad.cos()) }
    }

    fn lamp(x: f64) -> Light {
        Light::Point(PointLight { position: DVec3::X * x, near: 0.1, range: 9.0 })
    }

    proptest! {
        /// A position is looked up only after all frames in which its pages are drawn, and ages are
        /// those that the history of the light gives.
        #[test]
        fn positions_are_looked_up_when_their_pages_are_drawn(
            frames in 1..7u32,
            moves in prop::collection::vec((any::<bool>(), any::<bool>()), 1..60),
        ) {
            let mut aging = AgingLights::new(frames);
            // Angle and place in each frame, and what was planned.
            let mut history = vec![[0.0f64; 2]];
            let mut planned: Vec<Vec<Light>> = Vec::new();
            for (turns, goes) in moves {
                let [angle_rad, x] = history[history.len() - 1];
                let now = [angle_rad + if turns { 0.01 } else { 0.0 }, x + f64::from(goes)];
                history.push(now);
                let lights = |[angle_rad, x]: [f64; 2]| {
                    [sun(angle_rad), lamp(x)].map(|light| light.checked().unwrap())
                };
                planned.push(aging.advance(&lights(now)).unwrap().to_vec());
                let last = planned.len() - 1;
                let coming = aging.coming.len();
                prop_assert_eq!(planned[last].len(), 2 + coming);
                prop_assert!((1..=frames).contains(&aging.left) || coming == 0);
                for i in 0..2 {
                    let looked_up = planned[last][i];
                    // The last frame in which the light was there.
                    let is_there = |&frame: &[f64; 2]| lights(frame)[i] == looked_up;
                    let then = history[1..].iter().rposition(is_there).unwrap();
                    let age = aging.age(i).unwrap();
                    prop_assert_eq!(age.frames as usize, last - then);
                    prop_assert!(age.frames < 2 * frames);
                    let behind = now[i] - history[1 + then][i];
                    let error = age.angle_rad + age.distance - behind;
                    prop_assert!(error.abs() < 1e-9, "{age:?}, {behind}");
                    // It has changed only to what was planned in all of the frames before.
                    if last > 0 && planned[last - 1][i] != looked_up {
                        prop_assert!(last >= frames as usize);
                        for planned in &planned[last - frames as usize..last] {
                            prop_assert!(planned[2..].contains(&looked_up));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn lights_that_differ_in_kind_are_looked_up_at_once() {
        let mut aging = AgingLights::new(4);
        assert_eq!(aging.age(0), None);
        assert_eq!(aging.advance(&[sun(0.0)]).unwrap().len(), 1);
        assert_eq!(aging.advance(&[sun(0.1)]).unwrap().len(), 2);
        assert!((aging.age(0).unwrap().angle_rad - 0.1).abs() < 1e-12);
        assert_eq!(aging.advance(&[lamp(1.0)]).unwrap(), [lamp(1.0)]);
        assert_eq!(aging.advance(&[lamp(2.0), sun(0.0)]).unwrap().len(), 2);
        assert_eq!(aging.advance(&[lamp(2.0), sun(0.1)]).unwrap().len(), 3);
        let before = aging.clone();
        let wrong = Light::Directional { direction: DVec3::ZERO };
        assert!(aging.advance(&[lamp(2.0), wrong]).is_err());
        assert_eq!(aging, before);
        aging.forget();
        assert_eq!(aging.advance(&[lamp(3.0), sun(0.2)]).unwrap().len(), 2);
        assert_eq!(aging.age(1), Some(LightAge::default()));
        aging.set_frames(0);
        assert_eq!(aging.advance(&[lamp(4.0), sun(0.2)]).unwrap()[0], lamp(4.0));
    }
}
