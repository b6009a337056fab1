//! The relief and tone of bark, place by place, one pattern a species group.
//!
//! All coordinates are shares of the tile (u around the trunk, v along it) and every field repeats after one tile.
//! Heights are shares of the pattern's own depth, tones multiply the colour. The patterns follow the forms that
//! foresters tell apart (Vaucher 2003, "Tree Bark: A Color Guide"): furrowed, papery, plated, smooth.

use glam::Vec3;

use super::noise::{Cell, Noise, mix, unit};
use crate::base::{Seed, math};
use crate::preset::plan::BarkPattern;

/// Bark at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// 0 in the deepest crack, about 1 on the ridges.
    pub(super) height: f32,
    /// Multiplies the colour, linear.
    pub(super) tone: Vec3,
    /// 0..=1.
    pub(super) rough: f32,
}

/// The fields of one tile of bark.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bark {
    pattern: BarkPattern,
    warp: Noise,
    warp_fine: Noise,
    cells: Noise,
    small: Noise,
    broad: Noise,
    grain: Noise,
    fine: Noise,
}

impl Bark {
    /// The fields of a pattern at a seed.
    pub(super) fn new(pattern: BarkPattern, seed: Seed) -> Self {
        // Columns and rows of: warp, fine warp, large cells, small cells, broad tone, grain, fine grain.
        let sizes: [(u32, u32); 7] = match pattern {
            BarkPattern::Furrowed => [(4, 3), (16, 9), (11, 3), (17, 15), (3, 3), (44, 8), (90, 50)],
            BarkPattern::Papery => [(3, 3), (9, 14), (6, 22), (3, 4), (3, 5), (4, 50), (60, 110)],
            BarkPattern::Plated => [(4, 3), (15, 9), (6, 3), (14, 10), (3, 3), (20, 30), (60, 60)],
            BarkPattern::Smooth => [(3, 3), (9, 9), (11, 16), (2, 3), (3, 4), (8, 34), (90, 110)],
        };
        let field = |name: &str, i: usize| Noise::new(seed.child(name), sizes[i].0, sizes[i].1);
        Self {
            pattern,
            warp: field("warp", 0),
            warp_fine: field("fine warp", 1),
            cells: field("cells", 2),
            small: field("small cells", 3),
            broad: field("broad", 4),
            grain: field("grain", 5),
            fine: field("fine", 6),
        }
    }

    /// How deep the pattern's relief is, in shares of the tile's edge.
    pub(super) fn depth(&self) -> f32 {
        match self.pattern {
            BarkPattern::Furrowed => 0.030,
            BarkPattern::Papery => 0.006,
            BarkPattern::Plated => 0.022,
            BarkPattern::Smooth => 0.004,
        }
    }

    /// The bark at a place.
    pub(super) fn at(&self, u: f32, v: f32) -> Spot {
        match self.pattern {
            BarkPattern::Furrowed => self.furrowed(u, v),
            BarkPattern::Papery => self.papery(u, v),
            BarkPattern::Plated => self.plated(u, v),
            BarkPattern::Smooth => self.smooth(u, v),
        }
    }

    /// A place moved by noise: `coarse` and `fine` shares of the tile.
    fn warped(&self, u: f32, v: f32, coarse: f32, fine: f32) -> (f32, f32) {
        let du = coarse * self.warp.octaves(u, v, 2) + fine * self.warp_fine.octaves(u, v, 2);
        let dv = coarse * self.warp.shifted(1).at(u, v) + fine * self.warp_fine.shifted(1).at(u, v);
        (u + du, v + dv)
    }

    fn furrowed(&self, u: f32, v: f32) -> Spot {
        let (x, y) = self.warped(u, v, 0.05, 0.011);
        // Long lenses side by side; their borders split and join: the furrows.
        let lens = self.cells.cells(x, y, 0.95);
        let ridge = math::smoothstep(0.0, 0.34 + 0.14 * self.broad.at(u, v), lens.border);
        // Shallower cracks across and along cut the ridges into blocks.
        let block = self.small.cells(x + 0.02 * self.grain.at(u, v), y, 0.9);
        let crack = math::smoothstep(0.0, 0.16, block.border);
        let grain = self.grain.octaves(x, y, 3);
        let fine = self.fine.octaves(u, v, 2);
        let crown = 0.62 + 0.38 * ridge;
        let height = ridge * crown * (0.78 + 0.22 * crack)
            + 0.15 * grain * (0.3 + ridge)
            + 0.06 * fine
            + 0.08 * (unit(block.id, 1) - 0.5) * ridge;
        let deep = mix(0.24, 1.0, math::smoothstep(-0.05, 0.7, height));
        let tone = deep
            * (1.0 + 0.34 * grain + 0.26 * fine + 0.26 * (unit(block.id, 2) - 0.5) + 0.24 * (unit(lens.id, 3) - 0.5))
            * (0.8 + 0.2 * crack);
        // Furrows are redder (fresh cork), ridge tops greyer and here and there green-grey with algae.
        let moss = math::smoothstep(0.15, 0.75, self.broad.shifted(5).octaves(u, v, 4)) * ridge;
        let hue = Vec3::new(1.16, 0.98, 0.80).lerp(Vec3::new(1.0, 1.0, 1.0), ridge);
        let hue = hue.lerp(Vec3::new(0.90, 1.02, 0.82), 0.6 * moss);
        Spot { height, tone: hue * tone, rough: 0.93 - 0.06 * ridge + 0.03 * fine }
    }

    fn plated(&self, u: f32, v: f32) -> Spot {
        let (x, y) = self.warped(u, v, 0.05, 0.02);
        let plate = self.cells.cells(x, y, 0.9);
        let (sx, sy) = (x + 0.012 * self.warp_fine.shifted(8).octaves(u, v, 2), y);
        let split = self.small.cells(sx, sy, 1.0);
        let gap = 0.13 + 0.12 * self.broad.shifted(9).octaves(u, v, 2);
        let top = math::smoothstep(0.0, gap.max(0.04) + 0.05, plate.border);
        // Plates break up into scales; each scale is a step of its own, thinner towards its edge.
        let scale = math::smoothstep(0.0, 0.07, split.border);
        let step = unit(split.id, 3);
        let flake = self.fine.octaves(x, y, 3);
        let layers = 3.0 * (0.5 + 0.5 * self.warp_fine.shifted(7).octaves(x, y, 3)) + 2.0 * step;
        let terrace = (layers.floor() + math::smoothstep(0.75, 1.0, layers - layers.floor())) / 5.0;
        let height = top * (0.36 + 0.46 * terrace + 0.20 * scale + 0.10 * unit(plate.id, 4)) + 0.09 * flake;
        let deep = mix(0.16, 1.0, math::smoothstep(0.0, 0.42, height));
        let tone = deep
            * (0.74 + 0.28 * scale)
            * (1.0 + 0.34 * flake + 0.30 * (step - 0.5) + 0.16 * (unit(plate.id, 5) - 0.5));
        // Lower layers are fresh and orange, outer ones weathered and grey.
        let weather = (0.55 * terrace + 0.45 * unit(split.id, 6) + 0.25 * self.broad.octaves(u, v, 3)).clamp(0.0, 1.0);
        let hue = Vec3::new(1.16, 0.94, 0.76).lerp(Vec3::new(0.92, 1.05, 1.28), math::smoothstep(0.15, 0.8, weather));
        Spot { height, tone: hue * tone, rough: 0.88 + 0.05 * flake - 0.05 * (1.0 - weather) }
    }

    fn papery(&self, u: f32, v: f32) -> Spot {
        let (x, y) = self.warped(u, v, 0.02, 0.004);
        let streak = self.grain.octaves(x, y, 3);
        let fine = self.fine.octaves(u, v, 2);
        let broad = self.broad.octaves(u, v, 4);
        // Lenticels: short dark dashes around the trunk, one in some of the cells.
        let ragged = 0.5 * streak + 0.35 * fine;
        let mut dash = self.dash(self.cells.cells(x, y, 0.9), 0.4, 0.42, 0.17, ragged);
        dash = dash.max(0.7 * self.dash(self.cells.shifted(3).cells(x, y, 0.9), 0.4, 0.14, 0.12, ragged));
        // Scars: dark, rough lozenges where branches were shed.
        let scar_cell = self.small.cells(x, y + 0.012 * self.warp_fine.octaves(u, v, 2), 0.5);
        let (scar, rough_scar) = self.scar(scar_cell, u, v);
        // Curls of peeling layers: thin raised edges along the streaks.
        let peel = self.warp_fine.shifted(4).octaves(u, v, 3);
        let edge = math::smoothstep(0.30, 0.33, peel);
        let height = 0.55 + 0.10 * streak + 0.05 * fine + 0.12 * edge + 0.20 * dash + scar * (0.5 * rough_scar - 0.15);
        let pale = 1.0 + 0.11 * streak + 0.05 * fine + 0.08 * broad - 0.06 * edge;
        let warm = math::smoothstep(0.0, 0.8, broad + 0.3 * streak);
        let mut tone = Vec3::new(1.0, 1.0, 1.0).lerp(Vec3::new(1.0, 0.90, 0.78), 0.55 * warm.max(0.8 * edge)) * pale;
        tone = tone.lerp(Vec3::new(0.16, 0.135, 0.115), 0.85 * dash);
        let dark = Vec3::new(0.075, 0.068, 0.062) * (1.0 + 0.7 * rough_scar);
        tone = tone.lerp(dark, scar);
        Spot { height, tone, rough: mix(0.56 + 0.05 * fine, 0.92, scar.max(dash * 0.8)) }
    }

    /// How much of a dark scar a place in a cell shows, and the scar's own relief.
    fn scar(&self, cell: Cell, u: f32, v: f32) -> (f32, f32) {
        let out = cell.offset[0].abs();
        let lozenge = out * 0.8 + (cell.offset[1] - 0.16 * out).abs() * 1.7;
        // Most places are far from any scar: its noise is spared there.
        if unit(cell.id, 10) > 0.7 || lozenge > 0.32 {
            return (0.0, 0.0);
        }
        let share = unit(cell.id, 9);
        let size = 0.06 + 0.2 * share * share;
        let ragged = 0.085 * self.warp_fine.shifted(2).octaves(u, v, 4) + 0.02 * self.fine.shifted(2).at(u, v);
        let scar = 1.0 - math::smoothstep(size * 0.72, size, lozenge + ragged);
        (scar, self.fine.shifted(1).octaves(u, v, 3))
    }

    /// A dash around the trunk within a cell: 1 on it. `share` of the cells have one, of up to this half length and
    /// half thickness in cells; `ragged` frays its edge.
    fn dash(&self, cell: Cell, share: f32, length: f32, thick: f32, ragged: f32) -> f32 {
        if unit(cell.id, 1) > share {
            return 0.0;
        }
        let length = length * (0.35 + 0.65 * unit(cell.id, 2));
        let thick = thick * (0.5 + 0.5 * unit(cell.id, 3));
        let along = (cell.offset[0] / length).abs();
        let across = (cell.offset[1] / thick).abs();
        let round = (along * along + across * across).sqrt() + ragged;
        1.0 - math::smoothstep(0.5, 1.0, round)
    }

    fn smooth(&self, u: f32, v: f32) -> Spot {
        let (x, y) = self.warped(u, v, 0.03, 0.006);
        let wrinkle = self.grain.octaves(x, y, 3);
        let fine = self.fine.octaves(u, v, 2);
        let broad = self.broad.octaves(u, v, 4);
        let blotch = math::smoothstep(0.05, 0.4, self.broad.shifted(3).octaves(u, v, 5));
        let dash = self.dash(self.cells.cells(x, y, 0.9), 0.35, 0.22, 0.10, 0.3 * fine);
        // Eyes of shed twigs: low rings, wider than high.
        let eye = self.small.cells(x, y, 0.6);
        let wide = 0.10 + 0.07 * unit(eye.id, 5);
        let (ex, ey) = (eye.offset[0] / wide, eye.offset[1] / (0.55 * wide));
        let ring = (ex * ex + ey * ey).sqrt();
        let has = if unit(eye.id, 4) < 0.5 { 1.0 } else { 0.0 };
        let lid = has * (1.0 - (2.2 * (ring - 0.8)).abs()).max(0.0);
        let height = 0.5 + 0.22 * wrinkle + 0.10 * fine + 0.12 * broad + 0.22 * dash + 0.5 * lid;
        let tone = 1.0 + 0.13 * wrinkle + 0.08 * fine + 0.18 * broad - 0.18 * dash - 0.13 * lid;
        let hue = Vec3::ONE.lerp(Vec3::new(0.86, 0.95, 0.80), 0.55 * math::smoothstep(0.0, 0.7, -broad));
        let hue = hue.lerp(Vec3::new(1.20, 1.21, 1.17), 0.55 * blotch);
        Spot { height, tone: hue * tone, rough: 0.72 + 0.08 * fine + 0.05 * blotch }
    }
}
