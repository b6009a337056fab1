//! A plant as the cache keeps it: flat arrays, read back through the builder, so that no file can make a plant that
//! breaks an invariant. For people there is [`dump`](super::dump).

use std::borrow::Cow;

use glam::Vec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::{ChainId, Leaf, Plant, PlantBuilder};
use crate::base::bulk;

/// A chain without what follows from the others.
#[derive(Serialize, Deserialize)]
struct StoredChain {
    parent: Option<ChainId>,
    location: f32,
    origin: Vec3,
    len: u32,
}

#[derive(Serialize)]
struct Outgoing<'a> {
    chains: Vec<StoredChain>,
    #[serde(with = "bulk")]
    points: &'a [Vec3],
    #[serde(with = "bulk")]
    radii: &'a [f32],
    leaves: Cow<'a, [Leaf]>,
}

#[derive(Deserialize)]
struct Incoming {
    chains: Vec<StoredChain>,
    #[serde(with = "bulk")]
    points: Vec<Vec3>,
    #[serde(with = "bulk")]
    radii: Vec<f32>,
    leaves: Vec<Leaf>,
}

impl Serialize for Plant {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let stored = |chain: &super::Chain| {
            let &super::Chain { parent, location, origin, len, .. } = chain;
            StoredChain { parent, location, origin, len }
        };
        let chains = self.chains.iter().map(stored).collect();
        Outgoing { chains, points: &self.points, radii: &self.radii, leaves: Cow::Borrowed(&self.leaves) }
            .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Plant {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Incoming { chains, points, radii, leaves } = Incoming::deserialize(deserializer)?;
        let mut builder = PlantBuilder::new();
        let mut first = 0_usize;
        for chain in &chains {
            let end = first.saturating_add(chain.len as usize);
            let (Some(points), Some(radii)) = (points.get(first..end), radii.get(first..end)) else {
                return Err(de::Error::custom("a chain without points"));
            };
            let before = |parent: ChainId| parent.index() < builder.chain_count();
            if !chain.parent.is_none_or(before) {
                return Err(de::Error::custom("a chain before its parent"));
            }
            builder.chain(chain.parent, chain.location, chain.origin, points, radii);
            first = end;
        }
        leaves.into_iter().for_each(|leaf| builder.leaf(leaf));
        builder.finish().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LeafForm, PlantBuilder};
    use super::*;
    use crate::base::Rotation;

    fn plant() -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::X, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.05]);
        let branch = builder.branch(stem, 0.5, &[Vec3::ZERO, Vec3::X, Vec3::ONE], &[0.05, 0.02, 0.01]);
        let leaf = Leaf::new(branch, 0.25, Rotation::IDENTITY, 0.1, 3);
        builder.leaf(Leaf { form: LeafForm::Flat(0.5), offset: Vec3::Y, ..leaf });
        builder.finish().unwrap()
    }

    #[test]
    fn a_stored_plant_comes_back_bit_by_bit() {
        let bytes = postcard::to_stdvec(&plant()).unwrap();
        assert_eq!(postcard::from_bytes::<Plant>(&bytes).unwrap(), plant());
    }

    #[test]
    fn no_broken_bytes_make_a_broken_plant() {
        let bytes = postcard::to_stdvec(&plant()).unwrap();
        let mut read = 0;
        for at in 0..bytes.len() {
            for value in [0, 1, 127, 255] {
                let mut broken = bytes.clone();
                broken[at] = value;
                if let Ok(plant) = postcard::from_bytes::<Plant>(&broken) {
                    read += 1;
                    assert_eq!(super::super::validate::validate(&plant), Ok(()));
                }
            }
            assert!(postcard::from_bytes::<Plant>(&bytes[..at]).is_err());
        }
        assert!(read > 10, "some changes are changes of a coordinate only");
    }
}
