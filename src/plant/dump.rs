//! A plant as readable RON, for goldens, `inspect` and people.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{ChainId, Leaf, LeafForm, Plant, PlantBuilder};
use crate::base::Rotation;

#[derive(Serialize, Deserialize)]
#[serde(rename = "Plant", deny_unknown_fields)]
struct Text {
    chains: Vec<ChainText>,
    leaves: Vec<LeafText>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "Chain", deny_unknown_fields)]
struct ChainText {
    parent: Option<u32>,
    location: f32,
    origin: (f32, f32, f32),
    /// x, y, z and radius.
    points: Vec<(f32, f32, f32, f32)>,
}

/// Chain, location, orientation (x, y, z, w), size, slot; then offset and form, for leaves that have them.
#[derive(Serialize, Deserialize)]
struct LeafText(
    u32,
    f32,
    (f32, f32, f32, f32),
    f32,
    u16,
    #[serde(default, skip_serializing_if = "Option::is_none")] Option<((f32, f32, f32), LeafForm)>,
);

/// Writes a plant: one line a chain, floats exact.
#[must_use]
pub fn dump(plant: &Plant) -> String {
    let chains = plant
        .chain_ids()
        .map(|id| {
            let chain = plant.chain(id);
            ChainText {
                parent: chain.parent.map(|p| p.0),
                location: chain.location,
                origin: chain.origin.into(),
                points: plant.points(id).iter().zip(plant.radii(id)).map(|(p, &r)| (p.x, p.y, p.z, r)).collect(),
            }
        })
        .collect();
    let leaves = plant
        .leaves()
        .iter()
        .map(|l| {
            let q = l.orientation;
            let plain = l.offset == Vec3::ZERO && l.form == LeafForm::Square;
            let more = (!plain).then(|| (l.offset.into(), l.form));
            LeafText(l.chain.0, l.location, (q.v.x, q.v.y, q.v.z, q.w), l.size, l.slot, more)
        })
        .collect();
    let config = ron::ser::PrettyConfig::new().depth_limit(2).new_line("\n").struct_names(true);
    ron::ser::to_string_pretty(&Text { chains, leaves }, config).expect("plain numbers serialize")
}

/// Reads what [`dump`] wrote.
///
/// # Errors
///
/// When the text is no dump, or states a plant that breaks an invariant.
pub fn undump(text: &str) -> Result<Plant, String> {
    let parsed: Text = ron::from_str(text).map_err(|e| e.to_string())?;
    let mut builder = PlantBuilder::new();
    for chain in parsed.chains {
        let points: Vec<Vec3> = chain.points.iter().map(|p| Vec3::new(p.0, p.1, p.2)).collect();
        let radii: Vec<f32> = chain.points.iter().map(|p| p.3).collect();
        match chain.parent {
            None => builder.stem(chain.origin.into(), &points, &radii),
            Some(parent) => builder.branch(ChainId(parent), chain.location, &points, &radii),
        };
    }
    for LeafText(chain, location, q, size, slot, more) in parsed.leaves {
        let orientation = Rotation { v: Vec3::new(q.0, q.1, q.2), w: q.3 };
        let (offset, form) = more.unwrap_or_default();
        builder.leaf(Leaf {
            offset: offset.into(),
            form,
            ..Leaf::new(ChainId(chain), location, orientation, size, slot)
        });
    }
    builder.finish().map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_off_the_axis_come_back_and_others_are_written_as_before() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.05]);
        let plain = Leaf::new(stem, 0.5, Rotation::IDENTITY, 0.2, 3);
        builder.leaf(plain);
        builder.leaf(Leaf { offset: Vec3::new(0.1, 0.0, -0.2), form: LeafForm::Flat(0.5), ..plain });
        let plant = builder.finish().unwrap();
        let text = dump(&plant);
        assert!(text.contains("(0, 0.5, (0.0, 0.0, 0.0, 1.0), 0.2, 3),"), "{text}");
        assert_eq!(undump(&text).unwrap(), plant);
    }
}
