//! Writes files completely or not at all.

use crate::temporary::write_whole;
use crate::{Error, Image, Rgb};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image as ExrImage, WritableImage};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::fs::File;
use std::io::{self, BufWriter, Cursor, Write};
use std::path::Path;

/// Writes `bytes` to a file that is never seen incomplete: they go to a temporary file in the same
/// folder, which is then renamed. An existing file is replaced. If the path is not a regular file
/// but, for example, a pipe or `/dev/stdout`, the bytes are written to it directly.
///
/// # Errors
/// The folder does not exist or cannot be written to. No temporary file is left behind then.
pub fn write_file(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
    write_file_with(path.as_ref(), |file| file.write_all(bytes))
}

/// As [`write_file`], for files that need not be in memory as a whole: `write` writes one.
///
/// # Errors
/// As [`write_file`], and those of `write`.
pub fn write_file_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), Error> {
    let buffered = |file: &mut File| {
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.flush()
    };
    let is_device = std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir());
    let written = match is_device {
        true => File::options().write(true).open(path).and_then(|mut file| buffered(&mut file)),
        false => write_whole(path, buffered),
    };
    written.map_err(|source| Error::Write { path: path.to_owned(), source })
}

/// A type of pixel that PNG files can store.
pub trait PngPixel: Copy {
    #[doc(hidden)]
    const COLOR: ExtendedColorType;
    #[doc(hidden)]
    fn bytes(pixels: &[Self]) -> &[u8];
}

/// Stored as grey.
impl PngPixel for u8 {
    const COLOR: ExtendedColorType = ExtendedColorType::L8;
    fn bytes(pixels: &[Self]) -> &[u8] {
        pixels
    }
}

/// Stored as sRGB.
impl PngPixel for Rgb {
    const COLOR: ExtendedColorType = ExtendedColorType::Rgb8;
    fn bytes(pixels: &[Self]) -> &[u8] {
        pixels.as_flattened()
    }
}

/// Writes a PNG file, completely or not at all.
///
/// # Errors
/// As [`write_file`].
pub fn write_png<P: PngPixel>(path: impl AsRef<Path>, image: &Image<P>) -> Result<(), Error> {
    let path = path.as_ref();
    write_file(path, &encode_png(path, image)?)
}

/// The bytes of a PNG file, for use inside another file.
///
/// # Errors
/// The encoder refuses the picture.
pub fn png<P: PngPixel>(image: &Image<P>) -> Result<Vec<u8>, Error> {
    encode_png(Path::new("embedded picture"), image)
}

fn encode_png<P: PngPixel>(path: &Path, image: &Image<P>) -> Result<Vec<u8>, Error> {
    let [w, h] = image.size();
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(P::bytes(image.pixels()), w, h, P::COLOR)
        .map_err(|e| Error::Encode { path: path.to_owned(), reason: e.to_string() })?;
    Ok(bytes)
}

/// A type of pixel that EXR files can store.
pub trait ExrPixel: Copy {
    #[doc(hidden)]
    const CHANNELS: &'static [&'static str];
    #[doc(hidden)]
    fn channel(self, index: usize) -> f32;
}

/// Stored as one channel, `Y`.
impl ExrPixel for f32 {
    const CHANNELS: &'static [&'static str] = &["Y"];
    fn channel(self, _: usize) -> f32 {
        self
    }
}

/// Stored as linear `R`, `G`, `B`.
impl ExrPixel for [f32; 3] {
    const CHANNELS: &'static [&'static str] = &["R", "G", "B"];
    fn channel(self, index: usize) -> f32 {
        self[index]
    }
}

/// Writes an EXR file with the unchanged 32-bit floats, including infinities and NaN, completely or
/// not at all.
///
/// # Errors
/// As [`write_file`].
pub fn write_exr<P: ExrPixel>(path: impl AsRef<Path>, image: &Image<P>) -> Result<(), Error> {
    let path = path.as_ref();
    let channels = P::CHANNELS.iter().enumerate().map(|(i, &name)| {
        let samples = image.pixels().iter().map(|p| p.channel(i)).collect();
        AnyChannel::new(name, FlatSamples::F32(samples))
    });
    let size = image.size().map(|n| n as usize);
    let exr = ExrImage::from_channels((size[0], size[1]), AnyChannels::sort(channels.collect()));
    let mut bytes = Cursor::new(Vec::new());
    exr.write()
        .to_buffered(&mut bytes)
        .map_err(|e| Error::Encode { path: path.to_owned(), reason: e.to_string() })?;
    write_file(path, bytes.get_ref())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only_file(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name());
        names.map(|n| n.into_string().unwrap()).collect()
    }

    #[test]
    fn png_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &Image::from_fn([3, 2], |x, y| [x as u8, y as u8, 7]).unwrap()).unwrap();
        let read = image::open(&path).unwrap();
        assert_eq!(read.color(), image::ColorType::Rgb8);
        assert_eq!(read.to_rgb8().get_pixel(2, 1).0, [2, 1, 7]);
        write_png(&path, &Image::from_fn([2, 2], |x, _| 255 * x as u8).unwrap()).unwrap();
        let read = image::open(&path).unwrap();
        assert_eq!(read.color(), image::ColorType::L8);
        assert_eq!(read.to_luma8().into_raw(), [0, 255, 0, 255]);
        assert_eq!(only_file(folder.path()), ["a.png"]);
    }

    #[test]
    fn exr_keeps_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let values = [0.1, -1e30, f32::INFINITY, f32::NAN, 0.0, 1e-40];
        write_exr(&path, &Image::new([3, 2], values.to_vec()).unwrap()).unwrap();
        let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        let channel = &read.layer_data.channel_data.list[0];
        assert_eq!(channel.name.to_string(), "Y");
        let FlatSamples::F32(samples) = &channel.sample_data else { panic!("not f32") };
        let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(samples), bits(&values));
        write_exr(&path, &Image::from_fn([2, 1], |x, _| [x as f32, 2.0, 3.0]).unwrap()).unwrap();
        let read = image::open(&path).unwrap().to_rgb32f();
        assert_eq!(read.get_pixel(1, 0).0, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn failures_name_the_file_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/folder/a.png");
        let error = write_file(&missing, b"x").unwrap_err().to_string();
        assert!(error.contains("a.png"), "{error}");
        // A folder already has the name of the file.
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        assert!(write_file(&taken, b"x").is_err());
        assert_eq!(only_file(folder.path()), ["taken"]);
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to_and_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path().join("nowhere");
        std::os::unix::fs::symlink("/dev/null", &nowhere).unwrap();
        write_file(&nowhere, b"x").unwrap();
        assert!(nowhere.is_symlink());
        assert_eq!(std::fs::read(&nowhere).unwrap(), b"");
        assert_eq!(only_file(folder.path()), ["nowhere"]);
    }

    #[cfg(unix)]
    #[test]
    fn files_can_be_read_by_whom_the_folder_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_file(&ours, b"x").unwrap();
        std::fs::write(&plain, b"x").unwrap();
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
