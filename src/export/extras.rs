//! What files say of themselves beyond glTF: extras of the asset and of the root node.

use gltf_json as json;
use serde::Serialize;

/// Extras of the root node, as MSFT_lod wants them.
#[derive(Serialize)]
pub(super) struct Coverage {
    #[serde(rename = "MSFT_screencoverage")]
    pub(super) coverage: Vec<f32>,
}

/// Extras of the asset.
#[derive(Serialize)]
pub(super) struct AssetExtras<'a> {
    pub(super) set: &'a str,
    pub(super) variant: &'a str,
    pub(super) seed: u64,
    /// How far stems go on below the ground, metres: imports leave that out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) below: Option<f32>,
}

/// As a file holds them; none where they are no JSON.
pub(super) fn raw(value: &impl Serialize) -> json::Extras {
    serde_json::to_string(value).and_then(json::extras::RawValue::from_string).ok()
}
