//! The preset of a set: sources, variants and what they share, resolved into a [`Plan`].
//!
//! Seeds: a `Grow` source has its own, so the same species and seed is the same tree in every set; the set's seed drives
//! all else. How blends are read stands in `preset/blends.rs`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::asked::asked_for;
use super::blends::{BLEND, EXPLORE, MIX, PART, parts};
use super::look::{self, BARK, FOLIAGE, Named, path};
use super::morphs::{GROWTH, MORPH};
use super::output::{self, ATLAS, COLLIDERS, ENGINES, LODS, MESH};
use super::path::{folder, joined, name_fault, stem};
use super::plan::{
    Beside, Company, GrowParams, GrowSpace, ImportHeight, ImportParams, Light, LikeParams, Lod, MeshParams, Obstacle,
    Part, Plan, Source, SourceRecipe, USUAL_ERROR_SHARE, UpAxis,
};
use super::reader::{Item, Reader, clip};
use super::report::Report;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::shapes::{BETWEEN, GEODESIC, MEAN, SYMMETRIZE};
use super::sketches::SKETCH;
use super::species::{HEIGHT, seen_from, species};
use super::surroundings::{self, LIGHT, OBSTACLE};
use super::syntax::{Node, Value, tree};
use super::variants::{MOST_VARIANTS, Variants, variants};
use crate::base::{Asked, Diagnostic};

/// Sides of the thickest trunks where a preset tells none.
const MOST_SIDES: u32 = 64;

pub(super) const BY_DEFAULTS: Default = Default::Is("()");

/// The preset of a set.
pub(super) static SET: Record = Record {
    title: "Preset of a set",
    about: "Sources and variants must be given, everything else has a default.",
    fields: &[
        Field {
            name: "seed",
            kind: Kind::Integer { low: 0, high: u64::MAX, unit: "" },
            default: Default::Is("1"),
            about: "another one gives other blends and leaves from the same sources",
        },
        Field {
            name: "sources",
            kind: Kind::Named { choice: &SOURCE, low: 1, high: 64 },
            default: Default::Required,
            about: "the trees that variants are made from",
        },
        Field {
            name: "variants",
            kind: Kind::ListOf { choice: &VARIANT, low: 1, high: MOST_VARIANTS },
            default: Default::Required,
            about: "the trees that are written; 4096 in all",
        },
        Field { name: "foliage", kind: Kind::Fields(&FOLIAGE), default: BY_DEFAULTS, about: "twigs and leaves" },
        Field { name: "bark", kind: Kind::Fields(&BARK), default: BY_DEFAULTS, about: "bark" },
        Field {
            name: "mesh",
            kind: Kind::Fields(&MESH),
            default: BY_DEFAULTS,
            about: "how finely branches are meshed",
        },
        Field {
            name: "lods",
            kind: Kind::ListOf { choice: &LODS, low: 1, high: 8 },
            default: Default::Is("[Full, Thinned(triangles: 0.4), BillboardCloud(cards: 48), Impostor]"),
            about: "levels of detail, from fine to coarse; left out, sets that are to have no leaf have no cloud: \
                    cards show bare twigs badly",
        },
        Field {
            name: "atlas",
            kind: Kind::Fields(&ATLAS),
            default: BY_DEFAULTS,
            about: "the picture that leaves share",
        },
        Field {
            name: "colliders",
            kind: Kind::Fields(&COLLIDERS),
            default: BY_DEFAULTS,
            about: "simple shapes for physics and triggers",
        },
        Field {
            name: "engines",
            kind: Kind::ListOf { choice: &ENGINES, low: 1, high: 8 },
            default: Default::Is("[Generic]"),
            about: "whom the files are written for",
        },
    ],
};

static SOURCE: Choice = Choice {
    title: "Sources",
    kinds: &[
        KindOf { name: "Grow", form: Form::Fields(&GROW), about: "a tree grown from a species file, or like a scan" },
        KindOf {
            name: "Stand",
            form: Form::Fields(&STAND),
            about: "several grown trees that share their space, as one asset",
        },
        KindOf { name: "Import", form: Form::Fields(&IMPORT), about: "a tree from a scan, a mesh or a skeleton" },
    ],
};

static GROW: Record = Record {
    title: "Grow",
    about: "Either `species` or `like`. The same species, seed and height give the same tree in every set.",
    fields: &[
        Field {
            name: "species",
            kind: Kind::Text("the path of a species file"),
            default: Default::Else("`like` in its place"),
            about: "relative to the preset's folder",
        },
        Field {
            name: "like",
            kind: Kind::Text("the path of a scan or skeleton"),
            default: Default::Else("`species` in its place"),
            about: "grows more trees like this one; `treewright estimate` writes the species that is grown",
        },
        Field {
            name: "seed",
            kind: Kind::Integer { low: 0, high: u64::MAX, unit: "" },
            default: Default::Is("1"),
            about: "another one gives another tree of the species",
        },
        Field {
            name: "height",
            kind: HEIGHT,
            default: Default::Else("as the species or scan"),
            about: "height of this tree; its wood is as thick for it as the species'",
        },
        Field {
            name: "parts",
            kind: Kind::Named { choice: &PART, low: 0, high: 64 },
            default: Default::Else("none"),
            about: "names for some of its branches, for a blend's `only`",
        },
        Field { name: "light", kind: Kind::Fields(&LIGHT), default: BY_DEFAULTS, about: "light that branches turn to" },
        OBSTACLES,
        CLEARANCE,
        Field {
            name: "beside",
            kind: Kind::Rows { record: &TREE, low: 0, high: 31 },
            default: Default::Else("none"),
            about: "trees that take their share of the space and are then left out",
        },
    ],
};

const OBSTACLES: Field = Field {
    name: "obstacles",
    kind: Kind::ListOf { choice: &OBSTACLE, low: 0, high: 256 },
    default: Default::Else("none"),
    about: "what nothing grows through, in metres from the foot of the first tree",
};
const CLEARANCE: Field = Field {
    name: "clearance",
    kind: Kind::Number { low: 0.0, high: 100.0, unit: "m" },
    default: Default::Is("0.1"),
    about: "air between obstacles and branches",
};

static STAND: Record = Record {
    title: "Stand",
    about: "Trees that grow together: crowns meet but don't enter each other. The first stands at the origin. Trees less than half as high as \
            others leave these their room, and one without any is left out, with a note.",
    fields: &[
        Field {
            name: "trees",
            kind: Kind::Rows { record: &TREE, low: 1, high: 32 },
            default: Default::Required,
            about: "the trees; places are metres from the first",
        },
        Field { name: "light", kind: Kind::Fields(&LIGHT), default: BY_DEFAULTS, about: "light that branches turn to" },
        OBSTACLES,
        CLEARANCE,
        Field {
            name: "parts",
            kind: Kind::Named { choice: &PART, low: 0, high: 64 },
            default: Default::Else("none"),
            about: "names for some of its branches, for a blend's `only`",
        },
    ],
};

static TREE: Record = Record {
    title: "Tree in company",
    about: "One tree of several.",
    fields: &[
        Field {
            name: "species",
            kind: Kind::Text("the path of a species file"),
            default: Default::Required,
            about: "relative to the preset's folder",
        },
        surroundings::X,
        surroundings::Z,
        Field {
            name: "seed",
            kind: Kind::Integer { low: 0, high: u64::MAX, unit: "" },
            default: Default::Is("1"),
            about: "another one gives another tree of the species",
        },
        Field { name: "height", kind: HEIGHT, default: Default::Else("as the species"), about: "height of this tree" },
    ],
};

const PARTS: Kind = Kind::Texts { what: "names of materials or parts", low: 0, high: 64 };

static IMPORT: Record = Record {
    title: "Import",
    about: "What the file holds is told by its contents.",
    fields: &[
        Field {
            name: "file",
            kind: Kind::Text("the path of a file"),
            default: Default::Required,
            about: "relative to the preset's folder",
        },
        Field { name: "up", kind: Kind::Choice(&UP), default: Default::Is("Detect"), about: "which axis points up" },
        Field { name: "height", kind: HEIGHT, default: Default::Else("as the file"), about: "scales the tree to it" },
        Field {
            name: "objects",
            kind: Kind::Texts { what: "names of objects", low: 0, high: 64 },
            default: Default::Is("[]"),
            about: "which nodes (glTF) or objects and groups (OBJ) of a mesh are the tree, with all that is below them; of several \
                    trees that stand apart the first is taken where none is named",
        },
        Field {
            name: "leaves",
            kind: PARTS,
            default: Default::Is("[]"),
            about: "what in a mesh is leaves, where it isn't found by itself; no name of `wood`",
        },
        Field {
            name: "wood",
            kind: PARTS,
            default: Default::Is("[]"),
            about: "what in a mesh is wood, where it isn't found by itself",
        },
        Field {
            name: "parts",
            kind: Kind::Named { choice: &PART, low: 0, high: 64 },
            default: Default::Else("none"),
            about: "names for some of its branches, for a blend's `only`",
        },
    ],
};

static UP: Choice = Choice {
    title: "Up",
    kinds: &[
        KindOf { name: "Detect", form: Form::Plain, about: "found from the data; Y of glTF, which says so" },
        KindOf { name: "Y", form: Form::Plain, about: "as most meshes" },
        KindOf { name: "Z", form: Form::Plain, about: "as most scans" },
    ],
};

pub(super) static VARIANT: Choice = Choice {
    title: "Variants",
    kinds: &[
        KindOf { name: "Source", form: Form::One(&AS_IS), about: "a source as it is" },
        KindOf { name: "Blend", form: Form::Fields(&BLEND), about: "trees between two sources" },
        KindOf { name: "Mix", form: Form::Fields(&MIX), about: "trees at given weights between any number of sources" },
        KindOf {
            name: "Explore",
            form: Form::Fields(&EXPLORE),
            about: "trees spread evenly over the space that any number of sources span",
        },
        KindOf {
            name: "Geodesic",
            form: Form::Fields(&GEODESIC),
            about: "trees at even steps of the shortest way between two sources",
        },
        KindOf { name: "Mean", form: Form::Fields(&MEAN), about: "the tree that is least far from some sources" },
        KindOf { name: "Symmetrize", form: Form::Fields(&SYMMETRIZE), about: "a source made symmetric" },
        KindOf { name: "Between", form: Form::Fields(&BETWEEN), about: "trees drawn about the mean of some sources" },
        KindOf { name: "Morph", form: Form::Fields(&MORPH), about: "frames from one source to another, leaf by leaf" },
        KindOf { name: "Grow", form: Form::Fields(&GROWTH), about: "frames of a source's growth" },
        KindOf { name: "Sketch", form: Form::Fields(&SKETCH), about: "a source whose crown takes a drawn shape" },
    ],
};

static AS_IS: Record = Record {
    title: "Source",
    about: "`Source(\"oak\")` or `Source(of: \"oak\")`.",
    fields: &[Field {
        name: "of",
        kind: Kind::Text("a source's name"),
        default: Default::Required,
        about: "which one",
    }],
};

/// Reads a preset and the species files it names. `file` is the preset's path as the user knows it, with `/` between
/// folders; its stem is the set's name. `read` gives the text of a file by its path relative to the preset's folder,
/// or says why it can't; it is asked once a file, in the order of the text. Other files (scans, pictures) are not read.
///
/// # Errors
///
/// All that is wrong with the preset and its species files, at most 65 errors a file: those of the preset first, in the
/// order of its text.
pub fn load(
    file: &str,
    text: &str,
    read: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Result<Plan, Vec<Diagnostic>> {
    let report = Report::new(file);
    let mut files = SpeciesFiles { folder: folder(file), read, known: BTreeMap::new() };
    let plan = tree(text, &report).filter(|_| report.is_clean()).and_then(|node| {
        if is_species(&node) {
            let hint = format!("name it in a preset: sources: {{\"tree\": Grow(species: \"{}.ron\")}}", stem(file));
            report.whole("this is a species file, which says how one kind of tree grows", hint);
            return None;
        }
        let top = Item { node: Cow::Owned(node), path: String::new(), given: true };
        plan(stem(file), &Reader::new(&report, &SET, &top), &mut files)
    });
    match plan {
        Some(plan) if report.is_clean() => Ok(plan),
        _ => Err(report.into_diagnostics()),
    }
}

/// Whether a file's fields are those of a species: it tells iterations and no sources.
fn is_species(node: &Node) -> bool {
    let Value::Record(None, fields) = &node.value else { return false };
    let has = |name: &str| fields.iter().any(|(field, _)| field.text == name);
    has("iterations") && !has("sources") && !has("variants")
}

fn plan(name: &str, set: &Reader<'_, '_>, files: &mut SpeciesFiles<'_>) -> Option<Plan> {
    if let Some((message, hint)) = name_fault(name) {
        let message = format!("the preset's file name names its set, and {message}");
        set.report().whole(message, hint);
    }
    let seed = set.integer("seed");
    let (sources, named) = sources(set, files);
    let Variants { trees: variants, origins, blends, selections, shapes, morphs, sketches } =
        variants(set, &named.names, &sources, seed);
    let foliage = set.group("foliage", |fields| look::foliage(fields, &named)).flatten();
    let of_leaf = foliage.as_ref().map_or(super::plan::BarkPattern::Furrowed, |f| f.bark);
    let bark = set.group("bark", |fields| look::bark(fields, of_leaf, &named)).flatten();
    let mesh = set.group("mesh", |fields| {
        let (sides, error) = (fields.count("sides"), fields.number("error"));
        // Who tells a number gets no more sides, and that error on small trees, too.
        let most_sides = if fields.has("sides") { sides } else { MOST_SIDES };
        let error_share = if fields.has("error") { 0.0 } else { USUAL_ERROR_SHARE };
        let mesh = MeshParams {
            most_sides,
            error_share,
            forks: output::forks(fields),
            leaves: output::leaves(fields),
            backs: output::backs(fields),
            most: output::most_triangles(fields),
            below: fields.number("below"),
            roots: output::roots(fields, of_leaf),
            flare: output::flare(fields, &sources),
            ..MeshParams::told(sides, error)
        };
        (mesh, output::wind(fields), fields.count("lightmap"))
    });
    let mut lods = output::lods(set, mesh.as_ref().map_or(super::plan::ANY, |(mesh, ..)| mesh.most));
    if !set.has("lods") && foliage.as_ref().is_some_and(|foliage| foliage.own_density <= 0.0) {
        lods.retain(|level| !matches!(level.lod, Lod::BillboardCloud { .. }));
    }
    let atlas = set.group("atlas", output::atlas);
    let engines = output::engines(set);
    let colliders = set.group("colliders", |fields| output::colliders(fields, &engines));
    let (foliage, (bark_art, bark_wear, bark_tile), (mesh, wind, lightmap)) = (foliage?, bark?, mesh?);
    Some(Plan {
        name: name.to_string(),
        seed,
        sources,
        variants,
        origins,
        blends,
        selections,
        shapes,
        morphs,
        sketches,
        notes: foliage.notes,
        foliage_told: foliage.told,
        dress: foliage.dress,
        own_density: foliage.own_density,
        leaf_art: foliage.art,
        leaf_wear: foliage.wear,
        leaf_turn: foliage.turn,
        bark_art,
        bark_wear,
        mesh: MeshParams { bark_tile, ..mesh },
        lightmap,
        wind,
        lods,
        atlas: atlas?,
        colliders: colliders?,
        engines,
    })
}

/// The species files of a preset, each read once.
struct SpeciesFiles<'f> {
    folder: &'f str,
    read: &'f mut dyn FnMut(&str) -> Result<String, String>,
    /// By path: the species, or none when it is unreadable or wrong (the first source that named it said so).
    known: BTreeMap<String, Option<GrowParams>>,
}

impl SpeciesFiles<'_> {
    fn get(&mut self, path: &str, item: &Item<'_>, report: &Report<'_>) -> Option<GrowParams> {
        if let Some(known) = self.known.get(path) {
            return known.clone();
        }
        let found = match (self.read)(path) {
            Ok(text) => species(&joined(self.folder, path), &text)
                .map(|params| seen_from(params, folder(path)))
                .map_err(|found| {
                    let by = Asked { file: report.file().to_string(), span: item.span(), field: item.path.clone() };
                    report.adopt(asked_for(found, &by));
                })
                .ok(),
            Err(reason) => {
                let hint = if reason.contains("UTF-8") {
                    "a species file is text: save it as UTF-8"
                } else if reason.contains("no such file") {
                    "paths are relative to the preset's folder"
                } else {
                    ""
                };
                report.at(item.span(), &item.path, format!("can't read {path}: {reason}"), hint);
                None
            }
        };
        self.known.insert(path.to_string(), found.clone());
        found
    }
}

/// The sources in the order of their names, and all names that the preset gives, with the index of those that are
/// sound.
fn sources(set: &Reader<'_, '_>, files: &mut SpeciesFiles<'_>) -> (Vec<Source>, Named) {
    // By name in lower case, as some file systems don't tell the cases apart: name and line.
    let mut seen: BTreeMap<String, (String, u32)> = BTreeMap::new();
    let mut found: BTreeMap<String, Option<(SourceRecipe, Vec<Part>)>> = BTreeMap::new();
    for (name, item) in set.map("sources") {
        if let Some((message, hint)) = name_fault(&name.text) {
            set.report().at(name.span, &item.path, message, hint);
        }
        if let Some((first, line)) = seen.get(&name.text.to_lowercase()) {
            let hint = if *first == name.text {
                "give one of the two another name"
            } else {
                "upper and lower case count as the same: give one of the two another name"
            };
            let message = format!("there is a source \"{}\" on line {line} already", clip(first));
            set.report().at(name.span, &item.path, message, hint);
            continue;
        }
        seen.insert(name.text.to_lowercase(), (name.text.clone(), name.span.line));
        let recipe = set.kind(&SOURCE, &item, |kind, fields| {
            let parts = parts(fields);
            let recipe = match kind {
                "Grow" if fields.has("like") => like(fields).map(SourceRecipe::Like),
                "Grow" => grow(fields, files).map(SourceRecipe::Grow),
                "Stand" => stand(fields, files).map(SourceRecipe::Grow),
                _ => Some(SourceRecipe::Import(import(fields))),
            };
            Some((recipe?, parts))
        });
        found.insert(name.text, recipe);
    }
    let names = found.keys().cloned().zip(0..).collect();
    let is_grown = |recipe: &SourceRecipe| !matches!(recipe, SourceRecipe::Import(_));
    let grown = found.values().zip(0..).filter(|(found, _)| found.as_ref().is_some_and(|found| is_grown(&found.0)));
    let named = Named { names, grown: grown.map(|(_, index)| index).collect() };
    // A source that is wrong keeps its index; the plan is not handed out then.
    let source = |(name, found): (String, Option<(SourceRecipe, Vec<Part>)>)| {
        found.map(|(recipe, parts)| Source { name, recipe, parts })
    };
    (found.into_iter().filter_map(source).collect(), named)
}

fn grow(fields: &Reader<'_, '_>, files: &mut SpeciesFiles<'_>) -> Option<GrowParams> {
    let params = one_tree(fields, files);
    let beside = company(fields, "beside", files);
    let around = around(fields);
    let mut params = params?;
    params.space = GrowSpace { beside: beside?, ..around.given(params.space) };
    Some(params)
}

fn stand(fields: &Reader<'_, '_>, files: &mut SpeciesFiles<'_>) -> Option<GrowParams> {
    let around = around(fields);
    let mut trees = company(fields, "trees", files)?;
    if trees.is_empty() {
        return None;
    }
    let first = trees.remove(0);
    let mut params = first.params;
    for tree in &mut trees {
        tree.at = [tree.at[0] - first.at[0], tree.at[1] - first.at[1]];
    }
    params.space = GrowSpace { beside: trees, company: Company::Kept, ..around.given(params.space) };
    Some(params)
}

/// What a species, a seed and a height make.
fn one_tree(fields: &Reader<'_, '_>, files: &mut SpeciesFiles<'_>) -> Option<GrowParams> {
    let seed = fields.integer("seed");
    let height = fields.number_or("height", 0.0);
    // What is no group of fields is told already.
    fields.span()?;
    if !fields.has("species") {
        let hint = "write `species: \"species/oak.ron\"`, or `like: \"scans/oak.csv\"` to grow more trees like a scan";
        fields.report().at(fields.span(), fields.path(), "needs `species` or `like`", hint);
        return None;
    }
    let path = path(fields, "species");
    if path.is_empty() {
        return None;
    }
    let item = fields.item("species")?;
    let species = files.get(&path, &item, fields.report())?;
    // A smaller tree is the same tree, not one with the trunk of the larger.
    let species = if fields.has("height") { species.at_height(height) } else { species };
    Some(GrowParams { seed, ..species })
}

/// The trees of a list; none when one of them is wrong.
fn company(fields: &Reader<'_, '_>, name: &str, files: &mut SpeciesFiles<'_>) -> Option<Vec<Beside>> {
    let trees = fields.list(name).into_iter().map(|item| {
        let tree = Reader::new(fields.report(), &TREE, &item);
        let at = [tree.number("x"), tree.number("z")];
        one_tree(&tree, files).map(|params| Beside { params, at })
    });
    // All are read before any is missed, so that every error is told.
    trees.collect::<Vec<_>>().into_iter().collect()
}

/// Light, obstacles and clearance.
struct Around {
    light: Light,
    obstacles: Vec<Obstacle>,
    clearance: f32,
}

impl Around {
    fn given(self, space: GrowSpace) -> GrowSpace {
        GrowSpace { light: self.light, obstacles: self.obstacles, clearance: self.clearance, ..space }
    }
}

fn around(fields: &Reader<'_, '_>) -> Around {
    let obstacles = fields.list("obstacles");
    fields.needs("obstacles", &["clearance"], "give `obstacles` to keep away from, or leave it out");
    Around {
        light: fields.group("light", surroundings::light).unwrap_or_default(),
        obstacles: obstacles.iter().filter_map(|item| fields.kind(&OBSTACLE, item, surroundings::obstacle)).collect(),
        clearance: fields.number("clearance"),
    }
}

/// A plant grown like a scan, which the import reads upright and at its own height.
fn like(fields: &Reader<'_, '_>) -> Option<LikeParams> {
    let seed = fields.integer("seed");
    let height = fields.number_or("height", 1.0);
    let height = if fields.has("height") { ImportHeight::Metres(height) } else { ImportHeight::AsIs };
    if fields.has("species") {
        let message = "has both `species` and `like`, but a tree is grown from one of them";
        fields.fault("like", message, "leave one of the two out");
    }
    for name in ["light", "obstacles", "clearance", "beside"].into_iter().filter(|name| fields.has(name)) {
        let hint = "leave it out, or name the file that `treewright estimate` writes as `species`";
        fields.fault(name, "has no meaning with `like`", hint);
    }
    let file = path(fields, "like");
    let scan = ImportParams { file, ..ImportParams::default() };
    (!scan.file.is_empty()).then_some(LikeParams { scan, seed, height })
}

fn import(fields: &Reader<'_, '_>) -> ImportParams {
    let up = fields.choice("up", |kind, _| {
        Some(match kind {
            "Y" => UpAxis::Y,
            "Z" => UpAxis::Z,
            _ => UpAxis::Detect,
        })
    });
    let height = fields.number_or("height", 1.0);
    let (leaves, wood) = (texts(fields, "leaves"), texts(fields, "wood"));
    if let Some(both) = wood.iter().find(|name| leaves.iter().any(|leaf| leaf.to_lowercase() == name.to_lowercase())) {
        let message = format!("\"{}\" is among `leaves`, too, but a part is one of them", clip(both));
        fields.fault("wood", message, "leave it out of one of the two; upper and lower case count as the same");
    }
    ImportParams {
        file: path(fields, "file"),
        up: up.unwrap_or(UpAxis::Detect),
        height: if fields.has("height") { ImportHeight::Metres(height) } else { ImportHeight::AsIs },
        objects: texts(fields, "objects"),
        leaves,
        wood,
    }
}

/// A list of texts; what is none is reported.
fn texts(fields: &Reader<'_, '_>, name: &str) -> Vec<String> {
    let text = |item: Item<'_>| match &item.node.value {
        Value::Text(text) => Some(text.clone()),
        other => {
            let message = format!("expected a text, found {}", other.is_called());
            fields.report().at(item.span(), &item.path, message, "write it in quotes");
            None
        }
    };
    fields.list(name).into_iter().filter_map(text).collect()
}
