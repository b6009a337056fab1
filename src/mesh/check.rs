//! What can be wrong with a mesh, in one function that the tests of every later stage call.

use std::collections::BTreeMap;

use glam::Vec3;

use super::Mesh;
use crate::base::math;

/// Everything that is wrong with a mesh, one line a kind of problem with the first place that has it; empty when it is
/// sound: arrays of equal length (tangents and tiles may be absent), whole triangles, indices in range, finite numbers,
/// unit normals and tangents within 1e-3, tangents at right angles to normals, signs of ±1, no triangle with two equal
/// corners or no area, no vertex that no triangle uses. Linear.
#[must_use]
pub fn problems(mesh: &Mesh) -> Vec<String> {
    let count = mesh.positions.len();
    let mut found = Vec::new();
    let mut length = |name: &str, len: usize, optional: bool| {
        if len != count && !(optional && len == 0) {
            found.push(format!("{len} {name} for {count} positions"));
        }
    };
    length("normals", mesh.normals.len(), false);
    length("tangents", mesh.tangents.len(), true);
    length("uvs", mesh.uvs.len(), false);
    length("occlusion values", mesh.occlusion.len(), false);
    length("tiles", mesh.tiles.len(), true);
    length("chains", mesh.chains.len(), true);
    if !mesh.indices.len().is_multiple_of(3) {
        found.push(format!("{} indices are no whole triangles", mesh.indices.len()));
    }
    let mut first = |what: &str, at: Option<usize>| {
        if let Some(at) = at {
            found.push(format!("{what}, first at {at}"));
        }
    };
    first("a position is not finite", mesh.positions.iter().position(|p| !p.is_finite()));
    first("a uv is not finite", mesh.uvs.iter().position(|p| !p.is_finite()));
    // Both are false for NaN, so that it counts as a problem.
    let is_small = |v: f32| v.abs() < 1e-3;
    let is_unit = |v: glam::Vec3| is_small(v.length() - 1.0);
    first("a normal is not unit", mesh.normals.iter().position(|&n| !is_unit(n)));
    let xyz = |t: &[f32; 4]| glam::Vec3::new(t[0], t[1], t[2]);
    first("a tangent is not unit", mesh.tangents.iter().position(|t| !is_unit(xyz(t))));
    first("a tangent's sign is not 1 or -1", mesh.tangents.iter().position(|t| t[3].abs() != 1.0));
    first(
        "a tangent leans on its normal",
        mesh.tangents.iter().zip(&mesh.normals).position(|(t, n)| !is_small(xyz(t).dot(*n))),
    );
    let outside = mesh.indices.iter().position(|&i| i as usize >= count);
    first("an index is out of range", outside);
    if outside.is_none() {
        let flat = mesh.indices.chunks_exact(3).position(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize].as_dvec3());
            let (u, v) = (b - a, c - a);
            let longest = u.length_squared().max(v.length_squared()).max((c - b).length_squared());
            // Twice the area over the longest edge is the height: none to speak of next to the edge, or none at all.
            let height = u.cross(v).length();
            height <= longest * 1e-6 || height.is_nan()
        });
        first("a triangle has no area", flat);
        let mut is_used = vec![false; count];
        for &i in &mesh.indices {
            is_used[i as usize] = true;
        }
        first("no triangle uses a vertex", is_used.iter().position(|is_used| !is_used));
    }
    found
}

/// How a mesh closes, its vertices joined where they are in one place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Closure {
    /// Loops of open edges: one for each tube's base that lies in its parent's wood ([`fork_gaps`]) or on the ground.
    pub openings: usize,
    /// Edges of more than two triangles, or of two that are wound against each other.
    pub faulty_edges: usize,
    /// Triangles that face away from the normals of all their corners.
    pub inside_out: usize,
}

/// Looks at every edge of a sound mesh; n log n.
#[must_use]
pub fn closure(mesh: &Mesh) -> Closure {
    let mut places: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    let joined: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = places.len() as u32;
            // -0 and 0 are one place.
            *places.entry((*p + 0.0).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut edges: BTreeMap<(u32, u32), (u32, u32)> = BTreeMap::new();
    let mut found = Closure::default();
    for t in mesh.indices.as_chunks::<3>().0 {
        for (i, j) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (i, j) = (joined[i as usize], joined[j as usize]);
            let uses = edges.entry((i.min(j), i.max(j))).or_default();
            if i < j { uses.0 += 1 } else { uses.1 += 1 }
        }
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a);
        found.inside_out += usize::from(t.iter().all(|&i| mesh.normals[i as usize].dot(face) < 0.0));
    }
    // Open edges hang together in loops.
    let mut sets: Vec<u32> = (0..places.len() as u32).collect();
    fn find(sets: &mut [u32], mut i: u32) -> u32 {
        while sets[i as usize] != i {
            sets[i as usize] = sets[sets[i as usize] as usize];
            i = sets[i as usize];
        }
        i
    }
    let mut ends: Vec<u32> = Vec::new();
    for (&(i, j), &uses) in &edges {
        match uses {
            (1, 1) => {}
            (1, 0) | (0, 1) => {
                let (a, b) = (find(&mut sets, i), find(&mut sets, j));
                sets[a.max(b) as usize] = a.min(b);
                ends.push(i);
            }
            _ => found.faulty_edges += 1,
        }
    }
    let mut loops: Vec<u32> = ends.into_iter().map(|i| find(&mut sets, i)).collect();
    loops.sort_unstable();
    loops.dedup();
    found.openings = loops.len();
    found
}

/// How far the base of each branch, where it is open, lies outside of the wood that bears it, metres: 0 where that encloses all of
/// it; none for stems and for branches that are closed. `mesh` is of a plant's wood, chains included, and `parents` are that plant's.
/// Each branch is looked at against all skins below it, stems going on into the ground.
#[must_use]
pub fn fork_gaps(mesh: &Mesh, parents: &[Option<u32>]) -> Vec<Option<f32>> {
    let mut skins: Vec<Vec<[Vec3; 3]>> = vec![Vec::new(); parents.len()];
    let mut rims: Vec<BTreeMap<[[u32; 3]; 2], [Vec3; 2]>> = vec![BTreeMap::new(); parents.len()];
    let bits = |p: Vec3| (p + 0.0).to_array().map(f32::to_bits);
    for t in mesh.indices.as_chunks::<3>().0 {
        let chain = mesh.chains[t[0] as usize] as usize;
        let corners = t.map(|i| mesh.positions[i as usize]);
        skins[chain].push(corners);
        for [i, j] in [[0, 1], [1, 2], [2, 0]] {
            let (a, b) = (bits(corners[i]), bits(corners[j]));
            // An edge that is passed both ways is closed.
            if rims[chain].remove(&[b, a]).is_none() {
                rims[chain].insert([a, b], [corners[i], corners[j]]);
            }
        }
    }
    for ((skin, rim), parent) in skins.iter_mut().zip(&rims).zip(parents) {
        let down = if parent.is_none() { Vec3::NEG_Y } else { Vec3::ZERO };
        let centre = rim.values().map(|edge| edge[0]).sum::<Vec3>() / rim.len().max(1) as f32 + down;
        for &[a, b] in rim.values() {
            skin.push([b + down, a + down, centre]);
            if parent.is_none() {
                skin.extend([[b, a, a + down], [b, a + down, b + down]]);
            }
        }
    }
    let above = |chain: u32| parents[chain as usize];
    let gap = |(parent, rim): (&Option<u32>, &BTreeMap<_, [Vec3; 2]>)| {
        let out = |[place, _]: &[Vec3; 2]| {
            let skins = std::iter::successors(*parent, |&chain| above(chain)).map(|chain| &skins[chain as usize]);
            skins.map(|skin| outside(*place, skin)).fold(f32::INFINITY, f32::min)
        };
        (parent.is_some() && !rim.is_empty()).then(|| rim.values().map(out).fold(0.0, f32::max))
    };
    parents.iter().zip(&rims).map(gap).collect()
}

/// How far a place lies outside of a closed skin, metres: 0 inside.
fn outside(place: Vec3, skin: &[[Vec3; 3]]) -> f32 {
    // The solid angle of what is around it (Van Oosterom and Strackee 1983).
    let mut angle = 0.0;
    let mut near = f32::INFINITY;
    for &[a, b, c] in skin {
        let [u, v, w] = [a, b, c].map(|p| (p - place).as_dvec3());
        let (x, y, z) = (u.length(), v.length(), w.length());
        let volume = u.dot(v.cross(w));
        angle += 2.0 * math::atan2_64(volume, x * y * z + u.dot(v) * z + v.dot(w) * x + w.dot(u) * y);
        near = near.min(to_triangle(place, [a, b, c]));
    }
    if angle > std::f64::consts::TAU { 0.0 } else { near }
}

/// Distance to a triangle (Ericson 2004, ch. 5).
fn to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let edge = |a: Vec3, b: Vec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a.lerp(b, t))
    };
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| (to - from).cross(p - from).dot(normal) >= 0.0);
    let rim = edge(a, b).min(edge(b, c)).min(edge(c, a));
    if inside { rim.min((p - a).dot(normal.normalize_or_zero()).abs()) } else { rim }
}
