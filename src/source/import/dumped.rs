//! Plants as [`dump`](crate::plant::dump) writes them: the door for sources that others make.
//!
//! A dump is in metres with Y up already. Its wood is taken as it is, only scaled where the preset gives a height; its
//! leaves are left behind, since their slots name pictures that the file doesn't hold: the preset's foliage dresses it.

use super::{Format, Imported};
use crate::base::{Diagnostic, counted};
use crate::plant::{Plant, PlantBuilder, undump};
use crate::preset::plan::{ImportHeight, ImportParams};
use crate::source::foliage::Art;

/// Whether bytes begin as a dump does.
pub(super) fn is_dump(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(b"Plant(")
}

/// Reads a dump.
///
/// # Errors
///
/// When it is none, states an impossible plant, or can't be scaled to the height that is asked for.
pub(super) fn read(bytes: &[u8], file: &str, params: &ImportParams) -> Result<Imported, Vec<Diagnostic>> {
    let whole = |message: String, hint: &str| vec![Diagnostic::new(file, message).with_hint(hint)];
    let text = std::str::from_utf8(bytes).map_err(|e| whole(format!("it is not UTF-8 text: {e}"), ""))?;
    let mut plant = undump(text)
        .map_err(|e| whole(e, "`treewright inspect FILE --dump PLANT` and treewright::plant::dump write such files"))?;
    let mut notes = Vec::new();
    if !plant.leaves().is_empty() {
        let are = counted(plant.leaves().len(), "leaf is", "leaves are");
        notes.push(format!("its {are} left out: the preset's foliage takes their place"));
        plant = plant.without_leaves();
    }
    if let ImportHeight::Metres(metres) = params.height {
        let factor = metres / plant.height();
        let scaled = if factor.is_finite() { scaled(&plant, factor) } else { None };
        plant = scaled.ok_or_else(|| whole("nothing rises above the base".into(), "leave out `height`"))?;
    }
    Ok(Imported { plant, format: Format::Dump, art: Art::default(), notes })
}

/// The plant `factor` times as large; none where that leaves the range of numbers.
fn scaled(plant: &Plant, factor: f32) -> Option<Plant> {
    PlantBuilder::from_plant(plant.clone().scaled(factor)).finish().ok()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::Rotation;
    use crate::plant::{Leaf, dump};
    use crate::source::import::import;

    fn plant() -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 2.0], &[0.1, 0.05]);
        builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::new(1.0, 0.5, 0.0)], &[0.03, 0.01]);
        builder.finish().unwrap()
    }

    #[test]
    fn the_wood_comes_back_to_the_bit_and_leaves_are_told() {
        let file = dump(&plant());
        let imported = import(file.as_bytes(), "a.plant", &ImportParams::default()).unwrap();
        assert_eq!((imported.plant, imported.notes.len()), (plant(), 0));
        let mut builder = PlantBuilder::from_plant(plant());
        builder.leaf(Leaf::new(crate::plant::ChainId(1), 0.5, Rotation::IDENTITY, 0.1, 0));
        let file = dump(&builder.finish().unwrap());
        let imported = import(file.as_bytes(), "a.plant", &ImportParams::default()).unwrap();
        assert_eq!((imported.plant, imported.notes.len()), (plant(), 1));
    }

    #[test]
    fn a_height_scales_all_of_it() {
        let params = ImportParams { height: ImportHeight::Metres(5.0), ..ImportParams::default() };
        let tall = import(dump(&plant()).as_bytes(), "a.plant", &params).unwrap().plant;
        assert!((tall.height() - 5.0).abs() < 1e-5);
        assert_eq!(tall.radii(crate::plant::ChainId(0))[0], 0.25);
    }

    #[test]
    fn what_is_no_plant_is_told_with_its_file() {
        for text in [
            "Plant(chains: [",
            "Plant(chains: [], leaves: [])",
            "Plant(chains: [Chain(parent: Some(7), location: 0.5, origin: (0, 0, 0), points: [(0, 0, 0, 1), (0, 1, 0, 1)])], leaves: [])",
        ] {
            let errors = import(text.as_bytes(), "a.plant", &ImportParams::default()).unwrap_err();
            assert_eq!(errors[0].file, "a.plant", "{text}");
        }
    }
}
