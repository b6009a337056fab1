//! The sRGB transfer function by table (IEC 61966-2-1): linear light 0..=1 to bytes.

use std::sync::LazyLock;

use crate::base::math;

const STEPS: usize = 16_384;

// 16k steps: the steepest part of the curve moves a fifth of a byte a step, so bytes are right but for ties.
static ENCODE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=STEPS)
        .map(|i| {
            let x = i as f32 / STEPS as f32;
            let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * math::pow(x, 1.0 / 2.4) - 0.055 };
            (y * 255.0 + 0.5) as u8
        })
        .collect()
});

static DECODE: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let y = i as f32 / 255.0;
        if y <= 0.040_45 { y / 12.92 } else { math::pow((y + 0.055) / 1.055, 2.4) }
    })
});

/// The byte of a linear value; values outside 0..=1 are clamped, NaN is 0.
pub(crate) fn encode(linear: f32) -> u8 {
    ENCODE[((linear * STEPS as f32 + 0.5).clamp(0.0, STEPS as f32)) as usize]
}

/// The linear value of a byte.
pub(super) fn decode(byte: u8) -> f32 {
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
