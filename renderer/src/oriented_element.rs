//! Oriented finite elements (Guo 1998, section 3): a block's light from that on its boundary, along one direction.
//!
//! Between two scanlines of a direction, through neighbouring pixels of the boundary, light is bilinear: linear along the
//! boundary, and linear along each scanline. So a pixel's light is that of the two ends of its own scanline, in the measure of
//! their distances.
//!
//! What we do differently: the discrepancy of a direction is the integral over the width that its scanlines fill, not over the
//! boundary's length. A side that a scanline runs along then has no part in it, where the paper's would compare its two ends.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::block::{Block, MOST_ON_BOUNDARY};
use crate::work_image::WorkImage;

/// Directions that are compared (Guo's h).
pub(crate) const DIRECTIONS: u32 = 8;

/// The light on the boundary of an elementary block, clockwise from the upper left corner.
pub(crate) struct Boundary {
    /// Width and height, steps between pixels.
    sides: Vec2,
    count: usize,
    /// The first again behind the last.
    values: [Vec3; MOST_ON_BOUNDARY + 1],
    /// Whether any but corners are evaluated.
    pub is_refined: bool,
}

impl Boundary {
    /// That of an elementary block whose corners are evaluated: pixels that are not are linear between those that are.
    pub fn of(block: &Block, image: &WorkImage) -> Self {
        let count = block.perimeter() as usize;
        let mut values = [Vec3::ZERO; MOST_ON_BOUNDARY + 1];
        let [width, height] = block.sides();
        let (mut last, mut known) = (0, 0);
        for step in 0..count {
            let Some(pixel) = image.get(block.on_boundary(step as u32)) else { continue };
            values[step] = pixel.radiance;
            fill_between(&mut values, last, step);
            (last, known) = (step, known + 1);
        }
        values[count] = values[0];
        fill_between(&mut values, last, count);
        let corners = if width == 0 || height == 0 { 2 } else { 4 };
        Self { sides: Vec2::new(width as f32, height as f32), count, values, is_refined: known > corners }
    }

    /// One value for each step around.
    pub fn values(&self) -> &[Vec3] {
        &self.values[..self.count]
    }

    /// The light at a pixel so many steps right of and below the upper left corner, inside, by the scanline of a unit vector.
    pub fn along(&self, direction: Vec2, place: Vec2) -> Vec3 {
        let ((ahead, from), (behind, to)) = (self.end(direction, place), self.end(-direction, place));
        (ahead * to + behind * from) / (from + to).max(f32::MIN_POSITIVE)
    }

    /// The light at a pixel inside where nothing is known of a direction: what the four sides say, blended (Coons), which is
    /// bilinear between corners if no more is evaluated.
    pub fn blended(&self, place: Vec2) -> Vec3 {
        let (x, y) = (place.x as usize, place.y as usize);
        let (width, height) = (self.sides.x as usize, self.sides.y as usize);
        let part = place / self.sides;
        let at = |step: usize| self.values[step];
        let between = at(2 * width + 2 * height - y).lerp(at(width + y), part.x);
        let over = at(x).lerp(at(2 * width + height - x), part.y);
        let upper = at(0).lerp(at(width), part.x);
        let lower = at(2 * width + height).lerp(at(width + height), part.x);
        between + over - upper.lerp(lower, part.y)
    }

    /// The light at the end of a scanline from a place on, and how far it is.
    fn end(&self, direction: Vec2, place: Vec2) -> (Vec3, f32) {
        let room = Vec2::select(direction.cmpgt(Vec2::ZERO), self.sides - place, place);
        let reach = room / direction.abs();
        // A scanline along an axis never meets two of the sides; 0/0 is not less than anything.
        if reach.y < reach.x || direction.x == 0.0 {
            let x = (place.x + direction.x * reach.y).clamp(0.0, self.sides.x);
            let step = if direction.y < 0.0 { x } else { 2.0 * self.sides.x + self.sides.y - x };
            (self.between(step), reach.y)
        } else {
            let y = (place.y + direction.y * reach.x).clamp(0.0, self.sides.y);
            let step = if direction.x > 0.0 { self.sides.x + y } else { self.count as f32 - y };
            (self.between(step), reach.x)
        }
    }

    fn between(&self, step: f32) -> Vec3 {
        let first = (step as usize).min(self.count - 1);
        self.values[first].lerp(self.values[first + 1], step - first as f32)
    }

    /// How much light changes along scanlines of a direction: the mean square.
    fn discrepancy(&self, direction: Vec2) -> f32 {
        let (mut squares, mut total) = (0.0, 0.0);
        let [width, height] = [self.sides.x as usize, self.sides.y as usize];
        for step in 0..self.count {
            // How far a scanline goes into the block for each step along it.
            let (place, depth) = match step {
                _ if step < width => (Vec2::new(step as f32, 0.0), direction.y),
                _ if step < width + height => (Vec2::new(self.sides.x, (step - width) as f32), -direction.x),
                _ if step < 2 * width + height => {
                    (Vec2::new((2 * width + height - step) as f32, self.sides.y), -direction.y)
                }
                _ => (Vec2::new(0.0, (self.count - step) as f32), direction.x),
            };
            let width_of_line = depth.abs();
            if width_of_line < 1e-3 {
                continue;
            }
            let (far, _) = self.end(direction * depth.signum(), place);
            squares += width_of_line * (self.values[step] - far).length_squared();
            total += width_of_line;
        }
        squares / total
    }

    /// The direction of least discrepancy of a block with a width and a height, as the display shows its light.
    pub fn least_discrepancy(&self, shown: impl Fn(Vec3) -> Vec3) -> u8 {
        let mut as_shown = Self { values: self.values, ..*self };
        as_shown.values.iter_mut().for_each(|value| *value = shown(*value));
        let of = |index: u32| as_shown.discrepancy(unit_vector(index as u8));
        let best = (0..DIRECTIONS).map(|index| (of(index), index)).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(0, |(_, index)| index as u8)
    }
}

/// The unit vector of a direction's number.
pub(crate) fn unit_vector(index: u8) -> Vec2 {
    // To the last digit along the axes: a scanline along a side must not leave it.
    match u32::from(index) {
        0 => Vec2::X,
        index if 2 * index == DIRECTIONS => Vec2::Y,
        index => Vec2::from_angle(index as f32 * PI / DIRECTIONS as f32),
    }
}

fn fill_between(values: &mut [Vec3], first: usize, last: usize) {
    let (from, to, steps) = (values[first], values[last], (last - first) as f32);
    for (step, value) in (1..).zip(&mut values[first + 1..last.max(first + 1)]) {
        *value = from.lerp(to, step as f32 / steps);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work_image::WorkPixel;

    /// A block in an image whose boundary is evaluated, all or the corners alone.
    fn block_of(high: [u32; 2], all: bool, light: impl Fn(f32, f32) -> f32) -> (Block, Boundary) {
        let block = Block { low: [3, 2], high: [3 + high[0], 2 + high[1]] };
        let mut image = WorkImage::new(20, 20);
        let around = (0..block.perimeter()).map(|step| block.on_boundary(step));
        for [x, y] in around.filter(|pixel| all || block.corners().contains(pixel)) {
            let radiance = Vec3::splat(light((x - 3) as f32, (y - 2) as f32));
            image.insert([x, y], WorkPixel { radiance, shown: radiance.x, object: 1 });
        }
        let boundary = Boundary::of(&block, &image);
        (block, boundary)
    }

    #[test]
    fn a_plane_is_kept_along_every_direction_in_blocks_of_any_shape() {
        let plane = |x: f32, y: f32| 0.3 + 0.02 * x - 0.01 * y;
        for high in [[8, 8], [4, 4], [7, 3], [1, 8], [2, 2]] {
            for all in [true, false] {
                let (_, boundary) = block_of(high, all, plane);
                assert_eq!(boundary.is_refined, all && high != [1, 1]);
                for (x, y) in (1..high[0]).flat_map(|x| (1..high[1]).map(move |y| (x as f32, y as f32))) {
                    assert!((boundary.blended(Vec2::new(x, y)).x - plane(x, y)).abs() < 1e-6);
                    for direction in 0..DIRECTIONS as u8 {
                        let along = boundary.along(unit_vector(direction), Vec2::new(x, y)).x;
                        assert!((along - plane(x, y)).abs() < 1e-6, "{high:?} {direction} ({x}, {y})");
                    }
                }
            }
        }
    }

    #[test]
    fn the_direction_of_an_edge_is_that_of_least_discrepancy() {
        for index in 0..DIRECTIONS as u8 {
            let normal = unit_vector(index).perp();
            let edge = |x: f32, y: f32| ((Vec2::new(x, y) - 4.1).dot(normal) / 2.0 + 0.5).clamp(0.0, 1.0);
            let (_, boundary) = block_of([8, 8], true, edge);
            assert_eq!(boundary.least_discrepancy(|light| light), index);
            for (x, y) in (1..8).flat_map(|x| (1..8).map(move |y| (x as f32, y as f32))) {
                let off = boundary.along(unit_vector(index), Vec2::new(x, y)).x - edge(x, y);
                assert!(off.abs() < 0.15, "{index} ({x}, {y}): {off}");
            }
        }
    }
}
