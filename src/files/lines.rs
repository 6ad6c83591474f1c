//! Text, line by line.

use std::io::{BufRead, Read};

use super::{plain, shorten};

/// Lines of a file, at most.
const MAX_LINES: u64 = i32::MAX as u64;
/// Bytes of one line that are looked at: what is left out may go on beyond.
const MAX_LINE: u64 = 1 << 16;
/// U+FEFF in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Calls `each` with the beginning of every line, as many bytes as `wanted` says; an error gets the line's number.
///
/// The rest is left out: it need not be text, nor end within [`MAX_LINE`].
pub fn lines(
    mut input: impl BufRead,
    wanted: impl Fn(&[u8]) -> usize,
    mut each: impl FnMut(&str) -> Result<(), String>,
) -> Result<(), String> {
    let mut bytes = Vec::new();
    for at in 1.. {
        bytes.clear();
        let fail = |problem: String| format!("line {at}: {problem}");
        let n = Read::take(&mut input, MAX_LINE).read_until(b'\n', &mut bytes).map_err(|e| fail(plain(&e)))?;
        if n == 0 {
            break;
        }
        if at > MAX_LINES {
            return Err(fail("too many lines".into()));
        }
        let line = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes);
        let (wanted, rest) = line.split_at(wanted(line));
        // UTF-16 looks as if nothing were wanted.
        if line.contains(&0) {
            return Err(fail("not text".into()));
        }
        if n as u64 == MAX_LINE && !bytes.ends_with(b"\n") {
            if rest.is_empty() {
                return Err(fail(format!("longer than {MAX_LINE} bytes")));
            }
            input.skip_until(b'\n').map_err(|e| fail(plain(&e)))?;
        }
        let text = std::str::from_utf8(wanted).map_err(|_| fail("not text".into()))?;
        let text = text.trim_end_matches(['\n', '\r']);
        // They would be one line, and most of it passed over.
        if text.contains('\r') {
            return Err(fail("lines end with carriage returns alone: line feeds are expected".into()));
        }
        each(text).map_err(fail)?;
    }
    Ok(())
}

/// With a message that does not repeat a hostile word whole.
pub fn number<T: std::str::FromStr>(word: &str) -> Result<T, String> {
    word.parse().map_err(|_| format!("{:?} is not a number", shorten(word)))
}
