//! Lights are made to send what the sky sends: their strengths are fitted to the irradiance of unobstructed surfaces of all
//! normals.
//!
//! A light at the mean direction of its cell's light is exact for every surface that has all of the cell above its horizon. Of
//! a cell that a horizon cuts it sends too little on average, since a cosine that is cut off at 0 is convex: with 200 lights in
//! a uniform sky 0.5 % of all. Strengths that differ by a few per cent mend that.

use glam::DVec3;
use rayon::prelude::*;
use scene::Rgb;

use crate::sky_pieces::Piece;

/// Normals that are fitted to at least, and for each light: with fewer than a few a light what is between them is left free.
const NORMALS: u32 = 1024;
const NORMALS_A_LIGHT: u32 = 3;

/// What a relative change of a light counts beside an error of irradiance, in squares of the mean light's own irradiance. Less
/// fits better, and lets single lights stray from the light of their cells, which shows where only some of them are seen.
const STIFFNESS: f64 = 1e-4;

/// Steps of conjugate gradients: the error no longer changes in its third digit.
const STEPS: u32 = 60;

/// The square of the residual, as a fraction of the first one, at which nothing but rounding is left of it.
const SOLVED: f64 = 1e-20;

/// The least that is left of a light, as a fraction.
const LEAST: f64 = 0.1;

/// The strengths of lights, W·m⁻² on a surface that faces them, changed so that all of them send what the pieces send.
pub(crate) fn fitted(pieces: &[Piece], directions: &[DVec3], strengths: &[Rgb]) -> Vec<Rgb> {
    let normals: Vec<DVec3> = spread_normals(NORMALS.max(NORMALS_A_LIGHT * directions.len() as u32)).collect();
    let wanted: Vec<Rgb> = normals.par_iter().map(|&normal| irradiance(pieces, normal)).collect();
    let mut fitted = strengths.to_vec();
    for channel in 0..3 {
        // By normal and light: what the light sends.
        let sent: Vec<f64> = normals
            .iter()
            .flat_map(|n| directions.iter().zip(strengths).map(|(d, s)| d.dot(*n).max(0.0) * s[channel]))
            .collect();
        let rows = || sent.chunks(directions.len());
        let missing: Vec<f64> = rows().zip(&wanted).map(|(row, e)| e[channel] - row.iter().sum::<f64>()).collect();
        let stiffness = STIFFNESS * sent.iter().map(|s| s * s).sum::<f64>() / directions.len() as f64;
        if stiffness <= 0.0 {
            continue;
        }
        let gathered = |values: &[f64]| {
            let mut sums = vec![0.0; directions.len()];
            for (row, value) in rows().zip(values) {
                sums.iter_mut().zip(row).for_each(|(sum, sent)| *sum += sent * value);
            }
            sums
        };
        let changes = solved(&gathered(&missing), |x| {
            let sent: Vec<f64> = rows().map(|row| dot(row, x)).collect();
            gathered(&sent).into_iter().zip(x).map(|(sum, x)| sum + stiffness * x).collect()
        });
        for (light, change) in fitted.iter_mut().zip(changes) {
            light[channel] *= (1.0 + change).max(LEAST);
        }
    }
    fitted
}

/// Irradiance of an unobstructed surface from pieces of sky, W·m⁻².
pub(crate) fn irradiance(pieces: &[Piece], normal: DVec3) -> Rgb {
    pieces.iter().map(|piece| piece.irradiance * piece.direction.dot(normal).max(0.0)).sum()
}

/// Unit vectors spread evenly over the sphere: a spiral of golden angles.
pub(crate) fn spread_normals(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(cos * across, sin * across, z)
    })
}

/// The x for which a symmetric, positive definite `times` gives `right`, by conjugate gradients.
fn solved(right: &[f64], times: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut x = vec![0.0; right.len()];
    let (mut residual, mut way) = (right.to_vec(), right.to_vec());
    let mut square = dot(&residual, &residual);
    let solved = square * SOLVED;
    for _ in 0..STEPS {
        if square <= solved {
            break;
        }
        let image = times(&way);
        let step = square / dot(&way, &image);
        x.iter_mut().zip(&way).for_each(|(x, way)| *x += step * way);
        residual.iter_mut().zip(&image).for_each(|(residual, image)| *residual -= step * image);
        let next = dot(&residual, &residual);
        way.iter_mut().zip(&residual).for_each(|(way, residual)| *way = residual + next / square * *way);
        square = next;
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
