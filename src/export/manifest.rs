//! The manifest: what a set holds, how it was made and what was measured, as JSON for engines and build steps.
//!
//! The build fills these plain structs; field order is the declaration's, floats print shortest-exact, so equal sets give
//! equal bytes.

use serde::{Deserialize, Serialize};

use super::{Capsule, Hull};

/// Number of the manifest's format; raised when a field changes its meaning or goes away.
pub const MANIFEST_FORMAT: u32 = 1;

/// A set of assets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `treewright`.
    pub generator: String,
    /// Version of Treewright that made the set.
    pub version: String,
    /// [`MANIFEST_FORMAT`].
    pub format: u32,
    /// Name of the set.
    pub set: String,
    /// Hash of the version, the plan and the inputs that the set was made from: 64 hexadecimal digits.
    pub key: String,
    /// The preset's seed. All 64 bits: readers that keep JSON's numbers as doubles, as JavaScript and Godot do, round those
    /// above 2^53.
    pub seed: u64,
    /// One a variant, in the preset's order.
    pub variants: Vec<VariantEntry>,
    /// One a sequence that is animated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<ClipEntry>,
    /// What the vertices tell about wind; none where they tell nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindEntry>,
    /// The texture set for light maps; none where none was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lightmap: Option<LightmapEntry>,
    /// One a texture file.
    pub textures: Vec<TextureEntry>,
    /// The atlas of leaves and baked pictures.
    pub atlas: Option<AtlasEntry>,
    /// What was mended, bridged or dropped on the way, one sentence each.
    pub notes: Vec<String>,
    /// Every file of the set but the manifest, sorted by name: what a later build may replace or remove.
    pub files: Vec<FileEntry>,
}

/// A file of the set.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FileEntry {
    /// Relative to the manifest, `/` between folders.
    pub file: String,
    /// Size.
    pub bytes: u64,
    /// blake3 of its bytes, 64 hexadecimal digits.
    pub blake3: String,
}

/// The layout of the wind in the vertices. In files for the web place and swing are whole numbers: the place in the units of
/// positions, 65,535 for a swing of 1.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WindEntry {
    /// Attribute of two numbers: bend of all together, 0 to 1, and the phase.
    pub bend_and_phase: String,
    /// Attributes that hold the place that the limb swings about, metres: x and y of it in the first, z in the second. In files
    /// for Bevy `_WIND` holds place and swing and, beside light maps, `_WIND_BEND` bend and phase.
    pub pivot: [String; 2],
    /// Attribute whose second number is how far the limb swings, 0 to 1.
    pub swing: String,
    /// Attribute of two numbers: how far a leaf flutters, 0 at its base and on wood, 1 at its tip, and a phase of its own;
    /// `_WIND_LEAF` in files for Bevy.
    pub flutter: String,
}

impl WindEntry {
    /// The layout where a second texture set for light maps is written, or not.
    #[must_use]
    pub fn with_lightmap(lightmap: bool) -> Self {
        let first = if lightmap { 2 } else { 1 };
        let set = |k: u32| format!("TEXCOORD_{}", first + k);
        Self { bend_and_phase: set(0), pivot: [set(1), set(2)], swing: set(2), flutter: set(3) }
    }
}

/// The texture set that light maps are baked for. Each level of a variant has a map of its own.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LightmapEntry {
    /// Attribute of its coordinates, of wood and leaves in one square.
    pub attribute: String,
    /// Texels along the edge of a map in which pieces lie two texels apart, as was asked for.
    pub texels: u32,
}

impl LightmapEntry {
    /// The second set, for maps of so many texels an edge; none for 0.
    #[must_use]
    pub fn of(texels: u32) -> Option<Self> {
        (texels > 0).then(|| Self { attribute: "TEXCOORD_1".to_owned(), texels })
    }
}

/// A variant's files for an engine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AssetEntry {
    /// `Generic`, `Godot`, `Unity`, `Unreal`, `Bevy` or `Web`.
    pub engine: String,
    /// Relative to the manifest; what is loaded first in front.
    pub files: Vec<String>,
}

/// An animated file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipEntry {
    /// Its name, also of the root node and of the animation.
    pub name: String,
    /// Its GLB, relative to the manifest.
    pub file: String,
    /// How long it lasts, seconds.
    pub seconds: f32,
    /// Names of the variants that its keys are.
    pub frames: Vec<String>,
    /// Vertices of wood, each with a target a key.
    pub wood_vertices: u64,
    /// Leaves at every time.
    pub leaves: u64,
    /// What the trunk that bears most bears of the tree, at each key, 0..=1.
    pub trunk_support: Vec<f32>,
}

/// A variant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantEntry {
    /// Its name, also of the root node.
    pub name: String,
    /// Its GLB, relative to the manifest; the first where there are several.
    pub file: String,
    /// Its files for each engine; empty where the set is written for `Generic` alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assets: Vec<AssetEntry>,
    /// Seed of its own randomness; see [`Manifest::seed`].
    pub seed: u64,
    /// How it was made: the preset's words and the weights that were used.
    pub recipe: serde_json::Value,
    /// Of the first level.
    pub bounds: Bounds,
    /// Of the wood above the origin, metres.
    pub height: f32,
    /// Of the thickest stem at its base, metres.
    pub trunk_radius: f32,
    /// Share of the branches whose base lies inside their parent's wood, 0..=1.
    pub topology_continuity: f32,
    /// Branches of all orders, stems included.
    pub chains: u64,
    /// Leaves of the plant before any thinning.
    pub leaves: u64,
    /// Finest first.
    pub levels: Vec<LevelEntry>,
    /// Trunk and thick limbs as a simple collider, thickest first.
    pub capsules: Vec<Capsule>,
    /// Convex hulls that hold the crown, largest first, where the preset asks for some.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hulls: Vec<Hull>,
}

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Least corner.
    pub min: [f32; 3],
    /// Greatest corner.
    pub max: [f32; 3],
}

impl Bounds {
    /// The box around some points; none around none.
    pub fn of(points: impl IntoIterator<Item = glam::Vec3>) -> Option<Self> {
        points.into_iter().fold(None, |all, p| {
            let (min, max) = all.map_or((p, p), |b: Self| (p.min(b.min.into()), p.max(b.max.into())));
            Some(Self { min: min.to_array(), max: max.to_array() })
        })
    }
}

/// A level of detail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelEntry {
    /// Name of its mesh.
    pub mesh: String,
    /// `Full`, `Thinned`, `BillboardCloud`, `CrossedQuads` or `Impostor`.
    pub kind: String,
    /// Triangles of both primitives.
    pub triangles: u64,
    /// Triangles of wood.
    pub bark_triangles: u64,
    /// Triangles of leaves and cards.
    pub leaf_triangles: u64,
    /// Vertices of both.
    pub vertices: u64,
    /// The level is shown down to this share of the screen's height; of the last one the cull point.
    pub screen_coverage: f32,
    /// Distance at which that coverage is reached with a vertical field of view of 60°, metres.
    pub switch_distance: f32,
    /// Against the first level at `pixels`, the size where this level takes over, or the nearest to it that is compared: 540 pixels of
    /// thinned levels at most, 270 of others. None for the first.
    pub measured: Option<MeasuredErrors>,
    /// The same of an impostor's two crossed planes, which are seen without its shader.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without_shader: Option<OutlineErrors>,
    /// The layout of an impostor's sheet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub impostor: Option<ImpostorEntry>,
}

/// How a hemi-octahedral impostor's sheet is laid out: a square of `frames × frames` pictures in the atlas. Frame (i, j),
/// counted from the upper left, is seen from the direction whose hemi-octahedral coordinates are
/// `2 (i, j) / (frames − 1) − 1`. The same stands in the extras of the level's mesh. Green of the ORM map is a leaf's roughness, 200 of
/// 255, and more by 55 times how far a normal looks away from the viewer, whose rest is the normal map's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImpostorEntry {
    /// Always `hemi-octahedral`.
    pub layout: String,
    /// Pictures along an edge.
    pub frames: u32,
    /// Middle of what each picture shows, metres from the tree's origin.
    pub centre: [f32; 3],
    /// Reach of the depth in the ORM map's blue channel, metres before and behind the middle.
    pub radius: f32,
    /// Half the width of what each picture shows, metres.
    pub reach: f32,
    /// Half the height of what a level picture shows, metres; one seen from an elevation e shows
    /// `height cos e + reach sin e`.
    pub height: f32,
    /// Upper left corner of the sheet in the atlas.
    pub uv_min: [f32; 2],
    /// Lower right corner.
    pub uv_max: [f32; 2],
}

/// What was measured of outlines against the first level's, over views on a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutlineErrors {
    /// Intersection over union, 0..=1, the mean of the views.
    pub iou_mean: f32,
    /// The worst view's.
    pub iou_worst: f32,
    /// The level's projected area over the first level's, the mean of the views.
    pub coverage: f32,
}

/// What was measured of a level against the first, over views on a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredErrors {
    /// Height of the tree in the pictures that were compared, pixels.
    pub pixels: u32,
    /// How many views.
    pub views: u32,
    /// Intersection over union of the silhouettes, 0..=1, the mean of the views.
    pub iou_mean: f32,
    /// The worst view's.
    pub iou_worst: f32,
    /// The level's projected area over the first level's, the mean of the views.
    pub coverage: f32,
    /// Distance of the mean colours, sRGB with 1 for white, the mean of the views.
    pub color: f32,
    /// FLIP of the pictures before a sky (Andersson et al. 2020), 0..=1, the mean of the views.
    #[serde(default)]
    pub flip: f32,
}

/// A texture file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextureEntry {
    /// Relative to the manifest.
    pub file: String,
    /// `bark` or `leaf`.
    pub material: String,
    /// `color`, `normal` or `orm`.
    pub map: String,
    /// What red, green and blue of `orm` hold: `occlusion`, `roughness`, and of bark `metalness`, of leaves `transmission`, but
    /// the depth where an [`ImpostorEntry`] says that a sheet lies. Empty for other maps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<String>,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// How many levels it holds, level 0 included; 0 for a picture, of which engines make them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mips: u32,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// The leaf atlas in figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtlasEntry {
    /// Pictures in it.
    pub pictures: u64,
    /// What they were scaled by to fit, 0..=1.
    pub scale: f32,
    /// Mean of what the leaf pictures let through, 0..=1: for what shows leaves without the map, as impostors.
    #[serde(default)]
    pub transmission: f32,
    /// Share of it that pictures take, 0..=1.
    pub utilisation: f32,
    /// Share of the pictures that shows between texels, per mip, level 0 first.
    pub coverage: Vec<f32>,
}

/// Distance at which a tree of `height` metres covers `coverage` of a screen's height with a vertical field of view of
/// 60°, metres; infinite at 0.
#[must_use]
pub fn switch_distance(height: f32, coverage: f32) -> f32 {
    height / (coverage * 2.0 * crate::base::math::tan(std::f32::consts::FRAC_PI_6))
}

impl Manifest {
    /// The manifest as indented JSON with a newline at the end. Not-finite numbers become `null`.
    ///
    /// # Errors
    ///
    /// When the recipe of a variant can't be written.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }

    /// Reads what [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    ///
    /// When the text is no manifest.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}

impl FileEntry {
    /// The entry of a file's bytes.
    #[must_use]
    pub fn of(file: &str, bytes: &[u8]) -> Self {
        let blake3 = blake3::hash(bytes).to_hex().to_string();
        Self { file: file.to_owned(), bytes: bytes.len() as u64, blake3 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_survives_its_text() {
        let level = LevelEntry {
            mesh: "oak_001_LOD0".into(),
            kind: "Thinned".into(),
            triangles: 14,
            bark_triangles: 10,
            leaf_triangles: 4,
            vertices: 30,
            screen_coverage: 0.1,
            switch_distance: 86.6,
            measured: Some(MeasuredErrors {
                pixels: 200,
                views: 8,
                iou_mean: 0.91,
                iou_worst: 0.88,
                coverage: 1.02,
                color: 0.01,
                flip: 0.03,
            }),
            without_shader: Some(OutlineErrors { iou_mean: 0.6, iou_worst: 0.4, coverage: 0.9 }),
            impostor: None,
        };
        let variant = VariantEntry {
            name: "oak_001".into(),
            file: "oak_001.glb".into(),
            assets: Vec::new(),
            seed: u64::MAX,
            recipe: serde_json::json!({"blend": ["a", "b"]}),
            bounds: Bounds::of([glam::Vec3::ONE, glam::Vec3::ZERO]).unwrap(),
            height: 8.0,
            trunk_radius: 0.2,
            topology_continuity: 1.0,
            chains: 3,
            leaves: 5,
            levels: vec![level],
            capsules: vec![Capsule { a: [0.0; 3], b: [0.0, 1.0, 0.0], radius: 0.2 }],
            hulls: vec![Hull { points: vec![[0.5; 3]; 4], triangles: vec![[0, 1, 2]] }],
        };
        let manifest = Manifest {
            generator: "treewright".into(),
            version: "0.1.0".into(),
            format: MANIFEST_FORMAT,
            set: "oak".into(),
            key: "00".into(),
            seed: 41,
            variants: vec![variant],
            clips: Vec::new(),
            wind: None,
            lightmap: None,
            textures: vec![TextureEntry {
                file: "oak_leaf_orm.png".into(),
                material: "leaf".into(),
                map: "orm".into(),
                channels: ["occlusion", "roughness", "transmission"].map(String::from).to_vec(),
                width: 8,
                height: 8,
                mips: 0,
            }],
            atlas: None,
            notes: Vec::new(),
            files: vec![FileEntry::of("oak_001.glb", b"abc")],
        };
        let text = manifest.to_json().unwrap();
        assert_eq!(Manifest::from_json(&text).unwrap(), manifest);
        assert!(text.contains("6437b3ac38465133ffb63b75273a8db548c558465d79db03fd359c6cd5bd9d85"));
        assert_eq!(Bounds::of([]), None);
    }
}
