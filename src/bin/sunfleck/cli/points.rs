//! What may be typed after `sunfleck points`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use sunfleck::index::MAX_K;
use sunfleck::points::Method;
use sunfleck::points::generate::{SHAPES, Shape};
use sunfleck::scene::settings::parse_count;

use super::values::number;

/// Of a made cloud's noise and shift, its shapes being 2 across; also degrees it is turned by.
const MAX_LENGTH: f64 = 1e6;

const EXAMPLES: &str = "\
Read are .ply (ascii, binary), .obj (vertices) and .xyz, .txt, .asc (3 or 6 columns); written is binary .ply.
Lengths are in the clouds' own unit, whichever that is.

Examples:
  sunfleck points make bumpy --points 100k -o target.ply
  sunfleck points make bumpy --points 100k --seed 1 --turn 10 --shift 0.1,0,0 -o source.ply
  sunfleck points register source.ply target.ply --method plane -o moved.ply
  sunfleck points match moved.ply target.ply -o matched.ply
  sunfleck points normals scan.xyz -k 12 -o normals.ply";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, arg_required_else_help = false)]
pub struct PointsArgs {
    /// What to do.
    #[command(subcommand)]
    pub task: Task,
}

#[derive(Debug, Subcommand)]
pub enum Task {
    /// Estimate normals from the nearest points, and orient them: outward on a closed surface
    Normals(NormalsArgs),
    /// Find for each point of SOURCE the nearest of TARGET
    Match(MatchArgs),
    /// Move SOURCE onto TARGET (ICP); prints the 4x4 matrix
    Register(RegisterArgs),
    /// Make a cloud that looks like a scan
    Make(MakeArgs),
}

#[derive(Debug, Args)]
pub struct Common {
    /// Where to put the cloud: a .ply file
    #[arg(short, long, value_name = "OUT.ply")]
    pub output: PathBuf,
    /// CPU threads [default: all]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say nothing but results and errors
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct NormalsArgs {
    /// The cloud
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// Points that a normal is estimated from, the point itself included: 3 to 64, more against noise
    #[arg(short, value_name = "K", default_value = "8", allow_hyphen_values = true, value_parser = k)]
    pub k: usize,
    #[command(flatten)]
    pub common: Common,
}

#[derive(Debug, Args)]
#[command(after_help = "OUT.ply holds SOURCE with two more properties: match, the index of the point in TARGET, \
    and distance; both -1 where there is none.")]
pub struct MatchArgs {
    /// Whose points are matched
    #[arg(value_name = "SOURCE")]
    pub source: PathBuf,
    /// With these
    #[arg(value_name = "TARGET")]
    pub target: PathBuf,
    /// Points farther apart have no match [default: four times the median spacing of TARGET]
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true, value_parser = distance)]
    pub outlier: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

#[derive(Debug, Args)]
#[command(
    after_help = "The clouds must overlap, and be turned against each other by less than some 45 degrees. The matrix \
    multiplies columns (x, y, z, 1). Exit code 0 also where the iterations ran out; the output says so."
)]
pub struct RegisterArgs {
    /// The cloud to move
    #[arg(value_name = "SOURCE")]
    pub source: PathBuf,
    /// Where it belongs
    #[arg(value_name = "TARGET")]
    pub target: PathBuf,
    /// What is made small: distances to the nearest points, or to their tangent planes (faster; uses the normals of
    /// TARGET, or estimates them)
    #[arg(long, default_value = "point", value_parser = method())]
    pub method: Method,
    /// Pairs farther apart are left out [default: three times the median distance of each iteration, but at least four
    /// times the median spacing of TARGET]
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true, value_parser = distance)]
    pub outlier: Option<f64>,
    /// Iterations, at most
    #[arg(long, value_name = "N", default_value = "100", allow_hyphen_values = true, value_parser = parse_count)]
    pub iterations: u32,
    /// Write the matrix and every iteration to a JSON file
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

#[derive(Debug, Args)]
#[command(after_help = "The shapes are closed and about 2 across; twelve scanners around them see them line by line.")]
pub struct MakeArgs {
    /// Shape
    #[arg(value_name = "NAME", default_value = "bumpy", value_parser = shape())]
    pub shape: Shape,
    /// Number of points, such as 100k or 1M
    #[arg(long, value_name = "N", default_value = "100k", allow_hyphen_values = true, value_parser = cloud_size)]
    pub points: u32,
    /// Standard deviation along the scanner's ray
    #[arg(long, value_name = "LENGTH", default_value = "0.0005", allow_hyphen_values = true, value_parser = noise)]
    pub noise: f64,
    /// Of the random numbers: another scan of the same surface
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value = "0")]
    pub seed: u32,
    /// Turn the cloud about the axis (1, 2, 3), degrees
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = finite)]
    pub turn: f64,
    /// Move the cloud
    #[arg(long, value_name = "x,y,z", default_value = "0,0,0", allow_hyphen_values = true, value_parser = shift)]
    pub shift: Shift,
    #[command(flatten)]
    pub common: Common,
}

/// A translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift(pub [f64; 3]);

fn k(text: &str) -> Result<usize, String> {
    match number::<usize>(text)? {
        k if (3..=MAX_K).contains(&k) => Ok(k),
        _ => Err(format!("must be 3 to {MAX_K}")),
    }
}

fn distance(text: &str) -> Result<f64, String> {
    match number::<f64>(text)? {
        x if x >= 0.0 && x.is_finite() => Ok(x),
        _ => Err("must be 0 or more, and finite".into()),
    }
}

fn noise(text: &str) -> Result<f64, String> {
    match number::<f64>(text)? {
        x if (0.0..=MAX_LENGTH).contains(&x) => Ok(x),
        _ => Err("must be 0 to 1e6".into()),
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match number::<f64>(text)? {
        x if x.abs() <= MAX_LENGTH => Ok(x),
        _ => Err("must be between -1e6 and 1e6".into()),
    }
}

fn shift(text: &str) -> Result<Shift, String> {
    let parts: Vec<f64> = text.split(',').map(finite).collect::<Result<_, _>>()?;
    parts.try_into().map(Shift).map_err(|_| "three numbers are needed: x,y,z".into())
}

fn cloud_size(text: &str) -> Result<u32, String> {
    match parse_count(text)? {
        n if n <= 100_000_000 => Ok(n),
        _ => Err("at most 100M".into()),
    }
}

fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(["point", "plane"])
        .map(|name| if name == "plane" { Method::PointToPlane } else { Method::PointToPoint })
}

fn shape() -> impl TypedValueParser<Value = Shape> {
    PossibleValuesParser::new(SHAPES.map(|s| s.0))
        .map(|name| SHAPES.into_iter().find(|s| s.0 == name).map_or(Shape::Bumpy, |s| s.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        for wrong in ["2", "65", "-1", "", "8.5", "x"] {
            assert!(k(wrong).is_err(), "{wrong}");
        }
        for wrong in ["-1", "nan", "inf", "", "x"] {
            assert!(distance(wrong).is_err() && noise(wrong).is_err(), "{wrong}");
        }
        // Beyond what a 32-bit position holds.
        assert!(noise("1e39").is_err() && noise("1e6") == Ok(1e6) && noise("0") == Ok(0.0));
        assert_eq!(shift("1,-2,0.5"), Ok(Shift([1.0, -2.0, 0.5])));
        for wrong in ["", "1", "1,2", "1,2,3,4", "1,2,nan"] {
            assert!(shift(wrong).is_err(), "{wrong}");
        }
        assert!(cloud_size("200M").is_err());
    }
}
