//! Figures of imported trees.

/// Prints them.
pub(crate) fn print() {
    crate::formats::print();
}
