//! How far a picture is from a reference.

use super::Picture;

/// Differences of a picture x from a reference y, over pixels and channels that are finite in both.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Difference {
    /// Mean of (x − y)² / (y² + 0.01).
    pub rel_mse: f64,
    /// The same without the worst 0.1 % of the pixels: what is left when fireflies are.
    pub rel_mse_trimmed: f64,
    /// Mean of x − y; its sign says who is brighter.
    pub mean_difference: f64,
    /// Mean of x − y over the mean of y; none where that is 0.
    pub relative_mean_difference: Option<f64>,
    /// Largest |x − y|.
    pub max_difference: f64,
    /// Pixels that have a value that is not finite, in either picture.
    pub not_finite: usize,
    /// Pixels compared, at least one.
    pub pixels: usize,
}

/// Whether two pictures have the same size and crop; otherwise says what differs.
pub(super) fn same_window(picture: &Picture, reference: &Picture) -> Result<(), String> {
    let window = |p: &Picture| {
        let ([width, height], [x0, y0, x1, y1]) = (p.size, p.crop);
        format!("{width}x{height} with data from ({x0}, {y0}) to ({x1}, {y1})")
    };
    if (picture.size, picture.crop) != (reference.size, reference.crop) {
        return Err(format!("the windows differ: {} and {}", window(picture), window(reference)));
    }
    Ok(())
}

/// Compares two pictures of the same size and crop; otherwise says what differs. Where no pixel is finite in both there
/// is no difference to tell, which is not a difference of 0: that is an error, too.
pub fn compare(picture: &Picture, reference: &Picture) -> Result<Difference, String> {
    same_window(picture, reference)?;
    let mut errors = Vec::with_capacity(picture.rgb.len());
    let (mut difference, mut brightness, mut max) = (0.0, 0.0, 0.0f64);
    for (x, y) in picture.rgb.iter().zip(&reference.rgb) {
        if !x.iter().chain(y).all(|c| c.is_finite()) {
            continue;
        }
        let mut error = 0.0;
        for (x, y) in x.iter().zip(y).map(|(&x, &y)| (f64::from(x), f64::from(y))) {
            error += (x - y).powi(2) / (y * y + 0.01) / 3.0;
            difference += x - y;
            brightness += y;
            max = max.max((x - y).abs());
        }
        errors.push(error);
    }
    if errors.is_empty() {
        return Err("no pixel is finite in both".into());
    }
    errors.sort_unstable_by(f64::total_cmp);
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let n = errors.len();
    Ok(Difference {
        rel_mse: mean(&errors),
        rel_mse_trimmed: mean(&errors[..n - n / 1000]),
        mean_difference: difference / (3 * n) as f64,
        relative_mean_difference: (brightness != 0.0).then(|| difference / brightness),
        max_difference: max,
        not_finite: picture.rgb.len() - n,
        pixels: n,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32, n: usize) -> Picture {
        Picture { size: [n as u32, 1], crop: [0, 0, n as u32, 1], rgb: vec![[value; 3]; n], variance: None }
    }

    #[test]
    fn closed_values() {
        let (mut x, y) = (flat(1.1, 2000), flat(1.0, 2000));
        let d = compare(&x, &y).unwrap();
        assert!((d.rel_mse - 0.01 / 1.01).abs() < 1e-7 && (d.rel_mse_trimmed - d.rel_mse).abs() < 1e-12);
        assert!((d.mean_difference - 0.1).abs() < 1e-6 && (d.relative_mean_difference.unwrap() - 0.1).abs() < 1e-6);
        x.rgb[0] = [100.0; 3];
        x.rgb[1] = [f32::NAN, 0.0, 0.0];
        let d = compare(&x, &y).unwrap();
        assert!(d.rel_mse > 4.0 && (d.rel_mse_trimmed - 0.01 / 1.01).abs() < 1e-6);
        assert_eq!((d.not_finite, d.pixels, d.max_difference), (1, 1999, 99.0));
        assert!(compare(&flat(1.0, 3), &flat(1.0, 4)).unwrap_err().contains("windows differ"));
    }

    #[test]
    fn what_cannot_be_told_is_not_0() {
        for (x, y) in [(f32::NAN, 1.0), (1.0, f32::INFINITY)] {
            assert_eq!(compare(&flat(x, 3), &flat(y, 3)).unwrap_err(), "no pixel is finite in both");
        }
        assert!(compare(&flat(1.0, 0), &flat(1.0, 0)).is_err());
        let d = compare(&flat(1.0, 3), &flat(0.0, 3)).unwrap();
        assert_eq!((d.mean_difference, d.relative_mean_difference), (1.0, None));
    }
}
