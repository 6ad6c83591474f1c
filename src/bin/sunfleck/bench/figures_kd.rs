//! Figures 7.2 to 7.8 of the kd-tree thesis: plots and tables of what `bench kd` measured.

use std::path::PathBuf;

use anyhow::Result;

use super::kd::{Algorithm, BEST, Cell, NO_TREE, Operation, SPHERE, TREES};
use super::plot::{self, Bars, Curves, Series};
use super::report::{self, Machine};
use super::{short, thesis};

/// Of the files, in the order of [`draw`].
pub const NAMES: [&str; 7] =
    ["figure7-2", "figure7-3", "figure7-4", "figure7-5", "figure7-6", "figure7-7", "figure7-8"];

/// A line of a plot, a column of a table.
struct Line {
    name: String,
    algorithm: Algorithm,
    operation: Operation,
}

impl Line {
    fn new(algorithm: Algorithm, operation: Operation) -> Self {
        let name = match operation {
            Operation::Rays => "prebuilt",
            _ => algorithm.name,
        };
        Self { name: name.to_owned(), algorithm, operation }
    }

    /// In order of faces; times in milliseconds.
    fn cells<'a>(&self, cells: &'a [Cell], mesh: &str, is_parallel: bool) -> Vec<&'a Cell> {
        let fits = |c: &&Cell| {
            (c.algorithm, c.operation, c.is_parallel) == (self.algorithm, self.operation, is_parallel) && c.mesh == mesh
        };
        let mut found: Vec<&Cell> = cells.iter().filter(fits).collect();
        found.sort_by_key(|c| c.faces);
        found
    }
}

/// Of the check, built `how`; and of the prebuilt tree.
fn checks(how: Operation) -> Vec<Line> {
    let trees = TREES.map(|algorithm| Line::new(algorithm, how));
    let mut lines = vec![Line::new(NO_TREE, Operation::Check)];
    lines.extend(trees);
    lines.push(Line::new(BEST, Operation::Rays));
    lines
}

fn builds() -> Vec<Line> {
    TREES.map(|algorithm| Line::new(algorithm, Operation::Build)).into()
}

/// One panel of curves, or table.
struct Panel {
    title: &'static str,
    lines: Vec<Line>,
}

fn panels() -> [Panel; 3] {
    [
        Panel { title: "check, tree built where rays come", lines: checks(Operation::Lazy) },
        Panel { title: "check, tree built first", lines: checks(Operation::Check) },
        Panel { title: "build alone", lines: builds() },
    ]
}

/// Figure, of a sphere, on all threads, which of [`panels`].
type Figure = (&'static str, bool, bool, &'static [usize]);

const CURVES: [Figure; 6] = [
    ("7.2", false, false, &[0, 1]),
    ("7.3", false, false, &[2]),
    ("7.4", true, false, &[0, 1, 2]),
    ("7.5", false, true, &[0, 1]),
    ("7.6", false, true, &[2]),
    ("7.8", true, true, &[0, 1, 2]),
];

/// Busy threads.
const FIGURE_7: &str = "7.7";

/// Of [`Cell::ms`].
fn unit(is_parallel: bool) -> &'static str {
    if cfg!(unix) && !is_parallel { "ms of CPU" } else { "ms" }
}

fn title(figure: &str, mesh: &str, is_parallel: bool) -> String {
    format!("Figure {figure}: {mesh}, {}", if is_parallel { "all threads" } else { "one thread" })
}

pub fn draw(paths: &[PathBuf; 7], mesh: &str, cells: &[Cell]) -> Result<()> {
    let panels = panels();
    for (figure, is_sphere, is_parallel, which) in CURVES {
        let mesh = if is_sphere { SPHERE } else { mesh };
        let curves: Vec<Curves> = which.iter().map(|&i| curves(&panels[i], mesh, is_parallel, cells)).collect();
        plot::curves(path(paths, figure), &title(figure, mesh, is_parallel), &curves, curves.len())?;
    }
    draw_utilisation(path(paths, FIGURE_7), mesh, cells)
}

fn path<'a>(paths: &'a [PathBuf; 7], figure: &str) -> &'a PathBuf {
    let name = format!("figure{}", figure.replace('.', "-"));
    &paths[NAMES.iter().position(|n| *n == name).unwrap_or(0)]
}

fn curves(panel: &Panel, mesh: &str, is_parallel: bool, cells: &[Cell]) -> Curves {
    let series = panel.lines.iter().map(|line| {
        let points = line.cells(cells, mesh, is_parallel).iter().map(|c| (c.faces as f64, c.ms())).collect();
        Series { name: line.name.clone(), points }
    });
    Curves {
        title: panel.title.to_owned(),
        x: "faces",
        y: unit(is_parallel),
        series: series.filter(|s| !s.points.is_empty()).collect(),
    }
}

const BUSY: [(Operation, &str); 3] =
    [(Operation::Build, "build"), (Operation::Lazy, "check, lazily"), (Operation::Rays, "rays, prebuilt")];

fn draw_utilisation(path: &std::path::Path, mesh: &str, cells: &[Cell]) -> Result<()> {
    let at = |operation, faces| {
        let found = Line::new(BEST, operation).cells(cells, mesh, true);
        found.into_iter().find(|c| c.faces == faces).and_then(Cell::utilisation).map_or(f64::NAN, |share| 100.0 * share)
    };
    let sizes = Line::new(BEST, Operation::Build).cells(cells, mesh, true);
    let groups = sizes.iter().map(|c| {
        let bars = BUSY.map(|(operation, name)| (name.to_owned(), vec![at(operation, c.faces)]));
        (short(c.faces), bars.into())
    });
    let bars = Bars {
        title: format!("{}, by faces", BEST.name),
        y: "% of the threads' time",
        parts: vec!["busy"],
        groups: groups.collect(),
    };
    plot::bars(path, &title(FIGURE_7, mesh, true), &[bars], 1)
}

pub fn print(machine: &Machine, mesh: &str, cells: &[Cell], left_out: Option<&str>) {
    crate::print(&format!("\nOurs: {}. The thesis': {}.", machine.line(), thesis::DEVICE));
    if let Some(left_out) = left_out {
        crate::print(left_out);
    }
    let panels = panels();
    for (figure, is_sphere, is_parallel, which) in CURVES {
        let mesh = if is_sphere { SPHERE } else { mesh };
        for &i in which {
            let table = table(figure, &panels[i], mesh, is_parallel, cells);
            let (title, unit) = (title(figure, mesh, is_parallel), unit(is_parallel));
            crate::print(&format!("\n{title}: {}, {unit}.\n{table}", panels[i].title));
        }
        crate::print(thesis::claim(figure));
        if figure == "7.6" {
            print_utilisation(mesh, cells);
        }
    }
    print_trees(mesh, cells);
}

/// Times, the thesis' where it states them, and the slope of each column.
fn table(figure: &str, panel: &Panel, mesh: &str, is_parallel: bool, cells: &[Cell]) -> String {
    let columns: Vec<Vec<&Cell>> = panel.lines.iter().map(|line| line.cells(cells, mesh, is_parallel)).collect();
    let mut sizes: Vec<usize> = columns.iter().flatten().map(|c| c.faces).collect();
    sizes.sort_unstable();
    sizes.dedup();
    // It states times of one mesh only, built lazily.
    let is_stated = |faces| figure == "7.5" && faces == thesis::FACES;
    let is_beside = sizes.iter().any(|&faces| is_stated(faces));
    let mut header = vec!["faces"];
    header.extend(panel.lines.iter().map(|line| line.name.as_str()));
    if is_beside {
        header.extend(["thesis, no tree", "thesis, O(N log N)"]);
    }
    let mut rows: Vec<Vec<String>> = Vec::new();
    for faces in sizes {
        let mut row = vec![faces.to_string()];
        row.extend(columns.iter().map(|column| {
            let found = column.iter().find(|c| c.faces == faces);
            found.map_or("–".to_owned(), |c| report::figure(c.ms()))
        }));
        if is_beside {
            let [with, without] = thesis::CHECK;
            row.extend([without, with].map(|s| match is_stated(faces) {
                true => report::figure(1e3 * s),
                false => "–".to_owned(),
            }));
        }
        rows.push(row);
    }
    let mut slopes = vec!["slope".to_owned()];
    slopes.extend(columns.iter().map(|column| {
        let points: Vec<(f64, f64)> = column.iter().map(|c| (c.faces as f64, c.ms())).collect();
        report::figure(slope(&points))
    }));
    slopes.resize(header.len(), String::new());
    rows.push(slopes);
    report::table(&header, 1, rows)
}

/// Of log y over log x, by least squares; NaN of fewer than two places.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let of = |f: fn(f64, f64) -> f64| logs.iter().map(|p| f(p.0 - x, p.1 - y)).sum::<f64>();
    of(|dx, dy| dx * dy) / of(|dx, _| dx * dx)
}

fn print_utilisation(mesh: &str, cells: &[Cell]) {
    let columns = BUSY.map(|(operation, _)| Line::new(BEST, operation).cells(cells, mesh, true));
    let percent = |cell: &Cell| cell.utilisation().map_or("–".to_owned(), |share| report::figure(100.0 * share));
    let rows = columns[0].iter().map(|first| {
        let mut row = vec![first.faces.to_string()];
        let at = |column: &Vec<&Cell>| column.iter().find(|c| c.faces == first.faces).map(|cell| percent(cell));
        row.extend(columns.iter().map(|column| at(column).unwrap_or_else(|| "–".to_owned())));
        row
    });
    let mut header = vec!["faces"];
    header.extend(BUSY.map(|(_, name)| name));
    crate::print(&format!(
        "\n{}: {}, percent of the threads' time that was spent computing.\n{}\n{}",
        title(FIGURE_7, mesh, true),
        BEST.name,
        report::table(&header, 1, rows),
        thesis::claim(FIGURE_7),
    ));
}

fn print_trees(mesh: &str, cells: &[Cell]) {
    let build = Line::new(BEST, Operation::Build);
    let found = [mesh, SPHERE].map(|mesh| build.cells(cells, mesh, false));
    let rows = found.iter().flatten().map(|c| {
        let bytes = c.bytes.unwrap_or(0) as f64;
        let thesis = match c.faces == thesis::FACES && c.mesh != SPHERE {
            true => format!("{} MB", thesis::TREE_MB),
            false => "–".to_owned(),
        };
        let a_face = report::figure(bytes / c.faces as f64);
        vec![c.mesh.clone(), c.faces.to_string(), report::figure(bytes / 1e6), a_face, thesis]
    });
    let header = ["mesh", "faces", "tree, MB", "bytes a face", "thesis"];
    crate::print(&format!("\nMemory of the tree.\n{}", report::table(&header, 1, rows)));
}

#[cfg(test)]
mod tests {
    use super::slope;

    #[test]
    fn slopes() {
        let cubic: Vec<(f64, f64)> = [1.0f64, 2.0, 5.0, 40.0].map(|x| (x, 7.0 * x.powi(3))).into();
        assert!((slope(&cubic) - 3.0).abs() < 1e-12);
        assert!(slope(&cubic[..1]).is_nan());
    }
}
