//! Blocks of a work image (Guo 1998, sections 2 and 4): rectangles that share the pixels of their boundaries, parted like a
//! quadtree.

/// Longest side of an elementary block, steps between pixels (Guo's 8 × 8).
pub(crate) const ELEMENTARY: u32 = 8;

/// Most pixels on the boundary of an elementary block.
pub(crate) const MOST_ON_BOUNDARY: usize = 4 * ELEMENTARY as usize;

/// A rectangle between four pixels, which it includes. A work image of one row or column has blocks without a height or width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    /// The pixel at the upper left corner.
    pub low: [u32; 2],
    /// The one at the lower right.
    pub high: [u32; 2],
}

impl Block {
    /// Steps from the left pixels to the right ones, and from the upper to the lower.
    pub fn sides(&self) -> [u32; 2] {
        [self.high[0] - self.low[0], self.high[1] - self.low[1]]
    }

    /// Whether it is no larger than 8 × 8.
    pub fn is_elementary(&self) -> bool {
        self.sides().iter().all(|side| *side <= ELEMENTARY)
    }

    /// Whether all its pixels are corners.
    pub fn is_pixel(&self) -> bool {
        self.sides().iter().all(|side| *side <= 1)
    }

    /// The pixels at its corners, clockwise from the upper left.
    pub fn corners(&self) -> [[u32; 2]; 4] {
        let ([left, top], [right, bottom]) = (self.low, self.high);
        [[left, top], [right, top], [right, bottom], [left, bottom]]
    }

    /// Pixels on its boundary, as steps along it; a block without a height or width has each but the ends twice.
    pub fn perimeter(&self) -> u32 {
        let [width, height] = self.sides();
        2 * (width + height)
    }

    /// The pixel so many steps clockwise from the upper left corner, fewer than there are.
    pub fn on_boundary(&self, step: u32) -> [u32; 2] {
        let [width, height] = self.sides();
        let ([left, top], [right, bottom]) = (self.low, self.high);
        match step {
            _ if step < width => [left + step, top],
            _ if step < width + height => [right, top + step - width],
            _ if step < 2 * width + height => [right - (step - width - height), bottom],
            _ => [left, bottom - (step - 2 * width - height)],
        }
    }

    /// Its parts in order, four, or two if it is much longer than wide; of a block of pixels none. It is parted at the largest
    /// power of two within its longer side: so blocks are squares but for those at the end of a row or column.
    pub fn parts(&self) -> impl Iterator<Item = Self> + use<> {
        let [width, height] = self.sides();
        let step = width.max(height).div_ceil(2).next_power_of_two();
        let along = |axis: usize| {
            let (low, high) = (self.low[axis], self.high[axis]);
            match high - low {
                side if side <= step => [Some((low, high)), None],
                _ => [Some((low, low + step)), Some((low + step, high))],
            }
        };
        let (across, down) = (along(0), along(1));
        let all = down.into_iter().flatten().flat_map(move |(top, bottom)| {
            let part = move |(left, right)| Self { low: [left, top], high: [right, bottom] };
            across.into_iter().flatten().map(part)
        });
        all.take(if self.is_pixel() { 0 } else { 4 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(low: [u32; 2], high: [u32; 2]) -> Block {
        Block { low, high }
    }

    #[test]
    fn a_pixel_a_row_and_a_column_are_blocks() {
        let pixel = block([3, 4], [3, 4]);
        assert!(pixel.is_pixel() && pixel.perimeter() == 0 && pixel.parts().next().is_none());
        let row = block([0, 0], [5, 0]);
        let parts: Vec<Block> = row.parts().collect();
        assert_eq!(parts, [block([0, 0], [4, 0]), block([4, 0], [5, 0])]);
        assert_eq!((0..row.perimeter()).map(|step| row.on_boundary(step)[1]).max(), Some(0));
    }

    #[test]
    fn a_boundary_goes_once_around() {
        let block = block([10, 20], [13, 22]);
        let around: Vec<[u32; 2]> = (0..block.perimeter()).map(|step| block.on_boundary(step)).collect();
        assert_eq!(around.len(), 10);
        for (place, pixel) in around.iter().enumerate() {
            let next = around[(place + 1) % around.len()];
            assert_eq!(pixel[0].abs_diff(next[0]) + pixel[1].abs_diff(next[1]), 1);
        }
        assert!(block.corners().iter().all(|corner| around.contains(corner)));
    }

    #[test]
    fn parts_fill_a_block_of_any_size_down_to_pixels() {
        for (width, height) in [(8, 8), (7, 3), (100, 37), (1, 9), (64, 1), (0, 5)] {
            let mut open = vec![block([0, 0], [width, height])];
            let (mut area, mut elementary) = (0, 0);
            while let Some(block) = open.pop() {
                let parts: Vec<Block> = block.parts().collect();
                assert_eq!(parts.is_empty(), block.is_pixel());
                if block.is_pixel() {
                    area += block.sides().iter().product::<u32>();
                }
                if !block.is_elementary() {
                    let of_eight = |part: &Block| part.low.iter().all(|place| place % ELEMENTARY == 0);
                    assert!(parts.iter().all(of_eight));
                    elementary += parts.iter().filter(|part| part.is_elementary()).count();
                }
                open.extend(parts);
            }
            assert_eq!(area, width * height);
            assert!(elementary == 0 || elementary as u32 == width.div_ceil(8).max(1) * height.div_ceil(8).max(1));
        }
    }
}
