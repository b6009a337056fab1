//! Pictures as PNG, written here so that one picture is encoded by all threads.
//!
//! Rows are filtered by the row above (one filter for all) and deflated at level 1 in strips of [`STRIP`] rows, each a
//! stretch of one zlib stream that ends at a whole byte (deflate's full flush, as pigz does it) and an `IDAT` chunk of its
//! own. Strips don't depend on how many threads there are, so the bytes don't either; they cost about 1 % of size. With
//! the `image` crate's encoder, which is one thread's: 2048² RGBA foliage 95 ms and 7.2 MB at this level, 20 to 33 ms and
//! 9.5 MB at the fastest, 2.2 s and 5.4 MB at the smallest. zlib-rs behind flate2 is 1.3 to 1.5 times as fast at level 1 and its
//! files are a quarter larger. What is only looked at, contact sheets and the page's pictures, goes through the `image` crate's
//! fastest ([`encode_quickly`]). No ancillary chunks: no time, no gamma, no text; colour is sRGB and the other maps linear, as
//! glTF defines by use.

use flate2::{Compress, Compression, Crc, FlushCompress, Status};
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use rayon::prelude::*;

use super::ExportError;
use crate::bake::Maps;

/// Rows that are deflated together.
const STRIP: usize = 64;
/// Deflate's level.
const LEVEL: u32 = 1;
/// What a full flush ends with: the length of an empty stored block.
const FLUSHED: [u8; 4] = [0, 0, 0xff, 0xff];
/// The filter that takes the row above off.
const UP: u8 = 2;

/// What a picture holds a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngKind {
    /// Three bytes.
    Rgb,
    /// Four bytes, alpha last.
    Rgba,
}

impl PngKind {
    /// What the codecs call it.
    pub(super) const fn color(self) -> image::ExtendedColorType {
        match self {
            Self::Rgb => image::ExtendedColorType::Rgb8,
            Self::Rgba => image::ExtendedColorType::Rgba8,
        }
    }

    const fn channels(self) -> usize {
        match self {
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }
}

/// The three files of a material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedMaps {
    /// Base colour; RGBA or RGB as asked.
    pub color: Vec<u8>,
    /// Normal map, RGB.
    pub normal: Vec<u8>,
    /// Occlusion, roughness, metalness, RGB.
    pub orm: Vec<u8>,
}

/// Encodes 8-bit pixels, rows from the top.
///
/// # Errors
///
/// When the number of bytes isn't width × height × channels, or a side is 0.
pub fn encode(pixels: &[u8], width: u32, height: u32, kind: PngKind) -> Result<Vec<u8>, ExportError> {
    check(pixels, (width, height), kind)?;
    let line = width as usize * kind.channels();
    let strips: Vec<usize> = (0..height as usize).step_by(STRIP).collect();
    let deflated: Vec<Option<Strip>> = strips
        .par_iter()
        .map(|&first| {
            let last = (first + STRIP).min(height as usize);
            Strip::new(&filtered(pixels, line, first..last), last == height as usize)
        })
        .collect();
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let color = if kind == PngKind::Rgba { 6 } else { 2 };
    let header: Vec<u8> =
        [width.to_be_bytes(), height.to_be_bytes()].concat().into_iter().chain([8, color, 0, 0, 0]).collect();
    chunk(&mut out, b"IHDR", &header);
    let mut sum = Adler::EMPTY;
    for (i, strip) in deflated.iter().enumerate() {
        let fault = || ExportError::Picture { width, height, what: "it can't be deflated".to_owned() };
        let strip = strip.as_ref().ok_or_else(fault)?;
        sum = sum.followed_by(strip.sum);
        // The head of a zlib stream: a window of 32 KiB, the fastest level.
        let mut data = if i == 0 { vec![0x78, 0x01] } else { Vec::new() };
        data.extend_from_slice(&strip.bytes);
        if i + 1 == deflated.len() {
            data.extend(sum.value().to_be_bytes());
        }
        chunk(&mut out, b"IDAT", &data);
    }
    chunk(&mut out, b"IEND", &[]);
    Ok(out)
}

/// As [`encode`], for pictures that somebody waits to look at: one thread takes an eighth (contact sheets) to a third (noisy
/// normals) of the work, and files are a fifth larger (a third for foliage with its alpha).
///
/// # Errors
///
/// Those of [`encode`].
pub fn encode_quickly(pixels: &[u8], width: u32, height: u32, kind: PngKind) -> Result<Vec<u8>, ExportError> {
    check(pixels, (width, height), kind)?;
    let mut out = Vec::new();
    PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Sub)
        .write_image(pixels, width, height, kind.color())
        .map_err(|e| ExportError::Picture { width, height, what: e.to_string() })?;
    Ok(out)
}

/// Whether pixels fill a picture that has some.
pub(super) fn check(pixels: &[u8], (width, height): (u32, u32), kind: PngKind) -> Result<(), ExportError> {
    let wanted = u64::from(width).checked_mul(u64::from(height)).and_then(|n| n.checked_mul(kind.channels() as u64));
    if wanted == Some(pixels.len() as u64) && !pixels.is_empty() {
        return Ok(());
    }
    Err(ExportError::Picture { width, height, what: format!("{} bytes do not fill it", pixels.len()) })
}

/// Some rows with the byte that names their filter before each.
fn filtered(pixels: &[u8], line: usize, rows: std::ops::Range<usize>) -> Vec<u8> {
    let mut out = Vec::with_capacity(rows.len() * (line + 1));
    for row in rows {
        let own = &pixels[row * line..(row + 1) * line];
        out.push(UP);
        if row == 0 {
            out.extend_from_slice(own);
        } else {
            let above = &pixels[(row - 1) * line..row * line];
            out.extend(own.iter().zip(above).map(|(a, b)| a.wrapping_sub(*b)));
        }
    }
    out
}

/// A stretch of a zlib stream.
struct Strip {
    bytes: Vec<u8>,
    sum: Adler,
}

impl Strip {
    /// `None` when the encoder does not do what it says.
    fn new(rows: &[u8], ends: bool) -> Option<Self> {
        let mut deflate = Compress::new(Compression::new(LEVEL), false);
        // Room for all that can come, so that one call is all: the encoder behind flate2 forgets a flush that was asked
        // for while bytes of an earlier block still waited for room. Pages that nothing is written to cost nothing.
        let mut bytes = Vec::with_capacity(rows.len() + rows.len() / 8 + 256);
        let flush = if ends { FlushCompress::Finish } else { FlushCompress::Full };
        let status = deflate.compress_vec(rows, &mut bytes, flush).ok()?;
        let whole = if ends { status == Status::StreamEnd } else { bytes.ends_with(&FLUSHED) };
        (whole && deflate.total_in() == rows.len() as u64).then(|| Self { bytes, sum: Adler::of(rows) })
    }
}

/// zlib's checksum of some bytes, and how many they are.
#[derive(Clone, Copy)]
struct Adler {
    a: u32,
    b: u32,
    length: usize,
}

impl Adler {
    const MODULUS: u32 = 65_521;
    const EMPTY: Self = Self { a: 1, b: 0, length: 0 };

    fn of(bytes: &[u8]) -> Self {
        let (mut a, mut b) = (1_u32, 0_u32);
        // As many as sums of 32 bits hold.
        for part in bytes.chunks(5552) {
            for &byte in part {
                a += u32::from(byte);
                b += a;
            }
            (a, b) = (a % Self::MODULUS, b % Self::MODULUS);
        }
        Self { a, b, length: bytes.len() }
    }

    /// Of these bytes and then others.
    fn followed_by(self, next: Self) -> Self {
        let modulus = u64::from(Self::MODULUS);
        let ahead = u64::from(self.a) + modulus - 1;
        let a = (ahead + u64::from(next.a)) % modulus;
        let b = (u64::from(self.b) + u64::from(next.b) + ahead % modulus * (next.length as u64 % modulus)) % modulus;
        Self { a: a as u32, b: b as u32, length: self.length + next.length }
    }

    const fn value(self) -> u32 {
        self.b << 16 | self.a
    }
}

fn chunk(out: &mut Vec<u8>, name: &[u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let mut crc = Crc::new();
    crc.update(name);
    crc.update(data);
    out.extend_from_slice(name);
    out.extend_from_slice(data);
    out.extend(crc.sum().to_be_bytes());
}

/// Encodes a material's maps, the three side by side on rayon's threads; colour with alpha for `Rgba`, without for `Rgb`.
///
/// # Errors
///
/// When an array isn't of the stated size.
pub fn encode_maps(maps: &Maps, color: PngKind) -> Result<EncodedMaps, ExportError> {
    encode_maps_by(maps, color, &encode)
}

/// Encodes bytes of so many by so many pixels of a kind.
type Encode<'a, E> = dyn Fn(&[u8], u32, u32, PngKind) -> Result<Vec<u8>, E> + Sync + 'a;

/// As [`encode_maps`], by something that does what [`encode`] does: a cache in front of it.
///
/// # Errors
///
/// Those of `encode`.
pub fn encode_maps_by<E: Send>(maps: &Maps, color: PngKind, encode: &Encode<'_, E>) -> Result<EncodedMaps, E> {
    let (width, height) = (maps.width, maps.height);
    let (color, (normal, orm)) = rayon::join(
        || match color {
            PngKind::Rgba => encode(maps.color.as_flattened(), width, height, color),
            PngKind::Rgb => {
                let opaque: Vec<u8> = maps.color.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
                encode(&opaque, width, height, color)
            }
        },
        || {
            rayon::join(
                || encode(maps.normal.as_flattened(), width, height, PngKind::Rgb),
                || encode(maps.orm.as_flattened(), width, height, PngKind::Rgb),
            )
        },
    );
    Ok(EncodedMaps { color: color?, normal: normal?, orm: orm? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn pictures_of_any_height_come_back_from_another_decoder() {
        for (width, height) in [(1, 1), (3, 63), (5, 64), (7, 65), (33, 200), (300, 129)] {
            for (kind, channels) in [(PngKind::Rgb, 3), (PngKind::Rgba, 4)] {
                // Noise, which deflate makes longer, and then nothing.
                let seed = Seed::new(u64::from(height));
                let count = (width * height * channels) as u64;
                let byte = |i: u64| if i < count / 2 { seed.at(i).bits() as u8 } else { 7 };
                let pixels: Vec<u8> = (0..count).map(byte).collect();
                for encoded in [encode, encode_quickly].map(|encode| encode(&pixels, width, height, kind)) {
                    let png = encoded.unwrap();
                    let image = image::load_from_memory_with_format(&png, image::ImageFormat::Png).unwrap();
                    assert_eq!((image.width(), image.height()), (width, height));
                    assert_eq!(image.as_bytes(), pixels, "{width}x{height} {kind:?}");
                }
                for (width, height) in [(width, height + 1), (u32::MAX, u32::MAX)] {
                    assert!(
                        [encode, encode_quickly].iter().all(|encode| encode(&pixels, width, height, kind).is_err())
                    );
                }
            }
        }
    }

    /// Noise in strips of all lengths about that of one of the encoder's blocks, so that one ends among the last bytes.
    #[test]
    fn strips_are_whole_wherever_the_encoder_begins_a_block() {
        for width in 240..340_u32 {
            let (line, height) = (width as usize * 3, STRIP * 2);
            let pixels: Vec<u8> = (0..(line * height) as u64).map(|i| Seed::new(2).at(i).bits() as u8 & 63).collect();
            let png = encode(&pixels, width, height as u32, PngKind::Rgb).unwrap();
            let image = image::load_from_memory_with_format(&png, image::ImageFormat::Png);
            assert!(image.is_ok_and(|image| image.as_bytes() == pixels), "{width} pixels wide");
        }
    }

    #[test]
    fn sums_of_parts_are_sums_of_the_whole() {
        let bytes: Vec<u8> = (0..20_000_u64).map(|i| Seed::new(i).bits() as u8).collect();
        for at in [0, 1, 5552, 19_999, 20_000] {
            let (a, b) = bytes.split_at(at);
            let joined = Adler::EMPTY.followed_by(Adler::of(a)).followed_by(Adler::of(b));
            assert_eq!(joined.value(), Adler::of(&bytes).value());
        }
        assert_eq!(Adler::of(b"Wikipedia").value(), 0x11e6_0398);
    }
}
