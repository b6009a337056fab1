//! Radii of a blend (2017 TVCG, 4.3, Eq. 3).
//!
//! The paper interpolates radii linearly and then replaces them by the allometric rule, from the tips to the root, which
//! at a corner would overwrite the source's own. Here the rule is a correction: linear radii are scaled by
//! `(A / E)^0.4`, with A what the blended chain carries (its tip, and the children that are there) and E what its
//! sources carry in its shares, both summed at the blended locations. A equals E at the corners; a bough whose children
//! have not grown is thinner, and a slim trunk whose limbs are still the other source's is stouter. A child counts at
//! every point below it, and at the next point above it by how near it is, so that no radius jumps when a child passes
//! a point on its way along the parent. Four guards: no chain's base gets thicker than its thickest member's (limbs of
//! the other source would make a trunk three times as thick as both), nor thinner than its thinnest where it has several or is a stem (between
//! a palm and an oak the palm's trunk lost a third of its thickness to limbs that had not grown); a chain tapers wherever its linear radii do (a child
//! that is missing would otherwise leave a waist); and a child's base is at most as thick against its parent as in its
//! sources, or as thick as the parent.
//!
//! Where shares are the same everywhere, as in a plain mix, A equals E and radii stay linear: they step where the sources'
//! branches leave, each a little, and not where the blended one does. Moved there, a source that tapers evenly, as
//! imports do, would get a bump and a waist for each branch. Forks of a mix of four grown species obey Eq. 3 to 15 %, those of
//! the sources to 6 to 11 %.
//!
//! Rejected: blending the ratio of actual to ruled radius. Where one source is a scan whose twigs are all of one radius
//! (ratio 5 at the trunk) and the other obeys the rule with many tips, the middle comes out 3 times as thick as both.
//! Rejected: A and E from the tips up, not from the children's radii: a scan's trunk (12 cm, twigs of 2 cm) then stays
//! slim under the full crown of an oak (44 cm, twigs of 4 mm), since many thin twigs weigh less than few thick ones.

use super::family::NONE;
use super::kernel::{Blender, Feed};
use crate::plant::{carried, value_at};

impl Blender<'_> {
    /// Scales the linear radii by the allometric rule, from the tips down, where anything changed.
    pub(super) fn apply_rule(&mut self) {
        self.touched.copy_from_slice(&self.moved);
        for k in (0..self.feeds.len()).rev() {
            if !self.touched[k] {
                continue;
            }
            let parent = self.family.parents[k];
            let before = self.load[k];
            if self.feeds[k] == Feed::Nothing {
                self.load[k] = 0.0;
            } else {
                self.rule(k);
            }
            // A kin that appears, goes or moves along its parent counts there in another way.
            if parent != NONE && (self.moved[k] || self.load[k] != before) {
                self.touched[parent as usize] = true;
            }
        }
    }

    fn rule(&mut self, k: usize) {
        let family = self.family;
        let span = self.span(k);
        if self.kept[k] {
            self.radii[span.clone()].copy_from_slice(&self.linear[span.clone()]);
            self.load[k] = carried(f64::from(self.linear[span.start]));
            return;
        }
        self.gather(k);
        let (linear, parameters) = (&self.linear[span.clone()], &self.parameters[span.clone()]);
        let radii = &mut self.radii[span];
        let tip = linear[linear.len() - 1];
        let (mut load, mut expected) = (carried(f64::from(tip)), carried(f64::from(tip)));
        let (mut thickest, mut thinnest, mut count) = (0.0_f32, f32::MAX, 0);
        for member in family.row(k).iter().filter(|member| member.chain != NONE) {
            thickest = thickest.max(member.base);
            thinnest = thinnest.min(if member.sharers > 1 { 0.0 } else { member.base });
            count += 1;
        }
        // Of its members' bases, by the weights of its first point.
        let mean = linear[0] / self.grown[k];
        let most = if mean > 0.0 { (thickest / mean).max(1.0) } else { 1.0 };
        let is_sure = count > 1 || family.parents[k] == NONE;
        let least = if mean > 0.0 && is_sure { (thinnest / mean).min(1.0) } else { 0.0 };
        let ratio = |load: f64, expected: f64| {
            if load == expected || expected <= 0.0 {
                1.0
            } else {
                (two_fifths(load / expected) as f32).clamp(least, most)
            }
        };
        let (mut scale, mut next) = (1.0_f32, 0);
        let (mut linear_above, mut above) = (tip, tip);
        for i in (0..linear.len()).rev() {
            let before = next;
            while next < self.events.len() && f64::from(self.events[next].0) >= parameters[i] {
                load += self.events[next].1;
                expected += self.events[next].2;
                next += 1;
            }
            if next > before {
                scale = ratio(load, expected);
            }
            let mut here = scale;
            // Children just below this point.
            let low = if i > 0 { parameters[i - 1] } else { f64::NEG_INFINITY };
            if next < self.events.len() && f64::from(self.events[next].0) > low {
                let (mut part, mut part_expected) = (load, expected);
                for event in self.events[next..].iter().take_while(|e| f64::from(e.0) > low) {
                    let near = ((f64::from(event.0) - low) / (parameters[i] - low)).clamp(0.0, 1.0);
                    part += event.1 * near;
                    part_expected += event.2 * near;
                }
                here = ratio(part, part_expected);
            }
            let own = linear[i];
            // A corner is left alone to the last bit; elsewhere the chain tapers as its linear radii do.
            radii[i] = if here != 1.0 || above != linear_above {
                let taper = if own < linear_above { above * (own / linear_above) } else { above };
                (own * here).max(taper)
            } else {
                own
            };
            (linear_above, above) = (own, radii[i]);
        }
        self.load[k] = carried(f64::from(radii[0]));
    }

    /// The children of a kin and of its members, from the tip down.
    fn gather(&mut self, k: usize) {
        let family = self.family;
        let degree = self.grown[k];
        let mut events = std::mem::take(&mut self.events);
        events.clear();
        for &child in &family.children[family.child_range(k)] {
            let (mut expected, mut location, mut sum) = (0.0_f32, 0.0_f32, 0.0_f32);
            let mut coordinate = 0.0_f64;
            for (s, (member, share)) in family.row(child as usize).iter().zip(self.share(k)).enumerate() {
                if member.chain != NONE && *share > 0.0 && self.is_expected(child, s) {
                    expected += member.base * share;
                    location += member.location * share;
                    sum += share;
                    if let Some(units) = &family.units {
                        coordinate += units.coordinate(k, s, f64::from(member.location)) * f64::from(*share);
                    }
                }
            }
            let expected = carried(f64::from(expected * degree));
            if self.feeds[child as usize] != Feed::Nothing {
                events.push((self.location[child as usize], self.load[child as usize], expected));
            } else if sum > 0.0 {
                let by_units = family.units.is_some();
                let location = if by_units { self.along(k, coordinate / f64::from(sum)) } else { location / sum };
                events.push((location, 0.0, expected));
            }
        }
        // Ties by value, so that no order of siblings shows in the sum.
        events.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)).then(b.2.total_cmp(&a.2)));
        self.events = events;
    }

    /// Whether a kin counts for what its parent's source carries. Of kins that share the source's chain each that is
    /// present does, as it carries, too; when none is, the first. Walks round those that share the chain. What only stands in
    /// and is not there grows elsewhere, and its bearer is as thick as without it (`burden.rs`).
    fn is_expected(&self, kin: u32, source: usize) -> bool {
        let present = |kin: u32| self.feeds[kin as usize] != Feed::Nothing;
        if self.family.stand_ins[kin as usize] && !present(kin) {
            return false;
        }
        let mut twin = self.family.row(kin as usize)[source].twin;
        if twin == NONE || present(kin) {
            return true;
        }
        while twin != kin {
            if twin < kin || present(twin) {
                return false;
            }
            twin = self.family.row(twin as usize)[source].twin;
        }
        true
    }

    /// Keeps the bases of children within their parents, from the stems up, where anything changed.
    pub(super) fn fit_to_parents(&mut self) {
        for k in 0..self.feeds.len() {
            let parent = self.family.parents[k];
            if self.feeds[k] == Feed::Nothing || parent == NONE {
                continue;
            }
            let p = parent as usize;
            if !self.touched[k] && !self.touched[p] {
                continue;
            }
            let span = self.span(p);
            let there = value_at(&self.parameters[span.clone()], &self.radii[span], self.location[k]) * self.fit[p];
            let members = self.family.row(k).iter().zip(self.share(k)).filter(|(_, share)| **share > 0.0);
            let most = there * members.fold(0.0_f32, |sum, (m, share)| sum + m.stoutness * share);
            let base = self.radii[self.first[k] as usize];
            // A hair of room for rounding, or corners would be touched. NaN, of an infinite limit on a parent without
            // thickness, limits nothing.
            let fit = if base > most * (1.0 + 1e-5) { most / base } else { 1.0 };
            if fit != self.fit[k] {
                self.fit[k] = fit;
                // Its own children must look again.
                self.touched[k] = true;
            }
        }
    }
}

/// `x^0.4` for `x` above 0, to 14 digits; 0 below 1e-60. Halley's iteration on `y^5 = x²`: a third of the time of `pow`.
pub(super) fn two_fifths(x: f64) -> f64 {
    if x < 1e-60 {
        return 0.0;
    }
    let x = x.min(1e60);
    let square = x * x;
    // Two fifths of the exponent, by the bits: within 6 %.
    let bits = x.to_bits() / 5 * 2 + (1023_u64 << 52) / 5 * 3;
    let mut y = f64::from_bits(bits);
    for _ in 0..3 {
        let fifth = y * y * y * y * y;
        y *= (2.0 * fifth + 3.0 * square) / (3.0 * fifth + 2.0 * square);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math;

    #[test]
    fn two_fifths_is_the_power() {
        for i in -500..500 {
            let x = math::pow64(1.3, f64::from(i));
            let (own, libm) = (two_fifths(x), math::pow64(x, 0.4));
            assert!((own - libm).abs() < 1e-13 * libm, "{x}: {own} {libm}");
        }
        assert_eq!(two_fifths(1.0), 1.0);
        assert_eq!(two_fifths(0.0), 0.0);
        assert!(two_fifths(1e300).is_finite());
    }
}
