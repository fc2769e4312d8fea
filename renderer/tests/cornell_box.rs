//! The path tracer against a reference of the Cornell box that another program made: not only close, but off by
//! exactly as much as both their variances say. A tracer with a bias, or with a wrong idea of its own variance, fails.

#![allow(clippy::unwrap_used)]

mod obj_scene;

use std::path::Path;

use glam::DVec3;
use renderer::{PathOptions, irradiance};
use scene::Bvh;

/// Every how many points of the reference are traced: a few seconds' worth.
const STRIDE: usize = 5;

struct Row {
    point: (DVec3, DVec3),
    direct: [DVec3; 2],
    total: [DVec3; 2],
}

fn reference() -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/reference/cornell_box.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with(['#', 'x'])).step_by(STRIDE);
    let row = |line: &str| {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let at = |i: usize| DVec3::new(fields[i], fields[i + 1], fields[i + 2]);
        Row { point: (at(0), at(3)), direct: [at(7), at(13)], total: [at(10), at(16)] }
    };
    rows.map(row).collect()
}

/// Traces the points, and checks that (mine − reference)/√(my variance + its variance) is distributed as it should:
/// a standard normal, widened to Student's t where my variance, known from 32 batches, is the larger.
fn assert_agrees(bounces: Option<u32>, of: impl Fn(&Row) -> [DVec3; 2], precision: f64) {
    let scene = obj_scene::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/scenes/cornell_box.obj")).unwrap();
    let rows = reference();
    let points: Vec<_> = rows.iter().map(|row| row.point).collect();
    let options = PathOptions { samples: 4096, bounces, seed: 3 };
    let estimates = irradiance(&scene, &Bvh::of_scene(&scene), &points, &options);
    for channel in 0..3 {
        let (mut scores, mut variance, mut sum) = (Vec::new(), 0.0, 0.0);
        for (row, estimate) in rows.iter().zip(&estimates) {
            let [truth, error] = of(row);
            let both = estimate.variance[channel] + error[channel] * error[channel];
            if both > 0.0 {
                scores.push((estimate.mean[channel] - truth[channel]) / both.sqrt());
            } else {
                assert_eq!(estimate.mean[channel], truth[channel], "both are certain");
            }
            variance += estimate.variance[channel];
            sum += truth[channel];
        }
        let count = scores.len() as f64;
        assert!(count > 250.0);
        let mean = scores.iter().sum::<f64>() / count;
        let square = scores.iter().map(|z| z * z).sum::<f64>() / count;
        let largest = scores.iter().fold(0.0, |largest: f64, z| largest.max(z.abs()));
        // Four standard deviations each: of a mean of n scores √(1/n), of a mean of their squares, between a normal's
        // √(2/n) and √(2.6/n) for Student's t with 31 degrees, around a mean between 1 and 31/29.
        assert!(mean.abs() < 4.0 / count.sqrt(), "channel {channel}: mean score {mean} of {count}");
        assert!((square - 1.035).abs() < 0.035 + 4.0 * (2.6 / count).sqrt(), "channel {channel}: mean square {square}");
        assert!(largest < 5.5, "channel {channel}: a score of {largest}");
        // And the scores mean something: the tracer is precise enough to notice.
        let relative = (variance * rows.len() as f64).sqrt() / sum;
        assert!(relative < precision, "channel {channel}: standard error {relative} of the mean");
    }
}

#[test]
fn direct_light_agrees() {
    assert_agrees(Some(0), |row| row.direct, 0.002);
}

#[test]
fn all_light_agrees() {
    assert_agrees(None, |row| row.total, 0.025);
}
