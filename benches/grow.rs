//! Growth by stages from 10,000 to 2,000,000 nodes, which shows `n log n`, and beside a plain reference on the same nodes.
//!
//! `cargo bench --bench grow`. Times are a process's own; compare within one run.

#[expect(unreachable_pub, reason = "a module of a benchmark, shared with the figures")]
mod reference;

use divan::Bencher;
use treewright::base::Seed;
use treewright::preset::{plan::GrowParams, species};
use treewright::source::grow::{Graph, GraphParams, ObstacleMeshes, Solids, grow_on};

fn main() {
    divan::main();
}

const COUNTS: [u32; 6] = [10_000, 30_000, 100_000, 300_000, 1_000_000, 2_000_000];

/// An even graph's parameters: one trunk and limbs.
fn params(nodes: u32) -> GrowParams {
    let text = "(height: 10.0, detail: 1.0, iterations: [(endpoints: Volume(shape: Point(height: 0.5), count: 1))])";
    let mut params = species("bench.ron", text).expect("the species is good");
    params.nodes = nodes;
    params
}

fn graph(nodes: u32) -> Graph {
    let of = GraphParams::of(&params(nodes), &Solids::new()).expect("the parameters are in range");
    Graph::new(&of, &ObstacleMeshes::new()).expect("there is no mesh")
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn nodes_and_graph(bencher: Bencher<'_, '_>, nodes: u32) {
    bencher.bench(|| graph(nodes));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn one_pass_over_all(bencher: Bencher<'_, '_>, nodes: u32) {
    let graph = graph(nodes);
    bencher.bench(|| graph.costs_from_root());
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn a_tree_on_a_graph(bencher: Bencher<'_, '_>, nodes: u32) {
    let (graph, params) = (graph(nodes), params(nodes));
    bencher.bench(|| grow_on(&graph, &params, &Solids::new(), Seed::new(1)));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn a_tree_with_finer_ways(bencher: Bencher<'_, '_>, nodes: u32) {
    let (graph, mut params) = (graph(nodes), params(nodes));
    params.space.detail = 2.0;
    bencher.bench(|| grow_on(&graph, &params, &Solids::new(), Seed::new(1)));
}

#[divan::bench(args = [150_000], sample_count = 5)]
fn reference_neighbours(bencher: Bencher<'_, '_>, nodes: u32) {
    let graph = graph(nodes);
    bencher.bench(|| reference::yao(graph.positions(), graph.reach()));
}

#[divan::bench(args = [150_000], sample_count = 5)]
fn reference_pass_over_all(bencher: Bencher<'_, '_>, nodes: u32) {
    let graph = graph(nodes);
    bencher.bench(|| reference::dijkstra(graph.positions(), graph.links(), graph.root()));
}

#[divan::bench(args = [150_000], sample_count = 5)]
fn nodes_and_graph_beside_the_reference(bencher: Bencher<'_, '_>, nodes: u32) {
    bencher.bench(|| graph(nodes));
}

#[divan::bench(args = [150_000], sample_count = 5)]
fn pass_beside_the_reference(bencher: Bencher<'_, '_>, nodes: u32) {
    let graph = graph(nodes);
    bencher.bench(|| graph.costs_from_root());
}
