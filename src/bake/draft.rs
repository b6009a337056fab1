//! What a lit picture shows, before colours: a picture that is drawn again for every tint is drawn once and painted.
//!
//! Of each pixel the texels that it shows are noted, in the mips of the surfaces' pictures, one a triangle, each with the
//! light that falls on it, shade and share included. Of magnified texels the four around
//! would be smoother, and take up to four times the memory.

use glam::Vec3;

/// Notes of a picture, pixel by pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Draft {
    /// Parts of each pixel.
    counts: Vec<u16>,
    parts: Vec<Part>,
    /// Parts of pixels that are ended.
    ended: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    /// `u32::MAX` is white.
    texel: u32,
    /// Counted through all surfaces.
    picture: u16,
    /// Of [`ONE`].
    light: [u16; 3],
}

/// What a light of one is noted as.
const ONE: f32 = 4096.0;

impl Draft {
    /// Adds a part of the pixel that is not ended yet.
    pub(super) fn add(&mut self, picture: usize, texel: u32, light: Vec3) {
        let light = light.to_array().map(|v| (v * ONE + 0.5) as u16);
        self.parts.push(Part { texel, picture: picture as u16, light });
    }

    /// Ends a pixel.
    pub(super) fn end(&mut self) {
        self.counts.push((self.parts.len() - self.ended) as u16);
        self.ended = self.parts.len();
    }

    /// One after the other.
    pub(super) fn joined(all: Vec<Self>) -> Self {
        let mut all = all.into_iter();
        let mut whole = all.next().unwrap_or_default();
        for draft in all {
            whole.counts.extend(draft.counts);
            whole.parts.extend(draft.parts);
            whole.ended += draft.ended;
        }
        whole
    }

    /// The light of each pixel in turn, in linear light and by the share of it that is covered, from the colours of each
    /// picture and its mips.
    pub(super) fn paint<'a>(&'a self, colors: &'a [&[[u16; 4]]]) -> impl Iterator<Item = Vec3> + 'a {
        let mut parts = self.parts.iter();
        self.counts.iter().map(move |&count| {
            parts.by_ref().take(usize::from(count)).fold(Vec3::ZERO, |sum, part| {
                let texel = colors.get(usize::from(part.picture)).and_then(|all| all.get(part.texel as usize));
                let [r, g, b, _] = texel.copied().unwrap_or([u16::MAX; 4]);
                let color = Vec3::new(f32::from(r), f32::from(g), f32::from(b));
                let light = Vec3::from_array(part.light.map(f32::from));
                sum + color * light * (1.0 / (65535.0 * ONE))
            })
        })
    }

    /// About how many bytes it takes.
    pub(super) fn weight(&self) -> usize {
        self.counts.len() * 2 + self.parts.len() * std::mem::size_of::<Part>()
    }
}
