//! Looks for what tests need, once for all tests. Cargo looks again when a variable changes, and
//! cannot watch for what is not there: this package's program does.

#[path = "src/needs.rs"]
mod needs;

fn main() {
    let [scenes, gpu, browser, window] = needs::missing();
    println!("cargo::rustc-env=MISSING_SCENES={scenes}");
    println!("cargo::rustc-env=MISSING_GPU={gpu}");
    println!("cargo::rustc-env=MISSING_BROWSER={browser}");
    println!("cargo::rustc-env=MISSING_WINDOW={window}");
    println!("cargo::rustc-env=THIRD_PARTY_SCENES={}", needs::scenes().display());
    for variable in ["UMBRAGE_SCENES", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "CHROMIUM"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
}
