//! The space that plants may fill: a cylinder for each plant, without what stands in it.

use glam::Vec3;

use super::obstacle::Obstacles;
use crate::base::Seed;

/// Cylinders, one for each plant, and obstacles; lengths in heights of the first plant.
#[derive(Clone, Debug)]
pub(super) struct Region {
    columns: Vec<Column>,
    obstacles: Obstacles,
}

/// An upright cylinder on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    /// Centre of its foot.
    pub(super) foot: Vec3,
    /// Radius.
    pub(super) radius: f32,
    /// Height.
    pub(super) height: f32,
}

impl Column {
    fn holds(&self, p: Vec3) -> bool {
        let (x, z) = (p.x - self.foot.x, p.z - self.foot.z);
        x * x + z * z <= self.radius * self.radius && (0.0..=self.height).contains(&p.y)
    }

    fn volume(&self) -> f32 {
        std::f32::consts::PI * self.radius * self.radius * self.height
    }
}

impl Region {
    /// Columns, of which there is at least one, and what stands in them.
    pub(super) fn new(columns: Vec<Column>, obstacles: Obstacles) -> Self {
        Self { columns, obstacles }
    }

    /// The region of one plant, `width` heights wide.
    #[cfg(test)]
    pub(super) fn cylinder(width: f32) -> Self {
        Self::new(vec![Column { foot: Vec3::ZERO, radius: width * 0.5, height: 1.0 }], Obstacles::default())
    }

    /// What stands in it.
    pub(super) fn obstacles(&self) -> &Obstacles {
        &self.obstacles
    }

    /// Where the plants stand.
    pub(super) fn roots(&self) -> Vec<Vec3> {
        self.columns.iter().map(|c| c.foot).collect()
    }

    /// Whether a plant may be here.
    pub(super) fn holds(&self, p: Vec3) -> bool {
        self.columns.iter().any(|c| c.holds(p)) && self.obstacles.free(p)
    }

    /// A box around all columns.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for c in &self.columns {
            let out = Vec3::new(c.radius, 0.0, c.radius);
            bounds = (bounds.0.min(c.foot - out), bounds.1.max(c.foot + out + Vec3::Y * c.height));
        }
        bounds
    }

    /// How many times larger than the first plant's column it is.
    pub(super) fn crowding(&self) -> f32 {
        (self.volume() / self.columns[0].volume()).max(1.0)
    }

    /// Volume of the columns; what overlaps counts once, by a sample. Obstacles are not taken out, so that one does not
    /// make the graph finer elsewhere.
    pub(super) fn volume(&self) -> f32 {
        let mut volume = 0.0;
        for (i, c) in self.columns.iter().enumerate() {
            let earlier = &self.columns[..i];
            let hits = (0..if i == 0 { 0 } else { 1024_u64 })
                .filter(|&k| {
                    let seed = Seed::new(1).at(k);
                    let [x, y, z] = [0, 1, 2].map(|axis| seed.at(axis).range(-1.0, 1.0));
                    let p = c.foot + Vec3::new(x * c.radius, (y + 1.0) * 0.5 * c.height, z * c.radius);
                    x * x + z * z <= 1.0 && earlier.iter().any(|e| e.holds(p))
                })
                .count();
            // The cylinder fills π/4 of the box that is sampled.
            volume += c.volume() * (1.0 - hits as f32 / (1024.0 * std::f32::consts::FRAC_PI_4)).max(0.0);
        }
        volume
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_columns_count_once() {
        let column = |x: f32| Column { foot: Vec3::X * x, radius: 0.5, height: 1.0 };
        let volume = |columns: &[Column]| Region::new(columns.to_vec(), Obstacles::default()).volume();
        let one = volume(&[column(0.0)]);
        assert!((one - std::f32::consts::FRAC_PI_4).abs() < 1e-6);
        assert!((volume(&[column(0.0), column(3.0)]) - 2.0 * one).abs() < 1e-6);
        assert!((volume(&[column(0.0), column(0.0)]) - one).abs() < 0.06 * one);
    }
}
