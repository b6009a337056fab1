//! How a preset asks for blends: `Blend`, `Mix` and `Explore`, and the parts of sources that `only` names.
//!
//! A `Blend` of `count` trees takes tree i at a point of the van der Corput sequence between `from` and `to`, which
//! spreads any count evenly and leaves the first trees where they were when the count is raised. Each tree has a batch
//! (a schedule of which branch grows, wilts or moves when) of its own, unless `batches` says how many share theirs;
//! batches are numbered behind the entry's `seed`, so two entries with different seeds share nothing. With `trees` each
//! batch gives a whole sequence, and of the trees of all batches `count` are kept.
//!
//! Parts of sources: chains have no names in files, so a preset names them. A part is a branch by its number in the
//! source's plant (as `inspect` counts), with all that it bears, or what stands between two heights on one side.

use super::blend_rules::{RADII_FIELD, SCALE_FIELD, STEMS_FIELD, STEMS_OF_MANY_FIELD, radii, scale, stems};
use super::decided::{KEEP_FIELD, REJECT_FIELD, decided};
use super::pick::{
    CANDIDATES_FIELD, FILTER_FIELD, MENDED_FIELD, PICK_FIELD, SCORES_FIELD, Wanted, cleared, clusters, mended, wanted,
};
use super::plan::{BlendParams, BlendScale, BlendTree, Decided, MatchParams, OnlyParams, Part, PartRegion, Source};
use super::reader::{Reader, clip, many};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::set::BY_DEFAULTS;
use super::sketches::SKETCH_FIELD;
use super::variants::{kind_of, source};
use crate::base::simplex_point;

/// Most trees of one entry.
const MOST_TREES: u64 = 256;
/// Most trees of all batches of one entry.
const MOST_IN_POOL: u64 = 2048;
/// Batches of sequences, where a preset does not say how many.
const BATCHES: u64 = 4;
/// Share of its way that a batch goes in a wide step at its usual pace.
const WIDEST_STEP: f32 = 0.2;
/// Most sources of one mix.
const MOST_SOURCES: usize = 16;

const COUNT: Kind = Kind::Integer { low: 1, high: MOST_TREES, unit: "trees" };

const SEED: Field = Field {
    name: "seed",
    kind: Kind::Integer { low: 0, high: 1_000_000, unit: "" },
    default: Default::Is("0"),
    about: "another one gives other trees of the same sources",
};

pub(super) const MATCHED: Field = Field {
    name: "matching",
    kind: Kind::Fields(&MATCHING),
    default: BY_DEFAULTS,
    about: "what makes two branches alike",
};

const ONLY_SOME: Field = Field {
    name: "only",
    kind: Kind::ListOf { choice: &ONLY, low: 1, high: 16 },
    default: Default::Else("all branches"),
    about: "which branches take part; the rest stays as in the first source. Demands of one kind are alternatives, \
            demands of different kinds must all hold",
};

const SCATTER: Field = Field {
    name: "scatter",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.0"),
    about: "how far each branch strays from the weights: 0 for the same everywhere, 1 for up to twice a share or none",
};

/// Trees between two sources.
pub(super) static BLEND: Record = Record {
    title: "Blend",
    about: "Stochastic blending (Wang et al. 2017): branches of one source grow, wilt or turn into those of the other. Trees are as high \
            as lies between sources of unlike heights.",
    fields: &[
        Field {
            name: "of",
            kind: Kind::Texts { what: "sources' names", low: 2, high: 2 },
            default: Default::Required,
            about: "from the first to the second",
        },
        Field {
            name: "count",
            kind: COUNT,
            default: Default::Else("to be given; with `trees` and `pick: Inspiring` ⌈√(N/2)⌉ of all N trees"),
            about: "how many variants it gives",
        },
        Field {
            name: "from",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.15"),
            about: "least progress; 0 is the first source",
        },
        Field {
            name: "to",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.85"),
            about: "most progress; 1 is the second source",
        },
        Field {
            name: "batches",
            kind: Kind::Integer { low: 1, high: MOST_TREES, unit: "" },
            default: Default::Else("one a tree, or 4 with `trees`"),
            about: "how many schedules there are; 1 puts all trees on one way from source to source",
        },
        Field {
            name: "trees",
            kind: Kind::Integer { low: 1, high: 4096, unit: "trees" },
            default: Default::Else("none but those that are kept"),
            about: "how many in-between trees each batch makes, of which `count` are kept",
        },
        SEED,
        MATCHED,
        STEMS_FIELD,
        SCALE_FIELD,
        RADII_FIELD,
        ONLY_SOME,
        PICK_FIELD,
        CANDIDATES_FIELD,
        SCORES_FIELD,
        FILTER_FIELD,
        KEEP_FIELD,
        REJECT_FIELD,
        SKETCH_FIELD,
    ],
};

/// Trees at given weights.
pub(super) static MIX: Record = Record {
    title: "Mix",
    about: "N-way blending (Wang et al. 2017, 4.6): `Mix(of: {\"oak\": 0.5, \"elm\": 0.3, \"ash\": 0.2})`.",
    fields: &[
        Field {
            name: "of",
            kind: Kind::Shares { what: "sources' names", low: 0.0, high: 1000.0, least: 2, most: MOST_SOURCES },
            default: Default::Required,
            about: "a weight for each source; only their ratios count",
        },
        Field {
            name: "count",
            kind: COUNT,
            default: Default::Is("1"),
            about: "how many trees; several need `scatter`",
        },
        SCATTER,
        SEED,
        MATCHED,
        STEMS_OF_MANY_FIELD,
        RADII_FIELD,
        ONLY_SOME,
        MENDED_FIELD,
        KEEP_FIELD,
        REJECT_FIELD,
        SKETCH_FIELD,
    ],
};

/// Trees all over the space between sources.
pub(super) static EXPLORE: Record = Record {
    title: "Explore",
    about: "Samples all weights of N sources evenly; a greater `count` keeps the first trees.",
    fields: &[
        Field {
            name: "of",
            kind: Kind::Texts { what: "sources' names", low: 2, high: MOST_SOURCES },
            default: Default::Required,
            about: "the sources that span the space",
        },
        Field { name: "count", kind: COUNT, default: Default::Required, about: "how many variants it gives" },
        SCATTER,
        SEED,
        MATCHED,
        STEMS_OF_MANY_FIELD,
        RADII_FIELD,
        ONLY_SOME,
        PICK_FIELD,
        CANDIDATES_FIELD,
        SCORES_FIELD,
        FILTER_FIELD,
        KEEP_FIELD,
        REJECT_FIELD,
        SKETCH_FIELD,
    ],
};

static ONLY: Choice = Choice {
    title: "Only",
    kinds: &[
        KindOf {
            name: "Order",
            form: Form::Fields(&ORDER),
            about: "branches by their order: 1 the trunk, 2 its limbs",
        },
        KindOf { name: "Above", form: Form::One(&ABOVE), about: "branches that leave above a height" },
        KindOf { name: "Below", form: Form::One(&BELOW), about: "branches that leave below a height" },
        KindOf { name: "Part", form: Form::One(&NAMED_PART), about: "branches in a part that a source names" },
    ],
};

static ORDER: Record = Record {
    title: "Order",
    about: "`Order(from: 2, to: 3)`.",
    fields: &[
        Field {
            name: "from",
            kind: Kind::Integer { low: 1, high: 100, unit: "" },
            default: Default::Required,
            about: "lowest order",
        },
        Field {
            name: "to",
            kind: Kind::Integer { low: 1, high: 100, unit: "" },
            default: Default::Else("as `from`"),
            about: "highest order",
        },
    ],
};

const fn height_share(name: &'static str, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: 0.0, high: 1.0, unit: "of the height" }, default, about }
}

static ABOVE: Record = Record {
    title: "Above",
    about: "`Above(0.5)`: the upper half.",
    fields: &[height_share("height", Default::Required, "of a branch's base")],
};

static BELOW: Record = Record {
    title: "Below",
    about: "`Below(0.5)`: the lower half.",
    fields: &[height_share("height", Default::Required, "of a branch's base")],
};

static NAMED_PART: Record = Record {
    title: "Part",
    about: "`Part(\"crown\")`: any source's part of that name.",
    fields: &[Field {
        name: "name",
        kind: Kind::Text("a part's name"),
        default: Default::Required,
        about: "as `parts` of a source gives it",
    }],
};

/// The parts of a source.
pub(super) static PART: Choice = Choice {
    title: "Parts",
    kinds: &[
        KindOf { name: "Branch", form: Form::One(&BRANCH), about: "one branch and all that it bears" },
        KindOf { name: "Region", form: Form::Fields(&REGION), about: "the branches between two heights on one side" },
    ],
};

static BRANCH: Record = Record {
    title: "Branch",
    about: "`Branch(12)`.",
    fields: &[Field {
        name: "number",
        kind: Kind::Integer { low: 0, high: 10_000_000, unit: "" },
        default: Default::Required,
        about: "its place among the source's branches, from 0",
    }],
};

static REGION: Record = Record {
    title: "Region",
    about: "Branches by where they leave and to which side they point.",
    fields: &[
        height_share("low", Default::Is("0.0"), "lowest base of a branch"),
        height_share("high", Default::Is("1.0"), "highest base of a branch"),
        Field {
            name: "azimuth",
            kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" },
            default: Default::Is("0.0"),
            about: "the side: 0 is the front (+z), 90 is +x",
        },
        Field {
            name: "within",
            kind: Kind::Number { low: 1.0, high: 180.0, unit: "degrees" },
            default: Default::Is("180.0"),
            about: "how far to both sides of it",
        },
    ],
};

const fn weight(name: &'static str, default: &'static str, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: 0.0, high: 100.0, unit: "" }, default: Default::Is(default), about }
}

static MATCHING: Record = Record {
    title: "Matching",
    about: "Weights against each other; only their ratios count.",
    fields: &[
        weight("crown", "0.5", "shape of the crown that a branch bears"),
        weight("direction", "0.3", "direction in which it branches off"),
        weight("ratio", "0.2", "share of it that bears branches"),
    ],
};

/// An entry that blends.
pub(super) struct Blended {
    /// What its trees are made of.
    pub(super) blend: BlendParams,
    /// All trees that it makes.
    pub(super) trees: Vec<BlendTree>,
    /// The number of each, from 0; empty where trees are told apart by nothing that a number could mean.
    pub(super) numbers: Vec<usize>,
    /// What was decided about single trees.
    pub(super) decided: Decided,
    /// Which of them are kept, where not all are.
    pub(super) wanted: Option<Wanted>,
    /// How many are kept.
    pub(super) count: u64,
}

/// A `Blend` and its trees.
pub(super) fn blend(entry: usize, fields: &Reader<'_, '_>, names: &[&str], sources: &[Source]) -> Option<Blended> {
    let of = of_list(fields, names);
    let pooled = fields.has("trees");
    let count = blends_count(fields, pooled);
    let wanted = wanted(fields, count, of.as_deref().unwrap_or_default(), names);
    let decided = decided(fields, count);
    let numbers = decided.numbers(count);
    let candidates = candidates(wanted.as_ref(), &decided, count);
    let batches = fields.integer_or("batches", if pooled { BATCHES } else { candidates });
    let trees = fields.integer_or("trees", 0);
    // With `trees`, what is picked is picked of all of them.
    let in_pool = (batches * trees).clamp(1, MOST_IN_POOL);
    let made = match (pooled, wanted.is_some()) {
        (true, true) => in_pool,
        // Never more than there are, also where that is an error.
        (true, false) => candidates.min(in_pool),
        _ => candidates,
    };
    let seed = fields.integer("seed");
    let (low, high) = (fields.number("from"), fields.number("to"));
    if low > high {
        fields.fault("from", format!("`from` {low} is above `to` {high}"), "swap the two");
    }
    if pooled && wanted.is_some() && fields.has("candidates") {
        let message = format!("with `trees` there are {batches} × {trees} candidates");
        fields.fault("candidates", message, "leave one of the two out");
    }
    if !pooled && batches > made {
        let message = format!("{} for {}", many(batches, "batch", "batches"), many(made, "tree", "trees"));
        fields.fault("batches", message, "leave it out for a batch a tree");
    }
    if pooled && batches * trees < count {
        let [trees, count] = [trees, count].map(|n| many(n, "tree", "trees"));
        let message = format!("{count} of {} with {trees} each", many(batches, "batch", "batches"));
        fields.fault("count", message, "raise `trees` or `batches`");
    }
    if pooled && decided.reach(count) > batches * trees && batches * trees >= count {
        let message = format!("asks for tree {} of {}", decided.reach(count), batches * trees);
        let field = if decided.keep.is_empty() { "reject" } else { "keep" };
        fields.fault(field, message, "raise `trees` or `batches`, or decide about fewer");
    }
    if batches * trees > MOST_IN_POOL {
        let (batches, trees) = (many(batches, "batch", "batches"), many(trees, "tree", "trees"));
        let message = format!("{batches} of {trees} are more than {MOST_IN_POOL}");
        fields.fault("trees", message, "lower one of the two");
    }
    let (stems, scale, radii) = (stems(fields), scale(fields), radii(fields));
    let only = only(fields);
    let matching = fields.group("matching", matching)?;
    let of = of?;
    check_parts(fields, &only, &of, sources);
    let filter = if wanted.is_some() { None } else { cleared(fields) };
    let blend = BlendParams { entry, of, matching, stems: stems?, scale: scale?, radii: radii?, only, filter };
    let at = |place: f32| (low + (high - low) * place).clamp(0.0, 1.0);
    let batch = |i: u64| (seed << 32) | (i % batches.max(1));
    let trees = if pooled {
        // Round the batches, and in each through its sequence in an order that spreads any number evenly.
        let order = spread(trees.max(1));
        // Slow enough that neighbours in a sequence are hardly ever one state, from its first steps on, which are widest.
        let span = (high - low).max(0.05);
        let pace = (span / (WIDEST_STEP * trees.max(1) as f32)).min(1.0);
        let place = |i: u64| (order[(i / batches.max(1)) as usize] as f32 + 0.5) / trees.max(1) as f32;
        (0..made).map(|i| BlendTree::State { batch: batch(i), progress: at(place(i)), pace }).collect()
    } else {
        (0..made)
            .map(|i| BlendTree::State { batch: batch(i), progress: at(radical_inverse(i + 1)), pace: 1.0 })
            .collect()
    };
    Some(taken(blend, trees, numbers, decided, wanted, count))
}

/// How many trees a `Blend` gives: of sequences the paper's ⌈√(N/2)⌉ inspiring ones of N, unless it says how many.
fn blends_count(fields: &Reader<'_, '_>, pooled: bool) -> u64 {
    if fields.has("count") {
        return fields.integer_or("count", 1);
    }
    let inspiring = fields.item("pick").is_some_and(|item| kind_of(&item) == "Inspiring");
    if !(pooled && inspiring) {
        fields.missing("count", "; only with `trees` and `pick: Inspiring` it may be left out");
        return 1;
    }
    let all = (fields.integer_or("batches", BATCHES) * fields.integer_or("trees", 1)).min(MOST_IN_POOL);
    clusters(all)
}

/// How many trees an entry makes, of which those are taken that it gives.
fn candidates(wanted: Option<&Wanted>, decided: &Decided, count: u64) -> u64 {
    let reach = decided.reach(count);
    wanted.map_or(reach, |wanted| wanted.candidates.max(reach))
}

/// An entry's trees out of all that it makes: all of them where a selection picks, else those of the given numbers.
fn taken(
    blend: BlendParams,
    trees: Vec<BlendTree>,
    numbers: Vec<usize>,
    decided: Decided,
    wanted: Option<Wanted>,
    count: u64,
) -> Blended {
    let (trees, numbers) = if wanted.is_some() {
        (trees, Vec::new())
    } else {
        numbers.into_iter().filter_map(|n| Some((trees.get(n)?.clone(), n))).unzip()
    };
    Blended { blend, trees, numbers, decided, wanted, count }
}

/// The numbers below `count`, each once, so that any first ones of them spread evenly.
fn spread(count: u64) -> Vec<u64> {
    let bits = count.next_power_of_two().trailing_zeros();
    let turned = |i: u64| if bits == 0 { 0 } else { i.reverse_bits() >> (64 - bits) };
    (0..1 << bits).map(turned).filter(|&n| n < count).collect()
}

/// A `Mix` and its trees.
pub(super) fn mix(entry: usize, fields: &Reader<'_, '_>, names: &[&str], sources: &[Source]) -> Option<Blended> {
    let given = fields.shares("of");
    let mut of = Vec::new();
    let mut shares = Vec::new();
    let mut sound = true;
    for (name, item, share) in &given {
        match names.iter().position(|known| *known == name.text) {
            Some(index) if of.contains(&index) => {
                fields.report().at(name.span, &item.path, "given twice", "add the two weights up");
                sound = false;
            }
            Some(index) => {
                of.push(index);
                shares.push(*share);
            }
            None => {
                fields.no_such(name.span, &item.path, "source", &name.text, names);
                sound = false;
            }
        }
    }
    let sum: f32 = shares.iter().sum();
    if sound && given.len() > 1 && sum <= 0.0 {
        fields.fault("of", "all weights are zero", "give one of them");
        sound = false;
    }
    let (count, scatter, seed) = (fields.integer("count"), fields.number("scatter"), fields.integer("seed"));
    if count > 1 && scatter == 0.0 {
        let message = format!("{count} trees of the same weights are {count} times one tree");
        fields.fault("count", message, "give `scatter`, or take Explore");
        sound = false;
    }
    let decided = decided(fields, count);
    if scatter == 0.0 && !decided.is_empty() {
        let field = if decided.keep.is_empty() { "reject" } else { "keep" };
        fields.fault(field, "there is one tree of these weights alone", "give `scatter`, or leave it out");
        sound = false;
    }
    let only = only(fields);
    let filter = mended(fields);
    let (stems, radii) = (stems(fields), radii(fields));
    let matching = fields.group("matching", matching)?;
    if !sound || of.len() < 2 {
        return None;
    }
    check_parts(fields, &only, &of, sources);
    let blend =
        BlendParams { entry, of, matching, stems: stems?, scale: BlendScale::Chain, radii: radii?, only, filter };
    let shares: Vec<f32> = shares.iter().map(|share| share / sum).collect();
    let tree = |i| BlendTree::Point { shares: shares.clone(), scatter, draw: (seed << 32) | i };
    let trees = (0..decided.reach(count)).map(tree).collect();
    let numbers = decided.numbers(count);
    let mut made = taken(blend, trees, numbers, decided, None, count);
    if scatter == 0.0 {
        made.numbers.clear();
    }
    Some(made)
}

/// An `Explore` and its trees.
pub(super) fn explore(entry: usize, fields: &Reader<'_, '_>, names: &[&str], sources: &[Source]) -> Option<Blended> {
    let of = of_list(fields, names);
    let wanted = wanted(fields, fields.integer("count"), of.as_deref().unwrap_or_default(), names);
    let (count, scatter, seed) = (fields.integer("count"), fields.number("scatter"), fields.integer("seed"));
    let only = only(fields);
    let (stems, radii) = (stems(fields), radii(fields));
    let matching = fields.group("matching", matching)?;
    let of = of?;
    check_parts(fields, &only, &of, sources);
    // Another seed starts elsewhere on the same sequence.
    let tree = |i| BlendTree::Point {
        shares: simplex_point(of.len(), seed * MOST_IN_POOL + i),
        scatter,
        draw: (seed << 32) | i,
    };
    let decided = decided(fields, count);
    let trees = (0..candidates(wanted.as_ref(), &decided, count)).map(tree).collect();
    let numbers = decided.numbers(count);
    let filter = if wanted.is_some() { None } else { cleared(fields) };
    let blend =
        BlendParams { entry, of, matching, stems: stems?, scale: BlendScale::Chain, radii: radii?, only, filter };
    Some(taken(blend, trees, numbers, decided, wanted, count))
}

/// The sources of a list, each once.
fn of_list(fields: &Reader<'_, '_>, names: &[&str]) -> Option<Vec<usize>> {
    let items = fields.list("of");
    let of: Vec<Option<usize>> = items.iter().map(|item| source(fields, item, names)).collect();
    let of: Vec<usize> = of.into_iter().collect::<Option<_>>()?;
    for (i, index) in of.iter().enumerate() {
        if of[..i].contains(index) {
            fields.fault("of", "blends a source with itself", "name different sources");
            return None;
        }
    }
    (of.len() > 1).then_some(of)
}

fn only(fields: &Reader<'_, '_>) -> OnlyParams {
    let mut only = OnlyParams::default();
    if !fields.has("only") {
        return only;
    }
    for item in fields.list("only") {
        fields.kind(&ONLY, &item, |kind, own| {
            match kind {
                "Order" => {
                    let from = own.integer("from");
                    let to = own.integer_or("to", from);
                    if from > to {
                        own.fault("from", format!("`from` {from} is above `to` {to}"), "swap the two");
                    }
                    only.orders.push((from as u16, to as u16));
                }
                "Above" => only.heights.push((own.number("height"), 1.0)),
                "Below" => only.heights.push((0.0, own.number("height"))),
                _ => only.parts.extend(own.text("name").map(|(name, _)| name)),
            }
            Some(())
        });
    }
    only
}

/// Reports the parts that no source of the blend has.
fn check_parts(fields: &Reader<'_, '_>, only: &OnlyParams, of: &[usize], sources: &[Source]) {
    for name in &only.parts {
        // A source that is wrong is missing here, and its error is told.
        let known = || of.iter().filter_map(|&s| sources.get(s)).flat_map(|source| &source.parts);
        if known().all(|part| part.name != *name) {
            let all: Vec<String> = known().map(|part| format!("\"{}\"", clip(&part.name))).collect();
            let hint = match all.len() {
                0 => "give one of its sources `parts`".to_string(),
                _ => format!("there are {}", all.join(", ")),
            };
            fields.fault("only", format!("no source of the blend has a part \"{}\"", clip(name)), hint);
        }
    }
}

/// The parts that a source names.
pub(super) fn parts(fields: &Reader<'_, '_>) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for (name, item) in fields.map("parts") {
        if parts.iter().any(|part| part.name == name.text) {
            fields.report().at(name.span, &item.path, "given twice", "leave one of the two out");
            continue;
        }
        let region = fields.kind(&PART, &item, |kind, own| {
            Some(match kind {
                "Branch" => PartRegion::Branch(own.count("number")),
                _ => {
                    let (low, high) = (own.number("low"), own.number("high"));
                    if low > high {
                        own.fault("low", format!("`low` {low} is above `high` {high}"), "swap the two");
                    }
                    let (azimuth, within) = (own.number("azimuth").to_radians(), own.number("within").to_radians());
                    PartRegion::Region { low, high, azimuth, within }
                }
            })
        });
        parts.extend(region.map(|region| Part { name: name.text, region }));
    }
    parts
}

pub(super) fn matching(fields: &Reader<'_, '_>) -> MatchParams {
    let (crown, direction, ratio) = (fields.number("crown"), fields.number("direction"), fields.number("ratio"));
    let sum = crown + direction + ratio;
    if sum < 1e-3 {
        fields.report().at(fields.span(), fields.path(), "all weights are zero", "give one of them");
        return MatchParams { crown: 1.0, direction: 0.0, ratio: 0.0 };
    }
    MatchParams { crown: crown / sum, direction: direction / sum, ratio: ratio / sum }
}

/// The i-th number of the van der Corput sequence, 0..1: 1/2, 1/4, 3/4, 1/8, …
fn radical_inverse(i: u64) -> f32 {
    ((i.reverse_bits() >> 40) as f32) / 16_777_216.0
}
