//! Values of settings that may be written in several ways.

use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;

/// A positive count, written `500000`, `"500k"` or `"1.5M"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count(pub u32);

/// A picture's width and height, pixels, written `[1280, 720]` or `"1280x720"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

/// The first radius, written in metres or `"automatic"`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FirstRadius {
    /// One per pixel, from the pixel's footprint and the density of a first photon pass.
    #[default]
    Automatic,
    /// The same everywhere, metres.
    Fixed(f32),
}

/// Density estimation kernel over t = d/r, each with unit integral over the disc.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// 2(1 − t²)/(πr²).
    #[default]
    Epanechnikov,
    /// 1/(πr²).
    Constant,
}

/// Who brings the light that comes straight from a lamp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direct {
    /// Lights are sampled where the eye path gathers; photons carry what has bounced.
    #[default]
    Sampled,
    /// Photons carry everything.
    Photons,
}

/// What finds photons on a GPU. The picture is the same, up to the order in which photons are summed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Index {
    /// Our own tree, on every device.
    #[default]
    Tree,
    /// Ray queries, on adapters that have them.
    Hardware,
}

impl fmt::Display for Index {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Tree => "tree",
            Self::Hardware => "hardware",
        })
    }
}

/// How radiance above what a display can show is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ToneMap {
    /// Khronos PBR Neutral (2024): colours below 0.76 stay as they are, highlights are compressed and desaturated.
    #[default]
    Neutral,
    /// AgX (Troy Sobotka, 2022): film-like; bright saturated colours fade to white.
    Agx,
    /// None: values above 1 are cut off.
    Srgb,
}

impl ToneMap {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Neutral, Self::Agx, Self::Srgb];

    /// As the command line has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neutral => "neutral",
            Self::Agx => "agx",
            Self::Srgb => "srgb",
        }
    }

    /// The inverse of [`ToneMap::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tonemap| tonemap.name() == name)
    }
}

/// The kinds of lights without extent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Alike in all directions.
    Point,
    /// A cone.
    Spot,
    /// From infinitely far away.
    Directional,
}

/// A positive count with an optional unit k (10³), M (10⁶) or G (10⁹): `500k`, `1.5M`, `2_000`.
pub fn parse_count(text: &str) -> Result<u32, String> {
    let expected = || format!("{text:?} is not a count such as 500000, 500k or 1.5M");
    let trimmed = text.trim();
    let (number, unit) = match trimmed.chars().last() {
        Some('k' | 'K') => (&trimmed[..trimmed.len() - 1], 1e3),
        Some('m' | 'M') => (&trimmed[..trimmed.len() - 1], 1e6),
        Some('g' | 'G') => (&trimmed[..trimmed.len() - 1], 1e9),
        _ => (trimmed, 1.0),
    };
    let number = number.trim_end().replace('_', "");
    // `parse` would also take "inf" and "1e3".
    if number.is_empty() || !number.chars().all(|c| c.is_ascii_digit() || c == '.') {
        return Err(expected());
    }
    let value = number.parse::<f64>().map_err(|_| expected())? * unit;
    let rounded = value.round();
    if (value - rounded).abs() > 1e-6 * value {
        return Err(format!("{text:?} is not a whole number"));
    }
    match rounded {
        1.0..=4_294_967_295.0 => Ok(rounded as u32),
        _ => Err(format!("{text:?} is not between 1 and {}", u32::MAX)),
    }
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.trim().parse::<u32>().ok();
    match text.split_once(['x', 'X', '×']) {
        Some((width, height)) => side(width).zip(side(height)).map(<[u32; 2]>::from),
        None => None,
    }
    .ok_or_else(|| format!("{text:?} is not a size such as 1280x720"))
}

impl Serialize for Count {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(self.0)
    }
}

impl Serialize for Size {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl Serialize for FirstRadius {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Automatic => serializer.serialize_str("automatic"),
            Self::Fixed(radius) => serializer.serialize_f32(*radius),
        }
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct CountVisitor;
        impl Visitor<'_> for CountVisitor {
            type Value = Count;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a count such as 500000, \"500k\" or \"1.5M\"")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Count, E> {
                match u32::try_from(value) {
                    Ok(value) if value > 0 => Ok(Count(value)),
                    _ => Err(E::custom(format!("{value} is not between 1 and {}", u32::MAX))),
                }
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Count, E> {
                self.visit_i64(i64::try_from(value).unwrap_or(i64::MAX))
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<Count, E> {
                parse_count(value).map(Count).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(CountVisitor)
    }
}

impl<'de> Deserialize<'de> for Size {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SizeVisitor;
        impl<'de> Visitor<'de> for SizeVisitor {
            type Value = Size;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a size such as [1280, 720] or \"1280x720\"")
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Size, A::Error> {
                <[u32; 2]>::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Size)
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<Size, E> {
                parse_size(value).map(Size).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(SizeVisitor)
    }
}

impl<'de> Deserialize<'de> for FirstRadius {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RadiusVisitor;
        impl Visitor<'_> for RadiusVisitor {
            type Value = FirstRadius;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a radius in metres or \"automatic\"")
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<FirstRadius, E> {
                Ok(FirstRadius::Fixed(value as f32))
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<FirstRadius, E> {
                Ok(FirstRadius::Fixed(value as f32))
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<FirstRadius, E> {
                match value {
                    "automatic" => Ok(FirstRadius::Automatic),
                    _ => Err(E::invalid_value(de::Unexpected::Str(value), &self)),
                }
            }
        }
        deserializer.deserialize_any(RadiusVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Settings;
    use super::*;

    #[test]
    fn each_value_has_its_text() {
        let said = |text: &str| {
            let settings = Settings::parse(text, "a.toml".as_ref()).unwrap();
            assert_eq!(settings.to_toml().trim_end(), text);
            settings
        };
        assert_eq!(said("kernel = \"epanechnikov\"").kernel, Some(Kernel::Epanechnikov));
        assert_eq!(said("kernel = \"constant\"").kernel, Some(Kernel::Constant));
        assert_eq!(said("direct = \"sampled\"").direct, Some(Direct::Sampled));
        assert_eq!(said("direct = \"photons\"").direct, Some(Direct::Photons));
        assert_eq!(said("radius = \"automatic\"").radius, Some(FirstRadius::Automatic));
        assert_eq!(said("radius = 0.25").radius, Some(FirstRadius::Fixed(0.25)));
    }

    #[test]
    fn counts_have_units() {
        for (text, count) in [
            ("500k", 500_000),
            ("1.5M", 1_500_000),
            ("2M", 2_000_000),
            ("7", 7),
            ("2_000", 2000),
            ("4G", 4_000_000_000),
        ] {
            assert_eq!(parse_count(text), Ok(count), "{text}");
        }
        for text in ["", "k", "0", "-5", "1.5", "5G", "inf", "nan", "1e3", "5kk", "five", "k5", "½", "1.2.3"] {
            assert!(parse_count(text).is_err(), "{text}");
        }
    }
}
