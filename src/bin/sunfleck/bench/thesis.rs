//! What Frauenknecht 2025, "Efficient Construction of KD-Trees for Spatial Partitioning of Polyhedral Models" (TU München),
//! states in numbers or words, to stand beside ours; nothing is read off a plot.

/// Who computed.
pub const DEVICE: &str = "AMD Ryzen 5 3600, 6 cores, 4.2 GHz, C++17";

/// Faces of the largest mesh of Eros, 70,150 vertices.
pub const FACES: usize = 140_296;
/// The check of it in parallel by the fastest algorithm, lazily, and without a tree; seconds (abstract).
pub const CHECK: [f64; 2] = [4.7, 54.4];
/// The tree of it, megabytes (section 7.2).
pub const TREE_MB: f64 = 350.0;

/// What the text says of a figure.
pub fn claim(figure: &str) -> &'static str {
    match figure {
        "7.2" => {
            "The thesis: all trees beat no tree, the fastest takes less than half the time; O(N log N) is faster than \
             O(N log² N), but the difference is barely noticeable; the prebuilt tree is slightly better still."
        }
        "7.3" => "The thesis: building by O(N log N) stays under 2 % of the whole check.",
        "7.5" => {
            "The thesis: about ten times as fast as sequentially; no tree beats O(N²) on larger meshes; on 140,296 faces \
             4.7 s by O(N log N), 54.4 s without a tree. It builds in parallel, its rays go one by one."
        }
        "7.7" => "The thesis: all threads are active for some 80 % of the run by O(N log N).",
        _ => "The thesis: the same as on Eros.",
    }
}
