//! Where a picture's samples lie (Painter & Sloan 1989, figures 4 and 5): a picture of how many each pixel has, and how many
//! pixels have so many.

/// Samples of a pixel that are shown as white; more are red.
pub const WHITE_SAMPLES: u32 = 20;

/// The map of counts, as a display shows it: black is none, white twenty, red more.
pub fn sample_map(counts: &[u32]) -> Vec<[u8; 3]> {
    let colour = |&count: &u32| match count {
        0..=WHITE_SAMPLES => [(count * 255 / WHITE_SAMPLES) as u8; 3],
        _ => [255, 0, 0],
    };
    counts.iter().map(colour).collect()
}

/// How many pixels have 0, 1, 2 … 20 samples, and in the last place, more.
pub fn sample_histogram(counts: &[u32]) -> Vec<u64> {
    let mut histogram = vec![0; WHITE_SAMPLES as usize + 2];
    for &count in counts {
        histogram[count.min(WHITE_SAMPLES + 1) as usize] += 1;
    }
    histogram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_are_white_and_more_are_red() {
        assert!(sample_map(&[]).is_empty());
        assert_eq!(sample_map(&[0, 4, 20, 21, u32::MAX]), [[0; 3], [51; 3], [255; 3], [255, 0, 0], [255, 0, 0]]);
        let histogram = sample_histogram(&[0, 1, 1, 20, 21, 5000]);
        assert_eq!((histogram.len(), histogram[0], histogram[1], histogram[20], histogram[21]), (22, 1, 2, 1, 2));
    }
}
