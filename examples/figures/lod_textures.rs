//! Textures: how long an atlas of 2048² texels takes in each format, and what it comes to.

use treewright::bake::{AlphaUse, Maps, leaf_maps, mips, pack, preserve_coverage};
use treewright::base::Seed;
use treewright::export::{MapUse, PngKind, encode_maps, encode_maps_by, ktx2, webp};
use treewright::preset::plan::{AtlasParams, LeafShape};

use crate::{Figure, seconds};

/// Sprays of all shapes, packed as a set's are.
fn atlas() -> Maps {
    use LeafShape::{Ash, Beech, Birch, Elm, Linden, Maple, Oak, Olive, Palm, Pine, Poplar, Willow};
    let shapes = [Oak, Birch, Beech, Maple, Willow, Ash, Pine, Linden, Poplar, Elm, Olive, Palm];
    let pictures: Vec<Maps> = (0..60)
        .map(|i| leaf_maps(shapes[i % shapes.len()], [0.08, 0.16, 0.04], 0.3, 240, i as u32, Seed::new(7)))
        .collect();
    let params = AtlasParams { size: 2048, gutter: 8 };
    let mut maps = pack(&pictures.iter().collect::<Vec<_>>(), &params).expect("they fit").maps;
    preserve_coverage(&mut maps);
    maps
}

pub(crate) fn print() {
    let maps = atlas();
    let threads = rayon::current_num_threads();
    let size = format!("color, normal and orm of {} x {} texels, {threads} threads", maps.width, maps.height);
    let megabytes = |files: &[Vec<u8>]| files.iter().map(Vec::len).sum::<usize>() as f64 / 1e6;
    let told = |format: &str, seconds: f64, goal: &'static str, files: &[Vec<u8>]| {
        let how = format!("{size}; {:.2} MB", megabytes(files));
        Figure::new(format!("lod.textures_{format}"), seconds, "s", how).goal(goal).print();
    };
    let png = || encode_maps(&maps, PngKind::Rgba).expect("encodes");
    let files = png();
    told("png", seconds(5, || drop(png())), "", &[files.color, files.normal, files.orm]);
    let of_webp = || encode_maps_by(&maps, PngKind::Rgba, &webp).expect("encodes");
    let files = of_webp();
    told("webp", seconds(5, || drop(of_webp())), "", &[files.color, files.normal, files.orm]);
    let of_ktx2 = || {
        let levels = mips(&maps, AlphaUse::CutOut);
        [MapUse::Color, MapUse::Normal, MapUse::Orm].map(|of| ktx2(&levels, of, AlphaUse::CutOut).expect("encodes"))
    };
    let files = of_ktx2();
    told("ktx2", seconds(5, || drop(of_ktx2())), "<= 4 s", &files);
}
