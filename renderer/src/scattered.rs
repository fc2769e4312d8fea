//! Reconstruction from samples as scattered points (Painter & Sloan 1989, section 3.3.2): a surface over their Delaunay
//! triangulation, and what a filter makes of it.
//!
//! The triangulation grows with the samples. What we do differently: triangles that come and go are not added and subtracted,
//! as the library that keeps them does not tell; all are integrated when a picture is asked for.

use glam::{DVec2, DVec3, Vec3};
use scene::Display;

use crate::delaunay::{Delaunay, Mesh};
use crate::filter::{Filter, SummedFilter};
use crate::quadratic_patch::patches;
use crate::raster::{Piece, barycentrics, filtered};

/// A surface through samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// A plane over each triangle: without jumps.
    Planar,
    /// Six quadratics over each: without folds, but with overshoots where light jumps.
    Smooth,
}

/// A picture in the making, from scattered samples.
pub struct ScatteredFilm {
    size: [u32; 2],
    filter: SummedFilter,
    display: Option<Display>,
    samples: Delaunay,
}

impl ScatteredFilm {
    /// A black picture of so many pixels: of what a display shows, or of radiance.
    pub fn new(width: u32, height: u32, filter: Filter, display: Option<Display>) -> Self {
        Self { size: [width, height], filter: SummedFilter::new(filter), display, samples: Delaunay::default() }
    }

    /// Adds radiance at a point of the image plane, W·sr⁻¹·m⁻².
    pub fn add(&mut self, point: DVec2, radiance: Vec3) {
        let light = self.display.map_or(radiance, |display| display.light(radiance));
        self.samples.insert(point, light);
    }

    /// The picture of the samples so far, row by row: radiance, W·sr⁻¹·m⁻², or what a display shows, above 0. Beyond the
    /// samples light is as it is at their border; fewer than three are black.
    pub fn picture(&self, surface: Surface) -> Vec<Vec3> {
        let mesh = self.samples.mesh();
        match surface {
            Surface::Planar => filtered(self.size, &self.filter, &planes(&mesh)),
            Surface::Smooth => filtered(self.size, &self.filter, &patches(&mesh)),
        }
    }
}

/// A plane over a triangle.
struct Plane {
    corners: [DVec2; 3],
    values: [DVec3; 3],
}

impl Piece for Plane {
    fn corners(&self) -> [DVec2; 3] {
        self.corners
    }

    fn value(&self, point: DVec2) -> DVec3 {
        let [r, s, t] = barycentrics(self.corners, point);
        let [at_a, at_b, at_c] = self.values;
        at_a * r + at_b * s + at_c * t
    }
}

fn planes(mesh: &Mesh) -> Vec<Plane> {
    let plane = |(triangle, vertices): (usize, &[u32; 3])| Plane {
        corners: mesh.corners(triangle),
        values: vertices.map(|vertex| mesh.values[vertex as usize].as_dvec3()),
    };
    mesh.triangles.iter().enumerate().map(plane).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AdaptiveOptions, AdaptiveSampler, Evaluation, Film, Interval};
    use scene::{Exposure, ToneCurve};

    const SIZE: (u32, u32) = (40, 30);

    /// A disk on a slope.
    fn disk(point: DVec2) -> Evaluation {
        let inside = point.distance(DVec2::new(18.0, 14.0)) < 9.3;
        let radiance = Vec3::new(if inside { 0.5 } else { 0.1 + 0.005 * point.x as f32 }, 0.2, 0.0);
        Evaluation { radiance, object: 1, cost: 1 }
    }

    #[test]
    fn fewer_than_three_samples_are_black() {
        let mut film = ScatteredFilm::new(4, 3, Filter::Lanczos, None);
        film.add(DVec2::ONE, Vec3::ONE);
        film.add(DVec2::splat(2.0), Vec3::ONE);
        assert_eq!(film.picture(Surface::Planar), [Vec3::ZERO; 12]);
        assert_eq!(film.picture(Surface::Smooth), [Vec3::ZERO; 12]);
    }

    #[test]
    fn a_slope_is_a_slope_and_even_light_even() {
        for surface in [Surface::Planar, Surface::Smooth] {
            let mut film = ScatteredFilm::new(12, 9, Filter::Gaussian, None);
            for i in 0..400 {
                let point = DVec2::new(f64::from(i * 37 % 101) * 12.0 / 100.0, f64::from(i * 59 % 97) * 9.0 / 96.0);
                film.add(point, Vec3::new(point.x as f32, 3.0, 0.0));
            }
            for (number, pixel) in film.picture(surface).iter().enumerate() {
                let x = (number % 12) as f32 + 0.5;
                assert!((pixel.y - 3.0).abs() < 1e-5);
                let is_inside = (3.0..9.0).contains(&x) && (24..84).contains(&number);
                assert!(!is_inside || (pixel.x - x).abs() < 2e-3, "{x}: {}", pixel.x);
            }
        }
    }

    /// Cells of even light, planes and quadratics: as samples are added, all three come to the same picture.
    #[test]
    fn all_surfaces_converge_to_the_same_picture() {
        let display = Display::new(Exposure { ev: 0.5 }, ToneCurve::Shoulder);
        let pictures = |interval: f64, filter: Filter| {
            let options =
                AdaptiveOptions { seed: 3, interval: Interval::Linear(interval), ..AdaptiveOptions::of(display) };
            let mut sampler = AdaptiveSampler::new(SIZE.0, SIZE.1, &options, &disk).expect("a picture");
            loop {
                let batch = sampler.next_batch(usize::MAX);
                if batch.is_empty() {
                    break;
                }
                sampler.take(&batch.into_iter().map(disk).collect::<Vec<_>>());
            }
            let mut cells = Film::new(SIZE.0, SIZE.1, filter, Some(display));
            cells.add(&sampler.tiles());
            let mut film = ScatteredFilm::new(SIZE.0, SIZE.1, filter, Some(display));
            sampler.points().for_each(|(point, radiance)| film.add(point, radiance));
            [cells.picture(), film.picture(Surface::Planar), film.picture(Surface::Smooth)]
        };
        let apart = |a: &[Vec3], b: &[Vec3]| {
            let squares: f32 = a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum();
            (squares / a.len() as f32).sqrt()
        };
        let farthest = |[cells, planes, smooth]: &[Vec<Vec3>; 3]| {
            apart(cells, planes).max(apart(cells, smooth)).max(apart(planes, smooth))
        };
        let [coarse, fine, finer] = [0.05, 0.01, 0.002].map(|interval| farthest(&pictures(interval, Filter::Box)));
        assert!(fine < 0.6 * coarse && finer < 0.6 * fine, "{coarse} {fine} {finer}");
        let lanczos = farthest(&pictures(0.002, Filter::Lanczos));
        assert!(lanczos < 2e-3, "{lanczos}");
    }
}
