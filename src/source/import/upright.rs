//! Which way is up, and how large: from the file's axes and units to metres, Y up, the base at the origin.

use glam::DVec3;

use crate::plant::{Skeleton, SkeletonNode};
use crate::preset::plan::{ImportHeight, UpAxis};

use super::piece::Piece;
use super::trace::Node;

/// Height below which nothing is a tree, metres.
const SMALLEST: f64 = 1e-3;
/// Heights that a tree can have, metres.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.1..=130.0;

/// Turns all pieces so that Y points up.
///
/// Detection sums the pieces as vectors, weighted by their cross-sections: branches cancel out, the trunk stays. The
/// axis that it runs along is up, Z when in doubt, since that is what every scanner writes.
pub(super) fn stand(pieces: &mut [Piece], up: UpAxis, notes: &mut Vec<String>) {
    let up = match up {
        UpAxis::Detect => {
            let thickest = pieces.iter().fold(0.0_f64, |r, p| r.max(p.radius));
            let weight = |p: &Piece| if thickest > 0.0 { (p.radius / thickest) * (p.radius / thickest) } else { 1.0 };
            let sum = pieces.iter().fold(DVec3::ZERO, |sum, p| sum + (p.end - p.start) * weight(p)).abs();
            let up = if sum.y > sum.z { UpAxis::Y } else { UpAxis::Z };
            let (most, other) = (sum.y.max(sum.z), sum.y.min(sum.z).max(sum.x));
            if most < other * 1.5 {
                notes.push(format!("which axis points up is a guess ({up:?}); say so in the preset if the tree lies"));
            }
            up
        }
        given => given,
    };
    if up != UpAxis::Y {
        for piece in pieces {
            for p in [&mut piece.start, &mut piece.end] {
                *p = DVec3::new(p.x, p.z, -p.y);
            }
        }
    }
}

/// Scales the nodes to a height, if one is asked for; returns the factor. What else there is of the tree is `top` high.
///
/// # Errors
///
/// When no node is above the base, or what is not to be scaled is too small for meshes to have triangles.
pub(super) fn scale(
    nodes: &mut [Node],
    height: ImportHeight,
    top: f64,
    notes: &mut Vec<String>,
) -> Result<f64, String> {
    let wood = nodes.iter().fold(0.0_f64, |top, n| top.max(n.position.y));
    let size = nodes.iter().fold(0.0_f64, |size, n| size.max(n.position.length()));
    if wood <= size * 1e-3 {
        return Err("nothing rises above the base".into());
    }
    let top = wood.max(top);
    let mut factor = 1.0;
    match height {
        ImportHeight::Metres(metres) => {
            factor = f64::from(metres) / top;
            for node in nodes {
                node.position *= factor;
                node.radius *= factor;
            }
        }
        ImportHeight::AsIs if top < SMALLEST => {
            return Err(format!(
                "the tree is {top:e} m high: the file is not in metres; `height` in the preset sets it"
            ));
        }
        ImportHeight::AsIs if !PLAUSIBLE.contains(&top) => {
            notes.push(format!(
                "the tree is {} m high: the file may not be in metres; `height` in the preset sets it",
                (top * 100.0).round() / 100.0
            ));
        }
        ImportHeight::AsIs => {}
    }
    Ok(factor)
}

/// The nodes in single precision.
pub(super) fn skeleton(nodes: &[Node]) -> Skeleton {
    Skeleton {
        nodes: nodes
            .iter()
            .map(|n| SkeletonNode { position: n.position.as_vec3(), radius: n.radius as f32, parent: n.parent })
            .collect(),
    }
}
