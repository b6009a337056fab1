//! Buffer views that meshopt packed (EXT_meshopt_compression) are unpacked before anything looks at them.
//!
//! Each becomes a buffer of its own, so that accessors need not know. The codecs are meshoptimizer's, which are made for
//! data that nobody vouches for; counts and sizes are checked here. The filters are applied in plain single precision,
//! as the extension defines them, so that numbers don't depend on the processor.
//!
//! Limits: elements of at most [`WIDEST`] bytes; no quaternion filter, which only animations use; all that is unpacked
//! takes at most [`MOST`] times the bytes that the file has, and is refused beyond.

use std::borrow::Cow;

use super::buffers::Buffers;
use super::{GlbError, json};

/// Bytes of unpacked data for each byte of all buffers, and beside that.
const MOST: (usize, usize) = (8, 64 << 10);
/// Most bytes of an element.
const WIDEST: usize = 64;

/// Unpacks every packed view of `root` into a new buffer.
pub(super) fn unpack(root: &mut json::Root, buffers: &mut Buffers<'_>) -> Result<(), GlbError> {
    let all: usize = buffers.iter().flatten().map(|b| b.len()).sum();
    let mut left = MOST.0 * all + MOST.1;
    for i in 0..root.buffer_views.len() {
        let view = &mut root.buffer_views[i];
        let Some(packed) = view.extensions.meshopt.take().or_else(|| view.extensions.khr_meshopt.take()) else {
            continue;
        };
        let broken = |what: &str| GlbError::Broken(format!("buffer view {i}, packed by meshopt, {what}"));
        let number = |n: u64| usize::try_from(n).map_err(|_| broken("is larger than any memory"));
        let (start, length) = (number(packed.byte_offset)?, number(packed.byte_length)?);
        let (count, stride) = (number(packed.count)?, number(packed.byte_stride)?);
        let size = count.checked_mul(stride).filter(|&s| s > 0).ok_or_else(|| broken("has no size"))?;
        if view.byte_length != size as u64 {
            return Err(broken("unpacks to another size than it states"));
        }
        left = left.checked_sub(size).ok_or_else(|| {
            GlbError::Unsupported("its packed data unpacks to far more than a file of its size should".to_owned())
        })?;
        let buffer = usize::try_from(packed.buffer).ok().filter(|&b| b < buffers.len());
        let buffer = buffer.ok_or_else(|| broken("names a buffer that is not there"))?;
        let data = match &buffers[buffer] {
            // Of a file that is missing; whoever asks for the data is told.
            Err(place) => Err(place.clone()),
            Ok(bytes) => {
                let bytes = bytes.get(start..).and_then(|b| b.get(..length));
                let bytes = bytes.ok_or_else(|| broken("reaches beyond its buffer"))?;
                Ok(decoded(&packed, bytes, count, stride).map_err(|what| broken(&what))?)
            }
        };
        (view.buffer, view.byte_offset) = (buffers.len() as u64, 0);
        root.buffers.push(json::Buffer { uri: None, byte_length: size as u64 });
        buffers.push(data.map(Cow::Owned));
    }
    Ok(())
}

fn decoded(packed: &json::Meshopt, bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let unreadable = |_| "can't be unpacked".to_owned();
    match (packed.mode.as_str(), stride) {
        ("ATTRIBUTES", _) => {
            let mut data = vertices(bytes, count, stride)?;
            filter(&packed.filter, &mut data, stride)?;
            Ok(data)
        }
        ("TRIANGLES", _) if !count.is_multiple_of(3) => Err("has corners of no triangle".to_owned()),
        ("TRIANGLES", 2) => meshopt::decode_index_buffer::<u16>(bytes, count).map(shorts).map_err(unreadable),
        ("TRIANGLES", 4) => meshopt::decode_index_buffer::<u32>(bytes, count).map(words).map_err(unreadable),
        ("INDICES", 2) => meshopt::decode_index_sequence::<u16>(bytes, count).map(shorts).map_err(unreadable),
        ("INDICES", 4) => meshopt::decode_index_sequence::<u32>(bytes, count).map(words).map_err(unreadable),
        (mode, _) => Err(format!("is of mode {mode:?} with {stride} bytes an element, which is not read")),
    }
}

fn shorts(values: Vec<u16>) -> Vec<u8> {
    values.into_iter().flat_map(u16::to_le_bytes).collect()
}

fn words(values: Vec<u32>) -> Vec<u8> {
    values.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// Vertices of `stride` bytes; the decoder wants the size as a type.
fn vertices(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    fn of<const N: usize>(bytes: &[u8], count: usize) -> Option<Vec<u8>>
    where
        [[u8; 4]; N]: Default,
    {
        let found = meshopt::decode_vertex_buffer::<[[u8; 4]; N]>(bytes, count).ok()?;
        Some(found.as_flattened().as_flattened().to_vec())
    }
    let found = match stride {
        4 => of::<1>(bytes, count),
        8 => of::<2>(bytes, count),
        12 => of::<3>(bytes, count),
        16 => of::<4>(bytes, count),
        20 => of::<5>(bytes, count),
        24 => of::<6>(bytes, count),
        28 => of::<7>(bytes, count),
        32 => of::<8>(bytes, count),
        36 => of::<9>(bytes, count),
        40 => of::<10>(bytes, count),
        44 => of::<11>(bytes, count),
        48 => of::<12>(bytes, count),
        52 => of::<13>(bytes, count),
        56 => of::<14>(bytes, count),
        60 => of::<15>(bytes, count),
        WIDEST => of::<16>(bytes, count),
        _ => return Err(format!("has {stride} bytes an element, which is not read")),
    };
    found.ok_or_else(|| "can't be unpacked".to_owned())
}

/// Undoes a filter in place.
fn filter(name: &str, data: &mut [u8], stride: usize) -> Result<(), String> {
    match (name, stride) {
        ("" | "NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            for v in data.chunks_exact_mut(4) {
                let [x, y, one] = [v[0], v[1], v[2]].map(|b| f32::from(b.cast_signed()));
                let n = octahedral(x, y, one, 127.0);
                v.iter_mut().zip(n).for_each(|(b, n)| *b = (n as i8).cast_unsigned());
            }
        }
        ("OCTAHEDRAL", 8) => {
            for v in data.chunks_exact_mut(8) {
                let at = |k: usize| f32::from(i16::from_le_bytes([v[k], v[k + 1]]));
                let n = octahedral(at(0), at(2), at(4), 32_767.0);
                v.chunks_exact_mut(2).zip(n).for_each(|(b, n)| b.copy_from_slice(&(n as i16).to_le_bytes()));
            }
        }
        ("EXPONENTIAL", _) if stride.is_multiple_of(4) => {
            for v in data.chunks_exact_mut(4) {
                let bits = i32::from_le_bytes([v[0], v[1], v[2], v[3]]);
                let (exponent, mantissa) = (bits >> 24, (bits << 8) >> 8);
                // The exponent fits: it is a signed byte, and powers below the least normal number are zero.
                let power = f32::from_bits((exponent + 127).clamp(0, 254).cast_unsigned() << 23);
                v.copy_from_slice(&(mantissa as f32 * power).to_le_bytes());
            }
        }
        _ => return Err(format!("has the filter {name:?}, which is not read")),
    }
    Ok(())
}

/// A unit vector from its place on the octahedron, times `most`.
fn octahedral(x: f32, y: f32, one: f32, most: f32) -> [f32; 3] {
    let one = one.max(1.0);
    let (mut x, mut y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    x -= below.copysign(x);
    y -= below.copysign(y);
    let scale = most / (x * x + y * y + z * z).sqrt().max(1e-6);
    [x, y, z].map(|v| (v * scale).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(packed: json::Meshopt, stride: u64) -> json::Root {
        let byte_length = packed.count * packed.byte_stride;
        let extensions = json::ViewExtensions { meshopt: Some(Box::new(packed)), khr_meshopt: None };
        let view = json::View { buffer: 0, byte_offset: 0, byte_length, byte_stride: Some(stride), extensions };
        json::Root { buffer_views: vec![view], ..json::Root::default() }
    }

    fn packed(mode: &str, count: u64, byte_stride: u64, byte_length: usize) -> json::Meshopt {
        json::Meshopt {
            buffer: 0,
            byte_offset: 0,
            byte_length: byte_length as u64,
            byte_stride,
            count,
            mode: mode.to_owned(),
            filter: String::new(),
        }
    }

    #[test]
    fn what_meshopt_packed_comes_back() {
        let indices: Vec<u32> = (0..300).map(|i| i / 3 + i % 3).collect();
        let bytes = meshopt::encode_index_buffer(&indices, 200).unwrap();
        let mut root = root(packed("TRIANGLES", 300, 4, bytes.len()), 4);
        let mut buffers: Buffers<'_> = vec![Ok(Cow::Borrowed(bytes.as_slice()))];
        unpack(&mut root, &mut buffers).unwrap();
        let found: Vec<u32> =
            buffers[1].as_ref().unwrap().chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        // The codec may turn a triangle's corners.
        for (a, b) in found.chunks(3).zip(indices.chunks(3)) {
            assert!((0..3).any(|k| (0..3).all(|i| a[i] == b[(i + k) % 3])));
        }
        assert_eq!((root.buffer_views[0].buffer, root.buffers.len()), (1, 1));
    }

    #[test]
    fn vertices_come_back_and_no_damage_hurts() {
        let positions: Vec<[f32; 3]> = (0..200).map(|i| [i as f32, (i * i) as f32 * 0.01, -3.0]).collect();
        let bytes = meshopt::encode_vertex_buffer(&positions).unwrap();
        let run = |bytes: &[u8], count: u64| {
            let mut root = root(packed("ATTRIBUTES", count, 12, bytes.len()), 12);
            let mut buffers: Buffers<'_> = vec![Ok(Cow::Owned(bytes.to_vec()))];
            unpack(&mut root, &mut buffers).map(|()| buffers[1].clone())
        };
        let whole: Vec<u8> = positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(run(&bytes, 200).unwrap().unwrap().into_owned(), whole);
        assert!(run(&bytes[..bytes.len() - 1], 200).is_err());
        assert!(run(&bytes, 1 << 40).is_err());
        for k in 0..bytes.len() {
            let mut hurt = bytes.clone();
            hurt[k] ^= 0x5a;
            let _ = run(&hurt, 200);
        }
    }

    #[test]
    fn filters_are_undone() {
        let mut up = vec![0, 0, 127, 0, 127, 0, 127, 9];
        filter("OCTAHEDRAL", &mut up, 4).unwrap();
        assert_eq!(up, [0, 0, 127, 0, 127, 0, 0, 9]);
        let mut number = ((-2_i32 << 24) | 10).to_le_bytes().to_vec();
        filter("EXPONENTIAL", &mut number, 4).unwrap();
        assert_eq!(number, 2.5_f32.to_le_bytes());
        assert!(filter("QUATERNION", &mut number, 4).is_err());
    }
}
