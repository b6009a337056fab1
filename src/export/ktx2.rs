//! Textures as KTX2: Basis UASTC with all mips, packed by zstd, as `KHR_texture_basisu` wants them.
//!
//! Colour is marked sRGB and the other maps linear in the data format descriptor, sides are multiples of four, the first row
//! is the upper one, and every level is a zstd frame of its own. A normal map is x, y and z in red, green and blue, as in the
//! PNG: glTF has engines read all three, so none is swizzled into alpha. Blocks hang on their own texels only and frames on
//! their own level, so that bytes don't depend on the number of threads.
//!
//! Source: Khronos, "KTX File Format Specification" 2.0, 3 and 5; "KHR_texture_basisu".

use rayon::prelude::*;

use super::ExportError;
use super::uastc::{self, Alpha};
use crate::bake::{AlphaUse, Maps};

/// What a texture is to its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapUse {
    /// Base colour, sRGB.
    Color,
    /// Tangent-space normal, linear.
    Normal,
    /// Occlusion, roughness and metalness, linear.
    Orm,
}

const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// Zstandard, of the supercompression schemes.
const ZSTD: u32 = 2;
/// zstd's level: higher ones take some percent more off and many times as long.
const LEVEL: i32 = 3;
/// Of the data format descriptor: UASTC, BT.709's primaries, and both transfer functions.
const UASTC: u8 = 166;
const BT709: u8 = 1;
const LINEAR: u8 = 1;
const SRGB: u8 = 2;
/// What a UASTC sample holds.
const RGB: u8 = 0;
const RGBA: u8 = 3;

/// Encodes one map of a material's mips, level 0 first, each half as large as the one before.
///
/// # Errors
///
/// When there is no level, a side of the first is no multiple of four, or a level isn't of its size.
pub fn ktx2(levels: &[Maps], of: MapUse, alpha: AlphaUse) -> Result<Vec<u8>, ExportError> {
    let Some(first) = levels.first() else {
        return Err(ExportError::Picture { width: 0, height: 0, what: "it has no texels".to_owned() });
    };
    let (width, height) = (first.width, first.height);
    let wrong = |what: &str| ExportError::Picture { width, height, what: what.to_owned() };
    if !width.is_multiple_of(4) || !height.is_multiple_of(4) || width == 0 || height == 0 {
        return Err(wrong("its sides are no multiples of four"));
    }
    let is_cut = of == MapUse::Color && alpha == AlphaUse::CutOut;
    let packed: Vec<(usize, Vec<u8>)> = levels
        .par_iter()
        .enumerate()
        .map(|(k, level)| {
            let size = [width, height].map(|side| (side >> k.min(31)).max(1));
            let texels = level.width as usize * level.height as usize;
            if [level.width, level.height] != size
                || [level.color.len(), level.normal.len(), level.orm.len()] != [texels; 3]
            {
                return Err(wrong("a mip isn't of its size"));
            }
            let texels: Vec<[u8; 4]> = match of {
                MapUse::Color if is_cut => level.color.clone(),
                MapUse::Color => level.color.iter().map(|&[r, g, b, _]| [r, g, b, 255]).collect(),
                MapUse::Normal => level.normal.iter().map(|&[x, y, z]| [x, y, z, 255]).collect(),
                MapUse::Orm => level.orm.iter().map(|&[o, r, m]| [o, r, m, 255]).collect(),
            };
            let alpha = if is_cut { Alpha::CutOut } else { Alpha::None };
            let blocks = uastc::encode(&texels, (level.width as usize, level.height as usize), alpha);
            let frame = zstd::bulk::compress(&blocks, LEVEL).map_err(|e| wrong(&e.to_string()))?;
            Ok((blocks.len(), frame))
        })
        .collect::<Result<_, _>>()?;
    Ok(container((width, height), &packed, of, if is_cut { RGBA } else { RGB }))
}

/// The file around packed levels, of which the sizes before packing are known.
fn container((width, height): (u32, u32), packed: &[(usize, Vec<u8>)], of: MapUse, channels: u8) -> Vec<u8> {
    let descriptor = descriptor(if of == MapUse::Color { SRGB } else { LINEAR }, channels);
    let writer = concat!("KTXwriter\0Treewright ", env!("CARGO_PKG_VERSION"), "\0");
    let mut values = Vec::new();
    for pair in ["KTXorientation\0rd\0", writer] {
        values.extend((pair.len() as u32).to_le_bytes());
        values.extend(pair.as_bytes());
        values.resize(values.len().next_multiple_of(4), 0);
    }
    let head = 80 + packed.len() * 24;
    let mut out = IDENTIFIER.to_vec();
    // No Vulkan format, bytes; one picture with one face.
    for field in [0, 1, width, height, 0, 0, 1, packed.len() as u32, ZSTD] {
        out.extend(u32::to_le_bytes(field));
    }
    for field in [head, descriptor.len(), head + descriptor.len(), values.len()] {
        out.extend((field as u32).to_le_bytes());
    }
    // No global data.
    out.extend([0; 16]);
    let mut at = head + descriptor.len() + values.len();
    // The smallest level comes first.
    let mut places = vec![0; packed.len()];
    for (place, (_, frame)) in places.iter_mut().zip(packed).rev() {
        *place = at;
        at += frame.len();
    }
    for (place, (size, frame)) in places.iter().zip(packed) {
        for field in [*place, frame.len(), *size] {
            out.extend((field as u64).to_le_bytes());
        }
    }
    out.extend(descriptor);
    out.extend(values);
    packed.iter().rev().for_each(|(_, frame)| out.extend(frame));
    out
}

/// The data format descriptor: one basic block of one sample.
fn descriptor(transfer: u8, channels: u8) -> Vec<u8> {
    let mut out = Vec::with_capacity(44);
    for field in [44_u32, 0, 2 | 40 << 16] {
        out.extend(field.to_le_bytes());
    }
    out.extend([UASTC, BT709, transfer, 0]);
    // Blocks of 4 × 4, sides less one; bytes of the first plane.
    out.extend([3, 3, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
    // The sample: from bit 0 on 128 bits, less one.
    out.extend([0, 0, 127, channels, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]);
    out
}

#[cfg(test)]
mod tests {
    use super::super::uastc::tests::decode;
    use super::*;
    use crate::bake;
    use crate::base::{Seed, math};
    use crate::preset::plan::LeafShape;

    /// Leaves of an ash as an atlas has them.
    fn leaves() -> Maps {
        let mut maps = bake::leaf_maps(LeafShape::Ash, [0.1, 0.2, 0.05], 0.3, 256, 0, Seed::new(1));
        bake::preserve_coverage(&mut maps);
        maps
    }

    struct Read {
        size: (u32, u32),
        transfer: u8,
        channels: u8,
        /// Level 0 first: width, height and decoded texels.
        levels: Vec<(usize, usize, Vec<[u8; 4]>)>,
    }

    /// Reads a file by the specification alone.
    fn read(bytes: &[u8]) -> Read {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        assert_eq!(bytes[..12], IDENTIFIER);
        assert_eq!([word(12), word(16), word(28), word(32), word(36), word(44)], [0, 1, 0, 0, 1, 2]);
        let (width, height, count) = (word(20), word(24), word(40));
        let (dfd, values) = (word(48), word(56));
        assert_eq!((dfd, word(52), word(dfd), values), (80 + 24 * count, 44, 44, dfd + 44));
        assert_eq!(bytes[dfd + 12], 166);
        let text = String::from_utf8_lossy(&bytes[values..values + word(60)]).into_owned();
        assert!(text.contains("KTXorientation\0rd\0") && text.contains("KTXwriter\0Treewright "), "{text:?}");
        let mut end = bytes.len();
        let levels = (0..count)
            .map(|k| {
                let (at, packed, plain) = (long(80 + 24 * k), long(88 + 24 * k), long(96 + 24 * k));
                assert_eq!(at + packed, end, "largest last, nothing between");
                end = at;
                let blocks = zstd::bulk::decompress(&bytes[at..at + packed], plain).unwrap();
                let (w, h) = ((width >> k).max(1), (height >> k).max(1));
                assert_eq!(blocks.len(), w.div_ceil(4) * h.div_ceil(4) * 16);
                let mut texels = vec![[0; 4]; w * h];
                for (i, block) in blocks.as_chunks::<16>().0.iter().enumerate() {
                    for (j, texel) in decode(*block).into_iter().enumerate() {
                        let (x, y) = (i % w.div_ceil(4) * 4 + j % 4, i / w.div_ceil(4) * 4 + j / 4);
                        if x < w && y < h {
                            texels[y * w + x] = texel;
                        }
                    }
                }
                (w, h, texels)
            })
            .collect();
        assert_eq!(end, values + word(60));
        let channels = bytes[dfd + 28 + 3];
        Read { size: (width as u32, height as u32), transfer: bytes[dfd + 14], channels, levels }
    }

    /// Peak signal to noise, decibels, over the first channels of texels that can be seen.
    fn psnr(wanted: &[[u8; 4]], got: &[[u8; 4]]) -> f32 {
        let (mut sum, mut count) = (0.0_f32, 0.0_f32);
        for (a, b) in wanted.iter().zip(got).filter(|(a, _)| a[3] >= 64) {
            for c in 0..3 {
                sum += f32::from(a[c].abs_diff(b[c])) * f32::from(a[c].abs_diff(b[c]));
            }
            count += 3.0;
        }
        10.0 / math::ln(10.0) * math::ln(255.0 * 255.0 * count / sum.max(1e-6))
    }

    #[test]
    fn leaves_come_back_sharp_and_every_mip_covers_what_level_0_does() {
        let maps = leaves();
        let levels = bake::mips(&maps, AlphaUse::CutOut);
        let color = read(&ktx2(&levels, MapUse::Color, AlphaUse::CutOut).unwrap());
        assert_eq!((color.size, color.transfer, color.channels), ((maps.width, maps.height), 2, 3));
        assert_eq!(color.levels.len(), 9);
        let wanted = bake::coverage(&maps, 1)[0];
        for ((width, height, texels), level) in color.levels.iter().zip(&levels) {
            assert_eq!([*width as u32, *height as u32], [level.width, level.height]);
            // Of a few texels one is more than a tenth.
            if texels.len() >= 64 {
                let shown = bake::coverage(&Maps { color: texels.clone(), ..level.clone() }, 1)[0];
                assert!((shown / wanted - 1.0).abs() < 0.1, "{width}: {shown} of {wanted}");
            }
        }
        let sharp = psnr(&levels[0].color, &color.levels[0].2);
        assert!(sharp > 36.0, "{sharp} dB");

        for (of, map) in [(MapUse::Normal, &maps.normal), (MapUse::Orm, &maps.orm)] {
            let file = read(&ktx2(&levels, of, AlphaUse::CutOut).unwrap());
            assert_eq!((file.transfer, file.channels), (1, 0));
            let wanted: Vec<[u8; 4]> = map.iter().map(|&[x, y, z]| [x, y, z, 255]).collect();
            let sharp = psnr(&wanted, &file.levels[0].2);
            assert!(sharp > 36.0, "{of:?}: {sharp} dB");
        }
    }

    #[test]
    fn opaque_colour_has_no_alpha_and_any_number_of_threads_gives_the_same_bytes() {
        let count = 64 * 32;
        let seed = Seed::new(4);
        let maps = Maps {
            width: 64,
            height: 32,
            color: (0..count).map(|i| std::array::from_fn(|c| seed.at(i * 4 + c as u64).bits() as u8)).collect(),
            normal: vec![[128, 128, 255]; count as usize],
            orm: vec![[255, 200, 0]; count as usize],
        };
        let levels = bake::mips(&maps, AlphaUse::Opaque);
        let make = || ktx2(&levels, MapUse::Color, AlphaUse::Opaque).unwrap();
        let all = make();
        let file = read(&all);
        assert_eq!((file.transfer, file.channels, file.levels.len()), (2, 0, 7));
        assert!(file.levels.iter().flat_map(|(_, _, texels)| texels).all(|t| t[3] == 255));
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert!(one.install(make) == all);
        let flat = read(&ktx2(&levels, MapUse::Orm, AlphaUse::Opaque).unwrap());
        assert!(flat.levels.iter().flat_map(|(_, _, texels)| texels).all(|t| *t == [255, 200, 0, 255]));
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let maps = |side: u32| {
            let count = (side * side) as usize;
            let (normal, orm) = (vec![[128, 128, 255]; count], vec![[0; 3]; count]);
            Maps { width: side, height: side, color: vec![[1; 4]; count], normal, orm }
        };
        let refused = |levels: &[Maps]| ktx2(levels, MapUse::Color, AlphaUse::Opaque).is_err();
        assert!(refused(&[]) && refused(&[maps(6)]) && refused(&[maps(8), maps(8)]));
        assert!(refused(&[Maps { color: Vec::new(), ..maps(8) }]) && !refused(&[maps(8), maps(4)]));
    }
}
