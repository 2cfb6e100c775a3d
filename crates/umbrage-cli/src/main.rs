//! The program `umbrage` measures the errors and the cost of shadow mapping techniques.
//!
//! It has two layers: `args` parses and checks arguments; the other modules run the commands.

mod args;
mod bench;
mod compare;
mod devices;
mod figures;
mod info;
mod output;
mod plan;
mod prepare;
mod progress;
mod render;
mod scenes;
mod setup;
mod sweep;
mod theory;
mod values;
mod view;

use args::Command;
use clap::error::ErrorKind;
use std::process::ExitCode;

/// The exit code that shells expect for a wrong command line.
const USAGE_ERROR: u8 = 2;

fn main() -> ExitCode {
    keep_drivers_quiet();
    let (mut command, verbose) = match args::parse(std::env::args_os()) {
        Ok(parsed) => parsed,
        Err(e) if matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return finish(output::print(&e.render().to_string()));
        }
        Err(e) => {
            output::note(&format!("umbrage: {}", args::one_line(&e)));
            return ExitCode::from(USAGE_ERROR);
        }
    };
    start_log(verbose);
    stop_without_traces();
    // Log lines would break a progress bar.
    let quiet = verbose > 0;
    finish(command.take_session().and_then(|()| run(&command, quiet)))
}

fn run(command: &Command, quiet: bool) -> anyhow::Result<()> {
    match command {
        Command::Render(args) => render::run(args, quiet),
        Command::Compare(args) => compare::run(args, quiet),
        Command::Sweep(args) => sweep::run(args, quiet),
        Command::Plan(args) => plan::run(args, quiet),
        Command::Prepare(args) => prepare::run(args, quiet),
        Command::Info(args) => info::run(args, quiet),
        Command::Scenes(args) => scenes::run(args),
        Command::Figures(args) => figures::run(args, quiet),
        Command::Theory(args) => theory::run(args),
        Command::Bench(args) => bench::run(args, quiet),
        Command::View(args) => view::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Completions(args) => {
            output::print(&String::from_utf8_lossy(&args::completions(args.shell)))
        }
        Command::Help(_) => output::print(&umbrage::language::help()),
    }
}

/// Switches off a Vulkan layer of Mesa. The layer asks the desktop which GPU it prefers, and prints
/// an error if there is no desktop. This program chooses the GPU itself.
#[cfg(target_os = "linux")]
#[expect(
    unsafe_code,
    reason = "there is no other way to tell the Vulkan loader to leave a layer out"
)]
fn keep_drivers_quiet() {
    // SAFETY: no other thread runs yet, because this is the first call in `main`.
    unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
}

#[cfg(not(target_os = "linux"))]
fn keep_drivers_quiet() {}

/// The exit code that shells expect from a program that was interrupted.
const INTERRUPTED: i32 = 130;

/// Sees to it that an interrupted or terminated program removes its unfinished files.
fn stop_without_traces() {
    let stop = || umbrage_measure::exit_without_traces(INTERRUPTED);
    if let Err(e) = ctrlc::set_handler(stop) {
        log::warn!("unfinished files stay if this program is stopped: {e}");
    }
}

fn finish(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            output::note(&format!("umbrage: {}", output::one_line(&e)));
            ExitCode::FAILURE
        }
    }
}

fn start_log(verbose: u8) {
    let level = match verbose {
        0 => log::LevelFilter::Warn,
        1 => log::LevelFilter::Info,
        _ => log::LevelFilter::Debug,
    };
    // A missing driver is no error if the CPU renders instead, and the program reports that itself.
    let drivers = if verbose == 0 { log::LevelFilter::Off } else { level };
    env_logger::Builder::new()
        .filter_level(level)
        .filter_module("wgpu_hal", drivers)
        .filter_module("egui_wgpu", drivers)
        .format(|out, record| {
            use std::io::Write;
            writeln!(out, "{}: {}", record.level().as_str().to_lowercase(), record.args())
        })
        .init();
}
