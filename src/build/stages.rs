//! The stages as the pipeline calls them: each takes its own part of the plan and the results of earlier ones.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cache::{Cache, Stage};
use super::pipeline::Inputs;
use super::{wardrobe, wears};
use crate::bake::{self, ArtFile, ArtLimits, ArtUse, LeafPicture, Maps};
use crate::base::{Asked, Diagnostic, Key, KeyBuilder, Note, Seed};
use crate::plant::Plant;
use crate::preset::plan::{
    BarkArt, Company, GrowParams, ImportHeight, ImportParams, LeafArt, LikeParams, MorphKind, Source, SourceRecipe,
    Variant, Wear,
};
use crate::preset::{self, Plan};
use crate::source::{estimate, foliage, grow, import};

/// The stages that make sources and pictures, with their versions.
const GROW: Stage = Stage("grow", 14);
const GRAPH: Stage = Stage("graph", 3);
const IMPORT: Stage = Stage("import", 22);
const LIKE: Stage = Stage("like", 15);
const PICTURES: Stage = Stage("pictures", 13);
const DRAWING: Stage = Stage("drawing", 5);
const BARK: Stage = Stage("bark", 1);

/// A source and what was mended in it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SourcePlant {
    /// The plant.
    pub(super) plant: Plant,
    /// Its own pictures of leaves, by the slots of its leaves.
    pub(super) leaf_maps: Vec<Maps>,
    /// Its own bark, where it brings some.
    pub(super) bark: Option<Maps>,
    /// Whether the bark is a picture of the source's and no mere colour.
    pub(super) pictured: bool,
    /// What was bridged or dropped.
    notes: Vec<String>,
}

impl SourcePlant {
    pub(super) fn grown(plant: Plant, notes: Vec<String>) -> Self {
        Self { plant, leaf_maps: Vec::new(), bark: None, pictured: false, notes }
    }

    fn imported(imported: import::Imported) -> Self {
        let seed = Seed::new(0).child("own art");
        let import::Imported { plant, art, mut notes, .. } = imported;
        let ((leaf_maps, of_leaves), (bark, of_bark)) =
            rayon::join(|| bake::card_maps(&art, seed), || bake::own_bark_maps(&art, seed));
        notes.extend(of_leaves);
        notes.extend(of_bark);
        let pictured = art.bark.is_some_and(|bark| bark.image.is_some());
        Self { plant, leaf_maps, bark, pictured, notes }
    }

    /// Whether it is a mesh that is wood alone.
    pub(super) fn is_bare_mesh(&self) -> bool {
        self.notes.iter().any(|note| note == foliage::BARE)
    }

    /// Whether it brings leaves.
    pub(super) fn is_leafy(&self) -> bool {
        !self.plant.leaves().is_empty() && !self.leaf_maps.is_empty()
    }
}

/// What leaves and bark wear.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    /// One for each slot.
    pub(super) leaves: Vec<Maps>,
    /// Tiling.
    pub(super) bark: Maps,
}

/// Which sources are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Those that some variant, or what leaves and bark wear, needs.
    Used,
    /// All of them, for who tries things out.
    All,
}

/// For each source whether anything of the set hangs on it.
fn used(plan: &Plan) -> Vec<bool> {
    let mut used = vec![false; plan.sources.len()];
    let of_variants = plan.variants.iter().flat_map(|variant| ingredients(plan, variant));
    let of_frames = plan.morphs.iter().flat_map(|morph| match morph.kind {
        MorphKind::Between(a, b) => vec![a, b],
        MorphKind::Growth { of, .. } | MorphKind::Sketch { of, .. } => vec![of],
    });
    let worn = [plan.leaf_wear, plan.bark_wear].into_iter().filter_map(|wear| match wear {
        Wear::Source(index) => Some(index),
        Wear::All | Wear::Rest => None,
    });
    for index in of_variants.chain(of_frames).chain(worn) {
        if let Some(used) = used.get_mut(index) {
            *used = true;
        }
    }
    used
}

/// Grows or imports the sources; one that is not wanted is a plant without anything.
pub(super) fn sources(
    plan: &Plan,
    inputs: &Inputs,
    cache: &Cache,
    wanted: Wanted,
    step: &(dyn Fn(&str) + Sync),
) -> Result<Vec<Arc<SourcePlant>>, Vec<Diagnostic>> {
    let used = used(plan);
    let made: Vec<Result<Arc<SourcePlant>, Vec<Diagnostic>>> = plan
        .sources
        .par_iter()
        .zip(used)
        .map(|(source, used)| {
            let is_wanted = used || wanted == Wanted::All;
            let none = || Ok(Arc::new(SourcePlant::grown(Plant::default(), Vec::new())));
            let result = if is_wanted { one_source(source, inputs, cache) } else { none() };
            step("source");
            result
        })
        .collect();
    let mut plants = Vec::new();
    let mut errors = Vec::new();
    for result in made {
        match result {
            Ok(plant) => plants.push(plant),
            Err(mut diagnostics) => errors.append(&mut diagnostics),
        }
    }
    if errors.is_empty() { Ok(plants) } else { Err(errors) }
}

fn one_source(source: &Source, inputs: &Inputs, cache: &Cache) -> Result<Arc<SourcePlant>, Vec<Diagnostic>> {
    match &source.recipe {
        SourceRecipe::Grow(params) => {
            let mut key = GROW.key().params(params);
            for shape in grow::shape_files(params) {
                key = key.input(Key::of_bytes(&inputs[&shape.file].bytes));
            }
            for file in grow::obstacle_files(params) {
                key = key.input(Key::of_bytes(&inputs[file].bytes));
            }
            cache.remember(GROW, key.finish(), || {
                let solids = solids(source, params, inputs)?;
                let graph = graph(source, params, &solids, inputs, cache)?;
                grow::grow_on(&graph, params, &solids, Seed::new(params.seed).child("grow"))
                    .map(|(plant, notes)| SourcePlant::grown(plant, notes))
                    .map_err(|error| vec![grow_diagnostic(source, &error)])
            })
        }
        SourceRecipe::Import(params) => {
            let key = import_key(IMPORT.key(), params, inputs);
            cache.remember(IMPORT, key, || imported((source, "file"), params, inputs).map(SourcePlant::imported))
        }
        SourceRecipe::Like(like) => {
            let key = import_key(LIKE.key().params(like), &like.scan, inputs);
            cache.remember(LIKE, key, || grown_like(source, like, inputs))
        }
    }
}

/// The key of an imported plant.
fn import_key(stage: KeyBuilder, params: &ImportParams, inputs: &Inputs) -> Key {
    let input = &inputs[&params.file];
    let mut key = stage.params(params).input(Key::of_bytes(&input.bytes));
    for (name, bytes) in &input.files(inputs) {
        key = key.params(name).input(Key::of_bytes(bytes));
    }
    key.finish()
}

/// What is wrong with a data file that a field of the preset asks for.
fn asked_for(field: String, found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    preset::data_asked_for(found, &Asked { file: String::new(), span: None, field })
}

/// Imports the file that a source's `field` names.
fn imported(
    (source, field): (&Source, &str),
    params: &ImportParams,
    inputs: &Inputs,
) -> Result<import::Imported, Vec<Diagnostic>> {
    let input = &inputs[&params.file];
    let field = format!("sources[\"{}\"].{field}", source.name);
    let made = import::import_with(&input.bytes, &input.shown, &input.files(inputs), params)
        .map_err(|found| asked_for(field.clone(), found))?;
    let plant = &made.plant;
    let has_length = |id| plant.points(id).windows(2).any(|ends| ends[0].distance(ends[1]) > 0.0);
    if plant.chain_ids().any(has_length) {
        return Ok(made);
    }
    let error = Diagnostic::new(&input.shown, "no branch of the plant has any length")
        .with_hint("all points of each branch lie in one place: check their coordinates");
    Err(asked_for(field, vec![error]))
}

/// What helps where nothing grows like a scan.
const LIKE_NEEDS: &str = "it needs a tree with a trunk and branches";

/// The species that a scan is one of, and what was mended in the scan.
fn estimated(
    source: &Source,
    like: &LikeParams,
    inputs: &Inputs,
) -> Result<(GrowParams, Vec<String>), Vec<Diagnostic>> {
    let scan = imported((source, "like"), &like.scan, inputs)?;
    let wrong = |message: String| {
        let field = format!("sources[\"{}\"].like", source.name);
        vec![Diagnostic::new("", message).with_field(field).with_hint(LIKE_NEEDS)]
    };
    let estimate = estimate::estimate(&scan.plant).map_err(|error| wrong(error.to_string()))?;
    let params = match like.height {
        ImportHeight::AsIs => estimate.params,
        ImportHeight::Metres(height) => estimate.params.at_height(height),
    };
    Ok((GrowParams { seed: like.seed, ..params }, scan.notes))
}

/// A note on a plant whose species is in no file: the fields that it advises are in none either.
fn of_no_file(note: String) -> String {
    if note.contains('`') {
        format!("{note} in the species file that `treewright estimate` writes of the scan")
    } else {
        note
    }
}

/// A plant grown like a scan.
fn grown_like(source: &Source, like: &LikeParams, inputs: &Inputs) -> Result<SourcePlant, Vec<Diagnostic>> {
    let (params, mended) = estimated(source, like, inputs)?;
    let (plant, mut notes) = grow::grow(&params, Seed::new(params.seed).child("grow")).map_err(|error| {
        let field = format!("sources[\"{}\"].like", source.name);
        vec![Diagnostic::new("", format!("nothing like it grows: {error}")).with_field(field).with_hint(LIKE_NEEDS)]
    })?;
    notes = notes.into_iter().map(of_no_file).collect();
    // Its leaves and bark are not the scan's.
    let mended = mended.into_iter().filter(|note| !wears::is_of_looks(note));
    notes.splice(0..0, mended.map(|note| format!("the scan: {note}")));
    Ok(SourcePlant::grown(plant, notes))
}

/// Reads the shapes that a species' volumes name.
fn solids(source: &Source, params: &GrowParams, inputs: &Inputs) -> Result<grow::Solids, Vec<Diagnostic>> {
    let read = |shape: grow::ShapeFile| {
        let input = &inputs[&shape.file];
        grow::Solid::read(&input.bytes, shape.reading).map(|solid| (shape, solid)).map_err(|error| {
            let error = Diagnostic::new(&input.shown, format!("its species takes endpoints from it, but {error}"))
                .with_hint("the species file that the source names asks for it: mend it, or name another there");
            asked_for(format!("sources[\"{}\"].species", source.name), vec![error])
        })
    };
    let (solids, errors): (Vec<_>, Vec<_>) = grow::shape_files(params).into_iter().map(read).partition(Result::is_ok);
    let errors: Vec<Diagnostic> = errors.into_iter().filter_map(Result::err).flatten().collect();
    if errors.is_empty() { Ok(solids.into_iter().flatten().collect()) } else { Err(errors) }
}

/// The graph that a source grows on, which sources of one species share.
fn graph(
    source: &Source,
    params: &GrowParams,
    solids: &grow::Solids,
    inputs: &Inputs,
    cache: &Cache,
) -> Result<Arc<grow::Graph>, Vec<Diagnostic>> {
    let wrong = |error: grow::GrowError| vec![grow_diagnostic(source, &error)];
    let of = grow::GraphParams::of(params, solids).map_err(wrong)?;
    let mut key = GRAPH.key().params(&of);
    for file in grow::obstacle_files(params) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    cache.remember_here(key.finish(), grow::Graph::bytes, || {
        let meshes = obstacle_meshes(source, params, inputs)?;
        grow::Graph::new(&of, &meshes).map_err(wrong)
    })
}

/// Reads the meshes that stand in a source's way.
pub(super) fn obstacle_meshes(
    source: &Source,
    params: &GrowParams,
    inputs: &Inputs,
) -> Result<grow::ObstacleMeshes, Vec<Diagnostic>> {
    let read = |file: &String| {
        let input = &inputs[file];
        grow::obstacle_triangles(&input.bytes).map(|mesh| (file.clone(), mesh)).map_err(|error| {
            let error = Diagnostic::new(&input.shown, format!("the obstacle can't be read: {error}"))
                .with_hint("an obstacle is a GLB file: export it as binary glTF, or name another");
            asked_for(format!("sources[\"{}\"].obstacles", source.name), vec![error])
        })
    };
    let (meshes, errors): (Vec<_>, Vec<_>) = grow::obstacle_files(params).map(read).partition(Result::is_ok);
    let errors: Vec<Diagnostic> = errors.into_iter().filter_map(Result::err).flatten().collect();
    if errors.is_empty() { Ok(meshes.into_iter().flatten().collect()) } else { Err(errors) }
}

/// What is wrong with a species that did not grow.
fn grow_diagnostic(source: &Source, error: &grow::GrowError) -> Diagnostic {
    let hint = match error {
        grow::GrowError::OutOfRange { .. } => "the species file that the source names has this field",
        grow::GrowError::NoMesh(_) | grow::GrowError::BadMesh | grow::GrowError::OtherGraph => {
            "the source's `obstacles` name it"
        }
        grow::GrowError::Crowded { .. } => {
            "move it farther from the others; or, in its species file, lower the `out` of a point at which its trunk ends, or \
             raise `nodes`, which brings ways closer together"
        }
        grow::GrowError::Shape(_) => "the species file that the source names names it in turn",
        grow::GrowError::Nothing | grow::GrowError::Plant(_) => {
            "in the species file, widen the shapes that endpoints are taken from or raise `nodes`; obstacles and neighbours \
             of the source may stand in the way of its root"
        }
    };
    let mut field = format!("sources[\"{}\"]", source.name);
    // The first of a stand is a row like all others; one beside which others stand is the source itself.
    if let (grow::GrowError::Crowded { number, .. }, SourceRecipe::Grow(params)) = (error, &source.recipe)
        && params.space.company == Company::Kept
    {
        field += &format!(".trees[{}]", number - 1);
    }
    Diagnostic::new("", error.to_string()).with_field(field).with_hint(hint)
}

/// The field of a preset that a source is.
fn field(source: &Source) -> String {
    format!("sources[\"{}\"]", source.name)
}

/// What was mended in the sources, each under its source's field.
pub(super) fn mended(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Vec<Note> {
    let of = |(i, (source, made)): (usize, (&Source, &Arc<SourcePlant>))| {
        made.notes
            .iter()
            .filter_map(|note| wears::told(plan, i, note))
            .map(|message| Note::new(field(source), message))
            .collect::<Vec<_>>()
    };
    plan.sources.iter().zip(sources).enumerate().flat_map(of).collect()
}

/// The same, and the sources that nothing is made of.
pub(super) fn source_notes(plan: &Plan, sources: &[Arc<SourcePlant>]) -> Vec<Note> {
    let mut notes = mended(plan, sources);
    let unused = plan.sources.iter().zip(used(plan)).filter(|(_, used)| !used);
    let why = "no variant is made of it, nor does anything wear its leaves or bark: it was left out";
    notes.extend(unused.map(|(source, _)| Note::new(field(source), why)));
    notes
}

/// Makes or reads the pictures of leaves and bark, each by its own parameters: a new tint of leaves makes no bark.
pub(super) fn pictures(plan: &Plan, inputs: &Inputs, cache: &Cache) -> Result<Pictures, Vec<Diagnostic>> {
    let (leaves, bark) = rayon::join(|| leaf_pictures(plan, inputs, cache), || bark_picture(plan, inputs, cache));
    match (leaves, bark) {
        (Ok(leaves), Ok(bark)) => Ok(Pictures { leaves: leaves.0.clone(), bark: (*bark).clone() }),
        (Err(mut errors), bark) => {
            errors.extend(bark.err().into_iter().flatten());
            Err(errors)
        }
        (_, Err(errors)) => Err(errors),
    }
}

fn leaf_pictures(plan: &Plan, inputs: &Inputs, cache: &Cache) -> Result<Arc<LeafPictures>, Vec<Diagnostic>> {
    let pictures = u64::from(plan.dress.pictures);
    let edge = made_edge(plan, &plan.leaf_art);
    let mut key = PICTURES.key().number(plan.seed).number(pictures).params(&(&plan.leaf_art, edge));
    for file in leaf_files(plan) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    cache.remember(PICTURES, key.finish(), || {
        let seed = Seed::new(plan.seed).child("leaves");
        Ok(LeafPictures(match &plan.leaf_art {
            art @ LeafArt::Made { shape, variation, .. } => (0..u32::from(plan.dress.pictures))
                .into_par_iter()
                .map(|picture| {
                    // A new tint dyes what is drawn already.
                    let key = DRAWING.key().number(plan.seed).number(picture.into());
                    let key = key.params(&(shape, variation, edge)).finish();
                    let drawn = cache.remember_here(key, LeafPicture::weight, || {
                        Ok(LeafPicture::new(*shape, *variation, edge, picture, seed))
                    })?;
                    Ok(drawn.dyed(art.tint(picture)))
                })
                .collect::<Result<_, Vec<Diagnostic>>>()?,
            LeafArt::Files { color, normal, transmission } => {
                vec![user_maps(inputs, ArtUse::Leaf, [color, normal, "", transmission])?]
            }
        }))
    })
}

/// The edge of a made picture of leaves: no more than the atlas holds, where it would be made smaller. 0 of others.
pub(super) fn made_edge(plan: &Plan, art: &LeafArt) -> u32 {
    match art {
        LeafArt::Made { size, .. } => plan.atlas.inside((*size).min(plan.atlas.size)),
        LeafArt::Files { .. } => 0,
    }
}

fn bark_picture(plan: &Plan, inputs: &Inputs, cache: &Cache) -> Result<Arc<Maps>, Vec<Diagnostic>> {
    let mut key = BARK.key().number(plan.seed).params(&plan.bark_art);
    for file in bark_files(plan) {
        key = key.input(Key::of_bytes(&inputs[file].bytes));
    }
    cache.remember(BARK, key.finish(), || match &plan.bark_art {
        BarkArt::Made { pattern, color, size } => {
            Ok(bake::bark_maps(*pattern, *color, *size, Seed::new(plan.seed).child("bark")))
        }
        BarkArt::Files { color, normal, roughness } => user_maps(inputs, ArtUse::Bark, [color, normal, roughness, ""]),
    })
}

/// The pictures of leaves by slot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LeafPictures(pub(super) Vec<Maps>);

/// The files that the pictures of leaves are read from.
fn leaf_files(plan: &Plan) -> Vec<&String> {
    let LeafArt::Files { color, normal, transmission } = &plan.leaf_art else { return Vec::new() };
    [color, normal, transmission].into_iter().filter(|file| !file.is_empty()).collect()
}

/// The files that the bark is read from.
fn bark_files(plan: &Plan) -> Vec<&String> {
    let BarkArt::Files { color, normal, roughness } = &plan.bark_art else { return Vec::new() };
    [color, normal, roughness].into_iter().filter(|file| !file.is_empty()).collect()
}

/// Decodes pictures of the user's: colour, normal, roughness, transmission; an empty name is a map that was not given.
fn user_maps(inputs: &Inputs, usage: ArtUse, files: [&str; 4]) -> Result<Maps, Vec<Diagnostic>> {
    let bytes = |file: &str| inputs.get(file).map(|input| input.bytes.as_slice());
    let [color, normal, roughness, transmission] = files.map(bytes);
    let color = color.unwrap_or_default();
    let made = bake::maps_from_images(color, normal, roughness, transmission, usage, ArtLimits::default());
    made.map_err(|error| {
        let (map, file) = match error.file() {
            ArtFile::Color => ("color", files[0]),
            ArtFile::Normal => ("normal", files[1]),
            ArtFile::Roughness => ("roughness", files[2]),
            ArtFile::Transmission => ("transmission", files[3]),
        };
        let group = match usage {
            ArtUse::Leaf => "foliage.leaf",
            ArtUse::Bark => "bark.texture",
        };
        let shown = inputs.get(file).map_or(file, |input| input.shown.as_str());
        asked_for(format!("{group}.{map}"), vec![Diagnostic::new(shown, error.to_string()).with_hint(error.help())])
    })
}

/// Reads the user's pictures and forgets them.
pub(super) fn check_pictures(plan: &Plan, inputs: &Inputs) -> Result<(), Vec<Diagnostic>> {
    if let LeafArt::Files { color, normal, transmission } = &plan.leaf_art {
        user_maps(inputs, ArtUse::Leaf, [color, normal, "", transmission])?;
    }
    if let BarkArt::Files { color, normal, roughness } = &plan.bark_art {
        user_maps(inputs, ArtUse::Bark, [color, normal, roughness, ""])?;
    }
    Ok(())
}

/// Imports the scans and reads the shapes of species, and forgets them; what leaves and bark wear is there.
pub(super) fn check_imports(plan: &Plan, inputs: &Inputs) -> Result<(), Vec<Diagnostic>> {
    let checked: Vec<Result<Option<Arc<SourcePlant>>, Vec<Diagnostic>>> = plan
        .sources
        .par_iter()
        .map(|source| match &source.recipe {
            SourceRecipe::Like(like) => estimated(source, like, inputs).map(|_| None),
            SourceRecipe::Import(_) => one_source(source, inputs, &Cache::default()).map(Some),
            SourceRecipe::Grow(params) => {
                solids(source, params, inputs)?;
                obstacle_meshes(source, params, inputs).map(|_| None)
            }
        })
        .collect();
    let lacking = wardrobe::lacking(plan, |index| checked.get(index)?.as_ref().ok()?.as_ref());
    let errors: Vec<Diagnostic> = checked.into_iter().filter_map(Result::err).flatten().chain(lacking).collect();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// The sources that a variant is made of.
pub(super) fn ingredients(plan: &Plan, variant: &Variant) -> Vec<usize> {
    match variant {
        Variant::Source(index) => vec![*index],
        Variant::Blend { blend, .. } => plan.blends[*blend].of.clone(),
        Variant::Shape { shape, .. } => plan.shapes[*shape].of.clone(),
        Variant::Sketched { of, .. } => ingredients(plan, of),
        // Frames are made of dressed sources.
        Variant::Frame { .. } => Vec::new(),
        Variant::Selected { selection, .. } => {
            // The candidates of a selection are blends of the same sources.
            let first = plan.selections.get(*selection).and_then(|selection| selection.candidates.first());
            first.map_or_else(Vec::new, |candidate| ingredients(plan, candidate))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_leaves_are_told_only_where_they_are_worn() {
        let told = |foliage: &str| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.obj\"), \"b\": Import(file: \"b.obj\")}}, variants: [Source(\"a\")], \
                 foliage: ({foliage}))"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).expect("it loads");
            let notes = vec![format!("{}; name a leaf", foliage::WHITE), "1 stem beside the first".to_owned()];
            let white = Arc::new(SourcePlant::grown(Plant::default(), notes));
            let told = mended(&plan, &[white.clone(), white]);
            let of = |name: &str| told.iter().filter(|note| note.about == format!("sources[\"{name}\"]")).count();
            (of("a"), of("b"))
        };
        assert_eq!(told(""), (2, 2));
        assert_eq!(told("leaf: From(\"a\")"), (2, 1));
        for leaf in ["leaf: \"oak\"", "leaf: Files(color: \"leaf.png\")"] {
            assert_eq!(told(leaf), (1, 1), "{leaf}");
        }
    }

    #[test]
    fn a_source_that_nothing_is_made_of_is_told_and_left_out_unless_all_are_wanted() {
        const OAK: &str = "(height: 12.0, nodes: 4000, iterations: [(endpoints: Surface(k: 4, count: 30))])";
        let text = "(sources: {\"a\": Grow(species: \"oak.ron\"), \"b\": Grow(species: \"oak.ron\", seed: 2),
            \"c\": Grow(species: \"oak.ron\", seed: 3)}, variants: [Grow(of: \"a\", frames: 2), Source(\"c\")])";
        let loaded = crate::preset::load("set.ron", text, &mut |_| Ok(OAK.to_owned()));
        let plan = loaded.unwrap_or_else(|found| panic!("{found:?}"));
        let made = |wanted| {
            let made = sources(&plan, &Inputs::new(), &Cache::default(), wanted, &|_| {}).unwrap();
            let told = source_notes(&plan, &made).into_iter().filter(|note| note.message.contains("left out"));
            (
                made.iter().map(|source| !source.plant.chains().is_empty()).collect::<Vec<_>>(),
                told.map(|note| note.about).collect::<Vec<_>>(),
            )
        };
        assert_eq!(made(Wanted::Used), (vec![true, false, true], vec!["sources[\"b\"]".to_owned()]));
        assert_eq!(made(Wanted::All).0, [true; 3]);
    }

    #[test]
    fn fields_of_a_species_that_is_in_no_file_are_told_with_where_to_get_one() {
        let told = of_no_file("2 branches shed; raise `slenderness`".to_owned());
        assert!(
            told.ends_with("raise `slenderness` in the species file that `treewright estimate` writes of the scan")
        );
        assert_eq!(of_no_file("2 branches moved out of others".to_owned()), "2 branches moved out of others");
    }
}
