//! What it costs to have levels take over nearer than where they look like the full one.

use treewright::build::pipeline::{make_set, read_inputs, set_key};
use treewright::build::{Cache, load_preset};
use treewright::preset::plan::{Lod, LodBudget};

use crate::{Figure, root};

const SETS: [&str; 4] = ["ash", "broadleaved", "conifers", "palms"];
const SHARES: [f32; 4] = [0.4, 0.2, 0.1, 0.05];

/// Prints what the manifests tell, each level alone at the size, those before it between that and the whole screen.
pub(crate) fn print() {
    let kinds = [Lod::thinned(0.4), Lod::BillboardCloud { cards: 48 }];
    let last = [Lod::Impostor { frames: 10 }, Lod::CrossedQuads];
    let cache = Cache::default();
    for (i, kind) in kinds.iter().chain(&last).enumerate() {
        let at = i.min(kinds.len());
        for share in SHARES {
            let mut found: Vec<[f64; 3]> = Vec::new();
            let mut pixels = 0;
            for set in SETS {
                let mut loaded = load_preset(&root().join(format!("presets/{set}.ron"))).expect("it is shipped");
                let last = LodBudget { lod: kind.clone(), screen: Some(share) };
                let before = kinds[..at].iter().cloned().map(LodBudget::from);
                loaded.plan.lods = std::iter::once(Lod::Full.into()).chain(before).chain([last]).collect();
                let inputs = read_inputs(&loaded).expect("its files are there");
                let key = set_key(&loaded.plan, &inputs);
                let files = make_set(&loaded.plan, &inputs, key, &cache, &|_| {}).expect("it builds");
                let manifest = files.files.iter().find(|(name, _)| name.ends_with(".manifest.json"));
                let (_, text) = manifest.expect("every set has one");
                let told: serde_json::Value = serde_json::from_slice(text).expect("it is JSON");
                for variant in told["variants"].as_array().expect("it has variants") {
                    let measured = &variant["levels"][at + 1]["measured"];
                    let number = |field: &str| measured[field].as_f64().expect("it is measured");
                    found.push(["iou_mean", "iou_worst", "coverage"].map(number));
                    pixels = measured["pixels"].as_u64().unwrap_or(0);
                }
            }
            let mean = |k: usize| found.iter().map(|f| f[k]).sum::<f64>() / found.len() as f64;
            let worst = found.iter().map(|f| f[1]).fold(f64::MAX, f64::min);
            let name = format!("{kind:?}").split([' ', '{']).next().unwrap_or_default().to_owned();
            let how = format!(
                "{name} told to take over at {:.0} % of the screen, {} trees of {}, measured at {pixels} pixels; worst view \
                 {worst:.3}, coverage {:.3}",
                share * 100.0,
                found.len(),
                SETS.join(", "),
                mean(2)
            );
            Figure::new(format!("lod.screen.{name}_{:.0}", share * 100.0), mean(0), "IoU", how).print();
        }
    }
}
