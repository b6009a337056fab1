//! Reading SVGs within limits: what they ask for hangs on more than their length.
//!
//! usvg tries every rule of a style sheet on every element, so the two are bounded by their product. Pictures that an SVG
//! names or holds are absent, nothing is read beside the given bytes.

use usvg::{Options, Tree};

/// Most bytes of an SVG.
const MOST_SVG: usize = 8 << 20;
/// Most tries of rules on elements: a third of a second.
const MOST_TRIES: usize = 10_000_000;

/// Why an SVG can't be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum SvgError {
    /// None, or a broken one.
    Unreadable(String),
    /// More of something than is read.
    TooLarge {
        /// How many.
        found: usize,
        /// Of what.
        what: &'static str,
        /// The limit.
        most: usize,
    },
}

/// Reads an SVG.
///
/// # Errors
///
/// When it is none, is packed, or asks for too much.
pub(crate) fn read_svg(bytes: &[u8]) -> Result<Tree, SvgError> {
    if bytes.len() > MOST_SVG {
        return Err(SvgError::TooLarge { found: bytes.len(), what: "bytes", most: MOST_SVG });
    }
    // Unpacked it may be of any length.
    if bytes.starts_with(b"\x1f\x8b") {
        return Err(SvgError::Unreadable("it is packed by gzip (SVGZ): save it as plain SVG".to_owned()));
    }
    let count = |of: u8| bytes.iter().filter(|byte| **byte == of).count();
    let (elements, rules) = (count(b'<'), count(b'{'));
    let most = MOST_TRIES / elements.max(1);
    if rules > most {
        return Err(SvgError::TooLarge { found: rules, what: "style rules for so many elements", most });
    }
    let mut options = Options::default();
    options.image_href_resolver.resolve_string = Box::new(|_, _| None);
    options.image_href_resolver.resolve_data = Box::new(|_, _, _| None);
    Tree::from_data(bytes, &options).map_err(|e| {
        let why = e.to_string();
        // The parser counts both, and has one word for them.
        let is_deep = why.contains("nodes limit reached");
        SvgError::Unreadable(if is_deep {
            "its elements are too many or lie too deep in one another: ungroup or simplify them".to_owned()
        } else {
            why
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_take_unbounded_time_or_memory_is_refused() {
        let svg = |rules: usize, elements: usize| {
            let style = ".a{fill:red}".repeat(rules);
            let body = "<g/>".repeat(elements);
            format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><style>{style}</style>{body}</svg>")
        };
        assert!(read_svg(svg(50, 2000).as_bytes()).is_ok());
        let refused = read_svg(svg(20_000, 20_000).as_bytes()).unwrap_err();
        assert!(matches!(refused, SvgError::TooLarge { found: 20_000, .. }), "{refused:?}");
        assert!(matches!(read_svg(&vec![b' '; MOST_SVG + 1]), Err(SvgError::TooLarge { .. })));
        assert!(matches!(read_svg(b"\x1f\x8b\x08\0"), Err(SvgError::Unreadable(why)) if why.contains("gzip")));
        let latin = b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><title>B\xe4ume</title></svg>";
        assert!(matches!(read_svg(latin), Err(SvgError::Unreadable(why)) if why.contains("UTF-8")));
    }
}
