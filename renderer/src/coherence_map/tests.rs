use std::cell::Cell;

use super::*;
use crate::confidence::Interval;
use crate::filter::Filter;
use crate::pixel_integral::PixelIntegral;
use crate::reduction::Reduction;
use crate::sequence::scatter;
use crate::test_pictures::{disk, display, holes};

fn usual(supersample: u32) -> CoherenceOptions {
    CoherenceOptions { supersample, exposure: Exposure { ev: 0.0 }, curve: Some(ToneCurve::Shoulder) }
}

/// Evaluates until nothing is left to do or so many pixels are.
fn refined(size: (u32, u32), supersample: u32, most: usize, evaluate: &dyn Fn(DVec2) -> Evaluation) -> CoherenceMap {
    let mut map = CoherenceMap::new(size.0, size.1, &usual(supersample), &[]).expect("the size is one");
    loop {
        let batch = map.next_batch(most - map.evaluated());
        if batch.is_empty() {
            return map;
        }
        let seen: Vec<Evaluation> = batch.into_iter().map(evaluate).collect();
        map.take(&seen);
    }
}

/// Every pixel of the work image.
fn full(size: (u32, u32), supersample: u32, evaluate: &dyn Fn(DVec2) -> Evaluation) -> Vec<Vec3> {
    let [width, height] = [size.0 * supersample, size.1 * supersample];
    let point = |i: u32| (DVec2::new((i % width).into(), (i / width).into()) + 0.5) / f64::from(supersample);
    (0..width * height).map(|i| evaluate(point(i)).radiance).collect()
}

/// Relative error by the paper's norms, L1 and L2.
fn errors(picture: &[Vec3], full: &[Vec3]) -> [f32; 2] {
    let sum = |of: &dyn Fn(Vec3, Vec3) -> f32| picture.iter().zip(full).map(|(a, b)| of(*a, *b)).sum::<f32>();
    let l1 = sum(&|a, b| (a - b).abs().element_sum()) / sum(&|_, b| b.abs().element_sum());
    [l1, (sum(&|a, b| (a - b).length_squared()) / sum(&|_, b| b.length_squared())).sqrt()]
}

#[test]
fn a_picture_without_pixels_or_with_too_many_is_none() {
    for (width, height, supersample) in
        [(0, 0, 3), (0, 9, 3), (9, 0, 3), (9, 9, 0), (MOST_PIXELS, 1, 2), (u32::MAX, 1, 3)]
    {
        assert!(CoherenceMap::new(width, height, &usual(supersample), &[]).is_none());
    }
}

#[test]
fn before_anything_is_seen_the_picture_is_black() {
    let mut map = CoherenceMap::new(5, 4, &usual(3), &[]).expect("a picture");
    assert_eq!(map.picture(Filter::Gaussian, None), [Vec3::ZERO; 20]);
    assert!(map.next_batch(0).is_empty());
}

#[test]
fn when_all_is_evaluated_the_picture_is_the_full_one_to_the_bit() {
    for (size, supersample) in
        [((1, 1), 1), ((1, 1), 3), ((2, 1), 1), ((40, 30), 1), ((13, 7), 3), ((1, 90), 1), ((31, 2), 2)]
    {
        let map = refined(size, supersample, usize::MAX, &disk);
        assert_eq!(map.evaluated(), map.pixels(), "{size:?}");
        let full = full(size, supersample, &disk);
        assert!(map.work_image() == full, "{size:?}");
        let rows = 0..size.1 * supersample;
        let reduction = Reduction::new(Filter::Gaussian, supersample);
        assert!(
            map.picture(Filter::Gaussian, None) == reduction.reduce(&(0..size.1), size.0 * supersample, &full, &rows)
        );
    }
}

#[test]
fn no_evaluated_pixel_is_ever_overwritten() {
    let mut map = CoherenceMap::new(48, 32, &usual(1), &[]).expect("a picture");
    let mut seen_so_far = Vec::new();
    loop {
        let batch = map.next_batch(usize::MAX);
        if batch.is_empty() {
            break;
        }
        map.take(&batch.iter().map(|&point| disk(point)).collect::<Vec<Evaluation>>());
        seen_so_far.extend(batch);
        let image = map.work_image();
        let at = |point: &DVec2| image[point.y as usize * 48 + point.x as usize];
        assert!(seen_so_far.iter().all(|point| at(point) == disk(*point).radiance));
    }
    assert_eq!(seen_so_far.len(), 48 * 32, "each is asked for once");
}

#[test]
fn a_plane_is_met_by_the_corners_alone() {
    let plane = |point: DVec2| {
        let light = 0.4 + 0.001 * point.x + 0.002 * point.y;
        Evaluation { radiance: Vec3::splat(light as f32), object: 1, cost: 1 }
    };
    let size = (97, 50);
    let map = refined(size, 1, 13 * 8, &plane);
    let off = map.work_image().into_iter().zip(full(size, 1, &plane)).map(|(a, b)| (a - b).abs().max_element());
    assert!(off.fold(0.0, f32::max) < 1e-5);
}

#[test]
fn a_straight_edge_at_each_angle_is_near_from_a_tenth_of_the_pixels() {
    for index in 0..16 {
        let normal = DVec2::from_angle(f64::from(index) * std::f64::consts::PI / 16.0);
        // Soft over two pixels, as light through a pixel's own square.
        let edge = |point: DVec2| {
            let part = ((point - 32.3).dot(normal) / 2.0 + 0.5).clamp(0.0, 1.0) as f32;
            Evaluation { radiance: Vec3::splat(0.2 + 0.5 * part), object: 1, cost: 1 }
        };
        let map = refined((65, 65), 1, 65 * 65 / 10, &edge);
        let [l1, l2] = errors(&map.work_image(), &full((65, 65), 1, &edge));
        assert!(l1 < 5e-3 && l2 < 0.025, "{index}: {l1} {l2}");
    }
}

#[test]
fn more_pixels_are_nearer() {
    let size = (120, 90);
    let full = full(size, 2, &disk);
    let error = |share: f64| {
        let map = refined(size, 2, (share * 240.0 * 180.0) as usize, &disk);
        errors(&map.work_image(), &full)[0]
    };
    let errors = [0.02, 0.06, 0.12, 0.3, 1.0].map(error);
    assert!(errors.windows(2).all(|pair| pair[1] <= pair[0]) && errors[1] < 0.01 && errors[4] == 0.0, "{errors:?}");
}

#[test]
fn the_same_pixels_are_evaluated_on_any_number_of_threads() {
    let image = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let map = refined((200, 150), 2, 20_000, &disk);
            (map.samples_per_pixel(), map.picture(Filter::Lanczos, Some(display())))
        })
    };
    let one = image(1);
    assert!(one == image(3));
    assert_eq!(one.0.iter().sum::<u32>(), 20_000);
}

#[test]
fn what_is_no_number_is_excluded() {
    let map = refined((32, 32), 1, usize::MAX, &holes);
    assert!(map.excluded() > 20 && map.excluded() < 300, "{}", map.excluded());
    assert!(map.work_image().iter().all(|pixel| (*pixel - 0.3).abs().max_element() < 1e-6));
    let nothing = refined((8, 8), 3, usize::MAX, &|_| Evaluation { radiance: Vec3::NAN, ..Evaluation::default() });
    assert_eq!(nothing.excluded(), 24 * 24);
    assert!(nothing.picture(Filter::Gaussian, None).iter().all(|pixel| *pixel == Vec3::ZERO));
}

/// Interrupted in the middle of a batch: what was seen counts, and it goes on.
#[test]
fn a_part_of_a_batch_may_be_taken() {
    let mut map = CoherenceMap::new(48, 32, &usual(3), &[]).expect("a picture");
    let batch = map.next_batch(100);
    map.take(&batch.iter().take(3).map(|&point| disk(point)).collect::<Vec<Evaluation>>());
    assert_eq!(map.evaluated(), 3);
    map.take(&[disk(DVec2::ONE)]);
    assert_eq!(map.evaluated(), 3, "the rest is forgotten");
    assert!(map.picture(Filter::Box, None).iter().all(|pixel| pixel.is_finite()));
    assert!(!map.next_batch(100).is_empty());
}

/// Light with noise: rays that a full picture spends one on every pixel make a better one of the few that they are enough for.
#[test]
fn relocated_rays_make_a_better_picture_than_those_of_a_full_one() {
    let size = (160, 120);
    let noise = |point: DVec2| (scatter(point.x.to_bits(), point.y.to_bits()) as f64 / u64::MAX as f64) as f32;
    let evaluate = |point: DVec2| {
        let seen = disk(point);
        Evaluation { radiance: seen.radiance * (0.5 + noise(point)), ..seen }
    };
    let truth = refined(size, 3, usize::MAX, &disk).picture(Filter::Gaussian, None);
    let full = refined(size, 3, usize::MAX, &evaluate);
    let integral = PixelIntegral::new(&usual(3), 0.99, Interval::Linear(0.1), 1);
    let spent = Cell::new(0);
    let relocated = refined(size, 3, full.pixels() / 20, &|point| {
        let seen = integral.mean(point, &evaluate);
        spent.set(spent.get() + seen.cost as usize);
        seen
    });
    assert!(spent.get() <= full.pixels(), "{} rays for {} pixels", spent.get(), full.pixels());
    let [of_full, of_relocated] = [full, relocated].map(|map| errors(&map.picture(Filter::Gaussian, None), &truth));
    assert!((0..2).all(|norm| of_relocated[norm] < 0.9 * of_full[norm]), "{of_relocated:?}, and full {of_full:?}");
}
