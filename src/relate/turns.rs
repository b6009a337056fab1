//! How far the branching vector of a kin is turned: the members' turns averaged by their shares (2017 TVCG, 4.3; 2018 TOG,
//! Eq. 6 on rotations).
//!
//! Of two members it is the paper's quaternion interpolation. Of more it is their Fréchet mean, the rotation from which the
//! sum of `share · angle²` is least, so the order of the sources does not count: all sums run in an order of plants that
//! depends on what these are only. The descent is Karcher's: the step is the mean of the ways to the members. It lessens the
//! sum on every step, since half the squared angle bends by 1 at most, and where ways go round the other side the sum is less
//! than its bound. Turns that all lie within a quarter turn of the reference have one minimum. Beyond that there
//! may be several, and the descent starts from the members from which the sum is least.
//!
//! Turns are told from a member of reference, and two ways round three members do not end at the same twist. So the reference
//! is the member that points most as all do together.
//!
//! Limits: between members all round a trunk the mean jumps where two minima change places, as means on a circle do.

use glam::Vec3;

use super::family::Member;
use crate::base::{Rotation, math};

/// Cosine of half a quarter turn.
const NEAR: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Starts of a descent where there may be several minima.
const STARTS: usize = 3;
/// Most steps of a descent, and the step at which it ends, radians of half the turn.
const STEPS: usize = 64;
const ENDS: f64 = 1e-8;
/// How much less a sum must be to be less, a share: what rounding may do is no reason.
const LESS: f64 = 1e-9;

/// A unit quaternion in double precision: x, y, z, w.
type Unit = [f64; 4];

/// The members' turns averaged by their shares. `order` is the order of the sources in sums.
pub(super) fn turn_of(row: &[Member], shares: &[f32], order: &[u32]) -> Rotation {
    let mut turns = row.iter().zip(shares).filter(|(_, share)| **share > 0.0);
    let Some((first, &share)) = turns.next() else { return Rotation::IDENTITY };
    let Some((second, &other)) = turns.next() else { return first.turn };
    if turns.next().is_none() {
        return between(first, second, other / (share + other));
    }
    let there = order.iter().map(|&s| (&row[s as usize], shares[s as usize])).filter(|(_, share)| *share > 0.0);
    let unit = |r: Rotation| [r.v.x, r.v.y, r.v.z, r.w].map(f64::from);
    let mut is_near = true;
    let turns: Vec<(Unit, f64)> = there
        .map(|(member, share)| {
            is_near &= member.turn.w > NEAR;
            (unit(member.turn), f64::from(share))
        })
        .collect();
    let [x, y, z, w] = mean(&turns, is_near).map(|c| c as f32);
    Rotation { v: Vec3::new(x, y, z), w }
}

fn between(first: &Member, second: &Member, share: f32) -> Rotation {
    // From no turn at all, the arc is known.
    if first.half_angle == 0.0 && second.half_angle > 1e-3 {
        let (sin, cos) = math::sin_cos(second.half_angle * share);
        Rotation { v: second.turn.v * (sin / second.turn.v.length()), w: cos }
    } else {
        first.turn.slerp(second.turn, share)
    }
}

/// Of some branching vectors, in the order of sums, the one that points most as all do together: its place.
pub(super) fn reference(vectors: &[Vec3]) -> usize {
    if vectors.len() < 3 {
        return 0;
    }
    let sum = vectors.iter().fold(Vec3::ZERO, |sum, v| sum + *v);
    let along = |i: usize| vectors[i].dot(sum);
    // Those that are as near to a digit are equal, and the first is taken.
    (1..vectors.len()).fold(0, |best, i| if along(i) > along(best) + 1e-5 { i } else { best })
}

/// The Fréchet mean of weighted rotations; `is_near` where all lie within a quarter turn of none.
fn mean(turns: &[(Unit, f64)], is_near: bool) -> Unit {
    if is_near {
        let sum = turns.iter().fold([0.0; 4], |sum, (q, share)| std::array::from_fn(|c| sum[c] + q[c] * share));
        return descend(normal(sum), turns).0;
    }
    let mut starts: Vec<(f64, Unit)> = turns.iter().map(|(q, _)| (cost(q, turns), *q)).collect();
    // Stable, so of equals the first.
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = (turns[0].0, f64::INFINITY);
    for (_, start) in starts.into_iter().take(STARTS) {
        let found = descend(start, turns);
        if found.1 < best.1 * (1.0 - LESS) {
            best = found;
        }
    }
    best.0
}

/// Where the descent from a rotation ends, and the sum there.
fn descend(mut at: Unit, turns: &[(Unit, f64)]) -> (Unit, f64) {
    for _ in 0..STEPS {
        let (mut step, mut weight) = ([0.0; 4], 0.0);
        for (q, share) in turns {
            let dot = dot(&at, q);
            // Of the two quaternions of a rotation the nearer.
            let (sign, cos) = (if dot < 0.0 { -1.0 } else { 1.0 }, dot.abs().min(1.0));
            let angle = math::acos64(cos);
            let sine = (1.0 - cos * cos).sqrt();
            let per = share * if sine > 1e-9 { angle / sine } else { 1.0 };
            step = std::array::from_fn(|c| step[c] + (sign * q[c] - cos * at[c]) * per);
            weight += share;
        }
        let step = step.map(|c| c / weight);
        let length = dot(&step, &step).sqrt();
        if length < ENDS {
            break;
        }
        let (sin, cos) = (math::sin64(length) / length, math::cos64(length));
        at = normal(std::array::from_fn(|c| at[c] * cos + step[c] * sin));
    }
    (at, cost(&at, turns))
}

/// The sum of `share · angle²`, by half angles.
fn cost(at: &Unit, turns: &[(Unit, f64)]) -> f64 {
    let square = |x: f64| x * x;
    turns.iter().map(|(q, share)| share * square(math::acos64(dot(at, q).abs()))).sum()
}

fn dot(a: &Unit, b: &Unit) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

fn normal(q: Unit) -> Unit {
    let length = dot(&q, &q).sqrt();
    if length > 0.0 { q.map(|c| c / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::relate::family::NONE;

    fn member(turn: Rotation) -> Member {
        let turn = if turn.w < 0.0 { Rotation { v: -turn.v, w: -turn.w } } else { turn };
        let half_angle = math::atan2(turn.v.length(), turn.w);
        Member { chain: 0, location: 0.0, turn, half_angle, sharers: 1, base: 0.1, twin: NONE, stoutness: 1.0 }
    }

    fn sum_of_squares(at: Rotation, row: &[Member], shares: &[f32]) -> f64 {
        let unit = |r: Rotation| [r.v.x, r.v.y, r.v.z, r.w].map(f64::from);
        let turns: Vec<(Unit, f64)> = row.iter().zip(shares).map(|(m, s)| (unit(m.turn), f64::from(*s))).collect();
        cost(&unit(at), &turns)
    }

    #[test]
    fn the_mean_of_some_turns_is_where_the_sum_of_squares_is_least_in_any_order() {
        for i in 0..60 {
            let seed = Seed::new(5).at(i);
            let wide = if i % 2 == 0 { 0.7 } else { 3.1 };
            let count = 3 + i % 4;
            let turn = |k: u64| Rotation::about(seed.at(k).direction(), seed.at(k).child("angle").range(-wide, wide));
            let row: Vec<Member> = (0..count).map(|k| member(turn(k))).collect();
            let shares: Vec<f32> = (0..count).map(|k| seed.child("share").at(k).range(0.1, 1.0)).collect();
            let order: Vec<u32> = (0..count as u32).collect();
            let mean = turn_of(&row, &shares, &order);
            let least = sum_of_squares(mean, &row, &shares);
            // Nothing beside it is less, nor is any member.
            for k in 0..40 {
                let aside = Rotation::about(seed.child("aside").at(k).direction(), 0.02).after(mean);
                assert!(sum_of_squares(aside, &row, &shares) > least - 1e-6, "{i}");
            }
            assert!(row.iter().all(|m| sum_of_squares(m.turn, &row, &shares) > least - 1e-6));
            // Backwards, in the same order of sums.
            let back = |k: &u32| count as u32 - 1 - k;
            let (row, shares): (Vec<Member>, Vec<f32>) = row.into_iter().zip(shares).rev().unzip();
            assert!(turn_of(&row, &shares, &order.iter().map(back).collect::<Vec<_>>()) == mean, "{i}");
        }
    }

    #[test]
    fn turns_about_one_axis_have_the_mean_of_their_angles() {
        let row: Vec<Member> = [-1.1_f32, 0.0, 1.4].map(|a| member(Rotation::about(Vec3::Y, a))).to_vec();
        let found = turn_of(&row, &[1.0, 1.0, 2.0], &[0, 1, 2]);
        let wanted = Rotation::about(Vec3::Y, (2.8 - 1.1) / 4.0);
        assert!(found.v.distance(wanted.v) < 1e-6 && (found.w - wanted.w).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn of_two_it_is_their_slerp_to_the_last_bit_and_of_one_itself() {
        for i in 0..50 {
            let turn = |k: u64| Rotation::about(Seed::new(i).at(k).direction(), 0.3 + k as f32);
            let row: Vec<Member> = (0..3).map(|k| member(turn(k))).collect();
            let (a, b) = (row[0].turn, row[2].turn);
            assert!(turn_of(&row, &[0.3, 0.0, 0.7], &[2, 1, 0]) == a.slerp(b, 0.7 / (0.3 + 0.7)));
            assert!(turn_of(&row, &[0.0, 0.0, 0.2], &[2, 1, 0]) == b);
        }
    }
}
