//! Addressed randomness: a value is looked up by where it is used, never drawn from a shared stream.
//!
//! `seed.child("foliage").at(i)` is the same number whatever else was drawn before, on whatever thread. So adding a leaf
//! moves no branch and adding a variant changes no other. The mixer is SplitMix64's finalizer (Steele, Lea and Flood
//! 2014), names are hashed by 64-bit FNV-1a.

use glam::Vec3;

use super::math;

/// The address of a random value: 64 bits, refined by [`child`](Seed::child) and [`at`](Seed::at).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Seed(u64);

impl Seed {
    /// The root address of a preset's `seed`.
    #[must_use]
    pub const fn new(value: u64) -> Self {
        Self(mix(value ^ 0x7472_6565_7772_6967))
    }

    /// The address named `name` below this one.
    #[must_use]
    pub const fn child(self, name: &str) -> Self {
        let bytes = name.as_bytes();
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut i = 0;
        while i < bytes.len() {
            hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
            i += 1;
        }
        Self(mix(self.0 ^ mix(hash)))
    }

    /// The `index`-th address below this one.
    #[must_use]
    pub const fn at(self, index: u64) -> Self {
        Self(mix(self.0.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))))
    }

    /// The 64 bits at this address.
    #[must_use]
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// A number in 0.0..1.0 with 24 bits.
    #[must_use]
    pub fn unit(self) -> f32 {
        (self.0 >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// A number in `low..high`.
    #[must_use]
    pub fn range(self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// An index in `0..count`; 0 when `count` is 0.
    #[must_use]
    pub fn index(self, count: usize) -> usize {
        ((u128::from(self.0) * count as u128) >> 64) as usize
    }

    /// A unit vector, uniform on the sphere.
    #[must_use]
    pub fn direction(self) -> Vec3 {
        let y = self.at(0).range(-1.0, 1.0);
        let (sin, cos) = math::sin_cos(self.at(1).unit() * std::f32::consts::TAU);
        let r = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(r * cos, y, r * sin)
    }

    /// The addresses `at(0)`, `at(1)`, … one after the other, for loops whose draws have no index of their own.
    #[must_use]
    pub const fn draws(self) -> Draws {
        Draws { seed: self, next: 0 }
    }
}

/// Successive addresses below one [`Seed`].
#[derive(Clone, Debug)]
pub struct Draws {
    seed: Seed,
    next: u64,
}

impl Draws {
    /// The next address.
    pub fn draw(&mut self) -> Seed {
        let seed = self.seed.at(self.next);
        self.next += 1;
        seed
    }
}

const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_golden() {
        assert_eq!(Seed::new(41).child("foliage").at(3).bits(), 10_930_363_575_810_428_053);
    }

    #[test]
    fn neighbours_are_uncorrelated_and_uniform() {
        let seed = Seed::new(7);
        let n = 20_000;
        let values: Vec<f64> = (0..n).map(|i| f64::from(seed.at(i).unit())).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let lag = values.windows(2).map(|w| (w[0] - 0.5) * (w[1] - 0.5)).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!(lag.abs() < 0.002, "{lag}");
    }

    #[test]
    fn directions_cover_the_sphere_evenly() {
        let seed = Seed::new(3);
        let sum = (0..10_000).map(|i| seed.at(i).direction()).sum::<Vec3>() / 10_000.0;
        assert!(sum.length() < 0.03, "{sum}");
    }
}
