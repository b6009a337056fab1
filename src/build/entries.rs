//! Entries of a cache as the stages read them, for tools that look at one from outside.

use super::assets::Packed;
use super::cache::Entry;
use super::stages::{LeafPictures, SourcePlant};
use crate::bake::Maps;
use crate::lod::Ladder;
use crate::plant::Plant;

/// Whether what an entry holds behind its header is a whole and sound value of a stage, as the build would take it; none
/// for a stage that keeps no entries. Takes memory in proportion to the bytes, whatever they claim.
#[must_use]
pub fn entry_is_sound(stage: &str, bytes: &[u8]) -> Option<bool> {
    let sound = match stage {
        "grow" | "import" | "like" => is_sound::<SourcePlant>,
        "pictures" => is_sound::<LeafPictures>,
        "bark" => is_sound::<Maps>,
        "dress" => is_sound::<Plant>,
        "ladder" => is_sound::<Ladder>,
        "atlas" => is_sound::<Packed>,
        "png" => is_sound::<Vec<u8>>,
        _ => return None,
    };
    Some(sound(bytes))
}

fn is_sound<T: Entry>(bytes: &[u8]) -> bool {
    matches!(postcard::take_from_bytes::<T>(bytes), Ok((value, [])) if value.is_sound())
}
