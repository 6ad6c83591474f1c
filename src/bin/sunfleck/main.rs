//! The `sunfleck` program: parse, dispatch, exit code.

mod bench;
mod cli;
mod compare;
mod devices;
mod job;
mod mesh_check;
mod points;
mod progress;
mod render;
mod report;
mod scenes;
mod stop;
#[cfg(feature = "view")]
mod view;

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::OnceLock;

use cli::{Cli, Command};

/// Interrupted, and what there was has been saved.
const INTERRUPTED: u8 = 130;

/// For someone who typed nothing but the name.
const GREETING: &str = "\
sunfleck renders light: caustics included, from a scene file to a picture.

  sunfleck render glass -o glass.png         a scene that comes with it
  sunfleck render my.glb -o my.exr -o my.png one of yours: .glb .gltf .obj
  sunfleck view                              the same in a window, converging
  sunfleck scenes                            the scenes that come with it
  sunfleck render --help                     everything else";

fn main() -> ExitCode {
    let cli = match Cli::read() {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let done = match (&cli.command, cli.list_devices) {
        (_, true) => devices::list(),
        (Some(Command::Render(args)), _) => render::run(args),
        #[cfg(feature = "view")]
        (Some(Command::View(args)), _) => view::run(args),
        (Some(Command::Scenes), _) => scenes::list(),
        (Some(Command::Export(args)), _) => scenes::export(args),
        (Some(Command::Compare(args)), _) => compare::run(args),
        (Some(Command::Bench(args)), _) => bench::run(args),
        (Some(Command::Points(args)), _) => points::run(args),
        (Some(Command::MeshCheck(args)), _) => mesh_check::run(args),
        (None, _) => {
            eprintln!("{GREETING}");
            return ExitCode::from(cli::USAGE);
        }
    };
    let done = done.and_then(|code| match UNPRINTED.get() {
        Some(error) => Err(anyhow::anyhow!("standard output: {error}")),
        None => Ok(code),
    });
    done.unwrap_or_else(|error| {
        let usage = error.is::<cli::Usage>();
        say_error(&chain(&error));
        if usage { ExitCode::from(cli::USAGE) } else { ExitCode::FAILURE }
    })
}

/// The error and its causes, each said once: some errors have the text of their cause in their own.
fn chain(error: &anyhow::Error) -> String {
    error.chain().map(|cause| without_number(&cause.to_string())).fold(String::new(), |text, cause| {
        match (text.is_empty(), text.contains(&cause)) {
            (true, _) => cause,
            (_, true) => text,
            _ => format!("{text}: {cause}"),
        }
    })
}

/// "No such file or directory (os error 2)" without the number, which says the same.
fn without_number(text: &str) -> String {
    match text.split_once(" (os error ") {
        Some((before, after)) => {
            before.to_owned() + after.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches(')')
        }
        None => text.to_owned(),
    }
}

/// One line, whatever is in the message.
fn say_error(message: &str) {
    eprintln!("sunfleck: error: {}", one_line(message));
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Why something could not be printed, the first time; told at the end, for what is done may go to files as well.
static UNPRINTED: OnceLock<io::Error> = OnceLock::new();

/// To standard output; a reader that has gone away (`| head`) is no error.
fn print(text: &str) {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => _ = UNPRINTED.set(error),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn causes_are_said_once() {
        let error = anyhow::anyhow!("No such file (os error 2)").context("b: No such file (os error 2)").context("a");
        assert_eq!(super::chain(&error), "a: b: No such file");
        assert_eq!(super::without_number("x (os error 13); y"), "x; y");
        assert_eq!(super::one_line("a\n  b\tc"), "a b c");
    }
}
