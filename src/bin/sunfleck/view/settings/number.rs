//! Numbers as the panel shows and reads them. What is typed is kept in full, however few digits are shown, and text left as
//! it was shown changes nothing.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use eframe::egui;
use egui::{DragValue, Response, Slider, SliderClamping, Ui};
use sunfleck::scene::settings::parse_count;

use super::widgets::within;

/// What a number is of, which says how it is written.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    Plain,
    Factor,
    /// 500k, 1.5M.
    Count,
    Degrees,
    Stops,
    Metres,
    /// Metres, with up to so many places after the point.
    Coordinate(usize),
}

/// Units of length that are read, metres.
const LENGTHS: [(&str, f64); 7] =
    [("µm", 1e-6), ("μm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("km", 1e3), ("m", 1.0)];

impl Number {
    /// As it is shown.
    pub fn text(self, x: f64) -> String {
        match self {
            Self::Plain => digits(x, 3),
            Self::Factor => format!("× {}", digits(x, 3)),
            Self::Count => count_text(x),
            Self::Degrees => digits(x, 2) + "°",
            Self::Stops => digits(x, 2) + " EV",
            Self::Metres => length_text(x) + " m",
            Self::Coordinate(places) => {
                // Fewer of a long one: a third of a row has no more room.
                let whole = x.abs().max(1.0).log10() as usize + 1;
                let places = if whole > 1 { places.min(5_usize.saturating_sub(whole)) } else { places };
                unsigned_zero(format!("{x:.places$}"))
            }
        }
    }

    /// As it is typed: with the unit that is shown, another of the same kind, or none.
    fn read(self, text: &str) -> Option<f64> {
        let text: String =
            text.chars().filter(|c| !c.is_whitespace()).map(|c| if c == '−' { '-' } else { c }).collect();
        let without = |units: &[&str]| units.iter().find_map(|unit| text.strip_suffix(unit)).unwrap_or(&text);
        let (number, unit) = match self {
            Self::Plain => (text.as_str(), 1.0),
            Self::Factor => (text.trim_start_matches(['×', 'x']), 1.0),
            Self::Count => return parse_count(&text).ok().map(f64::from),
            Self::Degrees => (without(&["°", "degrees", "deg"]), 1.0),
            Self::Stops => (without(&["EV", "ev", "stops", "stop"]), 1.0),
            Self::Metres | Self::Coordinate(_) => LENGTHS
                .iter()
                .find_map(|(name, metres)| Some((text.strip_suffix(name)?, *metres)))
                .unwrap_or((&text, 1.0)),
        };
        // As much of the world writes it; nobody groups the digits of what is typed here.
        let number = if number.contains('.') { Cow::Borrowed(number) } else { number.replacen(',', ".", 1).into() };
        // `parse` would also take "nan", and what no setting can hold.
        let value = number.parse::<f64>().ok()? * unit;
        (value as f32).is_finite().then_some(value)
    }

    /// The other way of `text`, where `old` is what is shown.
    fn reader(self, old: f64) -> impl Fn(&str) -> Option<f64> {
        move |text| if text == self.text(old) { Some(old) } else { self.read(text) }
    }
}

/// A word for 0 in fields of whole numbers.
pub const NO_LIMIT: &str = "no limit";

/// A whole number in a box of this size.
pub fn whole(ui: &mut Ui, size: egui::Vec2, drag: DragValue<'_>) -> Response {
    // 1,920 is neither two pixels nor meant to be.
    let number = |text: &str| Number::Plain.read(text).filter(|number| number.fract() == 0.0);
    let read = move |text: &str| if text.trim() == NO_LIMIT { Some(0.0) } else { number(text) };
    let drag = drag.update_while_editing(false).clip_text(true).clamp_existing_to_range(false);
    ui.add_sized(size, drag.custom_parser(read))
}

/// A number in all of the room; dragging changes it by `speed` a point.
pub fn drag(ui: &mut Ui, value: &mut f32, number: Number, speed: f64, range: RangeInclusive<f32>) -> Response {
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    drag_sized(ui, size, value, number, speed, range)
}

/// The same, of a size.
pub fn drag_sized(
    ui: &mut Ui,
    size: egui::Vec2,
    value: &mut f32,
    number: Number,
    speed: f64,
    range: RangeInclusive<f32>,
) -> Response {
    let old = f64::from(*value);
    let mut shown = old;
    // What a file says may lie outside: it stays until another number is given.
    let range = f64::from(*range.start()).min(old)..=f64::from(*range.end()).max(old);
    let drag = DragValue::new(&mut shown).speed(speed).range(range).update_while_editing(false).clip_text(true);
    let drag = drag.custom_formatter(|x, _| number.text(x)).custom_parser(number.reader(old));
    let layout = egui::Layout::centered_and_justified(egui::Direction::LeftToRight);
    let mut inside = within(ui, size, layout);
    fit(&mut inside, &number.text(old), size.x);
    let response = inside.add(drag);
    *value = shown as f32;
    response
}

/// A slider with its value beside it, in all of the room. What is typed may lie outside the range.
pub fn slider(ui: &mut Ui, value: &mut f64, number: Number, range: RangeInclusive<f64>) -> Response {
    any_slider(ui, value, number, range, false)
}

/// The same for factors: as far from 1 to 10 as from 10 to 100.
pub fn log_slider(ui: &mut Ui, value: &mut f64, number: Number, range: RangeInclusive<f64>) -> Response {
    any_slider(ui, value, number, range, true)
}

/// How a number is set with a slider, and what it may be.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub number: Number,
    /// Of the slider.
    pub range: [f64; 2],
    pub is_logarithmic: bool,
    /// What is typed may lie outside the range, but not outside this.
    pub allowed: [f32; 2],
}

impl Scale {
    /// From 0 to 1.
    pub const UNIT: Self =
        Self { number: Number::Plain, range: [0.0, 1.0], is_logarithmic: false, allowed: [0.0, 1.0] };

    /// A factor of any size, on a slider up to `most`.
    pub const fn factor(most: f64) -> Self {
        Self { number: Number::Plain, range: [0.0, most], is_logarithmic: true, allowed: [0.0, f32::MAX] }
    }

    /// The slider. A value that is changed by it is one that is allowed.
    pub fn show(&self, ui: &mut Ui, value: &mut f32) -> Response {
        let ([low, high], mut shown) = (self.range, f64::from(*value));
        let response = any_slider(ui, &mut shown, self.number, low..=high, self.is_logarithmic);
        if response.changed() {
            *value = (shown as f32).clamp(self.allowed[0], self.allowed[1]);
        }
        response
    }
}

fn any_slider(
    ui: &mut Ui,
    value: &mut f64,
    number: Number,
    range: RangeInclusive<f64>,
    is_logarithmic: bool,
) -> Response {
    const VALUE: f32 = 58.0;
    ui.spacing_mut().slider_width = (ui.available_width() - VALUE - ui.spacing().item_spacing.x).max(24.0);
    ui.spacing_mut().interact_size.x = VALUE;
    let old = *value;
    fit(ui, &number.text(old), VALUE);
    // No number of decimals is given to it: by that it would round what is typed.
    let slider = Slider::new(value, range).clamping(SliderClamping::Never).update_while_editing(false);
    let slider = slider.logarithmic(is_logarithmic).smallest_positive(0.01).trailing_fill(true);
    let slider = slider.custom_formatter(move |x, _| number.text(x));
    ui.add(slider.custom_parser(number.reader(old)))
}

/// A length in metres, at least `least`, of a scene of this `size`; dragging changes it in proportion.
pub fn metres(ui: &mut Ui, value: &mut f32, least: f32, size: f32) -> Response {
    let speed = f64::from(value.abs().max(1e-3 * size)) * 0.01;
    drag(ui, value, Number::Metres, speed, least..=f32::MAX)
}

/// Smaller letters for a number that is too long for its room.
fn fit(ui: &mut Ui, text: &str, room: f32) {
    let style = ui.style().drag_value_text_style.clone();
    let font = style.resolve(ui.style());
    let width = ui.painter().layout_no_wrap(text.to_owned(), font.clone(), egui::Color32::WHITE).size().x;
    let room = room - 2.0 * ui.spacing().button_padding.x;
    if width > room {
        let size = (font.size * room / width).max(7.0);
        ui.style_mut().text_styles.insert(style, egui::FontId { size, ..font });
    }
}

/// With so many places after the point, or two digits of what is smaller than that; without zeros at the end.
fn digits(x: f64, places: usize) -> String {
    let magnitude = x.abs();
    if x != 0.0 && !(1e-5..1e7).contains(&magnitude) {
        return format!("{x:.1e}");
    }
    let first = if magnitude > 0.0 { (-magnitude.log10().floor()).max(0.0) as usize } else { 0 };
    let places = if first + 1 > places { first + 1 } else { places };
    unsigned_zero(trimmed(format!("{x:.places$}")))
}

/// To four significant digits.
fn length_text(metres: f64) -> String {
    if metres == 0.0 || !metres.is_finite() {
        return metres.to_string();
    }
    let digits = (3 - metres.abs().log10().floor() as i32).clamp(0, 9) as usize;
    trimmed(format!("{metres:.digits$}"))
}

/// Without zeros at the end.
fn trimmed(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Nothing is −0.
fn unsigned_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        _ => text,
    }
}

/// A count as people write it: 500k, 1.5M.
fn count_text(n: f64) -> String {
    let (n, unit) = match n {
        n if n >= 999_500.0 => (n / 1e6, "M"),
        n if n >= 1000.0 => (n / 1e3, "k"),
        n => (n, ""),
    };
    let digits = match n {
        _ if unit.is_empty() => 0,
        n if n < 9.995 => 2,
        n if n < 99.95 => 1,
        _ => 0,
    };
    trimmed(format!("{n:.digits$}")) + unit
}

/// To two significant digits: a count that a slider gave.
pub fn rounded(n: f64) -> f64 {
    let unit = 10_f64.powf(n.max(1.0).log10().floor() - 1.0).max(1.0);
    (n / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    #[test]
    fn counts_are_short() {
        for (n, text) in [
            (1.0, "1"),
            (999.0, "999"),
            (1000.0, "1k"),
            (1500.0, "1.5k"),
            (500_000.0, "500k"),
            (999_600.0, "1M"),
            (1_250_000.0, "1.25M"),
            (20e6, "20M"),
            (12.5e6, "12.5M"),
        ] {
            assert_eq!(count_text(n), text);
        }
        for n in [1.0, 700.0, 1000.0, 250_000.0, 1.5e6, 20e6] {
            assert_eq!(Number::Count.read(&count_text(n)), Some(n));
        }
        assert_eq!(Number::Count.read("many"), None);
    }

    #[test]
    fn lengths_are_short() {
        for (metres, text) in
            [(0.0, "0"), (0.591_425, "0.5914"), (0.002, "0.002"), (12.5, "12.5"), (123_456.7, "123457")]
        {
            assert_eq!(length_text(metres), text);
        }
    }

    #[test]
    fn small_numbers_are_not_shown_as_nothing() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (2.0 / 3.0, "0.667"),
            (0.0004, "0.0004"),
            (-0.001_234, "-0.0012"),
            (3e-8, "3.0e-8"),
            (37.25, "37.25"),
            (1000.0, "1000"),
            (2.5e9, "2.5e9"),
        ] {
            assert_eq!(digits(x, 3), text);
        }
        for (x, text) in [(-0.001, "0.00"), (4.75, "4.75"), (-123.456, "-123.46"), (-123_456.78, "-123457")] {
            assert_eq!(Number::Coordinate(2).text(x), text);
        }
    }

    #[test]
    fn what_is_shown_can_be_typed() {
        use Number::{Coordinate, Count, Degrees, Factor, Metres, Plain, Stops};
        for number in [Plain, Factor, Degrees, Stops, Metres, Coordinate(2)] {
            for x in [0.0, 0.05, -37.25, 250_000.0] {
                let text = number.text(x);
                assert_eq!(number.read(&text), Some(x), "{text}");
            }
            for text in ["", "m", "nan", "inf", "1e300", "1 2 x", "1 kg", "1,2,3", "1,2.3"] {
                assert_eq!(number.read(text), None, "{number:?} {text}");
            }
        }
        for (number, text, value) in [
            (Metres, "5 mm", 0.005),
            (Plain, "0,7", 0.7),
            (Coordinate(2), "-2,5 cm", -0.025),
            (Metres, "7 µm", 7e-6),
            (Metres, "2.5cm", 0.025),
            (Coordinate(2), "−3 km", -3000.0),
            (Degrees, "20 deg", 20.0),
            (Stops, "1 ev", 1.0),
            (Factor, "2", 2.0),
        ] {
            let read = number.read(text).unwrap();
            assert!((read - value).abs() <= 1e-12 * value.abs(), "{text}: {read}");
        }
        // Not the digits that are shown, but all that are not.
        for (number, x) in [(Plain, 2.0 / 3.0), (Count, 54_321.0), (Metres, 0.591_425_36), (Degrees, 1.0 / 7.0)] {
            assert_eq!(number.reader(x)(&number.text(x)), Some(x));
        }
    }

    /// Whatever is typed, a setting gets what it may be.
    #[test]
    fn a_scale_keeps_what_is_allowed() {
        let ior = Scale { number: Number::Plain, range: [1.0, 2.5], is_logarithmic: false, allowed: [0.01, f32::MAX] };
        for (scale, from, text, to) in [
            (Scale::UNIT, 0.5, "3", 1.0),
            (Scale::UNIT, 0.5, "-3", 0.0),
            (Scale::factor(100.0), 1.0, "250", 250.0),
            (Scale::factor(100.0), 1.0, "-1", 0.0),
            (ior, 1.5, "0", 0.01),
            (ior, 1.5, "4", 4.0),
            // A file may say it: it stays until another number is given.
            (Scale::UNIT, 2.0, "", 2.0),
        ] {
            let show = |ui: &mut Ui, value: &mut f32| {
                scale.show(ui, value);
            };
            // The row that it is in says what it is.
            let mut harness = Harness::builder().with_accessibility_check(false).build_ui_state(show, from);
            if !text.is_empty() {
                harness.get_by_role(egui::Role::SpinButton).focus();
                harness.step();
                harness.event(egui::Event::Text(text.to_owned()));
                harness.step();
                harness.key_press(egui::Key::Enter);
            }
            harness.run();
            assert_eq!(*harness.state(), to, "{from} {text:?}");
        }
    }

    #[test]
    fn sliders_give_round_counts() {
        for (n, round) in [(1.0, 1.0), (12.4, 12.0), (123_456.0, 120_000.0), (987.0, 990.0), (1.26e6, 1.3e6)] {
            assert_eq!(rounded(n), round);
        }
    }
}
