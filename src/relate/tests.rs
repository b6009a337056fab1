//! Tests of the whole folder: plants in, blends out.

use glam::Vec3;

use super::family::NONE;
use super::random_plant::{Oddity, random_plant};
use super::{Family, FamilyError, Kin, KinId, Weights, fuzzy_family};
use crate::base::{Rotation, Seed};
use crate::plant::{ChainId, Curve, Leaf, Plant, PlantBuilder};
use crate::preset::plan::MatchParams;

const EVEN: MatchParams = MatchParams { crown: 0.5, direction: 0.3, ratio: 0.2 };

fn pair(seed: u64, most: usize, oddity: Oddity) -> Family {
    let plant = |name| random_plant(Seed::new(seed).child(name), most, oddity);
    fuzzy_family(plant("a"), plant("b"), &EVEN).unwrap()
}

/// The same share of the second source everywhere.
fn even(family: &Family, t: f32) -> Weights {
    let mut weights = Weights::new(family.kin_count(), 2);
    for kin in family.kin_ids() {
        let degree = match (family.member(kin, 0), family.member(kin, 1)) {
            (Some(_), None) => 1.0 - t,
            (None, _) => t,
            _ => 1.0,
        };
        weights.set(kin, &[1.0 - t, t], degree);
    }
    weights
}

#[test]
fn a_corner_is_its_source_to_the_last_bit() {
    for seed in 0..150 {
        let oddity = if seed % 3 == 0 { Oddity::Tame } else { Oddity::Wild };
        let family = pair(seed, 60, oddity);
        for (s, source) in family.sources().iter().enumerate() {
            assert!(family.blend(&family.corner(s)) == *source, "seed {seed}, source {s}");
        }
    }
}

#[test]
fn a_member_bears_the_same_chain_whether_taken_whole_or_through_the_resampled_sum() {
    // Just off the corner the resampled, turned sum is used: the tree must not jump.
    for seed in 0..60 {
        let family = pair(seed, 40, Oddity::Tame);
        for s in 0..2 {
            let source = &family.sources()[s];
            let posed = source.pose();
            let blended = family.blend(&even(&family, if s == 0 { 1e-6 } else { 1.0 - 1e-6 }));
            let off = blended.pose();
            let present: Vec<KinId> = family.kin_ids().collect();
            for (chain, kin) in present.iter().enumerate() {
                let Some(own) = family.member(*kin, s) else { continue };
                let id = ChainId(chain as u32);
                for i in 0..=8 {
                    let t = f64::from(i) / 8.0;
                    let (a, b) = (posed.curve(source, own).point(t), off.curve(&blended, id).point(t));
                    assert!(a.distance(b) < source.height() * 2e-4, "seed {seed} kin {kin:?}: {a} {b}");
                    let radius = |plant: &Plant, id| Curve::new(plant.points(id)).value(plant.radii(id), t);
                    let (a, b) = (radius(source, own), radius(&blended, id));
                    assert!((a - b).abs() < source.height() * 2e-3, "seed {seed} kin {kin:?}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn every_blend_is_a_plant_whatever_the_weights() {
    for seed in 0..150 {
        let family = pair(seed, 40, Oddity::Wild);
        let draw = Seed::new(seed).child("weights");
        let mut weights = Weights::new(family.kin_count(), 2);
        for kin in family.kin_ids() {
            let d = draw.at(u64::from(kin.0));
            let odd = [0.0, 1.0, f32::NAN, f32::INFINITY, -1.0, 1e-30, 3e38, 2.0];
            let any = |d: Seed| if d.at(0).unit() < 0.3 { odd[d.at(1).index(8)] } else { d.at(2).unit() };
            weights.set(kin, &[any(d.child("a")), any(d.child("b"))], any(d.child("d")));
        }
        // `finish_trusted` validates in this profile.
        let plant = family.blend(&weights);
        assert!(!plant.chains().is_empty());
    }
    let family = pair(1, 10, Oddity::Tame);
    assert_eq!(family.blend(&Weights::new(0, 0)).chains().len(), 1);
}

#[test]
fn shapes_radii_origins_and_locations_meet_half_way() {
    let tree = |x: f32, height: f32, reach: Vec3, location: f32, radius: f32| {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::X * x, &[Vec3::ZERO, Vec3::Y * height], &[radius, radius * 0.5]);
        builder.branch(stem, location, &[Vec3::ZERO, reach], &[radius * 0.2, radius * 0.2]);
        builder.finish().unwrap()
    };
    let (a, b) = (tree(0.0, 2.0, Vec3::X, 0.2, 0.1), tree(1.0, 4.0, Vec3::Z * 3.0, 0.6, 0.2));
    let family = fuzzy_family(a, b, &EVEN).unwrap();
    let plant = family.blend(&even(&family, 0.5));
    let (stem, branch) = (plant.chain(ChainId(0)), plant.chain(ChainId(1)));
    assert_eq!(stem.origin, Vec3::X * 0.5);
    assert_eq!(plant.points(ChainId(0))[1], Vec3::Y * 3.0);
    assert!((branch.location - 0.4).abs() < 1e-6);
    // Slerp of the branching vectors: between the two at their mean length, where a linear blend would be shorter.
    let tip = plant.points(ChainId(1))[1];
    assert!((tip - Vec3::new(2.0, 0.0, 2.0) * 0.5_f32.sqrt()).length() < 1e-5, "{tip}");
    assert!((plant.radii(ChainId(0))[1] - 0.075).abs() < 1e-6);
}

#[test]
fn growth_scales_a_chain_and_its_leaves_and_thins_its_parent() {
    let bare = |builder: &mut PlantBuilder, radii: &[f32; 3]| {
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], radii)
    };
    let mut builder = PlantBuilder::new();
    bare(&mut builder, &[0.19, 0.15, 0.1]);
    let a = builder.finish().unwrap();
    let mut builder = PlantBuilder::new();
    let stem = bare(&mut builder, &[0.2, 0.15, 0.1]);
    let twig = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.1, 0.05]);
    (0..80).for_each(|i| builder.leaf(Leaf::new(twig, (i as f32 + 1.0) / 80.0, Rotation::IDENTITY, 0.3, 2)));
    let b = builder.finish().unwrap();
    let family = fuzzy_family(a, b, &EVEN).unwrap();
    let mut weights = family.corner(1);
    weights.set(KinId(1), &[0.0, 1.0], 0.5);
    let plant = family.blend(&weights);
    assert_eq!(plant.points(ChainId(1))[1], Vec3::X * 0.5);
    assert_eq!(plant.radii(ChainId(1)), [0.05, 0.025]);
    // Half as long a twig has leaves of half the area, so that trees half way are as full as both.
    let area: f32 = plant.leaves().iter().map(|leaf| leaf.size * leaf.size).sum::<f32>() / (80.0 * 0.3 * 0.3);
    assert!((area - 0.55).abs() < 0.1, "{area}");
    // By fewer of them, most of their size.
    let whole = plant.leaves().iter().filter(|leaf| leaf.size == 0.3).count();
    assert!(plant.leaves().len() < 60 && whole > 30, "{} {whole}", plant.leaves().len());
    let radii = plant.radii(ChainId(0));
    assert!(radii[0] < 0.2 && radii[0] > radii[1] && radii[2] == 0.1, "{radii:?}");
    weights.set(KinId(1), &[0.0, 1.0], 0.0);
    let plant = family.blend(&weights);
    assert!(plant.chains().len() == 1 && plant.leaves().is_empty());
    // But no thinner than in the source that has it thinner.
    assert!((plant.radii(ChainId(0))[0] - 0.19).abs() < 1e-6, "{:?}", plant.radii(ChainId(0)));
}

#[test]
fn blends_bear_as_many_leaves_as_their_sources_whatever_the_shares() {
    let plant = random_plant(Seed::new(3), 60, Oddity::Tame);
    let twins = fuzzy_family(plant.clone(), plant.clone(), &EVEN).unwrap();
    let sizes = |plant: &Plant| {
        let mut sizes: Vec<f32> = plant.leaves().iter().map(|leaf| leaf.size).collect();
        sizes.sort_by(f32::total_cmp);
        sizes
    };
    for share in [0.1, 0.5, 0.77] {
        assert_eq!(sizes(&twins.blend(&even(&twins, share))), sizes(&plant), "of twins each leaf is there once");
    }
    // Sixty leaves along one stem and twenty along the other.
    let stem = |count: u16, slot| {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.2, 0.1]);
        for i in 0..count {
            let location = (f32::from(i) + 0.5) / f32::from(count);
            builder.leaf(Leaf::new(stem, location, Rotation::IDENTITY, 0.3, slot));
        }
        builder.finish().unwrap()
    };
    let family = fuzzy_family(stem(60, 0), stem(20, 1), &EVEN).unwrap();
    for (share, least) in [(0.25, [44, 4]), (0.5, [29, 9]), (0.75, [14, 14])] {
        let plant = family.blend(&even(&family, share));
        let worn = |slot| plant.leaves().iter().filter(|leaf| leaf.slot == slot).count();
        let found = [worn(0), worn(1)];
        assert!((0..2).all(|s| (least[s]..least[s] + 3).contains(&found[s])), "{share}: {found:?}");
        let lower = plant.leaves().iter().filter(|leaf| leaf.location < 0.5).count() as f32;
        assert!((lower / plant.leaves().len() as f32 - 0.5).abs() < 0.1, "no end of the stem is bare");
    }
}

#[test]
fn children_stay_within_their_parents_and_chains_taper() {
    for seed in 0..80 {
        let family = pair(seed, 40, Oddity::Tame);
        let plant = family.blend(&even(&family, Seed::new(seed).child("t").unit()));
        for id in plant.chain_ids() {
            let radii = plant.radii(id);
            assert!(radii.windows(2).all(|w| w[1] <= w[0] * 1.0001), "seed {seed} {id:?}: {radii:?}");
            let chain = plant.chain(id);
            let Some(parent) = chain.parent else { continue };
            let there = Curve::new(plant.points(parent)).value(plant.radii(parent), f64::from(chain.location));
            // The tame sources themselves may be stouter than their parent where it tapers.
            let kin = family.row(id.index());
            let most = kin.iter().filter(|m| m.chain != NONE).fold(1.0_f32, |s, m| s.max(m.stoutness));
            assert!(radii[0] <= there * most * 1.001, "seed {seed} {id:?}: {} {there} {most}", radii[0]);
        }
    }
}

#[test]
fn three_sources_and_shared_members_have_their_corners() {
    for seed in 0..30 {
        let plants: Vec<Plant> =
            (0..3).map(|i| random_plant(Seed::new(seed).child("n").at(i), 12, Oddity::Wild)).collect();
        // Kins that hold one source each, then doubled for the second source (as a split would), then one that
        // joins the first stems of all.
        let stem = |_: usize| Some(ChainId(0));
        let mut kins = vec![Kin { parent: None, members: (0..3).map(stem).collect() }];
        for (s, plant) in plants.iter().enumerate() {
            let mut own: Vec<KinId> = vec![KinId(0)];
            for id in plant.chain_ids().skip(1) {
                own.push(KinId(kins.len() as u32));
                let parent = plant.chain(id).parent.map(|p| own[p.index()]);
                let members: Vec<_> = (0..3).map(|m| (m == s).then_some(id)).collect();
                if s == 1 {
                    kins.push(Kin { parent, members: members.clone() });
                }
                kins.push(Kin { parent, members });
            }
        }
        let family = Family::new(plants, &kins).unwrap();
        for (s, source) in family.sources().iter().enumerate() {
            assert!(family.blend(&family.corner(s)) == *source, "seed {seed}, source {s}");
        }
    }
}

#[test]
fn a_blended_chain_reaches_as_far_as_its_members_do_on_average() {
    let bent = |side: f32| {
        let mut builder = PlantBuilder::new();
        builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0, Vec3::new(side, 3.0, 0.0)], &[0.1, 0.1, 0.1]);
        builder.finish().unwrap()
    };
    let family = fuzzy_family(bent(2.0), bent(-2.0), &EVEN).unwrap();
    let tip = family.blend(&even(&family, 0.5)).points(ChainId(0))[2];
    assert!((tip - Vec3::Y * 13.0_f32.sqrt()).length() < 1e-5, "{tip}");
}

/// Real scans and grown structure: what no made-up plant has.
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test must say so")]
fn real_plants_blend_back_to_themselves() {
    use crate::preset::plan::{ImportHeight, ImportParams};
    let folder = std::env::var("TREEWRIGHT_DATA")
        .map_or_else(|_| std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), Into::into);
    let folder = folder.join("skeleton");
    let names = ["itsme_tree_2.csv", "rtwig_small.csv", "pyhelios_olive_900_qsm.txt", "eztree_oak_medium.swc"];
    let mut plants = Vec::new();
    for name in names {
        let Ok(bytes) = std::fs::read(folder.join(name)) else {
            assert!(std::env::var_os("CI").is_none(), "{name} is not in {}", folder.display());
            eprintln!("skipped: {name} is not there");
            return;
        };
        let params = ImportParams { file: name.into(), height: ImportHeight::Metres(10.0), ..ImportParams::default() };
        plants.push(crate::source::import::import(&bytes, name, &params).unwrap().plant);
    }
    for (i, a) in plants.iter().enumerate() {
        for b in &plants[i + 1..] {
            let family = fuzzy_family(a.clone(), b.clone(), &EVEN).unwrap();
            assert!(family.blend(&family.corner(0)) == *a && family.blend(&family.corner(1)) == *b);
            let half = family.blend(&even(&family, 0.5));
            assert_eq!(crate::plant::PlantStats::of(&half).topology_continuity, 1.0);
            let height = half.height();
            assert!((5.0..15.0).contains(&height), "{height}");
        }
    }
}

#[test]
fn kins_that_are_no_correspondence_are_refused() {
    let tree = || {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.1]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X], &[0.1, 0.1]);
        builder.finish().unwrap()
    };
    let kin = |parent: Option<u32>, a: Option<u32>, b: Option<u32>| Kin {
        parent: parent.map(KinId),
        members: vec![a.map(ChainId), b.map(ChainId)],
    };
    let error = |kins: &[Kin]| Family::new(vec![tree(), tree()], kins).unwrap_err();
    let stems = kin(None, Some(0), Some(0));
    assert_eq!(error(&[stems.clone(), kin(Some(1), Some(1), Some(1))]), FamilyError::BadParent(KinId(1)));
    assert_eq!(error(&[stems.clone(), kin(Some(0), None, None)]), FamilyError::BadMembers(KinId(1)));
    assert_eq!(error(&[stems.clone(), kin(Some(0), Some(2), None)]), FamilyError::BadMembers(KinId(1)));
    assert_eq!(
        error(&[stems.clone(), kin(None, Some(1), Some(1))]),
        FamilyError::Adopted { kin: KinId(1), source_index: 0 }
    );
    assert_eq!(
        error(&[stems.clone(), kin(Some(0), Some(1), None)]),
        FamilyError::Orphan { chain: ChainId(1), source_index: 1 }
    );
    assert_eq!(Family::new(vec![], &[]).unwrap_err(), FamilyError::Empty);
    let mut builder = PlantBuilder::new();
    builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 3e38], &[0.1, 0.1]);
    let huge = builder.finish().unwrap();
    let kins = [Kin { parent: None, members: vec![Some(ChainId(0))] }];
    assert_eq!(Family::new(vec![huge], &kins).unwrap_err(), FamilyError::TooLarge { source_index: 0 });
}

#[test]
fn each_chain_of_a_blend_is_told_its_kin() {
    let family = pair(7, 40, Oddity::Tame);
    let (plant, kins) = family.blend_with_kins(&family.corner(1));
    assert_eq!(kins.len(), plant.chains().len());
    assert!(plant.chain_ids().zip(&kins).all(|(id, kin)| family.member(*kin, 1) == Some(id)));
    let (plant, kins) = family.blend_with_kins(&even(&family, 0.5));
    assert!(
        plant
            .chain_ids()
            .zip(&kins)
            .all(|(id, &kin)| { family.parent(kin) == plant.chain(id).parent.map(|p| kins[p.index()]) })
    );
}

#[test]
fn the_order_of_the_sources_does_not_show_in_a_blend_of_three() {
    let pole = |azimuth: f32| {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.1, 0.05]);
        let way = Rotation::about(Vec3::Y, azimuth.to_radians()).rotate(Vec3::new(1.0, 0.3, 0.0));
        builder.branch(stem, 0.5, &[Vec3::ZERO, way, way * 2.0], &[0.04, 0.03, 0.02]);
        builder.finish().unwrap()
    };
    let mut sets = vec![vec![pole(0.0), pole(130.0), pole(210.0)], vec![pole(0.0), pole(120.0), pole(240.0)]];
    sets.extend((0..6).map(|seed| (0..3).map(|i| random_plant(Seed::new(seed).at(i), 30, Oddity::Tame)).collect()));
    let all = |family: &Family, shares: [f32; 3]| {
        let mut weights = Weights::new(family.kin_count(), 3);
        for kin in family.kin_ids() {
            let held = (0..3).filter(|&s| family.member(kin, s).is_some()).map(|s| shares[s]).sum::<f32>();
            weights.set(kin, &shares, held / shares.iter().sum::<f32>());
        }
        weights
    };
    let tips = |plant: &Plant| -> Vec<Vec3> {
        let pose = plant.pose();
        plant.chain_ids().map(|id| pose.curve(plant, id).point(1.0)).collect()
    };
    for (i, plants) in sets.iter().enumerate() {
        let shares = [[1.0, 1.0, 1.0], [0.5, 0.15, 0.35]][i % 2];
        for elastic in [false, true] {
            let trees = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(|order| {
                let plants: Vec<Plant> = order.iter().map(|&s| plants[s].clone()).collect();
                let family = match elastic {
                    true => super::elastic_family(plants, &crate::preset::plan::ElasticParams::default()),
                    false => super::nway_family(plants, &EVEN),
                };
                let family = family.unwrap();
                family.blend(&all(&family, order.map(|s| shares[s])))
            });
            let first = tips(&trees[0]);
            for tree in &trees[1..] {
                let found = tips(tree);
                assert_eq!(found.len(), first.len());
                for tip in &first {
                    let near = found.iter().map(|p| p.distance(*tip)).fold(f32::INFINITY, f32::min);
                    assert!(near < 2e-3, "{i} {elastic}: {near}");
                }
            }
            if i == 0 {
                let tip = first.iter().find(|p| Vec3::new(p.x, 0.0, p.z).length() > 0.3).unwrap();
                let azimuth = crate::base::math::atan2(-tip.z, tip.x).to_degrees();
                assert!((azimuth - 340.0 / 3.0).abs() < 0.1, "{azimuth}");
            }
        }
    }
}
