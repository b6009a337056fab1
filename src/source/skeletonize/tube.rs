//! The fast way: a piece of surface that is evidently a tube gives its axis by its rings.
//!
//! Most tools sweep a ring of vertices along each branch. Seen from one end of such a skin, the vertices at one, two,
//! three edges' distance are its rings, whatever the number of sides and wherever they were cut into triangles. The
//! test is that alone: every such layer is one closed round of three vertices or more, about equally far from its middle;
//! the last may be a single vertex, where a cone or a cap ends. No name, order or grid of the file is believed. What
//! fails the test goes to the contraction. Linear in vertices.
//!
//! A ring's middle is the centroid of its outline, so that unequal sides don't draw it aside; its radius the mean
//! distance of its vertices: that is what tools sweep, however few sides a twig has (but see `facets`).

use glam::DVec3;

use super::facets;
use super::surface::{Neighbours, Surface};
use crate::source::import::limb::Limb;

/// Most that the distances of a ring's vertices from its middle may scatter, a share of their mean.
const SCATTER: f64 = 0.4;
/// Least area of a ring, in squares of its radius: a triangle's is 1.3.
const LEAST_AREA: f64 = 0.5;
/// Rings of less than this share of the widest are tips, where rounding makes any shape.
const TIP: f64 = 0.1;
/// What a point is taken for, a share of the widest ring: an axis has wood everywhere.
const POINT: f64 = 0.02;
/// Rounds that are thinner, in the same measure, are points.
const NOTHING: f64 = 1e-4;
/// Least length of an axis over its greatest radius: a disc's layers are rings too.
const SLENDER: f64 = 0.8;
/// Cosine between triangles of one flat face.
const FLAT: f64 = 0.9995;
/// How far corners of a flat face lie off its plane, a share of the skin's length.
const LEVEL: f64 = 1e-3;
/// Most triangles of a closed skin whose flat faces are looked at.
const MOST_BOXED: usize = 20_000;
/// Most flat faces at a corner that are tried.
const MOST_FACES: usize = 6;
/// Most apexes of a closed skin from which layers are tried.
const MOST_APEXES: usize = 4;

/// The axis of a tube, from one end to the other, and how far its faces are from it, as a share of the distance of its
/// vertices; none when the surface isn't evidently one.
pub(super) fn tube(surface: &Surface) -> Option<(Limb, f64)> {
    let neighbours = surface.neighbours();
    let loops = open_ends(&neighbours)?;
    let starts: Vec<Vec<u32>> = if loops.is_empty() { apexes(surface, &neighbours) } else { loops };
    let found = starts.iter().find_map(|start| axis(surface, &neighbours, start));
    if found.is_some() || surface.triangles.len() > MOST_BOXED || starts.iter().any(|start| start.len() > 1) {
        return found;
    }
    // A closed tube with flat ends begins with all of one of them. Seen from a flat side of its own it is a tube too, but a
    // wider one than it is long.
    let slender = |limb: &Limb| {
        let widest = limb.nodes.iter().fold(f64::MIN_POSITIVE, |w, n| w.max(n.radius));
        limb.nodes.windows(2).map(|n| n[0].position.distance(n[1].position)).sum::<f64>() / widest
    };
    let ends = starts[..starts.len().min(2)].iter().flat_map(|start| flat_faces(surface, start[0]));
    let found = ends.filter_map(|start| axis(surface, &neighbours, &start));
    found.max_by(|a, b| slender(&a.0).total_cmp(&slender(&b.0)))
}

/// The vertices of each flat face that a vertex is a corner of.
fn flat_faces(surface: &Surface, corner: u32) -> Vec<Vec<u32>> {
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| surface.positions[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut faces: Vec<DVec3> = Vec::new();
    for t in surface.triangles.iter().filter(|t| t.contains(&corner)) {
        let n = normal(t);
        if faces.len() < MOST_FACES && faces.iter().all(|f| f.dot(n).abs() < FLAT) {
            faces.push(n);
        }
    }
    let at = surface.positions[corner as usize];
    let longest = surface.positions.iter().fold(0.0_f64, |m, p| m.max(p.distance(at)));
    let on = |v: u32, n: DVec3| (surface.positions[v as usize] - at).dot(n).abs() <= longest * LEVEL;
    let all = |n: DVec3| {
        let level = surface.triangles.iter().filter(|t| normal(t).dot(n).abs() >= FLAT && t.iter().all(|&v| on(v, n)));
        let mut vertices: Vec<u32> = level.flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    };
    faces.into_iter().map(all).collect()
}

/// The vertices of each open end, at most two; none when the border isn't made of that many simple rounds.
fn open_ends(neighbours: &Neighbours) -> Option<Vec<Vec<u32>>> {
    let border = |v: u32| neighbours[v as usize].iter().filter(|n| n.1 == 1).map(|n| n.0);
    let mut seen = vec![false; neighbours.len()];
    let mut loops = Vec::new();
    for v in 0..neighbours.len() as u32 {
        if seen[v as usize] || border(v).next().is_none() {
            continue;
        }
        let mut round = Vec::new();
        let mut at = v;
        loop {
            seen[at as usize] = true;
            round.push(at);
            if border(at).count() != 2 {
                return None;
            }
            match border(at).find(|&n| !seen[n as usize]) {
                Some(next) => at = next,
                None => break,
            }
        }
        loops.push(round);
        if loops.len() > 2 {
            return None;
        }
    }
    Some(loops)
}

/// Vertices where a closed tube may end: those of most edges, and those farthest apart.
fn apexes(surface: &Surface, neighbours: &Neighbours) -> Vec<Vec<u32>> {
    let positions = &surface.positions;
    let middle = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
    let far = |from: DVec3| {
        let farther = |a: u32, b: u32| {
            let distance = |v: u32| positions[v as usize].distance_squared(from);
            if distance(b) > distance(a) { b } else { a }
        };
        (0..positions.len() as u32).reduce(farther)
    };
    let Some(first) = far(middle) else { return Vec::new() };
    let second = far(positions[first as usize]).unwrap_or(first);
    let mut starts = vec![first, second];
    let mut by_valence: Vec<u32> = (0..positions.len() as u32).collect();
    by_valence.sort_by_key(|&v| (std::cmp::Reverse(neighbours[v as usize].len()), v));
    starts.extend(by_valence.into_iter().take(MOST_APEXES - 2));
    starts.into_iter().map(|v| vec![v]).collect()
}

/// The middles of the layers from `start` on, if all are rings.
fn axis(surface: &Surface, neighbours: &Neighbours, start: &[u32]) -> Option<(Limb, f64)> {
    let mut depth = vec![u32::MAX; surface.positions.len()];
    for &v in start {
        depth[v as usize] = 0;
    }
    let mut layer = start.to_vec();
    let mut nodes: Vec<(DVec3, f64)> = Vec::new();
    let mut scatter: Vec<f64> = Vec::new();
    let mut level = 0;
    let mut reached = 0;
    let (mut faces, mut corners) = (0.0, 0.0);
    while !layer.is_empty() {
        reached += layer.len();
        let mut next: Vec<u32> = Vec::new();
        for &v in &layer {
            for &(n, _) in &neighbours[v as usize] {
                if depth[n as usize] == u32::MAX {
                    depth[n as usize] = level + 1;
                    next.push(n);
                }
            }
        }
        let at_end = level == 0 || next.is_empty();
        let Ring { middle, radius, spread, outline } = ring(surface, neighbours, &depth, &layer, level, at_end)?;
        if let Some(outline) = outline {
            (faces, corners) = (faces + outline, corners + radius);
        }
        nodes.push((middle, radius));
        scatter.push(spread);
        layer = next;
        level += 1;
    }
    if reached != surface.positions.len() || nodes.len() < 2 {
        return None;
    }
    let widest = nodes.iter().fold(0.0_f64, |w, n| w.max(n.1));
    let length: f64 = nodes.windows(2).map(|n| n[0].0.distance(n[1].0)).sum();
    let round = nodes.iter().zip(&scatter).all(|(n, &s)| n.1 < widest * TIP || s <= SCATTER * n.1);
    if !round || length < widest * SLENDER {
        return None;
    }
    smooth_caps(&mut nodes);
    // A point gets some thickness, no more than is beside it: leaders of tall trees taper by more than [`POINT`].
    let is_point = |radius: f64| radius < widest * NOTHING;
    let thin = nodes.iter().map(|n| n.1).filter(|&r| !is_point(r)).fold(widest * POINT, f64::min);
    nodes.iter_mut().filter(|node| is_point(node.1)).for_each(|node| node.1 = thin);
    Some((Limb::path(&nodes), if corners > 0.0 { faces / corners } else { 1.0 }))
}

/// A layer of vertices.
struct Ring {
    middle: DVec3,
    /// Mean distance of the vertices, and its standard deviation.
    radius: f64,
    spread: f64,
    /// Mean distance of the edges between them, where it is known which they are.
    outline: Option<f64>,
}

/// A layer that is one closed round, or, at an end, a single vertex or a round with chords across it.
fn ring(
    surface: &Surface,
    neighbours: &Neighbours,
    depth: &[u32],
    layer: &[u32],
    level: u32,
    at_end: bool,
) -> Option<Ring> {
    let positions = &surface.positions;
    if let [v] = *layer {
        return at_end.then_some(Ring { middle: positions[v as usize], radius: 0.0, spread: 0.0, outline: None });
    }
    if layer.len() < 3 {
        return None;
    }
    let beside = |v: u32| neighbours[v as usize].iter().map(|n| n.0).filter(|&n| depth[n as usize] == level);
    let simple = layer.iter().all(|&v| beside(v).count() == 2);
    if !simple && !at_end {
        return None;
    }
    let (mut middle, mut area) = (DVec3::ZERO, DVec3::ZERO);
    let mut edges: Vec<(DVec3, DVec3)> = Vec::new();
    if simple {
        // Round the ring once: all of it must be on one round.
        let (mut from, mut at) = (layer[0], beside(layer[0]).next()?);
        let mut steps = 1;
        let mut outline = 0.0;
        loop {
            let (a, b) = (positions[from as usize], positions[at as usize]);
            let length = a.distance(b);
            edges.push((a, b));
            middle += (a + b) * (0.5 * length);
            let corner = positions[layer[0] as usize];
            area += (a - corner).cross(b - corner) * 0.5;
            outline += length;
            if at == layer[0] {
                break;
            }
            let on = beside(at).find(|&n| n != from)?;
            (from, at) = (at, on);
            steps += 1;
        }
        if steps != layer.len() {
            return None;
        }
        middle = if outline > 0.0 { middle / outline } else { positions[layer[0] as usize] };
    } else {
        middle = layer.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / layer.len() as f64;
    }
    let count = layer.len() as f64;
    let radii = || layer.iter().map(|&v| positions[v as usize].distance(middle));
    let radius = radii().sum::<f64>() / count;
    if simple && area.length() < LEAST_AREA * radius * radius {
        // A slit, such as the outline of a sliver: as far about as its radius.
        return Some(Ring { middle, radius, spread: radius, outline: None });
    }
    let variance = radii().map(|r| (r - radius) * (r - radius)).sum::<f64>() / count;
    let length: f64 = edges.iter().map(|(a, b)| a.distance(*b)).sum();
    let distance = |(a, b): &(DVec3, DVec3)| facets::mean_distance(middle, *a, *b) * a.distance(*b);
    let outline = (length > 0.0).then(|| edges.iter().map(distance).sum::<f64>() / length);
    Some(Ring { middle, radius, spread: variance.sqrt(), outline })
}

/// The middle of a flat cap is no end of the wood: it takes the place and radius of the ring around it.
fn smooth_caps(nodes: &mut Vec<(DVec3, f64)>) {
    for _ in 0..2 {
        let n = nodes.len();
        if n > 2 {
            let ((cap, r), (ring, wide)) = (nodes[n - 1], nodes[n - 2]);
            if r == 0.0 && cap.distance(ring) < wide * 0.3 {
                nodes.pop();
            }
        }
        nodes.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;

    #[test]
    fn a_swept_ring_gives_back_its_axis_whatever_its_sides() {
        for sides in [3, 4, 5, 8, 17] {
            let path = [DVec3::ZERO, DVec3::Y, DVec3::new(0.3, 2.0, 0.0), DVec3::new(0.5, 3.0, 0.2)];
            let surface = shapes::tube(&path, &[0.3, 0.25, 0.2, 0.1], sides);
            let (limb, faces) = tube(&surface).unwrap();
            let inner = libm::cos(std::f64::consts::PI / f64::from(sides));
            assert!(faces > inner && faces < 1.0, "{sides} {faces}");
            assert_eq!(limb.nodes.len(), 4);
            let forward = limb.nodes[0].position.length() < 1e-6;
            for (k, node) in limb.nodes.iter().enumerate() {
                let k = if forward { k } else { 3 - k };
                assert!(node.position.distance(path[k]) < 1e-6, "{sides} {k}");
                assert!((node.radius - [0.3, 0.25, 0.2, 0.1][k]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_leader_is_as_thin_as_it_is_and_a_point_as_what_is_beside_it() {
        let path: Vec<DVec3> = (0..5).map(|i| DVec3::Y * f64::from(i) * 5.0).collect();
        for (radii, end) in [
            ([0.4, 0.2, 0.05, 0.003, 0.001], 0.001),
            ([0.4, 0.2, 0.05, 0.003, 0.0], 0.003),
            ([0.4, 0.3, 0.2, 0.1, 0.0], 0.008),
        ] {
            let (limb, _) = tube(&shapes::tube(&path, &radii, 6)).unwrap();
            let thinnest = limb.nodes.iter().map(|node| node.radius).fold(f64::MAX, f64::min);
            assert!((thinnest - end).abs() < 1e-6, "{radii:?}: {thinnest}");
        }
    }

    #[test]
    fn a_closed_tube_with_flat_ends_is_one_from_end_to_end() {
        let path = [DVec3::ZERO, DVec3::new(0.1, 2.0, 0.0), DVec3::new(0.5, 4.0, 0.2)];
        for sides in [3, 4, 7] {
            let surface = super::super::cap::closed(&shapes::tube(&path, &[0.3, 0.25, 0.2], sides));
            let (limb, _) = tube(&surface).unwrap();
            let forward = limb.nodes[0].position.y < 1.0;
            for (k, place) in path.iter().enumerate() {
                let node = limb.nodes[if forward { k } else { 2 - k }];
                assert!(node.position.distance(*place) < 0.02, "{sides} {k} {}", node.position);
                assert!((node.radius - [0.3, 0.25, 0.2][k]).abs() < 0.02, "{sides} {k} {}", node.radius);
            }
        }
    }

    #[test]
    fn discs_and_forks_are_no_tubes() {
        let disc = shapes::disc(12, 5);
        assert!(tube(&disc).is_none());
        assert!(tube(&shapes::fork()).is_none());
    }
}
