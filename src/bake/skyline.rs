//! Skyline bottom-left packing of rectangles into a strip (Jylänki 2010, "A Thousand Ways to Pack the Bin", section 2.4), each
//! at multiples of its own.
//!
//! Own instead of the crate `etagere`: shelves lose the space above lower tiles, and here all sizes are known
//! beforehand. Cost is rectangles × steps of the skyline; the steps are at most the strip's width over the alignment.

/// A rectangle to be placed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) width: u32,
    pub(super) height: u32,
    /// What its corner is at a multiple of.
    pub(super) of: u32,
}

/// Places blocks, in the order of `order`, into a rectangle of so many columns and rows, powers of two. The first `squares` of that order are squares of
/// powers of two, the largest first: they lie along a Z-curve (Morton 1966), where four that are alike fill a square. The
/// corner of each, or none when they do not fit.
pub(super) fn place(blocks: &[Block], order: &[usize], squares: usize, size: (u32, u32)) -> Option<Vec<(u32, u32)>> {
    let mut corners = vec![(0, 0); blocks.len()];
    let mut skyline = Skyline { size, steps: vec![(0, 0)] };
    let (squares, others) = order.split_at(squares);
    let mut taken = 0_u64;
    for &i in squares {
        let side = blocks[i].width;
        let area = u64::from(side) * u64::from(side);
        let (x, y) = (side * every_other(taken / area), side * every_other((taken / area) >> 1));
        if x >= size.0 || y >= size.1 {
            return None;
        }
        skyline.raise(x, side, y + side);
        (corners[i], taken) = ((x, y), taken + area);
    }
    for &i in others {
        let (x, y) = skyline.lowest(blocks[i])?;
        skyline.raise(x, blocks[i].width, y + blocks[i].height);
        corners[i] = (x, y);
    }
    Some(corners)
}

/// How high a strip is filled.
struct Skyline {
    /// Columns and rows.
    size: (u32, u32),
    /// From left to right: where each step begins and how high the strip is filled there.
    steps: Vec<(u32, u32)>,
}

impl Skyline {
    /// Where a block ends lowest, and of those places the leftmost.
    fn lowest(&self, Block { width, height, of }: Block) -> Option<(u32, u32)> {
        if width > self.size.0 || height > self.size.1 {
            return None;
        }
        let mut best: Option<(u32, u32)> = None;
        for first in 0..self.steps.len() {
            let x = self.steps[first].0.next_multiple_of(of);
            if x > self.size.0 - width {
                break;
            }
            let ends = |k: usize| self.steps.get(k + 1).map_or(self.size.0, |next| next.0);
            let under = (first..self.steps.len()).take_while(|&k| self.steps[k].0 < x + width).filter(|&k| ends(k) > x);
            let floor = under.map(|k| self.steps[k].1).max().unwrap_or(0).next_multiple_of(of);
            if floor <= self.size.1 - height && best.is_none_or(|(_, y)| floor < y) {
                best = Some((x, floor));
            }
        }
        best
    }

    /// Fills the strip up to `top` from `x` on.
    fn raise(&mut self, x: u32, width: u32, top: u32) {
        let right = x + width;
        let behind = self.steps.iter().rfind(|step| step.0 <= right).map_or(0, |step| step.1);
        self.steps.retain(|step| step.0 < x || step.0 > right);
        let at = self.steps.partition_point(|step| step.0 < x);
        if right < self.size.0 {
            self.steps.insert(at, (right, behind));
        }
        self.steps.insert(at, (x, top));
        self.steps.dedup_by(|b, a| a.1 == b.1);
    }
}

/// Every other bit of a number, the lowest first.
fn every_other(bits: u64) -> u32 {
    (0..32).map(|k| ((bits >> (2 * k) & 1) as u32) << k).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;

    #[test]
    fn blocks_lie_apart_at_their_multiples_whatever_came_before() {
        for round in 0..50 {
            let seed = Seed::new(round);
            let of = |i: u64| 16 << seed.at(3 * i).index(3);
            let side = |i: u64| of(i / 3) * (1 + seed.at(i).index(4) as u32);
            let mut blocks: Vec<Block> =
                (0..40).map(|i| Block { width: side(3 * i + 1), height: side(3 * i + 2), of: of(i) }).collect();
            let squares = [128, 64, 64, 64, 64];
            blocks.extend(squares.map(|side| Block { width: side, height: side, of: side }));
            let order: Vec<usize> = (40..45).chain(0..40).collect();
            let corners = place(&blocks, &order, 5, (2048, 2048)).unwrap();
            assert_eq!(corners[40..], [(0, 0), (128, 0), (192, 0), (128, 64), (192, 64)]);
            let mut taken = vec![false; 128 * 128];
            for (block, (x, y)) in blocks.iter().zip(&corners) {
                assert_eq!((x % block.of, y % block.of), (0, 0));
                for at in (y / 16..(y + block.height) / 16)
                    .flat_map(|y| (x / 16..(x + block.width) / 16).map(move |x| y * 128 + x))
                {
                    assert!(!std::mem::replace(&mut taken[at as usize], true));
                }
            }
        }
        let wide = Block { width: 96, height: 16, of: 16 };
        assert!(place(&[wide], &[0], 0, (64, 128)).is_none() && place(&[wide], &[0], 0, (128, 64)).is_some());
        let square = Block { width: 64, height: 64, of: 64 };
        assert_eq!(place(&[square; 4], &[0, 1, 2, 3], 4, (128, 128)).unwrap(), [(0, 0), (64, 0), (0, 64), (64, 64)]);
        assert!(place(&[square; 5], &[0, 1, 2, 3, 4], 5, (128, 128)).is_none());
    }
}
