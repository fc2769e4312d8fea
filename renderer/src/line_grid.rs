//! Visible lines by the elementary blocks of a work image that they cross.

use crate::block::{Block, ELEMENTARY};
use crate::visible_lines::VisibleLine;
use glam::DVec2;

/// Lines, found by the blocks that they cross.
pub(crate) struct LineGrid {
    columns: u32,
    /// In pixels of the work image, from the centre of the first.
    lines: Vec<VisibleLine>,
    /// Elementary blocks and lines that cross them, in order.
    crossings: Vec<(u32, u32)>,
}

impl LineGrid {
    /// Lines of a picture over a work image of so many pixels, some along a side of each of the picture's.
    pub fn new(lines: &[VisibleLine], [width, height]: [u32; 2], supersample: u32) -> Self {
        let columns = width.div_ceil(ELEMENTARY);
        let lines: Vec<VisibleLine> = lines
            .iter()
            .filter(|ends| ends.iter().all(|end| end.is_finite()))
            .map(|ends| ends.map(|end| end * f64::from(supersample) - 0.5))
            .collect();
        let cell = |place: f64, pixels: u32| (place.clamp(0.0, f64::from(pixels - 1)) as u32) / ELEMENTARY;
        let mut crossings = Vec::new();
        for (number, line) in (0..).zip(&lines) {
            let (low, high) = (line[0].min(line[1]), line[0].max(line[1]));
            for row in cell(low.y, height)..=cell(high.y, height) {
                let rows = [row, row + 1].map(|row| f64::from(row * ELEMENTARY));
                let Some([enter, leave]) = clipped(line, 1, rows) else { continue };
                let ends = [enter, leave].map(|place| line[0].lerp(line[1], place).x);
                let first = cell(ends[0].min(ends[1]), width);
                let last = cell(ends[0].max(ends[1]), width);
                crossings.extend((first..=last).map(|column| (row * columns + column, number)));
            }
        }
        crossings.sort_unstable();
        Self { columns, lines, crossings }
    }

    /// Whether a line crosses an elementary block, or a part of one: of no width, its side.
    pub fn crosses(&self, block: &Block) -> bool {
        let [column, row] = block.low.map(|place| place / ELEMENTARY);
        // A side on the border of two is one's first or the other's last.
        let columns =
            column.saturating_sub(u32::from(block.low[0] == block.high[0] && block.low[0].is_multiple_of(ELEMENTARY)));
        let rows =
            row.saturating_sub(u32::from(block.low[1] == block.high[1] && block.low[1].is_multiple_of(ELEMENTARY)));
        (rows..=row).flat_map(|row| (columns..=column).map(move |column| row * self.columns + column)).any(|cell| {
            let start = self.crossings.partition_point(|crossing| crossing.0 < cell);
            let of_cell = self.crossings[start..].iter().take_while(|crossing| crossing.0 == cell);
            of_cell.into_iter().any(|&(_, line)| is_crossed(block, &self.lines[line as usize]))
        })
    }
}

fn is_crossed(block: &Block, line: &VisibleLine) -> bool {
    let range = |axis: usize| [block.low[axis], block.high[axis]].map(f64::from);
    match (clipped(line, 0, range(0)), clipped(line, 1, range(1))) {
        (Some(across), Some(down)) => across[0].max(down[0]) <= across[1].min(down[1]),
        _ => false,
    }
}

/// The part of a line, 0..=1, within a range along an axis.
fn clipped([from, to]: &[DVec2; 2], axis: usize, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let (start, along) = (from[axis], to[axis] - from[axis]);
    if along == 0.0 {
        return (low <= start && start <= high).then_some([0.0, 1.0]);
    }
    let places = [(low - start) / along, (high - start) / along];
    let (enter, leave) = (places[0].min(places[1]).max(0.0), places[0].max(places[1]).min(1.0));
    (enter <= leave).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_lines_and_lines_that_are_none_cross_nothing() {
        let block = Block { low: [0, 0], high: [8, 8] };
        assert!(!LineGrid::new(&[], [20, 20], 1).crosses(&block));
        assert!(!LineGrid::new(&[[DVec2::NAN, DVec2::ONE]], [20, 20], 1).crosses(&block));
    }

    #[test]
    fn blocks_and_sides_that_a_line_passes_are_crossed() {
        let line = [DVec2::new(1.0, 9.5), DVec2::new(30.0, 12.0)];
        let grid = LineGrid::new(&[line], [100, 50], 2);
        for (low, high, expected) in [
            ([0, 16], [8, 24], true),
            ([8, 16], [16, 24], true),
            ([0, 0], [8, 8], false),
            ([0, 24], [8, 32], false),
            ([64, 16], [72, 24], false),
            ([16, 18], [16, 20], true),
            ([16, 20], [16, 22], false),
            ([8, 16], [8, 24], true),
        ] {
            assert_eq!(grid.crosses(&Block { low, high }), expected, "{low:?} {high:?}");
        }
    }
}
