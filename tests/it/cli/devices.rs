//! What computes: backends, accelerators and indices, by flag and by file.

use super::*;

#[cfg(target_os = "linux")]
#[test]
fn a_gpu_that_is_not_there() {
    let folder = folder_with_floor();
    let output = Command::new(PROGRAM)
        .current_dir(folder.path())
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")
        .env("LIBGL_DRIVERS_PATH", "/nonexistent")
        .env("GBM_BACKENDS_PATH", "/nonexistent")
        .args(words("render floor.gltf -o a.png --backend gpu"))
        .output()
        .unwrap();
    assert_error(&output, 1, &["GPU"]);
}

#[test]
fn both_accelerators_make_the_same_picture() {
    let folder = folder_with_floor();
    let args = "render floor.gltf -r 32x16 --photons 2k --iterations 2 -v";
    let render = |name: &str, options: &str| {
        let output = sunfleck(folder.path(), words(&format!("{args} {options} -o {name}.exr --json {name}.json")));
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stderr(&output).contains(&format!("accelerator: {name}")), "{}", stderr(&output));
        let report = std::fs::read_to_string(folder.path().join(format!("{name}.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let device = &report["device"];
        assert_eq!((device["backend"].as_str(), device["accelerator"].as_str()), (Some("cpu"), Some(name)));
        output::exr::read(&folder.path().join(format!("{name}.exr"))).unwrap()
    };
    // Alone it chooses the CPU.
    let difference = output::compare::compare(&render("kd", "--accel kd"), &render("bvh", "--backend cpu")).unwrap();
    assert_eq!(difference.rel_mse, 0.0, "{difference:?}");
}

/// A file travels between machines: what it asks for and one of them cannot do is left, with a line that says so. Flags
/// say over it.
#[test]
fn a_file_says_how_to_search_as_far_as_the_device_can() {
    let folder = folder_with_floor();
    let settings = "scene = \"floor.gltf\"\nphotons = \"2k\"\niterations = 2\nsize = [32, 16]\n";
    fs::write(folder.path().join("kd.toml"), format!("{settings}accel = \"kd\"\n")).unwrap();
    fs::write(folder.path().join("hardware.toml"), format!("{settings}index = \"hardware\"\n")).unwrap();
    let render = |args: &str, used: &str, warnings: &[&str]| {
        let output = sunfleck(folder.path(), words(&format!("render {args} -v -o a.exr")));
        let text = stderr(&output);
        assert!(output.status.success() && text.contains(used), "{args}: {text}");
        let said: Vec<&str> = text.lines().filter(|line| line.contains("warning: ")).collect();
        let are_they =
            said.len() == warnings.len() && said.iter().zip(warnings).all(|(line, part)| line.contains(part));
        assert!(are_they, "{args}: {said:?}");
    };
    render("kd.toml --backend cpu", "index: tree, accelerator: kd", &[]);
    render("kd.toml --backend cpu --accel bvh", "accelerator: bvh", &[]);
    render("kd.toml --backend cpu --set accel=bvh", "accelerator: bvh", &[]);
    render("kd.toml --set accel=bvh --accel kd", "accelerator: kd", &[]);
    render("hardware.toml --backend cpu", "index: tree", &["hardware.toml: index: "]);
    render("hardware.toml --backend cpu --index tree", "index: tree", &[]);
    let list = String::from_utf8(sunfleck(folder.path(), ["--list-devices"]).stdout).unwrap();
    let Some(first) = list.lines().next().filter(|_| list.lines().count() > 1) else {
        assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none_or(|v| v != "1"), "no GPU adapter");
        println!("skipped on a GPU: no adapter");
        return;
    };
    render("kd.toml --device 0", "accelerator: bvh", &["kd.toml: accel: "]);
    render("kd.toml --device 0 --accel bvh", "accelerator: bvh", &[]);
    if first.contains("ray queries") {
        render("hardware.toml --device 0", "index: hardware", &[]);
        render("hardware.toml --device 0 --index tree", "index: tree", &[]);
        render("hardware.toml --device 0 --set index=", "index: tree", &[]);
    } else {
        assert!(std::env::var_os("SUNFLECK_REQUIRE_RAY_QUERY").is_none(), "no ray queries: {first}");
        render("hardware.toml --device 0", "index: tree", &["hardware.toml: index: "]);
    }
}

#[cfg(feature = "gpu")]
#[test]
fn both_backends_make_the_same_picture() {
    let folder = folder_with_floor();
    let list = String::from_utf8(sunfleck(folder.path(), ["--list-devices"]).stdout).unwrap();
    if list.lines().count() < 2 {
        assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none_or(|v| v != "1"), "no GPU adapter");
        println!("skipped: no GPU adapter");
        return;
    }
    let args = "render floor.gltf -r 32x16 --photons 2k --iterations 2 --radius 0.2";
    let render = |name: &str, options: &str| {
        let output = sunfleck(folder.path(), words(&format!("{args} {options} -o {name}.exr --json {name}.json")));
        assert!(output.status.success(), "{}", stderr(&output));
        output::exr::read(&folder.path().join(format!("{name}.exr"))).unwrap()
    };
    let cpu = render("cpu", "--backend cpu");
    let same = |picture| {
        let difference = output::compare::compare(&picture, &cpu).unwrap();
        assert!(difference.rel_mse_trimmed < 1e-4, "{difference:?}");
        assert!(difference.relative_mean_difference.is_some_and(|share| share.abs() < 1e-3), "{difference:?}");
    };
    same(render("gpu", "--backend gpu"));
    if !list.contains("ray queries") {
        assert!(std::env::var_os("SUNFLECK_REQUIRE_RAY_QUERY").is_none(), "no GPU adapter with ray queries");
        println!("skipped: no GPU adapter with ray queries");
        return;
    }
    same(render("rays", "--backend gpu --index hardware"));
    let report = std::fs::read_to_string(folder.path().join("rays.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["device"]["index"], "hardware");
}
