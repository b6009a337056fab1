//! Shapes a crown like a drawing, and tells how near it comes.
//!
//! `cargo run --release --example 06_sketch`

#![expect(clippy::print_stdout, reason = "a program that prints")]

use std::sync::Arc;

use treewright::base::Seed;
use treewright::preset::species;
use treewright::sketch::{Drawing, Sketch, SketchViews, Sketcher, ViewKind, crown_silhouette, overlap};
use treewright::source::grow::grow;

const OAK: &str = include_str!("../presets/species/oak.ron");
const HEART: &str = include_str!("../presets/sketches/heart.svg");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let params = species("oak.ron", OAK).map_err(|errors| errors[0].to_string())?;
    let (oak, _) = grow(&params, Seed::new(1))?;
    let heart = Drawing::read(HEART.as_bytes())?;

    // Binding a plant to its cages is done once; a drawing is then followed while it is drawn.
    let views = SketchViews { azimuth: 0.0, elevation: 0.0, kind: ViewKind::Front, detail: 0.5 };
    let sketcher = Arc::new(Sketcher::bind(Arc::new(oak), views)?);
    let sketched = sketcher.draw(&Sketch::of(&heart))?;
    for frame in 0..=4 {
        let t = frame as f32 / 4.0;
        let crown = crown_silhouette(&sketched.at(t), 0.0, 0.0, 0.04);
        println!("at {t:.2}: {:.0} % of the heart", 100.0 * overlap(&crown, &sketched.targets[0]));
    }
    Ok(())
}
