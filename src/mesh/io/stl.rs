//! STL, binary and as text. `stl_io` reads text in single precision; here it keeps its digits.

use std::io::{BufRead, Read};

use super::{Loaded, MAX_FACES};
use crate::files::{lines, number, plain};
use crate::mesh::Mesh;

/// Before the facets of a binary file: 80 bytes of anything, and how many facets there are.
const HEAD: usize = 84;
/// Bytes of a facet: normal, three corners, two bytes of anything.
const FACET: usize = 50;

/// Facets of a file of `size` bytes, of all its solids; the stored normals are passed over: the order of the corners says where
/// a facet looks. Binary is what has the size that its head says.
pub fn read_stl(mut input: impl BufRead, size: u64) -> Result<Loaded, String> {
    let mut head = Vec::with_capacity(HEAD);
    Read::take(&mut input, HEAD as u64).read_to_end(&mut head).map_err(|e| plain(&e))?;
    let n = match head.get(HEAD - 4..) {
        Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    };
    let is_binary = head.len() == HEAD && size == HEAD as u64 + FACET as u64 * u64::from(n);
    // Binary heads may say so, too.
    let is_solid = head.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let is_text = head.iter().all(|b| !b.is_ascii_control() || b.is_ascii_whitespace());
    if is_binary {
        binary(input, n as usize)
    } else if is_solid && (is_text || head.len() < HEAD) {
        text((&head[..]).chain(input))
    } else if head.len() < HEAD {
        Err(format!("neither begins with \"solid\" nor has the {HEAD} bytes that a binary STL begins with"))
    } else {
        let promised = HEAD as u64 + FACET as u64 * u64::from(n);
        Err(format!("the head promises {n} facets, which makes {promised} bytes, in a file of {size} bytes"))
    }
}

fn binary(mut input: impl Read, n: usize) -> Result<Loaded, String> {
    check_count(n)?;
    let mut loaded = Loaded::default();
    let mut facet = [0; FACET];
    for at in 0..n {
        input.read_exact(&mut facet).map_err(|e| format!("facet {at} of {n}: {}", plain(&e)))?;
        for corner in facet[12..48].chunks_exact(12) {
            let mut p = [0.0; 3];
            for (x, bytes) in p.iter_mut().zip(corner.chunks_exact(4)) {
                *x = f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
            }
            loaded.vertex(p).map_err(|problem| format!("facet {at}: {problem}"))?;
        }
    }
    Ok(facets(loaded.mesh))
}

fn text(input: impl BufRead) -> Result<Loaded, String> {
    let mut loaded = Loaded::default();
    let mut is_inside = false;
    lines(input, <[u8]>::len, |line| {
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { return Ok(()) };
        match word.to_ascii_lowercase().as_str() {
            "solid" => is_inside = true,
            "endsolid" => is_inside = false,
            "vertex" => {
                let mut p = [0.0; 3];
                for (axis, x) in p.iter_mut().enumerate() {
                    *x = number(words.next().ok_or_else(|| format!("a vertex of {axis} numbers"))?)?;
                }
                loaded.vertex(p)?;
            }
            "endloop" => {
                loaded.n_polygons += 1;
                check_count(loaded.n_polygons)?;
                let n = loaded.mesh.vertices.len() as i64 - 3 * (loaded.n_polygons as i64 - 1);
                if n != 3 {
                    return Err(format!("a facet of {n} corners"));
                }
            }
            "facet" | "endfacet" | "outer" => {}
            _ => return Err(format!("{:?} is none of the words of STL", crate::files::shorten(word))),
        }
        Ok(())
    })?;
    if is_inside || loaded.mesh.vertices.len() != 3 * loaded.n_polygons {
        return Err("the file ends before endsolid".into());
    }
    Ok(facets(loaded.mesh))
}

fn check_count(n: usize) -> Result<(), String> {
    if n > MAX_FACES { Err(format!("more than {MAX_FACES} facets")) } else { Ok(()) }
}

/// Three vertices each.
fn facets(mesh: Mesh) -> Loaded {
    let n = mesh.vertices.len() as u32 / 3;
    Loaded::of_triangles(Mesh { faces: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), ..mesh })
}
