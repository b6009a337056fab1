//! Arrays of plain numbers as one run of little-endian bytes, for `#[serde(with = "bulk")]`: what the cache keeps are
//! mostly such arrays, and serde's own way, one number at a time, takes ten times longer.

use std::fmt;
use std::marker::PhantomData;

use glam::{Vec2, Vec3};
use serde::de::{self, Visitor};
use serde::{Deserializer, Serializer};

/// A value of a fixed number of bytes, every pattern of which is one.
pub(crate) trait Plain: Copy {
    /// How many bytes it takes.
    const SIZE: usize;

    /// Writes it into that many bytes.
    fn write(self, bytes: &mut [u8]);

    /// Reads it from that many bytes.
    fn read(bytes: &[u8]) -> Self;
}

impl Plain for u8 {
    const SIZE: usize = 1;

    fn write(self, bytes: &mut [u8]) {
        bytes[0] = self;
    }

    fn read(bytes: &[u8]) -> Self {
        bytes[0]
    }
}

impl Plain for u32 {
    const SIZE: usize = 4;

    fn write(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.to_le_bytes());
    }

    fn read(bytes: &[u8]) -> Self {
        Self::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
    }
}

impl Plain for f32 {
    const SIZE: usize = 4;

    fn write(self, bytes: &mut [u8]) {
        self.to_bits().write(bytes);
    }

    fn read(bytes: &[u8]) -> Self {
        Self::from_bits(u32::read(bytes))
    }
}

impl<T: Plain, const N: usize> Plain for [T; N] {
    const SIZE: usize = N * T::SIZE;

    fn write(self, bytes: &mut [u8]) {
        for (value, bytes) in self.into_iter().zip(bytes.chunks_exact_mut(T::SIZE)) {
            value.write(bytes);
        }
    }

    fn read(bytes: &[u8]) -> Self {
        std::array::from_fn(|i| T::read(&bytes[i * T::SIZE..][..T::SIZE]))
    }
}

impl Plain for Vec2 {
    const SIZE: usize = 8;

    fn write(self, bytes: &mut [u8]) {
        self.to_array().write(bytes);
    }

    fn read(bytes: &[u8]) -> Self {
        Self::from_array(Plain::read(bytes))
    }
}

impl Plain for Vec3 {
    const SIZE: usize = 12;

    fn write(self, bytes: &mut [u8]) {
        self.to_array().write(bytes);
    }

    fn read(bytes: &[u8]) -> Self {
        Self::from_array(Plain::read(bytes))
    }
}

/// Writes an array.
///
/// # Errors
///
/// Those of the serializer.
pub(crate) fn serialize<T: Plain, S: Serializer>(values: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    let mut bytes = vec![0; values.len() * T::SIZE];
    for (value, bytes) in values.iter().zip(bytes.chunks_exact_mut(T::SIZE)) {
        value.write(bytes);
    }
    serializer.serialize_bytes(&bytes)
}

/// Reads an array.
///
/// # Errors
///
/// Those of the deserializer, and when the bytes are no whole number of values.
pub(crate) fn deserialize<'de, T: Plain, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    deserializer.deserialize_bytes(Values(PhantomData))
}

struct Values<T>(PhantomData<T>);

impl<T: Plain> Visitor<'_> for Values<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number of values of {} bytes", T::SIZE)
    }

    fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Vec<T>, E> {
        if !bytes.len().is_multiple_of(T::SIZE) {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        Ok(bytes.chunks_exact(T::SIZE).map(T::read).collect())
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize, PartialEq, Debug)]
    struct Arrays {
        #[serde(with = "super")]
        points: Vec<glam::Vec3>,
        #[serde(with = "super")]
        pixels: Vec<[u8; 3]>,
        #[serde(with = "super")]
        indices: Vec<u32>,
    }

    #[test]
    fn arrays_come_back_and_a_cut_one_is_an_error() {
        let points = vec![glam::Vec3::new(1.0, -2.5, f32::MIN)];
        let arrays = Arrays { points, pixels: vec![[1, 2, 3], [4, 5, 6]], indices: vec![7, u32::MAX] };
        let bytes = postcard::to_stdvec(&arrays).unwrap();
        assert_eq!(bytes.len(), 3 + 12 + 6 + 8);
        assert_eq!(bytes[13..20], [6, 1, 2, 3, 4, 5, 6]);
        assert_eq!(postcard::from_bytes::<Arrays>(&bytes).unwrap(), arrays);
        // The length of the points, 12 bytes, becomes 11: no whole point.
        let mut broken = bytes;
        assert_eq!(broken[0], 12);
        broken[0] = 11;
        assert!(postcard::from_bytes::<Arrays>(&broken).is_err());
    }
}
