//! Hand-made defects with exact answers, real files, and mutations of both.

use std::path::PathBuf;

use super::piece::Piece;
use super::*;
use crate::base::Seed;
use crate::plant::{ChainId, PlantStats};
use crate::preset::plan::{ImportHeight, UpAxis};

const HEADER: &str = "id,parent,start_x,start_y,start_z,axis_x,axis_y,axis_z,length,radius\n";

fn params() -> ImportParams {
    ImportParams { file: String::new(), ..ImportParams::default() }
}

fn read(text: &str) -> Imported {
    match import(text.as_bytes(), "t", &params()) {
        Ok(imported) => imported,
        Err(errors) => panic!("{errors:?}"),
    }
}

fn rows(rows: &str) -> Imported {
    read(&format!("{HEADER}{rows}"))
}

fn errors(text: &str) -> Vec<Diagnostic> {
    import(text.as_bytes(), "t", &params()).unwrap_err()
}

/// (line, column, field, message) of the first error.
fn first_error(text: &str) -> (u32, u32, String, String) {
    let error = errors(text).swap_remove(0);
    let span = error.span.unwrap();
    (span.line, span.column, error.field, error.message)
}

fn noted(imported: &Imported, part: &str) -> bool {
    imported.notes.iter().any(|n| n.contains(part))
}

fn tips(imported: &Imported) -> Vec<[i32; 3]> {
    let posed = imported.plant.pose();
    let ids = imported.plant.chain_ids();
    ids.map(|id| {
        let tip = posed.chain(&imported.plant, id).last().copied().unwrap_or_default() * 100.0;
        [tip.x.round() as i32, tip.y.round() as i32, tip.z.round() as i32]
    })
    .collect()
}

#[test]
fn a_trunk_of_two_cylinders_far_away_and_z_up_stands_at_the_origin() {
    let tree = rows("1,0,500000.25,4e6,-11,0,0,1,2,0.1\n2,1,500000.25,4000000,-9,0,0,1,2,0.1\n");
    assert_eq!(tree.format, Format::TreeQsmCsv);
    assert_eq!(tree.plant.chains().len(), 1);
    assert_eq!(tips(&tree), [[0, 400, 0]]);
    assert_eq!(tree.plant.chain(ChainId(0)).origin, glam::Vec3::ZERO);
    assert!(tree.notes.is_empty(), "{:?}", tree.notes);
}

#[test]
fn z_up_becomes_y_up_without_mirroring() {
    // x stays, z becomes y, y becomes -z.
    let tree = rows("1,0,0,0,0,0,0,1,4,0.1\n2,1,0,0,2,1,0,0,1,0.02\n3,1,0,0,3,0,1,0,1,0.02\n");
    assert_eq!(tips(&tree), [[0, 400, 0], [100, 200, 0], [0, 300, -100]]);
}

#[test]
fn a_start_on_the_parents_surface_keeps_its_place_and_hangs_on_the_axis() {
    let tree = rows("1,0,0,0,0,0,0,1,4,0.2\n2,1,0.2,0,2,1,0,0,1,0.02\n");
    let posed = tree.plant.pose();
    let branch = posed.chain(&tree.plant, ChainId(1));
    assert!(branch[0].x.abs() < 1e-5, "{branch:?}");
    assert!(branch.iter().any(|p| p.distance(glam::Vec3::new(0.2, 2.0, 0.0)) < 1e-5), "{branch:?}");
    assert!(!noted(&tree, "gap"));
    assert_eq!(PlantStats::of(&tree.plant).topology_continuity, 1.0);
}

#[test]
fn a_gap_is_bridged_and_reported_with_its_size() {
    let tree = rows("1,0,0,0,0,0,0,1,4,0.2\n2,1,0.5,0,2,1,0,0,1,0.05\n");
    assert!(noted(&tree, "1 gap between a branch and its parent bridged, the largest 0.300 m"), "{:?}", tree.notes);
    assert_eq!(PlantStats::of(&tree.plant).topology_continuity, 1.0);
}

#[test]
fn a_further_root_in_the_crown_is_bridged_to_the_thick_wood_near_it() {
    let tree = rows("1,0,0,0,0,0,0,1,4,0.2\n2,1,0,0,4,0,0,1,4,0.15\n3,0,0.4,0,6,1,0,0,1,0.05\n");
    assert!(noted(&tree, "1 further root bridged"), "{:?}", tree.notes);
    assert_eq!(tree.plant.chains().len(), 2);
    assert_eq!(tree.plant.chain(ChainId(1)).parent, Some(ChainId(0)));
}

#[test]
fn a_trunk_whose_link_is_lost_low_down_keeps_its_foot() {
    // Two of the links, one below the other, are lost; nearly all of the wood hangs on the last root.
    let tree = rows(
        "1,0,0,0,0,0,0,1,0.4,0.2\n2,0,0,0,0.4,0,0,1,0.4,0.19\n3,0,0.05,0,0.8,0,0,1,4,0.18\n\
         4,3,0.05,0,4.8,0,0,1,4,0.1\n5,3,0.05,0,3,1,0,0,2,0.05\n",
    );
    assert_eq!(tips(&tree), [[5, 880, 0], [205, 300, 0]]);
    let posed = tree.plant.pose();
    assert!(posed.positions()[0].length() < 1e-5 && posed.positions().iter().all(|p| p.y > -1e-5));
}

#[test]
fn a_further_root_on_the_ground_is_a_stem_of_its_own() {
    let tree = rows("1,0,0,0,0,0,0,1,4,0.1\n2,0,1,0,0.1,0,0,1,3,0.1\n");
    assert_eq!(tree.plant.chains().iter().filter(|c| c.parent.is_none()).count(), 2);
    assert!(noted(&tree, "1 stem beside the first"));
    assert_eq!(tips(&tree), [[0, 400, 0], [100, 310, 0]]);
}

#[test]
fn a_parent_metres_away_is_not_believed_when_there_is_wood_at_hand() {
    // The second branch names the tip of the first, as a writer does that takes the row before for the parent.
    let tree = rows(
        "1,0,0,0,0,0,0,1,4,0.1\n2,1,0,0,4,0,0,1,4,0.1\n3,1,0,0,2,1,0,0,3,0.02\n4,3,3,0,2,1,0,0,3,0.02\n\
         5,4,0,0,6,0,1,0,3,0.02\n",
    );
    assert!(noted(&tree, "1 branch far from the row named as parent"), "{:?}", tree.notes);
    assert_eq!(tips(&tree), [[0, 800, 0], [600, 200, 0], [0, 600, -300]]);
    assert!(tree.plant.chains().iter().all(|c| c.order <= 2));
}

#[test]
fn a_parent_far_away_is_believed_when_nothing_else_is_near() {
    let tree = rows("1,0,0,0,0,0,0,1,8,0.1\n2,1,2,0,4,1,0,0,3,0.05\n");
    assert!(!noted(&tree, "named"), "{:?}", tree.notes);
    assert!(noted(&tree, "the largest 1.900 m"), "{:?}", tree.notes);
}

#[test]
fn fragments_that_are_nearest_to_each_other_are_joined_to_the_tree() {
    let tree = rows("1,0,0,0,0,0,0,1,8,0.2\n2,0,1,0,3,1,0,0,2,0.05\n3,0,1,0.1,3,0,1,0,2,0.04\n");
    assert!(noted(&tree, "2 further roots bridged"), "{:?}", tree.notes);
    let orders: Vec<u16> = tree.plant.chains().iter().map(|c| c.order).collect();
    assert_eq!(orders, [1, 2, 3]);
    assert_eq!(PlantStats::of(&tree.plant).topology_continuity, 1.0);
}

#[test]
fn a_scrap_far_away_is_dropped() {
    let tree = rows("1,0,0,0,0,0,0,1,4,0.1\n2,0,9,0,3,0,0,1,0.1,0.1\n");
    assert_eq!(tree.plant.chains().len(), 1);
    assert!(noted(&tree, "1 scrap (1 row) dropped"), "{:?}", tree.notes);
}

#[test]
fn children_may_come_before_parents_and_columns_in_any_order() {
    let text = "radius;parent_ID;endX;endY;endZ;startX;startY;startZ;cyl_ID\r\n\
                0,05;7;1;0;2;0;0;2;3\r\n0,1;0;0;0;4;0;0;0;7\r\n\r\n";
    let tree = read(&format!("\u{feff}{text}"));
    assert_eq!(tree.format, Format::Archi);
    assert_eq!(tips(&tree), [[0, 400, 0], [100, 200, 0]]);
    assert_eq!(tree.plant.radii(ChainId(0))[0], 0.1);
}

#[test]
fn text_with_headers_that_span_columns_is_read_by_rows() {
    let text = "radius (m)\tlength (m)\tstart_point\taxis_direction\tparent\textension\n\
                0.1\t2\t0\t0\t0\t0\t0\t1\t0\t2\n0.1\t2\t0\t0\t2\t0\t0\t1\t1\t0\n";
    let tree = read(text);
    assert_eq!((tree.format, tips(&tree)), (Format::TreeQsmText, vec![[0, 400, 0]]));
}

#[test]
fn units_in_the_header_are_honoured() {
    let text = HEADER.replace("radius", "radius (mm)") + "1,0,0,0,0,0,0,1,4,100\n";
    assert_eq!(read(&text).plant.radii(ChainId(0))[0], 0.1);
}

#[test]
fn swc_is_read_with_and_without_type_and_either_axis_up() {
    for text in ["# a\n1 1 5 5 5 0.1 -1\n2 2 5 9 5 0.1 1\n", "1 5 5 5 0.1 -1\n2\t5 5 9 0.1 1"] {
        let tree = read(text);
        assert_eq!((tree.format, tips(&tree)), (Format::Swc, vec![[0, 400, 0]]));
    }
}

#[test]
fn a_branch_node_on_the_trunk_between_two_of_its_nodes_starts_there() {
    // Node 4 lies on the trunk between 1 and 2, and hangs once on the lower one, once on the upper one.
    for hangs_on in [1, 2] {
        let tree = read(&format!(
            "1 1 0 0 0 .2 -1\n2 1 0 4 0 .2 1\n3 1 0 8 0 .1 2\n4 2 0 3 0 .05 {hangs_on}\n5 2 1 3 0 .02 4"
        ));
        assert_eq!(tips(&tree), [[0, 800, 0], [100, 300, 0]], "{hangs_on}");
        let branch = tree.plant.chain(ChainId(1));
        assert!((branch.location - 3.0 / 8.0).abs() < 1e-6, "{branch:?}");
    }
}

#[test]
fn missing_radii_are_taken_from_neighbours_and_counted() {
    let tree = read("1 1 0 0 0 0.2 -1\n2 1 0 2 0 0 1\n3 1 0 4 0 0.1 2\n4 1 0 5 0 0 3\n");
    let radii = tree.plant.radii(ChainId(0));
    assert!(radii.iter().zip([0.2, 0.15, 0.1, 0.07]).all(|(a, b)| (a - b).abs() < 1e-6), "{radii:?}");
    assert!(noted(&tree, "2 rows without a radius"));
    let none = read("1 1 0 0 0 0 -1\n2 1 0 6 0 0 1\n");
    assert!((none.plant.radii(ChainId(0))[0] - 0.1).abs() < 1e-6);
}

#[test]
fn a_file_that_is_one_ring_of_parents_is_a_tree_or_told_as_a_ring() {
    // Round the ring wood comes back to where it began, so the way up must not be told before it is cut.
    let tree = read("1 1 0 0 0 0.1 3\n2 1 0 2 0 0.1 1\n3 1 0 4 0 0.1 2\n");
    assert!(noted(&tree, "1 ring of rows that are their own ancestors cut, the first in line 1"), "{:?}", tree.notes);
    assert!((tree.plant.height() - 4.0).abs() < 1e-6);
    let found = errors("1 1 0 0 0 0.1 2\n2 1 0 0 0 0.1 1\n");
    assert!(found[0].message.contains("1 ring of rows that are their own ancestors cut"), "{found:?}");
}

#[test]
fn a_tree_of_no_size_is_an_error_unless_its_height_is_told() {
    let text = "1 1 0 0 0 1e-7 -1\n2 1 0 0 1e-6 1e-7 1\n";
    let found = errors(text);
    assert!(found[0].message.contains("1e-6 m high") && found[0].message.contains("`height`"), "{found:?}");
    let told = ImportParams { height: ImportHeight::Metres(3.0), ..params() };
    let tree = import(text.as_bytes(), "t", &told).unwrap();
    assert!((tree.plant.height() - 3.0).abs() < 1e-4);
}

#[test]
fn rings_are_cut_and_counted() {
    let tree =
        rows("1,0,0,0,0,0,0,1,4,0.2\n2,3,0.1,0,2,1,0,0,1,0.05\n3,2,1.1,0,2,1,0,0,1,0.04\n4,4,0.1,0,3,0,1,0,1,0.05\n");
    assert!(noted(&tree, "2 rings of rows that are their own ancestors cut, the first in line 3"), "{:?}", tree.notes);
    assert_eq!(tree.plant.chains().len(), 3);
}

#[test]
fn zero_lengths_are_harmless() {
    let tree = rows("1,0,0,0,0,0,0,1,2,0.1\n2,1,0,0,2,0,0,1,0,0.1\n3,2,0,0,2,0,0,0,5,0.1\n4,3,0,0,2,0,0,1,2,0.1\n");
    assert_eq!(tips(&tree), [[0, 400, 0]]);
    assert!(errors(&format!("{HEADER}1,0,0,0,0,0,0,1,0,0.1\n"))[0].message.contains("above the base"));
}

#[test]
fn height_scales_and_what_is_no_tree_height_is_noted() {
    let text = format!("{HEADER}1,0,0,0,0,0,0,1,4000,100\n");
    assert!(noted(&read(&text), "4000 m high"));
    let scaled = ImportParams { height: ImportHeight::Metres(8.0), ..params() };
    let tree = import(text.as_bytes(), "t", &scaled).unwrap();
    assert!((tree.plant.height() - 8.0).abs() < 1e-6);
    assert!((tree.plant.radii(ChainId(0))[0] - 0.2).abs() < 1e-6);
}

#[test]
fn the_height_of_a_mesh_is_that_of_its_leaves_where_they_rise_above_the_wood() {
    let ring = |y: f32| [(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)].map(|(x, z)| format!("v {x} {y} {z}\n"));
    let wood: String = [0.0, 2.0, 4.0].iter().flat_map(|y| ring(*y)).collect();
    let side = |k: u32, s: u32| format!("f {} {} {} {}\n", k + s, k + s % 4 + 1, k + s % 4 + 5, k + s + 4);
    let sides: String = [0, 4].iter().flat_map(|&k| (1..=4).map(move |s| side(k, s))).collect();
    let leaf = "o leaves\nv -0.5 3.9 0\nv 0.5 3.9 0\nv 0.5 6 0\nv -0.5 6 0\nf 13 14 15 16\n";
    let file = format!("o trunk\n{wood}{sides}{leaf}");
    let scaled = ImportParams { height: ImportHeight::Metres(12.0), ..params() };
    let tree = import(file.as_bytes(), "t.obj", &scaled).unwrap().plant;
    let (posed, leaf) = (tree.pose(), &tree.leaves()[0]);
    let pose = posed.leaf(&tree, leaf);
    let tip = pose.position + pose.frame.y * leaf.size;
    assert!((tip.y - 12.0).abs() < 0.05 && (tree.height() - 8.0).abs() < 0.2, "{tip} {}", tree.height());
}

#[test]
fn parts_that_the_preset_names_are_told_of_files_that_have_none() {
    let named = ImportParams { leaves: vec!["x".into()], wood: vec!["y".into()], ..params() };
    let text = format!("{HEADER}1,0,0,0,0,0,1,4,9,0.1\n");
    let notes = import(text.as_bytes(), "t", &named).unwrap().notes;
    for name in ["x", "y"] {
        let told = format!("no material or part is called \"{name}\": TreeQSM CSV has none");
        assert!(notes.contains(&told), "{notes:?}");
    }
}

#[test]
fn the_axis_given_in_the_preset_wins() {
    let lying = ImportParams { up: UpAxis::Y, ..params() };
    let text = format!("{HEADER}1,0,0,0,0,0,1,4,9,0.1\n");
    let tree = import(text.as_bytes(), "t", &lying).unwrap();
    assert!((tree.plant.height() - 9.0 / 17.0_f32.sqrt()).abs() < 1e-5);
}

#[test]
fn errors_name_line_column_and_field() {
    let bad = |row: &str| first_error(&format!("{HEADER}1,0,0,0,0,0,0,1,4,0.1\n{row}\n"));
    let at = |line, column, field: &str, message: &str| (line, column, field.to_owned(), message.to_owned());
    assert_eq!(bad("2,1,0,oak,0,0,0,1,4,0.1"), at(3, 7, "start_y", "`oak` is not a number"));
    assert_eq!(bad("2,1,0,0,nan,0,0,1,4,0.1"), at(3, 9, "start_z", "`nan` is not a finite number"));
    assert_eq!(bad("2,1,0,0,inf,0,0,1,4,0.1"), at(3, 9, "start_z", "`inf` is not a finite number"));
    assert_eq!(bad("2,1,0,0,1e300,0,0,1,4,0.1"), at(3, 9, "start_z", "`1e300` is out of all bounds"));
    assert_eq!(bad("2,1,0,0,0,0,0,1,4, -0.1"), at(3, 20, "radius", "`-0.1` is negative"));
    assert_eq!(bad("2.5,1,0,0,0,0,0,1,4,0.1"), at(3, 1, "id", "`2.5` is not a whole number"));
    assert_eq!(bad("1,1,0,0,0,0,0,1,4,0.1"), at(3, 1, "id", "the id 1 is there already, in line 2"));
    assert_eq!(bad("2,9,0,0,0,0,0,1,4,0.1"), at(3, 1, "parent", "no row has the id 9"));
    assert_eq!(bad("2,1,0,0,0,0,0,1"), at(3, 1, "", "the row has 8 columns, expected are 10"));
    assert_eq!(bad("2,1,0,0,0,0,0,1,4,0.1,7"), at(3, 1, "", "the row has 11 columns, expected are 10"));
    assert_eq!(bad("2,1,é,0,x,0,0,1,4,0.1").1, 5);
    assert_eq!(first_error("1 1 0 0 0 .1 -1\n2 1 0 a 0 .1 1\n"), at(2, 7, "y", "`a` is not a number"));
    assert_eq!(first_error("id,parent,start_x\n1,2,3\n").2, "radius");
    assert_eq!(first_error(&format!("radius,{HEADER}")).3, "the column `radius` is there twice");
}

#[test]
fn all_errors_are_reported_up_to_twenty() {
    let rows: String = (0..50).map(|i| format!("{i},0,x,0,0,0,0,1,4,0.1\n")).collect();
    let list = errors(&format!("{HEADER}{rows}"));
    assert_eq!(list.len(), 21);
    assert_eq!(list[20].message, "and 30 more errors");
}

#[test]
fn a_few_lost_parents_are_bridged() {
    let trunk: String = (0..40).map(|i| format!("{},{i},0,0,{i},0,0,1,1,0.2\n", i + 1)).collect();
    let tree = rows(&format!("{trunk}41,99,0.1,0,20,1,0,0,3,0.05\n"));
    assert!(noted(&tree, "1 row with a parent that doesn't exist, the first in line 42"), "{:?}", tree.notes);
    assert_eq!(tree.plant.chains().len(), 2);
}

#[test]
fn what_is_not_read_is_refused_by_one_error_that_says_what_is() {
    for (bytes, part) in [
        (&b""[..], "empty"),
        (b"\n\n# only\n", "empty"),
        (b"MATLAB 5.0 MAT-file, \x00", "MATLAB"),
        (b"\x89HDF\r\n\x1a\nxx", "MATLAB"),
        (b"id,parent\x00", "binary"),
        (b"\xff\xfe\x01\x02", "UTF-16"),
        (b"CODE:\tFORM-A\n", "no entity"),
        (b"hello world", "neither"),
        (b",,,,", "neither"),
        (b"1,2,3,4,5,6,7,8", "8 numbers and no header"),
        (HEADER.as_bytes(), "no rows"),
    ] {
        let list = import(bytes, "t", &params()).unwrap_err();
        assert_eq!(list.len(), 1, "{list:?}");
        assert!(list[0].message.contains(part) && !list[0].hint.is_empty(), "{list:?}");
    }
}

#[test]
fn messages_stay_short_when_lines_do_not() {
    let long = "z".repeat(1 << 20);
    for text in [long.clone(), format!("{long},a,b,c"), format!("{HEADER}1,0,{long},0,0,0,0,1,4,0.1")] {
        assert!(errors(&text).iter().all(|e| e.to_string().chars().count() < 400));
    }
    errors(&",".repeat(1 << 20));
    errors(&format!("{HEADER}{}", ",".repeat(1 << 20)));
    errors(&format!("{HEADER}{}", "1,".repeat(1 << 19)));
}

#[test]
fn hostile_structures_end_soon() {
    // All roots at one place; a chain as long as the file; every row the child of the first; one great ring.
    let many = 20_000;
    let each = |parent: &dyn Fn(usize) -> usize, z: &dyn Fn(usize) -> f64| {
        let rows: String = (1..=many).map(|i| format!("{i},{},0,0,{},0,0,1,1,1000000\n", parent(i), z(i))).collect();
        import(format!("{HEADER}{rows}").as_bytes(), "t", &params())
    };
    assert!(each(&|_| 0, &|_| 0.0).is_ok());
    assert!(each(&|i| i - 1, &|i| i as f64).is_ok());
    assert!(each(&|i| usize::from(i > 1), &|_| 0.0).is_ok());
    assert!(each(&|i| i % many + 1, &|i| i as f64 * 0.1).is_ok());
}

/// Small valid files of every kind, for the mutations.
fn seeds() -> Vec<String> {
    let mut csv = HEADER.replace("radius", "radius,branch,branch_order");
    let mut swc = String::from("# tree\n1 1 100.5 200.25 -3 0.2 -1\n");
    let mut text = String::from("radius (m)\tlength (m)\tstart_point\taxis_direction\tparent\n");
    for i in 1..=12_i32 {
        let (parent, branch) = if i <= 6 { (i - 1, 0) } else { (i - 5, 1) };
        let x = branch * (i - 6);
        let z = if branch == 0 { i - 1 } else { 4 };
        csv += &format!("{i},{parent},{x}.1,5,{z},{branch}.0,0,1,1.0,0.{},{branch},{branch}\n", 13 - i.min(9));
        swc += &format!("{} 1 {x}.5 200.25 {z} 0.1 {}\n", i + 1, parent.max(1));
        text += &format!("0.1\t1.0\t{x}\t0\t{z}\t0\t0\t1\t{parent}\n");
    }
    vec![csv, swc, text]
}

#[test]
fn mutated_files_never_panic_and_give_a_sound_plant_or_errors() {
    let seed = Seed::new(20_17);
    let (mut sound, mut refused) = (0, 0);
    for (s, text) in seeds().iter().enumerate() {
        let whole = import(text.as_bytes(), "t", &params());
        assert!(whole.is_ok(), "{whole:?}");
        for k in 0..1_500_u64 {
            let mut draws = seed.child("mutation").at(s as u64 * 10_000 + k).draws();
            let mut bytes = text.clone().into_bytes();
            for _ in 0..=draws.draw().index(3) {
                let at = draws.draw().index(bytes.len());
                let other = draws.draw().index(bytes.len());
                match draws.draw().index(7) {
                    0 => bytes[at] = draws.draw().index(256) as u8,
                    1 => bytes[at] = b"0123456789-.,;\t\n e"[draws.draw().index(18)],
                    2 => bytes.truncate(at + 1),
                    3 => drop(bytes.drain(at.min(other)..at.max(other))),
                    4 => bytes.swap(at, other),
                    5 => bytes.insert(at, b"9\n,-e"[draws.draw().index(5)]),
                    _ => {
                        let part = bytes[at.min(other)..at.max(other)].to_vec();
                        bytes.splice(at..at, part);
                    }
                }
                if bytes.is_empty() {
                    bytes.push(b'1');
                }
            }
            match import(&bytes, "t", &params()) {
                Ok(tree) => {
                    sound += 1;
                    let stats = PlantStats::of(&tree.plant);
                    assert!(stats.height > 0.0 && stats.topology_continuity == 1.0, "{stats:?}");
                }
                Err(list) => {
                    refused += 1;
                    assert!(!list.is_empty() && list.len() <= 21);
                }
            }
        }
    }
    assert!(sound > 300 && refused > 300, "{sound} {refused}");
}

#[test]
fn more_rows_than_the_limit_are_refused_whole() {
    let list = errors(&format!("{HEADER}{}", "1\n".repeat(MOST_ROWS + 1)));
    assert_eq!(list[0].message, "the file has more than 10000000 rows");
    assert_eq!(list.len(), 1);
}

/// The folder of real models, or none where the checkout has none; on CI it must be there.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
fn real_models() -> Option<PathBuf> {
    let data = std::env::var_os("TREEWRIGHT_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let folder = data.join("skeleton");
    assert!(folder.is_dir() || std::env::var_os("CI").is_none(), "no data at {}", folder.display());
    if !folder.is_dir() {
        eprintln!("skipped: no data at {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn real_models_are_upright_connected_and_as_high_as_measured() {
    let Some(folder) = real_models() else {
        return;
    };
    // Name, format, height in metres.
    let models = [
        ("itsme_buttressed_1.csv", Format::TreeQsmCsv, 23.6),
        ("itsme_tree_1.csv", Format::TreeQsmCsv, 20.9),
        ("itsme_tree_2.csv", Format::TreeQsmCsv, 16.9),
        ("rtwig_small.csv", Format::TreeQsmCsv, 3.7),
        ("rtwig_small_archi.csv", Format::Archi, 3.6),
        ("rtwig_small_simpleforest.csv", Format::SimpleForest, 3.7),
        ("pyhelios_olive_900_qsm.txt", Format::TreeQsmText, 1.7),
        ("pyhelios_walnut_365_qsm.txt", Format::TreeQsmText, 1.9),
        ("eztree_aspen_small.swc", Format::Swc, 34.6),
        ("eztree_oak_medium.swc", Format::Swc, 61.0),
        ("eztree_pine_medium.swc", Format::Swc, 49.8),
        ("mtg_apple_agraf.swc", Format::Swc, 2.8),
        ("plantgeom_coffee.swc", Format::Swc, 1.6),
    ];
    for (name, format, height) in models {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        let tree = import(&bytes, name, &params()).unwrap();
        let stats = PlantStats::of(&tree.plant);
        assert_eq!(tree.format, format, "{name}");
        assert!((stats.height - height).abs() < 0.06, "{name}: {}", stats.height);
        assert_eq!((stats.stems, stats.topology_continuity), (1, 1.0), "{name}");
        // The trunk goes most of the way: no fork takes its name early.
        assert!(stats.orders[0].length.max > 0.7 * stats.height, "{name}: {:?}", stats.orders[0]);
    }
}

/// The pieces of a real file, as read.
fn pieces_of(folder: &std::path::Path, name: &str, files: &Files<'_>) -> piece::Read {
    let bytes = std::fs::read(folder.join(name)).unwrap();
    let mut notes = Vec::new();
    if mat::is_mat(&bytes) {
        return mat::read(&bytes, name, &mut notes).unwrap();
    }
    if mtg::is_mtg(&bytes) {
        return mtg::read(&bytes, files.values().next().copied(), name, &mut notes).unwrap();
    }
    let table::Sniffed { table, format } = table::sniff(&bytes, name).unwrap();
    match format {
        table::Kind::Swc => swc::read(table).unwrap(),
        table::Kind::Cylinders(header) => cylinders::read(table, &header).unwrap(),
    }
}

#[test]
fn a_mat_file_holds_the_cylinders_of_its_csv() {
    let Some(folder) = real_models() else { return };
    for name in ["itsme_buttressed_1", "itsme_tree_1", "itsme_tree_2", "rtwig_small"] {
        let of = |extension: &str| pieces_of(&folder, &format!("{name}.{extension}"), &Files::new());
        let (mat, csv) = (of("mat"), of("csv"));
        assert_eq!(
            (mat.format, csv.format, mat.pieces.len()),
            (Format::TreeQsmMat, Format::TreeQsmCsv, csv.pieces.len())
        );
        for (a, b) in mat.pieces.iter().zip(&csv.pieces) {
            assert_eq!(
                (a.id, a.parent_id, a.axis, a.extension_id, a.order),
                (b.id, b.parent_id, b.axis, b.extension_id, b.order)
            );
            // The CSV has five digits behind the point.
            assert!(a.start.distance(b.start) < 2e-5 && a.end.distance(b.end) < 5e-5, "{name}: {a:?} {b:?}");
            assert!((a.radius - b.radius).abs() < 1e-5, "{name}: {a:?} {b:?}");
        }
        let file = format!("{name}.mat");
        let tree = import(&std::fs::read(folder.join(&file)).unwrap(), &file, &params()).unwrap();
        assert_eq!(tree.format, Format::TreeQsmMat);
    }
}

#[test]
fn an_mtg_with_coordinates_holds_the_nodes_of_its_reference() {
    let Some(folder) = real_models() else { return };
    let dressing = std::fs::read(folder.join("mtg_agraf.drf")).unwrap();
    let truth = pieces_of(&folder, "mtg_apple_agraf.swc", &Files::new()).pieces;
    for files in [Files::from([("mtg_agraf.drf".to_owned(), dressing.as_slice())]), Files::new()] {
        let found = pieces_of(&folder, "mtg_agraf.mtg", &files).pieces;
        assert_eq!(found.len(), truth.len());
        let sorted = |pieces: &[Piece]| {
            let key = |p: &Piece| [p.end.x, p.end.y, p.end.z, p.radius].map(|v| (v * 1e5).round() as i64);
            let mut all: Vec<[i64; 4]> = pieces.iter().map(key).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(sorted(&found), sorted(&truth));
    }
}

#[test]
fn an_mtg_of_lengths_and_angles_takes_the_shape_of_its_reference() {
    let Some(folder) = real_models() else { return };
    let truth = pieces_of(&folder, "plantgeom_coffee.swc", &Files::new()).pieces;
    let found = pieces_of(&folder, "plantgeom_coffee.mtg", &Files::new()).pieces;
    assert_eq!(found.len(), truth.len());
    let mut near = 0;
    for (i, (a, b)) in found.iter().zip(&truth).enumerate() {
        // The reference counts its rows from 1, and has the same tree.
        assert_eq!(a.parent_id, if i == 0 { -1 } else { b.parent_id - 1 });
        near += usize::from(a.end.distance(b.end) < 1e-3);
        let (length, true_length) = (
            a.end.distance(found[a.parent_id.max(0) as usize].end),
            b.end.distance(truth[(b.parent_id - 1).max(0) as usize].end),
        );
        assert!((length - true_length).abs() < 2e-3, "{i}: {length} {true_length}");
    }
    // The trunk and its laterals: 1222 nodes, but a whorl of four. On which side laterals of laterals leave is not told.
    assert!(near > 1150, "{near} of {} nodes within a millimetre", truth.len());
}
