//! Error against the number of triangles, with no discontinuities, with those that each weight chooses, and with all.
//!
//! `cargo bench --bench discontinuities` prints a page for data/record/. Errors are relative RMSE of the interpolants
//! against the exact gather of the same solution, so that they are errors of representation alone.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod measure;

use measure::{SCENES, Truth, on_curve, percent, read, solved, unrefined};
use mesher::{BakeOptions, Weight};
use scene::{Rgb, Scene};
use solver::Solution;

/// Multiples of the default link error: coarse leaves to fine ones.
const COARSENESS: [f64; 3] = [8.0, 1.0, 0.125];

/// Multiples of the default w_min.
const MINIMUM: [f64; 5] = [32.0, 8.0, 2.0, 1.0, 0.5];

/// Discontinuities a leaf, where k decides alone.
const COUNTS: [u32; 5] = [1, 2, 4, 8, 16];

/// No limit to the discontinuities of a leaf. In the office thousands may meet in one.
const UNLIMITED: u32 = 1000;

const WEIGHTS: [Weight; 2] = [Weight::Ratio, Weight::Change];

fn main() {
    println!("# Discontinuities\n");
    println!(
        "Command: `cargo bench --bench discontinuities`, {}. The figures do not depend",
        env!("CARGO_PKG_VERSION")
    );
    println!(
        "on the machine. Errors: relative RMSE of the interpolants against the exact gather of the same solution at"
    );
    println!(
        "4,000 points, and the mean of its absolute value. Weight `ratio` is that of Hardt & Teller 1996, section 4.2, `change` that of section 7.1."
    );
    for name in SCENES {
        let scene = read(name);
        // Light over reflectors has a mesh of its own, without discontinuities.
        println!("\n## {name}, direct light\n");
        println!("| link error | elements | weight | chosen by | lines | triangles | samples | error | mean |");
        println!("|---|---|---|---|---|---|---|---|---|");
        let mut by_minimum = [Vec::new(), Vec::new()];
        let mut by_count = [Vec::new(), Vec::new()];
        for &coarseness in &COARSENESS {
            let solution = solved(&scene, Some(0), coarseness);
            let case = Case { scene: &scene, truth: Truth::of(&scene, &solution), solution, coarseness };
            case.row("–", "none", Weight::Ratio, 0, 0.0);
            for (i, weight) in WEIGHTS.into_iter().enumerate() {
                for factor in MINIMUM {
                    let minimum = factor * weight.default_minimum(&scene, &case.solution);
                    let chosen = format!("w ≥ {minimum:.3}");
                    let point = case.row(weight.name(), &chosen, weight, UNLIMITED, minimum);
                    by_minimum[i].push((coarseness, point));
                }
            }
            // All lines, to see what k makes of them: at one coarseness, since w_min = 0 finds very many.
            if coarseness == 1.0 {
                for (i, weight) in WEIGHTS.into_iter().enumerate() {
                    for count in COUNTS {
                        let point = case.row(weight.name(), &format!("k = {count}"), weight, count, 0.0);
                        by_count[i].push((coarseness, point));
                    }
                }
                case.row("–", "all", Weight::Ratio, UNLIMITED, 0.0);
            }
        }
        println!("\nThe error of `change` over that of `ratio` at equal triangles, between the ends of both curves:\n");
        println!("| link error | curve | at the fewest | in the middle | at the most |");
        println!("|---|---|---|---|---|");
        for &coarseness in &COARSENESS {
            compare("w_min", coarseness, &by_minimum);
        }
        compare("k", 1.0, &by_count);
    }
}

/// A solution and what its bakes are held against.
struct Case<'a> {
    scene: &'a Scene,
    solution: Solution,
    truth: Truth,
    coarseness: f64,
}

/// Triangles and error.
type Point = (f64, f64);

impl Case<'_> {
    /// Bakes and prints a row of the table.
    fn row(&self, name: &str, chosen: &str, weight: Weight, discontinuities: u32, min_weight: f64) -> Point {
        let options = BakeOptions { discontinuities, weight, min_weight: Some(min_weight), ..BakeOptions::default() };
        let (baked, statistics) = unrefined(self.scene, &self.solution, &options);
        let places = self.truth.places(&baked);
        let values = places.into_iter().map(|(triangle, s, t)| baked.irradiance(triangle, s, t));
        let values: Vec<Rgb> = values.collect();
        let (error, mean) = (self.truth.relative_rmse(values.iter().copied()), self.truth.mean_error(values));
        println!(
            "| × {} | {} | {name} | {chosen} | {} | {} | {} | {} | {} |",
            self.coarseness,
            baked.elements.len(),
            statistics.discontinuities_kept,
            statistics.triangles,
            statistics.samples,
            percent(error),
            percent(mean)
        );
        (statistics.triangles as f64, error)
    }
}

/// A row: how the curves of both weights lie to each other.
fn compare(curve: &str, coarseness: f64, [ratio, change]: &[Vec<(f64, Point)>; 2]) {
    let of = |all: &[(f64, Point)]| -> Vec<Point> {
        all.iter().filter(|(other, _)| *other == coarseness).map(|(_, point)| *point).collect()
    };
    let (ratio, change) = (of(ratio), of(change));
    let ends = |curve: &[Point]| {
        curve.iter().fold((f64::INFINITY, 0.0), |(low, high): Point, point| (low.min(point.0), high.max(point.0)))
    };
    let (a, b) = (ends(&ratio), ends(&change));
    let (low, high) = (a.0.max(b.0), a.1.min(b.1));
    let at = |triangles: f64| {
        let quotient =
            on_curve(&change, triangles).zip(on_curve(&ratio, triangles)).map(|(change, ratio)| change / ratio);
        quotient.map_or("–".to_owned(), |quotient| format!("{quotient:.2} ({triangles:.0})"))
    };
    println!("| × {coarseness} | {curve} | {} | {} | {} |", at(low), at((low * high).sqrt()), at(high));
}
