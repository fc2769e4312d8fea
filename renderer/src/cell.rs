//! Cells of the image plane: rectangles that halve until they are smaller than a pixel.
//!
//! Corners are whole numbers of a unit of 2⁻¹⁸ pixels, and sides powers of two of it, so that halving is exact and the cells of one
//! level form a grid.

use glam::DVec2;

use crate::sequence::scatter;

/// Units that a pixel is wide, as a power of two. Sides of 2¹⁴ pixels and this fill 32 bits; cells a hundred times smaller than
/// the smallest that a picture ever needs are still whole.
pub(crate) const PIXEL: u8 = 18;

/// Most pixels in a row or a column of a picture, so that its corners fit 32 bits.
pub const MOST_PIXELS: u32 = 1 << (32 - PIXEL as u32);

/// A rectangle of the image plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cell {
    /// Upper left corner, units.
    pub corner: [u32; 2],
    /// Sides, units, as powers of two.
    pub log_sides: [u8; 2],
}

/// What becomes of a cell that is halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halves {
    /// Two halves along an axis, the second to the right of the first or below it.
    Both(usize, [Cell; 2]),
    /// The second half is outside of the picture: the first stands for the whole.
    First(usize, Cell),
    /// It is one unit, and stays whole.
    None,
}

impl Cell {
    /// The cell around a picture of so many pixels.
    pub fn around(size: [u32; 2]) -> Self {
        Self { corner: [0; 2], log_sides: size.map(|pixels| PIXEL + pixels.next_power_of_two().ilog2() as u8) }
    }

    /// The axis that the cell is halved along: its longer side; of equal ones the vertical one, as the paper begins with lines
    /// that are parallel to the x axis.
    pub fn axis(&self) -> usize {
        usize::from(self.log_sides[1] >= self.log_sides[0])
    }

    /// Whether this is a pixel.
    pub fn is_pixel(&self) -> bool {
        self.log_sides == [PIXEL; 2]
    }

    /// How often a cell may be halved: the same for all of one size.
    pub fn level(&self) -> u8 {
        self.log_sides[0] + self.log_sides[1]
    }

    /// A number that no other cell has: its middle. One unit wide, it may be another's corner.
    pub fn number(&self) -> u64 {
        let middle = |axis: usize| u64::from(self.corner[axis]) + (1 << self.log_sides[axis] >> 1);
        middle(0) | middle(1) << 32
    }

    /// The two halves, of which a picture of so many pixels may have but one.
    pub fn halves(&self, size: [u32; 2]) -> Halves {
        let axis = self.axis();
        if self.log_sides[axis] == 0 {
            return Halves::None;
        }
        let mut first = *self;
        first.log_sides[axis] -= 1;
        let middle = u64::from(self.corner[axis]) + (1 << first.log_sides[axis]);
        if middle >= u64::from(size[axis]) << PIXEL {
            return Halves::First(axis, first);
        }
        let mut second = first;
        second.corner[axis] = middle as u32;
        Halves::Both(axis, [first, second])
    }

    /// Area within a picture, pixels.
    pub fn area(&self, size: [u32; 2]) -> f32 {
        let side = |axis| (self.end(axis, size) - u64::from(self.corner[axis])) as f32 / (1u32 << PIXEL) as f32;
        side(0) * side(1)
    }

    /// Where the cell ends along an axis, within a picture; units.
    pub fn end(&self, axis: usize, size: [u32; 2]) -> u64 {
        (u64::from(self.corner[axis]) + (1u64 << self.log_sides[axis])).min(u64::from(size[axis]) << PIXEL)
    }

    /// Upper left and lower right corner within a picture, pixels.
    pub fn bounds(&self, size: [u32; 2]) -> [DVec2; 2] {
        let corner = self.corner.map(u64::from);
        [corner, [self.end(0, size), self.end(1, size)]]
            .map(|[x, y]| DVec2::new(x as f64, y as f64) / f64::from(1u32 << PIXEL))
    }

    /// A place in the part of the cell within a picture, from two numbers of 32 bits; units.
    pub fn place(&self, size: [u32; 2], numbers: [u32; 2]) -> [u32; 2] {
        std::array::from_fn(|axis| {
            let side = self.end(axis, size) - u64::from(self.corner[axis]);
            self.corner[axis] + ((side * u64::from(numbers[axis])) >> 32) as u32
        })
    }

    /// A place anywhere in the part within a picture, the same for the same seed; units.
    pub fn jittered(&self, size: [u32; 2], seed: u64) -> [u32; 2] {
        let number = scatter(seed, self.number());
        self.place(size, [number as u32, (number >> 32) as u32])
    }

    /// Whether a place lies in the cell.
    pub fn contains(&self, place: [u32; 2]) -> bool {
        (0..2).all(|axis| {
            place[axis].checked_sub(self.corner[axis]).is_some_and(|way| u64::from(way) >> self.log_sides[axis] == 0)
        })
    }
}

/// A place in pixels: the middle of its unit.
pub(crate) fn pixels(place: [u32; 2]) -> DVec2 {
    (DVec2::new(f64::from(place[0]), f64::from(place[1])) + 0.5) / f64::from(1u32 << PIXEL)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cells down to pixels.
    fn pixels_below(cell: Cell, size: [u32; 2], found: &mut Vec<Cell>) {
        match cell.halves(size) {
            _ if cell.is_pixel() => found.push(cell),
            Halves::Both(_, halves) => halves.into_iter().for_each(|half| pixels_below(half, size, found)),
            Halves::First(_, first) => pixels_below(first, size, found),
            Halves::None => unreachable!("a pixel comes before"),
        }
    }

    #[test]
    fn halving_ends_in_every_pixel_once() {
        for size in [[1, 1], [1, 7], [5, 1], [13, 6], [64, 64], [3, 300]] {
            let mut found = Vec::new();
            pixels_below(Cell::around(size), size, &mut found);
            let mut places: Vec<[u32; 2]> = found.iter().map(|cell| cell.corner.map(|unit| unit >> PIXEL)).collect();
            places.sort_unstable();
            let all: Vec<[u32; 2]> = (0..size[0]).flat_map(|x| (0..size[1]).map(move |y| [x, y])).collect();
            assert_eq!(places, all);
            assert!(found.iter().all(|cell| cell.area(size) == 1.0));
        }
    }

    #[test]
    fn the_largest_picture_fits() {
        let size = [MOST_PIXELS; 2];
        let whole = Cell::around(size);
        assert_eq!(whole.bounds(size), [DVec2::ZERO, DVec2::splat(f64::from(MOST_PIXELS))]);
        let last = whole.place(size, [u32::MAX; 2]);
        assert!(whole.contains(last) && last[0] >> PIXEL == MOST_PIXELS - 1);
        let Halves::Both(1, [upper, lower]) = whole.halves(size) else { unreachable!("it has halves") };
        assert!(lower.contains(last) && !upper.contains(last));
    }

    #[test]
    fn a_cell_ends_where_the_picture_does() {
        let size = [5, 3];
        let whole = Cell::around(size);
        assert_eq!((whole.area(size), whole.bounds(size)[1]), (15.0, DVec2::new(5.0, 3.0)));
        for numbers in [[0, 0], [u32::MAX; 2], [1 << 31, 7]] {
            let place = pixels(whole.place(size, numbers));
            assert!(place.cmpgt(DVec2::ZERO).all() && place.x < 5.0 && place.y < 3.0);
        }
    }

    #[test]
    fn a_unit_is_not_halved_and_cells_have_numbers_of_their_own() {
        let unit = Cell { corner: [6, 9], log_sides: [0, 0] };
        assert_eq!(unit.halves([1, 1]), Halves::None);
        let mut numbers = std::collections::BTreeSet::new();
        let mut cell = Cell::around([8, 8]);
        while let Halves::Both(_, [first, second]) = cell.halves([8, 8])
            && first.log_sides[1] > 0
        {
            assert!(numbers.insert(first.number()) && numbers.insert(second.number()));
            cell = if first.log_sides[0] % 2 == 0 { first } else { second };
        }
        assert!(numbers.len() > 60);
    }
}
