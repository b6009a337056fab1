//! The wood of an impostor: lines along a tree's limbs, as wide as those are and a texel at least.
//!
//! A limb that is thinner than a texel covers a part of several, and what of these is solid breaks into dashes, at other
//! places in each of the three frames that a viewer sees mixed. So where wood is seen it is drawn anew: alpha falls by the
//! distance from a limb's axis and is a half at its rim, which a bilinear filter follows between texels (Green 2007,
//! "Improved alpha-tested magnification"). Limbs are the same in all frames, so that lines that are mixed meet.
//!
//! Lines that are wider than limbs cover more: the thickest are drawn, and only so many as cover what all do. Stems are drawn down to
//! where their wood ends below the ground.

use glam::{Vec2, Vec3};

use super::impostor::Impostor;
use crate::base::Frame;
use crate::mesh::Mesh;
use crate::plant::{ChainId, Plant, Posed};

/// Half the least width of a line, texels: half a texel, and a little that mixing and rounding take. With half a texel alone thin
/// limbs have gaps.
const LEAST: f32 = 0.55;
/// By how much alpha falls in a texel.
const SLOPE: f32 = 0.5;
/// By how much of what the wood of a bare tree covers its lines may cover more.
const WIDENED: f32 = 0.2;
/// Radius of the thinnest limb that may be drawn, texels.
const THINNEST: f32 = 0.05;
/// Pieces are so long at least, texels.
const PIECE: f32 = 0.5;
/// Texels around one by which it is told whether wood or leaves are seen there, and how far lines go on between leaves: what of
/// a crown is solid begins farther up than its lowest leaves.
const AROUND: usize = 2;
const INTO_CROWN: usize = 2;

/// What of a frame is wood.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// What the wood covers of each texel, 0..=1.
    pub(super) covered: Vec<f32>,
    /// Texels around which wood covers more than leaves do: there lines are all that is drawn.
    pub(super) clear: Vec<bool>,
    /// Those and some around them, where lines are drawn beside what else is.
    pub(super) near: Vec<bool>,
}

impl Seen {
    /// Of what wood and leaves cover of each texel, in rows of `width`.
    pub(super) fn new(wood: Vec<f32>, leaves: &[f32], width: usize) -> Self {
        let height = wood.len() / width.max(1);
        let (mut clear, mut near) = (vec![false; wood.len()], vec![false; wood.len()]);
        let around = |i: usize, by: usize| {
            let part = |at: usize, count: usize| at.saturating_sub(by)..(at + by + 1).min(count);
            let columns = part(i % width, width);
            part(i / width, height).map(move |row| row * width + columns.start..row * width + columns.end)
        };
        if wood.iter().any(|covered| *covered > 0.0) {
            for (i, clear) in clear.iter_mut().enumerate() {
                let (own, others) = around(i, AROUND).fold((0.0, 0.0), |(own, others), row| {
                    (own + wood[row.clone()].iter().sum::<f32>(), others + leaves[row].iter().sum::<f32>())
                });
                if own > others {
                    *clear = true;
                    around(i, INTO_CROWN).for_each(|row| near[row].fill(true));
                }
            }
        }
        Self { covered: wood, clear, near }
    }

    /// What wood covers where lines are drawn.
    fn in_the_clear(&self) -> f32 {
        self.covered.iter().zip(&self.clear).filter(|(_, clear)| **clear).map(|(covered, _)| covered).sum()
    }
}

/// The limbs of a tree, the thickest first; no limb comes before what bears it.
pub(super) struct Limbs<'a> {
    plant: &'a Plant,
    posed: &'a Posed,
    order: Vec<ChainId>,
    /// Limbs of so small a radius and thinner are not drawn, metres.
    below: f32,
    /// How low the wood of each chain reaches, metres; nothing where no stem goes on below its foot.
    lowest: Vec<f32>,
}

/// Lines in a frame.
pub(super) struct Lines {
    axes: Frame,
    centre: Vec3,
    /// Texels a metre, right and down, and where the centre lies.
    scale: Vec2,
    middle: f32,
    texels: usize,
    /// A half and more is solid.
    pub(super) alpha: Vec<f32>,
    /// Metres before the frame's plane, where alpha is not zero.
    pub(super) depth: Vec<f32>,
}

impl<'a> Limbs<'a> {
    /// Those that are shown.
    pub(super) fn of(plant: &'a Plant, posed: &'a Posed, shown: &[bool]) -> Self {
        let mut thick: Vec<f32> = Vec::with_capacity(plant.chains().len());
        for id in plant.chain_ids() {
            let (mut length, mut area) = (0.0, 0.0);
            for (p, r) in posed.chain(plant, id).windows(2).zip(plant.radii(id).windows(2)) {
                let piece = p[0].distance(p[1]);
                length += piece;
                area += piece * (r[0] + r[1]) * 0.5;
            }
            let mean = if length > 0.0 { area / length } else { 0.0 };
            let most = plant.chain(id).parent.map_or(f32::MAX, |parent| thick[parent.index()]);
            thick.push(mean.min(most));
        }
        let mut order: Vec<ChainId> = plant.chain_ids().filter(|id| shown[id.index()]).collect();
        order.sort_by(|a, b| thick[b.index()].total_cmp(&thick[a.index()]));
        Self { plant, posed, order, below: f32::MIN, lowest: Vec::new() }
    }

    /// With stems that go on below their feet as far as they do in this mesh of the wood.
    pub(super) fn sunk(mut self, wood: &Mesh) -> Self {
        self.lowest = vec![f32::MAX; self.plant.chains().len()];
        for (chain, place) in wood.chains.iter().zip(&wood.positions) {
            if let Some(low) = self.lowest.get_mut(*chain as usize) {
                *low = low.min(place.y);
            }
        }
        self
    }

    /// Of a tree that is all wood, down to where lines would cover too much more than limbs do, with texels of so many metres.
    pub(super) fn thick(mut self, texel: f32) -> Self {
        let all = self.order.iter().flat_map(|&id| {
            let pieces = self.posed.chain(self.plant, id).windows(2).zip(self.plant.radii(id).windows(2));
            pieces.map(|(p, r)| (r[1], p[0].distance(p[1])))
        });
        let mut all: Vec<(f32, f32)> = all.collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut room = WIDENED * all.iter().map(|(radius, length)| radius * length).sum::<f32>();
        let is_too_much = |(radius, length): &(f32, f32)| {
            room -= (LEAST * texel - radius).max(0.0) * length;
            room < 0.0
        };
        self.below = all.into_iter().find(is_too_much).map_or(f32::MIN, |(radius, _)| radius);
        self
    }

    /// As many of those that are seen in some frames as cover what wood is seen there, about; the first of them at least.
    pub(super) fn enough(mut self, layout: &Impostor, texels: u32, frames: &[((u32, u32), &Seen)]) -> Self {
        let wanted = frames.iter().map(|(_, seen)| seen.in_the_clear()).sum::<f32>();
        let mut lines: Vec<Lines> = frames.iter().map(|(frame, _)| Lines::new(layout, *frame, texels)).collect();
        let thinnest = THINNEST / lines.first().map_or(f32::MAX, |lines| lines.scale.min_element());
        let (mut covered, mut seen) = (0.0, Vec::new());
        for &limb in self.order.iter().filter(|limb| self.plant.radii(**limb).first().is_some_and(|r| *r >= thinnest)) {
            let one = |(lines, (_, seen)): (&mut Lines, &(_, &Seen))| self.stroke(limb, lines, &seen.clear);
            let added = lines.iter_mut().zip(frames).map(one).sum::<usize>() as f32;
            let before = covered;
            covered += added;
            if !seen.is_empty() && covered - wanted > wanted - before {
                break;
            }
            if added > 0.0 {
                seen.push(limb);
            }
        }
        self.order = seen;
        self
    }

    /// All of them in a frame.
    pub(super) fn lines(&self, layout: &Impostor, frame: (u32, u32), texels: u32) -> Lines {
        let mut lines = Lines::new(layout, frame, texels);
        for &limb in &self.order {
            self.stroke(limb, &mut lines, &[]);
        }
        lines
    }

    /// Adds a limb; tells how many of the texels that are `asked` for became solid.
    fn stroke(&self, limb: ChainId, lines: &mut Lines, asked: &[bool]) -> usize {
        let (points, radii) = (self.posed.chain(self.plant, limb), self.plant.radii(limb));
        let is_stem = self.plant.chain(limb).parent.is_none();
        let mut solid = 0;
        // Straight down, as its skin does.
        let low = self.lowest.get(limb.index()).filter(|low| is_stem && **low < points[0].y);
        let mut from = low.map(|low| (lines.seen(points[0].with_y(*low)), radii[0]));
        let mut is_first = true;
        for (i, (point, radius)) in points.iter().zip(radii).enumerate() {
            if *radius <= self.below {
                break;
            }
            let to = (lines.seen(*point), *radius);
            let Some(start) = from else {
                from = Some(to);
                continue;
            };
            if i + 1 < points.len() && start.0.truncate().distance(to.0.truncate()) < PIECE {
                continue;
            }
            solid += lines.piece((start, to), is_stem && is_first, asked);
            (from, is_first) = (Some(to), false);
        }
        solid
    }
}

impl Lines {
    fn new(layout: &Impostor, frame: (u32, u32), texels: u32) -> Self {
        let count = (texels * texels) as usize;
        let scale = 0.5 * texels as f32 / layout.extent(frame);
        let (alpha, depth) = (vec![0.0; count], vec![0.0; count]);
        let middle = 0.5 * texels as f32 - 0.5;
        Self { axes: layout.axes(frame), centre: layout.centre, scale, middle, texels: texels as usize, alpha, depth }
    }

    /// Column and row of a point, counted between middles of texels, and metres before the plane.
    fn seen(&self, point: Vec3) -> Vec3 {
        let at = self.axes.to_local(point - self.centre);
        Vec3::new(self.middle + at.x * self.scale.x, self.middle - at.y * self.scale.y, at.z)
    }

    /// Half the width of a piece with these ends, texels, for each metre of radius: texels are no squares.
    fn widths(&self, way: Vec2) -> f32 {
        let metres = (way / self.scale).length();
        let texels = way.length();
        let area = self.scale.x * self.scale.y;
        if texels > 1e-3 { area * metres / texels } else { area.sqrt() }
    }

    /// Adds a piece between two points as they are seen, with their radii; the first end `stands` on the ground, others are
    /// round.
    fn piece(&mut self, ((from, r), (to, s)): ((Vec3, f32), (Vec3, f32)), stands: bool, asked: &[bool]) -> usize {
        let (start, way) = (from.truncate(), to.truncate() - from.truncate());
        let per_metre = self.widths(way);
        let reach = (r.max(s) * self.scale.max_element()).max(LEAST) + 0.5 / SLOPE;
        if !(start.is_finite() && way.is_finite() && reach.is_finite()) {
            return 0;
        }
        let end = start + way;
        let last = self.texels as f32 - 1.0;
        let low = (start.min(end) - reach).ceil().max(Vec2::ZERO);
        let high = (start.max(end) + reach).floor().min(Vec2::splat(last));
        if !low.cmple(high).all() {
            return 0;
        }
        let length = way.length();
        let mut solid = 0;
        for row in low.y as usize..=high.y as usize {
            for column in low.x as usize..=high.x as usize {
                let off = Vec2::new(column as f32, row as f32) - start;
                let along = off.dot(way) / (length * length).max(1e-6);
                let t = along.clamp(0.0, 1.0);
                let off = off - way * t;
                let away = off.length();
                // Ends are round in metres.
                let per_metre = if along == t { per_metre } else { away / (off / self.scale).length() };
                let rim = ((r + (s - r) * t) * per_metre).max(LEAST) - away;
                let rim = if stands && along < 0.0 { rim.min(along * length) } else { rim };
                let alpha = (0.5 + SLOPE * rim).clamp(0.0, 1.0);
                let i = row * self.texels + column;
                let before = self.alpha[i];
                if alpha > before {
                    let is_new = before < 0.5 && alpha >= 0.5 && asked.get(i) == Some(&true);
                    solid += usize::from(is_new);
                    self.alpha[i] = alpha;
                    self.depth[i] = from.z + (to.z - from.z) * t;
                }
            }
        }
        solid
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math;
    use crate::mesh::{TubeDetail, tubes};
    use crate::plant::PlantBuilder;
    use crate::preset::plan::MeshParams;

    const LAYOUT: Impostor = Impostor { frames: 8, centre: Vec3::Y, radius: 4.0, reach: 3.0, height: 1.5 };
    const TEXELS: u32 = 48;

    fn solid(lines: &Lines) -> usize {
        lines.alpha.iter().filter(|alpha| **alpha >= 0.5).count()
    }

    #[test]
    fn a_thin_line_has_no_gap_whatever_its_slope() {
        for way in [Vec3::new(2.0, 0.1, 0.0), Vec3::new(1.7, 1.1, 0.6), Vec3::new(0.1, 1.3, -0.2)] {
            let mut builder = PlantBuilder::new();
            builder.stem(Vec3::ZERO, &[Vec3::ZERO, way * 0.4, way], &[0.004, 0.003, 0.001]);
            let plant = builder.finish().unwrap();
            let posed = plant.pose();
            for frame in [(0, 0), (3, 0), (2, 3), (6, 5)] {
                let lines = Limbs::of(&plant, &posed, &plant.thick(0.0)).lines(&LAYOUT, frame, TEXELS);
                for part in 4..50 {
                    let at = lines.seen(way * (part as f32 / 50.0));
                    let (x, y) = (at.x as usize, at.y as usize);
                    let row = |y: usize| {
                        let of = |x: usize| lines.alpha[y * TEXELS as usize + x];
                        of(x) + (of(x + 1) - of(x)) * at.x.fract()
                    };
                    let alpha = row(y) + (row(y + 1) - row(y)) * at.y.fract();
                    assert!(alpha > 0.47, "{way} {frame:?} {part}: {alpha}");
                }
            }
        }
    }

    #[test]
    fn a_stout_limb_covers_what_it_does_in_texels_of_any_shape() {
        // Twice as wide as high, texels are; limbs lie level, stand and lean.
        let across = LAYOUT.axes((7, 0)).x;
        for way in [across * 2.0, Vec3::Y * 2.0, across * 1.4 + Vec3::Y * 1.4] {
            let mut builder = PlantBuilder::new();
            builder.stem(-way * 0.5 + Vec3::Y, &[Vec3::ZERO, way], &[0.3, 0.3]);
            let plant = builder.finish().unwrap();
            let posed = plant.pose();
            let lines = Limbs::of(&plant, &posed, &plant.thick(0.0)).lines(&LAYOUT, (7, 0), TEXELS);
            let along = lines.axes.to_local(way).truncate().length();
            let texel = 1.0 / (lines.scale.x * lines.scale.y);
            // One end stands and is cut off, the other is half a disc.
            let wanted = 0.6 * along + 0.5 * std::f32::consts::PI * 0.09;
            let covered = solid(&lines) as f32 * texel;
            assert!((covered / wanted - 1.0).abs() < 0.16, "{way}: {covered} for {wanted}");
        }
    }

    /// A trunk and `count` limbs from its middle.
    fn forked(count: u32, radius: f32) -> Plant {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], &[0.05, 0.04, 0.04]);
        for i in 0..count {
            let turn = std::f32::consts::TAU * i as f32 / count as f32;
            let (sin, cos) = math::sin_cos(turn);
            let way = Vec3::new(cos, 1.0, sin);
            builder.branch(stem, 0.5, &[Vec3::ZERO, way], &[radius, radius * 0.9]);
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_stem_that_goes_on_below_the_ground_is_drawn_as_far_down() {
        let plant = forked(0, 0.01);
        let posed = plant.pose();
        let down = |below: f32| {
            let detail = TubeDetail { below, ..TubeDetail::full(&MeshParams::told(8, 0.004)) };
            let limbs = Limbs::of(&plant, &posed, &plant.thick(0.0)).sunk(&tubes(&plant, &posed, &detail));
            let lines = limbs.lines(&LAYOUT, (7, 0), TEXELS);
            (0..TEXELS as usize)
                .rev()
                .find(|y| (0..TEXELS as usize).any(|x| lines.alpha[y * TEXELS as usize + x] >= 0.5))
        };
        // A texel is 3 / 48 m high, and half a metre of the frame lies below the ground.
        let rows = down(0.4).unwrap() - down(0.0).unwrap();
        assert!((6..=7).contains(&rows), "{rows}");
    }

    #[test]
    fn as_many_limbs_are_drawn_as_cover_what_all_do_and_bearers_come_first() {
        let plant = forked(12, 0.012);
        let posed = plant.pose();
        let all = Limbs::of(&plant, &posed, &plant.thick(0.0));
        assert_eq!((all.order.len(), all.order[0]), (13, ChainId(0)));
        assert_eq!(Limbs::of(&plant, &posed, &plant.thick(0.02)).order, [ChainId(0)]);
        let frames: Vec<(u32, u32)> = vec![(0, 0), (3, 0), (7, 4)];
        let count = |share: f32| {
            let seen: Vec<Seen> = frames
                .iter()
                .map(|&frame| {
                    let lines = all.lines(&LAYOUT, frame, TEXELS);
                    let wood = lines.alpha.iter().map(|alpha| if *alpha >= 0.5 { share } else { 0.0 }).collect();
                    Seen::new(wood, &[0.0; (TEXELS * TEXELS) as usize], TEXELS as usize)
                })
                .collect();
            let asked: Vec<((u32, u32), &Seen)> = frames.iter().copied().zip(&seen).collect();
            Limbs::of(&plant, &posed, &plant.thick(0.0)).enough(&LAYOUT, TEXELS, &asked).order.len()
        };
        let counts = [0.0, 0.4, 0.7, 1.0].map(count);
        assert!(counts == [0, 1, counts[2], 13] && (3..9).contains(&counts[2]), "{counts:?}");
    }

    #[test]
    fn twigs_of_a_bare_tree_are_left_out_and_limbs_are_not() {
        let texel = 0.1;
        let (twigs, limbs) = (forked(300, 0.004), forked(3, 0.09));
        let below = |plant: &Plant| Limbs::of(plant, &plant.pose(), &plant.thick(0.0)).thick(texel).below;
        assert!(below(&limbs) < 0.0 && (0.003..0.01).contains(&below(&twigs)), "{} {}", below(&limbs), below(&twigs));
        let posed = twigs.pose();
        let (all, thick) =
            (Limbs::of(&twigs, &posed, &twigs.thick(0.0)), Limbs::of(&twigs, &posed, &twigs.thick(0.0)).thick(texel));
        let count = |limbs: &Limbs<'_>| solid(&limbs.lines(&LAYOUT, (0, 0), TEXELS));
        assert!(count(&thick) > 0 && count(&thick) * 2 < count(&all));
    }

    #[test]
    fn wood_is_seen_where_it_covers_more_than_leaves_around() {
        let at = |f: fn(usize, usize) -> f32| (0..100).map(|i| f(i % 10, i / 10)).collect::<Vec<f32>>();
        let wood = at(|x, y| {
            if x == 5 {
                0.4
            } else if (x, y) == (1, 1) {
                0.9
            } else {
                0.0
            }
        });
        let leaves = at(|_, y| if y < 5 { 0.5 } else { 0.0 });
        let seen = Seen::new(wood, &leaves, 10);
        let clear = |x: usize, y: usize| seen.clear[y * 10 + x];
        assert!(clear(5, 9) && clear(7, 8) && !clear(8, 8) && !clear(5, 2) && !clear(1, 1));
        let near = |x: usize, y: usize| seen.near[y * 10 + x];
        let first = (0..10).find(|y| clear(5, *y)).unwrap();
        assert!(near(5, first - INTO_CROWN) && !near(5, first - INTO_CROWN - 1) && near(9, 9) && !near(1, 1));
        assert!((seen.in_the_clear() - 0.4 * (0..10).filter(|y| clear(5, *y)).count() as f32).abs() < 1e-5);
    }
}
