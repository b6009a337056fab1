//! The README's pictures, cut from the contact sheets of the shipped presets:
//!
//! `cargo run --release -- build presets --out out && cargo run --release --example pictures`

use std::error::Error;
use std::fs;
use std::path::Path;

use image::imageops::{FilterType, crop_imm, overlay, resize};
use image::{DynamicImage, Rgb, RgbImage};
use treewright::export::Manifest;

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

/// Side by side, from the left.
fn beside(cells: &[RgbImage]) -> RgbImage {
    let mut all = RgbImage::from_pixel(cells.iter().map(RgbImage::width).sum(), HEIGHT, Rgb([198, 206, 214]));
    let mut x = 0;
    for cell in cells {
        overlay(&mut all, cell, x, 0);
        x += i64::from(cell.width());
    }
    all
}

fn write(name: &str, cells: &[RgbImage]) -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pictures");
    fs::create_dir_all(&folder)?;
    Ok(DynamicImage::ImageRgb8(beside(cells)).save(folder.join(name))?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out".to_owned());
    let sheet = |set: &str| Sheet::read(Path::new(&out), set);
    let of = |set: &str, row: u32| sheet(set).map(|sheet| sheet.cell(row, 0));
    let species = [("ash", 0), ("broadleaved", 0), ("conifers", 0), ("weeping", 0), ("palms", 0), ("bare", 0)];
    write("species.png", &species.iter().map(|&(set, row)| of(set, row)).collect::<Result<Vec<_>, _>>()?)?;
    let ash = sheet("ash")?;
    write("levels.png", &(0..ash.columns).map(|column| ash.cell(0, column)).collect::<Vec<_>>())?;
    let hybrids = sheet("hybrids")?;
    write("hybrids.png", &(0..hybrids.rows.min(6)).map(|row| hybrids.cell(row, 0)).collect::<Vec<_>>())?;
    Ok(())
}
