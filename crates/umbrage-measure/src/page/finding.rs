//! The verdict in words.

use super::numbers::{count, duration_ms, percent, significant};
use crate::verdict::{CostUnit, Judged, Verdict, judge, of_results};
use crate::{Mean, Report, Sweep};

/// The result in words: a name to emphasise, what there is to say about it, and what it was judged
/// by.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Finding {
    pub(super) name: String,
    pub(super) rest: String,
    pub(super) judged_by: String,
    /// Index of the technique that comes out best; `None` if there is no competition.
    pub(super) best: Option<usize>,
}

impl Report {
    /// Which technique comes out best, and what that was judged by, in a few sentences of text.
    pub fn verdict(&self) -> String {
        of_report(self).text()
    }
}

impl Sweep {
    /// Which technique comes out best in the mean of all views, and what that was judged by, in a
    /// few sentences of text.
    pub fn verdict(&self) -> String {
        of_sweep(self, &self.means()).text()
    }
}

impl Finding {
    fn text(&self) -> String {
        let Self { name, rest, judged_by, .. } = self;
        [name, rest, judged_by].map(|text| text.trim()).join(" ").trim().to_owned()
    }

    fn only(name: &str, rest: String) -> Self {
        Self { name: name.to_owned(), rest, ..Self::default() }
    }
}

pub(super) fn of_report(report: &Report) -> Finding {
    let first = &report.results[0];
    if first.metrics.counted == 0 {
        let rest = "No pixel shows a surface that faces the light, so there is nothing to measure.";
        return Finding::only("", rest.to_owned());
    }
    let (judged, unit) = of_results(&report.results);
    let names: Vec<&str> = report.results.iter().map(|r| r.shadows.as_str()).collect();
    verdict(&names, &judged, unit, "").unwrap_or_else(|| {
        let wrong = percent(first.metrics.wrong_fraction.unwrap_or(0.0));
        Finding::only(&first.shadows, format!("shows {wrong} % of the counted pixels wrong."))
    })
}

pub(super) fn of_sweep(sweep: &Sweep, means: &[Mean]) -> Finding {
    let competes = |i: usize| {
        sweep.reports().any(|(_, r)| r.results.get(i).is_some_and(|result| result.maps > 0))
    };
    let has_costs = (0..means.len()).filter(|&i| competes(i)).all(|i| means[i].bytes.is_some());
    let judged = |(i, mean): (usize, &Mean)| {
        Some(Judged {
            light_error: mean.light_error.filter(|_| competes(i))?,
            // The figures of the views have been raised to what these can resolve.
            resolution: 0.0,
            cost: mean.bytes.map(|bytes| bytes / 1024.0).filter(|_| has_costs),
            flicker: None,
        })
    };
    let judged: Vec<Option<Judged>> = means.iter().enumerate().map(judged).collect();
    let names: Vec<&str> = means.iter().map(|m| m.shadows.as_str()).collect();
    if let Some(finding) = verdict(&names, &judged, CostUnit::Kibibytes, " in the mean") {
        return finding;
    }
    match means.iter().find_map(|m| Some((m.wrong_fraction?, &m.shadows))) {
        Some((wrong, name)) => {
            let wrong = percent(wrong);
            Finding::only(name, format!("shows {wrong} % of the counted pixels wrong in the mean."))
        }
        None if sweep.views.is_empty() => Finding::only("", "This share has no views.".to_owned()),
        None => Finding::only("", "No view shows anything to measure.".to_owned()),
    }
}

/// The verdict on techniques of these names; `None` if there is no competition. `mean` says what
/// the figures are, after them.
fn verdict(
    names: &[&str],
    judged: &[Option<Judged>],
    unit: CostUnit,
    mean: &str,
) -> Option<Finding> {
    let Verdict { best, ties, most_exact, least_exact } = judge(judged)?;
    let of = |i: usize| judged.get(i).copied().flatten();
    let winner = of(best)?;
    let mut figures = vec![format!("a light error of {}", significant(winner.light_error))];
    figures.extend(winner.cost.map(|cost| match unit {
        CostUnit::Milliseconds => duration_ms(cost),
        CostUnit::Kibibytes => format!("{} KiB", count(cost.round() as u64)),
    }));
    figures.extend(winner.flicker.map(|flicker| format!("{} % flicker", percent(flicker))));
    let mut sentences = vec![format!("comes out best: {}{mean}.", figures.join(", "))];
    if !ties.is_empty() {
        let ties: Vec<&str> = ties.iter().map(|&i| names[i]).collect();
        sentences.push(format!("{} cannot be told from it.", ties.join(" and ")));
    }
    if let Some((exact, name)) = most_exact.and_then(|i| Some((of(i)?, names[i]))) {
        let price = |what, figure: fn(&Judged) -> Option<f64>| {
            let times = figure(&exact)? / figure(&winner)?;
            let is_price = times > 1.0 && times.is_finite();
            is_price.then(|| format!("{} times {what}", significant(times)))
        };
        let prices = [price("the cost", |j| j.cost), price("the flicker", |j| j.flicker)];
        let prices: Vec<String> = prices.into_iter().flatten().collect();
        let error = significant(exact.light_error);
        sentences.push(format!("{name} is more exact, with {error}, at {}.", prices.join(" and ")));
    }
    if let Some((worst, name)) = least_exact.and_then(|i| Some((of(i)?, names[i])))
        && winner.light_error > 0.0
    {
        let times = significant(worst.light_error / winner.light_error);
        sentences.push(format!("{name} has {times} times its light error."));
    }
    Some(Finding {
        name: names[best].to_owned(),
        rest: sentences.join(" "),
        judged_by: judged_by(&winner, unit),
        best: Some(best),
    })
}

/// What a verdict was judged by.
fn judged_by(winner: &Judged, unit: CostUnit) -> String {
    let cost = winner.cost.map(|_| match unit {
        CostUnit::Milliseconds => {
            "by cost (the time of planning, drawing, filtering and lookup, in \
             single frames here, which umbrage bench measures better)"
        }
        CostUnit::Kibibytes => {
            "by cost (the memory that lookups read, because times of this run say \
             nothing about a renderer)"
        }
    });
    let flicker = winner.flicker.map(|_| "by flicker");
    let others: Vec<&str> = cost.into_iter().chain(flicker).collect();
    let mut text =
        "Judged by the light error, which is how wrong visibility is where light shows it"
            .to_owned();
    if others.is_empty() {
        text += ".";
    } else {
        let either = if others.len() == 2 { "either" } else { "that" };
        text +=
            &format!(", {}: half the error is worth four times {either}.", others.join(" and "));
    }
    text += " Errors that differ by less than 5 % or 0.001 are a tie";
    text += if winner.cost.is_some() { ", and so are costs within 10 %." } else { "." };
    text
}

#[cfg(test)]
mod tests {
    use crate::report::tests::report;
    use crate::sweep::tests::sweep;

    #[test]
    fn the_verdict_says_who_is_best_and_by_what() {
        let say = |wrong: &[Option<f64>]| report(wrong).verdict();
        let text = say(&[Some(0.2), Some(0.05), Some(0.051), Some(0.1)]);
        let expected = "lambda=1@1024 comes out best: a light error of 0.0500, 4\u{202f}294\u{202f}967\u{202f}296 KiB. \
             lambda=2@1024 cannot be told from it. lambda=0@1024 has 4.00 times its light error. Judged by \
             the light error, which is how wrong visibility is where light shows it, by cost (the memory";
        assert!(text.starts_with(expected), "{text}");
        assert!(text.ends_with("a tie, and so are costs within 10 %."), "{text}");
        assert_eq!(say(&[Some(0.5)]), "lambda=0@1024 shows 50.0 % of the counted pixels wrong.");
        assert!(say(&[Some(0.0), Some(0.0)]).contains("lambda=1@1024 cannot be told from it"));
        assert!(say(&[None, None]).contains("nothing to measure"));
    }

    #[test]
    fn what_a_more_exact_technique_costs_is_told() {
        let mut report = report(&[Some(0.04), Some(0.03)]);
        report.results[0].bytes = Some(1 << 20);
        report.results[1].bytes = Some(1 << 24);
        for (result, flicker) in report.results.iter_mut().zip([0.01, 0.02]) {
            result.flicker = Some(flicker);
        }
        let text = report.verdict();
        let expected = "lambda=1@1024 is more exact, with 0.0300, at 16.0 times the cost and 2.00 times \
             the flicker.";
        assert!(
            text.starts_with("lambda=0@1024 comes out best") && text.contains(expected),
            "{text}"
        );
        assert!(text.contains("by flicker: half the error is worth four times either"), "{text}");
    }

    #[test]
    fn the_verdict_of_a_sweep_is_on_means() {
        let say = |views: &[Option<&[Option<f64>]>]| sweep(views).verdict();
        let text = say(&[Some(&[Some(0.2), Some(0.02)]), Some(&[Some(0.2), Some(0.08)])]);
        assert!(
            text.starts_with("lambda=1@1024 comes out best: a light error of 0.0400"),
            "{text}"
        );
        assert!(
            text.contains("in the mean. lambda=0@1024 has 5.00 times its light error"),
            "{text}"
        );
        assert!(say(&[Some(&[Some(0.5)])]).contains("lambda=0@1024 shows 50.0 %"));
        assert!(say(&[Some(&[None]), None]).contains("No view shows anything to measure"));
        assert!(say(&[]).contains("no views"));
    }
}
