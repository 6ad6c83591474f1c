//! Settings written as a file, and what turns one into another.

use super::text::{is_list, read_value};
use super::{CameraSettings, Settings};
use crate::scene::{Camera, Projection};
use glam::Vec3;
use toml::{Table, Value};

impl Settings {
    /// The settings file that says this.
    ///
    /// Reading it gives the same settings; fields are in the order of [`Settings`], numbers as short as they can be.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, text, lists and tables, which TOML has")
    }

    /// The overrides for [`Settings::set`], in order, that turn `base` into these settings; none if they are equal.
    ///
    /// They are short where that is possible: a field of a table rather than the table, a name rather than a number.
    /// Both settings have to be valid.
    pub fn difference(&self, base: &Self) -> Vec<String> {
        let (from, to) = (base.table(), self.table());
        let mut pairs = Vec::new();
        let mut now = base.clone();
        let mut keys: Vec<&String> = from.keys().chain(to.keys()).collect();
        keys.sort_unstable();
        keys.dedup();
        for key in keys {
            let list = |table: &Table| table.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
            let mut change = Change { now: &mut now, pairs: &mut pairs };
            match (from.get(key), to.get(key)) {
                _ if is_list(key) => change.list(key, &list(&from), &list(&to)),
                (before, Some(Value::Table(after))) => {
                    let nothing = Table::new();
                    let before = before.and_then(Value::as_table).unwrap_or(&nothing);
                    let wanted = Value::Table(after.clone());
                    change.table(key, key, before, &wanted, |table| table.get(key).cloned());
                }
                (Some(_), None) => change.add(format!("{key}=")),
                (before, Some(after)) if before != Some(after) => change.add(pair(key, after)),
                _ => {}
            }
        }
        pairs
    }

    /// What these settings were changed to since a file said `before`, over what it says `now`.
    ///
    /// A field that differs from `before` stays as it is here; tables are taken as wholes, and so are changes of a material
    /// or of a light, each by the name or the number that it is of.
    pub fn rebased(&self, before: &Self, now: &Self) -> Self {
        let (mine, before, mut rebased) = (self.table(), before.table(), now.table());
        let mut keys: Vec<&String> = mine.keys().chain(before.keys()).collect();
        keys.sort_unstable();
        keys.dedup();
        for key in keys {
            let value = match key.as_str() {
                "material" | "scene_light" => {
                    let items = |table: &Table| table.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
                    Some(Value::Array(rebased_items(&items(&mine), &items(&before), items(&rebased))))
                }
                _ if mine.get(key) == before.get(key) => continue,
                _ => mine.get(key).cloned(),
            };
            match value {
                Some(value) => rebased.insert(key.clone(), value),
                None => rebased.remove(key),
            };
        }
        // Each value is one of three settings that are valid.
        rebased.try_into().unwrap_or_else(|_| self.clone())
    }

    fn table(&self) -> Table {
        let mut table = Table::try_from(self).expect("numbers, text, lists and tables, which TOML has");
        for (key, value) in &mut table {
            // The one field of double precision.
            if key != "seconds" {
                shorten(value);
            }
        }
        table
    }
}

/// See [`Settings::rebased`].
fn rebased_items(mine: &[Value], before: &[Value], mut now: Vec<Value>) -> Vec<Value> {
    let of = |item: &Value| (item.get("name").cloned(), item.get("index").cloned());
    let all = |items: &[Value], like: &Value| -> Vec<Value> {
        items.iter().filter(|item| of(item) == of(like)).cloned().collect()
    };
    let mut done: Vec<Value> = vec![];
    for item in mine.iter().chain(before) {
        if !all(&done, item).is_empty() {
            continue;
        }
        done.push(item.clone());
        let (is, was) = (all(mine, item), all(before, item));
        if is != was {
            let at = now.iter().position(|other| of(other) == of(item)).unwrap_or(now.len());
            now.retain(|other| of(other) != of(item));
            now.splice(at..at, is);
        }
    }
    now
}

/// Overrides on the way from one value to another, each tried as it is added.
struct Change<'a> {
    now: &'a mut Settings,
    pairs: &'a mut Vec<String>,
}

impl Change<'_> {
    fn add(&mut self, pair: String) {
        // A failure would be one of the settings asked for, and is said by whoever uses them.
        let _ = self.now.set(&pair);
        self.pairs.push(pair);
    }

    /// Field by field under `prefix`, unless a value on the way would be refused; else all at once at `key`.
    fn table(
        &mut self,
        key: &str,
        prefix: &str,
        before: &Table,
        after: &Value,
        place: impl Fn(&Table) -> Option<Value>,
    ) {
        if place(&self.now.table()).as_ref() == Some(after) {
            return;
        }
        let nothing = Table::new();
        let fields = after.as_table().unwrap_or(&nothing);
        let gone = before.keys().filter(|field| !fields.contains_key(*field)).map(|field| format!("{prefix}.{field}="));
        let changed = fields.iter().filter(|(field, value)| before.get(*field) != Some(value));
        let pairs: Vec<String> =
            gone.chain(changed.map(|(field, value)| pair(&format!("{prefix}.{field}"), value))).collect();
        let mut next = self.now.clone();
        if pairs.iter().all(|pair| next.set(pair).is_ok()) && place(&next.table()).as_ref() == Some(after) {
            *self.now = next;
            self.pairs.extend(pairs);
        } else {
            self.add(pair(key, after));
        }
    }

    fn list(&mut self, key: &str, before: &[Value], after: &[Value]) {
        for i in (after.len()..before.len()).rev() {
            self.add(format!("{key}.{i}="));
        }
        for (i, wanted) in after.iter().enumerate() {
            let was = before.get(i);
            let old = was.and_then(Value::as_table).cloned().unwrap_or_default();
            let at = format!("{key}.{i}");
            let by_name = usable_name(wanted, after).filter(|name| match was {
                Some(was) => usable_name(was, before) == Some(name),
                None => true,
            });
            let prefix = by_name.map_or_else(|| at.clone(), |name| format!("{key}.{}", key_part(name)));
            let place = |table: &Table| table.get(key).and_then(Value::as_array).and_then(|list| list.get(i)).cloned();
            match (was, by_name, wanted.as_table()) {
                // The name in the key makes the item.
                (None, Some(name), Some(table)) if table.len() > 1 => {
                    let old = Table::from_iter([("name".to_owned(), Value::String(name.to_owned()))]);
                    self.table(&at, &prefix, &old, wanted, place);
                }
                (None, ..) => self.add(pair(&at, wanted)),
                _ => self.table(&at, &prefix, &old, wanted, place),
            }
        }
    }
}

/// The item's name, if it means this item only.
fn usable_name<'v>(item: &'v Value, list: &[Value]) -> Option<&'v str> {
    let name = item.get("name")?.as_str()?;
    let n = list.iter().filter(|other| other.get("name").and_then(Value::as_str) == Some(name)).count();
    (n == 1 && name.parse::<usize>().is_err()).then_some(name)
}

/// As a part of a dotted key, quoted where TOML asks for it.
fn key_part(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    if bare { name.to_owned() } else { Escaped(name).to_string() }
}

/// A basic string of TOML on one line.
struct Escaped<'a>(&'a str);

impl std::fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("\"")?;
        for c in self.0.chars() {
            match c {
                '"' | '\\' => write!(f, "\\{c}")?,
                c if c.is_control() => write!(f, "\\u{:04X}", u32::from(c))?,
                c => write!(f, "{c}")?,
            }
        }
        f.write_str("\"")
    }
}

fn pair(key: &str, value: &Value) -> String {
    match value {
        // Text needs no quotes where it cannot be taken for anything else.
        Value::String(text) if !text.is_empty() && text.trim() == text && read_value(text) == *value => {
            format!("{key}={text}")
        }
        _ => format!("{key}={value}"),
    }
}

/// Rewrites what was an f32 as the shortest decimal that reads as that f32: 0.3 rather than 0.30000001192092896.
fn shorten(value: &mut Value) {
    match value {
        Value::Float(v) => *v = (*v as f32).to_string().parse().unwrap_or(*v),
        Value::Array(list) => list.iter_mut().for_each(shorten),
        Value::Table(table) => table.iter_mut().for_each(|(_, value)| shorten(value)),
        _ => {}
    }
}

impl From<&Camera> for CameraSettings {
    /// Says all of a camera but its name and aspect ratio, so that any camera of a scene becomes this one.
    fn from(camera: &Camera) -> Self {
        let m = &camera.world_from_camera;
        let (yfov_degrees, ymag) = match camera.projection {
            Projection::Perspective { yfov } => (Some(yfov.to_degrees()), None),
            Projection::Orthographic { ymag } => (None, Some(ymag)),
        };
        Self {
            position: Some(Vec3::from(m.translation).to_array()),
            forward: Some((-Vec3::from(m.matrix3.z_axis)).to_array()),
            up: Some(Vec3::from(m.matrix3.y_axis).to_array()),
            yfov_degrees,
            ymag,
            aperture_radius: Some(camera.aperture_radius),
            focus_distance: Some(camera.focus_distance),
            ..Self::default()
        }
    }
}
