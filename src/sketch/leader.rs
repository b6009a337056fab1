//! Stems under a sketch go one way.
//!
//! Lobes spread to all sides, and a stem's own handles with them: under a heart a leader went up into one lobe and crossed to the
//! other. Sideways its handles are therefore told what a curve tells them that bends one way ([`Bend`]). Along it they go as far as
//! they are told, but that none of its steps is pressed together much more than all of it is, and where its tip goes stays
//! ([`spaced`]). All that is by what is seen from the front; a view from the side does not change it.

use glam::Vec3;

use super::bound::{Chart, Sketcher};
use super::spine::{PRESSED, arcs};

/// Changes what handles of stems are told in a level view, each by its share; nothing in others.
pub(super) fn calm(sketcher: &Sketcher, chart: &Chart, told: &mut [Vec3], shares: &[f32]) {
    if chart.plane.steepness() != 0.0 {
        return;
    }
    let Sketcher { plant, positions, handles, .. } = sketcher;
    for id in plant.chain_ids().filter(|id| plant.chain(*id).parent.is_none()) {
        let first = handles.partition_point(|h| h.chain < id);
        let own = first..first + handles[first..].partition_point(|h| h.chain == id);
        let points = &positions[plant.span(id)];
        let arc = arcs(points);
        let (foot, length) = (points[0], arc[arc.len() - 1]);
        let Some(up) = (points[points.len() - 1] - foot).try_normalize().filter(|_| !own.is_empty()) else { continue };
        let mut ways = vec![Way { share: 0.0, height: 0.0, along: 0.0, aside: Vec3::ZERO, weight: 0.0 }];
        ways.extend(own.clone().map(|i| {
            let (along, height) = (told[i].dot(up), (handles[i].position - foot).dot(up));
            let share = (handles[i].arc / length) as f32;
            Way { share, height, along, aside: told[i] - up * along, weight: handles[i].weight }
        }));
        spaced(&mut ways);
        let bend = Bend::of(&ways);
        for (i, way) in own.zip(&ways[1..]) {
            told[i] = told[i].lerp(bend.at(way.share) + up * way.along, shares[i]);
        }
    }
}

/// What a place on a stem is told.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Of the stem's length.
    share: f32,
    /// How far up the stem it is, metres.
    height: f32,
    /// How far it goes up the stem, and aside.
    along: f32,
    aside: Vec3,
    weight: f32,
}

/// Has places, from the foot, which stays, to the tip, which goes where it is told, keep apart by [`PRESSED`] of what they were, or of
/// what is left of it if all of the stem gets shorter.
fn spaced(ways: &mut [Way]) {
    let Some(tip) = ways.last() else { return };
    let least = PRESSED * ((tip.height + tip.along) / tip.height.max(1e-6)).clamp(0.0, 1.0);
    // Where a stem nods, it may as far as it did.
    let gap = |from: &Way, to: &Way| {
        let rise = to.height - from.height;
        if rise > 0.0 { least * rise } else { rise }
    };
    for i in (1..ways.len().saturating_sub(1)).rev() {
        let most = ways[i + 1].height + ways[i + 1].along - gap(&ways[i], &ways[i + 1]);
        ways[i].along = ways[i].along.min(most - ways[i].height);
    }
    for i in 1..ways.len().saturating_sub(1) {
        let least = ways[i - 1].height + ways[i - 1].along + gap(&ways[i - 1], &ways[i]);
        ways[i].along = ways[i].along.max(least - ways[i].height);
    }
}

/// Ways aside along a stem that bend one way: `a s + b s²` at each share `s` of its length.
#[derive(Debug)]
struct Bend {
    a: Vec3,
    b: Vec3,
}

impl Bend {
    /// What comes nearest to the ways that are told, each by its weight: least squares.
    fn of(ways: &[Way]) -> Self {
        let most = ways.iter().map(|way| way.weight).fold(0.0, f32::max);
        let (mut aa, mut ab, mut bb) = (0.0_f32, 0.0_f32, 0.0_f32);
        let (mut of_a, mut of_b) = (Vec3::ZERO, Vec3::ZERO);
        for &Way { share: s, aside, weight, .. } in ways {
            // Of wood without foliage a little is asked, too.
            let weight = weight + 0.1 * most + 1e-6;
            (aa, ab, bb) = (aa + weight * s * s, ab + weight * s * s * s, bb + weight * s * s * s * s);
            (of_a, of_b) = (of_a + aside * (weight * s), of_b + aside * (weight * s * s));
        }
        let determinant = aa * bb - ab * ab;
        if determinant > 1e-6 * aa * bb {
            let [a, b] = [of_a * bb - of_b * ab, of_b * aa - of_a * ab].map(|sum| sum / determinant);
            Self { a, b }
        } else {
            Self { a: of_a / aa.max(1e-12), b: Vec3::ZERO }
        }
    }

    fn at(&self, share: f32) -> Vec3 {
        (self.a + self.b * share) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ways(count: usize, of: impl Fn(f32) -> (f32, Vec3)) -> Vec<Way> {
        let one = |i: usize| {
            let share = i as f32 / count as f32;
            let (along, aside) = of(share);
            Way { share, height: 10.0 * share, along, aside, weight: share }
        };
        (0..=count).map(one).collect()
    }

    #[test]
    fn ways_that_lie_on_a_bend_stay_and_zigzags_go() {
        let (a, b) = (Vec3::new(1.0, 0.0, 0.5), Vec3::new(-0.5, 0.0, 2.0));
        let bent = ways(5, |s| (0.0, (a + b * s) * s));
        let found = Bend::of(&bent);
        for way in &bent {
            assert!(found.at(way.share).distance(way.aside) < 1e-4, "{way:?}: {found:?}");
        }
        let zigzag = ways(9, |s| (0.0, Vec3::X * if (s * 9.0 + 0.5) as i32 % 2 == 0 { 1.0 } else { -1.0 }));
        let found = Bend::of(&zigzag);
        assert!(zigzag.iter().all(|way| found.at(way.share).length() < 0.5), "{found:?}");
    }

    #[test]
    fn no_step_is_pressed_together_and_the_tip_goes_where_it_is_told() {
        let heights = |ways: &[Way]| ways.iter().map(|way| way.height + way.along).collect::<Vec<f32>>();
        // A crown that is lifted off the ground: all but the tip is told to rise, some of it beyond the tip.
        let mut lifted = ways(5, |s| (if s < 1.0 { 30.0 * s * (1.0 - s) } else { 0.0 }, Vec3::ZERO));
        spaced(&mut lifted);
        let found = heights(&lifted);
        assert!((found[5] - 10.0).abs() < 1e-4 && found.windows(2).all(|h| h[1] - h[0] > 0.99), "{found:?}");
        // What comes down as a whole is pressed together, but evenly.
        let mut sunk = ways(5, |s| (if s < 1.0 { 0.0 } else { -6.0 }, Vec3::ZERO));
        spaced(&mut sunk);
        let found = heights(&sunk);
        assert!((found[5] - 4.0).abs() < 1e-4 && found.windows(2).all(|h| h[1] - h[0] > 0.39), "{found:?}");
        spaced(&mut []);
        // A stem that nods stays as it is if nothing is told.
        let mut nods = ways(4, |_| (0.0, Vec3::ZERO));
        nods.iter_mut().zip([0.0, 1.0, 5.0, 8.0, 6.0]).for_each(|(way, height)| way.height = height);
        spaced(&mut nods);
        assert!(nods.iter().all(|way| way.along == 0.0), "{nods:?}");
    }
}
