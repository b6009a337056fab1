//! Levels of detail that are unlike their trees where they take over: the manifest tells the figures of all, and these are
//! told aloud, with what helps.

use super::trees::Tree;
use crate::base::{Note, counted};
use crate::lod::{Level, Measured};
use crate::mesh::bareness;
use crate::plant::Leaf;
use crate::preset::Plan;
use crate::preset::plan::{ANY, Lod, Variant};

/// Overlap of outlines below which a level is another tree, and how far what it covers may be off.
const ALIKE: f32 = 0.7;
const COVERS: f32 = 0.15;
/// Overlap of a crown and its sketch below which that was not followed.
const SKETCHED: f32 = 0.7;
/// Share of a crown's foliage from which it is told that it stays where it would have wilted.
const SPARED: f32 = 0.01;
/// From which bareness on a tree is one of twigs: a few leaves on them change nothing.
const BARE: f32 = 0.9;
/// Share of its tree that an impostor's crossed planes show at least, of bare trees, too.
const PLAIN: f32 = 0.7;
/// Frames of an impostor from which on fewer are better where they show their tree badly: the sheet is as large whatever their number.
const MANY_FRAMES: u32 = 12;
/// Share of its leaves' area that a tree may lose to its bound on triangles.
const BARED: f32 = 0.75;

/// A crown that does not come near to its sketch; of several the least like it.
fn unsketched(plan: &Plan, trees: &[Tree], sketch: usize) -> Option<Note> {
    let is_of = |variant: &Variant| matches!(variant, Variant::Sketched { sketch: own, .. } if *own == sketch);
    let own = plan.variants.iter().zip(trees).zip(1..).filter(|((variant, _), _)| is_of(variant));
    let likeness = own.filter_map(|((_, tree), n)| Some((n, tree.likeness?)));
    let (n, worst) = likeness.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, worst)| *worst < SKETCHED)?;
    let message = format!(
        "its sketch: the crown of {} and what is drawn overlap by {worst:.2} of 1; a drawing that is nearer to the \
         source's proportions is followed better, and so is one by a source whose limbs begin where the drawn crown does",
        plan.called(n)
    );
    Some(Note::new(plan.sketches[sketch].last().field.clone(), message))
}

/// A crown of which more would have wilted than may; of several that of which the most would have.
fn spared(plan: &Plan, trees: &[Tree], sketch: usize) -> Option<Note> {
    let is_of = |variant: &Variant| matches!(variant, Variant::Sketched { sketch: own, .. } if *own == sketch);
    let own = plan.variants.iter().zip(trees).zip(1..).filter(|((variant, _), _)| is_of(variant));
    let shares = own.map(|((_, tree), n)| (n, tree.spared));
    let (n, most) = shares.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
    spared_note(&plan.sketches[sketch].field, &plan.called(n), most)
}

/// That so much of the foliage of a tree would have wilted under its sketch and may not, where it is enough to tell.
pub(super) fn spared_note(about: &str, whose: &str, share: f32) -> Option<Note> {
    let message = || {
        format!(
            "its sketch: {:.0} % more of the foliage of {whose} lies outside of what is drawn than may wilt, which `wilting` tells: \
             it is drawn in by its limbs; a drawing that is nearer to the source's proportions keeps more of the tree, and a \
             larger `wilting` lets more of it go",
            share * 100.0
        )
    };
    (share >= SPARED).then(|| Note::new(about, message()))
}

/// One note a level of the preset that is unlike the tree in some variants, of the worst of them, one where it has more
/// triangles than the level before, and one where it has more than it may have. `drawn` is what of a leaf's card is drawn, 0..=1.
pub(super) fn notes(plan: &Plan, trees: &[Tree], drawn: &dyn Fn(&Leaf) -> f32) -> Vec<Note> {
    let mut notes: Vec<Note> = (0..plan.lods.len()).filter_map(|place| over_budget(plan, trees, place)).collect();
    notes.extend((0..plan.sketches.len()).filter_map(|sketch| unsketched(plan, trees, sketch)));
    notes.extend((0..plan.sketches.len()).filter_map(|sketch| spared(plan, trees, sketch)));
    notes.extend(bared(plan, trees, drawn));
    notes.extend((0..plan.lods.len()).filter_map(|place| without_shader(plan, trees, place)));
    for (place, lod) in plan.lods.iter().enumerate().skip(1) {
        let about = format!("lods[{place}]");
        let levels =
            || trees.iter().zip(1..).filter_map(|(tree, n)| Some((n, tree.ladder.levels.get(place - 1..=place)?)));
        let is_unlike = |level: &Level| level.measured.iou < ALIKE || (level.measured.coverage - 1.0).abs() > COVERS;
        let unlike: Vec<(i32, &Level)> =
            levels().map(|(n, pair)| (n, &pair[1])).filter(|(_, level)| is_unlike(level)).collect();
        if let Some((n, worst)) = unlike.iter().min_by(|a, b| a.1.measured.iou.total_cmp(&b.1.measured.iou)) {
            let tree = &trees[*n as usize - 1];
            let (below, height) = (plan.mesh.below, tree.plant.height());
            let full = &tree.ladder.levels[0].mesh;
            let low = full.bark.positions.iter().chain(&full.leaf.positions).fold(0.0_f32, |low, p| low.min(p.y));
            // Stems that lie on the ground do not go on below it.
            let sunken = below.min(-low);
            // Such pictures show more of what is in the ground than of the tree: no texels help.
            let sunk = format!(
                "stems go on {below} m below the ground, which its picture holds, and the tree is {height:.1} m high: ask \
                 for a smaller `below` in `mesh`"
            );
            // Twigs are thinner than cards and frames show, of any number of texels: only triangles hold them.
            let is_bare = bareness(&tree.plant, &tree.plant.pose()) > BARE;
            let help = match lod.lod {
                _ if sunken > height => &sunk,
                Lod::BillboardCloud { .. } if is_bare => {
                    "cards show bare twigs badly: leave it out, so that the level before it lasts"
                }
                Lod::Impostor { .. } if is_bare => {
                    "no impostor shows bare twigs well: give it a smaller `screen`, so that a thinned level before it is \
                     drawn to smaller sizes"
                }
                Lod::Thinned { triangles, most } => {
                    let full = tree.ladder.levels[0].triangles;
                    if (most as f32) < full as f32 * triangles { "raise its `most`" } else { "raise its `triangles`" }
                }
                Lod::BillboardCloud { .. } => "give it more `cards`, or the atlas a larger `size`",
                Lod::Impostor { frames } if frames > MANY_FRAMES => {
                    "ask for fewer `frames`, each of which is then larger, or give the atlas a larger `size`"
                }
                Lod::Impostor { .. } => {
                    "give the atlas a larger `size`, the level a smaller `screen`, or put one before it"
                }
                _ => "give it a smaller `screen`, or put a level before it",
            };
            let (many, all) = (unlike.len(), trees.len());
            let are = if many == 1 { "is unlike its tree" } else { "are unlike their trees" };
            let variants = counted(all, "variant", "variants");
            let some = if many == all { variants } else { format!("{many} of {variants}") };
            let Measured { iou, pixels, coverage, .. } = worst.measured;
            let message = format!(
                "{some} {are} where it takes over: outlines of {} overlap by {iou:.2} of 1 at {pixels} pixels, \
                 and cover {coverage:.2} times as much; {help}",
                plan.called(*n)
            );
            notes.push(Note::new(about.clone(), message));
        }
        let grown = levels().find(|(_, pair)| pair[1].triangles > pair[0].triangles);
        if let Some((n, [before, after])) = grown {
            let message = format!(
                "{} has {} triangles here and {} in the level before; leave one of the two out",
                plan.called(n),
                after.triangles,
                before.triangles
            );
            notes.push(Note::new(about, message));
        }
    }
    notes
}

/// What is told of the tree that is furthest above the triangles that it may have at a level: its wood can't be coarser.
fn over_budget(plan: &Plan, trees: &[Tree], place: usize) -> Option<Note> {
    let (about, most) = match plan.lods[place].lod {
        Lod::Full => ("mesh.most".to_owned(), plan.mesh.most),
        Lod::Thinned { most, .. } => (format!("lods[{place}].most"), most),
        _ => return None,
    };
    let over = |(n, tree): (i32, &Tree)| {
        let level = tree.ladder.levels.get(place)?;
        (level.triangles > most as usize).then_some((level.triangles, n, level.mesh.bark.indices.len() / 3))
    };
    let (triangles, n, wood) = (1..).zip(trees).filter_map(over).max()?;
    let message = format!(
        "{} has {triangles} triangles, {wood} of them wood that can't be coarser; ask for {triangles}, or \
         for `forks: Plain` in `mesh`",
        plan.called(n)
    );
    Some(Note::new(about, message))
}

/// What is told of the impostor whose crossed planes show least of their tree: engines show those as long as nobody gives them a shader.
fn without_shader(plan: &Plan, trees: &[Tree], place: usize) -> Option<Note> {
    let planes = |(n, tree): (i32, &Tree)| Some((tree.ladder.levels.get(place)?.plain?, n));
    let all = (1..).zip(trees).filter_map(planes).filter(|(plain, _)| plain.coverage < PLAIN);
    let (Measured { coverage, pixels, .. }, n) = all.min_by(|a, b| a.0.coverage.total_cmp(&b.0.coverage))?;
    let message = format!(
        "without an impostor's shader its two planes cover {coverage:.2} of {} at {pixels} pixels: use the shader \
         (examples/engines), or give the atlas a larger `size`",
        plan.called(n)
    );
    Some(Note::new(format!("lods[{place}]"), message))
}

/// What is told of the tree that lost most of its leaves' area to its bound on triangles: leaves grow to twice their length at
/// most for those that go.
fn bared(plan: &Plan, trees: &[Tree], drawn: &dyn Fn(&Leaf) -> f32) -> Option<Note> {
    let left = |(n, tree): (i32, &Tree)| {
        let mesh = &tree.ladder.levels.first()?.mesh.leaf;
        let own = |leaf: &Leaf| leaf.size * leaf.size * leaf.form.width() * drawn(leaf);
        let all: f32 = tree.plant.leaves().iter().map(own).sum();
        (all > 0.0).then(|| (mesh.area() / all, n, tree.ladder.levels[0].triangles))
    };
    let trees = || (1..).zip(trees).filter_map(left).filter(|left| left.0 < BARED);
    let (share, n, triangles) = (plan.mesh.most < ANY).then(trees)?.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let message = format!(
        "{} keeps {share:.2} of its leaves' area in {triangles} triangles, though leaves are twice as long as they \
         were: raise `most`, or ask for a smaller `density` in `foliage`",
        plan.called(n)
    );
    Some(Note::new("mesh.most", message))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::base::{Key, Rotation, Seed};
    use crate::lod::specimen::plain;
    use crate::plant::{Plant, PlantBuilder};

    /// Triangles of a plant's full level, and what is told of it.
    fn told(plant: &Plant, most: u32) -> (usize, Vec<Note>) {
        told_of(plant, &format!("lods: [Full], mesh: (most: {most})"), 1.0)
    }

    /// A plant with the levels that more of a preset asks for, as if all but the first overlapped by `iou`.
    fn made(plant: &Plant, more: &str, iou: Option<f32>) -> (Plan, Tree) {
        let maps = plain();
        let text = format!("(sources: {{\"a\": Import(file: \"a.csv\")}}, variants: [Source(\"a\")], {more})");
        let plan = crate::preset::load("poles.ron", &text, &mut |_| Ok(String::new())).expect("loads");
        let mut made =
            crate::lod::ladder(plant, &plan.mesh, &plan.lods, std::slice::from_ref(&maps), &maps, Seed::new(1));
        if let Some(iou) = iou {
            made.levels.iter_mut().skip(1).for_each(|level| level.measured.iou = iou);
        }
        let (key, ladder) = (Key::of_bytes(b""), Arc::new(made));
        (plan, Tree { plant: Arc::new(plant.clone()), likeness: None, spared: 0.0, ladder, key, of: key })
    }

    /// Triangles of the full level of one, and what is told of it.
    fn told_of(plant: &Plant, more: &str, iou: f32) -> (usize, Vec<Note>) {
        let (plan, tree) = made(plant, more, Some(iou));
        let triangles = tree.ladder.levels[0].triangles;
        (triangles, notes(&plan, &[tree], &|_| 1.0))
    }

    #[test]
    fn a_crown_that_does_not_follow_its_sketch_is_told_the_least_like_of_several() {
        let text = "(sources: {\"a\": Import(file: \"a.csv\")}, variants: [Source(\"a\"), \
                    Sketch(of: \"a\", crown: \"a.svg\"), Sketch(of: \"a\", crown: \"b.svg\")])";
        let plan = crate::preset::load("poles.ron", text, &mut |_| Ok(String::new())).expect("loads");
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.05, 0.05]);
        let (_, tree) = made(&builder.finish().expect("a pole"), "lods: [Full]", None);
        let told = |of: [Option<f32>; 3]| -> Vec<Note> {
            let trees = of.map(|likeness| Tree { likeness, ..tree.clone() });
            let mut told = notes(&plan, &trees, &|_| 1.0);
            told.retain(|note| note.message.starts_with("its sketch"));
            told
        };
        assert_eq!(told([None, Some(0.71), None]), []);
        let found = told([Some(0.1), Some(0.71), Some(0.69)]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].about == "variants[2]" && found[0].message.contains("poles_003"), "{found:?}");
        assert!(found[0].message.contains("overlap by 0.69"), "{found:?}");
        // And one of which more would have wilted than may.
        let spared = [0.3, 0.2, 0.005].map(|spared| Tree { spared, ..tree.clone() });
        let mut found = notes(&plan, &spared, &|_| 1.0);
        found.retain(|note| note.message.starts_with("its sketch"));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].about == "variants[1]" && found[0].message.contains("20 % more of the foliage of poles_002"));
    }

    #[test]
    fn bare_crowns_are_advised_what_helps_twigs_and_leafy_ones_what_helps_leaves() {
        let of = |leaves: u32| {
            let mut builder = PlantBuilder::new();
            let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.05, 0.05]);
            builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.02, 0.01]);
            for i in 0..leaves {
                let turned = Rotation::about(Seed::new(1).at(i.into()).direction(), 1.0);
                builder.leaf(Leaf::new(stem, i as f32 / leaves as f32, turned, 0.2, 0));
            }
            let plant = builder.finish().expect("a twig on a pole");
            let (_, notes) = told_of(&plant, "lods: [Full, BillboardCloud(cards: 4), Impostor(frames: 8)]", 0.3);
            let unlike = |place: usize| {
                let about = format!("lods[{place}]");
                let mut of = notes.iter().filter(|note| note.about == about && note.message.contains("unlike"));
                of.next().expect("it is told").message.clone()
            };
            [unlike(1), unlike(2)]
        };
        for leaves in [0, 2] {
            let [cloud, impostor] = of(leaves);
            assert!(
                cloud.contains("leave it out") && !cloud.contains("atlas") && !cloud.contains("`cards`"),
                "{cloud}"
            );
            assert!(impostor.contains("no impostor") && impostor.contains("smaller `screen`"), "{impostor}");
            assert!(!impostor.contains("atlas"), "{impostor}");
        }
        let [cloud, impostor] = of(60);
        assert!(cloud.contains("more `cards`") && impostor.contains("the atlas a larger"), "{cloud}, {impostor}");
    }

    #[test]
    fn an_impostor_of_very_many_frames_is_told_to_have_fewer() {
        let plant = crate::lod::specimen::on_trunk(Vec3::ZERO, (4.0, 0.15), (24, 6));
        for (frames, is_more) in [(13, true), (12, false)] {
            let (_, notes) = told_of(&plant, &format!("lods: [Full, Impostor(frames: {frames})]"), 0.3);
            let note = &notes.iter().find(|note| note.about == "lods[1]").expect("it is unlike").message;
            assert_eq!(note.contains("fewer `frames`"), is_more, "{note}");
        }
    }

    #[test]
    fn pictures_of_more_ground_than_tree_are_told_with_what_helps() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.05, 0.05]);
        builder.leaf(Leaf::new(stem, 0.9, Rotation::IDENTITY, 0.2, 0));
        let plant = builder.finish().expect("a leaf on a pole");
        for (below, is_more) in [(10, true), (1, false)] {
            let (_, notes) = told_of(&plant, &format!("lods: [Full, CrossedQuads], mesh: (below: {below})"), 0.3);
            let note = &notes.iter().find(|note| note.about == "lods[1]").expect("it is unlike").message;
            assert_eq!(note.contains(&format!("stems go on {below} m below the ground")), is_more, "{note}");
        }
    }

    #[test]
    fn wood_beyond_its_budget_is_told_with_what_helps() {
        let mut builder = PlantBuilder::new();
        for i in 0..100 {
            let at = Vec3::new(i as f32 * 0.2, 0.0, 0.0);
            builder.stem(at, &[Vec3::ZERO, Vec3::Y], &[0.05, 0.05]);
        }
        let plant = builder.finish().expect("a hundred poles");
        let (triangles, notes) = told(&plant, 200);
        assert!(triangles > 200 && notes.len() == 1, "{triangles}, {notes:?}");
        assert_eq!(notes[0].about, "mesh.most");
        assert!(
            notes[0].message.contains(&format!("has {triangles} triangles, {triangles} of them wood")),
            "{notes:?}"
        );
        assert_eq!(told(&plant, 20_000).1, []);
    }
    #[test]
    fn leaves_that_there_are_no_triangles_for_are_told() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.05, 0.05]);
        for i in 0..1000 {
            let turned = Rotation::about(Seed::new(1).at(i).direction(), 1.0);
            builder.leaf(Leaf::new(stem, i as f32 / 1000.0, turned, 0.1, 0));
        }
        let plant = builder.finish().expect("a leafy pole");
        let told = |most: u32| {
            let (_, notes) = told(&plant, most);
            notes.into_iter().map(|note| note.message).collect::<Vec<_>>()
        };
        // Nearly 150 of four times the area; then half of all, and no larger for it than need be.
        let few = told(600);
        assert!(
            few.len() == 1 && few[0].starts_with("poles_001 keeps 0.60") && few[0].contains("area in 599"),
            "{few:?}"
        );
        assert_eq!(told(2400), Vec::<String>::new());
        // Of cards that are cut to their outlines that much is there: nothing is lost.
        let (plan, tree) = made(&plant, "lods: [Full], mesh: (most: 600)", None);
        let lost = |drawn: f32| bared(&plan, std::slice::from_ref(&tree), &|_| drawn).map(|note| note.message);
        assert!(lost(1.0).is_some() && lost(0.6).is_none());
    }

    #[test]
    fn an_impostor_that_is_little_without_its_shader_is_told() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.05, 0.05]);
        for i in 0..60 {
            let turned = Rotation::about(Seed::new(1).at(i).direction(), 1.0);
            builder.leaf(Leaf::new(stem, i as f32 / 60.0, turned, 0.6, 0));
        }
        let plant = builder.finish().expect("a leafy pole");
        let (plan, tree) = made(&plant, "lods: [Full, Impostor(frames: 8)]", None);
        let measured = tree.ladder.levels[1].plain.expect("planes are measured");
        let is_full = tree.ladder.levels[0].plain.is_none();
        assert!(measured.coverage > 0.2 && measured.iou > 0.1 && is_full, "{measured:?}");
        let told = |coverage: f32| {
            let mut ladder = (*tree.ladder).clone();
            ladder.levels[1].plain = Some(Measured { coverage, ..measured });
            without_shader(&plan, &[Tree { ladder: Arc::new(ladder), ..tree.clone() }], 1).map(|note| note.message)
        };
        assert!(told(0.5).is_some_and(|note| note.contains("cover 0.50 of poles_001")) && told(0.9).is_none());
    }
}
