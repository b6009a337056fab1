//! Draws every mesh of the data folder beside the plant that it becomes: `cargo run --release --example sidebyside -- OUT
//! [NAME]…`. To the left the file's own triangles and pictures, to the right the plant's wood and leaves, in the same light.
//!
//! With FILE.glb (or obj, ply) instead of a name of the data folder, that file.

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use treewright::bake::{Light, Maps, Picture, Repeat, Shading, Surface, View, card_maps, own_bark_maps, rasterize};
use treewright::base::Seed;
use treewright::mesh::{CardShape, Mesh, TubeDetail, all_cards, leaf_cards, tubes};
use treewright::preset::plan::{ImportHeight, ImportParams, MeshParams, UpAxis};
use treewright::source::import::{Imported, import_with};
use treewright::source::scene::{self, Alpha, Scene};

/// Pixels of one of the two pictures.
const SIZE: u32 = 640;

fn main() {
    let mut args = std::env::args().skip(1);
    let out = PathBuf::from(args.next().expect("a folder for the pictures"));
    std::fs::create_dir_all(&out).expect("the folder can be made");
    let names: Vec<String> = args.collect();
    let data = std::env::var_os("TREEWRIGHT_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")), PathBuf::from);
    let mut files: Vec<PathBuf> = names.iter().map(PathBuf::from).filter(|p| p.is_file()).collect();
    let own = files.len();
    let manifest = std::fs::read_to_string(data.join("MANIFEST.tsv")).unwrap_or_default();
    let meshes = manifest.lines().filter_map(|l| l.split('\t').next()).filter(|n| n.starts_with("mesh/"));
    files.extend(
        meshes
            .filter(|m| (own == 0 && names.is_empty()) || names.iter().any(|n| m.contains(n.as_str())))
            .map(|m| data.join(m)),
    );
    for file in files {
        draw(&file, &out);
    }
}

fn draw(path: &Path, out: &Path) {
    let bytes = std::fs::read(path).expect("the mesh can be read");
    let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for _ in 0..3 {
        for file in scene::refers(&bytes, &borrowed(&beside)) {
            if let Ok(found) = std::fs::read(path.with_file_name(&file)) {
                beside.insert(file, found);
            }
        }
    }
    let files = borrowed(&beside);
    let read = scene::read(&bytes, &name, &files);
    let made = import_with(&bytes, &name, &files, &ImportParams { height: ImportHeight::AsIs, ..Default::default() });
    let (Ok(scene), Ok(made)) = (read, made) else {
        println!("{name}: no plant");
        return;
    };
    println!("{name}: {} chains, {} leaves", made.plant.chains().len(), made.plant.leaves().len());
    made.notes.iter().for_each(|note| println!("    {note}"));
    let (left, pictures) = of_scene(&scene, &files);
    let (right, worn) = of_plant(&made);
    let mut pixels = vec![0_u8; (SIZE * 2 * SIZE * 3) as usize];
    for (side, parts, worn) in [(0, &left, &pictures), (1, &right, &worn)] {
        let all = || parts.iter().flat_map(|m| &m.positions);
        let (low, high) = all().fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let half = ((high - low).max_element() * 0.53).max(1e-6);
        let surfaces: Vec<Surface<'_>> = parts
            .iter()
            .zip(worn.iter())
            .map(|(mesh, (picture, repeat))| Surface { mesh, pictures: picture, repeat: *repeat, closed: false })
            .collect();
        let view = View::level(0.6, (low + high) * 0.5, half, half);
        let light = Light {
            sun_direction: Vec3::new(0.7, 0.8, 0.6).normalize(),
            sun: Vec3::splat(1.7),
            sky: Vec3::splat(0.55),
            ground: Vec3::splat(0.25),
            translucency: 0.3,
        };
        let drawn = rasterize(&surfaces, &view, SIZE, SIZE, 3, &Shading::Lit(light));
        for y in 0..SIZE {
            for x in 0..SIZE {
                let i = (y * SIZE + x) as usize;
                let shown = drawn.color[i] * drawn.coverage[i] + Vec3::splat(0.8) * (1.0 - drawn.coverage[i]);
                let at = ((y * SIZE * 2 + x + side * SIZE) * 3) as usize;
                let encoded = shown.to_array().map(|c| (c.clamp(0.0, 1.0).sqrt() * 255.0) as u8);
                pixels[at..at + 3].copy_from_slice(&encoded);
            }
        }
    }
    let file = out.join(format!("{name}.png"));
    image::save_buffer(&file, &pixels, SIZE * 2, SIZE, image::ColorType::Rgb8).expect("the picture can be written");
}

fn borrowed(files: &BTreeMap<String, Vec<u8>>) -> scene::Files<'_> {
    files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect()
}

/// What a mesh wears.
type Worn = (Vec<Picture>, Repeat);

/// The file's triangles, upright, one mesh a part.
fn of_scene(scene: &Scene, files: &scene::Files<'_>) -> (Vec<Mesh>, Vec<Worn>) {
    let mut meshes = Vec::new();
    let mut worn = Vec::new();
    // The way up is detected by import; Z is what files without a say mean here.
    let upright = |p: Vec3| if scene.up.0 == UpAxis::Y { p } else { Vec3::new(p.x, p.z, -p.y) };
    for part in &scene.parts {
        let material = part.material.and_then(|m| scene.materials.get(m));
        let bytes = |image: Option<usize>| image.and_then(|i| scene.image_bytes(i, files));
        let factor = material.map_or([0.6, 0.6, 0.6, 1.0], |m| m.color);
        let mut maps = bytes(material.and_then(|m| m.color_image))
            .and_then(|color| image::load_from_memory(color).ok())
            .map(|picture| of_image(&picture.into_rgba8()))
            .unwrap_or_else(|| plain([255; 4]));
        for c in &mut maps.color {
            for (channel, factor) in c.iter_mut().zip(factor) {
                *channel = (f32::from(*channel) * factor.max(0.0).sqrt()).min(255.0) as u8;
            }
            c[3] =
                if material.is_some_and(|m| m.alpha == Alpha::Opaque && m.alpha_image.is_none()) { 255 } else { c[3] };
        }
        let colored = !part.colors.is_empty();
        // One picture a colour of the vertices, where there are any: the rasterizer knows none.
        let mut pictures = vec![Picture::new(&maps)];
        let mut known: Vec<[u8; 3]> = Vec::new();
        let mut mesh = Mesh::default();
        for t in &part.triangles {
            let corner = t.map(|v| upright(part.positions[v as usize]));
            let normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalize_or_zero();
            let tile = if colored {
                let c = part.colors[t[0] as usize];
                let c = [c[0], c[1], c[2]].map(|c| (c.clamp(0.0, 1.0).sqrt() * 15.0) as u8 * 17);
                known.iter().position(|k| *k == c).unwrap_or_else(|| {
                    known.push(c);
                    pictures.push(Picture::new(&plain([c[0], c[1], c[2], 255])));
                    known.len() - 1
                }) as u32
                    + 1
            } else {
                0
            };
            for (k, v) in t.iter().enumerate() {
                mesh.indices.push(mesh.positions.len() as u32);
                mesh.positions.push(corner[k]);
                mesh.normals.push(normal);
                mesh.uvs.push(part.uvs.get(*v as usize).copied().unwrap_or(Vec2::ZERO));
                mesh.occlusion.push(255);
                mesh.tiles.push(tile);
            }
        }
        meshes.push(mesh);
        let cut = material.is_some_and(|m| m.alpha != Alpha::Opaque || m.alpha_image.is_some());
        worn.push((pictures, if cut { Repeat::Cutout } else { Repeat::Tiled }));
    }
    (meshes, worn)
}

fn of_image(picture: &image::RgbaImage) -> Maps {
    let n = (picture.width() * picture.height()) as usize;
    Maps {
        width: picture.width(),
        height: picture.height(),
        color: picture.pixels().map(|p| p.0).collect(),
        normal: vec![[128, 128, 255]; n],
        orm: vec![[255, 200, 0]; n],
    }
}

fn plain(color: [u8; 4]) -> Maps {
    Maps { width: 1, height: 1, color: vec![color], normal: vec![[128, 128, 255]], orm: vec![[255, 200, 0]] }
}

/// The plant's tubes and cards.
fn of_plant(made: &Imported) -> (Vec<Mesh>, Vec<Worn>) {
    let seed = Seed::new(0).child("own art");
    let (leaves, _) = card_maps(&made.art, seed);
    let (bark, _) = own_bark_maps(&made.art, seed);
    let posed = made.plant.pose();
    let detail = TubeDetail::full(&MeshParams {
        bark_tile: made.plant.height() * 0.1,
        ..MeshParams::told(12, made.plant.height() * 1e-4)
    });
    let wood = tubes(&made.plant, &posed, &detail);
    let cards = leaf_cards(&made.plant, &posed, &all_cards(&made.plant), CardShape::Flat);
    let bark = bark.unwrap_or_else(|| plain([150, 120, 90, 255]));
    let leaves: Vec<Picture> = leaves.iter().map(Picture::new).collect();
    (vec![wood, cards], vec![(vec![Picture::new(&bark)], Repeat::Tiled), (leaves, Repeat::Cutout)])
}
