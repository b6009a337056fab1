//! Transcendental functions that give the same bits on every platform.
//!
//! The standard library forwards these to the platform's C library, whose last bits differ from one to the next; one
//! such bit is enough to move a least-cost path. All are computed by `libm` (a port of MUSL's), and `clippy.toml` bans
//! the standard ones. Square roots are exact under IEEE 754 and need no replacement.

/// Sine of an angle in radians.
#[must_use]
pub fn sin(x: f32) -> f32 {
    libm::sinf(x)
}

/// Cosine of an angle in radians.
#[must_use]
pub fn cos(x: f32) -> f32 {
    libm::cosf(x)
}

/// Sine and cosine of an angle in radians.
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}

/// Tangent of an angle in radians.
#[must_use]
pub fn tan(x: f32) -> f32 {
    libm::tanf(x)
}

/// Arc cosine in radians, 0..=π; the argument is clamped to -1..=1, so that rounding never gives NaN.
#[must_use]
pub fn acos(x: f32) -> f32 {
    libm::acosf(x.clamp(-1.0, 1.0))
}

/// Angle of the vector (x, y) in radians, -π..=π.
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// As [`atan2`].
#[must_use]
pub fn atan2_64(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// `base` raised to `exponent`.
#[must_use]
pub fn pow(base: f32, exponent: f32) -> f32 {
    libm::powf(base, exponent)
}

/// `base` raised to `exponent`, in double precision.
#[must_use]
pub fn pow64(base: f64, exponent: f64) -> f64 {
    libm::pow(base, exponent)
}

/// e raised to `x`.
#[must_use]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// Sine of an angle in radians, in double precision.
#[must_use]
pub fn sin64(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of an angle in radians, in double precision.
#[must_use]
pub fn cos64(x: f64) -> f64 {
    libm::cos(x)
}

/// Arc sine in radians, in double precision; the argument is clamped to -1..=1.
#[must_use]
pub fn asin64(x: f64) -> f64 {
    libm::asin(x.clamp(-1.0, 1.0))
}

/// Arc cosine in radians, in double precision; the argument is clamped to -1..=1.
#[must_use]
pub fn acos64(x: f64) -> f64 {
    libm::acos(x.clamp(-1.0, 1.0))
}

/// Natural logarithm.
#[must_use]
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// Natural logarithm, in double precision.
#[must_use]
pub fn ln64(x: f64) -> f64 {
    libm::log(x)
}

/// Cube root.
#[must_use]
pub fn cbrt(x: f32) -> f32 {
    libm::cbrtf(x)
}

/// Angle between two vectors in radians, 0..=π; 0 where one of them is zero.
#[must_use]
pub fn angle(a: glam::Vec3, b: glam::Vec3) -> f32 {
    // atan2 of cross and dot keeps its precision near 0 and π, where acos of the dot product loses half the digits.
    atan2(a.cross(b).length(), a.dot(b))
}

/// The linear value of an sRGB-encoded one, both 0..=1 (IEC 61966-2-1).
#[must_use]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding of a linear value, both 0..=1 (IEC 61966-2-1).
#[must_use]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * pow(linear, 1.0 / 2.4) - 0.055 }
}

/// Cubic ease from 0 at `edge0` to 1 at `edge1`.
#[must_use]
pub fn smoothstep(edge0: f32, edge1: f32, x: f32) -> f32 {
    let t = ((x - edge0) / (edge1 - edge0)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
