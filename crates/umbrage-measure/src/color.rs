//! Colours with a meaning, the same in every picture and in the legends of the reports.

use crate::{Error, Rgb};
use std::sync::LazyLock;

/// The colour of pixels that are lit and should be dark. People with any common kind of colour
/// vision can tell it from [`FALSE_SHADOW`].
pub const FALSE_LIGHT: Rgb = [255, 176, 0];
/// The colour of pixels that are dark and should be lit.
pub const FALSE_SHADOW: Rgb = [56, 140, 255];
/// The colours of a plan's maps; they repeat. Okabe and Ito's palette without its black and grey.
pub const PARTITIONS: [Rgb; 7] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [240, 228, 66],
    [213, 94, 0],
    [0, 114, 178],
];

/// Number of colours for levels of detail.
pub const LEVELS: usize = 16;

/// The colours of levels of detail; levels beyond have the last. From red for the finest through
/// yellow, green and blue to magenta, in equal steps of colour (by arc length in OKLab).
pub static LEVEL_COLORS: LazyLock<[Rgb; LEVELS]> = LazyLock::new(|| {
    // Lightness, chroma, and hue in degrees (OKLCh).
    let stops = [
        [0.64, 0.20, 27.0],
        [0.75, 0.16, 60.0],
        [0.88, 0.17, 98.0],
        [0.78, 0.19, 142.0],
        [0.81, 0.12, 200.0],
        [0.62, 0.17, 255.0],
        [0.54, 0.21, 300.0],
        [0.68, 0.24, 335.0],
    ];
    let stops = stops.map(oklab_from_oklch);
    std::array::from_fn(|level| srgb_from_oklab(along(&stops, level as f32 / (LEVELS - 1) as f32)))
});

/// The colour at a share of the length of a scale of all levels of detail.
pub fn level_scale(share: f32) -> Rgb {
    LEVEL_COLORS[((share * LEVELS as f32) as usize).min(LEVELS - 1)]
}

/// The colour of a cluster of triangles: that of its level of detail, a little darker by its
/// number, so that neighbours can be told apart.
pub fn cluster_color(number: u32, level: u32) -> Rgb {
    // Fibonacci hashing (Knuth 1973), as in the overlays of `umbrage-render`.
    let hash = (number.wrapping_mul(2_654_435_769) >> 24) as f32 / 255.0;
    mix([0; 3], LEVEL_COLORS[(level as usize).min(LEVELS - 1)], 1.0 - 0.25 * hash)
}

/// A scale of colours for pixels per texel, logarithmic from 1/max to max.
///
/// The scale diverges from 1, where a texel is as large as a pixel and the colour is a pale
/// neutral. Blue means finer (texels are wasted) and orange coarser (edges are jagged). Equal
/// ratios are equal steps of colour (by arc length in OKLab), lightness falls alike on both sides,
/// and colour-blind people can tell blue from orange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorScale {
    max: f32,
}

impl Default for ErrorScale {
    /// The scale from 1/32 to 32 pixels per texel. It is fixed, so that reports can be compared.
    fn default() -> Self {
        Self { max: 32.0 }
    }
}

impl ErrorScale {
    /// The scale from 1/`max` to `max` pixels per texel.
    ///
    /// # Errors
    /// `max` is not in (1, 10⁶].
    pub fn new(max: f32) -> Result<Self, Error> {
        if max > 1.0 && max <= 1e6 { Ok(Self { max }) } else { Err(Error::Scale { max }) }
    }

    /// The upper end of the scale, pixels per texel. The lower end is its reciprocal.
    pub fn max(self) -> f32 {
        self.max
    }

    /// The position of an error on the scale: −1 at 1/max and below, 0 at 1, 1 at max and above.
    /// `None` for NaN.
    pub fn position(self, error_px: f32) -> Option<f32> {
        (!error_px.is_nan())
            .then(|| (error_px.max(f32::MIN_POSITIVE).ln() / self.max.ln()).clamp(-1.0, 1.0))
    }

    /// The colour of an error in pixels per texel; `None` for NaN.
    pub fn color(self, error_px: f32) -> Option<Rgb> {
        self.position(error_px).map(color_at)
    }
}

/// The colour at a position on the scale, from −1 to 1.
pub(crate) fn color_at(position: f32) -> Rgb {
    let middle = (DIVERGING.len() / 2) as f32;
    DIVERGING[(middle + middle * position.clamp(-1.0, 1.0)).round() as usize]
}

/// A mix of two colours by their sRGB values; `amount`, from 0 to 1, is the share of the second.
pub(crate) fn mix(a: Rgb, b: Rgb, amount: f32) -> Rgb {
    std::array::from_fn(|i| {
        let (a, b) = (f32::from(a[i]), f32::from(b[i]));
        (a + (b - a) * amount.clamp(0.0, 1.0)).round() as u8
    })
}

/// The colours of the scale, from 1/max to max.
static DIVERGING: LazyLock<[Rgb; 513]> = LazyLock::new(|| {
    // Lightness, chroma, and hue in degrees (OKLCh), from the middle outwards.
    let middle = [0.965, 0.006, 90.0];
    let finer = [
        middle,
        [0.84, 0.066, 235.0],
        [0.66, 0.122, 248.0],
        [0.47, 0.135, 258.0],
        [0.29, 0.094, 264.0],
    ];
    let coarser = [
        middle,
        [0.84, 0.105, 75.0],
        [0.66, 0.158, 50.0],
        [0.47, 0.142, 36.0],
        [0.29, 0.088, 28.0],
    ];
    std::array::from_fn(|i| {
        let position = (i as f32 - 256.0) / 256.0;
        let stops = if position < 0.0 { finer } else { coarser };
        srgb_from_oklab(along(&stops.map(oklab_from_oklch), position.abs()))
    })
});

/// The point of a polyline at a share of its length.
fn along(points: &[[f32; 3]], share: f32) -> [f32; 3] {
    let length =
        |p: &[[f32; 3]]| p[0].iter().zip(p[1]).map(|(a, b)| (b - a).powi(2)).sum::<f32>().sqrt();
    let mut left = share * points.windows(2).map(length).sum::<f32>();
    for pair in points.windows(2) {
        let piece = length(pair);
        if left <= piece {
            return std::array::from_fn(|i| pair[0][i] + (pair[1][i] - pair[0][i]) * left / piece);
        }
        left -= piece;
    }
    points[points.len() - 1]
}

fn oklab_from_oklch([lightness, chroma, hue_deg]: [f32; 3]) -> [f32; 3] {
    let (sin, cos) = hue_deg.to_radians().sin_cos();
    [lightness, chroma * cos, chroma * sin]
}

/// Conversion of Ottosson 2020, "A perceptual color space for image processing".
fn srgb_from_oklab([l, a, b]: [f32; 3]) -> Rgb {
    let lms = [
        l + 0.396_337_78 * a + 0.215_803_76 * b,
        l - 0.105_561_346 * a - 0.063_854_17 * b,
        l - 0.089_484_18 * a - 1.291_485_5 * b,
    ]
    .map(|v| v.powi(3));
    let dot = |m: [f32; 3]| m[0] * lms[0] + m[1] * lms[1] + m[2] * lms[2];
    [
        dot([4.076_741_7, -3.307_711_6, 0.230_969_94]),
        dot([-1.268_438, 2.609_757_4, -0.341_319_4]),
        dot([-0.004_196_086_3, -0.703_418_6, 1.707_614_7]),
    ]
    .map(|linear| {
        let v = if linear <= 0.003_130_8 {
            12.92 * linear
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        (v.clamp(0.0, 1.0) * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(c: Rgb) -> [f32; 3] {
        c.map(|v| {
            let v = f32::from(v) / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        })
    }

    fn times(m: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
        m.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
    }

    fn oklab(linear: [f32; 3]) -> [f32; 3] {
        let lms = times(
            [
                [0.412_221_46, 0.536_332_55, 0.051_445_995],
                [0.211_903_5, 0.680_699_5, 0.107_396_96],
                [0.088_302_46, 0.281_718_85, 0.629_978_7],
            ],
            linear,
        );
        times(
            [
                [0.210_454_26, 0.793_617_8, -0.004_072_047],
                [1.977_998_5, -2.428_592_2, 0.450_593_7],
                [0.025_904_037, 0.782_771_77, -0.808_675_77],
            ],
            lms.map(|v| v.max(0.0).cbrt()),
        )
    }

    fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt()
    }

    /// Matrices that take linear sRGB to the colours that dichromats see: Machado et al. 2009,
    /// severity 1.
    const DICHROMATS: [[[f32; 3]; 3]; 3] = [
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ],
    ];

    #[test]
    fn scale_is_perceptually_uniform() {
        let at = |i: i32| oklab(linear(color_at(i as f32 / 16.0)));
        for side in [-16..0, 0..16] {
            let steps: Vec<f32> = side.map(|i| distance(at(i), at(i + 1))).collect();
            let mean = steps.iter().sum::<f32>() / 16.0;
            assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.15), "{mean} {steps:?}");
        }
    }

    #[test]
    fn meanings_stay_apart_for_the_colour_blind() {
        let seen = |m, c| oklab(times(m, linear(c)).map(|v: f32| v.clamp(0.0, 1.0)));
        for m in DICHROMATS {
            assert!(distance(seen(m, FALSE_LIGHT), seen(m, FALSE_SHADOW)) > 0.2);
            for i in 0..16 {
                let p = i as f32 / 16.0;
                let (finer, coarser) =
                    (seen(m, color_at(-p - 0.0625)), seen(m, color_at(p + 0.0625)));
                assert!(distance(finer, coarser) > 0.03 + 0.1 * p, "at ±{p}");
                // Lightness falls outwards on both sides, so that the order can be seen without
                // hue.
                for s in [-1.0, 1.0] {
                    let (inner, outer) =
                        (seen(m, color_at(s * p)), seen(m, color_at(s * (p + 0.0625))));
                    assert!(inner[0] > outer[0], "at {}", s * p);
                }
            }
        }
    }

    #[test]
    fn levels_of_detail_stay_apart() {
        let lab = |level: usize| oklab(linear(LEVEL_COLORS[level]));
        let steps: Vec<f32> = (1..LEVELS).map(|i| distance(lab(i - 1), lab(i))).collect();
        let mean = steps.iter().sum::<f32>() / steps.len() as f32;
        assert!(mean > 0.06, "{mean}");
        assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.3), "{mean} {steps:?}");
        assert_eq!(cluster_color(0, 3), LEVEL_COLORS[3]);
        assert_eq!(cluster_color(0, u32::MAX), LEVEL_COLORS[LEVELS - 1]);
        // A cluster is darker by its number, and never as dark as to look like another level.
        for number in 1..1000 {
            let darker = cluster_color(number, 0);
            assert!((0..3).all(|c| darker[c] <= LEVEL_COLORS[0][c]), "{darker:?}");
            assert!(darker[0] as f32 >= 0.74 * f32::from(LEVEL_COLORS[0][0]), "{darker:?}");
        }
        assert_ne!(cluster_color(1, 0), cluster_color(2, 0));
    }

    #[test]
    fn scale_meets_its_landmarks() {
        let scale = ErrorScale::default();
        let color = |e: f32| scale.color(e).unwrap();
        assert_eq!(scale.position(1.0), Some(0.0));
        assert_eq!(scale.position(32.0), Some(1.0));
        assert_eq!(scale.position(1.0 / 32.0), Some(-1.0));
        assert_eq!(color(f32::INFINITY), color(32.0));
        assert_eq!(color(0.0), color(1.0 / 32.0));
        assert_eq!(color(-5.0), color(0.0));
        assert_eq!(scale.color(f32::NAN), None);
        let [r, _, b] = color(8.0);
        assert!(r > b + 60, "coarse is orange");
        let [r, _, b] = color(0.125);
        assert!(b > r + 60, "fine is blue");
        let middle = color(1.0);
        assert!(middle.iter().all(|&v| v > 235), "one to one is pale: {middle:?}");
        for bad in [1.0, 0.0, -2.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(ErrorScale::new(bad), Err(Error::Scale { .. })), "{bad}");
        }
    }
}
