//! A species as it is estimated: what measures give, what trial trees correct, and its text.

use std::fmt::Write as _;

use super::crown::{Crown, fit};
use super::measure::{Group, Measures};
use crate::base::{Seed, math};

/// Edges of the graph that the shortest branches should be long.
const SHORTEST: f32 = 2.5;
/// Nodes of a graph, at least and at most.
const NODES: [f32; 2] = [12_000.0, 60_000.0];
/// Share of what a trial missed that is corrected at once.
const GAIN: f32 = 0.7;

/// How many times as thick as a tip a trunk is at least, and exponents of what trees are (`plant/allometry.rs`): radii that scans get
/// wrong lead beyond.
const THICKER: f32 = 1.5;
const EXPONENTS: [f32; 2] = [1.5, 3.5];

/// Most crookedness: the noise of a scan counts as winding, too, and would make a trunk a corkscrew.
const WINDING: f32 = 0.4;

/// A later iteration.
#[derive(Clone, Debug, PartialEq)]
struct Pass {
    count: f32,
    k: f32,
    t: f32,
    alpha1: f32,
    /// Degrees a plant height.
    bend: f32,
}

/// A species to be written. Lengths over the height, angles degrees, but for `height` and the radii.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Recipe {
    height: f32,
    nodes: f32,
    width: f32,
    tip_radius: f32,
    allometry: f32,
    taper: f32,
    flare: f32,
    flare_height: f32,
    crookedness: f32,
    bole: f32,
    slenderness: f32,
    trunk: f32,
    stems: Option<Crown>,
    stem_count: f32,
    stem_lean: f32,
    crown: Crown,
    limbs: f32,
    limb_start: [f32; 2],
    limb_bend: f32,
    passes: Vec<Pass>,
}

impl Recipe {
    /// The first recipe of a plant.
    pub(super) fn of(plant: &Measures) -> Self {
        let mut crown = fit(&plant.limb_tips);
        // What grows after the limbs reaches beyond them.
        let beyond: f32 = plant.groups.iter().map(|g| g.length).sum::<f32>() * 0.3;
        if !plant.groups.is_empty() {
            crown.radius = (crown.radius - beyond).max(crown.radius * 0.6);
        }
        let width = (plant.out.max(crown.radius) * 2.6 + 0.1).clamp(0.1, 9.0);
        let shortest = plant.groups.iter().fold(plant.limbs.length, |s, g| s.min(g.length)).max(0.01);
        // As many nodes as give edges of a fraction of the shortest branches.
        let edge = (shortest / SHORTEST) / 1.15;
        let nodes = (width * width * std::f32::consts::FRAC_PI_4 / (edge * edge * edge)).clamp(NODES[0], NODES[1]);
        let mut recipe = Self {
            height: plant.height,
            nodes,
            width,
            tip_radius: plant.rule.tip_radius,
            allometry: plant.rule.allometry,
            taper: plant.rule.taper,
            flare: plant.flare,
            flare_height: plant.flare_height,
            crookedness: 0.2,
            bole: plant.bole,
            slenderness: plant.slenderness * 1.6,
            trunk: plant.trunk,
            stems: (plant.stem_tips.len() > 1).then(|| fit(&plant.stem_tips)),
            stem_count: plant.stem_tips.len() as f32,
            stem_lean: plant.stem_lean,
            crown,
            limbs: plant.limbs.count as f32,
            limb_start: plant.limb_start,
            limb_bend: plant.limbs.bend,
            passes: Vec::new(),
        };
        let edge = recipe.edge();
        recipe.passes = plant.groups.iter().map(|group| Pass::of(group, edge)).collect();
        recipe
    }

    /// About the length of an edge of the graph.
    fn edge(&self) -> f32 {
        1.15 * math::cbrt(self.width * self.width * std::f32::consts::FRAC_PI_4 / self.nodes)
    }

    /// Corrects what a trial tree missed.
    pub(super) fn correct(&mut self, target: &Measures, grown: &Measures) {
        // A factor by which the share GAIN of a miss is made good, at most 2.
        let factor = |wanted: f32, got: f32| {
            if wanted > 0.0 && got > 0.0 {
                math::pow((wanted / got).clamp(0.25, 4.0), GAIN).clamp(0.5, 2.0)
            } else {
                1.0
            }
        };
        self.crown.radius = (self.crown.radius * factor(target.out, grown.out)).clamp(0.01, self.width * 0.48);
        self.thicken(target, grown.base_radius);
        self.slenderness *= factor(target.slenderness, grown.slenderness).max(1.0);
        self.crookedness = (self.crookedness + (target.winding - grown.winding) * 2.0).clamp(0.0, WINDING);
        let more = factor(target.branches as f32, grown.branches as f32);
        for side in 0..2 {
            self.limb_start[side] += (target.limb_start[side] - grown.limb_start[side]) * GAIN * 0.5;
        }
        self.limb_bend += (target.limbs.bend - grown.limbs.bend) * GAIN * 0.5;
        for (i, pass) in self.passes.iter_mut().enumerate() {
            pass.count *= more;
            if let (Some(wanted), Some(got)) = (target.groups.get(i), grown.groups.get(i)) {
                pass.k *= factor(wanted.length, got.length);
                pass.alpha1 += (wanted.angle - got.angle) * GAIN;
                pass.bend += (wanted.bend - got.bend) * GAIN * 0.5;
            }
        }
    }

    /// Makes a trunk as thick as the plant's that was `grown` thick, metres: what it carries is what it is over a tip, and the exponent
    /// is the one that leads from tips as thick as the plant's to its trunk.
    pub(super) fn thicken(&mut self, target: &Measures, grown: f32) {
        let load = math::pow(grown / self.tip_radius, self.allometry);
        if !(load.is_finite() && load > 0.0 && target.base_radius > 0.0) {
            return;
        }
        let thicker = (target.base_radius / target.rule.tip_radius).max(THICKER);
        if load > 1.0 {
            self.allometry = (math::ln(load) / math::ln(thicker)).clamp(EXPONENTS[0], EXPONENTS[1]);
        }
        self.tip_radius = target.base_radius / math::pow(load, 1.0 / self.allometry);
    }

    /// A recipe near this one: every measure that trial trees can miss by chance up or down, by up to a share of `size`;
    /// angles by as many right angles.
    pub(super) fn varied(&self, seed: Seed, size: f32) -> Self {
        let chance = |name: &str, i: usize| seed.child(name).at(i as u64).range(-size, size);
        let times = |name: &str, i: usize| math::exp(chance(name, i));
        let angle = |name: &str, i: usize| chance(name, i) * 90.0;
        let mut near = self.clone();
        near.taper *= times("taper", 0);
        near.crookedness = (near.crookedness + chance("crooked", 0) * 0.5).clamp(0.0, WINDING);
        near.bole = (near.bole * times("bole", 0)).clamp(0.0, 0.95);
        near.trunk *= times("trunk", 0);
        near.slenderness *= times("slender", 0);
        near.crown.radius = (near.crown.radius * times("radius", 0)).clamp(0.01, near.width * 0.48);
        near.crown.hollow = (near.crown.hollow + chance("hollow", 0)).clamp(0.0, 0.95);
        near.crown.top = (near.crown.top + chance("top", 0) * 0.3).clamp(0.1, 1.0);
        near.crown.bottom = (near.crown.bottom + chance("bottom", 0) * 0.3).clamp(0.0, near.crown.top - 0.05);
        if near.limbs >= 1.0 {
            near.limbs = (near.limbs * times("limbs", 0)).max(1.0);
        }
        for (side, start) in near.limb_start.iter_mut().enumerate() {
            *start += angle("start", side);
        }
        near.limb_bend += angle("bend", 0);
        for (i, pass) in near.passes.iter_mut().enumerate() {
            pass.count *= times("count", i) * times("count", i + 8);
            pass.k = (pass.k * times("k", i)).max(1.0);
            pass.t = (pass.t + chance("t", i)).clamp(0.05, 1.0);
            pass.alpha1 += angle("alpha1", i);
            pass.bend += angle("pass bend", i);
        }
        near
    }

    /// Makes room where nothing grew.
    pub(super) fn loosen(&mut self) {
        self.bole *= 0.5;
        self.crown.hollow *= 0.5;
        self.crown.radius = (self.crown.radius * 1.3 + 0.02).min(self.width * 0.48);
        self.nodes = (self.nodes * 1.5).min(NODES[1]);
    }

    /// The species file.
    pub(super) fn text(&self) -> String {
        let mut out = String::from(
            "// Estimated from a plant: lengths inside the iterations are shares of its height, angles degrees.\n(\n",
        );
        let edge = self.edge();
        let top = |lines: &[(&str, f32, [f32; 2], usize, &str)], out: &mut String| {
            for &(name, value, [low, high], digits, about) in lines {
                let value = if value.is_finite() { value.clamp(low, high) } else { low };
                let _ = writeln!(out, "    // {about}\n    {name}: {value:.digits$},");
            }
        };
        let lines = [
            ("height", self.height, [0.1, 150.0], 3, "Metres."),
            ("nodes", self.nodes, [500.0, 400_000.0], 0, "Fine enough for the shortest branches."),
            ("width", self.width, [0.05, 10.0], 3, "Room for the crown."),
            (
                "tip_radius",
                self.tip_radius,
                [0.0002, 0.2],
                5,
                "Least squares over the radii of all branches: metres at a tip,",
            ),
            ("allometry", self.allometry, [1.0, 5.0], 2, "the exponent by which they add up,"),
            ("taper", self.taper, [0.0, 50.0], 2, "and what a metre of wood adds."),
            ("flare", self.flare, [0.0, 3.0], 2, "How the trunk widens at the ground,"),
            ("flare_height", self.flare_height, [0.5, 30.0], 1, "and over how many of its radii."),
            ("crookedness", self.crookedness, [0.0, 1.0], 2, "From arc length over chord."),
            ("bole", self.bole, [0.0, 1.0], 3, "Hardly any branch leaves below."),
            (
                "slenderness",
                self.slenderness,
                [50.0, 10_000.0],
                0,
                "Longer branches, in radii of their base, are shed.",
            ),
        ];
        top(&lines, &mut out);
        out.push_str("    iterations: [\n");
        let angle = |value: f32, most: f32| if value.is_finite() { value.clamp(-most, most) } else { 0.0 };
        let shape = |crown: &Crown| {
            let radius = crown.radius.min(self.width * 0.499 - 0.0005);
            format!(
                "{}(bottom: {:.3}, top: {:.3}, radius: {radius:.3}, hollow: {:.2})",
                crown.shape.name(),
                crown.bottom,
                crown.top,
                crown.hollow
            )
        };
        match &self.stems {
            None => {
                let height = self.trunk.clamp((self.bole + 0.03).min(0.97), 0.97);
                let _ = writeln!(
                    out,
                    "        // The trunk, as far up as it leads.\n        (endpoints: Volume(shape: Point(height: {height:.3}), count: 1)),"
                );
            }
            Some(stems) => {
                let _ = writeln!(
                    out,
                    "        // The stems.\n        (\n            endpoints: Volume(shape: {}, count: {}),\n            guide: Piecewise(alpha1: {:.1}, alpha2: 0.0, h0: 1),\n        ),",
                    shape(stems),
                    count(self.stem_count),
                    angle(self.stem_lean, 80.0),
                );
            }
        }
        if self.limbs >= 1.0 {
            let bend = angle(self.limb_bend * edge, 20.0);
            let _ = writeln!(
                out,
                "        // The limbs: to the tips of the plant's longest branches, leaving as those do.\n        (\n            endpoints: Volume(shape: {}, count: {}),\n            guide: Piecewise(alpha1: {bend:.2}, alpha2: {bend:.2}, h0: 1),\n            start: ByHeight(low: {:.1}, high: {:.1}),\n        ),",
                shape(&self.crown),
                count(self.limbs),
                angle(self.limb_start[0], 170.0),
                angle(self.limb_start[1], 170.0),
            );
        }
        for pass in &self.passes {
            let _ = writeln!(
                out,
                "        // Shorter branches.\n        (\n            endpoints: Surface(k: {}, t: {:.2}, count: {}),\n            guide: Piecewise(alpha1: {:.1}, alpha2: {:.2}, h0: 1),\n        ),",
                pass.k.round().clamp(1.0, 30.0),
                pass.t.clamp(0.05, 1.0),
                count(pass.count),
                angle(pass.alpha1, 160.0),
                angle(pass.bend * edge, 20.0),
            );
        }
        out.push_str("    ],\n)\n");
        out
    }
}

impl Pass {
    fn of(group: &Group, edge: f32) -> Self {
        Self {
            count: group.count as f32,
            k: group.length / edge,
            // The surface reaches inwards as far as the plant's own tips do.
            t: 1.1 - group.inner,
            alpha1: group.angle,
            bend: group.bend,
        }
    }
}

/// A number of endpoints.
fn count(value: f32) -> u32 {
    value.round().clamp(1.0, 20_000.0) as u32
}
