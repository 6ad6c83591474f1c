//! PLY, by way of `ply-rs-bw`.
//!
//! The crate bounds what it allocates by itself. Two things it does not tell are looked for here: a count that the file's
//! size belies, and a property named twice, which it takes for one and then misreads every row.

use std::io::{BufRead, Chain, Cursor, Read};

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType};

use super::{plain, shorten};

/// Bytes of a header, at most.
const MAX_HEADER: u64 = 1 << 20;
/// Rows of an element, at most: indices are written as PLY's `int`.
const MAX_ROWS: u64 = i32::MAX as u64;

/// An element that is not wanted: takes no memory.
pub struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

/// What comes behind the header.
pub type Payload<R> = Reader<Chain<Cursor<Vec<u8>>, R>>;

/// The header, and what comes behind it.
pub fn read_header<R: BufRead>(mut input: R) -> Result<(Header, Payload<R>), String> {
    let text = header_text(&mut input)?;
    let mut reader = Reader::new(Cursor::new(text).chain(input));
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| in_words(&e, "the header"))?;
    Ok((header, reader))
}

/// Leaves an element out.
pub fn skip<R: BufRead>(reader: &mut Payload<R>, element: &ElementDef, header: &Header) -> Result<(), String> {
    if element.properties.is_empty() && header.encoding != Encoding::Ascii {
        return Ok(());
    }
    let skipped = Parser::<Skipped>::new().read_payload_for_element(reader, element, header);
    skipped.map(drop).map_err(|e| in_words(&e, &format!("element {}", shorten(&element.name))))
}

/// Reads the rows of an element; an error names the row as a `what`.
pub fn rows<R: BufRead, Row: PropertyAccess>(
    reader: &mut Payload<R>,
    element: &ElementDef,
    header: &Header,
    what: &str,
) -> Result<Vec<Row>, String> {
    let first = reader.line();
    Parser::<Row>::new().read_payload_for_element(reader, element, header).map_err(|e| {
        let place = match e.line().filter(|_| header.encoding != Encoding::Ascii) {
            Some(line) => format!("{what} {} of {}", line.saturating_sub(first), element.count),
            None => format!("a {what} of {} properties is expected", element.properties.len()),
        };
        in_words(&e, &place)
    })
}

/// Up to and including `end_header`.
fn header_text(input: &mut impl BufRead) -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    let mut input = Read::take(input, MAX_HEADER);
    let (mut line, mut element, mut names) = (Vec::new(), String::new(), Vec::new());
    for at in 1.. {
        line.clear();
        let n = input.read_until(b'\n', &mut line).map_err(|e| plain(&e))?;
        // Comments may be in any encoding that keeps ASCII.
        let words = String::from_utf8_lossy(&line);
        text.extend_from_slice(words.as_bytes());
        let words: Vec<&str> = words.split_ascii_whitespace().collect();
        if at == 1 && words != ["ply"] {
            return Err("does not begin with a line \"ply\": not a PLY file".into());
        }
        match words[..] {
            ["end_header"] if line.ends_with(b"\n") => return Ok(text),
            ["element", name, ..] => {
                if names.iter().any(|n: &String| n == name) {
                    return Err(format!("line {at}: a second element {}", shorten(name)));
                }
                names.push(name.to_owned());
                element = name.to_owned();
            }
            ["property", .., name] => {
                // With the element's name, which holds no blank, before it.
                let name = format!("{element} {name}");
                if names.contains(&name) {
                    return Err(format!("line {at}: a second property {}", shorten(&name)));
                }
                names.push(name);
            }
            _ => {}
        }
        if n == 0 {
            return Err(match input.limit() {
                0 => format!("a header of more than {} KiB", MAX_HEADER >> 10),
                _ => "the file ends before end_header".into(),
            });
        }
    }
    Ok(text)
}

/// Refuses more rows than the file can hold.
pub fn check_count(element: &ElementDef, is_ascii: bool, size: u64) -> Result<(), String> {
    let of_scalar = |t: &ScalarType| match t {
        _ if is_ascii => 2,
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let of_property = |p: &PropertyDef| match &p.data_type {
        PropertyType::Scalar(t) | PropertyType::List(t, _) => of_scalar(t),
    };
    let row: u64 = element.properties.values().map(of_property).sum();
    let row = if is_ascii { row.max(1) } else { row };
    let name = shorten(&element.name);
    if u128::from(row) * element.count as u128 > u128::from(size) + 1 {
        return Err(format!(
            "the header promises {} of element {name}, at least {row} bytes each, in a file of {size} bytes",
            element.count
        ));
    }
    if row > 0 && element.count as u64 > MAX_ROWS {
        return Err(format!("{} of element {name}: at most {MAX_ROWS} are read", element.count));
    }
    Ok(())
}

/// The crate's errors quote whole lines and Rust types: the line number and the kind say it shorter.
pub fn in_words(error: &ParseError, what: &str) -> String {
    use std::io::ErrorKind;
    let line = error
        .line()
        .filter(|_| !what.starts_with("vertex ") && !what.starts_with("face "))
        .map_or(String::new(), |n| format!("line {n}: "));
    match error.kind() {
        ErrorKind::UnexpectedEof => format!("{line}the file ends too early: {what}"),
        ErrorKind::InvalidInput | ErrorKind::InvalidData => format!("{line}cannot be understood: {what}"),
        kind => format!("{line}{kind}: {what}"),
    }
}

/// Not a list.
pub fn is_scalar(property: &PropertyDef) -> bool {
    matches!(property.data_type, PropertyType::Scalar(_))
}
