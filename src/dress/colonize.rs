//! Space colonization (Runions, Lane and Prusinkiewicz 2007): twigs grow step by step towards the leaf points that are
//! nearest to them, and a point is gone when a twig comes near it.
//!
//! Each point keeps the nearest node so far and looks only among the nodes of the last round for a nearer one, within the
//! distance that it has to beat ([`super::seek`]): the work is linear in points times rounds. Two remedies for what the
//! paper's rule does on its own: a node never grows twice the same way (two points in balance would hold it there for
//! ever), and a twig is at most a fixed number of steps long.

use glam::Vec3;

use super::room::Room;
use super::seek::Seekers;
use super::twig::Wood;
use crate::base::Seed;

/// Twigs that may leave one place on the wood, and one node of a twig.
const FORKS: u8 = 2;
/// Cosine of the smallest angle between two shoots of one node.
const APART: f32 = 0.8;

/// A node of a twig or a place on the wood where twigs can start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shoot {
    /// World, metres.
    pub(super) position: Vec3,
    /// Earlier shoot that it grew from; none for a place on the wood.
    pub(super) parent: Option<u32>,
    /// Unit direction of growth.
    pub(super) direction: Vec3,
    /// Steps from the wood.
    pub(super) depth: u16,
    children: u8,
    /// Direction of its latest child.
    latest: Vec3,
}

/// Grows twigs. The first of the result are the wood's `starts`, in order.
pub(super) fn colonize(wood: &Wood, points: &[Vec3], room: Room<'_>, seed: Seed) -> Vec<Shoot> {
    let (influence, kill, step) = (wood.reach, wood.step * 0.9, wood.step);
    let mut shoots: Vec<Shoot> = wood
        .starts
        .iter()
        .map(|s| Shoot {
            position: s.position,
            parent: None,
            direction: s.direction,
            depth: 0,
            children: 0,
            latest: Vec3::ZERO,
        })
        .collect();
    let most = shoots.len() + points.len() * usize::from(wood.rounds);
    let mut seekers = Seekers::new(points, influence, kill);
    let mut fresh = 0;
    for round in 0..wood.rounds {
        let latest: Vec<Vec3> = shoots[fresh..].iter().map(|s| s.position).collect();
        // Twigs reach points, the wood they start from does not.
        seekers.meet(&latest, fresh as u32, round > 0);
        fresh = shoots.len();
        // The points that pull at each shoot, in their order.
        let mut ends = vec![0_u32; shoots.len() + 1];
        let all: Vec<(u32, u32)> = (0..points.len() as u32).filter_map(|p| Some((seekers.nearest(p)?, p))).collect();
        all.iter().for_each(|&(shoot, _)| ends[shoot as usize + 1] += 1);
        for i in 1..ends.len() {
            ends[i] += ends[i - 1];
        }
        let mut pulls = vec![0_u32; all.len()];
        let mut next = ends.clone();
        for (shoot, p) in all {
            let slot = &mut next[shoot as usize];
            pulls[*slot as usize] = p;
            *slot += 1;
        }
        let mut grew = false;
        for from in 0..fresh as u32 {
            let group = &pulls[ends[from as usize] as usize..ends[from as usize + 1] as usize];
            if group.is_empty() {
                continue;
            }
            let shoot = shoots[from as usize];
            if shoot.children >= FORKS || shoot.depth >= wood.rounds || shoots.len() >= most {
                continue;
            }
            let pull: Vec3 = group.iter().map(|&p| (points[p as usize] - shoot.position).normalize_or_zero()).sum();
            // Twigs keep some of their way, lean to the light, and no two are alike.
            let wander = seed.at(u64::from(from)).direction();
            let direction = (pull.normalize_or_zero() + shoot.direction * 0.55 + wander * 0.22 + Vec3::Y * 0.12)
                .normalize_or(shoot.direction);
            let start = wood.starts.get(from as usize).map_or(0.0, |s| s.radius);
            let position = shoot.position + direction * (step.max(start + step * 0.5));
            // Points that pull the same way again are in balance with others: give them up. So are those behind a wall.
            if (shoot.children > 0 && direction.dot(shoot.latest) > APART) || !room.lets(shoot.position, position) {
                group.iter().for_each(|&p| seekers.give_up(p));
                continue;
            }
            let parent = &mut shoots[from as usize];
            parent.children += 1;
            parent.latest = direction;
            let depth = shoot.depth + 1;
            shoots.push(Shoot { position, parent: Some(from), direction, depth, children: 0, latest: Vec3::ZERO });
            grew = true;
        }
        if !grew {
            break;
        }
    }
    shoots
}
