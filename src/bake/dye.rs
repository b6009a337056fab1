//! Colours that hang on one colour: each is a linear function of it and something of its own.
//!
//! A leaf's veins, margins, shadows and neighbours are all its tint made lighter, warmer or greyer, over wood that keeps
//! its own colour. Held so, a picture is drawn once and dyed as often as its tint changes.

use glam::Vec3;

/// A colour, linear, of a tint that is not known yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dye {
    /// What a red, a green and a blue of one in the tint give, and what is there without any.
    pub(super) columns: [Vec3; 4],
}

impl Dye {
    /// The tint itself.
    pub(super) const TINT: Self = Self { columns: [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ZERO] };

    /// A colour that no tint changes.
    pub(super) const fn fast(color: Vec3) -> Self {
        Self { columns: [Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, color] }
    }

    /// The colour after a linear change.
    pub(super) fn map(self, change: impl Fn(Vec3) -> Vec3) -> Self {
        Self { columns: self.columns.map(change) }
    }

    /// With something added that no tint changes.
    pub(super) fn plus(mut self, color: Vec3) -> Self {
        self.columns[3] += color;
        self
    }

    /// Adds another one's share.
    pub(super) fn add(&mut self, other: Self, share: f32) {
        for (sum, column) in self.columns.iter_mut().zip(other.columns) {
            *sum += column * share;
        }
    }
}

/// A dye in few bytes: its columns, red, green and blue, of [`ONE`].
pub(super) type Packed = [u16; 12];

/// What a share of one is packed as: 8-bit sRGB is coarser than that, and nothing is eight times as light as its tint.
const ONE: f32 = 8192.0;

/// A dye's twelve numbers, packed.
pub(super) fn packed(numbers: [f32; 12]) -> Packed {
    numbers.map(|v| (v * ONE + 0.5).clamp(0.0, 65535.0) as u16)
}

/// The linear colour of a packed dye with its tint.
pub(super) fn dyed(dye: &Packed, tint: Vec3) -> Vec3 {
    let column = |i: usize| Vec3::new(f32::from(dye[i]), f32::from(dye[i + 1]), f32::from(dye[i + 2]));
    (column(0) * tint.x + column(3) * tint.y + column(6) * tint.z + column(9)) * (1.0 / ONE)
}
