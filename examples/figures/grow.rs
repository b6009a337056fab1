//! Figures of growth by guiding vectors.

use treewright::base::Seed;
use treewright::preset::plan::GrowParams;
use treewright::preset::species;
use treewright::source::grow::{
    Graph, GraphParams, ObstacleMeshes, Solid, Solids, crossings, detail, grow, grow_in, grow_on, overlaps, shape_files,
};

use crate::{Figure, root, seconds};

#[path = "../../benches/reference/mod.rs"]
#[expect(unreachable_pub, reason = "a module of a benchmark, shared with the figures")]
mod reference;

/// A typical result of the paper: 6,000 endpoints in five iterations.
const TYPICAL: &str = "(
    height: 12.0, nodes: 150000, width: 1.1, allometry: 2.2, bole: 0.15,
    iterations: [
        (endpoints: Volume(shape: Point(height: 0.5), count: 1)),
        (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.35, top: 0.9, radius: 0.42, hollow: 0.6), count: 19),
         guide: Piecewise(alpha1: 15.0, alpha2: -3.0, h0: 4)),
        (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.3, top: 0.92, radius: 0.45, hollow: 0.3), count: 180),
         guide: Piecewise(alpha1: 30.0, alpha2: 0.0, h0: 1)),
        (endpoints: Surface(k: 3, t: 0.6, count: 1300), guide: Piecewise(alpha1: 30.0, alpha2: 0.0, h0: 1)),
        (endpoints: Surface(k: 2, t: 0.6, count: 4500), guide: Piecewise(alpha1: 30.0, alpha2: 0.0, h0: 1)),
    ],
)";

fn typical(nodes: u32, detail: f32) -> GrowParams {
    let mut params = species("typical.ron", TYPICAL).expect("the species is good");
    params.nodes = nodes;
    params.space.detail = detail;
    params
}

fn graph(params: &GrowParams) -> Graph {
    let of = GraphParams::of(params, &Solids::new()).expect("the parameters are in range");
    Graph::new(&of, &ObstacleMeshes::new()).expect("there is no mesh")
}

/// Prints them.
pub(crate) fn print() {
    let threads = rayon::current_num_threads();
    let even = typical(150_000, 1.0);
    let whole = |params: &GrowParams| seconds(9, || drop(grow(params, Seed::new(1)).expect("it grows")));
    let how =
        format!("150,000 even nodes, 6,000 endpoints, 5 iterations, median of 9, {threads} threads; the paper: 9.5 s");
    Figure::new("grow.paper_typical", whole(&even), "s", how).goal("<= 0.35 on 2 cores").print();
    let how = format!("the same with finer nodes along the branches (detail 2), median of 9, {threads} threads");
    Figure::new("grow.paper_typical_detailed", whole(&typical(150_000, 2.0)), "s", how)
        .goal("<= 0.35 on 2 cores")
        .print();

    let time = seconds(9, || drop(graph(&even)));
    let built = graph(&even);
    let how =
        format!("{} nodes, {} edges, median of 9, {threads} threads; the paper: 6 s", built.nodes(), built.edges());
    Figure::new("grow.nodes_and_graph", time * 1e3, "ms", how).goal("<= 120 on 2 cores").print();
    memory(&even, &built);
    // On a thread of the pool, as in a build: from outside every parallel step would wait for two threads to wake.
    let further = |params: &GrowParams| {
        let grown = || drop(grow_on(&built, params, &Solids::new(), Seed::new(2)).expect("it grows"));
        seconds(9, || rayon::scope(|_| grown()))
    };
    let time = further(&even);
    Figure::new("grow.further_tree", time * 1e3, "ms", "another seed on the same even graph, median of 9")
        .goal("<= 150")
        .print();
    let fine = typical(150_000, 2.0);
    let time = further(&fine);
    Figure::new("grow.further_tree_detailed", time * 1e3, "ms", "the same at detail 2, median of 9").print();

    scaling();
    against_reference(&built);
    detail_gained();
    found_overlaps();
}

/// Resident pages of this process, bytes; none where the system does not say.
fn resident() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib * 1024.0)
}

fn memory(params: &GrowParams, built: &Graph) {
    let counted = built.bytes() as f64 / 1e6;
    Figure::new("grow.graph_memory", counted, "MB", "bytes of the arrays of 150,000 nodes").goal("<= 40").print();
    let before = resident();
    let graphs: Vec<Graph> = (0..8).map(|_| graph(params)).collect();
    if let (Some(before), Some(after)) = (before, resident()) {
        let each = (after - before).max(0.0) / 1e6 / graphs.len() as f64;
        let how = "growth of this process while 8 graphs are built and kept, each";
        Figure::new("grow.graph_memory_measured", each, "MB", how).goal("<= 40").print();
    }
}

/// The exponent of cost by nodes, from 10,000 to 2,000,000.
fn scaling() {
    let counts = [10_000_u32, 45_000, 200_000, 2_000_000];
    let mut points = Vec::new();
    for count in counts {
        let params = typical(count, 1.0);
        let time = seconds(3, || drop(graph(&params).costs_from_root()));
        points.push((treewright::base::math::ln64(f64::from(count)), treewright::base::math::ln64(time)));
    }
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>();
    let how =
        "nodes, graph and one whole pass at 10k, 45k, 200k, 2M nodes: slope of log time by log nodes; n log n is 1.08";
    Figure::new("grow.scaling_exponent", slope, "", how).goal("about 1.1").print();
}

fn against_reference(built: &Graph) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads can be started");
    let params = typical(150_000, 1.0);
    let same = reference::yao(built.positions(), built.reach());
    let equal = same.iter().zip(built.links()).filter(|(a, b)| a == b).count();
    let how = format!("of {} nodes have the edges that a k-d tree finds", same.len());
    Figure::new("grow.edges_as_the_reference", equal as f64, "nodes", how).goal("all").print();
    let (own, plain) = pool.install(|| {
        (seconds(5, || drop(graph(&params))), seconds(5, || drop(reference::yao(built.positions(), built.reach()))))
    });
    let how = "k-d tree neighbours alone over nodes and graph here, 150,000 nodes, one thread each, median of 5";
    Figure::new("grow.against_reference_graph", plain / own, "times", how).print();
    let own = seconds(5, || drop(built.costs_from_root()));
    let plain = seconds(5, || drop(reference::dijkstra(built.positions(), built.links(), built.root())));
    let how = "binary-heap Dijkstra without guiding vectors over a whole pass with them, 150,000 nodes, median of 5";
    Figure::new("grow.against_reference_pass", plain / own, "times", how).print();
}

fn detail_gained() {
    let of = |nodes, fine| detail(&typical(nodes, fine), &Solids::new(), Seed::new(1)).expect("it grows");
    let (fine, even, million) = (of(150_000, 2.0), of(150_000, 1.0), of(1_000_000, 1.0));
    let how = format!(
        "mean edge of 1,000,000 even nodes over that of {} and {} finer ones along the branches (detail 2); the even \
         ones alone: {:.2}",
        fine.nodes,
        fine.finer,
        million.edge / even.edge
    );
    Figure::new("grow.adaptive_detail_ratio", f64::from(million.edge / fine.edge), "", how).goal(">= 1").print();
    let how = format!("median edges from root to tip; even: {:.0}, a million even: {:.0}", even.path, million.path);
    Figure::new("grow.adaptive_path_edges", f64::from(fine.path), "edges", how).goal(">= a million's").print();
    let how = format!(
        "how far nodes stray from their path's course, heights; even: {:.5}, a million even: {:.5}",
        even.stray, million.stray
    );
    Figure::new("grow.adaptive_stray", f64::from(fine.stray), "heights", how).goal("near a million's").print();
    let time = |nodes, fine| {
        let params = typical(nodes, fine);
        seconds(3, || drop(grow(&params, Seed::new(1)).expect("it grows")))
    };
    let (fine, even, million) = (time(150_000, 2.0), time(150_000, 1.0), time(1_000_000, 1.0));
    let how = format!(
        "time of the whole tree at detail 2 over that of 150,000 even nodes; a million even ones take {:.1} times as long",
        million / even
    );
    Figure::new("grow.adaptive_cost", fine / even, "times", how).goal("near 1").print();
}

/// Overlaps and crossings that were found, mended and left in the shipped species.
fn found_overlaps() {
    let folder = root().join("presets/species");
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("species are shipped").flatten().map(|entry| entry.path()).collect();
    files.sort();
    let (mut left, mut crossed, mut branches, mut trees) = (0, 0, 0, 0);
    let (mut moved, mut dropped, mut worst) = (0, 0, 0.0_f64);
    for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == "ron")) {
        let text = std::fs::read_to_string(file).expect("it can be read");
        let Ok(params) = species("species.ron", &text) else { continue };
        let mut solids = Solids::new();
        for shape in shape_files(&params) {
            let bytes = std::fs::read(file.with_file_name(&shape.file)).expect("its shape can be read");
            solids.insert(shape.clone(), Solid::read(&bytes, shape.reading).expect("its shape is sound"));
        }
        let Ok((plant, notes)) = grow_in(&params, &solids, Seed::new(1)) else { continue };
        trees += 1;
        branches += plant.chains().len();
        left += overlaps(&plant);
        crossed += crossings(&plant);
        let told = |what: &str| -> usize {
            let note = notes.iter().find(|note| note.contains(what));
            note.and_then(|note| note.split(' ').next()?.parse().ok()).unwrap_or(0)
        };
        moved += told("moved out of");
        dropped += told("dropped that grew into");
        worst = worst.max(told("dropped that grew into") as f64 / plant.chains().len() as f64);
    }
    let how = format!("of {branches} branches of {trees} shipped species lie in others with over 1 % of their surface");
    Figure::new("grow.overlaps", left as f64, "branches", how).goal("0").print();
    let how = format!(
        "of {branches} branches of {trees} shipped species cross another's axis away from forks, as smoothed and mended: \
         closer than a tenth of the sum of their radii"
    );
    Figure::new("grow.crossings", crossed as f64, "branches", how).goal("0").print();
    Figure::new("grow.overlaps_moved", moved as f64, "branches", "of these trees were moved out of others").print();
    let how = format!("of these trees were dropped for it; at most {:.2} % of a tree's", worst * 100.0);
    Figure::new("grow.overlaps_dropped", dropped as f64, "branches", how).goal("few").print();
    let text = std::fs::read_to_string(root().join("presets/species/oak.ron")).expect("the oak is shipped");
    let mut oak = species("oak.ron", &text).expect("the oak is good");
    oak.seed = 1;
    let whole = seconds(5, || drop(grow(&oak, Seed::new(1)).expect("it grows")));
    let (plant, _) = grow(&oak, Seed::new(1)).expect("it grows");
    let once = seconds(5, || {
        let _ = overlaps(&plant);
    });
    let how = format!("share of an oak's {:.0} ms that one look for overlaps takes", whole * 1e3);
    Figure::new("grow.overlaps_share", once / whole, "", how).goal("< 0.1").print();
    let (plant, _) = grow(&typical(150_000, 1.0), Seed::new(1)).expect("it grows");
    let time = seconds(9, || {
        let _ = overlaps(&plant);
    });
    let how = format!("ms to find overlaps of {} branches of the typical tree, median of 9", plant.chains().len());
    Figure::new("grow.overlaps_time", time * 1e3, "ms", how).goal("< 10 % of a tree").print();
    crate::plausibility::print();
}
