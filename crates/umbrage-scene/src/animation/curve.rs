//! Values that change with time, known at keys.

use glam::{DQuat, DVec3, DVec4};

/// How values change between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    /// A key has three values: the tangent before it, its own, and the tangent after it, both per
    /// second.
    Cubic,
}

/// A vector of `width` numbers over time.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Times of the keys, seconds. At least one, all finite, none before its predecessor.
    times: Vec<f32>,
    /// `width` numbers for each value of each key; all finite.
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

/// A time among the keys of a curve.
#[derive(Clone, Copy)]
struct Moment {
    /// The last key that is not after the time, or the first of all.
    key: usize,
    /// Towards the next key: the share of the way, in [0, 1), and the time between both, seconds.
    /// `None` before the first key and from the last one on.
    between: Option<(f64, f64)>,
}

impl Curve {
    /// The curve through these keys.
    ///
    /// # Errors
    /// One line about the keys, without a place.
    pub(crate) fn new(
        times: Vec<f32>,
        values: Vec<f32>,
        width: usize,
        interpolation: Interpolation,
    ) -> Result<Self, &'static str> {
        let per_key = if interpolation == Interpolation::Cubic { 3 * width } else { width };
        if times.is_empty() || width == 0 {
            return Err("has no keys");
        }
        if times.len().checked_mul(per_key) != Some(values.len()) {
            return Err("has another number of values than its keys need");
        }
        if !times.iter().chain(&values).all(|v| v.is_finite()) {
            return Err("has times or values that are not finite");
        }
        if !times.is_sorted() {
            return Err("has keys whose times do not ascend");
        }
        Ok(Self { times, values, width, interpolation })
    }

    /// Time of the last key, seconds.
    pub(crate) fn end_s(&self) -> f64 {
        self.times.last().map_or(0.0, |&t| f64::from(t))
    }

    /// Whether each key's own value, a quaternion, has a direction.
    pub(crate) fn has_rotations(&self) -> bool {
        (0..self.times.len()).all(|key| self.quaternion(key).length() > 1e-6)
    }

    /// The vector at a time, for curves of three numbers.
    pub(crate) fn vector(&self, seconds: f64) -> DVec3 {
        let moment = self.moment(seconds);
        DVec3::from_array(std::array::from_fn(|i| self.number(moment, i)))
    }

    /// The rotation at a time, for curves of four numbers.
    pub(crate) fn rotation(&self, seconds: f64) -> DQuat {
        let moment = self.moment(seconds);
        let of_key = |key| DQuat::from_vec4(self.quaternion(key).normalize());
        match (self.interpolation, moment.between) {
            (Interpolation::Linear, Some((share, _))) => {
                of_key(moment.key).slerp(of_key(moment.key + 1), share)
            }
            (Interpolation::Cubic, Some(_)) => {
                let q = DVec4::from_array(std::array::from_fn(|i| self.number(moment, i)));
                q.try_normalize().map_or_else(|| of_key(moment.key), DQuat::from_vec4)
            }
            _ => of_key(moment.key),
        }
    }

    /// Writes the numbers at a time.
    pub(crate) fn numbers(&self, seconds: f64, numbers: &mut [f32]) {
        let moment = self.moment(seconds);
        for (i, number) in numbers.iter_mut().take(self.width).enumerate() {
            *number = self.number(moment, i) as f32;
        }
    }

    fn moment(&self, seconds: f64) -> Moment {
        let after = self.times.partition_point(|&t| f64::from(t) <= seconds);
        let key = after.saturating_sub(1);
        if after == 0 || after == self.times.len() {
            return Moment { key, between: None };
        }
        // Of keys at one time, the last is before `seconds`, so the next is later.
        let [begin, end] = [key, after].map(|k| f64::from(self.times[k]));
        let interval = end - begin;
        Moment { key, between: Some(((seconds - begin) / interval, interval)) }
    }

    fn quaternion(&self, key: usize) -> DVec4 {
        DVec4::from_array(std::array::from_fn(|i| self.at(key, i)))
    }

    /// Number `i` of a key's own value.
    fn at(&self, key: usize, i: usize) -> f64 {
        match self.interpolation {
            Interpolation::Cubic => self.stored(3 * key + 1, i),
            _ => self.stored(key, i),
        }
    }

    fn stored(&self, value: usize, i: usize) -> f64 {
        f64::from(self.values[value * self.width + i])
    }

    /// Number `i` at a moment.
    fn number(&self, moment: Moment, i: usize) -> f64 {
        let Moment { key, between } = moment;
        let begin = self.at(key, i);
        let Some((t, interval)) = between else { return begin };
        let end = self.at(key + 1, i);
        match self.interpolation {
            Interpolation::Step => begin,
            Interpolation::Linear => begin * (1.0 - t) + end * t,
            Interpolation::Cubic => {
                // Appendix C of glTF 2.0.
                let [leaving, arriving] = [3 * key + 2, 3 * (key + 1)].map(|v| self.stored(v, i));
                let (t2, t3) = (t * t, t * t * t);
                (2.0 * t3 - 3.0 * t2 + 1.0) * begin
                    + interval * (t3 - 2.0 * t2 + t) * leaving
                    + (3.0 * t2 - 2.0 * t3) * end
                    + interval * (t3 - t2) * arriving
            }
        }
    }
}
