use super::{Channels, Encoding, Storage, check_leak, without_leak};
use crate::error::Error;
use std::fmt;

/// Moment shadow maps with Hamburger's four moments (Peters and Klein 2015): the least share of depths before the receiver that z, z², z³ and z⁴ allow.
/// Stored in 16 bits, after the affine map that they give for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Msm {
    /// What visibility is taken for shadow, 0 to less than 1.
    pub leak: f32,
}

/// How far moments are drawn towards those of depths that fill 0 ..= 1, against what 16 bits round (§3.4 of the paper).
const BIAS: f32 = 6e-5;

/// What moments are drawn towards: half of all depths at 0, half at 1.
const BIAS_VECTOR: f32 = 0.5;

/// Columns of the map from moments to what is stored (Peters and Klein 2015, §3.3): its range is 0 to 1 in each number.
const STORED_FROM_MOMENTS: [[f32; 4]; 4] = [
    [-2.072_246_5, 32.237_038, -68.571_07, 39.370_327],
    [13.794_886, -59.468_4, 82.035_97, -35.364_902],
    [0.105_877_705, -1.907_746_6, 9.349_656, -6.654_349],
    [9.792_406, -33.765_21, 47.945_61, -23.972_805],
];
const OFFSET: f32 = 0.035_955_884;

/// And back.
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

/// The least share of depths less than `depth` that these moments allow (Peters and Klein 2015, Algorithm 3), by the Cholesky decomposition of the
/// Hankel matrix and the roots of a quadratic.
fn hamburger(moments: [f32; 4], depth: f32) -> f32 {
    let b = moments.map(|m| m + (BIAS_VECTOR - m) * BIAS);
    let l32_d22 = b[2] - b[0] * b[1];
    let d22 = b[1] - b[0] * b[0];
    let variance_of_square = b[3] - b[1] * b[1];
    let d33_d22 = variance_of_square * d22 - l32_d22 * l32_d22;
    let l32 = l32_d22 / d22;
    // Solves for (1, z, z²).
    let mut c = [1.0, depth - b[0], depth * depth - b[1]];
    c[2] -= l32 * c[1];
    c[1] /= d22;
    c[2] *= d22 / d33_d22;
    c[1] -= l32 * c[2];
    c[0] -= c[1] * b[0] + c[2] * b[1];
    // Where else the measure has mass.
    let p = c[1] / c[2];
    let q = c[0] / c[2];
    let r = (0.25 * p * p - q).max(0.0).sqrt();
    let [z1, z2] = [-0.5 * p - r, -0.5 * p + r];
    if z2 < depth {
        // All but what lies at the receiver itself.
        1.0 - (z1 * z2 - b[0] * (z1 + z2) + b[1]) / ((depth - z1) * (depth - z2))
    } else if z1 < depth {
        // What lies at z1.
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
