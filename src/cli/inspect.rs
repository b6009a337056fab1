//! `treewright inspect`: what a plant, a source or an asset holds, as text or JSON.
//!
//! The kind of file is told from its content: a GLB and a picture by their magic numbers, a plant dump and a species file by their RON,
//! everything else goes to the importers, which know their formats.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::args::{InspectArguments, SymmetryMetric};
use super::over::{Kind, may_write, write_over};
use super::report::{Failure, print};
use crate::bake::{PictureInfo, picture_info};
use crate::base::{Diagnostic, Seed, counted};
use crate::blend::shape::Reflection;
use crate::blend::{self, Pace};
use crate::build::{Limits, World};
use crate::export::{self, Curve};
use crate::plant::{Distribution, Plant, PlantStats, dump, trunk_support, undump};
use crate::preset::plan::{ChainPath, ElasticParams, ImportParams, MatchParams, PatternParams};
use crate::preset::{self, place, species};
use crate::relate;
use crate::source::glb::{GlbInfo, read_glb};
use crate::source::{grow, import};

/// What was found.
#[derive(Serialize)]
struct Inspected<'a> {
    file: String,
    /// `plant`, `species`, the name of an import format or of a picture's, or `glb`.
    kind: String,
    /// What was mended in it.
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plant: Option<PlantStats>,
    /// What the trunk that bears most bears of the plant, 0..=1.
    #[serde(skip_serializing_if = "Option::is_none")]
    trunk_support: Option<f32>,
    /// The same while it turns into another plant.
    #[serde(skip_serializing_if = "Option::is_none")]
    morph: Option<MorphSupport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    symmetry: Option<Symmetry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    asset: Option<GlbInfo<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<PictureInfo>,
}

/// Inspects one file.
pub(super) fn run(arguments: &InspectArguments) -> Result<(), Failure> {
    let file = arguments.file.to_string_lossy().replace('\\', "/");
    let one = |message: String| Failure::Diagnostics(vec![Diagnostic::new(&file, message)]);
    let limits = arguments.limits.limits();
    // Before any work that a wrong name would waste.
    if let Some(path) = &arguments.dump {
        may_write(path, Kind::Dump, std::slice::from_ref(&arguments.file))?;
    }
    if let (Some(path), Some(other)) = (&arguments.plot, &arguments.morph_to) {
        may_write(path, Kind::Drawing, &[arguments.file.clone(), other.clone()])?;
    }
    if arguments.elastic.is_told() && !arguments.symmetry {
        return Err(Failure::Usage(
            "--epsilon, --direction and --length say how --symmetry measures: give that, too".to_owned(),
        ));
    }
    let (folder, bytes) = read(&arguments.file, &limits).map_err(one)?;
    let mut inspected = Inspected {
        file: file.clone(),
        kind: "glb".to_owned(),
        notes: Vec::new(),
        plant: None,
        trunk_support: None,
        morph: None,
        symmetry: None,
        asset: None,
        picture: None,
    };
    let mut plant = None;
    if bytes.starts_with(b"glTF") {
        inspected.asset = Some(read_glb(&bytes).map_err(|e| one(e.to_string()))?);
    } else if let Some(picture) = picture_info(&bytes) {
        let picture = picture.map_err(|error| {
            Failure::Diagnostics(vec![Diagnostic::new(&file, error.to_string()).with_hint(error.help())])
        })?;
        (inspected.kind, inspected.picture) = (picture.format.to_owned(), Some(picture));
    } else {
        let (kind, found, notes) = read_plant(&file, &bytes, &folder, arguments.seed)?;
        (inspected.kind, inspected.notes) = (kind, notes);
        inspected.plant = Some(PlantStats::of(&found));
        inspected.trunk_support = Some(trunk_support(&found, &found.pose()));
        plant = Some(found);
    }
    if let Some(path) = &arguments.dump {
        let plant = plant.as_ref().ok_or_else(|| one(format!("a {} holds no plant to dump", inspected.kind)))?;
        write_over(path, dump(plant).as_bytes(), Kind::Dump, std::slice::from_ref(&arguments.file))?;
    }
    if arguments.symmetry {
        let path = match arguments.metric {
            SymmetryMetric::Qed => ChainPath::Straight,
            SymmetryMetric::Elastic => ChainPath::Elastic,
        };
        let elastic = ElasticParams { path, ..arguments.elastic.params() };
        let plant = plant.as_ref().ok_or_else(|| one(format!("a {} holds no plant to mirror", inspected.kind)))?;
        inspected.symmetry = Some(symmetry(plant, &elastic).map_err(one)?);
    }
    if let Some(path) = &arguments.morph_to {
        let from = plant.ok_or_else(|| one(format!("a {} holds no plant to morph", inspected.kind)))?;
        let (name, to) = read_file(path, arguments.seed, &limits)?;
        let morph = morph_support(from, to).map_err(one)?;
        if let Some(out) = &arguments.plot {
            let curve = |name: &str, values: &[f32]| Curve { name: name.to_owned(), values: values.to_vec() };
            let curves = [curve("one-to-many", &morph.one_to_many), curve("one-to-one", &morph.one_to_one)];
            let plot = export::plot(&format!("Trunk support weight, {file} to {name}"), &curves, SUPPORT_BOUND);
            write_over(out, plot.as_bytes(), Kind::Drawing, &[arguments.file.clone(), path.clone()])?;
        }
        inspected.morph = Some(morph);
    }
    let text = if arguments.json {
        serde_json::to_string_pretty(&inspected).map_err(|e| one(e.to_string()))?
    } else {
        describe(&inspected)
    };
    print(&format!("{}\n", text.trim_end()))
}

/// Steps at which a morph is looked at.
const STEPS: u32 = 100;
/// How much steeper than the straight line from end to end the trunk support weight may change.
const SUPPORT_BOUND: f32 = 2.0;

/// The trunk support weight over a morph, at evenly spread times.
#[derive(Serialize)]
struct MorphSupport {
    /// Steepest change by one-to-many matching, for the whole length.
    steepest: f32,
    /// Of the straight line from the first to the last.
    straight: f32,
    /// By branching patterns: chains split and merge.
    one_to_many: Vec<f32>,
    /// By fuzzy matching: chains without a partner grow and wilt.
    one_to_one: Vec<f32>,
}

/// How far a plant is from symmetric (2018 TOG, section 6).
#[derive(Serialize)]
struct Symmetry {
    /// Where the vertical plane of least asymmetry runs to, degrees from the front (+z) towards +x.
    plane: f32,
    /// Distance of the plant and its reflection, metres.
    asymmetry: f64,
}

fn symmetry(plant: &Plant, params: &ElasticParams) -> Result<Symmetry, String> {
    let found = Reflection::best(plant, params).map_err(|error| error.to_string())?;
    Ok(Symmetry { plane: found.azimuth().to_degrees().rem_euclid(180.0), asymmetry: found.asymmetry() })
}

fn morph_support(from: Plant, to: Plant) -> Result<MorphSupport, String> {
    let matching = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };
    let wrong = |error: relate::FamilyError| error.to_string();
    let patterns = PatternParams::default();
    let family = relate::pattern_family(from.clone(), to.clone(), &matching, &patterns).map_err(wrong)?;
    let one_to_many = blend::support_over_morph(&family, &Pace::of(&family), STEPS);
    let family = relate::fuzzy_family(from, to, &matching).map_err(wrong)?;
    let one_to_one = blend::support_over_morph(&family, &Pace::even(), STEPS);
    let curve = Curve { name: String::new(), values: one_to_many };
    Ok(MorphSupport { steepest: curve.steepest(), straight: curve.straight(), one_to_many: curve.values, one_to_one })
}

/// Reads a plant from any file that holds or describes one: the file's name as it is shown, and the plant.
pub(super) fn read_file(path: &Path, seed: u64, limits: &Limits) -> Result<(String, Plant), Failure> {
    let file = path.to_string_lossy().replace('\\', "/");
    let (folder, bytes) = read(path, limits).map_err(|why| Failure::Diagnostics(vec![Diagnostic::new(&file, why)]))?;
    let (_, plant, _) = read_plant(&file, &bytes, &folder, seed)?;
    Ok((file, plant))
}

/// A file's folder and bytes.
fn read(path: &Path, limits: &Limits) -> Result<(World, Vec<u8>), String> {
    // `.` has no name in its folder.
    if path.is_dir() {
        return Err("it is a folder; name a file in it".to_owned());
    }
    let folder = World::within(path.parent().unwrap_or(Path::new("")), limits.clone());
    let name = path.file_name().unwrap_or_default().to_str().ok_or("its name is not UTF-8 text: rename it")?;
    let bytes = folder.read(name)?;
    Ok((folder, bytes))
}

/// A plant out of any file that holds or describes one; a species' shapes are read from `folder`.
fn read_plant(file: &str, bytes: &[u8], folder: &World, seed: u64) -> Result<(String, Plant, Vec<String>), Failure> {
    let text = match std::str::from_utf8(bytes) {
        Err(_) if file.ends_with(".ron") => {
            let message = "it is not UTF-8 text";
            return Err(Failure::Diagnostics(vec![Diagnostic::new(file, message).with_hint("save it as UTF-8")]));
        }
        text => text.unwrap_or_default(),
    };
    let start = text.trim_start();
    if start.starts_with("Plant(") {
        let plant = undump(text).map_err(|e| Failure::Diagnostics(vec![Diagnostic::new(file, e)]))?;
        return Ok(("plant".to_owned(), plant, Vec::new()));
    }
    if file.ends_with(".ron") {
        if place(text, "sources") != place(text, "") {
            return Err(Failure::Diagnostics(vec![
                Diagnostic::new(file, "this is a preset; only what it names can be inspected")
                    .with_hint("`treewright check` reads presets, `treewright build` makes their sets"),
            ]));
        }
        let mut params = species(file, text).map_err(Failure::Diagnostics)?;
        params.seed = seed;
        let mut solids = grow::Solids::new();
        for shape in grow::shape_files(&params) {
            let wrong = |why: String| {
                Failure::Diagnostics(vec![Diagnostic::new(
                    file,
                    format!("can't take endpoints from {}: {why}", shape.file),
                )])
            };
            let bytes = folder.read(&shape.file).map_err(wrong)?;
            let solid = grow::Solid::read(&bytes, shape.reading).map_err(|e| wrong(e.to_string()))?;
            solids.insert(shape, solid);
        }
        let (plant, notes) = grow::grow_in(&params, &solids, Seed::new(seed).child("grow"))
            .map_err(|e| Failure::Diagnostics(vec![Diagnostic::new(file, e.to_string())]))?;
        return Ok(("species".to_owned(), plant, notes));
    }
    let params = ImportParams { file: file.to_owned(), ..ImportParams::default() };
    let beside = named_files(file, bytes, folder);
    let files = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    let imported = import::import_with(bytes, file, &files, &params).map_err(Failure::Diagnostics)?;
    Ok((imported.format.name().to_owned(), imported.plant, imported.notes))
}

/// What a file names beside itself, as far as it is there and not above its folder.
fn named_files(file: &str, bytes: &[u8], folder: &World) -> BTreeMap<String, Vec<u8>> {
    let mut beside: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    // An OBJ names its MTL, that its pictures.
    for _ in 0..2 {
        let files = beside.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
        for name in import::refers(bytes, file, &files) {
            if let Some(bytes) = preset::beside("", &name).and_then(|path| folder.read(&path).ok()) {
                beside.insert(name, bytes);
            }
        }
    }
    beside
}

fn describe(inspected: &Inspected<'_>) -> String {
    let mut text = format!("{} ({})\n", inspected.file, inspected.kind);
    if let Some(stats) = &inspected.plant {
        describe_plant(&mut text, stats);
    }
    if let Some(support) = inspected.trunk_support {
        let _ = writeln!(text, "trunk support weight {:.1} % of the plant's", support * 100.0);
    }
    if let Some(morph) = &inspected.morph {
        let ends = morph.one_to_many.first().zip(morph.one_to_many.last()).unwrap_or((&0.0, &0.0));
        let _ = writeln!(
            text,
            "while it morphs {:.1} % to {:.1} %, steepest {:.2} x the straight line",
            ends.0 * 100.0,
            ends.1 * 100.0,
            morph.steepest / morph.straight.max(1e-6)
        );
    }
    if let Some(Symmetry { plane, asymmetry }) = inspected.symmetry {
        let _ = writeln!(text, "{asymmetry:.2} m from symmetric, across the plane at {plane:.0} degrees");
    }
    if let Some(asset) = &inspected.asset {
        describe_asset(&mut text, asset);
    }
    if let Some(PictureInfo { width, height, channels, bits, .. }) = inspected.picture {
        let named = ["grey", "grey, alpha", "red, green, blue", "red, green, blue, alpha"];
        let named = named.get(usize::from(channels) - 1).copied().unwrap_or("others");
        let channels = counted(channels.into(), "channel", "channels");
        let _ = writeln!(text, "{width} x {height} pixels, {channels} of {bits} bits: {named}");
    }
    for note in &inspected.notes {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

fn describe_plant(text: &mut String, s: &PlantStats) {
    let _ = writeln!(
        text,
        "{:.2} m high, {:.2} m wide; {}, {}, {}, {}; {:.1} m of wood, {:.3} m radius at the base",
        s.height,
        s.width,
        counted(s.stems, "stem", "stems"),
        counted(s.chains, "chain", "chains"),
        counted(s.points, "point", "points"),
        counted(s.leaves, "leaf", "leaves"),
        s.wood_length,
        s.base_radius
    );
    let _ = writeln!(text, "topology continuity {:.4}", s.topology_continuity);
    let streams: Vec<String> = s.strahler.iter().map(usize::to_string).collect();
    let _ =
        writeln!(text, "bifurcation ratio {:.2}: {} streams by Strahler order", s.bifurcation_ratio, streams.join(" "));
    if s.murray.exponent > 0.0 {
        let _ = writeln!(
            text,
            "Murray's exponent {:.2} over {}, predicted to {:.0} %",
            s.murray.exponent,
            counted(s.murray.forks, "fork", "forks"),
            s.murray.residual * 100.0
        );
    }
    let _ = writeln!(text, "by order: median [10 %..90 %]");
    let _ = writeln!(
        text,
        "order  chains  length m              base radius mm        angle deg        length ratio         radius ratio         slenderness"
    );
    let spread = |d: &Distribution, scale: f32, digits: usize| match d.count {
        0 => "-".to_owned(),
        _ => format!("{:.digits$} [{:.digits$}..{:.digits$}]", d.median * scale, d.low * scale, d.high * scale),
    };
    for o in &s.orders {
        let _ = writeln!(
            text,
            "{:>5}  {:>6}  {:<20}  {:<20}  {:<15}  {:<19}  {:<19}  {}",
            o.order,
            o.chains,
            spread(&o.length, 1.0, 2),
            spread(&o.base_radius, 1000.0, 1),
            spread(&o.branching_angle, 1.0, 0),
            spread(&o.length_ratio, 1.0, 2),
            spread(&o.radius_ratio, 1.0, 2),
            spread(&o.slenderness, 1.0, 0),
        );
    }
}

fn describe_asset(text: &mut String, asset: &GlbInfo<'_>) {
    let triangles: u64 = asset.instances.iter().filter_map(|i| asset.meshes.get(i.mesh)).map(|m| m.triangles()).sum();
    let _ = writeln!(
        text,
        "{}, {}, {}; the scene shows {}; made by {}",
        counted(asset.meshes.len(), "mesh", "meshes"),
        counted(asset.materials.len(), "material", "materials"),
        counted(asset.images.len(), "image", "images"),
        counted(triangles as usize, "triangle", "triangles"),
        if asset.generator.is_empty() { "?" } else { &asset.generator },
    );
    for extension in &asset.extensions_used {
        let needed = if asset.extensions_required.contains(extension) { " (required)" } else { "" };
        let _ = writeln!(text, "extension {extension}{needed}");
    }
    for mesh in &asset.meshes {
        let triangles = counted(mesh.triangles() as usize, "triangle", "triangles");
        let vertices = counted(mesh.vertices() as usize, "vertex", "vertices");
        let _ = writeln!(text, "mesh {}: {}, {}", mesh.name, triangles, vertices);
        for primitive in &mesh.primitives {
            let material = primitive.material.and_then(|m| asset.materials.get(m));
            let (name, alpha) = material.map_or(("none", ""), |m| (m.name.as_str(), m.alpha_mode.as_str()));
            let _ = writeln!(
                text,
                "  {}, material {name} {alpha}: {}",
                counted(primitive.triangles as usize, "triangle", "triangles"),
                primitive.attributes.join(" ")
            );
        }
    }
    for lod in &asset.lods {
        let _ = writeln!(text, "levels of {}:", lod.node);
        for level in &lod.levels {
            let coverage = level.screen_coverage.map_or_else(String::new, |c| format!(" down to {c:.4} of the screen"));
            let _ = writeln!(text, "  {}{coverage}", level.node);
        }
    }
}
