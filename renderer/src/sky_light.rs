//! Light straight from a scene's environment: samples of the irradiance that it gives a point.
//!
//! A sky is sampled in two ways: by a direction drawn by its light, and by the direction that a path follows anyway, spread by
//! the cosine. The first knows a small bright sky, the second a small window. They are combined by the balance heuristic of
//! Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, section 4.1: for one
//! sample each, both add L·cos θ/(p + cos θ/π), p the first one's density. The sun of a sky by the standard is so small that no
//! direction followed need look for it: it has a sample of its own, and counts in no other.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use scene::{Environment, Rgb, SUN_RADIUS};

use crate::{
    sky_table::SkyTable,
    surface::{Receiver, Surfaces},
};

/// An environment that is not black, ready to be sampled.
pub(crate) struct SkyLight<'a> {
    environment: &'a Environment,
    table: SkyTable,
    sun: Option<Sun>,
}

/// A disc of even radiance, far away.
struct Sun {
    direction: DVec3,
    /// Unit vectors across.
    across: [DVec3; 2],
    /// On a surface that faces it, W·m⁻².
    irradiance: Rgb,
}

impl<'a> SkyLight<'a> {
    /// The light of a valid environment; none if it is black.
    pub fn new(environment: &'a Environment) -> Option<Self> {
        let table = SkyTable::new(environment)?;
        let sun = environment.sun().map(|(direction, irradiance)| {
            let (x, y) = direction.any_orthonormal_pair();
            Sun { direction, across: [x, y], irradiance }
        });
        Some(Self { environment, table, sun })
    }

    /// The first sample of direct irradiance at a receiver, W·m⁻², from two uniform numbers in 0..1: a direction of the sky
    /// drawn by its light, and one of the sun.
    pub fn irradiance(&self, surfaces: &Surfaces<'_>, receiver: &Receiver, numbers: [f64; 2]) -> Rgb {
        let (u, v) = self.table.draw(numbers);
        let direction = self.environment.direction(u, v);
        let unless_blocked = |light: Rgb, direction: DVec3| {
            let arrives = light != Rgb::ZERO && surfaces.sees_sky(receiver, direction);
            if arrives { light } else { Rgb::ZERO }
        };
        let sky = unless_blocked(self.along(receiver, direction), direction);
        let Some(sun) = &self.sun else { return sky };
        let direction = sun.draw(numbers);
        let light = sun.irradiance * (receiver.cosine_to(direction) / direction.dot(sun.direction));
        sky + unless_blocked(light, direction)
    }

    /// What either sample of the sky adds to irradiance, W·m⁻², if it has drawn a unit direction that nothing blocks: the
    /// second one's density is the cosine over π.
    pub fn along(&self, receiver: &Receiver, direction: DVec3) -> Rgb {
        let cosine = receiver.cosine_to(direction);
        if cosine <= 0.0 {
            return Rgb::ZERO;
        }
        let (u, v) = self.environment.place(direction);
        self.environment.radiance_at(u, v) * (cosine / (self.table.density((u, v)) + cosine / PI))
    }
}

impl Sun {
    /// A unit direction to the disc: even over the disc as a flat one, so its density is its cosine to the middle over π·sin²
    /// of the radius, and its light is the same at every place of it.
    fn draw(&self, [u, v]: [f64; 2]) -> DVec3 {
        let radius = u.sqrt() * SUN_RADIUS.sin();
        let (sin, cos) = (TAU * v).sin_cos();
        let [x, y] = self.across;
        (x * cos + y * sin) * radius + self.direction * (1.0 - radius * radius).sqrt()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use glam::Vec3;
    use scene::{Bvh, CIE_SKIES, CieSky, LatLongMap, Scene, Sky, UpAxis};

    use super::*;
    use crate::path_trace::{
        Estimate, PathOptions, irradiance,
        test_scenes::{assert_estimates, black, grey, room, scene_of},
    };

    fn trace(scene: &Scene, points: &[(DVec3, DVec3)], samples: u32, bounces: Option<u32>) -> Vec<Estimate> {
        irradiance(scene, &Bvh::of_scene(scene), points, &PathOptions { samples, bounces, seed: 1 })
    }

    fn under(environment: &Environment, mut scene: Scene) -> Scene {
        scene.environment = Some(environment.clone());
        assert_eq!(scene.validate(), Ok(()));
        scene
    }

    fn map(width: u32, height: u32, texels: Vec<Vec3>) -> Environment {
        let sky = Sky::Map(LatLongMap { width, height, texels });
        Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 }
    }

    /// A sky of radiance L in all directions.
    fn uniform(radiance: f32) -> Environment {
        map(1, 1, vec![Vec3::splat(radiance)])
    }

    fn cie(kind: u8, sun: [f64; 2], irradiance: f64) -> Environment {
        let sky = Sky::Cie(CieSky::new(kind, sun, irradiance).unwrap());
        Environment { sky, up: UpAxis::Z, rotation: 0.0, scale: 1.0 }
    }

    fn square(half: f64, z: f64) -> Vec<DVec3> {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| DVec3::new(x * half, y * half, z)).to_vec()
    }

    /// No light comes from a black sky, from below a receiver, or to one that looks nowhere.
    #[test]
    fn without_light_there_is_none() {
        let floor = || scene_of(&[(square(1.0, 0.0), grey(0.5, 0.0))]);
        let points = [(DVec3::ZERO, DVec3::Z), (DVec3::Z, DVec3::ZERO)];
        for environment in [uniform(0.0), Environment { scale: 0.0, ..cie(12, [1.0, 0.5], 100.0) }] {
            assert_eq!(trace(&under(&environment, floor()), &points, 32, None), vec![Estimate::default(); 2]);
        }
        let lit = under(&uniform(1.0), floor());
        assert_eq!(trace(&lit, &[(DVec3::Z, DVec3::ZERO)], 32, None), vec![Estimate::default()]);
        let down = under(&cie(12, [1.0, 0.5], 100.0), Scene::default());
        assert_eq!(trace(&down, &[(DVec3::Z, -DVec3::Z)], 256, None), vec![Estimate::default()]);
    }

    /// π·L on every plane, and on every side of a convex body, however white, with anything or nothing around.
    #[test]
    fn an_even_sky_lights_all_that_is_convex_alike() {
        let body = room(DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5)).into_iter().map(|mut face| {
            face.reverse();
            (face, grey(1.0, 0.0))
        });
        let body = under(&uniform(3.0), scene_of(&body.collect::<Vec<_>>()));
        let points: Vec<_> = crate::spread_by_area(&body, 24, 1e-6, 3, |_| true);
        let points: Vec<_> = points.iter().map(|point| (point.position, point.normal)).collect();
        for bounces in [Some(0), Some(2), None] {
            for estimate in trace(&body, &points, 1024, bounces) {
                assert_estimates(estimate, 3.0 * PI, 1e-2);
            }
        }
        let nothing = under(&uniform(3.0), Scene::default());
        assert_estimates(trace(&nothing, &[(DVec3::ONE, DVec3::Y)], 1024, Some(0))[0], 3.0 * PI, 1e-2);
    }

    /// Irradiance ∫ L sin γ dω over the upper half of the sky by the midpoint rule, and the sun's own part E sin γ.
    #[test]
    fn skies_of_the_standard_light_the_ground_as_quadrature_says() {
        for kind in 1..=CIE_SKIES {
            let environment = cie(kind, [2.0, 0.7], 5.0);
            let Sky::Cie(sky) = &environment.sky else { unreachable!("it is by the standard") };
            let (bands, columns) = (1000, 360);
            let mut expected = 5.0 * 0.7f64.sin();
            for band in 0..bands {
                let altitude = (f64::from(band) + 0.5) / f64::from(bands) * PI / 2.0;
                let azimuth = |i: i32| f64::from(i) * TAU / f64::from(columns);
                let sum: f64 = (0..columns).map(|i| sky.relative_radiance(azimuth(i), altitude)).sum();
                expected += sum / f64::from(columns) * altitude.sin() * altitude.cos() * PI * PI / f64::from(bands);
            }
            let ground = under(&environment, scene_of(&[(square(1.0, 0.0), black())]));
            assert_estimates(trace(&ground, &[(DVec3::ZERO, DVec3::Z)], 1 << 15, Some(0))[0], expected, 1e-3);
        }
    }

    /// In a dark room with a window in its ceiling a point on the floor has π·L times the window's form factor, and half of it
    /// is seen past a sheet whose back is down.
    #[test]
    fn a_window_lets_in_what_its_form_factor_says() {
        let mut faces = room(DVec3::new(-2.0, -2.0, 0.0), DVec3::new(2.0, 2.0, 3.0));
        faces.remove(1);
        let rim = |x: [f64; 2], y: [f64; 2]| -> Vec<DVec3> {
            [(x[0], y[0]), (x[0], y[1]), (x[1], y[1]), (x[1], y[0])].map(|(x, y)| DVec3::new(x, y, 3.0)).to_vec()
        };
        let (out, hole) = (2.0, 0.3);
        for (x, y) in [
            ([-out, -hole], [-out, out]),
            ([hole, out], [-out, out]),
            ([-hole, hole], [-out, -hole]),
            ([-hole, hole], [hole, out]),
        ] {
            faces.push(rim(x, y));
        }
        let (a, b) = (2.0 * hole / 3.0 / 2.0, 2.0 * hole / 3.0 / 2.0);
        let corner = a / a.hypot(1.0) * (b / a.hypot(1.0)).atan() + b / b.hypot(1.0) * (a / b.hypot(1.0)).atan();
        let whole = 4.0 * corner / TAU * PI * 2.0;
        // A sky of another kind below than above: what no window shows is drawn, too.
        let sky = map(4, 2, (0..8).map(|i| Vec3::splat(if i < 4 { 2.0 } else { 7.0 })).collect());
        let mut faces: Vec<_> = faces.into_iter().map(|face| (face, black())).collect();
        for (bounces, seen) in [(Some(0), 1.0), (None, 1.0), (None, 0.5)] {
            if seen < 1.0 {
                let back_down = [(0., -1.), (1., -1.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 2.0));
                faces.push((back_down.to_vec(), black()));
            }
            let estimate = trace(&under(&sky, scene_of(&faces)), &[(DVec3::ZERO, DVec3::Z)], 1 << 17, bounces)[0];
            assert_estimates(estimate, seen * whole, 0.03);
        }
    }

    /// A room that emits (1−ρ)·π·L under an open sky of L is a furnace: π·L arrives everywhere. So does it among perfect
    /// reflectors that emit nothing, whose light all comes in by the window, after as many bounces as it takes.
    #[test]
    fn the_furnace_with_an_open_window() {
        let mut faces = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 0.8));
        faces.remove(1);
        for reflectance in [0.0, 0.5, 0.9, 1.0] {
            let material = grey(reflectance, (1.0 - reflectance) * PI * 2.0);
            let scene: Vec<_> = faces.iter().map(|face| (face.clone(), material.clone())).collect();
            let scene = under(&uniform(2.0), scene_of(&scene));
            let points: Vec<_> = crate::spread_by_area(&scene, 10, 1e-6, 5, |_| true);
            let points: Vec<_> = points.iter().map(|point| (point.position, point.normal)).collect();
            for estimate in trace(&scene, &points, 8192, None) {
                assert_estimates(estimate, 2.0 * PI, 0.05);
            }
        }
    }

    /// Behind an edge the sun is seen as a disc cut by a straight line.
    #[test]
    fn the_sun_has_a_penumbra() {
        let environment = Environment { scale: 0.5, ..cie(12, [1.0, PI / 2.0], 1000.0) };
        let half = |x: f64| {
            vec![DVec3::new(x, -5., 1.), DVec3::new(x, 5., 1.), DVec3::new(10., 5., 1.), DVec3::new(10., -5., 1.)]
        };
        let light = |edge: Option<f64>| {
            let mut faces = vec![(square(1.0, 0.0), black())];
            faces.extend(edge.map(|edge| (half(edge), black())));
            let mut scene = under(&environment, scene_of(&faces));
            let with = trace(&scene, &[(DVec3::ZERO, DVec3::Z)], 1 << 14, Some(0))[0];
            // The same sky without its sun.
            scene.environment = Some(Environment { scale: 0.5, ..cie(12, [1.0, PI / 2.0], 0.0) });
            let without = trace(&scene, &[(DVec3::ZERO, DVec3::Z)], 1 << 14, Some(0))[0];
            Estimate { mean: with.mean - without.mean, variance: with.variance + without.variance }
        };
        assert_estimates(light(None), 500.0, 1e-3);
        for part in [-1.1, -0.9, -0.3, 0.0, 0.5, 1.1] {
            let edge = part * SUN_RADIUS.tan();
            let seen = if part.abs() < 1.0 {
                1.0 - (part.acos() - part * (1.0 - part * part).sqrt()) / PI
            } else {
                f64::from(part > 0.0)
            };
            let estimate = light(Some(edge));
            assert!(
                (estimate.mean.x - 500.0 * seen).abs() < 4.5 * estimate.standard_error().x + 0.01,
                "{part}: {estimate:?}"
            );
            assert!(estimate.standard_error().x < 2.0);
        }
    }

    /// One texel of a thousandth of the sky lights a plane by its direction, and no path has to find it.
    #[test]
    fn a_sun_in_a_map_is_found() {
        let (width, height, at) = (64, 32, 64 * 8 + 40);
        let mut texels = vec![Vec3::ZERO; 64 * 32];
        texels[at] = Vec3::new(900.0, 600.0, 0.0);
        let environment = Environment { rotation: 0.7, ..map(width, height, texels) };
        // ∫ ω dω over the texel, by the midpoint rule.
        let steps = 200;
        let mut flow = DVec3::ZERO;
        for i in 0..steps * steps {
            let place = |at: usize, i: i32, cells: u32| {
                (at as f64 + (f64::from(i) + 0.5) / f64::from(steps)) / f64::from(cells)
            };
            let (u, v) = (place(40, i % steps, width), place(8, i / steps, height));
            let area = TAU * PI / f64::from(width * height) / f64::from(steps * steps);
            flow += environment.direction(u, v) * (v * PI).sin() * area;
        }
        let scene = under(&environment, scene_of(&[(square(1.0, 0.0), grey(0.5, 0.0))]));
        for normal in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8)] {
            // So many that directions followed, which add a 700th, find it often.
            let estimate = trace(&scene, &[(DVec3::Z * 0.5, normal)], 1 << 17, Some(0))[0];
            assert_estimates(estimate, 900.0 * flow.dot(normal), 2e-3);
            assert!((estimate.mean.y / estimate.mean.x - 2.0 / 3.0).abs() < 1e-12 && estimate.mean.z == 0.0);
        }
    }

    #[test]
    fn the_same_bytes_at_any_number_of_threads() {
        let floor = scene_of(&[(square(1.0, 0.0), grey(0.5, 0.0)), (square(0.3, 1.0), grey(0.5, 1.0))]);
        let scene = under(&cie(7, [1.0, 0.4], 3.0), floor);
        let points: Vec<_> = (0..20).map(|i| (DVec3::X * (0.05 * f64::from(i) - 0.5), DVec3::Z)).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| trace(&scene, &points, 64, None))
        };
        assert_eq!(with(1), with(3));
    }
}
