//! What a picture is, without decoding it.

use std::io::Cursor;

use image::{ImageDecoder, ImageFormat, ImageReader};
use serde::Serialize;

use super::user_art::{ArtError, ArtFile};

/// A picture's kind and size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PictureInfo {
    /// `PNG`, `JPEG` or `WebP`.
    pub format: &'static str,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// 1 grey, 2 grey and alpha, 3 colour, 4 colour and alpha.
    pub channels: u8,
    /// Bits of a channel.
    pub bits: u16,
}

/// What a picture is; none for what is no PNG, JPEG or WebP file. Its pixels may still be damaged.
///
/// # Errors
///
/// When its header can't be read.
#[must_use]
pub fn picture_info(bytes: &[u8]) -> Option<Result<PictureInfo, ArtError>> {
    let format = match image::guess_format(bytes).ok()? {
        ImageFormat::Png => "PNG",
        ImageFormat::Jpeg => "JPEG",
        ImageFormat::WebP => "WebP",
        _ => return None,
    };
    let decoder = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?.into_decoder();
    let info = decoder.map(|decoder| {
        let ((width, height), color) = (decoder.dimensions(), decoder.color_type());
        let channels = color.channel_count();
        PictureInfo { format, width, height, channels, bits: color.bits_per_pixel() / u16::from(channels) }
    });
    Some(info.map_err(|error| ArtError::Decode { file: ArtFile::Color, reason: error.to_string() }))
}
