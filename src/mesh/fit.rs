//! Where the rings of a coarse tube go: where the polyline through them strays least from all rings.
//!
//! Rings that are dropped leave a bend's chord, which lies on one side of it all along. The ones that stay are moved so that
//! the sum of squared distances is least (linear splines, de Boor 1978, ch. XIV: the normal equations of hat functions have
//! three diagonals), in centres and in radii.

use glam::Vec3;

use super::rings::Ring;

/// One line of the normal equations.
#[derive(Clone, Copy, Default)]
struct Line {
    diagonal: f32,
    /// With the next.
    beside: f32,
    centre: Vec3,
    radius: f32,
}

/// Moves the rings that were `kept` of `all`, each by `most` metres at most; the first stays in its parent's wood.
pub(super) fn fit(kept: &mut [Ring], all: &[Ring], most: f32) {
    if kept.len() >= all.len() || kept.len() < 2 {
        return;
    }
    let mut lines = vec![Line::default(); kept.len()];
    let mut span = 0;
    for (i, ring) in all.iter().enumerate() {
        while span + 2 < kept.len() && ring.arc > kept[span + 1].arc {
            span += 1;
        }
        let (from, to) = (kept[span].arc, kept[span + 1].arc);
        let t = ((ring.arc - from) / (to - from).max(1e-9)).clamp(0.0, 1.0);
        let weight = all[(i + 1).min(all.len() - 1)].arc - all[i.saturating_sub(1)].arc;
        for (line, share) in [(span, 1.0 - t), (span + 1, t)] {
            let line = &mut lines[line];
            line.diagonal += weight * share * share;
            line.centre += ring.centre * (weight * share);
            line.radius += ring.radius * (weight * share);
        }
        lines[span].beside += weight * t * (1.0 - t);
    }
    // The first is known; forwards, then back (Thomas 1949).
    let known = lines[0].beside;
    lines[1].centre -= kept[0].centre * known;
    lines[1].radius -= kept[0].radius * known;
    for i in 2..lines.len() {
        let before = lines[i - 1];
        let share = before.beside / before.diagonal.max(1e-12);
        lines[i].diagonal -= share * before.beside;
        lines[i].centre -= before.centre * share;
        lines[i].radius -= before.radius * share;
    }
    let (mut centre, mut radius) = (Vec3::ZERO, 0.0);
    for (ring, line) in kept.iter_mut().zip(&lines).skip(1).rev() {
        let diagonal = line.diagonal.max(1e-12);
        (centre, radius) =
            ((line.centre - centre * line.beside) / diagonal, (line.radius - radius * line.beside) / diagonal);
        ring.centre += (centre - ring.centre).clamp_length_max(most);
        ring.radius = radius.clamp(ring.radius * 0.5, ring.radius + most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arc of a circle of a metre's radius.
    fn bow() -> Vec<Ring> {
        let at = |i: u32| {
            let arc = i as f32 / 20.0;
            let (sin, cos) = crate::base::math::sin_cos(arc);
            let centre = Vec3::new(sin, cos, 0.0);
            Ring { centre, radius: 0.1 - 0.04 * arc, arc, tangent: Vec3::Y, slope: 0.0, worth: 1.0 }
        };
        (0..=20).map(at).collect()
    }

    /// Mean squared distance of all rings from the polyline through those that were kept.
    fn strays(all: &[Ring], kept: &[Ring]) -> f32 {
        let of = |ring: &Ring| {
            let span = kept.array_windows::<2>().find(|[_, b]| ring.arc <= b.arc).unwrap();
            let t = (ring.arc - span[0].arc) / (span[1].arc - span[0].arc);
            span[0].centre.lerp(span[1].centre, t).distance_squared(ring.centre)
        };
        all.iter().map(of).sum::<f32>() / all.len() as f32
    }

    #[test]
    fn what_is_left_of_a_bend_strays_less_and_stays_at_its_base() {
        let all = bow();
        for kept in [vec![all[0], all[20]], vec![all[0], all[6], all[20]], vec![all[0], all[10], all[15], all[20]]] {
            let mut fitted = kept.clone();
            fit(&mut fitted, &all, 1.0);
            let (before, after) = (strays(&all, &kept), strays(&all, &fitted));
            // The best that rings with a fixed first can do are 0.43, 0.26 and 0.51 of it.
            assert!(after < before * 0.52, "{} rings: {before} {after}", kept.len());
            assert_eq!(fitted[0].centre, all[0].centre);
            let thin = fitted.iter().zip(&kept).all(|(a, b)| (a.radius - b.radius).abs() < 1e-4);
            assert!(thin, "radii that are linear stay");
        }
    }

    #[test]
    fn rings_move_no_further_than_they_may_and_all_rings_stay_where_they_are() {
        let all = bow();
        let mut fitted = vec![all[0], all[20]];
        fit(&mut fitted, &all, 0.01);
        assert!((fitted[1].centre.distance(all[20].centre) - 0.01).abs() < 1e-5);
        let mut whole = all.clone();
        fit(&mut whole, &all, 1.0);
        assert!(whole.iter().zip(&all).all(|(a, b)| a.centre == b.centre && a.radius == b.radius));
    }
}
