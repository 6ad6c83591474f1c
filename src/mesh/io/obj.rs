//! OBJ: `v` and `f`.

use std::cell::Cell;
use std::io::BufRead;

use super::{Loaded, check_index};
use crate::files::{lines, number};

/// Vertices, and polygons of all groups and objects. Nothing else is looked at, up to a `#`: other lines may be of any length
/// and in any encoding that keeps ASCII. Indices count from 1, negative ones back from the last vertex so far.
pub fn read_obj(input: impl BufRead) -> Result<Loaded, String> {
    let mut loaded = Loaded::default();
    let mut joined = String::new();
    let goes_on = Cell::new(false);
    let wanted = |line: &[u8]| match line.trim_ascii_start() {
        [b'v' | b'f', rest @ ..] if rest.first().is_none_or(u8::is_ascii_whitespace) => data(line),
        _ if goes_on.get() => data(line),
        _ => 0,
    };
    lines(input, wanted, |line| {
        // A backslash at the end joins lines.
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            if joined.len() + part.len() > MAX_JOINED {
                return Err(format!("lines joined to more than {MAX_JOINED} bytes"));
            }
            joined.push_str(part);
            joined.push(' ');
            goes_on.set(true);
            return Ok(());
        }
        goes_on.set(false);
        if joined.is_empty() {
            return statement(line, &mut loaded);
        }
        joined.push_str(line);
        let done = statement(&joined, &mut loaded);
        joined.clear();
        done
    })?;
    if loaded.mesh.vertices.is_empty() {
        return Err("has no vertices: is this an OBJ file?".into());
    }
    Ok(loaded)
}

/// Bytes of lines that are one.
const MAX_JOINED: usize = 1 << 20;

fn data(line: &[u8]) -> usize {
    line.iter().position(|b| *b == b'#').unwrap_or(line.len())
}

fn statement(line: &str, loaded: &mut Loaded) -> Result<(), String> {
    let mut words = line.split_ascii_whitespace();
    match words.next() {
        Some("v") => {
            let mut p = [0.0; 3];
            for (axis, x) in p.iter_mut().enumerate() {
                *x = number(words.next().ok_or_else(|| format!("a vertex of {axis} numbers"))?)?;
            }
            loaded.vertex(p)
        }
        Some("f") => {
            let n = loaded.mesh.vertices.len();
            let corner = |word: &str| match number::<i64>(word.split('/').next().unwrap_or(""))? {
                0 => Err("indices begin with 1".into()),
                index if index > 0 => check_index(index - 1, n).map_err(|_| format!("vertex {index} of {n}")),
                index => check_index(index.saturating_add(n as i64), n).map_err(|_| format!("vertex {index} of {n}")),
            };
            let corners: Vec<u32> = words.map(corner).collect::<Result<_, String>>()?;
            loaded.polygon(&corners)
        }
        _ => Ok(()),
    }
}
