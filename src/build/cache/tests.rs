//! The cache: what it keeps, what it finds damaged, what it evicts, and several at once.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, SystemTime};

use super::*;

const STAGE: Stage = Stage("numbers", 1);

fn options(folder: &Path) -> CacheOptions {
    CacheOptions { folder: folder.to_path_buf(), limit: 1 << 20 }
}

/// Asks for a value of `len` bytes; how often it was made.
fn ask(cache: &Cache, len: u8) -> usize {
    let made = AtomicUsize::new(0);
    let key = STAGE.key().number(u64::from(len)).finish();
    let value = cache.remember(STAGE, key, || {
        made.fetch_add(1, Ordering::Relaxed);
        Ok(vec![len; usize::from(len)])
    });
    assert_eq!(*value.unwrap(), vec![len; usize::from(len)]);
    made.into_inner()
}

/// The files below a folder, in order of name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() { found.extend(files(&entry.path())) } else { found.push(entry.path()) }
    }
    found.sort();
    found
}

#[test]
fn what_was_made_once_is_made_no_more_by_this_process_or_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let first = Cache::new(Some(&options(folder.path())));
    assert_eq!((ask(&first, 3), ask(&first, 3), ask(&first, 4)), (1, 0, 1));
    let second = Cache::new(Some(&options(folder.path())));
    assert_eq!((ask(&second, 3), ask(&second, 4), ask(&second, 5)), (0, 0, 1));
    assert_eq!((ask(&Cache::default(), 3), second.take_notes()), (1, Vec::new()));
}

#[test]
fn a_damaged_entry_is_made_again_and_told_once() {
    let folder = tempfile::tempdir().unwrap();
    ask(&Cache::new(Some(&options(folder.path()))), 200);
    let path = files(folder.path()).remove(0);
    let whole = fs::read(&path).unwrap();
    let mut changed = whole.clone();
    *changed.last_mut().unwrap() ^= 1;
    for damaged in [&changed[..], &whole[..whole.len() / 2], &whole[..10], b""] {
        fs::write(&path, damaged).unwrap();
        let cache = Cache::new(Some(&options(folder.path())));
        assert_eq!((ask(&cache, 200), ask(&cache, 200)), (1, 0));
        let notes = cache.take_notes();
        assert!(notes.len() == 1 && notes[0].message.contains("was damaged"), "{notes:?}");
        assert_eq!(fs::read(&path).unwrap(), whole, "it was not mended");
    }
    // An entry of another key in its place is no less damaged.
    ask(&Cache::new(Some(&options(folder.path()))), 7);
    let other = files(folder.path()).into_iter().find(|p| *p != path).unwrap();
    fs::copy(&other, &path).unwrap();
    let cache = Cache::new(Some(&options(folder.path())));
    assert_eq!((ask(&cache, 200), cache.take_notes().len()), (1, 1));
}

#[test]
#[expect(clippy::disallowed_methods, reason = "makes entries old")]
fn what_was_used_longest_ago_goes_first_and_nothing_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let options = CacheOptions { limit: 1000, ..options(folder.path()) };
    let mine = folder.path().join("numbers/notes.txt");
    fs::create_dir(folder.path().join("numbers")).unwrap();
    fs::write(&mine, vec![0; 5000]).unwrap();
    let cache = Cache::new(Some(&options));
    for len in [200, 201, 202] {
        ask(&cache, len);
    }
    let age = |len: u8, seconds: u64| {
        let path = cache.store.as_ref().unwrap().path(STAGE.0, STAGE.key().number(u64::from(len)).finish());
        fs::File::options()
            .write(true)
            .open(path)
            .unwrap()
            .set_modified(SystemTime::now() - Duration::from_secs(seconds))
    };
    for (len, seconds) in [(200, 50), (201, 90), (202, 10)] {
        age(len, seconds).unwrap();
    }
    // All three fit.
    cache.trim();
    assert_eq!(stats(folder.path()).unwrap().entries, 3);
    // Using the second makes it the youngest; a fourth is too much, so the first goes.
    assert_eq!(ask(&Cache::new(Some(&options)), 201), 0);
    ask(&cache, 203);
    cache.trim();
    let next = Cache::new(Some(&options));
    let left: Vec<bool> = [200, 201, 202, 203]
        .iter()
        .map(|&len| next.stored::<Vec<u8>>(STAGE, STAGE.key().number(len).finish()).is_some())
        .collect();
    assert_eq!(left, [false, true, false, true], "two of about 300 bytes are four fifths of 1000 at most");
    assert_eq!(clear(folder.path()).unwrap().entries, 2);
    assert_eq!(files(folder.path()), [mine]);
}

#[test]
fn a_folder_that_can_not_be_written_is_told_once_and_stops_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "mine").unwrap();
    let cache = Cache::new(Some(&options(&file)));
    assert_eq!((ask(&cache, 1), ask(&cache, 2), ask(&cache, 1)), (1, 1, 0));
    let notes = cache.take_notes();
    assert!(notes.len() == 1 && notes[0].message.contains("can't be written"), "{notes:?}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    #[cfg(unix)]
    {
        let nowhere = folder.path().join("nowhere");
        std::os::unix::fs::symlink("gone/cache", &nowhere).unwrap();
        let cache = Cache::new(Some(&options(&nowhere)));
        assert_eq!((ask(&cache, 1), ask(&cache, 2)), (1, 1));
        cache.trim();
        let notes = cache.take_notes();
        assert!(notes.len() == 1 && notes[0].message.contains("nowhere can't be made"), "{notes:?}");
    }
    assert_eq!(stats(&folder.path().join("none")).unwrap(), CacheStats::default());
}

/// The form in which a value is kept, as one hash: a new field, another order or another type change it.
fn form(value: &impl Serialize) -> String {
    Key::of_bytes(&postcard::to_stdvec(value).unwrap()).to_hex()[..16].to_owned()
}

#[test]
fn who_changes_what_is_kept_raises_the_layout() {
    use crate::base::Rotation;
    use crate::lod::{Ladder, Level, Measured};
    use crate::mesh::{Mesh, TreeMesh};
    use crate::plant::{Leaf, LeafForm, PlantBuilder};
    use crate::preset::plan::Lod;
    use glam::{Vec2, Vec3};
    let mut builder = PlantBuilder::new();
    let stem = builder.stem(Vec3::X, &[Vec3::ZERO, Vec3::Y], &[0.1, 0.05]);
    let leaf = Leaf::new(stem, 0.25, Rotation::IDENTITY, 0.1, 3);
    builder.leaf(Leaf { form: LeafForm::Flat(0.5), offset: Vec3::Y, ..leaf });
    let plant = builder.finish().unwrap();
    let maps = crate::bake::Maps {
        width: 1,
        height: 1,
        color: vec![[1, 2, 3, 4]],
        normal: vec![[5, 6, 7]],
        orm: vec![[8, 9, 10]],
    };
    let mesh = Mesh {
        positions: vec![Vec3::ONE],
        normals: vec![Vec3::Y],
        tangents: vec![[1.0, 0.0, 0.0, -1.0]],
        uvs: vec![Vec2::X],
        lightmap: vec![Vec2::Y],
        occlusion: vec![200],
        tiles: vec![2],
        chains: vec![4],
        indices: vec![0, 0, 0],
    };
    let level = Level {
        kind: Lod::BillboardCloud { cards: 8 },
        mesh: TreeMesh { bark: mesh.clone(), leaf: mesh },
        triangles: 1,
        screen_coverage: 0.5,
        measured: Measured { views: 3, ..Measured::same(9) },
        plain: None,
        impostor: None,
    };
    let tile = crate::lod::Tile {
        width: 1,
        height: 1,
        alpha: vec![4],
        normal: vec![[5, 6, 7]],
        orm: vec![[8, 9, 10]],
        recipe: crate::bake::Recipe::default(),
        drawn: vec![11],
    };
    let ladder = Ladder { levels: vec![level], tiles: vec![tile] };
    let forms = [form(&plant), form(&ladder), form(&maps)];
    // Changed? Then raise LAYOUT, and put the new forms here.
    assert_eq!(
        (LAYOUT, forms.each_ref().map(String::as_str)),
        (7, ["ba0bb323493e3d8d", "e020068024a78296", "7239ee1e4e7b9e5b"])
    );
}
