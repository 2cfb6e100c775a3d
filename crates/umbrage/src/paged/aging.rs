//! Lights that move, whose pages are renewed over several frames.

use super::ComingLights;
use crate::error::Error;
use crate::light::Light;
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
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
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
///     aging.advance(&[sun])?;
///     let plan = planner.plan_aging(&camera, &aging, &Bounds::default(), &technique)?;
///     // Draw the plan's pages and look up its light 0.
/// }
/// # Ok(()) }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgingLights {
    frames: u32,
    /// Where lights are.
    now: Vec<Light>,
    /// Where they are looked up, and behind that the next positions of those that have moved.
    planned: Vec<Light>,
    /// For how many frames each light has not been where it is looked up.
    ages: Vec<u32>,
    /// The lights whose next positions are planned.
    coming: Vec<Coming>,
    /// Frames until these are looked up.
    left: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Coming {
    /// Index of the light.
    light: usize,
    /// For how many frames the light has not been at its next position any more.
    age: u32,
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

    /// Begins a frame in which these are the lights. If there are other lights than before, or lights
    /// of another kind, all are looked up where they are.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first light that has a field out of its range. Nothing has changed
    /// then.
    pub fn advance(&mut self, lights: &[Light]) -> Result<(), Error> {
        for light in lights {
            light.checked()?;
        }
        let is_same_kind = |(now, light): (&Light, &Light)| {
            std::mem::discriminant(now) == std::mem::discriminant(light)
        };
        let is_same = self.now.len() == lights.len()
            && self.now.iter().zip(lights).all(is_same_kind)
            && self.frames > 0;
        self.now.clear();
        // Directions have unit length from here on.
        self.now.extend(lights.iter().map_while(|light| light.checked().ok()));
        if !is_same {
            self.restart();
            return Ok(());
        }
        let later = |age: u32, is_there: bool| if is_there { 0 } else { age + 1 };
        for ((age, now), looked_up) in self.ages.iter_mut().zip(&self.now).zip(&self.planned) {
            *age = later(*age, looked_up == now);
        }
        let next = &self.planned[self.now.len()..];
        for (coming, next) in self.coming.iter_mut().zip(next) {
            coming.age = later(coming.age, *next == self.now[coming.light]);
        }
        if !self.coming.is_empty() {
            self.left -= 1;
            if self.left == 0 {
                self.look_coming_up();
            }
        }
        if self.coming.is_empty() {
            let moved = (0..self.now.len()).filter(|&i| self.planned[i] != self.now[i]);
            self.coming.extend(moved.map(|light| Coming { light, age: 0 }));
            self.planned.extend(self.coming.iter().map(|coming| self.now[coming.light]));
            self.left = self.frames;
        }
        Ok(())
    }

    /// Looks all lights up where they are.
    fn restart(&mut self) {
        self.planned.clone_from(&self.now);
        self.ages.clear();
        self.ages.resize(self.now.len(), 0);
        self.coming.clear();
    }

    fn look_coming_up(&mut self) {
        let count = self.now.len();
        for (k, &Coming { light, age }) in self.coming.iter().enumerate() {
            self.planned[light] = self.planned[count + k];
            self.ages[light] = age;
        }
        self.planned.truncate(count);
        self.coming.clear();
    }

    /// Looks lights up where they are from the next frame on, whatever they were before. Use it
    /// where a light jumps, and after a cut: all pages are then drawn at once.
    pub fn forget(&mut self) {
        self.now.clear();
    }

    /// The lights to plan pages for in this frame: first as many as there are, in their order and as
    /// they are looked up, and behind them the next positions of some.
    pub fn planned(&self) -> &[Light] {
        &self.planned
    }

    /// The lights where they are, with directions of unit length.
    pub(crate) fn now(&self) -> &[Light] {
        &self.now
    }

    /// Those of the [planned](Self::planned) lights that are looked up in a later frame.
    pub(crate) fn coming(&self) -> Option<ComingLights> {
        let coming = ComingLights { first: self.now.len(), frames: self.left };
        Some(coming).filter(|_| !self.coming.is_empty())
    }

    /// How far a light, as it is looked up in this frame, is behind; `None` if there is no such
    /// light.
    pub fn age(&self, light: usize) -> Option<LightAge> {
        let (now, looked_up) = (self.now.get(light)?, self.planned.get(light)?);
        let [now, then] = [now, looked_up].map(position_and_direction);
        let distance = now.0.distance(then.0);
        let angle_rad = match (now.1, then.1) {
            // Unlike the arc cosine, this is precise for small angles too.
            (Some(now), Some(then)) => now.cross(then).length().atan2(now.dot(then)),
            _ => 0.0,
        };
        Some(LightAge { frames: *self.ages.get(light)?, angle_rad, distance })
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
                aging.advance(&lights(now)).unwrap();
                planned.push(aging.planned().to_vec());
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
        let mut planned = |lights: &[Light]| {
            aging.advance(lights).unwrap();
            aging.planned().to_vec()
        };
        assert_eq!(planned(&[sun(0.0)]).len(), 1);
        assert_eq!(planned(&[sun(0.1)]).len(), 2);
        assert_eq!(planned(&[lamp(1.0)]), [lamp(1.0)]);
        assert_eq!(planned(&[lamp(2.0), sun(0.0)]).len(), 2);
        assert_eq!(planned(&[lamp(2.0), sun(0.1)]).len(), 3);
        assert!((aging.age(1).unwrap().angle_rad - 0.1).abs() < 1e-12);
        let before = aging.clone();
        let wrong = Light::Directional { direction: DVec3::ZERO };
        assert!(aging.advance(&[lamp(2.0), wrong]).is_err());
        assert_eq!(aging, before);
        aging.forget();
        aging.advance(&[lamp(3.0), sun(0.2)]).unwrap();
        assert_eq!((aging.planned().len(), aging.age(1)), (2, Some(LightAge::default())));
        aging.set_frames(0);
        aging.advance(&[lamp(4.0), sun(0.2)]).unwrap();
        assert_eq!(aging.planned()[0], lamp(4.0));
    }
}
