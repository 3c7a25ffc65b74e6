//! Foreign text for a terminal.

use std::borrow::Cow;

/// True for what a terminal would obey instead of showing it: control characters, and those that turn the direction.
fn commands(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Text from elsewhere as a terminal may have it: what it would obey is written as an escape sequence of Rust's, but for
/// the characters in `keep`.
///
/// ```
/// use clutch_log::printable;
/// assert_eq!(printable("a\x1b[2Jb\n", &['\n']), "a\\u{1b}[2Jb\n");
/// ```
#[must_use]
pub fn printable<'a>(text: &'a str, keep: &[char]) -> Cow<'a, str> {
    let escaped = |c: char| commands(c) && !keep.contains(&c);
    if !text.contains(escaped) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if escaped(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out.into()
}
