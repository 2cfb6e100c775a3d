use crate::{Error, Image};
use serde::{Deserialize, Serialize};

/// How far a technique's visibility is from the truth, over the counted pixels.
///
/// Without counted pixels nothing can be measured: [`counted`](Self::counted) is 0 and all other
/// fields are `None` (JSON `null`), and not 0, which would look like perfection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Number of counted pixels.
    #[serde(default, rename = "counted_pixels")]
    pub counted: u64,
    /// Share of pixels whose visibility differs from the truth by more than 1/2; from 0 to 1.
    pub wrong_fraction: Option<f64>,
    /// The part of `wrong_fraction` that is lit and should be dark, as with leaks and detached
    /// shadows.
    #[serde(default)]
    pub false_light: Option<f64>,
    /// The part of `wrong_fraction` that is dark and should be lit, as with acne and jagged edges.
    #[serde(default)]
    pub false_shadow: Option<f64>,
    /// Mean of |visibility − truth|, from 0 to 1.
    pub mean_abs_error: Option<f64>,
    /// Mean of |visibility − truth|, from 0 to 1, in which a pixel weighs as much as the cosine
    /// between its surface's normal and the direction to the light: errors count as much as they
    /// show on a diffuse surface. `None` if the light meets all surfaces edge-on.
    #[serde(default)]
    pub light_error: Option<f64>,
    /// Mean of ꟻLIP (Andersson et al. 2020) between the two visibility images as 8-bit grey, at
    /// [`nv_flip::DEFAULT_PIXELS_PER_DEGREE`] (67, a desktop monitor), over all pixels of the
    /// picture. Pixels that are not counted have the truth's value in both images. From 0 to 1.
    pub flip: Option<f64>,
}

/// The distribution of the shadow map's error over the counted pixels, in pixels per texel.
///
/// Percentiles are by nearest rank: the smallest value that is not exceeded by at least that share
/// of the pixels. All are `None` if no counted pixel has a finite error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorPx {
    /// Median.
    pub p50: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// Largest error.
    pub max: Option<f64>,
    /// Number of counted pixels that are left out because their error is not finite: no map serves
    /// them, or the surface is edge-on to the light.
    #[serde(default)]
    pub undefined: u64,
}

/// Compares `technique` with `truth`. Both are visibilities from 0 (in shadow) to 1 (lit); values
/// outside, which filters that overshoot give, are clamped. `counted` marks the pixels that show a
/// surface facing the light; values at other pixels do not matter. `cosine` is that of the angle
/// between the surface's normal and the direction to the light, from 0 to 1.
///
/// # Errors
/// The sizes differ, or a visibility or cosine at a counted pixel is not finite.
pub fn measure(
    truth: &Image<f32>,
    technique: &Image<f32>,
    counted: &Image<bool>,
    cosine: &Image<f32>,
) -> Result<Metrics, Error> {
    check_visibilities(truth, technique, counted)?;
    cosine.check_like(truth, "cosine")?;
    check_finite("cosine", cosine, counted)?;
    let mut tally = Tally::default();
    let (mut weights, mut weighed) = (0.0, 0.0);
    let pixels = differences(truth, technique, counted).zip(cosine.pixels());
    for (difference, cosine) in pixels.filter_map(|(d, &c)| Some((d?, c.clamp(0.0, 1.0)))) {
        tally.add_difference(difference);
        weights += f64::from(cosine);
        weighed += f64::from(cosine) * f64::from(difference.abs());
    }
    if tally.counted == 0 {
        return Ok(Metrics::default());
    }
    Ok(Metrics {
        counted: tally.counted,
        wrong_fraction: tally.wrong_fraction(),
        false_light: tally.share(tally.false_light),
        false_shadow: tally.share(tally.false_shadow),
        mean_abs_error: tally.mean_abs_error(),
        light_error: (weights > 0.0).then(|| weighed / weights),
        flip: Some(flip(truth, technique, counted)),
    })
}

/// A count of wrong pixels that grows pixel by pixel, for pictures of which not all is known yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of pixels.
    pub counted: u64,
    /// Number of pixels that are lit and should be dark: visibility exceeds the truth by more than
    /// 1/2.
    pub false_light: u64,
    /// Number of pixels that are dark and should be lit.
    pub false_shadow: u64,
    sum: f64,
}

impl Tally {
    /// Counts a pixel with these visibilities from 0 to 1; values outside are clamped.
    pub fn add(&mut self, truth: f32, technique: f32) {
        self.add_difference(difference(truth, technique));
    }

    fn add_difference(&mut self, difference: f32) {
        self.counted += 1;
        self.false_light += u64::from(difference > 0.5);
        self.false_shadow += u64::from(difference < -0.5);
        self.sum += f64::from(difference.abs());
    }

    fn share(&self, count: u64) -> Option<f64> {
        (self.counted > 0).then(|| count as f64 / self.counted as f64)
    }

    /// [`Metrics::wrong_fraction`] of the pixels counted so far; `None` without any.
    pub fn wrong_fraction(&self) -> Option<f64> {
        self.share(self.false_light + self.false_shadow)
    }

    /// [`Metrics::mean_abs_error`] of the pixels counted so far; `None` without any.
    pub fn mean_abs_error(&self) -> Option<f64> {
        (self.counted > 0).then(|| self.sum / self.counted as f64)
    }
}

/// The distribution of `error`, in pixels per texel, over the `counted` pixels. Values that are not
/// finite are left out and counted in [`ErrorPx::undefined`].
///
/// # Errors
/// The sizes differ.
pub fn measure_error_px(error: &Image<f32>, counted: &Image<bool>) -> Result<ErrorPx, Error> {
    error.check_like(counted, "error")?;
    let all = error.pixels().iter().zip(counted.pixels()).filter(|&(_, &counted)| counted);
    let (mut finite, undefined): (Vec<f32>, Vec<f32>) =
        all.map(|(&e, _)| e).partition(|e| e.is_finite());
    let mut percentile = |p: f64| {
        let rank = (p * finite.len() as f64).ceil() as usize;
        let index = rank.checked_sub(1)?;
        Some(f64::from(*finite.select_nth_unstable_by(index, f32::total_cmp).1))
    };
    Ok(ErrorPx {
        p50: percentile(0.50),
        p95: percentile(0.95),
        max: percentile(1.0),
        undefined: undefined.len() as u64,
    })
}

/// How wrong a technique is in each place of the picture, which is divided into squares.
#[derive(Clone, Debug, PartialEq)]
pub struct Spots {
    /// Width and height of the picture, pixels.
    size: [u32; 2],
    /// The sum of |technique − truth| over the counted pixels of each square, row by row.
    sums: Vec<f64>,
}

impl Spots {
    /// Side of a square, pixels.
    const SIDE: u32 = 32;

    /// Compares `technique` with `truth`. The values are visibilities or any others from 0 to 1,
    /// such as the brightness of pictures.
    ///
    /// # Errors
    /// The sizes differ, or a value at a counted pixel is not finite.
    pub fn measure(
        truth: &Image<f32>,
        technique: &Image<f32>,
        counted: &Image<bool>,
    ) -> Result<Self, Error> {
        check_visibilities(truth, technique, counted)?;
        let size = truth.size();
        let [columns, rows] = size.map(|n| n.div_ceil(Self::SIDE) as usize);
        let mut sums = vec![0.0_f64; columns * rows];
        for (i, difference) in differences(truth, technique, counted).enumerate() {
            let [x, y] = truth.position(i);
            sums[(y / Self::SIDE) as usize * columns + (x / Self::SIDE) as usize] +=
                f64::from(difference.unwrap_or(0.0).abs());
        }
        Ok(Self { size, sums })
    }

    /// The centre of the square in which the technique is most wrong, column and row; `None` if it
    /// is right everywhere.
    pub fn worst(&self) -> Option<[u32; 2]> {
        self.largest(self.sums.iter().copied())
    }

    /// The centre of the square in which techniques differ most in how wrong they are, column and
    /// row; `None` if they do not differ, or if their pictures are not of one size.
    pub fn most_different(techniques: &[&Self]) -> Option<[u32; 2]> {
        let first = techniques.first()?;
        if techniques.iter().any(|t| t.size != first.size) {
            return None;
        }
        let spread = |i: usize| {
            let sums = techniques.iter().map(|t| t.sums[i]);
            sums.clone().fold(0.0, f64::max) - sums.fold(f64::INFINITY, f64::min)
        };
        first.largest((0..first.sums.len()).map(spread))
    }

    /// The centre of the square with the largest value; `None` if no value is above 0. Of equal
    /// squares it is the first.
    fn largest(&self, values: impl Iterator<Item = f64>) -> Option<[u32; 2]> {
        let none = (0, 0.0);
        let (index, value) =
            values.enumerate().fold(none, |best, (i, v)| if v > best.1 { (i, v) } else { best });
        let columns = self.size[0].div_ceil(Self::SIDE) as usize;
        let square = [index % columns, index / columns];
        let center =
            |i: usize| (square[i] as u32 * Self::SIDE + Self::SIDE / 2).min(self.size[i] - 1);
        (value > 0.0).then(|| [center(0), center(1)])
    }
}

/// `technique` − `truth` at each pixel; `None` where the pixel is not counted.
fn differences<'a>(
    truth: &'a Image<f32>,
    technique: &'a Image<f32>,
    counted: &'a Image<bool>,
) -> impl Iterator<Item = Option<f32>> + 'a {
    let pairs = truth.pixels().iter().zip(technique.pixels());
    pairs.zip(counted.pixels()).map(|((&t, &v), &counted)| counted.then(|| difference(t, v)))
}

/// How much lighter a pixel is than the truth, −1 to 1.
fn difference(truth: f32, technique: f32) -> f32 {
    technique.clamp(0.0, 1.0) - truth.clamp(0.0, 1.0)
}

pub(crate) fn check_visibilities(
    truth: &Image<f32>,
    technique: &Image<f32>,
    counted: &Image<bool>,
) -> Result<(), Error> {
    technique.check_like(truth, "visibility")?;
    counted.check_like(truth, "mask of counted pixels")?;
    check_finite("truth", truth, counted)?;
    check_finite("visibility", technique, counted)
}

fn check_finite(
    what: &'static str,
    image: &Image<f32>,
    counted: &Image<bool>,
) -> Result<(), Error> {
    let mut values = image.pixels().iter().zip(counted.pixels());
    match values.position(|(v, &counted)| counted && !v.is_finite()) {
        Some(i) => {
            let (pixel, value) = (image.position(i), image.pixels()[i]);
            Err(Error::NotFinite { what, pixel, value })
        }
        None => Ok(()),
    }
}

fn flip(truth: &Image<f32>, technique: &Image<f32>, counted: &Image<bool>) -> f64 {
    let [w, h] = truth.size();
    let picture = |visibility: &Image<f32>| {
        let values = visibility.pixels().iter().zip(truth.pixels()).zip(counted.pixels());
        let rgb: Vec<u8> = values
            .flat_map(|((&v, &truth), &counted)| {
                [crate::maps::grey(if counted { v } else { truth }); 3]
            })
            .collect();
        nv_flip::FlipImageRgb8::with_data(w, h, &rgb)
    };
    let map = nv_flip::flip(picture(truth), picture(technique), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    // The sum is made here in double precision, because the pool of `nv_flip` sums in single
    // precision and also keeps a histogram.
    let values = map.to_vec();
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image<T: Clone>(size: [u32; 2], pixels: &[T]) -> Image<T> {
        Image::new(size, pixels.to_vec()).unwrap()
    }

    #[test]
    fn counts_by_definition() {
        // A pixel is wrong if it differs by *more* than 1/2. The fourth pixel would be wrong but is
        // not counted. Values outside 0 to 1 are clamped.
        let truth = image([6, 1], &[0.0, 1.0, 1.0, 0.0, 0.5, 1.0]);
        let technique = image([6, 1], &[1.0, 0.0, 0.5, 1.0, 0.75, 1.5]);
        let counted = image([6, 1], &[true, true, true, false, true, true]);
        let cosine = image([6, 1], &[1.0, 0.5, 0.0, 1.0, 0.25, 0.25]);
        let m = measure(&truth, &technique, &counted, &cosine).unwrap();
        assert_eq!(m.counted, 5);
        assert_eq!(m.wrong_fraction, Some(2.0 / 5.0));
        assert_eq!(m.false_light, Some(1.0 / 5.0));
        assert_eq!(m.false_shadow, Some(1.0 / 5.0));
        assert_eq!(m.mean_abs_error, Some(2.75 / 5.0));
        // The differences 1, 1, ½, ¼ and 0 weigh 1, ½, 0, ¼ and ¼.
        assert_eq!(m.light_error, Some(1.5625 / 2.0));
    }

    #[test]
    fn flip_sees_only_counted_pixels() {
        let size = [40, 30];
        let truth = Image::from_fn(size, |x, _| if x < 20 { 0.0 } else { 1.0 }).unwrap();
        let half = Image::from_fn(size, |x, y| f32::from(x >= 20) * f32::from(y < 15)).unwrap();
        let all = truth.map(|_| true);
        let upper = Image::from_fn(size, |_, y| y < 15).unwrap();
        let measure =
            |truth, technique, counted| measure(truth, technique, counted, &all.map(|_| 1.0));
        assert_eq!(measure(&truth, &truth, &all).unwrap().flip, Some(0.0));
        assert_eq!(measure(&truth, &half, &upper).unwrap().flip, Some(0.0));
        // A quarter of the picture changes from white to black: ꟻLIP is near 1 inside the quarter,
        // and its filter spreads it by a few pixels.
        let flip = measure(&truth, &half, &all).unwrap().flip.unwrap();
        assert!((0.2..0.35).contains(&flip), "{flip}");
    }

    #[test]
    fn nothing_counted_is_no_praise() {
        let v = image([2, 2], &[f32::NAN; 4]);
        let none = v.map(|_| false);
        assert_eq!(measure(&v, &v, &none, &v).unwrap(), Metrics::default());
        assert_eq!(measure_error_px(&v, &none).unwrap(), ErrorPx::default());
        assert_eq!(Spots::measure(&v, &v, &none).unwrap().worst(), None);
    }

    #[test]
    fn tiny_images_have_metrics() {
        let (dark, lit, counted) =
            (image([1, 1], &[0.0]), image([1, 1], &[1.0]), image([1, 1], &[true]));
        let m = measure(&dark, &lit, &counted, &lit).unwrap();
        assert_eq!(m.wrong_fraction, Some(1.0));
        assert!(m.flip.unwrap() > 0.5, "{m:?}");
    }

    #[test]
    fn names_what_is_wrong() {
        let (a, b) = (image([2, 1], &[0.0; 2]), image([1, 2], &[0.0; 2]));
        let counted = a.map(|_| true);
        let measure = |truth, technique, counted| measure(truth, technique, counted, &a);
        let text = |e: Result<Metrics, Error>| e.unwrap_err().to_string();
        assert_eq!(
            text(measure(&a, &b, &counted)),
            "visibility must be 2x1 pixels like the truth, is 1x2"
        );
        let nan = image([2, 1], &[0.0, f32::NAN]);
        assert_eq!(
            text(measure(&a, &nan, &counted)),
            "visibility: pixel (1, 0) is NaN, must be finite"
        );
        assert_eq!(text(measure(&nan, &a, &counted)), "truth: pixel (1, 0) is NaN, must be finite");
        assert!(matches!(Image::<f32>::new([0, 4], vec![]), Err(Error::Size { .. })));
        assert!(matches!(Image::new([2, 2], vec![1.0]), Err(Error::Values { values: 1, .. })));
    }

    #[test]
    fn edge_on_surfaces_count_as_little_as_they_show() {
        // Half of a sphere's picture is wrong: the outer half of its radius, where the light behind
        // the viewer meets it at a slant. The mean of the cosine √(1 − r²) over the disc is 2/3,
        // and beyond r = a it is (1 − a²)^(3/2) of that.
        let n = 400;
        let radius = |x: u32, y: u32| {
            let at = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
            at(x).hypot(at(y))
        };
        let picture = |value: &dyn Fn(f64) -> f64| {
            Image::from_fn([n, n], |x, y| value(radius(x, y)) as f32).unwrap()
        };
        let truth = picture(&|_| 1.0);
        let technique = picture(&|r| f64::from(r < 0.5));
        let cosine = picture(&|r| (1.0 - r * r).max(0.0).sqrt());
        let counted = Image::from_fn([n, n], |x, y| radius(x, y) < 1.0).unwrap();
        let m = measure(&truth, &technique, &counted, &cosine).unwrap();
        assert!((m.mean_abs_error.unwrap() - 0.75).abs() < 1e-3, "{m:?}");
        assert!((m.light_error.unwrap() - 0.75f64.powf(1.5)).abs() < 1e-3, "{m:?}");
        let edge_on = measure(&truth, &technique, &counted, &truth.map(|_| 0.0)).unwrap();
        assert_eq!(edge_on.light_error, None);
    }

    #[test]
    fn percentiles_are_by_nearest_rank() {
        // The values 1 to 100 in shuffled order, one outlier that is not counted, and two values
        // that are not finite.
        let mut values: Vec<f32> = (0..100).map(|i| (i * 37 % 100 + 1) as f32).collect();
        values.extend([1e9, f32::INFINITY, f32::NAN]);
        let error = image([103, 1], &values);
        let counted = Image::from_fn([103, 1], |x, _| x != 100).unwrap();
        let expected = ErrorPx { p50: Some(50.0), p95: Some(95.0), max: Some(100.0), undefined: 2 };
        assert_eq!(measure_error_px(&error, &counted).unwrap(), expected);
        let one = image([1, 1], &[3.0]);
        let only = ErrorPx { p50: Some(3.0), p95: Some(3.0), max: Some(3.0), undefined: 0 };
        assert_eq!(measure_error_px(&one, &one.map(|_| true)).unwrap(), only);
    }

    #[test]
    fn finds_the_worst_spot() {
        let truth = Image::from_fn([100, 70], |_, _| 1.0).unwrap();
        let technique =
            Image::from_fn([100, 70], |x, y| f32::from(!(x > 96 && y > 64 || x < 2 && y < 2)))
                .unwrap();
        let all = truth.map(|_| true);
        // The square at the lower right is cut off by the edge of the picture; its centre stays
        // inside.
        let wrong = Spots::measure(&truth, &technique, &all).unwrap();
        let right = Spots::measure(&truth, &truth, &all).unwrap();
        assert_eq!([wrong.worst(), right.worst()], [Some([99, 69]), None]);
        // Techniques that are equally wrong there differ elsewhere.
        let both = technique.map(|&v| v);
        let other =
            Image::from_fn([100, 70], |x, y| both.at(x, y) * f32::from((x, y) != (40, 3))).unwrap();
        let other = Spots::measure(&truth, &other, &all).unwrap();
        assert_eq!(other.worst(), Some([99, 69]));
        assert_eq!(Spots::most_different(&[&wrong, &other, &wrong]), Some([48, 16]));
        assert_eq!(Spots::most_different(&[&wrong, &wrong]), None);
        assert_eq!(Spots::most_different(&[]), None);
    }
}
