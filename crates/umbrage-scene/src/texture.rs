use crate::types::{Sampling, Texture, Wrap};
use glam::{Vec2, Vec3, Vec4};
use std::sync::LazyLock;

/// Linear light for each value of an 8-bit sRGB channel (IEC 61966-2-1).
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let c = i as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
});

impl Texture {
    /// Linear red, green, blue and straight alpha at texture coordinates `uv`, as
    /// [`sampling`](Self::sampling) continues them between pixel centres. (0, 0) is the upper left
    /// corner of the image, as in glTF.
    ///
    /// Coordinates that are not finite count as 0. A texture without pixels is opaque white.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let table = &*LINEAR_FROM_SRGB;
        self.value(uv, Vec4::ONE, |p| {
            let color = Vec3::from([p[0], p[1], p[2]].map(|c| table[usize::from(c)]));
            color.extend(f32::from(p[3]) / 255.0)
        })
    }

    /// Only the alpha of [`sample`](Self::sample), for shadow rays, which do not need the colour.
    pub fn sample_alpha(&self, uv: Vec2) -> f32 {
        self.value(uv, 1.0, |p| f32::from(p[3]) / 255.0)
    }

    fn value<T>(&self, uv: Vec2, otherwise: T, pixel: impl Fn([u8; 4]) -> T) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [w, h] = self.size;
        let at =
            |x: usize, y: usize| self.rgba.get(y * w as usize + x).map_or(otherwise, |&p| pixel(p));
        if self.sampling == Sampling::Nearest {
            return at(nearest(uv.x, w, self.wrap[0]), nearest(uv.y, h, self.wrap[1]));
        }
        let (x0, x1, fx) = neighbours(uv.x, w, self.wrap[0]);
        let (y0, y1, fy) = neighbours(uv.y, h, self.wrap[1]);
        let upper = at(x0, y0) * (1.0 - fx) + at(x1, y0) * fx;
        let lower = at(x0, y1) * (1.0 - fx) + at(x1, y1) * fx;
        upper * (1.0 - fy) + lower * fy
    }
}

/// Index of the pixel that a texture coordinate falls into.
fn nearest(coordinate: f32, size: u32, wrap: Wrap) -> usize {
    wrapped((pixels(coordinate, size, wrap)).floor() as i64, size, wrap)
}

/// Indices of the two pixels whose centres enclose a texture coordinate, and the weight of the
/// second.
fn neighbours(coordinate: f32, size: u32, wrap: Wrap) -> (usize, usize, f32) {
    let x = pixels(coordinate, size, wrap) - 0.5;
    let first = x.floor();
    let index = |i: f32| wrapped(i as i64, size, wrap);
    (index(first), index(first + 1.0), x - first)
}

/// A texture coordinate in pixels. It is reduced to one period first, so that large coordinates
/// keep their precision.
fn pixels(coordinate: f32, size: u32, wrap: Wrap) -> f32 {
    let c = if coordinate.is_finite() { coordinate } else { 0.0 };
    let c = match wrap {
        Wrap::Repeat => c.rem_euclid(1.0),
        Wrap::Mirror => c.rem_euclid(2.0),
        Wrap::Clamp => c.clamp(0.0, 1.0),
    };
    c * size as f32
}

/// The pixel that stands for pixel `i`, which may lie outside the image.
fn wrapped(i: i64, size: u32, wrap: Wrap) -> usize {
    let n = i64::from(size.max(1));
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - 1 - i)
        }
        Wrap::Clamp => i.clamp(0, n - 1),
    };
    i as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(wrap: Wrap) -> Texture {
        let (black, white) = ([0, 0, 0, 255], [255, 255, 255, 0]);
        let rgba = vec![black, white, white, black];
        Texture { size: [2, 2], rgba, wrap: [wrap; 2], ..Texture::default() }
    }

    #[test]
    fn pixel_centres_are_exact_and_the_middle_is_their_mean() {
        let t = checker(Wrap::Clamp);
        assert_eq!(t.sample(Vec2::new(0.25, 0.25)), Vec4::new(0.0, 0.0, 0.0, 1.0));
        assert_eq!(t.sample(Vec2::new(0.75, 0.25)), Vec4::new(1.0, 1.0, 1.0, 0.0));
        assert_eq!(t.sample(Vec2::splat(0.5)), Vec4::splat(0.5));
        assert_eq!(t.sample_alpha(Vec2::new(0.75, 0.25)), 0.0);
    }

    #[test]
    fn colour_is_decoded_from_srgb_and_alpha_is_not() {
        let t = Texture { size: [1, 1], rgba: vec![[188, 10, 0, 128]], ..Texture::default() };
        let s = t.sample(Vec2::new(7.3, -2.9));
        assert!((s.x - 0.5029).abs() < 1e-4, "{s}");
        assert!((s.y - 10.0 / 255.0 / 12.92).abs() < 1e-7, "{s}");
        assert!((s.w - 128.0 / 255.0).abs() < 1e-7, "{s}");
    }

    #[test]
    fn wraps_as_told() {
        let at = |wrap, u| checker(wrap).sample(Vec2::new(u, 0.25)).x;
        assert_eq!(at(Wrap::Repeat, 1.25), 0.0);
        assert_eq!(at(Wrap::Repeat, -0.25), 1.0);
        assert_eq!(at(Wrap::Repeat, 0.0), 0.5);
        assert_eq!(at(Wrap::Mirror, 1.25), 1.0);
        assert_eq!(at(Wrap::Mirror, -0.25), 0.0);
        assert_eq!(at(Wrap::Mirror, 0.0), 0.0);
        assert_eq!(at(Wrap::Clamp, 9.0), 1.0);
        assert_eq!(at(Wrap::Clamp, -9.0), 0.0);
    }

    #[test]
    fn nearest_pixels_are_rectangles() {
        let at = |wrap, u: f32| {
            Texture { sampling: Sampling::Nearest, ..checker(wrap) }.sample(Vec2::new(u, 0.25)).x
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let values = [0.0, 0.25, 0.499_999, 0.5, 0.75, 0.999_999].map(|u| at(wrap, u));
            assert_eq!(values, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "{wrap:?}");
        }
        // The image's end belongs to its last pixel, unless another copy begins there.
        let ends = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| at(wrap, 1.0));
        assert_eq!(ends, [0.0, 1.0, 1.0]);
        let before = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| at(wrap, -0.1));
        assert_eq!(before, [1.0, 0.0, 0.0]);
    }

    #[test]
    fn any_coordinates_and_any_texture_give_a_finite_colour() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for u in [f32::NAN, f32::INFINITY, f32::MIN, f32::MAX, 1e20, -1e-30, 0.999_999_94] {
                for t in [checker(wrap), Texture::default()] {
                    assert!(t.sample(Vec2::new(u, 0.1)).is_finite());
                    assert!(t.sample(Vec2::new(0.1, u)).is_finite());
                }
            }
        }
        assert_eq!(Texture::default().sample(Vec2::ZERO), Vec4::ONE);
    }
}
