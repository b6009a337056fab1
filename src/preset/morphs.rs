//! How a preset asks for sequences: `Morph` between two sources and `Grow` of one, as variants and as an animated file.
//!
//! Each frame is a variant. The first and the last frame of a morph are the sources themselves.

use super::blends::{MATCHED, matching};
use super::look::{LEAF_NAMES, named_leaf};
use super::plan::{Clip, MorphKind, MorphParams, PatternParams, TargetLeaf};
use super::reader::{Pick, Reader};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::set::BY_DEFAULTS;
use super::variants::source;

/// Most frames of one sequence.
const MOST_FRAMES: u64 = 64;

const FRAMES: Field = Field {
    name: "frames",
    kind: Kind::Integer { low: 2, high: MOST_FRAMES, unit: "frames" },
    default: Default::Required,
    about: "how many variants it gives, the ends included",
};

pub(super) const ANIMATION: Field = Field {
    name: "animation",
    kind: Kind::Choice(&CLIPS),
    default: Default::Is("Clip()"),
    about: "one file more that moves through all frames",
};

/// Frames between two sources.
pub(super) static MORPH: Record = Record {
    title: "Morph",
    about: "One tree turns into another, leaves and all (Wang et al. 2017, CAVW).",
    fields: &[
        Field {
            name: "from",
            kind: Kind::Text("a source's name"),
            default: Default::Required,
            about: "what the first frame is",
        },
        Field {
            name: "to",
            kind: Kind::Text("a source's name"),
            default: Default::Required,
            about: "what the last frame is",
        },
        FRAMES,
        Field {
            name: "leaf",
            kind: Kind::WordOrChoice(LEAF_NAMES, &TARGET_LEAF),
            default: Default::Else("`Set`"),
            about: "the leaf that `to` wears where it brings none of its own; leaves turn into it",
        },
        MATCHED,
        Field {
            name: "patterns",
            kind: Kind::Fields(&PATTERNS),
            default: BY_DEFAULTS,
            about: "which branches of a place are matched together",
        },
        ANIMATION,
    ],
};

/// Thresholds of branching patterns.
static PATTERNS: Record = Record {
    title: "Patterns",
    about: "Branches of one place that are alike are one group with what goes on there; groups are matched one to one, and only \
            branches of matched groups turn into each other.",
    fields: &[
        Field {
            name: "angle",
            kind: Kind::Number { low: 0.0, high: 90.0, unit: "degrees" },
            default: Default::Is("10.0"),
            about: "standard deviation of branching angles up to which branches are alike",
        },
        Field {
            name: "radius",
            kind: Kind::Number { low: 0.0, high: 2.0, unit: "of their mean" },
            default: Default::Is("0.2"),
            about: "standard deviation of radii up to which branches are alike",
        },
        Field {
            name: "divergence",
            kind: Kind::Number { low: 0.0, high: 180.0, unit: "degrees" },
            default: Default::Is("30.0"),
            about: "how far from half a turn two branches may stand apart and be opposite",
        },
    ],
};

/// Frames of one source's growth.
pub(super) static GROWTH: Record = Record {
    title: "Grow in frames",
    about: "A source grows from a sapling to full size: `Grow(of: \"oak\", frames: 8)`.",
    fields: &[
        Field {
            name: "of",
            kind: Kind::Text("a source's name"),
            default: Default::Required,
            about: "what the last frame is",
        },
        FRAMES,
        Field {
            name: "age",
            kind: Kind::Number { low: 0.01, high: 0.95, unit: "of full age" },
            default: Default::Is("0.2"),
            about: "age in the first frame",
        },
        ANIMATION,
    ],
};

static TARGET_LEAF: Choice = Choice {
    title: "Leaf of a morph",
    kinds: &[KindOf { name: "Set", form: Form::Plain, about: "as `foliage` says, for both" }],
};

static CLIPS: Choice = Choice {
    title: "Animation",
    kinds: &[
        KindOf { name: "None", form: Form::Plain, about: "frames only" },
        KindOf { name: "Clip", form: Form::Fields(&CLIP), about: "a GLB with morph targets, which engines play" },
    ],
};

static CLIP: Record = Record {
    title: "Clip",
    about: "`SET_clip_001.glb`, one for all engines: its textures are those that all of them read, PNG where they share no format. Its geometry is simpler than the frames'.",
    fields: &[
        Field {
            name: "seconds",
            kind: Kind::Number { low: 0.5, high: 600.0, unit: "s" },
            default: Default::Is("6.0"),
            about: "how long it lasts",
        },
        Field {
            name: "vertices",
            kind: Kind::Integer { low: 500, high: 500_000, unit: "vertices" },
            default: Default::Is("30000"),
            about: "most vertices of wood; each takes 24 bytes a frame",
        },
        Field {
            name: "leaves",
            kind: Kind::Integer { low: 0, high: 100_000, unit: "leaves" },
            default: Default::Is("4000"),
            about: "most leaves; the rest is left out, and these are enlarged",
        },
    ],
};

/// A `Morph`.
pub(super) fn morph(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<MorphParams> {
    let ends = ["from", "to"].map(|name| source(fields, &fields.item(name)?, names));
    let frames = fields.count("frames");
    let leaf = match fields.item("leaf") {
        None => TargetLeaf::AsSet,
        Some(item) => match fields.pick("leaf", &item)? {
            Pick::Word(index) => named_leaf(index)?,
            Pick::Kind => fields.choice("leaf", |_, _| Some(TargetLeaf::AsSet))?,
        },
    };
    let matching = fields.group("matching", matching)?;
    let patterns = fields.group("patterns", |own| PatternParams {
        angle: own.number("angle").to_radians(),
        radius: own.number("radius"),
        divergence: own.number("divergence").to_radians(),
    })?;
    let clip = clip(fields)?;
    let [from, to] = [ends[0]?, ends[1]?];
    if from == to {
        fields.fault("to", "morphs a source into itself", "name different sources");
        return None;
    }
    Some(MorphParams { entry, kind: MorphKind::Between(from, to), frames, matching, patterns, leaf, clip })
}

/// A `Grow`.
pub(super) fn growth(entry: usize, fields: &Reader<'_, '_>, names: &[&str]) -> Option<MorphParams> {
    let of = source(fields, &fields.item("of")?, names);
    let frames = fields.count("frames");
    let age = fields.number("age");
    let clip = clip(fields)?;
    let matching = super::plan::MatchParams { crown: 1.0, direction: 0.0, ratio: 0.0 };
    Some(MorphParams {
        entry,
        kind: MorphKind::Growth { of: of?, age },
        frames,
        matching,
        patterns: PatternParams::default(),
        leaf: TargetLeaf::AsSet,
        clip,
    })
}

pub(super) fn clip(fields: &Reader<'_, '_>) -> Option<Clip> {
    fields.choice("animation", |kind, own| {
        Some(match kind {
            "Clip" => Clip::Play {
                seconds: own.number("seconds"),
                vertices: own.count("vertices"),
                leaves: own.count("leaves"),
            },
            _ => Clip::None,
        })
    })
}
