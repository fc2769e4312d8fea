//! Bakes against references that share no code with the solver: relative RMSE over points spread by area.

use std::path::Path;

use crate::fixture::{cornell_box, cornell_box_direct, data, folder, office, office_direct, run, text};

/// Part of the light.
#[derive(Clone, Copy, Debug)]
pub enum Part {
    Direct,
    Total,
}

/// A table with a header; lines that start with # are comments.
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|line| !line.starts_with('#')).map(fields);
        Self { header: lines.next().unwrap(), rows: lines.collect() }
    }

    /// Three columns, a prefix and r, g, b; none where a field is empty.
    pub fn colours(&self, prefix: &str) -> Vec<Option<[f64; 3]>> {
        let place = |colour: &str| self.header.iter().position(|name| *name == format!("{prefix}{colour}")).unwrap();
        let places = ["r", "g", "b"].map(place);
        let colour = |row: &Vec<String>| {
            let [r, g, b] = places.map(|place| row[place].parse::<f64>().ok());
            Some([r?, g?, b?])
        };
        self.rows.iter().map(colour).collect()
    }
}

/// How far a probe is from the truth: the root of the mean of ((E − truth) ÷ max(own, mean))², less the truth's own
/// variance; own is the point's truth averaged over its colours, mean that average over all points. Points that met
/// no surface are left out, and may be one in two hundred.
pub fn relative_rmse(truth: &Table, probe: &Table, part: Part) -> f64 {
    let (value, deviation) = match part {
        Part::Direct => ("Ed_", "sed_"),
        Part::Total => ("E_", "se_"),
    };
    let complete = |prefix: &str| truth.colours(prefix).into_iter().collect::<Option<Vec<_>>>().unwrap();
    let (truth, deviations, probe) = (complete(value), complete(deviation), probe.colours("e"));
    assert_eq!(truth.len(), probe.len());
    let average = |colour: &[f64; 3]| colour.iter().sum::<f64>() / 3.0;
    let mean = truth.iter().map(average).sum::<f64>() / truth.len() as f64;
    let (mut squares, mut noise, mut found) = (0.0, 0.0, 0);
    for ((truth, deviation), probe) in truth.iter().zip(&deviations).zip(&probe) {
        let Some(probe) = probe else { continue };
        let scale = average(truth).max(mean);
        for channel in 0..3 {
            squares += ((probe[channel] - truth[channel]) / scale).powi(2);
            noise += (deviation[channel] / scale).powi(2);
        }
        found += 1;
    }
    assert!((truth.len() - found) * 200 <= truth.len(), "{} points met no surface", truth.len() - found);
    ((squares - noise).max(0.0) / (3 * found) as f64).sqrt()
}

/// The figure that data/record/ gives: run with `-- reference --nocapture` to see it.
#[expect(clippy::print_stderr, reason = "the figures are looked at, not only held")]
fn error(scene: &str, bake: &Path, method: &str, part: Part) -> f64 {
    let (folder, points) = (folder(), data(&format!("reference/{scene}.csv")));
    let output = folder.path().join("probe.csv");
    run(&["probe", text(bake), "--points", text(&points), "-o", text(&output), "--method", method]);
    let error = relative_rmse(&Table::read(&points), &Table::read(&output), part);
    assert!(error.is_finite());
    eprintln!("{scene}, {part:?} light, {method}: relative RMSE {:.3} %", 100.0 * error);
    error
}

#[test]
fn cornell_box_direct_light_is_within_one_percent() {
    let error = error("cornell_box", cornell_box_direct(), "interpolant", Part::Direct);
    assert!(error <= 0.01, "{error}");
}

#[test]
fn cornell_box_total_light_is_within_three_percent() {
    let error = error("cornell_box", cornell_box(), "interpolant", Part::Total);
    assert!(error <= 0.03, "{error}");
}

#[test]
fn office_direct_light_is_within_one_percent() {
    let error = error("office", office_direct(), "interpolant", Part::Direct);
    assert!(error <= 0.01, "{error}");
}

#[test]
fn office_total_light_is_within_three_percent() {
    let error = error("office", office(), "interpolant", Part::Total);
    assert!(error <= 0.03, "{error}");
}

/// Without interpolation only the solution's own error is left.
#[test]
fn gathered_light_is_no_worse_than_the_interpolants_may_be() {
    assert!(error("cornell_box", cornell_box_direct(), "gather", Part::Direct) <= 0.01);
    assert!(error("cornell_box", cornell_box(), "gather", Part::Total) <= 0.03);
    assert!(error("office", office_direct(), "gather", Part::Direct) <= 0.01);
    assert!(error("office", office(), "gather", Part::Total) <= 0.03);
}

#[test]
fn the_measure_is_the_one_that_the_figures_are_given_in() {
    let folder = folder();
    let (truth, probe) = (folder.path().join("truth.csv"), folder.path().join("probe.csv"));
    // Means over colours 1 and 3, over all 2: the first error is 0.2 of 2, the second 0.3 of 3; noise is 0.1 of 2.
    std::fs::write(&truth, "# note\nE_r,E_g,E_b,se_r,se_g,se_b\n1,1,1,0.1,0.1,0.1\n3,3,3,0,0,0\n").unwrap();
    std::fs::write(&probe, "x,er,eg,eb\n0,1.2,1.2,1.2\n0,3.3,3.3,3.3\n").unwrap();
    let error = relative_rmse(&Table::read(&truth), &Table::read(&probe), Part::Total);
    let expected = ((0.1f64.powi(2) + 0.1f64.powi(2) - 0.05f64.powi(2)) / 2.0).sqrt();
    assert!((error - expected).abs() < 1e-12, "{error} {expected}");
}
