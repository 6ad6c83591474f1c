//! A stable radix sort of 64-bit words by some of their bits, the least first.

use rayon::prelude::*;

/// Bits of a digit, at most: its counts stay in the first cache.
const DIGIT: u32 = 11;
/// Words a thread takes, at least.
const GRAIN: usize = 1 << 16;

/// Sorts by the `bits` bits from `shift` on; words that agree in them keep their order. `other` is of the same length, and
/// means nothing afterwards.
pub fn sort(words: &mut Vec<u64>, other: &mut Vec<u64>, shift: u32, bits: u32) {
    let passes = bits.div_ceil(DIGIT).max(1);
    let width = bits.div_ceil(passes);
    for pass in 0..passes {
        let shift = shift + pass * width;
        let width = width.min(bits - pass * width);
        let digit = move |word: u64| (word >> shift) as usize & ((1 << width) - 1);
        if scatter(words, other, 1 << width, digit) {
            std::mem::swap(words, other);
        }
    }
}

/// One pass, unless all digits are the same; whether it was needed.
fn scatter(from: &[u64], to: &mut [u64], n_digits: usize, digit: impl Fn(u64) -> usize + Sync) -> bool {
    let parts = rayon::current_num_threads().min(from.len() / GRAIN).max(1);
    let part = from.len().div_ceil(parts).max(1);
    let count = |words: &[u64]| {
        let mut counts = vec![0usize; n_digits];
        words.iter().for_each(|&word| counts[digit(word)] += 1);
        counts
    };
    let mut counts: Vec<Vec<usize>> = from.par_chunks(part).map(count).collect();
    if (0..n_digits).any(|d| counts.iter().map(|counts| counts[d]).sum::<usize>() == from.len()) {
        return false;
    }
    if let [at] = &mut counts[..] {
        let mut sum = 0;
        for n in at.iter_mut() {
            (*n, sum) = (sum, sum + *n);
        }
        for &word in from {
            let at = &mut at[digit(word)];
            to[*at] = word;
            *at += 1;
        }
        return true;
    }
    // Each thread's own place for each digit.
    let mut places: Vec<Vec<std::slice::IterMut<u64>>> = counts.iter().map(|_| Vec::with_capacity(n_digits)).collect();
    let mut rest = to;
    for d in 0..n_digits {
        for (places, counts) in places.iter_mut().zip(&counts) {
            let (place, after) = rest.split_at_mut(counts[d]);
            places.push(place.iter_mut());
            rest = after;
        }
    }
    from.par_chunks(part).zip(places).for_each(|(words, mut places)| {
        for &word in words {
            if let Some(place) = places[digit(word)].next() {
                *place = word;
            }
        }
    });
    true
}
