//! Prints the reasons why tests will be ignored. If these have changed since the last build,
//! touches `build.rs`, so that Cargo runs it again. With `UMBRAGE_REQUIRE=all`, fails if there are
//! any reasons.

mod needs;

use std::fs::File;
use std::process::ExitCode;
use std::time::SystemTime;

fn main() -> std::io::Result<ExitCode> {
    let built = [
        env!("MISSING_SCENES"),
        env!("MISSING_GPU"),
        env!("MISSING_BROWSER"),
        env!("MISSING_WINDOW"),
    ];
    let missing = needs::missing();
    if missing != built {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/build.rs");
        File::options().append(true).open(script)?.set_modified(SystemTime::now())?;
    }
    let missing: Vec<_> = missing.iter().filter(|reason| !reason.is_empty()).collect();
    let is_fatal =
        !missing.is_empty() && std::env::var("UMBRAGE_REQUIRE").is_ok_and(|v| v == "all");
    for reason in missing {
        eprintln!("some tests will be ignored: {reason}");
    }
    if is_fatal {
        eprintln!("UMBRAGE_REQUIRE=all: nothing may be missing");
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}
