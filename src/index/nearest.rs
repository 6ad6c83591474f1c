//! The nearest points found so far.

/// The largest k of a truncated k-NN search.
pub const MAX_K: usize = 64;

/// A point and its squared distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index of the point; `u32::MAX` stands for none.
    pub index: u32,
    /// Infinite where there is none.
    pub distance2: f32,
}

impl Neighbour {
    /// Stands where fewer than k were found.
    pub const NONE: Self = Self { index: u32::MAX, distance2: f32::INFINITY };

    /// By distance, then by index.
    #[inline]
    fn is_before(&self, other: &Self) -> bool {
        self.distance2 < other.distance2 || (self.distance2 == other.distance2 && self.index < other.index)
    }
}

/// The k nearest points of those inserted, nearest first, ties in order of the index.
#[derive(Clone, Debug)]
pub struct Nearest {
    k: usize,
    found: usize,
    list: [Neighbour; MAX_K],
}

impl Nearest {
    /// Empty, with room for `k` points.
    ///
    /// # Panics
    /// If `k` is not in 1 … [`MAX_K`].
    pub fn new(k: usize) -> Self {
        assert!((1..=MAX_K).contains(&k), "k is {k}");
        Self { k, found: 0, list: [Neighbour::NONE; MAX_K] }
    }

    /// How many it takes.
    pub fn k(&self) -> usize {
        self.k
    }

    /// Forgets what was inserted.
    pub fn clear(&mut self) {
        self.found = 0;
        self.list[..self.k].fill(Neighbour::NONE);
    }

    /// Takes a point if it is among the k nearest so far.
    #[inline]
    pub fn insert(&mut self, index: u32, distance2: f32) {
        let new = Neighbour { index, distance2 };
        if !new.is_before(&self.list[self.k - 1]) {
            return;
        }
        let mut at = self.found.min(self.k - 1);
        while at > 0 && new.is_before(&self.list[at - 1]) {
            self.list[at] = self.list[at - 1];
            at -= 1;
        }
        self.list[at] = new;
        self.found = (self.found + 1).min(self.k);
    }

    /// Points beyond this squared distance are not taken any more: the k-th one's, infinite while there are fewer. A
    /// point at exactly this distance still is, if its index is lower.
    #[inline]
    pub fn bound(&self) -> f32 {
        self.list[self.k - 1].distance2
    }

    /// What was found, nearest first: at most k, fewer if there are no more.
    pub fn found(&self) -> &[Neighbour] {
        &self.list[..self.found]
    }

    /// As many as asked for, if that many were found: the last of them.
    pub fn kth(&self) -> Option<Neighbour> {
        (self.found == self.k).then(|| self.list[self.k - 1])
    }
}
