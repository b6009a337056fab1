//! The figures of the paper as tests (2015): two or three passes over one small graph, and what every vector of the
//! structure must be after them. Exact where the paper gives angles; where it shows a picture, by what the picture shows.

use glam::Vec3;

use super::nodes::Nodes;
use super::structure::{Member, Structure};
use super::{Solids, Space, extend};
use crate::base::{Seed, math};
use crate::preset::plan::{
    Count, EndpointRule, Endpoints, FieldAxis, FieldPart, FieldPrimitive, FieldRegion, GrowIteration, GrowParams,
    Guide, GuideAxis, GuideStart, Sampling, Volume,
};

fn volume(shape: Volume, count: u32) -> Endpoints {
    Endpoints::Volume { shape, count: Count::Number(count), sampling: Sampling::Poisson }
}

fn pass(endpoints: Endpoints, guide: Guide) -> GrowIteration {
    GrowIteration { endpoints, guide, axis: GuideAxis::Vector, start: GuideStart::Kept, keep: EndpointRule::Any }
}

fn piecewise(alpha1: f32, alpha2: f32, h0: u32) -> Guide {
    Guide::Piecewise { alpha1: alpha1.to_radians(), alpha2: alpha2.to_radians(), h0 }
}

fn straight() -> Guide {
    Guide::Constant { alpha: 0.0 }
}

/// The trunk of most figures: one endpoint, no turn.
fn trunk() -> GrowIteration {
    pass(volume(Volume::Point { height: 0.6, out: 0.0, turn: None }, 1), straight())
}

/// The crown of Fig. 6 and 9.
fn crown() -> Endpoints {
    volume(Volume::HalfEllipsoid { bottom: 0.3, top: 0.9, radius: 0.4, hollow: 0.5 }, 40)
}

/// A structure after some passes, and how many members it had before the last.
struct Grown {
    nodes: Nodes,
    members: Vec<Member>,
    before: usize,
}

fn grown(iterations: &[GrowIteration]) -> Grown {
    grown_among(4000, iterations)
}

fn grown_among(count: u32, iterations: &[GrowIteration]) -> Grown {
    let space = Space::new(Nodes::scatter(count, 1.2, Seed::new(11)));
    let params = params(iterations);
    let mut structure = Structure::new(&space.nodes);
    let mut before = 0;
    for (i, iteration) in iterations.iter().enumerate() {
        before = structure.members.len();
        let seed = Seed::new(5).at(i as u64);
        extend(&mut structure, &space, &Solids::new(), iteration, &params, seed, |_| {});
    }
    assert!(structure.members.len() > before + 20);
    Grown { nodes: space.nodes, members: structure.members, before }
}

fn params(iterations: &[GrowIteration]) -> GrowParams {
    let text = "(height: 10.0, nodes: 4000, iterations: [(endpoints: Surface(k: 1, count: 1))])";
    let params = crate::preset::species("figure.ron", text).expect("a species");
    GrowParams { iterations: iterations.to_vec(), ..params }
}

impl Grown {
    fn at(&self, member: usize) -> Vec3 {
        self.nodes.at(self.members[member].node)
    }

    fn parent(&self, member: usize) -> usize {
        self.members[member].parent as usize
    }

    /// The members of the last pass: index, hops from the structure before it, and where they left that.
    fn last(&self) -> Vec<(usize, u32, usize)> {
        (self.before..self.members.len())
            .map(|i| {
                let (mut hops, mut at) = (0, i);
                while at >= self.before {
                    (hops, at) = (hops + 1, self.parent(at));
                }
                (i, hops, at)
            })
            .collect()
    }

    /// Angle of a member's guiding vector from upright, degrees.
    fn lean(&self, member: usize) -> f32 {
        math::angle(self.members[member].vector, Vec3::Y).to_degrees()
    }

    /// Members of the last pass at which it ends.
    fn tips(&self) -> Vec<usize> {
        let mut bears = vec![false; self.members.len()];
        self.members.iter().skip(1).for_each(|m| bears[m.parent as usize] = true);
        (self.before..self.members.len()).filter(|&i| !bears[i]).collect()
    }

    /// Mean over the edges of the last pass of what `of` says of an edge: its middle and its direction.
    fn mean(&self, of: impl Fn(Vec3, Vec3) -> f32) -> f32 {
        let edges = self.before..self.members.len();
        let count = edges.len() as f32;
        let one = |i: usize| {
            let (a, b) = (self.at(self.parent(i)), self.at(i));
            of((a + b) * 0.5, (b - a).normalize())
        };
        edges.map(one).sum::<f32>() / count
    }
}

/// Second passes that differ only in their rule, as Fig. 6.
fn after(guide: Guide) -> Grown {
    grown(&[trunk(), pass(crown(), guide)])
}

#[test]
fn figure_5_and_6_vectors_turn_by_equation_one() {
    for (alpha1, alpha2, h0) in [(10.0, 10.0, 1), (60.0, 0.0, 1), (15.0, -5.0, 5), (6.0, -6.0, 20)] {
        let tree = after(piecewise(alpha1, alpha2, h0));
        for (member, hops, _) in tree.last() {
            let first = hops.min(h0) as f32 * alpha1;
            // Turns stop at up and down.
            let expected = (first + hops.saturating_sub(h0) as f32 * alpha2).clamp(0.0, 180.0);
            let lean = tree.lean(member);
            assert!((lean - expected).abs() < 0.05, "{alpha1} {alpha2} {h0}, hop {hops}: {lean}, not {expected}");
        }
    }
}

#[test]
fn figure_6_branches_that_keep_turning_bend_over() {
    // How much less the outer half of a branch rises than the inner. At 4,000 nodes a branch has five edges, each up to
    // 45 degrees off its vector, and nothing of the curve is left; so this takes more nodes, and whole halves.
    let bend = |guide| {
        let tree = grown_among(30_000, &[trunk(), pass(crown(), guide)]);
        let (last, tips) = (tree.last(), tree.tips());
        let rise = |i: &usize| (tree.at(*i) - tree.at(tree.parent(*i))).normalize().y;
        let mean = |half: &[usize]| half.iter().map(rise).sum::<f32>() / half.len().max(1) as f32;
        let of = |&tip: &usize| {
            let source = last[tip - tree.before].2;
            let mut way = vec![tip];
            while tree.parent(way[way.len() - 1]) != source {
                way.push(tree.parent(way[way.len() - 1]));
            }
            let (outer, inner) = way.split_at(way.len() / 2);
            mean(inner) - mean(outer)
        };
        tips.iter().map(of).sum::<f32>() / tips.len() as f32
    };
    let (a, b) = (bend(piecewise(10.0, 10.0, 1)), bend(piecewise(60.0, 0.0, 1)));
    assert!(a > b + 0.2, "{a} {b}");
}

#[test]
fn figure_6c_and_15_each_node_of_the_trunk_has_an_angle_of_its_own() {
    let guide = Guide::Random { low: 30_f32.to_radians(), high: 120_f32.to_radians(), alpha2: 0.0, h0: 1 };
    let tree = after(guide);
    let mut of_source = std::collections::BTreeMap::new();
    for (member, _, source) in tree.last() {
        let lean = tree.lean(member);
        assert!((29.9..120.1).contains(&lean));
        let same = *of_source.entry(source).or_insert(lean);
        assert!((same - lean).abs() < 0.05, "{same} {lean}");
    }
    assert!(of_source.len() > 3);
}

#[test]
fn figure_7_vectors_turn_by_equation_two() {
    let theta = 25.0;
    let shape = Volume::HalfEllipsoid { bottom: 0.5, top: 0.9, radius: 0.5, hollow: 0.6 };
    let tree = grown(&[pass(volume(shape, 30), Guide::Polar { theta: 25_f32.to_radians() })]);
    for member in 1..tree.members.len() {
        let beta = math::angle(tree.at(member), Vec3::Y).to_degrees();
        let expected = (tree.lean(tree.parent(member)) + theta * (beta / 180.0).sqrt()).min(180.0);
        assert!((tree.lean(member) - expected).abs() < 0.05, "{} {expected}", tree.lean(member));
    }
}

#[test]
fn figure_8_branches_follow_the_fields() {
    let field =
        |primitive| Guide::Field { parts: vec![FieldPart { primitive, weight: 1.0, region: FieldRegion::Everywhere }] };
    let along = |tree: &Grown, primitive: FieldPrimitive| {
        let part = [FieldPart { primitive, weight: 1.0, region: FieldRegion::Everywhere }];
        tree.mean(|at, along| super::field::vector(&part, at).map_or(0.0, |v| v.dot(along)))
    };
    let plain = after(piecewise(60.0, 0.0, 1));
    for (primitive, gain) in [
        (FieldPrimitive::Helical { rise: 20_f32.to_radians() }, 0.3),
        (FieldPrimitive::Rotational { axis: FieldAxis::Z, height: 0.5 }, 0.2),
        (FieldPrimitive::Spherical { height: 0.6 }, 0.1),
    ] {
        let tree = after(field(primitive));
        let (with, without) = (along(&tree, primitive), along(&plain, primitive));
        assert!(with > without + gain, "{primitive:?}: {with} {without}");
        // The vectors themselves are the field's, also on the trunk that branches leave.
        for (member, _, _) in tree.last() {
            let part = [FieldPart { primitive, weight: 1.0, region: FieldRegion::Everywhere }];
            if let Some(v) = super::field::vector(&part, tree.at(member)) {
                assert!((v - tree.members[member].vector).length() < 1e-5);
            }
        }
    }
}

#[test]
fn figure_9_crowns_keep_to_their_volume() {
    let none = Solids::new();
    for shape in [
        Volume::Ellipsoid { bottom: 0.3, top: 0.9, radius: 0.3, hollow: 0.0 },
        Volume::Cone { bottom: 0.3, top: 0.9, radius: 0.4, hollow: 0.0 },
        Volume::Box { bottom: 0.4, top: 0.8, width: 0.6, depth: 0.6, hollow: 0.5 },
    ] {
        let tree = grown(&[trunk(), pass(volume(shape.clone(), 40), straight())]);
        let tips = tree.tips();
        assert!(
            tips.len() > 25
                && tips.iter().all(|&t| super::volume::holds(&shape, super::volume::solid(&shape, &none), tree.at(t)))
        );
    }
}

#[test]
fn figure_12_the_smaller_t_the_farther_out_the_twigs() {
    let height = |t| {
        let surface = Endpoints::Surface { k: 2, t, irregular: 0.0, count: 120, sampling: Sampling::Poisson };
        let tree = grown(&[trunk(), pass(crown(), piecewise(40.0, 0.0, 1)), pass(surface, piecewise(30.0, 0.0, 1))]);
        let tips = tree.tips();
        tips.iter().map(|&t| tree.at(t).length()).sum::<f32>() / tips.len() as f32
    };
    let (third, most, all) = (height(0.3), height(0.6), height(1.0));
    assert!(third > most + 0.03 && most > all + 0.03, "{third} {most} {all}");
}

#[test]
fn figure_13_only_lower_endpoints_hang() {
    let tree = grown(&[
        trunk(),
        pass(crown(), piecewise(40.0, 0.0, 1)),
        GrowIteration {
            keep: EndpointRule::Lower,
            ..pass(
                Endpoints::Surface { k: 3, t: 1.0, irregular: 0.0, count: 80, sampling: Sampling::Poisson },
                piecewise(40.0, 20.0, 1),
            )
        },
    ]);
    let sources: Vec<usize> = tree.last().iter().map(|&(_, _, source)| source).collect();
    assert!(tree.tips().iter().all(|&t| tree.at(t).y < tree.at(sources[t - tree.before]).y));
}

#[test]
fn figure_14_endpoints_and_branch_tips_are_one_to_one() {
    for count in [40, 80, 160] {
        let surface = Endpoints::Surface { k: 2, t: 1.0, irregular: 0.0, count, sampling: Sampling::Poisson };
        let tree = grown(&[trunk(), pass(crown(), piecewise(40.0, 0.0, 1)), pass(surface, piecewise(30.0, 0.0, 1))]);
        let tips = tree.tips().len();
        // A path may pass through another's end: that one is no tip any more.
        assert!(tips <= count as usize && tips * 10 >= count as usize * 9, "{tips} of {count}");
    }
}

#[test]
fn figure_16_crowns_and_branches_change_in_steps_with_their_parameters() {
    // Half-ellipsoids of aspects 1.5, 0.9, 0.5 and 0.3, and θ of 14 to 32 degrees: crowns get flatter and branches lower
    // from one to the next, while there are as many twigs.
    let tree = |(aspect, theta): (f32, f32)| {
        let radius = (0.6 / aspect).min(0.58);
        let shape = Volume::HalfEllipsoid { bottom: 0.3, top: 0.3 + radius * aspect, radius, hollow: 0.6 };
        let guide = Guide::Polar { theta: theta.to_radians() };
        let twigs = Endpoints::Surface { k: 2, t: 0.7, irregular: 0.0, count: 120, sampling: Sampling::Poisson };
        let trunk = pass(volume(Volume::Point { height: 0.3, out: 0.0, turn: None }, 1), straight());
        let tree = grown_among(12_000, &[trunk, pass(volume(shape, 50), guide.clone()), pass(twigs, guide)]);
        let tips = tree.tips();
        let count = tips.len() as f32;
        let out = tips.iter().map(|&t| Vec3::new(tree.at(t).x, 0.0, tree.at(t).z).length()).sum::<f32>() / count;
        let up = tips.iter().map(|&t| tree.at(t).y).sum::<f32>() / count - 0.3;
        (up / out, tree.mean(|_, along| along.y), count)
    };
    let trees = [(1.5, 14.0), (0.9, 20.0), (0.5, 26.0), (0.3, 32.0)].map(tree);
    for pair in trees.windows(2) {
        assert!(pair[1].0 < pair[0].0 * 0.9, "{trees:?}");
        assert!(pair[1].1 < pair[0].1, "{trees:?}");
        assert!((pair[1].2 / pair[0].2 - 1.0).abs() < 0.15, "{trees:?}");
    }
}

#[test]
fn figure_17b_the_lower_part_droops_and_the_upper_rises() {
    let guide = Guide::Split {
        height: 0.4,
        lower: Box::new(Guide::Constant { alpha: 8_f32.to_radians() }),
        upper: Box::new(piecewise(30.0, -10.0, 3)),
    };
    let tree = after(guide);
    let (mut low, mut high) = (0, 0);
    for (member, hops, source) in tree.last() {
        let hop = hops as f32;
        let expected = if tree.at(source).y < 0.4 {
            low += 1;
            8.0 * hop
        } else {
            high += 1;
            hop.min(3.0) * 30.0 - (hop - 3.0).max(0.0) * 10.0
        };
        assert!((tree.lean(member) - expected.clamp(0.0, 180.0)).abs() < 0.05);
    }
    assert!(low > 10 && high > 10, "{low} {high}");
}

#[test]
fn figure_17e_and_17i_branches_leave_by_their_height() {
    let start = GuideStart::ByHeight { low: 100_f32.to_radians(), high: 20_f32.to_radians() };
    let tree = grown(&[trunk(), GrowIteration { start, ..pass(crown(), straight()) }]);
    for (member, _, source) in tree.last() {
        let expected = 100.0 - 80.0 * tree.at(source).y;
        assert!((tree.lean(member) - expected).abs() < 0.05, "{} {expected}", tree.lean(member));
    }
}

#[test]
fn figure_17f_several_first_endpoints_leave_the_root_apart() {
    let shape = Volume::HalfEllipsoid { bottom: 0.4, top: 0.9, radius: 0.5, hollow: 0.7 };
    let tree = grown(&[pass(volume(shape, 16), piecewise(8.0, 0.0, 3))]);
    let rods = (1..tree.members.len()).filter(|&i| tree.parent(i) == 0).count();
    assert!(rods >= 4, "{rods}");
}
