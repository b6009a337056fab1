//! The ranges that growth relies on, whoever made the parameters.

use super::GrowError;
use crate::preset::plan::{Endpoints, GrowParams, Guide, GuideStart, Obstacle, Volume};

/// Most plants beside another.
const MOST_BESIDE: usize = 31;
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
    within("nodes", params.nodes as f32, 16.0, 400_000.0)?;
    within("width", params.width, 0.02, 20.0)?;
    within("crookedness", params.crookedness, 0.0, 1.0)?;
    within("bole", params.bole, 0.0, 1.0)?;
    within("slenderness", params.slenderness, 50.0, 10_000.0)?;
    within("tip_radius", params.tip_radius, 0.0, 10.0)?;
    within("allometry", params.allometry, 0.5, 10.0)?;
    space(params, &within)?;
    within("the number of iterations", params.iterations.len() as f32, 1.0, 32.0)?;
    for (i, iteration) in params.iterations.iter().enumerate() {
        let at =
            |name: &str, value: f32, low: f32, high: f32| within(&format!("iterations[{i}].{name}"), value, low, high);
        let turn = 4.0 * std::f32::consts::PI;
        let angle = |name: &str, value: f32| at(name, value, -turn, turn);
        match iteration.guide {
            Guide::Piecewise { first, then, .. } => angle("guide.first", first).and(angle("guide.then", then))?,
            Guide::Random { low, high } => angle("guide.low", low).and(angle("guide.high", high))?,
            Guide::Polar { theta } => angle("guide.theta", theta)?,
        }
        if let GuideStart::ByHeight { low, high } = iteration.start {
            angle("start.low", low).and(angle("start.high", high))?;
        }
        match iteration.endpoints {
            Endpoints::Surface { proportion, .. } => at("endpoints.proportion", proportion, 0.0, 1.0)?,
            Endpoints::Volume { ref shape, .. } => {
                let (low, high, radius, hollow) = match *shape {
                    Volume::Point { height } => (height, height, 0.0, 0.0),
                    Volume::Ellipsoid { bottom, top, radius, hollow }
                    | Volume::HalfEllipsoid { bottom, top, radius, hollow } => (bottom, top, radius, hollow),
                    Volume::Cone { bottom, top, radius } | Volume::Cylinder { bottom, top, radius } => {
                        (bottom, top, radius, 0.0)
                    }
                };
                at("endpoints.shape.bottom", low, -10.0, 10.0)?;
                at("endpoints.shape.top", high, -10.0, 10.0)?;
                at("endpoints.shape.radius", radius, 0.0, 10.0)?;
                at("endpoints.shape.hollow", hollow, 0.0, 1.0)?;
            }
        }
    }
    Ok(())
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
        // Heights of the first plant, so that the region they share stays bounded.
        for value in beside.at {
            within(&format!("beside[{i}].at"), value, -4.0 * params.height, 4.0 * params.height)?;
        }
        within(&format!("beside[{i}].height"), beside.params.height, params.height * 0.1, params.height * 10.0)?;
        within("plants beside plants beside", beside.params.space.beside.len() as f32, 0.0, 0.0)?;
        check(&beside.params)?;
    }
    Ok(())
}
