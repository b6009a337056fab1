//! Morphs one tree into another, every branch and leaf carried along, at a pace that keeps its trunk believable.
//!
//! `cargo run --release --example 05_morph`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use treewright::base::Seed;
use treewright::blend::{Pace, morph, support_over_morph};
use treewright::preset::plan::MatchParams;
use treewright::preset::species;
use treewright::relate::{Blender, PatternParams, pattern_family};
use treewright::source::grow::grow;

const OAK: &str = include_str!("../presets/species/oak.ron");
const SHRUB: &str = include_str!("../presets/species/shrub.ron");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut plants = [OAK, SHRUB].into_iter().map(|text| {
        let params = species("species.ron", text).map_err(|errors| errors[0].to_string())?;
        Ok::<_, Box<dyn std::error::Error>>(grow(&params, Seed::new(1))?.0)
    });
    let (Some(oak), Some(shrub)) = (plants.next(), plants.next()) else { return Ok(()) };
    let by_crown = MatchParams { crown: 1.0, direction: 0.0, ratio: 0.0 };
    let family = pattern_family(oak?, shrub?, &by_crown, &PatternParams::default())?;

    let pace = Pace::of(&family);
    let support = support_over_morph(&family, &pace, 10);
    let mut blender = Blender::new(&family);
    for (frame, weight) in (0..).zip(support) {
        let t = pace.share(frame as f32 / 10.0);
        let tree = blender.blend(&morph(&family, 0, 1, t));
        println!(
            "frame {frame:2}: {:5} chains, {:4.1} m, trunk support {weight:.3}",
            tree.chains().len(),
            tree.height()
        );
    }
    Ok(())
}
