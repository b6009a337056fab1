//! Whether to split work.

/// Whether splitting what this thread does gains nothing: it is the only one, or others find enough of its work that it has
/// not begun. Parts that are made apart have to be put together.
pub(crate) fn is_alone() -> bool {
    rayon::current_num_threads() == 1 || rayon_core::current_thread_has_pending_tasks() == Some(true)
}
