//! Plots of how the estimate converges. egui_plot has no logarithmic axes: logarithms are plotted, their powers written.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use eframe::egui;
use egui_plot::{AxisHints, GridInput, GridMark, HoverPosition, Line, LineStyle, Plot, PlotPoints, Points};
use sunfleck::inspect;
use sunfleck::ppm::StageTimes;

use super::app::Viewer;
use super::charts::rgb;
use super::engine::{History, Measured, Record};
use crate::progress;

/// Points a line, at most.
const MOST_POINTS: usize = 500;
/// The same where a point is the mean over the iterations since the one before it: the clock's noise is not to fill the plot.
const MOST_MEANS: usize = 100;
/// Width below which fewer plots stand side by side, points.
const LEAST_WIDTH: f32 = 210.0;

/// Decades that a logarithmic axis shows, at most.
const MOST_DECADES: f64 = 100.0;
/// Span of a linear axis, at most.
const MOST_LINEAR: f64 = 1e9;

/// Width that the errors need beside the choice of plots, points.
const FIGURES_WIDTH: f32 = 380.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    Error,
    Radius,
    Rate,
    Stages,
}

const KINDS: [Kind; 4] = [Kind::Error, Kind::Radius, Kind::Rate, Kind::Stages];

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Error => "Error",
            Self::Radius => "Radius",
            Self::Rate => "Photons/s",
            Self::Stages => "Stages",
        }
    }

    fn describe(self) -> &'static str {
        match self {
            Self::Error => {
                "relMSE: noise as estimated from the two halves of the iterations, in which a single bright pixel (a \
                 firefly) counts little and the blur of the radius nothing; against the reference, if there is one, \
                 where one such pixel may rule, and without the worst thousandth of the pixels \
                 (trimmed); and the slopes of the theory (Knaus & Zwicker 2011)"
            }
            Self::Radius => "median radius of the estimate",
            Self::Rate => "photons emitted and photons stored, a second",
            Self::Stages => "milliseconds of each stage of an iteration; on a GPU from timestamps where it has them",
        }
    }

    fn is_log(self) -> bool {
        self != Self::Stages
    }

    /// A value on the axis, as people write it.
    fn value(self, y: f64) -> String {
        match self {
            Self::Error => format!("{:.2e}", 10f64.powf(y)),
            Self::Radius => progress::length(10f64.powf(y) as f32),
            Self::Rate => progress::with_prefix(10f64.powf(y)).trim_end().to_owned(),
            Self::Stages => format!("{y:.2} ms"),
        }
    }

    /// The same at a grid line.
    fn mark(self, y: f64) -> String {
        match self {
            Self::Error => format!("{:.0e}", 10f64.powf(y)),
            Self::Stages => format!("{y}"),
            _ => self.value(y),
        }
    }
}

/// What is shown, and the lines as they were last made.
pub struct Convergence {
    by_seconds: bool,
    shown: [bool; KINDS.len()],
    /// Lines that are not drawn.
    pub hidden: Hidden,
    made_of: Option<Key>,
    curves: [Vec<Curve>; KINDS.len()],
}

impl Default for Convergence {
    fn default() -> Self {
        Self {
            by_seconds: false,
            shown: [true; KINDS.len()],
            hidden: Hidden::new(),
            made_of: None,
            curves: Default::default(),
        }
    }
}

type Hidden = BTreeSet<(Kind, Place)>;

/// Which of a plot's lines it is, whatever others there are: its colour goes by the number, which a dashed one shares with the
/// line that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    number: u32,
    dashed: bool,
}

impl Place {
    fn color(self) -> egui::Color32 {
        rgb(inspect::bounce_color(2 + self.number)) // The first are hard to see on white.
    }
}

/// What lines depend on.
type Key = (Option<Record>, Option<Measured>, Option<Measured>, bool);

/// A line, in the units of its axes.
#[derive(Clone, Debug, PartialEq)]
struct Curve {
    name: String,
    points: Vec<[f64; 2]>,
    place: Place,
}

/// Points of the history, few enough to draw.
#[derive(Clone)]
struct Sample {
    records: Vec<Record>,
    /// Fewer of them.
    means: Vec<Record>,
    estimated: Vec<Measured>,
    against_reference: Vec<Measured>,
}

impl Sample {
    fn of(history: &History) -> Self {
        Self {
            records: history.records.sample(MOST_POINTS),
            means: history.records.sample(MOST_MEANS),
            estimated: history.estimated.sample(MOST_POINTS),
            against_reference: history.against_reference.sample(MOST_POINTS),
        }
    }
}

/// The panel.
pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let by_seconds = viewer.convergence.by_seconds;
    let made_of = viewer.convergence.made_of;
    let read = |history: &History| {
        let last = |of: &super::engine::Series<Measured>| of.last().copied();
        let key =
            (history.records.last().copied(), last(&history.estimated), last(&history.against_reference), by_seconds);
        (key, (made_of != Some(key)).then(|| Sample::of(history)))
    };
    let (key, sample) = viewer.engine().history(read);
    let alpha = viewer.now.snapshot.as_ref().map_or(2.0 / 3.0, |snapshot| f64::from(snapshot.params.alpha));
    let view = &mut viewer.convergence;
    if let Some(sample) = sample {
        view.curves = KINDS.map(|kind| curves(kind, &sample, alpha, by_seconds));
        view.made_of = Some(key);
    }
    heading(ui, view, key);
    let shown: Vec<usize> = (0..KINDS.len()).filter(|&i| view.shown[i]).collect();
    let room = (ui.available_width() / LEAST_WIDTH).max(1.0) as usize;
    let shown = &shown[..shown.len().min(room)];
    if shown.is_empty() || key.0.is_none() {
        ui.weak(if shown.is_empty() { "No plot is chosen." } else { "Nothing to plot before the first iteration." });
        // Or the panel would shrink at every restart.
        ui.allocate_space(ui.available_size());
        return;
    }
    ui.columns(shown.len(), |columns| {
        for (ui, &i) in columns.iter_mut().zip(shown) {
            title(ui, KINDS[i], &view.curves[i], &mut view.hidden);
            plot(ui, KINDS[i], &view.curves[i], &view.hidden, by_seconds);
        }
    });
}

/// What is plotted against what, and the last errors.
fn heading(ui: &mut egui::Ui, view: &mut Convergence, (_, estimated, measured, _): Key) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut view.by_seconds, false, "Iterations").on_hover_text("Plot against iterations");
        let seconds = "Plot against seconds since the restart, pauses left out";
        ui.selectable_value(&mut view.by_seconds, true, "Seconds").on_hover_text(seconds);
        ui.separator();
        for (kind, shown) in KINDS.iter().zip(&mut view.shown) {
            let help = "Drag to shift a plot, Ctrl and wheel to zoom, double click to see all of it";
            ui.checkbox(shown, kind.name()).on_hover_text(format!("{}. {help}.", kind.describe()));
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            // The estimate is of what is left without fireflies, and so is what is trimmed.
            let trimmed = |m: &Measured| m.trimmed.map_or(String::new(), |trimmed| format!(" ({trimmed:.2e} trimmed)"));
            let text = [("measured", measured), ("estimated", estimated)]
                .iter()
                .filter_map(|(what, last)| last.as_ref().map(|m| format!("{what} {:.2e}{}", m.rel_mse, trimmed(m))))
                .collect::<Vec<_>>();
            if !text.is_empty() && ui.available_width() >= FIGURES_WIDTH {
                ui.label(format!("relMSE {}", text.join(", "))).on_hover_text(Kind::Error.describe());
            }
        });
    });
}

/// What is plotted, and the names of its lines: over the plot, where they hide none of it.
fn title(ui: &mut egui::Ui, kind: Kind, curves: &[Curve], hidden: &mut Hidden) {
    let unit = match kind {
        Kind::Error => "Error, relMSE",
        Kind::Radius => "Radius",
        Kind::Rate => "Photons a second",
        Kind::Stages => "Stages, ms",
    };
    ui.horizontal_wrapped(|ui| {
        ui.strong(unit).on_hover_text(kind.describe());
        ui.spacing_mut().item_spacing.x = 3.0;
        for curve in curves.iter().filter(|_| curves.len() > 1) {
            let line = (kind, curve.place);
            let is_shown = !hidden.contains(&line);
            let color = curve.place.color().gamma_multiply(if is_shown { 1.0 } else { 0.3 });
            let name = egui::RichText::new(&curve.name);
            let name = if is_shown { name.small() } else { name.small().weak() };
            let dash = egui::RichText::new(if curve.place.dashed { "- -" } else { "—" }).color(color).strong();
            let button = ui.add(egui::Button::new((dash, name)).frame(false));
            button.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_shown, &curve.name));
            if button.on_hover_text("Click to hide this line, or to show it again").clicked() && !hidden.remove(&line) {
                hidden.insert(line);
            }
        }
    });
}

fn plot_id(ui: &egui::Ui, kind: Kind, by_seconds: bool) -> egui::Id {
    ui.make_persistent_id(("convergence", kind.name(), by_seconds))
}

fn plot(ui: &mut egui::Ui, kind: Kind, curves: &[Curve], hidden: &Hidden, by_seconds: bool) {
    let x_value = move |x: f64| match by_seconds {
        true => progress::seconds(10f64.powf(x)),
        false => format!("{:.0}", 10f64.powf(x)),
    };
    let x_mark = move |mark: GridMark, range: &RangeInclusive<f64>| {
        let text = || if by_seconds { small_number(10f64.powf(mark.value)) } else { count(10f64.powf(mark.value)) };
        if is_labelled(mark.value, range) { text() } else { String::new() }
    };
    let y_mark = move |mark: GridMark, range: &RangeInclusive<f64>| {
        if !kind.is_log() || is_labelled(mark.value, range) { kind.mark(mark.value) } else { String::new() }
    };
    let label = move |at: &HoverPosition<'_>| {
        // Elsewhere the height is no value of anything.
        let HoverPosition::NearDataPoint { plot_name, position, .. } = at else { return None };
        let x = x_value(position.x);
        let x = match (by_seconds, &*x) {
            (true, _) => x,
            (false, "1") => "1 iteration".to_owned(),
            (false, n) => format!("{n} iterations"),
        };
        Some(format!("{plot_name}\n{}\n{x}", kind.value(position.y)))
    };
    let group = egui::Id::unique("convergence cursor");
    let mut plot = Plot::new(kind.name())
        .id(plot_id(ui, kind, by_seconds))
        .height(ui.available_height().max(40.0))
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .link_cursor(group, [true, false])
        .x_grid_spacer(log_marks)
        .custom_x_axes(vec![AxisHints::new_x().label_spacing(16.0..=24.0).formatter(x_mark)])
        .custom_y_axes(vec![AxisHints::new_y().label_spacing(12.0..=18.0).min_thickness(44.0).formatter(y_mark)])
        .label_formatter(label);
    if kind.is_log() {
        plot = plot.y_grid_spacer(log_marks);
        // A radius that has hardly changed is not to fill the height.
        let ys = || curves.iter().flat_map(|curve| &curve.points).map(|point| point[1]);
        let (least, most) = (ys().fold(f64::INFINITY, f64::min), ys().fold(f64::NEG_INFINITY, f64::max));
        if most >= least && most - least < 0.5 {
            let middle = 0.5 * (least + most);
            plot = plot.include_y(middle - 0.25).include_y(middle + 0.25);
        }
    } else {
        plot = plot.include_y(0.0);
    }
    let most = [MOST_DECADES, if kind.is_log() { MOST_DECADES } else { MOST_LINEAR }];
    plot.show(ui, |plot| {
        // Where somebody has zoomed: bounds that follow the lines are not to be held, and may be infinite before there are any.
        let (bounds, follows) = (plot.plot_bounds(), plot.auto_bounds());
        if let Some(x) = narrowed(bounds.range_x(), most[0]).filter(|_| !follows.x) {
            plot.set_plot_bounds_x(x);
        }
        if let Some(y) = narrowed(bounds.range_y(), most[1]).filter(|_| !follows.y) {
            plot.set_plot_bounds_y(y);
        }
        for Curve { name, points, place } in curves.iter().filter(|curve| !hidden.contains(&(kind, curve.place))) {
            let (id, series) = (egui::Id::unique((kind, *place)), PlotPoints::from(points.clone()));
            if points.len() == 1 {
                // A line of one point is not seen.
                plot.points(Points::new(name.clone(), series).id(id).color(place.color()).radius(2.5));
            } else {
                let style = if place.dashed { LineStyle::dashed_loose() } else { LineStyle::Solid };
                plot.line(Line::new(name.clone(), series).id(id).color(place.color()).style(style));
            }
        }
    });
}

/// Before the first iteration.
static FIRST: Record = Record {
    iteration: 0,
    seconds: 0.0,
    radius: 0.0,
    times: StageTimes { eye: 0.0, photons: 0.0, build: 0.0, gather: 0.0, accumulate: 0.0 },
    n_photons: 0,
    n_paths: 0,
};

/// The lines of a plot.
fn curves(kind: Kind, sample: &Sample, alpha: f64, by_seconds: bool) -> Vec<Curve> {
    let at = |iteration: u32, seconds: f64| if by_seconds { seconds } else { f64::from(iteration) }.log10();
    let solid = |number: u32, name: &str, points: Vec<[f64; 2]>| Curve {
        name: name.to_owned(),
        points: finite(points),
        place: Place { number, dashed: false },
    };
    let records = &sample.records;
    let of_records = |name: &str, value: &dyn Fn(&Record) -> f64| {
        solid(0, name, records.iter().map(|r| [at(r.iteration, r.seconds), value(r)]).collect())
    };
    // Over what passed since the point before.
    let of_means = |number: u32, name: &str, value: &dyn Fn(&Record, &Record) -> f64| {
        let before = std::iter::once(&FIRST).chain(&sample.means);
        let points = before.zip(&sample.means).map(|(before, r)| [at(r.iteration, r.seconds), value(before, r)]);
        solid(number, name, points.collect())
    };
    match kind {
        Kind::Error => {
            let noise = alpha;
            // Squared bias falls as N^(-2(1-α)): the slower of the two remains.
            let all = alpha.min(2.0 - 2.0 * alpha);
            let lines = [("noise, estimated", &sample.estimated, noise), ("measured", &sample.against_reference, all)];
            let mut curves = vec![];
            for (number, (name, measured, exponent)) in
                (0..).zip(lines).filter(|(_, (_, measured, _))| !measured.is_empty())
            {
                let points = measured.iter().map(|m| [at(m.iteration, m.seconds), m.rel_mse.log10()]).collect();
                let curve = solid(number, name, points);
                // The theory is of means: a single bright pixel is not to move its line.
                let trimmed = measured.iter().filter_map(|m| Some([at(m.iteration, m.seconds), m.trimmed?.log10()]));
                let trimmed = finite(trimmed.collect());
                let slope = slope(if trimmed.is_empty() { &curve.points } else { &trimmed }, exponent);
                curves.push(curve);
                let name = if by_seconds { "t" } else { "N" };
                let place = Place { number, dashed: true };
                curves.push(Curve { name: format!("{name}^−{exponent:.2}"), points: slope, place });
                if !trimmed.is_empty() {
                    curves.push(solid(number + 1, "trimmed", trimmed));
                }
            }
            curves
        }
        Kind::Radius => vec![of_records("radius", &|r| f64::from(r.radius).log10())],
        Kind::Rate => {
            let rate = |number, name: &str, photons: fn(&Record) -> u32| {
                of_means(number, name, &|before, r| {
                    let n = f64::from(r.iteration - before.iteration) * f64::from(photons(r));
                    (n / (r.seconds - before.seconds)).log10()
                })
            };
            vec![rate(0, "emitted", |r| r.n_paths), rate(1, "stored", |r| r.n_photons)]
        }
        Kind::Stages => {
            type Stage = (&'static str, fn(&StageTimes) -> f64);
            let stages: [Stage; 5] = [
                ("eye", |t| t.eye),
                ("photons", |t| t.photons),
                ("build", |t| t.build),
                ("gather", |t| t.gather),
                ("accumulate", |t| t.accumulate),
            ];
            let mean = |(number, stage): (u32, Stage)| {
                of_means(number, stage.0, &|before, r| {
                    1e3 * (stage.1(&r.times) - stage.1(&before.times)) / f64::from(r.iteration - before.iteration)
                })
            };
            (0..).zip(stages).map(mean).collect()
        }
    }
}

/// What has no logarithm is no point.
fn finite(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.retain(|point| point.iter().all(|c| c.is_finite()));
    points
}

/// From the first point to the last, where it touches: x^-exponent, in logarithms.
fn slope(points: &[[f64; 2]], exponent: f64) -> Vec<[f64; 2]> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return vec![] };
    vec![[first[0], last[1] + exponent * (last[0] - first[0])], *last]
}

/// The middle of a range that spans more than `most`.
fn narrowed(range: RangeInclusive<f64>, most: f64) -> Option<RangeInclusive<f64>> {
    let middle = 0.5 * (range.start() + range.end());
    (range.end() - range.start() > most).then_some(middle - 0.5 * most..=middle + 0.5 * most)
}

/// Decades, and what lies between them if there are few.
fn log_marks(input: GridInput) -> Vec<GridMark> {
    let (first, last) = (input.bounds.0.floor(), input.bounds.1.ceil());
    // Rounded outwards.
    if last - first > MOST_DECADES + 2.0 {
        return vec![];
    }
    let between = if last - first > 8.0 { 1 } else { 9 };
    (first as i32..last as i32)
        .flat_map(|decade| (1..=between).map(move |digit| (decade, digit)))
        .map(|(decade, digit)| {
            let step_size = match digit {
                1 => 1.0,
                2 | 5 => 0.35,
                _ => 0.1,
            };
            GridMark { value: f64::from(decade) + f64::from(digit).log10(), step_size }
        })
        .filter(|mark| (input.bounds.0..=input.bounds.1).contains(&mark.value))
        .collect()
}

/// Decades always; 2 and 5 where few decades are seen, all digits within one.
fn is_labelled(mark: f64, range: &RangeInclusive<f64>) -> bool {
    let digit = 10f64.powf(mark - mark.floor());
    let is = |n: f64| (digit - n).abs() < 1e-6;
    let decades = range.end() - range.start();
    is(1.0) || is(10.0) || decades < 2.5 && (is(2.0) || is(5.0)) || decades < 0.8
}

/// "100", "20k", "3M".
fn count(n: f64) -> String {
    match n {
        n if n >= 0.9e6 => format!("{:.0}M", n / 1e6),
        n if n >= 0.9e4 => format!("{:.0}k", n / 1e3),
        n if n > 0.99 => format!("{n:.0}"),
        _ => String::new(),
    }
}

fn small_number(n: f64) -> String {
    if n > 0.99 { count(n) } else { format!("{}", (n * 1e6).round() / 1e6) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Sample {
        let record = |iteration: u32| Record {
            iteration,
            seconds: 0.5 * f64::from(iteration),
            radius: 0.01,
            times: {
                let all = |each: f64| each * f64::from(iteration);
                let [eye, photons, build, gather, accumulate] = [0.001, 0.002, 0.003, 0.004, 0.005].map(all);
                StageTimes { eye, photons, build, gather, accumulate }
            },
            n_photons: 3000,
            n_paths: 1000,
        };
        let measured = |iteration: u32| Measured {
            iteration,
            seconds: 0.5 * f64::from(iteration),
            rel_mse: 1.0 / f64::from(iteration),
            trimmed: None,
        };
        Sample {
            records: [1, 2, 10, 100].map(record).to_vec(),
            means: [1, 2, 10, 100].map(record).to_vec(),
            estimated: [10, 100].map(measured).to_vec(),
            against_reference: vec![],
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-6
    }

    #[test]
    fn slopes_touch_the_last_point() {
        let error = curves(Kind::Error, &sample(), 0.5, false);
        assert_eq!(
            error.iter().map(|c| (c.name.as_str(), c.place.dashed)).collect::<Vec<_>>(),
            [("noise, estimated", false), ("N^−0.50", true)]
        );
        assert_eq!(error[0].points.last(), error[1].points.last());
        let [[x0, y0], [x1, y1]] = error[1].points[..] else { panic!() };
        assert!(close((y1 - y0) / (x1 - x0), -0.5) && close(x0, 1.0) && close(x1, 2.0) && close(y1, -2.0));
        let with_reference = Sample { against_reference: sample().estimated, ..sample() };
        let names = |alpha| curves(Kind::Error, &with_reference, alpha, true).into_iter().map(|c| c.name).collect();
        let names: [Vec<String>; 2] = [0.9, 2.0 / 3.0].map(names);
        assert_eq!(names[0], ["noise, estimated", "t^−0.90", "measured", "t^−0.20"]);
        assert_eq!((&names[1][1], &names[1][3]), (&"t^−0.67".to_owned(), &"t^−0.67".to_owned()));
        // The worst pixels left out, the slope is of what is left.
        let mut with_trimmed = with_reference.clone();
        with_trimmed.against_reference.iter_mut().for_each(|m| m.trimmed = Some(0.5 * m.rel_mse));
        let error = curves(Kind::Error, &with_trimmed, 0.5, false);
        let [measured, slope, trimmed] = [2, 3, 4].map(|i| &error[i]);
        assert_eq!((&*trimmed.name, trimmed.place.number), ("trimmed", 2));
        assert!(slope.points.last() == trimmed.points.last() && slope.points.last() != measured.points.last());
        // A line keeps its colour when the noise, which takes two iterations, comes beside it.
        let alone = curves(Kind::Error, &Sample { estimated: vec![], ..with_reference }, 0.5, false);
        assert_eq!((&*alone[0].name, alone[0].place), ("measured", Place { number: 1, dashed: false }));
    }

    #[test]
    fn rates_are_over_what_passed_between_points() {
        let rate = curves(Kind::Rate, &sample(), 0.5, false);
        for (curve, expected) in rate.iter().zip([2000f64, 6000.0]) {
            assert_eq!(curve.points.len(), 4);
            assert!(curve.points.iter().all(|p| close(p[1], expected.log10())), "{curve:?}");
        }
        let stages = curves(Kind::Stages, &sample(), 0.5, true);
        assert_eq!(stages.iter().map(|c| c.points[3][1].round()).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(close(stages[0].points[3][0], 50f64.log10()));
    }

    #[test]
    fn what_has_no_logarithm_is_left_out() {
        let mut sample = sample();
        sample.means[1].n_photons = 0;
        sample.estimated[0].rel_mse = 0.0;
        assert_eq!(curves(Kind::Rate, &sample, 0.5, false)[1].points.len(), 3);
        assert_eq!(curves(Kind::Error, &sample, 0.5, false)[0].points.len(), 1);
    }

    /// The first iteration alone is a point, beside which there is as much room as its height, in milliseconds.
    #[test]
    fn plots_follow_their_lines_from_the_first_point_on() {
        for kind in [Kind::Radius, Kind::Rate, Kind::Stages] {
            let show = move |ui: &mut egui::Ui, n: &mut usize| {
                let mut all = sample();
                all.means.iter_mut().for_each(|record| record.times.eye *= 300.0);
                let some = Sample { records: all.records[..*n].to_vec(), means: all.means[..*n].to_vec(), ..all };
                plot(ui, kind, &curves(kind, &some, 0.5, false), &Hidden::new(), false);
                let memory = egui_plot::PlotMemory::load(ui.ctx(), plot_id(ui, kind, false)).unwrap();
                assert!(memory.auto_bounds.x && memory.auto_bounds.y, "{kind:?}");
            };
            let mut harness = egui_kittest::Harness::builder().with_accessibility_check(false).build_ui_state(show, 1);
            harness.run_steps(5);
            *harness.state_mut() = 4;
            harness.run_steps(5);
        }
    }

    #[test]
    fn an_axis_that_spans_too_much_shows_its_middle() {
        assert_eq!(narrowed(-40.0..=60.0, 100.0), None);
        assert_eq!(narrowed(-1e12..=3e12, 100.0), Some(1e12 - 50.0..=1e12 + 50.0));
    }

    #[test]
    fn marks_of_a_logarithmic_axis() {
        let marks = log_marks(GridInput { bounds: (-0.2, 1.5), base_step_size: 0.01 });
        let labels = |range: RangeInclusive<f64>| {
            marks.iter().filter(|m| is_labelled(m.value, &range)).map(|m| small_number(10f64.powf(m.value))).collect()
        };
        let [wide, near, one]: [Vec<String>; 3] = [-1.2..=1.5, 0.0..=1.2, 0.5..=0.9].map(labels);
        assert_eq!(wide, ["1", "10"]);
        assert_eq!(near, ["1", "2", "5", "10", "20"]);
        // Of a range in which there may be no 1, 2 or 5, every digit; what lies outside of it is not drawn.
        assert_eq!(one.len(), marks.len());
        for far in [1e3, 1e9, 1.5e9, 1e12, 1e300, f64::INFINITY] {
            for bounds in [(-far, far), (0.0, far), (-far, 0.0), (far, far + 3.0)] {
                let n = log_marks(GridInput { bounds, base_step_size: 1.0 }).len();
                assert!(n <= 27, "{bounds:?}: {n}");
            }
        }
        assert_eq!([0.9, 1.0, 1e3, 2e4, 5e6].map(count), ["", "1", "1000", "20k", "5M"]);
        assert_eq!((Kind::Error.mark(-3.0), Kind::Radius.mark(-3.0)), ("1e-3".to_owned(), "1.00 mm".to_owned()));
    }
}
