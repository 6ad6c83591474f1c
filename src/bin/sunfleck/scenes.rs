//! Scenes by name and by file: `sunfleck scenes`, `sunfleck export`, and what SCENE means.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use anyhow::{Context, Result, bail};
use sunfleck::output::atomic;
use sunfleck::ppm::Interrupt;
use sunfleck::scene::Environment;
use sunfleck::scene::export::{self, glb_bytes};
use sunfleck::scene::load::{LoadError, Loaded, load_environment, load_unless};
use sunfleck::scene::settings::Settings;
use sunfleck::scene::shipped::{NAMES, shipped};

use crate::cli::{ExportArgs, Usage};

/// What SCENE stands for.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// As given.
    pub name: String,
    /// The same file from the root, without links; none for a shipped scene.
    #[cfg(feature = "view")]
    pub canonical: Option<PathBuf>,
    /// A scene file, or the name of a shipped scene.
    pub file: PathBuf,
    /// What the settings file says; nothing without one.
    pub settings: Settings,
    /// Where the settings file lies.
    pub folder: PathBuf,
    kept: Arc<Mutex<Vec<Kept>>>,
}

/// Environments that are kept: the one that lights the scene, and one that is about to.
const MOST_KEPT: usize = 2;

/// An environment as its file had it: read once, though settings are applied at every edit in the window.
#[derive(Debug)]
struct Kept {
    path: PathBuf,
    stamp: Stamp,
    environment: Environment,
    warnings: Vec<String>,
}

/// Changes when a file is written to: bytes, and when.
type Stamp = (u64, Option<SystemTime>);

fn stamp(path: &Path) -> Option<Stamp> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.len(), metadata.modified().ok()))
}

impl Source {
    /// Reads the settings, if SCENE is a settings file; not yet the scene.
    pub fn resolve(scene: &str) -> Result<Self> {
        let path = Path::new(scene);
        let named = Self {
            name: scene.to_owned(),
            #[cfg(feature = "view")]
            canonical: path.canonicalize().ok(),
            ..Self::default()
        };
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            check_name(scene)?;
            return Ok(Self { file: path.to_owned(), ..named });
        }
        let settings = Settings::load(path)?;
        settings.scene.as_ref().with_context(|| format!("{scene}: scene: is missing: it names a file"))?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let mut source = Self { settings, folder, ..named };
        source.locate();
        Ok(source)
    }

    /// Overrides settings, each `field=value` as `--set` takes it.
    pub fn set(&mut self, pairs: &[String]) -> Result<()> {
        for pair in pairs {
            self.settings.set(pair).map_err(|e| Usage(format!("--set {pair}: {e}")))?;
        }
        self.locate();
        Ok(())
    }

    /// Finds the scene that the settings name.
    fn locate(&mut self) {
        if let Some(named) = &self.settings.scene {
            let beside = self.folder.join(named);
            self.file = if !beside.exists() && NAMES.contains(&named.as_str()) { named.into() } else { beside };
        }
    }

    /// Refuses to write over a file that the scene is made from with `settings`: those, the scene, the environment.
    pub fn check_not_read(&self, settings: &Settings, path: &Path) -> Result<(), Usage> {
        let environment = settings.environment.as_ref().and_then(|environment| environment.file.as_ref());
        let environment = environment.map(|file| self.folder.join(file));
        let read = [Some(PathBuf::from(&self.name)), Some(self.file.clone()), environment];
        match read.iter().flatten().any(|read| read.is_file() && same_file(read, path)) {
            true => Err(Usage(format!("{} is read and to be written", path.display()))),
            false => Ok(()),
        }
    }

    /// Reads the scene as its file has it, or makes a shipped one; with what was not honoured.
    pub fn scene(&self) -> Result<Loaded> {
        self.scene_unless(&Interrupt::default())
    }

    /// The same, unless `interrupt` ends it.
    pub fn scene_unless(&self, interrupt: &Interrupt) -> Result<Loaded> {
        if let Some(scene) = is_shipped(&self.file).then(|| shipped(&self.file.to_string_lossy())).flatten() {
            return Ok(Loaded { scene, warnings: vec![] });
        }
        Ok(load_unless(&self.file, interrupt)?)
    }

    /// Settings as `file` is to hold them: what lies in its folder or below is named from there, so that the folder can be
    /// moved; all else from the root.
    #[cfg(feature = "view")]
    pub fn rooted(&self, settings: &Settings, file: &Path) -> Settings {
        let there = place(file);
        let folder = there.as_deref().and_then(Path::parent);
        let named = |path: &Path| {
            // A shipped scene has no place.
            let place = path.exists().then(|| place(path)).flatten()?;
            let Some(below) = folder.and_then(|folder| place.strip_prefix(folder).ok()) else {
                return Some(place.to_string_lossy().into_owned());
            };
            // With slashes, which every system reads.
            let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
            Some(parts.join("/"))
        };
        let mut settings = settings.clone();
        settings.scene = named(&self.file).or_else(|| Some(self.file.to_string_lossy().into_owned()));
        if let Some(file) = settings.environment.as_mut().and_then(|environment| environment.file.as_mut()) {
            *file = named(&self.folder.join(&*file)).unwrap_or_else(|| file.clone());
        }
        settings
    }

    /// Changes a scene as `settings` say, whose files lie where the settings file does.
    pub fn apply(&self, settings: &Settings, loaded: &mut Loaded) -> Result<()> {
        let warnings = settings
            .apply_with(&mut loaded.scene, &self.folder, &mut |path| self.environment(path))
            .with_context(|| self.name.clone())?;
        loaded.warnings.extend(warnings);
        Ok(())
    }

    /// Reads an environment before settings name it: to see whether it can be read, and so that they are applied quickly.
    #[cfg(feature = "view")]
    pub fn keep_environment(&self, path: &Path) -> Result<()> {
        self.environment(path)?;
        Ok(())
    }

    /// Reads an environment, unless it is one of the last read and its file is as it was.
    fn environment(&self, path: &Path) -> Result<(Environment, Vec<String>), LoadError> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let now = stamp(path);
        if let Some(kept) = kept().iter().find(|kept| kept.path == path && Some(&kept.stamp) == now.as_ref()) {
            return Ok((kept.environment.clone(), kept.warnings.clone()));
        }
        // Long, perhaps: somebody else may need another meanwhile.
        let (environment, warnings) = load_environment(path)?;
        let mut kept = kept();
        kept.retain(|kept| kept.path != path);
        if let Some(stamp) = now {
            let (environment, warnings) = (environment.clone(), warnings.clone());
            kept.insert(0, Kept { path: path.to_owned(), stamp, environment, warnings });
            kept.truncate(MOST_KEPT);
        }
        Ok((environment, warnings))
    }
}

/// Where a file lies, from the root, if its folder is there. What is linked to lies where the link does.
pub fn place(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(path.file_name()?))
}

/// Whether both are one file, also where it is not there yet.
pub fn same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| path.canonicalize().ok().or_else(|| place(path));
    a == b || place(a).is_some_and(|a| place(b).is_some_and(|b| a == b))
}

/// A file as settings can name it, wherever they lie.
pub fn absolute(path: &Path) -> Result<String> {
    let absolute = std::path::absolute(path).with_context(|| path.display().to_string())?;
    absolute.into_os_string().into_string().ok().with_context(|| format!("{}: is not UTF-8", path.display()))
}

/// Whether `scene` can be anything; if not, says what is near.
fn check_name(scene: &str) -> Result<()> {
    let path = Path::new(scene);
    if path.extension().is_some() || path.exists() || NAMES.contains(&scene) {
        return Ok(());
    }
    let close = NAMES.into_iter().find(|name| distance(name, scene) <= 2);
    let hint = close.map_or(String::new(), |name| format!("did you mean {name}? "));
    bail!("{scene}: neither a file nor a scene that comes with sunfleck ({hint}there are: {})", NAMES.join(", "));
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

/// A shipped scene in one line.
pub fn describe(name: &str) -> &'static str {
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
    let source = Source::resolve(&args.scene)?;
    source.check_not_read(&source.settings, path)?;
    let mut loaded = source.scene()?;
    // The soft sky of a scene without light is no part of it: who reads the file gives it the same, if nothing is changed
    // about light.
    let Settings { environment, light_scale, materials, .. } = &source.settings;
    let is_changed = environment.is_some() || light_scale.is_some() || !materials.is_empty();
    let drops_sky = !is_changed && source.settings.needs_sky(&loaded.scene);
    if drops_sky {
        loaded.scene.environment = Some(Environment::uniform(glam::Vec3::ONE));
    }
    source.apply(&source.settings, &mut loaded)?;
    let Loaded { mut scene, warnings } = loaded;
    scene.environment.take_if(|_| drops_sky);
    for warning in warnings {
        eprintln!("sunfleck: warning: {}", crate::one_line(&warning));
    }
    let bytes = glb_bytes(&scene)?;
    let beside = path.with_extension("hdr");
    if scene.environment.is_some() {
        source.check_not_read(&source.settings, &beside)?;
    }
    atomic::write(path, |writer| writer.write_all(&bytes))?;
    eprintln!("wrote {}", path.display());
    if let Some(mut environment) = scene.environment {
        let scale = environment.strength * environment.tint;
        Arc::make_mut(&mut environment.texels).iter_mut().for_each(|texel| *texel *= scale);
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
    fn an_environment_is_read_again_only_if_its_file_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.hdr");
        let sky = |radiance: f32| Environment::uniform(glam::Vec3::splat(radiance));
        export::write_environment_hdr(&sky(1.0), &path).unwrap();
        let source = Source::resolve("cornell").unwrap();
        let texel = || source.environment(&path).unwrap().0.texels[0].x;
        assert_eq!(texel(), 1.0);
        // What is kept is what comes, as long as the file is the same.
        source.kept.lock().unwrap()[0].environment = sky(4.0);
        assert_eq!(texel(), 4.0);
        export::write_environment_hdr(&sky(2.0), &path).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
        assert_eq!(texel(), 2.0);
        std::fs::remove_file(&path).unwrap();
        assert!(source.environment(&path).is_err());
    }

    #[cfg(feature = "view")]
    #[test]
    fn saved_settings_move_with_their_folder() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        std::fs::create_dir_all(root.join("set/sky")).unwrap();
        std::fs::write(root.join("set/a.toml"), "scene = \"a.glb\"\nenvironment = { file = \"sky/day.hdr\" }\n")
            .unwrap();
        for name in ["set/a.glb", "set/sky/day.hdr"] {
            std::fs::write(root.join(name), "").unwrap();
        }
        let source = Source::resolve(&root.join("set/a.toml").to_string_lossy()).unwrap();
        let absolute = |name: &str| root.join(name).to_string_lossy().into_owned();
        for (file, scene, sky) in [
            ("set/b.toml", "a.glb".to_owned(), "sky/day.hdr".to_owned()),
            ("set/sky/../b.toml", "a.glb".to_owned(), "sky/day.hdr".to_owned()),
            ("b.toml", "set/a.glb".to_owned(), "set/sky/day.hdr".to_owned()),
            ("set/sky/b.toml", absolute("set/a.glb"), "day.hdr".to_owned()),
            ("absent/b.toml", absolute("set/a.glb"), absolute("set/sky/day.hdr")),
        ] {
            let settings = source.rooted(&source.settings, &root.join(file));
            assert_eq!(settings.scene, Some(scene), "{file}");
            assert_eq!(settings.environment.and_then(|environment| environment.file), Some(sky), "{file}");
        }
        let shipped = Source::resolve("cornell").unwrap();
        let settings = shipped.rooted(&shipped.settings, Path::new("b.toml"));
        assert_eq!(settings.scene.as_deref(), Some("cornell"));
    }

    #[cfg(feature = "view")]
    #[test]
    fn a_file_is_the_same_by_whatever_path() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        std::fs::create_dir(root.join("sub")).unwrap();
        std::fs::write(root.join("a.toml"), "scene = \"cornell\"\n").unwrap();
        std::fs::write(root.join("b.obj"), "").unwrap();
        let canonical = |name: &str| Source::resolve(name).unwrap().canonical;
        for name in ["a.toml", "b.obj"] {
            for path in [root.join(name), root.join("sub/..").join(name)] {
                assert_eq!(canonical(&path.to_string_lossy()), Some(root.join(name)));
            }
        }
        assert_eq!(canonical("glass"), None);
    }

    #[test]
    fn distances() {
        assert_eq!(distance("glass", "glass"), 0);
        assert_eq!(distance("glass", "glas"), 1);
        assert_eq!(distance("cornell", "cornel box"), 4);
        assert_eq!(distance("", "pool"), 4);
    }
}
