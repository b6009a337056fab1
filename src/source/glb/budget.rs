//! What parsing a glTF text may take, estimated before it is parsed.
//!
//! `{},` is three bytes of text and some hundred of memory once parsed. So the text is gone over once: every object,
//! every member and every further entry of a list outside of strings counts with the most that it can become, and a text
//! whose sum is out of proportion to its size is refused. What exporters write stays at a quarter of it.

/// Bytes for an object, for a member of one, for a number in a list.
const COSTS: [usize; 3] = [320, 100, 16];
/// Bytes that each byte of text may become, and beside that.
const MOST: (usize, usize) = (12, 512 << 10);

/// Whether a text becomes no more than it may.
pub(super) fn is_dense(text: &[u8]) -> bool {
    let (mut sum, mut quoted, mut escaped, mut comma) = (0_usize, false, false, false);
    for &byte in text {
        if quoted {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => quoted = false,
                _ => {}
            }
            continue;
        }
        if comma && !byte.is_ascii_whitespace() {
            comma = false;
            sum += if byte == b'"' { COSTS[1] } else { COSTS[2] };
        }
        match byte {
            b'"' => quoted = true,
            b'{' => sum += COSTS[0],
            b',' => comma = true,
            _ => {}
        }
    }
    sum > MOST.0 * text.len() + MOST.1
}
