//! How a preset asks for trees of a shape space (2018 TOG): `Geodesic`, `Mean`, `Symmetrize` and `Between`.
//!
//! All four are shares of sources: of two along a geodesic, of many for a mean, of a tree and its reflection, or drawn about the
//! mean. They are worked out here, so the plan holds numbers.

use super::plan::{ChainPath, ElasticParams, Facing, MirrorPlane, ShapeKind, ShapeParams, SmallRule};
use super::reader::Reader;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::variants::{source, weights};
use crate::base::{Seed, gaussian_shares};

/// Most trees of one entry.
const MOST_TREES: u64 = 256;
/// Most sources of one entry.
const MOST_SOURCES: usize = 16;

const OF: Field = Field {
    name: "of",
    kind: Kind::Texts { what: "sources' names", low: 2, high: MOST_SOURCES },
    default: Default::Required,
    about: "the sources that span the space",
};

const PATH: Field = Field {
    name: "path",
    kind: Kind::Choice(&PATHS),
    default: Default::Is("Elastic"),
    about: "what a branch does on its way",
};

const PATH_OF_MANY: Field = Field { kind: Kind::Choice(&PATHS_OF_MANY), ..PATH };

const FACING: Field = Field {
    name: "facing",
    kind: Kind::Choice(&FACINGS),
    default: Default::Is("Fixed"),
    about: "whether sources behind the first are turned about the vertical",
};

const TURN: Field = Field {
    name: "turn",
    kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" },
    default: Default::Is("0.0"),
    about: "how far sources behind the first are turned about the vertical, from +z towards +x, beyond what `facing` does: \
            the way to a tree that is turned by 180 leads through other trees",
};

const SMALL: Field = Field {
    name: "small",
    kind: Kind::Choice(&SMALLS),
    default: Default::Is("Removed()"),
    about: "what becomes of branches that are too short for where they stand",
};

const MATCHED: Field = Field {
    name: "matching",
    kind: Kind::Fields(&ELASTIC),
    default: Default::Is("()"),
    about: "which branches are taken for the same",
};

const fn cost(name: &'static str, default: &'static str, about: &'static str) -> Field {
    let kind = Kind::Number { low: 0.0, high: 1.0, unit: "of the parent's length" };
    Field { name, kind, default: Default::Is(default), about }
}

static ELASTIC: Record = Record {
    title: "Elastic matching",
    about: "Branches keep their order along their parents; what they differ in counts as a distance along them.",
    fields: &[
        Field {
            name: "epsilon",
            kind: Kind::Number { low: 0.001, high: 1.0, unit: "of the parent's length" },
            default: Default::Is("0.1"),
            about: "how far apart two branches may leave and still match",
        },
        cost("direction", "0.1", "what opposite directions count"),
        cost("length", "0.05", "what a branch of no length counts against a long one"),
    ],
};

/// Trees on the way between two sources.
pub(super) static GEODESIC: Record = Record {
    title: "Geodesic",
    about: "The shortest way between two trees in shape space (Wang et al. 2018), at even steps.",
    fields: &[
        Field {
            name: "from",
            kind: Kind::Text("a source's name"),
            default: Default::Required,
            about: "where it starts",
        },
        Field { name: "to", kind: Kind::Text("a source's name"), default: Default::Required, about: "where it ends" },
        Field {
            name: "steps",
            kind: Kind::Integer { low: 1, high: MOST_TREES, unit: "trees" },
            default: Default::Required,
            about: "how many trees between the two, which are not among them; 1 is the middle",
        },
        PATH_OF_MANY,
        FACING,
        TURN,
        SMALL,
        MATCHED,
    ],
};

/// The mean of some sources.
pub(super) static MEAN: Record = Record {
    title: "Mean",
    about: "The Fréchet mean of some trees: the one that is least far from all of them (Wang et al. 2018).",
    fields: &[
        OF,
        Field {
            name: "weights",
            kind: Kind::Shares { what: "sources' names", low: 0.0, high: 1000.0, least: 1, most: MOST_SOURCES },
            default: Default::Else("the same for all"),
            about: "what counts more, as `{\"oak\": 2}`; 1 for those left out",
        },
        PATH_OF_MANY,
        FACING,
        TURN,
        SMALL,
        MATCHED,
    ],
};

/// A source made symmetric.
pub(super) static SYMMETRIZE: Record = Record {
    title: "Symmetrize",
    about: "A tree on its way to the nearest one that is symmetric across a vertical plane (Wang et al. 2018, 6).",
    fields: &[
        Field { name: "of", kind: Kind::Text("a source's name"), default: Default::Required, about: "which one" },
        Field {
            name: "amount",
            kind: Kind::Number { low: 0.0, high: 2.0, unit: "" },
            default: Default::Is("1.0"),
            about: "0 is the tree as it is, 1 a symmetric one, 2 its reflection",
        },
        Field {
            name: "plane",
            kind: Kind::Choice(&PLANES),
            default: Default::Is("Best"),
            about: "the vertical plane through the foot of the trunk",
        },
        PATH,
        MATCHED,
    ],
};

/// Trees about the mean of some sources.
pub(super) static BETWEEN: Record = Record {
    title: "Between",
    about: "Trees drawn from a Gaussian about the mean of some trees, bounded by them; a greater `count` keeps the first.",
    fields: &[
        OF,
        Field {
            name: "count",
            kind: Kind::Integer { low: 1, high: MOST_TREES, unit: "trees" },
            default: Default::Required,
            about: "how many variants it gives",
        },
        Field {
            name: "spread",
            kind: Kind::Number { low: 0.01, high: 4.0, unit: "" },
            default: Default::Is("1.0"),
            about: "how far they stray: 1 as far as the sources do, but never beyond them nor to one of them alone. The share of a \
                    source then deviates by 0.27 of two sources, 0.29 of three, 0.27 of four and 0.18 of eight; spreads of a \
                    quarter and less give themselves over the root of the number of sources",
        },
        Field {
            name: "seed",
            kind: Kind::Integer { low: 0, high: 1_000_000, unit: "" },
            default: Default::Is("0"),
            about: "another one gives other trees of the same sources",
        },
        PATH_OF_MANY,
        FACING,
        TURN,
        SMALL,
        MATCHED,
    ],
};

const ELASTIC_PATH: KindOf = KindOf { name: "Elastic", form: Form::Plain, about: "it bends, and keeps its length" };

const STRAIGHT_PATH: KindOf =
    KindOf { name: "Straight", form: Form::Plain, about: "every point goes straight, as in the paper" };

static PATHS: Choice = Choice { title: "Paths", kinds: &[ELASTIC_PATH, STRAIGHT_PATH] };

static PATHS_OF_MANY: Choice = Choice {
    title: "Paths between sources",
    kinds: &[
        ELASTIC_PATH,
        STRAIGHT_PATH,
        KindOf {
            name: "Straightened",
            form: Form::Plain,
            about: "as `Straight`, between branches that are matched as in `Blend`, in whatever order they leave: stretches of the \
                    bearer between them shrink to nothing and others grow (Wang et al. 2018, Eq. 5). Half way many leave at one \
                    place, most of all in a `Mean` of three and more. `matching` says nothing then, and sources' own leaves go",
        },
    ],
};

static FACINGS: Choice = Choice {
    title: "Facings",
    kinds: &[
        KindOf { name: "Fixed", form: Form::Plain, about: "they stay as they stand" },
        KindOf { name: "Free", form: Form::Plain, about: "to where they are nearest to the first" },
    ],
};

static SMALLS: Choice = Choice {
    title: "Small branches",
    kinds: &[
        KindOf {
            name: "Removed",
            form: Form::Fields(&REMOVED),
            about: "they are left out, unless they bear branches that are long enough, or leaves of the source's own",
        },
        KindOf { name: "Kept", form: Form::Plain, about: "they stay" },
    ],
};

static REMOVED: Record = Record {
    title: "Removed",
    about: "`Removed(alpha: 0.5)`.",
    fields: &[Field {
        name: "alpha",
        kind: Kind::Number { low: 0.0, high: 10.0, unit: "" },
        default: Default::Is("0.5"),
        about: "how far below the shorter source's branches they may be, as a share of what the sources differ by",
    }],
};

static PLANES: Choice = Choice {
    title: "Planes",
    kinds: &[
        KindOf { name: "Best", form: Form::Plain, about: "the one across which the tree is most nearly symmetric" },
        KindOf { name: "At", form: Form::One(&AT), about: "a given one" },
    ],
};

static AT: Record = Record {
    title: "At",
    about: "`At(90)`.",
    fields: &[Field {
        name: "azimuth",
        kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" },
        default: Default::Required,
        about: "where the plane runs to: 0 is the front (+z), 90 is +x; `turn` of light counts from +x",
    }],
};

/// An entry of a shape space and the shares of its trees.
pub(super) struct Shaped {
    pub(super) shape: ShapeParams,
    pub(super) trees: Vec<Vec<f32>>,
}

/// An entry of one of the four kinds.
pub(super) fn shaped(kind: &str, entry: usize, fields: &Reader<'_, '_>, names: &[&str], seed: u64) -> Option<Shaped> {
    match kind {
        "Geodesic" => geodesic(entry, fields, names),
        "Mean" => mean(entry, fields, names),
        "Symmetrize" => symmetrize(entry, fields, names),
        _ => between(entry, fields, names, seed),
    }
}

fn geodesic(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<Shaped> {
    let named = |field| fields.item(field).and_then(|item| source(fields, &item, names));
    let (from, to) = (named("from"), named("to"));
    let steps = fields.integer("steps");
    let (elastic, facing, small) = (elastic(fields), facing(fields), small(fields));
    let turn = fields.number("turn").to_radians();
    let (from, to) = (from?, to?);
    if from == to {
        fields.fault("to", "goes from a source to itself", "name different sources");
        return None;
    }
    let at = |i: u64| i as f32 / (steps + 1) as f32;
    let trees = (1..=steps).map(|i| vec![1.0 - at(i), at(i)]).collect();
    let (elastic, is_straightened) = elastic?;
    let kind = of_sources(facing?, turn, is_straightened);
    Some(Shaped { shape: ShapeParams { entry, of: vec![from, to], kind, elastic, small: small? }, trees })
}

fn mean(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<Shaped> {
    let of = of_list(fields, names);
    let (elastic, facing, small) = (elastic(fields), facing(fields), small(fields));
    let turn = fields.number("turn").to_radians();
    let weights = weights(fields, "weights", "mean", of.as_deref().unwrap_or_default(), names);
    let (of, mut weights) = (of?, weights?);
    if weights.is_empty() {
        weights = vec![1.0; of.len()];
    }
    let sum: f32 = weights.iter().sum();
    let trees = vec![weights.iter().map(|w| w / sum).collect()];
    let (elastic, is_straightened) = elastic?;
    let kind = of_sources(facing?, turn, is_straightened);
    Some(Shaped { shape: ShapeParams { entry, of, kind, elastic, small: small? }, trees })
}

fn symmetrize(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<Shaped> {
    let of = fields.item("of").and_then(|item| source(fields, &item, names));
    let amount = fields.number("amount");
    let plane = fields.choice("plane", |kind, own| {
        Some(match kind {
            "At" => MirrorPlane::At(own.number("azimuth").to_radians()),
            _ => MirrorPlane::Best,
        })
    });
    let elastic = elastic(fields);
    let kind = ShapeKind::Mirror { plane: plane? };
    // The two ends' branches are as long here, so the paper's rule for small ones would leave out all below its line.
    let shape = ShapeParams { entry, of: vec![of?], kind, elastic: elastic?.0, small: SmallRule::Kept };
    Some(Shaped { shape, trees: vec![vec![1.0 - amount * 0.5, amount * 0.5]] })
}

fn between(entry: usize, fields: &Reader<'_, '_>, names: &[&str], set_seed: u64) -> Option<Shaped> {
    let of = of_list(fields, names);
    let (count, spread, seed) = (fields.integer("count"), fields.number("spread"), fields.integer("seed"));
    let (elastic, facing, small) = (elastic(fields), facing(fields), small(fields));
    let turn = fields.number("turn").to_radians();
    let of = of?;
    let named = |seed: Seed, &s: &usize| seed.child(names[s]);
    let address = of.iter().fold(Seed::new(set_seed).child("between").at(seed), named);
    let trees = (0..count).map(|i| gaussian_shares(of.len(), spread, address.at(i))).collect();
    let (elastic, is_straightened) = elastic?;
    let kind = of_sources(facing?, turn, is_straightened);
    Some(Shaped { shape: ShapeParams { entry, of, kind, elastic, small: small? }, trees })
}

/// The sources of a list, each once.
fn of_list(fields: &Reader<'_, '_>, names: &[&str]) -> Option<Vec<usize>> {
    let items = fields.list("of");
    let of: Vec<Option<usize>> = items.iter().map(|item| source(fields, item, names)).collect();
    let of: Vec<usize> = of.into_iter().collect::<Option<_>>()?;
    if let Some(i) = (1..of.len()).find(|&i| of[..i].contains(&of[i])) {
        fields.report().at(items[i].span(), &items[i].path, "named twice", "a weight makes a source count more");
        return None;
    }
    (of.len() > 1).then_some(of)
}

/// How branches are matched, and whether ways are straightened ones.
fn elastic(fields: &Reader<'_, '_>) -> Option<(ElasticParams, bool)> {
    let (path, is_straightened) = fields.choice("path", |kind, _| {
        Some((if kind == "Elastic" { ChainPath::Elastic } else { ChainPath::Straight }, kind == "Straightened"))
    })?;
    let params = fields.group("matching", |own| ElasticParams {
        epsilon: own.number("epsilon"),
        direction: own.number("direction"),
        length: own.number("length"),
        path,
    })?;
    Some((params, is_straightened))
}

/// What the space of some sources is.
fn of_sources(facing: Facing, turn: f32, is_straightened: bool) -> ShapeKind {
    if is_straightened { ShapeKind::Orthants { facing, turn } } else { ShapeKind::Sources { facing, turn } }
}

fn facing(fields: &Reader<'_, '_>) -> Option<Facing> {
    fields.choice("facing", |kind, _| Some(if kind == "Free" { Facing::Free } else { Facing::Fixed }))
}

fn small(fields: &Reader<'_, '_>) -> Option<SmallRule> {
    fields.choice("small", |kind, own| {
        Some(match kind {
            "Removed" => SmallRule::Removed { alpha: own.number("alpha") },
            _ => SmallRule::Kept,
        })
    })
}
