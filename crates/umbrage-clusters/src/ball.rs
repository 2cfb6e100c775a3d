//! Balls that certainly contain what they should.

use crate::Ball;
#[cfg(feature = "build")]
use glam::{DVec3, Vec3};

impl Ball {
    /// Whether this ball contains `other`, computed in `f64`.
    #[must_use]
    pub fn contains(&self, other: &Ball) -> bool {
        let distance = self.center.as_dvec3().distance(other.center.as_dvec3());
        distance + f64::from(other.radius) <= f64::from(self.radius)
    }
}

#[cfg(feature = "build")]
impl Ball {
    /// A small ball around all `points`, of which there is at least one.
    pub(crate) fn around_points(points: impl Iterator<Item = Vec3>) -> Self {
        Self::around(points.map(|center| Ball { center, radius: 0.0 }))
    }

    /// A small ball around all `balls`, of which there is at least one.
    ///
    /// Starts from the two balls that stick out most along an axis and grows towards whatever lies
    /// outside, after Ritter, *An Efficient Bounding Sphere*, Graphics Gems, 1990; the second round
    /// starts at the first one's center and moves towards the farthest, as Bădoiu and Clarkson do.
    pub(crate) fn around(balls: impl Iterator<Item = Ball>) -> Self {
        let balls: Vec<Ball> = balls.collect();
        let mut ends: Option<[(Ball, Ball); 3]> = None;
        for &ball in &balls {
            let ends = ends.get_or_insert([(ball, ball); 3]);
            for (axis, (low, high)) in ends.iter_mut().enumerate() {
                if ball.center[axis] - ball.radius < low.center[axis] - low.radius {
                    *low = ball;
                }
                if ball.center[axis] + ball.radius > high.center[axis] + high.radius {
                    *high = ball;
                }
            }
        }
        let Some(ends) = ends else { return Self::default() };
        let length = |(low, high): &(Ball, Ball)| {
            low.center.as_dvec3().distance(high.center.as_dvec3())
                + f64::from(low.radius)
                + f64::from(high.radius)
        };
        let widest = ends.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
        let widest = widest.expect("there are three axes");
        let (mut center, mut radius) = (widest.0.center.as_dvec3(), f64::from(widest.0.radius));
        for &ball in std::iter::once(&widest.1).chain(&balls) {
            (center, radius) = joined((center, radius), ball);
        }
        let farthest = |center: DVec3| {
            balls
                .iter()
                .map(|&ball| {
                    (ball.center.as_dvec3().distance(center) + f64::from(ball.radius), ball)
                })
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .expect("there is a ball")
        };
        let mut best = (farthest(center).0, center);
        for step in 1..8 {
            let (distance, ball) = farthest(center);
            if distance < best.0 {
                best = (distance, center);
            }
            center += (ball.center.as_dvec3() - center) / f64::from(step + 4);
        }
        // Measured from the rounded center, and rounded up, so that nothing sticks out.
        let center = best.1.as_vec3();
        let radius = farthest(center.as_dvec3()).0 * (1.0 + 1e-6);
        Self { center, radius: (radius as f32).next_up() }
    }
}

#[cfg(feature = "build")]
fn joined((center, radius): (DVec3, f64), ball: Ball) -> (DVec3, f64) {
    let towards = ball.center.as_dvec3() - center;
    let distance = towards.length();
    let reach = distance + f64::from(ball.radius);
    if reach <= radius {
        return (center, radius);
    }
    if distance + radius <= f64::from(ball.radius) {
        return (ball.center.as_dvec3(), f64::from(ball.radius));
    }
    let grown = 0.5 * (radius + reach);
    (center + towards * ((grown - radius) / distance), grown)
}
