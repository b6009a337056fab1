//! Figures of imported leaves, against the meshes themselves.
//!
//! The truth is computed here from the file's triangles alone: what hangs together by equal positions in the parts that are
//! known to be leaves is one leaf, with its own middle, area vector and extents. Nothing of the library's telling apart is
//! used for it.

use std::collections::BTreeMap;
use std::path::Path;

use glam::Vec3;
use treewright::plant::{Leaf, Plant, Pose, Posed};
use treewright::preset::plan::ImportHeight;
use treewright::source::foliage::{self, Overrides};
use treewright::source::scene::{Files, Part, Scene, read, refers};
use treewright::source::skeletonize::{Method, SkeletonParams, Wood, skeletonize};

use crate::Figure;

/// How the leaves of a file are known.
enum Known {
    /// By the place of their part in the file.
    Parts(&'static [usize]),
    /// By green vertices.
    Green,
}

/// The meshes with leaf cards or outlines; pyhelios' olive leaves have two sides, of which one counts.
const MESHES: [(&str, Known); 9] = [
    ("eztree_oak_medium.glb", Known::Parts(&[1])),
    ("eztree_pine_medium.glb", Known::Parts(&[1])),
    ("eztree_aspen_small.glb", Known::Parts(&[1])),
    ("tg_acer.glb", Known::Parts(&[1])),
    ("tg_lombardy_poplar.glb", Known::Parts(&[1])),
    ("tg_douglas_fir.ply", Known::Green),
    ("scatter_pine_tree.glb", Known::Parts(&[1])),
    ("pyhelios_olive/olive_900.obj", Known::Parts(&[1])),
    ("pyhelios_walnut/walnut_365.obj", Known::Parts(&[0])),
];

/// Prints them for all meshes of the data folder.
pub(crate) fn print(data: &Path) {
    for (file, known) in &MESHES {
        if let Some((scene, plant, place)) = import(&data.join("mesh").join(file)) {
            compare(file, &scene, known, &plant, &place);
        }
    }
}

type Place = Box<dyn Fn(Vec3) -> Vec3>;

fn import(path: &Path) -> Option<(Scene, Plant, Place)> {
    let bytes = std::fs::read(path).ok()?;
    let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let view = |beside: &BTreeMap<String, Vec<u8>>| -> Vec<String> {
        let files: Files<'_> = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        refers(&bytes, &files)
    };
    for _ in 0..3 {
        for name in view(&beside) {
            if let Ok(bytes) = std::fs::read(path.with_file_name(&name)) {
                beside.insert(name, bytes);
            }
        }
    }
    let files: Files<'_> = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    let scene = read(&bytes, "mesh", &files).ok()?;
    let mut parts = foliage::split(&scene, &files, &Overrides::default());
    let wood =
        Wood { positions: std::mem::take(&mut parts.wood_positions), triangles: std::mem::take(&mut parts.wood) };
    let params = SkeletonParams { up: scene.up.0, height: ImportHeight::AsIs, method: Method::ByPiece, around: None };
    let made = skeletonize(&wood, &params).ok()?;
    let plant = foliage::attach(made.plant, &parts, &made.placement, &mut Vec::new());
    let placement = made.placement;
    Some((scene, plant, Box::new(move |p| placement.point(p))))
}

/// A leaf of the file: its corners and its area vector, placed.
struct Truth {
    points: Vec<Vec3>,
    normal: Vec3,
}

/// The leaves of a part: triangles that share positions.
fn truths(part: &Part, green: bool, place: &Place) -> Vec<Truth> {
    let is_leaf = |t: &[u32; 3]| {
        let c = part.colors.get(t[0] as usize);
        !green || c.is_some_and(|c| c[1] > c[0])
    };
    let triangles: Vec<[u32; 3]> = part.triangles.iter().filter(|t| is_leaf(t)).copied().collect();
    let mut known: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    let mut sets: Vec<usize> = (0..triangles.len()).collect();
    for (i, t) in triangles.iter().enumerate() {
        for &v in t {
            let key = part.positions[v as usize].to_array().map(|v| (v + 0.0).to_bits());
            let other = *known.entry(key).or_insert(i);
            let (a, b) = (find(&mut sets, i), find(&mut sets, other));
            sets[a.max(b)] = a.min(b);
        }
    }
    let mut groups: BTreeMap<usize, Truth> = BTreeMap::new();
    for (i, t) in triangles.iter().enumerate() {
        let corners = t.map(|v| place(part.positions[v as usize]));
        let truth =
            groups.entry(find(&mut sets, i)).or_insert_with(|| Truth { points: Vec::new(), normal: Vec3::ZERO });
        truth.points.extend(corners);
        truth.normal += (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    }
    groups.into_values().filter(|t| t.normal.length() > 0.0).collect()
}

pub(crate) fn find(sets: &mut [usize], mut i: usize) -> usize {
    while sets[i] != i {
        sets[i] = sets[sets[i]];
        i = sets[i];
    }
    i
}

/// How far the middle of the rectangle about a leaf's corners, in a card's directions, lies from the card's.
fn off(truth: &Truth, (pose, leaf): &(Pose, &Leaf)) -> Vec3 {
    let [x, y, z] = [pose.frame.x, pose.frame.y, pose.frame.z].map(|axis| extent(truth, pose, axis));
    Vec3::new((x.0 + x.1) * 0.5, (y.0 + y.1) * 0.5 - leaf.size * 0.5, (z.0 + z.1) * 0.5)
}

/// Where a leaf's corners begin and end along an axis, from a card's base.
fn extent(truth: &Truth, pose: &Pose, axis: Vec3) -> (f32, f32) {
    let along = truth.points.iter().map(|p| (*p - pose.position).dot(axis));
    along.fold((f32::MAX, f32::MIN), |(low, high), d| (low.min(d), high.max(d)))
}

fn compare(file: &str, scene: &Scene, known: &Known, plant: &Plant, place: &Place) {
    let truths: Vec<Truth> = match known {
        Known::Parts(parts) => parts.iter().flat_map(|&p| truths(&scene.parts[p], false, place)).collect(),
        Known::Green => scene.parts.iter().flat_map(|p| truths(p, true, place)).collect(),
    };
    let posed: Posed = plant.pose();
    let leaves: Vec<(Pose, &Leaf)> = plant.leaves().iter().map(|l| (posed.leaf(plant, l), l)).collect();
    let middle = |(pose, leaf): &(Pose, &Leaf)| pose.position + pose.frame.y * (leaf.size * 0.5);
    let mut order: Vec<usize> = (0..leaves.len()).collect();
    order.sort_by(|&a, &b| middle(&leaves[a]).x.total_cmp(&middle(&leaves[b]).x));
    let xs: Vec<f32> = order.iter().map(|&i| middle(&leaves[i]).x).collect();
    let (low, high) = truths
        .iter()
        .flat_map(|t| &t.points)
        .chain(posed.positions())
        .fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.y), high.max(p.y)));
    let height = f64::from(high - low);
    let (mut position, mut normal, mut size) = (Vec::new(), Vec::new(), Vec::new());
    // Each leaf is one of the file's: nearest pairs first.
    let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
    for (t, truth) in truths.iter().enumerate() {
        let (a, b) = truth.points.iter().fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(*p), b.max(*p)));
        let (about, long) = ((a + b) * 0.5, (b - a).length());
        let from = xs.partition_point(|x| *x < about.x - long);
        for &i in order[from..].iter().take_while(|&&i| middle(&leaves[i]).x <= about.x + long) {
            // Of crossed leaves with one middle the one that faces the same way.
            let facing = leaves[i].0.frame.z.dot(truth.normal.normalize()).abs();
            let gap = off(truth, &leaves[i]).length() + (1.0 - facing) * long * 0.5;
            if gap < long {
                pairs.push((gap, t, i));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut paired, mut taken) = (vec![false; truths.len()], vec![false; leaves.len()]);
    for (_, t, i) in pairs {
        if paired[t] || taken[i] {
            continue;
        }
        (paired[t], taken[i]) = (true, true);
        let truth = &truths[t];
        let (pose, leaf) = &leaves[i];
        let [x, y] = [pose.frame.x, pose.frame.y].map(|axis| extent(truth, pose, axis));
        position.push(f64::from(off(truth, &leaves[i]).length()) / height);
        let angle = f64::from(
            treewright::base::math::acos(pose.frame.z.dot(truth.normal.normalize()).abs().min(1.0)).to_degrees(),
        );
        normal.push(angle);
        let width = leaf.size * leaf.form.width();
        let one = |is: f32, was: (f32, f32)| f64::from((is / (was.1 - was.0) - 1.0).abs());
        size.push(one(leaf.size, y).max(one(width, x)));
    }
    let how = |what: &str| format!("{file}, {} leaves in the file, {} imported{what}", truths.len(), leaves.len());
    let missing = (leaves.len().max(truths.len()) - position.len()) as f64;
    Figure::new("import.leaf_count_exact", missing, "leaves off", how("")).goal("0").print();
    for (name, mut values, unit, goal) in [
        ("import.leaf_position_error", position, "share of the height", "<= 0.001"),
        ("import.leaf_normal_error", normal, "degrees", "<= 3"),
        ("import.leaf_size_error", size, "share", "<= 0.03"),
    ] {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((values.len().saturating_sub(1) as f64 * share) as usize).copied();
        let Some(worst) = at(1.0) else { continue };
        let middle = at(0.5).unwrap_or(worst);
        let beyond = values.iter().filter(|v| **v > goal.trim_start_matches("<= ").parse().unwrap_or(0.0)).count();
        let how = how(&format!("; worst, {beyond} beyond the goal, median {middle:.6}"));
        Figure::new(name, worst, unit, how).goal(goal).print();
    }
}
