//! The truth about a view's pixels, traced by `umbrage-trace`, and kept in files.

use crate::view::View;
use bevy_umbrage::umbrage::{Camera, Light};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use umbrage_trace::{Sample, Tracer, shade};

/// What is true of a pixel.
#[derive(Clone, Copy)]
pub(crate) struct Pixel(u8);

impl Pixel {
    /// A surface that faces the sun is seen, no farther than shadows reach.
    const COUNTS: u8 = 1;
    const LIT: u8 = 2;
    /// The same point counts in the frame before.
    const STEADY: u8 = 4;
    /// The normal with which the seen surface is shaded faces the sun as much as it must where a
    /// pixel of Bevy's picture counts.
    const BRIGHT: u8 = 8;

    pub(crate) fn counts(self) -> bool {
        self.0 & Self::COUNTS != 0
    }

    pub(crate) fn visibility(self) -> f32 {
        f32::from(u8::from(self.0 & Self::LIT != 0))
    }

    /// Whether what is seen here was seen in the frame before, and counted there as it does here.
    /// Its visibility is the same then, because the sun does not move.
    pub(crate) fn is_steady(self) -> bool {
        self.0 & Self::STEADY != 0
    }

    pub(crate) fn is_bright(self) -> bool {
        self.0 & Self::BRIGHT != 0
    }
}

/// Returns the truth of some frames, each with the one before. What is traced is kept in `folder`,
/// because it takes longer than Bevy's pictures; to trace anew, remove the folder.
///
/// # Errors
/// If the scene cannot be loaded or traced, or if a file cannot be written.
pub(crate) fn truth(
    view: &View,
    frames: &[Camera],
    scene: &Path,
    folder: &Path,
) -> Result<Vec<Vec<Pixel>>, String> {
    let at = |path: &Path, e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let bytes = std::fs::read(scene).map_err(|e| at(scene, &e))?;
    let pairs = (0..frames.len()).map(|i| (frames[i], i.checked_sub(1).map(|last| frames[last])));
    let pairs: Vec<(Camera, Option<Camera>, PathBuf)> =
        pairs.map(|(now, last)| (now, last, file(view, &bytes, now, last, folder))).collect();
    let mut known: Vec<Option<Vec<Pixel>>> =
        pairs.iter().map(|(camera, _, file)| read(file, camera)).collect();
    if known.iter().all(Option::is_some) {
        return Ok(known.into_iter().flatten().collect());
    }

    let loaded = umbrage_scene::load(scene).map_err(|e| at(scene, &e))?;
    // The harness draws alpha masks as solid.
    let tracer = Tracer::new(&loaded).map_err(|e| at(scene, &e))?.opaque(true);
    std::fs::create_dir_all(folder).map_err(|e| at(folder, &e))?;
    for ((now, last, file), known) in pairs.iter().zip(&mut known) {
        if known.is_none() {
            let pixels = trace(&tracer, view.light(), now, last.as_ref())?;
            let bytes: Vec<u8> = pixels.iter().map(|p| p.0).collect();
            // Another process that reads the file at the same time finds all of it or nothing.
            let unfinished = file.with_extension(format!("{}", std::process::id()));
            std::fs::write(&unfinished, bytes)
                .and_then(|()| std::fs::rename(&unfinished, file))
                .map_err(|e| at(file, &e))?;
            *known = Some(pixels);
        }
    }
    Ok(known.into_iter().flatten().collect())
}

/// To be changed with the meaning of the files, or with how rays are traced.
const VERSION: u32 = 1;

/// The file in which a frame's truth is kept.
fn file(view: &View, scene: &[u8], now: Camera, last: Option<Camera>, folder: &Path) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    (VERSION, scene).hash(&mut hasher);
    // Of a camera and a light the text has all digits.
    format!("{now:?} {last:?} {:?}", view.light()).hash(&mut hasher);
    folder.join(format!("{}-{:016x}.bin", view.name, hasher.finish()))
}

fn read(file: &Path, camera: &Camera) -> Option<Vec<Pixel>> {
    let bytes = std::fs::read(file).ok()?;
    let pixels = camera.image().iter().map(|&n| n as usize).product::<usize>();
    (bytes.len() == pixels).then(|| bytes.into_iter().map(Pixel).collect())
}

fn trace(
    tracer: &Tracer,
    light: Light,
    now: &Camera,
    last: Option<&Camera>,
) -> Result<Vec<Pixel>, String> {
    let view = |camera: &Camera| {
        umbrage_trace::View::new(tracer, *camera, light, 1).map_err(|e| e.to_string())
    };
    let (now, last) = (view(now)?, last.map(view).transpose()?);
    let pixel = |sample: &Sample| {
        let counts = now.counts(sample.is_facing, sample.depth);
        let steady = |last: &umbrage_trace::View| {
            last.sees(&sample.surface).is_some_and(|was| last.counts(was.is_facing, was.depth))
        };
        let bright = shade::incidence(&light, &sample.surface) > crate::harness::LEAST_COSINE;
        let mut bits = 0;
        for (bit, is_set) in [
            (Pixel::COUNTS, counts),
            (Pixel::LIT, counts && now.truth(sample) > 0.5),
            (Pixel::STEADY, counts && last.as_ref().is_some_and(steady)),
            (Pixel::BRIGHT, bright),
        ] {
            bits |= if is_set { bit } else { 0 };
        }
        bits
    };
    let mut pixels = Vec::new();
    for rows in now.bands() {
        let band = now.band(rows, &|_| {});
        pixels.extend(band.map(pixel, &|_| {}).into_iter().map(Pixel));
    }
    Ok(pixels)
}
