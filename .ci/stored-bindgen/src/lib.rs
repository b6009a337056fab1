//! Stands in for `bindgen` while `xatlas-rs-v2` is built.
//!
//! That crate's build script runs bindgen, which needs libclang on the machine; a fresh machine has none. This crate has
//! the few methods that the script calls and writes bindings that bindgen 0.68.1 made from the same `xatlas.h` (the
//! version is pinned in Cargo.toml). They are plain declarations; between platforms only the mangled names differ: one
//! file for the Itanium ABI (macOS puts one more underscore before each name) and one for MSVC.

use std::env;
use std::fs;
use std::io;
use std::path::Path;

/// Takes the place of `bindgen::Builder`.
pub struct Builder;

/// Takes the place of `bindgen::builder`.
pub fn builder() -> Builder {
    Builder
}

impl Builder {
    /// Ignored: the header is known.
    pub fn header(self, _: &str) -> Self {
        self
    }

    /// Ignored.
    pub fn enable_cxx_namespaces(self) -> Self {
        self
    }

    /// Ignored.
    pub fn clang_args(self, _: &[&str]) -> Self {
        self
    }

    /// Ignored.
    pub fn layout_tests(self, _: bool) -> Self {
        self
    }

    /// Chooses the stored bindings for the target.
    pub fn generate(self) -> Result<Bindings, String> {
        let of = |name| env::var(name).unwrap_or_default();
        let itanium = include_str!("xatlas_itanium.txt");
        Ok(Bindings(if of("CARGO_CFG_TARGET_ENV") == "msvc" {
            include_str!("xatlas_msvc.txt").to_owned()
        } else if of("CARGO_CFG_TARGET_VENDOR") == "apple" {
            itanium.replace("\\u{1}_Z", "\\u{1}__Z")
        } else {
            itanium.to_owned()
        }))
    }
}

/// Takes the place of `bindgen::Bindings`.
pub struct Bindings(String);

impl Bindings {
    /// Writes the bindings.
    pub fn write_to_file(&self, path: impl AsRef<Path>) -> io::Result<()> {
        fs::write(path, &self.0)
    }
}
