//! The species file: growth in the words of Xu and Mould 2015, and its resolution into [`GrowParams`].
//!
//! Lengths inside `iterations` are shares of the plant's height, so a species can be grown at any height. Angles are
//! degrees in the text, radians in the plan. Height and iterations must be given, everything else has a default; the
//! tables below hold ranges, units, defaults and what each field does.

use super::plan::{EndpointRule, Endpoints, GrowIteration, GrowParams, GrowSpace, Guide, GuideStart, Volume};
use super::reader::{Item, Reader};
use super::report::Report;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::syntax::tree;
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
            about: "how many times finer the graph is near the plant than an even one of as many nodes; 1 for an even \
                    one",
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
            about: "horizontal width of the graph's region; nothing grows beyond it",
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
            name: "crookedness",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.3"),
            about: "how much of the graph's crookedness stays: 0 for smooth curves, 1 for the paths as they are",
        },
        Field {
            name: "bole",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "heights" },
            default: Default::Is("0.0"),
            about: "clear bole: nothing forks below this height; what would are stems of their own",
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
            default: Default::Is("Piecewise()"),
            about: "how the growing direction turns from node to node; positive is outwards and down",
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

const fn share(name: &'static str, high: f32, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: 0.0, high, unit: "heights" }, default, about }
}

const fn degrees(name: &'static str, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" }, default, about }
}

const COUNT: Field = Field {
    name: "count",
    kind: Kind::Integer { low: 1, high: 20_000, unit: "" },
    default: Default::Required,
    about: "how many endpoints",
};

static ENDPOINTS: Choice = Choice {
    title: "Endpoints",
    kinds: &[
        KindOf {
            name: "Volume",
            form: Form::Fields(&VOLUME),
            about: "spread evenly in a volume: trunk and main limbs",
        },
        KindOf {
            name: "Surface",
            form: Form::Fields(&SURFACE),
            about: "around the plant so far: later, finer branches",
        },
    ],
};

static VOLUME: Record = Record {
    title: "Volume",
    about: "Endpoints spread evenly in a volume.",
    fields: &[
        Field { name: "shape", kind: Kind::Choice(&SHAPE), default: Default::Required, about: "the volume" },
        COUNT,
    ],
};

static SURFACE: Record = Record {
    title: "Surface",
    about: "Endpoints among the graph's nodes that are exactly `hops` edges from the plant so far.",
    fields: &[
        Field {
            name: "hops",
            kind: Kind::Integer { low: 1, high: 30, unit: "hops" },
            default: Default::Required,
            about: "length of the new branches, in edges of the graph",
        },
        Field {
            name: "proportion",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("1.0"),
            about: "only this share of them, those furthest from the root",
        },
        COUNT,
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
        KindOf {
            name: "Point",
            form: Form::Fields(&POINT),
            about: "a point above the trunk's base: the tip of a trunk",
        },
        KindOf { name: "Ellipsoid", form: Form::Fields(&HOLLOWED), about: "an upright ellipsoid" },
        KindOf { name: "HalfEllipsoid", form: Form::Fields(&HOLLOWED), about: "the upper half of one" },
        KindOf { name: "Cone", form: Form::Fields(&SOLID), about: "a cone, tip up" },
        KindOf { name: "Cylinder", form: Form::Fields(&SOLID), about: "an upright cylinder" },
    ],
};

static POINT: Record = Record {
    title: "Point",
    about: "A point on the plant's axis.",
    fields: &[share("height", 1.0, Default::Required, "its height")],
};
static HOLLOWED: Record = Record {
    title: "Ellipsoid and HalfEllipsoid",
    about: "Upright about the plant's axis.",
    fields: &[BOTTOM, TOP, RADIUS, HOLLOW],
};
static SOLID: Record =
    Record { title: "Cone and Cylinder", about: "Upright about the plant's axis.", fields: &[BOTTOM, TOP, RADIUS] };

static GUIDE: Choice = Choice {
    title: "Guide",
    kinds: &[
        KindOf { name: "Piecewise", form: Form::Fields(&PIECEWISE), about: "one angle at first, another afterwards" },
        KindOf { name: "Random", form: Form::Fields(&RANDOM), about: "a random angle at the first hop, then straight" },
        KindOf {
            name: "Polar",
            form: Form::Fields(&POLAR),
            about: "the more, the further a node leans from the vertical",
        },
    ],
};

static PIECEWISE: Record = Record {
    title: "Piecewise",
    about: "Eq. 1 of the paper.",
    fields: &[
        degrees("first", Default::Is("0.0"), "turn at each of the first hops"),
        degrees("then", Default::Is("0.0"), "turn at each later hop"),
        Field {
            name: "switch",
            kind: Kind::Integer { low: 0, high: 1000, unit: "hops" },
            default: Default::Is("1"),
            about: "how many hops are the first ones",
        },
    ],
};
static RANDOM: Record = Record {
    title: "Random",
    about: "One angle for each place where a branch starts.",
    fields: &[degrees("low", Default::Required, "smallest angle"), degrees("high", Default::Required, "largest angle")],
};
static POLAR: Record = Record {
    title: "Polar",
    about: "Eq. 2 of the paper: theta · √(polar angle of the node / 180°).",
    fields: &[degrees("theta", Default::Required, "turn at a hop of a node that points straight down")],
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
    let params = tree(text, &report).filter(|_| report.is_clean()).map(|node| {
        let top = Item { node: std::borrow::Cow::Owned(node), path: String::new(), given: true };
        grow_params(&Reader::new(&report, &SPECIES, &top))
    });
    match params {
        Some(params) if report.is_clean() => Ok(params),
        _ => Err(report.into_diagnostics()),
    }
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
        crookedness: species.number("crookedness"),
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
            let count = fields.count("count");
            let shape = fields.choice("shape", |kind, fields| volume(kind, fields, width));
            shape.map(|shape| Endpoints::Volume { shape, count })
        }
        _ => Some(Endpoints::Surface {
            hops: fields.count("hops"),
            proportion: fields.number("proportion"),
            count: fields.count("count"),
        }),
    });
    let guide = pass.choice("guide", |kind, fields| match kind {
        "Piecewise" => Some(Guide::Piecewise {
            first: angle(fields, "first"),
            then: angle(fields, "then"),
            switch: fields.count("switch"),
        }),
        "Random" => {
            let (low, high) = (angle(fields, "low"), angle(fields, "high"));
            if low > high {
                fields.fault("low", "`low` is above `high`", "swap the two");
            }
            Some(Guide::Random { low, high })
        }
        _ => Some(Guide::Polar { theta: angle(fields, "theta") }),
    });
    let start = pass.choice("start", |kind, fields| match kind {
        "Kept" => Some(GuideStart::Kept),
        _ => Some(GuideStart::ByHeight { low: angle(fields, "low"), high: angle(fields, "high") }),
    });
    let keep = pass.choice("keep", |kind, _| match kind {
        "Lower" => Some(EndpointRule::Lower),
        "Higher" => Some(EndpointRule::Higher),
        _ => Some(EndpointRule::Any),
    });
    Some(GrowIteration { endpoints: endpoints?, guide: guide?, start: start?, keep: keep? })
}

fn volume(kind: &str, fields: &Reader<'_, '_>, width: f32) -> Option<Volume> {
    if kind == "Point" {
        return Some(Volume::Point { height: fields.number("height") });
    }
    let (bottom, top, radius) = (fields.number("bottom"), fields.number("top"), fields.number("radius"));
    if fields.has("bottom") && fields.has("top") && bottom >= top {
        fields.fault("bottom", "`bottom` is not below `top`", "both are shares of the plant's height, 0 to 1");
    }
    if radius > width * 0.5 + 1e-6 {
        let message = format!("reaches beyond the graph's region, whose `width` is {width}");
        fields.fault("radius", message, format!("at most {}, or a larger `width`", width * 0.5));
    }
    Some(match kind {
        "Ellipsoid" => Volume::Ellipsoid { bottom, top, radius, hollow: fields.number("hollow") },
        "HalfEllipsoid" => Volume::HalfEllipsoid { bottom, top, radius, hollow: fields.number("hollow") },
        "Cone" => Volume::Cone { bottom, top, radius },
        _ => Volume::Cylinder { bottom, top, radius },
    })
}

/// An angle in radians.
fn angle(fields: &Reader<'_, '_>, name: &str) -> f32 {
    fields.number(name).to_radians()
}
