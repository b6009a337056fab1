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
use crate::build::{Cache, Focus, Limits, Studio, StudioStroke, extent, load_edited};
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
/// Most drawings over one another: one, and as many as a preset's `then` takes.
const MOST_STROKES: usize = 17;
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
    /// Degrees that the picture looks from: 0 from +z, 90 from +x.
    #[serde(default)]
    pub turn: f32,
    /// From how high, degrees: 0 is level, 90 straight down.
    #[serde(default)]
    pub elevation: f32,
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
        /// What was drawn before, each over what the one before gave.
        #[serde(default)]
        before: Vec<Stroke>,
        /// What is drawn over that; nothing yet where it has no points.
        #[serde(flatten)]
        stroke: Stroke,
    },
}

/// What is drawn over a tree.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Stroke {
    /// A closed outline of the crown, or a line that replaces a part of it: metres in the plane of the view, x to the
    /// right, y up in the picture, from where the foot is seen.
    pub points: Vec<[f32; 2]>,
    /// Whether it is such a line.
    #[serde(default)]
    pub open: bool,
    /// Azimuth that it is drawn from, degrees: 0 looks from +z.
    #[serde(default)]
    pub view: f32,
    /// Elevation that it is drawn from, degrees: 0 is level, 90 straight down.
    #[serde(default)]
    pub elevation: f32,
}

impl Stroke {
    /// Azimuth and elevation, radians.
    #[must_use]
    pub fn direction(&self) -> [f32; 2] {
        [self.view, self.elevation].map(f32::to_radians)
    }
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
    /// How far up in the picture its middle is from where the foot is seen, metres.
    pub middle: f32,
    /// What it took.
    pub milliseconds: f64,
    /// The silhouette of what is drawn over, from where the picture looks, drawn with care: metres, x to the right, y up.
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
        let [azimuth, elevation] = [draft.turn, draft.elevation.clamp(-90.0, 90.0)].map(f32::to_radians);
        let plant: Arc<Plant> = match &draft.show {
            Show::Variant(place) => studio.variant(*place)?.ok_or_else(|| wrong("there is no such variant"))?,
            Show::Source(name) => {
                let plant = studio.source(index(name)?).ok_or_else(|| wrong("there is no such source"))?;
                if draft.care == Care::Fine {
                    outline = silhouette(&plant, azimuth, elevation);
                }
                plant
            }
            Show::Mix(of) => {
                let indices = of.iter().map(|(name, _)| index(name)).collect::<Result<Vec<_>, _>>()?;
                let weights: Vec<f32> = of.iter().map(|(_, weight)| *weight).collect();
                Arc::new(studio.mix(&indices, &weights)?)
            }
            Show::Sketch { of, before, stroke } => {
                let source = index(of)?;
                let all = before.iter().chain((!stroke.points.is_empty()).then_some(stroke));
                let strokes = stroke_svgs(all).map_err(wrong)?;
                let strokes: Vec<StudioStroke<'_>> = strokes
                    .iter()
                    .map(|(stroke, svg, height)| StudioStroke {
                        svg: svg.as_bytes(),
                        from: stroke.direction(),
                        height: *height,
                    })
                    .collect();
                if draft.care == Care::Fine {
                    outline = silhouette(&*studio.sketched(source, &strokes[..before.len()])?, azimuth, elevation);
                }
                studio.sketched(source, &strokes)?
            }
        };
        let tree = mesh(&plant, &studio.plan().mesh, &open.cuts, draft.care);
        let framing = Framing::around(&tree, azimuth, elevation, draft.width, draft.height);
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
        Show::Source(name) => (note.about == format!("sources[\"{name}\"]")).then_some(note.message),
        Show::Variant(_) => Some(format!("{}: {}", note.about, note.message)),
        Show::Mix(_) | Show::Sketch { .. } => None,
    });
    told.take(MOST_NOTES).collect()
}

/// The silhouette of a crown in millimetres: of a few hundred places that is more than is seen.
fn silhouette(plant: &Plant, azimuth: f32, elevation: f32) -> Vec<[f32; 2]> {
    let round = |v: f32| (v * 1e3).round() / 1e3;
    let ring = resampled(&crown_outline(plant, azimuth, elevation), OUTLINE);
    ring.into_iter().map(|p| [round(p.x), round(p.y)]).collect()
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

/// Strokes, each as SVG and with its height.
///
/// # Errors
///
/// Those of [`stroke_svg`], and where there are too many.
pub(super) fn stroke_svgs<'s>(
    strokes: impl Iterator<Item = &'s Stroke>,
) -> Result<Vec<(&'s Stroke, String, f32)>, &'static str> {
    let svg = |stroke: &'s Stroke| stroke_svg(stroke).map(|(svg, height)| (stroke, svg, height));
    let all: Vec<_> = strokes.take(MOST_STROKES + 1).map(svg).collect::<Result<_, _>>()?;
    if all.len() > MOST_STROKES { Err("no more than 17 drawings lie over one another") } else { Ok(all) }
}

/// What is drawn as SVG in metres, and the height that a `Metres` in the preset places it by. A closed outline in a level
/// view gets a trunk that stands on the origin, all else a mark where the foot is seen: that is where it then lies again.
///
/// # Errors
///
/// One sentence: fewer than three points, too many, points that are nowhere, or no such shape.
pub fn stroke_svg(stroke: &Stroke) -> Result<(String, f32), &'static str> {
    let Stroke { points, open, view, elevation } = stroke;
    let level = *elevation == 0.0;
    let shape = match (open, level) {
        (true, _) => "draw a line along the crown, whose ends lie apart",
        (false, true) => "draw a closed outline above the ground",
        (false, false) => "draw a closed outline",
    };
    let sound = |p: &[f32; 2]| p.iter().all(|v| v.is_finite() && v.abs() <= FARTHEST);
    if points.len() < 3 || points.len() > MOST_POINTS || !points.iter().all(sound) {
        return Err(shape);
    }
    if !(view.abs() <= 360.0 && elevation.abs() <= 90.0) {
        return Err("look from -360 to 360 degrees, and from -90 to 90 degrees high");
    }
    // In a level view nothing is drawn below the ground; seen from above, what lies near is low in the picture.
    let ground = if level { 0.0 } else { f32::NEG_INFINITY };
    let points: Vec<Vec2> = points.iter().map(|p| Vec2::new(p[0], p[1].max(ground))).collect();
    let (low, high) = points.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    if !open && high.y - low.y < 0.05 {
        return Err(shape);
    }
    let length: f32 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    // What nearly closes is read as closed.
    if *open && (length < 0.05 || points[0].distance(points[points.len() - 1]) < length * 0.2) {
        return Err(shape);
    }
    let number = |v: f32| {
        let text = format!("{:.3}", v + 0.0);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    // The preset tells hundredths.
    let hundredths = |v: f32| (v * 100.0).round() / 100.0;
    let path: Vec<String> = points.iter().map(|p| format!("{} {}", number(p.x), number(-p.y))).collect();
    let path = path.join("L");
    // The foot is always on the canvas.
    let (left, right, bottom, top) =
        (low.x.min(0.0) - 0.5, high.x.max(0.0) + 0.5, low.y.min(0.0), high.y.max(0.0) + 0.5);
    let bottom = if level && !open { 0.0 } else { bottom - 0.5 };
    let tall = hundredths(top - bottom);
    let half = (high.y.max(high.y - low.y) * 0.01).max(0.01);
    let mark = number(half);
    let view = format!("{} {} {} {}", number(left), number(-bottom - tall), number(right - left), number(tall));
    let (comment, crown, stands, height) = if *open {
        let wide = number(half);
        let line =
            format!("<path id=\"crown\" fill=\"none\" stroke=\"#4a7a4e\" stroke-width=\"{wide}\" d=\"M{path}\"/>");
        ("Metres; the tree's foot is at 0 0.", line, None, tall)
    } else {
        let area = format!("<path id=\"crown\" fill=\"#4a7a4e\" d=\"M{path}Z\"/>");
        let trunk_top = number(-low.y.max(half));
        let trunk = format!(
            "<path id=\"trunk\" fill=\"#6b5138\" d=\"M-{mark} 0L{mark} 0L{mark} {trunk_top}L-{mark} {trunk_top}Z\"/>"
        );
        let comment = if level { "Metres; the tree stands at 0 0." } else { "Metres; the tree's foot is at 0 0." };
        (comment, area, level.then_some(trunk), if level { high.y } else { high.y - low.y })
    };
    let stands = stands.unwrap_or_else(|| format!("<circle id=\"foot\" fill=\"#6b5138\" r=\"{mark}\"/>"));
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{view}\">\n  <!-- {comment} -->\n  {crown}\n  {stands}\n</svg>\n"
    );
    Ok((svg, hundredths(height)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Drawing;

    #[test]
    fn a_drawn_crown_is_an_svg_that_says_the_same_in_metres() {
        let points = vec![[-2.0, 1.0], [2.5, 1.0], [0.0, 6.0]];
        let (svg, height) = stroke_svg(&Stroke { points, ..Stroke::default() }).unwrap();
        assert_eq!(height, 6.0);
        let drawing = Drawing::read(svg.as_bytes()).unwrap();
        let [low, high] = drawing.crown.bounds();
        assert!((high - low - Vec2::new(4.5, 5.0)).length() < 0.01, "{low} {high}");
        assert!(drawing.trunk.area() > 0.0 && (high.y - drawing.trunk.bounds()[0].y - 6.0).abs() < 0.01);
    }

    #[test]
    fn what_is_no_crown_is_refused() {
        let one = Stroke { points: vec![[-2.0, 1.0], [2.5, 1.0], [0.0, 6.0]], ..Stroke::default() };
        let many = vec![one; MOST_STROKES + 1];
        assert!(
            stroke_svgs(many[1..].iter()).is_ok_and(|all| all.len() == MOST_STROKES)
                && stroke_svgs(many.iter()).is_err()
        );
        let many = vec![[0.0, 1.0]; MOST_POINTS + 1];
        let flat = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
        for points in [Vec::new(), flat, vec![[f32::NAN, 1.0]; 4], vec![[1e9, 1.0]; 4], many] {
            for (open, elevation) in [(false, 0.0), (true, 0.0), (false, 40.0)] {
                let flat = points.len() == 3 && open;
                let stroke = Stroke { points: points.clone(), open, elevation, ..Stroke::default() };
                assert!(stroke_svg(&stroke).is_err() || flat);
            }
        }
        let ring = vec![[-1.0, 2.0], [1.0, 2.0], [0.0, 4.0], [-1.0, 2.1]];
        assert!(stroke_svg(&Stroke { points: ring.clone(), open: true, ..Stroke::default() }).is_err());
        assert!(stroke_svg(&Stroke { points: ring, elevation: 91.0, ..Stroke::default() }).is_err());
    }

    #[test]
    fn what_is_drawn_from_above_or_as_a_line_marks_the_foot_and_says_the_same_in_metres() {
        let points = vec![[-2.0, -1.0], [2.5, -1.5], [0.5, 3.237]];
        for (open, elevation) in [(true, 0.0), (true, 30.0), (false, 30.0), (false, 90.0)] {
            let stroke = Stroke { points: points.clone(), open, elevation, ..Stroke::default() };
            let (svg, height) = stroke_svg(&stroke).unwrap();
            let drawing = Drawing::read(svg.as_bytes()).unwrap();
            let foot = drawing.foot.unwrap();
            assert!(drawing.is_open() == open && drawing.trunk.area() == 0.0);
            let ground = if elevation == 0.0 { 0.0 } else { f32::NEG_INFINITY };
            if open {
                assert!((drawing.canvas[1].y - drawing.canvas[0].y - height).abs() < 1e-4);
                for (p, drawn) in points.iter().zip(&drawing.open) {
                    assert!((*drawn - foot).distance(Vec2::new(p[0], p[1].max(ground))) < 0.002);
                }
            } else {
                let [low, high] = drawing.crown.bounds();
                assert!((low - foot).distance(Vec2::new(-2.0, -1.5)) < 0.002 && (high.y - low.y - height).abs() < 0.01);
            }
        }
    }

    #[test]
    fn requests_are_read_as_the_page_writes_them() {
        let text = r#"{"preset": "a.ron", "edits": {"s.ron": [{"path": "height", "value": "7.0"}, {"path": "x"}]},
            "show": {"mix": [["a", 0.5], ["b", 0.5]]}, "turn": 30, "elevation": 20, "width": 300, "height": 400, "care": "quick"}"#;
        let draft: Draft = serde_json::from_str(text).unwrap();
        assert!(matches!(&draft.show, Show::Mix(of) if of.len() == 2) && draft.care == Care::Quick);
        assert_eq!(draft.edits["s.ron"][1].edit(), Edit::Remove { path: "x".into() });
        let text = r#"{"preset": "a.ron", "show": {"sketch": {"of": "a", "points": [[0, 1]], "open": true, "elevation": 30}},
            "width": 300, "height": 400}"#;
        let draft: Draft = serde_json::from_str(text).unwrap();
        let drawn = Stroke { points: vec![[0.0, 1.0]], open: true, view: 0.0, elevation: 30.0 };
        assert!(
            matches!(&draft.show, Show::Sketch { of, before, stroke } if of == "a" && before.is_empty() && *stroke == drawn)
        );
        let over = r#"{"preset": "a.ron", "show": {"sketch": {"of": "a", "points": [], "before": [{"points": [[0, 1]],
            "open": true, "elevation": 30}]}}, "width": 300, "height": 400}"#;
        let draft: Draft = serde_json::from_str(over).unwrap();
        assert!(
            matches!(&draft.show, Show::Sketch { before, stroke, .. } if *before == [drawn] && stroke.points.is_empty())
        );
        for wrong in ["{}", r#"{"preset": "a", "show": {"file": "/etc/passwd"}, "width": 1, "height": 1}"#] {
            assert!(serde_json::from_str::<Draft>(wrong).is_err());
        }
    }
}
