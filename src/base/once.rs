//! What is made once, by many threads.

use std::sync::OnceLock;

/// What a cell holds, made where it holds nothing yet, by all who come at the same time. `get_or_init` would hang: a thread
/// that makes it in parallel may take over the work of another who waits for it.
pub(crate) fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(held) = cell.get() {
        return held;
    }
    let made = make();
    cell.get_or_init(|| made)
}
