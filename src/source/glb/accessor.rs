//! Accessors of a glTF file: where their data lies, checked once, and the one way to read it.

use super::buffers::Buffers;
use super::{GlbError, json};

/// Where an accessor's elements lie, every number checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// Elements, as stated. Backed by bytes of a buffer only if `at` is some.
    pub(super) count: u64,
    /// Numbers an element.
    pub(super) components: usize,
    kind: Kind,
    normalized: bool,
    /// Buffer and first byte in it; none when there are no bytes: all zeros, but for what is sparse.
    at: Option<(usize, usize)>,
    /// Bytes from one element to the next, at least an element's size.
    stride: usize,
    /// Elements that replace others.
    sparse: Option<Sparse>,
}

/// Elements that replace others, in rising order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Sparse {
    count: usize,
    kind: Kind,
    /// Buffer and first byte of the indices.
    indices: (usize, usize),
    /// Buffer and first byte of the elements.
    values: (usize, usize),
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

/// Checks that buffer views lie in their buffers.
pub(super) fn check_views(root: &json::Root) -> Result<(), GlbError> {
    for (i, view) in root.buffer_views.iter().enumerate() {
        let buffer = usize::try_from(view.buffer).ok().and_then(|b| root.buffers.get(b));
        let end = view.byte_offset.checked_add(view.byte_length);
        match (buffer, end) {
            (Some(buffer), Some(end)) if end <= buffer.byte_length => {}
            _ => return Err(GlbError::Broken(format!("buffer view {i} reaches beyond its buffer"))),
        }
    }
    Ok(())
}

/// The layouts of all accessors; of views that were checked and unpacked.
pub(super) fn layouts(root: &json::Root) -> Result<Vec<Layout>, GlbError> {
    root.accessors.iter().enumerate().map(|(i, accessor)| layout(i, accessor, root)).collect()
}

fn layout(index: usize, accessor: &json::Accessor, root: &json::Root) -> Result<Layout, GlbError> {
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
    let mut layout = Layout {
        count: accessor.count,
        components,
        kind,
        normalized: accessor.normalized,
        at: None,
        stride: size,
        sparse: None,
    };
    if let Some(sparse) = &accessor.sparse {
        layout.sparse = Some(
            self::sparse(sparse, size, accessor.count, root)
                .ok_or_else(|| broken("has sparse elements that reach beyond their buffer views"))?,
        );
    }
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
    // Both lie within the buffer, so their sum fits.
    layout.at = Some((view.buffer as usize, (view.byte_offset + accessor.byte_offset) as usize));
    Ok(layout)
}

fn sparse(sparse: &json::Sparse, size: usize, of: u64, root: &json::Root) -> Option<Sparse> {
    let kind = Kind::of(sparse.indices.component_type).filter(|k| matches!(k, Kind::U8 | Kind::U16 | Kind::U32))?;
    let place = |part: &json::SparsePart, size: usize| {
        let view = root.buffer_views.get(usize::try_from(part.buffer_view).ok()?)?;
        let end = sparse.count.checked_mul(size as u64)?.checked_add(part.byte_offset)?;
        (end <= view.byte_length).then(|| (view.buffer as usize, (view.byte_offset + part.byte_offset) as usize))
    };
    (sparse.count >= 1 && sparse.count <= of).then_some(())?;
    Some(Sparse {
        count: usize::try_from(sparse.count).ok()?,
        kind,
        indices: place(&sparse.indices, kind.size())?,
        values: place(&sparse.values, size)?,
    })
}

/// An accessor with the bytes behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elements<'a> {
    layout: Layout,
    /// From the first element on; empty where all are zero.
    bytes: &'a [u8],
    /// Indices and values that replace others.
    sparse: Option<(&'a [u8], &'a [u8])>,
}

fn little(kind: Kind, b: &[u8]) -> u32 {
    match kind {
        Kind::U8 => u32::from(b[0]),
        Kind::U16 => u32::from(u16::from_le_bytes([b[0], b[1]])),
        _ => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
    }
}

impl<'a> Elements<'a> {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.layout.count as usize
    }

    /// Numbers an element.
    pub(super) fn components(&self) -> usize {
        self.layout.components
    }

    fn raw(&self, i: usize) -> Option<&'a [u8]> {
        let size = self.layout.kind.size() * self.layout.components;
        if let Some((indices, values)) = self.sparse {
            let kind = self.layout.sparse.map_or(Kind::U8, |s| s.kind);
            let at = |k: usize| little(kind, &indices[k * kind.size()..]) as usize;
            let (mut low, mut high) = (0, indices.len() / kind.size());
            while low < high {
                let middle = usize::midpoint(low, high);
                if at(middle) < i { low = middle + 1 } else { high = middle }
            }
            if low < indices.len() / kind.size() && at(low) == i {
                return values.get(low * size..(low + 1) * size);
            }
        }
        let start = i * self.layout.stride;
        self.bytes.get(start..start + size)
    }

    /// An element's first numbers, zeros where it has fewer; normalized integers as -1..=1 or 0..=1.
    pub(super) fn get<const N: usize>(&self, i: usize) -> [f32; N] {
        let mut out = [0.0; N];
        if let Some(raw) = self.raw(i) {
            let size = self.layout.kind.size();
            for (value, bytes) in out.iter_mut().zip(raw.chunks_exact(size)) {
                *value = self.layout.float(bytes);
            }
        }
        out
    }

    /// All as indices, each below `vertices`.
    pub(super) fn indices(&self, vertices: usize) -> Result<Vec<u32>, GlbError> {
        if self.layout.components != 1 {
            return Err(GlbError::Broken("indices are not single numbers".into()));
        }
        let kind = self.layout.kind;
        if !matches!(kind, Kind::U8 | Kind::U16 | Kind::U32) {
            return Err(GlbError::Broken("indices are not unsigned integers".into()));
        }
        let indices: Vec<u32> = (0..self.len()).map(|i| self.raw(i).map_or(0, |b| little(kind, b))).collect();
        match indices.iter().find(|&&i| i as usize >= vertices) {
            Some(i) => Err(GlbError::Broken(format!("index {i} of {vertices} vertices"))),
            None => Ok(indices),
        }
    }
}

/// Whether places are in rising order, each once, and below `count`.
fn is_rising(mut places: impl Iterator<Item = u32>, count: u64) -> bool {
    let mut next = 0;
    places.all(|place| {
        let place = u64::from(place);
        let is_next = place >= next;
        next = place + 1;
        is_next && place < count
    })
}

impl Layout {
    /// The elements with their bytes. The number of elements is then at most that of all bytes.
    pub(super) fn elements<'a>(&self, buffers: &'a Buffers<'_>) -> Result<Elements<'a>, GlbError> {
        let beyond = || GlbError::Broken("data reaches beyond the file".into());
        let of = |(buffer, start): (usize, usize), length: usize| {
            let missing = |place: &str| GlbError::Unsupported(format!("the vertex data is in {place}"));
            let bytes = buffers.get(buffer).ok_or_else(beyond)?.as_deref().map_err(|place| missing(place))?;
            bytes.get(start..).and_then(|b| b.get(..length)).ok_or_else(beyond)
        };
        let count = usize::try_from(self.count).map_err(|_| beyond())?;
        let size = self.kind.size() * self.components;
        let bytes = match self.at {
            Some(at) => of(at, (count - 1) * self.stride + size)?,
            None => {
                // Zeros cost no byte of the file, so what may be claimed is bounded by what there is.
                let total: usize = buffers.iter().flatten().map(|b| b.len()).sum();
                if count > total || self.sparse.is_none() {
                    return Err(GlbError::Unsupported("it has vertex data without bytes".into()));
                }
                &[]
            }
        };
        let sparse = match self.sparse {
            Some(s) => {
                let indices = of(s.indices, s.count * s.kind.size())?;
                if !is_rising(indices.chunks_exact(s.kind.size()).map(|b| little(s.kind, b)), self.count) {
                    let what = format!("sparse elements are not in rising order, or beyond the {count} that there are");
                    return Err(GlbError::Broken(what));
                }
                Some((indices, of(s.values, s.count * size)?))
            }
            None => None,
        };
        Ok(Elements { layout: *self, bytes, sparse })
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
