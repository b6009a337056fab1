//! From several fragments to one tree, or to the stems of one shrub.
//!
//! A structure model's parent links are mostly right, but: a second root is a branch that the fit lost; and some files
//! hold links that can't be true (pyhelios writes the row before as the parent of every shoot, metres away). A link is
//! doubted when the gap between a piece and its parent's surface exceeds three times the radii and 2 % of the model's
//! extent; it is given up when other wood costs less than a quarter of that gap. Then each fragment looks for the
//! nearest suitable wood outside itself (`weigh`). Fragments that chose each other in a ring are joined in rounds: of
//! each ring one fragment chooses again outside of all that hangs on the ring, so each round at least halves their
//! number. A further root that stands on the ground beside the first one and rises from it is a stem of its own. Scraps
//! farther away than they are long are dropped.

use glam::DVec3;

use super::foothold;
use super::mend;
use super::nearest::Nearest;
use super::piece::{Piece, Shape};
use crate::base::counted;

/// The share of a named parent's gap below which other wood is believed instead.
const BETTER: f64 = 0.25;
/// Cost of a bridge to wood that holds the point, as a share of the distance to its axis.
const INSIDE: f64 = 0.1;
/// How far a lower order is looked for, as a share of the extent.
const REACH: f64 = 0.05;
/// Least radius of a stem that stands where the first one does, as a share of that one's.
const SHRUB: f64 = 0.3;
/// Most fragments of a ring that look for a way out.
const MOST_TRIES: usize = 8;

/// What was joined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Joined {
    /// Further roots that were bridged.
    roots: usize,
    /// Links that could not be true.
    links: usize,
    /// Stems beside the first.
    stems: usize,
    /// Scraps that were dropped, and their rows.
    scraps: (usize, usize),
    /// The farthest of them, file units.
    farthest: f64,
    /// Branches whose parent's axis passes nearer elsewhere.
    moved: usize,
    /// Branches of nodes that ran inside their parent's wood.
    inside: usize,
}

impl Joined {
    /// In words, for limbs of a mesh: that each of them had to be joined is no news.
    pub(super) fn note_of_limbs(mut self, limbs: usize, scale: f64, notes: &mut Vec<String>) {
        if self.roots > 0 {
            notes.push(format!(
                "{} of wood, {} of them joined to other wood",
                counted(limbs, "piece", "pieces"),
                self.roots
            ));
        }
        (self.roots, self.inside) = (0, 0);
        self.note(scale, notes);
    }

    /// In words; `scale` makes lengths metres.
    pub(super) fn note(&self, scale: f64, notes: &mut Vec<String>) {
        if self.stems > 0 {
            notes.push(format!("{} beside the first", counted(self.stems, "stem", "stems")));
        }
        if self.roots > 0 {
            notes.push(format!("{} bridged to other wood", counted(self.roots, "further root", "further roots")));
        }
        if self.links > 0 {
            notes.push(format!(
                "{} far from the row named as parent: joined to the nearest wood instead",
                counted(self.links, "branch", "branches")
            ));
        }
        if self.moved > 0 {
            notes.push(format!(
                "{} moved to the nearest place on the parent's axis",
                counted(self.moved, "branch", "branches")
            ));
        }
        if self.inside > 0 {
            notes.push(format!(
                "{} along the inside of the parent's wood: now from where its axis is nearest",
                counted(self.inside, "branch ran", "branches ran")
            ));
        }
        if self.scraps.0 > 0 {
            notes.push(format!(
                "{} ({}) dropped, up to {:.2} m from the tree",
                counted(self.scraps.0, "scrap", "scraps"),
                counted(self.scraps.1, "row", "rows"),
                self.farthest * scale
            ));
        }
    }
}

/// Joins all pieces; `order` lists them parents first, and so does the result, without what was dropped. The base of the
/// main stem comes to the origin.
pub(super) fn connect(pieces: &mut [Piece], order: Vec<u32>, shape: Shape) -> (Vec<u32>, Joined) {
    let mut joined = Joined::default();
    let mut moved = Vec::new();
    match shape {
        Shape::Cylinders => moved = foothold::move_along_axes(pieces),
        Shape::Nodes => joined.inside = foothold::out_of_wood(pieces, &order),
    }
    joined.moved = moved.len();
    let extent = Extent::of(pieces);
    let order = if joined.moved + joined.inside > 0 { mend::order(pieces, &mend::roots(pieces)) } else { order };
    let standing = stems(pieces, &order, &extent);
    joined.stems = standing.len() - 1;

    // Fragments: what hangs together by links that are not in doubt.
    let mut heads: Vec<Head> = standing.iter().map(|&i| Head { piece: i, named: None, target: None }).collect();
    for &i in &order {
        let piece = &pieces[i as usize];
        match piece.parent {
            None if standing.contains(&i) => {}
            None => heads.push(Head { piece: i, named: None, target: None }),
            Some(parent) => {
                let p = &pieces[parent as usize];
                let gap = p.distance(piece.start) - p.radius;
                if gap > (3.0 * (p.radius + piece.radius)).max(0.02 * extent.size) {
                    heads.push(Head { piece: i, named: Some((parent, gap)), target: None });
                }
            }
        }
    }
    if heads.len() == standing.len() {
        base_at_origin(pieces, standing[0]);
        return (mend::order(pieces, &standing), joined);
    }
    for head in &heads {
        pieces[head.piece as usize].parent = None;
    }
    let mut fragment = vec![0_u32; pieces.len()];
    for (f, head) in heads.iter().enumerate() {
        fragment[head.piece as usize] = f as u32;
    }
    for &i in &order {
        if let Some(parent) = pieces[i as usize].parent {
            fragment[i as usize] = fragment[parent as usize];
        }
    }

    let nearest = Nearest::new(pieces);
    for (f, head) in heads.iter_mut().enumerate().skip(standing.len()) {
        let found = choose(pieces, &nearest, head.piece, extent.size * REACH, |i| fragment[i as usize] != f as u32);
        head.target = match (head.named, found) {
            (Some((parent, gap)), found) if found.is_none_or(|(_, cost)| cost > gap * BETTER) => Some(parent),
            (_, found) => found.map(|(target, _)| target),
        };
    }
    open_rings(pieces, &nearest, &fragment, &mut heads, extent.size * REACH);
    drop_scraps(pieces, &fragment, &mut heads, &extent, &mut joined);
    for head in &heads {
        pieces[head.piece as usize].parent = head.target;
        let moved = head.target.is_some() && !head.as_named();
        joined.links += usize::from(moved && head.named.is_some());
        joined.roots += usize::from(moved && head.named.is_none());
    }
    // Of a parent that wasn't believed, it doesn't matter where on its axis it was.
    joined.moved = moved.iter().filter(|&&(i, at)| pieces[i].parent == Some(at)).count();
    base_at_origin(pieces, standing[0]);
    (mend::order(pieces, &standing), joined)
}

/// The first piece of a fragment.
#[derive(Clone, Copy, Debug)]
struct Head {
    piece: u32,
    /// The parent that the file names, and the gap to its surface.
    named: Option<(u32, f64)>,
    /// The piece it is joined to; none for stems, and for what is dropped.
    target: Option<u32>,
}

impl Head {
    /// Whether it is joined to what the file names.
    fn as_named(&self) -> bool {
        self.named.is_some_and(|(parent, _)| self.target == Some(parent))
    }
}

/// Where the wood is.
struct Extent {
    low: f64,
    height: f64,
    /// Diagonal of the bounding box.
    size: f64,
}

impl Extent {
    fn of(pieces: &[Piece]) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for piece in pieces {
            low = low.min(piece.start).min(piece.end);
            high = high.max(piece.start).max(piece.end);
        }
        Self { low: low.y, height: high.y - low.y, size: low.distance(high) }
    }
}

/// The roots that stand on the ground, the main stem first: of the low ones that with the most wood.
fn stems(pieces: &[Piece], order: &[u32], extent: &Extent) -> Vec<u32> {
    // Wood and top of all that hangs on a root.
    let mut root = vec![0_u32; pieces.len()];
    let mut wood = vec![0.0_f64; pieces.len()];
    let mut top = vec![f64::NEG_INFINITY; pieces.len()];
    for &i in order {
        let piece = &pieces[i as usize];
        let r = piece.parent.map_or(i, |p| root[p as usize]);
        root[i as usize] = r;
        wood[r as usize] += piece.radius * piece.radius * piece.length();
        top[r as usize] = top[r as usize].max(piece.end.y);
    }
    let roots = mend::roots(pieces);
    let lowest = roots.iter().fold(f64::INFINITY, |y, &i| y.min(pieces[i as usize].start.y));
    let limit = lowest.max(extent.low) + extent.height * 0.2;
    let low = roots.iter().copied().filter(|&i| pieces[i as usize].start.y <= limit);
    let best = low.reduce(|a, b| if wood[b as usize] > wood[a as usize] { b } else { a });
    let most = best.or_else(|| roots.first().copied()).unwrap_or(0);
    let main = foot_below(pieces, &root, most, extent);
    let first = &pieces[main as usize];
    let mut standing = vec![main];
    // A shrub has stems by the dozen; a file with thousands of roots is no shrub.
    const MOST_STEMS: usize = 64;
    for i in roots {
        let piece = &pieces[i as usize];
        let away = piece.start - first.start;
        let beside = DVec3::new(away.x, 0.0, away.z).length();
        let apart = away.y.abs() <= extent.height * 0.05
            && beside > (1.5 * (piece.radius + first.radius)).max(extent.height * 0.01);
        // Stems of a shrub grow out of one place, at one level and of like thickness; a branch starts higher up.
        let out_of_one = away.y.abs() <= extent.height * 0.01 && piece.radius >= first.radius * SHRUB;
        if i != main
            && standing.len() < MOST_STEMS
            && (apart || out_of_one)
            && top[i as usize] - piece.start.y >= extent.height * 0.1
        {
            standing.push(i);
        }
    }
    standing
}

/// The root of what a trunk stands on: where a link is lost low on a trunk, most of the wood hangs on a root in mid-air, which
/// touches the end of what the trunk began as. `root` is the root of each piece.
fn foot_below(pieces: &[Piece], root: &[u32], mut main: u32, extent: &Extent) -> u32 {
    // A trunk may be broken more than once.
    const MOST_BREAKS: usize = 8;
    for _ in 0..MOST_BREAKS {
        let first = &pieces[main as usize];
        let below = pieces.iter().zip(root).find(|(piece, root)| {
            let on = piece.start.lerp(piece.end, piece.nearest(first.start));
            first.start.y - pieces[**root as usize].start.y > extent.height * 0.01
                && piece.radius > 0.5 * first.radius
                && on.distance(first.start) <= piece.radius.max(first.radius)
        });
        match below {
            Some((_, below)) if *below != main => main = *below,
            _ => break,
        }
    }
    main
}

/// The most suitable wood for a fragment's first piece, and its cost: the distance to its surface, more for wood that
/// is thinner than the fragment, above it, or on the side that it grows towards.
///
/// Where the file tells branch orders, wood of a lower order is looked for first, within `reach`: shoots that leave
/// one place would otherwise be joined to one another.
fn choose(
    pieces: &[Piece],
    nearest: &Nearest,
    head: u32,
    reach: f64,
    allowed: impl Fn(u32) -> bool,
) -> Option<(u32, f64)> {
    let order = pieces[head as usize].order;
    let lower = |i: u32| pieces[i as usize].order < order && pieces[i as usize].order != Piece::NONE;
    if order != Piece::NONE
        && let Some(found) = weigh(pieces, nearest, head, |i| allowed(i) && lower(i)).filter(|f| f.1 <= reach)
    {
        return Some(found);
    }
    weigh(pieces, nearest, head, allowed)
}

fn weigh(pieces: &[Piece], nearest: &Nearest, head: u32, allowed: impl Fn(u32) -> bool) -> Option<(u32, f64)> {
    let piece = &pieces[head as usize];
    let along = piece.end - piece.start;
    nearest.find(piece.start, INSIDE, |i| {
        if !allowed(i) {
            return None;
        }
        let other = &pieces[i as usize];
        let foot = other.start.lerp(other.end, other.nearest(piece.start));
        let way = piece.start - foot;
        let distance = way.length();
        let mut cost = (distance - other.radius).max(distance * INSIDE);
        if other.radius < piece.radius * 0.7 {
            cost *= 1.5;
        }
        if distance > other.radius {
            if way.y < 0.0 {
                cost *= 1.25;
            }
            if way.dot(along) < 0.0 {
                cost *= 1.5;
            }
        }
        Some(cost)
    })
}

/// Makes every fragment lead to a stem.
fn open_rings(pieces: &[Piece], nearest: &Nearest, fragment: &[u32], heads: &mut [Head], reach: f64) {
    const UNSEEN: u32 = u32::MAX;
    loop {
        // For each fragment the ring that it leads to, numbered from 1, or 0 where it leads to a stem.
        let mut ring = vec![UNSEEN; heads.len()];
        let mut rings: Vec<Vec<u32>> = Vec::new();
        let next = |f: u32| heads[f as usize].target.map(|t| fragment[t as usize]);
        let mut walk = Vec::new();
        for f in 0..heads.len() as u32 {
            walk.clear();
            let mut at = f;
            let label = loop {
                if ring[at as usize] != UNSEEN {
                    break ring[at as usize];
                }
                // Marked with a label of its own while the walk is under way.
                ring[at as usize] = UNSEEN - 1;
                walk.push(at);
                match next(at) {
                    None => break 0,
                    Some(n) if ring[n as usize] == UNSEEN - 1 => {
                        let from = walk.iter().position(|&w| w == n).unwrap_or(0);
                        rings.push(walk[from..].to_vec());
                        break rings.len() as u32;
                    }
                    Some(n) => at = n,
                }
            };
            for &w in &walk {
                ring[w as usize] = label;
            }
        }
        if rings.is_empty() {
            return;
        }
        let mut changes = Vec::new();
        for (k, members) in rings.iter().enumerate() {
            // The thickest know best where they come from.
            let mut tries: Vec<u32> = members.clone();
            let radius = |f: u32| pieces[heads[f as usize].piece as usize].radius;
            tries.sort_by(|&a, &b| radius(b).total_cmp(&radius(a)).then(a.cmp(&b)));
            tries.truncate(MOST_TRIES);
            let outside = |i: u32| ring[fragment[i as usize] as usize] != k as u32 + 1;
            let found = tries
                .iter()
                .filter_map(|&f| {
                    choose(pieces, nearest, heads[f as usize].piece, reach, outside).map(|(t, cost)| (f, t, cost))
                })
                .min_by(|a, b| a.2.total_cmp(&b.2));
            changes.push((members[0], found));
        }
        for (first, found) in changes {
            // There is always wood outside: the main stem's. Were there none, the ring is left out whole.
            let (f, target) = found.map_or((first, None), |(f, t, _)| (f, Some(t)));
            heads[f as usize].target = target;
        }
    }
}

/// Drops fragments that are farther from the tree than twice their own length and a tenth of its extent, and that
/// nothing else was joined to.
fn drop_scraps(pieces: &[Piece], fragment: &[u32], heads: &mut [Head], extent: &Extent, joined: &mut Joined) {
    let mut length = vec![0.0_f64; heads.len()];
    let mut rows = vec![0_usize; heads.len()];
    for (piece, &f) in pieces.iter().zip(fragment) {
        length[f as usize] += piece.length();
        rows[f as usize] += 1;
    }
    let mut bears = vec![false; heads.len()];
    for head in &*heads {
        if let Some(target) = head.target {
            bears[fragment[target as usize] as usize] = true;
        }
    }
    for (f, head) in heads.iter_mut().enumerate() {
        let Some(target) = head.target.filter(|_| !head.as_named() && !bears[f]) else { continue };
        let gap = pieces[target as usize].distance(pieces[head.piece as usize].start) - pieces[target as usize].radius;
        if gap > (length[f] * 2.0).max(extent.size * 0.1) {
            head.target = None;
            joined.scraps.0 += 1;
            joined.scraps.1 += rows[f];
            joined.farthest = joined.farthest.max(gap);
        }
    }
}

fn base_at_origin(pieces: &mut [Piece], main: u32) {
    let base = pieces[main as usize].start;
    for piece in pieces {
        piece.start -= base;
        piece.end -= base;
    }
}
