//! Textures: how long an atlas of 2048² texels takes in each format, and what it comes to.

use treewright::bake::{AlphaUse, Maps, PictureKind, Rect, coverage_of_mips, leaf_maps, mips_of, pack, preserve_alpha};
use treewright::base::Seed;
use treewright::export::{MapUse, PngKind, encode_maps, encode_maps_by, ktx2, webp};
use treewright::preset::plan::{AtlasParams, LeafShape};

use crate::{Figure, seconds};

/// Pictures of an atlas, and what they are of.
type Pictures = Vec<(Rect, PictureKind)>;

/// Sprays of all shapes, packed as a set's are.
fn atlas() -> (Maps, Pictures) {
    use LeafShape::{Ash, Beech, Birch, Elm, Linden, Maple, Oak, Olive, Palm, Pine, Poplar, Willow};
    let shapes = [Oak, Birch, Beech, Maple, Willow, Ash, Pine, Linden, Poplar, Elm, Olive, Palm];
    let pictures: Vec<Maps> = (0..60)
        .map(|i| leaf_maps(shapes[i % shapes.len()], [0.08, 0.16, 0.04], 0.3, 240, i as u32, Seed::new(7)))
        .collect();
    let params = AtlasParams { size: 2048, gutter: 8 };
    let made = pack(&pictures.iter().collect::<Vec<_>>(), &params).expect("they fit");
    let shown: Pictures = made.layout.rects.iter().map(|rect| (*rect, PictureKind::Leaf)).collect();
    let mut maps = made.maps;
    let mut alpha: Vec<u8> = maps.color.iter().map(|c| c[3]).collect();
    preserve_alpha(&mut alpha, (maps.width, maps.height), &shown);
    maps.color.iter_mut().zip(alpha).for_each(|(color, alpha)| color[3] = alpha);
    (maps, shown)
}

/// By how much what shows of the pictures is off in the worst of some mips that a file carries.
fn off(levels: &[Maps], pictures: &Pictures) -> f64 {
    let all: Vec<f64> = coverage_of_mips(levels, pictures).into_iter().take(6).map(f64::from).collect();
    all.iter().map(|share| (share / all[0] - 1.0).abs()).fold(0.0, f64::max)
}

pub(crate) fn print() {
    let (maps, pictures) = atlas();
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
        let levels = mips_of(&maps, AlphaUse::CutOut, &pictures);
        [MapUse::Color, MapUse::Normal, MapUse::Orm].map(|of| ktx2(&levels, of, AlphaUse::CutOut).expect("encodes"))
    };
    let files = of_ktx2();
    told("ktx2", seconds(5, || drop(of_ktx2())), "<= 4 s", &files);
    let off = off(&mips_of(&maps, AlphaUse::CutOut, &pictures), &pictures);
    let how = "worst of the first five mips that a KTX2 of sprays carries, shown between texels, against level 0";
    Figure::new("lod.textures_ktx2_mips", off, "share", how).goal("<= 0.02").print();
}
