//! `sunfleck bench` as its users meet it, and the points it makes.

use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use glam::Vec3;
use serde_json::Value;
use sunfleck::math::clouds;

fn bench(folder: &Path, args: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sunfleck"));
    command.current_dir(folder).arg("bench").args(args.split_whitespace()).output().unwrap()
}

/// Runs it, and returns what it printed and the rows of its JSON, which must agree with its CSV.
fn rows(folder: &Path, name: &str, args: &str, figures: &[&str]) -> (String, Vec<Value>) {
    let output = bench(folder, &format!("{name} --threads 1 -q -o out {args}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && stderr.lines().all(|line| line.contains("warning")), "{stderr}");
    let out = folder.join("out");
    let json: Value = serde_json::from_slice(&fs::read(out.join(format!("{name}.json"))).unwrap()).unwrap();
    for key in ["sunfleck", "command", "date", "machine", "settings", "notes"] {
        assert!(!json[key].is_null(), "no {key} in {name}.json");
    }
    assert_eq!(json["benchmark"], name);
    assert_eq!(json["machine"]["threads"], 1);
    let rows = json["rows"].as_array().unwrap().clone();
    let csv = fs::read_to_string(out.join(format!("{name}.csv"))).unwrap();
    let header: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    for row in &rows {
        let keys: HashSet<&str> = row.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, header.iter().copied().collect());
    }
    for figure in figures {
        let svg = fs::read_to_string(out.join(format!("{figure}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("<text"), "{figure}");
    }
    assert_eq!(fs::read_dir(&out).unwrap().count(), 2 + figures.len(), "other files were written");
    (String::from_utf8(output.stdout).unwrap(), rows)
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}

/// Every time is positive, and the median lies between the least and the most.
fn assert_times(row: &Value, name: &str) {
    let of = |suffix: &str| number(row, &format!("{name}Ms{suffix}"));
    assert!(of("") > 0.0 && of("Least") <= of("") && of("") <= of("Most"), "{row}");
    assert!(of("Least") <= of("Mean") && of("Mean") <= of("Most"), "{row}");
    #[cfg(unix)]
    assert!(number(row, &format!("{name}CpuMs")) > 0.0, "{row}");
}

fn distinct<'a>(rows: &'a [Value], key: &str) -> HashSet<&'a str> {
    rows.iter().map(|row| row[key].as_str().unwrap()).collect()
}

#[test]
fn search_measures_every_index_at_every_size() {
    let folder = tempfile::tempdir().unwrap();
    let (text, rows) = rows(
        folder.path(),
        "search",
        "--rounds 1 --samples 500,1k --queries 300,200 --radii 0.1,0.05",
        &["figure3", "figure4", "figure5", "figure6"],
    );
    let indices = distinct(&rows, "index");
    assert!(indices.is_superset(&HashSet::from(["bvh8", "bvh2-inflated", "kd-buffered", "kd", "grid"])));
    // Maps: 2 numbers of samples and of queries, 2 radii. Curves: 2 radii.
    for (figure, n) in [(3, 8), (4, 2), (5, 8), (6, 2)] {
        let found = rows.iter().filter(|row| row["figure"] == figure).count();
        assert_eq!(found, n * indices.len(), "figure {figure}");
        assert!(text.contains(&format!("Figure {figure}, ")));
    }
    assert!(text.contains("2080 Ti") && text.contains("core"), "both devices are named");
    for row in &rows {
        assert_times(row, "build");
        assert_times(row, "search");
    }
    // Uniform: n · 4/3 π r³, less what lies outside of the cube.
    let row = rows.iter().find(|r| r["distribution"] == "uniform" && r["samples"] == 1000 && r["radius"] == 0.1);
    let mean = number(row.unwrap(), "neighboursPerQuery");
    assert!((3.0..4.2).contains(&mean), "{mean}");
}

#[test]
fn one_distribution_only_draws_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let args = "--rounds 1 --samples 300 --queries 100 --radii 0.1 --distribution gaussian";
    let (_, rows) = rows(folder.path(), "search", args, &["figure5", "figure6"]);
    assert_eq!(distinct(&rows, "distribution"), HashSet::from(["gaussian"]));
}

#[test]
fn what_makes_no_sense_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (args, code, part) in [
        ("search --radii 0", 2, "above 0"),
        ("search --radii -1", 2, "above 0"),
        ("search --radii x", 2, "not a number"),
        ("search --samples 0", 2, "between 1"),
        ("search --samples 1e3", 2, "not a count"),
        ("search --rounds 0", 2, "--rounds"),
        ("search --threads 0", 2, "--threads"),
        ("search --distribution normal", 2, "uniform"),
        ("search --quick -o file/deeper", 1, "file/deeper"),
        ("search --quick -o file", 1, "file"),
        ("points --points 0", 2, "between 1"),
        ("points --points 1 -q", 1, "no radius"),
        ("photons --scene house", 2, "house"),
        ("photons --scene glass,glass", 2, "twice"),
        ("photons --iterations 0", 2, "--iterations"),
        ("photons --photons many", 2, "not a count"),
        ("photons --backend tpu", 2, "tpu"),
        ("photons -r 1x0", 2, "a side is"),
        ("photons --rounds 3", 2, "--rounds"),
        ("indices --case all", 2, "camera"),
        ("indices --quick -o file/deeper", 1, "file/deeper"),
        ("kd --faces 0", 2, "between 1"),
        ("kd --levels 10", 2, "--levels"),
        ("kd --mesh nothing.obj", 1, "nothing.obj"),
        ("kd --mesh file", 1, "file"),
        ("nothing", 2, "nothing"),
    ] {
        let output = bench(folder.path(), args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args}: {text}");
        assert!(text.starts_with("sunfleck: error: ") && text.matches('\n').count() == 1, "{args}: {text:?}");
        assert!(text.contains(part) && output.stdout.is_empty(), "{args}: {text:?}");
    }
    // The one that failed later had made its folder by then.
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| name == "file" || name == "bench"), "{left:?}");
    assert!(fs::read_dir(folder.path().join("bench")).is_ok_and(|mut files| files.next().is_none()));
}

#[test]
fn points_stand_beside_the_papers_figures() {
    let folder = tempfile::tempdir().unwrap();
    let (text, rows) = rows(folder.path(), "points", "--rounds 2 --points 2k,3k", &["figure7"]);
    let indices = distinct(&rows, "index");
    assert!(indices.is_superset(&HashSet::from(["bvh8", "bvh2-inflated", "kd", "grid"])));
    assert_eq!(rows.len(), 2 * 3 * indices.len());
    for row in &rows {
        let k = number(row, "k");
        let (points, queries) = (number(row, "points"), number(row, "queries"));
        assert_eq!(queries, if k == 1.0 { points / 2.0 } else { points });
        // k are found on average; of those that find more only k count.
        let found = number(row, "foundPerQuery");
        assert!(found <= k && found > 0.5 * k, "{row}");
        assert_times(row, "build");
        assert_times(row, "search");
    }
    assert!(text.contains("FLANN") && text.contains("–"), "no figures of the paper for these sizes: {text}");
}

#[test]
fn photons_compare_three_ways_to_gather() {
    let folder = tempfile::tempdir().unwrap();
    let args = "--scene glass --photons 2k,100k -r 48x27 --iterations 2 --backend cpu";
    let (text, rows) = rows(folder.path(), "photons", args, &["figure9"]);
    assert_eq!(rows.len(), 2 * 3);
    assert_eq!(distinct(&rows, "method"), HashSet::from(["in place", "bvh2-inflated", "kd-buffered"]));
    for row in &rows {
        assert_times(row, "build");
        assert_times(row, "gather");
        assert!(number(row, "photonsStored") > 0.0);
        let renderer = row["method"] == "in place";
        assert_eq!(row["eyeMs"].is_f64() && row["photonsMs"].is_f64() && row["accumulateMs"].is_f64(), renderer);
        assert_eq!(row["mostNeighbours"].is_u64(), !renderer);
    }
    // Of Table 1: glass, 100K; nothing for what the paper did not measure.
    assert!(text.contains("1.3 / 5.6") && text.contains("42 / 8"), "{text}");
    assert_eq!(text.lines().filter(|line| line.contains(" 2K ") && line.contains("–")).count(), 1, "{text}");
}

#[test]
fn normal_mode_needs_nothing_but_the_renderer() {
    let folder = tempfile::tempdir().unwrap();
    let args = "--scene cornell --photons 1k -r 16x9 --iterations 1 --normal-mode --in-place-only --backend cpu";
    let (_, rows) = rows(folder.path(), "photons", args, &["figure9"]);
    assert_eq!(rows.len(), 1);
}

#[test]
fn indices_tell_times_visits_and_costs() {
    let folder = tempfile::tempdir().unwrap();
    let (text, rows) = rows(folder.path(), "indices", "--rounds 1 --samples 2k --queries 300", &["indices"]);
    assert_eq!(distinct(&rows, "case"), HashSet::from(["camera", "shuffled", "uniform", "nearest"]));
    let of = |case: &str, index: &str| {
        let found = rows.iter().find(|row| row["case"] == case && row["index"] == index);
        found.unwrap_or_else(|| panic!("no {index} in {case}")).clone()
    };
    for row in &rows {
        assert_times(row, "search");
        let (case, index) = (row["case"].as_str().unwrap(), row["index"].as_str().unwrap());
        let mean = number(row, "neighboursPerQuery");
        let wanted = if case == "nearest" {
            7.0..8.01
        } else if case == "uniform" {
            25.0..34.0
        } else {
            48.0..52.0
        };
        assert!(wanted.contains(&mean), "{case}, {index}: {mean}");
        if let (Some(sah), Some(vh)) = (row["sah"].as_f64(), row["vh"].as_f64()) {
            assert!(sah >= vh && vh > 0.0, "the proof of the paper's appendix: {row}");
        }
    }
    // Brute force tests every point; a tree tests few; inflated boxes do not see more points than there are.
    assert_eq!(number(&of("uniform", "brute"), "pointsPerQuery"), 2000.0);
    for index in ["bvh8", "bvh2-inflated", "bvh2-tight", "kd", "grid"] {
        let row = of("uniform", index);
        let points = number(&row, "pointsPerQuery");
        assert!(points >= number(&row, "neighboursPerQuery") && points < 1500.0, "{index}: {points}");
    }
    assert!(number(&of("camera", "bvh2-inflated"), "vh") > 0.0);
    of("camera", "queries as boxes");
    assert!(text.contains("SAH") && text.contains("grid, sorted"));
}

#[test]
fn one_case_only() {
    let folder = tempfile::tempdir().unwrap();
    let args = "--rounds 1 --samples 500 --queries 100 --case nearest";
    let (_, rows) = rows(folder.path(), "indices", args, &["indices"]);
    assert_eq!(distinct(&rows, "case"), HashSet::from(["nearest"]));
}

const KD_FIGURES: [&str; 7] =
    ["figure7-2", "figure7-3", "figure7-4", "figure7-5", "figure7-6", "figure7-7", "figure7-8"];

#[test]
fn kd_measures_every_builder_in_every_way() {
    let folder = tempfile::tempdir().unwrap();
    let (text, rows) = rows(folder.path(), "kd", "--rounds 1 --faces 300,501 --levels 1,2", &KD_FIGURES);
    // No tree; three builders: build, and check both ways; rays alone. On one thread, and on all.
    assert_eq!(rows.len(), 4 * 2 * (1 + 3 * 3 + 1));
    assert_eq!(distinct(&rows, "algorithm"), HashSet::from(["no tree", "O(N²)", "O(N log² N)", "O(N log N)"]));
    assert_eq!(distinct(&rows, "operation"), HashSet::from(["build", "check", "lazy", "rays"]));
    let faces = |mesh: &str| -> HashSet<u64> {
        rows.iter().filter(|r| r["mesh"] == mesh).map(|r| r["faces"].as_u64().unwrap()).collect()
    };
    assert_eq!(faces("asteroid"), HashSet::from([300, 502]));
    assert_eq!(faces("sphere"), HashSet::from([80, 320]));
    for row in &rows {
        assert_times(row, "time");
        assert_eq!(row["treeBytes"].is_u64(), row["algorithm"] != "no tree", "{row}");
        #[cfg(unix)]
        assert!(number(row, "utilisation") > 0.0, "{row}");
    }
    for figure in ["7.2", "7.3", "7.4", "7.5", "7.6", "7.7", "7.8"] {
        assert!(text.contains(&format!("Figure {figure}: ")), "{figure}");
    }
    assert!(text.contains("Ryzen") && text.contains("slope") && !text.contains("left out"));
}

#[test]
fn kd_scales_a_mesh_of_the_users() {
    let folder = tempfile::tempdir().unwrap();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    // One face is turned: that is no error, for the mesh is as it is.
    fs::write(folder.path().join("wedge.obj"), format!("{corners}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 4 1\n")).unwrap();
    let args = "--rounds 1 --faces 20000 --levels 0 --mesh wedge.obj";
    let (text, rows) = rows(folder.path(), "kd", args, &KD_FIGURES);
    assert_eq!(distinct(&rows, "mesh"), HashSet::from(["wedge", "sphere"]));
    // Quadratic time is not spent on so many.
    let of_wedge: Vec<Value> = rows.into_iter().filter(|r| r["mesh"] == "wedge").collect();
    assert_eq!(distinct(&of_wedge, "algorithm"), HashSet::from(["O(N log² N)", "O(N log N)"]));
    assert!(text.contains("above 14744 faces they are left out"), "{text}");
}

/// The CPU's search checks the GPU's: other totals are an error.
#[cfg(feature = "gpu")]
#[test]
fn a_gpu_takes_part() {
    if sunfleck::gpu::list_devices().is_empty() {
        assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none(), "no GPU adapter");
        println!("skipped: no GPU adapter");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let args = "--rounds 1 --samples 2k --queries 500 --radii 0.1 --distribution uniform --backend gpu,cpu";
    let (text, found) = rows(folder.path(), "search", args, &["figure3", "figure4"]);
    let gpu: Vec<&Value> = found.iter().filter(|row| row["index"] == "gpu").collect();
    assert_eq!(gpu.len(), 2);
    for row in gpu {
        assert!(number(row, "searchMs") > 0.0 && row["searchCpuMs"].is_null(), "{row}");
    }
    assert!(text.contains(&sunfleck::gpu::list_devices()[0].name));
    let folder = tempfile::tempdir().unwrap();
    let (_, found) = rows(folder.path(), "points", "--rounds 1 --points 1k --backend gpu", &["figure7"]);
    assert_eq!(distinct(&found, "index"), HashSet::from(["gpu"]));
}

fn mean(values: impl Iterator<Item = f32> + Clone) -> f32 {
    values.clone().sum::<f32>() / values.count() as f32
}

#[test]
fn uniform_points_fill_the_cube_evenly() {
    let points = clouds::uniform(40_000, 3);
    assert!(points.iter().all(|p| p.min_element() >= 0.0 && p.max_element() < 1.0));
    let mut cells = [0u32; 64];
    for p in &points {
        let c = (*p * 4.0).as_uvec3();
        cells[(c.x + 4 * c.y + 16 * c.z) as usize] += 1;
    }
    let expected = points.len() as f32 / 64.0;
    let chi2: f32 = cells.iter().map(|&n| (n as f32 - expected).powi(2) / expected).sum();
    assert!(chi2 < 120.0, "χ² {chi2} over 63 degrees of freedom");
    assert_ne!(points, clouds::uniform(40_000, 4));
    assert_eq!(points[..100], clouds::uniform(100, 3));
}

#[test]
fn eight_modes_are_equal_spherical_and_normal() {
    let n = 80_000;
    let points = clouds::gaussian_modes(n, 5);
    let nearest = |p: &Vec3| (0..8).min_by_key(|&k| (p.distance(clouds::mode_centre(k)) * 1e6) as u32).unwrap();
    for k in 0..8 {
        let offsets: Vec<Vec3> = points
            .iter()
            .filter(|p| nearest(p) == k)
            .map(|p| (*p - clouds::mode_centre(k)) / clouds::MODE_SIGMA)
            .collect();
        // n/8 ± 5 standard deviations.
        assert!((offsets.len() as f32 - n as f32 / 8.0).abs() < 5.0 * (n as f32 * 7.0 / 64.0).sqrt());
        for axis in 0..3 {
            let of = |power: i32| mean(offsets.iter().map(move |o| o[axis].powi(power)));
            // Standard errors are 0.01, 0.014 and 0.1 with these numbers.
            assert!(of(1).abs() < 0.05 && (of(2) - 1.0).abs() < 0.07 && (of(4) - 3.0).abs() < 0.5, "mode {k}");
        }
        let correlation = mean(offsets.iter().map(|o| o.x * o.y));
        assert!(correlation.abs() < 0.05, "mode {k}");
    }
    let inside = points.iter().filter(|p| p.min_element() >= 0.0 && p.max_element() <= 1.0).count();
    assert!(inside as f32 > 0.9999 * n as f32);
}

#[test]
fn photons_and_camera_queries_lie_on_the_same_surfaces() {
    let on_surface = |p: &Vec3| {
        let walls = (0..3).any(|axis| p[axis].abs() < 1e-4 || (p[axis] - clouds::ROOM[axis]).abs() < 1e-4);
        walls || (p.distance(clouds::BALL_CENTRE) - clouds::BALL_RADIUS).abs() < 1e-4
    };
    let photons = clouds::room_photons(20_000, 1);
    let size = [96, 54];
    let queries = clouds::room_camera(size, 1);
    assert_eq!(queries.len(), 96 * 54);
    assert!(photons.iter().chain(&queries).all(on_surface));
    let on_ball = |p: &&Vec3| p.distance(clouds::BALL_CENTRE) < clouds::BALL_RADIUS + 1e-3;
    let (room, r) = (clouds::ROOM, clouds::BALL_RADIUS);
    let ball = 4.0 * std::f32::consts::PI * r * r;
    let share = ball / (ball + 2.0 * (room.x * room.y + room.y * room.z + room.z * room.x));
    let found = photons.iter().filter(on_ball).count() as f32;
    let expected = share * photons.len() as f32;
    assert!((found - expected).abs() < 5.0 * expected.sqrt(), "{found} on the ball, {expected} expected");
    assert!(queries.iter().filter(on_ball).count() > 100, "the camera sees the ball");
    // Row by row: neighbours in the list are neighbours in space, and after a shuffle no more.
    let step = |q: &[Vec3]| mean(q.windows(2).map(|w| w[0].distance(w[1])));
    let mut shuffled = queries.clone();
    clouds::shuffle(&mut shuffled, 1);
    assert!(step(&shuffled) > 5.0 * step(&queries));
    let sorted = |q: &[Vec3]| {
        let mut bits: Vec<[u32; 3]> = q.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        bits.sort_unstable();
        bits
    };
    assert_eq!(sorted(&shuffled), sorted(&queries));
}
