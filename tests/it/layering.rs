//! The import order of ARCHITECTURE.md, checked against the sources.

use std::path::Path;

/// Each module with those it may use.
const ALLOWED: [(&str, &[&str]); 13] = [
    ("math", &[]),
    ("index", &["math"]),
    ("device", &["index"]),
    ("files", &[]),
    ("points", &["files", "index", "math"]),
    ("mesh", &["files", "index", "math", "points"]),
    ("layout", &["index", "math"]),
    ("scene", &["files", "mesh", "device", "layout", "index", "math"]),
    ("ppm", &["scene", "layout", "device", "index", "math"]),
    ("cpu", &["ppm", "scene", "layout", "device", "index", "math"]),
    ("gpu", &["ppm", "scene", "layout", "device", "index", "math"]),
    ("inspect", &["cpu", "ppm", "scene", "layout", "device", "index", "math"]),
    ("output", &["files", "ppm", "scene", "layout", "index", "math"]),
];

fn sources(path: &Path, into: &mut Vec<(String, String)>) {
    if path.is_dir() {
        for entry in std::fs::read_dir(path).unwrap() {
            sources(&entry.unwrap().path(), into);
        }
    } else if path.extension().is_some_and(|e| e == "rs") {
        into.push((path.display().to_string(), std::fs::read_to_string(path).unwrap()));
    }
}

#[test]
fn modules_only_use_what_is_left_of_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut checked = 0;
    for (module, allowed) in ALLOWED {
        let mut files = Vec::new();
        for name in [root.join(module), root.join(format!("{module}.rs"))] {
            if name.exists() {
                sources(&name, &mut files);
            }
        }
        assert!(!files.is_empty(), "no module {module}");
        for (file, text) in files {
            for (line, code) in text.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//")) {
                for used in code.match_indices("crate::").map(|(i, _)| &code[i + 7..]) {
                    let name: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    if ALLOWED.iter().any(|(m, _)| *m == name) {
                        checked += 1;
                        let fine = name == module || allowed.contains(&name.as_str());
                        assert!(fine, "{file}:{}: {module} must not use {name}", line + 1);
                    }
                }
            }
        }
    }
    assert!(checked > 50, "only {checked} uses were found: the test has gone blind");
}
