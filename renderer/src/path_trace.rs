//! Irradiance by path tracing (Kajiya, "The Rendering Equation", SIGGRAPH 1986), as unbiased as f64 allows.
//!
//! E(x) = E_direct(x) + mean of ρ(y)·E(y) over the points y seen from x in directions spread by their cosine. The
//! first term is estimated by sampling emitters, the second by following one such direction, at every bounce; so
//! emission is never counted where a path happens to hit an emitter. Light of the scene's environment is estimated by both
//! ([`crate::sky_light`]), so with an environment one direction is followed for direct light, too.
//!
//! At x, the point looked at, the cosine is to the shading normal of its polygon, if that has one, and nothing arrives from below
//! the polygon's plane ([`Scene::shading_normal`]); at every y it is to the polygon's own normal.
//!
//! Samples come in independent batches. Within a batch the first directions and the first emitter samples are spread
//! evenly; between batches nothing is shared, so their scatter measures the variance without any assumption on it.

use glam::DVec3;
use rayon::prelude::*;
use scene::{Bvh, Rgb, Scene};

use crate::{
    emitters::{Emitters, SeenEmitters},
    sequence::{Kronecker, Stream, scatter},
    sky_light::SkyLight,
    surface::{Receiver, Seen, SurfacePoint, Surfaces},
};

/// Independent batches that the samples of a point are dealt into. More measure the variance better (this many to
/// within an eighth of the standard error), fewer let each batch be spread more evenly.
const BATCHES: u32 = 32;

/// Largest probability with which a path goes on. Less than 1 ends paths among perfect reflectors, too.
const LARGEST_SURVIVAL: f64 = 0.99;

/// What a path-traced estimate is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathOptions {
    /// Paths per point, rounded up to a multiple of 32 (and at least 32).
    pub samples: u32,
    /// Interreflections followed; 0 is direct light alone, none is all of them (by unbiased Russian roulette).
    pub bounces: Option<u32>,
    /// Estimates with different seeds are independent; the same seed gives the same bytes.
    pub seed: u64,
}

/// An estimate of irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean, W·m⁻².
    pub mean: Rgb,
    /// Variance of the mean, (W·m⁻²)², itself measured from 32 batches: (mean − truth)/√variance is distributed as
    /// Student's t with 31 degrees of freedom where samples are many.
    pub variance: Rgb,
}

impl Estimate {
    /// Standard error of the mean, W·m⁻².
    pub fn standard_error(&self) -> Rgb {
        Rgb::from_array(self.variance.to_array().map(f64::sqrt))
    }
}

/// Irradiance at points given by position (metres) and front normal, W·m⁻²; by the shading normal of the polygon there, if any.
///
/// A point within 1e-6 of the scene's size of a polygon whose front agrees with the normal is on that polygon; any
/// other is in empty space. `bvh` is [`Bvh::of_scene`] of the same scene, which is valid ([`Scene::validate`]). The
/// result does not depend on the number of threads. A point that is not finite gets an estimate that is not a number.
pub fn irradiance(scene: &Scene, bvh: &Bvh, points: &[(DVec3, DVec3)], options: &PathOptions) -> Vec<Estimate> {
    let tracer = PathTracer::new(scene, bvh);
    let estimate = |(index, &(position, normal)): (usize, &(DVec3, DVec3))| {
        if !position.is_finite() || !normal.is_finite() {
            return Estimate { mean: Rgb::NAN, variance: Rgb::NAN };
        }
        let receiver = tracer.surfaces.receiver_at(position, normal);
        tracer.irradiance(&receiver, options, index as u64)
    };
    points.par_iter().enumerate().map(estimate).collect()
}

/// Irradiance at points of surfaces, by their shading normals if any, W·m⁻², each by as many paths as `samples` has for it,
/// rounded up to a multiple of 32.
///
/// `bounces` and `seed` are those of [`PathOptions`]; `done` is called after every point, from any thread. `bvh` is
/// [`Bvh::of_scene`] of the same scene. The result does not depend on the number of threads.
pub fn irradiance_on(
    scene: &Scene,
    bvh: &Bvh,
    points: &[SurfacePoint],
    samples: &[u32],
    (bounces, seed): (Option<u32>, u64),
    done: &(dyn Fn() + Sync),
) -> Vec<Estimate> {
    let tracer = PathTracer::new(scene, bvh);
    let estimate = |(index, (&point, &samples)): (usize, (&SurfacePoint, &u32))| {
        let estimate = tracer.irradiance(
            &tracer.surfaces.looked_at(&point),
            &PathOptions { samples, bounces, seed },
            index as u64,
        );
        done();
        estimate
    };
    points.par_iter().zip(samples).enumerate().map(estimate).collect()
}

/// Irradiance by a few paths at a time, for pictures: an estimate that is right on average, and as noisy as its paths are few.
pub struct PathLight<'a> {
    tracer: PathTracer<'a>,
    options: PathOptions,
}

impl<'a> PathLight<'a> {
    /// Paths in a valid scene, as many a point as the options say, at least one; `bvh` is [`Bvh::of_scene`] of it.
    pub fn new(scene: &'a Scene, bvh: &'a Bvh, options: PathOptions) -> Self {
        Self { tracer: PathTracer::new(scene, bvh), options }
    }

    /// Irradiance at a point of a surface, by its shading normal if any, W·m⁻². The same point has the same paths.
    pub fn irradiance(&self, point: &SurfacePoint) -> Rgb {
        let PathOptions { samples, bounces, seed } = self.options;
        let number = point.position.to_array().into_iter().fold(0, |number, x| scatter(number, x.to_bits()));
        let receiver = self.tracer.surfaces.looked_at(point);
        let mut seen = [SeenEmitters::default(), SeenEmitters::default()];
        self.tracer.emitters.seen_from(&self.tracer.surfaces, &receiver, &mut seen[0]);
        self.tracer.batch(
            &receiver,
            (samples.max(1), bounces.unwrap_or(u32::MAX)),
            &mut seen,
            &mut Stream::new(seed, number),
        )
    }

    /// Paths a point.
    pub fn paths(&self) -> u32 {
        self.options.samples.max(1)
    }
}

/// A scene, ready for paths.
pub(crate) struct PathTracer<'a> {
    pub surfaces: Surfaces<'a>,
    emitters: Emitters,
    sky: Option<SkyLight<'a>>,
}

impl<'a> PathTracer<'a> {
    pub fn new(scene: &'a Scene, bvh: &'a Bvh) -> Self {
        let surfaces = Surfaces::new(scene, bvh);
        let emitters = Emitters::new(&surfaces);
        Self { surfaces, emitters, sky: scene.environment.as_ref().and_then(SkyLight::new) }
    }

    /// Irradiance at a receiver; `stream` names the random numbers that are used for it.
    pub fn irradiance(&self, receiver: &Receiver, options: &PathOptions, stream: u64) -> Estimate {
        let samples = options.samples.div_ceil(BATCHES).max(1);
        let bounces = options.bounces.unwrap_or(u32::MAX);
        let mut stream = Stream::new(options.seed, stream);
        let mut seen = [SeenEmitters::default(), SeenEmitters::default()];
        self.emitters.seen_from(&self.surfaces, receiver, &mut seen[0]);
        let batch = |_| self.batch(receiver, (samples, bounces), &mut seen, &mut stream);
        let batches: Vec<Rgb> = (0..BATCHES).map(batch).collect();
        let mean = batches.iter().sum::<Rgb>() / f64::from(BATCHES);
        let squares: Rgb = batches.iter().map(|batch| (batch - mean) * (batch - mean)).sum();
        Estimate { mean, variance: squares / f64::from(BATCHES * (BATCHES - 1)) }
    }

    /// The mean of some samples that are spread evenly among themselves. Of the emitters seen, the first are those from the
    /// receiver.
    fn batch(
        &self,
        receiver: &Receiver,
        (samples, bounces): (u32, u32),
        [here, there]: &mut [SeenEmitters; 2],
        stream: &mut Stream,
    ) -> Rgb {
        let mut on_emitters = Kronecker::<2>::shifted_by(stream);
        let mut first_bounce = Kronecker::<4>::shifted_by(stream);
        let mut on_sky = self.sky.as_ref().map(|sky| (sky, Kronecker::<2>::shifted_by(stream)));
        let mut sum = Rgb::ZERO;
        for _ in 0..samples {
            sum += self.emitters.irradiance(&self.surfaces, receiver, here, on_emitters.point());
            if let Some((sky, numbers)) = &mut on_sky {
                sum += sky.irradiance(&self.surfaces, receiver, numbers.point());
            }
            if bounces > 0 || on_sky.is_some() {
                sum += self.reflected(receiver, bounces, first_bounce.point(), there, stream);
            }
        }
        sum / f64::from(samples)
    }

    /// One sample of the irradiance that reaches a receiver by way of one to `bounces` reflections, W·m⁻², and what the
    /// directions followed say of direct light from the environment. The first bounce uses the four numbers given, in 0..1;
    /// later ones draw their own.
    fn reflected(
        &self,
        receiver: &Receiver,
        bounces: u32,
        first_bounce: [f64; 4],
        seen: &mut SeenEmitters,
        stream: &mut Stream,
    ) -> Rgb {
        let (mut irradiance, mut throughput) = (Rgb::ZERO, Rgb::ONE);
        let mut receiver = *receiver;
        let mut numbers = first_bounce;
        // After the last reflection one direction more is followed, which may meet the environment.
        let directions = bounces.saturating_add(self.sky.is_some().into());
        for followed in 0..directions {
            let [u, v, on_emitter @ ..] = numbers;
            let direction = cosine_direction(receiver.cosine, [u, v]);
            // About a shading normal some look below the surface: they count nothing.
            if receiver.cosine != receiver.normal && receiver.normal.dot(direction) <= 0.0 {
                break;
            }
            let point = match (self.surfaces.seen_from(&receiver, direction), &self.sky) {
                (Seen::Front(point), _) if followed < bounces => point,
                (Seen::Nothing, Some(sky)) => {
                    irradiance += throughput * sky.along(&receiver, direction);
                    break;
                }
                _ => break,
            };
            throughput *= self.surfaces.scene.reflectance(point.polygon);
            receiver = point.into();
            if throughput.max_element() <= 0.0 {
                break;
            }
            self.emitters.seen_from(&self.surfaces, &receiver, seen);
            irradiance += throughput * self.emitters.irradiance(&self.surfaces, &receiver, seen, on_emitter);
            if let Some(sky) = &self.sky {
                let on_sky = std::array::from_fn(|_| stream.uniform());
                irradiance += throughput * sky.irradiance(&self.surfaces, &receiver, on_sky);
            }
            let survival = throughput.max_element().min(LARGEST_SURVIVAL);
            if stream.uniform() >= survival {
                break;
            }
            throughput /= survival;
            numbers = std::array::from_fn(|_| stream.uniform());
        }
        irradiance
    }
}

/// A unit direction about a unit normal, its density the cosine to the normal over π.
fn cosine_direction(normal: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
    (x * cos + y * sin) * u.sqrt() + normal * (1.0 - u).sqrt()
}

#[cfg(test)]
pub(crate) mod test_scenes {
    //! Scenes in code, for the tests of this crate.

    use glam::DVec3;
    use scene::{Material, Polygon, Rgb, Scene};

    use super::Estimate;

    /// A scene of outlines, each with a material of its own; equal positions are welded.
    pub(crate) fn scene_of(faces: &[(Vec<DVec3>, Material)]) -> Scene {
        let mut scene = Scene { objects: vec!["all".into()], ..Scene::default() };
        for (outline, material) in faces {
            scene.polygons.push(Polygon {
                first_corner: scene.corners.len() as u32,
                corner_count: outline.len() as u32,
                material: scene.materials.len() as u32,
                object: 0,
            });
            scene.materials.push(material.clone());
            for corner in outline {
                let known = scene.vertices.iter().position(|vertex| vertex == corner);
                scene.corners.push(known.unwrap_or(scene.vertices.len()) as u32);
                if known.is_none() {
                    scene.vertices.push(*corner);
                }
            }
        }
        assert_eq!(scene.validate(), Ok(()));
        scene
    }

    /// A grey material of reflectance ρ and exitance M, W·m⁻².
    pub(crate) fn grey(reflectance: f64, exitance: f64) -> Material {
        let radiance = Rgb::splat(exitance / std::f64::consts::PI);
        Material { reflectance: Rgb::splat(reflectance), radiance, ..Material::grey("grey") }
    }

    /// A material that neither reflects nor emits.
    pub(crate) fn black() -> Material {
        grey(0.0, 0.0)
    }

    /// Checks an estimate against the truth: within 4.5 standard errors (about 1 in 10,000 for Student's t with 31
    /// degrees), and precise enough for that to mean something.
    pub(crate) fn assert_estimates(estimate: Estimate, truth: f64, precision: f64) {
        let (mean, error) = (estimate.mean.x, estimate.standard_error().x);
        assert!((mean - truth).abs() <= 4.5 * error + 1e-13 * truth, "{mean} ± {error} for {truth}");
        assert!(error <= precision * truth, "standard error {error} of {mean}");
    }

    /// The six faces of a box, their fronts to the inside.
    pub(crate) fn room(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
        let corner = |i: u32| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
        let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        faces.map(|face| face.map(corner).to_vec()).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use super::{
        test_scenes::{assert_estimates, black, grey, room, scene_of},
        *,
    };

    fn options(samples: u32, bounces: Option<u32>) -> PathOptions {
        PathOptions { samples, bounces, seed: 1 }
    }

    fn trace(scene: &Scene, points: &[(DVec3, DVec3)], options: &PathOptions) -> Vec<Estimate> {
        irradiance(scene, &Bvh::of_scene(scene), points, options)
    }

    /// A rectangle in the plane z = `z`, its front down.
    fn ceiling(x: [f64; 2], y: [f64; 2], z: f64) -> Vec<DVec3> {
        [(x[0], y[0]), (x[0], y[1]), (x[1], y[1]), (x[1], y[0])].map(|(x, y)| DVec3::new(x, y, z)).to_vec()
    }

    #[test]
    fn without_light_there_is_none() {
        let points = [(DVec3::new(0.5, 0.5, 0.0), DVec3::Z), (DVec3::ZERO, DVec3::ZERO)];
        assert_eq!(trace(&Scene::default(), &points, &options(1, None)), vec![Estimate::default(); 2]);
        let dark = scene_of(&[(ceiling([0., 1.], [0., 1.], 0.5), grey(1.0, 0.0))]);
        assert_eq!(trace(&dark, &points, &options(0, None)), vec![Estimate::default(); 2]);
        assert_eq!(trace(&dark, &[], &options(0, None)), vec![]);
    }

    /// A few paths at each of many points scatter about what many paths at one of them say.
    #[test]
    fn a_few_paths_are_right_on_average() {
        let mut faces: Vec<_> = room(DVec3::ZERO, DVec3::ONE).into_iter().map(|face| (face, grey(0.5, 0.0))).collect();
        faces[1].1 = grey(0.0, 4.0);
        let scene = scene_of(&faces);
        let bvh = Bvh::of_scene(&scene);
        let light = PathLight::new(&scene, &bvh, PathOptions { samples: 1, bounces: None, seed: 5 });
        let point = |i: i32| SurfacePoint {
            position: DVec3::new(0.4 + f64::from(i) * 1e-8, 0.5, 0.0),
            normal: DVec3::Z,
            polygon: 0,
        };
        assert_eq!(light.irradiance(&point(3)), light.irradiance(&point(3)));
        let few: Vec<f64> = (0..20_000).map(|i| light.irradiance(&point(i)).x).collect();
        let mean = few.iter().sum::<f64>() / few.len() as f64;
        let variance = few.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / few.len() as f64;
        let truth = trace(&scene, &[(point(0).position, DVec3::Z)], &options(1 << 16, None))[0];
        let error = (variance / few.len() as f64 + truth.variance.x).sqrt();
        assert!((mean - truth.mean.x).abs() < 4.5 * error && error < 0.01 * mean, "{mean} ± {error}: {truth:?}");
    }

    #[test]
    fn points_that_are_not_finite_get_no_number() {
        let scene = scene_of(&[(ceiling([0., 1.], [0., 1.], 0.5), grey(0.5, 1.0))]);
        let points = [(DVec3::NAN, DVec3::Z), (DVec3::INFINITY, DVec3::Z), (DVec3::ZERO, DVec3::NAN)];
        assert!(trace(&scene, &points, &options(64, None)).iter().all(|estimate| estimate.mean.is_nan()));
    }

    /// Element to a parallel rectangle with the normal through its corner, and to a perpendicular one.
    #[test]
    fn a_rectangle_gives_what_lambert_says() {
        let scene = scene_of(&[(ceiling([0., 2.], [0., 3.], 1.5), grey(0.0, 10.0))]);
        let term = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
        let (a, b) = (2.0 / 1.5, 3.0 / 1.5);
        let parallel = 10.0 * (term(a, b) + term(b, a)) / TAU;
        let point = (DVec3::ZERO, DVec3::Z);
        assert_estimates(trace(&scene, &[point], &options(4096, None))[0], parallel, 2e-3);
        // The same emitter stands upright on the plane of a receiver that looks along x.
        let (x, y): (f64, f64) = (3.0 / 1.5, 2.0 / 1.5);
        let upright = 10.0 * (x.atan() - (x / y.hypot(1.0)).atan() / y.hypot(1.0)) / TAU;
        assert_estimates(trace(&scene, &[(DVec3::ZERO, DVec3::X)], &options(4096, None))[0], upright, 4e-3);
        // The emitter's back is black, and so is the receiver's.
        let behind = [(DVec3::Z * 2.0, -DVec3::Z), (DVec3::ZERO, -DVec3::Z)];
        assert_eq!(trace(&scene, &behind, &options(256, None)), vec![Estimate::default(); 2]);
    }

    /// Emitters of different colours, sizes and distances, one of them partly behind another: what one gives must not
    /// depend on how often the other is chosen.
    #[test]
    fn emitters_add_up() {
        let corner = |width: f64, height: f64| width / width.hypot(1.0) * (height / width.hypot(1.0)).atan();
        let factor = |a: f64, b: f64| (corner(a, b) + corner(b, a)) / TAU;
        let coloured = |radiance| scene::Material { radiance, ..black() };
        let near = (ceiling([0., 0.1], [0., 0.1], 0.2), coloured(Rgb::X * 100.0));
        let far = (ceiling([-4., 0.], [0., 8.], 2.0), coloured(Rgb::Z * 0.5));
        let behind_near = (ceiling([0., 2.], [0., 2.], 2.0), coloured(Rgb::Y));
        let scene = scene_of(&[near, far, behind_near]);
        let estimate = trace(&scene, &[(DVec3::ZERO, DVec3::Z)], &options(1 << 16, None))[0];
        let truth =
            PI * Rgb::new(100.0 * factor(0.5, 0.5), factor(1.0, 1.0) - factor(0.5, 0.5), 0.5 * factor(2.0, 4.0));
        let score = (estimate.mean - truth) / estimate.standard_error();
        assert!(score.abs().max_element() < 4.5, "{} for {truth}: {score}", estimate.mean);
        assert!((estimate.standard_error() / truth).max_element() < 0.02);
    }

    /// Half of an emitter behind the horizon, and all points of the receiver down to the contact.
    #[test]
    fn at_a_contact_the_limit_is_half_the_exitance() {
        let wall: Vec<_> = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(y, z)| DVec3::new(0.0, y, z)).to_vec();
        let floor: Vec<_> = ceiling([0., 1.], [0., 1.], 0.0).into_iter().rev().collect();
        let scene = scene_of(&[(wall, grey(0.0, 8.0)), (floor, black())]);
        for distance in [1e-1, 1e-3, 1e-6, 1e-9] {
            let point = DVec3::new(distance, 0.4, 0.0);
            let estimate = trace(&scene, &[(point, DVec3::Z)], &options(8192, Some(0)))[0];
            // A wall of height 1 from y = 0 to 1: two rectangles that meet in front of the point.
            let element = |width: f64| {
                let (x, y) = (width / distance, 1.0 / distance);
                (x.atan() - (x / y.hypot(1.0)).atan() / y.hypot(1.0)) / TAU
            };
            assert_estimates(estimate, 8.0 * (element(0.4) + element(0.6)), 2e-3);
        }
    }

    #[test]
    fn a_blocker_takes_away_what_lambert_says_of_its_shadow() {
        // From the origin the blocker half-way up covers the quarter of the light where x and y are positive.
        let light = (ceiling([-1., 1.], [-1., 1.], 2.0), grey(0.0, 4.0));
        let blocker = (ceiling([0., 0.5], [0., 0.5], 1.0), black());
        let quarter = |extent: f64| 2.0 * extent / extent.hypot(1.0) * (extent / extent.hypot(1.0)).atan() / TAU;
        let scene = scene_of(&[light, blocker]);
        let estimate = trace(&scene, &[(DVec3::ZERO, DVec3::Z)], &options(16384, Some(0)))[0];
        assert_estimates(estimate, 4.0 * 3.0 * quarter(0.5), 2e-3);
    }

    /// A closed enclosure of uniform exitance M and reflectance ρ has B = M/(1−ρ) everywhere, and E = B; cut off
    /// after n bounces E = M (1 − ρ^(n+1))/(1 − ρ). Emitters reflect here, and every wall touches four others.
    #[test]
    fn the_furnace() {
        let walls = room(DVec3::new(-1.0, 0.2, 3.0), DVec3::new(1.5, 1.7, 4.0));
        for reflectance in [0.0, 0.3, 0.8] {
            let scene = scene_of(&walls.iter().map(|wall| (wall.clone(), grey(reflectance, 2.0))).collect::<Vec<_>>());
            let points = spread(&scene, 12);
            for bounces in [Some(0), Some(1), Some(4), None] {
                let series = bounces.map_or(0.0, |n| reflectance.powi(n as i32 + 1));
                for estimate in trace(&scene, &points, &options(2048, bounces)) {
                    assert_estimates(estimate, 2.0 * (1.0 - series) / (1.0 - reflectance), 0.05);
                }
            }
        }
    }

    fn spread(scene: &Scene, count: u32) -> Vec<(DVec3, DVec3)> {
        let points = crate::spread_by_area(scene, count, 1e-6, 5, |_| true);
        points.iter().map(|point| (point.position, point.normal)).collect()
    }

    #[test]
    fn a_closed_room_of_perfect_reflectors_comes_to_an_end() {
        let walls = room(DVec3::ZERO, DVec3::ONE);
        let scene = scene_of(&walls.iter().map(|wall| (wall.clone(), grey(1.0, 1.0))).collect::<Vec<_>>());
        let estimate = trace(&scene, &[(DVec3::new(0.5, 0.5, 0.0), DVec3::Z)], &options(32, None))[0];
        assert!(estimate.mean.is_finite() && estimate.mean.x > 10.0);
    }

    /// A box of polygons without thickness, seen from inside as black backs or as bright fronts, keeps all light out:
    /// exactly, down to points at the contact. It stands on the room's own floor, which runs on under it.
    #[test]
    fn no_light_leaks_into_a_closed_box() {
        let mut faces: Vec<_> = room(DVec3::ZERO, DVec3::splat(3.0)).into_iter().map(|f| (f, grey(0.7, 0.0))).collect();
        faces[1].1 = grey(0.0, 10.0);
        let walls = room(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0)).split_off(1);
        for wall in walls {
            faces.push((wall.iter().copied().rev().collect(), grey(0.7, 0.0)));
            faces.push((wall, grey(0.7, 0.0)));
        }
        let scene = scene_of(&faces);
        let inside = [(1.5, 1.5), (1.0 + 1e-9, 1.3), (1.0 + 1e-12, 1.0 + 1e-12), (2.0 - 1e-7, 1.5)];
        let points = inside.map(|(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z));
        for (point, estimate) in points.iter().zip(trace(&scene, &points, &options(4096, None))) {
            assert_eq!(estimate, Estimate::default(), "at {}", point.0);
        }
        // Outside, a lit floor up to the same contact.
        let outside = trace(&scene, &[(DVec3::new(1.0 - 1e-9, 1.3, 0.0), DVec3::Z)], &options(4096, None))[0];
        assert!(outside.mean.x > 1.0);
    }

    #[test]
    fn the_same_bytes_at_any_number_of_threads() {
        let walls = room(DVec3::ZERO, DVec3::ONE);
        let scene = scene_of(&walls.iter().map(|wall| (wall.clone(), grey(0.5, 1.0))).collect::<Vec<_>>());
        let points = spread(&scene, 40);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            pool.install(|| trace(&scene, &points, &options(100, None)))
        };
        let alone = with(1);
        assert_eq!(alone, with(5));
        assert_eq!(alone[7..8], trace(&scene, &points[..8], &options(100, None))[7..]);
    }

    #[test]
    fn directions_follow_the_cosine() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let mut sequence = Kronecker::<2>::shifted_by(&mut Stream::new(1, 1));
        let directions: Vec<_> = (0..4096).map(|_| cosine_direction(normal, sequence.point())).collect();
        assert!(directions.iter().all(|d| d.is_normalized() && d.dot(normal) >= 0.0));
        // The mean of a direction d under cos/π is ⅔ n, and the mean of its polar angle π/4.
        let mean = directions.iter().sum::<DVec3>() / 4096.0;
        assert!((mean - normal * 2.0 / 3.0).length() < 2e-3);
        let angle = directions.iter().map(|d| d.dot(normal).min(1.0).acos()).sum::<f64>() / 4096.0;
        assert!((angle - PI / 4.0).abs() < 2e-3 && angle < FRAC_PI_2);
    }
}
