//! The `sunfleck` program: parse, dispatch, exit code.

mod cli;
mod compare;
mod devices;
mod job;
mod progress;
mod render;
mod report;
mod scenes;
mod stop;

use std::process::ExitCode;

use cli::{Cli, Command};

/// Interrupted, and what there was has been saved.
const INTERRUPTED: u8 = 130;

/// For someone who typed nothing but the name.
const GREETING: &str = "\
sunfleck renders light: caustics included, from a scene file to a picture.

  sunfleck render glass -o glass.png         a scene that comes with it
  sunfleck render my.glb -o my.exr -o my.png one of yours: .glb .gltf .obj
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
        (Some(Command::Scenes), _) => scenes::list(),
        (Some(Command::Export(args)), _) => scenes::export(args),
        (Some(Command::Compare(args)), _) => compare::run(args),
        (None, _) => {
            eprintln!("{GREETING}");
            return ExitCode::from(cli::USAGE);
        }
    };
    done.unwrap_or_else(|error| {
        let usage = error.is::<cli::Usage>();
        say_error(&format!("{error:#}"));
        if usage { ExitCode::from(cli::USAGE) } else { ExitCode::FAILURE }
    })
}

/// One line, whatever is in the message.
fn say_error(message: &str) {
    eprintln!("sunfleck: error: {}", one_line(message));
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// To standard output; a reader that has gone away (`| head`) is no error.
fn print(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stdout(), "{text}");
}
