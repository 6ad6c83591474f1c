//! OFF: the format of Geomview, as text.

use std::io::BufRead;

use super::{Loaded, check_index};
use crate::files::{lines, number, shorten};

/// What comes next; of vertices there is at least one left.
enum Expected {
    Magic,
    Counts,
    Vertices { left: u64, faces: u64 },
    Faces { left: u64 },
}

impl Expected {
    fn vertices(left: u64, faces: u64) -> Self {
        if left == 0 { Self::Faces { left: faces } } else { Self::Vertices { left, faces } }
    }
}

/// Vertices and polygons; normals, colours and texture coordinates are passed over. A line each; `#` begins a comment.
pub fn read_off(input: impl BufRead) -> Result<Loaded, String> {
    let mut loaded = Loaded::default();
    let mut expected = Expected::Magic;
    let data = |line: &[u8]| line.iter().position(|b| *b == b'#').unwrap_or(line.len());
    lines(input, data, |line| {
        let mut words = line.split_ascii_whitespace().peekable();
        if words.peek().is_none() {
            return Ok(());
        }
        if let Expected::Magic = expected {
            let magic = words.next().unwrap_or("");
            match magic {
                "OFF" | "COFF" | "NOFF" | "CNOFF" | "STOFF" | "STCOFF" | "STNOFF" | "STCNOFF" => {}
                _ if magic.ends_with("OFF") => return Err(format!("{:?} is not read: OFF is", shorten(magic))),
                _ => return Err("does not begin with OFF: not an OFF file".into()),
            }
            expected = Expected::Counts;
            match words.peek() {
                None => return Ok(()),
                Some(&"BINARY") => return Err("binary OFF is not read".into()),
                Some(_) => {}
            }
        }
        expected = match expected {
            Expected::Magic | Expected::Counts => {
                let mut count = || number::<u64>(words.next().ok_or("numbers of vertices and of faces are expected")?);
                Expected::vertices(count()?, count()?)
            }
            Expected::Vertices { left, faces } => {
                let mut p = [0.0; 3];
                for (axis, x) in p.iter_mut().enumerate() {
                    *x = number(words.next().ok_or_else(|| format!("a vertex of {axis} numbers"))?)?;
                }
                loaded.vertex(p)?;
                Expected::vertices(left - 1, faces)
            }
            Expected::Faces { left: 0 } => return Err("the file goes on after the last face".into()),
            Expected::Faces { left } => {
                face(&mut words, &mut loaded)?;
                Expected::Faces { left: left - 1 }
            }
        };
        Ok(())
    })?;
    match expected {
        Expected::Faces { left: 0 } => Ok(loaded),
        Expected::Magic | Expected::Counts => Err("the file ends before the numbers of vertices and faces".into()),
        Expected::Vertices { left, .. } => Err(format!("the file ends {left} vertices too early")),
        Expected::Faces { left } => Err(format!("the file ends {left} faces too early")),
    }
}

fn face<'a>(words: &mut impl Iterator<Item = &'a str>, loaded: &mut Loaded) -> Result<(), String> {
    let n: usize = number(words.next().unwrap_or(""))?;
    let n_vertices = loaded.mesh.vertices.len();
    // Colours may follow.
    let corners = words.take(n).map(|word| check_index(number(word)?, n_vertices));
    let corners: Vec<u32> = corners.collect::<Result<_, String>>()?;
    if corners.len() < n {
        return Err(format!("{} indices of {n}", corners.len()));
    }
    loaded.polygon(&corners)
}
