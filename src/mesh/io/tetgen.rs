//! TetGen: points in a `.node` file, triangles in a `.face` file.

use std::io::BufRead;

use super::{Loaded, check_index};
use crate::files::{lines, number};

/// Both files; attributes and boundary markers are passed over. Points count from what the first of them says, 0 or 1. An error
/// comes with the extension of the file it is in.
pub fn read_tetgen(nodes: impl BufRead, faces: impl BufRead) -> Result<Loaded, (&'static str, String)> {
    let mut loaded = Loaded::default();
    let mut base = 0;
    table(nodes, "points", |row, mut words| {
        if let Row::Head = row {
            let dimension: u32 = words.next().map_or(Ok(3), number)?;
            return if dimension == 3 { Ok(()) } else { Err(format!("points of {dimension} dimensions")) };
        }
        if let Row::First(index) = row {
            base = index;
        }
        let mut p = [0.0; 3];
        for (axis, x) in p.iter_mut().enumerate() {
            *x = number(words.next().ok_or_else(|| format!("a point of {axis} coordinates"))?)?;
        }
        loaded.vertex(p)
    })
    .map_err(|problem| ("node", problem))?;
    table(faces, "faces", |row, mut words| {
        if let Row::Head = row {
            return Ok(());
        }
        let n = loaded.mesh.vertices.len();
        let mut corners = [0; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let index: i64 = number(words.next().ok_or_else(|| format!("a face of {i} corners"))?)?;
            *corner = check_index(index.saturating_sub(base), n)
                .map_err(|_| format!("point {index} of {n} from {base} on"))?;
        }
        loaded.polygon(&corners)
    })
    .map_err(|problem| ("face", problem))?;
    Ok(loaded)
}

enum Row {
    /// The line with the number of rows.
    Head,
    /// The row that is numbered so.
    First(i64),
    Other,
}

/// A line of counts, then as many rows, each begun by its number.
fn table(
    input: impl BufRead,
    what: &str,
    mut each: impl FnMut(Row, std::str::SplitAsciiWhitespace) -> Result<(), String>,
) -> Result<(), String> {
    let mut count: Option<u64> = None;
    let (mut n, mut first) = (0, 0);
    let data = |line: &[u8]| line.iter().position(|b| *b == b'#').unwrap_or(line.len());
    lines(input, data, |line| {
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { return Ok(()) };
        let Some(count) = count else {
            count = Some(number(word)?);
            return each(Row::Head, words);
        };
        if n == count {
            return Err(format!("more than the {count} {what} that the first line says"));
        }
        let index: i64 = number(word)?;
        let row = if n == 0 { Row::First(index) } else { Row::Other };
        match row {
            Row::First(0 | 1) => first = index,
            Row::First(_) => return Err(format!("{what} begin with {index}, not 0 or 1")),
            _ if index != first + n as i64 => return Err(format!("{index} where {} is expected", first + n as i64)),
            _ => {}
        }
        n += 1;
        each(row, words)
    })?;
    match count {
        Some(count) if count == n => Ok(()),
        Some(count) => Err(format!("the file ends after {n} of {count} {what}")),
        None => Err(format!("has no number of {what}")),
    }
}
