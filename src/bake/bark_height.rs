//! The relief and tone of bark, place by place, one pattern a species group.
//!
//! All coordinates are shares of the tile (u around the trunk, v along it) and every field repeats after one tile.
//! Heights are shares of the pattern's own depth, tones multiply the colour. The patterns follow the forms that
//! foresters tell apart (Vaucher 2003, "Tree Bark: A Color Guide"): furrowed, papery, plated, smooth, fibrous, ringed.

use glam::Vec3;

use super::noise::{Noise, mix, unit};
use super::noise_table::{Cell, Cells, Octaves};
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

/// A place in a row, and where noise moves it.
#[derive(Clone, Copy, Debug)]
struct Place {
    i: usize,
    u: f32,
    v: f32,
    x: f32,
    y: f32,
}

/// The fields of one tile of bark.
#[derive(Clone, Debug)]
pub(super) struct Bark {
    pattern: BarkPattern,
    /// Displacement along u and v by the coarse field, and by the fine one.
    warp: [Octaves; 2],
    warp_fine: [Octaves; 2],
    cells: Cells,
    /// More of the large cells, elsewhere.
    more_cells: Cells,
    small: Cells,
    broad: Octaves,
    grain: Octaves,
    fine: Octaves,
    /// What else a pattern needs, in the order in which it names them.
    others: [Octaves; 4],
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
            BarkPattern::Fibrous => [(5, 2), (18, 5), (22, 2), (40, 5), (3, 3), (120, 7), (200, 36)],
            BarkPattern::Ringed => [(4, 4), (12, 12), (9, 24), (5, 18), (3, 4), (16, 30), (70, 120)],
        };
        let field = |name: &str, i: usize| Noise::new(seed.child(name), sizes[i].0, sizes[i].1);
        let [warp, curl] = [field("warp", 0), field("fine warp", 1)];
        let [cells, small] = [field("cells", 2), field("small cells", 3)];
        let [broad, grain, fine] = [field("broad", 4), field("grain", 5), field("fine", 6)];
        // Jitter of the cells and of the small ones, octaves of broad and of fine; 1 is the bare field.
        let (jitter, jitter_small, broad_octaves, fine_octaves) = match pattern {
            BarkPattern::Furrowed => (0.95, 0.9, 1, 2),
            BarkPattern::Papery => (0.9, 0.5, 4, 2),
            BarkPattern::Plated => (0.9, 1.0, 3, 3),
            BarkPattern::Smooth => (0.9, 0.6, 4, 2),
            BarkPattern::Fibrous => (0.95, 0.9, 2, 2),
            BarkPattern::Ringed => (0.8, 0.7, 3, 2),
        };
        let others = match pattern {
            BarkPattern::Furrowed => [(broad.shifted(5), 4), (grain, 1), (fine, 0), (fine, 0)],
            BarkPattern::Papery => {
                [(curl.shifted(4), 3), (curl.shifted(2), 4), (fine.shifted(2), 1), (fine.shifted(1), 3)]
            }
            BarkPattern::Plated => [(curl.shifted(8), 2), (broad.shifted(9), 2), (curl.shifted(7), 3), (fine, 0)],
            BarkPattern::Smooth | BarkPattern::Fibrous => [(broad.shifted(3), 5), (fine, 0), (fine, 0), (fine, 0)],
            BarkPattern::Ringed => [(curl.shifted(4), 3), (broad.shifted(2), 2), (fine, 0), (fine, 0)],
        };
        let sum = |field, octaves| if octaves == 1 { Octaves::single(field) } else { Octaves::new(field, octaves) };
        Self {
            pattern,
            warp: [sum(warp, 2), sum(warp.shifted(1), 1)],
            warp_fine: [sum(curl, 2), sum(curl.shifted(1), 1)],
            cells: Cells::new(cells, jitter),
            more_cells: Cells::new(cells.shifted(3), jitter),
            small: Cells::new(small, jitter_small),
            broad: sum(broad, broad_octaves),
            grain: sum(grain, 3),
            fine: sum(fine, fine_octaves),
            others: others.map(|(field, octaves)| sum(field, octaves)),
        }
    }

    /// How deep the pattern's relief is, in shares of the tile's edge.
    pub(super) fn depth(&self) -> f32 {
        match self.pattern {
            BarkPattern::Furrowed => 0.030,
            BarkPattern::Papery => 0.006,
            BarkPattern::Plated => 0.022,
            BarkPattern::Smooth => 0.004,
            BarkPattern::Fibrous => 0.018,
            BarkPattern::Ringed => 0.010,
        }
    }

    /// The bark at the middles of `size` pixels in a row.
    pub(super) fn row(&self, v: f32, size: usize) -> Vec<Spot> {
        match self.pattern {
            BarkPattern::Furrowed => self.furrowed(v, size),
            BarkPattern::Papery => self.papery(v, size),
            BarkPattern::Plated => self.plated(v, size),
            BarkPattern::Smooth => self.smooth(v, size),
            BarkPattern::Fibrous => self.fibrous(v, size),
            BarkPattern::Ringed => self.ringed(v, size),
        }
    }

    /// The places of a row (number, u, v) with u and v moved by noise: `coarse` and `fine` shares of the tile.
    fn warped(&self, v: f32, size: usize, coarse: f32, fine: f32) -> impl Iterator<Item = Place> {
        let [du, dv] = [0, 1].map(|k| {
            let (a, b) = (self.warp[k].row(v, size), self.warp_fine[k].row(v, size));
            a.into_iter().zip(b).map(move |(a, b)| coarse * a + fine * b)
        });
        du.zip(dv).enumerate().map(move |(i, (du, dv))| {
            let u = (i as f32 + 0.5) / size as f32;
            Place { i, u, v, x: u + du, y: v + dv }
        })
    }

    fn furrowed(&self, v: f32, size: usize) -> Vec<Spot> {
        let [moss_row, grain_row] = [0, 1].map(|k| self.others[k].row(v, size));
        let (broad_row, fine_row) = (self.broad.row(v, size), self.fine.row(v, size));
        let spot = |Place { i, x, y, .. }: Place| {
            // Long lenses side by side; their borders split and join: the furrows.
            let (lens, lens_border) = self.cells.bordered(x, y);
            let ridge = math::smoothstep(0.0, 0.34 + 0.14 * broad_row[i], lens_border);
            // Shallower cracks across and along cut the ridges into blocks.
            let (block, block_border) = self.small.bordered(x + 0.02 * grain_row[i], y);
            let crack = math::smoothstep(0.0, 0.16, block_border);
            let grain = self.grain.at(x, y);
            let fine = fine_row[i];
            let crown = 0.62 + 0.38 * ridge;
            let height = ridge * crown * (0.78 + 0.22 * crack)
                + 0.15 * grain * (0.3 + ridge)
                + 0.06 * fine
                + 0.08 * (unit(block.id, 1) - 0.5) * ridge;
            let deep = mix(0.24, 1.0, math::smoothstep(-0.05, 0.7, height));
            let tone = deep
                * (1.0
                    + 0.34 * grain
                    + 0.26 * fine
                    + 0.26 * (unit(block.id, 2) - 0.5)
                    + 0.24 * (unit(lens.id, 3) - 0.5))
                * (0.8 + 0.2 * crack);
            // Furrows are redder (fresh cork), ridge tops greyer and here and there green-grey with algae.
            let moss = math::smoothstep(0.15, 0.75, moss_row[i]) * ridge;
            let hue = Vec3::new(1.16, 0.98, 0.80).lerp(Vec3::new(1.0, 1.0, 1.0), ridge);
            let hue = hue.lerp(Vec3::new(0.90, 1.02, 0.82), 0.6 * moss);
            Spot { height, tone: hue * tone, rough: 0.93 - 0.06 * ridge + 0.03 * fine }
        };
        self.warped(v, size, 0.05, 0.011).map(spot).collect()
    }

    /// Strips of fibres, some of them loose, as on cedars and redwoods.
    fn fibrous(&self, v: f32, size: usize) -> Vec<Spot> {
        let (broad_row, fine_row, grey_row) =
            (self.broad.row(v, size), self.fine.row(v, size), self.others[0].row(v, size));
        let spot = |Place { i, x, y, .. }: Place| {
            let (strip, border) = self.cells.bordered(x, y);
            let gap = math::smoothstep(0.0, 0.2 + 0.08 * broad_row[i], border);
            // Each strip is torn into narrower ones.
            let (thread, thread_border) = self.small.bordered(x, y);
            let torn = math::smoothstep(0.0, 0.14, thread_border);
            let fibre = self.grain.at(x, y);
            let fine = fine_row[i];
            let lift = unit(strip.id, 1);
            let height = gap * (0.5 + 0.25 * lift + 0.18 * torn + 0.10 * (unit(thread.id, 2) - 0.5))
                + 0.22 * fibre * (0.4 + 0.6 * gap)
                + 0.06 * fine;
            let deep = mix(0.22, 1.0, math::smoothstep(0.0, 0.62, height));
            let tone = deep * (1.0 + 0.42 * fibre + 0.2 * fine + 0.2 * (lift - 0.5)) * (0.84 + 0.16 * torn);
            // Fresh fibres are red, old ones weather to grey.
            let grey = math::smoothstep(-0.2, 0.6, grey_row[i] + 0.4 * (unit(thread.id, 3) - 0.5)) * gap;
            let hue = Vec3::new(1.15, 0.95, 0.80).lerp(Vec3::new(0.95, 1.02, 1.06), 0.8 * grey);
            Spot { height, tone: hue * tone, rough: 0.92 + 0.04 * fine }
        };
        self.warped(v, size, 0.035, 0.01).map(spot).collect()
    }

    /// Rings around the trunk, each a step, with short dashes between: palms and cherries.
    fn ringed(&self, v: f32, size: usize) -> Vec<Spot> {
        const RINGS: f32 = 12.0;
        let (broad_row, fine_row, wave_row) =
            (self.broad.row(v, size), self.fine.row(v, size), self.others[0].row(v, size));
        let spot = |Place { i, x, y, .. }: Place| {
            // The tile's edge lies within a ring, not on a lip.
            let at = (y + 0.012 * wave_row[i]) * RINGS + 0.4;
            let ring = at.floor();
            let along = at - ring;
            // A scar's lower lip is sharp, its upper edge runs out.
            let lip = math::smoothstep(0.0, 0.06, along) * (1.0 - math::smoothstep(0.1, 0.85, along));
            let line = 1.0 - math::smoothstep(0.0, 0.07, 0.5 - (along - 0.5).abs());
            let fine = fine_row[i];
            let grain = self.grain.at(x, y);
            let dash = self.dash(self.cells.nearest(x, y), 0.5, 0.4, 0.2, 0.4 * fine + 0.2 * grain);
            let broad = broad_row[i];
            let height = 0.4 + 0.4 * lip - 0.25 * line + 0.12 * grain + 0.06 * fine + 0.15 * dash;
            let tone = (1.0 + 0.16 * grain + 0.12 * fine + 0.16 * broad) * (1.0 - 0.45 * line) * (0.9 + 0.2 * lip);
            let hue = Vec3::ONE.lerp(Vec3::new(0.62, 0.58, 0.54), 0.6 * dash);
            let hue = hue.lerp(Vec3::new(0.90, 1.0, 0.86), 0.4 * math::smoothstep(0.0, 0.7, -broad));
            Spot { height, tone: hue * tone, rough: 0.78 + 0.08 * fine + 0.08 * dash }
        };
        self.warped(v, size, 0.02, 0.008).map(spot).collect()
    }

    fn plated(&self, v: f32, size: usize) -> Vec<Spot> {
        let [split_row, gap_row] = [0, 1].map(|k| self.others[k].row(v, size));
        let broad_row = self.broad.row(v, size);
        let spot = |Place { i, x, y, .. }: Place| {
            let (plate, plate_border) = self.cells.bordered(x, y);
            let (sx, sy) = (x + 0.012 * split_row[i], y);
            let (split, split_border) = self.small.bordered(sx, sy);
            let gap = 0.13 + 0.12 * gap_row[i];
            let top = math::smoothstep(0.0, gap.max(0.04) + 0.05, plate_border);
            // Plates break up into scales; each scale is a step of its own, thinner towards its edge.
            let scale = math::smoothstep(0.0, 0.07, split_border);
            let step = unit(split.id, 3);
            let flake = self.fine.at(x, y);
            let layers = 3.0 * (0.5 + 0.5 * self.others[2].at(x, y)) + 2.0 * step;
            let terrace = (layers.floor() + math::smoothstep(0.75, 1.0, layers - layers.floor())) / 5.0;
            let height = top * (0.36 + 0.46 * terrace + 0.20 * scale + 0.10 * unit(plate.id, 4)) + 0.09 * flake;
            let deep = mix(0.16, 1.0, math::smoothstep(0.0, 0.42, height));
            let tone = deep
                * (0.74 + 0.28 * scale)
                * (1.0 + 0.34 * flake + 0.30 * (step - 0.5) + 0.16 * (unit(plate.id, 5) - 0.5));
            // Lower layers are fresh and orange, outer ones weathered and grey.
            let weather = (0.55 * terrace + 0.45 * unit(split.id, 6) + 0.25 * broad_row[i]).clamp(0.0, 1.0);
            let hue =
                Vec3::new(1.16, 0.94, 0.76).lerp(Vec3::new(0.92, 1.05, 1.28), math::smoothstep(0.15, 0.8, weather));
            Spot { height, tone: hue * tone, rough: 0.88 + 0.05 * flake - 0.05 * (1.0 - weather) }
        };
        self.warped(v, size, 0.05, 0.02).map(spot).collect()
    }

    fn papery(&self, v: f32, size: usize) -> Vec<Spot> {
        let (broad_row, fine_row) = (self.broad.row(v, size), self.fine.row(v, size));
        let (peel_row, curl_row) = (self.others[0].row(v, size), self.warp_fine[0].row(v, size));
        let spot = |Place { i, u, v, x, y }: Place| {
            let streak = self.grain.at(x, y);
            let fine = fine_row[i];
            let broad = broad_row[i];
            // Lenticels: short dark dashes around the trunk, one in some of the cells.
            let ragged = 0.5 * streak + 0.35 * fine;
            let mut dash = self.dash(self.cells.nearest(x, y), 0.4, 0.42, 0.17, ragged);
            dash = dash.max(0.7 * self.dash(self.more_cells.nearest(x, y), 0.4, 0.14, 0.12, ragged));
            // Scars: dark, rough lozenges where branches were shed.
            let scar_cell = self.small.nearest(x, y + 0.012 * curl_row[i]);
            let (scar, rough_scar) = self.scar(scar_cell, u, v);
            // Curls of peeling layers: thin raised edges along the streaks.
            let peel = peel_row[i];
            let edge = math::smoothstep(0.30, 0.33, peel);
            let height =
                0.55 + 0.10 * streak + 0.05 * fine + 0.12 * edge + 0.20 * dash + scar * (0.5 * rough_scar - 0.15);
            let pale = 1.0 + 0.11 * streak + 0.05 * fine + 0.08 * broad - 0.06 * edge;
            let warm = math::smoothstep(0.0, 0.8, broad + 0.3 * streak);
            let mut tone =
                Vec3::new(1.0, 1.0, 1.0).lerp(Vec3::new(1.0, 0.90, 0.78), 0.55 * warm.max(0.8 * edge)) * pale;
            tone = tone.lerp(Vec3::new(0.16, 0.135, 0.115), 0.85 * dash);
            let dark = Vec3::new(0.075, 0.068, 0.062) * (1.0 + 0.7 * rough_scar);
            tone = tone.lerp(dark, scar);
            Spot { height, tone, rough: mix(0.56 + 0.05 * fine, 0.92, scar.max(dash * 0.8)) }
        };
        self.warped(v, size, 0.02, 0.004).map(spot).collect()
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
        let ragged = 0.085 * self.others[1].at(u, v) + 0.02 * self.others[2].at(u, v);
        let scar = 1.0 - math::smoothstep(size * 0.72, size, lozenge + ragged);
        (scar, self.others[3].at(u, v))
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

    fn smooth(&self, v: f32, size: usize) -> Vec<Spot> {
        let (broad_row, fine_row) = (self.broad.row(v, size), self.fine.row(v, size));
        let blotch_row = self.others[0].row(v, size);
        let spot = |Place { i, x, y, .. }: Place| {
            let wrinkle = self.grain.at(x, y);
            let fine = fine_row[i];
            let broad = broad_row[i];
            let blotch = math::smoothstep(0.05, 0.4, blotch_row[i]);
            let dash = self.dash(self.cells.nearest(x, y), 0.35, 0.22, 0.10, 0.3 * fine);
            // Eyes of shed twigs: low rings, wider than high.
            let eye = self.small.nearest(x, y);
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
        };
        self.warped(v, size, 0.03, 0.006).map(spot).collect()
    }
}
