//! Sets of intervals of one parameter: what is left of a swath after everything in its way has been taken out.

/// What is left between two intervals that abut up to rounding is shorter than this, in units of the whole parameter
/// range: a body's neighbouring faces block neighbouring intervals, and no light passes through their common edge.
const SLIVER: f64 = 1e-12;

/// A closed interval of the parameter.
pub(crate) type Interval = [f64; 2];

/// Narrows an interval to where the linear function with the values `at_0` and `at_1` at parameters 0 and 1 is not
/// negative; false if nothing is left.
pub(crate) fn clip(interval: &mut Interval, at_0: f64, at_1: f64) -> bool {
    if at_0 < 0.0 && at_1 < 0.0 {
        return false;
    }
    let root = at_0 / (at_0 - at_1);
    if at_0 < 0.0 {
        interval[0] = interval[0].max(root);
    } else if at_1 < 0.0 {
        interval[1] = interval[1].min(root);
    }
    interval[0] <= interval[1]
}

/// Disjoint intervals, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Intervals(Vec<Interval>);

impl From<Interval> for Intervals {
    fn from(whole: Interval) -> Self {
        Self(vec![whole])
    }
}

impl Intervals {
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Interval> {
        self.0.iter().copied()
    }

    /// Takes an interval out.
    pub(crate) fn subtract(&mut self, [low, high]: Interval) {
        let mut i = 0;
        while i < self.0.len() {
            let [first, last] = self.0[i];
            if high <= first || last <= low {
                i += 1;
                continue;
            }
            let (before, after) = (low - first > SLIVER, last - high > SLIVER);
            match (before, after) {
                (false, false) => {
                    self.0.remove(i);
                    continue;
                }
                (true, false) => self.0[i] = [first, low],
                (false, true) => self.0[i] = [high, last],
                (true, true) => {
                    self.0[i] = [first, low];
                    self.0.insert(i + 1, [high, last]);
                    i += 1;
                }
            }
            i += 1;
        }
    }

    /// Adds the intervals of another set.
    pub(crate) fn unite(&mut self, other: &Self) {
        self.0.extend(other.iter());
        self.0.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        self.0.dedup_by(|next, kept| {
            let joins = next[0] <= kept[1] + SLIVER;
            if joins {
                kept[1] = kept[1].max(next[1]);
            }
            joins
        });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn intervals(list: &[Interval]) -> Intervals {
        Intervals(list.to_vec())
    }

    #[test]
    fn subtraction_and_union_by_hand() {
        let mut set = Intervals::from([0.0, 1.0]);
        set.subtract([2.0, 3.0]);
        set.subtract([1.0, 1.0]);
        assert_eq!(set, intervals(&[[0.0, 1.0]]));
        set.subtract([0.25, 0.5]);
        assert_eq!(set, intervals(&[[0.0, 0.25], [0.5, 1.0]]));
        set.subtract([0.125, 0.75]);
        assert_eq!(set, intervals(&[[0.0, 0.125], [0.75, 1.0]]));
        set.unite(&intervals(&[[0.5, 0.75], [0.1, 0.2]]));
        assert_eq!(set, intervals(&[[0.0, 0.2], [0.5, 1.0]]));
        set.subtract([-1.0, 0.2 - 1e-15]);
        set.subtract([0.5, 2.0]);
        assert!(set.is_empty());
    }

    #[test]
    fn clipping_by_hand() {
        let mut interval = [0.0, 1.0];
        assert!(clip(&mut interval, 1.0, 3.0) && interval == [0.0, 1.0]);
        assert!(clip(&mut interval, -1.0, 3.0) && interval == [0.25, 1.0]);
        assert!(clip(&mut interval, 1.0, -1.0) && interval == [0.25, 0.5]);
        assert!(!clip(&mut interval, -3.0, 1.0));
        assert!(!clip(&mut [0.0, 1.0], -1.0, -2.0));
    }

    proptest! {
        #[test]
        fn a_point_is_left_if_and_only_if_nothing_took_it(
            taken in proptest::collection::vec((0.0..1.0f64, 0.0..0.3f64), 0..8), x in 0.0..1.0f64,
        ) {
            let mut set = Intervals::from([0.0, 1.0]);
            for &(low, length) in &taken {
                set.subtract([low, low + length]);
            }
            let was_taken = taken.iter().any(|&(low, length)| low < x && x < low + length);
            prop_assert_eq!(set.iter().any(|[low, high]| low <= x && x <= high), !was_taken);
        }
    }
}
