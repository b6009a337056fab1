//! The variants of a set: each entry of the list read by its kind, with what tells its trees from all others.

use std::collections::BTreeMap;

use super::blends::{self, Blended};
use super::morphs;
use super::pick::Wanted;
use super::plan::{BlendParams, MorphKind, MorphParams, Origin, Selection, ShapeParams, SketchParams, Source, Variant};
use super::reader::{Item, Reader, clip};
use super::set::VARIANT;
use super::shapes::{self, Shaped};
use super::sketches::{self, Drawn};
use super::syntax::Value;

/// Most variants of a set.
pub(super) const MOST_VARIANTS: usize = 4096;

/// What the variants of a preset are.
pub(super) struct Variants {
    pub(super) trees: Vec<Variant>,
    /// One a tree.
    pub(super) origins: Vec<Origin>,
    pub(super) blends: Vec<BlendParams>,
    pub(super) selections: Vec<Selection>,
    pub(super) shapes: Vec<ShapeParams>,
    pub(super) morphs: Vec<MorphParams>,
    pub(super) sketches: Vec<SketchParams>,
}

/// A variant, following a sketch where there is one.
fn followed(sketch: Option<usize>, of: Variant) -> Variant {
    match sketch {
        Some(sketch) => Variant::Sketched { sketch, of: Box::new(of) },
        None => of,
    }
}

/// The index of a sketch among all, and what tells it from others.
fn sketched(all: &mut Vec<SketchParams>, sketch: SketchParams) -> (usize, String) {
    let told = format!("{:?}", sketch.told());
    all.push(sketch);
    (all.len() - 1, told)
}

/// The frames of a sequence, each with what tells it from all others.
fn frames(all: &mut Vec<MorphParams>, params: MorphParams) -> Vec<(String, Variant)> {
    let mut alike = MorphParams { entry: 0, ..params.clone() };
    if let MorphKind::Sketch { sketch, .. } = &mut alike.kind {
        sketch.forget_fields();
    }
    let morph = all.len();
    let frame = |frame| (format!("{alike:?} {frame}"), Variant::Frame { morph, frame });
    let frames = (0..params.frames).map(frame).collect();
    all.push(params);
    frames
}

/// Reads the list of variants.
pub(super) fn variants(
    set: &Reader<'_, '_>,
    names: &BTreeMap<String, usize>,
    sources: &[Source],
    seed: u64,
) -> Variants {
    let names: Vec<&str> = names.keys().map(String::as_str).collect();
    let mut made = Variants {
        trees: Vec::new(),
        origins: Vec::new(),
        blends: Vec::new(),
        selections: Vec::new(),
        shapes: Vec::new(),
        morphs: Vec::new(),
        sketches: Vec::new(),
    };
    // Where each tree was made first, and by which kind of entry.
    let mut firsts: BTreeMap<String, (String, String)> = BTreeMap::new();
    for (entry, item) in set.list("variants").into_iter().enumerate() {
        if set.report().is_full() {
            break;
        }
        // The sketch that all trees of the entry follow.
        let mut on_all: Option<usize> = None;
        // The numbers of its trees, where it can decide about single ones.
        let mut numbers: Vec<usize> = Vec::new();
        // The trees, each with what tells it from all others, and which of them are kept.
        let read = set.kind(&VARIANT, &item, |kind, fields| {
            let Blended { blend, trees, numbers: of_trees, decided, wanted, count } = match kind {
                "Source" => {
                    let index = source(fields, &fields.item("of")?, &names)?;
                    return Some((vec![(index.to_string(), Variant::Source(index))], None));
                }
                "Geodesic" | "Mean" | "Symmetrize" | "Between" => {
                    let Shaped { shape, trees } = shapes::shaped(kind, entry, fields, &names, seed)?;
                    let alike = ShapeParams { entry: 0, ..shape.clone() };
                    let index = made.shapes.len();
                    made.shapes.push(shape);
                    let of = |shares| (format!("{alike:?} {shares:?}"), Variant::Shape { shape: index, shares });
                    return Some((trees.into_iter().map(of).collect(), None));
                }
                "Morph" | "Grow" => {
                    let read = if kind == "Morph" { morphs::morph } else { morphs::growth };
                    let params = read(entry, fields, &names)?;
                    return Some((frames(&mut made.morphs, params), None));
                }
                "Sketch" => {
                    return Some((
                        match sketches::sketch_of(entry, fields, &names)? {
                            Drawn::Tree(index, sketch) => {
                                let known = sketched(&mut made.sketches, sketch);
                                let of = Box::new(Variant::Source(index));
                                vec![(format!("{index} {}", known.1), Variant::Sketched { sketch: known.0, of })]
                            }
                            Drawn::Frames(params) => frames(&mut made.morphs, params),
                        },
                        None,
                    ));
                }
                "Mix" => blends::mix(entry, fields, &names, sources)?,
                "Explore" => blends::explore(entry, fields, &names, sources)?,
                _ => blends::blend(entry, fields, &names, sources)?,
            };
            numbers = of_trees;
            let alike = BlendParams { entry: 0, filter: None, ..blend.clone() };
            let index = made.blends.len();
            made.blends.push(blend);
            let sketch = sketches::of_all(fields).map(|sketch| sketched(&mut made.sketches, sketch));
            let shaped = sketch.as_ref().map_or("", |known| known.1.as_str());
            let of = |tree| (format!("{alike:?} {tree:?} {shaped}"), Variant::Blend { blend: index, tree });
            let selection = wanted.map(|Wanted { pick, scores, filter, candidates: _ }| {
                let field = fields.path().to_string();
                Selection { field, candidates: Vec::new(), keep: count as usize, decided, pick, scores, filter }
            });
            on_all = sketch.as_ref().map(|known| known.0);
            Some((trees.into_iter().map(of).collect(), selection))
        });
        let Some((trees, selection)) = read else { continue };
        let kept = selection.as_ref().map_or(trees.len(), |selection| selection.keep);
        if made.trees.len() + kept > MOST_VARIANTS {
            let message = format!("more than {MOST_VARIANTS} variants in all");
            set.report().at(item.span(), &item.path, message, "split the set");
            break;
        }
        for (key, _) in &trees {
            let own = (item.path.clone(), kind_of(&item).to_owned());
            if let Some((first, kind)) = firsts.insert(key.clone(), own) {
                let (message, hint) = if first == item.path {
                    ("makes the same tree twice".to_string(), "leave `batches` out, or part `from` and `to`")
                } else {
                    (format!("makes a tree that {first} makes too"), told_apart([kind_of(&item), &kind]))
                };
                set.report().at(item.span(), &item.path, message, hint);
                break;
            }
        }
        let trees = trees.into_iter().map(|(_, tree)| tree);
        let number = |place: usize| numbers.get(place).map(|n| n + 1).filter(|_| selection.is_none());
        made.origins.extend((0..kept).map(|place| Origin { entry, number: number(place) }));
        match selection {
            None => made.trees.extend(trees.map(|tree| followed(on_all, tree))),
            Some(selection) => {
                let index = made.selections.len();
                let kept = (0..selection.keep).map(|place| Variant::Selected { selection: index, place });
                made.trees.extend(kept.map(|tree| followed(on_all, tree)));
                made.selections.push(Selection { candidates: trees.collect(), ..selection });
            }
        }
    }
    made
}

/// Weights by sources' names, one for each of an entry's sources, 1 for those left out; empty where the field is absent.
pub(super) fn weights(
    fields: &Reader<'_, '_>,
    field: &str,
    entry: &str,
    of: &[usize],
    names: &[&str],
) -> Option<Vec<f32>> {
    let given = fields.shares(field);
    // What is wrong with the sources has been told.
    if of.is_empty() || !fields.has(field) {
        return Some(Vec::new());
    }
    let mut weights = vec![1.0; of.len()];
    let mut seen: Vec<usize> = Vec::new();
    for (name, item, share) in &given {
        let place = of.iter().position(|&s| names.get(s) == Some(&name.text.as_str()));
        match place {
            Some(place) if seen.contains(&place) => {
                fields.report().at(name.span, &item.path, "given twice", "add the two weights up");
            }
            Some(place) => {
                seen.push(place);
                weights[place] = *share;
            }
            None => {
                let own: Vec<String> = of.iter().map(|&s| format!("\"{}\"", clip(names[s]))).collect();
                let message = format!("\"{}\" is none of the {entry}'s sources", clip(&name.text));
                fields.report().at(name.span, &item.path, message, format!("`of` names {}", own.join(", ")));
            }
        }
    }
    if weights.iter().sum::<f32>() <= 0.0 {
        fields.fault(field, "all weights are zero", "give one of them");
        return None;
    }
    Some(weights)
}

/// The kind of a value, as its author wrote it.
pub(super) fn kind_of<'i>(item: &'i Item<'_>) -> &'i str {
    match &item.node.value {
        Value::Record(Some(name), _) | Value::Tuple(Some(name), _) => &name.text,
        Value::Name(name) => name,
        _ => "",
    }
}

/// What makes two entries differ that make the same tree; a geodesic's middle is the mean of its ends.
fn told_apart(kinds: [&str; 2]) -> &'static str {
    let either = |kind: &str| kinds.contains(&kind);
    if either("Geodesic") {
        "leave one of the two out, or take another number of `steps`: an odd one has the mean of both ends among them"
    } else if either("Mean") {
        "leave one of the two out, or give other `weights`"
    } else if either("Symmetrize") {
        "leave one of the two out, or give another `amount`"
    } else if either("Between") {
        "raise its `count`, or give it another `seed`"
    } else if either("Blend") || either("Mix") || either("Explore") {
        "raise a Blend's `count`, or give it another `seed`"
    } else {
        "leave one of the two out"
    }
}

/// The index of the source that `item` names.
pub(super) fn source(fields: &Reader<'_, '_>, item: &Item<'_>, names: &[&str]) -> Option<usize> {
    fields.reference(item, "source", names)
}
