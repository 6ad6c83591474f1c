//! Values of flags: what text means, and which is refused.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use sunfleck::output::tonemap::ToneMap;
use sunfleck::ppm::{Direct, FirstRadius, Kernel};
use sunfleck::scene::Accelerator;
use sunfleck::scene::settings::{Index, MAX_EXPOSURE, MAX_SIDE, is_alpha};

/// The part of the picture to compute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop([f64; 4]);

impl Crop {
    /// In pixels: x0, y0, x1, y1 (exclusive), each fraction rounded to the nearest edge, so that crops that meet
    /// neither overlap nor leave a gap. None if nothing is left.
    pub fn pixels(self, size: [u32; 2]) -> Option<[u32; 4]> {
        let Self([x0, x1, y0, y1]) = self;
        let edge = |fraction: f64, n: u32| (fraction * f64::from(n)).round() as u32;
        let crop = [edge(x0, size[0]), edge(y0, size[1]), edge(x1, size[0]), edge(y1, size[1])];
        (crop[0] < crop[2] && crop[1] < crop[3]).then_some(crop)
    }
}

pub fn crop(text: &str) -> Result<Crop, String> {
    let fractions: Vec<f64> = text
        .split(',')
        .map(|t| t.trim().parse().map_err(|_| format!("{t:?} is not a number")))
        .collect::<Result<_, _>>()?;
    let [x0, x1, y0, y1] = fractions[..] else {
        return Err("four fractions are needed: x0,x1,y0,y1".into());
    };
    if !(0.0 <= x0 && x0 < x1 && x1 <= 1.0 && 0.0 <= y0 && y0 < y1 && y1 <= 1.0) {
        return Err("0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1 must hold".into());
    }
    Ok(Crop([x0, x1, y0, y1]))
}

pub fn size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or("a size looks like 1280x720")?;
    let side = |t: &str| match t.trim().parse() {
        Ok(n) if (1..=MAX_SIDE).contains(&n) => Ok(n),
        Ok(_) => Err(format!("a side is 1 to {MAX_SIDE} pixels")),
        Err(_) if !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit()) => {
            Err(format!("a side is 1 to {MAX_SIDE} pixels"))
        }
        Err(_) => Err(format!("{t:?} is not a number of pixels; a size looks like 1280x720")),
    };
    Ok([side(width)?, side(height)?])
}

pub fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| "not a number".to_owned())
}

pub fn positive_f64(text: &str) -> Result<f64, String> {
    match number::<f64>(text)? {
        // A year: longer would only hide a slip.
        x if x > 0.0 && x <= 31_557_600.0 => Ok(x),
        _ => Err("must be above 0 and at most a year".into()),
    }
}

#[cfg(feature = "view")]
pub fn noise(text: &str) -> Result<f64, String> {
    match number::<f64>(text)? {
        x if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("must be above 0".into()),
    }
}

pub fn exposure(text: &str) -> Result<f32, String> {
    match number::<f32>(text)? {
        x if x.abs() <= MAX_EXPOSURE => Ok(x),
        _ => Err(format!("must be between -{MAX_EXPOSURE} and {MAX_EXPOSURE} stops")),
    }
}

pub fn alpha(text: &str) -> Result<f32, String> {
    match number::<f32>(text)? {
        x if is_alpha(x) => Ok(x),
        _ => Err("must be between 0 and 1, neither included".into()),
    }
}

pub fn radius(text: &str) -> Result<FirstRadius, String> {
    if matches!(text, "automatic" | "auto") {
        return Ok(FirstRadius::Automatic);
    }
    match text.trim().parse::<f32>() {
        Ok(r) if r > 0.0 && r.is_finite() => Ok(FirstRadius::Fixed(r)),
        Ok(_) => Err("must be above 0 metres".into()),
        Err(_) => Err("neither a number of metres nor `automatic`".into()),
    }
}

pub fn tonemap() -> impl TypedValueParser<Value = ToneMap> {
    PossibleValuesParser::new(ToneMap::ALL.map(ToneMap::name)).map(|name| ToneMap::from_name(&name).unwrap_or_default())
}

pub fn kernel() -> impl TypedValueParser<Value = Kernel> {
    PossibleValuesParser::new(["epanechnikov", "constant"])
        .map(|name| if name == "constant" { Kernel::Constant } else { Kernel::Epanechnikov })
}

pub fn direct() -> impl TypedValueParser<Value = Direct> {
    PossibleValuesParser::new(["sampled", "photons"])
        .map(|name| if name == "photons" { Direct::Photons } else { Direct::Sampled })
}

pub fn index() -> impl TypedValueParser<Value = Index> {
    PossibleValuesParser::new(["tree", "hardware"])
        .map(|name| if name == "hardware" { Index::Hardware } else { Index::Tree })
}

pub fn accelerator() -> impl TypedValueParser<Value = Accelerator> {
    PossibleValuesParser::new(["bvh", "kd"]).map(|name| if name == "kd" { Accelerator::Kd } else { Accelerator::Bvh })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::scene::settings::Settings;

    #[test]
    fn sizes_and_crops() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        for wrong in
            ["0x0", "1280", "1280x", "x720", "-1x5", "1e6x1e6", "1000000x1", "99999999999999999999x1", "axb", ""]
        {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        let of = |text: &str, size| crop(text).unwrap().pixels(size);
        assert_eq!(of("0,1,0,1", [7, 5]), Some([0, 0, 7, 5]));
        assert_eq!(of("0.25,0.75,0.5,1", [640, 480]), Some([160, 240, 480, 480]));
        assert_eq!(of("0,0.01,0,1", [10, 10]), None);
        for wrong in ["", "1", "0,1,0", "0,1,0,2", "0.5,0.5,0,1", "0.6,0.5,0,1", "nan,1,0,1", "-0.1,1,0,1", "0,1,0,1,0"]
        {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }

    /// What a file may say can be typed, and nothing else.
    #[test]
    fn flags_and_files_take_the_same_numbers() {
        let in_file = |field: &str, text: &str| Settings::default().set(&format!("{field}={text}")).is_ok();
        for text in ["0", "-60", "60", "61.5", "-64", "64", "64.1", "-65", "1000"] {
            assert_eq!(exposure(text).is_ok(), in_file("exposure", text), "{text}");
        }
        for text in ["0", "1e-6", "0.0005", "0.5", "0.9995", "1", "1.5", "-0.5"] {
            assert_eq!(alpha(text).is_ok(), in_file("alpha", text), "{text}");
        }
    }

    #[test]
    fn numbers() {
        for wrong in ["0", "1", "nan", "-0.5", "inf", "x", ""] {
            assert!(alpha(wrong).is_err(), "{wrong}");
        }
        for wrong in ["0", "-1", "nan", "inf", "big", ""] {
            assert!(radius(wrong).is_err(), "{wrong}");
            assert!(positive_f64(wrong).is_err(), "{wrong}");
        }
        assert_eq!(radius("0.1"), Ok(FirstRadius::Fixed(0.1)));
        assert_eq!(radius("auto"), Ok(FirstRadius::Automatic));
    }
}
