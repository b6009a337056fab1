//! The contact sheet of a set: trees are drawn once for all tints, each level by itself, and painted.

use std::sync::{Arc, OnceLock};

use glam::Vec2;
use rayon::prelude::*;

use super::assets::{Colors, kind, names};
use super::cache::{Cache, Stage};
use super::stages::Pictures;
use super::trees::{self, Tree};
use crate::bake::{Maps, Picture, SheetCell, SheetColors, SheetColumn, SheetLayout, SheetRow, SheetScale};
use crate::base::{Diagnostic, Key, once};
use crate::export::{self, PngKind};
use crate::lod::{Facing, Ladder, Level, Tile};
use crate::mesh::TreeMesh;
use crate::preset::Plan;
use crate::preset::plan::Lod;

/// The stages with their versions; kept in memory only.
const SHEET: Stage = Stage("sheet", 14);
const SHOWN: Stage = Stage("shown", 13);

/// All trees of a set at all levels, before they have colours.
pub(super) struct Sheet {
    layout: SheetLayout,
    cells: Vec<Arc<SheetCell>>,
}

impl Sheet {
    /// Draws what is not remembered.
    pub(super) fn drawn(
        plan: &Plan,
        pictures: &Pictures,
        trees: &[Tree],
        cache: &Cache,
    ) -> Result<Self, Vec<Diagnostic>> {
        let rows: Vec<SheetRow<'_>> = (trees.iter().zip(names(plan)))
            .map(|(tree, label)| {
                let levels = &tree.ladder.levels;
                let above = std::iter::once(None).chain(levels.iter().map(|level| Some(level.screen_coverage)));
                let columns = (levels.iter().zip(above).enumerate())
                    .map(|(i, (level, above))| SheetColumn {
                        label: format!("LOD{i} {} {} tris", kind(&level.kind), level.triangles),
                        shown: above
                            .map_or_else(String::new, |size| format!("below {:.1} % of the screen", size * 100.0)),
                        mesh: &level.mesh,
                    })
                    .collect();
                SheetRow { label, columns }
            })
            .collect();
        let layout = SheetLayout::new(&rows);
        let shapes = pictures.shapes();
        let key = |&(row, column): &(usize, usize)| {
            let tree = &trees[row];
            let of = SHOWN.key().input(tree.key).number(column as u64).finish();
            let shown = cache.remember_here(of, |_| size_of::<Key>(), || Ok(shown(tree, column)))?;
            let key = SHEET.key().input(shapes).input(*shown).number(column as u64).params(&layout.scale(row)).finish();
            Ok(key)
        };
        let keys = layout.cells().par_iter().map(key).collect::<Result<Vec<Key>, Vec<Diagnostic>>>()?;
        // Pictures are wanted of those trees only that are drawn.
        let stock = OnceLock::new();
        let stock = || once(&stock, || trees::stock(plan, pictures, cache)).wardrobe();
        let worn: Vec<OnceLock<Vec<Picture>>> = rows.iter().map(|_| OnceLock::new()).collect();
        let shared = pictures.leaves.len();
        let dressed = |row: usize| -> Vec<Picture> {
            let ladder = &trees[row].ladder;
            let shown = |(i, tile): (usize, &Tile)| {
                let maps = tile.uncolored();
                Picture::new(&match facing(ladder, shared, i) {
                    Some(facing) => facing.maps(&maps),
                    None => maps,
                })
            };
            let own = ladder.tiles.par_iter().enumerate().map(shown);
            stock().leaves.par_iter().cloned().chain(own).collect()
        };
        let draw = |(&(row, column), key): (&(usize, usize), &Key)| {
            cache.remember_here(*key, SheetCell::weight, || {
                let worn = once(&worn[row], || dressed(row));
                let turned = turned(&trees[row].ladder, shared, column);
                let mesh = turned.as_ref().unwrap_or(rows[row].columns[column].mesh);
                Ok(layout.scale(row).draw(column, mesh, &stock().bark[0], worn))
            })
        };
        let cells = layout.cells().par_iter().zip(&keys).map(draw).collect::<Result<Vec<_>, Vec<Diagnostic>>>()?;
        Ok(Self { layout, cells })
    }

    /// In the colours of its pictures, those of the trees' own by row: a PNG.
    pub(super) fn painted(&self, pictures: &Pictures, colors: &[Arc<Colors>]) -> Result<Vec<u8>, Vec<Diagnostic>> {
        let of_maps = |maps: &Maps| SheetColors::of((maps.width, maps.height), &maps.color);
        let (leaves, bark): (Vec<SheetColors>, _) =
            rayon::join(|| pictures.leaves.par_iter().map(of_maps).collect(), || of_maps(&pictures.bark));
        let worn = |row: usize| leaves.iter().chain(&colors[row].sheet).collect();
        let sheet = self.layout.paint(&self.cells, &bark, &worn);
        export::encode_quickly(&sheet.pixels, sheet.width, sheet.height, PngKind::Rgb)
            .map_err(|e| vec![Diagnostic::new("", e.to_string())])
    }
}

/// Where the sheet is looked at from, a tree's own picture is that of an impostor as its shader shows it; none of others.
/// `shared` pictures come before its own.
pub(super) fn facing(ladder: &Ladder, shared: usize, picture: usize) -> Option<Facing> {
    let wears = |level: &&Level| level.mesh.leaf.tiles.first().is_some_and(|tile| *tile as usize == shared + picture);
    let layout = ladder.levels.iter().find(wears)?.impostor?;
    let tile = ladder.tiles.get(picture)?;
    layout.facing(SheetScale::viewer(), (tile.width, tile.height), &tile.orm, (Vec2::ZERO, Vec2::ONE))
}

/// The rectangle that such a level is there.
fn turned(ladder: &Ladder, shared: usize, column: usize) -> Option<TreeMesh> {
    let level = ladder.levels.get(column).filter(|level| level.impostor.is_some())?;
    let tile = *level.mesh.leaf.tiles.first()?;
    let mut leaf = facing(ladder, shared, (tile as usize).checked_sub(shared)?)?.quad();
    leaf.tiles.fill(tile);
    Some(TreeMesh { leaf, ..TreeMesh::default() })
}

/// The key of what a level shows: another budget of one level leaves the drawings of the others as they are.
fn shown(tree: &Tree, column: usize) -> Key {
    let level = &tree.ladder.levels[column];
    let mut key = SHOWN.key().input(tree.of).params(&level.kind);
    if level.kind == Lod::Full {
        return key.finish();
    }
    for mesh in [&level.mesh.bark, &level.mesh.leaf] {
        let positions: Vec<u8> = mesh.positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
        key = key.number(mesh.indices.len() as u64).input(Key::of_bytes(&positions));
    }
    if !matches!(level.kind, Lod::Thinned { .. }) {
        // It wears pictures of its own, and those change each other's alpha.
        for tile in &tree.ladder.tiles {
            let relief = [tile.normal.as_flattened(), tile.orm.as_flattened()].map(Key::of_bytes);
            key = relief.into_iter().fold(key.input(Key::of_bytes(&tile.alpha)), |key, part| key.input(part));
        }
    }
    key.finish()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::{Rotation, Seed};
    use crate::lod::{Stock, Texels, ladder_with};
    use crate::plant::{Leaf, PlantBuilder};
    use crate::preset::plan::{Forks, LodBudget, MeshParams};

    #[test]
    fn an_impostor_is_shown_as_its_shader_shows_it_and_cards_as_they_are() {
        let mut builder = PlantBuilder::new();
        let stem = builder.stem(Vec3::ZERO, &[Vec3::ZERO, Vec3::Y * 4.0], &[0.2, 0.1]);
        for i in 0..200 {
            let seed = Seed::new(2).at(i);
            let orientation = Rotation::about(seed.direction(), 1.0);
            builder.leaf(Leaf::new(stem, seed.at(1).range(0.4, 1.0), orientation, 0.8, 0));
        }
        let mesh = MeshParams { forks: Forks::Plain, ..MeshParams::told(6, 0.01) };
        let green = |alpha: u8| Maps {
            width: 8,
            height: 8,
            color: vec![[60, 110, 30, alpha]; 64],
            normal: vec![[128, 128, 255]; 64],
            orm: vec![[255, 200, 0]; 64],
        };
        let stock = Stock::new(&[green(255)], &green(255));
        let lods = [Lod::Full, Lod::BillboardCloud { cards: 4 }, Lod::Impostor { frames: 4 }].map(LodBudget::from);
        let ladder = ladder_with(&builder.finish().unwrap(), &mesh, &lods, &stock, Texels::all(32), Seed::new(5));
        let sheet = ladder.tiles.len() - 1;
        let (width, height) = (ladder.tiles[sheet].width / 4, ladder.tiles[sheet].height / 4);
        assert_eq!(facing(&ladder, 1, sheet).map(|f| f.size()), Some((width * 2, height * 2)));
        assert!((0..sheet).all(|card| facing(&ladder, 1, card).is_none()));
        assert!((0..2).all(|level| turned(&ladder, 1, level).is_none()));
        let quad = turned(&ladder, 1, 2).unwrap();
        assert_eq!((quad.leaf.indices.len(), quad.bark.indices.len()), (6, 0));
        assert!(quad.leaf.tiles.iter().all(|tile| *tile as usize == 1 + sheet));
        assert!(quad.leaf.normals.iter().all(|n| n.distance(SheetScale::viewer().z) < 1e-6));
    }
}
