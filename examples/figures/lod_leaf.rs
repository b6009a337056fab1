//! Leaf cards that are cut out, and hulls of crowns.

use treewright::bake::{card_cut, leaf_maps};
use treewright::base::Seed;
use treewright::build::{find_presets, load_preset};
use treewright::export::{Hull, crown_hulls};
use treewright::mesh::{CardShape, all_cards, leaf_cards};
use treewright::preset::plan::LeafShape;

use crate::{Figure, root, seconds};

const PICTURES: u32 = 4;

/// Prints them.
pub(crate) fn print() {
    overdraw();
    hulls();
}

/// The share of the texels that cards draw which are clear.
fn overdraw() {
    let pictures: Vec<_> = LeafShape::ALL
        .iter()
        .flat_map(|&shape| (0..PICTURES).map(move |k| leaf_maps(shape, [0.2, 0.4, 0.1], 0.3, 256, k, Seed::new(1))))
        .collect();
    let count = pictures.len() as f64;
    let solid: Vec<f64> = pictures
        .iter()
        .map(|maps| maps.color.iter().filter(|c| c[3] >= 128).count() as f64 / maps.color.len() as f64)
        .collect();
    let how = format!("mean of {count} pictures of all {} made leaves, sprays of several blades", LeafShape::ALL.len());
    let whole = solid.iter().map(|s| 1.0 - s).sum::<f64>() / count;
    Figure::new("lod.leaf.clear_whole", whole, "share", format!("clear texels that whole cards draw, {how}")).print();
    for corners in [8, 12, 16, 24, 32] {
        let cuts: Vec<_> = pictures.iter().map(|maps| card_cut(maps, corners)).collect();
        let mean = |k: usize| {
            let clear = cuts.iter().zip(&solid).map(|(cut, solid)| 1.0 - solid / f64::from(cut.areas()[k]));
            clear.sum::<f64>() / count
        };
        let triangles = cuts.iter().map(|cut| cut.triangles(true).len()).sum::<usize>() as f64 / count;
        let how = format!("clear texels that folded cards of {corners} corners draw, {triangles:.1} triangles, {how}");
        let figure = Figure::new(format!("lod.leaf.clear_cut_{corners}"), mean(1), "share", how);
        if corners == 16 {
            figure.goal("<= 0.40").print()
        } else {
            figure.print()
        }
        if corners == 16 {
            let how = format!("the same of flat ones of {corners} corners");
            Figure::new("lod.leaf.clear_cut_flat", mean(0), "share", how).goal("<= 0.35").print();
            let lost = pictures.iter().zip(&cuts).map(|(maps, cut)| lost(maps, cut)).sum::<usize>();
            let how = "texels with alpha of a half that a cut leaves out, of all pictures, folded and flat".to_owned();
            Figure::new("lod.leaf.cut_off", lost as f64, "texels", how).goal("0").print();
        }
    }
    // A single blade is most of what is bought as a leaf.
    let blade = ellipse();
    let share = blade.color.iter().filter(|c| c[3] >= 128).count() as f64 / blade.color.len() as f64;
    let cut = card_cut(&blade, 12);
    let how =
        format!("of a picture of one elliptic blade, cut flat with 12 corners; the whole card {:.3}", 1.0 - share);
    Figure::new("lod.leaf.clear_blade", 1.0 - share / f64::from(cut.areas()[0]), "share", how).goal("<= 0.12").print();
    let time = seconds(5, || drop(card_cut(&pictures[0], 16)));
    Figure::new("lod.leaf.cut_time", time * 1e3, "ms", "outlines of one picture of 256², 16 corners").print();
}

/// How many solid texels have their middle outside of a cut.
fn lost(maps: &treewright::bake::Maps, cut: &treewright::mesh::CardCut) -> usize {
    let edge = maps.width as f32;
    let outside = |triangles: &[[glam::Vec2; 3]], p: glam::Vec2| {
        !triangles
            .iter()
            .any(|[a, b, c]| [(a, b), (b, c), (c, a)].iter().all(|(q, r)| (**r - **q).perp_dot(p - **q) >= -1e-6))
    };
    let [folded, flat] = [cut.triangles(true), cut.triangles(false)];
    (0..maps.width * maps.height)
        .filter(|&i| maps.color[i as usize][3] >= 128)
        .map(|i| glam::Vec2::new((i % maps.width) as f32 + 0.5, edge - 0.5 - (i / maps.width) as f32) / edge)
        .filter(|&p| outside(&folded, p) || outside(&flat, p))
        .count()
}

/// A leaf of a quarter of its length's width, on a picture as wide as it is high.
fn ellipse() -> treewright::bake::Maps {
    let edge = 256_u32;
    let inside = |i: u32| {
        let (x, y) = ((i % edge) as f32 - 127.5, (i / edge) as f32 - 127.5);
        let (x, y) = (x / 50.0, y / 124.0);
        x * x + y * y <= 1.0
    };
    let count = (edge * edge) as usize;
    treewright::bake::Maps {
        width: edge,
        height: edge,
        color: (0..edge * edge).map(|i| [90, 120, 60, if inside(i) { 255 } else { 0 }]).collect(),
        normal: vec![[128, 128, 255]; count],
        orm: vec![[255, 200, 0]; count],
    }
}

/// How much larger than the exact hull bounded ones are, and how much smaller several are together.
fn hulls() {
    let preset = root().join("presets/broadleaved.ron");
    let found = find_presets(&[preset]).expect("it is shipped");
    let loaded = load_preset(&found[0]).expect("the preset is good");
    let focus = treewright::build::Focus::All;
    let studio = treewright::build::Studio::open(&loaded, focus, std::sync::Arc::default()).expect("it opens");
    let mut ratios: [f64; 3] = [0.0; 3];
    let (mut outside, mut count, mut time) = (0_usize, 0.0, 0.0);
    for place in 0..loaded.plan.variants.len().min(6) {
        let Some(plant) = studio.variant(place).expect("it is made") else { continue };
        let posed = plant.pose();
        let leaf = leaf_cards(&plant, &posed, &all_cards(&plant), CardShape::Folded);
        let of = |count, corners| crown_hulls(&plant, &posed, &leaf, count, corners);
        let exact = volume(&of(1, 100_000));
        for (ratio, hulls) in ratios.iter_mut().zip([of(1, 32), of(1, 64), of(4, 32)]) {
            *ratio += volume(&hulls) / exact;
            let lost = |p: &&glam::Vec3| hulls.iter().all(|hull| hull.outside(p.to_array()) > 0.0);
            outside += leaf.positions.iter().filter(lost).count();
        }
        count += 1.0;
        time += seconds(3, || drop(of(4, 32)));
    }
    let how = |what: &str| format!("{what}, against the exact hull, mean of {count} trees of `broadleaved`");
    let figure = |name: &'static str, k: usize, what: &str| Figure::new(name, ratios[k] / count, "ratio", how(what));
    figure("lod.hull.volume_32", 0, "volume of one hull of 32 corners").goal("<= 1.25").print();
    figure("lod.hull.volume_64", 1, "volume of one hull of 64 corners").goal("<= 1.15").print();
    figure("lod.hull.volume_4_of_32", 2, "volume of four hulls of 32 corners together").print();
    let how = "corners of leaf cards outside of all hulls, of the same trees".to_owned();
    Figure::new("lod.hull.outside", outside as f64, "corners", how).goal("0").print();
    Figure::new("lod.hull.time", time / count * 1e3, "ms", "four hulls of 32 corners around one of those crowns")
        .print();
}

fn volume(hulls: &[Hull]) -> f64 {
    let of = |hull: &Hull| -> f64 {
        let corner = |i: u32| glam::Vec3::from_array(hull.points[i as usize]).as_dvec3();
        hull.triangles.iter().map(|t| corner(t[0]).cross(corner(t[1])).dot(corner(t[2])) / 6.0).sum()
    };
    hulls.iter().map(of).sum()
}
