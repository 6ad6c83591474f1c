//! The scene file and the files it names: only regular files, only in the scene file's folder.

use super::{LoadError, MAX_FILE_BYTES};
use crate::device::Interrupt;
use percent_encoding::percent_decode_str;
use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

const OUTSIDE: &str = "lies outside the folder of the scene file";

/// The scene file, for messages, and the folder that everything it names lies in.
pub(super) struct Source {
    file: PathBuf,
    /// Canonical.
    folder: PathBuf,
    interrupt: Interrupt,
}

impl Source {
    /// Reads the scene file.
    pub(super) fn open(path: &Path, interrupt: &Interrupt) -> Result<(Self, Vec<u8>), LoadError> {
        let unreadable = |problem| LoadError::Unreadable { file: path.into(), problem };
        let bytes = read_regular(path, MAX_FILE_BYTES).map_err(unreadable)?;
        let parent = match path.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let folder = parent.canonicalize().map_err(|e| unreadable(e.to_string()))?;
        let source = Self { file: path.into(), folder, interrupt: interrupt.clone() };
        source.go_on()?;
        Ok((source, bytes))
    }

    /// Error: nobody wants the scene any more.
    pub(super) fn go_on(&self) -> Result<(), LoadError> {
        self.interrupt.check().map_err(|_| LoadError::Interrupted)
    }

    /// Error: the file is not what it should be.
    pub(super) fn format(&self, problem: impl Into<String>) -> LoadError {
        LoadError::Format { file: self.file.clone(), problem: problem.into() }
    }

    /// Error: the field or line `place` is wrong.
    pub(super) fn invalid(&self, place: impl Into<String>, problem: impl Into<String>) -> LoadError {
        LoadError::Invalid { file: self.file.clone(), place: place.into(), problem: problem.into() }
    }

    /// Error: the field or line `place` asks for more than a limit.
    pub(super) fn too_large(&self, place: impl Into<String>, problem: impl Into<String>) -> LoadError {
        LoadError::TooLarge { file: self.file.clone(), place: place.into(), problem: problem.into() }
    }

    /// Error: an extension is required that is not supported.
    pub(super) fn extension(&self, extension: &str, hint: &'static str) -> LoadError {
        LoadError::Extension { file: self.file.clone(), extension: extension.into(), hint }
    }

    /// Error: the file `path`, named at `place`, cannot be used.
    pub(super) fn external(&self, place: &str, path: &str, problem: impl Into<String>) -> LoadError {
        LoadError::External {
            file: self.file.clone(),
            place: place.into(),
            path: shorten(path).into(),
            problem: problem.into(),
        }
    }

    /// The bytes of a `data:` URI or of the file that a percent-encoded relative URI names.
    pub(super) fn read_uri(&self, place: &str, uri: &str) -> Result<Vec<u8>, LoadError> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decode_data_uri(data).map_err(|problem| self.invalid(place, problem));
        }
        if let Some((scheme, _)) = uri.split_once(':')
            && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
        {
            return Err(self.external(place, uri, "only data: URIs and paths relative to the file are read"));
        }
        let path = percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| self.external(place, uri, "the percent-encoded bytes are not UTF-8"))?;
        match self.read(place, &path) {
            // A name that was not encoded although it holds a percent sign.
            Err(e) if path != uri => self.read(place, uri).map_err(|_| e),
            result => result,
        }
    }

    /// The bytes of the file at `name`, relative to the scene file's folder.
    pub(super) fn read(&self, place: &str, name: &str) -> Result<Vec<u8>, LoadError> {
        let path = self.resolve(name).map_err(|problem| self.external(place, name, problem))?;
        read_regular(&path, MAX_FILE_BYTES).map_err(|problem| self.external(place, name, problem))
    }

    /// Whether `name` could be read but for nothing being there.
    pub(super) fn is_missing(&self, name: &str) -> bool {
        let missing = |path| fs::symlink_metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound);
        self.path_inside(name).is_ok_and(missing)
    }

    fn resolve(&self, name: &str) -> Result<PathBuf, String> {
        let path = self.path_inside(name)?.canonicalize().map_err(|e| e.to_string())?;
        // Links may lead anywhere.
        if path.starts_with(&self.folder) { Ok(path) } else { Err(OUTSIDE.into()) }
    }

    /// Where `name` leads if nothing on the way is a link.
    fn path_inside(&self, name: &str) -> Result<PathBuf, String> {
        if name.is_empty() || name.contains('\0') {
            return Err("is not a file name".into());
        }
        // Files written on Windows.
        let name = name.replace('\\', "/");
        let mut depth = 0_i64;
        for component in Path::new(&name).components() {
            match component {
                Component::Normal(_) => depth += 1,
                Component::CurDir => {}
                Component::ParentDir => depth -= 1,
                Component::RootDir | Component::Prefix(_) => return Err(OUTSIDE.into()),
            }
            if depth < 0 {
                return Err(OUTSIDE.into());
            }
        }
        Ok(self.folder.join(name))
    }
}

/// Whether `path` is a regular file, before it is opened: opening a pipe would wait for a writer.
pub(super) fn check_regular(path: &Path) -> Result<(), String> {
    let metadata = fs::metadata(path).map_err(|e| e.to_string())?;
    if metadata.is_file() { Ok(()) } else { Err("is not a regular file".into()) }
}

/// The bytes of a regular file of at most `limit` bytes.
pub(in crate::scene) fn read_regular(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    check_regular(path)?;
    let file = File::open(path).map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    let too_large = || format!("is larger than {} MiB", limit >> 20);
    if length > limit {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length as usize).map_err(|e| e.to_string())?;
    file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > limit {
        return Err(too_large());
    }
    Ok(bytes)
}

/// RFC 2397, after the `data:`.
fn decode_data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (header, payload) = data.split_once(',').ok_or("a data URI without a comma")?;
    if header.trim_end().ends_with(";base64") {
        decode_base64(payload)
    } else {
        Ok(percent_decode_str(payload).collect())
    }
}

/// RFC 4648; white space and a missing padding are forgiven.
fn decode_base64(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut n_bits) = (0_u32, 0);
    for (i, c) in text.bytes().enumerate() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            _ if c.is_ascii_whitespace() => continue,
            _ => return Err(format!("character {i} of the base64 data is not base64")),
        };
        bits = bits << 6 | u32::from(value);
        n_bits += 6;
        if n_bits >= 8 {
            n_bits -= 8;
            bytes.push((bits >> n_bits) as u8);
            bits &= (1 << n_bits) - 1;
        }
    }
    Ok(bytes)
}

/// A hostile name need not fill the screen.
fn shorten(name: &str) -> String {
    const LIMIT: usize = 200;
    match name.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_rfc_4648() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8", "fo"), ("Zm9v", "foo"), ("Zm9v\nYmFy", "foobar")] {
            assert_eq!(decode_base64(text).unwrap(), bytes.as_bytes());
        }
        assert!(decode_base64("Zm9v*").is_err());
    }

    #[test]
    fn data_uri_without_base64() {
        assert_eq!(decode_data_uri("text/plain,a%20b").unwrap(), b"a b");
    }
}
