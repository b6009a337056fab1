//! What the trees of a set wear: the plan's leaves and bark or those that sources bring, and how each tree gets its leaves.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use super::around::{Around, Surroundings};
use super::stages::{Pictures, SourcePlant, ingredients, made_edge};
use super::trees::cell;
use super::turning::Rack;
use super::wears;
use crate::bake::{self, Maps};
use crate::base::{Diagnostic, Note, Seed};
use crate::dress;
use crate::lod::{self, Texels};
use crate::plant::{Leaf, LeafForm, Plant};
use crate::preset::Plan;
use crate::preset::plan::{AtlasParams, DressParams, LeafArt, Lod, TargetLeaf, USUAL_LEAF_SHARE, Variant, Wear};

/// What the trees of a set wear, and how slots count in it.
#[derive(Clone, Debug)]
pub(super) struct Wardrobe {
    /// Pictures of leaves by slot, and the bark.
    pub(super) pictures: Pictures,
    /// The sources, their leaves' slots counted in `pictures`.
    pub(super) plants: Vec<Plant>,
    /// Which of them are meshes without a leaf, in a set that says nothing of foliage: they stay as they were drawn.
    bare: Vec<bool>,
    /// First slot of the pictures that dressing gives leaves, and how many there are.
    dressed: (u16, u16),
    /// Leaves that sequences turn into, and the first slot of the pictures of each.
    targets: Vec<(LeafArt, u16)>,
    /// Length of a leaf that dressing makes, metres.
    pub(super) leaf_size: f32,
    /// What is around the sources, and so around what is made of them.
    around: Surroundings,
    /// Texels along the edge of the largest picture of a leaf, and of it as it came, where it was shrunk.
    shrunk: Option<[u32; 2]>,
}

/// Decides what leaves and bark wear: the plan's art, or what sources bring.
///
/// # Errors
///
/// When a source that art is taken from brings none.
pub(super) fn wardrobe(
    plan: &Plan,
    sources: &[Arc<SourcePlant>],
    pictures: &Pictures,
    around: Surroundings,
) -> Result<Wardrobe, Vec<Diagnostic>> {
    let lacking = lacking(plan, |index| Some(&sources[index]));
    if !lacking.is_empty() {
        return Err(lacking);
    }
    // Those that were left out wear nothing.
    let made = || sources.iter().filter(|s| !s.plant.chains().is_empty());
    let bark = wears::bark_source(plan, sources).and_then(|index| sources[index].bark.as_ref());
    let bark = bark.unwrap_or(&pictures.bark).clone();
    let stays = |s: &SourcePlant| wears::stays_bare(plan) && s.is_bare_mesh();
    // Among trees that are dressed a mesh of wood is, too.
    let dresses = made().any(|s| !s.is_leafy()) && !made().all(|s| stays(s));
    let mut rack = Rack::new(plan.leaf_turn.as_ref());
    let worn = Seed::new(plan.seed).child("wear");
    let mut plants: Vec<Plant> = sources.iter().map(|s| s.plant.clone()).collect();
    let mut leaf_size = dress_params(plan).leaf_size;
    let dressed = match plan.leaf_wear {
        Wear::Rest => {
            for (i, (source, plant)) in sources.iter().zip(&mut plants).enumerate() {
                let own = rack.hang_to_turn(&source.leaf_maps);
                let slot = |k: usize, leaf: &Leaf| own.slot(leaf.slot, worn.at(i as u64).at(k as u64));
                *plant = std::mem::take(plant).rewear(|k, leaf| (slot(k, leaf), leaf.form));
            }
            let made = if dresses || rack.pictures.is_empty() { &pictures.leaves[..] } else { &[] };
            rack.hang(made)
        }
        Wear::All => {
            let hung = match plan.leaf_art {
                LeafArt::Made { .. } => rack.hang(&pictures.leaves),
                LeafArt::Files { .. } => rack.hang_to_turn(&pictures.leaves),
            };
            for (source, plant) in sources.iter().zip(&mut plants) {
                let slot = |i: usize| worn.at(i as u64).index(hung.count.into()) as u16;
                let straight = std::mem::take(plant).keep_leaves(|_, leaf| Some(leaf.straight()));
                *plant = straight.rewear(|i, _| (slot(i), LeafForm::Square));
                *plant = refitted(plan, source, std::mem::take(plant), leaf_size, &rack.pictures);
            }
            hung
        }
        Wear::Source(index) => {
            let from = &sources[index];
            let hung = rack.hang_to_turn(&from.leaf_maps);
            let own = from.plant.leaves();
            // A leaf of another source takes the picture and the form of one of this source's.
            for (i, plant) in plants.iter_mut().enumerate() {
                let pick = |k: usize, leaf: &Leaf| {
                    let seed = worn.at(i as u64).at(k as u64);
                    let model = if i == index { leaf } else { &own[seed.index(own.len())] };
                    (hung.slot(model.slot, seed), model.form)
                };
                *plant = std::mem::take(plant).rewear(pick);
            }
            if leaf_size > 0.0 {
                for (source, plant) in sources.iter().zip(&mut plants) {
                    *plant = refitted(plan, source, std::mem::take(plant), leaf_size, &rack.pictures);
                }
            } else {
                leaf_size = own.iter().map(|leaf| leaf.size).sum::<f32>() / own.len() as f32;
            }
            hung
        }
    };
    // Only what somebody wears takes room in the atlas.
    let is_worn = plan.own_density > 0.0 && (dresses || made().any(|s| s.is_leafy()));
    let shrunk = if is_worn { in_their_share(&mut rack.pictures, plan) } else { None };
    if !is_worn {
        rack.pictures = unworn(rack.pictures.len());
    }
    let leaves = rack.turned(|maps| inside_its_cell(maps, &plan.atlas));
    let pictures = Pictures { leaves, bark };
    let bare = sources.iter().map(|s| stays(s)).collect();
    let dressed = (dressed.first, dressed.count);
    Ok(Wardrobe { pictures, plants, bare, dressed, targets: Vec::new(), leaf_size, around, shrunk })
}

/// What is wrong where leaves or bark are taken from a source that brings none, as far as sources are known.
pub(super) fn lacking<'a>(plan: &Plan, source: impl Fn(usize) -> Option<&'a Arc<SourcePlant>>) -> Vec<Diagnostic> {
    let lacks = |wear: Wear, what: &str, field: &str, brings: fn(&SourcePlant) -> bool| {
        let Wear::Source(index) = wear else { return None };
        if source(index).is_none_or(|source| brings(source)) {
            return None;
        }
        let message = format!("\"{}\" brings no {what} of its own", plan.sources[index].name);
        let hint = format!("name a source that is imported from a mesh with {what}");
        Some(Diagnostic::new("", message).with_field(field).with_hint(hint))
    };
    let leaves = lacks(plan.leaf_wear, "leaves", "foliage.leaf", SourcePlant::is_leafy);
    leaves.into_iter().chain(lacks(plan.bark_wear, "bark", "bark.texture", |source| source.bark.is_some())).collect()
}

/// What stands for so many pictures in a set without leaves: clear ones of a few texels, since slots go on counting them.
fn unworn(count: usize) -> Vec<Maps> {
    let texels = (CLEAR * CLEAR) as usize;
    let clear = Maps {
        width: CLEAR,
        height: CLEAR,
        color: vec![[255, 255, 255, 0]; texels],
        normal: vec![[128, 128, 255]; texels],
        orm: vec![[255, 255, 0]; texels],
    };
    vec![clear; count]
}

/// Pictures of leaves, as much smaller as leaves room for what is baked of trees: one leaf of a few centimetres may come with as many
/// texels as the atlas has. None is made smaller than usual made ones are, or than a
/// quarter of the atlas; and what the largest has of what it had, if less.
fn in_their_share(leaves: &mut [Maps], plan: &Plan) -> Option<[u32; 2]> {
    let is_baked = |level: &Lod| !lod::pictures(level, Texels::all(lod::CARD_TEXELS)).is_empty();
    let full = leaves.iter().map(|maps| maps.width.max(maps.height)).max().unwrap_or(0);
    if full == 0 || !plan.lods.iter().any(|level| is_baked(&level.lod)) {
        return None;
    }
    let (size, least) = (plan.atlas.size, USUAL_PICTURE.min(plan.atlas.size / 4));
    let room = f64::from(size) * f64::from(size) * SHARE;
    let area = |edge: u32| leaves.iter().map(|maps| cell(maps.size_within(edge), plan.atlas.gutter)).sum::<f64>();
    let mut edge = full;
    while area(edge) > room && edge > least {
        // By powers of two from the first on.
        edge = least.max(edge.next_power_of_two() / 2);
    }
    if edge == full {
        return None;
    }
    leaves.iter_mut().for_each(|maps| *maps = maps.within(edge).into_owned());
    Some([edge, full])
}

/// A picture as a square whose cell in the atlas is one of a power of two, unless it is small or slim: then mips that are coarser
/// than it is are its own, and crowns of it are seen from as far. It takes the cell that leaves it four fifths of its texels an
/// edge or more. (Trees of a user's picture of 406 texels an edge were bare from 100 pixels of height on.)
fn inside_its_cell(maps: Maps, atlas: &AtlasParams) -> Maps {
    let (low, high) = (maps.width.min(maps.height), maps.width.max(maps.height));
    if maps.width.max(maps.height) < LEAST_CELL || high > 2 * low {
        return maps;
    }
    let area = u64::from(low) * u64::from(high);
    let holds = |cell: u32| u64::from(atlas.inside(cell)).pow(2) * 25 >= area * 16;
    let cell = (0..).map(|power| LEAST_CELL << power).find(|cell| holds(*cell)).unwrap_or(LEAST_CELL);
    let edge = atlas.inside(cell);
    maps.resized(edge, edge).into_owned()
}

/// What is opaque of each picture, 0..=1.
fn opaque(pictures: &[Maps]) -> Vec<f32> {
    let sum = |maps: &Maps| maps.color.iter().map(|texel| f32::from(texel[3])).sum::<f32>();
    pictures.iter().map(|maps| sum(maps) / (255.0 * maps.color.len().max(1) as f32)).collect()
}

/// What the cards of a plant's leaves cover, square metres.
fn area(plant: &Plant) -> f32 {
    dress::shown(plant, |leaf| leaf.form.width())
}

/// What a leaf shows of the square of its length, by what is opaque of each picture.
fn share(opaque: &[f32], leaf: &Leaf) -> f32 {
    leaf.form.width() * opaque.get(usize::from(leaf.slot)).unwrap_or(&1.0)
}

/// A source whose own leaves wear other `pictures` now, its leaves as long as those are meant to be, metres, and showing
/// what they showed. A length that the preset doesn't tell makes no leaf shorter: the card of a whole branch stays one.
fn refitted(plan: &Plan, source: &SourcePlant, worn: Plant, size: f32, pictures: &[Maps]) -> Plant {
    let own = dress::length(&worn);
    if own <= 0.0 {
        return worn;
    }
    let is_told = plan.dress.leaf_share <= 0.0;
    let most = worn.pose().extent() * if is_told { LARGEST_LEAF } else { plan.dress.leaf_share };
    let scale = size.min(most) / own;
    if !is_told && scale <= 1.0 {
        return worn;
    }
    let (before, now) = (opaque(&source.leaf_maps), opaque(pictures));
    let area = dress::shown(&source.plant, |leaf| share(&before, leaf));
    dress::refit(worn, scale, area, |leaf| share(&now, leaf), Seed::new(plan.seed).child("refit"))
}

/// Share of the atlas that pictures of leaves may take where trees are baked, if they are larger than usual made ones, and the edge
/// of those.
const SHARE: f64 = 0.3;
/// The edge of pictures that nobody wears.
const CLEAR: u32 = 8;
const USUAL_PICTURE: u32 = 256;
/// Pictures of fewer texels an edge keep their sides.
const LEAST_CELL: u32 = 128;
/// Least share of a crown that leaves are made for where sources bring the rest.
const LEAST: f32 = 0.02;
/// Longest leaf that a preset may ask for, as a share of the largest source's extent.
const LARGEST_LEAF: f32 = 0.8;

impl Wardrobe {
    /// What is told of pictures that were shrunk.
    pub(super) fn note(&self) -> Option<Note> {
        let [is, was] = self.shrunk?;
        let message = format!(
            "the largest picture of leaves has {is} of {was} texels along its edge, so that the levels that are baked have room; a \
             larger `size` leaves it more"
        );
        Some(Note::new("atlas", message))
    }

    /// How a variant gets its leaves; none for a frame, which is made of plants with leaves.
    pub(super) fn dressing(&self, plan: &Plan, variant: &Variant) -> Option<Dressing> {
        if matches!(variant, Variant::Frame { .. }) {
            return None;
        }
        Some(self.dressing_of(plan, &ingredients(plan, variant)))
    }

    /// How a tree that is made of some sources gets its leaves.
    pub(super) fn dressing_of(&self, plan: &Plan, sources: &[usize]) -> Dressing {
        let is_own = |&i: &usize| !self.plants[i].leaves().is_empty();
        if sources.iter().all(is_own) || sources.iter().all(|&i| self.bare[i]) {
            return Dressing::Own { params: DressParams { density: plan.own_density, ..plan.dress.clone() } };
        }
        let leaf_size = self.leaf_size;
        let leaf_share = self.leaf_share(plan, leaf_size, sources);
        let params = DressParams { pictures: self.dressed.1, leaf_size, leaf_share, ..plan.dress.clone() };
        let areas = sources.iter().map(|&i| area(&self.plants[i])).filter(|area| *area > 0.0);
        let (sum, count) = areas.fold((0.0, 0), |(sum, count), area| (sum + area, count + 1));
        let (first, own, own_density) = (self.dressed.0, sum / count.max(1) as f32, plan.own_density);
        Dressing::Made { params, first, own, own_density, around: self.around.around(plan, sources) }
    }

    /// How long leaves may be, of the extent of what is made of some sources: a size that the preset tells is taken as it is on
    /// the largest of them, and on smaller trees as much smaller.
    fn leaf_share(&self, plan: &Plan, size: f32, sources: &[usize]) -> f32 {
        if plan.dress.leaf_share > 0.0 {
            return plan.dress.leaf_share;
        }
        let extent = |&i: &usize| self.plants[i].pose().extent();
        let largest = sources.iter().map(extent).fold(0.0, f32::max);
        if largest > 0.0 { (size / largest).clamp(USUAL_LEAF_SHARE, LARGEST_LEAF) } else { USUAL_LEAF_SHARE }
    }
}

/// How a plant gets its leaves.
#[derive(Clone, Debug, Serialize)]
pub(super) enum Dressing {
    /// Those that all of its sources bring, as many of them as the preset says, or more.
    Own { params: DressParams },
    /// Made, as one of its sources brings none; `first` is the slot of the first picture. Where others bring some, with an area of
    /// `own` square metres, they stay, thinned as `own_density` says, and are made up for by as much as is not there.
    /// They keep out of what is `around`.
    Made {
        params: DressParams,
        first: u16,
        own: f32,
        own_density: f32,
        #[serde(skip_serializing_if = "Around::is_nothing")]
        around: Around,
    },
}

impl Dressing {
    /// The plant with leaves.
    pub(super) fn dress(&self, plant: Plant, seed: Seed) -> Plant {
        match self {
            Self::Own { params } => dress::thin(plant, params, seed.child("thin")),
            Self::Made { params, first, own, own_density, around } => {
                let there = if *own > 0.0 { area(&plant) / own } else { 0.0 };
                let at = |density: f32, most_leaves: u32| DressParams { density, most_leaves, ..params.clone() };
                if there > 1.0 - LEAST {
                    return dress::thin(plant, &at(*own_density, params.most_leaves), seed.child("thin"));
                }
                // Of as many as a tree may have each kind gets its part, and what the first leaves over is the second's.
                let part = (params.most_leaves as f32 * there) as u32;
                let kept = dress::thin(plant.clone(), &at(*own_density, part), seed.child("thin"));
                let room = params.most_leaves.saturating_sub(kept.leaves().len() as u32);
                let density = params.density * (1.0 - there);
                let dressed = dress::dress_among(&plant.without_leaves(), &at(density, room), &around.obstacles, seed);
                let made = dressed.rewear(|_, leaf| (first + leaf.slot, leaf.form));
                let leaves = made.leaves().iter().chain(kept.leaves()).copied().collect();
                made.with_leaves(leaves)
            }
        }
    }
}

impl Wardrobe {
    /// A source with leaves, as the variant of it is; where dressing makes them, they wear `leaf`, whose pictures are added.
    pub(super) fn source(&mut self, plan: &Plan, index: usize, leaf: &TargetLeaf, seed: Seed) -> Plant {
        let plant = self.plants[index].clone();
        let (first, art, dress) = match leaf {
            TargetLeaf::Made { art, size, angle, droop, twig, full, phyllotaxis } if plant.leaves().is_empty() => {
                let LeafArt::Made { shape, color, variation, .. } = art else { return plant };
                // A leaf that the set or another sequence wears already is drawn, and has its room in the atlas.
                let own = (*art == plan.leaf_art && self.dressed.1 > 0).then_some(self.dressed.0);
                let known = || self.targets.iter().find(|known| known.0 == *art).map(|known| known.1);
                let first = own.or_else(known);
                let edge = made_edge(plan, art);
                let picture =
                    |i| bake::leaf_maps(*shape, *color, *variation, edge, i, Seed::new(plan.seed).child("leaves"));
                let count = if first.is_some() { 0 } else { u32::from(plan.dress.pictures) };
                let drawn: Vec<Maps> = (0..count).into_par_iter().map(picture).collect();
                let first = first.unwrap_or_else(|| {
                    let first = self.pictures.leaves.len() as u16;
                    self.targets.push((art.clone(), first));
                    first
                });
                let (leaf_size, leaf_angle) = (size * bake::spray_span(*shape), *angle);
                let dress = DressParams {
                    density: plan.own_density * full,
                    leaf_size,
                    leaf_angle,
                    droop: *droop,
                    twig_length: *twig,
                    phyllotaxis: *phyllotaxis,
                    ..plan.dress.clone()
                };
                (first, drawn, dress)
            }
            _ => {
                return match self.dressing(plan, &Variant::Source(index)) {
                    Some(dressing) => dressing.dress(plant, seed),
                    None => plant,
                };
            }
        };
        self.pictures.leaves.extend(art);
        let around = self.around.around(plan, &[index]);
        dress::dress_among(&plant, &dress, &around.obstacles, seed).rewear(|_, leaf| (first + leaf.slot, leaf.form))
    }
}

/// How a plan's trees are dressed where it makes their leaves: its own parameters, but for the length of what leaves are shown
/// by, metres. The picture of a made leaf is a spray of several.
#[must_use]
pub fn dress_params(plan: &Plan) -> DressParams {
    DressParams { leaf_size: plan.dress.leaf_size * picture_span(plan), ..plan.dress.clone() }
}

/// Lengths of a leaf that the pictures of a plan's leaves are high.
pub(super) fn picture_span(plan: &Plan) -> f32 {
    match (&plan.leaf_art, plan.leaf_wear) {
        (LeafArt::Made { shape, .. }, Wear::All | Wear::Rest) => bake::spray_span(*shape),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Rotation;
    use crate::plant::PlantBuilder;

    /// A picture of which so much is opaque, in rows.
    fn picture(opaque: f32) -> Maps {
        let alpha = |i: usize| if (i / 8) as f32 + 0.5 < opaque * 8.0 { 255 } else { 0 };
        Maps {
            width: 8,
            height: 8,
            color: (0..64).map(|i| [60, 110, 30, alpha(i)]).collect(),
            normal: vec![[128, 128, 255]; 64],
            orm: vec![[255, 200, 0]; 64],
        }
    }

    #[test]
    fn a_leaf_of_any_size_gets_a_cell_whose_mips_are_its_own() {
        let atlas = AtlasParams { size: 2048, gutter: 8 };
        let sides = |width: u32, height: u32| {
            let texels = (width * height) as usize;
            let color = (0..texels).map(|i| [60, 110, 30, (i * 255 / texels) as u8]).collect();
            let relief = |value: [u8; 3]| vec![value; texels];
            let maps = Maps { width, height, color, normal: relief([128, 128, 255]), orm: relief([255, 150, 200]) };
            let made = inside_its_cell(maps, &atlas);
            assert!(
                made.color.iter().all(|c| c[..3] == [60, 110, 30]) && made.orm.iter().all(|o| *o == [255, 150, 200])
            );
            // It fades as it did.
            let alpha = |at: f32| f32::from(made.color[(at * made.color.len() as f32) as usize][3]) / 255.0;
            assert!([0.1, 0.5, 0.9].iter().all(|&at| (alpha(at) - at).abs() < 0.03), "{width} {height}");
            (made.width, made.height)
        };
        for (given, cell) in
            [((406, 406), 512), ((512, 512), 512), ((300, 300), 256), ((380, 250), 256), ((130, 128), 128)]
        {
            assert_eq!(sides(given.0, given.1), (cell - 8, cell - 8), "{given:?}");
        }
        // Small ones and slim ones stay.
        assert!(sides(64, 64) == (64, 64) && sides(600, 200) == (600, 200));
    }

    #[test]
    fn pictures_of_leaves_leave_room_for_what_is_baked() {
        let edges = |size: u32, own: &[u32], lods: &str| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\")}}, variants: [Source(\"a\")], atlas: (size: {size}), lods: [{lods}])"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let one = |&edge: &u32| {
                let texels = (edge * edge / 2) as usize;
                let [color, normal, orm] = [[60, 110, 30, 255], [128, 128, 255, 0], [255, 200, 0, 0]];
                let three = |[a, b, c, _]: [u8; 4]| vec![[a, b, c]; texels];
                Maps {
                    width: edge,
                    height: edge / 2,
                    color: vec![color; texels],
                    normal: three(normal),
                    orm: three(orm),
                }
            };
            let mut maps: Vec<Maps> = own.iter().map(one).collect();
            let told = in_their_share(&mut maps, &plan);
            (maps.iter().map(|maps| (maps.width, maps.height)).collect::<Vec<_>>(), told)
        };
        let baked = "Full, Impostor";
        // Half an atlas is too much, but nothing is baked; a quarter of it is not.
        assert_eq!(edges(1024, &[1024], "Full, Thinned(triangles: 0.5)"), (vec![(1024, 512)], None));
        assert_eq!(edges(1024, &[1024], baked), (vec![(512, 256)], Some([512, 1024])));
        assert_eq!(edges(2048, &[1024], baked), (vec![(1024, 512)], None));
        assert_eq!(edges(1024, &[1500, 300, 64], baked), (vec![(512, 256), (300, 150), (64, 32)], Some([512, 1500])));
        // As large as usual made ones they stay, but in small atlases.
        assert_eq!(edges(1024, &[256; 20], baked), (vec![(256, 128); 20], None));
        assert_eq!(edges(1024, &[2048; 20], baked), (vec![(256, 128); 20], Some([256, 2048])));
        assert_eq!(edges(512, &[256; 9], baked), (vec![(128, 64); 9], Some([128, 256])));
        assert_eq!(edges(256, &[256], baked), (vec![(128, 64)], Some([128, 256])));
    }

    #[test]
    fn a_set_without_leaves_has_next_to_no_pictures_of_them() {
        let made = |foliage: &str, leafy: bool| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\")}}, variants: [Source(\"a\")], foliage: ({foliage}))"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let mut source = pole(0.1);
            if !leafy {
                source.plant = source.plant.without_leaves();
                source.leaf_maps.clear();
            }
            let pictures = Pictures { leaves: vec![picture(0.5); 3], bark: picture(1.0) };
            let wardrobe = wardrobe(&plan, &[Arc::new(source)], &pictures, Surroundings::default()).unwrap();
            let leaves = wardrobe.pictures.leaves;
            (leaves.len(), leaves.iter().any(|maps| maps.color.iter().any(|c| c[3] > 0)))
        };
        for (leafy, count) in [(true, 1), (false, 3)] {
            // Slots go on counting them, but there is nothing in them, and nothing comes through.
            assert_eq!(made("season: Winter", leafy), (count, false));
            assert_eq!(made("density: 0", leafy), (count, false));
            assert_eq!(made("density: 0.5", leafy), (count, true));
        }
        assert_eq!(bake::mean_transmission(&unworn(2)), 0);
    }

    /// A pole of eight metres with 400 opaque leaves of a length, half as wide as they are long.
    fn pole(length: f32) -> SourcePlant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 8.0], &[0.1, 0.1]);
        for i in 0..400 {
            let turned = Rotation::about(Seed::new(1).at(i).direction(), 1.0);
            let leaf = Leaf::new(stem, i as f32 / 400.0, turned, length, 0);
            builder.leaf(Leaf { form: LeafForm::Flat(0.5), ..leaf });
        }
        let mut source = SourcePlant::grown(builder.finish().unwrap(), Vec::new());
        source.leaf_maps.push(picture(1.0));
        source
    }

    /// Lengths of the leaves of two sources, 0.1 and 0.4 m, and how much more they show than before.
    fn worn(foliage: &str) -> [(f32, f32); 2] {
        let text = format!(
            "(sources: {{\"a\": Import(file: \"a.csv\"), \"b\": Import(file: \"b.csv\")}}, variants: [Source(\"a\")], \
             foliage: ({foliage}))"
        );
        let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
        let sources = [pole(0.1), pole(0.4)].map(Arc::new);
        let pictures = Pictures { leaves: vec![picture(0.25); 4], bark: picture(1.0) };
        let Ok(made) = wardrobe(&plan, &sources, &pictures, Surroundings::default()) else { panic!("no wardrobe") };
        let (before, now) = (opaque(&sources[0].leaf_maps), opaque(&made.pictures.leaves));
        std::array::from_fn(|i| {
            let shown = |plant, opaque: &[f32]| dress::shown(plant, |leaf| share(opaque, leaf));
            let plant = &made.plants[i];
            (dress::length(plant), shown(plant, &now) / shown(&sources[i].plant, &before))
        })
    }

    #[test]
    fn leaves_of_imports_are_as_many_as_the_density_says_whatever_leaf_is_named() {
        for (foliage, share) in
            [("", 1.0), ("leaf: \"willow\"", 1.0), ("leaf: \"willow\", density: 0.5", 0.5), ("density: 2", 2.0)]
        {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\")}}, variants: [Source(\"a\")], foliage: ({foliage}))"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let pictures = Pictures { leaves: vec![picture(0.25); 4], bark: picture(1.0) };
            let Ok(made) = wardrobe(&plan, &[Arc::new(pole(0.4))], &pictures, Surroundings::default()) else {
                panic!("no wardrobe")
            };
            let bare = made.plants[0].clone();
            let count = bare.leaves().len() as f32;
            let dressed = made.dressing(&plan, &Variant::Source(0)).unwrap().dress(bare, Seed::new(1));
            assert!((dressed.leaves().len() as f32 / count - share).abs() < 0.01, "{foliage}");
        }
    }

    #[test]
    fn a_morph_ends_with_as_many_leaves_as_a_set_of_that_leaf_has() {
        let bare = || Arc::new(SourcePlant::grown(pole(0.2).plant.without_leaves(), Vec::new()));
        let with = |foliage: &str, use_leaves: &mut dyn FnMut(&Plan, &mut Wardrobe) -> usize| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\"), \"b\": Import(file: \"b.csv\")}}, \
                 variants: [Morph(from: \"a\", to: \"b\", frames: 2, leaf: \"willow\")], foliage: ({foliage}))"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let pictures = Pictures { leaves: vec![picture(0.5); 2], bark: picture(1.0) };
            let Ok(mut made) = wardrobe(&plan, &[bare(), bare()], &pictures, Surroundings::default()) else {
                panic!("no wardrobe")
            };
            use_leaves(&plan, &mut made)
        };
        let target = with("leaf: \"oak\"", &mut |plan, made| {
            made.source(plan, 1, &plan.morphs[0].leaf, Seed::new(1)).leaves().len()
        });
        let source = with("leaf: \"willow\"", &mut |plan, made| {
            let dressing = made.dressing(plan, &Variant::Source(1)).unwrap();
            dressing.dress(made.plants[1].clone(), Seed::new(1)).leaves().len()
        });
        assert!(source > 30 && target == source, "{target} for {source}");
    }

    #[test]
    fn a_leaf_that_several_sequences_turn_into_is_drawn_once_and_one_that_is_worn_not_at_all() {
        let bare = || Arc::new(SourcePlant::grown(pole(0.2).plant.without_leaves(), Vec::new()));
        let drawn = |leaves: [&str; 2]| {
            let one = |(leaf, frames): (&str, u32)| {
                format!("Morph(from: \"a\", to: \"b\", frames: {frames}, leaf: \"{leaf}\")")
            };
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.csv\"), \"b\": Import(file: \"b.csv\")}}, \
                 variants: [{}, {}], foliage: (leaf: \"oak\"))",
                one((leaves[0], 2)),
                one((leaves[1], 3))
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let pictures = Pictures { leaves: vec![picture(0.5); plan.dress.pictures.into()], bark: picture(1.0) };
            let Ok(mut made) = wardrobe(&plan, &[bare(), bare()], &pictures, Surroundings::default()) else {
                panic!("no wardrobe")
            };
            let of = |morph: usize, made: &mut Wardrobe| made.source(&plan, 1, &plan.morphs[morph].leaf, Seed::new(1));
            let plants = [of(0, &mut made), of(1, &mut made)];
            let slots = plants
                .map(|plant| plant.leaves().iter().map(|leaf| leaf.slot / plan.dress.pictures).collect::<Vec<_>>());
            assert!(slots.iter().all(|slots| slots.len() > 30 && slots.iter().all(|slot| *slot == slots[0])));
            (made.pictures.leaves.len() / usize::from(plan.dress.pictures), slots.map(|slots| slots[0]))
        };
        assert_eq!(drawn(["willow", "willow"]), (2, [1, 1]));
        assert_eq!(drawn(["willow", "beech"]), (3, [1, 2]));
        assert_eq!(drawn(["oak", "willow"]), (2, [0, 1]));
    }

    #[test]
    fn leaves_of_imports_that_wear_others_are_as_long_as_told_and_show_what_they_did() {
        // Those that are kept are what they were, whatever the rest is told.
        assert_eq!(
            worn("size: 0.06").map(|(length, shown)| ((length * 1e3).round(), shown)),
            [(100.0, 1.0), (400.0, 1.0)]
        );
        let is_near = |a: f32, b: f32| (a / b - 1.0).abs() < 0.1;
        let olive = 0.03 * bake::spray_span(crate::preset::plan::LeafShape::Olive);
        for (length, shown) in worn("leaf: \"olive\", size: 0.03") {
            assert!(is_near(length, olive) && is_near(shown, 1.0), "{length} {shown}");
        }
        // Where no length is told the card of a whole branch stays one.
        let [(short, shown), (long, _)] = worn("leaf: \"olive\"");
        assert!(short > 0.15 && is_near(shown, 1.0) && is_near(long, 0.4), "{short} {shown} {long}");
        for (length, shown) in worn("leaf: From(\"a\"), size: 0.2") {
            assert!(is_near(length, 0.2) && is_near(shown, 1.0), "{length} {shown}");
        }
        assert_eq!(worn("leaf: From(\"a\")").map(|worn| (worn.0 * 1e3).round()), [100.0, 400.0]);
    }

    #[test]
    fn a_mesh_without_leaves_stays_bare_where_nothing_is_said_of_foliage() {
        let leaves = |foliage: &str, notes: &[&str], of: &[usize]| {
            let text = format!(
                "(sources: {{\"a\": Import(file: \"a.obj\"), \"b\": Import(file: \"b.csv\")}}, variants: [Source(\"a\")], {foliage})"
            );
            let plan = crate::preset::load("set.ron", &text, &mut |_| Ok(String::new())).unwrap();
            let wood = pole(0.2).plant.without_leaves();
            let notes = notes.iter().map(|note| (*note).to_owned()).collect();
            let sources = [SourcePlant::grown(wood.clone(), notes), SourcePlant::grown(wood.clone(), Vec::new())];
            let pictures = Pictures { leaves: vec![picture(0.5); 2], bark: picture(1.0) };
            let Ok(made) = wardrobe(&plan, &sources.map(Arc::new), &pictures, Surroundings::default()) else {
                panic!("no wardrobe")
            };
            made.dressing_of(&plan, of).dress(wood, Seed::new(1)).leaves().len()
        };
        let bare = &[crate::source::foliage::BARE][..];
        assert_eq!(leaves("", bare, &[0]), 0);
        // A scan, a blend with one, and a word on foliage.
        assert!(leaves("", bare, &[1]) > 30 && leaves("", bare, &[0, 1]) > 30 && leaves("", &[], &[0]) > 30);
        assert!(leaves("foliage: (leaf: \"oak\")", bare, &[0]) > 30);
        assert!(leaves("foliage: (season: Autumn)", bare, &[0]) > 30);
        assert_eq!(leaves("foliage: ()", bare, &[0]), 0);
    }

    #[test]
    fn what_sources_bring_stays_and_is_made_up_for_by_as_much_as_others_lack() {
        let text =
            "(sources: {\"a\": Import(file: \"a.csv\"), \"b\": Import(file: \"b.csv\")}, variants: [Source(\"a\")])";
        let plan = crate::preset::load("set.ron", text, &mut |_| Ok(String::new())).unwrap();
        let leafy = pole(0.2);
        let bare = SourcePlant::grown(leafy.plant.clone().without_leaves(), Vec::new());
        let pictures = Pictures { leaves: vec![picture(0.5); 2], bark: picture(1.0) };
        let sources = [leafy, bare].map(Arc::new);
        let Ok(made) = wardrobe(&plan, &sources, &pictures, Surroundings::default()) else { panic!("no wardrobe") };
        let dressing = made.dressing_of(&plan, &[0, 1]);
        // Leaves of the first source wear picture 0, those that are made 1 and 2.
        let counts = |every: usize| {
            let some = sources[0].plant.clone().keep_leaves(|i, leaf| (i % 4 < every).then_some(*leaf));
            let dressed = dressing.dress(some, Seed::new(1));
            let own = dressed.leaves().iter().filter(|leaf| leaf.slot == 0).count();
            (own, dressed.leaves().len() - own)
        };
        let all = counts(0).1;
        assert!(all > 50 && counts(0).0 == 0 && counts(4) == (400, 0), "{all} {:?}", counts(4));
        let (own, more) = counts(2);
        assert!(own == 200 && more.abs_diff(all / 2) <= all / 10, "{own} {more} of {all}");
        // All together are no more than a tree may have, and each kind has its part of them.
        let Dressing::Made { params, first, own, own_density, around } = dressing.clone() else {
            panic!("some are made")
        };
        let most = DressParams { most_leaves: 60, ..params };
        let dressing = Dressing::Made { params: most, first, own, own_density, around };
        let half = sources[0].plant.clone().keep_leaves(|i, leaf| (i % 4 < 2).then_some(*leaf));
        let dressed = dressing.dress(half, Seed::new(1));
        let own = dressed.leaves().iter().filter(|leaf| leaf.slot == 0).count();
        let all = dressed.leaves().len();
        assert!((25..=35).contains(&own) && (50..=60).contains(&all), "{own} of {all}");
    }
}
