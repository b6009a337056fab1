//! Files that designers name by mistake where a tree is wanted, told by what they are instead of by what they lack.

/// What a file is that holds no tree, and what helps; none for one that may hold a tree.
pub(super) fn stranger(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    const SCENE: &str = "export the tree from it as glTF (.glb) or OBJ";
    const PICTURES: &str = "pictures belong into `foliage` and `bark`; a picture of a tree can't be imported";
    let start = bytes.trim_ascii_start();
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    Some(match () {
        () if starts(b"\x89PNG\r\n\x1a\n") => ("this is a PNG picture", PICTURES),
        () if starts(b"\xff\xd8\xff") => ("this is a JPEG picture", PICTURES),
        () if starts(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => ("this is a WebP picture", PICTURES),
        () if starts(b"PK\x03\x04") => {
            ("this is a ZIP archive", "unpack it, and name the file in it that holds the tree")
        }
        () if starts(b"Kaydara FBX Binary") || start.starts_with(b"; FBX ") => ("this is an FBX scene", SCENE),
        () if starts(b"BLENDER") || starts(b"\x28\xb5\x2f\xfd") => {
            ("this is a Blender scene, or packed by zstd", SCENE)
        }
        () if starts(b"#usda") || starts(b"PXR-USDC") => ("this is a USD scene", SCENE),
        () if starts(b"LASF") => (
            "this is a LAS or LAZ point cloud",
            "reconstruct the tree first, with TreeQSM or SimpleForest say, and name the cylinders that those write",
        ),
        () if starts(b"\xff\xfe") || starts(b"\xfe\xff") => ("this is UTF-16 text", "save it as UTF-8"),
        () if starts(b"\x1f\x8b") => ("this is packed by gzip", "unpack it"),
        () if start.starts_with(b"<") => {
            ("this is a text of tags, as SVG and XML are", "a drawn crown belongs into a variant, `Sketch(of, crown)`")
        }
        () if start.starts_with(b"(") || start.starts_with(b"//") => (
            "this is a text as presets and species files are",
            "a source of a species is `Grow(species: \"oak.ron\")`; of what a preset makes, import a GLB",
        ),
        () => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_no_tree_is_told_by_name_and_what_may_is_left_to_its_reader() {
        for (bytes, part) in [
            (&b"\x89PNG\r\n\x1a\n\0"[..], "PNG"),
            (b"RIFF\0\0\0\0WEBPVP8 ", "WebP"),
            (b"  <svg/>", "SVG"),
            (b"Kaydara FBX Binary  \0\x1a\0", "FBX"),
            (b"; FBX 7.3.0 project file\n", "FBX"),
            (b"BLENDER-v402", "Blender"),
            (b"#usda 1.0\n", "USD"),
            (b"LASF\0\0", "point cloud"),
            (b"\xff\xfe1\0 \0", "UTF-16"),
            (b"// An oak.\n(height: 3.0)", "species"),
        ] {
            assert!(stranger(bytes).is_some_and(|told| told.0.contains(part)), "{part}");
        }
        for bytes in [&b"1 1 0 0 0 0.1 -1"[..], b"radius,length\n", b"", b"# SWC"] {
            assert_eq!(stranger(bytes), None);
        }
    }
}
