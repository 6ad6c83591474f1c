//! Scenes by name and by file: `sunfleck scenes`, `sunfleck export`, and what SCENE means.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use sunfleck::output::atomic;
use sunfleck::scene::Scene;
use sunfleck::scene::export::{self, glb_bytes};
use sunfleck::scene::shipped::{NAMES, shipped};

use crate::cli::{ExportArgs, Usage};
use crate::shim::Settings;

/// What SCENE stands for: a scene file or a shipped name, and the settings that come with it.
pub fn resolve(scene: &str) -> Result<(PathBuf, Settings)> {
    let path = Path::new(scene);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let settings = Settings::load(path).with_context(|| scene.to_owned())?;
        let file = settings.scene.clone().with_context(|| format!("{scene}: scene: no scene is named"))?;
        return Ok((file, settings));
    }
    if !is_shipped(path) && path.extension().is_none() && !path.exists() {
        let close = NAMES.into_iter().find(|name| distance(name, scene) <= 2);
        let hint = close.map_or(String::new(), |name| format!("did you mean {name}? "));
        bail!("{scene}: neither a file nor a scene that comes with sunfleck ({hint}there are: {})", NAMES.join(", "));
    }
    Ok((path.to_owned(), Settings::default()))
}

/// Reads a scene file, or makes a shipped scene; with what was not honoured.
pub fn load(file: &Path) -> Result<(Scene, Vec<String>)> {
    if let Some(scene) = is_shipped(file).then(|| shipped(&file.to_string_lossy())).flatten() {
        return Ok((scene, vec![]));
    }
    let loaded = sunfleck::scene::load::load(file)?;
    Ok((loaded.scene, loaded.warnings))
}

/// A file of that name comes first.
fn is_shipped(path: &Path) -> bool {
    !path.exists() && NAMES.iter().any(|name| Path::new(name) == path)
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

/// `sunfleck scenes`.
pub fn list() -> Result<ExitCode> {
    for name in NAMES {
        crate::print(&format!("{name:<10} {}", describe(name)));
    }
    Ok(ExitCode::SUCCESS)
}

fn describe(name: &str) -> &'static str {
    match name {
        "cornell" => "the box with a red and a green wall, a mirror ball and a glass ball",
        "glass" => "a goblet of red wine and marbles under a small lamp",
        "pool" => "sun through waves onto a mosaic floor, seen from the terrace",
        "bathroom" => "lamps inside thick glass: no light arrives except through it",
        "fireplace" => "a long room lit by hundreds of small flames in a niche",
        _ => "",
    }
}

/// `sunfleck export`.
pub fn export(args: &ExportArgs) -> Result<ExitCode> {
    let path = &args.output;
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        bail!(Usage(format!("-o {}: an exported scene ends in .glb", path.display())));
    }
    atomic::check(path)?;
    let (file, settings) = resolve(&args.scene)?;
    let (mut scene, warnings) = load(&file)?;
    settings.apply_to_scene(&mut scene)?;
    for warning in warnings {
        eprintln!("sunfleck: warning: {}", crate::one_line(&warning));
    }
    let bytes = glb_bytes(&scene)?;
    atomic::write(path, |writer| writer.write_all(&bytes))?;
    eprintln!("wrote {}", path.display());
    if let Some(mut environment) = scene.environment {
        environment.texels.iter_mut().for_each(|texel| *texel *= environment.strength);
        let beside = path.with_extension("hdr");
        export::write_environment_hdr(&environment, &beside)?;
        let turned = match environment.rotation {
            0.0 => String::new(),
            rotation => format!(", turned by {} degrees", rotation.to_degrees()),
        };
        eprintln!("wrote {}: glTF has no environment; render with --env {0}{turned}", beside.display());
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_line() {
        assert!(NAMES.iter().all(|name| !describe(name).is_empty()));
    }

    #[test]
    fn distances() {
        assert_eq!(distance("glass", "glass"), 0);
        assert_eq!(distance("glass", "glas"), 1);
        assert_eq!(distance("cornell", "cornel box"), 4);
        assert_eq!(distance("", "pool"), 4);
    }
}
