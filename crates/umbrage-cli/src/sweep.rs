//! `umbrage sweep` compares techniques in many views and takes means over all views. Large sweeps
//! can be split into shares.

use crate::args;
use crate::output::{aligned, command_line, note, option, print};
use crate::progress::Bar;
use anyhow::{Result, ensure};
use umbrage_lab::{SweepOptions, join_shares, sweep};
use umbrage_measure::Sweep;

/// Compares in the views that have no results yet, or joins shares. Prints a table or JSON.
pub(crate) fn run(args: &args::Sweep, quiet: bool) -> Result<()> {
    let techniques = &args.comparison.techniques;
    let options = SweepOptions {
        views: args.views.clone(),
        output: args.output.clone(),
        scenes: args.scenes.clone(),
        comparison: args.comparison.options(),
        max_error: techniques.texels.max_error,
        fit: techniques.fit.into(),
        backend: techniques.execution.backend.into(),
        detail: techniques.execution.detail(),
        opaque: args.changes.opaque,
        scene: args.changes.options(),
        size: args.size,
        command: command_line(),
        words: option,
    };
    let bar = Bar::of_parts(quiet);
    let sweep = match args.merge.is_empty() {
        true => sweep(&options, args.shard, &bar)?,
        false => join_shares(&options, &args.merge, &bar)?,
    };
    drop(bar);
    let page = args.output.join("index.html");
    if args.json {
        note(&format!("report: {}", page.display()));
        print(&sweep.to_json()?)?;
    } else {
        print(&format!("{}\n{}\nreport: {}\n", table(&sweep), sweep.verdict(), page.display()))?;
    }
    let failed: Vec<&str> =
        sweep.views.iter().filter(|v| v.outcome.is_err()).map(|v| v.name.as_str()).collect();
    ensure!(
        failed.is_empty(),
        "{} of {} views failed: {}",
        failed.len(),
        sweep.views.len(),
        failed.join(", ")
    );
    Ok(())
}

fn table(sweep: &Sweep) -> String {
    let mut rows = vec![
        ["geometric mean of", "light error", "wrong", "mean error", "views"].map(str::to_owned),
    ];
    rows.extend(sweep.means().into_iter().map(|m| {
        let text = |v: Option<f64>, text: fn(f64) -> String| v.map_or("-".to_owned(), text);
        [
            m.shadows,
            text(m.light_error, |v| format!("{v:.4}")),
            text(m.wrong_fraction, |v| format!("{:.2}%", v * 100.0)),
            text(m.mean_abs_error, |v| format!("{v:.4}")),
            m.views.to_string(),
        ]
    }));
    aligned(&rows)
}
