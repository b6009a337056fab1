//! Which variants are worth keeping (2017 TVCG, 4.4 and 4.5): branches that collide are removed, trees that no longer look
//! like their sources' kind rejected, the rest scored, and some of them picked.
//!
//! [`Sources`] are measured once a family; [`examine`] filters and measures one bare candidate; [`scores`] compares all
//! of them with the sources; [`pick`] keeps some; [`without`] removes what the filter found from those that are kept.

mod capsules;
mod cluster;
mod collide;
mod edit_distance;
mod examine;
mod pick;
mod profile;
mod proportions;
mod score;
mod topology;
mod wood;

pub use cluster::{clusters, representative};
pub use collide::{Collision, Habits, collisions};
pub use edit_distance::edit_distance;
pub use examine::{Examined, Sources, examine, without};
pub use pick::{PickError, Picked, pick, pick_decided};
pub use profile::Profile;
pub use proportions::{Departure, Proportions};
pub use score::{Difference, Score, Scores, scores};
pub use topology::Topology;
