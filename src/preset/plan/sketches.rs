//! Parameters of sketching: what a designer draws, from where, and how large.

use serde::Serialize;

use super::{MorphKind, Plan};

impl Plan {
    /// All sketches that it names, each with those over it: those of variants, then those of sequences.
    pub fn drawn(&self) -> impl Iterator<Item = &SketchParams> {
        let of_morphs = self.morphs.iter().filter_map(|morph| match &morph.kind {
            MorphKind::Sketch { sketch, .. } => Some(sketch),
            _ => None,
        });
        self.sketches.iter().chain(of_morphs)
    }
}

/// A sketch of a crown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SketchParams {
    /// The preset's group of fields that asks for it, as `variants[2]` or `variants[2].sketch`.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub field: String,
    /// The SVG from the front, relative to the preset's folder.
    pub crown: String,
    /// The SVG from the side; empty for none.
    pub side: String,
    /// What becomes of the crown's depth where there is no side.
    pub depth: SketchDepth,
    /// Azimuth of the front, radians; 0 looks from +z.
    pub view: f32,
    /// Elevation of the front, radians, -π/2..=π/2; 0 is level, π/2 looks straight down.
    #[serde(skip_serializing_if = "is_level")]
    pub elevation: f32,
    /// How large it is.
    pub size: SketchScale,
    /// How much detail is kept, 0..=1.
    pub detail: f32,
    /// How lobes follow it.
    #[serde(skip_serializing_if = "is_adaptive")]
    pub method: SketchMethod,
    /// From where on they wilt, and count as covering what is drawn.
    #[serde(skip_serializing_if = "is_usual")]
    pub rules: SketchRules,
    /// What is drawn over the tree that it gives, one after another; these have none of their own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<SketchParams>,
}

impl SketchParams {
    /// What is drawn, without where the preset asks for it.
    #[must_use]
    pub fn told(&self) -> Self {
        let mut told = self.clone();
        told.forget_fields();
        told
    }

    /// Forgets where the preset asks for it, so that it equals the same asked for elsewhere.
    pub(crate) fn forget_fields(&mut self) {
        self.field.clear();
        self.then.iter_mut().for_each(Self::forget_fields);
    }

    /// It, and what is drawn over it, in order.
    pub fn each(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.then)
    }

    /// What is drawn last.
    #[must_use]
    pub fn last(&self) -> &Self {
        self.then.last().unwrap_or(self)
    }
}

fn is_usual(rules: &SketchRules) -> bool {
    *rules == SketchRules::default()
}

/// From where on lobes wilt, and count as covering what is drawn: what Wang et al. (2018) found by trials, and how much may wilt.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SketchRules {
    /// Share of a lobe that lies inside of what is drawn below which its branches wilt, 0..=1 (5.4.2: 30 %); at 0 none do.
    pub pruning: f32,
    /// Most of a crown's foliage that may wilt by [`SketchMethod::Adaptive`], 0..=1. The paper has no such limit.
    pub wilting: f32,
    /// How near to the outline of a cage those within it cover it, over the crown's size, above 0 (5.4.1: 10 pixels of the screen,
    /// which is the default where a crown is 500 across).
    pub covering: f32,
}

impl Default for SketchRules {
    fn default() -> Self {
        Self { pruning: 0.3, wilting: 0.5, covering: 0.02 }
    }
}

fn is_level(elevation: &f32) -> bool {
    *elevation == 0.0
}

fn is_adaptive(method: &SketchMethod) -> bool {
    *method == SketchMethod::Adaptive
}

/// How lobes follow a sketch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum SketchMethod {
    /// All that fills the sketch and keeps branches natural.
    Adaptive,
    /// Wang et al. 2018 to the letter: cages that adapt, and pruning (5.2 to 5.4).
    Paper,
    /// The same without pruning (5.4.1).
    Cages,
    /// The cage tree without cages that adapt: the paper's baseline (5.3).
    Baseline,
    /// One cage: what the paper compares with (Fig. 12).
    OneCage,
}

/// What becomes of a crown's depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum SketchDepth {
    /// It grows as the outline's area does, by the root.
    Grown,
    /// It stays.
    Kept,
    /// The outline is revolved about the crown's axis.
    Revolved,
}

/// How large a sketch is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum SketchScale {
    /// The crown's area.
    Crown,
    /// The crown's box.
    Stretched,
    /// A height, metres.
    Metres(f32),
}
