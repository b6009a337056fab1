//! The outlines that leaf cards are cut to: polygons of few corners that hold all that a picture shows.
//!
//! The picture's solid texels, with a margin for what filters add, mark cells of a coarse grid; loose parts are joined by
//! the shortest way and holes are filled, so that one outline runs round all. It is simplified by steps that only add
//! area, the least first: a corner that goes in is cut short, or an edge gives way to the extensions of its neighbours (the
//! second as Persson, "Graphics gems for games: particle trimming", 2009, does on convex hulls; the first keeps bays open).
//! So every outline holds the one before it. Linear in texels; the rest is bounded by the grid.

use glam::Vec2;
use rayon::prelude::*;

use super::Maps;
use crate::mesh::CardCut;
use crate::preset::plan::LeafCards;

/// Cells along an edge of the grid, even.
const CELLS: usize = 128;
/// Alpha from which a texel counts: mips and filters show some of what is below a half.
const SOLID: u8 = 64;
/// Texels of a picture's edge for one of margin.
const MARGIN: usize = 128;
/// Bays of up to this many cells go first: steps of the grid would otherwise be filled up to their outer corners.
const BAY: f32 = 3.0;
/// An outline of more corners than this is noise, and its hull is taken: what follows is quadratic.
const FRAYED: usize = 2500;
/// Corners of cards that are seen from afar.
const FAR_CORNERS: usize = 5;

/// The cuts of some leaf pictures, where leaves are to be cut out; otherwise none.
#[must_use]
pub fn card_cuts(leaf_art: &[Maps], leaves: LeafCards) -> Vec<CardCut> {
    let LeafCards::CutOut { corners } = leaves else { return Vec::new() };
    leaf_art.par_iter().map(|maps| card_cut(maps, corners)).collect()
}

/// The cut of a picture, of at most `corners` (8..=32) corners; the whole card of a picture that shows nothing.
#[must_use]
pub fn card_cut(maps: &Maps, corners: u32) -> CardCut {
    let corners = corners.clamp(8, 32) as usize;
    let marked = Cells::of(maps);
    let whole = marked.outline(0..CELLS);
    let of = |columns: std::ops::Range<usize>, most: usize| {
        let outline = marked.outline(columns.clone());
        simplified(&outline, columns, most)
    };
    let halves = [of(0..CELLS / 2, corners / 2), of(CELLS / 2..CELLS, corners - corners / 2)];
    let (flat, far) = (simplified(&whole, 0..CELLS, corners), simplified(&whole, 0..CELLS, FAR_CORNERS));
    CardCut::new(&flat, [&halves[0], &halves[1]], &far).unwrap_or_else(whole_card)
}

/// A card that nothing is cut from.
fn whole_card() -> CardCut {
    let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let half = |from: f32| square.map(|p| Vec2::new(p.x * 0.5 + from, p.y));
    CardCut::new(&square, [&half(0.0), &half(0.5)], &square).expect("squares are simple")
}

/// Which cells of the grid hold something, rows from the bottom.
struct Cells(Vec<bool>);

impl Cells {
    fn of(maps: &Maps) -> Self {
        let mut cells = vec![false; CELLS * CELLS];
        let (width, height) = (maps.width as usize, maps.height as usize);
        let span = |at: usize, size: usize| {
            let margin = (size / MARGIN).max(1);
            let first = at.saturating_sub(margin) * CELLS / size;
            let last = ((at + margin + 1) * CELLS).div_ceil(size);
            first..last.min(CELLS)
        };
        for (y, row) in maps.color.chunks_exact(width.max(1)).take(height).enumerate() {
            let rows = span(y, height);
            for (x, _) in row.iter().enumerate().filter(|(_, c)| c[3] >= SOLID) {
                for cell in rows.clone() {
                    span(x, width).for_each(|column| cells[(CELLS - 1 - cell) * CELLS + column] = true);
                }
            }
        }
        Self(cells)
    }

    /// The outline of what lies in some columns, counter-clockwise, in cells; empty where there is nothing.
    fn outline(&self, columns: std::ops::Range<usize>) -> Vec<Vec2> {
        let mut part = Region {
            width: columns.len(),
            cells: self.0.chunks_exact(CELLS).flat_map(|row| row[columns.clone()].iter().copied()).collect(),
        };
        part.join();
        part.fill();
        part.trace().into_iter().map(|p| p + Vec2::X * columns.start as f32).collect()
    }
}

/// Some columns of the grid.
struct Region {
    width: usize,
    cells: Vec<bool>,
}

impl Region {
    /// The cells that share an edge with one.
    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y, width) = (cell % self.width, cell / self.width, self.width);
        [(x > 0).then(|| cell - 1), (x + 1 < width).then(|| cell + 1)]
            .into_iter()
            .chain([(y > 0).then(|| cell - width), (y + 1 < CELLS).then(|| cell + width)])
            .flatten()
    }

    /// Joins loose parts to the first by the shortest ways.
    fn join(&mut self) {
        let Some(first) = self.cells.iter().position(|solid| *solid) else { return };
        loop {
            // From the part that the first cell is in, over what is free, to the nearest other.
            let mut from = vec![usize::MAX; self.cells.len()];
            let mut own = vec![first];
            from[first] = first;
            let mut at = 0;
            while at < own.len() {
                for next in self.beside(own[at]).filter(|&n| self.cells[n]) {
                    if from[next] == usize::MAX {
                        from[next] = next;
                        own.push(next);
                    }
                }
                at += 1;
            }
            let mut queue = own;
            let mut met = None;
            let mut at = 0;
            while at < queue.len() && met.is_none() {
                for next in self.beside(queue[at]) {
                    if from[next] == usize::MAX {
                        from[next] = queue[at];
                        if self.cells[next] {
                            met = Some(queue[at]);
                            break;
                        }
                        queue.push(next);
                    }
                }
                at += 1;
            }
            let Some(mut way) = met else { return };
            while !self.cells[way] {
                self.cells[way] = true;
                way = from[way];
            }
        }
    }

    /// Fills what can't be reached from outside.
    fn fill(&mut self) {
        let (width, count) = (self.width, self.cells.len());
        let beside_rim = |c: usize| c.is_multiple_of(width) || (c + 1).is_multiple_of(width);
        let on_rim = |c: &usize| beside_rim(*c) || *c < width || c + width >= count;
        let mut outside = vec![false; count];
        let mut queue: Vec<usize> = (0..count).filter(|c| on_rim(c) && !self.cells[*c]).collect();
        queue.iter().for_each(|&c| outside[c] = true);
        while let Some(cell) = queue.pop() {
            for next in self.beside(cell) {
                if !outside[next] && !self.cells[next] {
                    outside[next] = true;
                    queue.push(next);
                }
            }
        }
        self.cells = outside.into_iter().map(|outside| !outside).collect();
    }

    /// Walks round what is solid, which is one part without holes; corners only.
    fn trace(&self) -> Vec<Vec2> {
        let solid = |x: i32, y: i32| {
            let inside = (0..self.width as i32).contains(&x) && (0..CELLS as i32).contains(&y);
            inside && self.cells[y as usize * self.width + x as usize]
        };
        let Some(first) = self.cells.iter().position(|solid| *solid) else { return Vec::new() };
        // The lowest row's leftmost cell: along its lower edge, what is solid on the left.
        let start = ((first % self.width) as i32, (first / self.width) as i32);
        let (mut at, mut way) = (start, (1, 0));
        let mut corners = Vec::new();
        // No outline is longer than all edges of all cells.
        for _ in 0..4 * self.cells.len() {
            at = (at.0 + way.0, at.1 + way.1);
            let left = (-way.1, way.0);
            // The two cells ahead of the corner.
            let cell = |side: (i32, i32)| {
                let toward = (way.0 + side.0, way.1 + side.1);
                solid(at.0 + (toward.0 - 1) / 2, at.1 + (toward.1 - 1) / 2)
            };
            let right = (way.1, -way.0);
            let turn = if cell(right) {
                right
            } else if cell(left) {
                way
            } else {
                left
            };
            if turn != way {
                corners.push(Vec2::new(at.0 as f32, at.1 as f32));
                way = turn;
            }
            if at == start && way == (1, 0) {
                break;
            }
        }
        corners
    }
}

/// An outline of at most `most` (four at least, but where it has fewer) corners that holds another, within its columns; u and
/// v.
fn simplified(outline: &[Vec2], columns: std::ops::Range<usize>, most: usize) -> Vec<Vec2> {
    let mut left = if outline.len() > FRAYED { convex(outline) } else { outline.to_vec() };
    let low = Vec2::new(columns.start as f32, 0.0);
    let high = Vec2::new(columns.end as f32, CELLS as f32);
    let most = most.max(3);
    while left.len() > most
        && let Some((_, bay)) = smallest_bay(&left).filter(|bay| bay.0 <= BAY)
    {
        left.remove(bay);
    }
    while left.len() > most {
        let Some(step) = cheapest(&left, low, high) else {
            // All that would help leaves the picture.
            let (a, b) = outline.iter().fold((high, low), |(a, b), p| (a.min(*p), b.max(*p)));
            left = vec![a, Vec2::new(b.x, a.y), b, Vec2::new(a.x, b.y)];
            break;
        };
        match step {
            Step::Drop(i) => drop(left.remove(i)),
            Step::Extend(i, to) => {
                left[i] = to;
                left.remove((i + 1) % left.len());
            }
        }
    }
    left.into_iter().map(|p| p / CELLS as f32).collect()
}

/// The convex hull of some points, counter-clockwise (Andrew's monotone chain, 1979).
fn convex(points: &[Vec2]) -> Vec<Vec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter().copied());
    hull.extend(half(&mut sorted.iter().rev().copied()));
    hull
}

/// A step that leaves an outline one corner less.
enum Step {
    /// Goes past a corner that goes in.
    Drop(usize),
    /// Moves a corner there, and drops the next.
    Extend(usize, Vec2),
}

/// The smallest bay that can go: its area and the corner that goes in.
fn smallest_bay(outline: &[Vec2]) -> Option<(f32, usize)> {
    let count = outline.len();
    let mut best: Option<(f32, usize)> = None;
    for i in 0..count {
        let corners = [i + count - 1, i, i + 1];
        let [a, b, c] = corners.map(|k| outline[k % count]);
        let area = (b - a).perp_dot(c - b) * -0.5;
        let is_free = || area == 0.0 || is_clear(outline, [a, c, b], &corners);
        if area >= 0.0 && best.is_none_or(|b| area < b.0) && is_free() {
            best = Some((area, i));
        }
    }
    best
}

/// The step that adds the least area and lets the outline not touch itself.
fn cheapest(outline: &[Vec2], low: Vec2, high: Vec2) -> Option<Step> {
    let count = outline.len();
    let at = |i: usize| outline[i % count];
    let mut best = smallest_bay(outline).map(|(area, i)| (area, Step::Drop(i)));
    for i in 0..count {
        // Both ends of an edge stand out, and its neighbours meet beyond it.
        let (a, b, c, d) = (at(i + count - 1), at(i), at(i + 1), at(i + 2));
        let (along, back) = (b - a, c - d);
        let (meet, turn, next) = (along.perp_dot(back), along.perp_dot(c - b), (c - b).perp_dot(d - c));
        if turn <= 0.0 || next <= 0.0 || meet >= 0.0 {
            continue;
        }
        let p = b + along * ((c - b).perp_dot(back) / meet);
        let area = (c - b).perp_dot(p - b).abs() * 0.5;
        let inside = p.cmpge(low).all() && p.cmple(high).all();
        if inside && best.as_ref().is_none_or(|b| area < b.0) && is_clear(outline, [b, p, c], &[i, i + 1]) {
            best = Some((area, Step::Extend(i, p)));
        }
    }
    best.map(|b| b.1)
}

/// Whether no other corner of an outline lies in a triangle, and no edge goes through the two of its sides that start at its
/// second corner; `own` are the corners that are the triangle's.
fn is_clear(outline: &[Vec2], [a, b, c]: [Vec2; 3], own: &[usize]) -> bool {
    let count = outline.len();
    let is_own = |i: usize| own.iter().any(|o| o % count == i % count);
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p);
    let facing = side(a, b, c);
    let holds = |p: Vec2| [(a, b), (b, c), (c, a)].iter().all(|(q, r)| side(*q, *r, p) * facing >= 0.0);
    let crosses = |p: Vec2, q: Vec2| {
        [(a, b), (b, c)]
            .iter()
            .any(|(r, s)| side(p, q, *r) * side(p, q, *s) < 0.0 && side(*r, *s, p) * side(*r, *s, q) < 0.0)
    };
    (0..count).all(|i| {
        let (p, q) = (outline[i], outline[(i + 1) % count]);
        let away = is_own(i) || !holds(p);
        away && (is_own(i) || is_own(i + 1) || !crosses(p, q))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::leaf_maps;
    use crate::base::Seed;
    use crate::preset::plan::LeafShape;

    fn picture(edge: u32, solid: impl Fn(u32, u32) -> bool) -> Maps {
        let count = (edge * edge) as usize;
        let alpha = |i: u32| if solid(i % edge, i / edge) { 255 } else { 0 };
        Maps {
            width: edge,
            height: edge,
            color: (0..edge * edge).map(|i| [0, 0, 0, alpha(i)]).collect(),
            normal: vec![[128, 128, 255]; count],
            orm: vec![[255; 3]; count],
        }
    }

    /// Corners of solid texels that the triangles of a cut don't hold.
    fn lost(maps: &Maps, cut: &CardCut, folded: bool) -> usize {
        let triangles = cut.triangles(folded);
        let holds = |p: Vec2| {
            let inside = |[a, b, c]: &[Vec2; 3]| {
                [(a, b), (b, c), (c, a)].iter().all(|(q, r)| (**r - **q).perp_dot(p - **q) >= -1e-6)
            };
            triangles.iter().any(inside)
        };
        let edge = maps.width as f32;
        (0..maps.width * maps.height)
            .filter(|&i| maps.color[i as usize][3] >= 128)
            .flat_map(|i| [(0, 0), (1, 0), (0, 1), (1, 1)].map(|d| (i % maps.width + d.0, i / maps.width + d.1)))
            .filter(|&(x, y)| !holds(Vec2::new(x as f32 / edge, 1.0 - y as f32 / edge)))
            .count()
    }

    #[test]
    fn cuts_hold_every_solid_texel_and_keep_to_their_corners() {
        let mut pictures: Vec<Maps> = [LeafShape::Oak, LeafShape::Willow, LeafShape::Pine, LeafShape::Ash]
            .map(|shape| leaf_maps(shape, [0.2, 0.4, 0.1], 0.3, 96, 0, Seed::new(3)))
            .to_vec();
        // Two specks, a ring, a spiral-like comb, noise.
        pictures.push(picture(64, |x, y| (x, y) == (3, 60) || (x, y) == (60, 2)));
        pictures.push(picture(64, |x, y| (200..400).contains(&((x as i32 - 32).pow(2) + (y as i32 - 32).pow(2)))));
        pictures.push(picture(64, |x, y| x % 16 < 4 || y > 56));
        // So much of it that its outline is given up.
        pictures.push(picture(128, |x, y| (x % 2 == 0 && y % 4 == 0) || (x % 4 == 1 && y == 64)));
        pictures.push(picture(50, |x, y| Seed::new(1).at(u64::from(y * 50 + x)).unit() < 0.02));
        for (k, maps) in pictures.iter().enumerate() {
            for corners in [8, 12, 20, 32] {
                let cut = card_cut(maps, corners);
                for folded in [false, true] {
                    assert_eq!(lost(maps, &cut, folded), 0, "picture {k}, {corners} corners, folded {folded}");
                }
                let [flat, both, far] = cut.corners();
                assert!(flat <= corners as usize && both <= corners as usize && far <= FAR_CORNERS, "{k}");
                assert!(cut.areas().iter().all(|area| *area > 0.0 && *area <= 1.0 + 1e-5), "{k} {:?}", cut.areas());
            }
        }
    }

    #[test]
    fn a_disc_is_cut_close_and_more_corners_cut_closer() {
        let disc = picture(256, |x, y| (x as i32 - 128).pow(2) + (y as i32 - 128).pow(2) < 100 * 100);
        let share = std::f32::consts::PI * 100.0 * 100.0 / (256.0 * 256.0);
        let area = |corners| card_cut(&disc, corners).areas()[0];
        assert!(area(8) < share * 1.2 && area(16) < share * 1.11, "{} {} of {share}", area(8), area(16));
        assert!(area(16) < area(8));
    }

    #[test]
    fn bays_stay_open() {
        // An L: its hull has half again the area.
        let bent = picture(128, |x, y| x < 30 || y >= 98);
        let share = (128.0 * 30.0 + 98.0 * 30.0) / (128.0 * 128.0);
        assert!(card_cut(&bent, 12).areas()[0] < share * 1.15, "{}", card_cut(&bent, 12).areas()[0]);
    }

    #[test]
    fn pictures_of_nothing_are_whole_cards() {
        assert_eq!(card_cut(&picture(32, |_, _| false), 12), whole_card());
        let none = Maps { width: 0, height: 0, color: vec![], normal: vec![], orm: vec![] };
        assert_eq!(card_cut(&none, 12), whole_card());
        assert_eq!(card_cut(&picture(32, |_, _| true), 12).areas(), [1.0; 3]);
        assert!(card_cuts(&[picture(8, |_, _| true)], LeafCards::Bent).is_empty());
    }
}
