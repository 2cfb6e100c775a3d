//! Looks for what some tests need and a machine may lack: third-party scenes, a GPU, a browser and
//! a screen for windows.

use std::path::{Path, PathBuf};

/// For third-party scenes, a GPU, a browser and windows, in this order: the reason why tests that
/// need it are ignored. The reason is empty if the need is met.
pub(crate) fn missing() -> [String; 4] {
    [missing_scenes(), missing_gpu(), missing_browser(), missing_window()]
        .map(Option::unwrap_or_default)
}

/// The folder of third-party scenes, whether or not it exists.
pub(crate) fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(named_scenes())
}

/// The folder of third-party scenes, relative to the workspace's root.
fn named_scenes() -> String {
    set("UMBRAGE_SCENES").unwrap_or("../shared/scenes".into())
}

fn missing_scenes() -> Option<String> {
    (!scenes().is_dir()).then(|| {
        let folder = named_scenes();
        format!("needs third-party scenes: {folder} is no folder (UMBRAGE_SCENES names another)")
    })
}

/// Only Linux can lack every GPU driver. There the Vulkan loader finds drivers by these JSON files.
fn missing_gpu() -> Option<String> {
    let folders = ["/etc/vulkan/icd.d", "/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"];
    let is_driver = |path: &Path| path.extension().is_some_and(|e| e == "json");
    let has_driver = |folder| {
        std::fs::read_dir(folder).is_ok_and(|files| files.flatten().any(|f| is_driver(&f.path())))
    };
    let told = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].into_iter().find_map(set);
    let is_here = match told {
        Some(files) => std::env::split_paths(&files).any(|f| f.is_file()),
        None => folders.into_iter().any(has_driver),
    };
    (cfg!(target_os = "linux") && !is_here)
        .then(|| "needs a GPU: there is no Vulkan driver (tools/setup installs one)".to_owned())
}

fn missing_browser() -> Option<String> {
    let told = set("CHROMIUM");
    let names = told
        .as_deref()
        .map_or(vec!["chromium", "chromium-browser", "google-chrome"], |name| vec![name]);
    (!names.iter().any(|name| is_program(name))).then(|| {
        format!("needs a browser: there is no {} (tools/setup installs Chromium)", names.join(", "))
    })
}

/// Each test opens its windows on a screen of its own, which nobody sees.
fn missing_window() -> Option<String> {
    (!is_program("Xvfb"))
        .then(|| "needs a window: there is no Xvfb (tools/setup installs it)".to_owned())
}

fn is_program(name: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(name).is_file())
}

fn set(variable: &str) -> Option<String> {
    std::env::var(variable).ok().filter(|value| !value.is_empty())
}
