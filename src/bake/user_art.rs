//! The user's own pictures as maps: PNG, JPEG and WebP, decoded within limits.
//!
//! A picture of a leaf stands with its petiole at the bottom centre, as made ones do, and needs alpha. Leaves are drawn on
//! squares: a picture that is none keeps its proportions, with clear room beside or above it. Pale rims go. A missing normal
//! map is made from the colour's luminance, a missing roughness is even, and so is what leaves let through
//! (`transmission`). Maps of other sizes are resampled to the colour's. EXIF orientation and colour profiles are not read: pictures are taken as sRGB, upright.

use std::io::Cursor;

use glam::Vec3;
use image::{DynamicImage, ImageReader, Limits, imageops::FilterType};

use super::dilate::{clean, keep_mean};
use super::leaf_art::encode_normal;
use super::transmission::USUAL;
use super::{Maps, dilate};

/// What a picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArtUse {
    /// A leaf or spray: needs alpha; colour is carried on under it.
    Leaf,
    /// A tile of bark: alpha is not read, and what is made from it repeats at the edges.
    Bark,
}

/// Which of the files of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArtFile {
    /// Colour.
    Color,
    /// Normal map.
    Normal,
    /// Roughness.
    Roughness,
    /// What a leaf lets through.
    Transmission,
}

impl std::fmt::Display for ArtFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Color => "colour picture",
            Self::Normal => "normal map",
            Self::Roughness => "roughness map",
            Self::Transmission => "transmission map",
        })
    }
}

/// What a picture may ask of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArtLimits {
    /// Longest edge, pixels.
    pub edge: u32,
    /// Bytes that decoding one picture may take.
    pub bytes: u64,
    /// Longest edge of a leaf's maps: what is larger is shrunk.
    pub leaf: u32,
}

impl Default for ArtLimits {
    /// 8192 pixels, 512 MiB, 2048 texels.
    fn default() -> Self {
        Self { edge: 8192, bytes: 512 << 20, leaf: 2048 }
    }
}

/// Why pictures can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArtError {
    /// The bytes are no PNG, JPEG or WebP.
    #[error("the {file} is not a PNG, JPEG or WebP file")]
    Format {
        /// Which file.
        file: ArtFile,
    },
    /// The file is damaged or of a kind that the decoder doesn't know.
    #[error("the {file} can't be decoded: {reason}")]
    Decode {
        /// Which file.
        file: ArtFile,
        /// The decoder's words.
        reason: String,
    },
    /// Longer than the limit, or too much memory.
    #[error("the {file} is too large: at most {edge} pixels an edge and {bytes} bytes decoded are taken")]
    TooLarge {
        /// Which file.
        file: ArtFile,
        /// The limit, pixels.
        edge: u32,
        /// The limit, bytes.
        bytes: u64,
    },
    /// A leaf without transparency.
    #[error("the leaf's colour picture has no transparent pixel")]
    NoAlpha,
    /// A leaf that is transparent all over.
    #[error("the leaf's colour picture is transparent all over")]
    NothingSeen,
    /// A leaf that no texel of is at least half opaque: leaves are cut out there.
    #[error("the leaf's colour picture is nowhere more than half opaque")]
    NowhereOpaque,
}

impl ArtError {
    /// What helps.
    #[must_use]
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Format { .. } | Self::Decode { .. } => "save the picture again as PNG, JPEG or WebP",
            Self::TooLarge { .. } => "scale the picture down",
            Self::NoAlpha => "save it as PNG or WebP with an alpha channel that cuts the leaf out",
            Self::NowhereOpaque => "leaves are cut out at half their alpha: raise it to 1 where the leaf is",
            Self::NothingSeen => "its alpha channel may be inverted: what is opaque is the leaf",
        }
    }

    /// The file that the error is about.
    #[must_use]
    pub const fn file(&self) -> ArtFile {
        match self {
            Self::Format { file } | Self::Decode { file, .. } | Self::TooLarge { file, .. } => *file,
            Self::NoAlpha | Self::NothingSeen | Self::NowhereOpaque => ArtFile::Color,
        }
    }
}

/// Roughness where no map says otherwise: leaves, bark.
const ROUGH: [u8; 2] = [148, 224];

/// The maps of the user's own pictures, of the colour picture's size; of a leaf that is no square, of a square around it. See
/// the head of the file for what is made where a map is missing. Of `transmission`, of leaves only, grey counts: white lets
/// all light through.
///
/// # Errors
/// Bytes that are no picture, damaged or beyond `limits`; a leaf that has no transparent or no opaque pixel.
pub fn maps_from_images(
    color: &[u8],
    normal: Option<&[u8]>,
    roughness: Option<&[u8]>,
    transmission: Option<&[u8]>,
    purpose: ArtUse,
    limits: ArtLimits,
) -> Result<Maps, ArtError> {
    let picture = decode(color, ArtFile::Color, limits)?.into_rgba8();
    let (width, height) = picture.dimensions();
    let mut pixels: Vec<[u8; 4]> = picture.pixels().map(|p| p.0).collect();
    match purpose {
        ArtUse::Bark => pixels.iter_mut().for_each(|p| p[3] = 255),
        ArtUse::Leaf if pixels.iter().all(|p| p[3] == 255) => return Err(ArtError::NoAlpha),
        ArtUse::Leaf if pixels.iter().all(|p| p[3] == 0) => return Err(ArtError::NothingSeen),
        ArtUse::Leaf if pixels.iter().all(|p| p[3] < 128) => return Err(ArtError::NowhereOpaque),
        ArtUse::Leaf => {}
    }
    let resized = |bytes: &[u8], file: ArtFile| -> Result<DynamicImage, ArtError> {
        let image = decode(bytes, file, limits)?;
        let same = image.width() == width && image.height() == height;
        Ok(if same { image } else { image.resize_exact(width, height, FilterType::Triangle) })
    };
    let normal = match normal {
        Some(bytes) => resized(bytes, ArtFile::Normal)?
            .into_rgb8()
            .pixels()
            .map(|p| {
                encode_normal(Vec3::from_array(p.0.map(|c| f32::from(c) - 127.5)).max(Vec3::new(-128.0, -128.0, 1.0)))
            })
            .collect(),
        None => normals_of(&pixels, width as usize, height as usize, purpose),
    };
    let is_leaf = purpose == ArtUse::Leaf;
    let even = [255, ROUGH[usize::from(!is_leaf)], if is_leaf { USUAL } else { 0 }];
    let mut orm = vec![even; pixels.len()];
    let maps = [(roughness, ArtFile::Roughness, 1), (transmission.filter(|_| is_leaf), ArtFile::Transmission, 2)];
    for (bytes, file, channel) in maps {
        let Some(bytes) = bytes else { continue };
        let grey = resized(bytes, file)?.into_luma8();
        orm.iter_mut().zip(grey.pixels()).for_each(|(orm, p)| orm[channel] = p.0[0]);
    }
    let mut maps = Maps { width, height, color: pixels, normal, orm };
    if purpose == ArtUse::Leaf {
        // Before it shrinks, which mixes what is half opaque into the leaf.
        clean(&mut maps);
        maps = squared(maps.within(limits.leaf).into_owned());
        dilate(&mut maps);
        clean(&mut maps);
        keep_mean(&mut maps.color, maps.width as usize);
    }
    Ok(maps)
}

/// A leaf's maps in a square, at the middle of its lower edge; what is added is clear and level.
fn squared(maps: Maps) -> Maps {
    let (width, height) = (maps.width as usize, maps.height as usize);
    let edge = width.max(height);
    if width == height {
        return maps;
    }
    let (left, above) = ((edge - width) / 2, edge - height);
    fn placed<T: Copy>(own: &[T], (width, left, above, edge): (usize, usize, usize, usize), clear: T) -> Vec<T> {
        let mut all = vec![clear; edge * edge];
        for (row, line) in own.chunks_exact(width).enumerate() {
            all[(above + row) * edge + left..][..width].copy_from_slice(line);
        }
        all
    }
    let at = (width, left, above, edge);
    Maps {
        width: edge as u32,
        height: edge as u32,
        color: placed(&maps.color, at, [0; 4]),
        normal: placed(&maps.normal, at, [128, 128, 255]),
        orm: placed(&maps.orm, at, [255, ROUGH[0], USUAL]),
    }
}

/// Decodes one picture within limits.
pub(super) fn decode(bytes: &[u8], file: ArtFile, limits: ArtLimits) -> Result<DynamicImage, ArtError> {
    let too_large = ArtError::TooLarge { file, edge: limits.edge, bytes: limits.bytes };
    let open = || {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        let mut bounds = Limits::default();
        bounds.max_image_width = Some(limits.edge);
        bounds.max_image_height = Some(limits.edge);
        bounds.max_alloc = Some(limits.bytes);
        reader.limits(bounds);
        reader.format().is_some().then_some(reader)
    };
    let reader = open().ok_or(ArtError::Format { file })?;
    // The header first: a picture that only claims to be huge is refused before anything is allocated for it.
    let (width, height) = reader.into_dimensions().map_err(|e| error(&e, file, &too_large))?;
    if width > limits.edge || height > limits.edge || u64::from(width) * u64::from(height) * 4 > limits.bytes {
        return Err(too_large);
    }
    let reader = open().ok_or(ArtError::Format { file })?;
    reader.decode().map_err(|e| error(&e, file, &too_large))
}

fn error(error: &image::ImageError, file: ArtFile, too_large: &ArtError) -> ArtError {
    match error {
        image::ImageError::Limits(_) => too_large.clone(),
        image::ImageError::Unsupported(_) if !matches!(file, ArtFile::Color) => ArtError::Format { file },
        other => ArtError::Decode { file, reason: other.to_string() },
    }
}

/// Normals of the relief that luminance suggests: bright is high. Gentle, since shadows in a photograph are no relief.
pub(super) fn normals_of(pixels: &[[u8; 4]], width: usize, height: usize, purpose: ArtUse) -> Vec<[u8; 3]> {
    let light: Vec<f32> = pixels
        .iter()
        .map(|p| (0.3 * f32::from(p[0]) + 0.59 * f32::from(p[1]) + 0.11 * f32::from(p[2])) / 255.0)
        .collect();
    let wraps = purpose == ArtUse::Bark;
    let near = |i: usize, step: isize, n: usize| {
        let at = i as isize + step;
        if wraps { at.rem_euclid(n as isize) as usize } else { at.clamp(0, n as isize - 1) as usize }
    };
    let strength = if wraps { 2.0 } else { 1.2 };
    let mut normals = Vec::with_capacity(pixels.len());
    for y in 0..height {
        for x in 0..width {
            let here = light[y * width + x];
            // Beyond the cut of a leaf nothing is known: the surface goes on level.
            let at = |px: usize, py: usize| {
                let i = py * width + px;
                if pixels[i][3] < 128 { here } else { light[i] }
            };
            let dx = at(near(x, 1, width), y) - at(near(x, -1, width), y);
            let dy = at(x, near(y, -1, height)) - at(x, near(y, 1, height));
            normals.push(encode_normal(Vec3::new(-dx * strength, -dy * strength, 1.0)));
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgba, RgbaImage};

    fn png(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
        let image = RgbaImage::from_fn(width, height, |x, y| Rgba(pixel(x, y)));
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    fn leaf(x: u32, _: u32) -> [u8; 4] {
        if x < 4 { [60, 90, 30, 255] } else { [0; 4] }
    }

    fn load(bytes: &[u8], purpose: ArtUse) -> Result<Maps, ArtError> {
        maps_from_images(bytes, None, None, None, purpose, ArtLimits::default())
    }

    #[test]
    fn a_leaf_keeps_its_alpha_and_gets_colour_under_it() {
        let maps = load(&png(8, 6, leaf), ArtUse::Leaf).unwrap();
        assert_eq!((maps.width, maps.height, maps.color.len()), (8, 8, 64));
        assert!(maps.color.iter().all(|c| c[..3] == [60, 90, 30]));
        assert_eq!(maps.color[7][3], 0);
        assert!(maps.normal.iter().all(|n| *n == [128, 128, 255]));
    }

    #[test]
    fn a_leaf_that_is_no_square_keeps_its_proportions_on_the_lower_edge() {
        let solid = |maps: &Maps, x: u32, y: u32| maps.color[(y * maps.width + x) as usize][3] == 255;
        let cut = |x: u32, y: u32| if (x, y) == (0, 0) { [0; 4] } else { [60, 90, 30, 255] };
        let bump = png(4, 12, |_, _| [128, 200, 220, 255]);
        let slim =
            maps_from_images(&png(4, 12, cut), Some(&bump), None, None, ArtUse::Leaf, ArtLimits::default()).unwrap();
        assert_eq!((slim.width, slim.height, slim.normal.len(), slim.orm.len()), (12, 12, 144, 144));
        assert!((0..144).all(|i| solid(&slim, i % 12, i / 12) == ((4..8).contains(&(i % 12)) && i != 4)));
        assert_ne!(slim.normal[5], [128, 128, 255]);
        let wide = load(&png(12, 4, cut), ArtUse::Leaf).unwrap();
        assert!((0..144).all(|i| solid(&wide, i % 12, i / 12) == (i > 96)));
    }

    #[test]
    fn a_leaf_larger_than_any_is_shown_is_shrunk_before_it_is_squared() {
        let limits = ArtLimits { leaf: 16, ..ArtLimits::default() };
        for size in [(64, 4), (4, 64), (64, 64)] {
            let bytes = png(size.0, size.1, |x, y| if (x + y) % 64 == 0 { [0; 4] } else { [60, 90, 30, 255] });
            let maps = maps_from_images(&bytes, None, None, None, ArtUse::Leaf, limits).unwrap();
            assert_eq!((maps.width, maps.height, maps.color.len(), maps.orm.len()), (16, 16, 256, 256), "{size:?}");
            let seen = maps.color.iter().filter(|c| c[3] >= 128).count() as u32;
            assert!(seen.abs_diff(size.0 * size.1 / 16) < 3, "{size:?}: {seen}");
        }
    }

    #[test]
    fn maps_of_another_size_are_brought_to_the_colours() {
        let bump = png(3, 9, |_, _| [128, 200, 220, 255]);
        let rough = png(16, 2, |_, _| [40, 40, 40, 255]);
        let (color, limits) = (png(8, 6, leaf), ArtLimits::default());
        let all = |purpose| maps_from_images(&color, Some(&bump), Some(&rough), Some(&rough), purpose, limits).unwrap();
        let maps = all(ArtUse::Bark);
        assert!(maps.orm.iter().all(|o| *o == [255, 40, 0]) && maps.normal.len() == 48);
        assert!(maps.color.iter().all(|c| c[3] == 255));
        // What is let through is asked of leaves alone.
        assert!(all(ArtUse::Leaf).orm.iter().all(|o| *o == [255, 40, 40]));
    }

    #[test]
    fn a_leaf_lets_through_what_its_map_says_else_the_usual_and_goes_on_under_its_edge() {
        let half = png(8, 6, |x, _| if x < 2 { [200, 200, 200, 255] } else { [30, 30, 30, 255] });
        let color = png(8, 6, leaf);
        let told = maps_from_images(&color, None, None, Some(&half), ArtUse::Leaf, ArtLimits::default()).unwrap();
        // The lowest row: leaves end at the fourth column, and beyond it is the mean.
        assert_eq!([0, 1, 2, 3].map(|x| told.orm[7 * 8 + x][2]), [200, 200, 30, 30]);
        assert!((31..200).contains(&told.orm[7 * 8 + 6][2]));
        assert!(load(&color, ArtUse::Leaf).unwrap().orm.iter().all(|o| o[2] == USUAL));
        assert!(load(&color, ArtUse::Bark).unwrap().orm.iter().all(|o| o[2] == 0));
        let broken = maps_from_images(&color, None, None, Some(b"x"), ArtUse::Leaf, ArtLimits::default());
        assert_eq!(broken, Err(ArtError::Format { file: ArtFile::Transmission }));
    }

    #[test]
    fn leaves_without_a_cut_out_are_refused_with_a_hint() {
        let opaque = load(&png(4, 4, |_, _| [1, 2, 3, 255]), ArtUse::Leaf).unwrap_err();
        assert_eq!(opaque, ArtError::NoAlpha);
        assert!(opaque.help().contains("alpha channel"));
        assert_eq!(load(&png(4, 4, |_, _| [0; 4]), ArtUse::Leaf), Err(ArtError::NothingSeen));
        assert_eq!(load(&png(4, 4, |_, _| [60, 90, 30, 127]), ArtUse::Leaf), Err(ArtError::NowhereOpaque));
    }

    #[test]
    fn hostile_bytes_are_errors() {
        let good = png(32, 32, leaf);
        assert_eq!(load(b"", ArtUse::Bark), Err(ArtError::Format { file: ArtFile::Color }));
        assert_eq!(load(b"no picture at all", ArtUse::Bark), Err(ArtError::Format { file: ArtFile::Color }));
        for cut in 0..good.len() - 12 {
            assert!(load(&good[..cut], ArtUse::Leaf).is_err(), "cut at {cut}");
        }
        for i in 0..good.len() {
            let mut bad = good.clone();
            bad[i] ^= 0x55;
            let _ = load(&bad, ArtUse::Leaf);
        }
        let normal = maps_from_images(&good, Some(b"x"), None, None, ArtUse::Leaf, ArtLimits::default());
        assert_eq!(normal, Err(ArtError::Format { file: ArtFile::Normal }));
    }

    #[test]
    fn pictures_beyond_the_limits_are_refused_by_their_header() {
        let limits = ArtLimits { edge: 16, bytes: 1 << 20, ..ArtLimits::default() };
        let error = maps_from_images(&png(17, 4, leaf), None, None, None, ArtUse::Leaf, limits).unwrap_err();
        assert!(matches!(error, ArtError::TooLarge { edge: 16, .. }), "{error}");
        // A header that claims 2^31 pixels an edge.
        let mut bomb = png(8, 8, leaf);
        bomb[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(load(&bomb, ArtUse::Bark).is_err());
        let small = ArtLimits { bytes: 100, ..ArtLimits::default() };
        assert!(maps_from_images(&png(32, 32, leaf), None, None, None, ArtUse::Leaf, small).is_err());
    }
}
