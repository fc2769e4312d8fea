//! Sets of lights: one bit a light.

/// Lights of one word.
const WORD: usize = u64::BITS as usize;

/// Words that hold so many lights.
pub(crate) fn words(lights: usize) -> usize {
    lights.div_ceil(WORD)
}

/// Whether a light is in a set.
pub(crate) fn contains(set: &[u64], light: u32) -> bool {
    set[light as usize / WORD] >> (light as usize % WORD) & 1 == 1
}

/// Puts a light into a set or takes it out.
pub(crate) fn put(set: &mut [u64], light: u32, is_in: bool) {
    let (word, bit) = (light as usize / WORD, light as usize % WORD);
    set[word] = set[word] & !(1 << bit) | u64::from(is_in) << bit;
}

/// The lights of a set, in order.
pub(crate) fn members(set: &[u64]) -> impl Iterator<Item = u32> {
    (0..).zip(set).flat_map(|(word, &bits)| {
        let mut left = bits;
        std::iter::from_fn(move || {
            let bit = (left != 0).then(|| left.trailing_zeros())?;
            left &= left - 1;
            Some(word * WORD as u32 + bit)
        })
    })
}

/// How many lights there are in a set.
pub(crate) fn count(set: &[u64]) -> u64 {
    set.iter().map(|word| u64::from(word.count_ones())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_in_is_in() {
        let mut set = vec![0; words(130)];
        assert_eq!((set.len(), words(64), words(0)), (3, 1, 0));
        for light in [0, 63, 64, 129, 7] {
            put(&mut set, light, true);
        }
        put(&mut set, 7, false);
        put(&mut set, 8, false);
        assert_eq!(members(&set).collect::<Vec<_>>(), [0, 63, 64, 129]);
        assert!(contains(&set, 129) && !contains(&set, 7) && count(&set) == 4);
        assert_eq!(members(&[]).count(), 0);
    }
}
