//! The ranges that growth relies on, whoever made the parameters.

use super::GrowError;
use crate::preset::plan::{
    Count, Endpoints, FieldPrimitive, FieldRegion, GrowParams, Guide, GuideStart, MOST_TAPER, Obstacle, Sampling,
    Volume,
};

/// Most plants beside another.
const MOST_BESIDE: usize = 31;
/// Farther from the first no plant stands, metres: numbers would lose their millimetres.
const FARTHEST: f32 = 2000.0;
/// Most obstacles.
const MOST_OBSTACLES: usize = 256;

/// The ranges that the rest relies on.
pub(super) fn check(params: &GrowParams) -> Result<(), GrowError> {
    let within = |field: &str, value: f32, low: f32, high: f32| {
        // A NaN is in no range.
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(GrowError::OutOfRange { field: field.to_owned(), value, low, high })
        }
    };
    within("height", params.height, 0.01, 1000.0)?;
    within("nodes", params.nodes as f32, 16.0, 4_000_000.0)?;
    within("width", params.width, 0.02, 20.0)?;
    within("crookedness", params.crookedness, 0.0, 1.0)?;
    within("length_cost", params.length_cost, 0.0, 10.0)?;
    within("whim", params.whim, 0.0, 0.95)?;
    within("bole", params.bole, 0.0, 1.0)?;
    within("slenderness", params.slenderness, 50.0, 10_000.0)?;
    within("tip_radius", params.tip_radius, 0.0, 10.0)?;
    within("allometry", params.allometry, 0.5, 10.0)?;
    within("taper", params.taper, 0.0, MOST_TAPER)?;
    within("flare", params.flare, 0.0, 10.0)?;
    within("flare_height", params.flare_height, 0.0, 100.0)?;
    space(params, &within)?;
    within("the number of iterations", params.iterations.len() as f32, 1.0, 32.0)?;
    for (i, iteration) in params.iterations.iter().enumerate() {
        let at =
            |name: &str, value: f32, low: f32, high: f32| within(&format!("iterations[{i}].{name}"), value, low, high);
        guide_within(&iteration.guide, &|name, value, low, high| at(&format!("guide.{name}"), value, low, high), 8)?;
        if let GuideStart::ByHeight { low, high } = iteration.start {
            at("start.low", low, -TURN, TURN).and(at("start.high", high, -TURN, TURN))?;
        }
        if let Endpoints::Volume { sampling: Sampling::Whorls { spacing }, .. }
        | Endpoints::Surface { sampling: Sampling::Whorls { spacing }, .. } = iteration.endpoints
        {
            at("endpoints.sampling.spacing", spacing, 0.001, 10.0)?;
        }
        match iteration.endpoints {
            Endpoints::Surface { t, irregular, .. } => {
                at("endpoints.t", t, 0.0, 1.0)?;
                at("endpoints.irregular", irregular, 0.0, 1.0)?;
            }
            Endpoints::Volume { ref shape, count, .. } => {
                let (low, high, reach, hollow) = match *shape {
                    Volume::Point { height, out, turn } => {
                        at("endpoints.shape.turn", turn.unwrap_or(0.0), -100.0, 100.0)?;
                        (height, height, out, 0.0)
                    }
                    Volume::Ellipsoid { bottom, top, radius, hollow }
                    | Volume::HalfEllipsoid { bottom, top, radius, hollow }
                    | Volume::Cone { bottom, top, radius, hollow }
                    | Volume::Cylinder { bottom, top, radius, hollow } => (bottom, top, radius, hollow),
                    Volume::Box { bottom, top, width, depth, hollow } => (bottom, top, width.max(depth), hollow),
                    Volume::Mesh { bottom, top, .. } | Volume::Outline { bottom, top, .. } => (bottom, top, 0.0, 0.0),
                };
                at("endpoints.shape.bottom", low, -10.0, 10.0)?;
                at("endpoints.shape.top", high, -10.0, 10.0)?;
                at("endpoints.shape.radius", reach, 0.0, 20.0)?;
                at("endpoints.shape.hollow", hollow, 0.0, 1.0)?;
                if let Count::Density(density) = count {
                    at("endpoints.density", density, 0.0, 1e6)?;
                }
            }
        }
    }
    Ok(())
}

/// Largest turn, radians.
const TURN: f32 = 4.0 * std::f32::consts::PI;

/// Says that a field of this name and value is outside of these bounds, where it is.
type Range<'a> = dyn Fn(&str, f32, f32, f32) -> Result<(), GrowError> + 'a;

/// The ranges of a guide, splits at most `deep` deep.
fn guide_within(guide: &Guide, at: &Range<'_>, deep: u32) -> Result<(), GrowError> {
    let angle = |name: &str, value: f32| at(name, value, -TURN, TURN);
    match guide {
        Guide::Constant { alpha } => angle("alpha", *alpha),
        Guide::Piecewise { alpha1, alpha2, .. } => angle("alpha1", *alpha1).and(angle("alpha2", *alpha2)),
        Guide::Random { low, high, alpha2, .. } => {
            angle("low", *low).and(angle("high", *high)).and(angle("alpha2", *alpha2))
        }
        Guide::Polar { theta } => angle("theta", *theta),
        Guide::Split { height, lower, upper } => {
            at("height", *height, -10.0, 10.0)?;
            at("how deep splits go", 9.0 - deep as f32, 1.0, 8.0)?;
            guide_within(lower, at, deep - 1).and_then(|()| guide_within(upper, at, deep - 1))
        }
        Guide::Field { parts } => {
            at("the number of parts", parts.len() as f32, 1.0, 64.0)?;
            for part in parts {
                at("weight", part.weight, -1000.0, 1000.0)?;
                match part.primitive {
                    FieldPrimitive::Uniform { lean, turn } => angle("lean", lean).and(angle("turn", turn))?,
                    FieldPrimitive::Helical { rise } => angle("rise", rise)?,
                    FieldPrimitive::Rotational { height, .. }
                    | FieldPrimitive::Spherical { height }
                    | FieldPrimitive::Radial { height } => at("height", height, -10.0, 10.0)?,
                    FieldPrimitive::Outward => {}
                }
                let (low, high, soft) = match part.region {
                    FieldRegion::Everywhere => (0.0, 0.0, 0.0),
                    FieldRegion::Layer { bottom, top, soft } => (bottom, top, soft),
                    FieldRegion::Ball { height, radius, soft } => (height, radius, soft),
                    FieldRegion::Core { radius, soft } => (0.0, radius, soft),
                };
                at("region", low, -10.0, 10.0).and(at("region", high, -10.0, 10.0))?;
                at("region.soft", soft, 0.0, 10.0)?;
            }
            Ok(())
        }
    }
}

/// The ranges of what is around a plant.
fn space(params: &GrowParams, within: &impl Fn(&str, f32, f32, f32) -> Result<(), GrowError>) -> Result<(), GrowError> {
    let space = &params.space;
    within("detail", space.detail, 1.0, 4.0)?;
    within("clearance", space.clearance, 0.0, 100.0)?;
    within("light.strength", space.light.strength, 0.0, 1.0)?;
    let [x, y, z] = space.light.direction;
    within("light.direction's length", x.abs() + y.abs() + z.abs(), 1e-6, 1e6)?;
    within("the number of obstacles", space.obstacles.len() as f32, 0.0, MOST_OBSTACLES as f32)?;
    for (i, obstacle) in space.obstacles.iter().enumerate() {
        let corners: &[[f32; 3]] = match obstacle {
            Obstacle::Box { low, high } => &[*low, *high],
            Obstacle::Mesh { at, .. } => &[*at],
        };
        for value in corners.iter().flatten() {
            within(&format!("obstacles[{i}]"), *value, -10_000.0, 10_000.0)?;
        }
    }
    within("the number of plants beside", space.beside.len() as f32, 0.0, MOST_BESIDE as f32)?;
    for (i, beside) in space.beside.iter().enumerate() {
        for value in beside.at {
            within(&format!("beside[{i}].at"), value, -FARTHEST, FARTHEST)?;
        }
        within("plants beside plants beside", beside.params.space.beside.len() as f32, 0.0, 0.0)?;
        check(&beside.params)?;
    }
    Ok(())
}
