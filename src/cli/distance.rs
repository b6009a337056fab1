//! `treewright distance`: how far plants are from each other in shape space, as a matrix and as a dendrogram.

use rayon::prelude::*;

use super::args::{DistanceArguments, DistanceFormat, DistanceMetric};
use super::inspect::read_file;
use super::over::{Kind, may_write, write_over};
use super::report::{Failure, print};
use crate::blend::shape::{Comparison, Metric, Size, dendrogram, distance_matrix, linkage};
use crate::plant::Plant;
use crate::preset::plan::Facing;

/// Measures, prints and draws.
pub(super) fn run(arguments: &DistanceArguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.dendrogram {
        may_write(path, Kind::Drawing, &arguments.files)?;
    }
    let limits = arguments.limits.limits();
    let read: Vec<Result<(String, Plant), Failure>> =
        arguments.files.par_iter().map(|path| read_file(path, arguments.seed, &limits)).collect();
    let (mut names, mut plants) = (Vec::new(), Vec::new());
    let mut wrong = Vec::new();
    for found in read {
        match found {
            Ok((name, plant)) => {
                names.push(name);
                plants.push(plant);
            }
            Err(Failure::Diagnostics(diagnostics)) => wrong.extend(diagnostics),
            Err(other) => return Err(other),
        }
    }
    if !wrong.is_empty() {
        return Err(Failure::Diagnostics(wrong));
    }
    let metric = match arguments.metric {
        DistanceMetric::Qed => Metric::Qed,
        DistanceMetric::Edit => Metric::Edit,
        DistanceMetric::Elastic => Metric::Elastic,
    };
    let unit = if arguments.relative { "of the size" } else { "m" };
    let facing = if arguments.turn { Facing::Free } else { Facing::Fixed };
    let size = if arguments.relative { Size::Relative } else { Size::AsIs };
    let elastic = arguments.elastic.params();
    let matrix = distance_matrix(&plants, &Comparison { metric, facing, size, elastic })
        .map_err(|error| Failure::Other(format!("can't compare these plants: {error}")))?;
    let merges = linkage(&matrix);
    if let Some(path) = &arguments.dendrogram {
        let svg = dendrogram(&names, &merges, unit);
        write_over(path, svg.as_bytes(), Kind::Drawing, &arguments.files)?;
    }
    print(&match arguments.format {
        DistanceFormat::Json => {
            let merges: Vec<_> =
                merges.iter().map(|m| serde_json::json!({ "of": m.of, "distance": m.distance })).collect();
            let told = serde_json::json!({
                "metric": format!("{metric:?}").to_lowercase(), "unit": unit, "turned": arguments.turn, "relative": arguments.relative,
                "matching": {
                    "epsilon": shown(elastic.epsilon), "direction": shown(elastic.direction), "length": shown(elastic.length),
                },
                "names": names, "distances": matrix, "merges": merges,
            });
            serde_json::to_string_pretty(&told).map_err(|e| Failure::Other(e.to_string()))? + "\n"
        }
        DistanceFormat::Csv => csv(&names, &matrix),
    })
}

/// A cost as it was given.
fn shown(cost: f32) -> f64 {
    (f64::from(cost) * 1e6).round() / 1e6
}

/// The matrix with a line and a column of names (RFC 4180).
fn csv(names: &[String], matrix: &[Vec<f64>]) -> String {
    let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
    let heads: Vec<String> = names.iter().map(quoted).collect();
    let mut text = format!("\"\",{}\n", heads.join(","));
    for (name, row) in heads.iter().zip(matrix) {
        let values: Vec<String> = row.iter().map(|d| format!("{d:.6}")).collect();
        text += &format!("{name},{}\n", values.join(","));
    }
    text
}
