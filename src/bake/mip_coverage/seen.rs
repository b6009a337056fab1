//! Pictures of an atlas, and what of them shows at a mip.

use std::ops::Range;

use super::{CUT, FEW, FULLER, LOOKED_AT, PictureKind, SOLID, SPARSE};
use crate::bake::Rect;

/// A picture of an atlas.
pub(super) struct Picture {
    pub(super) x: [usize; 2],
    pub(super) y: [usize; 2],
    pub(super) kind: PictureKind,
    /// Share of its texels that is solid.
    pub(super) solid: f32,
}

impl Picture {
    /// Those of an atlas; none given are one.
    pub(super) fn all(alpha: &[u8], (width, height): (u32, u32), rects: &[(Rect, PictureKind)]) -> Vec<Self> {
        let whole = [(Rect { x: 0, y: 0, width, height }, PictureKind::Leaf)];
        let rects = if rects.is_empty() { &whole } else { rects };
        rects.iter().map(|(rect, kind)| Self::of(rect, *kind, alpha, (width as usize, height as usize))).collect()
    }

    fn of(rect: &Rect, kind: PictureKind, alpha: &[u8], (wide, high): (usize, usize)) -> Self {
        let ends =
            |first: u32, many: u32, all: usize| [first, first.saturating_add(many)].map(|v| (v as usize).min(all));
        let (x, y) = (ends(rect.x, rect.width, wide), ends(rect.y, rect.height, high));
        let row = |y: usize| alpha[y * wide + x[0]..y * wide + x[1]].iter().filter(|&&a| f32::from(a) >= SOLID).count();
        let solid = (y[0]..y[1]).map(row).sum::<usize>() as f32;
        Self { x, y, kind, solid: solid / ((x[1] - x[0]) * (y[1] - y[0])).max(1) as f32 }
    }

    pub(super) fn is_sparse(&self) -> bool {
        self.kind != PictureKind::Frames && self.solid < SPARSE
    }

    /// Whether its `k`-th mip is of more than a few squares.
    pub(super) fn is_many(&self, k: usize) -> bool {
        self.area() >= FEW * (1_u64 << (2 * k)) as f64
    }

    pub(super) fn area(&self) -> f64 {
        ((self.x[1] - self.x[0]) * (self.y[1] - self.y[0])) as f64
    }

    /// Columns and rows of the squares of the `k`-th mip that it touches.
    pub(super) fn squares(&self, k: usize, (wide, high): (usize, usize)) -> [Range<usize>; 2] {
        let of = |[first, end]: [usize; 2], all: usize| (first >> k).min(all)..end.div_ceil(1 << k).min(all);
        [of(self.x, wide), of(self.y, high)]
    }

    /// Looks at alpha between the squares of the `k`-th mip, at the places of a grid of half a square that lie in the picture, or of
    /// a sixteenth where it is of a few squares; in so many rows as tell it.
    fn look(&self, (at, size): (impl Fn(usize) -> f32, (usize, usize)), k: usize, mut see: impl FnMut(f32)) {
        let many = if self.is_many(k) { 2 } else { 16 };
        // A square, the neighbour that a place of it is nearer to, and the share that is seen of that.
        let places = |[first, end]: [usize; 2], all: usize| -> Vec<(usize, usize, f32)> {
            let place = |texel: usize| texel as f32 * many as f32 / (1_usize << k) as f32;
            let within = (place(first) - 0.5).ceil().max(0.0) as usize..(place(end) - 0.5).ceil().max(0.0) as usize;
            let of = |place: usize| {
                let (own, part) = ((place / many).min(all - 1), (place % many) as f32);
                let from_middle = (part + 0.5) / many as f32 - 0.5;
                let beside = if from_middle < 0.0 { own.saturating_sub(1) } else { (own + 1).min(all - 1) };
                (own, beside, from_middle.abs())
            };
            let middle = 0.5 * (place(first) + place(end));
            if within.is_empty() { vec![of(middle as usize)] } else { within.map(of).collect() }
        };
        let (columns, rows) = (places(self.x, size.0), places(self.y, size.1));
        // Odd, or what repeats would be met at the same rows.
        let step = (columns.len() * rows.len() / LOOKED_AT) | 1;
        // Rows of squares as they are seen at all columns: each is looked at a few times, one after the other.
        let mut lines = [(usize::MAX, Vec::new()), (usize::MAX, Vec::new())];
        for &(own, beside, down) in rows.iter().step_by(step) {
            for (row, other) in [(own, beside), (beside, own)] {
                if lines.iter().all(|line| line.0 != row) {
                    let (held, line) = &mut lines[usize::from(lines[0].0 == other)];
                    *held = row;
                    line.clear();
                    let first = row * size.0;
                    let seen = |&(x, beside, along): &(usize, usize, f32)| {
                        at(first + x) * (1.0 - along) + at(first + beside) * along
                    };
                    line.extend(columns.iter().map(seen));
                }
            }
            let line = |row: usize| &lines[usize::from(lines[0].0 != row)].1;
            for (upper, lower) in line(own).iter().zip(line(beside)) {
                see(upper * (1.0 - down) + lower * down);
            }
        }
    }

    /// How many of the places that it is looked at show, and how many there are.
    fn tally(&self, of: (impl Fn(usize) -> f32, (usize, usize)), k: usize) -> [u32; 2] {
        let [mut solid, mut all] = [0_u32; 2];
        self.look(of, k, |alpha| {
            solid += u32::from(alpha >= CUT);
            all += 1;
        });
        [solid, all]
    }

    /// The share that counts: of a picture that is seen alone what shows, of a sheet of frames squares that are solid.
    pub(super) fn counted(&self, alpha: &[u8], size: (usize, usize), k: usize) -> f32 {
        if self.kind != PictureKind::Frames {
            let [solid, all] = self.tally((|i| f32::from(alpha[i]), size), k);
            return solid as f32 / all.max(1) as f32;
        }
        let [columns, rows] = self.squares(k, size);
        let count = (columns.len() * rows.len()).max(1);
        let row = |y: usize| alpha[y * size.0..][columns.clone()].iter().filter(|&&a| f32::from(a) >= SOLID).count();
        rows.map(row).sum::<usize>() as f32 / count as f32
    }
}

/// Pictures among which what is to show at a mip is shared out: one of many squares, or all of a kind that are of a few only. Of
/// four squares none may be half full, and of forty pictures so many are to show at a mip of a texel each as they cover.
pub(super) struct Pool {
    pub(super) kind: PictureKind,
    pub(super) of: Vec<usize>,
}

impl Pool {
    /// Those of the `k`-th mip.
    pub(super) fn all(pictures: &[Picture], k: usize) -> Vec<Self> {
        let is_many = |i: &usize| pictures[*i].kind == PictureKind::Frames || pictures[*i].is_many(k);
        let (many, few): (Vec<usize>, Vec<usize>) = (0..pictures.len()).partition(is_many);
        let mut pools: Vec<Self> = many.into_iter().map(|i| Self { kind: pictures[i].kind, of: vec![i] }).collect();
        for kind in [PictureKind::Leaf, PictureKind::Card] {
            let of: Vec<usize> = few.iter().copied().filter(|&i| pictures[i].kind == kind).collect();
            if !of.is_empty() {
                pools.push(Self { kind, of });
            }
        }
        pools
    }

    fn members<'a>(&self, pictures: &'a [Picture]) -> impl Iterator<Item = &'a Picture> {
        self.of.iter().map(|&i| &pictures[i])
    }

    /// How many squares of the `k`-th mip one of them takes, in the mean.
    fn squares(&self, pictures: &[Picture], k: usize) -> f64 {
        let area: f64 = self.members(pictures).map(Picture::area).sum();
        area / self.of.len().max(1) as f64 / (1_u64 << (2 * k)) as f64
    }

    /// Whether nothing is asked of the `k`-th mip: cards that are less than a pixel there are of a tree of a few pixels.
    pub(super) fn is_beyond(&self, pictures: &[Picture], k: usize) -> bool {
        self.kind == PictureKind::Card && self.squares(pictures, k) < 1.0
    }

    /// How much more is to show of the `k`-th mip than level 0 does.
    pub(super) fn fuller(&self, pictures: &[Picture], k: usize) -> f32 {
        match self.squares(pictures, k) {
            _ if self.kind != PictureKind::Leaf => 1.0,
            squares if squares > 2.0 => 1.0,
            squares if squares > 0.5 => FULLER[0],
            _ => FULLER[1],
        }
    }

    /// Mean of what is told of each picture, by area.
    pub(super) fn mean(&self, pictures: &[Picture], of: impl Fn(usize) -> f32) -> f32 {
        let area: f64 = self.members(pictures).map(Picture::area).sum();
        let sum: f64 = self.of.iter().map(|&i| pictures[i].area() * f64::from(of(i))).sum();
        (sum / area.max(1.0)) as f32
    }

    /// The share that shows, of alpha that is told by its texel.
    pub(super) fn shown(
        &self,
        pictures: &[Picture],
        of: (impl Fn(usize) -> f32 + Copy, (usize, usize)),
        k: usize,
    ) -> f32 {
        let tallies = self.members(pictures).map(|picture| picture.tally(of, k));
        let [solid, all] = tallies.fold([0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        solid as f32 / all.max(1) as f32
    }

    /// By how much the squares of the `k`-th mip are to be moved for a share to show.
    pub(super) fn shift(
        &self,
        pictures: &[Picture],
        (at, size): (impl Fn(usize) -> f32 + Copy, (usize, usize)),
        k: usize,
        share: f32,
    ) -> f32 {
        const BINS: usize = 1 << 10;
        if share <= 0.0 {
            return 0.0;
        }
        let mut bins = [0_u32; BINS];
        let mut all = 0_u32;
        for picture in self.members(pictures) {
            picture.look((at, size), k, |alpha| {
                bins[((alpha * 4.0) as u32 as usize).min(BINS - 1)] += 1;
                all += 1;
            });
        }
        let wanted = all as f32 * share.min(0.98);
        let (mut above, mut bin) = (0_u32, BINS);
        while bin > 0 && (above as f32) < wanted {
            bin -= 1;
            above += bins[bin];
        }
        CUT - bin as f32 * 0.25
    }
}
