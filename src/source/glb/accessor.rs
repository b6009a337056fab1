//! Accessors of a glTF file: where their data lies, checked once, and the one way to read it.

use super::{GlbError, json};

/// Where an accessor's elements lie, every number checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// Elements, as stated. Backed by bytes of the file only if `start` is some.
    pub(super) count: u64,
    /// Numbers an element.
    pub(super) components: usize,
    kind: Kind,
    normalized: bool,
    /// First byte in the binary chunk; none when the data is elsewhere, sparse or compressed.
    start: Option<usize>,
    /// Bytes from one element to the next, at least an element's size.
    stride: usize,
}

/// Component types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Kind {
    fn of(number: u32) -> Option<Self> {
        Some(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// What a normalized integer is divided by; 1 for floats.
    fn most(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32_767.0,
            Self::U16 => 65_535.0,
            Self::U32 => u32::MAX as f32,
            Self::F32 => 1.0,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// The layouts of all accessors. With `container` the first buffer without a URI is the binary chunk.
pub(super) fn layouts(root: &json::Root, bin: &[u8], container: bool) -> Result<Vec<Layout>, GlbError> {
    if container
        && let Some(buffer) = root.buffers.first()
        && buffer.uri.is_none()
        && buffer.byte_length > bin.len() as u64
    {
        let length = buffer.byte_length;
        return Err(GlbError::Broken(format!("the buffer states {length} bytes, the file has {}", bin.len())));
    }
    for (i, view) in root.buffer_views.iter().enumerate() {
        let buffer = usize::try_from(view.buffer).ok().and_then(|b| root.buffers.get(b));
        let end = view.byte_offset.checked_add(view.byte_length);
        match (buffer, end) {
            (Some(buffer), Some(end)) if end <= buffer.byte_length => {}
            _ => return Err(GlbError::Broken(format!("buffer view {i} reaches beyond its buffer"))),
        }
    }
    root.accessors.iter().enumerate().map(|(i, accessor)| layout(i, accessor, root, container)).collect()
}

fn layout(index: usize, accessor: &json::Accessor, root: &json::Root, container: bool) -> Result<Layout, GlbError> {
    let broken = |what: &str| GlbError::Broken(format!("accessor {index} {what}"));
    let kind = Kind::of(accessor.component_type).ok_or_else(|| broken("has no known component type"))?;
    let components = match accessor.shape.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return Err(broken("has no known type")),
    };
    if accessor.count == 0 {
        return Err(broken("has no element"));
    }
    let size = kind.size() * components;
    let mut layout =
        Layout { count: accessor.count, components, kind, normalized: accessor.normalized, start: None, stride: size };
    let Some(view) = accessor.buffer_view else { return Ok(layout) };
    let view = usize::try_from(view).ok().and_then(|v| root.buffer_views.get(v));
    let view = view.ok_or_else(|| broken("names a buffer view that is not there"))?;
    let stride = view.byte_stride.unwrap_or(size as u64);
    if stride < size as u64 || stride > 252.max(size as u64) {
        return Err(broken("has elements further apart or closer together than a stride may say"));
    }
    let end = (accessor.count - 1)
        .checked_mul(stride)
        .and_then(|n| n.checked_add(size as u64))
        .and_then(|n| n.checked_add(accessor.byte_offset));
    if end.is_none_or(|end| end > view.byte_length) {
        return Err(broken("reaches beyond its buffer view"));
    }
    layout.stride = stride as usize;
    let embedded = container && view.buffer == 0 && root.buffers.first().is_some_and(|b| b.uri.is_none());
    if embedded && accessor.sparse.is_none() {
        // Both lie within the binary chunk, so their sum fits.
        layout.start = Some((view.byte_offset + accessor.byte_offset) as usize);
    }
    Ok(layout)
}

impl Layout {
    /// The elements, if their data is in `bin`; so a bound on what may be allocated.
    pub(super) fn available(&self, bin: &[u8]) -> Result<usize, GlbError> {
        self.elements(bin).map(|elements| elements.len())
    }

    /// The elements' bytes, `stride` apart, the last one perhaps cut to its size.
    fn elements<'a>(&self, bin: &'a [u8]) -> Result<std::slice::Chunks<'a, u8>, GlbError> {
        let start = self.start.ok_or_else(|| {
            GlbError::Unsupported("the vertex data is in another file, sparse or compressed, which isn't read".into())
        })?;
        let count = self.count as usize;
        let length = (count - 1) * self.stride + self.kind.size() * self.components;
        let bytes = bin.get(start..start + length);
        Ok(bytes.ok_or_else(|| GlbError::Broken("data reaches beyond the file".into()))?.chunks(self.stride))
    }

    /// All numbers, element after element; normalized integers as -1..=1 or 0..=1.
    pub(super) fn floats(&self, bin: &[u8]) -> Result<Vec<f32>, GlbError> {
        let elements = self.elements(bin)?;
        let size = self.kind.size();
        let mut out = Vec::with_capacity(elements.len() * self.components);
        for element in elements {
            out.extend(element[..size * self.components].chunks_exact(size).map(|b| self.float(b)));
        }
        Ok(out)
    }

    fn float(&self, b: &[u8]) -> f32 {
        let value = match self.kind {
            Kind::I8 => f32::from(b[0].cast_signed()),
            Kind::U8 => f32::from(b[0]),
            Kind::I16 => f32::from(i16::from_le_bytes([b[0], b[1]])),
            Kind::U16 => f32::from(u16::from_le_bytes([b[0], b[1]])),
            Kind::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Kind::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if self.normalized { (value / self.kind.most()).max(-1.0) } else { value }
    }

    /// All numbers as indices, each below `vertices`.
    pub(super) fn indices(&self, bin: &[u8], vertices: usize) -> Result<Vec<u32>, GlbError> {
        if self.components != 1 {
            return Err(GlbError::Broken("indices are not single numbers".into()));
        }
        let read: fn(&[u8]) -> u32 = match self.kind {
            Kind::U8 => |b| u32::from(b[0]),
            Kind::U16 => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            Kind::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            _ => return Err(GlbError::Broken("indices are not unsigned integers".into())),
        };
        let indices: Vec<u32> = self.elements(bin)?.map(read).collect();
        match indices.iter().find(|&&i| i as usize >= vertices) {
            Some(i) => Err(GlbError::Broken(format!("index {i} of {vertices} vertices"))),
            None => Ok(indices),
        }
    }
}

/// An accessor's stated bounds, where they are three finite numbers each; of normalized integers as what they mean.
pub(super) fn bounds(accessor: &json::Accessor, layout: &Layout) -> Option<[[f32; 3]; 2]> {
    let most = if layout.normalized { layout.kind.most() } else { 1.0 };
    let three = |v: &Option<Vec<f64>>| match v.as_deref() {
        Some(&[x, y, z]) => Some([x, y, z].map(|v| v as f32 / most)).filter(|p| p.iter().all(|v| v.is_finite())),
        _ => None,
    };
    Some([three(&accessor.min)?, three(&accessor.max)?])
}
