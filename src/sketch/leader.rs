//! Stems under a sketch go one way, and end within it.
//!
//! Lobes spread to all sides, and a stem's own handles with them: under a heart a leader went up into one lobe and crossed to the
//! other, and above a cloud it stood out as a mast. Sideways its handles are therefore told what a curve tells them that bends one
//! way ([`Bend`]). Along it they go as far as they are told, but that none of its steps is pressed together much more than all of it is,
//! and where its tip goes stays ([`spaced`]). A stem that would end outside of the sketch ends where it last was
//! within, all of it that much shorter. Branches make up for that, since each goes where its own handles are told. All that is by what is seen
//! from the front; a view from the side changes neither.

use glam::Vec3;

use super::bound::{Chart, Sketcher, thickest_stem};
use super::spine::{PRESSED, arcs};
use super::stem::Leads;
use super::trim::Field;

/// How far within the sketch a stem ends, over how far leaves reach.
const WITHIN: f32 = 0.5;
/// What is left of a stem at least.
const LEAST: f32 = 0.2;
/// Places along a stem at which it is looked whether it is within, and how often the way between two of them is halved.
const PLACES: u16 = 64;
const HALVED: usize = 6;

/// Changes what handles of stems are told in a level view of what is drawn there, each by its share; nothing in others. `leads` then brings
/// the thickest stem onto a drawn trunk.
pub(super) fn calm(
    sketcher: &Sketcher,
    chart: &Chart,
    (drawn, leads): (&Field, &Leads),
    told: &mut [Vec3],
    shares: &[f32],
) {
    if chart.plane.steepness() != 0.0 {
        return;
    }
    let Sketcher { plant, positions, handles, .. } = sketcher;
    let is_within = |p: Vec3| drawn.at(chart.plane.seen(p)) >= WITHIN * sketcher.reach;
    let led = thickest_stem(plant).filter(|_| !leads.is_empty());
    for id in plant.chain_ids().filter(|id| plant.chain(*id).parent.is_none()) {
        let first = handles.partition_point(|h| h.chain < id);
        let own = first..first + handles[first..].partition_point(|h| h.chain == id);
        let points = &positions[plant.span(id)];
        let arc = arcs(points);
        let (foot, length) = (points[0], arc[arc.len() - 1]);
        let Some(up) = (points[points.len() - 1] - foot).try_normalize().filter(|_| !own.is_empty()) else { continue };
        let share = |arc: f64| (arc / length) as f32;
        let mut ways = vec![Way { share: 0.0, height: 0.0, along: 0.0, aside: Vec3::ZERO, weight: 0.0 }];
        ways.extend(own.clone().map(|i| {
            let (along, height) = (told[i].dot(up), (handles[i].position - foot).dot(up));
            Way { share: share(handles[i].arc), height, along, aside: told[i] - up * along, weight: handles[i].weight }
        }));
        spaced(&mut ways);
        let bend = Bend::of(&ways);
        let along: Vec<(f32, f32)> = ways.iter().map(|way| (way.share, way.along)).collect();
        let way = |share: f32| bend.at(share) + up * mixed(&along, share, |a, b, f| a + (b - a) * f);
        let moved: Vec<(f32, Vec3)> =
            arc.iter().zip(points).map(|(arc, p)| (share(*arc), *p + way(share(*arc)))).collect();
        let place = |share: f32| mixed(&moved, share, |a, b, f| a.lerp(b, f));
        let brought = |p: Vec3| if led == Some(id) { p + leads.onto(p) } else { p };
        let end = end(|share| is_within(brought(place(share)))).max(LEAST);
        for (i, of) in own.zip(&ways[1..]) {
            told[i] = told[i].lerp(place(of.share * end) - handles[i].position, shares[i]);
        }
    }
}

/// The largest share of a stem up to which it is within; all of it where it is so nowhere.
fn end(is_within: impl Fn(f32) -> bool) -> f32 {
    let share = |place: u16| f32::from(place) / f32::from(PLACES);
    let Some(last) = (0..=PLACES).rev().find(|place| is_within(share(*place))) else { return 1.0 };
    let (mut within, mut beyond) = (share(last), share((last + 1).min(PLACES)));
    for _ in 0..HALVED {
        let middle = (within + beyond) * 0.5;
        if is_within(middle) {
            within = middle;
        } else {
            beyond = middle;
        }
    }
    within
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

/// What lies at a share, of values that are told with theirs.
fn mixed<T: Copy>(all: &[(f32, T)], share: f32, mix: impl Fn(T, T, f32) -> T) -> T {
    let after = all.partition_point(|(s, _)| *s < share).clamp(1, all.len() - 1);
    let (from, to) = (all[after - 1], all[after]);
    let f = if to.0 > from.0 { ((share - from.0) / (to.0 - from.0)).clamp(0.0, 1.0) } else { 1.0 };
    mix(from.1, to.1, f)
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

    #[test]
    fn a_stem_ends_where_it_leaves_what_is_drawn_between_its_points_too() {
        assert!((end(|share| share < 0.73) - 0.73).abs() < 1e-3);
        assert!((end(|share| (0.5..0.6).contains(&share)) - 0.6).abs() < 1e-3);
        assert_eq!([end(|_| true), end(|_| false)], [1.0, 1.0]);
    }

    #[test]
    fn what_lies_between_is_mixed() {
        let all = [(0.0, 0.0), (0.5, 1.0), (1.0, 5.0)];
        let at = |share: f32| mixed(&all, share, |a: f32, b, f| a + (b - a) * f);
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0, 2.0].map(at), [0.0, 0.5, 1.0, 3.0, 5.0, 5.0]);
    }
}
