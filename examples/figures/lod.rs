//! Levels of detail of the shipped sets, read back from their files and measured against LOD0 by the rasterizer.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::Vec3;
use treewright::bake::View;
use treewright::build::pipeline::{make_set, read_inputs, set_key};
use treewright::build::{Cache, find_presets, load_preset};
use treewright::lod::{Asked, Measured, Reference};
use treewright::mesh::{Mesh, TreeMesh};
use treewright::preset::plan::Lod;

use crate::lod_asset::{Set, read};
use crate::lod_bark::Density;
use crate::lod_table::Against;
use crate::{Figure, root};

/// Views of a measurement.
const VIEWS: u32 = 32;
/// Lines of the screen that sizes are shares of.
const SCREEN: f32 = 1080.0;

/// What was measured of all levels of one kind.
#[derive(Default)]
pub(crate) struct Kind {
    pub(crate) measured: Vec<(String, Measured)>,
    /// IoU of LOD0 with itself a quarter of a pixel aside, of each set's first variant at the same sizes.
    moved: Vec<f64>,
    /// Triangles of the level and of the full one.
    triangles: Vec<(u64, u64)>,
    /// Triangles of cards.
    leaf_triangles: Vec<u64>,
}

/// Whether a part of the figures is wanted: LOD_PARTS names some of sets, bark, mesh, leaf, screen, asset, set, batch, leafy,
/// meshing, three, textures. `table` prints the sets as the README's tables instead, if it is named.
pub(crate) fn wants(part: &str) -> bool {
    std::env::var("LOD_PARTS").map_or(true, |parts| parts.split(',').any(|p| p == part))
}

fn tables() -> bool {
    std::env::var("LOD_PARTS").is_ok() && wants("table")
}

pub(crate) fn print() {
    if wants("sets") || tables() {
        sets();
    }
    if wants("bark") && !wants("sets") {
        bark();
    }
    if wants("mesh") {
        crate::lod_mesh::print();
    }
    if wants("leaf") {
        crate::lod_leaf::print();
    }
    if wants("screen") {
        crate::lod_screen::print();
    }
    crate::lod_speed::print();
    if wants("three") {
        crate::lod_three::print();
    }
    if wants("textures") {
        crate::lod_textures::print();
    }
}

fn sets() {
    let presets = find_presets(&[root().join("presets")]).expect("presets are shipped");
    let only = std::env::var("LOD_SETS").unwrap_or_default();
    let mut kinds: BTreeMap<String, Kind> = BTreeMap::new();
    let mut density = Density::default();
    let mut against = Vec::new();
    for preset in &presets {
        let name = preset.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !only.is_empty() && !only.split(',').any(|o| o == name) {
            continue;
        }
        let loaded = load_preset(preset).expect("the preset is good");
        let inputs = read_inputs(&loaded).expect("its files are there");
        let key = set_key(&loaded.plan, &inputs);
        let files = make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {}).expect("it builds");
        let set = read(&files);
        let of_set = levels(&name, &set, &mut kinds);
        if name == "avenue" {
            against = simplifier(&set);
            // At a tenth simplifiers have no leaves left that they could halve.
            let mut few = loaded.plan.clone();
            few.lods = vec![Lod::Full.into(), Lod::thinned(0.1).into()];
            let key = set_key(&few, &inputs);
            against.extend(simplifier(&read(
                &make_set(&few, &inputs, key, &Cache::default(), &|_| {}).expect("it builds"),
            )));
        }
        if tables() {
            continue;
        }
        each_level(&name, &of_set);
        if name == "avenue" {
            against.iter().for_each(one_against);
        }
        crate::lod_bark::add(&mut density, &name, &set);
        atlas(&name, &set);
    }
    if tables() {
        return crate::lod_table::print(&kinds, &against);
    }
    for (kind, all) in &kinds {
        total(kind, all);
    }
    crate::lod_bark::print(&density);
}

/// The bark of all sets alone: nothing else is made of them than LOD0.
fn bark() {
    let presets = find_presets(&[root().join("presets")]).expect("presets are shipped");
    let mut density = Density::default();
    for preset in &presets {
        let name = preset.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut loaded = load_preset(preset).expect("the preset is good");
        loaded.plan.lods.truncate(1);
        let inputs = read_inputs(&loaded).expect("its files are there");
        let key = set_key(&loaded.plan, &inputs);
        let files = make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {}).expect("it builds");
        crate::lod_bark::add(&mut density, &name, &read(&files));
    }
    crate::lod_bark::print(&density);
}

/// LOD0 against itself, moved by a quarter of a pixel across and up: what a silhouette of so many pixels can tell at all.
fn moved(full: &TreeMesh, reference: &Reference, set: &Set, pixels: u32) -> f64 {
    let ends = |(low, high): (f32, f32), p: &Vec3| (low.min(p.y), high.max(p.y));
    let (low, high) = full.bark.positions.iter().chain(&full.leaf.positions).fold((f32::MAX, f32::MIN), ends);
    let seen = |view: &View| {
        let by = (view.frame.x + view.frame.y) * (0.25 * (high - low) / pixels.max(1) as f32);
        let mut tree = full.clone();
        tree.bark.positions.iter_mut().chain(&mut tree.leaf.positions).for_each(|p| *p += by);
        (Cow::Owned(tree), Cow::Borrowed(&set.wardrobe))
    };
    f64::from(reference.measure_from(&seen, Asked::Silhouette).iou)
}

/// What was measured of a set, by level and kind.
type OfSet = BTreeMap<(usize, String), Vec<Measured>>;

/// Every level of every variant of a set.
fn levels(set_name: &str, set: &Set, kinds: &mut BTreeMap<String, Kind>) -> OfSet {
    let mut of_set = OfSet::new();
    for (v, levels) in set.variants.iter().enumerate() {
        let told = |i: usize| &set.manifest["variants"][v]["levels"][i];
        for i in 1..levels.len() {
            let kind = told(i)["kind"].as_str().unwrap_or("").to_owned();
            let pixels = (levels[i - 1].1 * SCREEN + 0.5) as u32;
            let reference = Reference::new(&levels[0].0, &set.wardrobe, pixels, VIEWS);
            let layout = set.impostors[v].filter(|_| kind == "Impostor");
            let seen = |view: &View| match layout {
                // As its shader shows it.
                Some((layout, [low, high])) => layout.as_seen(view.frame, &set.leaf, (low, high)),
                None => (Cow::Borrowed(&levels[i].0), Cow::Borrowed(&set.wardrobe)),
            };
            let measured = reference.measure_from(&seen, Asked::All);
            of_set.entry((i, kind.clone())).or_default().push(measured);
            let entry = kinds.entry(kind).or_default();
            entry.measured.push((format!("{set_name} {} LOD{i}", v + 1), measured));
            if v == 0 {
                entry.moved.push(moved(&levels[0].0, &reference, set, pixels));
            }
            let triangles = |i: usize| told(i)["triangles"].as_u64().unwrap_or(0);
            entry.triangles.push((triangles(i), triangles(0)));
            entry.leaf_triangles.push(told(i)["leaf_triangles"].as_u64().unwrap_or(0));
        }
    }
    of_set
}

fn each_level(set_name: &str, of_set: &OfSet) {
    for ((level, kind), all) in of_set {
        let s = Summary::of(all.iter());
        let how = format!(
            "{kind}, {} variants at {} to {} pixels, {VIEWS} views: worst {:.3}, coverage {:.3} to {:.3}, FLIP {:.3}, colour {:.3}",
            all.len(),
            s.pixels.0,
            s.pixels.1,
            s.worst,
            s.coverage.0,
            s.coverage.1,
            s.flip,
            s.color
        );
        Figure::new(format!("lod.{set_name}.lod{level}_iou"), s.iou, "share", how).goal(">= 0.90").print();
    }
}

/// What a user would do instead: LOD0 simplified to the triangles of LOD1 by meshoptimizer alone, seen from the same views
/// at the same size.
fn simplifier(set: &Set) -> Vec<Against> {
    // Backs, which are written after all fronts, are but the same again.
    let fronts = |tree: &TreeMesh| {
        let mut tree = tree.clone();
        let Mesh { positions, normals, tangents, uvs, occlusion, indices, .. } = &mut tree.leaf;
        // Also their vertices: simplifiers take places that several share for seams.
        let count = positions.len() / 2;
        positions.truncate(count);
        normals.truncate(count);
        tangents.truncate(count);
        uvs.truncate(count);
        occlusion.truncate(count);
        indices.truncate(indices.len() / 2);
        tree
    };
    let one = |(v, levels): (usize, &Vec<(TreeMesh, f32)>)| {
        let (full, ours) = (&fronts(&levels[0].0), &fronts(&levels[1].0));
        let pixels = (levels[0].1 * SCREEN + 0.5) as u32;
        let to = |mesh: &Mesh, like: &Mesh| {
            let points: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
            let options = meshopt::SimplifyOptions::None;
            let indices = meshopt::simplify_decoder(&mesh.indices, &points, like.indices.len(), 1.0, options, None);
            Mesh { indices, ..mesh.clone() }
        };
        let theirs = TreeMesh { bark: to(&full.bark, &ours.bark), leaf: to(&full.leaf, &ours.leaf) };
        let reference = Reference::new(full, &set.wardrobe, pixels, VIEWS);
        let both = [ours, &theirs].map(|tree| {
            let triangles = (tree.bark.indices.len() + tree.leaf.indices.len()) / 3;
            (triangles, reference.measure(tree, &set.wardrobe), tree.leaf.area() / full.leaf.area())
        });
        Against { tree: format!("avenue {}", v + 1), pixels, both }
    };
    set.variants.iter().enumerate().take(3).map(one).collect()
}

fn one_against(Against { tree, pixels, both }: &Against) {
    for ((triangles, m, area), who) in both.iter().zip(["ladder", "simplifier"]) {
        let how = format!(
            "{tree}, {triangles} triangles at {pixels} pixels: worst {:.3}, coverage {:.3}, FLIP {:.3}, leaf area \
             {area:.3} of LOD0's",
            m.worst_iou, m.coverage, m.flip
        );
        Figure::new(format!("lod.against.{who}_iou"), f64::from(m.iou), "share", how).print();
    }
}

/// Extremes and means of some measurements.
pub(crate) struct Summary {
    pub(crate) pixels: (u32, u32),
    pub(crate) iou: f64,
    pub(crate) worst: f64,
    pub(crate) coverage: (f64, f64),
    pub(crate) flip: f64,
    color: f64,
}

impl Summary {
    pub(crate) fn of<'a>(all: impl Iterator<Item = &'a Measured> + Clone) -> Self {
        let count = all.clone().count().max(1) as f64;
        let mean = |get: fn(&Measured) -> f32| all.clone().map(|m| f64::from(get(m))).sum::<f64>() / count;
        let least = |get: fn(&Measured) -> f32| all.clone().map(|m| f64::from(get(m))).fold(f64::INFINITY, f64::min);
        let most = |get: fn(&Measured) -> f32| all.clone().map(|m| f64::from(get(m))).fold(0.0, f64::max);
        let pixels = all.clone().map(|m| m.pixels);
        Self {
            pixels: (pixels.clone().min().unwrap_or(0), pixels.max().unwrap_or(0)),
            iou: mean(|m| m.iou),
            worst: least(|m| m.worst_iou),
            coverage: (least(|m| m.coverage), most(|m| m.coverage)),
            flip: most(|m| m.flip),
            color: most(|m| m.color),
        }
    }
}

fn total(kind: &str, all: &Kind) {
    let s = Summary::of(all.measured.iter().map(|m| &m.1));
    let how = |what: &str| {
        format!(
            "{} levels of shipped sets, {VIEWS} views each at {} to {} pixels, against LOD0; {what}",
            all.measured.len(),
            s.pixels.0,
            s.pixels.1
        )
    };
    let worst = |score: fn(&Measured) -> f32| {
        all.measured.iter().max_by(|a, b| score(&a.1).total_cmp(&score(&b.1))).map_or("", |m| m.0.as_str())
    };
    let failing = all
        .measured
        .iter()
        .filter(|(_, m)| m.iou < 0.9 || m.worst_iou < 0.85 || (m.coverage - 1.0).abs() > 0.03 || m.flip > 0.1)
        .count();
    let name = |what: &str| format!("lod.{kind}.{what}");
    Figure::new(name("iou_mean"), s.iou, "share", how("mean")).goal(">= 0.90").print();
    Figure::new(name("iou_worst"), s.worst, "share", how(&format!("worst view, of {}", worst(|m| -m.worst_iou))))
        .goal(">= 0.85")
        .print();
    let mean = all.moved.iter().sum::<f64>() / all.moved.len().max(1) as f64;
    let aside = "LOD0 against itself a quarter of a pixel aside and up, first variants at the same sizes; mean";
    Figure::new(name("iou_of_a_quarter_pixel"), mean, "share", aside).print();
    Figure::new(name("coverage_least"), s.coverage.0, "ratio", how(worst(|m| -m.coverage))).goal(">= 0.97").print();
    Figure::new(name("coverage_most"), s.coverage.1, "ratio", how(worst(|m| m.coverage))).goal("<= 1.03").print();
    Figure::new(name("flip"), s.flip, "FLIP", how(&format!("worst level's mean, of {}", worst(|m| m.flip))))
        .goal("<= 0.10")
        .print();
    Figure::new(name("color"), s.color, "sRGB distance", how(worst(|m| m.color))).print();
    Figure::new(name("misses"), failing as f64, "levels", how("levels that miss one of the goals above"))
        .goal("0")
        .print();
    let share = all.triangles.iter().map(|&(t, full)| t as f64 / full.max(1) as f64).fold(0.0, f64::max);
    Figure::new(name("triangles_share"), share, "share", "largest share of LOD0's triangles").print();
    let most = all.leaf_triangles.iter().copied().max().unwrap_or(0);
    Figure::new(name("leaf_triangles"), most as f64, "triangles", "most triangles of leaves or cards, backs counted")
        .print();
}

/// Packing and alpha of a set's atlas.
fn atlas(name: &str, set: &Set) {
    let told = &set.manifest["atlas"];
    let value = |field: &str| told[field].as_f64().unwrap_or(0.0);
    let how = format!("{} pictures at scale {:.2}", value("pictures"), value("scale"));
    Figure::new(format!("lod.{name}.atlas_utilisation"), value("utilisation"), "share", how).goal(">= 0.75").print();
    // Of the atlas as it was written; the manifest knows which pictures are mixed with others before alpha is cut.
    let coverage: Vec<f64> = told["coverage"].as_array().into_iter().flatten().filter_map(|c| c.as_f64()).collect();
    let first = coverage.first().map_or(1e-6, |c| c.max(1e-6));
    let off = coverage.iter().map(|c| (c / first - 1.0).abs()).fold(0.0, f64::max);
    Figure::new(
        format!("lod.{name}.alpha_per_mip"),
        off,
        "share",
        format!("worst of five box-filtered mips against level 0: {coverage:.3?}"),
    )
    .goal("<= 0.02")
    .print();
}
