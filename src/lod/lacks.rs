//! What a level lacks of the full tree or has too much of it, pixel by pixel from some views, asked for at points in space.
//!
//! Cards and leaves are settled by it: a texel or a leaf where the level covers less than the full tree grows, one where
//! it covers more shrinks, and both are drawn again (the simultaneous iterative reconstruction of tomography: Gilbert
//! 1972, with an alpha-tested drawing for its projection). A texel is seen from every view at once, so that what is
//! mended for some views holds for those between them.
//!
//! What a pixel is to cover is drawn away from a half, as much being covered in all: silhouettes are compared at a half,
//! and what is nearly half covered turns over by the least that remains.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::bake::{Silhouette, View};

/// The coverage of pixels from one view, and how points get there.
#[derive(Clone, Debug)]
struct Grid {
    width: usize,
    height: usize,
    /// Pixels to the right and down by metres, and where the origin lies, counted from the first pixel's middle.
    right: Vec3,
    down: Vec3,
    origin: Vec2,
    values: Vec<f32>,
}

impl Grid {
    /// `columns` by `rows` samples, counted for pixels of `size` an edge.
    fn new(view: &View, (columns, rows): (usize, usize), size: usize) -> Self {
        let of = |samples: usize, half: f32| samples as f32 / (2.0 * half.max(1e-9) * size as f32);
        let right = view.frame.x * of(columns, view.half_width);
        let down = -view.frame.y * of(rows, view.half_height);
        let middle = Vec2::new(columns as f32, rows as f32) / (2.0 * size as f32) - 0.5;
        let origin = middle - Vec2::new(right.dot(view.centre), down.dot(view.centre));
        Self { width: columns / size, height: rows / size, right, down, origin, values: Vec::new() }
    }

    /// Between the four pixels around a point; zero outside.
    fn at(&self, point: Vec3) -> f32 {
        let (x, y) = (self.origin.x + self.right.dot(point), self.origin.y + self.down.dot(point));
        if !(x >= 0.0 && y >= 0.0) {
            return 0.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f32, y - row as f32);
        if column + 1 >= self.width || row + 1 >= self.height {
            return 0.0;
        }
        let four = &self.values[row * self.width + column..][..self.width + 2];
        let (upper, lower) = ([four[0], four[1]], [four[self.width], four[self.width + 1]]);
        let [upper, lower] = [upper, lower].map(|[left, right]| left + (right - left) * fx);
        upper + (lower - upper) * fy
    }
}

/// What pixels are to cover, from all views.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    grids: Vec<Grid>,
}

/// What they lack: wanted less covered.
#[derive(Clone, Debug)]
pub(super) struct Lacks(Vec<Grid>);

impl Wanted {
    /// Of drawings, in pixels of `size` samples an edge, drawn away from a half by `contrast`.
    pub(super) fn new(views: &[View], drawn: &[Silhouette], (size, contrast): (usize, f32)) -> Self {
        let grid = |(view, drawn): (&View, &Silhouette)| {
            let mut grid = Grid::new(view, drawn.size(), size);
            grid.values = shares(drawn, size);
            stretch(&mut grid.values, contrast);
            grid
        };
        Self { grids: views.par_iter().zip(drawn).map(grid).collect() }
    }

    /// That of several, one after the other.
    pub(super) fn joined(all: Vec<Self>) -> Self {
        Self { grids: all.into_iter().flat_map(|one| one.grids).collect() }
    }

    /// What a level lacks that `draw` draws from some of the views, in pixels of `size` samples of its drawings.
    pub(super) fn lacks(&self, views: &[usize], size: usize, draw: &(dyn Fn(usize) -> Silhouette + Sync)) -> Lacks {
        let lack = |&view: &usize| {
            let mut lack = self.grids[view].clone();
            lack.values.iter_mut().zip(shares(&draw(view), size)).for_each(|(w, c)| *w -= c);
            lack
        };
        Lacks(views.par_iter().map(lack).collect())
    }
}

impl Lacks {
    /// From one of the views, counted among those that were asked for.
    pub(super) fn of(&self, view: usize, point: Vec3) -> f32 {
        self.0[view].at(point)
    }

    /// Mean over the views, -1..=1; positive where more is to be covered.
    pub(super) fn at(&self, point: Vec3) -> f32 {
        self.0.iter().map(|grid| grid.at(point)).sum::<f32>() / self.0.len().max(1) as f32
    }
}

fn shares(drawn: &Silhouette, size: usize) -> Vec<f32> {
    let whole = 1.0 / (size * size) as f32;
    drawn.pixels(size).into_iter().map(|c| f32::from(c) * whole).collect()
}

/// Draws values away from a half by a factor, clear ones excepted, so that their sum stays.
pub(super) fn stretch(values: &mut [f32], contrast: f32) {
    let wanted: f32 = values.iter().sum();
    let tone = |v: f32, shift: f32| if v > 0.0 { (0.5 + (v - 0.5) * contrast + shift).clamp(0.0, 1.0) } else { 0.0 };
    let (mut low, mut high) = (-1.0_f32, 1.0_f32);
    for _ in 0..12 {
        let middle = (low + high) * 0.5;
        if values.iter().map(|&v| tone(v, middle)).sum::<f32>() < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    values.iter_mut().for_each(|v| *v = tone(*v, high));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Repeat, Shape};
    use crate::base::Frame;
    use crate::mesh::Mesh;

    /// A square of two metres from `low` to `high` along x, drawn from the front on 64 by 64 samples, four metres wide.
    fn square(low: f32, high: f32) -> (View, Silhouette) {
        let view = View::new(Frame::WORLD, Vec3::ZERO, 2.0, 2.0);
        let corners = [(low, -1.0), (high, -1.0), (high, 1.0), (low, 1.0)];
        let mesh = Mesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        };
        (
            view,
            Silhouette::new(
                &[Shape { mesh: &mesh, cutouts: &[], repeat: Repeat::Tiled, closed: false }],
                &view,
                64,
                64,
            ),
        )
    }

    #[test]
    fn a_level_lacks_what_the_full_tree_has_more_at_any_depth() {
        let ((view, full), (_, level)) = (square(-1.0, 1.0), square(0.0, 1.5));
        let lacks = Wanted::new(&[view], &[full], (4, 1.0)).lacks(&[0], 4, &|_| level.clone());
        for depth in [-5.0, 0.0, 3.0] {
            let at = |x: f32, y: f32| lacks.at(Vec3::new(x, y, depth));
            assert!(at(-0.5, 0.0) > 0.9 && at(0.5, 0.0).abs() < 0.1 && at(1.25, 0.0) < -0.9);
            assert!(at(-0.5, 1.6).abs() < 0.1 && at(90.0, 0.0) == 0.0 && at(f32::NAN, 0.0) == 0.0);
        }
    }

    #[test]
    fn stretching_draws_away_from_a_half_and_keeps_the_sum() {
        let mut values: Vec<f32> = (0..100).map(|i| i as f32 / 100.0).collect();
        let before: f32 = values.iter().sum();
        stretch(&mut values, 2.0);
        assert!((values.iter().sum::<f32>() - before).abs() < 0.5);
        assert!(values[0] == 0.0 && values[30] < 0.2 && values[70] > 0.8);
        let mut none = [0.0; 3];
        stretch(&mut none, 2.0);
        assert_eq!(none, [0.0; 3]);
    }
}
