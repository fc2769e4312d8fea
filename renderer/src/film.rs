//! Reconstruction from cells of even light (Painter & Sloan 1989, sections 3.3.1 and 3.3.3): what a filter around the centre of
//! each pixel makes of them, by equation 3.1.
//!
//! A film is a running sum. Cells are added to it all at once, or as they change: the sums are the same, to the rounding of f64.
//!
//! What we do differently: of a picture for a display, the light that the display shows of each cell is filtered, not the cell's
//! radiance. A lamp is hundreds of times brighter than what is beside it; by its radiance its edge would be as jagged as without a
//! filter, and have a black rim where the filter is negative.

use std::ops::Range;

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use scene::{Display, Rgb};

use crate::filter::{Filter, SummedFilter};

/// A rectangle of the image plane with the same radiance all over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Upper left and lower right corner, pixels.
    pub bounds: [DVec2; 2],
    /// W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// What it had before, if it is a part of a tile that was added already: none where nothing was.
    pub before: Vec3,
}

/// Rows of a band, which one thread adds to at a time. Fewer are shared more evenly, and tiles lie in more of them.
const BAND: usize = 32;

/// Red, green, blue, and a fourth number that makes two such pairs as processors like them.
type Sum = [f64; 4];

/// A picture in the making.
///
/// What a filter makes of tiles that are whole pixels is a sum over neighbours with always the same weights. So these tiles are
/// kept as pixels, and filtered when the picture is asked for; smaller ones are filtered one by one when they are added.
pub struct Film {
    width: usize,
    height: usize,
    filter: SummedFilter,
    /// If the picture is one of what a display shows.
    display: Option<Display>,
    /// Tiles of whole pixels, row by row.
    pixels: Vec<Sum>,
    /// Filtered tiles.
    filtered: Vec<Sum>,
    /// What the filters of the pixels about a pixel make of it, from the farthest one before it on.
    pixel: Vec<f64>,
    /// By column and by row, the part of the filter that lies within the picture.
    inside: [Vec<f64>; 2],
}

impl Film {
    /// A black picture of so many pixels: of what a display shows, or of radiance.
    pub fn new(width: u32, height: u32, filter: Filter, display: Option<Display>) -> Self {
        let filter = SummedFilter::new(filter);
        let inside = [width, height].map(|pixels| {
            let share = |i: u32| {
                let centre = f64::from(i) + 0.5;
                filter.left_of(f64::from(pixels) - centre) - filter.left_of(-centre)
            };
            (0..pixels).map(share).collect()
        });
        let reach = (filter.radius - 0.5).ceil() as i32;
        let weight = |i: i32| filter.left_of(0.5 - f64::from(i)) - filter.left_of(-0.5 - f64::from(i));
        let pixel = (-reach..=reach).map(weight).collect();
        let (width, height) = (width as usize, height as usize);
        let black = vec![[0.0; 4]; width * height];
        Self { width, height, filter, display, pixels: black.clone(), filtered: black, pixel, inside }
    }

    /// Adds tiles, on all of rayon's threads. A pixel sums them in their order, whatever the number of threads.
    pub fn add(&mut self, tiles: &[Tile]) {
        let (filter, size, display) = (&self.filter, [self.width, self.height], self.display);
        let mut of_band: Vec<Vec<u32>> = vec![Vec::new(); self.height.div_ceil(BAND)];
        for (number, tile) in (0..).zip(tiles) {
            let reached = reached(filter.radius, self.height, tile.bounds[0].y, tile.bounds[1].y);
            let bands = &mut of_band[reached.start / BAND..reached.end.div_ceil(BAND)];
            bands.iter_mut().for_each(|band| band.push(number));
        }
        let pixels = (BAND * self.width).max(1);
        let bands = self.pixels.par_chunks_mut(pixels).zip(self.filtered.par_chunks_mut(pixels)).enumerate();
        bands.zip(&of_band).for_each(|((number, (pixels, filtered)), of_band)| {
            let mut band = Band { first_row: number * BAND, pixels, filtered };
            let (mut across, mut down) = (Weights::default(), Weights::default());
            for &tile in of_band {
                let tile = &tiles[tile as usize];
                let [low, high] = tile.bounds;
                let is_whole = [low, high].iter().all(|corner| corner.x.fract() == 0.0 && corner.y.fract() == 0.0);
                let filter = (!is_whole).then_some(filter);
                across.set(filter, size[0], low.x, high.x);
                down.set(filter, size[1], low.y, high.y);
                let light = |radiance| display.map_or(radiance, |display| display.light(radiance)).as_dvec3();
                band.add(light(tile.radiance) - light(tile.before), is_whole, size[0], [&across, &down]);
            }
        });
    }

    /// The picture of what was added so far, row by row: radiance, W·sr⁻¹·m⁻², or what a display shows. Tiles are to fill the
    /// picture; where the filter ends beyond it, what lies within counts for the whole. Where a filter overshoots to less than
    /// nothing, there is nothing.
    pub fn picture(&self) -> Vec<Vec3> {
        let (width, reach) = (self.width, self.pixel.len() / 2);
        // Across, then down: a pixel's weight is the product of both.
        let mut across = vec![[0.0; 4]; self.pixels.len()];
        across.par_chunks_mut(width.max(1)).zip(self.pixels.par_chunks(width.max(1))).for_each(|(sums, pixels)| {
            for (weight, shift) in self.pixel.iter().zip(-(reach as isize)..) {
                let (from, to) = (shift.min(0).unsigned_abs(), shift.max(0).unsigned_abs());
                let length = width.saturating_sub(from.max(to));
                add_row(&mut sums[to..to + length], &pixels[from..from + length], *weight);
            }
        });
        let [inside_columns, inside_rows] = &self.inside;
        let row = |(row, filtered): (usize, &[Sum])| {
            let mut sums = filtered.to_vec();
            for (weight, other) in self.pixel.iter().zip(row as isize - reach as isize..) {
                if let Some(other) = usize::try_from(other).ok().filter(|other| *other < self.height) {
                    add_row(&mut sums, &across[other * width..(other + 1) * width], *weight);
                }
            }
            let pixel = |(&[red, green, blue, _], inside): (&Sum, &f64)| {
                (Rgb::new(red, green, blue) / (inside * inside_rows[row])).max(Rgb::ZERO).as_vec3()
            };
            sums.iter().zip(inside_columns).map(pixel).collect::<Vec<Vec3>>()
        };
        self.filtered.par_chunks(width.max(1)).enumerate().flat_map_iter(row).collect()
    }
}

/// Some rows of a film.
struct Band<'a> {
    first_row: usize,
    pixels: &'a mut [Sum],
    filtered: &'a mut [Sum],
}

impl Band<'_> {
    /// Adds light to the rows of a band, `width` pixels each, with the product of two weights.
    fn add(&mut self, light: Rgb, is_whole: bool, width: usize, [across, down]: [&Weights; 2]) {
        let sums = if is_whole { &mut *self.pixels } else { &mut *self.filtered };
        let rows = self.first_row..self.first_row + sums.len() / width;
        for row in down.first.max(rows.start)..(down.first + down.weights.len()).min(rows.end) {
            let Rgb { x, y, z } = light * down.weights[row - down.first];
            let start = width * (row - rows.start) + across.first;
            let sums = &mut sums[start..start + across.weights.len()];
            sums.iter_mut().zip(&across.weights).for_each(|(sum, weight)| add(sum, &[x, y, z, 0.0], *weight));
        }
    }
}

fn add(sum: &mut Sum, value: &Sum, weight: f64) {
    for channel in 0..4 {
        sum[channel] += weight * value[channel];
    }
}

fn add_row(sums: &mut [Sum], values: &[Sum], weight: f64) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| add(sum, value, weight));
}

/// The pixels along an axis whose filter meets a stretch.
fn reached(radius: f64, pixels: usize, from: f64, to: f64) -> Range<usize> {
    // Rounded up; `f64::ceil` is a call where a processor of any age must do.
    let up = |x: f64| x as usize + usize::from(x > x as usize as f64);
    up(from - radius - 0.5).min(pixels)..up(to + radius - 0.5).min(pixels)
}

/// What pixels along an axis have of a stretch.
#[derive(Default)]
struct Weights {
    /// From where to where, pixels, if by filters. Tiles that follow each other often have it in common.
    stretch: Option<[f64; 2]>,
    first: usize,
    weights: Vec<f64>,
    spare: Vec<f64>,
}

impl Weights {
    /// Of filters; without one, of the pixels themselves, where the stretch is some of them.
    fn set(&mut self, filter: Option<&SummedFilter>, pixels: usize, from: f64, to: f64) {
        let Some(filter) = filter else {
            let within = |end: f64| (end.max(0.0) as usize).min(pixels);
            self.stretch = None;
            self.first = within(from);
            self.weights.clear();
            return self.weights.resize(within(to) - self.first, 1.0);
        };
        if self.stretch.replace([from, to]) == Some([from, to]) {
            return;
        }
        let reached = reached(filter.radius, pixels, from, to);
        self.first = reached.start;
        self.weights.resize(reached.len(), 0.0);
        self.spare.resize(reached.len(), 0.0);
        let centre = self.first as f64 + 0.5;
        filter.left_of_row(to - centre, &mut self.weights);
        filter.left_of_row(from - centre, &mut self.spare);
        self.weights.iter_mut().zip(&self.spare).for_each(|(weight, before)| *weight -= before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Exposure, ToneCurve};

    const ALL: [Filter; 5] = [Filter::Lanczos, Filter::Box, Filter::Triangle, Filter::Gaussian, Filter::Mitchell];

    fn tile(low: (f64, f64), high: (f64, f64), radiance: f64) -> Tile {
        let radiance = Vec3::new(radiance as f32, 2.0 * radiance as f32, 0.0);
        Tile { bounds: [low.into(), high.into()], radiance, before: Vec3::ZERO }
    }

    /// Tiles of a grid over 20 × 13 pixels.
    fn grid(columns: u32, rows: u32, radiance: impl Fn(f64, f64) -> f64) -> Vec<Tile> {
        let corner = |i: u32, j: u32| (20.0 * f64::from(i) / f64::from(columns), 13.0 * f64::from(j) / f64::from(rows));
        let place = |i: u32| (i % columns, i / columns);
        let tile = |(i, j): (u32, u32)| {
            let (low, high) = (corner(i, j), corner(i + 1, j + 1));
            tile(low, high, radiance((low.0 + high.0) / 2.0, (low.1 + high.1) / 2.0))
        };
        (0..columns * rows).map(|i| tile(place(i))).collect()
    }

    #[test]
    fn no_pixels_and_no_tiles_give_no_light() {
        for (width, height) in [(0, 0), (0, 5), (5, 0)] {
            let mut film = Film::new(width, height, Filter::Lanczos, None);
            film.add(&[tile((0.0, 0.0), (5.0, 5.0), 1.0)]);
            assert!(film.picture().is_empty());
        }
        assert_eq!(Film::new(2, 1, Filter::Box, None).picture(), [Vec3::ZERO; 2]);
    }

    #[test]
    fn even_light_stays_even_up_to_the_border() {
        for filter in ALL {
            for (columns, rows) in [(1, 1), (20, 13), (7, 40)] {
                let mut film = Film::new(20, 13, filter, None);
                film.add(&grid(columns, rows, |_, _| 3.0));
                for pixel in film.picture() {
                    assert!((pixel - Vec3::new(3.0, 6.0, 0.0)).length() < 1e-5, "{filter:?}: {pixel}");
                }
            }
        }
    }

    #[test]
    fn the_box_is_the_mean_of_the_pixel() {
        let mut film = Film::new(2, 1, Filter::Box, None);
        film.add(&[
            tile((0.0, 0.0), (0.75, 1.0), 1.0),
            tile((0.75, 0.0), (2.0, 0.5), 5.0),
            tile((0.75, 0.5), (2.0, 1.0), 9.0),
        ]);
        let picture = film.picture();
        assert!((picture[0].x - (0.75 + 0.25 * 7.0)).abs() < 1e-6 && (picture[1].x - 7.0).abs() < 1e-6);
    }

    /// A change of one tile, however deep its parts, comes to the same as adding everything anew.
    #[test]
    fn what_is_added_by_parts_is_the_same() {
        let wave = |x: f64, y: f64| 1.0 + (x * 0.7).sin() * (y * 0.9).cos();
        for filter in ALL {
            let (mut whole, mut by_parts) = (Film::new(20, 13, filter, None), Film::new(20, 13, filter, None));
            whole.add(&grid(40, 26, wave));
            by_parts.add(&grid(1, 1, |_, _| 1000.0));
            let change = |tile: &Tile| Tile { before: Vec3::new(1000.0, 2000.0, 0.0), ..*tile };
            let changes: Vec<Tile> = grid(40, 26, wave).iter().map(change).collect();
            changes.chunks(7).for_each(|some| by_parts.add(some));
            for (a, b) in whole.picture().into_iter().zip(by_parts.picture()) {
                assert!((a - b).abs().max_element() < 1e-6, "{filter:?}: {a} {b}");
            }
        }
    }

    /// A lamp's edge in the middle of a pixel is half as bright as white, and has no black rim.
    #[test]
    fn what_a_display_shows_is_filtered_as_it_shows_it() {
        let display = Display::new(Exposure { ev: 1.0 }, ToneCurve::Shoulder);
        let lamp = |filter: Filter, display: Option<Display>| {
            let mut film = Film::new(20, 13, filter, display);
            film.add(&[tile((0.0, 0.0), (10.5, 13.0), 0.1), tile((10.5, 0.0), (20.0, 13.0), 1e4)]);
            film.picture()[6 * 20 + 8..6 * 20 + 14].iter().map(|pixel| pixel.x).collect::<Vec<f32>>()
        };
        let on_display = lamp(Filter::Box, Some(display));
        assert!((on_display[1] - 0.2).abs() < 1e-6 && (on_display[2] - 0.6).abs() < 1e-6 && on_display[3] > 0.999);
        assert!(lamp(Filter::Lanczos, Some(display)).iter().all(|&light| light > 0.1));
        assert!(lamp(Filter::Lanczos, None).contains(&0.0), "by radiance it has the rim");
    }

    /// All filters keep a slope; the further they reach, the less of the picture is free of the border.
    #[test]
    fn a_slope_is_kept_away_from_the_border() {
        for filter in ALL {
            let mut film = Film::new(20, 13, filter, None);
            film.add(&grid(400, 13, |x, _| x));
            let picture = film.picture();
            for x in 4..16 {
                assert!((f64::from(picture[6 * 20 + x].x) - (x as f64 + 0.5)).abs() < 1e-2, "{filter:?} at {x}");
            }
        }
    }
}
