//! What is remembered from one run to the next, in a file of its own. Each of several windows brings into it what was changed
//! there, and leaves what the others did; eframe's file is that of the window closed last, and empty on a full disk.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use sunfleck::output::atomic;
use toml::Table;

use super::engine::Message;
use super::files::{free_name, name_of};

/// Its name, beside eframe's.
const FILE: &str = "remembered.toml";
/// Files that are remembered.
const MOST_RECENT: usize = 12;
/// In the end, for a disk that does not answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// From one run to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Remembered {
    /// The newest first.
    pub recent: Vec<String>,
    pub show_settings: bool,
    pub show_inspect: bool,
    pub show_convergence: bool,
}

impl Default for Remembered {
    fn default() -> Self {
        Self { recent: vec![], show_settings: true, show_inspect: true, show_convergence: false }
    }
}

impl Remembered {
    /// Puts a file first, which is named in full.
    pub fn opened(&mut self, path: &Path) {
        let path = path.to_string_lossy().into_owned();
        self.recent.retain(|other| *other != path);
        self.recent.insert(0, path);
        self.recent.truncate(MOST_RECENT);
    }

    /// What became of `before` in one window, brought to what others have made of it since.
    fn merged(&self, before: &Self, others: &Self) -> Self {
        let either = |of: fn(&Self) -> bool| of(if of(self) == of(before) { others } else { self });
        // What follows those that were opened keeps its order.
        let follows = |rest: &[String]| {
            let mut before = before.recent.iter();
            rest.iter().all(|path| before.any(|other| other == path))
        };
        let n_opened = (0..self.recent.len()).find(|&n| follows(&self.recent[n..])).unwrap_or(self.recent.len());
        let opened = &self.recent[..n_opened];
        // At the end of a full list, what is missing had no room.
        let was_left = |path| !self.recent.contains(path);
        let n_kept = match self.recent.len() < MOST_RECENT {
            true => before.recent.len(),
            false => before.recent.iter().rposition(|path| !was_left(path)).map_or(0, |last| last + 1),
        };
        let is_forgotten = |path| before.recent[..n_kept].contains(path) && was_left(path);
        let rest = others.recent.iter().filter(|path| !opened.contains(path) && !is_forgotten(path));
        Self {
            recent: opened.iter().chain(rest).take(MOST_RECENT).cloned().collect(),
            show_settings: either(|r| r.show_settings),
            show_inspect: either(|r| r.show_inspect),
            show_convergence: either(|r| r.show_convergence),
        }
    }
}

/// Keeps what is remembered in a file, on a thread of its own. Waits for it in the end.
pub struct Memory {
    /// What the thread was given last.
    given: Remembered,
    to_thread: Option<mpsc::Sender<Remembered>>,
    /// Closed when the thread has ended.
    ended: mpsc::Receiver<()>,
}

impl Memory {
    /// What the file at `path` has, or else what there was before there was such a file.
    pub fn open(
        path: PathBuf,
        old: impl FnOnce() -> Option<Remembered>,
        say: impl Fn(Message) + Send + 'static,
    ) -> (Remembered, Self) {
        let (to_thread, given) = mpsc::channel();
        let (remembered, before) = match read(&path) {
            Ok(Some((_, there))) => (there.clone(), there),
            Ok(None) => (old().unwrap_or_default(), Remembered::default()),
            Err(_) => {
                // The thread sees to it, and tells.
                let _ = to_thread.send(Remembered::default());
                Default::default()
            }
        };
        let (end, ended) = mpsc::channel::<()>();
        let file = Kept { path, written: before.clone(), is_told: false, say };
        thread::spawn(move || {
            file.keep(&given);
            drop(end);
        });
        (remembered, Self { given: before, to_thread: Some(to_thread), ended })
    }

    /// Writes what is to be remembered now, if it is not what it was.
    pub fn keep(&mut self, now: &Remembered) {
        if let Some(to_thread) = self.to_thread.as_ref().filter(|_| self.given != *now) {
            self.given.clone_from(now);
            let _ = to_thread.send(now.clone());
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.to_thread = None;
        let _ = self.ended.recv_timeout(PATIENCE);
    }
}

/// Where what is remembered is kept, beside eframe's file.
pub fn place(app_id: &str, options: &eframe::NativeOptions) -> Option<PathBuf> {
    match &options.persistence_path {
        Some(file) => Some(file.with_file_name(FILE)),
        None => Some(eframe::storage_dir(app_id)?.join(FILE)),
    }
}

/// The file, for the thread that writes it.
struct Kept<S> {
    path: PathBuf,
    /// What the window had when this was last written.
    written: Remembered,
    /// Whether a failure has been told.
    is_told: bool,
    say: S,
}

impl<S: Fn(Message)> Kept<S> {
    /// Writes what is given, the newest alone if it comes faster; what could not be written, once more in the end.
    fn keep(mut self, given: &mpsc::Receiver<Remembered>) {
        let mut unwritten = None;
        while let Ok(now) = given.recv() {
            unwritten = self.tries(given.try_iter().last().unwrap_or(now));
        }
        unwritten.map(|now| self.tries(now));
    }

    /// What could not be written.
    fn tries(&mut self, now: Remembered) -> Option<Remembered> {
        let Err(error) = self.write(&now) else {
            self.written = now;
            return None;
        };
        if !std::mem::replace(&mut self.is_told, true) {
            (self.say)(Message::Warning(format!("what is remembered cannot be kept: {error}")));
        }
        Some(now)
    }

    fn write(&self, now: &Remembered) -> Result<(), String> {
        // Two windows never change it at once. Where there are no locks, they hardly do.
        let lock = File::create(self.path.with_extension("lock")).and_then(|file| file.lock().map(|()| file));
        let (mut table, others) = match read(&self.path) {
            Ok(there) => there.unwrap_or_else(|| (Table::new(), self.written.clone())),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                self.put_aside(&error)?;
                (Table::new(), self.written.clone())
            }
            Err(error) => return Err(format!("{}: {error}", self.path.display())),
        };
        let merged = Table::try_from(now.merged(&self.written, &others)).map_err(|error| error.to_string())?;
        // What another version has there stays.
        table.extend(merged);
        let text = table.to_string();
        let written = atomic::write(&self.path, |writer| writer.write_all(text.as_bytes()));
        drop(lock);
        written.map_err(|error| error.to_string())
    }

    /// Keeps a file that is none of this program's under another name.
    fn put_aside(&self, why: &io::Error) -> Result<(), String> {
        let path = self.path.display();
        let aside = free_name(&self.path.with_added_extension("bad"));
        fs::rename(&self.path, &aside).map_err(|error| format!("{path}: {error}"))?;
        let text = format!("{path} cannot be read: {why}; it is now {}", name_of(&aside));
        (self.say)(Message::Warning(text));
        Ok(())
    }
}

/// What there is in a file, if there is one. `InvalidData` if it is none of this program's.
fn read(path: &Path) -> io::Result<Option<(Table, Remembered)>> {
    match fs::metadata(path) {
        Ok(there) if there.is_file() => {}
        Ok(_) => return Err(io::Error::other("not a regular file")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    }
    let table = fs::read_to_string(path)?.parse::<Table>();
    let both = table.and_then(|table| table.clone().try_into().map(|there| (table, there)));
    both.map(Some).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, crate::one_line(error.message())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    /// A window's, and what it is told.
    fn open(path: &Path) -> (Remembered, Memory, mpsc::Receiver<Message>) {
        let (say, said) = mpsc::channel();
        let (remembered, memory) = Memory::open(path.to_owned(), || None, move |message| say.send(message).unwrap());
        (remembered, memory, said)
    }

    /// A window that finds nothing it can read, and closes a panel: what it has then, and what it was told.
    fn closes_a_panel(path: &Path) -> (Remembered, Vec<Message>) {
        let (mut remembered, mut memory, said) = open(path);
        assert_eq!(remembered, Remembered::default());
        remembered.show_inspect = false;
        memory.keep(&remembered);
        drop(memory);
        (remembered, said.iter().collect())
    }

    fn there(path: &Path) -> Remembered {
        read(path).unwrap().unwrap().1
    }

    #[test]
    fn recent_files_are_the_newest_first_and_once() {
        let mut remembered = Remembered::default();
        // None of them is there: the disk is not asked.
        for name in ["/no/a.obj", "/no/b.obj", "/no/a.obj"] {
            remembered.opened(Path::new(name));
        }
        assert_eq!(remembered.recent, ["/no/a.obj", "/no/b.obj"]);
    }

    #[test]
    fn recent_files_of_two_windows_are_merged() {
        let of = |recent: &str| Remembered {
            recent: recent.split_whitespace().map(str::to_owned).collect(),
            ..Default::default()
        };
        let twelve = "a b c d e f g h i j k l";
        for (before, now, others, merged) in [
            ("", "", "", ""),
            ("", "b a", "d c", "b a d c"),
            ("a b c", "d a b c", "e a b c", "d e a b c"),
            ("a b c", "c a b", "e a b c", "c e a b"),
            ("a b c", "c b a", "a b c", "c b a"),
            // Forgotten.
            ("a b c", "a c", "e a b c", "e a c"),
            ("a b c", "", "e a b c", "e"),
            ("a b c", "d b", "e a b c", "d e b"),
            ("a b c", "a b c", "b", "b"),
            // No room.
            (twelve, "x a b c d e f g h i j k", "l a b c d e f g h i j k", "x l a b c d e f g h i j"),
            (twelve, "a c d e f g h i j k l", twelve, "a c d e f g h i j k l"),
            (twelve, "x a c d e f g h i j k l", twelve, "x a c d e f g h i j k l"),
        ] {
            let found = of(now).merged(&of(before), &of(others));
            assert_eq!(found, of(merged), "{before:?} {now:?} {others:?}");
        }
    }

    #[test]
    fn windows_keep_what_the_others_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        let [mut one, mut other] = [open(&path), open(&path)];
        one.0.opened(Path::new("/no/a.obj"));
        one.0.show_convergence = true;
        other.0.opened(Path::new("/no/b.obj"));
        other.0.show_settings = false;
        for (remembered, mut memory, said) in [one, other] {
            memory.keep(&remembered);
            drop(memory);
            assert_eq!(said.try_recv().ok(), None);
        }
        let (remembered, ..) = open(&path);
        let recent = files(&["/no/b.obj", "/no/a.obj"]);
        assert_eq!(remembered, Remembered { recent, show_settings: false, show_inspect: true, show_convergence: true });
    }

    /// And leave nothing but the file, and the lock.
    #[test]
    fn windows_that_write_at_once_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        let mut windows: Vec<_> = (0..8).map(|_| open(&path)).collect();
        for (i, (remembered, memory, _)) in windows.iter_mut().enumerate() {
            remembered.opened(Path::new(&format!("/no/{i}.obj")));
            memory.keep(remembered);
        }
        drop(windows);
        let mut recent = there(&path).recent;
        recent.sort();
        assert_eq!(recent, (0..8).map(|i| format!("/no/{i}.obj")).collect::<Vec<_>>());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn what_cannot_be_written_is_told_once_and_written_when_it_can() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        let old = "recent = [\"/no/a.obj\"]\n";
        fs::write(&path, old).unwrap();
        let set_read_only = |is_read_only| {
            let mut permissions = fs::metadata(&path).unwrap().permissions();
            permissions.set_readonly(is_read_only);
            fs::set_permissions(&path, permissions).unwrap();
        };
        set_read_only(true);
        let (mut remembered, mut memory, said) = open(&path);
        for name in ["/no/b.obj", "/no/c.obj"] {
            remembered.opened(Path::new(name));
            memory.keep(&remembered);
        }
        let Message::Warning(why) = said.recv_timeout(PATIENCE).unwrap() else { panic!("no warning") };
        assert!(why.contains("cannot be kept: cannot write") && why.contains("read-only"), "{why}");
        assert_eq!(fs::read_to_string(&path).unwrap(), old);
        set_read_only(false);
        // In the end it is tried once more.
        drop(memory);
        assert_eq!(there(&path).recent, ["/no/c.obj", "/no/b.obj", "/no/a.obj"]);
        assert_eq!(said.try_recv().ok(), None);
    }

    #[test]
    fn what_is_no_file_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        fs::create_dir(&path).unwrap();
        let (_, told) = closes_a_panel(&path);
        assert!(matches!(&told[..], [Message::Warning(why)] if why.contains("not a regular file")), "{told:?}");
        assert!(path.is_dir());
    }

    #[test]
    fn a_broken_file_is_put_aside_and_told_once() {
        for broken in [&b"recent = [\"/no/a"[..], b"recent = 3", b"\xff\xfe\0"] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(FILE);
            fs::write(&path, broken).unwrap();
            let (remembered, told) = closes_a_panel(&path);
            let [Message::Warning(why)] = &told[..] else { panic!("{told:?}") };
            assert!(why.contains("cannot be read") && why.ends_with("it is now remembered.toml-1.bad"), "{why}");
            assert!(!why.contains('\n'));
            assert_eq!(fs::read(folder.path().join("remembered.toml-1.bad")).unwrap(), broken);
            assert_eq!(there(&path), remembered);
        }
    }

    #[test]
    fn what_another_version_remembers_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        fs::write(&path, "show_inspect = false\n\n[colours]\nname = \"dark\"\n").unwrap();
        let (mut remembered, mut memory, _said) = open(&path);
        assert!(!remembered.show_inspect && remembered.show_settings);
        remembered.show_settings = false;
        memory.keep(&remembered);
        drop(memory);
        assert_eq!(there(&path), remembered);
        assert!(fs::read_to_string(&path).unwrap().contains("[colours]\nname = \"dark\""));
    }
}
