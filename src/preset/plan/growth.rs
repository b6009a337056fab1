//! Parameters of growth: iterations, endpoints, guiding vectors, and what stands around the plant.

use serde::Serialize;

use super::UpAxis;

/// The most that a metre of wood may add, in tips: a species file's 50 for a plant a twentieth as high.
pub(crate) const MOST_TAPER: f32 = 1000.0;

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
    /// What a metre of wood adds to what is below it, in tips, 0..=1000: 0 leaves branches of even thickness between forks.
    pub taper: f32,
    /// How much wider a stem is at the ground than the rule says, as a share of its radius, 0..=3.
    pub flare: f32,
    /// Where the flare ends, in radii of the stem, 0.5..=30.
    pub flare_height: f32,
    /// How much of the graph's crookedness stays, 0..=1: 0 for smooth curves, 1 for the paths as they are.
    pub crookedness: f32,
    /// What becomes of a lone trunk that leads up to the top, and of what leaves it.
    #[serde(skip_serializing_if = "is_held")]
    pub leader: LeaderRule,
    /// What a unit of length costs beside the paper's weight `d (1 - e·v)` (3.1.2), 0..=1; 0 is the paper's.
    #[serde(skip_serializing_if = "is_usual_length")]
    pub length_cost: f32,
    /// By which share nodes are dearer or cheaper by chance in each iteration, 0..=0.9; 0 is the paper's.
    #[serde(skip_serializing_if = "is_usual_whim")]
    pub whim: f32,
    /// Clear bole, plant heights, 0..=1: below it no branch of a later iteration leaves, and paths of the first that
    /// part there are separate stems, those that bear little apart.
    pub bole: f32,
    /// Longest a branch may be in radii of its base, 50..=10000; slimmer ones are shed.
    pub slenderness: f32,
    /// The graph, and what else is in the space that the plant grows in.
    pub space: GrowSpace,
}

/// The usual cost of a unit of length.
pub(crate) const USUAL_LENGTH_COST: f32 = 0.2;
/// The usual whim of nodes.
pub(crate) const USUAL_WHIM: f32 = 0.15;

fn is_held(leader: &LeaderRule) -> bool {
    *leader == LeaderRule::Held
}

fn is_usual_length(cost: &f32) -> bool {
    *cost == USUAL_LENGTH_COST
}

fn is_usual_whim(whim: &f32) -> bool {
    *whim == USUAL_WHIM
}

/// What becomes of a lone trunk that leads up to the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum LeaderRule {
    /// It is straightened up to its tip, and what leaves it is no longer than what is left of it above.
    Held,
    /// It is a path as all others are.
    Free,
}

impl GrowParams {
    /// The parameters for a plant of another height, metres, of the same proportions: wood as thick for its length, so that
    /// the same branches are too slim to stay. What stands around it stays in metres.
    #[must_use]
    pub fn at_height(self, height: f32) -> Self {
        let scale = height / self.height;
        // A taper is by the metre, of which there are more or fewer.
        let taper = (self.taper / scale).min(MOST_TAPER);
        Self { height, tip_radius: self.tip_radius * scale, taper, ..self }
    }
}

/// Where a plant grows: how fine the graph is, light, obstacles and neighbours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrowSpace {
    /// Address of the graph's nodes; has nothing to do with the plant's seed, so that many plants share a graph.
    pub graph_seed: u64,
    /// How many times finer than the graph the nodes are along the branches, 1..=4; 1 for the graph's own nodes alone.
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
    /// The axis that they turn about.
    #[serde(skip_serializing_if = "is_by_vector")]
    pub axis: GuideAxis,
    /// Guiding vectors of the source nodes before the pass.
    pub start: GuideStart,
    /// Which endpoints are kept.
    pub keep: EndpointRule,
}

fn is_by_vector(axis: &GuideAxis) -> bool {
    *axis == GuideAxis::Vector
}

/// The axis about which guiding vectors turn, perpendicular to up and to something else; of both that the paper names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum GuideAxis {
    /// To the parent's vector (3.1.2), and to the traversed edge where that is upright: curves keep to their plane, and all
    /// that follow a leaning node have one vector.
    Vector,
    /// To the traversed edge (3.2.1): what follows a node spreads to the sides that its edges lead to.
    Edge,
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
        /// By which share edges count for more or less by chance where they are counted, 0..=1: how irregular the surface
        /// and the exclusion zone are.
        #[serde(skip_serializing_if = "is_regular")]
        irregular: f32,
        /// How many.
        count: u32,
        /// How they are chosen.
        sampling: Sampling,
    },
}

fn is_regular(irregular: &f32) -> bool {
    *irregular == 0.0
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
        /// How far off the axis.
        out: f32,
        /// To which side, radians from +x towards +z; the seed chooses where none is told.
        turn: Option<f32>,
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
    /// The inside of an SVG silhouette revolved about the vertical through the middle of its bounds; or, where there is a
    /// `side`, the visual hull of both: what is inside as seen from the front (+z) and from the side (+x).
    Outline {
        /// SVG file, relative to the preset's folder.
        file: String,
        /// SVG file of what is seen from the side, scaled to the same heights.
        side: Option<String>,
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
