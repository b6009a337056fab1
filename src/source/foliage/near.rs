//! The nearest of many points: a k-d tree without nodes, in the order of its own array.

use glam::Vec3;

/// Points by place.
#[derive(Debug)]
pub(super) struct Near {
    /// Position and index as given; the middle of every span splits it along the span's axis.
    points: Vec<(Vec3, u32)>,
    /// The axis that each middle splits along.
    axes: Vec<u8>,
}

impl Near {
    /// Sorts points into a tree: n log n.
    pub(super) fn new(points: impl Iterator<Item = Vec3>) -> Self {
        let points: Vec<(Vec3, u32)> = points.enumerate().map(|(i, p)| (p, i as u32)).collect();
        let mut tree = Self { axes: vec![0; points.len()], points };
        let all = 0..tree.points.len();
        let mut work = Vec::from([all]);
        while let Some(span) = work.pop() {
            if span.len() < 2 {
                continue;
            }
            let here = &mut tree.points[span.clone()];
            let (low, high) = here
                .iter()
                .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (p, _)| (low.min(*p), high.max(*p)));
            let size = high - low;
            let axis = usize::from(size.y > size.x.max(size.z)) + 2 * usize::from(size.z > size.x && size.z >= size.y);
            let middle = here.len() / 2;
            here.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
            let middle = span.start + middle;
            tree.axes[middle] = axis as u8;
            work.push(span.start..middle);
            work.push(middle + 1..span.end);
        }
        tree
    }

    /// Index and distance of the nearest point; none where there is none.
    pub(super) fn find(&self, p: Vec3) -> Option<(u32, f32)> {
        let mut best: Option<(u32, f32)> = None;
        let mut work = vec![(0..self.points.len(), 0.0_f32)];
        while let Some((span, gap)) = work.pop() {
            if span.is_empty() || best.is_some_and(|(_, d)| gap >= d) {
                continue;
            }
            let middle = span.start + span.len() / 2;
            let (here, index) = self.points[middle];
            let square = here.distance_squared(p);
            if best.is_none_or(|(i, d)| square < d || (square == d && index < i)) {
                best = Some((index, square));
            }
            let axis = usize::from(self.axes[middle]);
            let side = p[axis] - here[axis];
            let (near, far) = (span.start..middle, middle + 1..span.end);
            let (near, far) = if side < 0.0 { (near, far) } else { (far, near) };
            work.push((far, side * side));
            work.push((near, 0.0));
        }
        best.map(|(i, square)| (i, square.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn the_nearest_point_is_found_among_many() {
        let points: Vec<Vec3> =
            (0..500).map(|i| Seed::new(3).at(i).direction() * Seed::new(4).at(i).range(0.1, 3.0)).collect();
        let near = Near::new(points.iter().copied());
        for k in 0..100 {
            let p = Seed::new(5).at(k).direction() * 2.0;
            let truth = points.iter().map(|q| q.distance(p)).fold(f32::MAX, f32::min);
            let (found, distance) = near.find(p).unwrap();
            assert!((distance - truth).abs() < 1e-6 && (points[found as usize].distance(p) - truth).abs() < 1e-6);
        }
        assert!(Near::new(std::iter::empty()).find(Vec3::ZERO).is_none());
    }
}
