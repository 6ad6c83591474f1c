//! What Evangelou, Papaioannou, Vardis & Vasilakis 2021 (JCGT 10(1)) print, to stand beside ours. Only what their text and
//! tables have in numbers or words; nothing is read off a plot.

/// Who computed.
pub const DEVICE: &str = "NVIDIA RTX 2080 Ti, OptiX 7.2 against the GPU version of FLANN";

/// Build and gather, or build and search, by OptiX and by FLANN.
pub type Both = [[f64; 2]; 2];

/// Photon paths an iteration of [`TABLE_1`].
pub const TABLE_1_PATHS: [u32; 4] = [100_000, 200_000, 500_000, 1_000_000];

/// Table 1, milliseconds: for each number of paths build and gather, OptiX before FLANN.
pub const TABLE_1: [(&str, [Both; 4]); 4] = [
    (
        "glass",
        [
            [[1.3, 42.0], [5.6, 8.0]],
            [[2.0, 61.9], [5.3, 27.9]],
            [[5.2, 99.9], [5.8, 48.4]],
            [[9.4, 175.9], [6.3, 90.4]],
        ],
    ),
    (
        "pool",
        [
            [[1.9, 47.1], [5.8, 4.7]],
            [[3.7, 63.3], [6.9, 7.8]],
            [[7.9, 123.7], [8.0, 25.1]],
            [[15.1, 222.2], [12.2, 46.1]],
        ],
    ),
    (
        "bathroom",
        [
            [[2.0, 53.1], [7.3, 15.6]],
            [[3.2, 68.9], [9.6, 46.1]],
            [[7.6, 123.4], [16.3, 83.7]],
            [[14.6, 229.9], [33.4, 131.9]],
        ],
    ),
    (
        "fireplace",
        [
            [[1.8, 56.8], [8.4, 14.7]],
            [[3.7, 73.5], [11.0, 42.1]],
            [[6.7, 141.6], [22.6, 72.1]],
            [[12.2, 220.3], [43.0, 108.6]],
        ],
    ),
];

/// Of Table 1, if the paper has it.
pub fn table_1(scene: &str, paths: u32) -> Option<Both> {
    let row = TABLE_1.iter().find(|row| row.0 == scene)?;
    Some(row.1[TABLE_1_PATHS.iter().position(|&p| p == paths)?])
}

/// Points, build (k = 1, then k = 4 and 8), search (k = 1, 4, 8).
type Row7 = (usize, [[f64; 2]; 2], [[f64; 2]; 3]);

/// Figure 7, milliseconds; OptiX before FLANN.
pub const FIGURE_7: [Row7; 4] = [
    (100_000, [[1.4, 21.4], [2.4, 26.2]], [[0.1, 0.4], [0.2, 0.7], [0.5, 0.9]]),
    (350_000, [[3.3, 29.1], [4.9, 37.4]], [[0.2, 0.7], [1.0, 1.7], [1.9, 2.6]]),
    (500_000, [[4.5, 35.2], [6.5, 42.4]], [[0.3, 0.9], [1.6, 2.6], [3.4, 3.7]]),
    (1_000_000, [[7.8, 45.4], [11.8, 59.6]], [[1.1, 2.2], [4.3, 6.4], [8.1, 8.2]]),
];

/// Of Figure 7, if the paper has it; `k` is 1, 4 or 8.
pub fn figure_7(points: usize, k: usize) -> Option<Both> {
    let &(_, build, search) = FIGURE_7.iter().find(|row| row.0 == points)?;
    let task = [1, 4, 8].iter().position(|&task| task == k)?;
    Some([build[task.min(1)], search[task]])
}

/// What the text says of Figure 3, 4, 5 or 6.
pub fn claim(figure: u32) -> &'static str {
    match figure {
        3 => {
            "The paper: with small radii its method is faster than FLANN for all numbers of samples and queries; with \
             large radii FLANN becomes faster as both grow."
        }
        4 => {
            "The paper: at low density its method is faster at every radius; at high density it falls behind even at \
             small radii."
        }
        5 => "The paper: its method is faster than FLANN for all numbers of samples and queries.",
        6 => "The paper: its method is faster than FLANN at every radius.",
        _ => "",
    }
}

/// OptiX's and FLANN's columns of a table: "build / search", or a dash.
pub fn columns(both: Option<Both>) -> impl Iterator<Item = String> {
    (0..2).map(move |who| both.map_or("–".to_owned(), |[build, search]| format!("{} / {}", build[who], search[who])))
}

/// Their headings.
pub const HEADINGS: [&str; 2] = ["paper, OptiX", "paper, FLANN"];
