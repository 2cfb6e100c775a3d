use crate::Error;

/// A colour, 8-bit sRGB.
pub type Rgb = [u8; 3];

/// An image with one value per pixel, row by row from the upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    size: [u32; 2],
    pixels: Vec<T>,
}

impl<T> Image<T> {
    /// Makes an image of `size` (width and height, 1 to 65536 each) with one value of `pixels` per
    /// pixel.
    ///
    /// # Errors
    /// [`Error::Size`] or [`Error::Values`] if the two do not match.
    pub fn new(size: [u32; 2], pixels: Vec<T>) -> Result<Self, Error> {
        check_size(size)?;
        if pixels.len() as u64 != u64::from(size[0]) * u64::from(size[1]) {
            return Err(Error::Values { size, values: pixels.len() });
        }
        Ok(Self { size, pixels })
    }

    /// Makes an image by calling `value` with the column and row of each pixel.
    ///
    /// # Errors
    /// [`Error::Size`] if width or height is not 1 to 65536.
    pub fn from_fn(size: [u32; 2], mut value: impl FnMut(u32, u32) -> T) -> Result<Self, Error> {
        check_size(size)?;
        let [w, h] = size;
        let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| value(x, y));
        Ok(Self { size, pixels: pixels.collect() })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The values, row by row from the upper left corner.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// The value at column `x` and row `y`.
    ///
    /// # Panics
    /// The pixel lies outside the image.
    pub fn at(&self, x: u32, y: u32) -> &T {
        assert!(x < self.size[0] && y < self.size[1], "pixel ({x}, {y}) outside {:?}", self.size);
        &self.pixels[self.index(x, y)]
    }

    /// The value at column `x` and row `y`, to be changed.
    ///
    /// # Panics
    /// The pixel lies outside the image.
    pub(crate) fn at_mut(&mut self, x: u32, y: u32) -> &mut T {
        assert!(x < self.size[0] && y < self.size[1], "pixel ({x}, {y}) outside {:?}", self.size);
        let index = self.index(x, y);
        &mut self.pixels[index]
    }

    /// The image whose values are `f` of this image's values.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Image<U> {
        Image { size: self.size, pixels: self.pixels.iter().map(f).collect() }
    }

    pub(crate) fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.size[0] as usize + x as usize
    }

    /// Column and row of the pixel with this index.
    pub(crate) fn position(&self, index: usize) -> [u32; 2] {
        let width = self.size[0] as usize;
        [(index % width) as u32, (index / width) as u32]
    }

    /// Checks that this image has the size of the truth.
    pub(crate) fn check_like<U>(&self, truth: &Image<U>, what: &'static str) -> Result<(), Error> {
        if self.size == truth.size {
            return Ok(());
        }
        Err(Error::Mismatch { what, expected: truth.size, size: self.size })
    }
}

fn check_size(size: [u32; 2]) -> Result<(), Error> {
    if size.iter().all(|n| (1..=65536).contains(n)) {
        return Ok(());
    }
    Err(Error::Size { what: "image", size })
}
