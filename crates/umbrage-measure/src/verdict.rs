//! Which technique comes out best, weighed by its error, its cost and its flicker.

use crate::{Measured, Metrics};

/// Two errors of light, or two flickers, are a tie if they differ by less than this share of the
/// smaller one, or by less than [`UNSEEN`].
const ALIKE: f64 = 0.05;

/// Smallest difference of a mean visibility that counts: a thousandth, a quarter of the step
/// between two neighbouring greys of a screen with 8 bits.
const UNSEEN: f64 = 0.001;

/// Two costs are a tie if they differ by less than this share of the smaller one. Times of the same
/// work differ by as much from run to run.
const COSTS_ALIKE: f64 = 0.1;

/// Exponent of cost and of flicker in the product that is weighed. To halve the error is worth four
/// times the cost, or four times the flicker.
const WEIGHT: f64 = 0.5;

/// What cost is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CostUnit {
    /// Time that shadows take in a frame, milliseconds.
    Milliseconds,
    /// Memory that lookups read, KiB.
    Kibibytes,
}

/// The figures by which a technique is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Judged {
    /// [`Metrics::light_error`], or its mean over many views.
    pub(crate) light_error: f64,
    /// Smallest difference that the measurement can resolve: one pixel of those counted.
    pub(crate) resolution: f64,
    /// In the unit of the verdict; `None` if it is not known for all techniques.
    pub(crate) cost: Option<f64>,
    /// [`Measured::flicker`]; `None` if it was not measured for all techniques.
    pub(crate) flicker: Option<f64>,
}

/// The outcome. Techniques are given by their indices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Verdict {
    pub(crate) best: usize,
    /// Techniques that tie with the best in all that was judged.
    pub(crate) ties: Vec<usize>,
    /// The technique with the least error, if it differs from that of the best by more than a tie.
    pub(crate) most_exact: Option<usize>,
    /// The technique with the largest error, if it differs from that of the best by more than a
    /// tie.
    pub(crate) least_exact: Option<usize>,
}

impl Judged {
    fn error(&self) -> f64 {
        self.light_error.max(self.resolution)
    }

    fn has_error_of(&self, other: &Self) -> bool {
        are_alike(self.error(), other.error(), ALIKE, UNSEEN.max(self.resolution))
    }

    fn ties_with(&self, other: &Self) -> bool {
        let both = |a: Option<f64>, b: Option<f64>| a.zip(b);
        self.has_error_of(other)
            && both(self.cost, other.cost).is_none_or(|(a, b)| are_alike(a, b, COSTS_ALIKE, 0.0))
            && both(self.flicker, other.flicker).is_none_or(|(a, b)| are_alike(a, b, ALIKE, UNSEEN))
    }

    /// The logarithm of what is weighed; less is better.
    fn weight(&self) -> f64 {
        // A flicker that nobody sees is no advantage, and a cost of nothing cannot be measured.
        let flicker = self.flicker.map_or(0.0, |f| f.max(UNSEEN).ln());
        let cost = self.cost.map_or(0.0, |c| c.max(f64::MIN_POSITIVE).ln());
        self.error().max(UNSEEN).ln() + WEIGHT * (cost + flicker)
    }
}

fn are_alike(a: f64, b: f64, share: f64, difference: f64) -> bool {
    (a - b).abs() <= (share * a.min(b)).max(difference)
}

/// Judges techniques; `None` stands for those without figures. `None` if fewer than two have any.
pub(crate) fn judge(techniques: &[Option<Judged>]) -> Option<Verdict> {
    let known: Vec<(usize, Judged)> =
        techniques.iter().enumerate().filter_map(|(i, t)| Some((i, (*t)?))).collect();
    if known.len() < 2 {
        return None;
    }
    let by_error = |a: &&(usize, Judged), b: &&(usize, Judged)| a.1.error().total_cmp(&b.1.error());
    let best = known.iter().min_by(|a, b| {
        // Where nothing that is weighed differs, the error decides, however small the difference.
        a.1.weight().total_cmp(&b.1.weight()).then(by_error(a, b))
    })?;
    let differs = |t: &&(usize, Judged)| !t.1.has_error_of(&best.1);
    Some(Verdict {
        best: best.0,
        ties: known
            .iter()
            .filter(|t| t.0 != best.0 && t.1.ties_with(&best.1))
            .map(|t| t.0)
            .collect(),
        most_exact: known.iter().min_by(by_error).filter(differs).map(|t| t.0),
        least_exact: known.iter().max_by(by_error).filter(differs).map(|t| t.0),
    })
}

/// The figures by which the results of one view are judged, and the unit of cost. `none` is no
/// competitor: it has no shadows at all.
pub(crate) fn of_results(results: &[Measured]) -> (Vec<Option<Judged>>, CostUnit) {
    let competes = |r: &Measured| r.maps > 0;
    let all = |has: fn(&Measured) -> bool| results.iter().filter(|r| competes(r)).all(has);
    // What rays on the CPU take says nothing about what a renderer takes.
    let unit = match all(|r| r.backend == "gpu" && r.ms.total().is_some()) {
        true => CostUnit::Milliseconds,
        false => CostUnit::Kibibytes,
    };
    let without_shadows = results.iter().find(|r| !competes(r)).and_then(|r| r.ms.shade);
    let cost = |r: &Measured| match unit {
        CostUnit::Milliseconds => r.ms.total().map(|ms| {
            let base = without_shadows.filter(|&base| base < ms).unwrap_or(0.0);
            ms - base
        }),
        CostUnit::Kibibytes => r.bytes.map(|bytes| bytes as f64 / 1024.0),
    };
    let has_costs = results.iter().filter(|r| competes(r)).all(|r| cost(r).is_some());
    let has_flicker = all(|r| r.flicker.is_some());
    let judged = |r: &Measured| {
        Some(Judged {
            light_error: r.metrics.light_error.filter(|_| competes(r))?,
            resolution: resolution(&r.metrics),
            cost: cost(r).filter(|_| has_costs),
            flicker: r.flicker.filter(|_| has_flicker),
        })
    };
    (results.iter().map(judged).collect(), unit)
}

/// The least difference that a view can resolve: one wrong pixel.
pub(crate) fn resolution(metrics: &Metrics) -> f64 {
    1.0 / metrics.counted.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(light_error: f64, cost: f64, flicker: Option<f64>) -> Option<Judged> {
        Some(Judged { light_error, resolution: 1e-5, cost: Some(cost), flicker })
    }

    #[test]
    fn error_weighs_more_than_cost() {
        // Half the error for three times the cost is a good bargain, for five times a bad one.
        let at = |cost| judge(&[judged(0.04, 1.0, None), judged(0.02, cost, None)]).unwrap();
        assert_eq!([at(3.0).best, at(5.0).best], [1, 0]);
        assert_eq!((at(3.0).most_exact, at(3.0).least_exact), (None, Some(0)));
        assert_eq!((at(5.0).most_exact, at(5.0).least_exact), (Some(1), None));
    }

    #[test]
    fn flicker_weighs_like_cost() {
        let at = |flicker| {
            judge(&[judged(0.04, 1.0, Some(0.01)), judged(0.02, 1.0, Some(flicker))]).unwrap().best
        };
        assert_eq!([at(0.03), at(0.05)], [1, 0]);
    }

    #[test]
    fn what_nobody_sees_is_a_tie() {
        let verdict = judge(&[
            judged(0.0200, 1.00, None),
            judged(0.0205, 1.05, None),
            judged(0.0205, 1.50, None),
            judged(0.0300, 1.00, None),
        ])
        .unwrap();
        assert_eq!((verdict.best, verdict.ties), (0, vec![1]));
        // Both errors are below what anybody sees, so the cheaper technique is the better one.
        assert_eq!(judge(&[judged(0.0001, 2.0, None), judged(0.0009, 1.0, None)]).unwrap().best, 1);
    }

    #[test]
    fn one_technique_is_no_competition() {
        assert_eq!(judge(&[judged(0.1, 1.0, None), None]), None);
        assert_eq!(judge(&[]), None);
    }

    #[test]
    fn memory_is_the_cost_where_times_mean_nothing() {
        let mut report = crate::report::tests::report(&[Some(0.2), Some(0.1), Some(0.1)]);
        let results = &mut report.results;
        let (judged, unit) = of_results(results);
        assert_eq!(unit, CostUnit::Kibibytes);
        assert_eq!(judged[0].unwrap().cost, Some((1_u64 << 32) as f64));
        for result in &mut *results {
            result.backend = "gpu".to_owned();
        }
        // `none` tells what the picture takes without shadows, and does not compete.
        results[2].maps = 0;
        let (judged, unit) = of_results(results);
        assert_eq!(unit, CostUnit::Milliseconds);
        let cost = judged[0].unwrap().cost.unwrap();
        assert!((cost - (0.004 + 812.5)).abs() < 1e-9, "{cost}");
        assert_eq!(judged[2], None);
    }
}
