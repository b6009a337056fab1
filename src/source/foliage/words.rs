//! What names of materials, objects and pictures say: leaf, wood, or something that is neither.
//!
//! Names come from many tools and languages. A name is cut at capitals, digits and signs; each piece is compared with
//! the table by its beginning, so that `leaves`, `Leafs` and `leaf_oak` all count. Where several words apply the last one
//! does, as in "oak leaf" and "leaf stalk", but a word of the first kind (petiole, fruit) goes before all others.

/// What a name says about its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hint {
    /// Foliage.
    Leaf,
    /// Trunk and branches.
    Wood,
    /// Stalks of leaves: neither drawn nor counted as branches.
    Stalk,
    /// Flowers and fruit.
    Fruit,
    /// What a tree stands in or on.
    Ground,
}

/// Beginnings of words; in each row what it says.
const WORDS: [(Hint, &[&str]); 5] = [
    (Hint::Ground, &["ground", "soil", "terrain", "dirt", "pot", "planter", "terracotta", "topf", "boden", "erde"]),
    (Hint::Stalk, &["petiol", "rachis", "blattstiel", "pedunc", "pedicel"]),
    (
        Hint::Fruit,
        &["fruit", "flower", "blossom", "petal", "bluete", "frucht", "apple", "cherr", "berr", "acorn", "cone", "nut"],
    ),
    (
        Hint::Leaf,
        &[
            "leaf",
            "leav",
            "lvs",
            "foliage",
            "folia",
            "needle",
            "nadel",
            "blatt",
            "blaett",
            "laub",
            "frond",
            "feuill",
            "hoja",
            "foglia",
            "folha",
            "list",
            "crown",
            "canopy",
            "krone",
            "billboard",
            "card",
            "atlasleaf",
            "frons",
        ],
    ),
    (
        Hint::Wood,
        &[
            "bark",
            "trunk",
            "wood",
            "branch",
            "stem",
            "shoot",
            "rinde",
            "stamm",
            "holz",
            "ast",
            "zweig",
            "log",
            "twig",
            "tronc",
            "tronco",
            "corteza",
            "ecorce",
            "corteccia",
            "bole",
            "bough",
            "limb",
            "cap",
        ],
    ),
];

/// Words that must be met whole: as beginnings they would be met by chance.
const WHOLE: &[&str] = &["ast", "cap", "log", "list", "card", "nut", "cone", "apple", "stem", "pot", "erde"];

/// What a name says; none where it says nothing.
pub(super) fn hint(name: &str) -> Option<Hint> {
    let mut found = None;
    for piece in pieces(name) {
        let of = |words: &[&str]| {
            words.iter().any(|word| {
                if WHOLE.contains(word) { piece.trim_end_matches('s') == *word } else { piece.starts_with(word) }
            })
        };
        for (hint, words) in WORDS {
            if of(words) {
                if matches!(hint, Hint::Stalk | Hint::Fruit) {
                    // "cherry_leaf", "apple bark": a kind of tree, if a word for one of its parts follows.
                    if found.is_none() || hint == Hint::Stalk {
                        found = Some(hint);
                    }
                } else if found != Some(Hint::Stalk) {
                    // "leaf card", "twig card", "branch_leaves": a card is what the word before says, if that is a leaf.
                    found = Some(hint);
                }
                break;
            }
        }
    }
    found
}

/// Whether a name is a conifer's.
pub(super) fn is_conifer(name: &str) -> bool {
    const CONIFERS: &[&str] = &["pine", "fir", "spruce", "conifer", "larch", "cedar", "needle", "kiefer", "fichte"];
    pieces(name).iter().any(|piece| CONIFERS.iter().any(|word| piece.starts_with(word) && !piece.starts_with("fire")))
}

/// The words of a name, in small letters.
fn pieces(name: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut after_small = false;
    let mut open = false;
    for c in name.chars() {
        if !c.is_alphabetic() {
            (open, after_small) = (false, false);
            continue;
        }
        if !open || (c.is_uppercase() && after_small) {
            pieces.push(String::new());
        }
        open = true;
        after_small = c.is_lowercase();
        if let Some(piece) = pieces.last_mut() {
            piece.extend(c.to_lowercase().flat_map(plain));
        }
    }
    pieces
}

/// A letter without its marks, as far as the table needs.
fn plain(c: char) -> impl Iterator<Item = char> {
    let text: &'static str = match c {
        'ä' => "ae",
        'ö' => "oe",
        'ü' => "ue",
        'é' | 'è' => "e",
        other => return [Some(other), None].into_iter().flatten(),
    };
    let mut letters = text.chars();
    [letters.next(), letters.next()].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_tools_are_understood() {
        for (name, says) in [
            ("bark_oak", Some(Hint::Wood)),
            ("leaf_oak", Some(Hint::Leaf)),
            ("leafsDark", Some(Hint::Leaf)),
            ("woodBarkDark", Some(Hint::Wood)),
            ("Wood", Some(Hint::Wood)),
            ("DarkGreen", None),
            ("color_main", None),
            ("M_Blätter_02", Some(Hint::Leaf)),
            ("Stamm.001", Some(Hint::Wood)),
            ("Twig_Card", Some(Hint::Leaf)),
            ("AppleBark.jpg", Some(Hint::Wood)),
            ("OliveLeaf_upper.png", Some(Hint::Leaf)),
            ("petiole", Some(Hint::Stalk)),
            ("leaf petiole", Some(Hint::Stalk)),
            ("hill_cherry leaf", Some(Hint::Leaf)),
            ("Fruit", Some(Hint::Fruit)),
            ("PineNeedles", Some(Hint::Leaf)),
            ("Mesh12", None),
            ("landscape", None),
            ("terracotta_pot", Some(Hint::Ground)),
            ("Soil.001", Some(Hint::Ground)),
            ("ground_bark", Some(Hint::Wood)),
            ("potential", None),
            ("", None),
        ] {
            assert_eq!(hint(name), says, "{name}");
        }
    }
}
