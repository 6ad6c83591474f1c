//! Scenes by name and by file: `sunfleck scenes`, `sunfleck export`, and what SCENE means.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use sunfleck::scene::Scene;

use crate::cli::ExportArgs;
use crate::shim::{self, NAMES, Settings};

/// What SCENE stands for: a scene file or a shipped name, and the settings that come with it.
pub fn resolve(scene: &str) -> Result<(PathBuf, Settings)> {
    let path = Path::new(scene);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let settings = Settings::load(path).with_context(|| scene.to_owned())?;
        let file = settings.scene.clone().with_context(|| format!("{scene}: scene: no scene is named"))?;
        return Ok((file, settings));
    }
    if !is_shipped(path) && path.extension().is_none() && !path.exists() {
        let close = NAMES.iter().map(|(name, _)| *name).find(|name| distance(name, scene) <= 2);
        let hint = close.map_or(String::new(), |name| format!("did you mean {name}? "));
        let names: Vec<_> = NAMES.iter().map(|(name, _)| *name).collect();
        bail!("{scene}: neither a file nor a scene that comes with sunfleck ({hint}there are: {})", names.join(", "));
    }
    Ok((path.to_owned(), Settings::default()))
}

/// Reads a scene file, or makes a shipped scene; with what was not honoured.
pub fn load(file: &Path) -> Result<(Scene, Vec<String>)> {
    if is_shipped(file)
        && let Some(scene) = shim::shipped(&file.to_string_lossy())
    {
        return Ok((scene, vec![]));
    }
    let loaded = sunfleck::scene::load::load(file)?;
    Ok((loaded.scene, loaded.warnings))
}

/// A file of that name comes first.
fn is_shipped(path: &Path) -> bool {
    !path.exists() && NAMES.iter().any(|(name, _)| Path::new(name) == path)
}

/// Letters to add, drop or change (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.chars().enumerate() {
            let changed = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.chars().count()]
}

pub fn list() -> Result<ExitCode> {
    for (name, what) in NAMES {
        crate::print(&format!("{name:<10} {what}"));
    }
    Ok(ExitCode::SUCCESS)
}

pub fn export(args: &ExportArgs) -> Result<ExitCode> {
    bail!("{}: to come", args.output.display())
}

#[cfg(test)]
mod tests {
    use super::distance;

    #[test]
    fn distances() {
        assert_eq!(distance("glass", "glass"), 0);
        assert_eq!(distance("glass", "glas"), 1);
        assert_eq!(distance("cornell", "cornel box"), 4);
        assert_eq!(distance("", "pool"), 4);
    }
}
