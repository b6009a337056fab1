//! What a set is written as: `mesh`, `lods`, `atlas` and `engines` of a preset.

use super::plan::{AtlasParams, Engine, Forks, Lod, WindData};
use super::reader::{Item, Reader};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};

/// `mesh`.
pub(super) static MESH: Record = Record {
    title: "Mesh",
    about: "Branches at the full level of detail.",
    fields: &[
        Field {
            name: "sides",
            kind: Kind::Integer { low: 3, high: 64, unit: "sides" },
            default: Default::Is("12"),
            about: "of the thickest tube",
        },
        Field {
            name: "error",
            kind: Kind::Number { low: 0.0005, high: 0.5, unit: "m" },
            default: Default::Is("0.01"),
            about: "largest distance between a tube and the smooth branch; twigs may stray 2.5 times as far",
        },
        Field {
            name: "forks",
            kind: Kind::Choice(&FORKS),
            default: Default::Is("Collar"),
            about: "how a branch leaves its parent",
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
            about: "edge of a light map that a second UV set is unwrapped for; 0 for none",
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

static WIND: Choice = Choice {
    title: "Wind",
    kinds: &[
        KindOf { name: "Nothing", form: Form::Plain, about: "the fewest bytes" },
        KindOf {
            name: "Attributes",
            form: Form::Plain,
            about: "`_WIND` (trunk, limb, leaf, phase), bend and phase, and pivots as texture coordinates; the manifest \
                    tells which",
        },
    ],
};

/// What vertices tell about wind, of `mesh`.
pub(super) fn wind(fields: &Reader<'_, '_>) -> WindData {
    let kind = |item: &Item<'_>| fields.kind(&WIND, item, |kind, _| Some(kind));
    let asked = fields.item("wind").as_ref().and_then(kind) == Some("Attributes");
    if asked { WindData::Attributes } else { WindData::Nothing }
}

/// How branches leave their parents, of `mesh`.
pub(super) fn forks(fields: &Reader<'_, '_>) -> Forks {
    let kind = |item: &Item<'_>| fields.kind(&FORKS, item, |kind, _| Some(kind));
    if fields.item("forks").as_ref().and_then(kind) == Some("Plain") { Forks::Plain } else { Forks::Collar }
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
        KindOf { name: "CrossedQuads", form: Form::Plain, about: "two crossed quads; the last level" },
        KindOf {
            name: "Impostor",
            form: Form::Fields(&IMPOSTOR),
            about: "a hemi-octahedral sheet of views, on crossed quads where there is no shader for it; the last level",
        },
    ],
};

static THINNED: Record = Record {
    title: "Thinned",
    about: "Meshed again, and leaves thinned in a fixed order.",
    fields: &[Field {
        name: "triangles",
        kind: Kind::Number { low: 0.01, high: 0.95, unit: "" },
        default: Default::Required,
        about: "share of the full level's triangles",
    }],
};

static CLOUD: Record = Record {
    title: "BillboardCloud",
    about: "Cards fitted to groups of leaves.",
    fields: &[Field {
        name: "cards",
        kind: Kind::Integer { low: 4, high: 512, unit: "cards" },
        default: Default::Is("48"),
        about: "at most",
    }],
};

static IMPOSTOR: Record = Record {
    title: "Impostor",
    about: "The tree from all sides in one square of the atlas: colour with alpha, normals, and depth in the blue channel \
            of the occlusion map. `extras` of the level's mesh tell the layout.",
    fields: &[Field {
        name: "frames",
        kind: Kind::Integer { low: 4, high: 24, unit: "views" },
        default: Default::Is("12"),
        about: "along an edge of the sheet; each is 40 texels wide",
    }],
};

/// The engine profiles.
pub(super) static ENGINES: Choice = Choice {
    title: "Engines",
    kinds: &[
        KindOf {
            name: "Generic",
            form: Form::Plain,
            about: "`NAME.glb`: glTF 2.0 with MSFT_lod, for any engine that reads it",
        },
        KindOf {
            name: "Godot",
            form: Form::Plain,
            about: "`NAME.godot.glb`: levels side by side as `NAME_LOD0`…, colliders by `-convcolonly`",
        },
        KindOf {
            name: "Unity",
            form: Form::Plain,
            about: "`NAME.unity.glb`: levels side by side as `NAME_LOD0`…, colliders in a file beside it",
        },
        KindOf {
            name: "Unreal",
            form: Form::Plain,
            about: "`NAME_LOD0.unreal.glb`…: a file for each level, colliders as `UCX_NAME_LOD0_00`…",
        },
        KindOf {
            name: "Bevy",
            form: Form::Plain,
            about: "`NAME.bevy.glb`: levels side by side with `visibility_range` in their extras, colliders in a file beside it",
        },
        KindOf {
            name: "Web",
            form: Form::Plain,
            about: "`NAME.web.glb`: as Generic, quantized and packed by meshoptimizer",
        },
    ],
};

/// The ladder: `Full` first, then ever coarser.
pub(super) fn lods(set: &Reader<'_, '_>) -> Vec<Lod> {
    let items = set.list("lods");
    let mut levels: Vec<Lod> = Vec::new();
    for item in &items {
        let level = set.kind(&LODS, item, |kind, fields| {
            Some(match kind {
                "Full" => Lod::Full,
                "Thinned" => Lod::Thinned { triangles: fields.number("triangles") },
                "BillboardCloud" => Lod::BillboardCloud { cards: fields.count("cards") },
                "Impostor" => Lod::Impostor { frames: fields.count("frames") },
                _ => Lod::CrossedQuads,
            })
        });
        let Some(level) = level else { return vec![Lod::Full] };
        order(set, levels.last(), &level, item);
        levels.push(level);
    }
    if levels.is_empty() { vec![Lod::Full] } else { levels }
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
        (Some(Lod::Thinned { triangles: before }), Lod::Thinned { triangles }) if triangles >= before => {
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
    AtlasParams { size, gutter: fields.count("gutter") }
}

/// The engines, in the order of [`Engine`].
pub(super) fn engines(set: &Reader<'_, '_>) -> Vec<Engine> {
    let mut named = Vec::new();
    for item in set.list("engines") {
        if let Some(engine) = set.kind(&ENGINES, &item, |engine, _| Some(engine)) {
            if named.contains(&engine) {
                set.report().at(item.span(), &item.path, format!("`{engine}` is in the list twice"), "leave one out");
            }
            named.push(engine);
        }
    }
    let mut engines: Vec<Engine> = named
        .into_iter()
        .map(|name| match name {
            "Godot" => Engine::Godot,
            "Unity" => Engine::Unity,
            "Unreal" => Engine::Unreal,
            "Bevy" => Engine::Bevy,
            "Web" => Engine::Web,
            _ => Engine::Generic,
        })
        .collect();
    engines.sort_unstable();
    engines.dedup();
    if engines.is_empty() { vec![Engine::Generic] } else { engines }
}
