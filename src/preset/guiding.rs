//! The guiding rules of a species file (2015, 3.2.1): the fields of `guide`, and their resolution into [`Guide`].

use super::plan::{FieldAxis, FieldPart, FieldPrimitive, FieldRegion, Guide};
use super::reader::{Item, Reader};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};

/// A length of the species file.
pub(super) const fn share(name: &'static str, high: f32, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: 0.0, high, unit: "heights" }, default, about }
}

/// An angle of the species file.
pub(super) const fn degrees(name: &'static str, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" }, default, about }
}

const RULES: [KindOf; 5] = [
    KindOf { name: "Constant", form: Form::Fields(&CONSTANT), about: "the same angle at every hop" },
    KindOf { name: "Piecewise", form: Form::Fields(&PIECEWISE), about: "one angle at first, another afterwards" },
    KindOf { name: "Random", form: Form::Fields(&RANDOM), about: "a random first angle for each place of departure" },
    KindOf { name: "Polar", form: Form::Fields(&POLAR), about: "the more, the further a node is from the axis" },
    KindOf { name: "Field", form: Form::Fields(&FIELD), about: "directions set by place" },
];

/// `guide`.
pub(super) static GUIDE: Choice = Choice {
    title: "Guide",
    kinds: &[
        RULES[0],
        RULES[1],
        RULES[2],
        RULES[3],
        RULES[4],
        KindOf { name: "Split", form: Form::Fields(&SPLIT), about: "one rule for the lower part, one for the upper" },
    ],
};

static RULE: Choice = Choice { title: "Rule of a part", kinds: &RULES };

static CONSTANT: Record = Record {
    title: "Constant",
    about: "α of 3.2.1.",
    fields: &[degrees("alpha", Default::Is("0.0"), "turn at each hop")],
};
const H0: Field = Field {
    name: "h0",
    kind: Kind::Integer { low: 0, high: 1000, unit: "hops" },
    default: Default::Is("1"),
    about: "how many hops are the first ones",
};
const ALPHA2: Field = degrees("alpha2", Default::Is("0.0"), "turn at each later hop");
static PIECEWISE: Record = Record {
    title: "Piecewise",
    about: "Eq. 1 of the paper.",
    fields: &[degrees("alpha1", Default::Is("0.0"), "turn at each of the first hops"), ALPHA2, H0],
};
static RANDOM: Record = Record {
    title: "Random",
    about: "Eq. 1 with an alpha1 for each place where branches start (Fig. 6c).",
    fields: &[
        degrees("low", Default::Required, "smallest alpha1"),
        degrees("high", Default::Required, "largest alpha1"),
        ALPHA2,
        H0,
    ],
};
static POLAR: Record = Record {
    title: "Polar",
    about: "Eq. 2 of the paper: theta · √(polar angle of the node / 180°).",
    fields: &[degrees("theta", Default::Required, "turn at a hop of a node that points straight down")],
};
static SPLIT: Record = Record {
    title: "Split",
    about: "Decided by where a branch leaves the plant (Fig. 17b).",
    fields: &[
        share("height", 1.0, Default::Required, "where the lower part ends"),
        Field { name: "lower", kind: Kind::Choice(&RULE), default: Default::Required, about: "rule below it" },
        Field { name: "upper", kind: Kind::Choice(&RULE), default: Default::Required, about: "rule above it" },
    ],
};
static FIELD: Record = Record {
    title: "Field",
    about: "The weighted sum of primitives decides the direction at every node (Fig. 8); nothing turns from hop to hop.",
    fields: &[Field {
        name: "parts",
        kind: Kind::Rows { record: &PART, low: 1, high: 32 },
        default: Default::Required,
        about: "what the field is made of",
    }],
};
static PART: Record = Record {
    title: "Part of a field",
    about: "One primitive, how much it counts, and where.",
    fields: &[
        Field {
            name: "primitive",
            kind: Kind::Choice(&PRIMITIVE),
            default: Default::Required,
            about: "what points where",
        },
        Field {
            name: "weight",
            kind: Kind::Number { low: -100.0, high: 100.0, unit: "" },
            default: Default::Is("1.0"),
            about: "against the other parts; negative turns it round",
        },
        Field { name: "region", kind: Kind::Choice(&REGION), default: Default::Is("Everywhere"), about: "where" },
    ],
};
const CENTRE: Field = share("height", 1.0, Default::Required, "height of its centre on the plant's axis");
static PRIMITIVE: Choice = Choice {
    title: "Primitive",
    kinds: &[
        KindOf { name: "Uniform", form: Form::Fields(&UNIFORM), about: "the same direction everywhere" },
        KindOf { name: "Helical", form: Form::Fields(&HELICAL), about: "round the axis and up (Fig. 8a)" },
        KindOf { name: "Rotational", form: Form::Fields(&ROTATIONAL), about: "round a line (Fig. 8b)" },
        KindOf { name: "Spherical", form: Form::Fields(&CENTRED), about: "upwards along spheres (Fig. 8c)" },
        KindOf {
            name: "Radial",
            form: Form::Fields(&CENTRED),
            about: "away from a point; towards it by a negative weight",
        },
        KindOf { name: "Outward", form: Form::Plain, about: "level, away from the axis" },
    ],
};
static UNIFORM: Record = Record {
    title: "Uniform",
    about: "A direction by two angles.",
    fields: &[
        degrees("lean", Default::Is("0.0"), "from upright"),
        degrees("turn", Default::Is("0.0"), "to which side: 0 is +x, 90 is +z, as the `turn` of light"),
    ],
};
static HELICAL: Record = Record {
    title: "Helical",
    about: "At a constant distance from the axis.",
    fields: &[degrees("rise", Default::Is("30.0"), "from level; negative falls")],
};
static ROTATIONAL: Record = Record {
    title: "Rotational",
    about: "Round a line through the plant's axis.",
    fields: &[
        Field { name: "axis", kind: Kind::Choice(&AXIS), default: Default::Is("Z"), about: "direction of the line" },
        share("height", 1.0, Default::Required, "height of the line"),
    ],
};
static CENTRED: Record =
    Record { title: "Spherical and Radial", about: "About a point of the plant's axis.", fields: &[CENTRE] };
static AXIS: Choice = Choice {
    title: "Axis",
    kinds: &[
        KindOf { name: "X", form: Form::Plain, about: "level" },
        KindOf { name: "Y", form: Form::Plain, about: "up" },
        KindOf { name: "Z", form: Form::Plain, about: "level" },
    ],
};
const SOFT: Field = share("soft", 5.0, Default::Is("0.1"), "over which length the weight falls to nothing outside");
static REGION: Choice = Choice {
    title: "Region",
    kinds: &[
        KindOf { name: "Everywhere", form: Form::Plain, about: "everywhere" },
        KindOf { name: "Layer", form: Form::Fields(&LAYER), about: "between two heights" },
        KindOf { name: "Ball", form: Form::Fields(&BALL), about: "around a point of the axis" },
        KindOf { name: "Core", form: Form::Fields(&CORE), about: "around the axis" },
    ],
};
static LAYER: Record = Record {
    title: "Layer",
    about: "Between two heights.",
    fields: &[
        share("bottom", 1.0, Default::Is("0.0"), "lower height"),
        share("top", 1.0, Default::Is("1.0"), "upper height"),
        SOFT,
    ],
};
static BALL: Record = Record {
    title: "Ball",
    about: "Around a point of the plant's axis.",
    fields: &[CENTRE, share("radius", 5.0, Default::Required, "its radius"), SOFT],
};
static CORE: Record = Record {
    title: "Core",
    about: "Around the plant's axis.",
    fields: &[share("radius", 5.0, Default::Required, "its radius"), SOFT],
};

/// A rule by its kind.
pub(super) fn guide(kind: &str, fields: &Reader<'_, '_>) -> Option<Guide> {
    Some(match kind {
        "Constant" => Guide::Constant { alpha: angle(fields, "alpha") },
        "Piecewise" => Guide::Piecewise {
            alpha1: angle(fields, "alpha1"),
            alpha2: angle(fields, "alpha2"),
            h0: fields.count("h0"),
        },
        "Random" => {
            let (low, high) = (angle(fields, "low"), angle(fields, "high"));
            if low > high {
                fields.fault("low", "`low` is above `high`", "swap the two");
            }
            Guide::Random { low, high, alpha2: angle(fields, "alpha2"), h0: fields.count("h0") }
        }
        "Polar" => Guide::Polar { theta: angle(fields, "theta") },
        "Split" => {
            let height = fields.number("height");
            let (lower, upper) = (fields.choice("lower", guide), fields.choice("upper", guide));
            Guide::Split { height, lower: Box::new(lower?), upper: Box::new(upper?) }
        }
        _ => {
            let part = |item: &Item<'_>| field_part(&Reader::new(fields.report(), &PART, item));
            Guide::Field { parts: fields.list("parts").iter().filter_map(part).collect() }
        }
    })
}

fn field_part(part: &Reader<'_, '_>) -> Option<FieldPart> {
    let primitive = part.choice("primitive", |kind, fields| {
        Some(match kind {
            "Uniform" => FieldPrimitive::Uniform { lean: angle(fields, "lean"), turn: angle(fields, "turn") },
            "Helical" => FieldPrimitive::Helical { rise: angle(fields, "rise") },
            "Rotational" => {
                let axis = fields.choice("axis", |kind, _| {
                    Some(match kind {
                        "X" => FieldAxis::X,
                        "Y" => FieldAxis::Y,
                        _ => FieldAxis::Z,
                    })
                });
                FieldPrimitive::Rotational { axis: axis?, height: fields.number("height") }
            }
            "Spherical" => FieldPrimitive::Spherical { height: fields.number("height") },
            "Radial" => FieldPrimitive::Radial { height: fields.number("height") },
            _ => FieldPrimitive::Outward,
        })
    });
    let region = part.choice("region", |kind, fields| {
        Some(match kind {
            "Layer" => {
                let (bottom, top) = (fields.number("bottom"), fields.number("top"));
                if bottom > top {
                    fields.fault("bottom", "`bottom` is above `top`", "swap the two");
                }
                FieldRegion::Layer { bottom, top, soft: fields.number("soft") }
            }
            "Ball" => FieldRegion::Ball {
                height: fields.number("height"),
                radius: fields.number("radius"),
                soft: fields.number("soft"),
            },
            "Core" => FieldRegion::Core { radius: fields.number("radius"), soft: fields.number("soft") },
            _ => FieldRegion::Everywhere,
        })
    });
    Some(FieldPart { primitive: primitive?, weight: part.number("weight"), region: region? })
}

/// An angle in radians.
pub(super) fn angle(fields: &Reader<'_, '_>, name: &str) -> f32 {
    fields.number(name).to_radians()
}
