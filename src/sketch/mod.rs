//! Sketching: a crown takes the shape that a designer draws (Wang et al. 2018, Sketch-based Shape-preserving Tree
//! Animations).
//!
//! [`Drawing`] reads an SVG; [`Sketcher::bind`] binds a plant to the cages of its lobes, once; [`Sketcher::draw`] finds the
//! deformation for a sketch, and [`Sketched::at`] gives the tree at any time on the way there; [`SketchSteps`] are sketches drawn
//! one over another. Past the paper: front and side at once, outlines that are revolved, a setting for detail, lobes
//! that fill all of a sketch, with its holes, and drawn trunks that stems stand on.

mod adapt;
mod along;
mod bound;
mod cages;
mod crown;
mod draw;
mod fill;
mod fit;
mod frame;
mod ground;
mod laplace;
mod leader;
mod lobe;
mod mean_value;
mod mean_value_mesh;
mod outline;
mod part;
mod prune;
mod raster;
mod region;
mod sketched;
mod spine;
mod stem;
mod steps;
mod svg;
#[cfg(test)]
mod tests;
mod trim;

pub use crate::preset::plan::SketchRules;
pub use bound::{SketchViews, Sketcher, ViewKind};
pub use crown::{crown_outline, crown_silhouette, overlap};
pub use draw::{Method, Sketch};
pub use fit::SketchSize;
pub use mean_value::mean_value;
pub use outline::{discrete_frechet, resampled};
pub use region::{Fill, Region};
pub use sketched::Sketched;
pub use steps::SketchSteps;
pub(crate) use svg::LIKE_A_TRUNK;
pub use svg::{Drawing, SketchError};
