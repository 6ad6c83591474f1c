//! Tells the program which commit it was built from; "unknown" where git cannot say.

use std::process::Command;

fn git(args: &[&str]) -> Option<String> {
    let folder = std::env::var("CARGO_MANIFEST_DIR").ok()?;
    let output = Command::new("git").arg("-C").arg(folder).args(args).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Cargo takes a file that is not there for one that always changes.
fn rerun_if_changed(path: &str) {
    if std::path::Path::new(path).exists() {
        println!("cargo::rerun-if-changed={path}");
    }
}

fn commit() -> Option<String> {
    // A copy inside somebody else's repository (a vendored crate) has no commit of its own.
    if !git(&["rev-parse", "--show-prefix"])?.is_empty() {
        return None;
    }
    for name in ["HEAD", "packed-refs", &git(&["rev-parse", "--symbolic-full-name", "HEAD"])?] {
        rerun_if_changed(&git(&["rev-parse", "--git-path", name])?);
    }
    let changed = !git(&["status", "--porcelain", "--", "src", "shaders", "Cargo.toml", "Cargo.lock"])?.is_empty();
    Some(git(&["rev-parse", "--short=12", "HEAD"])? + if changed { "+" } else { "" })
}

fn main() {
    for input in ["build.rs", "src", "shaders", "Cargo.toml", "Cargo.lock"] {
        rerun_if_changed(input);
    }
    println!("cargo::rustc-env=SUNFLECK_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
}
