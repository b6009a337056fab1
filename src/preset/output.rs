//! What a set is written as: `mesh`, `lods`, `atlas` and `engines` of a preset.

use super::plan::{
    ANY, AtlasParams, Backs, BarkPattern, ColliderParams, Engine, Forks, LeafCards, Lod, LodBudget, Profile, Source,
    SourceRecipe, TextureFormat, USUAL_FLARE, WindData,
};
use super::reader::{Item, Reader};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};

/// `mesh`.
pub(super) static MESH: Record = Record {
    title: "Mesh",
    about: "Branches and leaves at the full level of detail.",
    fields: &[
        Field {
            name: "sides",
            kind: Kind::Integer { low: 3, high: 64, unit: "sides" },
            default: Default::Is("12"),
            about: "of the thickest tube; where none are told, more on trunks so thick that they would stray by more than \
                    `error`, 64 at most",
        },
        Field {
            name: "error",
            kind: Kind::Number { low: 0.0005, high: 0.5, unit: "m" },
            default: Default::Is("0.01"),
            about: "largest distance between a tube and the smooth branch, on trees below 4 m a 400th of their extent where \
                    none is told; twigs in leaf may stray 2.5 times as far",
        },
        Field {
            name: "forks",
            kind: Kind::Choice(&FORKS),
            default: Default::Is("Collar"),
            about: "how a branch leaves its parent",
        },
        Field {
            name: "roots",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Else("0.7, of palms 0"),
            about: "how much of what a stem's foot flares is drawn out into roots; 0 for a round foot",
        },
        Field {
            name: "flare",
            kind: Kind::Number { low: 0.0, high: 2.0, unit: "radii" },
            default: Default::Else("0.38, or 0 where a source is a mesh or a species without a flare"),
            about: "how much wider a stem's foot gets that is not so much wider by itself",
        },
        Field {
            name: "below",
            kind: Kind::Number { low: 0.0, high: 10.0, unit: "m" },
            default: Default::Is("0.0"),
            about: "how far stems go on below the ground, so that none ends in the air on a slope; bounds and pictures hold \
                    that part, colliders and clips don't",
        },
        Field {
            name: "leaves",
            kind: Kind::Choice(&LEAVES),
            default: Default::Is("Folded"),
            about: "what leaves are drawn on; cards that a mesh brought along stay flat, but are cut out too. Leaves of \
                    animations are flat",
        },
        Field {
            name: "backs",
            kind: Kind::Choice(&BACKS),
            default: Default::Is("Doubled"),
            about: "how the backs of leaves and of clouds' cards are drawn",
        },
        Field {
            name: "wind",
            kind: Kind::Choice(&WIND),
            default: Default::Is("Nothing"),
            about: "what vertices tell a shader about wind",
        },
        Field {
            name: "lightmap",
            kind: Kind::Integer { low: 0, high: 8192, unit: "texels" },
            default: Default::Is("0"),
            about: "edge of a light map that a second UV set is unwrapped for, pieces two texels apart there; 0 for none. Trees are \
                    of thousands of pieces: 1024 and more hold one. Backs of leaves share the light of their fronts: bakers that refuse overlaps \
                    want `backs: DoubleSided`",
        },
        Field {
            name: "most",
            kind: TRIANGLES,
            default: Default::Else("as many as it takes"),
            about: "most triangles of a tree at the full level: branches get coarser, twigs fewer, with all their leaves, and \
                    leaves fewer and larger, at most twice as long. Clips have budgets of their own",
        },
    ],
};

static FORKS: Choice = Choice {
    title: "Forks",
    kinds: &[
        KindOf { name: "Collar", form: Form::Plain, about: "through a collar that widens towards the parent" },
        KindOf { name: "Plain", form: Form::Plain, about: "straight out of it: fewer triangles" },
    ],
};

static LEAVES: Choice = Choice {
    title: "Leaf cards",
    kinds: &[
        KindOf { name: "Flat", form: Form::Plain, about: "flat squares: two triangles" },
        KindOf { name: "Folded", form: Form::Plain, about: "folded along the middle: four triangles" },
        KindOf {
            name: "Bent",
            form: Form::Plain,
            about: "arched to the tip, as gravity has it, and folded: eight triangles, for close-ups",
        },
        KindOf {
            name: "CutOut",
            form: Form::Fields(&CUT_OUT),
            about: "folded and cut to the picture's outline: more triangles, fewer clear pixels to draw",
        },
    ],
};

static CUT_OUT: Record = Record {
    title: "CutOut",
    about: "The outline holds everything that the picture shows.",
    fields: &[Field {
        name: "corners",
        kind: Kind::Integer { low: 8, high: 32, unit: "corners" },
        default: Default::Is("16"),
        about: "at most, both halves together",
    }],
};

static BACKS: Choice = Choice {
    title: "Backs",
    kinds: &[
        KindOf {
            name: "Doubled",
            form: Form::Plain,
            about: "by triangles of their own that have the front's normals: lit alike from both sides in every engine, no pixel drawn \
                    twice. Budgets count them",
        },
        KindOf {
            name: "DoubleSided",
            form: Form::Plain,
            about: "by a double-sided material: half as many triangles of leaves, for engines that are told to leave normals as they \
                    are; others turn them there, and leaves that are seen from behind are dark where the crown is lit",
        },
    ],
};

static WIND: Choice = Choice {
    title: "Wind",
    kinds: &[
        KindOf { name: "Nothing", form: Form::Plain, about: "the fewest bytes" },
        KindOf {
            name: "Attributes",
            form: Form::Plain,
            about: "bend, phase, swing of the limbs and what they swing about, flutter of the leaves, as texture \
                    coordinates; the manifest tells which",
        },
    ],
};

/// What vertices tell about wind, of `mesh`.
pub(super) fn wind(fields: &Reader<'_, '_>) -> WindData {
    let kind = |item: &Item<'_>| fields.kind(&WIND, item, |kind, _| Some(kind));
    let asked = fields.item("wind").as_ref().and_then(kind) == Some("Attributes");
    if asked { WindData::Attributes } else { WindData::Nothing }
}

/// What leaves are drawn on, of `mesh`.
pub(super) fn leaves(fields: &Reader<'_, '_>) -> LeafCards {
    let cards = fields.choice("leaves", |kind, inner| {
        Some(match kind {
            "Flat" => LeafCards::Flat,
            "Bent" => LeafCards::Bent,
            "CutOut" => LeafCards::CutOut { corners: inner.count("corners") },
            _ => LeafCards::Folded,
        })
    });
    cards.unwrap_or_default()
}

/// How the backs of leaves are drawn, of `mesh`.
pub(super) fn backs(fields: &Reader<'_, '_>) -> Backs {
    let kind = |item: &Item<'_>| fields.kind(&BACKS, item, |kind, _| Some(kind));
    let asked = fields.item("backs").as_ref().and_then(kind) == Some("DoubleSided");
    if asked { Backs::DoubleSided } else { Backs::Doubled }
}

/// How branches leave their parents, of `mesh`.
pub(super) fn forks(fields: &Reader<'_, '_>) -> Forks {
    let kind = |item: &Item<'_>| fields.kind(&FORKS, item, |kind, _| Some(kind));
    if fields.item("forks").as_ref().and_then(kind) == Some("Plain") { Forks::Plain } else { Forks::Collar }
}

/// `colliders`.
pub(super) static COLLIDERS: Record = Record {
    title: "Colliders",
    about: "Simple shapes for physics and triggers: in the manifest, and under the names that each engine knows.",
    fields: &[
        Field {
            name: "thick",
            kind: Kind::Number { low: 0.001, high: 10.0, unit: "m" },
            default: Default::Is("0.05"),
            about: "radius of the thinnest wood that gets capsules",
        },
        Field {
            name: "capsules",
            kind: Kind::Integer { low: 0, high: 256, unit: "capsules" },
            default: Default::Is("32"),
            about: "at most, along the trunk and thick limbs; the thickest are kept",
        },
        Field {
            name: "crown",
            kind: Kind::Integer { low: 0, high: 16, unit: "hulls" },
            default: Default::Is("0"),
            about: "convex hulls that together hold the whole crown; 0 for none. Unreal takes them for solid",
        },
        Field {
            name: "corners",
            kind: Kind::Integer { low: 8, high: 255, unit: "corners" },
            default: Default::Is("32"),
            about: "of each hull, at most; no engine's physics take more than 255, and Unity's no more than 129",
        },
    ],
};

/// Corners of a closed hull of 254 triangles: Unity's physics take 255.
const UNITYS_CORNERS: usize = 129;

/// What physics take a tree for.
pub(super) fn colliders(fields: &Reader<'_, '_>, engines: &[Profile]) -> ColliderParams {
    let corners = fields.count("corners") as usize;
    let crown = fields.count("crown") as usize;
    fields.needs("crown", &["corners"], "give a `crown` of one hull or more, or leave it out");
    if crown > 0 && corners > UNITYS_CORNERS && engines.iter().any(|profile| profile.engine == Engine::Unity) {
        let hint = format!("ask for {UNITYS_CORNERS} at most: a hull of n corners has 2 n - 4 triangles");
        fields.fault("corners", "Unity takes convex hulls of 255 triangles at most", hint);
    }
    ColliderParams { least_radius: fields.number("thick"), most: fields.count("capsules") as usize, crown, corners }
}

/// `atlas`.
pub(super) static ATLAS: Record = Record {
    title: "Atlas",
    about: "The set's one picture of leaves and cards.",
    fields: &[
        Field {
            name: "size",
            kind: Kind::Integer { low: 256, high: 8192, unit: "pixels, a power of two" },
            default: Default::Is("2048"),
            about: "along an edge",
        },
        Field {
            name: "gutter",
            kind: Kind::Integer { low: 1, high: 64, unit: "pixels" },
            default: Default::Is("8"),
            about: "between two pictures; more keeps them apart in smaller mips",
        },
    ],
};

/// The levels of detail.
pub(super) static LODS: Choice = Choice {
    title: "Levels of detail",
    kinds: &[
        KindOf { name: "Full", form: Form::Plain, about: "everything; the first level, and only that" },
        KindOf { name: "Thinned", form: Form::Fields(&THINNED), about: "coarser branches, fewer and larger leaves" },
        KindOf {
            name: "BillboardCloud",
            form: Form::Fields(&CLOUD),
            about: "leaves and thin branches as textured cards",
        },
        KindOf { name: "CrossedQuads", form: Form::Fields(&CROSSED), about: "two crossed quads; the last level" },
        KindOf {
            name: "Impostor",
            form: Form::Fields(&IMPOSTOR),
            about: "a hemi-octahedral sheet of views, on crossed quads where there is no shader for it; the last level",
        },
    ],
};

/// Budgets in triangles. A tree can't be told from a bush with fewer.
pub(super) const TRIANGLES: Kind = Kind::Integer { low: 200, high: 10_000_000, unit: "triangles" };

const SCREEN: Field = Field {
    name: "screen",
    kind: Kind::Number { low: 0.002, high: 1.0, unit: "of the screen's height" },
    default: Default::Else("measured: where its silhouette agrees with the full level's"),
    about: "the level is shown where the tree is not higher; less from level to level",
};

static THINNED: Record = Record {
    title: "Thinned",
    about: "Meshed again, and leaves thinned in a fixed order.",
    fields: &[
        Field {
            name: "triangles",
            kind: Kind::Number { low: 0.01, high: 0.95, unit: "" },
            default: Default::Else("`most` in its place"),
            about: "share of the full level's triangles",
        },
        Field {
            name: "most",
            kind: TRIANGLES,
            default: Default::Else("`triangles` in its place"),
            about: "most triangles of a tree; beside `triangles` the fewer of the two hold",
        },
        SCREEN,
    ],
};

static CLOUD: Record = Record {
    title: "BillboardCloud",
    about: "Cards fitted to groups of leaves.",
    fields: &[
        Field {
            name: "cards",
            kind: Kind::Integer { low: 4, high: 512, unit: "cards" },
            default: Default::Is("48"),
            about: "at most",
        },
        SCREEN,
    ],
};

static CROSSED: Record = Record { title: "CrossedQuads", about: "Two pictures of the tree.", fields: &[SCREEN] };

static IMPOSTOR: Record = Record {
    title: "Impostor",
    about: "The tree from all sides in one square of the atlas: colour with alpha, normals, and depth in the blue channel \
            of the occlusion map. `extras` of the level's mesh tell the layout.",
    fields: &[
        Field {
            name: "frames",
            kind: Kind::Integer { low: 4, high: 24, unit: "views" },
            default: Default::Is("10"),
            about: "along an edge of the sheet, which is 7.5 times as wide as a card: fewer are larger, but fewer than 8 show ghosts \
                    between frames on wide crowns",
        },
        SCREEN,
    ],
};

/// The engine profiles.
pub(super) static ENGINES: Choice = Choice {
    title: "Engines",
    kinds: &[
        KindOf {
            name: "Generic",
            form: Form::Fields(&PROFILE),
            about: "`NAME.glb`: glTF 2.0 with MSFT_lod, for any engine that reads it",
        },
        KindOf {
            name: "Godot",
            form: Form::Fields(&PROFILE),
            about: "`NAME.godot.glb`: levels side by side as `NAME_LOD0`…, colliders by `-convcolonly`",
        },
        KindOf {
            name: "Unity",
            form: Form::Fields(&PROFILE),
            about: "`NAME.unity.glb`: levels side by side as `NAME_LOD0`…, colliders in a file beside it",
        },
        KindOf {
            name: "Unreal",
            form: Form::Fields(&PROFILE),
            about: "`NAME_LOD0.unreal.glb`…: a file for each level, colliders as `UCX_NAME_LOD0_00`…",
        },
        KindOf {
            name: "Bevy",
            form: Form::Fields(&PROFILE),
            about: "`NAME.bevy.glb`: levels side by side with `visibility_range` in their extras, colliders in a file beside it",
        },
        KindOf {
            name: "Web",
            form: Form::Fields(&PROFILE),
            about: "`NAME.web.glb`: as Generic, quantized and packed by meshoptimizer",
        },
    ],
};

static PROFILE: Record = Record {
    title: "Engine",
    about: "`Web` alone, or as `Web(textures: Ktx2)`.",
    fields: &[Field {
        name: "textures",
        kind: Kind::Choice(&TEXTURES),
        default: Default::Is("Png"),
        about: "what the textures that its files name are written as; formats that several engines take are written once",
    }],
};

static TEXTURES: Choice = Choice {
    title: "Textures",
    kinds: &[
        KindOf { name: "Png", form: Form::Plain, about: "read by everything" },
        KindOf {
            name: "Webp",
            form: Form::Plain,
            about: "the same texels, by EXT_texture_webp, in fewer bytes but for normal maps, which take about as many: for Generic, Godot and Web",
        },
        KindOf {
            name: "Ktx2",
            form: Form::Plain,
            about: "compressed on the graphics card too, with mips that keep leaves whole, by KHR_texture_basisu: for \
                    Generic, Unity and Web",
        },
    ],
};

/// The ladder: `Full` first, of at most `most` triangles, then ever coarser.
pub(super) fn lods(set: &Reader<'_, '_>, most: u32) -> Vec<LodBudget> {
    let items = set.list("lods");
    let mut levels: Vec<LodBudget> = Vec::new();
    let mut told = None;
    let mut has_wrong = false;
    for item in &items {
        let level = set.kind(&LODS, item, |kind, fields| {
            let lod = match kind {
                "Full" => return Some(LodBudget::from(Lod::Full)),
                "Thinned" => thinned(fields, most)?,
                "BillboardCloud" => Lod::BillboardCloud { cards: fields.count("cards") },
                "Impostor" => Lod::Impostor { frames: fields.count("frames") },
                _ => Lod::CrossedQuads,
            };
            let screen = fields.has("screen").then(|| fields.number("screen"));
            // A level between this one and `Full` takes over below the whole of the screen.
            let before = told.or_else(|| (levels.len() > 1).then_some(1.0));
            if let (Some(before), Some(screen)) = (before, screen)
                && screen >= before
            {
                let message = match told {
                    Some(before) => format!("{screen} is not less than the {before} of a level before"),
                    None => format!("{screen} leaves no room for the level before"),
                };
                fields.fault("screen", message, "the coarser a level, the smaller the tree where it takes over");
            }
            Some(LodBudget { lod, screen })
        });
        let Some(level) = level else {
            has_wrong = true;
            continue;
        };
        // After a wrong one nobody knows what the first is.
        if !(has_wrong && levels.is_empty()) {
            order(set, levels.last().map(|level| &level.lod), &level.lod, item);
        }
        told = level.screen.or(told);
        levels.push(level);
    }
    if has_wrong || levels.is_empty() { vec![Lod::Full.into()] } else { levels }
}

/// Share of a foot's flare that roots take, unless told.
const ROOTS: f32 = 0.7;

/// The same as it is told, or usual below such bark: a palm's foot is round.
pub(super) fn roots(fields: &Reader<'_, '_>, bark_of_leaf: BarkPattern) -> f32 {
    fields.number_or("roots", if bark_of_leaf == BarkPattern::Ringed { 0.0 } else { ROOTS })
}

/// How much feet are widened, as it is told; usually not those of meshes, which are as wide as they were drawn, and of species that
/// are told to have none. A scan's axes say nothing about feet.
pub(super) fn flare(fields: &Reader<'_, '_>, sources: &[Source]) -> f32 {
    let is_drawn = |source: &Source| match &source.recipe {
        SourceRecipe::Grow(params) => params.flare <= 0.0,
        SourceRecipe::Import(params) => MESHES.iter().any(|end| params.file.to_ascii_lowercase().ends_with(end)),
        SourceRecipe::Like(_) => false,
    };
    fields.number_or("flare", if sources.iter().any(is_drawn) { 0.0 } else { USUAL_FLARE })
}

/// How files of meshes are named.
const MESHES: [&str; 4] = [".glb", ".gltf", ".obj", ".ply"];

/// A share, a number of triangles, or both, of a tree that has at most `full`.
fn thinned(fields: &Reader<'_, '_>, full: u32) -> Option<Lod> {
    let most = most_triangles(fields);
    // Beside a share the fewer of the two hold.
    if !fields.has("triangles") && most < ANY && most >= full {
        let message = format!("{most} is not less than the {full} of `most` in `mesh`, which the full level keeps to");
        fields.fault("most", message, "go from fine to coarse, or tell a share as `triangles`");
    }
    if !fields.has("triangles") && most == ANY {
        fields.fault("triangles", "missing", "give a share of the full level's, or a number of them as `most`");
        return None;
    }
    // Of so many, and coarser than the full level in any case.
    Some(Lod::Thinned { triangles: fields.number_or("triangles", 0.95), most })
}

/// A budget, or none.
pub(super) fn most_triangles(fields: &Reader<'_, '_>) -> u32 {
    if fields.has("most") { fields.count("most") } else { ANY }
}

/// Reports a level that is not coarser than the one before it.
fn order(set: &Reader<'_, '_>, before: Option<&Lod>, level: &Lod, item: &Item<'_>) {
    let fault = |message: &str, hint: &str| set.report().at(item.span(), &item.path, message, hint);
    let rank = |level: &Lod| match level {
        Lod::Full => 0,
        Lod::Thinned { .. } => 1,
        Lod::BillboardCloud { .. } => 2,
        Lod::CrossedQuads | Lod::Impostor { .. } => 3,
    };
    match (before, level) {
        (None, Lod::Full) => {}
        (None, _) => fault("the first level is not Full", "start the list with Full"),
        (Some(_), Lod::Full) => fault("Full is the first level only", "leave it out here"),
        (Some(Lod::Thinned { triangles: before, most: most_before }), Lod::Thinned { triangles, most })
            if triangles >= before && most >= most_before =>
        {
            fault("has no fewer triangles than the level before it", "go from fine to coarse");
        }
        (Some(Lod::BillboardCloud { cards: before }), Lod::BillboardCloud { cards }) if cards >= before => {
            fault("has no fewer cards than the level before it", "go from fine to coarse");
        }
        (Some(Lod::CrossedQuads | Lod::Impostor { .. }), Lod::CrossedQuads | Lod::Impostor { .. }) => {
            fault("comes after the last level", "leave one of the two out")
        }
        (Some(before), level) if rank(before) > rank(level) => {
            fault(
                "is finer than the level before it",
                "the order is Full, Thinned, BillboardCloud, then CrossedQuads or Impostor",
            );
        }
        _ => {}
    }
}

/// The atlas; its size is a power of two.
pub(super) fn atlas(fields: &Reader<'_, '_>) -> AtlasParams {
    let size = fields.count("size");
    if !size.is_power_of_two() {
        let (below, above) = (1_u32 << size.ilog2(), 2_u32 << size.ilog2());
        fields.fault("size", format!("{size} is no power of two"), format!("take {below} or {above}"));
    }
    // Not of a size that is told to be wrong already.
    let (gutter, most) = (fields.count("gutter"), size / 16);
    if size.is_power_of_two() && gutter > most {
        let message = format!("{gutter} is more than a sixteenth of the atlas' size, {size}");
        fields.fault("gutter", message, format!("take {most} at most, or a larger atlas"));
    }
    AtlasParams { size, gutter }
}

/// The engines, in the order of [`Engine`], with their textures.
pub(super) fn engines(set: &Reader<'_, '_>) -> Vec<Profile> {
    let mut profiles: Vec<Profile> = Vec::new();
    for item in set.list("engines") {
        let fault = |message: String, hint: &str| set.report().at(item.span(), &item.path, message, hint);
        let read = set.kind(&ENGINES, &item, |name, fields| {
            let of = |item: &Item<'_>| fields.kind(&TEXTURES, item, |kind, _| Some(kind));
            let textures = match fields.item("textures").as_ref().and_then(of) {
                Some("Webp") => TextureFormat::Webp,
                Some("Ktx2") => TextureFormat::Ktx2,
                _ => TextureFormat::Png,
            };
            Some((name, Profile { engine: engine(name), textures }))
        });
        let Some((name, profile)) = read else { continue };
        if profiles.iter().any(|other| other.engine == profile.engine) {
            fault(format!("`{name}` is in the list twice"), "leave one out");
        } else if !profile.engine.reads(profile.textures) {
            let hint = "leave `textures` out: it is written with PNG then, beside what other engines take";
            let dark = profile.engine == Engine::Godot && profile.textures == TextureFormat::Ktx2;
            let flaw = if dark { "shows far too dark" } else { "does not read" };
            fault(format!("{name} {flaw} {:?} textures of glTF files", profile.textures), hint);
        }
        profiles.push(profile);
    }
    profiles.sort_unstable();
    profiles.dedup_by_key(|profile| profile.engine);
    if profiles.is_empty() { vec![Engine::Generic.into()] } else { profiles }
}

fn engine(name: &str) -> Engine {
    match name {
        "Godot" => Engine::Godot,
        "Unity" => Engine::Unity,
        "Unreal" => Engine::Unreal,
        "Bevy" => Engine::Bevy,
        "Web" => Engine::Web,
        _ => Engine::Generic,
    }
}
