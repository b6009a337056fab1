//! A preset's trees one at a time, in memory: for pages and editors that show a tree before any file is made.
//!
//! A studio holds what a set is made from, in correspondence; it makes the trees of the plan, and trees that the plan
//! does not name yet: mixes at any weights, sources that follow a drawing. Such a tree is, leaf for leaf, the one that
//! a build makes once the preset names it.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::blends;
use super::cache::Cache;
use super::find::Loaded;
use super::pipeline::{self, Prepared};
use super::selections::{self, Selected};
use super::stages::{self, Wanted};
use super::trees::Trees;
use crate::bake::Maps;
use crate::base::{Diagnostic, Key, Note, Seed, once};
use crate::blend;
use crate::plant::{ChainId, Plant, Posed};
use crate::preset::Plan;
use crate::preset::plan::{
    BlendParams, BlendScale, BlendTree, FilterParams, MatchParams, OnlyParams, RadiusRule, StemRule, Variant, Wear,
};
use crate::relate::{self, Family};
use crate::select::{self, Habits};
use crate::sketch::{Drawing, Sketch, SketchSize, SketchViews, Sketcher, ViewKind};

/// The weights of the matching that a preset means where it gives none.
const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
/// Most families and bound sources that are kept.
const MOST_KEPT: usize = 8;

/// How much of a preset is looked at: what is left out need not be grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Focus<'a> {
    /// All of it.
    All,
    /// The sources, as they are and mixed; none of the variants.
    Sources,
    /// One source.
    Source(&'a str),
}

/// What is drawn over a tree.
#[derive(Clone, Copy, Debug)]
pub struct StudioStroke<'s> {
    /// As SVG.
    pub svg: &'s [u8],
    /// Azimuth and elevation that it is drawn from, radians, as in [`SketchViews`].
    pub from: [f32; 2],
    /// Its height, metres.
    pub height: f32,
}

/// What is kept by the sources that it is made of, and what was drawn on them, and the view that these are drawn on from.
type Kept<T> = Mutex<Vec<(Vec<usize>, Arc<T>)>>;

/// See the head of this file.
pub struct Studio {
    plan: Plan,
    prepared: Prepared,
    selected: OnceLock<Result<Selected, Vec<Diagnostic>>>,
    cache: Arc<Cache>,
    families: Kept<(Family, Habits)>,
    sketchers: Kept<Sketcher>,
}

impl std::fmt::Debug for Studio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Studio").field("set", &self.plan.name).finish_non_exhaustive()
    }
}

impl Studio {
    /// Grows or imports the sources, makes the pictures, and finds correspondences; what the cache holds is taken.
    ///
    /// # Errors
    ///
    /// All that is wrong, with the preset's name and places.
    pub fn open(loaded: &Loaded, focus: Focus<'_>, cache: Arc<Cache>) -> Result<Self, Vec<Diagnostic>> {
        let mut plan = loaded.plan.clone();
        if focus != Focus::All {
            plan.variants.clear();
            plan.origins.clear();
            plan.blends.clear();
            plan.selections.clear();
            plan.shapes.clear();
            plan.morphs.clear();
            plan.sketches.clear();
        }
        if let Focus::Source(name) = focus {
            // Who wears what another source brings needs that as well.
            let alone = !matches!((plan.leaf_wear, plan.bark_wear), (Wear::Source(_), _) | (_, Wear::Source(_)));
            if alone && plan.sources.iter().any(|source| source.name == name) {
                plan.sources.retain(|source| source.name == name);
            }
        }
        let inputs = pipeline::read_inputs(loaded)?;
        let prepared =
            pipeline::prepared(&plan, &inputs, &cache, Wanted::All, &|_| {}).map_err(|errors| loaded.placed(errors))?;
        Ok(Self {
            plan,
            prepared,
            selected: OnceLock::new(),
            cache,
            families: Mutex::default(),
            sketchers: Mutex::default(),
        })
    }

    /// The plan, as far as the focus left it.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The pictures that leaves wear, by slot, and the bark.
    #[must_use]
    pub fn pictures(&self) -> (&[Maps], &Maps) {
        let pictures = &self.prepared.wardrobe.pictures;
        (&pictures.leaves, &pictures.bark)
    }

    /// The index of a source; none for a name that is none.
    #[must_use]
    pub fn source_index(&self, name: &str) -> Option<usize> {
        self.plan.sources.iter().position(|source| source.name == name)
    }

    /// The sources, bare or with the leaves that they bring.
    #[must_use]
    pub fn sources(&self) -> &[Plant] {
        &self.prepared.wardrobe.plants
    }

    /// What was mended in the sources, each under its source's name, as a build tells it.
    #[must_use]
    pub fn notes(&self) -> Vec<Note> {
        stages::mended(&self.plan, &self.prepared.sources)
    }

    fn trees(&self) -> Trees<'_> {
        Trees::new(&self.plan, &self.prepared.wardrobe, &self.cache, &self.prepared.sketches)
    }

    /// A variant of the plan with its leaves; none beyond the last.
    ///
    /// # Errors
    ///
    /// When a selection selects nothing.
    pub fn variant(&self, place: usize) -> Result<Option<Arc<Plant>>, Vec<Diagnostic>> {
        let Prepared { wardrobe, morphs, blended, .. } = &self.prepared;
        let Some(variant) = self.plan.variants.get(place) else { return Ok(None) };
        let selected = once(&self.selected, || selections::selected(&self.plan, blended));
        let selected = selected.as_ref().map_err(Clone::clone)?;
        let (_, seed) = blends::identity(&self.plan, variant, selected);
        let bare = blends::variant(&self.plan, variant, &wardrobe.plants, blended, selected, morphs);
        let trees = self.trees();
        Ok(Some(trees.shaped(variant, trees.dressed(variant, bare, seed.child("dress"))).0))
    }

    /// A source with its leaves, as the variant `Source` of it is; none for an index that is none.
    #[must_use]
    pub fn source(&self, index: usize) -> Option<Arc<Plant>> {
        let bare = self.prepared.wardrobe.plants.get(index)?.clone();
        let variant = Variant::Source(index);
        let recipe = serde_json::json!({ "source": self.plan.sources[index].name });
        Some(self.trees().dressed(&variant, bare, self.seed(&recipe).child("dress")))
    }

    /// A mix of some sources with its leaves, as a `Mix` of them at these weights is.
    ///
    /// # Errors
    ///
    /// When the sources can't be blended, or there are fewer than two, or all weights are zero.
    pub fn mix(&self, of: &[usize], weights: &[f32]) -> Result<Plant, Vec<Diagnostic>> {
        let wrong = |message: &str| vec![Diagnostic::new("", message)];
        let weights: Vec<f32> = weights.iter().map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 }).collect();
        let sum: f32 = weights.iter().sum();
        let known = of.iter().all(|&s| s < self.plan.sources.len());
        if of.len() < 2 || of.len() != weights.len() || !known || sum <= 0.0 {
            return Err(wrong("a mix needs two sources and more, a weight for each, and not all of them zero"));
        }
        let shares: Vec<f32> = weights.iter().map(|w| w / sum).collect();
        let matched = self.family(of)?;
        let (family, habits) = &*matched;
        let params = BlendParams {
            entry: 0,
            of: of.to_vec(),
            matching: MATCHING,
            stems: StemRule::Apart,
            scale: BlendScale::Chain,
            radii: RadiusRule::Corrected,
            only: OnlyParams::default(),
            filter: Some(FilterParams::CLEARED),
        };
        let tree = BlendTree::Point { shares: shares.clone(), scatter: 0.0, draw: 0 };
        let seed = self.seed(&blends::blend_identity(&self.plan, &params, &tree));
        let (plant, kins) = family.blend_with_kins(&blend::whole_stems(family, blend::mix(family, &shares)));
        let plant = blend::within(plant, family.sources());
        let found = select::collisions(&plant, &Posed::of_bearers(&plant), &kins, habits, &FilterParams::CLEARED);
        let gone: Vec<ChainId> = found.iter().map(|collision| collision.goes).collect();
        let bare = select::without(&plant, &gone);
        Ok(self.prepared.wardrobe.dressing_of(&self.plan, of).dress(bare, seed.child("dress")))
    }

    /// A source whose crown follows drawings, each over the tree that the one before gives, as a `Sketch` of the first with all
    /// others in its `then` is, each with its view and the size `Metres`.
    ///
    /// # Errors
    ///
    /// When a drawing can't be read, has a trunk in a raised view, or the source has no crown.
    pub fn sketched(&self, source: usize, strokes: &[StudioStroke<'_>]) -> Result<Arc<Plant>, Vec<Diagnostic>> {
        let wrong = |message: String| vec![Diagnostic::new("", message)];
        let Some((last, before)) = strokes.split_last() else {
            return self.source(source).ok_or_else(|| wrong("there is no such source".to_owned()));
        };
        let drawing = Drawing::read(last.svg).map_err(|error| wrong(format!("the drawing {error}")))?;
        // What it is drawn over, from where.
        let mut over = vec![source];
        for stroke in before {
            over.extend(Key::of_bytes(stroke.svg).bytes().map(usize::from));
            over.extend([stroke.height, stroke.from[0], stroke.from[1]].map(|told| told.to_bits() as usize));
        }
        over.extend(last.from.map(|angle| angle.to_bits() as usize));
        let sketcher = kept(&self.sketchers, &over, || {
            let kind = if before.is_empty() { ViewKind::Front } else { ViewKind::FrontKept };
            let [azimuth, elevation] = last.from;
            let views = SketchViews { azimuth, elevation, kind, detail: 0.5 };
            Sketcher::bind(self.sketched(source, before)?, views).map_err(|error| wrong(error.to_string()))
        })?;
        let sketch = Sketch { size: SketchSize::Metres(last.height), ..Sketch::of(&drawing) };
        let made = sketcher.draw(&sketch).map_err(|error| wrong(format!("the drawing {error}")))?;
        Ok(Arc::new(made.at(1.0)))
    }

    /// The sources in correspondence, and how they run into themselves.
    fn family(&self, of: &[usize]) -> Result<Arc<(Family, Habits)>, Vec<Diagnostic>> {
        kept(&self.families, of, || {
            let plants = of.iter().map(|&s| self.prepared.wardrobe.plants[s].clone()).collect();
            let family = Family::at_one_size(plants, |plants| relate::nway_family(plants, &MATCHING))
                .map_err(|error| vec![Diagnostic::new("", format!("these sources can't be blended: {error}"))])?;
            let habits = Habits::of(&family, &FilterParams::CLEARED);
            Ok((family, habits))
        })
    }

    /// The seed of a tree by what it is.
    fn seed(&self, recipe: &serde_json::Value) -> Seed {
        Seed::new(self.plan.seed).child("variant").child(&recipe.to_string())
    }
}

/// What is kept for some sources, or made now.
fn kept<T>(
    all: &Kept<T>,
    of: &[usize],
    make: impl FnOnce() -> Result<T, Vec<Diagnostic>>,
) -> Result<Arc<T>, Vec<Diagnostic>> {
    let lock = || all.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, found)) = lock().iter().find(|(known, _)| known == of) {
        return Ok(found.clone());
    }
    let made = Arc::new(make()?);
    let mut all = lock();
    if all.len() >= MOST_KEPT {
        all.remove(0);
    }
    all.push((of.to_vec(), made.clone()));
    Ok(made)
}

/// The height of the tallest of some plants and their reach to the sides, metres.
#[must_use]
pub fn extent(plants: &[Plant]) -> (f32, f32) {
    plants.iter().fold((0.1, 0.1), |(top, reach), plant| {
        let posed = plant.pose();
        let far = posed.positions().iter().fold(reach, |far: f32, p| far.max((p.x * p.x + p.z * p.z).sqrt()));
        (top.max(plant.height()), far)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::load_preset;

    #[test]
    fn what_a_studio_makes_is_what_the_preset_means() {
        let folder = tempfile::tempdir().unwrap();
        let oak = "(height: 6.0, nodes: 2000, iterations: [(endpoints: Volume(shape: Point(height: 0.5), count: 1)), (endpoints: Surface(k: 4, count: 60))])";
        std::fs::write(folder.path().join("oak.ron"), oak).unwrap();
        let preset = folder.path().join("a.ron");
        let text = "(sources: {\"a\": Grow(species: \"oak.ron\", seed: 1), \"b\": Grow(species: \"oak.ron\", seed: 2)}, \
            variants: [Source(\"b\"), Mix(of: {\"a\": 3, \"b\": 1}), Sketch(of: \"a\", crown: \"c.svg\", size: Metres(5.0)), \
            Sketch(of: \"a\", crown: \"d.svg\", view: 40.0, elevation: 35.5, size: Metres(7.25)), \
            Sketch(of: \"a\", crown: \"c.svg\", size: Metres(5.0), then: [(crown: \"d.svg\", view: 40.0, elevation: 35.5, \
            size: Metres(7.25)), (crown: \"c.svg\", view: 90.0, size: Metres(4.0))])])";
        std::fs::write(&preset, text).unwrap();
        let svg: &[u8] = b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='-2 -5 4 5'><path d='M-2 -1L2 -1L0 -5Z'/>\
            <path id='trunk' d='M-.1 0L.1 0L.1 -1L-.1 -1Z'/></svg>";
        std::fs::write(folder.path().join("c.svg"), svg).unwrap();
        let line: &[u8] = b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='-3 -6 6 7.25'><circle id='foot' r='.1'/>\
            <path fill='none' stroke='#000' d='M0 -5L2 -5L3 -3L1 -2'/></svg>";
        std::fs::write(folder.path().join("d.svg"), line).unwrap();
        let loaded = load_preset(&preset).unwrap_or_else(|found| panic!("{found:?}"));
        let cache = Arc::new(Cache::default());
        let studio = Studio::open(&loaded, Focus::All, cache.clone()).unwrap();
        let of = |place| (*studio.variant(place).unwrap().unwrap()).clone();
        assert_eq!(*studio.source(1).unwrap(), of(0));
        assert!(studio.mix(&[0, 1], &[0.75, 0.25]).unwrap() == of(1));
        let stroke =
            |svg: &'static [u8], from: [f32; 2], height| StudioStroke { svg, from: from.map(f32::to_radians), height };
        let drawn = |strokes: &[StudioStroke<'_>]| (*studio.sketched(0, strokes).unwrap()).clone();
        let (front, above) = (stroke(svg, [0.0; 2], 5.0), stroke(line, [40.0, 35.5], 7.25));
        assert!(drawn(&[]) == *studio.source(0).unwrap() && drawn(&[front]) == of(2));
        assert!(drawn(&[above]) == of(3) && of(3) != drawn(&[stroke(line, [0.0; 2], 7.25)]));
        // One after another, whatever is kept.
        let beside = stroke(svg, [90.0, 0.0], 4.0);
        for _ in 0..2 {
            assert!(drawn(&[front, above, beside]) == of(4) && drawn(&[front, above]) != of(4));
        }
        assert!(drawn(&[above, front, beside]) != of(4));
        assert!(studio.sketched(0, &[stroke(svg, [40.0, 35.5], 5.0)]).is_err() && studio.sketched(7, &[]).is_err());
        assert!(studio.variant(9).unwrap().is_none());
        assert!(studio.mix(&[0], &[1.0]).is_err() && studio.mix(&[0, 1], &[0.0, 0.0]).is_err());
        assert!(studio.mix(&[0, 7], &[1.0, 1.0]).is_err());
        let sources = Studio::open(&loaded, Focus::Sources, cache.clone()).unwrap();
        assert!(sources.mix(&[0, 1], &[0.75, 0.25]).unwrap() == of(1));
        let one = Studio::open(&loaded, Focus::Source("b"), cache).unwrap();
        assert_eq!(*one.source(0).unwrap(), of(0));
    }
}
