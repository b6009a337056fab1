//! The species file: growth in the words of Xu and Mould 2015, and its resolution into [`GrowParams`].
//!
//! Lengths inside `iterations` are shares of the plant's height, so a species can be grown at any height. Angles are
//! degrees in the text, radians in the plan. Height and iterations must be given, everything else has a default; the
//! tables below hold ranges, units, defaults and what each field does.

use super::guiding::{GUIDE, angle, degrees, guide, share};
use super::look::path;
use super::path::joined;
use super::plan::{
    Count, EndpointRule, Endpoints, GrowIteration, GrowParams, GrowSpace, GuideAxis, GuideStart, LeaderRule, Sampling,
    UpAxis, Volume,
};
use super::reader::{Item, Reader};
use super::report::Report;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::syntax::{Node, Value, tree};
use crate::base::Diagnostic;

/// Height of a grown plant; a source may set its own.
pub(super) const HEIGHT: Kind = Kind::Number { low: 0.1, high: 150.0, unit: "m" };

/// A species file.
pub(super) static SPECIES: Record = Record {
    title: "Species file",
    about: "How a plant grows (Xu and Mould 2015): least-cost paths over a random graph, in a few iterations, the trunk \
            first.",
    fields: &[
        Field { name: "height", kind: HEIGHT, default: Default::Required, about: "height of the finished plant" },
        Field {
            name: "nodes",
            kind: Kind::Integer { low: 500, high: 400_000, unit: "" },
            default: Default::Is("30000"),
            about: "nodes of the graph; more give finer branches and take longer",
        },
        Field {
            name: "detail",
            kind: Kind::Number { low: 1.0, high: 4.0, unit: "" },
            default: Default::Is("2.0"),
            about: "how many times finer than the graph the nodes are along the branches; 1 for the graph's own",
        },
        Field {
            name: "graph_seed",
            kind: Kind::Integer { low: 0, high: u64::MAX, unit: "" },
            default: Default::Is("1"),
            about: "another one gives another graph; plants of a species share theirs, whatever their own seed",
        },
        Field {
            name: "width",
            kind: Kind::Number { low: 0.05, high: 10.0, unit: "heights" },
            default: Default::Is("1.2"),
            about: "horizontal width of the graph's region; no branch grows beyond it (leaves do by a twig), and slim crowns want some air around them",
        },
        Field {
            name: "tip_radius",
            kind: Kind::Number { low: 0.0002, high: 0.2, unit: "m" },
            default: Default::Is("0.004"),
            about: "radius of a branch at its tip",
        },
        Field {
            name: "allometry",
            kind: Kind::Number { low: 1.0, high: 5.0, unit: "" },
            default: Default::Is("2.5"),
            about: "exponent of the radius rule, parent^x = sum of children^x; larger gives a thinner trunk",
        },
        Field {
            name: "taper",
            kind: Kind::Number { low: 0.0, high: 50.0, unit: "tips/m" },
            default: Default::Is("0.3"),
            about: "how a branch thins between forks: what a metre of wood counts for below it, in tips",
        },
        Field {
            name: "flare",
            kind: Kind::Number { low: 0.0, high: 3.0, unit: "radii" },
            default: Default::Is("0.35"),
            about: "how much wider a stem is at the ground, where its roots spread",
        },
        Field {
            name: "flare_height",
            kind: Kind::Number { low: 0.5, high: 30.0, unit: "radii" },
            default: Default::Is("5.0"),
            about: "height above the ground where the flare ends, in radii of the stem",
        },
        Field {
            name: "crookedness",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.3"),
            about: "how much of the graph's crookedness stays: 0 for smooth curves, 1 for the paths as they are, but for what \
                    a leader holds back (`leader: Free`)",
        },
        Field {
            name: "leader",
            kind: Kind::Choice(&LEADER),
            default: Default::Is("Held"),
            about: "what becomes of a lone trunk that leads up to the top",
        },
        Field {
            name: "length_cost",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.2"),
            about: "what a unit of length costs a path beside how far it is off the growing direction, which the paper \
                    alone counts: at 0 late twigs come straight from afar, however many branches they pass; from 0.3 on \
                    they leave nearly at right angles",
        },
        Field {
            name: "whim",
            kind: Kind::Number { low: 0.0, high: 0.9, unit: "" },
            default: Default::Is("0.15"),
            about: "by which share nodes are dearer or cheaper by chance, anew in each iteration: at 0, as in the paper, all \
                    plants of a species have one trunk, unless `graph_seed` tells them apart; more makes paths more crooked",
        },
        Field {
            name: "bole",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "heights" },
            default: Default::Is("0.0"),
            about: "clear bole: no branch of a later iteration leaves below this height. Paths of the first that part below it \
                    are stems of their own, or low branches where they bear little; give it one endpoint for one clear \
                    trunk. What leaves above may hang into it, where endpoints lie below",
        },
        Field {
            name: "slenderness",
            kind: Kind::Number { low: 50.0, high: 10000.0, unit: "radii" },
            default: Default::Is("300.0"),
            about: "longest a branch may be in radii of its base; slimmer ones are shed",
        },
        Field {
            name: "iterations",
            kind: Kind::Rows { record: &ITERATION, low: 1, high: 16 },
            default: Default::Required,
            about: "passes of growth, in order; the first is usually the trunk",
        },
    ],
};

static ITERATION: Record = Record {
    title: "Iteration",
    about: "One pass: new branches from the plant so far to new endpoints.",
    fields: &[
        Field {
            name: "endpoints",
            kind: Kind::Choice(&ENDPOINTS),
            default: Default::Required,
            about: "where the new branches end",
        },
        Field {
            name: "guide",
            kind: Kind::Choice(&GUIDE),
            default: Default::Is("Constant()"),
            about: "how the growing direction turns from node to node; positive is outwards and down",
        },
        Field {
            name: "axis",
            kind: Kind::Choice(&AXIS),
            default: Default::Is("Vector"),
            about: "about which axis it turns, square to up and to this",
        },
        Field {
            name: "start",
            kind: Kind::Choice(&START),
            default: Default::Is("Kept"),
            about: "growing direction where a branch leaves the plant so far",
        },
        Field {
            name: "keep",
            kind: Kind::Choice(&KEEP),
            default: Default::Is("Any"),
            about: "which endpoints are kept",
        },
    ],
};

const fn count(default: Default) -> Field {
    let kind = Kind::Integer { low: 1, high: 20_000, unit: "" };
    Field { name: "count", kind, default, about: "how many endpoints" }
}

const SAMPLING: Field = Field {
    name: "sampling",
    kind: Kind::Choice(&SAMPLINGS),
    default: Default::Is("Poisson"),
    about: "how they are chosen among the nodes there",
};

static SAMPLINGS: Choice = Choice {
    title: "Sampling",
    kinds: &[
        KindOf { name: "Poisson", form: Form::Plain, about: "they keep their distance: a Poisson-disc distribution" },
        KindOf { name: "Uniform", form: Form::Plain, about: "by chance alone: clumps and gaps" },
        KindOf { name: "Whorls", form: Form::Fields(&WHORLS), about: "at a distance in tiers, as conifers branch" },
    ],
};
static WHORLS: Record = Record {
    title: "Whorls",
    about: "Endpoints lie in the lowest quarter of every spacing.",
    fields: &[Field {
        name: "spacing",
        kind: Kind::Number { low: 0.005, high: 1.0, unit: "heights" },
        default: Default::Required,
        about: "from tier to tier",
    }],
};

static ENDPOINTS: Choice = Choice {
    title: "Endpoints",
    kinds: &[
        KindOf { name: "Volume", form: Form::Fields(&VOLUME), about: "in a volume: trunk and main limbs" },
        KindOf {
            name: "Surface",
            form: Form::Fields(&SURFACE),
            about: "around the plant so far: later, finer branches",
        },
    ],
};

static VOLUME: Record = Record {
    title: "Volume",
    about: "Endpoints in a volume (3.2.2). Give `count` or `density`; a Point is one endpoint.",
    fields: &[
        Field { name: "shape", kind: Kind::Choice(&SHAPE), default: Default::Required, about: "the volume" },
        count(Default::Else("by `density`")),
        Field {
            name: "density",
            kind: Kind::Number { low: 0.1, high: 100_000.0, unit: "in a cubic height" },
            default: Default::Else("by `count`"),
            about: "how many endpoints, by volume",
        },
        SAMPLING,
    ],
};

static SURFACE: Record = Record {
    title: "Surface",
    about: "Endpoints among the graph's nodes that are exactly `k` edges from the plant so far (3.2.3).",
    fields: &[
        Field {
            name: "k",
            kind: Kind::Integer { low: 1, high: 30, unit: "hops" },
            default: Default::Required,
            about: "length of the new branches, in edges of the graph",
        },
        Field {
            name: "t",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("1.0"),
            about: "only this share of them, those furthest from the root; the rest is the exclusion zone",
        },
        Field {
            name: "irregular",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.0"),
            about: "by which share an edge counts for more or less by chance where edges are counted: the surface and the \
                    exclusion zone get irregular by it, and branches longer",
        },
        count(Default::Required),
        SAMPLING,
    ],
};

const BOTTOM: Field = share("bottom", 1.0, Default::Required, "height of its lowest point");
const TOP: Field = share("top", 1.0, Default::Required, "height of its highest point");
const RADIUS: Field = share("radius", 5.0, Default::Required, "horizontal radius where it is widest");
const HOLLOW: Field = Field {
    name: "hollow",
    kind: Kind::Number { low: 0.0, high: 0.95, unit: "" },
    default: Default::Is("0.0"),
    about: "0 fills it, 0.8 leaves a shell of a fifth of the radius",
};

static SHAPE: Choice = Choice {
    title: "Shape",
    kinds: &[
        KindOf { name: "Point", form: Form::Fields(&POINT), about: "the tip of a trunk" },
        KindOf { name: "Ellipsoid", form: Form::Fields(&ROUND), about: "an upright ellipsoid, or its shell" },
        KindOf { name: "HalfEllipsoid", form: Form::Fields(&ROUND), about: "the upper half of one" },
        KindOf { name: "Cone", form: Form::Fields(&ROUND), about: "a cone, tip up" },
        KindOf { name: "Cylinder", form: Form::Fields(&ROUND), about: "an upright cylinder" },
        KindOf { name: "Box", form: Form::Fields(&BOX), about: "an upright box" },
        KindOf { name: "Mesh", form: Form::Fields(&MESH), about: "the inside of a closed mesh" },
        KindOf {
            name: "Outline",
            form: Form::Fields(&OUTLINE),
            about: "an SVG silhouette, revolved, or the hull of two",
        },
    ],
};

static POINT: Record = Record {
    title: "Point",
    about: "A point over the plant's base, or beside it.",
    fields: &[
        share("height", 1.0, Default::Required, "its height"),
        share("out", 5.0, Default::Is("0.0"), "how far off the axis"),
        degrees("turn", Default::Else("the seed chooses"), "to which side: 0 is +x, 90 is +z, as the `turn` of light"),
    ],
};
static ROUND: Record = Record {
    title: "Ellipsoid, HalfEllipsoid, Cone and Cylinder",
    about: "Upright about the plant's axis.",
    fields: &[BOTTOM, TOP, RADIUS, HOLLOW],
};
static BOX: Record = Record {
    title: "Box",
    about: "Upright, its middle on the plant's axis.",
    fields: &[
        BOTTOM,
        TOP,
        share("width", 10.0, Default::Required, "extent along x"),
        share("depth", 10.0, Default::Required, "extent along z"),
        HOLLOW,
    ],
};
static MESH: Record = Record {
    title: "Mesh",
    about: "Scaled alike in all directions to stand between the two heights, its own vertical axis on the plant's.",
    fields: &[
        Field {
            name: "file",
            kind: Kind::Text("the path of a GLB, glTF, OBJ or PLY file"),
            default: Default::Required,
            about: "a closed mesh; relative to the species file's folder",
        },
        Field { name: "up", kind: Kind::Choice(&UPWARDS), default: Default::Is("Y"), about: "which axis points up" },
        BOTTOM,
        TOP,
    ],
};
static UPWARDS: Choice = Choice {
    title: "Up of a mesh",
    kinds: &[
        KindOf { name: "Y", form: Form::Plain, about: "as glTF" },
        KindOf { name: "Z", form: Form::Plain, about: "as many modellers" },
    ],
};
static OUTLINE: Record = Record {
    title: "Outline",
    about: "A filled silhouette, revolved about the vertical through its middle, between the two heights; or all that lies \
            inside of two, from the front and from the side.",
    fields: &[
        Field {
            name: "file",
            kind: Kind::Text("the path of an SVG file"),
            default: Default::Required,
            about: "relative to the species file's folder",
        },
        Field {
            name: "side",
            kind: Kind::Text("the path of an SVG file"),
            default: Default::Else("`file` is revolved"),
            about: "what is seen from the side, 90 degrees on; `file` is then what is seen from the front",
        },
        BOTTOM,
        TOP,
    ],
};

static LEADER: Choice = Choice {
    title: "Leader",
    kinds: &[
        KindOf {
            name: "Held",
            form: Form::Plain,
            about: "it is straightened up to its tip, and what leaves it is no longer than what is left of it above, the \
                    shorter the steeper",
        },
        KindOf { name: "Free", form: Form::Plain, about: "nothing: it is a path as all others are" },
    ],
};

static AXIS: Choice = Choice {
    title: "Axis of turns",
    kinds: &[
        KindOf {
            name: "Vector",
            form: Form::Plain,
            about: "the growing direction, or the edge where that is upright: curves keep to their plane",
        },
        KindOf {
            name: "Edge",
            form: Form::Plain,
            about: "the edge that was taken (3.2.1): what follows a leaning branch spreads to its sides",
        },
    ],
};

static START: Choice = Choice {
    title: "Start",
    kinds: &[
        KindOf { name: "Kept", form: Form::Plain, about: "as the pass left it that made the node" },
        KindOf { name: "ByHeight", form: Form::Fields(&BY_HEIGHT), about: "away from the vertical, by height" },
    ],
};
static BY_HEIGHT: Record = Record {
    title: "ByHeight",
    about: "Angles from the vertical; between ground and top they change evenly.",
    fields: &[
        degrees("low", Default::Required, "angle at the ground"),
        degrees("high", Default::Required, "angle at the top"),
    ],
};

static KEEP: Choice = Choice {
    title: "Keep",
    kinds: &[
        KindOf { name: "Any", form: Form::Plain, about: "all" },
        KindOf { name: "Lower", form: Form::Plain, about: "those lower than where their branch leaves the plant" },
        KindOf { name: "Higher", form: Form::Plain, about: "those higher than that" },
    ],
};

/// Reads a species file. Its seed is 1 until a source gives its own.
///
/// # Errors
///
/// All that is wrong with the text, in its order, each with its place in `file`.
pub fn species(file: &str, text: &str) -> Result<GrowParams, Vec<Diagnostic>> {
    let report = Report::new(file);
    let params = tree(text, &report).filter(|_| report.is_clean()).and_then(|node| {
        if is_preset(&node) {
            let hint = "name a species file in its place, which says how one kind of tree grows: \"species/oak.ron\"";
            report.whole("this is a preset, which says what a set holds", hint);
            return None;
        }
        let top = Item { node: std::borrow::Cow::Owned(node), path: String::new(), given: true };
        Some(grow_params(&Reader::new(&report, &SPECIES, &top)))
    });
    match params {
        Some(params) if report.is_clean() => Ok(params),
        _ => Err(report.into_diagnostics()),
    }
}

/// Whether a file's fields are those of a preset: it tells variants or sources and no iterations.
fn is_preset(node: &Node) -> bool {
    let Value::Record(None, fields) = &node.value else { return false };
    let has = |name: &str| fields.iter().any(|(field, _)| field.text == name);
    (has("sources") || has("variants")) && !has("iterations")
}

fn grow_params(species: &Reader<'_, '_>) -> GrowParams {
    let width = species.number("width");
    GrowParams {
        seed: 1,
        height: species.number("height"),
        nodes: species.count("nodes"),
        width,
        iterations: species
            .list("iterations")
            .iter()
            .filter_map(|item| iteration(&Reader::new(species.report(), &ITERATION, item), width))
            .collect(),
        tip_radius: species.number("tip_radius"),
        allometry: species.number("allometry"),
        taper: species.number("taper"),
        flare: species.number("flare"),
        flare_height: species.number("flare_height"),
        crookedness: species.number("crookedness"),
        leader: species
            .choice("leader", |kind, _| Some(if kind == "Free" { LeaderRule::Free } else { LeaderRule::Held }))
            .unwrap_or(LeaderRule::Held),
        length_cost: species.number("length_cost"),
        whim: species.number("whim"),
        bole: species.number("bole"),
        slenderness: species.number("slenderness"),
        space: GrowSpace {
            graph_seed: species.integer("graph_seed"),
            detail: species.number("detail"),
            ..GrowSpace::default()
        },
    }
}

fn iteration(pass: &Reader<'_, '_>, width: f32) -> Option<GrowIteration> {
    let endpoints = pass.choice("endpoints", |kind, fields| match kind {
        "Volume" => {
            let shape = fields.choice("shape", |kind, fields| volume(kind, fields, width));
            let (shape, sampling) = (shape?, sampling(fields)?);
            Some(Endpoints::Volume { count: volume_count(fields, &shape), shape, sampling })
        }
        _ => Some(Endpoints::Surface {
            k: fields.count("k"),
            t: fields.number("t"),
            irregular: fields.number("irregular"),
            count: fields.count("count"),
            sampling: sampling(fields)?,
        }),
    });
    let guide = pass.choice("guide", guide);
    let axis = pass.choice("axis", |kind, _| Some(if kind == "Edge" { GuideAxis::Edge } else { GuideAxis::Vector }));
    let start = pass.choice("start", |kind, fields| match kind {
        "Kept" => Some(GuideStart::Kept),
        _ => Some(GuideStart::ByHeight { low: angle(fields, "low"), high: angle(fields, "high") }),
    });
    let keep = pass.choice("keep", |kind, _| match kind {
        "Lower" => Some(EndpointRule::Lower),
        "Higher" => Some(EndpointRule::Higher),
        _ => Some(EndpointRule::Any),
    });
    Some(GrowIteration { endpoints: endpoints?, guide: guide?, axis: axis?, start: start?, keep: keep? })
}

fn sampling(fields: &Reader<'_, '_>) -> Option<Sampling> {
    fields.choice("sampling", |kind, fields| {
        Some(match kind {
            "Uniform" => Sampling::Uniform,
            "Whorls" => Sampling::Whorls { spacing: fields.number("spacing") },
            _ => Sampling::Poisson,
        })
    })
}

/// How many endpoints a volume gets: by one of two fields, or one in a point.
fn volume_count(fields: &Reader<'_, '_>, shape: &Volume) -> Count {
    let point = matches!(shape, Volume::Point { .. });
    match (fields.has("count"), fields.has("density")) {
        (true, true) => fields.fault("density", "beside `count`", "give one of the two"),
        (false, false) if !point => {
            fields.report().at(fields.span(), fields.path(), "neither `count` nor `density`", "give one of the two");
        }
        (_, true) if point => fields.fault("density", "a Point is one endpoint", "leave it out"),
        (true, _) if point && fields.integer_or("count", 1) > 1 => {
            fields.fault("count", "a Point is one endpoint", "1, or another shape for more of them");
        }
        _ => {}
    }
    if fields.has("density") {
        Count::Density(fields.number_or("density", 1.0))
    } else {
        Count::Number(u32::try_from(fields.integer_or("count", 1)).unwrap_or(u32::MAX))
    }
}

fn volume(kind: &str, fields: &Reader<'_, '_>, width: f32) -> Option<Volume> {
    let within = |name: &str, reach: f32, scale: f32| {
        if reach > width * 0.5 + 1e-6 {
            let message = format!("reaches beyond the graph's region, whose `width` is {width}");
            fields.fault(name, message, format!("at most {}, or a larger `width`", width * 0.5 * scale));
        }
    };
    if kind == "Point" {
        let out = fields.number("out");
        within("out", out, 1.0);
        fields.needs("out", &["turn"], "tell how far off the axis it is by `out`, or leave it out");
        let turn = fields.has("turn").then(|| angle(fields, "turn"));
        return Some(Volume::Point { height: fields.number("height"), out, turn });
    }
    let (bottom, top) = (fields.number("bottom"), fields.number("top"));
    if fields.has("bottom") && fields.has("top") && bottom >= top {
        fields.fault("bottom", "`bottom` is not below `top`", "both are shares of the plant's height, 0 to 1");
    }
    Some(match kind {
        "Mesh" => {
            let up = fields.choice("up", |kind, _| Some(if kind == "Z" { UpAxis::Z } else { UpAxis::Y }));
            Volume::Mesh { file: path(fields, "file"), up: up?, bottom, top }
        }
        "Outline" => {
            let side = fields.has("side").then(|| path(fields, "side"));
            Volume::Outline { file: path(fields, "file"), side, bottom, top }
        }
        "Box" => {
            let (width, depth) = (fields.number("width"), fields.number("depth"));
            within("width", width * 0.5, 2.0);
            within("depth", depth * 0.5, 2.0);
            Volume::Box { bottom, top, width, depth, hollow: fields.number("hollow") }
        }
        _ => {
            let (radius, hollow) = (fields.number("radius"), fields.number("hollow"));
            within("radius", radius, 1.0);
            match kind {
                "Ellipsoid" => Volume::Ellipsoid { bottom, top, radius, hollow },
                "HalfEllipsoid" => Volume::HalfEllipsoid { bottom, top, radius, hollow },
                "Cone" => Volume::Cone { bottom, top, radius, hollow },
                _ => Volume::Cylinder { bottom, top, radius, hollow },
            }
        }
    })
}

/// The species with the files of its shapes as seen from another folder: `folder` is the species file's.
pub(super) fn seen_from(mut params: GrowParams, folder: &str) -> GrowParams {
    for iteration in &mut params.iterations {
        let Endpoints::Volume { shape, .. } = &mut iteration.endpoints else { continue };
        if let Volume::Mesh { file, .. } | Volume::Outline { file, .. } = shape {
            *file = joined(folder, file);
        }
        if let Volume::Outline { side: Some(side), .. } = shape {
            *side = joined(folder, side);
        }
    }
    params
}
