//! The order in which the pixels of a block are looked at, and which of those that are known each is predicted from.

/// Pixels between those of the coarsest grid, the paper's: at twice that a third fewer are looked at in full, and more is
/// predicted wrong.
const COARSEST: usize = 16;

/// One pixel of a block; pixels are counted row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    pub pixel: usize,
    /// Pixels that it is predicted from; none where nothing is predicted.
    pub sources: Vec<usize>,
    /// Whether its sources share an edge with it, so that no border is seen between them.
    pub is_finest: bool,
}

impl Step {
    fn new(width: usize, (x, y): (usize, usize), sources: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let sources: Vec<(usize, usize)> = sources.into_iter().collect();
        let is_finest = sources.iter().all(|&(sx, sy)| sx.abs_diff(x) + sy.abs_diff(y) <= 1);
        let pixel = |(x, y)| y * width + x;
        Self { pixel: pixel((x, y)), sources: sources.into_iter().map(pixel).collect(), is_finest }
    }
}

/// Row by row, each pixel from the one on its left, or from the three above and on the left.
pub(crate) fn scanlines(width: usize, height: usize, from_three: bool) -> Vec<Step> {
    let step = |i: usize| {
        let (x, y) = (i % width, i / width);
        let sources = match (x, y, from_three) {
            (0, ..) | (_, 0, true) => Vec::new(),
            (_, _, true) => vec![(x - 1, y), (x, y - 1), (x - 1, y - 1)],
            (_, _, false) => vec![(x - 1, y)],
        };
        Step::new(width, (x, y), sources)
    };
    (0..width * height).map(step).collect()
}

/// From a coarse grid to all pixels: the middles of cells from their corners, then those of edges from their ends and the
/// middles on both sides. Cells need not be square, so that a block of any size has its last row and column in the coarsest
/// grid; on the border of a block an edge has one side.
pub(crate) fn grid(width: usize, height: usize) -> Vec<Step> {
    let (mut columns, mut rows) = (coarsest(width), coarsest(height));
    let mut steps: Vec<Step> =
        rows.iter().flat_map(|&y| columns.iter().map(move |&x| Step::new(width, (x, y), []))).collect();
    loop {
        let (between_columns, between_rows) = (middles(&columns), middles(&rows));
        if between_columns.is_empty() && between_rows.is_empty() {
            return steps;
        }
        for &(j, y) in &between_rows {
            for &(i, x) in &between_columns {
                let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| (columns[i], rows[j]));
                steps.push(Step::new(width, (x, y), corners));
            }
        }
        for (j, &y) in rows.iter().enumerate() {
            for &(i, x) in &between_columns {
                let ends = [(columns[i], y), (columns[i + 1], y)];
                let middles = beside(&between_rows, j).map(|y| (x, y));
                steps.push(Step::new(width, (x, y), ends.into_iter().chain(middles)));
            }
        }
        for &(j, y) in &between_rows {
            for (i, &x) in columns.iter().enumerate() {
                let ends = [(x, rows[j]), (x, rows[j + 1])];
                let middles = beside(&between_columns, i).map(|x| (x, y));
                steps.push(Step::new(width, (x, y), ends.into_iter().chain(middles)));
            }
        }
        columns.extend(between_columns.iter().map(|&(_, x)| x));
        rows.extend(between_rows.iter().map(|&(_, y)| y));
        columns.sort_unstable();
        rows.sort_unstable();
    }
}

/// Lines of the coarsest grid: the last line of all is one of them.
fn coarsest(length: usize) -> Vec<usize> {
    (0..length - 1).step_by(COARSEST).chain([length - 1]).collect()
}

/// Numbers of the intervals between lines that have a middle, and that.
fn middles(lines: &[usize]) -> Vec<(usize, usize)> {
    let middle = |(i, pair): (usize, &[usize])| (pair[1] - pair[0] > 1).then_some((i, pair[0].midpoint(pair[1])));
    lines.windows(2).enumerate().filter_map(middle).collect()
}

/// Middles of the intervals before and after a line.
fn beside(middles: &[(usize, usize)], line: usize) -> impl Iterator<Item = usize> {
    let first = middles.partition_point(|&(interval, _)| interval + 1 < line);
    middles[first..].iter().take_while(move |&&(interval, _)| interval <= line).map(|&(_, middle)| middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pixel once, each from pixels that came before.
    fn check(width: usize, height: usize, steps: &[Step]) {
        let mut is_known = vec![false; width * height];
        for step in steps {
            assert!(step.sources.iter().all(|&source| is_known[source]), "{width} × {height}: {step:?}");
            assert!(!std::mem::replace(&mut is_known[step.pixel], true), "{width} × {height}: {step:?}");
        }
        assert!(is_known.iter().all(|&known| known), "{width} × {height}");
    }

    #[test]
    fn every_pixel_has_its_turn() {
        for (width, height) in [(1, 1), (1, 9), (2, 2), (3, 1), (65, 65), (64, 64), (17, 60), (65, 5)] {
            for steps in [grid(width, height), scanlines(width, height, true), scanlines(width, height, false)] {
                check(width, height, &steps);
            }
        }
    }

    /// The paper's grid: a fraction of 1/256 in full, half of all pixels from those that share an edge.
    #[test]
    fn a_whole_block_has_the_grid_of_the_paper() {
        let steps = grid(65, 65);
        assert_eq!(steps.iter().filter(|step| step.sources.is_empty()).count(), 25);
        let finest = steps.iter().filter(|step| step.is_finest && !step.sources.is_empty()).count();
        assert_eq!(finest, (65 * 65 - 1) / 2);
        let inner = steps.iter().filter(|step| step.sources.len() == 4).count();
        assert!(inner * 100 > steps.len() * 93, "{inner} of {}", steps.len());
        let middle = steps.iter().find(|step| step.pixel == 8 * 65 + 8).map(|step| step.sources.clone());
        assert_eq!(middle, Some(vec![0, 16, 16 * 65, 16 * 65 + 16]));
    }
}
