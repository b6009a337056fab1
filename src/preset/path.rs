//! Names and paths that work on every system a preset may be opened on.

/// Names that Windows keeps for devices, whatever their extension.
const RESERVED: [&str; 4] = ["con", "prn", "aux", "nul"];
/// Longest name of a set or a source.
pub(super) const MOST_NAME: usize = 64;
/// Longest path, characters.
const MOST_PATH: usize = 512;

/// What keeps `name` from being part of a file's name everywhere, if anything; a hint goes with it.
pub(super) fn name_fault(name: &str) -> Option<(&'static str, &'static str)> {
    const LETTERS: &str = "use letters a to z, digits, _ and -";
    if name.is_empty() {
        Some(("the name is empty", LETTERS))
    } else if name.len() > MOST_NAME {
        Some(("the name is longer than 64 letters", "it becomes part of file names"))
    } else if !name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-') {
        Some(("the name would not work as part of a file's name everywhere", LETTERS))
    } else if is_reserved(name) {
        Some(("Windows keeps this name for a device", "choose another name"))
    } else {
        None
    }
}

fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).to_ascii_lowercase();
    let port = |prefix: &str| {
        stem.strip_prefix(prefix).is_some_and(|n| n.len() == 1 && n.bytes().all(|b| (b'1'..=b'9').contains(&b)))
    };
    RESERVED.contains(&stem.as_str()) || port("com") || port("lpt")
}

/// A path relative to the preset's folder, without `.` and inner `..`; or what is wrong with it and a hint.
///
/// It may climb out of the folder by `..`, as studios keep scans beside their presets. It is never absolute: a preset
/// must mean the same on every machine.
pub(super) fn relative(path: &str) -> Result<String, (String, &'static str)> {
    const FROM: &str = "paths start at the preset's folder, with / between folders";
    let fault = |message: &str, hint| Err((message.to_string(), hint));
    if path.is_empty() {
        return fault("the path is empty", FROM);
    }
    if path.chars().count() > MOST_PATH {
        return fault("the path is too long", FROM);
    }
    if path.contains('\\') {
        return fault("a backslash in a path works on Windows only", "write / between folders");
    }
    let drive = path.as_bytes();
    if path.starts_with(['/', '~']) || (drive.len() > 1 && drive[1] == b':') || path.contains("://") {
        return fault("the path is absolute, so the preset works on one machine only", FROM);
    }
    if let Some(c) = path.chars().find(|c| c.is_control() || matches!(c, ':' | '*' | '?' | '"' | '<' | '>' | '|')) {
        return Err((format!("`{}` can't be in a file's name everywhere", c.escape_debug()), FROM));
    }
    if path.ends_with('/') {
        return fault("the path names a folder", "name a file in it");
    }
    for part in path.split('/') {
        if is_reserved(part) {
            return fault("Windows keeps this name for a device", "choose another name");
        }
        if part != "." && part != ".." && part.ends_with(['.', ' ']) {
            return fault("a name ends in a point or a space, which Windows drops", "choose another name");
        }
    }
    match joined("", path) {
        clean if clean.is_empty() || clean == ".." || clean.ends_with("/..") => {
            fault("the path names a folder", "name a file in it")
        }
        clean => Ok(clean),
    }
}

/// Where a file lies, seen from the preset's folder, that the file `from` names; none when that is out of bounds.
///
/// A designer writes a preset and may name what they like; a mesh comes from anywhere. So what it names may not lie
/// higher than the preset's folder, or than the mesh itself where that lies above.
#[must_use]
pub fn beside(from: &str, name: &str) -> Option<String> {
    let path = joined(folder(from), name);
    let climbs = |path: &str| path.split('/').take_while(|part| *part == "..").count();
    (climbs(&path) <= climbs(from) && !path.starts_with('/')).then_some(path)
}

/// `path` seen from `folder`, without `.` and inner `..`.
pub(super) fn joined(folder: &str, path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in folder.split('/').chain(path.split('/')) {
        match part {
            "" if parts.is_empty() && folder.starts_with('/') => parts.push(""),
            "" | "." => {}
            ".." if parts.last().is_some_and(|&last| last != ".." && !last.is_empty()) => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

/// The folder of a file, without the last `/`; empty for a bare name.
pub(super) fn folder(file: &str) -> &str {
    file.rsplit_once('/').map_or("", |(folder, _)| if folder.is_empty() { "/" } else { folder })
}

/// A file's name without folder and extension.
pub(super) fn stem(file: &str) -> &str {
    let name = file.rsplit_once('/').map_or(file, |(_, name)| name);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_cleaned_and_may_climb() {
        for (path, clean) in [
            ("a.csv", "a.csv"),
            ("./scans//a.csv", "scans/a.csv"),
            ("species/../scans/a.csv", "scans/a.csv"),
            ("../../scans/a.csv", "../../scans/a.csv"),
            ("x/../../a.csv", "../a.csv"),
            ("Bäume/Eiche 1.csv", "Bäume/Eiche 1.csv"),
        ] {
            assert_eq!(relative(path).as_deref(), Ok(clean), "{path}");
        }
    }

    #[test]
    fn paths_of_one_machine_are_refused() {
        let long = "a".repeat(1000);
        for path in [
            "",
            ".",
            "..",
            "a/..",
            "a/",
            "/a.csv",
            "~/a.csv",
            "C:/a.csv",
            "c:a.csv",
            "a\\b.csv",
            "file://a.csv",
            "a:b",
            "a?",
            "a\n",
            "nul",
            "x/COM1.csv",
            "a./b.csv",
            "a /b",
            &long,
        ] {
            assert!(relative(path).is_err(), "{path}");
        }
    }

    #[test]
    fn a_mesh_names_nothing_above_the_preset_and_itself() {
        for (from, name, path) in [
            ("oak.obj", "oak.mtl", Some("oak.mtl")),
            ("scans/oak.obj", "../tex/oak.png", Some("tex/oak.png")),
            ("scans/oak.obj", "../../oak.png", None),
            ("../scans/oak.obj", "../tex/oak.png", Some("../tex/oak.png")),
            ("../scans/oak.obj", "../../etc/passwd", None),
        ] {
            assert_eq!(beside(from, name).as_deref(), path, "{from} {name}");
        }
    }

    #[test]
    fn names_are_portable() {
        for name in ["oak", "oak_07", "Oak-7", "com0", "com10", "console"] {
            assert_eq!(name_fault(name), None, "{name}");
        }
        for name in ["", "a b", "a.b", "ä", "a/b", "CON", "lpt1", &"a".repeat(65)] {
            assert!(name_fault(name).is_some(), "{name}");
        }
    }

    #[test]
    fn species_paths_are_shown_from_where_the_user_stands() {
        assert_eq!(joined(folder("presets/a.ron"), "species/oak.ron"), "presets/species/oak.ron");
        assert_eq!(joined(folder("/home/x/a.ron"), "../oak.ron"), "/home/oak.ron");
        assert_eq!(joined(folder("/a.ron"), "../oak.ron"), "/../oak.ron");
        assert_eq!(joined(folder("a.ron"), "../oak.ron"), "../oak.ron");
        assert_eq!((stem("x/oak.set.ron"), stem("oak")), ("oak.set", "oak"));
    }
}
