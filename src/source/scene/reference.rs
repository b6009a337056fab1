//! The names by which meshes name other files, made into paths that work.
//!
//! Exporters write what their machine had: backslashes, `./`, quotes, absolute paths of somebody's home. Relative paths
//! are kept, with `/` between folders and inner `..` resolved. Of an absolute path (of a drive, of a root, of a home, an
//! address) only the last name is kept: such files travel beside the mesh or not at all.

/// Longest name that is followed, bytes.
const MOST: usize = 512;

/// The path, relative to the mesh's folder; none when it names no file.
pub(super) fn path(written: &str) -> Option<String> {
    let written = written.trim().trim_matches('"').replace('\\', "/");
    let drive = written.as_bytes().get(1) == Some(&b':');
    let absolute = written.starts_with(['/', '~']) || drive || written.contains("://");
    let relative = if absolute { written.rsplit('/').next().unwrap_or_default() } else { &written };
    let mut parts: Vec<&str> = Vec::new();
    for part in relative.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.last().is_some_and(|p| *p != "..") => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    let path = parts.join("/");
    let sound = !path.is_empty() && path.len() <= MOST && !path.ends_with("..") && !path.contains(char::is_control);
    sound.then_some(path)
}

#[cfg(test)]
mod tests {
    use super::path;

    #[test]
    fn paths_of_other_machines_become_names_beside_the_mesh() {
        let of = |written: &str| path(written).unwrap_or_default();
        assert_eq!(of("tex\\oak leaf.png"), "tex/oak leaf.png");
        assert_eq!(of("./a/../b.mtl"), "b.mtl");
        assert_eq!(of("../shared/b.mtl"), "../shared/b.mtl");
        assert_eq!(of("C:\\Users\\me\\bark.png"), "bark.png");
        assert_eq!(of("/home/me/bark.png"), "bark.png");
        assert_eq!(of("https://example.org/bark.png"), "bark.png");
        assert_eq!(of(" \"bark.png\" "), "bark.png");
        for none in ["", ".", "..", "a/..", "/", "a\u{7}b"] {
            assert_eq!(path(none), None, "{none:?}");
        }
    }
}
