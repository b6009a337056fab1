//! Figures of filtering, scoring and picking variants; `blend` prints them.

use treewright::base::Seed;
use treewright::blend::{Tasks, sample};
use treewright::plant::Plant;
use treewright::preset::plan::Pick;
use treewright::relate::{Family, KinId, fuzzy_family};
use treewright::select::{self, Examined, Sources, Topology};

use crate::table_1::{FILTER, MATCHING, ROWS, SCORES, source};
use crate::{Figure, seconds};

/// Prints them.
pub(crate) fn print() {
    speed();
    edit_distances();
    diversity();
}

/// Filtering and scoring the 317 trees of the first row of the paper's Table 1.
fn speed() {
    let (a, b) = ROWS[0].plants();
    let (from, to) = (a.chains().len(), b.chains().len());
    let family = fuzzy_family(a, b, &MATCHING).expect("they match");
    let tasks = Tasks::new(&family, 0, 1);
    let states = tasks.in_betweens(Seed::new(1), ROWS[0].trees, 0.0, 1.0);
    let trees: Vec<(Plant, Vec<KinId>)> =
        states.iter().map(|state| family.blend_with_kins(&tasks.weights(state))).collect();
    let threads = rayon::current_num_threads();
    let sources = Sources::of(&family, &FILTER);
    let chains = trees.iter().map(|t| t.0.chains().len()).sum::<usize>() / trees.len();
    let points = trees.iter().map(|t| t.0.all_points().len()).sum::<usize>() / trees.len();
    let how = |what: &str| {
        format!(
            "{what} 317 trees of {chains} chains and {points} points on average (sources {from} and {to} chains), a tree, \
             median of 9, {threads} threads"
        )
    };
    let time = seconds(9, || drop(examined(&trees, &sources)));
    Figure::new("blend.filter_ms", time * 1e3 / 317.0, "ms", how("filtering and measuring")).print();
    let examined = examined(&trees, &sources);
    let time = seconds(9, || drop(select::scores(&examined, &sources, &SCORES)));
    Figure::new("blend.scores_ms", time * 1e3 / 317.0, "ms", how("scoring")).goal("<= 0.05").print();
    let scores = select::scores(&examined, &sources, &SCORES);
    let time = seconds(9, || drop(select::pick(Pick::Inspiring, 13, FILTER.botany, &examined, &scores)));
    Figure::new("blend.pick_ms", time * 1e3, "ms", "13 of the 317 by k-means, in all, median of 9").print();
    let mended = examined.iter().filter(|t| !t.collisions.is_empty()).count();
    let removed: usize = examined.iter().map(|t| t.collisions.len()).sum();
    let how = format!("{removed} branches removed from {mended} of the 317 trees");
    Figure::new("blend.filter_removed", removed as f64 / 317.0, "branches a tree", how).print();
}

fn examined(trees: &[(Plant, Vec<KinId>)], sources: &Sources) -> Vec<Examined> {
    use rayon::prelude::*;
    trees.par_iter().map(|(plant, kins)| select::examine(plant, kins, sources, &FILTER)).collect()
}

/// Every pair of rooted trees of up to six nodes against trying all mappings.
fn edit_distances() {
    let trees: Vec<Vec<u32>> = (1..=6).flat_map(all_trees).collect();
    let (mut equal, mut all) = (0, 0);
    for (i, a) in trees.iter().enumerate() {
        for b in &trees[i..] {
            let found = select::edit_distance(&Topology::new(a, &[]), &Topology::new(b, &[]));
            equal += usize::from(found == cheapest(a, b));
            all += 1;
        }
    }
    let how = format!("of {all} pairs of trees of up to 6 nodes, equal to the cheapest of all constrained mappings");
    Figure::new("blend.ted_checked", f64::from(equal as u32), "pairs", how).goal("all").print();
}

/// All rooted trees of `n` nodes, as parents that never fall; each shape at least once.
fn all_trees(n: usize) -> Vec<Vec<u32>> {
    let mut trees: Vec<Vec<u32>> = vec![vec![0]];
    for i in 1..n as u32 {
        let grown = |tree: &Vec<u32>| {
            let least = if tree.len() > 1 { tree[tree.len() - 1] } else { 0 };
            (least..i).map(|p| tree.iter().copied().chain([p]).collect()).collect::<Vec<Vec<u32>>>()
        };
        trees = trees.iter().flat_map(grown).collect();
    }
    trees
}

/// The cost of the cheapest mapping that keeps ancestors and meets apart as Zhang defines it, by trying all.
fn cheapest(a: &[u32], b: &[u32]) -> u32 {
    fn above(tree: &[u32], x: usize, mut y: usize) -> bool {
        while y != 0 {
            y = tree[y] as usize;
            if y == x {
                return true;
            }
        }
        false
    }
    fn meet(tree: &[u32], x: usize, y: usize) -> usize {
        let mut at = x;
        while at != y && !above(tree, at, y) {
            at = tree[at] as usize;
        }
        at
    }
    fn most(a: &[u32], b: &[u32], i: usize, pairs: &mut Vec<(usize, usize)>) -> usize {
        if i == a.len() {
            return pairs.len();
        }
        let mut best = most(a, b, i + 1, pairs);
        for j in 0..b.len() {
            pairs.push((i, j));
            let new = (i, j);
            let same = |p: (usize, usize), q: (usize, usize)| above(a, p.0, q.0) == above(b, p.1, q.1);
            let fits = pairs[..pairs.len() - 1].iter().all(|&p| p.1 != j && same(p, new) && same(new, p))
                && pairs.iter().all(|p| {
                    pairs.iter().all(|q| pairs.iter().all(|r| same((meet(a, p.0, q.0), meet(b, p.1, q.1)), *r)))
                });
            if fits {
                best = best.max(most(a, b, i + 1, pairs));
            }
            pairs.pop();
        }
        best
    }
    (a.len() + b.len() - 2 * most(a, b, 0, &mut Vec::new())) as u32
}

/// The shipped blends with each pick, against random ones.
fn diversity() {
    let of = |from: (&str, u64), to: (&str, u64)| {
        fuzzy_family(source(from.0, from.1, 9999), source(to.0, to.1, 9999), &MATCHING).expect("they match")
    };
    let sets: [(&str, [&'static str; 3], Family); 2] = [
        (
            "the oaks of avenue",
            ["blend.diversity", "blend.diversity_diverse", "blend.diversity_natural"],
            of(("oak", 1), ("oak", 9)),
        ),
        (
            "birch and oak of grove",
            ["blend.diversity_grove", "blend.diversity_grove_diverse", "blend.diversity_grove_natural"],
            of(("birch", 3), ("oak", 5)),
        ),
    ];
    for (name, figures, family) in &sets {
        let sources = Sources::of(family, &FILTER);
        let trees: Vec<(Plant, Vec<KinId>)> = (0..128_u64)
            .map(|i| {
                let progress = Seed::new(4).at(i).range(0.15, 0.85);
                family.blend_with_kins(&sample(family, 0, 1, Seed::new(i), progress))
            })
            .collect();
        let examined = examined(&trees, &sources);
        let scores = select::scores(&examined, &sources, &SCORES);
        let good: Vec<usize> = (0..128).filter(|&i| examined[i].departure.by <= FILTER.botany).collect();
        let draws = 64;
        let random: f64 = (0..draws)
            .map(|d| {
                let mut order = good.clone();
                order.sort_by_key(|&i| Seed::new(77).at(d).at(i as u64).bits());
                f64::from(scores.diversity(&examined, &order[..8.min(order.len())]))
            })
            .sum::<f64>()
            / draws as f64;
        let picks = [Pick::Inspiring, Pick::Diverse { apart: 0.0 }, Pick::Natural];
        for (pick, figure) in picks.into_iter().zip(*figures) {
            let kept = select::pick(pick, 8, FILTER.botany, &examined, &scores).expect("there are enough").kept;
            let value = f64::from(scores.diversity(&examined, &kept));
            let how = format!(
                "mean pairwise difference of 8 picked over that of 8 random ones ({random:.4}, mean of {draws}), {name}, \
                 {} of 128 candidates let through",
                good.len()
            );
            let goal = if matches!(pick, Pick::Natural) { "" } else { "> 1" };
            Figure::new(figure, value / random, "ratio", how).goal(goal).print();
        }
    }
}
