//! What is around a grown plant: light, obstacles and neighbours. Metres from the foot of the plant, degrees.

use super::look::path;
use super::plan::{Light, Obstacle};
use super::reader::Reader;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};

const fn metres(name: &'static str, low: f32, default: Default, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low, high: 1000.0, unit: "m" }, default, about }
}

/// Where something stands, as fields of its own.
pub(super) const X: Field = metres("x", -1000.0, Default::Is("0.0"), "along x");
/// See [`X`].
pub(super) const Z: Field = metres("z", -1000.0, Default::Is("0.0"), "along z");

/// `light: (lean: 60.0, turn: 90.0, strength: 0.5)`.
pub(super) static LIGHT: Record = Record {
    title: "Light",
    about: "Branches bend towards it, and fewer grow on the side away from it.",
    fields: &[
        Field {
            name: "strength",
            kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
            default: Default::Is("0.0"),
            about: "0 for none; 1 for the most that ways bend to it, half as many branches growing away from level light",
        },
        Field {
            name: "lean",
            kind: Kind::Number { low: 0.0, high: 180.0, unit: "degrees" },
            default: Default::Is("60.0"),
            about: "from the vertical: 0 for light from above, 90 from the side",
        },
        Field {
            name: "turn",
            kind: Kind::Number { low: -360.0, high: 360.0, unit: "degrees" },
            default: Default::Is("0.0"),
            about: "side that it comes from: 0 is +x, 90 is +z. `azimuth` and `view` count from the other axis (0 is +z, 90 is +x): \
                    an azimuth of a is a turn of 90 - a",
        },
    ],
};

/// Boxes and meshes.
pub(super) static OBSTACLE: Choice = Choice {
    title: "Obstacles",
    kinds: &[
        KindOf { name: "Box", form: Form::Fields(&BOX), about: "a box along the axes: a wall, a house" },
        KindOf { name: "Mesh", form: Form::Fields(&MESH), about: "a closed mesh" },
    ],
};

static BOX: Record = Record {
    title: "Box",
    about: "Nothing grows through it.",
    fields: &[
        metres("x", -1000.0, Default::Required, "its middle along x"),
        metres("z", -1000.0, Default::Required, "its middle along z"),
        metres("bottom", -1000.0, Default::Is("0.0"), "height of its lower face"),
        metres("width", 0.01, Default::Required, "extent along x"),
        metres("depth", 0.01, Default::Required, "extent along z"),
        metres("height", 0.01, Default::Required, "extent upwards"),
    ],
};

static MESH: Record = Record {
    title: "Mesh as an obstacle",
    about: "A GLB file in metres, Y up. Only its triangles count.",
    fields: &[
        Field {
            name: "file",
            kind: Kind::Text("the path of a file"),
            default: Default::Required,
            about: "relative to the preset's folder",
        },
        X,
        metres("y", -1000.0, Default::Is("0.0"), "height of its origin"),
        Z,
    ],
};

/// Reads a light.
pub(super) fn light(fields: &Reader<'_, '_>) -> Light {
    fields.needs("strength", &["lean", "turn"], "give a `strength`, 0.5 say, or leave it out");
    let (sin, cos) = crate::base::math::sin_cos(fields.number("lean").to_radians());
    let (across, along) = crate::base::math::sin_cos(fields.number("turn").to_radians());
    Light { direction: [sin * along, cos, sin * across], strength: fields.number("strength") }
}

/// Reads an obstacle.
pub(super) fn obstacle(kind: &str, fields: &Reader<'_, '_>) -> Option<Obstacle> {
    let number = |name| fields.number(name);
    if kind == "Box" {
        let (x, z, bottom) = (number("x"), number("z"), number("bottom"));
        let (width, depth, height) = (number("width") * 0.5, number("depth") * 0.5, number("height"));
        let (low, high) = ([x - width, bottom, z - depth], [x + width, bottom + height, z + depth]);
        return Some(Obstacle::Box { low, high });
    }
    let file = path(fields, "file");
    (!file.is_empty()).then(|| Obstacle::Mesh { file, at: [number("x"), number("y"), number("z")] })
}
