//! What every fuzz target does with its input: read it, and see that this neither panics nor takes more memory than it
//! may.
//!
//! `cargo fuzz run READER -- -timeout=10` for READER in gltf, obj, ply, mat, mtg, table: files of trees. An input may hold
//! several, parted by [`PART`]: the first is imported, the others are what it names, in the order in which it asks.
//! `preset`: the text of a preset, behind [`PART`] that of the species it names. `entry`: a line with the name of a stage,
//! then what a cache keeps for it.
//! Without libFuzzer: `cargo run --release --example mutate -- FOLDER SECONDS` in this folder.

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use treewright::preset::plan::ImportParams;
use treewright::source::{import, scene};

/// What parts the files of an input.
pub const PART: &[u8] = b"\n--8<--\n";
/// Bytes of memory a reader may take for each byte of its files, and beside that.
pub const MOST: (usize, usize) = (20, 1 << 20);
/// The same for presets: `count: 4096` is a plan of as many variants, each with what it is made of.
pub const MOST_OF_PRESETS: (usize, usize) = (2000, 64 << 20);

/// What `reader` may take.
pub fn most(reader: &str) -> (usize, usize) {
    if reader == "preset" { MOST_OF_PRESETS } else { MOST }
}

/// Reads an input by the way of one fuzz target; whether it is sound.
pub fn read_as(reader: &str, bytes: &[u8]) -> bool {
    match reader {
        "preset" => {
            let parts: Vec<_> = bytes_parts(bytes).into_iter().map(String::from_utf8_lossy).collect();
            let mut others = parts[1..].iter();
            let mut beside = |_: &str| others.next().map(|text| text.to_string()).ok_or_else(|| "no such file".to_owned());
            treewright::preset::load("fuzz.ron", &parts[0], &mut beside).is_ok()
        }
        "entry" => {
            let end = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(0);
            let (stage, rest) = bytes.split_at(end);
            let stage = String::from_utf8_lossy(stage);
            treewright::build::entry_is_sound(&stage, rest.get(1..).unwrap_or_default()) == Some(true)
        }
        _ => read(bytes),
    }
}

/// The system's allocator, counting what is live and the most that ever was.
struct Counting;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn grow(size: usize) {
    let live = LIVE.fetch_add(size, Relaxed) + size;
    PEAK.fetch_max(live, Relaxed);
}

// SAFETY: everything is handed to the system's allocator as it came; the counters touch no memory of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // What the list holds before and after is never live at once, other than in the worst case of the system's.
        if size > layout.size() {
            grow(size - layout.size());
        } else {
            LIVE.fetch_sub(layout.size() - size, Relaxed);
        }
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most memory that was taken while something ran, bytes above what was there before.
pub fn peak<T>(run: impl FnOnce() -> T) -> (usize, T) {
    let before = LIVE.load(Relaxed);
    PEAK.store(before, Relaxed);
    let result = run();
    (PEAK.load(Relaxed).saturating_sub(before), result)
}

/// Reads an input up to its middle form (a scene, or the pieces of a model); whether it is sound.
pub fn read(bytes: &[u8]) -> bool {
    let mut files = bytes_parts(bytes).into_iter();
    let main = files.next().unwrap_or_default();
    let mut beside: BTreeMap<String, &[u8]> = scene::Files::new();
    for _ in 0..3 {
        for name in import::refers(main, "file", &beside) {
            if let Some(file) = files.next() {
                beside.insert(name, file);
            }
        }
    }
    if scene::sniff(main).is_some() {
        scene::read(main, "file", &beside).is_ok()
    } else {
        let params = ImportParams::default();
        import::import(main, "file", &params).is_ok()
    }
}

fn bytes_parts(bytes: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(PART.len()).position(|w| w == PART) {
        parts.push(&rest[..at]);
        rest = &rest[at + PART.len()..];
    }
    parts.push(rest);
    parts
}

/// What a fuzz target does.
///
/// # Panics
///
/// When a reader takes more memory than it may.
pub fn try_as(reader: &str, bytes: &[u8]) {
    let (each, beside) = most(reader);
    let (peak, _) = peak(|| read_as(reader, bytes));
    assert!(peak <= each * bytes.len() + beside, "{peak} bytes of memory for a file of {}", bytes.len());
}
