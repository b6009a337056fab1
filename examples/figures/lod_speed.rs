//! How fast assets are made: one, a set, a batch without cards, meshing and baking.

use std::path::Path;

use rayon::prelude::*;
use treewright::bake::{Maps, Shading, View, rasterize};
use treewright::base::Seed;
use treewright::blend::sample;
use treewright::build::pipeline::{dress_params, make_set, read_inputs, set_key};
use treewright::build::{Cache, Limits, load_edited, load_preset};
use treewright::export::{AssetIn, AssetLevel, PngKind, SetMaterials, encode_maps, glb};
use treewright::lod::{Stock, Wardrobe, ladder, mesh_levels};
use treewright::mesh::TreeMesh;
use treewright::plant::Plant;
use treewright::preset::plan::{Backs, BarkArt, DressParams, LeafArt, MatchParams, MeshParams, Plan, TextureFormat};
use treewright::relate::{Family, fuzzy_family};
use treewright::source::grow::grow;
use treewright::{bake, dress};

use crate::lod::wants;
use crate::{Figure, root, seconds};

fn oak(seed: u64) -> Plant {
    let text = std::fs::read_to_string(root().join("presets/species/oak.ron")).expect("the species is shipped");
    let mut params = treewright::preset::species("oak.ron", &text).expect("the species is good");
    params.seed = seed;
    grow(&params, Seed::new(seed)).expect("it grows").0
}

fn count(tree: &TreeMesh) -> usize {
    (tree.bark.indices.len() + tree.leaf.indices.len()) / 3
}

pub(crate) fn print() {
    let threads = rayon::current_num_threads();
    let mut plan = load_preset(&root().join("presets/avenue.ron")).expect("it is shipped").plan;
    // Triangles of leaves are counted once.
    plan.mesh.backs = Backs::DoubleSided;
    if wants("asset") {
        asset(&plan, threads);
    }
    if wants("set") {
        set(&root().join("presets/avenue.ron"), threads);
    }
    if wants("batch") {
        batch(&plan, threads);
    }
    if wants("leafy") {
        leafy(&plan, threads);
    }
    if wants("meshing") {
        meshing(&plan, threads);
    }
}

/// A dressed oak of about 60,000 triangles: its ladder, its atlas of 2048² with three maps, and its GLB.
fn asset(plan: &Plan, threads: usize) {
    let seed = Seed::new(1);
    let (LeafArt::Made { shape, color, variation, size, .. }, BarkArt::Made { pattern, color: brown, size: edge }) =
        (&plan.leaf_art, &plan.bark_art)
    else {
        return;
    };
    let leaves: Vec<_> =
        (0..4).into_par_iter().map(|i| bake::leaf_maps(*shape, *color, *variation, *size, i, seed)).collect();
    let bark = bake::bark_maps(*pattern, *brown, *edge, seed);
    let mut params = dress_params(plan);
    let grown = oak(1);
    let mut plant = dress::dress(&grown, &params, seed);
    // Denser or thinner until it is as large as the goal speaks of.
    for _ in 0..3 {
        let made = mesh_levels(&plant, &plan.mesh, &[], seed);
        params.density = (params.density * 60_000.0 / count(&made[0]).max(1) as f32).clamp(0.05, 4.0);
        plant = dress::dress(&grown, &params, seed);
    }
    // Leaves as an atlas keeps them, which a set does once.
    let alphas = Stock::new(&leaves, &bark).alphas().to_vec();
    let kept: Vec<Maps> = (leaves.iter().cloned().zip(alphas))
        .map(|(mut maps, alpha)| {
            maps.color.iter_mut().zip(alpha).for_each(|(color, alpha)| color[3] = alpha);
            maps
        })
        .collect();
    let mut triangles = 0;
    let mut part = |until: usize| {
        seconds(5, || {
            let ladder = ladder(&plant, &plan.mesh, &plan.lods, &leaves, &bark, seed);
            triangles = ladder.levels[0].triangles;
            if until == 0 {
                return;
            }
            let palette = treewright::lod::palette(&leaves, &bark);
            let painted: Vec<_> = ladder.tiles.par_iter().map(|tile| tile.maps(&palette)).collect();
            let tiles: Vec<_> = kept.iter().chain(&painted).collect();
            let atlas = bake::pack(&tiles, &plan.atlas).expect("it fits");
            let mut meshes: Vec<TreeMesh> = ladder.levels.iter().map(|level| level.mesh.clone()).collect();
            for mesh in &mut meshes {
                atlas.layout.place(&mut mesh.leaf).expect("tiles are there");
            }
            if until == 1 {
                return;
            }
            let levels: Vec<AssetLevel<'_>> = (meshes.iter().zip(&ladder.levels))
                .map(|(mesh, level)| AssetLevel {
                    mesh,
                    screen_coverage: level.screen_coverage,
                    impostor: None,
                    wind: None,
                })
                .collect();
            let materials = SetMaterials::of("oak", TextureFormat::Png);
            let asset = AssetIn { name: "oak_001", seed: 1, below: 0.0, levels: &levels, materials: &materials };
            let (glb, maps) = rayon::join(|| glb(&asset), || encode_maps(&atlas.maps, PngKind::Rgba));
            drop((glb.expect("it is whole"), maps.expect("they are whole")));
        })
    };
    let (levels, packed, whole) = (part(0), part(1), part(2));
    let how = format!(
        "{triangles} triangles, four levels, 48 cards, an impostor, atlas of 2048² with three maps, GLB; levels \
         {levels:.3} s, atlas {:.3} s, files {:.3} s; median of 5, {threads} threads",
        packed - levels,
        whole - packed
    );
    Figure::new("lod.speed.full_asset", whole, "s", how).goal("<= 0.4 s").print();
}

fn set(preset: &Path, threads: usize) {
    // Four blends more, so that a set has twelve.
    let text = std::fs::read_to_string(preset).expect("the preset is shipped").replacen("count: 6", "count: 10", 1);
    let texts = [("avenue.ron".to_owned(), text)].into();
    let loaded = load_edited(preset, &Limits::default(), texts).expect("the preset is good");
    let inputs = read_inputs(&loaded).expect("its files are there");
    let key = set_key(&loaded.plan, &inputs);
    let variants = loaded.plan.variants.len();
    assert_eq!(variants, 12);
    let time = seconds(3, || drop(make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {})));
    let how = format!("avenue with {variants} variants, growth and selection included, median of 3, {threads} threads");
    Figure::new("lod.speed.set_of_12", time, "s", how).goal("<= 2 s").print();
}

/// Two oaks in correspondence, with leaves where that is wanted.
fn family(leafy: Option<&DressParams>) -> Family {
    let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
    let source = |i| leafy.map_or_else(|| oak(i), |params| dress::dress(&oak(i), params, Seed::new(i)));
    fuzzy_family(source(1), source(2), &matching).expect("they match")
}

fn blended(family: &Family, i: u64) -> Plant {
    family.blend(&sample(family, 0, 1, Seed::new(i), 0.3 + 0.4 * i as f32 / 50.0))
}

/// Fifty variants of two sources as files, dressed one by one, as trees of bare sources are.
fn batch(plan: &Plan, threads: usize) {
    let bare = family(None);
    let dressed = |params: &DressParams, i: u64| dress::dress(&blended(&bare, i), params, Seed::new(i));
    let params = thinned_to(plan, 24_000, &|params| MEASURED.map(|i| dressed(params, i)));
    fifty(plan, "batch_of_50", "each dressed after blending", threads, &|i| dressed(&params, i));
}

/// Fifty variants of two sources that bring their leaves, as scans do.
fn leafy(plan: &Plan, threads: usize) {
    let params = thinned_to(plan, 24_000, &|params| {
        let family = family(Some(params));
        MEASURED.map(|i| blended(&family, i))
    });
    let family = family(Some(&params));
    fifty(plan, "batch_of_50_leafy", "of sources that bring their leaves", threads, &|i| blended(&family, i));
}

/// Those of the fifty by which their size is settled.
const MEASURED: [u64; 5] = [4, 14, 24, 34, 44];

fn coarse(plan: &Plan) -> MeshParams {
    MeshParams { error: 0.02, sides: 8, most_sides: 8, ..plan.mesh.clone() }
}

/// The dressing with which trees have about so many triangles.
fn thinned_to(plan: &Plan, wanted: usize, trees: &dyn Fn(&DressParams) -> [Plant; 5]) -> DressParams {
    let mut params = dress_params(plan);
    // Wood takes as many whatever the density: so many rounds come within a hundredth.
    for _ in 0..10 {
        let trees = trees(&params);
        let all = trees.iter().map(|tree| count(&mesh_levels(tree, &coarse(plan), &[], Seed::new(7))[0]));
        let triangles = all.sum::<usize>() / trees.len();
        params.density = (params.density * wanted as f32 / triangles.max(1) as f32).clamp(0.02, 4.0);
    }
    params
}

fn fifty(plan: &Plan, name: &str, kind: &str, threads: usize, tree: &(dyn Fn(u64) -> Plant + Sync)) {
    let (mesh, materials) = (coarse(plan), SetMaterials::of("oak", TextureFormat::Png));
    let mut triangles = 0;
    let time = seconds(5, || {
        let files: Vec<(Vec<u8>, usize)> = (0..50_u64)
            .into_par_iter()
            .map(|i| {
                let mut meshes = mesh_levels(&tree(i), &mesh, &[0.4, 0.15], Seed::new(i));
                meshes.iter_mut().for_each(|mesh| mesh.leaf.tiles.clear());
                let levels: Vec<AssetLevel<'_>> = (meshes.iter().enumerate())
                    .map(|(k, mesh)| AssetLevel {
                        mesh,
                        screen_coverage: 0.3 / (k + 1) as f32,
                        impostor: None,
                        wind: None,
                    })
                    .collect();
                let asset = AssetIn { name: "oak", seed: i, below: 0.0, levels: &levels, materials: &materials };
                (glb(&asset).expect("it is whole"), count(&meshes[0]))
            })
            .collect();
        triangles = files.iter().map(|f| f.1).sum::<usize>() / files.len();
    });
    let how = format!(
        "50 blended oaks of {triangles} triangles with 3 mesh levels from a family to GLB bytes, {kind}, median of 5, \
         {threads} threads; bevy_flora 0.24 s without blending, ez-tree 0.87 s with one level"
    );
    Figure::new(format!("lod.speed.{name}"), time, "s", how).goal("<= 0.25 s").print();
}

fn meshing(plan: &Plan, threads: usize) {
    let params = dress_params(plan);
    let plants: Vec<Plant> = (0..8).into_par_iter().map(|i| dress::dress(&oak(i), &params, Seed::new(i))).collect();
    let mut triangles = 0;
    let time = seconds(25, || {
        triangles = plants
            .par_iter()
            .map(|plant| mesh_levels(plant, &plan.mesh, &[], Seed::new(1)).iter().map(count).sum::<usize>())
            .sum();
    });
    let how =
        format!("{triangles} triangles of 8 dressed oaks, pose and crown included, median of 25, {threads} threads");
    Figure::new("lod.speed.meshing", triangles as f64 / time / 1e6, "M triangles/s", how).goal(">= 20").print();

    let wardrobe = Wardrobe::new(
        &[],
        &bake::bark_maps(treewright::preset::plan::BarkPattern::Smooth, [0.3; 3], 256, Seed::new(1)),
    );
    let tree = mesh_levels(&plants[0], &plan.mesh, &[], Seed::new(1)).swap_remove(0);
    let view = View::level(0.3, glam::Vec3::Y * 5.0, 6.0, 6.0);
    let edge = 2048_u32;
    let time = seconds(5, || drop(rasterize(&wardrobe.dressed(&tree), &view, edge, edge, 1, &Shading::Albedo)));
    let texels = f64::from(edge) * f64::from(edge);
    let how = format!("an oak of {} triangles onto 2048² texels, median of 5, {threads} threads", count(&tree));
    Figure::new("lod.speed.baking", texels / time / 1e6, "M texels/s", how).goal(">= 50").print();
}
