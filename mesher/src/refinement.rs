//! Which leaves are divided: those in which most of the error lies.

/// Indices, ascending, of the fewest entries that must go for the sum of the others to be at most `allowed`. Dividing a leaf
/// leaves some of its error; what is marked is what does most for its cost (Dörfler 1996).
pub(crate) fn worst(errors: &[f64], allowed: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..errors.len()).filter(|&i| errors[i] > 0.0).collect();
    order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]).then(b.cmp(&a)));
    let mut sum = 0.0;
    let kept = order.iter().take_while(|&&i| {
        sum += errors[i];
        sum <= allowed
    });
    let kept = kept.count();
    let mut marked = order.split_off(kept);
    marked.sort_unstable();
    marked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_go_until_the_rest_is_allowed() {
        assert_eq!(worst(&[], 1.0), []);
        assert_eq!(worst(&[0.0, f64::NAN, 0.0], 0.0), []);
        assert_eq!(worst(&[1.0, 5.0, 2.0, 4.0], 3.0), [1, 3]);
        assert_eq!(worst(&[1.0, 5.0, 2.0, 4.0], 2.9), [1, 2, 3]);
        assert_eq!(worst(&[1.0, 1.0, 1.0], 2.0), [0]);
        assert_eq!(worst(&[1.0, 1.0], 2.0), []);
    }
}
