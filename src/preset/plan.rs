//! What a preset means, checked and complete: one parameter struct a stage.
//!
//! Lengths are metres, angles radians, shares 0..=1. No `Option`, no text left to interpret, no value out of range.

use serde::Serialize;

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
    /// What blended variants are made of, one for each entry of the preset that blends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blends: Vec<BlendParams>,
    /// Entries of which only some trees are kept; not written where there is none, so that such plans keep their keys.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub selections: Vec<Selection>,
    /// Twigs and leaf sites.
    pub dress: DressParams,
    /// The pictures of a leaf.
    pub leaf_art: LeafArt,
    /// Which leaves wear them.
    pub leaf_wear: Wear,
    /// The maps of the bark.
    pub bark_art: BarkArt,
    /// Whose bark is worn.
    pub bark_wear: Wear,
    /// Tubes.
    pub mesh: MeshParams,
    /// Texels along an edge of the light map that every mesh gets a second UV set for; 0 for none.
    pub lightmap: u32,
    /// The levels of detail, finest first; never empty, the first is `Full`.
    pub lods: Vec<Lod>,
    /// The set's atlas.
    pub atlas: AtlasParams,
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

/// Parameters of growth, in the words of Xu and Mould 2015.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrowParams {
    /// Address of all randomness of this plant.
    pub seed: u64,
    /// Height of the finished plant, metres.
    pub height: f32,
    /// Nodes of the graph (3.1.1), 500..=400_000.
    pub nodes: u32,
    /// Horizontal width of the graph's region over its height.
    pub width: f32,
    /// The iterations (3.1.4), in order.
    pub iterations: Vec<GrowIteration>,
    /// Radius of a branch tip, metres.
    pub tip_radius: f32,
    /// Exponent of the allometric rule for radii, 1..=5.
    pub allometry: f32,
    /// What a metre of wood adds to what is below it, in tips, 0..=50: 0 leaves branches of even thickness between forks.
    pub taper: f32,
    /// How much wider a stem is at the ground than the rule says, as a share of its radius, 0..=3.
    pub flare: f32,
    /// Where the flare ends, in radii of the stem, 0.5..=30.
    pub flare_height: f32,
    /// How much of the graph's crookedness stays, 0..=1: 0 for smooth curves, 1 for the paths as they are.
    pub crookedness: f32,
    /// Clear bole, plant heights, 0..=1: below it no branch leaves the structure, and what the first iteration's paths
    /// share becomes separate stems.
    pub bole: f32,
    /// Longest a branch may be in radii of its base, 50..=10000; slimmer ones are shed.
    pub slenderness: f32,
    /// The graph, and what else is in the space that the plant grows in.
    pub space: GrowSpace,
}

/// Where a plant grows: how fine the graph is, light, obstacles and neighbours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrowSpace {
    /// Address of the graph's nodes; has nothing to do with the plant's seed, so that many plants share a graph.
    pub graph_seed: u64,
    /// How many times finer than an even graph of as many nodes the graph is near the plant, 1..=4; 1 for an even graph.
    pub detail: f32,
    /// Where light comes from.
    pub light: Light,
    /// What nothing grows through.
    pub obstacles: Vec<Obstacle>,
    /// Air between an obstacle and a branch's axis, metres, 0..=100.
    pub clearance: f32,
    /// Plants that grow beside this one and share the space with it.
    pub beside: Vec<Beside>,
    /// Whether what grows beside is a part of the plant.
    pub company: Company,
}

impl Default for GrowSpace {
    fn default() -> Self {
        Self {
            graph_seed: 1,
            detail: 1.0,
            light: Light::default(),
            obstacles: Vec::new(),
            clearance: 0.1,
            beside: Vec::new(),
            company: Company::LeftOut,
        }
    }
}

/// Light that branches turn to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Light {
    /// Towards the light; any length but 0.
    pub direction: [f32; 3],
    /// 0..=1: 0 for none.
    pub strength: f32,
}

impl Default for Light {
    fn default() -> Self {
        Self { direction: [0.0, 1.0, 0.0], strength: 0.0 }
    }
}

/// Something solid; metres, from the foot of the plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Obstacle {
    /// A box along the axes.
    Box {
        /// Smallest corner.
        low: [f32; 3],
        /// Largest corner.
        high: [f32; 3],
    },
    /// A closed mesh.
    Mesh {
        /// The file, relative to the preset's folder, `/` between folders.
        file: String,
        /// Where its origin stands.
        at: [f32; 3],
    },
}

/// A plant beside another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Beside {
    /// How it grows; its own `space` does not count.
    pub params: GrowParams,
    /// Where it stands, metres from the foot of the first: x and z.
    pub at: [f32; 2],
}

/// What becomes of plants that grew beside another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Company {
    /// They only took their share of the space.
    LeftOut,
    /// They are parts of the plant, each with a stem of its own.
    Kept,
}

/// One pass of shortest paths and the branches that it adds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrowIteration {
    /// Where the new branches end.
    pub endpoints: Endpoints,
    /// How guiding vectors turn from node to node.
    pub guide: Guide,
    /// Guiding vectors of the source nodes before the pass.
    pub start: GuideStart,
    /// Which endpoints are kept.
    pub keep: EndpointRule,
}

/// Endpoint placement (3.2.2, 3.2.3).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Endpoints {
    /// Early: samples in a volume.
    Volume {
        /// The volume; lengths are shares of the plant's height.
        shape: Volume,
        /// How many.
        count: Count,
        /// How they are chosen.
        sampling: Sampling,
    },
    /// Late: among the nodes exactly `k` edges from the structure, the outermost share `t` by hops from the root.
    Surface {
        /// k of the paper, 1..=30.
        k: u32,
        /// t of the paper, 0..=1: the share of the surface outside the exclusion zone.
        t: f32,
        /// How many.
        count: u32,
        /// How they are chosen.
        sampling: Sampling,
    },
}

/// How many endpoints a volume gets (3.2.4).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Count {
    /// So many.
    Number(u32),
    /// So many in a cubic plant height, of what the graph's region holds of the volume.
    Density(f32),
}

/// How endpoints are chosen among the nodes where they may lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Sampling {
    /// A Poisson-disc distribution: they keep their distance.
    Poisson,
    /// Each node with the same chance: clumps and gaps.
    Uniform,
    /// A Poisson-disc distribution in tiers, as the whorls of conifers: in the lowest quarter of every `spacing`, plant
    /// heights.
    Whorls {
        /// From tier to tier.
        spacing: f32,
    },
}

/// A volume for early endpoints, upright about the plant's axis; all lengths in plant heights.
///
/// `hollow` is 0 for a full volume; 0.8 leaves a shell of a fifth of the radius.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Volume {
    /// A point: the tip of a trunk.
    Point {
        /// Height.
        height: f32,
        /// How far off the axis, to a side that the seed chooses.
        out: f32,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Height of its lowest point.
        bottom: f32,
        /// Height of its highest point.
        top: f32,
        /// Horizontal radius.
        radius: f32,
        /// Of distances from the centre.
        hollow: f32,
    },
    /// The upper half of an ellipsoid.
    HalfEllipsoid {
        /// Height of its flat face.
        bottom: f32,
        /// Height of its highest point.
        top: f32,
        /// Horizontal radius at the flat face.
        radius: f32,
        /// Of distances from the middle of the flat face.
        hollow: f32,
    },
    /// A cone, tip up.
    Cone {
        /// Height of its base.
        bottom: f32,
        /// Height of its tip.
        top: f32,
        /// Radius of its base.
        radius: f32,
        /// Of distances from the axis.
        hollow: f32,
    },
    /// A cylinder.
    Cylinder {
        /// Height of its base.
        bottom: f32,
        /// Height of its upper face.
        top: f32,
        /// Radius.
        radius: f32,
        /// Of distances from the axis.
        hollow: f32,
    },
    /// A box, its sides along x and z.
    Box {
        /// Height of its lower face.
        bottom: f32,
        /// Height of its upper face.
        top: f32,
        /// Extent along x.
        width: f32,
        /// Extent along z.
        depth: f32,
        /// Of distances from the axis.
        hollow: f32,
    },
    /// The inside of a closed mesh, scaled alike in all directions to stand between the two heights, the file's vertical
    /// axis on the plant's.
    Mesh {
        /// GLB, glTF, OBJ or PLY file, relative to the preset's folder.
        file: String,
        /// Which axis of the file points up; `Detect` is Y.
        up: UpAxis,
        /// Height of its lowest point.
        bottom: f32,
        /// Height of its highest point.
        top: f32,
    },
    /// The inside of an SVG silhouette revolved about the vertical through the middle of its bounds.
    Outline {
        /// SVG file, relative to the preset's folder.
        file: String,
        /// Height of its lowest point.
        bottom: f32,
        /// Height of its highest point.
        top: f32,
    },
}

/// How a guiding vector follows from its parent node's (3.2.1). Positive angles turn away from the up vector, that is
/// outwards and down; radians a hop, and hops are counted from the structure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Guide {
    /// The same turn at every hop.
    Constant {
        /// α.
        alpha: f32,
    },
    /// Eq. 1: `alpha1` for the first `h0` hops, `alpha2` afterwards.
    Piecewise {
        /// α1.
        alpha1: f32,
        /// α2.
        alpha2: f32,
        /// h0.
        h0: u32,
    },
    /// Eq. 1 with an α1 of its own for each source node, uniform between two angles.
    Random {
        /// Smallest α1.
        low: f32,
        /// Largest α1.
        high: f32,
        /// α2.
        alpha2: f32,
        /// h0.
        h0: u32,
    },
    /// Eq. 2: θ·sqrt(β/π), with β the polar angle of the node.
    Polar {
        /// θ.
        theta: f32,
    },
    /// One rule for branches that leave the structure below a height, another for those above (Fig. 17b).
    Split {
        /// Plant heights.
        height: f32,
        /// Below it.
        lower: Box<Guide>,
        /// At it and above.
        upper: Box<Guide>,
    },
    /// Vectors set directly (Fig. 8): the weighted sum of some primitives, made a unit vector. Where it vanishes, the
    /// parent's vector is kept.
    Field {
        /// The primitives.
        parts: Vec<FieldPart>,
    },
}

/// One primitive of a field, and where it counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FieldPart {
    /// What points where.
    pub primitive: FieldPrimitive,
    /// By how much it counts against the others; negative turns it round.
    pub weight: f32,
    /// Where it counts.
    pub region: FieldRegion,
}

/// Fields of unit vectors; lengths in plant heights. The primitives of Wejchert and Haumann 1991 and those of Fig. 8.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum FieldPrimitive {
    /// The same everywhere: `lean` radians from upright, to the side at `turn` radians from x towards z.
    Uniform {
        /// From upright.
        lean: f32,
        /// About the vertical.
        turn: f32,
    },
    /// Round the vertical and up at the angle `rise` from level, radians (Fig. 8a).
    Helical {
        /// From level; negative falls.
        rise: f32,
    },
    /// Round a line through a point of the plant's axis (Fig. 8b: about z).
    Rotational {
        /// Direction of the line.
        axis: FieldAxis,
        /// Height of the point.
        height: f32,
    },
    /// Upwards along spheres around a point of the plant's axis (Fig. 8c).
    Spherical {
        /// Height of the point.
        height: f32,
    },
    /// Away from a point of the plant's axis: a source; a sink with a negative weight.
    Radial {
        /// Height of the point.
        height: f32,
    },
    /// Level, away from the plant's axis.
    Outward,
}

/// An axis of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum FieldAxis {
    /// Level.
    X,
    /// Up.
    Y,
    /// Level.
    Z,
}

/// Where a primitive counts; lengths in plant heights. Its weight falls to nothing over the length `soft` outwards from
/// the rim.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum FieldRegion {
    /// Everywhere.
    Everywhere,
    /// Between two heights.
    Layer {
        /// Lower height.
        bottom: f32,
        /// Upper height.
        top: f32,
        /// Length of the transition.
        soft: f32,
    },
    /// Within a distance of a point of the plant's axis.
    Ball {
        /// Height of the point.
        height: f32,
        /// The distance.
        radius: f32,
        /// Length of the transition.
        soft: f32,
    },
    /// Within a distance of the plant's axis.
    Core {
        /// The distance.
        radius: f32,
        /// Length of the transition.
        soft: f32,
    },
}

/// Guiding vectors of the source nodes at the start of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum GuideStart {
    /// As the pass that made the node left them.
    Kept,
    /// Turned from the vertical by an angle that changes with height: `low` at the ground, `high` at the top; radians.
    ByHeight {
        /// Angle from the vertical at the ground.
        low: f32,
        /// Angle from the vertical at the top.
        high: f32,
    },
}

/// Which endpoints are kept (3.2.3, 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum EndpointRule {
    /// All.
    Any,
    /// Those lower than the node where their path leaves the structure.
    Lower,
    /// Those higher than it.
    Higher,
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

/// One output of a set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Variant {
    /// A source as it is; index into the plan's sources.
    Source(usize),
    /// A tree between sources.
    Blend {
        /// Index into the plan's blends.
        blend: usize,
        /// Which of its trees.
        tree: BlendTree,
    },
    /// One of the kept trees of a selection.
    Selected {
        /// Index into the plan's selections.
        selection: usize,
        /// Which of its kept trees, from 0.
        place: usize,
    },
}

/// A tree of a blend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum BlendTree {
    /// One tree out of a stochastic batch.
    State {
        /// Which batch of the entry; each has a schedule of its own.
        batch: u64,
        /// How far into the batch the tree is taken, 0..=1.
        progress: f32,
        /// How far its tasks move in a step; 1 is the usual.
        pace: f32,
    },
    /// A point of the space that the sources span (4.6).
    Point {
        /// A share for each source; they add up to 1.
        shares: Vec<f32>,
        /// How far each branch's own shares may stray from them, 0..=1.
        scatter: f32,
        /// Address of the straying.
        draw: u64,
    },
}

/// A blend: sources in correspondence, and how trees are taken from between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlendParams {
    /// Which entry of the preset's variants it is.
    pub entry: usize,
    /// Indices of the sources, in the order of the preset; two for batches.
    pub of: Vec<usize>,
    /// Weights of the matching cost.
    pub matching: MatchParams,
    /// What becomes of stems without a partner.
    pub stems: StemRule,
    /// What is put in correspondence.
    pub scale: BlendScale,
    /// Which chains take part.
    pub only: OnlyParams,
}

/// What becomes of the stems that one source has more than the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum StemRule {
    /// They grow and wilt like all chains without a partner.
    Apart,
    /// They split from stems of the other, and merge with them.
    Merge,
}

/// What is put in correspondence along matched chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum BlendScale {
    /// Chains as a whole, by arc length.
    Chain,
    /// The growth units between matched branches, each with a time of its own.
    GrowthUnit,
}

/// Which chains take part in a blend; all when nothing is asked. Demands of one kind are alternatives, demands of
/// different kinds must all hold.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OnlyParams {
    /// Gravelius orders, from and to.
    pub orders: Vec<(u16, u16)>,
    /// Heights of a chain's base as shares of the plant's height, from and to, 0..=1.
    pub heights: Vec<(f32, f32)>,
    /// Names of parts.
    pub parts: Vec<String>,
}

/// Weights of the matching cost (2017 TVCG, Eq. 2); they add up to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MatchParams {
    /// w_M: crown shape.
    pub crown: f32,
    /// w_v: branching vector.
    pub direction: f32,
    /// w_CR: crown ratio.
    pub ratio: f32,
}

/// Trees of which only some are kept (2017 TVCG, 4.4 and 4.5).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    /// The preset's field that asks for it, as `variants[2]`; errors and notes of later stages name it.
    pub field: String,
    /// All that may be kept, in the order in which they take the place of rejected ones.
    pub candidates: Vec<Variant>,
    /// How many are kept.
    pub keep: usize,
    /// Which of them.
    pub pick: Pick,
    /// What makes trees differ.
    pub scores: ScoreParams,
    /// What is mended and rejected before.
    pub filter: FilterParams,
}

/// Which candidates are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Pick {
    /// The first that the filter lets through.
    All,
    /// One of each cluster of scores.
    Inspiring,
    /// Those that are farthest from each other.
    Diverse {
        /// Least distance of two of them, 0..=1.
        apart: f32,
    },
    /// Those that are nearest to the sources, each source in turn.
    Natural,
}

/// Weights of the difference between two trees (2017 TVCG, 4.5); they add up to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScoreParams {
    /// Shape of the crown.
    pub crown: f32,
    /// Share of the trunk that bears the crown.
    pub ratio: f32,
    /// Topology: which branch bears which.
    pub topology: f32,
}

/// What is mended and rejected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FilterParams {
    /// Share of the smaller branch's surface that may lie inside another branch at the coarsest scale, 0..=1; 1 for
    /// all of it.
    pub collisions: f32,
    /// How much more of it from scale to scale, 0..=1.
    pub rise: f32,
    /// How far a tree may lie beyond its sources in proportions and in where its wood is, in units of a usual spread,
    /// 0..=1000; 1000 for any distance.
    pub botany: f32,
}

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
    /// How much leaf sizes vary about it, 0..=0.9.
    pub leaf_spread: f32,
    /// Angle between a leaf and its twig, radians.
    pub leaf_angle: f32,
    /// Length of a twig, metres; twigs grow at most a few of these.
    pub twig_length: f32,
    /// How far twigs and leaves droop, 0..=1.
    pub droop: f32,
    /// How many pictures of the leaf there are: slots 0..pictures.
    pub pictures: u16,
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
        /// Hue, brightness variation between pictures and over a blade, 0..=1.
        variation: f32,
        /// Pixels along an edge of a picture.
        size: u32,
    },
    /// The user's own pictures: paths of colour with alpha and, where not empty, of the normal map.
    Files {
        /// Colour with alpha.
        color: String,
        /// Normal map, or empty.
        normal: String,
    },
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
}

/// Tubes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshParams {
    /// Sides of the thickest tube at LOD0, 3..=64.
    pub sides: u32,
    /// Largest distance between a tube and the smooth branch at LOD0, metres; twigs may stray 2.5 times as far.
    pub error: f32,
    /// Height of one bark tile on the trunk, metres.
    pub bark_tile: f32,
}

/// A level of detail.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Lod {
    /// Everything.
    Full,
    /// About this share of the full level's triangles.
    Thinned {
        /// 0..1.
        triangles: f32,
    },
    /// Leaves and thin branches as at most this many textured cards.
    BillboardCloud {
        /// 4..=512.
        cards: u32,
    },
    /// Two crossed quads.
    CrossedQuads,
}

/// The set's atlas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AtlasParams {
    /// Pixels along an edge, a power of two in 256..=8192.
    pub size: u32,
    /// Pixels between two pictures.
    pub gutter: u32,
}
