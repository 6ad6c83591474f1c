//! Settings as text: reading a file, and overriding single fields.

use super::{Settings, SettingsError, Wrong};
use crate::scene::load::files::read_regular;
use std::path::Path;
use toml::de::DeTable;
use toml::{Table, Value};

/// Fields that hold tables, and whether an override may call these by their name.
const LISTS: [(&str, bool); 4] = [("material", true), ("scene_light", true), ("sphere", false), ("light", false)];

impl Settings {
    /// Reads a settings file and checks every value by itself.
    pub fn load(path: &Path) -> Result<Self, SettingsError> {
        /// A settings file is written by hand.
        const MAX_BYTES: u64 = 16 << 20;
        let unreadable = |problem| SettingsError::Unreadable { file: path.into(), problem };
        let bytes = read_regular(path, MAX_BYTES).map_err(unreadable)?;
        let text = String::from_utf8(bytes).map_err(|_| unreadable("is not UTF-8 text".into()))?;
        Self::parse(&text, path)
    }

    /// Reads the text of a settings file; `file` is for messages.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SettingsError> {
        let wrong = |offset: Option<usize>, field: String, problem: String| {
            let line =
                text.as_bytes()[..offset.unwrap_or(0).min(text.len())].iter().filter(|&&b| b == b'\n').count() + 1;
            SettingsError::File { file: file.into(), line, field, problem }
        };
        let deserializer = toml::Deserializer::parse(text).map_err(|e| {
            let offset = e.span().map(|span| span.start);
            let line =
                text.get(..offset.unwrap_or(0)).and_then(|before| text.lines().nth(before.matches('\n').count()));
            wrong(offset, "TOML".into(), format!("{}: {:.80?}", e.message(), line.unwrap_or("").trim()))
        })?;
        let settings: Self = serde_path_to_error::deserialize(deserializer).map_err(|e| {
            let field = e.path().to_string();
            let span = e.inner().span().map(|span| span.start).or_else(|| offset_of(text, &field));
            wrong(span, field, e.inner().message().into())
        })?;
        settings.check_values().map_err(|(field, problem)| wrong(offset_of(text, &field), field, problem))?;
        Ok(settings)
    }

    /// Overrides one field: `camera.yfov_degrees=40`, `photons=2M`, `sphere.0.radius=0.5`, `material.floor.roughness=0.2`.
    ///
    /// The value is TOML, or else text; nothing after `=` takes the field out. Of the lists (`[[sphere]]` and the like),
    /// the number after the last adds one (`sphere.0={centre=[0, 1, 0], radius=0.2}` where there is none), and so does
    /// a name that is not there yet in `material` and `scene_light`. Odd names are quoted: `material."a.b".ior=1.3`.
    pub fn set(&mut self, assignment: &str) -> Result<(), SettingsError> {
        let wrong = |(field, problem): Wrong| SettingsError::Field { field, problem };
        let (key, value) = split(assignment)
            .ok_or_else(|| wrong((assignment.into(), "an override has the form field=value".into())))?;
        let of_key = |problem| wrong((key.into(), problem));
        let mut root = Value::try_from(&*self).map_err(|e| of_key(e.to_string()))?;
        let parts = key_parts(key);
        match value {
            "" => remove(&mut root, &parts).map_err(of_key)?,
            _ => *entry(&mut root, &parts).map_err(of_key)? = read_value(value),
        }
        let changed: Self = serde_path_to_error::deserialize(root).map_err(|e| {
            let field = e.path().to_string();
            wrong((field, e.inner().message().into()))
        })?;
        changed.check_values().map_err(wrong)?;
        *self = changed;
        Ok(())
    }
}

/// What an override sets: TOML, or else text.
pub(super) fn read_value(text: &str) -> Value {
    match toml::from_str::<Table>(&format!("v = {text}")) {
        Ok(mut table) if table.len() == 1 => table.remove("v"),
        _ => None,
    }
    .unwrap_or_else(|| Value::String(text.into()))
}

/// Whether a field holds a list of tables.
pub(super) fn is_list(field: &str) -> bool {
    LISTS.iter().any(|(list, _)| *list == field)
}

/// Key and value around the first `=` that is not in quotes.
fn split(assignment: &str) -> Option<(&str, &str)> {
    let (mut quote, mut escaped) = (None, false);
    let place = assignment.char_indices().find(|&(_, c)| {
        let was_escaped = std::mem::take(&mut escaped);
        match quote {
            Some('"') if c == '\\' && !was_escaped => escaped = true,
            Some(open) if c == open && !was_escaped => quote = None,
            None if c == '"' || c == '\'' => quote = Some(c),
            _ => {}
        }
        quote.is_none() && c == '='
    });
    let (key, value) = assignment.split_at(place?.0);
    Some((key.trim(), value[1..].trim()))
}

/// The parts of a dotted key, quotes taken off.
fn key_parts(key: &str) -> Vec<String> {
    // Not a key of TOML: `material.red wall.ior`.
    let plain = || key.split('.').map(str::to_owned).collect();
    let Ok(mut table) = toml::from_str::<Table>(&format!("{key} = 0")) else { return plain() };
    let mut parts = Vec::new();
    loop {
        let mut items = std::mem::take(&mut table).into_iter();
        match (items.next(), items.next()) {
            (Some((part, value)), None) => {
                parts.push(part);
                match value {
                    Value::Table(inner) => table = inner,
                    Value::Integer(0) => return parts,
                    _ => return plain(),
                }
            }
            _ => return plain(),
        }
    }
}

/// The value at a key; tables on the way are made.
fn entry<'v>(root: &'v mut Value, parts: &[String]) -> Result<&'v mut Value, String> {
    let mut value = root;
    for (depth, part) in parts.iter().enumerate() {
        value = match value {
            Value::Table(table) => table.entry(part.as_str()).or_insert_with(|| match depth == 0 && is_list(part) {
                true => Value::Array(Vec::new()),
                false => Value::Table(Table::new()),
            }),
            Value::Array(list) => {
                let named = LISTS.contains(&(parts[0].as_str(), true));
                let found = match (depth, part.parse::<usize>()) {
                    (1, Err(_)) if named && !list.iter().any(|item| has_name(item, part)) => {
                        list.push(Value::Table(Table::from_iter([("name".to_owned(), Value::String(part.clone()))])));
                        list.len() - 1
                    }
                    (1, Ok(new)) if is_list(&parts[0]) && new == list.len() => {
                        list.push(Value::Table(Table::new()));
                        new
                    }
                    _ => position(list, part)?,
                };
                &mut list[found]
            }
            _ => return Err(format!("{part:?} is not a field")),
        };
    }
    Ok(value)
}

/// Takes out the value at a key.
fn remove(root: &mut Value, parts: &[String]) -> Result<(), String> {
    let unset = || "is not set, so it cannot be taken out".to_owned();
    let (last, before) = parts.split_last().ok_or_else(unset)?;
    let mut value = root;
    for part in before {
        value = match value {
            Value::Table(table) => table.get_mut(part).ok_or_else(unset)?,
            Value::Array(list) => {
                let found = position(list, part)?;
                &mut list[found]
            }
            _ => return Err(unset()),
        };
    }
    match value {
        Value::Table(table) => table.remove(last).map(|_| ()).ok_or_else(unset),
        Value::Array(list) => {
            list.remove(position(list, last)?);
            Ok(())
        }
        _ => Err(unset()),
    }
}

/// Which item of a list is meant by a number or a name.
fn position(list: &[Value], part: &str) -> Result<usize, String> {
    let n = list.len();
    match part.parse::<usize>() {
        Ok(index) if index < n => Ok(index),
        Ok(index) => Err(format!("there is no number {index}: the settings have {n} of these, counted from 0")),
        Err(_) => {
            let found = list.iter().position(|item| has_name(item, part));
            found.ok_or_else(|| format!("{part:?} is neither a number nor a name here: the settings have {n} of these"))
        }
    }
}

fn has_name(item: &Value, name: &str) -> bool {
    item.get("name").and_then(Value::as_str) == Some(name)
}

/// Where in the text the value of a dotted field begins, or the innermost table around it.
fn offset_of(text: &str, field: &str) -> Option<usize> {
    let table = DeTable::parse(text).ok()?;
    let mut offset = None;
    let mut value: Option<&toml::de::DeValue> = None;
    // As serde_path_to_error writes them: a.b[0].c
    for part in field.split(['.', '[', ']']).filter(|part| !part.is_empty()) {
        let next = match (value, part.parse::<usize>()) {
            (None, _) => table.get_ref().get(part),
            (Some(toml::de::DeValue::Array(list)), Ok(index)) => list.get(index),
            (Some(toml::de::DeValue::Table(table)), _) => table.get(part),
            _ => None,
        };
        let Some(next) = next else { break };
        offset = Some(next.span().start);
        value = Some(next.get_ref());
    }
    offset
}
