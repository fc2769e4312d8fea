//! Means over the cells of a fine grid of what is given over triangles, and what a filter makes of them.
//!
//! The integral of a filter over a triangle has no simple form, that over a rectangle has. So triangles are cut along the lines
//! of a grid, where what is a polynomial on each is integrated exactly; within a cell the filter sees the mean.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::filter::SummedFilter;

/// Cells along a side of a pixel: the more, the more pieces triangles are cut into. At four a filter takes the light on one
/// side of a border for a 32nd of a pixel away from where it is at most; the box, whose border is one of the cells', for where
/// it is.
const FINE: usize = 4;

/// Rows of cells that one thread adds to at a time.
const BAND: usize = 64;

/// A triangle with a polynomial of degree 2 at most over it.
pub(crate) trait Piece: Sync {
    /// Corners, pixels.
    fn corners(&self) -> [DVec2; 3];
    /// The value at a point of the triangle.
    fn value(&self, point: DVec2) -> DVec3;
}

/// Weights of a triangle's corners at a point.
pub(crate) fn barycentrics([a, b, c]: [DVec2; 3], point: DVec2) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let (s, t) = ((point - a).perp_dot(c - a) / area, (b - a).perp_dot(point - a) / area);
    [1.0 - s - t, s, t]
}

/// Sums over cells: a value times area, and the area.
#[derive(Clone, Copy, Default)]
struct Cell {
    value: DVec3,
    area: f64,
}

/// The picture of pieces that do not overlap, filtered, row by row. Cells without pieces have the value of the nearest one in
/// their row, rows without any that of the nearest row.
pub(crate) fn filtered(size: [u32; 2], filter: &SummedFilter, pieces: &[impl Piece]) -> Vec<Vec3> {
    let [columns, rows] = size.map(|pixels| pixels as usize * FINE);
    let mut cells = vec![Cell::default(); columns * rows];
    let mut of_band: Vec<Vec<u32>> = vec![Vec::new(); rows.div_ceil(BAND)];
    for (number, piece) in (0..).zip(pieces) {
        let span = span(&piece.corners(), 1, rows);
        of_band[span.start / BAND..span.end.div_ceil(BAND)].iter_mut().for_each(|band| band.push(number));
    }
    let bands = cells.par_chunks_mut((BAND * columns).max(1)).zip(&of_band).enumerate();
    bands.for_each(|(band, (cells, of_band))| {
        let rows = band * BAND..band * BAND + cells.len() / columns;
        let mut cut = Cut::default();
        of_band.iter().for_each(|&piece| cut.add(&pieces[piece as usize], rows.clone(), columns, cells));
    });
    let means = means(columns, &cells);
    convolved(size, filter, &means)
}

/// The cells along an axis that points lie in.
fn span(points: &[DVec2], axis: usize, cells: usize) -> Range<usize> {
    let places = || points.iter().map(|point| point[axis] * FINE as f64);
    let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(0.0, f64::max));
    (low.max(0.0) as usize).min(cells)..(high.ceil() as usize).min(cells)
}

/// Cuts pieces along a grid. The buffers are reused.
#[derive(Default)]
struct Cut {
    in_row: Vec<DVec2>,
    in_cell: Vec<DVec2>,
    spare: Vec<DVec2>,
}

impl Cut {
    fn add(&mut self, piece: &impl Piece, rows: Range<usize>, columns: usize, cells: &mut [Cell]) {
        let corners = piece.corners();
        let spanned = span(&corners, 1, rows.end);
        for row in spanned.start.max(rows.start)..spanned.end {
            self.in_row.clear();
            self.in_row.extend(corners);
            keep_between(&mut self.in_row, &mut self.spare, 1, row);
            for column in span(&self.in_row, 0, columns) {
                self.in_cell.clone_from(&self.in_row);
                keep_between(&mut self.in_cell, &mut self.spare, 0, column);
                let cell = &mut cells[(row - rows.start) * columns + column];
                for pair in self.in_cell.get(1..).unwrap_or_default().windows(2) {
                    let [a, b, c] = [self.in_cell[0], pair[0], pair[1]];
                    let area = (b - a).perp_dot(c - a) / 2.0;
                    // The mean over the midpoints of the edges is that over the triangle, for polynomials of degree 2.
                    let middles = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
                    cell.value += middles.into_iter().map(|middle| piece.value(middle)).sum::<DVec3>() * (area / 3.0);
                    cell.area += area;
                }
            }
        }
    }
}

/// Keeps of a convex outline what lies in the cells of a row or column.
fn keep_between(outline: &mut Vec<DVec2>, spare: &mut Vec<DVec2>, axis: usize, cell: usize) {
    for (border, side) in [(cell, 1.0), (cell + 1, -1.0)] {
        let border = border as f64 / FINE as f64;
        let inside = |point: DVec2| side * (point[axis] - border);
        if outline.iter().all(|&point| inside(point) >= 0.0) {
            continue;
        }
        spare.clear();
        let Some(&last) = outline.last() else { return };
        let (mut before, mut height) = (last, inside(last));
        for &point in outline.iter() {
            let next = inside(point);
            if (height > 0.0) != (next > 0.0) {
                let mut crossing = before.lerp(point, height / (height - next));
                crossing[axis] = border;
                spare.push(crossing);
            }
            if next > 0.0 {
                spare.push(point);
            }
            (before, height) = (point, next);
        }
        std::mem::swap(outline, spare);
    }
}

/// The means of cells, row by row. What is covered is convex, so that in a row it has two ends.
fn means(columns: usize, cells: &[Cell]) -> Vec<DVec3> {
    let mean = |cell: &Cell| (cell.area > 0.0).then(|| cell.value / cell.area);
    let filled = |row: &[Cell]| {
        let first = row.iter().find_map(mean)?;
        Some(
            row.iter()
                .scan(first, |last, cell| {
                    *last = mean(cell).unwrap_or(*last);
                    Some(*last)
                })
                .collect::<Vec<DVec3>>(),
        )
    };
    let rows: Vec<Option<Vec<DVec3>>> = cells.chunks(columns.max(1)).map(filled).collect();
    let black = vec![DVec3::ZERO; columns];
    let mut last = rows.iter().flatten().next().unwrap_or(&black);
    let mut means = Vec::with_capacity(cells.len());
    for row in &rows {
        last = row.as_ref().unwrap_or(last);
        means.extend_from_slice(last);
    }
    means
}

/// The picture of means over cells through a filter; where this ends beyond the picture, what lies within counts for the whole.
fn convolved([width, height]: [u32; 2], filter: &SummedFilter, means: &[DVec3]) -> Vec<Vec3> {
    let (width, height) = (width as usize, height as usize);
    let columns = width * FINE;
    // From the first cell that the filter of a pixel reaches to the last, counted from the pixel's own first cell.
    let reach = (filter.radius * FINE as f64).ceil() as isize;
    let weight = |cell: isize| {
        let from = cell as f64 / FINE as f64 - 0.5;
        filter.left_of(from + 1.0 / FINE as f64) - filter.left_of(from)
    };
    let weights: Vec<f64> = (-reach..reach + FINE as isize).map(weight).collect();
    let sum = |pixel: usize, cells: usize, value: &dyn Fn(usize) -> DVec3| {
        let first = (pixel * FINE) as isize - reach;
        let within = |place: &(isize, &f64)| (0..cells as isize).contains(&place.0);
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (cell, weight) in (first..).zip(&weights).filter(within) {
            sum += value(cell as usize) * *weight;
            total += weight;
        }
        sum / total
    };
    let across: Vec<DVec3> = means
        .par_chunks(columns.max(1))
        .flat_map_iter(|row| (0..width).map(|pixel| sum(pixel, columns, &|cell| row[cell])).collect::<Vec<DVec3>>())
        .collect();
    let pixel = |number: usize| {
        let (x, y) = (number % width, number / width);
        sum(y, height * FINE, &|row| across[row * width + x]).max(DVec3::ZERO).as_vec3()
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Filter;

    /// A triangle with the value a + b·p + c x² in the first channel.
    struct Test([DVec2; 3], f64, DVec2, f64);

    impl Piece for Test {
        fn corners(&self) -> [DVec2; 3] {
            self.0
        }

        fn value(&self, point: DVec2) -> DVec3 {
            DVec3::X * (self.1 + self.2.dot(point) + self.3 * point.x * point.x)
        }
    }

    /// Two triangles over a picture of 12 × 8 pixels.
    fn halves(constant: f64, slope: DVec2, square: f64) -> [Test; 2] {
        let corner = |x: f64, y: f64| DVec2::new(12.0 * x, 8.0 * y);
        let [a, b, c, d] = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
        [Test([a, b, c], constant, slope, square), Test([a, c, d], constant, slope, square)]
    }

    #[test]
    fn without_pieces_the_picture_is_black() {
        let filter = SummedFilter::new(Filter::Lanczos);
        assert_eq!(filtered([2, 1], &filter, &[] as &[Test]), [Vec3::ZERO; 2]);
        assert!(filtered([0, 4], &filter, &halves(1.0, DVec2::ZERO, 0.0)).is_empty());
    }

    #[test]
    fn the_box_has_the_mean_of_a_quadratic() {
        let picture = filtered([12, 8], &SummedFilter::new(Filter::Box), &halves(1.0, DVec2::new(0.5, -0.1), 0.2));
        for (number, pixel) in picture.iter().enumerate() {
            let (x, y) = ((number % 12) as f64 + 0.5, (number / 12) as f64 + 0.5);
            let mean = 1.0 + 0.5 * x - 0.1 * y + 0.2 * (x * x + 1.0 / 12.0);
            assert!((f64::from(pixel.x) - mean).abs() < 1e-5, "{} for {mean}", pixel.x);
        }
    }

    #[test]
    fn beyond_the_pieces_it_goes_on_as_at_their_border() {
        let inner = [DVec2::new(3., 2.), DVec2::new(9., 2.), DVec2::new(9., 6.)];
        for filter in [Filter::Lanczos, Filter::Box, Filter::Gaussian] {
            let picture = filtered([12, 8], &SummedFilter::new(filter), &[Test(inner, 7.0, DVec2::ZERO, 0.0)]);
            assert!(picture.iter().all(|pixel| (pixel.x - 7.0).abs() < 1e-5), "{filter:?}");
        }
    }

    #[test]
    fn pieces_beyond_the_picture_do_no_harm() {
        let wide = [DVec2::new(-30., -30.), DVec2::new(90., -30.), DVec2::new(-30., 90.)];
        let picture = filtered([12, 8], &SummedFilter::new(Filter::Mitchell), &[Test(wide, 2.0, DVec2::ZERO, 0.0)]);
        assert!(picture.iter().all(|pixel| (pixel.x - 2.0).abs() < 1e-5));
    }
}
