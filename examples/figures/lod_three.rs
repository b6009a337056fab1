//! The levels as three.js sees them: `.ci/agree.mjs` draws them in Chromium and compares with what the manifest says.

use std::process::Command;

use treewright::build::pipeline::{make_set, read_inputs, set_key};
use treewright::build::{Cache, load_preset};

use crate::{Figure, root};

/// Some sets, two variants each. Says so where Node.js, the packages of `.ci` or Chromium are missing.
pub(crate) fn print() {
    if !root().join(".ci/node_modules").is_dir() {
        println!("three.js is not asked: (cd .ci && npm install --no-package-lock)");
        return;
    }
    let mut worst = (0.0_f64, 0.0_f64);
    // At a sample a pixel.
    let mut shown = [[f64::MAX, 0.0]; 2];
    let mut levels = 0.0;
    for name in ["ash", "avenue", "palms"] {
        let loaded = load_preset(&root().join(format!("presets/{name}.ron"))).expect("the preset is good");
        let inputs = read_inputs(&loaded).expect("its files are there");
        let key = set_key(&loaded.plan, &inputs);
        let set = make_set(&loaded.plan, &inputs, key, &Cache::default(), &|_| {}).expect("it builds");
        let scratch = tempfile::tempdir().expect("a folder for a moment");
        let folder = scratch.path().join(name);
        std::fs::create_dir(&folder).expect("it is new");
        for (file, bytes) in &set.files {
            std::fs::write(folder.join(file), bytes).expect("there is room");
        }
        let said = Command::new("node").current_dir(root()).arg(".ci/agree.mjs").arg(&folder).arg("2").output();
        let Ok(said) = said else {
            println!("three.js is not asked: there is no Node.js");
            return;
        };
        let text = String::from_utf8_lossy(&said.stdout);
        // `At a sample a pixel levels show 0.95 to 1.05 of the tree, and 0.92 to 1.03 of the level before`
        let ranges = text.lines().rev().find(|line| line.starts_with("At a sample a pixel"));
        let ends: Vec<f64> =
            ranges.into_iter().flat_map(|line| line.split(' ')).filter_map(|w| w.parse().ok()).collect();
        for (shown, ends) in shown.iter_mut().zip(ends.as_chunks::<2>().0) {
            *shown = [shown[0].min(ends[0]), shown[1].max(ends[1])];
        }
        // `4 levels: IoU off by 0.0041 at most, coverage by 0.0030`
        let numbers: Vec<f64> = text
            .lines()
            .rev()
            .find(|line| line.contains("IoU off by"))
            .into_iter()
            .flat_map(|line| line.split([' ', ',']).filter_map(|word| word.parse().ok()))
            .collect();
        let [count, iou, coverage] = numbers[..] else {
            println!("three.js is not asked: {}", String::from_utf8_lossy(&said.stderr));
            return;
        };
        (levels, worst) = (levels + count, (worst.0.max(iou), worst.1.max(coverage)));
    }
    let how = format!("{levels} levels of three sets in Chromium against the manifest, same views and sizes; worst");
    Figure::new("lod.three.iou_off", worst.0, "share", how.clone()).goal("<= 0.02").print();
    Figure::new("lod.three.coverage_off", worst.1, "ratio", how).goal("<= 0.02").print();
    for (what, [least, most]) in ["tree", "level before"].into_iter().zip(shown) {
        let how =
            format!("the same levels at a sample a pixel, by mips, of the {what}: the farthest of {least} to {most}");
        let off = (1.0 - least).max(most - 1.0);
        Figure::new(format!("lod.three.shown_off, of the {what}"), off, "ratio", how).print();
    }
}
