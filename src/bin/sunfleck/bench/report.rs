//! What a benchmark leaves behind: JSON, CSV, tables on the terminal.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, Result};
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;
use serde_json::{Map, Value};
use sunfleck::output::{self, atomic};

use super::measure::{Spread, Times};

/// One line of results: named figures, the same names in each line of a report.
#[derive(Clone, Debug, Default)]
pub struct Row(Vec<(String, Value)>);

impl Row {
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.0.push((name.to_owned(), value.into()));
        self
    }

    /// The decimal that is meant, not the binary number nearest to it.
    pub fn with_length(self, name: &str, length: f32) -> Self {
        self.with(name, length.to_string().parse::<f64>().ok())
    }

    /// Milliseconds, as `{name}Ms` (median) and `{name}MsMean`, `…Least`, `…Most`, and CPU milliseconds as `{name}CpuMs`.
    pub fn with_times(self, name: &str, times: &Times) -> Self {
        let Spread { median, mean, least, most } = times.wall();
        // To the nanosecond.
        let ms = |seconds: f64| (seconds * 1e9).round() / 1e6;
        self.with(&format!("{name}Ms"), ms(median))
            .with(&format!("{name}MsMean"), ms(mean))
            .with(&format!("{name}MsLeast"), ms(least))
            .with(&format!("{name}MsMost"), ms(most))
            .with(&format!("{name}CpuMs"), times.cpu().map(|cpu| ms(cpu.median)))
    }
}

/// Who computed.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Machine {
    /// As the backends name themselves.
    pub devices: Vec<String>,
    /// As the system names it.
    pub processor: String,
    /// Logical.
    pub cores: usize,
    /// That were used.
    pub threads: usize,
}

impl Machine {
    /// This one, with what the backends call their devices.
    pub fn here(devices: Vec<String>) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { devices, processor: processor(), cores, threads: rayon::current_num_threads() }
    }

    /// In one line.
    pub fn line(&self) -> String {
        let s = |n: usize| if n == 1 { "" } else { "s" };
        let (cores, threads) = (self.cores, self.threads);
        let mut line = format!("{}, {cores} core{}, {threads} thread{}", self.processor, s(cores), s(threads));
        for device in self.devices.iter().filter(|device| !device.starts_with("CPU")) {
            line += &format!("; {device}");
        }
        line
    }
}

fn processor() -> String {
    let named = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    format!("{} ({})", named.unwrap_or_else(|| "processor".into()), std::env::consts::ARCH)
}

/// Everything a run found.
pub struct Report {
    /// `search`, `points`, `photons` or `indices`: the files' names.
    pub name: &'static str,
    pub machine: Machine,
    /// With the defaults filled in.
    pub settings: Value,
    /// What the figures are and where they depart from the paper.
    pub notes: &'static [&'static str],
    pub rows: Vec<Row>,
}

impl Report {
    /// The files of [`Report::write`].
    pub fn files(folder: &Path, name: &str) -> [PathBuf; 2] {
        ["json", "csv"].map(|extension| folder.join(format!("{name}.{extension}")))
    }

    /// Writes JSON and CSV.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let [json, csv] = Self::files(folder, self.name);
        let mut text = serde_json::to_vec_pretty(&self.json()?)?;
        text.push(b'\n');
        atomic::write(&json, |writer| writer.write_all(&text))?;
        let text = self.csv()?;
        atomic::write(&csv, |writer| writer.write_all(&text))?;
        Ok(())
    }

    fn json(&self) -> Result<Value> {
        let rows: Vec<Value> = self.rows.iter().map(|row| Value::Object(row.0.iter().cloned().collect())).collect();
        let mut file = Map::new();
        file.insert("sunfleck".into(), output::VERSION.into());
        file.insert("benchmark".into(), self.name.into());
        file.insert("command".into(), crate::render::command_line().into());
        file.insert("date".into(), humantime::format_rfc3339_seconds(SystemTime::now()).to_string().into());
        file.insert("release".into(), (!cfg!(debug_assertions)).into());
        file.insert("machine".into(), serde_json::to_value(&self.machine)?);
        file.insert("settings".into(), self.settings.clone());
        file.insert("notes".into(), self.notes.into());
        file.insert("rows".into(), rows.into());
        Ok(Value::Object(file))
    }

    fn csv(&self) -> Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        if let Some(first) = self.rows.first() {
            writer.write_record(first.0.iter().map(|(name, _)| name))?;
        }
        for row in &self.rows {
            writer.write_record(row.0.iter().map(|(_, value)| match value {
                Value::Null => String::new(),
                Value::String(text) => text.clone(),
                other => other.to_string(),
            }))?;
        }
        writer.into_inner().context("the CSV cannot be finished")
    }
}

/// A table for the terminal: all but the first `text_columns` columns are numbers.
pub fn table(header: &[&str], text_columns: usize, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header.to_vec());
    table.add_rows(rows);
    for column in table.column_iter_mut().skip(text_columns) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// Three significant digits, as far as the decimal point.
pub fn figure(x: f64) -> String {
    match x.abs() {
        _ if !x.is_finite() => "–".to_owned(),
        a if a >= 99.95 || a == 0.0 => format!("{x:.0}"),
        a if a >= 9.995 => format!("{x:.1}"),
        a if a >= 0.0995 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}

/// "median (least – most)" of wall milliseconds.
pub fn milliseconds(times: &Times) -> String {
    let Spread { median, least, most, .. } = times.wall();
    format!("{} ({} – {})", figure(1e3 * median), figure(1e3 * least), figure(1e3 * most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures() {
        assert_eq!(figure(1234.5), "1234");
        assert_eq!(figure(99.96), "100");
        assert_eq!(figure(9.999), "10.0");
        assert_eq!(figure(1.234), "1.23");
        assert_eq!(figure(0.012), "0.0120");
        assert_eq!(figure(f64::NAN), "–");
    }
}
