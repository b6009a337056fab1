//! How a preset asks for sketched crowns: `Sketch` of a source, and `sketch` of every variant of a blend.

use super::look::path;
use super::morphs::{ANIMATION, clip};
use super::plan::{
    Clip, MatchParams, MorphKind, MorphParams, PatternParams, SketchDepth, SketchMethod, SketchParams, SketchRules,
    SketchScale, TargetLeaf,
};
use super::reader::{Item, Reader};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::variants::source;

const CROWN: Field = Field {
    name: "crown",
    kind: Kind::Text("an SVG file"),
    default: Default::Required,
    about: "the crown from the front: the union of all that it draws. What has the id `trunk` is the trunk, on whose middle \
            line the tree's stem then stands, foot on foot. A single open line replaces the part of the silhouette that it runs along, over a canvas that is the tree's height (seen from above: from the lowest to the highest that is seen of the tree)",
};

const SIDE: Field = Field {
    name: "side",
    kind: Kind::Text("an SVG file"),
    default: Default::Else("as `depth` says"),
    about: "the crown from the side, 90 degrees on",
};

const DEPTH: Field = Field {
    name: "depth",
    kind: Kind::Choice(&DEPTHS),
    default: Default::Is("Grown"),
    about: "what is done to the depth where there is no `side`",
};

const DEPTH_OVER: Field = Field { default: Default::Is("Kept"), ..DEPTH };

const VIEW: Field = Field {
    name: "view",
    kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" },
    default: Default::Is("0.0"),
    about: "where the front is: 0 looks from +z, 90 from +x; `turn` of light counts from +x",
};

const ELEVATION: Field = Field {
    name: "elevation",
    kind: Kind::Number { low: -90.0, high: 90.0, unit: "degrees" },
    default: Default::Is("0.0"),
    about: "how high the front looks from: 0 is level, 90 straight down on a plan of the crown, where `view` lies at the lower \
            edge. Depth is along that direction, so what a plan is larger by under `Grown` the tree is higher by. Needs a `crown` without \
            a trunk and without a `side`; what has the id `foot` marks where the tree's foot is seen",
};

const SIZE: Field =
    Field { name: "size", kind: Kind::Choice(&SIZES), default: Default::Is("Crown"), about: "how large it is drawn" };

const DETAIL: Field = Field {
    name: "detail",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.5"),
    about: "how much of its detail is kept: 0 its main forms, 1 what leaves can show",
};

const METHOD: Field = Field {
    name: "method",
    kind: Kind::Choice(&METHODS),
    default: Default::Is("Adaptive"),
    about: "how the crown follows what is drawn. All but `Adaptive` are Wang et al. 2018 to the letter: branches follow \
            their tips without bounds, and may stretch, turn, and hang below the ground; depth stays; a drawn trunk only \
            places the crown",
};

const PRUNING: Field = Field {
    name: "pruning",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.3"),
    about: "branches wilt of whose foliage less than that share lies inside of what is drawn (5.4.2: 30 %); at 0 none do",
};

const WILTING: Field = Field {
    name: "wilting",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.5"),
    about: "most of the foliage that may wilt; the rest is drawn in by its limbs. Only the method `Adaptive` has such a limit",
};

const COVERING: Field = Field {
    name: "covering",
    kind: Kind::Number { low: 0.001, high: 0.2, unit: "of the crown's size" },
    default: Default::Is("0.02"),
    about: "how near to the outline of a limb's foliage that of its branches must be to cover it (5.4.1: 10 pixels of a crown 500 \
            across); what none covers those beside it are drawn over",
};

const THEN: Field = Field {
    name: "then",
    kind: Kind::Rows { record: &OVER, low: 1, high: 16 },
    default: Default::Else("none"),
    about: "sketches that are drawn over the tree as the one before leaves it, in order: `then: [(crown: \"bump.svg\", view: \
            90.0)]`; frames go through all of them",
};

static METHODS: Choice = Choice {
    title: "Method of a sketch",
    kinds: &[
        KindOf {
            name: "Adaptive",
            form: Form::Plain,
            about: "cages that adapt, lobes at the rim by the outline itself, a flow that fills what stays open, pruning of half \
                    of the foliage at most, bounds of branches",
        },
        KindOf { name: "Paper", form: Form::Plain, about: "multiscale cages that adapt, and pruning (5.2 to 5.4)" },
        KindOf { name: "Cages", form: Form::Plain, about: "multiscale cages that adapt (5.4.1), no pruning" },
        KindOf { name: "Baseline", form: Form::Plain, about: "multiscale cages that do not adapt (5.3)" },
        KindOf { name: "OneCage", form: Form::Plain, about: "the crown's silhouette as the only cage (Fig. 12)" },
    ],
};

/// A sketch of a source, as one tree or as frames.
pub(super) static SKETCH: Record = Record {
    title: "Sketch",
    about: "A source's crown takes a drawn shape (Wang et al. 2018): `Sketch(of: \"oak\", crown: \"heart.svg\")`.",
    fields: &[
        Field {
            name: "of",
            kind: Kind::Text("a source's name"),
            default: Default::Required,
            about: "whose crown is shaped; blends have a field `sketch`",
        },
        CROWN,
        SIDE,
        DEPTH,
        VIEW,
        ELEVATION,
        SIZE,
        DETAIL,
        METHOD,
        PRUNING,
        WILTING,
        COVERING,
        THEN,
        Field {
            name: "frames",
            kind: Kind::Integer { low: 1, high: 64, unit: "frames" },
            default: Default::Is("1"),
            about: "how many variants it gives: 1 the sketched tree, more from the source to it",
        },
        ANIMATION,
    ],
};

/// A sketch that all variants of an entry follow.
pub(super) static SKETCHED: Record = Record {
    title: "Sketch of every variant",
    about: "`sketch: (crown: \"heart.svg\")`.",
    fields: &[CROWN, SIDE, DEPTH, VIEW, ELEVATION, SIZE, DETAIL, METHOD, PRUNING, WILTING, COVERING, THEN],
};

/// One that is drawn over the tree that another gave.
static OVER: Record = Record {
    title: "Sketch over a sketch",
    about: "As a sketch, of the tree as the one before leaves it: what it is seen like, as large as it then is, is what is drawn \
            over (Wang et al. 2018, 5.1). It keeps the depth, in which others may have been drawn.",
    fields: &[CROWN, SIDE, DEPTH_OVER, VIEW, ELEVATION, SIZE, DETAIL, METHOD, PRUNING, WILTING, COVERING],
};

/// The field of an entry that gives several variants.
pub(super) const SKETCH_FIELD: Field = Field {
    name: "sketch",
    kind: Kind::Fields(&SKETCHED),
    default: Default::Else("none"),
    about: "a drawn shape that the crown of every variant takes",
};

static DEPTHS: Choice = Choice {
    title: "Depth of a sketch",
    kinds: &[
        KindOf {
            name: "Grown",
            form: Form::Plain,
            about: "as much deeper as the outline is larger: by the root of how many times the crown's area it has, 0.2 to 4",
        },
        KindOf { name: "Kept", form: Form::Plain, about: "the tree's own" },
        KindOf {
            name: "Revolved",
            form: Form::Plain,
            about: "the outline is revolved about a drawn trunk, which stands upright, else about the stem below the \
                    crown; about the crown's middle where it hangs far beside its stem, or has several",
        },
    ],
};

static SIZES: Choice = Choice {
    title: "Size of a sketch",
    kinds: &[
        KindOf {
            name: "Crown",
            form: Form::Plain,
            about: "as much area as the crown has as it is seen, at its foot, from straight above about its middle; with a trunk the tree's \
                    height; where an id `foot` marks it, with the mark on the tree's foot",
        },
        KindOf {
            name: "Stretched",
            form: Form::Plain,
            about: "as wide and high as the crown, at its foot; with a trunk beside that",
        },
        KindOf {
            name: "Metres",
            form: Form::One(&METRES),
            about: "a height in metres, of trunk and crown as far as they are drawn; of an open line that of its canvas",
        },
    ],
};

static METRES: Record = Record {
    title: "Metres",
    about: "`Metres(6.0)`.",
    fields: &[Field {
        name: "height",
        kind: Kind::Number { low: 0.01, high: 1000.0, unit: "m" },
        default: Default::Required,
        about: "of all that is drawn: the tree is made as at the size `Crown` and is then as much larger or smaller, its bole, the \
                thickness of its wood and its leaves, too; for leaves of their own size, give the source that `height`. An \
                open line is placed by it only: the tree stays as large as it is",
    }],
};

/// The sketch that a group of fields asks for, and those over it.
fn sketch(fields: &Reader<'_, '_>) -> Option<SketchParams> {
    let first = one(fields);
    let of = |item: &Item<'_>| one(&Reader::new(fields.report(), &OVER, item));
    // All are read, so that all that is wrong is told.
    let then: Vec<Option<SketchParams>> = fields.list("then").iter().map(of).collect();
    let then: Vec<SketchParams> = then.into_iter().collect::<Option<_>>()?;
    if fields.has("then") && then.is_empty() {
        return None;
    }
    Some(SketchParams { then, ..first? })
}

/// What a group of fields asks for by itself.
fn one(fields: &Reader<'_, '_>) -> Option<SketchParams> {
    let crown = path(fields, "crown");
    let side = if fields.has("side") { path(fields, "side") } else { String::new() };
    let depth = fields.choice("depth", |kind, _| {
        Some(match kind {
            "Revolved" => SketchDepth::Revolved,
            "Kept" => SketchDepth::Kept,
            _ => SketchDepth::Grown,
        })
    });
    let size = fields.choice("size", |kind, own| {
        Some(match kind {
            "Stretched" => SketchScale::Stretched,
            "Metres" => SketchScale::Metres(own.number("height")),
            _ => SketchScale::Crown,
        })
    });
    if fields.has("side") && depth == Some(SketchDepth::Revolved) {
        fields.fault("depth", "a revolved outline has no side of its own", "leave `side` or `depth` out");
    }
    let method = fields.choice("method", |kind, _| {
        Some(match kind {
            "Paper" => SketchMethod::Paper,
            "Cages" => SketchMethod::Cages,
            "Baseline" => SketchMethod::Baseline,
            "OneCage" => SketchMethod::OneCage,
            _ => SketchMethod::Adaptive,
        })
    });
    let grows = fields.has("depth") && depth == Some(SketchDepth::Grown);
    if grows && method.is_some_and(|method| method != SketchMethod::Adaptive) {
        fields.fault("depth", "only the method `Adaptive` lets depth grow", "leave `depth` or `method` out");
    }
    let rules = rules(fields, method);
    let elevation = fields.number("elevation").to_radians();
    let upright = match depth {
        _ if fields.has("side") => Some(("a view from the side", "`side`")),
        Some(SketchDepth::Revolved) => Some(("a revolved outline", "`depth`")),
        _ => None,
    };
    if let Some((what, other)) = upright.filter(|_| elevation != 0.0) {
        fields.fault("elevation", format!("{what} needs a level front"), format!("leave `elevation` or {other} out"));
    }
    let (view, detail) = (fields.number("view").to_radians(), fields.number("detail"));
    let field = fields.path().to_string();
    if crown.is_empty() || (fields.has("side") && side.is_empty()) {
        return None;
    }
    let (depth, size, method, then) = (depth?, size?, method?, Vec::new());
    Some(SketchParams { field, crown, side, depth, view, elevation, size, detail, method, rules, then })
}

/// What its lobes wilt and cover by; of what a method does not do nothing can be told.
fn rules(fields: &Reader<'_, '_>, method: Option<SketchMethod>) -> SketchRules {
    use SketchMethod::{Adaptive, Cages, Paper};
    let needs = [
        ("pruning", &[Adaptive, Paper][..], "only the methods `Adaptive` and `Paper` have branches wilt"),
        ("wilting", &[Adaptive][..], "only the method `Adaptive` has a limit to what wilts"),
        (
            "covering",
            &[Adaptive, Paper, Cages][..],
            "only the methods `Adaptive`, `Paper` and `Cages` have cages that adapt",
        ),
    ];
    for (name, by, message) in needs {
        if fields.has(name) && method.is_some_and(|method| !by.contains(&method)) {
            fields.fault(name, message, format!("leave `{name}` or `method` out"));
        }
    }
    let [pruning, wilting, covering] = needs.map(|(name, ..)| fields.number(name));
    if fields.has("wilting") && pruning == 0.0 {
        fields.fault(
            "wilting",
            "nothing wilts where `pruning` is 0",
            "leave `wilting` out, or give a larger `pruning`",
        );
    }
    SketchRules { pruning, wilting, covering }
}

/// The sketch of every variant of an entry; none where it asks for none.
pub(super) fn of_all(fields: &Reader<'_, '_>) -> Option<SketchParams> {
    if fields.has("sketch") { fields.group("sketch", sketch)? } else { None }
}

/// What a `Sketch` gives.
pub(super) enum Drawn {
    /// One tree, of this source.
    Tree(usize, SketchParams),
    /// Frames.
    Frames(MorphParams),
}

/// A `Sketch`.
pub(super) fn sketch_of(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<Drawn> {
    let of = source(fields, &fields.item("of")?, names);
    let sketch = sketch(fields);
    let frames = fields.count("frames");
    let clip = clip(fields)?;
    let (of, sketch) = (of?, sketch?);
    if frames < 2 {
        if fields.has("animation") && clip != Clip::None {
            fields.fault("animation", "a single frame does not move", "raise `frames` to 2 or more");
        }
        return Some(Drawn::Tree(of, sketch));
    }
    let matching = MatchParams { crown: 1.0, direction: 0.0, ratio: 0.0 };
    let (kind, patterns) = (MorphKind::Sketch { of, sketch }, PatternParams::default());
    Some(Drawn::Frames(MorphParams { entry, kind, frames, matching, patterns, leaf: TargetLeaf::AsSet, clip }))
}
