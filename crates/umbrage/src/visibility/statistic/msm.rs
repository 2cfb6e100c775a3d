use super::{Channels, Encoding, Storage, check_leak, without_leak};
use crate::error::Error;
use std::fmt;

/// Moment shadow maps with four moments, by Hamburger's bound (Peters and Klein 2015): the smallest
/// share of depths in front of the receiver that agrees with the means of z, z², z³ and z⁴. The
/// moments are stored in 16 bits after the paper's affine map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Msm {
    /// Visibilities up to this value, at least 0 and less than 1, count as shadow.
    pub leak: f32,
}

/// Weight with which the moments are blended towards [`BIAS_VECTOR`], so that rounding to 16 bits
/// leaves them moments of some distribution (§3.4 of the paper).
const BIAS: f32 = 6e-5;

/// All four moments of a distribution with half of the depths at 0 and half at 1.
const BIAS_VECTOR: f32 = 0.5;

/// Columns of the affine map from moments to stored values (Peters and Klein 2015, §3.3), which
/// range from 0 to 1 in each channel.
const STORED_FROM_MOMENTS: [[f32; 4]; 4] = [
    [-2.072_246_5, 32.237_038, -68.571_07, 39.370_327],
    [13.794_886, -59.468_4, 82.035_97, -35.364_902],
    [0.105_877_705, -1.907_746_6, 9.349_656, -6.654_349],
    [9.792_406, -33.765_21, 47.945_61, -23.972_805],
];
const OFFSET: f32 = 0.035_955_884;

/// The inverse map.
#[expect(clippy::excessive_precision, reason = "the paper's digits")]
const MOMENTS_FROM_STORED: [[f32; 4]; 4] = [
    [0.222_774_41, 0.077_197_286, 0.792_698_66, 0.031_941_755],
    [0.154_967_93, 0.139_462_94, 0.796_341_6, -0.172_282_32],
    [0.145_198_9, 0.212_020_22, 0.725_869_45, -0.275_801_48],
    [0.163_127_45, 0.259_143_23, 0.653_909_25, -0.337_613_17],
];

fn times(columns: &[[f32; 4]; 4], v: [f32; 4]) -> [f32; 4] {
    columns.map(|c| c[0] * v[0] + c[1] * v[1] + c[2] * v[2] + c[3] * v[3])
}

impl Encoding for Msm {
    fn channels(&self) -> usize {
        4
    }

    fn storage(&self) -> Storage {
        Storage::Unorm16
    }

    fn encode(&self, depth: f32, channels: &mut Channels) {
        let square = depth * depth;
        let mut stored =
            times(&STORED_FROM_MOMENTS, [depth, square, square * depth, square * square]);
        stored[0] += OFFSET;
        channels[..4].copy_from_slice(&stored);
    }

    fn visibility(&self, channels: &Channels, depth: f32) -> f32 {
        let [a, b, c, d] = [channels[0] - OFFSET, channels[1], channels[2], channels[3]];
        let moments = times(&MOMENTS_FROM_STORED, [a, b, c, d]);
        without_leak(1.0 - hamburger(moments, depth), self.leak)
    }

    fn check(&self) -> Result<(), Error> {
        check_leak(self.leak)
    }
}

/// The smallest share of depths less than `depth` that agrees with the moments (Peters and Klein
/// 2015, Algorithm 3), by a Cholesky decomposition of the Hankel matrix and the roots of a
/// quadratic.
fn hamburger(moments: [f32; 4], depth: f32) -> f32 {
    let b = moments.map(|m| m + (BIAS_VECTOR - m) * BIAS);
    let l32_d22 = b[2] - b[0] * b[1];
    let d22 = b[1] - b[0] * b[0];
    let variance_of_square = b[3] - b[1] * b[1];
    let d33_d22 = variance_of_square * d22 - l32_d22 * l32_d22;
    let l32 = l32_d22 / d22;
    // Solves the linear system of the Hankel matrix for (1, z, z²).
    let mut c = [1.0, depth - b[0], depth * depth - b[1]];
    c[2] -= l32 * c[1];
    c[1] /= d22;
    c[2] *= d22 / d33_d22;
    c[1] -= l32 * c[2];
    c[0] -= c[1] * b[0] + c[2] * b[1];
    // The other two depths of the three-point distribution that attains the bound.
    let p = c[1] / c[2];
    let q = c[0] / c[2];
    let r = (0.25 * p * p - q).max(0.0).sqrt();
    let [z1, z2] = [-0.5 * p - r, -0.5 * p + r];
    if z2 < depth {
        // Both other depths lie in front of the receiver: all mass but that at the receiver's
        // depth.
        1.0 - (z1 * z2 - b[0] * (z1 + z2) + b[1]) / ((depth - z1) * (depth - z2))
    } else if z1 < depth {
        // Only z1 lies in front of the receiver: the mass at z1.
        (depth * z2 - b[0] * (depth + z2) + b[1]) / ((z1 - depth) * (z1 - z2))
    } else {
        0.0
    }
}

impl fmt::Display for Msm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("msm")
    }
}
