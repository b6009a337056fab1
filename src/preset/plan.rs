//! What a preset means, checked and complete: one parameter struct a stage.
//!
//! Lengths are metres, angles radians, shares 0..=1. No `Option`, no text left to interpret, no value out of range.

mod growth;
mod mesh;
mod morphs;
mod shapes;
mod sketches;
mod variants;

use serde::Serialize;

use crate::base::Note;

pub use growth::{
    Beside, Company, Count, EndpointRule, Endpoints, FieldAxis, FieldPart, FieldPrimitive, FieldRegion, GrowIteration,
    GrowParams, GrowSpace, Guide, GuideAxis, GuideStart, LeaderRule, Light, Obstacle, Sampling, Volume,
};
pub(crate) use growth::{MOST_TAPER, USUAL_LENGTH_COST, USUAL_WHIM};
pub use mesh::{ANY, Backs, Forks, LeafCards, Lod, LodBudget, MeshParams, USUAL_ERROR_SHARE, USUAL_FLARE};
pub use morphs::{Clip, MorphKind, MorphParams, TargetLeaf};
pub use shapes::{ChainPath, ElasticParams, Facing, MirrorPlane, ShapeKind, ShapeParams, SmallRule};
pub use sketches::{SketchDepth, SketchMethod, SketchParams, SketchRules, SketchScale};
pub use variants::{
    BlendParams, BlendScale, BlendTree, Decided, FilterParams, MatchParams, OnlyParams, Origin, PatternParams, Pick,
    RadiusRule, ScoreParams, Selection, StemRule, Variant,
};

/// A preset, resolved: everything that a build needs but the bytes of the files it names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Name of the set: the preset file's stem.
    pub name: String,
    /// The preset's seed.
    pub seed: u64,
    /// The sources, in the order of their names.
    pub sources: Vec<Source>,
    /// One entry for each output variant, numbered from 1 in file names.
    pub variants: Vec<Variant>,
    /// Where each variant comes from in the preset's text; no part of what it means, so not of any key.
    #[serde(skip)]
    pub origins: Vec<Origin>,
    /// What blended variants are made of, one for each entry of the preset that blends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blends: Vec<BlendParams>,
    /// Entries of which only some trees are kept; not written where there is none, so that such plans keep their keys.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub selections: Vec<Selection>,
    /// Shape spaces that variants are taken from, one for each entry of the preset that does.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<ShapeParams>,
    /// Sequences of frames, one for each entry of the preset that asks for one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub morphs: Vec<MorphParams>,
    /// Sketches that variants follow.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sketches: Vec<SketchParams>,
    /// What is told of what the preset asks for, since it may not be what was meant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// The fields of `foliage` that the preset tells.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub foliage_told: Vec<String>,
    /// Twigs and leaf sites.
    pub dress: DressParams,
    /// Leaves that a source brings along, as a share of them.
    pub own_density: f32,
    /// The pictures of a leaf.
    pub leaf_art: LeafArt,
    /// Which leaves wear them.
    pub leaf_wear: Wear,
    /// What becomes of the green of pictures that Treewright did not make; not written where it stays, so that such plans keep
    /// their keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaf_turn: Option<LeafTurn>,
    /// The maps of the bark.
    pub bark_art: BarkArt,
    /// Whose bark is worn.
    pub bark_wear: Wear,
    /// Tubes.
    pub mesh: MeshParams,
    /// Texels along an edge of the light map that every mesh gets a second UV set for; 0 for none.
    pub lightmap: u32,
    /// What vertices tell about wind; not written where it is nothing, so that such plans keep their keys.
    #[serde(skip_serializing_if = "is_still")]
    pub wind: WindData,
    /// The levels of detail, finest first; never empty, the first is `Full`.
    pub lods: Vec<LodBudget>,
    /// The set's atlas.
    pub atlas: AtlasParams,
    /// Simple shapes for physics; not written where they are the usual ones, so that such plans keep their keys.
    #[serde(skip_serializing_if = "ColliderParams::is_usual")]
    pub colliders: ColliderParams,
    /// Whom the files are written for; not written where it is `Generic` alone, so that such plans keep their keys.
    #[serde(skip_serializing_if = "is_generic")]
    pub engines: Vec<Profile>,
}

/// An engine that files are written for, and the textures that they name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Profile {
    /// The engine.
    pub engine: Engine,
    /// Its textures; not written where they are PNG, so that such plans keep their keys.
    #[serde(skip_serializing_if = "TextureFormat::is_png")]
    pub textures: TextureFormat,
}

impl Plan {
    /// What a variant's files are called; the first is number 1.
    pub(crate) fn called(&self, number: i32) -> String {
        format!("{}_{number:03}", self.name)
    }
}

impl From<Engine> for Profile {
    /// With PNG.
    fn from(engine: Engine) -> Self {
        Self { engine, textures: TextureFormat::Png }
    }
}

/// What textures are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum TextureFormat {
    /// PNG, which everything reads.
    Png,
    /// WebP without loss: the same texels, in fewer bytes but for normal maps.
    Webp,
    /// KTX2 (Basis UASTC) with mips: compressed on the graphics card too.
    Ktx2,
}

impl TextureFormat {
    const fn is_png(&self) -> bool {
        matches!(self, Self::Png)
    }
}

impl Engine {
    /// Whether its importer of glTF reads such textures and shows them as they are: Godot 4.6 turns the colours of KTX2 to
    /// linear light twice (godot#99589), so that trees are far too dark.
    #[must_use]
    pub const fn reads(self, textures: TextureFormat) -> bool {
        match textures {
            TextureFormat::Png => true,
            TextureFormat::Webp => matches!(self, Self::Generic | Self::Godot | Self::Web),
            TextureFormat::Ktx2 => matches!(self, Self::Generic | Self::Unity | Self::Web),
        }
    }
}

/// An engine that files are written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Engine {
    /// glTF 2.0 with `MSFT_lod`.
    Generic,
    /// Godot 4.
    Godot,
    /// Unity, by UnityGLTF or glTFast.
    Unity,
    /// Unreal, by Interchange.
    Unreal,
    /// Bevy.
    Bevy,
    /// three.js and Babylon.js: quantized and packed.
    Web,
}

/// What becomes a collider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColliderParams {
    /// Wood thinner than this radius has no capsule, metres.
    pub least_radius: f32,
    /// Most capsules of a plant; the thickest are kept.
    pub most: usize,
    /// Convex hulls around the crown; 0 for none.
    pub crown: usize,
    /// Most corners of each of those, 8..=255.
    pub corners: usize,
}

impl Default for ColliderParams {
    /// Wood of 10 cm and more across, at most 32 capsules, no hulls.
    fn default() -> Self {
        Self { least_radius: 0.05, most: 32, crown: 0, corners: 32 }
    }
}

impl ColliderParams {
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

/// What vertices tell about wind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum WindData {
    /// Nothing.
    Nothing,
    /// Weights, phases and pivots.
    Attributes,
}

fn is_still(wind: &WindData) -> bool {
    *wind == WindData::Nothing
}

fn is_generic(engines: &[Profile]) -> bool {
    engines == [Engine::Generic.into()]
}

/// A named source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// The preset's name for it.
    pub name: String,
    /// Where it comes from.
    pub recipe: SourceRecipe,
    /// Its named parts.
    pub parts: Vec<Part>,
}

/// A part of a source, for partial blending.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// The preset's name for it.
    pub name: String,
    /// Which chains are in it.
    pub region: PartRegion,
}

/// Which chains a part holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum PartRegion {
    /// The chain of this number in the source's plant, from 0, and all that it bears.
    Branch(u32),
    /// Chains by where they stand.
    Region {
        /// Lowest height of a chain's base, as a share of the plant's height 0..=1.
        low: f32,
        /// Highest.
        high: f32,
        /// The side that tips point to from the plant's axis: radians from the front (+z) towards +x.
        azimuth: f32,
        /// How far to both sides of it, radians, 0..=π.
        within: f32,
    },
}

/// How a source comes about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum SourceRecipe {
    /// Guiding-vector synthesis.
    Grow(GrowParams),
    /// A file.
    Import(ImportParams),
    /// Guiding-vector synthesis with parameters estimated from a file.
    Like(LikeParams),
}

impl SourceRecipe {
    /// What is imported for it.
    #[must_use]
    pub const fn import(&self) -> Option<&ImportParams> {
        match self {
            Self::Grow(_) => None,
            Self::Import(params) => Some(params),
            Self::Like(like) => Some(&like.scan),
        }
    }
}

/// A plant grown like an imported one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LikeParams {
    /// The plant to grow like; its height is as the file says.
    pub scan: ImportParams,
    /// Address of all randomness of the grown plant.
    pub seed: u64,
    /// Height of the grown plant; `AsIs` for that of the scan.
    pub height: ImportHeight,
}

/// Parameters of an import.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportParams {
    /// The file, relative to the preset's folder, `/` between folders.
    pub file: String,
    /// Which axis of the file points up.
    pub up: UpAxis,
    /// Height to scale the plant to.
    pub height: ImportHeight,
    /// Names of a mesh's objects that are the tree; all of it where there are none, but of several trees that stand apart the first.
    pub objects: Vec<String>,
    /// Names of a mesh's materials or parts that are leaves, whatever else says otherwise.
    pub leaves: Vec<String>,
    /// Names of a mesh's materials or parts that are wood.
    pub wood: Vec<String>,
}

impl Default for ImportParams {
    /// No file yet; everything by the data.
    fn default() -> Self {
        Self {
            file: String::new(),
            up: UpAxis::Detect,
            height: ImportHeight::AsIs,
            objects: Vec::new(),
            leaves: Vec::new(),
            wood: Vec::new(),
        }
    }
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum UpAxis {
    /// By the data.
    Detect,
    /// Y.
    Y,
    /// Z.
    Z,
}

/// The scale of an imported plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum ImportHeight {
    /// As the file says.
    AsIs,
    /// Scaled to this height, metres.
    Metres(f32),
}

/// Longest leaf of a plant, as a share of its extent, where nobody says otherwise.
pub const USUAL_LEAF_SHARE: f32 = 1.0 / 15.0;

/// Twigs and leaves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DressParams {
    /// Leaves a cubic metre of crown hull are scaled by this; 1 is the species' normal foliage.
    pub density: f32,
    /// Most leaves on one plant, whatever the density asks for.
    pub most_leaves: u32,
    /// Leaf length from base to tip, metres; for a needle or compound picture, of the whole picture. 0 is as long as the
    /// leaves of the source that leaves are taken from.
    pub leaf_size: f32,
    /// Longest leaf, as a share of the plant's extent: a picture meant for a tall tree must not swallow a sapling. 0, of a preset
    /// that tells the leaves' size, is what that is of the tallest source, if it is more than the usual fifteenth.
    pub leaf_share: f32,
    /// How much leaf sizes vary about it, 0..=0.9.
    pub leaf_spread: f32,
    /// Angle between a leaf and its twig, radians.
    pub leaf_angle: f32,
    /// Length of a twig, metres; twigs grow at most a few of these. 0 for none: leaves stand on the plant's own thin wood.
    pub twig_length: f32,
    /// How leaves stand about a twig.
    pub phyllotaxis: Phyllotaxis,
    /// How far twigs and leaves droop, 0..=1.
    pub droop: f32,
    /// How many pictures of the leaf there are: slots 0..pictures.
    pub pictures: u16,
}

/// How leaves follow each other along a twig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Phyllotaxis {
    /// All around, by the golden angle.
    Spiral,
    /// In two rows at its sides, which lie level.
    Distichous,
}

/// What wears the art of a plan, beside the art that imported sources bring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Wear {
    /// Everything.
    All,
    /// What sources bring their own art for keeps it; the plan's is for the rest. A set has one bark: the sources' if
    /// all of them bring some.
    Rest,
    /// Everything wears what this source brings; index into the plan's sources.
    Source(usize),
}

/// The pictures of a leaf.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum LeafArt {
    /// Made by Treewright.
    Made {
        /// The outline.
        shape: LeafShape,
        /// Colour, linear-light sRGB primaries 0..=1.
        color: [f32; 3],
        /// The colour that other pictures come near to: that of leaves which turn last. The same but in autumn.
        late: [f32; 3],
        /// Hue, brightness variation between pictures and over a blade, 0..=1.
        variation: f32,
        /// Pixels along an edge of a picture.
        size: u32,
    },
    /// The user's own pictures: paths of colour with alpha and, where not empty, of the normal and transmission maps.
    Files {
        /// Colour with alpha.
        color: String,
        /// Normal map, or empty.
        normal: String,
        /// Light that is let through, or empty.
        transmission: String,
    },
}

impl LeafArt {
    /// The colour of a made leaf's picture, linear: the first one's is `color`, and any number of others are spread evenly
    /// on the way to `late`. White where leaves are not made.
    #[must_use]
    pub fn tint(&self, picture: u32) -> [f32; 3] {
        let Self::Made { color, late, .. } = self else { return [1.0; 3] };
        between(*color, *late, picture)
    }
}

/// The colour that a picture takes of those between two: any number of pictures are spread evenly over them.
fn between(first: [f32; 3], last: [f32; 3], picture: u32) -> [f32; 3] {
    // Halves, quarters, eighths (van der Corput 1935).
    let way = picture.reverse_bits() as f32 / 4_294_967_296.0;
    std::array::from_fn(|i| first[i] + (last[i] - first[i]) * way)
}

/// What becomes of the green of pictures of leaves that Treewright did not make.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum LeafTurn {
    /// It gets lighter, by as much in each channel, linear.
    Lighter {
        /// Factors of red, green and blue.
        gain: [f32; 3],
    },
    /// It is so in the mean of a picture, linear: of the first picture `first`, of others on the way to `last`.
    Colors {
        /// The colour of leaves that turn first.
        first: [f32; 3],
        /// That of those which turn last; the same where there is one colour.
        last: [f32; 3],
    },
}

impl LeafTurn {
    /// The colour, or factors, of a picture.
    #[must_use]
    pub fn color(&self, picture: u32) -> [f32; 3] {
        match *self {
            Self::Lighter { gain } => gain,
            Self::Colors { first, last } => between(first, last, picture),
        }
    }

    /// How many pictures are made of each of so many, for leaves of one tree not to turn all alike.
    #[must_use]
    pub fn copies(&self, pictures: usize) -> u16 {
        /// As many as there are made leaves of, where nothing is told.
        const COLORS: usize = 4;
        match self {
            Self::Colors { first, last } if first != last => COLORS.div_ceil(pictures.max(1)) as u16,
            _ => 1,
        }
    }
}

/// Outlines of made leaves; each has its own margin, veins and petiole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum LeafShape {
    /// Rounded lobes.
    Oak,
    /// Ovate with a serrate margin.
    Birch,
    /// Elliptic with an entire margin.
    Beech,
    /// Palmate, pointed lobes.
    Maple,
    /// Long and narrow.
    Willow,
    /// Leaflets along a rachis.
    Ash,
    /// A tuft of needles on a shoot.
    Pine,
    /// Heart-shaped with a serrate margin, on long stalks.
    Linden,
    /// Triangular, on long stalks.
    Poplar,
    /// Broadly elliptic, doubly serrate.
    Elm,
    /// Small and narrow, entire.
    Olive,
    /// Leaflets of a pinnate frond, side by side: the frond itself is the plant's branch.
    Palm,
    /// A flat comb of shoots with short needles.
    Spruce,
    /// Branchlets in scales.
    Cypress,
}

impl LeafShape {
    /// Whether it is of needles or scales, without a blade.
    #[must_use]
    pub const fn is_conifer(self) -> bool {
        matches!(self, Self::Pine | Self::Spruce | Self::Cypress)
    }

    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Oak,
        Self::Birch,
        Self::Beech,
        Self::Maple,
        Self::Willow,
        Self::Ash,
        Self::Pine,
        Self::Linden,
        Self::Poplar,
        Self::Elm,
        Self::Olive,
        Self::Palm,
        Self::Spruce,
        Self::Cypress,
    ];
}

/// The maps of the bark.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum BarkArt {
    /// Made by Treewright.
    Made {
        /// The pattern.
        pattern: BarkPattern,
        /// Colour of the ridges, linear 0..=1.
        color: [f32; 3],
        /// Pixels along an edge.
        size: u32,
    },
    /// The user's own maps, tiling both ways: paths of colour and, where not empty, normal and roughness.
    Files {
        /// Colour.
        color: String,
        /// Normal map, or empty.
        normal: String,
        /// Roughness, or empty.
        roughness: String,
    },
}

/// Patterns of made bark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum BarkPattern {
    /// Deep, interlaced vertical furrows.
    Furrowed,
    /// Smooth and pale with dark lenticels and scars.
    Papery,
    /// Plates with cracks between.
    Plated,
    /// Nearly smooth, fine wrinkles.
    Smooth,
    /// Long strips of fibres that run up the trunk.
    Fibrous,
    /// Rings around the trunk: scars of old fronds, or bands of lenticels.
    Ringed,
}

/// The set's atlas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AtlasParams {
    /// Pixels along an edge, a power of two in 256..=8192.
    pub size: u32,
    /// Pixels between two pictures.
    pub gutter: u32,
}

impl AtlasParams {
    /// Edge of a picture that takes `cell` pixels along an edge with its share of the gutters; of one that is hardly larger than
    /// those, all of it.
    #[must_use]
    pub const fn inside(&self, cell: u32) -> u32 {
        let gutters = 2 * self.gutter.div_ceil(2);
        if cell < 4 * gutters { cell } else { cell - gutters }
    }
}
