//! The textures of a set in every format that its engines take, each kept by the texels it is made of.
//!
//! Engines that take the same format share its files. What nobody takes is not written: a set for `Web(textures: Ktx2)`
//! alone has no PNG but its contact sheet. Clips wear what all engines of the set read.

use std::cell::OnceCell;

use rayon::prelude::*;

use super::cache::{Cache, Stage};
use crate::bake::{self, AlphaUse, Maps, PictureKind, Rect};
use crate::base::{Diagnostic, Key};
use crate::export::{self, ExportError, MapUse, MaterialTextures, PngKind, SetMaterials, TextureEntry};
use crate::preset::Plan;
use crate::preset::plan::{Clip, TextureFormat};

/// The stages that encode pictures, with their versions: the maps of a material seldom change all at once.
const PNG: Stage = Stage("png", 3);
const WEBP: Stage = Stage("webp", 1);
const KTX2: Stage = Stage("ktx2", 3);

/// A texture file.
pub(super) struct Texture {
    /// What the manifest says of it.
    pub(super) entry: TextureEntry,
    pub(super) bytes: Vec<u8>,
}

/// The textures of a set's bark, format by format, or of its leaves, which are `pictures` of an atlas.
pub(super) fn texture_files(
    plan: &Plan,
    maps: &Maps,
    pictures: Option<&[(Rect, PictureKind)]>,
    cache: &Cache,
) -> Result<Vec<Texture>, Vec<Diagnostic>> {
    let mut formats: Vec<TextureFormat> = plan.engines.iter().map(|profile| profile.textures).collect();
    let is_played = plan.morphs.iter().any(|morph| matches!(morph.clip, Clip::Play { .. }));
    formats.extend(is_played.then(|| clip_textures(plan)));
    formats.sort_unstable();
    formats.dedup();
    let leaf = pictures.is_some();
    let material = if leaf { "leaf" } else { "bark" };
    let of = |format: &TextureFormat| {
        let names = SetMaterials::of(&plan.name, *format);
        let MaterialTextures { color, normal, orm } = if leaf { names.leaf } else { names.bark };
        let (size, files) = match format {
            TextureFormat::Ktx2 => {
                let blocks = bake::to_blocks(maps);
                // Those of an atlas that is made smaller lie elsewhere.
                let is_whole = (blocks.width, blocks.height) == (maps.width, maps.height);
                let pictures = pictures.map(|all| if is_whole { all } else { &[] });
                ((blocks.width, blocks.height), with_mips(&blocks, pictures, cache)?)
            }
            plain => ((maps.width, maps.height), plain_files(maps, leaf, *plain, cache)?),
        };
        let mips = if *format == TextureFormat::Ktx2 { size.0.max(size.1).ilog2() + 1 } else { 0 };
        let [color_bytes, normal_bytes, orm_bytes] = files;
        let entry = |(map, file, bytes): (&str, String, Vec<u8>)| Texture {
            entry: TextureEntry {
                file,
                material: material.to_owned(),
                channels: channels(map, leaf),
                map: map.to_owned(),
                width: size.0,
                height: size.1,
                mips,
            },
            bytes,
        };
        let all = [("color", color, color_bytes), ("normal", normal, normal_bytes), ("orm", orm, orm_bytes)];
        Ok(all.into_iter().map(entry).collect::<Vec<_>>())
    };
    Ok(formats.par_iter().map(of).collect::<Result<Vec<_>, Vec<Diagnostic>>>()?.into_iter().flatten().collect())
}

/// What clips wear. A clip is one file for all engines that are asked for: PNG where any of them takes that, or else the first
/// format of theirs that all read. Where there is none, PNG, which is written beside the others.
pub(super) fn clip_textures(plan: &Plan) -> TextureFormat {
    let asked = || plan.engines.iter().map(|profile| profile.textures);
    let read_by_all = |format: &TextureFormat| plan.engines.iter().all(|profile| profile.engine.reads(*format));
    if asked().any(|format| format == TextureFormat::Png) {
        return TextureFormat::Png;
    }
    asked().find(read_by_all).unwrap_or(TextureFormat::Png)
}

/// What a map's channels hold, where its name doesn't say.
fn channels(map: &str, leaf: bool) -> Vec<String> {
    let third = if leaf { "transmission" } else { "metalness" };
    let all = ["occlusion", "roughness", third];
    if map == "orm" { all.map(str::to_owned).to_vec() } else { Vec::new() }
}

fn told(error: ExportError) -> Vec<Diagnostic> {
    vec![Diagnostic::new("", error.to_string())]
}

/// Encodes bytes of so many by so many pixels of a kind.
type Encode = fn(&[u8], u32, u32, PngKind) -> Result<Vec<u8>, ExportError>;

/// Colour, normal and material as PNG or WebP.
fn plain_files(maps: &Maps, leaf: bool, format: TextureFormat, cache: &Cache) -> Result<[Vec<u8>; 3], Vec<Diagnostic>> {
    let (stage, encode): (Stage, Encode) = match format {
        TextureFormat::Webp => (WEBP, export::webp),
        _ => (PNG, export::encode),
    };
    let kept = |pixels: &[u8], width, height, kind: PngKind| {
        let size = u64::from(width) << 32 | u64::from(height);
        let key = stage.key().input(Key::of_bytes(pixels)).number(size).number(kind as u64).finish();
        cache.remember(stage, key, || encode(pixels, width, height, kind).map_err(told)).map(|made| made.to_vec())
    };
    let made = export::encode_maps_by(maps, if leaf { PngKind::Rgba } else { PngKind::Rgb }, &kept)?;
    Ok([made.color, made.normal, made.orm])
}

/// Colour, normal and material as KTX2, of maps whose sides are multiples of four, cut out where they are of `pictures`. Mips are made
/// when one of the three is not kept.
fn with_mips(
    maps: &Maps,
    pictures: Option<&[(Rect, PictureKind)]>,
    cache: &Cache,
) -> Result<[Vec<u8>; 3], Vec<Diagnostic>> {
    let alpha = if pictures.is_some() { AlphaUse::CutOut } else { AlphaUse::Opaque };
    let pictures = pictures.unwrap_or_default();
    // Where alpha is a mask, mips of the other maps are weighted by it.
    let mask: Vec<u8> = match alpha {
        AlphaUse::CutOut => maps.color.iter().map(|c| c[3]).collect(),
        AlphaUse::Opaque => Vec::new(),
    };
    let mask = KTX2.key().input(Key::of_bytes(&mask)).params(&pictures).finish();
    let levels: OnceCell<Vec<Maps>> = OnceCell::new();
    let file = |(of, texels): (MapUse, &[u8])| {
        let key = KTX2.key().input(Key::of_bytes(texels)).input(mask).number(of as u64).number(alpha as u64);
        let key = key.number(u64::from(maps.width) << 32 | u64::from(maps.height)).finish();
        cache.remember(KTX2, key, || {
            export::ktx2(levels.get_or_init(|| bake::mips_of(maps, alpha, pictures)), of, alpha).map_err(told)
        })
    };
    let [color, normal, orm] = [
        (MapUse::Color, maps.color.as_flattened()),
        (MapUse::Normal, maps.normal.as_flattened()),
        (MapUse::Orm, maps.orm.as_flattened()),
    ];
    // One after the other: each is made by all threads, and none waits for the mips in the middle of another.
    let files = [file(color)?, file(normal)?, file(orm)?];
    Ok(files.map(|made| made.to_vec()))
}
