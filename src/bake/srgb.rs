//! The sRGB transfer function by table (IEC 61966-2-1): linear light 0..=1 to bytes.

use std::sync::LazyLock;

use crate::base::math;

const STEPS: usize = 16_384;

// 16k steps: the steepest part of the curve moves a fifth of a byte a step, so bytes are right but for ties.
static ENCODE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=STEPS).map(|i| (math::linear_to_srgb(i as f32 / STEPS as f32) * 255.0 + 0.5) as u8).collect()
});

static DECODE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| math::srgb_to_linear(i as f32 / 255.0)));

/// The byte of a linear value; values outside 0..=1 are clamped, NaN is 0.
pub(crate) fn encode(linear: f32) -> u8 {
    ENCODE[((linear * STEPS as f32 + 0.5).clamp(0.0, STEPS as f32)) as usize]
}

/// The linear value of a byte.
pub(crate) fn decode(byte: u8) -> f32 {
    DECODE[usize::from(byte)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_round_trip() {
        for byte in 0..=255 {
            assert_eq!(encode(decode(byte)), byte);
        }
        assert_eq!((encode(-1.0), encode(7.0), encode(f32::NAN)), (0, 255, 0));
    }
}
