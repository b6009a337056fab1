//! The bytes behind a glTF file's buffers and pictures: its binary chunk, base64 in the text, or files beside it.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::{GlbError, json};

/// The buffers in their order; of one whose bytes are missing, where they were to be.
pub(super) type Buffers<'a> = Vec<Result<Cow<'a, [u8]>, String>>;

/// All buffers. With `container` the first buffer without a URI is the binary chunk.
///
/// # Errors
///
/// When a buffer is shorter than it says, or its base64 is none.
pub(super) fn buffers<'a>(
    root: &json::Root,
    bin: &'a [u8],
    container: bool,
    files: &BTreeMap<String, &'a [u8]>,
) -> Result<Buffers<'a>, GlbError> {
    let one = |(i, buffer): (usize, &json::Buffer)| {
        let bytes: Result<Cow<'a, [u8]>, String> = match &buffer.uri {
            None if i == 0 && container => Ok(Cow::Borrowed(bin)),
            None => Err("nowhere that it tells".to_owned()),
            Some(uri) => match inline(uri) {
                Some(data) => Ok(Cow::Owned(
                    base64(data).ok_or_else(|| GlbError::Broken(format!("buffer {i} holds what is no base64")))?,
                )),
                None => {
                    let bytes = file_name(uri).and_then(|name| files.get(&name)).map(|bytes| Cow::Borrowed(*bytes));
                    bytes.ok_or_else(|| {
                        let is_web = uri.contains("://");
                        let why = if is_web { "an address, and those are not read" } else { "which is not there" };
                        format!("`{uri}`, {why}")
                    })
                }
            },
        };
        match &bytes {
            Ok(bytes) if buffer.byte_length > bytes.len() as u64 => {
                let length = buffer.byte_length;
                Err(GlbError::Broken(format!("buffer {i} states {length} bytes, there are {}", bytes.len())))
            }
            _ => Ok(bytes),
        }
    };
    root.buffers.iter().enumerate().map(one).collect()
}

/// The data of a `data:` URI; none for any other.
pub(super) fn inline(uri: &str) -> Option<&str> {
    let (head, data) = uri.strip_prefix("data:")?.split_once(',')?;
    head.ends_with(";base64").then_some(data)
}

/// The name of the file that a URI means, with its percent signs decoded; none for a `data:` URI.
pub(crate) fn file_name(uri: &str) -> Option<String> {
    if uri.starts_with("data:") {
        return None;
    }
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let digit = |at: usize| after.get(at).and_then(|&b| (b as char).to_digit(16));
        match (byte, digit(0), digit(1)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((high * 16 + low) as u8);
                rest = &after[2..];
            }
            _ => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    crate::source::scene::path_of(&String::from_utf8_lossy(&bytes))
}

/// Decodes base64, with or without padding.
pub(super) fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_ascii().trim_end_matches('=').as_bytes();
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for group in text.chunks(4) {
        let mut bits = 0_u32;
        for &b in group {
            let value = match b {
                b'A'..=b'Z' => b - b'A',
                b'a'..=b'z' => b - b'a' + 26,
                b'0'..=b'9' => b - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        if group.len() == 1 {
            return None;
        }
        bits <<= 6 * (4 - group.len() as u32);
        out.extend(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_signs_are_decoded() {
        let of = |text| base64(text).map(|b| String::from_utf8(b).unwrap());
        assert_eq!(of("TWFu").as_deref(), Some("Man"));
        assert_eq!(of("TWE=").as_deref(), Some("Ma"));
        assert_eq!(of("TQ").as_deref(), Some("M"));
        assert_eq!(of("").as_deref(), Some(""));
        assert_eq!((of("T"), of("T!WF")), (None, None));
        assert_eq!(file_name("my%20oak.bin").as_deref(), Some("my oak.bin"));
        assert_eq!(file_name("50%.bin").as_deref(), Some("50%.bin"));
        assert_eq!(file_name("data:,x"), None);
    }

    #[test]
    fn a_buffer_whose_file_is_missing_is_named() {
        let buffer = |uri: &str| json::Buffer { uri: Some(uri.to_owned()), byte_length: 2 };
        let root = json::Root { buffers: vec![buffer("tree.bin"), buffer("leaf.bin")], ..json::Root::default() };
        let files = BTreeMap::from([("leaf.bin".to_owned(), &[1_u8, 2][..])]);
        let found = buffers(&root, &[], false, &files).unwrap();
        assert_eq!(found[0].as_ref().unwrap_err(), "`tree.bin`, which is not there");
        assert_eq!(found[1].as_deref(), Ok(&[1_u8, 2][..]));
        let web = json::Root { buffers: vec![buffer("https://a.example/oak.bin")], ..json::Root::default() };
        let found = buffers(&web, &[], false, &files).unwrap();
        assert!(found[0].as_ref().unwrap_err().contains("an address"));
    }
}
