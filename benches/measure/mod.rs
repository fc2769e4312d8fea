//! What the benches measure errors with: random points, the exact light there, and the relative RMSE.

#![allow(dead_code, reason = "each bench uses its part")]

use std::path::Path;

use mesher::{BakeOptions, BakeStatistics, Control};
use rayon::prelude::*;
use renderer::{SurfacePoint, spread_by_area};
use scene::{Baked, Rgb, Scene, centroid};
use solver::{Gather, Solution, SolveOptions, Surroundings, solve};

/// The scenes, by the names of their files in data/scenes.
pub const SCENES: [&str; 2] = ["cornell_box", "office"];

/// Points that are looked at, spread by area.
const POINTS: u32 = 4000;

/// Distance of the points from the borders of polygons, metres: a border belongs to two polygons.
const BORDER: f64 = 1e-4;

pub fn read(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/scenes/{name}.obj"));
    formats::read_scene(&path).unwrap().scene
}

/// A scene's light, its leaves coarser or finer: the link error is a multiple of the default.
pub fn solved(scene: &Scene, bounces: Option<u32>, coarseness: f64) -> Solution {
    let default = SolveOptions { link_error: None, bounces };
    let link_error = solve(scene, &default, &|_| ()).link_error * coarseness;
    solve(scene, &SolveOptions { link_error: Some(link_error), bounces }, &|_| ())
}

/// A bake on the leaves and lines that it is given: asked for so little that nothing is refined.
pub fn unrefined(scene: &Scene, solution: &Solution, options: &BakeOptions) -> (Baked, BakeStatistics) {
    let options = BakeOptions { tolerance: 1e6, ..options.clone() };
    let control = Control { progress: &|_| (), stop: &|| false, interrupted: &|| false, watch: None };
    let bake = mesher::bake(scene, solution.clone(), &options, control);
    (bake.baked, bake.statistics)
}

/// Points and the exact gather of a solution at them, W·m⁻².
pub struct Truth {
    pub points: Vec<SurfacePoint>,
    pub values: Vec<Rgb>,
}

impl Truth {
    pub fn of(scene: &Scene, solution: &Solution) -> Self {
        let points = spread_by_area(scene, POINTS, BORDER, 1, |_| true);
        let surroundings = Surroundings::new(scene, solution);
        let gather = Gather::new(&surroundings, solution);
        let exact = |point: &SurfacePoint| {
            let inward = centroid(&scene.outline(point.polygon)) - point.position;
            gather.irradiance_at(point.polygon, point.position, inward)
        };
        Self { values: points.par_iter().map(exact).collect(), points }
    }

    /// The triangle of a bake and the barycentrics under each point.
    pub fn places(&self, baked: &Baked) -> Vec<(u32, f64, f64)> {
        let bvh = baked.bvh();
        let reach = 1e-4 * baked.scene.size();
        let place = |point: &SurfacePoint| baked.locate(&bvh, point.position, point.normal, reach).unwrap();
        self.points.par_iter().map(place).collect()
    }

    /// Root of the mean of ((E − exact) ÷ max(own, mean))², over points and colours.
    pub fn relative_rmse(&self, values: impl IntoIterator<Item = Rgb>) -> f64 {
        let errors = self.errors(values);
        (errors.iter().map(|error| error.length_squared()).sum::<f64>() / (3 * errors.len()) as f64).sqrt()
    }

    /// Mean of |E − exact| ÷ max(own, mean), over points and colours, on which single points have less influence.
    pub fn mean_error(&self, values: impl IntoIterator<Item = Rgb>) -> f64 {
        let errors = self.errors(values);
        errors.iter().map(|error| error.abs().element_sum()).sum::<f64>() / (3 * errors.len()) as f64
    }

    fn errors(&self, values: impl IntoIterator<Item = Rgb>) -> Vec<Rgb> {
        let average = |colour: &Rgb| colour.element_sum() / 3.0;
        let mean = self.values.iter().map(average).sum::<f64>() / self.values.len() as f64;
        let error = |(value, exact): (Rgb, &Rgb)| (value - exact) / average(exact).max(mean);
        values.into_iter().zip(&self.values).map(error).collect()
    }
}

/// The value at x of a curve through points, straight on logarithmic scales; none outside it.
pub fn on_curve(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    let mut curve = curve.to_vec();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pair = curve.windows(2).find(|pair| pair[0].0 <= x && x <= pair[1].0)?;
    let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
    let t = if x1 > x0 { (x / x0).ln() / (x1 / x0).ln() } else { 0.0 };
    Some((y0.ln() + t * (y1 / y0).ln()).exp())
}

pub fn percent(fraction: f64) -> String {
    format!("{:.3} %", 100.0 * fraction)
}
