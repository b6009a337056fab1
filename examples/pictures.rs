//! The README's pictures, of the shipped presets: trees drawn from their files, levels cut from the contact sheets.
//!
//! `cargo run --release -- build presets --out out && cargo run --release --example pictures`

use std::error::Error;
use std::fs;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::imageops::{FilterType, crop_imm, overlay, resize};
use image::{DynamicImage, Rgb, RgbImage};
use treewright::bake::{Light, Maps, Picture, Shading, Surface, View, rasterize};
use treewright::base::math::linear_to_srgb;
use treewright::export::Manifest;
use treewright::mesh::{Mesh, TreeMesh};

/// What stands behind trees, and below them.
const SKY: Rgb<u8> = Rgb([198, 206, 214]);
const GROUND: Rgb<u8> = Rgb([150, 152, 142]);
/// Width and height of a tree that is drawn, pixels, and what of it is ground and air.
const CELL: (u32, u32) = (400, 400);
const GROUND_HEIGHT: u32 = 24;
const MARGIN: u32 = 16;
/// Height of a tree's cell in the pictures, pixels.
const HEIGHT: u32 = 300;
/// Rows of a sheet that hold letters, pixels, above each tree.
const HEAD: u32 = 50;

/// A set's contact sheet, a row a variant, a column a level.
struct Sheet {
    image: RgbImage,
    rows: u32,
    columns: u32,
}

impl Sheet {
    fn read(out: &Path, set: &str) -> Result<Self, Box<dyn Error>> {
        let folder = out.join(set);
        let manifest: Manifest = serde_json::from_slice(&fs::read(folder.join(format!("{set}.manifest.json")))?)?;
        let image = image::open(folder.join(format!("{set}_contact.png")))?.into_rgb8();
        let columns = manifest.variants.iter().map(|v| v.levels.len()).max().unwrap_or(1);
        Ok(Self { image, rows: manifest.variants.len() as u32, columns: columns as u32 })
    }

    /// One tree without its letters, as high as all are.
    fn cell(&self, row: u32, column: u32) -> RgbImage {
        let (w, h) = (self.image.width() / self.columns, self.image.height() / self.rows);
        let cut = crop_imm(&self.image, column * w, row * h + HEAD.min(h - 1), w, h.saturating_sub(HEAD).max(1));
        let cut = cut.to_image();
        resize(&cut, (w * HEIGHT / cut.height()).max(1), HEIGHT, FilterType::CatmullRom)
    }
}

/// The bytes of an accessor whose elements lie one after the other, as Treewright writes them.
fn bytes<'b>(accessor: &gltf::Accessor<'_>, blob: &'b [u8]) -> Option<&'b [u8]> {
    let view = accessor.view()?;
    let from = view.offset() + accessor.offset();
    blob.get(from..from + accessor.count() * accessor.size())
}

/// Floats, or bytes as they are.
fn floats(accessor: &gltf::Accessor<'_>, blob: &[u8]) -> Option<Vec<f32>> {
    let bytes = bytes(accessor, blob)?;
    match accessor.data_type() {
        gltf::accessor::DataType::F32 => {
            Some(bytes.as_chunks().0.iter().map(|&float| f32::from_le_bytes(float)).collect())
        }
        gltf::accessor::DataType::U8 => Some(bytes.iter().map(|&byte| f32::from(byte)).collect()),
        _ => None,
    }
}

/// Whole numbers.
fn numbers(accessor: &gltf::Accessor<'_>, blob: &[u8]) -> Option<Vec<u32>> {
    let bytes = bytes(accessor, blob)?;
    match accessor.data_type() {
        gltf::accessor::DataType::U16 => {
            Some(bytes.as_chunks().0.iter().map(|&number| u16::from_le_bytes(number).into()).collect())
        }
        gltf::accessor::DataType::U32 => {
            Some(bytes.as_chunks().0.iter().map(|&number| u32::from_le_bytes(number)).collect())
        }
        _ => None,
    }
}

/// A tree's first level as its file has it.
struct Tree {
    mesh: TreeMesh,
    bark: Picture,
    leaves: Picture,
}

impl Tree {
    fn read(out: &Path, set: &str, number: u32) -> Result<Self, Box<dyn Error>> {
        let folder = out.join(set);
        let gltf::Gltf { document, blob } =
            gltf::Gltf::from_slice(&fs::read(folder.join(format!("{set}_{number:03}.glb")))?)?;
        let blob = blob.unwrap_or_default();
        let mut mesh = TreeMesh::default();
        let full = document.meshes().next().ok_or("it has no mesh")?;
        for primitive in full.primitives() {
            let of = |semantic| floats(&primitive.get(&semantic)?, &blob);
            let [places, normals, tangents, uvs, colors] = [
                gltf::Semantic::Positions,
                gltf::Semantic::Normals,
                gltf::Semantic::Tangents,
                gltf::Semantic::TexCoords(0),
                gltf::Semantic::Colors(0),
            ]
            .map(of);
            let whole = "it is no file of the profile `generic`";
            let part = Mesh {
                positions: places.ok_or(whole)?.as_chunks().0.iter().copied().map(Vec3::from_array).collect(),
                normals: normals.ok_or(whole)?.as_chunks().0.iter().copied().map(Vec3::from_array).collect(),
                tangents: tangents.ok_or(whole)?.as_chunks().0.to_vec(),
                uvs: uvs.ok_or(whole)?.as_chunks().0.iter().copied().map(Vec2::from_array).collect(),
                occlusion: colors.ok_or(whole)?.as_chunks::<4>().0.iter().map(|color| color[0] as u8).collect(),
                indices: numbers(&primitive.indices().ok_or(whole)?, &blob).ok_or(whole)?,
                ..Mesh::default()
            };
            let is_leaf = primitive.material().alpha_mode() == gltf::material::AlphaMode::Mask;
            *(if is_leaf { &mut mesh.leaf } else { &mut mesh.bark }) = part;
        }
        let maps = |kind: &str| -> Result<Maps, Box<dyn Error>> {
            let open = |map: &str| image::open(folder.join(format!("{set}_{kind}_{map}.png")));
            let (color, normal, orm) =
                (open("color")?.into_rgba8(), open("normal")?.into_rgb8(), open("orm")?.into_rgb8());
            let (width, height) = color.dimensions();
            let rgb = |image: &RgbImage| image.pixels().map(|pixel| pixel.0).collect();
            let color = color.pixels().map(|pixel| pixel.0).collect();
            Ok(Maps { width, height, color, normal: rgb(&normal), orm: rgb(&orm) })
        };
        Ok(Self { mesh, bark: Picture::new(&maps("bark")?), leaves: Picture::of_atlas(&maps("leaf")?) })
    }

    /// As large as a cell lets it be, standing on the ground.
    fn drawn(&self) -> RgbImage {
        let all = || self.mesh.bark.positions.iter().chain(&self.mesh.leaf.positions);
        let frame = View::level(AZIMUTH, Vec3::ZERO, 1.0, 1.0).frame;
        let across = || all().map(|place| place.dot(frame.x));
        let (left, right) = (across().fold(f32::MAX, f32::min), across().fold(f32::MIN, f32::max));
        let top = all().fold(0.0_f32, |top, place| top.max(place.y));
        let (width, height) = CELL;
        let room = ((width - 2 * MARGIN) as f32, (height - GROUND_HEIGHT - MARGIN) as f32);
        let metre = (room.0 / (right - left)).min(room.1 / top);
        let half = (width as f32 * 0.5 / metre, height as f32 * 0.5 / metre);
        let centre = frame.x * ((left + right) * 0.5) + Vec3::Y * (half.1 - GROUND_HEIGHT as f32 / metre);
        let surfaces =
            Surface::of_tree(&self.mesh, std::slice::from_ref(&self.bark), std::slice::from_ref(&self.leaves));
        let view = View::level(AZIMUTH, centre, half.0, half.1);
        let target = rasterize(&surfaces, &view, width, height, 6, &Shading::Lit(Light::DAY));
        RgbImage::from_fn(width, height, |x, y| {
            let behind = if y < height - GROUND_HEIGHT { SKY } else { GROUND };
            let i = (y * width + x) as usize;
            let share = target.coverage[i];
            let of = |k: usize| {
                let front = linear_to_srgb(target.color[i][k].min(1.0)) * 255.0;
                (front * share + f32::from(behind.0[k]) * (1.0 - share) + 0.5) as u8
            };
            Rgb([of(0), of(1), of(2)])
        })
    }
}

/// From where trees are looked at.
const AZIMUTH: f32 = 0.5;

/// In rows of so many.
fn rows_of(columns: usize, cells: &[RgbImage]) -> RgbImage {
    let (width, height) = CELL;
    let rows = cells.len().div_ceil(columns) as u32;
    let mut all = RgbImage::from_pixel(columns as u32 * width, rows * height, SKY);
    for (i, cell) in cells.iter().enumerate() {
        overlay(&mut all, cell, i64::from((i % columns) as u32 * width), i64::from((i / columns) as u32 * height));
    }
    all
}

/// Side by side, from the left.
fn beside(cells: &[RgbImage]) -> RgbImage {
    let mut all = RgbImage::from_pixel(cells.iter().map(RgbImage::width).sum(), HEIGHT, SKY);
    let mut x = 0;
    for cell in cells {
        overlay(&mut all, cell, x, 0);
        x += i64::from(cell.width());
    }
    all
}

fn write(name: &str, image: RgbImage) -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pictures");
    fs::create_dir_all(&folder)?;
    Ok(DynamicImage::ImageRgb8(image).save(folder.join(name))?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out".to_owned());
    let sheet = |set: &str| Sheet::read(Path::new(&out), set);
    let trees = [
        ("avenue", 3),
        ("broadleaved", 1),
        ("conifers", 2),
        ("weeping", 1),
        ("pines", 1),
        ("palms", 1),
        ("sketched", 1),
        ("bare", 2),
    ];
    let drawn = |&(set, number): &(&str, u32)| Ok(Tree::read(Path::new(&out), set, number)?.drawn());
    let drawn: Result<Vec<_>, Box<dyn Error>> = trees.iter().map(drawn).collect();
    write("species.png", rows_of(4, &drawn?))?;
    let ash = sheet("ash")?;
    write("levels.png", beside(&(0..ash.columns).map(|column| ash.cell(0, column)).collect::<Vec<_>>()))?;
    let hybrids = sheet("hybrids")?;
    write("hybrids.png", beside(&(0..hybrids.rows.min(6)).map(|row| hybrids.cell(row, 0)).collect::<Vec<_>>()))?;
    Ok(())
}
