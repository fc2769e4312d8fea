//! The work image of a coherence map (Guo 1998, sections 2 and 5): pixels at super-sample resolution, of which few are evaluated.
//!
//! Only evaluated pixels are stored. Those of a tile of 8 × 8 lie together, found by a mask of 64 bits; so what is not evaluated
//! takes half a byte a pixel.

use glam::Vec3;

/// Side of a tile, pixels: a mask of it has 64 bits.
const TILE: u32 = 8;

/// An evaluated pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WorkPixel {
    /// W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// Its luminance as it is compared: asked for more often than there are pixels.
    pub shown: f32,
    /// What is seen there, as of [`crate::Evaluation`].
    pub object: u32,
}

/// Evaluated pixels, each written once.
pub(crate) struct WorkImage {
    width: u32,
    height: u32,
    columns: usize,
    tiles: Vec<Tile>,
    evaluated: usize,
}

#[derive(Clone, Default)]
struct Tile {
    /// Bit 8·y + x of every evaluated pixel.
    mask: u64,
    /// In the order of their bits.
    pixels: Vec<WorkPixel>,
}

impl Tile {
    /// Where a pixel stands among the evaluated ones.
    fn rank(&self, bit: u32) -> usize {
        (self.mask & ((1 << bit) - 1)).count_ones() as usize
    }
}

impl WorkImage {
    /// An image of so many pixels, none of them evaluated.
    pub fn new(width: u32, height: u32) -> Self {
        let [columns, rows] = [width, height].map(|side| side.div_ceil(TILE) as usize);
        Self { width, height, columns, tiles: vec![Tile::default(); columns * rows], evaluated: 0 }
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// How many pixels are evaluated.
    pub fn evaluated(&self) -> usize {
        self.evaluated
    }

    /// A pixel, if it is evaluated.
    pub fn get(&self, [x, y]: [u32; 2]) -> Option<&WorkPixel> {
        let (tile, bit) = self.place(x, y);
        let tile = &self.tiles[tile];
        (tile.mask >> bit & 1 == 1).then(|| &tile.pixels[tile.rank(bit)])
    }

    /// Whether a pixel is evaluated.
    pub fn has(&self, [x, y]: [u32; 2]) -> bool {
        let (tile, bit) = self.place(x, y);
        self.tiles[tile].mask >> bit & 1 == 1
    }

    /// Stores what is seen at a pixel. What was stored there before stays: false.
    pub fn insert(&mut self, [x, y]: [u32; 2], pixel: WorkPixel) -> bool {
        let (tile, bit) = self.place(x, y);
        let tile = &mut self.tiles[tile];
        if tile.mask >> bit & 1 == 1 {
            return false;
        }
        tile.pixels.insert(tile.rank(bit), pixel);
        tile.mask |= 1 << bit;
        self.evaluated += 1;
        true
    }

    /// Evaluated pixels of the tiles that lie in some rows, tile by tile: those of rows before and after are among them.
    pub fn in_rows(&self, rows: std::ops::Range<u32>) -> impl Iterator<Item = ([u32; 2], &WorkPixel)> {
        let bands = (rows.start / TILE) as usize
            ..(rows.end.div_ceil(TILE) as usize).min(self.tiles.len() / self.columns.max(1));
        let tiles = bands.start * self.columns..bands.end * self.columns;
        tiles.flat_map(move |number| {
            let corner = [(number % self.columns) as u32 * TILE, (number / self.columns) as u32 * TILE];
            let tile = &self.tiles[number];
            let mut left = tile.mask;
            tile.pixels.iter().map(move |pixel| {
                let bit = left.trailing_zeros();
                left &= left - 1;
                ([corner[0] + bit % TILE, corner[1] + bit / TILE], pixel)
            })
        })
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let pixels: usize = self.tiles.iter().map(|tile| tile.pixels.capacity()).sum();
        pixels * size_of::<WorkPixel>() + self.tiles.len() * size_of::<Tile>()
    }

    fn place(&self, x: u32, y: u32) -> (usize, u32) {
        ((y / TILE) as usize * self.columns + (x / TILE) as usize, y % TILE * TILE + x % TILE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_without_pixels_has_none() {
        for (width, height) in [(0, 0), (0, 9), (9, 0)] {
            let image = WorkImage::new(width, height);
            assert_eq!((image.evaluated(), image.in_rows(0..height).count()), (0, 0));
        }
    }

    #[test]
    fn pixels_are_found_again_in_any_order_and_never_overwritten() {
        let (width, height) = (21, 13);
        let mut image = WorkImage::new(width, height);
        let value = |i: u32| WorkPixel { radiance: Vec3::splat(i as f32), shown: i as f32, object: i };
        let order = (0..width * height).map(|i| i * 101 % (width * height));
        for i in order.clone().take(100) {
            assert!(image.get([i % width, i / width]).is_none() && image.insert([i % width, i / width], value(i)));
        }
        for i in order.clone() {
            let is_new = !image.has([i % width, i / width]);
            assert_eq!(image.insert([i % width, i / width], value(i)), is_new);
            assert!(!image.insert([i % width, i / width], value(7777)));
        }
        assert_eq!(image.evaluated(), (width * height) as usize);
        assert!(order.clone().all(|i| image.get([i % width, i / width]) == Some(&value(i))));
        assert!(image.in_rows(0..height).all(|([x, y], pixel)| pixel.object == y * width + x));
        assert_eq!(image.in_rows(9..10).count(), (width * 5) as usize, "the tiles of rows 8 to 12");
    }
}
