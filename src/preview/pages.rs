//! The page's own files: part of the program, so that it needs no folder beside it.

/// The files below `/page/`, and the document.
const FILES: [(&str, &str, &str); 12] = [
    ("index.html", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("main.js", JS, include_str!("page/main.js")),
    ("gallery.js", JS, include_str!("page/gallery.js")),
    ("stage.js", JS, include_str!("page/stage.js")),
    ("space.js", JS, include_str!("page/space.js")),
    ("turntable.js", JS, include_str!("page/turntable.js")),
    ("explore.js", JS, include_str!("page/explore.js")),
    ("sketch.js", JS, include_str!("page/sketch.js")),
    ("tune.js", JS, include_str!("page/tune.js")),
    ("kit.js", JS, include_str!("page/kit.js")),
    ("icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
];
const JS: &str = "text/javascript; charset=utf-8";

/// A file and its type.
pub(super) fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.iter().find(|(known, ..)| *known == name).map(|(_, kind, text)| (*kind, *text))
}
