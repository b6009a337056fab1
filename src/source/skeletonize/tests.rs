//! Wood of every kind: what real files hold, and what nobody would draw.

use std::path::PathBuf;

use glam::{DVec3, Vec3};

use super::shapes;
use super::surface::Surface;
use super::{Method, SkeletonParams, Skeletonized, Wood, skeletonize};
use crate::base::Seed;
use crate::plant::PlantStats;
use crate::preset::plan::{ImportHeight, ImportParams, UpAxis};
use crate::source::foliage::{self, Overrides};
use crate::source::import::{agreement, agreement_at, import, import_with};
use crate::source::scene::{Files, read};

fn params(method: Method) -> SkeletonParams {
    SkeletonParams { up: UpAxis::Y, height: ImportHeight::AsIs, method, around: None }
}

fn found(wood: &Wood) -> Skeletonized {
    let found = skeletonize(wood, &params(Method::ByPiece)).unwrap();
    assert_eq!(PlantStats::of(&found.plant).topology_continuity, 1.0);
    found
}

fn wood(parts: &[Surface]) -> Wood {
    let mut wood = Wood::default();
    for part in parts {
        let first = wood.positions.len() as u32;
        wood.positions.extend(part.positions.iter().map(|p| p.as_vec3()));
        wood.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    wood
}

/// A straight tube of nine rings.
fn pole(from: DVec3, to: DVec3, thick: f64, thin: f64) -> Surface {
    let path: Vec<DVec3> = (0..9).map(|k| from.lerp(to, f64::from(k) / 8.0)).collect();
    let radii: Vec<f64> = (0..9).map(|k| thick + (thin - thick) * f64::from(k) / 8.0).collect();
    shapes::tube(&path, &radii, 7)
}

/// A trunk with four branches that start on its axis.
fn tree() -> Vec<Surface> {
    let mut parts = vec![pole(DVec3::ZERO, DVec3::Y * 8.0, 0.3, 0.1)];
    for k in 0..4 {
        let angle = f64::from(k) * 1.6;
        let out = DVec3::new(libm::cos(angle), 0.8, libm::sin(angle));
        let base = DVec3::Y * (3.0 + f64::from(k));
        parts.push(pole(base, base + out * 2.0, 0.1, 0.03));
    }
    parts
}

#[test]
fn both_ways_find_a_trunk_and_its_branches() {
    for method in [Method::ByPiece, Method::Contraction] {
        let found = skeletonize(&wood(&tree()), &params(method)).unwrap();
        let orders: Vec<u16> = found.plant.chains().iter().map(|c| c.order).collect();
        assert_eq!(orders, [1, 2, 2, 2, 2], "{method:?}");
        assert!((found.plant.height() - 8.0).abs() < 0.1);
        let trunk = found.plant.chain_ids().next().unwrap();
        assert!((found.plant.radii(trunk)[1] - 0.3).abs() < 0.05);
        for chain in &found.plant.chains()[1..] {
            let at = chain.location * 8.0;
            assert!((at - at.round()).abs() < 0.1, "{method:?} {at}");
        }
    }
}

/// The skin of boxes of whole units, each from its least to its greatest corner, which may overlap.
fn blocks(boxes: &[[[i32; 3]; 2]]) -> Surface {
    let is_full = |p: [i32; 3]| boxes.iter().any(|[low, high]| (0..3).all(|k| low[k] <= p[k] && p[k] < high[k]));
    let mut surface = Surface::default();
    let mut known = std::collections::BTreeMap::new();
    for [x, y, z] in (-16..16).flat_map(|x| (-16..16).flat_map(move |z| (0..32).map(move |y| [x, y, z]))) {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beside = [x, y, z];
            beside[axis] += 2 * side - 1;
            if !is_full([x, y, z]) || is_full(beside) {
                continue;
            }
            let corner = |u: i32, v: i32| {
                let mut p = [x, y, z];
                p[axis] += side;
                p[(axis + 1) % 3] += u;
                p[(axis + 2) % 3] += v;
                p
            };
            let corners = if side == 1 { [(0, 0), (1, 0), (1, 1), (0, 1)] } else { [(0, 0), (0, 1), (1, 1), (1, 0)] };
            let corners = corners.map(|(u, v)| {
                let p = corner(u, v);
                *known.entry(p).or_insert_with(|| {
                    surface.positions.push(DVec3::from_array(p.map(f64::from)));
                    surface.positions.len() as u32 - 1
                })
            });
            let [a, b, c, d] = corners;
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    surface
}

#[test]
fn a_shell_as_thick_as_it_is_high_stands_on_its_own_foot() {
    let trunk = [[-4, 0, -4], [4, 6, 4]];
    let arms = [[[4, 4, 0], [8, 6, 2]], [[6, 6, 0], [8, 10, 2]], [[-8, 4, -2], [-4, 6, 0]], [[-8, 6, -2], [-6, 12, 0]]];
    let more = [[[0, 4, 4], [2, 6, 9]], [[-1, 6, -1], [2, 9, 2]]];
    let boxes: Vec<_> = [trunk].into_iter().chain(arms).chain(more).collect();
    let found = found(&wood(&[blocks(&boxes)]));
    assert!(found.notes[0].contains("1 cut into layers"), "{:?}", found.notes);
    let plant = &found.plant;
    assert!(plant.height() > 10.8, "{}", plant.height());
    // The disc of the trunk's area, below its arms.
    let right = (64.0 / std::f32::consts::PI).sqrt();
    let stem = plant.chain_ids().next().unwrap();
    let posed = plant.pose();
    let lower = posed.chain(plant, stem).iter().zip(plant.radii(stem)).filter(|(p, _)| p.y < 3.0);
    for (place, radius) in lower.clone() {
        let beside = place.with_y(0.0).length();
        assert!(beside < 0.1 * right && (radius / right - 1.0).abs() < 0.1, "{place} {radius} for {right}");
    }
    assert!(lower.count() >= 2);
}

#[test]
fn twigs_of_three_triangles_are_twigs_and_loose_triangles_are_not() {
    let spike = |corners: [DVec3; 3], tip: DVec3| Surface {
        positions: corners.into_iter().chain([tip]).collect(),
        triangles: vec![[0, 1, 3], [1, 2, 3], [2, 0, 3]],
    };
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let slender = spike([at(0.3, 4.0, 0.02), at(0.3, 4.03, -0.02), at(0.3, 3.97, -0.02)], at(1.3, 4.5, 0.1));
    let flat = spike([at(-0.3, 4.0, 1.0), at(-0.3, 4.0, -1.0), at(-1.9, 4.0, -0.9)], at(-0.9, 4.02, 0.1));
    let stray = Surface {
        positions: vec![at(0.4, 5.0, 0.0), at(1.4, 5.0, 0.0), at(1.0, 5.6, 0.1)],
        triangles: vec![[0, 1, 2]],
    };
    let of = |parts: &[Surface]| found(&wood(&[tree(), parts.to_vec()].concat()));
    let (bare, spiky) = (of(&[]), of(&[slender]));
    assert_eq!(spiky.plant.chains().len(), bare.plant.chains().len() + 1, "{:?}", spiky.notes);
    let length =
        spiky.plant.chain_ids().map(|id| spiky.plant.points(id).last().unwrap().length()).fold(f32::MAX, f32::min);
    assert!((length - 1.4).abs() < 0.3, "a metre long, and its way into the trunk: {length}");
    for left in [flat, stray] {
        let found = of(&[left]);
        assert_eq!(found.plant, bare.plant);
        assert!(found.notes.iter().any(|note| note.contains("1 loose piece of few")), "{:?}", found.notes);
    }
}

#[test]
fn corners_of_their_own_and_doubled_faces_change_nothing() {
    let whole = wood(&tree());
    let mut loose = Wood::default();
    for t in &whole.triangles {
        for turn in [[0, 1, 2], [2, 1, 0]] {
            let first = loose.positions.len() as u32;
            loose.positions.extend(turn.map(|k| whole.positions[t[k] as usize]));
            loose.triangles.push([first, first + 1, first + 2]);
        }
    }
    assert_eq!(found(&whole).plant, found(&loose).plant);
}

#[test]
fn z_up_is_seen_and_placed() {
    let mut lying = wood(&tree());
    lying.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x + 5.0, -p.z, p.y + 100.0));
    let how =
        SkeletonParams { up: UpAxis::Detect, height: ImportHeight::Metres(4.0), method: Method::ByPiece, around: None };
    let found = skeletonize(&lying, &how).unwrap();
    assert!((found.plant.height() - 4.0).abs() < 1e-3);
    assert!((found.placement.scale() - 0.5).abs() < 0.01);
    let top = found.placement.point(Vec3::new(5.0, 0.0, 108.0));
    assert!((top - Vec3::Y * 4.0).length() < 0.01, "{top}");
}

#[test]
fn stems_that_stand_apart_stay_apart_and_loose_twigs_are_joined() {
    let two = [
        pole(DVec3::ZERO, DVec3::Y * 6.0, 0.2, 0.05),
        pole(DVec3::X * 2.0, DVec3::new(2.5, 5.0, 0.0), 0.2, 0.05),
        pole(DVec3::new(0.4, 4.0, 0.0), DVec3::new(1.4, 5.0, 0.0), 0.04, 0.01),
    ];
    let found = found(&wood(&two));
    let stems = found.plant.chains().iter().filter(|c| c.parent.is_none()).count();
    assert_eq!((stems, found.plant.chains().len()), (2, 3), "{:?}", found.notes);
    assert!(found.notes.iter().any(|n| n.contains("gap")), "{:?}", found.notes);
}

#[test]
fn a_fork_in_one_skin_is_contracted_to_a_fork() {
    let found = found(&wood(&[shapes::fork()]));
    assert_eq!(found.plant.chains().len(), 2);
    assert!(found.plant.chains().iter().filter(|c| c.parent.is_none()).count() == 1);
    assert!(found.notes.iter().any(|n| n.contains("contracted")));
}

#[test]
fn the_same_on_one_thread_and_on_two() {
    let wood = wood(&tree());
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| skeletonize(&wood, &params(Method::Contraction)).unwrap().plant)
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn hostile_meshes_end_soon_with_a_plant_or_an_error() {
    let seed = Seed::new(3);
    let triples = |n: u32| (0..n / 3).map(|i| [i * 3, i * 3 + 1, i * 3 + 2]).collect::<Vec<_>>();
    let try_all = |wood: &Wood| {
        for method in [Method::ByPiece, Method::Contraction] {
            if let Ok(found) = skeletonize(wood, &params(method)) {
                assert_eq!(PlantStats::of(&found.plant).topology_continuity, 1.0);
            }
        }
    };
    // Nothing, one place, loose triangles, and as many indices into a few places.
    try_all(&Wood::default());
    try_all(&Wood { positions: vec![Vec3::ONE; 3000], triangles: triples(3000) });
    let cloud: Vec<Vec3> = (0..9000).map(|i| seed.at(i).direction() * 3.0 + Vec3::Y * 3.0).collect();
    try_all(&Wood { positions: cloud.clone(), triangles: triples(9000) });
    let mess = (0..3000).map(|i| [0, 1, 2].map(|k| seed.at(i).at(k).index(400) as u32)).collect();
    try_all(&Wood { positions: cloud[..400].to_vec(), triangles: mess });
    // One fan of 20,000, flat and as a cone.
    let n = 20_000_u32;
    for rise in [0.0, 3.0] {
        let rim = |i: u32| {
            let angle = i as f32 / n as f32 * std::f32::consts::TAU;
            Vec3::new(crate::base::math::cos(angle), 0.0, crate::base::math::sin(angle))
        };
        let positions = std::iter::once(Vec3::Y * rise).chain((0..n).map(rim)).collect();
        try_all(&Wood { positions, triangles: (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect() });
    }
    // A Möbius strip, and a strip folded flat onto itself.
    let strip = |twist: u32| -> Wood {
        let m = 60_u32;
        let place = |i: u32, side: f32| {
            let angle = i as f32 / m as f32 * std::f32::consts::TAU;
            let (s, c) = crate::base::math::sin_cos(angle);
            let (ts, tc) = crate::base::math::sin_cos(angle * 0.5 * twist as f32);
            let out = 2.0 + side * tc * 0.4;
            Vec3::new(c * out, side * ts * 0.4, s * out)
        };
        let positions = (0..m).flat_map(|i| [place(i, 1.0), place(i, -1.0)]).collect();
        let at = |i: u32, side: u32| {
            let flipped = if i >= m { (side + twist) % 2 } else { side };
            (i % m) * 2 + flipped
        };
        let quad = |i: u32| [[at(i, 0), at(i, 1), at(i + 1, 1)], [at(i, 0), at(i + 1, 1), at(i + 1, 0)]];
        Wood { positions, triangles: (0..m).flat_map(quad).collect() }
    };
    try_all(&strip(0));
    try_all(&strip(1));
    // Coordinates that overflow when squared in single precision.
    let mut far = wood(&tree());
    far.positions.iter_mut().for_each(|p| *p *= 1e30);
    try_all(&far);
}

/// The folder of real trees, or none where the checkout has none; on CI it must be there.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
fn real_trees() -> Option<PathBuf> {
    let data = std::env::var_os("TREEWRIGHT_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    assert!(data.is_dir() || std::env::var_os("CI").is_none(), "no data at {}", data.display());
    if !data.is_dir() {
        eprintln!("skipped: no data at {}", data.display());
        return None;
    }
    Some(data)
}

#[test]
fn meshes_agree_with_the_skeletons_that_they_were_made_from() {
    let Some(data) = real_trees() else {
        return;
    };
    for name in ["eztree_aspen_small", "eztree_oak_medium", "eztree_pine_medium"] {
        let params = ImportParams::default();
        let mesh = std::fs::read(data.join(format!("mesh/{name}.glb"))).unwrap();
        let found = import_with(&mesh, name, &Files::new(), &params).unwrap().plant;
        let file = std::fs::read(data.join(format!("skeleton/{name}.swc"))).unwrap();
        let truth = import(&file, name, &params).unwrap().plant;
        let a = agreement(&found, &truth);
        assert!(a.length_found >= 0.95 && a.length_true >= 0.95, "{name} {a:?}");
        assert!(a.radius_error <= 0.1 && (a.chains - 1.0).abs() <= 0.15, "{name} {a:?}");
    }
}

#[test]
fn rings_and_contraction_agree_on_meshes_of_tubes() {
    let Some(data) = real_trees() else {
        return;
    };
    for name in ["eztree_aspen_small.glb", "eztree_oak_medium.glb", "eztree_pine_medium.glb", "tg_acer.glb"] {
        let file = std::fs::read(data.join("mesh").join(name)).unwrap();
        let scene = read(&file, name, &Files::new()).unwrap();
        let parts = foliage::split(&scene, &Files::new(), &Overrides::default());
        let wood = Wood { positions: parts.wood_positions, triangles: parts.wood };
        let by = |method| skeletonize(&wood, &params(method)).unwrap();
        let (rings, contracted) = (by(Method::ByPiece), by(Method::Contraction));
        let shift = rings.placement.point(Vec3::ZERO) - contracted.placement.point(Vec3::ZERO);
        let a = agreement_at(&contracted.plant, shift, &rings.plant);
        assert!(a.length_found >= 0.99 && a.length_true >= 0.99, "{name} {a:?}");
        assert!(a.radius_error <= 0.02 && (a.chains - 1.0).abs() <= 0.02, "{name} {a:?}");
        // The base of the trunk is the same place, though one is a ring and the other what a surface shrank to.
        let trunk = rings.plant.radii(rings.plant.chain_ids().next().unwrap())[0];
        assert!(shift.length() < trunk * 0.2, "{name} {shift} {trunk}");
    }
}

#[test]
fn a_twig_of_few_rings_that_runs_to_a_point_is_as_thick_at_its_base_by_contraction() {
    // Long of four rings; and of three rings so short that a ring is as far from the next as it is wide.
    let twigs: [(f64, &[f64]); 3] =
        [(7.2, &[0.24, 0.16, 0.08, 0.001]), (0.5, &[0.24, 0.135, 0.03]), (0.5, &[0.24, 0.16, 0.08])];
    for (length, wanted) in twigs {
        for sides in [3, 5, 8] {
            let steps = wanted.len() - 1;
            let path: Vec<DVec3> = (0..=steps).map(|k| DVec3::Y * length * k as f64 / steps as f64).collect();
            let twig = shapes::tube(&path, wanted, sides);
            let found =
                skeletonize(&wood(&[pole(DVec3::ZERO, DVec3::X * 20.0, 1.0, 0.9), twig]), &params(Method::Contraction));
            let plant = found.unwrap().plant;
            let radii = plant.radii(crate::plant::ChainId(1));
            let base = radii.iter().fold(0.0_f32, |r, &n| r.max(n));
            assert!((base - 0.24).abs() < 0.05, "{length} {sides} {radii:?}");
            assert!(radii[radii.len() - 1] < 0.1, "{length} {sides} {radii:?}");
        }
    }
}

#[test]
fn trunks_cut_level_and_leaning_keep_their_base() {
    // A trunk leaning by 20 degrees, cut level with the ground, its rings tilted into the lean one by one.
    let lean = DVec3::new(0.34, 0.94, 0.0);
    let path: Vec<DVec3> = (0..14).map(|k| lean * (0.35 * f64::from(k))).collect();
    for sides in [5, 6, 8, 12] {
        let mut surface = shapes::tube(&path, &[0.3; 14], sides);
        for p in &mut surface.positions[..sides as usize] {
            *p -= lean * (p.y / lean.y);
        }
        let found = skeletonize(&wood(&[surface]), &params(Method::Contraction)).unwrap();
        let base = found.placement.point(Vec3::ZERO);
        assert!(base.length() < 0.06, "{sides} {base}");
        assert!((found.plant.height() - 0.94 * 0.35 * 13.0).abs() < 0.15, "{sides} {}", found.plant.height());
    }
}

#[test]
fn stems_out_of_one_place_are_stems_and_a_low_branch_is_none() {
    let stem = |k: u32, radius: f64| {
        let angle = f64::from(k) * 1.3;
        let (x, z) = (libm::cos(angle), libm::sin(angle));
        let base = DVec3::new(x, 0.0, z) * 0.04;
        pole(base, DVec3::new(x * 0.9, 2.5, z * 0.9), radius, radius * 0.3)
    };
    let mut parts: Vec<Surface> = (0..5).map(|k| stem(k, 0.03 + 0.002 * f64::from(k))).collect();
    // It leaves the first stem 20 cm above the ground.
    parts.push(pole(DVec3::new(0.1, 0.2, 0.0), DVec3::new(1.2, 1.4, 0.3), 0.02, 0.005));
    for method in [Method::ByPiece, Method::Contraction] {
        let found = skeletonize(&wood(&parts), &params(method)).unwrap();
        let stems = found.plant.chains().iter().filter(|c| c.parent.is_none()).count();
        assert_eq!((stems, found.plant.chains().len()), (5, 6), "{method:?} {:?}", found.notes);
    }
}

#[test]
fn a_low_poly_trunk_is_as_thick_as_its_faces_are_far_and_a_thin_twig_of_a_round_one_keeps_its_radius() {
    let tube = |from: DVec3, to: DVec3, radius: f64, sides: u32| {
        let path: Vec<DVec3> = (0..5).map(|k| from.lerp(to, f64::from(k) / 4.0)).collect();
        shapes::tube(&path, &[radius; 5], sides)
    };
    for (sides, factor) in [(4, 0.8116), (8, 1.0)] {
        let trunk = tube(DVec3::ZERO, DVec3::Y * 4.0, 0.2, sides);
        let twig = tube(DVec3::Y * 2.0, DVec3::new(1.5, 3.0, 0.0), 0.02, 4);
        for method in [Method::ByPiece, Method::Contraction] {
            let found = skeletonize(&wood(&[trunk.clone(), twig.clone()]), &params(method)).unwrap();
            let radius = |chain: u32| f64::from(found.plant.radii(crate::plant::ChainId(chain))[1]);
            assert!((radius(0) / 0.2 - factor).abs() < 0.01, "{method:?} {sides} {}", radius(0));
            assert!((radius(1) / 0.02 - factor).abs() < 0.01, "{method:?} {sides} {}", radius(1));
        }
    }
}
