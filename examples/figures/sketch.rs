//! Figures of sketching: likeness to silhouettes, shape along the way, naturalness, speed, an unchanged identity.

use std::fmt::Write as _;
use std::hint::black_box;
use std::sync::Arc;

use glam::Vec2;
use rayon::prelude::*;
use treewright::base::Seed;
use treewright::blend::{Pace, morph};
use treewright::dress::dress;
use treewright::plant::{Plant, PlantStats};
use treewright::preset::plan::{DressParams, MatchParams};
use treewright::relate::{PatternParams, pattern_family};
use treewright::sketch::{
    Drawing, Method, Sketch, SketchViews, Sketched, Sketcher, ViewKind, crown_outline, crown_silhouette,
    discrete_frechet, overlap, resampled,
};

use crate::leafy::{foliage, imported, leafy};
use crate::table_1::source;
use crate::{Figure, data, root, seconds};

const MATCHING: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
const SHAPES: [&str; 8] = ["heart", "egg", "droplet", "spade", "cloud", "triangle", "oval", "baobab"];
const FRONT: SketchViews = SketchViews { azimuth: 0.0, elevation: 0.0, kind: ViewKind::Front, detail: 0.7 };
/// Gaps that are closed on either side, over the crown's size, where silhouettes are compared.
const CLOSE: f32 = 0.03;

/// What is measured.
const PARTS: [(&str, fn()); 7] = [
    ("likeness", likeness),
    ("silhouettes", every_silhouette),
    ("sparse", sparse),
    ("views", views),
    ("along", along_the_way),
    ("identity", identity),
    ("speed", speed),
];

/// Prints them; SKETCH_PARTS names the parts to be measured, all where it is not set.
pub(crate) fn print() {
    let wanted = std::env::var("SKETCH_PARTS").ok();
    for (name, part) in PARTS {
        if wanted.as_ref().is_none_or(|wanted| wanted.split(',').any(|w| w == name)) {
            part();
        }
    }
}

fn drawing(name: &str) -> Drawing {
    let file = root().join(format!("presets/sketches/{name}.svg"));
    Drawing::read(&std::fs::read(file).expect("it is shipped")).expect("it is a drawing")
}

/// Two grown plants and two imported ones.
fn plants() -> Vec<(&'static str, Plant)> {
    let mut plants = vec![("oak (grown)", leafy("oak", 1, 6000)), ("lime (grown)", leafy("lime", 2, 6000))];
    for (name, file) in [("ez-tree oak", "eztree_oak_medium.glb"), ("cherry", "tg_hill_cherry.obj")] {
        plants.extend(imported(file).map(|plant| (name, plant)));
    }
    plants
}

fn bound(plant: &Plant, views: SketchViews) -> Arc<Sketcher> {
    Arc::new(Sketcher::bind(Arc::new(plant.clone()), views).expect("it has a crown"))
}

fn drawn(sketcher: &Arc<Sketcher>, front: &Drawing, method: Method) -> Sketched {
    sketcher.draw(&Sketch { method, ..Sketch::of(front) }).expect("it can be drawn")
}

/// What the crown's silhouette and what is drawn have in common, over what either covers.
fn likeness_of(sketched: &Sketched, azimuth: f32) -> f32 {
    overlap(&crown_silhouette(&sketched.at(1.0), azimuth, 0.0, CLOSE), &sketched.targets[0])
}

/// The discrete Fréchet distance of the crown's outline to the outline that is drawn, over the tree's height.
fn frechet_to_sketch(sketched: &Sketched) -> f32 {
    let made = sketched.at(1.0);
    let outline = crown_silhouette(&made, 0.0, 0.0, CLOSE);
    let [is, wanted] = [&outline, &sketched.targets[0]].map(|region| resampled(region.outline(), 240));
    let nearest = |from: Vec2| {
        let far = |p: &Vec2| p.distance_squared(from);
        (0..wanted.len()).min_by(|a, b| far(&wanted[*a]).total_cmp(&far(&wanted[*b]))).unwrap_or(0)
    };
    // Both rings start beside one another.
    let mut wanted_from = wanted.clone();
    wanted_from.rotate_left(nearest(is[0]));
    frechet_of_rings(&is, &wanted_from) / made.height()
}

struct Row {
    name: String,
    ours: f32,
    paper: f32,
    /// Discrete Fréchet distances of the crown's outline to what is drawn, over the tree's height: ours, the paper's.
    frechet: [f32; 2],
    paper_wilting: usize,
    baseline: f32,
    cages: f32,
    one_cage: f32,
    raw: f32,
    strains: Vec<[f32; 3]>,
    continuity: f32,
    wilting: (usize, usize),
}

fn likeness() {
    let mut rows: Vec<Row> = Vec::new();
    for (name, plant) in plants() {
        let sketcher = bound(&plant, FRONT);
        rows.extend(
            SHAPES
                .par_iter()
                .map(|shape| {
                    let drawing = drawing(shape);
                    let sketched = drawn(&sketcher, &drawing, Method::Adaptive);
                    let by = |method| likeness_of(&drawn(&sketcher, &drawing, method), 0.0);
                    let paper = drawn(&sketcher, &drawing, Method::Paper);
                    let whole = |t: f32| PlantStats::of(&sketched.at(t)).topology_continuity;
                    Row {
                        name: format!("{name} as {shape}"),
                        ours: likeness_of(&sketched, 0.0),
                        paper: likeness_of(&paper, 0.0),
                        frechet: [&sketched, &paper].map(frechet_to_sketch),
                        paper_wilting: paper.wilting().0,
                        baseline: by(Method::Baseline),
                        cages: by(Method::AdaptiveCages),
                        one_cage: by(Method::OneCage),
                        raw: overlap(&crown_silhouette(&sketched.at(1.0), 0.0, 0.0, 0.004), &sketched.targets[0]),
                        continuity: [0.25, 0.5, 0.75, 1.0].into_iter().map(whole).fold(1.0, f32::min),
                        strains: sketched.strains(),
                        wilting: sketched.wilting(),
                    }
                })
                .collect::<Vec<_>>(),
        );
    }
    for row in &rows {
        let how = format!(
            "intersection over union of silhouette and sketch; single cage {:.3}, cage tree {:.3}, cages that adapt {:.3}, \
             the paper's method {:.3} (of which {} branches wilt), ours with gaps left open {:.3}; {} of {} branches wilt; \
             Fréchet distance to the sketch {:.3} of the height, the paper's {:.3}",
            row.one_cage,
            row.baseline,
            row.cages,
            row.paper,
            row.paper_wilting,
            row.raw,
            row.wilting.0,
            row.wilting.1,
            row.frechet[0],
            row.frechet[1]
        );
        Figure::new(format!("sketch.likeness, {}", row.name), f64::from(row.ours), "share", how)
            .goal(">= 0.85")
            .print();
    }
    let least = rows.iter().fold(1.0_f32, |m, r| m.min(r.ours));
    let how = format!("least of {} pairs of plant and silhouette", rows.len());
    Figure::new("sketch.likeness_least", f64::from(least), "share", how).goal(">= 0.85").print();
    let over = rows.iter().filter(|r| r.ours > r.one_cage).count();
    let how = format!("pairs of {} in which it is higher than with a single global cage", rows.len());
    Figure::new("sketch.above_one_cage", over as f64 / rows.len() as f64, "share", how).goal("= 1").print();
    let mean = |of: &dyn Fn(&Row) -> f32| f64::from(rows.iter().map(of).sum::<f32>() / rows.len().max(1) as f32);
    let how = format!(
        "mean likeness of {} pairs; the paper's method {:.3}, cages that adapt {:.3}, cage tree {:.3}, single cage {:.3}",
        rows.len(),
        mean(&|r| r.paper),
        mean(&|r| r.cages),
        mean(&|r| r.baseline),
        mean(&|r| r.one_cage)
    );
    Figure::new("sketch.likeness_mean", mean(&|r| r.ours), "share", how).goal("above the paper's").print();
    let how = format!(
        "mean discrete Fréchet distance of the crown's outline to what is drawn, {} pairs; the paper's method {:.4}",
        rows.len(),
        mean(&|r| r.frechet[1])
    );
    Figure::new("sketch.frechet_mean", mean(&|r| r.frechet[0]), "of the height", how).goal("below the paper's").print();
    let most = |k: usize| rows.iter().flat_map(|r| &r.strains).map(|s| s[k]).fold(0.0_f32, f32::max);
    let how = "most that a branch gets longer, all pairs, against its own length";
    Figure::new("sketch.stretch", f64::from(most(0)), "times", how).goal("<= 2.5").print();
    let how = "most that a branch turns beyond the most of its parent and three siblings on either side, all pairs";
    Figure::new("sketch.bend", f64::from(most(2).to_degrees()), "degrees", how).goal("<= 20").print();
    let continuity = rows.iter().fold(1.0_f32, |m, r| m.min(r.continuity));
    let how = "least topology continuity of all pairs at a quarter, half, three quarters and the end";
    Figure::new("sketch.continuity", f64::from(continuity), "share", how).goal("= 1").print();
}

/// Every file of the data folder on a grown oak.
fn every_silhouette() {
    let Some(folder) = data().map(|data| data.join("silhouette")) else { return };
    let plant = leafy("oak", 1, 6000);
    let sketcher = bound(&plant, FRONT);
    let mut files: Vec<_> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "svg"));
    files.sort();
    let (mut good, mut told) = (0, String::new());
    for file in &files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Ok(drawing) = Drawing::read(&std::fs::read(file).unwrap_or_default()) else { continue };
        good += 1;
        let like = likeness_of(&drawn(&sketcher, &drawing, Method::Adaptive), 0.0);
        let _ = write!(told, "{name} {like:.2}, ");
    }
    let how =
        format!("of {} files; intersection over union on a grown oak: {}", files.len(), told.trim_end_matches(", "));
    Figure::new("sketch.silhouettes_read", f64::from(good), "files", how).goal("all").print();
}

/// An imported tree of twenty branches: leaves follow their branches, and so few can't follow all of a sketch.
fn sparse() {
    let Some(plant) = imported("eztree_aspen_small.glb") else { return };
    let sketcher = bound(&plant, FRONT);
    for shape in SHAPES {
        let drawing = drawing(shape);
        let ours = likeness_of(&drawn(&sketcher, &drawing, Method::Adaptive), 0.0);
        let one = likeness_of(&drawn(&sketcher, &drawing, Method::OneCage), 0.0);
        let how = format!("a tree of {} branches; single cage {one:.3}", plant.chains().len());
        let name = format!("sketch.sparse, ez-tree aspen as {shape}");
        Figure::new(name, f64::from(ours), "share", how).goal("above the single cage").print();
    }
}

fn views() {
    let plant = leafy("lime", 2, 6000);
    let quarter = std::f32::consts::FRAC_PI_2;
    let (heart, oval) = (drawing("heart"), drawing("oval"));
    let both = bound(&plant, SketchViews { kind: ViewKind::FrontAndSide, ..FRONT });
    let sketched = both.draw(&Sketch { side: Some(&oval), ..Sketch::of(&heart) }).expect("it can be drawn");
    let made = sketched.at(1.0);
    let like = |k: usize| overlap(&crown_silhouette(&made, quarter * k as f32, 0.0, CLOSE), &sketched.targets[k]);
    let how = "heart from the front and oval from the side at once, the worse of both; lime";
    Figure::new("sketch.front_and_side", f64::from(like(0).min(like(1))), "share", how).goal(">= 0.8").print();
    let round = bound(&plant, SketchViews { kind: ViewKind::Revolved, ..FRONT });
    for shape in ["droplet", "egg"] {
        let drawing = drawing(shape);
        let sketched = drawn(&round, &drawing, Method::Adaptive);
        let made = sketched.at(1.0);
        let like = (0..8).map(|k| {
            let found = crown_silhouette(&made, quarter * 0.5 * k as f32, 0.0, CLOSE);
            let [low, high] = found.bounds();
            let centred = found.moved(Vec2::ONE, Vec2::new(-(low.x + high.x) * 0.5, 0.0));
            overlap(&centred, &sketched.targets[0])
        });
        let how = "the worst of eight views all round; lime";
        let name = format!("sketch.revolved, {shape}");
        Figure::new(name, f64::from(like.fold(1.0, f32::min)), "share", how).goal(">= 0.8").print();
    }
}

/// Places of an outline; a third of a percent of the height apart, less than the distances that are compared.
const PLACES: usize = 960;

/// The discrete Fréchet distance of two rings: where the walk starts is free, within a twentieth of the way round on either
/// side of where the rings start.
fn frechet_of_rings(a: &[Vec2], b: &[Vec2]) -> f32 {
    let (reach, step) = (a.len() / 20, (a.len() / 240).max(1));
    let starts = (0..=2 * reach).step_by(step).map(|k| (a.len() + k - reach) % a.len());
    starts
        .map(|start| discrete_frechet(&[&a[start..], &a[..=start]].concat(), &closed(b)))
        .fold(f32::INFINITY, f32::min)
}

/// A ring that ends where it starts.
fn closed(ring: &[Vec2]) -> Vec<Vec2> {
    ring.iter().chain(ring.first()).copied().collect()
}

/// Fig. 11: in-between silhouettes against the interpolated ones, by our way and by the leafy morph to the same tree.
fn along_the_way() {
    let mut cases = vec![("oak as heart", leafy("oak", 1, 4000), "heart")];
    if let Some(plant) = imported("eztree_oak_medium.glb") {
        cases.push(("ez-tree oak as triangle", plant, "triangle"));
    }
    for (what, plant, shape) in cases {
        let sketcher = bound(&plant, FRONT);
        let sketched = drawn(&sketcher, &drawing(shape), Method::Adaptive).following();
        let end = sketched.at(1.0);
        let patterns = PatternParams::default();
        let family = pattern_family(plant.clone(), end, &MATCHING, &patterns).expect("they match").pair_leaves(1000).0;
        let pace = Pace::of(&family);
        let places = |plant: &Plant| resampled(&crown_outline(plant, 0.0, 0.0), PLACES);
        let (from, to) = (places(&plant), places(&sketched.at(1.0)));
        let size = plant.height();
        let steps = 20;
        let distance = |plant: &Plant, t: f32| {
            let reference: Vec<Vec2> = from.iter().zip(&to).map(|(a, b)| a.lerp(*b, t)).collect();
            frechet_of_rings(&places(plant), &reference) / size
        };
        let rows: Vec<(f32, f32)> = (1..steps)
            .into_par_iter()
            .map(|k| {
                let t = k as f32 / steps as f32;
                let theirs = family.blend(&morph(&family, 0, 1, pace.share(t)));
                (distance(&sketched.at(t), t), distance(&theirs, t))
            })
            .collect();
        let below = rows.iter().filter(|r| r.0 < r.1).count();
        let mean = |k: fn(&(f32, f32)) -> f32| rows.iter().map(k).sum::<f32>() / rows.len() as f32;
        let not = |(k, r): (usize, &(f32, f32))| {
            (r.0 >= r.1).then(|| format!(", not at {:.2}: {:.4} and {:.4}", (k + 1) as f32 / steps as f32, r.0, r.1))
        };
        let how = format!(
            "of {} times at which the Fréchet distance to the interpolated silhouette is below the leafy morph's; means \
             {:.3} and {:.3} of the height; {what}{}",
            rows.len(),
            mean(|r| r.0),
            mean(|r| r.1),
            rows.iter().enumerate().filter_map(not).collect::<String>()
        );
        let share = below as f64 / rows.len() as f64;
        Figure::new(format!("sketch.frechet_below, {what}"), share, "share", how).goal("= 1").print();
        let file = std::env::temp_dir().join(format!("treewright_frechet_{shape}.svg"));
        if std::fs::write(&file, plot(what, &rows)).is_ok() {
            let how = format!("curves in {}", file.display());
            Figure::new(format!("sketch.frechet_plot, {what}"), rows.len() as f64, "times", how).print();
        }
    }
}

/// Both distances over time as an SVG (2018, Fig. 11).
fn plot(title: &str, rows: &[(f32, f32)]) -> String {
    let most = rows.iter().fold(1e-6_f32, |m, r| m.max(r.0).max(r.1));
    let line = |of: &dyn Fn(&(f32, f32)) -> f32| {
        let at = |(k, r): (usize, &(f32, f32))| {
            let x = 60.0 + 540.0 * (k + 1) as f32 / (rows.len() + 1) as f32;
            format!("{x:.1},{:.1}", 340.0 - 280.0 * of(r) / most)
        };
        rows.iter().enumerate().map(at).collect::<Vec<_>>().join(" ")
    };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 400\" font-family=\"sans-serif\" font-size=\"12\">\
         <rect width=\"640\" height=\"400\" fill=\"#fff\"/><text x=\"60\" y=\"30\" font-size=\"14\">Discrete Fréchet \
         distance to the interpolated silhouette, {title}</text>\
         <path d=\"M60 50V340H600\" fill=\"none\" stroke=\"#888\"/><text x=\"10\" y=\"64\">{most:.2}</text>\
         <text x=\"30\" y=\"344\">0</text><text x=\"540\" y=\"364\">time</text>\
         <polyline points=\"{}\" fill=\"none\" stroke=\"#b3261e\" stroke-width=\"2\"/>\
         <polyline points=\"{}\" fill=\"none\" stroke=\"#1e5bb3\" stroke-width=\"2\"/>\
         <text x=\"70\" y=\"384\" fill=\"#b3261e\">sketch</text>\
         <text x=\"140\" y=\"384\" fill=\"#1e5bb3\">leafy morph to the same tree</text></svg>\n",
        line(&|r| r.0),
        line(&|r| r.1)
    )
}

fn identity() {
    let mut worst = 0.0_f32;
    let all = plants();
    for (_, plant) in &all {
        let outline = crown_outline(plant, 0.0, 0.0);
        let path: Vec<String> = outline.iter().map(|p| format!("{} {}", p.x, -p.y)).collect();
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\"><path d=\"M{}Z\"/></svg>",
            path.join("L")
        );
        let own = Drawing::read(text.as_bytes()).expect("an outline");
        let made = drawn(&bound(plant, FRONT), &own, Method::Adaptive).at(1.0);
        if made.all_points().len() != plant.all_points().len() {
            worst = f32::INFINITY;
            continue;
        }
        let (was, is) = (plant.pose(), made.pose());
        let far = was.positions().iter().zip(is.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        worst = worst.max(far / plant.height());
    }
    let how = format!("farthest that a point moves when the crown's own silhouette is drawn, {} plants", all.len());
    Figure::new("sketch.identity", f64::from(worst), "of the height", how).goal("<= 1e-4").print();
}

/// Table 1: branches and leaves of a row, and what a frame took there, seconds.
const ROWS: [(usize, usize, f64); 5] =
    [(5031, 3830, 1.14), (1800, 1702, 0.32), (3917, 3787, 2.05), (3976, 3852, 0.67), (1774, 1766, 0.57)];

/// A plant of so many branches and leaves: a dressed oak, the finest twigs cut and leaves evenly left out.
pub(crate) fn row_plant(branches: usize, leaves: usize) -> Plant {
    let fine = DressParams { density: 2.0, leaf_size: 0.1, leaf_spread: 0.1, twig_length: 0.2, ..foliage(60_000) };
    let full = dress(&source("oak", 1, usize::MAX), &fine, Seed::new(1).child("dress"));
    let mut order: Vec<_> = full.chain_ids().collect();
    order.sort_by_key(|&id| (full.chain(id).order, id));
    let cut = treewright::select::without(&full, order.get(branches..).unwrap_or(&[]));
    let every = (cut.leaves().len() as f64 / leaves.max(1) as f64).max(1.0);
    let keep: Vec<_> = (0..leaves).map(|k| (k as f64 * every) as usize).filter(|&i| i < cut.leaves().len()).collect();
    let mut builder = treewright::plant::PlantBuilder::from_plant(cut.clone().without_leaves());
    keep.into_iter().for_each(|i| builder.leaf(cut.leaves()[i]));
    builder.finish().expect("it is sound")
}

fn speed() {
    let heart = drawing("heart");
    for (branches, leaves, paper) in ROWS {
        let plant = row_plant(branches, leaves);
        let counts = format!("{} branches, {} leaves", plant.chains().len(), plant.leaves().len());
        let shared = Arc::new(plant);
        let bind = seconds(3, || {
            black_box(Sketcher::bind(shared.clone(), FRONT).is_ok());
        });
        let sketcher = bound(&shared, FRONT);
        let sketched = drawn(&sketcher, &heart, Method::Adaptive);
        let follow = seconds(3, || {
            black_box(sketched.clone().following());
        });
        let sketched = sketched.following();
        let frame = seconds(9, || {
            black_box(sketched.at(0.5));
        });
        let edit = seconds(9, || {
            black_box(drawn(&sketcher, &heart, Method::Adaptive).at(1.0));
        });
        let how = format!(
            "a frame of the animation; median of 9, {counts}; bound once in {:.0} ms, ways found once in {:.0} ms; the \
             paper took {paper} s",
            bind * 1e3,
            follow * 1e3
        );
        let name = format!("sketch.frame, {branches} branches");
        Figure::new(name, frame * 1e3, "ms", how).goal("<= 20").print();
        let name = format!("sketch.redrawn, {branches} branches");
        let how = format!("a new sketch drawn and the tree made; median of 9, {counts}");
        Figure::new(name, edit * 1e3, "ms", how).goal("<= 20").print();
    }
}
