//! The window as its users meet it: the real program on a display of its own, driven by keys and mouse.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use sunfleck::output;
use tempfile::TempDir;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConnectionExt, InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT,
    MOTION_NOTIFY_EVENT, MapState, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sunfleck");

/// For anything that is waited for: a loaded machine compiles the kernels first.
const PATIENCE: Duration = Duration::from_secs(120);

const CONTROL: u32 = 0xffe3;
const LEFT: u8 = 1;

/// Ends with the test, however that ends.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An X server without a screen, and what types and points there.
struct Display {
    server: Process,
    name: String,
    connection: RustConnection,
    root: Window,
    /// Keysyms by keycode.
    keys: Vec<(u8, Vec<u32>)>,
}

impl Display {
    /// `None` if there is no Xvfb.
    fn start() -> Option<Self> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1280x720x24", "-nolisten", "tcp"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
        let stdout = child.stdout.take().unwrap();
        let server = Process(child);
        let mut number = String::new();
        BufReader::new(stdout).read_line(&mut number).unwrap();
        let name = format!(":{}", number.trim());
        let (connection, screen) = x11rb::connect(Some(&name)).unwrap();
        let setup = connection.setup();
        let root = setup.roots[screen].root;
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let map = connection.get_keyboard_mapping(first, last - first + 1).unwrap().reply().unwrap();
        let columns = usize::from(map.keysyms_per_keycode);
        let keys = (first..=last).zip(map.keysyms.chunks(columns).map(<[u32]>::to_vec)).collect();
        Some(Self { server, name, connection, root, keys })
    }

    fn fake(&self, event: u8, detail: u8, at: [i16; 2]) {
        self.connection.xtest_fake_input(event, detail, 0, self.root, at[0], at[1], 0).unwrap().check().unwrap();
    }

    /// Presses keys in this order, and lets go of them.
    fn press(&self, keysyms: &[u32]) {
        let code = |keysym: &u32| self.keys.iter().find(|(_, syms)| syms.first() == Some(keysym)).unwrap().0;
        let codes: Vec<u8> = keysyms.iter().map(code).collect();
        codes.iter().for_each(|&code| self.fake(KEY_PRESS_EVENT, code, [0, 0]));
        codes.iter().rev().for_each(|&code| self.fake(KEY_RELEASE_EVENT, code, [0, 0]));
    }

    fn point(&self, x: i16, y: i16) {
        self.fake(MOTION_NOTIFY_EVENT, 0, [x, y]);
    }

    /// The window of the program, and what it is called.
    fn window(&self) -> Option<(Window, String)> {
        let name = self.connection.intern_atom(false, b"_NET_WM_NAME").unwrap().reply().unwrap().atom;
        let tree = self.connection.query_tree(self.root).unwrap().reply().unwrap();
        tree.children.iter().find_map(|&window| {
            let is_shown = self.connection.get_window_attributes(window).unwrap().reply().ok()?.map_state;
            let title =
                self.connection.get_property(false, window, name, AtomEnum::ANY, 0, 1000).unwrap().reply().ok()?;
            let title = String::from_utf8(title.value).ok()?;
            (is_shown == MapState::VIEWABLE && title.contains("Sunfleck")).then_some((window, title))
        })
    }
}

/// Asks until there is an answer.
fn wait_for<T>(what: &str, viewer: &mut Process, mut ask: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        if let Some(status) = viewer.0.try_wait().unwrap() {
            panic!("waiting for {what}, but the program has ended: {status}");
        }
        assert!(began.elapsed() < PATIENCE, "no {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Text from the header of a picture; `None` while it is not there.
fn text(path: &Path, name: &str) -> Option<String> {
    let meta = MetaData::read_from_file(path, true).ok()?;
    match meta.headers[0].own_attributes.other.get(&Text::new_or_panic(name)) {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        other => panic!("{name}: {other:?}"),
    }
}

/// The program in a folder of its own, on a display of its own.
struct Opened {
    display: Display,
    viewer: Process,
    folder: TempDir,
    log: PathBuf,
}

/// After so many iterations it pauses.
const ITERATIONS: &str = "5";

impl Opened {
    /// Cornell's box, small; `Ctrl+S` saves to `saved.exr`. `None` where there can be no window, unless there has to be one.
    fn new(backend: &str) -> Option<Self> {
        let is_required = std::env::var_os("SUNFLECK_REQUIRE_GPU").is_some();
        let skip = |why: &str| {
            assert!(!is_required, "SUNFLECK_REQUIRE_GPU is set, but: {why}");
            println!("skipped: {why}");
            None
        };
        let devices = Command::new(PROGRAM).arg("--list-devices").output().unwrap().stdout;
        if devices.iter().filter(|c| **c == b'\n').count() < 2 {
            return skip("no GPU adapter");
        }
        let Some(display) = Display::start() else { return skip("no Xvfb") };
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("stderr.txt");
        let mut command = Command::new(PROGRAM);
        command.args(["view", "cornell", "--backend", backend, "--iterations", ITERATIONS, "-o", "saved.exr"]);
        command.args(["--set", "size=64x48", "--set", "photons=4k"]);
        command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY").env_remove("RUST_BACKTRACE");
        for home in ["XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME"] {
            command.env(home, folder.path());
        }
        command.current_dir(folder.path()).stderr(File::create(&log).unwrap());
        let viewer = Process(command.spawn().unwrap());
        Some(Self { display, viewer, folder, log })
    }

    /// Waits for the end of the program: how it ended, and what it said.
    fn ended(&mut self) -> (ExitStatus, String) {
        let began = Instant::now();
        loop {
            if let Some(status) = self.viewer.0.try_wait().unwrap() {
                return (status, fs::read_to_string(&self.log).unwrap());
            }
            assert!(began.elapsed() < PATIENCE, "it does not quit");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Without its display the program cannot go on; what it has rendered is saved.
#[test]
fn a_picture_outlives_its_display() {
    // While a frame is made, perhaps, and while nothing happens: other libraries notice.
    for idle in [Duration::ZERO, Duration::from_secs(1)] {
        outlives(idle);
    }
}

/// Xlib has something to say, too.
fn ours(log: &str) -> Vec<&str> {
    log.lines().filter(|line| !line.is_empty() && !line.starts_with("X connection to ")).collect()
}

fn outlives(idle: Duration) {
    let Some(mut opened) = Opened::new("cpu") else { return };
    let title = format!("cornell – {ITERATIONS} iterations – Sunfleck");
    let Opened { display, viewer, .. } = &mut opened;
    wait_for("iterations", viewer, || display.window().filter(|(_, now)| *now == title));
    std::thread::sleep(idle);
    display.server.0.kill().unwrap();
    let (status, log) = opened.ended();
    assert_eq!(status.code(), Some(1), "{log}");
    let [line] = ours(&log)[..] else { panic!("{log}") };
    assert!(line.starts_with("sunfleck: error: saved the picture as saved.exr: "), "{log}");
    assert_eq!(output::exr::read(&opened.folder.path().join("saved.exr")).unwrap().size, [64, 48]);
}

/// A signal saves as well, but over nothing: what is there may be another view, saved on purpose.
#[test]
fn a_picture_outlives_a_signal() {
    let Some(mut opened) = Opened::new("cpu") else { return };
    let title = format!("cornell – {ITERATIONS} iterations – Sunfleck");
    let Opened { display, viewer, folder, .. } = &mut opened;
    fs::write(folder.path().join("saved.exr"), "kept").unwrap();
    wait_for("iterations", viewer, || display.window().filter(|(_, now)| *now == title));
    let sent = Command::new("kill").args(["-TERM", &viewer.0.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let (status, log) = opened.ended();
    assert_eq!(status.code(), Some(130), "{log}");
    assert_eq!(ours(&log), ["saved the picture as saved-rescued-1.exr"]);
    let folder = opened.folder.path();
    assert_eq!(fs::read(folder.join("saved.exr")).unwrap(), b"kept");
    assert_eq!(output::exr::read(&folder.join("saved-rescued-1.exr")).unwrap().size, [64, 48]);
}

/// Opens a scene, orbits, changes a setting, saves, quits; what was saved is what its command renders.
#[test]
fn a_picture_saved_in_the_window_is_what_its_command_renders() {
    let Some(mut opened) = Opened::new("gpu") else { return };
    let Opened { display, viewer, folder, .. } = &mut opened;
    let [saved, kept] = ["saved.exr", "kept.exr"].map(|name| folder.path().join(name));

    let title = format!("cornell – {ITERATIONS} iterations – Sunfleck");
    let iterated = || display.window().filter(|(_, now)| *now == title);
    let (window, _) = wait_for("iterations", viewer, iterated);
    let focused = |window| {
        let _ = display.connection.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME).unwrap().check();
        let focus = display.connection.get_input_focus().unwrap().reply().unwrap().focus;
        (focus == window).then_some(())
    };
    wait_for("focus", viewer, || focused(window));
    // Orbits, back and forth until the picture is another one.
    display.point(640, 360);
    display.fake(BUTTON_PRESS_EVENT, LEFT, [0, 0]);
    let mut steps = 0;
    wait_for("orbit", viewer, || {
        steps += 1;
        display.point(640 + steps % 100, 360);
        display.window().filter(|(_, now)| *now != title).map(|_| ())
    });
    display.fake(BUTTON_RELEASE_EVENT, LEFT, [0, 0]);
    display.press(&[u32::from(b'-')]);
    // Both restart the estimate; a picture that is saved too early is saved again.
    let command = wait_for("picture with all changes", viewer, || {
        iterated()?;
        let _ = fs::remove_file(&saved);
        display.press(&[CONTROL, u32::from(b's')]);
        let began = Instant::now();
        let command = loop {
            match text(&saved, "command") {
                Some(command) => break command,
                None if began.elapsed() > Duration::from_secs(5) => return None,
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        let parts = ["camera.", "photons=2", &format!("--iterations {ITERATIONS} ")];
        parts.iter().all(|part| command.contains(part)).then_some(command)
    });
    display.press(&[CONTROL, u32::from(b'q')]);
    let (status, log) = opened.ended();
    assert!(status.success(), "{status}: {log}");
    let bad = ["panicked", "alidation", "error"];
    assert!(!bad.iter().any(|word| log.contains(word)), "{log}");

    // As a shell takes it, with the program's folder first on the path.
    fs::rename(&saved, &kept).unwrap();
    let path = Path::new(PROGRAM).parent().unwrap().display().to_string();
    let path = format!("{path}:{}", std::env::var("PATH").unwrap_or_default());
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("{command} --quiet")).env("PATH", path).current_dir(opened.folder.path());
    let rendered = shell.output().unwrap();
    assert!(rendered.status.success(), "{command}: {}", String::from_utf8_lossy(&rendered.stderr));
    let [kept, rendered] = [&kept, &saved].map(|path| output::exr::read(path).unwrap());
    assert_eq!((kept.size, kept.rgb.len()), ([64, 48], 64 * 48));
    assert_eq!(kept.size, rendered.size);
    let is_close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * (1e-3 + a.abs().max(b.abs()));
    let n_far = kept.rgb.as_flattened().iter().zip(rendered.rgb.as_flattened()).filter(|pair| !is_close(*pair)).count();
    let n_equal = kept.rgb.iter().zip(&rendered.rgb).filter(|(a, b)| a == b).count();
    println!("{command}\n{n_equal} of {} pixels are the same in every bit", kept.rgb.len());
    assert_eq!(n_far, 0, "values that differ by more than rounding");
}
