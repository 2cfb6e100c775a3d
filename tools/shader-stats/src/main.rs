//! `shader-stats FILTER…` counts the instructions of the fragment shader that draws a frame, for
//! each filter: as Mesa's compiler for AMD's GPUs makes it, which needs no such GPU.
//! CONTRIBUTING.md says how to run it and what it cannot see.

mod radv;
mod text;

use anyhow::{Context, Result};
use text::Paths;

/// The filters that are counted if none are given.
const FILTERS: [&str; 6] = ["hard", "pcf2", "pcf3", "pcf5", "pcf3(blur=2px)", "pcss"];

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let filters = if given.is_empty() { FILTERS.map(str::to_owned).to_vec() } else { given };
    let compiler = radv::Compiler::open()?;
    eprintln!("{}", compiler.device());
    let without = compiler.instructions(&text::without_lookup()?)?;
    println!("{:28} {:>8} {:>8} {:>8} {:>8}", "filter", "all", "one map", "slices", "lookup");
    println!("{:28} {without:>8} {without:>8} {without:>8} {:>8}", "none", 0);
    for filter in filters {
        let count = |paths| -> Result<u64> {
            let text = text::frame(&filter, paths)?;
            compiler.instructions(&text).with_context(|| format!("filter {filter}"))
        };
        let [all, one] = [count(Paths::All)?, count(Paths::Straight)?];
        let slices = count(Paths::Slices)?;
        let lookup = one.saturating_sub(without);
        println!("{filter:28} {all:>8} {one:>8} {slices:>8} {lookup:>8}");
    }
    Ok(())
}
