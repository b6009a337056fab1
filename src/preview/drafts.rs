//! Trees that are in no set: variants and sources with edits that are not saved, mixes, sketches. Made in memory and
//! drawn.
//!
//! A workshop keeps a few presets open ([`Studio`]); the drag of a point in the pad then costs a blend, leaves, a
//! coarse mesh and a picture.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::scene::Wear;
use super::turntable::{self, Framing};
use crate::bake::{Picture, card_cuts};
use crate::base::{Diagnostic, Key, Seed};
use crate::build::{Cache, Focus, Limits, Studio, extent, load_edited};
use crate::lod::mesh_levels_on;
use crate::mesh::{CardCut, CardShape, Cards, CrownLight, TreeMesh, TubeDetail, all_cards, leaf_cards_in, tubes_in};
use crate::plant::Plant;
use crate::preset::plan::MeshParams;
use crate::preset::{Edit, edited};
use crate::sketch::{crown_outline, resampled};

/// Presets that are kept open at a time.
const MOST_OPEN: usize = 4;
/// Places of a silhouette.
const OUTLINE: usize = 160;
/// Most points of a drawn crown.
const MOST_POINTS: usize = 4000;
/// Most notes of a draft: they travel in the head of an answer.
const MOST_NOTES: usize = 24;
/// Farthest a drawn point may lie from the foot, metres.
const FARTHEST: f32 = 1000.0;

/// What is to be drawn.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draft {
    /// The preset's file.
    pub preset: String,
    /// Edits of files that the preset reads, or of itself, by their names relative to its folder.
    #[serde(default)]
    pub edits: BTreeMap<String, Vec<Change>>,
    /// Which tree.
    pub show: Show,
    /// Degrees.
    #[serde(default)]
    pub turn: f32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// How much time it may take.
    #[serde(default)]
    pub care: Care,
}

/// How well a draft is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Care {
    /// As a build would mesh it.
    #[default]
    Fine,
    /// Fewer sides, one sample a pixel: while something is dragged.
    Quick,
}

/// A change of one field.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// The field.
    pub path: String,
    /// Its value in RON; without one it is taken out.
    pub value: Option<String>,
}

impl Change {
    /// As an edit of the text.
    #[must_use]
    pub fn edit(&self) -> Edit {
        let path = self.path.clone();
        match self.value.clone() {
            Some(value) => Edit::Set { path, value },
            None => Edit::Remove { path },
        }
    }
}

/// Which tree a draft shows.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Show {
    /// A variant, from 0.
    Variant(usize),
    /// A source.
    Source(String),
    /// A mix: sources and their weights.
    Mix(Vec<(String, f32)>),
    /// A source whose crown follows a drawing.
    Sketch {
        /// The source.
        of: String,
        /// The closed outline in metres from the foot, x to the right, y up.
        points: Vec<[f32; 2]>,
    },
}

/// What a picture shows, for who draws over it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Facts {
    /// Branches.
    pub chains: usize,
    /// Leaves.
    pub leaves: usize,
    /// Metres.
    pub height: f32,
    /// Metres of a pixel.
    pub metres: f32,
    /// Height above the foot of the picture's middle, metres.
    pub middle: f32,
    /// What it took.
    pub milliseconds: f64,
    /// The silhouette of a source, where that was asked for: metres, x to the right, y up.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outline: Vec<[f32; 2]>,
    /// What a build would tell of the source, or of all sources where a variant is shown; the first of many.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A preset that is kept open.
struct Open {
    studio: Studio,
    wear: Wear,
    /// The outlines of its leaf pictures, where leaves are cut out.
    cuts: Vec<CardCut>,
    /// Height and reach of what its sources take, metres.
    extent: (f32, f32),
}

/// See the head of this file.
pub struct Workshop {
    cache: Arc<Cache>,
    limits: Limits,
    open: Mutex<Vec<(Key, Arc<Open>)>>,
    /// What presets without edits are, as long as no file is saved: a drag reads and compares nothing.
    known: Mutex<BTreeMap<String, Arc<Open>>>,
}

impl Workshop {
    /// A workshop with nothing open; what it grows is kept in the cache.
    #[must_use]
    pub fn new(cache: Arc<Cache>, limits: Limits) -> Self {
        Self { cache, limits, open: Mutex::default(), known: Mutex::default() }
    }

    /// Files were saved: presets are read again.
    pub fn saved(&self) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Makes and draws a tree: PNG, and what it shows.
    ///
    /// # Errors
    ///
    /// What is wrong with the preset and its edits, or with what was asked.
    pub fn draw(&self, preset: &Path, draft: &Draft) -> Result<(Vec<u8>, Facts), Vec<Diagnostic>> {
        let start = Instant::now();
        let wrong = |message: &str| vec![Diagnostic::new("", message)];
        let focus = match &draft.show {
            Show::Variant(_) => Focus::All,
            Show::Source(name) if !draft.edits.is_empty() => Focus::Source(name),
            _ => Focus::Sources,
        };
        let open = self.opened(preset, &draft.edits, focus)?;
        let studio = &open.studio;
        let index =
            |name: &str| studio.source_index(name).ok_or_else(|| wrong(&format!("there is no source \"{name}\"")));
        let mut outline = Vec::new();
        let plant: Arc<Plant> = match &draft.show {
            Show::Variant(place) => studio.variant(*place)?.ok_or_else(|| wrong("there is no such variant"))?,
            Show::Source(name) => {
                let plant = studio.source(index(name)?).ok_or_else(|| wrong("there is no such source"))?;
                if draft.care == Care::Fine {
                    // Millimetres of a few hundred places are more than is seen.
                    let round = |v: f32| (v * 1e3).round() / 1e3;
                    let ring: Vec<Vec2> = resampled(&crown_outline(&plant, 0.0), OUTLINE);
                    outline = ring.into_iter().map(|p| [round(p.x), round(p.y)]).collect();
                }
                plant
            }
            Show::Mix(of) => {
                let indices = of.iter().map(|(name, _)| index(name)).collect::<Result<Vec<_>, _>>()?;
                let weights: Vec<f32> = of.iter().map(|(_, weight)| *weight).collect();
                Arc::new(studio.mix(&indices, &weights)?)
            }
            Show::Sketch { of, points } => {
                let (svg, height) = crown_svg(points).ok_or_else(|| wrong("draw a closed outline above the ground"))?;
                Arc::new(studio.sketched(index(of)?, svg.as_bytes(), height)?)
            }
        };
        let tree = mesh(&plant, &studio.plan().mesh, &open.cuts, draft.care);
        let framing = Framing::around(&tree, draft.turn.to_radians(), draft.width, draft.height);
        let framing = match &draft.show {
            // The frame stays where it is while a point moves or a crown is drawn.
            Show::Mix(_) => within(framing, open.extent, 1.12),
            Show::Sketch { .. } => within(framing, open.extent, 1.35),
            Show::Source(_) if draft.edits.is_empty() => within(framing, open.extent, 1.35),
            _ => framing,
        };
        let samples = if draft.care == Care::Quick { 1 } else { 3 };
        let png = turntable::png(&turntable::draw(&tree, &open.wear, &framing, samples));
        let (metres, middle) = framing.scale();
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let (chains, leaves, height) = (plant.chains().len(), plant.leaves().len(), plant.height());
        let notes = notes(studio, &draft.show);
        Ok((png, Facts { chains, leaves, height, metres, middle, milliseconds, outline, notes }))
    }

    /// The preset with its edits, opened now or before.
    fn opened(
        &self,
        preset: &Path,
        edits: &BTreeMap<String, Vec<Change>>,
        focus: Focus<'_>,
    ) -> Result<Arc<Open>, Vec<Diagnostic>> {
        let about = match focus {
            Focus::All => "all".to_owned(),
            Focus::Sources => "sources".to_owned(),
            Focus::Source(name) => format!("source {name}"),
        };
        let name = format!("{about} {}", preset.display());
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if edits.is_empty()
            && let Some(found) = known().get(&name)
        {
            return Ok(found.clone());
        }
        let folder = preset.parent().unwrap_or(Path::new(""));
        let mut texts = BTreeMap::new();
        for (file, changes) in edits {
            let wrong = |message: String| vec![Diagnostic::new(file, message)];
            // Only what lies below the folder; names come from the page.
            let inside = !file.is_empty()
                && file.split('/').all(|part| !matches!(part, "" | "." | ".."))
                && !file.contains(['\\', ':'])
                && file.ends_with(".ron");
            let text = inside.then(|| std::fs::read_to_string(folder.join(file)).ok()).flatten();
            let text = text.ok_or_else(|| wrong("can't be read".to_owned()))?;
            let edits: Vec<Edit> = changes.iter().map(Change::edit).collect();
            texts.insert(file.clone(), edited(&text, &edits).map_err(|error| wrong(error.to_string()))?);
        }
        let loaded = load_edited(preset, &self.limits, texts)?;
        // What the plan names lies in files; their content is part of the key.
        let inputs = crate::build::pipeline::read_inputs(&loaded)?;
        let key =
            Key::stage("open", 1).params(&about).input(crate::build::pipeline::set_key(&loaded.plan, &inputs)).finish();
        let lock = || self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = lock().iter().find(|(known, _)| *known == key) {
            return Ok(known.clone());
        }
        let studio = Studio::open(&loaded, focus, self.cache.clone())?;
        let (leaves, bark) = studio.pictures();
        let wear = Wear { leaf: leaves.iter().map(Picture::new).collect(), bark: vec![Picture::new(bark)] };
        let extent = extent(studio.sources());
        let cuts = card_cuts(leaves, studio.plan().mesh.leaves);
        let made = Arc::new(Open { studio, wear, cuts, extent });
        let mut open = lock();
        if open.len() >= MOST_OPEN {
            open.remove(0);
        }
        open.push((key, made.clone()));
        if edits.is_empty() {
            let mut known = known();
            // As few as are kept open.
            if known.len() >= MOST_OPEN {
                known.pop_first();
            }
            known.insert(name, made.clone());
        }
        Ok(made)
    }
}

/// What a build would tell of what is shown; of mixes and drawings, which change while they are looked at, nothing.
fn notes(studio: &Studio, show: &Show) -> Vec<String> {
    let told = studio.notes().into_iter().filter_map(|note| match show {
        Show::Source(name) => (note.about == *name).then_some(note.message),
        Show::Variant(_) => Some(format!("{}: {}", note.about, note.message)),
        Show::Mix(_) | Show::Sketch { .. } => None,
    });
    told.take(MOST_NOTES).collect()
}

/// A frame that shows at least some height and reach, with air around.
fn within(framing: Framing, (top, reach): (f32, f32), air: f32) -> Framing {
    Framing { top: top * air, reach: reach * air, foot: 0.0, ..framing }
}

/// A plant's triangles.
fn mesh(plant: &Plant, params: &MeshParams, cuts: &[CardCut], care: Care) -> TreeMesh {
    if care == Care::Fine {
        let mut levels = mesh_levels_on(plant, params, Cards::of(params.leaves, cuts), &[], Seed::new(0));
        return levels.pop().unwrap_or_default();
    }
    let posed = plant.pose();
    let light = CrownLight::of(plant, &posed);
    let full = TubeDetail::full(&params.on(posed.extent()));
    let detail = TubeDetail { sides: full.sides.min(6), most_sides: 6, error: (full.error * 3.0).max(0.01), ..full };
    let (bark, leaf) = rayon::join(
        || tubes_in(plant, &posed, &light, &detail),
        || leaf_cards_in(plant, &posed, &light, &all_cards(plant), CardShape::Flat),
    );
    TreeMesh { bark, leaf }
}

/// A drawn crown as SVG, in metres, with a trunk that stands on the origin, and the height of all that it draws; none
/// for fewer than three points, too many, or points that are nowhere.
#[must_use]
pub fn crown_svg(points: &[[f32; 2]]) -> Option<(String, f32)> {
    let sound = |p: &[f32; 2]| p.iter().all(|v| v.is_finite() && v.abs() <= FARTHEST);
    if points.len() < 3 || points.len() > MOST_POINTS || !points.iter().all(sound) {
        return None;
    }
    // Nothing is drawn below the ground.
    let points: Vec<[f32; 2]> = points.iter().map(|p| [p[0], p[1].max(0.0)]).collect();
    let (mut left, mut right, mut low, mut high) = (0.0_f32, 0.0_f32, f32::INFINITY, 0.0_f32);
    for [x, y] in &points {
        (left, right, low, high) = (left.min(*x), right.max(*x), low.min(*y), high.max(*y));
    }
    if high - low < 0.05 {
        return None;
    }
    let number = |v: f32| {
        let text = format!("{:.3}", v + 0.0);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let path: Vec<String> = points.iter().map(|[x, y]| format!("{} {}", number(*x), number(-y))).collect();
    let half = (high * 0.01).max(0.01);
    let trunk_top = low.max(half);
    let (w, t) = (number(half), number(-trunk_top));
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {} {}\">\n  <!-- Metres; the tree stands at 0 0. -->\n  \
         <path id=\"crown\" fill=\"#4a7a4e\" d=\"M{}Z\"/>\n  <path id=\"trunk\" fill=\"#6b5138\" d=\"M-{w} 0L{w} 0L{w} {t}L-{w} {t}Z\"/>\n</svg>\n",
        number(left - 0.5),
        number(-high - 0.5),
        number(right - left + 1.0),
        number(high + 1.0),
        path.join("L"),
    );
    Some((svg, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Drawing;

    #[test]
    fn a_drawn_crown_is_an_svg_that_says_the_same_in_metres() {
        let points = [[-2.0, 1.0], [2.5, 1.0], [0.0, 6.0]];
        let (svg, height) = crown_svg(&points).unwrap();
        assert_eq!(height, 6.0);
        let drawing = Drawing::read(svg.as_bytes()).unwrap();
        let [low, high] = drawing.crown.bounds();
        assert!((high - low - Vec2::new(4.5, 5.0)).length() < 0.01, "{low} {high}");
        assert!(drawing.trunk.area() > 0.0 && (high.y - drawing.trunk.bounds()[0].y - 6.0).abs() < 0.01);
    }

    #[test]
    fn what_is_no_crown_is_refused() {
        let many = vec![[0.0, 1.0]; MOST_POINTS + 1];
        let flat = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
        for points in [Vec::new(), flat, vec![[f32::NAN, 1.0]; 4], vec![[1e9, 1.0]; 4], many] {
            assert!(crown_svg(&points).is_none());
        }
    }

    #[test]
    fn requests_are_read_as_the_page_writes_them() {
        let text = r#"{"preset": "a.ron", "edits": {"s.ron": [{"path": "height", "value": "7.0"}, {"path": "x"}]},
            "show": {"mix": [["a", 0.5], ["b", 0.5]]}, "turn": 30, "width": 300, "height": 400, "care": "quick"}"#;
        let draft: Draft = serde_json::from_str(text).unwrap();
        assert!(matches!(&draft.show, Show::Mix(of) if of.len() == 2) && draft.care == Care::Quick);
        assert_eq!(draft.edits["s.ron"][1].edit(), Edit::Remove { path: "x".into() });
        for wrong in ["{}", r#"{"preset": "a", "show": {"file": "/etc/passwd"}, "width": 1, "height": 1}"#] {
            assert!(serde_json::from_str::<Draft>(wrong).is_err());
        }
    }
}
