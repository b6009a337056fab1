//! What every fuzz target does with a file: import it, and see that it neither panics nor takes more memory than it may.
//!
//! `cargo fuzz run READER -- -timeout=10` for READER in gltf, obj, ply, mat, mtg, table. An input may hold several
//! files, parted by [`PART`]: the first is imported, the others are what it names, in the order in which it asks.
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
pub fn try_import(bytes: &[u8]) {
    let (peak, _) = peak(|| read(bytes));
    assert!(peak <= MOST.0 * bytes.len() + MOST.1, "{peak} bytes of memory for a file of {}", bytes.len());
}
