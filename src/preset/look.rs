//! How a set's leaves and bark look: the `foliage` and `bark` of a preset, and the defaults of each leaf.
//!
//! The leaf's name decides what is not given: [`LEAVES`] is the one table of sizes, angles, colours and barks by leaf.
//! Sizes are those of large leaves of each genus in summer: a card shows a whole spray, and somewhat larger leaves on
//! fewer cards look the same from where trees are looked at.

use std::collections::{BTreeMap, BTreeSet};

use super::path::relative;
use super::plan::{
    BarkArt, BarkPattern, DressParams, LeafArt, LeafShape, LeafTurn, Phyllotaxis, TargetLeaf, USUAL_LEAF_SHARE, Wear,
};
use super::reader::{Item, Pick, Reader, clip, linear};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use crate::base::Note;

/// What a leaf's name stands for.
struct LeafKind {
    shape: LeafShape,
    /// Length, metres; of the whole picture for `ash`, `palm` and conifers.
    size: f32,
    /// Angle to the twig, degrees.
    angle: f32,
    droop: f32,
    /// Length of a twig, metres.
    twig: f32,
    /// What a density of 1 is, by area: fronds have leaflets from their bases to their tips.
    full: f32,
    color: &'static str,
    /// Colours before it falls, of the leaves that turn first and last; empty for what stays green.
    autumn: [&'static str; 2],
    bark: BarkPattern,
}

impl LeafKind {
    const fn is_evergreen(&self) -> bool {
        self.autumn[0].is_empty()
    }
}

pub(super) const LEAF_NAMES: &[&str] = &[
    "oak", "birch", "beech", "maple", "willow", "ash", "pine", "linden", "poplar", "elm", "olive", "palm", "spruce",
    "cypress",
];

/// In the order of [`LEAF_NAMES`].
#[rustfmt::skip]
static LEAVES: [LeafKind; 14] = [
    LeafKind { shape: LeafShape::Oak,    size: 0.086, angle: 55.0, droop: 0.15, twig: 0.35, full: 1.0, color: "#4f6b2a", autumn: ["#8a5a22", "#7d7a2a"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Birch,  size: 0.051, angle: 50.0, droop: 0.50, twig: 0.40, full: 1.0, color: "#6a8a35", autumn: ["#c9a02c", "#9a9a35"], bark: BarkPattern::Papery },
    LeafKind { shape: LeafShape::Beech,  size: 0.062, angle: 50.0, droop: 0.20, twig: 0.35, full: 1.0, color: "#55752f", autumn: ["#a8622a", "#b08a30"], bark: BarkPattern::Smooth },
    LeafKind { shape: LeafShape::Maple,  size: 0.081, angle: 60.0, droop: 0.30, twig: 0.35, full: 1.0, color: "#5a7a30", autumn: ["#b8451f", "#c08a2a"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Willow, size: 0.095, angle: 35.0, droop: 0.80, twig: 0.55, full: 1.5, color: "#7d9650", autumn: ["#b3a03a", "#8f9a45"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Ash,    size: 0.36,  angle: 55.0, droop: 0.25, twig: 0.30, full: 1.15, color: "#567a34", autumn: ["#b09a35", "#7f8f38"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Pine,   size: 0.42,  angle: 40.0, droop: 0.10, twig: 0.30, full: 1.0, color: "#3d5a2e", autumn: ["", ""], bark: BarkPattern::Plated },
    LeafKind { shape: LeafShape::Linden, size: 0.058, angle: 55.0, droop: 0.40, twig: 0.40, full: 1.0, color: "#5f7f35", autumn: ["#c2a030", "#8f9538"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Poplar, size: 0.052, angle: 55.0, droop: 0.35, twig: 0.40, full: 1.0, color: "#648238", autumn: ["#cda52e", "#9a9c38"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Elm,    size: 0.059, angle: 50.0, droop: 0.25, twig: 0.40, full: 1.0, color: "#50702d", autumn: ["#b08c2c", "#7c8432"], bark: BarkPattern::Furrowed },
    LeafKind { shape: LeafShape::Olive,  size: 0.047, angle: 45.0, droop: 0.15, twig: 0.30, full: 1.3, color: "#75845c", autumn: ["", ""], bark: BarkPattern::Plated },
    LeafKind { shape: LeafShape::Palm,   size: 0.75,  angle: 55.0, droop: 0.30, twig: 0.00, full: 3.0, color: "#5f8038", autumn: ["", ""], bark: BarkPattern::Ringed },
    LeafKind { shape: LeafShape::Spruce, size: 0.50,  angle: 40.0, droop: 0.35, twig: 0.30, full: 1.2, color: "#3f5c36", autumn: ["", ""], bark: BarkPattern::Plated },
    LeafKind { shape: LeafShape::Cypress, size: 0.30, angle: 30.0, droop: 0.00, twig: 0.25, full: 1.2, color: "#45602f", autumn: ["", ""], bark: BarkPattern::Fibrous },
];

const BARK_NAMES: &[&str] = &["furrowed", "papery", "plated", "smooth", "fibrous", "ringed"];

/// In the order of [`BARK_NAMES`]: the pattern and its colour.
static BARKS: [(BarkPattern, &str); 6] = [
    (BarkPattern::Furrowed, "#6b5a48"),
    (BarkPattern::Papery, "#d9d4c7"),
    (BarkPattern::Plated, "#7d5a42"),
    (BarkPattern::Smooth, "#8a8378"),
    (BarkPattern::Fibrous, "#7a5340"),
    (BarkPattern::Ringed, "#8b7a68"),
];

/// How many times as long as usual leaves are told of.
const HUGE: f32 = 4.0;

const BY_LEAF: Default = Default::Else("as the leaf");
const PIXELS: Kind = Kind::Integer { low: 64, high: 4096, unit: "pixels" };

/// `foliage`.
pub(super) static FOLIAGE: Record = Record {
    title: "Foliage",
    about: "Twigs and leaves of the whole set. The leaf's name decides what is not given. Leaves that imports bring keep their \
            places and directions, and their size and look unless `leaf` names others: `spread`, `angle`, `droop`, `twig` and \
            `phyllotaxis` are for sources that bring none. Where no field is given, a mesh without leaves stays bare; scans, \
            skeletons and grown trees are dressed all the same.",
    fields: &[
        Field {
            name: "leaf",
            kind: Kind::WordOrChoice(LEAF_NAMES, &LEAF_FILES),
            default: Default::Else("those that sources bring; \"oak\" for the rest"),
            about: "a leaf made by Treewright, pictures of your own, or a source's leaves, for all leaves of the set",
        },
        Field {
            name: "season",
            kind: Kind::Choice(&SEASONS),
            default: Default::Is("Summer"),
            about: "colour of leaves where `color` is not given, and how many there are. Of pictures, which sources bring or are \
                    your own, what is green turns",
        },
        Field {
            name: "density",
            kind: Kind::Number { low: 0.0, high: 4.0, unit: "" },
            default: Default::Is("1.0"),
            about: "leaves in the crown; 1 is full summer foliage, 0 none",
        },
        Field {
            name: "most",
            kind: Kind::Integer { low: 0, high: 200_000, unit: "leaves" },
            default: Default::Is("20000"),
            about: "most leaves on one tree; where more are wanted they get larger instead, at most twice as long",
        },
        Field {
            name: "size",
            kind: Kind::Number { low: 0.002, high: 3.0, unit: "m" },
            default: BY_LEAF,
            about: "length of a leaf; the picture of a made one shows a twig of many and is 4 to 7 leaves high (ash, palm \
                    and conifers: of the whole picture). Left out, no picture is higher than a fifteenth of its tree; told, none is a \
                    larger share of it than on the largest source. Leaves of imports that wear what `leaf` says are made as \
                    long, as many as show what they showed; left out, none is made shorter",
        },
        Field {
            name: "spread",
            kind: Kind::Number { low: 0.0, high: 0.9, unit: "" },
            default: Default::Is("0.25"),
            about: "how much leaf sizes vary, as a share of the size",
        },
        Field {
            name: "angle",
            kind: Kind::Number { low: 0.0, high: 180.0, unit: "degrees" },
            default: BY_LEAF,
            about: "between a leaf and its twig",
        },
        Field {
            name: "droop",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: BY_LEAF,
            about: "how far twigs and leaves hang",
        },
        Field {
            name: "twig",
            kind: Kind::Number { low: 0.0, high: 3.0, unit: "m" },
            default: BY_LEAF,
            about: "length of a twig; 0 for none: leaves stand on the plant's own thin branches",
        },
        Field {
            name: "phyllotaxis",
            kind: Kind::Choice(&PHYLLOTAXIS),
            default: Default::Else("Distichous for palm, Spiral for all others"),
            about: "how leaves follow each other along a twig",
        },
        Field {
            name: "color",
            kind: Kind::Color,
            default: BY_LEAF,
            about: "of a made leaf; what is green of pictures, which sources bring or are your own, becomes that in the mean",
        },
        Field {
            name: "variation",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.3"),
            about: "how much the colour of made leaves varies",
        },
        Field {
            name: "pictures",
            kind: Kind::Integer { low: 1, high: 16, unit: "pictures" },
            default: Default::Is("4"),
            about: "how many different made leaves there are",
        },
        Field {
            name: "resolution",
            kind: PIXELS,
            default: Default::Is("256"),
            about: "edge of a made leaf's picture, its gutter included; no larger than the atlas",
        },
    ],
};

static SEASONS: Choice = Choice {
    title: "Seasons",
    kinds: &[
        KindOf {
            name: "Spring",
            form: Form::Plain,
            about: "lighter and yellower, four fifths of the leaves; evergreens keep all",
        },
        KindOf { name: "Summer", form: Form::Plain, about: "as the leaf" },
        KindOf {
            name: "Autumn",
            form: Form::Plain,
            about: "the leaf's autumn colours, another in each picture, three fifths of the leaves; evergreens keep all. \
                    Pictures that are not made turn as beeches do, each in copies of several colours where there are fewer than four",
        },
        KindOf {
            name: "Winter",
            form: Form::Plain,
            about: "no leaves but those of made evergreens; pictures of your own and sources' leaves fall",
        },
    ],
};

static PHYLLOTAXIS: Choice = Choice {
    title: "Phyllotaxis",
    kinds: &[
        KindOf { name: "Spiral", form: Form::Plain, about: "all around, by the golden angle" },
        KindOf {
            name: "Distichous",
            form: Form::Plain,
            about: "in two rows at its sides, as on fronds, elms and beeches",
        },
    ],
};

fn phyllotaxis(fields: &Reader<'_, '_>, leaf: &LeafKind) -> Phyllotaxis {
    let kind = |item: &Item<'_>| fields.kind(&PHYLLOTAXIS, item, |kind, _| Some(kind));
    match fields.item("phyllotaxis").as_ref().and_then(kind) {
        Some("Distichous") => Phyllotaxis::Distichous,
        Some(_) => Phyllotaxis::Spiral,
        None => usual_phyllotaxis(leaf),
    }
}

fn usual_phyllotaxis(leaf: &LeafKind) -> Phyllotaxis {
    if leaf.shape == LeafShape::Palm { Phyllotaxis::Distichous } else { Phyllotaxis::Spiral }
}

/// Young leaves are lighter and yellower, by so much of red, green and blue, linear.
const YOUNG: [f32; 3] = [1.5, 1.35, 1.1];

/// Of [`LEAVES`] the one in whose colours pictures turn: from copper to gold, between those of most trees.
const BEECH: usize = 2;

/// A time of the year.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Season {
    Spring,
    Summer,
    Autumn,
    Winter,
}

impl Season {
    fn of(fields: &Reader<'_, '_>) -> Self {
        let kind = |item: &Item<'_>| fields.kind(&SEASONS, item, |kind, _| Some(kind));
        match fields.item("season").as_ref().and_then(kind) {
            Some("Spring") => Self::Spring,
            Some("Autumn") => Self::Autumn,
            Some("Winter") => Self::Winter,
            _ => Self::Summer,
        }
    }

    /// Share of the leaves that hang; `evergreen` leaves do not fall.
    const fn share(self, evergreen: bool) -> f32 {
        match self {
            _ if evergreen => 1.0,
            Self::Spring => 0.8,
            Self::Summer => 1.0,
            Self::Autumn => 0.6,
            Self::Winter => 0.0,
        }
    }

    /// What becomes of the green of pictures that are not made, which don't tell what they are of.
    fn turn(self) -> Option<LeafTurn> {
        match self {
            Self::Spring => Some(LeafTurn::Lighter { gain: YOUNG }),
            Self::Autumn => {
                let [first, last] = LEAVES[BEECH].autumn;
                Some(LeafTurn::Colors { first: linear(first)?, last: linear(last)? })
            }
            Self::Summer | Self::Winter => None,
        }
    }

    /// The colours of leaves that turn first and last, linear.
    fn colors(self, leaf: &LeafKind) -> Option<[[f32; 3]; 2]> {
        let summer = linear(leaf.color)?;
        let [first, last] = leaf.autumn;
        Some(match self {
            Self::Autumn if !leaf.is_evergreen() => [linear(first)?, linear(last)?],
            Self::Spring => [std::array::from_fn(|i| (summer[i] * YOUNG[i]).min(1.0)); 2],
            _ => [summer; 2],
        })
    }
}

static LEAF_FILES: Choice = Choice {
    title: "Leaf pictures",
    kinds: &[
        KindOf { name: "Files", form: Form::Fields(&LEAF_FILE_FIELDS), about: "pictures of your own" },
        KindOf { name: "From", form: Form::One(&FROM), about: "what an imported source brings" },
    ],
};

static FROM: Record = Record {
    title: "From",
    about: "`From(\"oak\")` or `From(source: \"oak\")`.",
    fields: &[Field {
        name: "source",
        kind: Kind::Text("a source's name"),
        default: Default::Required,
        about: "one that is imported from a mesh",
    }],
};

static LEAF_FILE_FIELDS: Record = Record {
    title: "Files of a leaf",
    about: "The leaf's base is at the middle of the picture's lower edge, its tip up. A picture that is no square keeps its \
            proportions; its longer edge is the leaf's size.",
    fields: &[
        Field {
            name: "color",
            kind: Kind::Text("a path"),
            default: Default::Required,
            about: "colour, with alpha where there is no leaf",
        },
        NORMAL,
        Field {
            name: "transmission",
            kind: Kind::Text("a path"),
            default: Default::Else("0.4 all over"),
            about: "light that the leaf lets through, grey: white all, black none",
        },
    ],
};

const NORMAL: Field = Field {
    name: "normal",
    kind: Kind::Text("a path"),
    default: Default::Else("made from the colour's light and dark"),
    about: "tangent-space normal map, green up",
};

/// `bark`.
pub(super) static BARK: Record = Record {
    title: "Bark",
    about: "The bark of the whole set.",
    fields: &[
        Field {
            name: "texture",
            kind: Kind::WordOrChoice(BARK_NAMES, &BARK_FILES),
            default: Default::Else("the sources' if all bring some, else as the leaf"),
            about: "a bark made by Treewright, maps of your own, or a source's bark. A set has one: of sources that all bring some, \
                    left out, it is that of the first by name whose bark is a picture, or else of the first",
        },
        Field {
            name: "tiling",
            kind: Kind::Number { low: 0.05, high: 50.0, unit: "m" },
            default: Default::Is("1.5"),
            about: "height of one tile on the trunk, about: tiles are squares, and of those that go round the trunk a whole number \
                    of times, once at least, the nearest is taken",
        },
        Field {
            name: "color",
            kind: Kind::Color,
            default: Default::Else("as the texture"),
            about: "of made bark's ridges",
        },
        Field { name: "resolution", kind: PIXELS, default: Default::Is("1024"), about: "edge of made bark's maps" },
    ],
};

static BARK_FILES: Choice = Choice {
    title: "Bark maps",
    kinds: &[
        KindOf { name: "Files", form: Form::Fields(&BARK_FILE_FIELDS), about: "maps of your own" },
        KindOf { name: "From", form: Form::One(&FROM), about: "what an imported source brings" },
    ],
};

static BARK_FILE_FIELDS: Record = Record {
    title: "Files of a bark",
    about: "Maps that tile both ways. A tile is a square: of slim maps take as many side by side as make one.",
    fields: &[
        Field { name: "color", kind: Kind::Text("a path"), default: Default::Required, about: "colour" },
        NORMAL,
        Field {
            name: "roughness",
            kind: Kind::Text("a path"),
            default: Default::Else("rough all over"),
            about: "roughness, grey",
        },
    ],
};

/// The defaults of each leaf and bark, as Markdown.
pub(super) fn describe_leaves() -> String {
    let mut out = String::from(
        "# Leaves and barks\n\n| leaf | size, m | angle, degrees | droop | twig, m | color | bark |\n|---|---|---|---|---|---|---|\n",
    );
    let named = |pattern| BARKS.iter().zip(BARK_NAMES).find(|(bark, _)| bark.0 == pattern).map_or("", |(_, name)| name);
    for (leaf, name) in LEAVES.iter().zip(LEAF_NAMES) {
        let LeafKind { shape: _, size, angle, droop, twig, full: _, color, autumn: _, bark } = leaf;
        out.push_str(&format!("| {name} | {size} | {angle} | {droop} | {twig} | `{color}` | {} |\n", named(*bark)));
    }
    out.push_str("\n| bark | color |\n|---|---|\n");
    for ((_, color), name) in BARKS.iter().zip(BARK_NAMES) {
        out.push_str(&format!("| {name} | `{color}` |\n"));
    }
    out
}

/// A made leaf by its place in [`LEAF_NAMES`], as its defaults have it.
pub(super) fn named_leaf(index: usize) -> Option<TargetLeaf> {
    let leaf = LEAVES.get(index)?;
    Some(TargetLeaf::Made {
        art: LeafArt::Made {
            shape: leaf.shape,
            color: linear(leaf.color)?,
            late: linear(leaf.color)?,
            variation: 0.3,
            size: 256,
        },
        size: leaf.size,
        angle: leaf.angle.to_radians(),
        droop: leaf.droop,
        twig: leaf.twig,
        full: leaf.full,
        phyllotaxis: usual_phyllotaxis(leaf),
    })
}

/// What `foliage` says.
pub(super) struct Foliage {
    /// Twigs and leaves.
    pub(super) dress: DressParams,
    /// Share of the leaves that sources bring.
    pub(super) own_density: f32,
    /// The leaf's pictures.
    pub(super) art: LeafArt,
    /// Which leaves wear them.
    pub(super) wear: Wear,
    /// What becomes of the green of pictures that are not made.
    pub(super) turn: Option<LeafTurn>,
    /// The bark that goes with the leaf.
    pub(super) bark: BarkPattern,
    /// What is told of it.
    pub(super) notes: Vec<Note>,
    /// The names of the fields that are told.
    pub(super) told: Vec<String>,
}

/// The sources, as far as looks know them.
pub(super) struct Named {
    /// Their indices by name.
    pub(super) names: BTreeMap<String, usize>,
    /// Those that are grown, and so bring neither leaves nor bark.
    pub(super) grown: BTreeSet<usize>,
}

/// What is told where leaves that may be evergreen turn.
pub(crate) const TURNED: &str = "in autumn leaves that sources bring, and pictures of your own, become fewer and turn as beeches do, \
                                 evergreen or not, since pictures don't tell: `color` names another colour for them";

/// What is told where leaves that may be evergreen fall.
pub(crate) const BARE_IN_WINTER: &str = "in winter trees are bare, also of pictures of your own and of a source's leaves, \
                                         which don't tell whether they are evergreen: leave `season` out to keep them";

/// Twigs and leaves, the leaf's pictures, and the bark that goes with the leaf.
pub(super) fn foliage(fields: &Reader<'_, '_>, sources: &Named) -> Option<Foliage> {
    let season = Season::of(fields);
    let color = fields.color("color");
    let made = |leaf: &LeafKind| {
        let [color, late] = color.map(|color| [color; 2]).or(season.colors(leaf))?;
        Some(LeafArt::Made {
            shape: leaf.shape,
            color,
            late,
            variation: fields.number("variation"),
            size: fields.count("resolution"),
        })
    };
    let told = |item: &Item<'_>| {
        if let Pick::Word(leaf) = fields.pick("leaf", item)? {
            return Some((made(&LEAVES[leaf])?, Wear::All, &LEAVES[leaf]));
        }
        let (art, wear) = fields.kind(&LEAF_FILES, item, |kind, inner| {
            made_only(fields, &["variation", "pictures", "resolution"], "leaf", kind);
            if kind == "From" {
                return Some((None, Wear::Source(from(inner, sources, "leaves")?)));
            }
            let [color, normal, transmission] = ["color", "normal", "transmission"].map(|name| path(inner, name));
            Some((Some(LeafArt::Files { color, normal, transmission }), Wear::All))
        })?;
        Some((art.map_or_else(|| made(&LEAVES[0]), Some)?, wear, &LEAVES[0]))
    };
    // What is wrong with the leaf is told by now: the other fields are read as for any.
    let (art, wear, leaf) = match fields.item("leaf").as_ref().and_then(told) {
        Some(told) => told,
        None => (made(&LEAVES[0])?, Wear::Rest, &LEAVES[0]),
    };
    let is_made = matches!(art, LeafArt::Made { .. });
    // What made pictures show little of, sources' leaves need not make up for.
    let asked = fields.number("density");
    let own_density = asked * season.share(is_made && leaf.is_evergreen());
    let dress = DressParams {
        density: own_density * leaf.full,
        most_leaves: fields.count("most"),
        leaf_size: fields.number_or("size", if matches!(wear, Wear::Source(_)) { 0.0 } else { leaf.size }),
        leaf_share: if fields.has("size") { 0.0 } else { USUAL_LEAF_SHARE },
        leaf_spread: fields.number("spread"),
        leaf_angle: fields.number_or("angle", leaf.angle).to_radians(),
        twig_length: fields.number_or("twig", leaf.twig),
        phyllotaxis: phyllotaxis(fields, leaf),
        droop: fields.number_or("droop", leaf.droop),
        pictures: if is_made { u16::try_from(fields.integer("pictures")).unwrap_or(1) } else { 1 },
    };
    // Who asks for winter and no leaves at all knows. Whether sources bring leaves is known once they are read.
    let unknown = !is_made || wear != Wear::All;
    let falls = season == Season::Winter && unknown && own_density < asked;
    let winter = falls.then(|| Note::new("foliage.season", BARE_IN_WINTER));
    let turn = color.map(|color| LeafTurn::Colors { first: color, last: color }).or(season.turn()).filter(|_| unknown);
    let unsaid = season == Season::Autumn && color.is_none() && unknown && asked > 0.0;
    let turned = unsaid.then(|| Note::new("foliage.season", TURNED));
    let huge = huge(&dress, leaf).filter(|_| is_made && !matches!(wear, Wear::Source(_)));
    let notes = winter.into_iter().chain(turned).chain(huge).collect();
    let told =
        FOLIAGE.fields.iter().map(|field| field.name).filter(|name| fields.has(name)).map(str::to_owned).collect();
    Some(Foliage { dress, own_density, art, wear, turn, bark: leaf.bark, notes, told })
}

/// What is told of a leaf that is far longer than such leaves are.
fn huge(dress: &DressParams, leaf: &LeafKind) -> Option<Note> {
    let times = dress.leaf_size / leaf.size;
    let message = || {
        format!(
            "{} m is {times:.0} times as long as such leaves are ({} m), and pictures of them are up to seven leaves high: tell \
             the length of one leaf",
            dress.leaf_size, leaf.size
        )
    };
    (times > HUGE).then(|| Note::new("foliage.size", message()))
}

/// The source that a `From` names, for `what` it is to bring.
fn from(fields: &Reader<'_, '_>, sources: &Named, what: &str) -> Option<usize> {
    let names: Vec<&str> = sources.names.keys().map(String::as_str).collect();
    let item = fields.item("source")?;
    let index = fields.reference(&item, "source", &names)?;
    if sources.grown.contains(&index) {
        let message = format!("\"{}\" is grown, and brings no {what} of its own", clip(names[index]));
        let hint = format!("name a source that is imported from a mesh with {what}");
        fields.report().at(item.span(), &item.path, message, hint);
    }
    Some(index)
}

/// The bark's maps, what wears them, and the height of a tile.
pub(super) fn bark(fields: &Reader<'_, '_>, of_leaf: BarkPattern, sources: &Named) -> Option<(BarkArt, Wear, f32)> {
    let tiling = fields.number("tiling");
    let made = |pattern: usize| {
        let (pattern, color) = BARKS[pattern];
        let color = fields.color("color").or(linear(color))?;
        Some(BarkArt::Made { pattern, color, size: fields.count("resolution") })
    };
    let by_leaf = || made(BARKS.iter().position(|&(pattern, _)| pattern == of_leaf)?);
    let (art, wear) = match fields.item("texture") {
        None => (by_leaf()?, if fields.has("color") { Wear::All } else { Wear::Rest }),
        Some(item) => match fields.pick("texture", &item)? {
            Pick::Word(pattern) => (made(pattern)?, Wear::All),
            Pick::Kind => fields.kind(&BARK_FILES, &item, |kind, inner| {
                made_only(fields, &["color", "resolution"], "texture", kind);
                if kind == "From" {
                    return Some((by_leaf()?, Wear::Source(from(inner, sources, "bark")?)));
                }
                let (color, normal) = (path(inner, "color"), path(inner, "normal"));
                Some((BarkArt::Files { color, normal, roughness: path(inner, "roughness") }, Wear::All))
            })?,
        },
    };
    Some((art, wear, tiling))
}

/// Reports fields that mean nothing beside the user's own pictures.
fn made_only(fields: &Reader<'_, '_>, names: &[&str], art: &str, kind: &str) {
    for name in names.iter().filter(|name| fields.has(name)) {
        fields.fault(name, format!("has no meaning when `{art}` is {kind}"), "leave it out");
    }
}

/// A path relative to the preset's folder; empty where it is absent or wrong.
pub(super) fn path(fields: &Reader<'_, '_>, name: &str) -> String {
    let Some((text, item)) = fields.text(name) else { return String::new() };
    relative(&text).unwrap_or_else(|(message, hint)| {
        fields.report().at(item.span(), &item.path, message, hint);
        String::new()
    })
}
